"""Lines, arcs and splines of the tool: on their curve, continuous, within limits, or refused with the reason."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin.motion.geometry.curves import arc_through, poses, rotations, turning
from kin.transforms import rotation_vector

ARMS = tuple(kin.files.classic_robots())


def by(*offset):
    return np.array(offset, dtype=float)


def moved(robot, q, rng, size):
    return robot.clip(q + rng.normal(0, size, robot.n) * np.where(robot.revolute, 1, 0.1))


def target(robot, q):
    return kin.motion.PoseTarget.of(kin.fk(robot, q))


def assert_limits(motion):
    for i in range(len(motion.segments)):
        for peak in motion.segment_peaks(i):
            if peak.ratio is not None and (peak.quantity != "jerk" or motion.program.jerk_limited):
                assert peak.ratio <= 1 + 1e-9, (i, peak)


def assert_continuous(motion):
    limits = motion.limits
    times = np.linspace(0, motion.duration, 3001)
    step = times[1] - times[0]
    q, qd, qdd, _ = motion.derivatives(times)
    assert (np.abs(np.diff(q, axis=0)) <= limits.velocity * step * (1 + 1e-6) + 1e-12).all()
    assert (np.abs(np.diff(qd, axis=0)) <= limits.acceleration * step * (1 + 1e-6) + 1e-9).all()
    if motion.program.jerk_limited:
        assert (np.abs(np.diff(qdd, axis=0)) <= limits.jerk * step * (1 + 1e-6) + 1e-6).all()
    assert motion.robot.in_limits(q, 1e-9).all()


def random_program(robot, seed):
    """Three segments near home, some of which cannot be driven."""
    rng = np.random.default_rng(seed)
    q = q_start = moved(robot, robot.q_home, rng, 0.15)
    segments = []
    for _ in range(3):
        q = moved(robot, q, rng, 0.15)
        common = {
            "speed": rng.uniform(0.3, 1),
            "acceleration": rng.uniform(0.3, 1),
            "blend": rng.choice([0, 0.02, 0.2]),
            "tool_speed": None if rng.random() < 0.7 else 0.1,
        }
        kind = rng.choice(["lin", "lin", "circ", "ptp"])
        if kind == "lin":
            segments.append(kin.motion.Lin(target(robot, q), **common))
        elif kind == "circ":
            via = kin.fk(robot, moved(robot, q, rng, 0.1))[:3, 3]
            segments.append(kin.motion.Circ(via, target(robot, q), orientation="two-axis", **common))
        else:
            segments.append(kin.motion.Ptp(kin.motion.JointTarget(q), **common))
    return kin.motion.Program(segments, jerk_limited=bool(rng.random() < 0.7)), q_start


def check(arm, seed):
    robot = kin.get_robot(arm)
    program, q_start = random_program(robot, seed)
    motion = kin.plan_motion(robot, program, q_start)
    if not motion.planned:
        assert motion.refusal.cause in ("limits", "unreachable", "singularity", "branch", "task", "circle")
        assert motion.reason.startswith("Segment ")
        return False
    assert_limits(motion)
    assert_continuous(motion)
    again = kin.plan_motion(robot, program, q_start)
    times = np.linspace(0, motion.duration, 50)
    assert (again.derivatives(times) == motion.derivatives(times)).all()
    assert [a.end == b.start for a, b in itertools.pairwise(motion.segments)] == [True, True]
    return True


@settings(max_examples=8)
@given(st.sampled_from(ARMS), st.integers(0, 2**32 - 1))
def test_random_programs_keep_every_limit(arm, seed):
    check(arm, seed)


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS)
def test_many_random_programs_keep_every_limit(arm):
    assert sum(check(arm, seed) for seed in range(120)) > 15


def line_of(robot, q_start, q_end, **fields):
    return kin.plan_motion(robot, [kin.motion.Lin(target(robot, q_end), **fields)], q_start)


@pytest.mark.parametrize("arm", ARMS)
def test_a_line_is_straight_within_a_micrometre(arm):
    robot = kin.get_robot(arm)
    driven = 0
    for seed in range(3):
        rng = np.random.default_rng(seed)
        q0 = moved(robot, robot.q_home, rng, 0.1)
        motion = line_of(robot, q0, moved(robot, q0, rng, 0.2))
        if not motion.planned:
            continue
        driven += 1
        T = motion.sample(np.linspace(0, motion.duration, 2000)).T
        a, b = T[0, :3, 3], T[-1, :3, 3]
        way = (b - a) / np.linalg.norm(b - a)
        along = (T[:, :3, 3] - a) @ way
        assert np.abs(T[:, :3, 3] - a - along[:, None] * way).max() < 1e-6
        assert (np.diff(along) > -1e-9).all()
        if robot.n >= 6:
            part = along / along[-1]
            turn = rotation_vector(T[-1, :3, :3] @ T[0, :3, :3].T)
            assert np.abs(rotations(turn, part) @ T[0, :3, :3] - T[:, :3, :3]).max() < 2e-6
        if robot.n == 5:
            z = T[:, :3, 2]
            normal = np.cross(z[0], z[-1])
            assert np.abs(z @ normal).max() / max(np.linalg.norm(normal), 1e-3) < 2e-6
    assert driven >= 1


def test_an_arc_is_round_and_passes_its_via_point():
    robot = kin.get_robot("ur5")
    T = kin.fk(robot, robot.q_home)
    p = T[:3, 3]
    via, end = p + by(0.05, 0.05, 0), p + by(0.1, 0, 0)
    motion = kin.plan_motion(robot, [kin.motion.Circ(via, kin.motion.PoseTarget(end))])
    points = motion.sample(np.linspace(0, motion.duration, 3000)).T[:, :3, 3]
    assert np.abs(np.linalg.norm(points - (p + by(0.05, 0, 0)), axis=1) - 0.05).max() < 1e-6
    assert np.linalg.norm(points - via, axis=1).min() < 1e-4
    assert np.abs(points[-1] - end).max() < 1e-9


def test_a_blend_leaves_the_corner_within_its_radius_and_saves_time():
    robot = kin.get_robot("irb120")
    p = kin.fk(robot, robot.q_home)[:3, 3]
    corner, end = p + by(0.0, 0.15, 0.0), p + by(0.0, 0.15, 0.12)

    def drive(blend):
        return kin.plan_motion(
            robot,
            [
                kin.motion.Lin(kin.motion.PoseTarget(corner), blend=blend),
                kin.motion.Lin(kin.motion.PoseTarget(end)),
            ],
        )

    stopped, blended = drive(0), drive(0.03)
    assert blended.duration < stopped.duration
    points = blended.sample(np.linspace(0, blended.duration, 4000)).T[:, :3, 3]
    distance = np.linalg.norm(points - corner, axis=1)
    assert 0.002 < distance.min() < 0.03
    on_lines = np.minimum(
        np.hypot(points[:, 0] - p[0], points[:, 2] - p[2]), np.hypot(*(points - corner)[:, :2].T)
    )
    assert on_lines[distance > 0.03].max() < 1e-6
    assert on_lines[distance < 0.03].max() > 1e-3
    assert_continuous(blended)
    middle = blended.sample(blended.segments[0].end)
    assert middle.tool_speed > 0.02


def test_ptp_with_a_blend_does_not_stop():
    robot = kin.get_robot("puma560")
    a, b = robot.q_home + 0.3, robot.q_home + by(0.6, 0, 0.1, 0, 0.4, 0)
    motion = kin.plan_motion(
        robot, [kin.motion.Ptp(kin.motion.JointTarget(a), blend=0.05), kin.motion.Ptp(kin.motion.JointTarget(b))]
    )
    assert motion.planned
    assert_limits(motion)
    assert_continuous(motion)
    assert np.abs(motion.sample(motion.segments[0].end).qd).max() > 0.05
    assert np.abs(motion.sample(motion.duration).q - b).max() < 1e-9
    times = np.linspace(0, motion.duration, 2000)
    corner = kin.fk(robot, a)[:3, 3]
    assert np.linalg.norm(motion.sample(times).T[:, :3, 3] - corner, axis=1).min() < 0.05


@pytest.mark.parametrize("arm", ["ur5", "panda", "scara", "irb120"])
def test_ptp_and_lines_are_blended_in_the_joints(arm):
    robot = kin.get_robot(arm)
    rng = np.random.default_rng(5)
    q = moved(robot, robot.q_home, rng, 0.2)
    p = kin.fk(robot, q)[:3, 3]
    end = p + by(0.0, 0.08, 0.0 if arm == "scara" else -0.03)
    segments = [
        kin.motion.Ptp(kin.motion.JointTarget(q), blend=0.02),
        kin.motion.Lin(kin.motion.PoseTarget(end), blend=0.015, speed=0.5),
        kin.motion.Ptp(kin.motion.JointTarget(robot.q_home)),
    ]
    motion = kin.plan_motion(robot, segments)
    assert motion.planned
    assert not [note for note in motion.notes if hasattr(note, "why")]
    assert_limits(motion)
    assert_continuous(motion)
    for segment in motion.segments[:2]:
        assert motion.sample(segment.end).tool_speed > 0.01
    assert motion.sample(motion.duration).q == pytest.approx(robot.q_home, abs=1e-9)
    points = motion.sample(np.linspace(0, motion.duration, 4000)).T[:, :3, 3]
    to_first, to_second = np.linalg.norm(points - p, axis=1), np.linalg.norm(points - end, axis=1)
    assert 1e-4 < to_first.min() < 0.02
    assert 1e-4 < to_second.min() < 0.015
    # Between the zones the tool is on the line.
    between = slice(int(to_first.argmin()), int(to_second.argmin()))
    on_line = (to_first[between] > 0.02) & (to_second[between] > 0.015)
    assert on_line.sum() > 50
    way = (end - p) / np.linalg.norm(end - p)
    off = points[between][on_line] - p
    assert np.linalg.norm(off - np.outer(off @ way, way), axis=1).max() < 1e-6


def test_splines_pass_their_points():
    robot = kin.get_robot("panda")
    T = kin.fk(robot, robot.q_home)
    points = [T[:3, 3] + by(*d) for d in ([0, 0.1, 0.02], [0, 0.15, -0.05], [0.05, 0.1, -0.1])]
    motion = kin.plan_motion(robot, [kin.motion.Spline([kin.motion.PoseTarget(p) for p in points])])
    assert motion.planned
    found = motion.sample(np.linspace(0, motion.duration, 5000)).T[:, :3, 3]
    assert max(np.linalg.norm(found - p, axis=1).min() for p in points) < 1e-3
    assert_continuous(motion)
    rows = [
        robot.q_home + 0.1 * np.array(k)
        for k in ([1, 0, 0, 1, 0, 0, 0], [2, 1, 0, 2, 0, 0, 1], [1, 2, 0, 3, 0, 0, 2])
    ]
    joints = kin.plan_motion(robot, [kin.motion.Spline([kin.motion.JointTarget(q) for q in rows])])
    q = joints.sample(np.linspace(0, joints.duration, 5000)).q
    assert max(np.abs(q - row).max(axis=1).min() for row in rows) < 1e-3
    assert_limits(joints)


def test_the_speed_of_the_tool_is_limited():
    robot = kin.get_robot("ur5")
    p = kin.fk(robot, robot.q_home)[:3, 3]
    motion = kin.plan_motion(robot, [kin.motion.Lin(kin.motion.PoseTarget(p + by(0.2, 0, 0)), tool_speed=0.1)])
    speed = motion.sample(np.linspace(0, motion.duration, 999)).tool_speed
    assert 0.0995 < speed.max() <= 0.1
    T = kin.fk(robot, robot.q_home)
    T[:3, :3] = rotations(np.array([0, 0, 1.0]), np.ones(1))[0] @ T[:3, :3]
    turned = kin.plan_motion(robot, [kin.motion.Lin(kin.motion.PoseTarget.of(T), tool_turn=0.5)])
    turn = turned.sample(np.linspace(0, turned.duration, 999)).tool_turn
    assert 0.497 < turn.max() <= 0.5


def test_close_to_a_singularity_it_slows_down_and_says_where():
    robot = kin.get_robot("ur5")
    q = np.array([0, -1.2, 1.6, -1.9, 0.3, 0.2])
    end = q + by(0.02, 0, 0, 0, -0.6, 0)
    motion = line_of(robot, q, end)
    assert_limits(motion)
    assert_continuous(motion)
    (note,) = [note for note in motion.notes if hasattr(note, "ratio")]
    assert note.quantity == "velocity"
    assert 0.2 < note.fraction < 0.8
    assert note.singularity is not None
    assert "close to a singularity" in motion.reason


def test_a_line_out_of_the_workspace_is_refused_at_its_place():
    robot = kin.get_robot("irb120")
    p = kin.fk(robot, robot.q_home)[:3, 3]
    motion = kin.plan_motion(
        robot, [kin.motion.Dwell(0.1), kin.motion.Lin(kin.motion.PoseTarget(p + by(0.5, 0, 0)))]
    )
    refusal = motion.refusal
    assert (refusal.segment, refusal.cause) == (1, "unreachable")
    assert 0 < refusal.fraction < 1
    assert refusal.distance == pytest.approx(refusal.fraction * 0.5, abs=1e-3)
    assert [help_.code for help_ in refusal.helps] == ["closer"]


def test_a_joint_limit_on_the_way_is_named_with_what_would_help():
    robot = kin.get_robot("puma560")
    p = kin.fk(robot, robot.q_home)[:3, 3]
    motion = kin.plan_motion(robot, [kin.motion.Lin(kin.motion.PoseTarget(p + by(0, 0, -0.9)))])
    refusal = motion.refusal
    assert refusal.cause == "limits"
    violation = refusal.details.violation
    assert (violation.joint, violation.limit) == (1, pytest.approx(math.radians(-45)))
    assert violation.value < violation.limit
    assert "joint 2 (shoulder) reaches its limit of -45.0°" in motion.reason


@pytest.mark.parametrize("arm", ["irb120", "ur5", "puma560"])
def test_a_line_is_refused_where_the_joint_reaches_its_limit(arm):
    """At that place the joint is at its limit, to a millionth of the line."""
    robot, rng, count = kin.get_robot(arm), np.random.default_rng(5), 0
    for q in robot.random_q(rng, 60):
        T = kin.fk(robot, q)
        offset = rng.normal(size=3)
        offset *= 0.25 / np.linalg.norm(offset)
        refusal = kin.plan_motion(
            robot, [kin.motion.Lin(kin.motion.PoseTarget(tuple(T[:3, 3] + offset)))], q
        ).refusal
        if refusal is None or refusal.cause != "limits":
            continue
        count += 1
        at = kin.tolerances.TOLERANCES.limit
        violation = refusal.details.violation
        here = []
        for share in (refusal.fraction, refusal.fraction - 1e-6, refusal.fraction + 1e-6):
            T[:3, 3] = kin.fk(robot, q)[:3, 3] + share * offset
            postures = kin.solve_ik(robot, T, q_seed=q, respect_limits=False).solutions
            off = [math.remainder(s.q[violation.joint] - violation.limit, 2.0 * math.pi) for s in postures]
            here.append(min(off, key=abs))
        assert abs(here[0]) < 10.0 * at
        assert min(here[1:]) < 0.0 < max(here[1:])  # beyond it on one side, and not on the other
    assert count > 5


def test_the_refused_share_of_a_line_is_no_sample_beyond_the_limit():
    """A search in steps gave 0.7292 for 0.7267, where joint 3 is at 70°."""
    robot, way = kin.get_robot("irb120"), by(-0.2790033962141, 0, -0.2790033962141)
    T = kin.fk(robot, robot.q_home)
    refusal = kin.plan_motion(robot, [kin.motion.Lin(kin.motion.PoseTarget(tuple(T[:3, 3] + way)))]).refusal
    assert refusal.fraction == pytest.approx(0.7267, abs=1e-6)
    T[:3, 3] += 0.7267 * way
    bent = [s.q[2] for s in kin.solve_ik(robot, T, respect_limits=False).solutions]
    assert min(abs(value - math.radians(70.0)) for value in bent) < 1e-6


@pytest.mark.parametrize(("arm", "seed"), [("irb120", 6), ("irb120", 32), ("puma560", 4), ("stanford", 26)])
def test_a_suggested_posture_can_follow_the_line(arm, seed):
    robot = kin.get_robot(arm)
    rng = np.random.default_rng(seed)
    q0 = moved(robot, robot.q_home, rng, 0.6)
    line = [kin.motion.Lin(target(robot, moved(robot, q0, rng, 0.8)))]
    refusal = kin.plan_motion(robot, line, q0).refusal
    (posture,) = [help_.posture for help_ in refusal.helps if help_.code == "posture"]
    assert posture != kin.branch_of(robot, q0)
    assert kin.plan_motion(
        robot, line, kin.solve_ik(robot, kin.fk(robot, q0), branch=posture, q_seed=q0).best.q
    ).planned


@pytest.mark.parametrize(
    ("arm", "seed"), [("panda", 6), ("panda", 13), ("panda", 17), ("iiwa14", 4), ("iiwa14", 37)]
)
def test_a_joint_that_is_left_over_moves_away_from_limits_along_the_line(arm, seed):
    robot = kin.get_robot(arm)
    rng = np.random.default_rng(seed)
    q = robot.clip(robot.q_home + rng.normal(0, 0.5, robot.n))
    # With the least motion of the joints one of them would pass its limit.
    motion = line_of(robot, q, robot.clip(q + rng.normal(0, 0.5, robot.n)))
    assert motion.planned
    assert_limits(motion)
    assert_continuous(motion)


def test_what_few_joints_cannot_keep_is_refused():
    robot = kin.get_robot("scara")
    T = kin.fk(robot, robot.q_home)
    motion = kin.plan_motion(
        robot, [kin.motion.Lin(kin.motion.PoseTarget(T[:3, 3] + by(0.01, 0, 0), (1, 0, 0, 0)))]
    )
    assert motion.refusal.cause == "task"
    assert "4 joints cannot keep the path" in motion.reason
    kept = kin.plan_motion(robot, [kin.motion.Lin(kin.motion.PoseTarget(T[:3, 3] + by(0.01, 0.02, 0.03)))])
    assert kept.planned


def line(*offset, **fields):
    robot = kin.get_robot("panda")
    return kin.motion.Lin(kin.motion.PoseTarget(kin.fk(robot, robot.q_home)[:3, 3] + offset), **fields)


@pytest.mark.parametrize(
    ("segments", "notes"),
    [
        ([line(0, 0, 0)], []),
        ([line(0, 0, 0, blend=0.1), line(0, 0.1, 0)], ["short"]),
        ([line(0, 0.1, 0, blend=0.1), line(0, 0.1, 0)], ["short"]),
        ([line(0, 0.1, 0, blend=0.1), kin.motion.Dwell(0.1)], ["dwell"]),
        ([line(0, 0.1, 0, blend=0.1)], ["last"]),
        (
            [line(0, 0.1, 0, blend=0.1), kin.motion.Ptp(kin.motion.JointTarget(kin.get_robot("panda").home))],
            [0.05],
        ),
        ([line(0, 0.1, 0, blend=0.1), kin.motion.Ptp(line(0, 0.1, 0).target)], ["short"]),
        ([kin.motion.Ptp(line(0, 0.1, 0).target, blend=0.01), line(0, 0.1, 0)], ["short"]),
        ([kin.motion.Ptp(line(0, 0, 0).target, blend=0.01), line(0, 0.1, 0)], ["short"]),
        ([line(0, 0.1, 0, blend=9), line(0, 0, 0.1)], [0.05]),
        ([line(0, 0.1, 0, blend=0.02), line(0, 0, 0)], []),
        ([line(0, 0.1, 0, blend=0.02), line(0, 0.2, 0)], []),
    ],
)
def test_degenerate_programs_are_driven_sensibly(segments, notes):
    motion = kin.plan_motion("panda", segments)
    assert motion.planned
    assert_limits(motion)
    found = [getattr(n, "why", getattr(n, "used", None)) for n in motion.notes if not hasattr(n, "without")]
    assert found == [pytest.approx(note) if isinstance(note, float) else note for note in notes]
    end = motion.sample(motion.duration)
    assert not np.abs(end.qd).max() > 1e-9


def to(robot, kind, q, **fields):
    return {"L": kin.motion.Lin, "P": kin.motion.Ptp}[kind](target(robot, q), **fields)


@pytest.mark.parametrize("blend", [1e-5, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("kinds", ["LL", "LP", "PL", "PP"])
@pytest.mark.parametrize("arm", ["redundant7-craig", "puma560"])
def test_a_zone_that_is_too_small_is_left_out(arm, kinds, blend):
    robot = kin.get_robot(arm)
    a = robot.clip(robot.q_home + 0.3 * np.cos(np.arange(robot.n)))
    b = robot.clip(a + 0.3 * np.sin(1 + np.arange(robot.n)))

    def drive(blend):
        return kin.plan_motion(robot, [to(robot, kinds[0], a, blend=blend), to(robot, kinds[1], b)])

    found, stopped = drive(blend), drive(0)
    assert [note.why for note in found.notes if hasattr(note, "why")] == ["small"]
    assert "a thousandth of one of the two segments" in found.reason
    assert found.duration == pytest.approx(stopped.duration)
    assert np.isfinite(found.derivatives(np.linspace(0, found.duration, 500))).all()
    assert_limits(found)


def test_a_zone_beside_a_short_segment_is_left_out():
    segments = [
        kin.motion.Lin(line(0, 0.2, 0).target, blend=0.01),
        kin.motion.Lin(line(0, 0.20001, 0).target, blend=0.01),
        kin.motion.Lin(line(0, 0.2, 0.2).target),
    ]
    motion = kin.plan_motion("panda", segments)
    assert [note.why for note in motion.notes if hasattr(note, "why")] == ["small", "small"]
    assert motion.duration < 5.0
    assert_limits(motion)


P = np.array([0.4, 0.1, 0.3])


@pytest.mark.parametrize(
    ("via", "end", "expected"),
    [
        (P, P + by(0.1, 0, 0), ("start", "via point")),
        (P + by(0.1, 0, 0), P + by(0.1, 0, 0), ("via point", "target")),
        (P + by(0.1, 0, 0), P, ("start", "target")),
        (P, P, ("start", "via point")),
        (P + by(0.2, 0, 0), P + by(0.1, 0, 0), None),
    ],
)
def test_points_that_define_no_arc(via, end, expected):
    assert arc_through(P, via, end, turning(np.eye(3), np.eye(3), False)) == expected


def test_a_via_point_on_the_line_gives_a_line():
    curve = arc_through(P, P + by(0.1, 0, 0), P + by(0.3, 0, 0), turning(np.eye(3), np.eye(3), False))
    assert poses(curve, np.array([0.15]))[0, :3, 3] == pytest.approx(P + by(0.15, 0, 0))


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_both_ways_to_turn_begin_and_end_at_the_given_orientations(seed):
    rng = np.random.default_rng(seed)
    start, end = (kin.rotation_from_wxyz(row / np.linalg.norm(row)) for row in rng.normal(size=(2, 4)))
    for two_axis in (False, True):
        turn = turning(start, end, two_axis)
        found = turn.rotations(np.array([0.0, 0.5, 1.0]))
        assert found[0] == pytest.approx(start, abs=1e-9)
        assert found[2] == pytest.approx(end, abs=1e-7)
        if two_axis:
            # The approach direction stays in the plane of both.
            assert abs(found[1][:, 2] @ np.cross(start[:, 2], end[:, 2])) < 1e-7


def test_another_task_keeps_less():
    robot = kin.get_robot("ur5")
    T = kin.fk(robot, robot.q_home)
    end = kin.motion.PoseTarget(T[:3, 3] + by(0.1, 0, 0))
    for task in ("approach", "position"):
        motion = kin.plan_motion(robot, kin.motion.Program([kin.motion.Lin(end)], task=task))
        points = motion.sample(np.linspace(0, motion.duration, 500)).T[:, :3, 3]
        assert np.abs(points[:, 1:] - T[1:3, 3]).max() < 1e-6
        assert_limits(motion)


def test_a_computation_can_be_cancelled():
    class CancelledError(Exception):
        pass

    def cancel():
        raise CancelledError

    with pytest.raises(CancelledError):
        kin.plan_motion("panda", [line(0, 0.1, 0)], cancel=cancel)
