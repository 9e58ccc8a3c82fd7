"""The gripper of a page and its program: set, heard, recorded, played again, and moved by a program's segments."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_code import code_of
from live_server import wait_for
from test_live_page import Program, press

import kin
from app.live.recording import Recording, read, to_csv, to_mcap

ARM = kin.get_robot("so101")
SLIDER = "Gripper (%)"


@pytest.fixture
def shown(page) -> FakeBrowser:
    """The page, with an arm that has a gripper."""
    page.choose(ARM.name)
    return page


@pytest.fixture
def arm(viewer, shown) -> Iterator[Any]:
    with kin.connect(f"http://127.0.0.1:{viewer}", code_of(shown), rate=60) as arm:
        yield arm


def fingers(page: FakeBrowser) -> float:
    """How far the fingers that are drawn are from where they meet, as a part of the way."""
    now = [page.poses[name]["position"] for name in page.nodes if "/finger-" in name]
    assert len(now) == 2
    return float(np.linalg.norm(np.subtract(*now)))


def test_the_opening_goes_both_ways_between_page_and_program(shown, arm):
    wait_for(lambda: arm.gripper == 0.5)
    closed_by_half = fingers(shown)
    shown.set(SLIDER, 100)
    wait_for(lambda: arm.gripper == 1.0)
    shown.wait(lambda: fingers(shown) < 1e-9)
    arm.gripper = 0.0
    assert arm.gripper == 0.0
    shown.wait(lambda: shown.value(SLIDER) == 0)
    shown.wait(lambda: fingers(shown) == pytest.approx(2.0 * closed_by_half))


def test_what_is_no_opening_is_refused(shown, arm):
    wait_for(lambda: arm.gripper == 0.5)
    for value in (1.5, -0.1, float("nan"), "open", True):
        with pytest.raises(kin.InputError, match=r"gripper: .* a number from 0 \(closed\) to 1 \(open\)"):
            arm.gripper = value
    arm.robot = "ur5"
    wait_for(lambda: arm.gripper is None)
    with pytest.raises(kin.InputError, match=r"gripper: .* an arm with a gripper that opens; the page shows UR5"):
        arm.gripper = 0.5


def test_the_page_refuses_it_as_well(viewer, shown):
    with Program(viewer, shown) as program:
        program.send(subscribe={"values": ["gripper"], "rate": 60})
        assert program.hears("gripper", lambda opening: opening == 0.5)
        program.do(gripper=0.25)
        assert program.hears("gripper", lambda opening: opening == 0.25)
        program.heard.clear()
        program.do(gripper=0.25)
        assert "gripper" not in program.heard, "the same is no news"
        assert program.refused(gripper=1.01)["errors"][0]["field"] == "gripper"
        program.do(robot="ur5")
        assert program.hears("gripper", lambda opening: opening is None) is None
        problem = program.refused(gripper=0.5)
        assert "an arm with a gripper that opens; the page shows UR5" in problem["errors"][0]["expected"]


def beside(page: FakeBrowser) -> list[str]:
    """The row of the measured gripper: its opening, the difference from the one on show, the unit."""
    table = page.html.partition("data-live-measured")[2].partition("</table>")[0]
    return re.findall(r"<td[^>]*>([^<]*)</td>", table.partition("<th>Gripper</th>")[2])


def test_a_measured_opening_stands_beside_the_one_on_show(shown, arm):
    wait_for(lambda: arm.gripper == 0.5)
    arm.measured_gripper = 0.81
    assert arm.measured_gripper == 0.81
    shown.wait(lambda: beside(shown) == ["81", "31", "%"])
    arm.measured = ARM.q_home
    shown.wait(lambda: f"<th>{ARM.joints[0].name}</th>" in shown.html)
    assert beside(shown) == ["81", "31", "%"]
    shown.set(SLIDER, 100)
    shown.wait(lambda: beside(shown) == ["81", "−19", "%"])
    arm.measured = None
    shown.wait(lambda: f"<th>{ARM.joints[0].name}</th>" not in shown.html)
    assert beside(shown)
    arm.measured_gripper = None
    shown.wait(lambda: not beside(shown))


def test_the_page_refuses_what_is_no_measured_opening_and_hides_it_when_the_program_leaves(viewer, shown):
    with Program(viewer, shown) as program:
        program.do(measured_gripper=0.5)
        shown.wait(lambda: bool(beside(shown)))
        for value in (1.01, -0.1, "open", True):
            assert program.refused(measured_gripper=value)["errors"][0]["field"] == "measured_gripper"
        program.do(robot="ur5")
        shown.wait(lambda: not beside(shown))
        problem = program.refused(measured_gripper=0.5)["errors"][0]
        assert problem["field"] == "measured_gripper"
        assert "an arm with a gripper that opens; the page shows UR5" in problem["expected"]
        program.do(robot=ARM.id)
        program.do(measured_gripper=0.5)
        shown.wait(lambda: bool(beside(shown)))
        program.socket.close()
        shown.wait(lambda: not beside(shown))


def test_what_is_no_measured_opening_is_refused_by_the_library(shown, arm):
    wait_for(lambda: arm.gripper == 0.5)
    with pytest.raises(kin.InputError, match=r"measured_gripper: .* a number from 0 \(closed\) to 1 \(open\)"):
        arm.measured_gripper = 1.5
    arm.measured_gripper = 0.5
    arm.robot = "ur5"
    wait_for(lambda: arm.gripper is None)
    assert arm.measured_gripper is None
    with pytest.raises(kin.InputError, match=r"measured_gripper: .*the page shows UR5"):
        arm.measured_gripper = 0.5


@pytest.mark.full
def test_a_program_moves_the_gripper_and_its_program_hears_it(shown, arm):
    home = kin.motion.Ptp(ARM.q_home)
    shown.set(SLIDER, 100)
    wait_for(lambda: arm.gripper == 1.0)
    events = arm.events()
    arm.play(kin.motion.Program((home, kin.motion.Gripper(0.2, 0.4), kin.motion.Ptp(ARM.clip(ARM.q_home + 0.1)))))
    heard: list[float] = []
    for event in events:
        if event.kind == "gripper":
            heard.append(event.value)
        if event.kind == "program" and event.value["time"] > 0.0 and not event.value["playing"]:
            break
    assert heard == sorted(heard, reverse=True), "steadily"
    assert len(heard) > 2
    assert heard[-1] == 0.2
    shown.wait(lambda: shown.value(SLIDER) == 20)


def recording() -> Recording:
    """The gripper closes in two steps while the arm stands."""
    made = Recording(ARM, "test.py")
    made.add("/page/q", {"q": ARM.q_home.tolist()})
    for opening in (1.0, 0.6, 0.2):
        made.add("/page/gripper", {"gripper": opening})
    made.add("/sent/measured_gripper", {"measured_gripper": 0.25})
    made.end()
    times = (0.0, 0.0, 1.0, 2.0, 2.0)
    entries = [type(each)(t, each.topic, each.data) for t, each in zip(times, made.entries, strict=True)]
    return Recording(ARM, "test.py").restored(entries, 2.0)


@pytest.mark.parametrize("write", [to_mcap, lambda made: to_csv(made).encode()], ids=["mcap", "csv"])
def test_files_of_recordings_hold_it(write):
    track = read(write(recording()), ARM).track()
    assert [track.opening_at(t) for t in (0.0, 0.9, 1.0, 3.0)] == [1.0, 1.0, 0.6, 0.2]
    assert [track.measured_opening_at(t) for t in (0.0, 1.5, 2.0, 3.0)] == [None, None, 0.25, 0.25]
    assert track.commanded[-1].tolist() == ARM.q_home.tolist()
    without = Recording(ARM)
    without.add("/sent/q", {"q": ARM.q_home.tolist()})
    without.end()
    assert "gripper" not in to_csv(without).splitlines()[0]
    assert read(write(without), ARM).track().opening_at(0.0) is None


@pytest.mark.parametrize("opening", [2.0, -1.0, "open", [0.5], None])
def test_what_is_no_opening_in_a_file_is_not_shown(opening):
    made = Recording(ARM)
    made.add("/sent/gripper", {"gripper": opening})
    made.add("/sent/measured_gripper", {"measured_gripper": opening})
    made.end()
    track = read(to_mcap(made), ARM).track()
    assert track.opening_at(0.0) is track.measured_opening_at(0.0) is None


def test_a_cell_of_the_gripper_that_is_no_number_is_named():
    text = to_csv(recording()).replace(",0.6,\n", ",half,\n")
    with pytest.raises(kin.InputError, match="recording, line 4: got 'half', expected a number"):
        read(text.encode(), ARM)


@pytest.mark.full
def test_a_recording_that_is_opened_moves_the_gripper(shown):
    shown.open_file("connect", "run.mcap", to_mcap(recording()))
    shown.wait(lambda: "run.mcap is open" in shown.html)
    for time, percent in ((0.5, 100), (1.5, 60)):
        shown.send("GuiUpdateMessage", uuid=shown.element("Time (s)"), updates={"value": time})
        shown.wait(lambda percent=percent: shown.value(SLIDER) == percent)  # type: ignore[misc]
    assert not beside(shown)
    press(shown, "Play recording")
    shown.wait(lambda: shown.value(SLIDER) == 20)
    shown.wait(lambda: beside(shown) == ["25", "5", "%"])
    press(shown, "Discard recording")
    shown.wait(lambda: not beside(shown))


@pytest.mark.full
def test_a_program_records_it_and_plays_it_again(shown, arm, tmp_path):
    wait_for(lambda: arm.gripper == 0.5)
    with arm.record(tmp_path / "run.mcap") as made:
        arm.gripper = 0.9
        arm.measured_gripper = 0.7
        shown.wait(lambda: shown.value(SLIDER) == 90)
        wait_for(lambda: made.track().measured_opening_at(1e3) == 0.7)
    assert [made.track().opening_at(t) for t in (0.0, 1e3)] == [0.5, 0.9]
    arm.gripper = 0.1
    shown.wait(lambda: shown.value(SLIDER) == 10)
    arm.measured_gripper = None
    arm.replay(tmp_path / "run.mcap")
    shown.wait(lambda: shown.value(SLIDER) == 90)
    shown.wait(lambda: beside(shown) == ["70", "−20", "%"])


@pytest.mark.full
def test_a_page_records_what_it_shows_of_the_gripper(shown, arm):
    press(shown, "Record the connection")
    shown.wait(lambda: 'data-live-recording="running"' in shown.html)
    shown.set(SLIDER, 30)
    wait_for(lambda: arm.gripper == 0.3)
    press(shown, "Stop recording")
    shown.wait(lambda: 'data-live-recording="ended"' in shown.html)
    shown.set("Save as", "CSV")
    shown.wait(lambda: any(m["type"] == "FileTransferPart" for m in shown.log))
    data = b"".join(bytes(m["content"]) for m in shown.log if m["type"] == "FileTransferPart")
    assert [read(data, ARM).track().opening_at(t) for t in (0.0, 1e3)] == [0.5, 0.3]
