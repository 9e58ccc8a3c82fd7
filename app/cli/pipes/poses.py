"""Targets in rows: the columns of a table, what is wrong with a row, and the answers to the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin import IKOptions, InputError, Robot, Status, solve_ik_many
from kin.ik import Task
from kin.ik.problem import read_pose
from kin.poses import FORMS, SI, PoseForm, form_named
from kin.typed import EntryError

Array = NDArray[np.float64]
INVALID: Final = "invalid"  # the status of a row that is no target


NOTHING: Final = np.full((4, 4), np.nan)


@dataclass(frozen=True)
class PoseTable:
    """The columns of poses in a table: those of a form, in its units, or in metres and radians."""

    form: PoseForm = FORMS["wxyz"]

    @classmethod
    def named(cls, key: str | None) -> PoseTable:
        """The columns of the form of ``--form``."""
        form = FORMS["wxyz"] if key is None else form_named(key, "--form")
        if not form.names:
            expected = "a form whose numbers have names: " + ", ".join(
                k for k, each in FORMS.items() if each.names
            )
            raise InputError("--form", key, expected)
        return cls(form)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        return "x", "y", "z", *self.form.names

    def pose(self, numbers: Sequence[float], field: str) -> Array:
        """The pose ``(4, 4)`` of a row; raises `InputError` with the row."""
        columns = ", ".join(self.names)
        if not all(map(math.isfinite, numbers)):
            raise InputError(field, list(numbers), f"{len(self.names)} finite numbers: {columns}")
        units = self.form.units_of(SI)
        try:
            return self.form.pose([unit.read(number) for unit, number in zip(units, numbers, strict=True)])
        except EntryError as error:
            raise InputError(field, list(numbers), f"{columns}. {error.detail}") from None

    def rows(self, T: Array) -> list[list[float]]:
        """The numbers of poses ``(m, 4, 4)``."""
        scales = [unit.scale for unit in self.form.units_of(SI)]
        return [[v * scale for v, scale in zip(self.form.numbers(each), scales, strict=True)] for each in T]


class Wrong(NamedTuple):
    """An `InputError` as a value, which other processes can read."""

    field: str
    value: str
    expected: str

    @classmethod
    def of(cls, error: InputError) -> Wrong:
        """What an error says."""
        return cls(error.field, error.value, error.expected)

    def error(self) -> InputError:
        """The error again."""
        made = InputError(self.field, None, self.expected)
        made.value = self.value
        return made.renamed(self.field)


class Goal(NamedTuple):
    """One target.

    Attributes:
        place: of the row, for a message: ``--targets line 3``.
        task: what its form implies, "pose" for tables and arrays.
        T: in its frame ``(4, 4)``, as it was sent: its digits tell how closely it can be met.
        frame: name of its frame; None: that of ``--frame``.
        wrong: what is wrong with the row, None for a target.
    """

    place: str
    task: Task
    T: Array
    frame: str | None = None
    wrong: Wrong | None = None


class Answers(NamedTuple):
    """The best solutions ``(m, n)`` of rows, NaN where there is none; their statuses, and why there is none."""

    q: Array
    status: tuple[str, ...]
    reason: tuple[str, ...]


def invalid_rows(count: int, what: str) -> str:
    """How many rows are no targets or configurations, if there are any."""
    return f"; {count} {'row is' if count == 1 else 'rows are'} no {what} (column reason)" if count else ""


class Counted(NamedTuple):
    """How many rows there were, how many of them have an exact solution, and how many are no targets."""

    targets: int
    solved: int
    invalid: int


def answered(
    robot: Robot, targets: Sequence[Goal], options: IKOptions, q_seed: Array | None, strict: bool, pendant: bool
) -> Answers:
    """The answers to targets in the frame of the robot; `pendant`: with joint values as its pendant shows them.

    Raises:
        InputError: an option that does not fit the arm; with `strict`, the first row that is no target.
    """
    wrong = [target.wrong for target in targets]
    found = None
    for again in (False, True):
        if strict and (first := next(filter(None, wrong), None)) is not None:
            raise first.error()
        good = [i for i, each in enumerate(wrong) if each is None]
        try:
            T = np.stack([targets[i].T for i in good]) if good else None
            found = None if T is None else solve_ik_many(robot, T, options=options, q_seed=q_seed)
            break
        except InputError as error:
            if again or not error.field.startswith("targets["):
                raise
            for i in good:
                wrong[i] = _wrong(targets[i], options)
    q = np.full((len(targets), robot.n), np.nan)
    status, reason = [INVALID] * len(targets), ["" if each is None else str(each.error()) for each in wrong]
    if found is not None:
        q[good] = found.q
        for k, i in enumerate(good):
            status[i] = found.status[k].value
            reason[i] = "" if found.status[k] is Status.SOLVED else found[k].reason
    if pendant and robot.pendant_map is not None:
        q = robot.pendant_map.shown(q)
    return Answers(q, tuple(status), tuple(reason))


def _wrong(target: Goal, options: IKOptions) -> Wrong | None:
    """What is wrong with a target that the core refuses."""
    try:
        read_pose(target.T, options.coordinates.code)
    except InputError as error:
        return Wrong.of(error.renamed(f"{target.place}{error.field.removeprefix('target')}"))
    return None
