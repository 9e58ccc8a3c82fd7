"""What kernels are called with from Python, and what they do: one call of each entry, from calls of the core.

Run as a program, it writes them to a file: kernels that were called without dispatch before cannot be recorded.
"""

from __future__ import annotations

import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np
from emitted import ROBOTS
from numba import njit

from kin import Robot, fk, ik_branches
from kin.codegen.c import LETTERS
from kin.codegen.source import plain
from kin.codegen.types import BOOL, FLOAT, INT, SINGLE, WORD, ArrayOf, TupleOf, Type
from kin.codegen.units import entry_of, units
from kin.kernels.private import CALLS, MISSING
from kin.solvers import closed_form_of
from kin.warmup import one_of_each_family, parts, warm_up_first

DTYPES = {FLOAT: np.float64, INT: np.int64, BOOL: np.bool_, WORD: np.uint64, SINGLE: np.float32}


def fits(kind: Type, value: Any) -> bool:
    """Whether a value is of a type."""
    match kind:
        case TupleOf(items=items):
            return isinstance(value, tuple) and len(value) == len(items) and all(map(fits, items, value))
        case ArrayOf(item=item, ndim=ndim):
            return isinstance(value, np.ndarray) and (value.dtype, value.ndim) == (DTYPES[item], ndim)
    numbers = {BOOL: (bool, np.bool_), WORD: np.uint64, INT: (int, np.integer), FLOAT: (int, float)}
    return kind in numbers and isinstance(value, numbers[kind])


def text_of(value: Any) -> str:
    """The type of an argument, as ``entries.txt`` has it."""
    if isinstance(value, tuple):
        cls = type(value)
        name = f"{cls.__module__}.{cls.__qualname__}" if hasattr(value, "_fields") else ""
        return f"{name}({','.join(map(text_of, value))})"
    if isinstance(value, np.ndarray):
        letters = [LETTERS[kind] for kind, dtype in DTYPES.items() if dtype == value.dtype]
        return f"{letters[0] if letters else value.dtype}{value.ndim}"
    return next((LETTERS[kind] for kind in (BOOL, WORD, INT, FLOAT) if fits(kind, value)), repr(type(value)))


def copied(value: Any) -> Any:
    """A value with its own arrays."""
    if isinstance(value, tuple):
        return tuple(map(copied, value))
    return value.copy() if isinstance(value, np.ndarray) else value


class Recorder:
    """Calls of kernels, the first of each entry: (arguments before, arguments after, result) by its line."""

    def __init__(self) -> None:
        self.calls: dict[str, tuple[Any, Any, Any]] = {}
        self.others: set[str] = set()  # lines of calls that fit none
        self._of: dict[Any, dict[str, tuple[Type, ...]]] = {}
        for line in (each for lines in units().values() for each in lines):
            entry = entry_of(line)
            self._of.setdefault(plain(entry.kernel), {})[line] = entry.kinds
        kernels = type(njit(lambda: None))
        call = kernels.__call__

        def recorded(kernel: Any, *arguments: Any) -> Any:
            function = kernel.py_func
            there = self._of.get(function, {}).items()
            line = next((line for line, kinds in there if all(map(fits, kinds, arguments))), "")
            if not line:
                name = f"{function.__module__}.{function.__name__}"
                self.others.add(" ".join([name, *map(text_of, arguments)]))
            if not line or line in self.calls:
                return call(kernel, *arguments)
            before = copied(arguments)
            result = call(kernel, *arguments)
            self.calls[line] = before, copied(arguments), copied(result)
            return result

        kernels.__call__ = recorded
        MISSING.setdefault(CALLS, "calls are recorded")  # so that none of them is without dispatch


def main(file: Path) -> None:
    """Record the calls of `kin.warmup`, which a service makes, and of array-level calls."""
    recorder = Recorder()
    warm_up_first()
    for steps in parts().values():
        for step in steps:
            step()
    oblique = ((0.3 * i, 0.1 + 0.1 * i, 0.3 - 0.05 * i, 0.7 + 0.1 * i) for i in range(3))
    made_up = (robot for name, robot in ROBOTS.items() if name.startswith("made-up"))
    for robot in (*one_of_each_family(), *made_up, Robot.from_dh(oblique, home=[0.3, 0.5, 0.7])):
        T = fk(robot, robot.q_home)
        if closed_form_of(robot) is not None:
            ik_branches(robot, T)
            ik_branches(robot, np.stack([T, T]))
    file.write_bytes(pickle.dumps((recorder.calls, sorted(recorder.others))))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
