"""C of the kernels that Python calls, for an extension: units of translation, and prototypes of their functions.

An *entry* is a kernel that Python calls, with the types of its arguments; other kernels are reached from entries.
All of them are in ``entries.txt``, a line each: its name, and the types as C names them, an array of floats with
two axes ``f2``, a named tuple with its class, ``kin.workspace.search.nearest.Cells(f2,f1,f3)``. Behind a type is
what a kernel relies on without looking, the lengths ``[n,4]`` and the range of values ``{-1:n}``, see
:mod:`kin.codegen.extension.wanted`.

A unit has the entries of one folder and all that they reach, so that few units change with a kernel.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from kin.codegen import c
from kin.codegen.rooms import Rooms, room_of, unknown
from kin.codegen.source import decorators
from kin.codegen.tree import Instance
from kin.codegen.types import NONE, ArrayOf, Scalar, TupleOf, Type
from kin.codegen.typing import Program
from kin.kernels.compile import jit_with_gil

ENTRIES = Path(__file__).parent / "entries.txt"
_TOKEN = re.compile(r"([\w.]*\()|([fibzws])(\d?)((?:\[[^\]]*\])?(?:\{[^}]*\})?)|\)")
_LETTERS = {letter: kind for kind, letter in c.LETTERS.items()}


@dataclass(frozen=True)
class Entry:
    """A kernel that Python calls, and the types of its arguments.

    Attributes:
        wanted: of each number and each array, items of tuples one by one, what is behind its type.
    """

    kernel: Any
    kinds: tuple[Type, ...]
    wanted: tuple[str, ...] = ()


@dataclass(frozen=True)
class Value:
    """A number or an array that an entry takes or returns.

    Attributes:
        kind: its type: of an array, which is C-contiguous, that of its numbers and how many axes it has.
        written: whether the entry may write to it.
    """

    kind: Scalar | ArrayOf
    written: bool = False


@dataclass(frozen=True)
class Prototype:
    """How an entry is called in C.

    The function returns nothing. Its parameters are the arguments in their order, items of tuples one by one: a
    number by its value, an array as its address and the lengths of its axes. Then where the
    results go, items of a tuple one by one: the address of a number; of an array those of its address and of the
    lengths of its axes. Where arrays are returned, the last parameter is an array of `blocks` blocks (`c.HEAP`),
    all zero before the call. Its memory is what is returned, unless that is part of an argument, and the caller
    has to copy it before ``released(room, blocks)``.

    Attributes:
        entry: what it is.
        name: its name in C.
        arguments, results: values in the order of the parameters.
        result: the type that Python is returned.
        blocks: how many blocks the caller has, 0 if no array is returned.
        brief: whether it takes so little time that it keeps the GIL.
    """

    entry: Entry
    name: str
    arguments: tuple[Value, ...]
    results: tuple[Value, ...]
    result: Type
    blocks: int
    brief: bool


def units() -> dict[str, list[str]]:
    """The lines of ``entries.txt`` by the unit that they belong to: a folder of solvers, or of the core."""
    found: dict[str, list[str]] = {}
    for line in ENTRIES.read_text(encoding="utf-8").splitlines():
        _, *words = line.split(" ")[0].split(".")
        found.setdefault("_".join(words[: 2 if words[0] == "solvers" else 1]), []).append(line)
    return found


def entry_of(line: str) -> Entry:
    """An entry from its line."""
    name, _, text = line.partition(" ")
    tokens, wanted = _TOKEN.finditer(text), list[str]()

    def kinds() -> Iterator[Type]:
        for token in tokens:
            opened, letter, axes, demand = token.groups()
            if opened:
                names = () if opened == "(" else _found(opened[:-1])._fields
                yield TupleOf(tuple(kinds()), names)
            elif letter:
                wanted.append(demand)
                yield ArrayOf(_LETTERS[letter], int(axes)) if axes else _LETTERS[letter]
            else:
                return

    return Entry(_found(name), tuple(kinds()), tuple(wanted))


def _found(name: str) -> Any:
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(module), attribute)


def translated(chosen: Iterable[Entry], checked: bool = False) -> tuple[str, list[Prototype]]:
    """C of one unit, and how its entries are called.

    All but the functions of the entries are static. The text needs nothing but the mathematical library.

    Args:
        checked: whether each index is compared with its axis; one outside is reported to `kinboard_outside`.

    Raises:
        OutsideSubsetError: a construct that no C is written of.
    """
    program, rooms, made = Program(), Rooms({}, heap=True), list[tuple[Entry, Instance]]()
    for entry in chosen:
        instance = program.add(entry.kernel, *entry.kinds)
        rooms.enter(instance, tuple(map(unknown, entry.kinds)))
        made.append((entry, instance))
    text, names, found, functions = c.unit(program, rooms, checked), set[str](), list[Prototype](), list[str]()
    for entry, instance in made:
        stem = f"{instance.function.__module__}.{instance.function.__name__}".replace(".", "_")
        name = next(n for k in range(1, 99) if (n := stem if k == 1 else f"{stem}_{k}") not in names)
        names.add(name)
        found.append(_prototype(entry, instance, name, rooms))
        functions.append(_function(found[-1], instance))
    return "\n".join([text, *functions]), found


def _values(kind: Type, path: tuple[Any, ...], written: frozenset[tuple[Any, ...]]) -> Iterator[Value]:
    """The numbers and arrays in a value."""
    if isinstance(kind, TupleOf):
        for k, each in enumerate(kind.items):
            yield from _values(each, (*path, k), written)
    elif isinstance(kind, ArrayOf) or (isinstance(kind, Scalar) and kind != NONE):
        yield Value(kind, path in written)


def _prototype(entry: Entry, made: Instance, name: str, rooms: Rooms) -> Prototype:
    arguments = tuple(
        value
        for parameter, kind in zip(made.parameters, made.kinds, strict=True)
        for value in _values(kind, (parameter,), made.written)
    )
    results = tuple(_values(made.result, (), frozenset()))
    blocks = 0 if room_of(made) is None else rooms.of_result(made)
    keeps = jit_with_gil.__name__ in decorators(made.function)
    return Prototype(entry, name, arguments, results, made.result, blocks, keeps)


def _parameters(kind: Scalar | ArrayOf, name: str, by: str) -> list[str]:
    if isinstance(kind, Scalar):
        return [f"{c.NAMES[kind]} {by}{name}"]
    return [f"{c.NAMES[kind.item]} *{by}{name}", *(f"int64_t {by}{name}_{axis}" for axis in range(kind.ndim))]


def _function(prototype: Prototype, made: Instance) -> str:
    """The function of an entry, which makes structs of its arguments, and the reverse."""
    parameters = [p for k, value in enumerate(prototype.arguments) for p in _parameters(value.kind, f"a{k}", "")]
    parameters += [p for k, value in enumerate(prototype.results) for p in _parameters(value.kind, f"r{k}", "*")]
    parameters += ["block *room"] * (prototype.blocks > 0)
    names = (f"a{k}" for k in range(len(prototype.arguments)))
    passed = ["room"] * (prototype.blocks > 0) + [_struct(kind, names) for kind in made.kinds]
    body = f"{made.name}({', '.join(passed)});"
    if made.result != NONE:
        names = (f"r{k}" for k in range(len(prototype.results)))
        body = f"{c.name_of(made.result)} x = {body} {' '.join(_puts(made.result, 'x', names))}"
    return f"void {prototype.name}({', '.join(parameters) or 'void'}) {{ {body} }}"


def _struct(kind: Type, names: Iterator[str]) -> str:
    """An argument in C of the parameters with these names."""
    if isinstance(kind, TupleOf):
        return f"{c.mangled(kind)}_of({', '.join(_struct(each, names) for each in kind.items)})"
    name = next(names)
    if isinstance(kind, ArrayOf):
        return f"{c.mangled(kind)}_of({', '.join([name, *(f'{name}_{axis}' for axis in range(kind.ndim))])})"
    return name


def _puts(kind: Type, value: str, names: Iterator[str]) -> Iterator[str]:
    """Statements that put a value where the parameters with these names say."""
    if isinstance(kind, TupleOf):
        for k, each in enumerate(kind.items):
            yield from _puts(each, f"{value}.v[{k}]" if kind.alike else f"{value}._{k}", names)
        return
    name = next(names)
    if isinstance(kind, ArrayOf):
        yield f"*{name} = {value}.p;"
        yield from (f"*{name}_{axis} = {value}.n{axis};" for axis in range(kind.ndim))
    else:
        yield f"*{name} = {value};"
