"""Which kernels are compiled by now: on a new machine the parts of the core are, one after the other.

One thread has them compiled. All others see how far it is, and may ask for a part before its turn.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

from kin.warmup import first_family, parts


class Preparation:
    """The kernels of `kin.warmup.parts`: steps done, and what is wanted first.

    Each value is written by one thread only, or always set to the same: no lock is needed.

    Attributes:
        complete: whether nothing is compiled ahead: before `begin`, and after `finish`.
    """

    def __init__(self) -> None:
        self.complete = True
        self._current: str | None = None
        self._done: Counter[str] = Counter()  # steps of each part
        self._wanted: dict[str, None] = {}

    # Any thread

    def ready(self, names: Collection[str]) -> bool:
        """Whether these parts are compiled. Those with other names than `parts` has are not compiled ahead."""
        return self.complete or all(done == of for done, of in map(self._steps, names))

    def steps(self, names: Collection[str]) -> tuple[int, int]:
        """How many steps of these parts are done, and how many there are."""
        counts = [self._steps(name) for name in names]
        return sum(done for done, _ in counts), sum(of for _, of in counts)

    def want(self, names: Collection[str]) -> None:
        """Have these parts compiled before the others."""
        self._wanted |= dict.fromkeys(names)

    @property
    def state(self) -> tuple[list[str], str | None, list[str]]:
        """Names of the parts that are ready, of the one that is being compiled, and of those that wait."""
        current = self._current
        ready = [name for name in parts() if self.ready((name,))]
        return [first_family(), *ready], current, [name for name in parts() if name not in (*ready, current)]

    def _steps(self, name: str) -> tuple[int, int]:
        of = len(parts().get(name, ()))
        return of if self.complete else self._done[name], of

    # The thread that has them compiled

    def begin(self) -> None:
        """Kernels are missing: they are compiled from now on."""
        self.complete = False

    def next(self) -> tuple[str, int] | None:
        """The part to go on with, what is wanted first, and the number of its next step; None: all are done."""
        waiting = [name for name in parts() if not self.ready((name,))]
        if not waiting:
            self._current = None
            return None
        name = next((name for name in waiting if name in self._wanted), waiting[0])
        self._current = name
        return name, self._done[name]

    def done(self, name: str) -> None:
        """The next step of a part is done."""
        self._done[name] += 1

    def finish(self) -> None:
        """Nothing is compiled ahead any more."""
        self.complete, self._current = True, None
