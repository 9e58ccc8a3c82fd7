"""Compile kernels, and call them without dispatch.

What a kernel is follows from KINBOARD_KERNELS (:mod:`kin.kernels.ahead`). The machine code of numba is cached on
disk (:mod:`kin.kernels.cache`). Where numba lacks what these modules use of it (:mod:`kin.kernels.private`),
kernels are cached and called as numba does by itself.

With KINBOARD_KERNELS=python, or NUMBA_DISABLE_JIT=1, kernels are plain Python functions, which is faster for a
command that computes one pose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import nullcontext
from typing import Any, NamedTuple, TypeVar, cast

from kin.kernels import ahead
from kin.kernels.ahead import CHOSEN, NUMBA, PYTHON, C, Wanted

if CHOSEN == NUMBA:
    from numba import config, njit, types

    from kin.kernels import cache
    from kin.kernels.arguments import READABLE, Borrowed
    from kin.kernels.cache import KernelCache, numbas_own
    from kin.kernels.private import CACHE, CALLS, MISSING

MODEL = "model"
PLAIN = CHOSEN == PYTHON or (CHOSEN == NUMBA and bool(vars(config)["DISABLE_JIT"]))
_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


class Record(NamedTuple):
    """A named tuple as an argument of `direct`."""

    cls: type
    fields: tuple[Any, ...]


def _compiled(function: _Kernel, kept: bool = True, **options: Any) -> _Kernel:
    if CHOSEN == C:
        return cast(_Kernel, ahead.Kernel(function))
    if PLAIN:
        return function
    with numbas_own(function) if kept and CACHE in MISSING else nullcontext(False) as cached:
        kernel: Any = njit(**{"nogil": True, "error_model": "numpy", "cache": cached, **options})(function)
    if kept and CACHE not in MISSING:
        kernel._cache = KernelCache(function)
    if CALLS in MISSING:
        return cast(_Kernel, kernel)
    template = kernel.get_call_template

    def plain(arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
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
    if CHOSEN == C:
        return ahead.direct(kernel, list(_wanted(arguments)))
    if PLAIN or CALLS in MISSING:
        return ahead.checked(kernel, list(_wanted(arguments)))
    passed = tuple(map(_argument if READABLE else _type_of, arguments))
    entry: Callable[..., Any] = kernel.compile(passed)
    returned = kernel.overloads[passed].signature.return_type
    if not isinstance(returned, types.Number | types.Boolean | types.NoneType):
        raise TypeError(f"{kernel} returns {returned}, which might be a part of a borrowed array")
    return entry if READABLE else ahead.checked(entry, list(_wanted(arguments)))


def is_cached(kernel: Any) -> bool:
    """Whether a kernel need not be compiled before it is called."""
    return CHOSEN != NUMBA or cache.is_cached(kernel)


def counted(axes: int) -> Wanted:
    """An array that is neither borrowed nor checked, for `direct`: that of calls with dispatch."""
    return Wanted((None,) * axes, checked=False)


def row_of(kind: type) -> Wanted:
    """An array with one axis of `int` or `bool` values, for `record`."""
    return Wanted((None,), checked=False, item=kind)


def record(cls: type, *fields: Any) -> Record:
    """A named tuple `cls`, for `direct`; its fields are numbers of axes, `MODEL`, types of numbers or `row_of`."""
    return Record(cls, fields)


def _wanted(arguments: tuple[Any, ...]) -> Iterator[Wanted | None]:
    """The arrays among the arguments of `direct`, and None for each number."""
    for argument in arguments:
        match argument:
            case Record(_, fields):
                yield from (each and each._replace(checked=False) for each in _wanted(fields))
            case Wanted():
                yield argument
            case type():
                yield None
            case tuple():
                yield Wanted(argument)
            case _:
                yield Wanted((None,) * (1 if argument == MODEL else argument))


def _type_of(argument: Any) -> Any:
    """The type of numba with which an argument is passed as numba does."""
    numbers = {float: types.float64, int: types.int64, bool: types.boolean}
    match argument:
        case Record(cls, fields):
            return types.NamedTuple(tuple(map(_type_of, fields)), cls)
        case Wanted():
            return types.Array(numbers[argument.item], len(argument.shape), "C")
        case type():
            return numbers[argument]
        case tuple():
            return types.Array(types.float64, len(argument), "C")
    return types.Array(types.float64, 1 if argument == MODEL else argument, "C", readonly=argument == MODEL)


def _argument(argument: Any) -> Any:
    """The type with which an argument of `direct` is passed: arrays are borrowed."""
    match argument:
        case Record() | Wanted() | type():
            return _type_of(argument)
        case tuple():
            return Borrowed(argument)
    return Borrowed((None,) * (1 if argument == MODEL else argument), readonly=argument == MODEL)


def _settled(kind: Any) -> Any:
    """The type with which a callee is compiled."""
    return kind.owned() if isinstance(kind, Borrowed) else types.unliteral(kind)
