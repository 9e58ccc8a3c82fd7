"""Questions of lessons for arms that are typed: ranks below six, rounded angles, small distances."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import kin
from app.viewer.lessons import LESSONS
from app.viewer.lessons.dh import questions as dh
from app.viewer.lessons.equations import questions as equations
from app.viewer.lessons.guide.outline import Choice, Mistake, Number, Outline, apart, two_percent
from app.viewer.lessons.postures import questions as postures
from app.viewer.lessons.redundancy import questions as redundancy
from app.viewer.lessons.velocity import questions as velocity
from kin import Robot
from kin.axes import NEARLY
from kin.differential.task import free_motions, rank
from kin.units import Units

UNITS = Units()
TURN = math.pi / 2
# Six joints, three of them parallel: rank 5.
FIVE_OF_SIX = Robot.from_dh(
    [(0, 0.3, 0, TURN), (0, 0, 0.3, 0), (0, 0, 0.2, 0), (0, 0, 0.2, 0), (0, 0, 0.1, -TURN), (0, 0.1, 0, 0)],
    home=[0.1, 0.3, -0.4, 0.5, 0.2, 0.1],
)
PLANAR4 = Robot.from_dh([(0, 0, 0.3, 0)] * 4, home=[0.1, 0.3, 0.4, 0.5])
TYPED = (FIVE_OF_SIX, PLANAR4)
ARMS = [kin.get_robot(name) for name in kin.files.classic_robots()]


def rolled(roll: float) -> Robot:
    """A planar arm whose base is turned about x, as a typed angle turns it."""
    base = np.eye(4)
    base[1:3, 1:3] = [[math.cos(roll), -math.sin(roll)], [math.sin(roll), math.cos(roll)]]
    return Robot.from_dh([(0, 0, 0.3, 0), (0, 0, 0.2, 0)], home=[0.4, 0.6], base=base)


def question(outline: Outline, key: str) -> Choice | Number:
    return dict(outline.questions())[key]


def right(asked: Choice | Number) -> list[str]:
    assert isinstance(asked, Choice)
    return [option.text for option in asked.options if option.right]


def number(asked: Choice | Number | None) -> Number:
    assert isinstance(asked, Number)
    return asked


# Postures


@pytest.mark.parametrize("robot", [*ARMS, *TYPED], ids=lambda robot: f"{robot.id}{robot.n}")
def test_only_exact_solutions_are_counted(robot: Robot) -> None:
    T = kin.fk(robot, robot.q_home)
    turned = T.copy()
    turned[:3, :2] = T[:3, :2] @ [
        [math.cos(postures.ROLL), -math.sin(postures.ROLL)],
        [math.sin(postures.ROLL), math.cos(postures.ROLL)],
    ]
    results = [kin.solve_ik(robot, target, q_seed=robot.q_home) for target in (T, turned)]
    known = postures.solved(robot)
    exact = [len(result.solutions) if result.status == "solved" else 0 for result in results]
    assert [known.found, known.rolled] == exact
    assert right(question(postures.outline(robot, UNITS), "c3")) == ["Yes" if exact[1] else "No"]


def test_five_joints_cannot_roll() -> None:
    outline = postures.outline(kin.get_robot("pioneer5"), UNITS)
    roll = question(outline, "c3")
    assert isinstance(roll, Choice)
    assert right(roll) == ["No"]
    assert roll.options[0].reason == "The rank is 5 of six: this roll is not among the motions of the tool."


def test_a_missed_target_is_beyond_every_posture() -> None:
    for robot in ARMS:
        T = kin.fk(robot, robot.q_home)
        out = T[:3, 3] - robot.T_world_base[:3, 3]
        T[:3, 3] = robot.T_world_base[:3, 3] + postures.BEYOND * robot.reach * out / np.linalg.norm(out)
        result = kin.solve_ik(robot, T)
        assert result.status != "solved"


@pytest.mark.parametrize(("robot", "at_home", "free"), [(FIVE_OF_SIX, 5, 1), (PLANAR4, 3, 1)], ids=["six", "four"])
def test_the_rank_counts_and_not_the_number_of_joints(robot: Robot, at_home: int, free: int) -> None:
    assert rank(robot, kin.jacobian(robot, robot.q_home), NEARLY) == at_home
    assert free_motions(robot, "pose") == free
    outline = postures.outline(robot, UNITS)
    every, many = question(outline, "c1"), question(outline, "c2")
    assert right(every) == ["No"]
    assert isinstance(every, Choice)
    assert f"rank {at_home}" in every.options[0].reason
    assert right(many) == ["Infinitely many"]
    assert isinstance(many, Choice)
    assert f"{robot.n} joints, {at_home} move the tool" in many.options[0].reason
    assert "1 self-motion." in many.options[0].reason
    assert number(question(redundancy.outline(robot, UNITS), "1")).answer == free
    assert np.any(redundancy.null_vector(robot))


def test_a_rounded_table_has_the_rank_that_was_meant() -> None:
    typed = Robot.from_dh([(0, 0, 0.3, 3.1416)] * 4, home=PLANAR4.home)
    assert rank(typed, kin.jacobian(typed, typed.q_home), NEARLY) == 3
    assert free_motions(typed, "pose") == 1
    assert right(question(postures.outline(typed, UNITS), "c2")) == ["Infinitely many"]


def test_an_arm_of_two_joints_has_no_second_posture_for_a_pose() -> None:
    many = question(postures.outline(kin.get_robot("planar2r"), UNITS), "c2")
    assert isinstance(many, Choice)
    assert [option.text for option in many.options] == ["Infinitely many", "Finitely many, one per posture"]
    assert right(many) == ["Finitely many, one per posture"]


# Rounded angles


@pytest.mark.parametrize("roll", [0.0, math.pi, 3.1416, 3.142])
def test_a_vertical_axis_stays_vertical_when_it_is_typed(roll: float) -> None:
    robot = rolled(roll)
    outline = velocity.outline(robot, UNITS)
    assert right(question(outline, "c1")) == ["No"]
    assert right(question(equations.outline(robot, UNITS), "c2")) == ["No"]
    torque = number(question(outline, "3"))
    assert (torque.answer, torque.mistakes) == (0.0, ())
    assert "no joint carries" in torque.method
    assert torque.judge(0.0).right
    assert not torque.judge(0.1).right


def test_a_tilted_axis_is_not_vertical() -> None:
    robot = rolled(0.05)
    assert right(question(velocity.outline(robot, UNITS), "c1")) == ["Yes"]
    assert right(question(equations.outline(robot, UNITS), "c2")) == ["Yes"]
    assert number(question(velocity.outline(robot, UNITS), "3")).mistakes


def test_a_misprint_needs_an_entry_that_is_not_rounding() -> None:
    for roll, shown in ((math.pi, "No"), (3.1416, "No"), (0.5, "Yes")):
        base = np.eye(4)
        base[0:2, 0:2] = [[math.cos(roll), -math.sin(roll)], [math.sin(roll), math.cos(roll)]]
        robot = Robot.from_dh([(0, 0, 0.3, 0)], home=[0.0], base=base)
        # Column n of a frame that is turned about z alone has products with o.
        assert right(question(equations.outline(robot, UNITS), "4")) == [shown]


# Tolerances


def test_a_tolerance_keeps_off_mistakes_and_zero() -> None:
    plain = Number("?", 0.5805, UNITS.lengths, two_percent(0.5805), "Measure.")
    assert apart(plain).tolerance == plain.tolerance == 0.011
    near = apart(replace(plain, mistakes=(Mistake(0.5995, "Not square."), Mistake(0.58051, "The same."))))
    assert [mistake.value for mistake in near.mistakes] == [0.5995]
    assert near.judge(0.5995).reason == "Not square."
    assert near.judge(0.583).right
    assert not apart(replace(plain, answer=0.0121)).judge(0.0).right
    assert apart(replace(plain, answer=1e-9)).judge(0.0).right
    turn = Number("?", 3.1, UNITS.angles, 0.1, "Add.", (Mistake(-3.1, "The other side."),), whole_turns=True)
    assert apart(turn).tolerance < 0.5 * (2 * math.pi - 6.2)


def arms_at_other_homes() -> list[Robot]:
    rng = np.random.default_rng(3)
    return [replace(r, home=tuple(q.tolist())) for r in ARMS for q in r.random_q(rng, 6)]


def indistinct(outline: Outline) -> list[tuple[str, float, float]]:
    """Questions with the known mistake, or zero, that they take for the right answer."""
    found = []
    for asked in (asked for _, asked in outline.questions() if isinstance(asked, Number)):
        seen = 0.02 if asked.unit.name in ("N", "N·m") else 0.0015
        shown = asked.value_text
        assert asked.judge(asked.read_text(shown)).right, f"the shown answer is accepted: {shown}"
        for wrong in (0.0, *(mistake.value for mistake in asked.mistakes)):
            if asked.way_of(wrong) > 0:  # zero is one of the right values
                continue
            gap = wrong - asked.answer
            gap = math.remainder(gap, 2 * math.pi) if asked.whole_turns else gap
            if abs(gap) > seen and asked.judge(wrong).right:
                found.append((asked.prompt, asked.answer, wrong))
    return found


@pytest.mark.full
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_no_mistake_and_no_zero_is_right(lesson: type) -> None:
    for robot in (*ARMS, *TYPED, rolled(3.1416)):
        assert not indistinct(lesson.outline(robot, UNITS)), robot.id  # type: ignore[attr-defined]


@pytest.mark.full
def test_no_mistake_and_no_zero_is_right_at_other_homes() -> None:
    for robot, module in itertools.product(arms_at_other_homes(), (dh, equations, velocity)):
        assert not indistinct(module.outline(robot, UNITS)), (robot.id, robot.home)
