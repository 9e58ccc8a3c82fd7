"""Whole-turn images: the same posture with joints turned by further whole turns inside the limits."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from kin.errors import InputError
from kin.ik import preferences
from kin.ik.branches import measure, solution
from kin.ik.problem import IKProblem
from kin.ik.results import IKSolution
from kin.tolerances import TOLERANCES

_MOST_IMAGES = 4096


def with_images(problem: IKProblem, solutions: tuple[IKSolution, ...]) -> tuple[IKSolution, ...]:
    """The solutions and all their whole-turn images inside the limits, in the preferred order.

    Raises:
        InputError: more than 4096 images of one solution.
    """
    found: list[IKSolution] = []
    for first in solutions:
        choices = [
            _images_of(x, *span)
            for x, *span in zip(first.q.tolist(), problem.lower, problem.upper, problem.turns, strict=True)
        ]
        total = math.prod(len(choice) for choice in choices)
        if total > _MOST_IMAGES:
            raise InputError("images", "all", f"limits that leave at most {_MOST_IMAGES} images, not {total}")
        q, stats = measure(problem.without_turns(), np.array([*itertools.product(*choices)]))
        for row, figures in zip(q, stats, strict=True):
            image = solution(problem, row, figures, -1)
            redundancy = tuple(
                r._replace(value=float(row[p.joint])) if p.joint >= 0 else r
                for r in first.redundancy
                for p in problem.redundancies
                if p.name == r.name
            )
            found.append(replace(image, branch=first.branch, redundancy=redundancy, compromise=first.compromise))
    if problem.options.prefer == "nearest":
        return tuple(sorted(found, key=lambda s: s.distance))
    order = preferences.ranks(problem, np.array([s.q for s in found]), np.array([s.distance for s in found]))
    return tuple(found[i] for i in np.argsort(order).tolist())


def _images_of(x: float, low: float, high: float, turn: float) -> list[float]:
    """x + k·turn inside [low, high], x first; only x where a joint has no images or no limits."""
    if turn == 0.0 or not math.isfinite(high - low):
        return [x]
    first = math.ceil((low - TOLERANCES.limit - x) / turn)
    last = math.floor((high + TOLERANCES.limit - x) / turn)
    if last - first > _MOST_IMAGES:
        raise InputError("images", "all", f"limits that leave at most {_MOST_IMAGES} images")
    return [x, *(x + k * turn for k in range(first, last + 1) if k != 0)]
