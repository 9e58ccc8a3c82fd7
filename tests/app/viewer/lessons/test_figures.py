"""Parts of figures: their geometry, and the places of their labels."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.viewer.lessons import figure_nodes
from app.viewer.lessons.dh import steps
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import arc, clear_of, ruler
from app.viewer.lessons.label_room import label_room
from app.viewer.scene.meshes import body
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

SIZE = 0.05
DIRECTIONS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


@pytest.mark.parametrize("factor", ["theta", "alpha"])
@pytest.mark.parametrize("angle", [0.7, -2.9, 6.0])
def test_an_arc_ends_where_the_rotation_ends(factor: steps.Factor, angle: float) -> None:
    about = steps.axis(factor)
    start, corner = np.eye(3)[2 - about], np.array([1.0, 2.0, 3.0])
    lines = arc(corner, start, np.eye(3)[about], 2.0, angle) - corner
    turned = steps.elementary(factor, angle)[:3, :3] @ start
    assert np.allclose(lines[2, 0], 2.0 * start, atol=1e-6)
    assert np.allclose(lines[-3, 1], 2.0 * turned, atol=1e-6)
    assert np.allclose(np.linalg.norm(lines[2:-2], axis=-1), 2.0, atol=1e-6)
    assert np.allclose(np.cross(lines[1, 1], turned), 0.0, atol=1e-6)


@pytest.mark.parametrize("distance", [0.3, -0.3])
def test_a_ruler_is_as_long_as_the_distance(distance: float) -> None:
    for end in distance * np.eye(3)[[0, 2]]:
        lines = ruler(np.zeros(3), end, np.array([0.0, 0.1, 0.0]))
        assert np.allclose(lines[2, 1] - lines[2, 0], end, atol=1e-7)
        assert np.allclose(lines[:2, 0], [np.zeros(3), end], atol=1e-7)
        assert np.abs(lines).max() < 0.31, "arrow heads stay inside"


def test_nothing_to_measure_gives_finite_lines() -> None:
    assert np.isfinite(ruler(np.ones(3), np.ones(3), np.array([0.0, 0.1, 0.0]))).all()
    assert np.isfinite(arc(np.zeros(3), (1, 0, 0), (0, 0, 1), 1.0, 0.0)).all()


@given(start=DIRECTIONS, end=DIRECTIONS, other=DIRECTIONS)
def test_a_clear_side_is_perpendicular_and_away(start: Array, end: Array, other: Array) -> None:
    e = np.subtract(end, start)
    aside = clear_of(start, end, [other])
    assert np.linalg.norm(aside) == pytest.approx(1.0)
    assert aside @ e == pytest.approx(0.0, abs=1e-6)
    assert aside @ ((np.add(start, end)) / 2 - other) > -1e-2


def test_a_clear_side_exists_for_points_on_the_line_and_for_no_line() -> None:
    assert clear_of((0, 0, 0), (0, 0, 1), [(0, 0, 0.3)]) @ np.array([0, 0, 1.0]) == 0.0
    assert np.allclose(clear_of((0, 0, 0), (0, 0, 0), [(0, 0, 0)]), [0, 0, 1])


def test_values_are_in_the_units_of_the_reader() -> None:
    x, _, z = np.eye(3)
    metres, radians = Units(length="m"), Units(degrees=False)

    def label(units: Units, angle: float | None = None, words: str | None = None) -> str:
        with FigureNodes(SIZE) as figure:
            if angle is None:
                nodes = figure.dimension("part", 0 * z, 0.25 * z, "d₁", units, x, words=words)
            else:
                nodes = figure.angle("part", 0 * z, x, z, angle, "θ₁", units, words=words)
        return " ".join(node.props["text"] for node in nodes if node.kind == "label")

    assert (label(DEFAULT_UNITS), label(metres)) == ("d₁ = 250.0 mm", "d₁ = 0.2500 m")
    assert (label(DEFAULT_UNITS, words="half"), label(DEFAULT_UNITS, words="")) == ("half", "")
    assert label(DEFAULT_UNITS, math.radians(-30)) == "θ₁ = −30.0°"
    assert label(radians, math.radians(-30)) == "θ₁ = −0.524 rad"
    assert label(radians, 1.0, "θ₁ = ?") == "θ₁ = ?"


@pytest.mark.parametrize("angle", [0.7, -2.9])
def test_an_angle_has_its_arc_between_its_sides(angle: float) -> None:
    x, y, z = np.eye(3)
    with FigureNodes(SIZE) as figure:
        sides, arc_, label = figure.angle("θ", y, x, z, angle, "θ", DEFAULT_UNITS, radius=2.0)
    end = y + 2.0 * np.array([math.cos(angle), math.sin(angle), 0.0])
    assert np.allclose(arc_.props["points"][0, 0], y + 2.0 * x, atol=1e-6)
    assert np.allclose(arc_.props["points"][-3, 1], end, atol=1e-6)
    assert np.allclose(np.cross(sides.props["points"][1, 1] - y, end - y), 0.0, atol=1e-6)
    assert label.position is not None
    middle = np.array([math.cos(angle / 2), math.sin(angle / 2), 0.0])
    assert np.allclose(label.position, y + 1.3 * 2.0 * middle)


def test_a_face_is_a_fan_of_triangles_over_its_corners() -> None:
    corners = [(1.5, 2.5, 3), (0.5, 2.5, 3), (0.5, 1.5, 3), (1.5, 1.5, 3)]
    (face,) = FigureNodes(SIZE).face("plane", corners)
    triangles = face.props["vertices"][face.props["faces"]]
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    assert areas.sum() / 2 == pytest.approx(1.0)
    assert len(triangles) == 2


def test_a_line_without_a_name_has_no_label() -> None:
    figure = FigureNodes(SIZE)
    assert [node.kind for node in figure.line("z", (0, 0, 0), (1, 0, 0))] == ["line_segments"]
    line, label = figure.axis("z", (1, 0, 0), (0, 0, 2), 0.5, "z₁")
    assert np.allclose(line.props["points"], [[[1, 0, -0.5], [1, 0, 0.5]]])
    assert label.props["text"] == "z₁"


@pytest.mark.parametrize("robot", [*kin.files.classic_robots().values()], ids=lambda r: r.id)
def test_labels_are_clear_of_the_links_that_they_measure(robot: kin.Robot) -> None:
    size = body(robot).size
    points = np.vstack([robot.T_world_base[:3, 3], kin.link_frames(robot, robot.q_home)[:, :3, 3]])
    figure = FigureNodes(size)
    for a, b in itertools.pairwise(points):
        with figure:
            *_, length = figure.dimension("l", a, b, "l", DEFAULT_UNITS, clear_of(a, b, points))
            *_, angle = figure.angle("θ", a, (1, 0, 0), (0, 0, 1), 1.0, "θ", DEFAULT_UNITS)
        label, e = np.asarray(length.position), b - a
        along = float(np.clip((label - a) @ e / max(float(e @ e), 1e-12), 0.0, 1.0))
        assert np.linalg.norm(label - a - along * e) > 3.0 * size
        assert np.linalg.norm(angle.position - a) > 3.0 * size


def test_the_module_shows_how_it_is_used() -> None:
    assert figure_nodes.__doc__ is not None
    for name in ("line", "dimension"):
        assert f"figure.{name}(" in figure_nodes.__doc__
        assert callable(getattr(FigureNodes, name))


def test_labels_of_a_figure_have_room_and_stay_where_they_are() -> None:
    figure = FigureNodes(SIZE)

    def rooms(x: float) -> list[float]:
        with figure:
            parts = [
                figure.dimension(name, (x, 0, 0), (x, 0, 0.6), name, DEFAULT_UNITS, (1, 0, 0))[-1]
                for name in ("a₁", "a₂")
            ]
            parts.append(figure.point("W", np.asarray(parts[0].position), "W")[-1])
        pairs = itertools.combinations(parts, 2)
        return [
            label_room(np.subtract(a.position, b.position), a.props["text"], b.props["text"], SIZE)
            for a, b in pairs
        ]

    first = rooms(0.0)
    assert min(first) >= 1.0
    assert np.allclose(rooms(0.2), first), "they move together"
    with figure:
        pass
    with figure:
        other = figure.point("V", (0.2, 0, 0), "V")[-1]
    alone = FigureNodes(SIZE).point("V", (0.2, 0, 0), "V")[-1]
    assert np.array_equal(other.position, alone.position), "hidden labels take no room"
