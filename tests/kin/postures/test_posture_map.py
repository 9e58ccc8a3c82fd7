"""Posture maps against one question at a time, and borders against the Jacobian."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

import kin
from kin.differential.task import task_jacobian
from kin.postures.maps import _labels, _letters, _Solver
from kin.postures.movable import Movable

DOWN = np.diag([1.0, -1.0, -1.0, 1.0])


def tilted(x: float, y: float, z: float) -> np.ndarray:
    return kin.pose_from_xyz_rpy([x, y, z], [0.4, 0.9, -0.3])


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("ur5", {}),
        ("puma560", {}),
        ("crx10ia", {}),
        ("pioneer5", {"task": "approach"}),
        ("scara", {}),
        ("rrp", {"task": "position"}),
    ],
)
@pytest.mark.parametrize("respect", [True, False])
def test_counts_are_those_of_inverse_kinematics(name, options, respect):
    robot = kin.get_robot(name)
    pose = kin.fk(robot, robot.q_home) if name in ("scara", "pioneer5", "rrp") else tilted(0.4, 0.1, 0.3)
    found = kin.posture_map(robot, pose, resolution=10, respect_limits=respect)
    plane = found.plane
    for i in range(0, 10, 2):
        for j in range(0, 10, 2):
            T = pose.copy()
            T[:3, 3] = plane.origin + found.x[i] * plane.u + found.y[j] * plane.v
            answer = kin.solve_ik(robot, T, respect_limits=respect, **options)
            assert found.counts[i, j] == len(answer.solutions), (i, j)
    assert found.counts.max() > 0


def test_straight_down_is_no_exception():
    """The tool of an offset wrist straight down: a general solver alone misses postures there."""
    robot = kin.get_robot("crx10ia")
    found = kin.posture_map(robot, DOWN, normal=[0.0, 1.0, 0.0], resolution=12, respect_limits=False)
    assert found.doubtful == 0
    assert set(np.unique(found.counts).tolist()) <= {0, 4, 8, 12, 16}


def test_a_node_with_a_number_of_its_own_is_counted_with_care():
    """A general solver misses two postures beside a singular wrist now and then."""
    movable = Movable.of(kin.get_robot("crx10ia"), kin.JointConstraints())
    solver = _Solver.of(movable, False, lambda: None)
    T = DOWN.copy()
    T[:3, 3] = 0.5577513142980353, 0.1, 1.0122153481705085
    assert [solver.counts(T[None], careful=careful)[0][0] for careful in (False, True)] == [6, 8]
    assert solver.lonely(np.array([[8, 8, 8], [8, 6, 8], [8, 8, 8]])).tolist() == [4]
    named = _Solver.of(Movable.of(kin.get_robot("ur5"), kin.JointConstraints()), False, lambda: None)
    assert named.lonely(np.array([[8, 6], [6, 8]])).tolist() == []


@pytest.mark.parametrize("name", ["gofa", "crx10ia", "jaco2", "ur5", "planar3r"])
def test_no_pose_of_an_arm_is_out_of_its_reach(name):
    robot = kin.get_robot(name)
    solver = _Solver.of(Movable.of(robot, kin.JointConstraints()), False, lambda: None)
    T = kin.fk(robot, np.random.default_rng(4).uniform(-math.pi, math.pi, (4000, robot.n)))
    assert solver._within_reach(T).all()


def test_nodes_out_of_reach_are_not_solved(monkeypatch):
    robot = kin.get_robot("crx10ia")
    found = kin.posture_map(robot, resolution=16)
    near = _Solver.of(Movable.of(robot, kin.JointConstraints()), True, lambda: None)._within_reach(
        found.plane.poses(robot, np.stack(np.meshgrid(found.x, found.y), axis=-1).reshape(-1, 2))
    )
    assert (found.counts > 0).sum() < near.sum() < 0.6 * 16**2
    monkeypatch.setattr(_Solver, "_within_reach", lambda self, T: np.ones(len(T), dtype=bool))
    assert (kin.posture_map(robot, resolution=16).counts == found.counts).all()


def test_borders_of_a_section_are_singular():
    robot = kin.get_robot("ur5")
    found = kin.posture_map(robot, tilted(0.3, 0.2, 0.3), resolution=40, respect_limits=False)
    assert found.curves
    assert {curve.kind for curve in found.curves} == {"singular"}
    step = found.x[1] - found.x[0]
    for curve in found.curves:
        for x, y in curve.points[::7]:
            T = found.plane.poses(robot, np.array([[x, y]]))[0]
            near = [kin.solve_ik(robot, T, respect_limits=False)]
            for dx, dy in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
                moved = found.plane.poses(robot, np.array([[x + dx, y + dy]]))[0]
                near.append(kin.solve_ik(robot, moved, respect_limits=False))
            assert len({len(each.solutions) for each in near}) > 1


def test_with_limits_there_are_borders_of_limits_too():
    found = kin.posture_map("puma560", tilted(0.4, 0.1, 0.3), resolution=30)
    kinds = {curve.kind for curve in found.curves}
    assert kinds == {"singular", "limit"}
    free = kin.posture_map("puma560", tilted(0.4, 0.1, 0.3), resolution=30, respect_limits=False)
    assert (found.counts <= free.counts).all()
    assert (found.counts < free.counts).any()


def test_in_a_plane_of_joints_the_curves_are_those_of_the_determinant():
    robot = kin.get_robot("ur5")
    q = np.array([0.3, -1.0, 1.2, -0.5, 1.0, 0.2])
    found = kin.posture_map(robot, joints=(2, 4), q=q, resolution=30)
    assert found.plane.joints == (2, 4)
    points = np.concatenate([curve.points for curve in found.curves])
    configurations = np.tile(q, (len(points), 1))
    configurations[:, [2, 4]] = points
    det = np.linalg.det(task_jacobian(robot, configurations))
    grid = np.tile(q, (30 * 30, 1))
    grid[:, [2, 4]] = np.stack(np.meshgrid(found.x, found.y, indexing="ij"), axis=-1).reshape(-1, 2)
    assert np.abs(det).max() < 0.2 * np.abs(np.linalg.det(task_jacobian(robot, grid))).max()
    # sin θ3 = 0 and sin θ5 = 0 are lines of this plane.
    half = math.pi / 2.0
    assert (
        np.minimum(np.abs((points + half) % math.pi - half).min(axis=1), 9.0) < 0.5 * (found.x[1] - found.x[0])
    ).mean() > 0.5
    for region in found.regions:
        own = q.copy()
        own[[2, 4]] = region.place
        assert region.branch == kin.branch_of(robot, own)
        assert region.branch in region.branches


def test_regions_have_their_postures():
    robot = kin.get_robot("ur5")
    found = kin.posture_map(robot, resolution=24)
    assert [region.name for region in found.regions] == [_letters(k) for k in range(len(found.regions))]
    shares = [region.share for region in found.regions]
    assert shares == sorted(shares, reverse=True)
    for region in found.regions:
        i, j = (int(np.abs(axis - at).argmin()) for axis, at in zip((found.x, found.y), region.place, strict=True))
        assert region.count == found.counts[i, j] == len(region.q) == len(set(region.branches))
        T = found.plane.poses(robot, region.place[None])[0]
        assert np.allclose(kin.fk(robot, region.q), T, atol=1e-7)
        assert robot.in_limits(region.q, 7.0).all()
    assert found.reason.startswith(f"{len(found.regions)} regions. A: 8 postures, ")


def test_without_a_region_the_nodes_are_counted():
    """Few poses of a section have the one orientation of five joints; a tilted tool has none."""
    assert kin.posture_map("pioneer5", resolution=8).reason == (
        "No region of 4 nodes or more: one node has a posture."
    )
    assert kin.posture_map("pioneer5", resolution=12).reason == (
        "No region of 4 nodes or more: 2 nodes have a posture."
    )
    turned = kin.pose_from_xyz_rpy([0.2, 0.1, 0.2], [1.0, 0.0, 0.0])
    empty = kin.posture_map("pioneer5", turned, normal=[0.0, 0.0, 1.0], resolution=8)
    assert (empty.counts.max(), empty.reason) == (0, "No posture at any node of this plane.")


def test_a_locked_joint_makes_an_arm_of_seven_one_of_six():
    robot = kin.get_robot("panda")
    found = kin.posture_map(robot, locked=[None] * 6 + [0.8], resolution=12)
    assert found.counts.max() > 0
    for region in found.regions:
        assert (region.q[:, 6] == 0.8).all()
        assert np.allclose(kin.fk(robot, region.q), found.plane.poses(robot, region.place[None])[0], atol=1e-3)


def test_a_joint_without_limits_may_be_given_some():
    limits = [None] * 5 + [(-0.2, 0.2)]
    found = kin.posture_map("ur3", limits=limits, resolution=16)
    assert found.regions
    for region in found.regions:
        assert (np.abs(region.q[:, 5]) <= 0.2 + 1e-9).all()
    assert 0 < found.counts.sum() < kin.posture_map("ur3", resolution=16).counts.sum()
    plane = kin.posture_map("ur3", joints=(4, 5), limits=limits, resolution=8).plane
    assert plane.window[1] == (-0.2, 0.2)


def test_labels_and_letters():
    parts = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 0]])
    label = _labels(parts)
    assert label[0, 0] == label[0, 1] == label[1, 1] == label[2, 2]
    assert len(set(label.reshape(-1).tolist())) == 3
    assert [_letters(k) for k in (0, 25, 26, 27, 52)] == ["A", "Z", "AA", "AB", "BA"]


def test_a_map_reports_its_progress_and_can_be_cancelled():
    seen: list[float] = []
    kin.posture_map("ur5", resolution=40, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    class EnoughError(Exception):
        pass

    def cancel() -> None:
        raise EnoughError

    with pytest.raises(EnoughError):
        kin.posture_map("ur5", cancel=cancel)


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (partial(kin.posture_map, "panda"), "robot"),
        (partial(kin.posture_map, "so101", resolution=8), "robot"),  # its closed form is for whole poses
        (partial(kin.posture_map, "ur5", resolution=7), "resolution"),
        (partial(kin.posture_map, "ur5", normal=[0.0, 0.0, 0.0]), "normal"),
        (partial(kin.posture_map, "ur5", tilted(9.0, 0.0, 0.0), normal=[1.0, 0.0, 0.0]), "target"),
        (partial(kin.posture_map, "ur5", np.ones((4, 4))), "target[3]"),
        (partial(kin.posture_map, "ur5", joints=(1, 1)), "joints"),
        (partial(kin.posture_map, "ur5", joints=(1, 6)), "joints"),
        (partial(kin.posture_map, "ur5", joints=(1,)), "joints"),
        (partial(kin.posture_map, "ur5", joints=(1, 2), normal=[0.0, 0.0, 1.0]), "joints"),
        (partial(kin.posture_map, "ur5", q=[0.0] * 6), "q"),
        (partial(kin.posture_map, "ur5", joints=(1, 2), q=[0.0] * 5), "q"),
    ],
)
def test_bad_input_names_the_argument(call, field):
    with pytest.raises(kin.InputError) as caught:
        call()
    assert caught.value.field == field
