"""Motions that touch the arm itself or obstacles."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin.collision.contacts import Surroundings

UR5 = kin.get_robot("ur5")
AWAY = UR5.q_home + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
MIDDLE = kin.fk(UR5, 0.5 * (UR5.q_home + AWAY))[:3, 3]
POST = kin.Obstacle("cylinder", MIDDLE.tolist(), radius=0.05, height=0.3, name="post")


def test_a_motion_is_refused_at_its_first_touch():
    program = [kin.Ptp(kin.JointTarget(AWAY)), kin.Dwell(1.0)]
    refused = kin.plan_motion(UR5, program, obstacles=[POST])
    assert not refused.planned
    details = refused.refusal.details
    assert (refused.refusal.cause, details.contact.obstacle, details.contact.name) == ("collision", 0, "post")
    free = kin.plan_motion(UR5, program)
    before = free.derivatives(np.linspace(0.0, details.time - 0.02, 500))[0]
    assert (kin.clearance(UR5, before, [POST]) > 0.0).all()
    assert kin.clearance(UR5, free.derivatives(details.time)[0], [POST]) < 0.0


@pytest.mark.parametrize("speed", [1.0, 0.01])
def test_slow_motions_and_pauses_are_checked_as_often_as_fast_ones(monkeypatch, speed):
    checks = []
    distances = Surroundings.distances
    monkeypatch.setattr(Surroundings, "distances", lambda near, q: checks.append(q) or distances(near, q))
    moves = [kin.Ptp(kin.JointTarget(AWAY), speed=speed), *[kin.Dwell(3600.0)] * 100]
    far = kin.Obstacle("sphere", (9.0, 0.0, 0.0), radius=0.1)
    assert kin.plan_motion(UR5, moves, obstacles=[far]).planned
    q = np.concatenate(checks)
    assert len(q) < 1000
    assert np.abs(np.diff(q, axis=0)).max() < 0.0101
    assert (q[0] == UR5.q_home).all()
    assert q[-1] == pytest.approx(AWAY)


def test_an_arm_that_rests_is_checked_where_it_is():
    here = kin.Obstacle("sphere", kin.fk(UR5, UR5.q_home)[:3, 3].tolist(), radius=0.1)
    refused = kin.plan_motion(UR5, [kin.Ptp(kin.JointTarget(UR5.q_home))], obstacles=[here])
    assert refused.refusal.details.time == 0.0
    assert refused.refusal.helps == ()
