"""Fields of the workpiece frames, below those of tool and base. Pure: frames in, frames out.

Their cells are ``("frame-0", "x")`` and the like.
"""

from __future__ import annotations

import re

from app.viewer.feature import Stage
from app.viewer.frames import MOST, Frames
from app.viewer.panel.entry import read_cell
from app.viewer.tabs.robot.edits import AXES, Cell, EditError
from kin import InputError
from kin.files.numbers import index_of
from kin.typed import ReadError, cut
from kin.units import Units

COLUMNS = (*AXES, "name")


def workpiece_of(where: int | str) -> int | None:
    """The index of the workpiece of a cell; None: the cell is another one's."""
    match = re.fullmatch(r"frame-([0-9])", where) if isinstance(where, str) else None
    return None if match is None else int(match[1])


def typed(frames: Frames, cell: Cell, text: str, units: Units) -> Frames:
    """The frames with this text in a cell; raises `EditError`."""
    where, column = cell
    index = workpiece_of(where)
    if index is None or index >= len(frames.workpieces) or column not in COLUMNS:
        raise InputError("cell", cell, "a cell of a workpiece frame")
    try:
        if column == "name":
            return frames.rename(index, text)
        axis = AXES.index(column)
        return frames.move(index, axis, read_cell(text, units.of(axis >= 3)))
    except ReadError as error:
        raise EditError(cell, str(error)) from None
    except InputError as error:
        raise EditError(cell, f"“{cut(text)}” is not valid: expected {error.expected}") from None


def added(stage: Stage) -> Frames:
    """One more frame, upright at the tool point."""
    if len(stage.display.frames.workpieces) >= MOST:
        raise InputError("workpieces", f"{MOST + 1} frames", f"at most {MOST} in a page")
    return stage.display.frames.add(stage.arm.now.T_goal[:3, 3])


def removed(frames: Frames, index: object) -> Frames:
    """Without the frame at this place."""
    count = len(frames.workpieces)
    place = index_of(index, count)
    if place is None:
        raise InputError("frame-remove", index, f"0 to {count - 1}")
    return frames.remove(place)
