"""Motions that touch the arm itself or obstacles."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin.collision import sweep

UR5 = kin.get_robot("ur5")
AWAY = UR5.q_home + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
MIDDLE = kin.fk(UR5, 0.5 * (UR5.q_home + AWAY))[:3, 3]
POST = kin.Obstacle("cylinder", MIDDLE.tolist(), radius=0.05, height=0.3, name="post")


def test_a_motion_is_refused_at_its_first_touch():
    program = [kin.motion.Ptp(kin.motion.JointTarget(AWAY)), kin.motion.Dwell(1.0)]
    refused = kin.plan_motion(UR5, program, obstacles=[POST])
    assert not refused.planned
    details = refused.refusal.details
    assert (refused.refusal.cause, details.contact.obstacle, details.contact.name) == ("collision", 0, "post")
    free = kin.plan_motion(UR5, program)
    before = free.derivatives(np.linspace(0.0, details.time - 0.02, 500))[0]
    assert (kin.clearance(UR5, before, [POST]) > 0.0).all()
    assert kin.clearance(UR5, free.derivatives(details.time)[0], [POST]) < 0.0


@pytest.mark.parametrize("speed", [1.0, 0.01])
def test_slow_motions_and_pauses_take_no_more_checks_than_fast_ones(monkeypatch, speed):
    checks = []
    margins = sweep.margins
    monkeypatch.setattr(sweep, "margins", lambda *args: checks.append(len(args[5])) or margins(*args))
    moves = [kin.motion.Ptp(kin.motion.JointTarget(AWAY), speed=speed), *[kin.motion.Dwell(3600.0)] * 100]
    far = kin.Obstacle("sphere", (9.0, 0.0, 0.0), radius=0.1)
    assert kin.plan_motion(UR5, moves, obstacles=[far]).planned
    assert 0 < sum(checks) < 20 * 101


def test_a_wire_that_is_grazed_for_a_moment_is_not_missed():
    """So little that samples every 0.01 rad pass it."""
    x, y, z = kin.fk(UR5, 0.37 * UR5.q_home + 0.63 * AWAY)[:3, 3].tolist()
    program = [kin.motion.Ptp(kin.motion.JointTarget(AWAY))]
    free = kin.plan_motion(UR5, program)
    q = free.derivatives(np.linspace(0.0, free.duration, 8001))[0]

    def wire(lower: float) -> kin.Obstacle:
        return kin.Obstacle("box", (x, y, z - lower), size=(0.002, 0.002, 0.0002), name="wire")

    deep, clear = 0.0, 0.08
    for _ in range(16):
        middle = 0.5 * (deep + clear)
        deep, clear = (middle, clear) if kin.clearance(UR5, q, [wire(middle)]).min() < 0.0 else (deep, middle)
    touching = np.flatnonzero(kin.clearance(UR5, q, [wire(deep)]) < 0.0)
    turned = np.abs(q[touching[-1]] - q[touching[0]]).max()
    assert turned < 0.01
    refused = kin.plan_motion(UR5, program, obstacles=[wire(deep)])
    assert refused.refusal.details.contact.name == "wire"
    assert refused.refusal.details.time == pytest.approx(free.duration * touching[0] / 8000, abs=2e-3)
    assert kin.plan_motion(UR5, program, obstacles=[wire(clear + 2e-5)]).planned


def test_an_arm_that_rests_is_checked_where_it_is():
    here = kin.Obstacle("sphere", kin.fk(UR5, UR5.q_home)[:3, 3].tolist(), radius=0.1)
    refused = kin.plan_motion(UR5, [kin.motion.Ptp(kin.motion.JointTarget(UR5.q_home))], obstacles=[here])
    assert refused.refusal.details.time == 0.0
    assert refused.refusal.helps == ()
