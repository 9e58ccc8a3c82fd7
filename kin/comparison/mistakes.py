"""The mistakes people make when they type a DH table, as changes that undo them.

Each change has a cost: how unlikely the mistake is, from the forums where people ask why their table differs. A
change applies to many tables at once, so that pairs of changes are the changes of changed tables.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from kin.angles import wrapped
from kin.comparison.tables import ALPHA, COLUMNS, THETA, A, D, Tables
from kin.dh.tables import convert_dh
from kin.robot import CONVENTIONS, KIND_CODES, Convention, Robot
from kin.transforms import Array

Mistake = Literal[
    "convention",
    "degrees",
    "radians",
    "millimetres",
    "metres",
    "centimetres",
    "sign",
    "quarter turn",
    "half turn",
    "offset",
    "twist",
    "exchanged",
    "shifted",
    "typed twice",
    "superfluous row",
    "missing row",
    "rows exchanged",
    "kind",
    "decimal point",
    "base",
    "tool",
    "value",
]


@dataclass(frozen=True)
class Edit:
    """A change of a table.

    Attributes:
        mistake: what it undoes.
        rows: indices of the rows that it names, none if it concerns the whole table.
        columns: the columns, none if it concerns whole rows.
        cost: how unlikely the mistake is.
        apply: returns the changed tables.
    """

    mistake: Mistake
    rows: tuple[int, ...]
    columns: tuple[str, ...]
    cost: float
    apply: Callable[[Tables], Tables]


@lru_cache(maxsize=16)
def table_in(reference: Robot, convention: Convention) -> Tables:
    """The table of the reference in a convention; not to be written to."""
    return Tables.of(convert_dh(replace(reference, capsules=(), capsules_source=""), convention))


def edits(m: int, reference: Robot, frames_too: bool) -> Iterator[Edit]:
    """Changes of tables with m rows that keep the number of rows.

    Args:
        reference: the arm that the tables are compared with.
        frames_too: whether its base and tool may have been left out.
    """
    yield from edits_by_themselves(m)
    yield from _shifts(m, reference)
    yield from _numbers(m)
    if frames_too:
        base, tool = reference.T_world_base, reference.T_last_tool
        yield Edit("base", (), (), 1.0, lambda t: replace(t, base=np.broadcast_to(base, t.base.shape)))
        yield Edit("tool", (), (), 1.0, lambda t: replace(t, tool=np.broadcast_to(tool, t.tool.shape)))


def edits_by_themselves(m: int) -> Iterator[Edit]:
    """Those of them that need no reference."""
    yield Edit("convention", (), (), 0.4, _other_convention)
    yield from _units()
    yield from _signs(m)
    yield from _angles(m)
    yield from _exchanges(m)


@lru_cache(maxsize=16)
def known_edits(m: int, reference: Robot, frames_too: bool) -> tuple[Edit, ...]:
    """All changes that keep the number of rows, the likely ones first; arguments as for `edits`."""
    several = [*edits(m, reference, frames_too), *own_numbers(m, reference)]
    return tuple(sorted(several, key=lambda edit: edit.cost))


def applied(several: Sequence[Edit], single: Tables) -> Tables:
    """A single table with each of the changes, which keep the number of rows."""
    names = ("cells", "kinds", "modified", "base", "tool")
    parts = {name: np.repeat(getattr(single, name), len(several), axis=0) for name in names}
    for k, edit in enumerate(several):
        if isinstance(edit.apply, OnCells):
            edit.apply.change_in(parts["cells"][k])
        else:
            changed = edit.apply(single)
            for name in names:
                parts[name][k] = getattr(changed, name)[0]
    return Tables(**parts)


def _other_convention(tables: Tables) -> Tables:
    return replace(tables, modified=~tables.modified)


@dataclass(frozen=True)
class OnCells:
    """A change of some cells.

    Attributes:
        rows, columns: which.
        change: maps their values ``(..., rows)`` of one column.
    """

    rows: slice
    columns: tuple[int, ...]
    change: Callable[[Array], Array]

    def __call__(self, tables: Tables) -> Tables:
        """The changed tables."""
        cells = tables.cells.copy()
        self.change_in(cells)
        return tables.with_cells(cells)

    def change_in(self, cells: Array) -> None:
        """Change cells ``(..., m, 4)`` where they are."""
        for column in self.columns:
            part = cells[..., self.rows, column]
            part[...] = self.change(part)


def on_cells(rows: slice | tuple[int, ...], columns: tuple[int, ...], change: Callable[[Array], Array]) -> OnCells:
    """A change of all rows, or of one."""
    return OnCells(rows if isinstance(rows, slice) else slice(rows[0], rows[0] + 1), columns, change)


def _names(*columns: int) -> tuple[str, ...]:
    return tuple(COLUMNS[c] for c in columns)


def _times(factor: float) -> Callable[[Array], Array]:
    return lambda values: values * factor


def _constant(value: float) -> Callable[[Array], Array]:
    return lambda values: np.full_like(values, value)


def _units() -> Iterator[Edit]:
    every = slice(None)
    for columns, cost in (((THETA, ALPHA), 0.2), ((THETA,), 0.6), ((ALPHA,), 0.6)):
        for mistake, factor in (("degrees", math.pi / 180.0), ("radians", 180.0 / math.pi)):
            yield Edit(mistake, (), _names(*columns), cost, on_cells(every, columns, _times(factor)))  # type: ignore[arg-type]
    for columns, extra in (((D, A), 0.0), ((D,), 0.4), ((A,), 0.4)):
        for mistake, factor, cost in (
            ("millimetres", 1e-3, 0.5),
            ("metres", 1e3, 0.5),
            ("centimetres", 1e-2, 1.3),
            ("centimetres", 1e2, 1.3),
            ("centimetres", 10.0, 1.5),
            ("centimetres", 0.1, 1.5),
        ):
            yield Edit(mistake, (), _names(*columns), cost + extra, on_cells(every, columns, _times(factor)))  # type: ignore[arg-type]


def _signs(m: int) -> Iterator[Edit]:
    for column, cost in ((ALPHA, 0.5), (A, 0.9), (D, 0.9), (THETA, 1.1)):
        for i in range(m):
            yield Edit("sign", (i,), _names(column), cost, on_cells((i,), (column,), np.negative))
        yield Edit(
            "sign",
            (),
            _names(column),
            1.0 + 0.2 * (column != ALPHA),
            on_cells(slice(None), (column,), np.negative),
        )


def _angles(m: int) -> Iterator[Edit]:
    def plus(angle: float) -> Callable[[Array], Array]:
        return lambda values: wrapped(values + angle)

    for i in range(m):
        for angle in (0.5 * math.pi, -0.5 * math.pi):
            yield Edit("quarter turn", (i,), ("theta",), 0.7, on_cells((i,), (THETA,), plus(angle)))
        yield Edit("half turn", (i,), ("theta",), 1.0, on_cells((i,), (THETA,), plus(math.pi)))
        yield Edit("offset", (i,), ("theta",), 0.9, on_cells((i,), (THETA,), np.zeros_like))
        for quarters in (0, 1, -1, 2):
            yield Edit(
                "twist", (i,), ("alpha",), 1.4, on_cells((i,), (ALPHA,), _constant(0.5 * math.pi * quarters))
            )


def _exchanges(m: int) -> Iterator[Edit]:
    for first, second, cost in ((D, A, 0.9), (THETA, ALPHA, 1.2)):
        for rows in [(), *((i,) for i in range(m))]:
            chosen = list(rows) if rows else slice(None)

            def exchange(
                t: Tables, chosen: list[int] | slice = chosen, pair: tuple[int, int] = (first, second)
            ) -> Tables:
                cells = t.cells.copy()
                cells[:, chosen, pair[0]], cells[:, chosen, pair[1]] = (
                    t.cells[:, chosen, pair[1]],
                    t.cells[:, chosen, pair[0]],
                )
                return t.with_cells(cells)

            yield Edit("exchanged", rows, _names(first, second), cost + 0.1 * (not rows), exchange)
    for i in range(m):
        for j in range(i + 1, m):

            def swap(t: Tables, i: int = i, j: int = j) -> Tables:
                order = list(range(m))
                order[i], order[j] = j, i
                # Which rows are fixed stays, so that all tables have the same joints.
                same = (t.kinds[:, i] == 0.0) == (t.kinds[:, j] == 0.0)
                return replace(t, cells=t.cells[:, order], kinds=t.kinds[:, order] if same.all() else t.kinds)

            yield Edit("rows exchanged", (i, j), (), 1.3 if j == i + 1 else 2.0, swap)


def _shifts(m: int, reference: Robot) -> Iterator[Edit]:
    """Columns typed a row too early or too late; the row that is left open gets the reference's number."""
    fills = [np.zeros((m, 4))]
    if m == len(reference.rows):
        fills += [table_in(reference, convention).cells[0] for convention in CONVENTIONS]
    for columns in ((A, ALPHA), (A,), (ALPHA,), (THETA, D), (D,), (THETA,)):
        for step in (1, -1):
            for fill in fills:

                def shift(
                    t: Tables, columns: tuple[int, ...] = columns, step: int = step, fill: Array = fill
                ) -> Tables:
                    cells, opened, chosen = t.cells.copy(), 0 if step > 0 else -1, list(columns)
                    cells[:, :, chosen] = np.roll(t.cells[:, :, chosen], step, axis=1)
                    cells[:, opened, chosen] = fill[opened, chosen]
                    return t.with_cells(cells)

                yield Edit("shifted", (), _names(*columns), 1.2, shift)


def _numbers(m: int) -> Iterator[Edit]:
    revolute, prismatic = KIND_CODES["revolute"], KIND_CODES["prismatic"]
    for i in range(m):
        for column in (A, D):
            for mistake, factor, cost in (
                ("decimal point", 10.0, 1.3),
                ("decimal point", 0.1, 1.3),
                ("millimetres", 1e-3, 1.2),
                ("metres", 1e3, 1.2),
            ):
                yield Edit(mistake, (i,), _names(column), cost, on_cells((i,), (column,), _times(factor)))  # type: ignore[arg-type]
        for column in (THETA, ALPHA):
            for mistake, factor in (("degrees", math.pi / 180.0), ("radians", 180.0 / math.pi)):
                yield Edit(mistake, (i,), _names(column), 1.4, on_cells((i,), (column,), _times(factor)))  # type: ignore[arg-type]

        def kind(t: Tables, i: int = i) -> Tables:
            kinds = t.kinds.copy()
            old = t.kinds[:, i]
            kinds[:, i] = np.where(old == revolute, prismatic, np.where(old == prismatic, revolute, old))
            return replace(t, kinds=kinds)

        yield Edit("kind", (i,), (), 1.6, kind)


def fewer_rows(tables: Tables) -> Iterator[tuple[Edit, Tables]]:
    """A single table without one of its rows: it was typed twice, or is superfluous."""
    for i in range(tables.rows):
        cells = tables.cells[0]
        twice = (i and np.array_equal(cells[i], cells[i - 1])) or (
            i + 1 < len(cells) and np.array_equal(cells[i], cells[i + 1])
        )

        def without(t: Tables, i: int = i) -> Tables:
            return replace(t, cells=np.delete(t.cells, i, axis=1), kinds=np.delete(t.kinds, i, axis=1))

        edit = (
            Edit("typed twice", (i,), (), 0.8, without)
            if twice
            else Edit("superfluous row", (i,), (), 2.0, without)
        )
        yield edit, without(tables)


def more_rows(tables: Tables, reference: Robot) -> Iterator[tuple[Edit, Tables]]:
    """A single table with a row of the reference, which was left out, in either convention."""
    for convention in CONVENTIONS:
        rows = table_in(reference, convention)
        for i in range(min(rows.rows, tables.rows + 1)):

            def with_row(t: Tables, i: int = i, rows: Tables = rows) -> Tables:
                cells = np.insert(t.cells, i, rows.cells[0, i], axis=1)
                return replace(t, cells=cells, kinds=np.insert(t.kinds, i, rows.kinds[0, i], axis=1))

            cost = 0.8 if convention == reference.convention else 1.2
            yield Edit("missing row", (i,), (), cost, with_row), with_row(tables)


def own_numbers(m: int, reference: Robot) -> Iterator[Edit]:
    """Each cell with the reference's number for it, in either convention, where both have as many rows."""
    if m != len(reference.rows):
        return
    for convention in CONVENTIONS:
        cells = table_in(reference, convention).cells[0]
        for i in range(m):
            for column in range(4):
                yield value_edit(i, column, float(cells[i, column]), 2.2)


def value_edit(row: int, column: int, value: float, cost: float) -> Edit:
    """One cell with another number."""
    change = on_cells((row,), (column,), _constant(value))
    return Edit("value", (row,), _names(column), cost, change)
