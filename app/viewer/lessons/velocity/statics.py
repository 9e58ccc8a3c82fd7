"""Statics in the lesson "Velocity": a force at the tool, dragged or typed, and the joint torques that it takes."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np
import viser

from app.viewer.feature import Stage
from app.viewer.lessons.velocity import section_views as views
from app.viewer.lessons.velocity.drawing import arrow_color
from app.viewer.panel import assign, listen, update_html
from app.viewer.scene.meshes import body
from app.viewer.viser_patches import assign as place
from app.viewer.viser_patches import keep_private
from kin import InputError
from kin.differential.ellipsoids import axes_of
from kin.transforms import Array

LARGEST = 100.0  # N, of each component
FIRST = (0.0, 0.0, -10.0)  # N
LENGTH = 0.35  # of the arrow of 10 N, in radii of the sphere around the arm
HANDLE = 0.11  # of the arrows that are dragged, likewise
NOTHING = 1e-9  # m; a force along a direction with a smaller singular value takes no torque
ON_HINT = "A force with which the tool pushes; drag its tip in the scene, or type it"
LEAST_HINT = "Turns the force to the direction in which it takes the least torque of the joints"


class Statics:
    """The force: its controls, its arrow, and the joint torques. Events come back to `handle`, by their name."""

    def __init__(self, stage: Stage, post: Callable[[Hashable, object], None]) -> None:
        self._stage, self._post = stage, post
        self._on, self._force = False, np.array(FIRST)
        self._held = False
        self._J: Array = np.zeros((6, 1))
        self._T: Array = np.eye(4)
        gui = stage.client.gui
        self._box = gui.add_checkbox("Force at the tool", False, hint=ON_HINT)
        listen(self._box, post, ("statics", "on"))
        self._fields = []
        for k, axis in enumerate("xyz"):
            field = gui.add_number(
                f"F{axis}, N", FIRST[k], min=-LARGEST, max=LARGEST, step=0.1, hint=f"Along {axis} of the base"
            )
            listen(field, post, ("statics", axis))
            self._fields.append(field)
        least = gui.add_button("Cheapest direction", hint=LEAST_HINT)

        @least.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client is not None:
                post(("statics", "least"), None)

        self._html = gui.add_html("")

    def use_robot(self, root: str) -> None:
        """Make the nodes for the arm on show, below the node `root`: it is at the tool, and removed with them."""
        scene, self._radius = self._stage.client.scene, body(self._stage.now.robot).radius
        r = self._radius
        self._arrow = scene.add_arrows(
            f"{root}/force",
            np.zeros((1, 2, 3), np.float32),
            arrow_color(views.FORCE),
            shaft_radius=0.013 * r,
            head_radius=0.034 * r,
            head_length=0.08 * r,
            visible=False,
        )
        self._tip = scene.add_transform_controls(
            f"{root}/tip",
            scale=HANDLE * r,
            line_width=4.0,
            disable_rotations=True,
            disable_sliders=True,
            depth_test=False,
            visible=False,
        )
        keep_private(self._tip)

        @self._tip.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                self._post(("statics", "tip", event.phase), event.target.position.tolist())

    def handle(self, key: tuple[Hashable, ...], value: object) -> None:
        """Process an event of these controls."""
        match key:
            case ("statics", "on"):
                self._on = bool(value)
            case ("statics", "x" | "y" | "z" as axis):
                if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
                    raise InputError(f"F{axis}", value, f"a number from {-LARGEST:g} to {LARGEST:g}")
                self._force["xyz".index(str(axis))] = value
                self._on = True
            case ("statics", "least"):
                axes = axes_of(self._J[:3])
                size = float(np.linalg.norm(self._force)) or -FIRST[2]
                self._force = np.clip(size * axes.R[:, 2], -LARGEST, LARGEST)
                self._on = True
            case ("statics", "tip", str(phase)):
                self._held = phase != "end"
                if phase != "start":
                    dragged = np.array(value, float) / self._scale
                    self._force = np.clip(dragged, -LARGEST, LARGEST)
            case _:
                raise InputError("velocity", key, "a control of this lesson")
        self._write()
        self.draw(self._J, self._T)
        self.show_numbers()

    def state(self) -> dict[str, object]:
        """As JSON."""
        return {"on": self._on, "force": self._force.tolist()}

    def restore(self, state: object) -> None:
        """Take what `state` returned; invalid entries are ignored."""
        if not isinstance(state, dict):
            return
        force = state.get("force")
        if isinstance(force, list) and len(force) == 3 and all(type(x) in (int, float) for x in force):
            found = np.array(force, float)
            if (np.abs(found) <= LARGEST).all():
                self._force = found
        self._on = state.get("on") is True
        self._write()

    @property
    def shown(self) -> bool:
        """Whether the force is on show."""
        return self._on

    def draw(self, J: Array, T: Array) -> None:
        """Draw the force at the tool pose T ``(4, 4)``; J ``(6, n)`` is kept for the numbers."""
        self._J, self._T = J, T
        for node in (self._arrow, self._tip):
            if node.visible != self._on:
                node.visible = self._on
        if self._on:
            end = self._scale * self._force
            self._arrow.points = np.array([[np.zeros(3), end]], np.float32)
            if not self._held:
                place(self._tip, end)

    def show_numbers(self) -> None:
        """Write the joint torques."""
        robot = self._stage.now.robot
        axes = axes_of(self._J[:3])
        tau = torques(self._J, self._force)
        least, cost = axes.R[:, 2], float(axes.values[2])
        html = views.statics_html(robot, self._force, tau, least, cost, self._T[:3, :3]) if self._on else ""
        update_html(self._html, html)

    @property
    def _scale(self) -> float:
        """Metres in the scene for a newton."""
        return LENGTH * self._radius / -FIRST[2]

    def _write(self) -> None:
        assign(self._box, self._on)
        for field, value in zip(self._fields, self._force.tolist(), strict=True):
            assign(field, round(value, 2))


def torques(J: Array, force: Array) -> Array:
    """τ = JᵀF ``(n,)`` for a force ``(3,)`` at the tool point: N·m of joints that turn, N of those that slide."""
    return np.asarray(J[:3].T @ force)
