"""The arm as a line drawing for paper: its DH path, joint axes and frames, as SVG and as TikZ.

Parallel projection from a corner above. A drawing is a list of lines, dots and words. Both formats are made from
it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from itertools import pairwise

import numpy as np

from app.exports.svg import joint_colour
from app.exports.worksheet.labels import BASE, LETTER, Label, along, around, covered, placed
from app.exports.worksheet.sheet import SUBSCRIPTS, Sheet
from app.exports.worksheet.words import to_latex
from kin import Robot
from kin.transforms import Array

WIDTH, HEIGHT, MARGIN = 560.0, 340.0, 40.0  # drawing units
EYE = np.array([0.62, -0.68, 0.40])  # the direction from which it is seen
RED, BLUE, INK, SOFT = "#c0392b", "#1f5fbf", "#18212b", "#6b7683"
SAME = 1e-9  # m
SMALL = 10.5  # drawing units: the size of lengths

Projection = Callable[[Array], Array]
Path = list[tuple[Array, tuple[float, float]]]


@dataclass(frozen=True)
class Line:
    """A line through points ``(k, 2)``."""

    points: Array
    colour: str = INK
    width: float = 1.0
    dashed: bool = False
    arrow: bool = False


@dataclass(frozen=True)
class Dot:
    """A filled circle, with a word inside."""

    at: Array
    colour: str
    radius: float
    text: str = ""


@dataclass(frozen=True)
class Word:
    """A word beside a point."""

    at: Array
    text: str
    colour: str = INK
    size: float = 12.0


@dataclass
class Drawing:
    """Lines below dots below words; y points down, as in SVG."""

    lines: list[Line] = field(default_factory=list)
    dots: list[Dot] = field(default_factory=list)
    words: list[Word] = field(default_factory=list)
    about: str = ""

    def svg(self, width: str = "100%") -> str:
        """The drawing as an SVG element, complete as a file too."""
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" width="{width}" '
            f'role="img" aria-label="{escape(self.about, quote=True)}" font-family="sans-serif">',
            '<rect width="100%" height="100%" fill="#fff"/>',
        ]
        for line in self.lines:
            path = "L".join(f"{x:.1f} {y:.1f}" for x, y in line.points.tolist())
            dash = ' stroke-dasharray="5 4"' if line.dashed else ""
            parts.append(
                f'<path d="M{path}" fill="none" stroke="{line.colour}" stroke-width="{line.width:g}"{dash} '
                'stroke-linecap="round" stroke-linejoin="round"/>'
            )
            if line.arrow:
                tip = "L".join(f"{x:.1f} {y:.1f}" for x, y in _head(line.points).tolist())
                parts.append(f'<path d="M{tip}Z" fill="{line.colour}"/>')
        for dot in self.dots:
            x, y = dot.at.tolist()
            parts.append(
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{dot.radius:g}" fill="{dot.colour}" stroke="#fff"/>'
                f'<text x="{x:.1f}" y="{y + 4:.1f}" text-anchor="middle" font-size="11" font-weight="700" '
                f'fill="#fff">{escape(dot.text)}</text>'
            )
        for word in self.words:
            x, y = word.at.tolist()
            parts.append(
                f'<text x="{x:.1f}" y="{y:.1f}" font-size="{word.size:g}" fill="{word.colour}" stroke="#fff" '
                f'stroke-width="3" paint-order="stroke">{escape(word.text)}</text>'
            )
        return "".join([*parts, "</svg>"])

    def tikz(self) -> str:
        """The drawing as a TikZ picture, 12 cm wide."""
        scale = 12.0 / WIDTH

        def at(point: list[float]) -> str:
            return f"({scale * point[0]:.3f},{-scale * point[1]:.3f})"

        def rgb(colour: str) -> str:
            red, green, blue = bytes.fromhex(colour[1:])
            return f"{{rgb,255:red,{red};green,{green};blue,{blue}}}"

        out = [r"\begin{tikzpicture}[line cap=round,line join=round]"]
        for line in self.lines:
            style = f"color={rgb(line.colour)},line width={0.6 * line.width:g}pt"
            style += ",dashed" * line.dashed + ",-latex" * line.arrow
            out.append(rf"\draw[{style}] " + " -- ".join(map(at, line.points.tolist())) + ";")
        for dot in self.dots:
            text = rf"\textbf{{{dot.text}}}"
            out.append(
                rf"\node[circle,inner sep=0.9pt,fill={rgb(dot.colour)},text=white,font=\scriptsize] "
                rf"at {at(dot.at.tolist())} {{{text}}};"
            )
        for word in self.words:
            style = rf"text={rgb(word.colour)},font=\scriptsize,anchor=base west,inner sep=0pt"
            out.append(rf"\node[{style}] at {at(word.at.tolist())} {{{to_latex(word.text)}}};")
        return "\n".join([*out, r"\end{tikzpicture}"])


def draw(sheet: Sheet) -> Drawing:
    """The arm of a sheet at its configuration, with the lengths of its table."""
    path, frames = _path(sheet), _frames(sheet)
    corners = np.concatenate([points for points, _ in path])
    reach = max(float(np.ptp(corners, axis=0).max()), SAME)
    axes = _axes_of(sheet.robot, frames)
    ends = np.array([p + sign * 0.22 * reach * z for p, z in axes for sign in (-1.0, 1.0)])
    to_page = _projection(np.concatenate([corners, ends]))
    out = Drawing(about=f"{sheet.robot.name}: joint axes, frames and lengths")
    for points, _ in path:
        for a, b in pairwise(points):
            if np.linalg.norm(b - a) > SAME:
                out.lines.append(Line(to_page(np.array([a, b])), "#aab3bd", 7.0))
    _add_axes(out, axes, 0.22 * reach, to_page)
    labels = _add_frames(out, sheet.robot, frames, 0.11 * reach, to_page) + _lengths(sheet, path, to_page)
    dots = np.array([[*dot.at, 2.0 * dot.radius, 2.0 * dot.radius] for dot in out.dots])
    lines = [covered(line.points, line.width) for line in out.lines if not line.dashed]
    middles = placed(labels, np.concatenate([dots, *lines]), np.array([WIDTH, HEIGHT]))
    for label, middle in zip(labels, middles, strict=True):
        at = middle + np.array([-0.5 * label.room[0], BASE * label.size])
        out.words.append(Word(at, label.text, label.colour, label.size))
    return out


def _frames(sheet: Sheet) -> list[Array]:
    """The frame at the base and after every row ``(4, 4)``."""
    frames = [sheet.robot.T_world_base]
    for A in sheet.matrices:
        frames.append(frames[-1] @ A)
    return frames


def _path(sheet: Sheet) -> Path:
    """Per row: the points where it starts, turns the corner and ends ``(3, 3)``, and its d and a (m)."""
    robot, frames = sheet.robot, _frames(sheet)
    values = sheet.values_of_rows
    out: Path = []
    for i, row in enumerate(robot.rows):
        before, after = frames[i], frames[i + 1]
        d = row.d + (values[i] if row.kind == "prismatic" else 0.0)
        if robot.convention == "standard":
            corner = before[:3, 3] + d * before[:3, 2]
        else:
            corner = before[:3, 3] + row.a * before[:3, 0]
        out.append((np.stack([before[:3, 3], corner, after[:3, 3]]), (d, row.a)))
    tool = frames[-1] @ robot.T_last_tool
    if np.linalg.norm(robot.T_last_tool[:3, 3]) > SAME:
        out.append((np.stack([frames[-1][:3, 3], frames[-1][:3, 3], tool[:3, 3]]), (0.0, 0.0)))
    return out


def _axes_of(robot: Robot, frames: list[Array]) -> list[tuple[Array, Array]]:
    """A point and the direction of each joint's axis."""
    step = 0 if robot.convention == "standard" else 1
    return [(frames[i + step][:3, 3], frames[i + step][:3, 2]) for i in robot.joint_rows]


def _projection(points: Array) -> Projection:
    """A function from points ``(k, 3)`` to the page ``(k, 2)``, so that these points fill it."""
    eye = EYE / np.linalg.norm(EYE)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    up = np.cross(eye, right)
    flat = np.stack([points @ right, -(points @ up)], axis=1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = np.array([WIDTH - 2.0 * MARGIN, HEIGHT - 2.0 * MARGIN])
    scale = float((room / np.maximum(high - low, SAME)).min())
    middle = 0.5 * np.array([WIDTH, HEIGHT]) - 0.5 * scale * (low + high)

    def to_page(given: Array) -> Array:
        flat = np.stack([given @ right, -(given @ up)], axis=-1)
        return np.asarray(flat * scale + middle)

    return to_page


def _lengths(sheet: Sheet, path: Path, to_page: Projection) -> list[Label]:
    """The lengths of the table, beside their lines."""
    out = []
    unit = sheet.units.lengths
    first = "d" if sheet.robot.convention == "standard" else "a"
    for points, (d, a) in path:
        sizes = {"d": d, "a": a}
        for size, ends in ((sizes[first], points[:2]), (sizes["a" if first == "d" else "d"], points[1:])):
            if abs(size) > SAME:
                text = unit.brief(abs(size))
                start, end = to_page(ends)
                half = 0.5 * LETTER * SMALL * len(text)
                out.append(Label(text, along(start, end, half, 8.0), SOFT, SMALL))
    return out


def _add_axes(out: Drawing, axes: list[tuple[Array, Array]], length: float, to_page: Projection) -> None:
    """Joint axes as dashed lines with their numbers, side by side where joints share a place."""
    placed: list[Array] = []
    for joint, (point, z) in enumerate(axes):
        ends = to_page(np.array([point - length * z, point + length * z]))
        out.lines.append(Line(ends, joint_colour(joint), 1.2, dashed=True))
        at = to_page(point[None])[0]
        same = sum(float(np.linalg.norm(at - other)) < 12.0 for other in placed)
        out.dots.append(Dot(at + np.array([17.0 * same, 0.0]), joint_colour(joint), 8.0, str(joint + 1)))
        placed.append(at)


def _add_frames(
    out: Drawing, robot: Robot, frames: list[Array], length: float, to_page: Projection
) -> list[Label]:
    """x red and z blue at the base, after every row, and at the tool; returns their names.

    Arrows that end at one place share their name.
    """
    tool = frames[-1] @ robot.T_last_tool
    names = [str(i) for i in range(len(frames))]
    if not np.array_equal(robot.T_last_tool, np.eye(4)):
        frames, names = [*frames, tool], [*names, "t"]
    spots: list[tuple[Array, list[str]]] = []  # arrows ``(2, 2)`` and their names
    for frame, name in zip(frames, names, strict=True):
        origin = frame[:3, 3]
        for axis, letter, colour in ((0, "x", RED), (2, "z", BLUE)):
            tip = origin + length * frame[:3, axis]
            ends = to_page(np.array([origin, tip]))
            out.lines.append(Line(ends, colour, 1.6, arrow=True))
            near = (
                names for at, names in spots if np.linalg.norm(at[1] - ends[1]) < 9.0 and names[0][0] == letter
            )
            known = next(near, None)
            label = letter + name.translate(SUBSCRIPTS)
            if known is None:
                spots.append((ends, [label]))
            else:
                known.append(label)
    return [
        Label(" ".join(shared), around(ends[0], ends[1], 10.0), RED if shared[0].startswith("x") else BLUE, 11.0)
        for ends, shared in spots
    ]


def _unit(v: Array) -> Array:
    size = float(np.hypot(*v))
    return v / size if size > 1e-6 else np.array([0.0, -1.0])


def _head(points: Array) -> Array:
    """The triangle at the end of an arrow ``(3, 2)``; none for an arrow that points at the eye."""
    tip, along = points[-1], points[-1] - points[-2]
    size = min(6.0, 0.5 * math.hypot(*along))
    along = _unit(along)
    side = np.array([-along[1], along[0]])
    return np.stack([tip, tip - size * along + 0.5 * size * side, tip - size * along - 0.5 * size * side])
