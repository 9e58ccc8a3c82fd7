"""The common block of the lesson on show, in the visitor's page.

``static/lesson.js`` sends what is pressed and typed there.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
import viser

from app.exercises.judging import read
from app.exercises.typed import EntryError
from app.viewer.feature import Feature, Stage
from app.viewer.lessons.guide import views
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Configuration, Number, Outline
from app.viewer.lessons.guide.progress import Progress
from app.viewer.panel import assign, listen, update_html
from app.viewer.panel.joints import go_to_buttons
from app.viewer.panel.status import Notice
from kin import InputError
from kin.typed import LONGEST

JOINTS_HINT = "The sliders of the tab Move, here as well. A target is typed with Type a target, above the tabs."


class Guide(Feature):
    """Goal, steps, predictions and check of one lesson."""

    key = "guide"
    title = "Lesson"
    shared = True
    messages = frozenset({"go", "answer", "type", "reveal", "pose", "restart"})

    def __init__(self, stage: Stage, lesson: type[Lesson]) -> None:
        super().__init__(stage)
        self._lesson = lesson
        self._errors: dict[str, tuple[str, str]] = {}
        self._progress = Progress(self._outline())
        gui = stage.client.gui
        self._goal = gui.add_html("")
        with gui.add_folder("Steps"):
            self._steps = gui.add_html("")
        self._joints_box = gui.add_checkbox("Joint sliders", False, hint=JOINTS_HINT)
        listen(self._joints_box, self.post, "joints")
        with gui.add_folder(None) as self._container:
            pass
        self._joints: viser.GuiFolderHandle | None = None
        self._shown: Lesson | None = None
        self._show()

    def attach(self, lesson: Lesson) -> None:
        """Let the lesson below the steps follow them."""
        self._shown = lesson
        self._show()

    def handle(self, key: Hashable, value: object) -> None:
        progress = self._progress
        match key:
            case ("go", int()):
                progress.go(value)
                self._errors.clear()
            case ("answer", str(question), int()):
                self._settle(question, value)
            case ("type", str(question), int()):
                self._type(question, value)
            case ("reveal", str(question), int()):
                progress.reveal(question)
                self._errors.pop(question, None)
                self._move_to_end(question)
            case ("pose", int()):
                self._move("start")
            case ("restart", int()):
                progress.restart()
                self._errors.clear()
            case "joints":
                self._show_joints(bool(value))
                return
            case _:
                raise InputError("lesson", key, "a control of its steps")
        self._show()

    def step_name(self, key: Hashable) -> str:
        names = {"go": "Step", "pose": "Pose of the step", "reveal": "Answer shown", "restart": "Answers cleared"}
        return names.get(str(key[0]), "Answer") if isinstance(key, tuple) else "Joint sliders"

    def on_robot(self) -> None:
        at = self._progress.at
        self._progress = Progress(self._outline())
        self._progress.at = min(at, len(self._progress.outline.steps))
        self._errors.clear()
        self._show()

    def on_style(self) -> None:
        self._progress.use(self._outline())
        self._show()

    def on_activity(self) -> None:
        self._show()

    def state(self) -> dict[str, object]:
        return {**self._progress.state(), "joints": self._joints is not None}

    def restore(self, state: dict[str, object]) -> None:
        self._progress.restore(state)
        self._errors.clear()
        self._show()
        if isinstance(joints := state.get("joints"), bool):
            assign(self._joints_box, joints)
            self._show_joints(joints)

    def remove(self) -> None:
        self._show_joints(False)

    def _outline(self) -> Outline:
        return self._lesson.outline(self.stage.now.robot, self.stage.units)

    def _type(self, key: str, text: object) -> None:
        question = self._progress.question(key)
        if not isinstance(question, Number) or not isinstance(text, str):
            raise InputError("answer", text, "a text, for a question with a field")
        try:
            given = read(question, text[: LONGEST + 1])
        except EntryError as error:
            self._errors[key] = (text[: LONGEST + 1], error.detail)
        else:
            self._settle(key, given)

    def _settle(self, key: str, given: object) -> None:
        """Judge an answer; a right one reveals what it predicted."""
        self._errors.pop(key, None)
        closed = self._progress.is_closed(key)
        verdict = self._progress.answer(key, given)
        if verdict.right and not closed:
            self._move_to_end(key)

    def _move_to_end(self, key: str) -> None:
        if key == str(self._progress.at + 1):
            self._move("end")

    def _move(self, where: str) -> None:
        progress = self._progress
        if progress.at == len(progress.outline.steps):
            return
        step = progress.outline.steps[progress.at]
        q: Configuration | None = step.start if where == "start" else step.end
        if q is not None:
            words = "The arm is at the pose of this step." if where == "start" else "The arm shows the answer."
            self.stage.move_to(np.array(q), Notice("hand", f"Step {progress.at + 1}: {step.title}", words))

    def _show(self) -> None:
        if self._shown is not None and (outline := self._shown.on_steps(self._progress)) is not None:
            self._progress.use(outline)
        update_html(self._goal, views.goal_html(self._progress.outline.goal))
        update_html(self._steps, views.steps_html(self._progress, self._errors))

    def _show_joints(self, on: bool) -> None:
        if on == (self._joints is not None):
            return
        if not on:
            self.stage.show_joints(None)
            assert self._joints is not None
            self._joints.remove()
            self._joints = None
            return
        gui = self.stage.client.gui
        with self._container:
            self._joints = gui.add_folder("Joints of the arm")
        self.stage.show_joints(self._joints)
        with self._joints:
            go_to_buttons(gui, self.stage.post)
