"""What the first step of a lesson asks about is seen in its first picture, and so is what a wrong answer draws.

By the geometry of the default camera: in the picture, not seen from its end, and not behind the gripper.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
import pytest
from lesson_arms import arms_of

from app.viewer.lessons import LESSONS
from app.viewer.lessons.dh.axes_drawing import room as room_of_axes
from app.viewer.lessons.guide.answer_drawing import answer_nodes, lead_nodes
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Choice, Number, Step
from app.viewer.lessons.rotations.drawing import LENGTH, anchor, room
from app.viewer.scene.camera import Sphere, view
from app.viewer.scene.chain import link_poses
from app.viewer.scene.meshes import body
from app.viewer.scene.viewpoints import UP, contains
from kin import Robot, fk
from kin.units import Units

ASPECT = 1.6
SEEN = 0.5  # share of a line's length in the picture, and of its points that nothing hides
BESIDE = ("rotations", "velocity")  # lessons whose answers are drawn beside the arm, or at the gripper
ROOMS: dict[str, Callable[[Robot], list[Sphere]]] = {
    "rotations": lambda robot: [room(robot)],
    "dh": lambda robot: [*room_of_axes(robot)],
}


def q_of(robot: Robot, step: Step) -> np.ndarray:
    return robot.q_home if step.pose is None else np.array(step.pose.q)


def tool_point(robot: Robot, step: Step) -> np.ndarray:
    return fk(robot, q_of(robot, step))[None, :3, 3]


def approach(robot: Robot, step: Step) -> np.ndarray:
    """The arrow at the tool in the direction in which it points."""
    T = fk(robot, q_of(robot, step))
    return T[:3, 3] + np.outer([0.0, 3.0 * body(robot).size], T[:3, 2])


def turned_z(robot: Robot, step: Step) -> np.ndarray:
    z = fk(robot, q_of(robot, step))[:3, 2]
    return anchor(robot) + np.outer([0.0, LENGTH * body(robot).radius], z)


# What the first step of each lesson asks one to look at; others ask about the arm as a whole, or about no scene.
ASKED: dict[str, Callable[[Robot, Step], np.ndarray]] = {
    "rotations": turned_z,
    "dh": tool_point,
    "equations": tool_point,
    "inverse": approach,
    "numeric": tool_point,
    "velocity": tool_point,
}
WHOLE = {"screws", "postures", "redundancy", "trajectories"}


@cache
def solids(robot: Robot, q: tuple[float, ...]) -> np.ndarray:
    """The triangles ``(n, 3, 3)`` of the arm and of what it stands on."""
    made, found = body(robot), []
    poses = link_poses(robot, np.array([q]))[0]
    parts = [(part, np.eye(4)) for part in (made.mount.part,)]
    for i, (link, each) in enumerate(zip(made.chain.links, made.parts, strict=True)):
        above = poses[i - 1] @ link.T_parent_axis
        parts += [(part, above if part.fixed_to_parent else poses[i]) for part in each]
    parts.append((made.gripper[0], fk(robot, q)))
    for part, T in parts:
        if part.name != "axis":
            found.append((part.mesh.vertices @ T[:3, :3].T + T[:3, 3])[part.mesh.faces])
    return np.concatenate(found)


def hidden(eye: np.ndarray, point: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether a triangle is between the camera and a point (Möller and Trumbore)."""
    way = point - eye
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    across = np.cross(way, v)
    size = np.einsum("ij,ij->i", u, across)
    size = np.where(np.abs(size) < 1e-15, np.inf, size)  # seen from its edge
    other = np.cross(eye - a, u)
    s = np.einsum("ij,ij->i", eye - a, across) / size
    t, at = other @ way / size, np.einsum("ij,ij->i", v, other) / size
    return bool(((s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (at > 1e-6) & (at < 0.999)).any())


def viewpoint(lesson: str, robot: Robot) -> np.ndarray:
    rooms = ROOMS[lesson](robot) if lesson in ROOMS else []
    return np.stack([*view(body(robot), ASPECT, rooms), UP])


def drawn(robot: Robot, step: Step) -> Iterator[tuple[str, np.ndarray]]:
    """The lines that wrong answers to a step draw, with what was answered."""
    for question, draw in ((step.estimate, "guessed"), (step.question, "drawn")):
        answers: list[float] = []
        if isinstance(question, Choice):
            answers = [i for i, option in enumerate(question.options) if not option.right]
        elif isinstance(question, Number):
            answers = [share * question.answer for share in (0.3, 0.7, 1.4)]
        for answer in answers:
            if draw == "drawn":
                nodes = answer_nodes(robot, step, answer, closed=False)
            else:
                nodes = (
                    [] if step.guessed is None else lead_nodes(robot, step.estimate, step.guessed, answer, False)
                )
            for node in nodes:
                if "points" in node.props:
                    yield f"{draw} {answer:.3g}", np.asarray(node.props["points"], float).reshape(-1, 3)


def faults(lesson: str, robot: Robot, step: Step) -> Iterator[str]:
    """What is not seen of a step."""
    here = viewpoint(lesson, robot)
    ahead = (here[1] - here[0]) / np.linalg.norm(here[1] - here[0])
    if lesson in ASKED:
        asked = ASKED[lesson](robot, step)
        if not contains(here, ASPECT, asked, 0.0):
            yield "what is asked about is outside of the picture"
        way = asked[-1] - asked[0]
        if len(asked) > 1 and np.linalg.norm(way - (way @ ahead) * ahead) < SEEN * np.linalg.norm(way):
            yield "what is asked about points along the line of sight"
    if lesson not in BESIDE:  # the arm is transparent while they are drawn
        return
    triangles = solids(robot, tuple(q_of(robot, step)))
    for answer, points in drawn(robot, step):
        free = np.mean([not hidden(here[0], point, triangles) for point in points])
        if free < SEEN:
            yield f"of what is drawn for {answer}, {free:.0%} is seen"


def test_the_list_of_what_is_asked_first_is_complete() -> None:
    assert ASKED.keys() | WHOLE == {lesson.key for lesson in LESSONS}
    assert not ASKED.keys() & WHOLE


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_what_a_lesson_asks_first_and_wrong_answers_are_seen(lesson: type[Lesson]) -> None:
    found = {}
    for robot in arms_of(lesson.key):
        step = lesson.outline(robot, Units()).steps[0]
        if wrong := [*faults(lesson.key, robot, step)]:
            found[robot.id] = wrong
    assert found == {}
