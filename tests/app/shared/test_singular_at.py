"""Where an arm is singular of home and zero, as its row of the docs and the page say it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kin
from app.shared.answers.inspection import singular_at
from app.viewer.panel.status import introduction

UR5 = kin.get_robot("ur5")


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ("ur5", "At zero it is singular: elbow straight, axis 6 parallel to axes 2, 3 and 4."),
        ("planar2r", "At zero it is singular: the tool cannot move in some direction."),
        ("panda", ""),  # joint 4 cannot be at zero
        ("so100", ""),
    ],
)
def test_the_alignments_are_named_where_the_limits_allow_zero(robot, said):
    assert singular_at(kin.get_robot(robot)) == said


def test_a_singular_home_is_named_first():
    stretched = replace(UR5, home=(0.3, -1.2, 0.0, -0.7, 0.9, 0.2))
    assert singular_at(stretched).startswith("At home it is singular: elbow straight. At zero it is singular: ")


@pytest.mark.parametrize("robot", kin.builtin_robots().values(), ids=lambda robot: robot.id)
def test_what_is_said_is_so(robot):
    """By the rank of the Jacobian at zero and at random."""
    zero = np.zeros(robot.n)
    inside = bool(((zero >= robot.lower) & (zero <= robot.upper)).all())
    J = kin.jacobian(robot, np.stack([zero, *robot.random_q(np.random.default_rng(1), 8)]))
    rows = (
        slice(None) if robot.n > 5 else slice(3)
    )  # of fewer joints the point alone, which is enough to lose rank
    ranks = [int(np.linalg.matrix_rank(each[rows], tol=1e-6)) for each in J]
    if inside and ranks[0] < max(ranks[1:]):
        assert "At zero" in singular_at(robot)
    if not inside:
        assert "At zero" not in singular_at(robot)


def test_an_arm_that_is_opened_says_it():
    assert introduction(UR5).detail.endswith(singular_at(UR5))
    assert introduction(kin.get_robot("so100")).detail.endswith(".")
