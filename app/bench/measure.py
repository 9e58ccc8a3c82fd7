"""Timing in turns: in each round every contestant runs for a short while, so that noise affects all equally.

A turn is a loop of calls that takes some milliseconds, with the garbage collector off. Times are wall times (or
processor times, on a busy machine) per target; they include some tens of nanoseconds of the loop itself. Ratios
are taken within each round, between turns a moment apart, and their median is reported: a machine that slows
down during the run changes both times and leaves the ratio.
"""

from __future__ import annotations

import gc
import random
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from app.bench.contestants import Contestant

Clock = Callable[[], int]


@dataclass(slots=True, eq=False)
class Turns:
    """The times of one contestant.

    Attributes:
        seconds: per target, one entry per round.
        calls: calls in a turn.
    """

    contestant: Contestant
    calls: int = 1
    seconds: list[float] = field(default_factory=list)
    _next: int = 0

    @property
    def median(self) -> float:
        """Seconds per target."""
        return statistics.median(self.seconds)

    @property
    def best(self) -> float:
        """Seconds per target in the fastest round; noise only adds to it."""
        return min(self.seconds)

    @property
    def noise(self) -> float:
        """Distance between the quartiles, relative to the median."""
        if len(self.seconds) < 2:
            return 0.0
        low, _, high = statistics.quantiles(self.seconds, n=4)
        return (high - low) / self.median

    def take(self, clock: Clock) -> None:
        """Run one turn."""
        inputs = self.contestant.inputs
        chosen = [inputs[(self._next + k) % len(inputs)] for k in range(self.calls)]
        self._next = (self._next + self.calls) % len(inputs)
        call = self.contestant.call
        if self.calls > 1:
            call(*chosen[-1])  # refills the caches after the other contestants
        start = clock()
        for arguments in chosen:
            call(*arguments)
        spent = clock() - start
        self.seconds.append(spent * 1e-9 / (self.calls * self.contestant.per_call))

    def calibrate(self, seconds: float, clock: Clock) -> None:
        """Choose the number of calls in a turn; a multiple of the number of targets if possible."""
        self.calls = 1
        while True:
            for _ in range(3):
                self.take(clock)
            spent = self.best * self.calls * self.contestant.per_call
            self.seconds.clear()
            if spent >= seconds / 4.0 or self.calls >= 1_000_000:
                break
            self.calls *= 2
        self.calls = max(1, round(self.calls * seconds / max(spent, 1e-9)))
        sweep = len(self.contestant.inputs)
        if self.calls > sweep:
            self.calls -= self.calls % sweep
        self._next = 0


def ratio(of: Turns, to: Turns) -> float:
    """Time of `of` relative to `to`: the median over the rounds that both have."""
    return statistics.median(a / b for a, b in zip(of.seconds, to.seconds, strict=False))


def measure(
    entries: Sequence[Turns],
    rounds: int,
    turn: float,
    *,
    clock: Clock = time.perf_counter_ns,
    after_round: Callable[[int], None] = lambda _: None,
) -> None:
    """Run turns of about `turn` seconds, in a new order each round.

    After a KeyboardInterrupt the entries hold what was measured by then.
    """
    order = list(entries)
    shuffler = random.Random(0)
    was_on = gc.isenabled()
    try:
        gc.collect()
        for entry in entries:
            entry.calibrate(turn, clock)
        for done in range(rounds):
            shuffler.shuffle(order)
            gc.disable()
            for entry in order:
                entry.take(clock)
            if was_on:
                gc.enable()
            after_round(done + 1)
    finally:
        if was_on:
            gc.enable()
