"""Curves over time as SVG: one row for each quantity, with a shared axis and a legend of the curves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from markupsafe import Markup, escape

from app.exports import svg
from app.exports.svg import few, joint_colour, tick_labels
from kin.transforms import Array
from kin.units import general, raised

WIDTH, LEFT, RIGHT, HIGH, GAP, TOP, BOTTOM = 320.0, 44.0, 8.0, 62.0, 22.0, 16.0, 18.0
_HALF = 3.1  # half of the width of a character
FEW = 4  # numbers on an axis


class Curve(NamedTuple):
    """One curve: its name, and for each row its values ``(k,)`` at `times` ``(k,)``; None: not in this row.

    Attributes:
        color: as CSS; "": the next one.
        broken: whether its line is.
    """

    name: str
    times: Array
    rows: tuple[Array | None, ...]
    color: str = ""
    broken: bool = False


@dataclass(frozen=True)
class Row:
    """One quantity.

    Attributes:
        title: with the unit.
        limit: drawn as a dashed line in both directions; None: there is none.
        log: whether the values, all positive, are drawn on a logarithmic scale.
        shows: values, or their decimal logarithms, that are on the axis whatever the curves are.
    """

    title: str
    limit: float | None = None
    log: bool = False
    shows: tuple[float, ...] = ()


def chart(rows: tuple[Row, ...], curves: tuple[Curve, ...], label: str, axis: str = "s", whole: int = 0) -> Markup:
    """The curves with their legend.

    Args:
        label: what is shown, for a screen reader; the extremes are added.
        axis: unit of the horizontal axis.
        whole: not 0: the axis has whole numbers, and at least as many.
    """
    start = min(float(curve.times[0]) for curve in curves)
    end = max(float(whole), *(float(curve.times[-1]) for curve in curves))
    parts: list[str] = []
    for k, row in enumerate(rows):
        parts += _row(row, k, curves, (start, end))
    bottom = TOP + len(rows) * HIGH + (len(rows) - 1) * GAP
    marks = few([mark for mark in tick_labels(start, end, 1.0) if not whole or mark[0] % 1.0 == 0.0], 7)
    free = WIDTH  # right end of the room for the next number; the last one, with the unit, has priority
    for value, text in reversed(marks):
        words = f"{text} {axis}" if value == marks[-1][0] else text
        half = _HALF * len(words)
        x = min(LEFT + (value - start) / (end - start) * (WIDTH - LEFT - RIGHT), WIDTH - half)
        if x + half <= free:
            free = x - half - _HALF
            parts.append(
                f'<text x="{x:.1f}" y="{bottom + 13:.1f}" text-anchor="middle" class="kb-axis">{words}</text>'
            )
    name = Markup('<span class="kb-chart-name"><i style="background:{}"></i>{}</span> ')
    legend = Markup("").join(name.format(_key(i, curve), curve.name) for i, curve in enumerate(curves))
    words = "; ".join(_extremes(row, k, curves, axis) for k, row in enumerate(rows))
    drawn = Markup(svg.chart(WIDTH, bottom + BOTTOM, f"{label}. {words}.", "".join(parts)))
    return Markup('<span class="kb-chart">') + drawn + legend + Markup("</span>")


def _key(index: int, curve: Curve) -> str:
    """The background of a curve's mark in the legend: broken as its line is."""
    color = curve.color or joint_colour(index)
    return f"repeating-linear-gradient(90deg,{color} 0 4px,transparent 4px 6px)" if curve.broken else color


def _extremes(row: Row, k: int, curves: tuple[Curve, ...], axis: str) -> str:
    return svg.extremes(
        row.title, [(each.name, each.times, shown) for each in curves if (shown := each.rows[k]) is not None], axis
    )


def _row(row: Row, k: int, curves: tuple[Curve, ...], ends: tuple[float, float]) -> list[str]:
    """One quantity of all curves."""
    drawn = [
        None if (shown := curve.rows[k]) is None else np.log10(shown) if row.log else shown for curve in curves
    ]
    values = [shown for shown in drawn if shown is not None]
    low = min(*(float(v.min()) for v in values), *row.shows, math.inf)
    high = max(*(float(v.max()) for v in values), *row.shows, -math.inf)
    if row.limit is not None:
        low, high = (min(low, -row.limit) if low < 0.0 else low), max(high, row.limit)
    room = 0.08 * max(high - low, 1e-9)
    low, high = low - room, high + room
    top, right = TOP + k * (HIGH + GAP), WIDTH - RIGHT

    def y(value: float) -> float:
        return top + (high - value) / (high - low) * HIGH

    parts = [f'<text x="{LEFT}" y="{top - 5:.1f}" class="kb-axis kb-motion-title">{escape(row.title)}</text>']
    marks = _powers(low, high) if row.log else tick_labels(low, high, 1.0)
    for value, text in few(marks, FEW):
        parts.append(
            f'<path d="M{LEFT} {y(value):.1f}H{right:.1f}" stroke="currentColor" stroke-opacity=".16"/>'
            f'<text x="{LEFT - 5:.1f}" y="{y(value) + 3.4:.1f}" text-anchor="end" class="kb-axis">{text}</text>'
        )
    limits = () if row.limit is None else (row.limit, -row.limit)
    shown_limits = [y(limit) for limit in limits if low < limit < high]
    parts += [f'<path class="kb-motion-limit" d="M{LEFT} {at:.1f}H{right:.1f}"/>' for at in shown_limits]
    for i, (curve, shown) in enumerate(zip(curves, drawn, strict=True)):
        if shown is not None:
            across = LEFT + (curve.times - ends[0]) / (ends[1] - ends[0]) * (right - LEFT)
            points = zip(across.tolist(), np.vectorize(y)(shown).tolist(), strict=True)
            path = "L".join(f"{a:.1f} {b:.1f}" for a, b in points)
            dashes = ' stroke-dasharray="5 3"' if curve.broken else ""
            color = curve.color or joint_colour(i)
            parts.append(f'<path class="kb-motion-curve" d="M{path}" stroke="{color}"{dashes}/>')
    parts.append(
        f'<rect x="{LEFT}" y="{top:.1f}" width="{right - LEFT:.1f}" height="{HIGH}" fill="none" '
        'stroke="currentColor" stroke-opacity=".4"/>'
    )
    return parts


def _powers(low: float, high: float) -> list[tuple[float, str]]:
    """The powers of ten between two logarithms; the ends themselves if there are fewer than two."""
    whole = range(math.ceil(low), math.floor(high) + 1)
    if len(whole) < 2:
        return [(value, general(10.0**value, 2)) for value in (low, high)]
    return [(float(power), "10" + raised(power)) for power in whole]
