"""A calibrated arm is one like any other: files, tools, collisions, names of postures."""

from dataclasses import replace

import numpy as np
import pytest

import kin
from kin.calibration.chain import Chain
from kin.collision.bodies import bodies_of
from kin.robot import NominalTable
from kin.solvers import closed_form_of
from tests.kin.calibration.simulated import random_errors


def calibrated(name, seed=1):
    robot = kin.get_robot(name)
    chain = Chain(robot)
    made = chain.robot_with(random_errors(chain, np.random.default_rng(seed)))
    return robot, replace(made, nominal=NominalTable(robot.rows, robot.tool))


# Of seven joints, the general solver is compiled for minutes on a new machine.
@pytest.fixture(params=["ur5e", pytest.param("panda", marks=pytest.mark.full), "so101", "pioneer5"])
def arms(request):
    return calibrated(request.param)


def test_it_is_written_and_read(arms):
    _, made = arms
    for length, angle in (("mm", "deg"), ("m", "rad")):
        data = kin.robot_to_dict(made, length, angle)
        assert kin.robot_from_dict(data) == replace(made, units=length)
        assert kin.robot_from_dict(data).nominal_arm is not None


def test_links_that_are_compared_are_those_of_the_nominal_arm(arms):
    robot, made = arms
    own, nominal = bodies_of(made), bodies_of(robot)
    assert np.array_equal(own.pairs, nominal.pairs)
    assert [each.link for each in own.capsules] == [each.link for each in nominal.capsules]
    q = robot.random_q(np.random.default_rng(2), 200)
    assert np.abs(kin.clearance(made, q) - kin.clearance(robot, q)).max() < 0.06


def test_a_calibrated_panda_does_not_compare_a_pair_more():
    robot, made = calibrated("panda")
    plain = replace(made, nominal=None)
    q = robot.random_q(np.random.default_rng(3), 300)
    with_nominal = np.abs(kin.clearance(made, q) - kin.clearance(robot, q)).max()
    assert with_nominal < 0.06
    assert len(bodies_of(made).pairs) == len(bodies_of(robot).pairs)
    assert plain.nominal_arm is None


def test_postures_have_the_names_of_the_nominal_arm(arms):
    robot, made = arms
    assert kin.branch_names(robot)
    assert set(kin.branch_names(made)) == set(kin.branch_names(robot))
    assert kin.ik.branch_meanings(made) == kin.ik.branch_meanings(robot)
    task = "pose" if robot.n > 5 else "approach"
    for q in robot.random_q(np.random.default_rng(4), 4):
        answer = kin.solve_ik(made, kin.fk(made, q), task=task, q_seed=q)
        assert answer.status == "solved"
        best = answer.solutions[0]
        assert np.abs(best.q - q).max() < 1e-6
        assert {each.branch for each in answer.solutions} <= set(kin.branch_names(robot))
        assert best.branch == kin.branch_of(robot, q) == kin.branch_of(made, q)
        only = kin.solve_ik(made, kin.fk(made, q), task=task, q_seed=q, branch=best.branch)
        assert {each.branch for each in only.solutions} == {best.branch}


@pytest.mark.full
def test_all_values_of_a_calibrated_panda_are_agreed():
    """Few values of joint 1 and the nominal arm lead to all that 400 values of joint 7 have."""
    robot, made = calibrated("panda")
    form = closed_form_of(made)
    assert (form.given, form.sweeper.given) == (6, 0)
    values = np.linspace(made.lower[6], made.upper[6], 402)[1:-1]
    for q in robot.random_q(np.random.default_rng(6), 12):
        T = kin.fk(made, q)
        result = kin.solve_ik(made, T)
        rows = np.empty((len(values), len(form.branches), 7))
        form.kernels.many(form.kernels.params, np.tile(T, (len(values), 1, 1)), values, q, rows)
        inside = ((rows - made.lower) % (2.0 * np.pi) <= made.upper - made.lower).all(axis=2)
        (parameter,) = result.redundancy
        claimed = [any(low <= value <= high for low, high in parameter.intervals) for value in values]
        assert (result.completeness, parameter.name) == ("agreed", "theta7")
        assert np.array_equal(inside.any(axis=1), claimed)


def test_another_tool_is_one_of_the_nominal_arm_too():
    robot, made = calibrated("ur5e")
    tool = kin.pose_from_xyz_rpy([0.0, 0.02, 0.1], [0.3, 0.0, 0.0])
    with_tool, nominal = made.with_mounted(tool), robot.with_mounted(tool)
    assert np.abs(np.subtract(with_tool.nominal.tool, nominal.tool)).max() < 1e-12
    assert np.abs(with_tool.T_last_tool - made.T_last_tool @ tool).max() < 1e-12


def test_the_other_convention_has_its_nominal_table_too():
    robot, made = calibrated("ur5e")
    other = kin.dh.convert_dh(made, "modified")
    assert other.nominal_arm is not None
    assert other.nominal.rows == kin.dh.convert_dh(robot, "modified").rows
    assert set(kin.branch_names(other)) == set(kin.branch_names(robot))
    q = robot.random_q(np.random.default_rng(5), 20)
    assert np.abs(kin.fk_positions(other.nominal_arm, q) - kin.fk_positions(robot, q)).max() < 1e-12


def test_a_table_with_other_rows_is_no_longer_the_calibrated_one():
    _, made = calibrated("ur5e")
    rows = tuple(replace(row, name="other") if row.name == made.joints[2].name else row for row in made.rows)
    assert replace(made, rows=rows).nominal_arm is None
    data = kin.robot_to_dict(made)
    data["nominal"]["rows"].pop()
    with pytest.raises(kin.RobotFileError, match=r"nominal\.rows: .*the rows that move"):
        kin.robot_from_dict(data)
    data["nominal"]["rows"][0]["theta"] = "x"
    with pytest.raises(kin.RobotFileError, match=r"nominal\.rows\[0\]\.theta"):
        kin.robot_from_dict(data)
