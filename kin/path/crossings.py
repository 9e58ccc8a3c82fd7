"""Waypoints at a singularity: further configurations, those that the neighbouring waypoints lead to.

Where a wrist is singular, only the sum of two joint values is determined; a closed form splits it near the seed. A
path that crosses such a waypoint needs the split of the configurations before and after it.
"""

from __future__ import annotations

import numpy as np

from kin.angles import images_near
from kin.fk import jacobian
from kin.path.configurations import distinct, near_solutions, with_images
from kin.path.waypoints import LayerSequence, has_closed_form
from kin.robot import Robot
from kin.transforms import Array

_SINGULAR = 1e-8  # of the product of the columns' lengths: below this a Jacobian is singular
_MOST = 64  # configurations of a neighbour that are led on


def with_crossings(sequence: LayerSequence, layers: list[Array]) -> list[Array]:
    """The layers, with more configurations at singular waypoints: from those before, then from those behind."""
    settings, out = sequence.settings, list(layers)
    robot = settings.problem.robot
    if robot.n > 6 or not has_closed_form(settings.problem):
        return out
    singular = [s for s, layer in enumerate(layers) if _any_singular(robot, layer)]
    for neighbour, order in ((-1, singular), (1, singular[::-1])):
        for s in order:
            if not 0 <= s + neighbour < len(out):
                continue
            problem, relaxed = sequence.waypoints[s].problem, sequence.waypoints[s].relaxed
            found = [near_solutions(settings, problem, relaxed, q)[:1] for q in _once(robot, out[s + neighbour])]
            more = with_images(problem, np.concatenate([out[s][:0], *found]))
            out[s] = distinct(problem, np.concatenate([out[s], more]), problem.seed)
    return out


def _any_singular(robot: Robot, q: Array) -> bool:
    """Whether some of the configurations ``(m, n)`` are singular."""
    J = jacobian(robot, q)
    J = J / np.linalg.norm(J, axis=1, keepdims=True)
    volume = np.abs(np.linalg.det(J)) if robot.n == 6 else np.linalg.svd(J, compute_uv=False).prod(axis=1)
    return bool((volume < _SINGULAR).any())


def _once(robot: Robot, q: Array) -> Array:
    """The configurations ``(m, n)``, one of those that are whole turns apart."""
    turned = np.where(robot.revolute, images_near(q), q)
    kept = np.unique(turned.round(7), axis=0, return_index=True)[1]
    return np.asarray(turned[np.sort(kept)[:_MOST]])
