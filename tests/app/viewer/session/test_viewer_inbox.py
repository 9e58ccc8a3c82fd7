"""The inbox, the easing and the shared pace: the parts that decide when and what a visitor sees."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from app.viewer.scene.motion import FRAME, LONGEST, SHORTEST, Motion, Pace
from app.viewer.session.worker.inbox import Inbox


def test_the_newest_value_of_a_key_wins_and_order_is_that_of_the_last_touch() -> None:
    inbox = Inbox()
    for key, value in [("gizmo", 1), ("slider", 2), ("gizmo", 3)]:
        inbox.post(key, value)
    assert inbox.waits
    assert inbox.take() == [("slider", 2), ("gizmo", 3)]
    assert inbox.take() == []
    assert not inbox.waits


def test_a_message_separates_the_values_of_before_from_those_of_after_it() -> None:
    inbox = Inbox()
    undo = ("message", "undo", 1)
    for key, value in [("slider", 1), ("slider", 2), (undo, None), ("slider", 3), ("slider", 4)]:
        inbox.post(key, value)
    assert inbox.take() == [("slider", 2), (undo, None), ("slider", 4)]
    assert inbox.take() == []
    inbox.post(undo, None)
    assert inbox.waits


def test_a_closed_inbox_gives_nothing_and_takes_nothing() -> None:
    inbox = Inbox()
    inbox.post("late", 1)
    inbox.close()
    assert inbox.waits
    assert inbox.take() is None
    inbox.post("later", 2)
    assert inbox.take() is None
    assert inbox.closed


def test_many_posters_lose_nothing_newest() -> None:
    inbox = Inbox()

    def post(name: int) -> None:
        for k in range(500):
            inbox.post(name, k)

    posters = [threading.Thread(target=post, args=(name,)) for name in range(4)]
    for poster in posters:
        poster.start()
    newest: dict[object, object] = {}
    while any(p.is_alive() for p in posters):
        newest.update(inbox.take() or [])
    newest.update(inbox.take() or [])
    assert newest == dict.fromkeys(range(4), 499)


def test_motion_is_monotonic_stays_between_its_ends_and_arrives_exactly() -> None:
    start, goal = np.array([0.0, 1.0, -0.3]), np.array([1.0, -1.0, -0.3])
    motion = Motion(start, np.ones(3))
    motion.aim(goal, now=10.0)
    shown = np.array([motion.at(10.0 + t) for t in np.linspace(0.0, LONGEST + 0.01, 60)])
    assert np.array_equal(shown[0], start)
    assert np.array_equal(shown[-1], goal)
    assert (np.diff(shown[:, 0]) >= 0).all()
    assert (np.diff(shown[:, 1]) <= 0).all()
    assert not motion.moving


def test_a_new_aim_starts_from_what_is_shown() -> None:
    motion = Motion(np.zeros(1), np.ones(1))
    motion.aim(np.ones(1), now=0.0)
    shown = motion.at(0.08)
    motion.aim(np.zeros(1), now=0.08)
    assert motion.at(0.08) == pytest.approx(shown)
    assert motion.goal == pytest.approx(0.0)


def test_small_steps_last_one_event_and_large_ones_are_bounded() -> None:
    motion = Motion(np.zeros(1), np.ones(1))
    motion.aim(np.full(1, 1e-3), now=0.0)
    motion.at(SHORTEST * 0.9)
    assert motion.moving
    motion.at(SHORTEST * 1.01)
    assert not motion.moving
    motion.aim(np.full(1, 100.0), now=1.0)
    motion.at(1.0 + LONGEST * 1.01)
    assert not motion.moving


def test_without_easing_the_goal_is_shown_at_once() -> None:
    motion = Motion(np.zeros(1), np.ones(1))
    motion.aim(np.ones(1), now=0.0, ease=False)
    assert motion.at(0.0) == pytest.approx(1.0)


def test_visitors_share_a_rate_of_frames() -> None:
    pace = Pace(frames_per_second=600.0)
    for visitor in range(10):
        pace.moving(visitor, True)
    assert pace.interval == pytest.approx(FRAME)
    for visitor in range(100):
        pace.moving(visitor, True)
    assert pace.interval == pytest.approx(100 / 600)
    assert not pace.eases
    for visitor in range(100):
        pace.moving(visitor, False)
    assert pace.eases
