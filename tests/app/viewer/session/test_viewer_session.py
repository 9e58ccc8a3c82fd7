"""Visitors of the viewer, each played by a fake browser that speaks viser's protocol."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser, Wire
from live_server import serve_viewer
from websockets.exceptions import ConnectionClosed

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.panel.joints import label
from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.clearance import clearance
from app.viewer.server import ViewerServer

# A visitor may leave between two pictures of a motion; viser then warns about the picture nobody will see.
pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER = STORE.get("pioneer5")
SRS = STORE.get("redundant7-craig")


@pytest.fixture(scope="module")
def viewer() -> Iterator[tuple[ViewerServer, int]]:
    server = ViewerServer(STORE, Settings(), Clouds())
    with serve_viewer(server) as port:
        yield server, port


@pytest.fixture
def port(viewer: tuple[ViewerServer, int]) -> int:
    return viewer[1]


def arrives(tab: FakeBrowser, T: np.ndarray, atol: float = 1e-9) -> None:
    """Wait until the arm shows this tool pose, then until nothing moves any more; it must still be there."""
    tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=atol))
    tab.settle()
    assert np.allclose(tab.tool_pose(), T, atol=atol)


def q_of(tab: FakeBrowser, robot: kin.Robot) -> np.ndarray:
    return np.radians([tab.value(label(robot, i)) for i in range(robot.n)])


def test_a_visitor_sees_the_first_robot_at_home(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert tab.value("Robot") == PIONEER.name
        arrives(tab, kin.fk(PIONEER, PIONEER.q_home), 1e-9)
        assert np.allclose(tab.gizmo_pose(), kin.fk(PIONEER, PIONEER.q_home), atol=1e-9)
        assert tab.sliders_in("Joints") == [f"{i + 1} {j.name}" for i, j in enumerate(PIONEER.joints)]


def test_a_slider_moves_arm_and_gizmo_and_nothing_echoes(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.log.clear()
        tab.set("1 rotating base", 37.25)
        tab.settle()
        q = PIONEER.q_home.copy()
        q[0] = math.radians(37.25)
        arrives(tab, kin.fk(PIONEER, q), 1e-9)
        assert np.allclose(tab.gizmo_pose(), kin.fk(PIONEER, q), atol=1e-9)
        held = tab.element("1 rotating base")
        assert not [m for m in tab.log if m["type"] == "GuiUpdateMessage" and m["uuid"] == held]
        assert 'data-status="hand"' in tab.html


def test_a_slider_is_eased_and_ends_exactly(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.log.clear()
        tab.set("1 rotating base", 180)
        q = PIONEER.q_home.copy()
        q[0] = math.pi
        arrives(tab, kin.fk(PIONEER, q))
        turns = [m["wxyz"] for m in tab.log if m["type"] == "SetOrientationMessage" and m["name"].endswith("/1")]
        assert len(turns) > 4, "a quarter turn must be shown as a motion"
        assert turns[-1] == pytest.approx([math.cos(math.pi / 2), 0, 0, 1], abs=1e-12)


@pytest.mark.full
def test_two_visitors_do_not_disturb_each_other(port: int) -> None:
    with FakeBrowser(port) as one, FakeBrowser(port) as two:
        one.settle()
        two.settle()
        two.log.clear()
        one.choose(SRS.name)
        one.set("Joint 2", -40)
        one.settle()
        two.settle()
        assert two.log == []
        assert two.value("Robot") == PIONEER.name
        arrives(two, kin.fk(PIONEER, PIONEER.q_home), 1e-9)
        q = SRS.q_home.copy()
        q[1] = math.radians(-40)
        arrives(one, kin.fk(SRS, q), 1e-9)


def test_sixty_fast_drags_end_at_the_last_target(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        home = kin.fk(SRS, SRS.q_home)
        tab.grab()
        for k in range(60):
            T = home.copy()
            T[:3, 3] += [-0.003 * k, 0.15 * math.sin(k / 9), 0.001 * k]
            tab.drag(T)
        tab.release()
        tab.settle()
        arrives(tab, T, 1e-6)
        assert np.allclose(tab.gizmo_pose(), T, atol=1e-6)
        assert np.allclose(kin.fk(SRS, q_of(tab, SRS)), T, atol=5e-4), "the sliders follow the drag"
        assert 'data-status="reached"' in tab.html


@pytest.mark.full
def test_the_gizmo_is_never_moved_while_held_nor_away_from_an_unreachable_target(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        T = kin.fk(SRS, SRS.q_home)
        T[:3, 3] = [1.6, 0.0, 0.3]
        tab.log.clear()
        tab.grab()
        tab.drag(T)
        tab.wait(lambda: 'data-status="unreachable"' in tab.html)
        tab.settle()
        tab.release()
        tab.settle()
        assert not [m for m in tab.log if m.get("name") == tab.gizmo and m["type"].startswith("Set")]
        best = kin.solve_ik(SRS, T, q_seed=SRS.q_home).best
        assert best is not None
        arrives(tab, kin.fk(SRS, best.q), 1e-6)
        assert f"{1000 * kin.solve_ik(SRS, T).distance:.0f} mm" in tab.html
        gap = next(n for n in tab.nodes if n.endswith("-gap"))
        assert tab.visible[gap] is True
        tab.set("Joint 1", 10)
        tab.settle()
        assert tab.visible[gap] is False
        assert np.allclose(tab.gizmo_pose(), tab.tool_pose(), atol=1e-9)


def test_the_five_joint_arm_names_the_roll_it_gives_up_and_the_task_can_be_relaxed(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        T = kin.fk(PIONEER, PIONEER.q_home)
        T[1, 3] += 0.02
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.wait(lambda: "Reached with roll error" in tab.html)
        assert 'data-status="compromise"' in tab.html
        tab.set("Target must match", "Point + approach")
        tab.wait(lambda: 'data-status="reached"' in tab.html)
        tab.settle()
        assert np.allclose(tab.tool_pose()[:3, 2:], T[:3, 2:], atol=1e-6)
        assert np.allclose(tab.gizmo_pose(), tab.tool_pose(), atol=1e-9), "a reached target is where the tool is"


def past_joint_4() -> np.ndarray:
    """The tool pose of a Pioneer at home, but for joint 4, which is past its stop."""
    q = PIONEER.q_home.copy()
    q[3] = math.radians(-20)
    return kin.fk(PIONEER, q)


def test_a_limit_is_named_by_joint_number(port: int) -> None:
    T = past_joint_4()
    expected = kin.solve_ik(PIONEER, T, task="approach", q_seed=PIONEER.q_home)
    assert expected.status == kin.Status.LIMITS
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Target must match", "Point + approach")
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.wait(lambda: 'data-status="limits"' in tab.html)
        assert f"Outside the limits: joint {expected.violations[0].joint + 1}" in tab.html


def test_the_gizmo_is_released_where_it_was_dragged(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that began before the drag may place the gizmo between the drag and the release."""
    begun, go_on, placed = (threading.Event() for _ in range(3))
    place = ArmScene.place_gizmo

    def late(scene: ArmScene, T_base_tool: np.ndarray, again: bool = False) -> None:
        begun.set()
        assert go_on.wait(10.0)
        place(scene, T_base_tool, again)
        placed.set()

    with FakeBrowser(port) as tab:
        tab.settle()
        monkeypatch.setattr(ArmScene, "place_gizmo", late)
        tab.set("Target must match", "Point + approach")
        assert begun.wait(10.0)
        tab.grab()
        tab.drag(past_joint_4())
        tab.viser.wait_until_handled()
        go_on.set()
        assert placed.wait(10.0)
        tab.release()
        tab.wait(lambda: 'data-status="limits"' in tab.html)
        tab.settle()
        assert 'data-status="limits"' in tab.html


def test_an_open_lesson_is_kept_for_the_next_page_of_the_browser(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("1 rotating base", 80.0)
        tab.wait(lambda: bool(tab.kept))
        assert tab.left_off == [], "an arm alone is quickly there again"
        tab.set("Lesson", "Exercises")
        tab.wait(lambda: bool(tab.left_off))
        assert tab.left_off == tab.kept[-1:]


@pytest.mark.full
def test_home_random_and_units(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        home = q_of(tab, PIONEER)
        tab.set("Go to", "Random")
        tab.wait(lambda: 'data-status="hand"' in tab.html and not np.array_equal(q_of(tab, PIONEER), home))
        q = q_of(tab, PIONEER)
        arrives(tab, kin.fk(PIONEER, q), 1e-3)
        tab.set("Radians", True)
        tab.wait(lambda: "rad<" in tab.html)
        tab.settle()
        shown = [tab.value(name) for name in tab.sliders_in("Joints")]
        assert np.allclose(shown, q, atol=2e-4)
        tab.set("1 rotating base", 1.0)
        tab.settle()
        q[0] = 1.0
        arrives(tab, kin.fk(PIONEER, q), 1e-3)
        tab.set("Go to", "Home")
        tab.settle()
        arrives(tab, kin.fk(PIONEER, PIONEER.q_home), 1e-9)


@pytest.mark.full
def test_random_keeps_locked_joints_and_clear_of_the_pedestal(port: int) -> None:
    """Six of ten configurations of the Pioneer are not clear."""
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Locked", "3")
        locked, poses = q_of(tab, PIONEER), set()
        for _ in range(4):
            before = q_of(tab, PIONEER)
            tab.set("Go to", "Random")
            tab.wait(lambda before=before: not np.array_equal(q_of(tab, PIONEER), before))
            tab.settle()
            q = q_of(tab, PIONEER)
            assert clearance(PIONEER).at(q) is None
            assert q[2] == locked[2]
            poses.add(tuple(q))
        assert len(poses) == 4


@pytest.mark.full
def test_every_robot_can_be_chosen_and_left_again(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for robot in [*CLASSICS[1:], PIONEER]:
            tab.choose(robot.name)
            arrives(tab, kin.fk(robot, robot.q_home), 1e-9)
            assert tab.sliders_in("Joints") == [label(robot, i) for i in range(robot.n)]
            gizmos = [name for name, m in tab.nodes.items() if m["type"] == "TransformControlsMessage"]
            assert sum("/ring-" not in name for name in gizmos) == 1


def test_frames_and_labels_can_be_shown(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        frames = [n for n in tab.nodes if "/frame-" in n and not n.endswith("label")]
        assert len(frames) == 1 + len(PIONEER.rows), "the base and every row"
        assert not any(tab.visible[n] for n in frames)
        tab.set("Link frames", True)
        tab.wait(lambda: all(tab.visible[n] for n in frames))
        tab.set("Frame labels", False)
        tab.wait(lambda: not any(v for n, v in tab.visible.items() if n.endswith("/label")))


HOSTILE = [
    ("slider NaN", lambda t: t.set("1 rotating base", math.nan)),
    ("slider infinity", lambda t: t.set("1 rotating base", math.inf)),
    ("unknown robot", lambda t: t.set("Robot", "<script>alert(1)</script>")),
    ("unknown task", lambda t: t.set("Target must match", "everything")),
    ("gizmo NaN", lambda t: t.drag(position=(math.nan, 0, 0), wxyz=(1, 0, 0, 0))),
    ("gizmo without direction", lambda t: t.drag(position=(0.1, 0, 0), wxyz=(0, 0, 0, 0))),
]


@pytest.mark.full
@pytest.mark.parametrize(("name", "act"), HOSTILE, ids=[name for name, _ in HOSTILE])
def test_hostile_values_are_shown_as_errors_and_the_session_lives(
    port: int, name: str, act: object, caplog: pytest.LogCaptureFixture
) -> None:
    with FakeBrowser(port) as tab, caplog.at_level(logging.INFO, "app.viewer.session"):
        tab.settle()
        act(tab)  # type: ignore[operator]
        tab.wait(lambda: 'data-status="error"' in tab.html)
        assert "<script>" not in tab.html
        assert not caplog.records, "a visitor neither fills the log nor writes into it"
        tab.set("1 rotating base", 45)
        tab.settle()
        q = PIONEER.q_home.copy()
        q[0] = math.pi / 4
        arrives(tab, kin.fk(PIONEER, q), 1e-9)
        assert tab.value("Robot") == PIONEER.name


@pytest.mark.full
def test_an_arm_is_shown_as_body_skeleton_or_both(port: int) -> None:
    def seen(tab: FakeBrowser, name: str) -> set[bool]:
        return {tab.visible.get(node, True) for node in tab.nodes if node.split("/")[-1].startswith(name)}

    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose("UR5")
        for look, body, skeleton in (("Both", True, True), ("Skeleton", False, True), ("Body", True, False)):
            tab.set("Show arm as", look)
            wanted = {body}, {skeleton}
            tab.wait(lambda wanted=wanted: (seen(tab, "body-"), seen(tab, "housing")) == wanted)
        tab.set("Show arm as", "Ghost")
        tab.wait(lambda: "one of Body, Skeleton, Both" in tab.html)
        tab.wait(lambda: tab.value("Show arm as") == "Body")


@pytest.mark.full
def test_values_beyond_a_stop_end_at_the_stop(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("2 rotating elbow", 1e300)
        tab.settle()
        q = PIONEER.q_home.copy()
        q[1] = PIONEER.upper[1]
        arrives(tab, kin.fk(PIONEER, q), 1e-9)
        assert tab.value("2 rotating elbow") == 150


@pytest.mark.full
def test_a_target_at_the_end_of_the_world_is_only_out_of_reach(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.drag(position=(1e5, -1e5, 1e5), wxyz=(1, 0, 0, 0))
        tab.wait(lambda: 'data-status="unreachable"' in tab.html)


@pytest.mark.full
def test_an_idle_visitor_costs_no_processor_time(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        before = time.process_time()
        time.sleep(1.0)
        assert time.process_time() - before < 0.1


@pytest.mark.full
def test_fifty_visits_leave_no_thread(viewer: tuple[ViewerServer, int]) -> None:
    server, port = viewer
    with FakeBrowser(port) as tab:  # whatever starts with the first visit has started
        tab.settle(0.1)
    wait_for(lambda: server.visitors == 0)
    before = threading.active_count()
    for k in range(50):
        tab = FakeBrowser(port)
        if k % 2:
            tab.wait(lambda tab=tab: bool(tab.sliders))  # type: ignore[misc]
            tab.set("Go to", "Random")  # some leave in mid-motion, some before the page is built
        tab.close()
    wait_for(lambda: server.visitors == 0 and threading.active_count() <= before and not workers())


def test_stopping_ends_sessions_and_connections() -> None:
    before = set(threading.enumerate())
    server = ViewerServer(STORE, Settings(), Clouds())
    with serve_viewer(server) as port:
        tab = FakeBrowser(port)
        tab.wait(lambda: bool(tab.sliders))
        server.stop()
        with pytest.raises(ConnectionClosed) as closed:
            tab.settle()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1001
    others = ("Thread-", "visitors-")  # those of the connection, which end by themselves, and of all visitors
    wait_for(lambda: not [t for t in set(threading.enumerate()) - before if not t.name.startswith(others)])
    assert server.visitors == 0
    server.stop()  # a second time is harmless


def workers() -> list[str]:
    return [t.name for t in threading.enumerate() if t.name.startswith("visitor-")]


def wait_for(condition: object, timeout: float = 10.0) -> None:
    end = time.monotonic() + timeout
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end, [t.name for t in threading.enumerate()]
        time.sleep(0.02)


# The channel


def test_a_page_goes_on_over_another_connection_of_its_channel(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.say("axes")
        tab.settle()
        assert tab.value("Arrows along") == "Base axes"
        first = tab.channel
        tab.open_channel()
        assert first is not None
        tab.wait(lambda: first.ended)
        tab.say("axes")
        tab.settle()
        assert tab.value("Arrows along") == "Tool axes"
        number = tab.say("field", ["nothing", "1"])
        tab.say("target", ["position", "?"])
        tab.wait(lambda: tab.replied[0] == number + 1)


def test_only_the_name_of_a_page_opens_its_channel(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        name = tab.name
        for wrong in (name[:-1], name + "A", name.swapcase()):
            tab.name = wrong
            tab.open_channel()
            opened = tab.channel
            tab.wait(lambda opened=opened: opened.ended)  # type: ignore[misc]
        tab.name = name
        tab.open_channel()
        tab.say("axes")
        tab.settle()
        assert tab.value("Arrows along") == "Base axes"


def read_to_end(wire: Wire) -> None:
    while True:
        assert wire.receive(30.0) is not None


def test_the_channel_of_a_page_ends_with_it(port: int) -> None:
    tab = FakeBrowser(port)
    tab.wait(lambda: tab.channel is not None)
    channel = tab.channel
    assert channel is not None
    tab.viser.close()
    with pytest.raises(ConnectionClosed):
        read_to_end(channel)
    tab.close()
