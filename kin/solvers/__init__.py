"""The registry of closed-form solvers: one module, one row each, in order of preference.

A solver module offers ``NAME``, ``TITLE``, ``BRANCHES`` (names, one per row of its answers), ``match(robot)`` (its
geometry, or None if the arm is of another family), ``why(geometry)`` (a clause that says so), ``handles(geometry,
task)``, ``freedoms(geometry, task)`` (what the task leaves free), ``solve(geometry, problem) -> Candidates``,
``branch_of(geometry, q)`` (a row of `BRANCHES`) and ``singularities(geometry, q, within)``. It never verifies,
filters or sorts: :mod:`kin.ik` does that once for all.
Which family an arm belongs to is read off its axes, never off its name.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple, Protocol, cast

from kin.robot import Robot
from kin.solvers import collinear7, parallel6, scara4, slide6, srs7, wrist5, wrist6
from kin.solvers.common import Candidates, Freedom, Problem
from kin.solvers.singular import Singularity
from kin.transforms import Array


class Solver(Protocol):
    """What a solver module looks like from outside."""

    NAME: str
    TITLE: str
    BRANCHES: tuple[str, ...]

    def match(self, robot: Robot) -> Any: ...

    def why(self, geometry: Any) -> str: ...

    def handles(self, geometry: Any, task: int) -> bool: ...

    def solve(self, geometry: Any, problem: Problem) -> Candidates: ...

    def freedoms(self, geometry: Any, task: int) -> tuple[Freedom, ...]: ...

    def branch_of(self, geometry: Any, q: Array) -> int: ...

    def singularities(self, geometry: Any, q: Array, within: float = math.inf) -> tuple[Singularity, ...]: ...


class Match(NamedTuple):
    """A solver together with the geometry it found in a robot, and what it knows the arm by."""

    solver: Solver
    geometry: Any
    reason: str


SOLVERS: tuple[Solver, ...] = tuple(
    cast(Solver, module) for module in (wrist5, srs7, collinear7, wrist6, parallel6, slide6, scara4)
)


@lru_cache(maxsize=256)
def solver_for(robot: Robot) -> Match | None:
    """The first registered closed form that fits the robot's axes, None if there is none."""
    for solver in SOLVERS:
        geometry = solver.match(robot)
        if geometry is not None:
            return Match(solver, geometry, solver.why(geometry))
    return None
