"""Robot files: what they mean, and the errors for invalid ones."""

from __future__ import annotations

import json
import math
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest
from arms import CHAPTER_ARMS, Draw
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin import InputError, Joint, Robot, RobotFileError, UnknownRobotError
from kin.files.builtin import BUILTIN
from kin.files.write import rpy_of
from kin.frames import matrix_of

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
    robot = kin.load_robot(GOOD)
    assert robot.n == 2
    assert robot.rows[0].alpha == pytest.approx(-math.pi / 2)
    assert robot.lower == pytest.approx([-math.pi / 2, 0])
    assert robot.upper == pytest.approx([math.pi, 0.25])
    assert robot.home == pytest.approx((math.pi / 4, 0.125))
    assert [row.kind for row in robot.rows] == ["revolute", "prismatic", "fixed"]
    assert kin.fk(robot, [0, 0])[:3, 3] == pytest.approx([-0.05, 0.05, 0.6], abs=1e-12)


@pytest.mark.parametrize("mounting", kin.robot.MOUNTINGS)
def test_mounting_and_floor_are_read_written_and_change_no_pose(mounting, tmp_path):
    robot = kin.load_robot(f'mounting = "{mounting}"\nfloor = -120.7\n{GOOD}')
    assert (robot.mounting, robot.floor) == (mounting, -0.1207)
    kin.save_robot(robot, tmp_path / "bench.toml")
    assert kin.load_robot(tmp_path / "bench.toml") == robot
    assert kin.robot_from_dict(kin.robot_to_dict(robot)) == robot
    plain = kin.load_robot(GOOD)
    assert (plain.mounting, plain.floor) == (None, None)
    assert plain != robot
    assert np.array_equal(kin.fk(plain, plain.q_home), kin.fk(robot, plain.q_home))
    assert kin.load_robot(f'floor = "-0.5 m"\n{GOOD}').floor == -0.5


@pytest.mark.parametrize(
    ("field", "value", "valid"),
    [
        ("mounting", "sky", '"wall", "ceiling", or None if it is not stated'),
        ("mounting", 3, "or None"),
        ("floor", math.nan, "finite"),
        ("floor", "low", "finite"),
        ("floor", True, "finite"),
    ],
)
def test_a_mounting_or_a_floor_that_is_none_is_named(field, value, valid):
    with pytest.raises(InputError, match=valid) as caught:
        replace(kin.load_robot(GOOD), **{field: value})
    assert caught.value.field == field


def test_metres_and_radians():
    text = GOOD.replace('length = "mm", angle = "deg"', 'length = "cm", angle = "rad"')
    text = text.replace("[-90, 180]", "[-1.5, 3]").replace("q = [45, 125]", "q = [1, 125]")
    robot = kin.load_robot(text)
    assert robot.rows[0].d == pytest.approx(1.0)
    assert robot.rows[0].alpha == -90
    assert robot.lower[0] == -1.5


def test_missing_limits_and_home_get_defaults():
    text = GOOD.replace("limits = [-90, 180]\n", "").replace("limits = [0, 250]\n", "").split("[home]")[0]
    robot = kin.load_robot(text)
    assert robot.lower == pytest.approx([-math.pi, 0])
    assert robot.upper == pytest.approx([math.pi, 1])
    assert robot.in_limits(robot.q_home)


@pytest.mark.full
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
        ("units = {", "unit = {", "unit", "units"),
        ('units = { length = "mm", angle = "deg" }', "", "units", 'length ("m", "cm" or "mm") and angle'),
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
)
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
    assert kin.load_robot(tmp_path / "arm.toml") == kin.load_robot(GOOD)


@pytest.mark.parametrize(
    ("text", "valid"),
    [("x = " + "9" * 5000, "valid TOML"), ("x = " + "[" * 100_000, "at most 20000 values")],
    ids=["digits", "brackets"],
)
def test_endless_toml_is_rejected(text, valid):
    with pytest.raises(RobotFileError, match=valid) as caught:
        kin.files.parse_robot(text, "arm.toml")
    assert len(str(caught.value)) < 300


def test_the_number_of_rows_is_limited():
    head = GOOD.split("[[rows]]")[0]
    for text in (head, head + "rows = []", head + '[[rows]]\nkind = "fixed"', head + "[[rows]]\nname='%d'\n" * 40):
        with pytest.raises(RobotFileError) as caught:
            kin.load_robot(text)
        assert caught.value.field in ("rows", "file")


def test_two_files_with_the_same_id(tmp_path):
    for name in ("a.toml", "b.toml"):
        (tmp_path / name).write_text(GOOD, encoding="utf-8")
    with pytest.raises(RobotFileError, match="no other file"):
        kin.files.load_robots(tmp_path)


def test_built_in_files_are_named_after_their_robots():
    ids = list(kin.files.classic_robots())
    assert sorted(path.stem for path in BUILTIN.glob("*.toml")) == sorted(ids)
    assert ids[:3] == list(CHAPTER_ARMS)  # these come first in every list
    assert ids[3:] == sorted(ids[3:])
    for robot in kin.files.classic_robots().values():
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
    still = replace(robot, rows=(kin.Joint("a", limits=(0.0, -0.0)),), home=(0.0,))
    assert still.random_q(np.random.default_rng(0)).tolist() == [0.0]


def test_reach_bounds_every_pose_and_is_infinite_without_limits():
    for robot in (*kin.files.classic_robots().values(), kin.load_robot(GOOD)):
        q = robot.random_q(np.random.default_rng(1), 5000)
        origin = robot.T_world_base[:3, 3]
        assert np.linalg.norm(kin.fk(robot, q)[:, :3, 3] - origin, axis=-1).max() <= robot.reach
    slide = kin.Joint("slide", kind="prismatic", limits=None)
    assert replace(kin.load_robot(GOOD), rows=(slide,), home=(0.0,)).reach == math.inf


# -- plain data and writing ------------------------------------------------------------------------------------


def read_again(robot, **units):
    """The robot after a journey through a dict, JSON and a dict, and through TOML."""
    by_json = kin.robot_from_dict(json.loads(json.dumps(kin.robot_to_dict(robot, **units), allow_nan=False)))
    by_toml = kin.load_robot(kin.robot_to_toml(robot, **units))
    assert by_json == by_toml
    return by_json


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_writing_and_reading_gives_an_equal_robot(robot, tmp_path):
    assert read_again(robot) == robot
    kin.save_robot(robot, tmp_path / "arm.toml")
    assert kin.load_robot(tmp_path / "arm.toml") == robot
    for length in ("m", "cm", "mm"):
        for angle in ("deg", "rad"):
            assert read_again(robot, length=length, angle=angle) == replace(robot, units=length)


SLIDE, LINK = Joint("slide", kind="prismatic"), Joint("link", a=1.0, limits=(-1, 1))


@pytest.mark.parametrize(
    ("change", "field", "valid"),
    [
        ({"rows": (SLIDE,)}, "rows[0].limits", "two numbers"),
        ({"rows": (replace(LINK, limits=(0, 0)),)}, "rows[0].limits", "lower below upper"),
        ({"rows": (LINK, LINK), "home": (0, 0)}, "rows[].name", "different"),
        ({"rows": (replace(LINK, name=" link"),)}, "rows[0].name", "without spaces at its ends"),
        ({"rows": (replace(LINK, name="\udc80"),)}, "rows[0].name", "surrogates"),
        ({"rows": (replace(LINK, a=2e5),)}, "rows", "100000 m"),
        ({"rows": (replace(LINK, effort=1e7),)}, "rows[0].effort", "million"),
        ({"home": (2.0,)}, "home.q[0]", "limits of link"),
        ({"id": "My Arm"}, "id", "lower-case"),
        ({"name": "My arm "}, "name", "without spaces at its ends"),
        ({"source": ""}, "source", "text of 1"),
        ({"description": "\n"}, "description", "without spaces at its ends"),
        ({"base": matrix_of((1e5, 0, 0), (0, 0, 0))}, "rows", "base"),
    ],
)
def test_what_cannot_be_read_is_not_written(change, field, valid, tmp_path):
    robot = Robot.from_dh([LINK])
    assert read_again(robot) == robot
    with pytest.raises(InputError) as caught:
        kin.save_robot(replace(robot, **change), tmp_path / "arm.toml")
    assert caught.value.field == field
    assert valid in caught.value.expected
    assert not (tmp_path / "arm.toml").exists()


@pytest.mark.parametrize("length", ["m", "cm", "mm"])
def test_long_arms_are_written_in_any_unit(length):
    robot = Robot.from_dh([{"d": 2000.0, "a": 9e4, "limits": (-1e5, 1e5)}])
    assert read_again(robot, length=length) == replace(robot, units=length)


def test_round_values_are_written_round():
    data = kin.robot_to_dict(kin.get_robot("puma560"), length="mm")
    assert data["rows"][0]["alpha"] == 90
    assert isinstance(data["rows"][0]["alpha"], int)
    assert data["rows"][1]["a"] == 431.8
    assert data["home"]["q"] == [0, 45, -180, 0, 45, 0]
    tilted = kin.robot_to_dict(kin.load_robot(GOOD))
    assert tilted["base"] == {"xyz": [0, 0, 500], "rpy": [0, 0, 90]}
    assert tilted["tool"] == {"xyz": [0, 0, 40], "rpy": [0, 0, 0]}
    # The shorter of degrees and radians.
    assert 'angle = "rad"' in kin.robot_to_toml(Robot.from_dh([{"alpha": 0.7, "limits": (-2.1, 2.9)}]))
    assert 'angle = "deg"' in kin.robot_to_toml(kin.get_robot("ur5"))


@pytest.mark.full
@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    length=st.sampled_from(["m", "cm", "mm"]),
    angle=st.sampled_from(["deg", "rad"]),
)
def test_any_robot_is_written_exactly(seed, length, angle):
    draw = Draw(seed)
    rng = draw.rng
    rows = []
    for i in range(int(rng.integers(1, 9))):
        kind = str(rng.choice(["revolute", "prismatic", "fixed"])) if i else "revolute"
        limits = None if kind == "fixed" else (float(rng.uniform(-3, 0)), float(rng.uniform(0.01, 3)))
        if kind == "revolute" and rng.random() < 0.2:
            limits = None
        extra = {} if kind == "fixed" or rng.random() < 0.5 else {"velocity": rng.uniform(0.1, 9), "effort": 12.5}
        numbers = (draw.angle(), draw.length() * 1e-3 ** rng.integers(0, 4), draw.length(), rng.normal())
        rows.append(Joint(f'part {i} “{chr(i)}\\\x7f"', *numbers, kind, limits, **extra))
    robot = Robot.from_dh(rows, str(rng.choice(["standard", "modified"])), base=draw.pose(), tool=draw.pose())
    home = tuple(float(v) for v in robot.clip(robot.random_q(rng)))
    robot = replace(robot, home=home, description="two\nlines")
    assert read_again(robot, length=length, angle=angle) == replace(robot, units=length)


def test_a_number_may_have_its_own_unit():
    text = GOOD.replace("d = 100", 'd = "0.1 m"').replace("alpha = -90", 'alpha = "-90°"')
    assert kin.load_robot(text) == kin.load_robot(GOOD)
    text = GOOD.replace("limits = [-90, 180]", 'limits = ["-1.5 rad", 180]\nvelocity = "2 rad/s"\neffort = 87')
    row = kin.load_robot(text).rows[0]
    assert (row.limits, row.velocity, row.effort) == ((-1.5, math.pi), 2.0, 87.0)


def test_joints_without_limits():
    robot = kin.load_robot(GOOD.replace("limits = [-90, 180]", 'limits = "none"'))
    assert robot.joints[0].limits is None
    assert robot.upper[0] == math.inf
    assert read_again(robot) == robot


def test_base_and_tool_as_matrices():
    matrix = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 500], [0, 0, 0, 1]]
    data = {**kin.robot_to_dict(kin.load_robot(GOOD)), "base": {"matrix": matrix}}
    assert kin.robot_from_dict(data).T_world_base[:3, 3] == pytest.approx([1e-3, 2e-3, 0.5])
    # A matrix typed with seven digits is made orthonormal, and stays as it is from then on.
    s = 0.7071068
    data["tool"] = {"matrix": [[s, -s, 0, 0], [s, s, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
    robot = kin.robot_from_dict(data)
    R = robot.T_last_tool[:3, :3]
    assert np.abs(R.T @ R - np.eye(3)).max() < 1e-15
    assert read_again(robot) == robot


@pytest.mark.parametrize(
    ("change", "field", "valid"),
    [
        ({"rows": [{"alpha": "ninety"}]}, "rows[0].alpha", "1.5 deg"),
        ({"rows": [{"alpha": "3 mm"}]}, "rows[0].alpha", "1.5 deg"),
        ({"rows": [{"alpha": "3 rad/s"}]}, "rows[0].alpha", "1.5 deg"),
        ({"rows": [{"a": math.nan}]}, "rows[0].a", "finite"),
        ({"rows": [{"a": 10**400}]}, "rows[0].a", "million metres"),
        ({"rows": [{"alpha": 1e6}]}, "rows[0].alpha", "million radians"),
        ({"rows": [{"a": "1e9 mm"}]}, "rows[0].a", "million metres"),
        ({"rows": [{"a": "0.13 m" + 80 * " " + "junk"}]}, "rows[0].a", "1.5 m"),
        ({"rows": [{"a": "1" * 40_000 + " m"}]}, "rows[0].a", "1.5 m"),
        ({1: 2}, "1", "only the fields"),
        ({"rows": [{None: 2}]}, "rows[0].None", "only the fields"),
        ({"\ud800": 2}, "'\\ud800'", "only the fields"),
        ({"name": "\ud800"}, "name", "surrogates"),
        ({"rows": [{"name": "a\udfff"}]}, "rows[0].name", "surrogates"),
        ({"rows": [{}, {"a": None}]}, "rows[1].a", "finite"),
        ({"rows": [{"a": 9e4}, {"a": 9e4}]}, "rows", "100000 m"),
        ({"rows": [{}], "base": {"xyz": [0, 0, 2e5]}}, "rows", "base and tool"),
        ({"rows": [7]}, "rows[0]", "table"),
        ({"rows": [{}] * 33}, "rows", "1 to 32"),
        ({"rows": [{"kind": "prismatic", "limits": "none"}]}, "rows[0].limits", "two numbers"),
        ({"rows": [{"limits": "free"}]}, "rows[0].limits", '"none"'),
        ({"rows": [{"velocity": 0}]}, "rows[0].velocity", "positive"),
        ({"rows": [{"effort": "5 m"}]}, "rows[0].effort", "finite"),
        ({"rows": [{}, {"kind": "fixed", "effort": 1}]}, "rows[1].effort", "fixed"),
        ({"base": {"matrix": [[1, 0], [0, 1]]}}, "base.matrix", "four rows"),
        ({"base": {"matrix": [[1, 0, 0, 0]] * 4}}, "base.matrix[3]", "last row"),
        ({"base": {"matrix": 1, "xyz": [0, 0, 0]}}, "base.xyz", "matrix"),
        ({"tool": {"matrix": np.diag([2, 1, 1, 1]).tolist()}}, "tool.matrix rotation", "orthonormal"),
    ],
)
def test_an_error_in_plain_data_names_the_field(change, field, valid):
    data = {"id": "a", "name": "A", "source": "test", "convention": "standard"}
    data |= {"units": {"length": "m", "angle": "rad"}, "rows": [{}]}
    assert kin.robot_from_dict(data).n == 1
    with pytest.raises(RobotFileError) as caught:
        kin.robot_from_dict({**data, **change}, "sent")
    assert caught.value.field == field
    assert valid in caught.value.expected
    assert str(caught.value).startswith("sent: ")


def test_only_tables_and_known_units_are_data():
    with pytest.raises(RobotFileError, match="a table with the fields"):
        kin.robot_from_dict([1])
    with pytest.raises(InputError, match="length"):
        kin.robot_to_dict(kin.get_robot("ur5"), length="inch")
    with pytest.raises(InputError, match="angle"):
        kin.robot_to_toml(kin.get_robot("ur5"), angle="grad")


def test_from_dh():
    rows = [(0, 0.4, 0.025, -math.pi / 2), {"a": 0.455, "limits": (-1, 0)}, {"kind": "prismatic", "name": "rail"}]
    robot = Robot.from_dh([*rows, Joint("flange", d=0.08, kind="fixed")], "modified")
    assert robot.home == (0.0, -0.5, 0.5)
    assert [row.name for row in robot.rows] == ["joint 1", "joint 2", "rail", "flange"]
    assert robot.joints[0].limits == (-math.pi, math.pi)
    assert Robot.from_dh([(0, 0, 1, 0)], tool=np.eye(4)).tool == kin.robot.IDENTITY
    with pytest.raises(InputError, match=r"rows\[1\]"):
        Robot.from_dh([(0, 0, 0, 0), (1, 2, 3)])
    with pytest.raises(InputError, match=r"rows\[0\]\.length"):
        Robot.from_dh([{"length": 1}])
    with pytest.raises(InputError, match="alpha of joint 1"):
        Robot.from_dh([(0, 0, 0, math.inf)])
    with pytest.raises(InputError, match="alpha of joint 1"):
        Robot.from_dh([(0, 0, 0, 10**400)])
    with pytest.raises(InputError, match="kind of joint 1"):
        Robot.from_dh([{"kind": []}])
    with pytest.raises(InputError, match="kind of a"):
        Joint("a", kind={})
    with pytest.raises(InputError, match="units"):
        replace(robot, units=[])
    for extra in ({"velocity": -1}, {"effort": 0}, {"kind": "fixed", "velocity": 1, "limits": None}):
        with pytest.raises(InputError, match="positive number"):
            Robot.from_dh([{}, extra])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("away", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0])
def test_roll_pitch_and_yaw_near_a_pitch_of_90_degrees(sign, away):
    """There roll and yaw are hardly defined, but the rotation they make together is."""
    for roll in (-3.0, 0.0, 0.4, math.pi):
        for yaw in (-2.0, 0.0, 1.0):
            T = matrix_of((0, 0, 0), (roll, sign * (math.pi / 2 - away), yaw))
            assert np.abs(np.array(matrix_of((0, 0, 0), rpy_of(T))) - T).max() < 2e-15


@pytest.mark.parametrize(("unit", "per_metre"), [("mm", 1000), ("cm", 100)])
def test_lengths_keep_their_digits_in_any_unit(unit, per_metre):
    hundredths = [1, 10915, 14999, *np.random.default_rng(4).integers(1, 10**6, 300).tolist()]
    for number in (k / 100 for k in hundredths):
        metres = number / per_metre
        row = {"d": number, "a": -number}
        arm = {"id": "a", "name": "A", "source": "s", "convention": "standard", "rows": [{"name": "j", **row}]}
        robot = kin.robot_from_dict(arm | {"units": {"length": unit, "angle": "deg"}})
        assert (robot.rows[0].d, robot.rows[0].a) == (float(repr(metres)), -metres)
        written = kin.robot_to_dict(kin.Robot.from_dh([(0, metres, -metres, 0)]), length=unit)
        assert {key: written["rows"][0][key] for key in row} == row


@pytest.mark.parametrize(
    ("call", "field", "valid"),
    [
        (lambda: kin.files.load_robots(None), "folder", "a path"),
        (lambda: kin.files.load_robots("/no/such/folder"), "folder", "a folder that can be read"),
        (lambda: kin.files.load_robots(Path("with\0null")), "folder", "a folder that can be read"),
        (lambda: kin.load_robot(None), "source", "the path of a file, or the text of a robot file, URDF or MJCF"),
        (lambda: kin.load_robot(b"<robot/>"), "source", "the path of a file"),
        (lambda: kin.load_robot(GOOD, tip="tool"), "tip", "a robot file has no links"),
        (lambda: kin.files.parse_robot(b""), "text", "the text of a robot file"),
        (lambda: kin.files.parse_robot(Path("arm.toml")), "text", "kin.load_robot takes a path"),
        (lambda: kin.files.urdf_tips(b"<robot/>"), "source", "the text of a URDF"),
    ],
)
def test_what_is_no_file_is_refused_with_what_is_valid(call, field, valid):
    with pytest.raises(kin.InputError, match=valid) as caught:
        call()
    assert caught.value.field == field


@pytest.mark.parametrize("path", ["arm.toml", "arms/mine", r"C:\arms\mine", " ~/arm.toml\n"])
def test_a_path_instead_of_the_text_of_a_robot_file_is_named(path):
    with pytest.raises(RobotFileError, match=r"kin\.load_robot takes a path"):
        kin.files.parse_robot(path)
    for text in ("x = 1.5", "[a.b]", "# arms/mine.toml", "a\nb.toml", "/" * 5000):
        with pytest.raises(RobotFileError) as caught:
            kin.files.parse_robot(text)
        assert "path" not in str(caught.value)


def test_a_folder_may_be_given_as_text(tmp_path):
    assert kin.files.load_robots(str(tmp_path)) == {}


@pytest.mark.parametrize(
    ("table", "field", "expected"),
    [
        ('{ tilt = "joint_2" }', "ros_joints.tilt", "one of the joints turn, slide"),
        ('{ turn = "" }', "ros_joints.turn", "a text of 1 to 4000 characters"),
        ('{ turn = "slide" }', "ros_joints", "a different name for each joint"),
        ('"joint_1"', "ros_joints", "a name for each joint"),
    ],
)
def test_names_for_ros_are_of_joints_and_different(table, field, expected):
    with pytest.raises(RobotFileError, match=expected) as caught:
        kin.load_robot(f"ros_joints = {table}{GOOD}")
    assert caught.value.field == field


def test_names_for_ros_are_kept_and_one_may_be_missing():
    robot = kin.load_robot('ros_joints = { slide = "lift_joint" }' + GOOD)
    assert robot.ros_names == ["turn", "lift_joint"]
    assert kin.load_robot(kin.robot_to_toml(robot)) == robot
    fewer = replace(robot, rows=tuple(row for row in robot.rows if row.name != "slide"), home=robot.home[:1])
    assert fewer.ros_names == ["turn"]
    assert kin.load_robot(kin.robot_to_toml(fewer)).ros_joints == ()
