"""Decorators of kernels, and kernels that check the arrays they are called with.

KINBOARD_KERNELS says what kernels are: ``c`` (the default) calls the extension that was compiled from them before
the program began (:mod:`kin.kernels.ahead`); ``python`` runs them as they are written, for debugging and coverage.
Both give the same bits, but for two cases: on x86-64-v2, which has no instruction for ``a·b + c``, the extension
rounds the product too (:func:`kin.kernels.simd.fma`); and sine, cosine and powers of the C library may be those of
another one than Python's.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import cached_property, update_wrapper
from typing import Any, Final, NamedTuple, TypeVar, cast

import numpy as np

from kin.kernels import ahead
from kin.kernels.plain import written

C, PYTHON = "c", "python"
MODEL = "model"
_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


def _chosen() -> str:
    found = os.environ.get("KINBOARD_KERNELS") or C
    if found not in (C, PYTHON):
        raise ValueError(f"KINBOARD_KERNELS={found}: it is one of {C}, {PYTHON}")
    return found


PLAIN: Final = _chosen() == PYTHON


class Kernel:
    """A kernel: an entry of the extension, or, where that has none as Python never calls it, as it is written.

    Attributes:
        py_func: the function itself.
    """

    def __init__(self, function: Any) -> None:
        self.py_func = function
        self.name = f"{function.__module__}.{function.__qualname__}"
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self._call(*arguments)

    @cached_property
    def _call(self) -> Callable[..., Any]:
        entry = None if PLAIN else ahead.entries().get(self.name)
        return written(self.py_func) if entry is None else entry.function()


def jit(function: _Kernel) -> _Kernel:
    """Make a function a kernel, which releases the GIL and divides as NumPy does."""
    return cast(_Kernel, Kernel(function))


def brief(function: _Kernel) -> _Kernel:
    """As `jit`, for a kernel of a fraction of a microsecond, which keeps the GIL.

    Releasing and taking it again costs 40 ns, a third of the kinematics of an arm, and more where another thread
    takes it meanwhile; in such a short time that thread could not do anything.
    """
    return jit(function)


def inlined(function: _Kernel) -> _Kernel:
    """As `jit`, for a kernel that is always inlined, so that loops over calls to it can be vectorised."""
    return jit(function)


def joined(function: _Kernel) -> _Kernel:
    """As `inlined`, for a kernel with kernels as arguments."""
    return jit(function)


class Wanted(NamedTuple):
    """An array as a kernel wants it: its shape, None for an axis of any length.

    Attributes:
        checked: whether it is an array of floats that `direct` checks where the extension does not do it.
    """

    shape: tuple[int | None, ...]
    checked: bool = True


ROW: Final = Wanted((None,), checked=False)  # an array with one axis, of integers or bools


class Record(NamedTuple):
    """A named tuple as an argument of `direct`."""

    fields: tuple[Any, ...]


def record(*fields: Any) -> Record:
    """A named tuple, for `direct`; its fields are numbers of axes, `MODEL`, `ROW` or types of numbers."""
    return Record(fields)


def direct(kernel: Any, *arguments: Any) -> Callable[..., Any]:
    """A kernel as a function that is called without a detour.

    Args:
        arguments: for a C-contiguous float64 array (which may be read-only unless the kernel writes to it) its
            number of axes, or its shape, in which None stands for any length. `MODEL` stands for `Robot.model`,
            `ROW` for an array of integers or bools; `float`, `int` and `bool` for a number; `record` for a named
            tuple.

    Returns:
        The function. It raises `TypeError` for an array argument that is not as described: callers need not check
        it, and deal with whatever else they accept when that happens.

    Raises:
        ImportError: the extension has no such entry.
    """
    if PLAIN:
        return checked(kernel, list(_wanted(arguments)))
    entry = ahead.entries().get(kernel.name)
    if entry is None:
        raise ImportError(f"the extension has no entry {kernel.name}")
    return entry.function()


def _wanted(arguments: tuple[Any, ...]) -> Iterator[Wanted | None]:
    """The arrays among the arguments of `direct`, and None for each number."""
    for argument in arguments:
        match argument:
            case Record(fields):
                yield from (each and each._replace(checked=False) for each in _wanted(fields))
            case Wanted():
                yield argument
            case type():
                yield None
            case tuple():
                yield Wanted(argument)
            case _:
                yield Wanted((None,) * (1 if argument == MODEL else argument))


def checked(function: Callable[..., Any], wanted: list[Wanted | None]) -> Callable[..., Any]:
    """A function that checks the arrays that it is given as an entry of the extension does."""

    def call(*arguments: Any) -> Any:
        for value, array in zip(_flat(arguments), wanted, strict=True):
            if array is not None and array.checked and not fits(value, array.shape):
                raise TypeError(f"{value!r} is not a C-contiguous float64 array {array.shape}")
        return function(*arguments)

    return call


def _flat(arguments: tuple[Any, ...]) -> Iterator[Any]:
    for each in arguments:
        yield from _flat(each) if isinstance(each, tuple) else (each,)


def fits(value: object, shape: tuple[int | None, ...]) -> bool:
    """Whether a value is a C-contiguous array of floats with this shape."""
    if type(value) is not np.ndarray or value.dtype != np.float64 or value.ndim != len(shape):
        return False
    if not (value.flags.c_contiguous and value.flags.aligned):
        return False
    return all(wanted in (None, there) for wanted, there in zip(shape, value.shape, strict=True))
