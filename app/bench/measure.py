"""Timing in turns: round after round, each contestant a short while, so that noise befalls all alike.

A turn is a loop of calls as long as it takes to fill some milliseconds, the garbage collector off. Times are of
the wall clock (or of the processor, on a machine that has other things to do), per target, with the loop's own
cost of some tens of nanoseconds in everyone's. Ratios are taken within each round, between turns a moment apart,
and then the median of them: a machine that slows down half-way through changes both times and leaves the ratio.
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
    """One contestant's times.

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
        """Seconds per target in the fastest round: what noise can only add to."""
        return min(self.seconds)

    @property
    def noise(self) -> float:
        """Distance between the quartiles, relative to the median."""
        if len(self.seconds) < 2:
            return 0.0
        low, _, high = statistics.quantiles(self.seconds, n=4)
        return (high - low) / self.median

    def take(self, clock: Clock) -> None:
        """One turn."""
        inputs = self.contestant.inputs
        chosen = [inputs[(self._next + k) % len(inputs)] for k in range(self.calls)]
        self._next = (self._next + self.calls) % len(inputs)
        call = self.contestant.call
        if self.calls > 1:
            call(*chosen[-1])  # what the others have driven out of the caches comes back
        start = clock()
        for arguments in chosen:
            call(*arguments)
        spent = clock() - start
        self.seconds.append(spent * 1e-9 / (self.calls * self.contestant.per_call))

    def calibrate(self, seconds: float, clock: Clock) -> None:
        """Choose the calls of a turn; whole sweeps over the targets where they fit."""
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
    """How many times as long as `to` it takes `of`: the median over the rounds both have."""
    return statistics.median(a / b for a, b in zip(of.seconds, to.seconds, strict=False))


def measure(
    entries: Sequence[Turns],
    rounds: int,
    turn: float,
    *,
    clock: Clock = time.perf_counter_ns,
    after_round: Callable[[int], None] = lambda _: None,
) -> None:
    """Take turns of about `turn` seconds, in another order each round.

    When a KeyboardInterrupt passes through, the entries hold what was measured by then.
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
