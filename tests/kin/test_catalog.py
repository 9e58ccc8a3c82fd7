"""Robot files: what they mean, and the errors for invalid ones."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from arms import CHAPTER_ARMS

import kin
from kin import RobotFileError, UnknownRobotError
from kin.catalog import BUILTIN

GOOD = """
id = "bench"
name = "Bench arm"
source = "made up"
convention = "standard"
units = { length = "mm", angle = "deg" }
base = { xyz = [0, 0, 500], rpy = [0, 0, 90] }
tool = { xyz = [0, 0, 40] }

[[rows]]
name = "turn"
d = 100
a = 50
alpha = -90
limits = [-90, 180]

[[rows]]
name = "slide"
kind = "prismatic"
d = 10
limits = [0, 250]

[[rows]]
name = "flange"
kind = "fixed"
theta = 90

[home]
q = [45, 125]
"""


def test_a_file_names_its_units():
    robot = kin.parse_robot(GOOD)
    assert robot.n == 2
    assert robot.rows[0].alpha == pytest.approx(-math.pi / 2)
    assert robot.lower == pytest.approx([-math.pi / 2, 0])
    assert robot.upper == pytest.approx([math.pi, 0.25])
    assert robot.home == pytest.approx((math.pi / 4, 0.125))
    assert [row.kind for row in robot.rows] == ["revolute", "prismatic", "fixed"]
    assert kin.fk(robot, [0, 0])[:3, 3] == pytest.approx([-0.05, 0.05, 0.6], abs=1e-12)


def test_metres_and_radians():
    text = GOOD.replace('length = "mm", angle = "deg"', 'length = "cm", angle = "rad"')
    text = text.replace("[-90, 180]", "[-1.5, 3]").replace("q = [45, 125]", "q = [1, 125]")
    robot = kin.parse_robot(text)
    assert robot.rows[0].d == pytest.approx(1.0)
    assert robot.rows[0].alpha == -90
    assert robot.lower[0] == -1.5


def test_missing_limits_and_home_get_defaults():
    text = GOOD.replace("limits = [-90, 180]\n", "").replace("limits = [0, 250]\n", "").split("[home]")[0]
    robot = kin.parse_robot(text)
    assert robot.lower == pytest.approx([-math.pi, 0])
    assert robot.upper == pytest.approx([math.pi, 1])
    assert robot.in_limits(robot.q_home)


@pytest.mark.parametrize(
    ("old", "new", "field", "valid"),
    [
        ('id = "bench"', 'id = "Bench Arm"', "id", "lower-case"),
        ('id = "bench"', "", "id", "text"),
        ('name = "Bench arm"', "name = 5", "name", "text"),
        ('source = "made up"', 'source = ""', "source", "text"),
        ('"standard"', '"dh"', "convention", '"modified"'),
        ('length = "mm"', 'length = "inch"', "units.length", '"cm"'),
        ('angle = "deg"', "angle = 1", "units.angle", '"rad"'),
        ('units = {', 'unit = {', "unit", "units"),
        ("d = 100", 'd = "far"', "rows[0].d", "number"),
        ("d = 100", "d = nan", "rows[0].d", "finite"),
        ("d = 100", "d = inf", "rows[0].d", "finite"),
        ("d = 100", "d = true", "rows[0].d", "number"),
        ("d = 100", "dd = 100", "rows[0].dd", "alpha"),
        ("limits = [-90, 180]", "limits = [180, -90]", "rows[0].limits", "lower below upper"),
        ("limits = [-90, 180]", "limits = [1]", "rows[0].limits", "two numbers"),
        ("limits = [-90, 180]", "limits = [0, 'x']", "rows[0].limits[1]", "number"),
        ('kind = "fixed"', 'kind = "welded"', "rows[2].kind", '"prismatic"'),
        ('kind = "fixed"\n', 'kind = "fixed"\nlimits = [0, 1]\n', "rows[2].limits", "no limits"),
        ('name = "slide"', 'name = "turn"', "rows[].name", "different"),
        ("q = [45, 125]", "q = [45]", "home.q", "2 numbers"),
        ("q = [45, 125]", "q = [45, 300]", "home.q[1]", "limits of slide"),
        ("q = [45, 125]", "p = [45, 125]", "home.p", "q"),
        ("xyz = [0, 0, 40]", "xyz = [0, 0]", "tool.xyz", "three"),
        ("rpy = [0, 0, 90]", "rpy = [0, 0, 'a']", "base.rpy[2]", "number"),
        ("[[rows]]", "[[row]]", "row", "rows"),
        ('id = "bench"', 'id = "bench', "file", "TOML"),
    ],
)  # fmt: skip
def test_an_error_names_the_field_and_what_is_valid(old, new, field, valid, tmp_path):
    assert old in GOOD
    path = tmp_path / "arm.toml"
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(RobotFileError) as caught:
        kin.load_robot(path)
    assert caught.value.field == field
    assert valid in caught.value.expected
    assert str(path) in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(RobotFileError, match="readable"):
        kin.load_robot(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes('name = "Bär"'.encode("latin-1"))
    with pytest.raises(RobotFileError, match="UTF-8"):
        kin.load_robot(tmp_path / "latin.toml")


def test_a_byte_order_mark_is_accepted(tmp_path):
    (tmp_path / "arm.toml").write_text(GOOD, encoding="utf-8-sig")
    assert kin.load_robot(tmp_path / "arm.toml") == kin.parse_robot(GOOD)


@pytest.mark.parametrize("text", ["x = " + "9" * 5000, "x = " + "[" * 100_000], ids=["digits", "brackets"])
def test_endless_toml_is_rejected(text):
    with pytest.raises(RobotFileError, match="valid TOML") as caught:
        kin.parse_robot(text, "arm.toml")
    assert len(str(caught.value)) < 300


def test_the_number_of_rows_is_limited():
    head = GOOD.split("[[rows]]")[0]
    for text in (head, head + "rows = []", head + '[[rows]]\nkind = "fixed"', head + "[[rows]]\nname='%d'\n" * 40):
        with pytest.raises(RobotFileError) as caught:
            kin.parse_robot(text)
        assert caught.value.field in ("rows", "file")


def test_two_files_with_the_same_id(tmp_path):
    for name in ("a.toml", "b.toml"):
        (tmp_path / name).write_text(GOOD, encoding="utf-8")
    with pytest.raises(RobotFileError, match="no other file"):
        kin.load_folder(tmp_path)


def test_built_in_files_are_named_after_their_robots():
    ids = list(kin.builtin_robots())
    assert sorted(path.stem for path in BUILTIN.glob("*.toml")) == sorted(ids)
    assert ids[:3] == list(CHAPTER_ARMS)  # these come first in every list
    assert ids[3:] == sorted(ids[3:])
    for robot in kin.builtin_robots().values():
        assert robot.in_limits(robot.q_home)
        assert robot.source
        assert robot.description
    with pytest.raises(UnknownRobotError, match="pioneer5"):
        kin.get_robot("puma")


def test_robots_are_values():
    robot = kin.get_robot("pioneer5")
    same = replace(robot)
    assert same == robot
    assert hash(same) == hash(robot)
    assert replace(robot, name="other") != robot
    with pytest.raises(FrozenInstanceError):
        robot.name = "other"
    for array in (robot.lower, robot.upper, robot.q_home, robot.model, robot.T_world_base, robot.revolute):
        assert not array.flags.writeable


def test_random_configurations_are_inside_the_limits():
    robot = kin.get_robot("pioneer5")
    q = robot.random_q(np.random.default_rng(0), (10, 100))
    assert q.shape == (10, 100, 5)
    assert robot.in_limits(q).all()
    assert robot.in_limits(robot.clip(q + 10)).all()
    assert not robot.in_limits(q + 10).any()


def test_reach_bounds_every_pose_and_is_infinite_without_limits():
    for robot in (*kin.builtin_robots().values(), kin.parse_robot(GOOD)):
        q = robot.random_q(np.random.default_rng(1), 5000)
        origin = robot.T_world_base[:3, 3]
        assert np.linalg.norm(kin.fk(robot, q)[:, :3, 3] - origin, axis=-1).max() <= robot.reach
    slide = kin.Joint("slide", kind="prismatic", limits=None)
    assert replace(kin.parse_robot(GOOD), rows=(slide,), home=(0.0,)).reach == math.inf
