"""How large every array of a program is at most, and where it is in C: no buffer can overflow.

The arrays that an entry is called with have known shapes. From them follow the shapes of all views and the numbers
in all shapes, kernel by kernel: upper bounds, since a slice may show less. An array whose size does not follow is
refused, or is on the heap.

Small arrays are on the stack. Without a heap, large ones are in a buffer that the caller gives, since the stack of
a microcontroller or of a thread might be too small: those of a kernel first, those of what it calls behind them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import starmap
from typing import Any

from kin.codegen.source import OutsideSubsetError
from kin.codegen.tree import (
    Assign,
    Call,
    Cast,
    Choice,
    Copy,
    Expr,
    For,
    Instance,
    Item,
    Items,
    Length,
    Literal,
    New,
    Operation,
    Primitive,
    Reshaped,
    Return,
    Variable,
    View,
)  # fmt: skip
from kin.codegen.types import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    SINGLE,
    WORD,
    ArrayOf,
    Scalar,
    TupleOf,
    Type,
    holds_arrays,
)  # fmt: skip
from kin.codegen.typing import Program

# Of a whole number its largest value, of an array and of a tuple those of its axes and items; None: not known.
Bound = Any
_PASSES = 6
UNKNOWN = 1 << 62  # more than any size
_BYTES = {FLOAT: 8, INT: 8, WORD: 8, COMPLEX: 16, SINGLE: 4, BOOL: 1}
_LARGE, _SMALL = 64, 512  # doubles: of an array on the stack, and of all arrays that need no buffer, at most


class Rooms:
    """The numbers of entries of all arrays that kernels make, found by following the entries' calls.

    Args:
        known: bounds of variables that do not follow, by the names of kernel and variable.
        heap: whether there is a heap, for arrays whose size does not follow and for those that kernels return.

    Attributes:
        own: how many doubles of the caller's buffer a kernel's own arrays take; empty without a buffer.
        buffer: the same with those of all that it calls.
    """

    def __init__(self, known: Mapping[tuple[str, str], int], heap: bool = False) -> None:
        self.known, self.heap = known, heap
        self.sizes: dict[int, int] = {}  # by the id of a `New` or `Copy`
        self.own: dict[Instance, int] = {}
        self.buffer: dict[Instance, int] = {}
        self._results: dict[tuple[Instance, Bound], Bound] = {}

    def enter(self, made: Instance, arguments: Sequence[Bound]) -> Bound:
        """Follow a call; the bound of its result."""
        key = made, tuple(arguments)
        if key not in self._results:
            self._results[key] = _Following(self, made, key[1]).run()
        return self._results[key]

    def of_result(self, made: Instance) -> int:
        """How many entries the arrays have that a kernel makes and returns, with those of what it calls.

        With a heap, how many arrays.
        """
        sites = [e for e in made.nodes if isinstance(e, New | Copy)]
        calls = [e for e in made.nodes if isinstance(e, Call) and holds_arrays(e.kind)]
        own = len(sites) if self.heap else sum(self.sizes[id(e)] for e in sites)
        return own + sum(self.of_result(e.callee) for e in calls)

    def share_buffer(self, program: Program) -> None:
        """Put large arrays into a buffer, unless they are few; those of two callees are in the same place."""
        own: dict[Instance, int] = {}
        buffer: dict[Instance, int] = {}
        for made in program.instances:  # callees first
            own[made] = sum(size for size in starmap(doubles, self._places(made)) if size > _LARGE)
            calls = [e.callee for e in made.nodes if isinstance(e, Call)]
            buffer[made] = own[made] + max((buffer[callee] for callee in calls), default=0)
        if max(buffer.values()) > _SMALL:
            self.own, self.buffer = own, buffer

    def in_buffer(self, item: Scalar, count: int) -> bool:
        """Whether an array of so many entries is in the caller's buffer."""
        return bool(self.buffer) and doubles(item, count) > _LARGE

    def _places(self, made: Instance) -> Iterator[tuple[Scalar, int]]:
        """Types and numbers of entries of the arrays that a kernel keeps."""
        if room_of(made) is not None:
            return
        for node in made.nodes:
            if isinstance(node, New | Copy):
                assert isinstance(node.kind, ArrayOf)
                yield node.kind.item, self.sizes[id(node)]
            elif isinstance(node, Call) and (item := room_of(node.callee)) is not None:
                yield item, self.of_result(node.callee)


def doubles(item: Scalar, count: int) -> int:
    """How many doubles an array of so many entries takes."""
    return math.ceil(_BYTES[item] * count / 8)


def room_of(made: Instance) -> Scalar | None:
    """Of what the arrays are that a kernel makes and returns; None if it returns none."""
    if not holds_arrays(made.result):
        return None
    for each in made.nodes:
        if isinstance(each, New | Copy) and isinstance(each.kind, ArrayOf):
            return each.kind.item
        if isinstance(each, Call) and (kind := room_of(each.callee)) is not None:
            return kind
    return None


class _Following:
    """One kernel, called with arguments of these bounds."""

    def __init__(self, rooms: Rooms, made: Instance, arguments: Sequence[Bound]) -> None:
        self.rooms, self.made = rooms, made
        self.bounds: dict[str, Bound] = {}
        for name, bound in zip(made.parameters, arguments, strict=True):
            self._note(name, bound)

    def run(self) -> Bound:
        for settling in range(_PASSES):
            before = dict(self.bounds)
            for node in self.made.nodes:
                if isinstance(node, Assign):
                    self._note(node.name, self.of(node.value))
                elif isinstance(node, For):
                    self._note(node.name, self.of(node.end if node.step > 0 else node.start))
            if self.bounds == before:
                break
            if settling > 2:  # what still grows has no bound
                self.bounds |= {k: unknown(self.made.variables[k]) for k in before if before[k] != self.bounds[k]}
        result = None
        for node in self.made.nodes:
            if isinstance(node, New | Copy):
                self._measure(node)
            elif isinstance(node, Call):
                self.of(node)
            elif isinstance(node, Return) and node.value is not None:
                bound = self.of(node.value)
                result = bound if result is None else _largest(result, bound)
        return result

    def _note(self, name: str, bound: Bound) -> None:
        bound = self.rooms.known.get((self.made.name, name), bound)
        self.bounds[name] = bound if name not in self.bounds else _largest(self.bounds[name], bound)

    def _measure(self, node: New | Copy) -> None:
        shape = self.of(node)
        if None in shape and self.rooms.heap:
            self.rooms.sizes[id(node)] = UNKNOWN
            return
        if None in shape:
            what = "an array whose size does not follow from the arguments"
            raise OutsideSubsetError(self.made.function, self.made.function, what, "give it a constant shape")
        self.rooms.sizes[id(node)] = max(math.prod(shape), 1, self.rooms.sizes.get(id(node), 0))

    def of(self, value: Expr) -> Bound:
        """The bound of an expression."""
        match value:
            case Literal(value=number):
                return number if isinstance(number, int) else None
            case Variable(kind=kind, name=name):
                return self.bounds.get(name, unknown(kind))
            case Length(array=array, axis=axis):
                return self.of(array)[axis]
            case Items(items=items):
                return tuple(map(self.of, items))
            case Item(base=base, index=int(k)):
                return self.of(base)[k]
            case View(array=array, indices=indices):
                return self.of(array)[len(indices) :]
            case New(shape=shape) | Reshaped(shape=shape):
                return tuple(map(self.of, shape))
            case Copy(array=inner) | Cast(a=inner) | Primitive(name="counted", arguments=(inner,)):
                return self.of(inner)
            case Choice(a=a, b=b):
                return _largest(self.of(a), self.of(b))
            case Call(callee=callee, arguments=arguments):
                return self.rooms.enter(callee, tuple(map(self.of, arguments)))
            case Primitive(name="least", arguments=(a, b)):
                known = [x for x in (self.of(a), self.of(b)) if x is not None]
                return min(known, default=None)
            case Operation(kind=kind, symbol=symbol, a=a, b=b) if kind == INT:
                return _computed(symbol, self.of(a), self.of(b), b)
        return unknown(value.kind)


def _computed(symbol: str, a: Bound, b: Bound, second: Expr) -> Bound:
    if a is None or b is None:
        return None
    if symbol == "-" and isinstance(second, Literal):
        return a - b
    compute: Callable[[int, int], int] | None = {"+": int.__add__, "*": int.__mul__}.get(symbol)
    return None if compute is None else compute(a, b)


def _largest(a: Bound, b: Bound) -> Bound:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return tuple(map(_largest, a, b))
    return None if a is None or b is None else max(a, b)


def unknown(kind: Type) -> Bound:
    """The bound of a value that nothing is known of."""
    if isinstance(kind, ArrayOf):
        return (None,) * kind.ndim
    return tuple(map(unknown, kind.items)) if isinstance(kind, TupleOf) else None
