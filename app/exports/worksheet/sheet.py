"""What a worksheet shows, in whatever format."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from app.exports.snippets import row_transform
from kin import Joint, Robot, fk
from kin.transforms import Array
from kin.units import Units, fixed, general

# The table and the matrices are filled in, or their product alone; or the pose is given, and the configuration is
# to be found.
Left = Literal["nothing", "table", "pose", "configuration"]
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_JOINT = re.compile(r"(?<=θ)\d+")


@dataclass(frozen=True)
class Question:
    """A question and its solution.

    Attributes:
        options: to choose from; none: the answer is written.
        unit: of a written number.
    """

    prompt: str
    solution: str
    options: tuple[str, ...] = ()
    unit: str = ""


@dataclass(frozen=True)
class Part:
    """A step of a lesson, or its check: a text, and questions about it."""

    title: str
    text: str = ""
    questions: tuple[Question, ...] = ()


@dataclass(frozen=True)
class Formula:
    """An equation, typeset twice; `solution`: it belongs to the solutions."""

    title: str
    mathml: str
    latex: str
    solution: bool = False


@dataclass(frozen=True)
class Row:
    """One row of the DH table as text: cells θ, d, a, α, limits, and the cell that the joint moves."""

    number: int
    name: str
    cells: tuple[str, str, str, str]
    limits: str
    moved: int | None


@dataclass(frozen=True, eq=False)
class Sheet:
    """An arm at a configuration, and what is asked about it.

    Attributes:
        title: of the lesson, or of the sheet.
        goal: in one sentence; may be empty.
        q: configuration ``(n,)``.
        left: what is left to the student besides the questions.
    """

    title: str
    robot: Robot
    q: Array
    units: Units
    goal: str = ""
    parts: tuple[Part, ...] = ()
    formulas: tuple[Formula, ...] = ()
    left: Left = "nothing"

    @property
    def questions(self) -> list[Question]:
        """All questions, in order."""
        return [question for part in self.parts for question in part.questions]

    @property
    def has_solutions(self) -> bool:
        """Whether anything is left to the student."""
        return self.left != "nothing" or bool(self.questions)

    @property
    def heads(self) -> tuple[str, str, str, str]:
        """The heads of the table, with units."""
        angle, length = self.units.angles.name, self.units.lengths.name
        names = ("θ", "d", "a", "α") if self.robot.convention == "standard" else ("θ", "d", "aᵢ₋₁", "αᵢ₋₁")
        return tuple(f"{n} ({u})" for n, u in zip(names, (angle, length, length, angle), strict=True))  # type: ignore[return-value]

    @cached_property
    def values(self) -> list[tuple[str, str]]:
        """Each joint's variable and its value, with the unit."""
        rows, units = self.robot.joint_rows, self.units
        return [
            (
                _variable(self.robot.rows[i].kind, joint),
                units.of(self.robot.rows[i].kind == "revolute").text(value),
            )
            for joint, (i, value) in enumerate(zip(rows, self.q.tolist(), strict=True))
        ]

    @cached_property
    def rows(self) -> list[Row]:
        """The table, with the joints' variables as symbols: θ₃ − 90.0."""
        out, joint, units = [], -1, self.units
        for number, row in enumerate(self.robot.rows, 1):
            numbers = [
                units.of(k in (0, 3)).number(value) for k, value in enumerate((row.theta, row.d, row.a, row.alpha))
            ]
            moved, limits = None, "–"
            if row.moves:
                joint += row.driven
                moved = 0 if row.kind == "revolute" else 1
                offset = row.theta if moved == 0 else row.d
                unit = units.of(moved == 0)
                sign, size = ("−" if offset < 0.0 else "+"), unit.number(abs(offset))
                variable = self._variable_of(row) if row.follows else _variable(row.kind, joint)
                numbers[moved] = f"{variable} {sign} {size}" if offset else variable
                if row.limits is not None:
                    limits = " … ".join(unit.number(limit) for limit in row.limits)
            cells = (numbers[0], numbers[1], numbers[2], numbers[3])
            out.append(Row(number, row.name, cells, limits, moved))
        return out

    def _variable_of(self, row: Joint) -> str:
        """The variable of a row that follows a joint: −θ₂, 0.5 θ₂."""
        names = [joint.name for joint in self.robot.joints]
        index = names.index(row.follows)
        leader = _variable(self.robot.joints[index].kind, index)
        return {1.0: leader, -1.0: f"−{leader}"}.get(row.ratio, f"{general(row.ratio)} {leader}")

    @cached_property
    def values_of_rows(self) -> dict[int, float]:
        """The value of each moving row, by its index."""
        return dict(zip(self.robot.moving_rows, self.robot.expand(self.q).tolist(), strict=True))

    @cached_property
    def matrices(self) -> list[Array]:
        """A of every row ``(4, 4)``, metres."""
        values = self.values_of_rows
        return [
            row_transform(row, values.get(i, 0.0), self.robot.convention) for i, row in enumerate(self.robot.rows)
        ]

    @cached_property
    def pose(self) -> Array:
        """The tool's pose ``(4, 4)``, metres."""
        return fk(self.robot, self.q)

    @property
    def product(self) -> str:
        """How the pose comes from the matrices, in words."""
        ends = [np.array_equal(T, np.eye(4)) for T in (self.robot.T_world_base, self.robot.T_last_tool)]
        names = [f"A{str(k).translate(SUBSCRIPTS)}" for k in range(1, len(self.robot.rows) + 1)]
        return " ".join([*([] if ends[0] else ["B"]), *names, *([] if ends[1] else ["H"])])

    @property
    def ends(self) -> list[tuple[str, str, Array]]:
        """Base and tool that the product names, with their meaning: those that are not the identity."""
        found = (
            ("B", "the base in the world", self.robot.T_world_base),
            ("H", "the tool in the last frame", self.robot.T_last_tool),
        )
        return [(name, words, T) for name, words, T in found if not np.array_equal(T, np.eye(4))]

    def entries(self, T: Array) -> list[list[str]]:
        """A pose as text: directions with four decimals, the position in the unit of lengths."""
        unit = self.units.lengths
        top = [[*(fixed(v, 4) for v in line[:3]), unit.number(line[3])] for line in T[:3].tolist()]
        return [*top, ["0", "0", "0", "1"]]


def indexed(text: str) -> str:
    """A sentence with the numbers of joint variables as indices: θ5 as θ₅."""
    return _JOINT.sub(lambda number: number[0].translate(SUBSCRIPTS), text)


def _variable(kind: str, joint: int) -> str:
    return ("θ" if kind == "revolute" else "d") + str(joint + 1).translate(SUBSCRIPTS)
