"""What the lesson "Rotations and frames" knows, without a page, against products of elementary matrices."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from bare_page import STORE, bare_page

from app.viewer.arm import Arm
from app.viewer.declared.scene import Lazy, Node
from app.viewer.lessons.rotations.conventions import CONVENTIONS
from app.viewer.lessons.rotations.facts import RotationsFacts
from app.viewer.lessons.rotations.frames import Motion
from app.viewer.lessons.rotations.lesson import RotationsLesson
from app.viewer.lessons.rotations.settings import RotationsSettings
from app.viewer.lessons.rotations.turning import REST, TIME, Turning
from app.viewer.lessons.rotations.views import turning_html
from kin.transforms import pose_from_position_wxyz
from kin.units import Units

ROBOT = STORE.get("ur5")


def facts(**settings: object) -> RotationsFacts:
    return RotationsFacts(RotationsSettings(**settings), Arm(ROBOT, ROBOT.q_home, ROBOT.q_home))


def turned(axis: int, angle: float) -> np.ndarray:
    """Rodrigues' formula for a coordinate axis."""
    e = np.eye(3)[axis]
    K = np.cross(np.eye(3), e)
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda each: each.key)
def test_a_rotation_is_the_product_of_its_turns(convention) -> None:
    rng = np.random.default_rng(4)
    for _ in range(5):
        angles = tuple(rng.uniform(-3, 3, 3).tolist())
        R = np.eye(3)
        for axis, angle in zip(convention.axes, angles, strict=True):
            turn = turned("xyz".index(axis), angle)
            R = turn @ R if convention.fixed else R @ turn
        known = facts(convention=convention.key, angles=angles)
        assert np.abs(known.R - R).max() < 1e-12


def test_frames_of_a_chain_are_products_from_the_left_and_from_the_right() -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        chain = tuple(
            Motion(bool(rng.integers(2)), int(rng.integers(3)), float(rng.uniform(-2, 2)), bool(rng.integers(2)))
            for _ in range(6)
        )
        T = np.eye(4)
        for motion, place in zip(chain, facts(chain=chain).places[1:], strict=True):
            step = np.eye(4)
            if motion.turns:
                step[:3, :3] = turned(motion.axis, motion.amount)
            else:
                step[motion.axis, 3] = motion.amount
            T = T @ step if motion.own else step @ T
            assert place == pytest.approx(T, abs=1e-12)


@pytest.mark.full
def test_another_convention_keeps_the_rotation_even_in_one_batch_of_events(monkeypatch) -> None:
    for name in ("TIME", "REST"):
        monkeypatch.setattr(f"app.viewer.lessons.rotations.turning.{name}", 1e-3)
    with bare_page(ROBOT) as page:
        lesson = page.open(RotationsLesson)
        for convention in CONVENTIONS:
            before = lesson.facts.R
            page.set("Angles", convention.title)
            page.rest()
            assert np.abs(lesson.facts.R - before).max() < 1e-9
        page.set("Angles", "X-Y-Z fixed")
        page.rest()
        page.set("β about y", 90.0)
        page.set("Angles", "Z-Y-X moving")
        page.rest()
        assert lesson.facts.R[:, 0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda each: each.key)
def test_turns_are_shown_one_after_another_about_their_axes(convention) -> None:
    angles, R = (0.4, -0.7, 1.1), np.eye(3)
    for k, (axis, angle) in enumerate(zip(convention.axes, angles, strict=True)):
        begun, way = k * (TIME + REST), "xyz".index(axis)
        before = R
        for share in (0.0, 0.3, 0.9):  # about the same axis all the time
            turning = Turning(0, 2, begun + share * TIME)
            assert turning.turn == k
            shown = convention.rotation(turning.angles(angles))
            step = shown @ before.T if convention.fixed else before.T @ shown
            part = math.copysign(math.acos(min(1.0, (np.trace(step) - 1) / 2)), angle)
            assert step == pytest.approx(turned(way, part), abs=1e-7)
            assert abs(part) < abs(angle)
        turn = turned(way, angle)
        R = turn @ R if convention.fixed else R @ turn
        for passed in (begun + TIME, begun + TIME + 0.9 * REST):
            assert convention.rotation(Turning(0, 2, passed).angles(angles)) == pytest.approx(R, abs=1e-12)
    assert Turning(0, 2, 3 * (TIME + REST) + 1e-6).turn == 3
    assert pytest.approx(convention.rotation(angles), abs=1e-12) == R


def turned_frame(nodes: Sequence[Lazy]) -> Node:
    """The frame beside the arm in a scene of the lesson."""
    (lazy,) = nodes
    (beside,) = lazy.view(*lazy.args)
    return next(node for node in beside.children if node.key == "turned")


def rotation_of(node: Node) -> np.ndarray:
    return np.asarray(pose_from_position_wxyz((0, 0, 0), node.wxyz)[:3, :3])


@pytest.mark.parametrize("by", ["click", "convention", "button"])
def test_the_frame_turns_when_it_is_clicked_or_a_convention_is_chosen(monkeypatch, by: str) -> None:
    monkeypatch.setattr("app.viewer.lessons.rotations.turning.TIME", 0.5)
    monkeypatch.setattr("app.viewer.lessons.rotations.turning.REST", 0.1)
    with bare_page(ROBOT) as page:
        lesson = page.open(RotationsLesson)
        R, seen, scene = lesson.facts.R, [], lesson.scene
        monkeypatch.setattr(lesson, "scene", lambda: (seen.append(rotation_of(turned_frame(scene()))), scene())[1])
        assert turned_frame(lesson.scene()).click == ("on_turn", 0, 2)
        assert np.allclose(rotation_of(turned_frame(lesson.scene())), R)
        match by:
            case "click":
                lesson.post(("do", turned_frame(lesson.scene()).click, 0, 0))
            case "convention":
                page.set("Angles", "Z-Y-Z moving")
            case "button":
                page.set("Turn", "2nd")
        seen.clear()
        page.rest()
        assert not np.allclose(seen[0], R, atol=1e-3)
        assert np.allclose(rotation_of(turned_frame(lesson.scene())), R), "and ends where it was"
        assert np.allclose(lesson.facts.R, R)


def test_a_question_about_the_forms_shows_no_turn() -> None:
    with bare_page(ROBOT) as page:
        lesson = page.open(RotationsLesson)
        page.activity.withheld = frozenset({"forms"})
        lesson.on_activity()
        lesson.post(("do", ("on_turn", 0, 2), 0, 0))
        page.rest()
        assert np.allclose(rotation_of(turned_frame(lesson.scene())), lesson.facts.R)
        page.activity.withheld = frozenset()


def test_the_turn_that_is_shown_is_named() -> None:
    assert "turn 2: β about y′." in turning_html(facts(convention="zyz-moving").convention, 1)
    assert turning_html(facts().convention, None) == turning_html(facts().convention, 3) == ""


# The axes that a step speaks of. The frames of the other steps are a chain.
AXES = {
    "Columns": "none",
    "The inverse": "none",
    "Fixed and moving axes": "turns",
    "Roll pitch yaw": "turns",
    "The same in Z-Y-Z": "turns",
    "Axis and angle": "whole",
    "Quaternion": "whole",
    "Gimbal lock": "turns",
    "T⁻¹": "none",
}
NAMES = {"none": [], "turns": ["1st", "2nd", "3rd"], "whole": ["axis"], "all": ["1st", "2nd", "3rd", "axis"]}


def named_axes(lesson: RotationsLesson) -> list[str]:
    """The first words of the labels beside the arm, but for the names of the frames."""
    (lazy,) = lesson.scene()
    (beside,) = lazy.view(*lazy.args)
    labels = [node.props["text"] for node in beside.children if node.kind == "label"]
    return sorted(text.split()[0] for text in labels if not text.startswith("{"))


def test_a_step_draws_the_axes_that_it_speaks_of() -> None:
    with bare_page(ROBOT) as page:
        lesson = page.open(RotationsLesson)
        assert named_axes(lesson) == NAMES["all"]
        seen = dict[str, str]()
        for step in RotationsLesson.outline(ROBOT, Units()).steps:
            assert step.pose is not None
            for pose in (step.pose, step.end or step.pose):
                lesson.restore({**lesson.state(), **pose.drawing})
                if lesson.settings.chained:
                    assert named_axes(lesson) == [], step.title
                else:
                    seen[step.title] = lesson.settings.axes
                    assert named_axes(lesson) == NAMES[lesson.settings.axes], step.title
        assert seen == AXES


def test_the_name_of_the_turned_frame_is_not_where_an_axis_of_a_turn_has_its_name() -> None:
    with bare_page(ROBOT) as page:
        lesson = page.open(RotationsLesson)
        for convention in CONVENTIONS:
            lesson.restore({**lesson.state(), "convention": convention.key, "axes": "turns"})
            (lazy,) = lesson.scene()
            (beside,) = lazy.view(*lazy.args)
            at = {node.props["text"]: np.array(node.position) for node in beside.children if node.kind == "label"}
            ways = {text: place / np.linalg.norm(place) for text, place in at.items()}
            assert lesson.settings.convention == convention.key
            for text, way in ways.items():
                assert text[0] not in "123" or way @ ways["{1}"] < 0.99, (convention.key, text)
