"""What the lesson "Trajectories" draws: a straight way of the tool, and one of joints that never go back."""

from __future__ import annotations

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.trajectories.lesson import TrajectoriesFacts, TrajectoriesSettings
from app.viewer.lessons.trajectories.motions import ways


@pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])
def test_one_way_is_straight_and_on_the_other_joints_never_go_back(robot: kin.Robot) -> None:
    known = TrajectoriesFacts(TrajectoriesSettings(True), Arm(robot, robot.q_home, robot.q_home)).ways
    found = ways(robot)
    if found is None:
        assert known == {}
        return
    start, end = known["lin"][0], known["lin"][-1]
    along = (end - start) / np.linalg.norm(end - start)
    off = known["lin"] - start - np.outer((known["lin"] - start) @ along, along)
    assert np.abs(off).max() < 1e-6
    # Each joint goes from its start to its end and never back.
    times = np.linspace(0.0, found.ptp.duration, len(known["ptp"]))
    q = found.ptp.sample(times).q
    assert (np.diff(q, axis=0) * np.sign(q[-1] - q[0]) > -1e-9).all()
    for values, point in zip(q, known["ptp"], strict=True):
        assert np.abs(numpy_arm.pose(robot, values)[:3, 3] - point).max() < 1e-9
    assert np.abs(known["ptp"][[0, -1]] - known["lin"][[0, -1]]).max() < 1e-6
