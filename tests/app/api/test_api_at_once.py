"""REST: one target is answered by the event loop where that is sooner than a thread could be asked."""

import numpy as np
import pytest
from fastapi import routing

import kin
from app.api import ik
from app.api.work import computed
from kin.transforms import wxyz_from_rotation


def target(robot, seed):
    T = kin.fk(robot, robot.random_q(np.random.default_rng(seed)))
    return {"position": T[:3, 3].tolist(), "wxyz": wxyz_from_rotation(T[:3, :3]).tolist()}


@pytest.fixture
def threads(computes_here, monkeypatch):
    """The requests that threads compute; none has been answered before."""
    asked = []

    async def counted(request, answer, took):
        asked.append(request.url.path)
        return await computed(request, answer, took)

    ik._ANSWERED.clear()
    monkeypatch.setattr(ik, "computed", counted)
    return asked


def ask(client, robot, **body):
    response = client.post(f"/api/v1/robots/{robot.id}/ik", json=body)
    assert response.status_code == 200, response.text
    return response.json()


@pytest.mark.parametrize(("robot_id", "task"), [("pioneer5", "approach"), ("ur5", "pose"), ("iiwa14", "pose")])
def test_the_answer_is_the_same_at_once_as_in_a_thread(client, threads, robot_id, task):
    robot = kin.get_robot(robot_id)
    targets = [target(robot, seed) for seed in range(4)]
    slow = ask(client, robot, target=targets, task=task, q_seed=(robot.q_home + 0.1).tolist())["results"]
    assert len(threads) == 1
    quick = [ask(client, robot, target=each, task=task, q_seed=(robot.q_home + 0.1).tolist()) for each in targets]
    assert len(threads) == 1
    assert quick == slow
    assert {each["status"] for each in quick} == {"solved"}


def test_what_may_take_longer_goes_to_a_thread(client, threads):
    robot = kin.get_robot("ur5")
    given = target(robot, 1)
    ask(client, robot, target=given)
    assert len(threads) == 1
    ask(client, robot, target=given)
    assert len(threads) == 1
    cases = [
        {"target": {"position": [3.0, 0.0, 0.0], "wxyz": [1, 0, 0, 0]}},
        {"target": given, "task": "position"},
        {"target": given, "images": "all"},
        {"target": given, "prefer": "limits"},
        {"target": given, "locked": [0.1, *[None] * 5]},
        {"target": given, "avoid_self_collision": True},
        {"target": given, "base": {"xyz": [0.1, 0.0, 0.0]}},
        {"target": given, "branch": "shoulder left"},
    ]
    for count, body in enumerate(cases, 2):
        ask(client, robot, **body)
        assert len(threads) == count, body


def test_a_wrong_value_is_refused_at_once_as_in_a_thread(client, threads):
    robot = kin.get_robot("ur5")
    given = target(robot, 1)
    url = f"/api/v1/robots/{robot.id}/ik"
    wrong = [{"target": given | {"wxyz": [0, 0, 0, 0]}}, {"target": given, "q_seed": [0.0]}, {"target": {}}]
    before = [client.post(url, json=body) for body in wrong]
    ask(client, robot, target=given)
    after = [client.post(url, json=body) for body in wrong]
    assert [each.status_code for each in before] == [422] * 3
    assert [each.json() for each in after] == [each.json() for each in before]


def test_arguments_are_collected_only_where_the_query_may_hold_some(client, monkeypatch):
    collected = []
    collect = routing.solve_dependencies

    async def counted(**given):
        collected.append(given["request"].url.path)
        return await collect(**given)

    monkeypatch.setattr(routing, "solve_dependencies", counted)
    robot = kin.get_robot("ur5")
    body = {"target": target(robot, 1)}
    whole = ask(client, robot, **body)
    assert client.post("/api/v1/ik", json={"robot": {"id": "ur5"}, **body}).status_code in (200, 422)
    assert collected == []
    some = client.post("/api/v1/robots/ur5/ik?fields=status,q", json=body).json()
    assert collected == ["/api/v1/robots/ur5/ik"]
    assert some == {"status": "solved", "q": whole["solutions"][0]["q"]}


@pytest.mark.parametrize(
    ("body", "status", "field"),
    [
        ({"target": {"position": [0, 0]}}, 422, "target.position"),
        ({"goal": 1}, 422, "goal"),
        (None, 422, "body"),
    ],
)
def test_a_body_that_is_wrong_is_refused_by_name(client, body, status, field):
    """Whether its errors are found before the arguments are collected or after."""
    answers = [
        client.post(f"/api/v1/robots/ur5/ik{query}", **({} if body is None else {"json": body}))
        for query in ("", "?fields=q")
    ]
    for answer in answers:
        assert answer.status_code == status
        assert any(error["field"].startswith(field) for error in answer.json()["errors"]), answer.text
    assert answers[0].json() == answers[1].json()
