"""Curves over time, or along a way, as SVG: one row for each quantity, with a shared axis and a legend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from app.exports.svg import Axes, Labels, Plot, Series, chart, extremes, few, joint_colour, tick_labels
from kin.transforms import Array
from kin.units import general, raised

WIDTH, LEFT, RIGHT, HIGH, GAP, TOP, BOTTOM = 320.0, 44.0, 8.0, 68.0, 22.0, 16.0, 18.0
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
    rows: Sequence[Array | None]
    color: str = ""
    broken: bool = False


@dataclass(frozen=True)
class Row:
    """One quantity.

    Attributes:
        title: with the unit.
        band: what is allowed; the rest is shaded, as far as it is on the axis. None: everything is.
        log: whether the values, all positive, are drawn on a logarithmic scale.
        shows: values, or their decimal logarithms, that are on the axis whatever the curves are.
        spans: limits that hold for a time: from, to, limit.
    """

    title: str
    band: tuple[float, float] | None = None
    log: bool = False
    shows: tuple[float, ...] = ()
    spans: tuple[tuple[float, float, float], ...] = ()


def with_legend(
    rows: tuple[Row, ...], curves: tuple[Curve, ...], label: str, axis: str = "s", whole: int = 0
) -> Markup:
    """`drawn`, and the names of the curves below."""
    name = Markup('<span class="kb-chart-name"><i style="background:{}"></i>{}</span> ')
    legend = Markup("").join(name.format(_key(i, curve), curve.name) for i, curve in enumerate(curves))
    return Markup('<span class="kb-chart">') + drawn(rows, curves, label, axis, whole) + legend + Markup("</span>")


def drawn(rows: Sequence[Row], curves: Sequence[Curve], label: str, axis: str = "s", whole: int = 0) -> Markup:
    """The curves.

    Args:
        label: what is shown, for a screen reader; the extremes are added.
        axis: unit of the horizontal axis.
        whole: not 0: the axis has whole numbers, and at least as many.
    """
    start = min(float(curve.times[0]) for curve in curves)
    end = max(float(whole), *(float(curve.times[-1]) for curve in curves))
    axes: list[Axes] = []
    marks: list[str] = []
    series: list[Series] = []
    for k, row in enumerate(rows):
        values = [None if (v := curve.rows[k]) is None else np.log10(v) if row.log else v for curve in curves]
        plot = _plot(row, k, [v for v in values if v is not None], (start, end))
        numbers = _powers(*plot.y) if row.log else tick_labels(*plot.y, 1.0)
        axes.append(Axes(plot, (), few(numbers, FEW), title=row.title))
        marks += _limits(row, plot)
        for i, (curve, shown) in enumerate(zip(curves, values, strict=True)):
            if shown is not None:
                style = f'class="kb-motion-curve{" kb-motion-other" * curve.broken}" stroke="{_color(i, curve)}"'
                series.append(Series(plot, np.column_stack([curve.times, shown]), style, curve.name))
    bottom = axes[-1].plot.bottom
    times = few([mark for mark in tick_labels(start, end, 1.0) if not whole or mark[0] % 1.0 == 0.0], 7)
    marks += _numbers(times, axes[-1].plot, axis)
    words = "; ".join(_extremes(row, k, curves, axis) for k, row in enumerate(rows))
    return chart(series, marks, axes, f"{label}. {words}.", (WIDTH, bottom + BOTTOM))


def _plot(row: Row, k: int, values: list[Array], ends: tuple[float, float]) -> Plot:
    """The place of a row, with room for the values and for limits on their side of zero."""
    low = min(*(float(v.min()) for v in values), *row.shows, math.inf)
    high = max(*(float(v.max()) for v in values), *row.shows, -math.inf)
    if row.band is not None:
        low, high = min(low, row.band[0]) if low < 0.0 else low, max(high, row.band[1])
    room = 0.08 * max(high - low, 1e-9)
    end = max(ends[1], ends[0] + 1e-9)
    top = TOP + k * (HIGH + GAP)
    return Plot(LEFT, top, WIDTH - LEFT - RIGHT, HIGH, (ends[0], end), (low - room, high + room))


def _limits(row: Row, plot: Plot) -> list[str]:
    """What is not allowed is shaded, from a dashed line on."""
    parts, lines = [], [(*plot.x, limit) for limit in row.band or ()] + list(row.spans)
    if row.band is not None:
        for edge, outer in zip(row.band, plot.y, strict=True):
            if plot.y[0] < edge < plot.y[1]:
                parts.append(plot.box(plot.x, (edge, outer), 'class="kb-motion-band"'))
    for start, end, limit in lines:
        if plot.y[0] < limit < plot.y[1]:
            parts.append(
                f'<path class="kb-motion-limit" d="{plot.path(np.array([[start, limit], [end, limit]]))}"/>'
            )
    return parts


def _numbers(times: Labels, plot: Plot, axis: str) -> list[str]:
    """The numbers of the shared axis; the last one, with the unit, has priority where two would touch."""
    parts, free = [], WIDTH  # right end of the room for the next number
    for value, text in reversed(times):
        words = f"{text} {axis}" if value == times[-1][0] else text
        half = _HALF * len(words)
        x = min(float(plot.at((value, 0.0))[0]), WIDTH - half)
        if x + half <= free:
            free = x - half - _HALF
            place = f'x="{x:.1f}" y="{plot.bottom + 13:.1f}"'
            parts.append(f'<text {place} text-anchor="middle" class="kb-axis">{words}</text>')
    return parts


def _color(index: int, curve: Curve) -> str:
    return curve.color or joint_colour(index)


def _key(index: int, curve: Curve) -> str:
    """The background of a curve's mark in the legend: broken as its line is."""
    color = _color(index, curve)
    return f"repeating-linear-gradient(90deg,{color} 0 4px,transparent 4px 6px)" if curve.broken else color


def _extremes(row: Row, k: int, curves: Sequence[Curve], axis: str) -> str:
    return extremes(
        row.title, [(each.name, each.times, shown) for each in curves if (shown := each.rows[k]) is not None], axis
    )


def _powers(low: float, high: float) -> list[tuple[float, str]]:
    """The powers of ten between two logarithms; the ends themselves if there are fewer than two."""
    whole = range(math.ceil(low), math.floor(high) + 1)
    if len(whole) < 2:
        return [(value, general(10.0**value, 2)) for value in (low, high)]
    return [(float(power), "10" + raised(power)) for power in whole]
