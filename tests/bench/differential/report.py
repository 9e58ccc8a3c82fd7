"""The verdicts of each arm as a table, and the first questions that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from load import table

from differential.compare import Grade, Verdict
from differential.intervals import Judged

_SHOWN = 5  # questions of each arm


@dataclass(slots=True)
class Tally:
    """The verdicts of one arm: counts, and the first that differ."""

    robot: str
    questions: int = 0
    grades: dict[Grade, int] = field(default_factory=lambda: dict.fromkeys(Grade, 0))
    parts: dict[str, int] = field(default_factory=dict)
    judged: list[Judged] = field(default_factory=list)
    first: list[Verdict] = field(default_factory=list)

    def add(self, verdict: Verdict) -> None:
        """Count one more."""
        self.questions += 1
        self.grades[verdict.grade] += 1
        for part, grade in verdict.grades.items():
            if grade is Grade.DIFFERENT:
                self.parts[part] = self.parts.get(part, 0) + 1
        self.judged += verdict.judged
        # Other statuses first, then whatever is wrong with intervals, then the rest.
        self.first = sorted((*self.first, verdict), key=_weight)[:_SHOWN] if verdict.grades else self.first

    @property
    def statuses(self) -> int:
        """Questions whose status differs."""
        return self.parts.get("status", 0)

    def row(self) -> dict[str, Any]:
        """Of the table. An interval is at fault if it is feasible and lost, or infeasible and new."""
        wrong = [judged for judged in self.judged if judged.wrong]
        return {
            "arm": self.robot,
            "questions": self.questions,
            "identical": self.grades[Grade.IDENTICAL],
            "within 1e-9": self.grades[Grade.CLOSE],
            "differ": self.grades[Grade.DIFFERENT],
            "status": self.statuses,
            "cause": self.parts.get("cause", 0),
            "lost rightly": sum(not j.new and not j.wrong for j in self.judged),
            "new rightly": sum(j.new and not j.wrong for j in self.judged),
            "lost feasible": sum(not j.new for j in wrong),
            "new infeasible": sum(j.new for j in wrong),
            "widest wrong": max((j.width for j in wrong), default=0.0),
        }


def _weight(verdict: Verdict) -> tuple[bool, bool, int, int]:
    wrong = any(judged.wrong for judged in verdict.judged)
    return "status" not in verdict.grades, not wrong, -verdict.grade, verdict.number


def show(tallies: Sequence[Tally]) -> int:
    """Print everything; 1 if a status differs, else 0."""
    print(
        table("Old against new: questions, then intervals that only one has", [tally.row() for tally in tallies])
    )
    for tally in tallies:
        parts = ", ".join(f"{part} {count}" for part, count in sorted(tally.parts.items()))
        if tally.first:
            print(f"\n{tally.robot}{': ' if parts else ''}{parts}")
        for verdict in tally.first:
            print(f"  {verdict.number}: {verdict.grade.name.lower()}: {verdict}")
    return int(any(tally.statuses for tally in tallies))
