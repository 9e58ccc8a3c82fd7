"""Each snippet is run, or read as its program would read it, and gives our own numbers."""

from __future__ import annotations

import json
import re
import shlex
import sys
from dataclasses import replace
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from fastapi.testclient import TestClient

import kin
from app.exports.snippets import Moment, curl, matlab, python_kin, python_requests, robotics_toolbox, row_transform
from app.service.main import create_app
from app.shared.settings import Settings
from kin import Joint, Robot

ARMS = list(kin.files.classic_robots().values())


def moment(robot: Robot, **changes: object) -> Moment:
    q = robot.random_q(np.random.default_rng(4))
    return Moment(robot, q, kin.fk(robot, q), **changes)


@pytest.fixture(scope="module")
def client() -> TestClient:
    return TestClient(create_app(Settings()))


def mounted() -> Robot:
    """An arm with everything a table may have: fixed rows at both ends, base, tool, offsets, a slide."""
    rows = (
        Joint("adapter", 0.3, 0.1, 0.05, 0.4, "fixed", None),
        Joint("turn", 0.2, 0.3, 0.1, -0.7, "revolute", (-2.0, 2.0)),
        Joint("slide", 0.4, 0.2, 0.0, 1.1, "prismatic", (0.0, 0.5)),
        Joint("roll", -0.1, 0.0, 0.2, 0.0, "revolute", None),
        Joint("flange", 0.1, 0.05, 0.0, 0.2, "fixed", None),
    )
    tool = tuple(
        map(tuple, row_transform(Joint("t", 0.5, 0.1, 0.2, 0.3, "fixed", None), 0.0, "standard").tolist())
    )
    return Robot("mounted", 'My "arm"', "test", "modified", rows, (0.1, 0.2, 0.3), base=tool, tool=tool)


@pytest.mark.parametrize("task", ["pose", "approach", "position"])
@pytest.mark.parametrize("robot", ARMS, ids=lambda r: r.id)
def test_curl_asks_and_is_answered(client, robot, task):
    here = moment(robot, task=task, address="http://testserver/")
    commands = [shlex.split(line) for line in curl(here).replace("\\\n", "").splitlines()]
    assert [words[:2] for words in commands] == [["curl", "-s"]] * 2
    forward, inverse = (
        client.post(words[2], content=words[-1], headers=dict([words[words.index("-H") + 1].split(": ")])).json()
        for words in commands
    )
    assert np.abs(np.array(forward["pose"]["matrix"]) - here.target).max() < 1e-8
    assert inverse["status"] == "solved"
    assert inverse["task"] == task
    assert np.abs(np.array(inverse["solutions"][0]["q"]) - here.q).max() < 1e-6


def test_a_service_with_a_token_is_sent_one_and_the_snippet_does_not_hold_it():
    here = moment(ARMS[0], token=True)
    assert '-H "Authorization: Bearer $KINBOARD_TOKEN"' in curl(here)
    assert "os.environ" in python_requests(here)
    assert "headers=headers" in python_requests(here)


@pytest.mark.parametrize("token", [False, True])
def test_python_with_requests_runs(client, capsys, monkeypatch, token):
    monkeypatch.setenv("KINBOARD_TOKEN", "abc")
    sent = []

    def post(url: str, json: object, headers: dict[str, str] | None = None):
        sent.append(headers)
        return client.post(url, json=json)

    requests = ModuleType("requests")
    requests.post = post
    monkeypatch.setitem(__import__("sys").modules, "requests", requests)
    here = moment(ARMS[0], address="http://testserver/", token=token)
    exec(compile(python_requests(here), "snippet", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    assert np.abs(np.array(json.loads(printed[0].split("] [")[0] + "]")) - here.target[:3, 3]).max() < 1e-8
    assert printed[1].startswith("solved ")
    assert sent == [{"Authorization": "Bearer abc"} if token else None] * 2


@pytest.mark.parametrize("robot", ARMS, ids=lambda r: r.id)
def test_python_with_kin_runs(capsys, robot):
    here = moment(robot)
    names: dict[str, object] = {}
    exec(compile(python_kin(here), "snippet", "exec"), names)
    assert "solved" in capsys.readouterr().out
    result = names["result"]
    assert isinstance(result, kin.IKResult)
    assert np.abs(result.solutions[0].q - here.q).max() < 1e-6


def test_an_arm_of_the_operators_own_is_loaded_from_its_file():
    code = python_kin(moment(mounted()))
    assert 'kin.load_robot("mounted.toml")' in code
    assert "get_robot" not in code


def toolbox_fk(code: str) -> np.ndarray:
    """What Corke's toolbox computes from the code: its link equation, written down once more."""

    def link(kind: str, convention: str):
        def make(d=0.0, theta=0.0, a=0.0, alpha=0.0, offset=0.0, qlim=None):
            def at(q: float) -> np.ndarray:
                q += offset
                row = Joint("", q if kind == "R" else theta, d if kind == "R" else q, a, alpha, "fixed", None)
                return row_transform(row, 0.0, convention)

            return at

        return make

    class DHRobot:
        def __init__(self, links, name, base=None, tool=None):
            self.links = links
            self.base, self.tool = (np.eye(4) if T is None else T for T in (base, tool))

        def fkine(self, q):
            T = self.base
            for at, value in zip(self.links, q, strict=True):
                T = T @ at(value)
            return T @ self.tool

        def ikine_LM(self, target, q0):
            return np.array(q0)

    toolbox = SimpleNamespace(
        DHRobot=DHRobot,
        **{
            f"{n}{s}": link(n[0], c)
            for n in ("Revolute", "Prismatic")
            for s, c in (("DH", "standard"), ("MDH", "modified"))
        },
    )
    names = {**vars(toolbox), "np": np, "SE3": lambda T, check: T}
    body = "\n".join(line for line in code.splitlines() if not line.startswith(("import", "from")))
    exec(compile(body, "snippet", "exec"), names)
    return names["robot"].fkine(eval(re.search(r"fkine\((.*?)\)", code)[1], names))


@pytest.mark.parametrize("robot", [*ARMS, mounted()], ids=lambda r: r.id)
def test_the_robotics_toolbox_gets_the_same_arm(robot, capsys):
    here = moment(robot)
    assert np.abs(toolbox_fk(robotics_toolbox(here)) - here.target).max() < 1e-8


def test_a_fixed_row_between_joints_is_said_not_to_fit():
    arm = mounted()
    rows = (*arm.rows[:2], arm.rows[0], *arm.rows[2:])
    code = robotics_toolbox(moment(Robot("mid", "Mid\nrow", "test", "standard", rows, (0.1, 0.2, 0.3))))
    assert code.startswith("# Mid row has a fixed row between two joints")
    exec(code, {})


def matlab_fk(code: str) -> np.ndarray:
    """What MATLAB computes from the code: each statement that shapes the tree, read one by one."""

    def numbers(text: str) -> list[float]:
        return [float(word) for word in text.split()]

    def matrix(text: str) -> np.ndarray:
        return np.array([numbers(row) for row in text.split(";")])

    q = np.array(numbers(re.search(r"^q = \[(.*)\];", code, re.M)[1]))
    if expansion := re.search(r"^A = \[([^]]*)\];.*\nq = q \* A';$", code, re.M):
        q = q @ matrix(expansion[1]).T
    values = iter(q.tolist())
    offsets = iter(numbers(re.search(r"^offset = \[([^]]*)\]", code, re.M)[1]))
    T, parent, last = np.eye(4), "base", ""
    for block in code.split("body = ")[1:]:
        last = re.match(r"rigidBody\('(\w+)'\)", block)[1]
        assert f"addBody(robot, body, '{parent}');" in block
        parent = last
        kind = re.search(r"rigidBodyJoint\('\w+', '(\w+)'\)", block)[1]
        if kind == "fixed":
            T = T @ matrix(re.search(r"setFixedTransform\(joint, \[(.*)\]\);", block)[1])
            continue
        table, convention = re.search(r"setFixedTransform\(joint, \[(.*)\], '(m?dh)'\);", block).groups()
        a, alpha, d, theta = numbers(table)
        value = next(values) + next(offsets)
        lower, upper = numbers(re.search(r"PositionLimits = \[(.*)\];", block)[1])
        assert lower <= value <= upper
        theta, d = (value, d) if kind == "revolute" else (theta, value)
        row = Joint("", theta, d, a, alpha, "fixed", None)
        T = T @ row_transform(row, 0.0, "modified" if convention == "mdh" else "standard")
    assert f"getTransform(robot, q + offset, '{last}')" in code
    return T


@pytest.mark.parametrize("robot", [*ARMS, mounted()], ids=lambda r: r.id)
def test_matlab_gets_the_same_arm(robot):
    here = moment(robot)
    assert np.abs(matlab_fk(matlab(here)) - here.target).max() < 1e-8


def test_matlab_weighs_what_the_task_asks_for():
    assert "[0 0 0 1 1 1]" in matlab(moment(ARMS[0], task="position"))
    assert "[1 1 1 1 1 1]" in matlab(moment(ARMS[0], task="pose"))


def test_names_cannot_break_out_of_the_code():
    arm = Robot("evil", 'x"]);\nimport os\nsystem(1)', "test", "standard", mounted().rows, (0.1, 0.2, 0.3))
    assert np.abs(toolbox_fk(robotics_toolbox(moment(arm))) - moment(arm).target).max() < 1e-8
    assert "\nimport os" not in robotics_toolbox(moment(arm))
    assert "\nsystem" not in matlab(moment(arm))


def own() -> Moment:
    """An arm of a visitor's own, with a name that a shell or Python would mind, which no service knows."""
    name = 'Bob\'s "arm" $(true) `x` \\ é'
    return moment(replace(mounted(), id="own-0123456789ab", name=name), own=True, address="http://testserver/")


def test_an_own_arm_is_sent_along_by_curl(client):
    here = own()
    commands = [shlex.split(line) for line in curl(here).replace("\\\n", "").splitlines()]
    assert [words[2] for words in commands] == ["http://testserver/api/v1/fk", "http://testserver/api/v1/ik"]
    forward, inverse = (client.post(words[2], json=json.loads(words[-1])).json() for words in commands)
    assert np.abs(np.array(forward["pose"]["matrix"]) - here.target).max() < 1e-8
    assert inverse["status"] == "solved"


def test_an_own_arm_is_sent_along_by_requests(client, capsys, monkeypatch):
    here = own()
    module = SimpleNamespace(post=lambda url, json, headers=None: client.post(url, json=json))
    monkeypatch.setitem(sys.modules, "requests", module)
    exec(python_requests(here), {})
    assert "solved" in capsys.readouterr().out


def test_an_own_arm_is_built_in_python(capsys):
    here, scope = own(), {}
    exec(python_kin(here), scope)
    assert scope["robot"].name == here.robot.name
    assert np.abs(kin.fk(scope["robot"], here.q) - here.target).max() < 1e-15
    assert "solved" in capsys.readouterr().out


CRATE = kin.Obstacle("box", (2.0, 0.1, 0.3), (0.0, 0.0, 0.4), size=(0.2, 0.3, 0.4), name='a "crate"')
POLE = kin.Obstacle("cylinder", (-1.5, 0.0, 0.5), radius=0.05, height=1.0)


def asked_by_requests(code: str) -> dict[str, object]:
    """The question that the code sends to inverse kinematics."""
    sent: list[dict[str, object]] = []

    def post(address: str, json: dict[str, object], **_: object) -> object:
        sent.append(json)
        answer = {"pose": {"position": [], "wxyz": []}, "status": "", "reason": "", "solutions": []}
        return SimpleNamespace(json=lambda: answer)

    fake = ModuleType("requests")
    fake.post = post  # type: ignore[attr-defined]
    before, sys.modules["requests"] = sys.modules.get("requests"), fake
    try:
        exec(code, {})
    finally:
        if before is None:
            del sys.modules["requests"]
        else:
            sys.modules["requests"] = before
    return sent[1]


def test_obstacles_that_are_avoided_are_asked_for(client):
    here = moment(kin.get_robot("ur5"), obstacles=(CRATE, POLE), avoid=True, address="http://testserver/")
    expected = [kin.collision.obstacle_from_dict(item) for item in (CRATE.as_dict(), POLE.as_dict())]
    for question in (
        json.loads(shlex.split(curl(here).replace("\\\n", "").splitlines()[1])[-1]),
        asked_by_requests(python_requests(here)),
    ):
        assert question["avoid_self_collision"] is True
        assert [kin.collision.obstacle_from_dict(item) for item in question["obstacles"]] == expected
        answer = client.post("/api/v1/robots/ur5/ik", json=question)
        assert answer.status_code == 200, answer.text
    found: dict[str, object] = {}
    exec(python_kin(here), found)
    assert found["obstacles"] == list(expected)
    assert "obstacles=obstacles, avoid_self_collision=True)" in python_kin(here)


def test_obstacles_that_are_not_avoided_are_in_the_python_code_only():
    here = moment(kin.get_robot("ur5"), obstacles=(CRATE,))
    assert "obstacles" not in curl(here)
    assert "obstacles" not in asked_by_requests(python_requests(here))
    found: dict[str, object] = {}
    exec(python_kin(here), found)
    assert found["obstacles"] == [CRATE]
    for code in (python_kin(here), python_requests(here)):
        assert "avoids them" in code
        assert "crate" in code


def test_without_obstacles_the_code_does_not_speak_of_them():
    here = moment(kin.get_robot("ur5"))
    for code in (curl(here), python_requests(here), python_kin(here)):
        assert "obstacles" not in code
        assert "avoid" not in code


@pytest.mark.parametrize(("write", "read"), [(robotics_toolbox, toolbox_fk), (matlab, matlab_fk)])
def test_rows_that_follow_are_expanded_for_toolboxes_that_do_not_know_them(write, read):
    robot = kin.get_robot("palletiser")
    q = robot.random_q(np.random.default_rng(2))
    code = write(Moment(robot, q, kin.fk(robot, q)))
    assert np.abs(read(code) - kin.fk(robot, q)).max() < 1e-8
    assert "would move each row alone" in code
    assert "ikine" not in code
    assert "inverseKinematics(" not in code
