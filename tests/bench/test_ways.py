"""The scenes in which ways are measured: both ends are free, nothing straight is, and what is found is free."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from versions import needs_ompl

import kin
from kin.way import find_way

sys.path.insert(0, str(Path(__file__).parent))
from ways.scenes import SCENES, Scene, ends

UR5 = kin.get_robot("ur5")


@pytest.mark.parametrize("scene", SCENES, ids=[scene.name for scene in SCENES])
def test_a_scene_needs_a_way_around(scene: Scene) -> None:
    found = ends(UR5, scene)
    assert found is not None
    assert kin.clearance(UR5, np.stack(found), scene.obstacles).min() > 0.0
    for q, (_, *xyz) in zip(found, (scene.start, scene.goal), strict=True):
        assert np.allclose(kin.fk(UR5, q)[:3, 3], xyz, atol=1e-6)
    straight = np.linspace(*found, 400)
    assert kin.clearance(UR5, straight, scene.obstacles).min() < 0.0


@needs_ompl
def test_a_way_in_a_scene_is_free_and_no_shorter_than_straight() -> None:
    scene = SCENES[0]
    start, goal = ends(UR5, scene)  # type: ignore[misc]  # the test above
    way = find_way(UR5, start, goal, obstacles=scene.obstacles, avoid_self_collision=True, time_limit=60.0)
    assert way.q is not None
    fine = np.concatenate([np.linspace(a, b, 200) for a, b in zip(way.q[:-1], way.q[1:], strict=True)])
    assert kin.clearance(UR5, fine, scene.obstacles).min() > -1e-9
    assert way.length >= np.linalg.norm(goal - start)
