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
from app.viewer.meshes.links import carried_over, drawing_without_meshes, fingers_of, shapes_of
from app.viewer.panel.gripper import share_of
from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.bodies.drawing import drawing
from app.viewer.scene.bodies.fingers import Finger
from app.viewer.scene.chain import link_poses
from app.viewer.scene.meshes import Body, body
from app.viewer.scene.shapes import merged, placed
from app.viewer.server import ViewerServer
from kin.files.urdf.visuals import read_visuals
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
    craig = kin.dh.convert_dh(ROBOT, "modified")
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


HAND = """<robot name="picker">
<link name="base"><visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual></link>
<link name="arm"><visual><origin xyz="0 0 0.2"/><geometry><box size="0.05 0.05 0.4"/></geometry></visual></link>
<link name="palm"/>
<link name="left"><visual><origin xyz="0 0 0.05"/><geometry><box size="0.02 0.01 0.1"/></geometry></visual></link>
<link name="right"><visual><origin xyz="0 0 0.05"/><geometry><box size="0.02 0.01 0.1"/></geometry></visual></link>
<link name="nail"><visual><geometry><sphere radius="0.01"/></geometry></visual></link>
<link name="tool"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="wrist" type="fixed"><parent link="arm"/><child link="palm"/><origin xyz="0 0 0.4"/></joint>
<joint name="flange" type="fixed"><parent link="palm"/><child link="tool"/><origin xyz="0 0 0.1"/></joint>
<joint name="finger" type="prismatic"><parent link="palm"/><child link="left"/><origin xyz="0 0.01 0"/>
<axis xyz="0 1 0"/><limit lower="0" upper="0.04" velocity="1" effort="1"/></joint>
<joint name="other" type="revolute"><parent link="palm"/><child link="right"/><origin xyz="0 -0.01 0"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1" effort="1"/>
<mimic joint="finger" multiplier="10" offset="0.1"/></joint>
<joint name="tip" type="fixed"><parent link="left"/><child link="nail"/><origin xyz="0 0 0.1"/></joint>
</robot>"""


def test_fingers_of_a_urdf_are_beside_the_arm_and_have_the_range_of_the_one_that_leads() -> None:
    robot, visuals = kin.load_robot(HAND, tip="tool"), read_visuals(HAND, "tool")
    assert robot.n == 1
    drawn = drawing_without_meshes(shapes_of(robot, visuals), fingers_of(robot, visuals))
    assert [len(parts) for parts in drawn.parts] == [1, 1]
    left, right = drawn.fingers
    assert (left.link, left.slides, left.closed, left.open) == (1, True, 0.0, 0.04)
    assert (right.slides, right.closed, right.open) == (False, 0.1, pytest.approx(0.5))
    # The arm bent by 90°: what points up at zero points along x, 0.1 m up.
    T = link_poses(robot, np.array([[math.pi / 2]]))[0][1]

    def middle(finger: Finger, share: float) -> np.ndarray:
        vertices = np.vstack([part.mesh.vertices for part in finger.parts])
        points = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        return T @ pose_from_position_wxyz(*finger.place(share)) @ [*points, 1.0]

    assert middle(left, 0.0)[:3] == pytest.approx([0.455, 0.01, 0.1], abs=1e-6), "with the nail on it"
    assert middle(left, 1.0)[:3] == pytest.approx([0.455, 0.05, 0.1], abs=1e-6)
    angle = 10.0 * 0.5 * 0.04 + 0.1
    place = [0.4 + 0.05 * math.cos(angle), -0.01 - 0.05 * math.sin(angle), 0.1]
    assert middle(right, 0.5)[:3] == pytest.approx(place, abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "moving"),
    [
        ('mimic joint="finger"', 'mimic joint="j1"', 1),
        ('mimic joint="finger"', 'mimic joint="nobody"', 1),
        ('lower="0" upper="0.04"', 'lower="0" upper="0"', 0),
        ('name="tip" type="fixed"', 'name="tip" type="continuous"', 2),
    ],
)
def test_fingers_without_a_range_of_their_own_stay_as_they_are_drawn(old: str, new: str, moving: int) -> None:
    text = HAND.replace(old, new)
    robot, visuals = kin.load_robot(text, tip="tool"), read_visuals(text, "tool")
    drawn = drawing_without_meshes(shapes_of(robot, visuals), fingers_of(robot, visuals))
    assert len(drawn.fingers) == moving
    bodies = [part for parts in (*drawn.parts, *(each.parts for each in drawn.fingers)) for part in parts]
    assert len(visuals) == 5
    assert bodies


def test_a_finger_of_several_joints_moves_as_its_joints_do() -> None:
    """As those of grippers with knuckles: the nail turns on the finger, which slides; all follow one joint."""
    limit = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
    mimic = '<mimic joint="finger" multiplier="-5" offset="0.1"/>'
    turning = f'name="tip" type="revolute"><axis xyz="1 0 0"/>{limit}{mimic}'
    text = HAND.replace('name="tip" type="fixed">', turning)
    robot, visuals = kin.load_robot(text, tip="tool"), read_visuals(text, "tool")
    drawn = drawing_without_meshes(shapes_of(robot, visuals), fingers_of(robot, visuals))
    (nail,) = [finger for finger in drawn.fingers if finger.on is not None]
    assert len(drawn.fingers) == 3
    points = nail.parts[0].mesh.vertices
    drawn_at = [*(0.5 * (points.min(axis=0) + points.max(axis=0))), 1.0]
    whole = kin.load_robot(text, tip="nail")
    craig = kin.dh.convert_dh(robot, "modified")
    moved = carried_over(drawn, robot, craig)
    assert moved is not None
    (same,) = [finger for finger in moved.fingers if finger.on is not None]
    for share, bend in ((0.0, 0.3), (0.75, -0.5), (1.0, 0.9)):
        T = link_poses(robot, np.array([[bend]]))[0][1] @ pose_from_position_wxyz(*nail.place(share))
        assert (T @ drawn_at)[:3] == pytest.approx(kin.fk(whole, [bend, 0.04 * share])[:3, 3], abs=1e-6)
        there = link_poses(craig, np.array([[bend]]))[0][1] @ pose_from_position_wxyz(*same.place(share))
        vertices = same.parts[0].mesh.vertices[:1]
        expected = T[:3, :3] @ points[0] + T[:3, 3]
        assert there[:3, :3] @ vertices[0] + there[:3, 3] == pytest.approx(expected, abs=1e-6)


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


def apart(made: Body) -> float:
    """The distance between the fingers when they are open."""
    left, right = sorted(
        (made.chain.T_last_tool[:3, :3].T @ (finger.parts[0].mesh.vertices - made.chain.T_last_tool[:3, 3]).T)[
            0
        ].tolist()
        for finger in made.fingers
    )
    return min(right) - max(left)


@pytest.mark.parametrize("name", ["so100", "so101"])
def test_an_arm_with_a_gripper_and_without_a_drawn_body_has_fingers_that_slide(
    tab: FakeBrowser, name: str
) -> None:
    robot = kin.get_robot(name)
    tab.choose(robot.name)
    tab.wait(lambda: "Gripper (%)" in tab.sliders_in("Joints"))
    made = body(robot)
    tool, last = made.chain.T_last_tool, len(made.chain.links) - 1
    assert {finger.link for finger in made.fingers} == {last}

    def places() -> list[np.ndarray]:
        names = sorted(each for each in tab.nodes if "/finger-" in each)
        return [tool[:3, :3].T @ tab.poses[each]["position"] for each in names]

    for percent in (0, 40, 100):
        tab.set("Gripper (%)", percent)
        way = 0.5 * apart(made) * (1.0 - percent / 100.0)
        expected = [[-way, 0.0, 0.0], [way, 0.0, 0.0]]
        tab.wait(lambda expected=expected: np.allclose(places(), expected, atol=1e-6))  # type: ignore[misc]


def test_the_fingers_of_the_slider_are_those_of_the_ghost_when_they_are_open() -> None:
    made = body(kin.get_robot("so101"))
    parts = [
        made.palm.mesh,
        *(placed(f.parts[0].mesh, np.linalg.inv(made.chain.T_last_tool)) for f in made.fingers),
    ]
    whole = merged(parts)
    assert whole.vertices == pytest.approx(made.gripper[0].mesh.vertices, abs=1e-6)
    assert body(kin.get_robot("planar2r")).fingers == ()


def test_the_fingers_keep_their_opening_when_the_arm_is_drawn_anew() -> None:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        arm = ArmScene(server.scene, kin.get_robot("so101"), root="/so101")
        assert arm.opened == 0.5
        arm.open_gripper(0.75)
        arm.use_drawing(None)
        assert arm.opened == 0.75
    finally:
        server.stop()
