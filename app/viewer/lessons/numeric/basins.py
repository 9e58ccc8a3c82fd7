"""Basins of attraction of a planar arm with two joints: which solution each start leads to, as a picture.

The starts are a grid over θ₁ and θ₂. They are iterated together, in blocks that take some milliseconds each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.viewer.lessons.numeric.iteration import STILL, Problem, Settings, advance
from kin import Robot, solve_ik
from kin.angles import apart
from kin.transforms import Array

CELLS = 96  # along each side
MOST = 80  # iterations
BLOCK = 1024  # starts that are iterated together
CLOSE = 2e-3  # error at which a start counts as arrived
SAME = 0.1  # rad between it and a solution then
# The colours of no solution, and of the first and the second one; darker where it takes more iterations.
COLOURS = np.array([(120, 124, 130), (60, 150, 220), (236, 140, 40)], dtype=np.float64)
_DARKEST = 0.45


@dataclass(frozen=True, eq=False)
class Basins:
    """What became of each start.

    Attributes:
        q1, q2: the starts, in radians ``(CELLS,)``.
        reached: 0 for none, else the number of the solution, by θ₂ and θ₁ ``(CELLS, CELLS)``.
        iterations: how many it took ``(CELLS, CELLS)``.
        solutions: all solutions ``(k, 2)``, θ₂ rising.
    """

    q1: Array
    q2: Array
    reached: NDArray[np.int64]
    iterations: NDArray[np.int64]
    solutions: Array

    def share(self, solution: int) -> float:
        """The share of the starts that lead to a solution; 0 for none."""
        return float((self.reached == solution).mean())


def exact(problem: Problem) -> Array:
    """All solutions of `kin` ``(k, n)``, θ₂ rising; empty if the target is out of reach."""
    whole = problem.match == "pose"
    result = solve_ik(
        problem.robot, problem.T if whole else problem.T[:3, 3], task="pose" if whole else "position"
    )
    if result.status != "solved":
        return np.empty((0, problem.robot.n))
    found = result.q
    order = np.argsort(found[:, -1], kind="stable")
    return np.asarray(found[order])


def turned_within(robot: Robot, q: Array) -> Array:
    """A configuration ``(n,)`` with each revolute joint turned by whole turns to the middle of its limits."""
    turn = 2.0 * math.pi
    bounded = robot.revolute & np.isfinite(robot.lower) & np.isfinite(robot.upper)
    middle = 0.5 * (np.where(bounded, robot.lower, 0.0) + np.where(bounded, robot.upper, 0.0))
    return np.where(bounded, q - turn * np.round((q - middle) / turn), q)


def within(robot: Robot, q: Array) -> Array | None:
    """The same if it is within the limits then, else None."""
    found = turned_within(robot, q)
    low, high = robot.lower - 1e-9, robot.upper + 1e-9
    return np.clip(found, robot.lower, robot.upper) if ((low <= found) & (found <= high)).all() else None


def search(problem: Problem, settings: Settings, cells: int = CELLS) -> Iterator[Basins | None]:
    """The basins of an arm with two joints. Yields None after each block of work, and the answer at the end."""
    robot = problem.robot
    solutions = exact(problem)
    q1, q2 = _centres(robot, 0, cells), _centres(robot, 1, cells)
    starts = np.stack(np.meshgrid(q1, q2), axis=-1).reshape(-1, 2)
    reached, iterations = np.zeros(len(starts), dtype=np.int64), np.zeros(len(starts), dtype=np.int64)
    for first in range(0, len(starts), BLOCK):
        members = np.arange(first, min(first + BLOCK, len(starts)))
        q = starts[members]
        error = problem.error(q)
        for k in range(MOST + 1):
            done = np.linalg.norm(error, axis=1) < CLOSE
            if done.any() and len(solutions):
                near = apart(q[done][:, None], solutions, robot.revolute)
                which = np.argmin(near, axis=1)
                reached[members[done]] = np.where(near.min(axis=1) < SAME, which + 1, 0)
            iterations[members[done]] = k
            members, q, error = members[~done], q[~done], error[~done]
            if not len(members) or k == MOST:
                break
            made = advance(problem, settings, q, error)
            going = ~made.singular & (made.step >= STILL * np.linalg.norm(error, axis=1))
            members, q, error = members[going], made.q[going], made.error[going]
            yield None
    shape = (cells, cells)
    yield Basins(q1, q2, reached.reshape(shape), iterations.reshape(shape), solutions)


def _centres(robot: Robot, joint: int, cells: int) -> Array:
    """The centres of equal cells over a joint's limits, of one turn at most."""
    low, high = max(float(robot.lower[joint]), -math.pi), min(float(robot.upper[joint]), math.pi)
    return low + (high - low) * (np.arange(cells) + 0.5) / cells


def pixels(basins: Basins) -> NDArray[np.uint8]:
    """The picture ``(CELLS, CELLS, 4)``, θ₁ to the right and θ₂ upwards."""
    dark = np.where(basins.reached > 0, np.minimum(1.0, np.log1p(basins.iterations) / math.log1p(MOST)), 0.0)
    colours = COLOURS[np.minimum(basins.reached, 2)] * (1.0 - (1.0 - _DARKEST) * dark[..., None])
    rgba = np.full((*basins.reached.shape, 4), 255, dtype=np.uint8)
    rgba[..., :3] = np.round(colours)
    return rgba[::-1]
