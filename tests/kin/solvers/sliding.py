"""Arms with joints that slide, and a check that all their postures are found."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

import kin
from kin.robot import Robot

RIGHT = 0.5 * math.pi


def arm(kinds: str, numbers) -> Robot:
    """A standard table from rows (θ, d, a, α); P slides and R turns."""
    return Robot.from_dh(
        [
            {
                "kind": "prismatic" if kind == "P" else "revolute",
                "theta": theta,
                "d": d,
                "a": a,
                "alpha": alpha,
                **({"limits": (-1.0, 1.0)} if kind == "P" else {}),
            }
            for kind, (theta, d, a, alpha) in zip(kinds, numbers, strict=True)
        ]
    )


def random_arm(kinds: str, rng: np.random.Generator, right: bool = False) -> Robot:
    """A random table; with `right` all twists are right angles."""
    n = len(kinds)
    twists = rng.choice([RIGHT, -RIGHT], n) if right else rng.uniform(-2.8, 2.8, n)
    return arm(kinds, np.column_stack([rng.uniform(-3, 3, n), rng.uniform(-0.5, 0.5, (n, 2)), twists]))


def apart(robot: Robot, a, b) -> float:
    """Largest joint difference, whole turns aside."""
    off = np.asarray(a) - b
    return float(np.abs(np.where(robot.revolute, (off + math.pi) % (2.0 * math.pi) - math.pi, off)).max())


def check_postures(
    robot: Robot, rng: np.random.Generator, poses: int, descents: int, task: str = "pose"
) -> Counter[str]:
    """How many answers are complete in which way, after a check of each at random targets.

    The generating configuration is there, each solution meets the target by forward kinematics, and descents from
    random starts find no other. Only an answer that does not claim to be complete may miss one.
    """
    known: Counter[str] = Counter()
    for q in robot.random_q(rng, poses):
        T = kin.fk(robot, q)
        result = kin.solve_ik(robot, T, task=task, respect_limits=False)
        known[result.completeness] += 1
        for solution in result.solutions:
            off = kin.fk(robot, solution.q) - T
            met = {"pose": off, "approach": off[:, 2:], "position": off[:, 3:]}[task]
            assert np.abs(met).max() < 1e-8
        if not result.complete:
            continue
        others = [
            other.q
            for seed in robot.random_q(rng, descents)
            for other in kin.solve_ik(
                robot, T, task=task, solver="numeric", q_seed=seed, respect_limits=False
            ).solutions
        ]
        for wanted in [q, *others]:
            assert min(apart(robot, s.q, wanted) for s in result.solutions) < 1e-5
    return known
