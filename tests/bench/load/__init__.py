"""Figures under load, taken from outside: a service of its own process, clients that speak its protocols raw.

`python tests/bench/load MODE` starts `kinboard serve` on a free port, measures, prints a table and keeps
everything with ``--json``. Client and service share the machine, so the clients do as little as they can, and both
sides' processor time stands in the table. Quote figures of one run on an otherwise idle machine only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def percentile(seconds: Sequence[float], percent: float) -> float:
    """Of some times; NaN if there are none."""
    return float(np.percentile(seconds, percent)) if len(seconds) else float("nan")


def latencies(seconds: Sequence[float]) -> dict[str, float]:
    """The row's columns of times that visitors waited."""
    return {f"p{percent} ms": 1e3 * percentile(seconds, percent) for percent in (50, 95, 99)}


def table(title: str, rows: Sequence[dict[str, Any]]) -> str:
    """The rows, which have the same keys, as columns under their names."""
    lines = [list(rows[0]), *([_text(value) for value in row.values()] for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    body = (
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )
    return f"{title}\n" + "\n".join(body)


def _text(value: object) -> str:
    if not isinstance(value, float):
        return str(value)
    if value != value:
        return "–"
    return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"
