"""The tool point of an arm with errors, its derivatives, and the table with the errors in it."""

import numpy as np
import pytest

import kin
from kin.calibration.chain import Chain

ARMS = ("ur5e", "panda", "scara", "palletiser", "so101", "pioneer5")


@pytest.fixture(params=ARMS)
def robot(request):
    return kin.get_robot(request.param)


@pytest.mark.parametrize("scale", [False, True])
def test_the_table_with_errors_is_the_arm_with_these_errors(robot, scale):
    chain, rng = Chain(robot, scale=scale), np.random.default_rng(1)
    q = robot.random_q(rng, 6)
    for size in (0.0, 0.02):
        delta = size * rng.normal(size=len(chain.parameters))
        made = chain.robot_with(delta)
        assert np.abs(chain.points(q, delta) - kin.fk_positions(made, q)).max() < 1e-14
    assert kin.load_robot(kin.robot_to_toml(made)).rows == made.rows


@pytest.mark.parametrize("waves", [False, True])
def test_derivatives_are_differences(robot, waves):
    chain, rng = Chain(robot, waves, scale=True), np.random.default_rng(2)
    q, count = robot.random_q(rng, 4), len(chain.parameters)
    delta = 0.02 * rng.normal(size=count)
    found = chain.derivatives(q, delta)
    assert np.array_equal(found.points, chain.points(q, delta))
    for i, step in enumerate(1e-6 * np.eye(count)):
        difference = (chain.points(q, delta + step) - chain.points(q, delta - step)) / 2e-6
        assert np.abs(found.by_parameter[:, :, i] - difference).max() < 1e-8
    if waves:  # readings are not moved by their own wave
        return
    for i, step in enumerate(1e-6 * np.eye(robot.n)):
        difference = (chain.points(q + step, delta) - chain.points(q - step, delta)) / 2e-6
        assert np.abs(found.by_joint[:, :, i] - difference).max() < 1e-8


def test_waves_come_to_the_readings():
    robot = kin.get_robot("ur5e")
    chain, rng = Chain(robot, waves=True), np.random.default_rng(3)
    delta = np.where([each.kind == "wave" for each in chain.parameters], 0.01, 0.0)
    q = robot.random_q(rng, 5)
    turned = q + chain.wave(q, delta)
    assert np.abs(turned - q - 0.01 * (np.sin(q) + np.cos(q))).max() < 1e-15
    assert np.abs(chain.points(q, delta) - kin.fk_positions(robot, turned)).max() < 1e-14


def test_bodies_stay_with_their_rows():
    robot = kin.get_robot("panda")
    chain = Chain(robot)
    made = chain.robot_with(1e-9 * np.ones(len(chain.parameters)))
    assert len(made.rows) > len(robot.rows)
    q = robot.q_home
    frames, before = kin.link_frames(made, q), kin.link_frames(robot, q)
    for new, old in zip(made.capsules, robot.capsules, strict=True):
        if old.row < 0:
            assert new.row < 0
            continue
        at = frames[new.row, :3, :3] @ new.start + frames[new.row, :3, 3]
        assert np.abs(at - before[old.row, :3, :3] @ old.start - before[old.row, :3, 3]).max() < 1e-7
