"""Tables from simulated touches: how good they are, and whether what is said of them is true."""

from dataclasses import replace

import numpy as np
import pytest

import kin
from kin.calibration import expected_error
from kin.calibration.chain import Chain
from kin.calibration.faults import checked
from kin.calibration.fit import Touches, fit, spread
from kin.calibration.fixtures import PLANE, Places, TouchBoard, TouchFixture
from kin.calibration.model import Model, TableTolerances, TouchNoise
from kin.calibration.postures import Scene, candidates
from tests.kin.calibration.simulated import (
    DEG,
    FINE,
    HOBBY,
    model_of,
    probed,
    random_errors,
    tip_error,
    touch,
    true_sockets,
)

BAR = TouchFixture([TouchBoard.bar(0.15)])
SHEET = TouchFixture([TouchBoard.sheet("A4")])


def pose(x, y, z):
    return kin.pose_from_xyz_rpy([x, y, z])


class Case:
    """An arm, a fixture, and candidates that touch it."""

    def __init__(self, robot, fixture, machine, poses):
        self.robot, self.fixture, self.machine = robot, fixture, machine
        self.poses, self.scene = np.array(poses), Scene(robot, fixture, 0.0, np.array(poses))
        self.offered = candidates(self.scene)
        self.test = robot.random_q(np.random.default_rng(5), 300)

    def simulated(self, seed, count=20, tolerances=None, machine=None, errors=None):
        """The model of a calibration, the true errors, and touches."""
        rng = np.random.default_rng(seed)
        machine = machine or self.machine
        model = model_of(self.robot, self.fixture, machine, tolerances)
        errors = random_errors(model.chain, rng) if errors is None else errors
        pick = rng.permutation(len(self.offered))[:count]
        spots = true_sockets(self.fixture, self.poses, rng)
        return (
            model,
            errors,
            touch(model.chain, errors, machine, self.offered.take(pick), self.fixture, spots, rng),
        )

    def off(self, chain, errors, delta):
        """Error of the tip with this table, metres."""
        return tip_error(chain.points(self.test, errors), chain.points(self.test, delta))


@pytest.fixture(scope="module")
def ur5e():
    return Case(probed("ur5e"), BAR, FINE, [pose(0.45, 0.1, 0.1)])


@pytest.fixture(scope="module")
def so101():
    return Case(kin.get_robot("so101"), SHEET, HOBBY, [pose(0.22, 0.0, 0.0)])


def test_touches_without_noise_give_the_table(ur5e):
    exact = replace(FINE, play=1e-9, contact=1e-9)
    model, errors, touches = ur5e.simulated(1, 40, machine=replace(exact, contact=1e-6, play=2e-6))
    sharp = replace(model, fixture=TouchFixture([replace(BAR.boards[0], print_error=1e-7)]))
    spots = ur5e.poses[0, :3, :3] @ BAR.local.T + ur5e.poses[0, :3, 3:]
    rng = np.random.default_rng(1)
    touches = touch(model.chain, errors, exact, touches, BAR, spots.T, rng)
    found = fit(sharp, touches)
    assert ur5e.off(model.chain, errors, 0.0 * errors) > 5e-3
    assert ur5e.off(model.chain, errors, found.delta) < 5e-5


def test_twenty_touches_of_a_bar_mend_an_industrial_arm(ur5e):
    for seed in range(3):
        model, errors, touches = ur5e.simulated(seed)
        found = fit(model, touches)
        before, after = (ur5e.off(model.chain, errors, delta) for delta in (0.0 * errors, found.delta))
        assert after < 0.15 * before
        assert found.noise < 1.5
        inside = np.abs(found.delta - errors) < 1.96 * found.sd
        assert inside.mean() > 0.85


def test_the_bound_is_kept_for_an_arm_of_servos(so101):
    for seed in range(3):
        model, errors, touches = so101.simulated(seed)
        result = kin.calibration.calibrate(
            so101.robot, touches.q, touches.at, SHEET, tolerances=TableTolerances(), noise=HOBBY.noise
        )
        by_motor = so101.robot.random_q(np.random.default_rng(3), 300)
        true = model.chain.points(by_motor, errors)
        found = kin.fk_positions(result.robot, result.corrected(by_motor))
        assert tip_error(true, found) < result.expected.bound
        assert result.expected.after < 0.5 * result.expected.before


def test_larger_noise_is_seen_and_does_not_bend_the_table(ur5e):
    loud = replace(FINE, play=4.0 * FINE.play, contact=4.0 * FINE.contact)
    model, errors, touches = ur5e.simulated(4, machine=loud)
    quiet = replace(model, noise=FINE.noise)
    found = fit(quiet, touches)
    assert 2.0 < found.noise < 6.0
    assert ur5e.off(model.chain, errors, found.delta) < 0.5 * ur5e.off(model.chain, errors, 0.0 * errors)


def test_tolerances_widen_but_not_beyond_three_times(ur5e):
    model, errors, _ = ur5e.simulated(5)
    for factor, low, high in ((1.0, 1.0, 1.0), (2.0, 1.3, 3.0), (9.0, 3.0, 3.0)):
        large = np.where(model.of_table, factor * errors, errors)
        _, _, touches = ur5e.simulated(5, 30, errors=large)
        found = fit(model, touches)
        assert low <= found.wider <= high, factor
        stated, taken = (
            expected_error(model, replace(found, wider=each), ur5e.test).before for each in (1.0, found.wider)
        )
        assert taken == pytest.approx(found.wider * stated, rel=0.1)  # the tool point stays as well known


def test_a_common_scale_is_found_with_a_known_distance(ur5e):
    parameters = model_of(ur5e.robot, BAR, FINE).chain.parameters
    grown = np.array([0.01 * each.nominal if each.kind == "length" else 0.0 for each in parameters])
    _, _, touches = ur5e.simulated(6, 40, errors=grown)
    left = []
    for scale in (0.0, 0.01):
        model = model_of(ur5e.robot, BAR, FINE, TableTolerances(scale=scale))
        found = fit(model, touches)
        left.append(
            tip_error(
                kin.fk_positions(Chain(ur5e.robot).robot_with(grown), ur5e.test),
                model.chain.points(ur5e.test, found.delta),
            )
        )
    assert found.delta[-4] == pytest.approx(0.01, abs=0.005)
    assert left[1] < 0.7 * left[0]


def test_waves_of_encoders_are_an_option(so101):
    robot = so101.robot
    waved = replace(HOBBY, wave=1.0 * DEG, play=0.02 * DEG)
    _, _, touches = so101.simulated(7, 60, machine=waved)
    plain, option = (TableTolerances(), TableTolerances(wave=0.5 * DEG))
    noise = replace(HOBBY, play=0.02 * DEG).noise
    without = kin.calibration.calibrate(robot, touches.q, touches.at, SHEET, tolerances=plain, noise=noise)
    found = kin.calibration.calibrate(robot, touches.q, touches.at, SHEET, tolerances=option, noise=noise)
    assert np.abs(found.waves).max() > 0.2 * DEG
    assert found.noise < 0.7 * without.noise
    assert {error.kind for error in found.errors} > {"wave"}
    assert not np.any(without.waves)


def test_sag_does_not_break_the_bound(so101):
    model, errors, touches = so101.simulated(8, machine=replace(HOBBY, sag=2e-3))
    result = kin.calibration.calibrate(
        so101.robot, touches.q, touches.at, SHEET, tolerances=TableTolerances(), noise=HOBBY.noise
    )
    q = so101.robot.random_q(np.random.default_rng(3), 300)
    assert (
        tip_error(model.chain.points(q, errors), kin.fk_positions(result.robot, result.corrected(q)))
        < result.expected.bound
    )


def test_a_plane_is_touched_too(so101):
    fixture = TouchFixture([TouchBoard.pin()], plane=True)
    case = Case(so101.robot, fixture, HOBBY, [pose(0.22, 0.0, 0.05)])
    model, errors, touches = case.simulated(9, 30)
    assert (touches.at == PLANE).sum() > 5
    found = fit(model, touches)
    pin = touches.take(touches.at != PLANE)
    alone = fit(replace(model, fixture=TouchFixture([TouchBoard.pin()])), pin)
    assert case.off(model.chain, errors, found.delta) < case.off(model.chain, errors, alone.delta)
    on = found.misses[touches.at == PLANE]
    assert np.abs(on[:, 0]).max() < 5e-3
    assert not on[:, 1:].any()


def test_places_have_the_derivatives_that_they_have():
    fixture, rng = TouchFixture([TouchBoard.sheet("A4"), TouchBoard.bar()], plane=True), np.random.default_rng(1)
    at = np.array([0, 3, 5, 6, 7, PLANE, PLANE, PLANE, PLANE])
    p = 0.3 * rng.normal(size=(len(at), 3))
    places = Places.near(fixture, p, at).moved(0.1 * rng.normal(size=fixture.size))
    A, D = places.derivatives(p, at)
    for i, step in enumerate(1e-6 * np.eye(fixture.size)):
        difference = (places.moved(step).misses(p, at) - places.moved(-step).misses(p, at)) / 2e-6
        assert np.abs(D[:, :, i] - difference).max() < 1e-8
    for i, step in enumerate(1e-6 * np.eye(3)):
        difference = (places.misses(p + step, at) - places.misses(p - step, at)) / 2e-6
        assert np.abs(A[:, :, i] - difference).max() < 1e-8


def test_a_marked_place_shows_the_base(so101):
    marked = TouchFixture(SHEET.boards, at_base=so101.poses)
    model, errors, asked = so101.simulated(10, 30)
    spots = SHEET.local + so101.poses[0][:3, 3]
    touches = touch(model.chain, errors, HOBBY, asked, SHEET, spots, np.random.default_rng(10))
    q = so101.test
    true = model.chain.points(q, errors)

    def off(fixture):
        found = kin.calibration.calibrate(so101.robot, touches.q, touches.at, fixture)
        return found, np.sqrt(np.mean((kin.fk_positions(found.robot, found.corrected(q)) - true) ** 2))

    (with_mark, near), (without, far) = off(marked), off(SHEET)
    assert any("base" in text for text in without.unseen)
    assert not any("base" in text for text in with_mark.unseen)
    assert np.linalg.norm(with_mark.places[0][:3, 3] - so101.poses[0][:3, 3]) < 3e-3
    assert near < 0.8 * far


def test_the_zeros_of_motors_are_in_their_offsets(so101):
    robot = so101.robot
    _, _, touches = so101.simulated(11)
    result = kin.calibration.calibrate(robot, touches.q, touches.at, SHEET)
    readings = kin.motors.readings_from_q(robot, touches.q)
    assert np.abs(kin.motors.q_from_readings(result.robot, readings) - result.corrected(touches.q)).max() < 1e-9
    own = {row.name: row for row in result.robot.rows}
    assert all(own[row.name].limits == row.limits for row in robot.rows)
    assert np.abs(result.zeros).max() > 0.1 * DEG
    in_motor = [error for error in result.errors if error.in_motor]
    assert [error.row for error in in_motor] == [joint.name for joint in robot.joints]
    assert "in the offset of its motor" in in_motor[0].text


@pytest.mark.parametrize(
    ("mistake", "cause"),
    [(lambda q: q * [1, -1, 1, 1, 1], "sign"), (lambda q: q[:, [0, 2, 1, 3, 4]], "swap")],
)
def test_motors_make_up_for_a_mistake_of_all_touches(so101, mistake, cause):
    robot = so101.robot
    _, _, touches = so101.simulated(11, 30)
    q = mistake(touches.q)
    result = kin.calibration.calibrate(robot, q, touches.at, SHEET)
    (fault,) = [each for each in result.faults if each.touch is None]
    assert (fault.cause, fault.in_motors) == (cause, True)
    assert "The motors of the arm found make up for it." in fault.text
    readings = kin.motors.readings_from_q(robot, q)
    assert np.abs(kin.motors.q_from_readings(result.robot, readings) - result.corrected(q)).max() < 1e-9
    assert np.abs(result.corrected(q) - touches.q).max() < 6.0 * DEG
    bare = replace(robot, motors=())
    assumed = {"tolerances": TableTolerances.of(robot), "noise": kin.calibration.TouchNoise.of(robot)}
    plain = kin.calibration.calibrate(bare, q, touches.at, SHEET, **assumed)
    assert [each.in_motors for each in plain.faults if each.touch is None] == [False]
    assert "correct yours too before you use it" in plain.text


def test_results_are_shown_in_one_line(ur5e):
    _, _, touches = ur5e.simulated(12)
    found = kin.calibration.calibrate(ur5e.robot, touches.q, touches.at, BAR, noise=FINE.noise)
    e = found.expected
    mm = f"{1e3 * e.before:.3g} to {1e3 * e.after:.3g} mm, 95 % below {1e3 * e.bound:.3g}"
    assert repr(found) == f"Calibration('ur5e', {mm}, 20 of 20 touches, 0 faults)"
    plan = kin.calibration.TouchPlan(touches.q, touches.at, np.eye(4)[None], 0.0, e)
    assert repr(plan) == f"TouchPlan(20 touches, {1e3 * e.before:.3g} to {1e3 * e.after:.3g} mm)"


def test_a_fit_and_a_plan_can_be_cancelled(ur5e):
    def cancel():
        raise RuntimeError("cancelled")

    _, _, touches = ur5e.simulated(12)
    with pytest.raises(RuntimeError, match="cancelled"):
        kin.calibration.calibrate(ur5e.robot, touches.q, touches.at, BAR, cancel=cancel)
    with pytest.raises(RuntimeError, match="cancelled"):
        kin.calibration.touch_postures(ur5e.robot, BAR, 3, cancel=cancel)


def test_the_family_can_be_kept(ur5e):
    _, _, touches = ur5e.simulated(12)
    result = kin.calibration.calibrate(
        ur5e.robot, touches.q, touches.at, BAR, tolerances=TableTolerances(keep_family=True), noise=FINE.noise
    )
    assert kin.branch_names(result.robot) == kin.branch_names(ur5e.robot)
    assert len(result.robot.rows) == len(ur5e.robot.rows)


@pytest.mark.full
def test_what_is_unseen_is_said(so101):
    pin = TouchFixture([TouchBoard.pin()])
    case = Case(so101.robot, pin, HOBBY, [pose(0.22, 0.0, 0.05)])
    _, _, touches = case.simulated(13)
    result = kin.calibration.calibrate(so101.robot, touches.q, touches.at, pin)
    assert [text.split(",")[0] for text in result.unseen] == [
        "Not seen: where the base stands",
        "Not seen: the orientation of the tool",
        "Not seen: the scale of all lengths",
    ]
    assert "three places" in result.advice or "sheet" in result.advice
    assert result.advice in result.text
    assert {error.unseen for error in result.errors if not error.seen} <= {"alike", "hidden"}
    assert any(not error.seen for error in result.errors)


def test_the_calibrated_arm_is_solved_and_written(ur5e):
    _, _, touches = ur5e.simulated(14)
    made = kin.calibration.calibrate(ur5e.robot, touches.q, touches.at, BAR).robot
    assert kin.load_robot(kin.robot_to_toml(made)) == made
    rng = np.random.default_rng(4)
    for q in made.random_q(rng, 10):
        answer = kin.solve_ik(made, kin.fk(made, q), q_seed=q)
        assert answer.status == "solved"
        assert answer.complete
        assert np.abs(answer.solutions[0].q - q).max() < 1e-6


def test_checked_is_the_fit_where_nothing_is_wrong(ur5e):
    model, _, touches = ur5e.simulated(15)
    found = checked(model, touches)
    assert found.faults == ()
    assert np.array_equal(found.kept, np.arange(len(touches)))


@pytest.mark.parametrize(
    ("change", "field", "expected"),
    [
        (lambda q, at: (q[:5], at[:5]), "q", "7 to 1000 touches"),
        (lambda q, at: (np.degrees(q), at), "q[", "are these degrees"),
        (lambda q, at: (np.repeat(q[:1], 20, axis=0), at), "q", "postures that differ"),
        (lambda q, at: (q, at + 7), "sockets[0]", "a socket of the fixture, 0 to 1"),
        (lambda q, at: (q, at - 1), "sockets[", "a socket of the fixture, 0 to 1"),
        (lambda q, at: (q, at[:5]), "sockets", "one for each of 20 touches"),
        (lambda q, at: (np.where(np.arange(20)[:, None] == 3, np.nan, q), at), "q[3][0]", "finite"),
        (lambda q, at: (q + np.eye(20, 6, -2) * 9.0, at), "q[2][0]", "within its limits"),
    ],
)
def test_bad_input_is_named(ur5e, change, field, expected):
    _, _, touches = ur5e.simulated(16)
    with pytest.raises(kin.InputError) as caught:
        kin.calibration.calibrate(ur5e.robot, *change(touches.q, touches.at), BAR)
    assert caught.value.field.startswith(field)
    assert expected in caught.value.expected
    if field not in ("q", "sockets"):  # touches that were made before a plan are checked alike
        with pytest.raises(kin.InputError) as planned:
            kin.calibration.touch_postures(ur5e.robot, BAR, 3, done=change(touches.q, touches.at))
        assert planned.value.field == caught.value.field.replace("q", "done[0]").replace("sockets", "done[1]")
        assert planned.value.expected == caught.value.expected


@pytest.mark.parametrize(("reading", "asked"), [(2.6, False), (-95.0, True)])
def test_readings_outside_the_limits_are_called_degrees_only_beyond_a_turn(so101, reading, asked):
    _, _, touches = so101.simulated(18)
    q = touches.q.copy()
    q[4, 1] = reading
    with pytest.raises(kin.InputError) as caught:
        kin.calibration.calibrate(so101.robot, q, touches.at, SHEET)
    assert caught.value.field == "q[4][1]"
    assert ("are these degrees?" in caught.value.expected) == asked


def test_exchanged_columns_are_found(ur5e):
    _, _, touches = ur5e.simulated(17)
    q = touches.q.copy()
    q[:, [3, 4]] = q[:, [4, 3]]
    found = kin.calibration.calibrate(ur5e.robot, q, touches.at, BAR, noise=FINE.noise)
    assert [fault.touch for fault in found.faults][:1] == [None]
    assert found.faults[0].cause == "swap"
    assert found.faults[0].joints == (ur5e.robot.joints[3].name, ur5e.robot.joints[4].name)
    assert Touches(q, touches.at).take([0]).q.shape == (1, 6)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: TouchBoard(np.zeros((0, 3))), "sockets"),
        (lambda: TouchBoard(np.zeros((2, 3))), "sockets[1]"),
        (lambda: TouchBoard.sheet("B5"), "paper"),
        (lambda: TouchBoard.bar(5.0), "length"),
        (lambda: TouchBoard(np.zeros((1, 3)), cone=3.0), "cone"),
        (lambda: TouchFixture([]), "boards"),
        (lambda: TouchFixture([TouchBoard.pin()], at_base=[]), "at_base"),
        (lambda: TableTolerances(zero=0.0), "zero"),
        (lambda: TableTolerances(scale=0.5), "scale"),
        (lambda: Model.of(kin.get_robot("palletiser"), BAR, TableTolerances(wave=0.1)), "wave"),
        (lambda: kin.calibration.TouchNoise(0.0), "joint"),
        (lambda: kin.calibration.TouchNoise(0.1, 2.0), "contact"),
    ],
)
def test_fixtures_and_tolerances_are_checked(make, field):
    with pytest.raises(kin.InputError) as caught:
        make()
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("make", "field", "valid"),
    [
        (lambda: TouchNoise(joint=5e-324), "joint", "at least 1e-06"),
        (lambda: TouchNoise(contact=1e-200), "contact", "1e-06 to 0.1 m"),
        (lambda: TableTolerances(zero=1e-300), "zero", "1e-06 to"),
        (lambda: TableTolerances(scale=1e-300), "scale", "0 or 1e-06 to"),
    ],
)
def test_sizes_whose_squares_are_lost_in_rounding_are_refused(make, field, valid):
    with pytest.raises(kin.InputError) as caught:
        make()
    assert caught.value.field == field
    assert valid in str(caught.value)


def test_the_expected_error_depends_on_the_covariance_and_not_on_the_root_that_a_library_finds():
    rng = np.random.default_rng(4)
    root, turned = rng.normal(size=(60, 12)), np.linalg.qr(rng.normal(size=(12, 12)))[0]
    assert spread(root @ turned, 30.0, 20) == pytest.approx(spread(root, 30.0, 20), rel=1e-9)
    _, bound = spread(root, 1e9, 20, draws=20_000)  # with noise that is known exactly
    errors = np.sqrt(((root @ rng.normal(size=(12, 20_000))) ** 2).sum(axis=0) / 20)
    assert bound == pytest.approx(1.12 * np.quantile(errors, 0.95), rel=0.01)
