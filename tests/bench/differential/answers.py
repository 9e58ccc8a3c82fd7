"""What a source tree answers, as numbers and names only, which any other process can read."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

import kin
from differential.questions import PATH_EVERY, Question

Interval = tuple[float, float]
Ranges = tuple[tuple[str, float, tuple[Interval, ...]], ...]  # name, value, intervals of each redundancy parameter


@dataclass(slots=True, eq=False)
class Answer:
    """Everything that is compared.

    Attributes:
        status, cause, solver: of `kin.solve_ik`; status ``error`` with the message as cause if it refuses.
        arrays: results by name: forward kinematics, Jacobian, branches, solutions, and what stands in for them.
        branches: names of the branches of the solutions.
        ranges: the redundancy parameters of each solution.
    """

    status: str
    cause: str
    solver: str = ""
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    branches: tuple[str, ...] = ()
    ranges: tuple[Ranges, ...] = ()


def ask(question: Question) -> Answer:
    """The answer of the tree whose `kin` this process has imported."""
    robot, target = question.robot, question.target
    try:
        result = kin.solve_ik(robot, target, q_seed=question.seed, **question.options)
    except kin.InputError as error:
        found = Answer("error", str(error))
    else:
        ranges = tuple(
            tuple((r.name, r.value, tuple(r.intervals)) for r in s.redundancy) for s in result.solutions
        )
        names = tuple(s.branch for s in result.solutions)
        found = Answer(result.status.value, result.cause, result.solver, _arrays(result), names, ranges)
    found.arrays |= {"fk": kin.fk(robot, question.q), "jacobian": kin.jacobian(robot, question.q)}
    try:
        found.arrays["ik_branches"] = kin.ik_branches(robot, target) if target.ndim == 2 else np.empty(0)
    except kin.InputError as error:
        found.cause += f"; ik_branches: {error}"
    if question.number % PATH_EVERY == 0:
        path = kin.solve_path(robot, question.path(), q_start=question.seed)
        found.arrays |= {"path": np.array(path.q), "path's jumps": np.array([jump.index for jump in path.jumps])}
    return found


def _arrays(result: Any) -> dict[str, np.ndarray]:
    return {
        "solutions": np.array([s.q for s in result.solutions]),
        "inside the limits": np.array([s.in_limits for s in result.solutions]),
        "closest": np.array([] if result.closest is None else result.closest.q),
        "blocked": np.array([b.q for b in result.blocked]),
        "distance": np.array(result.distance),
    }
