"""Motions out of a singularity that keep the tool where it is: self-motions of an arm with joints to spare.

The configurations that meet a pose are curves where the arm is regular. Curves cross at singular configurations,
and some strata of these are surfaces: at a singular wrist two joints may turn against each other, whatever the
elbow does. A straight motion is projected onto the configurations that meet the pose by Newton steps of least
length (`kept_along`). Where none leads to the margin, they are explored in waves from the start, until one gets
there (`explored`); the first wave that does has the fewest strides.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kin.differential.task import LOST
from kin.escape.search import Measure
from kin.transforms import Array
from kin.way.free import Space
from kin.way.results import path_length

_STEP = 0.01  # rad, or a share of the reach, between waypoints
_MET = 1e-9  # of the pose, radians and shares of the arm's size
_NEWTON = 12
_STRIDE = 0.2  # of a wave
_APART = 0.15  # of two configurations of a wave
_WAVES, _MOST = 36, 2000
_FAN = 12  # directions of a stride
_REACHED = 4  # configurations beyond the margin to which motions are made


def onto_pose(measure: Measure, T: Array, q: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Configurations q ``(k, n)`` moved onto a pose T ``(4, 4)``, and whether they then meet it ``(k,)``."""
    for _ in range(_NEWTON):
        missing = measure.error(q, T)
        if np.abs(missing).max() < 0.1 * _MET:
            break
        U, s, Vt = np.linalg.svd(measure.jacobian(q), full_matrices=False)
        parts = np.divide(np.einsum("kmr,km->kr", U, missing), s, out=np.zeros_like(s), where=s > LOST)
        parts[:, measure.rank :] = 0.0
        parts *= np.minimum(1.0, _STRIDE / np.maximum(np.abs(parts).max(axis=1, keepdims=True), 1e-12))
        q = q + np.einsum("kri,kr->ki", Vt, parts) / measure.joints
    return q, np.asarray(np.abs(measure.error(q, T)).max(axis=1) < _MET)


def kept_along(measure: Measure, space: Space, T: Array, q: Array, margin: float) -> Array | None:
    """Waypoints ``(k, n)`` along a polyline q ``(c, n)`` at all of which the tool is at the pose T ``(4, 4)``.

    None if there are none nearby, or they do not lead to the margin.
    """
    parts = [q[:1]]
    for a, b in pairwise(q):
        count = max(1, math.ceil(np.linalg.norm((b - a) * measure.joints) / _STEP))
        parts.append(a + np.arange(1, count + 1)[:, None] / count * (b - a))
    on, met = onto_pose(measure, T, np.concatenate(parts))
    on[0] = q[0]
    smooth = np.linalg.norm(np.diff(on, axis=0) * measure.joints, axis=1).max() < 3.0 * _STEP
    inside = ((on >= space.lower) & (on <= space.upper)).all()
    return on if met.all() and smooth and inside and measure.sigma(on[-1]) >= margin else None


def explored(measure: Measure, space: Space, start: Array, T: Array, margin: float) -> list[Array]:
    """Waypoints ``(k, n)`` of motions from the start that keep the tool and reach the margin; empty: none did."""
    nodes, parents = start[None], np.array([-1])
    front = np.array([0])
    fan = _fan()
    for _ in range(_WAVES):
        space.cancel()
        # Of a node within the margin, the directions that move the tool least. A third one where curves cross.
        null = np.linalg.svd(measure.jacobian(nodes[front]))[2][:, -3:]
        trial = nodes[front][:, None] + _STRIDE * np.einsum("fc,kci->kfi", fan, null) / measure.joints
        trial, origin = trial.reshape(-1, measure.robot.n), np.repeat(front, len(fan))
        trial, met = onto_pose(measure, T, trial)
        moved = np.linalg.norm((trial - nodes[origin]) * measure.joints, axis=1)
        inside = np.all((trial >= space.lower) & (trial <= space.upper), axis=1)
        good = np.flatnonzero(met & inside & (moved > 0.5 * _APART) & (moved < 2.0 * _STRIDE))
        fresh: list[int] = []
        for i in good.tolist():
            others = np.concatenate([nodes, trial[fresh]])
            if np.linalg.norm((others - trial[i]) * measure.joints, axis=1).min() > _APART:
                fresh.append(i)
        front = np.arange(len(nodes), len(nodes) + len(fresh))
        nodes, parents = np.concatenate([nodes, trial[fresh]]), np.concatenate([parents, origin[fresh]])
        beyond = front[measure.sigma(nodes[front]) >= margin] if len(front) else front
        found = [
            _shortest(measure, space, T, _back(nodes, parents, i), margin) for i in beyond[:_REACHED].tolist()
        ]
        reached = [q for q in found if q is not None]
        if reached or not len(front) or len(nodes) > _MOST:
            return reached
    return []


def _shortest(measure: Measure, space: Space, T: Array, q: Array, margin: float) -> Array | None:
    """The shortest of the motions along a polyline q ``(c, n)`` and along its ends with one corner, if any."""
    bent = [q, *(q[[0, k, -1]] for k in range(1, len(q) - 1))]
    found = [kept_along(measure, space, T, each, margin) for each in bent]
    lengths = [np.inf if each is None else path_length(measure.robot, each) for each in found]
    return found[int(np.argmin(lengths))]


def _fan() -> Array:
    """Directions ``(k, 3)``: around in the plane of the last two, and out of it."""
    turns = np.linspace(0.0, 2.0 * math.pi, _FAN, endpoint=False)
    plane = np.stack([np.zeros(_FAN), np.cos(turns), np.sin(turns)], axis=1)
    return np.concatenate([plane, [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]])


def _back(nodes: Array, parents: Array, last: int) -> Array:
    """The nodes from the start to one of them ``(c, n)``."""
    path = [last]
    while parents[path[-1]] >= 0:
        path.append(int(parents[path[-1]]))
    return nodes[path[::-1]]
