"""The section of the workspace: its plot in a panel of its own, and its outline in the scene."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from app.exports.svg import Plot, joint_colour
from app.shared.clouds import Cloud, Clouds
from app.shared.computations import SharedComputation, Subscription
from app.shared.summaries import Summaries
from app.viewer.declared.panel import Docked, Html
from app.viewer.declared.scene import Lazy, Node, lines
from app.viewer.declared.work import Result
from app.viewer.tabs.workspace.colours import radius_and_height
from app.viewer.tabs.workspace.section import plot
from app.viewer.views.templates import render
from kin import Robot
from kin.transforms import Array
from kin.units import Units
from kin.workspace import Section

WIDTH = 340  # pixels of the panel
PLAIN = (110, 110, 110)


def subscribe_section(summaries: Summaries, robot: Robot, signed: bool = False) -> Subscription[Section] | None:
    """The shared computation of the (r, z) section of a robot; None if joint 1 is prismatic.

    `signed`: with r negative behind joint 1's axis, for the scene.
    """
    return summaries.section(robot, signed=signed) if robot.joints[0].kind == "revolute" else None


def count(
    computation: SharedComputation[Any], clouds: Clouds, cloud: Cloud, parts: int, density: plot.Density
) -> tuple[plot.Density, str]:
    """Count a cloud's first parts, as far as they are not counted yet; returns the counts and their image."""
    for i in range(density.parts, parts):
        computation.check()
        density.add(cloud.robot, clouds.part(cloud, i).result().points)
    return density, plot.image(density)


def panel(found: Result, frame: Plot | None, image: str, tool: Array, robot: Robot, units: Units) -> Docked:
    """The plot, and in it the tool at `tool` ``(3,)``; without a frame, why there is no plot."""
    nodes = [Html(_note, (found,), key="plot")]
    if frame is not None:
        r, z = radius_and_height(robot, tool[None])
        nodes = [
            Html(plot.plot_html, (found.value, frame, image, units), key="plot"),
            Html(plot.tool_html, (frame, float(r[0]), float(z[0])), key="tool"),
        ]
    return Docked("Section (r, z)", nodes, WIDTH)


def _note(found: Result) -> str:
    text = "Computing the section…"
    if found.finished and found.error is None:
        text = "No section: joint 1 is prismatic." if found.value is None else "The section is empty."
    return render("workspace/section_note", text=text)


def outline(section: Section, tool: Array, q: Array) -> Node:
    """The boundary and its arcs, in the plane of joint 1's axis and the tool ``(3,)``."""
    facing = turned(section, tool, float(q[0]))
    children = [Lazy("lines", _lines, (section,))]
    return Node("frame", "outline", {"show_axes": False}, section.origin, facing, children, keep=False)


def turned(section: Section, tool: Array, joint: float) -> Array:
    """The quaternion ``(4,)`` of that plane, facing as joint 1 does at this angle (rad)."""
    across = tool - section.origin
    x, y = float(across @ section.u), float(across @ np.cross(section.v, section.u))
    angle = math.atan2(y, x) if math.hypot(x, y) > 1e-6 else joint
    if math.cos(angle - joint) < 0.0:
        angle -= math.copysign(math.pi, angle)
    half = 0.5 * angle
    return np.array([math.cos(half), *(math.sin(half) * section.v)])


def _lines(section: Section) -> list[Node]:
    drawn = [(np.concatenate([c, c[:1]]), PLAIN, 2.0) for c in section.curves]
    for arc in section.arcs:
        colour = bytes.fromhex(joint_colour(arc.joint)[1:])
        drawn.append((arc.points, (colour[0], colour[1], colour[2]), 4.0))
    nodes = list[Node]()
    for k, (points, color, thickness) in enumerate(drawn):
        p = points[:, :1] * section.u + points[:, 1:] * section.v
        nodes.append(lines(str(k), np.stack([p[:-1], p[1:]], axis=1), color, thickness))
    return nodes
