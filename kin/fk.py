"""Forward kinematics, Jacobian and manipulability: arrays in, arrays out.

Each function takes a robot, or the id of a built-in one, and one configuration ``(n,)`` or any batch ``(..., n)``;
it returns the same leading axes.

For a single configuration, checking the argument in Python takes longer than the kinematics. An array with one
axis is therefore passed to a compiled function, which checks it (:func:`kin.kernels.compile.direct`); any other
argument is validated and converted first.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.kernels import fk as fk_kernels
from kin.kernels import jacobian as jacobian_kernels
from kin.kernels.compile import direct
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array, is_plain

Part = Literal["all", "linear", "angular"]
_PARTS: dict[str, tuple[int, int]] = {"all": (0, 6), "linear": (0, 3), "angular": (3, 6)}
_POSE = (4, 4)
_empty, _ndarray = np.empty, np.ndarray


class _Compiled:
    """Kernels without the call around them (`kin.kernels.compile.direct`), each loaded on first use."""

    @cached_property
    def fk_one(self) -> Callable[[Array, Array, Array], bool]:
        return direct(fk_kernels.fk_one)

    @cached_property
    def fk_many(self) -> Callable[[Array, Array, Array], bool]:
        return direct(fk_kernels.fk_many)

    @cached_property
    def positions_many(self) -> Callable[[Array, Array, Array], bool]:
        return direct(fk_kernels.positions_many)

    @cached_property
    def jacobian_one(self) -> Callable[[Array, Array, Array], bool]:
        return direct(jacobian_kernels.jacobian_one)


_compiled = _Compiled()


def fk(robot: Robot | str, q: ArrayLike) -> Array:
    """Pose of the tool ``(..., 4, 4)`` in the world frame, metres, for configurations ``(..., n)``.

    Equation (2) of the chapter, ``T = A_1 … A_n``, for either convention.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` or any batch ``(..., n)`` of configurations, radians (metres for a slide).

    Returns:
        The poses, one for each configuration.

    Raises:
        InputError: q has another number of joints, or values that are not finite.

    Examples:
        >>> import kin
        >>> kin.fk("planar2r", [0.0, 0.0])[:3, 3]
        array([1.6, 0. , 0. ])
        >>> kin.fk("ur5", [[0.0] * 6] * 100).shape
        (100, 4, 4)
    """
    if not isinstance(robot, Robot):
        robot = robot_of(robot)
    if type(q) is _ndarray and q.ndim == 1:
        try:
            T = _empty(_POSE)
            if _compiled.fk_one(robot.model, q, T):
                return T
        except TypeError:  # not float64, or not contiguous
            pass
    q = _batch(robot, q)
    out = np.empty((*q.shape[:-1], 4, 4))
    if not _compiled.fk_many(robot.model, q.reshape(-1, robot.n), out.reshape(-1, 4, 4)):
        robot.check_q(q)
    return out


def fk_positions(robot: Robot | str, q: ArrayLike) -> Array:
    """Tool points ``(..., 3)`` in metres in the world frame, for configurations ``(..., n)``.

    The position column of `fk`, computed several times faster.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` or any batch ``(..., n)`` of configurations, radians (metres for a slide).

    Returns:
        The points, one for each configuration.

    Raises:
        InputError: as in `fk`.

    Examples:
        >>> import kin
        >>> kin.fk_positions("planar2r", [0.0, 0.0])
        array([1.6, 0. , 0. ])
    """
    robot = robot_of(robot)
    q = _batch(robot, q)
    out = np.empty((*q.shape[:-1], 3))
    if not _compiled.positions_many(robot.model, q.reshape(-1, robot.n), out.reshape(-1, 3)):
        robot.check_q(q)
    return out


def link_frames(robot: Robot | str, q: ArrayLike) -> Array:
    """Frame after every DH row, ``(..., rows, 4, 4)``: ``base A_1``, ``base A_1 A_2``, … in the world frame.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` or any batch ``(..., n)`` of configurations, radians (metres for a slide).

    Returns:
        The frames; the last one is that of the last row, without the tool.

    Raises:
        InputError: as in `fk`.

    Examples:
        >>> import kin
        >>> kin.link_frames("ur5", [0.0] * 6).shape
        (6, 4, 4)
    """
    robot = robot_of(robot)
    q = robot.check_q(q)
    frames = fk_kernels.frames_many(robot.model, q.reshape(-1, robot.n))
    return frames.reshape(*q.shape[:-1], len(robot.rows), 4, 4)


def jacobian(robot: Robot | str, q: ArrayLike, frame: Literal["world", "tool"] = "world") -> Array:
    """Geometric Jacobian ``(..., 6, n)``: twist of the tool point = J q̇.

    Rows 0–2 are the linear velocity of the tool point (m/s per rad/s or m/s), rows 3–5 the angular velocity,
    both with the axes of the world frame or of the tool.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` or any batch ``(..., n)`` of configurations, radians (metres for a slide).
        frame: whose axes the twist is given in: ``"world"`` or ``"tool"``.

    Returns:
        The Jacobians, one for each configuration.

    Raises:
        InputError: as in `fk`, or an unknown frame.

    Examples:
        >>> import kin
        >>> kin.jacobian("planar2r", [0.0, 0.0])[:2]
        array([[0. , 0. ],
               [1.6, 0.6]])
    """
    if not isinstance(robot, Robot):
        robot = robot_of(robot)
    if frame == "world":
        if type(q) is _ndarray and q.ndim == 1:
            try:
                J = _empty((6, len(q)))
                if _compiled.jacobian_one(robot.model, q, J):
                    return J
            except TypeError:  # as in `fk`
                pass
    elif frame != "tool":
        raise InputError("frame", frame, 'one of "world", "tool"')
    q = robot.check_q(q)
    J = jacobian_kernels.jacobian_many(robot.model, q.reshape(-1, robot.n)).reshape(*q.shape[:-1], 6, robot.n)
    if frame == "tool":
        R_T = np.swapaxes(fk(robot, q)[..., :3, :3], -1, -2)
        J = np.concatenate([R_T @ J[..., :3, :], R_T @ J[..., 3:, :]], axis=-2)
    return J


def manipulability(robot: Robot | str, q: ArrayLike, part: Part = "all") -> Array:
    """Yoshikawa's manipulability ``(...)``: the product of the singular values of the Jacobian.

    √det(J Jᵀ) for six or more joints, √det(Jᵀ J) for fewer (Yoshikawa, Int. J. Robotics Research 4(2), 1985).
    ``part`` takes only the three linear (m) or angular rows. Zero at a singularity.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` or any batch ``(..., n)`` of configurations, radians (metres for a slide).
        part: the rows that count: ``"all"``, ``"linear"`` or ``"angular"``.

    Returns:
        One value for each configuration.

    Raises:
        InputError: as in `fk`, or an unknown part.

    Examples:
        >>> import kin
        >>> bool(kin.manipulability("ur5", [0.0] * 6) < 1e-9)  # stretched out: singular
        True
    """
    if part not in tuple(_PARTS):
        raise InputError("part", part, "one of " + ", ".join(f'"{name}"' for name in _PARTS))
    robot = robot_of(robot)
    first, last = _PARTS[part]
    J = jacobian(robot, q)
    values = jacobian_kernels.manipulability_many(J.reshape(-1, 6, robot.n), first, last)
    return values.reshape(J.shape[:-2])


def _batch(robot: Robot, q: ArrayLike) -> Array:
    """`q` as a plain array ``(..., n)``; one that is already is returned as it is."""
    if is_plain(q) and q.shape[-1:] == robot.q_shape:
        return q
    return robot.check_q(q)
