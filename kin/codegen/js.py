"""JavaScript: kernels as functions of a script without imports, for a page or for Node.

All arrays are views of one heap of doubles: ``{o, n0, n1, …}``, the place of the first number and the shape. Whole
numbers and truth values are stored as doubles, a complex number as two. A kernel gives back what it took when it
returns, unless it returns a view of it, and an entry gives back everything. Tuples are arrays of JavaScript.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable
from pathlib import Path

from kin.codegen.emit import ATOM, CHOICE, MULTIPLY, UNARY, Emitter, Text
from kin.codegen.source import OutsideSubsetError
from kin.codegen.tree import (
    Call,
    Cast,
    Copy,
    Entry,
    Expr,
    Fill,
    Literal,
    New,
    Operation,
    Primitive,
    Reshaped,
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
    TupleOf,
    Type,
    holds_arrays,
)  # fmt: skip
from kin.codegen.typing import Program

RUNTIME = (Path(__file__).parent / "runtime.js").read_text(encoding="utf-8")
_ZEROS: dict[Type, str] = {INT: "0", FLOAT: "0", BOOL: "false"}
SIZE = 1 << 17  # doubles of the heap
_MATH = {"isnan": "Number.isNaN", "isfinite": "Number.isFinite", "fabs": "Math.abs", "abs": "Math.abs"}
_OF_C = ("fused", "bits_of", "float_of")
_LANGUAGES = frozenset(
    ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "hypot", "atan2", "pow")
)
_TAKEN = (
    "arguments await break case catch class const continue debugger default delete do else enum eval "
    "export extends false finally for function if implements import in instanceof interface let new null "
    "package private protected public return static super switch this throw true try typeof undefined var "
    "void while with yield Math Number Infinity NaN Object mark Array ArrayBuffer Float64Array RangeError "
    "TypeError module window document location "
)
WORDS = frozenset(_TAKEN.split()).union(re.findall(r"(?:function|class|const|let) (\w+)", RUNTIME))


class JavaScript(Emitter):
    """The text of one kernel."""

    equal, different = "===", "!=="

    def function(self) -> str:
        """The definition."""
        it = self.made
        for each in it.nodes:
            if isinstance(each, Expr) and (
                getattr(each.kind, "item", each.kind) in (WORD, SINGLE)
                or (isinstance(each, Primitive) and each.name in _OF_C)
            ):
                what = "bits or single precision, which JavaScript does not have"
                raise OutsideSubsetError(it.function, it.function, what, "use floats")
        self.depth = 0
        self.block(it.body)
        kinds = zip(it.parameters, it.kinds, strict=True)
        names = [self.name(name) for name, kind in kinds if not isinstance(kind, Kernel)]
        free = [n for n in it.variables if n not in it.parameters and n in self.read and n not in self.own]
        zeros = ", ".join(f"{self.name(n)} = {_ZEROS.get(it.variables[n], 'null')}" for n in free)
        lines = [f"  let {zeros};"] if free else []
        if self.releases:
            lines.insert(0, "  const mark = top;")
        if self.releases and it.result == NONE:
            self.lines.append("  top = mark;")
        head = f"function {it.name}({', '.join(names)}) {{"
        return "\n".join([*([f"// {it.note}"] if it.note else []), head, *lines, *self.lines, "}"])

    @property
    def releases(self) -> bool:
        """Whether it gives back what it and its callees took of the heap."""
        made = (New, Copy)
        takes = any(isinstance(e, made) or (isinstance(e, Call) and holds_arrays(e.kind)) for e in self.made.nodes)
        return takes and not holds_arrays(self.made.result)

    def declared(self, kind: Type, name: str, value: str) -> str:
        return f"let {name} = {value}"

    def literal(self, kind: Type, value: float | complex) -> Text:
        if isinstance(value, complex):
            return f"[{value.real!r}, {value.imag!r}]", ATOM
        if kind == BOOL:
            return ("true" if value else "false"), ATOM
        text = "NaN" if math.isnan(value) else repr(value).replace("inf", "Infinity").removesuffix(".0")
        return text, UNARY if text.startswith("-") else ATOM

    def items(self, kind: TupleOf, items: Iterable[str]) -> str:
        return f"[{', '.join(items)}]"

    def item(self, base: str, kind: TupleOf, index: int | str) -> str:
        return f"{base}[{index}]"

    def place(self, array: Expr, kind: ArrayOf, place: str) -> str:
        base = f"{self.text(array, ATOM)}.o"
        if not place:
            return base
        return f"{base} + 2 * ({place})" if kind.item == COMPLEX else f"{base} + {place}"

    def entry(self, array: Expr, kind: ArrayOf, place: str) -> str:
        at = self.place(array, kind, place)
        if kind.item == COMPLEX:
            return f"complex_at({at})"
        return f"(H[{at}] !== 0)" if kind.item == BOOL else f"H[{at}]"

    def length(self, array: Expr, axis: int) -> str:
        return f"{self.text(array, ATOM)}.n{axis}"

    def expr(self, value: Expr) -> Text:
        return (value.name, ATOM) if isinstance(value, Table) else super().expr(value)

    def of(self, kind: Type, place: str, sizes: Iterable[str]) -> str:
        assert isinstance(kind, ArrayOf)
        return f"new A{kind.ndim}({', '.join([place, *sizes])})"

    def view(self, value: View) -> str:
        kind, array = value.array.kind, value.array
        assert isinstance(kind, ArrayOf)
        base = self.place(array, kind, self.offset(array, value.indices))
        sizes = [self.length(array, k) for k in range(len(value.indices), kind.ndim)]
        if value.sliced:
            low = "0" if value.low is None else self.text(value.low)
            high = sizes[0] if value.high is None else self.text(value.high)
            step = " * ".join(
                [f"clamped({low}, {sizes[0]})", *sizes[1:], *(["2"] if kind.item == COMPLEX else [])]
            )
            base = base if low == "0" else f"{base} + {step}"
            sizes[0] = f"span({low}, {high}, {sizes[0]})"
        return self.of(value.kind, base, sizes)

    def new(self, value: New) -> str:
        assert isinstance(value.kind, ArrayOf)
        size = " * ".join(self.text(each, MULTIPLY) for each in value.shape)
        fill = None if value.fill is None else self.text(value.fill)
        if value.kind.item == COMPLEX:
            place = f"alloc(2 * {size})" if fill is None else f"filled_z({size}, {fill})"
        else:
            place = f"alloc({size})" if fill is None else f"filled({size}, {fill})"
        return self.of(value.kind, place, map(self.text, value.shape))

    def copied(self, value: Copy) -> str:
        assert isinstance(value.kind, ArrayOf)
        sizes = [self.length(value.array, k) for k in range(value.kind.ndim)]
        size = " * ".join([*(["2"] if value.kind.item == COMPLEX else []), *sizes])
        return self.of(value.kind, f"moved({self.text(value.array, ATOM)}.o, {size})", sizes)

    def reshaped(self, value: Reshaped) -> str:
        return self.of(value.kind, f"{self.text(value.array, ATOM)}.o", map(self.text, value.shape))

    def operator(self, value: Operation) -> Text:
        symbol = value.symbol
        if symbol == "*":  # a whole number has no negative zero
            return f"times({self.text(value.a)}, {self.text(value.b)})", ATOM
        if symbol in ("//", "%"):
            name = ("floordiv" if symbol == "//" else "mod") + "_whole" * (value.kind == INT)
            return f"{name}({self.text(value.a)}, {self.text(value.b)})", ATOM
        if symbol in ("<<", ">>"):
            name = "shift_left" if symbol == "<<" else "shift_right"
            return f"{name}({self.text(value.a)}, {self.text(value.b)})", ATOM
        if value.kind == BOOL:
            return f"(({self.text(value.a, ATOM)} {symbol} {self.text(value.b, ATOM)}) !== 0)", ATOM
        return f"(bits({self.text(value.a)}) {symbol} bits({self.text(value.b)}))", ATOM

    def primitive(self, value: Primitive, arguments: list[str]) -> str:
        name = value.name
        if name in ("real", "imag"):
            return f"{self.text(value.arguments[0], ATOM)}[{int(name == 'imag')}]"
        if name == "complex":
            return f"[{', '.join(arguments)}]"
        if name == "abs" and value.arguments[0].kind == COMPLEX:
            return f"Math.hypot(...{arguments[0]})"
        name = _MATH.get(name, f"Math.{name}" if name in _LANGUAGES else name)
        return f"{name}({', '.join(arguments)})"

    def cast(self, value: Cast) -> Text:
        if value.kind == COMPLEX:
            return f"[{self.text(value.a)}, 0]", ATOM
        return (f"Number({self.text(value.a)})", ATOM) if value.a.kind == BOOL else self.expr(value.a)

    def called(self, value: Call, arguments: list[str]) -> str:
        return f"{value.callee.name}({', '.join(arguments)})"

    def stored(self, place: Entry, value: Expr) -> str:
        kind = place.array.kind
        assert isinstance(kind, ArrayOf)
        at = self.place(place.array, kind, self.offset(place.array, place.indices))
        return (
            f"put_complex({at}, {self.text(value)});" if kind.item == COMPLEX else f"H[{at}] = {self.text(value)};"
        )

    def filled(self, node: Fill) -> list[str]:
        kind = node.place.kind
        assert isinstance(kind, ArrayOf)
        to, k = self.fresh("to"), self.fresh("at")
        size = " * ".join(f"{to}.n{axis}" for axis in range(kind.ndim))
        number = self.number_at(node.value, k)[0]
        store = (
            f"put_complex({to}.o + 2 * {k}, {number})" if kind.item == COMPLEX else f"H[{to}.o + {k}] = {number}"
        )
        return [f"const {to} = {self.text(node.place)};", f"for (let {k} = 0; {k} < {size}; {k}++) {store};"]

    def returned(self, value: Expr | None) -> list[str]:
        if not self.releases:
            return ["return;" if value is None else f"return {self.text(value)};"]
        if value is None:
            return ["top = mark;", "return;"]
        if isinstance(value, Literal):
            return ["top = mark;", f"return {self.text(value)};"]
        result = self.fresh("result")
        return [f"const {result} = {self.text(value, CHOICE)};", "top = mark;", f"return {result};"]


def unit(program: Program) -> str:
    """All kernels of a program, with what they need."""
    taken = WORDS | {each.name for each in program.instances} | set(program.tables)
    texts = [JavaScript(each, taken).function() for each in program.instances]
    tables = []
    for name, value in program.tables.items():
        numbers, shape = json.dumps(value.ravel().tolist()), ", ".join(map(str, value.shape))
        tables.append(f"const {name} = new A{value.ndim}(constant({numbers}), {shape});")
    return "\n".join([RUNTIME.replace("$SIZE", str(SIZE)), *tables, "", *texts, ""])
