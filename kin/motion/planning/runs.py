"""Segments that are driven without a stop, as one path of the joints, or why they cannot be driven."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from kin.fk import fk
from kin.ik import solve_ik
from kin.ik.results import Status
from kin.motion.details import (
    BlendLeftOut,
    BlendShortened,
    Cause,
    LimitMet,
    NoCircle,
    NotReached,
    RefusalDetails,
    TargetOutside,
)
from kin.motion.geometry.chain import ROWS, Chain, LostError, followed
from kin.motion.geometry.curves import Curve, poses
from kin.motion.geometry.splines import turning_points, values
from kin.motion.geometry.tracking import settle
from kin.motion.paths import (
    NO_LENGTH,
    JointCurve,
    Layout,
    Run,
    chained,
    curve_of,
    is_joint_move,
    joint_path,
    joint_radius,
    left_out,
    radius_of,
)
from kin.motion.planning.plan import Plan, RefusedError
from kin.motion.program import Circ, JointTarget, Lin, Pause, Ptp, Spline, Target
from kin.motion.refusals import helps_at, helps_for, limit_met, lost, outside, violations
from kin.motion.tasks import CODES
from kin.transforms import Array

_REST = 9  # places of the rest of a segment that are asked how far out of reach they are


def run_from(plan: Plan, first: int) -> Run | None:
    """The segments from this one on that are one path of the joints or of the tool; None if it has no length.

    `plan.done` becomes the index after them, and `plan.q` where they end.
    """
    return _joint_run(plan, first) if is_joint_move(plan.move(first)) else _tool_run(plan, first)


def _follows(plan: Plan, index: int, length: float) -> bool:
    """Whether a segment is blended into the next one; if not although it was asked for, a note says why."""
    if plan.move(index).blend == 0.0 or index in plan.stops:
        return False
    why: Literal["last", "short", "dwell"] | None = None
    following = plan.program.segments[index + 1 : index + 2]
    if not following:
        why = "last"
    elif isinstance(following[0], Pause):
        why = "dwell"
    elif length < NO_LENGTH:
        why = "short"
    elif is_joint_move(following[0]) != is_joint_move(plan.move(index)):
        return False
    if why is not None:
        plan.notes.append(BlendLeftOut(index, why))
    return why is None


def _joint_run(plan: Plan, first: int) -> Run | None:
    """PTP and splines of the joints, blended into each other or alone."""
    robot, q = plan.robot, plan.q
    curves: list[JointCurve] = []
    radii: list[float] = []
    ends = [q]
    index = first
    while True:
        segment = plan.program.segments[index]
        assert isinstance(segment, Ptp | Spline)
        points = segment.points if isinstance(segment, Spline) else (segment.target,)
        rows = [q]
        for point in points:
            rows.append(configuration_of(plan, index, point, rows[-1]))
        curve = JointCurve.through(np.array(rows))
        if curves:
            radius = joint_radius(robot, plan.move(index - 1).blend, curves[-1], curve)
            why = left_out(radius, curves[-1].length, curve.length)
            if why:
                plan.notes.append(BlendLeftOut(index - 1, why))
                break
            radii.append(radius)
        curves.append(curve)
        q = rows[-1]
        ends.append(q)
        index += 1
        if not _follows(plan, index - 1, curve.length):
            break
    plan.q, plan.done = q, index
    if curves[0].length < NO_LENGTH:
        return None
    layout = Layout.of([curve.length for curve in curves], radii, first)
    if len(curves) == 1 and isinstance(plan.program.segments[first], Ptp):
        return Run(layout, curves[0].knots, curves[0].pieces, np.array(ends))
    run = Run(layout, *joint_path(curves, radii, layout), np.array(ends))
    check_limits(plan, run, ())
    return run


def _tool_run(plan: Plan, first: int) -> Run | None:
    """Lines, arcs and splines of the tool, blended into each other or alone."""
    robot, before = plan.robot, fk(plan.robot, plan.q)
    curves: list[Curve] = []
    radii: list[float] = []
    index = first
    while True:
        segment = plan.program.segments[index]
        assert isinstance(segment, Lin | Circ | Spline)
        curve = curve_of(robot, segment, before, plan.task != "approach")
        if curve is None or isinstance(curve, tuple):
            raise plan.refused(index, "circle", NoCircle(curve))
        if curves:
            blend = plan.move(index - 1).blend
            radius, used = radius_of(blend, curves[-1], curve)
            why = left_out(radius, curves[-1].length, curve.length)
            if why:
                plan.notes.append(BlendLeftOut(index - 1, why))
                break
            radii.append(radius)
            if used < blend * (1.0 - 1e-9):
                plan.notes.append(BlendShortened(index - 1, blend, used))
        curves.append(curve)
        if curve.length >= NO_LENGTH:
            before = poses(curve, np.array([curve.length]))[0]
        index += 1
        if not _follows(plan, index - 1, curve.length):
            break
    plan.done = index
    if curves[0].length < NO_LENGTH:
        return None
    layout = Layout.of([curve.length for curve in curves], radii, first)
    chain = chained(curves, radii, layout)
    try:
        knots, pieces = followed(robot, chain, plan.q, CODES[plan.task], plan.cancel)
    except LostError as error:
        raise _lost(plan, layout, chain, error) from None
    run = Run(layout, knots, pieces, _ends(plan, curves, values(knots, pieces, layout.bounds)))
    check_limits(plan, run, chain)
    plan.q = robot.clip(values(run.knots, run.pieces, run.knots[-1:])[0])
    return run


def _ends(plan: Plan, curves: list[Curve], near: Array) -> Array:
    """Configurations ``(k + 1, n)`` between which the curves lead without corners; `near`: those of the path."""
    ends = np.array([poses(curve, np.array([curve.length]))[0] for curve in curves[:-1]]).reshape(-1, 4, 4)
    inner = np.ascontiguousarray(near[1:-1])
    settle(plan.robot.model, ends, ROWS[CODES[plan.task]], inner, np.empty(len(inner)))
    return np.concatenate([near[:1], inner, near[-1:]])


def _lost(plan: Plan, layout: Layout, chain: Chain, error: LostError) -> RefusedError:
    """The refusal of a path that the joints cannot follow."""
    robot = plan.robot
    met = limit_met(robot, error.s[:-1], error.q[:-1], _settled(plan, chain))
    s = float(error.s[-1])
    if met is not None:
        cause: Cause = "limits"
        s, violation = met
        details: RefusalDetails = LimitMet(violation)
    else:
        end = float(layout.bounds[np.searchsorted(layout.bounds[:-1], s, side="left")])
        poses = chain.poses(np.linspace(s, end, _REST))
        cause, details = lost(robot, poses, error.q[-2], plan.task)
    return _refused_at(plan, layout, chain, s, cause, details)


def _settled(plan: Plan, chain: Chain) -> Callable[[float, Array], Array]:
    """The configuration at a place of the tool's path, from one that is close to it."""

    def at(s: float, near: Array) -> Array:
        q = near[None].copy()
        settle(plan.robot.model, chain.poses(np.array([s])), ROWS[CODES[plan.task]], q, np.empty(1))
        return np.asarray(q[0])

    return at


def check_limits(plan: Plan, run: Run, chain: Chain | tuple[()]) -> None:
    """Refuse a path that leaves the limits of the joints anywhere."""

    def driven(s: float, near: Array) -> Array:
        return np.asarray(values(run.knots, run.pieces, np.array([s]))[0])

    s = turning_points(run.knots, run.pieces)
    at = driven if isinstance(chain, tuple) else _settled(plan, chain)
    met = limit_met(plan.robot, s, values(run.knots, run.pieces, s), at)
    if met is not None:
        raise _refused_at(plan, run.layout, chain, met[0], "limits", LimitMet(met[1]))


def _refused_at(
    plan: Plan, layout: Layout, chain: Chain | tuple[()], s: float, cause: Cause, details: RefusalDetails
) -> RefusedError:
    """The refusal at a place of a path."""
    k = int(np.clip(np.searchsorted(layout.bounds, s, side="right") - 1, 0, len(layout.bounds) - 2))
    low, high = float(layout.bounds[k]), float(layout.bounds[k + 1])
    fraction = (s - low) / (high - low)
    if isinstance(chain, tuple):
        return plan.refused(layout.owners[0][0] + k, cause, details, (), (fraction, 0.0))
    grid = np.linspace(0.0, s, 65)
    points = chain.poses(grid[grid >= low])[:, :3, 3]
    distance = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    poses = chain.poses(np.linspace(0.0, high, 65))

    def can_follow(q: Array) -> bool:
        try:
            knots, pieces = followed(plan.robot, chain, q, CODES[plan.task], plan.cancel)
        except LostError:
            return False
        return not outside(plan.robot, values(knots, pieces, np.linspace(0.0, float(knots[-1]), 999))).any()

    helps = helps_for(plan.robot, poses, plan.q, plan.task, cause, can_follow, plan.limits.velocity)
    return plan.refused(layout.owners[0][0] + k, cause, details, helps, (fraction, distance))


def configuration_of(plan: Plan, index: int, target: Target, q: Array) -> Array:
    """Where a PTP ends ``(n,)``; `q`: where it begins."""
    robot = plan.robot
    if isinstance(target, JointTarget):
        end = np.array(target.q)
        outside = violations(robot, end)
        if outside:
            raise plan.refused(index, "target", TargetOutside(outside))
        return robot.clip(end)
    T = target.pose(fk(robot, q))
    if plan.program.task is None and plan.task != "pose":
        # An arm of few joints may meet the whole pose nevertheless.
        result = solve_ik(robot, T, q_seed=q, task="pose")
        if result.status is Status.SOLVED:
            return robot.clip(result.solutions[0].q)
    result = solve_ik(robot, T, q_seed=q, task=plan.task)
    if result.status is not Status.SOLVED:
        facts = NotReached(result.details, result.cause, result.task, result.singularities)
        raise plan.refused(index, "unreachable", facts, helps_at(robot, T, q, result))
    return robot.clip(result.solutions[0].q)
