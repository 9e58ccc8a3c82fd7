"""Values on the pendant: what they are, what a robot file states of them, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kin
from kin import InputError, RobotFileError
from kin.motors import Shown
from kin.motors.pendant import shown_limits
from kin.solvers.reduced import fixed

FLIP = """
id = "flip"
name = "Flip"
source = "made up for this test"
convention = "standard"
units = { length = "mm", angle = "deg" }
pendant = { elbow = { shoulder = 1, elbow = "-1/2", offset = 90 }, lift = { lift = 2, offset = 10 } }

[[rows]]
name = "shoulder"
a = 300
sign = -1
limits = [-90, 45]

[[rows]]
name = "elbow"
a = 200
limits = [-100, 100]

[[rows]]
name = "lift"
kind = "prismatic"
limits = [0, 100]
"""


def test_a_file_states_a_linear_map_of_the_joint_values(tmp_path):
    robot = kin.load_robot(FLIP)
    shown = kin.motors.to_pendant(robot, [0.2, 0.4, 0.03])
    assert shown == pytest.approx([-0.2, 0.2 - 0.2 + np.pi / 2, 0.07], abs=1e-15)
    assert kin.motors.from_pendant(robot, shown) == pytest.approx([0.2, 0.4, 0.03], abs=1e-15)
    q = robot.random_q(np.random.default_rng(1), (3, 4))
    assert kin.motors.from_pendant(robot, kin.motors.to_pendant(robot, q)) == pytest.approx(q, abs=1e-15)
    limits = shown_limits(robot, np.array([0.2, 0.4, 0.03]))
    assert limits[0] == pytest.approx(np.radians([-45, 90]))
    ends = [kin.motors.to_pendant(robot, [0.2, end, 0.03])[1] for end in robot.joints[1].limits]
    assert limits[1] == pytest.approx(sorted(ends)), "other joints move them"
    assert limits[2] == pytest.approx((0.01, 0.21))
    assert shown_limits(kin.get_robot("ur5"), np.zeros(6))[0] == kin.get_robot("ur5").joints[0].limits
    kin.save_robot(robot, tmp_path / "again.toml")
    assert kin.load_robot(tmp_path / "again.toml").pendant == robot.pendant
    assert np.array_equal(kin.fk(robot, q), kin.fk(replace(robot, pendant=()), q)), "no pose depends on it"


def test_an_arm_without_a_pendant_shows_its_joint_values():
    q = kin.get_robot("ur5").q_home
    assert kin.motors.to_pendant("ur5", q) is kin.motors.from_pendant("ur5", q) or np.array_equal(
        kin.motors.to_pendant("ur5", q), q
    )
    assert kin.get_robot("ur5").pendant_map is None


@pytest.mark.parametrize("name", ["lrmate200id", "crx10ia"])
def test_fanucs_j3_counts_from_the_horizontal(name):
    """With J3 = 0 on the pendant the axis of the forearm is level, however far J2 leans; 90 points up."""
    robot = kin.get_robot(name)
    for j2 in (-40.0, 0.0, 35.0):
        for j3, height in ((0.0, 0.0), (90.0, 1.0), (30.0, 0.5)):
            q = kin.motors.from_pendant(robot, np.radians([20.0, j2, j3, 0.0, 0.0, 0.0]))
            axis = kin.link_frames(robot, q)[2][:3, 2]
            assert abs(axis[2]) == pytest.approx(height, abs=1e-9)
    assert kin.motors.to_pendant(robot, np.zeros(6)).tolist() == [0.0] * 6


@pytest.mark.parametrize(
    ("old", "new", "field", "valid"),
    [
        ("sign = -1", "sign = 2", "rows[0].sign", "1, or -1"),
        ("sign = -1", "sign = true", "rows[0].sign", "1, or -1"),
        ('name = "elbow"', 'name = "elbow"\nsign = -1', "rows[1].sign", "because pendant.elbow says"),
        ("elbow = { shoulder", "albow = { shoulder", "pendant.albow", "shoulder, elbow, lift"),
        ("{ shoulder = 1", "{ neck = 1", "pendant.elbow.neck", "only the fields"),
        ("{ shoulder = 1", '{ shoulder = "one"', "pendant.elbow.shoulder", "a number"),
        ("{ shoulder = 1", "{ lift = 1", "pendant.elbow", "revolute too"),
        ('elbow = "-1/2"', "elbow = 0", "pendant.shoulder", "all joint values follow"),
        ("{ lift = 2, offset = 10 }", "3", "pendant.lift", "a table of joints"),
        ("offset = 90", 'offset = "far"', "pendant.elbow.offset", "a finite number"),
    ],
)
def test_what_is_wrong_is_named(old, new, field, valid):
    assert old in FLIP
    with pytest.raises(RobotFileError, match=valid) as caught:
        kin.load_robot(FLIP.replace(old, new))
    assert caught.value.field == field


def test_in_python_it_is_checked_too_and_an_arm_made_of_another_may_keep_it():
    robot = kin.load_robot(FLIP)
    with pytest.raises(InputError, match="pairs of a name and a number"):
        Shown("elbow", (("elbow",),))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="each joint once"):
        replace(robot, pendant=(Shown("lift", (("lift", 1.0),)),) * 2)
    with pytest.raises(InputError, match="a Shown"):
        replace(robot, pendant=({"lift": 1},))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="3 joint values"):
        kin.motors.from_pendant(robot, [0.0, 0.0])
    rest = fixed(robot, {1: 0.3})
    assert kin.motors.to_pendant(rest, [0.2, 0.03]) == pytest.approx([-0.2, 0.07])
    assert "elbow" not in kin.robot_to_dict(rest)["pendant"]


def test_a_program_may_have_joint_values_as_on_the_pendant():
    robot = kin.load_robot(FLIP)
    text = """
units = { length = "mm", angle = "deg" }
pendant = true
[[segments]]
kind = "ptp"
q = [20, 100, 70]
"""
    (segment,) = kin.motion.parse_program(text, robot).segments
    assert segment.target.q == pytest.approx(
        kin.motors.from_pendant(robot, [*np.radians([20, 100]), 0.07]), abs=1e-15
    )
    (plain,) = kin.motion.parse_program(text.replace("true", "false"), robot).segments
    assert plain.target.q == pytest.approx([*np.radians([20, 100]), 0.07])
    for given, arm, valid in (("true", None, "a robot as well"), ('"yes"', robot, "true or false")):
        with pytest.raises(InputError, match=valid) as caught:
            kin.motion.parse_program(text.replace("true", given), arm)
        assert caught.value.field == "pendant"
