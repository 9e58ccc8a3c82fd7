"""Arms much smaller or larger than a metre: the closed form of the same arm in another unit of length.

What the closed forms take to be no length at all is a number of metres, chosen for arms of about a metre. So an
arm of another order of size is solved in a unit in which it is about 1 long. The unit is a power of two metres,
which rounds no number: the same arm at another size has the same angles, branches and completeness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kin.differential.metric import extent
from kin.robot import Joint, NominalTable, Robot
from kin.solvers.contract import (
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    Completeness,
    Obstacle,
    RedundancyParameter,
    SolverInput,
    WrappedForm,
)
from kin.solvers.singular import JointValue, Singularity
from kin.transforms import Array

_LEAST, _MOST = 0.05, 20.0  # arms of this size are solved in metres


def unit_of(robot: Robot) -> float:
    """The unit of length, in metres, that an arm is solved in: 1.0 for most."""
    length = extent(robot)
    return 1.0 if _LEAST <= length <= _MOST else float(2.0 ** round(math.log2(length)))


def in_unit(robot: Robot, unit: float) -> Robot:
    """The table of an arm whose lengths are numbers of this unit, which is given in metres."""
    scale = np.where(robot.revolute, 1.0, 1.0 / unit)

    def row(joint: Joint) -> Joint:
        limits = joint.limits
        if joint.kind == "prismatic" and limits is not None:
            limits = limits[0] / unit, limits[1] / unit
        return replace(joint, d=joint.d / unit, a=joint.a / unit, limits=limits)

    def pose(T: Array) -> tuple[tuple[float, ...], ...]:
        return tuple(map(tuple, _moved(T, 1.0 / unit).tolist()))

    nominal = robot.nominal
    if nominal is not None:
        nominal = NominalTable(tuple(map(row, nominal.rows)), pose(np.array(nominal.tool)))
    return replace(
        robot,
        rows=tuple(map(row, robot.rows)),
        home=tuple((robot.q_home * scale).tolist()),
        base=pose(robot.T_world_base),
        tool=pose(robot.T_last_tool),
        capsules=(),
        floor=None,
        nominal=nominal,
    )


def _moved(T: Array, scale: float) -> Array:
    """Poses ``(..., 4, 4)`` with their points scaled."""
    out = np.array(T)
    out[..., :3, 3] *= scale
    return out


class Scaled(WrappedForm):
    """The closed form of an arm in another unit of length.

    Attributes:
        form: the closed form in that unit.
        unit: metres.
        metres: of each joint value in the unit; 1.0 for an angle ``(n,)``.
    """

    def __init__(self, form: ClosedForm, robot: Robot, unit: float) -> None:
        self.form, self.unit = form, unit
        self.name, self.title, self.reason = form.name, form.title, form.reason
        self.branches, self.meanings, self.named, self.steady = (
            form.branches, form.meanings, form.named, form.steady,
        )  # fmt: skip
        self.exact_ranges, self.off, self.quick = form.exact_ranges, form.off, form.quick
        self.lengths = tuple(length * unit for length in form.lengths)
        self.metres = np.where(robot.revolute, 1.0, unit)
        self.kernels = self._kernels(form.kernels)

    def _kernels(self, form: BatchKernels) -> BatchKernels:
        """The batch kernels: those of the form, between a change of units and back."""
        metres, given = self.metres, self.form.redundancies(POSE)[:1] if self.handles(POSE) else ()
        (each,) = self._sizes(given) or [1.0]

        def many(_: Array, T: Array, values: Array, near: Array, out: Array) -> None:
            form.many(form.params, self._target(T), values / each, near / metres, out)
            out *= metres

        return BatchKernels.of_many(form.params, many)

    def _target(self, T: Array) -> Array:
        """Targets ``(..., 4, 4)`` in the unit."""
        return _moved(T, 1.0 / self.unit)

    def _sizes(self, parameters: Sequence[RedundancyParameter]) -> list[float]:
        """Metres, or radians, of each redundancy parameter in the unit."""
        return [float(self.metres[p.joint]) if p.joint >= 0 else 1.0 for p in parameters]

    def solve(self, problem: SolverInput) -> Candidates:
        """The branches, with joint values, ranges and gaps in metres."""
        p, metres, sizes = problem, self.metres, self._sizes(self.form.redundancies(problem.task))
        values = tuple(value / each for value, each in zip(p.values, sizes, strict=True))
        seed, lower, upper = p.seed / metres, p.lower / metres, p.upper / metres
        found = self.form.solve(
            replace(p, T=self._target(p.T), values=values, seed=seed, lower=lower, upper=upper)
        )
        obstacle, further = found.obstacle, found.further
        return replace(
            found,
            q=found.q * metres,
            values=found.values * sizes,
            arcs=tuple(arcs * (1.0, each, each) for arcs, each in zip(found.arcs, sizes, strict=True)),
            gap=found.gap * self.unit,
            obstacle=None if obstacle is None else Obstacle(obstacle.code, obstacle.bound * self.unit),
            further=None if further is None else lambda: further() * sizes[0],
        )

    def solve_many(self, T: Array, seeds: Array, lower: Array, upper: Array, q: Array) -> None:
        """The branches of many targets."""
        metres = self.metres
        self.form.solve_many(self._target(T), seeds / metres, lower / metres, upper / metres, q)
        q *= metres

    def rows_at(self, T: Array, values: Array, near: Array, branches: NDArray[np.intp]) -> Array:
        """One branch at each value."""
        (each,) = self._sizes(self.form.redundancies(POSE)[:1])
        return self.form.rows_at(self._target(T), values / each, near / self.metres, branches) * self.metres

    def add_missing(self, T: Array, near: Array, q: Array) -> Completeness:
        """Those that the form adds."""
        found = q / self.metres
        completeness = self.form.add_missing(self._target(T), near / self.metres, found)
        q[:] = found * self.metres
        return completeness

    def relaxed(self, by: float) -> Scaled:
        """The same with lengths that may miss by some more metres."""
        other = copy(self)
        other.form = self.form.relaxed(by / self.unit)
        other.kernels = other._kernels(other.form.kernels)
        return other

    def value_at(self, T: Array, q: Array) -> float:
        """The redundancy parameter, if it is no joint's value."""
        return self.form.value_at(self._target(T), q / self.metres)

    def branch_of(self, q: Array) -> int:
        """The branch that a configuration ``(n,)`` is on."""
        return self.form.branch_of(q / self.metres)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """Those of the form; a length counts as near if it is in the unit, singular values stay in it."""
        return tuple(
            replace(
                s,
                distance=s.distance * (self.unit if s.unit == "m" else 1.0),
                met_at=tuple(JointValue(i, value * float(self.metres[i])) for i, value in s.met_at),
            )
            for s in self.form.singularities(q / self.metres, within)
        )
