"""Geometry of the ring of arm angles, and of the trade of two coaxial joints, without a scene.

In an arm with a spherical shoulder and wrist, the elbow can move on a circle about the line from shoulder to
wrist. The arm angle ψ is its position there: 0 where the elbow is highest (:mod:`kin.solvers.srs7`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app.viewer.self_motion import End
from kin import Robot, fk, link_frames
from kin.axes import inverse
from kin.ik import Redundancy
from kin.solvers import closed_form_of, srs7
from kin.solvers.reversed import ReversedJoints
from kin.transforms import Array, frame_from_approach

STEPS = 144
FLAT = 1e-6  # m; with a smaller circle, the arm is straight


@dataclass(frozen=True, eq=False)
class Circle:
    """The elbow's circle: shoulder, wrist, centre ``(3,)``, radius, and the directions of ψ = 0 and ψ = 90°."""

    shoulder: Array
    wrist: Array
    center: Array
    radius: float
    e1: Array
    e2: Array

    def at(self, psi: float, scale: float = 1.0) -> Array:
        """The elbow ``(3,)`` at an arm angle; `scale` widens the circle."""
        return self.center + scale * self.radius * (math.cos(psi) * self.e1 + math.sin(psi) * self.e2)


@dataclass(frozen=True, eq=False)
class Ring:
    """What the ring is about; it changes with the target, not during a self-motion.

    Attributes:
        goal, T_held: where the arm was heading ``(n,)``, and where the tool is held ``(4, 4)``.
        item: the parameter whose values are drawn; None: there is nothing to draw.
        ends: of its ranges.
    """

    robot: Robot
    goal: Array
    T_held: Array
    item: Redundancy | None
    ends: tuple[End, ...]


def elbow_circle(robot: Robot, q: Array) -> Circle | None:
    """The circle at a configuration ``(n,)``; None for another kind of arm."""
    match = closed_form_of(robot)
    form = match.form if isinstance(match, ReversedJoints) else match
    if not isinstance(form, srs7.Srs7):
        return None
    geometry = form.geometry
    M = geometry.inverse_base @ fk(robot, q) @ geometry.inverse_tool
    W = M[:3, 3]
    L = float(np.linalg.norm(W))
    d3, d5 = geometry.d3, geometry.d5
    if L < FLAT:
        return None
    u = W / L
    # In the triangle S–E–W: the elbow's distance along the line, and off it.
    along = (d3 * d3 - d5 * d5 + L * L) / (2.0 * L)
    off = math.sqrt(max(d3 * d3 - along * along, 0.0))
    level = math.hypot(u[0], u[1])
    # W on axis 1 has no highest elbow; the reference is then the base's x axis, as in the solver.
    e2 = np.array([u[1], -u[0], 0.0]) / level if level > 1e-12 else np.array([0.0, -math.copysign(1.0, u[2]), 0.0])
    e1 = np.cross(e2, u)
    base = inverse(geometry.inverse_base)
    R, p = base[:3, :3], base[:3, 3]
    return Circle(p, R @ W + p, R @ (along * u) + p, off, R @ e1, R @ e2)


def arc_segments(circle: Circle, intervals: Iterable[tuple[float, float]], scale: float) -> tuple[Array, Array]:
    """The whole circle as short chords ``(k, 2, 3)``, and which of them are feasible ``(k,)``.

    Chords are split at the ends of the ranges, so the ends are exact.
    """
    ranges = list(intervals)
    marks = {-math.pi + 2.0 * math.pi * i / STEPS for i in range(STEPS + 1)}
    marks |= {min(max(x, -math.pi), math.pi) for pair in ranges for x in pair}
    angles = sorted(marks)
    points = np.array([circle.at(a, scale) for a in angles])
    middles = [0.5 * (a + b) for a, b in pairwise(angles)]
    inside = np.array([any(low <= m <= high for low, high in ranges) for m in middles])
    return np.stack([points[:-1], points[1:]], axis=1), inside


def coaxial(robot: Robot) -> bool:
    """Whether joints 1 and 2 have the same axis: then one can turn back what the other turns."""
    if robot.n < 2 or not robot.revolute[:2].all():
        return False
    axes = [joint_axis(robot, robot.q_home, i) for i in (0, 1)]
    (p, a), (r, b) = axes
    return bool(np.linalg.norm(np.cross(a, b)) < 1e-9 and np.linalg.norm(np.cross(r - p, a)) < 1e-9)


def joint_axis(robot: Robot, q: Array, joint: int) -> tuple[Array, Array]:
    """A point of a joint's axis and its direction ``(3,)``, in the base frame."""
    row = robot.joint_rows[joint]
    frames = link_frames(robot, q)
    # In the standard convention joint i turns about z of the frame before it, in the modified one about its own.
    row -= robot.convention == "standard"
    frame = frames[row] if row >= 0 else robot.T_world_base
    return frame[:3, 3], frame[:3, 2]


def trade_segments(robot: Robot, q: Array, radius: float) -> tuple[Array, NDArray[np.int64]]:
    """Arcs of θ1 and, from its end on, of θ2 about their common axis, as chords ``(k, 2, 3)``.

    Also returns what each chord ``(k,)`` belongs to: 0 and 1 for the joints, 2 for the ray at the end of both,
    which does not move in a trade.
    """
    (_, z), (p, other) = (joint_axis(robot, q, joint) for joint in (0, 1))
    turns = float(q[0]), float(q[1] * np.sign(z @ other))  # both with the sign of joint 1
    x, y, _ = frame_from_approach(z).T  # the same for all configurations: the axis does not move
    chords: list[Array] = []
    numbers: list[int] = []
    start = 0.0
    for joint, width in ((0, radius), (1, 1.25 * radius)):
        end = start + turns[joint]
        points = [
            p + width * (math.cos(a) * x + math.sin(a) * y)
            for a in np.linspace(start, end, max(2, math.ceil(abs(end - start) / 0.08) + 1)).tolist()
        ]
        chords += [np.array(pair) for pair in pairwise(points)]
        # An arrow head: two strokes back from the tip.
        tip, turn = points[-1], math.copysign(1.0, end - start)
        forward = turn * (-math.sin(end) * x + math.cos(end) * y)
        out = math.cos(end) * x + math.sin(end) * y
        for side in (-1.0, 1.0):
            chords.append(np.array([tip - 0.22 * radius * forward + side * 0.12 * radius * out, tip]))
        numbers += [joint] * (len(points) + 1)
        start = end
    total = sum(turns)
    chords.append(np.array([p, p + 1.4 * radius * (math.cos(total) * x + math.sin(total) * y)]))
    numbers.append(2)
    return np.array(chords), np.array(numbers, dtype=np.int64)
