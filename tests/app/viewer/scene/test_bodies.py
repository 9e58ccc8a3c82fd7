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
from app.viewer.scene.bodies.drawing import FOLDER, drawing
from app.viewer.scene.chain import link_poses
from app.viewer.session.choices import LOOKS

FILES = sorted(path.stem for path in FOLDER.glob("*.toml"))
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
    assert set(FILES) <= set(kin.classic_robots())


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


def test_an_arm_without_a_body_stays_a_skeleton(server: viser.ViserServer) -> None:
    arm = ArmScene(server.scene, kin.get_robot("pioneer5"))
    arm.show_as("body")
    arm.show_axes(True)
    nodes = nodes_of(server.scene)
    assert all(node.visible for key, node in nodes.items() if key.endswith(("/housing", "/axis")))
    arm.remove()
