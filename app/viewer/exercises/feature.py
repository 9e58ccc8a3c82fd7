"""The exercises of one visitor's page. ``static/lesson.js`` sends what is pressed and typed there."""

from __future__ import annotations

import time
from collections.abc import Hashable
from dataclasses import replace

import numpy as np
import viser

import kin
from app.exercises import Asked, Exercise, Variant, VariantError, Verdict
from app.viewer.activity.activity import EXERCISES
from app.viewer.activity.practice import Practice, Record
from app.viewer.exercises import views
from app.viewer.exercises.drawing import SIZE, Drawing
from app.viewer.exercises.sheet import Sheet
from app.viewer.feature import Feature, Stage
from app.viewer.panel import update_html
from app.viewer.panel.part import Block, add_html
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import round_points
from app.viewer.scene.gizmo import DragEvent
from kin import InputError
from kin.transforms import Array, pose_from_position_wxyz
from kin.typed import EntryError

LONGEST_SENDING = 40  # characters


class Practising(Feature):
    """A list by topic, or one exercise.

    It lives as long as the page; `show` and `hide` build and remove its HTML.
    """

    key = EXERCISES
    title = "Exercises"
    about = "Questions with your own numbers, hints and reasons."
    door = views.DOOR
    messages = frozenset(
        {"open", "list", "answer", "fields", "posture", "place", "pick", "hint", "reveal", "again", "scene"}
    )

    def __init__(self, stage: Stage, practice: Practice | None = None) -> None:
        super().__init__(stage)
        self._practice = stage.activity.practice if practice is None else practice
        self._sheet = Sheet()
        self._variant: Variant | None = None
        self._seed = 0  # of the numbers on show
        self._note = ""  # on show
        self._news = 0  # known
        self._shown = Record()  # of the exercise, as it is on show
        self._since = 0.0
        self._box: viser.GuiFolderHandle | None = None
        self._blocks: list[Block] = []
        self._container: viser.GuiFolderHandle
        self._joints: viser.GuiFolderHandle | None = None
        self._drawing = Drawing(stage.client.scene, self.post)

    def show(self) -> None:
        """Build the HTML in the container that is open."""
        gui = self.stage.client.gui
        self._box = gui.add_folder(None)
        with self._box:
            self._blocks = [add_html(gui), add_html(gui)]
            with gui.add_folder(None) as self._container:
                pass
            self._blocks.append(add_html(gui))
        if self._practice.at is not None:
            self._begin(self._practice.at)
        self._update()

    def hide(self) -> None:
        """Remove HTML and drawings; what was done is kept."""
        if self._box is None:
            return
        self._undraw()
        self._show_joints(False)
        self._box.remove()
        self._box, self._blocks = None, []

    @property
    def shown(self) -> bool:
        """Whether the HTML is built."""
        return self._box is not None

    def open(self, exercise_id: object) -> None:
        """Show an exercise, and no other one on the way; raises `kin.InputError` for one that does not exist."""
        self._practice.open(exercise_id)
        if not self.shown:
            self.stage.open_choice(self.title)
            return
        self._begin(self._now)
        self._update()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        if not self.shown:
            match key:
                case ("open", str(exercise_id), int()):  # from elsewhere
                    self.open(exercise_id)
            return  # others are late clicks on what has been removed
        match key:
            case ("drag", _, int()) if isinstance(value, DragEvent):
                self._sheet.drag(pose_from_position_wxyz(value.position, value.wxyz), self.stage.units)
            case ("list", int()):
                self._practice.close()
                self._undraw()
            case ("open", str(exercise_id), int()):
                self.open(exercise_id)
            case _ if self._practice.at is not None:
                self._act(key, value)
        self._update()

    def _act(self, key: Hashable, value: object) -> None:
        """An event of the exercise on show."""
        exercise, record = self._now, self._practice.record(self._now)
        match key:
            case ("hint", int()):
                record.hints = min(record.hints + 1, len(exercise.hints))
            case ("reveal", int()):
                if not record.closed and self._give_up(exercise, time.perf_counter() - self._since):
                    self._sheet.verdict, self._sheet.error = None, ""
                    self._show_answer()
            case ("again", int()):
                self._practice.again(exercise)
                self._begin(exercise)
            case ("scene", int()):
                self._set_scene(exercise)
            case ("pick", int()) if not record.closed:
                self._sheet.pick(value, len(self._asked.labels))
            case ("answer" | "fields" | "posture" | "place", int()) if not record.closed:
                self._answer(str(key[0]), value)
            case ("answer" | "fields" | "posture" | "place", str(sending), int()) if not record.closed:
                self._answer(str(key[0]), value, sending[:LONGEST_SENDING])
            case (str(), int()) | (str(), str(), int()) if record.closed:
                pass  # a late click
            case _:
                raise InputError("exercise", key, "a control of the exercise")

    def step_name(self, key: Hashable) -> str:
        names = {"open": "Exercise", "list": "List of exercises", "hint": "Hint", "again": "New numbers"}
        return names.get(str(key[0]), "Answer") if isinstance(key, tuple) else "Answer"

    def on_robot(self) -> None:
        self._drawing.arm(None)  # of an arm that is not on show
        self._update()

    def on_style(self) -> None:
        self._update()

    def on_activity(self) -> None:
        exercise = self._practice.at
        if not self.shown or exercise is None:
            return
        if self._practice.seed_of(exercise) != self._seed:  # another place was entered
            self._begin(exercise, move=False)
            self._update()
        elif self.stage.activity.news != self._news:
            self._news = self.stage.activity.news
            if self._practice.record(exercise).closed and not self._shown.closed:
                self._sheet.verdict, self._sheet.error = None, ""
                self._show_answer()
            self._update()
        elif self.stage.activity.note != self._note:
            self._update()

    def state(self) -> dict[str, object]:
        return self._practice.state()

    def restore(self, state: dict[str, object]) -> None:
        self._practice.restore(state)
        if not self.shown:
            return
        if self._practice.at is None:
            self._undraw()
        else:
            self._begin(self._practice.at, move=False)
        self._update()

    def remove(self) -> None:
        self.hide()

    # The exercise on show

    @property
    def _now(self) -> Exercise:
        if self._practice.at is None:
            raise InputError("exercise", None, "an open exercise")
        return self._practice.at

    def _begin(self, exercise: Exercise, move: bool = True) -> None:
        """Draw the numbers, and set the scene for an exercise."""
        self._sheet, self._since = Sheet(), time.perf_counter()
        self._seed, self.stage.activity.note = self._practice.seed_of(exercise), ""
        try:
            self._variant = self._practice.variant(exercise)
        except VariantError as error:  # of an operator's file that was not checked
            self._practice.close()
            self._variant = None
            self.stage.notify(Notice("error", f"{exercise.title} cannot be used", str(error)))
            return
        if move:
            self._set_scene(exercise)
        else:
            self._draw(exercise)

    def _set_scene(self, exercise: Exercise) -> None:
        stage, variant = self.stage, self._variant
        assert variant is not None
        if stage.now.robot != exercise.robot:
            stage.change_robot(exercise.robot)
        shows = exercise.kind.shows_posture or self._practice.record(exercise).closed
        q = variant.q if shows else exercise.robot.q_home
        stage.move_to(q, Notice("hand", exercise.title, "The arm is ready for the exercise."))
        self._draw(exercise)

    def _draw(self, exercise: Exercise) -> None:
        """The frames of the exercise."""
        self._drawing.clear()
        variant, asked = self._variant, self._asked
        assert variant is not None
        reach, shown = exercise.robot.reach, []
        goal = asked.goal if asked.goal is not None else variant.target
        closed = self._practice.record(exercise).closed
        if goal is not None:
            shown.append(goal)
            self._drawing.goal(goal, reach, "target")
        if asked.form == "frame":
            if closed:
                shown.append(right := _pose(exercise.kind.answer(variant)))
                self._drawing.goal(right, reach, "right place")
            else:
                self._drawing.ghost(self._sheet.ghost, reach)
        room = [(T[:3, 3], SIZE * reach) for T in shown]
        if exercise.q and (closed or exercise.kind.shows_posture):
            room.append(round_points(kin.link_frames(exercise.robot, variant.q)[:, :3, 3]))
        self.stage.fit_view(room)

    def _undraw(self) -> None:
        self._drawing.clear()
        self.stage.fit_view(())
        self.stage.keep_in_view()

    @property
    def _asked(self) -> Asked:
        assert self._variant is not None
        return self._now.asked(self._variant, self.stage.units)

    def _answer(self, how: str, value: object, sending: str = "") -> None:
        """Judge an answer; `sending` as in `Judged`."""
        exercise, variant, sheet, form = self._now, self._variant, self._sheet, self._asked.form
        assert variant is not None
        sheet.error, sheet.verdict = "", None
        if how == "fields":
            sheet.fill(value)
        try:
            given = (
                self.stage.now.goal.tolist() if form == "posture" else sheet.given(form, value, self.stage.units)
            )
            if form == "frame":
                self._drawing.place(sheet.ghost)
            verdict = exercise.judge(variant, given, self.stage.units)
        except EntryError as error:
            self._drawing.arm(None)
            sheet.error = error.detail if error.title == "The answer was not read" else str(error)
            return
        except InputError as error:
            self._drawing.arm(None)
            sheet.error = f"{str(error)[:1].upper()}{str(error)[1:]}."
            return
        sheet.verdict = verdict
        shown, mistaken = self.stage.now.robot == exercise.robot, verdict.mistaken
        self._drawing.arm(mistaken.arm_unlike(variant) if shown and mistaken is not None else None)
        seconds, self._since = time.perf_counter() - self._since, time.perf_counter()
        self._take(exercise, given, verdict, seconds, sending)
        if verdict.right:
            self._show_answer()

    def _take(self, exercise: Exercise, given: object, verdict: Verdict, seconds: float, sending: str) -> None:
        """An answer was judged; `sending` as in `Judged`."""
        self.stage.activity.answer(exercise, given, verdict, seconds, sending)

    def _give_up(self, exercise: Exercise, seconds: float) -> bool:
        """The answer is to be shown, after so many seconds; False: it must not be."""
        return self.stage.activity.give_up(exercise, seconds)

    def _following(self, exercise: Exercise) -> views.Following | None:
        """What comes after an exercise that is done."""
        if self.stage.activity.leads("exercise", exercise.id):
            return views.Following.in_course(self.stage.activity.progress)
        after = self._practice.after(exercise)
        return None if after is None else views.Following("Next exercise", "open", after.id)

    def _list(self) -> str:
        """What is on show while no exercise is."""
        return views.list_html(self.stage.activity.exercises, self._practice)

    def _show_answer(self) -> None:
        """Let the scene show it."""
        exercise, variant = self._now, self._variant
        assert variant is not None
        notice = Notice("hand", exercise.title, "The arm shows the answer.")
        if self._asked.form == "posture" and self._practice.record(exercise).mark == "shown":
            self.stage.move_to(np.array(exercise.kind.answer(variant)), notice)
        elif exercise.q and not exercise.kind.shows_posture and self.stage.now.robot == exercise.robot:
            self.stage.move_to(variant.q, notice)
        self._draw(exercise)

    def _show_joints(self, on: bool) -> None:
        """The joint sliders, where the arm is the answer."""
        if on == (self._joints is not None):
            return
        if self._joints is not None:
            self.stage.show_joints(None)
            self._joints.remove()
            self._joints = None
            return
        with self._container:
            self._joints = self.stage.client.gui.add_folder("Joints of the arm")
        self.stage.show_joints(self._joints)

    def _update(self) -> None:
        if not self.shown:
            return
        exercise, practice, units = self._practice.at, self._practice, self.stage.units
        activity, self._note = self.stage.activity, self.stage.activity.note
        if exercise is None or self._variant is None:
            contents = [self._list(), "", ""]
        else:
            self._shown = replace(practice.record(exercise))
            variant, closed = self._variant, self._shown.closed
            led = activity.leads("exercise", exercise.id)
            contents = [
                views.task_html(
                    exercise,
                    variant,
                    units,
                    self.stage.now.robot == exercise.robot,
                    self._shown.variant,
                    activity.exercises.is_own(exercise.id) and not practice.seated,
                    replace(self.door, back="") if led else self.door,
                ),
                views.question_html(
                    self._asked, self._sheet, closed, self.door, f"{exercise.id} {self._shown.variant}"
                ),
                views.foot_html(
                    exercise,
                    variant,
                    units,
                    self._sheet,
                    activity,
                    self._shown,
                    self._following(exercise),
                    self.door,
                ),
            ]
        posture = exercise is not None and self._asked.form == "posture"
        self._show_joints(posture and exercise is not None and not practice.record(exercise).closed)
        for block, content in zip(self._blocks, contents, strict=True):
            update_html(block, content)
        activity.changed()


def _pose(numbers: object) -> Array:
    assert isinstance(numbers, list)
    return pose_from_position_wxyz(numbers[:3], np.array(numbers[3:]))
