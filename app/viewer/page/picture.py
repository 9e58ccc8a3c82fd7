"""The picture of a page: what of the scene is in it, and what is said about it."""

from __future__ import annotations

import numpy as np
import viser

from app.viewer.page.controller import ArmController
from app.viewer.panel import update_html
from app.viewer.panel.layout import Panel
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import VisitorCamera
from app.viewer.scene.chain import center_line
from app.viewer.views.templates import render
from app.viewer.viser_patches import SceneFilter
from kin.transforms import Array

THICK = 2.5  # half the thickness of the widest housings, in thicknesses of the thickest link


class Picture:
    """The picture of one page. Not thread-safe: the visitor's worker calls it.

    Args:
        panel: has the places of legend and hints, and the status line.
    """

    def __init__(self, scene: viser.SceneApi, camera: VisitorCamera, arm: ArmController, panel: Panel) -> None:
        self._scene, self._camera, self._arm, self._panel = scene, camera, arm, panel
        self._legend = ""
        self._alone: SceneFilter | None = None  # before all but what is shown alone

    def show_legend(self, html: str) -> None:
        """Say what is drawn in the scene, on whatever tab; "" removes the legend."""
        self._legend = html
        if self._alone is None:
            update_html(self._panel.legend, html)

    def show_alone(self, names: str, notice: Notice) -> None:
        """Hide everything in the scene but nodes whose names begin with `names`, and show this in the status line.

        What is hidden stays as it is, and goes on; so does the status.
        """
        self.show_all()
        self._alone = SceneFilter(self._scene, names)
        self._panel.status.cover(notice)
        update_html(self._panel.legend, "")

    def show_all(self) -> None:
        """Show again what `show_alone` has hidden."""
        if self._alone is not None:
            self._alone.open()
            self._alone = None
            self._panel.status.cover(None)
            update_html(self._panel.legend, self._legend)

    def keep_in_view(self, target: Array | None = None, points: Array | None = None) -> None:
        """Glide to where the picture contains the arm at its goal, and these, if it does not.

        Args:
            target: a point ``(3,)`` above which a number is written.
            points: what is drawn besides ``(n, 3)``.
        """
        self._camera.keep(self._arm.now.goal_points, target, points)

    def place_scale(self) -> None:
        """Write the length of the floor's scale bar where it covers nothing, as camera and tool are now."""
        scene = self._arm.scene
        seen = self._camera.places(np.array([*scene.floor.ends, scene.gizmo_pose[:3, 3]]))
        scene.floor.turn_label(seen, scene.gizmo.scale)

    def show_hints(self, wanted: bool) -> None:
        """Tell ``static/hints.js`` where gizmo and arm are in the picture; a hidden arm gets no hints.

        Of the gizmo: its place, and how long its arrows are there, 0 if it is hidden. Of the arm: how thick it is
        there, and the corners of its centre line.
        """
        place = arm = ""
        if wanted and self._alone is None:
            gizmo, shown = self._arm.scene.gizmo, self._arm.scene.body
            line = np.vstack([gizmo.position, shown.mount.foot, center_line(self._arm.robot, self._arm.goal)])
            (x, y, metre), *line = self._camera.places(line).tolist()
            place = _numbers(x, y, metre * gizmo.scale if gizmo.visible else 0.0)
            arm = _numbers(metre * THICK * shown.size, *(value for point in line for value in point[:2]))
        update_html(self._panel.hints, render("panel/hints", place=place, arm=arm, looking=not wanted))


def _numbers(*values: float) -> str:
    return " ".join(f"{value:.3f}" for value in values)
