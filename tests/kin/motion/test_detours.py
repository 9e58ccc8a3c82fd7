"""What leads past a singularity beside which a line is slow, tried with the planner."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from kin.motion import Lin, PoseTarget
from kin.motion.details import Slowed
from kin.transforms import rotation_about

UR5 = kin.get_robot("ur5")
START = np.array([0.0, -1.2, 1.6, -1.9, 0.3, 0.2])
END = np.add(START, [0.02, 0.0, 0.0, 0.0, -0.6, 0.0])  # joint 5 passes zero


def planned(robot, A, B, q):
    """The motion along the line between two poses from the posture of q, and its slow places."""
    start = kin.solve_ik(robot, A, q_seed=q).best.q
    motion = kin.plan_motion(robot, [Lin(PoseTarget.of(B))], start)
    return motion, [note for note in motion.notes if isinstance(note, Slowed)]


def changed(T, help_, share=1.0):
    """A pose with a shift or a tilt."""
    T, vector = T.copy(), share * np.array(help_.vector)
    if help_.code == "shift":
        T[:3, 3] += vector
    else:
        angle = float(np.linalg.norm(vector))
        T[:3, :3] = T[:3, :3] @ rotation_about(vector / angle, angle)
    return T


@pytest.fixture(scope="module")
def slow():
    """A line past a singular wrist: both its poses, and the note."""
    A, B = kin.fk(UR5, START), kin.fk(UR5, END)
    _, (note,) = planned(UR5, A, B, START)
    return A, B, note


def test_a_slow_line_says_where_by_which_joint_and_what_leads_past(slow):
    note = slow[2]
    assert [help_.code for help_ in note.helps] == ["ptp", "posture", "shift", "tilt"]
    assert 0.4 < note.fraction < 0.6
    assert note.joint in (3, 5)
    shift, tilt = note.helps[2:]
    assert 0.01 < np.linalg.norm(shift.vector) < 0.16 * UR5.reach
    assert math.radians(1.0) < np.linalg.norm(tilt.vector) < math.radians(30.0)


@pytest.mark.parametrize("which", [2, 3], ids=["shift", "tilt"])
def test_the_changed_line_is_not_slow_and_half_the_change_is_not_enough(slow, which):
    A, B, note = slow
    help_ = note.helps[which]
    motion, slow_places = planned(UR5, changed(A, help_), changed(B, help_), START)
    assert motion.planned
    assert not slow_places
    assert planned(UR5, changed(A, help_, 0.5), changed(B, help_, 0.5), START)[1]


def test_a_shift_is_across_the_line(slow):
    A, B, note = slow
    along = B[:3, 3] - A[:3, 3]
    assert abs(along @ note.helps[2].vector) < 1e-9


def test_from_the_posture_that_is_named_the_line_is_not_slow(slow):
    A, B, note = slow
    start = kin.solve_ik(UR5, A, branch=note.helps[1].posture, q_seed=START).best.q
    motion = kin.plan_motion(UR5, [Lin(PoseTarget.of(B))], start)
    assert motion.planned
    assert not [each for each in motion.notes if isinstance(each, Slowed)]


def test_the_sentence_has_the_amounts(slow):
    shift, tilt = slow[2].helps[2:]
    said = kin.plan_motion(UR5, [Lin(PoseTarget.of(slow[1]))], START).reason
    assert "A PTP to the same target is possible." in said
    assert f"shifted by {1e3 * np.linalg.norm(shift.vector):.1f} mm at least (along the world's axes: x " in said
    assert f"tilted by {math.degrees(np.linalg.norm(tilt.vector)):.1f}° at least" in said


def test_a_slow_place_of_an_ordinary_line_asks_for_nothing():
    line = kin.plan_motion("irb120", [Lin(PoseTarget((0.3, 0.2, 0.5)))])
    assert all(not note.helps for note in line.notes if isinstance(note, Slowed) and note.singularity is None)
