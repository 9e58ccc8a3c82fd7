"""Postures to touch in: they touch, collide with nothing, and say more than others."""

import numpy as np
import pytest

import kin
from kin.calibration.fixtures import PLANE, TouchBoard, TouchFixture
from kin.calibration.model import Model, TableTolerances
from kin.calibration.postures import Pieces, Scene, candidates, choose, workspace_poses
from kin.calibration.words import millimetres
from tests.kin.calibration.simulated import FINE, probed

BAR = TouchFixture([TouchBoard.bar(0.15)])


@pytest.fixture(scope="module")
def plan():
    return kin.calibration.touch_postures("ur5e", BAR, count=12)


def test_postures_touch_and_collide_with_nothing(plan):
    robot = kin.get_robot("ur5e")
    assert plan.q.shape == (12, 6)
    sockets = plan.places[0][:3, :3] @ BAR.local.T + plan.places[0][:3, 3:]
    T = kin.fk(robot, plan.q)
    assert np.abs(T[:, :3, 3] - sockets.T[plan.sockets]).max() < 1e-6
    assert (-T[:, 2, 2] > np.cos(BAR.boards[0].cone) - 1e-9).all()
    assert robot.in_limits(plan.q).all()
    assert (kin.clearance(robot, plan.q) > 0.0).all()
    assert set(plan.sockets.tolist()) == {0, 1}


def test_postures_are_in_an_order_of_short_ways(plan):
    robot = kin.get_robot("ur5e")
    steps = np.abs(np.diff(np.vstack([robot.q_home, plan.q]), axis=0)).max(axis=1).sum()
    rng = np.random.default_rng(1)
    others = [np.abs(np.diff(plan.q[rng.permutation(12)], axis=0)).max(axis=1).sum() for _ in range(10)]
    assert steps < np.mean(others)


def test_a_plan_says_what_it_brings(plan):
    expected = plan.expected
    assert expected.readings < expected.after < expected.bound < 0.2 * expected.before
    assert f"are expected to bring {millimetres(expected.after)}" in plan.text
    more = kin.calibration.touch_postures("ur5e", BAR, count=6, done=(plan.q, plan.sockets))
    assert len(more.q) == 6
    assert more.expected.after < expected.after


def test_chosen_touches_say_more_than_random_ones():
    robot = probed("ur5e")
    model = Model.of(robot, BAR, TableTolerances(), FINE.noise)
    scene = Scene(robot, BAR, 0.0, np.array([kin.pose_from_xyz_rpy([0.45, 0.1, 0.1])]))
    offered = candidates(scene)
    parts = Pieces.of(model, offered, scene.poses, workspace_poses(robot, 100, 0.0))

    def expected(chosen):
        return float(np.trace(parts.L @ parts.covariance(chosen) @ parts.L.T))

    best = expected(choose(parts, offered.at, 10))
    rng = np.random.default_rng(2)
    others = [expected(rng.permutation(len(offered))[:10].tolist()) for _ in range(20)]
    assert best < min(others)


def test_every_board_and_the_plane_get_touches():
    fixture = TouchFixture([TouchBoard.pin()], plane=True)
    assert set(kin.calibration.touch_postures("so101", fixture, count=8).sockets.tolist()) == {0, PLANE}
    fixture = TouchFixture([TouchBoard.bar(0.05)] * 3)
    plan = kin.calibration.touch_postures("so101", fixture, count=14)
    assert {int(fixture.owner[j]) for j in plan.sockets.tolist()} == {0, 1, 2}
    heights = plan.places[:, 2, 3]
    assert heights[2] > heights[0] + 0.02


@pytest.mark.full
def test_a_fixture_that_does_not_show_what_matters_is_said_before_the_first_touch():
    plan = kin.calibration.touch_postures("so101", TouchFixture([TouchBoard.pin()]), count=20)
    assert plan.expected.after > 0.35 * plan.expected.before
    assert "would bring" in plan.advice
    assert plan.advice in plan.text
    better = kin.calibration.touch_postures("so101", TouchFixture([TouchBoard.bar(0.05)] * 3), count=20)
    assert better.expected.after < 0.75 * plan.expected.after


SHEET = TouchFixture([TouchBoard.sheet("A4")])


def test_the_fixture_that_is_used_is_not_recommended():
    far = kin.pose_from_xyz_rpy([0.35, 0.0, 0.0])  # the same sheet nearer to the arm would show more
    plan = kin.calibration.touch_postures("so101", SHEET, count=6, places=[far])
    assert plan.expected.after > 0.35 * plan.expected.before
    assert "sheet" not in plan.advice


def test_few_touches_are_not_said_to_be_enough():
    plan = kin.calibration.touch_postures("so101", SHEET, count=3)
    assert plan.expected.after > 2.0 * plan.expected.readings
    assert plan.advice == ""


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"places": [kin.pose_from_xyz_rpy([5.0, 0.0, 0.0])]}, "places"),
        ({"places": []}, "places"),
        ({"count": 0}, "count"),
        ({"table": np.inf}, "table"),
        ({"done": (np.zeros((2, 6)), [0, 5])}, "done[1][1]"),
        ({"done": (np.zeros((2, 1, 6)), [0, 1])}, "done[0]"),
    ],
)
def test_bad_input_is_named(given, field):
    with pytest.raises(kin.InputError) as caught:
        kin.calibration.touch_postures("ur5e", BAR, **{"count": 3, **given})
    assert caught.value.field == field
