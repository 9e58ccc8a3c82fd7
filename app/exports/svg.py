"""Plots as SVG text: axes with round ticks, paths, and embedded images.

The printed picture of a workspace (`app.exports.picture`) and the section plot of the viewer are made of these
parts. Lengths on the page are drawing units; lengths of the plotted data are metres.
"""

from __future__ import annotations

import io
import math
import re
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from kin.transforms import Array
from kin.units import fixed, general

# The colours of joints 1, 2, … in plots; all of them are legible on white.
JOINT_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#a8518a", "#b87a00", "#2f8fbf", "#8a5a00")

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True)
class Plot:
    """A rectangular plot with equal scales on both axes.

    Attributes:
        left, top: upper left corner on the page.
        scale: drawing units per metre.
        x, y: ranges (m) of the horizontal and the vertical axis.
    """

    left: float
    top: float
    scale: float
    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def right(self) -> float:
        """Right edge on the page."""
        return self.left + self.scale * (self.x[1] - self.x[0])

    @property
    def bottom(self) -> float:
        """Lower edge on the page."""
        return self.top + self.scale * (self.y[1] - self.y[0])

    def at(self, points: Array) -> Array:
        """Page coordinates ``(..., 2)`` of points ``(..., 2)`` in metres."""
        x = self.left + self.scale * (points[..., 0] - self.x[0])
        y = self.top + self.scale * (self.y[1] - points[..., 1])
        return np.stack([x, y], axis=-1)

    def path(self, points: Array, closed: bool = False) -> str:
        """The ``d`` attribute of a line through points ``(k, 2)`` in metres."""
        return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in self.at(points).tolist()) + "Z" * closed


@dataclass(frozen=True)
class AxisStyle:
    """How axes are drawn; each string holds SVG attributes.

    Attributes:
        tick, label, title: of the tick lines, of the numbers, and of the axis titles.
        length: of a tick, outside the plot.
        grid: whether ticks continue as grid lines across the plot.
        across: distance of the vertical axis's title from the plot.
    """

    tick: str
    label: str
    title: str
    length: float = 5.0
    grid: bool = False
    across: float = 44.0


def ticks(low: float, high: float) -> list[float]:
    """Three to nine round values between `low` and `high`."""
    rough = (high - low) / 6
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * k for k in (1, 2, 5, 10) if power * k >= rough)
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def chart(width: float, height: float, label: str, content: str) -> str:
    """A chart of the panel, as wide as the panel is.

    Args:
        width, height: of what is drawn, in its own units.
        label: what it shows, for a screen reader.
        content: SVG.
    """
    return (
        f'<svg class="kb-plot" viewBox="0 0 {width:.0f} {height:.0f}" width="100%" role="img" '
        f'aria-label="{escape(label)}">{content}</svg>'
    )


def extremes(title: str, curves: Sequence[tuple[str, Array, Array]], axis: str) -> str:
    """The lowest and the highest value of a plot in words, for those who do not see it.

    Args:
        title: what is plotted, with its unit.
        curves: of each curve its name, the places ``(k,)`` on the horizontal axis, and the values ``(k,)`` there.
        axis: unit of the horizontal axis.
    """
    _, _, lowest = low = min(curves, key=lambda curve: float(curve[2].min()))
    _, _, highest = high = max(curves, key=lambda curve: float(curve[2].max()))
    if lowest.min() == highest.max():
        return f"{title}: {general(float(lowest.min()), 4)} everywhere"
    words = []
    for (name, places, values), at in ((low, int(lowest.argmin())), (high, int(highest.argmax()))):
        where = f"{name}, " if len(curves) > 1 else ""
        words.append(f"{general(float(values[at]), 4)} ({where}at {general(float(places[at]), 4)} {axis})")
    return f"{title}: from {words[0]} to {words[1]}"


def tick_labels(low: float, high: float, unit: float) -> list[tuple[float, str]]:
    """Round values (m) and their texts in a unit that a metre has `unit` of, with just enough decimals."""
    values = ticks(low, high)
    step = unit * (values[1] - values[0])
    decimals = max(0, math.ceil(-math.log10(step) - 1e-9))
    return [(value, fixed(unit * value, decimals)) for value in values]


def few(labels: list[tuple[float, str]], most: int) -> list[tuple[float, str]]:
    """About `most` of these labels, evenly spread; zero stays."""
    every = math.ceil(len(labels) / most)
    step = labels[1][0] - labels[0][0] if len(labels) > 1 else 1.0
    return [label for label in labels if round(label[0] / step) % every == 0]


def text_of(name: str) -> str:
    """A name as the text of an element. XML has no control characters, not even escaped: they become a mark."""
    return escape(_NO_XML.sub("\ufffd", name))


def axes(plot: Plot, titles: tuple[str, str], unit: float, style: AxisStyle) -> str:
    """The horizontal and the vertical axis; an axis whose range is empty is left out.

    Args:
        titles: of the horizontal and the vertical axis, as SVG text.
        unit: how many of the shown unit a metre has.
    """
    parts = []
    reach_up = plot.top if style.grid else plot.bottom
    reach_right = plot.right if style.grid else plot.left
    if plot.x[1] - plot.x[0] > 1e-6:
        for value, text in tick_labels(*plot.x, unit):
            x = plot.left + plot.scale * (value - plot.x[0])
            parts.append(
                f'<path d="M{x:.1f} {reach_up:.1f}V{plot.bottom + style.length:.1f}" {style.tick}/>'
                f'<text x="{x:.1f}" y="{plot.bottom + style.length + 12:.1f}" text-anchor="middle" '
                f"{style.label}>{text}</text>"
            )
        parts.append(
            f'<text x="{(plot.left + plot.right) / 2:.1f}" y="{plot.bottom + style.length + 28:.1f}" '
            f'text-anchor="middle" {style.title}>{titles[0]}</text>'
        )
    if plot.y[1] - plot.y[0] > 1e-6:
        for value, text in tick_labels(*plot.y, unit):
            y = plot.bottom - plot.scale * (value - plot.y[0])
            parts.append(
                f'<path d="M{plot.left - style.length:.1f} {y:.1f}H{reach_right:.1f}" {style.tick}/>'
                f'<text x="{plot.left - style.length - 3:.1f}" y="{y + 3.7:.1f}" text-anchor="end" '
                f"{style.label}>{text}</text>"
            )
        middle = (plot.top + plot.bottom) / 2
        parts.append(
            f'<text transform="translate({plot.left - style.across:.1f} {middle:.1f}) rotate(-90)" '
            f'text-anchor="middle" {style.title}>{titles[1]}</text>'
        )
    return "".join(parts)


def joint_colour(joint: int) -> str:
    """The colour of a joint, by its index, as CSS."""
    return JOINT_COLOURS[joint % len(JOINT_COLOURS)]


def png(rgba: NDArray[np.uint8]) -> bytes:
    """A PNG file of pixels ``(rows, columns, 4)``."""
    file = io.BytesIO()
    Image.fromarray(rgba).save(file, "PNG")
    return file.getvalue()


def png_url(rgba: NDArray[np.uint8]) -> str:
    """The same as a ``data:`` address."""
    return f"data:image/png;base64,{b64encode(png(rgba)).decode()}"
