"""Reads poses as people type and paste them: lists of numbers, matrices, and what stands on a maker's pendant.

A text is read in this order:

1. The name of a form in front of it, or the one that the reader was given, says how its numbers are meant.
2. Numbers with labels, ``X 600 Y 100 Z 300 A 0 B 90 C 0``. Several makers use the same labels. The maker of the
   arm decides between them; else the text is refused, and the error lists the readings, each with its form in
   front.
3. What programs write around numbers, such as ``p[…]``, ``posx(…)`` or a robtarget of RAPID.
4. Otherwise it is a list of numbers: a point (3), a pose (6 or 7), a matrix (12 or 16), or a point, the word
   *along* and a direction.

Numbers whose size is unlikely in their unit are not taken in silence: a matrix in millimetres whose lengths look
like metres, UR's script in millimetres, angles in degrees that look like radians. Again the error lists the
readings.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from typing import Final, Literal

import numpy as np

from kin.differential.task import Task
from kin.errors import InputError, KinematicsError
from kin.poses.forms import FORMS, LABELS, SI, PoseForm, form_named
from kin.poses.rotations import DEFAULT, Notation, Rotations
from kin.transforms import Array, as_transform, frame_from_approach
from kin.typed import (
    EntryError,
    ReadError,
    bound,
    clean,
    cut,
    elements,
    interpret,
    read,
    read_element,
    unit_at_end,
)
from kin.units import LENGTH_UNITS, PLAIN, Unit, Units, general

PoseKind = Literal["position", "angles", "quaternion", "pose"]
Read = tuple[Array, Task]
ALONG = "along"  # between a point and a direction
SHORTEST = 1e-9  # of a direction
OPPOSITE = -0.999  # cosine of an angle near a half turn
FARTHEST = 1000.0  # m: the largest coordinate of a target or a camera
LIKE_METRES = 5.0  # coordinates on a screen in mm or cm look like metres below this
LIKE_MILLIMETRES = 20.0  # coordinates in metres look like millimetres above this
LIKE_RADIANS = 0.5  # angles in degrees with two decimals or more look like radians above this
LIKE_DEGREES = math.tau + 0.1  # angles in radians look like degrees above this
_TITLE = "The target was not changed"
# Matrices copied from a screen have few decimals.
_MATRIX_SLACK = 2e-3
_LABEL = re.compile(
    rf"(?<![a-zµ0-9_.])({'|'.join(sorted(LABELS, key=len, reverse=True))})\s*[:=]?\s*(?=[-+.(]*(?:\d|pi|π))"
)
# What FANUC's programs write between the numbers.
_NOISE = re.compile(r"config\s*:\s*'[^']*'|\bgp\d\s*:|^p\s*\[\d+[^\]]*\]\s*(?=\{)")
_ASSIGNED = r"(?:[a-z_$][\w$.]*\s+){0,4}(?:[a-z_$][\w$.]*\s*:?=\s*)?"  # what stands before a pose in a program
_BEFORE = re.compile(_ASSIGNED + r"[{(\[\s]*")
_AFTER = " \t,;})]"
_NAMED = re.compile(r"([a-z]+)(?:\s*:\s*|\s+)(?=\S)")
_DECIMALS = re.compile(r"\d*\.\d{2,}")
_POINT: Final = ("x", "y", "z")
_COUNTED: Final = {6: "Six", 7: "Seven"}


def read_pose(
    kind: PoseKind,
    text: str,
    units: Units,
    T: Array,
    rotations: Rotations = DEFAULT,
    maker: str = "",
    form: PoseForm | None = None,
) -> Read:
    """A typed target.

    Args:
        kind: what was typed: ``"position"`` x y z, ``"angles"`` such as roll pitch yaw, ``"quaternion"``, or a
            whole ``"pose"`` in any form: 3 numbers (a point), 6 or 7 (with a rotation), 12 or 16 (a matrix), a
            point, the word *along* and the direction of the tool, or a form of a maker.
        units: of numbers without a unit, unless their form has its own.
        T: the present target pose ``(4, 4)``; what was not typed is taken from it.
        rotations: how rotations are typed. With axis and angle, 7 numbers are a point, an axis and an angle.
        maker: of the arm, which decides between forms with the same labels.
        form: that of a whole pose; None: what the text shows.

    Returns:
        The target pose ``(4, 4)``, and what of it was given.

    Raises:
        EntryError: with what is wrong.
    """
    try:
        bound(text)
        if kind == "pose" and (found := _formed(clean(text), units, T, maker, form)) is not None:
            return found
        return interpret(text, lambda way: _pose(kind, way, units, T.copy(), rotations), _same)
    except EntryError:
        raise
    except ReadError as error:
        detail = error.sentence if error.readings else f"{error.sentence} Valid: {_valid(kind, units, rotations)}."
        raise EntryError(_TITLE, detail, error.readings) from None


def pose_from_text(text: str, form: str | None = None, units: Units = SI) -> Array:
    """A pose as it is written by people, or as it stands on a maker's pendant or in a maker's program.

    Args:
        text: such as ``"0.4 0 0.3 1 0 0 0"`` (a point and a quaternion w x y z), ``"0.4 0 0.3 0 1.57 0"`` (a
            point, roll, pitch, yaw), the 12 or 16 numbers of a matrix, ``"p[0.4, 0, 0.3, 0, 3.14, 0]"`` (UR),
            ``"kuka X 600 Y 100 Z 300 A 0 B 90 C 0"``. Its first word may name the form.
        form: that of `pose_to_text` in which the numbers are; None: what the text shows.
        units: of numbers without a unit, where the form has none of its own; by default metres and radians.

    Returns:
        The pose ``(4, 4)``.

    Raises:
        InputError: there is no such form.
        ReadError: the text is no pose, or may mean several; its `readings` are these.

    Examples:
        >>> import kin
        >>> kin.pose_from_text("X 600 Y 100 Z 300 A 0 B 90 C 0", "kuka").round(9)
        array([[ 0. ,  0. ,  1. ,  0.6],
               [ 0. ,  1. ,  0. ,  0.1],
               [-1. ,  0. ,  0. ,  0.3],
               [ 0. ,  0. ,  0. ,  1. ]])
    """
    T, given = read_target(text, form, units)
    if given != "pose":
        raise EntryError("The text is no whole pose", f"“{cut(text)}” has no orientation, or not all of it.")
    return T


def read_target(text: object, form: str | None = None, units: Units = SI, maker: str = "") -> Read:
    """A target pose ``(4, 4)`` and the task that its form implies; `pose_from_text` for points and directions too.

    Raises:
        InputError: no text, or there is no such form.
        ReadError: the text is no target, or may mean several; its `readings` are these.
    """
    if not isinstance(text, str):
        raise InputError("text", text, "a text")
    named = None if form is None else form_named(form)
    try:
        return read_pose("pose", text, units, np.eye(4), maker=maker, form=named)
    except EntryError as error:
        if error.title != _TITLE:
            raise
        raise ReadError(error.detail.removesuffix("."), error.readings) from None


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
        "p[x, y, z, rx, ry, rz] in m and rad, x y z along x y z (a point and the direction of the tool), or "
        "numbers with their names as on a pendant, such as X 600 Y 100 Z 300 A 0 B 90 C 0",
    }[kind]


def _same(one: Read, other: Read) -> bool:
    return one[1] == other[1] and np.allclose(one[0], other[0], rtol=0.0, atol=1e-12)


# -- Forms with a name, labels, or something around their numbers -----------------------------------------------


def _formed(text: str, units: Units, present: Array, maker: str, form: PoseForm | None) -> Read | None:
    """The pose of a cleaned text that shows its form; None for a list of numbers without one."""
    if (named := _NAMED.match(text)) and named[1] in FORMS and (form is None or form.key == named[1]):
        form, text = FORMS[named[1]], text[named.end() :]
    if (labelled := _labelled(text)) is not None:
        if form is None and set(labelled) == set(_POINT):
            T = present.copy()
            T[:3, 3] = _position([read(labelled[name], units.lengths) for name in _POINT])
            return T, "position"
        return _from_labels(text, labelled, units, maker, form)
    for each in FORMS.values() if form is None else (form,):
        if each.pattern and (found := re.fullmatch(_ASSIGNED + each.pattern + r"\s*;?", text)):
            return _listed(each, found[1], units)
    if form is None:
        return None
    if form.key == "matrix":
        return interpret(text, lambda way: (_whole_matrix(way, units), "pose"), _same)
    # What has no p[…] around it is a pose as the pendant shows it.
    return _listed(FORMS["polyscope"] if form.key == "ur" else form, text, units)


def _labelled(text: str) -> dict[str, str] | None:
    """The texts of numbers by their labels; None if x, y and z are not among these."""
    text = _NOISE.sub(" ", text)
    found = list(_LABEL.finditer(text))
    if not {each[1] for each in found} >= set(_POINT) or not _BEFORE.fullmatch(text[: found[0].start()]):
        return None
    ends = [*(each.start() for each in found[1:]), len(text)]
    values: dict[str, str] = {}
    for each, end in zip(found, ends, strict=True):
        if each[1] in values:
            raise EntryError(_TITLE, f"“{each[1]}” is given twice.")
        value = text[each.end() : end].strip(_AFTER)
        values[each[1]] = value.removesuffix(".") if value.endswith("deg.") else value
    return values


def _from_labels(text: str, labelled: dict[str, str], units: Units, maker: str, form: PoseForm | None) -> Read:
    """The pose of labelled numbers: that of the only form which fits, or of the maker's."""
    if form is not None and form.key == "ur":
        form = FORMS["polyscope"]
    asked = [each for each in FORMS.values() if each.names] if form is None else [form]
    fitting = [each for each in asked if each.labels <= set(labelled) <= each.labels | each.besides]
    if not fitting:
        known = "; ".join(dict.fromkeys(" ".join((*_POINT, *each.names)) for each in asked))
        raise EntryError("The numbers have other names", f"Found {' '.join(labelled)}. Valid: {known}.")
    forms = [each for each in fitting if each.maker and each.maker.casefold() in maker.casefold()]
    forms = forms or [each for each in fitting if _has_units_of(each, labelled, units)] or fitting
    found = [_pose_of(each, [labelled[name] for name in (*_POINT, *each.names)], units, read) for each in forms]
    if all(_same(found[0], other) for other in found[1:]):
        return found[0]
    titles, keys = [each.title for each in forms], " or ".join(each.key for each in forms)
    raise EntryError(
        "Several makers write poses so",
        f"These may be numbers of {', '.join(titles[:-1])} or {titles[-1]}; begin with {keys}.",
        tuple(f"{each.key} {text}" for each in forms),
    )


def _has_units_of(form: PoseForm, labelled: dict[str, str], units: Units) -> bool:
    """Whether the angles have units that this maker shows, or none."""
    shown = [{"", unit.name, *(["deg"] if unit.name == "°" else [])} for unit in form.units_of(units)[3:]]
    return all(unit_at_end(labelled[name]) in names for name, names in zip(form.names, shown, strict=True))


def _listed(form: PoseForm, text: str, units: Units) -> Read:
    """The pose of a list of numbers in a form."""
    count = len(form.units_of(units))

    def evaluate(way: str) -> Read:
        words = elements(way)
        if not count <= len(words) <= count + form.spare:
            raise EntryError(
                f"{_COUNTED.get(count, count)} numbers are needed for {form.title}",
                f"Found {len(words)}. Valid: {form.shown}{form.where}.",
            )
        return _pose_of(form, words[:count], units, read_element)

    try:
        return interpret(text, evaluate, _same)
    except EntryError:
        raise
    except ReadError as error:
        readings = tuple(f"{form.key} {reading}" for reading in error.readings)
        detail = error.sentence if readings else f"{error.sentence} Valid: {form.shown}{form.where}."
        raise EntryError(_TITLE, detail, readings) from None


def _pose_of(form: PoseForm, words: Sequence[str], units: Units, number: Callable[[str, Unit], float]) -> Read:
    """The pose of the texts of a form's numbers."""
    given = form.units_of(units)
    values = [number(word, unit) for word, unit in zip(words, given, strict=True)]
    if form.units is None or not form.units.degrees:  # pendants in mm and degrees show nothing else
        _ask_for_units(form.key, words, values, given)
    T = form.pose(values)
    _check_distance(T[:3, 3])
    return T, "pose"


def _ask_for_units(key: str, words: Sequence[str], values: Sequence[float], units: Sequence[Unit]) -> None:
    """Refuse lengths and angles without a unit, whose size is that of another one; raises `EntryError`.

    Args:
        key: of the form, in front of the readings.
        words, values, units: of x, y, z and the numbers of the rotation.
    """
    turns = [k for k, unit in enumerate(units) if unit.is_angle]
    lengths = _other_length(words[:3], values[:3], units[0])
    angles = _other_angle([words[k] for k in turns], [values[k] for k in turns], units[turns[0]]) if turns else ""
    if not lengths and not angles:
        return

    def reading(length: str, angle: str) -> str:
        typed = [
            f"{word} {length if k < 3 else angle}".rstrip() if k < 3 or k in turns else word
            for k, word in enumerate(words)
        ]
        return f"p[{', '.join(typed)}]" if key == "ur" else f"{key} {', '.join(typed)}".lstrip()

    now_length, now_angle = units[0].name if lengths else "", units[turns[0]].name if angles else ""
    readings = [reading(lengths, angles), reading(now_length, now_angle)]
    if angles == "rad" and len(words) == 6:
        readings.append(f"polyscope {', '.join(words)}")  # what UR's pendant shows looks like roll, pitch and yaw
    looks = [f"the {what} look like {unit}" for what, unit in (("lengths", lengths), ("angles", angles)) if unit]
    said = f"{' and '.join(looks)}; type {' or '.join(map(_quoted, readings))}."
    raise EntryError("The unit is not certain", said[:1].upper() + said[1:], tuple(readings))


def _quoted(reading: str) -> str:
    return f"“{reading}”"


def _other_length(words: Sequence[str], values: Sequence[float], unit: Unit) -> str:
    """The unit that lengths seem to be in, if it is another one and none was typed; else ""."""
    largest = max(abs(value) for value in values) * unit.scale
    if any(map(unit_at_end, words)) or not largest:
        return ""
    if unit.name == "m":
        return "mm" if largest > LIKE_MILLIMETRES else ""
    return "m" if largest < LIKE_METRES and any(map(_DECIMALS.search, words)) else ""


def _other_angle(words: Sequence[str], values: Sequence[float], unit: Unit) -> str:
    """The unit that angles seem to be in, if it is another one and none was typed; else ""."""
    size = math.hypot(*values) * unit.scale
    if any(word[-1:].isalpha() or word[-1:] in "°π" for word in words) or any("pi" in word for word in words):
        return ""
    if unit.name == "rad":
        return "deg" if size > LIKE_DEGREES else ""
    turned = [word for word, value in zip(words, values, strict=True) if value]
    exact = bool(turned) and all(map(_DECIMALS.search, turned))
    return "rad" if exact and LIKE_RADIANS <= size <= LIKE_DEGREES else ""


# -- Lists of numbers ------------------------------------------------------------------------------------------


def _pose(kind: PoseKind, text: str, units: Units, pose: Array, rotations: Rotations) -> Read:
    """`read_pose` of a text in which a comma only separates; raises `ReadError`."""
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
    given = lengths + _units_of(written, units)
    values = _values(words, given)
    key = next((form.key for form in FORMS.values() if form.rotation is written), "")
    _ask_for_units(key, words, values, given)
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


def _whole_matrix(text: str, units: Units) -> Array:
    """The pose of a text that is nothing but a matrix."""
    if (found := _matrix_text(text)) is None:
        detail = f"Found {len(elements(text))}. Valid: the numbers of a 3×4 or 4×4 matrix, row by row."
        raise EntryError("12 or 16 numbers are needed for a matrix", detail)
    return _matrix(text, *found, units)


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
