"""The lesson "DH table step by step".

A large frame moves from the base to the tool, one elementary motion of the table after another, on the arm in its
present configuration. In *Assign it yourself*, the student makes a table of the arm instead.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import ClassVar

from app.exports.worksheet import Left
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Buttons, Control, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Sweep
from app.viewer.feature import Stage
from app.viewer.lessons.dh import assign_drawing, drawing, views
from app.viewer.lessons.dh.assign import assign_html, measured_html, rows_html
from app.viewer.lessons.dh.attempt import Attempt
from app.viewer.lessons.dh.axes_drawing import axis_names, joint_axes, room
from app.viewer.lessons.dh.both import BothInView
from app.viewer.lessons.dh.facts import DHFacts
from app.viewer.lessons.dh.player import walked
from app.viewer.lessons.dh.questions import facts
from app.viewer.lessons.dh.settings import DHSettings
from app.viewer.lessons.dh.steps import length
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.scene.meshes import body
from kin import InputError

FRAME = 1 / 30  # s between frames while playing
MOTION_HINT = "Back and Next: to the end of the previous or next motion"


class DHLesson(DeclaredFeature[DHSettings, DHFacts], Lesson):
    """The walk through the table of the selected robot, or a table that the student makes."""

    key = "dh"
    by_rows = True
    through = True
    title = "DH table step by step"
    computes = False
    about = "How four motions per row lead from the base to the tool, one after another."
    messages = frozenset({"choose", "check", "show", "back", "restart"})
    asked_of = staticmethod(facts)
    settings_of, facts_of = DHSettings, DHFacts
    left: ClassVar[Left] = "table"
    pace = 0.1

    def __init__(self, stage: Stage) -> None:
        self._camera = BothInView(stage)
        super().__init__(stage)

    def started(self) -> None:
        robot = self.stage.arm.now.robot
        size = body(robot).size
        self._measured, self._axes = FigureNodes(size), FigureNodes(size)
        self.stage.arm.scene.see_through(True)
        self.stage.camera.fit(room(robot))
        self._camera.forget()
        self._aim()

    def restore(self, state: dict[str, object]) -> None:
        self.change(plays=False)
        super().restore(state)
        if not self._compares:
            self._camera.restore()

    def remove(self) -> None:
        super().remove()
        self._camera.restore()
        self.stage.arm.scene.see_through(False)
        self.stage.camera.fit(())

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, s, units, robot = self.read, self.settings, self.stage.display.units, self.read.robot
        asked = self.hides("motions")
        first, nine = Control("assign"), Html(views.nine_steps_html, (robot.convention,), key="nine")
        if s.assign is not None:
            block = Html(assign_html, (s.assign, units), key="block")
            # Apart from the fields: it changes while the arm moves, and what is being typed must stay.
            measured = () if asked else (Html(measured_html, (s.assign, f.q, units), key="measured"),)
            rows = Html(rows_html, (s.assign.work, f.q, units, asked), key="rows")
            return [first, block, *measured, rows, nine]
        motions = {
            name: self.event(getattr(self, f"on_{name.lower()}")) for name in ("Back", "Play", "Pause", "Next")
        }
        offered = ("Back", "Pause" if s.plays else "Play", "Next")
        comparison = (robot, f.other, f.q, f.other_place, f.apart, units, asked) if s.compare else ()
        return [
            first,
            Html(views.caption_html, (robot, f.place, units, asked, not self.hides("order")), key="caption"),
            Control("at"),
            Buttons("Motion", motions, MOTION_HINT, offered),
            Html(views.table_html, (robot, f.q, f.place, units, "", (), asked), key="table"),
            *self.unless_asked("motions", Html(views.matrices_html, (robot, f.place, s.symbols, units), key="A")),
            Control("symbols"),
            Control("compare"),
            *([Html(views.compare_html, comparison, key="comparison")] if comparison else []),
            Control("speed"),
            Control("lines"),
            nine,
        ]

    def scene(self) -> Sequence[SceneNode | Lazy]:
        f, s, units = self.facts, self.settings, self.stage.display.units
        if s.assign is not None:
            return assign_drawing.scene(s.assign, f.q, self._axes, units)
        nodes = drawing.walk(f, self.read, self._measured, units, self.hides("motions"))
        if s.compare:  # it has axes of its own
            return [*nodes, *drawing.both(f, self.read)]
        if s.lines:
            with self._axes as figure:
                nodes += joint_axes(figure, f.robot, f.q, axis_names(f.robot))
        return nodes

    # Events

    def changed(self, path: str) -> None:
        if path in ("at", "assign"):
            self.change(plays=False)
        if path in ("compare", "assign"):
            self._aim()

    def heard(self, key: Hashable, value: object) -> None:
        """Do what was asked for in the block of the student's own table; raises `InputError`."""
        if self.settings.assign is None:
            raise InputError("lesson", key, "a control of this lesson that is on show")
        attempt = self.settings.assign.copy()
        match key:
            case ("choose", str(part), int()):
                attempt.choose(part, value)
            case ("check", int()):
                attempt.check(value, self.stage.arm.now.q, self.stage.display.units)
            case ("show", int()):
                attempt.show()
            case ("back", int()):
                attempt.back()
            case ("restart", int()):
                attempt = Attempt.begun(self.stage.arm.now.robot)
            case _:
                raise InputError("lesson", key, "a control of its block")
        self.change(assign=attempt)

    def on_back(self) -> None:
        """Go to the end of the previous motion."""
        self._go(math.ceil(self.settings.at) - 1)

    def on_next(self) -> None:
        """Go to the end of the next motion."""
        self._go(math.floor(self.settings.at) + 1)

    def on_play(self) -> None:
        """Go on by itself, from the base if it was at the end."""
        if self.settings.at >= length(self.stage.arm.now.robot):
            self.change(at=0.0)
        self.change(plays=True, rest=0.0)

    def on_pause(self) -> None:
        """Stay here."""
        self.change(plays=False)

    def _go(self, at: int) -> None:
        self.change(plays=False, at=float(min(max(at, 0), length(self.stage.arm.now.robot))))

    def running(self) -> Sequence[Sweep]:
        return [Sweep(self._walk, FRAME)] if self.settings.plays else []

    def _walk(self, seconds: float) -> None:
        arm, s = self.stage.arm.now, self.settings
        at, rest = walked(arm.robot, arm.q, s.at, s.rest, s.speed, seconds)
        self.change(at=at, rest=rest, plays=at < length(arm.robot))

    # The camera

    @property
    def _compares(self) -> bool:
        return self.settings.compare and self.settings.assign is None

    def _aim(self) -> None:
        if self._compares:
            self._camera.show(self.stage.arm.now.robot)
        else:
            self._camera.restore()
