"""Units of C as libraries, whose entries are called with what the kernels are called with."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from emitted import EXACT
from recorded import DTYPES

from kin.codegen.types import BOOL, FLOAT, INT, NONE, WORD, ArrayOf, TupleOf, Type
from kin.codegen.units import Entry, Prototype, translated

STRICT = ("-Wall", "-Wextra", "-Werror")
_NUMBERS = {FLOAT: ctypes.c_double, INT: ctypes.c_int64, BOOL: ctypes.c_bool, WORD: ctypes.c_uint64}
_free = ctypes.CDLL(None).free
_free.argtypes = (ctypes.c_void_p,)


def built(chosen: Iterable[Entry], folder: Path, name: str, level: str) -> list[Any]:
    """A function for each entry, which takes what the kernel takes and returns what it returns."""
    text, prototypes = translated(chosen)
    file, library = folder / f"{name}.c", folder / f"{name}.so"
    file.write_text(text)
    command = ["gcc", "-std=c99", "-shared", "-fPIC", level, *STRICT, *EXACT, file, "-o", library, "-lm"]
    subprocess.run(command, check=True)
    loaded = ctypes.CDLL(str(library))
    return [_Function(loaded, each) for each in prototypes]


class _Function:
    def __init__(self, library: ctypes.CDLL, prototype: Prototype) -> None:
        self.prototype, self.function = prototype, getattr(library, prototype.name)
        self.function.restype = None

    def __call__(self, *arguments: Any) -> Any:
        """The result, arrays as copies."""
        it = self.prototype
        passed = list(_passed(TupleOf(it.entry.kinds), arguments))
        assert sum(map(_width, it.arguments)) == len(passed)
        places = [_places(value.kind) for value in it.results]
        blocks = (ctypes.c_size_t * (2 * it.blocks))()
        self.function(*passed, *(ctypes.byref(p) for each in places for p in each), *([blocks] if blocks else []))
        found = [_value(value.kind, each) for value, each in zip(it.results, places, strict=True)]
        for address in blocks[::2]:
            _free(address)
        return _result(it.result, iter(found))


def _width(value: Any) -> int:
    return 1 + (value.kind.ndim if isinstance(value.kind, ArrayOf) else 0)


def _passed(kind: Type, value: Any) -> Iterator[Any]:
    match kind:
        case TupleOf(items=items):
            for each, item in zip(items, value, strict=True):
                yield from _passed(each, item)
        case ArrayOf(item=item):
            assert value.flags.c_contiguous
            assert value.dtype == DTYPES[item]
            yield from (ctypes.c_void_p(value.ctypes.data), *map(ctypes.c_int64, value.shape))
        case _:
            yield _NUMBERS[kind](value)


def _places(kind: Type) -> list[Any]:
    if isinstance(kind, ArrayOf):
        return [ctypes.c_void_p(), *(ctypes.c_int64() for _ in range(kind.ndim))]
    return [_NUMBERS[kind]()]


def _value(kind: Type, places: list[Any]) -> Any:
    if not isinstance(kind, ArrayOf):
        return places[0].value
    shape, dtype = tuple(each.value for each in places[1:]), np.dtype(DTYPES[kind.item])
    data = ctypes.string_at(places[0].value, int(np.prod(shape)) * dtype.itemsize)
    return np.frombuffer(data, dtype).reshape(shape)


def _result(kind: Type, values: Iterator[Any]) -> Any:
    if isinstance(kind, TupleOf):
        return tuple(_result(each, values) for each in kind.items)
    return None if kind == NONE else next(values)


def same(a: Any, b: Any) -> bool:
    """Whether two results, or two lists of arguments, have the same types and bits; all NaN are one."""
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if a is None or type(a) is not type(b):
        return a is b
    a, b = np.asarray(a), np.asarray(b)
    return (a.shape, a.dtype, _bits(a)) == (b.shape, b.dtype, _bits(b))


def _bits(array: np.ndarray[Any, Any]) -> bytes:
    return (np.where(np.isnan(array), np.nan, array) if array.dtype.kind == "f" else array).tobytes()
