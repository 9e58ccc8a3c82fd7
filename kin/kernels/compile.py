"""Compile kernels, and call them without dispatch.

Their machine code is cached on disk (:mod:`kin.kernels.cache`). Where numba lacks what these modules use of it
(:mod:`kin.kernels.private`), kernels are cached and called as numba does by itself.

With NUMBA_DISABLE_JIT=1 kernels are plain Python functions, which is faster for a command that computes one pose.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from typing import Any, TypeVar, cast

from numba import config, njit, types

from kin.kernels.arguments import READABLE, Borrowed
from kin.kernels.cache import KernelCache, numbas_own
from kin.kernels.private import CACHE, CALLS, MISSING

MODEL = "model"
PLAIN = bool(vars(config)["DISABLE_JIT"])
_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


def _compiled(function: _Kernel, kept: bool = True, **options: Any) -> _Kernel:
    if PLAIN:
        return function
    with numbas_own(function) if kept and CACHE in MISSING else nullcontext(False) as cached:
        kernel: Any = njit(**{"nogil": True, "error_model": "numpy", "cache": cached, **options})(function)
    if kept and CACHE not in MISSING:
        kernel._cache = KernelCache(function)
    if CALLS in MISSING:
        return cast(_Kernel, kernel)
    template = kernel.get_call_template

    def plain(arguments: tuple[types.Type, ...], keywords: dict[str, types.Type]) -> Any:
        """Compile a callee once, not again for every constant or borrowed array passed to it."""
        return template(tuple(map(_settled, arguments)), {k: _settled(v) for k, v in keywords.items()})

    kernel.get_call_template = plain
    return cast(_Kernel, kernel)


def jit(function: _Kernel) -> _Kernel:
    """Compile a kernel that releases the GIL, divides as numpy does, and is cached on disk."""
    return _compiled(function)


def brief(function: _Kernel) -> _Kernel:
    """As `jit`, for a kernel of a fraction of a microsecond, which keeps the GIL.

    Releasing and taking it again costs 40 ns, a third of the kinematics of an arm, and more where another thread
    takes it meanwhile; in such a short time that thread could not do anything.
    """
    return _compiled(function, nogil=False)


def inlined(function: _Kernel) -> _Kernel:
    """Compile a kernel that is always inlined, so that loops over calls to it can be vectorised."""
    return _compiled(function, forceinline=True)


def joined(function: _Kernel) -> _Kernel:
    """As `inlined`, for a kernel with kernels as arguments: it is cached only as a part of its callers."""
    return _compiled(function, kept=False, forceinline=True)


def direct(kernel: Any, *arguments: Any) -> Callable[..., Any]:
    """The compiled function of a kernel, called without numba's type dispatch and with borrowed arrays.

    Type dispatch costs as much as a small kernel, and so do numba's own records of array arguments, which
    `kin.kernels.arguments` does without. The kernel must neither keep nor return an array argument.

    Args:
        arguments: for a C-contiguous float64 array (which may be read-only unless the kernel writes to it) its
            number of axes, or its shape, in which None stands for any length. `MODEL` stands for `Robot.model`,
            which is always read-only, so that there is only one type to compile for; `float`, `int` and `bool` for
            a number; `record` for a named tuple and `counted` for an array that are passed as numba does.

    Returns:
        The function. It raises `TypeError` for an array argument that is not as described: callers need not check
        it, and deal with whatever else they accept when that happens.
    """
    wanted = tuple(map(_argument, arguments))
    if PLAIN or CALLS in MISSING:
        return partial(_checked, kernel, wanted)
    passed = wanted if READABLE else tuple(map(_settled, wanted))
    entry: Callable[..., Any] = kernel.compile(passed)
    returned = kernel.overloads[passed].signature.return_type
    if not isinstance(returned, types.Number | types.Boolean | types.NoneType):
        raise TypeError(f"{kernel} returns {returned}, which might be a part of a borrowed array")
    return entry if READABLE else partial(_checked, entry, wanted)


def _checked(kernel: Callable[..., Any], wanted: tuple[Any, ...], *arguments: Any) -> Any:
    """A function called with the checks that compiled code makes of borrowed arrays."""
    for kind, value in zip(wanted, arguments, strict=True):
        if isinstance(kind, Borrowed) and not kind.fits(value):
            raise TypeError(f"{value!r} is not {kind}")
    return kernel(*arguments)


def counted(axes: int) -> Any:
    """The type of an array that is neither borrowed nor checked, for `direct`: that of calls with dispatch."""
    return _type_of(axes)


def row_of(kind: type) -> Any:
    """The type of an array with one axis of `int` or `bool` values, for `record`."""
    return types.Array(_NUMBERS[kind], 1, "C")


def record(cls: type, *fields: Any) -> Any:
    """The type of a named tuple `cls`; its fields are numbers of axes, `MODEL`, types of numbers or `row_of`."""
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


def _argument(argument: Any) -> Any:
    """An argument of `direct` as a type of numba."""
    if isinstance(argument, int) or argument == MODEL:
        return Borrowed((None,) * (1 if argument == MODEL else argument), readonly=argument == MODEL)
    return Borrowed(argument) if isinstance(argument, tuple) else _type_of(argument)


def _settled(kind: Any) -> Any:
    """The type with which a callee is compiled."""
    return kind.owned() if isinstance(kind, Borrowed) else types.unliteral(kind)
