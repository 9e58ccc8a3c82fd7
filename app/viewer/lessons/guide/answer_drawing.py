"""A student's answer in the scene: where it leads, and beside it what is right when that is on show.

Wrong answers are vermilion and broken, right ones green and whole.
"""

from __future__ import annotations

import numpy as np

from app.exercises.questions import Number
from app.viewer.declared.scene import Color, Node, bars, label
from app.viewer.lessons.figure_shapes import GREEN, VERMILION
from app.viewer.lessons.guide.outline import Bar, Drawn, Step
from app.viewer.scene.meshes import body
from app.viewer.skeleton import ghost
from kin import Robot, fk
from kin.transforms import Array

OPACITY = 0.42  # of a copy of the arm
THICK, DASHES = 0.6, 9  # of a bar, in the arm's thickness; parts of a broken one
FARTHEST = 3.0  # reaches of the arm that a bar is long at most; its label has the value
ASIDE = 1.4  # from the broken bar to the whole one, in the arm's thickness


def answer_nodes(robot: Robot, step: Step, given: object, closed: bool) -> list[Node]:
    """What is drawn of the last answer to the question of a step; `given` is None if there is none."""
    match step.drawn:
        case Drawn() if isinstance(given, float | int) and not closed:
            q = np.array(step.drawn.at(float(given)))
            name = label("words", "your answer", fk(robot, q)[:3, 3], anchor=None)
            return [ghost("arm", robot, q, VERMILION, OPACITY), name]
        case Bar() if isinstance(step.question, Number) and _is_way(step.question):
            question, nodes = step.question, list[Node]()
            if isinstance(given, float | int) and not question.judge(float(given)).right:
                words = f"your answer: {question.unit.text(float(given))}"
                nodes += _bar("wrong", robot, step.drawn, float(given), words, VERMILION, broken=True)
            if closed:
                words = f"right: {question.value_text}"
                nodes += _bar("right", robot, step.drawn, question.answer, words, GREEN, broken=False)
            return nodes
    return []


def _is_way(question: Number) -> bool:
    """Whether an answer is a length, or a speed, which is drawn as a way."""
    return question.unit.is_length or question.unit.name == "m/s"


def _bar(key: str, robot: Robot, bar: Bar, value: float, words: str, color: Color, broken: bool) -> list[Node]:
    start, way = np.array(bar.start), np.array(bar.end) - bar.start
    length = float(np.linalg.norm(way))
    if length < 1e-9:
        return []
    size, most = body(robot).size, FARTHEST * robot.reach
    direction = way / length
    end = start + min(max(bar.scale * value, -most), most) * direction
    if broken:  # beside the whole one, which has its place between the points
        aside = ASIDE * size * _across(direction)
        start, end = start + aside, end + aside
    ends = np.linspace(start, end, 2 * DASHES if broken else 2).reshape(-1, 2, 3)
    return [bars(key, ends, color, THICK * size), label(f"{key}-words", words, end, anchor="bottom-center")]


def _across(direction: Array) -> Array:
    """A direction perpendicular to one, as upright as it can be."""
    up = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = up - (up @ direction) * direction
    return np.asarray(across / np.linalg.norm(across))
