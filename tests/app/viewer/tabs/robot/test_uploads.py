"""Zips with meshes in a page: what is asked, what is shown, what is refused, and that nothing is lost."""

from __future__ import annotations

import html
import threading
import time

import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer
from test_robot_tab import STORE, UR5, cell, part, say, shows, type_in
from zips import MESH_AND_BOX, TWO_JOINTS, announced, packed, robot_files

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.meshes import reader as readers
from app.viewer.meshes.archive import MOST_BYTES, MeshError, TooLargeError
from app.viewer.meshes.loading import PARSED
from app.viewer.server import ViewerServer
from app.viewer.session.state import decode

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

TWO = kin.load_robot(TWO_JOINTS)


def send(tab: FakeBrowser, name: str, data: bytes) -> None:
    tab.open_file("robot", name, data)


def meshes(tab: FakeBrowser) -> set[str]:
    """The nodes that show meshes of a file, without the number of the body."""
    return {
        name.split("/")[-1].rsplit("-", 1)[0]
        for name, node in tab.nodes.items()
        if "/mesh-" in name and node["type"] == "MeshMessage"
    }


ALL = {"mesh-0-0", "mesh-0-1", "mesh-0-2", "mesh-1-2", "mesh-2-2"}


@pytest.mark.full
def test_a_zip_shows_the_real_arm_and_undo_brings_back_what_it_replaced(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, 1, "a", "250")
        assert "data-meshes" not in part(tab, "files")
        mine = tab.value("Robot")
        send(tab, "two.zip", packed(robot_files()))
        shows(tab, TWO, TWO.q_home)
        assert f"{mine} was replaced" in html.unescape(tab.html)
        assert "Its 2 meshes are being read" in tab.html
        assert "Reading the meshes of “two.zip”" in part(tab, "files")
        tab.wait(lambda: "The meshes of two.zip are shown" in tab.html)
        assert meshes(tab) == ALL
        assert 'data-arm="files" data-meshes' in part(tab, "files"), "changes are sent once typing rests"
        assert "stay while this page is open" in part(tab, "files")
        type_in(tab, "tool", "x", "50")
        tab.wait(lambda: meshes(tab) == ALL)
        type_in(tab, 0, "a", "450")
        tab.wait(lambda: not meshes(tab))
        assert "The arm is in this page and in its link only" in part(tab, "files")
        tab.say("undo")
        tab.wait(lambda: meshes(tab) == ALL)
        for _ in range(2):
            tab.say("undo")
            tab.settle()
        assert tab.value("Robot") == mine
        assert not meshes(tab)
        tab.say("redo")
        tab.wait(lambda: meshes(tab) == ALL)


def kept_arm(tab: FakeBrowser) -> kin.Robot:
    """The arm of the link."""
    own = decode(tab.stored(), [UR5]).own
    assert own is not None
    return own.robot


@pytest.mark.full
def test_a_zip_gives_the_arm_the_capsules_of_its_collision_bodies(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        mine = tab.value("Robot")
        send(tab, "two.zip", packed(robot_files(MESH_AND_BOX)))
        tab.wait(lambda: "The meshes of two.zip are shown" in tab.html, timeout=90.0)
        assert "Collisions: capsules around the collision bodies of the URDF, for every link." in tab.html
        tab.wait(lambda: not any(c.assumed for c in kept_arm(tab).capsules))
        robot = kept_arm(tab)
        assert {c.link for c in robot.capsules} == {1, 2}
        assert ">known:" in part(tab, "about")
        type_in(tab, "tool", "x", "50")
        tab.wait(lambda: kept_arm(tab).T_last_tool[0, 3] == pytest.approx(0.05))
        assert kept_arm(tab).capsules == robot.capsules, "the axes are the same"
        type_in(tab, 0, "a", "450")
        tab.wait(lambda: kept_arm(tab).capsules == ())
        assert "assumed:" in part(tab, "about")
        for _ in range(3):
            tab.say("undo")
            tab.settle()
        assert tab.value("Robot") == mine, "the capsules are no step of their own"
        tab.say("redo")
        tab.wait(lambda: kept_arm(tab).capsules == robot.capsules)


@pytest.mark.full
def test_a_urdf_alone_says_which_bodies_are_assumed(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.open_file("robot", "two.urdf", MESH_AND_BOX)
        assert "link 1 has an assumed tube (upper: upper.stl: its mesh was not sent along)" in html.unescape(
            tab.html
        )
        tab.wait(lambda: {c.link for c in kept_arm(tab).capsules} == {1, 2})
        assert {c.link for c in kept_arm(tab).capsules if c.assumed} == {1}
        assert "partly known:" in part(tab, "about")
        assert "assumed are tubes for link 1" in part(tab, "about")


@pytest.mark.full
def test_what_is_wanted_of_a_zip_is_asked(port: int) -> None:
    fork = TWO_JOINTS.replace(
        "</robot>",
        '<link name="camera"/><joint name="mount" type="revolute"><parent link="upper"/><child link="camera"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>',
    )
    with FakeBrowser(port) as tab:
        tab.settle()
        send(tab, "robots.zip", packed({**robot_files(fork), "two/urdf/other.urdf": kin.robot_to_urdf(UR5)}))
        assert "robots.zip has several robots" in tab.html
        assert '<option value="two/urdf/two.urdf">' in part(tab, "files")
        say(tab, "urdf", value="two/urdf/none.urdf")
        assert "Invalid input" in tab.html
        say(tab, "urdf", value="two/urdf/two.urdf")
        assert "fore (2 joints)" in part(tab, "files")
        say(tab, "tip", value="fore")
        shows(tab, TWO, TWO.q_home)
        tab.wait(lambda: meshes(tab) == ALL)


BAD = {
    "no zip": (b"PK\x03\x04 nothing", "no list of files at its end"),
    "escape": (packed({"../x.urdf": TWO_JOINTS}), "without .."),
    "empty": (packed({"readme.md": ""}), "no URDF among 1 files"),
    "broken": (packed({"x.urdf": "<robot>"}), "broken: x.urdf"),
}
BAD_MESHES = {
    "missing": (packed({"x.urdf": TWO_JOINTS}), "a path of a file in the zip"),
    "noise": (packed({**robot_files(), "two/meshes/upper.stl": b"noise"}), "upper.stl"),
    "millimetres": (packed(robot_files(TWO_JOINTS.replace('scale="0.001 0.001 0.001"', ""))), "0.001 0.001 0.001"),
}


@pytest.mark.full
def test_a_bad_zip_changes_nothing_and_bad_meshes_leave_a_skeleton(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        before = tab.value("Robot")
        for name, (data, words) in BAD.items():
            send(tab, name, data)
            assert "The file was not used" in tab.html, name
            assert words in html.unescape(tab.html), name
            assert tab.value("Robot") == before
        for name, (data, words) in BAD_MESHES.items():
            send(tab, name, data)
            tab.wait(lambda name=name: f"The meshes of {name} cannot be shown" in tab.html)
            assert words in html.unescape(tab.html), name
            assert "The arm is a skeleton" in tab.html
            assert not meshes(tab)
        say(tab, "upload", value=["x.zip", True, True, "UEs="])
        assert "Invalid input" in tab.html, "files come by requests"


TOO_LARGE = {
    "announced": (
        packed({**robot_files(), "two/meshes/upper.stl": announced(10**7)}),
        "10000000",
        f"at most {PARSED}",
    ),
    "heavy": (packed({**robot_files(), "two/meshes/upper.stl": bytes(25 * 10**6)}), "times", "at most 200 times"),
    "entities": (
        packed({**robot_files(TWO_JOINTS.replace("fore.obj", "fore.dae")), "two/meshes/fore.dae": "<!DOCTYPE x>"}),
        "DOCTYPE",
        "without DOCTYPE",
    ),
}


@pytest.mark.full
@pytest.mark.parametrize("name", TOO_LARGE)
def test_a_mesh_that_is_too_large_refuses_the_file_and_the_arm_on_show_stays(port: int, name: str) -> None:
    data, value, valid = TOO_LARGE[name]
    with FakeBrowser(port) as tab:
        tab.settle()
        send(tab, "two.zip", packed(robot_files()))
        tab.wait(lambda: meshes(tab) == ALL)
        type_in(tab, "tool", "x", "50")
        tab.wait(lambda: meshes(tab) == ALL)
        mine = tab.value("Robot")
        send(tab, name, data)
        tab.wait(lambda: "The file was not used" in tab.html)
        words = html.unescape(tab.html)
        assert value in words
        assert valid in words
        tab.wait(lambda: tab.value("Robot") == mine and meshes(tab) == ALL)
        tab.wait(lambda: cell(tab, "tool x") == "50")


def test_steps_made_while_a_file_is_read_that_is_refused_are_taken_back_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    viewer = ViewerServer(Store(), Settings(), Clouds())
    done = threading.Event()

    def answer(request: readers._Request) -> bytes:
        done.wait(30.0)
        raise TooLargeError("meshes", "more", "less")

    monkeypatch.setattr(viewer.services.meshes, "_answer", answer)
    with serve_viewer(viewer) as port, FakeBrowser(port) as tab:
        tab.settle()
        before = tab.value("Robot")
        send(tab, "two.zip", packed(robot_files()))
        tab.wait(lambda: tab.value("Robot") != before)
        tab.settle()
        for slider in tab.sliders[:2]:
            tab.set(slider, 20.0)
            tab.settle()
        done.set()
        tab.wait(lambda: "The file was not used" in tab.html)
        assert tab.value("Robot") == before


def test_an_upload_that_ends_early_or_is_cancelled_gives_back_its_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.shared.memory.answers.SMALL", 0)
    viewer = ViewerServer(Store(), Settings(), Clouds())
    memory = viewer.services.meshes.memory
    with serve_viewer(viewer) as port, FakeBrowser(port) as tab:
        tab.settle()
        request = tab.begin_file("robot", "slow.zip", 2_000_000)
        request.send(bytes(15_000))
        tab.wait(lambda: "Receiving “slow.zip”: 0.0 of 2.0 MB" in part(tab, "files"))
        assert memory.held == 2_000_000, "room for all of it, before it has come"
        request.close()
        tab.wait(lambda: "slow.zip did not arrive" in tab.html)
        assert "Receiving" not in part(tab, "files")
        assert memory.held == 0

        request = tab.begin_file("robot", "slow.zip", 2_000_000)
        request.send(bytes(15_000))
        tab.wait(lambda: "Receiving" in part(tab, "files"))
        say(tab, "cancel")
        assert "The file was not used; the arm stays as it is" in tab.html
        assert "Receiving" not in part(tab, "files")
        assert memory.held == 0
        request.send(bytes(1_985_000))
        assert request.getresponse().status == 409, "what is still on its way is dropped"
        assert memory.held == 0

        first = tab.begin_file("robot", "first.zip", 2_000_000)
        first.send(bytes(15_000))
        tab.wait(lambda: "Receiving “first.zip”" in part(tab, "files"))
        send(tab, "two.zip", packed(robot_files()))
        tab.wait(lambda: meshes(tab) == ALL)
        first.send(bytes(1_985_000))
        assert first.getresponse().status == 409, "a newer file has taken its place"
        tab.settle(0.5)
        assert "did not arrive" not in tab.html
        assert meshes(tab) == ALL


def test_files_are_refused_in_words_by_the_answer_and_in_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    viewer = ViewerServer(Store(), Settings(mesh_memory=MOST_BYTES), Clouds())
    with serve_viewer(viewer) as port, FakeBrowser(port) as tab:
        tab.settle()
        before = tab.value("Robot")
        request = tab.begin_file("robot", "big.zip", MOST_BYTES + 1)
        assert request.getresponse().status == 413, "before any of it has come"
        tab.wait(lambda: "big.zip: size: it is too large, expected at most 20 MB." in html.unescape(tab.html))
        held = viewer.services.meshes.of("127.0.0.1").memory.reserve(1_000_000)
        request = tab.begin_file("robot", "full.zip", MOST_BYTES)
        assert request.getresponse().status == 503
        tab.wait(lambda: "full.zip: the service holds as many files as it may" in html.unescape(tab.html))
        held.release()
        for feature, key in (("robot", "cell"), ("nobody", "upload"), ("program", "upload")):
            assert tab.open_file(feature, "a.zip", b"PK", key) == 404
        say(tab, "upload", value=["far.zip", 413])
        assert "Something between the browser and the service takes no file of this size" in tab.html
        name, tab.name = tab.name, "x" * 22
        assert tab.open_file("robot", "a.zip", b"PK") == 404, "of a page that is not there"
        tab.name = name
        assert tab.value("Robot") == before


def test_the_next_zip_and_leaving_end_what_is_being_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.shared.memory.answers.SMALL", 0)
    viewer = ViewerServer(Store(), Settings(), Clouds())
    reader = viewer.services.meshes
    begun, ended = threading.Semaphore(0), threading.Event()

    def answer(request: readers._Request) -> bytes:
        begun.release()
        while reader._running is request.future:
            ended.wait(0.01)
        raise MeshError("meshes", "ended", "nothing")

    monkeypatch.setattr(reader, "_answer", answer)
    with serve_viewer(viewer) as port, FakeBrowser(port) as tab:
        tab.settle()
        for name in ("first.zip", "second.zip", "third.zip"):
            send(tab, name, packed(robot_files()))
            assert begun.acquire(timeout=30.0)
        tab.wait(lambda: sum(reader._count.values()) == 1)
        say(tab, "cancel")
        assert "open the file again to see its meshes" in tab.html
        assert "Reading" not in part(tab, "files")
        tab.wait(lambda: not reader._count)
        send(tab, "fourth.zip", packed(robot_files()))
        assert begun.acquire(timeout=30.0)
        assert set(reader._count) == {"127.0.0.1"}, "limits per client count the address of the connection"
        tab.close()
        deadline = time.monotonic() + 30.0
        while (reader._count or reader.memory.held) and time.monotonic() < deadline:
            ended.wait(0.02)
        assert not reader._count
        assert reader.memory.held == 0


@pytest.mark.full
def test_a_real_shape_that_cannot_be_read_is_said_in_the_page() -> None:
    viewer = ViewerServer(Store(), Settings(), Clouds())
    viewer.services.meshes._of_packages._most = 0
    with serve_viewer(viewer) as port, FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(STORE.get("puma560").name)
        tab.set("Real shape", True)
        tab.wait(lambda: f"The real shape of {STORE.get('puma560').name} cannot be shown" in tab.html)
        assert "The simple drawing stays" in tab.html
        say(tab, "download", value="toml")
        type_in(tab, "tool", "z", "50")
        assert "cannot be shown" not in tab.html, "it is said once"


def test_the_shapes_of_a_urdf_need_no_zip(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.open_file("robot", "two.urdf", TWO_JOINTS)
        assert "Open it together with its meshes" in tab.html
        assert not meshes(tab)
        plain = TWO_JOINTS.replace('<mesh filename="../meshes/fore.obj"/>', '<sphere radius="0.05"/>')
        mesh = '<mesh filename="package://two_description/meshes/upper.stl" scale="0.001 0.001 0.001"/>'
        tab.open_file("robot", "plain.urdf", plain.replace(mesh, '<box size="0.1 0.1 0.4"/>'))
        tab.wait(lambda: meshes(tab) == ALL - {"mesh-2-2"})


@pytest.mark.full
def test_the_own_arm_can_be_deleted_and_examples_say_what_they_replace(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert 'data-arm-do="delete" aria-disabled="true"' in part(tab, "start")
        tab.choose(UR5.name)
        type_in(tab, "tool", "z", "100")
        mine = tab.value("Robot")
        say(tab, "delete")
        assert f"{mine} was deleted" in tab.html
        assert tab.value("Robot") == UR5.name
        tab.say("undo")
        tab.settle()
        assert tab.value("Robot") == mine
        say(tab, "start", value="planar-2r")
        assert f"{mine} was replaced" in tab.html
        say(tab, "start", value="planar-3r")
        assert "was replaced" not in tab.html, "an example that nobody changed is no loss"
        tab.say("undo")
        tab.settle()
        tab.say("undo")
        tab.settle()
        assert tab.value("Robot") == mine
