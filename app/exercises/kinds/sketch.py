"""Sketch the velocity of a motion: its values at equal times, joined by straight lines.

The area under the sketch is the way, and its slope the acceleration, so that any sketch that keeps the limits and
covers the way is right.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from app.exercises import cell
from app.exercises.contract import Kind, typed
from app.exercises.expressions import Expression
from app.exercises.fields import Words
from app.exercises.questions import Asked, Verdict, texts
from app.exercises.typed import read_number
from app.exercises.variant import Variant
from kin import KinematicsError
from kin.transforms import Array
from kin.units import Unit, Units, general

FEWEST, MOST = 3, 12  # parts of the time
NEAR = 0.02  # of the way, and of each limit, that a sketch may be off


@dataclass(frozen=True)
class Sketch:
    """The numbers of a variant, in radians, metres and seconds.

    Attributes:
        turns: whether the joint turns; it slides otherwise.
        times: ``(k,)``, from 0 to the end.
        way: to be covered.
        velocity, acceleration: their limits.
    """

    turns: bool
    times: Array
    way: float
    velocity: float
    acceleration: float

    def unit(self, units: Units) -> Unit:
        """Of velocities, for the reader."""
        return units.of(self.turns).per_second()


@dataclass(frozen=True)
class SketchKind(Kind):
    """See the module."""

    name: ClassVar[str] = "sketch"
    about: ClassVar[str] = "The velocity of a motion from rest to rest is sketched: its values at equal times."
    in_words: ClassVar[bool] = True

    turns: Expression = cell.expression("The joint turns", "0: it slides.", "1")
    way: Expression = cell.expression("Way")
    time: Expression = cell.expression("Time, s")
    parts: int = cell.whole("Parts", "Of the time; there is a value at the end of each.", FEWEST, MOST, 6)
    velocity: Expression = cell.expression("Largest velocity", "In rad/s or m/s.")
    acceleration: Expression = cell.expression("Largest acceleration", "In rad/s² or m/s².")
    method: Words = cell.words("Method", "How one is found.")

    def sketch(self, variant: Variant) -> Sketch:
        """The numbers of a variant."""
        times = np.linspace(0.0, variant.number(self.time), self.parts + 1)
        way, velocity, acceleration = map(variant.number, (self.way, self.velocity, self.acceleration))
        return Sketch(bool(variant.number(self.turns)), times, way, velocity, acceleration)

    def values(self, variant: Variant, given: object, units: Units) -> Array | None:
        """The velocities ``(k,)`` of an answer; None if it cannot be read."""
        try:
            return self._read(variant, given, units)
        except KinematicsError:
            return None

    def _read(self, variant: Variant, given: object, units: Units) -> Array:
        sketch = self.sketch(variant)
        unit = sketch.unit(units)
        cells = texts(given, len(sketch.times), "the velocity at each time")
        return np.array([read_number(text, unit) for text in cells])

    def asked(self, variant: Variant, units: Units) -> Asked:
        sketch = self.sketch(variant)
        labels = tuple(f"v({general(t, 3)} s)" for t in sketch.times.tolist())
        unit, base = sketch.unit(units), units.of(sketch.turns)
        limits = f"at most {unit.brief(sketch.velocity)} and {base.per_second(2).brief(sketch.acceleration)}"
        way = f"{base.brief(sketch.way)} ± 2 %, from rest to rest"
        note = f"Straight lines join the values. Required: {way}, {limits}."
        return Asked("fields", labels, (unit.name,) * len(labels), note)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        sketch, v = self.sketch(variant), self._read(variant, given, units)
        unit, base = sketch.unit(units), units.of(sketch.turns)
        slope, step = base.per_second(2), float(sketch.times[1])
        fastest, steepest = float(np.abs(v).max()), float(np.abs(np.diff(v)).max()) / step
        covered = step * float(v.sum() - 0.5 * (v[0] + v[-1]))
        rest = max(abs(float(v[0])), abs(float(v[-1])))
        parts = [
            (rest <= NEAR * sketch.velocity, "It begins and ends at rest: the first and the last value are zero."),
            (
                fastest <= (1.0 + NEAR) * sketch.velocity,
                f"The largest velocity is {unit.brief(fastest)}; its limit {unit.brief(sketch.velocity)}.",
            ),
            (
                steepest <= (1.0 + NEAR) * sketch.acceleration,
                f"The steepest line is an acceleration of {slope.brief(steepest)}; the limit is "
                f"{slope.brief(sketch.acceleration)}.",
            ),
            (
                abs(covered - sketch.way) <= NEAR * abs(sketch.way),
                f"The area under the sketch is {base.brief(covered)}; the way is {base.brief(sketch.way)}.",
            ),
        ]
        verdict = Verdict.of(parts, f"It covers {base.brief(covered)} from rest to rest, within both limits.")
        return verdict if verdict.right else replace(verdict, way=variant.text(self.method, units))

    def example(self, variant: Variant) -> Array:
        """The velocities ``(k,)`` of a sketch with two equal ramps, as flat as the velocity's limit allows."""
        sketch = self.sketch(variant)
        step, k = float(sketch.times[1]), self.parts
        best = np.zeros(k + 1)
        for ramp in range(k // 2, 0, -1):
            shape = np.minimum(1.0, np.minimum(np.arange(k + 1), np.arange(k, -1, -1)) / ramp)
            best = shape * sketch.way / (float(shape[1:-1].sum()) * step)
            if abs(float(best.max())) <= sketch.velocity:
                break
        return np.asarray(best)

    def answer(self, variant: Variant) -> object:
        unit = self.sketch(variant).unit(Units())
        return [typed(float(v), unit) for v in self.example(variant)]

    def solution(self, variant: Variant, units: Units) -> str:
        sketch = self.sketch(variant)
        unit = sketch.unit(units)
        shown = ", ".join(general(float(v) * unit.scale, 3) for v in self.example(variant))
        return f"{variant.text(self.method, units)} For instance {shown} {unit.name}."
