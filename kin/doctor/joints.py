"""What can be wrong with one joint: its type, limits, axis, origin, and whether it follows another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from difflib import get_close_matches
from xml.etree.ElementTree import Element

from kin.angles import TURN
from kin.doctor.notes import FindingLog, cut, spelled
from kin.doctor.source import Edit
from kin.files.numbers import LARGEST, number_of
from kin.files.urdf.fields import ignored_of
from kin.files.urdf.tree import MOVING, TYPES, UNIT, UNLIMITED
from kin.units import general

REQUIRED = ("velocity", "effort")
PEAKS = (*REQUIRED, "acceleration", "deceleration", "jerk")
DEGREE = math.pi / 180.0
_MOST_TURNS = 2.0 * TURN + 0.01  # limits of a joint in radians are seldom beyond two turns
_MOST_DEGREES = 1080.0
_LONGEST_SLIDE = 5.0  # metres
_FASTEST = 50.0  # radians per second
_FARTHEST = 20.0  # metres between two joints
_NOT_UNIT = 1e-4
_EXACT, _ROUNDED = 1e-7, 5e-3  # radians between which an angle is a right or half a right one, but rounded
_MOST_ROUNDS = 64  # joints that follow each other


def check_joint(notes: FindingLog, joint: Element, place: str, known: Mapping[str, Element]) -> None:
    """Look at one joint; `known` are all joints by name."""
    kind = _check_type(notes, joint, place)
    turns = kind in ("revolute", "continuous")
    in_degrees = False
    if kind in MOVING:
        in_degrees = _check_limits(notes, joint, place, kind)
        _check_axis(notes, joint, place)
    if kind != "fixed":
        _check_speeds(notes, joint, place, turns, in_degrees)
        _check_mimic(notes, joint, place, known)
    origin = joint.find("origin")
    if origin is not None:
        check_origin(notes, origin, f"{place}: origin")
    for each in ignored_of(joint):
        words = each.words[0].upper() + each.words[1:]
        notes.add(each.element, place, "element", "suspicious", f"{words}.", "Correct it, or leave it out.")


def _check_type(notes: FindingLog, joint: Element, place: str) -> str:
    kind = joint.get("type", "")
    if kind in TYPES:
        return kind
    near = get_close_matches(kind.strip().lower(), TYPES, 1)
    words = f"Its type is “{cut(kind)}”, which URDF does not have." if kind else "It has no type."
    if near:
        edit = notes.source.with_attribute(joint, "type", near[0])
        notes.add(joint, place, "type", "wrong", words, f'Write type="{near[0]}".', edit)
        return near[0]
    notes.add(joint, place, "type", "wrong", words, "Write one of " + ", ".join(TYPES) + ".")
    return kind


def _check_limits(notes: FindingLog, joint: Element, place: str, kind: str) -> bool:
    """Look at lower and upper; returns whether they look like degrees."""
    limit, source = joint.find("limit"), notes.source
    free = source.with_attribute(joint, "type", "continuous")
    if kind == "continuous":
        return False
    if limit is None or not {"lower", "upper"} & set(limit.attrib):
        if kind == "prismatic":
            words = "It slides without lower and upper limits, which URDF requires; 0 to 1 m are assumed."
            notes.add(joint, place, "limit", "suspicious", words, "State them in metres.")
        else:
            words = "It states no limits, which URDF requires of a revolute joint; −180° to 180° are assumed."
            notes.add(joint, place, "limit", "suspicious", words, 'Write type="continuous", which has none.', free)
        return False
    least, most = (number_of(limit.get(key, "0")) for key in ("lower", "upper"))
    if least <= -UNLIMITED[kind] and most >= UNLIMITED[kind]:
        if kind == "revolute":
            words = "Limits of a million or more stand for none."
            notes.add(limit, place, "limit", "suspicious", words, 'Write type="continuous".', free)
        else:
            words = "Limits of kilometres both ways stand for none; 0 to 1 m are assumed."
            notes.add(limit, place, "limit", "suspicious", words, "State them in metres.")
        return False
    found = [notes.numbers(limit, place, key) if key in limit.attrib else [0.0] for key in ("lower", "upper")]
    if found[0] is None or found[1] is None:
        return False
    lower, upper = found[0][0], found[1][0]
    if missing := {"lower", "upper"} - set(limit.attrib):
        words = f"It states no {missing.pop()} limit, which is 0 then."
        notes.add(limit, place, "limit", "suspicious", words, "State both.")
    shown = f"{general(lower)} to {general(upper)}"
    if lower == upper == 0.0:
        assumed = "0 to 1 m are" if kind == "prismatic" else "−180° to 180° are"
        words = f"Both limits are 0, as exporters write where nothing was entered; {assumed} assumed."
        mend = 'State them; if it cannot move, write type="fixed"'
        mend += "." if kind == "prismatic" else ', and if it turns without end, type="continuous".'
        notes.add(limit, place, "limit", "suspicious", words, mend)
        return False
    if lower == upper:
        words = f"Both limits are {general(lower)}: it cannot move, and is read as fixed there."
        mend = "State its limits, or make it fixed, and its value a part of the origin."
        notes.add(limit, place, "limit", "suspicious", words, mend)
        return False
    if lower > upper:
        low = source.with_attribute(limit, "lower", spelled(upper))
        high = source.with_attribute(limit, "upper", spelled(lower))
        words = f"The lower limit is above the upper one: {shown}."
        notes.add(limit, place, "limit", "wrong", words, "Exchange them.", low, high)
        return False
    if kind == "prismatic":
        _check_slide(notes, limit, place, lower, upper)
        return False
    return _check_turns(notes, limit, place, lower, upper, free)


def _check_slide(notes: FindingLog, limit: Element, place: str, lower: float, upper: float) -> None:
    if max(abs(lower), abs(upper)) <= _LONGEST_SLIDE:
        return
    edits = [
        notes.source.with_attribute(limit, key, spelled(value / 1000.0))
        for key, value in (("lower", lower), ("upper", upper))
    ]
    words = f"It slides from {general(lower)} to {general(upper)} m: these look like millimetres."
    mend = f"Write metres, {general(lower / 1000.0)} to {general(upper / 1000.0)}."
    notes.add(limit, place, "millimetres", "suspicious", words, mend, *edits)


def _check_turns(notes: FindingLog, limit: Element, place: str, lower: float, upper: float, free: Edit) -> bool:
    """Look at limits of a turning joint; returns whether they look like degrees. `free` makes it continuous."""
    source, most, shown = notes.source, max(abs(lower), abs(upper)), f"{general(lower)} to {general(upper)}"
    if most > _MOST_DEGREES:
        words = f"Its limits, {shown} rad, are {round(most / TURN)} turns: they stand for none."
        notes.add(limit, place, "limit", "suspicious", words, 'Write type="continuous".', free)
        return False
    whole = all(abs(value / 5.0 - round(value / 5.0)) < 1e-9 for value in (lower, upper))
    turns = all(abs(value / math.pi - round(value / math.pi)) < 2e-3 for value in (lower, upper))
    if turns or not (most > _MOST_TURNS or (whole and most > TURN)):
        return False
    edits = [
        source.with_attribute(limit, key, spelled(value * DEGREE))
        for key, value in (("lower", lower), ("upper", upper))
    ]
    words = f"Its limits, {shown} rad, are {general(most / TURN, 3)} turns: they look like degrees."
    mend = f"Write radians, {general(lower * DEGREE)} to {general(upper * DEGREE)}."
    notes.add(limit, place, "degrees", "suspicious", words, mend, *edits)
    return True


def _check_speeds(notes: FindingLog, joint: Element, place: str, turns: bool, in_degrees: bool) -> None:
    limit, source = joint.find("limit"), notes.source
    if limit is None:
        return
    for key in PEAKS:
        text = limit.get(key)
        if text is None and key in REQUIRED:
            words = f"Its limit states no {key}, which URDF requires."
            edit = source.with_attribute(limit, key, "0")
            notes.add(limit, place, "limit", "suspicious", words, "Write 0 if it is not known.", edit)
        if text is None or (abs(number_of(text)) >= LARGEST and not text.strip().startswith("-")):
            continue  # it stands for none
        values = notes.numbers(limit, place, key)
        if values is None:
            continue
        value = values[0]
        if value == -1.0:
            words = f"Its {key} is -1, as some exporters write where it is not known."
            mend = "Write 0, which stands for that in a URDF."
            notes.add(limit, place, "limit", "suspicious", words, mend, source.with_attribute(limit, key, "0"))
        elif value < 0.0:
            words = f"Its largest {key} is {general(value)}, which is negative: it counts as not known."
            mend = f"Write {general(-value)} if only the sign is wrong, and 0 if it is not known."
            notes.add(limit, place, "limit", "suspicious", words, mend)
        elif key == "velocity" and turns and _FASTEST < value <= _MOST_DEGREES:
            words = f"It may turn at {general(value)} rad/s, {round(value / TURN)} turns in a second."
            mend = f"Write {general(value * DEGREE)} if degrees per second were meant, and 0 if it is not known."
            edits = (source.with_attribute(limit, key, spelled(value * DEGREE)),) if in_degrees else ()
            notes.add(limit, place, "degrees", "suspicious", words, mend, *edits)


def _check_axis(notes: FindingLog, joint: Element, place: str) -> None:
    axis, source = joint.find("axis"), notes.source
    if axis is None or "xyz" not in axis.attrib:
        words = "It states no axis, so that x counts."
        edit = (
            source.with_child(joint, '<axis xyz="1 0 0"/>')
            if axis is None
            else source.with_attribute(axis, "xyz", "1 0 0")
        )
        notes.add(joint, place, "axis", "suspicious", words, 'Write <axis xyz="1 0 0"/>, or the right one.', edit)
        return
    values = notes.numbers(axis, f"{place}: axis", "xyz", 3)
    if values is None:
        return
    length = math.hypot(*values)
    if length < 1e-6:
        notes.add(axis, place, "axis", "wrong", "Its axis is zero.", 'State a direction, as xyz="0 0 1".')
    elif abs(length - 1.0) > _NOT_UNIT:
        unit = [value / length for value in values]
        words = f"Its axis has the length {general(length)}, not 1; only the direction counts here."
        mend = f"Write {' '.join(general(value) for value in unit)}."
        edit = source.with_attribute(axis, "xyz", spelled(*unit))
        notes.add(axis, place, "axis", "suspicious", words, mend, edit)


def check_origin(notes: FindingLog, origin: Element, place: str) -> None:
    """Look at an origin: lengths in millimetres, angles in degrees, right angles with a few digits."""
    source = notes.source
    xyz, rpy = (notes.numbers(origin, place, key, 3) for key in ("xyz", "rpy"))
    _check_quaternion(notes, origin, place)
    if xyz is not None and max(map(abs, xyz)) > _FARTHEST:
        words = f"Its xyz is {' '.join(general(value) for value in xyz)}, in metres: this looks like millimetres."
        metres = [value / 1000.0 for value in xyz]
        mend = f"Write {' '.join(general(value) for value in metres)}."
        edit = source.with_attribute(origin, "xyz", spelled(*metres))
        notes.add(origin, place, "millimetres", "suspicious", words, mend, edit)
    if rpy is None:
        return
    if max(map(abs, rpy)) > TURN + 0.01:
        words = f"Its rpy is {' '.join(general(value) for value in rpy)}, in radians: this looks like degrees."
        radians = [value * DEGREE for value in rpy]
        mend = f"Write {' '.join(general(value) for value in radians)}."
        edit = source.with_attribute(origin, "rpy", spelled(*radians))
        notes.add(origin, place, "degrees", "suspicious", words, mend, edit)
        return
    parts = origin.get("rpy", "").split()
    exact = [_meant(part, value) for part, value in zip(parts, rpy, strict=True)]
    wrong = [part for part, value, meant in zip(parts, rpy, exact, strict=True) if meant != value]
    if wrong:
        several = list(dict.fromkeys(wrong))
        off = max(abs(meant - value) for value, meant in zip(rpy, exact, strict=True))
        what = "is a multiple" if len(several) == 1 else "are multiples"
        words = f"{' and '.join(several)} in its rpy {what} of 45° with a few digits: {_off(off)}."
        texts = [
            part if meant == value else spelled(meant)
            for part, value, meant in zip(parts, rpy, exact, strict=True)
        ]
        edit = source.with_attribute(origin, "rpy", " ".join(texts))
        notes.add(origin, place, "rounded", "suspicious", words, f"Write {' '.join(texts)}.", edit)


def _check_quaternion(notes: FindingLog, origin: Element, place: str) -> None:
    quaternion = notes.numbers(origin, place, "quat_xyzw", 4)
    if quaternion is None:
        return
    length = math.hypot(*quaternion)
    if "rpy" in origin.attrib:
        words, mend = "It has both rpy and quat_xyzw, and only one can count.", "Leave out one of them."
        notes.add(origin, place, "origin", "wrong", words, mend)
    elif length == 0.0:
        words, mend = "Its quaternion is zero, which is no rotation.", "Write 0 0 0 1 for none."
        notes.add(origin, place, "origin", "wrong", words, mend)
    elif abs(length - 1.0) > UNIT:
        words = f"Its quaternion has the length {general(length, 3)}, not 1: one of its numbers is wrong."
        notes.add(origin, place, "origin", "wrong", words, "Write the right one: x y z w.")


def _off(angle: float) -> str:
    """What an error of an angle does."""
    return f"{general(angle / DEGREE, 2)}° off, which is {general(1000.0 * angle, 2)} mm a metre away"


def _meant(text: str, value: float) -> float:
    """The multiple of 45° that an angle is with as many digits as it has; itself if it is none."""
    exact = round(value / (0.25 * math.pi)) * 0.25 * math.pi
    digits = len(text.lower().partition("e")[0].partition(".")[2])
    near = min(_ROUNDED, 10.0**-digits)  # rounded, or cut off
    return exact if exact and digits >= 2 and _EXACT < abs(value - exact) <= near else value


# No edit: on the way to the tool, a follower that moves by itself makes another arm.
_FOLLOWS = "Write the joint that it follows, or leave out <mimic> if it has a motor of its own."


def _check_mimic(notes: FindingLog, joint: Element, place: str, known: Mapping[str, Element]) -> None:
    mimic, source = joint.find("mimic"), notes.source
    if mimic is None:
        return
    leader = mimic.get("joint", "").strip()
    if leader not in known:
        near = get_close_matches(leader, known, 1)
        words = f"It follows the joint “{cut(leader)}”, which does not exist."
        if near:
            edit = source.with_attribute(mimic, "joint", near[0])
            notes.add(mimic, place, "mimic", "wrong", words, f"Let it follow {near[0]}.", edit)
        else:
            notes.add(mimic, place, "mimic", "wrong", words, _FOLLOWS)
        return
    numbers = [notes.numbers(mimic, place, key) if key in mimic.attrib else [default]
               for key, default in (("multiplier", 1.0), ("offset", 0.0))]  # fmt: skip
    seen, multiplier, offset = [joint.get("name", "").strip()], 1.0, 0.0
    while (name := mimic.get("joint", "").strip()) in known and len(seen) <= _MOST_ROUNDS:
        if name in seen:
            words = f"It follows itself: {', '.join([*seen, name])}."
            notes.add(joint.find("mimic"), place, "mimic", "wrong", words, _FOLLOWS)
            return
        offset += multiplier * number_or(mimic.get("offset"), 0.0)
        multiplier *= number_or(mimic.get("multiplier"), 1.0)
        seen.append(name)
        further = known[name].find("mimic")
        if further is None:
            break
        mimic = further
    first = joint.find("mimic")
    assert first is not None
    if len(seen) > 2 and None not in numbers and math.isfinite(multiplier) and math.isfinite(offset):
        words = f"It follows {leader}, which follows {', then '.join(seen[2:])}; many readers take one step only."
        mend = f"Let it follow {seen[-1]} at once: multiplier {general(multiplier)}, offset {general(offset)}."
        edits = [
            source.with_attribute(first, key, value)
            for key, value in (
                ("joint", seen[-1]),
                ("multiplier", spelled(multiplier)),
                ("offset", spelled(offset)),
            )
        ]
        notes.add(first, place, "mimic", "suspicious", words, mend, *edits)


def number_or(text: str | None, default: float) -> float:
    """The number that a text is, or the default if there is no text."""
    return default if text is None else number_of(text)
