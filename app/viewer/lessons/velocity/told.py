"""The lesson's numbers and sentences, as HTML for the panel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from app.viewer.lessons.velocity.rates import Ellipsoid, State, TaskRates, condition, real, state_of
from app.viewer.panel.status import ink
from app.viewer.views.mathml import ident, sub, text
from app.viewer.views.mathml import math as formula
from kin import Robot, Singularity
from kin.ik.messages.singularity import long, short
from kin.transforms import Array
from kin.units import Units, fixed

# Mark, word and colour of each state; the colours are Okabe and Ito's.
LOOKS: dict[State, tuple[str, str, str]] = {
    "far": ("✓", "far", "#009e73"),
    "near": ("!", "near", "#b87a00"),
    "at": ("✕", "singular", "#d55e00"),
}
CHOSEN = "rgba(0,114,178,.28)"
SAMPLE = 0.1  # m of the picture that an ellipsoid's scale is told for
DECADES = (-3, 1)  # of the singular values' bars
_ALIGNED = math.cos(math.radians(0.5))
_BLOCK = "margin:.1em 1em .45em;font-size:.8em;line-height:1.45;font-variant-numeric:tabular-nums"
_QUIET = "opacity:.75"


# The Jacobian


def matrix_html(robot: Robot, J: Array, frame: str, chosen: int | None) -> str:
    """The Jacobian ``(6, n)`` in one frame, rows and columns named, the chosen column on a ground."""
    # Fixed widths, so that no number moves; seven columns must fit a panel of 300 pixels.
    decimals, width, gap = (3, 3.1, 0.3) if robot.n < 7 else (2, 2.5, 0.2)
    names = [ident("v")] * 3 + [ident("ω")] * 3
    cell = f"padding:0 {gap}em;text-align:right;white-space:nowrap"

    def ground(i: int) -> str:
        return f";background:{CHOSEN}" if i == chosen else ""

    head = "".join(
        f'<th scope="col" style="{cell};font-weight:500{ground(i)}">'
        f"{formula(sub(ident('θ' if robot.revolute[i] else 'd'), text(str(i + 1))))}</th>"
        for i in range(robot.n)
    )
    body = ""
    for r, line in enumerate(J.tolist()):
        title = formula(sub(names[r], text("xyz"[r % 3])))
        cells = "".join(
            f'<td data-j style="{cell}{ground(i)}"><span style="display:inline-block;width:{width}em">'
            f"{fixed(v, decimals)}</span></td>"
            for i, v in enumerate(line)
        )
        left, right = (_bracket("right"), _bracket("left")) if r == 0 else ("", "")
        body += (
            f'<tr><th scope="row" style="padding:0 .3em 0 0;text-align:left;font-weight:500">{title}</th>'
            f"{left}{cells}{right}</tr>"
        )
    size = ".72em" if robot.n < 7 else ".74em"
    return (
        f'<div style="overflow-x:auto;margin:.1em .6em .2em">'
        f'<table aria-label="Jacobian" data-frame="{frame}" style="border-collapse:separate;border-spacing:0;'
        f'margin:auto;font-size:{size};line-height:1.65;font-variant-numeric:tabular-nums">'
        f"<tr><th></th><th></th>{head}<th></th></tr>{body}</table></div>"
    )


def _bracket(open_side: str) -> str:
    return (
        '<td rowspan="6" aria-hidden="true" style="padding:0;width:.25em;border:.1em solid currentColor;'
        f'border-{open_side}:0"></td>'
    )


def units_html(robot: Robot, frame: str) -> str:
    """What the entries are, in words."""
    per = "the joint turns by 1 rad/s"
    if not robot.revolute.all():
        per += " (a sliding joint d: 1 m/s)"
    return (
        f'<div style="{_BLOCK};{_QUIET};font-size:.74em">Each column: how the tool point moves (v, m/s) and the '
        f"tool turns (ω, rad/s) while {per}; in the {frame} frame.</div>"
    )


def column_html(robot: Robot, J: Array, chosen: int | None) -> str:
    """The chosen column as speeds, in words."""
    if chosen is None:
        said = "Choose a joint to see its column as arrows at the tool."
    else:
        v, w = (float(np.linalg.norm(part)) for part in (J[:3, chosen], J[3:, chosen]))
        unit = "1 rad/s" if robot.revolute[chosen] else "1 m/s"
        said = f"Joint {chosen + 1} at {unit}: tool point {fixed(v)} m/s, tool turning {fixed(w)} rad/s."
    return f'<div data-column style="{_BLOCK};{_QUIET};font-size:.74em;min-height:2.9em">{said}</div>'


# Singularities


def headline(first: Singularity | None, state: State) -> str:
    """How things stand, in a few words."""
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
    """How near the arm is to a singularity, of which kind, and what is lost there."""
    ours = real(found)
    first = ours[0] if ours else None
    state: State = state_of(first, robot.reach) if first is not None else "far"
    mark, _, color = LOOKS[state]
    sentences = []
    if first is not None and state == "at":
        sentences = [short(first, units), *directions]
    elif first is not None:
        name = "Smallest σ" if first.kind == "jacobian" else first.kind
        away = "" if first.kind == "jacobian" else " away"
        sentences = [f"{name}, {distance(first, units)}{away}", long(first, units), *directions[:1]]
    detail = " ".join(f"{s[:1].upper()}{s[1:].rstrip('.')}." for s in sentences)
    return (
        f'<div role="status" data-singular="{state}" style="display:flex;gap:.6em;margin:.15em 1em .35em;'
        f"padding:.5em .65em;min-height:6.6em;box-sizing:border-box;border-radius:.4em;font-size:.85em;"
        f'line-height:1.3;background:{color}1f;border-left:.28em solid {color}">'
        f'<span aria-hidden="true" style="flex:none;width:1.5em;height:1.5em;line-height:1.5em;border-radius:50%;'
        f'text-align:center;font-weight:700;color:#fff;background:{color}">{mark}</span>'
        f'<span style="min-width:0"><b style="display:block;line-height:1.5;font-variant-numeric:tabular-nums">'
        f"{escape(headline(first, state))}</b>"
        f'<span style="font-size:.92em;opacity:.85">{escape(detail)}</span></span></div>'
    )


def others_html(robot: Robot, found: tuple[Singularity, ...], units: Units) -> str:
    """Every singularity with its distance, the nearest first."""
    rows = ""
    for s in found:
        mark, word, color = LOOKS[state_of(s, robot.reach)]
        name = {"algorithmic": "formula only", "jacobian": "smallest σ"}.get(s.kind, s.kind)
        if s.kind == "algorithmic":
            mark, word, color = "·", "–", "inherit"
        meaning = escape(long(s, units), quote=True)
        rows += (
            f'<tr title="{meaning}"><td style="padding:0 .5em 0 0;font-weight:700;'
            f'color:{ink(color)};white-space:nowrap">{mark} {word}</td><td style="padding:0">{escape(name)}</td>'
            f'<td style="padding:0;text-align:right;white-space:nowrap">{distance(s, units)}</td></tr>'
            f'<tr><td></td><td colspan="2" style="padding:0 0 .3em;font-size:.92em;line-height:1.3;{_QUIET}">'
            f"{meaning}</td></tr>"
        )
    return (
        f'<table aria-label="singularities" style="{_BLOCK};width:calc(100% - 2em);border-collapse:collapse">'
        f"{rows}</table>"
    )


def lost_words(twist: Array, R_base_tool: Array, slowest: bool = False) -> str:
    """A lost (or the slowest) direction ``(6,)`` in a sentence."""
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
    """A line's direction ``(3,)`` for people: an axis if it is one, else its unit vector in the base frame."""
    d = direction / np.linalg.norm(direction)
    for name, axes in (("base", np.eye(3)), ("tool", R_base_tool.T)):
        for k in range(3):
            if abs(float(axes[k] @ d)) > _ALIGNED:
                return f"{name} {'xyz'[k]}"
    # A line has no sign: its largest component is made positive.
    d = d if d[int(np.abs(d).argmax())] > 0.0 else -d
    return f"({', '.join(fixed(float(x), 2) for x in d)})"


# Ellipsoid and singular values


WORDS: dict[Ellipsoid, tuple[str, str]] = {
    "velocity": ("m/s", "Where joint speeds with |q̇| = 1 can take the tool point: long axes are fast."),
    "turning": ("rad/s", "How fast joint speeds with |q̇| = 1 can turn the tool: about long axes fast."),
    "force": ("N", "Forces on the tool that joint torques with |τ| = 1 can hold: long axes are strong."),
    "moment": ("N·m", "Moments on the tool that joint torques with |τ| = 1 can hold: long axes are strong."),
}


def ellipsoid_html(robot: Robot, kind: Ellipsoid, semi: Array, scale: float, cut: bool, units: Units) -> str:
    """What the ellipsoid means, its semi-axes ``(3,)`` and its scale: so much of its unit is `SAMPLE` long."""
    unit, meaning = WORDS[kind]
    axes = "".join(f'<span style="display:inline-block;min-width:4.6em">{_size(float(v))}</span>' for v in semi)
    notes = [f"{units.lengths.brief(SAMPLE)} in the picture are {scale:g} {unit}."]
    if not robot.revolute.all():
        notes.append("A sliding joint counts 1 m/s like 1 rad/s (1 N like 1 N·m).")
    if cut:
        notes.append("The longest axis is cut short.")
    return (
        f'<div data-ellipsoid="{kind}" style="{_BLOCK}"><div style="{_QUIET};font-size:.92em">{meaning}</div>'
        f'<div style="white-space:nowrap"><span style="{_QUIET}">Semi-axes</span> {axes} {unit}</div>'
        f'<div style="{_QUIET};font-size:.92em;min-height:1.45em">{" ".join(notes)}</div></div>'
    )


def label_texts(semi: Array) -> tuple[str, str, str]:
    """The semi-axes ``(3,)`` as labels in the picture."""
    a, b, c = (_size(float(v)) for v in semi)
    return a, b, c


def _size(value: float) -> str:
    if not math.isfinite(value) or value > 1e6:
        return "∞"
    return fixed(value, 3) if value < 100.0 else f"{value:.0f}"


def task_words(robot: Robot) -> str:
    """What the singular values of this arm's Jacobian are about."""
    if robot.n > 5:
        return "All six rows. Metres and radians are mixed, so these values depend on the unit of length."
    if robot.n == 5:
        return (
            "Five joints cannot be asked for six speeds: the rows are the tool point's three and the tilting of "
            "the approach direction about the tool's x and y; the roll is left out. Metres and radians are mixed."
        )
    return (
        f"{robot.n} joint{'s' * (robot.n > 1)} cannot be asked for six speeds: only the rows of the tool point "
        "are meant; turning is left out."
    )


def values_html(robot: Robot, rates: TaskRates, linear: Array, angular: Array) -> str:
    """Singular values of the task's Jacobian as bars, and w and κ of it and of its parts ``(3,)``, ``(3,)``."""
    low, high = DECADES
    bars = ""
    for k, v in enumerate(rates.values.tolist()):
        share = 100.0 * min(max((math.log10(max(v, 1e-300)) - low) / (high - low), 0.0), 1.0)
        color = LOOKS["at"][2] if v < 1e-3 else LOOKS["near"][2] if v < 0.05 else "#0072b2"
        bars += (
            f'<tr><th style="padding:0 .4em 0 0;font-weight:500;text-align:left">σ<sub>{k + 1}</sub></th>'
            f'<td style="width:100%;padding:0"><div aria-hidden="true" style="height:.55em;border-radius:.2em;'
            "background:repeating-linear-gradient(90deg,rgba(128,128,128,.22) 0 calc(25% - 1px),"
            f'rgba(128,128,128,.6) calc(25% - 1px) 25%)"><div style="height:100%;width:{share:.1f}%;'
            f'border-radius:.2em;background:{color}"></div></div></td>'
            f'<td data-sigma style="padding:0 0 0 .5em;text-align:right">{fixed(v, 4)}</td></tr>'
        )
    rows = [("linear, m/s", linear[: robot.n]), ("angular, rad/s", angular[: robot.n])]
    if robot.n > 4:
        rows.insert(0, ("all" if robot.n > 5 else "task", rates.values))
    table = "".join(
        f'<tr><td style="padding:0">{name}</td><td data-w style="padding:0;text-align:right">{_small(_product(s))}'
        f'</td><td style="padding:0;text-align:right">{_ratio(s)}</td></tr>'
        for name, s in rows
    )
    return (
        f'<div style="{_BLOCK}"><div style="{_QUIET};font-size:.92em;margin-bottom:.3em">{task_words(robot)}</div>'
        f'<table aria-label="singular values" style="width:100%;border-collapse:collapse">{bars}</table>'
        f'<div style="{_QUIET};font-size:.88em">Logarithmic bars from 0.001 to 10.</div>'
        '<table aria-label="manipulability" style="width:100%;border-collapse:collapse;margin-top:.4em">'
        f'<tr style="{_QUIET}"><td style="padding:0">rows</td><td style="padding:0;text-align:right" '
        'title="Manipulability: the product of the singular values (Yoshikawa 1985)">w = ∏σ</td>'
        '<td style="padding:0;text-align:right" title="Condition number">κ = σ<sub>max</sub>/σ<sub>min</sub></td>'
        f"</tr>{table}</table>"
        f'<div style="{_QUIET};font-size:.88em;margin-top:.2em">w: manipulability (Yoshikawa, 1985); '
        "κ: condition number, 1 is best.</div></div>"
    )


def _product(values: Array) -> float:
    return float(np.prod(values)) if len(values) else 0.0


def _small(value: float) -> str:
    if value == 0.0 or value >= 1e-4:
        return fixed(value, 4)
    return "&lt; 0.0001"


def _ratio(values: Array) -> str:
    ratio = condition(values)
    return "∞" if ratio > 1e6 else f"{ratio:.1f}" if ratio < 1000 else f"{ratio:.0f}"
