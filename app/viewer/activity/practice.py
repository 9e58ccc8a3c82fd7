"""What a student has done: marks, attempts, hints and time of each exercise, as the page's state keeps them."""

from __future__ import annotations

import json
import random
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, get_args

from app.classroom.work import Settled, Work
from app.exercises import Exercise, Exercises, Variant, Verdict
from app.viewer.activity.context import LABEL, ExerciseContext
from kin import InputError

Mark = Literal["open", "wrong", "right", "shown"]
MARKS: tuple[Mark, ...] = get_args(Mark)
MARK_OF: dict[Settled, Mark] = {"open": "open", "right": "right", "shown": "shown"}
LONGEST_ID = 40  # characters, as in files
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


class Claim(NamedTuple):
    """Restored records, the text that their proof is about, and that proof."""

    text: str
    proof: object
    records: dict[str, Record]


class Practice:
    """A student's way through the exercises.

    Alone, the numbers follow from the seed in the page's state, and all that is in the state counts. In a place,
    which is a course or a seat in a room, they follow from a secret of the service as well: nobody can open them
    elsewhere to look at the answer. Marks belong to their place, and count there only with a proof that this
    service has given them.

    Attributes:
        seed: of this student; drawn once.
        at: the exercise on show; None: the list.
        records: what is known of exercises, by id, in the present place.
    """

    def __init__(self, exercises: Exercises) -> None:
        self._exercises = exercises
        self.seed = random.randrange(1, MOST)
        self.at: Exercise | None = None
        self.records: dict[str, Record] = {}
        self._wanted: object = None  # what a restored state has open, if it is not there yet
        self._place: ExerciseContext | None = None
        self._elsewhere: dict[str, dict[str, Record]] = {}  # records of this page in other places, by label
        self._claims: dict[str, Claim] = {}  # what was restored for other places
        self._work: Mapping[str, Work] = {}  # what is stored of the seat
        self._settled: dict[tuple[str, int], Record] = {}  # answers that this page has shown, by id and seed

    def enter(self, place: ExerciseContext | None) -> None:
        """Work in this place from now on; None: alone. A seat is not left for a course."""
        if self.seated or place == self._place:
            return
        self._elsewhere[self._label] = self.records
        self._place = place
        self.records = self._elsewhere.pop(self._label, {})
        if (claim := self._claims.pop(self._label, None)) is not None:
            self._take(claim)

    @property
    def seated(self) -> bool:
        """Whether this is a student's page in a room."""
        return self._place is not None and self._place.seat

    def is_in(self, place: ExerciseContext) -> bool:
        """Whether what is known was judged in this place."""
        return self.seated or self._place == place

    @property
    def _label(self) -> str:
        return "" if self._place is None else self._place.label

    def record(self, exercise: Exercise) -> Record:
        """What is known of an exercise."""
        return self.records.setdefault(exercise.id, Record())

    def open(self, exercise_id: object) -> None:
        """Show an exercise; raises `kin.InputError` for one that does not exist."""
        exercise = self._exercises.get(exercise_id)
        if exercise is None:
            raise InputError("exercise", exercise_id, "the id of an exercise")
        self.at, self._wanted = exercise, None

    def close(self) -> None:
        """Show the list."""
        self.at = self._wanted = None

    def after(self, exercise: Exercise) -> Exercise | None:
        """The next one in the list; None after the last one."""
        known = self._exercises.all
        place = [one.id for one in known].index(exercise.id) + 1
        return known[place] if place < len(known) else None

    def variant(self, exercise: Exercise) -> Variant:
        """The student's numbers."""
        return exercise.variant(self.seed_of(exercise))

    def seed_of(self, exercise: Exercise) -> int:
        """The seed of the student's numbers."""
        variant = self.record(exercise).variant
        if self._place is None:
            return self.seed + MOST * variant
        if self._place.seat:  # the same in all pages of the seat, and one only where no numbers are drawn
            return self._place.seed(exercise.id, variant if exercise.vary else 0)
        return self._place.seed(exercise.id, self.seed, variant)

    def take(self, exercise: Exercise, verdict: Verdict, seconds: float) -> None:
        """Keep a verdict, unless the answer is on show."""
        record = self.record(exercise)
        if record.closed:
            return
        record.attempts = min(record.attempts + 1, MOST)
        record.seconds = min(record.seconds + round(seconds), MOST)
        record.credit = max(record.credit, round(100 * verdict.credit))
        record.mark = "right" if verdict.right else "wrong"
        if record.closed:
            self._settle(exercise)

    def give_up(self, exercise: Exercise) -> None:
        """The answer is shown to who has not found it."""
        self.record(exercise).mark = "shown"
        self._settle(exercise)

    def _settle(self, exercise: Exercise) -> None:
        self._settled[exercise.id, self.seed_of(exercise)] = self.record(exercise)

    def know(self, work: Mapping[str, Work], waiting: bool) -> bool:
        """Take what is stored of the seat, which may be of other pages; returns whether it is news.

        Args:
            waiting: whether answers of this page are not stored yet.
        """
        self._work = work
        before = {key: replace(record) for key, record in self.records.items()}
        for exercise_id, done in work.items():
            exercise = self._exercises.get(exercise_id)
            numbers = None if exercise is None else done.numbers.get(self.seed_of(exercise))
            if exercise is None or numbers is None:
                continue
            record, known = self.record(exercise), MARK_OF[numbers.settled]
            if record.variant and not exercise.vary:
                continue  # begun anew with the same numbers, which do not count any more
            tries = max(record.attempts, numbers.tries) if waiting else numbers.tries
            record.attempts = min(tries, MOST)
            record.credit = max(record.credit, round(100 * numbers.credit))
            if not record.closed:
                record.mark = known if known != "open" or not numbers.tries else "wrong"
        return before != self.records

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
        if self._place is not None:
            state["in"] = self._place.label
            if done:
                state["proof"] = self._place.proof(_claim(self.seed, done))
        return state

    def restore(self, state: dict[str, object]) -> None:
        """Take what `state` returned; invalid entries, and what is not proven in this place, are ignored."""
        seed, done, label = state.get("seed"), state.get("done"), state.get("in", "")
        if _is_count(seed):
            self.seed = seed  # type: ignore[assignment]
        self.at = self._exercises.get(state.get("at"))
        self._wanted = state.get("at")
        records: dict[str, Record] = {}
        for key, entry in done.items() if isinstance(done, dict) else ():
            valid = isinstance(entry, list) and len(entry) == 6 and all(map(_is_count, entry))
            if len(key) <= LONGEST_ID and valid and entry[0] < len(MARKS):  # a course may bring it along later
                records[key] = Record(MARKS[entry[0]], *entry[1:])
        claim = Claim(_claim(seed, done), state.get("proof"), records)
        if label == self._label:
            self._take(claim)
        elif isinstance(label, str):
            self._claims = {label[:LABEL]: claim}

    def invalidate(self) -> None:
        """There may be other exercises: open what a restored state has open, if it is there now."""
        if self.at is None and (found := self._exercises.get(self._wanted)) is not None:
            self.at, self._wanted = found, None

    def _take(self, claim: Claim) -> None:
        """Take restored records as far as they are proven; an answer that this page has shown stays shown."""
        proven = self._place is None or not claim.records or self._place.has_proven(claim.text, claim.proof)
        self.records = claim.records if proven else {}
        for (exercise_id, seed), record in self._settled.items():
            exercise = self._exercises.get(exercise_id)
            if exercise is not None and self.seed_of(exercise) == seed:
                self.records[exercise_id] = record
        self.know(self._work, waiting=True)


def _claim(seed: object, done: object) -> str:
    """What a proof is about, as a text."""
    return json.dumps([seed, done], sort_keys=True, separators=(",", ":"))


def _is_count(value: object) -> bool:
    return type(value) is int and 0 <= value <= MOST
