"""Steps own the scene: opening one brings arm and drawing to its pose, as one step of undo."""

from __future__ import annotations

import html
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fake_browser import FakeBrowser
from lesson_arms import ASKED, arms_of
from live_server import serve_viewer

import kin
from app.exercises import parse_exercise
from app.exercises.questions import Question
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.arm import Arm
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.outline import Choice, Number, Option, Outline, Pose, Step
from app.viewer.lessons.guide.progress import Progress
from app.viewer.lessons.rotations.lesson import RotationsLesson
from app.viewer.lessons.velocity.lesson import VelocityLesson
from app.viewer.panel.joints import label
from app.viewer.scene.clearance import clearance
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, encode
from kin import Robot
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UR5 = STORE.get("ur5")
DEGREES, RADIANS = Units(), Units(degrees=False, length="m")
HEAD = 'id = "x"\ntitle = "X"\ntopic = "Velocity"\ntext = "?"\nrobot = "planar2r"\n'
BODIES = {
    "fields": 'kind = "number"\n[answer]\nvalue = [0.2, "30*deg"]\nlabels = ["x", "y"]\nunit = "deg"\n'
    'tolerance = 1\nmethod = "Add."',
    "options": 'kind = "choice"\n[answer]\noptions = [{text = "a", right = true, reason = "Yes."}, '
    '{text = "b", reason = "No."}]',
    "order": 'kind = "order"\n[answer]\nmotions = [{turn = "z", by = "30*deg"}, {slide = "x", by = 0.1}]',
    "posture": 'kind = "reach"\n[target]\nq = ["20*deg", "40*deg"]\n[answer]\ntask = "position"',
    "frame": 'kind = "frame"\n[answer]\nmotions = [{turn = "z", by = "90*deg"}]',
    "table": 'kind = "dh"\n[answer]\nrows = [1, 2]',
    "postures": 'kind = "solutions"\n[target]\nq = ["20*deg", "40*deg"]\n[answer]\ntask = "position"\nrows = 2',
}


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


def press(tab: FakeBrowser, key: list[object], value: object = None) -> None:
    tab.say("feature", ["guide", key, value])


def frames_beside(tab: FakeBrowser) -> int:
    """How many frames of a chain are drawn beside the arm."""
    return sum("chain-" in name and tab.visible.get(name, True) for name in tab.nodes)


def is_at(tab: FakeBrowser, robot: Robot, q: Any) -> bool:
    return np.allclose(tab.tool_pose(), kin.fk(robot, np.array(q)), atol=1e-6)


@pytest.mark.full
def test_the_ellipsoid_is_called_flat_where_an_axis_is_lost() -> None:
    for robot in arms_of("velocity"):
        for step in VelocityLesson.outline(robot, DEGREES).steps:
            if step.title == "A singular configuration" and step.question is not None:
                assert step.end is not None
                home, there = (
                    np.linalg.svd(kin.jacobian(robot, q)[:3])[1] for q in (robot.q_home, np.array(step.end.q))
                )
                flat = bool(there[-1] < 1e-3 * there[0] and home[-1] > 1e-3 * home[0])
                assert flat == ("is flat now" in step.practice), robot.id


def test_the_camera_follows_a_target_that_leaves_the_picture(server: int) -> None:
    def distance() -> float:
        return float(np.linalg.norm(np.subtract(tab.camera["position"], tab.camera["look_at"])))

    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose("PUMA 560")
        tab.set("Lesson", "Postures")
        tab.wait(lambda: "1. Signs" in tab.html)
        tab.settle()
        before = distance()
        press(tab, ["go", 1], 3)
        tab.wait(lambda: "4. Out of reach" in tab.html)
        tab.look()  # a page that reports nothing for ten seconds counts as one whose visitor looks from elsewhere
        assert distance() == pytest.approx(before), "nothing is given away"
        press(tab, ["reveal", "4", 1])
        tab.wait(lambda: distance() > 1.2 * before)


OPENED = [  # about the first arm in the quick tests
    pytest.param(lesson, robot, id=f"{lesson.key}-{robot.id}", marks=() if robot == arms[0] else pytest.mark.full)
    for lesson in LESSONS
    for arms in [arms_of(lesson.key)]
    for robot in arms
]


@pytest.mark.parametrize(("lesson", "robot"), OPENED)
def test_opening_a_step_brings_the_arm_to_its_pose(server: int, lesson: Any, robot: Robot) -> None:
    outline = lesson.asked(robot, DEGREES)
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(robot.name)
        tab.set(label(robot, 0), 77.0 if robot.revolute[0] else 10.0)
        tab.set("Lesson", lesson.title)
        for number, step in enumerate(outline.steps):
            press(tab, ["go", number], number)
            tab.wait(lambda number=number, step=step: f"{number + 1}. {step.title}" in tab.html)
            pose, about = outline.pose_of(number), step.about or robot
            assert pose is not None
            tab.wait(lambda pose=pose, about=about: is_at(tab, about, pose.q))
            end = step.end
            if end is None:
                continue
            press(tab, ["reveal", str(number + 1), number])
            if end.target is None:
                tab.wait(lambda end=end, about=about: is_at(tab, about, end.q))
            else:
                tab.wait(lambda end=end: np.allclose(tab.gizmo_pose()[:3, 3], end.target[:3], atol=1e-6))


@pytest.mark.full
def test_an_answered_step_opens_where_its_answer_led(server: int) -> None:
    puma = kin.get_robot("puma560")
    steps = RotationsLesson.outline(puma, DEGREES).steps
    at, step = next((i, one) for i, one in enumerate(steps) if one.end is not None and one.end.drawing)
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(puma.name)
        tab.set("Lesson", RotationsLesson.title)
        press(tab, ["go", 1], at)
        tab.wait(lambda: f"{at + 1}. {step.title}" in tab.html)
        assert frames_beside(tab) == 0, "not before the answer"
        press(tab, ["reveal", str(at + 1), 2])
        tab.wait(lambda: frames_beside(tab) > 0)
        shown = frames_beside(tab)
        press(tab, ["go", 3], 0)
        tab.wait(lambda: f"1. {steps[0].title}" in tab.html and frames_beside(tab) == 0)
        press(tab, ["go", 4], at)
        tab.wait(lambda: frames_beside(tab) == shown)
        press(tab, ["pose", 5])
        tab.wait(lambda: frames_beside(tab) == 0)


@pytest.mark.full
def test_a_step_is_one_step_of_undo(server: int) -> None:
    steps = VelocityLesson.outline(UR5, DEGREES).steps
    assert steps[1].pose is not None
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Robot", UR5.name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html and is_at(tab, UR5, UR5.q_home))
        tab.set(next(name for name in tab.sliders if name.startswith("1 ")), 77.0)
        q = np.concatenate([[np.radians(77.0)], UR5.q_home[1:]])
        tab.wait(lambda: is_at(tab, UR5, q))
        press(tab, ["go", 1], 1)
        tab.wait(lambda: "2. Turning" in tab.html and is_at(tab, UR5, UR5.q_home))
        tab.say("undo", None)
        tab.wait(lambda: "1. A column" in tab.html and is_at(tab, UR5, q))


@pytest.mark.parametrize(("lesson", "late"), [("Equations", 0.0), ("Equations", 0.4), ("Redundancy", 0.0)])
def test_a_removed_control_gets_no_update(server: int, lesson: str, late: float) -> None:
    """The channel, which has the HTML of the panel, may be `late` by some time (s)."""
    with FakeBrowser(server, delays=(0.0, late)) as tab:
        tab.settle()
        tab.open_lesson(lesson)
        shown = tab.tool_pose()
        for degrees in (10.0, 20.0):  # while the arm is under way, controls follow it
            tab.set(label(arms_of(lesson.lower())[0], 0), degrees)
        tab.wait(lambda: not np.allclose(tab.tool_pose(), shown))
        before = len(tab.log)
        tab.set("Lesson", "None")
        tab.wait(lambda: any(m["type"] == "GuiRemoveMessage" for m in tab.log[before:]))
        tab.settle()
        assert tab.updates_without_component() == []


def test_a_link_without_a_configuration_opens_at_the_pose_of_the_step(server: int) -> None:
    lesson = next(each for each in LESSONS if each.key == "rotations")
    pose = lesson.outline(UR5, DEGREES).pose_of(0)
    assert pose is not None
    assert not np.allclose(pose.q, UR5.q_home)
    q = tuple(float(x) for x in UR5.q_home + 0.1)
    for saved, expected in ((None, pose.q), (q, q)):
        state = encode(PageState(robot="ur5", q=None if saved is None else np.array(saved), lesson="rotations"))
        with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": state})) as tab:
            tab.wait(lambda expected=expected: "1. Columns" in tab.html and is_at(tab, UR5, expected))


def test_a_link_builds_no_step_before_its_own(server: int) -> None:
    saved = {"guide": {"step": 1, "revealed": ["2"], "joints": True}}
    state = encode(PageState(robot="ur5", q=UR5.q_home, lesson="velocity", features=saved))
    with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": state})) as tab:
        tab.wait(lambda: "2. Turning" in tab.html)
        tab.settle()
        sent = [str(props.get("content")) for m in tab.log if (props := m.get("props") or m.get("updates"))]
        assert {number for text in sent for number in re.findall('data-step="([^"]*)"', text)} == {"2"}
        assert tab.value("Joint sliders") is True
        assert not any("data-asked" in text for text in sent), "nothing is withheld, as by the first question"


def test_another_robot_comes_to_the_pose_of_the_open_step(server: int) -> None:
    lesson = next(each for each in LESSONS if each.key == "rotations")
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", lesson.title)
        tab.wait(lambda: "1. Columns" in tab.html)
        tab.choose(UR5.name)
        pose = lesson.outline(UR5, DEGREES).pose_of(0)
        assert pose is not None
        tab.wait(lambda: is_at(tab, UR5, pose.q))


def test_answers_stay_with_the_arm_that_they_are_about(server: int) -> None:
    question = VelocityLesson.outline(UR5, DEGREES).steps[0].question
    assert isinstance(question, Number)
    away = STORE.get("puma560")

    def mark(tab: FakeBrowser, robot: Robot, answered: bool) -> None:
        asked = VelocityLesson.outline(robot, DEGREES).steps[0].question
        assert asked is not None
        tab.wait(lambda: asked.prompt in tab.html and ("answered right" in tab.html) == answered)

    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(UR5.name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html)
        press(tab, ["fields", "1", 1], [[question.value_text]])
        mark(tab, UR5, True)
        tab.choose(away.name)
        mark(tab, away, False)
        assert "data-asked" in tab.html, "the numbers of this arm are asked"
        tab.choose(UR5.name)
        mark(tab, UR5, True)
        assert "data-asked" not in tab.html


def test_a_lesson_goes_on_where_it_was_left_whatever_arm_is_on_show(server: int) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(UR5.name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html)
        press(tab, ["go", 1], 1)
        tab.wait(lambda: "2. Turning" in tab.html)
        tab.set("Lesson", "None")
        tab.choose(STORE.get("so101").name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "2. Turning" in tab.html and is_at(tab, UR5, UR5.q_home))


def test_a_wrong_angle_is_drawn_beside_the_arm(server: int) -> None:
    planar = kin.get_robot("planar2r")
    lesson = next(each for each in LESSONS if each.key == "postures")
    outline = lesson.outline(planar, DEGREES)
    at = next(i for i, step in enumerate(outline.steps) if step.title == "By hand: the other elbow")
    l1, l2 = (row.a for row in planar.rows)

    def ghosts(tab: FakeBrowser) -> list[str]:
        return [name for name in tab.nodes if re.match("/guide-.*/", name) and tab.visible.get(name, True)]

    def corners(theta1: float) -> np.ndarray:
        """Base, elbow and tool of the copy, in the plane: its elbow is bent the other way."""
        first, second = theta1, theta1 - planar.q_home[1]
        elbow = l1 * np.array([math.cos(first), math.sin(first)])
        return np.stack([elbow, elbow + l2 * np.array([math.cos(second), math.sin(second)])])

    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(planar.name)
        tab.set("Lesson", lesson.title)
        press(tab, ["go", at], at)
        tab.wait(lambda: "By hand: the other elbow" in tab.html)
        assert ghosts(tab) == []
        for degrees in (10.0, -35.0):
            press(tab, ["fields", str(at + 1), int(degrees)], [[str(degrees)]])
            elbow, tool = corners(math.radians(degrees))

            def drawn(elbow: np.ndarray = elbow, tool: np.ndarray = tool) -> bool:
                names = {name.rpartition("/")[2]: name for name in ghosts(tab)}
                if not {"arm", "words"} <= names.keys():
                    return False
                pieces = np.asarray(tab.nodes[names["arm"]]["props"]["batched_positions"]).reshape(-1, 3)
                at_elbow = np.abs(pieces[:, :2] - elbow).max(axis=1).min() < 1e-5
                return bool(at_elbow) and np.allclose(tab.poses[names["words"]]["position"][:2], tool, atol=1e-6)

            tab.wait(drawn)
            assert is_at(tab, planar, planar.q_home), "the arm stays at the point"
        question = outline.steps[at].question
        assert isinstance(question, Number)
        press(tab, ["fields", str(at + 1), 3], [[question.value_text]])
        tab.wait(lambda: ghosts(tab) == [])
        end = outline.steps[at].end
        assert end is not None
        tab.wait(lambda: is_at(tab, planar, end.q))


def test_an_estimate_comes_before_the_question_and_ends_with_it(server: int) -> None:
    outline = VelocityLesson.outline(UR5, DEGREES)
    estimate = outline.steps[0].estimate
    assert isinstance(estimate, Choice)
    right = estimate.right()
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(UR5.name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: 'data-question="e1"' in tab.html)
        assert tab.html.index('data-question="e1"') < tab.html.index('data-question="1"')
        assert 'data-question-key="e1">Show the answer' not in tab.html
        wrong = next(i for i in range(len(estimate.options)) if i != right)
        press(tab, ["answer", "e1", 1], wrong)
        tab.wait(lambda: "Not quite" in tab.html)
        assert "data-asked" in tab.html, "the estimate shows nothing that the question asks"
        press(tab, ["answer", "e1", 2], right)
        tab.wait(lambda: estimate.options[right].reason in tab.html)
        assert "data-asked" in tab.html
        press(tab, ["reveal", "1", 3])
        tab.wait(lambda: "data-asked" not in tab.html)
        assert 'data-question="e1"' in tab.html, "what was answered stays"
        press(tab, ["restart", 4])
        tab.wait(lambda: "data-asked" in tab.html)
        press(tab, ["reveal", "1", 5])
        tab.wait(lambda: "data-asked" not in tab.html)
        tab.wait(lambda: 'data-question="e1"' not in tab.html)  # an estimate after the answer is none


def test_an_old_link_keeps_its_answers() -> None:
    outline = VelocityLesson.outline(UR5, DEGREES)
    progress = Progress(outline)
    progress.restore({"step": 1, "given": {"1": dict(outline.questions())["1"].right()}, "revealed": ["2"]})
    assert (progress.at, progress.mark("1"), progress.mark("2"), progress.mark("e1")) == (
        1,
        "right",
        "shown",
        "open",
    )


def elsewhere(tab: FakeBrowser) -> str:
    """The arm about which the questions on show are, while another one is there; "": none."""
    found = re.search(r'data-guide-do="arm">Ask this about ([^<]*)<', tab.html)
    return html.unescape(found[1]) if found else ""


def test_opening_a_question_brings_its_arm_and_one_undo_brings_the_own_back(server: int) -> None:
    own, asked = STORE.get("stanford"), arms_of("velocity")[0]
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(own.name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html and is_at(tab, asked, asked.q_home))
        assert f"This is asked about {asked.name}. Undo brings {own.name} back." in tab.html
        assert 'data-question="1"' in tab.html
        tab.say("undo", None)
        tab.wait(lambda: is_at(tab, own, own.q_home))
        assert tab.value("Lesson") == "None"


def test_an_own_arm_explores_a_lesson_that_is_asked_about_others(server: int) -> None:
    own, (asked, *_, other) = STORE.get("stanford"), arms_of("velocity")
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(asked.name)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: 'data-question="1"' in tab.html)
        press(tab, ["fields", "1", 1], [["77"]])
        tab.wait(lambda: "Not quite" in tab.html)
        tab.choose(own.name)
        tab.wait(lambda: elsewhere(tab) == asked.name)
        assert 'data-question="1"' not in tab.html
        assert "data-asked" not in tab.html, "nothing is withheld of an arm that is not asked about"
        assert "Column i of the Jacobian" in tab.html, "it can be read"
        press(tab, ["fields", "1", 2], [["78"]])  # a late press
        press(tab, ["go", 3], 1)
        tab.wait(lambda: "2. Turning" in tab.html and is_at(tab, asked, asked.q_home))
        tab.say("undo", None)
        tab.wait(lambda: elsewhere(tab) == asked.name and "1. A column" in tab.html)
        assert is_at(tab, own, own.q_home)
        press(tab, ["arm", 4])
        tab.wait(lambda: is_at(tab, asked, asked.q_home) and "Not quite" in tab.html)
        assert 'value="77"' in tab.html, "the answer is still there"
        tab.choose(other.name)
        tab.wait(lambda: 'data-question="1"' in tab.html and "Not quite" not in tab.html)
        assert elsewhere(tab) == "", "the visitor's arm is one of the lesson's"


def test_a_step_about_another_arm_brings_it_and_the_next_one_goes_back(server: int) -> None:
    puma, scara = STORE.get("puma560"), STORE.get("scara")
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(puma.name)
        tab.set("Lesson", "Screws")
        tab.wait(lambda: "1. Six numbers for an axis" in tab.html)
        press(tab, ["reveal", "1", 1])
        press(tab, ["go", 2], 2)
        tab.wait(lambda: "3. A joint that slides" in tab.html and is_at(tab, scara, scara.q_home))
        press(tab, ["answer", "3", 3], 1)
        tab.wait(lambda: "See row 3 of the table" in tab.html)
        press(tab, ["go", 4], 3)
        tab.wait(lambda: "4. The product" in tab.html and is_at(tab, puma, puma.q_home))
        for title in ("Six numbers for an axis: answer shown", "A joint that slides: answered right"):
            assert title in tab.html, "both arms belong to one way through the lesson"


def test_a_link_to_a_step_of_an_arm_that_is_no_longer_asked_opens_on_the_lessons_arm(server: int) -> None:
    own, asked = STORE.get("stanford"), arms_of("velocity")[0]
    old = {"guide": {"step": 1, "given": {"1": 0.3}, "revealed": ["2"], "joints": False}}
    new = {"guide": {"step": 0, "given": {}, "revealed": [], "joints": False, "arm": "ur5"}}
    ended = {"guide": {**old["guide"], "step": 0, "revealed": []}}
    for features, robot, title in (
        (ended, asked, "1. A column"),
        (new, own, "1. A column"),  # somebody explores
        (old, own, "2. Turning"),  # read again: nothing is asked
    ):
        state = encode(PageState(robot=own.id, q=own.q_home, lesson="velocity", features=features))  # type: ignore[arg-type]
        with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": state})) as tab:
            tab.wait(lambda robot=robot, title=title: title in tab.html and is_at(tab, robot, robot.q_home))  # type: ignore[misc]
            if features is new:
                assert elsewhere(tab) == STORE.get("ur5").name
            elif features is old:
                assert elsewhere(tab) == asked.name


def asked(form: str, units: Units) -> Question:
    exercise = parse_exercise(HEAD + BODIES[form])
    return exercise.kind.ask("?", exercise.variant(0), units)


@pytest.mark.parametrize("form", BODIES)
def test_a_step_may_be_answered_in_every_form(form: str) -> None:
    question = asked(form, DEGREES)
    assert question.asked().form == form
    progress = Progress(Outline("You can.", (Step("A", "B.", question),), ()))
    right = question.right()
    assert progress.answer("1", right).right
    # In a link, and in other units.
    other = Progress(Outline("You can.", (Step("A", "B.", asked(form, RADIANS)),), ()))
    other.restore(progress.state())
    assert other.mark("1") == "right"
    if form in ("fields", "table", "postures"):
        assert question.cells(right)


def test_typed_answers_keep_their_units() -> None:
    question = asked("fields", DEGREES)
    kept = question.read(["11.459", "30"])
    assert kept == ["11.459 °", "30 °"]
    assert asked("fields", RADIANS).judge(kept).right
    assert not asked("fields", RADIANS).judge(["11.459", "30"]).right


def test_the_way_is_shown_at_the_second_miss() -> None:
    outline = VelocityLesson.outline(UR5, DEGREES)
    progress, question = Progress(outline), dict(outline.questions())["1"]
    far = 3.0 * question.right()  # type: ignore[operator]
    progress.answer("1", far)
    assert progress.feedback("1") == "Too large."
    progress.answer("1", far)
    assert progress.feedback("1") == "Too large.", "the same answer once more is not another miss"
    progress.answer("1", 1.1 * far)
    assert re.match(
        r"Too large\. It is (no )?nearer than .*, your answer before\. On a circle", progress.feedback("1")
    )
    again = Progress(outline)
    again.restore(progress.state())
    assert again.feedback("1") == progress.feedback("1")
    again.restore({**progress.state(), "misses": {"1": -1, "9": 2, "c1": "x"}})
    assert again.misses == {}


def test_three_wrong_tries_get_three_answers() -> None:
    asked = 0
    for lesson, robot in ASKED:
        outline = lesson.outline(robot, DEGREES)
        progress = Progress(outline)
        for key, question in outline.questions():
            if not isinstance(question, Number) or not question.ordered or question.whole_turns:
                continue
            tries = [question.answer + share * (1.0 + abs(question.answer)) for share in (3.0, 3.5, 4.0)]
            said = []
            for wrong in tries:
                assert not progress.answer(key, wrong).right
                said.append(progress.feedback(key))
            assert len(set(said)) == 3, (lesson.key, key, said)
            assert said[1].count("no nearer than") == said[2].count("no nearer than") == 1
            progress.answer(key, tries[0])
            assert " nearer than" in progress.feedback(key)
            asked += 1
    assert asked > 15


def test_what_is_wrong_with_two_answers_alike_is_said_once_more() -> None:
    step = VelocityLesson.outline(UR5, DEGREES).steps[0]
    option = Option("right", "So.", right=True)
    question = Choice("?", (option, Option("a", "Not so."), Option("b", "Not so."), Option("c", "Other.")))
    progress = Progress(Outline("", (replace(step, question=question, estimate=None),), ()))
    said = []
    for wrong in (1, 2, 3):
        progress.answer("1", wrong)
        said.append(progress.feedback("1"))
    assert said == ["Not so.", "Not so. The same holds for your answer before.", "Other."]


def test_what_a_question_withholds_ends_with_the_answer() -> None:
    outline = VelocityLesson.outline(UR5, DEGREES)
    step = replace(outline.steps[0], withheld=frozenset({"jacobian"}))
    outline = replace(outline, steps=(step, *outline.steps[1:]), withheld=(frozenset(), frozenset({"ellipsoid"})))
    progress = Progress(outline)
    assert progress.withheld == {"jacobian"}
    progress.answer("1", 3.0)
    assert progress.withheld == {"jacobian"}
    progress.reveal("1")
    assert progress.withheld == frozenset()
    progress.go(len(outline.steps))
    assert progress.withheld == {"ellipsoid"}
    progress.reveal("c2")
    assert progress.withheld == frozenset()


def test_the_arm_touches_nothing_in_a_step_or_where_its_answer_leads() -> None:
    count = 0
    for lesson, robot in ASKED:
        arm, floor = Arm(robot, robot.q_home, robot.q_home), clearance(robot, skeleton=True)
        for step in lesson.outline(robot, DEGREES).steps:
            places = [pose.q for pose in (step.pose, step.end) if pose is not None]
            if step.question is not None and step.question.asked().form == "posture":
                places += np.atleast_2d(step.question.right()).tolist()  # type: ignore[arg-type]
            for q in map(np.array, places):
                assert floor.at(q) is None, (lesson.key, robot.id, step.title)
                assert arm.contacts_at(q) == (), (lesson.key, robot.id, step.title)
                count += 1
    assert count > 100


def test_the_poses_of_steps_are_values() -> None:
    pose = Pose((0.1, 0.2), drawing={"frame": "tool"})
    assert pose == Pose((0.1, 0.2), drawing={"frame": "tool"})
    with pytest.raises(AttributeError):
        pose.q = (0.0,)  # type: ignore[misc]
