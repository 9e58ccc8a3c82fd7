"""Ways around obstacles, judged by distances at fine steps and by answers for what cannot be."""

from __future__ import annotations

import sys
from functools import partial
from inspect import signature
from itertools import pairwise
from threading import Thread

import numpy as np
import pytest
from versions import needs_ompl

import kin
import kin.way
from kin.way.search import alone

find_way, way_program = (partial(f, avoid_self_collision=True) for f in (kin.way.find_way, kin.way.way_program))
UR5, PANDA, IIWA = (kin.get_robot(name) for name in ("ur5", "panda", "iiwa14"))


def post(robot: kin.Robot, q: np.ndarray) -> kin.Obstacle:
    """A post where the tool is at a configuration."""
    x, y, z = kin.fk(robot, q)[:3, 3].tolist()
    return kin.Obstacle("box", (x, y, z), size=(0.12, 0.12, 0.9), name="post")


def scene(robot: kin.Robot) -> tuple[np.ndarray, np.ndarray, kin.Obstacle]:
    """Start, goal and a post between, where the straight motion of the joints would pass."""
    start, goal = robot.q_home.copy(), robot.q_home.copy()
    goal[0] = robot.clip(start + 2.2)[0]
    return start, goal, post(robot, 0.5 * (start + goal))


def fine(q: np.ndarray) -> np.ndarray:
    """Configurations every 0.01 rad and closer along a polyline."""
    parts = [np.linspace(a, b, 2 + int(np.abs(b - a).max() / 0.01)) for a, b in pairwise(q)]
    return np.concatenate(parts)


@needs_ompl
@pytest.mark.parametrize("robot", [UR5, PANDA, IIWA], ids=lambda robot: robot.id)
def test_a_way_leads_around_a_post_and_its_program_touches_nothing(robot):
    start, goal, obstacle = scene(robot)
    assert kin.clearance(robot, fine(np.array([start, goal])), [obstacle]).min() < 0.0, "straight it would touch"
    way = find_way(robot, start, goal, obstacles=[obstacle], seed=3, time_limit=60.0)
    assert way.found, way.reason
    assert np.array_equal(way.q[[0, -1]], [start, goal])
    assert ((way.q >= robot.lower) & (way.q <= robot.upper)).all()
    assert kin.clearance(robot, fine(way.q), [obstacle]).min() > -1e-9
    assert way.length >= np.linalg.norm(goal - start)
    motion = way_program(way, [obstacle])
    assert motion.planned, motion.reason
    q = motion.derivatives(np.linspace(0.0, motion.duration, 2000))[0]
    assert np.allclose(q[[0, -1]], [start, goal], atol=1e-9)
    assert kin.clearance(robot, q, [obstacle]).min() > -1e-9
    assert all(peak.ratio < 1.0 + 1e-9 for peak in motion.peaks if peak.ratio is not None)


@needs_ompl
def test_the_same_seed_finds_the_same_way():
    start, goal, obstacle = scene(UR5)
    ways = [find_way(UR5, start, goal, obstacles=[obstacle], seed=seed, time_limit=60.0).q for seed in (5, 5, 6)]
    assert np.array_equal(ways[0], ways[1])
    assert ways[0].shape != ways[2].shape or not np.allclose(ways[0], ways[2])


def test_a_pose_may_be_reached_in_any_posture():
    start, goal, obstacle = scene(UR5)
    T = kin.fk(UR5, goal)
    way = find_way(UR5, start, T, obstacles=[obstacle], seed=1, time_limit=60.0)
    assert np.abs(kin.fk(UR5, way.q[-1]) - T).max() < 1e-6
    assert kin.clearance(UR5, fine(way.q), [obstacle]).min() > -1e-9


def test_a_free_motion_is_straight_and_needs_no_search(monkeypatch):
    monkeypatch.setitem(sys.modules, "ompl", None)
    start, goal, obstacle = scene(UR5)
    way = find_way(UR5, start, goal)
    assert len(way.q) == 2
    assert "straight" in way.reason
    with pytest.raises(kin.InputError, match="kinboard\\[ways\\]"):
        find_way(UR5, start, goal, obstacles=[obstacle])


def test_what_cannot_be_is_an_answer_with_its_reason():
    start, goal, obstacle = scene(UR5)
    ball = kin.Obstacle("sphere", kin.fk(UR5, goal)[:3, 3].tolist(), radius=0.1, name="ball")
    inside = find_way(UR5, start, goal, obstacles=[ball])
    assert (inside.found, inside.cause.code) == (False, "goal touches")
    assert inside.reason == "The goal touches something: link 6 touches ball."
    begun = find_way(UR5, goal, start, obstacles=[ball])
    assert begun.cause.code == "start touches"
    outside = start.copy()
    outside[2] = 9.0
    assert find_way(UR5, outside, goal).cause.code == "start outside"
    assert "joint 3 (elbow)" in find_way(UR5, start, outside).reason
    far = kin.fk(UR5, goal)
    far[0, 3] = 5.0
    unreachable = find_way(UR5, start, far, obstacles=[obstacle])
    assert unreachable.cause.code == "goal unreachable"
    assert "out of reach" in unreachable.reason.lower()


@needs_ompl
def test_none_found_in_time_is_not_called_none_and_a_search_reports_and_is_cancelled():
    start, goal, obstacle = scene(UR5)
    way = find_way(UR5, start, goal, obstacles=[obstacle], time_limit=1e-6)
    assert (way.found, way.q, way.cause.code, way.length) == (False, None, "time", 0.0)
    assert way.reason == (
        "None was found in 1e-06 s. That does not mean that there is none: more time or another seed may find one."
    )
    with pytest.raises(kin.InputError, match="a way that was found"):
        way_program(way, [obstacle])

    def cancel() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        find_way(UR5, start, goal, obstacles=[obstacle], cancel=cancel)
    parts: list[float] = []
    find_way(UR5, start, goal, obstacles=[obstacle], time_limit=60.0, progress=parts.append)
    assert parts
    assert parts[-1] >= parts[0] >= 0.0


@needs_ompl
def test_a_search_that_waits_for_another_one_keeps_its_time_and_is_cancelled():
    start, goal, obstacle = scene(UR5)

    def cancel() -> None:
        raise KeyboardInterrupt

    found = []
    with alone(lambda: None):
        waiting = Thread(
            target=lambda: found.append(find_way(UR5, start, goal, obstacles=[obstacle], seed=3, time_limit=60.0))
        )
        waiting.start()
        with pytest.raises(KeyboardInterrupt), alone(cancel):
            pass
        waiting.join(0.3)
        assert waiting.is_alive()
    waiting.join()
    assert found[0].found
    assert found[0].seconds < 60.0


@needs_ompl
def test_a_program_has_the_speeds_that_are_asked_for_and_stays_free_with_them():
    start, goal, obstacle = scene(UR5)
    way = find_way(UR5, start, goal, obstacles=[obstacle], seed=3, time_limit=60.0)
    like = kin.motion.Ptp(kin.motion.JointTarget(tuple(goal)), speed=0.3, acceleration=0.2, tool_speed=0.4)
    motion = way_program(way, [obstacle], like=like)
    assert motion.planned
    assert {(each.speed, each.acceleration, each.tool_speed) for each in motion.program.segments} == {
        (0.3, 0.2, 0.4)
    }
    assert motion.program.segments[-1].target.q == pytest.approx(goal)
    sample = motion.sample(np.linspace(0.0, motion.duration, 2000))
    assert sample.tool_speed.max() < 0.4 * (1 + 1e-3)
    assert kin.clearance(UR5, sample.q, [obstacle]).min() > -1e-9


@pytest.mark.parametrize(
    ("words", "field"),
    [
        ({"time_limit": 0.0}, "time_limit"),
        ({"time_limit": float("nan")}, "time_limit"),
        ({"time_limit": 1e9}, "time_limit"),
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
        ({"goal": [0.0] * 5}, "goal"),
        ({"goal": np.full((4, 4), np.nan)}, "goal"),
        ({"q_start": [np.inf] * 6}, "q_start"),
        ({"q_start": np.zeros((2, 6))}, "q_start"),
    ],
)
def test_bad_arguments_are_named(words, field):
    given = {"q_start": UR5.q_home, "goal": UR5.q_home + 0.1, **words}
    with pytest.raises(kin.InputError) as caught:
        find_way(UR5, **given)
    assert caught.value.field.partition("[")[0] == field


def test_links_may_touch_each_other_unless_that_is_avoided_here_as_elsewhere():
    functions = (kin.IKOptions, kin.way.find_way, kin.way.way_program)
    assert {signature(f).parameters["avoid_self_collision"].default for f in functions} == {False}
