"""A worse target never gets a better verdict: tolerances widen for missing digits only, and by their number."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin import InputError, Status, solve_ik
from kin.ik.digits import missing_digits
from kin.transforms import rotation_from_wxyz, wxyz_from_rotation

# Arms with two to seven joints: those with fewer than six meet few poses exactly.
KINDS = ("planar2r", "planar3r", "scara", "pioneer5", "so101", "rpp", "ur5", "crx10ia", "panda", "iiwa14")
SINGLE = float(np.finfo(np.float32).eps)
SIZES = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2)


def inside(robot, seed, count):
    """Configurations ``(count, n)`` well inside the limits: those of an arm that is bent."""
    share = np.random.default_rng(seed).uniform(0.15, 0.85, (count, robot.n))
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    return low + share * (high - low)


def significant(values, digits):
    return np.vectorize(lambda x: float(f"{x:.{digits}g}"))(values)


def as_quaternion(T, rounded):
    """The pose with the rotation of a quaternion whose entries are rounded, and with a point that is."""
    out = np.eye(4)
    out[:3, :3] = rotation_from_wxyz(rounded(wxyz_from_rotation(T[:3, :3])))
    out[:3, 3] = rounded(T[:3, 3])
    return out


FORMS = {
    **{f"{k} decimals": lambda x, k=k: np.round(x, k) for k in (4, 5, 6, 9)},
    **{f"{k} significant": lambda x, k=k: significant(x, k) for k in (5, 6, 9)},
    "17 digits": lambda x: significant(x, 17),
    "float32": lambda x: x.astype(np.float32).astype(float),
}


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("form", FORMS)
def test_missing_digits_are_recognised_alike_of_matrices_and_quaternions(name, form):
    robot, rounded = kin.get_robot(name), FORMS[form]
    for q in inside(robot, 1, 6):
        T = kin.fk(robot, q)
        for target in (rounded(T), as_quaternion(T, rounded)):
            result = solve_ik(robot, target, q_seed=q)
            assert result.status is Status.SOLVED, result.reason
            position, rotation = result.tolerances
            assert result.best.position_error <= position
            assert result.best.rotation_error <= rotation
            assert ("rounded" in result.reason) == (result.target_error > 0.0) == (position > 1e-9)
            assert np.abs(result.best.q - q).max() < 0.1
            if robot.n < 6 and form != "17 digits":
                least, most = (SINGLE, 4.0 * SINGLE) if form == "float32" else (1e-9, 1e-3)
                assert result.target_error == 0.0 or least <= result.target_error <= most


def digits_of(T):
    return missing_digits(T[:3, :3])


def test_how_many_digits_there_are():
    T = kin.pose_from_position_wxyz([0.1, 0.2, 0.3], [0.3, -0.4, 0.77, 0.4])
    for digits in range(3, 10):
        unit = pytest.approx(10.0**-digits)
        assert digits_of(T.round(digits)) == unit
        assert digits_of(significant(T, digits)) == unit
        assert digits_of(as_quaternion(T, lambda x, k=digits: np.round(x, k))) == unit
    assert digits_of(T.round(2)) == 0.01
    assert digits_of(FORMS["float32"](T)) == digits_of(as_quaternion(T, FORMS["float32"])) == SINGLE
    assert digits_of(T) == digits_of(significant(T, 17)) == 0.0


@pytest.mark.parametrize("digits", [10, 11, 12, 15])
@pytest.mark.parametrize("name", ["pioneer5", "so101", "scara", "planar3r"])
def test_digits_that_leave_less_than_the_tolerances_are_not_mentioned(name, digits):
    robot = kin.get_robot(name)
    for q in inside(robot, 6, 4):
        T = kin.fk(robot, q)
        for target in (T.round(digits), as_quaternion(T, lambda x: np.round(x, digits))):
            result = solve_ik(robot, target, q_seed=q)
            assert (result.status, result.target_error, result.tolerances) == (Status.SOLVED, 0.0, (1e-9, 1e-9))
            assert "rounded" not in result.reason


def test_a_quaternion_of_few_digits_that_is_met_exactly_is_not_called_rounded():
    T = kin.fk("scara", kin.get_robot("scara").q_home)  # its z axis points down
    T[:3, :3] = rotation_from_wxyz([0.0, 0.9239, 0.3827, 0.0])
    assert digits_of(T) == 1e-4
    result = solve_ik("scara", T)
    assert (result.status, result.target_error) == (Status.SOLVED, 0.0)


@pytest.mark.parametrize(
    "wxyz", [(1, 1, 0, 0), (1, 2, 3, 4), (0.6, 0, 0.8, 0), (1, 1, 2, 0), (0, 0, 0, 2), (5, -3, 7, 11)]
)
def test_ratios_of_whole_numbers_are_exact(wxyz):
    T = np.eye(4)
    T[:3, :3] = rotation_from_wxyz(wxyz)
    assert digits_of(T) == 0.0


def test_whole_degrees_are_exact():
    for angle in range(-180, 181, 15):
        for axis in np.eye(3):
            T = kin.pose_from_xyz_rpy([0.4, 0.1, 0.2], np.radians(angle) * axis + (0.0, 0.0, np.radians(30)))
            assert digits_of(T) == 0.0


def factor(T, size):
    out = T.copy()
    out[:3, :3] *= 1.0 + size
    return out


def shear(T, size):
    out = T.copy()
    out[:3, 0] += size * T[:3, 1]
    return out


def drift(T, size):
    out = T.copy()
    out[:3, :3] += size * np.random.default_rng(3).uniform(-1.0, 1.0, (3, 3))
    return out


def turned(T, size):
    """No error of the form: a rotation by so much about an axis that arms of few joints cannot turn about."""
    out = T.copy()
    out[:3, :3] = T[:3, :3] @ kin.pose_from_xyz_rpy([0, 0, 0], [0.6 * size, 0.0, 0.8 * size])[:3, :3]
    return out


def verdict(robot, T, q):
    """How good a verdict is: refused is worst, exactly solved is best."""
    try:
        result = solve_ik(robot, T, q_seed=q)
    except InputError as error:
        return 0, str(error)
    assert result.tolerances == (1e-9, 1e-9), result.reason
    assert result.target_error == 0.0
    assert "rounded" not in result.reason
    return (2 if result.status is Status.SOLVED else 1), result.reason


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("error", [factor, shear, drift, turned])
def test_growing_errors_never_improve_the_verdict(name, error):
    robot = kin.get_robot(name)
    for q in inside(robot, 2, 3):
        T = kin.fk(robot, q)
        ranks = [verdict(robot, T, q)[0], *(verdict(robot, error(T, size), q)[0] for size in SIZES)]
        assert ranks[0] == 2
        assert ranks == sorted(ranks, reverse=True)
        if error is not turned:
            assert ranks[-1] == 0


@pytest.mark.parametrize("name", ["pioneer5", "so101", "scara"])
@pytest.mark.parametrize("error", [factor, shear, drift])
def test_an_error_of_form_does_not_hide_one_of_orientation(name, error):
    robot = kin.get_robot(name)
    for q in inside(robot, 4, 3):
        T = turned(kin.fk(robot, q), 0.015)
        ranks = [verdict(robot, T, q)[0], *(verdict(robot, error(T, size), q)[0] for size in SIZES)]
        assert ranks[0] == 1
        assert max(ranks) == 1


def test_a_refusal_says_the_size_of_the_error():
    T = kin.fk("ur5", kin.get_robot("ur5").q_home)  # its entries are 0 and 1, so all errors have few decimals
    with pytest.raises(InputError, match=r"this one is a rotation times 1\.001"):
        solve_ik("ur5", factor(T, 1e-3))
    assert digits_of(shear(np.round(T), 0.03)) == 0.0
    with pytest.raises(InputError, match=r"RᵀR of this one is off by 0\.03"):
        solve_ik("ur5", shear(np.round(T), 0.03))
    T = kin.fk("ur5", kin.get_robot("ur5").q_home + 0.3)
    with pytest.raises(InputError, match=r"RᵀR of this one is off by 0\.003"):
        solve_ik("ur5", shear(T, 3e-3))
    with pytest.raises(InputError, match=r"targets\[1\] rotation"):
        kin.solve_ik_many("ur5", [T, factor(T, 1e-3)])


def test_many_targets_are_read_as_single_ones_are():
    robot = kin.get_robot("so101")
    T = [as_quaternion(T, FORMS["5 decimals"]) for T in kin.fk(robot, inside(robot, 5, 4))]
    for targets in (np.array(T), T, [t.tolist() for t in T]):
        assert [r.target_error for r in kin.solve_ik_many(robot, targets)] == [1e-5] * 4


@pytest.mark.parametrize("name", ["so101", "pioneer5"])
def test_a_path_of_rounded_quaternions_has_no_gaps(name):
    robot = kin.get_robot(name)
    line = kin.fk(robot, np.linspace(robot.q_home, robot.clip(robot.q_home + 0.2), 5))
    rounded = np.array([as_quaternion(T, FORMS["5 decimals"]) for T in line])
    path = kin.solve_path(robot, rounded, q_start=robot.q_home)
    assert (path.gaps, path.target_error) == ((), 1e-5)
    assert "Targets are rounded" in path.reason
    assert (path.position_error <= path.tolerances[0]).all()
    assert (path.rotation_error <= path.tolerances[1]).all()
