"""The path of the elbow in the self-motion of an arm with seven joints of which one is given."""

from __future__ import annotations

import numpy as np

import kin
from app.viewer.lessons.redundancy.ring import joint_axis
from app.viewer.self_motion import INSET
from kin import Robot
from kin.angles import apart
from kin.ik import Redundancy
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE
from kin.transforms import Array

STEPS = 48  # samples of each range
_ELBOW = 3  # joint 4


def has_path(robot: Robot, item: Redundancy) -> bool:
    """Whether the elbow of the arm moves with this parameter, on a path without a simple form."""
    form = closed_form_of(robot)
    return form is not None and not form.exact_ranges and item.name == form.redundancies(POSE)[0].name


def elbow_paths(robot: Robot, T: Array, q: Array, item: Redundancy) -> list[tuple[tuple[float, float], Array]]:
    """Where the elbow is for the feasible values of a joint, the tool at T ``(4, 4)``: (range, points ``(k, 3)``).

    On the branch of q ``(n,)``; where branches have no names, only the range around the present value.
    """
    named = bool(kin.branch_names(robot))
    paths: list[tuple[tuple[float, float], Array]] = []
    for low, high in item.intervals:
        if not named and not low <= item.value <= high:
            continue
        inset = min(INSET, 0.5 * (high - low))
        values = np.linspace(low + inset, high - inset, STEPS)
        rows = kin.ik_branches(robot, np.broadcast_to(T, (STEPS, 4, 4)), values)
        if named:
            found = rows[:, kin.branch_names(robot).index(kin.branch_of(robot, q))]
        else:
            found = _followed(rows, int(np.abs(values - item.value).argmin()), q)
        found = found[~np.isnan(found[:, 0])]
        if len(found) > 1:
            paths.append(((low, high), np.array([joint_axis(robot, row, _ELBOW)[0] for row in found])))
    return paths


def _followed(rows: Array, start: int, q: Array) -> Array:
    """The rows ``(k, n)`` of ``(k, branches, n)`` that continue a configuration ``(n,)`` at index `start`."""
    out = np.full((len(rows), rows.shape[2]), np.nan)
    for order in (range(start, len(rows)), range(start, -1, -1)):
        near = q
        for i in order:
            away = apart(rows[i], near)
            if np.isnan(away).all():
                break
            near = out[i] = rows[i, int(np.nanargmin(away))]
    return out
