"""The HTML of *Compare with…*: what is chosen, verdict, mapping as a table and as code, likely mistakes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from app.viewer.panel.share import box_html
from app.viewer.tabs.robot.compare.reference import Reference
from app.viewer.tabs.robot.files import MOST
from app.viewer.views.templates import render
from kin import Robot
from kin.comparison import Comparison, messages
from kin.comparison.frames import Mapping
from kin.poses import roll_pitch_yaw
from kin.transforms import Array
from kin.units import Units

DECIMALS = 4  # of a degree or a millimetre
MOST_DIFFERENCES = 4
_NAMES = ("the other arm", "this arm")
_COLOURS = {"identical": "kb-green", "same": "kb-green", "close": "kb-amber", "different": "kb-vermilion"}
_SYMBOLS = {"identical": "✓", "same": "✓", "close": "≈", "different": "✕"}


def form(robots: Sequence[tuple[str, str]], chosen: str, frames: str) -> str:
    """What to compare with."""
    return render("robot/compare", robots=robots, chosen=chosen, frames=frames, most=MOST)


def answer(
    found: Comparison | None, other: Reference, shown: Robot, units: Units, busy: bool, stopped: bool
) -> str:
    """What is known of the comparison.

    Args:
        busy: whether mistakes are still sought.
        stopped: whether the visitor ended the search.
    """
    a = other.robot
    facts: dict[str, object] = {"name": a.name, "note": other.note, "busy": busy, "stopped": stopped}
    if found is None:
        return render("robot/compared", **facts, found=None)
    explanations = [
        {"text": messages.explanation(each, a, shown, units), "proof": _proof(each.position, each.rotation, units)}
        for each in found.explanations
    ]
    mapped = found.is_same and found.verdict != "identical" and found.mapping is not None
    searched = not busy and not stopped and found.verdict == "different" and not explanations
    listed = found.differences[1 : 1 + MOST_DIFFERENCES]
    return render(
        "robot/compared",
        **facts,
        found=found,
        colour=_COLOURS[found.verdict],
        symbol=_SYMBOLS[found.verdict],
        words=messages.verdict(found, a, shown, units, _NAMES),
        nearly=messages.nearly(found, units),
        within=_proof(found.position, found.rotation, units) if found.is_same else "",
        differences=[messages.difference(each, a, shown, units, _NAMES) for each in listed],
        more=max(0, len(found.differences) - 1 - MOST_DIFFERENCES),
        rows=_rows(found.mapping, a, units) if mapped and found.mapping is not None else (),
        frames=_frames(found.mapping, units) if mapped and found.mapping is not None else (),
        code=Markup(box_html(code(found.mapping, a), "Copy code")) if mapped and found.mapping is not None else "",
        free=_free(found),
        explanations=explanations,
        nothing=_nothing(found) if searched else "",
        incomplete=bool(explanations) and not found.complete and not busy,
    )


def joint(found: Comparison, index: int, other: Robot, shown: Robot, units: Units) -> str:
    """What is marked in the scene."""
    differing = [
        messages.difference(each, other, shown, units, _NAMES)
        for each in found.differences
        if index in each.joints
    ]
    first = found.first is not None and index == max(found.first.joints, default=min(other.n, shown.n))
    names = [robot.joints[index].name for robot in (shown, other) if index < robot.n]
    return render(
        "robot/compared_joint",
        number=index + 1,
        names=" / ".join(dict.fromkeys(names)),
        differing=differing,
        first=first,
        lonely=index >= min(other.n, shown.n),
    )


def code(mapping: Mapping, other: Robot) -> str:
    """The mapping as Python."""

    def matrix(name: str, T: Array) -> str:
        if np.array_equal(T, np.eye(4)):
            return f"{name} = np.eye(4)"
        rows = ",\n".join(f"    [{', '.join(f'{x + 0.0:.9g}' for x in row)}]" for row in np.round(T, 12).tolist())
        return f"{name} = np.array([\n{rows},\n])"

    signs = ", ".join(f"{int(sign)}" for sign in mapping.signs.tolist())
    offsets = ", ".join(f"{offset + 0.0:.9g}" for offset in mapping.offsets.tolist())
    return "\n".join(
        [
            "import numpy as np",
            "",
            f"# a: {other.name}; b: the table in the page. Radians and metres.",
            f"signs = np.array([{signs}])",
            f"offsets = np.array([{offsets}])",
            matrix("base", mapping.base),
            matrix("tool", mapping.tool),
            "",
            "def to_b(q):",
            '    """Joint values of b that put it where a is at q."""',
            "    return signs * np.asarray(q) + offsets",
            "",
            "# fk_a(q) == base @ fk_b(to_b(q)) @ tool",
        ]
    )


def _rows(mapping: Mapping, other: Robot, units: Units) -> list[dict[str, str]]:
    rows = []
    for i, (sign, offset) in enumerate(zip(mapping.signs.tolist(), mapping.offsets.tolist(), strict=True)):
        unit = units.of(bool(other.revolute[i]))
        zero = unit.short(offset, DECIMALS) if abs(offset) > 1e-9 else "0"
        rows.append(
            {
                "name": other.joints[i].name,
                "sign": "+" if sign > 0.0 else "−",
                "zero": zero,
                "unit": unit.suffix,
                "changed": str(bool(sign < 0.0 or zero != "0") or ""),
            }
        )
    return rows


def _frames(mapping: Mapping, units: Units) -> list[tuple[str, str]]:
    found = []
    for name, T in (("Base", mapping.base), ("Tool", mapping.tool)):
        if np.allclose(T, np.eye(4), atol=1e-9):
            found.append((name, "the same"))
            continue
        lengths = ", ".join(units.lengths.short(x, DECIMALS) for x in T[:3, 3].tolist())
        angles = ", ".join(units.angles.short(x, DECIMALS) for x in roll_pitch_yaw(T[:3, :3]))
        found.append(
            (name, f"x y z = {lengths} {units.lengths.name}; roll pitch yaw = {angles}{units.angles.suffix}")
        )
    return found


def _proof(position: float | None, rotation: float | None, units: Units) -> str:
    """By how much the poses differ."""
    if position is None or rotation is None:
        return ""
    return f"{_least(position, units, False)} and {_least(rotation, units, True)}"


def _least(value: float, units: Units, is_angle: bool) -> str:
    unit = units.of(is_angle)
    smallest = math.radians(1e-4) if is_angle else 1e-7
    return f"{'less than ' * (value < smallest)}{unit.short(max(value, smallest), DECIMALS)}{unit.suffix}"


def _free(found: Comparison) -> str:
    """Which offsets poses cannot tell."""
    joints = sorted({joint + 1 for group in found.free_offsets for joint in group})
    if not found.is_same or not joints:
        return ""
    *most, last = [str(joint) for joint in joints]
    names = f"joints {', '.join(most)} and {last}" if most else f"joint {last}"
    return f"Poses cannot tell an offset of {names} from another base, tool or zero of a neighbour."


def _nothing(found: Comparison) -> str:
    if found.complete:
        return "No single mistake and no pair of mistakes explains the difference."
    return "No single mistake explains the difference, and no pair that was tried in time: not all were."
