"""A posture map as a picture (SVG, PNG) and as a table (CSV)."""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from app.exports.picture import INK, MARGIN, SCALE, SOFT, STYLE
from app.exports.svg import Axes, Plot, png, png_url, text_of
from kin.postures import PostureMap

SIZE = 620.0  # drawing units along the longer side
PIXELS = 1000  # about, along a side of the PNG
LINES = {"singular": "#d55e00", "limit": INK}


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


def _pixels(found: PostureMap) -> NDArray[np.uint8]:
    """A pixel for each node ``(rows, columns, 4)``, the largest y first."""
    image = colours(found.counts.T[::-1], int(found.counts.max()))
    return np.concatenate([image, np.full_like(image[..., :1], 255)], axis=-1)


def as_svg(found: PostureMap) -> bytes:
    """The map with axes, borders, the letters of its regions, and a key."""
    return drawing(found).encode()


def drawing(found: PostureMap, side: float = SIZE, fluid: bool = False) -> str:
    """The same as text.

    Args:
        found: the map.
        side: of the map itself; texts have the same size at any.
        fluid: whether the drawing is as wide as what it is in.
    """
    x, y = found.plane.window
    plot = Plot(MARGIN + 20.0, MARGIN + 30.0, side, side, x, y)
    width, height = plot.right + MARGIN + 50.0, plot.bottom + MARGIN
    title, limits = (
        f"Postures of {text_of(found.robot.name)}",
        "inside" if found.respect_limits else "regardless of",
    )
    size = 'width="100%"' if fluid else f'width="{width:.0f}" height="{height:.0f}"'
    names, per_unit = _axes(found)
    in_units = [(factor * low, factor * high) for factor, (low, high) in zip(per_unit, (x, y), strict=True)]
    content = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'{size} font-family="system-ui, sans-serif" fill="{INK}">',
        f"<title>{title}</title><desc>{text_of(found.reason)}</desc>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>',
        f'<text x="{plot.left:.0f}" y="38" font-size="20" font-weight="600">{title}</text>',
        f'<text x="{plot.left:.0f}" y="60" font-size="13" fill="{SOFT}">Number of exact postures {limits} '
        "the joint limits</text>",
        f'<image x="{plot.left:.1f}" y="{plot.top:.1f}" width="{plot.width:.1f}" height="{plot.height:.1f}" '
        f'preserveAspectRatio="none" style="image-rendering:pixelated" href="{png_url(_pixels(found))}"/>',
    ]
    for curve in found.curves:
        dashes = ' stroke-dasharray="4 3"' if curve.kind == "limit" else ""
        line = f'fill="none" stroke="{LINES[curve.kind]}" stroke-width="1.5"{dashes}'
        content.append(f'<path {line} d="{plot.path(curve.points)}"/>')
    for region in found.regions:
        across, down = plot.at(region.place).tolist()
        halo = 'paint-order="stroke" stroke="#fff" stroke-width="3" text-anchor="middle" font-size="13"'
        content.append(f'<text x="{across:.1f}" y="{down + 4.0:.1f}" {halo}>{region.name}</text>')
    axes = Plot(plot.left, plot.top, plot.width, plot.height, *in_units)
    content += [
        Axes(axes, titles=names, style=STYLE).svg(),
        *_key(found, plot.right + 24.0, plot.top),
        "</svg>",
        "",
    ]
    return "\n".join(content)


def as_png(found: PostureMap) -> bytes:
    """The map and its borders in colours, without axes."""
    a, b = found.counts.shape
    side = max(1, round(PIXELS / max(a, b)))
    image = Image.fromarray(_pixels(found)).resize((a * side, b * side), Image.Resampling.NEAREST)
    (x, y), draw = found.plane.window, ImageDraw.Draw(image)
    plot = Plot(0.5 * side, 0.5 * side, (a - 1.0) * side, (b - 1.0) * side, x, y)
    for curve in found.curves:
        draw.line([tuple(each) for each in plot.at(curve.points).tolist()], fill=LINES[curve.kind], width=2)
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


def _axes(found: PostureMap) -> tuple[tuple[str, str], tuple[float, float]]:
    """The titles of both axes, and how many of their units a metre (radian) is."""
    joints, robot = found.plane.joints, found.robot
    if joints is None:
        return ("along u, m", "along v, m"), (1.0, 1.0)
    (first, a), (second, b) = (("°", math.degrees(1.0)) if robot.revolute[i] else ("m", 1.0) for i in joints)
    names = [text_of(robot.joints[i].name) for i in joints]
    return (f"{names[0]}, {first}", f"{names[1]}, {second}"), (a, b)


def _key(found: PostureMap, left: float, top: float) -> list[str]:
    """The colours of the numbers that occur."""
    parts = [f'<text x="{left:.0f}" y="{top + 10.0:.0f}" font-size="12">postures</text>']
    numbers = np.unique(found.counts)
    for k, (number, colour) in enumerate(
        zip(numbers.tolist(), colours(numbers, int(numbers[-1])).tolist(), strict=True)
    ):
        at = top + 20.0 + 20.0 * k
        parts.append(
            f'<rect x="{left:.0f}" y="{at:.0f}" width="14" height="14" fill="rgb{tuple(colour)}" stroke="{SOFT}"/>'
            f'<text x="{left + 20.0:.0f}" y="{at + 11.5:.0f}" font-size="12">{number}</text>'
        )
    return parts
