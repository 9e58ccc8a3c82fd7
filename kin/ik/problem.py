"""The question put to inverse kinematics, checked once and then only read.

Locked joints are limits of no width; narrowed limits replace the robot's own. From here on nobody asks whether an
input is sound, and nobody needs to know in which form it came.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.ik.results import Task
from kin.kernels.checks import straighten
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.solvers.common import TURN
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION, TASK_CODES, ClosedForm, RedundancyParameter
from kin.tolerances import TOLERANCES
from kin.transforms import Array, as_transform, finite_array

Frame = Literal["tool", "base"]
Images = Literal["nearest", "all"]
Solver = Literal["auto", "numeric"]
Preference = Literal["nearest", "limits", "manipulability"]
Limits = Sequence[Sequence[float] | None]
Locks = Sequence[float | None]
PREFERENCES: tuple[Preference, ...] = ("nearest", "limits", "manipulability")
MASK_NAMES = ("x", "y", "z", "rx", "ry", "rz")
ALL = (1.0,) * 6
FAR = 1e6  # metres; targets are nearer
_FLOAT = np.dtype(np.float64)
_WHOLE = np.array([*ALL, 0.0])
# Masks that are one of the three tasks with a closed form; the first and the last in either frame.
_CANONICAL: dict[tuple[bool, ...], int] = {
    (True,) * 6: POSE,
    (True,) * 5 + (False,): APPROACH,
    (True,) * 3 + (False,) * 3: POSITION,
}


def go_on() -> None:
    """The `stop` of who has all the time in the world."""


@dataclass(frozen=True, eq=False)
class Question:
    """A checked question.

    Attributes:
        robot: the arm.
        T: target pose ``(4, 4)``.
        task, code: name and code of what must be met.
        mask: ``(7,)`` weights of the six task coordinates, and 1.0 if they are told in the base frame.
        seed, lower, upper: ``(n,)``; the limits are those of the question.
        locked: ``(n,)`` which joints are locked.
        turns: ``(n,)`` 2π where a joint has whole-turn images, 0.0 where not.
        low, high: ``(n,)`` where a descent may go.
        respect: whether answers outside the limits are left out.
        match: the arm's closed form, None if it has none.
        freedoms: what the closed form leaves free in this task.
        values: one per freedom, NaN to let it be chosen.
        branches: the rows asked for, None for all.
        all_images, prefer, max_solutions: which answers are wanted.
        wanted: the solver asked for, ``"auto"`` or ``"numeric"`` (then `match` is None).
        stop: called now and then by what may take long; it raises to end the work.
    """

    robot: Robot
    T: Array
    task: str
    code: int
    mask: Array
    seed: Array
    lower: Array
    upper: Array
    locked: tuple[bool, ...]
    turns: Array
    low: Array
    high: Array
    respect: bool
    match: ClosedForm | None
    freedoms: tuple[RedundancyParameter, ...]
    values: tuple[float, ...]
    branches: frozenset[int] | None
    all_images: bool
    wanted: str
    prefer: str
    max_solutions: int | None
    stop: Callable[[], None] = go_on

    @property
    def given(self) -> tuple[RedundancyParameter, ...]:
        """The freedoms whose value was asked for."""
        return tuple(f for f, v in zip(self.freedoms, self.values, strict=True) if not math.isnan(v))

    def allows(self, branch: int) -> bool:
        """Whether this branch was asked for."""
        return self.branches is None or branch in self.branches

    def branch_of(self, q: Array) -> int:
        """Branch of a configuration, −1 if the arm's branches have no names."""
        return -1 if self.match is None else self.match.branch_of(q)

    def branch_name(self, branch: int) -> str:
        """Name of a branch."""
        return "numeric" if self.match is None or branch < 0 else self.match.branches[branch]

    def without_turns(self) -> Question:
        """The same question, each joint's value taken as it is and not for its whole-turn images."""
        return replace(self, turns=np.zeros(self.robot.n))

    def near(self, seed: Array) -> Question:
        """The same question near another configuration."""
        return replace(self, seed=seed)

    def about(self, T: Array, seed: Array) -> Question:
        """The same question about another target, near another configuration.

        As `replace` does it, in a tenth of the time: every target is asked about this way.
        """
        other = object.__new__(Question)
        other.__dict__.update(self.__dict__, T=T, seed=seed)
        return other


def ask(
    robot: Robot,
    target: ArrayLike,
    *,
    task: Task = "pose",
    mask: Sequence[bool] | None = None,
    mask_frame: Frame = "tool",
    q_seed: ArrayLike | None = None,
    respect_limits: bool = True,
    limits: Limits | None = None,
    locked: Locks | None = None,
    branch: str | Sequence[str] | None = None,
    images: Images = "nearest",
    prefer: Preference = "nearest",
    redundancy: float | Mapping[str, float] | None = None,
    max_solutions: int | None = None,
    solver: Solver = "auto",
) -> Question:
    """Check every argument of `kin.solve_ik`, which explains them; raises `InputError` naming the wrong one."""
    seed = None if q_seed is None else _seed(robot, q_seed)
    words = mask is None and limits is None and locked is None and branch is None and redundancy is None
    rest = (
        task, mask, mask_frame, None if words else seed, respect_limits, limits, locked, branch, images, prefer,
        redundancy, max_solutions, solver,
    )  # fmt: skip
    try:
        # What is told in words is checked once for all targets.
        question = _remembered(robot, *rest) if words else _checked(robot, *rest)
    except TypeError:  # a list, say, where a word belongs, cannot be looked up
        question = _checked(robot, *rest)
    return question.about(pose_of(target, question.code), question.seed if seed is None else seed)


def _checked(
    robot: Robot, task: Task, mask: Sequence[bool] | None, mask_frame: Frame, seed: Array | None,
    respect_limits: bool, limits: Limits | None, locked: Locks | None, branch: str | Sequence[str] | None,
    images: Images, prefer: Preference, redundancy: float | Mapping[str, float] | None, max_solutions: int | None,
    solver: Solver,
) -> Question:  # fmt: skip
    """All of `ask` but the target: a question about the base's own pose."""
    if max_solutions is not None and (
        isinstance(max_solutions, bool) or not isinstance(max_solutions, int | np.integer) or max_solutions < 1
    ):
        raise InputError("max_solutions", max_solutions, "a whole number from 1, or none")
    if images not in ("nearest", "all"):
        raise InputError("images", images, 'one of "nearest", "all"')
    if prefer not in PREFERENCES:
        raise InputError("prefer", prefer, "one of " + ", ".join(f'"{p}"' for p in PREFERENCES))
    task_name, code, weights = _task(task, mask, mask_frame)
    usual = _usual(robot)
    seed = usual.home if seed is None else seed
    lower, upper, locks = usual.lower, usual.upper, usual.locked
    if limits is not None or locked is not None:
        if not respect_limits:
            raise InputError("respect_limits", False, "true when limits or locked joints are given")
        if limits is not None:
            lower, upper = _narrowed(robot, limits)
        if locked is not None:
            lower, upper = lower.copy(), upper.copy()
            locks = _locked(robot, locked, lower, upper)
    if solver not in ("auto", "numeric"):
        raise InputError("solver", solver, 'one of "auto", "numeric"')
    match = closed_form_of(robot) if solver == "auto" else None
    handled = match is not None and match.handles(code)
    freedoms = match.redundancies(code) if match is not None and handled else ()
    values = _values(robot, redundancy, freedoms)
    turns = usual.turns
    for freedom, value in zip(freedoms, values, strict=True):
        if freedom.joint >= 0 and not math.isnan(value):
            turns = turns.copy()
            turns[freedom.joint] = 0.0
    return Question(
        robot=robot,
        T=np.eye(4),
        task=task_name,
        code=code,
        mask=weights,
        seed=seed,
        lower=lower,
        upper=upper,
        locked=locks,
        turns=turns,
        low=lower if respect_limits else usual.low,
        high=upper if respect_limits else usual.high,
        respect=respect_limits,
        match=match,
        freedoms=freedoms,
        values=values,
        branches=None if branch is None else _branches(robot, match, branch, seed),
        all_images=images == "all",
        wanted=solver,
        prefer=prefer,
        max_solutions=max_solutions,
    )


_remembered: Callable[..., Question] = lru_cache(maxsize=1024, typed=True)(_checked)


class _Usual(NamedTuple):
    """What most questions about a robot share. The kernels take writable arrays only, so these are, but nobody
    writes to the arrays of a question."""

    home: Array
    lower: Array
    upper: Array
    low: Array
    high: Array
    turns: Array
    locked: tuple[bool, ...]


@lru_cache(maxsize=256)
def _usual(robot: Robot) -> _Usual:
    lower, upper, turns = robot.lower.copy(), robot.upper.copy(), np.where(robot.revolute, TURN, 0.0)
    low, high = np.where(robot.revolute, -TURN, lower), np.where(robot.revolute, TURN, upper)
    return _Usual(robot.q_home.copy(), lower, upper, low, high, turns, (False,) * robot.n)


def _seed(robot: Robot, q_seed: ArrayLike) -> Array:
    if type(q_seed) is np.ndarray and q_seed.shape == robot.q_shape and q_seed.dtype == np.float64:
        seed = q_seed.copy()
        if all(map(math.isfinite, seed.tolist())):
            return seed
    seed = np.array(robot.check_q(q_seed, "q_seed"))
    if seed.ndim != 1:
        raise InputError("q_seed", f"shape {seed.shape}", f"one configuration of {robot.n} values")
    return seed


def _task(task: str, mask: Sequence[bool] | None, frame: str) -> tuple[str, int, Array]:
    """Name, code and mask weights of what must be met."""
    if task not in TASK_CODES or task == "mask":
        raise InputError("task", task, 'one of "pose", "approach", "position"')
    if frame not in ("tool", "base"):
        raise InputError("mask_frame", frame, 'one of "tool", "base"')
    if mask is None:
        return task, TASK_CODES[task], _WHOLE
    if task != "pose":
        raise InputError("task", task, "no task besides a mask")
    flags = tuple(mask) if isinstance(mask, Sequence | np.ndarray) and not isinstance(mask, str) else ()
    if len(flags) != 6 or not all(isinstance(flag, bool | np.bool_) for flag in flags):
        raise InputError("mask", mask, "six of true or false: " + ", ".join(MASK_NAMES))
    flags = tuple(bool(flag) for flag in flags)
    if not any(flags):
        raise InputError("mask", mask, "at least one of the six to be true")
    code = _CANONICAL.get(flags, MASK)
    if code == APPROACH and frame == "base":
        code = MASK  # free about the base's z axis, not about the tool's
    name = next(name for name, value in TASK_CODES.items() if value == code)
    return name, code, np.array([*(float(flag) for flag in flags), float(frame == "base")])


def pose_of(target: ArrayLike, code: int, field: str = "target") -> Array:
    """A target as a pose ``(4, 4)``: for the task POSITION also a point ``(3,)``; `InputError` naming `field`."""
    if type(target) is np.ndarray and target.shape == (4, 4) and target.dtype is _FLOAT and target.flags.carray:
        T = np.empty((4, 4))
        if straighten(target, FAR, T):
            return T
        T = as_transform(target, field)  # which tells what is wrong
    elif code == POSITION and _shape(target) == (3,):
        T = np.eye(4)
        T[:3, 3] = finite_array(field, target, (3,))
    else:
        T = as_transform(target, field)
    if max(abs(T.item(3)), abs(T.item(7)), abs(T.item(11))) > FAR:
        raise InputError(f"{field} position", T[:3, 3].tolist(), "coordinates below 1e6 m")
    return T


def _shape(value: ArrayLike) -> tuple[int, ...]:
    """The shape of what may be no array at all, then ()."""
    try:
        return np.shape(value)
    except (ValueError, RecursionError):  # rows of different lengths, or a list within itself
        return ()


def _narrowed(robot: Robot, limits: Limits) -> tuple[Array, Array]:
    """The limits of the question ``(n,)``, ``(n,)``: the robot's where nothing is given."""
    lower, upper = robot.lower.copy(), robot.upper.copy()
    expected = f"{robot.n} pairs (lower, upper), one per joint, or none for a joint's own limits"
    if not isinstance(limits, Sequence | np.ndarray) or isinstance(limits, str) or len(limits) != robot.n:
        raise InputError("limits", limits, expected)
    for i, pair in enumerate(limits):
        if pair is None:
            continue
        field = f"limits[{i}]"
        low, high = finite_array(field, pair, (2,)).tolist() if _shape(pair) == (2,) else (math.inf, -math.inf)
        if low > high:
            raise InputError(field, pair, "a lower limit and an upper one that is not below it")
        if low < lower[i] - TOLERANCES.limit or high > upper[i] + TOLERANCES.limit:
            raise InputError(field, pair, f"limits inside the joint's own, {_span(lower[i], upper[i])}")
        lower[i], upper[i] = max(low, lower[i]), min(high, upper[i])
    return lower, upper


def _locked(robot: Robot, locked: Locks, lower: Array, upper: Array) -> tuple[bool, ...]:
    """Which joints are locked; their limits, in place, become the one value."""
    if not isinstance(locked, Sequence | np.ndarray) or isinstance(locked, str) or len(locked) != robot.n:
        raise InputError("locked", locked, f"{robot.n} joint values, or none for a joint that may move")
    for i, value in enumerate(locked):
        if value is None:
            continue
        number = finite_number(f"locked[{i}]", value, "a finite number, or none for a joint that may move")
        if not lower[i] - TOLERANCES.limit <= number <= upper[i] + TOLERANCES.limit:
            raise InputError(f"locked[{i}]", value, f"a value inside the limits, {_span(lower[i], upper[i])}")
        lower[i] = upper[i] = min(max(number, lower[i]), upper[i])
    return tuple(value is not None for value in locked)


def _span(low: float, high: float) -> str:
    return f"{low:.6g} to {high:.6g}"


def _values(
    robot: Robot, redundancy: float | Mapping[str, float] | None, freedoms: tuple[RedundancyParameter, ...]
) -> tuple[float, ...]:
    """The value asked for, of each freedom; NaN where none is."""
    if redundancy is None:
        return (math.nan,) * len(freedoms)
    settable = [f.name for f in freedoms if not f.rare]
    if not settable:
        raise InputError("redundancy", redundancy, f"none: {robot.id} has no free parameter to set in this task")
    if not isinstance(redundancy, Mapping):
        redundancy = {settable[0]: redundancy}
    for name, value in redundancy.items():
        if name not in settable:
            raise InputError("redundancy", name, "one of " + ", ".join(settable))
        finite_number(f"redundancy.{name}", value, "a finite value in radians")
    return tuple(float(redundancy.get(f.name, math.nan)) for f in freedoms)


def finite_number(field: str, value: object, expected: str) -> float:
    """One finite number as a float; raises `InputError` naming `field`."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise InputError(field, value, expected)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(field, value, expected)
    return number


def _branches(robot: Robot, match: ClosedForm | None, branch: str | Sequence[str], seed: Array) -> frozenset[int]:
    """Rows of the branches asked for by whole names, by parts of names, or as the seed's."""
    if match is None:
        raise InputError("branch", branch, f"none: the branches of {robot.id} have no names")
    wishes = [branch] if isinstance(branch, str) else list(branch) if isinstance(branch, Sequence) else []
    names = match.branches
    parts = list(dict.fromkeys(part for name in names for part in name.split(" · ")))
    rows: set[int] = set()
    for wish in wishes:
        words = [w.strip() for w in wish.replace(",", "·").split("·")] if isinstance(wish, str) else [""]
        if words == ["seed"]:
            rows.add(match.branch_of(seed))
            continue
        if any(word not in parts for word in words):
            raise InputError("branch", wish, '"seed", or of these, joined by " · ": ' + ", ".join(parts))
        found = {i for i, name in enumerate(names) if all(word in name.split(" · ") for word in words)}
        if not found:
            raise InputError("branch", wish, "parts that go together, as in " + repr(names[0]))
        rows |= found
    if not rows:
        raise InputError("branch", branch, "at least one branch")
    return frozenset(rows)
