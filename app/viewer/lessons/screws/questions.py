"""The facts that the texts of the lesson "Screws" use (``lesson.toml``): an arm with all joints at zero."""

from __future__ import annotations

import math

import numpy as np

from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.outline import LEAST, Configuration, Ghost, Lead, Outline, Pose
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.screws.product import foot
from kin import Robot
from kin.dh import screws
from kin.transforms import Array
from kin.units import Units, fixed

TURNED = math.radians(40.0)
UPRIGHT = 0.999  # of the vertical part of a direction
SPACE = {"form": "space", "axes": "zero"}
MOST_SORTED, APART = 4, 0.04  # joints that are sorted, and how different they are, in the largest |v|
BESIDE = 0.02  # of the reach: how far from its axis the tool point is clearly beside it
_INDICES = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    return outline_of("screws", robot, units, facts(robot, units))


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares; joints count from 1."""
    found, n = screws(robot), robot.n
    seen = next((i for i in range(n - 1, -1, -1) if robot.revolute[i]), 0)
    direction = (found.S[:3] if robot.revolute[seen] else found.S[3:])[:, seen]
    axis, body = int(np.argmax(np.abs(direction))), off_tool(robot, found.B)
    numbers = {
        "seen": seen + 1.0,
        "component": float(direction[axis]),
        "slides": next((i + 1.0 for i in range(n) if not robot.revolute[i]), 0.0),
        "last": float(n),
        "upright": float((np.abs(np.where(robot.revolute, found.S[2], found.S[5])) > UPRIGHT).sum()),
        "body_joint": body + 1.0,
        "body": float(np.linalg.norm(found.B[3:, body])),
        "space": float(np.linalg.norm(found.S[3:, body])),
    }
    words = {"axis": "xyz"[axis], "last_low": str(n).translate(_INDICES)}
    far_numbers, far_words = _far(robot, found.S, units)
    joint = far_joint(found.S)
    nearest = np.zeros(3) if joint < 0 else foot(found.S[:, joint])
    chosen = far_apart(found.S)
    sizes = np.linalg.norm(found.S[3:, chosen], axis=0)
    numbers["sorted"] = float(len(chosen))
    names = {f"near{place}": f"Joint {k + 1}" for place, k in enumerate(chosen, 1)}
    words |= {f"near{place}": "" for place in range(1, MOST_SORTED + 1)} | names
    functions = {
        "passes": lambda place: float(sizes[int(place) - 1]),
        "turns": lambda joint: float(robot.revolute[int(joint) - 1]),
        "foot": lambda coordinate: float(nearest[int(coordinate) - 1]),
    }
    home, zeros = as_configuration(robot.q_home), np.zeros(n)
    zero = as_configuration(zeros) if robot.in_limits(zeros) else home
    poses = {"home": Pose(home), "zero": Pose(zero, drawing=SPACE)}
    leads: dict[str, Lead | None] = {
        "last first": Ghost(alone(robot, n - 1)),
        "joint 1 first": Ghost(alone(robot, 0)),
    }
    return LessonFacts(numbers | far_numbers, functions, words | far_words, poses, leads=leads)


def alone(robot: Robot, joint: int) -> Configuration:
    """All joints at zero but one, which is where it is at home, or moved if it is at zero there too."""
    q = np.zeros(robot.n)
    q[joint] = robot.q_home[joint] or (TURNED if robot.revolute[joint] else 0.1 * robot.reach)
    return as_configuration(q)


def _far(robot: Robot, S: Array, units: Units) -> tuple[dict[str, float], dict[str, str]]:
    """What is asked about the axis that is farthest from the origin; `far` is 0 if there is none."""
    joint = far_joint(S)
    if joint < 0:
        names = ("far_distance", "far_origin", "far_component", "near_joint", "near")
        words = ("far_omega", "far_point", "near_axis", "near_omega", "near_v")
        return {"far": 0.0, **dict.fromkeys(names, math.nan)}, dict.fromkeys(words, "")
    omega, v, point = S[:3, joint], S[3:, joint], axes_at(robot, np.zeros(robot.n))[0][joint]
    other = _other_far(S, joint, point)
    nearest = foot(S[:, other])
    axis = int(np.argmax(np.abs(nearest)))
    place = ", ".join(units.lengths.number(value) for value in point.tolist())
    numbers = {
        "far": joint + 1.0,
        "far_distance": float(np.linalg.norm(v)),
        "far_origin": float(np.linalg.norm(point)),
        "far_component": float(np.abs(v).max()),
        "near_joint": other + 1.0,
        "near": float(nearest[axis]),
    }
    return numbers, {
        "far_omega": _vector(omega),
        "far_point": f"({place}){units.lengths.suffix}",
        "near_axis": "xyz"[axis],
        "near_omega": _vector(S[:3, other]),
        "near_v": _vector(S[3:, other]),
    }


def _other_far(S: Array, far: int, point: Array) -> int:
    """Another joint that turns, far from the origin, whose nearest point has no number of `point`; else `far`."""
    for joint in np.argsort(-np.linalg.norm(S[3:], axis=0), kind="stable").tolist():
        nearest = float(np.abs(foot(S[:, joint])).max())
        if joint != far and nearest > 10.0 * LEAST and (abs(nearest - np.abs(point)) > 0.03 * nearest).all():
            return int(joint)
    return far


def far_apart(S: Array) -> list[int]:
    """Up to `MOST_SORTED` joints that turn, all differently far from the origin; none if there is only one."""
    size = np.linalg.norm(S[3:], axis=0)
    chosen: list[int] = []
    for k in np.flatnonzero(np.linalg.norm(S[:3], axis=0) > 0.5).tolist():
        if all(abs(size[k] - size[other]) > APART * size.max() for other in chosen):
            chosen.append(k)
    return chosen[:MOST_SORTED] if len(chosen) > 1 else []


def off_tool(robot: Robot, B: Array) -> int:
    """The last joint that turns about an axis beside the tool point; the last one if there is none."""
    beside = robot.revolute & (np.linalg.norm(B[3:], axis=0) > BESIDE * robot.reach)
    return int(np.flatnonzero(beside)[-1]) if beside.any() else robot.n - 1


def _vector(values: Array) -> str:
    return "(" + ", ".join(fixed(value) for value in values.tolist()) + ")"


def far_joint(S: Array) -> int:
    """The joint with the largest v among those that turn; −1 if all axes pass through the origin."""
    size = np.where(np.linalg.norm(S[:3], axis=0) > 0.5, np.linalg.norm(S[3:], axis=0), 0.0)
    joint = int(np.argmax(size))
    return joint if size[joint] > 10.0 * LEAST else -1
