"""``python fuzz.py FILE``: calls every entry of an extension with one argument that is wrong, in every way.

Each call must be a TypeError: none may reach the kernel. An array that is one shorter or longer in one axis is
that, or does no harm: in an extension that compares indices with lengths, a kernel that reads beside an array is
an IndexError. Prints how many calls there were.
"""

from __future__ import annotations

import operator
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kin.codegen.extension.wanted import ARM, BOUNDED, DEMAND, RANGE
from kin.codegen.source import plain
from kin.codegen.units import entry_of, units
from kin.kernels import ahead

DTYPES = dict(zip("fibwsz", ("f8", "i8", "?", "u8", "f4", "c16"), strict=True))
NUMBERS: dict[str, Any] = {"f": 1.0, "i": 1, "b": True, "w": 1, "s": 1.0, "z": 1j}
WRONG: tuple[Any, ...] = (None, "1", b"1", object(), {}, np.float64, slice(2), 10**400, np.zeros(2, "m8[s]"))
OPERATORS = {"+": operator.add, "-": operator.sub, "*": operator.mul}


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


class Fitting:
    """Arguments that fit what an entry wants, as flat as the words of what it takes, where brackets are tuples."""

    def __init__(self, words: list[str], wanted: tuple[str, ...]) -> None:
        demands = iter(wanted)
        self.words = words
        self.demands = ["" if word in "()" else next(demands, "") for word in words]
        texts = [each for k in range(len(words)) for each in self.lengths(k)]
        least, most = dict[str, int](), dict[str, int]()
        for low, _, name, _, high in (found.groups() for text in texts if (found := BOUNDED.fullmatch(text))):
            least[name] = max(least.get(name, 3), int(low) + 1 if low else 3)
            most |= {name: int(high)} if (high or "").isdigit() else {}
        self.names = {name: min(value, most.get(name, value)) for name, value in least.items()}
        for text in texts:
            for name in re.findall(r"\b[a-z]\b", text):
                self.names.setdefault(name, 6)
        self.values = [self.value(k) for k in range(len(words))]

    def lengths(self, k: int) -> list[str]:
        texts = (DEMAND.fullmatch(self.demands[k]) or [""] * 2)[1]
        return texts.split(",") if texts else []

    def ranges(self, k: int) -> list[tuple[slice, int, int | None]]:
        """Places of the last axis, and the range of what is there."""
        texts, found = (DEMAND.fullmatch(self.demands[k]) or [""] * 3)[2], []
        for text in texts.split(",") if texts else ():
            parts = RANGE.fullmatch(text)
            assert parts is not None
            first, last, low, high = parts.groups()
            places = slice(int(first), int(last or first) + 1) if first else slice(None)
            found.append((places, self.number(low or "0"), self.number(high) if high else None))
        return found

    def number(self, text: str) -> int:
        for sign, compute in OPERATORS.items():
            left, _, right = text.rpartition(sign)
            if left:
                return int(compute(self.number(left), self.number(right)))
        return self.names[text] if text in self.names else int(text)

    def length(self, text: str) -> int:
        if arm := ARM.fullmatch(text):
            return int(arm[1] or 0) + 27 + 9 * self.number(arm[2])
        bounded = BOUNDED.fullmatch(text)
        return self.names[bounded[3]] if bounded else self.number(text.split("|")[0])

    def value(self, k: int) -> Any:
        word, lengths = self.words[k], self.lengths(k)
        if len(word) == 1:
            found = self.names[lengths[0]] if lengths else NUMBERS.get(word, word)
            return self.ranges(k)[0][1] if self.ranges(k) and not lengths else found
        made = np.random.default_rng(k).uniform(
            -1.0, 1.0, [self.length(text) for text in lengths] or [3] * int(word[1])
        )
        made = made.astype(DTYPES[word[0]]) if word[0] in "fsz" else np.zeros(made.shape, DTYPES[word[0]])
        for places, low, _ in self.ranges(k):
            made[..., places] = low
        if lengths and (arm := ARM.fullmatch(lengths[0])):
            model = made[int(arm[1] or 0) :]
            model[:3], model[27:].reshape(-1, 9)[:, 6] = (len(model[27:]) // 9, self.number(arm[2]), 0.0), 0.0
        return made

    def others(self) -> Iterator[tuple[bool, tuple[Any, ...]]]:
        """With one axis one shorter or longer, or one value outside its range; whether this must be refused."""
        yield False, self.nested(0, self.values[0])
        for k, value in enumerate(self.values):
            for axis in range(np.ndim(value)):
                some = (slice(None),) * axis
                yield False, self.nested(k, np.ascontiguousarray(value[(*some, slice(-1))]))
                yield False, self.nested(k, np.concatenate([value, value[(*some, slice(1))]], axis=axis))
            for places, low, high in self.ranges(k):
                for outside in (low - 1, high, -(1 << 62), 1 << 62):
                    if outside is not None and (high is not None or outside < low):
                        there = np.array(value) if isinstance(value, np.ndarray) else outside
                        if isinstance(there, np.ndarray):
                            there[..., places] = outside
                        yield np.size(there) > 0, self.nested(k, there)

    def nested(self, k: int, value: Any) -> tuple[Any, ...]:
        """All values with another one, and tuples in place of brackets; each array its own."""
        own = [each.copy() if isinstance(each, np.ndarray) else each for each in self.values]
        return nested([*own[:k], value, *own[k + 1 :]])

    def calls(self) -> Iterator[tuple[Any, ...]]:
        """With one argument of another type."""
        for k, word in enumerate(self.words):
            if word in "()":
                continue
            others = arrays(word) if len(word) > 1 else iter((np.zeros(2), [1.0]))
            for wrong in (*WRONG, *others):
                yield self.nested(k, wrong)
        flat = nested(self.values)
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


def refused(module: Any, wanted: Mapping[str, tuple[str, ...]]) -> int:
    """How many calls of all entries were refused; `wanted` by their names."""
    count = 0
    for index, (name, takes, _) in enumerate(module.entries()):
        kernel = module.entry(index)
        fitting = Fitting(re.findall(r"[()]|[a-z]\d[rw]|[a-z]", takes), wanted[name])
        calls = [(True, arguments) for arguments in fitting.calls()] + list(fitting.others())
        for must, arguments in calls:
            try:
                kernel(*arguments)
            except (TypeError, MemoryError) as error:
                count += isinstance(error, TypeError)
            else:
                assert not must, f"{name} {takes} took {arguments}"
    return count


def wanted_of(entries: Any) -> dict[str, tuple[str, ...]]:
    """What entries want, by their names."""
    return {f"{(it := plain(each.kernel)).__module__}.{it.__qualname__}": each.wanted for each in entries}


if __name__ == "__main__":
    all_wanted = wanted_of(entry_of(line) for lines in units().values() for line in lines)
    for readable in (True, False):
        extension = ahead.loaded(Path(sys.argv[1]), readable)
        print(f"{refused(extension, all_wanted)} calls of {len(extension.entries())} entries")
