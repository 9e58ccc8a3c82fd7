"""The report about a URDF in the tab Robot: findings with lines, the mended file saved and opened."""

from __future__ import annotations

import html
import re

import numpy as np
import pytest
from fake_browser import FakeBrowser
from test_robot_tab import part, say, shows
from test_uploads import TWO, send
from zips import TWO_JOINTS, packed, robot_files

import kin
from app.viewer.tabs.robot.doctor import Doctor
from app.viewer.tabs.robot.files import Source

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

LONG = TWO_JOINTS.replace('axis xyz="0 1 0"', 'axis xyz="0 3 0"', 1)
assert LONG != TWO_JOINTS
BOTH = LONG.replace('axis xyz="0 1 0"', 'axis xyz="0 5 0"', 1)
assert BOTH != LONG
LINE = LONG[: LONG.index('"0 3 0"')].count("\n") + 1


def report(tab: FakeBrowser) -> str:
    return html.unescape(part(tab, "doctor"))


def upload(tab: FakeBrowser, text: str, name: str = "two.urdf") -> None:
    tab.open_file("robot", name, text)


@pytest.mark.full
def test_an_import_has_a_report_and_the_mended_file_is_saved_and_opened(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        upload(tab, LONG)
        shows(tab, TWO, TWO.q_home)
        assert "1 suspicious; 1 of them can be mended at once." in report(tab)
        assert f"<b>Line {LINE}</b>, joint" in report(tab)
        assert "has the length 3, not 1" in report(tab)
        assert "Mending does not move the tool" in report(tab)
        say(tab, "mended", value="save")
        assert "two-mended.urdf is saved" in tab.html
        say(tab, "mended", value="open")
        tab.wait(lambda: "Nothing is wrong or suspicious." in report(tab))
        assert "Save mended" not in report(tab)
        say(tab, "mended", value="close")
        tab.wait(lambda: 'data-arm="doctor"' not in tab.html)


@pytest.mark.full
def test_each_finding_can_be_mended_by_itself(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        upload(tab, BOTH)
        shows(tab, TWO, TWO.q_home)
        assert "2 suspicious; 2 of them can be mended at once." in report(tab)
        lengths = [int(each) for each in re.findall(r"has the length (\d), not 1", report(tab))]
        assert report(tab).count('aria-checked="true"') == 2
        say(tab, "mended", value="1")
        tab.wait(lambda: "1 of these is chosen" in report(tab))
        assert re.findall(r'aria-checked="(\w+)"', report(tab)) == ["true", "false"]
        say(tab, "mended", value="open")
        tab.wait(lambda: "1 suspicious; 1 of them can be mended at once." in report(tab))
        assert f"has the length {lengths[1]}, not 1" in report(tab)
        assert "Left as it is" in report(tab)  # what was left stays so
        assert "Save mended" not in report(tab)
        say(tab, "mended", value="0")
        tab.wait(lambda: "Save mended" in report(tab))
        say(tab, "mended", value="open")
        tab.wait(lambda: "Nothing is wrong or suspicious." in report(tab))


@pytest.mark.full
def test_all_and_none_are_one_press_and_what_cannot_be_mended_is_refused(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        upload(tab, BOTH)
        tab.wait(lambda: 'data-argument="none"' in report(tab))
        assert 'data-argument="all"' not in report(tab)
        say(tab, "mended", value="none")
        tab.wait(lambda: 'aria-checked="true"' not in report(tab))
        assert "Save mended" not in report(tab)
        say(tab, "mended", value="all")
        tab.wait(lambda: 'aria-checked="false"' not in report(tab))
    doctor = Doctor()
    for what in ("0", "7", "x", "None"):
        with pytest.raises(kin.InputError, match="save, open, close, all, none"):
            doctor.choose(what)


def test_a_refused_file_has_a_report_that_mends_it(port: int) -> None:
    wrong = TWO_JOINTS.replace('axis xyz="0 1 0"', 'axis xyz="0 1,0 0"', 1)
    assert wrong != TWO_JOINTS
    with FakeBrowser(port) as tab:
        tab.settle()
        before = tab.value("Robot")
        upload(tab, wrong)
        assert "The file was not used" in tab.html
        assert tab.value("Robot") == before
        assert "No arm is read:" in report(tab)
        assert "The mended file is read, with 2 joints." in report(tab)
        say(tab, "mended", value="open")
        shows(tab, TWO, TWO.q_home)
        assert "Nothing is wrong or suspicious." in report(tab)


def test_what_is_no_xml_has_a_line(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        upload(tab, "<robot>\n<link>\n</robot>")
        assert "<b>Line 3</b>" in report(tab)
        assert "Save mended" not in report(tab)
        upload(tab, kin.robot_to_toml("ur5"), "ur5.toml")
        tab.wait(lambda: 'data-arm="doctor"' not in tab.html)


@pytest.mark.full
def test_the_meshes_of_a_zip_are_looked_at(port: int) -> None:
    files = robot_files()
    meshes = [name for name in files if not name.endswith(".urdf")]
    lost = {name: data for name, data in files.items() if name != meshes[0]}
    with FakeBrowser(port) as tab:
        tab.settle()
        send(tab, "two.zip", packed(lost))
        tab.wait(lambda: "cannot be used: no such file in the zip" in report(tab))
        send(tab, "two.zip", packed(files))
        tab.wait(lambda: "Nothing is wrong or suspicious." in report(tab))


@pytest.mark.full
@pytest.mark.parametrize("value", ["steal", "", None, 7, ["save"]])
def test_what_the_buttons_do_not_send_changes_nothing(port: int, value: object) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        upload(tab, LONG)
        before = report(tab)
        say(tab, "mended", value=value)
        assert report(tab) == before


@pytest.mark.full
def test_mjcf_is_opened_without_a_report(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        upload(tab, LONG)
        upload(tab, kin.robot_to_mjcf(TWO), "two.xml")
        shows(tab, TWO, TWO.q_home)
        tab.wait(lambda: 'data-arm="doctor"' not in tab.html)
        assert "MJCF" in tab.html
        say(tab, "download", value="mjcf")
        assert ".xml is saved" in tab.html


def test_without_a_report_there_is_nothing_to_open() -> None:
    doctor = Doctor()
    with pytest.raises(kin.InputError, match="mended"):
        _ = doctor.mended
    doctor.look(Source("ur5.toml", kin.robot_to_toml("ur5")))
    assert doctor.found is None
    doctor.look(Source("two.urdf", LONG))
    assert np.allclose(kin.fk(kin.load_robot(doctor.mended.text), [0.3, 0.2]), kin.fk(TWO, [0.3, 0.2]))
