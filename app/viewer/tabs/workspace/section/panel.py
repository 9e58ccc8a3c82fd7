"""The section of the workspace: its plot in a panel of its own, and its outline in the scene."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser

from app.exports.svg import Plot, joint_colour
from app.shared.clouds import Cloud, Clouds
from app.shared.computations import SharedComputation, Subscription
from app.shared.summaries import Summaries
from app.viewer.feature import Stage
from app.viewer.panel import update_html
from app.viewer.panel.part import add_html
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


class SectionPanel:
    """A panel to the left of the scene.

    Args:
        root: prefix of node names, never used before in this scene.
    """

    def __init__(self, stage: Stage, root: str) -> None:
        client, robot = stage.client, stage.now.robot
        self.robot = robot
        self._scene = client.scene
        self._stage = stage
        self._root = root
        self._section: Section | None = None
        self._signed: Section | None = None  # what the outline shows
        self._frame: Plot | None = None
        # While a thread adds to them, only that thread uses them. Another cloud gets new ones.
        self._density: plot.Density | None = None
        self._image = ""
        self._units = stage.units
        self._outline: viser.FrameHandle | None = None
        self._angle = math.nan
        self._left = np.zeros(3)
        self._panel = client.gui.add_panel()
        with self._panel.add_tab("Section (r, z)"):
            self._html = add_html(client.gui, render("workspace/section_note", text="Computing the section…"))
            self._dot = add_html(client.gui)
        self._panel.dock_left()
        self._panel.set_width(WIDTH)
        self._panel.expand()  # on a phone it would be collapsed at the end of the sheet

    def take(self, found: Section | None, tool: Array) -> None:
        """Show a computed section; the tool is at `tool` ``(3,)``."""
        if found is None or not found.curves:
            text = "No section: joint 1 is prismatic." if found is None else "The section is empty."
            self._html.content = render("workspace/section_note", text=text)
            return
        self._section, self._frame = found, plot.frame_of(found)
        self._draw()
        self.tool_at(tool)

    def take_outline(self, found: Section | None, tool: Array) -> None:
        """Draw a computed boundary in the scene; the tool is at `tool` ``(3,)``."""
        if found is None:
            return
        self._signed, self._left = found, np.cross(found.v, found.u)
        self._draw_outline(found)
        self.turn(tool)

    def tool_at(self, tool: Array) -> None:
        """Move the dot to the tool ``(3,)``, and turn the outline into its plane."""
        if self._section is None or self._frame is None:
            return
        r, z = radius_and_height(self.robot, tool[None])
        update_html(self._dot, plot.tool_html(self._frame, float(r[0]), float(z[0])))
        self.turn(tool)

    def turn(self, tool: Array) -> None:
        """Turn the outline into the plane of joint 1's axis and the tool ``(3,)``, facing as joint 1 does."""
        section = self._signed
        if section is None or self._outline is None:
            return
        across = tool - section.origin
        x, y = float(across @ section.u), float(across @ self._left)
        faces = float(self._stage.now.q[0])
        angle = math.atan2(y, x) if math.hypot(x, y) > 1e-6 else faces
        if math.cos(angle - faces) < 0.0:
            angle -= math.copysign(math.pi, angle)
        if angle != self._angle:
            self._angle = angle
            half = 0.5 * angle
            self._outline.wxyz = np.array([math.cos(half), *(math.sin(half) * section.v)])

    @property
    def density(self) -> plot.Density | None:
        """The counts of the cloud so far; None: there is no plot."""
        if self._density is None and self._frame is not None:
            self._density = plot.Density(self._frame)
        return self._density

    def show_cloud(self, density: plot.Density, image: str) -> None:
        """Show a finished image of the points."""
        if density is self._density:
            self._image = image
            self._draw()

    def use(self, units: Units) -> None:
        """Plot in these units."""
        if units != self._units:
            self._units = units
            self._draw()

    def drop_cloud(self) -> None:
        """Remove the cloud from the plot; the section stays."""
        self._density = None
        self._image = ""
        self._draw()

    def remove(self) -> None:
        """Close the panel and remove the outline."""
        self._panel.remove()
        if self._outline is not None:
            self._outline.remove()
            self._outline = None
        self._section = self._signed = self._frame = self._density = None

    def _draw(self) -> None:
        if self._section is not None and self._frame is not None:
            self._html.content = plot.plot_html(self._section, self._frame, self._image, self._units)

    def _draw_outline(self, section: Section) -> None:
        """Draw the boundary and its arcs as lines in the plane of joint 1's axis and the tool."""
        self._outline = self._scene.add_frame(self._root, show_axes=False, position=section.origin)
        lines = [(np.concatenate([c, c[:1]]), PLAIN, 2.0) for c in section.curves]
        for arc in section.arcs:
            colour = bytes.fromhex(joint_colour(arc.joint)[1:])
            lines.append((arc.points, (colour[0], colour[1], colour[2]), 4.0))
        for k, (points, color, thickness) in enumerate(lines):
            p = points[:, :1] * section.u + points[:, 1:] * section.v
            self._scene.add_line_segments(
                f"{self._root}/{k}",
                np.stack([p[:-1], p[1:]], axis=1).astype(np.float32),
                color,
                thickness=thickness,
                thickness_units="screen",
            )
        self._angle = math.nan
