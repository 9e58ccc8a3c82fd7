"""The drawn body of the palletiser, whose rows follow joints, and its gripper, which one slider opens."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
import viser
from bare_page import nodes_of
from fake_browser import FakeBrowser
from live_server import serve_viewer
from scipy.spatial import cKDTree

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.meshes.links import carried_over
from app.viewer.panel.gripper import share_of
from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.bodies.drawing import drawing
from app.viewer.scene.bodies.fingers import Finger
from app.viewer.scene.chain import link_poses
from app.viewer.server import ViewerServer
from kin.transforms import pose_from_position_wxyz

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
ROBOT = kin.get_robot("palletiser")
DRAWN = drawing(ROBOT)
assert DRAWN is not None


def test_the_body_holds_together_and_ends_at_the_tool() -> None:
    for q in (ROBOT.q_home, *ROBOT.random_q(np.random.default_rng(2), 6)):
        poses = link_poses(ROBOT, q[None])[0]
        vertices = [
            np.vstack([part.mesh.vertices for part in parts]) @ T[:3, :3].T + T[:3, 3]
            for T, parts in zip(poses, DRAWN.parts, strict=True)
        ]
        for k, (lower, upper) in enumerate(pairwise(vertices)):
            apart, _ = cKDTree(lower).query(upper)
            assert apart.min() < 0.08, f"link {k} holds link {k + 1}"
        T = kin.fk(ROBOT, q)
        local = (vertices[-1] - T[:3, 3]) @ T[:3, :3]
        assert local[:, 2].max() == pytest.approx(0.0, abs=1e-5), "the body ends in the plane of the tool"


def gap(share: float) -> float:
    """The distance between the fingers."""
    sides = []
    for finger in DRAWN.fingers:
        position, wxyz = finger.place(share)
        T = pose_from_position_wxyz(position, wxyz)
        points = finger.parts[0].mesh.vertices @ T[:3, :3].T + T[:3, 3]
        sides.append(points @ DRAWN.fingers[0].T_link_axis[:3, 2])
    return float(sides[0].min() - sides[1].max())


def test_the_fingers_open_together() -> None:
    assert gap(0.0) == pytest.approx(0.12, abs=1e-6)
    assert gap(0.5) == pytest.approx(0.26, abs=1e-6)
    assert gap(1.0) == pytest.approx(0.40, abs=1e-6)
    assert {finger.link for finger in DRAWN.fingers} == {6}


def test_a_finger_may_turn_about_its_axis() -> None:
    axis = kin.pose_from_xyz_rpy([0.1, 0.2, 0.3], [0.4, -0.5, 0.6])
    finger = Finger(0, (), axis, False, -0.2, 0.8)
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]]
    assert pose_from_position_wxyz(*finger.place(0.5)) == pytest.approx(
        axis @ turn @ np.linalg.inv(axis), abs=1e-12
    )


def test_another_table_of_the_arm_keeps_its_gripper() -> None:
    craig = kin.convert_dh(ROBOT, "modified")
    moved = carried_over(DRAWN, ROBOT, craig)
    assert moved is not None
    q = ROBOT.q_home[None]
    for robot, drawn in ((ROBOT, DRAWN), (craig, moved)):
        finger = drawn.fingers[1]
        place = link_poses(robot, q)[0][6] @ pose_from_position_wxyz(*finger.place(0.7))
        points = finger.parts[0].mesh.vertices @ place[:3, :3].T + place[:3, 3]
        if robot is ROBOT:
            expected = points
    assert points == pytest.approx(expected, abs=1e-6)


def test_a_scene_moves_the_fingers_and_keeps_how_far_they_are_open() -> None:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        arm = ArmScene(server.scene, ROBOT, root="/gripper")
        assert arm.opened == 0.5
        nodes = [node for name, node in nodes_of(server.scene).items() if "finger" in name]
        arm.open_gripper(1.0)
        assert [float(np.linalg.norm(node.position)) for node in nodes] == pytest.approx([0.14, 0.14])
        arm.use_drawing(DRAWN)
        assert arm.opened == 1.0
        assert ArmScene(server.scene, kin.get_robot("ur5"), root="/without").opened is None
    finally:
        server.stop()


@pytest.fixture
def tab() -> Iterator[FakeBrowser]:
    with serve_viewer(ViewerServer(Store(), Settings(), Clouds())) as port, FakeBrowser(port) as opened:
        opened.choose(ROBOT.name)
        yield opened


def test_the_page_has_one_slider_for_the_gripper_of_an_arm_that_has_one(tab: FakeBrowser) -> None:
    def places() -> list[float]:
        names = [name for name in tab.nodes if "finger" in name]
        return [float(np.linalg.norm(tab.poses[name]["position"])) for name in names]

    assert tab.sliders_in("Joints")[-1] == "Gripper (%)"
    tab.set("Gripper (%)", 100)
    tab.wait(lambda: places() == pytest.approx([0.14, 0.14]))
    before = tab.tool_pose()
    tab.set("Gripper (%)", 0)
    tab.wait(lambda: places() == pytest.approx([0.0, 0.0], abs=1e-9))
    assert tab.tool_pose() == pytest.approx(before, abs=1e-12), "no pose depends on it"
    tab.choose(kin.get_robot("ur5").name)
    assert "Gripper (%)" not in tab.sliders


@pytest.mark.parametrize("value", [-1.0, 101, True, "50", math.nan, None])
def test_a_value_that_the_slider_does_not_send_is_refused(value: object) -> None:
    with pytest.raises(kin.InputError, match="from 0 to 100"):
        share_of(value)
