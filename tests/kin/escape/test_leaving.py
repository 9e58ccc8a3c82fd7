"""Ways out of singularities, judged by forward kinematics at fine steps and by random tries."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import kin
from kin import leave_singularity
from kin.axes import size
from kin.collision.contacts import surroundings
from kin.differential.task import natural_task, task_jacobian, usual_rank
from kin.units import Units

UR5E, IIWA, PUMA = (kin.get_robot(name) for name in ("ur5e", "iiwa14", "puma560"))
WRIST = np.array([0.3, -1.2, 1.4, -0.7, 0.0, 0.2])  # of a UR: joint 5 at zero
STRAIGHT = np.array([0.1, 0.5, 0.2, 0.0, 0.3, 1.0, 0.4])  # of an iiwa: its elbow
UPRIGHT = np.array(
    [0.1, 0.0, math.pi / 2, -1.2, 0.3, 1.0, 0.4]
)  # the upper arm on axis 1, which the elbow may leave
ALIGNED = np.array([0.1, 0.0, 0.2, -1.2, 0.3, 0.0, 0.4])  # the upper arm on axis 1, and the hand along the forearm
TRIES = 500


def lengths(robot):
    """What a radian, or a metre, of each joint counts ``(n,)``."""
    reach = robot.reach if 0.0 < robot.reach < math.inf else size(robot)
    return np.where(robot.revolute, 1.0, 1.0 / reach)


def sigma(robot, q):
    """The measure of the answers, anew from the Jacobian: ``(...)`` at ``(..., n)``."""
    J = task_jacobian(robot, q) / lengths(robot)
    J[..., :3, :] /= size(robot)
    return np.linalg.svd(J, compute_uv=False)[..., usual_rank(robot, natural_task(robot)) - 1]


def missed(robot, q, T):
    """By how much the tool is off at ``(k, n)``: metres and radians ``(k,)``, of what the task is about."""
    at, task = kin.fk(robot, q), natural_task(robot)
    off = np.linalg.norm(at[:, :3, 3] - T[:3, 3], axis=1)
    if task == "position":
        return off, np.zeros(len(q))
    if task == "approach":
        return off, np.arctan2(np.linalg.norm(np.cross(at[:, :3, 2], T[:3, 2]), axis=1), at[:, :3, 2] @ T[:3, 2])
    turned = T[:3, :3].T @ at[:, :3, :3]
    return off, 2.0 * np.arcsin(
        np.clip(np.linalg.norm(turned - np.eye(3), axis=(1, 2)) / math.sqrt(8.0), 0.0, 1.0)
    )


def fine(q, step=0.002):
    """Configurations along a polyline."""
    parts = [np.linspace(a, b, 2 + int(np.abs(b - a).max() / step)) for a, b in pairwise(q)]
    return np.concatenate(parts)


def best_try(robot, q, margin):
    """The least deviation on `TRIES` straight motions into random directions, each to the margin."""
    drawn = np.random.default_rng(11).normal(size=(TRIES, robot.n))
    ahead = drawn / np.linalg.norm(drawn, axis=1)[:, None] / lengths(robot)
    shares = np.concatenate([np.linspace(0.002, 0.1, 50), np.linspace(0.12, 2.0, 95)])
    on = q + shares[:, None, None] * ahead
    good = (sigma(robot, on) >= margin) & ((on >= robot.lower) & (on <= robot.upper)).all(axis=2)
    least = math.inf
    for k in np.flatnonzero(good.any(axis=0)).tolist():
        last = int(np.argmax(good[:, k]))
        off, turned = missed(robot, on[: last + 1, k], kin.fk(robot, q))
        least = min(least, float(np.hypot(off / size(robot), turned).max()))
    return least


def check(robot, q, found, obstacles=(), itself=False):
    """Each way out is what the answer says of it."""
    T = kin.fk(robot, q)
    assert found.found, found.reason
    assert math.isclose(found.sigma, sigma(robot, q), abs_tol=1e-9)
    for each in found.exits:
        assert np.abs(each.q[0] - q).max() < 1e-9
        assert each.sigma >= found.margin
        assert math.isclose(each.sigma, sigma(robot, each.q[-1]), rel_tol=1e-9)
        on = fine(each.q)
        assert ((on >= robot.lower) & (on <= robot.upper)).all()
        off, turned = missed(robot, on, T)
        if each.keeps_tool:
            assert max(each.translation / size(robot), each.rotation) < 1e-9
            assert np.hypot(off / size(robot), turned).max() < 1e-4
        else:
            assert off.max() == pytest.approx(each.translation, rel=0.02, abs=1e-9)
            assert turned.max() == pytest.approx(each.rotation, rel=0.02, abs=1e-7)
        if obstacles or itself:
            assert kin.clearance(robot, on, obstacles).min() >= 0.0
        if each.posture is not None:
            assert each.posture == kin.branch_of(robot, each.q[-1])
    assert [each.keeps_tool for each in found.exits] == sorted((e.keeps_tool for e in found.exits), reverse=True)


def test_a_wrist_is_left_to_both_sides_and_no_random_try_deviates_less():
    found = leave_singularity(UR5E, WRIST)
    check(UR5E, WRIST, found)
    assert [each.posture.rpartition(" · ")[2] for each in found.exits] == ["wrist flip", "wrist no-flip"]
    assert found.singularities[0].kind == "wrist"
    assert not found.exits[0].keeps_tool
    assert found.exits[0].deviation <= 1.01 * best_try(UR5E, WRIST, found.margin)


def test_the_tool_stays_where_the_arm_can_leave_by_a_self_motion():
    found = leave_singularity("iiwa14", UPRIGHT)
    check(IIWA, UPRIGHT, found)
    assert all(each.keeps_tool for each in found.exits)
    assert "the tool stays where it is" in found.reason


def test_a_straight_elbow_bends_to_both_sides_and_moves_the_tool():
    found = leave_singularity(IIWA, STRAIGHT)
    check(IIWA, STRAIGHT, found)
    assert not any(each.keeps_tool for each in found.exits)
    assert {"elbow positive", "elbow negative"} <= {p for e in found.exits for p in e.posture.split(" · ")}
    # The tool moves by the square of what the elbow turns, about.
    assert found.exits[0].deviation < 0.2 * found.exits[0].length


@pytest.mark.full
def test_a_self_motion_around_a_corner_is_found():
    """Joints 1 and 3, and 5 and 7, turn against each other first; only then can the elbow swing."""
    found = leave_singularity(IIWA, ALIGNED)
    check(IIWA, ALIGNED, found)
    assert found.exits[0].keeps_tool
    assert len(found.exits[0].q) > 100


def test_a_way_out_touches_nothing():
    free = leave_singularity(UR5E, WRIST, avoid_self_collision=True)
    elbow = kin.link_frames(UR5E, WRIST)[2, :3, 3]
    end = kin.link_frames(UR5E, free.exits[0].q[-1])[2, :3, 3]
    place = tuple((elbow + 4.0 * (end - elbow)).tolist())  # in front of the elbow, which moves there
    ends = np.stack([WRIST, free.exits[0].q[-1]])
    apart = surroundings(UR5E, (kin.Obstacle("sphere", place, radius=1e-3),), links=False).distances(ends)[0]
    assert apart[0] > apart[1] + 0.01
    ball = kin.Obstacle("sphere", place, radius=float(apart[1]) + 0.003, name="ball")
    assert kin.clearance(UR5E, ends, [ball])[1] < 0.0
    found = leave_singularity(UR5E, WRIST, obstacles=[ball], avoid_self_collision=True)
    check(UR5E, WRIST, found, [ball], itself=True)
    assert free.exits[0].deviation < found.exits[0].deviation < 0.2


def test_a_caged_tool_has_no_way_out():
    place, balls = kin.fk(UR5E, WRIST)[:3, 3], []
    for side in np.vstack([np.eye(3), -np.eye(3)]):
        middle = tuple((place + 0.3 * side).tolist())
        tiny = surroundings(UR5E, (kin.Obstacle("sphere", middle, radius=1e-3),), links=False)
        radius = float(tiny.distances(WRIST[None])[0][0]) - 1e-3  # 2 mm beside the arm
        balls.append(kin.Obstacle("sphere", middle, radius=radius, name=f"ball {len(balls) + 1}"))
    found = leave_singularity(UR5E, WRIST, obstacles=balls)
    assert (found.found, found.cause.code) == (False, "blocked")
    assert found.reason.startswith("None of the ways out that were found is proven free of contacts: link ")
    assert found.cause.contact is not None


def test_every_way_out_is_checked_before_it_is_said_that_none_is_free(monkeypatch):
    """The last one, too, if it is the only free one."""
    ends = []

    def only(end):
        def is_free(space, a, b):
            ends.append(b)
            return end is not None and np.array_equal(b, end)

        monkeypatch.setattr("kin.way.free.Space.is_free", is_free)
        return leave_singularity(UR5E, WRIST, avoid_self_collision=True)

    assert only(None).cause.code == "blocked"
    assert len(ends) > 60
    assert np.array_equal(only(ends[-1]).exits[0].q[-1], ends[-1])


@pytest.mark.parametrize(
    ("q", "keywords", "code", "words"),
    [
        (UR5E.q_home, {}, "clear", "not near a singularity"),
        ([0.3, -1.2, 1.4, -0.7, 0.0, 9.0], {}, "start outside", "joint 6 (wrist 3) at 515.7°"),
        (WRIST, {"margin": 0.9}, "margin", "the largest σ_min found is 0."),
        (
            WRIST,
            {"obstacles": [kin.Obstacle("sphere", (0.0, 0.0, 0.3), radius=0.5, name="ball")]},
            "start touches",
            "touches ball",
        ),
    ],
)
def test_without_a_way_out_the_answer_says_why(q, keywords, code, words):
    found = leave_singularity(UR5E, q, **keywords)
    assert (found.found, found.exits, found.cause.code) == (False, (), code)
    assert words in found.reason


@pytest.mark.parametrize(
    ("q", "keywords", "field"),
    [
        (WRIST[:3], {}, "q"),
        (np.stack([WRIST, WRIST]), {}, "q"),
        (WRIST, {"margin": 0.0}, "margin"),
        (WRIST, {"margin": math.nan}, "margin"),
        (WRIST, {"margin": "far"}, "margin"),
        (WRIST, {"obstacles": ["table"]}, "obstacles[0]"),
    ],
)
def test_what_is_malformed_is_named(q, keywords, field):
    with pytest.raises(kin.InputError) as caught:
        leave_singularity(UR5E, q, **keywords)
    assert caught.value.field == field


def test_an_arm_at_another_size_leaves_by_the_same_motion():
    rows = tuple(replace(row, a=10.0 * row.a, d=10.0 * row.d) for row in UR5E.rows)
    large = replace(UR5E, id="large", rows=rows, capsules=())
    small, ten = leave_singularity(UR5E, WRIST).exits[0], leave_singularity(large, WRIST).exits[0]
    assert np.allclose(small.q[-1], ten.q[-1], atol=1e-4)
    assert ten.translation == pytest.approx(10.0 * small.translation, rel=1e-3)


def test_the_sentences_name_joints_tool_and_posture_in_the_readers_units():
    found = leave_singularity(PUMA, [0.0, -0.5, 0.5, 0.3, 0.0, 0.2])
    first = found.exits[0]
    said = found.explain(Units(False, "m"))
    assert said.startswith("The arm is at a singularity (axes 4 and 6 in line (θ5 = 0 rad)): σ_min is ")
    assert f"the tool moves by {first.translation:.4f} m" in said
    assert f"posture {first.posture}" in said
    assert said.count("way out:") == len(found.exits)


def cancelled():
    raise InterruptedError


def test_a_search_can_be_cancelled():
    with pytest.raises(InterruptedError):
        leave_singularity(UR5E, WRIST, cancel=cancelled)


def at_singularities(robot):
    """A configuration ``(n,)`` at each kind of singularity that Newton steps find, by its name."""
    rng, n, found = np.random.default_rng(5), robot.n, {}
    steps = 1e-6 * np.eye(n) / lengths(robot)
    for q in robot.random_q(rng, 60):
        at = q
        for _ in range(40):
            value = float(sigma(robot, at))
            if value < 1e-10:
                break
            slope = (sigma(robot, at + steps) - sigma(robot, at - steps)) / 2e-6
            move = -value * slope / max(float(slope @ slope), 1e-12)
            at = np.clip(
                at + move * min(1.0, 0.3 / float(np.abs(move).max())) / lengths(robot), robot.lower, robot.upper
            )
        if sigma(robot, at) < 1e-8:
            names = [s.condition for s in kin.singularities(robot, at, 1e-4) if s.kind != "algorithmic"]
            found.setdefault(names[0] if names else "other", at)
    return found


@pytest.mark.full
@pytest.mark.parametrize("robot", kin.builtin_robots().values(), ids=lambda robot: robot.id)
def test_every_arm_leaves_each_kind_of_singularity(robot):
    places = at_singularities(robot)
    for name, q in places.items():
        found = leave_singularity(robot, q)
        assert found.found, f"{name} at {q.tolist()}: {found.reason}"
        check(robot, q, found)
        best = found.exits[0]
        assert best.keeps_tool or best.deviation <= 1.01 * best_try(robot, q, found.margin), name
