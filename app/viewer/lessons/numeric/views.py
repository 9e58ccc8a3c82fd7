"""The iterates as numbers, sentences and pictures: HTML for the panel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from markupsafe import Markup

from app.exports.curves import Curve, Row, with_legend
from app.exports.svg import Axes, Plot, chart, cross, png_url
from app.viewer.lessons.numeric.basins import COLOURS, Basins, pixels, turned_within
from app.viewer.lessons.numeric.iteration import MOST, Method, Problem, Run
from app.viewer.views.templates import render
from kin import Robot
from kin.angles import apart
from kin.transforms import Array
from kin.units import Unit, Units, power

NAMES: dict[Method, str] = {
    "newton": "Newton",
    "transpose": "Jacobian transpose",
    "damped": "Damped least squares",
    "gauss-newton": "Gauss–Newton",
}
FORMULAS: dict[Method, str] = {
    "newton": "Solve J Δq = e. Each singular value σ of J counts with 1/σ.",
    "transpose": "Δq = α Jᵀe, straight down the slope of ½|e|². Each σ counts with α σ.",
    "damped": "Δq = Jᵀ(JJᵀ + λ²I)⁻¹e. Each σ counts with σ/(σ² + λ²), at most 1/(2λ).",
    "gauss-newton": "As Newton where J has full rank; the step is halved until the error falls.",
}
ROWS = 8  # of the table
LEAST = 1e-16  # errors below are drawn there
FEWEST = 6  # iterations on the axis of the chart
_SIDE, _LEFT, _TOP = 236.0, 46.0, 8.0


def amount(unit: Unit, value: float) -> str:
    """A length or an angle; in powers of ten if a tenth of a unit would show too little of it."""
    scaled = abs(value) * unit.scale
    return unit.text(value) if scaled >= 10.0 * unit.step(1) else f"{power(scaled)} {unit.name}"


def method_html(method: Method, problem: Problem) -> str:
    """What the method does, and what it makes of the shape of J."""
    rows, n = len(problem.rows), problem.robot.n
    shape = f"J has {rows} row{'s' * (rows > 1)} and {n} column{'s' * (n > 1)}"
    if method == "newton" and rows != n:
        which = "the shortest step is taken" if n > rows else "the step with the smallest remaining error is taken"
        shape += f": not square, so {which} (J⁺)"
    return render("panel/note", text=f"{FORMULAS[method]} {shape}.")


def outcome_html(problem: Problem, run: Run, solutions: Array | None, units: Units) -> str:
    """How the iteration ended, and the exact answer beside it.

    Args:
        solutions: all solutions of `kin` ``(k, n)``; None if there are infinitely many.
    """
    color, symbol, title, detail = _ending(problem, run, units)
    return render(
        "numeric/outcome",
        outcome=run.outcome,
        color=color,
        symbol=symbol,
        title=title,
        detail=detail,
        exact=_exact(problem, run, solutions, units),
    )


def _ending(problem: Problem, run: Run, units: Units) -> tuple[str, str, str, str]:
    count = f"{run.count} iteration{'s' * (run.count != 1)}"
    left = f"Error left: {_error(problem, run, -1, units)}."
    if run.outcome == "reached":
        beyond = _beyond(problem.robot, run.q[-1], units)
        if beyond:
            return "kb-amber", "!", f"Converged in {count}, outside the limits", beyond
        return "kb-green", "✓", f"Converged in {count}", left
    if run.outcome == "singular":
        why = "J has lost rank: 1/σ does not exist, and Newton has no step. Damping would give one."
        return "kb-vermilion", "✕", f"Singular after {count}", f"{why} {left}"
    if run.outcome == "limits":
        joints = ", ".join(str(k + 1) for k in at_limits(problem.robot, run.q[-1]))
        why = f"Every step pushes against the limit of joint {joints}. Another start may lead around it."
        return "kb-vermilion", "✕", f"Stopped by a joint limit after {count}", f"{why} {left}"
    if run.outcome == "stuck":
        why = "No step makes the error smaller: Jᵀe is zero, or nearly. A local minimum, or a target out of reach."
        return "kb-vermilion", "✕", f"Stuck after {count}", f"{why} {left}"
    falling = run.errors[-1] < 0.98 * run.errors[max(0, len(run.errors) - 10)]
    why = (
        "The error still falls, but slowly."
        if falling
        else "The error does not settle: the steps are too long. A larger λ or a step limit may help."
    )
    return "kb-amber", "!", f"Not there after {MOST} iterations", f"{why} {left}"


def _error(problem: Problem, run: Run, k: int, units: Units) -> str:
    far = amount(units.lengths, float(run.far[k]))
    return far if problem.match == "point" else f"{far}, {amount(units.angles, float(run.turned[k]))}"


def at_limits(robot: Robot, q: Array) -> list[int]:
    """The joints at one of their limits, by index."""
    near = np.minimum(q - robot.lower, robot.upper - q) < 1e-9
    return [int(k) for k in np.flatnonzero(near)]


def _beyond(robot: Robot, q: Array, units: Units) -> str:
    """Which joints are outside their limits, whole turns of revolute joints aside."""
    inside = turned_within(robot, q)
    over = np.maximum(robot.lower - inside, inside - robot.upper)
    parts = [
        f"joint {k + 1} by {units.motion(bool(robot.revolute[k]), float(over[k]))}"
        for k in np.flatnonzero(over > 1e-9).tolist()
    ]
    return f"Outside its limits: {', '.join(parts)}." if parts else ""


def _exact(problem: Problem, run: Run, solutions: Array | None, units: Units) -> str:
    if solutions is None:
        return "Exact: infinitely many configurations reach this target; the start decides which one is found."
    if not len(solutions):
        return "Exact: no configuration within the limits reaches this target."
    many = f"{len(solutions)} solution{'s' * (len(solutions) > 1)} within the limits"
    if run.outcome != "reached":
        return f"Exact: {many}. kin finds them without a start."
    near = apart(run.q[-1], solutions, problem.robot.revolute)
    best = int(np.argmin(near))
    if near[best] > 1e-4:
        return f"Exact: {many}; this is none of them."
    start = int(np.argmin(apart(run.q[0], solutions, problem.robot.revolute)))
    words = f"Exact: {many}; this is number {best + 1}, with a difference of {power(float(near[best]))} rad."
    return words if start == best else f"{words} Number {start + 1} was nearer to the start."


def table_html(problem: Problem, run: Run, at: int, units: Units) -> str:
    """The last iterates up to `at`."""
    rows = []
    for k in range(max(0, at - ROWS + 1), at + 1):
        notes = []
        if k and run.shortened[k - 1]:
            notes.append("shortened")
        if k and run.held[k - 1].any():
            notes.append("limit " + ", ".join(str(j + 1) for j in np.flatnonzero(run.held[k - 1])))
        rows.append(
            {
                "number": k,
                "error": _error(problem, run, k, units),
                "step": amount(units.angles, float(run.steps[k - 1])) if k else "",
                "smallest": f"{run.smallest[k]:.4f}",
                "note": ", ".join(notes),
            }
        )
    return render("numeric/table", rows=rows, here=at, last=run.count)


def chart_html(problem: Problem, runs: Sequence[tuple[Method, Run]], units: Units) -> str:
    """Error and step length of each method over the iterations, on logarithmic scales."""
    return render("numeric/chart", chart=error_chart(problem, runs, units))


def error_chart(
    problem: Problem, runs: Sequence[tuple[Method, Run]], units: Units, least: float = LEAST
) -> Markup:
    """The same without its block."""
    lengths, angles = units.lengths, units.angles
    pose = problem.match == "pose"
    rows = [Row(f"Error of the point, {lengths.name}", log=True)]
    if pose:
        rows.append(Row(f"Error of the orientation, {angles.name}", log=True))
    rows.append(Row(f"Length of the step, {angles.name}", log=True))
    curves = []
    for method, run in runs:
        values = [run.far * lengths.scale, *([run.turned * angles.scale] if pose else [])]
        # A step belongs to the iterate that it leads to.
        steps = np.concatenate([run.steps[:1], run.steps]) if run.count else np.full(1, least)
        values.append(steps * angles.scale)
        shown = tuple(np.maximum(value, least) for value in values)
        curves.append(Curve(NAMES[method], np.arange(run.count + 1.0), shown))
    label = "Error and step length over the iterations"
    return with_legend(tuple(rows), tuple(curves), label, "iterations", whole=FEWEST)


def waiting_html(on: bool) -> str:
    """Instead of a picture."""
    text = "Computing …" if on else "The picture takes a second."
    return render("panel/note", text=text)


def basins_html(basins: Basins, name: str, units: Units) -> str:
    """The picture of the basins, with the solutions."""
    unit, plot = units.angles, _plot(basins)
    scaled = replace(plot, x=_times(plot.x, unit.scale), y=_times(plot.y, unit.scale))  # so that ticks are round
    titles = (f"θ₁ of the start, {unit.name}", f"θ₂ of the start, {unit.name}")
    look = f'href="{png_url(pixels(basins))}" preserveAspectRatio="none" style="image-rendering:pixelated"'
    place = f'x="{plot.left}" y="{plot.top}" width="{plot.width:.2f}" height="{plot.height:.2f}"'
    marks = [f"<image {place} {look}/>"]
    for k, (x, y) in enumerate(plot.at(basins.solutions).tolist() if len(basins.solutions) else (), 1):
        look = 'text-anchor="middle" font-size="10" font-weight="700" fill="#000"'
        marks.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="7" fill="#fff" stroke="#000"/>')
        marks.append(f'<text x="{x:.1f}" y="{y + 3.6:.1f}" {look}>{k}</text>')
    drawn = chart((), marks, (Axes(scaled, titles=titles),), _basins_label(basins, name), _size(plot))
    return render("numeric/basins", chart=drawn)


def _size(plot: Plot) -> tuple[float, float]:
    return 300.0, plot.bottom + 36.0


def _times(ends: tuple[float, float], scale: float) -> tuple[float, float]:
    return ends[0] * scale, ends[1] * scale


def _basins_label(basins: Basins, name: str) -> str:
    shares = [f"solution {k} from {100.0 * basins.share(k):.0f} %" for k in range(1, len(basins.solutions) + 1)]
    shares.append(f"none from {100.0 * basins.share(0):.0f} %")
    return f"Basins of attraction of {name}: {', '.join(shares)} of the starts"


def mark_html(basins: Basins, start: Array) -> str:
    """The present start, a layer over the picture."""
    plot = _plot(basins)
    marks = cross(plot.at(np.remainder(start + math.pi, 2.0 * math.pi) - math.pi))
    return render("numeric/mark", chart=chart((), marks, (), "the present start", _size(plot)))


def key_html(basins: Basins, is_mine: bool, units: Units) -> str:
    """The legend of the picture; `is_mine`: it is of the arm on show."""
    unit = units.angles
    colours = [f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in COLOURS.tolist()]
    legend = []
    for k, q in enumerate(basins.solutions[:2], 1):
        at = f"θ₁ = {unit.text(float(q[0]))}, θ₂ = {unit.text(float(q[1]))}"
        legend.append((colours[k], f"solution {k} ({at}): {basins.share(k):.0%} of the starts"))
    legend.append((colours[0], f"none: {basins.share(0):.0%}"))
    return render("numeric/basin_key", legend=legend, is_mine=is_mine)


def _plot(basins: Basins) -> Plot:
    (left, right), (low, high) = (
        (float(1.5 * q[0] - 0.5 * q[1]), float(1.5 * q[-1] - 0.5 * q[-2])) for q in (basins.q1, basins.q2)
    )
    return Plot.equal(_LEFT, _TOP, _SIDE / max(right - left, high - low), (left, right), (low, high))
