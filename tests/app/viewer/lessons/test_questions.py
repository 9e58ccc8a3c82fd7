"""Questions of lessons: what counts as right, and that no known mistake does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lesson_arms import ASKED, IDS, arms_of

import kin
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Mistake, Number, Outline, apart, two_percent
from app.viewer.lessons.postures import questions as postures
from kin import Robot
from kin.units import Units

UNITS = Units()


@pytest.mark.parametrize("robot", arms_of("postures"), ids=lambda robot: robot.id)
def test_only_exact_solutions_are_counted(robot: Robot) -> None:
    T = kin.fk(robot, robot.q_home)
    turned = T.copy()
    turned[:3, :2] = T[:3, :2] @ [
        [math.cos(postures.ROLL), -math.sin(postures.ROLL)],
        [math.sin(postures.ROLL), math.cos(postures.ROLL)],
    ]
    results = [kin.solve_ik(robot, target, q_seed=robot.q_home) for target in (T, turned)]
    known = postures.solved(robot)
    assert [known.found, known.rolled] == [len(result.solutions) for result in results]
    assert all(result.status == "solved" for result in results)
    assert np.linalg.matrix_rank(kin.jacobian(robot, robot.q_home), tol=1e-6) == 6


@pytest.mark.parametrize("robot", arms_of("postures"), ids=lambda robot: robot.id)
def test_a_missed_target_is_beyond_every_posture(robot: Robot) -> None:
    T = kin.fk(robot, robot.q_home)
    out = T[:3, 3] - robot.T_world_base[:3, 3]
    T[:3, 3] = robot.T_world_base[:3, 3] + postures.BEYOND * robot.reach * out / np.linalg.norm(out)
    assert kin.solve_ik(robot, T).status != "solved"


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


@pytest.mark.parametrize(("lesson", "robot"), ASKED, ids=IDS)
def test_no_mistake_and_no_zero_is_right(lesson: type[Lesson], robot: Robot) -> None:
    assert not indistinct(lesson.outline(robot, UNITS))
