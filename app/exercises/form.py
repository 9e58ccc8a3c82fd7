"""The fields of an exercise as a form: which there are, what each means, and what is typed into them.

A draft is the data of a file, as `tomllib` reads it. `groups` says which cells stand where and what is in them,
`with_cell`, `with_row` and `without_row` change one of them. Whether the draft is an exercise, only
`files.parse_exercise` says: what makes no sense is kept as it was typed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

from app.exercises.cell import Cell, Table
from app.exercises.exercise import Computed, Drawn
from app.exercises.fields import LIMITS, MOST_ITEMS
from app.exercises.files import Head, Task
from app.exercises.kinds import KINDS
from kin import InputError
from kin.parsing import TextError, read_toml

Draft = dict[str, Any]
LONGEST_CELL = 2000  # characters
TABLES = ("vary", "let", "target", "answer")
Field = Cell | Table


@dataclass(frozen=True)
class Entry:
    """A cell with what is in it.

    Attributes:
        path: names it in the form.
        field: its name in messages about the file.
        at: where it is in the draft; of the name of a row, where that row is.
        fixed: whether the file has something there that the form cannot change.
        names: whether it is the name of a row.
    """

    cell: Cell
    path: str
    field: str
    at: tuple[str | int, ...]
    text: str
    fixed: bool = False
    names: bool = False


@dataclass(frozen=True)
class Rows:
    """A table with its rows."""

    table: Table
    path: str
    field: str
    rows: tuple[tuple[Entry, ...], ...]


@dataclass(frozen=True)
class Group:
    """Fields that belong together."""

    title: str
    help: str
    members: tuple[Entry | Rows, ...]


_HEAD: tuple[tuple[str, str, tuple[Field, ...]], ...] = (
    ("About it", "", Head.cells()),
    ("Task", "{t1} is the number t1 from below, in the reader’s unit.", Task.cells()),
    (
        "Numbers",
        "Each student gets other ones. Expressions are in radians and metres: 30*deg, 250*mm, pi/2.",
        (
            Table(
                "vary",
                "Drawn",
                "From, to and step; or a list to choose from.",
                "number",
                Drawn.cells(),
                {"from": -60, "to": 60, "step": 10, "unit": "deg"},
                named=True,
            ),
            Table(
                "let",
                "Computed",
                "From those, and from the arm at its posture.",
                "number",
                Computed.cells(),
                {"value": "0"},
                named=True,
            ),
            Cell(
                "require",
                "Required",
                "One in each line; numbers for which one is false are drawn again.",
                "expressions",
            ),
        ),
    ),
    (
        "Posture and target",
        "",
        (
            Cell("q", "Joints", "One expression in each line; empty: the home pose.", "expressions"),
            Cell("target.q", "Target at", "The pose of the tool at these joints.", "expressions"),
            Cell("target.position", "Target point", "x, y, z, with the orientation at the joints.", "expressions"),
        ),
    ),
)


def read(text: str) -> Draft:
    """The draft of any text; empty if it is no TOML. What should be a table and is none is left out."""
    try:
        data = read_toml(text, LIMITS)
    except TextError:
        return {}
    return {name: value for name, value in data.items() if name not in TABLES or isinstance(value, dict)}


def groups(draft: Draft, robots: Sequence[str] = ()) -> tuple[Group, ...]:
    """The form of a draft; `robots` are the ids of the arms to choose from."""
    found = []
    for title, about, fields in _HEAD:
        found.append(Group(title, about, tuple(_placed(draft, field, (), robots) for field in fields)))
    kind = str(draft.get("kind"))
    answer = tuple(
        _placed(draft, field, ("answer",), robots) for field in (KINDS[kind].cells() if kind in KINDS else ())
    )
    about = f"Kind {kind}: {KINDS[kind].about}" if kind in KINDS else ""
    return (*found, Group("Answer", about, answer))


def entries(draft: Draft) -> Iterator[Entry]:
    """All cells of a draft."""
    for group in groups(draft):
        for member in group.members:
            if isinstance(member, Entry):
                yield member
            else:
                for row in member.rows:
                    yield from row


def with_cell(draft: Draft, path: str, text: str) -> Draft:
    """The draft with another text in a cell. What is empty is left out of the file.

    Raises:
        InputError: there is no such cell, it is fixed, the text is too long, or the name of a row is taken.
    """
    entry = next((one for one in entries(draft) if one.path == path and not one.fixed), None)
    if entry is None:
        raise InputError("field", path, "a field of the form")
    if len(text) > LONGEST_CELL:
        raise InputError(entry.field, f"{len(text)} characters", f"at most {LONGEST_CELL}")
    text = _clean(text)
    if entry.names:
        return _renamed(draft, entry, text.strip())
    made = deepcopy(draft)
    *above, last = entry.at
    table: Any = made
    for name in above:
        if isinstance(name, str) and not isinstance(table.get(name), dict | list):
            table[name] = {} if name not in table else {"value": table[name]}  # a number without a unit
        table = table[name]
    if (value := _value(entry.cell, text)) is None:
        table.pop(last, None)
    else:
        table[last] = value
    if "target" in made and not made["target"]:
        del made["target"]
    return made


def with_row(draft: Draft, path: str) -> Draft:
    """The draft with one more row of a table; raises `InputError` for no table, or a full one."""
    rows = _rows(draft, path)
    table = rows.table
    if len(rows.rows) >= MOST_ITEMS:
        raise InputError(rows.field, len(rows.rows) + 1, f"at most {MOST_ITEMS} rows")
    made = deepcopy(draft)
    inside = made.setdefault("answer", {}) if rows.field.startswith("answer.") else made
    if table.named:
        names = {**made.get("vary", {}), **made.get("let", {})}
        free = next(name for i in range(1, 2 * MOST_ITEMS + 2) if (name := f"n{i}") not in names)
        inside.setdefault(table.name, {})[free] = dict(table.fresh)
    else:
        inside.setdefault(table.name, []).append(dict(table.fresh))
    return made


def without_row(draft: Draft, path: str, index: int) -> Draft:
    """The draft without a row of a table; raises `InputError` if there is none."""
    rows = _rows(draft, path)
    if not 0 <= index < len(rows.rows):
        raise InputError(rows.field, index, "the index of a row")
    made = deepcopy(draft)
    inside = made["answer"] if rows.field.startswith("answer.") else made
    table = inside[rows.table.name]
    del table[list(table)[index] if rows.table.named else index]
    if not table:
        del inside[rows.table.name]
    return made


def _placed(draft: Draft, field: Field, above: tuple[str, ...], robots: Sequence[str]) -> Entry | Rows:
    at = (*above, *field.name.split("."))
    value = _at(draft, at)
    name = ".".join(at)
    if isinstance(field, Cell):
        if field.name == "robot":
            field = replace(field, options=tuple(robots))
        return _entry(field, name, name, at, value)
    rows: list[tuple[Entry, ...]] = []
    if field.named:
        for i, (key, row) in enumerate(value.items() if isinstance(value, dict) else ()):
            row = row if isinstance(row, dict) else {"value": row}
            place = (*at, key)
            named = Entry(Cell("", "Name"), f"{name}[{i}]", f"{name}.{key}", place, key, names=True)
            label, full = f"{name}[{i}]", f"{name}.{key}"
            rows.append(
                (
                    named,
                    *(
                        _entry(c, f"{label}.{c.name}", f"{full}.{c.name}", (*place, c.name), row.get(c.name))
                        for c in field.columns
                    ),
                )
            )
    else:
        for i, row in enumerate(value if _is_tables(value) else ()):
            label = f"{name}[{i}]"
            rows.append(
                tuple(
                    _entry(c, f"{label}.{c.name}", f"{label}.{c.name}", (*at, i, c.name), row.get(c.name))
                    for c in field.columns
                )
            )
    return Rows(field, name, name, tuple(rows))


def _entry(cell: Cell, path: str, field: str, at: tuple[str | int, ...], value: Any) -> Entry:
    text = _text(cell, value)
    return Entry(cell, path, field, at, "" if text is None else text, fixed=text is None)


def _at(draft: Draft, at: tuple[str, ...]) -> Any:
    value: Any = draft
    for name in at:
        value = value.get(name) if isinstance(value, dict) else None
    return value


def _rows(draft: Draft, path: str) -> Rows:
    for group in groups(draft):
        for member in group.members:
            if isinstance(member, Rows) and member.path == path:
                return member
    raise InputError("field", path, "a table of the form")


def _renamed(draft: Draft, entry: Entry, name: str) -> Draft:
    """A row gets another name; the order stays."""
    table, old = str(entry.at[0]), entry.at[1]
    names = {**draft.get("vary", {}), **draft.get("let", {})}
    if name != old and name in names:
        raise InputError(entry.field, name, "a name that no other number has")
    made = deepcopy(draft)
    made[table] = {name if key == old else key: row for key, row in made[table].items()}
    return made


def _text(cell: Cell, value: Any) -> str | None:
    """What a cell shows of a value; None: it cannot show it."""
    match cell.form:
        case "flag":
            if value is None or isinstance(value, bool):
                return "yes" if (cell.default if value is None else value) else "no"
        case "lines" | "expressions" | "numbers":
            items = [] if value is None else value if isinstance(value, list) else [value]
            if all(_is_plain(item) for item in items):
                return "\n".join(map(_shown, items))
        case _ if value is None or _is_plain(value):
            return "" if value is None else _shown(value)
    return None


def _value(cell: Cell, text: str) -> Any:
    """What a text in a cell means in a file; None: nothing."""
    lines = [line.strip() for line in text.split("\n") if line.strip()]
    match cell.form:
        case "flag":
            return None if (text == "yes") == cell.default else not cell.default
        case "lines":
            return lines or None
        case "numbers" | "expressions":
            return [_number(line) for line in lines] or None
        case "number" | "expression":
            return _number(text.strip()) if text.strip() else None
        case "text":
            return text.strip() or None
    return " ".join(text.split()) or None


def _number(text: str) -> int | float | str:
    """A number, or, if it is none, the text."""
    try:
        value = float(text) if re.fullmatch(r"[-+0-9.eE]{1,40}", text) else math.nan
    except ValueError:
        return text
    if not math.isfinite(value):
        return text
    return int(text) if re.fullmatch(r"[-+]?[0-9]{1,15}", text) else value


def _clean(text: str) -> str:
    """Without what no text file holds: control characters, and halves of characters."""
    text = text.replace("\r\n", "\n").replace("\t", " ")
    return "".join(c for c in text if c == "\n" or (c.isprintable() or c == "\u00a0"))


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else repr(value)


def _is_plain(value: Any) -> bool:
    return type(value) in (str, int, float)


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)
