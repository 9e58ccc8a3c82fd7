"""Which questions of a lesson were answered, and how."""

from __future__ import annotations

from typing import Literal

from app.exercises.judging import Verdict, is_answer, judge
from app.viewer.lessons.guide.outline import Outline, Question
from kin import InputError

Mark = Literal["open", "right", "wrong", "shown"]


class Progress:
    """A student's way through an outline.

    Attributes:
        at: index of the step on show; the number of steps for the check.
        given: the last answer to each question, by its key.
        revealed: keys of the questions whose answers were requested before they were right.
    """

    def __init__(self, outline: Outline) -> None:
        self.at = 0
        self.given: dict[str, float] = {}
        self.revealed: set[str] = set()
        self.use(outline)

    def use(self, outline: Outline) -> None:
        """Go on with the same lesson in other units."""
        self.outline = outline
        self._questions = dict(outline.questions())

    def question(self, key: object) -> Question:
        """The question with this key; raises `kin.InputError` for another key."""
        if not isinstance(key, str) or key not in self._questions:
            raise InputError("question", key, "one of " + ", ".join(self._questions))
        return self._questions[key]

    def go(self, at: object) -> None:
        """Show another step; raises `kin.InputError` for a step that does not exist."""
        if type(at) is not int or not 0 <= at <= len(self.outline.steps):
            raise InputError("step", at, f"an index from 0 to {len(self.outline.steps)}")
        self.at = at

    def answer(self, key: object, given: object) -> Verdict:
        """Judge an answer and keep it, unless the right one is on show; raises `kin.InputError`."""
        question = self.question(key)
        if not is_answer(question, given):
            raise InputError("answer", given, "the index of an option, or a finite number")
        verdict = judge(question, given)  # type: ignore[arg-type]
        if not self.is_closed(str(key)):
            self.given[str(key)] = given  # type: ignore[assignment]
        return verdict

    def reveal(self, key: object) -> None:
        """Show the right answer."""
        self.question(key)
        if not self.is_closed(str(key)):
            self.revealed.add(str(key))

    def restart(self) -> None:
        """Forget all answers, and begin with the first step."""
        self.at = 0
        self.given.clear()
        self.revealed.clear()

    def verdict(self, key: str) -> Verdict | None:
        """The verdict on the last answer; None if there is none."""
        return judge(self._questions[key], self.given[key]) if key in self.given else None

    def mark(self, key: str) -> Mark:
        """What has become of a question."""
        if key in self.revealed:
            return "shown"
        verdict = self.verdict(key)
        return "open" if verdict is None else "right" if verdict.right else "wrong"

    def is_closed(self, key: str) -> bool:
        """Whether the right answer is on show."""
        return self.mark(key) in ("right", "shown")

    @property
    def score(self) -> tuple[int, int]:
        """How many questions of the check were answered right, of how many."""
        keys = [key for key in self._questions if key.startswith("c")]
        return sum(self.mark(key) == "right" for key in keys), len(keys)

    def state(self) -> dict[str, object]:
        """As JSON."""
        return {"step": self.at, "given": dict(self.given), "revealed": sorted(self.revealed)}

    def restore(self, state: dict[str, object]) -> None:
        """Take what `state` returned; invalid entries are ignored, and answers are judged again."""
        at, given, revealed = state.get("step"), state.get("given"), state.get("revealed")
        self.at = at if type(at) is int and 0 <= at <= len(self.outline.steps) else 0
        self.given = {
            key: value
            for key, value in (given.items() if isinstance(given, dict) else ())
            if key in self._questions and is_answer(self._questions[key], value)
        }
        keys = revealed if isinstance(revealed, list) else []
        self.revealed = {key for key in keys if isinstance(key, str) and key in self._questions}
