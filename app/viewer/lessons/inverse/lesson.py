"""The lesson "Inverse kinematics step by step": the closed form of an arm, derived with numbers.

`derive` has the derivations as facts: formulas and their values. `exercise` judges the branches, `shapes` says
what is drawn in each step, `questions` and `mistakes` what is asked, `words` and `views` put it into words.

The student follows one branch. It changes when another way is typed, or chosen with *Follow*; the numbers and the
figure are those of this branch, for the target in the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import kin
from app.exercises.lesson_text import texts_of
from app.exports.worksheet import Left
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Button, Buttons, Control, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.feature import Stage
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Number, Outline
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.guide.progress import Progress
from app.viewer.lessons.inverse import views
from app.viewer.lessons.inverse.derive import signs_of
from app.viewer.lessons.inverse.drawing import figure, room
from app.viewer.lessons.inverse.exercise import Exercise, flipped
from app.viewer.lessons.inverse.facts import InverseFacts
from app.viewer.lessons.inverse.questions import outline, outline_of
from app.viewer.lessons.inverse.settings import InverseSettings
from app.viewer.lessons.inverse.sheet import StepKey
from app.viewer.panel.status import Notice
from app.viewer.scene.meshes import body
from kin import Robot

FOLLOW_HINT = "The branch that the numbers and the figure follow, by its number in the tree"
POSTURE_HINT = "Moves the arm to the branch that you follow"
ASK_HINT = "Asks the questions again, about the pose that the arm has now"
ARM_HINT = "Shows this arm"


class InverseLesson(DeclaredFeature[InverseSettings, InverseFacts], Lesson):
    """See the module."""

    key = "inverse"
    by_rows = True
    through = True
    title = "Inverse kinematics step by step"
    about = "From a target to the joint angles by hand, and where each solution comes from."
    outline = staticmethod(outline)
    settings_of, facts_of = InverseSettings, InverseFacts
    left: ClassVar[Left] = "configuration"
    undo: ClassVar[dict[str, str]] = {"on_follow": "Branch", "on_arm": "Arm"}
    pace = 0.1

    def __init__(self, stage: Stage) -> None:
        self._arms: dict[Robot, InverseSettings] = {}  # what was asked and followed on other arms
        super().__init__(stage)

    def started(self) -> None:
        if (own := self._arms.get(self.stage.arm.now.robot)) is not None:
            self.change(q=own.q, signs=own.signs, taken=own.taken)
        self._figures = dict[StepKey, FigureNodes]()  # labels of one step take no room from those of another
        self.invalidate()
        f = self.facts
        if f.exists or self.settings.drawn:
            self.stage.arm.scene.see_through(f.exists, gizmo=f.exists)
            self.stage.camera.fit(room(f.derived, f.followed.derivation, f.keys) if f.exists else ())
        self.change(drawn=f.exists)

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, units = self.read, self.stage.display.units
        if not f.exists:
            arms = [
                Button(
                    self.stage.services.store.get(robot).name, self.event(self.on_arm, robot), ARM_HINT, key=robot
                )
                for robot in texts_of(self.key).arms
            ]
            return [Html(views.others_html, (f.robot,), key="others"), *arms]
        opened = dict(zip(f.keys, f.opened, strict=True))
        numbers = f.derived, f.followed, f.keys, f.opened, self.settings.step, units
        inside = sum(branch.available for branch in f.branches)
        follow = {str(b.number): self.event(self.on_follow, i) for i, b in enumerate(f.branches)}
        return [
            Html(views.derivation_html, numbers, key="numbers"),
            Html(views.tree_html, (f.derived, f.tree, inside, opened, units), key="tree"),
            *([Control("psi", value=f.psi, of=f.robot.id)] if f.derived.family == "srs7" else []),
            Buttons("Follow", follow, FOLLOW_HINT, of=f.robot.id),
            Button("Show this posture", self.event(self.on_posture), POSTURE_HINT, key="posture"),
            Button("Ask about this pose", self.event(self.on_ask), ASK_HINT, key="ask"),
            Control("all"),
        ]

    def scene(self) -> Sequence[Lazy]:
        f = self.read
        return [Lazy("figure", self._shapes, (f, self.stage.display.units))] if f.exists else []

    def _shapes(self, *args: object) -> Sequence[SceneNode]:
        """The figure of the step on show; the check has that of the whole posture."""
        f = self.read
        at = min(f.settings.step, len(f.keys) - 1)
        nodes = self._figures.setdefault(f.keys[at], FigureNodes(body(f.robot).size))
        return figure(f.derived, f.followed.derivation, f.keys[at], nodes, self.stage.display.units, f.opened[at])

    # The steps

    def on_steps(self, progress: Progress) -> Outline | None:
        at, steps = progress.at, progress.outline.steps
        if self.facts.robot is not self.stage.arm.now.robot or (at < len(steps) and steps[at].about is not None):
            return None  # the step is about another arm, whose derivation has other steps
        if self.settings.restart:
            progress.restart()
            self.change(restart=False, taken={})
        progress.use(self._outline(progress.outline))
        for number, key in enumerate(self.facts.keys, 1):
            self._take_way(progress, str(number), key)
        asked = dict(progress.outline.questions())
        numbers = [str(i + 1) for i in range(len(self.facts.keys))]
        answered = tuple(
            progress.is_closed(number) if number in asked else i <= progress.at for i, number in enumerate(numbers)
        )
        self.change(step=progress.at, answered=answered)
        self.schedule()
        return progress.outline

    @property
    def _exercise(self) -> Exercise:
        """What the questions are about now."""
        self.invalidate()
        return self.facts.exercise

    def _outline(self, before: Outline) -> Outline:
        """The outline with the questions about it, in the words of the one before."""
        units = self.stage.display.units
        asked = self.completed(outline_of(self._exercise, units, before.text), self.facts.robot, units)
        return replace(asked, unfit=before.unfit)

    def _take_way(self, progress: Progress, number: str, key: StepKey) -> None:
        """Follow the other way where the student has typed it."""
        question, answer = dict(progress.outline.questions()).get(number), progress.given.get(number)
        if not isinstance(question, Number) or answer is None or number in progress.revealed:
            return
        if self.settings.taken.get(number) == answer:
            return
        self.change(taken={**self.settings.taken, number: answer})
        given = self._exercise
        step = given.followed.derivation.step(key)
        if question.way_of(answer) > 0 and step is not None and step.split >= 0:
            self.change(signs=flipped(given.signs, step.split))
            progress.use(self._outline(progress.outline))

    # Events

    def on_offer(self) -> None:
        """Go on with the branch that a step offers where the derivation has ended."""
        if (back := self._exercise.way_back) is not None:
            self.on_follow(back.number - 1)

    def on_follow(self, index: int) -> None:
        """Follow another branch."""
        self.change(signs=self.facts.branches[index].derivation.signs)
        self.stage.activity.changed()

    def on_posture(self) -> None:
        """Move the arm to the branch that is followed, or say why it cannot go there."""
        branch = self.facts.followed
        if branch.available and branch.q is not None:
            self.stage.arm.move_to(branch.q, Notice("hand", f"Branch {branch.number}", branch.name))
            return
        reason = "it has no solution at this target"
        if branch.q is not None:
            reason = views.outside_text(branch, self.stage.display.units)
        title = f"Branch {branch.number} is not available"
        self.stage.status.show(Notice("limits", title, f"{reason.capitalize()}."))

    def on_ask(self) -> None:
        """Ask about the pose that the arm has now."""
        q = self.stage.arm.now.goal
        self.change(q=as_configuration(q), signs=signs_of(self.facts.derived, q), restart=True)
        self.stage.activity.changed()
        self.stage.status.show(Notice("hand", "New questions", "They are about the pose that the arm has now."))

    def on_arm(self, robot: str) -> None:
        """Show one of the lesson's arms."""
        self.stage.robots.show(self.stage.services.store.get(robot))

    def changed(self, path: str) -> None:
        if path == "psi":
            self.change(turned=True)

    def on_result(self, result: kin.IKResult) -> None:
        self.change(turned=False)
        self.catch_up()

    def on_robot(self) -> None:
        self._arms[self.facts.robot] = self.settings
        super().on_robot()
        self.stage.activity.changed()

    def state(self) -> dict[str, object]:
        return super().state() if self.facts.exists else {}

    def restore(self, state: dict[str, object]) -> None:
        super().restore(state)
        self.stage.activity.changed()

    def remove(self) -> None:
        super().remove()
        if self.settings.drawn:
            self.stage.arm.scene.see_through(False)
            self.stage.camera.fit(())
