"""The lesson's numbers and sentences, as HTML for the panel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from markupsafe import Markup

from app.exports.worksheet.sheet import indexed
from app.viewer.lessons.velocity.ellipsoids import Ellipsoid, TaskRates, condition
from app.viewer.views.mathml import ident, sub, text
from app.viewer.views.mathml import math as formula
from app.viewer.views.templates import render
from kin import Robot
from kin.ik import Singularity
from kin.ik.messages.singularity import short, there
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.units import Units, fixed

COLORS: dict[Ellipsoid, tuple[int, int, int]] = {
    "velocity": (86, 180, 233),
    "turning": (204, 121, 167),
    "force": (230, 159, 0),
    "moment": (240, 228, 66),
}
COLUMN, LOST, SLOW = (0, 114, 178), (213, 40, 0), (184, 122, 0)
State = Literal["far", "near", "at"]

# A singularity is "near" within this angle, or within this angle times the arm's reach.
NEAR = math.radians(10.0)
NEAR_VALUE = 0.05  # the same for a singular value
# Symbol, word and CSS class of each state.
LOOKS: dict[State, tuple[str, str, str]] = {
    "far": ("✓", "far", "kb-green"),
    "near": ("!", "near", "kb-amber"),
    "at": ("✕", "singular", "kb-vermilion"),
}
CHOSEN = Markup(' class="kb-chosen"')
SAMPLE = 0.1  # m: the length in the scene for which an ellipsoid's scale is given
DECADES = (-3, 1)  # of the singular values' bars
_ALIGNED = math.cos(math.radians(0.5))


# How near


def real(found: tuple[Singularity, ...]) -> tuple[Singularity, ...]:
    """The singularities that cost the arm a motion; the others concern only a closed form."""
    return tuple(s for s in found if s.kind != "algorithmic")


def state_of(singularity: Singularity, reach: float) -> State:
    """Whether the arm is far from, near or at a singularity; lengths are judged relative to the reach."""
    if singularity.distance <= TOLERANCES.at_singularity:
        return "at"
    if singularity.unit == "SI":
        return "near" if singularity.distance < NEAR_VALUE else "far"
    angle = singularity.distance / (reach if singularity.unit == "m" else 1.0)
    return "near" if angle < NEAR else "far"


def nice(value: float) -> float:
    """The smallest of 1, 2, 5, 10, 20, … that is not below a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next((m * power for m in (1.0, 2.0, 5.0) if m * power >= value * (1.0 - 1e-9)), 10.0 * power)


# The Jacobian


def matrix_html(robot: Robot, J: Array, frame: str, chosen: int | None) -> str:
    """The Jacobian ``(6, n)`` in one frame, with named rows and columns, and the chosen column highlighted."""
    # Columns have fixed widths, so that no number moves; seven columns must fit a panel of 300 pixels.
    wide = robot.n >= 6
    names = [ident("v")] * 3 + [ident("ω")] * 3
    variables = ("θ" if revolute else "d" for revolute in robot.revolute)
    return render(
        "velocity/jacobian",
        frame=frame,
        wide=wide,
        chosen=chosen,
        chosen_class=CHOSEN,
        heads=[
            (f"{variable} {i}", formula(sub(ident(variable), text(str(i)))))
            for i, variable in enumerate(variables, 1)
        ],
        rows=[
            {
                "name": formula(sub(names[r], text("xyz"[r % 3]))),
                "said": f"{'vω'[r // 3]} {'xyz'[r % 3]}",
                "values": [fixed(value, 2 if wide else 3) for value in line],
            }
            for r, line in enumerate(J.tolist())
        ],
    )


def units_html(robot: Robot, frame: str) -> str:
    """The meaning of the entries, in words."""
    per = "the joint turns by 1 rad/s"
    if not robot.revolute.all():
        per += " (a prismatic joint d: slides by 1 m/s)"
    words = f"how the tool point moves (v, m/s) and the tool turns (ω, rad/s) while {per}; in the {frame} frame."
    return render("velocity/jacobian_note", text=f"Each column: {words}")


def column_html(robot: Robot, J: Array, chosen: int | None) -> str:
    """The chosen column as speeds, in words."""
    if chosen is None:
        words = "Choose a joint to show its column as arrows at the tool."
    else:
        v, w = (float(np.linalg.norm(part)) for part in (J[:3, chosen], J[3:, chosen]))
        unit = "1 rad/s" if robot.revolute[chosen] else "1 m/s"
        speeds = f"the tool point moves at {fixed(v)} m/s, the tool turns at {fixed(w)} rad/s"
        words = f"Joint {chosen + 1} at {unit}: {speeds}."
    return render("velocity/column", text=words)


# Singularities


def headline(first: Singularity | None, state: State) -> str:
    """The state in a few words."""
    if first is None or state == "far":
        return "Far from any singularity"
    name = "singularity" if first.kind == "jacobian" else f"{first.kind} singularity"
    article = "an" if name[0] in "aeiou" else "a"
    return f"{state[:1].upper()}{state[1:]} {article} {name}"


def distance(singularity: Singularity, units: Units) -> str:
    """A distance with its unit."""
    d = singularity.distance
    if singularity.unit == "m":
        return units.distance(d)
    if singularity.unit == "SI":
        return fixed(d, 4)
    return units.angles.text(d)


def warning_html(robot: Robot, found: tuple[Singularity, ...], units: Units, directions: Sequence[str]) -> str:
    """The distance to the nearest singularity, its kind, and the directions lost there."""
    ours = real(found)
    first = ours[0] if ours else None
    state: State = state_of(first, robot.reach) if first is not None else "far"
    symbol, _, color = LOOKS[state]
    sentences: list[str] = []
    if first is not None and state == "at":
        sentences = [indexed(short(first, units)), *directions]
    elif first is not None:
        amount = distance(first, units)
        if first.kind == "jacobian":
            sentences = [f"σ_min = {amount}", indexed(short(first, units)), *directions[:1]]
        else:
            sentences = [f"Nearest: the {first.kind} singularity, {amount} away", there(first), *directions[:1]]
    # A leading σ stays lower case.
    detail = " ".join(f"{s[:1].upper() if s[:1].isascii() else s[:1]}{s[1:].rstrip('.')}." for s in sentences)
    return render(
        "velocity/warning", state=state, color=color, symbol=symbol, title=headline(first, state), detail=detail
    )


def others_html(robot: Robot, found: tuple[Singularity, ...], units: Units) -> str:
    """All singularities with their distances, the nearest first."""
    rows = []
    for singularity in found:
        symbol, word, color = LOOKS[state_of(singularity, robot.reach)]
        if singularity.kind == "algorithmic":
            symbol, word, color = "·", "–", ""
        meaning = indexed(short(singularity, units))
        if singularity.kind != "jacobian":
            meaning += f": {there(singularity)}"
        name = {"algorithmic": "formula only", "jacobian": "σ_min"}.get(singularity.kind, singularity.kind)
        rows.append(
            {
                "symbol": symbol,
                "word": word,
                "color": color,
                "name": name,
                "distance": distance(singularity, units),
                "meaning": meaning,
            }
        )
    return render("velocity/singularities", rows=rows)


def lost_words(twist: Array, R_base_tool: Array, slowest: bool = False) -> str:
    """A lost, or the slowest, direction ``(6,)`` in a sentence."""
    v, w = twist[:3], twist[3:]
    move = axis_name(v, R_base_tool) if np.linalg.norm(v) > 1e-3 else ""
    turn = axis_name(w, R_base_tool) if np.linalg.norm(w) > 1e-3 else ""
    if slowest:
        ways = " and ".join([f"along {move}"] * bool(move) + [f"about {turn}"] * bool(turn))
        return f"Slowest {ways}."
    if move and turn:
        return f"Cannot move along {move} without turning, nor turn about {turn} without moving."
    return f"Cannot move along {move}." if move else f"Cannot turn about {turn}."


def axis_name(direction: Array, R_base_tool: Array) -> str:
    """A direction ``(3,)`` in words: the name of an axis if it is one, else its unit vector in the base frame."""
    d = direction / np.linalg.norm(direction)
    for name, axes in (("base", np.eye(3)), ("tool", R_base_tool.T)):
        for k in range(3):
            if abs(float(axes[k] @ d)) > _ALIGNED:
                return f"{name} {'xyz'[k]}"
    # The direction of a line has no sign: make its largest component positive.
    d = d if d[int(np.abs(d).argmax())] > 0.0 else -d
    return f"({', '.join(fixed(float(x), 2) for x in d)})"


# Legend


def legend_html(kind: Ellipsoid | None, chosen: int | None, state: State, twists: Array, force: bool) -> str:
    """What is drawn at the tool: mark, colour and meaning of each drawing; `twists` ``(k, 6)`` are drawn too."""
    items = []
    if kind is not None:
        items.append(("ellipsoid", COLORS[kind], LEGEND[kind]))
    if chosen is not None:
        items.append(("arrow", COLUMN, f"column of joint {chosen + 1}: motion of the tool, and its turning"))
    if force:
        items.append(("arrow", COLORS["force"], "force F of the tool; drag its tip"))
    color, word = (LOST, "impossible here") if state == "at" else (SLOW, "slowest here")
    if len(twists) and (np.linalg.norm(twists[:, :3], axis=1) > 1e-3).any():
        items.append(("arrow", color, f"motion that is {word}"))
    if len(twists) and (np.linalg.norm(twists[:, 3:], axis=1) > 1e-3).any():
        items.append(("ring", color, f"rotation that is {word}"))
    return render("panel/legend", label="drawn at the tool", items=items)


# Ellipsoid and singular values


LEGEND: dict[Ellipsoid, str] = {
    "velocity": "possible velocities of the tool point",
    "turning": "possible angular velocities of the tool",
    "force": "forces that the joints can hold",
    "moment": "moments that the joints can hold",
}


WORDS: dict[Ellipsoid, tuple[str, str]] = {
    "velocity": ("m/s", "Velocities of the tool point at joint speeds with |q̇| = 1: fast along long axes."),
    "turning": ("rad/s", "Angular velocities of the tool at joint speeds with |q̇| = 1: fast about long axes."),
    "force": ("N", "Forces on the tool that joint torques with |τ| = 1 can hold: strong along long axes."),
    "moment": ("N·m", "Moments on the tool that joint torques with |τ| = 1 can hold: strong about long axes."),
}


def ellipsoid_html(robot: Robot, kind: Ellipsoid, semi: Array, scale: float, cut: bool, units: Units) -> str:
    """The ellipsoid's meaning, its semi-axes ``(3,)`` and its scale: `scale` of its unit is `SAMPLE` long."""
    unit, meaning = WORDS[kind]
    notes = [f"{units.lengths.brief(SAMPLE)} in the scene are {scale:g} {unit}."]
    if not robot.revolute.all():
        notes.append("For prismatic joints, 1 m/s counts as 1 rad/s (1 N as 1 N·m).")
    if cut:
        notes.append("The longest axis is truncated.")
    return render(
        "velocity/ellipsoid",
        kind=kind,
        meaning=meaning,
        semi_axes=[_size(float(v)) for v in semi],
        unit=unit,
        notes=" ".join(notes),
    )


def label_texts(semi: Array) -> tuple[str, str, str]:
    """The semi-axes ``(3,)`` as labels in the scene."""
    a, b, c = (_size(float(v)) for v in semi)
    return a, b, c


def _size(value: float) -> str:
    if not math.isfinite(value) or value > 1e6:
        return "∞"
    return fixed(value, 3) if value < 100.0 else f"{value:.0f}"


def task_words(robot: Robot) -> str:
    """Which rows of this arm's Jacobian the singular values belong to."""
    if robot.n > 5:
        return "All six rows. Metres and radians are mixed, so these values depend on the unit of length."
    if robot.n == 5:
        return (
            "Five joints cannot produce six independent velocities. These rows: the three of the tool point, and "
            "the "
            "rotation of the approach direction about the tool's x and y; without the roll. Metres and radians "
            "are "
            "mixed."
        )
    return (
        f"{robot.n} joint{'s' * (robot.n > 1)} cannot produce six independent velocities. These rows: those of "
        "the "
        "tool point, without rotation."
    )


def values_html(robot: Robot, rates: TaskRates, J: Array) -> str:
    """Singular values of the task's Jacobian as bars, and w and κ of it, of J ``(6, n)`` and of its two parts."""
    low, high = DECADES
    bars = []
    for value in rates.values.tolist():
        share = min(max((math.log10(max(value, 1e-300)) - low) / (high - low), 0.0), 1.0)
        color = LOOKS["at"][2] if value < 1e-3 else LOOKS["near"][2] if value < 0.05 else "kb-blue"
        bars.append({"value": fixed(value, 4), "percent": f"{100.0 * share:.1f}", "color": color})
    named = (("pose", J), ("linear", J[:3]), ("angular", J[3:]))
    parts = [(name, np.asarray(np.linalg.svd(rows, compute_uv=False), np.float64)) for name, rows in named]
    if robot.n == 5:
        parts.insert(1, ("point + approach", rates.values))
    least = fixed(float(rates.values[-1]), 4) if len(rates.values) else "–"
    rows = [{"name": name, "product": _small(_product(s)), "ratio": _ratio(s)} for name, s in parts]
    return render("velocity/values", task=task_words(robot), bars=bars, rows=rows, least=least)


def jog_html() -> str:
    """The note above the jog buttons."""
    return render("velocity/jog")


def _product(values: Array) -> float:
    return float(np.prod(values)) if len(values) else 0.0


def _small(value: float) -> str:
    return fixed(value, 4) if value == 0.0 or value >= 1e-4 else "< 0.0001"


def _ratio(values: Array) -> str:
    ratio = condition(values)
    return "∞" if ratio > 1e6 else f"{ratio:.1f}" if ratio < 1000 else f"{ratio:.0f}"
