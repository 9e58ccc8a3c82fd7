"""The facts that the texts of the lesson "Redundancy" use (``lesson.toml``): numbers of an arm at home."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from app.exercises.variant import Quantity
from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.guide.content import LessonFacts
from app.viewer.lessons.guide.leads import line
from app.viewer.lessons.guide.outline import Lead, Pose
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.null_space import lead
from kin import Robot, fk, jacobian
from kin.axes import NEARLY
from kin.differential.task import free_motions, rank
from kin.transforms import Array
from kin.units import Units, fixed

STILL = 1e-6
WAYS, ROOM, PARTS = (math.radians(30.0), math.radians(15.0), math.radians(5.0)), 1.2, 31


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares; joints count from 1."""
    free, z = free_motions(robot, "pose"), null_vector(robot)
    size = np.abs(z)
    slow = [k for k in np.argsort(size, kind="stable").tolist() if size[k] < size.max() - STILL]
    slow = slow[:2] + slow[2:][-1:]
    fast = [k for k in range(robot.n) if size[k] >= size.max() - STILL][:2]
    joint, led, there = self_moved(robot)
    numbers: dict[str, float | Quantity] = {
        "leads": joint + 1.0,
        "led": Quantity(led, "angle"),
        "led_from": float(robot.q_home[joint]),
        "joints": float(robot.n),
        "free": float(free),
        "rank_of_pose": float(robot.n - free),
        "free_point": float(free_motions(robot, "position")),
        "tool_speed": float(np.linalg.norm(jacobian(robot, robot.q_home) @ z)),
        "slower": float(len(slow)),
        "fastest": float(len(fast)),
    }
    words = {
        "speeds": "(" + ", ".join(fixed(value, 2) for value in z.tolist()) + ")",
        "speed": fixed(size.max(), 2),
        **{f"slow{i}": f"Joint {k + 1}" for i, k in enumerate(slow, 1)},
        **{f"speed{i}": fixed(size[k], 2) for i, k in enumerate(slow, 1)},
        **{f"fast{i}": f"Joint {k + 1}" for i, k in enumerate(fast, 1)},
    }
    names = (*(f"{name}{i}" for name in ("slow", "speed") for i in (1, 2, 3)), "fast2")
    functions = {
        "led_to": lambda joint: float(there[int(joint) - 1]),
    }
    points, ways = axes_at(robot, robot.q_home)
    chosen = {f"slow{i}": k for i, k in enumerate(slow, 1)} | {f"fast{i}": k for i, k in enumerate(fast, 1)}
    leads: dict[str, Lead | None] = {
        **dict.fromkeys(("slow1", "slow2", "slow3", "fast1", "fast2")),
        **{name: line(robot, points[k], ways[k]) for name, k in chosen.items()},
    }
    home = as_configuration(robot.q_home)
    poses = {
        "home": Pose(home, drawing={"swing": False}),
        "self-motion": Pose(home, drawing={"swing": True}),
    }
    return LessonFacts(numbers, functions, dict.fromkeys(names, "") | words, poses, leads=leads)


@lru_cache(maxsize=64)
def self_moved(robot: Robot) -> tuple[int, float, Array]:
    """A joint that a self-motion from home moves by one of `WAYS`, this, and the configuration ``(n,)`` then."""
    z = np.abs(null_vector(robot))
    for way in WAYS:
        for joint in np.argsort(-z, kind="stable").tolist():
            for end in (ROOM * way, -ROOM * way):
                found = _led(robot, joint, end)
                if found is not None and robot.in_limits(found):
                    return joint, way, found
    raise AssertionError(f"no self-motion of {robot.id} from home")


def _led(robot: Robot, joint: int, end: float) -> Array | None:
    """The configuration after a self-motion that moves a joint by `end` (rad) from home; None: it ends."""
    home, T = robot.q_home, fk(robot, robot.q_home)
    q = home
    for part in np.linspace(0.0, end, PARTS)[1:].tolist():
        after = lead(robot, q, T, "pose", joint, float(home[joint]) + part)
        if after is None:
            return None
        q = after
    return q


def null_vector(robot: Robot) -> Array:
    """Joint speeds ``(n,)`` of norm 1 that do not move the tool at home."""
    J = jacobian(robot, robot.q_home)
    free: Array = np.linalg.svd(J)[2][rank(robot, J, NEARLY) :]
    # Of several, the direction in which a single joint moves most.
    joint = int(np.argmax(np.linalg.norm(free, axis=0)))
    direction: Array = free.T @ free[:, joint]
    return direction / float(np.linalg.norm(direction))
