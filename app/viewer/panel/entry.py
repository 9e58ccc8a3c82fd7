"""Reads what visitors type: joint values and target poses. Wrong input is named, with what would be valid.

Numbers are in the units on screen unless a unit follows them. The entries of a matrix are in metres, as in code.
"""

from __future__ import annotations

import math
import re
from typing import Literal

import numpy as np

from app.exercises.typed import ANGLE_UNITS, LENGTH_UNITS, NUMBER, EntryError, clean, cut, number_and_unit
from app.viewer.panel.readout import ANGLES
from kin import InputError, KinematicsError, Task
from kin.transforms import Array, as_transform, frame_from_approach, rotation_from_wxyz
from kin.units import Unit, Units

PoseKind = Literal["position", "angles", "quaternion", "pose"]
ALONG = "along"  # between a point and a direction
SHORTEST = 1e-9  # of a direction
OPPOSITE = -0.999  # cosine of an angle near a half turn
FARTHEST = 1000.0  # m: the largest coordinate of a target or a camera
LIMIT_DIGITS = 2  # decimals of a degree or a millimetre in which limits are shown
# A quaternion typed with three decimals is normalised; one that is further off was mistyped.
_NORM_SLACK = 0.01
# Matrices copied from a screen have few decimals.
_MATRIX_SLACK = 2e-3


def read_value(text: str, name: str, unit: Unit, is_angle: bool, limits: tuple[float, float]) -> float:
    """A typed joint value in radians or metres.

    Args:
        name: of the joint, as on screen.
        unit: of numbers without a unit.
        limits: lower and upper limit (rad or m).

    Raises:
        EntryError: not a number, or outside the limits.
    """
    low, high = (unit.shown(limit, LIMIT_DIGITS) for limit in limits)
    title = f"{name} was not changed"
    valid = f"Valid: {_brief(low)} … {_brief(high)}{unit.suffix}."
    number, suffix = number_and_unit(text, title, valid)
    scales = ANGLE_UNITS if is_angle else LENGTH_UNITS
    if suffix and suffix not in scales:
        raise EntryError(title, f"“{cut(suffix)}” is not a unit of this joint. Valid: {', '.join(scales)}.")
    value = number * scales[suffix] if suffix else unit.read(number)
    shown = value * unit.scale
    slack = 1e-9 * max(1.0, abs(low), abs(high))
    if not low - slack <= shown <= high + slack:
        raise EntryError(title, f"“{cut(text)}” is outside the limits of this joint. {valid}")
    # The shown limit may be rounded outwards.
    return min(max(value, limits[0]), limits[1])


def read_pose(kind: PoseKind, text: str, units: Units, T: Array) -> tuple[Array, Task]:
    """A typed target.

    Args:
        kind: what was typed: ``"position"`` x y z, ``"angles"`` roll pitch yaw, ``"quaternion"`` w x y z, or
            a whole ``"pose"``: 3 numbers (a point), 6 (with roll pitch yaw), 7 (with a quaternion), 12 or 16 (a
            matrix), or a point, the word *along* and the direction of the tool.
        T: the present target pose ``(4, 4)``; what was not typed is taken from it.

    Returns:
        The target pose ``(4, 4)``, and what of it was given.

    Raises:
        EntryError: with what is wrong.
    """
    pose = T.copy()
    point, along, direction = text.partition(ALONG)
    if kind == "pose" and along:
        return _approach(_numbers(point), _numbers(direction), units, pose), "approach"
    numbers = _numbers(text)
    if kind == "pose":
        return _whole_pose(numbers, units, pose)
    if kind == "position":
        _expect(numbers, 3, f"x y z in {units.lengths.name}")
        pose[:3, 3] = _position(numbers, units)
    elif kind == "angles":
        _expect(numbers, 3, f"roll pitch yaw in {units.angles.name}, with {ANGLES}")
        pose[:3, :3] = rotation_from_angles(*(units.angles.read(v) for v in numbers))
    else:
        _expect(numbers, 4, "a quaternion w x y z, scalar first")
        pose[:3, :3] = _rotation(numbers)
    return pose, "pose"


def rotation_from_angles(roll: float, pitch: float, yaw: float) -> Array:
    """The rotation ``(3, 3)`` ``Rz(yaw) Ry(pitch) Rx(roll)`` of angles in radians."""
    (cr, cp, cy), (sr, sp, sy) = ([f(a) for a in (roll, pitch, yaw)] for f in (math.cos, math.sin))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _approach(point: list[float], direction: list[float], units: Units, pose: Array) -> Array:
    """The pose at a point with the tool along a direction, turned no more than it takes."""
    if len(point) != 3 or len(direction) != 3:
        detail = f"Found {len(point)} before and {len(direction)} after “{ALONG}”. Valid: x y z along x y z."
        raise EntryError("A point and a direction are needed", detail)
    pose[:3, 3] = _position(point, units)
    length = math.hypot(*direction)
    if length < SHORTEST:
        raise EntryError("The direction has no length", f"“{ALONG}” needs three numbers that are not all zero.")
    pose[:3, :3] = turned_to(pose[:3, :3], np.array(direction) / length)
    return pose


def turned_to(R: Array, z: Array) -> Array:
    """R ``(3, 3)`` turned by no more than it takes for its third column to be the unit vector z ``(3,)``."""
    now = R[:, 2]
    axis = np.cross(now, z)
    cosine = float(now @ z)
    if cosine < OPPOSITE:  # many axes would do about as well
        return frame_from_approach(z)
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turned: Array = (np.eye(3) + K + K @ K / (1.0 + cosine)) @ R
    return turned


def _whole_pose(numbers: list[float], units: Units, pose: Array) -> tuple[Array, Task]:
    match len(numbers):
        case 3:
            pose[:3, 3] = _position(numbers, units)
            return pose, "position"
        case 6:
            pose[:3, 3] = _position(numbers[:3], units)
            pose[:3, :3] = rotation_from_angles(*(units.angles.read(v) for v in numbers[3:]))
        case 7:
            pose[:3, 3] = _position(numbers[:3], units)
            pose[:3, :3] = _rotation(numbers[3:])
        case 12 | 16:
            pose = _matrix(numbers)
        case count:
            detail = (
                f"Found {count}. Valid: 3 numbers (x y z, point only), 6 (x y z roll pitch yaw), "
                "7 (x y z and a quaternion w x y z), 12 or 16 (a 3×4 or 4×4 matrix in metres), "
                "or x y z along x y z (a point and the direction of the tool)."
            )
            raise EntryError("The target needs another count of numbers", detail)
    return pose, "pose"


def _numbers(text: str) -> list[float]:
    """All numbers in a text; brackets, commas, semicolons and line breaks separate them."""
    words = re.split(r"[\s,;|\[\](){}]+", clean(text))
    found = []
    for word in filter(None, words):
        if NUMBER.fullmatch(word) is None:
            if word in ("array", "np.array"):
                continue
            raise EntryError("The target was not changed", f"“{cut(word)}” is not a number.")
        found.append(float(word))
    if not np.isfinite(found).all():
        raise EntryError("The target was not changed", "A number is too large.")
    return found


def _expect(numbers: list[float], count: int, meaning: str) -> None:
    if len(numbers) != count:
        raise EntryError(f"{count} numbers are needed here", f"Found {len(numbers)}. Valid: {meaning}.")


def _position(numbers: list[float], units: Units) -> Array:
    position = np.array([units.lengths.read(v) for v in numbers])
    _check_distance(position)
    return position


def _check_distance(position: Array) -> None:
    if np.abs(position).max() > FARTHEST:
        raise EntryError("The target is too far away", f"Coordinates are valid up to {FARTHEST:g} m.")


def _rotation(wxyz: list[float]) -> Array:
    norm = math.hypot(*wxyz)
    if abs(norm - 1.0) > _NORM_SLACK:
        raise EntryError("Not a unit quaternion", f"The norm of w x y z is {norm:.4g}; valid is 1.")
    return rotation_from_wxyz(np.array(wxyz))


def _matrix(numbers: list[float]) -> Array:
    T = np.array([*numbers, 0.0, 0.0, 0.0, 1.0][:16]).reshape(4, 4)
    R = T[:3, :3]
    off = float(np.abs(R.T @ R - np.eye(3)).max())
    if off > _MATRIX_SLACK:
        detail = f"Its columns must be orthonormal; RᵀR differs from the identity by {off:.2g}."
        raise EntryError("The first three columns are not a rotation", detail)
    U, _, Vt = np.linalg.svd(R)
    T[:3, :3] = U @ Vt
    try:
        T = as_transform(T, "matrix")
    except (InputError, KinematicsError) as error:
        raise EntryError("Not the matrix of a pose", str(error)) from None
    _check_distance(T[:3, 3])
    return T


def _brief(value: float) -> str:
    return f"{value:.10g}".replace("-", "−")
