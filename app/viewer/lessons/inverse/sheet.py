"""A derivation as facts: steps of lines, each a formula with its value, and what goes wrong in a step."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from app.viewer.lessons.inverse import formulas
from app.viewer.lessons.inverse.formulas import Value
from kin.transforms import Array

Kind = Literal["length", "angle", "number", "point", "direction", "rotation"]
StepKey = Literal["centre", "theta1", "elbow", "theta2", "circle", "shoulder", "wrist", "last", "joints"]
# Why a step has no real solution.
Failure = Literal["too far", "too near", "inside the cylinder", "off the plane"]
# What is special at this target: a free angle, or two ways that are one.
Special = Literal["on axis 1", "tangent", "straight", "folded", "aligned", "on axis 2"]
TURN = 2.0 * math.pi
SINGULAR = 1e-7  # m, or of a sine: below it an angle is free
CLOSED = 1e-9  # of a cosine: beyond ±1 by less is rounding


@dataclass(frozen=True, eq=False)
class Line:
    """One formula: the name that it defines, what is equal to it by meaning, its text and its value."""

    name: str
    text: str
    kind: Kind
    value: Value
    means: str = ""


@dataclass(frozen=True, eq=False)
class DerivedStep:
    """One step of a derivation.

    Attributes:
        split: index of the sign that is chosen here, −1 if there is no choice.
        failure: why the derivation ends here; `excess` is by how much: metres, or a cosine.
        free: the number of the angle that this target leaves free, 0 if none.
    """

    key: StepKey
    lines: tuple[Line, ...]
    split: int = -1
    failure: Failure | None = None
    excess: float = 0.0
    special: Special | None = None
    free: int = 0


@dataclass(frozen=True, eq=False)
class Derivation:
    """One branch of a target, as far as it leads.

    Attributes:
        signs: the choice at each split, 1 or −1.
        values: of all names.
        q: the joint values ``(n,)``, None if a step fails.
    """

    signs: tuple[int, ...]
    steps: tuple[DerivedStep, ...]
    values: dict[str, Value]
    q: Array | None

    @property
    def failed(self) -> DerivedStep | None:
        """The step that has no real solution."""
        last = self.steps[-1]
        return last if last.failure is not None else None

    def step(self, key: StepKey) -> DerivedStep | None:
        """The step with this key, if the derivation gets there."""
        return next((step for step in self.steps if step.key == key), None)

    def number(self, name: str) -> float:
        """The value of a name that is a number."""
        found = self.values[name]
        assert isinstance(found, float)
        return found


@dataclass(eq=False)
class Sheet:
    """Where a derivation is written: the values so far, and the steps."""

    values: dict[str, Value] = field(default_factory=dict)
    steps: list[DerivedStep] = field(default_factory=list)
    _lines: list[Line] = field(default_factory=list)

    def given(self, **values: Value) -> None:
        """Values that are known: the target, and the lengths of the links."""
        for name, found in values.items():
            self._keep(name, found)

    def put(self, name: str, text: str, kind: Kind, means: str = "") -> None:
        """Write a line: compute a formula and keep its value."""
        found = formulas.value(text, self.values)
        if kind == "angle":
            found = wrapped(float(found))
        elif kind in ("length", "number"):
            found = float(found)
        self._keep(name, found)
        self._lines.append(Line(name, text, kind, found, means))

    def state(self, name: str, found: Value, kind: Kind) -> None:
        """Write a value that no formula gives, such as that of a free angle."""
        self._keep(name, found)
        self._lines.append(Line(name, "", kind, found))

    def close(
        self,
        key: StepKey,
        split: int = -1,
        failure: Failure | None = None,
        excess: float = 0.0,
        special: Special | None = None,
        free: int = 0,
    ) -> None:
        """End a step; what is given as in `DerivedStep`."""
        self.steps.append(DerivedStep(key, tuple(self._lines), split, failure, excess, special, free))
        self._lines = []

    def __getitem__(self, name: str) -> float:
        found = self.values[name]
        assert isinstance(found, float)
        return found

    def array(self, name: str) -> Array:
        """A value that is a vector or a matrix."""
        found = self.values[name]
        assert isinstance(found, np.ndarray)
        return found

    def _keep(self, name: str, found: Value) -> None:
        """Keep a value, and the entries of a vector or a matrix under names of their own: w_x, N_13."""
        self.values[name] = found
        if isinstance(found, np.ndarray) and found.ndim == 1:
            self.values |= {f"{name}_{axis}": float(x) for axis, x in zip("xyz", found, strict=True)}
        elif isinstance(found, np.ndarray):
            self.values |= {f"{name}_{i + 1}{j + 1}": float(found[i, j]) for i in range(3) for j in range(3)}


def wrapped(angle: float) -> float:
    """The same angle in (−π, π]."""
    turned = math.remainder(angle, TURN)
    return math.pi if turned == -math.pi else turned


def minus(sign: int) -> str:
    """The sign in front of a term of a formula."""
    return "-" if sign < 0 else ""
