"""Arms with one or two slides, anywhere: every posture, by elimination, virtual joints and `slides2`."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest
from sliding import RIGHT, apart, arm, check_postures, random_arm

import kin
from kin.ik import IKOptions
from kin.ik.table import Table
from kin.solvers import closed_form_of
from kin.solvers.general6.orders import readings

ORDERS = ["".join(o) for o in itertools.product("PR", repeat=6) if o.count("P") in (1, 2)]
FEWER = ["".join(o) for n in (3, 4, 5) for o in itertools.product("PR", repeat=n) if 1 <= o.count("P") <= 3]
WRIST = [(0, 0.1, 0, -RIGHT), (0, 0, 0, RIGHT), (0, 0.1, 0, 0)]
LIFT, REACH = (0, 0.3, 0, 0), (0, 0.2, 0, 0)
CROSSED = [(0, 0.1, 0, 0.7), (0, 0.1, 0.2, -0.7)]  # with joint 2 at 0, joint 3 is parallel to joint 1
# Arms of textbooks: kinds, table, task, family.
TEXTBOOK = {
    "cylinder": ("RPP", [LIFT, (0, 0, 0, -RIGHT), REACH], "position", "slides2"),
    "cylinder, lift first": ("PRP", [LIFT, (0, 0.1, 0, -RIGHT), REACH], "position", "slides2"),
    "cylinder with a wrist": ("RPPRRR", [LIFT, (0, 0, 0, -RIGHT), REACH, *WRIST], "pose", "general6"),
    "polar": ("RRP", [(0, 0.3, 0, -RIGHT), (0, 0.1, 0, RIGHT), REACH], "position", "general5"),
    "gantry": ("PPP", [(0, 0, 0, -RIGHT), (RIGHT, 0, 0, RIGHT), (0, 0, 0, 0)], "position", "general5"),
    "SCARA, slide first": ("PRRR", [LIFT, (0, 0, 0.4, 0), (0, 0, 0.3, 0), (0, 0, 0, 0)], "pose", "scara4"),
    "SCARA with a wrist": ("PRRRRR", [LIFT, (0, 0, 0.4, 0), (0, 0, 0.3, 0), *WRIST], "pose", "general6"),
    "slide between parallel axes": (
        "RPRRRR",
        [LIFT, (0, 0, 0.3, 0), (0, 0, 0.25, 0), *WRIST],
        "pose",
        "general6",
    ),
    "Stanford with an offset wrist": (
        "RRPRRR",
        [(0, 0.4, 0, -RIGHT), (0, 0.15, 0, RIGHT), (0, 0, 0, 0), (0, 0, 0.05, -RIGHT), *WRIST[1:]],
        "pose",
        "general6",
    ),
    "planar RPR": ("RPR", [(RIGHT, 0, 0, RIGHT), (0, 0.3, 0, -RIGHT), (0, 0, 0.2, 0)], "pose", "general5"),
    "planar PRR": ("PRR", [(0, 0.1, 0, RIGHT), (0, 0, 0.3, 0), (0, 0, 0.2, 0)], "pose", "general5"),
    "planar PPR": ("PPR", [(RIGHT, 0, 0, RIGHT), (RIGHT, 0, 0, RIGHT), (0, 0, 0.2, 0)], "pose", "general5"),
    "planar RPP": ("RPP", [(RIGHT, 0, 0, RIGHT), (RIGHT, 0.2, 0, RIGHT), (0, 0.1, 0, 0)], "pose", "general5"),
}


@pytest.mark.parametrize("kinds", ORDERS)
def test_one_or_two_slides_anywhere(kinds):
    rng = np.random.default_rng(ORDERS.index(kinds))
    for right in (False, True):
        robot = random_arm(kinds, rng, right)
        assert closed_form_of(robot).name == "general6"
        assert check_postures(robot, rng, 3, 3)["unknown"] <= 1


@pytest.mark.parametrize("kinds", FEWER)
def test_fewer_joints_of_which_some_slide(kinds):
    rng = np.random.default_rng(FEWER.index(kinds))
    tasks = {3: ("pose", "position"), 4: ("pose",), 5: ("pose", "approach")}[len(kinds)]
    robot = random_arm(kinds, rng)
    assert closed_form_of(robot).name == ("slides2" if sorted(kinds) == ["P", "P", "R"] else "general5")
    for task in tasks:
        assert check_postures(robot, rng, 3, 3, task)["unknown"] <= 1


@pytest.mark.parametrize("name", TEXTBOOK)
def test_arms_of_textbooks(name):
    kinds, rows, task, family = TEXTBOOK[name]
    robot = arm(kinds, rows)
    assert closed_form_of(robot).name == family
    assert check_postures(robot, np.random.default_rng(1), 6, 4, task)["unknown"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("right", [False, True], ids=["any", "right angles"])
@pytest.mark.parametrize("kinds", ORDERS)
def test_many_arms_with_slides(kinds, right):
    rng = np.random.default_rng(100 + ORDERS.index(kinds))
    known: Counter[str] = Counter()
    for _ in range(20):
        known += check_postures(random_arm(kinds, rng, right), rng, 10, 6)
    assert known["unknown"] <= 0.05 * known.total()


def test_a_slide_that_reaches_out_from_a_lift_has_two_postures_at_a_point():
    """By geometry: the arm turns to the point or away from it, and the slide reaches as far forwards or back."""
    robot = arm(*TEXTBOOK["cylinder"][:2])
    T = kin.fk(robot, [0.4, 0.1, 0.3])
    out = float(np.hypot(*T[:2, 3]))
    front, back = sorted(
        kin.solve_ik(robot, T[:3, 3], task="position", respect_limits=False).solutions, key=lambda s: -s.q[2]
    )
    assert front.q == pytest.approx([0.4, 0.1, out - 0.2])
    assert back.q == pytest.approx([0.4 - np.pi, 0.1, -out - 0.2])


def test_slides_may_change_places_along_parallel_axes():
    robot = arm(*TEXTBOOK["slide between parallel axes"][:2])
    q = robot.random_q(np.random.default_rng(2), 5)
    tried = 0
    for reading in readings(robot):
        T = reading.target(kin.fk(robot, q))
        assert np.abs(kin.fk(reading.robot, q[:, list(reading.order)]) - T).max() < 1e-12
        tried += 1
    assert tried > 3


def test_a_slide_of_any_length_is_found():
    """A travel of 6.5 m is not wrapped as 6.5 rad would be."""
    robot = random_arm("RRPRRR", np.random.default_rng(4))
    q = np.array([0.3, -0.5, 6.5, 0.4, 0.9, -1.2])
    result = kin.solve_ik(robot, kin.fk(robot, q), respect_limits=False)
    assert min(apart(robot, s.q, q) for s in result.solutions) < 1e-6


@pytest.mark.parametrize(
    ("kinds", "rows", "off", "known"),
    [
        ("PRP", [*CROSSED, REACH], 1e-5, "searched"),
        ("PRPPRR", [*CROSSED, (0, 0, 0, 1.2), (0, 0, 0, 0.9), *WRIST[:2]], 1e-9, "unknown"),
    ],
    ids=["one joint turns", "three joints turn"],
)
def test_targets_that_may_have_more_postures_are_left_to_results(kinds, rows, off, known):
    """With joint 2 beside 0 two slides are nearly parallel."""
    robot = arm(kinds, rows)
    q = robot.random_q(np.random.default_rng(6), 12)
    q[:6, 1] = off
    near = q + 0.01  # a seed that is itself a solution is left to results as well
    table = Table.of(robot, kin.fk(robot, q), IKOptions(task="position" if robot.n == 3 else "pose"), near)
    assert (table.kinds[:6] == -1).all()
    assert (table.kinds[6:] >= 0).sum() >= 4
    found = [table.result(i).completeness for i in range(12)]
    assert known in found[:6]
    assert all(found[i] == "proved" for i in np.flatnonzero(table.kinds >= 0))


@pytest.mark.parametrize("kinds", ["RRPRRR", "RPRPRR", "PRRPRR", "PRP"])
def test_batch_kernels_give_what_single_answers_give(kinds):
    rng = np.random.default_rng(5)
    robot = random_arm(kinds, rng)
    targets = kin.fk(robot, robot.random_q(rng, 20))
    rows = kin.ik_branches(robot, targets)
    for T, row in zip(targets, rows, strict=True):
        assert np.array_equal(kin.ik_branches(robot, T), row, equal_nan=True)
