"""Compile kernels, and call them without dispatch.

Their machine code is cached on disk (:mod:`kin.kernels.cache`).

With NUMBA_DISABLE_JIT=1 kernels are plain Python functions, which is faster for a command that computes one pose.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import config, njit, types

from kin.kernels.cache import LaterCache

MODEL = "model"
PLAIN = bool(vars(config)["DISABLE_JIT"])
_unliteral: Any = types.unliteral
_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


def _compiled(function: _Kernel, kept: bool = True, **options: Any) -> _Kernel:
    if PLAIN:
        return function
    kernel: Any = njit(nogil=True, error_model="numpy", **options)(function)
    if kept:
        kernel._cache = LaterCache(function)
    template = kernel.get_call_template

    def plain(arguments: tuple[types.Type, ...], keywords: dict[str, types.Type]) -> Any:
        """Compile a callee once, not again for every constant passed to it."""
        return template(tuple(map(_unliteral, arguments)), {k: _unliteral(v) for k, v in keywords.items()})

    kernel.get_call_template = plain
    return cast(_Kernel, kernel)


def jit(function: _Kernel) -> _Kernel:
    """Compile a kernel that releases the GIL, divides as numpy does, and is cached on disk."""
    return _compiled(function)


def inlined(function: _Kernel) -> _Kernel:
    """Compile a kernel that is always inlined, so that loops over calls to it can be vectorised."""
    return _compiled(function, forceinline=True)


def joined(function: _Kernel) -> _Kernel:
    """As `inlined`, for a kernel with kernels as arguments: it is cached only as a part of its callers."""
    return _compiled(function, kept=False, forceinline=True)


def direct(kernel: Any, *arguments: Any) -> Callable[..., Any]:
    """The compiled function of a kernel, called without numba's type dispatch.

    Type dispatch costs as much as a small kernel. Arguments are not checked. The caller ensures that each array is
    C-contiguous float64 with the number of axes given in `arguments` (it may be read-only unless the kernel writes
    to it). `float`, `int` and `bool` stand for a number, `MODEL` for `Robot.model`, which is always read-only, so
    that there is only one type to compile for; `row_of` makes arrays of other numbers, `record` named tuples.
    """
    if PLAIN:
        return cast(Callable[..., Any], kernel)
    entry: Callable[..., Any] = kernel.compile(tuple(map(_type_of, arguments)))
    return entry


def row_of(kind: type) -> Any:
    """The type of an array with one axis of `int` or `bool` values, for `direct`."""
    return types.Array(_NUMBERS[kind], 1, "C")


def record(cls: type, *fields: Any) -> Any:
    """The type of a named tuple `cls` whose fields are described as the arguments of `direct` are."""
    return types.NamedTuple(tuple(map(_type_of, fields)), cls)


_NUMBERS: dict[type, Any] = {float: types.float64, int: types.int64, bool: types.boolean}


def _type_of(argument: Any) -> Any:
    if isinstance(argument, types.Type):
        return argument
    if argument == MODEL:
        return types.Array(types.float64, 1, "C", readonly=True)
    if isinstance(argument, type):
        return _NUMBERS[argument]
    return types.Array(types.float64, argument, "C")
