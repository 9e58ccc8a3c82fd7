"""Distances between the links of an arm: against coal, against sampling, and against geometry."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import kin
from kin.collision.bodies import bodies_of
from kin.collision.kernels import segment_distance
from kin.kernels.compile import jit

GOLDEN = json.loads((Path(__file__).parents[2] / "data" / "golden-clearance.json").read_text("utf-8"))
ROBOTS = list(kin.files.classic_robots().values())


@jit
def distance(A, B):
    return segment_distance(A, 0, B, 0)


def ends(capsule: kin.collision.Capsule, robot: kin.Robot, q: np.ndarray) -> np.ndarray:
    T = robot.T_world_base if capsule.row < 0 else kin.link_frames(robot, q)[capsule.row]
    return np.array([T[:3, :3] @ p + T[:3, 3] for p in (capsule.start, capsule.end)])


@pytest.mark.parametrize("robot_id", GOLDEN)
def test_distances_agree_with_coal(robot_id):
    """Recorded by tests/data/make_golden_clearance.py."""
    q = np.array([each["q"] for each in GOLDEN[robot_id]])
    expected = [each["distance"] for each in GOLDEN[robot_id]]
    assert np.abs(kin.clearance(robot_id, q) - expected).max() < 1e-12


whole = st.integers(-3, 3).map(float)  # integers meet in parallels, crossings and points
real = st.floats(-2.0, 2.0, width=32)


@given(arrays(float, (1, 6), elements=st.one_of(whole, real)), arrays(float, (1, 6), elements=whole))
def test_no_two_points_of_the_segments_are_nearer(A, B):
    apart, s, t = distance(A, B)
    share = np.linspace(0.0, 1.0, 41)[:, None]
    first, second = (X[0, :3] + share * (X[0, 3:] - X[0, :3]) for X in (A, B))
    least = np.linalg.norm(first[:, None] - second[None], axis=2).min()
    step = (np.linalg.norm(A[0, 3:] - A[0, :3]) + np.linalg.norm(B[0, 3:] - B[0, :3])) / 80.0
    assert apart <= least + 1e-9
    assert apart >= least - step - 1e-9
    assert 0.0 <= s <= 1.0
    assert 0.0 <= t <= 1.0
    back, t_back, s_back = distance(B, A)
    assert back == pytest.approx(apart, abs=1e-9)
    there = [X[0, :3] + x * (X[0, 3:] - X[0, :3]) for X, x in ((A, s_back), (B, t_back))]
    assert np.linalg.norm(there[0] - there[1]) == pytest.approx(apart, abs=1e-9)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)
def test_the_capsules_follow_the_arm(robot):
    """Assumed capsules of a link begin where it is joined to the link before, and the last ends at the tool."""
    robot = replace(robot, capsules=())
    q = robot.random_q(np.random.default_rng(3))
    found = kin.collision.capsules(robot)
    assert [c.link for c in found] == sorted(c.link for c in found)
    frames = kin.link_frames(robot, q)
    axes = np.concatenate([robot.T_world_base[None], frames])[:, :3, 3]
    for capsule in found:
        a, b = ends(capsule, robot, q)
        assert min(np.linalg.norm(axes - b, axis=1).min(), np.linalg.norm(axes - a, axis=1).min()) < 1e-12
    tool = kin.fk(robot, q)[:3, 3]
    assert min(np.linalg.norm(end - tool) for end in ends(found[-1], robot, q)) < 1e-12
    for first, second in pairwise(found):
        if first.link == second.link:
            assert np.linalg.norm(ends(first, robot, q)[1] - ends(second, robot, q)[0]) < 1e-12


@pytest.mark.parametrize("robot", [robot for robot in ROBOTS if robot.capsules], ids=lambda robot: robot.id)
def test_stated_capsules_reach_every_link_and_the_tool(robot):
    """Every link has a body, home is clear, and the last one ends at the tool point."""
    found = kin.collision.capsules(robot)
    assert {c.link for c in found} == set(range(robot.n + 1))
    assert kin.clearance(robot, robot.q_home) > 0.0
    tool, far = kin.fk(robot, robot.q_home)[:3, 3], []
    for c in found:
        if c.link == robot.n:
            start, end = ends(c, robot, robot.q_home)
            points = start + np.linspace(0.0, 1.0, 50)[:, None] * (end - start)
            far.append(np.linalg.norm(points - tool, axis=1).min() - c.radius)
    assert min(far) < 0.02


def test_a_longer_tool_gets_a_body():
    arm = kin.get_robot("ur5").with_tool(kin.pose_from_xyz_rpy((0.0, 0.0, 0.4)))
    last = kin.collision.capsules(arm)[-1]
    assert (last.link, last.end) == (6, (0.0, 0.0, 0.4))
    assert len(kin.collision.capsules(arm)) == len(arm.capsules) + 1


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.id)
def test_links_that_share_a_joint_are_not_compared(robot):
    links = np.array([c.link for c in kin.collision.capsules(robot)])
    pairs = links[bodies_of(robot).pairs]
    assert (pairs[:, 1] > pairs[:, 0] + 1).all()


def test_a_folded_planar_arm_touches_itself_and_a_straight_one_does_not():
    arm = kin.get_robot("planar3r")
    radius = kin.collision.capsules(arm)[0].radius
    straight, folded = np.zeros(3), np.array([0.0, 2.8, 2.8])
    lengths = [row.a for row in arm.rows]
    assert kin.clearance(arm, straight) == pytest.approx(lengths[1] - 2.0 * radius)
    touching = kin.collision.nearest_links(arm, folded)
    assert touching is not None
    assert touching.links == (1, 3)
    tip = kin.fk(arm, folded)[:3, 3]
    assert touching.distance == pytest.approx(abs(tip[1]) - 2.0 * radius), (
        "the tip is nearest to link 1, on the x axis"
    )
    assert kin.clearance(arm, [straight, folded]).tolist() == [
        kin.clearance(arm, straight),
        touching.distance,
    ]


@pytest.mark.parametrize("robot", [r for r in ROBOTS if len(bodies_of(r).pairs)], ids=lambda robot: robot.id)
def test_the_points_lie_on_the_surfaces_of_the_links_named(robot):
    for q in robot.random_q(np.random.default_rng(7), 8):
        found = kin.collision.nearest_links(robot, q)
        assert found is not None
        apart = np.linalg.norm(found.points[1] - found.points[0])
        if apart < 1e-9 and found.distance < -1e-9:
            continue  # the axes cross
        assert apart == pytest.approx(abs(found.distance), abs=1e-9)
        for link, point in zip(found.links, found.points, strict=True):
            surfaces = []
            for capsule in kin.collision.capsules(robot):
                if capsule.link == link:
                    a, b = ends(capsule, robot, q)
                    along = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
                    surfaces.append(np.linalg.norm(point - a - along * (b - a)) - capsule.radius)
            assert min(map(abs, surfaces)) < 1e-9


def test_an_arm_of_two_links_cannot_touch_itself():
    assert kin.clearance("planar2r", [[0.0, 3.0], [1.0, 1.0]]).tolist() == [np.inf, np.inf]
    assert kin.collision.nearest_links("planar2r", [0.0, 3.0]) is None


def test_a_rod_that_slides_back_may_touch_what_is_behind():
    rows = [
        {"d": 0.5, "alpha": np.pi / 2},
        {"a": 0.6, "alpha": -np.pi / 2, "name": "fold"},
        {"kind": "prismatic", "limits": (0.0, 0.4)},
    ]
    arm = kin.Robot.from_dh(rows)
    rod = kin.collision.capsules(arm)[-1]
    assert np.linalg.norm(np.subtract(rod.end, rod.start)) == pytest.approx(0.4)
    drawn, in_ = ends(rod, arm, np.array([0.0, 0.0, 0.4])), ends(rod, arm, np.zeros(3))
    axis = kin.link_frames(arm, np.zeros(3))[1][:3, 3]
    assert np.linalg.norm(drawn[0] - axis) < 1e-12
    assert np.linalg.norm(in_[1] - axis) < 1e-12


@pytest.mark.parametrize("q", [[np.nan] * 6, [0.0] * 5, "home"])
def test_a_wrong_configuration_is_refused(q):
    with pytest.raises(kin.InputError, match="q"):
        kin.clearance("puma560", q)


def test_nearest_links_takes_one_configuration():
    with pytest.raises(kin.InputError, match="one configuration of 6"):
        kin.collision.nearest_links("puma560", np.zeros((2, 6)))
