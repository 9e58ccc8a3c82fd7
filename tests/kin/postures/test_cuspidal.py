"""Cuspidal arms: the published border of the orthogonal ones, and loops judged by fine samples."""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

import kin
from kin.angles import apart
from kin.axes import size
from kin.differential.task import natural_task, task_jacobian, weight
from kin.postures import loops
from kin.postures.cusps import _conditions, chain_of, is_staged, possible_cusps

SQUARE = 0.5 * math.pi
CUSPIDAL = ("gofa", "crx10ia", "jaco2", "xarm6")
WRIST = [(0.0, 0.3, 0.0, -SQUARE), (0.0, 0.0, 0.0, SQUARE), (0.0, 0.1, 0.0, 0.0)]


def orthogonal(d3: float, d4: float, r2: float, wrist: bool = False) -> kin.Robot:
    """Three axes at right angles, 1 m between the first two; d3, d4 and r2 as in the papers. Or with a wrist."""
    arm = [(0.0, 0.0, 1.0, SQUARE), (0.0, r2, d3, -SQUARE)]
    if not wrist:
        return kin.Robot.from_dh([*arm, (0.0, 0.0, d4, 0.0)])
    # Axis 4 is perpendicular to axis 3 and leads to the wrist centre.
    return kin.Robot.from_dh([*arm, (0.0, 0.0, 0.0, SQUARE), (0.0, d4, 0.0, -SQUARE), *WRIST[1:]])


def four_equal_roots(d3: float, r2: float) -> float:
    """The d4 at which the quartic of θ3 has four equal roots, by Corvez and Rouillier: no cusps below it."""
    square, product = d3**2 + r2**2, math.hypot(d3 + 1.0, r2) * math.hypot(d3 - 1.0, r2)
    return math.sqrt(0.5 * (square - (square**2 - d3**2 + r2**2) / product))


@pytest.mark.parametrize(
    ("d3", "r2"),
    [
        (2.0, 1.0),
        (1.5, 0.7),
        pytest.param(0.7, 0.5, marks=pytest.mark.full),
        pytest.param(3.0, 0.4, marks=pytest.mark.full),
    ],
)
def test_orthogonal_arms_are_cuspidal_beyond_four_equal_roots(d3, r2):
    border = four_equal_roots(d3, r2)
    below = kin.cuspidal(orthogonal(d3, 0.97 * border, r2))
    assert (below.verdict, below.evidence, below.loop) == ("no", "no cusps", None)
    above = kin.cuspidal(orthogonal(d3, 1.2 * border, r2))
    assert (above.verdict, above.evidence) == ("yes", "loop")
    check_loop(orthogonal(d3, 1.2 * border, r2), above)
    assert len(possible_cusps(chain_of(orthogonal(d3, 1.002 * border, r2))))


def test_the_conditions_of_a_cusp_are_derivatives_of_the_determinant():
    """At any twists: the determinant of the Jacobian, and how it changes along the direction that is lost."""
    arm = kin.Robot.from_dh([(0.2, 0.3, 1.0, 0.8), (0.1, 0.4, 0.7, -1.1), (0.3, 0.2, 0.6, 0.4)])
    step = 1e-6 * np.eye(3)
    for q in arm.random_q(np.random.default_rng(5), 10):
        J = kin.jacobian(arm, q)[:3]
        det, *along = _conditions(chain_of(arm), q[None, 1:])[0]
        assert det == pytest.approx(np.linalg.det(J))
        by = [(np.linalg.det(kin.jacobian(arm, q + d)[:3]) - np.linalg.det(J)) / 1e-6 for d in step]
        adjugate = np.linalg.det(J) * np.linalg.inv(J)
        assert np.linalg.norm(along) == pytest.approx(np.linalg.norm(by @ adjugate), rel=1e-4)


def test_an_arm_with_a_spherical_wrist_is_judged_by_its_first_three_joints():
    border = four_equal_roots(2.0, 1.0)
    assert kin.cuspidal(orthogonal(2.0, 0.9 * border, 1.0, wrist=True)).evidence == "no cusps"
    arm = orthogonal(2.0, 1.3, 1.0, wrist=True)
    check_loop(arm, kin.cuspidal(arm))


def check_loop(robot: kin.Robot, found: kin.postures.Cuspidality, locked: tuple[int, ...] = ()) -> None:
    """The tool comes back, the posture is another one, and no sample is nearer to a singularity than was said."""
    assert found.verdict == "yes", found.reason
    q = np.concatenate([np.linspace(a, b, 1500) for a, b in pairwise(found.loop)])
    start, end = kin.fk(robot, q[0]), kin.fk(robot, q[-1])
    assert np.allclose(start[:3, 3], end[:3, 3], atol=1e-8)
    if robot.n - len(locked) == 6:
        assert np.allclose(start, end, atol=1e-8)
    if natural_task(robot) == "approach":
        assert np.allclose(start[:3, 2], end[:3, 2], atol=1e-8)
    assert apart(q[0], q[-1], robot.revolute) > 0.05
    assert np.array_equal(found.in_limits, robot.in_limits(q, 1e-9).all())
    J = np.delete(task_jacobian(robot, q) if not locked else kin.jacobian(robot, q), locked, axis=-1)
    sigma = np.linalg.svd(weight(robot, J.shape[-2])[:, None] * J, compute_uv=False)[:, -1]
    assert sigma.min() >= 0.9 * found.least if locked else sigma.min() >= found.least
    assert found.least > 0.0


@pytest.mark.parametrize("name", CUSPIDAL)
def test_cuspidal_arms_have_a_loop_inside_their_limits(name):
    robot = kin.get_robot(name)
    found = kin.cuspidal(robot)
    check_loop(robot, found)
    assert found.in_limits
    assert "inside its limits" in found.reason
    assert np.array_equal(found.loop, kin.cuspidal(robot).loop), "the same seed"
    assert not np.array_equal(found.loop, kin.cuspidal(robot, seed=5).loop)


@pytest.mark.parametrize("name", ["ur5", "puma560", "stanford", "scara", "so100"])
def test_families_whose_postures_are_signs_are_not_cuspidal(name):
    found = kin.cuspidal(name)
    assert (found.verdict, found.evidence, found.poses) == ("no", "factors", 0)


def test_signs_prove_nothing_about_another_task():
    """With the tool beside axis 5 the signs are postures of the pose, but the task is a point and a direction."""
    tool = kin.pose_from_xyz_rpy([0.05, 0.03, 0.1], [0.5, 0.4, 0.0])
    robot = kin.get_robot("so100").with_mounted(tool)
    found = kin.cuspidal(robot)
    assert found.evidence == "loop"
    check_loop(robot, found)
    assert kin.cuspidal("so101", poses=1).evidence == "search"


@pytest.mark.parametrize("name", ["ur5", "puma560", "stanford"])
def test_no_loop_is_found_where_it_is_proved_that_there_is_none(name):
    robot = kin.get_robot(name)
    found = loops.search_loop(robot, 32, 1, True, np.empty((0, robot.n)), lambda part: None)
    assert (found.q, found.poses) == (None, 32)
    assert found.pairs > 20


@pytest.mark.parametrize("name", ["ur5", "puma560", "irb120", "stanford", "scara", "z1", "kr6", "so100"])
def test_the_named_postures_change_where_the_determinant_does(name):
    """On a random straight motion the posture changes as often as the determinant passes zero."""
    robot, rng = kin.get_robot(name), np.random.default_rng(3)
    for a, b in zip(robot.random_q(rng, 3), robot.random_q(rng, 3), strict=True):
        q = np.linspace(a, b, 1500)
        J = kin.jacobian(robot, q)
        sigma = np.linalg.svd(J, compute_uv=False)[:, -1]
        names = [kin.branch_of(robot, row) for row in q]
        for k in np.flatnonzero([one != other for one, other in pairwise(names)]):
            assert sigma[max(k - 2, 0) : k + 4].min() < 0.02 * sigma.max()


def test_a_locked_panda_follows_stage_by_stage():
    found = kin.cuspidal("panda", locked={"joint 7": 0.8})
    assert (found.verdict, found.evidence) == ("no", "stages")
    assert is_staged(chain_of(kin.get_robot("puma560")))
    assert chain_of(kin.get_robot("gofa")) is None


def test_the_loop_of_an_arm_with_a_locked_joint_keeps_it():
    robot = kin.get_robot("sawyer")
    found = kin.cuspidal(robot, locked=[None] * 6 + [0.4])
    assert (found.loop[:, 6] == 0.4).all()
    check_loop(robot, found, locked=(6,))


@pytest.mark.parametrize(("name", "joint"), [("gofa", 0), ("jaco2", 0), ("jaco2", 3)])
def test_given_limits_hold_for_the_loop(name, joint):
    """Joints 1 and 4 of the Jaco 2 have none of their own."""
    limits = [None] * 6
    limits[joint] = (-0.2, 0.2)
    found = kin.cuspidal(name, limits=limits)
    assert found.in_limits
    assert (np.abs(found.loop[:, joint]) <= 0.2 + 1e-9).all()


@pytest.mark.parametrize("name", ["ur5", "gofa", "stanford", "cylindrical", "pioneer5", "prr", "rrp"])
def test_the_jacobian_changes_no_faster_than_its_bound(name):
    robot, rng = kin.get_robot(name), np.random.default_rng(4)
    for a, b in zip(robot.random_q(rng, 20), robot.random_q(rng, 20), strict=True):
        steep, s = loops.steepness(robot, a, b), np.linspace(0.0, 1.0, 200)[:, None]
        J = loops.smallest(robot, a + s * (b - a))
        assert np.abs(np.diff(J)).max() * 199.0 <= steep
        if natural_task(robot) != "approach":  # its rows turn with the tool, which leaves the singular values
            rows = task_jacobian(robot, a + s * (b - a))
            change = np.diff(weight(robot, rows.shape[-2])[:, None] * rows, axis=0) * 199.0
            assert np.linalg.norm(change, ord=2, axis=(1, 2)).max() <= steep


def test_a_motion_through_a_singularity_is_not_verified():
    robot = kin.get_robot("ur5")
    a = np.array([0.3, -1.0, 1.2, -0.5, 1.0, 0.2])
    other_elbow = a * [1.0, 1.0, -1.0, 1.0, 1.0, 1.0]
    assert loops.verified(robot, a, a + 0.05) > 0.0
    assert loops.verified(robot, a, other_elbow) == 0.0
    touching = np.array([0.3, -1.0, 0.0, -0.5, 1.0, 0.2])
    assert loops.verified(robot, a, touching) == 0.0


def test_none_found_says_how_far_was_looked():
    found = kin.cuspidal("rpp", poses=40)
    assert (found.verdict, found.evidence, found.poses, found.loop) == ("none found", "search", 80, None)
    assert "does not prove a no" in found.reason


def test_the_search_solves_no_more_random_poses_than_asked_for():
    """Configurations around cusps, which are tried first, are none of them."""
    robot = kin.get_robot("ur5")
    near = robot.random_q(np.random.default_rng(7), 3)
    for poses in (1, 5, 33):
        found = loops.search_loop(robot, poses, 1, False, near, lambda part: None)
        assert (found.q, found.poses) == (None, poses)
        assert found.pairs <= poses * 12  # eight postures: four of either sign


def test_a_search_reports_its_progress_and_can_be_cancelled():
    seen: list[float] = []
    kin.cuspidal("rpp", poses=64, progress=seen.append)
    assert seen == sorted(seen)
    assert (seen[0], seen[-1] < 1.0) == (0.0, True)

    class EnoughError(Exception):
        pass

    def cancel() -> None:
        raise EnoughError

    with pytest.raises(EnoughError):
        kin.cuspidal("gofa", cancel=cancel)


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (partial(kin.cuspidal, "panda"), "robot"),
        (partial(kin.cuspidal, "palletiser"), "robot"),
        (partial(kin.cuspidal, "planar2r"), "robot"),
        (partial(kin.cuspidal, "gofa", poses=0), "poses"),
        (partial(kin.cuspidal, "gofa", poses=True), "poses"),
        (partial(kin.cuspidal, "gofa", seed=-1), "seed"),
        (partial(kin.cuspidal, "panda", locked=[None] * 6 + [9.0]), "locked[6]"),
    ],
)
def test_bad_input_names_the_argument(call, field):
    with pytest.raises(kin.InputError) as caught:
        call()
    assert caught.value.field == field


def test_lengths_count_as_shares_of_the_size():
    """An arm at twice the size has the same bounds."""
    small = orthogonal(2.0, 1.3, 1.0)
    rows = [(r.theta, 2.0 * r.d, 2.0 * r.a, r.alpha) for r in small.rows]
    large = kin.Robot.from_dh(rows)
    assert size(large) == pytest.approx(2.0 * size(small))
    a, b = np.array([0.1, 0.9, 0.4]), np.array([0.3, 1.2, 0.8])
    assert loops.verified(large, a, b) == pytest.approx(loops.verified(small, a, b))
