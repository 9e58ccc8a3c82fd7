"""Predict where a frame goes: place a ghost of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import kin
from app.exercises import cell
from app.exercises.cell import DEGREE, MILLIMETRE
from app.exercises.contract import Kind, numbers
from app.exercises.fields import Fields
from app.exercises.poses import Elementary, as_numbers, errors, list_of_motions, pose_text, product
from app.exercises.questions import Asked, Verdict
from app.exercises.variant import Variant
from kin import InputError
from kin.transforms import Array, pose_from_position_wxyz
from kin.units import Units

_CLOSE = 1e-9


@dataclass(frozen=True)
class FrameKind(Kind):
    """See the module. The frame is that of a row of the arm, or is moved by elementary motions."""

    name: ClassVar[str] = "frame"
    about: ClassVar[str] = "A ghost of a frame is placed where the frame will be."

    motions: tuple[Elementary, ...] = list_of_motions(least=0)
    row: int = cell.whole("Or the frame of row", "Instead of motions.", 0, 32, 0)
    fixed_axes: bool = cell.flag("About the axes of the base", "Otherwise about the frame’s own.")
    position_tolerance: float = cell.number("Accepted distance, mm", "", 10.0, MILLIMETRE)
    rotation_tolerance: float = cell.number("Accepted rotation, degrees", "", 5.0, DEGREE)

    def check(self, table: Fields) -> None:
        if bool(self.motions) == bool(self.row):
            valid = "either motions, or the row whose frame is asked"
            raise table.refuse("motions", table.get("motions"), valid)

    def _right(self, variant: Variant) -> Array:
        if self.row:
            frames = kin.link_frames(variant.robot, variant.q)
            if self.row > len(frames):
                raise ValueError(f"row {self.row} does not exist: the arm has {len(frames)} rows")
            return np.asarray(frames[self.row - 1])
        matrices = [motion.matrix(variant) for motion in self.motions]
        return product(matrices[::-1] if self.fixed_axes else matrices)

    def _wrong(self, variant: Variant, units: Units) -> Iterator[tuple[Array, str]]:
        """Where usual mistakes put the frame, and what is said about them."""
        robot = variant.robot
        if self.row:
            for i in range(robot.n):
                q = variant.q.copy()
                q[i] = -q[i]
                yield kin.link_frames(robot, q)[self.row - 1], f"This is the frame with joint {i + 1} negated."
            rest = kin.link_frames(robot, np.zeros(robot.n))[self.row - 1]
            yield rest, "This is where the frame is with all joints at zero."
            for i, T in enumerate(kin.link_frames(robot, variant.q)):
                if i + 1 != self.row:
                    yield T, f"This is frame {i + 1}. Frame {self.row} is asked."
            return
        matrices = [motion.matrix(variant) for motion in self.motions]
        axes = "its own axes" if self.fixed_axes else "the axes of the base"
        right = "the axes of the base" if self.fixed_axes else "its own axes"
        yield (
            product(matrices if self.fixed_axes else matrices[::-1]),
            f"This is where the frame goes if each motion is about {axes}. Here they are about {right}.",
        )
        for k, motion in enumerate(self.motions):
            flipped = [*matrices[:k], motion.matrix(variant, -1.0), *matrices[k + 1 :]]
            way = "turn" if motion.turns else "slide"
            sense = "Positive turns are anticlockwise seen from the tip of the axis." if motion.turns else ""
            yield (
                product(flipped[::-1] if self.fixed_axes else flipped),
                f"{way.capitalize()} {k + 1} goes the other way. {sense}".rstrip(),
            )
        yield np.eye(4), "The frame has not moved from where it began."

    def asked(self, variant: Variant, units: Units) -> Asked:
        off, angle = units.lengths.brief(self.position_tolerance), units.angles.brief(self.rotation_tolerance)
        return Asked("frame", note=f"± {off}, ± {angle}")

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        values = numbers(given, 7, "x, y, z in metres and a quaternion w, x, y, z")
        size = float(np.linalg.norm(values[3:]))
        if size < 1e-6:
            raise InputError("answer", given, "a quaternion that is not zero")
        placed = pose_from_position_wxyz(values[:3], values[3:] / size)
        right = self._right(variant)
        off, angle = errors(placed, right)
        here, turned = off <= self.position_tolerance, angle <= self.rotation_tolerance
        if here and turned:
            return Verdict(True, f"The frame goes there: {pose_text(right, units)}.")
        credit = 0.5 * (here + turned)
        for wrong, reason in self._wrong(variant, units):
            if max(errors(wrong, right)) < _CLOSE:
                continue
            apart, twisted = errors(placed, wrong)
            if apart <= self.position_tolerance and twisted <= self.rotation_tolerance:
                return Verdict(False, reason, credit)
        if here:
            return Verdict(
                False, f"The origin is right. The axes are off by {units.angles.text(angle, 0)}.", credit
            )
        away = units.lengths.text(off, 0)
        if turned:
            return Verdict(False, f"The axes point the right way. The origin is {away} away.", credit)
        return Verdict(False, f"The origin is {away} away, and the axes by {units.angles.text(angle, 0)}.", credit)

    def answer(self, variant: Variant) -> object:
        return as_numbers(self._right(variant))

    def solution(self, variant: Variant, units: Units) -> str:
        return f"{pose_text(self._right(variant), units)}."
