"""What a student has entered in an exercise, and the answer it makes.

An exercise is judged by ``app.exercises`` from plain data. Its form says how the page asks for them: ``fields``,
``table`` and ``postures`` are typed cells, ``options`` is one button of several, ``order`` is motions pressed
one after the other, ``program`` is one long text, and ``frame`` is a ghost that is dragged, or typed as x y z roll
pitch yaw. Only ``posture`` leaves nothing here, because the arm itself is the answer. What was entered stays on
the sheet after it was judged, so that a wrong answer is corrected rather than typed again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from app.exercises import Verdict
from app.exercises.contract import LONGEST_PROGRAM
from kin import InputError
from kin.poses import read_pose, roll_pitch_yaw
from kin.transforms import Array, wxyz_from_rotation
from kin.typed import LONGEST
from kin.units import Units

ROWS = 20  # of typed cells at most


@dataclass
class Sheet:
    """One exercise, from its opening to its next numbers.

    Attributes:
        cells: rows of typed texts.
        picked: indices of the motions that were put in order so far.
        chosen: the option that was chosen last.
        ghost: the pose (4, 4) of the frame that is placed, in metres.
        verdict: on the last answer.
        error: why it could not be read.
    """

    cells: list[list[str]] = field(default_factory=list)
    picked: list[int] = field(default_factory=list)
    chosen: int | None = None
    ghost: Array = field(default_factory=lambda: np.eye(4))
    verdict: Verdict | None = None
    error: str = ""

    def fill(self, value: object) -> None:
        """Take typed cells, cut to what an answer can need.

        Raises:
            kin.InputError: not rows of texts.
        """
        rows = value if isinstance(value, list) else []
        if not all(isinstance(row, list) and all(isinstance(text, str) for text in row) for row in rows[:ROWS]):
            raise InputError("cells", value, "rows of texts")
        self.cells = [
            [text[: 1 + (LONGEST_PROGRAM if len(row) == 1 else LONGEST)] for text in row[:ROWS]]
            for row in rows[:ROWS]
        ]

    def pick(self, option: object, count: int) -> None:
        """Take one of `count` motions as the next one, or take it and those after it back."""
        if type(option) is not int or not 0 <= option < count:
            raise InputError("motion", option, "the index of a motion")
        if option in self.picked:
            del self.picked[self.picked.index(option) :]
        else:
            self.picked.append(option)
        self.verdict = None

    def drag(self, T: Array, units: Units) -> None:
        """The ghost was dragged to a pose: the field shows it."""
        self.ghost = T
        point = [units.lengths.number(float(x), 0) for x in T[:3, 3]]
        angles = [units.angles.number(float(angle), 0) for angle in roll_pitch_yaw(T[:3, :3])]
        self.cells = [[" ".join([*point, *angles])]]

    def given(self, form: str, value: object, units: Units) -> object:
        """The answer in the form that the kind takes; `value` is what a pressed option sends.

        Raises `EntryError` for a pose that cannot be read.
        """
        first = self.cells[0] if self.cells else []
        match form:
            case "options":
                self.chosen = value if type(value) is int else None
                return value
            case "order":
                return list(self.picked)
            case "frame":
                if first:
                    self.ghost, _ = read_pose("pose", first[0], units, self.ghost)
                return [*self.ghost[:3, 3].tolist(), *wxyz_from_rotation(self.ghost[:3, :3]).tolist()]
            case "program":
                return first[0] if first else ""
            case "fields":
                return first
        return self.cells
