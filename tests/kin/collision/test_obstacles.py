"""Distances to obstacles: against coal, against sampling, and as properties."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin.collision.obstacles import KINDS, SHAPES
from kin.collision.solids import nearest_on

GOLDEN = json.loads((Path(__file__).parents[2] / "data" / "golden-obstacles.json").read_text("utf-8"))

place = st.tuples(*[st.one_of(st.integers(-2, 2).map(float), st.floats(-2.0, 2.0, width=32))] * 3)
side = st.floats(0.0625, 1.5, width=32)
turn = st.sampled_from([0.0, math.pi / 2, 0.3, -1.1])


@st.composite
def obstacles(draw):
    shape = draw(st.sampled_from(SHAPES))
    fields = {"xyz": draw(place), "rpy": draw(st.tuples(turn, turn, turn))}
    sizes = draw(st.tuples(*[side] * len(KINDS[shape].names)))
    return kin.Obstacle(shape, **fields, **KINDS[shape].with_sizes(sizes))


def measured(obstacle: kin.Obstacle, start, end) -> tuple[float, float]:
    ends = np.array([[*start, *end]])
    return nearest_on(ends, 0, obstacle.row[None], 0, np.empty(6))


def away(obstacle: kin.Obstacle, points: np.ndarray) -> np.ndarray:
    """Distances of points to an obstacle, from its definition; 0 inside but for spheres."""
    local = (points - obstacle.T[:3, 3]) @ obstacle.T[:3, :3]
    if obstacle.shape == "sphere":
        return np.linalg.norm(local, axis=1) - obstacle.radius
    if obstacle.shape == "cylinder":
        flat = np.column_stack([np.hypot(local[:, 0], local[:, 1]), np.abs(local[:, 2])])
        return np.linalg.norm(np.maximum(flat - [obstacle.radius, obstacle.height / 2], 0.0), axis=1)
    return np.linalg.norm(np.maximum(np.abs(local) - np.array(obstacle.size) / 2.0, 0.0), axis=1)


@settings(max_examples=150, deadline=None)
@given(obstacles(), place, place)
def test_no_point_of_a_segment_is_nearer(obstacle, start, end):
    apart, t = measured(obstacle, start, end)
    way = np.subtract(end, start)
    samples = away(obstacle, start + np.linspace(0.0, 1.0, 201)[:, None] * way)
    assert 0.0 <= t <= 1.0
    assert away(obstacle, (start + t * way)[None])[0] == pytest.approx(apart, abs=1e-9)
    assert apart <= samples.min() + 1e-9
    assert apart >= samples.min() - np.linalg.norm(way) / 400.0 - 1e-9


@settings(max_examples=60, deadline=None)
@given(obstacles(), place, place, place)
def test_moving_arm_and_obstacle_together_changes_nothing(obstacle, start, end, shift):
    moved = kin.Obstacle(**{**obstacle.as_dict(), "xyz": np.add(obstacle.xyz, shift).tolist()})
    before, _ = measured(obstacle, start, end)
    after, _ = measured(moved, np.add(start, shift), np.add(end, shift))
    assert after == pytest.approx(before, abs=1e-9)


@given(obstacles())
def test_an_obstacle_survives_a_round_trip(obstacle):
    assert kin.collision.obstacle_from_dict(obstacle.as_dict()) == obstacle


@pytest.mark.parametrize("robot_id", GOLDEN["arms"])
def test_clearances_agree_with_coal(robot_id):
    """Recorded by tests/data/make_golden_clearance.py; coal measures deeper where an axis is inside."""
    given_obstacles = [kin.collision.obstacle_from_dict(each) for each in GOLDEN["obstacles"]]
    q = np.array([each["q"] for each in GOLDEN["arms"][robot_id]])
    theirs = np.array([each["distance"] for each in GOLDEN["arms"][robot_id]])
    ours = kin.clearance(robot_id, q, given_obstacles)
    apart = theirs > 0.0
    assert np.abs(ours - theirs)[apart].max() < 1e-6
    assert (ours[~apart] <= 1e-6).all()


def test_a_contact_names_what_touches():
    box = kin.Obstacle("box", (0.0, 0.0, 0.0), size=(9.0, 9.0, 9.0), name="room")
    found = kin.collision.nearest_contact("ur5", kin.get_robot("ur5").q_home, [box])
    assert (found.obstacle, found.other, found.name) == (0, None, "room")
    assert found.text == f"link {found.link} touches room"
    assert found.distance < 0.0
    assert kin.clearance("ur5", kin.get_robot("ur5").q_home, [box]) == found.distance


def test_what_no_joint_moves_is_not_compared():
    """A table under the arm does not touch its base."""
    table = kin.Obstacle("table", (0.0, 0.0, -0.001), size=(2.0, 2.0, 0.8))
    for robot_id in ("ur5", "iiwa14", "irb120", "panda"):
        robot = kin.get_robot(robot_id)
        assert kin.clearance(robot, robot.q_home, [table]) > 0.0


def test_the_top_of_a_table_is_at_its_place():
    table = kin.Obstacle("table", (0.0, 0.0, 0.5), size=(1.0, 1.0, 0.2))
    assert measured(table, (0.0, 0.0, 0.9), (0.1, 0.0, 0.8))[0] == pytest.approx(0.3)
    assert measured(table, (0.0, 0.0, 0.1), (0.1, 0.0, 0.2))[0] == pytest.approx(0.1)


def test_every_kind_is_a_row_and_documented() -> None:
    assert tuple(KINDS) == SHAPES
    assert len({kind.letter for kind in KINDS.values()}) == len(KINDS)
    words = (Path(__file__).parents[3] / "docs" / "rest.md").read_text("utf-8")
    for shape, kind in KINDS.items():
        row = next(line for line in words.splitlines() if line.startswith(f"| `{shape}` |"))
        assert re.findall("`(size|radius|height)`", row) == list(kind.fields)
        values = [0.1 * k for k in range(1, len(kind.names) + 1)]
        each = kin.Obstacle(shape, **kind.with_sizes(values))
        assert each.sizes == tuple(values)
        assert each.row[16] >= each.half.max()
