"""The family as a closed form: matching, names, the solver contract, singularities."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace

import numpy as np

from kin.axes import inverse
from kin.robot import Robot
from kin.solvers import rolled
from kin.solvers.canonical import at_every_turn, turn_around
from kin.solvers.contract import (
    APPROACH,
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    Completeness,
    Obstacle,
    ObstacleCode,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.names import Names, Part, bent, eight, flipped, front_or_back, names_of, stance_of
from kin.solvers.offset7.answers import answer
from kin.solvers.offset7.branches import branches_many, branches_one, chain_values, forearm, gap_of
from kin.solvers.offset7.geometry import REACH, SIN2, Geometry, geometry_of
from kin.solvers.offset7.places import SAMPLES
from kin.solvers.offset7.ranges import INTERVALS
from kin.transforms import Array

NAME = "offset7"
TITLE = "closed form, seven joints of which one is given"
_OBSTACLES: dict[int, ObstacleCode] = {
    1: "wrist centre too far from the shoulder",
    2: "wrist centre too near to the shoulder",
    3: "wrist centre beyond the elbow's reach",
}


def match(robot: Robot) -> Offset7 | None:
    """The closed form if one end of the arm is spherical and of the other four axes the middle two meet."""
    geometry = geometry_of(robot)
    return None if geometry is None else Offset7(geometry, robot)


class Offset7(ClosedForm):
    """The closed form of an arm with a spherical end, with the joint at its other end given."""

    name, title = NAME, TITLE
    exact_ranges = False

    def __init__(self, geometry: Geometry, robot: Robot) -> None:
        g = self.geometry = geometry
        self.robot = robot
        self.given = g.joint(0)
        three, two = ("1, 2 and 3", "5 and 6") if g.reversed else ("5, 6 and 7", "2 and 3")
        self.reason = f"axes {three} meet in one point, axes {two} in another, and joint {self.given + 1} is given"
        self.lengths = ()
        self.kernels = BatchKernels(g.params, branches_one, branches_many)
        self.branches, self.meanings = self.names(robot, np.ones(7))
        self._roll = rolled.roll_sense(robot)
        self.tasks = (POSE, APPROACH) if self._roll != 0.0 else (POSE,)
        self._parameter = RedundancyParameter(f"theta{self.given + 1}", f"θ{self.given + 1}", joint=self.given)

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of sin(t4 − elbow), of the sine of t3 from its middle, and of sin t6."""
        g = self.geometry
        elbow = bent(3, g.sign[3], g.offset[3] - g.elbow)
        if not g.reversed:
            middle = _beside("shoulder", "the wrist centre", (2, 3), -g.sign[1] * g.sign[2])
            last = flipped(5, g.sign[5], g.offset[5], "axes 5 and 7 are in line")
            return names_of((middle, elbow, last), [(side, bend, wrist) for bend, side, wrist in eight()])
        # Joints 1, 2, 3 are Rz(−t7) Ry(−t6) Rz(−t5): with sin t6 > 0 axis 3 leans against the x axis.
        stance = stance_of(robot, inverse(g.base), -float(g.offset[6]), -float(g.sign[6]))
        lean = front_or_back(stance, "the upper arm").times(-g.along)
        middle = _beside("wrist", "the shoulder", (5, 6), g.sign[1] * g.sign[2])
        return names_of((lean, elbow, middle), [(wrist, bend, side) for bend, side, wrist in eight()])

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The given joint; for an approach direction the roll or the last joint as well."""
        return rolled.parameters(self._parameter) if task == APPROACH else (self._parameter,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, each at the given joint's value at which it is nearest to the seed, or as requested."""
        if problem.task == APPROACH:
            return rolled.solve_approach(self, problem, self._roll)
        p, requested, i = problem, problem.values[0], self.given
        out, arcs = np.empty((8, 8)), np.empty((INTERVALS, 3))
        joints = np.array((p.seed, p.lower, p.upper))
        count = answer(self.kernels.params, p.T, joints, requested, p.respect_limits, p.weight, arcs, out)
        found = at_every_turn(arcs[:count], float(p.lower[i]), float(p.upper[i]))
        gap, obstacle = 0.0, None
        if all(map(math.isnan, out[:, 0].tolist())):
            tried = [requested]
            if math.isnan(requested):
                span = turn_around(float(p.lower[i]), float(p.upper[i]), float(p.seed[i]))
                tried = np.linspace(*span, SAMPLES).tolist()
            gap, obstacle = self._obstacle(p.T, tried)
        # The formulas leave nothing out at one value; where a branch has values is searched for.
        free = math.isnan(requested) and p.lower[i] < p.upper[i]
        known: Completeness = "searched" if free else "proved"
        return Candidates(out[:, :7], out[:, 7:], (found,), gap, obstacle, known)

    def relaxed(self, by: float) -> Offset7:
        """The same with a reach that is wider by some metres, or narrower."""
        other, params = copy(self), self.kernels.params.copy()
        params[REACH] += by
        other.kernels = replace(self.kernels, params=params)
        return other

    def _obstacle(self, T: Array, values: list[float]) -> tuple[float, Obstacle | None]:
        """Why no branch exists at any of these values of the given joint: the smallest gap, and what it is."""
        code, gap, bound = min((gap_of(self.kernels.params, T, value) for value in values), key=lambda x: x[1])
        if code == 0:  # one exists here, between the values at which `feasible` looked
            return 0.0, None
        return gap, Obstacle(_OBSTACLES[code], bound)

    def branch_of(self, q: Array) -> int:
        """The branch a configuration ``(7,)`` is on: the signs of three sines, see `names`."""
        t, params = np.empty(7), self.kernels.params
        chain_values(params, np.ascontiguousarray(q, dtype=np.float64), t)
        y0, y1, _ = forearm(params, t[3])
        middle = math.atan2(params[SIN2] * y0, params[SIN2] * y1)
        sines = math.sin(t[3] - self.geometry.elbow), math.sin(t[2] - middle), math.sin(t[5])
        return sum(weight * int(sine < 0.0) for weight, sine in zip((4, 2, 1), sines, strict=True))


def _beside(noun: str, what: str, joints: tuple[int, int], sense: float) -> Part:
    """On which side of the plane of two axes something is."""
    a, b = joints
    positive, negative = (
        (f"{noun} {word}", f"{what} is on the side of the plane of axes {a} and {b} that z{x} × z{y} points to")
        for word, x, y in (("positive", a, b), ("negative", b, a))
    )
    return Part(positive, negative).times(sense)
