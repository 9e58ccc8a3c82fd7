"""A run as text tables and as JSON."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from app.bench.board.words import time_text
from app.bench.contestants import OURS, SOLVE_IK
from app.bench.gate import Verdict
from app.bench.run import Entry, Report, RowReport, machine

LEGEND = """\
time            median per pose or target
noise           interquartile range, relative to the time
× array         time relative to our array-level call: median of the ratios within each round
× solve         the same relative to kin.solve_ik
solved          share of targets with a correct answer; of motions: that arrive at rest and keep the limits;
                of collisions: with the verdict of plain numpy on the bodies that the library compares
branches        correct, distinct answers per target
recall          share of targets whose generating configuration is among the answers
wrong           answers per target with an error above 1e-6
worst residual  of the correct answers, by our forward kinematics
same set        share of targets with the same set of branches as ours, or the same verdict on a collision
derivation      processor time to derive the solver, once per arm: not part of the time"""
_HEAD = [
    "",
    "time",
    "noise",
    "× array",
    "× solve",
    "solved",
    "branches",
    "recall",
    "wrong",
    "worst residual",
    "same set",
    "derivation",
]


def table(report: Report) -> str:
    """All rows, one table each, ours first and the peers by time."""
    blocks = []
    for row in report.rows:
        lines = [_HEAD, *(_cells(entry) for entry in _ordered(row))]
        blocks.append(f"{row.task.row.id}: {row.task.row.title} ({row.task.robot.name})\n" + _aligned(lines))
    return "\n\n".join(blocks)


def notes(report: Report) -> list[str]:
    """Lines below the tables: versions, machine, settings, peers that did not take part."""
    lines = [", ".join(f"{name} {version}" for name, version in report.versions.items())]
    lines.append(
        ", ".join(f"{name} {value}" for name, value in machine().items() if name not in ("time", "kinboard"))
    )
    sizes = f"{report.settings.targets} targets, {report.settings.batch} in a batch, seed {report.settings.seed}"
    lines.append(
        f"{report.rounds} rounds, {sizes}, {_clock(report)}" + (", interrupted" if report.interrupted else "")
    )
    if report.missing:
        lines.append(f"not installed: {', '.join(report.missing)}; pip install 'kinboard[bench]' installs them")
    if report.skipped:
        lines.append(f"skipped, because the arm or its closed form is missing: {', '.join(report.skipped)}")
    lines += [f"{row}: {peer} could not take part: {said}" for row, peer, said in report.refused]
    return lines


def as_json(report: Report, verdicts: Sequence[Verdict], command: str) -> dict[str, Any]:
    """All measurements in seconds, metres and radians, with the times of every round."""
    return {
        "command": command,
        "machine": machine(),
        "versions": report.versions,
        "not_installed": list(report.missing),
        "skipped": list(report.skipped),
        "refused": [dict(zip(("row", "peer", "error"), item, strict=True)) for item in report.refused],
        "rounds": report.rounds,
        "interrupted": report.interrupted,
        "clock": _clock(report),
        "targets": report.settings.targets,
        "batch": report.settings.batch,
        "seed": report.settings.seed,
        "rows": [
            {
                "id": row.task.row.id,
                "title": row.task.row.title,
                "robot": row.task.robot.id,
                "robot_name": row.task.robot.name,
                "kind": row.task.row.kind,
                "batch": row.task.row.batch,
                "reference": row.reference,
                "contestants": [_entry_json(entry) for entry in _ordered(row)],
            }
            for row in report.rows
        ],
        "gate": [
            {
                "row": v.gate.row,
                "contestant": v.gate.contestant,
                "floor": v.floor,
                "multiple": v.multiple,
                "most": v.gate.most,
                "passed": v.passed,
            }
            for v in verdicts
        ],
    }


def _clock(report: Report) -> str:
    return "wall clock" if report.settings.clock is time.perf_counter_ns else "processor time"


def _role(entry: Entry) -> str:
    if entry.contestant.floor:
        return "floor"
    return "ours" if entry.contestant.name.startswith(OURS) else "peer"


def _entry_json(entry: Entry) -> dict[str, Any]:
    check = entry.check
    found: dict[str, Any] = {
        "name": entry.contestant.name,
        "role": _role(entry),
        "derivation": entry.contestant.derivation,
        "median": entry.turns.median,
        "best": entry.turns.best,
        "noise": entry.turns.noise,
        "to_array": entry.to_array,
        "to_solve": entry.to_solve,
        "calls_per_turn": entry.turns.calls,
        "targets_per_call": entry.contestant.per_call,
        "seconds": entry.turns.seconds,
    }
    if check is not None:
        found |= {
            "success": check.success,
            "branches": check.branches,
            "recall": check.recall,
            "wrong": check.wrong,
            "position_error": check.position_error,
            "rotation_error": check.rotation_error,
            "same_set": check.same,
        }
    return found


def _ordered(row: RowReport) -> list[Entry]:
    """Floor, ours, then the peers by time."""
    rank = {OURS: 1, SOLVE_IK: 2}
    return sorted(
        row.entries,
        key=lambda e: (0 if e.contestant.floor else rank.get(e.contestant.name, 3), e.turns.median),
    )


def _cells(entry: Entry) -> list[str]:
    check = entry.check
    cells = [
        entry.contestant.name,
        time_text(entry.turns.median),
        f"{entry.turns.noise:.0%}",
        *("" if value is None else f"{value:.3g}" for value in (entry.to_array, entry.to_solve)),
    ]
    if check is None:
        return cells + [""] * 7
    residual = f"{check.position_error:.0e} m"
    if entry.check is not None and check.rotation_error:
        residual += f", {check.rotation_error:.0e} rad"
    return [
        *cells,
        f"{check.success:.0%}",
        "" if check.branches is None else f"{check.branches:.2f}",
        "" if check.recall is None else f"{check.recall:.0%}",
        f"{check.wrong:.2g}",
        residual if check.success else "",
        "" if check.same is None else f"{check.same:.0%}",
        "" if entry.contestant.derivation is None else time_text(entry.contestant.derivation),
    ]


def _aligned(lines: list[list[str]]) -> str:
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )
