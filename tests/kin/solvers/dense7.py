"""Every posture of an arm with seven joints at a target: a dense search that shares no formula with the solvers.

Forward kinematics, Jacobian and Newton's method are those of this module, in numpy, many postures at a time.
Descents start from random configurations and from given postures, with one joint held at each of many values. What
they find is then moved along its self-motion into the limits, if it is not far from these: so narrow intervals are
found, too.
"""

from __future__ import annotations

import math

import numpy as np

PI = math.pi


def _screw(axis, angle, length):
    c, s = math.cos(angle), math.sin(angle)
    R = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]
    T = np.eye(4)
    T[:3, :3] = R
    T["xyz".index(axis), 3] = length
    return T


class Chain:
    """A table as a product of constant transforms and rotations about z."""

    def __init__(self, robot):
        self.robot = robot
        at, self.fixed = np.array(robot.T_world_base), []
        for row in robot.rows:
            turn, link = _screw("z", row.theta, row.d), _screw("x", row.alpha, row.a)
            if row.kind == "fixed":
                at = at @ (turn @ link if robot.convention == "standard" else link @ turn)
            elif robot.convention == "standard":
                self.fixed.append(at)
                at = turn @ link
            else:
                self.fixed.append(at @ link)
                at = turn
        self.fixed.append(at @ robot.T_last_tool)
        self.lower, self.upper = robot.lower, robot.upper

    def look(self, q):
        """Poses ``(k, 4, 4)`` and Jacobians ``(k, 6, 7)`` in the base frame of configurations ``(k, 7)``."""
        R = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        p = np.zeros((len(q), 3))
        axes, points = [], []
        for i, F in enumerate(self.fixed):
            p = p + R @ F[:3, 3]
            R = R @ F[:3, :3]
            if i < 7:
                axes.append(R[:, :, 2])
                points.append(p)
                c, s = np.cos(q[:, i, None]), np.sin(q[:, i, None])
                x, y = R[:, :, 0], R[:, :, 1]
                R = np.stack([c * x + s * y, c * y - s * x, R[:, :, 2]], axis=2)
        J = np.empty((len(q), 6, 7))
        for i in range(7):
            J[:, :3, i] = np.cross(axes[i], p - points[i])
            J[:, 3:, i] = axes[i]
        T = np.zeros((len(q), 4, 4))
        T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = R, p, 1.0
        return T, J

    def axes(self, q):
        """Points ``(7, 3)`` and directions ``(7, 3)`` of the joint axes at a configuration ``(7,)``."""
        T, points, directions = np.eye(4), [], []
        for i, F in enumerate(self.fixed[:7]):
            T = T @ F
            points.append(T[:3, 3])
            directions.append(T[:3, 2])
            T = T @ _screw("z", q[i], 0.0)
        return points, directions

    def left(self, T, target):
        """The twist ``(k, 6)`` from poses to the target."""
        e = np.empty((len(T), 6))
        e[:, :3] = target[:3, 3] - T[:, :3, 3]
        D = target[:3, :3] @ T[:, :3, :3].transpose(0, 2, 1)
        v = 0.5 * np.stack([D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]], axis=1)
        sine = np.linalg.norm(v, axis=1)
        angle = np.arctan2(sine, 0.5 * (np.trace(D, axis1=1, axis2=2) - 1.0))
        e[:, 3:] = v * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 1.0)[:, None]
        return e

    def outside(self, q):
        """How far each joint is outside its limits ``(k, 7)`` at its best whole turn, negative inside, and on
        which side."""
        half, middle = 0.5 * (self.upper - self.lower), 0.5 * (self.upper + self.lower)
        off = np.remainder(q - middle + PI, 2 * PI) - PI
        return np.where(half < PI, np.abs(off) - half, -1.0), np.sign(off)


def newton(chain, target, q, joint, values, steps=25):
    """Postures from starts ``(k, 7)`` with a joint held at values ``(k,)``, those that meet the target."""
    q = q.copy()
    q[:, joint] = values
    others = [i for i in range(7) if i != joint]
    done = []
    for step in range(steps):
        T, J = chain.look(q)
        e = chain.left(T, target)
        miss = np.abs(e).max(axis=1)
        met = miss < 1e-12
        done.append(q[met])
        keep = ~met & ((miss < 0.5) if step > 9 else True) & ((miss < 1e-3) if step > 17 else True)
        q, J, e = q[keep], J[keep][:, :, others], e[keep]
        if not len(q):
            break
        A = J.transpose(0, 2, 1) @ J + (1e-3 * (e**2).sum(axis=1) + 1e-18)[:, None, None] * np.eye(6)
        x = np.linalg.solve(A, (J.transpose(0, 2, 1) @ e[:, :, None]))[:, :, 0]
        x *= np.minimum(1.0, 1.0 / np.maximum(np.abs(x).max(axis=1), 1e-300))[:, None]
        q[:, others] += x
    found = np.concatenate(done)
    return np.remainder(found + PI, 2 * PI) - PI


def slide(chain, target, q, move, steps=1):
    """Postures ``(k, 7)`` moved by `move` ``(k,)`` along their self-motions, and the unit tangents there."""
    for step in range(steps + 3):
        T, J = chain.look(q)
        e = chain.left(T, target)
        U, s, V = np.linalg.svd(J)
        n = V[:, 6] * np.sign(np.linalg.det(np.concatenate([J, V[:, 6:]], axis=1)))[:, None]
        x = np.einsum("kji,kj->ki", V[:, :6], np.einsum("kji,kj->ki", U, e) / np.maximum(s, 1e-9))
        if step < steps:
            x = x + n * (move / steps)[:, None]
        elif np.abs(e).max(initial=0.0) < 1e-12:
            break
        q = q + np.clip(x, -0.3, 0.3)
    return q, n, np.abs(e).max(axis=1) < 1e-10


def into_limits(chain, target, q, rounds=40):
    """Postures ``(k, 7)`` moved along their self-motions until inside the limits; those that get there."""
    found = []
    move = np.zeros(len(q))
    for _ in range(rounds):
        if not len(q):
            break
        q, n, met = slide(chain, target, q, move)
        out, side = chain.outside(q)
        inside = (out <= 0.0).all(axis=1) & met
        found.append(q[inside])
        keep = ~inside & met & (out.max(axis=1) < 0.6)
        q, n, out, side = q[keep], n[keep], out[keep], side[keep]
        worst = out.argmax(axis=1)
        rows = np.arange(len(q))
        rate = n[rows, worst] * side[rows, worst]
        move = -np.clip((out[rows, worst] + 1e-7) / np.where(rate == 0.0, 1e-9, rate), -0.1, 0.1)
    return np.concatenate([q[:0], *found])


def distinct(q, apart=1e-5):
    """The different ones of postures ``(k, 7)``."""
    if not len(q):
        return q
    q = np.remainder(q + PI, 2 * PI) - PI
    _, first = np.unique(np.round(q / apart).astype(np.int64), axis=0, return_index=True)
    return q[np.sort(first)]


def postures(chain, target, joint, values, starts, rng, random=200):
    """Postures inside the limits ``(k, 7)`` found at each of the values of a joint.

    starts: postures ``(k, 7)`` of another arm, from which a descent begins as well, at the nearest of the values
    and without a joint held.
    """
    held = np.repeat(values, random)
    found = newton(chain, target, rng.uniform(-PI, PI, (len(held), 7)), joint, held)
    if len(starts):
        nearest = values[np.abs(values[None] - starts[:, joint, None]).argmin(axis=1)]
        found = np.concatenate([found, newton(chain, target, starts, joint, nearest)])
        free, _, met = slide(chain, target, starts, np.zeros(len(starts)))
        found = np.concatenate([found, free[met]])
    out, _ = chain.outside(found)
    near = distinct(found[out.max(axis=1) < 0.5], 1e-4)
    out, _ = chain.outside(near)
    inside = (out <= 0.0).all(axis=1)
    return distinct(np.concatenate([near[inside], into_limits(chain, target, near[~inside])]))


def width(chain, target, q, joint, step=2e-5, most=60):
    """The range of a joint around a posture ``(7,)`` inside the limits, up to where it ends or `most` steps."""
    ends = []
    for sense in (-1.0, 1.0):
        at, start = q[None], None
        last = q[joint]
        for _ in range(most):
            there, n, met = slide(chain, target, at, np.array([sense * step]))
            start = n[0, joint] if start is None else start
            out, _ = chain.outside(there)
            if not met[0] or (out > 0.0).any() or n[0, joint] * start < 0.0:
                break
            at, last = there, there[0, joint]
        ends.append(last)
    return abs(ends[1] - ends[0])
