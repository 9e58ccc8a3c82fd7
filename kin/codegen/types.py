"""The types of the subset of Python that kernels are written in."""

from __future__ import annotations

from dataclasses import dataclass
from types import FunctionType
from typing import Any


@dataclass(frozen=True)
class Scalar:
    """A number; `rank` orders what Python promotes: bool → int → float → complex, single → float."""

    name: str
    rank: int


BOOL, INT, FLOAT, COMPLEX = (Scalar(name, k) for k, name in enumerate(("bool", "int", "float", "complex")))
NONE = Scalar("none", -1)
WORD, SINGLE = Scalar("word", 1), Scalar("single", 1)  # 64 bits without a sign, and single precision


@dataclass(frozen=True)
class ArrayOf:
    """A C-contiguous array with a shape that is known when it runs."""

    item: Scalar
    ndim: int


@dataclass(frozen=True)
class TupleOf:
    """A tuple; `names` are the fields of a named tuple."""

    items: tuple[Type, ...]
    names: tuple[str, ...] = ()

    @property
    def alike(self) -> bool:
        """Whether all items have one type, so that an index may be a variable."""
        return len(set(self.items)) == 1


class Constants:
    """What a kernel reads as attributes of an argument: numbers, arrays and kernels that do not change."""

    def __init__(self, **values: Any) -> None:
        vars(self).update(values)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


@dataclass(frozen=True)
class Kernel:
    """A kernel, or constants, passed as an argument: the callee is compiled once for each."""

    value: FunctionType | Constants


Type = Scalar | ArrayOf | TupleOf | Kernel


def widest(*kinds: Type) -> Scalar | None:
    """The number that these are promoted to, None if one of them is none."""
    numbers = [kind for kind in kinds if isinstance(kind, Scalar) and kind != NONE]
    apart = [kind for kind in (WORD, SINGLE) if kind in numbers and set(numbers) - {kind, FLOAT}]
    if len(numbers) < len(kinds) or apart or {WORD, FLOAT} <= set(numbers):
        return None
    return max(numbers, key=lambda kind: kind.rank)


def joined(a: Type, b: Type) -> Type | None:
    """The type of a variable that is assigned both, None if there is none."""
    if a == b:
        return a
    if isinstance(a, TupleOf) and isinstance(b, TupleOf) and len(a.items) == len(b.items):
        items = [joined(x, y) for x, y in zip(a.items, b.items, strict=True)]
        names = a.names if a.names == b.names else ()
        return None if None in items else TupleOf(tuple(kind for kind in items if kind is not None), names)
    return widest(a, b)


def holds_arrays(kind: Type) -> bool:
    """Whether a value of this type shows memory."""
    return isinstance(kind, ArrayOf) or (isinstance(kind, TupleOf) and any(map(holds_arrays, kind.items)))
