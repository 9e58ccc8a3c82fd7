"""Chain, bodies and scene of every robot, and of awkward ones, without any browser."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import trimesh
import viser
from arms import CLASSICS
from bare_page import nodes_of

import kin
from app.shared.settings import static_folder
from app.shared.store import Store
from app.viewer.panel import joints, readout, status
from app.viewer.scene import camera
from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.bodies.drawing import drawing
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.chain import chain, link_poses
from app.viewer.scene.meshes import body
from app.viewer.scene.shapes import box, tube
from kin.poses import rotations
from kin.transforms import pose_from_position_wxyz
from kin.units import DEFAULT_UNITS, Units

ROW = '[[rows]]\nname = "{}"\nkind = "{}"\ntheta = {}\nd = {}\na = {}\nalpha = {}\n'


def robot_of(convention: str, *rows: tuple[object, ...], extra: str = "") -> kin.Robot:
    """A robot from rows of (name, kind, theta, d, a, alpha), in metres and degrees."""
    head = f'id = "test"\nname = "Test"\nsource = "made up"\nconvention = "{convention}"\n'
    units = 'units = { length = "m", angle = "deg" }\n'
    return kin.load_robot(head + units + extra + "".join(ROW.format(*row) for row in rows))


BASE = "[base]\nxyz = [0.3, -0.2, 0.5]\nrpy = [90, 0, 30]\n"
TOOL = "[tool]\nxyz = [0.01, 0.02, 0.1]\nrpy = [0, 45, 10]\n"
AWKWARD = {
    "stanford-like": robot_of(
        "standard",
        ("1", "revolute", 0, 0.4, 0, -90),
        ("2", "revolute", 0, 0.15, 0, 90),
        ("slide", "prismatic", -90, 0.1, 0, 0),
        ("4", "revolute", 0, 0, 0, -90),
        ("5", "revolute", 0, 0, 0, 90),
        ("6", "revolute", 0, 0.2, 0, 0),
    ),
    "scara-modified": robot_of(
        "modified",
        ("plate", "fixed", 15, 0.05, 0.1, 20),
        ("1", "revolute", 0, 0.3, 0, 0),
        ("2", "revolute", 30, 0, 0.3, 0),
        ("adapter", "fixed", 10, 0.02, 0.05, 0),
        ("3", "prismatic", 45, -0.1, 0.25, 180),
        ("4", "revolute", 0, 0, 0, 0),
        extra=BASE.replace("[base]", "[base]"),
    ),
    "one-joint-no-length": robot_of("standard", ("only", "revolute", 0, 0, 0, 0)),
    "offset-base-and-tool": robot_of(
        "modified", ("1", "revolute", 10, 0.2, 0, 0), ("2", "revolute", 0, 0, 0.3, -90), extra=BASE + TOOL
    ),
    "doubling-back": robot_of(
        "standard", ("1", "revolute", 0, 0.3, 0, 0), ("x", "fixed", 0, -0.2, 0, 0), ("2", "revolute", 0, 0, 0.2, 0)
    ),
}
ROBOTS = [*CLASSICS, *AWKWARD.values()]
IDS = [*(r.id for r in CLASSICS), *AWKWARD]


def world(scene: viser.SceneApi, name: str) -> np.ndarray:
    """Pose of a node in the world, by composing its ancestors."""
    T = np.eye(4)
    parts = name.strip("/").split("/")
    for k in range(len(parts)):
        node = scene.get_handle_by_name("/" + "/".join(parts[: k + 1]))
        assert node is not None
        T = T @ pose_from_position_wxyz(node.position, node.wxyz)
    return T


def node_names(scene: viser.SceneApi, end: str) -> list[str]:
    return [n for n in nodes_of(scene) if n.split("/")[-1] == end]


@pytest.mark.parametrize("robot", ROBOTS, ids=IDS)
def test_the_links_compose_to_the_forward_kinematics(robot: kin.Robot) -> None:
    links = chain(robot)
    for q in robot.random_q(np.random.default_rng(1), 20):
        T, frames = np.eye(4), {}
        for link, value in zip(links.links, [0.0, *q], strict=True):
            T = T @ pose_from_position_wxyz(*link.pose(float(value)))
            frames |= {row: T @ F for row, F in link.frames}
        assert np.allclose(T @ links.T_last_tool, kin.fk(robot, q), atol=1e-12)
        expected = kin.link_frames(robot, q)
        assert sorted(frames) == list(range(len(robot.rows)))
        for row, frame in frames.items():
            assert np.allclose(frame, expected[row], atol=1e-12)


@pytest.mark.parametrize("robot", ROBOTS, ids=IDS)
def test_posed_nodes_agree_with_the_kinematics(server: viser.ViserServer, robot: kin.Robot) -> None:
    arm = ArmScene(server.scene, robot)
    try:
        for q in (robot.q_home, *robot.random_q(np.random.default_rng(2), 3), robot.lower, robot.upper):
            arm.show(q)
            arm.place_gizmo(kin.fk(robot, q))
            frames = kin.link_frames(robot, q)
            for row in range(len(robot.rows)):
                (name,) = node_names(server.scene, f"frame-{row + 1}")
                assert np.allclose(world(server.scene, name), frames[row], atol=1e-12)
            grip = next(n for n in node_names(server.scene, "gripper") if "target" not in n)
            assert np.allclose(world(server.scene, grip), kin.fk(robot, q), atol=1e-12)
            assert np.allclose(world(server.scene, arm.gizmo.name), kin.fk(robot, q), atol=1e-12)
    finally:
        arm.remove()
    assert not [n for n in nodes_of(server.scene) if n.startswith("/arm")]


def test_the_last_small_step_is_not_dropped(server: viser.ViserServer) -> None:
    robot = Store().get("redundant7-craig")
    arm = ArmScene(server.scene, robot)
    q = robot.q_home + 1e-7
    arm.show(q)
    (name,) = node_names(server.scene, "frame-8")
    assert np.abs(world(server.scene, name) - kin.link_frames(robot, q)[-1]).max() < 1e-12
    arm.remove()


@pytest.mark.parametrize("robot", ROBOTS, ids=IDS)
def test_bodies_are_valid_and_above_the_floor(robot: kin.Robot) -> None:
    made = body(robot)
    for part in [made.mount.part, *made.gripper, *(p for parts in made.parts for p in parts)]:
        assert np.isfinite(part.mesh.vertices).all(), part.name
        assert part.mesh.faces.max() < len(part.mesh.vertices)
        assert trimesh.Trimesh(*part.mesh, process=False).area > 0
    base = robot.T_world_base
    upright = bool(base[2, 2] > 0.7) or robot.mounting == "floor"
    q = robot.q_home[None] if upright else robot.random_q(np.random.default_rng(3), 4000)
    assert kin.link_frames(robot, q)[..., 2, 3].min() - made.size > made.mount.floor
    assert made.mount.stands == (upright or base[2, 2] > -0.7), "a tilted one stands, too"
    lowest_home = kin.link_frames(robot, robot.q_home)[:, 2, 3].min()
    if upright and made.mount.kind == "pedestal" and lowest_home > base[2, 3]:
        assert base[2, 3] - made.mount.floor < 0.2 * robot.reach + 3 * made.size + 0.05, "the pedestal is short"
    if made.mount.stands:
        assert made.mount.part.mesh.bounds[0, 2] == pytest.approx(made.mount.floor)
    assert len(made.parts) == robot.n + 1
    for link in made.parts[1:]:
        assert {"housing", "axis"} <= {part.name for part in link}, "each joint shows itself and its axis"


def test_a_hanging_arm_hangs_from_a_ceiling() -> None:
    down = robot_of(
        "standard",
        ("1", "revolute", 0, 0.2, 0, 90),
        ("2", "revolute", 0, 0, 0.3, 0),
        extra="[base]\nxyz = [0, 0, 1.5]\nrpy = [180, 0, 0]\n",
    )
    made = body(down)
    assert made.mount.kind == "ceiling"
    assert not made.mount.stands
    assert made.mount.part.mesh.bounds[0, 2] > 1.49, "nothing stands where the arm moves"
    assert made.mount.part.mesh.bounds[1, 2] > 1.5
    assert made.mount.floor < 1.5 - 0.5


def test_the_floor_names_its_scale_and_the_gizmo_stands_free(server: viser.ViserServer) -> None:
    robot = Store().get("ur5")
    arm = ArmScene(server.scene, robot)
    get = server.scene.get_handle_by_name
    (bar,) = node_names(server.scene, "arm-scale")
    length = np.ptp(get(bar).points[0][:, 0])  # type: ignore[union-attr]
    for units, text in ((DEFAULT_UNITS, "200 mm"), (Units(length="cm"), "20 cm"), (Units(length="m"), "0.2 m")):
        arm.floor.use_units(units)
        assert get(f"{bar}/length").text == text  # type: ignore[union-attr]
    assert length == pytest.approx(0.2)
    start, end = arm.floor.ends
    # Both ends and the tool in the picture, the end that has the text, and where the text leads away from the bar.
    for x, tool, inner, outer, anchor in (
        ((0.2, -0.2), 3.0, end, start, "bottom-left"),
        ((-0.2, 0.2), 3.0, start, end, "bottom-left"),
        ((-0.2, 0.2), 0.4, end, start, "bottom-right"),
        ((-0.2, 0.2), -0.1, start, end, "bottom-left"),
    ):
        arm.floor.turn_label(np.array([[x[0], 0.0, 1.0], [x[1], 0.0, 1.0], [tool, 0.1, 1.0]]), 0.3)
        label = get(f"{bar}/length")
        assert np.linalg.norm(label.position - inner) > np.linalg.norm(outer - inner), "beyond this end"  # type: ignore[union-attr]
        assert np.linalg.norm(label.position - outer) < 0.1 * length  # type: ignore[union-attr]
        assert label.anchor == anchor, "it stands here on the floor"  # type: ignore[union-attr]
        assert label.depth_test, "solids before it hide it"  # type: ignore[union-attr]
    rising = np.array([[-0.2, -0.1, 1.0], [0.2, 0.1, 1.0], [0.4, 0.1, 1.0]])
    arm.floor.turn_label(rising, 0.3)
    assert label.anchor == "bottom-right"
    assert np.allclose(label.position, (start + end) / 2), "the bar is below the text, right of its left end"
    arm.floor.show(False)
    assert not get(bar).visible  # type: ignore[union-attr]
    arm.show_frames(True)
    base = get("/arm/frame-0")
    assert base is not None
    assert base.visible
    assert np.allclose(base.position, robot.T_world_base[:3, 3])
    assert get("/arm/frame-0/label").text == "base"  # type: ignore[union-attr]
    assert get("/arm/frame-0/label").depth_test, "solids hide it"  # type: ignore[union-attr]
    assert not get("/arm-contact/text").depth_test, "what touches is inside a solid"  # type: ignore[union-attr]
    (tool,) = node_names(server.scene, "frame-6")
    assert get(tool).axes_length < 0.6 * get(arm.gizmo.name).scale, (
        "the gizmo's arrows reach past the tool's frame"
    )  # type: ignore[union-attr]
    (approach,) = node_names(server.scene, "approach")
    T = kin.fk(robot, robot.q_home)
    arm.show_gap(T[:3, 3], None)
    assert not get(approach).visible, "it would cover an arrow of the gizmo"  # type: ignore[union-attr]
    arm.show_gap(T[:3, 3], T[:3, 3] + 0.3)
    assert get(approach).visible  # type: ignore[union-attr]
    arm.remove()


def test_the_gripper_stands_out_on_a_light_and_on_a_dark_page() -> None:
    styles = (static_folder() / "viewer.css").read_text(encoding="utf-8")
    pages = re.findall(r"--kb-near: (#[0-9a-f]+);", styles)
    assert len(pages) == 2

    def luminance(color: str | tuple[int, int, int]) -> float:
        """Relative luminance of WCAG 2.1."""
        if isinstance(color, str):
            digits = color[1:] if len(color) == 7 else "".join(2 * digit for digit in color[1:])
            color = tuple(bytes.fromhex(digits))  # type: ignore[assignment]
        parts = [c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in color]  # type: ignore[union-attr, operator]
        return float(np.dot(parts, (0.2126, 0.7152, 0.0722)))

    gripper = luminance(body(kin.get_robot("pioneer5")).gripper[0].color)
    for page in map(luminance, pages):
        light, dark = max(gripper, page), min(gripper, page)
        assert (light + 0.05) / (dark + 0.05) >= 3.0


@pytest.mark.parametrize("robot", ROBOTS, ids=IDS)
def test_every_part_has_a_node_of_its_own(server: viser.ViserServer, robot: kin.Robot) -> None:
    """A second node of the same name would replace the first, for example a sleeve its housing."""
    made = body(robot)
    arm = ArmScene(server.scene, robot)
    for name in ("housing", "axis", "link", "link-bar"):
        wanted = sum(part.name == name for parts in made.parts for part in parts)
        shown = [n for n in nodes_of(server.scene) if re.fullmatch(rf"{name}(-\d+)?", n.split("/")[-1])]
        assert len(shown) == wanted
    arm.remove()


@pytest.mark.parametrize("robot_id", ["scara", "stanford"])
def test_a_bar_stays_in_its_sleeve_over_the_whole_stroke(robot_id: str) -> None:
    """The sleeve stands at the origin of the joint's axis; the bar reaches from there to the next joint."""
    robot = Store().get(robot_id)
    made = body(robot)
    for link, parts in zip(made.chain.links[1:], made.parts[1:], strict=True):
        bar = next((part for part in parts if part.name == "link-bar"), None)
        if bar is None or link.joint is None or link.joint.limits is None:
            continue
        low, high = bar.mesh.bounds[:, 2]
        for q in link.joint.limits:
            assert low + q < 0.0, "the bar comes out at the back"
        assert low + link.joint.limits[1] > -0.1 * robot.reach, "and no further than it must"
        assert high + link.joint.limits[1] > 0.9 * link.joint.limits[1] - 0.1 * robot.reach
        return
    pytest.fail("no slide")


def test_a_body_is_made_once_for_all_visitors() -> None:
    robot = Store().get("pioneer5")
    assert body(robot) is body(kin.get_robot("pioneer5"))


@pytest.mark.parametrize("robot", CLASSICS, ids=[r.id for r in CLASSICS])
def test_joints_at_one_point_look_different(robot: kin.Robot) -> None:
    """Housings of joints that share an origin differ in size or place, and neighbours differ in colour."""
    made = body(robot)
    boxes = []
    for link, parts in zip(made.chain.links[1:], made.parts[1:], strict=True):
        housing = next(p for p in parts if p.name == "housing")
        assert housing.color == joint_color(link.index)
        boxes.append(housing.mesh.bounds)
        if np.linalg.norm(link.T_parent_axis[:3, 3]) < 1e-9 and len(boxes) > 1:
            assert np.abs(boxes[-1] - boxes[-2]).max() > 0.2 * made.size
    colors = [joint_color(k) for k in range(robot.n)]
    assert len(set(colors)) == robot.n


def test_a_box_is_closed_and_faces_outward() -> None:
    solid = box((-0.1, 0.2, 0.0), (0.3, 0.5, 0.2))
    mesh = trimesh.Trimesh(*solid)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(0.4 * 0.3 * 0.2)
    assert solid.bounds == pytest.approx(np.array([[-0.1, 0.2, 0.0], [0.3, 0.5, 0.2]]))
    assert len(solid.vertices) == 36, "edges are sharp: no triangles share a vertex"


def test_surfaces_of_tubes_face_outward() -> None:
    solid = tube(np.array([[0, 0, 0], [0, 0, 0.3], [0.2, 0, 0.3]], dtype=float), 0.02)
    mesh = trimesh.Trimesh(*solid, process=False)
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(math.pi * 0.02**2 * 0.47, rel=0.12)
    turning_back = tube(np.array([[0, 0, 0], [0, 0, 0.3], [0, 0, 0.1]], dtype=float), 0.02)
    assert np.isfinite(turning_back.vertices).all()


@pytest.mark.parametrize("aspect", [0.46, 0.9, 1.0, 956 / 720, 2.2])
@pytest.mark.parametrize("robot", CLASSICS, ids=[r.id for r in CLASSICS])
def test_the_default_view_holds_the_arm(robot: kin.Robot, aspect: float) -> None:
    position, look_at = camera.view(body(robot), aspect)
    forward = (look_at - position) / np.linalg.norm(look_at - position)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    points = kin.link_frames(robot, robot.q_home)[:, :3, 3]
    if (drawn := drawing(robot)) is not None:
        poses = link_poses(robot, robot.q_home[None])[0]
        shells = [
            part.mesh.vertices @ T[:3, :3].T + T[:3, 3]
            for parts, T in zip(drawn.parts, poses, strict=True)
            for part in parts
        ]
        points = np.vstack([points, *shells])
    points = points - position
    depth = points @ forward
    half = math.tan(camera.FOV / 2)
    assert (depth > 0).all()
    across = np.abs(points @ right) / depth / half / aspect
    upward = points @ up / depth / half
    assert across.max() < 1.0
    assert np.abs(upward).max() < 1.0
    assert max(across.max(), np.abs(upward).max()) > 0.2, "the arm should not be a speck"
    assert np.array_equal(look_at, body(robot).center)


def test_joint_labels_do_not_repeat_their_number() -> None:
    assert joints.label(Store().get("pioneer5"), 0) == "1 rotating base"
    assert joints.label(Store().get("redundant7"), 2) == "Joint 3"


def test_roll_pitch_yaw_round_trip_and_stay_finite_at_the_pole() -> None:
    for q in Store().get("redundant7").random_q(np.random.default_rng(5), 50):
        R = kin.fk(Store().get("redundant7"), q)[:3, :3]
        assert np.allclose(rotation(*rotations.roll_pitch_yaw(R)), R, atol=1e-9)
    pole = rotation(0.3, math.pi / 2, 1.1)
    assert np.allclose(rotation(*rotations.roll_pitch_yaw(pole)), pole, atol=1e-9)


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def test_the_readout_keeps_its_shape_and_shows_no_negative_zero() -> None:
    T = np.eye(4)
    T[:3, 3] = [-1e-9, 0.1234567, -1.5]
    text = readout.html(T, DEFAULT_UNITS)
    assert ">0.0<" in text
    assert "−0.0<" not in text
    assert ">123.5<" in text
    assert ">−1500.0<" in text
    assert "rad" in readout.html(T, Units(degrees=False))


def test_sentences_of_the_status_have_true_minus_signs_and_errors_what_was_typed():
    text = status.html(status.Notice("advice", "Near", "straight (θ3 = -87.3°), 6-joint arm"), "y = -2 mm")
    assert "θ₃ = −87.3°" in text
    assert "y = −2 mm" in text
    assert "6-joint" in text
    assert "got -1," in status.html(status.Notice("error", "Invalid input", "seed: got -1, expected 0"))


def test_the_status_is_shown_by_words_symbol_and_colour() -> None:
    for kind, (symbol, color) in status.LOOKS.items():
        text = status.html(status.Notice(kind, "Headline", "a <b>sentence</b>"))
        assert symbol in text
        assert color in text
        assert "Headline" in text
        assert "<b>sentence" not in text
    assert len({look[0] for look in status.LOOKS.values()}) == len(status.LOOKS)


@pytest.mark.parametrize(
    ("robot_id", "shift", "title"),
    [
        ("pioneer5", (0.0, 0.02, 0.0), "Reached with roll error"),
        ("redundant7-craig", (0.0, 0.05, 0.0), "Reached"),
        ("redundant7-craig", (2.0, 0.0, 0.0), ""),
    ],
)
def test_notices_describe_the_event(robot_id: str, shift: tuple[float, ...], title: str) -> None:
    robot = kin.get_robot(robot_id)
    T = kin.fk(robot, robot.q_home)
    T[:3, 3] += shift
    result = kin.solve_ik(robot, T)
    shown = status.notice(result, DEFAULT_UNITS)
    assert shown.title.startswith(title)
    assert shown.detail.lower() in result.reason.lower()
    assert len(shown.detail) > 10
    if result.distance:
        assert f"{result.distance * 1000:.0f} mm" in shown.title


def test_half_a_turn_has_the_same_sign_in_degrees_and_radians() -> None:
    T = np.eye(4)
    for error in (-1e-12, 1e-12):  # on either side of half a turn, by rounding only
        T[1:3, 1:3] = [[math.cos(math.pi + error), -math.sin(math.pi + error)], [math.sin(math.pi + error), -1.0]]
        for degrees, text in ((True, "180.0"), (False, "3.142")):
            assert f">{text}<" in readout.html(T, Units(degrees=degrees))
    T[0, 3] = -0.18
    assert ">−180.0<" in readout.html(T, DEFAULT_UNITS), "a length keeps its sign"


def test_notices_and_readout_follow_the_units() -> None:
    robot = kin.get_robot("redundant7-craig")
    T = kin.fk(robot, robot.q_home)
    T[0, 3] += 2.0
    result = kin.solve_ik(robot, T)
    for length, factor, decimals in (("cm", 100, 1), ("m", 1, 3)):
        units = Units(length=length)
        far = f"{factor * result.distance:.{decimals}f} {length}"
        assert status.notice(result, units).title.endswith(f" by {far}")
        assert f">{factor * T[0, 3]:.{decimals + 1}f}<" in readout.html(T, units)
        assert f">{length}<" in readout.html(T, units)
        assert "mm" not in status.notice(result, units).detail + readout.html(T, units)
