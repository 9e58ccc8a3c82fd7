"""What a path is searched in: its waypoints with their layers, and how motion between them is measured.

Motion is weighted, so that radians and metres can be compared. A step is a *jump* if the weighted motion of some
joint is larger than `max_step`; a step across several waypoints may be that many times as long. Waypoints without
an exact configuration (gaps) are left out of the search and filled in at the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kin.angles import TURN
from kin.differential.metric import weights
from kin.ik.details import JointKind
from kin.ik.problem import IKProblem
from kin.ik.results import IKResult
from kin.path.details import JointMove
from kin.solvers.contract import POSITION
from kin.transforms import Array

GRID = math.radians(15.0)  # step of a redundancy parameter for 60 waypoints and more; down to half for fewer
WIDE = 2.0 * TURN + 1e-9  # a joint with more travel is followed as a circle
_START_WEIGHT = 1e-6  # of the distance from home to the first waypoint


def has_closed_form(problem: IKProblem) -> bool:
    """Whether a closed form covers the task; a position leaves too many parameters, so descents solve it."""
    closed_form = problem.closed_form
    return closed_form is not None and problem.code != POSITION and closed_form.handles(problem.code)


def is_sampled(problem: IKProblem) -> bool:
    """Whether layers are samples from the start; two redundancy parameters are sampled only if jumps remain."""
    return has_closed_form(problem) and len(problem.redundancies) < 2


@dataclass(frozen=True, slots=True, eq=False)
class PathSettings:
    """What is constant along the path.

    Attributes:
        problem: limits, task, and where the arm is (its seed).
        weight, circle: ``(n,)`` weights of the joints, see `kin.differential.metric`; 2π for a joint that is
            followed as a circle, else 0.
        max_step: a larger weighted motion is a jump.
        start_weight: weight of the motion from the seed to the first waypoint.
        grid: radians between samples of a redundancy parameter.
    """

    problem: IKProblem
    weight: Array
    circle: Array
    max_step: float
    start_weight: float
    grid: float

    @classmethod
    def of(cls, problem: IKProblem, max_step: float, started: bool, count: int) -> PathSettings:
        """The settings for `count` waypoints; `started`: the arm is at the seed."""
        wide = ~(problem.upper - problem.lower <= WIDE)
        return cls(
            problem=problem,
            weight=weights(problem.robot),
            circle=np.where(problem.robot.whole_turns & wide, TURN, 0.0),
            max_step=max_step,
            start_weight=1.0 if started else _START_WEIGHT,
            grid=GRID * min(max(count / 60.0, 0.5), 1.0),
        )

    def moves(self, a: Array, b: Array) -> Array:
        """Weighted motion of each joint from a to b ``(..., n)``."""
        return np.asarray(np.abs(b - a) * self.weight)

    def largest_move(self, a: Array, b: Array) -> float:
        """Weighted motion of the joint that moves most from a to b ``(n,)``."""
        return float(self.moves(a, b).max())

    def joint_move(self, joint: int, weighted: float) -> JointMove:
        """A weighted motion of a joint in its own unit."""
        row = self.problem.robot.joints[joint]
        kind: JointKind = "prismatic" if row.kind == "prismatic" else "revolute"
        return JointMove(joint, row.name, kind, weighted / float(self.weight[joint]))

    def jumps(self, q: Array, spans: Sequence[int]) -> list[int]:
        """The steps of a path ``(s, n)`` that are jumps, by the index of their end."""
        allowed = self.max_step * (1.0 + 1e-9) * np.array(spans[1:])
        found: list[int] = (1 + np.flatnonzero(self.moves(q[:-1], q[1:]).max(axis=1) > allowed)).tolist()
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Waypoint:
    """A waypoint.

    Attributes:
        requested: the problem as it was requested.
        problem: what the configurations meet: only point and approach direction where the roll is given up.
        layer: configurations to choose from ``(m, n)``, none in a gap.
        gap: why there is none.
    """

    requested: IKProblem
    problem: IKProblem
    layer: Array
    gap: IKResult | None = None

    @property
    def relaxed(self) -> bool:
        """Whether the roll was given up."""
        return self.problem.code != self.requested.code


@dataclass(frozen=True, slots=True, eq=False)
class LayerSequence:
    """The waypoints that have a layer.

    Attributes:
        settings: what is constant along the path.
        waypoints: those with a layer.
        at: their indices in the path.
        spans: how many steps there are from the one before to each.
    """

    settings: PathSettings
    waypoints: list[Waypoint]
    at: list[int]
    spans: list[int]

    @classmethod
    def of(cls, settings: PathSettings, waypoints: list[Waypoint]) -> LayerSequence:
        """Those of all waypoints that have a layer."""
        at = [i for i, waypoint in enumerate(waypoints) if len(waypoint.layer)]
        return cls(settings, [waypoints[i] for i in at], at, [1, *np.diff(at).tolist()])

    @property
    def has_grid(self) -> bool:
        """Whether a finer grid of redundancy parameters would give other layers."""
        problem = self.settings.problem
        return has_closed_form(problem) and not all(parameter.rare for parameter in problem.redundancies)

    def jumps(self, q: Array) -> list[int]:
        """The steps of a path ``(s, n)`` that are jumps, by the index of their end."""
        return self.settings.jumps(q, self.spans)

    def cost(self, q: Array) -> tuple[int, float]:
        """What is minimised for a path ``(s, n)``: jumps, then sum of squared motion, with that to its start."""
        settings = self.settings
        moves = settings.moves(q[:-1], q[1:])
        start = settings.moves(settings.problem.seed, q[0])
        cost = settings.start_weight * (start**2).sum() + ((moves**2).sum(axis=1) / self.spans[1:]).sum()
        return len(self.jumps(q)), float(cost)
