"""Capsules that stand for the links of an arm: segments with a radius.

Robot files may state them. A DH table says where the axes are and nothing about bodies, so for other arms they
are assumed: each link is a tube along its lengths d and a, and what slides is a rod that reaches back to its joint
when it is drawn out. A tool that no stated capsule reaches is a tube from the last frame to the tool point.

Which links are compared: not two that share a joint, nor two that touch in nearly every configuration, such as a
forearm and the flange behind a wrist without lengths, nor two that touch at the home configuration, nor two with
one link between them that overlap by less than half of the thinner radius, whatever the configuration: capsules
are not exact enough for what is so close. Where only some of the capsules of two links touch in nearly every
configuration, the others are compared unless they overlap as little. Against obstacles, all that some joint moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kin.collision.kernels import distances_of_pairs, least_distance
from kin.fitting.tubes import ORIGIN, SHORTEST, radius_of, tubes
from kin.named import robot_of
from kin.robot import Capsule, Robot
from kin.transforms import Array

SAMPLES, ALWAYS = 256, 0.95  # links that touch in more of the random configurations are never compared
SHALLOW = 0.5  # of the thinner radius: what links with one link between them may overlap
_STILL = 1e-9  # m


@dataclass(frozen=True, eq=False)
class Bodies:
    """The capsules of an arm as arrays for the kernels, and which of them are compared.

    Attributes:
        capsules: in the order of the links.
        rows: ``(m,)``, as `Capsule.row`.
        shape: ``(m, 8)``: start, end, radius, radius of a ball around it.
        pairs: ``(p, 2)`` indices of capsules that could meet.
        moving: ``(w,)`` indices of the capsules that some joint moves.
    """

    capsules: tuple[Capsule, ...]
    rows: NDArray[np.int64]
    shape: Array
    pairs: NDArray[np.int64]
    moving: NDArray[np.int64]


def capsules(robot: Robot | str) -> tuple[Capsule, ...]:
    """The capsules of an arm, base first: those of its robot file, else assumed ones.

    Args:
        robot: the arm, or the id of a built-in one.

    Returns:
        The capsules; each says which link it stands for.

    Raises:
        UnknownRobotError: an id that does not exist.

    Examples:
        >>> import kin
        >>> len(kin.collision.capsules("ur5")) > 6
        True
    """
    return bodies_of(robot_of(robot)).capsules


@lru_cache(maxsize=64)
def bodies_of(robot: Robot, home_is_free: bool = True) -> Bodies:
    """The capsules of an arm, and the pairs of links that are compared.

    Args:
        home_is_free: whether links that touch at the home configuration are not compared.
    """
    nominal = robot.nominal_arm
    if nominal is not None and {row.name for row in nominal.rows} <= {row.name for row in robot.rows}:
        return _moved(bodies_of(nominal, home_is_free), nominal, robot)
    found = _with_tool(robot) if robot.capsules else _assumed(robot)
    rows = np.array([each.row for each in found], np.int64)
    shape = np.array(
        [(*c.start, *c.end, c.radius, c.radius + 0.5 * math.dist(c.start, c.end)) for c in found]
    ).reshape(-1, 8)
    pairs = np.array(
        [
            (i, j)
            for i, first in enumerate(found)
            for j, second in enumerate(found)
            if second.link > first.link + 1
        ],
        np.int64,
    ).reshape(-1, 2)
    q = np.vstack([robot.q_home[None], robot.random_q(np.random.default_rng(1), SAMPLES)])
    if not home_is_free:
        q[0] = q[1]
    kept = _compared(distances_of_pairs(robot.model, rows, shape, pairs, q), shape, pairs, found)
    ends = np.empty((8, len(found), 6))
    for at, each in zip(ends, q, strict=False):  # without pairs, only the ends are computed
        least_distance(robot.model, rows, shape, pairs[:0], np.ascontiguousarray(each), at, np.empty(7))
    moving = np.flatnonzero(np.ptp(ends, axis=0).max(axis=1, initial=0.0) > _STILL)
    return Bodies(found, rows, shape, np.ascontiguousarray(pairs[kept]), moving.astype(np.int64))


def _moved(bodies: Bodies, nominal: Robot, robot: Robot) -> Bodies:
    """The bodies of a nominal arm in the frames of the calibrated one."""
    places = {row.name: i for i, row in enumerate(robot.rows)}
    own = [places[row.name] for row in nominal.rows]
    found = tuple(replace(each, row=own[each.row] if each.row >= 0 else -1) for each in bodies.capsules)
    return replace(bodies, capsules=found, rows=np.array([each.row for each in found], np.int64))


def _compared(
    apart: Array, shape: Array, pairs: NDArray[np.int64], found: tuple[Capsule, ...]
) -> NDArray[np.bool_]:
    """Which pairs of capsules are compared, by their distances ``(k, p)`` at home, first, and at random."""
    touching = apart < 0.0
    always = touching[1:].mean(axis=0) >= ALWAYS
    deep = np.asarray((apart < -SHALLOW * shape[pairs, 6].min(axis=1)).any(axis=0))
    couples = np.array([each.link for each in found])[pairs]
    kept = np.zeros(len(pairs), bool)
    for couple in {tuple(couple) for couple in couples.tolist()}:
        these = (couples == couple).all(axis=1)
        rest = these & ~always
        near = couple[1] == couple[0] + 2 or rest.sum() < these.sum()
        often = touching[0, rest].any() or touching[1:, rest].any(axis=1).mean() >= ALWAYS
        kept[rest] = not often and (not near or bool(deep[rest].any()))
    return kept


def touches_beside_home(robot: Robot, q: Array) -> NDArray[np.bool_]:
    """Which configurations ``(k, n)`` touch something that would be compared if the home touched nothing."""
    body = bodies_of(robot, False)
    if not len(body.pairs):
        return np.zeros(len(q), bool)
    apart = distances_of_pairs(robot.model, body.rows, body.shape, body.pairs, np.ascontiguousarray(q))
    return np.asarray((apart < 0.0).any(axis=1))


def _assumed(robot: Robot) -> tuple[Capsule, ...]:
    """Tubes along the lengths of the table."""
    pieces = tubes(robot)
    radius = radius_of(pieces)
    return tuple(Capsule(*piece, radius, True) for piece in pieces)


def _with_tool(robot: Robot) -> tuple[Capsule, ...]:
    """The stated capsules, and a tube to a tool point that they do not reach."""
    tool, last = robot.T_last_tool[:3, 3], len(robot.rows) - 1
    own = [each for each in robot.capsules if each.row == last]
    if any(_distance(each, tool) <= 0.0 for each in own) or float(np.linalg.norm(tool)) <= SHORTEST:
        return tuple(robot.capsules)
    radius = min([radius_of(tubes(robot)), *(each.radius for each in own)])
    x, y, z = tool.tolist()
    return (*robot.capsules, Capsule(len(robot.moving_rows), last, ORIGIN, (x, y, z), radius, True))


def _distance(capsule: Capsule, point: Array) -> float:
    """Of a point in the frame of a capsule from its surface, negative inside."""
    start, way = np.array(capsule.start), np.subtract(capsule.end, capsule.start)
    square = float(way @ way)
    t = min(max(float((point - start) @ way) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return float(np.linalg.norm(point - start - t * way)) - capsule.radius
