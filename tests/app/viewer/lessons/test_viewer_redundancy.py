"""The lesson "Redundancy": the tool is held, the ring is exact, the trade of two coaxial joints is explained."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from arms import CLASSICS, GEN3, SAWYER, eight_joints
from fake_browser import ANSWER, FakeBrowser

import kin
from app.shared.store import Store
from app.viewer import self_motion
from app.viewer.lessons.redundancy import views
from app.viewer.lessons.redundancy.path import STEPS, elbow_paths, has_path
from app.viewer.lessons.redundancy.ring import arc_segments, coaxial, elbow_circle, joint_axis, trade_segments
from app.viewer.panel.joints import label
from kin.ik import Redundancy
from kin.units import DEFAULT_UNITS, RADIANS, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, SRS, IIWA, PRINTED, PUMA, PANDA, UR5 = (
    STORE.get(name) for name in ("pioneer5", "redundant7-craig", "iiwa14", "redundant7", "puma560", "panda", "ur5")
)


def home(robot: kin.Robot) -> np.ndarray:
    return kin.fk(robot, robot.q_home)


# Self-motion


def test_redundancy_parameters_are_those_that_can_be_requested() -> None:
    straight = np.array([0.3, -0.9, 1.1, 0.4, 0.0, 0.2])
    T = kin.fk(UR5, straight)
    assert kin.solve_ik(UR5, T, q_seed=straight, branch="seed").redundancy, "free at the singularity only"
    assert self_motion.redundancy_at(UR5, T, kin.IKOptions(), straight) == ()
    free = self_motion.redundancy_at(PIONEER, home(PIONEER), kin.IKOptions(task="position"), PIONEER.q_home)
    assert [item.name for item in free] == ["theta4", "theta5"]


@pytest.mark.parametrize("robot", [SRS, IIWA, PRINTED], ids=lambda robot: robot.id)
def test_each_end_of_a_range_is_a_limit_of_the_named_joint(robot: kin.Robot) -> None:
    T, q = home(robot), robot.q_home
    (item,) = self_motion.redundancy_at(robot, T, kin.IKOptions(), q)
    found = self_motion.ends(robot, T, kin.IKOptions(), q, item)
    assert len(found) == 2 * len(item.intervals)
    for end in found:
        inside = math.copysign(1e-6, item.value - end.value)
        if not any(low <= end.value + inside <= high for low, high in item.intervals):
            inside = -inside
        result = self_motion.self_motion(robot, T, kin.IKOptions(), q, item.name, end.value + inside)
        there = result.solutions[0].q
        room = min(there[end.joint] - robot.lower[end.joint], robot.upper[end.joint] - there[end.joint])
        assert abs(room) < 1e-4
        beyond = kin.solve_ik(robot, T, q_seed=q, branch="seed", redundancy={item.name: end.value - inside})
        assert beyond.status == "limits"
        assert end.joint in {v.joint for v in beyond.violations}


def test_a_range_across_the_seam_is_one_range() -> None:
    pi = math.pi
    split = Redundancy("psi", "arm angle ψ", 3.0, ((-pi, -2.0), (-1.0, 1.0), (2.5, pi)))
    assert self_motion.range_of(split) == (2.5, pytest.approx(2 * pi - 2.0))
    assert self_motion.range_of(split._replace(value=-2.5)) == (pytest.approx(2.5 - 2 * pi), -2.0)
    assert self_motion.range_of(split._replace(value=0.0)) == (-1.0, 1.0)
    assert self_motion.range_of(split._replace(value=1.5)) is None
    assert self_motion.range_of(Redundancy("psi", "", 1.0, ((-pi, pi),))) == (-pi, pi)
    assert self_motion.range_of(Redundancy("theta1", "", 3.0, ((-pi, -2.0), (2.5, pi)))) == (2.5, pi)


# Geometry


@pytest.mark.parametrize("robot", [SRS, IIWA], ids=lambda robot: robot.id)
def test_the_elbow_is_on_its_circle_at_the_arm_angle(robot: kin.Robot) -> None:
    rng = np.random.default_rng(4)
    for q in robot.random_q(rng, 10):
        circle = elbow_circle(robot, q)
        assert circle is not None
        (free,) = self_motion.redundancy_at(robot, kin.fk(robot, q), kin.IKOptions(), q)
        points = kin.link_frames(robot, q)[:, :3, 3]
        assert np.linalg.norm(points - circle.at(free.value), axis=1).min() < 1e-9
        for point in (circle.shoulder, circle.wrist):
            assert np.linalg.norm(points - point, axis=1).min() < 1e-9


def with_joint_turned_round(robot: kin.Robot, joint: int) -> kin.Robot:
    """The same arm in space, by a standard table with one joint reversed."""
    rows, home, base = list(robot.rows), list(robot.home), np.array(robot.base)
    row, home[joint] = rows[joint], -home[joint]
    assert row.limits is not None
    low, high = row.limits
    rows[joint] = replace(row, theta=-row.theta, d=-row.d, alpha=row.alpha + math.pi, limits=(-high, -low))
    if joint:
        rows[joint - 1] = replace(rows[joint - 1], alpha=rows[joint - 1].alpha + math.pi)
    else:
        base = base @ np.diag([1.0, -1.0, -1.0, 1.0])
    return replace(robot, id="turned", rows=tuple(rows), home=tuple(home), base=tuple(map(tuple, base.tolist())))


@pytest.mark.parametrize("joint", [0, 2, 4, 6])
def test_the_elbow_is_on_its_circle_with_reversed_joints(joint: int) -> None:
    test_the_elbow_is_on_its_circle_at_the_arm_angle(with_joint_turned_round(IIWA, joint))


@pytest.mark.parametrize("joint", [0, 1])
def test_coaxial_joints_may_have_opposite_directions(joint: int) -> None:
    robot = with_joint_turned_round(PRINTED, joint)
    assert coaxial(robot)
    q = robot.q_home + 0.3
    (free,) = self_motion.redundancy_at(robot, kin.fk(robot, q), kin.IKOptions(), q)
    (low, high) = free.intervals[0]
    rays = []
    for value in (low + 1e-3, 0.5 * (low + high), high - 1e-3):
        there = kin.solve_ik(robot, kin.fk(robot, q), q_seed=q, branch="seed", redundancy=value).solutions[0].q
        assert there[0] == value
        chords, whose = trade_segments(robot, there, 0.1)
        rays.append(chords[whose == 2])
    assert np.allclose(rays, rays[0])


def test_other_arms_have_no_circle() -> None:
    assert all(elbow_circle(robot, robot.q_home) is None for robot in (PIONEER, PRINTED, PUMA, PANDA))


def test_the_arcs_of_the_ring_end_where_the_ranges_end() -> None:
    circle = elbow_circle(SRS, SRS.q_home)
    assert circle is not None
    chords, inside = arc_segments(circle, [(-1.949, 1.2345)], 1.3)
    assert np.allclose(chords[0, 0], chords[-1, 1]), "the circle closes"
    feasible = chords[inside]
    assert np.allclose(feasible[0, 0], circle.at(-1.949, 1.3))
    assert np.allclose(feasible[-1, 1], circle.at(1.2345, 1.3))
    assert not arc_segments(circle, (), 1.0)[1].any()


def test_coaxial_joints_are_found_and_a_trade_keeps_their_sum() -> None:
    assert [robot.id for robot in CLASSICS if coaxial(robot)] == ["redundant7"]
    q = PRINTED.q_home.copy()
    traded = q.copy()
    traded[0] += 0.7
    traded[1] -= 0.7
    assert np.allclose(kin.fk(PRINTED, traded), kin.fk(PRINTED, q), atol=1e-12)
    (a, i), (b, k) = (trade_segments(PRINTED, x, 0.1) for x in (q, traded))
    assert np.allclose(a[i == 2], b[k == 2])
    tips = [chords[numbers == 0][-1, 1] for chords, numbers in ((a, i), (b, k))]
    assert np.linalg.norm(tips[1] - tips[0]) > 0.05
    assert np.allclose(views.frame_origins(PRINTED, q), views.frame_origins(PRINTED, traded), atol=1e-12)


@pytest.mark.parametrize("robot", CLASSICS, ids=lambda robot: robot.id)
def test_a_joint_turns_the_tool_about_its_joint_axis(robot: kin.Robot) -> None:
    q = robot.random_q(np.random.default_rng(6))
    J = kin.jacobian(robot, q)
    for i in range(robot.n):
        point, axis = joint_axis(robot, q, i)
        assert np.allclose(J[3:, i] if robot.revolute[i] else J[:3, i], axis, atol=1e-9)
        if robot.revolute[i]:
            assert np.allclose(J[:3, i], np.cross(axis, kin.fk(robot, q)[:3, 3] - point), atol=1e-9)


# Words


def test_residuals_are_measured_by_the_task_and_never_rounded_to_nothing() -> None:
    held = np.eye(4)
    T = np.eye(4)
    T[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    T[0, 3] = 2e-13
    assert views.residual(T, held, "pose") == (2e-13, pytest.approx(math.pi / 2))
    assert views.residual(T, held, "approach") == (2e-13, 0.0)
    assert views.residual(T, held, "position") == (2e-13, None)
    assert views.small(2e-13, DEFAULT_UNITS.lengths) == "2·10⁻¹⁰ mm"
    assert views.small(0.0, DEFAULT_UNITS.lengths) == "0 mm"
    assert views.small(0.00125, DEFAULT_UNITS.lengths) == "1.25 mm"
    assert views.small(0.00125, Units(length="cm").lengths) == "0.125 cm"
    assert views.small(2e-13, Units(length="m").lengths) == "2·10⁻¹³ m"
    assert views.small(0.5, RADIANS) == "0.5000 rad"
    assert "1·10⁻⁴ cm, 0.5000 rad.<br>Elbow moved 0 cm." in views.residual_html(1e-6, 0.5, 0.0, Units(False, "cm"))


def test_the_redundancy_is_explained_for_every_arm_and_task() -> None:
    def idea(robot: kin.Robot, task: kin.ik.Task) -> str:
        free = self_motion.redundancy_at(robot, home(robot), kin.IKOptions(task=task), robot.q_home)
        elbow = elbow_circle(robot, robot.q_home) is not None
        return views.idea(robot, task, free, coaxial(robot), elbow)

    assert idea(PUMA, "pose").startswith("No redundancy: 6 joints, task dimension 6")
    assert idea(PRINTED, "pose") == views.TRADE
    assert idea(SRS, "pose") == views.ELBOW
    assert "θ4 and θ5 can have any value" in idea(PIONEER, "position")
    assert idea(PANDA, "pose") == views.GIVEN.format(label="θ7", number=7)
    assert idea(PANDA, "position").startswith("Redundancy 4: 7 joints, task dimension 3. There is no closed form")
    assert idea(eight_joints(PANDA), "pose").startswith(
        "Redundancy 2: 8 joints, task dimension 6. There is no closed form"
    )


def test_the_panda_moves_through_its_whole_range_while_the_tool_stays() -> None:
    T, q, options = home(PANDA), PANDA.q_home, kin.IKOptions()
    (item,) = self_motion.redundancy_at(PANDA, T, options, q)
    assert (item.name, item.label) == ("theta7", "θ7")
    low, high = self_motion.range_of(item)
    assert high - low > 1.0
    for goal in (low, high):
        q = PANDA.q_home
        for value in np.linspace(item.value, goal, 80)[1:-1].tolist():
            found = self_motion.self_motion(PANDA, T, options, q, "theta7", value)
            assert np.abs(kin.fk(PANDA, found.solutions[0].q) - T).max() < 1e-9
            assert np.abs(found.solutions[0].q - q).max() < self_motion.SMOOTH
            q = found.solutions[0].q
    ends = self_motion.ends(PANDA, T, options, PANDA.q_home, item)
    assert [end.value for end in ends] == [x for interval in item.intervals for x in interval]


@pytest.mark.full
@pytest.mark.parametrize("robot", [PANDA, GEN3, SAWYER], ids=lambda robot: robot.id)
def test_the_path_of_the_elbow_is_that_of_the_self_motion(robot: kin.Robot) -> None:
    T, q, options = home(robot), robot.q_home, kin.IKOptions()
    (item,) = self_motion.redundancy_at(robot, T, options, q)
    assert has_path(robot, item)
    own = [points for (low, high), points in elbow_paths(robot, T, q, item) if low <= item.value <= high]
    ((low, high),) = [x for x in item.intervals if x[0] <= item.value <= x[1]]
    assert len(own) == 1
    steps = np.linalg.norm(np.diff(own[0], axis=0), axis=1)
    assert steps.max() < 0.25
    for k in (1, STEPS // 2, STEPS - 2):
        value = float(np.linspace(low + self_motion.INSET, high - self_motion.INSET, STEPS)[k])
        found = kin.solve_ik(robot, T, q_seed=q, redundancy=value)
        places = [joint_axis(robot, s.q, 3)[0] for s in found.solutions]
        assert min(np.linalg.norm(own[0][k] - place) for place in places) < 1e-9


def test_only_arms_with_a_given_joint_have_a_path() -> None:
    for robot in (SRS, PRINTED):
        for item in self_motion.redundancy_at(robot, home(robot), kin.IKOptions(), robot.q_home):
            assert not has_path(robot, item)


# In the page


@pytest.fixture
def tab(port: int) -> Iterator[FakeBrowser]:
    with FakeBrowser(port) as opened:
        opened.set("Lesson", "Redundancy")
        opened.wait(lambda: "data-step" in opened.html)
        opened.say("feature", ["guide", ["go", 1], 1])  # the first question withholds how many motions there are
        opened.wait(lambda: "data-idea" in opened.html)
        yield opened


def q_of(tab: FakeBrowser, robot: kin.Robot) -> np.ndarray:
    return np.radians([tab.value(label(robot, i)) for i in range(robot.n)])


def swing(tab: FakeBrowser, name: str, degrees: float) -> list[np.ndarray]:
    """Set the slider and wait; the tool's pose in every frame of the animation."""
    poses: list[np.ndarray] = []
    tab.set(name, degrees)
    while tab.read(0.5 if poses else ANSWER):
        poses.append(tab.tool_pose())
    return poses


def free_label(tab: FakeBrowser) -> str:
    (name,) = [s for s in tab.sliders if s.startswith("Set ")]
    return name


@pytest.mark.full
@pytest.mark.parametrize("robot", [SRS, PRINTED], ids=lambda robot: robot.id)
def test_the_tool_stays_in_every_frame_of_a_swing(tab: FakeBrowser, robot: kin.Robot) -> None:
    tab.choose(robot.name)
    T, before = home(robot), q_of(tab, robot)
    poses = swing(tab, free_label(tab), 60)
    assert len(poses) > 3, "a swing, not a jump"  # a busy machine shows a few frames of some forty
    assert max(np.abs(pose - T).max() for pose in poses) < 1e-6
    assert tab.value(free_label(tab)) == 60
    assert np.abs(q_of(tab, robot) - before).max() > 0.5
    exponents = [
        int(unicodedata.normalize("NFKC", x).replace("−", "-")) for x in re.findall("10([⁻⁰¹²³⁴-⁹]+)", tab.html)
    ]
    assert exponents
    assert max(exponents) < -9


@pytest.mark.full
def test_the_end_of_the_range_names_the_joint(tab: FakeBrowser) -> None:
    tab.choose(SRS.name)
    (free,) = self_motion.redundancy_at(SRS, home(SRS), kin.IKOptions(), SRS.q_home)
    swing(tab, free_label(tab), 170)
    assert tab.value(free_label(tab)) == pytest.approx(math.degrees(free.intervals[0][1]), abs=0.1)
    assert "Joint 6 is at its limit" in tab.html
    assert "limit of joint 6" in re.findall(r"(?s)data-limits.*?</table>", tab.html)[-1]


def test_the_ring_is_drawn_with_its_ends_and_removed_with_the_lesson(tab: FakeBrowser) -> None:
    tab.choose(SRS.name)
    tab.wait(lambda: any(n.endswith("/feasible") for n in tab.nodes))
    tab.wait(lambda: sum("/end-" in n and n.endswith("-name") for n in tab.nodes) == 2)
    circle = elbow_circle(SRS, SRS.q_home)
    (free,) = self_motion.redundancy_at(SRS, home(SRS), kin.IKOptions(), SRS.q_home)
    assert circle is not None
    label_at = [tab.local(n)[:3, 3] for n in tab.nodes if "/end-" in n and n.endswith("-name")]
    expected = [circle.at(value) - circle.center for value in free.intervals[0]]
    for point, direction in zip(label_at, expected, strict=True):
        out = point - circle.center
        assert np.allclose(out / np.linalg.norm(out), direction / np.linalg.norm(direction), atol=1e-5)
    tab.set("Lesson", "None")
    tab.settle()
    assert not [n for n in tab.nodes if n.startswith("/redundancy")]


@pytest.mark.full
def test_a_sweep_reverses_at_the_limits_until_a_target_is_dragged(tab: FakeBrowser) -> None:
    tab.choose(SRS.name)
    swing(tab, free_label(tab), 100)
    tab.set("Sweep", True)
    values = []

    def seen() -> bool:
        values.append(tab.value(free_label(tab)))
        return max(values) > 111 and values[-1] < 100

    tab.wait(seen, timeout=40.0)
    assert max(values) <= 111.8
    T = home(SRS)
    T[:3, 3] += (-0.02, 0.0, 0.0)
    tab.grab()
    tab.drag(T)
    tab.release()
    tab.wait(lambda: tab.value("Sweep") is False)
    tab.settle()
    assert np.allclose(tab.tool_pose(), T, atol=1e-6)


@pytest.mark.full
def test_a_trade_is_explained_and_drawn(tab: FakeBrowser) -> None:
    tab.choose(PRINTED.name)
    assert "The axes of joints 1 and 2 coincide" in tab.html
    swing(tab, free_label(tab), 45)
    assert "Elbow moved" in tab.html
    trade = [n for n in tab.nodes if "/trade-" in n]
    assert len(trade) == 3
    assert all(tab.visible.get(n, True) for n in trade)
    assert not [n for n in tab.nodes if "/feasible-" in n]


@pytest.mark.full
def test_the_choice_between_two_redundancy_at(tab: FakeBrowser) -> None:
    tab.choose(PIONEER.name)
    assert "No redundancy" in tab.html
    assert not [s for s in tab.sliders if s.startswith("Sweep")]
    tab.set("Target must match", "Point only")
    tab.wait(lambda: "Set θ4 (tool held)" in tab.sliders)
    tab.settle()
    tab.set("Parameter", "θ5")
    tab.wait(lambda: "Set θ5 (tool held)" in tab.sliders)
    p = home(PIONEER)[:3, 3]
    poses = swing(tab, "Set θ5 (tool held)", 40)
    assert max(np.abs(pose[:3, 3] - p).max() for pose in poses) < 1e-6
    assert tab.value("5 pivoting wrist") == pytest.approx(40, abs=0.01)


@pytest.mark.full
def test_without_a_closed_form_a_joint_leads(tab: FakeBrowser) -> None:
    robot = STORE.get("puma560")
    tab.choose(robot.name)
    assert "No redundancy" in tab.html
    tab.set("Target must match", "Point only")
    tab.wait(lambda: "3 independent self-motions" in tab.html)
    tab.set("Parameter", "θ2")
    tab.wait(lambda: "Set θ2 (tool held)" in tab.sliders)
    p, before = home(robot)[:3, 3], math.degrees(robot.q_home[1])
    goal = before + 1.5  # the wrist stays within 56 mm of the point
    poses = swing(tab, "Set θ2 (tool held)", goal)
    assert max(np.abs(pose[:3, 3] - p).max() for pose in poses) < 1e-6
    assert max(np.abs(pose[:3, :3] - home(robot)[:3, :3]).max() for pose in poses) > 0.01, "the tool turns"
    assert tab.value(label(robot, 1)) == pytest.approx(goal, abs=0.01)
    # As far as it goes: the end is named, and the tool is still there.
    swing(tab, "Set θ2 (tool held)", math.degrees(robot.upper[1]))
    tab.wait(lambda: "The self-motion ends here" in tab.html)
    assert np.abs(tab.tool_pose()[:3, 3] - p).max() < 1e-6


@pytest.mark.full
def test_invalid_values_are_refused_and_the_lesson_keeps_working(tab: FakeBrowser) -> None:
    tab.choose(SRS.name)
    for name, value in ((free_label(tab), math.nan), (free_label(tab), math.inf)):
        tab.set(name, value)
        tab.wait(lambda: 'data-status="error"' in tab.html)
        tab.set("Go to", "Home")
        tab.wait(lambda: 'data-status="hand"' in tab.html)
    swing(tab, free_label(tab), 20)
    assert tab.value(free_label(tab)) == 20
