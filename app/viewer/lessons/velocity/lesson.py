"""The lesson "Velocity": the Jacobian at the present configuration, and the directions lost at singularities.

Ellipsoid and arrows are updated with each frame. Numbers, sentences and the search for singularities follow at
the pace of the panel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Button, Buttons, Control, Folder, Html, Node
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Sweep
from app.viewer.drive import FRAME
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.velocity import section_views, views
from app.viewer.lessons.velocity.drawing import force_scale, lost_ends, scene, truncated
from app.viewer.lessons.velocity.facts import VelocityFacts, scale_of
from app.viewer.lessons.velocity.jog import BUTTONS, button, step
from app.viewer.lessons.velocity.null_motion import MOVING, after
from app.viewer.lessons.velocity.questions import facts
from app.viewer.lessons.velocity.settings import FIRST, LARGEST, VelocitySettings
from app.viewer.scene.gizmo import DragEvent
from app.viewer.step_out import FINDING, STEP_HINT
from kin.transforms import Array

HOLD = 10.0  # steps a second while a button is held
COLUMN_HINT = "Draws this joint's column at the tool: straight arrow v, round arrow ω; a second click removes it"
LEAST_HINT = "Turns the force to the direction in which it takes the least torque of the joints"


class VelocityLesson(DeclaredFeature[VelocitySettings, VelocityFacts], Lesson):
    """See the module."""

    key = "velocity"
    title = "Velocity"
    computes = False
    about = "The velocities and forces of the tool: Jacobian, ellipsoids, singularities."
    asked_of = staticmethod(facts)
    settings_of, facts_of = VelocitySettings, VelocityFacts
    undo: ClassVar[dict[str, str]] = {"on_jog": "Jog"}

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, s, robot, units = self.read, self.settings, self.stage.arm.now.robot, self.stage.display.units
        columns = {str(k + 1): self.event(self.on_column, k) for k in range(robot.n)}
        return [
            *self.unless_asked(
                "singularities",
                Html(views.warning_html, (robot, f.found, units, f.lost_words)),
                Button("Step out", self.event(self.on_step_out), STEP_HINT, visible=f.state != "far"),
            ),
            Control("frame"),
            Folder("Jacobian", self.unless_asked(
                "jacobian",
                Html(views.matrix_html, (robot, f.rows, s.frame, s.joint)),
                Html(views.units_html, (robot, s.frame)),
                Buttons("Column", columns, COLUMN_HINT, of=robot.id),
                Html(views.column_html, (robot, f.J, s.joint)),
            )),
            Folder("Ellipsoid", self.unless_asked("ellipsoid", Control("ellipsoid"), self._ellipsoid(f))),
            Folder("Jog", [
                Control("step"), Control("turn"), Html(views.jog_html),
                *(self._jog_button(axis, sign) for axis, sign in BUTTONS),
            ]),
            Folder("Singular values", self.unless_asked(
                "ellipsoid", Html(views.values_html, (robot, f.rates, f.J)),
            ), open=False),
            Folder("Singularities", self.unless_asked(
                "singularities", Html(views.others_html, (robot, f.found, units)),
            ), open=False),
            Folder("Forces", self.unless_asked(
                "torques",
                Control("statics.on"),
                *(Control(f"statics.force.{k}", f"Along {axis} of the base") for k, axis in enumerate("xyz")),
                Button("Cheapest direction", self.event(self.on_least), LEAST_HINT),
                self._statics(f),
            ), open=False),
            Folder("Null space", self.unless_asked(
                "jacobian", Control("goal"), Control("speed"), Control("runs"), self._null(f),
            ), open=False),
            Folder("Along a line", [
                Button("Start here", self.event(self.on_line_start), section_views.START_HINT),
                Button("Plot the line", self.event(self.on_line_plot), section_views.PLOT_HINT),
                Html(str, (s.plot,)),
            ], open=False),
        ]  # fmt: skip

    def scene(self) -> Sequence[SceneNode]:
        eye = np.asarray(self.stage.client.camera.position)
        return scene(self.facts, self.read, eye, self.stage.activity.withheld)

    def legend(self) -> str:
        f, s = self.read, self.settings
        kind = None if self.hides("ellipsoid") else s.ellipsoid
        joint = None if self.hides("jacobian") else s.joint
        asked = self.hides("singularities")
        state: views.State = "far" if asked else f.state
        return views.legend_html(
            kind, joint, state, f.twists[:0] if asked else f.twists, s.statics.on and not self.hides("torques")
        )

    def _jog_button(self, axis: int, sign: int) -> Button:
        verb = "Turns the tool about" if axis > 2 else "Moves the tool along"
        hint = f"{verb} {'xyz'[axis % 3]} by one step"
        return Button(button(axis, sign), self.event(self.on_jog, axis, sign), hint, HOLD)

    def _ellipsoid(self, f: VelocityFacts) -> Html:
        kind, robot = self.settings.ellipsoid, f.robot
        if kind is None:
            return Html(str)
        scale = scale_of(robot, kind)
        return Html(views.ellipsoid_html, (robot, kind, f.semi, scale, truncated(f), self.stage.display.units))

    def _statics(self, f: VelocityFacts) -> Html:
        if not self.settings.statics.on:
            return Html(str)
        force = np.array(self.settings.statics.force)
        return Html(section_views.statics_html, (f.robot, force, f.torques, *f.least, f.T[:3, :3]))

    def _null(self, f: VelocityFacts) -> Html:
        args = (f.robot, f.task, f.space, f.speeds, f.measure, f.margin)
        return Html(section_views.null_and_margin_html, args)

    # What events do

    def changed(self, path: str) -> None:
        if path.startswith("statics.force"):
            self._push(self.settings.statics.force)
        elif path == "runs":
            self.change(motion=None)

    def on_column(self, joint: int) -> None:
        self.change(joint=None if joint == self.settings.joint else joint)

    def on_jog(self, axis: int, sign: int) -> None:
        stage, arm, s = self.stage, self.stage.arm.now, self.settings
        amount = sign * (s.step if axis < 3 else s.turn)
        request = (arm.robot, arm.goal.tobytes(), arm.options, axis, amount, s.frame, stage.display.units)
        if request == s.refused:
            return
        made = step(arm.robot, arm.goal, arm.options, axis, amount, s.frame, stage.display.units)
        if made.q is None:
            self.change(refused=request)
            stage.status.show(made.notice)
        else:
            stage.arm.move_to(made.q, made.notice)

    def on_step_out(self) -> None:
        """Offer the ways out in the status card."""
        self.change(runs=False)
        self.stage.post(FINDING)

    def on_least(self) -> None:
        size = float(np.linalg.norm(self.settings.statics.force)) or -FIRST[2]
        self._push((size * self.facts.least[0]).tolist())

    def on_tip(self, pull: DragEvent) -> None:
        if pull.phase != "start":
            self._push([x / force_scale(self.stage.arm.now.robot) for x in pull.position])

    def on_line_start(self) -> None:
        self.change(start=self.stage.arm.now.goal, plot=section_views.note_html(section_views.HERE))

    def on_line_plot(self) -> None:
        self.change(
            plot=section_views.plot_html(self.stage.arm.now, self.settings.start, self.stage.display.units)
        )

    def refresh(self) -> None:
        """Show what is declared; the picture contains the arrows of lost directions, or else the arm alone."""
        before = self._lost_ends() if self.shown_at else np.zeros((0, 3))
        super().refresh()
        ends = self._lost_ends()
        if not np.array_equal(ends, before):
            self.stage.picture.keep_in_view(None, ends)

    def _lost_ends(self) -> Array:
        """Where the arrows of lost directions end that are drawn ``(n, 3)``."""
        return np.zeros((0, 3)) if "singularities" in self._withheld else lost_ends(self.read).round(6)

    def running(self) -> Sequence[Sweep]:
        return [Sweep(self._move, FRAME)] if self.settings.runs else []

    def _move(self, seconds: float) -> None:
        """A frame of the motion in the null space; another motion of the arm ends it."""
        arm, motion = self.stage.arm.now, self.settings.motion
        if motion is None:
            motion = arm.goal, arm.T_goal
        made = after(*motion, self.facts, seconds) if np.array_equal(motion[0], arm.goal) else None
        if isinstance(made, tuple):
            self.change(motion=made)
            self.stage.arm.move_to(made[0], MOVING, at_once=True)
            return
        self.change(runs=False, motion=None)
        if made is not None:
            self.stage.status.show(made)

    def _push(self, force: Sequence[float]) -> None:
        """Show this force, within the limits."""
        x, y, z = (min(max(float(value), -LARGEST), LARGEST) for value in force)
        self.change(statics=self.settings.statics.with_value("force", (x, y, z)).with_value("on", True))
