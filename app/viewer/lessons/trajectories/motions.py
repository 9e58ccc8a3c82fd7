"""What the lesson computes: profiles of one joint, two ways between two poses, a line past an axis, a swinging
load."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

import kin
from app.viewer import profiles
from app.viewer.profiles import Profile
from kin import Robot
from kin.motion import JointTarget, Lin, Motion, PoseTarget, Ptp, motion_limits
from kin.transforms import Array

SAMPLES = 161
ROOM, TIME_STEP = 1.05, 0.06  # of the time of a sketch: how much more than it needs, and its step (s)
STEPS = (0.6, 0.45, 0.3, 0.2, 0.12, 0.06)  # parts of a joint's way that are tried for the two poses
SLOWEST, FASTEST, DAMPING = 2.0, 25.0, 0.01  # Hz of the swinging load, and part of the critical damping
AFTER = 8  # periods of swinging that are shown


class Example(NamedTuple):
    """The motion of one joint that all profiles make: index and name of the joint, its way, and its limits
    ``(3,)``."""

    joint: int
    name: str
    way: float
    limits: Array


@lru_cache(maxsize=64)
def example(robot: Robot) -> Example:
    """The first joint from rest to rest over a way on which it reaches its largest velocity."""
    limits = motion_limits(robot)
    found = np.array([limits.velocity[0], limits.acceleration[0], limits.jerk[0]])
    v, a, j = found.tolist()
    return Example(0, robot.joints[0].name, 1.5 * (v * v / a + v * a / j), found)


class Sketched(NamedTuple):
    """What the student sketches: a way (rad or m) of the example's joint, and its time (s)."""

    way: float
    time: float

    @property
    def trapezoid(self) -> Array:
        """Velocities at the ends of sixths of the time ``(7,)``: two are a ramp, two the plateau, two a ramp."""
        return 1.5 * self.way / self.time * np.array([0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0])


def sketched(robot: Robot) -> Sketched:
    """A round way and time; a trapezoid with two ramps of a third of it covers the way within the limits."""
    _, _, way, (v, a, _) = example(robot)
    step = math.radians(10.0) if robot.revolute[0] else 0.05
    way = max(round(way / step), 1) * step
    # Its plateau is 1.5 way / T, and its ramps are of T / 3.
    least = max(1.5 * way / v, math.sqrt(4.5 * way / a))
    return Sketched(way, math.ceil(ROOM * least / TIME_STEP) * TIME_STEP)


def joint_ends(robot: Robot) -> tuple[Array, Array]:
    """Home with the example's joint at the start and at the end of its way, as near to home as its limits allow.

    Both are home if the way is longer than the joint's range.
    """
    joint, _, way, _ = example(robot)
    low, high = float(robot.lower[joint]), float(robot.upper[joint])
    start, end = robot.q_home.copy(), robot.q_home.copy()
    if way <= high - low:
        start[joint] = min(max(float(robot.q_home[joint]) - 0.5 * way, low), high - way)
        end[joint] = start[joint] + way
    return start, end


@lru_cache(maxsize=64)
def family(robot: Robot) -> dict[str, Profile]:
    """The fastest profile of each kind within the limits of the example's joint."""
    _, _, way, limits = example(robot)
    return profiles.fastest(way, limits)


def sampled(profile: Profile, scale: float) -> tuple[Array, tuple[Array, ...]]:
    """Times ``(k,)``, and position, velocity, acceleration and jerk at them, in a unit that has `scale` in a
    radian."""
    inner = profile.breaks[1:-1]
    times = np.sort(np.concatenate([np.linspace(0.0, profile.duration, SAMPLES), inner - 1e-9, inner + 1e-9]))
    return times, tuple(profile.sample(times) * scale)


class Ways(NamedTuple):
    """The same two poses joined in two ways."""

    ptp: Motion
    lin: Motion

    def off_line(self) -> tuple[Array, Array]:
        """Times, and the distance of the tool from the straight line on the PTP (m)."""
        times = np.linspace(0.0, self.ptp.duration, SAMPLES)
        points = self.ptp.sample(times).T[:, :3, 3]
        way = points[-1] - points[0]
        along = way / np.linalg.norm(way)
        return times, np.linalg.norm(np.cross(points - points[0], along), axis=1)


@lru_cache(maxsize=64)
def ways(robot: Robot) -> Ways | None:
    """Two poses of the arm about its home, far apart, that a line joins too; None: there are none among those
    tried."""
    low = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    high = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    span = np.minimum(high - low, 2.0)
    for part in STEPS:
        start = robot.clip(robot.q_home - 0.5 * part * span * _signs(robot.n))
        end = robot.clip(robot.q_home + 0.5 * part * span * _signs(robot.n))
        lin = kin.plan_motion(robot, [Lin(target=PoseTarget.of(kin.fk(robot, end)))], start)
        moved = np.linalg.norm(kin.fk(robot, end)[:3, 3] - kin.fk(robot, start)[:3, 3])
        if lin.planned and moved > 1e-3:
            stop = tuple(lin.derivatives(lin.duration)[0].tolist())
            return Ways(kin.plan_motion(robot, [Ptp(target=JointTarget(stop))], start), lin)
    return None


def _signs(n: int) -> Array:
    """Mostly the first joint, which swings the tool about its axis."""
    return np.array([1.0, 0.3, -0.3, 0.2, 0.0, 0.0, 0.0, 0.0][:n] + [0.0] * max(0, n - 8))


def turning_past(offset: float, speed: float, half: float) -> tuple[Array, Array]:
    """Along a line of length 2 `half` past an axis at a distance: places (m), and how fast the axis must turn
    (rad/s)."""
    x = np.linspace(-half, half, 2 * SAMPLES + 1)
    return x, speed * offset / (x * x + offset * offset)


def both_elbows(
    start: tuple[float, float], end: tuple[float, float], links: tuple[float, float]
) -> tuple[Array, Array]:
    """Joint 1 of an arm with two links along a line in its plane.

    Returns:
        Parts of the line ``(k,)``, and the angles ``(2, k)`` with the elbow positive and negative, without a jump.
    """
    share = np.linspace(0.0, 1.0, SAMPLES)
    x, y = (a + share * (b - a) for a, b in zip(start, end, strict=True))
    first, second = links
    cosine = (x * x + y * y - first * first - second * second) / (2.0 * first * second)
    elbow = np.arccos(cosine)
    aside = np.arctan2(second * np.sin(elbow), first + second * cosine)
    direction = np.unwrap(np.arctan2(y, x))
    return share, np.stack([direction - aside, direction + aside])


def frequency(robot: Robot) -> float:
    """Of the load that swings (Hz): its period is as long as a ramp of the S-curve, within what is usual."""
    _, _, _, (_, a, j) = example(robot)
    return float(np.clip(j / a, SLOWEST, FASTEST))


def swing(profile: Profile, hertz: float) -> tuple[Array, Array]:
    """Times, and how far a load on a spring at the joint is away from its rest, while the joint moves and after.

    The load obeys ``x'' + 2 ζ ω x' + ω² x = -q''``; a step is exact for an acceleration that is constant in it.
    """
    step = 0.01 / hertz
    times = np.arange(0.0, profile.duration + AFTER / hertz, step)
    inside = times + 0.5 * step < profile.duration
    push = np.where(inside, profile.sample(times + 0.5 * step)[2], 0.0)
    omega = 2.0 * np.pi * hertz
    decay, turn = DAMPING * omega, omega * (1.0 - DAMPING**2) ** 0.5
    c, s, e = np.cos(turn * step), np.sin(turn * step), np.exp(-decay * step)
    A = e * np.array([[c + decay / turn * s, s / turn], [-(omega**2) / turn * s, c - decay / turn * s]])
    state, found = np.zeros(2), np.empty(len(times))
    for k, each in enumerate(push.tolist()):
        found[k] = state[0]
        rest = np.array([-each / omega**2, 0.0])
        state = rest + A @ (state - rest)
    return times, found


def residual(profile: Profile, hertz: float) -> float:
    """The largest swing after the joint has stopped."""
    times, x = swing(profile, hertz)
    return float(np.abs(x[times >= profile.duration]).max())
