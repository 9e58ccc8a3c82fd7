"""Sections of any region at any resolution: their curves are closed and enclose the workspace."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from kin.transforms import Array
from kin.workspace.region import Region

# At these resolutions the workspace extends beyond the window of the spread configurations by more than a square.
OVERSHOOTING = (
    ("panda", 160),
    pytest.param("panda", 400, marks=pytest.mark.slow),
    pytest.param("iiwa14", 350, marks=pytest.mark.slow),
)
ROBOTS = tuple(kin.files.classic_robots())
PER_REGION = 20


def winding(curve: Array, at: Array) -> Array:
    """How often a closed polyline goes round each point."""
    to = curve[None] - at[:, None]
    angle = np.arctan2(to[..., 1], to[..., 0])
    turn = np.roll(angle, -1, axis=1) - angle
    return np.asarray(((turn + math.pi) % (2.0 * math.pi) - math.pi).sum(axis=1) / (2.0 * math.pi))


def check(found: kin.workspace.Section, robot: kin.Robot) -> None:
    """Every curve is closed, finite and runs along the grid: neighbours are at most two squares apart."""
    for curve in found.curves:
        assert len(curve) >= 3
        assert np.isfinite(curve).all()
        edges = np.linalg.norm(np.roll(curve, -1, axis=0) - curve, axis=1)
        on_axis = (curve[:, 0] < 1e-9) & (np.roll(curve[:, 0], -1) < 1e-9)
        assert edges[~on_axis].max(initial=0.0) < 2.0 * found.step
    assert all(0 < arc.joint < robot.n for arc in found.arcs)
    assert found.area >= -1e-12


@pytest.mark.full
@pytest.mark.parametrize(("robot_id", "resolution"), OVERSHOOTING)
def test_a_section_reaches_beyond_the_points_that_made_its_map(robot_id, resolution):
    robot = kin.get_robot(robot_id)
    found = kin.workspace.workspace_section(robot, resolution=resolution)
    assert found.arcs
    check(found, robot)
    points = kin.workspace.workspace_slice(robot, 2000, 0, 2000).points.astype(float)
    at = np.stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]], axis=1)
    outside = at[sum(winding(curve, at) for curve in found.curves) < 0.5]
    assert len(outside) < 0.02 * len(at)


def test_random_sections_are_closed():
    random_sections(seed=1, count=10, finest=40)


@pytest.mark.slow
def test_ten_thousand_random_sections_are_closed():
    random_sections(seed=0, count=10_000, finest=400)


def random_sections(seed: int, count: int, finest: int) -> None:
    """Sections of all arms, narrowed and locked at random, in (r, z) and in planes, coarse and fine."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        if k % PER_REGION == 0:
            robot = kin.get_robot(ROBOTS[k // PER_REGION % len(ROBOTS)])
            limits, locked = random_region(robot, rng)
        plane = None
        if robot.joints[0].kind == "prismatic" or rng.random() < 0.5:
            plane = robot.reach * rng.uniform(-0.3, 0.3, 3), rng.normal(size=3)
        resolution = int(np.exp(rng.uniform(math.log(8), math.log(finest))))
        found = kin.workspace.workspace_section(robot, plane, limits=limits, locked=locked, resolution=resolution)
        try:
            check(found, robot)
        except AssertionError:
            print(f"{robot.id}: {plane=} {limits=} {locked=} {resolution=}")
            raise


def random_region(
    robot: kin.Robot, rng: np.random.Generator
) -> tuple[list[tuple[float, float] | None], list[float | None]]:
    """Limits and locks: of each joint its own, a part of them, or one value."""
    limits: list[tuple[float, float] | None] = []
    locked: list[float | None] = []
    for low, high in Region.of(robot).bounds:
        a, b = sorted(rng.uniform(low, high, 2).tolist())
        way = rng.random()
        limits.append((a, b) if way < 0.3 else None)
        locked.append(a if way > 0.85 else None)
    return limits, locked
