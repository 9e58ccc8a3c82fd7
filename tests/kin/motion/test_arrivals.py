"""In which joint values a segment meets a recorded target, and from where it would arrive as recorded."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

import kin
from kin.motion import (
    Circ,
    Dwell,
    JointTarget,
    Lin,
    PoseTarget,
    Program,
    Ptp,
    Spline,
    plan_motion,
    start_as_recorded,
)
from kin.motion.details import ArrivesOtherwise
from kin.transforms import pose_from_position_wxyz

UR5, PANDA = kin.get_robot("ur5"), kin.get_robot("panda")
DOWN = (0.0, math.sqrt(0.5), -math.sqrt(0.5), 0.0)  # the tool points down: roll 180°, yaw −90°
NEAR, FAR = (0.3, 0.35, 0.35), (-0.4, -0.1, 0.3)


def solved(position: tuple[float, float, float]) -> list[np.ndarray]:
    return [each.q for each in kin.solve_ik(UR5, pose_from_position_wxyz(position, DOWN)).solutions]


def recorded(*targets: np.ndarray, kind: type = Lin) -> Program:
    first, *others = (JointTarget(tuple(q.tolist())) for q in targets)
    return Program((Ptp(first), *(kind(each) for each in others)))


PAIRS = list(product(range(4), range(4)))


@pytest.mark.parametrize(("k", "m"), PAIRS)
def test_a_line_that_arrives_in_another_posture_says_so_and_from_where_it_would_arrive_as_recorded(k, m):
    start, end = solved(NEAR)[k], solved(FAR)[m]
    motion = plan_motion(UR5, recorded(start, end), start)
    assert motion.planned
    arrival = motion.segments[1].arrival
    assert np.allclose(arrival.q, motion.derivatives(motion.duration)[0], atol=1e-9)
    assert np.abs(kin.fk(UR5, arrival.q) - kin.fk(UR5, end)).max() < 2e-6
    off = np.abs(arrival.q - end)
    notes = [note for note in motion.notes if isinstance(note, ArrivesOtherwise)]
    if off.max() < 1e-3:
        assert (arrival.as_recorded, notes) == (True, [])
        return
    (note,) = notes
    assert not arrival.as_recorded
    assert note.move.motion == pytest.approx(off.max(), abs=1e-9)
    assert note.move.joint == int(np.argmax(np.round(off, 6)))
    assert (note.posture, note.recorded) == (kin.branch_of(UR5, arrival.q), kin.branch_of(UR5, end))
    assert f"{math.degrees(off.max()):.1f}°" in motion.reason
    other = start_as_recorded(motion, 1)
    assert np.abs(kin.fk(UR5, other) - kin.fk(UR5, start)).max() < 2e-6
    again = plan_motion(UR5, recorded(other, end), other)
    assert np.abs(again.derivatives(again.duration)[0] - end).max() < 1e-3
    assert not any(isinstance(each, ArrivesOtherwise) for each in again.notes)


def test_the_arm_whose_base_is_149_degrees_away():
    """What the tab Program showed as joint values that the arm never takes."""
    start = next(q for q in solved(NEAR) if abs(math.degrees(q[0]) - 215.7) < 0.1 and q[2] > 0.0)
    ends = [q for q in solved(FAR) if abs(math.degrees(q[0]) - 209.4) < 0.1]
    motions = [plan_motion(UR5, recorded(start, end), start) for end in ends]
    away = [math.degrees(abs(each.segments[1].arrival.difference[0])) for each in motions]
    assert away == pytest.approx([149.3] * len(ends), abs=0.05)


def test_an_arc_backwards_is_the_same_arc():
    start = solved(NEAR)[0]
    via = (0.1, 0.45, 0.45)
    for end in solved(FAR)[1:4]:
        target = JointTarget(tuple(end.tolist()))
        program = Program((Ptp(JointTarget(tuple(start.tolist()))), Circ(via, target)))
        motion = plan_motion(UR5, program, start)
        if motion.segments[1].arrival.as_recorded:
            continue
        other = start_as_recorded(motion, 1)
        if other is None:
            continue
        again = plan_motion(UR5, Program((Circ(via, target),)), other)
        assert np.abs(again.derivatives(again.duration)[0] - end).max() < 1e-3
        return
    pytest.fail("no arc arrives otherwise")


def test_targets_that_are_poses_have_nothing_to_differ_from():
    program = Program(
        (
            Lin(PoseTarget(NEAR)),
            Dwell(0.1),
            Spline((PoseTarget(NEAR), PoseTarget((0.3, 0.3, 0.3)))),
            Ptp(JointTarget(tuple(UR5.q_home.tolist()))),
        )
    )
    motion = plan_motion(UR5, program, solved((0.3, 0.3, 0.4))[0])
    arrivals = [each.arrival for each in motion.segments]
    assert [each and each.recorded is None for each in arrivals] == [True, None, True, False]
    assert [each is None or each.as_recorded for each in arrivals] == [True] * 4
    assert start_as_recorded(motion, 0) is None
    for arrival, times in zip(arrivals, motion.segments, strict=True):
        if arrival is not None:
            assert np.allclose(arrival.q, motion.derivatives(times.end)[0], atol=1e-9)


def test_with_a_zone_the_arrival_is_that_of_the_line_without_it():
    start = solved(NEAR)[0]
    middle, last = PoseTarget((0.1, 0.4, 0.35)), PoseTarget((0.0, 0.45, 0.45))
    round_ = plan_motion(UR5, Program((Lin(middle, blend=0.05), Lin(last))), start)
    sharp = plan_motion(UR5, Program((Lin(middle), Lin(last))), start)
    assert np.abs(round_.segments[0].arrival.q - sharp.segments[0].arrival.q).max() < 1e-5
    assert np.abs(round_.derivatives(round_.segments[0].end)[0] - sharp.segments[0].arrival.q).max() > 1e-3


def test_an_arm_with_a_joint_left_over_says_by_how_much_its_elbow_differs():
    q = PANDA.q_home + np.array([0.3, 0.2, 0.4, -0.1, 0.2, 0.1, 0.0])
    motion = plan_motion(PANDA, [Lin(JointTarget(tuple(q.tolist())))], PANDA.q_home)
    arrival = motion.segments[0].arrival
    assert np.abs(kin.fk(PANDA, arrival.q) - kin.fk(PANDA, q)).max() < 2e-6
    notes = [note for note in motion.notes if isinstance(note, ArrivesOtherwise)]
    assert len(notes) == (np.abs(arrival.q - q).max() > 1e-3)
