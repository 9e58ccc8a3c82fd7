"""Parts of figures: their geometry, their labels, and that they move in place."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
import viser
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.viewer.lessons import figures
from app.viewer.lessons.dh import steps
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import BLUE, arc, clear_of, plane_corners, ruler
from app.viewer.lessons.figures import Figure
from app.viewer.lessons.label_room import label_room
from app.viewer.scene.meshes import body
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

SIZE = 0.05
DIRECTIONS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


@pytest.fixture(scope="module")
def scene() -> Iterator[viser.SceneApi]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server.scene
    server.stop()


@pytest.fixture
def figure(scene: viser.SceneApi, request: pytest.FixtureRequest) -> Figure:
    return Figure(scene, f"/{request.node.name}", SIZE)


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


def test_values_are_in_the_units_of_the_reader(figure: Figure) -> None:
    length, angle = figure.dimension("d₁"), figure.angle("θ₁")
    length.show((0, 0, 0), (0, 0, 0.25), DEFAULT_UNITS, (1, 0, 0))
    assert length.label.text == "d₁ = 250.0 mm"
    length.show((0, 0, 0), (0, 0, 0.25), Units(length="m"), (1, 0, 0), value=-0.25)
    assert length.label.text == "d₁ = −0.2500 m"
    length.show((0, 0, 0), (0, 0, 0.25), DEFAULT_UNITS, (1, 0, 0), text="half")
    assert length.label.text == "half"
    angle.show((0, 0, 0), (1, 0, 0), (0, 0, 1), math.radians(-30), DEFAULT_UNITS)
    assert angle.label.text == "θ₁ = −30.0°"
    angle.show((0, 0, 0), (1, 0, 0), (0, 0, 1), math.radians(-30), Units(degrees=False))
    assert angle.label.text == "θ₁ = −0.524 rad"


@pytest.mark.parametrize(
    ("other", "expected"), [((0, 2, 0), "90.0"), ((3, 0, 0), "0.0"), ((-1, 0, 0), "180.0"), ((1, 1, 0), "45.0")]
)
def test_the_angle_of_a_corner_is_between_its_sides(figure: Figure, other: Array, expected: str) -> None:
    angle = figure.angle("β")
    angle.show_between((0, 0, 0), (1, 0, 0), other, DEFAULT_UNITS, radius=1.0)
    assert angle.label.text == f"β = {expected}°"
    assert np.allclose(angle._arc.points[-3, 1], np.array(other) / np.linalg.norm(other), atol=1e-6)


def test_parts_are_hidden_until_they_are_shown_and_move_in_place(figure: Figure) -> None:
    line, length, angle = figure.line("z₁"), figure.dimension("d"), figure.angle("θ")
    point, face = figure.point("W"), figure.face(4, BLUE)
    parts = (line, length, angle, point)
    assert not any(part.shown or part.label.visible for part in parts)
    assert not face.node.visible
    nodes = [id(node) for part in parts for node in (*part.nodes, part.label)]
    made = figure._count
    for k in range(3):
        line.show_axis((k, 0, 0), (0, 0, 2), 0.5)
        length.show((k, 0, 0), (k, 1, 0), DEFAULT_UNITS, (1, 0, 0))
        angle.show((k, 0, 0), (1, 0, 0), (0, 0, 1), 1.0, DEFAULT_UNITS)
        point.show((k, 0, 0))
        face.show(plane_corners((k, 0, 0), (0, 0, 1), 0.5))
        assert all(part.shown and part.label.visible for part in parts)
        assert np.allclose(line._line.points, [[[k, 0, -0.5], [k, 0, 0.5]]])
        assert np.allclose(face.node.vertices.mean(axis=0), [k, 0, 0])
        assert np.allclose(point._ball.position, [k, 0, 0])
    assert [id(node) for part in parts for node in (*part.nodes, part.label)] == nodes
    assert figure._count == made, "no node is made while the arm moves"
    for part in (*parts, face):
        part.hide()
    assert not any(part.shown or part.label.visible for part in parts)
    figure.remove()


def test_a_line_without_a_name_has_no_empty_label(figure: Figure) -> None:
    line = figure.line()
    line.show((0, 0, 0), (1, 0, 0))
    assert line.shown
    assert not line.label.visible
    line.show((0, 0, 0), (1, 0, 0), text="now it has")
    assert line.label.visible


@pytest.mark.parametrize("robot", [*kin.classic_robots().values()], ids=lambda r: r.id)
def test_labels_are_clear_of_the_links_that_they_measure(scene: viser.SceneApi, robot: kin.Robot) -> None:
    size = body(robot).size
    figure = Figure(scene, f"/clear-{robot.id}", size)
    length, angle = figure.dimension("l"), figure.angle("θ")
    points = np.vstack([robot.T_world_base[:3, 3], kin.link_frames(robot, robot.q_home)[:, :3, 3]])
    for a, b in itertools.pairwise(points):
        length.show(a, b, DEFAULT_UNITS, clear_of(a, b, points))
        angle.show(a, (1, 0, 0), (0, 0, 1), 1.0, DEFAULT_UNITS)
        label, e = length.label.position, b - a
        along = float(np.clip((label - a) @ e / max(float(e @ e), 1e-12), 0.0, 1.0))
        assert np.linalg.norm(label - a - along * e) > 3.0 * size
        assert np.linalg.norm(angle.label.position - a) > 3.0 * size
    figure.remove()


def test_the_module_shows_how_it_is_used() -> None:
    assert figures.__doc__ is not None
    for name in ("line", "dimension", "angle", "point", "face", "remove"):
        assert f"figure.{name}(" in figures.__doc__
        assert callable(getattr(Figure, name))


def test_labels_of_a_figure_have_room_and_stay_where_they_are(figure: Figure) -> None:
    one, other, point = figure.dimension("a₁"), figure.dimension("a₂"), figure.point("W")

    def show(x: float) -> list[float]:
        for part in (one, other):
            part.show((x, 0, 0), (x, 0, 0.6), DEFAULT_UNITS, (1, 0, 0))
        point.show(figure.labels.at(one), (0, 0, 1))
        pairs = itertools.combinations([part.label for part in (one, other, point)], 2)
        return [label_room(np.subtract(a.position, b.position), a.text, b.text, SIZE) for a, b in pairs]

    first = show(0.0)
    assert min(first) >= 1.0
    assert np.allclose(show(0.2), first), "they move together"
    for part in (one, other, point):
        part.hide()
    assert not any(part in figure.labels for part in (one, other, point)), "hidden labels take no room"


def test_declared_values_are_in_the_units_of_the_reader() -> None:
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
def test_a_declared_angle_has_its_arc_between_its_sides(angle: float) -> None:
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


def test_a_declared_face_is_a_fan_of_triangles_over_its_corners() -> None:
    corners = plane_corners((1, 2, 3), (0, 0, 1), 0.5)
    (face,) = FigureNodes(SIZE).face("plane", corners)
    triangles = face.props["vertices"][face.props["faces"]]
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    assert areas.sum() / 2 == pytest.approx(1.0)
    assert len(triangles) == 2
