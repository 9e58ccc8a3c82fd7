"""Completeness on random tables: what is reachable is never said to be unreachable, and what claims to be complete
contains the configuration that the target was made from; and postures do not depend on how an arm is written down.

The slow tests take 100 tables of each number of joints; the others a few of them.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import Draw, random_table, reversed_at, with_slides
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from app.bench.robots import robots
from kin import Robot, Status, solve_ik

PI = math.pi
COUNTS = range(1, 8)
NAMED = ("pioneer5", "puma560", "ur5", "irb120", "stanford", "scara", "panda")
SAME = 1e-6  # radians or metres
WELL = 1e-3  # smallest singular value of a configuration that is counted: near a singularity postures merge


def turns_between(a, b):
    """Largest joint difference, whole turns aside."""
    return np.abs((a - b + PI) % (2 * PI) - PI).max(axis=-1)


def given_value(robot: Robot, T, q) -> float | None:
    """The value in q of the joint that is the arm's redundancy parameter; None if there is none."""
    found = solve_ik(robot, T, q_seed=q).redundancy
    joint = [i for i in range(robot.n) if found and found[0].name == f"theta{i + 1}"]
    return float(q[joint[0]]) if joint else None


def apart(robot: Robot, a, b):
    """Largest joint difference, whole turns of revolute joints aside."""
    turned = np.abs((a - b + PI) % (2 * PI) - PI)
    return np.where(robot.revolute, turned, np.abs(a - b)).max(axis=-1)


def faults(robot: Robot, targets: int, task: str = "pose") -> tuple[int, list[str]]:
    """How many answers claimed to be complete, and what was wrong."""
    rng = np.random.default_rng(1)
    complete, wrong = 0, []
    for q in robot.random_q(rng, targets):
        T = kin.fk(robot, q)
        value = given_value(robot, T, q) if robot.n == 7 and task == "pose" else None
        result = solve_ik(robot, T, task=task, redundancy=value)
        if result.status is not Status.SOLVED:
            wrong.append(f"{robot.id}: {result.status.value} at {q.tolist()}")
        elif result.complete and not result.details.infinite:
            complete += 1
            if min(apart(robot, s.q, q) for s in result.solutions) > SAME:
                wrong.append(f"{robot.id}: {q.tolist()} is missing")
    return complete, wrong


@pytest.mark.parametrize("joints", COUNTS)
def test_what_is_reachable_is_found(joints):
    found = [faults(random_table(joints, seed), 2) for seed in range(4)]
    assert [fault for _, wrong in found for fault in wrong] == []
    assert sum(count for count, _ in found) >= 2


@pytest.mark.slow
@pytest.mark.parametrize("joints", COUNTS)
def test_what_is_reachable_is_found_on_a_hundred_tables(joints):
    found = [faults(random_table(joints, seed), 20) for seed in range(100)]
    wrong = [fault for _, each in found for fault in each]
    print(f"{joints} joints: {sum(count for count, _ in found)} of 2000 complete, {len(wrong)} wrong")
    assert wrong == []


@pytest.mark.parametrize("joints", COUNTS)
def test_what_is_reachable_is_found_with_slides(joints):
    for seed in range(2):
        robot = with_slides(random_table(joints, seed), seed)
        for task in ("pose", "approach", "position"):
            assert faults(robot, 1, task)[1] == []


@pytest.mark.slow
@pytest.mark.parametrize("joints", COUNTS)
def test_what_is_reachable_is_found_with_slides_on_a_hundred_tables(joints):
    tables = [with_slides(random_table(joints, seed), seed) for seed in range(100)]
    for task in ("pose", "approach", "position"):
        found = [faults(robot, 20, task) for robot in tables]
        wrong = [fault for _, each in found for fault in each]
        print(f"{joints} joints, {task}: {sum(count for count, _ in found)} of 2000 complete, {len(wrong)} wrong")
        assert wrong == []


PEERS = json.loads((Path(__file__).parents[2] / "data/golden-peers.json").read_text(encoding="utf-8"))["arms"]


@pytest.mark.parametrize("name", PEERS)
def test_every_posture_that_other_libraries_find_is_found(name):
    """The recorded union of their postures, also where several share an angle."""
    robot = robots()[name] if name in robots() else kin.get_robot(name)
    robot = replace(robot, rows=tuple(replace(row, limits=row.limits and (-PI, PI)) for row in robot.rows))
    known = PEERS[name]
    free = 1 if known["approach"] else 0
    for case in known["cases"]:
        q = np.array(case["q"])
        options = {"task": "approach" if free else "pose"}
        if name == "iiwa14":
            options["locked"] = [known["value"] if i == known["locked"] else None for i in range(robot.n)]
        elif known["locked"] is not None:
            options["redundancy"] = known["value"]
        found = np.array([s.q for s in solve_ik(robot, kin.fk(robot, q), **options).solutions])
        for posture in np.array(case["postures"]):
            assert turns_between(found[:, : robot.n - free], posture[: robot.n - free]).min() < 1e-5


@pytest.mark.parametrize("name", ["redundant7", "redundant7-craig", "iiwa14", "panda", "pioneer5"])
def test_a_single_feasible_value_is_found(name):
    """Two limits exactly met block the self-motion in both directions."""
    whole = kin.get_robot(name)
    task, rows = ("position", 3) if name == "pioneer5" else ("pose", 6)
    rng = np.random.default_rng(3)
    for q in whole.random_q(rng, 6):
        motion = np.linalg.svd(kin.jacobian(whole, q)[:rows])[2][-1]
        one, other = rng.permutation(np.flatnonzero(np.abs(motion) > 0.05))[:2].tolist()
        limits = np.column_stack([whole.lower, whole.upper])
        limits[one, int(motion[one] > 0.0)] = q[one]
        limits[other, int(motion[other] < 0.0)] = q[other]
        result = solve_ik(whole, kin.fk(whole, q), task=task, q_seed=q, limits=[tuple(pair) for pair in limits])
        assert result.status is Status.SOLVED
        assert turns_between(result.best.q, q) < 1e-5


# -- what postures do not depend on ------------------------------------------------------------------------------


def postures(robot: Robot, T, seed, value=None, **options):
    """The configurations ``(k, n)`` away from singularities, and all; limits are ignored."""
    result = solve_ik(robot, T, q_seed=seed, respect_limits=False, redundancy=value, **options)
    assert result.status is Status.SOLVED, (robot, seed.tolist(), result)
    q = result.q
    least = np.linalg.svd(kin.jacobian(robot, q), compute_uv=False)[:, min(robot.n, 6) - 1]
    return q[least > WELL], q


def assert_same(one, other, back=lambda q: q, near=SAME):
    """The postures away from singularities of each are among all of the other."""
    for these, those in ((one[0], back(other[1])), (back(other[0]), one[1])):
        for q in these:
            assert turns_between(those, q).min() < near, (q.tolist(), those.tolist())


def case(seed: int):
    """An arm, a configuration, its pose, and the value of the redundancy parameter."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.5:
        robot = kin.get_robot(str(rng.choice(NAMED)))
    else:
        robot = random_table(int(rng.integers(3, 7)), int(rng.integers(1000)))
    robot = replace(robot, rows=tuple(robot.rows), home=tuple(robot.q_home.tolist()))
    q = robot.random_q(rng)
    T = kin.fk(robot, q)
    infinite = solve_ik(robot, T, q_seed=q).details.infinite
    return robot, q, T, given_value(robot, T, q) if infinite else None, Draw(seed)


def scaled(robot: Robot, size: float) -> Robot:
    """The same arm in another unit of length."""

    def moved(T):
        T = np.array(T)
        T[:3, 3] *= size
        return T

    rows = []
    for row in robot.rows:
        row = replace(row, d=size * row.d, a=size * row.a)
        rows.append(replace(row, limits=tuple(size * v for v in row.limits)) if row.kind == "prismatic" else row)
    home = [v if turning else size * v for v, turning in zip(robot.home, robot.revolute, strict=True)]
    return replace(robot, rows=tuple(rows), home=tuple(home), base=moved(robot.base), tool=moved(robot.tool))


seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=6, deadline=None)


@few
@given(seeds)
def test_postures_do_not_depend_on_the_convention(seed):
    robot, q, T, value, _ = case(seed)
    other = kin.dh.convert_dh(robot, "modified" if robot.convention == "standard" else "standard")
    assert_same(postures(robot, T, q, value), postures(other, T, q, value))


@few
@given(seeds)
def test_postures_do_not_depend_on_base_and_tool(seed):
    robot, q, T, value, draw = case(seed)
    base, tool = np.array(draw.pose()), np.array(draw.pose())
    moved = robot.with_base(base @ robot.T_world_base).with_tool(robot.T_last_tool @ tool)
    assert_same(postures(robot, T, q, value), postures(moved, base @ T @ tool, q, value))


@few
@given(seeds)
def test_postures_do_not_depend_on_the_directions_of_joints(seed):
    robot, q, T, value, draw = case(seed)
    chosen = [i for i in range(robot.n) if draw.rng.random() < 0.5]
    signs = np.array([-1.0 if i in chosen else 1.0 for i in range(robot.n)])
    turned = value
    if value is not None:
        turned = value * float(signs[int(np.argmin(np.abs(q - value)))])
    other = postures(reversed_at(robot, chosen), T, signs * q, turned)
    assert_same(postures(robot, T, q, value), other, lambda q: signs * q)


@few
@given(seeds)
def test_postures_do_not_depend_on_the_unit_of_length(seed):
    robot, q, T, value, draw = case(seed)
    size = float(10.0 ** draw.rng.uniform(-1.0, 1.0))
    units = np.where(robot.revolute, 1.0, size)
    larger = T.copy()
    larger[:3, 3] *= size
    other = postures(scaled(robot, size), larger, units * q, value)
    assert_same(postures(robot, T, q, value), other, lambda q: q / units)


@few
@given(seeds)
def test_postures_do_not_depend_on_the_rounding_of_the_table(seed):
    robot, q, T, value, draw = case(seed)
    digits = int(draw.rng.integers(6, 10))
    rows = tuple(
        replace(row, theta=round(row.theta, digits), alpha=round(row.alpha, digits)) for row in robot.rows
    )
    rounded = replace(robot, rows=rows)
    # With fewer than six joints only one posture of a rounded table meets a pose exactly, the others almost.
    error = 100.0 * 10.0**-digits
    loose = {} if robot.n >= 6 else {"position_tolerance": error, "rotation_tolerance": error}
    there = postures(rounded, kin.fk(rounded, q), q, value, **loose)
    assert_same(postures(robot, T, q, value), there, near=10.0 * error / WELL)
