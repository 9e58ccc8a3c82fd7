"""How rotations are written: angles, rotation vectors and quaternions, of textbooks and on makers' pendants.

A notation is a row of numbers. `values` takes them from a rotation matrix ``(3, 3)``, and `matrix` reads them.
Makers agree on few things: KUKA's and Mitsubishi's A B C are the same three turns in opposite orders, Doosan's are
others, and Stäubli's Rx Ry Rz turn about moving axes where Yaskawa's turn about fixed ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from kin.errors import InputError
from kin.frames import pose_from_xyz_rpy
from kin.poses.quaternions import rotation_from_wxyz
from kin.transforms import Array, rotation_about, rotation_vector, wxyz_from_rotation
from kin.typed import EntryError
from kin.units import general

_LEVEL = 1e-8  # sine of an angle at which two axes coincide; joint values in links have nine decimals
_SHORTEST = 1e-9  # of an axis


@dataclass(frozen=True)
class Notation:
    """One way to write a rotation.

    Attributes:
        title: its name in a menu.
        names: of the numbers, separated by spaces.
        definition: what they mean, in one line.
        turns: which of them are angles (rad).
        values, matrix: the numbers of a rotation, and the rotation of numbers; `matrix` raises `EntryError`.
        none: the numbers of no rotation, as typed.
    """

    title: str
    names: str
    definition: str
    turns: tuple[bool, ...]
    values: Callable[[Array], tuple[float, ...]]
    matrix: Callable[[Sequence[float]], Array]
    none: str


def roll_pitch_yaw(R: Array) -> tuple[float, float, float]:
    """Angles in radians with ``R = Rz(yaw) Ry(pitch) Rx(roll)``; roll is 0 where pitch is ±90°."""
    level = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], level)
    if level < _LEVEL:
        return 0.0, pitch, math.atan2(-R[0, 1], R[1, 1])
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def z_y_z(R: Array) -> tuple[float, float, float]:
    """Angles in radians with ``R = Rz(α) Ry(β) Rz(γ)``, β from 0 to π; γ is 0 where β is 0 or π."""
    level = math.hypot(R[0, 2], R[1, 2])
    beta = math.atan2(level, R[2, 2])
    if level < _LEVEL:
        return math.atan2(-R[0, 1], R[1, 1]), beta, 0.0
    return math.atan2(R[1, 2], R[0, 2]), beta, math.atan2(R[2, 1], -R[2, 0])


def x_y_z(R: Array) -> tuple[float, float, float]:
    """Angles in radians with ``R = Rx(α) Ry(β) Rz(γ)``; γ is 0 where β is ±90°."""
    level = math.hypot(R[0, 0], R[0, 1])
    beta = math.atan2(R[0, 2], level)
    if level < _LEVEL:
        return math.atan2(R[2, 1], R[1, 1]), beta, 0.0
    return math.atan2(-R[1, 2], R[2, 2]), beta, math.atan2(-R[0, 1], R[0, 0])


def _axis_angle(R: Array) -> tuple[float, ...]:
    vector = rotation_vector(R)
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > _SHORTEST else np.array([0.0, 0.0, 1.0])
    return (*axis.tolist(), angle)


def _about(values: Sequence[float]) -> Array:
    axis = np.array(values[:3])
    if np.linalg.norm(axis) < _SHORTEST:
        raise EntryError("The axis has no length", "kx ky kz are three numbers that are not all zero.")
    return rotation_about(axis, values[3])


def _vector(values: Sequence[float]) -> Array:
    angle = math.hypot(*values)
    return rotation_about(np.array(values), angle) if angle > _SHORTEST else np.eye(3)


def _product(axes: str) -> Callable[[Sequence[float]], Array]:
    """The rotation of angles about these axes, each about the axes that the turns before it have moved."""

    def matrix(given: Sequence[float]) -> Array:
        R = np.eye(3)
        for axis, angle in zip(axes, given, strict=True):
            R = R @ rotation_about(np.eye(3)["xyz".index(axis)], angle)
        return R

    return matrix


def _quaternion(order: str) -> Notation:
    first = order.index("w")

    def values(R: Array) -> tuple[float, ...]:
        w, *xyz = wxyz_from_rotation(R).tolist()
        return (w, *xyz) if first == 0 else (*xyz, w)

    def matrix(given: Sequence[float]) -> Array:
        try:
            return rotation_from_wxyz(np.roll(given, 1 if first else 0))
        except InputError:
            norm = general(math.hypot(*given), 4)
            raise EntryError("Not a unit quaternion", f"The norm of {order} is {norm}; valid is 1.") from None

    where = "last" if first else "first"
    none = "0 0 0 1" if first else "1 0 0 0"
    return Notation(order, order, f"Quaternion, scalar {where}", (False,) * 4, values, matrix, none)


RPY: Final = Notation(
    "roll pitch yaw",
    "roll pitch yaw",
    "R = Rz(yaw)·Ry(pitch)·Rx(roll)",
    (True,) * 3,
    roll_pitch_yaw,
    lambda given: pose_from_xyz_rpy(np.zeros(3), given)[:3, :3],
    "0 0 0",
)
ZYZ: Final = Notation(
    "Euler Z-Y-Z", "α β γ", "R = Rz(α)·Ry(β)·Rz(γ)", (True,) * 3, z_y_z, _product("zyz"), "0 0 0"
)
XYZ: Final = Notation(
    "Euler X-Y-Z", "α β γ", "R = Rx(α)·Ry(β)·Rz(γ)", (True,) * 3, x_y_z, _product("xyz"), "0 0 0"
)
AXIS: Final = Notation(
    "axis and angle",
    "kx ky kz θ",
    "The turn by θ about the axis k",
    (False, False, False, True),
    _axis_angle,
    _about,
    "0 0 1 0",
)
VECTOR: Final = Notation(
    "rotation vector",
    "rx ry rz",
    "The axis times the angle, as in UR's p[x, y, z, rx, ry, rz]",
    (True,) * 3,
    lambda R: tuple(rotation_vector(R).tolist()),
    _vector,
    "0 0 0",
)
KUKA: Final = replace(
    RPY,
    title="A B C (KUKA)",
    names="A B C",
    definition="R = Rz(A)·Ry(B)·Rx(C)",
    values=lambda R: roll_pitch_yaw(R)[::-1],
    matrix=lambda given: RPY.matrix(given[::-1]),
)
FANUC: Final = replace(RPY, title="W P R (FANUC)", names="W P R", definition="R = Rz(R)·Ry(P)·Rx(W)")
FIXED: Final = replace(
    RPY, title="Rx Ry Rz (Yaskawa, Denso)", names="Rx Ry Rz", definition="R = Rz(Rz)·Ry(Ry)·Rx(Rx)"
)
STAUBLI: Final = replace(XYZ, title="Rx Ry Rz (Stäubli)", names="Rx Ry Rz", definition="R = Rx(Rx)·Ry(Ry)·Rz(Rz)")
MITSUBISHI: Final = replace(RPY, title="A B C (Mitsubishi)", names="A B C", definition="R = Rz(C)·Ry(B)·Rx(A)")
DOOSAN: Final = replace(ZYZ, title="A B C (Doosan)", names="A B C", definition="R = Rz(A)·Ry(B)·Rz(C)")
KAWASAKI: Final = replace(ZYZ, title="O A T (Kawasaki)", names="O A T", definition="R = Rz(O)·Ry(A)·Rz(T)")
ANGLES: Final = {
    "rpy": RPY,
    "zyz": ZYZ,
    "axis": AXIS,
    "vector": VECTOR,
    "kuka": KUKA,
    "fanuc": FANUC,
    "fixed": FIXED,
    "staubli": STAUBLI,
    "mitsubishi": MITSUBISHI,
    "doosan": DOOSAN,
    "kawasaki": KAWASAKI,
}
WXYZ, XYZW = _quaternion("w x y z"), _quaternion("x y z w")
ABB: Final = replace(WXYZ, names="q1 q2 q3 q4")
QUATERNIONS: Final = {"wxyz": WXYZ, "xyzw": XYZW}


@dataclass(frozen=True)
class Rotations:
    """The two notations of a page: keys of `ANGLES` and `QUATERNIONS`."""

    angles: str = "rpy"
    quaternions: str = "wxyz"

    @property
    def notation(self) -> Notation:
        """That of the angles."""
        return ANGLES[self.angles]

    @property
    def quaternion(self) -> Notation:
        """That of quaternions."""
        return QUATERNIONS[self.quaternions]


DEFAULT: Final = Rotations()
