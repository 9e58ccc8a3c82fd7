"""Blends that would cost time are left out: a zone never makes a motion longer."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin.motion.planning import zones
from kin.motion.planning.plan import RefusedError

ARMS = tuple(kin.files.classic_robots())
LONGER = 0.01  # the timing of a path is within this part of the best


def near(robot, q, rng, size):
    return robot.clip(q + rng.normal(0, size, robot.n) * np.where(robot.revolute, 1, 0.1))


def random_case(robot, seed):
    """Two to four segments with zones of any size, and limits of jerk of three magnitudes."""
    rng = np.random.default_rng(seed)
    q = start = near(robot, robot.q_home, rng, 0.15)
    segments, unequal = [], rng.random() < 0.4
    for _ in range(rng.integers(2, 5)):
        before, q = q, near(robot, q, rng, 10 ** rng.uniform(-2, -0.6))
        length = np.linalg.norm(kin.fk(robot, q)[:3, 3] - kin.fk(robot, before)[:3, 3])
        fields = {
            "speed": rng.uniform(0.2, 1) if unequal else 1,
            "acceleration": 10 ** rng.uniform(-1, 0) if unequal else 1,
            "blend": length * 10 ** rng.uniform(-3.3, 0) if rng.random() < 0.85 else 0,
            "tool_speed": 10 ** rng.uniform(-2, 0) if rng.random() < 0.2 else None,
        }
        if rng.random() < 0.6:
            segments.append(kin.motion.Lin(kin.motion.PoseTarget.of(kin.fk(robot, q)), **fields))
        else:
            segments.append(kin.motion.Ptp(kin.motion.JointTarget(q), **fields))
    limits = kin.motion.motion_limits(robot)
    limits = replace(limits, jerk=limits.jerk * 10 ** rng.uniform(-1, 1))
    return kin.motion.Program(segments, jerk_limited=bool(rng.random() < 0.7)), start, limits


def without_blends(program):
    return replace(program, segments=[replace(each, blend=0) for each in program.segments])


def assert_no_longer(arm, seed):
    robot = kin.get_robot(arm)
    program, start, limits = random_case(robot, seed)
    blended = kin.plan_motion(robot, program, start, motion_limits=limits)
    stopped = kin.plan_motion(robot, without_blends(program), start, motion_limits=limits)
    if blended.planned and stopped.planned:
        assert blended.duration <= (1 + LONGER) * stopped.duration, (arm, seed)
    return blended.planned and stopped.planned


@pytest.mark.full
@settings(max_examples=12)
@given(st.sampled_from(ARMS), st.integers(0, 2**32 - 1))
def test_a_zone_never_makes_a_motion_longer(arm, seed):
    assert_no_longer(arm, seed)


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS)
def test_no_zone_of_many_makes_a_motion_longer(arm):
    assert sum(assert_no_longer(arm, 1000 + seed) for seed in range(150)) > 30


def corners(*blends):
    """Lines of a UR5 that turn by a right angle, with these zones between them."""
    robot = kin.get_robot("ur5")
    at, segments = kin.fk(robot, robot.q_home)[:3, 3], []
    for k, blend in enumerate([*blends, 0.0]):
        at = at + 0.1 * np.array([k % 2 == 0, 0.0, k % 2])
        segments.append(kin.motion.Lin(kin.motion.PoseTarget(at), blend=blend))
    return kin.plan_motion(robot, segments)


def left_out(motion):
    return {note.segment: note for note in motion.notes if getattr(note, "why", None) == "slower"}


def test_only_the_zone_that_costs_time_is_left_out():
    motion = corners(0.04, 0.0003, 0.04)
    (note,) = left_out(motion).values()
    assert note.segment == 1
    assert note.passing > note.stopping
    assert (
        f"segment 2: with the blend it would take longer, from the middle of this segment to that of the next "
        f"{note.passing:.3f} s instead of {note.stopping:.3f} s." in motion.reason
    )
    speeds = [motion.sample(segment.end).tool_speed for segment in motion.segments]
    assert speeds[0] > 0.01
    assert speeds[2] > 0.01
    assert speeds[1] < 1e-9
    assert motion.duration == pytest.approx(corners(0.04, 0.0, 0.04).duration, rel=1e-9)
    assert motion.duration < corners(0.0, 0.0, 0.0).duration


def test_zones_that_save_time_are_kept():
    motion = corners(0.04, 0.03, 0.04)
    assert not left_out(motion)
    assert min(motion.sample(segment.end).tool_speed for segment in motion.segments[:-1]) > 0.01


def test_a_stop_that_cannot_be_driven_leaves_the_blend(monkeypatch):
    refused = kin.plan_motion("ur5", [kin.motion.Lin(kin.motion.PoseTarget((9.0, 0.0, 0.0)))]).refusal

    def refuse(plan, index, *, drive=zones.drive):
        if plan.stops:
            raise RefusedError(refused)
        return drive(plan, index)

    monkeypatch.setattr(zones, "drive", refuse)
    motion = corners(0.0003)
    assert motion.planned
    assert not left_out(motion)
