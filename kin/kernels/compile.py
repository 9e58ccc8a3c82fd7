"""Decorators of kernels, and what a kernel is.

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
        raise ImportError(f"KINBOARD_KERNELS={found}: it is one of {C}, {PYTHON}")
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
        return self.function(*arguments)

    @cached_property
    def function(self) -> Callable[..., Any]:
        """What is called."""
        entry = None if PLAIN else ahead.entries().get(self.name)
        return entry or written(self.py_func)


def jit(function: _Kernel) -> _Kernel:
    """Make a function a kernel, which releases the GIL and divides as NumPy does."""
    return cast(_Kernel, Kernel(function))


def jit_with_gil(function: _Kernel) -> _Kernel:
    """As `jit`, for a kernel of a fraction of a microsecond, which keeps the GIL.

    Releasing and taking it again costs 40 ns, a third of the kinematics of an arm, and more where another thread
    takes it meanwhile; in such a short time that thread could not do anything.
    """
    return jit(function)


def inlined(function: _Kernel) -> _Kernel:
    """As `jit`, for a kernel that is always inlined, so that loops over calls to it can be vectorised."""
    return jit(function)


def direct(kernel: Any) -> Callable[..., Any]:
    """The function of a kernel, without the call around it, which takes half as long as a small kernel.

    A function of plain Python is what is called, too.

    An entry of the extension raises `TypeError` for arguments that are not as ``entries.txt`` says, and Python for
    other numbers than floats: callers need not check them, and deal with what else they accept when that happens.
    """
    function: Callable[..., Any] = kernel.function if isinstance(kernel, Kernel) else kernel

    def call(*arguments: Any) -> Any:
        if any(isinstance(each, np.ndarray) and each.dtype != np.float64 for each in arguments):
            raise TypeError("an array of other numbers than floats")
        return function(*arguments)

    return call if PLAIN else function
