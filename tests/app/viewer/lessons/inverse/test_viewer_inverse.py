"""The lesson "Inverse kinematics step by step": its derivations against the core, its questions, its page."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.viewer.lessons.guide.outline import Number
from app.viewer.lessons.inverse import formulas, views, words
from app.viewer.lessons.inverse.arm import Arm, arm_of
from app.viewer.lessons.inverse.derive import all_signs, arm_angle, branches, derive, row_of, signs_of
from app.viewer.lessons.inverse.exercise import Exercise, all_branches, error_of, example, exercise, flipped
from app.viewer.lessons.inverse.questions import outline_of
from app.viewer.lessons.inverse.shapes import Angle, Length, joints_of, shapes
from app.viewer.lessons.inverse.sheet import Derivation
from app.viewer.lessons.inverse.tree import tree
from kin import Robot
from kin.transforms import Array, frame_from_approach
from kin.units import RADIANS, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

UNITS = Units()
PIONEER, PUMA, ABB, SRS, IIWA, TWO, THREE = (
    kin.get_robot(name)
    for name in ("pioneer5", "puma560", "irb120", "redundant7-craig", "iiwa14", "planar2r", "planar3r")
)


def pose(seed: int) -> Array:
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    direction = rng.normal(size=3)
    T[:3, :3] = frame_from_approach(direction / np.linalg.norm(direction))
    T[:3, 3] = 0.2 * rng.normal(size=3)
    return T


ARMS = [
    PIONEER,
    PUMA,
    ABB,
    SRS,
    IIWA,
    TWO,
    THREE,
    replace(PIONEER.with_base(pose(1)), id="pioneer-base"),
    replace(PUMA.with_base(pose(2)).with_tool(pose(3)), id="puma-tool"),
    replace(SRS.with_tool(pose(4)), id="srs-tool"),
]


def of(robot: Robot) -> Arm:
    arm = arm_of(robot)
    assert arm is not None
    return arm


def turn(a: Array, b: Array) -> float:
    return float(np.abs(np.remainder(a - b + math.pi, 2.0 * math.pi) - math.pi).max())


def psi_of(arm: Arm, q: Array) -> float:
    return arm_angle(arm, q) if arm.family == "srs7" else 0.0


def rows(arm: Arm, T: Array, psi: float) -> Array:
    return kin.ik_branches(arm.robot, T, psi) if arm.family == "srs7" else kin.ik_branches(arm.robot, T)


# Derivations


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_all_branches_and_no_others_are_derived(robot: Robot) -> None:
    arm, missing = of(robot), 0
    for q in robot.random_q(np.random.default_rng(7), 20):
        T, psi = kin.fk(robot, q), psi_of(arm, q)
        derived, known = branches(arm, T, q, psi), rows(arm, T, psi)
        for found in derived:
            if arm.family == "planar":
                assert found.q is not None
                assert min(turn(found.q, row) for row in known) < 1e-9
            else:
                row = known[row_of(arm, found.signs)]
                assert (found.q is None) == bool(np.isnan(row).any())
                missing += found.q is None
                assert found.q is None or turn(found.q, row) < 1e-9
            assert found.q is None or max(error_of(arm, found.q, T)) < 1e-9
        own = next(found for found in derived if found.signs == signs_of(arm, q))
        assert own.q is not None
        assert turn(own.q, q) < 1e-7
    assert robot is not PIONEER or missing, "targets without some of the branches are among these"


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_what_is_shown_is_what_was_computed(robot: Robot) -> None:
    arm = of(robot)
    given = exercise(arm, example(arm))
    found = given.followed.derivation
    for line in (line for step in found.steps for line in step.lines if line.text):
        again = formulas.value(line.text, found.values)
        if line.kind == "angle":
            assert abs(math.remainder(float(again) - float(line.value), 2.0 * math.pi)) < 1e-12, line.text
        else:
            assert np.allclose(again, line.value, atol=1e-12), line.text
        assert "<math" in formulas.mathml(line.name, line.text)
        assert views.value_text(line, UNITS)
    assert [step.key for step in found.steps] == list(arm.keys)
    theta = np.array([found.number(f"θ{i + 1}") for i in range(robot.n)])
    assert turn(theta, arm.angles(given.q)) < 1e-9


@pytest.mark.parametrize("robot", [ABB, SRS, PUMA, PIONEER, THREE], ids=lambda robot: robot.id)
def test_figures_measure_the_numbers(robot: Robot) -> None:
    arm = of(robot)
    given = exercise(arm, example(arm))
    origins = kin.link_frames(robot, given.q)[:, :3, 3]
    seen = set()
    for key in arm.keys:
        for shape in shapes(arm, given.followed.derivation, key):
            if isinstance(shape, Length):
                value = given.followed.derivation.values[shape.name]
                assert np.linalg.norm(shape.end - shape.start) == pytest.approx(abs(float(value))), shape.name
                assert abs(shape.aside @ (shape.end - shape.start)) < 1e-9
                seen.add(shape.name)
            elif isinstance(shape, Angle) and shape.name[0] in "θβψφ":
                value = given.followed.derivation.number(shape.name)
                assert shape.size == pytest.approx(value), shape.name
                assert abs(shape.start @ shape.about) < 1e-9
    assert "D" in seen
    for point in joints_of(arm, given.followed.derivation)[2:]:
        at = arm.T_base_lesson[:3, :3] @ point + arm.T_base_lesson[:3, 3]
        if arm.family != "wrist6":  # whose elbow is drawn in the plane of the wrist centre
            assert np.linalg.norm(origins - at, axis=1).min() < 1e-9


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_figures_say_what_the_questions_ask_on_every_branch(robot: Robot) -> None:
    arm, seen = of(robot), 0
    for signs in all_signs(arm):
        given = exercise(arm, example(arm), signs)
        for key, step in zip(arm.keys, outline_of(given, UNITS).steps, strict=False):  # one more is about all arms
            names = re.findall("θ[₁-₇]|[Dρ](?=,|, | of|\\?)", step.question.prompt if step.question else "")
            for shape in shapes(arm, given.followed.derivation, key):
                if isinstance(step.question, Number) and names[:1] == [words.sub(shape.name)]:
                    size = shape.size if isinstance(shape, Angle) else math.dist(shape.start, shape.end)  # type: ignore[union-attr]
                    assert size == pytest.approx(step.question.answer, abs=1e-9), (signs, step.title)
                    seen += 1
    assert seen >= len(all_signs(arm))


def test_arms_without_a_derivation() -> None:
    for name in ("panda", "ur5", "scara", "stanford", "redundant7"):
        assert arm_of(kin.get_robot(name)) is None


# Singular and unreachable targets


def specials(found: Derivation) -> dict[str, int]:
    return {step.special: step.free for step in found.steps if step.special is not None}


def finite(found: Derivation) -> None:
    for name, value in found.values.items():
        assert np.all(np.isfinite(value)), name


@pytest.mark.parametrize("robot", [PIONEER, ABB], ids=lambda robot: robot.id)
def test_a_wrist_centre_on_axis_1_leaves_joint_1_free(robot: Robot) -> None:
    arm = of(robot)
    theta = arm.angles(example(arm))
    lengths, fore = arm.lengths, "d4" if arm.family == "wrist5" else "f"
    theta[1] = math.radians(110.0)
    reach = lengths["a1"] + lengths["a2"] * math.cos(theta[1])
    theta[2] = math.acos(-reach / lengths[fore]) - theta[1]
    q = arm.joints(theta)
    T = kin.fk(robot, q)
    for turned in (0.0, 0.4):
        near = q + turned * np.eye(robot.n)[0]
        # The wrist centre is the same; only the followed side of the elbow leads back to q.
        for found in branches(arm, T, near):
            finite(found)
            assert specials(found)["on axis 1"] == 1
            assert found.q is None or abs(math.remainder(float(found.q[0] - near[0]), 2.0 * math.pi)) < 1e-12
            if found.q is not None:
                assert max(error_of(arm, found.q, T)) < 1e-7
                text = words.special_text(arm, found.steps[1])
                assert "θ₁ is free" in text


@pytest.mark.parametrize(
    ("robot", "joint"),
    [(PIONEER, 2), (PUMA, 2), (SRS, 3), (IIWA, 3), (TWO, 1), (THREE, 1)],
    ids=lambda x: str(getattr(x, "id", x)),
)
def test_a_stretched_elbow_merges_both_elbows(robot: Robot, joint: int) -> None:
    arm = of(robot)
    theta = arm.angles(example(arm))
    theta[joint] = 0.0
    q = arm.joints(theta)
    T, psi = kin.fk(robot, q), psi_of(arm, q)
    signs = signs_of(arm, q)
    both = [derive(arm, T, s, q, psi) for s in (signs, flipped(signs, 0 if arm.family == "planar" else 1))]
    for found in both:
        finite(found)
        assert "straight" in specials(found)
        assert found.q is not None
        assert max(error_of(arm, found.q, T)) < 1e-6
    if arm.family != "srs7":  # whose wrist angles are counted with the side of the elbow
        assert turn(both[0].q, both[1].q) < 1e-6  # type: ignore[arg-type]


@pytest.mark.parametrize("robot", [PIONEER, PUMA, ABB, SRS, IIWA], ids=lambda robot: robot.id)
def test_an_aligned_wrist_keeps_an_angle(robot: Robot) -> None:
    arm = of(robot)
    theta = arm.angles(example(arm))
    theta[5 if arm.family == "srs7" else 4] = 0.0
    q = arm.joints(theta)
    T, psi = kin.fk(robot, q), psi_of(arm, q)
    found = derive(arm, T, signs_of(arm, q), q, psi)
    finite(found)
    assert specials(found)["aligned"] == (5 if arm.family == "srs7" else 4)
    assert found.q is not None
    assert turn(found.q, q) < 1e-6
    step = found.step("wrist")
    assert step is not None
    assert words.special_text(arm, step).startswith("Singular:")
    asked = outline_of(exercise(arm, q), UNITS)
    assert asked.steps[arm.keys.index("wrist")].question is None, "nothing is asked about a free angle"


def test_a_wrist_centre_of_an_srs_arm_on_axis_1() -> None:
    arm = of(SRS)
    q = np.radians([20.0, -32.0, 0.0, 70.0, 20.0, 40.0, 10.0])
    theta = arm.angles(q)
    theta[1] = -math.atan2(0.31 * math.sin(theta[3]), 0.35 + 0.31 * math.cos(theta[3]))
    T = kin.fk(SRS, arm.joints(theta))
    for psi in (0.0, 1.0):
        for found in branches(arm, T, q, psi):
            finite(found)
            assert found.q is not None
            assert max(error_of(arm, found.q, T)) < 1e-9
            assert "on axis 1" in specials(found)
            assert turn(found.q, rows(arm, T, psi)[row_of(arm, found.signs)]) < 1e-6


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_a_target_beyond_reach_fails_at_the_triangle(robot: Robot) -> None:
    arm = of(robot)
    T = kin.fk(robot, example(arm))
    T[:3, 3] += 3.0 * robot.reach * arm.T_base_lesson[:3, 0]
    for found in branches(arm, T, robot.q_home):
        finite(found)
        assert found.q is None
        assert found.failed is not None
        assert (found.failed.key, found.failed.failure) == ("elbow", "too far")
        assert found.number("C") > 1.0
        text = words.failure_text(found.failed, UNITS)
        assert text.startswith("No solution: the cosine would be ")
        assert "the links are too short" in text


def test_other_failures() -> None:
    pioneer, puma, two = of(PIONEER), of(PUMA), of(TWO)
    T = kin.fk(PUMA, example(puma))
    near = T.copy()
    near[:2, 3] = T[:2, 2] * 0.05625 + np.array([0.1, 0.0])  # w at 100 mm from axis 1
    failed = derive(puma, near, (1, 1, 1), PUMA.q_home).failed
    assert failed is not None
    assert (failed.key, failed.failure) == ("theta1", "inside the cylinder")
    assert failed.excess == pytest.approx(0.05005)
    assert "50 mm too near to axis 1" in words.failure_text(failed, UNITS)
    close = kin.fk(TWO, TWO.q_home)
    close[:3, 3] = [0.1, 0.0, 0.0]
    failed = derive(two, close, (1,), TWO.q_home).failed
    assert failed is not None
    assert failed.failure == "too near"
    assert "300 mm too near" in words.failure_text(failed, UNITS)
    close[2, 3] = 0.2
    failed = derive(two, close, (1,), TWO.q_home).failed
    assert failed is not None
    assert "200 mm off it" in words.failure_text(failed, UNITS)
    back = exercise(pioneer, example(pioneer), (-1, 1, 1))
    assert back.followed.derivation.failed is not None
    steps = outline_of(back, UNITS).steps
    assert "No solution" in steps[2].text
    assert "does not get here" in steps[3].text


def test_limits_and_names_of_branches() -> None:
    arm = of(PIONEER)
    found = all_branches(arm, kin.fk(PIONEER, PIONEER.q_home), PIONEER.q_home, 0.0)
    assert [branch.available for branch in found] == [True] + [False] * 7
    assert {i for i, _ in found[1].outside} == {3, 4}
    result = kin.solve_ik(PIONEER, kin.fk(PIONEER, PIONEER.q_home), task="approach")
    assert len(result.solutions) == 1
    for robot in (PUMA, SRS, TWO, THREE):
        other = of(robot)
        for branch in exercise(other, example(other)).branches:
            assert branch.q is not None
            assert kin.branch_of(robot, branch.q) == branch.name


# Tree


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_every_branch_is_a_leaf_of_the_tree_or_ends_before(robot: Robot) -> None:
    arm = of(robot)
    given = exercise(arm, example(arm))
    nodes = tree(given.branches, given.signs)
    leaves = {node.leaf.number for node in nodes if node.leaf is not None}
    assert {branch.number for branch in given.branches if branch.q is not None} <= leaves
    assert sum(node.followed for node in nodes) == arm.splits
    everything = dict.fromkeys(arm.keys, True)
    inside = sum(branch.available for branch in given.branches)
    assert views.tree_html(arm, nodes, inside, everything, UNITS).count('data-state="inside"') == inside


def test_the_tree_keeps_what_is_asked() -> None:
    arm = of(PIONEER)
    given = exercise(arm, example(arm))
    html = views.tree_html(arm, tree(given.branches, given.signs), 1, {"theta1": True}, UNITS)
    assert "θ₁ = 90.0°" in html
    assert "θ₃" not in html
    assert "data-state" not in html.replace('data-state=""', "")


# Questions


def numbers(given: Exercise, units: Units = UNITS) -> dict[str, Number]:
    return {key: asked for key, asked in outline_of(given, units).questions() if isinstance(asked, Number)}


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_either_way_is_right_and_named(robot: Robot) -> None:
    arm = of(robot)
    given = exercise(arm, example(arm))
    derivations = {branch.derivation.signs: branch.derivation for branch in given.branches}
    split = 0
    for asked in (asked for asked in numbers(given).values() if asked.named):
        verdict = asked.judge(asked.answer)
        assert verdict.right
        assert "This is “" in verdict.reason
        for way in asked.ways:
            assert asked.judge(way.value + 0.3 * asked.tolerance).right
            assert "this is the way “" in asked.judge(way.value).reason
            assert asked.way_of(way.value) == 1
            assert any(
                abs(math.remainder(way.value - float(value), 2.0 * math.pi)) < 1e-9
                for found in derivations.values()
                for name, value in found.values.items()
                if name.startswith("θ")
            )
            split += 1
        for mistake in asked.mistakes:
            assert not asked.judge(mistake.value).right
    assert split == arm.splits or robot is PIONEER
    assert split


def reason(asked: Number, value: float) -> str:
    verdict = asked.judge(value)
    assert not verdict.right
    return verdict.reason


def test_usual_mistakes_get_their_reasons() -> None:
    arm = of(PIONEER)
    given = exercise(arm, example(arm))
    v, asked = given.followed.derivation.number, numbers(given)
    assert "tool point itself" in reason(asked["1"], v("p_z"))
    assert "The sign is wrong" in reason(asked["1"], 2 * v("p_z") - v("w_z"))
    assert "takes y first" in reason(asked["2"], math.atan2(v("w_x"), v("w_y")))
    inside = math.pi - math.radians(60.0)
    assert "inside the triangle" in reason(asked["3"], inside)
    far = math.hypot(v("ρ"), -v("w_z"))
    assert "d₁ is missing" in reason(asked["3"], math.acos((far**2 - 0.16**2 - 0.14**2) / (2 * 0.16 * 0.14)))
    assert "Subtract β" in reason(asked["4"], v("θ2") + v("β"))
    assert "The sign of β" in reason(asked["4"], v("θ2") + 2 * v("β"))
    assert "in radians" in reason(asked["4"], v("θ2") * math.pi / 180.0)
    other = given.beside(1).derivation
    assert "another branch, “elbow negative”" in reason(asked["5"], other.number("θ4"))
    in_radians = numbers(given, Units(degrees=False))
    assert in_radians["4"].unit == RADIANS
    assert "in degrees" in reason(in_radians["4"], 30.0)
    puma = of(PUMA)
    given = exercise(puma, example(puma))
    v, asked = given.followed.derivation.number, numbers(given)
    straight = math.atan2(v("w_y"), v("w_x"))
    assert "offset b is missing" in reason(asked["2"], straight)
    assert "sign of the offset b" in reason(asked["2"], straight + math.atan2(puma.lengths["b"], v("X")))


def test_every_answer_is_the_value_of_the_core() -> None:
    for robot, seed in itertools.product(ARMS, range(3)):
        arm = of(robot)
        q = robot.random_q(np.random.default_rng(seed), 1)[0]
        given = exercise(arm, q)
        theta = arm.angles(q)
        for asked in numbers(given).values():
            found = re.search("θ([₁-₇])", asked.prompt)
            if found is not None:
                joint = "₁₂₃₄₅₆₇".index(found.group(1))
                assert abs(math.remainder(asked.answer - theta[joint], 2.0 * math.pi)) < 1e-7, asked.prompt
        assert sum(branch.available for branch in given.branches) >= 1


# The page


def say(tab: FakeBrowser, kind: str, value: object, *rest: object) -> None:
    tab.say("feature", ["guide", [kind, *rest, next(SERIAL)], value])


SERIAL = itertools.count(1)


def press(tab: FakeBrowser, label: str) -> None:
    tab.send("GuiUpdateMessage", uuid=tab.element(label), updates={"value": True})


def followed(tab: FakeBrowser) -> str:
    return re.search(r'data-derivation="([^"]*)"', tab.html).group(1)  # type: ignore[union-attr]


@pytest.mark.full
def test_a_typed_way_is_followed_to_its_posture(port: int) -> None:
    arm = of(PUMA)
    given = exercise(arm, example(arm))
    asked = numbers(given)
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(PUMA.name)
        tab.set("Lesson", "Inverse kinematics step by step")
        tab.wait(lambda: "data-derivation" in tab.html)
        assert followed(tab) == given.followed.name
        assert 'data-open="1"' not in tab.html, "no numbers before the first answer"
        say(tab, "pose", None)
        say(tab, "fields", [[asked["1"].value_text]], "1")
        tab.wait(lambda: 'data-derived="centre" data-open="1"' in tab.html)
        say(tab, "go", 1)
        other = given.beside(0)
        say(tab, "fields", [[f"{math.degrees(asked['2'].ways[0].value):.1f}"]], "2")
        tab.wait(lambda: followed(tab) == other.name)
        part = other.name.split(" · ")[0]
        assert f"This is “{part}”, which you follow." in tab.html
        tab.set("All numbers", True)
        tab.wait(lambda: 'data-derived-result="limits"' in tab.html)
        q = next(b for b in given.branches if b.available)
        tab.send("GuiUpdateMessage", uuid=tab.element("Follow"), updates={"value": str(q.number)})
        tab.wait(lambda: followed(tab) == q.name)
        press(tab, "Show this posture")
        assert q.q is not None
        T = kin.fk(PUMA, q.q)
        tab.wait(lambda: np.allclose(tab.tool_pose()[:3, 3], T[:3, 3], atol=1e-3))
        assert any(name.startswith("/inverse-") for name in tab.nodes)
        press(tab, "Ask about this pose")
        tab.wait(lambda: "New questions" in tab.html or 'data-step="1"' in tab.html)
        tab.set("Lesson", "None")
        tab.settle()
        assert not any(name.startswith("/inverse-") for name in tab.nodes)


def test_a_branch_that_ends_says_how_to_go_on(port: int) -> None:
    arm = of(PIONEER)
    given = exercise(arm, example(arm))
    ended = exercise(arm, example(arm), flipped(given.signs, 0))
    assert ended.followed.q is None
    assert ended.way_back is not None
    assert ended.way_back.derivation.signs == given.signs, "the one whose limits it keeps"
    back = f"Go on with branch {ended.way_back.number}"
    assert [back == step.offer for step in outline_of(ended, UNITS).steps] == [
        False,
        False,
        True,
        True,
        True,
        False,
        False,
    ]
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(PIONEER.name)
        tab.set("Lesson", "Inverse kinematics step by step")
        tab.wait(lambda: "data-derivation" in tab.html)
        say(tab, "go", 1)
        say(tab, "fields", [["-90"]], "2")
        tab.wait(lambda: followed(tab) == ended.followed.name)
        assert back not in tab.html
        say(tab, "go", 2)
        tab.wait(lambda: f'data-guide-do="offer">{back}<' in tab.html)
        say(tab, "offer", None)
        tab.wait(lambda: followed(tab) == given.followed.name)
        tab.wait(lambda: 'data-question="3"' in tab.html)
        assert back not in tab.html


def test_another_arm_that_can_be_derived_is_explored(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lesson", "Inverse kinematics step by step")
        tab.wait(lambda: "data-derivation" in tab.html)
        tab.choose(ABB.name)
        tab.wait(lambda: 'data-guide="elsewhere"' in tab.html and "data-derived-result" in tab.html)
        assert 'data-open="0"' not in tab.html, "nothing is asked, so all its numbers are on show"


def test_an_arm_without_a_derivation_offers_others(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lesson", "Inverse kinematics step by step")
        tab.wait(lambda: "data-derivation" in tab.html)
        tab.choose(kin.get_robot("ur5").name)
        tab.wait(lambda: 'data-inverse="others"' in tab.html)
        press(tab, SRS.name)
        tab.wait(lambda: "data-derivation" in tab.html)
        assert "shoulder front" in followed(tab)
        slider = tab.element("ψ of the derivation")
        tab.send("GuiUpdateMessage", uuid=slider, updates={"value": 40.0})
        tab.set("All numbers", True)
        tab.wait(lambda: "data-derived-result" in tab.html)
        assert all_signs(of(SRS))[0] == (1, 1, 1)


@pytest.mark.full
@pytest.mark.parametrize("robot", [PUMA, SRS], ids=lambda robot: robot.id)
def test_a_wrong_angle_is_drawn_beside_the_arm(port: int, robot: Robot) -> None:
    arm = of(robot)
    given = exercise(arm, example(arm))
    step = arm.keys.index("elbow")
    asked = outline_of(given, UNITS).steps[step]
    assert asked.drawn is not None

    def copies(tab: FakeBrowser) -> dict[str, str]:
        names = [name for name in tab.nodes if name.startswith("/guide-") and tab.visible.get(name, True)]
        return {name.rpartition("/")[2]: name for name in names}

    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(robot.name)
        tab.set("Lesson", "Inverse kinematics step by step")
        tab.wait(lambda: "data-derivation" in tab.html)
        say(tab, "go", step)
        tab.wait(lambda: f"{step + 1}. {asked.title}" in tab.html)
        say(tab, "fields", [["17.0"]], str(step + 1))
        tab.wait(lambda: {"arm", "words"} <= copies(tab).keys())
        tool = kin.fk(robot, np.array(asked.drawn.at(math.radians(17.0))))[:3, 3]
        assert np.linalg.norm(tool - given.T[:3, 3]) > 0.05
        tab.wait(lambda: np.allclose(tab.poses[copies(tab)["words"]]["position"], tool, atol=1e-6))
        tab.wait(lambda: np.allclose(tab.tool_pose(), given.T, atol=1e-6))
        say(tab, "reveal", None, str(step + 1))
        tab.wait(lambda: "words" not in copies(tab))


def test_another_arm_keeps_what_was_asked_and_followed_on_the_first(port: int) -> None:
    arm = of(PIONEER)
    given = exercise(arm, example(arm))
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(PIONEER.name)
        tab.set("Lesson", "Inverse kinematics step by step")
        tab.wait(lambda: "data-derivation" in tab.html)
        tab.set(next(name for name in tab.sliders if name.startswith("1 ")), 50.0)
        press(tab, "Ask about this pose")
        asked = exercise(arm, np.concatenate([[math.radians(50.0)], given.q[1:]]))
        p = ", ".join(UNITS.lengths.number(x) for x in asked.T[:3, 3].tolist())
        tab.wait(lambda: f"The target: p = ({p})" in tab.html)
        say(tab, "go", 1)
        other = asked.beside(0)
        say(tab, "fields", [[f"{math.degrees(other.derivation.number('θ1')):.1f}"]], "2")
        tab.wait(lambda: followed(tab) == other.name)
        tab.choose(PUMA.name)
        tab.wait(lambda: followed(tab) == exercise(of(PUMA), example(of(PUMA))).followed.name)
        tab.wait(lambda: 'data-question="2"' in tab.html and "This is “" not in tab.html)
        tab.choose(PIONEER.name)
        tab.wait(lambda: followed(tab) == other.name and "This is “shoulder back”" in tab.html)
        say(tab, "go", 0)
        tab.wait(lambda: f"The target: p = ({p})" in tab.html)
