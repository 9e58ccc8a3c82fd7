"""What a release offered is there in every later one, as docs/stability.md promises.

``tests/data/releases`` has a folder for each release, which ``scripts/release.py`` writes: its surface as
``scripts/surface.py`` has it, its robot files with poses that it computed, and links that its page gave out. Names
of Python count from 1.0 on.
"""

from __future__ import annotations

import datetime
import json
import operator
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kin
from app.shared.store import Store
from app.viewer.session.state import decode
from scripts import release as releasing
from scripts import surface

ROOT = Path(__file__).parents[1]
DATA = ROOT / "tests" / "data" / "releases"
RELEASES = sorted(path.name for path in DATA.iterdir())
ROBOTS = sorted(path.relative_to(DATA).as_posix() for path in DATA.glob("*/robots/*.toml"))
# Built-in arms that did not end in their maker's flange, or whose z axis did not point out: where the tool is now,
# as xyz (m) and rpy (rad) in the frame of the tool in that release.
HALF = np.pi / 2
ENDS: dict[str, dict[str, tuple[list[float], list[float]]]] = {
    "1.0.0": {
        "gp8": ([0.08, 0.0, 0.0], [np.pi, -HALF, 0.0]),
        "crx10ia": ([0.0, 0.0, 0.0], [np.pi, -HALF, 0.0]),
        "lrmate200id": ([0.0, 0.0, 0.0], [np.pi, -HALF, 0.0]),
        "jaco2s": ([0.0, 0.0, 0.0], [-HALF, 0.0, -HALF]),
        "sawyer": ([0.0, 0.0, 0.0245], [0.0, 0.0, HALF]),
        "so100": ([0.0, 0.0, 0.0], [HALF, 0.0, 0.0]),
        "z1": ([0.051, 0.0, 0.0], [0.0, HALF, 0.0]),
        **dict.fromkeys(("vx300", "vx300s", "wx250", "wx250s"), ([0.0, 0.0, 0.0], [0.0, HALF, 0.0])),
    }
}
# Nothing waits for kernels any more. What /readyz says is outside of what docs/stability.md promises.
GONE = {"GET /readyz": {"complete!", "kernels!", "kernels.preparing!", "kernels.ready!", "kernels.waiting!"}}
# What only kinds of segments demand that the release did not have: the path of a field does not say of which kind.
OF_NEW_KINDS = {"program.segments[].opening!"}


def read(release: str, name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DATA / release / name).read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def now() -> dict[str, Any]:
    return surface.surface()


def name_of(parameter: str) -> str:
    return parameter.rstrip("=")


def broken_call(old: list[str], new: list[str]) -> list[str]:
    """What of the calls that the old parameters allow the new ones refuse."""
    by_position = new[: new.index("*")] if "*" in new else new
    first = old[: old.index("*")] if "*" in old else old
    found = [
        f"{name_of(each)} is not parameter {k} any more"
        for k, each in enumerate(first)
        if k >= len(by_position) or name_of(by_position[k]) != name_of(each)
    ]
    names = {name_of(each) for each in new} | {"*"}
    found += [f"{name_of(each)} is gone" for each in old if name_of(each) not in names]
    optional = {name_of(each) for each in new if each.endswith("=")}
    required = {name_of(each) for each in old if not each.endswith("=")} | {"*"}
    return found + [f"{each} must be given" for each in sorted(names - optional - required)]


@pytest.mark.parametrize(
    ("new", "said"),
    [
        (["robot", "q", "*", "frame=", "unit="], []),
        (["robot", "q", "frame="], []),
        (["q", "robot", "*", "frame="], ["robot is not parameter 0 any more", "q is not parameter 1 any more"]),
        (["robot", "q", "*", "frame"], ["frame must be given"]),
        (["robot", "q"], ["frame is gone"]),
        (["robot", "q", "*", "unit", "frame="], ["unit must be given"]),
        (["robot", "*", "q", "frame="], ["q is not parameter 1 any more"]),
    ],
)
def test_a_change_that_breaks_a_call_is_seen(new, said):
    assert broken_call(["robot", "q", "*", "frame="], new) == said


@pytest.mark.parametrize("release", [name for name in RELEASES if int(name.partition(".")[0]) >= 1])
def test_python_of_a_release_still_works(release):
    broken = {}
    for name, old in read(release, "surface.json")["python"].items():
        new = surface.described(operator.attrgetter(name)(kin))
        lost = sorted(set(old.get("members", ())) - set(new.get("members", ())))
        faults = [f"{member} is gone" for member in lost] + broken_call(old.get("call", []), new.get("call", []))
        if faults:
            broken[name] = faults
    assert not broken


@pytest.mark.parametrize("release", RELEASES)
def test_requests_of_a_release_are_still_answered(now, release):
    broken = []
    for route, old in read(release, "surface.json")["rest"].items():
        new = now["rest"].get(route)
        if new is None:
            broken.append(f"{route} is gone")
            continue
        for part in ("parameters", "request"):
            wanted = [each for each in refused(old[part], new[part]) if each not in OF_NEW_KINDS]
            broken += [f"{route}: {part} {each}" for each in wanted]
        for status, fields in old["answers"].items():
            lost = set(fields) - set(new["answers"].get(status, ()))  # a field that was always there stays so
            lost -= {
                each for each in lost if each.endswith("rows[].d!")
            }  # sent, as the snapshots of arms show, but
            # generated clients have to read it last (`app.api.document`)
            lost -= GONE.get(route, set())
            broken += [f"{route}: {status} without {each}" for each in sorted(lost)]
    assert not broken


def refused(old: list[str], new: list[str]) -> list[str]:
    """The fields that may no longer be sent, and those that must be sent now in what could be sent before."""
    known = {each.rstrip("!") for each in old}
    gone = known - {each.rstrip("!") for each in new}
    demanded = {each for each in new if each.endswith("!") and parent(each) in known | {""}} - set(old)
    return sorted(gone | demanded)


def parent(field: str) -> str:
    return field.rpartition(".")[0].removesuffix("[]")


def test_a_request_that_would_be_refused_is_seen():
    old = ["target!", "target.position", "q_seed"]
    assert refused(old, ["target!", "target.position", "q_seed", "walls", "walls[].size!"]) == []
    assert refused(old, ["target!", "target.position!", "q_seed!"]) == ["q_seed!", "target.position!"]
    assert refused(old, ["target!", "target.position"]) == ["q_seed"]


@pytest.mark.parametrize("release", RELEASES)
def test_commands_of_a_release_still_have_their_options(now, release):
    for command, words in read(release, "surface.json")["cli"].items():
        assert set(words) <= set(now["cli"][command]), command


@pytest.mark.parametrize("file", ROBOTS)
def test_a_robot_file_of_a_release_is_the_same_arm(file):
    release, _, name = file.split("/")
    name = name.removesuffix(".toml")
    end = ENDS.get(release, {}).get(name, ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]))
    assert_same_arm(DATA / file, read(release, "poses.json")[name], kin.pose_from_xyz_rpy(*end))


def assert_same_arm(file: Path, known: dict[str, Any], end: Any = None) -> None:
    """The file has the poses that its release computed, the built-in arm of its id those of this end on it."""
    arm = kin.load_robot(file)
    np.testing.assert_allclose(kin.fk(arm, known["q"]), known["T"], rtol=0, atol=1e-12)
    now = known["T"] if end is None else np.array(known["T"]) @ end
    np.testing.assert_allclose(kin.fk(arm.id, known["q"]), now, rtol=0, atol=1e-12)


def test_the_changelog_names_every_arm_whose_end_has_moved():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    for release, arms in ENDS.items():
        since = text[: text.index(f"## [{release}]")]
        assert [name for name in arms if f"`{name}`" not in since] == []


@pytest.mark.parametrize(
    ("release", "case"), [(release, case) for release in RELEASES for case in read(release, "links.json")]
)
def test_a_link_of_a_release_still_opens(release, case):
    assert_opens(read(release, "links.json")[case])


def assert_opens(showed: dict[str, Any]) -> None:
    page = decode(showed["link"], Store().robots)
    assert (page.robot, page.task, page.branch, page.lesson) == tuple(
        showed[name] for name in ("robot", "task", "branch", "lesson")
    )
    assert [page.units.degrees, page.units.length] == showed["units"]
    assert list(page.locks) == showed["locks"]
    assert page.view.frames == showed["frames"]
    for name, digits in (("q", 1e-8), ("target", 1e-8), ("camera", 1e-4)):
        value = getattr(page, name)
        assert (value is None) == (showed[name] is None), name
        if value is not None:
            np.testing.assert_allclose(value, showed[name], rtol=0, atol=digits, err_msg=name)


# How a release is made


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The files that name the version."""
    for name, _, _ in releasing.PLACES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def test_a_release_has_its_version_and_date_in_every_place(checkout):
    before = {name: (checkout / name).read_text(encoding="utf-8") for name, _, _ in releasing.PLACES}
    releasing.set_version(checkout, "9.8.7", datetime.date(2031, 2, 3))
    after = {name: (checkout / name).read_text(encoding="utf-8") for name in before}
    assert after["kin/_version.py"] == '__version__ = "9.8.7"\n'
    assert "\nARG VERSION=9.8.7\n" in after["Dockerfile"]
    assert {"version: 9.8.7", "date-released: 2031-02-03"} <= set(after["CITATION.cff"].splitlines())
    headings = re.findall(r"^## .*", after["CHANGELOG.md"], re.MULTILINE)
    assert headings[:2] == ["## [Unreleased]", "## [9.8.7] – 2031-02-03"]
    assert '"Development Status :: 5 - Production/Stable"' in after["pyproject.toml"]
    for name, text in after.items():
        same = set(before[name].splitlines()) & set(text.splitlines())
        assert len(set(before[name].splitlines()) - same) <= 2, f"{name} lost more than its version"


@pytest.mark.parametrize(("version", "said"), [("0.2.0", "not newer"), ("0.1.9", "not newer"), ("1.0", "such as")])
def test_what_is_no_newer_version_is_refused_and_changes_nothing(checkout, version, said):
    (checkout / "kin/_version.py").write_text('__version__ = "0.2.0"\n', encoding="utf-8")
    before = {name: (checkout / name).read_bytes() for name, _, _ in releasing.PLACES}
    with pytest.raises(ValueError, match=said):
        releasing.set_version(checkout, version, datetime.date(2031, 2, 3))
    assert before == {name: (checkout / name).read_bytes() for name in before}


def test_a_file_without_a_place_for_the_version_is_named(checkout):
    (checkout / "CITATION.cff").write_text("title: Kinboard\n", encoding="utf-8")
    old = (checkout / "kin/_version.py").read_bytes()
    with pytest.raises(ValueError, match=r"CITATION\.cff has 0 places"):
        releasing.set_version(checkout, "9.8.7", datetime.date(2031, 2, 3))
    assert (checkout / "kin/_version.py").read_bytes() == old


def test_a_release_leaves_what_later_versions_are_held_to(tmp_path, now):
    (tmp_path / "0.1.0" / "robots").mkdir(parents=True)
    old = [arm.id for arm in kin.builtin_robots().values() if arm.id not in ("ur5", "gantry", "sawyer")]
    for name in old:
        (tmp_path / "0.1.0" / "robots" / f"{name}.toml").touch()
    folder = releasing.write_evidence(tmp_path, "9.8.7")
    found = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in folder.glob("*.json")}
    assert found["surface.json"] == now | {"version": "9.8.7"}
    assert sorted(found["poses.json"]) == ["gantry", "sawyer", "ur5"]
    for name, known in found["poses.json"].items():
        assert np.shape(known["T"]) == (3, 4, 4)
        assert_same_arm(folder / "robots" / f"{name}.toml", known)
    assert set(found["links.json"]) >= set(read("0.2.0", "links.json"))
    for showed in found["links.json"].values():
        assert_opens(showed)


def test_the_page_about_the_new_version_has_one_name_and_is_not_of_an_old_one():
    title = re.match(r"# New in (\d+)\.(\d+)\n", (ROOT / "docs/new.md").read_text(encoding="utf-8"))
    name = f"{title[1]}.{title[2]}"
    assert f"[new in {name}](docs/new.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"- New in {name}: new.md\n" in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert (int(title[1]), int(title[2])) >= tuple(int(part) for part in kin.__version__.split(".")[:2])
