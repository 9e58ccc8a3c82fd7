"""``python fuzz.py FILE``: calls every entry of an extension with one argument that is wrong, in every way.

Each call must be a TypeError: none may reach the kernel. Prints how many calls there were.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from kin.kernels import ahead

DTYPES = dict(zip("fibwsz", ("f8", "i8", "?", "u8", "f4", "c16"), strict=True))
NUMBERS: dict[str, Any] = {"f": 1.0, "i": 1, "b": True, "w": 1, "s": 1.0, "z": 1j}
WRONG: tuple[Any, ...] = (None, "1", b"1", object(), {}, np.float64, slice(2), 10**400, np.zeros(2, "m8[s]"))


class Array(np.ndarray):
    """A subclass, which may mean something else by its fields."""


def arrays(word: str) -> Iterator[Any]:
    """What is no array that the word describes, such as ``f2w``."""
    letter, ndim = word[0], int(word[1])
    right = np.zeros((3,) * ndim, DTYPES[letter])
    yield from (right.tolist(), memoryview(right), right.view(Array), right.astype(object), right[None], right[0])
    yield from (right[::2], np.repeat(right, 2, axis=-1)[..., ::2], right[::-1], right.astype("U1"))
    yield from (right.astype(kind) for kind in DTYPES.values() if kind != DTYPES[letter])
    yield np.broadcast_to(np.zeros((), DTYPES[letter]), (1 << 12,) * ndim)  # huge, without memory
    if right.itemsize > 1:
        yield right.astype(right.dtype.newbyteorder())
        yield np.ndarray(right.shape, right.dtype, np.zeros(right.nbytes + 1, np.uint8), 1)
    if ndim > 1:
        yield np.asfortranarray(np.zeros((2, 3) + (1,) * (ndim - 2), right.dtype))
    if word[2] == "w":
        right.flags.writeable = False
        yield right


def calls(words: list[str]) -> Iterator[tuple[Any, ...]]:
    """Arguments of which one is wrong, as flat as the words, where brackets are tuples."""
    right = [np.zeros((3,) * int(w[1]), DTYPES[w[0]]) if len(w) > 1 else NUMBERS.get(w, w) for w in words]
    for k, word in enumerate(words):
        if word in "()":
            continue
        others = arrays(word) if len(word) > 1 else iter((np.zeros(2), [1.0]))
        for wrong in (*WRONG, *others):
            yield nested([*right[:k], wrong, *right[k + 1 :]])
    flat = nested(right)
    yield from (flat[:-1], (*flat, 1.0))
    for k, each in enumerate(flat):
        if isinstance(each, tuple):
            yield from (
                (*flat[:k], wrong, *flat[k + 1 :]) for wrong in (list(each), each[:-1], (*each, 1.0), None)
            )


def nested(values: list[Any]) -> tuple[Any, ...]:
    """Values with tuples in place of brackets."""
    stack: list[list[Any]] = [[]]
    for value in values:
        if isinstance(value, str) and value == "(":
            stack.append([])
        elif isinstance(value, str) and value == ")":
            closed = tuple(stack.pop())
            stack[-1].append(closed)
        else:
            stack[-1].append(value)
    return tuple(stack[0])


def refused(module: Any) -> int:
    """How many calls of all entries there were."""
    count = 0
    for index, (name, takes, _) in enumerate(module.entries()):
        kernel = module.entry(index, ())
        for arguments in calls(re.findall(r"[()]|[a-z]\d[rw]|[a-z]", takes)):
            try:
                kernel(*arguments)
            except TypeError:
                count += 1
            else:
                raise AssertionError(f"{name} {takes} took {arguments}")
    return count


if __name__ == "__main__":
    for readable in (True, False):
        extension = ahead.loaded(Path(sys.argv[1]), readable)
        print(f"{refused(extension)} calls of {len(extension.entries())} entries")
