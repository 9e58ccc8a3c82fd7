"""One row of a Denavit–Hartenberg table: a joint, what follows a joint, or a constant step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from kin.checks import finite_number, one_of
from kin.errors import InputError

Kind = Literal["revolute", "prismatic", "fixed"]
KIND_CODES: dict[Kind, float] = {"fixed": 0.0, "revolute": 1.0, "prismatic": 2.0}
FOLLOWS = 2.0  # added to the code of a row that follows a joint
# Fields of a joint that hold the largest value of a quantity.
PEAK_FIELDS = ("velocity", "acceleration", "jerk", "effort")
# Where none are stated: one turn about zero, or one metre of stroke.
DEFAULT_LIMITS: dict[str, tuple[float, float] | None] = {
    "fixed": None,
    "revolute": (-math.pi, math.pi),
    "prismatic": (0.0, 1.0),
}


@dataclass(frozen=True, slots=True)
class Joint:
    """One DH row.

    Attributes:
        limits: (lower, upper) in radians or metres; None for a fixed row or an unlimited joint.
        velocity, acceleration, jerk: largest values (rad or m, per second, s² and s³), None if they are not known.
        effort: largest torque or force (N·m or N), None if it is not known.
        follows: name of the row whose joint moves this one; "" for a joint, which moves by itself.
        ratio: by how many times that joint's value it moves (rad or m for each rad or m).

    Raises:
        InputError: a kind that does not exist, a number that is not finite, limits that are not lower and upper, a
            fixed row that follows, or a ratio of a row that follows none.
    """

    name: str
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    kind: Kind = "revolute"
    limits: tuple[float, float] | None = None
    velocity: float | None = None
    effort: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    follows: str = ""
    ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check the row; numbers of any type become floats."""
        if not isinstance(self.kind, str) or self.kind not in KIND_CODES:
            raise InputError(f"kind of {self.name}", self.kind, one_of(*KIND_CODES))
        for key in ("theta", "d", "a", "alpha"):
            object.__setattr__(self, key, finite_number(f"{key} of {self.name}", getattr(self, key)))
        for key in PEAK_FIELDS:
            if (value := getattr(self, key)) is not None:
                where = f"{key} of {self.name}"
                if self.kind == "fixed" or not (limit := finite_number(where, value)) > 0.0:
                    raise InputError(where, value, "a positive number, or None for a fixed row")
                object.__setattr__(self, key, limit)
        self._check_following()
        if self.limits is None:
            return
        where = f"limits of {self.name}"
        if self.kind == "fixed":
            raise InputError(where, self.limits, "None, because the row is fixed")
        try:
            lower, upper = self.limits
        except (TypeError, ValueError):
            raise InputError(where, self.limits, "two numbers (lower, upper)") from None
        lower, upper = finite_number(where, lower), finite_number(where, upper)
        if lower > upper:
            raise InputError(where, self.limits, "the lower limit first")
        object.__setattr__(self, "limits", (lower, upper))

    def _check_following(self) -> None:
        if not isinstance(self.follows, str) or (self.follows and self.kind == "fixed"):
            expected = "the name of a row" if self.kind != "fixed" else "none, because the row is fixed"
            raise InputError(f"follows of {self.name}", self.follows, expected)
        where = f"ratio of {self.name}"
        ratio = finite_number(where, self.ratio)
        if ratio == 0.0 or (ratio != 1.0 and not self.follows):
            expected = "a number that is not 0" if self.follows else "1, because the row follows no joint"
            raise InputError(where, self.ratio, expected)
        object.__setattr__(self, "ratio", ratio)

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.kind != "fixed"

    @property
    def driven(self) -> bool:
        """Whether it is a joint: it moves, and by itself."""
        return self.kind != "fixed" and not self.follows
