"""A program that cannot be driven keeps what can."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin.motion import Circ, Dwell, JointTarget, Lin, PoseTarget, Program, Ptp, plan_motion

UR5 = kin.get_robot("ur5")
START = kin.solve_ik(UR5, kin.fk(UR5, UR5.q_home)).solutions[0].q
HERE = kin.fk(UR5, START)[:3, 3]


def beside(offset: list[float]) -> tuple[float, ...]:
    return tuple((HERE + np.array(offset)).tolist())


NEXT = PoseTarget(beside([0.0, 0.1, 0.05]))
BESIDE = PoseTarget(beside([0.05, 0.1, -0.05]))
TOO_FAR = PoseTarget((float(HERE[0]) * 4.0, float(HERE[1]), float(HERE[2])))


def rests(motion: kin.motion.Motion) -> bool:
    return bool(np.abs(motion.derivatives(motion.duration)[1]).max() < 1e-9)


def test_segments_before_the_refused_one_are_driven_as_without_it():
    program = Program((Ptp(JointTarget(tuple(START))), Lin(NEXT), Dwell(0.2), Lin(BESIDE), Lin(TOO_FAR)))
    motion = plan_motion(UR5, program, START)
    alone = plan_motion(UR5, Program(program.segments[:4]), START)
    assert (motion.planned, motion.segments, motion.duration) == (False, (), 0.0)
    part = motion.part
    assert part is motion.driven
    assert [(each.index, each.start, each.end) for each in part.segments[:4]] == [
        (each.index, each.start, each.end) for each in alone.segments
    ]
    assert np.array_equal(part.derivatives(0.5 * alone.duration), alone.derivatives(0.5 * alone.duration))
    assert all(peak.ratio < 1.0 + 1e-9 for peak in part.peaks if peak.ratio is not None)


@pytest.mark.parametrize("kind", ["lin", "circ"])
def test_the_beginning_of_a_refused_line_or_arc_is_driven_to_just_before_its_place(kind):
    via = beside([-0.3, 0.05, 0.0])
    bad = Lin(TOO_FAR) if kind == "lin" else Circ(via, TOO_FAR)
    motion = plan_motion(UR5, Program((bad,)), START)
    refusal, part = motion.refusal, motion.part
    points = part.sample(np.linspace(0.0, part.duration, 4001)).T[:, :3, 3]
    covered = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert 0.85 * refusal.distance < covered.sum() < refusal.distance
    assert rests(part)
    if kind == "lin":
        end = part.sample(part.duration).T[:3, 3]
        way = np.array(TOO_FAR.position) - HERE
        assert np.linalg.norm(np.cross(end - HERE, way)) / np.linalg.norm(way) < 2e-6


def test_a_zone_into_the_refused_segment_becomes_a_stop():
    program = Program((Lin(NEXT, blend=0.03), Lin(BESIDE, blend=0.03), Lin(TOO_FAR)))
    part = plan_motion(UR5, program, START).part
    assert [each.blend for each in part.program.segments] == [0.03, 0.0, 0.0]
    at = part.segments[1].end
    assert np.allclose(part.sample(at).T[:3, 3], BESIDE.position, atol=2e-6)
    assert np.abs(part.derivatives(at)[1]).max() < 1e-9


def test_nothing_is_left_of_a_start_outside_the_limits_and_of_a_first_target_outside():
    outside = START.copy()
    outside[0] = 7.0
    assert plan_motion(UR5, [Lin(NEXT)], outside).part is None
    refused = plan_motion(UR5, [Ptp(JointTarget(tuple(outside)))], START)
    assert (refused.planned, refused.part, refused.driven) == (False, None, None)
    planned = plan_motion(UR5, [Lin(NEXT)], START)
    assert (planned.part, planned.driven) == (None, planned)


def test_what_touches_ends_before_it_and_what_is_left_touches_nothing():
    away = START + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    middle = kin.fk(UR5, 0.5 * (START + away))[:3, 3]
    post = kin.Obstacle("cylinder", middle.tolist(), radius=0.05, height=0.3, name="post")
    program = Program((Lin(NEXT, blend=0.02), Lin(BESIDE), Ptp(JointTarget(tuple(away))), Dwell(1.0)))
    motion = plan_motion(UR5, program, START, obstacles=[post])
    assert motion.refusal.segment == 2
    assert [each.index for each in motion.part.segments] == [0, 1]
    q = motion.part.derivatives(np.linspace(0.0, motion.part.duration, 500))[0]
    assert (kin.clearance(UR5, q, [post]) > 0.0).all()


def test_what_touches_before_a_segment_that_cannot_be_driven_is_said_first():
    away = START + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    middle = kin.fk(UR5, 0.5 * (START + away))[:3, 3]
    post = kin.Obstacle("cylinder", middle.tolist(), radius=0.05, height=0.3, name="post")
    program = Program((Lin(NEXT), Ptp(JointTarget(tuple(away))), Ptp(TOO_FAR)))
    motion = plan_motion(UR5, program, START, obstacles=[post])
    assert (motion.refusal.segment, motion.refusal.cause) == (1, "collision")
    assert motion.program == program
    assert [each.index for each in motion.part.segments] == [0]
