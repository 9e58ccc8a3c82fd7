"""The exercises of one visitor's page. ``static/lesson.js`` sends what is pressed and typed there."""

from __future__ import annotations

import time
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import viser

import kin
from app.exercises import Asked, Exercise, Variant, VariantError, Verdict
from app.viewer.activity.activity import EXERCISES
from app.viewer.activity.practice import Practice
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import OpenableFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.panel import Html, Native
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Node
from app.viewer.exercises import drawing, views
from app.viewer.exercises.drawing import SIZE
from app.viewer.exercises.sheet import Sheet
from app.viewer.feature import Stage
from app.viewer.panel.joints import go_to_buttons
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import round_points
from app.viewer.scene.gizmo import DragEvent
from kin import InputError, Robot
from kin.transforms import Array, pose_from_position_wxyz
from kin.typed import EntryError

LONGEST_SENDING = 40  # characters


@dataclass(frozen=True)
class PractisingSettings(Settings):
    """The exercise on show, as far as it is in this page alone.

    Attributes:
        variant: its numbers; None: there are none.
        seed: of these.
        sheet: what was entered.
        mistaken: the arm that a wrong answer is about, while the robot on show stays.
        closed: whether its answer was on show already.
        since: when it was opened or answered (`time.perf_counter`).
        news: of other pages of the seat, as far as they are known here.
    """

    variant: Variant | None = memory(renew=False)
    seed: int = memory(0, renew=False)
    sheet: Sheet = memory(renew=False)
    mistaken: tuple[Robot, Array] | None = memory()
    closed: bool = memory(False, renew=False)
    since: float = memory(0.0, renew=False)
    news: int = memory(0, renew=False)


class Practising(OpenableFeature[PractisingSettings, Facts[PractisingSettings]]):
    """A list by topic, or one exercise."""

    key = EXERCISES
    title = "Exercises"
    about = "Questions with your own numbers, hints and reasons."
    door = views.DOOR
    settings_of, facts_of = PractisingSettings, Facts
    messages = frozenset(
        {"open", "list", "answer", "fields", "posture", "place", "pick", "hint", "reveal", "again", "scene"}
    )

    def __init__(self, stage: Stage, practice: Practice | None = None) -> None:
        self._practice = stage.activity.practice if practice is None else practice
        super().__init__(stage)

    def show(self) -> None:
        """Show the list, or the open exercise."""
        self.shown = True
        if self._practice.at is not None:
            self._enter(self._practice.at)
        self.refresh()

    def hide(self) -> None:
        """Hide all; what was done is kept."""
        if self.shown:
            self._leave_view()
            super().hide()

    def open(self, exercise_id: object) -> None:
        """Show an exercise, and no other one on the way; raises `kin.InputError` for one that does not exist."""
        self._practice.open(exercise_id)
        if self.shown:
            self._enter(self._now)
            self.stage.activity.changed()
        else:
            self.stage.open_choice(self.title)

    # Declared

    def panel(self) -> Sequence[PanelNode]:
        if not self.shown:
            return ()
        exercise, variant, practice = self._practice.at, self.settings.variant, self._practice
        if exercise is None or variant is None:
            return [Html(str, (self._list(),))]
        activity, units, sheet = self.stage.activity, self.stage.display.units, self.settings.sheet
        record, door, asked = practice.record(exercise), self.door, self._asked
        at_home, own = self.stage.arm.now.robot == exercise.robot, activity.exercises.is_own(exercise.id)
        led = activity.leads("exercise", exercise.id)
        above = replace(door, back="") if led else door
        head = exercise, variant, units, at_home, record.variant, own and not practice.seated, above
        of = f"{exercise.id} {record.variant}"
        following = self._following(exercise)
        foot = views.foot_html(exercise, variant, units, sheet, activity, record, following, door)
        asks_arm = asked.form == "posture" and not record.closed
        return [
            Html(str, (views.task_html(*head),)),
            Html(str, (views.question_html(asked, sheet, record.closed, door, of),)),
            *([Native(partial(JointSliders, self.stage))] if asks_arm else []),
            Html(str, (foot,)),
        ]

    def scene(self) -> Sequence[Node]:
        exercise, s = self._practice.at, self.settings
        if not self.shown or exercise is None or s.variant is None:
            return ()
        reach = exercise.robot.reach
        nodes = [drawing.goal(f"goal-{i}", T, reach, words) for i, (words, T) in enumerate(self._frames)]
        if self._asked.form == "frame" and not self._practice.record(exercise).closed:
            nodes.append(drawing.own_frame(s.sheet.ghost, reach))
        return [*nodes, *(() if s.mistaken is None else drawing.mistaken_arm(*s.mistaken))]

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        super().handle(key, value)
        if self.shown:
            self.stage.activity.changed()

    def heard(self, key: Hashable, value: object) -> None:
        if not self.shown:
            match key:
                case ("open", str(exercise_id), int()):  # from elsewhere
                    self.open(exercise_id)
            return  # others are late clicks on what has been removed
        match key:
            case ("list", int()):
                self._practice.close()
                self._leave_view()
            case ("open", str(exercise_id), int()):
                self.open(exercise_id)
            case _ if self._practice.at is not None:
                self._act(key, value)

    def on_ghost(self, event: DragEvent) -> None:
        """The visitor has dragged the ghost."""
        if self.shown:
            self.settings.sheet.drag(pose_from_position_wxyz(event.position, event.wxyz), self.stage.display.units)

    def _act(self, key: Hashable, value: object) -> None:
        """An event of the exercise on show."""
        exercise, record, s = self._now, self._practice.record(self._now), self.settings
        match key:
            case ("hint", int()):
                record.hints = min(record.hints + 1, len(exercise.hints))
            case ("reveal", int()):
                if not record.closed and self._give_up(exercise, time.perf_counter() - s.since):
                    s.sheet.verdict, s.sheet.error = None, ""
                    self._show_answer()
            case ("again", int()):
                self._practice.again(exercise)
                self._enter(exercise)
            case ("scene", int()):
                self._set_scene(exercise)
            case ("pick", int()) if not record.closed:
                s.sheet.pick(value, len(self._asked.labels))
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

    def on_activity(self) -> None:
        exercise, s, activity = self._practice.at, self.settings, self.stage.activity
        if self.shown and exercise is not None:
            if self._practice.seed_of(exercise) != s.seed:  # another place was entered
                self._enter(exercise, move=False)
            elif activity.news != s.news:
                self.change(news=activity.news)
                if self._practice.record(exercise).closed and not s.closed:
                    s.sheet.verdict, s.sheet.error = None, ""
                    self._show_answer()
        self.schedule()

    def state(self) -> dict[str, object]:
        return self._practice.state()

    def restore(self, state: dict[str, object]) -> None:
        self._practice.restore(state)
        if not self.shown:
            return
        if self._practice.at is None:
            self._leave_view()
        else:
            self._enter(self._practice.at, move=False)
        self._begin()
        self.stage.activity.changed()

    # The exercise on show

    @property
    def _now(self) -> Exercise:
        if self._practice.at is None:
            raise InputError("exercise", None, "an open exercise")
        return self._practice.at

    def _enter(self, exercise: Exercise, move: bool = True) -> None:
        """Draw the numbers, and set the scene for an exercise."""
        self.change(sheet=Sheet(), since=time.perf_counter(), seed=self._practice.seed_of(exercise), mistaken=None)
        self.stage.activity.note = ""
        try:
            self.change(variant=self._practice.variant(exercise))
        except VariantError as error:  # of an operator's file that was not checked
            self._practice.close()
            self.change(variant=None)
            self.stage.status.show(Notice("error", f"{exercise.title} cannot be used", str(error)))
            return
        if move:
            self._set_scene(exercise)
        else:
            self._fit_view(exercise)

    def _set_scene(self, exercise: Exercise) -> None:
        stage, variant = self.stage, self.settings.variant
        assert variant is not None
        if stage.arm.now.robot != exercise.robot:
            stage.robots.show(exercise.robot)
        shows = exercise.kind.shows_posture or self._practice.record(exercise).closed
        q = variant.q if shows else exercise.robot.q_home
        stage.arm.move_to(q, Notice("hand", exercise.title, "The arm is ready for the exercise."))
        self._fit_view(exercise)

    @property
    def _frames(self) -> list[tuple[str, Array]]:
        """The poses that are drawn, with their names."""
        variant, asked, exercise = self.settings.variant, self._asked, self._now
        assert variant is not None
        goal = asked.goal if asked.goal is not None else variant.target
        found = [] if goal is None else [("target", goal)]
        if asked.form == "frame" and self._practice.record(exercise).closed:
            found.append(("right place", _pose(exercise.kind.answer(variant))))
        return found

    def _fit_view(self, exercise: Exercise) -> None:
        """What is drawn and where the arm is or was is in the picture."""
        closed, variant = self._practice.record(exercise).closed, self.settings.variant
        assert variant is not None
        self.change(closed=closed)
        room = [(T[:3, 3], SIZE * exercise.robot.reach) for _, T in self._frames]
        if exercise.q and (closed or exercise.kind.shows_posture):
            room.append(round_points(kin.link_frames(exercise.robot, variant.q)[:, :3, 3]))
        self.stage.camera.fit(room)
        self.schedule()

    def _leave_view(self) -> None:
        self.stage.camera.fit(())
        self.stage.picture.keep_in_view()

    @property
    def _asked(self) -> Asked:
        assert self.settings.variant is not None
        return self._now.asked(self.settings.variant, self.stage.display.units)

    def _answer(self, how: str, value: object, sending: str = "") -> None:
        """Judge an answer; `sending` as in `Judged`."""
        exercise, variant, sheet, form = self._now, self.settings.variant, self.settings.sheet, self._asked.form
        assert variant is not None
        sheet.error, sheet.verdict = "", None
        if how == "fields":
            sheet.fill(value)
        self.change(mistaken=None)
        try:
            given = (
                self.stage.arm.now.goal.tolist()
                if form == "posture"
                else sheet.given(form, value, self.stage.display.units)
            )
            verdict = exercise.judge(variant, given, self.stage.display.units)
        except EntryError as error:
            sheet.error = error.detail if error.title == "The answer was not read" else str(error)
            return
        except InputError as error:
            sheet.error = f"{str(error)[:1].upper()}{str(error)[1:]}."
            return
        sheet.verdict = verdict
        if verdict.mistaken is not None and self.stage.arm.now.robot == exercise.robot:
            self.change(mistaken=verdict.mistaken.arm_unlike(variant))
        now = time.perf_counter()
        seconds = now - self.settings.since
        self.change(since=now)
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
        exercise, variant = self._now, self.settings.variant
        assert variant is not None
        notice = Notice("hand", exercise.title, "The arm shows the answer.")
        if self._asked.form == "posture" and self._practice.record(exercise).mark == "shown":
            self.stage.arm.move_to(np.array(exercise.kind.answer(variant)), notice)
        elif exercise.q and not exercise.kind.shows_posture and self.stage.arm.now.robot == exercise.robot:
            self.stage.arm.move_to(variant.q, notice)
        self._fit_view(exercise)


class JointSliders:
    """The joint sliders once more, where the arm is the answer; with `buttons`, its named configurations too."""

    def __init__(self, stage: Stage, order: float, buttons: bool = False) -> None:
        self._stage = stage
        self._folder: viser.GuiFolderHandle = stage.client.gui.add_folder("Joints of the arm", order=order)
        stage.joints.show_in(self._folder)
        if buttons:
            with self._folder:
                go_to_buttons(stage.client.gui, stage.post)

    def remove(self) -> None:
        """Remove them."""
        self._stage.joints.show_in(None)
        self._folder.remove()


def _pose(numbers: object) -> Array:
    assert isinstance(numbers, list)
    return pose_from_position_wxyz(numbers[:3], np.array(numbers[3:]))
