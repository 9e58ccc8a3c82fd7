"""Plots as SVG text: axes with round ticks, lines, marks, and embedded images.

`chart` makes every plot of the page; the printed picture of a workspace (`app.exports.picture`) is made of the
same parts. Lengths on the page are drawing units.
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
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from kin.transforms import Array
from kin.units import fixed, general

# The colours of joints 1, 2, … in plots; all of them are legible on white.
JOINT_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#a8518a", "#b87a00", "#2f8fbf", "#8a5a00")

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True)
class Plot:
    """A rectangle in which values are plotted.

    Attributes:
        left, top, width, height: its place on the page.
        x, y: values at its left and right, lower and upper edge.
    """

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]

    @classmethod
    def equal(cls, left: float, top: float, scale: float, x: tuple[float, float], y: tuple[float, float]) -> Plot:
        """With the same scale on both axes: drawing units for one of the plotted units."""
        return cls(left, top, scale * (x[1] - x[0]), scale * (y[1] - y[0]), x, y)

    @property
    def scale(self) -> float:
        """Drawing units for one of the plotted units, across; 0 where there is no room."""
        return self.width / (self.x[1] - self.x[0]) if self.x[1] != self.x[0] else 0.0

    @property
    def right(self) -> float:
        """Right edge on the page."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """Lower edge on the page."""
        return self.top + self.height

    def at(self, points: ArrayLike) -> Array:
        """Page coordinates ``(..., 2)`` of plotted points ``(..., 2)``."""
        x, y = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        low, high = self.y
        rise = self.height / (high - low) if high != low else 0.0
        return np.stack([self.left + self.scale * (x - self.x[0]), self.top + rise * (high - y)], axis=-1)

    def path(self, points: Array, closed: bool = False) -> str:
        """The ``d`` attribute of a line through plotted points ``(k, 2)``."""
        return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in self.at(points).tolist()) + "Z" * closed

    def box(self, x: tuple[float, float], y: tuple[float, float], attributes: str, title: str = "") -> str:
        """A rectangle between plotted values, as a mark; `title`: shown at the pointer."""
        (left, low), (right, high) = self.at([[x[0], y[0]], [x[1], y[1]]]).tolist()
        said = f"><title>{escape(title)}</title></rect>" if title else "/>"
        return (
            f'<rect x="{left:.2f}" y="{min(low, high):.1f}" width="{right - left:.2f}" '
            f'height="{abs(low - high):.1f}" {attributes}{said}'
        )


@dataclass(frozen=True)
class Series:
    """A line of a chart.

    Attributes:
        plot: where it is drawn.
        points: ``(k, 2)``, plotted values.
        attributes: of its SVG path.
        name: shown at the pointer.
    """

    plot: Plot
    points: Array
    attributes: str
    name: str = ""

    def svg(self) -> str:
        """The path."""
        title = f"<title>{escape(self.name)}</title>" if self.name else ""
        return f'<path {self.attributes} d="{self.plot.path(self.points)}">{title}</path>'


@dataclass(frozen=True)
class AxisStyle:
    """How axes are drawn; each string holds SVG attributes.

    Attributes:
        tick, label, title: of the tick lines, of the numbers, and of the axis titles.
        length: of a tick, outside the plot.
        grid: whether ticks continue as grid lines across the plot.
        across: distance of the vertical axis's title from the plot.
        frame: of the rectangle around the plot; "": there is none.
    """

    tick: str
    label: str
    title: str
    length: float = 5.0
    grid: bool = False
    across: float = 44.0
    frame: str = ""


PANEL = AxisStyle(
    tick='stroke="currentColor" stroke-opacity=".18"',
    label='class="kb-axis"',
    title='class="kb-axis"',
    length=4.0,
    grid=True,
    across=37.0,
    frame='fill="none" stroke="currentColor" stroke-opacity=".4"',
)

Labels = Sequence[tuple[float, str]]


@dataclass(frozen=True)
class Axes:
    """The axes of a plot.

    Attributes:
        plot: which they are of.
        x, y: values and texts of the ticks; None: round ones.
        titles: of the horizontal and the vertical axis.
        unit: how many of the shown unit one of the plotted unit is, for round ticks.
        title: above the plot.
    """

    plot: Plot
    x: Labels | None = None
    y: Labels | None = None
    titles: tuple[str, str] = ("", "")
    unit: float = 1.0
    title: str = ""
    style: AxisStyle = PANEL

    def svg(self) -> str:
        """Ticks, numbers and titles; an axis whose range is empty is left out."""
        plot, style = self.plot, self.style
        x, y = (
            (tick_labels(*ends, self.unit) if abs(ends[1] - ends[0]) > 1e-6 else ()) if given is None else given
            for given, ends in ((self.x, plot.x), (self.y, plot.y))
        )
        parts, foot, edge = [], plot.bottom + style.length, plot.left - style.length
        for value, text in x:
            across = float(plot.at((value, plot.y[0]))[0])
            parts.append(
                f'<path d="M{across:.1f} {plot.top if style.grid else plot.bottom:.1f}V{foot:.1f}" {style.tick}/>'
                f'<text x="{across:.1f}" y="{foot + 12:.1f}" text-anchor="middle" {style.label}>{text}</text>'
            )
        for value, text in y:
            at = float(plot.at((plot.x[0], value))[1])
            parts.append(
                f'<path d="M{edge:.1f} {at:.1f}H{plot.right if style.grid else plot.left:.1f}" {style.tick}/>'
                f'<text x="{edge - 3:.1f}" y="{at + 3.7:.1f}" text-anchor="end" {style.label}>{text}</text>'
            )
        middle, centre = (plot.left + plot.right) / 2, (plot.top + plot.bottom) / 2
        places = (
            (f'x="{middle:.1f}" y="{foot + 28:.1f}"', self.titles[0], x),
            (f'transform="translate({plot.left - style.across:.1f} {centre:.1f}) rotate(-90)"', self.titles[1], y),
        )
        parts += [
            f'<text {place} text-anchor="middle" {style.title}>{title}</text>'
            for place, title, labels in places
            if title and labels
        ]
        if self.title:
            place = f'x="{plot.left:.1f}" y="{plot.top - 5:.1f}"'
            parts.append(f'<text {place} class="kb-axis kb-motion-title">{escape(self.title)}</text>')
        return "".join(parts) + (plot.box(plot.x, plot.y, style.frame) if style.frame else "")


def ticks(low: float, high: float) -> list[float]:
    """Three to nine round values between `low` and `high`."""
    rough = (high - low) / 6
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * k for k in (1, 2, 5, 10) if power * k >= rough)
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def chart(
    series: Sequence[Series], marks: Sequence[str], axes: Sequence[Axes], label: str, size: tuple[float, float]
) -> Markup:
    """A chart of the page, as wide as what it is in.

    Args:
        series: the lines, on top.
        marks: whatever else is drawn over the axes, as SVG.
        axes: of each plot, at the bottom.
        label: what it shows, for a screen reader.
        size: width and height of what is drawn, in its own units.
    """
    content = "".join([*(each.svg() for each in axes), *marks, *(each.svg() for each in series)])
    return Markup(
        f'<svg class="kb-plot" viewBox="0 0 {size[0]:.0f} {size[1]:.0f}" width="100%" role="img" '
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


def cross(at: Array) -> tuple[str, str]:
    """A cross at a place on the page ``(2,)``, black with a white edge, as marks."""
    x, y = at.tolist()
    path = f'<path d="M{x - 6.0:.1f} {y:.1f}h12M{x:.1f} {y - 6.0:.1f}v12" stroke="{{}}" stroke-width="{{}}"/>'
    return path.format("#fff", 4), path.format("#000", 1.6)


def text_of(name: str) -> str:
    """A name as the text of an element. XML has no control characters, not even escaped: they become a mark."""
    return escape(_NO_XML.sub("\ufffd", name))


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
