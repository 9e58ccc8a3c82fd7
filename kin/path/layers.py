"""Layers: for each waypoint the configurations to choose from.

With a closed form: its branches at samples of the redundancy parameter over the feasible arcs. The ends and
middles of the arcs are among them, so that the narrowest arc has a sample, and a grid that is the same for every
waypoint, so that a value can be kept. Each comes at all whole-turn images inside the limits.

Without one: numeric continuation. Descents from many configurations at one end of the path are followed to the
other end, and back. Two redundancy parameters are first treated in this way too; a grid of both is large, and only
tried if jumps remain.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kin.angles import wrap
from kin.ik.answers import answer
from kin.ik.branches import Branches
from kin.ik.problem import IKProblem
from kin.ik.results import Status
from kin.path.configurations import branches_near, descended, distinct, meeting, pool, with_images
from kin.path.waypoints import Waypoint, is_sampled
from kin.solvers.contract import APPROACH, POSE, SolverInput
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_MOST_NODES = 4000  # configurations in a layer


def layered(problems: list[IKProblem], grid: float) -> list[Waypoint]:
    """The waypoints with their layers; `grid`: radians between samples of a redundancy parameter."""
    if is_sampled(problems[0]):
        return [_sampled_waypoint(requested, grid) for requested in problems]
    return _continued_waypoints(problems)


def _by_answer(requested: IKProblem) -> Waypoint:
    """A waypoint whose layer stays empty, as `kin.solve_ik` answers it."""
    result = answer(requested)
    requested = replace(requested, target_error=result.target_error)
    q = result.q
    if result.status is not Status.SOLVED:
        return Waypoint(requested, requested, q[:0], result)
    return Waypoint(requested, requested, with_images(requested, q))


# -- with a closed form -------------------------------------------------------------------------------------------


def _sampled_waypoint(requested: IKProblem, grid: float) -> Waypoint:
    waypoint = Waypoint(requested, requested, sampled(requested, False, grid))
    rounded = None if len(waypoint.layer) else requested.as_rounded()
    if rounded is not None:
        close = Waypoint(rounded, rounded, sampled(rounded, False, grid))
        waypoint = close if len(close.layer) else waypoint
    if not len(waypoint.layer) and requested.robot.n < 6 and requested.code == POSE:
        assert requested.closed_form is not None  # as for every sampled waypoint
        redundancies = requested.closed_form.redundancies(APPROACH)
        values = (math.nan,) * len(redundancies)
        problem = replace(requested, code=APPROACH, task="approach", redundancies=redundancies, values=values)
        waypoint = Waypoint(requested, problem, sampled(problem, True, grid))
    return waypoint if len(waypoint.layer) else _by_answer(requested)


def sampled(problem: IKProblem, relaxed: bool, grid: float) -> Array:
    """The layer ``(m, n)`` of a waypoint from its closed form, thinned if it would be too large."""
    found = branches_near(problem, problem.seed)
    samples = _samples(problem, found, grid)
    while True:
        q = np.concatenate([found.q, *(_at(problem, values) for values in samples)])
        layer = with_images(problem, meeting(problem, relaxed, q, problem.seed))
        if len(layer) <= _MOST_NODES or len(samples) == 1:
            return layer[:_MOST_NODES]
        samples = samples[:: math.ceil(len(layer) / _MOST_NODES)]


def _samples(problem: IKProblem, found: Branches, grid: float) -> list[tuple[float, ...]]:
    """Values of the redundancy parameters that the arcs allow; of two parameters in every combination."""
    samples: list[tuple[float, ...]] = []
    if len(problem.redundancies) == 1:
        samples = [(v,) for v in _marks(problem, found.arcs[0], grid)]
    elif len(problem.redundancies) == 2:
        for v in _marks(problem, found.arcs[0], 4.0 * grid):
            there = branches_near(problem, problem.seed, (v, math.nan))
            samples += [(v, w) for w in _marks(problem, there.arcs[1], 4.0 * grid)]
    return samples or [(math.nan,) * len(problem.redundancies)]


def _marks(problem: IKProblem, arcs: Array, step: float) -> list[float]:
    """Ends, middles and grid points of the arcs of one parameter; one of values that are a whole turn apart."""
    marks: list[float] = []
    for branch, low, high in arcs.tolist():
        if problem.allows(int(branch)):
            inset = min(TOLERANCES.interval_inset, 0.5 * (high - low))
            marks += [low + inset, 0.5 * (low + high), high - inset]
            marks += [i * step for i in range(math.ceil(low / step), math.floor(high / step) + 1)]
    marks = sorted(wrap(v) for v in marks)
    return [v for i, v in enumerate(marks) if i == 0 or v - marks[i - 1] > 1e-9]


def _at(problem: IKProblem, values: tuple[float, ...]) -> Array:
    """The branches ``(b, n)`` at given values of all redundancy parameters: raw, inside the limits or not."""
    closed_form = problem.closed_form
    assert closed_form is not None
    request = SolverInput(problem.T, problem.code, values, False, problem.seed, problem.lower, problem.upper)
    return closed_form.solve(request).q


# -- without one --------------------------------------------------------------------------------------------------


def _continued_waypoints(problems: list[IKProblem]) -> list[Waypoint]:
    """Layers of continuations, from the first waypoint to the last and back."""
    forth: list[Array] = []
    alive = np.empty((0, problems[0].robot.n))
    for problem in problems:
        here = descended(problem, alive)
        if not len(here):
            here = pool(problem)
        alive = here if len(here) else alive
        forth.append(here)
    alive = pool(problems[-1])
    out = []
    for requested, here in zip(reversed(problems), reversed(forth), strict=True):
        back = descended(requested, alive)
        alive = back if len(back) else here
        layer = with_images(requested, distinct(requested, np.concatenate([here, back]), requested.seed))
        out.append(Waypoint(requested, requested, layer[:_MOST_NODES]) if len(layer) else _by_answer(requested))
    return out[::-1]
