"""The facts that the texts of the lesson "Velocity" use (``lesson.toml``): numbers of an arm at home."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from app.exports.worksheet.sheet import indexed
from app.viewer.lessons.guide.content import LessonFacts
from app.viewer.lessons.guide.leads import UP, direction
from app.viewer.lessons.guide.outline import Lead, Pose, SemiAxis
from app.viewer.lessons.guide.poses import as_configuration, distance, first_clear, moved
from app.viewer.lessons.velocity.facts import scale_of
from app.viewer.lessons.velocity.views import SAMPLE
from kin import Robot, fk, jacobian, singularities
from kin.axes import NEARLY, joint_axes, size
from kin.differential.task import natural_task, rank, task_jacobian, usual_rank
from kin.ik import Singularity
from kin.ik.messages.singularity import short
from kin.transforms import Array
from kin.units import Units, general

LOAD = 10.0  # N
SAMPLES, SCANNED = 32, 73  # configurations at random, and along the range of a joint
BENT, ANOTHER = (0.6, -0.6, 1.0), 0.1  # rad, and of the longest semi-axis
FLAT, CLEAR = 0.06, 2.0  # of the largest σ that was found: what counts as none; home has more than twice as much


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares; joints count from 1."""
    home, J = robot.q_home, jacobian(robot, robot.q_home)
    heavy = int(np.argmax([abs(torque(J, k)) for k in range(robot.n)]))
    semi = np.linalg.svd(J[:3], compute_uv=False)
    there_asked = bent(robot)
    U_asked, asked, _ = np.linalg.svd(jacobian(robot, there_asked)[:3])
    found = singular(robot)
    assert found is not None
    flat = FLAT * max(_smallest(robot, q) for q in robot.random_q(np.random.default_rng(4), SAMPLES))
    there = driven(robot, flat)
    assert there is not None
    numbers = {
        "last": float(robot.n),
        "load": LOAD,
        "speed": float(np.linalg.norm(J[:3, 0])),
        "from_axis": float(np.linalg.norm(fk(robot, home)[:3, 3] - joint_axes(robot)[0].point)),
        "heavy": heavy + 1.0,
        "torque": torque(J, heavy),
        "least_torque": 0.25 * LOAD * NEARLY * size(robot),
        "fastest": float(semi[0]),
        "slowest": float(semi[-1]),
        "asked": float(asked[0]),
        "round": float(asked.prod() ** (1.0 / 3.0)),
        "metre": SAMPLE / scale_of(robot, "velocity"),
        "flat": round(flat, 4),
        "usual": float(usual_rank(robot, natural_task(robot))),
        "rank_there": float(rank_of(robot, found[0])),
    }
    functions = {
        "reaches": lambda joint: float(there[int(joint) - 1]),
    }
    lead = leads(robot, J)
    words = {
        "sigma_home": general(_smallest(robot, home), 3),
        "others": " and ".join(f"{general(value, 4)} m/s" for value in asked[1:]),
        "product": f"{general(float(asked.prod()), 4)} m³/s³",
        "singularity": indexed(short(found[1], units)),
    }
    poses = {"home": Pose(as_configuration(home)), "bent": Pose(as_configuration(there_asked))}
    poses["singularity"] = Pose(as_configuration(found[0]))
    drawn = {"fastest": semi_axis(robot, there_asked, U_asked, asked)}
    return LessonFacts(numbers, functions, words, poses, leads=lead, shapes=drawn)


@lru_cache(maxsize=64)
def bent(robot: Robot) -> Array:
    """Home with one joint moved, so that the longest semi-axis is clearly another one ``(n,)``.

    At home the ellipsoid is on show before it is asked about.
    """
    at_home, tried = _longest(robot, robot.q_home), list[Array]()
    for joint in range(robot.n):
        for amount in BENT:
            q, _ = moved(robot, joint, amount)
            if abs(_longest(robot, q) - at_home) > ANOTHER * at_home:
                tried.append(q)
    # The farther out the tool is, the less of the arm is in front of the ellipsoid.
    tried.sort(key=lambda q: -distance(robot.T_world_base, fk(robot, q)))
    found = first_clear(robot, tried)
    return robot.q_home if found is None else found


def _longest(robot: Robot, q: Array) -> float:
    """The longest semi-axis of the velocity ellipsoid of the tool point at q ``(n,)``, m/s."""
    return float(np.linalg.norm(jacobian(robot, q)[:3], 2))


def semi_axis(robot: Robot, q: Array, U: Array, semi: Array) -> SemiAxis:
    """The longest semi-axis of the velocity ellipsoid at q ``(n,)``, and the others."""
    ways = tuple(tuple(U[:, k].tolist()) for k in (1, 2, 0))
    scale = SAMPLE / scale_of(robot, "velocity")
    center = tuple(fk(robot, q)[:3, 3].tolist())
    return SemiAxis(center, ways, (float(semi[1]), float(semi[2])), scale)


def leads(robot: Robot, J: Array) -> dict[str, Lead | None]:
    """The ways of the tool point that joint 1 may have; the level one is its velocity."""
    tool, v = fk(robot, robot.q_home)[:3, 3], J[:3, 0]
    return {"lifts": direction(robot, tool, UP), "level": direction(robot, tool, v)}


@lru_cache(maxsize=64)
def driven(robot: Robot, flat: float) -> Array | None:
    """A configuration ``(n,)`` whose smallest σ is well below `flat`, if possible one joint away from home.

    None: there is none, or home is one.
    """
    home = robot.q_home
    if _smallest(robot, home) < CLEAR * flat:
        return None
    tried = [] if (found := singular(robot)) is None else [found[0]]
    for joint in range(robot.n):
        low, high = max(float(robot.lower[joint]), -math.pi), min(float(robot.upper[joint]), math.pi)
        scan = np.repeat(home[None], SCANNED, axis=0)
        scan[:, joint] = np.linspace(low, high, SCANNED)
        tried.append(scan[int(np.argmin([_smallest(robot, q) for q in scan]))])
    tried.append(np.clip(0.0, robot.lower, robot.upper))
    there = (np.asarray(q) for q in tried if robot.in_limits(q) and _smallest(robot, q) < 0.5 * flat)
    return first_clear(robot, there)


def _smallest(robot: Robot, q: Array) -> float:
    """The smallest singular value of the task that is not always zero, at q ``(n,)``."""
    values = np.linalg.svd(task_jacobian(robot, q), compute_uv=False)
    return float(values[usual_rank(robot, natural_task(robot)) - 1])


@lru_cache(maxsize=64)
def singular(robot: Robot) -> tuple[Array, Singularity] | None:
    """A singular configuration within the limits, one joint away from home, and what aligns there.

    One at which the arm touches nothing, if there is one.
    """
    found = list(_one_joint_away(robot))
    q = first_clear(robot, (at for at, _ in found))
    return next(((at, near) for at, near in found if at is q), None)


def _one_joint_away(robot: Robot) -> Iterator[tuple[Array, Singularity]]:
    for near in singularities(robot, robot.q_home):
        if len(near.met_at) != 1 or near.kind in ("algorithmic", "jacobian"):
            continue
        (joint, value), q = near.met_at[0], robot.q_home.copy()
        q[joint] = value
        within = robot.lower[joint] <= value <= robot.upper[joint]
        if within and rank_of(robot, q) < usual_rank(robot, natural_task(robot)):
            yield q, near


def rank_of(robot: Robot, q: Array) -> int:
    """The rank of the Jacobian of the arm's task."""
    return rank(robot, task_jacobian(robot, q))


def torque(J: Array, joint: int) -> float:
    """What a joint applies (N·m) to hold a weight of `LOAD` at the tool."""
    return float(-J[:3, joint] @ np.array([0.0, 0.0, -LOAD]))
