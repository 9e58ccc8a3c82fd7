"""Find all solutions of a target."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import kin
from app.exercises import cell
from app.exercises.cell import DEGREE
from app.exercises.contract import Kind, typed
from app.exercises.poses import errors
from app.exercises.questions import Asked, Verdict
from app.exercises.typed import read_number
from app.exercises.variant import Variant
from kin import IKOptions, InputError
from kin.angles import wrapped
from kin.ik import Task
from kin.ik.details import Solved
from kin.ik.options import TASKS
from kin.transforms import Array, vector_angle
from kin.typed import LONGEST, EntryError
from kin.units import Units

MOST_ROWS = 16
_POSITION, _ROTATION = 0.01, math.radians(2.0)  # a row reaches the target within these


@dataclass(frozen=True)
class SolutionsKind(Kind):
    """See the module. No row at all says that there is no solution."""

    name: ClassVar[str] = "solutions"
    about: ClassVar[str] = "All configurations that reach a target are typed, one per row."

    task: Task = cell.choice("What must match", "", TASKS, "pose")
    rows: int = cell.whole("Rows", "Of the form.", 1, MOST_ROWS, 4)
    tolerance: float = cell.number("Tolerance, degrees", "", 2.0, DEGREE)

    def _solutions(self, variant: Variant) -> list[Array]:
        found = kin.ik.solve(variant.robot, variant.pose, IKOptions(task=self.task), variant.robot.q_home)
        if not found.complete:
            raise ValueError("the solutions of this arm and task are not all known")
        if isinstance(found.details, Solved) and found.details.infinite:
            raise ValueError("infinitely many configurations meet the target, so that no list has them all")
        return [solution.q for solution in found.solutions]

    def asked(self, variant: Variant, units: Units) -> Asked:
        robot = variant.robot
        labels = tuple(f"joint {i + 1}" for i in range(robot.n))
        names = tuple(units.of(bool(turns)).name for turns in robot.revolute)
        note = (
            f"± {units.angles.brief(self.tolerance)}, inside the limits. One solution per row; leave the others "
            "empty. No row at all means that there is no solution."
        )
        return Asked("postures", labels, names, note, self.rows, goal=variant.pose)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        rows = self._read(variant, given, units)
        solutions = self._solutions(variant)
        open_ = list(range(len(solutions)))
        parts: list[tuple[bool, str]] = []
        for number, q in rows:
            match = self._match(variant, q, solutions)
            if match is None:
                parts.append((False, f"Row {number}: {self._why(variant, q, solutions, units)}"))
            elif match in open_:
                open_.remove(match)
                parts.append((True, f"Row {number} is a solution."))
            else:
                parts.append((False, f"Row {number} is one of the solutions above once more."))
        found = len(solutions) - len(open_)
        if not open_ and all(fine for fine, _ in parts):
            count = len(solutions)
            said = (
                "There is no solution."
                if not count
                else "This is the only one."
                if count == 1
                else f"These are all {count}."
            )
            return Verdict(True, said, parts=tuple(parts))
        wrong = [reason for fine, reason in parts if not fine]
        missing = "" if not open_ else "There is another solution." if found else "There is a solution."
        if found and not wrong and len(open_) > 1:
            missing = "There are more solutions. Which joint can be bent the other way?"
        share = found / (len(solutions) + len(wrong)) if solutions else 0.0
        return Verdict(False, " ".join(filter(None, [*wrong[:1], missing])), round(share, 3), tuple(parts))

    def _read(self, variant: Variant, given: object, units: Units) -> list[tuple[int, Array]]:
        """The rows that are not empty, with their numbers."""
        n = variant.robot.n
        if not isinstance(given, list | tuple) or len(given) > MOST_ROWS:
            raise InputError("answer", given, f"up to {MOST_ROWS} rows of {n} texts")
        rows = []
        for number, row in enumerate(given, 1):
            if not isinstance(row, list | tuple) or len(row) != n or not all(isinstance(x, str) for x in row):
                raise InputError(f"answer[{number - 1}]", row, f"{n} texts, one per joint")
            cells = [text[: LONGEST + 1].strip() for text in row]
            if not any(cells):
                continue
            try:
                values = [
                    read_number(text, units.of(bool(turns)))
                    for text, turns in zip(cells, variant.robot.revolute, strict=True)
                ]
            except EntryError as error:
                raise EntryError(f"Row {number} was not read", error.detail) from None
            rows.append((number, np.array(values)))
        return rows

    def _match(self, variant: Variant, q: Array, solutions: list[Array]) -> int | None:
        """The solution that a row means."""
        turns = variant.robot.revolute
        for i, solution in enumerate(solutions):
            gap = np.abs(np.where(turns, wrapped(q - solution), q - solution))
            if (gap <= np.where(turns, self.tolerance, 2e-3)).all() and variant.robot.in_limits(q, self.tolerance):
                return i
        return None

    def _reaches(self, variant: Variant, q: Array) -> bool:
        T = kin.fk(variant.robot, q)
        off, turned = errors(T, variant.pose)
        if self.task == "approach":
            turned = float(vector_angle(T[:3, 2], variant.pose[:3, 2]))
        return off <= _POSITION and (self.task == "position" or turned <= _ROTATION)

    def _why(self, variant: Variant, q: Array, solutions: list[Array], units: Units) -> str:
        robot = variant.robot
        if self._reaches(variant, q):
            outside = [i + 1 for i in range(robot.n) if not robot.lower[i] <= q[i] <= robot.upper[i]]
            if outside:
                low, high = (
                    units.of(bool(robot.revolute[outside[0] - 1])).brief(float(limits[outside[0] - 1]))
                    for limits in (robot.lower, robot.upper)
                )
                return f"it reaches the target, but joint {outside[0]} is outside its limits, {low} … {high}."
            return "it reaches the target only roughly."
        for i in range(robot.n):
            flipped = q.copy()
            flipped[i] = -flipped[i]
            if self._match(variant, flipped, solutions) is not None:
                return f"this is a solution with joint {i + 1} negated."
        if (
            units.degrees
            and self._match(variant, np.where(robot.revolute, q * (180.0 / math.pi), q), solutions) is not None
        ):
            return "these are radians; the unit is degrees. Type rad after a number to give radians."
        off = float(np.linalg.norm(kin.fk(robot, q)[:3, 3] - variant.pose[:3, 3]))
        return f"the tool is {units.lengths.text(off, 0)} from the target there."

    def answer(self, variant: Variant) -> object:
        units = Units()
        return [
            [typed(float(v), units.of(bool(turns))) for v, turns in zip(q, variant.robot.revolute, strict=True)]
            for q in self._solutions(variant)
        ]

    def solution(self, variant: Variant, units: Units) -> str:
        rows = [
            "("
            + ", ".join(
                units.of(bool(turns)).text(float(v), 1) for v, turns in zip(q, variant.robot.revolute, strict=True)
            )
            + ")"
            for q in self._solutions(variant)
        ]
        return f"{'; '.join(rows)}." if rows else "There is no solution."
