"""The path as a result: errors measured by forward kinematics, jumps with their causes, gaps."""

from __future__ import annotations

import numpy as np

from kin.collision.sweep import Touch, touches_along
from kin.ik.avoidance import around
from kin.ik.branches import measure
from kin.ik.candidates import POSITION_ERROR, ROTATION_ERROR
from kin.ik.details import RollError
from kin.ik.results import Status
from kin.path.causes import jump_at
from kin.path.details import JointMove
from kin.path.results import PathGap, PathResult
from kin.path.search import DeadEnd
from kin.path.waypoints import LayerSequence, PathSettings, Waypoint, has_closed_form
from kin.transforms import Array


def report(sequence: LayerSequence, waypoints: list[Waypoint], q: Array, ends: list[DeadEnd]) -> PathResult:
    """The path ``(k, n)`` through all waypoints, with jumps, gaps and measured errors."""
    settings = sequence.settings
    stats = np.concatenate(
        [
            measure(waypoint.requested.without_turns(), row[None])[1]
            for waypoint, row in zip(waypoints, q, strict=True)
        ]
    )
    steps = settings.jumps(q, [1] * len(q))
    # The t-th jump is where the paths with fewer than t jumps end; a jump next to a gap is examined by itself.
    between = [i for i in steps if waypoints[i].gap is None and waypoints[i - 1].gap is None]
    forced = dict(zip(between, ends, strict=True)) if len(between) == len(ends) else {}
    jumps = tuple(jump_at(sequence, q, i, forced.get(i)) for i in steps)
    gaps = tuple(
        _gap(waypoint, i, float(stats[i, ROTATION_ERROR]))
        for i, waypoint in enumerate(waypoints)
        if waypoint.gap or waypoint.relaxed
    )
    closed_form = settings.problem.closed_form
    required = [waypoint.requested.requirement for waypoint in waypoints]
    position, rotation = stats[:, POSITION_ERROR].copy(), stats[:, ROTATION_ERROR].copy()
    contacts: tuple[Touch, ...] = ()
    if settings.problem.options.avoids:
        contacts = touches_along(around(settings.problem), q, steps, settings.problem.cancel)
    for array in (q, position, rotation):
        array.flags.writeable = False
    return PathResult(
        q=q,
        continuous=not jumps,
        jumps=jumps,
        gaps=gaps,
        position_error=position,
        rotation_error=rotation,
        solver=closed_form.name if closed_form is not None and has_closed_form(settings.problem) else "numeric",
        largest_step=_largest_step(settings, q),
        tolerances=(max(r.position for r in required), max(r.rotation for r in required)),
        target_error=max(waypoint.requested.target_error for waypoint in waypoints),
        contacts=contacts,
        avoids=settings.problem.options.avoids,
    )


def _gap(waypoint: Waypoint, index: int, rotation_error: float) -> PathGap:
    found = waypoint.gap
    if found is None:
        details = RollError(waypoint.requested.robot.n, rotation_error)
        return PathGap(index, Status.APPROXIMATE, "roll", details, waypoint.requested.task, 0.0)
    return PathGap(
        index, found.status, found.cause, found.details, found.task, found.distance, found.singularities
    )


def _largest_step(settings: PathSettings, q: Array) -> JointMove | None:
    if len(q) == 1:
        return None
    moves = settings.moves(q[:-1], q[1:]).max(axis=0)
    widest = int(np.argmax(moves))
    return settings.joint_move(widest, float(moves[widest]))
