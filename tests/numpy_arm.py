"""Kinematics of an arm by NumPy alone, from the numbers of its table: what facts of lessons are compared with.

Nothing here calls the code that it checks: poses are products of four matrices for each row, Jacobians are
differences of poses.
"""

from __future__ import annotations

import math

import numpy as np

from kin import Robot

STEP = 1e-6  # rad or m


def pose(robot: Robot, q: np.ndarray) -> np.ndarray:
    """The pose ``(4, 4)`` of the tool."""
    return frames(robot, q)[-1] @ np.array(robot.tool)


def frames(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """The frame after each row of the table."""
    given, T, found = np.asarray(q).tolist(), np.array(robot.base), []
    joints = [row.name for row in robot.rows if row.kind != "fixed" and not row.follows]
    followed, values = dict(zip(joints, given, strict=True)), iter(given)
    for row in robot.rows:
        if row.kind == "fixed":
            value = 0.0
        elif row.follows:
            value = row.ratio * followed[row.follows]
        else:
            value = next(values)
        theta = row.theta + (value if row.kind == "revolute" else 0.0)
        d = row.d + (value if row.kind == "prismatic" else 0.0)
        about_z, along_x = _turn(2, theta) @ _shift(2, d), _shift(0, row.a) @ _turn(0, row.alpha)
        T = T @ (about_z @ along_x if robot.convention == "standard" else along_x @ about_z)
        found.append(T)
    return found


def jacobian(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Velocity of the tool point and angular velocity ``(6, n)`` in the base frame, by differences of poses."""
    J = np.zeros((6, len(q)))
    for i, e in enumerate(STEP * np.eye(len(q))):
        before, after = pose(robot, q - e), pose(robot, q + e)
        J[:3, i] = (after - before)[:3, 3] / (2 * STEP)
        W = (after - before)[:3, :3] / (2 * STEP) @ pose(robot, q)[:3, :3].T
        J[3:, i] = (W - W.T)[[2, 0, 1], [1, 2, 0]] / 2
    return J


def _turn(axis: int, angle: float) -> np.ndarray:
    T, (i, j) = np.eye(4), ((axis + 1) % 3, (axis + 2) % 3)
    T[i, i] = T[j, j] = math.cos(angle)
    T[j, i], T[i, j] = math.sin(angle), -math.sin(angle)
    return T


def _shift(axis: int, length: float) -> np.ndarray:
    T = np.eye(4)
    T[axis, 3] = length
    return T
