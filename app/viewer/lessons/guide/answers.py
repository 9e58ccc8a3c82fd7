"""What a student has answered in a lesson: on each of its arms, and to what its check asks of earlier lessons."""

from __future__ import annotations

from app.viewer.feature import Stage
from app.viewer.lessons.guide import earlier
from app.viewer.lessons.guide.content import arm_for
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Outline
from app.viewer.lessons.guide.progress import Progress
from kin import Robot


class Answers:
    """See the module; in the words and units of a page.

    Attributes:
        arm: the arm that the lesson asks about, which need not be on show; a step may be about another one.
        progress: what was answered on this arm.
    """

    def __init__(self, stage: Stage, lesson: type[Lesson]) -> None:
        self._stage, self._lesson = stage, lesson
        self.arm = stage.arm.now.robot
        self.progress = Progress(self._outline())
        self._earlier: dict[Progress, tuple[earlier.Drawn, ...]] = {}  # what each check asks of earlier lessons
        self._arms: dict[Robot, Progress] = {self.arm: self.progress}

    @property
    def arm_ids(self) -> tuple[str, ...]:
        """The ids of the arms that it asks about, but for single steps."""
        text = self.progress.outline.text
        return () if text is None else text.arms

    @property
    def about(self) -> Robot:
        """The arm that the step on show, or the check, is about."""
        steps, at = self.progress.outline.steps, self.progress.at
        return (steps[at].about if at < len(steps) else None) or self.arm

    @property
    def drawn(self) -> tuple[earlier.Drawn, ...]:
        """What the check asks of earlier lessons."""
        return self._earlier.get(self.progress, ())

    def ask_about(self, robot: Robot) -> None:
        """Go on with the questions about another arm that the file names, at the same step."""
        self.arm = robot
        self._go_on(self._outline())

    def reword(self) -> None:
        """The units have changed, or the words, which may be about other arms."""
        before, outline = self.arm, self._outline()
        if self.arm == before:
            self._use(outline)
        else:
            self._go_on(outline)
        self._ask_earlier()

    def choose_earlier(self) -> None:
        """The check is on show: let it ask something of earlier lessons."""
        if not self.drawn:
            self._earlier[self.progress] = earlier.choose(self._lesson.key, self._stage.activity)
            self._ask_earlier()

    def restart(self) -> None:
        """Forget the answers about this arm."""
        self.progress.restart()
        self._earlier.pop(self.progress, None)
        self.progress.ask_also({})

    def note(self, key: str, right: bool) -> None:
        """An answer was judged or shown: what was missed comes back. An estimate may be wrong."""
        activity = self._stage.activity
        if key in self.progress.earlier:
            exercise = activity.courses.exercises.get(self.drawn[int(key[1:]) - 1][0])
            assert exercise is not None
            activity.take_exercise(exercise, right)
        elif not key.startswith("e"):
            activity.take_question(self._lesson.key, key, self.about.id, right)

    def state(self) -> dict[str, object]:
        """As JSON."""
        drawn = [list(one) for one in self.drawn]
        return {
            **self.progress.state(),
            **({} if self.arm.id == self._stage.arm.now.robot.id else {"arm": self.arm.id}),
            **({"earlier": drawn} if drawn else {}),
        }

    def restore(self, state: dict[str, object]) -> None:
        """Take what `state` returned; invalid entries are ignored."""
        arm = state.get("arm")
        if isinstance(arm, str) and arm in self.arm_ids and arm != self.arm.id:
            self.ask_about(self._stage.services.store.get(arm))
        exercises = self._stage.activity.courses.exercises
        self._earlier[self.progress] = earlier.read(state.get("earlier"), exercises)
        self._ask_earlier()
        self.progress.restore(state)

    def _ask_earlier(self) -> None:
        """Let the check ask what was chosen of earlier lessons, in the reader's units."""
        exercises = self._stage.activity.courses.exercises
        self.progress.ask_also(earlier.questions(self.drawn, exercises, self._stage.display.units))

    def _go_on(self, outline: Outline) -> None:
        """Go on at the same step of an outline for another arm."""
        at, before = self.progress.at, self.progress.outline
        self._arms = {arm: progress for arm, progress in self._arms.items() if progress.begun}
        self.progress = self._arms.setdefault(self.arm, Progress(outline))
        self._earlier = {one: drawn for one, drawn in self._earlier.items() if one in self._arms.values()}
        self._use(outline)
        self.progress.at = outline.step_like(before, at)

    def _use(self, outline: Outline) -> None:
        """Go on with an outline; with one of another text, as far as the answers fit its questions."""
        progress, before = self.progress, self.progress.outline.text
        progress.use(outline)
        if outline.text is not before:
            progress.restore(progress.state())

    def _outline(self) -> Outline:
        """For `arm`, or for another one if the words, which the operator may have changed, do not name that."""
        stage, text = self._stage, self._stage.activity.text(self._lesson.key)
        if arm_for(text, self.arm) != self.arm:
            self.arm = arm_for(text, stage.arm.now.robot)
        return self._lesson.outline_in(self.arm, stage.display.units, text)
