"""An arm in the forms that other libraries take, all derived from its DH table.

Everything starts from ``T = C_0 Rz(q_1) C_1 Rz(q_2) … Rz(q_n) C_n`` with constant C_i: any DH table, standard or
modified, with fixed rows anywhere, is of that form. Three tricks let solvers for six joints solve arms of five and
seven joints:

- a *virtual roll*: a sixth joint about the tool's z axis makes "point and approach direction" a whole pose; a
  sixth joint about the tool's x axis, of which only the solutions at zero count, makes a whole pose of any five;
- a *locked joint*: one of seven joints at a fixed value becomes part of a constant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kin.axes import frame_of, inverse, screw_x, screw_z
from kin.robot import Robot
from kin.transforms import Array

_NEAR = 1e-9


@dataclass(frozen=True, eq=False)
class Arm:
    """Joints about or along z between constant transforms ``(n + 1, 4, 4)``.

    Attributes:
        slides: indices of the prismatic joints. Only forward kinematics knows them: `lines` and what is made of it
            are those of arms whose joints all turn.
    """

    constants: Array
    slides: frozenset[int] = frozenset()

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.constants) - 1

    def with_roll(self) -> Arm:
        """The same arm with one more joint, about the tool's z axis."""
        return Arm(np.concatenate([self.constants, np.eye(4)[None]]))

    def with_turn(self) -> Arm:
        """The same arm with one more joint, about the tool's x axis: at zero it changes nothing."""
        to_x = frame_of(np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.zeros(3))
        constants = self.constants.copy()
        constants[-1] = constants[-1] @ to_x
        return Arm(np.concatenate([constants, inverse(to_x)[None]]))

    def locked(self, joint: int, value: float) -> Arm:
        """The same arm with one joint locked at `value` radians."""
        before, after = self.constants[joint], self.constants[joint + 1]
        merged = before @ screw_z(value, 0.0) @ after
        return Arm(np.concatenate([self.constants[:joint], merged[None], self.constants[joint + 2 :]]))

    def fk(self, q: Array) -> Array:
        """T_base_tool ``(..., 4, 4)`` of configurations ``(..., n)``, by plain matrix products."""
        T = np.broadcast_to(self.constants[0], (*q.shape[:-1], 4, 4))
        c, s = np.cos(q), np.sin(q)
        for i in range(self.n):
            moved = np.zeros((*q.shape[:-1], 4, 4))
            moved[..., np.arange(4), np.arange(4)] = 1.0
            if i in self.slides:
                moved[..., 2, 3] = q[..., i]
            else:
                moved[..., 0, 0] = moved[..., 1, 1] = c[..., i]
                moved[..., 1, 0] = s[..., i]
                moved[..., 0, 1] = -s[..., i]
            T = T @ moved @ self.constants[i + 1]
        return np.asarray(T)

    def lines(self, q: Array) -> tuple[Array, Array, Array]:
        """Direction ``(n, 3)`` of and a point ``(n, 3)`` on each joint axis, and T_base_tool, at q ``(n,)``."""
        T = self.constants[0]
        directions, points = np.empty((self.n, 3)), np.empty((self.n, 3))
        for i in range(self.n):
            directions[i], points[i] = T[:3, 2], T[:3, 3]
            T = T @ screw_z(float(q[i]), 0.0) @ self.constants[i + 1]
        return directions, points, T

    @cached_property
    def screws(self) -> tuple[Array, Array, Array]:
        """Axes H ``(n, 3)`` and offsets P ``(n + 1, 3)`` at q = 0, and the tool's rotation ``(3, 3)`` there.

        The point taken on each axis is the one it shares with its neighbour, from the wrist inwards: solvers by
        geometric decomposition read off vanishing offsets that axes meet.
        """
        directions, points, tool = self.lines(np.zeros(self.n))
        points = points.copy()
        shared = [False] * self.n
        for i in range(self.n - 2, -1, -1):
            meeting = _meeting(points[i], directions[i], points[i + 1], directions[i + 1])
            if meeting is None:
                continue
            if not shared[i + 1]:
                points[i] = points[i + 1] = meeting
            elif _distance(points[i + 1], points[i], directions[i]) < _NEAR:
                points[i] = points[i + 1]
            else:
                continue
            shared[i] = shared[i + 1] = True
        stations = np.concatenate([np.zeros((1, 3)), points, tool[None, :3, 3]])
        return directions, np.diff(stations, axis=0), tool[:3, :3]

    @cached_property
    def family(self) -> str:
        """Name of the constructor of ik-geo that fits the six joints; "" if there is no closed form."""
        H, P, _ = self.screws
        if self.n != 6:
            return ""
        spherical = max(abs(P[4]).max(), abs(P[5]).max()) < _NEAR
        if spherical and _parallel(H[1], H[2]):
            return "spherical_two_parallel"
        if spherical and abs(P[1]).max() < _NEAR:
            return "spherical_two_intersecting"
        if spherical:
            return "spherical"
        if _parallel(H[1], H[2]) and _parallel(H[2], H[3]):
            return "three_parallel_two_intersecting" if abs(P[5]).max() < _NEAR else "three_parallel"
        return ""


@dataclass(frozen=True, eq=False)
class Ortho:
    """An arm with a parallel base and a spherical wrist as OPW parameters (Brandstötter, Angerer, Hofbaur 2014).

    Attributes:
        lengths: a1, a2, b, c1, c2, c3, c4 in metres.
        upright: ``(6,)`` our joints where the OPW arm is at zero, standing upright.
        signs: ``(6,)``; ours = upright + signs · theirs.
        tool: ``(4, 4)`` pose of our tool in their flange frame.
    """

    lengths: dict[str, float]
    upright: Array
    signs: Array
    tool: Array


def ortho(arm: Arm) -> Ortho | None:
    """The arm as OPW parameters; None if its geometry differs or axis 1 is not the z axis of the base."""
    if arm.family != "spherical_two_parallel":
        return None
    q = np.zeros(6)
    y, z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    directions, points, _ = arm.lines(q)
    if abs(abs(directions[0, 2]) - 1.0) > _NEAR or np.hypot(*points[0, :2]) > _NEAR:
        return None
    centre = _meeting(points[3], directions[3], points[4], directions[4])
    if centre is None:
        return None
    # Bring the arm upright joint by joint: each turn moves the next link to its place in the OPW model.
    q[0] = _turn(directions[0], directions[1], y)
    directions, points, _ = arm.lines(q)
    q[1] = _turn(directions[1], points[2] - points[1], z)
    directions, points, _ = arm.lines(q)
    centre = _meeting(points[3], directions[3], points[4], directions[4])
    if centre is None:
        return None
    along = directions[3] * (1.0 if directions[3] @ (centre - points[2]) >= 0.0 else -1.0)
    q[2] = _turn(directions[2], along, z)
    directions, points, _ = arm.lines(q)
    q[3] = _turn(directions[3], directions[4], y)
    directions, points, _ = arm.lines(q)
    q[4] = _turn(directions[4], directions[5], z)
    directions, points, tool = arm.lines(q)
    centre = _meeting(points[3], directions[3], points[4], directions[4])
    wanted = np.array([z, y, y, z, y, z])
    signs = np.round((directions * wanted).sum(axis=1))
    if centre is None or abs(directions - signs[:, None] * wanted).max() > 1e-6:
        return None
    shoulder, elbow = points[1], points[2]
    lengths = {
        "a1": float(shoulder[0]),
        "a2": float(centre[0] - elbow[0]),
        "b": float(centre[1]),
        "c1": float(shoulder[2]),
        "c2": float(elbow[2] - shoulder[2]),
        "c3": float(centre[2] - elbow[2]),
        "c4": 0.0,
    }
    flange = np.eye(4)
    flange[:3, 3] = centre
    return Ortho(lengths, q, signs, np.linalg.inv(flange) @ tool)


def arm_of(robot: Robot) -> Arm:
    """The constants of a robot, and which of its joints slide."""
    constants = [robot.T_world_base.copy()]
    for row in robot.rows:
        x = screw_x(row.a, row.alpha)
        if robot.convention == "modified":
            constants[-1] = constants[-1] @ x
        if row.kind != "fixed":
            constants.append(np.eye(4))
        constants[-1] = constants[-1] @ screw_z(row.theta, row.d)
        if robot.convention == "standard":
            constants[-1] = constants[-1] @ x
    constants[-1] = constants[-1] @ robot.T_last_tool
    return Arm(np.array(constants), frozenset(np.flatnonzero(~robot.revolute).tolist()))


def _parallel(u: Array, v: Array) -> bool:
    return bool(np.linalg.norm(np.cross(u, v)) < _NEAR)


def _distance(point: Array, origin: Array, direction: Array) -> float:
    """Distance of a point from a line in metres."""
    return float(np.linalg.norm(np.cross(point - origin, direction)))


def _meeting(p: Array, u: Array, q: Array, v: Array) -> Array | None:
    """Intersection of the lines p + s u and q + t v; None if they are skew or parallel."""
    normal = np.cross(u, v)
    square = float(normal @ normal)
    if square < _NEAR**2 or abs(float(normal @ (q - p))) / math.sqrt(square) > _NEAR:
        return None
    return np.asarray(p + u * float(np.cross(q - p, v) @ normal) / square)


def _turn(axis: Array, vector: Array, wanted: Array) -> float:
    """Angle about `axis` from `vector` to `wanted`, both projected onto the plane perpendicular to it."""
    return math.atan2(
        float(axis @ np.cross(vector, wanted)), float(vector @ wanted - (axis @ vector) * (axis @ wanted))
    )
