"""The tool point of an arm whose table is not trusted, with its derivatives, and the table with errors in it.

Both conventions of Denavit and Hartenberg are made of a joint ``Rz(θ) Tz(d)`` and a link ``Tx(a) Rx(α)``. Here a
link has a fifth number, the tilt β about y (Hayati, Robot arm geometric link parameter estimation, CDC 1983).
Without it the common normal of two almost parallel axes, and with it d and θ, would jump for any small
misalignment. A tilt is written as a fixed row, because ``Ry(β) = Rz(90°) Rx(β) Rz(−90°)``: the table stays near
the nominal one, however parallel two axes are.

Every moving row may have errors in all five numbers, and the tool point in all three coordinates. Some of these
move the tool point alike; which of them gets an error, the tolerances decide (`kin.calibration.model`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.robot import Joint, Robot
from kin.transforms import Array

ErrorKind = Literal["zero", "length", "twist", "tip", "scale", "wave"]
Mask = NDArray[np.bool_]
_FIELDS = ("theta", "d", "a", "alpha", "beta")
_QUARTER = 0.5 * math.pi


class Parameter(NamedTuple):
    """A number that may be wrong.

    Attributes:
        row: name of the row; "" for the tool point and for the common scale.
        field: "theta", "d", "a", "alpha" or "beta" of the row; "sin" or "cos" of the wave of its encoder; "x",
            "y" or "z" of the tool point; "scale".
        kind: which tolerance it has.
        nominal: its value in the table, rad or m.
    """

    row: str
    field: str
    kind: ErrorKind
    nominal: float


class Derivatives(NamedTuple):
    """Tool points ``(k, 3)``, their derivatives by the parameters ``(k, 3, p)`` and by the joints ``(k, 3,
    n)``."""

    points: Array
    by_parameter: Array
    by_joint: Array


@dataclass(frozen=True, eq=False)
class Chain:
    """An arm with errors in its table.

    Attributes:
        waves: whether the encoders of turning joints may have a wave that repeats every turn,
            ``δ_sin sin q + δ_cos cos q``: a magnet beside the axis.
        scale: whether all lengths of the table may be larger by one share, as those of a printed arm are.
    """

    robot: Robot
    waves: bool = False
    scale: bool = False

    @cached_property
    def first(self) -> tuple[int, ...]:
        """Index of the first parameter of each row, −1 for fixed rows."""
        own = len(_FIELDS)
        found, count = [], 0
        for row in self.robot.rows:
            found.append(count if row.moves else -1)
            count += row.moves * (own + 2 * (self.waves and row.kind == "revolute"))
        return tuple(found)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters: of the rows in their order, the common scale, and the tool point."""
        found = []
        for row in self.robot.rows:
            if not row.moves:
                continue
            turns = row.kind == "revolute"
            kinds: tuple[ErrorKind, ...] = ("zero" if turns else "twist", "length", "length", "twist", "twist")
            values = (row.theta, row.d, row.a, row.alpha, 0.0)
            found += [Parameter(row.name, *each) for each in zip(_FIELDS, kinds, values, strict=True)]
            if self.waves and turns:
                found += [Parameter(row.name, wave, "wave", 0.0) for wave in ("sin", "cos")]
        if self.scale:
            found.append(Parameter("", "scale", "scale", 0.0))
        tip = self.robot.T_last_tool[:3, 3].tolist()
        return (*found, *(Parameter("", axis, "tip", value) for axis, value in zip("xyz", tip, strict=True)))

    @cached_property
    def kinds(self) -> NDArray[np.str_]:
        """The kinds of the parameters ``(p,)``."""
        return np.array([each.kind for each in self.parameters])

    def zeros(self, delta: Array) -> Array:
        """The errors of the joints' zeros ``(n,)`` among those of all parameters; 0 for slides."""
        return np.array(
            [delta[self.first[i]] if self.robot.rows[i].kind == "revolute" else 0.0 for i in self.robot.joint_rows]
        )

    def wave(self, q: Array, delta: Array) -> Array:
        """What the waves of the encoders add to readings ``(..., n)``."""
        out = np.zeros_like(q)
        for joint, i in enumerate(self.robot.joint_rows):
            if self.waves and self.robot.rows[i].kind == "revolute":
                at = self.first[i] + len(_FIELDS)
                out[..., joint] = delta[at] * np.sin(q[..., joint]) + delta[at + 1] * np.cos(q[..., joint])
        return out

    def points(self, q: Array, delta: Array) -> Array:
        """Tool points ``(k, 3)`` of configurations ``(k, n)`` with these errors ``(p,)``."""
        return self._run(q, delta, None)

    def derivatives(self, q: Array, delta: Array) -> Derivatives:
        """Tool points, and how the parameters and the joints move them."""
        motions = _Motions([], [], [], [], [])
        tip = self._run(q, delta, motions)
        turns = _cross(np.array(motions.axes), tip - np.array(motions.origins))
        count = len(self.parameters)
        by_parameter = np.zeros((len(q), 3, count + 1))  # fixed rows write to the last column
        by_parameter[:, :, motions.slid] = np.array(motions.slides).transpose(1, 2, 0)
        by_parameter[:, :, motions.turned] = turns.transpose(1, 2, 0)
        by_parameter = by_parameter[:, :, :count]
        rows = [(self.first[i], self.robot.rows[i].kind == "revolute") for i in self.robot.moving_rows]
        by_row = by_parameter[:, :, [first if turning else first + 1 for first, turning in rows]]
        t = self.robot.expand(q)
        for moving, (first, turning) in enumerate(rows):
            if self.waves and turning:
                own, at = by_row[:, :, moving], first + len(_FIELDS)
                by_parameter[:, :, at] = own * np.sin(t[:, moving, None])
                by_parameter[:, :, at + 1] = own * np.cos(t[:, moving, None])
        if self.scale:
            by_parameter[:, :, -4] = self._grown(motions)
        return Derivatives(tip, by_parameter, by_row @ self.robot.expansion if self.robot.coupled else by_row)

    def _grown(self, motions: _Motions) -> Array:
        """How the common scale moves the tool point ``(k, 3)``."""
        lengths = [value for row in self.robot.rows for value in self._in_order(row.d, row.a)]
        return np.asarray(np.einsum("mki,m->ki", np.array(motions.slides[:-3]), np.array(lengths)))

    def _in_order(self, d: float, a: float) -> tuple[float, float]:
        return (d, a) if self.robot.convention == "standard" else (a, d)

    def _run(self, q: Array, delta: Array, motions: _Motions | None) -> Array:
        robot, t = self.robot, self.robot.expand(q)
        R = np.broadcast_to(robot.T_world_base[:3, :3], (len(q), 3, 3))
        p = np.broadcast_to(robot.T_world_base[:3, 3], (len(q), 3))
        grown = 1.0 + (delta[-4] if self.scale else 0.0)
        moving = 0
        for row, first in zip(robot.rows, self.first, strict=True):
            own = np.array([row.theta, row.d * grown, row.a * grown, row.alpha, 0.0])
            angle: float | Array = own[0]
            slide: float | Array = own[1]
            if first >= 0:
                own = own + delta[first : first + len(_FIELDS)]
                value = t[:, moving]
                angle, slide = own[0], own[1]
                if row.kind == "prismatic":
                    slide = slide + value
                else:
                    angle = angle + value
                    if self.waves:
                        sine, cosine = delta[first + 5 : first + 7]
                        angle = angle + sine * np.sin(value) + cosine * np.cos(value)
                moving += 1
            if robot.convention == "standard":
                R, p = _joint(R, p, angle, slide, first, motions)
                R, p = _link(R, p, own, first, motions)
            else:
                R, p = _link(R, p, own, first, motions)
                R, p = _joint(R, p, angle, slide, first, motions)
        if motions is not None:
            motions.slid.extend(len(self.parameters) - 3 + i for i in range(3))
            motions.slides.extend(R[:, :, i] for i in range(3))
        return np.asarray(p + R @ (robot.T_last_tool[:3, 3] + delta[-3:]))

    def robot_with(self, delta: Array, in_motors: Mask | None = None) -> Robot:
        """The arm with its own table.

        Args:
            delta: ``(p,)``.
            in_motors: the joints ``(n,)`` whose zeros are not put into θ.
        """
        robot, rows = self.robot, _Rows(self.robot)
        grown = float(delta[-4]) if self.scale else 0.0
        left = {
            robot.rows[i].name for k, i in enumerate(robot.joint_rows) if in_motors is not None and in_motors[k]
        }
        for row, first in zip(robot.rows, self.first, strict=True):
            t, d, a, alpha, beta = delta[first : first + len(_FIELDS)].tolist() if first >= 0 else [0.0] * 5
            changed = replace(
                row,
                theta=row.theta + (0.0 if row.name in left else t),
                d=row.d * (1.0 + grown) + d,
                a=row.a * (1.0 + grown) + a,
                alpha=row.alpha + alpha,
            )
            rows.add(changed, beta)
        tool = robot.T_last_tool.copy()
        tool[:3, 3] += delta[-3:]
        bodies = tuple(
            replace(each, row=rows.places[each.row] if each.row >= 0 else -1) for each in robot.capsules
        )
        made: dict[str, object] = {"rows": tuple(rows.rows), "tool": rows.back() @ tool, "capsules": bodies}
        return replace(robot, **made)  # type: ignore[arg-type]


class _Motions(NamedTuple):
    """Elementary motions on the way to the tool point.

    Attributes:
        turned, axes, origins: parameters of turns, their axes and a point of each ``(k, 3)``.
        slid, slides: parameters of slides, and their directions ``(k, 3)``.
    """

    turned: list[int]
    axes: list[Array]
    origins: list[Array]
    slid: list[int]
    slides: list[Array]

    def add(self, first: int, turn: int, slide: int, axis: Array, origin: Array) -> None:
        """Keep the turn about an axis and the slide along it; `first` is −1 for fixed rows."""
        if first >= 0:
            self.turned.append(first + turn)
            self.axes.append(axis)
            self.origins.append(origin)
        self.slid.append(first + slide if first >= 0 else -1)
        self.slides.append(axis)


def _joint(
    R: Array, p: Array, angle: float | Array, slide: float | Array, first: int, motions: _Motions | None
) -> tuple[Array, Array]:
    """Frames ``(k, 3, 3)``, ``(k, 3)`` after ``Rz(angle) Tz(slide)``."""
    x, y, z = R[:, :, 0], R[:, :, 1], R[:, :, 2]
    if motions is not None:
        motions.add(first, 0, 1, z, p)
    c, s = np.reshape(np.cos(angle), (-1, 1)), np.reshape(np.sin(angle), (-1, 1))
    return np.stack([x * c + y * s, y * c - x * s, z], axis=2), p + z * np.reshape(slide, (-1, 1))


def _link(R: Array, p: Array, own: Array, first: int, motions: _Motions | None) -> tuple[Array, Array]:
    """Frames after ``Tx(a) Rx(α) Ry(β)``."""
    a, alpha, beta = own[2:].tolist()
    x = R[:, :, 0]
    p = p + a * x
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    if motions is not None:
        motions.add(first, 3, 2, x, p)
        if first >= 0:
            motions.turned.append(first + 4)
            motions.axes.append(R[:, :, 1] * ca + R[:, :, 2] * sa)
            motions.origins.append(p)
    return R @ np.array([[cb, 0.0, sb], [sa * sb, ca, -sa * cb], [-ca * sb, sa, ca * cb]]), p


def _cross(a: Array, b: Array) -> Array:
    """Cross products of vectors ``(..., 3)``; several times faster than NumPy's for few of them."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


class _Rows:
    """The rows of a table with tilts.

    Attributes:
        places: where each row of the nominal table has gone.
        turned: what the next row's θ must take back.
    """

    def __init__(self, robot: Robot) -> None:
        self.standard = robot.convention == "standard"
        self.names = {row.name for row in robot.rows}
        self.rows: list[Joint] = []
        self.places: list[int] = []
        self.turned = 0.0

    def add(self, row: Joint, beta: float) -> None:
        """Add a row with its tilt."""
        row = replace(row, theta=row.theta + self.turned)
        self.turned = 0.0
        if not beta:
            self.places.append(len(self.rows))
            self.rows.append(row)
        elif self.standard:
            self.places.append(len(self.rows))
            self.rows += [row, Joint(self._name(row), _QUARTER, alpha=beta, kind="fixed")]
            self.turned = -_QUARTER
        else:
            self.rows.append(Joint(self._name(row), _QUARTER, a=row.a, alpha=row.alpha, kind="fixed"))
            self.places.append(len(self.rows))
            self.rows.append(replace(row, theta=row.theta - _QUARTER, a=0.0, alpha=beta))

    def back(self) -> Array:
        """What is still to be turned back behind the last row ``(4, 4)``."""
        T = np.eye(4)
        if self.turned:
            T[:2, :2] = [[0.0, 1.0], [-1.0, 0.0]]
        return T

    def _name(self, row: Joint) -> str:
        tries = (f"{row.name}, tilt{number}" for number in ("", *(f" {k}" for k in range(2, 99))))
        name = next(each for each in tries if each not in self.names)
        self.names.add(name)
        return name
