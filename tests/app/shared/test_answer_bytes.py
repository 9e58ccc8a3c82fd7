"""Answers of `ik` to a list of targets have the bytes of one plain answer after the other."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from pydantic_core import to_json

import kin
from app.shared.answers.answer import as_plain
from app.shared.answers.details import IkDetails, RedundancyAnswer, SingularityAnswer, Violation

AWKWARD = (
    [-0.0, -0.0, -0.0],
    [5e-324, -2.2250738585072014e-308, 1e-300],
    [1e-17, -1e-16, 0.30000000000000004],
    [999999.0, -999999.5, 123456.12345678],
    [0.05, -0.0, 0.1],
)


def poses_of(robot: kin.Robot) -> list[np.ndarray]:
    """Reached, outside the limits, at another angle, far away; some entries are -0.0; the first one twice."""
    middle = np.where(np.isfinite(robot.lower + robot.upper), 0.5 * (robot.lower + robot.upper), robot.q_home)
    found = [
        kin.fk(robot, q) for q in (robot.q_home, middle, robot.q_home + 0.1, 0.0 * robot.q_home, middle + 3.0)
    ]
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for T in found[:2]:
        turned = T.copy()
        turned[:3, :3] = T[:3, :3] @ turn
        found.append(turned)
    far = found[0].copy()
    far[:3, 3] *= -1e3
    signed = np.diag([1.0, -1.0, -1.0, 1.0])
    signed[3, :3] = signed[0, 1] = signed[0, 3] = -0.0
    return [*found, far, signed, found[0]]


def solution(found: kin.ik.IKSolution) -> dict[str, Any]:
    return {
        "q": [float(value) for value in found.q],
        "branch": found.branch,
        "position_error": float(found.position_error),
        "rotation_error": float(found.rotation_error),
        "in_limits": bool(found.in_limits),
        "distance": float(found.distance),
        "redundancy": [as_plain(RedundancyAnswer.of(each)) for each in found.redundancy],
        "compromise": found.compromise,
    }


def plain(result: kin.IKResult) -> dict[str, Any]:
    """Every field from the objects of the result, one by one, nothing kept from an earlier answer."""
    oriented = result.nearest_orientation
    position, rotation = result.tolerances
    usual = not result.target_error and (position, rotation) == (1e-9, 1e-9)
    tolerances = {"position": position, "rotation": rotation, "target_error": result.target_error}
    return {
        "status": result.status.value,
        "cause": result.cause,
        "details": as_plain(IkDetails.of(result.details)),
        "reason": result.reason,
        "task": result.task,
        "complete": result.complete,
        "completeness": result.completeness,
        "solver": result.solver,
        "solver_reason": result.solver_reason,
        "solutions": [solution(each) for each in tuple(result.solutions)],
        "closest": None if result.closest is None else solution(result.closest),
        "nearest_orientation": oriented and solution(oriented),
        "blocked": [
            {
                "branch": each.branch,
                "q": [float(v) for v in each.q],
                "violations": [as_plain(Violation.of(violation)) for violation in each.violations],
            }
            for each in result.blocked
        ],
        "violations": [as_plain(Violation.of(each)) for each in result.violations],
        "distance": float(result.distance),
        "redundancy": [as_plain(RedundancyAnswer.of(each)) for each in result.redundancy],
        "singularities": [as_plain(SingularityAnswer.of(each)) for each in result.singularities],
        **({} if usual else {"tolerances": tolerances}),
    }


def at_point(robot: kin.Robot, point: list[float]) -> kin.IKResult:
    T = np.eye(4)
    T[:3, 3] = point
    return kin.solve_ik(robot, T, task="position")


def expected(results: list[kin.IKResult]) -> bytes:
    return b'{"results":[' + b",".join(to_json(plain(each)) for each in results) + b"]}"


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_a_list_of_targets_is_answered_in_the_bytes_of_plain_answers(client, robot):
    statuses = set()
    for task in ("pose", "approach", "position"):
        poses = poses_of(robot)
        results = [kin.solve_ik(robot, T, task=task) for T in poses]
        statuses |= {each.status for each in results}
        body = {"target": [{"matrix": T.tolist()} for T in poses], "task": task}
        for _ in range(2):  # the second time with what the first one has kept
            answer = client.post(f"/api/v1/robots/{robot.id}/ik", json=body)
            assert answer.content == expected(results), task
    assert len(statuses) > 1
    points = [{"position": point} for point in AWKWARD]
    answer = client.post(f"/api/v1/robots/{robot.id}/ik", json={"target": points})
    assert answer.content == expected([at_point(robot, point) for point in AWKWARD])
    for point, alone in zip(points, json.loads(answer.content)["results"], strict=True):
        single = client.post(f"/api/v1/robots/{robot.id}/ik", json={"target": point})
        assert single.content == to_json(alone)


@pytest.mark.parametrize("value", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_are_not_finite_are_refused_by_the_place_in_the_list(client, value):
    body = f'{{"target": [{{"position": [0.1, 0.0, 0.1]}}, {{"position": [0.1, {value}, 0.1]}}]}}'
    headers = {"content-type": "application/json"}
    answer = client.post("/api/v1/robots/pioneer5/ik", content=body, headers=headers)
    assert answer.status_code == 422
    assert "target" in answer.json()["errors"][0]["field"]
