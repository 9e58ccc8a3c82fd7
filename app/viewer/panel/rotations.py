"""How rotations are written: in the read-out, in the form for a typed target, and in what is copied from them.

A notation is a row of numbers. `values` takes them from a rotation matrix ``(3, 3)``, and `matrix` reads them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.exercises.typed import EntryError
from kin import pose_from_xyz_rpy
from kin.transforms import Array, rotation_about, rotation_from_wxyz, rotation_vector, wxyz_from_rotation
from kin.units import general

_LEVEL = 1e-8  # sine of an angle at which two axes coincide; joint values in links have nine decimals
_SHORTEST = 1e-9  # of an axis
# A quaternion typed with three decimals is normalised; one that is further off was mistyped.
_NORM_SLACK = 0.01


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


def _quaternion(order: str) -> Notation:
    first = order.index("w")

    def values(R: Array) -> tuple[float, ...]:
        w, *xyz = wxyz_from_rotation(R).tolist()
        return (w, *xyz) if first == 0 else (*xyz, w)

    def matrix(given: Sequence[float]) -> Array:
        norm = math.hypot(*given)
        if abs(norm - 1.0) > _NORM_SLACK:
            raise EntryError("Not a unit quaternion", f"The norm of {order} is {general(norm, 4)}; valid is 1.")
        return rotation_from_wxyz(np.roll(given, 1 if first else 0))

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
    "Euler Z-Y-Z",
    "α β γ",
    "R = Rz(α)·Ry(β)·Rz(γ)",
    (True,) * 3,
    z_y_z,
    lambda given: (
        rotation_about(np.eye(3)[2], given[0])
        @ rotation_about(np.eye(3)[1], given[1])
        @ rotation_about(np.eye(3)[2], given[2])
    ),
    "0 0 0",
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
ANGLES: Final = {"rpy": RPY, "zyz": ZYZ, "axis": AXIS, "vector": VECTOR}
WXYZ, XYZW = _quaternion("w x y z"), _quaternion("x y z w")
QUATERNIONS: Final = {"wxyz": WXYZ, "xyzw": XYZW}


@dataclass(frozen=True)
class Rotations:
    """The two notations of a page: keys of `ANGLES` and `QUATERNIONS`."""

    angles: str = "rpy"
    quaternions: str = "wxyz"

    @property
    def notation(self) -> Notation:
        return ANGLES[self.angles]

    @property
    def quaternion(self) -> Notation:
        return QUATERNIONS[self.quaternions]


DEFAULT: Final = Rotations()
