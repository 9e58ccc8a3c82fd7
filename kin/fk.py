"""Forward kinematics, Jacobian and manipulability: arrays in, arrays out.

Each function takes one configuration ``(n,)`` or any batch ``(..., n)`` and returns the same leading axes.
"""

from __future__ import annotations

from math import isfinite
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from kin import kernels
from kin.errors import InputError
from kin.robot import Robot
from kin.transforms import Array

Part = Literal["all", "linear", "angular"]
_PARTS: dict[str, tuple[int, int]] = {"all": (0, 6), "linear": (0, 3), "angular": (3, 6)}


def fk(robot: Robot, q: ArrayLike) -> Array:
    """Pose of the tool, T_base_tool ``(..., 4, 4)``, for configurations ``(..., n)`` in radians (metres).

    Equation (2) of the chapter, ``T = A_1 … A_n``, for either convention.
    """
    if type(q) is np.ndarray and q.shape == robot.q_shape and q.dtype == np.float64 and q.flags.carray:
        T = kernels.fk_one(robot.model, q)
        if isfinite(T.item(3)):  # any NaN or infinity in q reaches every entry of the position
            return T
    q = _writable(robot.check_q(q))
    if q.ndim == 1:
        return kernels.fk_one(robot.model, q)
    return kernels.fk_many(robot.model, q.reshape(-1, robot.n)).reshape(*q.shape[:-1], 4, 4)


def link_frames(robot: Robot, q: ArrayLike) -> Array:
    """Frame after every DH row, ``(..., rows, 4, 4)``: ``A_1``, ``A_1 A_2``, … in the base frame."""
    q = _writable(robot.check_q(q))
    frames = kernels.frames_many(robot.model, q.reshape(-1, robot.n))
    return frames.reshape(*q.shape[:-1], len(robot.rows), 4, 4)


def jacobian(robot: Robot, q: ArrayLike, frame: Literal["base", "tool"] = "base") -> Array:
    """Geometric Jacobian ``(..., 6, n)``: twist of the tool point = J q̇.

    Rows 0–2 are the linear velocity of the tool point (m/s per rad/s or m/s), rows 3–5 the angular velocity,
    both expressed in the base frame, or in the tool's own frame with ``frame="tool"``.
    """
    if frame not in ("base", "tool"):
        raise InputError("frame", frame, 'one of "base", "tool"')
    q = _writable(robot.check_q(q))
    J = kernels.jacobian_many(robot.model, q.reshape(-1, robot.n)).reshape(*q.shape[:-1], 6, robot.n)
    if frame == "tool":
        R_T = np.swapaxes(fk(robot, q)[..., :3, :3], -1, -2)
        J = np.concatenate([R_T @ J[..., :3, :], R_T @ J[..., 3:, :]], axis=-2)
    return J


def manipulability(robot: Robot, q: ArrayLike, part: Part = "all") -> Array:
    """Yoshikawa's manipulability ``(...)``: the product of the singular values of the Jacobian.

    √det(J Jᵀ) for six or more joints, √det(Jᵀ J) for fewer (Yoshikawa, Int. J. Robotics Research 4(2), 1985).
    ``part`` takes only the three linear (m) or angular rows. Zero at a singularity.
    """
    if part not in tuple(_PARTS):
        raise InputError("part", part, "one of " + ", ".join(f'"{name}"' for name in _PARTS))
    first, last = _PARTS[part]
    J = jacobian(robot, q)
    values = kernels.manipulability_many(J.reshape(-1, 6, robot.n), first, last)
    return values.reshape(J.shape[:-2])


def _writable(q: Array) -> Array:
    """Kernels are compiled once, for writable arrays: a read-only one would cost a second compilation."""
    return q if q.flags.writeable else q.copy()
