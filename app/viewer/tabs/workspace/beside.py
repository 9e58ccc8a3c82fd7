"""What is known of a workspace beside its cloud: the section's drawing in a panel and its outline in the picture.

Whatever takes longer than a picture may wait is done in threads here, which post what they have found.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from app.exports.svg import Plot, joint_colour
from app.shared.clouds import Cloud, Clouds
from app.shared.summaries import Summaries
from app.shared.threads import lower_priority
from app.viewer.panel import Post
from app.viewer.tabs.workspace import known, plot
from app.viewer.tabs.workspace.colours import radius_and_height
from kin import Robot, Section
from kin.transforms import Array
from kin.units import Units

WIDTH = 340  # pixels of the panel
PLAIN = (110, 110, 110)


def beside(work: Callable[[], None], name: str, post: Post) -> None:
    """Do this in a thread that lets visitors who drag go first; posts ``"failed"`` with the error if it fails."""

    def run() -> None:
        lower_priority()
        try:
            work()
        except Exception as error:  # noqa: BLE001 - whoever takes the post raises it
            post("failed", error)

    threading.Thread(target=run, name=f"workspace-{name}", daemon=True).start()


@dataclass(frozen=True)
class Plotted:
    """Points that were counted, and their image."""

    density: plot.Density
    image: str


class SectionPanel:
    """A panel at the left of the picture. Posts ``"crossed"`` and ``"plotted"`` to itself; `post` brings it back.

    Args:
        root: prefix of node names, never used before in this scene.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        robot: Robot,
        clouds: Clouds,
        summaries: Summaries,
        root: str,
        units: Units,
        post: Post,
    ) -> None:
        self.robot = robot
        self._scene = client.scene
        self._clouds = clouds
        self._root = root
        self._post = post
        self._section: Section | None = None
        self._frame: Plot | None = None
        # The cloud's counts; while a thread adds to them, nobody else touches them. Another cloud gets new ones.
        self._density: plot.Density | None = None
        self._plotting = False
        self._image = ""
        self._units = units
        self._outline: viser.FrameHandle | None = None
        self._angle = math.nan
        self._aside = np.zeros(3)
        self._panel = client.gui.add_panel()
        with self._panel.add_tab("Section (r, z)"):
            self._html = client.gui.add_html(
                '<div style="margin:.6em 1em;font-size:.85em;opacity:.8">Computing the section…</div>'
            )
            self._dot = client.gui.add_html("")
        self._panel.dock_left()
        self._panel.set_width(WIDTH)
        self._panel.expand()  # on a phone it would be a closed line at the end of the sheet
        beside(lambda: post("crossed", (robot, known.cross(summaries, robot))), "section", post)

    def crossed(self, robot: Robot, found: known.Cross, tool: Array) -> None:
        """The section is there; the tool is at `tool` ``(3,)``."""
        if robot != self.robot or self._section is not None:
            return
        if found.section is None or not found.section.curves:
            self._html.content = (
                f'<div style="margin:.6em 1em;font-size:.85em">{found.why_not or "There is no section."}</div>'
            )
            return
        self._section, self._frame = found.section, plot.frame_of(found.section)
        self._aside = np.cross(found.section.v, found.section.u)
        self._draw()
        self._draw_outline(found.section)
        self.tool_at(tool)

    def tool_at(self, tool: Array) -> None:
        """Move the dot and turn the outline to the tool's place ``(3,)``."""
        if self._section is None or self._frame is None:
            return
        r, z = radius_and_height(self.robot, tool[None])
        content = plot.dot(self._frame, float(r[0]), float(z[0]))
        if self._dot.content != content:
            self._dot.content = content
        self.turn(tool)

    def turn(self, tool: Array) -> None:
        """Turn the outline into the upright plane of the tool at ``(3,)``."""
        section = self._section
        if section is None or self._outline is None:
            return
        across = tool - section.origin
        x, y = float(across @ section.u), float(across @ self._aside)
        angle = math.atan2(y, x) if math.hypot(x, y) > 1e-6 else 0.0
        if angle != self._angle:
            self._angle = angle
            half = 0.5 * angle
            self._outline.wxyz = np.array([math.cos(half), *(math.sin(half) * section.v)])

    def count(self, cloud: Cloud, parts: int) -> bool:
        """Count a cloud's first parts into the drawing; False if there is nothing new or it is being done."""
        if self._frame is None or self._section is None or self._plotting:
            return False
        if self._density is not None and self._density.parts >= parts:
            return False
        density = self._density = self._density or plot.Density(self._frame)
        self._plotting = True

        def work() -> None:
            for i in range(density.parts, parts):
                if self._density is not density:
                    return  # another cloud, or none
                density.add(cloud.robot, self._clouds.part(cloud, i).result().points)
            self._post("plotted", Plotted(density, plot.image(density)))

        beside(work, "plot", self._post)
        return True

    def plotted(self, made: Plotted) -> None:
        """An image of the points is there."""
        if made.density is self._density:
            self._plotting = False
            self._image = made.image
            self._draw()

    def use(self, units: Units) -> None:
        """Draw in these units."""
        if units != self._units:
            self._units = units
            self._draw()

    def forget(self) -> None:
        """The cloud is gone; the section stays."""
        self._density = None
        self._plotting = False
        self._image = ""
        self._draw()

    def remove(self) -> None:
        """Close the panel and take the outline away."""
        self._panel.remove()
        if self._outline is not None:
            self._outline.remove()
            self._outline = None
        self._section = self._frame = self._density = None

    def _draw(self) -> None:
        if self._section is not None and self._frame is not None:
            self._html.content = plot.drawing(self._section, self._frame, self._image, self._units)

    def _draw_outline(self, section: Section) -> None:
        """The boundary and its arcs as lines in the plane of joint 1's line and the tool."""
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
