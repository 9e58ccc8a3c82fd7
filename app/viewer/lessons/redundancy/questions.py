"""The facts that the texts of the lesson "Redundancy" use (``lesson.toml``): numbers of an arm at home."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.outline import Outline, Pose
from app.viewer.lessons.guide.poses import as_configuration
from kin import Robot, jacobian
from kin.axes import NEARLY
from kin.differential.task import free_motions, rank
from kin.transforms import Array
from kin.units import Units, fixed

STILL = 1e-6


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    return outline_of("redundancy", robot, units, facts(robot))


def facts(robot: Robot) -> LessonFacts:
    """What the file declares; joints count from 1."""
    free, z = free_motions(robot, "pose"), null_vector(robot)
    size = np.abs(z)
    slow = [k for k in np.argsort(size).tolist() if size[k] < size.max() - STILL]
    slow = slow[:2] + slow[2:][-1:]
    fast = [k for k in range(robot.n) if size[k] >= size.max() - STILL][:2]
    numbers = {
        "joints": float(robot.n),
        "free": float(free),
        "rank_of_pose": float(robot.n - free),
        "free_point": float(free_motions(robot, "position")),
        "moves": float(np.any(z)),
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
    functions = {"still": lambda place: float(size[slow[int(place) - 1]] < STILL)}
    home = as_configuration(robot.q_home)
    poses = {
        "home": Pose(home, drawing={"swing": False}),
        "self-motion": Pose(home, drawing={"swing": bool(np.any(z))}),
    }
    return LessonFacts(numbers, functions, dict.fromkeys(names, "") | words, poses)


def null_vector(robot: Robot) -> Array:
    """Joint speeds ``(n,)`` of norm 1 that do not move the tool at home; zeros if there are none."""
    J = jacobian(robot, robot.q_home)
    free: Array = np.linalg.svd(J)[2][rank(robot, J, NEARLY) :]
    if not len(free):
        return np.zeros(robot.n)
    # Of several, the direction in which a single joint moves most.
    joint = int(np.argmax(np.linalg.norm(free, axis=0)))
    direction: Array = free.T @ free[:, joint]
    return direction / float(np.linalg.norm(direction))
