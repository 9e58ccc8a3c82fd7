"""A worked example with its values: poses, words, and the player that goes from step to step.

It knows no page. Time is `time.perf_counter`'s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.exercises.variant import Quantity, Variant
from app.exercises.worked import Drawn, WorkedText, configuration
from kin import Robot, fk, jacobian
from kin.transforms import Array
from kin.units import Units

SAMPLES = 61  # of the way of a step
MOTION_TIME = 1.8  # s for the motion of a step
REST, PER_LETTER = 1.2, 0.045  # s of rest at the end of a step, to let its words be read
PATIENCE = 0.1  # s; after a longer pause between two frames it continues without a jump
_STILL = 1e-9
_ROUNDS = 20  # of Newton's method; the way is followed in small steps, so two or three are enough


@dataclass(frozen=True, eq=False)
class ExampleStep:
    """One step, in the reader's units.

    Attributes:
        text, then: what is true while the arm moves, and besides when it has arrived.
        way: the configurations ``(m, n)`` from the step before to this one; one row if the arm stays.
        drawn: what else is shown.
        walk: where the large frame is at the beginning and at the end, in motions from the base.
    """

    text: str
    then: str
    way: Array
    drawn: Drawn
    walk: tuple[float, float] = (0.0, 0.0)

    @property
    def moves(self) -> bool:
        """Whether anything moves."""
        return len(self.way) > 1 or self.walk[0] != self.walk[1]

    def at(self, share: float) -> Array:
        """The configuration ``(n,)`` after a share of the way, 0 to 1."""
        if len(self.way) == 1:
            return np.asarray(self.way[0])
        place = share * (len(self.way) - 1)
        number = min(int(place), len(self.way) - 2)
        first, second = self.way[number : number + 2]
        return np.asarray(first + (place - number) * (second - first))


@dataclass(frozen=True, eq=False)
class Example:
    """A worked example, in the reader's units."""

    title: str
    robot: Robot
    upright: bool
    steps: tuple[ExampleStep, ...]


def example_of(text: WorkedText, units: Units) -> Example:
    """The example with its words in these units."""
    steps, q, walked = list[ExampleStep](), np.zeros(text.robot.n), 0.0
    for number, step in enumerate(text.steps):
        end = configuration(step.q) if step.q else q
        start = q if number else end
        variant = Variant(text.title, text.robot, end)
        values = {
            name: Quantity(variant.number(value), measure) for name, (value, measure) in text.quantities.items()
        }
        variant = Variant(text.title, text.robot, end, values)
        walk = walked if step.drawn.walk is None else float(step.drawn.walk)
        steps.append(
            ExampleStep(
                variant.text(step.text, units),
                variant.text(step.then, units),
                _line(text.robot, start, end) if step.way == "line" else _joints(start, end),
                step.drawn,
                (walked if number else walk, walk),
            )
        )
        q, walked = end, walk
    return Example(text.title, text.robot, text.upright, tuple(steps))


def _joints(start: Array, end: Array) -> Array:
    """The way on which every joint moves evenly."""
    if np.abs(end - start).max() < _STILL:
        return end[None]
    return np.linspace(start, end, SAMPLES)


def _line(robot: Robot, start: Array, end: Array) -> Array:
    """The way on which the tool point goes straight: what the joints do evenly is corrected there."""
    even = _joints(start, end)
    goals = np.linspace(fk(robot, start)[:3, 3], fk(robot, end)[:3, 3], len(even))
    found = even.copy()
    for k in range(1, len(even) - 1):
        q = found[k - 1] + even[k] - even[k - 1]
        for _ in range(_ROUNDS):
            off = goals[k] - fk(robot, q)[:3, 3]
            if np.abs(off).max() < _STILL:
                break
            q = q + np.linalg.pinv(jacobian(robot, q)[:3], 1e-6) @ off
        # The rest of the way takes up what the correction has done to the other motions of the arm.
        found[k] = q
        even[k:] = np.linspace(q, end, len(even) - k)
    return found


class Player:
    """Goes through an example.

    Attributes:
        at: the index of the step on show.
        playing: whether it goes on by itself after this step.
    """

    def __init__(self, example: Example, now: float) -> None:
        self.example = example
        self.at = 0
        self.playing = True
        self._share = 0.0
        self._last, self._rest_until = now, now
        self._begin(now)

    @property
    def step(self) -> ExampleStep:
        """The step on show."""
        return self.example.steps[self.at]

    @property
    def arrived(self) -> bool:
        """Whether the motion of the step is at its end."""
        return self._share == 1.0

    @property
    def share(self) -> float:
        """The share of the way that is behind, which begins and ends gently."""
        return self._share * self._share * (3.0 - 2.0 * self._share)

    @property
    def is_last(self) -> bool:
        """Whether there is no further step."""
        return self.at == len(self.example.steps) - 1

    def toggle(self, now: float) -> None:
        """Pause or go on; at the end, begin anew."""
        if not self.playing and self.is_last and self.arrived:
            self.at = 0
            self._begin(now)
        self.playing = not self.playing
        self._last = self._rest_until = now

    def turn(self, way: int, now: float) -> None:
        """Pause, and go to the next step, of which the motion is shown, or to the end of the one before."""
        at = self.at + way
        self.playing = False
        if not 0 <= at < len(self.example.steps):
            return
        self.at = at
        self._begin(now)
        if way < 0:
            self._share = 1.0

    def use(self, example: Example) -> None:
        """Go on with the same example in other units."""
        self.example = example

    def advance(self, now: float) -> float | None:
        """Go on until now; returns in how many seconds something changes next, None: nothing does."""
        passed = min(max(now - self._last, 0.0), PATIENCE)
        self._last = now
        if not self.arrived:
            self._share = min(1.0, self._share + passed / MOTION_TIME)
            if self.arrived:
                self._rest(now)
            return 0.0
        if not self.playing or self.is_last:
            self.playing = False
            return None
        if now < self._rest_until:
            return self._rest_until - now
        self.at += 1
        self._begin(now)
        return 0.0

    def _begin(self, now: float) -> None:
        self._last = now
        self._share = 0.0 if self.step.moves else 1.0
        self._rest(now)

    def _rest(self, now: float) -> None:
        self._rest_until = now + REST + PER_LETTER * len(self.step.text + self.step.then)
