"""Options of inverse kinematics: one frozen, hashable value that callers build once and pass on.

`IKOptions` says what a solution has to meet (task, limits, branch) and which solutions are preferred. The target
and the seed are not options: they change from call to call. Whatever does not depend on an arm is checked when the
value is made; :mod:`kin.ik.problem` checks the rest against an arm, once for each pair of arm and options.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kin.collision.obstacles import Obstacle, checked_obstacles
from kin.errors import InputError
from kin.robot import Robot
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION, TASK_CODES
from kin.tolerances import TOLERANCES
from kin.transforms import Array, finite_array

Task = Literal["pose", "approach", "position"]
Frame = Literal["tool", "base"]
Images = Literal["nearest", "all"]
Solver = Literal["auto", "numeric"]
Preference = Literal["nearest", "limits", "manipulability"]
Limits = Sequence[Sequence[float] | None]
Locks = Sequence[float | None]
Values = float | Mapping[str, float] | tuple[tuple[str, float], ...]
TASKS: tuple[Task, ...] = ("pose", "approach", "position")
PREFERENCES: tuple[Preference, ...] = ("nearest", "limits", "manipulability")
LEAST_TOLERANCE, MOST_METRES, MOST_RADIANS = TOLERANCES.closure_position, 0.1, 0.5
MASK_NAMES = ("x", "y", "z", "rx", "ry", "rz")
# Masks that are equivalent to one of the three tasks; the first and the last one in either frame.
_EQUIVALENT: dict[tuple[bool, ...], int] = {
    (True,) * 6: POSE,
    (True,) * 5 + (False,): APPROACH,
    (True,) * 3 + (False,) * 3: POSITION,
}


class Bounds(NamedTuple):
    """Where the joints of an arm may be: ``(n,)`` lower and upper limits, and which joints are locked."""

    lower: Array
    upper: Array
    locked: tuple[bool, ...]


class Coordinates(NamedTuple):
    """What a solution has to meet.

    Attributes:
        task, code: name and code of the task.
        mask: ``(7,)`` weights of the six error coordinates, and 1.0 if they are in the base frame.
    """

    task: str
    code: int
    mask: Array


@dataclass(frozen=True)
class JointConstraints:
    """Limits and locks in addition to the robot's own limits. Lists and arrays are accepted and kept as tuples.

    Attributes:
        limits: per joint (lower, upper), inside the robot's own limits; None for a joint that keeps its own.
        locked: per joint the value at which it is locked; None for a joint that may move.
    """

    limits: Limits | None = None
    locked: Locks | None = None

    def __post_init__(self) -> None:
        if self.limits is not None:
            object.__setattr__(self, "limits", _pairs(self.limits))
        if self.locked is not None:
            object.__setattr__(self, "locked", _lock_values(self.locked))

    @classmethod
    def of(
        cls, limits: Limits | None, locked: Locks | None, constraints: JointConstraints | None
    ) -> JointConstraints:
        """The constraints of a call that takes them as two keywords or as one value; `InputError` if as both."""
        if constraints is None:
            return cls(limits, locked)
        if limits is not None or locked is not None:
            raise InputError("constraints", constraints, "none when limits or locked joints are given")
        return constraints

    def __bool__(self) -> bool:
        return self.limits is not None or self.locked is not None

    def bounds(self, robot: Robot) -> Bounds:
        """The limits that hold for an arm; a locked joint has equal ones.

        Raises:
            InputError: the wrong number of joints, or a value outside the robot's own limits.
        """
        lower, upper = robot.lower.copy(), robot.upper.copy()
        limits = (None,) * robot.n if self.limits is None else self.limits
        locked = (None,) * robot.n if self.locked is None else self.locked
        if len(limits) != robot.n:
            expected = f"{robot.n} pairs (lower, upper), one per joint, or none for a joint's own limits"
            raise InputError("limits", [None if pair is None else list(pair) for pair in limits], expected)
        if len(locked) != robot.n:
            expected = f"{robot.n} joint values, or none for a joint that may move"
            raise InputError("locked", list(locked), expected)
        for i, pair in enumerate(limits):
            if pair is None:
                continue
            low, high = pair
            if low < lower[i] - TOLERANCES.limit or high > upper[i] + TOLERANCES.limit:
                expected = f"limits inside the joint's own, {_span(lower[i], upper[i])}"
                raise InputError(f"limits[{i}]", list(pair), expected)
            lower[i], upper[i] = max(low, lower[i]), min(high, upper[i])
        for i, value in enumerate(locked):
            if value is None:
                continue
            if not lower[i] - TOLERANCES.limit <= value <= upper[i] + TOLERANCES.limit:
                expected = f"a value inside the limits, {_span(lower[i], upper[i])}"
                raise InputError(f"locked[{i}]", value, expected)
            lower[i] = upper[i] = min(max(value, lower[i]), upper[i])
        return Bounds(lower, upper, tuple(value is not None for value in locked))


FREE = JointConstraints()


@dataclass(frozen=True)
class IKOptions:
    """What a solution has to meet, and which solutions are returned. Lists and arrays are kept as tuples.

    Attributes:
        task: ``"pose"`` (all six coordinates), ``"approach"`` (point and direction of the tool's z axis) or
            ``"position"``.
        mask: instead of a task, which of the six coordinates x, y, z, rx, ry, rz of the error must be zero; the
            last three are the rotation vector from the target to the tool.
        mask_frame: the frame of these coordinates: the target's own (``"tool"``) or ``"base"``.
        constraints: limits and locks of the joints.
        respect_limits: leave out configurations outside the joint limits (each joint at its best whole turn).
        branch: only these branches: a name of `kin.branch_names`, parts of one (``"elbow up"``), ``"seed"`` for
            the branch of the seed, or several of these.
        images: ``"all"`` adds every whole-turn image inside the limits to the nearest one of each branch.
        prefer: choose redundancy parameters ``"nearest"`` to the seed, farthest from the ``"limits"`` or with the
            largest ``"manipulability"``; solutions are sorted by the same criterion.
        redundancy: values of redundancy parameters by name (``{"psi": 0.3}``), radians; a bare number is the value
            of the first one. None lets `prefer` choose.
        max_solutions: at most so many solutions, the best first.
        solver: ``"numeric"`` ignores the arm's closed form.
        position_tolerance, rotation_tolerance: errors of a solution that count as none, metres and radians. None
            stands for 1e-9, or for the digits of a target whose rotation had to be made one.
        avoid_self_collision: leave out configurations in which links of the arm touch each other, judged by
            `kin.capsules`; redundancy parameters are searched for values without a touch.
        obstacles: leave out configurations in which the arm touches one of these.

    Raises:
        InputError: an option that is malformed whatever the arm.
    """

    task: Task = "pose"
    mask: Sequence[bool] | None = None
    mask_frame: Frame = "tool"
    constraints: JointConstraints = field(default=FREE)
    respect_limits: bool = True
    branch: str | Sequence[str] | None = None
    images: Images = "nearest"
    prefer: Preference = "nearest"
    redundancy: Values | None = None
    max_solutions: int | None = None
    solver: Solver = "auto"
    position_tolerance: float | None = None
    rotation_tolerance: float | None = None
    avoid_self_collision: bool = False
    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        _check_choice("task", self.task, TASKS)
        _check_choice("mask_frame", self.mask_frame, ("tool", "base"))
        _check_choice("images", self.images, ("nearest", "all"))
        _check_choice("prefer", self.prefer, PREFERENCES)
        _check_choice("solver", self.solver, ("auto", "numeric"))
        if self.constraints and not self.respect_limits:
            raise InputError("respect_limits", False, "true when limits or locked joints are given")
        for name, value in (
            ("mask", None if self.mask is None else _flags(self.mask, self.task)),
            ("respect_limits", bool(self.respect_limits)),
            ("branch", None if self.branch is None else _names(self.branch)),
            ("redundancy", None if self.redundancy is None else _values(self.redundancy)),
            ("max_solutions", None if self.max_solutions is None else _whole_number(self.max_solutions)),
            ("position_tolerance", _tolerance("position_tolerance", self.position_tolerance, "m", MOST_METRES)),
            ("rotation_tolerance", _tolerance("rotation_tolerance", self.rotation_tolerance, "rad", MOST_RADIANS)),
            ("avoid_self_collision", bool(self.avoid_self_collision)),
            ("obstacles", checked_obstacles(self.obstacles) if self.obstacles != () else ()),
        ):
            object.__setattr__(self, name, value)

    def __hash__(self) -> int:
        return self._hash

    def __getstate__(self) -> dict[str, object]:
        """The options alone: cached values are computed again elsewhere, where hashes of strings differ."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def _hash(self) -> int:
        return hash((
            self.task, self.mask, self.mask_frame, self.constraints, self.respect_limits, self.branch, self.images,
            self.prefer, self.redundancy, self.max_solutions, self.solver, self.position_tolerance,
            self.rotation_tolerance, self.avoid_self_collision, self.obstacles,
        ))  # fmt: skip

    @cached_property
    def avoids(self) -> bool:
        """Whether configurations are left out because something touches."""
        return self.avoid_self_collision or bool(self.obstacles)

    @cached_property
    def coordinates(self) -> Coordinates:
        """What a solution has to meet; a mask that is equivalent to a task is that task."""
        if self.mask is None:
            return Coordinates(self.task, TASK_CODES[self.task], np.array([1.0] * 6 + [0.0]))
        code = _EQUIVALENT.get(tuple(self.mask), MASK)
        if code == APPROACH and self.mask_frame == "base":
            code = MASK  # rotation about the base's z axis is free, not about the tool's
        name = next(name for name, value in TASK_CODES.items() if value == code)
        weights = [*(float(flag) for flag in self.mask), float(self.mask_frame == "base")]
        return Coordinates(name, code, np.array(weights))


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


def shape_of(value: ArrayLike) -> tuple[int, ...]:
    """The shape of a value, () if it is no array."""
    try:
        return np.shape(value)
    except (ValueError, RecursionError):  # rows of different lengths, or a list that contains itself
        return ()


def _is_list(value: object) -> bool:
    return isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)


def _check_choice(field: str, value: object, choices: Sequence[str]) -> None:
    if not isinstance(value, str) or value not in choices:
        raise InputError(field, value, "one of " + ", ".join(f'"{choice}"' for choice in choices))


def _pairs(limits: Limits) -> tuple[tuple[float, float] | None, ...]:
    if not _is_list(limits):
        raise InputError("limits", limits, "pairs (lower, upper), one per joint, or none for a joint's own limits")
    found: list[tuple[float, float] | None] = []
    for i, pair in enumerate(limits):
        if pair is None:
            found.append(None)
            continue
        field = f"limits[{i}]"
        is_pair = shape_of(pair) == (2,)
        low, high = finite_array(field, pair, (2,)).tolist() if is_pair else (math.inf, -math.inf)
        if low > high:
            raise InputError(field, pair, "a lower limit and an upper one that is not below it")
        found.append((low, high))
    return tuple(found)


def _lock_values(locked: Locks) -> tuple[float | None, ...]:
    if not _is_list(locked):
        raise InputError("locked", locked, "joint values, or none for a joint that may move")
    expected = "a finite number, or none for a joint that may move"
    return tuple(v if v is None else finite_number(f"locked[{i}]", v, expected) for i, v in enumerate(locked))


def _flags(mask: Sequence[bool], task: str) -> tuple[bool, ...]:
    if task != "pose":
        raise InputError("task", task, "no task besides a mask")
    flags = tuple(mask) if _is_list(mask) else ()
    if len(flags) != 6 or not all(isinstance(flag, bool | np.bool_) for flag in flags):
        raise InputError("mask", mask, "six of true or false: " + ", ".join(MASK_NAMES))
    if not any(flags):
        raise InputError("mask", mask, "at least one of the six to be true")
    return tuple(bool(flag) for flag in flags)


def _names(branch: str | Sequence[str]) -> tuple[str, ...]:
    names = (branch,) if isinstance(branch, str) else tuple(branch) if isinstance(branch, Sequence) else ()
    if not names:
        raise InputError("branch", branch, "at least one branch")
    for name in names:
        if not isinstance(name, str):
            raise InputError("branch", name, 'names of branches, parts of them such as "elbow up", or "seed"')
    return tuple(name.strip() for name in names)


def _values(redundancy: Values) -> float | tuple[tuple[str, float], ...]:
    expected = "a finite value in radians"
    if isinstance(redundancy, tuple):
        redundancy = dict(redundancy)
    if not isinstance(redundancy, Mapping):
        return finite_number("redundancy", redundancy, expected)
    return tuple((str(k), finite_number(f"redundancy.{k}", v, expected)) for k, v in redundancy.items())


def _tolerance(field: str, value: float | None, unit: str, most: float) -> float | None:
    if value is None:
        return None
    expected = f"a number from {LEAST_TOLERANCE:g} to {most:g} {unit}, or none"
    number = finite_number(field, value, expected)
    if not LEAST_TOLERANCE <= number <= most:
        raise InputError(field, value, expected)
    return number


def _whole_number(value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError("max_solutions", value, "a whole number from 1, or none")
    return int(value)


def _span(low: float, high: float) -> str:
    return f"{low:.6g} to {high:.6g}"
