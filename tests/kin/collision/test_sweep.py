"""Motions between configurations are proven free, or their first touch is found."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from kin.collision.contacts import surroundings
from kin.collision.sweep import CLOSE, first_contacts, lever_arms, touches_along

OBSTACLES = (
    kin.Obstacle("table", (0.6, 0.0, -0.1), size=(0.5, 0.8, 0.4)),
    kin.Obstacle("box", (0.5, 0.2, 0.1), size=(0.1, 0.1, 0.3)),
    kin.Obstacle("cylinder", (0.3, -0.4, 0.3), radius=0.05, height=0.5),
)


def robots() -> list[kin.Robot]:
    return [kin.get_robot(name) for name in kin.files.classic_robots()]


@pytest.mark.parametrize("robot", robots(), ids=lambda r: r.id)
def test_first_touches_are_those_of_many_samples(robot):
    rng = np.random.default_rng(3)
    near = surroundings(robot, OBSTACLES)
    start = robot.random_q(rng, 40)
    ways = rng.normal(size=start.shape) * 0.3
    farthest = np.maximum(np.abs(start), np.abs(start + ways)).max(axis=0)
    found = first_contacts(
        near, lambda rows, s: start[rows] + s[:, None] * ways[rows], np.abs(ways), farthest, lambda: None
    )
    shares = np.linspace(0.0, 1.0, 801)
    for q, way, share in zip(start, ways, found.tolist(), strict=True):
        dense = near.distances(q + shares[:, None] * way)[0]
        touching = np.flatnonzero(dense < 0.0)
        if len(touching):
            assert share <= shares[touching[0]] + 1e-3
        if math.isinf(share):
            assert dense.min() >= 0.0
        else:
            assert near.distances((q + share * way)[None])[0][0] <= 3.0 * CLOSE


@pytest.mark.parametrize("robot", robots(), ids=lambda r: r.id)
def test_no_point_of_a_capsule_moves_farther_than_its_lever_says(robot):
    near = surroundings(robot)
    rng = np.random.default_rng(5)
    q = robot.random_q(rng, 50)
    bound = lever_arms(near, np.abs(q).max(axis=0) + 1.0)
    frames = kin.link_frames(robot, q)
    for j in range(robot.n):
        step = np.zeros(robot.n)
        step[j] = 1e-3
        moved = kin.link_frames(robot, q + step)
        for i, (row, shape) in enumerate(zip(near.bodies.rows.tolist(), near.bodies.shape, strict=True)):
            if row < 0:
                continue  # the base
            for end in (shape[:3], shape[3:6]):
                before, after = (frame[:, row] @ [*end, 1.0] for frame in (frames, moved))
                far = np.linalg.norm(after - before, axis=1).max()
                assert far <= 1e-3 * bound[i, j] + 1e-12


def test_a_path_through_a_sheet_of_paper_touches_it():
    """Samples every 0.02 rad step over a sheet of a tenth of a millimetre beside a thin arm."""
    robot = kin.get_robot("planar2r")
    radius = max(each.radius for each in kin.collision.capsules(robot))
    reach = robot.reach
    sheet = kin.Obstacle("box", (0.0, reach + 0.9 * radius, 0.0), size=(1e-4, 0.19 * radius, 10.0), name="sheet")
    path = np.array([[math.radians(80.0), 0.0], [math.radians(100.0), 0.0]])
    (touch,) = touches_along(surroundings(robot, (sheet,)), path, (), lambda: None)
    assert touch.waypoint == 1
    assert 0.3 < touch.share < 0.6
    assert touch.contact.name == "sheet"
    higher = kin.Obstacle("box", (0.0, reach + 1.5 * radius, 0.0), size=(1e-4, 0.19 * radius, 10.0))
    assert touches_along(surroundings(robot, (higher,)), path, (), lambda: None) == ()


def test_a_cancelled_sweep_ends():
    near = surroundings(kin.get_robot("ur5"), OBSTACLES)
    path = kin.get_robot("ur5").random_q(np.random.default_rng(1), 20)

    def cancel() -> None:
        raise TimeoutError

    with pytest.raises(TimeoutError):
        touches_along(near, path, (), cancel)
