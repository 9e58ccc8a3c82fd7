"""The (r, z) section as a plot: boundary, arcs by the joint that draws them, the cloud, and the tool.

The plot is SVG with equal scales on both axes. The cloud is counted in a grid and becomes a small image, redrawn
once a second at most. The dot for the tool is a separate SVG above the first one, so a moving arm sends a hundred
bytes and not the whole plot.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from app.exports.svg import Axes, Plot, chart, joint_colour, png_url
from app.viewer.tabs.workspace.colours import radius_and_height
from app.viewer.views.templates import render
from kin import Robot
from kin.units import Unit, Units, general
from kin.workspace import Section, SectionArc

CLOUD = (0, 114, 178)
WIDTH, TALLEST = 320.0, 500.0
SHORTEST = 88.0  # of the plot itself: that of an arm in a plane is flat, and the vertical axis has a title
LEFT, RIGHT, TOP, BOTTOM = 46.0, 12.0, 10.0, 36.0
CELLS = 112  # along the longer side


def frame_of(section: Section) -> Plot:
    """A plot that holds the section and joint 1's axis."""
    points = np.concatenate(section.curves)
    (_, low), (right, high) = points.min(axis=0), points.max(axis=0)
    margin = 0.04 * max(right, high - low)
    r, z = (0.0, float(right + margin)), (float(low - margin), float(high + margin))
    scale = min((WIDTH - LEFT - RIGHT) / r[1], (TALLEST - TOP - BOTTOM) / (z[1] - z[0]))
    missing = max(0.0, SHORTEST / scale - (z[1] - z[0])) / 2.0
    return Plot.equal(LEFT, TOP, scale, r, (z[0] - missing, z[1] + missing))


class Density:
    """A histogram of a cloud in (r, z), counted part by part."""

    def __init__(self, frame: Plot) -> None:
        self.frame = frame
        wide, high = frame.x[1] - frame.x[0], frame.y[1] - frame.y[0]
        self.cell = max(wide, high) / CELLS
        self.counts = np.zeros((math.ceil(high / self.cell), math.ceil(wide / self.cell)), dtype=np.int64)
        self.parts = 0

    def add(self, robot: Robot, points: NDArray[np.float32]) -> None:
        """Count the points ``(k, 3)`` of the next part."""
        r, z = radius_and_height(robot, points)
        column = ((r - self.frame.x[0]) / self.cell).astype(np.int64)
        row = ((self.frame.y[1] - z) / self.cell).astype(np.int64)
        inside = (column >= 0) & (column < self.counts.shape[1]) & (row >= 0) & (row < self.counts.shape[0])
        flat = row[inside] * self.counts.shape[1] + column[inside]
        self.counts += np.bincount(flat, minlength=self.counts.size).reshape(self.counts.shape)
        self.parts += 1

    def image_url(self) -> str:
        """The counts as a PNG ``data:`` URL: the more points in a cell, the more opaque it is."""
        full = float(np.quantile(self.counts[self.counts > 0], 0.95)) if self.counts.any() else 1.0
        alpha = np.where(self.counts > 0, 40.0 + 150.0 * np.sqrt(np.minimum(self.counts / full, 1.0)), 0.0)
        pixels = np.empty((*self.counts.shape, 4), dtype=np.uint8)
        pixels[..., :3] = CLOUD
        pixels[..., 3] = alpha.astype(np.uint8)
        return png_url(pixels)


def plot_html(section: Section, frame: Plot, image: str, units: Units) -> str:
    """The section with its axes over an `image` of points; above it, the legend of the joints' colours."""
    unit = units.lengths
    titles = (f"r: distance from joint 1's axis, {unit.name}", f"z: height, {unit.name}")
    boundary = (
        f'<path d="{"".join(frame.path(curve, closed=True) for curve in section.curves)}" fill="currentColor" '
        'fill-opacity=".05" fill-rule="evenodd" stroke="currentColor" stroke-width="1.2" stroke-linejoin="round"/>'
    )
    marks = (image, boundary, *(_arc(arc, frame, unit) for arc in section.arcs))
    axes = Axes(frame, titles=titles, unit=unit.scale)
    joints = sorted({arc.joint for arc in section.arcs})
    return render(
        "workspace/section",
        joints=[{"number": joint + 1, "colour": joint_colour(joint)} for joint in joints],
        svg=chart((), marks, (axes,), _label(section, unit), _size(frame)),
    )


def tool_html(frame: Plot, r: float, z: float) -> str:
    """The tool's dot as a separate SVG. Directly after `plot_html`, it takes no space and lies over the plot."""
    x, y = frame.at(np.array([r, z])).tolist()
    dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="#d55e00" stroke="#fff" stroke-width="1.5"/>'
    return render("workspace/tool_dot", svg=chart((), (dot,), (), "the tool", _size(frame)))


def image(density: Density) -> str:
    """The counts as a part of `plot_html`."""
    rows, columns = density.counts.shape
    size = density.cell * density.frame.scale
    return (
        f'<image x="{LEFT:.2f}" y="{TOP:.2f}" width="{columns * size:.2f}" height="{rows * size:.2f}" '
        f'preserveAspectRatio="none" href="{density.image_url()}"/>'
    )


def _label(section: Section, unit: Unit) -> str:
    """What the section shows, and how far it extends."""
    label = "section of the workspace: distance from joint 1's axis and height"
    if not section.curves:
        return label
    points = unit.scale * np.concatenate(section.curves)
    (r_low, z_low), (r_high, z_high) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    r = f"r from {general(r_low, 4)} to {general(r_high, 4)}"
    return f"{label}, {unit.name}: {r}, z from {general(z_low, 4)} to {general(z_high, 4)}"


def _size(frame: Plot) -> tuple[float, float]:
    return WIDTH, frame.bottom + BOTTOM


def _arc(arc: SectionArc, frame: Plot, unit: Unit) -> str:
    colour = joint_colour(arc.joint)
    x, y = frame.at(arc.points[len(arc.points) // 2]).tolist()
    radius = "" if arc.radius is None else f", radius {unit.text(arc.radius)}"
    return (
        f'<g data-arc="{arc.joint + 1}"><title>drawn by joint {arc.joint + 1} alone{radius}</title>'
        f'<path d="{frame.path(arc.points)}" fill="none" stroke="{colour}" stroke-width="3" '
        'stroke-linecap="round"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6.5" fill="{colour}"/>'
        f'<text x="{x:.1f}" y="{y + 3.2:.1f}" text-anchor="middle" '
        f'class="kb-arc-number">{arc.joint + 1}</text></g>'
    )
