"""A run as text tables, as JSON, and as a bar chart."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from html import escape
from typing import Any

from app.bench.contestants import OURS, SOLVE_IK
from app.bench.gate import Verdict
from app.bench.run import Entry, Report, RowReport, machine

LEGEND = """\
time            median per pose or target
noise           interquartile range, relative to the time
× array         time relative to our array-level call: median of the ratios within each round
× solve         the same relative to kin.solve_ik
solved          share of targets with a correct answer; of motions: that arrive at rest and keep the limits
branches        correct, distinct answers per target
recall          share of targets whose generating configuration is among the answers
wrong           answers per target with an error above 1e-6
worst residual  of the correct answers, by our forward kinematics
same set        share of targets with the same set of branches as ours"""
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
]
_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


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


def as_json(report: Report, verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """All measurements in seconds, metres and radians, with the times of every round."""
    return {
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


def _entry_json(entry: Entry) -> dict[str, Any]:
    check = entry.check
    found: dict[str, Any] = {
        "name": entry.contestant.name,
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


def picture(report: Report) -> str:
    """A bar chart on a logarithmic scale, one group per row, as SVG."""
    rows = [(row, _ordered(row)) for row in report.rows]
    times = [entry.turns.median for _, entries in rows for entry in entries]
    if not times:
        return '<svg xmlns="http://www.w3.org/2000/svg" width="10" height="10"/>\n'
    low, high = math.floor(math.log10(min(times))), math.ceil(math.log10(max(times)) + 1e-9)
    left, wide, bar, gap = 230, 620, 18, 46

    def x(seconds: float) -> float:
        return left + wide * (math.log10(seconds) - low) / max(high - low, 1)

    height = sum(gap + bar * len(entries) for _, entries in rows) + 50
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1000 {height}" '
        'font-family="system-ui, sans-serif" font-size="12">',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
    ]
    for power in range(low, high + 1):
        at = x(10.0**power)
        parts.append(f'<path d="M{at:.1f} 20V{height - 26}" stroke="#d8dde3"/>')
        parts.append(
            f'<text x="{at:.1f}" y="{height - 10}" text-anchor="middle" fill="#5b6673">{_time(10.0**power)}</text>'
        )
    y = 0.0
    for row, entries in rows:
        y += gap - bar
        title = escape(f"{row.task.row.title} ({row.task.robot.name})")
        parts.append(f'<text x="12" y="{y + 6:.0f}" font-weight="600">{title}</text>')
        y += bar
        for entry in entries:
            end = x(entry.turns.median)
            name = escape(entry.contestant.name)
            parts.append(f'<text x="{left - 8}" y="{y + 9:.0f}" text-anchor="end">{name}</text>')
            parts.append(
                f'<rect x="{left}" y="{y - 2:.0f}" width="{max(end - left, 1.0):.1f}" height="{bar - 5}" '
                f'fill="{_colour(entry)}"/>'
            )
            parts.append(f'<text x="{end + 6:.1f}" y="{y + 9:.0f}" fill="#333b45">{escape(_label(entry))}</text>')
            y += bar
    parts.append("</svg>")
    return "\n".join(parts) + "\n"


def _colour(entry: Entry) -> str:
    if entry.contestant.floor:
        return "#b9c2cc"
    return {OURS: "#1d6fd1", SOLVE_IK: "#6fa8e6"}.get(entry.contestant.name, "#e0913a")


def _label(entry: Entry) -> str:
    words = [_time(entry.turns.median)]
    if entry.check is not None:
        if entry.check.branches is not None:
            words.append(f"{entry.check.branches:.1f} branches")
        if entry.check.success < 1.0:
            words.append(f"{entry.check.success:.0%} solved")
    return ", ".join(words)


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
        _time(entry.turns.median),
        f"{entry.turns.noise:.0%}",
        *("" if value is None else f"{value:.3g}" for value in (entry.to_array, entry.to_solve)),
    ]
    if check is None:
        return cells + [""] * 6
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
    ]


def _time(seconds: float) -> str:
    for scale, unit in _UNITS:
        if seconds >= scale * 0.9995:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def _aligned(lines: list[list[str]]) -> str:
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )
