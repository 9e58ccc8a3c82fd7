"""What a singularity is told as, and the angle figures the closed forms tell it with.

At a singularity the tool loses a direction of motion, whatever the joints do. In a closed form these sets are
simple conditions on joint angles such as sin θ4 = 0, so how far away one is can be said as an angle or a length
that a person can picture, which a singular value or a determinant is not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Literal

Kind = Literal["elbow", "shoulder", "wrist", "algorithmic", "jacobian"]
Entry = tuple[Kind, float, str, Callable[[], str]]
_OTHERWISE: ContextVar[tuple[int, ...]] = ContextVar("joints told with the other sign", default=())


@dataclass(frozen=True, slots=True)
class Singularity:
    """One way for a configuration to be singular, and how far it is from that.

    Attributes:
        kind: the part of the arm that is to blame; ``"algorithmic"``: only the closed form loses a parameter, not
            the arm a motion; ``"jacobian"``: told by a singular value, for arms without a closed form.
        meaning: a clause for people, e.g. ``"elbow straight (θ4 = 0°): …"``.
        distance: 0 on the singularity and only there, in `unit`: the angle by which one joint misses the
            condition, the root of the sum of squares for two joints, or a length.
        unit: ``"rad"``, ``"m"``; ``"SI"`` for a singular value, metres and radians alike.
    """

    kind: Kind
    meaning: str
    distance: float
    unit: str


def those_within(reach: float, *entries: Entry) -> tuple[Singularity, ...]:
    """The entries (kind, distance, unit, meaning) no farther than `reach`; only these are put in words."""
    return tuple([Singularity(kind, meaning(), far, unit) for kind, far, unit, meaning in entries if far <= reach])


def off_line(t: float) -> float:
    """Angle from t to the nearest multiple of π, signed, in [−π/2, π/2]: zero where sin t is."""
    return math.remainder(t, math.pi)


def off_square(t: float) -> float:
    """Angle from t to the nearest odd multiple of π/2, signed, in [−π/2, π/2]: zero where cos t is."""
    return math.remainder(t - 0.5 * math.pi, math.pi)


def at(joint: int, q: float, off: float) -> str:
    """``"θ4 = 0°"``: where joint number `joint`, now at q, would meet a condition it misses by `off` (radians)."""
    there = off - q if joint - 1 in _OTHERWISE.get() else q - off
    return f"θ{joint} = {round(math.degrees(there), 3) + 0.0:g}°"


@contextmanager
def counting_otherwise(joints: tuple[int, ...]) -> Iterator[None]:
    """Inside, `at` tells these joints (indices) with the other sign: see :mod:`kin.solvers.mirrored`."""
    token = _OTHERWISE.set(joints)
    try:
        yield
    finally:
        _OTHERWISE.reset(token)


def stretch(t: float) -> str:
    """Whether a singular elbow at canonical angle t is straight or folded."""
    return "straight" if math.cos(t) >= 0.0 else "folded"
