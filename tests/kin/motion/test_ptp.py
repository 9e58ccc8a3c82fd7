"""Point-to-point motions: against another library, within limits, at rest at both ends."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin.motion import scurve
from kin.motion.pieces import JointMotion
from kin.motion.tasks import most_kept, motion_dimension

CASES = json.loads((Path(__file__).parents[2] / "data/motion-times.json").read_text(encoding="utf-8"))
ARMS = tuple(kin.files.classic_robots())
positive = st.floats(1e-2, 1e3)


def limits_of(velocity, acceleration, jerk):
    return np.stack([velocity, acceleration, jerk], axis=1).astype(float)


@pytest.mark.parametrize("case", CASES["joint_motions"])
def test_the_time_is_that_of_ruckig(case):
    limits = limits_of(case["velocity"], case["acceleration"], case["jerk"])
    motion = JointMotion.between(np.array(case["start"]), np.array(case["end"]), limits)
    assert motion.duration == pytest.approx(case["seconds"], rel=1e-9)


@given(st.floats(-10, 10), st.floats(-10, 10), positive, positive, positive)
def test_a_joint_goes_from_rest_to_rest_within_its_limits(start, end, v, a, j):
    motion = JointMotion.between(np.array([start, 0.0]), np.array([end, 0.5]), limits_of([v, 1], [a, 2], [j, 3]))
    ends = motion.at(np.array([0.0, motion.duration]))[..., 0]
    size = max(abs(start), abs(end), 1.0)
    assert ends[0] == pytest.approx([start, end], abs=1e-12 * size)
    assert abs(ends[1]).max() <= 1e-9 * v
    sizes = np.abs(motion.at(motion.grid())).max(axis=1)[1:, 0]
    assert (sizes <= np.array([v, a, j]) * (1 + 1e-9)).all()


@given(st.floats(-3, 3), positive, positive, positive)
def test_position_velocity_and_acceleration_are_continuous(end, v, a, j):
    motion = JointMotion.between(np.zeros(1), np.array([end]), limits_of([v], [a], [j]))
    breaks = motion.breaks[0, 1:-1]
    step = 1e-9 * motion.duration
    jumps = np.abs(motion.at(breaks + step) - motion.at(np.maximum(breaks - step, 0.0)))[:3, :, 0].max(axis=1)
    assert jumps[0] <= 2.1 * step * v + 1e-15 * abs(end)
    assert jumps[1] <= 2.1 * step * a + 1e-12 * v
    assert jumps[2] <= 2.1 * step * j + 1e-12 * a


def test_start_and_end_the_same_takes_no_time():
    robot = kin.get_robot("ur5")
    motion = kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.JointTarget(robot.home))])
    assert (motion.planned, motion.duration) == (True, 0.0)
    assert motion.sample(0.0).q.tolist() == list(robot.home)
    assert [peak.peak for peak in motion.peaks] == [0.0] * 20


@settings(max_examples=20)
@given(st.sampled_from(ARMS), st.integers(0, 2**32 - 1), st.floats(0.05, 1), st.floats(0.05, 1))
def test_random_programs_keep_every_limit_on_every_arm(arm, seed, speed, acceleration):
    robot = kin.get_robot(arm)
    targets = robot.random_q(np.random.default_rng(seed), 3)
    program = [
        kin.motion.Ptp(kin.motion.JointTarget(tuple(q)), speed=speed, acceleration=acceleration)
        for q in targets.tolist()
    ]
    program.insert(1, kin.motion.Dwell(0.25))
    motion = kin.plan_motion(robot, program)
    assert motion.planned
    assert all(peak.ratio <= 1 + 1e-9 for peak in motion.peaks if peak.ratio is not None)
    for i in range(4):
        assert all(peak.ratio <= 1 + 1e-9 for peak in motion.segment_peaks(i) if peak.ratio is not None)
    # In each PTP some joint is at a limit all the time; without jerk it would be faster.
    times = [motion.segments[i].end for i in (0, 2, 3)]
    assert np.abs(motion.sample(times).q - targets).max() < 1e-12
    assert motion.duration == motion.segments[-1].end
    again = kin.plan_motion(robot, program)
    grid = np.linspace(0, motion.duration, 97)
    assert (again.derivatives(grid) == motion.derivatives(grid)).all()


def test_a_pose_target_is_reached_in_the_nearest_posture():
    robot = kin.get_robot("panda")
    T = kin.fk(robot, robot.q_home)
    T[0, 3] += 0.1
    motion = kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.PoseTarget.of(T))])
    end = motion.sample(motion.duration)
    assert np.abs(end.T - T).max() < 1e-9
    assert np.abs(end.q - robot.q_home).max() < 0.6
    kept = kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.PoseTarget(tuple(T[:3, 3])))])
    assert np.abs(kept.sample(kept.duration).T - T).max() < 1e-9


def test_before_and_after_the_motion_the_arm_is_at_rest():
    robot = kin.get_robot("scara")
    q = [0.1, 0.2, 0.05, 1.0]
    motion = kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.JointTarget(q))])
    sample = motion.sample([-1.0, 99.0])
    assert sample.q.tolist() == [list(robot.home), pytest.approx(q)]
    assert not sample.qd.any()
    assert not sample.qdd.any()
    assert sample.tool_speed.tolist() == [0.0, 0.0]
    assert motion.sample(motion.duration / 2).tool_speed > 0.1


def test_derivatives_are_those_of_the_joint_values():
    robot = kin.get_robot("puma560")
    motion = kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.JointTarget((1, 0.5, -1, 0.5, -1, 2)))])
    t, h = np.linspace(0.05, motion.duration - 0.05, 40), 1e-5
    q, qd, qdd, _ = motion.derivatives(t)
    before, after = motion.derivatives(t - h)[0], motion.derivatives(t + h)[0]
    assert np.abs((after - before) / (2 * h) - qd).max() < 1e-5
    assert np.abs((after - 2 * q + before) / h**2 - qdd).max() < 2e-2
    poses = [motion.sample(t + s).T[:, :3, 3] for s in (-h, h)]
    assert np.abs((poses[1] - poses[0]) / (2 * h) - motion.sample(t).twist[:, :3]).max() < 1e-4


def test_a_target_outside_the_limits_is_refused_with_joint_and_value():
    robot = kin.get_robot("panda")
    q = list(robot.home)
    q[3] = 0.5
    motion = kin.plan_motion(robot, [kin.motion.Dwell(1), kin.motion.Ptp(kin.motion.JointTarget(q), name="up")])
    refusal = motion.refusal
    assert (refusal.segment, refusal.cause, motion.duration, motion.segments) == (1, "target", 0.0, ())
    assert motion.reason == (
        "Segment 2 (PTP, up) cannot be driven: the target is outside the limits: joint 4 at 28.6° (limit -4.0°)."
    )


def test_a_pose_out_of_reach_and_a_start_outside_are_refused():
    robot = kin.get_robot("ur5")
    motion = kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.PoseTarget((3, 0, 0)))])
    assert motion.refusal.cause == "unreachable"
    assert "out of reach" in motion.reason
    assert "closer" in motion.reason
    outside = kin.plan_motion(robot, [kin.motion.Dwell(1)], [7, 0, 0, 0, 0, 0])
    assert outside.refusal.cause == "start"
    assert "joint 1 (base) at 401.1° (limit 360.0°)" in outside.reason


def test_assumed_limits_are_marked():
    panda, ur5 = kin.motion.motion_limits(kin.get_robot("panda")), kin.motion.motion_limits(kin.get_robot("ur5"))
    assert panda.assumed == ((),) * 7
    assert panda.jerk[0] == 7500
    assert ur5.assumed == (("acceleration", "jerk"),) * 6
    assert ur5.velocity[0] == pytest.approx(math.pi)
    scara = kin.motion.motion_limits(kin.get_robot("scara"))
    assert scara.velocity[2] == pytest.approx(1.1)
    assert np.isnan(scara.effort).all()
    own = kin.Robot.from_dh([kin.Joint("slide", kind="prismatic", limits=(0, 1)), (0, 0, 1, 0)])
    found = kin.motion.motion_limits(own)
    assert found.assumed == (("velocity", "acceleration", "jerk"),) * 2
    assert found.velocity.tolist() == [1.0, math.pi]
    peaks = kin.plan_motion(own, [kin.motion.Ptp(kin.motion.JointTarget((0.2, 1)))]).peaks
    assert all(peak.assumed for peak in peaks if peak.joint is not None)


@pytest.mark.parametrize(
    ("arm", "task", "why"),
    [("scara", None, "4 joints cannot hold this orientation"), ("pioneer5", "pose", "reached with roll error")],
)
def test_a_compromise_is_no_target(arm, task, why):
    robot = kin.get_robot(arm)
    T = kin.fk(robot, robot.q_home) @ kin.pose_from_xyz_rpy((0, 0, 0), (0.3, 0, 0))
    motion = kin.plan_motion(robot, kin.motion.Program([kin.motion.Ptp(kin.motion.PoseTarget.of(T))], task=task))
    assert motion.refusal.cause == "unreachable"
    assert why in motion.reason
    assert [help_.code for help_ in motion.refusal.helps] == ["task"]
    kept = kin.plan_motion(
        robot, kin.motion.Program([kin.motion.Ptp(kin.motion.PoseTarget.of(T))], task="position")
    )
    assert np.abs(kept.sample(kept.duration).T[:3, 3] - T[:3, 3]).max() < 1e-9


@pytest.mark.parametrize("joints", [1, 2, 3, 4, 5])
def test_arms_of_few_joints_meet_whole_poses_where_they_can(joints):
    planar = kin.Robot.from_dh([(0, 0, 0.3, 0)] * joints, home=[0.3, 0.5, 0.7, 0.4, 0.2][:joints])
    T = kin.fk(planar, planar.q_home + np.array([0.2, 0.3, -0.2, 0.1, 0.1])[:joints])
    motion = kin.plan_motion(planar, [kin.motion.Ptp(kin.motion.PoseTarget.of(T))])
    assert motion.planned
    assert np.abs(motion.sample(motion.duration).T - T).max() < 1e-9


@pytest.mark.parametrize(
    ("rows", "dimension", "task"),
    [
        ([(0, 0, 0.3, 0)], 1, "pose"),
        ([(0, 0, 0.3, 0)] * 2, 3, "position"),
        ([(0, 0, 0.3, 0)] * 4, 3, "pose"),
        ([(0, 0, 0, math.pi / 2)] * 3, 3, "pose"),
        ([(0, 0.1, 0.2, math.pi / 2), (0, 0, 0.3, 0), (0, 0, 0.3, 0)], 6, "position"),
        ([(0, 0.1, 0.2, 0.5)] * 5, 6, "approach"),
    ],
)
def test_what_an_arm_keeps_follows_from_the_group_of_its_motions(rows, dimension, task):
    robot = kin.Robot.from_dh(rows)
    assert (motion_dimension(robot), most_kept(robot)) == (dimension, task)
    assert [motion_dimension(kin.get_robot(arm)) for arm in ("scara", "pioneer5", "ur5")] == [4, 6, 6]


def test_the_peaks_of_a_segment_are_its_own():
    robot = kin.get_robot("ur5")
    q = kin.motion.JointTarget(robot.q_home + 0.5)
    motion = kin.plan_motion(
        robot,
        [
            kin.motion.Ptp(q),
            kin.motion.Dwell(0.5),
            kin.motion.Ptp(q),
            kin.motion.Ptp(kin.motion.JointTarget(robot.home)),
        ],
    )
    assert motion.segments[2].start == motion.segments[2].end
    assert [max(peak.peak for peak in motion.segment_peaks(i)) > 0 for i in range(4)] == [True, False, False, True]
    whole = [
        max(sizes) for sizes in zip(*([p.peak for p in motion.segment_peaks(i)] for i in (0, 3)), strict=True)
    ]
    assert [peak.peak for peak in motion.peaks] == pytest.approx(whole, rel=1e-12)


def test_a_slow_segment_after_a_fast_one_has_its_own_peaks():
    robot = kin.get_robot("ur5")
    ends = [kin.motion.JointTarget(robot.q_home + 0.01 * k * (-1) ** k) for k in range(60)]
    motion = kin.plan_motion(robot, [kin.motion.Ptp(q, acceleration=(0.05, 1)[k % 2]) for k, q in enumerate(ends)])
    for i in range(len(ends)):
        assert all(peak.ratio <= 1 + 1e-9 for peak in motion.segment_peaks(i) if peak.ratio is not None)


def test_the_peak_of_the_tool_is_not_understated():
    robot = kin.get_robot("puma560")
    motion = kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.JointTarget((1, 0.5, -1, 0.5, -1, 2)))])
    sample = motion.sample(np.linspace(0, motion.duration, 20001))
    for peak, sizes in zip(motion.peaks[-2:], (sample.tool_speed, sample.tool_turn), strict=True):
        assert sizes.max() <= peak.peak * (1 + 1e-9)
        assert getattr(motion.sample(peak.time), peak.quantity) == pytest.approx(peak.peak, rel=1e-9)


@pytest.mark.parametrize("jerk", [1e6, 1e12, 2e17, 1e20])
def test_a_large_jerk_does_not_exceed_the_acceleration(jerk):
    motion = JointMotion.between(np.zeros(2), np.array([0.33, 0.0]), limits_of([1, 1], [4, 4], [jerk, jerk]))
    times = np.concatenate([motion.grid(), motion.breaks[0]])
    assert (np.abs(motion.at(times))[2] <= 4 * (1 + 1e-9)).all()
    assert motion.duration == pytest.approx(0.33 + 0.25, rel=1e-4)


@pytest.mark.parametrize(("v", "a", "j"), [(5e-8, 1e9, 1e12), (1e-9, 1.0, 1e12), (1e-6, 1e12, 1e12)])
def test_a_velocity_reached_in_a_tiny_part_of_the_time_is_not_exceeded(v, a, j):
    motion = JointMotion.between(np.array([0.97]), np.array([12.1]), limits_of([v], [a], [j]))
    breaks = motion.breaks[0]
    times = np.concatenate([motion.grid(), breaks, np.nextafter(breaks[1:], 0.0)])
    peaks = np.abs(motion.at(times)).max(axis=(1, 2))[1:]
    assert (peaks <= np.array([v, a, j]) * (1 + 1e-9)).all()
    assert motion.at(breaks[-1:])[1, 0, 0] == pytest.approx(0.0, abs=1e-6 * v)
    assert motion.duration == pytest.approx((12.1 - 0.97) / v, rel=1e-8)


def test_a_distance_too_short_to_take_any_time_takes_none():
    plain = getattr(scurve.phase_times, "py_func", scurve.phase_times)
    for phase_times in (plain, scurve.phase_times):
        assert phase_times(5e-324, 10.0, 1e12, 1.0) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"velocity": np.zeros(6)}, "motion_limits.velocity[0]"),
        ({"acceleration": [1, 1, -1, 1, 1, 1]}, "motion_limits.acceleration[2]"),
        ({"jerk": [math.inf] * 6}, "motion_limits.jerk[0]"),
        ({"jerk": [1, 1, 1, 1, 1, math.nan]}, "motion_limits.jerk[5]"),
        ({"velocity": np.ones(5)}, "motion_limits.velocity"),
        ({"velocity": "fast"}, "motion_limits.velocity"),
        ({"effort": [-1] * 6}, "motion_limits.effort[0]"),
    ],
)
def test_limits_are_checked(change, field):
    given = kin.motion.motion_limits(kin.get_robot("ur5"))
    values = {key: getattr(given, key) for key in ("velocity", "acceleration", "jerk", "effort", "assumed")}
    with pytest.raises(kin.InputError) as caught:
        kin.motion.MotionLimits(**values | change)
    assert caught.value.field == field


def test_limits_are_those_of_the_arm():
    ur5, panda = kin.get_robot("ur5"), kin.get_robot("panda")
    program = [kin.motion.Ptp(kin.motion.JointTarget(ur5.q_home + 0.5))]
    with pytest.raises(kin.InputError, match=r"motion_limits: .* of 6 joints"):
        kin.plan_motion(ur5, program, motion_limits=kin.motion.motion_limits(panda))
    none = [math.nan] * 6
    whole = kin.motion.MotionLimits([1] * 6, np.full(6, 2), [10**9] * 6, none, ((),) * 6)
    assert not whole.velocity.flags.writeable
    assert kin.plan_motion(ur5, program, motion_limits=whole).duration == pytest.approx(0.5 + 0.5)
    wild = kin.Robot.from_dh([kin.Joint("a", velocity=1e308), (0, 0, 1, 0)])
    with pytest.raises(kin.InputError, match=r"motion_limits.velocity\[0\]"):
        kin.motion.motion_limits(wild)
    fast = kin.motion.motion_limits(kin.Robot.from_dh([kin.Joint("a", velocity=1e12), (0, 0, 1, 0)]))
    assert (fast.acceleration[0], fast.jerk[0]) == (1e12, 1e12)


@pytest.mark.parametrize("bad", [[1, 2], [[0] * 6] * 2, ["a"] * 6])
def test_a_malformed_start_raises(bad):
    with pytest.raises(kin.InputError, match="q_start"):
        kin.plan_motion(kin.get_robot("ur5"), [kin.motion.Dwell(1)], bad)
