"""Inverse kinematics that leaves out what touches, on the arm itself and on obstacles."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from kin.collision.contacts import surroundings
from kin.ik.details import Solved, Touching

UR5, IIWA, PIONEER = (kin.get_robot(name) for name in ("ur5", "iiwa14", "pioneer5"))


def ball_at(robot: kin.Robot, q: np.ndarray, radius: float) -> kin.Obstacle:
    """An obstacle around the middle of the moving capsule that is farthest out, but for the hand."""
    frames = kin.link_frames(robot, q)
    elbow = frames[robot.joint_rows[robot.n // 2]][:3, 3]
    return kin.Obstacle("sphere", elbow.tolist(), radius=radius, name="ball")


def targets(robot: kin.Robot, count: int) -> list[np.ndarray]:
    return [kin.fk(robot, q) for q in robot.random_q(np.random.default_rng(3), count)]


@pytest.mark.parametrize("robot", [UR5, kin.get_robot("puma560"), kin.get_robot("irb120")], ids=lambda r: r.id)
def test_solutions_are_those_that_do_not_touch(robot):
    """Every branch inside the limits is a solution if and only if it is clear."""
    dropped = 0
    for T in targets(robot, 40):
        every = kin.solve_ik(robot, T).solutions
        found = kin.solve_ik(robot, T, avoid_self_collision=True)
        clear = [s for s in every if kin.clearance(robot, s.q) >= 0.0]
        dropped += len(every) - len(clear)
        assert [s.branch for s in found.solutions] == [s.branch for s in clear]
        if not clear:
            assert found.status == "collision"
            assert found.cause == "self-collision"
            contacts = [surroundings(robot).touches(s.q) for s in every]
            fewest, depth = min((len(each), -each[0].distance) for each in contacts)
            assert isinstance(found.details, Touching)
            assert found.details.contacts == fewest
            assert found.details.contact.distance == pytest.approx(-depth, abs=1e-9)
            assert found.details.searched == ()
            assert "search" not in found.reason
            assert found.closest is not None
            assert found.closest.position_error < 1e-9
            assert found.details.contact.text in found.reason
        elif len(clear) < len(every):
            assert isinstance(found.details, Solved)
            assert found.details.touching == len(every) - len(clear)
            assert "collide" in found.reason
    assert dropped > 0


def test_a_redundant_arm_moves_its_elbow_out_of_the_way():
    """The arm angle is searched: a ball at the elbow is passed with the hand held still."""
    q = IIWA.q_home + 0.2
    T = kin.fk(IIWA, q)
    ball = ball_at(IIWA, q, 0.05)
    assert kin.clearance(IIWA, q, [ball]) < 0.0
    found = kin.solve_ik(IIWA, T, q_seed=q, obstacles=[ball], avoid_self_collision=True)
    assert found.status == "solved"
    for solution in found.solutions:
        assert kin.clearance(IIWA, solution.q, [ball]) >= 0.0
        assert solution.position_error < 1e-9
    best = found.solutions[0]
    free = [
        s.distance
        for psi in np.linspace(-math.pi, math.pi, 361)
        for s in kin.solve_ik(IIWA, T, q_seed=q, redundancy=float(psi)).solutions
        if kin.clearance(IIWA, s.q, [ball]) >= 0.0
    ]
    assert best.distance <= min(free) + 0.03


def test_an_obstacle_that_encloses_the_target_leaves_nothing():
    T = kin.fk(UR5, UR5.q_home)
    box = kin.Obstacle("box", T[:3, 3].tolist(), size=(0.3, 0.3, 0.3), name="crate")
    found = kin.solve_ik(UR5, T, obstacles=[box])
    assert (found.status, found.cause) == ("collision", "obstacle")
    assert "crate" in found.reason
    assert not found.solutions


def test_a_freedom_is_named_only_if_it_was_searched():
    """A wall around the target leaves no posture, whatever the arm angle is; a locked or requested one stays."""
    T = kin.fk(IIWA, IIWA.q_home)
    box = [kin.Obstacle("box", T[:3, 3].tolist(), size=(0.3, 0.3, 0.3), name="crate")]
    found = kin.solve_ik(IIWA, T, obstacles=box)
    assert isinstance(found.details, Touching)
    assert found.details.searched == ("arm angle ψ",)
    assert found.completeness == "unknown"
    psi = kin.solve_ik(IIWA, T).redundancy[0].value
    for fixed in ({"redundancy": psi}, {"locked": [None, None, float(IIWA.q_home[2]), *[None] * 4]}):
        given = kin.solve_ik(IIWA, T, obstacles=box, **fixed)
        assert isinstance(given.details, Touching)
        assert given.details.searched == ()
        assert "search" not in given.reason


def test_the_posture_with_the_fewest_contacts_is_shown():
    """Where axes cross, the depth is the sum of two radii in one posture as in another; the contacts differ."""
    wall = kin.Obstacle("box", [0.0, 0.0, 0.45], size=(3.0, 3.0, 0.6), name="slab")
    counts = []
    for T in targets(UR5, 30):
        every = kin.solve_ik(UR5, T).solutions
        found = kin.solve_ik(UR5, T, obstacles=[wall])
        if found.status != "collision":
            continue
        near = surroundings(UR5, (wall,), False)
        contacts = [len(near.touches(s.q)) for s in every]
        assert found.closest is not None
        assert len(near.touches(found.closest.q)) == min(contacts)
        counts.append(max(contacts) - min(contacts))
        if min(contacts) > 1:
            assert f"the deepest of {min(contacts)} contacts" in found.reason
    assert max(counts) > 0


def test_arms_with_few_joints_leave_out_what_touches_too():
    q = PIONEER.q_home
    T = kin.fk(PIONEER, q)
    T[:3, :3] = T[:3, :3] @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    plain = kin.solve_ik(PIONEER, T)
    assert plain.status == "approximate"
    ball = ball_at(PIONEER, plain.solutions[0].q, 0.02)
    found = kin.solve_ik(PIONEER, T, obstacles=[ball])
    for solution in found.solutions:
        assert kin.clearance(PIONEER, solution.q, [ball]) >= 0.0
    assert len(found.solutions) < len(plain.solutions)


SAWYER = kin.get_robot("sawyer")


def beside_a_ball() -> tuple[np.ndarray, np.ndarray, list[kin.Obstacle]]:
    """A configuration, its pose, and an obstacle that all postures at its value of joint 7 touch."""
    q = SAWYER.random_q(np.random.default_rng(20))
    T, ball = kin.fk(SAWYER, q), ball_at(SAWYER, q, 0.15)
    assert all(kin.clearance(SAWYER, s.q, [ball]) < 0.0 for s in kin.solve_ik(SAWYER, T, q_seed=q).solutions)
    return q, T, [ball]


def test_postures_at_another_value_have_the_intervals_of_that_value_and_are_searched():
    q, T, balls = beside_a_ball()
    assert kin.solve_ik(SAWYER, T, q_seed=q).completeness == "agreed"
    found = kin.solve_ik(SAWYER, T, q_seed=q, obstacles=balls)
    assert (found.status, found.completeness) == ("solved", "searched")
    for solution in found.solutions:
        (parameter,) = solution.redundancy
        assert parameter.value == solution.q[6]
        assert any(low <= parameter.value <= high for low, high in parameter.intervals)


def test_a_requested_roll_is_kept_and_joint_7_is_searched():
    q, T, balls = beside_a_ball()
    found = kin.solve_ik(SAWYER, T, task="approach", q_seed=q, redundancy={"roll": 0.0}, obstacles=balls)
    assert found.status == "solved"
    for solution in found.solutions:
        assert kin.clearance(SAWYER, solution.q, balls) >= 0.0
        assert solution.redundancy[0].value == pytest.approx(0.0, abs=1e-9)


def test_a_numeric_arm_finds_another_posture():
    arm = kin.Robot.from_dh([(0.0, 0.3, 0.02 * i, 0.7 * (-1) ** i) for i in range(6)])
    q = np.full(6, 0.6)
    T = kin.fk(arm, q)
    plain = kin.solve_ik(arm, T, solver="numeric", q_seed=q)
    assert plain.status == "solved"
    ball = ball_at(arm, plain.solutions[0].q, 0.05)
    found = kin.solve_ik(arm, T, solver="numeric", q_seed=q, obstacles=[ball])
    assert found.status in ("solved", "collision")
    for solution in found.solutions:
        assert kin.clearance(arm, solution.q, [ball]) >= 0.0


def test_the_most_solutions_are_counted_after_those_that_touch():
    for T in targets(UR5, 20):
        found = kin.solve_ik(UR5, T, avoid_self_collision=True)
        one = kin.solve_ik(UR5, T, avoid_self_collision=True, max_solutions=1)
        assert one.status == found.status
        assert one.q.tolist() == [s.q.tolist() for s in found.solutions[:1]]


def test_many_targets_take_the_options_too():
    stack = np.array(targets(UR5, 12))
    found = kin.solve_ik_many(UR5, stack, avoid_self_collision=True)
    for T, result in zip(stack, found, strict=True):
        one = kin.solve_ik(UR5, T, avoid_self_collision=True)
        assert result.q.tolist() == one.q.tolist()


@pytest.mark.parametrize(
    ("obstacles", "field"),
    [
        ("box", "obstacles"),
        ([{"shape": "cone"}], "obstacles[0].shape"),
        ([{"shape": "sphere", "radius": 0.1}, {"shape": "box"}], "obstacles[1].size"),
        ([{"shape": "sphere", "radius": -1.0}], "obstacles[0].radius"),
        ([{"shape": "box", "size": [1, 1, math.nan]}], "obstacles[0].size[2]"),
        ([{"shape": "cylinder", "radius": 0.1, "height": 0.1, "size": [1, 1, 1]}], "obstacles[0].size"),
        ([{"shape": "sphere", "radius": 0.1, "colour": "red"}], "obstacles[0].colour"),
        ([3], "obstacles[0]"),
        ([{"shape": "sphere", "radius": 0.1}] * 33, "obstacles"),
    ],
)
def test_malformed_obstacles_are_named(obstacles, field):
    with pytest.raises(kin.InputError) as caught:
        kin.solve_ik(UR5, np.eye(4), obstacles=obstacles)
    assert caught.value.field == field
