"""Clouds, sizes and sections of the workspace, compared with a reference and with each other."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import kin
from kin import InputError
from kin.fk import fk_positions
from kin.robot import Joint, Robot
from kin.workspace import MEASURES, STRATEGIES
from kin.workspace.region import Region
from kin.workspace.sampling.kernels import sample_configurations
from kin.workspace.sampling.streams import joint_streams
from kin.workspace.search.cells import cell_map
from kin.workspace.search.probes import ALIKE, TRIES, probe_cells
from kin.workspace.volume import from_probes

ALL = tuple(kin.files.classic_robots())
# x, y, z, distance from joint 1's axis, distance from the shoulder: least and largest, inside the printed limits.
REFERENCE = {
    "pioneer5": (
        (-0.486895149, 0.485911099),
        (-0.326352947, 0.486895149),
        (-0.287069130, 0.307788882),
        (0.0, 0.486895149),
        (0.016425101, 0.486902673),
    ),
    "redundant7": ((-1.08, 1.08), (-1.08, 1.08), (-0.43, 1.03), (0.0, 1.08), (0.0, 1.08)),
    "redundant7-craig": (
        (-1.08, 1.08),
        (-1.08, 1.08),
        (-0.549707050, 1.38),
        (0.0, 1.08),
        (0.210978668, 1.08),
    ),
}
ROBOTS = tuple(REFERENCE)
SHOULDER = {"pioneer5": 0.13, "redundant7": 0.30, "redundant7-craig": 0.30}
FEW = {"uniform": 30_000, "quasi": 30_000, "volume": 2000, "boundary": 400}


def cloud(robot, n, **options):
    return np.concatenate([chunk.points for chunk in kin.workspace.sample_workspace(robot, n, **options)])


@lru_cache
def facts(robot_id):
    return kin.workspace.workspace_facts(kin.get_robot(robot_id), volume=False)


def chain(*joints):
    home = tuple(0.5 * sum(j.limits) if j.limits else 0.0 for j in joints if j.kind != "fixed")
    return Robot(id="made", name="made", source="made", convention="standard", rows=joints, home=home)


GANTRY = chain(
    Joint("x", kind="prismatic", alpha=math.pi / 2, limits=(0.0, 1.0)),
    Joint("y", kind="prismatic", theta=math.pi / 2, alpha=math.pi / 2, limits=(0.0, 0.5)),
    Joint("z", kind="prismatic", limits=(0.0, 0.25)),
)
PLANAR = chain(Joint("a", a=0.3, limits=(-math.pi, math.pi)), Joint("b", a=0.2, limits=(-2.6, 2.6)))


# Clouds


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_a_cloud_does_not_depend_on_chunks_threads_or_length(strategy):
    robot = kin.get_robot("pioneer5")
    n = min(FEW[strategy], 5000)
    whole = cloud(robot, n, seed=7, strategy=strategy)
    assert whole.shape == (n, 3)
    assert whole.dtype == np.float32
    assert (cloud(robot, n, seed=7, strategy=strategy, chunk=37) == whole).all()
    assert (cloud(robot, n // 2, seed=7, strategy=strategy) == whole[: n // 2]).all()
    ends = [*range(0, n, n // 9), n]

    def part(i):
        return kin.workspace.workspace_slice(robot, n, ends[i], ends[i + 1], seed=7, strategy=strategy).points

    with ThreadPoolExecutor(4) as pool:
        parts = list(pool.map(part, reversed(range(len(ends) - 1))))
    assert (np.concatenate(parts[::-1]) == whole).all()


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_another_seed_gives_another_cloud(strategy):
    robot = kin.get_robot("redundant7")
    n = 200
    clouds = [cloud(robot, n, seed=seed, strategy=strategy) for seed in (0, 1, 2**64 - 1)]
    for i in range(3):
        assert (clouds[i] != clouds[i - 1]).any(axis=1).mean() > 0.9
        assert len(np.unique(clouds[i], axis=0)) > 0.9 * n


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("robot_id", ROBOTS)
def test_points_are_those_of_their_configurations(robot_id, strategy):
    robot = kin.get_robot(robot_id)
    n = min(FEW[strategy], 2000)
    (chunk,) = kin.workspace.sample_workspace(robot, n, seed=3, strategy=strategy, with_q=True)
    q = kin.workspace.workspace_configurations(robot, np.arange(n), seed=3, strategy=strategy)
    assert (q == chunk.q).all()
    assert np.abs(fk_positions(robot, q) - chunk.points).max() < 1e-7
    assert robot.in_limits(q).all()
    one = kin.workspace.workspace_configurations(robot, n - 1, seed=3, strategy=strategy)
    assert one.shape == (robot.n,)
    assert (one == q[-1]).all()


def test_samples_late_in_the_sequence_are_evenly_distributed():
    robot = kin.get_robot("redundant7")
    far = 2**52
    for strategy in ("uniform", "quasi"):
        chunk = kin.workspace.workspace_slice(robot, far + 5000, far, far + 5000, strategy=strategy, with_q=True)
        assert chunk.start == far
        assert chunk.done == chunk.total == far + 5000
        part = (chunk.q - robot.lower) / (robot.upper - robot.lower)
        assert np.abs(part.mean(axis=0) - 0.5).max() < 0.02
        assert (kin.workspace.workspace_configurations(robot, far + 17, strategy=strategy) == chunk.q[17]).all()


def test_joints_are_sampled_evenly_and_independently():
    robot = kin.get_robot("redundant7")
    q = kin.workspace.workspace_configurations(robot, np.arange(100_000), seed=11)
    part = (q - robot.lower) / (robot.upper - robot.lower)
    counts = np.stack([np.histogram(part[:, j], 50, (0.0, 1.0))[0] for j in range(7)])
    assert np.abs(counts / 2000.0 - 1.0).max() < 0.12  # five standard deviations
    assert np.abs(np.corrcoef(part.T) - np.eye(7)).max() < 0.016
    assert np.abs(np.corrcoef(part[:-1, 0], part[1:, 0])[0, 1]) < 0.016


def test_quasi_random_samples_are_more_even():
    robot = kin.get_robot("redundant7")
    spread = {}
    for strategy in ("uniform", "quasi"):
        q = kin.workspace.workspace_configurations(robot, np.arange(4096), strategy=strategy)
        part = (q - robot.lower) / (robot.upper - robot.lower)
        counts = np.stack([np.histogram(part[:, j], 64, (0.0, 1.0))[0] for j in range(7)])
        spread[strategy] = counts.std()
    assert spread["quasi"] < 0.25 * spread["uniform"]


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_narrowed_limits_and_locks_are_respected_exactly(strategy):
    robot = kin.get_robot("redundant7-craig")
    limits = [(0.1, 0.4), None, (-1.0, -0.5), None, None, None, None]
    locked = [None, None, None, 0.75, None, None, -1.25]
    q = kin.workspace.workspace_configurations(
        robot, np.arange(300), strategy=strategy, limits=limits, locked=locked
    )
    assert (q[:, 3] == 0.75).all()
    assert (q[:, 6] == -1.25).all()
    assert (q[:, [0, 2]] >= [0.1, -1.0]).all()
    assert (q[:, [0, 2]] <= [0.4, -0.5]).all()
    assert robot.in_limits(q).all()
    points = cloud(robot, 300, strategy=strategy, limits=limits, locked=locked)
    assert np.abs(fk_positions(robot, q) - points).max() < 1e-7


def test_joints_without_limits_are_sampled_from_a_whole_turn():
    robot = chain(Joint("a", a=0.3), Joint("b", a=0.2))
    q = kin.workspace.workspace_configurations(robot, np.arange(20_000))
    assert np.abs(q).max() <= math.pi
    assert (np.abs(q).max(axis=0) > 3.13).all()


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("robot_id", ROBOTS)
def test_every_point_is_inside_the_exact_sizes(robot_id, strategy):
    inside_sizes(robot_id, strategy)


@pytest.mark.parametrize("robot_id", ALL)
def test_points_of_every_arm_are_inside_its_exact_sizes_and_close_to_them(robot_id):
    inside_sizes(robot_id, "quasi")
    found = facts(robot_id)
    points = cloud(kin.get_robot(robot_id), 200_000, strategy="quasi")
    size = found.reach.largest.value
    assert found.z.largest.value - points[:, 2].max() < 0.1 * size
    assert points[:, 0].min() - found.x.least.value < 0.2 * size


def inside_sizes(robot_id, strategy):
    robot = kin.get_robot(robot_id)
    found = facts(robot_id)
    points = cloud(robot, FEW[strategy], strategy=strategy).astype(float)
    slack = 1e-7  # of float32
    for axis, span in enumerate((found.x, found.y, found.z)):
        assert points[:, axis].min() >= span.least.value - slack
        assert points[:, axis].max() <= span.largest.value + slack
    for distance, span in (
        (np.linalg.norm(np.cross(points - found.axis_point, found.axis), axis=1), found.radius),
        (np.linalg.norm(points - found.shoulder, axis=1), found.reach),
    ):
        assert distance.min() >= span.least.value - slack
        assert distance.max() <= span.largest.value + slack


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_boundary_samples_are_on_the_envelope(robot_id):
    robot = kin.get_robot(robot_id)
    found = cell_map(Region.of(robot))
    away = np.random.default_rng(5).normal(size=(26, 3))
    away *= 0.01 * facts(robot_id).reach.largest.value / np.linalg.norm(away, axis=1, keepdims=True)

    def share_near(strategy):
        """The fraction of samples closer to the outside than a hundredth of the reach."""
        around = (cloud(robot, 100, strategy=strategy).astype(float)[:, None] + away).reshape(-1, 3)
        distance = found.nearest(around, 1e-6)[1]
        return (distance.reshape(100, -1) > 1e-6).any(axis=1).mean()

    assert share_near("boundary") > max(0.95, 5.0 * share_near("uniform"))


def halfway(curve):
    """Vertices of a closed polyline and points between them, at most some millimetres apart."""
    following = np.roll(curve, -1, axis=0)
    return np.concatenate([curve + k / 8 * (following - curve) for k in range(8)])


@pytest.mark.full
@pytest.mark.parametrize("robot_id", ROBOTS)
def test_volume_samples_are_even_in_space(robot_id):
    robot = kin.get_robot(robot_id)
    found = cell_map(Region.of(robot))
    full = (probe_cells(found.region, TRIES, ALIKE).distance < 1e-3 * found.size).all(axis=1)

    def variation(strategy):
        rows = found.rows(cloud(robot, 6000, strategy=strategy).astype(float))
        counts = np.bincount(rows[rows >= 0], minlength=len(full))[full]
        # Above the variation that evenly distributed samples have by chance.
        return math.sqrt(max(counts.var() - counts.mean(), 0.0)) / counts.mean()

    assert variation("volume") < 0.25
    assert variation("uniform") > 2.0 * variation("volume")


def test_measures_are_those_of_their_points():
    robot = kin.get_robot("pioneer5")
    limits = [(0.5, 1.5), None, None, None, None]
    (chunk,) = kin.workspace.sample_workspace(
        robot, 500, measure=MEASURES, limits=limits, locked=[None] * 4 + [0.5]
    )
    q = kin.workspace.workspace_configurations(robot, np.arange(500), limits=limits, locked=[None] * 4 + [0.5])
    assert chunk.q is None
    assert np.abs(chunk.measures["manipulability"] - kin.manipulability(robot, q)).max() < 1e-7
    low, high = np.maximum(robot.lower, [0.5, *robot.lower[1:]]), np.minimum(robot.upper, [1.5, *robot.upper[1:]])
    expected = (np.minimum(q - low, high - q) / (0.5 * (high - low)))[:, :4].min(axis=1)
    assert np.abs(chunk.measures["limit_margin"] - expected).max() < 1e-6
    assert 0.0 <= expected.min() <= expected.max() <= 1.0


def test_the_older_name_of_the_limit_margin_is_accepted():
    robot = kin.get_robot("pioneer5")
    (chunk,) = kin.workspace.sample_workspace(robot, 50, measure=("limits", "limit_margin"))
    assert [*chunk.measures] == ["limits", "limit_margin"]
    assert np.array_equal(chunk.measures["limits"], chunk.measures["limit_margin"])


def test_limits_and_locks_may_be_given_as_one_value():
    robot = kin.get_robot("pioneer5")
    limits, locked = [(0.5, 1.5), None, None, None, None], [None, None, None, 0.25, None]
    one = kin.JointConstraints(limits, locked)
    for function, attribute in (
        (lambda **given: kin.workspace.workspace_configurations(robot, 7, **given), None),
        (lambda **given: kin.workspace.workspace_slice(robot, 10, 2, 9, **given), "points"),
        (lambda **given: next(kin.workspace.sample_workspace(robot, 10, **given)), "points"),
        (lambda **given: kin.workspace.workspace_facts(robot, volume=False, **given).x.largest, "q"),
        (lambda **given: kin.workspace.workspace_section(robot, resolution=8, **given).curves[0], None),
        (lambda **given: kin.workspace.capability_grid(robot, resolution=3, **given), "bounds"),
        (
            lambda **given: kin.workspace.capability_map(robot, resolution=2, directions=12, **given),
            "manipulability",
        ),
    ):
        a, b, free = function(limits=limits, locked=locked), function(constraints=one), function()
        if attribute is not None:
            a, b, free = (getattr(found, attribute) for found in (a, b, free))
        assert np.array_equal(a, b)
        assert not np.array_equal(a, free)
        with pytest.raises(InputError) as caught:
            function(locked=locked, constraints=one)
        assert caught.value.field == "constraints"


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"n": 0}, "n"),
        ({"n": 2.5}, "n"),
        ({"n": True}, "n"),
        ({"n": 2**60}, "n"),
        ({"seed": -1}, "seed"),
        ({"seed": 2**64}, "seed"),
        ({"seed": "0"}, "seed"),
        ({"strategy": "dense"}, "strategy"),
        ({"strategy": ["uniform"]}, "strategy"),
        ({"chunk": 0}, "chunk"),
        ({"measure": "speed"}, "measure"),
        ({"measure": ["limits", 3]}, "measure"),
        ({"measure": 3}, "measure"),
        ({"limits": [None]}, "limits"),
        ({"limits": [(1.0, 0.5), None, None, None, None]}, "limits[0]"),
        ({"limits": [None, (0.0, 9.0), None, None, None]}, "limits[1]"),
        ({"locked": [None, None, math.nan, None, None]}, "locked[2]"),
        ({"locked": [None, None, None, None, 2.0]}, "locked[4]"),
    ],
)
def test_wrong_arguments_are_named_at_the_call(arguments, field):
    with pytest.raises(InputError) as caught:
        kin.workspace.sample_workspace(kin.get_robot("pioneer5"), **{"n": 10, **arguments})
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda robot: kin.workspace.workspace_slice(robot, 10, 10, 11), "start"),
        (lambda robot: kin.workspace.workspace_slice(robot, 10, 5, 5), "end"),
        (lambda robot: kin.workspace.workspace_slice(robot, 10, 5, 11), "end"),
        (lambda robot: kin.workspace.workspace_configurations(robot, -1), "index"),
        (lambda robot: kin.workspace.workspace_configurations(robot, 0.5), "index"),
        (lambda robot: kin.workspace.workspace_configurations(robot, 2**53), "index"),
        (lambda robot: kin.workspace.workspace_configurations(robot, [[0], [1, 2]]), "index"),
        (lambda robot: kin.workspace.workspace_facts(robot, effort=1), "effort"),
        (lambda robot: kin.workspace.workspace_facts(robot, limits=3), "limits"),
        (lambda robot: kin.workspace.workspace_section(robot, resolution=4), "resolution"),
        (lambda robot: kin.workspace.workspace_section(robot, 3), "plane"),
        (lambda robot: kin.workspace.workspace_section(robot, ([0, 0, 0], [0, 0, 0])), "plane"),
        (lambda robot: kin.workspace.workspace_section(robot, ([0, 0], [0, 0, 1])), "plane[0]"),
        (lambda robot: kin.workspace.workspace_section(robot, ([0, 0, 0], [0, math.inf, 1])), "plane[1][1]"),
        (lambda robot: kin.workspace.workspace_section(GANTRY), "plane"),
    ],
)
def test_wrong_arguments_of_other_functions_are_named(call, field):
    with pytest.raises(InputError) as caught:
        call(kin.get_robot("pioneer5"))
    assert caught.value.field == field


# Sizes


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_sizes_equal_the_reference(robot_id):
    robot = kin.get_robot(robot_id)
    found = facts(robot_id)
    assert found.shoulder == pytest.approx([0.0, 0.0, SHOULDER[robot_id]], abs=1e-12)
    assert found.axis.tolist() == [0.0, 0.0, 1.0]
    assert found.volume is None
    for span, (least, largest) in zip(
        (found.x, found.y, found.z, found.radius, found.reach), REFERENCE[robot_id], strict=True
    ):
        assert span.least.value == pytest.approx(least, abs=1e-9)
        assert span.largest.value == pytest.approx(largest, abs=1e-9)
        for extreme in span:
            assert robot.in_limits(extreme.q).all()
            assert kin.fk(robot, extreme.q)[:3, 3] == pytest.approx(extreme.point, abs=1e-12)
    assert found.x.largest.point[0] == pytest.approx(found.x.largest.value, abs=1e-12)
    assert np.hypot(*found.radius.largest.point[:2]) == pytest.approx(found.radius.largest.value, abs=1e-12)


def test_sizes_of_narrowed_limits_are_smaller_and_reached():
    robot = kin.get_robot("pioneer5")
    limits = [(1.0, 1.5), (0.5, 1.0), None, None, None]
    found = kin.workspace.workspace_facts(
        robot, limits=limits, locked=[None, None, None, 0.25, None], volume=False
    )
    points = cloud(robot, 200_000, limits=limits, locked=[None, None, None, 0.25, None]).astype(float)
    for axis, span in enumerate((found.x, found.y, found.z)):
        assert 0.0 <= points[:, axis].min() - span.least.value + 1e-7 < 0.02
        assert 0.0 <= span.largest.value - points[:, axis].max() + 1e-7 < 0.02
        for extreme in span:
            assert extreme.q[3] == 0.25
            assert 1.0 <= extreme.q[0] <= 1.5


def test_a_gantry_is_a_box():
    found = kin.workspace.workspace_facts(GANTRY)
    sides = [span.largest.value - span.least.value for span in (found.x, found.y, found.z)]
    assert sorted(sides) == pytest.approx([0.25, 0.5, 1.0], abs=1e-12)
    assert found.volume.value == pytest.approx(0.125, abs=1e-4)
    assert abs(found.surface.value - 1.75) < 3.0 * found.surface.error
    assert kin.workspace.workspace_section(GANTRY, ([0, 0, 0.3], [0, 0, 1])).area == pytest.approx(0.125, abs=1e-6)


def test_a_height_that_all_configurations_have_is_that_of_the_first_one():
    """A partition of equal numbers differs from processor to processor."""
    region = Region.of(PLANAR)
    first = np.empty((1, 2))
    sample_configurations(region.arm, joint_streams(0, region.movable, quasi=True), 0, first)
    found = kin.workspace.workspace_facts(PLANAR, volume=False)
    assert found.z.least.q.tolist() == found.z.largest.q.tolist() == first[0].tolist()


def test_a_planar_arm_is_a_ring():
    inner = math.sqrt(0.3**2 + 0.2**2 + 2 * 0.3 * 0.2 * math.cos(2.6))
    found = kin.workspace.workspace_facts(PLANAR)
    assert found.radius.least.value == pytest.approx(inner, abs=1e-9)
    assert found.radius.largest.value == pytest.approx(0.5, abs=1e-9)
    assert found.volume.value == pytest.approx(0.0, abs=1e-6)
    ring = kin.workspace.workspace_section(PLANAR, ([0, 0, 0], [0, 0, 1]), resolution=64)
    assert len(ring.curves) == 2
    assert ring.area == pytest.approx(math.pi * (0.25 - inner**2), rel=1e-3)


@pytest.mark.full
def test_both_methods_give_the_same_volume():
    robot = kin.get_robot("redundant7")
    revolved = kin.workspace.workspace_facts(robot, effort=3)
    volume, surface = from_probes(Region.of(robot), 2)
    assert revolved.volume.error < 0.002 * revolved.volume.value
    assert abs(volume.value - revolved.volume.value) < 4.0 * math.hypot(volume.error, revolved.volume.error)
    assert abs(surface.value - revolved.surface.value) < 4.0 * math.hypot(surface.error, revolved.surface.error)


@pytest.mark.full
def test_errors_shrink_with_effort():
    region = Region.of(kin.get_robot("pioneer5"), kin.JointConstraints(locked=[None, None, None, 0.0, 0.5]))
    few, many = from_probes(region, 2)[0], from_probes(region, 6)[0]
    assert 0.4 * few.error < many.error < 0.8 * few.error
    assert abs(few.value - many.value) < 4.0 * math.hypot(few.error, many.error)


# Sections


def test_the_section_of_the_pioneer_arm_equals_the_reference():
    robot = kin.get_robot("pioneer5")
    found = kin.workspace.workspace_section(robot)
    # The reference, a raster of 2 mm, includes the cells on the boundary, on average half a cell too many.
    rim = sum(np.linalg.norm(curve - np.roll(curve, 1, axis=0), axis=1).sum() for curve in found.curves)
    assert found.area == pytest.approx(0.1879 - 0.001 * rim, abs=0.001)
    upright = kin.workspace.workspace_section(robot, ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
    front = sum(area_of(np.maximum(curve * [1.0, 0.0], 0.0) + curve * [0.0, 1.0]) for curve in upright.curves)
    assert upright.u.tolist() == [0.0, 1.0, 0.0]
    assert front == pytest.approx(0.1023, abs=0.0025)
    assert upright.area - front == pytest.approx(0.1496, abs=0.0025)


def area_of(curve):
    s, t = curve.T
    return 0.5 * float((s * np.roll(t, -1) - t * np.roll(s, -1)).sum())


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_no_point_is_outside_of_the_section(robot_id):
    robot = kin.get_robot(robot_id)
    found = kin.workspace.workspace_section(robot, resolution=64)
    p = cloud(robot, 3000).astype(float)
    at = np.stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]], axis=1)
    turns = sum(windings(curve, at) for curve in found.curves)
    outside = at[turns < 0.5]
    # A chord cuts off less than a square.
    edges = np.concatenate([halfway(curve) for curve in found.curves])
    assert len(outside) < 0.02 * len(at)
    if len(outside):
        assert np.linalg.norm(outside[:, None] - edges, axis=2).min(axis=1).max() < found.step


def windings(curve, at):
    """Winding number of a closed polyline around each point."""
    to = curve[None] - at[:, None]
    angle = np.arctan2(to[..., 1], to[..., 0])
    turn = np.roll(angle, -1, axis=1) - angle
    return ((turn + math.pi) % (2.0 * math.pi) - math.pi).sum(axis=1) / (2.0 * math.pi)


def test_vertices_of_a_section_are_on_the_boundary():
    robot = kin.get_robot("redundant7")
    (curve,) = kin.workspace.workspace_section(robot, resolution=48).curves
    # The straight forearm traces a circle around the end of the horizontal upper arm.
    around = np.hypot(curve[:, 0] - 0.35, curve[:, 1] - 0.30)
    far = curve[:, 0] > 0.5
    assert np.abs(around[far] - 0.73).max() < 1e-5


def test_the_arcs_of_the_pioneer_arm_equal_the_reference():
    robot = kin.get_robot("pioneer5")
    found = kin.workspace.workspace_section(robot)
    front = next(arc for arc in found.arcs if arc.radius and abs(arc.radius - 0.417069130) < 1e-8)
    assert front.joint == 1
    assert front.centre == pytest.approx((0.070, 0.130), abs=1e-9)
    assert front.q[2:] == pytest.approx(np.radians([0.0, 0.0, 15.0]), abs=1e-7)
    assert front.points[-1] == pytest.approx((0.4859, 0.0989), abs=1e-4)
    back = next(arc for arc in found.arcs if arc.radius and abs(arc.radius - 0.257789) < 1e-6)
    assert back.joint == 2
    assert back.centre == pytest.approx((0.068564, 0.050), abs=1e-6)
    assert back.q[[1, 3, 4]] == pytest.approx(np.radians([150.0, 0.0, 15.0]), abs=1e-7)
    assert math.degrees(back.start) == pytest.approx(0.0, abs=1e-6)
    assert math.degrees(back.stop) == pytest.approx(128.4, abs=0.1)
    # Joints 4 and 5 bend the tool out of the plane: joint 3 then traces the section of a torus, not a circle.
    assert any(arc.joint == 2 and arc.radius is None for arc in found.arcs)


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_arcs_lie_on_the_boundary_and_are_traced_by_one_joint(robot_id):
    robot = kin.get_robot(robot_id)
    found = kin.workspace.workspace_section(robot, resolution=48)
    edges = np.concatenate([halfway(curve) for curve in found.curves])
    assert found.arcs
    for arc in found.arcs:
        q = np.repeat(arc.q[None], len(arc.points), axis=0)
        q[:, arc.joint] = np.linspace(arc.start, arc.stop, len(q))
        p = fk_positions(robot, q)
        assert np.hypot(p[:, 0], p[:, 1]) == pytest.approx(arc.points[:, 0], abs=1e-12)
        assert p[:, 2] == pytest.approx(arc.points[:, 1], abs=1e-12)
        # A corner of the boundary between two vertices is cut off by the polyline.
        assert np.linalg.norm(arc.points[:, None] - edges, axis=2).min(axis=1).max() < 0.5 * found.step
        if arc.radius is not None:
            away = np.linalg.norm(arc.points - arc.centre, axis=1)
            folded = np.linalg.norm(arc.points * [-1.0, 1.0] - arc.centre, axis=1)
            assert min(np.ptp(away), np.ptp(folded)) < 1e-8
    traced = sum(np.linalg.norm(np.diff(arc.points, axis=0), axis=1).sum() for arc in found.arcs)
    rim = sum(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum() for curve in found.curves)
    assert traced > 0.6 * rim


def test_the_workspace_of_a_slide_without_limits_has_no_end():
    arm = kin.get_robot("puma560")
    rail = kin.Joint("rail", kind="prismatic")
    robot = replace(arm, id="railed", rows=(rail, *arm.rows), home=(0.0, *arm.home))
    with pytest.raises(InputError, match=r"limits of rail.*slides without end"):
        kin.workspace.workspace_facts(robot, volume=False)
    for ask in (kin.workspace.workspace_slice, kin.workspace.workspace_section, kin.workspace.capability_map):
        given = (10, 0, 10) if ask is kin.workspace.workspace_slice else ()
        with pytest.raises(InputError, match=r"limits of rail.*slides without end"):
            ask(robot, *given)
    limits = [(-1.0, 1.0), *[None] * 6]
    found = kin.workspace.workspace_facts(robot, limits=limits, volume=False)
    assert found.z.largest.value - found.z.least.value > 2.0
    locked = [0.3, *[None] * 6]
    held = kin.workspace.workspace_facts(robot, locked=locked, volume=False).z
    own = kin.workspace.workspace_facts(arm, volume=False).z
    assert held.largest.value == pytest.approx(own.largest.value + 0.3, abs=1e-9)
