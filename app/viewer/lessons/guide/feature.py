"""The common block of the lesson on show, in the visitor's page.

``static/lesson.js`` sends what is pressed and typed there.
"""

from __future__ import annotations

from collections.abc import Hashable
from itertools import product
from typing import Any

import numpy as np
import viser

from app.viewer.declared.scene import Node, SceneView, ends
from app.viewer.exercises.drawing import Drawing
from app.viewer.exercises.sheet import Sheet
from app.viewer.exercises.views import Following
from app.viewer.feature import Feature, Stage
from app.viewer.lessons.guide import earlier, views
from app.viewer.lessons.guide.answer_drawing import answer_nodes, lead_nodes
from app.viewer.lessons.guide.content import arm_for
from app.viewer.lessons.guide.example_view import ExampleView
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Outline, Pose
from app.viewer.lessons.guide.progress import Progress
from app.viewer.panel import assign, listen, update_html
from app.viewer.panel.joints import go_to_buttons
from app.viewer.panel.part import add_html
from app.viewer.panel.status import Notice
from app.viewer.scene.gizmo import DragEvent
from kin import InputError, Robot
from kin.transforms import Array, pose_from_position_wxyz
from kin.typed import EntryError

JOINTS_HINT = "The sliders of the tab Move, here as well. A target is typed with Type a target, above the tabs."
# Events of a question, which is asked about one arm.
ANSWERS = frozenset({"answer", "fields", "posture", "pick", "reveal", "pose", "offer", "drag"})
HERE = "The arm is at the pose of this step."


class Guide(Feature):
    """Goal, steps, predictions and check of one lesson.

    Args:
        state: how far the visitor is, as `state` returned it; None: at the beginning.
        following: the title of the lesson that comes after this one; "": none does.

    Attributes:
        arm: the arm that it asks about, which need not be on show; a step may be about another one.
        misplaced: whether a state was restored of an arm that it no longer asks about.
    """

    key = "guide"
    title = "Lesson"
    shared = True
    messages = frozenset(
        {
            "go",
            "answer",
            "fields",
            "posture",
            "pick",
            "reveal",
            "pose",
            "arm",
            "offer",
            "restart",
            "next",
            "again",
            "watch",
            "leave",
        }
    )

    def __init__(
        self, stage: Stage, lesson: type[Lesson], state: dict[str, object] | None = None, following: str = ""
    ) -> None:
        super().__init__(stage)
        self._lesson, self._following = lesson, following
        self.arm = arm_for(stage.activity.text(lesson.key), stage.now.robot)
        self._sheets: dict[str, Sheet] = {}
        self._progress = Progress(self._outline())
        self._earlier: dict[Progress, tuple[earlier.Drawn, ...]] = {}  # what each check asks of earlier lessons
        self._arms: dict[Robot, Progress] = {self.arm: self._progress}  # what was answered on each
        self._drawing = Drawing(stage.client.scene, self.post)
        self._copies = SceneView(stage.client.scene, "answer", self.post)
        self._answer_ends = np.zeros((0, 3))  # what the picture has to contain to show the last answer
        self._target: Array | None = None  # of the step on show, of which the picture has to contain it
        gui = stage.client.gui
        self._goal = add_html(gui)
        text = self._progress.outline.text
        self._example = ExampleView(stage, None if text is None else text.example)
        with gui.add_folder("Steps"):
            self._steps = add_html(gui)
        self._joints_box = gui.add_checkbox("Joint sliders", False, hint=JOINTS_HINT)
        listen(self._joints_box, self.post, "joints")
        with gui.add_folder(None) as self._container:
            pass
        self._joints: viser.GuiFolderHandle | None = None
        self._shown: Lesson | None = None
        self.restore(state or {})

    def attach(self, lesson: Lesson) -> None:
        """Let the lesson below the steps follow them."""
        self._shown = lesson
        self._show()

    def begin(self, keep_arm: bool = False) -> None:
        """The visitor has opened the lesson, or chosen an arm to keep: the scene comes to the step on show."""
        if self._wants_arm and not keep_arm:
            self._fetch_arm()
        else:
            self._open_step()

    def handle(self, key: Hashable, value: object) -> None:
        progress = self._progress
        match key:
            case ("watch", int()):
                self._example.press(value)
                self.due = 0.0
                return
            case "joints":
                self._show_joints(bool(value))
                return
        self._example.close()
        if not self.is_asked and isinstance(key, tuple) and key[0] in ANSWERS:
            return  # a late press
        match key:
            case ("leave", int()):
                return
            case ("go", int()):
                progress.go(value)
                self._sheets.clear()
                self._show()
                self.begin()
            case ("answer" | "fields" | "posture", str(question), int()):
                self._answer(question, value, key[0] == "fields")
            case ("pick", str(question), int()):
                asked = progress.question(question).asked()
                if not progress.is_closed(question):
                    self._sheet(question).pick(value, len(asked.labels))
            case ("reveal", str(question), int()):
                self._reveal(question)
            case ("pose", int()):
                self._bring()
            case ("arm", int()):
                self._fetch_arm()
            case ("offer", int()):
                if self._shown is not None:
                    self._shown.on_offer()
            case ("next", int()):
                if self._following:
                    self.stage.post("lesson", self._following)
                return
            case ("again", str(question), int()):
                progress.again(question)
                self._begin_again()
            case ("restart", int()):
                progress.restart()
                self._earlier.pop(progress, None)
                progress.ask_also({})
                self._begin_again()
            case ("drag", _, int()) if isinstance(value, DragEvent):
                T = pose_from_position_wxyz(value.position, value.wxyz)
                self._sheet(str(progress.at + 1)).drag(T, self.stage.units)
            case _:
                raise InputError("lesson", key, "a control of its steps")
        self._show()

    @property
    def done(self) -> Hashable:
        """The step on show, and what has become of the questions."""
        progress = self._progress
        return progress.at, sum(progress.misses.values()), tuple(map(progress.mark, progress.questions))

    @property
    def asked_about(self) -> Robot:
        """The arm that the step on show, or the check, is about."""
        steps, at = self._progress.outline.steps, self._progress.at
        return (steps[at].about if at < len(steps) else None) or self.arm

    @property
    def _arm_ids(self) -> tuple[str, ...]:
        """The ids of the arms that it asks about, but for single steps."""
        text = self._progress.outline.text
        return () if text is None else text.arms

    @property
    def is_asked(self) -> bool:
        """Whether that arm is on show: with another one the step can be read, and the lesson be explored."""
        return self.stage.now.robot == self.asked_about

    def step_name(self, key: Hashable) -> str:
        names = {
            "go": "Step",
            "pose": "Pose of the step",
            "arm": "Robot",
            "offer": self._lesson.title,
            "reveal": "Answer shown",
            "restart": "Answers cleared",
        }
        return names.get(str(key[0]), "Answer") if isinstance(key, tuple) else "Joint sliders"

    def on_robot(self) -> None:
        self._example.close()
        # Other numbers are asked on another arm, and answers stay with theirs.
        robot = self.stage.now.robot
        if not self.is_asked and robot.id in self._arm_ids:
            self._ask_about(robot)
        self._sheets.clear()
        self._copies.remove()
        self._show()

    def _ask_about(self, robot: Robot) -> None:
        """Go on with the questions about another arm that the file names, at the same step."""
        at, before, self.arm = self._progress.at, self._progress.outline, robot
        outline = self._outline()
        self._arms = {arm: progress for arm, progress in self._arms.items() if progress.begun}
        self._progress = self._arms.setdefault(robot, Progress(outline))
        self._earlier = {one: drawn for one, drawn in self._earlier.items() if one in self._arms.values()}
        self._use(outline)
        self._progress.at = outline.step_like(before, at)

    def _use(self, outline: Outline) -> None:
        """Go on with an outline; with one of another text, as far as the answers fit its questions."""
        progress, before = self._progress, self._progress.outline.text
        progress.use(outline)
        if outline.text is not before:
            progress.restore(progress.state())

    def on_pose(self, T_base_tool: Array) -> None:
        self._example.on_pose()

    def tick(self, now: float) -> None:
        self.due = self._example.advance(now)

    def on_style(self) -> None:
        self._use(self._outline())
        text = self._progress.outline.text
        self._example.on_style(None if text is None else text.example)
        self._ask_earlier()
        self._sheets.clear()
        self._show()

    def on_activity(self) -> None:
        self._show()

    def state(self) -> dict[str, object]:
        drawn = [list(one) for one in self._earlier.get(self._progress, ())]
        return {
            **self._progress.state(),
            "joints": self._joints is not None,
            **({} if self.arm.id == self.stage.now.robot.id else {"arm": self.arm.id}),
            **({"earlier": drawn} if drawn else {}),
        }

    def restore(self, state: dict[str, object]) -> None:
        self._example.close()
        arms, arm = self._arm_ids, state.get("arm")
        if isinstance(arm, str) and arm in arms and arm != self.arm.id:
            self._ask_about(self.stage.store.get(arm))
        exercises = self.stage.activity.courses.exercises
        self._earlier[self._progress] = earlier.read(state.get("earlier"), exercises)
        self._ask_earlier()
        self._progress.restore(state)
        self.misplaced = bool(state) and arm is None and not self.is_asked
        self._sheets.clear()
        self._show()
        if isinstance(joints := state.get("joints"), bool):
            assign(self._joints_box, joints)
            self._show_joints(joints)

    def remove(self) -> None:
        self._example.close()
        self._drawing.clear()
        self._copies.remove()
        if len(self._answer_ends):
            self._see_through(False)
        self._show_joints(False)
        self.stage.activity.asked = frozenset()

    def _ask_earlier(self) -> None:
        """Let the check ask what was chosen of earlier lessons, in the reader's units."""
        drawn, exercises = self._earlier.get(self._progress, ()), self.stage.activity.courses.exercises
        self._progress.ask_also(earlier.questions(drawn, exercises, self.stage.units))

    def _outline(self) -> Outline:
        text = self.stage.activity.text(self._lesson.key)
        return self._lesson.outline_in(self.arm, self.stage.units, text)

    # Answers

    def _sheet(self, key: str) -> Sheet:
        """What is entered for a question; at first, the last answer."""
        if key not in self._sheets:
            progress, sheet = self._progress, Sheet()
            question = progress.question(key)
            shown = key in progress.revealed
            answer: Any = question.right() if shown else progress.given.get(key)
            if answer is not None:
                sheet.cells = question.right_cells() if shown else question.cells(answer)
                form = question.asked().form
                if form == "options" and not shown:
                    sheet.chosen = answer
                elif form == "order":
                    sheet.picked = list(answer)
            self._sheets[key] = sheet
        return self._sheets[key]

    def _answer(self, key: str, value: object, typed: bool) -> None:
        """Read and judge an answer; a right one reveals what it predicted."""
        question, sheet, progress = self._progress.question(key), self._sheet(key), self._progress
        if progress.is_closed(key):
            return  # a late press
        sheet.error = ""
        if typed:
            sheet.fill(value)
        form = question.asked().form
        try:
            if form == "posture" and self._shown is not None:
                given = self._shown.driven(question)
            else:
                given = sheet.given(form, value, self.stage.units)
            verdict = progress.answer(key, question.read(given))
        except EntryError as error:
            sheet.error = error.detail if error.title == "The answer was not read" else str(error)
            return
        self._note(key, verdict.right)
        if verdict.right:
            self._show()
            self._move_to_end(key)

    def _reveal(self, key: str) -> None:
        """Show the answer to a question."""
        if not self._progress.is_closed(key):
            self._progress.reveal(key)
            self._note(key, right=False)
        self._sheets.pop(key, None)
        self._show()
        self._move_to_end(key)

    def _begin_again(self) -> None:
        """Show the step with nothing entered, at its pose."""
        self._sheets.clear()
        self._show()
        self.begin()

    def _note(self, key: str, right: bool) -> None:
        """An answer was judged or shown: what was missed comes back. An estimate may be wrong."""
        activity, drawn = self.stage.activity, self._earlier.get(self._progress, ())
        if key in self._progress.earlier:
            exercise = activity.courses.exercises.get(drawn[int(key[1:]) - 1][0])
            assert exercise is not None
            activity.take_exercise(exercise, right)
        elif not key.startswith("e"):
            activity.take_question(self._lesson.key, key, self.asked_about.id, right)

    # The scene

    def _bring(self, words: str = HERE) -> None:
        """Bring the scene to the pose of the step on show."""
        progress = self._progress
        if self.is_asked and (pose := progress.outline.pose_of(progress.at)) is not None:
            self._show_pose(pose, words)

    def _open_step(self, words: str = HERE) -> None:
        """Bring the scene to the step on show: once it is answered, to the answer, of which its words speak."""
        steps, at = self._progress.outline.steps, self._progress.at
        answered = at < len(steps) and steps[at].question is not None and self._progress.is_closed(str(at + 1))
        if answered and steps[at].end is not None:
            self._move_to_end(str(at + 1))
        else:
            self._bring(words)

    @property
    def _wants_arm(self) -> bool:
        """Whether a question on show is about another arm, and no course wants this one here."""
        progress, item = self._progress, self.stage.activity.progress.item
        here = "lesson", self._lesson.key, self.stage.now.robot.id
        if self.is_asked or (item is not None and (item.kind, item.key, item.robot) == here):
            return False
        asked = (key for key in progress.questions if key[0] not in "er" and self._is_on_show(key))
        return not all(map(progress.is_closed, asked))

    def _fetch_arm(self) -> None:
        """Show the arm that the step is about at its pose, and say so."""
        left, about = self.stage.now.robot, self.asked_about
        if left != about:
            self.stage.change_robot(about)
            self._open_step(f"This is asked about {about.name}. Undo brings {left.name} back.")

    def _move_to_end(self, key: str) -> None:
        """Let the scene show the answer to a question of the step on show; an arm that was driven there stays."""
        steps, at = self._progress.outline.steps, self._progress.at
        if key != str(at + 1) or at >= len(steps) or not self.is_asked:
            return
        question, end = steps[at].question, steps[at].end
        if end is None and key in self._progress.revealed and question is not None:
            end = Pose(tuple(question.right())) if question.asked().form == "posture" else None  # type: ignore[arg-type]
        if end is not None:
            self._show_pose(end, "The arm shows the answer.")

    def _show_pose(self, pose: Pose, words: str) -> None:
        steps, at = self._progress.outline.steps, self._progress.at
        title = "Check" if at == len(steps) else f"Step {at + 1}: {steps[at].title}"
        self.stage.move_to(np.array(pose.q), Notice("hand", title, words))
        if pose.drawing and self._shown is not None:
            self._shown.restore(dict(pose.drawing))
        if pose.target is not None:
            self.stage.set_target(pose_from_position_wxyz(pose.target[:3], np.array(pose.target[3:])))
        self._target = None if pose.target is None else np.array(pose.target[:3])
        self.stage.keep_in_view(self._target, self._answer_ends)

    def _leading_on(self) -> Following | None:
        """The button to what comes after the lesson."""
        activity = self.stage.activity
        if activity.leads("lesson", self._lesson.key):
            return Following.in_course(activity.progress)
        if self._following and activity.progress.course is None:
            return Following(f"Next lesson: {self._following}", "next")
        return None

    def _show(self) -> None:
        here = self.is_asked
        shown = self._shown if here and self.stage.now.robot == self.arm else None  # another arm has other steps
        if shown is not None and (outline := shown.on_steps(self._progress)) is not None:
            self._progress.use(outline)
        progress, activity = self._progress, self.stage.activity
        withheld = progress.withheld if here else frozenset[str]()
        if progress.at == len(progress.outline.steps) and not self._earlier.get(progress):
            self._earlier[progress] = earlier.choose(self._lesson.key, activity)
            self._ask_earlier()
        if activity.asked != withheld:  # before anything is shown that would give it away
            activity.asked = withheld
            activity.changed()
        right, count = progress.score
        if right == count > 0:
            activity.pass_lesson(self._lesson.key, self.arm.id, self._arm_ids)
        open_ = [key for key in progress.questions if self._is_on_show(key)]
        update_html(self._goal, views.goal_html(self._lesson.title, progress.outline))
        offered = "" if here else self.asked_about.name
        sheets = {key: self._sheet(key) for key in open_}
        of = f"{self._lesson.key} {self.arm.id}"
        update_html(self._steps, views.steps_html(progress, sheets, of, offered, self._leading_on()))
        forms = {key: progress.question(key).asked() for key in open_ if here and not progress.is_closed(key)}
        self._draw_ghost([key for key, asked in forms.items() if asked.form == "frame"])
        self._draw_answer()
        if any(asked.form == "posture" for asked in forms.values()):
            assign(self._joints_box, True)
            self._show_joints(True)

    def _is_on_show(self, key: str) -> bool:
        at = self._progress.at
        return key[0] in "cr" if at == len(self._progress.outline.steps) else key in (str(at + 1), f"e{at + 1}")

    def _draw_ghost(self, keys: list[str]) -> None:
        """The frame that is placed for the first of these questions."""
        if not keys:
            self._drawing.clear()
        elif not self._drawing.has_ghost:
            self._drawing.ghost(self._sheet(keys[0]).ghost, self.stage.now.robot.reach)

    def _draw_answer(self) -> None:
        """Where the last answer to the step on show leads, if the step says how it is drawn."""
        progress = self._progress
        steps, key, nodes = progress.outline.steps, str(progress.at + 1), list[Node]()
        if self.is_asked and progress.at < len(steps):
            robot, step = self.stage.now.robot, steps[progress.at]
            nodes = answer_nodes(robot, step, progress.given.get(key), progress.is_closed(key))
            if not nodes and step.guessed is not None and key not in progress.given:
                before = f"e{key}"
                given, closed = progress.given.get(before), progress.is_closed(before)
                nodes = lead_nodes(robot, step.estimate, step.guessed, given, closed)
        self._copies.show(nodes)
        found = np.concatenate([ends(nodes), self._ghost_room()])
        if not np.array_equal(found, self._answer_ends):
            self._answer_ends = found
            self._see_through(bool(nodes))
            self.stage.keep_in_view(self._target, found)

    def _see_through(self, on: bool) -> None:
        """Let the arm hide nothing of an answer that is drawn."""
        if not self._lesson.through:
            self.stage.see_through(on, gizmo=True)

    def _ghost_room(self) -> Array:
        """The corners ``(n, 3)`` of a cube with the frame that is asked for: they tell how far, not which way."""
        progress = self._progress
        key, steps = str(progress.at + 1), progress.outline.steps
        question = steps[progress.at].question if self.is_asked and progress.at < len(steps) else None
        if question is None or question.asked().form != "frame" or progress.is_closed(key):
            return np.zeros((0, 3))
        right: Any = question.right()
        return float(np.abs(right[:3]).max()) * np.array(list(product((-1.0, 1.0), repeat=3)))

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
