"""One student's version of an exercise: an arm, a posture, and the numbers drawn from a seed."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

import kin
from app.exercises.expressions import Expression, Function
from app.exercises.fields import Words
from kin import Robot
from kin.differential.task import rank, task_jacobian
from kin.transforms import Array
from kin.units import Unit, Units, general

_PLACE = re.compile(r"\{([^{}]*)\}")


class Facts(Mapping[str, "float | Function"]):
    """What expressions may use about an arm at a configuration ``(n,)``.

    Names: ``x y z`` of the tool point, the columns ``nx … az`` of its rotation, ``q1 … qn``, ``w`` (the
    manipulability), ``rank`` and ``n``. Functions of numbers from 1: ``J(row, joint)``, ``sigma(i)`` (singular
    values, the largest first), ``px(i) py(i) pz(i)`` (the origin of frame i; 0: the base), ``theta(i) d(i) a(i)
    alpha(i)`` of a row, ``q(i) low(i) high(i)`` of a joint, and ``postures()``: how many solutions the tool's
    pose has.

    Args:
        pose: where the tool is taken to be ``(4, 4)``, if a mistaken model says otherwise than the arm.
        axes: the rotation ``(3, 3)`` whose columns the Jacobian is seen along; those of the base by default.
    """

    def __init__(self, robot: Robot, q: Array, pose: Array | None = None, axes: Array | None = None) -> None:
        self._robot, self._q, self._given, self._axes = robot, q, pose, axes
        self._made: dict[str, Callable[[], float | Function]] = {
            "n": lambda: float(robot.n),
            "w": lambda: float(kin.manipulability(robot, q)),
            "rank": lambda: float(rank(robot, task_jacobian(robot, q), 1e-6)),
            "J": lambda: self._entry(self._jacobian),
            "sigma": lambda: self._entry(np.linalg.svd(task_jacobian(robot, q), compute_uv=False)),
            "postures": lambda: lambda: self._postures,
            "q": lambda: self._entry(q),
            "low": lambda: self._entry(robot.lower),
            "high": lambda: self._entry(robot.upper),
        }
        for i, name in enumerate("xyz"):
            self._made[name] = lambda i=i: float(self._pose[i, 3])  # type: ignore[misc]
            self._made[f"p{name}"] = lambda i=i: self._entry(self._frames[:, i, 3], first=0)  # type: ignore[misc]
            for j, column in enumerate("noa"):
                self._made[column + name] = lambda i=i, j=j: float(self._pose[i, j])  # type: ignore[misc]
        for i in range(robot.n):
            self._made[f"q{i + 1}"] = lambda i=i: float(q[i])  # type: ignore[misc]
        for name in ("theta", "d", "a", "alpha"):
            values = np.array([getattr(row, name) for row in robot.rows])
            self._made[name] = lambda values=values: self._entry(values)  # type: ignore[misc]

    @cached_property
    def _pose(self) -> Array:
        return kin.fk(self._robot, self._q) if self._given is None else self._given

    @cached_property
    def _jacobian(self) -> Array:
        J = kin.jacobian(self._robot, self._q)
        return J if self._axes is None else np.vstack([self._axes.T @ J[:3], self._axes.T @ J[3:]])

    @cached_property
    def _postures(self) -> float:
        return float(len(kin.solve_ik(self._robot, self._pose, q_seed=self._q).solutions))

    @cached_property
    def _frames(self) -> Array:
        return np.concatenate([self._robot.T_world_base[None], kin.link_frames(self._robot, self._q)])

    @staticmethod
    def _entry(array: ArrayLike, first: int = 1) -> Function:
        values = np.asarray(array)

        def entry(*indices: float) -> float:
            places = tuple(int(index) - first for index in indices)
            if len(places) != values.ndim or not all(
                0 <= i < n for i, n in zip(places, values.shape, strict=True)
            ):
                raise IndexError(f"there is no entry {', '.join(f'{index:g}' for index in indices)}")
            return float(values[places])

        return entry

    def __getitem__(self, name: str) -> float | Function:
        return self._made[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._made)

    def __len__(self) -> int:
        return len(self._made)


@dataclass(frozen=True)
class Quantity:
    """A value, and what is measured: an angle, a length, or neither."""

    value: float
    measure: str = ""

    def text(self, units: Units) -> str:
        """In the reader's units, to a tenth of a degree or of a millimetre."""
        unit = unit_of(self.measure, units)
        if unit is None:
            return general(self.value)
        return unit.short(self.value) + unit.suffix


def unit_of(measure: str, units: Units) -> Unit | None:
    """The reader's unit of an ``angle`` or a ``length``; None for anything else."""
    return {"angle": units.angles, "length": units.lengths}.get(measure)


@dataclass(frozen=True, eq=False)
class Variant:
    """An exercise with its numbers.

    Attributes:
        name: of exercise and seed, from which anything else that is drawn is drawn.
        robot, q: the arm, and the configuration ``(n,)`` that the exercise is about.
        values: the numbers drawn, by name.
        target: the pose ``(4, 4)`` that the exercise is about, if it gives one.
        functions, words: what expressions and texts may use besides. A function goes before the built-in one of
            its name.
        posed: the expressions that `q` was computed from, if a file gives them.
        facts: what expressions may use about the arm, if it is not what `robot` and `q` say.
    """

    name: str
    robot: Robot
    q: Array
    values: Mapping[str, Quantity] = field(default_factory=dict)
    target: Array | None = None
    functions: Mapping[str, Function] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)
    posed: tuple[Expression, ...] = ()
    facts: Facts | None = None

    @cached_property
    def scope(self) -> Mapping[str, float | Function]:
        """What expressions may use."""
        drawn = {name: quantity.value for name, quantity in self.values.items()}
        return Joined({**drawn, **self.functions}, self.facts or Facts(self.robot, self.q))

    def with_number(self, name: str, value: float) -> Variant:
        """The same with another value of a number; the configuration follows it, what was computed from it not."""
        changed = {**self.values, name: replace(self.values.get(name, Quantity(value)), value=value)}
        numbers = {name: quantity.value for name, quantity in changed.items()}
        q = np.array([each.value(numbers) for each in self.posed]) if self.posed else self.q
        return replace(self, values=changed, q=q)

    def arm_unlike(self, other: Variant) -> tuple[Robot, Array] | None:
        """The arm and its configuration; None if they are those of another variant."""
        same = self.robot == other.robot and np.array_equal(self.q, other.q)
        return None if same else (self.robot, self.q)

    @cached_property
    def pose(self) -> Array:
        """The target, or else the pose of the tool ``(4, 4)``."""
        return kin.fk(self.robot, self.q) if self.target is None else self.target

    def draw(self, purpose: str) -> random.Random:
        """A source of random numbers of its own for each purpose: the same in every process."""
        return random.Random(f"{self.name}:{purpose}")

    def number(self, expression: Expression) -> float:
        """The value of an expression."""
        return expression.value(self.scope)

    def vector(self, expressions: tuple[Expression, ...]) -> Array:
        """The values of expressions as an array ``(n,)``."""
        return np.array([self.number(expression) for expression in expressions])

    def text(self, template: str | Words, units: Units) -> str:
        """A text of the file, with the drawn numbers in the reader's units."""
        if isinstance(template, Words):
            template = next(text for when, text in template.alternatives if self.number(when))

        def named(place: re.Match[str]) -> str:
            name = place[1]
            if name in self.words:
                return self.words[name]
            return self.values[name].text(units) if name in self.values else place[0]

        return _PLACE.sub(named, template)


class Joined(Mapping[str, "float | Function"]):
    """Drawn numbers before facts; a fact is computed when it is read."""

    def __init__(self, drawn: Mapping[str, float | Function], facts: Facts) -> None:
        self._drawn, self._facts = drawn, facts

    def __getitem__(self, name: str) -> float | Function:
        return self._drawn[name] if name in self._drawn else self._facts[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**self._drawn, **dict.fromkeys(self._facts)})

    def __len__(self) -> int:
        return len(set(self._drawn) | set(self._facts))
