"""The names of an arm's solver and branches, as lists of arms show them.

To choose the solver of an arm that fits no family, test poses are solved. For all built-in arms that takes 0.3 s,
the rest of `kinboard robots` 0.7 s. Their names are therefore kept in ``kin/robots/solvers.json``, which
``scripts/arms_page.py`` writes. A test compares the file with the solvers; an arm that is not in it is computed.
"""

from __future__ import annotations

import json
from functools import lru_cache
from typing import NamedTuple

from kin import Robot, branch_names, builtin_robots
from kin.files.builtin import BUILTIN
from kin.ik import branch_meanings
from kin.solvers import family_of

FILE = BUILTIN / "solvers.json"


class SolverNames(NamedTuple):
    """Name of the solver, names of the branches, and what each part of a branch's name means."""

    solver: str
    branches: list[str]
    meanings: dict[str, str]


def solver_names(robot: Robot) -> SolverNames:
    """The names for an arm; without computation for a built-in one."""
    return known_names(robot) or computed_names(robot)


def known_names(robot: Robot) -> SolverNames | None:
    """The names for a built-in arm; None for other arms."""
    return _known().get(robot.id) if builtin_robots().get(robot.id) == robot else None


def computed_names(robot: Robot) -> SolverNames:
    """The names for an arm, from the solver that is chosen for it."""
    return SolverNames(family_of(robot), list(branch_names(robot)), branch_meanings(robot))


@lru_cache(maxsize=1)
def _known() -> dict[str, SolverNames]:
    return {key: SolverNames(**names) for key, names in json.loads(FILE.read_text(encoding="utf-8")).items()}
