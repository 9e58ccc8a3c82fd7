"""``kinboard ik --targets`` in a pipe: each target is answered as it arrives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cli.pipes.sink import Sink, form_of, opened_sink
from app.cli.pipes.source import Goal, opened_source
from app.shared.answers.ik import IkAnswer, ik_answer
from kin import IKOptions, InputError, Robot, Status, Task, solve_ik_many
from kin.ik import solve
from kin.ik.problem import read_pose
from kin.solvers.contract import POSE

Array = NDArray[np.float64]
_FIELD = "--targets"
_WORLD = np.eye(4)


@dataclass(frozen=True)
class RowsQuestion:
    """What is asked of each target.

    Attributes:
        q_seed: ``(n,)``, None for the home configuration.
        options: of a task that targets imply, with so many solutions where nothing else was typed; None for all.
        frame: T_world_frame ``(4, 4)`` of a name; None for that of ``--frame``.
    """

    robot: Robot
    q_seed: Array | None
    options: Callable[[Task, int | None], IKOptions]
    frame: Callable[[str | None], Array]

    def best(self, goals: list[Goal], first: int) -> Iterator[Row]:
        """Status and best solution of each target; the first one has this place among all."""
        for task, group in groupby(goals, lambda goal: goal.task):
            some = list(group)
            T = np.stack([self._placed(goal, first + i)[0] for i, goal in enumerate(some)])
            try:
                found = solve_ik_many(self.robot, T, options=self.options(task, 1), q_seed=self.q_seed)
            except InputError as error:
                place, _, rest = error.field.removeprefix("targets[").partition("]")
                if not place.isdigit():
                    raise
                raise error.renamed(f"{_FIELD}[{first + int(place)}]{rest}") from None
            yield from map(Row, found.status, found.q)
            first += len(some)

    def answers(self, goals: list[Goal], first: int) -> Iterator[IkAnswer]:
        """The answers that REST gives to the targets."""
        for place, goal in enumerate(goals, first):
            T, rounding = self._placed(goal, place)
            try:
                yield ik_answer(solve(self.robot, T, self.options(goal.task, None), self.q_seed, rounding))
            except InputError as error:
                if not error.field.startswith("target"):
                    raise
                raise error.renamed(f"{_FIELD}[{place}]") from None

    def _placed(self, goal: Goal, place: int) -> tuple[Array, float]:
        """The target in the world frame, and how rounded it is besides the entries that it has there."""
        frame = self.frame(goal.frame)
        if np.array_equal(frame, _WORLD):
            return goal.T, 0.0
        T, rounding = read_pose(goal.T, POSE, f"{_FIELD}[{place}]", always=self.robot.n < 6)
        return frame @ T, rounding


class Row(NamedTuple):
    """The best solution ``(n,)`` of a target, NaN where there is none."""

    status: Status
    q: Array


def solve_rows(question: RowsQuestion, source: str, output: str, form: str | None) -> tuple[int, int]:
    """Write the answer to each target of a file or of standard input: (targets, how many are solved).

    Raises:
        InputError: a row that is no target, or a file that cannot be read or written.
    """
    done = solved = 0
    heading = ["status", *(f"q{i + 1}" for i in range(question.robot.n))]
    with opened_source(source, _FIELD) as opened:
        pieces = opened.goals()
        some = next(pieces)  # what is wrong at once leaves no file
        with opened_sink(output, form_of(output, form, opened.form), heading) as sink:
            while some:
                solved += _put(sink, question, some, done)
                done += len(some)
                some = next(pieces, [])
    return done, solved


def _put(sink: Sink, question: RowsQuestion, goals: list[Goal], first: int) -> int:
    """Write the answers to some targets; returns how many are solved."""
    if sink.form == "ndjson":
        answers = list(question.answers(goals, first))
        sink.answers(answers)
        return sum(answer.status == "solved" for answer in answers)
    rows = list(question.best(goals, first))
    if sink.form == "npy":
        sink.array(np.stack([row.q for row in rows]))
    else:
        sink.rows([row.status.value, *row.q.tolist()] for row in rows)
    return sum(row.status is Status.SOLVED for row in rows)
