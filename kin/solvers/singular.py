"""Singularities as facts: codes and numbers, no sentences.

At a singularity the tool loses a direction of motion, whatever the joints do. In a closed form these sets are
simple conditions on joint angles such as sin θ4 = 0, so the distance to one is an angle or a length, which is
easier to picture than a singular value or a determinant. The sentences are made by
:mod:`kin.ik.messages.singularity`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from kin.transforms import Array

Kind = Literal["elbow", "shoulder", "wrist", "algorithmic", "jacobian"]
Unit = Literal["rad", "m", "SI"]
Condition = Literal[
    "elbow straight",
    "elbow folded",
    "wrist centre level with axis 2",
    "wrist centre on axis 1",
    "wrist centre nearest to axis 1",
    "forearm in one plane with axis 1",
    "upper arm on axis 1",
    "upper arm on axis 1, hand along the forearm",
    "hand along the forearm",
    "hand along the forearm, axes 4 and 6 perpendicular",
    "tool along the forearm",
    "axes 4 and 6 in line",
    "axis 6 parallel to axes 2, 3 and 4",
    "tool on axis 1",
    "tool nearest to axis 1",
    "smallest singular value",
]
Lost = Literal[
    "wrist centre along the arm",
    "wrist centre sideways",
    "wrist centre along axis 2",
    "wrist centre off the slide",
    "axis 4 along the arm",
    "last axis along the arm",
    "hand along the arm",
    "hand along the forearm",
    "hand along the upper arm",
    "tilt sideways",
    "tilt about the third axis",
    "joints 5 and 7 coincide",
    "joints 1 and 3, 5 and 7 coincide",
    "tool sideways",
    "reference of the arm angle",
    "azimuth of the forearm",
    "slowest direction",
]


class JointValue(NamedTuple):
    """A joint (index) and a value of it, in radians or metres."""

    joint: int
    value: float


@dataclass(frozen=True, slots=True)
class Singularity:
    """One way for a configuration to be singular, and how far it is from that.

    Attributes:
        kind: the part of the arm that is involved; ``"algorithmic"``: only the closed form loses a parameter, the
            arm loses no motion; ``"jacobian"``: judged by a singular value, for arms without a closed form.
        condition: what aligns, as a code.
        lost: what the arm (or, for ``"algorithmic"``, the closed form) loses there, as a code.
        distance: 0 on the singularity and only there, in `unit`: the angle by which one joint misses the
            condition, the root of the sum of squares for two joints, or a length.
        unit: ``"rad"``, ``"m"``; ``"SI"`` for a singular value, metres and radians alike.
        met_at: the joints whose values decide, each with the value nearest to its own at which the condition
            holds; empty where no single joint decides.
        shape: (rows, columns) of the Jacobian that a singular value is of, else None.
    """

    kind: Kind
    condition: Condition
    lost: Lost
    distance: float
    unit: Unit
    met_at: tuple[JointValue, ...] = ()
    shape: tuple[int, int] | None = None


def those_within(limit: float, *singularities: Singularity) -> tuple[Singularity, ...]:
    """The singularities whose distance is at most `limit`, in the order given."""
    return tuple([s for s in singularities if s.distance <= limit])


def by_jacobian(J: Array, rank: int) -> Singularity:
    """The one entry of an arm whose singular sets have no simple form: singular value number `rank` of J."""
    least = float(np.linalg.svd(J, compute_uv=False)[rank - 1]) if rank else 0.0
    shape = (J.shape[0], J.shape[1])
    return Singularity("jacobian", "smallest singular value", "slowest direction", least, "SI", shape=shape)


def by_angle(
    kind: Kind, condition: Condition, lost: Lost, off: float, q: Array, joint: int, sense: float = 1.0
) -> Singularity:
    """One that a single joint decides: its canonical angle, which grows with sense · q[joint], is off by `off`."""
    there = JointValue(joint, float(q[joint] - sense * off))
    return Singularity(kind, condition, lost, abs(off), "rad", (there,))


def off_line(t: float) -> float:
    """Signed angle from the nearest multiple of π to t, in [−π/2, π/2]: zero where sin t is."""
    return math.remainder(t, math.pi)


def off_perpendicular(t: float) -> float:
    """Signed angle from the nearest odd multiple of π/2 to t, in [−π/2, π/2]: zero where cos t is."""
    return math.remainder(t - 0.5 * math.pi, math.pi)


def elbow_at(t: float) -> Condition:
    """Whether a singular elbow at canonical angle t is straight or folded."""
    return "elbow straight" if math.cos(t) >= 0.0 else "elbow folded"
