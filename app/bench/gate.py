"""The regression gate: our times as multiples of a floor that was measured in the same run.

A floor moves with the machine, so a multiple of it means the same on a laptop and in CI. Each side is taken at its
fastest round, which noise can only slow down. The multiples allowed are two to three times what is measured: they
catch a compiled path lost or an allocation in a loop, not a few per cent.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from app.bench.contestants import OURS, RICH, Contestant
from app.bench.rows import ROWS
from app.bench.run import Report, Settings


@dataclass(frozen=True, slots=True)
class Gate:
    """A contestant of a row may take at most `most` times as long as the row's floor."""

    row: str
    contestant: str
    most: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """A gate with the multiple that was measured."""

    gate: Gate
    floor: str
    multiple: float

    @property
    def passed(self) -> bool:
        """Whether it stayed below what is allowed."""
        return self.multiple <= self.gate.most

    def __str__(self) -> str:
        gate = self.gate
        word = "ok" if self.passed else "TOO SLOW"
        return f"{gate.row}, {gate.contestant}: {self.multiple:.2f} × {self.floor}, at most {gate.most:g}: {word}"


GATES: tuple[Gate, ...] = (
    Gate("fk", OURS, 10.0),
    Gate("fk-batch", OURS, 1.5),
    Gate("workspace", OURS, 0.5),
    Gate("ik-pioneer5", OURS, 15.0),
    Gate("ik-pioneer5", RICH, 700.0),
    Gate("ik-pioneer5-batch", OURS, 4.0),
    Gate("ik-srs", OURS, 15.0),
    Gate("ik-srs-batch", OURS, 2.5),
    Gate("ik-puma560-batch", OURS, 3.0),
    Gate("ik-ur5-batch", OURS, 3.0),
    Gate("solve-redundant7-craig", RICH, 1200.0),
)


def quick_settings() -> Settings:
    """The rows that have a gate, without peers, by this thread's own clock, which waits for nobody else."""
    rows = tuple(row for row in ROWS if row.id in {gate.row for gate in GATES})
    quick = Settings(rows=rows, peers=()).quick()
    return replace(quick, targets=8, rounds=10, clock=time.thread_time_ns)


def judge(report: Report, gates: tuple[Gate, ...] = GATES) -> list[Verdict]:
    """The verdicts of all gates whose row was measured."""
    rows = {row.task.row.id: row for row in report.rows}
    found = []
    for gate in gates:
        row = rows.get(gate.row)
        entry = None if row is None else row.named(gate.contestant)
        if row is not None and entry is not None:
            floor = row.floor
            found.append(
                Verdict(gate, floor.contestant.name.removeprefix("floor: "), entry.turns.best / floor.turns.best)
            )
    return found


def slowed(contestant: Contestant, times: int) -> Contestant:
    """The contestant made to do everything several times over, to see whether a gate notices."""
    call: Callable[..., Any] = contestant.call

    def slow(*arguments: Any) -> Any:
        for _ in range(times - 1):
            call(*arguments)
        return call(*arguments)

    return replace(contestant, call=slow)
