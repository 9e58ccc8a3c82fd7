"""Capsules around bodies: nothing is outside, they are not much larger than the body, and few."""

from __future__ import annotations

import time

import numpy as np
import pytest
import trimesh

from kin.fitting import bodies, capsules_around
from kin.fitting.capsule import Segment
from kin.fitting.pieces import LARGE

L_SHAPE = np.concatenate([bodies.box(0.6, 0.1, 0.1), bodies.box(0.1, 0.1, 0.7) + np.array([0.25, 0.0, 0.3])])


def outside(points: np.ndarray, found: list[Segment]) -> np.ndarray:
    """How far each point is outside of all capsules; negative inside."""
    gaps = []
    for each in found:
        start, way = np.array(each.start), np.subtract(each.end, each.start)
        along = np.clip((points - start) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        gaps.append(np.linalg.norm(points - start - along[:, None] * way, axis=1) - each.radius)
    return np.min(gaps, axis=0)


def sampled(triangles: np.ndarray, count: int = 400) -> np.ndarray:
    """Corners of a body, and points all over its triangles."""
    mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=False)
    corners = triangles.reshape(-1, 3)
    picked = np.random.default_rng(0).choice(len(corners), min(count, len(corners)), replace=False)
    return np.vstack([corners[picked], trimesh.sample.sample_surface(mesh, count, seed=1)[0]])


def bumpy(seed: int) -> np.ndarray:
    """A body of random triangles, some long and some tiny."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3, 1)
    corners = rng.normal(size=(rng.integers(1, 60), 1, 3)) * size * rng.uniform(0.05, 1.0, 3)
    return corners + rng.normal(size=(len(corners), 3, 3)) * size * 10.0 ** rng.uniform(
        -2, 0, (len(corners), 1, 1)
    )


@pytest.mark.parametrize("seed", range(12))
def test_no_point_of_a_random_body_is_outside(seed):
    body = bumpy(seed)
    found = capsules_around(body)
    assert 1 <= len(found) <= 5
    assert outside(sampled(body), found).max() <= 1e-9 * np.abs(body).max()


@pytest.mark.parametrize("size", [1e-300, 1e-12, 9999.0, 2e4, 1e6])
def test_bodies_of_any_size_are_held(size):
    """A file in millimetres has an arm of a thousand metres."""
    body = bodies.box(0.9, 0.3, 0.2) * size
    assert outside(body.reshape(-1, 3), capsules_around(body, most=1)).max() <= 0.0


@pytest.mark.parametrize(
    ("body", "most", "within"),
    [
        (bodies.box(0.1, 0.1, 0.6), 1, 2.1),
        (bodies.cylinder(0.05, 0.5), 1, 1.25),
        (L_SHAPE, 5, 2.6),
        (np.asarray(trimesh.creation.icosphere(3, 0.2).triangles), 1, 1.05),
        (np.asarray(trimesh.creation.capsule(0.4, 0.1).triangles), 1, 1.05),
        (bodies.moved(bodies.cylinder(0.05, 0.5), trimesh.transformations.euler_matrix(0.4, 1.0, 2.0)), 1, 1.25),
    ],
    ids=["rod", "cylinder", "L", "ball", "capsule", "turned cylinder"],
)
def test_the_capsules_are_hardly_larger_than_need_be(body, most, within):
    """`within`: times the volume of the body, of which the corners of a box alone need twice as much."""
    found = capsules_around(body, most=most)
    assert outside(sampled(body), found).max() <= 1e-9
    solid = trimesh.Trimesh(**trimesh.triangles.to_kwargs(body))
    volume = 0.1 * 0.1 * (0.6 + 0.6) if body is L_SHAPE else solid.convex_hull.volume
    assert sum(each.volume for each in found) < within * volume


def test_an_l_becomes_two_capsules_or_more_that_are_smaller_than_one():
    several, one = capsules_around(L_SHAPE), capsules_around(L_SHAPE, most=1)
    assert len(several) >= 2
    assert len(one) == 1
    assert sum(each.volume for each in several) < 0.5 * one[0].volume


def test_spheres_and_capsules_are_met_exactly():
    (ball,) = capsules_around(np.empty((0, 3, 3)), bodies.balls(0.25))
    assert np.allclose([*ball.start, *ball.end], 0.0, atol=2e-4)
    assert 0.25 <= ball.radius < 0.2505
    (pill,) = capsules_around(np.empty((0, 3, 3)), bodies.balls(0.1, 0.4))
    assert 0.1 <= pill.radius < 0.1005
    assert sorted([pill.start[2], pill.end[2]]) == pytest.approx([-0.2, 0.2], abs=1e-3)


@pytest.mark.full
@pytest.mark.parametrize("count", [1, 2, 40])
def test_a_point_a_line_and_a_plane_have_capsules(count):
    flat = np.zeros((count, 3, 3))
    assert capsules_around(flat)[0].radius > 0.0
    flat[:, 1, 0] = 1.0
    assert capsules_around(flat)[0].radius > 0.0
    flat[:, 2, 1] = 1.0
    found = capsules_around(flat)
    assert outside(flat.reshape(-1, 3), found).max() <= 1e-12


def test_no_body_has_no_capsules():
    assert capsules_around(np.empty((0, 3, 3))) == []


@pytest.mark.full
def test_a_mesh_of_many_triangles_is_fitted_soon_and_held():
    body = np.asarray(trimesh.creation.icosphere(6).triangles) * (0.1, 0.1, 0.4)
    assert len(body) > LARGE
    start = time.process_time()
    found = capsules_around(body)
    assert time.process_time() - start < 5.0
    assert outside(sampled(body), found).max() <= 1e-9
    assert sum(each.volume for each in found) < 2.1 * np.pi * 0.1 * 0.1 * 0.4


def test_the_same_body_gives_the_same_capsules():
    assert capsules_around(L_SHAPE) == capsules_around(L_SHAPE.copy())
