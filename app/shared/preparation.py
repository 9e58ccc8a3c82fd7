"""Which kernels are compiled by now: on a new machine the parts of the core are, one after the other.

One thread has them compiled. All others see how far it is, and may ask for a part before its turn.
"""

from __future__ import annotations

from collections.abc import Collection

from kin.warmup import Step, first_family, parts


class Preparation:
    """The kernels of `kin.warmup.parts`: what is left of them, and what is wanted first.

    Each value is written by one thread only, or always set to the same: no lock is needed.
    """

    def __init__(self) -> None:
        self._left: dict[str, list[Step]] = {}  # steps of the parts that are not compiled
        self._current: str | None = None
        self._wanted: set[str] = set()

    # Any thread

    @property
    def complete(self) -> bool:
        """Whether nothing is compiled ahead: before `begin`, when all is compiled, and after `finish`."""
        return not self._left

    def ready(self, names: Collection[str]) -> bool:
        """Whether these parts are compiled. Those with other names than `parts` has are not compiled ahead."""
        return self._left.keys().isdisjoint(names)

    def steps(self, names: Collection[str]) -> tuple[int, int]:
        """How many steps of these parts are done, and how many there are."""
        of = sum(len(parts().get(name, ())) for name in names)
        return of - sum(len(self._left.get(name, ())) for name in names), of

    def want(self, names: Collection[str]) -> None:
        """Have these parts compiled before the others."""
        self._wanted.update(names)

    @property
    def state(self) -> tuple[list[str], str | None, list[str]]:
        """Names of the parts that are ready, of the one that is being compiled, and of those that wait."""
        left, current = list(self._left), self._current
        ready = [name for name in parts() if name not in left]
        return [first_family(), *ready], current, [name for name in left if name != current]

    # The thread that has them compiled

    def begin(self) -> None:
        """Kernels are missing: they are compiled from now on."""
        self._left = {name: list(steps) for name, steps in parts().items()}

    def next(self) -> tuple[str, Step] | None:
        """The part to go on with, what is wanted first, and its next step; None: all are done."""
        left = self._left
        self._current = next((name for name in left if name in self._wanted), next(iter(left), None))
        return None if self._current is None else (self._current, left[self._current][0])

    def done(self, name: str) -> None:
        """The next step of a part is done."""
        left = {**self._left, name: self._left[name][1:]}
        self._left = {each: steps for each, steps in left.items() if steps}

    def finish(self) -> None:
        """Nothing is compiled ahead any more."""
        self._left, self._current = {}, None
