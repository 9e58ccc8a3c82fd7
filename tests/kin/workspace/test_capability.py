"""Capability maps: compared with `solve_ik`; independent of the order of blocks; limits and locks."""

from __future__ import annotations

import itertools
import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from arms import eight_joints

import kin
from kin import InputError, workspace
from kin.axes import screw_x, screw_z
from kin.robot import Joint, Robot
from kin.transforms import frame_from_approach
from kin.workspace.capability import blocks as capability
from kin.workspace.capability.sphere import DESIGNS, spherical_design

TILTED = screw_x(0.03, 0.4)  # a tool off the last axis, and oblique to it


def tilted(robot_id):
    robot = kin.get_robot(robot_id)
    return replace(robot, id="tilted", tool=tuple(map(tuple, (robot.T_last_tool @ TILTED).tolist())))


@lru_cache
def arm(name):
    if name.startswith("longer "):
        return eight_joints(kin.get_robot(name.removeprefix("longer ")))
    return tilted(name.removeprefix("tilted ")) if name.startswith("tilted") else kin.get_robot(name)


@lru_cache
def mapped(name, resolution=7, directions=12):
    return kin.workspace.capability_map(arm(name), resolution=resolution, directions=directions)


def dense(found):
    """Reachable ``(a, b, c)`` and approachable ``(a, b, c, m)`` for the whole grid."""
    reachable = np.zeros(found.grid.shape, dtype=bool)
    approachable = np.zeros((*found.grid.shape, found.grid.count), dtype=bool)
    reachable[*found.index.T] = True
    approachable[*found.index.T] = found.approachable
    return reachable, approachable


def target(point, direction):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = frame_from_approach(direction), point
    return T


def compared(found, rng, count, **limits):
    """(reachable, approachable) of random voxels: pairs of the map's value and that of `solve_ik`."""
    robot, grid = found.grid.robot, found.grid
    reachable, approachable = dense(found)
    for index in rng.permutation([*np.ndindex(grid.shape)])[:count]:
        centre = grid.centres(index[None])[0]
        there = kin.solve_ik(robot, centre, task="position", **limits).status == "solved"
        yield reachable[*index], there
        if not there:
            assert not approachable[*index].any()
            continue
        for claimed, direction in zip(approachable[*index], grid.directions, strict=True):
            result = kin.solve_ik(robot, target(centre, direction), task="approach", **limits)
            if result.status == "solved":
                T = kin.fk(robot, result.solutions[0].q)
                assert np.allclose(T[:3, 3], centre, atol=1e-8)
                assert np.allclose(T[:3, 2], direction, atol=1e-8)
            yield claimed, result.status == "solved"


# The directions


@pytest.mark.parametrize(("count", "degree"), DESIGNS.items())
def test_directions_are_a_spherical_design(count, degree):
    directions = spherical_design(count)
    assert directions.shape == (count, 3)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=0, atol=1e-15)
    assert directions[0].tolist() == [0.0, 0.0, -1.0]
    apart = np.linalg.norm(directions[:, None] - directions, axis=-1) + 2.0 * np.eye(count)
    assert apart.min() > 2.0 / math.sqrt(count)

    def error(total):
        """Largest difference between the means of all monomials of this degree and those over the sphere."""
        powers = [p for p in itertools.product(range(total + 1), repeat=3) if sum(p) == total]
        return max(abs(np.prod(directions**p, axis=1).mean() - sphere_mean(p)) for p in powers)

    assert max(error(total) for total in range(degree + 1)) < 1e-15
    assert error(degree + 1) > 1e-6


def sphere_mean(powers):
    """(a−1)!! (b−1)!! (c−1)!! / (a+b+c+1)!!, and 0 if a power is odd."""
    if any(p % 2 for p in powers):
        return 0.0
    odd = [math.prod(range(1, p, 2)) for p in powers]
    return math.prod(odd) / math.prod(range(1, sum(powers) + 2, 2))


# Comparison with inverse kinematics


@pytest.mark.full
@pytest.mark.parametrize("name", ["pioneer5", "puma560", "ur5", "scara", "redundant7", "redundant7-craig"])
def test_a_closed_form_map_equals_inverse_kinematics_everywhere(name):
    found = mapped(name)
    assert found.grid.method == "closed form"
    pairs = np.array([*compared(found, np.random.default_rng(1), 25)])
    assert (pairs[:, 0] == pairs[:, 1]).all()
    assert 0 < pairs[:, 0].sum() < len(pairs)


@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("tilted puma560", "sweep"),
        pytest.param("panda", "sweep", marks=pytest.mark.slow),
        pytest.param("longer panda", "search", marks=pytest.mark.slow),
    ],
)
def test_other_maps_have_no_false_positives_and_few_misses(name, method):
    found = mapped(name, 5)
    assert found.grid.method == method
    claimed, true = np.array([*compared(found, np.random.default_rng(2), 16)]).T
    assert not (claimed & ~true).any()
    assert claimed.sum() > 0.97 * true.sum() > 0


def test_the_redundancy_of_a_singular_target_is_resolved_inside_the_limits():
    # A column of voxels on axis 1: with the tool straight down the wrist centre is on that axis too, and θ1 is
    # arbitrary. The value that a batch of branches chooses, that of home, is outside of these limits.
    robot = kin.get_robot("irb120")
    limits = [(0.5, 1.0), None, None, None, None, None]
    grid = workspace.capability_grid(robot, resolution=7, directions=12, limits=limits)
    grid = replace(grid, origin=(-0.02, -0.02, -0.2), voxel=0.04, shape=(1, 1, 30))
    found = workspace.capability_join(grid, [workspace.capability_block(grid, 0)])
    pairs = np.array([*compared(found, np.random.default_rng(3), 8, limits=limits)])
    assert (pairs[:, 0] == pairs[:, 1]).all()
    assert found.approachable[:, 0].sum() > 3


def in_limits(robot, q):
    """Which rows have a whole-turn image inside the limits; all joints are revolute."""
    low = q + 2 * math.pi * np.ceil((robot.lower - q) / (2 * math.pi))
    return (low <= robot.upper).all(axis=1)


@pytest.mark.parametrize("name", ["redundant7", "redundant7-craig"])
def test_manipulability_is_evaluated_at_several_arm_angles_or_rolls(name):
    found = mapped(name)
    robot = found.grid.robot
    ratios = []
    for k in np.flatnonzero(found.share > 0.1):
        T = np.array([target(found.centres[k], d) for d in found.grid.directions[found.approachable[k]]])
        angles = np.linspace(-math.pi, math.pi, 120)
        if name == "redundant7":
            q = np.concatenate([kin.ik_branches(robot, T @ screw_z(angle, 0.0)) for angle in angles])
        else:
            q = np.concatenate([kin.ik_branches(robot, T, angle) for angle in angles])
            q[..., 6] = np.where(np.isnan(q[..., 0]), math.nan, 0.0)  # the roll of the tool has no effect
        q = q[~np.isnan(q[..., 0])]
        ratios.append(found.manipulability[k] / kin.manipulability(robot, q[in_limits(robot, q)]).max())
    assert len(ratios) > 20
    assert 0.98 < np.median(ratios) < 1.001
    assert min(ratios) > 0.75


@pytest.mark.parametrize("name", ["pioneer5", "puma560"])
def test_manipulability_is_the_best_of_all_branches(name):
    robot, found = arm(name), mapped(name)
    for k in np.flatnonzero(found.share)[::7]:
        T = np.array([target(found.centres[k], d) for d in found.grid.directions[found.approachable[k]]])
        q = kin.ik_branches(robot, T).reshape(-1, robot.n)
        q = q[~np.isnan(q[:, 0])]
        q[:, -1:] = np.where(name == "puma560", 0.0, q[:, -1:])  # the roll of the tool has no effect
        best = kin.manipulability(robot, q[in_limits(robot, q)]).max()
        assert found.manipulability[k] == pytest.approx(best, rel=1e-6)


# Grid and blocks


def same(a, b):
    return all(
        getattr(a, name).tobytes() == getattr(b, name).tobytes()
        for name in ("index", "centres", "approachable", "share", "manipulability")
    )


def test_blocks_are_bit_identical_in_any_order_thread_and_copy():
    grid = workspace.capability_grid(kin.get_robot("redundant7-craig"), resolution=10)
    count = len(grid.blocks)
    assert count > 1
    blocks = [workspace.capability_block(grid, block) for block in range(count)]
    whole = workspace.capability_join(grid, blocks)
    assert same(whole, kin.workspace.capability_map(grid.robot, resolution=10))
    assert (np.diff(np.ravel_multi_index(whole.index.T, grid.shape)) > 0).all()
    assert same(whole, workspace.capability_join(grid, [*blocks[::-1], blocks[0]]))
    copy = pickle.loads(pickle.dumps(grid))
    assert copy == grid
    assert hash(copy) == hash(grid)
    with ThreadPoolExecutor(2) as pool:
        again = pool.map(lambda block: workspace.capability_block(copy, block), reversed(range(count)))
    assert same(whole, workspace.capability_join(copy, pickle.loads(pickle.dumps([*again]))))
    part = workspace.capability_join(grid, blocks[1:2])
    assert part.index.tolist() == grid.index(blocks[1].numbers).tolist()


def test_blocks_of_another_size_give_the_same_voxels(monkeypatch):
    for name in ("puma560", "panda"):
        grid = workspace.capability_grid(arm(name), resolution=4, directions=12)
        whole = workspace.capability_join(grid, [workspace.capability_block(grid, 0)])
        with monkeypatch.context() as patch:
            patch.setattr(capability, "_TARGETS", 60)
            fine = replace(grid)
            blocks = [workspace.capability_block(fine, block) for block in range(len(fine.blocks))]
            assert len(blocks) > 5
            assert same(whole, workspace.capability_join(fine, blocks))


def test_voxels_have_the_right_indices_and_centres():
    found = mapped("puma560")
    grid = found.grid
    assert max(grid.shape) == 7
    assert (found.index >= 0).all()
    assert (found.index < grid.shape).all()
    assert len(np.unique(found.index, axis=0)) == len(found.index)
    assert np.allclose(found.centres, np.array(grid.origin) + (found.index + 0.5) * grid.voxel)
    assert found.share.dtype == found.manipulability.dtype == np.float32
    assert (found.share == found.approachable.mean(axis=1).astype(np.float32)).all()
    assert found.volume == pytest.approx(len(found.index) * grid.voxel**3)
    # The voxels cover exactly the bounding box of the workspace.
    facts = kin.workspace.workspace_facts(grid.robot, volume=False)
    low = np.array([span.least.value for span in (facts.x, facts.y, facts.z)])
    high = np.array([span.largest.value for span in (facts.x, facts.y, facts.z)])
    end = np.array(grid.origin) + np.array(grid.shape) * grid.voxel
    assert (np.array(grid.origin) <= low).all()
    assert (end >= high).all()
    assert (end - high < grid.voxel).all()
    with pytest.raises(ValueError, match="read-only"):
        found.share[0] = 1.0


@pytest.mark.full
def test_a_finer_map_has_the_volume_of_the_workspace():
    found = mapped("puma560", 18, 12)
    volume = kin.workspace.workspace_facts(kin.get_robot("puma560"), effort=2).volume
    assert found.volume == pytest.approx(volume.value, rel=0.03)


# Limits and locks


def test_limits_and_locks_are_respected():
    robot = kin.get_robot("puma560")
    asked_for = {
        "limits": [(-1.0, 0.5), None, None, (-0.5, 0.5), None, (2.0, 2.5)],
        "locked": [None, None, 0.4, None, None, None],
    }
    found = kin.workspace.capability_map(robot, resolution=5, directions=12, **asked_for)
    pairs = np.array([*compared(found, np.random.default_rng(5), 40, **asked_for)])
    # With joint 3 locked four joints are left for a task of dimension five: points are reachable, directions
    # rarely.
    assert (pairs[:, 0] == pairs[:, 1]).all()
    assert pairs[:, 0].any()


def test_narrower_limits_only_remove_voxels():
    grid = workspace.capability_grid(kin.get_robot("redundant7-craig"), resolution=6, directions=24)
    narrow = replace(grid, bounds=((-1.0, 1.0), *grid.bounds[1:4], (-0.3, 0.3), *grid.bounds[5:]))
    wide, less = (
        dense(workspace.capability_join(g, [workspace.capability_block(g, b) for b in range(len(g.blocks))]))
        for g in (grid, narrow)
    )
    assert not (less[0] & ~wide[0]).any()
    assert not (less[1] & ~wide[1]).any()
    assert 0 < less[1].sum() < wide[1].sum()


def made(*joints):
    return Robot("made", "made", "made", "standard", joints, tuple(0.1 for _ in joints))


def test_maps_of_arms_with_too_few_joints_for_directions_have_points_only():
    flat = made(Joint("a", a=0.3, limits=(-3.0, 3.0)), Joint("b", a=0.2, limits=(-2.0, 2.0)))
    found = kin.workspace.capability_map(flat, resolution=9, directions=12)
    assert found.grid.shape[2] == 1
    assert found.grid.method == "closed form"
    assert len(found.index) > 20
    # The tool's z axis is always up, which is a direction of the icosahedron.
    assert set(found.share.tolist()) == {np.float32(1 / 12).item()}


def test_joints_without_limits_take_any_value():
    robot = kin.get_robot("puma560")
    free = replace(robot, rows=tuple(replace(row, limits=None) for row in robot.rows))
    found = kin.workspace.capability_map(free, resolution=5, directions=12)
    assert found.share.mean() > mapped("puma560", 5).share.mean()
    pairs = np.array([*compared(found, np.random.default_rng(6), 15)])
    assert (pairs[:, 0] == pairs[:, 1]).all()


# Invalid input


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"directions": 13}, "directions"),
        ({"directions": True}, "directions"),
        ({"directions": [12]}, "directions"),
        ({"resolution": 0}, "resolution"),
        ({"resolution": 2.5}, "resolution"),
        ({"voxel": 0.0}, "voxel"),
        ({"voxel": math.nan}, "voxel"),
        ({"voxel": 1e-6}, "voxel"),
        ({"locked": [0.0]}, "locked"),
        ({"limits": [(1.0, 0.0)] + [None] * 4}, "limits[0]"),
    ],
)
def test_invalid_input_names_the_argument(arguments, field):
    with pytest.raises(InputError) as caught:
        workspace.capability_grid(kin.get_robot("pioneer5"), **arguments)
    assert caught.value.field == field


@pytest.mark.parametrize("block", [-1, 1, 0.0, None])
def test_a_block_outside_the_grid_is_rejected(block):
    grid = workspace.capability_grid(kin.get_robot("pioneer5"), voxel=0.2, directions=12)
    assert len(grid.blocks) == 1
    with pytest.raises(InputError, match="block"):
        workspace.capability_block(grid, block)
