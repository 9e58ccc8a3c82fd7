"""Which kernels are compiled by now: on a new machine the parts of the core are, one after the other.

One process has them compiled. All processes that share the memory see how far it is, and may ask for a part before
its turn.
"""

from __future__ import annotations

from collections.abc import Collection, MutableSequence
from typing import Final

from kin.warmup import first_family, parts

ROOM: Final = 96  # parts, for which there is memory
SIZE: Final = 2 * ROOM + 2  # bytes


class Preparation:
    """The kernels of `kin.warmup.parts`: steps done, and what is wanted first.

    Each byte of the memory is written by one side only, or always set to the same value: no lock is needed.

    Args:
        memory: `SIZE` bytes, zero at first; None: of this process alone.
    """

    def __init__(self, memory: MutableSequence[int] | None = None) -> None:
        # Bytes: whether parts are compiled; 1 + the number of the one that is; of each part, the steps that are
        # done; of each part, whether it is wanted.
        self._memory = bytearray(SIZE) if memory is None else memory

    # Any process

    @property
    def complete(self) -> bool:
        """Whether nothing is compiled ahead: before `begin`, and after `finish`."""
        return self._memory[0] == 0

    def ready(self, names: Collection[str]) -> bool:
        """Whether these parts are compiled. Those with other names than `parts` has are not compiled ahead."""
        return self.complete or all(done == of for done, of in map(self._steps, names))

    def steps(self, names: Collection[str]) -> tuple[int, int]:
        """How many steps of these parts are done, and how many there are."""
        counts = [self._steps(name) for name in names]
        return sum(done for done, _ in counts), sum(of for _, of in counts)

    def want(self, names: Collection[str]) -> None:
        """Have these parts compiled before the others."""
        for name in names:
            if name in parts():
                self._memory[2 + ROOM + _number(name)] = 1

    @property
    def state(self) -> tuple[list[str], str | None, list[str]]:
        """Names of the parts that are ready, of the one that is being compiled, and of those that wait."""
        now = self._memory[1]
        current = list(parts())[now - 1] if now else None
        ready = [name for name in parts() if self.ready((name,))]
        return [first_family(), *ready], current, [name for name in parts() if name not in (*ready, current)]

    def _steps(self, name: str) -> tuple[int, int]:
        if name not in parts():
            return 0, 0
        of = len(parts()[name])
        return (of if self.complete else self._memory[2 + _number(name)]), of

    # The process that has them compiled

    def begin(self) -> None:
        """Kernels are missing: they are compiled from now on."""
        self._memory[0] = 1

    def next(self) -> tuple[str, int] | None:
        """The part to go on with, what is wanted first, and the number of its next step; None: all are done."""
        waiting = [name for name in parts() if not self.ready((name,))]
        if not waiting:
            self._memory[1] = 0
            return None
        wanted = [name for name in waiting if self._memory[2 + ROOM + _number(name)]]
        name = (wanted or waiting)[0]
        self._memory[1] = 1 + _number(name)
        return name, self._memory[2 + _number(name)]

    def done(self, name: str) -> None:
        """The next step of a part is done."""
        self._memory[2 + _number(name)] += 1

    def finish(self) -> None:
        """Nothing is compiled ahead any more."""
        self._memory[0] = self._memory[1] = 0


def _number(name: str) -> int:
    number = list(parts()).index(name)
    if number >= ROOM:
        raise ValueError(f"there is no memory for {name}")
    return number
