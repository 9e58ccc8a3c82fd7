"""The list of a program: what it plans, what a link keeps of it, and files."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.exports.program_toml import toml_of
from app.viewer.own_arm import clean
from app.viewer.tabs.program import items as lists
from app.viewer.tabs.program.compare import CHOICES, Choice, jerk_is_infinite, other_motion
from app.viewer.tabs.program.drawing import shared
from app.viewer.tabs.program.items import Item
from app.viewer.tabs.program.links import pack, unpack
from app.viewer.tabs.program.planning import halfway, items_of, plan, program_of
from app.viewer.tabs.program.playback import Player
from app.viewer.tabs.program.typed import Fields
from app.viewer.tabs.program.views import QUANTITIES, assumption, comparison
from kin import InputError
from kin.ik.details import OrientationNotMet
from kin.motion import motion_limits
from kin.motion.details import NotReached
from kin.typed import EntryError
from kin.units import DEFAULT_UNITS

PIONEER, UR5, SCARA = (kin.get_robot(name) for name in ("pioneer5", "ur5", "scara"))
POSES = [PIONEER.q_home, PIONEER.clip(PIONEER.q_home + 0.2), PIONEER.clip(PIONEER.q_home - 0.3)]
ITEMS = (
    lists.waypoint(POSES[0]),
    Item("ptp", lists.waypoint(POSES[1]).q, speed=0.5, name="above “the” part"),
    Item("pause", seconds=0.5),
    lists.waypoint(POSES[2]),
)


def test_item_i_is_segment_i_of_the_program() -> None:
    motion = kin.plan_motion(PIONEER, program_of(ITEMS, PIONEER, loop=False), ITEMS[0].q)
    assert [segment.kind for segment in motion.segments] == ["ptp", "ptp", "dwell", "ptp"]
    assert motion.segments[0].end == 0.0, "the first waypoint is where it starts"
    for item, segment in zip(ITEMS, motion.segments, strict=True):
        if item.q:
            assert np.allclose(motion.derivatives(segment.end)[0], item.q, atol=1e-9)
    back = kin.plan_motion(PIONEER, program_of(ITEMS, PIONEER, loop=True), ITEMS[0].q)
    assert np.allclose(back.derivatives(back.duration)[0], ITEMS[0].q, atol=1e-9)
    assert len(back.segments) == 5


def test_a_line_is_straight() -> None:
    items = (lists.waypoint(UR5.q_home), replace(lists.waypoint(UR5.clip(UR5.q_home + 0.15)), kind="lin"))
    motion = kin.plan_motion(UR5, program_of(items, UR5, loop=False), items[0].q)
    points = motion.sample(np.linspace(0.0, motion.duration, 50)).T[:, :3, 3]
    along = points[-1] - points[0]
    off = np.linalg.norm(np.cross(points - points[0], along / np.linalg.norm(along)), axis=1)
    assert off.max() < 1e-5
    assert unpack(pack(items), UR5) == items
    text = toml_of(program_of(items, UR5, loop=False), "UR5")
    assert [item.kind for item in items_of(kin.parse_program(text, UR5), UR5, UR5.q_home)] == ["ptp", "lin"]


@pytest.mark.parametrize("field", ["blend = 0.1", "tool_speed = 0.1"])
def test_a_file_with_more_than_the_list_holds_is_refused(field: str) -> None:
    text = f"[[segments]]\nkind = 'ptp'\nq = {list(ITEMS[0].q)}\n{field}\n"
    with pytest.raises(InputError, match="start of a program"):
        items_of(kin.parse_program(text, PIONEER), PIONEER, PIONEER.q_home)


names = st.text(max_size=60)


@given(
    st.lists(
        st.one_of(
            st.builds(
                lambda name, speed: Item("ptp", ITEMS[1].q, round(speed, 3), name=clean(name, lists.NAME)),
                names,
                st.floats(0.01, 1.0),
            ),
            st.builds(
                lambda name, seconds: Item("pause", seconds=seconds, name=clean(name, lists.NAME)),
                names,
                st.floats(0.0, 3600.0),
            ),
        ),
        min_size=1,
        max_size=8,
    )
)
def test_a_link_keeps_the_list(found: list[Item]) -> None:
    packed = json.loads(json.dumps(pack(tuple(found))))
    assert unpack(packed, PIONEER) == tuple(found)


ROW = ["p", [0, 0, 0, 0, 0]]


@pytest.mark.parametrize(
    "value",
    [
        None,
        {},
        [],
        [1],
        [["p"]],
        [["p", [0, 0]]],
        [["p", [0, 0, 0, 0, True]]],
        [["p", [0, 0, 0, 0, "1"]]],
        [["p", [0, 0, 0, 0, float("nan")]]],
        [["p", [0, 0, 0, 0, 1e9]]],
        [[*ROW, 5]],
        [[*ROW, "", 0]],
        [[*ROW, "", 2]],
        [[*ROW, "", 1, 1]],
        [[*ROW, "", 1, {"x": 1}]],
        [[*ROW, "", 1, {"a": 0}]],
        [[*ROW, "", 1, {"o": [1, 2]}]],
        [["c", *ROW[1:]]],
        [[*ROW, "", 1, {}, 1]],
        [[*ROW, "", 1, {"b": "1"}]],
        [["w", -1]],
        [["w", 1e9]],
        [["w", True]],
        [["w", 1, 2]],
        [["x", 1]],
        [ROW] * (lists.MOST + 1),
        [ROW, ["w"]],
    ],
)
def test_what_is_no_list_is_ignored(value: object) -> None:
    assert unpack(value, PIONEER) is None
    assert unpack([ROW], PIONEER) is not None


def test_changes_of_a_list() -> None:
    a, b, c, d = ITEMS
    assert lists.moved(ITEMS, 0, 2) == (b, c, a, d)
    assert lists.moved(ITEMS, 3, 0) == (d, a, b, c)
    assert lists.removed(ITEMS, 1) == (a, c, d)
    assert lists.inserted(ITEMS, 4, a) == (*ITEMS, a)
    assert lists.changed(ITEMS, 0, name="x")[0].name == "x"


FIELDS = Fields(PIONEER, DEFAULT_UNITS, np.eye(4), "approach")


@pytest.mark.parametrize(
    ("field", "text", "expected"),
    [
        ("speed", " 50 % ", {"speed": 0.5}),
        ("acceleration", "25", {"acceleration": 0.25}),
        ("blend", "20", {"blend": 0.02}),
        ("blend", "2 cm", {"blend": 0.02}),
        ("blend", "", {"blend": 0.0}),
        ("tool_speed", "250 mm/s", {"tool_speed": 0.25}),
        ("tool_speed", " ", {"tool_speed": None}),
        ("tool_turn", "180", {"tool_turn": np.pi}),
        ("name", "a\nb" + "x" * 100, {"name": "a b" + "x" * 36 + "…"}),
        ("via", "100, 0, 250.5", {"via": (0.1, 0.0, 0.2505)}),
    ],
)
def test_typed_values(field: str, text: str, expected: dict[str, object]) -> None:
    ((name, value),) = expected.items()
    assert FIELDS.read(field, text, ITEMS[0])[name] == (value if isinstance(value, str) else pytest.approx(value))


def test_typed_joint_values_and_poses_are_exact() -> None:
    q = FIELDS.read("q1", "30.125", ITEMS[0])["q"]
    assert q[1] == pytest.approx(np.radians(30.125), abs=1e-12)
    assert q[:1] + q[2:] == ITEMS[0].q[:1] + ITEMS[0].q[2:]
    T = kin.fk(PIONEER, np.array(ITEMS[0].q))
    text = " ".join(f"{1000 * x + 5:.6f}" for x in T[:3, 3])
    moved = kin.fk(PIONEER, np.array(FIELDS.read("position", text, ITEMS[0])["q"]))
    assert np.allclose(moved[:3, 3], T[:3, 3] + 0.005, atol=1e-8)
    assert np.allclose(moved[:3, 2], T[:3, 2], atol=1e-8), "the approach direction stays"


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("speed", "0"),
        ("speed", "101"),
        ("speed", "nan"),
        ("seconds", "-1"),
        ("seconds", "x"),
        ("blend", "-1"),
        ("q0", "1000"),
        ("q0", ""),
        ("position", "1 2"),
        ("position", "9000 0 0"),
        ("via", "a b c"),
        ("tool_speed", "x"),
        ("tool_speed", "0"),
        ("tool_turn", "0"),
        ("tool_speed", "inf"),
        ("acceleration", "0"),
    ],
)
def test_what_cannot_be_read_is_refused(field: str, text: str) -> None:
    with pytest.raises(EntryError):
        FIELDS.read(field, text, ITEMS[0])
    with pytest.raises(InputError):
        FIELDS.read("colour", text, ITEMS[0])


def test_a_limit_of_zero_is_refused_with_what_would_be_valid() -> None:
    for field, most in (("tool_speed", "1000000 mm/s"), ("tool_turn", "57295.8°/s")):
        with pytest.raises(EntryError) as caught:
            FIELDS.read(field, "0", ITEMS[0])
        assert caught.value.detail == f"“0” is not valid. Valid: above 0, at most {most}, or nothing: no limit."


CURVE = tuple(UR5.clip(UR5.q_home + 0.1 * k * np.array([1, 1, -1, 1, 0, 0])) for k in range(5))
BENT = (
    lists.waypoint(CURVE[0]),
    replace(lists.waypoint(CURVE[1]), kind="spline"),
    replace(lists.waypoint(CURVE[2]), kind="spline", speed=0.5),
    Item("pause", seconds=0.2),
    replace(lists.waypoint(CURVE[4]), kind="circ", via=(0.0, 0.0, 0.0), tool_speed=0.1, blend=0.01),
    replace(lists.waypoint(CURVE[3]), kind="lin", acceleration=0.5, tool_turn=0.3, name="end"),
)


def test_a_spline_leads_through_neighbouring_points_and_a_circle_through_its_via_point() -> None:
    items = lists.changed(BENT, 4, via=halfway(BENT, 4, UR5))
    found = plan(items, UR5, loop=True)
    assert found is not None
    assert found.motion.planned, found.motion.reason
    assert [each.kind for each in found.motion.segments] == ["ptp", "spline", "dwell", "circ", "lin", "ptp"]
    assert (found.segments, found.item_of(1), found.item_of(5)) == ((0, 1, 1, 2, 3, 4), 2, 6)
    ends = found.ends
    assert ends[0] == 0.0 < ends[1] < ends[2] < ends[3]
    assert ends[-1] == found.motion.duration
    off = found.motion.sample(np.array(ends[1])).T[:3, 3] - kin.fk(UR5, CURVE[1])[:3, 3]
    assert np.linalg.norm(off) < 0.01, "the time of an inner point is when the tool passes it"
    assert found.item_at(ends[1] - 1e-3) == 1
    arc = found.motion.segments[3]
    points = found.motion.sample(np.linspace(arc.start, arc.end, 400)).T[:, :3, 3]
    assert np.linalg.norm(points - np.array(items[4].via), axis=1).min() < 2e-3
    speeds = found.motion.sample(np.linspace(arc.start, arc.end, 400)).tool_speed
    assert speeds.max() <= 0.1 * (1 + 1e-9)
    again = unpack(json.loads(json.dumps(pack(items))), UR5)
    assert again == items
    text = toml_of(program_of(items, UR5, loop=False), "UR5")
    opened = items_of(kin.parse_program(text, UR5), UR5, UR5.q_home)
    for a, b in zip(items, opened, strict=True):
        assert replace(a, q=()) == replace(b, q=())
        assert not a.q or np.allclose(kin.fk(UR5, np.array(a.q)), kin.fk(UR5, np.array(b.q)), atol=1e-6)


def test_refusals_and_notes_have_the_numbers_of_the_list() -> None:
    far = replace(BENT[5], q=tuple(UR5.clip(UR5.q_home + 2.5).tolist()), blend=0.01)
    found = plan((*BENT[:4], far), UR5, loop=False)
    assert found is not None
    if found.motion.planned:
        assert "segment 5" in found.explain(DEFAULT_UNITS)
    else:
        assert found.motion.refusal is not None
        assert found.motion.refusal.segment == 3
        assert "Segment 5 (LIN" in found.explain(DEFAULT_UNITS)


def test_small_numbers_of_a_refusal_are_written_as_the_page_writes_numbers() -> None:
    far = replace(BENT[5], q=tuple(UR5.clip(UR5.q_home + 1.5).tolist()), blend=0.01)
    found = plan((*BENT[:4], far), UR5, loop=False)
    assert found is not None
    refusal = found.motion.refusal
    assert refusal is not None
    reached = refusal.details
    assert isinstance(reached, NotReached)
    assert isinstance(reached.details, OrientationNotMet)
    near = reached.details._replace(position_error=1e-4, rotation_error=math.radians(0.037))
    refusal = replace(refusal, details=reached._replace(details=near))
    found = replace(found, motion=replace(found.motion, refusal=refusal))
    assert "off by 0.1 mm and 3.7·10⁻²°" in found.explain(DEFAULT_UNITS)


@pytest.mark.parametrize("choice", list(CHOICES))
def test_motions_of_the_same_waypoints_can_be_compared(choice: Choice) -> None:
    items = (*BENT[:1], *(replace(each, kind="ptp", via=None, tool_speed=None, blend=0.0) for each in BENT[1:3]))
    own = plan(items, UR5, loop=False)
    assert own is not None
    other = other_motion(items, UR5, False, choice, 0.05)
    assert other.planned, other.reason
    for index in (0, 2):
        assert np.allclose(other.derivatives(other.segments[index].end)[0], items[index].q, atol=1e-6)
    peaks = {quantity: max(p.ratio or 0 for p in other.peaks if p.quantity == quantity) for quantity in QUANTITIES}
    assert peaks["velocity"] <= 1 + 1e-9
    assert peaks["acceleration"] <= 1 + 1e-9
    html = comparison(own.motion, other, choice, 0.05, Fields(UR5, DEFAULT_UNITS, np.eye(4), "pose"), "")
    assert not jerk_is_infinite(own.motion)
    if choice in ("cubic", "trapezoidal"):
        assert jerk_is_infinite(other)
        assert "its jerk there is infinite" in html
        assert html.count("∞, exceeded") == 1
    else:
        assert peaks["jerk"] <= 1 + 1e-9
        assert not jerk_is_infinite(other)
        assert "∞" not in html
    if choice in ("cubic", "quintic"):
        assert max(peaks.values()) > 0.99, "it is as fast as the limits allow"
    if choice == "quintic":
        assert other.duration > own.motion.duration


def test_a_file_holds_the_whole_program() -> None:
    program = program_of(ITEMS, PIONEER, loop=False)
    text = toml_of(program, "Pioneer\narm")
    assert kin.parse_program(text, PIONEER) == program
    assert items_of(kin.parse_program(text, PIONEER), PIONEER, PIONEER.q_home) == ITEMS


def test_a_file_of_poses_becomes_waypoints() -> None:
    T = kin.fk(PIONEER, POSES[1])
    program = kin.program_from_dict({"segments": [{"kind": "ptp", "pose": T.tolist()}]}, PIONEER)
    (item,) = items_of(program, PIONEER, PIONEER.q_home)
    assert np.allclose(kin.fk(PIONEER, np.array(item.q)), T, atol=1e-6)
    far = kin.program_from_dict({"segments": [{"kind": "ptp", "position": [9, 9, 9]}]}, PIONEER)
    with pytest.raises(InputError, match="a point that the arm can reach"):
        items_of(far, PIONEER, PIONEER.q_home)


def test_the_player_keeps_time() -> None:
    player = Player(rate=2.0, playing=True)
    player.advance(0.5, 3.0)
    assert (player.time, player.playing) == (1.0, True)
    player.advance(5.0, 3.0)
    assert (player.time, player.playing) == (3.0, False)
    player = Player(time=2.5, loop=True, playing=True)
    player.advance(1.0, 3.0)
    assert (player.time, player.playing) == (0.5, True)
    player.go_to(-1.0, 3.0)
    assert player.time == 0.0


def test_assumed_limits_are_said() -> None:
    panda = kin.get_robot("panda")
    assert assumption(motion_limits(panda), False, DEFAULT_UNITS) == ""
    said = assumption(motion_limits(UR5), False, DEFAULT_UNITS)
    assert said.startswith("The maker publishes no ")
    assert "full acceleration after 0.1 s" in said
    assert assumption(motion_limits(PIONEER), True, DEFAULT_UNITS).startswith("Your arm states no velocities,")


def test_labels_that_would_overprint_are_one() -> None:
    places = [
        (np.array([0.0, 0.0, z]), name) for z, name in ((0.0, "1"), (0.5, "5 pick"), (0.51, "✕ cannot go on"))
    ]
    assert [(float(at[2]), words) for at, words in shared(places, 0.03)] == [
        (0.0, "1"),
        (0.5, "5 pick · ✕ cannot go on"),
    ]


def test_a_program_that_cannot_be_driven_is_opened_with_its_recorded_joints() -> None:
    far = POSES[0].copy()
    far[0] = PIONEER.upper[0] + 1.0
    first, last = (kin.motion.JointTarget(tuple(q.tolist())) for q in (POSES[0], POSES[1]))
    program = kin.motion.Program(
        (kin.motion.Ptp(first), kin.motion.Ptp(kin.motion.JointTarget(tuple(far))), kin.motion.Lin(last))
    )
    items = items_of(program, PIONEER, PIONEER.q_home)
    assert [item.kind for item in items] == ["ptp", "ptp", "lin"]
    assert np.allclose(items[2].q, POSES[1], atol=1e-6)
