"""Calibration by touching on paper: the sheet of crosses true to scale, and the result as one HTML page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from html import escape

from kin import Robot, builtin_robots
from kin.calibration import Calibration, TableError, TouchBoard
from kin.calibration.fixtures import PAPER
from kin.calibration.words import millimetres, remarks

SOURCE = "Calibrated by touching. Nominal table: "
LONGEST_SOURCE = 4000  # characters that robot files may have there
_ARM, _LINE = 6.0, 100.0  # mm: of a cross, of the line to measure
_STYLE = (
    ":root{--ink:#1b1f24;--soft:#5c6570;--line:#d6dae0;--paper:#fff;--mark:#2166ac;--bad:#b3261e;"
    "color-scheme:light dark}"
    "@media(prefers-color-scheme:dark){"
    ":root{--ink:#e8edf2;--soft:#a3afbb;--line:#39434e;--paper:#191f26;--mark:#6cb0ea;--bad:#ff8a80}}"
    "body{font:16px/1.5 system-ui,sans-serif;max-width:52rem;margin:2rem auto;padding:0 1rem;color:var(--ink);"
    "background:var(--paper)}table{border-collapse:collapse;width:100%;font-size:14px}"
    "td,th{padding:2px 8px 2px 0;text-align:left;border-bottom:1px solid var(--line)}"
    "td.n{text-align:right;white-space:nowrap}small{display:block;color:var(--soft)}"
    ".bad,.out small{color:var(--bad)}.unseen{color:var(--soft)}.bar{width:40%}"
    ".bar div{position:relative;height:10px}.bar i,.bar b{position:absolute;background:var(--mark)}"
    ".bar i{height:100%}.out i{background:var(--bad)}.bar b{top:4px;height:2px}"
    ".zero{background:linear-gradient(var(--soft),var(--soft)) 50%/1px 100% no-repeat}"
    ".zero i{width:6px;height:6px;top:2px;margin-left:-3px;border-radius:3px}"
)


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
        f"<tr><td>{what}<td class=n>{millimetres(value)}" for what, value in facts if not math.isnan(value)
    )
    first, *rest = map(escape, remarks(found, len(sockets)))
    faults = "".join(f"<li class=bad>{escape(fault.text)}" for fault in found.faults)
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Calibration of {name}</title><style>{_STYLE}</style><h1>Calibration of {name}</h1>"
        f"<p><strong>{first}</strong></p><ul>{faults}</ul><p>{' '.join(rest)}</p>"
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
        note = f"<small>left out{', its bar is cut' if miss > most else ''}</small>" if out else ""
        rows.append(
            f"<tr{' class=out' if out else ''}><td>{k + 1}"
            f"<td>{'plane' if socket < 0 else f'socket {socket + 1}'}{note}"
            f'<td class=bar><div><i style="width:{100.0 * min(miss / most, 1.0):.1f}%"></i></div>'
            f"<td class=n>{millimetres(miss)}"
        )
    return f"<table><tr><th>touch<th>of<th>off by<th>{''.join(rows)}</table>"


def _errors(found: Calibration) -> str:
    """Each error with its 95 % interval, drawn in units of the largest of its kind."""
    largest: dict[str, float] = {}
    for error in found.errors:
        largest[_unit(error)] = max(largest.get(_unit(error), 0.0), abs(error.value) + error.interval)
    rows = []
    for error in found.errors:
        scale = 50.0 / (largest[_unit(error)] or 1.0)
        middle, half = 50.0 + scale * error.value, scale * error.interval
        rows.append(
            f"<tr{'' if error.seen else ' class=unseen'}><td>{escape(error.text)}"
            f'<td class=bar><div class=zero><b style="left:{middle - half:.1f}%;width:{2.0 * half:.1f}%"></b>'
            f'<i style="left:{middle:.1f}%"></i></div>'
        )
    return f"<table><tr><th>error<th>95 % interval{''.join(rows)}</table>"


def _unit(error: TableError) -> str:
    if error.kind == "scale":
        return "%"
    return "mm" if error.kind == "tip" or error.field in ("d", "a") else "°"
