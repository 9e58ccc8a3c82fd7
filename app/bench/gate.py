"""The regression gate: our times as multiples of a floor that was measured in the same run.

A floor depends on the machine as our times do, so a multiple of it means the same on a laptop and in CI. Both
times are those of the fastest round, because noise only slows down. The allowed multiples are two to three times
the measured ones: they catch a lost compiled path or an allocation in a loop, not a few per cent.
"""

from __future__ import annotations

from dataclasses import dataclass

from app.bench.contestants import OURS, SOLVE_IK
from app.bench.run import Report


@dataclass(frozen=True, slots=True)
class Gate:
    """A contestant of a row may take at most `most` times as long as the row's floor."""

    row: str
    contestant: str
    most: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """A gate with the measured multiple."""

    gate: Gate
    floor: str
    multiple: float

    @property
    def passed(self) -> bool:
        """Whether the multiple is within the allowed one."""
        return self.multiple <= self.gate.most

    def __str__(self) -> str:
        gate = self.gate
        word = "ok" if self.passed else "TOO SLOW"
        return f"{gate.row}, {gate.contestant}: {self.multiple:.2f} × {self.floor}, at most {gate.most:g}: {word}"


GATES: tuple[Gate, ...] = (
    Gate("fk", OURS, 6.0),
    Gate("fk-batch", OURS, 0.5),
    Gate("workspace", OURS, 0.25),
    Gate("ik-pioneer5", OURS, 10.0),
    Gate("ik-pioneer5", SOLVE_IK, 260.0),
    Gate("ik-pioneer5-batch", OURS, 2.0),
    Gate("ik-srs", OURS, 10.0),
    Gate("ik-srs-batch", OURS, 1.2),
    Gate("ik-puma560-batch", OURS, 2.0),
    Gate("ik-ur5-batch", OURS, 2.0),
    Gate("collision", OURS, 12.0),
    Gate("solve-redundant7-craig", SOLVE_IK, 360.0),
)


def judge(report: Report, gates: tuple[Gate, ...] = GATES) -> list[Verdict]:
    """Verdicts of all gates whose row was measured."""
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
