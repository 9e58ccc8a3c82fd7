"""Entries of a unit in one form, so that one function of the module can call them all: with an array of slots."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

from kin.codegen import c
from kin.codegen.extension import wanted
from kin.codegen.source import plain
from kin.codegen.types import NONE, ArrayOf, TupleOf, Type
from kin.codegen.units import Entry, Prototype, Value, translated

_FAILS = "_Noreturn void kinboard_no_memory(void);\n#define KINBOARD_NO_MEMORY kinboard_no_memory()"
HEADER = (Path(__file__).parent / "unit.h").read_text(encoding="utf-8")


def unit(name: str, entries: Iterable[Entry], checked: bool = False) -> str:
    """C of some entries and of all kernels that they need, with the table ``kinboard_unit_NAME`` of the entries.

    Args:
        checked: whether each index is compared with its axis, and one outside is an error.

    Raises:
        OutsideSubsetError: one of the kernels cannot be translated.
    """
    kernels, prototypes = translated(entries, checked)
    rows = [f"  {_row(each)}," for each in prototypes]
    table = ["static const kinboard_entry entries[] = {", *rows, "};"]
    made = f"const kinboard_unit kinboard_unit_{name} = {{entries, {len(rows)}}};\n"
    functions = [text for each in prototypes for text in (wanted.check(each), _call(each))]
    return "\n".join([_FAILS, kernels, HEADER, *functions, *table, made])


def _row(made: Prototype) -> str:
    kernel, arguments = plain(made.entry.kernel), iter(made.arguments)
    takes = "".join(_takes(kind, arguments) for kind in made.entry.kinds)
    name = f"{kernel.__module__}.{kernel.__qualname__}"
    texts = ", ".join(f'"{text}"' for text in (name, takes, _gives(made.result), wanted.demands(made)))
    return f"{{{texts}, wrong_{made.name}, call_{made.name}, {made.blocks}, {str(made.brief).lower()}}}"


def _takes(kind: Type, values: Iterator[Value]) -> str:
    if isinstance(kind, TupleOf):
        return f"({''.join(_takes(each, values) for each in kind.items)})"
    value = next(values)
    return c.mangled(kind) + (("w" if value.written else "r") if isinstance(kind, ArrayOf) else "")


def _gives(kind: Type) -> str:
    if isinstance(kind, TupleOf):
        return f"({chr(ord('0') + len(kind.items))}{''.join(map(_gives, kind.items))})"
    return "n" if kind == NONE else c.mangled(kind)


def _call(made: Prototype) -> str:
    """A function that calls an entry with the values of the slots, and stores the results there."""
    at, to, passed, before, after = itertools.count(), itertools.count(), list[str](), list[str](), list[str]()
    for value in made.arguments:
        place = f"slots[{next(at)}]"
        if isinstance(value.kind, ArrayOf):
            passed += [f"{place}.p", *(f"slots[{next(at)}].i" for _ in range(value.kind.ndim))]
        else:
            passed.append(f"{place}.{c.mangled(value.kind)}")
    for k, value in enumerate(made.results):
        place = f"slots[{next(to)}]"
        if isinstance(value.kind, ArrayOf):
            before.append(f"  {c.name_of(value.kind.item)} *x{k};")
            after.append(f"  {place}.p = x{k};")
            passed += [f"&x{k}", *(f"&slots[{next(to)}].i" for _ in range(value.kind.ndim))]
        else:
            passed.append(f"&{place}.{c.mangled(value.kind)}")
    passed += ["room"] if made.blocks else []
    size = max(next(at), next(to))
    return "\n".join(
        [
            f'_Static_assert({size} <= KINBOARD_SLOTS && {made.blocks} <= KINBOARD_ROOM, "{made.name}");',
            f"static void call_{made.name}(kinboard_slot *slots, block *room) {{",
            "  (void)slots; (void)room;",
            *before,
            f"  {made.name}({', '.join(passed)});",
            *after,
            "}",
        ]
    )
