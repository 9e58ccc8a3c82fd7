"""A student's answer in the scene: where it leads, and beside it what is right when that is on show.

Wrong answers are vermilion and broken, right ones green and whole.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from app.exercises.contract import Posed
from app.exercises.kinds.frame import FrameKind
from app.exercises.kinds.order import OrderKind
from app.exercises.questions import Choice, Number, Question
from app.viewer.declared.scene import Color, Node, axes, bars, label
from app.viewer.exercises.drawing import OPACITY, SIZE
from app.viewer.lessons.figure_shapes import GREEN, VERMILION
from app.viewer.lessons.guide.outline import Bar, Cosine, Drawn, Ghost, Lead, Leads, Path, SemiAxis, Step, Triad
from app.viewer.scene.camera import DIRECTION
from app.viewer.scene.meshes import body
from app.viewer.scene.viewpoints import UP
from app.viewer.skeleton import ghost
from kin import Robot, fk, link_frames
from kin.transforms import Array, pose_from_position_wxyz

YOURS = "your answer"
THICK, DASHES = 0.6, 9  # of a bar, in the arm's thickness; parts of a broken one
FARTHEST = 1.2  # reaches of the arm that a wrong bar is long at most; its label has the value
CUT = "drawn shorter"  # the label of a bar that would be longer
TIP = 0.12, 0.5  # of a bar that is cut: the length of its head, of the bar's, and its half width, of the head's
# From the whole bar to the broken one, in the arm's thickness: across it, and towards the viewer by more than half
# a gripper, which would hide the bar.
ASIDE, AHEAD = 1.4, 1.6
ROUND, THIN = 48, 0.4  # parts of an ellipse, of which a broken one has every other; its thickness, of a bar's


def answer_nodes(robot: Robot, step: Step, given: object, closed: bool) -> list[Node]:
    """What is drawn of the last answer to the question of a step; `given` is None if there is none."""
    match step.drawn:
        case Drawn() if isinstance(given, float | int) and not closed:
            q = np.array(step.drawn.at(float(given)))
            name = label("words", YOURS, fk(robot, q)[:3, 3], anchor=None)
            return [ghost("arm", robot, q, VERMILION, OPACITY), name]
        case Bar() | SemiAxis() if isinstance(step.question, Number) and _is_way(step.question):
            question, nodes = step.question, list[Node]()
            if isinstance(given, float | int) and not question.judge(float(given)).right:
                words = f"{YOURS}: {question.unit.brief(float(given), 6)}"
                nodes += _length("wrong", robot, step.drawn, float(given), words, VERMILION, broken=True)
            if closed:
                words = f"right: {question.value_text}"
                nodes += _length("right", robot, step.drawn, question.answer, words, GREEN, broken=False)
            return nodes
        case Cosine() if isinstance(step.question, Number):
            nodes, drawn = list[Node](), step.drawn
            if isinstance(given, float | int) and not step.question.judge(float(given)).right:
                nodes += _lead("wrong", robot, drawn.at(float(given)), YOURS, VERMILION, broken=True)
            if closed:
                nodes += _lead("right", robot, drawn.at(step.question.answer), "right", GREEN, broken=False)
            return nodes
        case Leads():
            return lead_nodes(robot, step.question, step.drawn, given, closed)
    if isinstance(step.question, Posed):
        match step.question.kind:
            case FrameKind():
                return _frame_nodes(robot, step.question, given, closed)
            case OrderKind():
                return _order_nodes(robot, step.question, step.question.kind, given, closed)
    return []


def lead_nodes(robot: Robot, question: Question | None, leads: Leads, given: object, closed: bool) -> list[Node]:
    """Where the chosen option leads if it is wrong, and the right one once it is on show."""
    nodes = list[Node]()
    if not isinstance(question, Choice):
        return nodes
    right = type(given) is int and question.is_answer(given) and question.options[given].right
    if type(given) is int and question.is_answer(given) and not right:
        nodes += _lead("wrong", robot, leads.options[given], YOURS, VERMILION, broken=True)
    if closed:
        at = given if right and type(given) is int else question.right()
        nodes += _lead("right", robot, leads.options[at], "right", GREEN, broken=False)
    return nodes


def _lead(key: str, robot: Robot, lead: Lead | None, words: str, color: Color, broken: bool) -> list[Node]:
    match lead:
        case Bar():
            length = float(np.linalg.norm(np.subtract(lead.end, lead.start)))
            return _bar(key, robot, lead, length, words, color, broken)
        case Ghost():
            q = np.array(lead.q)
            joints = np.concatenate([robot.T_world_base[None], link_frames(robot, q)])[:, :3, 3]
            name = label(f"{key}-words", words, fk(robot, q)[:3, 3], anchor=None)
            return [ghost(key, robot, q, color, OPACITY), _line(f"{key}-line", robot, joints, color, broken), name]
        case Path():
            points = np.array(lead.points)
            name = label(f"{key}-words", words, points[len(points) // 2], anchor="bottom-center")
            return [_line(key, robot, points, color, broken), name]
        case Triad():
            return _frame(key, np.array(lead.T), lead.length, words, color, broken)
    return []


def _line(key: str, robot: Robot, points: Array, color: Color, broken: bool) -> Node:
    """A line through points ``(k, 3)``, whole or of parts."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = 2 * 3 * DASHES if broken else max(2, len(points))
    at = np.linspace(0.0, way[-1], count) if broken else way
    along = np.stack([np.interp(at, way, points[:, i]) for i in range(3)], axis=1)
    ends = along.reshape(-1, 2, 3) if broken else np.stack([along[:-1], along[1:]], axis=1)
    return bars(key, ends, color, THICK * body(robot).size)


def _frame(key: str, T: Array, length: float, words: str, color: Color, broken: bool) -> list[Node]:
    """The axes of a frame, thin if they are broken, with an origin of this colour.

    Its words are at its y axis: the name of a frame that is on show there is at z or x.
    """
    radius = (0.02 if broken else 0.05) * length
    node = axes(key, T, length, radius, origin_color=color, origin_radius=3.0 * radius)
    return [node, label(f"{key}-words", words, T[:3, 3] + 1.15 * length * T[:3, 1], anchor="bottom-center")]


def _frame_nodes(robot: Robot, question: Posed, given: object, closed: bool) -> list[Node]:
    """The frame that was placed, if it is wrong, and the right one with the way between both."""
    nodes, length = list[Node](), SIZE * robot.reach
    right = _pose_of(question.right())
    wrong = None
    if isinstance(given, list) and question.is_answer(given) and not question.judge(given).right:
        wrong = _pose_of(given)
        nodes += _frame("wrong", wrong, length, YOURS, VERMILION, broken=True)
    if closed:
        nodes += _frame("right", right, length, "right", GREEN, broken=False)
        if wrong is not None and np.linalg.norm(wrong[:3, 3] - right[:3, 3]) > 1e-6:
            points = np.stack([wrong[:3, 3], right[:3, 3]])
            nodes.append(_line("between", robot, points, VERMILION, broken=True))
    return nodes


def _order_nodes(robot: Robot, question: Posed, kind: OrderKind, given: object, closed: bool) -> list[Node]:
    """Where the motions lead frame 0, and on which way: in the order of a wrong answer, and in the right one."""
    nodes, orders = list[Node](), dict[str, Any]()
    if question.is_answer(given) and not question.judge(given).right:
        orders["wrong"] = given
    if closed:
        orders["right"] = question.right()
    for key, order in orders.items():
        wrong = key == "wrong"
        color, words = (VERMILION, YOURS) if wrong else (GREEN, "right")
        places = robot.T_world_base @ kind.leads(question.variant, order)
        moved = np.linalg.norm(np.diff(places[:, :3, 3], axis=0), axis=1) > 1e-9
        way = places[[True, *moved.tolist()], :3, 3]
        nodes += _frame(key, places[-1], SIZE * robot.reach, words, color, broken=wrong)
        if len(way) > 1:
            nodes.append(_line(f"{key}-way", robot, way, color, broken=wrong))
    return nodes


def _pose_of(given: object) -> Array:
    values = np.array(given, dtype=float)
    return pose_from_position_wxyz(values[:3], values[3:])


def _is_way(question: Number) -> bool:
    """Whether an answer is a length, or a speed, which is drawn as a way."""
    return question.unit.is_length or question.unit.name == "m/s"


def _length(
    key: str, robot: Robot, drawn: Bar | SemiAxis, value: float, words: str, color: Color, broken: bool
) -> list[Node]:
    if isinstance(drawn, Bar):
        return _bar(key, robot, drawn, value, words, color, broken)
    return _ellipsoid(key, robot, drawn, value, words, color, broken)


def _bar(key: str, robot: Robot, bar: Bar, value: float, words: str, color: Color, broken: bool) -> list[Node]:
    start, way = np.array(bar.start), np.array(bar.end) - bar.start
    length = float(np.linalg.norm(way))
    if length < 1e-9:
        return []
    size, direction, most = body(robot).size, way / length, max(FARTHEST * robot.reach, length)
    cut = abs(bar.scale * value) > most
    end = start + min(max(bar.scale * value, -most), most) * direction
    if broken:  # beside the whole one, which has its place between the points
        aside = size * (ASIDE * _across(direction) + AHEAD * _across(direction, DIRECTION))
        start, end = start + aside, end + aside
    ends, place = np.linspace(start, end, 2 * DASHES if broken else 2).reshape(-1, 2, 3), end
    if cut:  # long words at the end would leave the picture
        ends, place = np.concatenate([ends, _tip(start, end)]), (start + end) / 2.0
        words = f"{words} ({CUT})"
    return [bars(key, ends, color, THICK * size), label(f"{key}-words", words, place, anchor="bottom-center")]


def _tip(start: Array, end: Array) -> Array:
    """The head of an arrow as two lines ``(2, 2, 3)`` that meet at its end: it would go on."""
    back, wide = TIP[0] * (start - end), TIP[0] * TIP[1] * float(np.linalg.norm(end - start))
    aside = wide * _across((end - start) / float(np.linalg.norm(end - start)))
    return np.array([[end, end + back + aside], [end, end + back - aside]])


def _ellipsoid(
    key: str, robot: Robot, axis: SemiAxis, value: float, words: str, color: Color, broken: bool
) -> list[Node]:
    """The ellipses of an ellipsoid with one semi-axis of this length, and this semi-axis as a bar.

    The bars of a wrong and of the right one are on opposite sides.
    """
    center, size, most = np.array(axis.center), body(robot).size, FARTHEST * robot.reach
    whole = axis.scale * np.array([*axis.others, value])
    lengths = np.clip(whole, -most, most)
    if abs(whole[2]) > most:
        words = f"{words} ({CUT})"
    semi = lengths[:, None] * np.array(axis.axes)
    angles = np.linspace(0.0, 2.0 * np.pi, ROUND + 1)
    found = []
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if abs(lengths[i] * lengths[j]) > 1e-12:
            around = center + np.outer(np.cos(angles), semi[i]) + np.outer(np.sin(angles), semi[j])
            found.append(np.stack([around[:-1], around[1:]], axis=1)[:: 2 if broken else 1])
    end = center + (semi[2] if broken else -semi[2])
    bar = np.linspace(center, end, 2 * DASHES if broken else 2).reshape(-1, 2, 3)
    return [
        bars(f"{key}-round", np.concatenate(found), color, THIN * THICK * size),
        bars(key, bar, color, THICK * size),
        label(f"{key}-words", words, end, anchor="bottom-center"),
    ]


def _across(direction: Array, toward: Array = UP) -> Array:
    """A direction perpendicular to one, as near as it can be to another, or to x if that is along the first."""
    toward = toward / np.linalg.norm(toward)
    toward = toward if abs(toward @ direction) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = toward - (toward @ direction) * direction
    return np.asarray(across / np.linalg.norm(across))
