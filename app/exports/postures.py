"""A posture map as a picture (SVG, PNG) and as a table (CSV).

`page_chart` is the plot of the page: what is not coloured is drawn in the colour of the text.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from app.exports.picture import INK, MARGIN, SCALE, SOFT, STYLE
from app.exports.svg import PANEL, Axes, AxisStyle, Plot, chart, png, png_url, text_of
from kin.postures import PostureMap
from kin.units import DEFAULT_UNITS, Units, typeset

SIZE = 620.0  # drawing units along the longer side
_LEFT, _TOP, _SIDE = 46.0, 6.0, 220.0  # of the map in the page, in drawing units
PAGE_SIZE = (_LEFT + _SIDE + 60.0, _TOP + _SIDE + 36.0)  # with its texts
PIXELS = 1000  # about, along a side of the PNG
SINGULAR = "#d55e00"


class Format(NamedTuple):
    """A file of a map: its ending, its media type, and what writes it."""

    name: str
    media_type: str
    write: Callable[[PostureMap], bytes]


def colours(counts: NDArray[np.int16], most: int) -> NDArray[np.uint8]:
    """The colours of numbers of postures up to `most` ``(…, 3)``: dark is few, bright is many, white is none."""
    place = counts * ((len(SCALE) - 1) / max(most, 1))
    mixed = np.stack([np.interp(place, range(len(SCALE)), SCALE[:, k]) for k in range(3)], axis=-1)
    return np.where(counts[..., None] == 0, 255.0, mixed).astype(np.uint8)


def pixels(found: PostureMap, opacity: float = 1.0) -> NDArray[np.uint8]:
    """A pixel for each node ``(rows, columns, 4)``, the largest y first; one without a posture is transparent."""
    counts = found.counts.T[::-1]
    alpha = np.where(counts == 0, 0.0, 255.0 * opacity).astype(np.uint8)
    return np.dstack([colours(counts, int(found.counts.max())), alpha])


def marks(found: PostureMap, plot: Plot) -> list[str]:
    """The map in a plot: its nodes, the borders, and the letters of its regions."""
    parts = [
        f'<image x="{plot.left:.1f}" y="{plot.top:.1f}" width="{plot.width:.1f}" height="{plot.height:.1f}" '
        f'preserveAspectRatio="none" style="image-rendering:pixelated" href="{png_url(pixels(found))}"/>'
    ]
    for curve in found.curves:
        look = f'stroke="{SINGULAR}"'
        if curve.kind == "limit":
            look = 'stroke="currentColor" stroke-dasharray="4 3"'
        parts.append(f'<path fill="none" {look} stroke-width="1.5" d="{plot.path(curve.points)}"/>')
    halo = f'fill="{INK}" paint-order="stroke" stroke="#fff" stroke-width="3" text-anchor="middle" font-size="13"'
    for region in found.regions:
        across, down = plot.at(region.place).tolist()
        parts.append(f'<text x="{across:.1f}" y="{down + 4.0:.1f}" {halo}>{region.name}</text>')
    return parts


def axes(found: PostureMap, plot: Plot, units: Units, style: AxisStyle) -> Axes:
    """Its axes in these units."""
    joints, robot = found.plane.joints, found.robot
    sides = [("along u", units.lengths), ("along v", units.lengths)]
    if joints is not None:
        sides = [(text_of(robot.joints[i].name), units.of(bool(robot.revolute[i]))) for i in joints]
    (across, u), (up, v) = sides
    x, y = (u.scale * plot.x[0], u.scale * plot.x[1]), (v.scale * plot.y[0], v.scale * plot.y[1])
    titles = f"{across}, {u.name}", f"{up}, {v.name}"
    return Axes(replace(plot, x=x, y=y), titles=titles, style=style)


def key(found: PostureMap, left: float, top: float) -> list[str]:
    """The colours of the numbers that occur."""
    parts = [f'<text x="{left:.0f}" y="{top + 10.0:.0f}" font-size="12" fill="currentColor">postures</text>']
    numbers = np.unique(found.counts)
    for k, (number, colour) in enumerate(
        zip(numbers.tolist(), colours(numbers, int(numbers[-1])).tolist(), strict=True)
    ):
        at, fill = top + 20.0 + 20.0 * k, f"rgb{tuple(colour)}" if number else "none"
        parts.append(
            f'<rect x="{left:.0f}" y="{at:.0f}" width="14" height="14" fill="{fill}" stroke="{SOFT}"/>'
            f'<text x="{left + 20.0:.0f}" y="{at + 11.5:.0f}" font-size="12" fill="currentColor">{number}</text>'
        )
    return parts


def page_plot(found: PostureMap) -> Plot:
    """Where the map is in `page_chart`."""
    return Plot(_LEFT, _TOP, _SIDE, _SIDE, *found.plane.window)


def page_chart(found: PostureMap, units: Units, label: str, over: Sequence[str] = ()) -> Markup:
    """The map as a chart of the page, with what is drawn over it."""
    plot = page_plot(found)
    drawn = [*marks(found, plot), *key(found, plot.right + 8.0, plot.top), *over]
    return chart((), drawn, (axes(found, plot, units, PANEL),), label, PAGE_SIZE)


def as_svg(found: PostureMap) -> bytes:
    """The map with axes, borders, the letters of its regions, and a key."""
    plot = Plot(MARGIN + 20.0, MARGIN + 30.0, SIZE, SIZE, *found.plane.window)
    width, height = plot.right + MARGIN + 50.0, plot.bottom + MARGIN
    title = f"Postures of {text_of(found.robot.name)}"
    limits = "inside" if found.respect_limits else "regardless of"
    content = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'width="{width:.0f}" height="{height:.0f}" font-family="system-ui, sans-serif" fill="{INK}" '
        f'color="{INK}">',
        f"<title>{title}</title><desc>{text_of(typeset(found.reason))}</desc>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>',
        f'<text x="{plot.left:.0f}" y="38" font-size="20" font-weight="600">{title}</text>',
        f'<text x="{plot.left:.0f}" y="60" font-size="13" fill="{SOFT}">Number of exact postures {limits} '
        "the joint limits</text>",
        *marks(found, plot),
        axes(found, plot, DEFAULT_UNITS, STYLE).svg(),
        *key(found, plot.right + 24.0, plot.top),
        "</svg>",
        "",
    ]
    return "\n".join(content).encode()


def as_png(found: PostureMap) -> bytes:
    """The map and its borders in colours, without axes."""
    a, b = found.counts.shape
    side = max(1, round(PIXELS / max(a, b)))
    nodes = Image.fromarray(np.ascontiguousarray(pixels(found)[..., :3]))
    image = nodes.resize((a * side, b * side), Image.Resampling.NEAREST)
    (x, y), draw = found.plane.window, ImageDraw.Draw(image)
    plot = Plot(0.5 * side, 0.5 * side, (a - 1.0) * side, (b - 1.0) * side, x, y)
    for curve in found.curves:
        line = SINGULAR if curve.kind == "singular" else INK
        draw.line([tuple(each) for each in plot.at(curve.points).tolist()], fill=line, width=2)
    return png(np.asarray(image))


def as_csv(found: PostureMap) -> bytes:
    """A row for each node: x and y in metres (radians), and the number of postures."""
    file = io.StringIO()
    file.write("x,y,postures\n")
    for x, row in zip(found.x.tolist(), found.counts.tolist(), strict=True):
        file.writelines(f"{x!r},{y!r},{number}\n" for y, number in zip(found.y.tolist(), row, strict=True))
    return file.getvalue().encode()


FORMATS = {
    each.name: each
    for each in (
        Format("svg", "image/svg+xml", as_svg),
        Format("png", "image/png", as_png),
        Format("csv", "text/csv; charset=utf-8", as_csv),
    )
}
