"""The example of the steps: a target far from singularities, and a start near it, clear of floor and base."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from app.viewer.lessons.numeric import iteration
from app.viewer.lessons.numeric.iteration import Match, Problem, Run, Settings
from app.viewer.scene.clearance import clearance
from kin import Robot, fk
from kin.transforms import Array

_SAMPLES, _OFFSETS = 64, (0.3, 0.15, 0.075, 0.03)
_SLIDE = 0.4  # of an offset, for prismatic joints


class Example(NamedTuple):
    """A target far from singularities, and a start near it from which Newton converges."""

    problem: Problem
    start: Array
    newton: Run


def usual_match(robot: Robot) -> Match:
    """What a target asks of this arm: the whole pose needs six joints."""
    return "pose" if robot.n >= 6 else "point"


@lru_cache(maxsize=64)
def example(robot: Robot) -> Example:
    """The example of the steps for this arm."""
    rng = np.random.default_rng(7)
    q = robot.q_home + 0.6 * (robot.random_q(rng, _SAMPLES) - robot.q_home)
    match = usual_match(robot)
    probe = Problem(robot, fk(robot, robot.q_home), match)
    smallest = np.linalg.svd(probe.jacobian(q), compute_uv=False)[:, -1]
    best, space = q[np.argsort(-smallest, kind="stable")], clearance(robot, skeleton=True)
    for aim in best:
        found = _near(robot, aim, match)
        ends = found.start, found.newton.q[-1]
        if found.newton.outcome == "reached" and all(space.at(end) is None for end in ends):
            return found
    return _near(robot, best[0], match)


def _near(robot: Robot, aim: Array, match: Match) -> Example:
    """The example whose target is the tool's pose at `aim` ``(n,)``."""
    problem = Problem(robot, fk(robot, aim), match)
    pattern = np.where(np.arange(robot.n) % 2, -1.0, 1.0) * np.where(robot.revolute, 1.0, _SLIDE) * problem.travel
    for offset in _OFFSETS:
        start = np.clip(aim + offset * pattern, robot.lower, robot.upper)
        found = iteration.run(problem, Settings("newton"), start)
        if found.outcome == "reached":
            break
    return Example(problem, start, found)
