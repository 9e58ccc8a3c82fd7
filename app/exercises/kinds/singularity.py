"""Name the singularity that the arm is at, or the direction that is lost there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import kin
from app.exercises import cell
from app.exercises.cell import DEGREE
from app.exercises.contract import Kind
from app.exercises.questions import Asked, Verdict, index, texts
from app.exercises.typed import read_number
from app.exercises.variant import Variant
from kin.ik import Singularity
from kin.ik.messages.singularity import CONDITIONS, LOSSES, short
from kin.transforms import Array
from kin.typed import EntryError
from kin.units import PLAIN, Units, fixed, general

AT = 1e-6  # rad, m or SI: closer than this is at the singularity
_LOST = 1e-6  # singular value of a lost direction


@dataclass(frozen=True)
class SingularityKind(Kind):
    """See the module."""

    name: ClassVar[str] = "singularity"
    about: ClassVar[str] = "The singularity is named, or the lost direction of the tool point is given."
    shows_posture: ClassVar[bool] = True

    asks: str = cell.choice("Asks for", "", ("name", "direction"))
    tolerance: float = cell.number("Tolerance, degrees", "Of a direction.", 3.0, DEGREE)

    def _known(self, variant: Variant) -> list[Singularity]:
        """The singularities of the arm by what aligns, in an order of the seed's."""
        found = {each.condition: each for each in reversed(kin.singularities(variant.robot, variant.q))}
        known = [each for each in found.values() if each.kind not in ("algorithmic", "jacobian")]
        known.sort(key=lambda each: each.condition)
        variant.draw("singularities").shuffle(known)
        return known

    def _lost(self, variant: Variant) -> Array:
        """The direction ``(3,)`` in which the tool point cannot move."""
        U, sizes, _ = np.linalg.svd(kin.jacobian(variant.robot, variant.q)[:3])
        if len(sizes) == 3 and sizes[1] > _LOST >= sizes[2]:
            return np.asarray(U[:, 2])
        raise ValueError(f"not exactly one direction of the tool point is lost: σ = {sizes.round(6).tolist()}")

    def asked(self, variant: Variant, units: Units) -> Asked:
        if self.asks == "direction":
            angle = units.angles.brief(self.tolerance)
            note = f"± {angle}. Only the direction counts, not its length or sign."
            return Asked("fields", ("x", "y", "z"), ("", "", ""), note)
        labels = []
        for each in self._known(variant):
            words = CONDITIONS[each.condition]
            labels.append(f"{words[0].upper()}{words[1:]}: {LOSSES[each.lost]}.")
        return Asked("options", tuple(labels))

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        if self.asks == "direction":
            return self._judge_direction(variant, given, units)
        known = self._known(variant)
        chosen = known[index(given, len(known))]
        if chosen.distance <= AT:
            return Verdict(True, f"{short(chosen, units).capitalize()}: {LOSSES[chosen.lost]}.")
        distance = {"rad": units.angles, "m": units.lengths}.get(chosen.unit, PLAIN).text(chosen.distance, 1)
        at = f" It would be at {short(chosen, units)}." if chosen.met_at else ""
        return Verdict(False, f"The arm is {distance} away from that singularity.{at}")

    def _judge_direction(self, variant: Variant, given: object, units: Units) -> Verdict:
        values = np.array([read_number(text, PLAIN) for text in texts(given, 3, "x, y and z")])
        length = float(np.linalg.norm(values))
        if not 1e-6 < length < 1e6:
            raise EntryError(
                "The answer was not read", "A direction needs a length that is not zero, such as 0, 0, 1."
            )
        u, lost = values / length, self._lost(variant)
        angle = math.acos(min(1.0, abs(float(u @ lost))))
        if angle <= self.tolerance:
            return Verdict(True, "In this direction no joint moves the tool point: uᵀ J is zero.")
        J = kin.jacobian(variant.robot, variant.q)[:3]
        joint = int(np.argmax(np.abs(u @ J)))
        speed = abs(float((u @ J)[joint]))
        verb = "turning at 1 rad/s" if variant.robot.revolute[joint] else "sliding at 1 m/s"
        return Verdict(
            False,
            f"The tool point can move in this direction: joint {joint + 1}, {verb}, "
            f"moves it by {general(speed, 3)} m/s.",
        )

    def answer(self, variant: Variant) -> object:
        if self.asks == "direction":
            return [repr(float(value)) for value in self._lost(variant)]
        return next((i for i, each in enumerate(self._known(variant)) if each.distance <= AT), 0)

    def solution(self, variant: Variant, units: Units) -> str:
        if self.asks == "direction":
            shown = ", ".join(fixed(float(value)) for value in self._lost(variant))
            return f"({shown}), or the opposite."
        at = [each for each in self._known(variant) if each.distance <= AT]
        return " ".join(f"{short(each, units).capitalize()}: {LOSSES[each.lost]}." for each in at)
