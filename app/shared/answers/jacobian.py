"""Answers about the Jacobian of a configuration."""

from __future__ import annotations

from typing import Literal

import numpy as np

from app.shared.answers.answer import Answer
from app.shared.answers.fk import Matrix
from kin import Robot, jacobian, manipulability
from kin.transforms import Array


class Manipulability(Answer):
    """Yoshikawa's manipulability, by task: the product of the singular values of its rows; 0 at a singularity."""

    all: float
    """Of the pose: all six rows (mixed units)."""
    linear: float
    """Linear, of the tool point: the three linear rows (m³ if all joints are revolute)."""
    angular: float
    """Angular: the three angular rows (dimensionless)."""


class JacobianAnswer(Answer):
    """The Jacobian of one configuration, its singular values and the manipulability."""

    jacobian: Matrix
    """6×n, row by row: rows 0–2 give the tool point's linear velocity (m per rad, or m per m for a sliding
    joint), rows 3–5 its angular velocity (rad per rad, or 0)."""
    manipulability: Manipulability
    """Distance from a singularity; 0 at one."""
    singular_values: list[float]
    """Singular values of the whole Jacobian, largest first (min(6, n) values; mixed units)."""


def jacobian_answers(robot: Robot, q: Array, frame: Literal["world", "tool"] = "world") -> list[JacobianAnswer]:
    """Jacobians of configurations ``(k, n)`` in radians (metres), along axes of the world frame or of the tool."""
    J = jacobian(robot, q, frame)
    columns = zip(
        J.tolist(),
        manipulability(robot, q, "all").tolist(),
        manipulability(robot, q, "linear").tolist(),
        manipulability(robot, q, "angular").tolist(),
        np.linalg.svd(J, compute_uv=False).tolist(),
        strict=True,
    )
    return [
        JacobianAnswer(rows, Manipulability(whole, linear, angular), values)
        for rows, whole, linear, angular, values in columns
    ]
