"""A worked example with its values: poses, words, and how far it has come. It knows no page."""

from __future__ import annotations

from dataclasses import dataclass, replace

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


@dataclass(frozen=True, eq=False)
class Player:
    """How far an example has come.

    Attributes:
        at: the index of the step on show.
        playing: whether it goes on by itself after this step.
        moved: the share of the time of its motion that is over.
    """

    example: Example
    at: int = 0
    playing: bool = True
    moved: float = 0.0

    @property
    def step(self) -> ExampleStep:
        """The step on show."""
        return self.example.steps[self.at]

    @property
    def arrived(self) -> bool:
        """Whether the motion of the step is at its end."""
        return self.moved == 1.0 or not self.step.moves

    @property
    def share(self) -> float:
        """The share of the way that is behind, which begins and ends gently."""
        moved = 1.0 if self.arrived else self.moved
        return moved * moved * (3.0 - 2.0 * moved)

    @property
    def is_last(self) -> bool:
        """Whether there is no further step."""
        return self.at == len(self.example.steps) - 1

    @property
    def goes_on(self) -> bool:
        """Whether the next step follows by itself, after `rest`."""
        return self.playing and not self.is_last

    @property
    def rest(self) -> float:
        """Seconds of rest at the end of the step, to let its words be read."""
        return REST + PER_LETTER * len(self.step.text + self.step.then)

    def toggled(self) -> Player:
        """Paused, or going on; at the end, at its beginning again."""
        if self.is_last and self.arrived:
            return Player(self.example)
        return replace(self, playing=not self.playing)

    def turned(self, way: int) -> Player:
        """Paused at the next step, of which the motion is shown, or at the end of the one before."""
        at = self.at + way
        if not 0 <= at < len(self.example.steps):
            return replace(self, playing=False)
        return replace(self, at=at, moved=0.0 if way > 0 else 1.0, playing=False)

    def followed(self) -> Player:
        """At the next step."""
        return replace(self, at=self.at + 1, moved=0.0)

    def after(self, seconds: float) -> Player:
        """Later, in the motion of the step."""
        return replace(self, moved=min(1.0, self.moved + seconds / MOTION_TIME))
