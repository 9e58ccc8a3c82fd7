"""How a capability map decides which directions can be approached at a point.

Every positive answer is verified by forward kinematics. How far a negative one can be trusted depends on the arm,
and the map's `method` names the case:

- ``"closed form"``: the approach has a closed form that knows the exact ranges of its redundancy parameters (roll,
  arm angle): negative answers are exact. A batch of branches decides almost all; configurations that exist but
  break a limit are passed to the solver one by one. Only where an arm is singular at one roll and not at others
  may a positive answer be missed: at targets that fill no volume.
- ``"sweep"``: poses have a closed form. Approaches have none, as the tool is not on the last joint's axis, or
  their ranges are not exact. `ROLLS` rolls are tried, and `SWEEP` values of an arm's own redundancy parameter:
  narrower ranges are missed.
- ``"search"``: no closed form, or one that takes longer than a search. `STARTS` descents per direction: a few
  approachable directions are missed.

The best manipulability is that of all branches, at `SWEEP` arm angles or rolls where these are redundant and
matter; a finer sweep mostly finds one or two per cent more, at worst a quarter.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np

from kin.angles import TURN
from kin.axes import screw_z
from kin.fk import fk, jacobian
from kin.ik.batch import ik_branches
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.solvers.contract import APPROACH, POSE, ClosedForm, RedundancyParameter, SolverInput
from kin.tolerances import TOLERANCES
from kin.transforms import Array, frame_from_approach
from kin.workspace.capability.kernels import BLOCKED, NONE, raise_best, search_each
from kin.workspace.capability.sphere import spherical_design
from kin.workspace.region import BoundedArm, Region
from kin.workspace.search.cells import cell_map

Method = Literal["closed form", "sweep", "search"]
Bounds = tuple[tuple[float, float], ...]

ROLLS = 36  # one every 10°
SWEEP = 8
STARTS = 8
# Metres per radian of a descent's orientation error, as a fraction of the arm's reach, and the residual that
# counts as exact: those of kin.ik.nearest.
_LEVER, _EXACT = 0.3, 1e-10


@lru_cache(maxsize=8)
def evaluator(robot: Robot, bounds: Bounds, directions: int) -> Evaluator:
    """The evaluator of a grid, cached: all blocks of a grid share it."""
    return Evaluator(robot, bounds, directions)


class Evaluator:
    """Evaluates an arm with joint limits `bounds` at points, for a number of `directions`."""

    def __init__(self, robot: Robot, bounds: Bounds, directions: int) -> None:
        self.robot = robot
        self.lower = np.array([low for low, _ in bounds])
        self.upper = np.array([high for _, high in bounds])
        self.arm = BoundedArm(robot.model, self.lower, self.upper)
        low = np.where(np.isfinite(self.lower), self.lower, -math.pi)
        high = np.where(np.isfinite(self.upper), self.upper, math.pi)
        self.region = Region(robot, tuple(zip(low.tolist(), high.tolist(), strict=True)))
        self.turns = np.where(robot.whole_turns, TURN, 0.0)
        self.rolls = _rolls(robot)
        self.frames = np.stack([frame_from_approach(direction) for direction in spherical_design(directions)])
        self.form: ClosedForm | None = None
        self.redundancies: tuple[RedundancyParameter, ...] = ()
        self.values: tuple[float, ...] = (math.nan,)
        self.tried = 1  # rolls about each direction
        self.other_home: Robot | None = None
        self.method: Method = "search"
        match = closed_form_of(robot)
        if match is not None and match.steady:
            self.form = match
            exact = match.handles(APPROACH) and match.exact_ranges
            self.method = "closed form" if exact else "sweep"
            self.redundancies = match.redundancies(APPROACH) if exact else ()
            if not exact:
                self.tried = ROLLS
            elif not self.rolls and not all(parameter.rare for parameter in self.redundancies):
                self.tried = SWEEP
            free = [parameter for parameter in match.redundancies(POSE) if not parameter.rare]
            self.values = self._values(free, exact)
            if not free and (self.rolls or robot.n > 4):
                # A singular joint takes its value from home: a different home shows at which targets.
                home = (value + 0.3 + 0.2 * i for i, value in enumerate(robot.home))
                self.other_home = replace(robot, home=tuple(home))

    def _values(self, parameters: list[RedundancyParameter], exact: bool) -> tuple[float, ...]:
        """Values of the arm's own redundancy parameter to try, NaN for the one near the home configuration.

        A redundant joint of an exact solver is left to that solver, which respects its limits.
        """
        if not parameters or (exact and parameters[0].joint >= 0):
            return (math.nan,)
        low, high = -math.pi, math.pi
        if parameters[0].joint >= 0:
            low, high = self.region.bounds[parameters[0].joint]
        return tuple((low + (np.arange(SWEEP) + 0.5) / SWEEP * (high - low)).tolist())

    def best(self, centres: Array) -> Array:
        """The best manipulability ``(k, m)`` at each centre ``(k, 3)`` along each direction, negative if none."""
        T = np.zeros((len(centres), len(self.frames), 4, 4))
        T[..., :3, :3] = self.frames
        T[..., :3, 3] = centres[:, None]
        T[..., 3, 3] = 1.0
        best = np.full(T.shape[:2], NONE)
        if self.method == "search":
            self._search(centres, T, best)
            return best
        for k in range(self.tried):
            turned = T if k == 0 else np.ascontiguousarray(T @ screw_z(TURN * k / self.tried, 0.0))
            for value in self.values:
                self._raise(turned, ik_branches(self.robot, turned, value), best)
        if self.method == "closed form":
            self._exactly(T, best)
        return best

    def _raise(self, T: Array, q: Array, best: Array) -> None:
        """Raise best ``(...)`` by configurations ``(..., rows, n)`` of targets ``(..., 4, 4)``, in place."""
        configurations = q.reshape(-1, *q.shape[-2:])
        raise_best(self.arm, self.turns, self.rolls, T.reshape(-1, 4, 4), configurations, best.reshape(-1))

    def _exactly(self, T: Array, best: Array) -> None:
        """Call the solver, which knows the ranges of redundancy parameters, for targets the batch left undecided.

        Where an approach has a closed form, rolling the tool moves the wrist only: one roll decides whether
        branches exist. In an arm whose axes are all parallel it moves the last axis.
        """
        open_ = np.argwhere((best == BLOCKED) if self.rolls or self.robot.n > 4 else (best < 0.0))
        if self.other_home is not None and len(open_):
            here, there = (
                ik_branches(robot, T[*open_.T]).reshape(len(open_), -1) for robot in (self.robot, self.other_home)
            )
            open_ = open_[~np.asarray((here == there) | (np.isnan(here) & np.isnan(there))).all(axis=1)]
        assert self.form is not None  # the method is "closed form"
        values = (math.nan,) * len(self.redundancies)
        for i, j in open_.tolist():
            problem = SolverInput(T[i, j], APPROACH, values, True, self.robot.q_home, self.lower, self.upper)
            q = self.form.solve(problem).q
            self._raise(T[i, j], np.ascontiguousarray(q), best[i, j : j + 1])

    def _search(self, centres: Array, T: Array, best: Array) -> None:
        """Descents at the reachable centres, each starting where the one before ended."""
        weight = min(max(_LEVER * self.robot.reach, 0.03), 1.0)
        start, distance = cell_map(self.region).nearest(centres, TOLERANCES.closure_position)
        for i in np.flatnonzero(distance <= TOLERANCES.closure_position).tolist():
            q = np.empty((T.shape[1], 1, self.robot.n))
            enough = _EXACT * min(1.0, weight)
            search_each(self.region.arm, self.turns, T[i], weight, STARTS, enough, start[i], q)
            self._raise(T[i], q, best[i])


def _rolls(robot: Robot) -> bool:
    """Whether the last joint rolls the tool about its own z axis and does nothing else."""
    axis = fk(robot, robot.q_home)[:3, 2]
    J = jacobian(robot, robot.q_home)[:, -1]
    moved = np.concatenate([J[:3], np.cross(J[3:], axis)])
    return bool(robot.revolute[-1] and not robot.leads[-1] and np.abs(moved).max() < TOLERANCES.geometry)
