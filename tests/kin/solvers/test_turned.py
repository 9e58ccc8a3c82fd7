"""Arms whose last joint turns the tool about its point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from few import PI, arm
from few import TURNED3 as OBLIQUE

import kin
from kin import Status
from kin.solvers import closed_form_of

TASKS = ("pose", "approach", "position")


def moved(a, b, robot):
    """Largest joint difference, whole turns aside."""
    return np.where(robot.revolute, np.abs((a - b + PI) % (2 * PI) - PI), np.abs(a - b)).max(axis=-1)


def slides(robot, *joints):
    """The same table with some joints that slide."""
    rows = (
        replace(r, kind="prismatic", limits=(-0.4, 0.4)) if i in joints else r for i, r in enumerate(robot.rows)
    )
    return replace(robot, id=f"{robot.id}-{joints}", rows=tuple(rows))


ROLL = arm("roll3", (0, 0.3, 0.1, PI / 2), (0, 0, 0.4, PI / 2), (0, 0.2, 0, 0))
ELBOW = arm("elbow-turn3", (0, 0.1, 0.4, 0), (0, 0, 0.3, PI / 2), (0, 0, 0, 0.5))
# A camera that pans, tilts and rolls about its own point.
CAMERA = arm("camera3", (0, 0.2, 0, PI / 2), (PI / 2, 0, 0, PI / 2), (0, 0, 0, 0))
THREE = (OBLIQUE, ROLL, ELBOW, CAMERA, slides(OBLIQUE, 0), slides(OBLIQUE, 1), slides(ROLL, 0, 1))
FOUR = (
    arm("four", (0.3, 0.2, 0.3, 1.1), (-0.4, 0.1, 0.25, 0.7), (0.5, 0.1, 0.2, -0.9), (0.2, 0.15, 0, 0.4)),
    arm("four-roll", (0.3, 0.2, 0.3, 1.1), (-0.4, 0.1, 0.25, 0.7), (0.5, 0.1, 0.2, -0.9), (0.2, 0.15, 0, 0)),
    arm("four-pitch", (0, 0.2, 0.05, PI / 2), (0, 0, 0.3, 0), (0, 0, 0.2, 0), (0, 0.1, 0, 0)),
)
any_arm = pytest.mark.parametrize("robot", [*THREE, *FOUR], ids=lambda robot: robot.id)


@any_arm
def test_every_task_has_a_closed_form(robot):
    form = closed_form_of(robot)
    assert form.name == {3: "turned3", 4: "parallel5" if robot.id == "four-pitch" else "general5"}[robot.n]
    for q in robot.random_q(np.random.default_rng(1), 8):
        T = kin.fk(robot, q)
        for task in TASKS if robot is not CAMERA else ("pose",):
            result = kin.solve_ik(robot, T[:3, 3] if task == "position" else T, task=task, q_seed=q)
            assert (result.status, result.complete) == (Status.SOLVED, True)
            assert min(moved(s.q, q, robot) for s in result.solutions) < 1e-6
            assert all(max(s.position_error, s.rotation_error) < 1e-9 for s in result.solutions)
        rows = kin.ik_branches(robot, T)
        assert np.nan_to_num(moved(rows, q, robot), nan=9.0).min() < 1e-6


@any_arm
def test_a_point_leaves_the_last_joint_free(robot):
    if robot is CAMERA or robot.id == "four-pitch":  # its point does not move at all; its parameter is the pitch
        return
    name = f"theta{robot.n}"
    for q in robot.random_q(np.random.default_rng(2), 4):
        found = kin.solve_ik(robot, kin.fk(robot, q)[:3, 3], task="position", redundancy={name: 0.7})
        assert found.best.q[-1] == 0.7
        (last,) = (r for r in found.redundancy if r.name == name)
        assert last.intervals == ((-PI, PI),)
    far = kin.solve_ik(robot, (9.0, 0.0, 0.0), task="position")
    assert far.status is Status.UNREACHABLE


def test_orientations_that_three_joints_do_not_reach_keep_the_point():
    for robot in (OBLIQUE, ELBOW):
        for q in robot.random_q(np.random.default_rng(3), 4):
            T = kin.fk(robot, q) @ kin.from_xyz_rpy([0, 0, 0], [0.2, 0.1, 0.3])
            result = kin.solve_ik(robot, T)
            assert result.status is Status.APPROXIMATE
            assert result.solutions[0].position_error < 1e-9


def test_limits_and_names():
    assert set(kin.branch_names(ELBOW)) == {"elbow positive", "elbow negative"}
    assert kin.branch_names(OBLIQUE) == ()
    for q in ELBOW.random_q(np.random.default_rng(4), 5):
        T = kin.fk(ELBOW, q)
        assert kin.branch_of(ELBOW, q) == ("elbow positive" if q[1] > 0 else "elbow negative")
        tight = kin.solve_ik(ELBOW, T, limits=[None, None, (-3.0, -2.9)])
        assert tight.status is (Status.SOLVED if -3.0 <= q[2] <= -2.9 else Status.LIMITS)


def test_a_rounded_table_and_reversed_joints():
    typed = replace(ROLL, rows=(replace(ROLL.rows[0], alpha=1.5708), *ROLL.rows[1:]))
    for q in ROLL.random_q(np.random.default_rng(5), 5):
        result = kin.solve_ik(typed, kin.fk(typed, q))
        assert result.status is Status.SOLVED
        assert min(moved(s.q, q, ROLL) for s in result.solutions) < 1e-6
    assert closed_form_of(typed).name == "turned3"


def test_joints_that_do_the_same_are_left_to_descents():
    """Two joints about one line: infinitely many configurations for every pose."""
    twice = arm("twice", (0, 0.2, 0.3, PI / 2), (0, 0.1, 0, 0), (0, 0.1, 0, 0.4))
    assert closed_form_of(twice) is None
    result = kin.solve_ik(twice, kin.fk(twice, (0.3, 0.4, 0.5)))
    assert (result.status, result.complete) == (Status.SOLVED, False)
