"""Goal, steps and questions of every lesson: judging, progress, and each number against `kin`."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fake_browser import FakeBrowser
from hypothesis import given
from hypothesis import strategies as st
from lesson_arms import arms_of
from live_server import serve_viewer

import kin
from app.exercises.contract import Posed
from app.exercises.lesson_text import LessonText
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.lessons.dh.lesson import DHLesson
from app.viewer.lessons.equations import questions as equations
from app.viewer.lessons.equations.lesson import EquationsLesson
from app.viewer.lessons.guide.outline import (
    Choice,
    Mistake,
    Number,
    Option,
    Outline,
    Question,
    Step,
    count,
    one_right,
)
from app.viewer.lessons.guide.poses import moved
from app.viewer.lessons.guide.progress import Progress
from app.viewer.lessons.guide.views import steps_html
from app.viewer.lessons.postures import planar
from app.viewer.lessons.postures import questions as postures
from app.viewer.lessons.postures.loop import Round
from app.viewer.lessons.redundancy import questions as redundancy
from app.viewer.lessons.redundancy.lesson import RedundancyLesson
from app.viewer.lessons.velocity import questions as velocity
from app.viewer.lessons.velocity.lesson import VelocityLesson
from app.viewer.server import ViewerServer
from kin import InputError, Robot
from kin.differential.task import natural_task, usual_rank
from kin.transforms import Array
from kin.typed import EntryError
from kin.units import PLAIN, Unit, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
ROBOTS = STORE.robots
DEGREES, RADIANS = Units(), Units(degrees=False, length="m")
PAIRS = [(robot, lesson) for lesson in LESSONS for robot in arms_of(lesson.key)]
ANGLE = Number("θ?", math.pi / 2, DEGREES.angles, math.radians(1.0), "Add.", (Mistake(0.0, "Forgot it."),), True)
LENGTH = Number("d?", -0.2, DEGREES.lengths, 0.001, "Measure.")
SHOWN = (PLAIN, DEGREES.angles, RADIANS.angles, DEGREES.lengths, RADIANS.lengths, Unit("N·m", 1.0, 2))
SUM = Choice("1 + 1?", (Option("2", "Counted.", True), Option("3", "One too many.")))
SMALL = Outline("Count.", (Step("Sums", "Think.", SUM, "It is 2."), Step("Rest", "Look.")), (ANGLE, LENGTH))


@pytest.fixture(params=PAIRS, ids=[f"{robot.id}-{lesson.key}" for robot, lesson in PAIRS], scope="module")
def outline(request: pytest.FixtureRequest) -> Outline:
    robot, lesson = request.param
    return lesson.asked(robot, DEGREES)


def arms(lesson: str) -> pytest.MarkDecorator:
    """For each of the lesson's arms."""
    return pytest.mark.parametrize("robot", arms_of(lesson), ids=lambda robot: robot.id)


# Judging


def test_an_answer_is_right_within_its_tolerance_only() -> None:
    for error, right in ((0.9, True), (-0.9, True), (1.1, False), (-1.1, False)):
        assert ANGLE.judge(math.pi / 2 + math.radians(error)).right is right
    assert ANGLE.judge(math.pi / 2 - 2 * math.pi).right, "a whole turn away"
    assert not LENGTH.judge(-0.2 + 2 * math.pi).right


def test_a_wrong_answer_gets_its_reason() -> None:
    assert ANGLE.judge(0.0).reason == "Forgot it."
    assert (ANGLE.judge(1.0).reason, ANGLE.judge(1.0).way) == ("", "Add.")
    assert LENGTH.judge(0.2).full == "The size is right, the sign is not. Measure."
    assert LENGTH.judge(-0.3).full == "The size is too large. Measure."
    assert LENGTH.judge(0.0).full == "The size is too small. Measure."
    assert LENGTH.judge(0.3).reason == "The sign is not right, and the size is too large."
    assert LENGTH.judge(-0.0002).reason.startswith("This is the value in metres. The unit is millimetres")
    assert ANGLE.judge(math.radians(math.pi / 2)).reason.startswith("This is the value in radians.")
    assert (SUM.judge(1).right, SUM.judge(1).reason) == (False, "One too many.")
    assert (SUM.judge(0).right, SUM.judge(0).reason) == (True, "Counted.")


def test_typed_answers_take_units() -> None:
    assert ANGLE.read_text("90") == ANGLE.read_text("90°") == pytest.approx(math.pi / 2)
    assert ANGLE.read_text(" 1.5 rad ") == 1.5
    assert (
        LENGTH.read_text("−200") == LENGTH.read_text("-20 cm") == LENGTH.read_text("-0,2 m") == pytest.approx(-0.2)
    )
    for text in ("", "x", "2 m", "1e999"):
        with pytest.raises(EntryError):
            ANGLE.read_text(text)
    with pytest.raises(EntryError, match="is not a unit"):
        count("n?", 3, "Count.").read_text("3 mm")


def test_solutions_are_shown_as_fine_as_they_are_asked() -> None:
    assert (ANGLE.value_text, ANGLE.tolerance_text) == ("90°", "± 1°")
    assert (LENGTH.value_text, LENGTH.tolerance_text) == ("−200 mm", "± 1 mm")
    counted = count("n?", 3, "")
    assert (counted.value_text, counted.tolerance_text) == ("3", "a whole number")
    assert SUM.solution() == "2. Counted."
    assert LENGTH.solution() == "−200 mm. Measure."
    ratio = Number("r?", 5.3, PLAIN, 0.1, "Divide.")
    assert (ratio.value_text, ratio.tolerance_text) == ("5.3", "± 0.1"), "no count, though as coarse"
    assert ratio.read_text("530 %") == pytest.approx(5.3)


@pytest.mark.parametrize("unit", SHOWN, ids=lambda unit: unit.name or "plain")
def test_a_right_answer_on_show_is_right(unit: Unit) -> None:
    rng = np.random.default_rng(5)
    for tolerance in (2e-4, 0.01, 0.0999, 0.1, 0.2, 0.45, 0.5, 0.0, 1.0, 9.9, 10.0, 250.0):
        for value in (0.0,) if tolerance == 0.0 else (*rng.uniform(-1e3, 1e3, 20), 5.3, -0.5, 2.5, 0.0, 1e-9):
            question = Number("?", value / unit.scale, unit, tolerance / unit.scale, "Compute.")
            for shown in (question.value_text, question.right_cells()[0][0]):
                assert question.judge(question.read_text(shown)).right, (tolerance, value, shown)


def test_a_question_must_have_a_right_answer() -> None:
    for options in (
        (),
        (Option("2", "", True),),
        (Option("2", ""), Option("3", "")),
        (Option("2", "", True),) * 2,
    ):
        with pytest.raises(ValueError, match="options are needed"):
            Choice("?", options)
    made = one_right("?", ("b", "yes"), [("a", "no"), ("b", "the same text"), ("a", "again")], 5)
    assert [(option.text, option.right) for option in made.options] == [("a", False), ("b", True)]
    assert count("n?", 3, "", [(3, "would be right"), (4, "no")]).mistakes == (Mistake(4, "no"),)


# Progress


def test_progress_keeps_the_last_answer_until_the_right_one_is_on_show() -> None:
    progress = Progress(SMALL)
    assert progress.mark("1") == "open"
    assert not progress.answer("1", 1).right
    assert progress.mark("1") == "wrong"
    assert progress.answer("1", 0).right
    progress.answer("1", 1)
    progress.reveal("1")
    assert progress.mark("1") == "right", "what is settled stays"
    progress.answer("c1", 0.0)
    progress.reveal("c1")
    progress.answer("c1", math.pi / 2)
    progress.answer("c2", -0.2)
    assert (progress.mark("c1"), progress.mark("c2"), progress.score) == ("shown", "right", (1, 2))


def test_progress_refuses_what_no_control_sends() -> None:
    progress = Progress(SMALL)
    for key, value in (("9", 0), ("1", 2), ("1", True), ("1", 0.0), ("c1", math.nan), ("c1", "x"), (1, 0)):
        with pytest.raises(InputError):
            progress.answer(key, value)
    for at in (-1, 3, True, "1"):
        with pytest.raises(InputError):
            progress.go(at)
    assert progress.state() == Progress(SMALL).state()


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(["1", "c1", "c2"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["1", "c1", "x"]), inner),
    max_leaves=6,
)


@given(st.dictionaries(st.sampled_from(["step", "given", "revealed"]), JSON))
def test_any_state_can_be_restored(state: dict[str, object]) -> None:
    progress = Progress(SMALL)
    progress.restore(state)
    for at in range(3):
        progress.go(at)
        assert steps_html(progress, {})
    again = Progress(SMALL)
    again.restore(json.loads(json.dumps(progress.state())))
    assert again.state() == progress.state()


# The lessons


def test_steps_about_other_arms_are_found_by_their_place_in_the_file() -> None:
    class Turns(DHLesson):
        titles = ("Turn", "Turn")

        @classmethod
        def outline(cls, robot: Robot, units: Units, text: LessonText | None = None) -> Outline:
            titles = cls.titles if robot.id == "puma560" else ("Turn", "Slide")
            steps = (
                Step(title, f"{i} of {robot.id}", arms=("puma560",), at=f"steps[{i}].")
                for i, title in enumerate(titles)
            )
            return Outline("Turn.", tuple(steps), ())

    assert [step.text for step in Turns.asked(kin.get_robot("ur5"), DEGREES).steps] == [
        "0 of puma560",
        "1 of puma560",
    ]
    Turns.titles = Turns.titles[:1]
    with pytest.raises(ValueError, match=r"steps\[1\]\.when leaves out the step “Slide” for its arm puma560"):
        Turns.asked(kin.get_robot("ur5"), DEGREES)


def wrong_answers(question: Question) -> Iterator[Any]:
    if isinstance(question, Posed):  # test_varied_verbs.py has more of them
        asked = question.asked()
        other = {
            "order": list(range(len(asked.labels))),
            "fields": ["1"] * len(asked.labels),
            "posture": [value + 0.4 for value in question.variant.robot.q_home.tolist()],
            "frame": [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0],
        }
        yield other[asked.form]
        return
    if isinstance(question, Round):
        yield [question.robot.q_home.tolist()]
        return
    if isinstance(question, Choice):
        yield from (i for i, option in enumerate(question.options) if not option.right)
        return
    yield from (m.value for m in question.mistakes if abs(m.value - question.answer) > question.tolerance)
    yield from (question.answer + k * question.tolerance for k in (-1.5, 1.5))


def test_every_answer_is_judged_with_a_reason(outline: Outline) -> None:
    assert outline.goal.startswith("You can ")
    assert outline.goal.count(".") == 1
    assert len(outline.steps) >= 2
    assert 2 <= len(outline.check) <= 4
    for step in outline.steps:
        assert step.question is None or step.shown or step.practice
        assert step.text.endswith("."), step.text
    for key, question in outline.questions():
        progress = Progress(outline)
        right = question.right()
        wrong = list(wrong_answers(question))
        assert wrong, question.prompt
        for value in wrong:
            verdict = progress.answer(key, value)
            assert not verdict.right, (question.prompt, value)
            assert len(verdict.full) > 9, (question.prompt, value)
        assert progress.answer(key, right).right, question.prompt
        assert question.is_answer(right)
        text, cells = question.solution(), question.right_cells()
        if question.asked().form == "fields":
            assert question.judge(question.read(cells[0])).right, "what the fields show is right"
            assert max(map(len, cells[0])) <= 8, f"and rounded: {cells}"
        if isinstance(question, Number):
            shown = question.value_text
            assert question.judge(question.read_text(shown)).right, f"the shown answer is accepted: {shown}"
            for mistake in question.mistakes:
                assert mistake.reason.endswith(".")
        assert text.endswith("."), text


def test_steps_move_the_arm_within_its_limits(outline: Outline, request: pytest.FixtureRequest) -> None:
    robot: Robot = request.node.callspec.params["outline"][0]
    for step in outline.steps:
        for pose in (step.pose, step.end):
            if pose is not None:
                q, about = pose.q, step.about or robot
                low, high = about.lower - 1e-9, about.upper + 1e-9
                assert ((low <= np.array(q)) & (np.array(q) <= high)).all(), step.title


def test_units_change_the_words_but_not_the_answers() -> None:
    for robot, lesson in PAIRS:
        for (_, a), (_, b) in zip(
            lesson.asked(robot, DEGREES).questions(), lesson.asked(robot, RADIANS).questions(), strict=True
        ):
            if isinstance(a, Number) and isinstance(b, Number):
                assert (a.answer, a.tolerance) == (b.answer, b.tolerance)
            elif isinstance(a, Choice) and isinstance(b, Choice):
                assert [o.right for o in a.options] == [o.right for o in b.options]


# Each number against the core


def numbers(outline: Outline) -> dict[str, float]:
    return {key: q.answer for key, q in outline.questions() if isinstance(q, Number)}


def rights(outline: Outline) -> dict[str, list[str]]:
    return {key: [o.text for o in q.options if o.right] for key, q in outline.questions() if isinstance(q, Choice)}


def frames(robot: Robot, q: Array) -> Array:
    return np.concatenate([robot.T_world_base[None], kin.link_frames(robot, q)])


@arms("dh")
def test_dh_numbers(robot: Robot) -> None:
    outline = DHLesson.outline(robot, DEGREES)
    found = numbers(outline)
    T = frames(robot, robot.q_home)
    assert found["1"] == len(T)
    row = int(outline.steps[2].title.split()[1])
    assert found["3"] == pytest.approx(np.linalg.norm(T[row, :3, 3] - T[row - 1, :3, 3]))
    order = dict(outline.questions())["2"]
    first = order.asked().labels[order.right()[0]]  # type: ignore[index]
    assert robot.convention == "standard"
    assert first == "turn by 40° about z"
    assert outline.steps[4].end is not None
    end = np.array(outline.steps[4].end.q)
    assert np.flatnonzero(end != robot.q_home).tolist() == [0]
    ways = [kin.fk(robot, q)[:3, 3] for q in (robot.q_home, end)]
    assert found["5"] == pytest.approx(np.linalg.norm(ways[1] - ways[0]))
    # The last joint moves the tool point on a circle.
    assert found["c4"] == pytest.approx(np.linalg.norm(kin.jacobian(robot, robot.q_home)[:3, -1]), abs=1e-9)


@arms("dh")
def test_dh_mistake(robot: Robot) -> None:
    """What the table with a wrong sign describes, by poses of that table."""
    step = DHLesson.outline(robot, DEGREES).steps[5]
    assert isinstance(step.question, Choice)
    row = int(step.question.prompt.split("in row ")[1].split(",")[0]) - 1
    assert step.question.prompt.split()[2][0] == "α"
    rows = list(robot.rows)
    rows[row] = replace(rows[row], alpha=-rows[row].alpha)
    typed = replace(robot, rows=tuple(rows))
    q = robot.random_q(np.random.default_rng(1), 50)
    chosen = [option.text.split()[0] for option in step.question.options if option.right]
    assert chosen == ["It"]
    assert not np.allclose(kin.fk(robot, q), kin.fk(typed, q), atol=1e-9)
    mapping = kin.compare(robot, typed, explain=False).mapping
    assert mapping is not None
    assert np.allclose(mapping.base @ kin.fk(typed, mapping.to_b(q)) @ mapping.tool, kin.fk(robot, q), atol=1e-6)
    assert "the same arm" in next(o.text for o in step.question.options if o.right)


@arms("dh")
def test_dh_offsets(robot: Robot) -> None:
    outline = DHLesson.outline(robot, DEGREES)
    question = outline.check[0]
    assert isinstance(question, Number)
    joint = int(question.prompt.split("joint ")[1].split()[0]) - 1
    # The matrix of the row, from two neighbouring frames.
    T = frames(robot, robot.q_home)
    A = np.linalg.inv(T[robot.joint_rows[joint]]) @ T[robot.joint_rows[joint] + 1]
    turned = math.atan2(A[1, 0], A[0, 0])
    assert math.remainder(question.answer - turned, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


@arms("equations")
def test_equations_numbers(robot: Robot) -> None:
    outline = EquationsLesson.outline(robot, DEGREES)
    found, chosen = numbers(outline), rights(outline)
    T = kin.fk(robot, robot.q_home)
    assert found["2"] == pytest.approx(np.linalg.norm(T[:3, 3]))
    question = outline.steps[2].question
    assert isinstance(question, Number)
    component = "xyz".index(question.prompt.split()[2][1])
    assert found["3"] == pytest.approx(T[component, 0], abs=1e-12)
    assert found["c1"] == pytest.approx(0.0, abs=1e-9)
    q = robot.random_q(np.random.default_rng(9), 20)
    with_joint_1 = q.copy()
    with_joint_1[:, 0] = robot.q_home[0]
    changes = np.abs(kin.fk(robot, q)[:, 2, 3] - kin.fk(robot, with_joint_1)[:, 2, 3]).max() > 1e-9
    assert chosen["c2"] == ["Yes" if changes else "No"]


def test_a_wrong_sign_shows_in_the_products_of_columns() -> None:
    T = kin.fk(ROBOTS[0], ROBOTS[0].q_home)
    for row, column in itertools.product(range(3), range(3)):
        others = [k for k in range(3) if k != column]
        expected = max(2 * abs(T[row, column] * T[row, k]) for k in others)
        assert equations.flipped(T, row, column) == pytest.approx(expected, abs=1e-12)


@arms("postures")
def test_postures_numbers(robot: Robot) -> None:
    outline = postures.outline(robot, DEGREES)
    found, chosen = numbers(outline), rights(outline)
    names = kin.branch_names(robot)
    assert found["1"] == len(names)
    assert chosen["2"] == [kin.branch_of(robot, robot.q_home)]
    assert len(dict(outline.questions())["2"].asked().labels) == 4
    T = kin.fk(robot, robot.q_home)
    solutions = kin.solve_ik(robot, T, q_seed=robot.q_home).solutions
    assert found["3"] == len(solutions)
    end = outline.steps[2].end
    assert end is not None
    assert not np.allclose(end.q, robot.q_home)
    assert np.allclose(kin.fk(robot, np.array(end.q)), T, atol=1e-6), "the tool is where it was"
    assert chosen["4"] == ["None"]
    assert chosen["c1"] == ["Yes"]
    assert np.linalg.matrix_rank(kin.jacobian(robot, robot.q_home), tol=1e-6) == robot.n == 6


def test_two_links_by_hand() -> None:
    robot = STORE.get("planar2r")
    steps = postures.outline(robot, DEGREES).steps[-3:]
    ring, bend, theta = (step.question for step in steps)
    assert isinstance(ring, Number)
    assert isinstance(bend, Number)
    assert isinstance(theta, Number)
    q, folded = robot.q_home.copy(), robot.q_home.copy()
    folded[1] = math.pi
    wrist = kin.link_frames(robot, np.stack([q, folded]))[:, 1, :3, 3]
    assert ring.answer == pytest.approx(np.linalg.norm(wrist[1]))
    assert bend.answer == pytest.approx(abs(q[1]))
    assert steps[1].pose is not None
    assert steps[1].end is not None
    assert steps[1].pose.q[1] == 0.0, "the slider of the joint does not show the answer"
    assert np.allclose(steps[1].end.q, q)
    assert steps[2].end is not None
    other = np.array(steps[2].end.q)
    assert theta.answer == pytest.approx(other[0])
    # Both are the solutions of the core, for the point or for the pose.
    T = kin.fk(robot, q)
    result = kin.solve_ik(robot, T[:3, 3], task="position")
    assert len(result.solutions) == 2
    for expected in (q, other):
        assert min(np.abs(solution.q - expected).max() for solution in result.solutions) < 1e-9


def test_only_planar_tables_are_solved_by_hand() -> None:
    assert [robot.id for robot in ROBOTS if planar.is_planar(robot)] == ["planar2r", "planar3r"]
    assert not planar.is_planar(STORE.get("planar2r").with_base(np.diag([1.0, -1.0, -1.0, 1.0])))


@arms("redundancy")
def test_redundancy_numbers(robot: Robot) -> None:
    found = numbers(RedundancyLesson.outline(robot, DEGREES))
    q = robot.random_q(np.random.default_rng(11), 5)
    J = kin.jacobian(robot, q)
    rank = max(np.linalg.matrix_rank(j, tol=1e-9) for j in J)
    assert found["1"] == robot.n - rank > 0
    assert found["2"] == robot.n - max(np.linalg.matrix_rank(j[:3], tol=1e-9) for j in J)
    z = redundancy.null_vector(robot)
    assert np.linalg.norm(kin.jacobian(robot, robot.q_home) @ z) == pytest.approx(0.0, abs=1e-9)
    assert found["c1"] == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(z) == pytest.approx(1.0)
    question = RedundancyLesson.outline(robot, DEGREES).steps[2].question
    assert isinstance(question, Choice)
    fastest = {f"Joint {k + 1}" for k in np.flatnonzero(np.abs(z) > np.abs(z).max() - 1e-6)}
    assert {o.text for o in question.options if o.right} <= fastest


@arms("velocity")
def test_velocity_numbers(robot: Robot) -> None:
    outline = VelocityLesson.outline(robot, DEGREES)
    found, chosen = numbers(outline), rights(outline)
    step = 1e-6
    q, _ = moved(robot, 0, step)
    ways = [kin.fk(robot, x)[:3, 3] for x in (robot.q_home, q)]
    assert found["1"] == pytest.approx(np.linalg.norm(ways[1] - ways[0]) / step, abs=1e-5)
    assert found["2"] == 1.0
    assert robot.joints[-1].kind == "revolute"
    question = outline.steps[2].question
    assert isinstance(question, Number)
    k = int(question.prompt.split("joint ")[1].split()[0]) - 1
    # Virtual work: the joint lifts the weight.
    q, taken = moved(robot, k, step)
    lifted = (kin.fk(robot, q) - kin.fk(robot, robot.q_home))[2, 3]
    assert found["3"] == pytest.approx(velocity.LOAD * lifted / taken, abs=1e-3)
    if (singular := velocity.singular(robot)) is not None:
        assert found["6"] == velocity.rank_of(robot, singular[0]) < usual_rank(robot, natural_task(robot))
        assert kin.singularities(robot, singular[0])[0].distance == pytest.approx(0.0, abs=1e-9)
    semi = np.linalg.svd(kin.jacobian(robot, robot.q_home)[:3], compute_uv=False)
    semi = semi[semi > 1e-9]
    assert found["4"] == pytest.approx(np.linalg.norm(kin.jacobian(robot, velocity.bent(robot))[:3], 2))
    assert found["c2"] == pytest.approx(semi[0] / semi[-1])
    assert chosen["c1"] == ["Yes" if abs(kin.jacobian(robot, robot.q_home)[2, 0]) > 1e-10 else "No"]


# In a page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


def press(tab: FakeBrowser, key: list[object], value: object) -> None:
    tab.say("feature", ["guide", key, value])


@pytest.mark.full
def test_a_visitor_answers_and_the_link_keeps_it(server: int) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", "DH table step by step")
        tab.wait(lambda: "Goal:" in tab.html and "1. Rows and frames" in tab.html)
        press(tab, ["fields", "1", 1], [["6"]])
        tab.wait(lambda: "Frame 0, at the base, is one more" in tab.html)
        press(tab, ["fields", "1", 2], [["seven"]])
        tab.wait(lambda: "is not a number" in tab.html)
        press(tab, ["fields", "1", 3], [["7"]])
        tab.wait(lambda: "Right." in tab.html and "Every fourth motion" in tab.html)
        press(tab, ["go", 4], 4)
        tab.wait(lambda: "5. A joint and its column" in tab.html)
        press(tab, ["reveal", "5", 5], None)
        pioneer = ROBOTS[0]
        end = DHLesson.outline(pioneer, DEGREES).steps[4].end
        assert end is not None
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(pioneer, np.array(end.q)), atol=1e-6))
        assert "The answer." in tab.html
        press(tab, ["go", 6], len(DHLesson.outline(pioneer, DEGREES).steps))
        tab.wait(lambda: "0 of 4 right" in tab.html)
        press(tab, ["answer", "c2", 7], 1)
        tab.wait(lambda: "1 of 4 right" in tab.html)
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html)
        tab.set("Lesson", "DH table step by step")
        tab.wait(lambda: "1 of 4 right" in tab.html)
        kept = tab.stored()
    memory = json.dumps({"address": "http://127.0.0.1/", "state": kept})
    with FakeBrowser(server, memory=memory) as tab:
        tab.wait(lambda: "1 of 4 right" in tab.html)
        press(tab, ["go", 1], 0)
        tab.wait(lambda: "Right." in tab.html)
        tab.set("Robot", STORE.get("scara").name)
        tab.wait(lambda: "Ask this about Pioneer arm" in tab.html and "Right." not in tab.html)


def test_joint_sliders_in_a_lesson_move_the_arm_and_each_other(server: int) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html)
        tab.set("Joint sliders", True)
        tab.wait(lambda: tab.sliders.count("1 rotating base") == 2)
        first, second = [u for u, m in tab.gui.items() if m["props"].get("label") == "1 rotating base"]
        for uuid, value, other in ((first, 20.0, second), (second, 40.0, first)):
            tab.values[uuid] = value
            tab.send("GuiUpdateMessage", uuid=uuid, updates={"value": value})
            tab.wait(lambda other=other, value=value: tab.values[other] == value)  # type: ignore[misc]
        q = ROBOTS[0].q_home.copy()
        q[0] = math.radians(40.0)
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(ROBOTS[0], q), atol=1e-6))
        tab.set("Lesson", "None")
        tab.wait(lambda: tab.sliders.count("1 rotating base") == 1)


def test_a_passed_check_leads_to_the_next_lesson(server: int) -> None:
    def pass_check(tab: FakeBrowser, index: int) -> None:
        outline = LESSONS[index].asked(arms_of(LESSONS[index].key)[0], DEGREES)
        press(tab, ["go", 1], len(outline.steps))
        tab.wait(lambda: f"0 of {len(outline.check)} right" in tab.html)
        for number, question in enumerate(outline.check, 1):
            assert "Next lesson" not in tab.html
            if isinstance(question, Choice):
                press(tab, ["answer", f"c{number}", 10 + number], question.right())
            else:
                press(tab, ["fields", f"c{number}", 10 + number], question.right_cells())
            tab.wait(lambda number=number: f"{number} of {len(outline.check)} right" in tab.html)  # type: ignore[misc]

    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", LESSONS[0].title)
        tab.wait(lambda: f'data-lesson="{LESSONS[0].title}"' in tab.html)
        pass_check(tab, 0)
        assert f"Next lesson: {LESSONS[1].title}" in tab.html
        press(tab, ["next", 30], None)
        tab.wait(lambda: f'data-lesson="{LESSONS[1].title}"' in tab.html)
        assert tab.value("Lesson") == LESSONS[1].title
        last = len(LESSONS) - 1
        tab.set("Lesson", LESSONS[last].title)
        tab.wait(lambda: f'data-lesson="{LESSONS[last].title}"' in tab.html)
        pass_check(tab, last)
        assert "Next lesson" not in tab.html, "none follows"
        press(tab, ["next", 31], None)
        tab.settle()
        assert f'data-lesson="{LESSONS[last].title}"' in tab.html
