"""A drawing of a workspace: the cloud seen along the three axes, and its section, as one SVG.

Each view counts how many points fall into each of its cells and colours the counts, so a picture is as large for
a billion points as for a thousand. All four views have one scale. The section shows what the counts cannot: where
the workspace really ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.exports.svg import Axes, AxisStyle, Plot, joint_colour, png_url, text_of
from kin import Robot
from kin.units import fixed, grouped
from kin.workspace import Section, Span, WorkspaceChunk, WorkspaceFacts

CELLS = 360  # along the longest side
SIZE = 420.0  # pixels of the longest side
GAP, MARGIN = 78.0, 64.0  # between views, around all
INK, SOFT = "#18212b", "#55616e"
STYLE = AxisStyle(
    tick=f'stroke="{SOFT}"', label=f'font-size="11" fill="{SOFT}"', title='font-size="12"', length=5.0, across=44.0
)
# Cividis, sampled: dark is rare, bright is frequent. The order is the same for people with colour blindness.
SCALE = np.array(
    [
        (0, 34, 78),
        (24, 53, 110),
        (63, 75, 109),
        (94, 96, 110),
        (122, 119, 121),
        (153, 143, 116),
        (188, 170, 100),
        (224, 199, 78),
        (254, 232, 56),
    ],
    dtype=np.float64,
)


@dataclass(frozen=True)
class View:
    """One of the four views: the coordinates along its axes, and their ranges (m)."""

    title: str
    right: str
    up: str
    low: tuple[float, float]
    high: tuple[float, float]


class Picture:
    """Counts points chunk by chunk, and draws at the end.

    Args:
        facts: of the same robot and limits; they give the frame.
        section: the (r, z) section, None for an arm that has none.
    """

    def __init__(self, robot: Robot, facts: WorkspaceFacts, section: Section | None) -> None:
        self._robot = robot
        self._facts = facts
        self._section = section
        of = {name: (span.least.value, span.largest.value) for name, span in _spans(facts)}
        self._views = [
            View(f"seen along {eye}", a, b, (of[a][0], of[b][0]), (of[a][1], of[b][1]))
            for eye, a, b in (("z, from above", "x", "y"), ("y", "x", "z"), ("x", "y", "z"))
        ]
        if section is not None:
            # The tool is within the section for every value of joint 1.
            corners = np.concatenate(section.curves) if section.curves else np.zeros((1, 2))
            low, high = corners.min(axis=0), corners.max(axis=0)
            title = "section through the axis of joint 1"
            self._views.append(View(title, "r", "along", (0.0, float(low[1])), (float(high[0]), float(high[1]))))
        widest = max(max(v.high[0] - v.low[0], v.high[1] - v.low[1]) for v in self._views)
        self._cell = max(widest, 1e-9) / CELLS
        self._counts = [np.zeros(self._shape(view), dtype=np.int64) for view in self._views]
        self._points = 0

    def add(self, chunk: WorkspaceChunk) -> None:
        """Count the points of a chunk."""
        p = chunk.points.astype(np.float64)
        self._points += len(p)
        columns = dict(zip("xyz", p.T, strict=True))
        if self._section is not None:
            # The axes of the section: perpendicular to the axis of joint 1, and along it.
            off = p - self._section.origin
            columns["along"] = off @ self._section.v
            columns["r"] = np.linalg.norm(off - columns["along"][:, None] * self._section.v, axis=1)
        for view, counts in zip(self._views, self._counts, strict=True):
            i = np.floor((columns[view.right] - view.low[0]) / self._cell).astype(np.int64)
            j = np.floor((columns[view.up] - view.low[1]) / self._cell).astype(np.int64)
            flat = np.clip(i, 0, counts.shape[0] - 1) * counts.shape[1] + np.clip(j, 0, counts.shape[1] - 1)
            counts += np.bincount(flat, minlength=counts.size).reshape(counts.shape)

    def svg(self) -> str:
        """The drawing as SVG."""
        boxes = [(self._pixels(v.high[0] - v.low[0]), self._pixels(v.high[1] - v.low[1])) for v in self._views]
        columns = [max(box[0] for k, box in enumerate(boxes) if k % 2 == c) for c in (0, 1)]
        rows = [max(box[1] for k, box in enumerate(boxes) if k // 2 == r) for r in (0, 1)]
        width = 2 * MARGIN + GAP + sum(columns)
        top = MARGIN + 40.0
        title = f"Workspace of {text_of(self._robot.name)}"
        height = top + MARGIN + GAP + sum(rows)
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
            f'width="{width:.0f}" height="{height:.0f}" font-family="system-ui, sans-serif" fill="{INK}">',
            f"<title>{title}</title>",
            f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>',
            f'<text x="{MARGIN:.0f}" y="38" font-size="20" font-weight="600">{title}</text>',
            f'<text x="{MARGIN:.0f}" y="60" font-size="13" fill="{SOFT}">{self._words()}</text>',
        ]
        for k, (view, counts, box) in enumerate(zip(self._views, self._counts, boxes, strict=True)):
            x = MARGIN + (columns[0] + GAP if k % 2 else 0.0)
            y = top + (rows[0] + GAP if k // 2 else 0.0)
            parts.append(f'<g transform="translate({x:.1f} {y:.1f})">{self._view(view, counts, box)}</g>')
        return "\n".join([*parts, "</svg>", ""])

    def _shape(self, view: View) -> tuple[int, int]:
        a, b = (max(1, math.ceil((view.high[k] - view.low[k]) / self._cell)) for k in (0, 1))
        return a, b

    def _pixels(self, metres: float) -> float:
        return max(1.0, metres / self._cell / CELLS * SIZE)

    def _words(self) -> str:
        facts = self._facts
        words = [f"{grouped(self._points)} points"]
        words.append(f"reach {_mm(facts.reach.largest.value)} mm from the shoulder")
        if facts.reach.least.value > 5e-4:
            words.append(f"hole {_mm(facts.reach.least.value)} mm")
        if facts.volume is not None:
            words.append(f"volume {facts.volume.value:.4g} ± {facts.volume.error:.1g} m³")
        return " · ".join(words)

    def _view(self, view: View, counts: NDArray[np.int64], box: tuple[float, float]) -> str:
        width, height = box
        scale = width / max(view.high[0] - view.low[0], 1e-9)
        plot = Plot.equal(0.0, 0.0, scale, *zip(view.low, view.high, strict=True))
        names = [f"{name.replace('along', 'z')} (mm)" for name in (view.right, view.up)]
        parts = [
            f'<text y="-12" font-size="13" font-weight="600">{text_of(view.title)}</text>',
            f'<image width="{width:.1f}" height="{height:.1f}" preserveAspectRatio="none" '
            f'style="image-rendering:pixelated" href="{png_url(coloured(counts))}"/>',
            f'<rect width="{width:.1f}" height="{height:.1f}" fill="none" stroke="{SOFT}"/>',
            Axes(plot, titles=(names[0], names[1]), unit=1e3, style=STYLE).svg(),
        ]
        if self._section is not None and view.right == "r":
            line = '<path d="{}" fill="none" stroke="{}" stroke-width="{}"/>'
            parts += [line.format(plot.path(curve, closed=True), INK, 1.6) for curve in self._section.curves]
            parts += [line.format(plot.path(arc.points), joint_colour(arc.joint), 3) for arc in self._section.arcs]
            parts.append(_legend(sorted({arc.joint for arc in self._section.arcs}), width + 14.0))
        return "".join(parts)


def coloured(counts: NDArray[np.int64]) -> NDArray[np.uint8]:
    """RGBA ``(rows, columns, 4)`` of counts ``(right, up)``, the top row first; empty cells are transparent."""
    level = np.log1p(counts.astype(np.float64))
    level /= max(float(level.max()), 1e-9)
    place = level * (len(SCALE) - 1)
    below = np.minimum(place.astype(np.int64), len(SCALE) - 2)
    part = (place - below)[..., None]
    rgba = np.zeros((*counts.shape, 4), dtype=np.uint8)
    rgba[..., :3] = np.rint(SCALE[below] * (1 - part) + SCALE[below + 1] * part)
    rgba[..., 3] = np.where(counts > 0, 255, 0)
    return np.ascontiguousarray(rgba.transpose(1, 0, 2)[::-1])


def draw(robot: Robot, chunks: Iterable[WorkspaceChunk], facts: WorkspaceFacts, section: Section | None) -> str:
    """The drawing of a whole cloud as SVG."""
    picture = Picture(robot, facts, section)
    for chunk in chunks:
        picture.add(chunk)
    return picture.svg()


def _spans(facts: WorkspaceFacts) -> list[tuple[str, Span]]:
    return [("x", facts.x), ("y", facts.y), ("z", facts.z)]


def _legend(joints: list[int], x: float) -> str:
    """Legend: the joint that traces each part of the boundary while the others are at their limits."""
    return "".join(
        f'<rect x="{x:.1f}" y="{18 * k}" width="14" height="4" fill="{joint_colour(joint)}"/>'
        f'<text x="{x + 20:.1f}" y="{18 * k + 6}" font-size="12">joint {joint + 1}</text>'
        for k, joint in enumerate(joints)
    )


def _mm(metres: float) -> str:
    return fixed(1000.0 * metres, 0)
