"""Motions that begin while the arm moves, from the definition: derivatives, limits, rest at the end."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin.motion import moving
from kin.motion.pieces import JointMotion

UR5 = kin.get_robot("ur5")
HOME = UR5.q_home
QD = np.array([0.6, -0.4, 0.0, 0.1, -0.8, 0.3])
QDD = np.array([2.0, 1.0, 0.0, -3.0, 0.0, 0.0])


def cases(count: int):
    """Random joints with limits ``(n, 3)``, and motions inside of them; some without a way, some at rest."""
    rng = np.random.default_rng(3)
    for k in range(count):
        n = int(rng.integers(1, 7))
        limits = np.stack([rng.uniform(0.2, 4, n), rng.uniform(0.5, 20, n), rng.uniform(2, 300, n)], axis=1)
        q = rng.uniform(-3, 3, n)
        goal = q + rng.uniform(-3, 3, n) * (0.0 if k % 7 == 0 else 1e-3 if k % 5 == 0 else 1.0)
        qd = rng.uniform(-1, 1, n) * limits[:, 0]
        room = np.sqrt(2.0 * limits[:, 2] * (limits[:, 0] - np.abs(qd)))
        qdd = rng.uniform(-1, 1, n) * np.minimum(limits[:, 1], room) * (k % 3 > 0)
        yield (q, goal, qd, qdd, limits) if k % 11 else (q, goal, 0.0 * qd, 0.0 * qdd, limits)


def test_a_motion_starts_as_the_arm_moves_keeps_every_limit_and_ends_at_rest():
    for q, goal, qd, qdd, limits in cases(150):
        found = moving.together(q, goal, qd, qdd, limits), moving.braked(q, qd, qdd, limits)
        for piece, end in zip(found, (goal, None), strict=True):
            times = np.linspace(0.0, piece.duration, 300)
            x, v, a, j = piece.at(times)
            for values, expected in ((x, q), (v, qd), (a, qdd)):
                assert values[0] == pytest.approx(expected, abs=1e-12)
            assert np.abs(v[-1]).max() < 1e-9
            assert end is None or x[-1] == pytest.approx(end, abs=1e-9)
            for values, limit in ((v, limits[:, 0]), (a, limits[:, 1]), (j, limits[:, 2])):
                assert (np.abs(values) <= limit * (1.0 + 1e-9) + 1e-12).all()
            low, high = moving.extremes(piece)
            assert (x.min(axis=0) >= low - 1e-12).all()
            assert (x.max(axis=0) <= high + 1e-12).all()
            # Continuous: what changes between two samples is what the next derivative allows.
            step = times[1] if piece.duration else 0.0
            for values, limit in ((x, limits[:, 0]), (v, limits[:, 1]), (a, limits[:, 2])):
                assert (np.abs(np.diff(values, axis=0)) <= limit * step * (1.0 + 1e-6) + 1e-9).all()


def test_from_rest_it_is_the_fastest_motion_from_rest_to_rest():
    for q, goal, qd, _, limits in cases(150):
        if not qd.any():
            piece = moving.together(q, goal, qd, qd, limits)
            least = JointMotion.between(q, goal, limits).duration
            assert piece.duration == pytest.approx(least, rel=1e-7, abs=1e-9)


def test_a_ptp_goes_on_from_the_motion_at_the_start():
    motion = kin.plan_motion(UR5, [kin.motion.Ptp(HOME + 0.5)], qd_start=QD, qdd_start=QDD)
    assert motion.refusal is None
    assert motion.notes == ()
    start, end = motion.sample([0.0, motion.duration]).qd
    assert start == pytest.approx(QD)
    assert motion.sample(0.0).qdd == pytest.approx(QDD)
    assert end == pytest.approx(0.0, abs=1e-9)
    assert motion.sample(motion.duration).q == pytest.approx(HOME + 0.5, abs=1e-12)
    assert all(peak.ratio <= 1.0 + 1e-9 for peak in motion.peaks if peak.ratio is not None)
    assert (motion.segments[0].start, motion.segments[0].end) == (0.0, motion.duration)


@pytest.mark.parametrize(
    "segment",
    [
        kin.motion.Lin(kin.motion.PoseTarget.of(kin.fk(UR5, HOME + 0.1))),
        kin.motion.Dwell(0.5),
        kin.motion.Ptp(HOME, tool_speed=0.2),
    ],
    ids=["lin", "dwell", "tool speed"],
)
def test_before_any_other_segment_the_arm_brakes_and_says_so(segment):
    motion = kin.plan_motion(UR5, [segment, kin.motion.Ptp(HOME)], qd_start=QD)
    assert motion.refusal is None
    brakes = motion.pieces[0]
    assert motion.sample(0.0).qd == pytest.approx(QD)
    assert motion.sample(brakes.duration).qd == pytest.approx(0.0, abs=1e-9)
    assert motion.segments[0].start == brakes.duration
    assert motion.q_before(0) == pytest.approx(motion.sample(brakes.duration).q, abs=1e-12)
    assert f"it brakes for {brakes.duration:.3f} s before the first segment." in motion.reason
    assert motion.q_start == pytest.approx(HOME)


def test_a_segment_that_is_gentle_is_gentle_from_the_start_unless_there_is_no_room():
    gentle = [kin.motion.Ptp(HOME + 0.5, acceleration=0.2)]
    found = kin.plan_motion(UR5, gentle, qd_start=QD)
    assert {peak.quantity: peak.ratio for peak in found.peaks if peak.joint == 4}["acceleration"] <= 0.2 + 1e-9
    near = HOME.copy()
    near[0] = UR5.upper[0] - 0.05
    hard = kin.plan_motion(UR5, [kin.motion.Ptp(HOME, acceleration=0.2)], near, qd_start=QD)
    assert hard.refusal is None
    assert {peak.quantity: peak.ratio for peak in hard.peaks if peak.joint == 0}["acceleration"] > 0.2


@pytest.mark.parametrize("segment", [kin.motion.Ptp(HOME), kin.motion.Dwell(1.0)])
def test_a_joint_that_cannot_stop_before_its_limit_is_named_with_its_place(segment):
    q = HOME.copy()
    q[0] = UR5.upper[0] - 0.01
    motion = kin.plan_motion(UR5, [segment], q, qd_start=[3.0, 0, 0, 0, 0, 0])
    refusal = motion.refusal
    assert refusal is not None
    assert (refusal.cause, refusal.segment, motion.part) == ("stop", 0, None)
    facts = refusal.details
    assert (facts.violation.joint, facts.violation.limit, facts.speed) == (0, UR5.upper[0], 3.0)
    assert facts.time == pytest.approx(0.01 / 3.0, rel=0.01), "it hardly brakes so soon"
    limits = kin.motion.motion_limits(UR5)
    row = np.stack([limits.velocity, limits.acceleration, limits.jerk], axis=1)[:1]
    stop = moving.braked(q[:1], np.array([3.0]), np.zeros(1), row)
    needed = float(stop.at(np.array([stop.duration]))[0, 0, 0])
    if isinstance(segment, kin.motion.Dwell):
        assert facts.violation.value == pytest.approx(needed, abs=1e-9)
    else:  # the joint turns back without a rest
        assert UR5.upper[0] < facts.violation.value < needed
    assert "joint 1 (base) cannot stop in time: it moves at 171.9" in refusal.reason


def test_a_part_of_a_refused_program_starts_in_motion_too():
    program = [kin.motion.Ptp(HOME + 0.2), kin.motion.Lin(kin.motion.PoseTarget((5.0, 0.0, 0.0)))]
    motion = kin.plan_motion(UR5, program, qd_start=QD)
    assert motion.refusal is not None
    assert motion.part is not None
    assert motion.part.sample(0.0).qd == pytest.approx(QD)
    assert motion.part.segments[0].index == 0
    assert motion.part.sample(motion.part.duration).qd == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("start", "field", "valid"),
    [
        ({"qd_start": [9.0] * 6}, r"qd_start\[0\]", "at most 3.14159 rad/s either way, as base may"),
        ({"qd_start": [0.0] * 5}, "qd_start", "6"),
        ({"qd_start": [0.0] * 5 + [np.nan]}, r"qd_start\[5\]", "finite"),
        ({"qd_start": [[0.0] * 6]}, "qd_start", "6 numbers, one for each joint"),
        (
            {"qdd_start": [0, 0, -99.0, 0, 0, 0]},
            r"qdd_start\[2\]",
            "at most 12.5664 rad/s² either way, as elbow may",
        ),
        (
            {"qd_start": [3.1, 0, 0, 0, 0, 0], "qdd_start": [12.0] + [0.0] * 5},
            r"qdd_start\[0\]",
            "at most 3.23317",
        ),
    ],
)
def test_a_start_outside_the_limits_is_refused_with_what_is_valid(start, field, valid):
    with pytest.raises(kin.InputError, match=field) as refused:
        kin.plan_motion(UR5, [kin.motion.Ptp(HOME)], **start)
    assert valid in str(refused.value)
