"""Numbers are in the frame that their documentation names: an arm with a base and a tool tells them apart."""

from __future__ import annotations

import numpy as np

import kin
from kin.transforms import frame_from_approach, rotation_vector

BASE = kin.pose_from_xyz_rpy([0.3, -0.5, 0.8], [0.4, -0.7, 1.9])
TOOL = kin.pose_from_xyz_rpy([0.02, 0.05, 0.11], [0.3, 0.2, -0.4])
PLAIN = kin.get_robot("ur5")
ARM = PLAIN.with_base(BASE).with_tool(TOOL)
Q = np.array([0.4, -1.3, 1.1, -0.6, 0.9, 0.2])
STEP = 1e-6


def world(q):
    """Pose of the tool in the world frame, from the arm without base and tool."""
    return BASE @ kin.fk(PLAIN, q) @ TOOL


def rates(before, after, seconds):
    """Velocity of the tool point and angular velocity in the world frame, by a central difference of poses."""
    turned = rotation_vector(after[:3, :3] @ before[:3, :3].T)
    return np.concatenate([after[:3, 3] - before[:3, 3], turned]) / seconds


def test_poses_points_and_row_frames_are_in_the_world_frame():
    assert np.allclose(kin.fk(ARM, Q), world(Q), atol=1e-12)
    assert np.allclose(kin.fk_positions(ARM, Q), world(Q)[:3, 3], atol=1e-12)
    assert np.allclose(kin.link_frames(ARM, Q), BASE @ kin.link_frames(PLAIN, Q), atol=1e-12)


def test_targets_are_in_the_world_frame():
    found = kin.solve_ik(ARM, world(Q), q_seed=Q)
    assert np.allclose(found.solutions[0].q, Q, atol=1e-9)
    at_point = kin.solve_ik(ARM, world(Q)[:3, 3], task="position", q_seed=Q)
    assert np.allclose(world(at_point.solutions[0].q)[:3, 3], world(Q)[:3, 3], atol=1e-8)


def test_a_jacobian_has_the_axes_of_the_world_frame_or_of_the_tool():
    columns = [rates(world(Q - STEP * axis), world(Q + STEP * axis), 2.0 * STEP) for axis in np.eye(6)]
    in_world = np.transpose(columns)
    assert np.allclose(kin.jacobian(ARM, Q), in_world, atol=1e-8)
    R = world(Q)[:3, :3]
    in_tool = np.vstack([R.T @ in_world[:3], R.T @ in_world[3:]])
    assert np.allclose(kin.jacobian(ARM, Q, "tool"), in_tool, atol=1e-8)


def test_pose_targets_samples_and_twists_of_a_motion_are_in_the_world_frame():
    goal = world(Q + np.array([0.2, 0.1, -0.1, 0.05, 0.1, 0.3]))
    motion = kin.plan_motion(ARM, [kin.motion.Lin(kin.motion.PoseTarget.of(goal))], Q)
    assert motion.refusal is None
    assert np.allclose(motion.sample(motion.duration).T, goal, atol=1e-8)
    t = 0.4 * motion.duration
    before, now, after = motion.sample([t - STEP, t, t + STEP]).T
    assert np.allclose(now, world(motion.sample(t).q), atol=1e-12)
    assert np.allclose(motion.sample(t).twist, rates(before, after, 2.0 * STEP), atol=1e-6)


def test_the_table_of_a_motion_is_in_the_world_frame():
    motion = kin.plan_motion(ARM, [kin.motion.Ptp(Q + 0.2)], Q)
    heading, *rows = "".join(motion.csv_pieces(20.0)).splitlines()
    names = heading.split(",")
    for row in rows[:: len(rows) - 1]:
        cells = dict(zip(names, map(float, row.split(",")), strict=True))
        T = world([cells[f"q{i + 1}"] for i in range(6)])
        assert np.allclose([cells[axis] for axis in "xyz"], T[:3, 3], atol=1e-9)
        assert np.allclose([cells[part] for part in ("qw", "qx", "qy", "qz")], kin.wxyz_from_rotation(T[:3, :3]))


def test_branches_paths_and_postures_are_of_targets_in_the_world_frame():
    targets = [world(Q), world(Q + 0.01), world(Q + 0.02)]
    branches = kin.ik_branches(ARM, targets[0])
    assert np.isfinite(branches).all(axis=1).sum() >= 4
    for q in branches[np.isfinite(branches).all(axis=1)]:
        assert np.allclose(world(q), targets[0], atol=1e-8)
    path = kin.solve_path(ARM, targets, q_start=Q)
    assert np.allclose([world(q) for q in path.q], targets, atol=1e-8)
    found = kin.path.path_postures(ARM, targets, q_start=Q)
    assert np.allclose(found.best.q, path.q, atol=1e-9)


def test_named_frames_and_screws_are_in_the_world_frame():
    assert np.allclose(kin.frame_pose(ARM, "base"), BASE, atol=1e-12)
    assert np.allclose(kin.frame_pose(ARM, "tool", q=Q), world(Q), atol=1e-12)
    assert np.allclose(kin.frame_pose(ARM, "table", {"table": TOOL}), TOOL, atol=1e-12)
    screws = kin.dh.screws(ARM)
    assert np.allclose(screws.pose(Q), world(Q), atol=1e-12)
    assert np.allclose(screws.S[:3, 0], BASE[:3, 2], atol=1e-12)
    assert np.allclose(screws.S[3:, 0], np.cross(BASE[:3, 3], BASE[:3, 2]), atol=1e-12)


def test_sections_and_voxels_are_in_the_world_frame():
    arm = kin.get_robot("scara").with_base(BASE)
    plain = kin.get_robot("scara")
    section = kin.workspace.workspace_section(arm)
    arc = section.arcs[0]
    s, t = arc.points[0]
    point = (BASE @ kin.fk(plain, arc.q))[:3, 3]
    along = (point - section.origin) @ section.v
    away = np.linalg.norm(point - section.origin - along * section.v)
    assert np.allclose([away, along], [s, t], atol=1e-6)
    assert np.allclose(section.v, BASE[:3, 2], atol=1e-9)
    plain = kin.get_robot("puma560")
    found = kin.workspace.capability_map(plain.with_base(BASE), resolution=5, directions=12)
    voxels, ways = np.nonzero(found.approachable)
    for k in range(0, len(voxels), len(voxels) // 10):
        T = np.eye(4)
        T[:3, :3] = frame_from_approach(found.grid.directions[ways[k]])
        T[:3, 3] = found.centres[voxels[k]]
        assert kin.solve_ik(plain, np.linalg.inv(BASE) @ T, task="approach").status == "solved"


def test_a_rotation_mask_has_the_axes_of_the_world_frame_or_of_the_target():
    turned = world(Q) @ kin.pose_from_xyz_rpy([0, 0, 0], [0, 0, 0.7])  # about the z axis of the target
    mask = [True] * 5 + [False]
    free = kin.solve_ik(ARM, turned, mask=mask, mask_frame="tool", q_seed=Q)
    assert np.allclose(world(free.solutions[0].q)[:3, 2], turned[:3, 2], atol=1e-6)
    upright = kin.pose_from_xyz_rpy([0, 0, 0], [0, 0, 0.7])
    about_world = np.eye(4)
    about_world[:3, :3] = upright[:3, :3] @ world(Q)[:3, :3]
    about_world[:3, 3] = world(Q)[:3, 3]
    found = kin.solve_ik(ARM, about_world, mask=mask, mask_frame="base", q_seed=Q)
    apart = rotation_vector(world(found.solutions[0].q)[:3, :3] @ about_world[:3, :3].T)
    assert np.allclose(apart[:2], 0.0, atol=1e-6)


def test_clouds_and_sizes_are_in_the_world_frame():
    cloud = kin.workspace.workspace_slice(ARM, 50, 0, 50, with_q=True)
    assert np.allclose(cloud.points, [world(q)[:3, 3] for q in cloud.q], atol=1e-5)
    facts = kin.workspace.workspace_facts(ARM, volume=False)
    for axis, span in enumerate((facts.x, facts.y, facts.z)):
        assert np.isclose(world(span.largest.q)[axis, 3], span.largest.value, atol=1e-6)
    assert np.allclose(np.abs(facts.axis @ BASE[:3, 2]), 1.0)


def test_contacts_and_obstacles_are_in_the_world_frame():
    touched = kin.Obstacle("sphere", xyz=tuple(world(Q)[:3, 3] - 0.06 * world(Q)[:3, 2]), radius=0.05, name="ball")
    assert "ball" in kin.collision.nearest_contact(ARM, Q, [touched]).text
    points = np.asarray(kin.collision.nearest_links(ARM, Q).points)
    plain = np.asarray(kin.collision.nearest_links(PLAIN, Q).points)
    assert np.allclose(points, plain @ BASE[:3, :3].T + BASE[:3, 3], atol=1e-9)


def test_a_mounted_tool_goes_on_the_tool_of_the_arm_and_another_tool_replaces_it():
    tip = kin.pose_from_xyz_rpy([0.0, 0.0, 0.2], [0.0, 0.5, 0.0])
    assert np.allclose(kin.fk(ARM.with_mounted(tip), Q), world(Q) @ tip, atol=1e-12)
    assert np.allclose(kin.fk(ARM.with_tool(tip), Q), BASE @ kin.fk(PLAIN, Q) @ tip, atol=1e-12)
