"""A student's answer acts: which kinds are drawn in the scene, and that they lead where they say.

`ACTS` lists the questions of all steps whose answer is a length, a speed, an angle, a time or an entry of a
rotation. Choices are in test_choices_act.py; counts are not drawn.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy_arm
import pytest
from fake_browser import FakeBrowser
from lesson_arms import ASKED, arms_of
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.answer_drawing import CUT, DASHES, FARTHEST, answer_nodes
from app.viewer.lessons.guide.outline import Bar, Cosine, Drawn, Number, SemiAxis, Step
from app.viewer.scene.arm.arm_scene import THROUGH
from app.viewer.scene.viewpoints import contains
from app.viewer.server import ViewerServer
from app.viewer.session import persistence
from app.viewer.session.state import decode
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UR5, PIONEER = STORE.get("ur5"), STORE.get("pioneer5")
BAR, ARM, FIGURE, AXIS, WAY = "a bar", "a copy of the arm", "a figure", "an ellipsoid", "a direction"
ACTS: dict[tuple[str, str], str] = {
    ("dh", "Row # as a distance"): BAR,
    ("dh", "A joint and its column"): BAR,
    ("screws", "How far the axis is"): BAR,
    ("equations", "The tool point"): BAR,
    ("numeric", "The error"): BAR,
    ("velocity", "A column"): BAR,
    ("velocity", "The ellipsoid"): AXIS,
    ("postures", "By hand: the ring"): BAR,
    ("postures", "By hand: the other elbow"): ARM,
    ("inverse", "θ₁ from above"): ARM,
    ("inverse", "The triangle and the cosine rule"): ARM,
    ("inverse", "θ₂ in the plane of the arm"): ARM,
    ("inverse", "The wrist"): ARM,
    ("inverse", "The shoulder"): ARM,
    ("inverse", "θ₁"): ARM,
    ("inverse", "The last joint"): ARM,
    ("trajectories", "How long it takes"): FIGURE,
    ("rotations", "Columns"): WAY,
    ("rotations", "The inverse"): WAY,
    # Not drawn, and why.
    ("rotations", "Roll pitch yaw"): "one of three angles: what the frame does depends on the two others",
    ("rotations", "The same in Z-Y-Z"): "one of three angles: what the frame does depends on the two others",
    ("rotations", "Axis and angle"): "it would take a frame that is turned about the axis of the whole rotation",
    ("rotations", "T⁻¹"): "one coordinate of a point",
    ("screws", "Body form"): "seen from the tool, which is not where the screws are drawn",
    ("inverse", "The wrist centre"): "one coordinate of a point",
    ("inverse", "From the tool to two links"): "one coordinate of a point",
    ("inverse", "The elbow on its circle"): "the radius of a circle, which has no direction",
    ("postures", "By hand: the triangle"): "an angle without its sign",
    ("numeric", "Near a singularity"): "of no pose: the largest step that damping allows",
    ("trajectories", "Past a singularity"): "a rate, at another place than the arm is",
}


def steps() -> Iterator[tuple[kin.Robot, tuple[str, str], Step]]:
    for lesson, robot in ASKED:
        for step in lesson.outline(robot, Units()).steps:
            if isinstance(step.question, Number):
                yield robot, (lesson.key, re.sub(r"\d+", "#", step.title)), step


def is_measured(step: Step) -> bool:
    assert isinstance(step.question, Number)
    unit = step.question.unit
    drawn = isinstance(step.drawn, Cosine)
    return drawn or unit.is_length or unit.is_angle or unit.name in ("m/s", "°/s", "s")


def test_the_list_of_answers_that_act_is_complete() -> None:
    found: dict[tuple[str, str], set[str]] = {}
    for _, name, step in steps():
        if is_measured(step):
            kinds = {Bar: BAR, Drawn: ARM, SemiAxis: AXIS, Cosine: WAY}
            kind = kinds.get(type(step.drawn), "none")  # type: ignore[call-overload]
            kind = FIGURE if step.answered is not None else kind
            found.setdefault(name, set()).add(kind)
    assert found.keys() == ACTS.keys()
    assert {name: kinds for name, kinds in found.items() if kinds != {ACTS[name]} and kinds != {"none"}} == {}
    assert {name for name, kinds in found.items() if kinds == {"none"}} == {
        name for name, how in ACTS.items() if how not in (BAR, ARM, FIGURE, AXIS, WAY)
    }


def test_a_right_bar_leads_from_one_point_to_the_other() -> None:
    count = 0
    for robot, name, step in steps():
        if not isinstance(step.drawn, Bar) or not is_measured(step) or name[1] == "By hand: the ring":
            continue
        assert isinstance(step.question, Number)
        far = float(np.linalg.norm(np.subtract(step.drawn.end, step.drawn.start)))
        assert far == pytest.approx(step.question.answer, abs=1e-6 + 0.1 * step.question.tolerance), (
            robot.id,
            name,
        )
        count += 1
    assert count > 15


def test_true_and_wrong_differ_in_colour_line_and_length() -> None:
    outline = next(lesson for lesson in LESSONS if lesson.key == "equations").outline(PIONEER, Units())
    step = next(each for each in outline.steps if each.title == "The tool point")
    assert isinstance(step.question, Number)
    assert isinstance(step.drawn, Bar)
    right, wrong = step.question.answer, 0.7 * step.question.answer
    assert answer_nodes(PIONEER, step, None, closed=False) == []
    shown = {node.key: node for node in answer_nodes(PIONEER, step, wrong, closed=False)}
    assert shown.keys() == {"wrong", "wrong-words"}, "the right one is not given away"
    assert shown["wrong-words"].props["text"] == f"your answer: {step.question.unit.brief(wrong, 6)}"
    assert [node.key for node in answer_nodes(PIONEER, step, right, closed=True)] == ["right", "right-words"]
    both = {node.key: node for node in answer_nodes(PIONEER, step, wrong, closed=True)}
    assert len(both) == 4
    lines = {key: both[key].props["points"] for key in ("wrong", "right")}
    assert (len(lines["wrong"]), len(lines["right"])) == (DASHES, 1), "broken and whole"
    assert both["wrong"].props["colors"] != both["right"].props["colors"]
    for key, value in (("wrong", wrong), ("right", right)):
        assert np.linalg.norm(lines[key][-1][1] - lines[key][0][0]) == pytest.approx(value, rel=1e-5)
    assert np.allclose(lines["right"][0], [step.drawn.start, step.drawn.end], atol=1e-6)


@pytest.mark.parametrize("given", [1e300, -1e300, 0.0])
@pytest.mark.parametrize(("lesson", "title"), [("equations", "The tool point"), ("velocity", "The ellipsoid")])
def test_answers_of_any_size_stay_in_the_picture(lesson: str, title: str, given: float) -> None:
    outline = next(each for each in LESSONS if each.key == lesson).outline(PIONEER, Units())
    step = next(each for each in outline.steps if each.title == title)
    *drawn, words = answer_nodes(PIONEER, step, given, closed=False)
    for bar in drawn:
        points = bar.props["points"]
        assert np.isfinite(points).all()
        assert np.abs(points).max() < (FARTHEST + 1) * PIONEER.reach
    assert "your answer" in words.props["text"]
    assert (CUT in words.props["text"]) == (given != 0.0), "a length that is drawn shorter says so"


def test_right_answers_have_their_whole_length() -> None:
    count = 0
    for robot, name, step in steps():
        for node in answer_nodes(robot, step, None, closed=True):
            if node.key == "right-words":
                assert CUT not in node.props["text"], (robot.id, name)
                count += 1
    assert count > 15


def test_a_bar_that_is_cut_ends_in_the_head_of_an_arrow() -> None:
    outline = next(each for each in LESSONS if each.key == "equations").outline(PIONEER, Units())
    step = next(each for each in outline.steps if each.title == "The tool point")
    for given in (50.0, -50.0):
        bar, words = answer_nodes(PIONEER, step, given, closed=False)
        *shaft, one, other = bar.props["points"]
        assert len(shaft) == DASHES
        end = shaft[-1][1]
        assert np.allclose([one[0], other[0]], [end, end]), "both lines of the head begin at the end of the bar"
        assert np.allclose(words.position, (shaft[0][0] + end) / 2.0, atol=1e-6), (
            "in the picture, however long it is"
        )
        back = shaft[0][0] - end
        for side in (one[1] - end, other[1] - end):
            assert back @ side > 0.8 * np.linalg.norm(back) * np.linalg.norm(side)
        assert np.linalg.norm(one[1] - other[1]) > 1e-3


def ellipsoids() -> Iterator[tuple[kin.Robot, Step]]:
    found = [(robot, step) for robot, _, step in steps() if isinstance(step.drawn, SemiAxis)]
    assert len(found) == len(arms_of("velocity"))
    yield from found


def test_the_right_ellipsoid_is_that_of_the_tools_velocities() -> None:
    """The lines pass through velocities that joint speeds of size 1 give, by NumPy alone."""
    for robot, step in ellipsoids():
        assert isinstance(step.question, Number)
        assert isinstance(step.drawn, SemiAxis)
        assert step.pose is not None
        J, tool = (part(robot, np.array(step.pose.q)) for part in (numpy_arm.jacobian, numpy_arm.pose))
        nodes = {node.key: node for node in answer_nodes(robot, step, None, closed=True)}
        assert nodes.keys() == {"right", "right-round", "right-words"}
        for key in ("right-round", "right"):
            tips = (nodes[key].props["points"].reshape(-1, 3) - tool[:3, 3]) / step.drawn.scale
            rates = np.linalg.pinv(J[:3], rcond=1e-6) @ tips.T
            assert np.allclose(J[:3] @ rates, tips.T, atol=1e-5), "velocities that the tool point can have"
            size = np.linalg.norm(rates, axis=0)
            assert np.allclose(size, 1.0 if key == "right-round" else [0.0, 1.0], atol=1e-4), robot.id
        start, end = nodes["right"].props["points"][0]
        assert np.linalg.norm(end - start) / step.drawn.scale == pytest.approx(step.question.answer, rel=1e-4)


def test_the_semi_axis_that_is_asked_for_is_none_that_was_on_show_before() -> None:
    """In the steps before, the ellipsoid at home has its three lengths beside it."""
    for robot, step in ellipsoids():
        assert isinstance(step.question, Number)
        assert step.pose is not None
        assert step.pose.q != tuple(robot.q_home)
        at_home = np.linalg.svd(numpy_arm.jacobian(robot, robot.q_home)[:3], compute_uv=False)
        for length in at_home:
            assert not step.question.judge(float(length)).right, (robot.id, length)


def test_a_typed_semi_axis_differs_in_colour_line_and_length() -> None:
    for robot, step in ellipsoids():
        assert isinstance(step.question, Number)
        assert isinstance(step.drawn, SemiAxis)
        right, wrong = step.question.answer, 1.4 * step.question.answer
        assert answer_nodes(robot, step, None, closed=False) == []
        before = {node.key for node in answer_nodes(robot, step, wrong, closed=False)}
        assert before == {"wrong", "wrong-round", "wrong-words"}, "the right one is not given away"
        assert {node.key for node in answer_nodes(robot, step, right, closed=True)} == {
            "right",
            "right-round",
            "right-words",
        }
        both = {node.key: node for node in answer_nodes(robot, step, wrong, closed=True)}
        assert len(both) == 6
        points = {key: both[key].props["points"] for key in ("wrong", "right", "wrong-round", "right-round")}
        gaps = {key: np.linalg.norm(at[1:, 0] - at[:-1, 1], axis=1) for key, at in points.items()}
        assert gaps["wrong"].min() > 1e-6, "broken"
        assert (gaps["wrong-round"] > 1e-6).all(), "broken"
        assert (gaps["right-round"] < 1e-6).sum() >= len(gaps["right-round"]) - 2, "whole, but between ellipses"
        for one, other in (("wrong", "right"), ("wrong-round", "right-round")):
            assert both[one].props["colors"] != both[other].props["colors"]
        lengths = {key: np.linalg.norm(points[key][-1, 1] - points[key][0, 0]) for key in ("wrong", "right")}
        assert lengths["wrong"] == pytest.approx(1.4 * lengths["right"], rel=1e-4)
        tips = [np.array(both[f"{key}-words"].position) - step.drawn.center for key in ("wrong", "right")]
        assert tips[0] @ tips[1] < 0.0, "the two labels are on opposite sides"


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


def test_a_typed_length_is_drawn_and_the_right_one_only_when_it_is_on_show(server: int) -> None:
    def nodes(tab: FakeBrowser) -> set[str]:
        found = (name for name in tab.nodes if name.startswith("/guide-") and tab.visible.get(name, True))
        return {name.split("/")[-1].partition("~")[0] for name in found} - {""}

    def through(tab: FakeBrowser) -> bool:
        """Whether the arm hides nothing of the answer."""
        return any(
            m["props"].get("opacity") == THROUGH for name, m in tab.nodes.items() if name.startswith("/arm-")
        )

    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(UR5.name)
        tab.set("Lesson", "Numeric IK")
        tab.wait(lambda: "1. The error" in tab.html)
        tab.say("feature", ["guide", ["fields", "1", 1], [["0.9 m"]]])
        tab.wait(lambda: "wrong" in nodes(tab))
        assert "right" not in nodes(tab)
        tab.wait(lambda: through(tab))
        assert any("your answer: 900" in str(m["props"].get("text")) for m in tab.nodes.values())
        tab.say("feature", ["guide", ["reveal", "1", 2], None])
        tab.wait(lambda: {"wrong", "right"} <= nodes(tab))
        tab.say("feature", ["guide", ["go", 3], 1])
        tab.wait(lambda: not nodes(tab) & {"wrong", "right"})
        tab.wait(lambda: not through(tab))


def test_an_answer_is_stored_in_the_same_step(server: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reload brings it back, however soon it comes: not only once the page has rested."""
    monkeypatch.setattr(persistence, "SAVE_AFTER", 1e6)
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", "Numeric IK")
        tab.wait(lambda: "1. The error" in tab.html)

        def stored() -> dict[str, Any]:
            guide = decode(tab.kept[-1], STORE.robots).features.get("guide", {}) if tab.kept else {}
            return {name: guide.get(name) for name in ("given", "misses", "revealed")}

        for number, text in enumerate(("0.9 m", "0.8 m"), 1):
            tab.say("feature", ["guide", ["fields", "1", number], [[text]]])
            tab.wait(lambda number=number: stored()["misses"] == {"1": number})
            assert stored()["given"].keys() == {"1"}
        tab.say("feature", ["guide", ["reveal", "1", 3], None])
        tab.wait(lambda: stored()["revealed"] == ["1"])


def picture(tab: FakeBrowser) -> np.ndarray:
    return np.array([tab.camera[name] for name in ("position", "look_at", "up_direction")], float)


@pytest.mark.full
def test_the_camera_moves_back_until_it_shows_where_an_answer_leads_and_comes_back(server: int) -> None:
    with FakeBrowser(server, 956, 720) as tab:
        tab.settle()
        tab.choose(UR5.name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html)
        tab.settle()
        tab.look()
        before = picture(tab)
        tab.say("feature", ["guide", ["answer", "e1", 1], 0])
        tab.wait(lambda: any("your answer" in str(m["props"].get("text")) for m in tab.nodes.values()))
        tab.settle()
        found = [m for name, m in tab.nodes.items() if name.startswith("/guide-") and "points" in m["props"]]
        points = np.array(found[0]["props"]["points"], float).reshape(-1, 3)
        top = points[np.argmax(points[:, 2])]
        assert not contains(before, 956 / 720, top[None], 0.0), "up to here, it would leave the picture"
        tab.wait(lambda: contains(picture(tab), 956 / 720, points, 0.0))
        tab.settle()
        tab.look()
        tab.say("feature", ["guide", ["answer", "e1", 2], 1])
        tab.wait(lambda: np.allclose(picture(tab), before, atol=1e-6))
