"""The lesson "Inverse kinematics step by step": the closed form of an arm, derived with numbers.

`derive` has the derivations as facts: formulas and their values. `exercise` judges the branches, `shapes` says
what is drawn in each step, `questions` and `mistakes` what is asked, `words` and `views` put it into words.

The student follows one branch. It changes when another way is typed, or chosen with *Follow*; the numbers and the
figure are those of this branch, for the target in the scene.
"""

from __future__ import annotations

import math
import time
from collections.abc import Hashable
from typing import Any, TypeGuard

import numpy as np
import viser

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Number, Outline
from app.viewer.lessons.guide.progress import Progress
from app.viewer.lessons.inverse import views
from app.viewer.lessons.inverse.arm import Arm, arm_of
from app.viewer.lessons.inverse.derive import Signs, arm_angle, signs_of
from app.viewer.lessons.inverse.drawing import Drawing, room
from app.viewer.lessons.inverse.exercise import Branch, Exercise, all_branches, example, exercise, flipped
from app.viewer.lessons.inverse.questions import keys_of, outline, outline_of
from app.viewer.lessons.inverse.shapes import shapes
from app.viewer.lessons.inverse.sheet import StepKey
from app.viewer.lessons.inverse.tree import tree
from app.viewer.panel import assign, listen, listen_click, update_html
from app.viewer.panel.status import Notice
from kin import InputError
from kin.transforms import Array

INTERVAL = 0.1  # s between two updates of the numbers
ARMS = ("planar2r", "planar3r", "pioneer5", "puma560", "redundant7-craig")
FOLLOW_HINT = "The branch that the numbers and the figure follow, by its number in the tree"
POSTURE_HINT = "Moves the arm to the branch that you follow"
ASK_HINT = "Asks the questions again, about the pose that the arm has now"
ALL_HINT = "Shows the numbers of all steps, answered or not"
ARM_HINT = "Shows this arm"
PSI_HINT = "Where the elbow is on its circle in the derivation"


class InverseLesson(Lesson):
    """See the module."""

    key = "inverse"
    title = "Inverse kinematics step by step"
    left = "configuration"
    about = "From a target to the joint angles by hand, and where each solution comes from."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._all = False
        self._psi: float | None = None
        self._opened: tuple[bool, ...] = ()
        self._at = 0
        self._restart = False
        self._taken: dict[str, float] = {}  # answers whose way was followed, by question: it may be left again
        self._shown_at = 0.0
        self._arm: Arm | None
        self._exercise: Exercise | None
        self._drawing: Drawing | None = None
        with stage.client.gui.add_folder(None) as self._container:
            pass
        self._controls: list[Any] = []
        self._begin()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("follow", int(number)):
                self._follow(number)
            case "posture":
                self._take_posture()
            case "ask":
                self._ask()
            case "all":
                self._all = bool(value)
                self._update()
            case ("psi", units) if units == self.stage.units:
                if not isinstance(value, int | float) or not math.isfinite(value):
                    raise InputError("arm angle", value, "a finite number")
                self._psi = self.stage.units.angles.read(float(value))
                self._update()
            case ("psi", _):
                pass
            case ("arm", str(robot)) if robot in ARMS:
                self.stage.change_robot(self.stage.store.get(robot))
            case _:
                raise InputError("inverse kinematics", key, "a control of this lesson")

    def step_name(self, key: Hashable) -> str:
        names = {"follow": "Branch", "arm": "Arm", "psi": "Arm angle"}
        return names.get(str(key[0]), self.title) if isinstance(key, tuple) else self.title

    def on_steps(self, progress: Progress) -> Outline | None:
        if self._arm is None or self._arm.robot is not self.stage.now.robot:
            return None
        if self._restart:
            progress.restart()
            self._restart = False
            self._taken.clear()
        assert self._exercise is not None
        keys = keys_of(self._arm)
        progress.use(outline_of(self._exercise, self.stage.units))
        for number, key in enumerate(keys, 1):
            self._take_way(progress, str(number), key)
        self._at = progress.at
        asked = dict(progress.outline.questions())
        self._opened = tuple(
            progress.is_closed(str(i + 1)) if str(i + 1) in asked else i <= self._at for i in range(len(keys))
        )
        self._update()
        return progress.outline

    def on_robot(self) -> None:
        self._clear()
        self._begin()
        self.stage.activity.changed()

    def on_pose(self, T_base_tool: Array) -> None:
        self._wake()

    def on_result(self, result: kin.IKResult) -> None:
        self._psi = None
        self._wake()

    def on_style(self) -> None:
        self._build()
        self._update()

    def tick(self, now: float) -> None:
        wait = INTERVAL - (now - self._shown_at)
        if wait <= 0.0:
            self._update()
        else:
            self.due = wait

    def state(self) -> dict[str, object]:
        if self._exercise is None:
            return {}
        return {
            "q": self._exercise.q.tolist(),
            "signs": list(self._exercise.signs),
            "all": self._all,
            "taken": dict(self._taken),
        }

    def restore(self, state: dict[str, object]) -> None:
        q, signs, arm = state.get("q"), state.get("signs"), self._arm
        if isinstance(shown := state.get("all"), bool):
            self._all = shown
        if isinstance(taken := state.get("taken"), dict):
            self._taken = {str(key): x for key, x in taken.items() if type(x) in (int, float)}
        if arm is not None and _is_row(q, arm.robot.n) and _is_row(signs, arm.splits):
            followed = tuple(1 if sign > 0 else -1 for sign in signs)
            self._exercise = exercise(arm, np.array(q, float), followed)
        self._build()
        self.stage.activity.changed()

    def remove(self) -> None:
        self._clear()
        self._container.remove()

    # What is followed

    def _begin(self) -> None:
        """Start with the example of the arm on show."""
        arm = self._arm = arm_of(self.stage.now.robot)
        self._exercise = None if arm is None else exercise(arm, example(arm))
        self._psi, self._opened, self._at = None, (), 0
        self._taken.clear()
        self._build()
        self._update()

    def _take_way(self, progress: Progress, number: str, key: StepKey) -> None:
        """Follow the other way where the student has typed it."""
        given = self._exercise
        question = dict(progress.outline.questions()).get(number)
        if given is None or not isinstance(question, Number) or number not in progress.given:
            return
        answer = progress.given[number]
        if number in progress.revealed or self._taken.get(number) == answer:
            return
        self._taken[number] = answer
        if question.way_of(answer) <= 0:
            return
        step = given.followed.derivation.step(key)
        if step is not None and step.split >= 0:
            self._set_signs(flipped(given.signs, step.split))
            progress.use(outline_of(self._exercise, self.stage.units))  # type: ignore[arg-type]

    def _set_signs(self, signs: Signs) -> None:
        assert self._exercise is not None
        self._exercise = exercise(self._exercise.arm, self._exercise.q, signs)

    def _follow(self, number: int) -> None:
        given = self._exercise
        if given is None or not 1 <= number <= len(given.branches):
            raise InputError("branch", number, "the number of a branch in the tree")
        self._set_signs(given.branches[number - 1].derivation.signs)
        self.stage.activity.changed()

    def _ask(self) -> None:
        """Ask about the pose that the arm has now."""
        arm = self._arm
        if arm is None:
            return
        q = self.stage.now.goal.copy()
        self._exercise, self._restart = exercise(arm, q, signs_of(arm, q)), True
        self.stage.activity.changed()
        self.stage.notify(Notice("hand", "New questions", "They are about the pose that the arm has now."))

    def _take_posture(self) -> None:
        branch = next((b for b in self._branches() if b.derivation.signs == self._signs), None)
        if branch is None:
            return
        if branch.available and branch.q is not None:
            self.stage.move_to(branch.q, Notice("hand", f"Branch {branch.number}", branch.name))
            return
        reason = (
            "It has no solution at this target."
            if branch.q is None
            else views.outside_text(branch, self.stage.units)
        )
        self.stage.notify(
            Notice("limits", f"Branch {branch.number} is not available", f"{reason.rstrip('.').capitalize()}.")
        )

    @property
    def _signs(self) -> Signs:
        return () if self._exercise is None else self._exercise.signs

    def _branches(self) -> tuple[Branch, ...]:
        """All branches of the target in the scene."""
        arm, stage = self._arm, self.stage
        if arm is None:
            return ()
        T = stage.now.aim
        psi = 0.0
        if arm.family == "srs7":
            psi = arm_angle(arm, stage.now.goal) if self._psi is None else self._psi
        return all_branches(arm, T, stage.now.goal, psi)

    # What is shown

    def _build(self) -> None:
        """Controls for the arm on show."""
        for control in self._controls:
            control.remove()
        gui, arm = self.stage.client.gui, self._arm
        with self._container:
            self._numbers = gui.add_html("")
            self._tree = gui.add_html("")
            self._controls = [self._numbers, self._tree]
            if arm is None:
                self._offer_arms(gui)
                return
            self._slider: viser.GuiSliderHandle[float] | None = None
            if arm.family == "srs7":
                unit = self.stage.units.angles
                turn = unit.shown(math.pi)
                self._slider = gui.add_slider("ψ of the derivation", -turn, turn, unit.step(1), 0.0, hint=PSI_HINT)
                listen(self._slider, self.post, ("psi", self.stage.units))
                self._controls.append(self._slider)
            names = [str(i + 1) for i in range(2**arm.splits)]
            group = gui.add_button_group("Follow", names, hint=FOLLOW_HINT)
            listen_click(group, self.post, {name: ("follow", int(name)) for name in names})
            self._controls.append(group)
            for label, key, hint in (
                ("Show this posture", "posture", POSTURE_HINT),
                ("Ask about this pose", "ask", ASK_HINT),
            ):
                button = gui.add_button(label, hint=hint)
                self._on_click(button, key)
                self._controls.append(button)
            box = gui.add_checkbox("All numbers", self._all, hint=ALL_HINT)
            listen(box, self.post, "all")
            self._controls.append(box)

    def _offer_arms(self, gui: viser.GuiApi) -> None:
        for robot in ARMS:
            button = gui.add_button(self.stage.store.get(robot).name, hint=ARM_HINT)
            self._on_click(button, ("arm", robot))
            self._controls.append(button)

    def _on_click(self, button: viser.GuiButtonHandle, key: Hashable) -> None:
        @button.on_click
        async def _(event: Any) -> None:
            if event.client is not None:
                self.post(key)

    def _wake(self) -> None:
        self.due = 0.0 if self.due is None else min(self.due, 0.0)

    def _update(self) -> None:
        """Show numbers, tree and figure for the target in the scene."""
        self._shown_at, self.due = time.perf_counter(), None
        arm, units = self._arm, self.stage.units
        if arm is None:
            update_html(self._numbers, views.others_html(self.stage.now.robot))
            return
        found = self._branches()
        branch = next(b for b in found if b.derivation.signs == self._signs)
        keys = keys_of(arm)
        opened = tuple(True for _ in keys) if self._all else (self._opened or (False,) * len(keys))
        update_html(self._numbers, views.derivation_html(arm, branch, keys, opened, self._at, units))
        inside = sum(b.available for b in found)
        nodes = tree(found, self._signs)
        by_key = dict(zip(keys, opened, strict=True))
        update_html(self._tree, views.tree_html(arm, nodes, inside, by_key, units))
        self._show_psi(found)
        self._draw(arm, branch, keys, opened)

    def _show_psi(self, found: tuple[Branch, ...]) -> None:
        if self._slider is not None and self._psi is None and "ψ" in found[0].derivation.values:
            shown = self.stage.units.angles.shown(found[0].derivation.number("ψ"))
            assign(self._slider, min(max(shown, self._slider.min), self._slider.max))

    def _draw(self, arm: Arm, branch: Branch, keys: tuple[StepKey, ...], opened: tuple[bool, ...]) -> None:
        """Draw the figure of the step on show; the check has that of the whole posture."""
        if self._drawing is None:
            self._drawing = Drawing(self.stage.client.scene, arm)
            self.stage.see_through(True, gizmo=True)
            self.stage.fit_view(room(arm, branch.derivation, keys))
        at = min(self._at, len(keys) - 1)
        self._drawing.show(shapes(arm, branch.derivation, keys[at]), self.stage.units, not opened[at])

    def _clear(self) -> None:
        """Remove the figure."""
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None
            self.stage.see_through(False)
            self.stage.fit_view(())


def _is_row(values: object, size: int) -> TypeGuard[list[float]]:
    """Whether a value of a link is a list of numbers of this length."""
    return (
        isinstance(values, list)
        and len(values) == size
        and all(type(value) in (int, float) and math.isfinite(value) for value in values)
    )
