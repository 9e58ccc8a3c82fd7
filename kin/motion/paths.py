"""Segments that are driven without a stop: their curves, corners, joint path and limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kin.fk import fk, fk_positions, jacobian
from kin.motion.geometry.chain import Chain
from kin.motion.geometry.curves import Corner, Curve, Line, Through, Turning, arc_through, natural, turning
from kin.motion.geometry.splines import parted, spline, values
from kin.motion.geometry.tables import corner_at
from kin.motion.limits import MotionLimits
from kin.motion.pieces import JointMotion
from kin.motion.program import Circ, JointTarget, Lin, Move, Ptp, Spline, Target
from kin.motion.timing.timed import JointPath, shortest
from kin.robot import Robot
from kin.transforms import Array

NO_LENGTH = 1e-9  # metres: a shorter curve is none
SMALLEST = 1e-3  # of a segment: with limits of jerk, a smaller corner takes longer than a stop
_INTERVALS = 240  # of a path, at least, when it is timed
_FREE = 1e6  # the largest ṡ² where nothing else limits it
_TOOL_MARGIN = 1e-4  # part of a limit of the tool kept free for what lies between the points that are looked at
_SAMPLES, _TOOL_SHARE = 400, 1e-3  # points of a PTP at which the tool's speed is looked at, and what lies between
_LOOK, _LOOKS = 48, 3  # points at which the distance from a corner is measured, and how often, ever closer
_NODES = 33  # of a curve of the joints or a part of a corner


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Where the segments of a path are.

    Attributes:
        starts: s where each part, a segment's rest or a corner, begins, and the end.
        owners: the segments of each part: one, or two at a corner.
        bounds: s where each segment begins, in the middle of its corner, and the end.
    """

    starts: Array
    owners: tuple[tuple[int, ...], ...]
    bounds: Array

    @classmethod
    def of(cls, lengths: list[float], radii: list[float], first: int) -> Layout:
        """Segments of these lengths from index `first` on, with corners of these radii between them."""
        starts, bounds = [0.0], [0.0]
        owners: list[tuple[int, ...]] = []
        for k, length in enumerate(lengths):
            before, after = (radii[k - 1] if k else 0.0), (radii[k] if k < len(radii) else 0.0)
            rest = length - before - after
            if rest > NO_LENGTH:
                starts.append(starts[-1] + rest)
                owners.append((first + k,))
            if k < len(radii):
                bounds.append(starts[-1] + after)
                starts.append(starts[-1] + 2.0 * after)
                owners.append((first + k, first + k + 1))
        return cls(np.array(starts), tuple(owners), np.array([*bounds, starts[-1]]))


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Segments that are one path of the joints.

    Attributes:
        layout: where they are.
        knots, pieces: q(s): knots ``(k + 1,)`` and coefficients ``(k, n, 4)``.
        ends: configurations ``(m + 1, n)`` between which the m segments lead if the arm stops at each target.
    """

    layout: Layout
    knots: Array
    pieces: Array
    ends: Array


def pose_of(robot: Robot, target: Target, before: Array) -> Array:
    """The pose ``(4, 4)`` of a target; `before` is the pose at the start of the segment."""
    return fk(robot, np.array(target.q)) if isinstance(target, JointTarget) else target.pose(before)


def curve_of(
    robot: Robot, segment: Lin | Circ | Spline, before: Array, roll: bool
) -> Curve | tuple[str, str] | None:
    """The curve of a segment from a pose on; for a `Circ` what `arc_through` says if there is none.

    Where the roll is not kept, the approach direction takes the shortest way.
    """
    if isinstance(segment, Spline):
        poses = [before]
        for point in segment.points:
            T = pose_of(robot, point, poses[-1])
            if np.abs(T - poses[-1]).max() > NO_LENGTH:
                poses.append(T)
        return Through.of(np.array(poses)) if len(poses) > 1 else Line(before[:3, 3], np.zeros(3), _still(before))
    T = pose_of(robot, segment.target, before)
    turn = turning(before[:3, :3], T[:3, :3], not roll or segment.orientation == "two-axis")
    if isinstance(segment, Lin):
        return Line(before[:3, 3], T[:3, 3] - before[:3, 3], turn)
    return arc_through(before[:3, 3], np.array(segment.via), T[:3, 3], turn)


def _still(before: Array) -> Turning:
    return turning(before[:3, :3], before[:3, :3], False)


def radius_of(blend: float, before: Curve, after: Curve) -> tuple[float, float]:
    """The radius (in s) of the corner between two curves for a zone of `blend` metres, and the metres used."""
    used, most = np.inf, np.inf
    for curve in (before, after):
        most = min(most, 0.5 * curve.length)
        used = min(used, blend * curve.length / curve.metres if curve.metres > NO_LENGTH else blend)
    radius = float(min(used, most))
    return radius, float(blend * min(1.0, radius / used))


def left_out(radius: float, *lengths: float) -> Literal["short", "small"] | None:
    """Why there is no corner of this radius between segments of these lengths, all in s; None if there is one."""
    if min(lengths) < NO_LENGTH:
        return "short"
    return "small" if radius < SMALLEST * max(lengths) else None


def chained(curves: list[Curve], radii: list[float], layout: Layout) -> Chain:
    """The curves with their corners."""
    parts: list[Curve] = []
    offsets = []
    for k, curve in enumerate(curves):
        before, after = (radii[k - 1] if k else 0.0), (radii[k] if k < len(radii) else 0.0)
        if curve.length - before - after > NO_LENGTH:
            parts.append(curve)
            offsets.append(before)
        if k < len(radii):
            parts.append(Corner(curve, curves[k + 1], after))
            offsets.append(0.0)
    return Chain(parts, offsets, layout.starts)


@dataclass(frozen=True, slots=True, eq=False)
class JointCurve:
    """A line or spline of the joints: s is the largest motion of a joint."""

    knots: Array
    pieces: Array

    @classmethod
    def through(cls, rows: Array) -> JointCurve:
        """Through configurations ``(k, n)``; those that repeat the one before are left out."""
        steps = np.abs(rows[1:] - rows[:-1]).max(axis=1)  # as np.diff, in a third of its time
        moves = steps > NO_LENGTH
        if not moves.all():
            rows = rows[np.concatenate([[True], moves])]
            steps = np.abs(rows[1:] - rows[:-1]).max(axis=1)
        if len(rows) < 2:
            return cls(np.zeros(1), np.empty((0, rows.shape[1], 4)))
        knots = np.zeros(len(rows))
        np.cumsum(steps, out=knots[1:])
        return cls(knots, natural(knots, rows))

    @property
    def length(self) -> float:
        """Where s ends."""
        return float(self.knots[-1])

    def at(self, s: Array) -> Array:
        """Configurations ``(m, n)``."""
        return values(self.knots, self.pieces, s)


def joint_radius(robot: Robot, blend: float, before: JointCurve, after: JointCurve) -> float:
    """The radius (in s) of the corner between two curves of the joints for a zone of `blend` metres."""
    if after.length < NO_LENGTH:
        return 0.0
    most = 0.5 * min(before.length, after.length)
    back = _within(robot, lambda s: before.at(before.length - s), blend, most)
    return min(back, _within(robot, after.at, blend, most))


def _within(robot: Robot, at: Callable[[Array], Array], blend: float, most: float) -> float:
    """How far s may go, at most, so that the tool stays within `blend` metres of where it is at s = 0."""
    met = fk_positions(robot, at(np.zeros(1)))[0]
    low, high = 0.0, most
    for _ in range(_LOOKS):
        s = np.linspace(low, high, _LOOK)
        away = np.linalg.norm(fk_positions(robot, at(s)) - met, axis=1) > blend
        if not away.any():
            return high
        k = int(np.argmax(away))
        low, high = float(s[max(k - 1, 0)]), float(s[k])
    return low


def _dense(run: Run) -> Run:
    """A path with enough knots for a spline through them; a PTP alone has two."""
    if len(run.knots) >= _NODES:
        return run
    parts = np.full(len(run.pieces), -(-_NODES // len(run.pieces)))
    return Run(run.layout, *parted(run.knots, run.pieces, parts), run.ends)


def joined(robot: Robot, first: Run, second: Run, blend: float) -> tuple[Run, float] | None:
    """Two paths as one, with a corner of the joints between them; and the zone in metres that it takes.

    None if the corner is too small for one of the paths.

    s of the second is scaled, so that the corner takes as much of both.
    """
    first, second = _dense(first), _dense(second)
    radii = []
    length, met = first.knots[-1], values(second.knots, second.pieces, np.zeros(1))[0]
    for run, end in ((first, True), (second, False)):
        starts, bounds, at = run.layout.starts, run.layout.bounds, run.knots[-1] if end else 0.0
        rest, own = (float(part[-1] - part[-2] if end else part[1]) for part in (starts, bounds))

        def near(s: Array, run: Run = run, at: float = at, sign: float = -1.0 if end else 1.0) -> Array:
            return values(run.knots, run.pieces, at + sign * s)

        radii.append(_within(robot, near, blend, min(rest, 0.5 * own)))
        if left_out(radii[-1], own):
            return None
    r, scale = radii[0], radii[0] / radii[1]
    knots, pieces = second.knots * scale, second.pieces / scale ** np.arange(4.0)
    u = np.linspace(0.0, 1.0, 2 * _NODES - 1)
    back, ahead = np.array([corner_at(float(part), r) for part in u]).T
    rows = values(first.knots, first.pieces, length + back) + values(knots, pieces, ahead) - met
    away = np.linalg.norm(fk_positions(robot, rows[[0, -1]]) - fk_positions(robot, met), axis=1)
    close = 1e-3 * r / _NODES
    early, late = first.knots < length - r - close, knots > r + close
    s = np.concatenate([first.knots[early], length - r + 2.0 * r * u, length + knots[late]])
    before = values(first.knots, first.pieces, first.knots[early])
    after = values(knots, pieces, knots[late])
    layout = Layout(
        np.concatenate(
            [first.layout.starts[:-1], [length - r, length + r], length + scale * second.layout.starts[1:]]
        ),
        (*first.layout.owners, (first.layout.owners[-1][-1], second.layout.owners[0][0]), *second.layout.owners),
        np.concatenate([first.layout.bounds, length + scale * second.layout.bounds[1:]]),
    )
    ends = np.concatenate([first.ends, second.ends[1:]])
    return Run(layout, s, spline(s, np.concatenate([before, rows, after])), ends), float(away.min())


def joint_path(curves: list[JointCurve], radii: list[float], layout: Layout) -> tuple[Array, Array]:
    """Knots and coefficients of curves of the joints with their corners."""
    s, rows = [np.zeros(1)], [curves[0].at(np.zeros(1))]
    begin = 0.0
    for k, curve in enumerate(curves):
        before, after = (radii[k - 1] if k else 0.0), (radii[k] if k < len(radii) else 0.0)
        rest = curve.length - before - after
        if rest > NO_LENGTH:
            own = np.linspace(before, curve.length - after, _NODES)[1:]
            s.append(begin + own - before)
            rows.append(curve.at(own))
            begin += rest
        if k < len(radii):
            u = np.linspace(0.0, 1.0, _NODES)[1:]
            first, second = np.array([corner_at(float(part), after) for part in u]).T
            following = curves[k + 1]
            s.append(begin + 2.0 * after * u)
            rows.append(curve.at(curve.length + first) + following.at(second) - following.at(np.zeros(1)))
            begin += 2.0 * after
    knots, nodes = np.concatenate(s), np.concatenate(rows)
    return knots, spline(knots, nodes)


def limited(
    robot: Robot, limits: MotionLimits, moves: Mapping[int, Move], layout: Layout, knots: Array, pieces: Array
) -> JointPath:
    """A path with its limits, on a grid that is fine enough to time it."""
    parts = np.full(len(pieces), max(1, -(-_INTERVALS // len(pieces))))
    knots, pieces = parted(knots, pieces, parts)
    part = _parts_of(layout, knots)
    scales = np.ones((len(layout.owners), 3))
    tool = np.full((len(layout.owners), 2), np.inf)
    for k, owners in enumerate(layout.owners):
        own = [moves[i] for i in owners]
        scales[k, 0] = min(move.speed for move in own)
        scales[k, 1:] = min(move.acceleration for move in own)
        tool[k, 0] = min(np.inf if move.tool_speed is None else move.tool_speed for move in own)
        tool[k, 1] = min(np.inf if move.tool_turn is None else move.tool_turn for move in own)
    base = np.stack([limits.velocity, limits.acceleration, limits.jerk], axis=1)
    most = np.full(len(pieces), _FREE)
    if np.isfinite(tool).any():
        most = np.minimum(most, _tool_limit(robot, knots, pieces, tool[part]))
    return JointPath(knots, pieces, base * scales[part][:, None, :], most)


def _parts_of(layout: Layout, knots: Array) -> NDArray[np.int64]:
    """Which part of the layout each interval between knots ``(k + 1,)`` belongs to ``(k,)``."""
    middle = 0.5 * (knots[:-1] + knots[1:])
    return np.clip(np.searchsorted(layout.starts, middle, side="right") - 1, 0, len(layout.owners) - 1)


def _tool_limit(robot: Robot, knots: Array, pieces: Array, tool: Array) -> Array:
    """The largest ṡ² on each interval that limits of the tool's speed and turning ``(k, 2)`` allow."""
    h, p = np.diff(knots)[:, None], np.moveaxis(pieces, -1, 0)
    largest = np.zeros((len(pieces), 2))
    for f in (0.0, 0.5, 1.0):
        d = f * h
        q, slope = p[0] + d * (p[1] + d * (p[2] + d * p[3])), p[1] + d * (2.0 * p[2] + 3.0 * d * p[3])
        twist = (jacobian(robot, np.ascontiguousarray(q)) @ slope[..., None])[..., 0]
        sizes = np.stack([np.linalg.norm(twist[:, :3], axis=1), np.linalg.norm(twist[:, 3:], axis=1)], axis=1)
        largest = np.maximum(largest, sizes)
    with np.errstate(divide="ignore"):
        speed = np.where(largest > 0.0, tool / largest, np.inf).min(axis=1)
    return np.asarray(np.minimum((speed * (1.0 - _TOOL_MARGIN)) ** 2, _FREE))


def alone(robot: Robot, limits: MotionLimits, segment: Ptp, run: Run) -> JointMotion:
    """A PTP from rest to rest."""
    start, end = values(run.knots, run.pieces, run.knots[[0, -1]])
    scaled = np.stack([limits.velocity, limits.acceleration, limits.jerk], axis=1)
    scaled *= (segment.speed, segment.acceleration, segment.acceleration)
    piece = JointMotion.between(start, end, scaled)
    slower = tool_slowdown(robot, segment, piece)
    return piece if slower == 1.0 else JointMotion.between(start, end, scaled / slower ** np.arange(1.0, 4.0))


def stopping_times(limits: MotionLimits, moves: list[Move], run: Run, path: JointPath, jerk: bool) -> list[float]:
    """About how long each segment takes from rest to rest, rather less than more.

    It takes at least as long as a PTP between the same configurations. The other estimate is the time of the path
    with stops in the middle of its corners, without limits of jerk, and what these cost on a straight path.
    """
    cuts, found = np.searchsorted(path.knots, run.layout.bounds - NO_LENGTH).tolist(), []
    corners = np.array([len(owners) > 1 for owners in run.layout.owners])[_parts_of(run.layout, path.knots)]
    most = np.where(corners, _FREE, path.most)  # in a corner that is of both segments
    base = np.stack([limits.velocity, limits.acceleration, limits.jerk], axis=1)
    for k, (move, start, end) in enumerate(zip(moves, run.ends[:-1], run.ends[1:], strict=True)):
        own = base * (move.speed, move.acceleration, move.acceleration if jerk else np.inf)
        part = slice(cuts[k], cuts[k + 1])
        rows = np.broadcast_to(own, path.limits[part].shape).copy()
        knots = path.knots[cuts[k] : cuts[k + 1] + 1]
        plain = shortest(JointPath(knots, path.joints[part], rows, most[part]))
        least = JointMotion.between(start, end, own).duration
        free = move.tool_speed is None and move.tool_turn is None
        found.append(max(least, _with_jerk(plain, own) if jerk and free else plain))
    return found


def _with_jerk(plain: float, limits: Array) -> float:
    """Seconds from rest to rest on a straight path with limits ``(n, 3)``; `plain`: without those of jerk."""
    ramp, rise = (float((limits[:, i] / limits[:, i + 1]).min()) for i in (0, 1))
    cost = rise if ramp > rise else 2.0 * math.sqrt(ramp * rise) - ramp
    return min(plain + cost, 2.0 * math.cbrt(rise * plain * plain))


def tool_slowdown(robot: Robot, move: Move, piece: JointMotion) -> float:
    """The factor by which a motion has to be slower for the tool's limits of speed and turning, at least 1."""
    if move.tool_speed is None and move.tool_turn is None:
        return 1.0
    q, qd, _, _ = piece.at(np.linspace(0.0, piece.duration, _SAMPLES))
    twist = (jacobian(robot, q) @ qd[..., None])[..., 0]
    parts = zip((twist[:, :3], twist[:, 3:]), (move.tool_speed, move.tool_turn), strict=True)
    most = max(float(np.linalg.norm(v, axis=1).max()) / limit for v, limit in parts if limit is not None)
    return max(1.0, most * (1.0 + _TOOL_SHARE))


def is_joint_move(segment: Move) -> bool:
    """Whether a segment is a curve of the joints, not of the tool."""
    return isinstance(segment, Ptp) or (isinstance(segment, Spline) and isinstance(segment.points[0], JointTarget))
