"""Write a program that drives a line within limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import kin
from app.exercises import cell
from app.exercises.cell import MILLIMETRE
from app.exercises.contract import LONGEST_PROGRAM, Kind
from app.exercises.expressions import Expression
from app.exercises.questions import Asked, Verdict
from app.exercises.variant import Variant
from kin import InputError
from kin.motion import Motion
from kin.transforms import Array
from kin.units import Units, general

MOST_SEGMENTS = 12
_SAMPLES = 200


@dataclass(frozen=True)
class ProgramKind(Kind):
    """See the module. The program begins at the exercise's configuration and ends at its target point."""

    name: ClassVar[str] = "program"
    about: ClassVar[str] = "A program is written that drives the tool along a line within limits."
    shows_posture: ClassVar[bool] = True

    straight: float = cell.number("Off the line at most, mm", "", 1.0, MILLIMETRE)
    arrives: float = cell.number("Off the target at most, mm", "", 1.0, MILLIMETRE)
    longest: Expression = cell.expression("Longest time, s", "0: no limit.", "0", "time")
    fastest: Expression = cell.expression("Fastest tool, m/s", "0: no limit.", "0", "tool_speed")

    def asked(self, variant: Variant, units: Units) -> Asked:
        conditions = [f"the tool point within {units.lengths.brief(self.straight)} of the straight line"]
        if longest := variant.number(self.longest):
            conditions.append(f"at most {general(longest, 3)} s")
        if fastest := variant.number(self.fastest):
            conditions.append(f"the tool point at most {general(fastest, 3)} m/s")
        start = _text(variant, [_segment("ptp", kin.fk(variant.robot, variant.q)[:3, 3])])
        return Asked("program", note=f"Required: {'; '.join(conditions)}.", start=start, goal=variant.pose)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        if not isinstance(given, str) or len(given) > LONGEST_PROGRAM:
            raise InputError("answer", given, f"a program of at most {LONGEST_PROGRAM} characters")
        program = kin.motion.parse_program(given, variant.robot)
        if len(program.segments) > MOST_SEGMENTS:
            raise InputError("segments", len(program.segments), f"at most {MOST_SEGMENTS} segments")
        motion = kin.plan_motion(variant.robot, program, variant.q)
        if not motion.planned:
            return Verdict(False, motion.explain(units))
        return Verdict.of(self._parts(variant, motion, units), "The program drives the line as asked.")

    def _parts(self, variant: Variant, motion: Motion, units: Units) -> list[tuple[bool, str]]:
        times = np.linspace(0.0, motion.duration, _SAMPLES)
        points = np.asarray(kin.fk_positions(variant.robot, motion.sample(times).q))
        start, end = kin.fk(variant.robot, variant.q)[:3, 3], variant.pose[:3, 3]
        missed = float(np.linalg.norm(points[-1] - end))
        off, worst = _farthest(points, start, end)
        away = units.lengths.text(off, 0)
        parts = [
            (
                missed <= self.arrives,
                "The tool arrives at the end of the line."
                if missed <= self.arrives
                else f"The program ends {units.lengths.text(missed, 0)} from the end of the line.",
            ),
            (
                off <= self.straight,
                "The tool keeps to the line."
                if off <= self.straight
                else f"At {times[worst]:.1f} s the tool point is {away} off the line.{_ptp(motion)}",
            ),
        ]
        if longest := variant.number(self.longest):
            fits = motion.duration <= longest + 1e-6
            allowed = "" if fits else f"; {general(longest, 3)} s are allowed"
            parts.append((fits, f"It takes {motion.duration:.2f} s{allowed}."))
        if fastest := variant.number(self.fastest):
            speed = max(peak.peak for peak in motion.peaks if peak.quantity == "tool_speed")
            fits = speed <= fastest * (1.0 + 1e-3)
            allowed = "" if fits else f"; {general(fastest, 3)} m/s are allowed"
            parts.append((fits, f"The tool point reaches {general(speed, 3)} m/s{allowed}."))
        return parts

    def answer(self, variant: Variant) -> object:
        extra = f"tool_speed = {fastest!r}\n" if (fastest := variant.number(self.fastest)) else ""
        x, y, z = variant.pose[:3, 3].tolist()
        return f'[[segments]]\nkind = "lin"\nposition = [{x!r}, {y!r}, {z!r}]\n{extra}'

    def solution(self, variant: Variant, units: Units) -> str:
        end = _segment("lin", variant.pose[:3, 3])
        if fastest := variant.number(self.fastest):
            end += f"tool_speed = {1000.0 * fastest:g}\n"
        return f"One program:\n{_text(variant, [end])}"


def _segment(kind: str, point: Array) -> str:
    x, y, z = (1000.0 * point).round(1).tolist()
    return f'[[segments]]\nkind = "{kind}"\nposition = [{x:g}, {y:g}, {z:g}]\n'


def _text(variant: Variant, segments: list[str]) -> str:
    return 'units = { length = "mm", angle = "deg" }\n\n' + "\n".join(segments)


def _farthest(points: Array, start: Array, end: Array) -> tuple[float, int]:
    """The largest distance of points ``(m, 3)`` from the segment between two points, and where it is."""
    way = end - start
    share = np.clip((points - start) @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
    gaps = np.linalg.norm(points - start - share[:, None] * way, axis=1)
    worst = int(np.argmax(gaps))
    return float(gaps[worst]), worst


def _ptp(motion: Motion) -> str:
    kinds = {segment.kind for segment in motion.segments}
    return " A PTP is straight in the joints, not in space: use lin." if "ptp" in kinds else ""
