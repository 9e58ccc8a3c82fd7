"""The arm that the table is compared with: one of the service, or a text that was pasted or is in a file.

A text is a robot file (TOML), a URDF, or a bare DH table: one row in a line, as it is copied from a book::

    modified  alpha  a      d      theta
              0      0      333    q1
              -90    0      0      q2 + 90

The first line may name the columns and the convention. Without it they are theta, d, a, alpha, standard. A name
such as ``q1`` is the value of a joint. It stands in the column theta of a joint that turns, or d of one that
slides.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import kin
from app.shared.store import Store
from app.viewer.own_arm import OwnArm, own_arm, pack, unpack
from app.viewer.panel.entry import read_cell
from app.viewer.tabs.robot.files import arm_of, is_urdf
from kin import InputError, Robot, RobotFileError
from kin.files.read import MAX_ROWS
from kin.files.urdf.tree import read_tree
from kin.typed import ReadError, cut
from kin.units import Units

IN_LINK = 3000  # characters of a pasted arm in a link; a longer one stays in the page
_COLUMNS = {
    **dict.fromkeys(("theta", "θ", "th", "theta_i"), "theta"),
    **dict.fromkeys(("d", "d_i"), "d"),
    **dict.fromkeys(("a", "a_i", "r", "a_i-1"), "a"),
    **dict.fromkeys(("alpha", "α", "alpha_i", "alpha_i-1"), "alpha"),
}
_CONVENTIONS = {
    **dict.fromkeys(("modified", "craig", "mdh", "proximal"), "modified"),
    **dict.fromkeys(("standard", "distal", "dh"), "standard"),
}
_USUAL = ("theta", "d", "a", "alpha")
_VARIABLE = re.compile(r"[+]?(?:q|θ|t|theta|th|d)_?\d+\*?(?=$|[-+])", re.I)
_LENGTHS, _OPERATOR = ("d", "a"), re.compile(r"\s*([-+*/^])\s*(?=\S)")


@dataclass(frozen=True, eq=False)
class Reference:
    """An arm to compare with.

    Attributes:
        kept: what a link carries: the id of a robot of the service or a compact arm; None: it is too long.
        note: what is to be said about how it was read.
    """

    robot: Robot
    kept: object = None
    note: str = ""


def of_text(name: str, text: str, units: Units, n: int) -> Reference:
    """The arm of a text.

    Args:
        name: of the file, for messages.
        units: of the numbers of a bare table.
        n: joints of the arm that it is compared with: of a URDF with several ends, one with as many is taken.

    Raises:
        kin.KinematicsError: naming the field, the value and what would be valid.
    """
    if is_urdf(text):
        tips = read_tree(text, name).tips
        tip = None
        if len(tips) > 1:
            tip = min(tips, key=lambda each: (abs(each.joints - n), -each.joints)).link
        try:
            own, note = arm_of(name, text, tip)
        except InputError as error:
            raise RobotFileError(name, error.field, error.value, error.expected) from None
    elif re.search(r"^\s*(\[+\w+\]|\w+\s*=)", text, re.M):
        own, _ = arm_of(name, text)
        note = ""
    else:
        own, note = own_arm(table_of(name, text, units)), ""
    bare = OwnArm(replace(own.robot, capsules=(), capsules_source=""))
    kept = pack(bare)
    return Reference(bare.robot, kept if len(str(kept)) <= IN_LINK else None, note)


def restored(kept: object, store: Store) -> Reference | None:
    """The arm that a link names; None: there is none."""
    if isinstance(kept, str):
        robot = next((each for each in store.robots if each.id == kept), None)
        return None if robot is None else Reference(robot, kept)
    try:
        return Reference(unpack(kept).robot, kept)
    except kin.KinematicsError:
        return None  # a link may come from anybody; what cannot be used is ignored, as elsewhere in links


def table_of(name: str, text: str, units: Units) -> dict[str, Any]:
    """The fields of a robot file for a bare table.

    Raises:
        kin.RobotFileError: naming row and column.
    """
    lines = [cells for line in text.splitlines() if (cells := _cells(line))]
    columns: Sequence[str] = _USUAL
    convention = "standard"
    if lines and any(cell.lower() in (*_COLUMNS, *_CONVENTIONS) for cell in lines[0]):
        words = [cell.lower() for cell in lines.pop(0)]
        convention = next((_CONVENTIONS[word] for word in words if word in _CONVENTIONS), convention)
        columns = [_COLUMNS[word] for word in words if word in _COLUMNS] or _USUAL
        if sorted(columns) != sorted(_USUAL):
            raise RobotFileError(name, "first line", " ".join(words), "each of theta, d, a and alpha once")
    if not lines:
        raise RobotFileError(name, "text", cut(text), "rows with theta, d, a and alpha; a robot file; or a URDF")
    if len(lines) > MAX_ROWS:
        raise RobotFileError(name, "rows", f"{len(lines)} rows", f"at most {MAX_ROWS}")
    rows = [_row(name, i, cells, columns, units) for i, cells in enumerate(lines)]
    about = {"name": "the table as entered", "source": "a table as entered", "convention": convention}
    return {**about, "units": {"length": "mm", "angle": "deg"}, "rows": rows}


def _cells(line: str) -> list[str]:
    """The cells of a line: between bars, tabs or semicolons if there are any, else between blanks."""
    line = line.split("#")[0].translate(str.maketrans("[]{}", "    ")).strip().strip("|,").strip()
    separator = next((s for s in ("|", "\t", ";") if s in line), None)
    if separator is None:
        line = re.sub(r",\s+", " ", line)
        line = re.sub(r"(?<=\S)\s*([*/^])\s*(?=\S)|(?<=\S)\s+([-+])\s+(?=\S)", lambda m: m[1] or m[2], line)
        return line.split()
    return [cell.strip() for cell in line.split(separator) if cell.strip()]


def _row(name: str, index: int, cells: list[str], columns: Sequence[str], units: Units) -> dict[str, Any]:
    """One row of a robot file."""
    number = f"row {index + 1}"
    fixed = cells[-1].lower() == "fixed"
    cells = cells[:-1] if fixed else cells
    if len(cells) == 5 and cells[0].strip(".") == str(index + 1):
        cells = cells[1:]  # rows are often numbered
    if len(cells) != 4:
        raise RobotFileError(name, number, " ".join(cells), f"four numbers: {', '.join(columns)}")
    row: dict[str, Any] = {"name": f"joint {index + 1}", "kind": "fixed" if fixed else "revolute"}
    for column, cell in zip(columns, cells, strict=True):
        rest = re.sub(r"\s+", "", cell)
        variable = column in ("theta", "d") and _VARIABLE.match(rest)
        if variable:
            rest = rest[variable.end() :] or "0"
            row["kind"] = "prismatic" if column == "d" else row["kind"]
        length = column in _LENGTHS
        try:
            row[column] = f"{read_cell(rest, units.of(not length))!r} {'m' if length else 'rad'}"
        except ReadError as error:
            raise RobotFileError(name, f"{number}, {column}", cut(cell), str(error)) from None
    return row


def choices(store: Store) -> Iterator[tuple[str, str]]:
    """Ids and names of the arms of the service."""
    return ((robot.id, robot.name) for robot in store.robots)
