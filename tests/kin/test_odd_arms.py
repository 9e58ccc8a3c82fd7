"""Arms that somebody may type: every call answers, or refuses with a reason."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from arms import random_arms

import kin
from app.shared.answers.inspection import inspect
from kin import IKOptions, Robot
from kin.ik import solve

ODD = {
    "no size": [(0, 0, 0, 0)],
    "six times nothing": [(0, 0, 0, 0)] * 6,
    "kilometres": [(0, 0, 2e4, 0)] * 4,
    "one slide": [{"kind": "prismatic"}],
    "slides alone": [{"kind": "prismatic", "alpha": 1.57}] * 6,
    "no limits": [{"limits": None, "a": 0.3}] * 3,
    "hardly any range": [{"limits": (0, 1e-9), "a": 0.3}] * 4,
    "ten joints": [(0, 0.1, 0.2, 1.57)] * 10,
    "five oblique axes": [(0.3, 0.1, 0.2, 0.7)] * 5,
}
CASES = [
    *(pytest.param(Robot.from_dh(rows, "modified"), id=name) for name, rows in ODD.items()),
    *(pytest.param(robot, id=f"random {k}") for k, robot in enumerate(random_arms(12))),
]


@pytest.mark.parametrize("robot", CASES)
def test_every_call_is_answered(robot):
    assert inspect(robot).motions <= min(robot.n, 6)
    assert kin.robot_from_dict(kin.robot_to_dict(robot)) == robot
    assert kin.dh.convert_dh(kin.dh.convert_dh(robot, "standard"), "modified").n == robot.n
    q = robot.random_q(np.random.default_rng(1))
    T = kin.fk(robot, q)
    far = T.copy()
    far[0, 3] += 3.0 * robot.reach + 1.0
    for task, prefer in itertools.product(
        ("pose", "approach", "position"), ("nearest", "limits", "manipulability")
    ):
        result = solve(robot, T, IKOptions(task=task, prefer=prefer), q)
        assert result.solutions
        assert result.solutions[0].position_error <= 1e-6 * max(1.0, robot.reach)
        assert result.explain().text
    away = solve(robot, far, IKOptions(task="position"))
    assert away.solutions == ()
    assert away.explain().text
    path = kin.solve_path(robot, kin.fk(robot, [robot.q_home, q]))
    assert path.q.shape == (2, robot.n)
