"""Viewpoints: what a picture contains, and the way between two of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from app.viewer.scene.viewpoints import (
    DIRECTIONS,
    FOV,
    SIDES,
    UP,
    between,
    contains,
    distance_to_see,
    places,
)

POINT = arrays(float, 3, elements=st.floats(-3.0, 3.0))


def from_side(direction: tuple[float, float, float], distance: float = 4.0) -> np.ndarray:
    out = np.array(direction) / np.linalg.norm(direction)
    return np.stack([distance * out, np.zeros(3), UP])


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("aspect", [0.5, 1.0, 1.8])
def test_a_picture_contains_what_lies_between_its_edges(side: str, aspect: float) -> None:
    viewpoint = from_side(DIRECTIONS[side])  # type: ignore[index]
    half = 4.0 * math.tan(FOV / 2)
    forward = -viewpoint[0] / 4.0
    right = np.cross(forward, UP) / np.linalg.norm(np.cross(forward, UP))
    for axis, edge in ((right, half * aspect), (np.cross(right, forward), half)):
        for sign in (-1.0, 1.0):
            assert contains(viewpoint, aspect, np.array([0.98 * sign * edge * axis]), 0.0)
            assert not contains(viewpoint, aspect, np.array([0.98 * sign * edge * axis]), 0.1 * edge)
            assert not contains(viewpoint, aspect, np.array([1.02 * sign * edge * axis]), 0.0)
    assert not contains(viewpoint, aspect, np.array([2.0 * viewpoint[0]]), 0.0), "behind the camera"


@given(points=arrays(float, (6, 3), elements=st.floats(-3.0, 3.0)), aspect=st.floats(0.4, 2.5))
def test_at_the_least_distance_a_point_is_at_the_edge_none_outside(points: np.ndarray, aspect: float) -> None:
    start = from_side(DIRECTIONS["Corner"])
    points[0] = (0.0, 0.0, 1.0)  # at least one off the line of sight
    least = distance_to_see(start, aspect, points, 1.0)
    assert contains(from_side(DIRECTIONS["Corner"], 1.001 * least), aspect, points, 0.0)
    assert not contains(from_side(DIRECTIONS["Corner"], 0.999 * least), aspect, points, 0.0)
    assert distance_to_see(start, aspect, points, 0.8) >= least


def test_from_the_top_y_points_up() -> None:
    viewpoint = from_side(DIRECTIONS["Top"])
    forward = -viewpoint[0] / np.linalg.norm(viewpoint[0])
    right = np.cross(forward, UP) / np.linalg.norm(np.cross(forward, UP))
    assert np.allclose(right, [1.0, 0.0, 0.0])
    assert np.cross(right, forward)[1] > 0.99


@given(POINT, POINT, POINT, POINT, st.floats(0.0, 1.0))
def test_the_way_between_viewpoints(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, share: float
) -> None:
    start = np.stack([a + np.array([0.0, 0.0, 7.0]), a + b / 9, UP])
    end = np.stack([c + np.array([7.0, 0.0, 0.0]), c + d / 9, UP])
    assert np.allclose(between(start, end, 0.0)[:2], start[:2])
    assert np.allclose(between(start, end, 1.0), end)
    on_the_way = between(start, end, share)
    far = [np.linalg.norm(v[0] - v[1]) for v in (start, on_the_way, end)]
    assert min(far[0], far[2]) - 1e-9 <= far[1] <= max(far[0], far[2]) + 1e-9


@pytest.mark.parametrize("aspect", [0.5, 1.0, 1.8])
def test_a_place_in_the_picture_is_measured_from_its_middle(aspect: float) -> None:
    viewpoint = from_side(DIRECTIONS["Front"])
    narrow = 4.0 * math.tan(FOV / 2) * min(aspect, 1.0)
    points = np.array([[0.0, 0.0, 0.0], [0.0, narrow, 0.0], [0.0, 0.0, narrow], [5.0, 0.1, 0.0]])
    found = places(viewpoint, aspect, points)
    assert np.allclose(found[:3, :2], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert np.allclose(found[:3, 2] * narrow, 1.0)
    assert np.abs(found[3, :2]).max() > 10.0, "behind the camera"
