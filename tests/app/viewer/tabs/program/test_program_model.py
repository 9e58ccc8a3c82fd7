"""The programs of a page: what they plan, what a link keeps of them, what is typed, and files."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bare_page import bare_page
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.exports.program_toml import toml_of
from app.exports.snippets import Service
from app.viewer.arm import Arm
from app.viewer.frames import Frames
from app.viewer.own_arm import clean
from app.viewer.tabs.program import program as model
from app.viewer.tabs.program.compare import CHOICES, Choice, jerk_is_infinite, other_motion
from app.viewer.tabs.program.plan import Asked, plan
from app.viewer.tabs.program.program import as_kind, begun, opened, recorded, unpack
from app.viewer.tabs.program.scene import shared
from app.viewer.tabs.program.settings import Planned, ProgramFacts, ProgramSettings
from app.viewer.tabs.program.tab import ProgramTab
from app.viewer.tabs.program.typed import Fields
from app.viewer.tabs.program.views import QUANTITIES, assumption, comparison
from kin import InputError
from kin.ik.details import OrientationNotMet
from kin.motion import Circ, Dwell, Lin, Motion, PoseTarget, Program, Ptp, Spline, motion_limits, program_to_dict
from kin.motion.details import NotReached
from kin.typed import EntryError
from kin.units import DEFAULT_UNITS

PIONEER, UR5, SCARA = (kin.get_robot(name) for name in ("pioneer5", "ur5", "scara"))
POSES = [PIONEER.q_home, PIONEER.clip(PIONEER.q_home + 0.2), PIONEER.clip(PIONEER.q_home - 0.3)]
ROWS = (
    Ptp(recorded(POSES[0])),
    Ptp(recorded(POSES[1]), speed=0.5, name="above “the” part"),
    Dwell(0.5),
    Ptp(recorded(POSES[2])),
)


def test_a_program_starts_at_its_first_waypoint_and_returns_there() -> None:
    found = plan(Program(ROWS), PIONEER)
    assert found is not None
    assert [segment.kind for segment in found.motion.segments] == ["ptp", "ptp", "dwell", "ptp"]
    assert found.ends[0] == 0.0, "the first waypoint is where it starts"
    for index in (0, 1, 3):
        assert np.allclose(found.motion.derivatives(found.ends[index])[0], found.q[index][0], atol=1e-9)
    back = plan(Program(ROWS), PIONEER, loop=True)
    assert back is not None
    assert np.allclose(back.motion.derivatives(back.motion.duration)[0], found.q[0][0], atol=1e-9)
    assert len(back.motion.segments) == 5


def test_what_becomes_the_first_move_is_a_ptp_to_joint_values() -> None:
    T = kin.fk(UR5, CURVE[1])
    for row in (Lin(recorded(CURVE[0])), Lin(PoseTarget.of(kin.fk(UR5, CURVE[0])))):
        first, second = begun((row, Lin(PoseTarget.of(T))), UR5, CURVE[0])
        assert isinstance(first, Ptp)
        assert np.allclose(first.target.q, CURVE[0], atol=1e-6)
        assert second == Lin(PoseTarget.of(T))
    points = [PoseTarget.of(kin.fk(UR5, q)) for q in CURVE[:3]]
    start, rest = begun((Spline(points, speed=0.5),), UR5, CURVE[0])
    assert (type(start), rest) == (Ptp, Spline(points[1:], speed=0.5))
    assert begun((Dwell(1.0),), UR5, CURVE[0]) == (), "pauses alone are no program"


def test_a_spline_is_a_row_for_each_point_when_it_becomes_another_kind_and_joins_splines_beside_it() -> None:
    rows = tuple(Ptp(recorded(q)) for q in CURVE)
    rows, at = as_kind(rows, 1, "spline", [CURVE[1]], CURVE[0], UR5)
    rows, at = as_kind(rows, 3, "spline", [CURVE[3]], CURVE[2], UR5)
    joined, at = as_kind(rows, 2, "spline", [CURVE[2]], CURVE[1], UR5)
    assert ([type(row) for row in joined], at) == ([Ptp, Spline, Ptp], 1)
    assert len(joined[1].points) == 3
    split, at = as_kind(joined, 1, "ptp", CURVE[1:4], CURVE[0], UR5)
    assert at == 3
    assert all(np.allclose(row.target.q, q, atol=1e-7) for row, q in zip(split, CURVE, strict=True))
    arcs, _ = as_kind(joined, 1, "circ", CURVE[1:4], CURVE[0], UR5)
    assert [type(row) for row in arcs] == [Ptp, Circ, Circ, Circ, Ptp]


def test_a_line_is_straight() -> None:
    program = Program((Ptp(recorded(UR5.q_home)), Lin(recorded(UR5.clip(UR5.q_home + 0.15)))))
    found = plan(program, UR5)
    assert found is not None
    points = found.motion.sample(np.linspace(0.0, found.motion.duration, 50)).T[:, :3, 3]
    along = points[-1] - points[0]
    off = np.linalg.norm(np.cross(points - points[0], along / np.linalg.norm(along)), axis=1)
    assert off.max() < 1e-5
    assert unpack(program_to_dict(program), UR5) == program
    assert (
        opened(kin.motion.parse_program(toml_of(program, "UR5"), UR5), UR5, UR5.q_home).segments
        == program.segments
    )


@pytest.mark.parametrize(
    "fields",
    [
        {"jerk_limited": False},
        {"task": "position"},
        {"segments": [{"kind": "ptp", "q": [0.1] * 6, "blend": 0.1, "tool_speed": 0.2}]},
        {"segments": [{"kind": "lin", "q": [0.1] * 6, "orientation": "two-axis"}]},
        {"segments": [{"kind": "spline", "points": [{"q": [0.1] * 6}, {"q": [0.2] * 6}]}]},
    ],
)
def test_a_page_and_its_link_hold_whatever_a_program_has(fields: dict[str, object]) -> None:
    start = {"kind": "ptp", "q": UR5.q_home.tolist()}
    data = {**fields, "segments": [start, *fields.get("segments", ())]}  # type: ignore[misc]
    program = opened(kin.motion.program_from_dict(data, UR5), UR5, UR5.q_home)
    assert program == kin.motion.program_from_dict(data, UR5)
    assert unpack(json.loads(json.dumps(program_to_dict(program))), UR5) == program


names = st.text(max_size=60)


@given(
    st.lists(
        st.one_of(
            st.builds(
                lambda name, speed: Ptp(ROWS[1].target, speed=round(speed, 3), name=clean(name, model.NAME)),
                names,
                st.floats(0.01, 1.0),
            ),
            st.builds(
                lambda name, seconds: Dwell(seconds, clean(name, model.NAME)), names, st.floats(0.0, 3600.0)
            ),
        ),
        max_size=8,
    )
)
def test_a_link_keeps_the_program(found: list[Ptp | Dwell]) -> None:
    program = Program((ROWS[0], *found))
    assert unpack(json.loads(json.dumps(program_to_dict(program))), PIONEER) == program


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
        [ROW] * (model.MOST + 1),
        [ROW, ["w"]],
        [["w", 1]],
        {"segments": []},
        {"segments": [{"kind": "ptp", "q": [0, 0]}]},
        {"segments": [{"kind": "dwell", "seconds": 1}] * (model.MOST + 1)},
        {"segments": [{"kind": "jump"}]},
    ],
)
def test_what_is_no_program_of_a_link_is_ignored(value: object) -> None:
    assert unpack(value, PIONEER) is None
    assert unpack([ROW], PIONEER) is not None


def test_links_of_earlier_versions_are_read() -> None:
    q = [[round(value, 7) for value in each.tolist()] for each in CURVE]
    rows = [
        ["p", q[0]],
        ["s", q[1], "", 0.3],
        ["s", q[2], "curve", 0.5, {"b": 0.01}],
        ["w", 0.2],
        ["c", q[4], "", 1.0, {"o": [0.1, 0.2, 0.3], "v": 0.1}],
        ["l", q[3], "end", 1.0, {"a": 0.5, "t": 0.3}],
    ]
    points = [model.posed(np.array(each), UR5) for each in q[1:3]]
    found = unpack(rows, UR5)
    assert found is not None
    assert found.segments == (
        Ptp(q[0]),
        Spline(points, speed=0.5, blend=0.01, name="curve"),
        Dwell(0.2),
        Circ((0.1, 0.2, 0.3), q[4], tool_speed=0.1),
        Lin(q[3], acceleration=0.5, tool_turn=0.3, name="end"),
    )


def test_changes_of_the_rows() -> None:
    a, b, c, d = ROWS
    assert model.moved(ROWS, 0, 2) == (b, c, a, d)
    assert model.moved(ROWS, 3, 0) == (d, a, b, c)
    assert model.replaced(ROWS, 1) == (a, c, d)
    assert model.replaced(ROWS, 3, d, a) == (*ROWS, a)


FIELDS = Fields(PIONEER, DEFAULT_UNITS, np.eye(4), "approach")
Q = [POSES[0]]


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
    row = Circ((0.0, 0.0, 0.0), ROWS[0].target)
    read = getattr(FIELDS.read(field, text, row, Q), name)
    assert read == (value if isinstance(value, str) else pytest.approx(value))


def test_typed_joint_values_and_poses_are_exact() -> None:
    q = np.array(FIELDS.read("q1", "30.125", ROWS[0], Q).target.q)
    assert q[1] == pytest.approx(np.radians(30.125), abs=1e-12)
    assert np.allclose(np.delete(q, 1), np.delete(POSES[0], 1), atol=1e-12)
    T = kin.fk(PIONEER, POSES[0])
    text = " ".join(f"{1000 * x + 5:.6f}" for x in T[:3, 3])
    moved = kin.fk(PIONEER, np.array(FIELDS.read("position", text, ROWS[0], Q).target.q))
    assert np.allclose(moved[:3, 3], T[:3, 3] + 0.005, atol=1e-8)
    assert np.allclose(moved[:3, 2], T[:3, 2], atol=1e-8), "the approach direction stays"
    spline = Spline([PoseTarget.of(T), PoseTarget.of(kin.fk(PIONEER, POSES[1]))])
    changed = FIELDS.read("q0", "30", spline, [POSES[0], POSES[1]], 1)
    assert changed.points[0] == spline.points[0]
    q = POSES[1].copy()
    q[0] = np.radians(30)
    assert np.allclose(changed.points[1].pose(np.eye(4)), kin.fk(PIONEER, q), atol=1e-9)


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
        ("tool_turn", "-1"),
        ("tool_speed", "inf"),
        ("acceleration", "0"),
    ],
)
def test_what_cannot_be_read_is_refused(field: str, text: str) -> None:
    row = Dwell(1.0) if field == "seconds" else Circ((0.0, 0.0, 0.0), ROWS[0].target)
    with pytest.raises(EntryError):
        FIELDS.read(field, text, row, Q)
    for other in (row, Dwell(1.0), ROWS[0]):
        with pytest.raises(InputError):
            FIELDS.read("colour", text, other, Q)


@pytest.mark.parametrize("text", ["0", "1e-200"])
def test_a_limit_of_no_speed_is_refused_with_what_would_be_valid(text: str) -> None:
    for field, valid in (("tool_speed", "0.0001 to 1000000 mm/s"), ("tool_turn", "0.000006 to 57295.8°/s")):
        with pytest.raises(EntryError) as caught:
            FIELDS.read(field, text, ROWS[0], Q)
        assert caught.value.detail == f"“{text}” is not valid. Valid: {valid}, or nothing: no limit."
        least = getattr(FIELDS.read(field, valid.split()[0], ROWS[0], Q), field)
        assert least == pytest.approx(1e-7, rel=0.05)


CURVE = tuple(UR5.clip(UR5.q_home + 0.1 * k * np.array([1, 1, -1, 1, 0, 0])) for k in range(5))
POINTS = [PoseTarget.of(kin.fk(UR5, q)) for q in CURVE]
VIA = tuple(kin.fk(UR5, 0.5 * (CURVE[2] + CURVE[4]))[:3, 3].tolist())
BENT = (
    Ptp(recorded(CURVE[0])),
    Spline(POINTS[1:3], speed=0.5),
    Dwell(0.2),
    Circ(VIA, recorded(CURVE[4]), tool_speed=0.1, blend=0.01),
    Lin(recorded(CURVE[3]), acceleration=0.5, tool_turn=0.3, name="end"),
)


def test_a_spline_leads_through_its_points_and_a_circle_through_its_via_point() -> None:
    program = Program(BENT)
    found = plan(program, UR5, loop=True)
    assert found is not None
    assert found.motion.planned, found.motion.reason
    assert [each.kind for each in found.motion.segments] == ["ptp", "spline", "dwell", "circ", "lin", "ptp"]
    ends = found.ends
    assert ends[0] == 0.0 < ends[1] < ends[2]
    assert ends[-1] == found.motion.duration
    passed, q = found.met(1, 0)
    assert found.met(2, model.MOST)[0] == ends[2], "a pause ends where it began"
    assert passed is not None
    assert ends[0] < passed < ends[1]
    assert np.linalg.norm(kin.fk(UR5, q)[:3, 3] - POINTS[1].position) < 0.01, "when the tool passes it"
    assert [len(row) for row in found.q] == [1, 2, 0, 1, 1]
    for got, point in zip(found.q[1], POINTS[1:3], strict=True):
        assert np.allclose(kin.fk(UR5, got), point.pose(np.eye(4)), atol=1e-6)
    assert found.row_at(passed) == 1
    arc = found.motion.segments[3]
    points = found.motion.sample(np.linspace(arc.start, arc.end, 400)).T[:, :3, 3]
    assert np.linalg.norm(points - np.array(VIA), axis=1).min() < 2e-3
    speeds = found.motion.sample(np.linspace(arc.start, arc.end, 400)).tool_speed
    assert speeds.max() <= 0.1 * (1 + 1e-9)
    again = unpack(json.loads(json.dumps(program_to_dict(program))), UR5)
    assert again == program
    assert opened(kin.motion.parse_program(toml_of(program, "UR5"), UR5), UR5, UR5.q_home) == program


def test_refusals_and_notes_have_the_numbers_of_the_rows() -> None:
    far = replace(BENT[4], target=recorded(UR5.clip(UR5.q_home + 2.5)), blend=0.01)
    found = plan(Program((*BENT[:3], far)), UR5)
    assert found is not None
    assert found.motion.refusal is not None
    assert found.motion.refusal.segment == 3
    for index, q in ((2, found.q[1][-1]), (3, far.target.q)):
        assert np.allclose(found.met(index, model.MOST)[1], q, atol=1e-6)
    assert "Segment 4 (LIN" in found.explain(DEFAULT_UNITS)


def test_small_numbers_of_a_refusal_are_written_as_the_page_writes_numbers() -> None:
    far = replace(BENT[4], target=recorded(UR5.clip(UR5.q_home + 1.5)), blend=0.01)
    found = plan(Program((*BENT[:3], far)), UR5)
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
    program = Program(tuple(Ptp(recorded(q)) for q in CURVE[:3]))
    own = plan(program, UR5)
    assert own is not None
    other = other_motion(program, own, False, choice, 0.05)
    assert other.planned, other.reason
    for index in (0, 2):
        assert np.allclose(other.derivatives(other.segments[index].end)[0], own.q[index][0], atol=1e-6)
    peaks = {quantity: max(p.ratio or 0 for p in other.peaks if p.quantity == quantity) for quantity in QUANTITIES}
    assert peaks["velocity"] <= 1 + 1e-9
    assert peaks["acceleration"] <= 1 + 1e-9
    html = comparison(own.motion, other, choice, 0.05, DEFAULT_UNITS)
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


def test_splines_are_compared_point_by_point() -> None:
    own = plan(Program(BENT), UR5)
    assert own is not None
    other = other_motion(Program(BENT), own, True, "ptp", 0.05)
    assert [each.kind for each in other.segments] == ["ptp", "ptp", "ptp", "dwell", "ptp", "ptp", "ptp"]


def test_a_file_holds_the_whole_program() -> None:
    program = Program(ROWS)
    text = toml_of(program, "Pioneer\narm")
    assert kin.motion.parse_program(text, PIONEER) == program
    assert opened(kin.motion.parse_program(text, PIONEER), PIONEER, PIONEER.q_home) == program


def test_a_file_of_poses_keeps_them_but_for_the_start() -> None:
    T = kin.fk(PIONEER, POSES[1])
    rows = [{"kind": "ptp", "pose": T.tolist()}] * 2
    first, second = opened(
        kin.motion.program_from_dict({"segments": rows}, PIONEER), PIONEER, PIONEER.q_home
    ).segments
    assert np.allclose(kin.fk(PIONEER, np.array(first.target.q)), T, atol=1e-6)
    assert isinstance(second.target, PoseTarget)
    far = kin.motion.program_from_dict({"segments": [rows[0], {"kind": "ptp", "position": [9, 9, 9]}]}, PIONEER)
    with pytest.raises(InputError, match="a point that the arm can reach"):
        opened(far, PIONEER, PIONEER.q_home)
    line = kin.motion.program_from_dict({"segments": [{"kind": "lin", "pose": T.tolist()}]}, PIONEER)
    start, row = opened(line, PIONEER, POSES[2]).segments
    assert np.allclose(start.target.q, POSES[2], atol=1e-7), "it starts where the arm is"
    assert row == line.segments[0]


PLANNED = Planned()


def facts_of(**settings: object) -> ProgramFacts:
    """The facts of one page that shows `ROWS`, with these settings."""
    given = ProgramSettings(programs={PIONEER.id: Program(ROWS)}, **settings)  # type: ignore[arg-type]
    return ProgramFacts(given, Arm(PIONEER, PIONEER.q_home, PIONEER.q_home), planned=PLANNED)


def test_playing_keeps_time_stops_at_the_end_and_begins_again_in_a_loop() -> None:
    end = facts_of().duration
    assert facts_of(time=0.25, rate=2.0).after(0.125) == 0.5
    assert facts_of(time=end - 0.1).after(0.2) is None
    looped = facts_of(loop=True)
    assert looped.duration > end, "it has a way back"
    assert facts_of(loop=True, time=looped.duration - 0.1).after(0.3) == pytest.approx(0.2)
    assert facts_of(time=1e9).time == end


def test_plans_are_shared_by_facts_and_rows_that_are_gone_are_not_open() -> None:
    facts = facts_of(chosen=3)
    assert facts.plan is facts_of(chosen=1, time=0.5, rate=0.1).plan
    assert facts.plan is not facts_of(loop=True).plan
    assert (facts.chosen, facts_of(chosen=4).chosen) == (3, None)
    assert facts.progress is facts_of().progress
    assert facts_of(own=True).program is None, "a visitor's own arm has a program of its own"


def test_a_page_that_plays_plans_once_however_many_pages_have_other_programs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    planned: list[Program] = []
    plan_motion = kin.plan_motion

    def counted(robot: kin.Robot, program: Program, *args: Any, **options: Any) -> Motion:
        planned.append(program)
        return plan_motion(robot, program, *args, **options)

    monkeypatch.setattr(kin, "plan_motion", counted)
    pages = [(Program((ROWS[0], replace(ROWS[1], speed=0.1 + 0.01 * k))), Planned()) for k in range(40)]
    arm = Arm(PIONEER, PIONEER.q_home, PIONEER.q_home)
    for frame in range(3):
        for program, own in pages:
            settings = ProgramSettings(programs={PIONEER.id: program}, time=0.1 * frame, compare="zone")
            facts = ProgramFacts(settings, arm, planned=own)
            assert facts.fault is None
            assert facts.other is not None
        assert len(planned) == 2 * len(pages), "each program, and what it is compared with"


def test_the_facts_of_a_page_share_what_was_planned() -> None:
    with bare_page(PIONEER) as page:
        page.service, page.frames = Service("http://127.0.0.1"), Frames()  # type: ignore[attr-defined]
        tab = page.open(ProgramTab)
        before = tab.facts
        tab.change(programs={PIONEER.id: Program(ROWS)})
        tab.invalidate()
        assert tab.facts is not before
        assert tab.facts.planned is before.planned


def test_what_is_asked_for_a_row_goes_with_the_program_and_the_obstacles() -> None:
    asked = Asked(3, facts_of().plan, facts_of().arm)
    facts = facts_of(way=asked, chart=asked, loop=True)
    assert facts.way is facts.chart is asked
    ball = kin.Obstacle("sphere", radius=0.1)
    moved = replace(facts, arm=replace(asked.arm, obstacles=(ball,)))
    avoiding = replace(facts, arm=replace(asked.arm, avoid=True))
    assert (moved.way, moved.chart) == (None, None)
    assert (avoiding.way, avoiding.chart) == (asked, None)
    shorter = replace(facts.settings, programs={PIONEER.id: Program(ROWS[:3])})
    assert (replace(facts, settings=shorter).way, replace(facts, settings=shorter).chart) == (None, None)


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


def test_a_program_that_cannot_be_driven_is_opened_as_it_is() -> None:
    far = POSES[0].copy()
    far[0] = PIONEER.upper[0] + 1.0
    program = Program((Ptp(POSES[0]), Ptp(far), Lin(POSES[1])))
    assert opened(program, PIONEER, PIONEER.q_home) == program
    found = plan(program, PIONEER)
    assert found is not None
    assert found.motion.refusal is not None
    assert found.motion.refusal.segment == 1
