"""Paths and motions that must not touch the arm itself or obstacles."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin.transforms import wxyz_from_rotation

IIWA, UR5 = kin.get_robot("iiwa14"), kin.get_robot("ur5")


def pose(q: np.ndarray) -> kin.motion.PoseTarget:
    T = kin.fk(UR5, q)
    return kin.motion.PoseTarget(tuple(T[:3, 3].tolist()), tuple(wxyz_from_rotation(T[:3, :3]).tolist()))


def line(robot: kin.Robot, q: np.ndarray, way: tuple[float, float, float], count: int) -> np.ndarray:
    T = np.broadcast_to(kin.fk(robot, q), (count, 4, 4)).copy()
    T[:, :3, 3] += np.linspace(0.0, 1.0, count)[:, None] * way
    return T


def test_a_path_keeps_clear_of_a_ball_at_the_elbow():
    q = IIWA.q_home + 0.2
    targets = line(IIWA, q, (0.0, 0.15, 0.0), 8)
    plain = kin.solve_path(IIWA, targets, q_start=q)
    assert plain.contacts == ()
    elbow = kin.link_frames(IIWA, plain.q[4])[3][:3, 3]
    ball = kin.Obstacle("sphere", elbow.tolist(), radius=0.04, name="ball")
    assert kin.clearance(IIWA, plain.q, [ball]).min() < 0.0
    found = kin.solve_path(IIWA, targets, q_start=q, obstacles=[ball], avoid_self_collision=True)
    assert not found.gaps
    assert kin.clearance(IIWA, found.q, [ball]).min() >= 0.0
    assert found.position_error.max() < 1e-9


def test_a_waypoint_at_which_every_posture_touches_is_a_gap():
    q = UR5.q_home
    targets = line(UR5, q, (0.1, 0.0, 0.0), 5)
    wall = kin.Obstacle("box", targets[2, :3, 3].tolist(), size=(0.02, 0.5, 0.5), name="wall")
    found = kin.solve_path(UR5, targets, q_start=q, obstacles=[wall])
    assert {gap.status for gap in found.gaps} == {"collision"}
    assert 2 in [gap.index for gap in found.gaps]
    assert "wall" in found.reason
    assert {touch.contact.name for touch in found.contacts} == {"wall"}


def test_a_touch_between_two_waypoints_is_reported():
    """Both ends are clear, the motion between them is not."""
    q = np.array([0.0, -1.2, 1.2, -1.5, -1.5, 0.0])
    other = q.copy()
    other[0] += 0.8
    middle = kin.fk(UR5, 0.5 * (q + other))[:3, 3]
    post = kin.Obstacle("cylinder", middle.tolist(), radius=0.01, height=0.2, name="post")
    assert kin.clearance(UR5, np.array([q, other]), [post]).min() > 0.0
    targets = kin.fk(UR5, np.array([q, other]))
    found = kin.solve_path(UR5, targets, q_start=q, obstacles=[post], max_step=2.0)
    assert [touch.waypoint for touch in found.contacts] == [1]
    assert 0.0 < found.contacts[0].share < 1.0
    assert "between waypoints 0 and 1 link" in found.reason


@pytest.mark.parametrize("kind", ["ptp", "lin"])
def test_a_program_is_refused_where_it_touches(kind):
    q = np.array([0.0, -1.2, 1.2, -1.5, -1.5, 0.0])
    other = q.copy()
    other[0] += 0.4
    target = kin.motion.JointTarget(tuple(other)) if kind == "ptp" else pose(other)
    program = [
        kin.motion.Ptp(kin.motion.JointTarget(tuple(q))),
        kin.motion.Ptp(target) if kind == "ptp" else kin.motion.Lin(target),
    ]
    plain = kin.plan_motion(UR5, program, q)
    middle = plain.sample(0.5 * plain.duration).T[:3, 3]
    post = kin.Obstacle("cylinder", middle.tolist(), radius=0.01, height=0.2, name="post")
    found = kin.plan_motion(UR5, program, q, obstacles=[post])
    assert found.refusal is not None
    assert (found.refusal.cause, found.refusal.segment) == ("collision", 1)
    assert "touches post after" in found.reason
    contact = kin.collision.nearest_contact(UR5, plain.sample(found.refusal.details.time).q, [post])
    assert contact.distance < 0.0
    assert contact.distance > -0.02  # the first touch, not a later one
    away = kin.Obstacle("sphere", (3.0, 0.0, 0.0), radius=0.1)
    assert kin.plan_motion(UR5, program, q, obstacles=[away], avoid_self_collision=True).planned
