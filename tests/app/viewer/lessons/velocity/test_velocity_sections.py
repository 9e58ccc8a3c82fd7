"""The lesson "Velocity": forces, null space and lines, against the core for all arms."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons.velocity import section_views as views
from app.viewer.lessons.velocity.along import SAMPLES, along, controllable
from app.viewer.lessons.velocity.ellipsoids import axes_of
from app.viewer.lessons.velocity.facts import torques
from app.viewer.lessons.velocity.settings import GOALS
from app.viewer.null_space import margin, measure, null_space, secondary
from app.viewer.panel.joints import label
from app.viewer.scene.meshes import body
from app.viewer.server import ViewerServer
from kin.differential.task import task_rows, usual_rank
from kin.transforms import Array
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UNITS = Units()


@pytest.fixture(params=CLASSICS, ids=[robot.id for robot in CLASSICS])
def robot(request: pytest.FixtureRequest) -> kin.Robot:
    found: kin.Robot = request.param
    return found


def numbers(html: str, mark: str) -> list[float]:
    return [float(x.replace("−", "-")) for x in re.findall(rf"{mark}[^>]*>([−\d.]+)<", html)]


def test_torques_do_the_work_of_the_force(robot: kin.Robot) -> None:
    rng = np.random.default_rng(6)
    for q in (robot.q_home, robot.random_q(rng)):
        force = rng.normal(size=3) * 10.0
        J = kin.jacobian(robot, q)
        tau = torques(J, force)
        # Virtual work by finite differences: each joint alone moves the tool point against the force.
        step = 1e-6
        for i in range(robot.n):
            e = step * np.eye(robot.n)[i]
            moved = (kin.fk(robot, q + e) - kin.fk(robot, q - e))[:3, 3] / (2.0 * step)
            assert tau[i] == pytest.approx(moved @ force, abs=1e-6)
        axes = axes_of(J[:3])
        least, cost = axes.R[:, 2], float(axes.values[2])
        assert np.linalg.norm(torques(J, least)) == pytest.approx(cost, abs=1e-12)
        for _ in range(20):
            other = rng.normal(size=3)
            assert np.linalg.norm(torques(J, other / np.linalg.norm(other))) >= cost - 1e-12
        html = views.statics_html(robot, force, tau, least, cost, kin.fk(robot, q)[:3, :3])
        assert numbers(html, "data-torque") == pytest.approx(tau, abs=0.00501)
        assert ("costs nothing" in html) == (cost < views.FREE)


def test_a_force_out_of_the_plane_costs_a_planar_arm_nothing() -> None:
    planar = STORE.get("planar3r")
    J = kin.jacobian(planar, planar.q_home)
    axes = axes_of(J[:3])
    html = views.statics_html(planar, np.ones(3), torques(J, np.ones(3)), axes.R[:, 2], 0.0, np.eye(3))
    assert "A force along base z costs nothing" in html
    assert torques(J, np.array([0.0, 0.0, 5.0])) == pytest.approx(0.0, abs=1e-12)


def test_numbers_of_the_null_space(robot: kin.Robot) -> None:
    q = robot.random_q(np.random.default_rng(3))
    for task in ("pose", "position"):
        task = controllable(robot, task)
        space = null_space(robot, q, task)
        z = secondary(robot, q, task, "limits")
        by_v = space.pinv @ np.eye(len(space.J))[0]
        own = space.project(z)
        html = views.null_html(robot, task, space, (z, by_v, own), float(measure(robot, q, task, space.rank)))
        shown = np.array(numbers(html, "data-speed")).reshape(robot.n, 4)
        assert shown == pytest.approx(np.stack([z, by_v, own, by_v + own], axis=1), abs=0.000501)
        J = task_rows(robot, q, task)
        assert numbers(html, "data-rank") == [np.linalg.matrix_rank(J, tol=1e-9)]
        assert np.abs(J @ own).max() < 1e-10
        if space.rank == 3 and task == "position":
            assert numbers(html, "data-w-task")[0] == pytest.approx(
                float(kin.manipulability(robot, q, "linear")), abs=0.0000501
            )
    assert f"{100 * margin(robot, q):.0f} %" in views.margin_html(margin(robot, q))


def test_a_line_is_followed_on_its_branch(robot: kin.Robot) -> None:
    rng = np.random.default_rng(2)
    near = np.clip(robot.q_home + 0.1 * rng.uniform(-1, 1, robot.n), robot.lower, robot.upper)
    start, end = kin.fk(robot, robot.q_home), kin.fk(robot, near)
    task = controllable(robot, "pose")
    found = along(robot, robot.q_home, end, "pose")
    assert found.task == task
    assert len(found.share) > 1 or found.end
    for share, q, least, kappa, rank in zip(
        found.share, found.q, found.least, found.kappa, found.rank, strict=True
    ):
        on_line = kin.interpolate_poses(start, end, float(share))
        assert np.abs(kin.fk(robot, q)[:3, 3] - on_line[:3, 3]).max() < 1e-8
        if task == "pose":
            assert np.abs(kin.fk(robot, q) - on_line).max() < 1e-8
        s = np.linalg.svd(task_rows(robot, q, task), compute_uv=False)[: usual_rank(robot, task)]
        assert least == pytest.approx(s[-1], abs=1e-12)
        assert kappa == pytest.approx(min(s[0] / s[-1], 1e6), rel=1e-6)
        assert rank == (s > 1e-3 * s[0]).sum()
    if not found.end:
        assert len(found.share) == SAMPLES
        assert "σ_min" in views.line_html(robot, found, UNITS)


def test_a_line_out_of_reach_ends_with_a_reason() -> None:
    ur5 = STORE.get("ur5")
    end = kin.fk(ur5, ur5.q_home)
    end[:3, 3] *= 4.0
    found = along(ur5, ur5.q_home, end, "pose")
    assert 1 < len(found.share) < SAMPLES
    assert found.end.startswith(("The arm cannot follow", "Joint "))
    assert found.kappa[-1] > found.kappa[0]
    html = views.line_html(ur5, found, UNITS)
    assert found.end in html
    assert html.count("kb-motion-curve") == 3
    low = ur5.q_home.copy()
    assert len(along(ur5, low, kin.fk(ur5, low), "pose").share) == SAMPLES, "no way at all is a line of one point"


# In a page


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


def test_a_force_is_typed_dragged_and_turned(server: int) -> None:
    pioneer = CLASSICS[0]
    J = kin.jacobian(pioneer, pioneer.q_home)
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.open_lesson("Velocity")
        tab.wait(lambda: "Forces" in str(tab.gui))
        tab.set("Force at the tool", True)
        tab.wait(lambda: numbers(tab.html, "data-torque") != [])
        assert numbers(tab.html, "data-torque") == pytest.approx(torques(J, np.array([0, 0, -10.0])), abs=0.00501)
        tab.set("Fx, N", 4.0)
        expected = torques(J, np.array([4.0, 0, -10.0]))
        tab.wait(lambda: numbers(tab.html, "data-torque") == pytest.approx(expected, abs=0.00501))
        tab.set("Cheapest direction", True)
        axes = axes_of(J[:3])
        size = np.hypot(4.0, 10.0)
        expected = torques(J, size * axes.R[:, 2])
        tab.wait(lambda: np.abs(numbers(tab.html, "data-torque")) == pytest.approx(np.abs(expected), abs=0.02))
        # Dragged: the tip of the arrow in the scene.
        (tip,) = [name for name in tab.nodes if name.endswith("/tip")]
        reach = 0.035 * body(pioneer).radius
        force = np.array([2.0, -6.0, 3.0])
        owner = tab.nodes[tip]["owner"]
        tab.send("TransformControlsDragStartMessage", name=tip, owner=owner)
        position = (reach * force).tolist()
        tab.send(
            "TransformControlsUpdateMessage", name=tip, position=position, wxyz=[1.0, 0.0, 0.0, 0.0], owner=owner
        )
        tab.send("TransformControlsDragEndMessage", name=tip, owner=owner)
        expected = torques(J, force)
        tab.wait(lambda: numbers(tab.html, "data-torque") == pytest.approx(expected, abs=0.00501))
        tab.wait(lambda: tab.value("Fy, N") == pytest.approx(-6.0))
        tab.set("Lesson", "None")
        tab.wait(lambda: not any(name.startswith("/velocity-") for name in tab.nodes))


def shown_q(tab: FakeBrowser, robot: kin.Robot) -> Array:
    return np.radians([tab.value(label(robot, i)) for i in range(robot.n)])


def run_a_self_motion(tab: FakeBrowser, panda: kin.Robot, ended: Callable[[Array], bool], timeout: float) -> None:
    """Run it until `ended` at the configuration shown; the tool was held and the measure has grown."""
    tab.settle()
    tab.set("Lesson", "Velocity")
    tab.choose(panda.name)
    tab.wait(lambda: "(I−J⁺J)z" in tab.html)
    tab.set(label(panda, 2), 40.0)
    tab.settle()
    T = tab.tool_pose()
    before = measure(panda, shown_q(tab, panda), "pose", 6)
    tab.set("Secondary goal", list(GOALS)[1])
    tab.set("Run", True)
    tab.wait(lambda: ended(shown_q(tab, panda)), timeout=timeout)
    tab.set("Run", False)
    tab.settle()
    assert np.abs(tab.tool_pose() - T).max() < 1e-5
    assert measure(panda, shown_q(tab, panda), "pose", 6) > before


@pytest.mark.full
def test_the_self_motion_runs_with_the_tool_held(server: int) -> None:
    panda = STORE.get("panda")
    with FakeBrowser(server) as tab:
        seen: list[Array] = []

        def has_moved(q: Array) -> bool:
            seen.append(q)
            return bool(np.abs(q - seen[0]).max() > 0.1)

        run_a_self_motion(tab, panda, has_moved, 40.0)


@pytest.mark.slow
def test_the_self_motion_ends_at_the_best_place(server: int) -> None:
    with FakeBrowser(server) as tab:
        run_a_self_motion(tab, STORE.get("panda"), lambda q: tab.value("Run") is False, 120.0)
        assert "The best place is reached" in tab.html


def test_a_line_is_plotted(server: int) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.open_lesson("Velocity")
        tab.wait(lambda: "Plot the line" in str(tab.gui))
        tab.set("Plot the line", True)
        tab.wait(lambda: "Start and end are the same" in tab.html)
        tab.set(label(CLASSICS[0], 0), 20.0)
        tab.settle()
        tab.set("Plot the line", True)
        tab.wait(lambda: "kb-motion-curve" in tab.html and "Smallest σ_min" in tab.html)
