"""What the Jacobian says about speeds, forces and lost directions at one configuration.

``J = U Σ Vᵀ``. Joint speeds of unit length, ``|q̇| ≤ 1``, take the tool into an ellipsoid of velocities: its axes
are the columns of U, its semi-axes the singular values. Unit joint torques hold ``F`` with ``|JᵀF| ≤ 1``: the same
axes, the semi-axes ``1/σ``. So the arm is strong where it is slow (Yoshikawa, Int. J. Robotics Research 4(2),
1985).

Linear rows are lengths and angular rows are not: an ellipsoid of both together would change its shape with the
unit of length. So there is one of the three linear rows, and one of the three angular ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kin import Robot, Singularity, fk
from kin.singularity import task_jacobian, usual_rank
from kin.tolerances import TOLERANCES
from kin.transforms import Array

State = Literal["far", "near", "at"]
Ellipsoid = Literal["velocity", "turning", "force", "moment"]

# Nearer than this a singularity is "near": an angle, and a length seen under it from the arm's reach.
NEAR = math.radians(10.0)
NEAR_VALUE = 0.05  # the same for a singular value
# A direction whose singular value is below this share of the largest is lost, at a singularity.
_LOST = 1e-3


@dataclass(frozen=True, eq=False)
class Axes:
    """Principal axes of three rows of a Jacobian.

    Attributes:
        R: ``(3, 3)`` unit axes as the columns of a rotation, in the frame of the rows.
        values: singular values ``(3,)``, falling; 0 for the directions that too few joints leave out.
    """

    R: Array
    values: Array


@dataclass(frozen=True, eq=False)
class TaskRates:
    """The Jacobian of what this arm can be asked for, see `kin.singularity.task_jacobian`.

    Attributes:
        values: its singular values, falling, without those that are zero everywhere.
        twists: ``(k, 6)`` the direction of each as a velocity of the tool point and an angular velocity, in the
            base frame, unit length in SI units.
    """

    values: Array
    twists: Array


def axes_of(rows: Array) -> Axes:
    """Principal axes of three rows ``(3, n)``."""
    U, s, _ = np.linalg.svd(rows)
    if np.linalg.det(U) < 0.0:
        U[:, 2] = -U[:, 2]
    values = np.zeros(3)
    values[: len(s)] = s
    return Axes(U, values)


def semi_axes(values: Array, kind: Ellipsoid) -> Array:
    """Semi-axes ``(3,)`` of an ellipsoid: σ for velocities; 1/σ for forces and moments, ∞ where σ is 0."""
    if kind in ("velocity", "turning"):
        return values
    return np.asarray(np.divide(1.0, values, out=np.full(3, math.inf), where=values > 0.0))


def part_of(J: Array, kind: Ellipsoid) -> Array:
    """The rows ``(3, n)`` of J ``(6, n)`` that an ellipsoid is about."""
    return J[:3] if kind in ("velocity", "force") else J[3:]


def task_rates(robot: Robot, q: Array) -> TaskRates:
    """Singular values and directions of the arm's task at q ``(n,)``."""
    U, s, _ = np.linalg.svd(task_jacobian(robot, q))
    rank = usual_rank(robot)
    twists = np.zeros((rank, 6))
    directions = U[:, :rank].T
    twists[:, :3] = directions[:, :3]
    if robot.n == 5:
        twists[:, 3:] = directions[:, 3:] @ fk(robot, q)[:3, :2].T
    elif robot.n > 5:
        twists[:, 3:] = directions[:, 3:]
    return TaskRates(s[:rank], twists)


def lost(rates: TaskRates) -> Array:
    """The twists ``(k, 6)`` that no joint motion has a part along, at a singularity; the slowest one at least."""
    if not len(rates.values):
        return np.empty((0, 6))
    gone = rates.values < _LOST * rates.values[0]
    gone[-1] = True
    return np.asarray(rates.twists[gone])


def real(found: tuple[Singularity, ...]) -> tuple[Singularity, ...]:
    """Those that cost the arm a motion; the others only trouble a closed form."""
    return tuple(s for s in found if s.kind != "algorithmic")


def state_of(singularity: Singularity, reach: float) -> State:
    """Whether a singularity is far, near or met; a length is judged by the angle it has, seen from the reach."""
    if singularity.distance <= TOLERANCES.at_singularity:
        return "at"
    if singularity.unit == "SI":
        return "near" if singularity.distance < NEAR_VALUE else "far"
    angle = singularity.distance / (reach if singularity.unit == "m" else 1.0)
    return "near" if angle < NEAR else "far"


def condition(values: Array) -> float:
    """The largest singular value over the smallest, ∞ where that is zero to rounding."""
    if not len(values) or values[-1] <= 1e-12 * values[0]:
        return math.inf
    return float(values[0] / values[-1])


def nice(value: float) -> float:
    """The nearest of 1, 2, 5, 10, 20, … above a positive value, or equal to it."""
    power = 10.0 ** math.floor(math.log10(value))
    return next((m * power for m in (1.0, 2.0, 5.0) if m * power >= value * (1.0 - 1e-9)), 10.0 * power)
