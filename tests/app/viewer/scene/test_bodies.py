"""Drawn bodies against the kinematics of their arms, and the three ways to draw an arm."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh
import viser
from bare_page import nodes_of
from scipy.spatial import cKDTree

import kin
from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.arm.joint_axes import axes
from app.viewer.scene.bodies.drawing import FOLDER, drawing
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.chain import link_poses
from app.viewer.scene.meshes import body
from app.viewer.session.choices import LOOKS
from kin.transforms import rotation_vector

LIBRARY = {"palletiser"}  # tested in test_gripper.py
FILES = sorted({path.stem for path in FOLDER.glob("*.toml")} - LIBRARY)
Array = np.ndarray


def links(robot: kin.Robot, q: Array) -> list[Array]:
    """The vertices of each link in the world, base first."""
    found = drawing(robot)
    assert found is not None
    poses = link_poses(robot, q[None])[0]
    return [
        np.vstack([part.mesh.vertices for part in parts]) @ T[:3, :3].T + T[:3, 3]
        for T, parts in zip(poses, found.parts, strict=True)
    ]


def test_the_arms_of_makers_have_bodies() -> None:
    assert FILES == ["iiwa14", "irb120", "panda", "puma560", "scara", "stanford", "ur5"]
    assert set(FILES) <= set(kin.files.classic_robots())


@pytest.mark.parametrize("name", FILES)
def test_a_body_holds_together_and_ends_at_the_tool(name: str) -> None:
    robot = kin.get_robot(name)
    found = drawing(robot)
    assert found is not None
    for link, parts in enumerate(found.parts):
        assert parts, f"link {link} is drawn"
        for part in parts:
            assert trimesh.Trimesh(*part.mesh, process=False).volume > 0, "faces look outward"
    for q in (robot.q_home, *robot.random_q(np.random.default_rng(2), 6)):
        vertices = links(robot, q)
        for k, (lower, upper) in enumerate(pairwise(vertices)):
            if robot.joints[k].kind == "prismatic":
                continue  # the bar inside its sleeve has vertices at its ends only
            apart, _ = cKDTree(lower).query(upper)
            assert apart.min() < 0.025, f"joint {k + 1} holds link {k} and link {k + 1}"
        T = kin.fk(robot, q)
        local = (vertices[-1] - T[:3, 3]) @ T[:3, :3]
        assert local[:, 2].max() == pytest.approx(0.0, abs=1e-5), "the body ends in the plane of the tool"
        assert vertices[0][:, 2].min() == pytest.approx(0.0, abs=1e-5), "the foot stands on the base plane"


@pytest.mark.parametrize("name", FILES)
def test_spheres_cover_a_body(name: str) -> None:
    found = drawing(kin.get_robot(name))
    assert found is not None
    for parts, spheres in zip(found.parts[1:], found.spheres[1:], strict=True):
        vertices = np.vstack([part.mesh.vertices for part in parts])
        outside = np.linalg.norm(vertices[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
        assert outside.min(axis=1).max() < 0.07, "no corner is far from all spheres"
        assert len(spheres) < 600


def test_only_the_builtin_arm_itself_has_its_body() -> None:
    ur5 = kin.get_robot("ur5")
    assert drawing(ur5.with_tool(np.diag([1.0, 1.0, 1.0, 1.0]) + 0.1 * np.eye(4, k=3))) is None
    assert drawing(kin.get_robot("pioneer5")) is None


def test_an_arm_is_drawn_in_three_ways(server: viser.ViserServer) -> None:
    robot = kin.get_robot("ur5")
    arm = ArmScene(server.scene, robot)
    T = kin.fk(robot, robot.q_home)

    def seen(*names: str) -> set[bool]:
        nodes = nodes_of(server.scene)
        return {
            n.visible
            for key, n in nodes.items()
            if key.startswith("/arm") and key.split("/")[-1].startswith(names)
        }

    for look in LOOKS.values():
        arm.show_as(look)
        arm.show_axes(True)
        arm.show_gap(T[:3, 3], T[:3, 3] + 0.3)
        assert seen("body-") == {look != "skeleton"}
        assert seen("housing", "trim") == {look != "body"}
        assert seen("axis") == {look != "body"}
        ghosts = {n.name.split("/")[-1].split("-")[0]: n.visible for n in (arm._ghost, *arm._drawn.hand)}
        assert ghosts == {"gripper": look == "skeleton", "hand": look != "skeleton"}
    arm.see_through(True)
    arm.show_as("skeleton")
    assert seen("body-") == {False}
    arm.remove()


@pytest.mark.parametrize("name", FILES)
def test_joint_axes_stand_out_of_a_body_along_what_its_joints_move_about(name: str) -> None:
    robot, rng = kin.get_robot(name), np.random.default_rng(3)
    drawn = drawing(robot)
    assert drawn is not None
    rods = axes(robot, body(robot), drawn)
    assert [rod.color for rod in rods] == [joint_color(k) for k in range(robot.n)]
    q = robot.random_q(rng)
    here = link_poses(robot, q[None])[0]
    for k, rod in enumerate(rods, 1):
        ends = np.array([[0.0, 0.0, height, 1.0] for height in rod.mesh.bounds[:, 2]])
        at = ends @ here[k][:3].T
        moved = q.copy()
        moved[k - 1] += 0.3
        way = ends @ link_poses(robot, moved[None])[0][k][:3].T - at
        along = (at[1] - at[0]) / np.linalg.norm(at[1] - at[0])
        assert np.allclose(way, 0.0 if robot.revolute[k - 1] else 0.3 * along, atol=1e-9)
        T, T_moved = kin.fk(robot, q), kin.fk(robot, moved)
        if robot.revolute[k - 1]:
            turn = rotation_vector(T_moved[:3, :3] @ T[:3, :3].T)
            assert np.allclose(turn, 0.3 * along, atol=1e-9), "the arrow shows the positive turn"
        for link in (k - 1, k):
            spheres = drawn.spheres[link]
            centres = spheres[:, :3] @ here[link][:3, :3].T + here[link][:3, 3]
            far = np.linalg.norm(at[:, None] - centres, axis=2)
            assert (far > spheres[:, 3]).all(), f"an end of axis {k} is inside link {link}"


def test_joint_axes_are_drawn_on_a_body_where_every_arm_has_them(server: viser.ViserServer) -> None:
    robot = kin.get_robot("ur5")
    arm = ArmScene(server.scene, robot, root="/axes")

    def seen() -> dict[str, int]:
        shown = [key.split("/")[-1] for key, node in nodes_of(server.scene).items() if node.visible]
        return {start: sum(name.startswith(start) for name in shown) for start in ("axis", "joint-axis")}

    arm.show_axes(True)
    assert seen() == {"axis": 0, "joint-axis": 0}
    arm.show_axes("every")
    assert seen() == {"axis": 0, "joint-axis": 6}
    arm.show_as("skeleton")
    arm.show_axes("every")
    assert seen() == {"axis": 6, "joint-axis": 0}
    arm.show_as("body")
    arm.use_drawing(drawing(robot))
    arm.show_axes("every")
    assert seen() == {"axis": 0, "joint-axis": 6}, "a new body has its own"
    arm.show_axes(False)
    assert seen() == {"axis": 0, "joint-axis": 0}
    arm.remove()


def test_an_arm_without_a_body_stays_a_skeleton(server: viser.ViserServer) -> None:
    arm = ArmScene(server.scene, kin.get_robot("pioneer5"))
    arm.show_as("body")
    arm.show_axes(True)
    nodes = nodes_of(server.scene)
    assert all(node.visible for key, node in nodes.items() if key.endswith(("/housing", "/axis")))
    arm.remove()
