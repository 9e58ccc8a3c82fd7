"""The numbers of a worksheet as CSV: a line per DH row with its matrix A, and a last line with the tool's pose."""

from __future__ import annotations

import csv
import io
import math

from app.exports.worksheet.sheet import Sheet
from app.shared.spreadsheets import cell
from kin.transforms import Array

ENTRIES = tuple(f"m{r}{c}" for r in range(1, 4) for c in range(1, 5))


def csv_text(sheet: Sheet) -> str:
    """The table in the units of the sheet, which the heads name; numbers can be read back exactly."""
    angle = "deg" if sheet.units.degrees else "rad"
    length = sheet.units.length
    heads = [
        "row",
        "name",
        "kind",
        f"theta_{angle}",
        f"d_{length}",
        f"a_{length}",
        f"alpha_{angle}",
        "lower",
        "upper",
        "value",
        *ENTRIES,
    ]
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(heads)
    values = sheet.values_of_rows
    for i, (row, A) in enumerate(zip(sheet.robot.rows, sheet.matrices, strict=True)):
        unit = sheet.units.of(row.kind != "prismatic").scale
        limits = ("", "") if row.limits is None else tuple(limit * unit for limit in row.limits)
        table = [
            value * sheet.units.of(k in (0, 3)).scale
            for k, value in enumerate((row.theta, row.d, row.a, row.alpha))
        ]
        value = values[i] * unit if i in values else ""
        writer.writerow(
            [i + 1, cell(row.name), row.kind, *map(_clean, (*table, *limits, value)), *_entries(sheet, A)]
        )
    writer.writerow(["tool", "", "", *[""] * 7, *_entries(sheet, sheet.pose)])
    return file.getvalue()


def _entries(sheet: Sheet, T: Array) -> list[object]:
    scale = sheet.units.lengths.scale
    return [_clean(value * (scale if c == 3 else 1.0)) for row in T[:3].tolist() for c, value in enumerate(row)]


def _clean(value: object) -> object:
    """Without −0, and without the last digits that a change of units adds."""
    return float(f"{value:.15g}") + 0.0 if isinstance(value, float) and math.isfinite(value) else value
