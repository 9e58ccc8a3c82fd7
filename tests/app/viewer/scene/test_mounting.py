"""What an arm is mounted on: how it is drawn, where the floor is, and contacts with either, for each mounting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import viser

import kin
from app.viewer.frames import FrameAxes, Frames
from app.viewer.obstacles import placed
from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.camera import view
from app.viewer.scene.clearance import clearance
from app.viewer.scene.meshes import body
from app.viewer.scene.mounting import turn_of
from app.viewer.scene.viewpoints import UP, contains
from kin.robot import MOUNTINGS

UR5 = kin.get_robot("ur5")
HEIGHT = 1.3


def mounted(kind: str, floor: float | None = None, robot: kin.Robot = UR5) -> kin.Robot:
    """An arm whose base is turned as this mounting holds it, above the origin."""
    T = np.eye(4)
    T[:3, :3], T[2, 3] = turn_of(kind), HEIGHT
    return replace(robot.with_base(T), mounting=kind, floor=floor)


@pytest.mark.parametrize("kind", MOUNTINGS)
def test_a_mount_is_behind_the_base_and_a_stated_floor_is_kept(kind: str) -> None:
    robot = mounted(kind, -0.2)
    mount = body(robot).mount
    assert (mount.kind, mount.floor) == (kind, -0.2)
    out = robot.T_world_base[:3, 2]
    ahead = (mount.part.mesh.vertices - robot.T_world_base[:3, 3]) @ out
    assert ahead.max() < 1e-9, "nothing of it is before the base"
    low, high = mount.part.mesh.bounds
    if kind in ("pedestal", "floor", "table", "wall"):
        assert low[2] == pytest.approx(-0.2), "it stands on the floor"
    else:
        assert low[2] > HEIGHT - 1e-9
    assert np.allclose(0.5 * (low + high)[:2], [0.0, 0.0] if kind != "wall" else [0.5 * (low + high)[0], 0.0])


def test_an_arm_on_the_floor_has_its_base_there() -> None:
    robot = mounted("floor")
    assert body(robot).mount.floor == HEIGHT
    assert clearance(robot).at(robot.q_home) is None
    flat = np.radians([0.0, 30.0, 0.0, 0.0, 0.0, 0.0])
    contact = clearance(robot).at(flat)
    assert contact is not None
    assert contact.text(robot).endswith("passes through the floor.")
    assert kin.link_frames(robot, flat)[..., 2, 3].min() < HEIGHT, "the arm is below it"


@pytest.mark.parametrize("skeleton", [False, True])
@pytest.mark.parametrize("kind", ["table", "wall", "ceiling"])
def test_contacts_with_a_surface_are_those_of_the_frames(kind: str, skeleton: bool) -> None:
    robot = mounted(kind)
    made, test = body(robot), clearance(robot, skeleton)
    out, base = robot.T_world_base[:3, 2], robot.T_world_base[:3, 3]
    low, high = made.mount.part.mesh.bounds
    assert test.at(robot.q_home) is None
    said = 0
    for q in robot.random_q(np.random.default_rng(3), 300):
        contact, points = test.at(q), kin.link_frames(robot, q)[3:, :3, 3]
        ahead = (points - base) @ out
        # Frames that are well inside the slab, seen from its surface and from each of its edges.
        within = np.all((points > low + 1e-6) & (points < high - 1e-6), axis=1)
        inside = within & (ahead < -0.3 * made.size) & (ahead > -1.1 * made.size)
        assert contact is not None or not inside.any()
        if contact is not None and contact.obstacle == kind:
            said += 1
            assert (contact.point - base) @ out < 2.5 * made.size
            assert contact.text(robot).endswith(f"passes through the {kind}.")
            assert np.all(contact.point > low - 3.0 * made.size)
            assert np.all(contact.point < high + 3.0 * made.size)
    assert said > 10


def test_an_arm_that_is_mounted_nowhere_stands_or_hangs_as_its_base_is_turned() -> None:
    assert body(UR5).mount.kind == "pedestal"
    hanging = UR5.with_base(kin.pose_from_xyz_rpy([0.0, 0.0, 1.5], [np.pi, 0.0, 0.0]))
    assert body(hanging).mount.kind == "ceiling"
    tilted = body(UR5.with_base(kin.pose_from_xyz_rpy([0.0, 0.0, 0.5], [1.2, 0.0, 0.0]))).mount
    assert tilted.part.mesh.bounds[0, 2] == pytest.approx(tilted.floor)


@pytest.mark.parametrize("robot_id", ["gen3", "jaco2", "jaco2s", "kr6", "so101"])
def test_arms_whose_table_begins_with_a_frame_that_points_down_stand(robot_id: str) -> None:
    robot = kin.get_robot(robot_id)
    assert robot.T_world_base[2, 2] == pytest.approx(-1.0)
    made = body(robot)
    assert made.mount.stands
    assert made.mount.floor == 0.0
    assert made.mount.part.mesh.bounds[0, 2] == pytest.approx(0.0)
    assert made.mount.part.mesh.bounds[1, 2] <= robot.T_world_base[2, 3] + 1e-9
    assert clearance(robot).at(robot.q_home) is None


def test_a_very_deep_floor_does_not_move_the_camera_away() -> None:
    near, deep = (body(mounted("pedestal", floor)) for floor in (-0.5, -900.0))
    assert deep.mount.floor == -900.0
    assert deep.radius < 1.5 * near.radius


@pytest.mark.parametrize("kind", MOUNTINGS)
@pytest.mark.parametrize("shape", ["box", "sphere", "cylinder", "table"])
def test_new_bodies_stand_on_the_floor_or_on_the_table_of_the_arm(kind: str, shape: str) -> None:
    robot = mounted(kind, 0.75)
    mount = body(robot).mount
    (each,) = placed.added((), shape, robot, robot.q_home)
    half = 0.5 * (each.size[2] if each.size else each.height or 2.0 * each.radius)
    bottom = each.xyz[2] - (2.0 * half if shape == "table" else half)
    on_it = kind == "table" and shape != "table" and max(map(abs, each.xyz[:2])) < mount.part.mesh.bounds[1, 0]
    assert bottom == pytest.approx(HEIGHT - 0.3 * body(robot).size if on_it else 0.75, abs=1e-6)


@pytest.mark.parametrize("kind", MOUNTINGS)
def test_the_scale_bar_is_in_the_picture_and_before_a_wall(server: viser.ViserServer, kind: str) -> None:
    robot = mounted(kind)
    arm = ArmScene(server.scene, robot, root=f"/bar-{kind}")
    made, ends = arm.body, np.array(arm.floor.ends)
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(arm.floor.scale)
    assert ends[:, 2] == pytest.approx(made.mount.floor, abs=0.1 * made.size)
    for aspect in (16 / 9, 900 / 720, 1.0):
        viewpoint = np.stack([*view(made, aspect), UP])
        assert contains(viewpoint, aspect, ends, 0.02 * made.radius)
    if kind == "wall":
        before = (ends - made.mount.frame[:3, 3]) @ made.mount.frame[:3, 2]
        assert before == pytest.approx(before[0]), "along the wall"
        assert before[0] > 0.4 * made.radius, "and so far before it that the wall does not cut the length"
    arm.remove()


@pytest.mark.parametrize("kind", MOUNTINGS)
def test_names_beside_the_base_stand_off_the_surface(server: viser.ViserServer, kind: str) -> None:
    robot = mounted(kind)
    arm = ArmScene(server.scene, robot, root=f"/names-{kind}")
    get, made = server.scene.get_handle_by_name, arm.body
    out, off = robot.T_world_base[:3, 2], made.size if kind in ("floor", "table", "wall") else 0.0
    for letter in "xy":
        label = get(f"/names-{kind}/base/{letter}")
        assert isinstance(label, viser.LabelHandle)
        assert robot.T_world_base[:3, :3] @ label.position @ out == pytest.approx(off), "before it, not in it"
    axes = FrameAxes(server.scene)
    axes.show(Frames(), robot, 0.2, made.mount.aside)
    label = get("/frame-1-0/name")
    assert isinstance(label, viser.LabelHandle)
    assert label.text == "world"
    assert label.position - [0.0, 0.0, 0.23] == pytest.approx(off * out)
    axes.show(Frames(), UR5, 0.2, np.zeros(3))
    arm.remove()
