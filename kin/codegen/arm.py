"""One arm as a program: its constants, the instances of the entries, and the room that all arrays need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kin.angles import TURN
from kin.codegen import entries
from kin.codegen.families import BOUNDS, Alone, alone, needs_python
from kin.codegen.rooms import Rooms
from kin.codegen.source import OutsideSubsetError, plain
from kin.codegen.tree import Instance
from kin.codegen.types import BOOL, FLOAT, INT, ArrayOf, Kernel, TupleOf
from kin.codegen.typing import Program
from kin.differential.metric import weights
from kin.ik.candidates import Rows
from kin.kernels.fk import fk_one
from kin.kernels.jacobian import jacobian_one
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE, ClosedForm, RedundancyParameter
from kin.solvers.numeric import spread
from kin.transforms import Array

STARTS = 64  # points over the limits from which `nearest` descends
_V, _M = ArrayOf(FLOAT, 1), ArrayOf(FLOAT, 2)
_ROWS = TupleOf((_M, _M, ArrayOf(BOOL, 1), ArrayOf(BOOL, 1), ArrayOf(INT, 1)), Rows._fields)
_LIMITS = TupleOf((_V, _V, _V, _V))


@dataclass(frozen=True, eq=False)
class Arm:
    """What the files of one arm are written from.

    Attributes:
        alone: the kernels of its branches.
        branches: their names, one for each row of answers.
        parameter: the redundancy parameter of a pose, if there is one that can be given.
        turns: whole turns of the joints, and those where the parameter's joint is given ``(n,)``.
        constants: the arrays that the entries read, by name.
        entries: instances of the entries, by name.
    """

    robot: Robot
    form: ClosedForm
    alone: Alone
    parameter: RedundancyParameter | None
    constants: dict[str, Array]
    program: Program
    rooms: Rooms
    entries: dict[str, Instance]

    @property
    def rows(self) -> int:
        """How many configurations a pose has at most."""
        return len(self.form.branches)

    def buffer(self, *entries: str) -> int:
        """How many doubles of the caller's buffer these entries take, all if none is named; 0 without one."""
        sizes = {each: self.rooms.buffer.get(self.entries[each], 0) for each in entries or self.entries}
        if sizes.get("solve"):
            sizes["solve"] += self.answers
        return max(sizes.values())

    @property
    def answers(self) -> int:
        """How many doubles the configurations of a pose take, with their statistics."""
        return self.rows * (self.robot.n + 5)


def arm_of(robot: Robot, closest: bool = True) -> Arm:
    """The program of an arm.

    Args:
        closest: whether it finds what comes closest where no configuration exists.

    Raises:
        InputError: an arm that cannot be emitted.
    """
    form = closed_form_of(robot)
    found = alone(robot, form)
    assert form is not None
    parameter = next((p for p in form.redundancies(POSE) if not p.rare), None)
    turns = np.where(robot.whole_turns, TURN, 0.0)
    held = turns.copy()
    if parameter is not None and parameter.joint >= 0:
        held[parameter.joint] = 0.0
    constants = {
        "model": np.asarray(robot.model), "params": found.params, "lower": robot.lower, "upper": robot.upper,
        "turns": turns, "held": held, "weights": weights(robot),
    }  # fmt: skip
    if closest:
        constants["starts"] = spread(robot.lower, robot.upper, STARTS)
    program, rooms, made = Program(), Rooms(BOUNDS), {}
    try:
        for name, (kernel, kinds, shapes) in _entries(robot, form, found, parameter, constants, closest).items():
            made[name] = program.add(kernel, *kinds)
            rooms.enter(made[name], shapes)
        rooms.share_buffer(program)
    except OutsideSubsetError as error:
        raise needs_python(robot, form) from error
    return Arm(robot, form, found, parameter, constants, program, rooms, made)


def _entries(
    robot: Robot, form: ClosedForm, found: Alone, parameter: RedundancyParameter | None,
    constants: dict[str, Array], closest: bool,
) -> dict[str, tuple[Any, tuple[Any, ...], tuple[Any, ...]]]:  # fmt: skip
    """The entries of an arm: kernel, types and shapes of the arguments."""
    n, k = robot.n, len(form.branches)
    kernels = Kernel(plain(found.rows)), Kernel(plain(found.inner))
    q, T, limits = (n,), (4, 4), ((n,), (n,), (n,), (n,))
    model, params, most = constants["model"].shape, found.params.shape, found.intervals
    joint = [INT] if found.stepped else []
    rows, one = (((m, n), (m, 5), (m,), (m,), (m,)) for m in (k, 1))
    made: dict[str, tuple[Any, tuple[Any, ...], tuple[Any, ...]]] = {
        "fk": (fk_one, (_V, _V, _M), (model, q, T)),
        "jacobian": (jacobian_one, (_V, _V, _M), (model, q, (6, n))),
        "solve": (
            entries.by_steps if found.stepped else entries.solve,
            (*kernels, _V, _V, _M, _V, _LIMITS, FLOAT, *joint, INT, _ROWS),
            (None, None, model, params, T, q, limits, None, *[None for _ in joint], most, rows),
        ),
    }
    if parameter is not None and not found.stepped:
        made["intervals"] = (
            entries.intervals,
            (*kernels, _V, _M, _V, _LIMITS, BOOL, _M, _M),
            (None, None, params, T, q, limits, None, (k, n), (4 * entries.ROWS_OF_ARCS + 2, 3)),
        )
    if closest:
        made["nearest"] = (
            entries.nearest,
            (*kernels, _V, _V, _M, _V, _M, _M, _LIMITS, BOOL, INT, _ROWS),
            (None, None, model, params, T, q, (k, n), constants["starts"].shape, limits, None, most, one),
        )
    return made
