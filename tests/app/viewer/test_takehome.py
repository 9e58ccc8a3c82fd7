"""Saved pages: what is in the file, that nothing is loaded from elsewhere, and that hostile names stay text."""

from __future__ import annotations

import base64
import json
import re
import zlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import kin
from app.viewer.arm import Arm
from app.viewer.panel.status import Notice
from app.viewer.scene.bodies.drawing import Drawing, drawing
from app.viewer.scene.bodies.parts import Part
from app.viewer.scene.meshes import body
from app.viewer.scene.shapes import Solid
from app.viewer.takehome import LARGEST, SavedArm, save_page, web_page
from app.viewer.takehome import page as page_of_arm
from app.viewer.takehome.page import shared_files
from app.viewer.takehome.sending import send_page
from kin.collision.obstacles import MOST_OBSTACLES
from kin.motion import JointTarget, Program, Ptp
from kin.units import DEFAULT_UNITS, Units

UR5 = kin.get_robot("ur5")
Q = np.array([0.3, -1.2, 1.4, -1.0, -1.5, 0.2])
ROBOTS = list(kin.builtin_robots().values())


def data_of(page: str) -> dict:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


def unpacked(text: str, kind: str) -> np.ndarray:
    """Rows of a mesh: the file has their differences, deflated."""
    steps = np.frombuffer(zlib.decompress(base64.b64decode(text)), kind).reshape(-1, 3)
    return np.cumsum(steps, axis=0, dtype=kind)


def fk_of(robot: dict, q: np.ndarray) -> np.ndarray:
    """Forward kinematics from the constants in the file."""
    T = np.eye(4)
    for link in robot["links"]:
        value = link["ratio"] * q[link["joint"]]
        c, s = np.cos(value), np.sin(value)
        motion = np.eye(4)
        if link["turns"]:
            motion[:2, :2] = [[c, -s], [s, c]]
        else:
            motion[2, 3] = value
        T = T @ np.reshape(link["axis"], (4, 4)) @ motion
    return T @ np.reshape(robot["tool"], (4, 4))


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)
def test_the_file_has_the_arm(robot):
    page = web_page(SavedArm(robot, robot.q_home, drawing(robot)))
    data = data_of(page)
    assert len(page.encode()) <= LARGEST
    for q in robot.random_q(np.random.default_rng(5), 3):
        assert np.allclose(fk_of(data["robot"], q), kin.fk(robot, q), atol=1e-12)
    assert [joint["name"] for joint in data["robot"]["joints"]] == [joint.name for joint in robot.joints]
    assert all(each["lower"] <= each["home"] <= each["upper"] for each in data["robot"]["joints"])
    assert [each["home"] for each in data["robot"]["joints"]] == list(robot.home)
    moved = [(row["joint"], row["ratio"]) for row in data["robot"]["rows"] if row["moves"]]
    names = [joint.name for joint in robot.joints]
    assert moved == [(names.index(row.follows or row.name), row.ratio) for row in robot.rows if row.moves]


def test_nothing_is_loaded_from_elsewhere():
    page = web_page(SavedArm(UR5, Q, drawing(UR5), link="https://arms.example/viewer/#s=x"))
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None
    assert policy[1].startswith("default-src 'none';")
    assert not re.search(r"https?:|//", policy[1])
    markup = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
    assert re.findall(r'(?:src|href)="([^"]*)"', markup) == ["data:,", "https://arms.example/viewer/#s=x"]


def test_pages_may_share_what_they_have_in_common():
    page, files = web_page(SavedArm(UR5, Q), shared=True), shared_files()
    markup = re.sub(r"<(script|style).*?</\1>", lambda found: found[0].partition(">")[0], page, flags=re.DOTALL)
    assert sorted(re.findall(r'(?:src|href)="([^"]*)"', markup)) == ["data:,", *sorted(files)]
    assert "script-src 'unsafe-inline' 'self'; style-src 'unsafe-inline' 'self';" in page
    alone = web_page(SavedArm(UR5, Q))
    assert all(text in alone for text in files.values())
    assert len(alone.encode()) - len(page.encode()) > 500_000


def test_postures_of_the_target_meet_it():
    T = kin.fk(UR5, Q)
    data = data_of(web_page(SavedArm(UR5, Q, target=T)))["target"]
    assert len(data["postures"]) == len(kin.solve_ik(UR5, T).solutions) == 8
    assert len({each["name"] for each in data["postures"]}) == 8
    for each in data["postures"]:
        assert np.allclose(kin.fk(UR5, each["q"]), T, atol=1e-9)
    assert "8 configurations" in data["reason"]
    assert [each["branch"] for each in data["postures"]] == [
        x.branch for x in kin.solve_ik(UR5, T, q_seed=Q).solutions
    ]


def test_a_target_of_rounded_digits_is_a_pose_in_the_file():
    T = np.round(kin.fk(UR5, Q), 4)
    R = T[:3, :3]
    assert np.abs(R.T @ R - np.eye(3)).max() > 1e-6, "more than the kernels of the page take"
    data = data_of(web_page(SavedArm(UR5, Q, target=T)))["target"]
    pose = np.reshape(data["pose"], (4, 4))
    assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-12)
    assert np.allclose(pose, T, atol=1e-4)
    assert len(data["postures"]) == 8


def test_a_target_out_of_reach_has_a_reason_and_no_postures():
    data = data_of(web_page(SavedArm(UR5, Q, target=kin.pose_from_xyz_rpy([3.0, 0.0, 0.5]))))["target"]
    assert data["postures"] == []
    assert "out of reach" in data["reason"].lower()


def test_a_program_is_sampled_from_start_to_end():
    program = Program(segments=(Ptp(JointTarget(tuple(Q.tolist()))),))
    motion = kin.plan_motion(UR5, program)
    data = data_of(web_page(SavedArm(UR5, UR5.q_home, motion=motion)))["program"]
    q = np.frombuffer(base64.b64decode(data["q"]), "<f8").reshape(-1, 6)
    assert len(q) == len(data["times"]) >= 60 * motion.duration
    assert data["times"][-1] == pytest.approx(motion.duration)
    assert np.allclose(q[[0, -1]], [UR5.q_home, Q], atol=1e-12)
    assert np.allclose(q, motion.sample(data["times"]).q, atol=1e-12)


def test_a_program_that_moves_the_gripper_says_that_the_page_does_not():
    said = "The gripper does not move in this page"
    moves = [kin.motion.Gripper(0.5, 0.2), Ptp(JointTarget(tuple(Q + 0.1)))]
    for segments, says in ((moves, True), (moves[1:], False)):
        motion = kin.plan_motion(UR5, segments, Q)
        assert (said in web_page(SavedArm(UR5, Q, motion=motion))) is says


def test_a_refused_program_is_said():
    motion = kin.plan_motion(UR5, Program(segments=(Ptp(JointTarget((9.0, 0.0, 0.0, 0.0, 0.0, 0.0))),)))
    assert motion.driven is None
    with pytest.raises(kin.InputError, match="motion"):
        web_page(SavedArm(UR5, Q, motion=motion))


def test_meshes_keep_their_shape():
    """In steps of 16 bits over the size of a mesh, points move by less than 10 µm."""
    data = data_of(web_page(SavedArm(UR5, Q, drawing(UR5))))["parts"]
    drawn = drawing(UR5)
    meant = [body(UR5).mount.part, *(part for parts in drawn.parts for part in parts)]
    assert len(data) == len(meant)
    for part, is_meant in zip(data, meant, strict=True):
        steps = unpacked(part["vertices"], "<u2")
        points = np.array(part["low"]) + steps * np.array(part["step"])
        assert np.abs(points - is_meant.mesh.vertices).max() < 1e-5
        faces = unpacked(part["faces"], "<u2")
        assert np.array_equal(faces, is_meant.mesh.faces)


def test_a_body_that_has_no_room_gives_way_to_the_one_made_from_the_table():
    rng = np.random.default_rng(1)
    large = Solid(rng.normal(size=(70_000, 3)), rng.integers(70_000, size=(150_000, 3)))
    links = ((Part("large", large, (1, 2, 3)),), *((),) * 6)
    drawn = Drawing(links, (np.empty((0, 4)),) * 7)
    page = web_page(SavedArm(UR5, Q, drawn))
    assert len(page.encode()) <= LARGEST
    assert page == web_page(SavedArm(UR5, Q))


def test_more_points_than_16_bits_count():
    large = Solid(np.random.default_rng(1).normal(size=(70_000, 3)), np.array([[0, 1, 69_999]]))
    drawn = Drawing(((Part("large", large, (1, 2, 3)),), *((),) * 6), ())
    part = data_of(web_page(SavedArm(UR5, Q, drawn)))["parts"][1]
    assert part["wide"]
    assert unpacked(part["faces"], "<u4").tolist() == [[0, 1, 69_999]]


def test_hostile_names_stay_text():
    name = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
    robot = replace(UR5, name=name, source=name)
    page = web_page(SavedArm(robot, Q))
    assert name not in page
    assert "<img" not in page.replace(robot.name, "")
    assert data_of(page)["title"] == name


@pytest.mark.parametrize("link", ["javascript:alert(1)", "ftp://x", "//x", "data:text/html,x"])
def test_a_link_is_the_address_of_a_page(link):
    with pytest.raises(kin.InputError, match="link"):
        web_page(SavedArm(UR5, Q, link=link))


def test_units_are_those_of_the_reader():
    data = data_of(web_page(SavedArm(UR5, Q, units=Units(degrees=False, length="m"))))
    assert data["units"] == {"degrees": False, "length": "m"}


def test_save_page_writes_a_file(tmp_path):
    file = kin.save_page("scara", tmp_path / "arm.html", q=[0.1, 0.2, 0.05, 0.3])
    assert data_of(file.read_text(encoding="utf-8"))["q"] == [0.1, 0.2, 0.05, 0.3]
    with pytest.raises(kin.InputError, match="q"):
        kin.save_page("scara", tmp_path / "other.html", q=[np.nan, 0.2, 0.05, 0.3])
    other = kin.plan_motion("puma560", Program(segments=(Ptp(JointTarget((0.1,) * 6)),)))
    with pytest.raises(kin.InputError, match="motion of the same arm"):
        save_page("ur5", tmp_path / "other.html", motion=other)
    with pytest.raises(kin.InputError, match=r"obstacles\[0\]"):
        kin.save_page("ur5", tmp_path / "other.html", obstacles=["table"])
    assert list(tmp_path.iterdir()) == [file]


class FakeStage:
    """What *Web page* uses of a page."""

    def __init__(self, arm: Arm, withheld: frozenset[str] = frozenset()) -> None:
        self.arm, self.robots = SimpleNamespace(now=arm), SimpleNamespace(own=None)
        self.display = SimpleNamespace(units=DEFAULT_UNITS)
        self.links = SimpleNamespace(page="https://arms.example/viewer/#s=x")
        self.activity = SimpleNamespace(withheld=withheld)
        self.bodies = SimpleNamespace(of=lambda robot, own: drawing(robot))
        self.files: list[tuple[str, bytes]] = []
        self.notices: list[Notice] = []
        self.client = SimpleNamespace(send_file_download=lambda name, data, **_: self.files.append((name, data)))
        self.status = SimpleNamespace(show=self.notices.append)


def test_the_visitor_gets_the_arm_on_show_with_its_link():
    T = kin.fk(UR5, Q)
    stage = FakeStage(Arm(UR5, UR5.q_home, Q, T, branch="elbow positive"))
    send_page(stage)
    ((name, file),) = stage.files
    data = data_of(file.decode())
    assert name == "ur5.html"
    assert data["q"] == Q.tolist()
    assert {each["name"].split(" · ")[1] for each in data["target"]["postures"]} == {"elbow +"}
    assert 'href="https://arms.example/viewer/#s=x"' in file.decode()
    assert stage.notices[0].title == "ur5.html is saved"


def test_what_an_open_question_asks_for_is_not_saved():
    stage = FakeStage(Arm(UR5, Q, Q), frozenset({"table"}))
    send_page(stage)
    assert stage.files == []
    assert stage.notices[0].title == "Not now"


def test_obstacles_are_drawn_where_they_are(tmp_path: Path) -> None:
    table = kin.Obstacle("table", [0.5, 0.1, 0.2], [0.0, 0.0, 0.5], size=[0.4, 0.6, 0.3])
    can = kin.Obstacle("cylinder", [0.3, 0.0, 0.4], [0.3, 0.2, 0.1], radius=0.05, height=0.2)
    ball = kin.Obstacle("sphere", [0.0, 0.4, 0.5], radius=0.1)
    file = kin.save_page("ur5", tmp_path / "arm.html", Q, obstacles=[table, can, ball])
    parts = data_of(file.read_text("utf-8"))["parts"][-3:]
    assert [part["link"] for part in parts] == [0, 0, 0]
    for part, each, low, high in (
        (parts[0], table, (-0.2, -0.3, -0.3), (0.2, 0.3, 0.0)),
        (parts[1], can, (-0.05, -0.05, -0.1), (0.05, 0.05, 0.1)),
        (parts[2], ball, (-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)),
    ):
        steps = unpacked(part["vertices"], "<u2")
        T = np.array(part["pose"]).reshape(4, 4)
        points = (np.array(part["low"]) + steps * part["step"]) @ T[:3, :3].T + T[:3, 3]
        F = kin.pose_from_xyz_rpy(each.xyz, each.rpy)
        local = (points - F[:3, 3]) @ F[:3, :3]
        assert np.allclose(local.min(axis=0), low, atol=2e-3)
        assert np.allclose(local.max(axis=0), high, atol=2e-3)


def test_many_obstacles_leave_room_and_too_large_a_page_is_refused(monkeypatch):
    balls = tuple(kin.Obstacle("sphere", [0.1 * k, 0.4, 0.5], radius=0.1) for k in range(MOST_OBSTACLES))
    alone = len(web_page(SavedArm(UR5, Q)))
    assert len(web_page(SavedArm(UR5, Q, obstacles=balls))) - alone < 3000 * MOST_OBSTACLES
    monkeypatch.setattr(page_of_arm, "LARGEST", alone)
    with pytest.raises(kin.InputError, match="obstacles"):
        web_page(SavedArm(UR5, Q, obstacles=balls))
    assert len(web_page(SavedArm(UR5, Q))) == alone
