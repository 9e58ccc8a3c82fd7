"""Obstacles of a page: where new ones are put, how they are changed, and links that anybody may have written."""

from __future__ import annotations

import math

import numpy as np
import pytest
from arms import CLASSICS

import kin
from app.viewer.obstacles import placed
from app.viewer.obstacles.words import sentence
from app.viewer.session.state import MAX_TEXT, PageState, decode, encode
from kin.collision.contacts import surroundings
from kin.collision.obstacles import MOST_OBSTACLES, SHAPES
from kin.typed import EntryError
from kin.units import DEFAULT_UNITS

ROBOTS = CLASSICS
UR5 = kin.get_robot("ur5")


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: r.id)
def test_new_obstacles_are_within_reach_and_free(robot):
    items: placed.Obstacles = ()
    for shape in (*SHAPES, *SHAPES):
        items = placed.added(items, shape, robot, robot.q_home)
    assert len({each.name for each in items}) == len(items)
    assert kin.clearance(robot, robot.q_home, items[:4]) > 0.0 or kin.clearance(robot, robot.q_home) <= 0.0
    for each in items[:4]:
        away = math.dist(each.xyz, robot.T_world_base[:3, 3])
        assert 0.1 * robot.reach < away < 1.5 * robot.reach


def test_a_box_stands_on_the_table():
    table, box = placed.added(placed.added((), "table", UR5, UR5.q_home), "box", UR5, UR5.q_home)
    assert box.xyz[2] - 0.5 * box.size[2] == pytest.approx(table.xyz[2])


def test_there_is_a_largest_number():
    items: placed.Obstacles = ()
    for _ in range(MOST_OBSTACLES):
        items = placed.added(items, "sphere", UR5, UR5.q_home)
    assert [each.name for each in items][-1] == f"sphere {MOST_OBSTACLES}"
    with pytest.raises(kin.InputError, match="at most 32"):
        placed.added(items, "sphere", UR5, UR5.q_home)


def test_fields_are_changed_one_by_one():
    (can,) = placed.added((), "cylinder", UR5, UR5.q_home)
    for field, text in (("x", "250"), ("yaw", "1 rad"), ("radius", "30 cm"), ("height", "2 m")):
        (can,) = placed.typed((can,), 0, field, text, DEFAULT_UNITS)
    assert (can.xyz[0], can.rpy[2], can.radius, can.height) == (0.25, 1.0, 0.3, 2.0)


@pytest.mark.parametrize(
    ("field", "text", "valid"),
    [
        ("x", "1001 m", "−1000000 to 1000000 mm"),
        ("x", "nan", "−1000000 to 1000000 mm"),
        ("z", "1e999", "−1000000 to 1000000 mm"),
        ("radius", "0", "0.1 to 100000 mm"),
        ("radius", "101 m", "0.1 to 100000 mm"),
        ("height", "", "0.1 to 100000 mm"),
        ("yaw", "x", "−36000 to 36000°"),
        ("roll", "1e9", "−36000 to 36000°"),
    ],
)
def test_a_text_that_is_not_valid_is_refused_with_what_would_be(field, text, valid):
    can = placed.added((), "cylinder", UR5, UR5.q_home)
    with pytest.raises(EntryError, match=f"Valid: {valid}"):
        placed.typed(can, 0, field, text, DEFAULT_UNITS)


@pytest.mark.parametrize("field", ["length", "colour", "roll"])
def test_a_ball_has_only_its_fields(field):
    ball = placed.added((), "sphere", UR5, UR5.q_home)
    with pytest.raises(kin.InputError, match="x, y, z, radius"):
        placed.typed(ball, 0, field, "1", DEFAULT_UNITS)


def test_a_dragged_obstacle_has_round_numbers():
    items = placed.added((), "box", UR5, UR5.q_home)
    T = kin.pose_from_xyz_rpy([0.12345678, -0.5, 0.3], [0.1, -0.2, 0.3])
    (box,) = placed.moved(items, 0, T)
    assert box.xyz == (0.123, -0.5, 0.3)
    assert np.abs(np.degrees(box.rpy) * 10 - np.round(np.degrees(box.rpy) * 10)).max() < 1e-6
    assert np.abs(np.array(box.rpy) - [0.1, -0.2, 0.3]).max() < 1e-3


def test_obstacles_survive_a_link():
    items: placed.Obstacles = ()
    for shape in SHAPES:
        items = placed.added(items, shape, UR5, UR5.q_home)
    back = decode(encode(PageState("ur5", obstacles=items)), ROBOTS).obstacles
    assert [each.name for each in back] == [each.name for each in items]
    for one, other in zip(items, back, strict=True):
        assert np.abs(one.row - other.row).max() < 1e-5


def test_most_obstacles_fit_a_link():
    items: placed.Obstacles = ()
    for _ in range(MOST_OBSTACLES):
        items = placed.added(items, "box", UR5, UR5.q_home)
    text = encode(PageState("ur5", obstacles=items))
    assert len(text) < MAX_TEXT / 2
    assert len(decode(text, ROBOTS).obstacles) == MOST_OBSTACLES


GOOD = ["b", "box", 0.5, 0, 0.2, 0, 0, 0, 0.1, 0.1, 0.1]


@pytest.mark.parametrize(
    "row",
    [
        None,
        7,
        "b",
        [],
        ["b"],
        ["x", *GOOD[1:]],
        GOOD[:-1],
        [*GOOD, 1],
        ["b", "", *GOOD[2:]],
        ["b", 5, *GOOD[2:]],
        ["b", "box", math.nan, *GOOD[3:]],
        ["b", "box", math.inf, *GOOD[3:]],
        ["b", "box", True, *GOOD[3:]],
        ["b", "box", "0", *GOOD[3:]],
        [*GOOD[:-1], 0],
        [*GOOD[:-1], -1],
        [*GOOD[:-1], 1e9],
        [*GOOD[:-1], 10**400],
        ["b", "box", 2000, *GOOD[3:]],
        [*GOOD[:5], 1e300, *GOOD[6:]],
        ["b", "\u202e\u200b", *GOOD[2:]],
        {"shape": "box"},
    ],
    ids=str,
)
def test_what_is_not_valid_in_a_link_is_left_out(row):
    found = placed.unpack([row, GOOD])
    assert [each.name for each in found] == ["box"]
    assert found[0].xyz == (0.5, 0.0, 0.2)


@pytest.mark.parametrize("value", [None, 5, "text", {}, [[[]]], [GOOD] * 1000])
def test_a_link_with_anything_else_has_few_obstacles(value):
    assert len(placed.unpack(value)) <= 1


def test_names_of_a_link_are_cut_and_harmless():
    (found,) = placed.unpack([["b", "<b>" + "x" * 500, *GOOD[2:]]])
    assert len(found.name) <= placed.NAME


def test_the_sentence_names_the_deepest_contact_with_each():
    table = kin.Obstacle("table", (0.35, 0.1, 0.45), size=(0.2, 0.2, 0.1))
    contacts = surroundings(UR5, (table,)).touches(UR5.q_home)
    assert contacts
    assert [each.distance for each in contacts] == sorted(each.distance for each in contacts)
    first = contacts[0]
    said = sentence(contacts, DEFAULT_UNITS)
    assert said.startswith(f"Link {first.link} touches the table, ")
    assert said.endswith(".")
    depth = DEFAULT_UNITS.distance(-first.distance)
    assert f"{depth} deep" in said
    assert ("at least" in said) == first.axis_inside
    assert sentence((), DEFAULT_UNITS) == ""
