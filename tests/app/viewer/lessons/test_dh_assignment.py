"""A table that a student makes: every right choice is accepted, and each wrong entry is named."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.exercises.kinds.dh import DHKind
from app.exercises.rows import FACTORS, Factor, Line, Row, turns
from app.exercises.variant import Variant
from app.viewer.lessons.dh import choices
from app.viewer.lessons.dh.assignment import ACCEPTED, Assignment, family, free_factors, judge, read_row
from app.viewer.lessons.dh.normals import axis_lines, common_normal
from app.viewer.lessons.dh.steps import OTHER
from kin.axes import pairs, size
from kin.dh.tables import convert_dh
from kin.transforms import Array
from kin.units import Units

BUILT_IN = [*kin.files.classic_robots().values()]
ARMS = [arm for robot in BUILT_IN for arm in (robot, convert_dh(robot, OTHER[robot.convention]))]
NAMES = [f"{arm.id}-{arm.convention}" for arm in ARMS]
WRONG = {"theta": math.radians(17.0), "d": 0.013, "a": 0.017, "alpha": math.radians(23.0)}

arms = pytest.mark.parametrize("robot", ARMS, ids=NAMES)


def some(robot: kin.Robot) -> Array:
    return robot.random_q(np.random.default_rng(5), 4)


def published_row(robot: kin.Robot, joint: int) -> Row:
    row = robot.rows[robot.joint_rows[joint]]
    return Row(row.theta, row.d, row.a, row.alpha)


def default_frame(work: Assignment, made: dict[choices.Part, int] | None = None) -> Array:
    return choices.frame(work, made or {})


def starts(robot: kin.Robot) -> Assignment:
    """The first frame of the arm's own table."""
    base = choices.published(Assignment(robot))
    assert base is not None
    return Assignment(robot).with_base(base)


def is_last(work: Assignment) -> bool:
    number = len(work.frames)
    return work.carrier(number) is None or work.partner(number) is None


@arms
def test_the_published_table_is_accepted(robot: kin.Robot) -> None:
    work = starts(robot)
    for joint in range(robot.n):
        typed, there = published_row(robot, joint), choices.published(work)
        assert there is not None
        # Whatever was chosen by the rules before: numbers of an equivalent frame are right.
        chosen = default_frame(work)
        verdict = judge(work, chosen, typed, [there])
        assert verdict.wrong == ()
        assert not verdict.row.differing(typed, ACCEPTED)
        work = work.with_row(verdict.row)
        assert work.frames[-1] == pytest.approx(there, abs=1e-9)
    assert work.complete
    assert work.error(some(robot)) < 1e-9


@arms
def test_choices_by_the_rules_give_a_table_of_the_arm(robot: kin.Robot) -> None:
    # All right choices at their first, and at their last, and at a mixture of both.
    for way in (0, -1, None):
        work = Assignment(robot)
        while not work.complete:
            chosen = default_frame(work, some_choices(work, way))
            if not work.frames:
                work = work.with_base(chosen)
                continue
            row = read_row(work.convention, work.frames[-1], chosen)
            verdict = judge(work, chosen, row)
            assert (verdict.wrong, verdict.as_chosen) == ((), True)
            work = work.with_row(verdict.row)
            assert work.frames[-1] == pytest.approx(chosen, abs=1e-9), "one row leads there"
        assert work.error(some(robot)) < 1e-9


def some_choices(work: Assignment, way: int | None) -> dict[choices.Part, int]:
    made: dict[choices.Part, int] = {}
    for k, part in enumerate(choices.PARTS):
        found = choices.choices(work, made)[part]
        right = [i for i, choice in enumerate(found) if choice.right]
        if right:
            made[part] = right[way if way is not None else (k + len(work.frames)) % len(right)]
    return made


@arms
def test_equivalent_tables_are_accepted(robot: kin.Robot) -> None:
    """The opposite x in every row, and other values of what is free, one row after another."""
    work = starts(robot)
    for joint in range(robot.n):
        there = choices.published(work)
        chosen = there if is_last(work) and there is not None else default_frame(work)
        row = read_row(work.convention, work.frames[-1], chosen)
        free = {factor: getattr(row, factor) + WRONG[factor] for factor in free_factors(work, chosen)}
        typed, other = family(work, chosen, replace(row, **free))
        for each in (typed, other):
            verdict = judge(work, chosen, each)
            assert verdict.wrong == ()
        assert judge(work, chosen, typed).as_chosen == (not free)
        work = work.with_row(judge(work, chosen, other).row)
        assert len(work.rows) == joint + 1
    assert work.error(some(robot)) < 1e-9


@arms
def test_each_wrong_entry_is_named(robot: kin.Robot) -> None:
    work = starts(robot)
    for _ in range(robot.n):
        there = choices.published(work)
        chosen = there if is_last(work) and there is not None else default_frame(work)
        row = read_row(work.convention, work.frames[-1], chosen)
        free = free_factors(work, chosen)
        for factor, sign in itertools.product(FACTORS, (1.0, -1.0)):
            typed = replace(row, **{factor: getattr(row, factor) + sign * WRONG[factor]})
            verdict = judge(work, chosen, typed)
            assert factor not in verdict.wrong if factor in free else verdict.wrong == (factor,)
        # A wrong sign is the usual mistake, and is named as well.
        for factor in FACTORS:
            value = getattr(row, factor)
            flipped = replace(row, **{factor: -value})
            reversed_x = robot.convention == "modified" and factor == "theta"  # −90° for 90° is the opposite x
            if factor not in free and row.differing(flipped, ACCEPTED) and not reversed_x:
                assert judge(work, chosen, flipped).wrong == (factor,)
        work = work.with_row(row)


@arms
def test_what_is_accepted_moves_as_the_arm_and_what_is_not_does_not(robot: kin.Robot) -> None:
    """By forward kinematics of the whole table, which the judge does not use."""
    work = starts(robot)
    q = some(robot)
    for joint in range(robot.n - 1):
        chosen = default_frame(work)
        row = read_row(work.convention, work.frames[-1], chosen)
        for factor in FACTORS:
            typed = replace(row, **{factor: getattr(row, factor) + WRONG[factor]})
            accepted = not judge(work, chosen, typed).wrong
            assert accepted == can_go_on(work.with_row(typed), joint, q)
        work = work.with_row(row)


def can_go_on(work: Assignment, joint: int, q: Array) -> bool:
    """Whether z of the last frame is the axis that it has to be, or x meets the next one as it must."""
    robot, T = work.robot, work.frames[-1]
    standard = robot.convention == "standard"
    carrier, other = (joint + 1, joint) if standard else (joint, joint + 1)
    axis = axis_lines(robot, np.zeros(robot.n))[carrier]
    if np.abs(np.cross(axis.z, T[:3, 2])).max() > 1e-6 or axis.z @ T[:3, 2] < 0.0:
        return False
    if not work.slides(carrier) and np.linalg.norm(axis.nearest(T[:3, 3]) - T[:3, 3]) > 1e-6:
        return False
    if standard:
        return True
    following = axis_lines(robot, np.zeros(robot.n))[other]
    if abs(T[:3, 0] @ following.z) > 1e-6:
        return False
    # Perpendicular, so x meets the axis if the way to its nearest point is along x.
    way = following.nearest(T[:3, 3]) - T[:3, 3]
    return work.slides(other) or bool(np.linalg.norm(way - (way @ T[:3, 0]) * T[:3, 0]) < 1e-6)


@arms
def test_an_opposite_z_is_right_and_reverses_its_joint(robot: kin.Robot) -> None:
    work = Assignment(robot)
    for number in range(robot.n + 1):
        found = choices.choices(work, {})
        made: dict[choices.Part, int] = {}
        if work.carrier(number) is not None:
            made["axis"] = work.carrier(number) or 0
            made["direction"] = 1
            assert found["direction"][1].right
        chosen = default_frame(work, made)
        work = (
            work.with_row(read_row(work.convention, work.frames[-1], chosen)) if number else work.with_base(chosen)
        )
    assert [work.sense(joint) for joint in range(robot.n)] == [-1.0] * robot.n
    assert work.error(some(robot)) < 1e-9


@arms
def test_wrong_choices_have_reasons_and_right_ones_exist(robot: kin.Robot) -> None:
    work = Assignment(robot)
    for number in range(robot.n + 1):
        found = choices.choices(work, {})
        for part in choices.PARTS:
            assert all(choice.reason and choice.text for choice in found[part])
            assert len({choice.text for choice in found[part]}) == len(found[part])
            assert not found[part] or any(choice.right for choice in found[part])
        right = [i for i, choice in enumerate(found["axis"]) if choice.right]
        assert right == [work.carrier(number) or 0]
        assert choices.relation_words(work, number)
        chosen = default_frame(work)
        assert chosen[:3, :3] @ chosen[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
        work = (
            work.with_row(read_row(work.convention, work.frames[-1], chosen)) if number else work.with_base(chosen)
        )


def test_special_cases_are_named_where_they_occur() -> None:
    def words(robot: kin.Robot, number: int) -> str:
        work = starts(robot)
        while len(work.frames) < number:
            work = work.with_row(read_row(work.convention, work.frames[-1], default_frame(work)))
        return choices.relation_words(work, number)

    pioneer, printed, ur5 = (kin.get_robot(name) for name in ("pioneer5", "redundant7", "ur5"))
    assert "skew" in words(pioneer, 1)
    assert "z₁ and z₂ are parallel" in words(ur5, 2)
    assert "z₀ and z₁ intersect" in words(ur5, 1)
    assert "z₀ and z₁ are one line" in words(printed, 1)
    assert "z₁ and z₂ are one line" in words(convert_dh(printed, "modified"), 1)
    assert "prismatic" in words(kin.get_robot("stanford"), 2)


@pytest.mark.parametrize("robot", BUILT_IN, ids=lambda r: r.id)
def test_normals_agree_with_the_relations_of_the_axes(robot: kin.Robot) -> None:
    lines = axis_lines(robot, robot.q_home)
    for pair, (one, two) in zip(pairs(robot), itertools.pairwise(lines), strict=True):
        normal = common_normal(one, two, 1e-6 * size(robot))
        if math.isnan(pair.distance):
            continue
        assert np.linalg.norm(normal.end - normal.start) == pytest.approx(pair.distance, abs=1e-9)
        expected = (
            ("one" if pair.intersect else "parallel") if pair.parallel else "meet" if pair.intersect else "skew"
        )
        assert normal.relation == expected


UNIT = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


@given(p=UNIT, q=UNIT, u=UNIT, v=UNIT)
def test_a_common_normal_is_perpendicular_to_both_lines(
    p: tuple[float, ...], q: tuple[float, ...], u: tuple[float, ...], v: tuple[float, ...]
) -> None:
    one, two = (Line(np.array(a), np.array(b) / math.hypot(*b)) for a, b in ((p, u), (q, v)))
    near = 1e-6
    normal = common_normal(one, two, near)
    # Lines that meet have one foot, on the first line, as near to the second as lines that meet are.
    assert normal.end == pytest.approx(
        two.nearest(normal.end), abs=near if normal.relation in ("meet", "one") else 1e-9
    )
    assert normal.start == pytest.approx(one.nearest(normal.start), abs=1e-9)
    if normal.relation in ("skew", "meet"):
        assert normal.x @ one.z == pytest.approx(0.0, abs=1e-5)
        assert normal.x @ two.z == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("factor", FACTORS)
def test_whole_turns_do_not_matter_and_lengths_do(factor: Factor) -> None:
    row = Row(0.1, 0.2, 0.3, 0.4)
    moved = replace(row, **{factor: getattr(row, factor) + math.tau})
    assert row.differing(moved, ACCEPTED) == (() if turns(factor) else (factor,))


@arms
def test_the_lesson_and_an_exercise_judge_rows_alike(robot: kin.Robot) -> None:
    """Rows that the lesson accepts are right in an exercise, and those that it refuses are wrong there."""
    count = robot.n - 1  # rows that end at a joint's axis
    kind = DHKind(tuple(range(1, count + 1)), robot.convention)
    variant = Variant("x", robot, np.zeros(robot.n))
    # In Craig's convention a wrong θ or d is seen at the axis after.
    judged = range(count if robot.convention == "standard" else count - 1)
    for joint, factor in itertools.product(judged, FACTORS):
        work = starts(robot)
        accepted = True
        while len(work.rows) < count:
            chosen = default_frame(work)
            row = judge(work, chosen, read_row(work.convention, work.frames[-1], chosen)).row
            if len(work.rows) == joint:
                row = replace(row, **{factor: getattr(row, factor) + WRONG[factor]})
                accepted = not judge(work, chosen, row).wrong
            work = work.with_row(row)
        units = Units()
        typed = [[units.of(turns(f)).scale * getattr(row, f) for f in FACTORS] for row in work.rows]
        assert kind.judge(variant, [list(map(repr, map(float, row))) for row in typed], units).right == accepted
