"""Wrong touches are named, and right ones are not blamed."""

import numpy as np
import pytest

import kin
from kin.calibration.fit import Touches
from kin.calibration.fixtures import TouchBoard, TouchFixture
from tests.kin.calibration.simulated import DEG, FINE, probed, tip_error
from tests.kin.calibration.test_fit import BAR, Case, pose

COUNT = 20


@pytest.fixture(scope="module")
def ur5e():
    return Case(probed("ur5e"), BAR, FINE, [pose(0.45, 0.1, 0.1)])


def beside(case, model, errors, touches, k, by):
    """The touches with the tip of touch k moved."""
    q = touches.q.copy()
    J = model.chain.derivatives(q[k][None], errors).by_joint[0]
    q[k] += np.linalg.pinv(J) @ by
    return Touches(q, touches.at)


def test_a_touch_beside_its_socket_is_left_out(ur5e):
    model, errors, touches = ur5e.simulated(21, COUNT)
    wrong = beside(ur5e, model, errors, touches, 7, [0.0, 5e-3, 0.0])
    found = kin.calibration.calibrate(ur5e.robot, wrong.q, wrong.at, BAR, noise=FINE.noise)
    assert [(fault.touch, fault.cause) for fault in found.faults] == [(7, "place")]
    assert found.faults[0].value == pytest.approx(5e-3, abs=2e-3)
    assert 7 not in found.kept
    assert "Touch 8 does not fit the others: the tip was" in found.text


def test_two_touches_beside_their_sockets(ur5e):
    model, errors, touches = ur5e.simulated(22, COUNT)
    wrong = beside(ur5e, model, errors, touches, 3, [5e-3, 0.0, 0.0])
    wrong = beside(ur5e, model, errors, wrong, 11, [0.0, 0.0, 5e-3])
    found = kin.calibration.calibrate(ur5e.robot, wrong.q, wrong.at, BAR, noise=FINE.noise)
    assert {fault.touch for fault in found.faults} == {3, 11}


def test_another_socket(ur5e):
    _, _, touches = ur5e.simulated(23, COUNT)
    at = touches.at.copy()
    at[4] = 1 - at[4]
    found = kin.calibration.calibrate(ur5e.robot, touches.q, at, BAR, noise=FINE.noise)
    assert [(fault.touch, fault.cause, fault.socket) for fault in found.faults] == [(4, "socket", touches.at[4])]
    assert f"socket {touches.at[4] + 1} was touched, not {at[4] + 1}" in found.text


def test_two_readings_exchanged(ur5e):
    _, _, touches = ur5e.simulated(24, COUNT)
    q = touches.q.copy()
    q[6, [1, 2]] = q[6, [2, 1]]
    found = kin.calibration.calibrate(ur5e.robot, q, touches.at, BAR, noise=FINE.noise)
    (fault,) = found.faults
    names = tuple(ur5e.robot.joints[i].name for i in (1, 2))
    assert (fault.touch, fault.cause, fault.joints) == (6, "swap", names)
    assert f"the readings of {names[0]} and {names[1]} are exchanged" in fault.text


def test_a_joint_that_counts_backwards(ur5e):
    _, _, touches = ur5e.simulated(25, COUNT)
    q = touches.q * np.where(np.arange(6) == 2, -1.0, 1.0)
    found = kin.calibration.calibrate(ur5e.robot, q, touches.at, BAR, noise=FINE.noise)
    assert [(fault.touch, fault.cause) for fault in found.faults] == [(None, "sign")]
    assert found.faults[0].joints == (ur5e.robot.joints[2].name,)
    right = kin.calibration.calibrate(ur5e.robot, touches.q, touches.at, BAR, noise=FINE.noise)
    assert found.expected.after == pytest.approx(right.expected.after, rel=0.05)


def test_a_zero_that_is_far_off(ur5e):
    _, _, touches = ur5e.simulated(26, COUNT)
    q = touches.q + np.where(np.arange(6) == 3, 15.0 * DEG, 0.0)
    found = kin.calibration.calibrate(ur5e.robot, q, touches.at, BAR, noise=FINE.noise)
    (fault,) = found.faults
    assert (fault.touch, fault.cause, fault.joints) == (None, "zero", (ur5e.robot.joints[3].name,))
    assert fault.value == pytest.approx(-15.0 * DEG, abs=3.0 * DEG)


def test_a_reading_a_radian_off_is_set_aside_before_the_fit(ur5e):
    _, _, touches = ur5e.simulated(27, COUNT)
    q = touches.q.copy()
    q[9, 1] += np.where(q[9, 1] > -1.0, -1.0, 1.0)
    found = kin.calibration.calibrate(ur5e.robot, q, touches.at, BAR, noise=FINE.noise)
    assert [fault.touch for fault in found.faults] == [9]


def test_right_touches_are_rarely_blamed(ur5e):
    blamed = 0
    for seed in range(8):
        _, _, touches = ur5e.simulated(100 + seed, COUNT)
        found = kin.calibration.calibrate(ur5e.robot, touches.q, touches.at, BAR, noise=FINE.noise)
        blamed += len(found.faults)
    assert blamed <= 1


def test_the_only_touch_of_a_board_is_not_blamed(ur5e):
    fixture = TouchFixture([TouchBoard.pin()] * 2)
    case = Case(ur5e.robot, fixture, FINE, [pose(0.45, 0.1, 0.1), pose(-0.3, 0.45, 0.1)])
    model, errors, touches = case.simulated(28, COUNT)
    first = np.flatnonzero(touches.at == 1)[:1]
    some = touches.take(np.concatenate([np.flatnonzero(touches.at == 0), first]))
    wrong = beside(case, model, errors, some, len(some) - 1, [0.0, 0.02, 0.0])
    found = kin.calibration.calibrate(case.robot, wrong.q, wrong.at, fixture, noise=FINE.noise)
    assert len(some) - 1 in found.kept


@pytest.mark.parametrize(
    ("cause", "mistake"),
    [
        ("sign", lambda q: q * np.where(np.arange(6) == 2, -1.0, 1.0)),
        ("swap", lambda q: q[..., [0, 2, 1, 3, 4, 5]]),
        ("zero", lambda q: q + np.where(np.arange(6) == 3, 15.0 * DEG, 0.0)),
    ],
)
def test_readings_with_a_mistake_of_all_touches_are_corrected_for_the_table_found(ur5e, cause, mistake):
    model, errors, touches = ur5e.simulated(30, COUNT)
    found = kin.calibration.calibrate(ur5e.robot, mistake(touches.q), touches.at, BAR, noise=FINE.noise)
    assert [(fault.touch, fault.cause) for fault in found.faults] == [(None, cause)]
    assert ("correct yours too before you use it" in found.text) == (cause != "zero")
    q = ur5e.test
    true = model.chain.points(q, errors)
    assert tip_error(true, kin.fk_positions(found.robot, found.corrected(mistake(q)))) < found.expected.bound
    assert np.array_equal(found.corrected(mistake(q[3])), found.corrected(mistake(q))[3])


@pytest.mark.parametrize(
    "mistake",
    [
        lambda q: q * [1.0, -1.0, -1.0, 1.0, 1.0, 1.0],
        np.negative,
        lambda q: q[:, [2, 0, 1, 3, 4, 5]],
        lambda q: np.random.default_rng(1).uniform(-3.0, 3.0, q.shape),
    ],
    ids=["two signs", "all signs", "columns", "random"],
)
def test_touches_that_no_table_explains_are_an_answer(ur5e, mistake):
    _, _, touches = ur5e.simulated(29, COUNT)
    found = kin.calibration.calibrate(ur5e.robot, mistake(touches.q), touches.at, BAR, noise=FINE.noise)
    assert found.noise > 2.0
    assert "times as much as stated" in found.text
    assert found.expected.after <= 1.001 * found.expected.before  # both with the tolerances that were taken
