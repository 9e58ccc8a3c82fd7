"""The registry of closed-form solvers: one module, one row each, in order of preference.

A solver module offers ``NAME``, ``TITLE``, ``BRANCHES`` (names, one per row of its answers), ``match(robot)`` (its
geometry, or None if the arm is of another family), ``why(geometry)`` (a clause that says so), ``handles(geometry,
task)``, ``freedoms(geometry, task)`` (what the task leaves free), ``solve(geometry, problem) -> Candidates``,
``branch_of(geometry, q)`` (a row of `BRANCHES`) and ``singularities(geometry, q, within)``. It never verifies,
filters or sorts: :mod:`kin.ik` does that once for all.
Which family an arm belongs to is read off its axes, never off its name, and neither the convention of its table
nor which way its joints count keeps it out (:mod:`kin.solvers.mirrored`).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple, Protocol, cast

from kin.robot import Robot
from kin.solvers import collinear7, parallel6, scara4, slide6, srs7, wrist5, wrist6
from kin.solvers.common import APPROACH, Candidates, Freedom, Problem
from kin.solvers.mirrored import Mirrored, readings
from kin.solvers.singular import Singularity
from kin.transforms import Array


class Solver(Protocol):
    """What the solver of an arm looks like from outside."""

    NAME: str
    TITLE: str
    BRANCHES: tuple[str, ...]

    def why(self, geometry: Any) -> str: ...

    def handles(self, geometry: Any, task: int) -> bool: ...

    def solve(self, geometry: Any, problem: Problem) -> Candidates: ...

    def freedoms(self, geometry: Any, task: int) -> tuple[Freedom, ...]: ...

    def branch_of(self, geometry: Any, q: Array) -> int: ...

    def singularities(self, geometry: Any, q: Array, within: float = math.inf) -> tuple[Singularity, ...]: ...


class Family(Solver, Protocol):
    """What a solver module looks like."""

    def match(self, robot: Robot) -> Any: ...


class Match(NamedTuple):
    """A solver together with the geometry it found in a robot, and what it knows the arm by."""

    solver: Solver
    geometry: Any
    reason: str


SOLVERS: tuple[Family, ...] = tuple(
    cast(Family, module) for module in (wrist5, srs7, collinear7, wrist6, parallel6, slide6, scara4)
)


@lru_cache(maxsize=256)
def solver_for(robot: Robot) -> Match | None:
    """The first registered closed form that fits the robot's axes, None if there is none.

    Where none fits the robot as it counts, or one that then has to do without approach directions, it is tried
    with joints counting the other way round.
    """
    found = _first_of(robot)
    if found is not None and found.solver.handles(found.geometry, APPROACH):
        return found
    known: list[tuple[tuple[int, ...], Match]] = [] if found is None else [((), found)]
    for joints, read in readings(robot):
        # What a family has to do without, only a last axis turned to where the tool looks brings back.
        match = _first_of(read) if found is None or robot.n - 1 in joints else None
        if match is not None:
            known.append((joints, match))
    if not known:
        return None
    joints, (family, geometry, reason) = min(known, key=_burden)
    if not joints:
        return Match(family, geometry, reason)
    solver = Mirrored(family, geometry, joints, robot.n)
    return Match(solver, geometry, solver.why(geometry))


def _first_of(robot: Robot) -> Match | None:
    """The first registered closed form that fits the robot as it counts."""
    for family in SOLVERS:
        geometry = family.match(robot)
        if geometry is not None:
            return Match(family, geometry, family.why(geometry))
    return None


def _burden(reading: tuple[tuple[int, ...], Match]) -> tuple[bool, int, int]:
    """What speaks against a reading: a task lost, joints turned round, lengths that are negative."""
    joints, (solver, geometry, _) = reading
    negative = sum(isinstance(part, float) and part < 0.0 for part in geometry)
    return not solver.handles(geometry, APPROACH), len(joints), negative
