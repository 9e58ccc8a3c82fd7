"""Kernels that another process compiles for this one, which then loads them from the cache.

numba compiles a kernel in the thread that calls it first. In a service that has three faults: the compiler keeps a
gigabyte of memory until the process ends, nothing can interrupt it, and threads that need another kernel wait for
it. So a service asks another process (`compile_elsewhere`), which compiles what each line of its input names
(`serve`). A kernel that the cache does not keep is compiled where it is called, as without this module.
"""

from __future__ import annotations

import os
import pickle
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from typing import Any

from kin.kernels.ahead import CHOSEN, NUMBA
from kin.kernels.compile import PLAIN

if CHOSEN == NUMBA:
    from numba import njit

    from kin.kernels.cache import KernelCache
    from kin.kernels.private import CACHE, CALLS, MISSING

TRIES = 2  # processes that may end before a kernel is compiled here
VAIN = 3  # kernels that were compiled and not kept, as on a full disk, after which no other process is asked
DONE = "done"  # the answer to each line
IDLE = 20.0  # s without a kernel to compile, after which a process ends: it keeps a gigabyte of memory

Ask = Callable[[str], bool]


class _Thread(threading.local):
    loads = False  # a kernel from the cache, and must not compile it
    compiles = False  # a kernel, and what it calls


_ask: Ask | None = None
_vain = 0
_thread = _Thread()
_kernels: Any = type(njit(lambda: None)) if CHOSEN == NUMBA else None  # the class of all kernels
_compile: Any = getattr(_kernels, "compile", None)


class _MissingError(Exception):
    """A kernel is in no cache. Raised where numba would go on to compile it, so that its lock is given back."""


def compile_elsewhere(ask: Ask | None) -> None:
    """From now on, have another process compile the kernels that are in no cache; None: compile them here.

    Does nothing where numba compiles no kernels.

    Args:
        ask: called in the thread that needs a kernel, with the line for `serve` in the other process. Returns
            whether it is compiled, and may raise instead; the caller of the kernel gets the exception.
    """
    global _ask, _vain
    _ask, _vain = ask, 0
    if CHOSEN == NUMBA and not (PLAIN or MISSING.keys() & {CACHE, CALLS}):
        _kernels.compile = _compile if ask is None else _compile_with_help


def serve() -> None:
    """Compile the kernel that each line of the standard input names, and say on the standard output when it is.

    The process ends after `IDLE` seconds without a line.
    """
    end = _end_when_idle()
    try:
        for line in sys.stdin:
            end.cancel()
            module, name, signature = line.split()
            getattr(import_module(module), name).compile(pickle.loads(bytes.fromhex(signature)))
            print(DONE, flush=True)
            end = _end_when_idle()
    finally:
        end.cancel()


def _end_when_idle() -> threading.Timer:
    timer = threading.Timer(IDLE, os._exit, (0,))
    timer.daemon = True
    timer.start()
    return timer


def _compile_with_help(kernel: Any, signature: Any) -> Any:
    """Stands for numba's method, which loads the kernel from the cache or compiles it."""
    global _vain
    cache = kernel._cache
    if _thread.compiles or not isinstance(cache, KernelCache):
        return _compile_here(kernel, signature)
    if not isinstance(cache.load_overload, _Loading):
        vars(cache)["load_overload"] = _Loading(cache.load_overload)
    try:
        return _load(kernel, signature)
    except _MissingError:
        line, ask = line_of(kernel, signature), _ask
    if line and ask is not None and _vain < VAIN and any(ask(line) for _ in range(TRIES)):
        try:
            return _load(kernel, signature)
        except _MissingError:
            _vain += 1
    return _compile_here(kernel, signature)


def _load(kernel: Any, signature: Any) -> Any:
    """The kernel from the cache; raises `_MissingError`."""
    _thread.loads = True
    try:
        return _compile(kernel, signature)
    finally:
        _thread.loads = False


def _compile_here(kernel: Any, signature: Any) -> Any:
    """The kernel, compiled by this thread with all that it calls: nobody else can have numba's lock meanwhile."""
    compiles, _thread.compiles = _thread.compiles, True
    try:
        return _compile(kernel, signature)
    finally:
        _thread.compiles = compiles


class _Loading:
    """What numba asks the cache of a kernel for."""

    def __init__(self, load: Any) -> None:
        self._load = load

    def __call__(self, signature: Any, target: Any) -> Any:
        found = self._load(signature, target)
        if found is None and _thread.loads:
            raise _MissingError
        return found


def line_of(kernel: Any, signature: Any) -> str:
    """What `serve` reads; empty for a kernel that another process cannot find by its name."""
    function = kernel.py_func
    if getattr(sys.modules.get(function.__module__), function.__name__, None) is not kernel:
        return ""
    try:
        return f"{function.__module__} {function.__name__} {pickle.dumps(signature).hex()}"
    except (pickle.PicklingError, TypeError, AttributeError):  # the type of a function of this process
        return ""
