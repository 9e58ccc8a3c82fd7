"""Recordings as CSV: a row for each change of the commanded or the measured configuration, or of the gripper."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Mapping

import numpy as np

from app.live.recording.recording import MEASURED, MEASURED_GRIPPER, OPENED, SHOWN, Bounds, Entry, Recording
from kin import InputError, Robot
from kin.parsing import Limits, TextError, read_csv

LONGEST_ROW = 16 * 1024  # characters: two numbers and names for each of 32 joints are a few thousand
WAYS = {"commanded": SHOWN, "measured": MEASURED}
GRIPPER = "gripper (0 to 1)"  # the column after the joints, if the recording has an opening
GRIPPERS = [GRIPPER, "measured gripper (0 to 1)"]  # both, if it has a measured one


def heads(robot: Robot) -> list[str]:
    """The first row of the table of an arm, without the gripper."""
    units = ["rad" if turns else "m" for turns in robot.revolute]
    joints = [joint.name.replace(",", " ") for joint in robot.joints]
    return [
        "t (s)",
        *(f"{what} {name} ({unit})" for what in WAYS for name, unit in zip(joints, units, strict=True)),
    ]


def to_csv(recording: Recording) -> str:
    """What was commanded and measured at each change, joint by joint; an empty cell: nothing yet."""
    track = recording.track()
    columns, names = [track.commanded, track.measured], heads(recording.robot)
    openings = [track.opening[:, None], track.measured_opening[:, None]]
    known = max((k for k, each in enumerate(openings, 1) if not np.isnan(each).all()), default=0)
    columns, names = [*columns, *openings[:known]], [*names, *GRIPPERS[:known]]
    lines = [",".join(names)]
    for t, row in zip(track.t.tolist(), np.hstack(columns).tolist(), strict=True):
        cells = ["" if value != value else repr(value) for value in row]
        lines.append(",".join([f"{t:.6f}", *cells]))
    return "\n".join(lines) + "\n"


def from_csv(data: bytes, robot: Robot, bounds: Bounds) -> Recording:
    """A recording of this arm from the bytes of a file that `to_csv` wrote, as a spreadsheet may have saved it.

    Raises:
        InputError: it has more bytes than `bounds` says, is no such table, or that of an arm with other joints.
    """
    rows = read_csv(data, Limits(bounds.size, LONGEST_ROW))
    try:
        _, first = next(rows, (0, []))
        if first not in [[*heads(robot), *GRIPPERS[:count]] for count in range(3)]:
            raise _other_table(first, robot)
        columns = {topic: slice(1 + k * robot.n, 1 + (k + 1) * robot.n) for k, topic in enumerate(WAYS.values())}
        for topic, place in zip((OPENED, MEASURED_GRIPPER), range(1 + 2 * robot.n, len(first)), strict=False):
            columns[topic] = slice(place, place + 1)
        entries: list[Entry] = []
        last, seen = 0.0, dict.fromkeys(columns, "")
        for line, row in rows:
            if len(row) != len(first):
                raise InputError(f"recording, line {line}", f"{len(row)} cells", f"{len(first)} cells")
            last = _take(row, line, columns, last, seen, entries)
    except TextError as error:
        valid = "a recording of a connection (CSV)" if error.syntax else error.expected
        raise InputError("recording", error.value, valid) from None
    return Recording(robot, bounds=bounds).restored(entries, last)


def _take(
    row: list[str],
    line: int,
    columns: Mapping[str, slice],
    last: float,
    seen: dict[str, str],
    entries: list[Entry],
) -> float:
    """Add what has changed in a row since those before; returns its time. `columns`: of each topic."""
    t = _number(row[0], line)
    if t < last:
        raise InputError(f"recording, line {line}", row[0], f"a time from {last:g} s on")
    before = len(entries)
    for topic, place in columns.items():
        values = [_number(cell, line) for cell in row[place]] if any(row[place]) else None
        value = values[0] if values and topic in (OPENED, MEASURED_GRIPPER) else values
        text = json.dumps({topic.rpartition("/")[2]: value})
        if text != seen[topic] and (values is not None or seen[topic]):
            entries.append(Entry(t, topic, text.encode()))
            seen[topic] = text
    if len(entries) == before and entries:
        entries.append(Entry(t, entries[-1].topic, entries[-1].data))  # said once more
    return t


def _number(cell: str, line: int) -> float:
    try:
        value = float(cell) if cell.isascii() else math.nan  # `float` takes the digits of every script
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"recording, line {line}", cell, "a number")
    return value


def _other_table(first: list[str], robot: Robot) -> InputError:
    """Why this is not the first row of a recording of the arm."""
    known = [name for name in first if name.startswith("commanded ")]
    if first[:1] != ["t (s)"] or not known:
        return InputError("recording", ", ".join(first), "a recording of a connection (MCAP or CSV)")
    given, own = (
        ", ".join(itertools.islice((name.removeprefix("commanded ") for name in names), robot.n + 1))
        for names in (known, heads(robot)[1 : 1 + robot.n])
    )
    return InputError("recording", f"joints {given}", f"those of the arm on show, {robot.name}: {own}")
