"""Two trees of free motions that grow towards each other: RRT-Connect of OMPL, with our swept test of motions.

OMPL keeps one generator of seeds for the whole process, so only one search runs at a time: else two at the same
time would change what the other finds.
"""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np

from kin.differential.metric import weights
from kin.errors import InputError
from kin.transforms import Array
from kin.way.free import Space

STEP = 0.8  # the longest motion that a tree grows by, weighted as in `kin.differential.metric.weights`
_ONE = threading.Lock()
_LOOK = 0.05  # seconds between two looks whether a search that waits for another one is cancelled


def is_installed() -> bool:
    """Whether the package that searches is there."""
    return importlib.util.find_spec("ompl") is not None


@contextmanager
def alone(cancel: Callable[[], None]) -> Iterator[None]:
    """Wait until no other search runs; `cancel` cancels by raising."""
    while not _ONE.acquire(timeout=_LOOK):
        cancel()
    try:
        yield
    finally:
        _ONE.release()


def connect(
    space: Space, start: Array, goals: Sequence[Array], seed: int, passed: Callable[[], float]
) -> Array | None:
    """Waypoints ``(k, n)`` from the start to one of the goals, all ``(n,)``; None if the time is over before.

    `passed` is the part of the time that has passed; it may cancel by raising. Call it within `alone`.
    """
    base, geometric, util = _ompl()
    weight = weights(space.robot)

    def read(state: Any) -> Array:
        return np.array([state[i] for i in range(len(weight))]) / weight

    class Motions(base.MotionValidator):  # type: ignore[name-defined, misc]
        """The swept test."""

        def checkMotion(self, first: Any, second: Any, *rest: Any) -> bool:
            """Whether a motion between two states is free."""
            return space.is_free(read(first), read(second))

    util.noOutputHandler()  # it reports each new seed as an error
    util.RNG.setSeed(seed + 1)  # 0 would take the time
    states = base.RealVectorStateSpace(len(weight))
    bounds = base.RealVectorBounds(len(weight))
    for i, (low, high) in enumerate(zip(space.lower * weight, space.upper * weight, strict=True)):
        bounds.setLow(i, float(low))
        bounds.setHigh(i, float(high))
    states.setBounds(bounds)
    information = base.SpaceInformation(states)
    information.setStateValidityChecker(lambda state: space.is_free_at(read(state)))
    motions = Motions(information)
    information.setMotionValidator(motions)
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.addStartState(_state(states, start * weight))
    ends = base.GoalStates(information)
    for goal in goals:
        ends.addState(_state(states, goal * weight))
    problem.setGoal(ends)
    planner = geometric.RRTConnect(information)
    planner.setRange(STEP)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(base.PlannerTerminationCondition(lambda: passed() >= 1.0))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    rows = np.array([read(path.getState(i)) for i in range(path.getStateCount())])
    rows[0] = start
    rows[-1] = min(goals, key=lambda goal: float(np.abs(goal - rows[-1]).max()))
    return rows


def _state(states: Any, values: Array) -> Any:
    state = states.allocState()
    for i, value in enumerate(values.tolist()):
        state[i] = value
    return state


def _ompl() -> tuple[ModuleType, ModuleType, ModuleType]:
    try:
        from ompl import base, geometric, util
    except ImportError:
        needed = "the package ompl: pip install 'kinboard[ways]' (Python 3.11 to 3.13)"
        raise InputError("find_way", "ompl", needed) from None
    return base, geometric, util
