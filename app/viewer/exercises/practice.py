"""What a student has done: marks, attempts, hints and time of each exercise, as the page's state keeps them."""

from __future__ import annotations

import hmac
import json
import random
from dataclasses import dataclass
from typing import Literal, get_args

from app.exercises import Exercise, Exercises, Variant, Verdict
from kin import InputError

Mark = Literal["open", "wrong", "right", "shown"]
MARKS: tuple[Mark, ...] = get_args(Mark)
MOST = 100_000  # attempts, seconds, variants


@dataclass
class Record:
    """One exercise.

    Attributes:
        mark: what has become of it.
        attempts, hints, seconds: how many answers, hints on show, time spent on it.
        credit: the best part that was right, in percent.
        variant: how often other numbers were asked for.
    """

    mark: Mark = "open"
    attempts: int = 0
    hints: int = 0
    seconds: int = 0
    credit: int = 0
    variant: int = 0

    @property
    def closed(self) -> bool:
        """Whether the answer is on show."""
        return self.mark in ("right", "shown")


class Practice:
    """A student's way through the exercises.

    Attributes:
        seed: of this student; drawn once.
        at: the exercise on show; None: the list.
        proven: whether everything in the records was judged by this service, as far as that is known.
    """

    def __init__(self, exercises: Exercises) -> None:
        self._exercises = exercises
        self.seed = random.randrange(1, MOST)
        self.at: Exercise | None = None
        self.records: dict[str, Record] = {}
        self.proven = True
        self._key: bytes | None = None
        self._claim: tuple[str, object] | None = None  # what was restored, with its proof, until there is a key

    def use_key(self, key: bytes) -> None:
        """Keep a proof with the state from now on, and check that of a state that was restored."""
        self._key = key
        if self._claim is not None:
            claim, proof = self._claim
            self.proven = isinstance(proof, str) and hmac.compare_digest(
                proof.encode(), self._proof(claim).encode()
            )
            self._claim = None

    def _proof(self, claim: str) -> str:
        assert self._key is not None
        return hmac.new(self._key, f"kinboard.practice:{claim}".encode(), "sha256").hexdigest()[:20]

    def record(self, exercise: Exercise) -> Record:
        """What is known of an exercise."""
        return self.records.setdefault(exercise.id, Record())

    def open(self, exercise_id: object) -> None:
        """Show an exercise; raises `kin.InputError` for one that does not exist."""
        exercise = self._exercises.get(exercise_id)
        if exercise is None:
            raise InputError("exercise", exercise_id, "the id of an exercise")
        self.at = exercise

    def after(self, exercise: Exercise) -> Exercise | None:
        """The next one in the list; None after the last one."""
        ids = [one.id for one in self._exercises.all]
        place = ids.index(exercise.id) + 1
        return self._exercises.all[place] if place < len(ids) else None

    def variant(self, exercise: Exercise) -> Variant:
        """The student's numbers."""
        return exercise.variant(self.seed_of(exercise))

    def seed_of(self, exercise: Exercise) -> int:
        """The seed of the student's numbers."""
        return self.seed + MOST * self.record(exercise).variant

    def take(self, exercise: Exercise, verdict: Verdict, seconds: float) -> None:
        """Keep a verdict, unless the answer is on show."""
        record = self.record(exercise)
        if record.closed:
            return
        record.attempts = min(record.attempts + 1, MOST)
        record.seconds = min(record.seconds + round(seconds), MOST)
        record.credit = max(record.credit, round(100 * verdict.credit))
        record.mark = "right" if verdict.right else "wrong"

    def again(self, exercise: Exercise) -> None:
        """Begin anew, with other numbers."""
        self.records[exercise.id] = Record(variant=(self.record(exercise).variant + 1) % MOST)

    def state(self) -> dict[str, object]:
        """As JSON; empty before the first exercise."""
        done = {
            key: [MARKS.index(one.mark), one.attempts, one.hints, one.seconds, one.credit, one.variant]
            for key, one in self.records.items()
            if one != Record()
        }
        if self.at is None and not done:
            return {}
        state: dict[str, object] = {"seed": self.seed, "at": "" if self.at is None else self.at.id, "done": done}
        if self._key is not None and self.proven and done:
            state["proof"] = self._proof(_claim(self.seed, done))
        return state

    def restore(self, state: dict[str, object]) -> None:
        """Take what `state` returned; invalid entries are ignored."""
        seed, done = state.get("seed"), state.get("done")
        if _is_count(seed):
            self.seed = seed  # type: ignore[assignment]
        self.at = self._exercises.get(state.get("at"))
        self.records = {}
        if done:
            self._claim = _claim(seed, done), state.get("proof")
            self.proven = False
            if self._key is not None:
                self.use_key(self._key)
        for key, entry in done.items() if isinstance(done, dict) else ():
            valid = isinstance(entry, list) and len(entry) == 6 and all(map(_is_count, entry))
            if self._exercises.get(key) is not None and valid and entry[0] < len(MARKS):
                self.records[key] = Record(MARKS[entry[0]], *entry[1:])


def _claim(seed: object, done: object) -> str:
    """What a proof is about, as a text."""
    return json.dumps([seed, done], sort_keys=True, separators=(",", ":"))


def _is_count(value: object) -> bool:
    return type(value) is int and 0 <= value <= MOST
