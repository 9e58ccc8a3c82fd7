"""Reads what visitors type: joint values, cells of tables and target poses.

An error names what is wrong and what is valid. Numbers are in the units on screen unless a unit follows them;
`kin.typed` reads each.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from typing import Literal

import numpy as np

from app.exercises.typed import EntryError
from app.viewer.panel.rotations import DEFAULT, Notation, Rotations
from kin import InputError, KinematicsError, Task
from kin.transforms import Array, as_transform, frame_from_approach
from kin.typed import ReadError, cut, elements, example, interpret, read, read_element, unit_at_end
from kin.units import LENGTH_UNITS, PLAIN, Unit, Units, general

PoseKind = Literal["position", "angles", "quaternion", "pose"]
_UR_POSE = re.compile(r"p\[([^\[\]]*)\]", re.IGNORECASE)  # of a UR arm: metres and radians
ALONG = "along"  # between a point and a direction
SHORTEST = 1e-9  # of a direction
OPPOSITE = -0.999  # cosine of an angle near a half turn
FARTHEST = 1000.0  # m: the largest coordinate of a target or a camera
LARGEST = 1e6  # rad or m: a value in a table, as in robot files
LIKE_METRES = 5.0  # the coordinates of a matrix on a screen in mm or cm look like metres below this
LIMIT_DIGITS = 2  # decimals of a degree or a millimetre in which limits are shown
# Matrices copied from a screen have few decimals.
_MATRIX_SLACK = 2e-3


def read_value(text: str, name: str, unit: Unit, limits: tuple[float, float]) -> float:
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
    valid = f"Valid: {general(low, 10)} … {general(high, 10)}{unit.suffix}."
    slack = 1e-9 * max(1.0, abs(low), abs(high))
    try:
        value = read(text, unit, (unit.read(low - slack), unit.read(high + slack)))
    except ReadError as error:
        raise EntryError(title, f"{error.sentence} {valid}", error.readings) from None
    if not low - slack <= value * unit.scale <= high + slack:
        raise EntryError(title, f"“{cut(text)}” is outside the limits of this joint. {valid}")
    # The shown limit may be rounded outwards.
    return min(max(value, limits[0]), limits[1])


def read_cell(text: str, unit: Unit) -> float:
    """A cell of a table in radians or metres; raises `ReadError`, whose reason says what is valid."""
    try:
        return read(text, unit, largest=LARGEST)
    except ReadError as error:
        raise ReadError(
            error.reason if error.readings else f"{error.reason}; try {example(unit)}", error.readings
        ) from None


def read_pose(
    kind: PoseKind, text: str, units: Units, T: Array, rotations: Rotations = DEFAULT
) -> tuple[Array, Task]:
    """A typed target.

    Args:
        kind: what was typed: ``"position"`` x y z, ``"angles"`` such as roll pitch yaw, ``"quaternion"``, or
            a whole ``"pose"``: 3 numbers (a point), 6 or 7 (with a rotation), 12 or 16 (a matrix), a point, the
            word *along* and the direction of the tool, or UR's ``p[x, y, z, rx, ry, rz]`` in metres and radians.
        rotations: how rotations are typed. With axis and angle, 7 numbers are a point, an axis and an angle.
        T: the present target pose ``(4, 4)``; what was not typed is taken from it.

    Returns:
        The target pose ``(4, 4)``, and what of it was given.

    Raises:
        EntryError: with what is wrong.
    """
    try:
        return interpret(text, lambda way: _pose(kind, way, units, T.copy(), rotations), _same)
    except EntryError:
        raise
    except ReadError as error:
        detail = error.sentence if error.readings else f"{error.sentence} Valid: {_valid(kind, units, rotations)}."
        raise EntryError("The target was not changed", detail, error.readings) from None


def _valid(kind: PoseKind, units: Units, rotations: Rotations) -> str:
    """What is valid for this kind of target."""
    turned, quaternion = rotations.notation, rotations.quaternion
    counts = {3 + len(turned.turns): f"x y z {turned.names}"}
    counts.setdefault(7, f"x y z and a quaternion {quaternion.names}")
    listed = ", ".join(f"{count} ({what})" for count, what in counts.items())
    return {
        "position": f"x y z in {units.lengths.name}",
        "angles": f"{turned.names} in {units.angles.name}, with {turned.definition}",
        "quaternion": f"a quaternion {quaternion.names}, {quaternion.definition.partition(', ')[2]}",
        "pose": f"3 numbers (x y z, point only), {listed}, 12 or 16 (a 3×4 or 4×4 matrix), "
        "p[x, y, z, rx, ry, rz] in m and rad, or x y z along x y z (a point and the direction of the tool)",
    }[kind]


def _same(one: tuple[Array, Task], other: tuple[Array, Task]) -> bool:
    return one[1] == other[1] and np.allclose(one[0], other[0], rtol=0.0, atol=1e-12)


def _pose(kind: PoseKind, text: str, units: Units, pose: Array, rotations: Rotations) -> tuple[Array, Task]:
    """`read_pose` of a text in which a comma only separates; raises `ReadError`."""
    if kind == "pose" and (found := _UR_POSE.fullmatch(text.strip())):
        text, rotations, units = found[1], Rotations("vector"), Units(degrees=False, length="m")
        if (count := len(elements(text))) != 6:
            detail = f"Found {count}. Valid: p[x, y, z, rx, ry, rz] in m and rad."
            raise EntryError("Six numbers are needed in p[…]", detail)
    lengths = [units.lengths] * 3
    point, along, direction = text.partition(ALONG)
    if kind == "pose" and along:
        return _approach(elements(point), elements(direction), lengths, pose), "approach"
    if kind == "pose" and (read_matrix := _matrix_text(text)) is not None:
        return _matrix(text, *read_matrix, units), "pose"
    words = elements(text)
    turned, quaternion = rotations.notation, rotations.quaternion
    count = {"position": 3, "angles": len(turned.turns), "quaternion": 4}.get(kind, len(words))
    valid = f"Found {len(words)}. Valid: {_valid(kind, units, rotations)}."
    if len(words) != count:
        raise EntryError(f"{count} numbers are needed here", valid)
    if kind in ("angles", "quaternion"):
        typed = turned if kind == "angles" else quaternion
        pose[:3, :3] = typed.matrix(_values(words, _units_of(typed, units)))
        return pose, "pose"
    if len(words) == 3:
        pose[:3, 3] = _position(_values(words, lengths))
        return pose, "position" if kind == "pose" else "pose"
    written = next((each for each in (turned, quaternion) if len(words) == 3 + len(each.turns)), None)
    if written is None:
        raise EntryError("The target needs another count of numbers", valid)
    values = _values(words, lengths + _units_of(written, units))
    pose[:3, :3] = written.matrix(values[3:])
    pose[:3, 3] = _position(values[:3])
    return pose, "pose"


def _units_of(notation: Notation, units: Units) -> list[Unit]:
    return [units.angles if turn else PLAIN for turn in notation.turns]


def _values(words: Sequence[str], units: Sequence[Unit]) -> list[float]:
    """The numbers of a list in radians, metres or as they are.

    Raises:
        ReadError: a wrong number; or a unit follows only the last of several lengths or angles, which may hold for
            that one or for all of them.
    """
    values = [read_element(word, unit) for word, unit in zip(words, units, strict=True)]
    at = 0
    for unit, group in itertools.groupby(units):
        first, at = at, at + len(list(group))
        *rest, last = words[first:at]
        name = unit_at_end(last)
        if not name or name == unit.name or any(map(unit_at_end, rest)):
            continue
        shared = [read_element(f"{word} {name}", unit) for word in rest]
        if not np.allclose(shared, values[first : at - 1], rtol=1e-9, atol=0.0):
            ways = [[*(f"{word} {each}" for word in rest), last] for each in (name, unit.name)]
            readings = tuple(" ".join([*words[:first], *way, *words[at:]]) for way in ways)
            shown = " or ".join(f"“{reading}”" for reading in readings)
            raise ReadError(f"“{name}” after the last number may hold for all; type {shown}", readings)
    return values


def _approach(point: list[str], along: list[str], lengths: list[Unit], pose: Array) -> Array:
    """The pose at a point with the tool along a direction, turned no more than it takes."""
    if len(point) != 3 or len(along) != 3:
        detail = f"Found {len(point)} before and {len(along)} after “{ALONG}”. Valid: x y z along x y z."
        raise EntryError("A point and a direction are needed", detail)
    pose[:3, 3] = _position(_values(point, lengths))
    direction = _values(along, [PLAIN] * 3)
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


def _position(values: list[float]) -> Array:
    position = np.array(values)
    _check_distance(position)
    return position


def _check_distance(position: Array) -> None:
    if np.abs(position).max() > FARTHEST:
        raise EntryError("The target is too far away", f"Coordinates are valid up to {FARTHEST:g} m.")


def _matrix_text(text: str) -> tuple[list[str], str] | None:
    """The numbers of a matrix and the unit after them, if any; None if the text has another count of numbers."""
    name = unit_at_end(text) if unit_at_end(text) in LENGTH_UNITS else ""
    words = elements(text.removesuffix(name))
    return (words, name) if len(words) in (12, 16) else None


def _matrix(text: str, words: list[str], name: str, units: Units) -> Array:
    """The pose of a matrix. Its lengths are in the unit on screen unless they, or the whole, have another one."""
    unit = LENGTH_UNITS[name] if name else units.lengths
    layout = [PLAIN, PLAIN, PLAIN, unit] * 3 + [PLAIN] * (len(words) - 12)
    numbers = [read_element(word, each) for word, each in zip(words, layout, strict=True)]
    T = np.array([*numbers, 0.0, 0.0, 0.0, 1.0][:16]).reshape(4, 4)
    R = T[:3, :3]
    off = float(np.abs(R.T @ R - np.eye(3)).max())
    if off > _MATRIX_SLACK:
        detail = f"Its columns must be orthonormal; RᵀR differs from the identity by {general(off, 2)}."
        raise EntryError("The first three columns are not a rotation", detail)
    U, _, Vt = np.linalg.svd(R)
    T[:3, :3] = U @ Vt
    try:
        T = as_transform(T, "matrix")
    except (InputError, KinematicsError) as error:
        raise EntryError("Not the matrix of a pose", str(error)) from None
    lengths = words[3:12:4]
    like_metres = 0.0 < unit.scale * np.abs(T[:3, 3]).max() < LIKE_METRES
    if like_metres and not name and unit.name != "m" and not any(map(unit_at_end, lengths)):
        raise ReadError(
            f"the lengths {', '.join(lengths)} of the matrix look like metres; the unit on screen is "
            f"{unit.name}. Type m or {unit.name} after the matrix",
            (f"{text} m", f"{text} {unit.name}"),
        )
    _check_distance(T[:3, 3])
    return T
