"""What a release offered is there in every later one, as docs/stability.md promises.

``tests/data/releases`` has a folder for each release: its surface as ``scripts/surface.py`` writes it, its robot
files with poses that it computed, and links that its page gave out. A deprecated name still counts as there.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kin
from app.shared.store import Store
from app.viewer.session.state import decode
from scripts import surface

DATA = Path(__file__).parent / "data" / "releases"
RELEASES = sorted(path.name for path in DATA.iterdir())
ROBOTS = sorted(path.relative_to(DATA).as_posix() for path in DATA.glob("*/robots/*.toml"))


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


@pytest.mark.parametrize("release", RELEASES)
def test_python_of_a_release_still_works(release):
    broken = {}
    for name, old in read(release, "surface.json")["python"].items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            new = surface.described(getattr(kin, name))
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
            broken += [f"{route}: {part} {each}" for each in refused(old[part], new[part])]
        for status, fields in old["answers"].items():
            lost = set(fields) - set(new["answers"].get(status, ()))  # a field that was always there stays so
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
    arm = kin.load_robot(DATA / file)
    known = read(release, "poses.json")[name.removesuffix(".toml")]
    np.testing.assert_allclose(kin.fk(arm, known["q"]), known["T"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(kin.fk(arm.id, known["q"]), known["T"], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("release", "case"), [(release, case) for release in RELEASES for case in read(release, "links.json")]
)
def test_a_link_of_a_release_still_opens(release, case):
    showed = read(release, "links.json")[case]
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
