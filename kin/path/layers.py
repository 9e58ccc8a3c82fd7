"""Layers: for each waypoint the configurations to choose from.

With a closed form: its branches at samples of what is free, over the exact feasible arcs. Their ends and middles
are there, so that the narrowest arc has a sample, and a grid that is the same for every waypoint, so that a value
can be kept. Each at all whole-turn images inside the limits.

Without one: numeric continuation. Descents from many places at one end of the path are followed to the other end,
and back. Two free values are first answered so too; a grid of both is large, and only tried if jumps remain.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kin.ik import answer
from kin.ik.branches import Branches
from kin.ik.problem import Question
from kin.ik.results import Status
from kin.path.course import Stop, is_sampled
from kin.path.waypoint import branches_near, descended, distinct, meeting, pool, with_images
from kin.solvers.common import wrap
from kin.solvers.contract import APPROACH, POSE, SolverInput
from kin.transforms import Array

_MOST_NODES = 4000  # configurations in a layer


def stops_at(questions: list[Question], grid: float) -> list[Stop]:
    """The waypoints with their layers; `grid`: radians between samples of what is free."""
    if is_sampled(questions[0]):
        return [_sampled_stop(asked, grid) for asked in questions]
    return _continued_stops(questions)


def _by_answer(asked: Question) -> Stop:
    """What the whole pipeline makes of a waypoint where the layer stays empty."""
    result = answer(asked)
    q = np.array([s.q for s in result.solutions]).reshape(-1, asked.robot.n)
    if result.status is not Status.SOLVED:
        return Stop(asked, asked, q[:0], result)
    return Stop(asked, asked, with_images(asked, q))


# -- with a closed form -------------------------------------------------------------------------------------------


def _sampled_stop(asked: Question, grid: float) -> Stop:
    stop = Stop(asked, asked, sampled(asked, False, grid))
    if not len(stop.layer) and asked.robot.n < 6 and asked.code == POSE:
        question = replace(asked, code=APPROACH, task="approach")
        stop = Stop(asked, question, sampled(question, True, grid))
    return stop if len(stop.layer) else _by_answer(asked)


def sampled(question: Question, relaxed: bool, grid: float) -> Array:
    """The layer ``(m, n)`` of a waypoint from its closed form, thinned if it would be too large."""
    found = branches_near(question, question.seed)
    samples = _samples(question, found, grid)
    while True:
        q = np.concatenate([found.q, *(_at(question, values) for values in samples)])
        layer = with_images(question, meeting(question, relaxed, q, question.seed))
        if len(layer) <= _MOST_NODES or len(samples) == 1:
            return layer[:_MOST_NODES]
        samples = samples[:: math.ceil(len(layer) / _MOST_NODES)]


def _samples(question: Question, found: Branches, grid: float) -> list[tuple[float, ...]]:
    """Values of the freedoms to ask for, those the arcs allow; of two freedoms in every combination."""
    samples: list[tuple[float, ...]] = []
    if len(question.freedoms) == 1:
        samples = [(v,) for v in _marks(question, found.arcs[0], grid)]
    elif len(question.freedoms) == 2:
        for v in _marks(question, found.arcs[0], 4.0 * grid):
            there = branches_near(question, question.seed, (v, math.nan))
            samples += [(v, w) for w in _marks(question, there.arcs[1], 4.0 * grid)]
    return samples or [(math.nan,) * len(question.freedoms)]


def _marks(question: Question, arcs: Array, step: float) -> list[float]:
    """Ends, middles and grid points of the arcs of one freedom; of values a whole turn apart only one."""
    marks: list[float] = []
    for branch, low, high in arcs.tolist():
        if question.allows(int(branch)):
            inset = min(1e-7, 0.5 * (high - low))
            marks += [low + inset, 0.5 * (low + high), high - inset]
            marks += [i * step for i in range(math.ceil(low / step), math.floor(high / step) + 1)]
    marks = sorted(wrap(v) for v in marks)
    return [v for i, v in enumerate(marks) if i == 0 or v - marks[i - 1] > 1e-9]


def _at(question: Question, values: tuple[float, ...]) -> Array:
    """The branches ``(b, n)`` at given values of all that is free: raw, whatever the limits say."""
    match = question.match
    assert match is not None
    problem = SolverInput(question.T, question.code, values, False, question.seed, question.lower, question.upper)
    return match.solve(problem).q


# -- without one --------------------------------------------------------------------------------------------------


def _continued_stops(questions: list[Question]) -> list[Stop]:
    """Layers of continuations, from the first waypoint to the last and back."""
    forth: list[Array] = []
    alive = np.empty((0, questions[0].robot.n))
    for question in questions:
        here = descended(question, alive)
        if not len(here):
            here = pool(question)
        alive = here if len(here) else alive
        forth.append(here)
    alive = pool(questions[-1])
    out = []
    for asked, here in zip(reversed(questions), reversed(forth), strict=True):
        back = descended(asked, alive)
        alive = back if len(back) else here
        layer = with_images(asked, distinct(np.concatenate([here, back]), asked.seed))
        out.append(Stop(asked, asked, layer[:_MOST_NODES]) if len(layer) else _by_answer(asked))
    return out[::-1]
