"""Calibration by touching on paper: the sheet of crosses true to scale, and the result as one HTML page."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from html import escape

from kin import Robot, builtin_robots
from kin.calibration import Calibration, TableError, TouchBoard
from kin.calibration.fixtures import PAPER
from kin.calibration.words import degrees, millimetres, name_of
from kin.units import fixed

SOURCE = "Calibrated by touching. Nominal table: "
LONGEST_SOURCE = 4000  # characters that robot files may have there
_ARM, _LINE = 6.0, 100.0  # mm: of a cross, of the line to measure
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:52rem;margin:2rem auto;padding:0 1rem;color:#1b1f24}"
    "table{border-collapse:collapse;width:100%;font-size:14px}td,th{padding:2px 8px;text-align:left;"
    "border-bottom:1px solid #d6dae0}td.n{text-align:right;font-variant-numeric:tabular-nums}"
    "tr.out td,tr.unseen td{color:#6a727c}svg{display:block}"
)
_WIDE, _ROW = 300.0, 14.0  # px of a bar chart


def as_own(robot: Robot) -> Robot:
    """The arm found, with a source of its own, and an id that a folder of robot files may have."""
    robot_id = f"{robot.id}-calibrated" if robot.id in builtin_robots() else robot.id
    source = robot.source if robot.source.startswith(SOURCE) else SOURCE + robot.source
    return replace(robot, id=robot_id, source=source[:LONGEST_SOURCE])


def sheet_svg(paper: str) -> str:
    """The crosses of `kin.calibration.TouchBoard.sheet` as an SVG of the size of the paper, numbered from 1.

    x of the board points away from the edge that goes towards the base, z out of the paper.
    """
    board = TouchBoard.sheet(paper)
    width, height = (1000.0 * side for side in PAPER[paper])
    marks = []
    for number, (x, y) in enumerate((1000.0 * board.sockets[:, :2]).tolist(), 1):
        px, py = 0.5 * width + x, 0.5 * height - y
        marks.append(
            f'<path d="M{px - _ARM:.3f} {py:.3f}h{2 * _ARM:g}M{px:.3f} {py - _ARM:.3f}v{2 * _ARM:g}"/>'
            f'<circle cx="{px:.3f}" cy="{py:.3f}" r="3"/>'
            f'<text x="{px + 5:.3f}" y="{py - 4:.3f}">{number}</text>'
        )
    left, low = 0.5 * (width - _LINE), height - 8.0
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" '
        f'viewBox="0 0 {width:g} {height:g}">'
        "<style>path,circle{fill:none;stroke:#000;stroke-width:.2}text{font:4px sans-serif}</style>"
        + "".join(marks)
        + f'<path d="M{left:g} {low - 2:g}v4M{left:g} {low:g}h{_LINE:g}M{left + _LINE:g} {low - 2:g}v4"/>'
        f'<text x="{left:g}" y="{low - 3.5:g}">Print at 100 %. This line is {_LINE:g} mm long: measure it.</text>'
        f'<text transform="translate(6 {0.5 * height:g}) rotate(-90)" text-anchor="middle">'
        "this edge towards the base of the arm</text></svg>\n"
    )


def report(found: Calibration, sockets: Sequence[int]) -> str:
    """The result as one page: how far the tip is expected to be off, how far each touch misses, and every error.

    Args:
        sockets: what was touched, counted from 0; −1 is the plane.
    """
    name = escape(found.robot.name)
    expected = found.expected
    facts = [
        ("with the nominal table", expected.before),
        ("with the table found", expected.after),
        ("95 % are expected to stay below", expected.bound),
        ("of the noise of readings alone", expected.readings),
        ("touches that the fit did not use, nominal table", found.held_out[0]),
        ("touches that the fit did not use, table found", found.held_out[1]),
    ]
    rows = "".join(
        f'<tr><td>{what}</td><td class="n">{millimetres(value)}</td></tr>'
        for what, value in facts
        if not math.isnan(value)
    )
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Calibration of {name}</title>'
        f"<style>{_STYLE}</style><h1>Calibration of {name}</h1><p>{escape(found.text)}</p>"
        f"<h2>Error of the tip</h2><table>{rows}</table>"
        f"<h2>Touches</h2>{_touches(found, sockets)}<h2>Errors of the table</h2>{_errors(found)}</html>\n"
    )


def _touches(found: Calibration, sockets: Sequence[int]) -> str:
    """How far each touch misses, as bars."""
    misses, kept = found.misses.tolist(), set(found.kept.tolist())
    most = max((misses[k] for k in kept), default=0.0) or 1.0
    rows = []
    for k, (miss, socket) in enumerate(zip(misses, sockets, strict=True)):
        out = k not in kept
        length = min(miss / most, 1.0) * _WIDE
        colour = "#b3261e" if out else "#2166ac"
        rows.append(
            f'<tr{" class=out" if out else ""}><td class="n">{k + 1}</td>'
            f"<td>{'plane' if socket < 0 else f'socket {socket + 1}'}</td>"
            f'<td><svg width="{_WIDE:g}" height="{_ROW:g}">'
            f'<rect y="3" width="{length:.1f}" height="8" fill="{colour}"/></svg></td>'
            f'<td class="n">{millimetres(miss)}</td><td>{"left out" if out else ""}</td></tr>'
        )
    return f"<table><tr><th>touch<th>of<th>off by<th><th>{''.join(rows)}</table>"


def _errors(found: Calibration) -> str:
    """Each error with its 95 % interval, drawn in units of the largest of its kind."""
    largest: dict[str, float] = {}
    for error in found.errors:
        largest[_unit(error)] = max(largest.get(_unit(error), 0.0), abs(error.value) + error.interval)
    rows = []
    for error in found.errors:
        scale = 0.5 * _WIDE / (largest[_unit(error)] or 1.0)
        middle = 0.5 * _WIDE + scale * error.value
        half = scale * error.interval
        drawn = (
            f'<svg width="{_WIDE:g}" height="{_ROW:g}"><path d="M{0.5 * _WIDE:g} 0v{_ROW:g}" stroke="#c3c9d1"/>'
            f'<path d="M{middle - half:.1f} 7h{2 * half:.1f}" stroke="#2166ac" stroke-width="2"/>'
            f'<circle cx="{middle:.1f}" cy="7" r="3" fill="#2166ac"/></svg>'
        )
        write = _WRITERS[_unit(error)]
        reason = {"alike": "others move the tip alike", "hidden": "touches hardly depend on it"}.get(
            error.unseen, ""
        )
        rows.append(
            f"<tr{'' if error.seen else ' class=unseen'}><td>{escape(name_of(error))}</td><td>{drawn}</td>"
            f'<td class="n">{write(error.value)}</td><td class="n">± {write(error.interval)}</td>'
            f"<td>{reason or ('in the offset of the motor' if error.in_motor else '')}</td></tr>"
        )
    return f"<table><tr><th>of<th>95 % interval<th><th><th>{''.join(rows)}</table>"


def _unit(error: TableError) -> str:
    if error.kind == "scale":
        return "%"
    return "mm" if error.kind == "tip" or error.field in ("d", "a") else "°"


_WRITERS: dict[str, Callable[[float], str]] = {
    "mm": millimetres,
    "°": degrees,
    "%": lambda share: f"{fixed(100.0 * share, 2)} %",
}
