"""Programs: targets and the segments that lead to them. Metres, radians, seconds.

A program begins where the arm is. Each segment leads from the end of the one before to its target.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, get_args

import numpy as np
from numpy.typing import ArrayLike

from kin.differential.task import Task
from kin.errors import InputError, finite_number
from kin.ik.options import shape_of
from kin.poses import check_length
from kin.transforms import Array, as_transform, pose_from_position_wxyz, wxyz_from_rotation

Orientation = Literal["geodesic", "two-axis"]
Kind = Literal["ptp", "lin", "circ", "spline", "dwell", "gripper"]
ORIENTATIONS: tuple[Orientation, ...] = get_args(Orientation)
TASKS: tuple[Task, ...] = ("pose", "approach", "position")
MOST_SEGMENTS, MOST_POINTS, MOST_VALUES = 1000, 200, 32
LONGEST_NAME, LONGEST_DWELL = 120, 3600.0
GRIPPER_TIME = 2.0  # s: what servos of the SO-101 need from closed to open at the speed of `kinboard so101`
_POSE = (4, 4)
_FAR = 1e6  # metres or radians


@dataclass(frozen=True, slots=True)
class JointTarget:
    """A configuration: one value per moving joint, radians or metres."""

    q: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the values; they become floats."""
        object.__setattr__(self, "q", _numbers("q", self.q, None, "joint values, radians or metres"))


@dataclass(frozen=True, slots=True)
class PoseTarget:
    """A pose of the tool.

    Attributes:
        position: the tool point in the world frame, metres.
        wxyz: quaternion of the orientation, of length 1 to within 0.1, and made 1 here; None keeps the orientation
            at the start of the segment.
    """

    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        """Check the values; the quaternion becomes a unit quaternion."""
        object.__setattr__(
            self, "position", _numbers("position", self.position, 3, "three numbers x, y, z in metres")
        )
        if self.wxyz is not None:
            given = _numbers("wxyz", self.wxyz, 4, "a quaternion (w, x, y, z) of length 1")
            check_length(given)
            size = math.hypot(*given)
            if abs(size - 1.0) > 1e-15:
                given = tuple(value / size for value in given)
            object.__setattr__(self, "wxyz", given)

    @classmethod
    def of(cls, T: ArrayLike) -> PoseTarget:
        """The target that is a pose of the tool.

        Args:
            T: ``(4, 4)`` in the world frame, metres.

        Returns:
            The target, with position and orientation.

        Raises:
            InputError: T is no rigid transform.

        Examples:
            >>> import kin
            >>> kin.motion.PoseTarget.of(kin.pose_from_xyz_rpy([0.4, 0.1, 0.3])).position
            (0.4, 0.1, 0.3)
        """
        pose = as_transform(T, "pose")
        x, y, z = pose[:3, 3].tolist()
        w, i, j, k = wxyz_from_rotation(pose[:3, :3]).tolist()
        return cls((x, y, z), (w, i, j, k))

    def pose(self, before: Array) -> Array:
        """The pose of the tool that is meant.

        Args:
            before: pose ``(4, 4)`` at the start of the segment; its orientation is kept where the target has none.

        Returns:
            The pose ``(4, 4)`` in the world frame, metres.

        Examples:
            >>> import kin
            >>> import numpy as np
            >>> kin.motion.PoseTarget((0.4, 0.1, 0.3)).pose(np.eye(4))[:3, 3]
            array([0.4, 0.1, 0.3])
        """
        T = pose_from_position_wxyz(self.position, self.wxyz)
        if self.wxyz is None:
            T[:3, :3] = before[:3, :3]
        return T


Target = JointTarget | PoseTarget


class MoveOptions(TypedDict, total=False):
    """The fields of `Move` as keywords, for type checkers."""

    speed: float
    acceleration: float
    tool_speed: float | None
    tool_turn: float | None
    blend: float
    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """What all segments have in which the arm moves.

    Attributes:
        speed, acceleration: parts of the joint limits that the segment may use, above 0 and at most 1. The
            second scales acceleration and jerk.
        tool_speed, tool_turn: largest speed of the tool point (m/s) and of the tool's rotation (rad/s); None: no
            other limits than those of the joints.
        blend: radius of the zone (m) about the target within which the path may leave this segment for the next;
            0: the arm stops at the target. At most half of each of the two segments is used.
        name: shown to people.
    """

    speed: float = 1.0
    acceleration: float = 1.0
    tool_speed: float | None = None
    tool_turn: float | None = None
    blend: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        """Check the values; numbers become floats."""
        for key in ("speed", "acceleration"):
            expected = "a number above 0 and at most 1"
            value = finite_number(key, getattr(self, key), expected)
            if not 0.0 < value <= 1.0:
                raise InputError(key, getattr(self, key), expected)
            object.__setattr__(self, key, value)
        for key in ("tool_speed", "tool_turn"):
            if (given := getattr(self, key)) is not None:
                unit = "m/s" if key == "tool_speed" else "rad/s"
                value = finite_number(key, given, f"a number above 0 in {unit}")
                if not value > 0.0:
                    raise InputError(key, given, f"a number above 0 in {unit}")
                object.__setattr__(self, key, value)
        expected = "a radius in metres, 0 or more"
        blend = finite_number("blend", self.blend, expected)
        if not 0.0 <= blend <= _FAR:
            raise InputError("blend", self.blend, expected)
        object.__setattr__(self, "blend", blend)
        _check_name(self.name)


@dataclass(frozen=True, slots=True)
class Ptp(Move):
    """Point to point: all joints start and end together, as fast as they may; the tool's path follows from that.

    For a pose, the configuration nearest to the start is taken.

    Attributes:
        target: a `PoseTarget`, a `JointTarget`, a pose ``(4, 4)`` or joint values ``(n,)``.
    """

    target: Target

    if TYPE_CHECKING:

        def __init__(self, target: Target | ArrayLike, **move: Unpack[MoveOptions]) -> None: ...

    def __post_init__(self) -> None:
        """Check the values."""
        Move.__post_init__(self)
        object.__setattr__(self, "target", _target("target", self.target))


@dataclass(frozen=True, slots=True)
class Lin(Move):
    """A straight line of the tool point.

    Attributes:
        target: as of `Ptp`.
        orientation: ``"geodesic"``: rotation about one fixed axis; ``"two-axis"``: the approach direction turns in
            its plane while the tool turns about it.
    """

    target: Target
    orientation: Orientation = "geodesic"

    if TYPE_CHECKING:

        def __init__(
            self, target: Target | ArrayLike, orientation: Orientation = "geodesic", **move: Unpack[MoveOptions]
        ) -> None: ...

    def __post_init__(self) -> None:
        """Check the values."""
        Move.__post_init__(self)
        object.__setattr__(self, "target", _target("target", self.target))
        _check_orientation(self.orientation)


@dataclass(frozen=True, slots=True)
class Circ(Move):
    """An arc of the tool point through a via point; the orientation turns steadily from start to target.

    Attributes:
        via: a point of the arc between start and target, metres; of a pose ``(4, 4)`` its point.
        target: as of `Ptp`.
    """

    via: tuple[float, float, float]
    target: Target
    orientation: Orientation = "geodesic"

    if TYPE_CHECKING:

        def __init__(
            self,
            via: ArrayLike,
            target: Target | ArrayLike,
            orientation: Orientation = "geodesic",
            **move: Unpack[MoveOptions],
        ) -> None: ...

    def __post_init__(self) -> None:
        """Check the values."""
        Move.__post_init__(self)
        object.__setattr__(self, "target", _target("target", self.target))
        _check_orientation(self.orientation)
        if shape_of(self.via) == _POSE:
            object.__setattr__(self, "via", PoseTarget.of(self.via).position)
        object.__setattr__(self, "via", _numbers("via", self.via, 3, "three numbers x, y, z in metres"))


@dataclass(frozen=True, slots=True)
class Spline(Move):
    """A smooth curve through points: of the tool if all are poses, of the joints if all are configurations.

    Attributes:
        points: each as the target of `Ptp`.
    """

    points: tuple[Target, ...]

    if TYPE_CHECKING:

        def __init__(self, points: Iterable[Target | ArrayLike], **move: Unpack[MoveOptions]) -> None: ...

    def __post_init__(self) -> None:
        """Check the values."""
        Move.__post_init__(self)
        expected = f"1 to {MOST_POINTS} poses, or as many configurations"
        given = list(self.points) if isinstance(self.points, np.ndarray) else self.points
        points = tuple(_target(f"points[{i}]", point) for i, point in enumerate(_items("points", given, expected)))
        if not 1 <= len(points) <= MOST_POINTS or len({type(point) for point in points}) > 1:
            raise InputError("points", self.points, expected)
        object.__setattr__(self, "points", points)

    @property
    def target(self) -> Target:
        """Where it ends."""
        return self.points[-1]


class Pause:
    """What the segments have in which the arm stands still where the segment before ended.

    Attributes:
        seconds: how long.
        name: shown to people.
    """

    __slots__ = ()
    seconds: float
    name: str

    def __post_init__(self) -> None:
        """Check the values."""
        expected = f"seconds, 0 to {LONGEST_DWELL:g}"
        seconds = finite_number("seconds", self.seconds, expected)
        if not 0.0 <= seconds <= LONGEST_DWELL:
            raise InputError("seconds", self.seconds, expected)
        object.__setattr__(self, "seconds", seconds)
        _check_name(self.name)


@dataclass(frozen=True, slots=True)
class Dwell(Pause):
    """A pause at the place where the segment before ended."""

    seconds: float
    name: str = ""


@dataclass(frozen=True, slots=True)
class Gripper(Pause):
    """The gripper opens or closes, and the arm waits for it where the segment before ended.

    Attributes:
        opening: how far the gripper is open then, a part of its range: from 0 (closed) to 1 (open).
        seconds: how long the arm waits. The gripper moves steadily for so long; one that is slower, or holds
            something, is not waited for any longer.
    """

    opening: float
    seconds: float = GRIPPER_TIME
    name: str = ""

    def __post_init__(self) -> None:
        """Check the values."""
        Pause.__post_init__(self)
        object.__setattr__(self, "opening", checked_opening("opening", self.opening))


def checked_opening(field: str, value: object) -> float:
    """How far a gripper is open, 0 (closed) to 1 (open), as a float; raises `InputError` naming the field."""
    expected = "a number from 0 (closed) to 1 (open)"
    opening = finite_number(field, value, expected)
    if not 0.0 <= opening <= 1.0:
        raise InputError(field, value, expected)
    return opening


Segment = Ptp | Lin | Circ | Spline | Dwell | Gripper
KINDS: dict[Kind, type[Segment]] = {
    "ptp": Ptp,
    "lin": Lin,
    "circ": Circ,
    "spline": Spline,
    "dwell": Dwell,
    "gripper": Gripper,
}
_KIND_OF: dict[type[Segment], Kind] = {cls: kind for kind, cls in KINDS.items()}


@dataclass(frozen=True, slots=True)
class Program:
    """A motion as it is asked for.

    Attributes:
        segments: in order, at least one.
        name: shown to people.
        task: what the tool keeps of a pose: ``"pose"``, ``"approach"`` (point and approach direction) or
            ``"position"`` (the point). None: as much as the joints of the arm can keep.
        jerk_limited: whether paths keep the limits of jerk too; if not, acceleration may jump.
    """

    segments: tuple[Segment, ...]
    name: str = ""
    task: Task | None = None
    jerk_limited: bool = True

    def __post_init__(self) -> None:
        """Check the fields."""
        segments = _items("segments", self.segments, f"1 to {MOST_SEGMENTS} segments")
        if not 1 <= len(segments) <= MOST_SEGMENTS:
            raise InputError("segments", f"{len(segments)} segments", f"1 to {MOST_SEGMENTS} segments")
        for i, segment in enumerate(segments):
            if type(segment) not in _KIND_OF:
                raise InputError(f"segments[{i}]", segment, "one of " + ", ".join(c.__name__ for c in _KIND_OF))
        object.__setattr__(self, "segments", segments)
        if self.task is not None and self.task not in TASKS:
            raise InputError("task", self.task, "one of " + ", ".join(f'"{task}"' for task in TASKS))
        if not isinstance(self.jerk_limited, bool):
            raise InputError("jerk_limited", self.jerk_limited, "true or false")
        _check_name(self.name)


def kind_of(segment: Segment) -> Kind:
    """The kind of a segment, as it is written in a file."""
    return _KIND_OF[type(segment)]


def field_names(cls: type[Segment] | type[Program]) -> list[str]:
    """The fields of a segment or a program."""
    return [field.name for field in fields(cls)]


def _numbers(field: str, values: object, count: int | None, expected: str) -> tuple[float, ...]:
    if isinstance(values, np.ndarray):
        values = values.tolist()
    if not isinstance(values, list | tuple) or (
        len(values) != count if count else not 1 <= len(values) <= MOST_VALUES
    ):
        raise InputError(field, values, expected)
    found = tuple(finite_number(f"{field}[{i}]", value, "a finite number") for i, value in enumerate(values))
    for i, value in enumerate(found):
        if abs(value) > _FAR:
            raise InputError(f"{field}[{i}]", value, "a number below a million")
    return found


def _items(field: str, values: object, expected: str) -> tuple[Any, ...]:
    if not isinstance(values, list | tuple):
        raise InputError(field, values, expected)
    return tuple(values)


def _target(field: str, value: Any) -> Target:
    """A target as it is, or made of a pose ``(4, 4)`` or of joint values ``(n,)``."""
    if isinstance(value, JointTarget | PoseTarget):
        return value
    shape = shape_of(value) if isinstance(value, np.ndarray | list | tuple) else ()
    try:
        if shape == _POSE:
            return PoseTarget.of(value)
        if len(shape) == 1:
            return JointTarget(value)
    except InputError as error:
        raise error.renamed(field + error.field.removeprefix("pose").removeprefix("q")) from None
    raise InputError(field, value, "a pose (4, 4), joint values (n,), a PoseTarget or a JointTarget")


def _check_orientation(value: object) -> None:
    if value not in ORIENTATIONS:
        raise InputError("orientation", value, "one of " + ", ".join(f'"{each}"' for each in ORIENTATIONS))


def _check_name(value: object) -> None:
    if not isinstance(value, str) or len(value) > LONGEST_NAME:
        raise InputError("name", value, f"a text of at most {LONGEST_NAME} characters")
