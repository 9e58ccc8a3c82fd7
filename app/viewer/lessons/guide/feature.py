"""The common block of the lesson on show, in the visitor's page.

``static/lesson.js`` sends what is pressed and typed there.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, ClassVar

import numpy as np

from app.exercises import Asked
from app.exercises.worked import WorkedText
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, flag, memory
from app.viewer.declared.panel import Control, Folder, Html, Native, same
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Node, ends
from app.viewer.exercises.drawing import own_frame
from app.viewer.exercises.feature import JointSliders
from app.viewer.exercises.sheet import Sheet
from app.viewer.exercises.views import Following
from app.viewer.feature import Stage
from app.viewer.lessons.guide import views
from app.viewer.lessons.guide.answer_drawing import answer_nodes, lead_nodes
from app.viewer.lessons.guide.answers import Answers
from app.viewer.lessons.guide.example_view import WorkedExample
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Pose
from app.viewer.lessons.guide.progress import Progress
from app.viewer.panel.status import Notice
from app.viewer.scene.gizmo import DragEvent
from kin import InputError, Robot
from kin.transforms import Array, pose_from_position_wxyz
from kin.typed import EntryError

JOINTS_HINT = "The sliders of the tab Move, here as well. A target is typed with Type a target, above the tabs."
# Events of a question, which is asked about one arm.
ANSWERS = frozenset({"answer", "fields", "posture", "pick", "reveal", "pose", "offer"})
HERE = "The arm is at the pose of this step."


@dataclass(frozen=True)
class GuideSettings(Settings):
    """What is on show besides the step.

    Attributes:
        joints: whether the joint sliders are shown here too.
        misplaced: whether a state was restored of an arm that it no longer asks about.
        target: of the step on show, ``(3,)``, of which the picture has to contain it.
        room: the points ``(n, 3)`` that it has to contain to show the last answer; None: there are none.
    """

    joints: bool = flag("Joint sliders", hint=JOINTS_HINT, undo="Joint sliders")
    misplaced: bool = memory(False, renew=False)
    target: Array | None = memory(renew=False)
    room: Array | None = memory(renew=False)


class Guide(DeclaredFeature[GuideSettings, Facts[GuideSettings]]):
    """Goal, steps, predictions and check of one lesson.

    Args:
        state: how far the visitor is, as `state` returned it; None: at the beginning.
        following: the title of the lesson that comes after this one; "": none does.

    Attributes:
        shown: the lesson, below the steps.
    """

    key = "guide"
    title = "Lesson"
    shared = True
    settings_of, facts_of = GuideSettings, Facts
    undo: ClassVar[dict[str, str]] = {"on_ghost": "Answer"}
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
        self._lesson, self._following, self._left = lesson, following, state or {}
        self._answers = Answers(stage, lesson)
        self._sheets: dict[str, Sheet] = {}
        self.shown: Lesson | None = None
        super().__init__(stage)
        self.shown = lesson(stage)
        self._follow_steps()
        self.refresh()

    def built(self) -> None:
        self._example = self.adopt(WorkedExample(self.stage, self, lambda: self._example_text, self.schedule))
        self._take(self._left)

    def begin(self, keep_arm: bool = False) -> None:
        """The visitor has opened the lesson, or chosen an arm to keep: the scene comes to the step on show."""
        if self._wants_arm and not keep_arm:
            self._fetch_arm()
        else:
            self._open_step()

    @property
    def arm(self) -> Robot:
        """The arm that it asks about, which need not be on show; a step may be about another one."""
        return self._answers.arm

    @property
    def misplaced(self) -> bool:
        """Whether a state was restored of an arm that it no longer asks about."""
        return self.settings.misplaced

    @property
    def _progress(self) -> Progress:
        return self._answers.progress

    @property
    def _example_text(self) -> WorkedText | None:
        text = self._progress.outline.text
        return None if text is None else text.example

    # Declared

    def panel(self) -> Sequence[PanelNode]:
        progress = self._progress
        sheets = {key: self._sheet(key) for key in self._open_questions}
        offered = "" if self.is_asked else self._answers.about.name
        of = f"{self._lesson.key} {self.arm.id}"
        steps = views.steps_html(progress, sheets, of, offered, self._leading_on())
        example = self._example.words
        return [
            Html(views.goal_html, (self._lesson.title, progress.outline), key="goal"),
            *([] if example is None else [Html(views.example_html, example, key="example")]),
            Folder("Steps", [Html(str, (steps,))]),
            Control("joints"),
            *([Native(partial(JointSliders, self.stage, buttons=True))] if self.settings.joints else []),
        ]

    def scene(self) -> Sequence[Node]:
        """Where the last answer to the step on show leads, and the frame that is placed for a question."""
        framed = next((key for key, asked in self._forms.items() if asked.form == "frame"), None)
        if framed is None:
            return self._answer_nodes()
        reach = self.stage.arm.now.robot.reach
        return [*self._answer_nodes(), own_frame(self._sheet(framed).ghost, reach)]

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        answers, progress = self._answers, self._progress
        if isinstance(key, tuple) and key[0] == "watch":
            self._example.press(value)
            return
        self._example.close()
        if not self.is_asked and isinstance(key, tuple) and key[0] in ANSWERS:
            return  # a late press
        match key:
            case ("leave", int()):
                return
            case ("go", int()):
                progress.go(value)
                self._begin_again()
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
                if self.shown is not None:
                    self.shown.on_offer()
            case ("next", int()):
                if self._following:
                    self.stage.post("lesson", self._following)
                return
            case ("again", str(question), int()):
                progress.again(question)
                self._begin_again()
            case ("restart", int()):
                answers.restart()
                self._begin_again()
            case _:
                raise InputError("lesson", key, "a control of its steps")
        self._follow_steps()

    def on_ghost(self, event: DragEvent) -> None:
        """Place the frame that a question asks for."""
        self._example.close()
        if self.is_asked:
            T = pose_from_position_wxyz(event.position, event.wxyz)
            self._sheet(str(self._progress.at + 1)).drag(T, self.stage.display.units)

    @property
    def done(self) -> Hashable:
        """The step on show, and what has become of the questions."""
        progress = self._progress
        return progress.at, sum(progress.misses.values()), tuple(map(progress.mark, progress.questions))

    @property
    def is_asked(self) -> bool:
        """Whether that arm is on show: with another one the step can be read, and the lesson be explored."""
        return self.stage.arm.now.robot == self._answers.about

    def step_name(self, key: Hashable) -> str:
        names = {
            "go": "Step",
            "pose": "Pose of the step",
            "arm": "Robot",
            "offer": self._lesson.title,
            "reveal": "Answer shown",
            "restart": "Answers cleared",
        }
        if isinstance(key, tuple) and key[0] not in ("at", "drag"):
            return names.get(str(key[0]), "Answer")
        return super().step_name(key)

    def on_robot(self) -> None:
        self._example.close()
        # Other numbers are asked on another arm, and answers stay with theirs.
        robot = self.stage.arm.now.robot
        if not self.is_asked and robot.id in self._answers.arm_ids:
            self._answers.ask_about(robot)
        self._sheets.clear()
        self._follow_steps()
        super().on_robot()

    def on_style(self) -> None:
        self._answers.reword()
        self._sheets.clear()
        self._follow_steps()
        super().on_style()

    def on_activity(self) -> None:
        self._follow_steps()
        self.refresh()
        self.due = 0.0

    def state(self) -> dict[str, object]:
        return {**self._answers.state(), **self.settings.state()}

    def restore(self, state: dict[str, object]) -> None:
        self._example.close()
        self._take(state)
        self.rewrite()
        self._begin()

    def remove(self) -> None:
        if self.settings.room is not None:
            self._see_through(False)
        if self.settings.joints:
            self.stage.joints.show_in(None)
        super().remove()

    def _take(self, state: dict[str, object]) -> None:
        """Take what `state` returned; invalid entries are ignored."""
        self._answers.restore(state)
        self.settings = self.settings.restored(state, self.stage.arm.now.robot)
        self.change(misplaced=bool(state) and state.get("arm") is None and not self.is_asked)
        self._sheets.clear()
        self._follow_steps()

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
            if form == "posture" and self.shown is not None:
                given = self.shown.driven(question)
            else:
                given = sheet.given(form, value, self.stage.display.units)
            verdict = progress.answer(key, question.read(given))
        except EntryError as error:
            sheet.error = error.detail if error.title == "The answer was not read" else str(error)
            return
        self._answers.note(key, verdict.right)
        if verdict.right:
            self._follow_steps()
            self._move_to_end(key)

    def _reveal(self, key: str) -> None:
        """Show the answer to a question."""
        if not self._progress.is_closed(key):
            self._progress.reveal(key)
            self._answers.note(key, right=False)
        self._sheets.pop(key, None)
        self._follow_steps()
        self._move_to_end(key)

    def _begin_again(self) -> None:
        """Show the step with nothing entered, at its pose."""
        self._sheets.clear()
        self._follow_steps()
        self.begin()

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
        here = "lesson", self._lesson.key, self.stage.arm.now.robot.id
        if self.is_asked or (item is not None and (item.kind, item.key, item.robot) == here):
            return False
        asked = (key for key in progress.questions if key[0] not in "er" and self._is_on_show(key))
        return not all(map(progress.is_closed, asked))

    def _fetch_arm(self) -> None:
        """Show the arm that the step is about at its pose, and say so."""
        left, about = self.stage.arm.now.robot, self._answers.about
        if left != about:
            self.stage.robots.show(about)
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
        self.stage.arm.move_to(np.array(pose.q), Notice("hand", title, words))
        if pose.drawing and self.shown is not None:
            self.shown.restore(dict(pose.drawing))
        if pose.target is not None:
            self.stage.arm.set_target(pose_from_position_wxyz(pose.target[:3], np.array(pose.target[3:])))
        self.change(target=None if pose.target is None else np.array(pose.target[:3]))
        self.stage.picture.keep_in_view(self.settings.target, self.settings.room)

    def _leading_on(self) -> Following | None:
        """The button to what comes after the lesson."""
        activity = self.stage.activity
        if activity.leads("lesson", self._lesson.key):
            return Following.in_course(activity.progress)
        if self._following and activity.progress.course is None:
            return Following(f"Next lesson: {self._following}", "next")
        return None

    def _follow_steps(self) -> None:
        """After an answer, at another step or arm: lesson, page and picture follow what is on show."""
        here, answers = self.is_asked, self._answers
        shown = self.shown if here else None
        if shown is not None and (outline := shown.on_steps(answers.progress)) is not None:
            answers.progress.use(outline)
        progress, activity = answers.progress, self.stage.activity
        withheld = progress.withheld if here else frozenset[str]()
        if progress.at == len(progress.outline.steps):
            answers.choose_earlier()
        if activity.asked != withheld:  # before anything is shown that would give it away
            activity.asked = withheld
            activity.changed()
        right, count = progress.score
        if right == count > 0:
            activity.pass_lesson(self._lesson.key, self.arm.id, answers.arm_ids)
        if any(asked.form == "posture" for asked in self._forms.values()):
            self.change(joints=True)
        nodes = self._answer_nodes()
        points = np.concatenate([ends(nodes), self._ghost_room()])
        room = points if len(points) else None
        if not same((room,), (self.settings.room,)):
            self.change(room=room)
            self._see_through(bool(nodes))
            self.stage.picture.keep_in_view(self.settings.target, room)

    @property
    def _open_questions(self) -> list[str]:
        return [key for key in self._progress.questions if self._is_on_show(key)]

    @property
    def _forms(self) -> dict[str, Asked]:
        """How the questions on show are answered that still can be."""
        progress = self._progress
        open_ = (key for key in self._open_questions if self.is_asked and not progress.is_closed(key))
        return {key: progress.question(key).asked() for key in open_}

    def _is_on_show(self, key: str) -> bool:
        at = self._progress.at
        return key[0] in "cr" if at == len(self._progress.outline.steps) else key in (str(at + 1), f"e{at + 1}")

    def _answer_nodes(self) -> Sequence[Node]:
        """Where the last answer to the step on show leads, if the step says how it is drawn."""
        progress = self._progress
        steps, key = progress.outline.steps, str(progress.at + 1)
        if not self.is_asked or progress.at == len(steps):
            return ()
        robot, step = self.stage.arm.now.robot, steps[progress.at]
        nodes = answer_nodes(robot, step, progress.given.get(key), progress.is_closed(key))
        if not nodes and step.guessed is not None and key not in progress.given:
            before = f"e{key}"
            given, closed = progress.given.get(before), progress.is_closed(before)
            nodes = lead_nodes(robot, step.estimate, step.guessed, given, closed)
        return nodes

    def _see_through(self, on: bool) -> None:
        """Let the arm hide nothing of an answer that is drawn."""
        if not self._lesson.through:
            self.stage.arm.scene.see_through(on, gizmo=True)

    def _ghost_room(self) -> Array:
        """The corners ``(n, 3)`` of a cube with the frame that is asked for: they tell how far, not which way."""
        progress = self._progress
        key, steps = str(progress.at + 1), progress.outline.steps
        question = steps[progress.at].question if self.is_asked and progress.at < len(steps) else None
        if question is None or question.asked().form != "frame" or progress.is_closed(key):
            return np.zeros((0, 3))
        right: Any = question.right()
        return float(np.abs(right[:3]).max()) * np.array(list(product((-1.0, 1.0), repeat=3)))
