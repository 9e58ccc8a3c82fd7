"""Decorators of kernels, and kernels that check the arrays they are called with.

KINBOARD_KERNELS says what kernels are: ``c`` (the default) calls the extension that was compiled from them before
the program began (:mod:`kin.kernels.ahead`); ``python`` runs them as they are written, for debugging and coverage.
Both give the same bits, but for two cases: on x86-64-v2, which has no instruction for ``a·b + c``, the extension
rounds the product too (:func:`kin.kernels.simd.fma`); and sine, cosine and powers of the C library may be those of
another one than Python's.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any, Final, TypeVar, cast

import numpy as np

from kin.kernels import ahead
from kin.kernels.plain import written

C, PYTHON = "c", "python"
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
        return entry or written(self.py_func)


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


def direct(kernel: Any, *arrays: int | tuple[int | None, ...] | None) -> Callable[..., Any]:
    """A kernel as a function that is called without a detour.

    Args:
        arrays: of each argument what plain Python checks, as the extension does by itself: of a C-contiguous
            float64 array its shape, in which None stands for any length, or its number of axes. None: nothing.

    Returns:
        The function. It raises `TypeError` for an array that is not as described: callers need not check it, and
        deal with whatever else they accept when that happens.
    """
    if not PLAIN and (entry := ahead.entries().get(kernel.name)) is not None:
        return entry
    shapes = [(None,) * each if isinstance(each, int) else each for each in arrays]

    def call(*arguments: Any) -> Any:
        for value, shape in zip(arguments, shapes, strict=True):
            if shape is not None and not fits(value, shape):
                raise TypeError(f"{value!r} is not a C-contiguous float64 array {shape}")
        return kernel(*arguments)

    return call


def fits(value: object, shape: tuple[int | None, ...]) -> bool:
    """Whether a value is a C-contiguous array of floats with this shape."""
    if type(value) is not np.ndarray or value.dtype != np.float64 or value.ndim != len(shape):
        return False
    if not (value.flags.c_contiguous and value.flags.aligned):
        return False
    return all(wanted in (None, there) for wanted, there in zip(shape, value.shape, strict=True))
