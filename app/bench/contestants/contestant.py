"""What a contestant and a peer are, and how answers of other libraries become ours."""

from __future__ import annotations

import contextlib
import importlib.util
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from typing import Any

import numpy as np

import kin
from app.bench.arms import Arm
from app.bench.rows import Task
from kin.robot import Robot
from kin.transforms import Array

OURS = "kinboard"
SOLVE_IK = "kinboard, solve_ik"
FLOORS = ("floor: empty call", "floor: sine, cosine", "floor: points written")
VIRTUAL = 1e-6  # radians: a virtual joint at zero
TOLERANCE = 1e-13  # of iterative solvers, for half the squared error: about 1e-7 m or rad


@dataclass(frozen=True, eq=False)
class Contestant:
    """One timed way to do a task.

    Attributes:
        name: shown in tables.
        call: timed as ``call(*arguments)``.
        inputs: arguments of each call; together they cover all targets once.
        read: turns an answer into one entry per target: configurations ``(k, n)`` of our arm, or a pose.
        per_call: targets in a call.
        one: returns one solution instead of all.
        floor: does not solve the task; a lower bound for the others.
        bodies: an arm with the bodies that it compares, if it has bodies of its own.
        derivation: seconds of processor time to derive or generate the solver of this arm, once; None if it
            derives nothing.
    """

    name: str
    call: Callable[..., Any]
    inputs: Sequence[tuple[Any, ...]]
    read: Callable[[Any], list[Array]]
    per_call: int = 1
    one: bool = False
    floor: bool = False
    bodies: Robot | None = None
    derivation: float | None = None


@dataclass(frozen=True, slots=True)
class Peer:
    """A library: the name of its distribution, its module, and the function that makes its contestants.

    `extra`: whether the extra `bench` brings it, which has only what need not be compiled.
    """

    name: str
    module: str
    enter: Callable[[Task], list[Contestant]]
    extra: bool = True

    @property
    def installed(self) -> bool:
        """Whether its module can be found."""
        return importlib.util.find_spec(self.module) is not None

    @property
    def version(self) -> str:
        """Version of the distribution; ours when it is ourselves."""
        return kin.__version__ if self.name == "kinboard" else metadata.version(self.name)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Suppresses the warnings of other libraries."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def no_answers(_: Any) -> list[Array]:
    return []


def one_answer(answer: Any) -> list[Array]:
    return [answer]


def without_tool_rotation(T: Array, tool: Array) -> Array:
    """A target for a screw chain, whose tool has no rotation at the zero configuration."""
    M = T.copy()
    M[:3, :3] = T[:3, :3] @ tool.T
    return M


def with_tool_rotation(M: Any, tool: Array) -> Array:
    """The pose with the tool's rotation, from the pose of a screw chain."""
    T = np.array(M, dtype=np.float64)
    T[:3, :3] = T[:3, :3] @ tool
    return T


def our_joints(task: Task, q: Array) -> Array:
    """Configurations ``(k, 6)`` of a six-joint arm as those of ours: without the roll, with the locked joint."""
    q = np.asarray(q, dtype=np.float64).reshape(-1, 6)
    if task.robot.n == 5 and not task.row.approach:
        q = q[np.abs(np.remainder(q[:, 5] + math.pi, 2.0 * math.pi) - math.pi) < VIRTUAL]
    if task.row.lock is not None:
        return np.insert(q, task.row.lock, task.row.value, axis=1)
    return q[:, : task.robot.n]


def search_range(task: Task, arm: Arm) -> tuple[Array, Array]:
    """Lower and upper bounds ``(n,)`` of an iteration: the joint limits, ±π for a roll and unlimited joints."""
    lower, upper = np.full(arm.n, -math.pi), np.full(arm.n, math.pi)
    if task.row.kind == "answer":
        n = task.robot.n
        lower[:n] = np.where(np.isfinite(task.robot.lower), task.robot.lower, -math.pi)
        upper[:n] = np.where(np.isfinite(task.robot.upper), task.robot.upper, math.pi)
    for i in arm.slides:
        lower[i], upper[i] = task.robot.lower[i], task.robot.upper[i]
    return lower, upper


def start_of(task: Task, arm: Arm) -> Array:
    """The start of an iteration: the home configuration, which is also our default seed."""
    start = np.zeros(arm.n)
    start[: task.robot.n] = task.robot.q_home
    return start
