"""Paths close to singularities: where a continuous continuation exists, the branch does not change."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from kin import Joint, Robot
from kin.ik import IKOptions
from kin.path import solve

PI = math.pi


def arm(name, *rows):
    joints = tuple(Joint(f"joint {i + 1}", *row, limits=(-2 * PI, 2 * PI)) for i, row in enumerate(rows))
    return Robot(name, name, "test", "standard", joints, (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)[: len(rows)])


def upright(name, offset=0.0):
    """Like Doosan's M1013: an offset shoulder, and a spherical wrist unless it has an offset too."""
    return arm(
        name,
        (0, 0.1525, 0, -PI / 2),
        (-PI / 2, 0.0345, 0.62, 0),
        (PI / 2, 0, 0, PI / 2),
        (0, 0.559, 0, -PI / 2),
        (0, 0, offset, PI / 2),
        (0, 0.121, 0, 0),
    )


M1013, OFFSET = upright("m1013-like"), upright("offset-wrist", 0.05)
ELBOW5 = arm(
    "offset-elbow5",
    (0, 0.3, 0.05, -PI / 2),
    (0, 0.1, 0.4, 0),
    (0, 0, 0.02, -PI / 2),
    (0, 0.4, 0, PI / 2),
    (0, 0, 0, -PI / 2),
)


def smallest(robot, q):
    """The smallest singular value of the Jacobian of what the arm can control."""
    J, R = kin.jacobian(robot, q), kin.fk(robot, q)[:3, :2]
    return np.linalg.svd(J if robot.n == 6 else np.vstack([J[:3], R.T @ J[3:]]), compute_uv=False)[robot.n - 1]


def near_singular(robot, rng, sigma):
    """A configuration whose smallest singular value is about `sigma`, by turning one joint."""
    q = 0.4 * robot.random_q(rng)
    joint = int(rng.choice([2, 4])) if robot.n == 6 else 2

    def at(x):
        there = q.copy()
        there[joint] = x
        return there

    low, high, count = -2.5, 2.5, 600
    while high - low > 1e-12:
        xs = np.linspace(low, high, count)
        best = int(np.argmin([smallest(robot, at(x)) for x in xs]))
        low, high, count = xs[max(best - 1, 0)], xs[min(best + 1, count - 1)], 5
    off = 1e-9
    while smallest(robot, at(low + off)) < sigma and off < 1.0:
        off *= 1.5
    return at(low + off)


def jumps(robot, motion, solver, steps, started=True):
    """The jumps and gaps of a path of targets that a motion of at most 0.48 rad per step meets."""
    middle, a, b = (np.array(part) for part in motion)
    t = np.linspace(-1.0, 1.0, steps + 1)[:, None]
    q = middle + 0.5 * a * t + 0.3 * b * t * t
    assert np.abs(np.diff(q, axis=0)).max() < 0.48
    options = IKOptions(task="pose" if robot.n == 6 else "approach", solver=solver)
    found = solve(robot, list(kin.fk(robot, q)), options, q[0] if started else None)
    return [*found.jumps, *found.gaps]


# Middle, velocity and acceleration of motions of the five joints through a singularity, or 7e-6 beside it.
MOTIONS = (
    (
        (0.09405938823967465, 0.45672029716639223, 1.6210423491057049, -1.3051837170950105, 0.12648880105730123),
        (-0.741513, -0.524291, 0.608836, 0.124012, 0.872933),
        (0.732893, -0.603906, -0.744342, 1.161589, 0.407993),
    ),
    (
        (-0.7172569967437976, 0.44359200718631997, 1.6207547235168556, -1.154216671781483, 1.318456689057138),
        (-0.395892, -0.226144, -0.344554, 0.419649, -0.02653),
        (0.870987, 0.652477, -1.000754, -0.083976, 0.707853),
    ),
    (
        (-1.2450207020021633, -0.45743767086365356, 1.6207547235168556, 1.4459265859787096, -1.2655246072814665),
        (0.614595, -0.693718, -1.19845, 0.018641, 0.029595),
        (0.523094, -0.104929, -0.633617, -1.164023, 1.280953),
    ),
    (
        (-1.1963554420771634, -0.2520449912185277, 1.6207547235168556, 0.3505726410433676, -0.37401944270807197),
        (-0.047857, 1.312067, 0.233542, 0.598379, 0.680119),
        (-0.436153, -1.46465, 0.71146, 0.218457, 1.146947),
    ),
)


@pytest.mark.parametrize("motion", MOTIONS)
def test_five_joints_by_descents(motion):
    for steps in (6, 8):
        for started in (True, False):
            assert not jumps(ELBOW5, motion, "numeric", steps, started)


@pytest.mark.parametrize("solver", ["auto", "numeric"])
@pytest.mark.parametrize("robot", [M1013, OFFSET], ids=lambda robot: robot.id)
def test_a_wrist_that_is_almost_singular(robot, solver):
    middle = (0.3, -0.4, 0.7, 0.5, 5.6e-6, -0.6)
    motion = (middle, (0.5, -0.3, 0.4, 0.9, 0.7, -0.8), (0.2, 0.3, -0.1, 0.4, 0.3, 0.5))
    assert not jumps(robot, motion, solver, 8)


def test_a_wrist_that_is_singular_at_a_waypoint():
    """The path comes to that waypoint with a split of joints 4 and 6 that is far from the seed's."""
    rng = np.random.default_rng(11)
    middle = 0.4 * M1013.random_q(rng)
    middle[4] = 0.0
    assert not jumps(M1013, (middle, *rng.uniform(-1.2, 1.2, (2, 6))), "auto", 40, started=False)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["auto", "numeric"])
@pytest.mark.parametrize("robot", [M1013, OFFSET, ELBOW5], ids=lambda robot: robot.id)
def test_many_paths(robot, solver):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        for sigma in (0.0, 5.6e-6):
            motion = (near_singular(robot, rng, sigma), *rng.uniform(-1.2, 1.2, (2, robot.n)))
            for steps in (7, 40):
                assert not jumps(robot, motion, solver, steps, seed % 2 == 0), (seed, sigma, steps)
