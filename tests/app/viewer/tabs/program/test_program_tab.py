"""The tab *Program* in a page: recording, playing, undo, locks, own arms, and the link."""

from __future__ import annotations

import html
import json
import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from fake_browser import FakeBrowser
from program_page import part, press

import kin
from app.exports.motion import FORMATS
from app.exports.motion_snippets import SNIPPETS
from app.exports.snippets import Service
from app.shared.store import Store
from app.viewer.session.state import decode
from app.viewer.tabs.program.postures import PLACES
from app.viewer.tabs.program.program import MOST
from app.viewer.tabs.program.views import MOTIONS
from kin.motion.planning.starts import segment_poses

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, UR5 = STORE.get("pioneer5"), STORE.get("ur5")
TURN = "1 rotating base"


@pytest.fixture(scope="module")
def page(port: int) -> Iterator[FakeBrowser]:
    """One connection for most tests of this file."""
    with FakeBrowser(port) as tab:
        tab.settle()
        yield tab


@pytest.fixture
def tab(page: FakeBrowser) -> FakeBrowser:
    """The shared page with the first arm and without a program."""
    page.choose(PIONEER.name)
    for name, value in (("loop", False), ("rate", 1.0), ("compare", ""), ("joint", ""), ("ghosts", False)):
        press(page, name, value=value)
    home = f"[[segments]]\nkind = 'ptp'\nq = {PIONEER.q_home.tolist()}\n"
    press(page, "upload", value=["home.toml", home])
    press(page, "go", 0)
    shows(page, PIONEER, PIONEER.q_home)
    press(page, "clear")
    return page


def clock(tab: FakeBrowser) -> dict[str, str]:
    return dict(re.findall(r'data-(\w+)="([^"]*)"', part(tab, "clock")))


def is_drawn(tab: FakeBrowser, name: str) -> bool:
    """Whether the scene has this part of the program; one that is drawn again has a number."""
    found = [node for node in tab.nodes if re.search(rf"/{name}(~\d+)?$", node)]
    return any(tab.visible.get(node, True) for node in found)


def titles(tab: FakeBrowser) -> list[str]:
    return [html.unescape(t) for t in re.findall(r'kb-program-title" dir="auto">(.*?)<', part(tab, "list"))]


def turned(degrees: float, robot: kin.Robot = PIONEER) -> np.ndarray:
    q = robot.q_home.copy()
    q[0] = math.radians(degrees)
    return q


def shows(tab: FakeBrowser, robot: kin.Robot, q: np.ndarray) -> None:
    T = kin.fk(robot, q)
    tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=1e-5))


def record(tab: FakeBrowser, *degrees: float) -> None:
    for angle in degrees:
        tab.set(TURN, angle)
        shows(tab, PIONEER, turned(angle))
        press(tab, "record")


@pytest.mark.full
def test_recorded_poses_are_played(tab: FakeBrowser) -> None:
    record(tab, 20, 50)
    assert titles(tab) == ["Waypoint 1", "Waypoint 2"]
    program = [kin.motion.Ptp(target=kin.motion.JointTarget(tuple(turned(50))))]
    motion = kin.plan_motion(PIONEER, program, turned(20))
    assert float(clock(tab)["duration"]) == pytest.approx(motion.duration, abs=2e-3)
    tab.set(TURN, 100)
    shows(tab, PIONEER, turned(100))
    press(tab, "play")
    tab.wait(lambda: clock(tab)["playing"] == "1")
    tab.wait(lambda: clock(tab)["playing"] == "0")
    assert clock(tab)["time"] == clock(tab)["duration"]
    shows(tab, PIONEER, turned(50))
    press(tab, "scrub", value=0.0)
    shows(tab, PIONEER, turned(20))
    tab.wait(lambda: tab.script["undo"] == "Time of the program")


@pytest.mark.full
def test_the_link_has_the_end_of_a_program_that_was_played(tab: FakeBrowser) -> None:
    record(tab, 10, 170)
    tab.set(TURN, 100)
    shows(tab, PIONEER, turned(100))
    press(tab, "play")
    tab.wait(lambda: clock(tab)["playing"] == "1")
    tab.kept.clear()
    tab.wait(lambda: clock(tab)["playing"] == "0")
    shows(tab, PIONEER, turned(170))

    def kept() -> np.ndarray:
        q = decode(tab.kept[-1], STORE.robots).q if tab.kept else None
        return np.zeros(PIONEER.n) if q is None else q

    tab.wait(lambda: np.allclose(kept(), turned(170), atol=1e-6))


@pytest.mark.full
def test_moving_the_arm_ends_playing(tab: FakeBrowser) -> None:
    record(tab, 10, 170)
    press(tab, "loop", value=True)
    press(tab, "play")
    tab.wait(lambda: float(clock(tab)["time"]) > 0.05)
    tab.set(TURN, 35)
    tab.wait(lambda: clock(tab)["playing"] == "0")
    shows(tab, PIONEER, turned(35))


@pytest.mark.full
def test_every_change_can_be_undone(tab: FakeBrowser) -> None:
    record(tab, 20, 50)
    press(tab, "field", 1, value=["name", "<b>above</b>"])
    assert titles(tab) == ["Waypoint 1", "<b>above</b>"]
    press(tab, "duplicate", 0)
    press(tab, "up", 2)
    assert titles(tab) == ["Waypoint 1", "<b>above</b>", "Waypoint 3"]
    press(tab, "delete", 0)
    press(tab, "clear")
    assert titles(tab) == []
    counts = {"Clear the program": 2, "Delete": 3, "Move up": 3, "Duplicate": 2, "Waypoint": 2, "Record a pose": 1}
    for label, count in (*counts.items(), ("Joint 1", 1), ("Record a pose", 0)):
        # The list and the history come by two connections.
        tab.wait(lambda label=label: tab.script["undo"] == label)  # type: ignore[misc]
        tab.say("undo")
        tab.wait(lambda count=count: len(titles(tab)) == count)  # type: ignore[misc]
    tab.say("redo")
    tab.wait(lambda: titles(tab) == ["Waypoint 1"])


def test_undoing_the_row_that_is_open_shows_the_rows_that_are_left(tab: FakeBrowser) -> None:
    record(tab, 20, 50)
    press(tab, "choose", 1)
    assert "kb-program-open" in part(tab, "list")
    tab.say("undo")
    tab.wait(lambda: titles(tab) == ["Waypoint 1"])
    assert "kb-program-open" not in part(tab, "list")
    press(tab, "pause")
    assert titles(tab) == ["Waypoint 1", "Pause"]


def programs(link: str) -> dict[str, object]:
    return decode(link, STORE.robots).features.get("program", {}).get("programs", {})  # type: ignore[return-value]


@pytest.mark.full
def test_a_program_lives_in_the_link_one_for_each_robot(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 20, 50)
        press(tab, "field", 1, value=["speed", "50"])
        tab.choose(UR5.name)
        tab.wait(lambda: titles(tab) == [])
        press(tab, "record")
        tab.wait(lambda: bool(tab.kept) and set(programs(tab.kept[-1])) == {"pioneer5", "ur5"})
        link = tab.kept[-1]
    with FakeBrowser(port, memory=json.dumps({"state": link})) as tab:
        tab.wait(lambda: titles(tab) == ["Waypoint 1"])
        tab.choose(PIONEER.name)
        tab.wait(lambda: titles(tab) == ["Waypoint 1", "Waypoint 2"])
        assert "PTP at 50 %" in part(tab, "list")


def type_limit(tab: FakeBrowser, text: str) -> None:
    """Type the upper limit of the first row in the tab *Robot*."""
    revision = int(re.findall(r'data-revision="(\d+)"', tab.html.split('data-arm="table"')[1])[0])
    number = tab.say("feature", ["robot", ["cell", 0, "high"], [revision, text]])
    tab.wait(lambda: tab.script["reply"][0] >= number)


@pytest.mark.full
def test_an_arm_of_ones_own_has_a_program_and_a_refusal_is_at_its_waypoint(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 20)
        type_limit(tab, "170")
        tab.wait(lambda: titles(tab) == [])
        record(tab, 20, 150, 40)
        assert titles(tab) == ["Waypoint 1", "Waypoint 2", "Waypoint 3"]
        type_limit(tab, "100")
        rows = part(tab, "list").split("<li")
        assert ["kb-fault" in row for row in rows[1:]] == [False, True, False]
        assert "Segment 2 (PTP) cannot be driven: the target is outside the limits" in rows[2]
        assert 'aria-disabled="true" aria-label="Play"' in part(tab, "player")
        tab.say("undo")
        tab.wait(lambda: "kb-fault" not in part(tab, "list"))


@pytest.mark.full
def test_a_locked_joint_keeps_its_value(port: int) -> None:
    with FakeBrowser(port) as tab:
        record(tab, 20, 50)
        lock = next(
            u for u, m in tab.gui.items() if m["type"] == "GuiButtonGroupMessage" and "1" in m["props"]["options"]
        )
        tab.send("GuiUpdateMessage", uuid=lock, updates={"value": "1"})
        words = "Joint 1 is locked at 50.0°, and this waypoint has it at 20.0°"
        tab.wait(lambda: words in html.unescape(part(tab, "list")))
        before = tab.tool_pose()
        press(tab, "play")
        assert clock(tab)["playing"] == "0"
        assert np.allclose(tab.tool_pose(), before)


@pytest.mark.full
def test_a_line_that_cannot_be_driven_says_what_would_help(tab: FakeBrowser) -> None:
    record(tab, 10, 170)
    press(tab, "field", 1, value=["kind", "lin"])
    assert "Segment 2 (LIN) cannot be driven" in part(tab, "list")
    assert part(tab, "list").count("kb-fault") == 1
    assert is_drawn(tab, "fault-way"), "the line is red in the scene"
    assert 'data-program-do="ptp" data-index="1"' in part(tab, "list")
    press(tab, "ptp", 1)
    assert "kb-fault" not in part(tab, "list")
    assert not is_drawn(tab, "fault-way")
    tab.say("undo")
    tab.wait(lambda: "kb-fault" in part(tab, "list"))


NEAR = [215.70215832, -94.13277042, 106.01340862, -101.8806382, -90.0, 35.70215832]
FAR = [209.38701291, -192.42399488, 91.0728513, 11.35114358, -90.0, 29.38701291]
OTHER = "Arrives in another posture"


def line_of_the_ur5(tab: FakeBrowser, *more: str) -> None:
    """A line between two recorded postures of the UR5 that do not lead to one another."""
    segments = [("ptp", f"q = {NEAR}"), ("lin", f"q = {FAR}"), *(each.split(" ", 1) for each in more)]
    rows = "".join(f"[[segments]]\nkind = '{kind}'\n{target}\n" for kind, target in segments)
    press(tab, "upload", value=["line.toml", f"units = {{ angle = 'deg' }}\n{rows}"])


def recorded(tab: FakeBrowser, index: int) -> np.ndarray:
    """The joint values in the fields of a waypoint, in radians."""
    if f'data-index="{index}" aria-expanded="true"' not in part(tab, "list"):
        press(tab, "choose", index)
    fields = inputs(tab)
    return np.radians([float(fields[f"q{i}"].replace("−", "-")) for i in range(6)])


@pytest.fixture
def ur5(page: FakeBrowser) -> Iterator[FakeBrowser]:
    page.choose(UR5.name)
    press(page, "clear")
    yield page
    home = f"[[segments]]\nkind = 'ptp'\nq = {UR5.q_home.tolist()}\n"
    press(page, "upload", value=["home.toml", home])
    press(page, "go", 0)
    shows(page, UR5, UR5.q_home)
    press(page, "clear")


@pytest.mark.full
def test_a_line_that_arrives_otherwise_shows_its_true_values_and_each_remedy_holds(ur5: FakeBrowser) -> None:
    line_of_the_ur5(ur5)
    assert part(ur5, "list").count(OTHER) == 1
    before, after = recorded(ur5, 0), recorded(ur5, 1)
    words = html.unescape(part(ur5, "list"))
    assert "is 149.3° away" in words
    shown = re.findall(r"On arrival:</span> (.*?)</p>", words)[0]
    arrival = np.radians([float(text.replace("−", "-")) for text in shown.split(", ")])
    press(ur5, "go", 1)
    shows(ur5, UR5, arrival)

    press(ur5, "take", 1)
    assert OTHER not in part(ur5, "list")
    assert np.allclose(recorded(ur5, 1), arrival, atol=1e-5)
    ur5.say("undo")
    ur5.wait(lambda: OTHER in part(ur5, "list"))

    press(ur5, "start", 1)
    assert OTHER not in part(ur5, "list")
    assert np.allclose(recorded(ur5, 1), after, atol=1e-6)
    start = recorded(ur5, 0)
    assert np.abs(start - before).max() > 1.0
    assert np.abs(kin.fk(UR5, start) - kin.fk(UR5, before)).max() < 1e-4
    ur5.say("undo")
    ur5.wait(lambda: OTHER in part(ur5, "list"))

    press(ur5, "ptp", 1)
    assert OTHER not in part(ur5, "list")
    assert np.allclose(recorded(ur5, 1), after, atol=1e-6)


@pytest.mark.full
def test_a_program_that_cannot_be_driven_keeps_what_can_and_says_where_it_ends(ur5: FakeBrowser) -> None:
    line_of_the_ur5(ur5, "ptp q = [180, -110, 110, -90, -90, 0]", "lin q = [0, -110, 110, -90, -90, 0]")
    assert "The program ends on the way to 4 of 4" in ur5.html
    rows = part(ur5, "list").split("<li")[1:]
    assert ["kb-fault" in row for row in rows] == [False, False, False, True]
    times = [re.findall(r'kb-program-at">(.*?)<', row)[0] for row in rows]
    assert [bool(text) for text in times] == [True, True, True, False]
    assert float(clock(ur5)["duration"]) > float(times[2].split()[0])
    assert 'aria-disabled="true"' not in part(ur5, "player")
    assert "kb-motion-curve" in part(ur5, "plot")
    assert "Up to where the program ends" in part(ur5, "summary")
    assert "kin.plan_motion(" in part(ur5, "files")
    press(ur5, "scrub", value=float(clock(ur5)["duration"]) - 0.05)
    press(ur5, "play")
    ur5.wait(lambda: clock(ur5)["playing"] == "0")
    ur5.wait(lambda: "The program ends on the way to 4" in ur5.html)
    assert clock(ur5)["time"] == clock(ur5)["duration"]
    ur5.drag(kin.fk(UR5, UR5.q_home))
    ur5.wait(lambda: "Reached, but the program cannot be driven to its end" in ur5.html)
    press(ur5, "clear")
    ur5.wait(lambda: "cannot be driven to its end" not in ur5.html)


@pytest.mark.full
def test_a_file_is_opened_and_one_that_does_not_fit_is_refused(tab: FakeBrowser) -> None:
    text = "units = { angle = 'deg' }\n" + "[[segments]]\nkind = 'ptp'\nq = [90, 30, 60, 30, 30]\n" * 2
    press(tab, "upload", value=["two.toml", text])
    assert titles(tab) == ["Waypoint 1", "Waypoint 2"]
    for name, content in (
        ("wrong.toml", "kind ="),
        ("other.toml", text.replace(", 30]", "]")),
        ("big.toml", None),
    ):
        press(tab, "upload", value=[name, content])
        tab.wait(lambda: "The file was not used" in tab.html)
        assert titles(tab) == ["Waypoint 1", "Waypoint 2"]


HERE = "[[segments]]\nkind = 'ptp'\nq = [0.5, 0.6, 0.7, 0.5, 0.5]\n"


@pytest.mark.full
@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HERE + "[[segments]]\nkind = 'lin'\nposition = [9, 9, 9]\n", ("segments[1]", "the nearest is", "m away")),
        (HERE + HERE + "tool_speed = 0\n", ("segments[1].tool_speed", "0")),
        (HERE + HERE + "speed = 0\n", ("segments[1].speed", "0")),
        (HERE + HERE + "acceleration = nan\n", ("segments[1].acceleration", "nan")),
        (
            HERE + "[[segments]]\nkind = 'dwell'\nseconds = 1\n" * 700,
            ("701 waypoints and pauses", f"at most {MOST}"),
        ),
        (HERE * 500, ("500 waypoints and pauses", f"at most {MOST}")),
        (None, ("The file was not used", "a file of at most 30 kB")),
    ],
    ids=[
        "outside the workspace",
        "no tool speed",
        "no speed",
        "nan",
        "701 pauses",
        "500 waypoints",
        "ten thousand waypoints",
    ],
)
def test_a_file_that_cannot_be_driven_or_held_is_named_and_nothing_is_lost(
    tab: FakeBrowser, text: str | None, words: tuple[str, ...]
) -> None:
    record(tab, 20)
    press(tab, "upload", value=["bad.toml", text])
    tab.wait(lambda: all(each in html.unescape(tab.html) for each in ('data-status="error"', *words)))
    assert titles(tab) == ["Waypoint 1"]
    assert clock(tab)["duration"] == "0.000"


@pytest.mark.full
def test_postures_on_the_way_are_shown_and_a_click_starts_there(ur5: FakeBrowser) -> None:
    line_of_the_ur5(ur5)
    before, _ = recorded(ur5, 0), recorded(ur5, 1)
    press(ur5, "postures", 1)
    ur5.wait(lambda: "kb-posture-list" in part(ur5, "postures"))
    shown = html.unescape(part(ur5, "postures"))
    motion = kin.plan_motion(
        UR5, kin.motion.parse_program(f"[[segments]]\nkind='lin'\nq={np.radians(FAR).tolist()}"), before
    )
    found = kin.path.path_postures(UR5, segment_poses(motion, 0, PLACES), q_start=before)
    assert shown.count("<li>") == len(found.postures)
    assert f"gets through in {len(found.through)} of {len(found.postures)} postures" in shown
    assert shown.count("<span>the whole way") == len(found.through)
    row = next(row for row in found.through if row != int(found.rows[0]))
    press(ur5, "begin", 1, value=str(row))
    start = recorded(ur5, 0)
    assert np.abs(start - found.q[0, row]).max() < 1e-4
    assert kin.branch_of(UR5, start) == found.postures[row]
    assert part(ur5, "postures") == "", "another program has another chart"
    for value in ("x", "99", None, "-1"):
        press(ur5, "begin", 1, value=value)
    assert np.array_equal(recorded(ur5, 0), start)
    press(ur5, "postures", 0)
    ur5.wait(lambda: "There is no way to show" in html.unescape(part(ur5, "postures")))
    press(ur5, "close-postures")
    assert part(ur5, "postures") == ""


@pytest.mark.full
def test_a_motion_over_time_is_saved_in_each_format(ur5: FakeBrowser) -> None:
    line_of_the_ur5(ur5)
    for name, title in MOTIONS.items():
        assert f'data-argument="{name}">{title}<' in part(ur5, "files")
        press(ur5, "save", value=name)
        ur5.wait(lambda name=name: f"ur5-motion{FORMATS[name].suffix} is saved" in ur5.html)  # type: ignore[misc]
    press(ur5, "save", value="pdf")
    ur5.wait(lambda: "The motion was not saved" in ur5.html)


def test_a_program_has_an_end(tab: FakeBrowser) -> None:
    for _ in range(MOST + 2):
        press(tab, "record")
    assert len(titles(tab)) == MOST
    assert "The program is full" in tab.html


@pytest.mark.parametrize(
    ("key", "value"),
    [("scrub", "x"), ("scrub", -1), ("rate", 3), ("field", ["q", 1]), ("upload", 5), ("nothing", 1)],
)
def test_messages_that_no_control_sends(tab: FakeBrowser, key: str, value: object) -> None:
    press(tab, "record")
    press(tab, key, *([0] if key == "field" else []), value=value)
    tab.wait(lambda: 'data-status="error"' in tab.html)
    press(tab, "record")
    assert titles(tab) == ["Waypoint 1", "Waypoint 2"]


def inputs(tab: FakeBrowser) -> dict[str, str]:
    """The fields of the open waypoint and their texts."""
    return {
        name: html.unescape(value)
        for name, value in re.findall(
            r'data-program-field="(\w+)" data-index="\d+" value="(.*?)"', part(tab, "list")
        )
    }


def test_the_values_of_a_waypoint_are_typed_as_joints_or_as_a_pose(tab: FakeBrowser) -> None:
    record(tab, 20)
    press(tab, "choose", 0)
    assert inputs(tab)["q0"] == "20.000"
    press(tab, "field", 0, value=["q0", "30.125"])
    assert inputs(tab)["q0"] == "30.125"
    press(tab, "field", 0, value=["q0", "1000"])
    assert "outside the limits" in tab.html
    assert inputs(tab)["q0"] == "30.125"
    press(tab, "field", 0, value=["values", "pose"])
    x, y, z = map(float, inputs(tab)["position"].replace("−", "-").split())
    press(tab, "field", 0, value=["position", f"{x:.3f} {y:.3f} {z - 10:.3f}"])
    assert inputs(tab)["position"].split()[2].replace("−", "-") == f"{z - 10:.3f}"
    press(tab, "go", 0)
    tab.wait(lambda: abs(1000 * tab.tool_pose()[2, 3] - (z - 10)) < 1e-3)
    press(tab, "field", 0, value=["values", "joints"])


def test_an_arc_has_a_via_point_and_a_spline_its_points(tab: FakeBrowser) -> None:
    tab.choose(UR5.name)
    press(tab, "clear")
    names = [label for label in tab.sliders if label[0].isdigit()]
    for k in range(3):
        press(tab, "record")
        q = UR5.q_home + np.array([0.1, 0.08, -0.1, 0.0, 0.0, 0.0]) * (k + 1)
        if k < 2:
            for joint in range(3):
                tab.set(names[joint], math.degrees(q[joint]))
            tab.wait(lambda q=q: np.allclose(tab.tool_pose(), kin.fk(UR5, q), atol=1e-3))  # type: ignore[misc]
    press(tab, "field", 2, value=["kind", "circ"])
    assert "CIRC" in part(tab, "list")
    assert any("/via-" in name for name in tab.nodes)
    assert len(inputs(tab)["via"].split()) == 3
    for field, text in (("acceleration", "50"), ("blend", "15"), ("tool_speed", "120"), ("tool_turn", "90")):
        press(tab, "field", 2, value=[field, text])
    assert [inputs(tab)[name] for name in ("acceleration", "blend", "tool_speed", "tool_turn")] == [
        "50",
        "15",
        "120",
        "90",
    ]
    press(tab, "via", 2)  # where the tool is: at the waypoint itself
    assert "Segment 3 (CIRC) cannot be driven" in part(tab, "list")
    press(tab, "field", 1, value=["kind", "spline"])
    press(tab, "field", 2, value=["kind", "spline"])
    assert titles(tab) == ["Waypoint 1", "Spline"]
    assert "spline through 2 points" in part(tab, "list")
    assert "kb-fault" not in part(tab, "list")


def test_the_points_of_a_spline_are_added_typed_moved_and_deleted_in_its_row(tab: FakeBrowser) -> None:
    record(tab, 20, 50)
    press(tab, "choose", 1)
    press(tab, "field", 1, value=["kind", "spline"])

    def points() -> list[np.ndarray]:
        tab.wait(lambda: bool(tab.kept) and "pioneer5" in programs(tab.kept[-1]))
        row = kin.motion.program_from_dict(programs(tab.kept[-1])["pioneer5"], PIONEER).segments[-1]  # type: ignore[arg-type]
        return [np.array(each.position) for each in getattr(row, "points", ())]

    def shown(count: int) -> bool:
        return len(re.findall(r'data-program-do="point"', part(tab, "list"))) == count

    tab.set(TURN, 80)
    shows(tab, PIONEER, turned(80))
    press(tab, "add-point", 1)
    assert shown(2)
    at = [kin.fk(PIONEER, turned(angle))[:3, 3] for angle in (50, 80)]
    tab.wait(lambda: len(points()) == 2 and np.allclose(points(), at, atol=1e-6))
    press(tab, "shift-point", 1, value="-1")
    tab.wait(lambda: np.allclose(points(), at[::-1], atol=1e-6))
    press(tab, "shift-point", 1, value="-1")  # the first one stays the first
    press(tab, "point", 1, value="1")
    press(tab, "field", 1, value=["values", "joints"])
    assert float(inputs(tab)["q0"]) == pytest.approx(50, abs=2e-3)
    press(tab, "field", 1, value=["q0", "60"])
    at[0] = kin.fk(PIONEER, turned(60))[:3, 3]
    tab.wait(lambda: np.allclose(points(), at[::-1], atol=1e-6))
    press(tab, "go", 1)
    tab.wait(lambda: np.allclose(tab.tool_pose()[:3, 3], at[0], atol=1e-3))
    press(tab, "point", 1, value="7")
    press(tab, "delete-point", 1)
    tab.wait(lambda: len(points()) == 1)
    press(tab, "delete-point", 1)
    assert shown(1), "a spline has a point"
    press(tab, "field", 1, value=["kind", "ptp"])
    assert titles(tab) == ["Waypoint 1", "Waypoint 2"]


def test_two_motions_are_compared_and_code_is_copied(tab: FakeBrowser) -> None:
    record(tab, 20, 80)
    assert part(tab, "plot").count('<path class="kb-motion-curve') == 3 * PIONEER.n + 1
    press(tab, "compare", value="quintic")
    times = [float(x) for x in re.findall(r">([\d.]+) s</span>", part(tab, "compare"))]
    assert len(times) == 2
    assert times[1] > times[0]
    assert "kb-motion-other" in part(tab, "plot")
    assert is_drawn(tab, "other")
    press(tab, "compare", value="lin")
    press(tab, "compare", value="")
    assert "kb-motion-other" not in part(tab, "plot")
    for language, word in (("curl", "/api/v1/robots/pioneer5/motion"), ("URScript", "six revolute joints")):
        press(tab, "language", value=language)
        assert word in html.unescape(part(tab, "files"))
    press(tab, "language", value="Python, kin")
    assert "kin.plan_motion(" in part(tab, "files")
    assert "at limit" in part(tab, "summary")
    assert "Limits from: " in part(tab, "summary")


def test_ghosts_and_frames_are_switched(tab: FakeBrowser) -> None:
    record(tab, 20, 80)
    for name in ("ghosts", "frames"):
        assert not is_drawn(tab, name)
        for on in (True, False, True, False):
            press(tab, name, value=on)
            assert is_drawn(tab, name) == on
    assert len([node for node in tab.nodes if "/ghosts" in node]) == 1, "browsers draw no second one"


def test_the_command_asks_the_service_of_the_page(port: int) -> None:
    memory = json.dumps({"address": "https://arms.example/kin/", "state": ""})
    with FakeBrowser(port, memory=memory) as tab:
        tab.settle()
        record(tab, 20, 80)
        press(tab, "language", value="curl")
        shown = html.unescape(part(tab, "files"))
    assert "curl -s https://arms.example/kin/api/v1/robots/pioneer5/motion" in shown
    assert "127.0.0.1" not in shown


def test_the_command_of_a_service_with_a_token_sends_it() -> None:
    program = {"segments": [{"kind": "ptp", "q": PIONEER.q_home.tolist()}]}
    motion = kin.plan_motion(PIONEER, program, q_start=PIONEER.q_home)
    text = SNIPPETS["curl"](motion, False, Service("https://arms.example/", token=True))
    assert '-H "Authorization: Bearer $KINBOARD_TOKEN"' in text
    assert "Bearer" not in SNIPPETS["curl"](motion, False, Service())


@pytest.mark.full
def test_the_gripper_is_a_row_that_is_played_undone_and_kept_in_the_link(port: int) -> None:
    so101 = STORE.get("so101")
    with FakeBrowser(port) as tab:
        tab.settle()
        press(tab, "gripper")
        tab.wait(lambda: "This arm has no gripper that opens" in tab.html)
        tab.choose(so101.name)
        press(tab, "record")
        tab.wait(lambda: titles(tab) == ["Waypoint 1"])
        tab.set("Gripper (%)", 80)
        press(tab, "gripper")
        assert titles(tab) == ["Waypoint 1", "Gripper"]
        assert "to 80 %, waits 2 s" in part(tab, "list")
        assert inputs(tab)["opening"] == "80"
        press(tab, "field", 1, value=["opening", "20"])
        press(tab, "field", 1, value=["seconds", "0.3"])
        assert "to 20 %, waits 0.3 s" in part(tab, "list")
        press(tab, "field", 1, value=["opening", "101"])
        tab.wait(lambda: "“101” is not valid. Valid: 0 to 100 %." in html.unescape(tab.html))
        assert clock(tab)["duration"] == "0.300"
        press(tab, "play")
        tab.wait(lambda: tab.value("Gripper (%)") == 20)
        tab.wait(lambda: clock(tab)["playing"] == "0")
        press(tab, "scrub", value=0.15)
        tab.wait(lambda: tab.value("Gripper (%)") == 50)
        press(tab, "go", 1)
        tab.wait(lambda: tab.value("Gripper (%)") == 20)
        tab.set("Gripper (%)", 40)
        press(tab, "set", 1)
        assert "to 40 %, waits 0.3 s" in part(tab, "list")
        tab.say("undo")
        tab.wait(lambda: "to 20 %, waits 0.3 s" in part(tab, "list"))
        tab.wait(lambda: bool(tab.kept) and len(programs(tab.kept[-1])["so101"]["segments"]) == 2)  # type: ignore[index]
        link = tab.kept[-1]
    with FakeBrowser(port, memory=json.dumps({"state": link})) as tab:
        tab.wait(lambda: titles(tab) == ["Waypoint 1", "Gripper"])
        tab.wait(lambda: "to 20 %, waits 0.3 s" in part(tab, "list"))
