"""A robot arm as a table of Denavit–Hartenberg rows.

Each row holds four numbers and leads from one frame to the next. Two orders of the same four elementary motions
are in use, and the same table read in both orders gives two *different* arms:

- ``standard`` (distal, Denavit & Hartenberg 1955): ``A = Rz(θ) Tz(d) Tx(a) Rx(α)``; frame i sits at the far
  end of link i and joint i turns about z of frame i−1.
- ``modified`` (proximal, Craig 1986): ``A = Rx(α) Tx(a) Rz(θ) Tz(d)``; frame i sits on joint i and joint i
  turns about z of frame i.

A revolute joint adds its value to θ, a prismatic one to d; a ``fixed`` row is constant (a tool, an adapter). A row
may *follow* a joint instead of being one: it adds so many times that joint's value (:mod:`kin.joint`).
``T_world_tool = base · A_1 … A_m · tool``. Lengths are metres and angles radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin.errors import InputError, finite_number, one_of
from kin.joint import DEFAULT_LIMITS as DEFAULT_LIMITS
from kin.joint import (
    FOLLOWS,
    PendantMap,
    Shown,
    check_followers,
    checked_pendant,
    expansion,
    joints_of,
    map_of,
    stroke_of,
)
from kin.joint import IDENTITY as IDENTITY
from kin.joint import KIND_CODES as KIND_CODES
from kin.joint import PEAK_FIELDS as PEAK_FIELDS
from kin.joint import Joint as Joint
from kin.joint import Kind as Kind
from kin.joint import Matrix as Matrix
from kin.joint import NominalTable as NominalTable
from kin.motor import Motor, checked_motors
from kin.transforms import Array, as_transform, finite_array
from kin.units import METRES

Convention = Literal["standard", "modified"]
Mounting = Literal["pedestal", "floor", "table", "wall", "ceiling"]
CONVENTIONS: tuple[Convention, ...] = get_args(Convention)
MOUNTINGS: tuple[Mounting, ...] = get_args(Mounting)
LENGTHS = METRES
_ROUNDING = 1e-14  # a rotation further from orthonormal than this is made orthonormal


@dataclass(frozen=True, slots=True)
class Capsule:
    """A part of a link's body: all points within `radius` of a segment that moves with the link.

    Attributes:
        link: 0 for the base, k for the link that joint k moves.
        row: index of the DH row in whose frame the points are; −1 for the frame before the first row.
        start, end: ends of the segment (m) in that frame; a ball if they are the same.
        radius: m.
        assumed: whether the real body is not known.
    """

    link: int
    row: int
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float
    assumed: bool = False


@dataclass(frozen=True, repr=False)
class Robot:
    """A serial arm: immutable, hashable, compared by value. Derived arrays are cached and read-only.

    Attributes:
        id: short name used in URLs, e.g. ``"pioneer5"``.
        rows: all DH rows from base to tool, fixed ones included.
        home: one value per moving joint, inside the limits.
        base, tool: constant transforms before the first and after the last row, as nested tuples.
        units: the length unit of the robot file ("mm", "cm" or "m"), used when the table is displayed.
        maker: who builds or built the arm, "" if it is nobody's product.
        payload, mass: what it may carry and what it weighs (kg), None where they are not known.
        capsules: the bodies of the links as its file states them, none where they are not known; those
            of a URDF are fitted when something asks for them.
        capsules_source: where they are from.
        mounting: what the arm is mounted on, None if that is not stated. How it is turned, `base` states.
        floor: height (m) of the floor in the world frame, None if it is not stated.
        motors: what the motors of the joints read, none if that is not stated. One whose joint is no moving row
            moves nothing: an arm that is made from another may keep its motors.
        pendant: what a pendant shows of joints otherwise than their values, see `kin.motors.to_pendant`. An entry
            that names no joint counts for nothing, for the same reason.
        ros_joints: by the names of joints, what the published description for ROS calls them; the others have the
            same name there.
        nominal: the table from which the arm was calibrated, None for a nominal one. It decides which links are
            compared and how branches are called.

    Raises:
        InputError: an unknown convention, unit or mounting, no moving joint, a row that follows what is no joint
            or leaves it no value, a home of another length, a floor that is no finite number, a base or tool that
            is no rigid transform, motors of one id, or a pendant that does not tell the joint values.
    """

    id: str
    name: str
    source: str
    convention: Convention
    rows: tuple[Joint, ...]
    home: tuple[float, ...]
    description: str = ""
    units: str = "m"
    maker: str = ""
    payload: float | None = None
    mass: float | None = None
    base: Matrix = IDENTITY
    tool: Matrix = IDENTITY
    capsules: Sequence[Capsule] = ()
    capsules_source: str = ""
    mounting: Mounting | None = None
    floor: float | None = None
    motors: tuple[Motor, ...] = ()
    pendant: tuple[Shown, ...] = ()
    ros_joints: tuple[tuple[str, str], ...] = ()
    nominal: NominalTable | None = None

    def __repr__(self) -> str:
        """Id, name and joints in one line; `kin.robot_to_toml` writes out the table."""
        joints = ", ".join(joint.name for joint in self.joints)
        return f"Robot({self.id!r}, {self.name!r}, {self.n} joint{'s' if self.n > 1 else ''}: {joints})"

    def __post_init__(self) -> None:
        """Check the fields; lists become tuples, and arrays become nested tuples."""
        if self.convention not in CONVENTIONS:
            raise InputError("convention", self.convention, one_of(*CONVENTIONS) + " (Craig's)")
        if not isinstance(self.units, str) or self.units not in LENGTHS:
            raise InputError("units", self.units, one_of(*LENGTHS))
        rows = tuple(self.rows) if isinstance(self.rows, Iterable) else ()
        if not any(isinstance(row, Joint) and row.driven for row in rows):
            raise InputError("rows", self.rows, "Joint rows, at least one of them revolute or prismatic")
        for i, row in enumerate(rows):
            if not isinstance(row, Joint):
                raise InputError(f"rows[{i}]", row, "a Joint")
        check_followers(rows)
        object.__setattr__(self, "rows", rows)
        home = self.check_q(self.home, "home")
        if home.ndim != 1:
            raise InputError("home", f"shape {home.shape}", f"one configuration of {self.n} values")
        object.__setattr__(self, "home", tuple(home.tolist()))
        for key in ("payload", "mass"):
            if (value := getattr(self, key)) is not None:
                if not (weight := finite_number(key, value)) > 0.0:
                    raise InputError(key, value, "a positive number of kg, or None if it is not known")
                object.__setattr__(self, key, weight)
        if self.mounting is not None and (not isinstance(self.mounting, str) or self.mounting not in MOUNTINGS):
            raise InputError("mounting", self.mounting, one_of(*MOUNTINGS) + ", or None if it is not stated")
        if self.floor is not None:
            object.__setattr__(self, "floor", finite_number("floor", self.floor))
        object.__setattr__(self, "motors", checked_motors(self.motors))
        object.__setattr__(self, "pendant", checked_pendant(self.pendant))
        if self.pendant:
            _ = self.pendant_map
        for key in ("base", "tool"):
            object.__setattr__(self, key, _nested(getattr(self, key), key))
        if self.nominal is not None:
            nominal = NominalTable(tuple(self.nominal.rows), _nested(self.nominal.tool, "nominal.tool"))
            object.__setattr__(self, "nominal", nominal)

    @classmethod
    def from_dh(
        cls,
        rows: Iterable[Joint | Mapping[str, Any] | Sequence[float]],
        convention: Convention = "standard",
        *,
        robot_id: str = "arm",
        name: str = "Arm",
        source: str = "a table in Python",
        home: Iterable[float] | None = None,
        base: ArrayLike = IDENTITY,
        tool: ArrayLike = IDENTITY,
    ) -> Robot:
        """An arm from a DH table in metres and radians.

        Args:
            rows: each ``(theta, d, a, alpha)`` of a revolute joint, or a dict with fields of `Joint`, or a
                `Joint`. Without limits a revolute joint turns ±π and a prismatic one slides 0 to 1 m; what
                follows a joint has those that the joint leaves it.
            convention: ``"standard"`` or ``"modified"`` (Craig).
            robot_id, name, source: as in a robot file.
            home: one value per moving joint, radians (metres); by default the middle of the limits.
            base, tool: constant transforms ``(4, 4)`` before the first and after the last row.

        Returns:
            The arm.

        Raises:
            InputError: an invalid row or field.

        Examples:
            >>> import kin
            >>> arm = kin.Robot.from_dh([(0.0, 0.0, 0.5, 0.0), (0.0, 0.0, 0.3, 0.0)])
            >>> kin.fk(arm, [0.0, 0.0])[:3, 3]
            array([0.8, 0. , 0. ])
        """
        table = tuple(_row(i, row) for i, row in enumerate(rows))
        if home is None:
            home = [0.5 * sum(joint.limits or (0.0,)) for joint in joints_of(table)]
        transforms: dict[str, Any] = {"base": base, "tool": tool}
        return cls(robot_id, name, source, convention, table, tuple(home), **transforms)

    def with_base(self, T_world_base: ArrayLike) -> Robot:
        """The same arm with another transform before its first row: where it stands in the world frame.

        Args:
            T_world_base: ``(4, 4)``, metres.

        Returns:
            An arm whose poses, targets and Jacobians are in the world frame.

        Raises:
            InputError: what is given is no rigid transform.

        Examples:
            >>> import kin
            >>> arm = kin.get_robot("planar2r").with_base(kin.pose_from_xyz_rpy([0.0, 0.0, 0.5]))
            >>> kin.fk(arm, [0.0, 0.0])[:3, 3]
            array([1.6, 0. , 0.5])
        """
        return replace(self, base=as_transform(T_world_base, "T_world_base"))  # type: ignore[arg-type]

    def with_tool(self, T_last_tool: ArrayLike) -> Robot:
        """The same arm with another transform after its last row: it replaces the tool of the arm.

        Args:
            T_last_tool: ``(4, 4)`` of the tool in the frame of the last row, metres.

        Returns:
            An arm whose poses are those of the tool.

        Raises:
            InputError: what is given is no rigid transform.

        Examples:
            >>> import kin
            >>> arm = kin.get_robot("planar2r").with_tool(kin.pose_from_xyz_rpy([0.1, 0.0, 0.0]))
            >>> kin.fk(arm, [0.0, 0.0])[:3, 3]
            array([1.7, 0. , 0. ])
        """
        tool: Any = as_transform(T_last_tool, "T_last_tool")
        nominal = self.nominal
        if nominal is not None:
            moved: Any = np.asarray(nominal.tool) @ np.linalg.solve(self.T_last_tool, tool)
            nominal = replace(nominal, tool=moved)
        return replace(self, tool=tool, nominal=nominal)

    def with_mounted(self, T_tool_mounted: ArrayLike) -> Robot:
        """The same arm with a further tool on its tool, as the field `tool` of REST requests mounts one.

        Args:
            T_tool_mounted: ``(4, 4)`` of the further tool in the frame of the arm's tool, metres.

        Returns:
            An arm whose poses are those of what is mounted.

        Raises:
            InputError: what is given is no rigid transform.

        Examples:
            >>> import kin
            >>> gripper = kin.pose_from_xyz_rpy([0.0, 0.0, 0.12])
            >>> twice = kin.get_robot("ur5").with_mounted(gripper).with_mounted(gripper)
            >>> twice.T_last_tool[:3, 3]
            array([0.  , 0.  , 0.24])
        """
        return self.with_tool(self.T_last_tool @ as_transform(T_tool_mounted, "T_tool_mounted"))

    @cached_property
    def _hash(self) -> int:
        return hash((self.id, self.convention, self.rows, self.home, self.base, self.tool))

    def __hash__(self) -> int:
        return self._hash

    def __getstate__(self) -> dict[str, object]:
        """The fields only: cached values, some of them compiled functions, are computed again after unpickling."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """The rows that move by themselves, in order; q[i] is the value of joints[i].

        Their limits are the *effective* ones, which keep the limits of the rows that follow them too.
        """
        return joints_of(self.rows)

    @property
    def ros_names(self) -> list[str]:
        """The names of the joints for ROS."""
        found = dict(self.ros_joints)
        return [found.get(joint.name, joint.name) for joint in self.joints]

    @property
    def n(self) -> int:
        """Number of joints: rows that move by themselves."""
        return len(self.joints)

    @cached_property
    def q_shape(self) -> tuple[int]:
        """Shape of one configuration."""
        return (self.n,)

    @cached_property
    def joint_rows(self) -> tuple[int, ...]:
        """Row index of each joint."""
        return tuple(i for i, row in enumerate(self.rows) if row.driven)

    @cached_property
    def moving_rows(self) -> tuple[int, ...]:
        """Indices of all rows that move: of the joints, and of what follows them."""
        return tuple(i for i, row in enumerate(self.rows) if row.moves)

    @property
    def coupled(self) -> bool:
        """Whether some rows follow joints."""
        return len(self.moving_rows) > self.n

    @cached_property
    def expansion(self) -> Array:
        """A ``(m, n)``: ``A q`` are the values of all moving rows; the identity if none follows a joint."""
        return _frozen(expansion(self.rows))

    @cached_property
    def free(self) -> Robot:
        """The arm in which every moving row moves by itself, with m joints; itself if none follows a joint.

        Its poses at `expand(q)` are those of this arm at q.
        """
        if not self.coupled:
            return self
        rows = tuple(replace(row, follows="", ratio=1.0) if row.follows else row for row in self.rows)
        return replace(self, rows=rows, home=tuple(self.expand(self.q_home).tolist()))

    def expand(self, q: Array) -> Array:
        """The values of all moving rows.

        Args:
            q: ``(..., n)`` configurations, radians (metres).

        Returns:
            ``(..., m)``: those of the joints, and of the rows that follow them, in the order of the rows.

        Examples:
            >>> import kin
            >>> kin.get_robot("palletiser").expand([0.0, 0.1, 0.3, 0.5]) + 0.0
            array([ 0. ,  0.1, -0.1,  0.3, -0.3,  0.5])
        """
        return q if not self.coupled else np.asarray(q) @ self.expansion.T

    @cached_property
    def nominal_arm(self) -> Robot | None:
        """The arm with its nominal table and the same bodies; None where there is none, or its rows are others."""
        if self.nominal is None:
            return None
        places = {row.name: i for i, row in enumerate(self.nominal.rows)}
        tables = (self.rows, self.nominal.rows)
        own, nominal = ([(row.name, row.kind, row.follows) for row in rows if row.moves] for rows in tables)
        at = [places.get(self.rows[each.row].name, -2) if each.row >= 0 else -1 for each in self.capsules]
        if own != nominal or -2 in at:
            return None
        capsules = tuple(replace(each, row=row) for each, row in zip(self.capsules, at, strict=True))
        return replace(self, rows=self.nominal.rows, tool=self.nominal.tool, capsules=capsules, nominal=None)

    @cached_property
    def leads(self) -> NDArray[np.bool_]:
        """Whether rows follow each joint ``(n,)``."""
        return _flags(any(row.follows == joint.name for row in self.rows) for joint in self.joints)

    @cached_property
    def pendant_map(self) -> PendantMap | None:
        """What a pendant shows of the joints; None if it shows their values."""
        return map_of(self.joints, self.pendant) if self.pendant else None

    @property
    def turns_as_one(self) -> bool:
        """Whether joint 1 turns the whole arm about its axis: it is revolute, and no other row follows it."""
        return self.joints[0].kind == "revolute" and not self.leads[0]

    @cached_property
    def whole_turns(self) -> NDArray[np.bool_]:
        """Whether a whole turn of each joint changes no pose ``(n,)``: what follows it makes whole turns too."""
        turns = {joint.name: joint.kind == "revolute" for joint in self.joints}
        for row in self.rows:
            if row.follows:
                turns[row.follows] &= row.kind == "revolute" and row.ratio.is_integer()
        return _flags(turns.values())

    @cached_property
    def lower(self) -> Array:
        """Lower limits ``(n,)``, −inf where there is none."""
        return _frozen([-math.inf if j.limits is None else j.limits[0] for j in self.joints])

    @cached_property
    def upper(self) -> Array:
        """Upper limits ``(n,)``, +inf where there is none."""
        return _frozen([math.inf if j.limits is None else j.limits[1] for j in self.joints])

    @cached_property
    def revolute(self) -> NDArray[np.bool_]:
        """Whether each joint is revolute ``(n,)``."""
        return _flags(joint.kind == "revolute" for joint in self.joints)

    @cached_property
    def q_home(self) -> Array:
        """The home configuration ``(n,)``."""
        return _frozen(self.home)

    @cached_property
    def T_world_base(self) -> Array:
        """The constant transform before the first row ``(4, 4)``."""
        return _frozen(self.base)

    @cached_property
    def T_last_tool(self) -> Array:
        """The constant transform after the last row ``(4, 4)``."""
        return _frozen(self.tool)

    @cached_property
    def model(self) -> Array:
        """The arm as one flat array for the compiled kernels; for its layout see `kin.kernels.fk`."""
        header = [float(len(self.rows)), float(self.n), float(self.convention == "modified")]
        header += self.T_world_base[:3].ravel().tolist() + self.T_last_tool[:3].ravel().tolist()
        indices = {joint.name: float(i) for i, joint in enumerate(self.joints)}
        q_index = 0
        body: list[float] = []
        for row in self.rows:
            ca, sa = exact_cos_sin(row.alpha)
            body += [row.theta, row.d, row.a, ca, sa]
            if row.follows:
                ratio = row.ratio
                body += [KIND_CODES[row.kind] + FOLLOWS, indices[row.follows]]
            else:
                ratio = 1.0
                body += [KIND_CODES[row.kind], float(q_index * row.driven)]
                q_index += row.driven
            body += [ratio * (row.kind == "revolute"), ratio * (row.kind == "prismatic")]
        return _frozen(header + body)

    @cached_property
    def reach(self) -> float:
        """An upper bound in metres on the distance of the tool from the first frame, including strokes."""
        total = float(np.linalg.norm(self.T_last_tool[:3, 3]))
        for row in self.rows:
            stroke = 0.0
            if row.kind == "prismatic":
                stroke = stroke_of(row, self.joints)
            total += math.hypot(row.a, abs(row.d) + stroke)
        return total

    def check_q(self, q: ArrayLike, field: str = "q") -> Array:
        """Joint values as an array.

        Args:
            q: ``(..., n)`` values of the moving joints, radians (metres).
            field: the name used in messages.

        Returns:
            A float array ``(..., n)``.

        Raises:
            InputError: another number of joints, which it names, or values that are not finite.

        Examples:
            >>> import kin
            >>> kin.get_robot("planar2r").check_q([0, 1])
            array([0., 1.])
        """
        try:
            return finite_array(field, q, (self.n,))
        except InputError as error:
            if error.field == field:
                unit = "radians" if self.revolute.all() else "radians or metres"
                raise InputError(field, error.value.strip("'"), f"{self.n} joint values in {unit}") from None
            raise

    def in_limits(self, q: ArrayLike, slack: float = 0.0) -> NDArray[np.bool_]:
        """Whether configurations respect the joint limits.

        Args:
            q: ``(..., n)`` configurations, radians (metres).
            slack: how far outside still counts as inside, radians (metres).

        Returns:
            ``(...)`` booleans.

        Raises:
            InputError: as `check_q`.

        Examples:
            >>> import kin
            >>> kin.get_robot("planar2r").in_limits([[0.0, 0.0], [9.0, 0.0]])
            array([ True, False])
        """
        q = self.check_q(q)
        return np.asarray(((q >= self.lower - slack) & (q <= self.upper + slack)).all(axis=-1))

    def clip(self, q: ArrayLike) -> Array:
        """Configurations moved inside the joint limits, each joint to its nearest value.

        Args:
            q: ``(..., n)`` configurations, radians (metres).

        Returns:
            ``(..., n)``.

        Raises:
            InputError: as `check_q`.

        Examples:
            >>> import kin
            >>> kin.get_robot("planar2r").clip([9.0, 0.5]).round(4)
            array([3.1416, 0.5   ])
        """
        return np.clip(self.check_q(q), self.lower, self.upper)

    def random_q(self, rng: np.random.Generator, size: int | tuple[int, ...] = ()) -> Array:
        """Random configurations, uniform inside the limits; an unlimited joint draws from ±π.

        Args:
            rng: that they are drawn from: the same seed gives the same configurations.
            size: how many, or a shape; by default one.

        Returns:
            ``(*size, n)`` radians (metres).

        Examples:
            >>> import kin, numpy as np
            >>> kin.get_robot("ur5").random_q(np.random.default_rng(1), 10).shape
            (10, 6)
        """
        shape = (size,) if isinstance(size, int) else size
        lower = np.where(np.isfinite(self.lower), self.lower, -math.pi)
        upper = np.where(np.isfinite(self.upper), self.upper, math.pi)
        return rng.uniform(lower, upper, (*shape, self.n))


def _nested(T: Matrix, field: str) -> Matrix:
    """A rigid transform as nested tuples; its rotation is made orthonormal if it is far from that."""
    if T is IDENTITY:
        return T
    clean = as_transform(T, field)
    rows: Iterable[Iterable[float]] = clean if np.abs(clean - np.asarray(T)).max() > _ROUNDING else T
    return tuple(tuple(map(float, row)) for row in rows)


def _row(index: int, row: Joint | Mapping[str, Any] | Sequence[float]) -> Joint:
    """One row of `Robot.from_dh`."""
    if isinstance(row, Joint):
        return row
    if not isinstance(row, Mapping):
        try:
            theta, d, a, alpha = row
        except (TypeError, ValueError):
            raise InputError(f"rows[{index}]", row, "four numbers theta, d, a, alpha, or a dict") from None
        row = {"theta": theta, "d": d, "a": a, "alpha": alpha}
    known = [f.name for f in fields(Joint)]
    for key in row:
        if key not in known:
            raise InputError(f"rows[{index}].{key}", row[key], "only the fields " + ", ".join(known))
    kind = row.get("kind", "revolute")
    limits = None if row.get("follows") else DEFAULT_LIMITS.get(str(kind))
    defaults = {"name": f"joint {index + 1}", "limits": limits}
    return Joint(**{**defaults, **row})


def exact_cos_sin(angle: float) -> tuple[float, float]:
    """Cosine and sine, exact at multiples of 90°, as most DH twists are (in floats cos(π/2) is 6e-17)."""
    quarter = angle / (math.pi / 2)
    if abs(quarter - round(quarter)) < 1e-15 * max(1.0, abs(quarter)):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    return math.cos(angle), math.sin(angle)


def _flags(values: Iterable[bool]) -> NDArray[np.bool_]:
    mask = np.array(list(values), dtype=bool)
    mask.flags.writeable = False
    return mask


def _frozen(values: ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array
