"""The contract of a closed-form solver: the types through which a family of arms is used.

A *family* is a set of arms whose joint axes have the same geometric arrangement, so that one set of formulas gives
all their configurations. It is one module (or folder) with one function ``match(robot) -> ClosedForm | None`` and
one row in :data:`kin.solvers.FAMILIES`. A `ClosedForm` owns the geometry that it read off the robot's axes.

A closed form neither verifies nor filters, sorts or words its answers: :mod:`kin.ik` does that once for all
families. It returns facts: arrays, codes and named numbers.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from kin.angles import apart
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.names import Names
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.transforms import Array

POSE, APPROACH, POSITION, MASK = 0, 1, 2, 3
TASK_CODES = {"pose": POSE, "approach": APPROACH, "position": POSITION, "mask": MASK}

ObstacleCode = Literal[
    "wrist centre too far from the shoulder",
    "wrist centre too near to the shoulder",
    "wrist centre beyond the elbow's reach",
    "wrist centre too near to axis 1 or 2",
    "wrist centre off the upper arm and forearm",
    "last axis beyond the links' reach",
    "approach direction",
    "point",
    "given joint values",
]
Completeness = Literal["proved", "agreed", "searched", "unknown"]
"""How it is known that no configuration is missing.

``proved``: by the derivation of a closed form, or by a certificate that was checked for this target. ``agreed``:
not proved, but two independent ways have found the same configurations. ``searched``: one way has looked
everywhere, and nothing else has confirmed it. ``unknown``: some may be missing.
"""
_STRENGTHS: tuple[Completeness, ...] = get_args(Completeness)
One = Callable[[Array, Array, float, Array, Array], bool]
Many = Callable[[Array, Array, Array, Array, Array], None]
Seeded = Callable[[Array, Array, Array, Array, Array, Array], None]


class RedundancyParameter(NamedTuple):
    """A parameter that a task leaves free.

    Attributes:
        name, label: id, and the same for people.
        joint: index of the joint whose value it is, −1 if it is none.
        circular: whether its values are angles on a circle, given in (−π, π].
        rare: free at singular targets only, so that no value can be requested.
    """

    name: str
    label: str
    joint: int = -1
    circular: bool = False
    rare: bool = False


@dataclass(slots=True, eq=False)
class SolverInput:
    """A target, and how to choose what it leaves free.

    Attributes:
        T: target pose T_base_tool ``(4, 4)``.
        task: POSE, APPROACH or POSITION (a mask has no closed form).
        values: one per redundancy parameter of the task, NaN to let the solver choose it near the seed.
        respect_limits: choose redundancy parameters so that the limits hold, where that is possible.
        seed, lower, upper: ``(n,)``.
        seed_roll: angle about the target's z axis from its x axis to the seed tool's (tasks with a free roll).
        weight: what a step of the given joint counts: 0.0 where its value stands for a roll that costs no motion.
    """

    T: Array
    task: int
    values: tuple[float, ...]
    respect_limits: bool
    seed: Array
    lower: Array
    upper: Array
    seed_roll: float = 0.0
    weight: float = 1.0


class Obstacle(NamedTuple):
    """Why the geometry does not close when no branch exists.

    Attributes:
        code: what does not fit.
        bound: the length it would have to keep to, metres; NaN where no single length decides.
    """

    code: ObstacleCode
    bound: float = math.nan


@dataclass(slots=True, eq=False)
class Candidates:
    """One configuration per branch: not verified, not filtered, not sorted.

    Attributes:
        q: ``(branches, n)``, NaN where the branch does not exist. Where two have merged, both are there.
        values: ``(branches, parameters)``, the value used, NaN where the redundancy parameter does not exist.
        arcs: per redundancy parameter ``(k, 3)`` rows (branch, low, high): its values that the limits allow, the
            other parameters held.
        gap: metres by which the geometry does not close when no branch exists.
        obstacle: what does not fit then; None if the solver cannot tell.
        completeness: how it is known that no configuration is missing.
        further: gives intervals ``(k, 2)`` of the first redundancy parameter in which there are configurations
            inside the limits, also on branches that none of the rows is on. It takes long, so it is called when
            they are asked for.
    """

    q: Array
    values: Array
    arcs: tuple[Array, ...]
    gap: float = 0.0
    obstacle: Obstacle | None = None
    completeness: Completeness = "proved"
    further: Callable[[], Array] | None = None


@dataclass(frozen=True, eq=False)
class BatchKernels:
    """Compiled functions that write all branches of one target or of many, without limits, order or checks.

    A row that is NaN stands for a branch that does not exist; where two have merged, both rows hold the same
    joints. Angles are in (−π, π], except for a joint whose value was requested. `many` and
    `one` give bit-identical results.

    Attributes:
        params: the arm as the kernels read it, a C-contiguous float64 array ``(k,)`` that they do not write to.
        one: ``one(params, T (4, 4), value, near (n,), out (branches, n))``; False if T is not finite. `value` is
            that of the first redundancy parameter of a pose, NaN to keep it near `near`, which also decides what
            a singular target leaves free.
        many: ``many(params, T (N, 4, 4), values (N,) or (1,), near (n,), out (N, branches, n))``: one value per
            target, or one for all.
        seeded: ``seeded(params, T (N, 4, 4), seeds, lower, upper, out (N, branches, n))``, see
            `ClosedForm.solve_many`; None for families that are quick for no task.
    """

    params: Array
    one: One
    many: Many
    seeded: Seeded | None = field(default=None, kw_only=True)

    @classmethod
    def of_many(cls, params: Array, many: Many) -> BatchKernels:
        """Those whose `one` is a batch of one target."""

        def one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
            if not np.isfinite(T).all():
                out[:] = math.nan
                return False
            many(params, T[None], np.array([value]), near, out[None])
            return True

        return cls(params, one, many)


def weakest(*known: Completeness) -> Completeness:
    """What is known of configurations of which each of several parts is known so."""
    return max(known, key=_STRENGTHS.index)


def is_complete(known: Completeness) -> bool:
    """Whether that is enough to say that no configuration is missing."""
    return known in ("proved", "agreed")


class ClosedForm(ABC):
    """The closed form of one arm.

    Attributes:
        robot: the arm, for families that leave `branch_of` or `singularities` as they are here.
        name, title: id of the family, and the same for people.
        branches: names, one per row of its answers.
        meanings: (part of a name, what it says), for every part of the names.
        reason: a clause that says what about the axes makes the arm one of the family.
        lengths: the signed lengths in its formulas, metres.
        kernels: its batch kernels.
        named: whether a branch keeps its name from pose to pose, so that it can be requested and followed.
        steady: whether a row is the same branch at every value of the first redundancy parameter.
        exact_ranges: whether the intervals of that parameter are exact, so that those of width 0 are found too.
        off: the largest angle (radians) or share of the arm's size by which the formulas are those of another arm;
            if it is not 0.0, configurations may be missing.
        tasks: which of POSE, APPROACH and POSITION have a closed form.
        quick: those whose targets take some microseconds each: `solve_many` serves these.
    """

    robot: Robot
    name: str
    title: str
    branches: tuple[str, ...]
    meanings: tuple[tuple[str, str], ...] = ()
    reason: str
    lengths: tuple[float, ...]
    kernels: BatchKernels
    named: bool = True
    steady: bool = True
    exact_ranges: bool = True
    off: float = 0.0
    tasks: tuple[int, ...] = (POSE,)
    quick: tuple[int, ...] = ()

    def names(self, robot: Robot, sense: Array) -> Names:
        """The names of the branches on `robot`, in which joint i counts `sense[i]` times as it does here."""
        return Names(self.branches, self.meanings)

    def handles(self, task: int) -> bool:
        """Whether a task has a closed form."""
        return task in self.tasks

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """What a task that it handles leaves free; here nothing."""
        return ()

    @abstractmethod
    def solve(self, problem: SolverInput) -> Candidates:
        """All branches of a target, each with its redundancy parameters as near the seed as the limits allow."""

    def solve_many(self, T: Array, seeds: Array, lower: Array, upper: Array, q: Array) -> None:
        """q ``(N, branches, n)`` ← what `solve` finds of many targets ``(N, 4, 4)``, with no value requested.

        Bit-identical, in one compiled call. They are of a `quick` task. Rows may be NaN that are farther from the
        seed than another one inside the limits, and all rows of a target where `solve` may miss some, or that
        leaves a rare redundancy parameter free.

        Args:
            seeds: one for each target ``(N, n)``, or one for all ``(1, n)``.
            lower, upper: ``(n,)`` joint limits, which count.
        """
        if self.kernels.seeded is None:
            raise NotImplementedError(f"{self.name} is quick for no task")
        self.kernels.seeded(self.kernels.params, T, seeds, lower, upper, q)

    def rows_at(self, T: Array, values: Array, near: Array, branches: NDArray[np.intp]) -> Array:
        """Of the rows of `kernels.many` at targets ``(N, 4, 4)`` and values ``(N,)`` one of each ``(N, n)``.

        Args:
            branches: ``(N,)`` which one.
        """
        out = np.empty((len(T), len(self.branches), len(near)))
        self.kernels.many(self.kernels.params, T, values, near, out)
        return out[np.arange(len(T)), branches]

    def add_missing(self, T: Array, near: Array, q: Array) -> Completeness:
        """Add to solutions ``(branches, n)`` of the batch kernels what they miss; how complete they are then."""
        return "proved"

    def relaxed(self, by: float) -> ClosedForm:
        """The same with lengths that may miss by some more metres and still close, or itself.

        Rows that exist only by that are close to postures at the end of the arm's reach. `by` may be negative.
        """
        return self

    def value_at(self, T: Array, q: Array) -> float:
        """The redundancy parameter of a pose T ``(4, 4)``, if it is no joint's value, at q ``(n,)`` that meets it.

        NaN if the family cannot tell.
        """
        return math.nan

    def branch_of(self, q: Array) -> int:
        """The branch that a configuration ``(n,)`` is on: a row of `branches`.

        Here, for rows without names, the one nearest to it among all configurations of its pose.
        """
        rows = np.empty((len(self.branches), self.robot.n))
        self.kernels.one(self.kernels.params, fk(self.robot, q), math.nan, np.array(q, dtype=np.float64), rows)
        off = apart(rows, q, self.robot.revolute)
        return int(np.argmin(np.where(np.isnan(off), math.inf, off)))

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The singularities that a configuration ``(n,)`` is no farther from than `within`, in no order.

        Here, where they have no simple form, the smallest singular value of the Jacobian of a pose.
        """
        return those_within(within, by_jacobian(jacobian(self.robot, q), rank=6))


class WrappedForm(ClosedForm):
    """A closed form that asks another one; what is here is as that one has it.

    Attributes:
        form: that one.
    """

    form: ClosedForm

    def handles(self, task: int) -> bool:
        """The tasks of the form."""
        return self.form.handles(task)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """Those of the form; a parameter that is a joint value is that of the arm's own joint."""
        return self.form.redundancies(task)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """Those of the form."""
        return self.form.singularities(q, within)
