"""``kinboard ik --targets`` in a pipe: each target is answered as it arrives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.cli.pipes.poses import INVALID, NOTHING, Counted, Goal, PoseTable, Wrong, answered
from app.cli.pipes.sink import Sink, form_of, opened_sink
from app.cli.pipes.source import opened_source
from app.shared.answers.ik import IkAnswer, add_pendant, ik_answer
from kin import IKOptions, InputError, Robot, Status
from kin.ik import Task, solve
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
        table: the columns of targets in tables.
        strict: whether the first row that is no target ends the run.
        pendant: whether joint values are written as the arm's pendant shows them.
    """

    robot: Robot
    q_seed: Array | None
    options: Callable[[Task, int | None], IKOptions]
    frame: Callable[[str | None], Array]
    table: PoseTable
    strict: bool
    pendant: bool

    def best(self, goals: list[Goal]) -> Iterator[tuple[str, Array, str]]:
        """Status, best solution ``(n,)`` and reason of each target."""
        for task, group in groupby(goals, lambda goal: goal.task):
            targets = [goal._replace(T=T, wrong=wrong) for goal in group for T, _, wrong in [self._placed(goal)]]
            found = answered(self.robot, targets, self.options(task, 1), self.q_seed, self.strict, self.pendant)
            yield from zip(found.status, found.q, found.reason, strict=True)

    def answers(self, goals: list[Goal]) -> Iterator[IkAnswer | dict[str, Any]]:
        """The answers that REST gives to the targets; of a row that is none, status and reason."""
        for goal in goals:
            T, rounding, wrong = self._placed(goal)
            if wrong is None:
                try:
                    found = ik_answer(solve(self.robot, T, self.options(goal.task, None), self.q_seed, rounding))
                    if self.pendant:
                        add_pendant(self.robot, found)
                    yield found
                    continue
                except InputError as error:
                    if not error.field.startswith("target"):
                        raise
                    wrong = Wrong.of(error.renamed(f"{goal.place}{error.field.removeprefix('target')}"))
            if self.strict:
                raise wrong.error()
            yield {"status": INVALID, "reason": str(wrong.error()), "solutions": []}

    def _placed(self, goal: Goal) -> tuple[Array, float, Wrong | None]:
        """The target in the world frame, how rounded it is besides its entries there, and what is wrong."""
        try:
            frame = self.frame(goal.frame)
            if goal.wrong is not None or np.array_equal(frame, _WORLD):
                return goal.T, 0.0, goal.wrong
            T, rounding = read_pose(goal.T, POSE, goal.place, always=self.robot.n < 6)
        except InputError as error:
            return NOTHING, 0.0, Wrong.of(error)
        return frame @ T, rounding, None


def solve_rows(question: RowsQuestion, source: str, output: str, form: str | None) -> Counted:
    """Write the answer to each target of a file or of standard input.

    Raises:
        InputError: a file that cannot be read or written; with `strict`, a row that is no target.
    """
    counts = Counter[str]()
    question.frame(None)  # an unknown --frame is wrong for all
    heading = ["status", *(f"q{i + 1}" for i in range(question.robot.n)), "reason"]
    with opened_source(source, _FIELD) as opened:
        pieces = opened.goals(question.table, question.robot.maker)
        some = next(pieces)  # what is wrong at once leaves no file
        with opened_sink(output, form_of(output, form, opened.form), heading) as sink:
            while some:
                counts += Counter(_put(sink, question, [read() for read in some]))
                some = next(pieces, [])
    return Counted(counts.total(), counts[Status.SOLVED], counts[INVALID])


def _put(sink: Sink, question: RowsQuestion, goals: list[Goal]) -> list[str]:
    """Write the answers to some targets; returns their statuses."""
    if sink.form == "ndjson":
        answers = list(question.answers(goals))
        sink.answers(answers)
        return [each["status"] if isinstance(each, dict) else each.status for each in answers]
    rows = list(question.best(goals))
    if sink.form == "npy":
        sink.array(np.stack([q for _, q, _ in rows]))
    else:
        sink.rows([status, *q.tolist(), reason] for status, q, reason in rows)
    return [status for status, _, _ in rows]
