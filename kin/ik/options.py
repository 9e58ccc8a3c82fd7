"""Options of inverse kinematics: one frozen, hashable value that callers build once and pass on.

`IKOptions` says what a solution has to meet (task, limits, branch) and which solutions are preferred. The target
and the seed are not options: they change from call to call. Whatever does not depend on an arm is checked when the
value is made; :mod:`kin.ik.problem` checks the rest against an arm, once for each pair of arm and options.

The class is the only description of the options: its annotations hold the choices, ranges and units, its docstring
the texts. The fields of REST requests and the flags of the command line follow from it. `IKKeywords` lists the
keywords of calls for editors and type checkers, and a test compares it with the class.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from functools import cache, cached_property, partial
from typing import Annotated, Any, Literal, NamedTuple, TypedDict, TypeGuard, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from kin.collision.obstacles import Obstacle, checked_obstacles
from kin.differential.task import Task
from kin.errors import InputError, finite_number
from kin.robot import Robot
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION, TASK_CODES
from kin.tolerances import TOLERANCES
from kin.transforms import Array, finite_array

Frame = Literal["tool", "base"]
Images = Literal["nearest", "all"]
Solver = Literal["auto", "numeric"]
Preference = Literal["nearest", "limits", "manipulability"]
WiderLimits = Literal["refuse", "intersect"]
Limits = Sequence[Sequence[float] | None] | Mapping[str, Sequence[float]]
Locks = Sequence[float | None] | Mapping[str, float]
Values = float | Mapping[str, float] | tuple[tuple[str, float], ...]
TASKS: tuple[Task, ...] = get_args(Task)
LEAST_TOLERANCE, MOST_METRES, MOST_RADIANS = TOLERANCES.closure_position, 0.1, 0.5
MASK_NAMES = ("x", "y", "z", "rx", "ry", "rz")
# Masks that are equivalent to one of the three tasks; the first and the last one in either frame.
_EQUIVALENT: dict[tuple[bool, ...], int] = {
    (True,) * 6: POSE,
    (True,) * 5 + (False,): APPROACH,
    (True,) * 3 + (False,) * 3: POSITION,
}


class Range(NamedTuple):
    """The valid values of a number, and their unit; annotates an option that is a number or None."""

    least: float
    most: float
    unit: Literal["m", "rad"]


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

    Both may also be given by the names of joints, ``{"elbow": (0.0, 1.0)}``, and are then kept as pairs of a name
    and what is given for it; the joints that are not named keep their own limits.

    Attributes:
        limits: narrower joint limits, inside the robot's own, in radians (metres). One pair (lower, upper) per
            joint, none for a joint that keeps its own.
        locked: joint values to keep, in radians (metres). One per joint, none for a joint that may move.
        wider_limits: what becomes of limits that are wider than a joint's own. refuse: an error. intersect: of
            both, the narrower ones hold.
    """

    limits: Limits | None = None
    locked: Locks | None = None
    wider_limits: WiderLimits = "refuse"

    def __post_init__(self) -> None:
        if self.limits is not None:
            object.__setattr__(self, "limits", _pairs(self.limits))
        if self.locked is not None:
            object.__setattr__(self, "locked", _lock_values(self.locked))
        if not isinstance(self.wider_limits, str) or self.wider_limits not in get_args(WiderLimits):
            raise InputError("wider_limits", self.wider_limits, 'one of "refuse", "intersect"')

    @classmethod
    def of(
        cls, limits: Limits | None, locked: Locks | None, constraints: JointConstraints | None
    ) -> JointConstraints:
        """The constraints of a call that takes them as two keywords or as one value.

        Args:
            limits: pairs (lower, upper) in radians (metres), as in `JointConstraints`.
            locked: joint values in radians (metres), as in `JointConstraints`.
            constraints: both as one value.

        Returns:
            The constraints.

        Raises:
            InputError: they are given both ways, or malformed.

        Examples:
            >>> import kin
            >>> kin.JointConstraints.of([(-1.0, 1.0), None], None, None).limits
            ((-1.0, 1.0), None)
        """
        if constraints is None:
            return cls(limits, locked)
        if limits is not None or locked is not None:
            raise InputError("constraints", constraints, "none when limits or locked joints are given")
        return constraints

    def __bool__(self) -> bool:
        return self.limits is not None or self.locked is not None

    def bounds(self, robot: Robot) -> Bounds:
        """The limits that hold for an arm; a locked joint has equal ones.

        Args:
            robot: the arm.

        Returns:
            Lower and upper limits ``(n,)`` in radians (metres), and which joints are locked.

        Raises:
            InputError: the wrong number of joints, or a value outside the robot's own limits.

        Examples:
            >>> import kin
            >>> kin.JointConstraints(limits=[(-1.0, 1.0), None]).bounds(kin.get_robot("planar2r")).lower.round(3)
            array([-1.   , -3.142])
        """
        lower, upper = robot.lower.copy(), robot.upper.copy()
        expected = f"{robot.n} pairs (lower, upper), one per joint, or none for a joint's own limits"
        for place, i, (low, high) in _by_joint(robot, "limits", self.limits, expected):
            own, expected = _span(lower[i], upper[i]), ""
            if max(low, lower[i]) > min(high, upper[i]) + TOLERANCES.limit:
                expected = f"limits that overlap the joint's own, {own}"
            elif self.wider_limits == "refuse" and (
                low < lower[i] - TOLERANCES.limit or high > upper[i] + TOLERANCES.limit
            ):
                expected = f"limits inside the joint's own, {own}, or the option wider_limits intersect"
            if expected:
                raise InputError(place, [low, high], expected)
            lower[i], upper[i] = max(low, lower[i]), max(min(high, upper[i]), max(low, lower[i]))
        locks = self.locks(robot)
        for place, i, value in _by_joint(robot, "locked", self.locked, ""):
            if not lower[i] - TOLERANCES.limit <= value <= upper[i] + TOLERANCES.limit:
                expected = f"a value inside the limits, {_span(lower[i], upper[i])}"
                raise InputError(place, value, expected)
            lower[i] = upper[i] = min(max(value, lower[i]), upper[i])
        return Bounds(lower, upper, tuple(value is not None for value in locks or (None,) * robot.n))

    def locks(self, robot: Robot) -> tuple[float | None, ...] | None:
        """The locked joints of an arm.

        Args:
            robot: the arm.

        Returns:
            What each joint keeps, in radians (metres), None for one that may move. None if none is locked.

        Raises:
            InputError: the wrong number of joints, or a name that no joint has.

        Examples:
            >>> import kin
            >>> kin.JointConstraints(locked={"shoulder": 0.5}).locks(kin.get_robot("planar2r"))
            (0.5, None)
        """
        if self.locked is None:
            return None
        expected = f"{robot.n} joint values, or none for a joint that may move"
        values = {i: value for _, i, value in _by_joint(robot, "locked", self.locked, expected)}
        return tuple(values.get(i) for i in range(robot.n))


FREE = JointConstraints()


@dataclass(frozen=True)
class IKOptions:
    """What a solution has to meet, and which solutions are returned. Lists and arrays are kept as tuples.

    Where collisions are avoided, redundancy parameters are searched for values without a touch.

    Attributes:
        task: pose: the whole pose. approach: the point and the direction of the tool's z axis. position: the point
            alone.
        mask: instead of a task, which of the six coordinates x, y, z, rx, ry, rz of the error must be zero; the
            last three are the rotation vector from the target to the tool.
        mask_frame: directions of the mask's coordinates: of the target (tool) or of the world frame (base).
        constraints: limits and locks of the joints; calls take its fields as keywords instead.
        respect_limits: leave out configurations outside the joint limits (each joint at its best whole turn).
        branch: only these branches: a name as in the robot's branches, parts of one such as "elbow up", "seed" for
            the branch of the seed, or several of these.
        images: nearest: of each branch the solution nearest to the seed. all: every whole-turn image inside the
            limits.
        prefer: how to choose redundancy parameters, and how to sort solutions: nearest to the seed, farthest from
            the joint limits, or largest manipulability.
        redundancy: values of redundancy parameters by name, such as psi, in radians; a bare number is the value of
            the first one. By default the feasible value chosen by `prefer`.
        max_solutions: at most so many solutions per target, the best first. By default all.
        solver: numeric: descend from many starts, even where the arm has a closed form.
        position_tolerance: error of the tool's point that counts as none, in metres. By default 1e-9 m, or what
            the digits of a target allow whose rotation had to be made orthonormal.
        rotation_tolerance: the same for the rotation error, in radians.
        avoid_self_collision: leave out configurations in which links of the arm touch each other, judged by the
            capsules of the arm.
        obstacles: bodies in the world frame that the arm must not touch.

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
    position_tolerance: Annotated[float | None, Range(LEAST_TOLERANCE, MOST_METRES, "m")] = None
    rotation_tolerance: Annotated[float | None, Range(LEAST_TOLERANCE, MOST_RADIANS, "rad")] = None
    avoid_self_collision: bool = False
    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        for name, check in _checks():
            object.__setattr__(self, name, check(name, getattr(self, name)))
        if self.mask is not None and self.task != "pose":
            raise InputError("task", self.task, "no task besides a mask")
        if self.constraints and not self.respect_limits:
            raise InputError("respect_limits", False, "true when limits or locked joints are given")

    @classmethod
    def of(cls, options: IKOptions | None, **keywords: Any) -> IKOptions:
        """The options of a call that takes them as keywords or as one value.

        Args:
            options: as one value; None if they are keywords.
            keywords: the fields of this class, with those of `JointConstraints` in the place of `constraints`.

        Returns:
            The options.

        Raises:
            InputError: they are given both ways, or malformed.

        Examples:
            >>> import kin
            >>> kin.IKOptions.of(None, task="position", locked=[None, 0.5]).constraints.locked
            (None, 0.5)
        """
        if options is not None and not isinstance(options, cls):
            raise InputError("options", options, "a kin.IKOptions, or none")
        if not keywords:
            return options or _defaults_checked()
        if options is not None:
            name, value = next(iter(keywords.items()))
            raise InputError(name, value, f"no {name} besides options")
        names = [each.name for each in fields(JointConstraints)]
        if "constraints" in keywords:
            expected = f"the constraints themselves ({', '.join(names)}), or options=kin.IKOptions(constraints=…)"
            raise InputError("constraints", keywords["constraints"], expected)
        constraints = JointConstraints(**{name: keywords.pop(name) for name in names if name in keywords})
        return cls(constraints=constraints, **keywords)

    def __hash__(self) -> int:
        return self._hash

    def __getstate__(self) -> dict[str, object]:
        """The options alone: cached values are computed again elsewhere, where hashes of strings differ."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def _hash(self) -> int:
        return hash(tuple(getattr(self, f.name) for f in fields(self)))

    def check_only(self, *names: str) -> None:
        """Refuse options that a call does not use.

        Args:
            names: of the options that it uses.

        Raises:
            InputError: another option is not the default.

        Examples:
            >>> import kin
            >>> kin.IKOptions(task="position").check_only("task", "mask")
        """
        for name in self._chosen:
            if name not in names:
                expected = "the default; these are used here: " + ", ".join(names)
                raise InputError(f"options.{name}", getattr(self, name), expected)

    @cached_property
    def _chosen(self) -> tuple[str, ...]:
        """The names of the options that are not the default."""
        defaults = {f.name: FREE if f.name == "constraints" else f.default for f in fields(self)}
        return tuple(name for name, default in defaults.items() if getattr(self, name) != default)

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


class MotionKeywords(TypedDict, total=False):
    """The options of which `kin.plan_motion` takes keywords, as in `IKOptions`."""

    avoid_self_collision: bool
    obstacles: Sequence[Obstacle]


class PathKeywords(MotionKeywords, total=False):
    """The options of which `kin.solve_path` takes keywords, as in `IKOptions` and `JointConstraints`."""

    task: Task
    mask: Sequence[bool] | None
    mask_frame: Frame
    limits: Limits | None
    locked: Locks | None
    wider_limits: WiderLimits
    branch: str | Sequence[str] | None
    position_tolerance: float | None
    rotation_tolerance: float | None


class IKKeywords(PathKeywords, total=False):
    """The options of `kin.solve_ik` and `kin.solve_ik_many`, as in `IKOptions` and `JointConstraints`."""

    respect_limits: bool
    images: Images
    prefer: Preference
    redundancy: Values | None
    max_solutions: int | None
    solver: Solver


def options_of_call(names: Any, options: IKOptions | None, keywords: Mapping[str, Any]) -> IKOptions:
    """The options of a call that takes the keywords `names`; another one is an error as Python raises it."""
    for name in keywords.keys() - names.__optional_keys__:
        raise TypeError(f"got an unexpected keyword argument {name!r}")
    return IKOptions.of(options, **keywords)


def shape_of(value: ArrayLike) -> tuple[int, ...]:
    """The shape of a value, () if it is no array."""
    try:
        return np.shape(value)
    except (ValueError, RecursionError):  # rows of different lengths, or a list that contains itself
        return ()


def _is_list(value: object) -> bool:
    return isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)


def _defaults() -> dict[str, Any]:
    """The keywords of a call, with their defaults."""
    found: dict[str, Any] = {}
    for f in fields(IKOptions):
        if f.name == "constraints":
            found |= {each.name: each.default for each in fields(JointConstraints)}
        else:
            assert f.default is not MISSING
            found[f.name] = f.default
    return found


DEFAULTS: Mapping[str, Any] = _defaults()


@cache
def _defaults_checked() -> IKOptions:
    return IKOptions()


@cache
def _checks() -> tuple[tuple[str, Callable[[str, Any], object]], ...]:
    """For each option the function ``(name, value)`` that checks it and returns what is kept."""
    found: dict[str, Callable[[str, Any], object]] = {}
    for name, hint in get_type_hints(IKOptions, include_extras=True).items():
        if get_origin(hint) is Literal:
            found[name] = partial(_choice, get_args(hint))
        elif hint is bool:
            found[name] = _flag
        elif get_origin(hint) is Annotated:
            found[name] = partial(_in_range, hint.__metadata__[0])
    found |= {"mask": _mask, "branch": _names, "redundancy": _values, "max_solutions": _whole_number}
    found["obstacles"] = _obstacles
    return tuple(found.items())


def _choice(choices: Sequence[str], field: str, value: object) -> object:
    if not isinstance(value, str) or value not in choices:
        raise InputError(field, value, "one of " + ", ".join(f'"{choice}"' for choice in choices))
    return value


def _flag(_field: str, value: object) -> bool:
    return bool(value)


def _in_range(allowed: Range, field: str, value: float | None) -> float | None:
    if value is None:
        return None
    expected = f"a number from {allowed.least:g} to {allowed.most:g} {allowed.unit}, or none"
    number = finite_number(field, value, expected)
    if not allowed.least <= number <= allowed.most:
        raise InputError(field, value, expected)
    return number


def _pairs(limits: Limits) -> tuple[Any, ...] | None:
    """Limits as tuples, in the order or by the names that they are given."""

    def pair(field: str, value: Sequence[float] | None) -> tuple[float, float] | None:
        if value is None:
            return None
        low, high = finite_array(field, value, (2,)).tolist() if shape_of(value) == (2,) else (math.inf, -math.inf)
        if low > high:
            raise InputError(field, value, "a lower limit and an upper one that is not below it")
        return low, high

    expected = "pairs (lower, upper), one per joint, or none for a joint's own limits; or pairs by joint name"
    return _checked_each("limits", limits, pair, expected)


def _lock_values(locked: Locks) -> tuple[Any, ...] | None:
    """Locks as tuples, in the order or by the names that they are given."""

    def lock(field: str, value: float | None) -> float | None:
        return (
            None
            if value is None
            else finite_number(field, value, "a finite number, or none for a joint that may move")
        )

    expected = "joint values, or none for a joint that may move; or values by joint name"
    return _checked_each("locked", locked, lock, expected)


def _checked_each(
    field: str, given: Any, check: Callable[[str, Any], Any], expected: str
) -> tuple[Any, ...] | None:
    if _is_by_name(given):
        given = dict(given)
    if isinstance(given, Mapping):
        return tuple((str(name), check(f"{field}.{name}", value)) for name, value in given.items()) or None
    if not _is_list(given):
        raise InputError(field, given, expected)
    return tuple(check(f"{field}[{i}]", value) for i, value in enumerate(given))


def _is_by_name(given: object) -> TypeGuard[tuple[tuple[str, Any], ...]]:
    """Whether constraints are kept by the names of joints."""
    if not isinstance(given, tuple) or not given:
        return False
    return all(isinstance(each, tuple) and len(each) == 2 and isinstance(each[0], str) for each in given)


def _by_joint(robot: Robot, field: str, given: Any, expected: str) -> list[tuple[str, int, Any]]:
    """For each constraint the name that an error gives it, the index of its joint, and its value."""
    if given is None:
        return []
    if not _is_by_name(given):
        if len(given) != robot.n:
            raise InputError(field, [list(each) if isinstance(each, tuple) else each for each in given], expected)
        return [(f"{field}[{i}]", i, value) for i, value in enumerate(given) if value is not None]
    names = [joint.name for joint in robot.joints]
    for name, value in given:
        if names.count(name) != 1:
            raise InputError(f"{field}.{name}", value, "one of the joints " + ", ".join(names))
    return [(f"{field}.{name}", names.index(name), value) for name, value in given if value is not None]


def _mask(field: str, mask: Sequence[bool] | None) -> tuple[bool, ...] | None:
    if mask is None:
        return None
    flags = tuple(mask) if _is_list(mask) else ()
    if len(flags) != 6 or not all(isinstance(flag, bool | np.bool_) for flag in flags):
        raise InputError(field, mask, "six of true or false: " + ", ".join(MASK_NAMES))
    if not any(flags):
        raise InputError(field, mask, "at least one of the six to be true")
    return tuple(bool(flag) for flag in flags)


def _names(field: str, branch: str | Sequence[str] | None) -> tuple[str, ...] | None:
    if branch is None:
        return None
    names = (branch,) if isinstance(branch, str) else tuple(branch) if isinstance(branch, Sequence) else ()
    if not names:
        raise InputError(field, branch, "at least one branch")
    for name in names:
        if not isinstance(name, str):
            raise InputError(field, name, 'names of branches, parts of them such as "elbow up", or "seed"')
    return tuple(name.strip() for name in names)


def _values(field: str, redundancy: Values | None) -> float | tuple[tuple[str, float], ...] | None:
    if redundancy is None:
        return None
    expected = "a finite value in radians"
    if isinstance(redundancy, tuple):
        redundancy = dict(redundancy)
    if not isinstance(redundancy, Mapping):
        return finite_number(field, redundancy, expected)
    return tuple((str(k), finite_number(f"{field}.{k}", v, expected)) for k, v in redundancy.items())


def _whole_number(field: str, value: int | None) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError(field, value, "a whole number from 1, or none")
    return int(value)


def _obstacles(_field: str, value: Sequence[Obstacle] | None) -> tuple[Obstacle, ...]:
    return () if value is None or value == () else checked_obstacles(value)


def _span(low: float, high: float) -> str:
    return f"{low:.6g} to {high:.6g}"
