"""The (r, z) section as a drawing: boundary, arcs by the joint that draws them, the cloud behind, the tool in it.

All is SVG text with equal scales on both axes. The cloud is counted in a grid and becomes a small picture, drawn
once a second at most; the dot that shows the tool is a drawing of its own over the first one, so that a moving arm
sends a hundred bytes and not the whole.
"""

from __future__ import annotations

import math
from base64 import b64encode
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.exports.picture import JOINT_COLOURS, png, ticks
from app.viewer.tabs.workspace.colours import radius_and_height
from app.viewer.units import Unit, Units
from app.viewer.views.mathml import fixed
from kin import Robot, Section
from kin.transforms import Array
from kin.workspace import SectionArc

CLOUD = (0, 114, 178)
WIDTH, TALLEST = 320.0, 500.0
LEFT, RIGHT, TOP, BOTTOM = 46.0, 12.0, 10.0, 36.0
CELLS = 112  # along the longer side
FONT = "font-size:10px;fill:currentColor;font-variant-numeric:tabular-nums"


@dataclass(frozen=True)
class Frame:
    """Where (r, z) in metres is on the drawing."""

    r: tuple[float, float]
    z: tuple[float, float]
    scale: float  # drawing units per metre

    @classmethod
    def of(cls, section: Section) -> Frame:
        """A frame that holds the section and joint 1's line."""
        points = np.concatenate(section.curves)
        (_, low), (right, high) = points.min(axis=0), points.max(axis=0)
        margin = 0.04 * max(right, high - low)
        r, z = (0.0, float(right + margin)), (float(low - margin), float(high + margin))
        scale = min((WIDTH - LEFT - RIGHT) / r[1], (TALLEST - TOP - BOTTOM) / (z[1] - z[0]))
        return cls(r, z, scale)

    @property
    def height(self) -> float:
        """Of the whole drawing."""
        return TOP + BOTTOM + self.scale * (self.z[1] - self.z[0])

    def at(self, points: Array) -> Array:
        """Drawing coordinates ``(k, 2)`` of points ``(k, 2)``."""
        x = LEFT + self.scale * (points[..., 0] - self.r[0])
        y = TOP + self.scale * (self.z[1] - points[..., 1])
        return np.stack([x, y], axis=-1)


class Density:
    """How many points of a cloud are where in (r, z), counted part by part."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame
        wide, high = frame.r[1] - frame.r[0], frame.z[1] - frame.z[0]
        self.cell = max(wide, high) / CELLS
        self.counts = np.zeros((math.ceil(high / self.cell), math.ceil(wide / self.cell)), dtype=np.int64)
        self.parts = 0

    def add(self, robot: Robot, points: NDArray[np.float32]) -> None:
        """Count the points ``(k, 3)`` of the next part."""
        r, z = radius_and_height(robot, points)
        column = ((r - self.frame.r[0]) / self.cell).astype(np.int64)
        row = ((self.frame.z[1] - z) / self.cell).astype(np.int64)
        inside = (column >= 0) & (column < self.counts.shape[1]) & (row >= 0) & (row < self.counts.shape[0])
        flat = row[inside] * self.counts.shape[1] + column[inside]
        self.counts += np.bincount(flat, minlength=self.counts.size).reshape(self.counts.shape)
        self.parts += 1

    def picture(self) -> bytes:
        """The counts as a PNG: the fuller the cell, the less one sees through it."""
        full = float(np.quantile(self.counts[self.counts > 0], 0.95)) if self.counts.any() else 1.0
        alpha = np.where(self.counts > 0, 40.0 + 150.0 * np.sqrt(np.minimum(self.counts / full, 1.0)), 0.0)
        pixels = np.empty((*self.counts.shape, 4), dtype=np.uint8)
        pixels[..., :3] = CLOUD
        pixels[..., 3] = alpha.astype(np.uint8)
        return png(pixels)


def drawing(section: Section, frame: Frame, image: str, units: Units) -> str:
    """The section with its axes over an `image` of points, as HTML; above it, which colour is which joint's."""
    joints = sorted({arc.joint for arc in section.arcs})
    return (
        f'{_legend(joints)}<div data-plot="section">{_svg_open(frame)}'
        f"{image}{_axes(frame, units.lengths)}{_curves(section, frame)}"
        f"{''.join(_arc(arc, frame, units.lengths) for arc in section.arcs)}</svg></div>"
    )


def colour_of(joint: int) -> str:
    """The colour of the arcs that a joint draws."""
    return JOINT_COLOURS[joint % len(JOINT_COLOURS)]


def dot(frame: Frame, r: float, z: float) -> str:
    """The tool as a drawing of its own. Put it right below `drawing`: it takes no room and lies over that."""
    (x, y) = frame.at(np.array([r, z])).tolist()
    return (
        '<div data-plot="tool" style="position:relative;height:0;pointer-events:none">'
        '<div style="position:absolute;left:0;right:0;bottom:0">'
        f'{_svg_open(frame)}<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="#d55e00" stroke="#fff" '
        'stroke-width="1.5"/></svg></div></div>'
    )


def _svg_open(frame: Frame) -> str:
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {frame.height:.0f}" width="100%" role="img" '
        'aria-label="section of the workspace: distance from joint 1\'s axis and height" style="display:block">'
    )


def image(density: Density) -> str:
    """The counts as a part of a `drawing`."""
    frame = density.frame
    rows, columns = density.counts.shape
    size = density.cell * frame.scale
    return (
        f'<image x="{LEFT:.2f}" y="{TOP:.2f}" width="{columns * size:.2f}" height="{rows * size:.2f}" '
        'preserveAspectRatio="none" '
        f'href="data:image/png;base64,{b64encode(density.picture()).decode()}"/>'
    )


def _axes(frame: Frame, unit: Unit) -> str:
    parts = []
    bottom = TOP + frame.scale * (frame.z[1] - frame.z[0])
    right = LEFT + frame.scale * frame.r[1]
    for value, text in _labels(frame.r, unit):
        x = LEFT + frame.scale * value
        parts.append(
            f'<path d="M{x:.1f} {TOP}V{bottom + 4:.1f}" stroke="currentColor" stroke-opacity=".18"/>'
            f'<text x="{x:.1f}" y="{bottom + 15:.1f}" text-anchor="middle" style="{FONT}">{text}</text>'
        )
    for value, text in _labels(frame.z, unit):
        y = TOP + frame.scale * (frame.z[1] - value)
        parts.append(
            f'<path d="M{LEFT - 4} {y:.1f}H{right:.1f}" stroke="currentColor" stroke-opacity=".18"/>'
            f'<text x="{LEFT - 7}" y="{y + 3.5:.1f}" text-anchor="end" style="{FONT}">{text}</text>'
        )
    parts.append(
        f'<path d="M{LEFT} {TOP}V{bottom:.1f}H{right:.1f}" fill="none" stroke="currentColor" stroke-opacity=".6"/>'
        f'<text x="{(LEFT + right) / 2:.1f}" y="{bottom + 30:.1f}" text-anchor="middle" style="{FONT}">'
        f"r: distance from joint 1's axis, {unit.name}</text>"
        f'<text transform="translate(9 {(TOP + bottom) / 2:.1f}) rotate(-90)" text-anchor="middle" style="{FONT}">'
        f"z: height, {unit.name}</text>"
    )
    return "".join(parts)


def _curves(section: Section, frame: Frame) -> str:
    path = "".join(f"{_path(curve, frame)}Z" for curve in section.curves)
    return (
        f'<path d="{path}" fill="currentColor" fill-opacity=".05" fill-rule="evenodd" stroke="currentColor" '
        'stroke-width="1.2" stroke-linejoin="round"/>'
    )


def _arc(arc: SectionArc, frame: Frame, unit: Unit) -> str:
    colour = colour_of(arc.joint)
    x, y = frame.at(arc.points[len(arc.points) // 2]).tolist()
    way = "" if arc.radius is None else f", radius {unit.text(arc.radius)}"
    return (
        f'<g data-arc="{arc.joint + 1}"><title>drawn by joint {arc.joint + 1} alone{way}</title>'
        f'<path d="{_path(arc.points, frame)}" fill="none" stroke="{colour}" stroke-width="3" '
        'stroke-linecap="round"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6.5" fill="{colour}"/>'
        f'<text x="{x:.1f}" y="{y + 3.2:.1f}" text-anchor="middle" '
        f'style="font-size:9px;font-weight:700;fill:#fff">{arc.joint + 1}</text></g>'
    )


def _legend(joints: list[int]) -> str:
    items = "".join(
        f'<span style="white-space:nowrap"><span aria-hidden="true" style="display:inline-block;width:1.4em;'
        f"height:.28em;border-radius:2px;vertical-align:middle;background:{colour_of(j)}"
        f'"></span> joint {j + 1}</span>'
        for j in joints
    )
    arcs = f"Arcs that one joint draws alone: {items}" if joints else "No stretch is drawn by one joint alone."
    return (
        '<div style="margin:.4em 1em .3em;font-size:.76em;line-height:1.7;display:flex;flex-wrap:wrap;gap:0 .8em">'
        f'{arcs}<span style="white-space:nowrap"><span aria-hidden="true" style="color:#d55e00">●</span> '
        "tool</span></div>"
    )


def _path(points: Array, frame: Frame) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in frame.at(points).tolist())


def _labels(ends: tuple[float, float], unit: Unit) -> list[tuple[float, str]]:
    """Round values and their texts, with as many decimals as tell them apart."""
    values = ticks(*ends)
    step = unit.scale * (values[1] - values[0])
    decimals = max(0, math.ceil(-math.log10(step) - 1e-9))
    return [(value, fixed(unit.scale * value, decimals)) for value in values]
