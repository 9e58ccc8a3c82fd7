"""An arm a thousand times smaller or larger has the same answers: angles, counts and completeness.

The arms are those of the library with all lengths scaled; their targets are scaled with them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kin
from kin.robot import NominalTable
from kin.solvers import closed_form_of
from kin.solvers.scaled import Scaled, in_unit, unit_of

# One arm of each family.
FEW = ("pioneer5", "redundant7", "panda", "ur5", "stanford", "gp8", "so101", "scara", "gen3", "rpp", "crx10ia")
SCALES = (1e-3, 1e3)


def scaled(robot, by):
    """The arm with every length times a factor."""

    def row(joint):
        limits = joint.limits
        if joint.kind == "prismatic" and limits is not None:
            limits = (limits[0] * by, limits[1] * by)
        return replace(joint, d=joint.d * by, a=joint.a * by, limits=limits)

    def pose(T):
        T = np.array(T)
        T[:3, 3] *= by
        return tuple(map(tuple, T.tolist()))

    home = np.where(robot.revolute, 1.0, by) * robot.home
    return replace(
        robot,
        id=f"{robot.id}-{by}",
        rows=tuple(map(row, robot.rows)),
        home=tuple(home.tolist()),
        base=pose(robot.base),
        tool=pose(robot.tool),
        capsules=(),
        floor=None,
    )


def known(result):
    """What is the same. Solutions without names are numbered as roots, in an order that rounding decides."""
    names = [s.branch if " · " in s.branch else "" for s in result.solutions]
    return result.status, result.cause, result.completeness, names


def check_scaled(name, by, count):
    """Random targets, seeds and tasks: within reach, and far out of it."""
    robot = kin.get_robot(name)
    other, factors = scaled(robot, by), np.where(robot.revolute, 1.0, by)
    rng = np.random.default_rng(2)
    for q, seed in zip(robot.random_q(rng, count), robot.random_q(rng, count), strict=True):
        T = kin.fk(robot, q)
        small = T.copy()
        small[:3, 3] *= by
        a, b = kin.solve_ik(robot, T, q_seed=seed), kin.solve_ik(other, small, q_seed=seed * factors)
        assert known(a) == known(b)
        for one, two in zip(a.solutions, b.solutions, strict=True):
            # The nearest value of a redundancy parameter is that of a flat minimum.
            np.testing.assert_allclose(two.q / factors, one.q, atol=2e-5 if one.redundancy else 2e-6)
            assert two.position_error <= 1e-9 * by
        assert [r.name for r in a.redundancy] == [r.name for r in b.redundancy]
        assert [len(r.intervals) for r in a.redundancy] == [len(r.intervals) for r in b.redundancy]


@pytest.mark.parametrize("by", SCALES)
@pytest.mark.parametrize("name", FEW)
def test_a_scaled_arm_has_the_same_answers(name, by):
    check_scaled(name, by, 4)


@pytest.mark.slow
@pytest.mark.parametrize("by", SCALES)
@pytest.mark.parametrize("name", kin.builtin_robots())
def test_every_scaled_arm_has_the_same_answers(name, by):
    check_scaled(name, by, 100)


@pytest.mark.parametrize("by", SCALES)
def test_batches_and_what_is_out_of_reach_are_the_same(by):
    robot = kin.get_robot("iiwa14")
    other = scaled(robot, by)
    T = kin.fk(robot, robot.random_q(np.random.default_rng(3), 20))
    small = T.copy()
    small[:, :3, 3] *= by
    np.testing.assert_allclose(kin.solve_ik_many(other, small).q, kin.solve_ik_many(robot, T).q, atol=1e-9)
    T[0, :3, 3] *= 5.0
    small[0, :3, 3] *= 5.0
    a, b = kin.solve_ik(robot, T[0]), kin.solve_ik(other, small[0])
    assert (a.status, a.cause) == (b.status, b.cause)
    assert b.distance == pytest.approx(a.distance * by, rel=1e-6)


def test_arms_of_ordinary_size_are_solved_in_metres():
    assert {unit_of(kin.get_robot(name)) for name in kin.builtin_robots()} == {1.0}
    assert not any(isinstance(closed_form_of(kin.get_robot(name)), Scaled) for name in FEW)
    form = closed_form_of(scaled(kin.get_robot("ur5"), 1e-3))
    assert isinstance(form, Scaled)
    assert np.log2(form.unit) == round(np.log2(form.unit))  # so that no length is rounded


def test_the_nominal_table_of_an_arm_is_in_its_unit():
    small = scaled(kin.get_robot("panda"), 1e-3)
    made = replace(small, nominal=NominalTable(small.rows, small.tool))
    there = in_unit(made, unit_of(made))
    assert there.nominal_arm.rows == there.rows
    assert there.nominal_arm.tool == there.tool
