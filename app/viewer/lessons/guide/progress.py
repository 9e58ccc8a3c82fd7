"""Which questions of a lesson were answered, and how."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from app.exercises.questions import Verdict
from app.viewer.lessons.guide.outline import Outline, Question
from kin import InputError

Mark = Literal["open", "right", "wrong", "shown"]
MOST_MISSES = 99
WAY_AFTER = 2  # misses: before, only what is wrong with the answer is said
LOOK_AGAIN = "Look again; after another answer, the way to it is shown."


class Progress:
    """A student's way through an outline.

    Attributes:
        at: index of the step on show; the number of steps for the check.
        given: the last answer to each question, by its key, as `Question.read` returns it.
        revealed: keys of the questions whose answers were requested before they were right.
        misses: how many wrong answers each question got.
        before: the wrong answer before the last one, if that was wrong too.
        earlier: what the check asks of earlier lessons, by key; it does not count for passing.
    """

    def __init__(self, outline: Outline) -> None:
        self.at = 0
        self.given: dict[str, Any] = {}
        self.revealed: set[str] = set()
        self.misses: dict[str, int] = {}
        self.before: dict[str, Any] = {}
        self.earlier: dict[str, Question] = {}
        self.use(outline)

    def use(self, outline: Outline) -> None:
        """Go on with the same lesson in other units."""
        self.outline = outline
        self._questions = {**dict(outline.questions()), **self.earlier}
        self._judged: dict[str, tuple[object, Verdict]] = {}

    def ask_also(self, earlier: Mapping[str, Question]) -> None:
        """Let the check ask these of earlier lessons."""
        self.earlier = dict(earlier)
        self.use(self.outline)

    @property
    def questions(self) -> Mapping[str, Question]:
        """Every question by its key: those of the outline, then those of earlier lessons."""
        return self._questions

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

    def answer(self, key: object, answer: object) -> Verdict:
        """Judge an answer and keep it, unless the right one is on show; raises `kin.InputError`."""
        question = self.question(key)
        if not question.is_answer(answer):
            raise InputError("answer", answer, "an answer in the form of the question")
        verdict, name = question.judge(answer), str(key)
        if not self.is_closed(name):
            if not verdict.right and self.given.get(name) != answer:
                self.misses[name] = min(self.misses.get(name, 0) + 1, MOST_MISSES)
                if name in self.given:
                    self.before[name] = self.given[name]
            self.given[name] = answer
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
        self.misses.clear()
        self.before.clear()

    def again(self, key: object) -> None:
        """Go to a question, and ask it as if it had not been answered; raises `kin.InputError` for another key."""
        self.question(key)
        name, step = str(key), str(key).removeprefix("e")
        self.at = int(step) - 1 if step.isdecimal() else len(self.outline.steps)
        self.given.pop(name, None)
        self.revealed.discard(name)
        self.misses.pop(name, None)
        self.before.pop(name, None)

    def verdict(self, key: str) -> Verdict | None:
        """The verdict on the last answer; None if there is none."""
        if key not in self.given:
            return None
        answer, before = self.given[key], self._judged.get(key)
        if before is None or before[0] is not answer:
            before = self._judged[key] = answer, self._questions[key].judge(answer)
        return before[1]

    def feedback(self, key: str) -> str:
        """What is said about the last answer: what is wrong with it, and from the second miss on the way."""
        verdict = self.verdict(key)
        if verdict is None:
            return ""
        if verdict.right or self.misses.get(key, 0) < WAY_AFTER:
            return verdict.full if verdict.right else verdict.reason or LOOK_AGAIN
        compared = self._questions[key].compared(self.given[key], self.before[key]) if key in self.before else ""
        return " ".join(filter(None, (verdict.reason, compared, verdict.way)))

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
    def begun(self) -> bool:
        """Whether there is an answer."""
        return bool(self.given or self.revealed)

    @property
    def withheld(self) -> frozenset[str]:
        """Facts that the page must not show now, because the open question asks for them."""
        steps, key = self.outline.steps, str(self.at + 1)
        if self.at < len(steps):
            step = steps[self.at]
            return frozenset() if step.question is None or self.is_closed(key) else step.withheld
        return frozenset().union(
            *(facts for number, facts in enumerate(self.outline.withheld, 1) if not self.is_closed(f"c{number}"))
        )

    @property
    def score(self) -> tuple[int, int]:
        """How many questions of the check were answered right, of how many."""
        keys = [key for key in self._questions if key.startswith("c")]
        return sum(self.mark(key) == "right" for key in keys), len(keys)

    def state(self) -> dict[str, object]:
        """As JSON."""
        state = {"step": self.at, "given": dict(self.given), "revealed": sorted(self.revealed)}
        more = {"misses": dict(self.misses), "before": dict(self.before)}
        return {**state, **{name: values for name, values in more.items() if values}}

    def restore(self, state: dict[str, object]) -> None:
        """Take what `state` returned; invalid entries are ignored, and answers are judged again."""
        at, revealed = state.get("step"), state.get("revealed")
        self.at = min(at, len(self.outline.steps)) if type(at) is int and at >= 0 else 0  # another arm has fewer
        self.given, self.before = (self._answers(state.get(name)) for name in ("given", "before"))
        keys = revealed if isinstance(revealed, list) else []
        self.revealed = {key for key in keys if isinstance(key, str) and key in self._questions}
        misses = state.get("misses")
        self.misses = {
            key: value
            for key, value in (misses.items() if isinstance(misses, dict) else ())
            if key in self._questions and type(value) is int and 0 < value <= MOST_MISSES
        }

    def _answers(self, entry: object) -> dict[str, Any]:
        """Those of a link, by question, that can be answers."""
        return {
            key: value
            for key, value in (entry.items() if isinstance(entry, dict) else ())
            if key in self._questions and self._questions[key].is_answer(value)
        }
