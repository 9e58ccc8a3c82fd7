"""The lesson "Velocity": its numbers against the core's, its steps against forward kinematics."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import bare_page
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.declared.press import Press
from app.viewer.lessons.velocity import views
from app.viewer.lessons.velocity.drawing import ring_arrow, sides, wxyz_along
from app.viewer.lessons.velocity.ellipsoids import axes_of, condition, lost, part_of, semi_axes, task_rates
from app.viewer.lessons.velocity.jog import BUTTONS, button, moved, step
from app.viewer.lessons.velocity.lesson import VelocityLesson
from app.viewer.lessons.velocity.views import NEAR, nice, real, state_of
from app.viewer.scene.meshes import body
from app.viewer.server import ViewerServer
from kin.differential.task import natural_task, task_jacobian, usual_rank
from kin.transforms import rotation_angle, rotation_from_wxyz, vector_angle
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
ROBOTS = CLASSICS
KINDS = ("velocity", "turning", "force", "moment")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    for name, least in (("robot", 1), ("six_joints", 6)):
        if name in metafunc.fixturenames:
            arms = [r for r in ROBOTS if r.n >= least]
            metafunc.parametrize(name, arms, ids=[r.id for r in arms])


def configurations(robot: kin.Robot, count: int = 5) -> list[np.ndarray]:
    return [robot.q_home.copy(), *robot.random_q(np.random.default_rng(3), count)]


def wrist_singular(robot_id: str, joint: int) -> tuple[kin.Robot, np.ndarray]:
    robot = STORE.get(robot_id)
    q = robot.q_home.copy()
    q[joint] = 0.0
    return robot, q


# Computations


def test_ellipsoids_are_those_of_the_jacobian(robot: kin.Robot) -> None:
    for q in configurations(robot):
        J = kin.jacobian(robot, q)
        for kind in KINDS:
            rows = part_of(J, kind)
            axes = axes_of(rows)
            assert np.allclose(axes.R @ axes.R.T, np.eye(3), atol=1e-12)
            assert np.linalg.det(axes.R) > 0.0
            assert np.allclose((axes.R * axes.values**2) @ axes.R.T, rows @ rows.T, atol=1e-12)
            semi = semi_axes(axes.values, kind)
            if kind in ("force", "moment"):
                # The tip of each finite axis is held by joint torques of length 1.
                for k in np.flatnonzero(axes.values > 1e-9):
                    assert np.linalg.norm(rows.T @ axes.R[:, k] * semi[k]) == pytest.approx(1.0)
            else:
                # A column is the twist of one joint at unit speed: it lies in the ellipsoid.
                tips = (axes.R.T @ rows)[axes.values > 1e-9]
                assert (np.linalg.norm(tips / semi[axes.values > 1e-9, None], axis=0) < 1.0 + 1e-9).all()


def test_a_flat_ellipsoid_has_unbounded_forces() -> None:
    values = axes_of(part_of(kin.jacobian(STORE.get("scara"), STORE.get("scara").q_home), "turning")).values
    assert values[1:] == pytest.approx(0.0, abs=1e-12)
    assert semi_axes(np.array([2.0, 0.5, 0.0]), "force").tolist() == [0.5, 2.0, math.inf]
    assert condition(np.array([2.0, 0.0])) == math.inf
    assert axes_of(np.ones((3, 1))).values.tolist() == pytest.approx([math.sqrt(3.0), 0.0, 0.0])


def test_singular_values_give_yoshikawas_measure(robot: kin.Robot) -> None:
    for q in configurations(robot):
        rates = task_rates(robot, q)
        J = task_jacobian(robot, q)
        if usual_rank(robot, natural_task(robot)) == len(J):  # a planar arm never leaves its plane
            assert np.prod(rates.values) == pytest.approx(math.sqrt(abs(np.linalg.det(J @ J.T))), abs=1e-9)
        else:
            values = np.linalg.svd(J, compute_uv=False)[: usual_rank(robot, natural_task(robot))]
            assert np.prod(rates.values) == pytest.approx(np.prod(values), abs=1e-12)
        if robot.n > 5:
            assert np.prod(rates.values) == pytest.approx(float(kin.manipulability(robot, q)), abs=1e-12)
        linear = axes_of(kin.jacobian(robot, q)[:3]).values
        assert np.prod(linear[: robot.n]) == pytest.approx(float(kin.manipulability(robot, q, "linear")), abs=1e-9)


@pytest.mark.parametrize(
    ("robot_id", "joint"),
    [("irb120", 4), ("puma560", 4), ("ur5", 4), ("pioneer5", 4), ("pioneer5", 2), ("scara", 1)],
)
def test_no_joint_motion_has_a_component_along_a_lost_direction(robot_id: str, joint: int) -> None:
    robot, q = wrist_singular(robot_id, joint)
    nearest = real(kin.singularities(robot, q))[0]
    assert state_of(nearest, robot.reach) == "at"
    twists = lost(task_rates(robot, q))
    assert len(twists) == 1
    assert np.linalg.norm(twists[0]) == pytest.approx(1.0)
    assert twists[0] @ kin.jacobian(robot, q) == pytest.approx(0.0, abs=1e-9)


def test_far_from_near_and_at_a_singularity(robot: kin.Robot) -> None:
    for q in configurations(robot, 20):
        for s in real(kin.singularities(robot, q)):
            state = state_of(s, robot.reach)
            if s.unit == "rad":
                assert state == ("near" if s.distance < NEAR else "far")
    assert nice(0.13) == 0.2
    assert nice(5.0) == 5.0
    assert nice(61.0) == 100.0


def test_directions_in_words() -> None:
    R = kin.fk(STORE.get("irb120"), STORE.get("irb120").q_home)[:3, :3]
    tilted = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
    assert views.axis_name(np.array([0.0, -1.0, 0.0]), R) == "base y"
    assert views.axis_name(tilted[:, 2] * 3.0, tilted) == "tool z"
    assert views.axis_name(np.array([-1.0, -1.0, 0.0]), tilted) == "(0.71, 0.71, 0.00)"
    assert views.lost_words(np.array([0, 1.0, 0, 0, 0, 0]), R) == "Cannot move along base y."
    assert views.lost_words(np.array([0, 0, 0, 1.0, 0, 0]), R) == "Cannot turn about base x."
    assert "without turning" in views.lost_words(np.array([0, 0.6, 0, 0.8, 0, 0]), R)


def test_round_arrows_turn_about_their_axis() -> None:
    for axis in (*np.eye(3), *-np.eye(3), np.array([0.3, -0.5, -2.0])):
        R = rotation_from_wxyz(np.array(wxyz_along(axis)))
        assert R[:, 2] == pytest.approx(axis / np.linalg.norm(axis))
    for double in (False, True):
        mesh = ring_arrow(double)
        assert len(mesh.faces) > 500
        assert np.isfinite(mesh.vertices).all()


# Jogging


@pytest.mark.parametrize("frame", ["base", "tool"])
@pytest.mark.parametrize("axis", range(6))
def test_a_step_moves_the_tool_exactly(six_joints: kin.Robot, axis: int, frame: str) -> None:
    robot = six_joints
    amount = 0.004 if axis < 3 else math.radians(1.5)
    T = kin.fk(robot, robot.q_home)
    made = step(robot, robot.q_home, kin.IKOptions(), axis, amount, frame)
    assert made.q is not None, made.notice
    after = kin.fk(robot, made.q)
    wanted = moved(T, axis, amount, frame)
    assert np.abs(after - wanted).max() < 1e-8
    along = T[:3, axis % 3] if frame == "tool" else np.eye(3)[axis % 3]
    if axis < 3:
        assert after[:3, 3] - T[:3, 3] == pytest.approx(amount * along, abs=1e-8)
    else:
        assert rotation_angle(T[:3, :3], after[:3, :3]) == pytest.approx(amount, abs=1e-8)
        assert (after[:3, :3] @ T[:3, :3].T) @ along == pytest.approx(along, abs=1e-8)
    if kin.branch_names(robot):
        assert kin.branch_of(robot, made.q) == kin.branch_of(robot, robot.q_home)


def test_five_joints_keep_point_and_approach_and_report_the_error() -> None:
    robot = STORE.get("pioneer5")
    T = kin.fk(robot, robot.q_home)
    made = step(robot, robot.q_home, kin.IKOptions(), 0, 0.01, "base")
    assert made.q is not None
    after = kin.fk(robot, made.q)
    assert after[:3, 3] - T[:3, 3] == pytest.approx([0.01, 0.0, 0.0], abs=1e-8)
    assert vector_angle(after[:3, 2], T[:3, 2]) < 1e-8
    assert made.notice.kind == "compromise"
    assert "roll is off by" in made.notice.detail
    roll = step(robot, robot.q_home, kin.IKOptions(), 5, 0.02, "tool")
    assert roll.q is None
    assert "5 joints cannot" in roll.notice.detail
    assert step(robot, robot.q_home, kin.IKOptions(task="approach"), 0, 0.01, "base").notice.kind == "reached"


def test_directions_outside_the_task_are_not_jogged() -> None:
    robot = STORE.get("irb120")
    for task, axis, frame in (("position", 3, "base"), ("approach", 5, "tool")):
        made = step(robot, robot.q_home, kin.IKOptions(task=task), axis, 0.02, frame)
        assert made.q is None
        assert "leaves" in made.notice.detail
    made = step(robot, robot.q_home, kin.IKOptions(task="position"), 1, 0.01, "base")
    assert made.q is not None
    assert made.notice.kind == "reached"


def test_a_scara_lifts_and_swings_but_does_not_tilt() -> None:
    robot = STORE.get("scara")
    for axis, amount in ((0, -0.005), (2, -0.005), (5, 0.02)):
        made = step(robot, robot.q_home, kin.IKOptions(), axis, amount, "base")
        assert made.q is not None, (axis, made.notice)
    made = step(robot, robot.q_home, kin.IKOptions(), 3, 0.02, "base")
    assert made.q is None
    assert "Not moved" in made.notice.title


def test_at_a_limit_or_out_of_reach_jogging_is_refused_with_the_reason() -> None:
    robot = STORE.get("irb120")
    made = step(robot, robot.q_home, kin.IKOptions(), 2, 5.0, "base")
    assert made.q is None
    assert made.notice.title.startswith("Not moved: out of reach")
    scara = STORE.get("scara")
    q = scara.q_home.copy()
    slide = [j.kind for j in scara.joints].index("prismatic")
    for end, sign in ((scara.lower[slide], -1.0), (scara.upper[slide], 1.0)):
        q[slide] = end
        down = kin.jacobian(scara, q)[2, slide] * sign
        made = step(scara, q, kin.IKOptions(), 2, 0.02 * math.copysign(1.0, down), "base")
        assert made.q is None
        assert "Not moved: outside the limits" in made.notice.title
        assert made.notice.detail


def test_a_jump_of_the_joints_is_refused_as_a_jump() -> None:
    robot = STORE.get("irb120")
    q = robot.q_home.copy()
    q[4] = math.radians(0.5)
    sideways = [step(robot, q, kin.IKOptions(), axis, math.radians(2.0), "tool") for axis in (3, 4)]
    refused = [made for made in sideways if made.q is None]
    assert refused
    assert "a joint would have to jump" in refused[0].notice.title
    assert "a singularity is near" in refused[0].notice.detail


def test_a_locked_joint_stays_where_it_is() -> None:
    robot = STORE.get("iiwa14")
    locked = tuple(float(v) if i == 2 else None for i, v in enumerate(robot.q_home))
    made = step(
        robot, robot.q_home, kin.IKOptions(constraints=kin.JointConstraints(locked=locked)), 0, 0.005, "base"
    )
    assert made.q is not None
    assert made.q[2] == robot.q_home[2]
    all_locked = tuple(robot.q_home.tolist())
    made = step(
        robot, robot.q_home, kin.IKOptions(constraints=kin.JointConstraints(locked=all_locked)), 0, 0.005, "base"
    )
    assert made.q is None
    assert made.notice.title.startswith("Not moved")


def test_a_tap_is_one_step_and_holding_repeats() -> None:
    press = Press()
    steps = [press.held(0.1 * k) for k in range(8)]
    assert steps == [True, False, False, False, False, True, True, True]
    assert not press.clicked(1.6), "a slow page lets go late"
    assert press.held(1.7)
    assert not press.clicked(1.75)
    assert press.clicked(1.9), "by keyboard only the click comes"
    assert press.number == 3
    assert press.held(2.5)
    assert press.clicked(9.0), "let go outside of the button, then the keyboard"


# In the page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


@pytest.fixture
def tab(server: int) -> Iterator[FakeBrowser]:
    with FakeBrowser(server) as opened:
        opened.wait(lambda: any(m["props"].get("label") == "Lesson" for m in opened.gui.values()), 60.0)
        opened.open_lesson("Velocity")
        opened.wait(lambda: "data-singular" in opened.html, 60.0)
        yield opened


def test_one_of_the_manipulabilities_is_that_of_postures_and_clouds(robot: kin.Robot) -> None:
    q = robot.random_q(np.random.default_rng(4))
    text = views.values_html(robot, task_rates(robot, q), kin.jacobian(robot, q))
    shown = re.search(r"<td>pose</td><td data-w>([\d.]+)<", text)
    assert shown
    assert float(shown[1]) == pytest.approx(float(kin.manipulability(robot, q)), abs=6e-5)


def see_all(tab: FakeBrowser) -> None:
    """Have the first question answered, which asks for what the lesson shows, and go home."""
    tab.say("feature", ["guide", ["reveal", "1", 1], None])
    tab.set("Go to", "Home")


def use(tab: FakeBrowser, robot: kin.Robot) -> None:
    tab.set("Robot", robot.name)
    see_all(tab)
    tab.wait(lambda: len(numbers(tab, "data-j")) == 6 * robot.n and len(columns(tab)) == robot.n, 30.0)


def columns(tab: FakeBrowser) -> list[str]:
    return [o for m in tab.gui.values() if m["props"].get("label") == "Column" for o in m["props"]["options"]]


def numbers(tab: FakeBrowser, mark: str) -> list[float]:
    cells = re.findall(rf"<td {mark}[^>]*>(?:<span[^>]*>)?([−\d.]+)<", tab.html)
    return [float(c.replace("−", "-")) for c in cells]


def press(tab: FakeBrowser, label: str) -> None:
    tab.send("GuiUpdateMessage", uuid=tab.element(label), updates={"value": True})


def shown(tab: FakeBrowser, J: np.ndarray, decimals: int) -> bool:
    cells = numbers(tab, "data-j")
    return len(cells) == J.size and bool(np.abs(np.array(cells) - J.ravel()).max() < 0.51 * 10.0**-decimals)


def test_the_matrix_shows_the_current_jacobian_in_either_frame(tab: FakeBrowser) -> None:
    robot = CLASSICS[0]
    q = robot.q_home.copy()
    q[0] = math.radians(35.0)
    see_all(tab)
    tab.set("1 rotating base", 35.0)
    tab.wait(lambda: shown(tab, kin.jacobian(robot, q), 3))
    tab.set("Frame", "Tool")
    tab.wait(lambda: shown(tab, kin.jacobian(robot, q, "tool"), 3))
    sigmas = np.array(numbers(tab, "data-sigma"))
    assert sigmas == pytest.approx(np.linalg.svd(task_jacobian(robot, q))[1], abs=6e-5)
    iiwa = STORE.get("iiwa14")
    use(tab, iiwa)
    tab.wait(lambda: shown(tab, kin.jacobian(iiwa, iiwa.q_home, "tool"), 2))


def test_the_ellipsoid_moves_by_pose_and_scale_and_no_mesh_is_sent_again(tab: FakeBrowser) -> None:
    name = next(n for n in tab.nodes if n.endswith("/body"))
    tab.settle()
    tab.log.clear()
    tab.set("2 rotating elbow", 51.0)
    tab.wait(lambda: any(m["type"] == "SetOrientationMessage" and m["name"] == name for m in tab.log))
    tab.settle()
    assert not [m for m in tab.log if "vertices" in m.get("props", {}) or "vertices" in m.get("updates", {})]
    root = name.removesuffix("/body")
    assert tab.local(root)[:3, 3] == pytest.approx(tab.tool_pose()[:3, 3], abs=2e-5)
    assert len({n.split("/")[1] for n in tab.nodes if n.startswith("/velocity")}) == 1


def test_jogging_moves_the_tool_by_the_step(tab: FakeBrowser) -> None:
    robot = STORE.get("irb120")
    use(tab, robot)
    tab.set("Step, mm", 12.5)
    T = kin.fk(robot, robot.q_home)
    press(tab, "−z")
    tab.wait(lambda: np.allclose(tab.tool_pose()[:3, 3], T[:3, 3] - [0, 0, 0.0125], atol=1e-9))
    tab.wait(lambda: "Jogged 12.5 mm along −z of the base" in tab.html)
    tab.send("GuiButtonHoldMessage", uuid=tab.element("+y"), frequency=10.0)
    press(tab, "+y")
    tab.wait(lambda: np.allclose(tab.tool_pose()[:3, 3], T[:3, 3] + [0, 0.0125, -0.0125], atol=1e-9))
    tab.settle()
    assert tab.tool_pose()[:3, 3] == pytest.approx(T[:3, 3] + [0, 0.0125, -0.0125], abs=1e-9), "one tap, one step"
    tab.set("Step, mm", -3)
    tab.wait(lambda: "Invalid input" in tab.html)


@pytest.mark.full
def test_steps_and_sentences_follow_the_unit_of_length(tab: FakeBrowser) -> None:
    robot = STORE.get("irb120")
    use(tab, robot)
    tab.set("Step, mm", 12.5)
    assert "100 mm in the scene are" in tab.html
    for length, shown, sample in (("cm", 1.25, "10 cm"), ("m", 0.0125, "0.1 m")):
        tab.set("Lengths", length)
        tab.wait(lambda length=length: f"Step, {length}" in labels(tab))  # type: ignore[misc]
        assert tab.value(f"Step, {length}") == pytest.approx(shown)
        tab.wait(lambda sample=sample: f"{sample} in the scene are" in tab.html)  # type: ignore[misc]
        T = tab.tool_pose()
        press(tab, "+z")
        tab.wait(lambda T=T: np.allclose(tab.tool_pose()[2, 3], T[2, 3] + 0.0125, atol=1e-9))  # type: ignore[misc]
        tab.wait(lambda shown=shown, length=length: f"Jogged {shown} {length} along +z" in tab.html)  # type: ignore[misc]
    tab.set("Step, m", 0.002)
    T = tab.tool_pose()
    press(tab, "−z")
    tab.wait(lambda: np.allclose(tab.tool_pose()[2, 3], T[2, 3] - 0.002, atol=1e-9))
    tab.set("Step, m", 2.0)
    tab.wait(lambda: "a number from 0.0001 to 0.1" in tab.html)


def labels(tab: FakeBrowser) -> list[object]:
    return [m["props"].get("label") for m in tab.gui.values()]


def test_distances_to_a_singularity_follow_the_units() -> None:
    robot = STORE.get("ur5")
    found = next(s for s in kin.singularities(robot, robot.q_home) if s.unit == "m")
    for length in ("mm", "cm", "m"):
        units = Units(length=length)
        assert views.distance(found, units) == units.distance(found.distance)
        assert f">{units.distance(found.distance)}<" in views.others_html(robot, (found,), units)


@pytest.mark.full
def test_a_singular_pose_is_shown_with_its_kind_and_lost_directions(tab: FakeBrowser) -> None:
    use(tab, STORE.get("irb120"))
    assert 'data-singular="far"' in tab.html
    tab.set("5 axis 5", 5.0)
    tab.wait(lambda: "Nearest: the wrist singularity, 5.0° away. There " in tab.html)
    assert 'data-singular="near"' in tab.html
    assert "Near a wrist singularity" in tab.html
    tab.set("Radians", True)
    tab.wait(lambda: "0.087 rad away" in tab.html)
    assert "Turn, rad" in [m["props"].get("label") for m in tab.gui.values()]
    tab.set("5 axis 5", 0.0)
    tab.wait(lambda: 'data-singular="at"' in tab.html)
    assert "At a wrist singularity" in tab.html
    assert "Cannot" in tab.html
    tab.set("Show", "Moment")
    tab.wait(lambda: 'data-ellipsoid="moment"' in tab.html)


def test_a_column_is_drawn_and_removed(tab: FakeBrowser) -> None:
    def drawn(part: str) -> bool:
        return any(n.endswith(part) and tab.visible.get(n) is not False for n in tab.nodes)

    assert not drawn("/column")
    assert not drawn("/turn")
    tab.set("Column", "2")
    tab.wait(lambda: drawn("/column") and drawn("/turn"))
    tab.wait(lambda: "Joint 2 at 1 rad/s" in tab.html)
    tab.set("Column", "2")
    tab.wait(lambda: not drawn("/column") and not drawn("/turn"))
    tab.set("Column", "1")
    tab.wait(lambda: drawn("/column"))
    tab.set("Lesson", "None")
    tab.wait(lambda: not [n for n in tab.nodes if n.startswith("/velocity")])


@pytest.mark.full
def test_every_arm_can_be_shown(tab: FakeBrowser) -> None:
    for robot in CLASSICS:
        use(tab, robot)
        tab.wait(lambda robot=robot: shown(tab, kin.jacobian(robot, robot.q_home), 3 if robot.n < 6 else 2))  # type: ignore[misc]
    assert 'data-status="error"' not in tab.html


def test_buttons_are_named_after_their_action() -> None:
    assert [button(*b) for b in BUTTONS][:4] == ["−x", "+x", "−y", "+y"]
    assert len({button(*b) for b in BUTTONS}) == 12


def test_a_shared_state_is_restored_and_an_invalid_one_is_ignored() -> None:
    with bare_page(STORE.get("ur5")) as page:
        lesson = page.open(VelocityLesson)
        first = lesson.state()
        force = {"on": True, "force": [1.0, -2.0, 3.0]}
        other = {"frame": "tool", "ellipsoid": "moment", "joint": 6, "step": 0.02, "turn": 0.1, "statics": force}
        lesson.restore(other)
        assert lesson.state() == other
        lesson.restore({"frame": ["tool"], "ellipsoid": "soul", "joint": 7, "step": math.nan, "turn": "1"})
        assert lesson.state() == other
        lesson.restore({"joint": True, "step": 1e9, "turn": -1.0, "statics": {"on": True, "force": [1e9, 0, 0]}})
        assert lesson.state() == other
        lesson.restore(first)
        assert lesson.state() == first
        # Late events of replaced fields are not read in the new units.
        page.set("Step, mm", 5.0)
        page.set("Turn, °", 0.2)
        page.units = Units(False, "cm")
        lesson.on_style()
        page.rest()
        assert lesson.state() == first
        page.set("Step, cm", 5.0)
        page.set("Turn, rad", 0.2)
        page.rest()
        assert lesson.state() == {**first, "step": 0.05, "turn": 0.2}
        lesson.restore(first)
        lesson.restore({"ellipsoid": "none"})
        assert lesson.state()["ellipsoid"] == "none"
        lesson.remove()


def test_the_picture_is_to_have_the_arrows_of_lost_directions() -> None:
    robot = STORE.get("ur5")
    with bare_page(robot) as page:
        lesson = page.open(VelocityLesson)
        page.rest()
        page.kept.clear()
        q = robot.q_home.copy()
        q[4] = 0.0
        page.move_to(q)
        page.rest()
        J, tool = numpy_arm.jacobian(robot, q), numpy_arm.pose(robot, q)[:3, 3]
        lost = np.linalg.svd(J)[0][:, -1]
        aside = page.kept[-1] - tool
        far = np.linalg.norm(aside, axis=1)
        assert far.max() > 0.3 * body(robot).radius, "arrows end beyond those of the gizmo"
        along = np.abs(aside @ lost[:3]) / np.linalg.norm(lost[:3])
        assert np.isclose(along, far, rtol=1e-3).sum() >= 2, "the way that is lost, to both sides"
        page.move_to(robot.q_home)
        page.rest()
        assert len(page.kept[-1]) == 0
        lesson.remove()


def test_values_are_labelled_at_axis_ends_that_are_apart_on_screen() -> None:
    towards = np.array([1.0, 1.0, 0.5])
    rng = np.random.default_rng(5)
    for _ in range(50):
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        tips = R * rng.uniform(0.1, 1.0, 3)
        signs = sides(tips, towards)
        assert set(np.abs(signs)) == {1.0}

        def apart(signs: np.ndarray, tips: np.ndarray = tips) -> float:
            ahead = towards / np.linalg.norm(towards)
            ends = [s * (t - ahead * (ahead @ t)) for s, t in zip(signs, tips.T, strict=True)]
            return min(float(np.linalg.norm(ends[i] - ends[k])) for i, k in ((0, 1), (0, 2), (1, 2)))

        every = [apart(np.array(choice)) for choice in itertools.product((1, -1), repeat=3)]
        assert apart(signs) == pytest.approx(max(every), abs=2e-3)
