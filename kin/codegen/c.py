"""C99 that is C++ as well: kernels as static functions that need nothing but the mathematical library.

An array is a pointer and its shape, a tuple is a struct; both are passed by value. Every array that a kernel
makes has a place of constant size on the stack or in the user's buffer (:mod:`kin.codegen.rooms`), and one that it
returns has its place with the caller. So there is no heap and no static state but constants.

A Python extension has a heap, for arrays that are large or whose size does not follow. Each place in the source at
which one is made has one block, which is taken again in the next round of a loop, and released on return.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from kin.codegen.emit import ATOM, MULTIPLY, UNARY, Emitter, Text
from kin.codegen.rooms import Rooms, doubles, room_of
from kin.codegen.source import ITEMS, OutsideSubsetError, is_inlined
from kin.codegen.tree import (
    Call,
    Cast,
    Copy,
    Entry,
    Expr,
    Fill,
    If,
    Instance,
    New,
    Operation,
    Primitive,
    Reshaped,
    Statement,
    Table,
    View,
)  # fmt: skip
from kin.codegen.types import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    NONE,
    SINGLE,
    WORD,
    ArrayOf,
    Kernel,
    Scalar,
    TupleOf,
    Type,
)  # fmt: skip
from kin.codegen.typing import Program

RUNTIME = (Path(__file__).parent / "runtime.h").read_text(encoding="utf-8")
HEAP = """\
#include <stdlib.h>
typedef struct { void *p; size_t size; } block; // of all zeros: nothing is taken
#ifndef KINBOARD_NO_MEMORY
#define KINBOARD_NO_MEMORY abort()
#endif
static inline void *taken(block *b, double size) { // of bytes: products of integers might overflow
  if (!(size >= 0.0 && size < 9007199254740992.0)) KINBOARD_NO_MEMORY;
  if (b->p == NULL || b->size < (size_t)size) {
    free(b->p);
    b->size = 0;
    b->p = malloc(size > 0.0 ? (size_t)size : 1);
    if (b->p == NULL) KINBOARD_NO_MEMORY;
    b->size = (size_t)size;
  }
  return b->p;
}
static inline void released(block *b, int count) { for (int k = 0; k < count; k++) free(b[k].p); }
"""
CHECKED = """\
_Noreturn void kinboard_outside(const char *file, int line, int64_t index, int64_t length);
static inline int64_t kinboard_within(int64_t k, int64_t n, const char *file, int line) {
  if (k < 0 || k >= n) kinboard_outside(file, line, k, n);
  return k;
}
static inline int64_t kinboard_same(int64_t size, int64_t n, const char *file, int line) {
  if (size != n) kinboard_outside(file, line, size, n);
  return n;
}
#define WITHIN(k, n) kinboard_within(k, n, __FILE__, __LINE__)
#define SAME(size, n) kinboard_same(size, n, __FILE__, __LINE__)
"""
ON_STACK = 4096  # numbers of an array that is on the stack although there is a heap
LETTERS = {FLOAT: "f", INT: "i", BOOL: "b", COMPLEX: "z", WORD: "w", SINGLE: "s"}
_ZEROS: dict[Type, str] = {FLOAT: "0.0", INT: "0", BOOL: "false", WORD: "0", SINGLE: "0"}
NAMES = {
    FLOAT: "double", INT: "int64_t", BOOL: "bool", COMPLEX: "cplx", WORD: "uint64_t", SINGLE: "float",
    NONE: "void",
}  # fmt: skip
_TAKEN = (
    "auto break case char const continue default do double else enum extern float for goto if inline int "
    "long register restrict return short signed sizeof static struct switch typedef union unsigned void "
    "volatile while bool true false near far huge small y0 y1 yn j0 j1 jn gamma signgam index div and or "
    "not xor class new delete this template typename namespace private public protected operator friend block "
    "using try catch throw asm export linux unix w_t NAN INFINITY "
)
WORDS = frozenset(_TAKEN.split()).union(
    re.findall(r"\b(\w+)\(", RUNTIME + HEAP), (f"{letter}{ndim}" for letter in "fibzws" for ndim in range(1, 5))
)


def mangled(kind: Type) -> str:
    """The name of an array or a tuple, or a letter for a number."""
    match kind:
        case Scalar():
            return LETTERS[kind]
        case ArrayOf(item=item, ndim=ndim):
            return f"{LETTERS[item]}{ndim}"
        case TupleOf(items=items):
            runs = [(each, len(list(group))) for each, group in groupby(map(mangled, items))]
            return "t_" + "_".join(f"{each}x{count}" if count > 1 else each for each, count in runs)
    raise TypeError(kind)


def name_of(kind: Type) -> str:
    """The name of a type."""
    return NAMES[kind] if isinstance(kind, Scalar) else mangled(kind)


class C(Emitter):
    """The text of one kernel.

    Args:
        checked: whether each index is compared with its axis. Lines of the text are then those of the source.
    """

    def __init__(
        self, made: Instance, taken: frozenset[str], rooms: Rooms, kinds: list[Type], checked: bool
    ) -> None:
        super().__init__(made, taken)
        self.rooms, self.kinds, self.checked = rooms, kinds, checked
        self.storage: list[str] = []
        self.releases: list[str] = []
        self.places: dict[int, str] = {}  # of what is made, by the id of the expression
        self.used = 0  # of the room that the caller gives
        self.taken_of_buffer = 0

    def function(self) -> str:
        """The definition."""
        it = self.made
        self.depth = 0
        self.block(it.body)
        if self.releases:  # every return releases all blocks, which are known now
            self.lines.clear()
            self.block(it.body)
            self.lines += ["  " + each for each in self.releases if it.result == NONE]
        passed = [(n, k) for n, k in zip(it.parameters, it.kinds, strict=True) if not isinstance(k, Kernel)]
        names = [f"{name_of(kind)} {self.name(name)}" for name, kind in passed]
        if self.returned_kind is not None:
            names.insert(0, f"{'block' if self.rooms.heap else NAMES[self.returned_kind]} *room")
        if self.rooms.buffer.get(it):
            names.insert(0, "double *memory")
        assert self.taken_of_buffer <= self.rooms.own.get(it, 0)
        lines = [f"  (void){self.name(name)};" for name, _ in passed if name not in self.read]
        for name, kind in it.variables.items():
            if name not in it.parameters and name in self.read and name not in self.own:
                zero = _ZEROS.get(kind, "KINBOARD_ZERO")
                lines.append(f"  {name_of(kind)} {self.name(name)} = {zero};")
        self.kinds += [*it.variables.values(), *it.kinds, it.result]
        self.kinds += [node.kind for node in it.nodes if isinstance(node, Expr)]
        start = "KINBOARD_INLINE" if is_inlined(it.function) else "static"
        head = f"{start} {name_of(it.result)} {it.name}({', '.join(names) or 'void'}) {{"
        return "\n".join([*([f"// {it.note}"] if it.note else []), head, *self.storage, *lines, *self.lines, "}"])

    @property
    def returned_kind(self) -> Scalar | None:
        """Of what the arrays are that it makes and returns; None if it returns none that it made."""
        return room_of(self.made)

    def declared(self, kind: Type, name: str, value: str) -> str:
        return f"{name_of(kind)} {name} = {value}"

    def literal(self, kind: Type, value: float | complex) -> Text:
        if isinstance(value, complex):
            return f"cplx_of({value.real!r}, {value.imag!r})", ATOM
        if kind == BOOL:
            return ("true" if value else "false"), ATOM
        if kind == WORD:
            return f"{value}u", ATOM
        text = "NAN" if math.isnan(value) else repr(value).replace("inf", "INFINITY")
        return text, UNARY if text.startswith("-") else ATOM

    def items(self, kind: TupleOf, items: Iterable[str]) -> str:
        return f"{mangled(kind)}_of({', '.join(items)})"

    def item(self, base: str, kind: TupleOf, index: int | str) -> str:
        if self.checked and isinstance(index, str):
            index = f"WITHIN({index}, {len(kind.items)})"
        return f"{base}.v[{index}]" if kind.alike else f"{base}._{index}"

    def entry(self, array: Expr, kind: ArrayOf, place: str) -> str:
        if isinstance(array, Table):
            return f"{array.name}[{place or 0}]"
        return f"{self.text(array, ATOM)}.p[{place or 0}]"

    def length(self, array: Expr, axis: int) -> str:
        return f"{self.text(array, ATOM)}.n{axis}"

    def size(self, array: Expr) -> str:
        assert isinstance(array.kind, ArrayOf)
        return " * ".join(self.length(array, k) for k in range(array.kind.ndim))

    def of(self, kind: Type, place: str, sizes: Iterable[str]) -> str:
        return f"{mangled(kind)}_of({', '.join([place, *sizes])})"

    def view(self, value: View) -> str:
        kind, array = value.array.kind, value.array
        assert isinstance(kind, ArrayOf)
        first = len(value.indices)
        base = " + ".join(filter(None, [f"{self.text(array, ATOM)}.p", self.offset(array, value.indices)]))
        sizes = [self.length(array, k) for k in range(first, kind.ndim)]
        if value.sliced:
            low = "0" if value.low is None else self.text(value.low)
            high = sizes[0] if value.high is None else self.text(value.high)
            step = " * ".join([f"clamped({low}, {sizes[0]})", *sizes[1:]])
            base = base if low == "0" else f"{base} + {step}"
            sizes[0] = f"span({low}, {high}, {sizes[0]})"
        return self.of(value.kind, base, sizes)

    def statement(self, node: Statement) -> None:
        self.mark(node)
        super().statement(node)

    def choice(self, node: If, word: str) -> None:
        self.mark(node)
        super().choice(node, word)

    def mark(self, node: Statement) -> None:
        """Say where a statement is in the source."""
        if self.checked:
            function = self.made.function
            line = function.__code__.co_firstlineno + getattr(node.node, "lineno", 1) - 1
            self.lines.append(f'#line {line} "{function.__module__.replace(".", "/")}.py"')

    def offset(self, array: Expr, indices: tuple[Expr, ...]) -> str:
        if not self.checked:
            return super().offset(array, indices)
        assert isinstance(array.kind, ArrayOf)
        lengths, terms = [self.length(array, k) for k in range(array.kind.ndim)], []
        for axis, index in enumerate(indices):
            inside = f"WITHIN({self.text(index)}, {lengths[axis]})"
            terms.append(" * ".join([inside, *lengths[axis + 1 :]]))
        return " + ".join(terms)

    def number_at(self, value: Expr, k: str) -> Text:
        if self.checked and isinstance(value.kind, ArrayOf) and not isinstance(value, Operation):
            k = f"WITHIN({k}, {self.size(value)})"
        return super().number_at(value, k)

    def expr(self, value: Expr) -> Text:
        if isinstance(value, Table):  # as an array: where it is passed on
            shape = map(str, self.shapes[value.name])
            assert isinstance(value.kind, ArrayOf)
            return self.of(value.kind, f"({NAMES[value.kind.item]} *){value.name}", shape), ATOM
        return super().expr(value)

    shapes: dict[str, tuple[int, ...]]

    def place(self, node: Expr, size: int, item: Scalar, heap: bool) -> str:
        """The place of what an expression makes: in this kernel, or with the caller if it may be returned."""
        if id(node) in self.places:
            return self.places[id(node)]
        if self.returned_kind is None:
            place, kind = self.fresh("room"), NAMES[item]
            start = f"block {place}[{size}] = {{{{0}}}}" if heap else f"{kind} {place}[{size}]"
            if self.rooms.in_buffer(item, size):  # its words hold numbers of any type
                start = f"{kind} *{place} = ({kind} *)(memory + {self.taken_of_buffer})"
                self.taken_of_buffer += doubles(item, size)
            self.storage.append(f"  {start};")
            self.releases += [f"released({place}, {size});"] if heap else []
        else:
            if not heap and item != self.returned_kind:
                what = "a kernel that returns arrays and makes some of another type"
                raise OutsideSubsetError(self.made.function, self.made.function, what, "let the caller make them")
            place = f"room + {self.used}" if self.used else "room"
            self.used += size
        self.places[id(node)] = place
        return place

    def room(self, node: New | Copy, item: Scalar, bytes_: str) -> str:
        """The place of an array that is made, which takes so many bytes."""
        size = self.rooms.sizes[id(node)]
        heap = self.rooms.heap and (size > ON_STACK or self.returned_kind is not None)
        place = self.place(node, 1 if heap else size, item, heap)
        return f"({NAMES[item]} *)taken({place}, {bytes_})" if heap else place

    def new(self, value: New) -> str:
        assert isinstance(value.kind, ArrayOf)
        item, sizes = value.kind.item, [self.text(each, MULTIPLY) for each in value.shape]
        count = " * ".join(sizes)
        place = self.room(value, item, " * ".join([f"sizeof({NAMES[item]})", *(f"(double)({n})" for n in sizes)]))
        if value.fill is not None:
            place = f"filled_{LETTERS[item]}({place}, {count}, {self.text(value.fill)})"
        return self.of(value.kind, place, map(self.text, value.shape))

    def copied(self, value: Copy) -> str:
        assert isinstance(value.kind, ArrayOf)
        item, array = value.kind.item, self.text(value.array, ATOM)
        sizes = [self.length(value.array, k) for k in range(value.kind.ndim)]
        size = f"sizeof({NAMES[item]}) * (size_t)({' * '.join(sizes)})"
        place = self.room(value, item, f"(double)({size})")
        return self.of(value.kind, f"({NAMES[item]} *)copied({place}, {array}.p, {size})", sizes)

    def reshaped(self, value: Reshaped) -> str:
        text = self.of(value.kind, f"{self.text(value.array, ATOM)}.p", map(self.text, value.shape))
        if not self.checked:
            return text
        count = " * ".join(self.text(each, MULTIPLY) for each in value.shape)
        return f"(SAME({count}, {self.size(value.array)}), {text})"

    def operator(self, value: Operation) -> Text:
        symbol = value.symbol
        if symbol == "*":
            return f"{self.text(value.a, MULTIPLY)} * {self.text(value.b, UNARY)}", MULTIPLY
        if symbol in ("//", "%", "<<"):
            name = {"//": "floordiv", "%": "mod", "<<": "shift_left"}[symbol]
            name += "_whole" * (value.kind == INT and symbol != "<<")
            return f"{name}({self.text(value.a)}, {self.text(value.b)})", ATOM
        text = f"{self.text(value.a, ATOM)} {symbol} {self.text(value.b, ATOM)}"
        return (f"(({text}) != 0)", ATOM) if value.kind == BOOL else (f"({text})", ATOM)

    def primitive(self, value: Primitive, arguments: list[str]) -> str:
        name, kind = value.name, value.kind
        if name in ("real", "imag"):
            return f"{arguments[0]}.{name[:2]}"
        if name == "complex":
            return f"cplx_of({', '.join(arguments)})"
        if name == "abs":
            inner = value.arguments[0]
            if inner.kind == COMPLEX:
                return f"hypot({self.text(inner, ATOM)}.re, {self.text(inner, ATOM)}.im)"
            return f"{'fabs' if kind == FLOAT else 'abs_whole'}({arguments[0]})"
        if name in ("least", "most"):
            name += "_whole" * (kind == INT)
        return f"{name}({', '.join(arguments)})"

    def cast(self, value: Cast) -> Text:
        if value.kind == COMPLEX:
            return f"cplx_of({self.text(value.a)}, 0.0)", ATOM
        return f"({name_of(value.kind)}){self.text(value.a, UNARY)}", UNARY

    def called(self, value: Call, arguments: list[str]) -> str:
        if (kind := room_of(value.callee)) is not None:
            size = self.rooms.of_result(value.callee)
            arguments = [self.place(value, size, kind, self.rooms.heap), *arguments]
        if self.rooms.buffer.get(value.callee):
            arguments = [f"memory + {self.rooms.own[self.made]}", *arguments]
        return f"{value.callee.name}({', '.join(arguments)})"

    def stored(self, place: Entry, value: Expr) -> str:
        return f"{self.text(place)} = {self.text(value)};"

    def filled(self, node: Fill) -> list[str]:
        kind = node.place.kind
        assert isinstance(kind, ArrayOf)
        to, k = self.fresh("to"), self.fresh("at")
        size = " * ".join(f"{to}.n{axis}" for axis in range(kind.ndim))
        loop = f"for (int64_t {k} = 0; {k} < {size}; {k}++)"
        number = self.number_at(node.value, k)[0]
        return [f"{{ {mangled(kind)} {to} = {self.text(node.place)}; {loop} {to}.p[{k}] = {number}; }}"]

    def returned(self, value: Expr | None) -> list[str]:
        if value is None:
            return [*self.releases, "return;"]
        if not self.releases:
            return [f"return {self.text(value)};"]
        result = self.fresh("result")
        return [
            f"{name_of(self.made.result)} {result} = {self.text(value)};",
            *self.releases,
            f"return {result};",
        ]


def _definitions(kinds: Iterable[Type]) -> list[str]:
    """Structs of arrays and tuples, and functions that make them; those first that others hold."""
    found: dict[str, str] = {}

    def define(kind: Type) -> None:
        if isinstance(kind, Scalar | Kernel) or mangled(kind) in found:
            return
        name = mangled(kind)
        if isinstance(kind, ArrayOf):
            item, sizes = NAMES[kind.item], [f"n{k}" for k in range(kind.ndim)]
            fields = f"{item} *p; int64_t {', '.join(sizes)};"
            given = ", ".join([f"{item} *p", *(f"int64_t {size}" for size in sizes)])
            puts = " ".join(f"x.{each} = {each};" for each in ("p", *sizes))
        else:
            for item_kind in kind.items:
                define(item_kind)
            names, count = [name_of(each) for each in kind.items], len(kind.items)
            fields = " ".join(f"{each} _{k};" for k, each in enumerate(names))
            if kind.alike:
                fields = f"{names[0]} v[{count}];"
            given = ", ".join(f"{each} a{k}" for k, each in enumerate(names))
            puts = " ".join(f"x.{f'v[{k}]' if kind.alike else f'_{k}'} = a{k};" for k in range(count))
        head = f"typedef struct {{ {fields} }} {name};"
        found[name] = f"{head}\nKINBOARD_INLINE {name} {name}_of({given}) {{ {name} x; {puts} return x; }}"

    for kind in kinds:
        define(kind)
    return list(found.values())


def unit(program: Program, rooms: Rooms, checked: bool = False) -> str:
    """All kernels of a program as static functions, with what they need; checked: see `C`."""
    kinds: list[Type] = [ArrayOf(FLOAT, 1), ArrayOf(FLOAT, 2), ArrayOf(INT, 1), TupleOf((FLOAT, FLOAT))]
    names = {each.name for each in program.instances} | set(program.tables)
    C.shapes = {name: value.shape for name, value in program.tables.items()}
    taken = WORDS | names | {"memory", "room"}
    texts = [C(each, taken, rooms, kinds, checked).function() for each in program.instances]
    tables = []
    for name, value in program.tables.items():
        numbers = ", ".join(map(repr, value.ravel().tolist()))
        item = NAMES[ITEMS[value.dtype.type]]
        tables.append(f"static const {item} {name}[{value.size}] = {{{numbers}}};")
    more = [
        "KINBOARD_INLINE t_fx2 sin_cos(double x) {",
        "  double s, c;",
        "  sine_cosine_to(x, &s, &c);",
        "  return t_fx2_of(s, c);",
        "}",
        "static inline bool all_finite(f1 a) {",
        "  for (int64_t k = 0; k < a.n0; k++) if (!isfinite(a.p[k])) return false;",
        "  return true;",
        "}",
        "static inline i1 counted(i1 a) { for (int64_t k = 0; k < a.n0; k++) a.p[k] = k; return a; }",
    ]
    heap = [HEAP] if rooms.heap else []
    heap += [CHECKED] if checked else []
    return "\n".join([RUNTIME, *heap, *_definitions(dict.fromkeys(kinds)), *more, *tables, "", *texts, ""])
