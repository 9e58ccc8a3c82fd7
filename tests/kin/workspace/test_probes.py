"""The probes that the strategies volume and boundary are built on: fewer descents, the same cubes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import kin
from kin.ik.options import JointConstraints
from kin.workspace.region import Region
from kin.workspace.search import probes
from kin.workspace.search.probes import ALIKE, CLOSE, LAYER, TRIES, SamplingProbes, probe_cells

# A hole around the axis; limits that cut the ring; an arm with slides; a flat workspace.
REGIONS = {
    "pioneer5": JointConstraints(),
    "redundant7": JointConstraints(limits=[(-0.5, 1.0), None, (0.0, 0.5), None, None, None, None]),
    "stanford": JointConstraints(),
    "ur5": JointConstraints(locked=[0.3, None, None, 0.0, 0.0, 0.0]),
}


@pytest.fixture(params=REGIONS)
def region(request):
    return Region.of(kin.get_robot(request.param), REGIONS[request.param])


def by_all_probes(region):
    """Rows of the cubes with a point that was reached, and with one in the layer, by descents to all points."""
    full = probe_cells(region, TRIES, ALIKE)
    size, distance = full.map.size, full.distance
    assert not np.isnan(distance).any()
    layer = (distance > CLOSE * size) & (distance <= LAYER * size)
    return np.flatnonzero((distance <= CLOSE * size).any(axis=1)), np.flatnonzero(layer.any(axis=1))


@pytest.mark.full
def test_the_cubes_are_those_of_all_probes_in_either_order(region):
    reached, outer = by_all_probes(region)
    assert len(reached)
    assert len(outer)
    one, other = SamplingProbes(region), SamplingProbes(region)
    assert np.array_equal(one.reached, reached)
    assert np.array_equal(one.outer, outer)
    assert np.array_equal(other.outer, outer)
    assert np.array_equal(other.reached, reached)


def test_most_probes_are_not_made():
    found = SamplingProbes(Region.of(kin.get_robot("panda")))
    assert len(found.reached)
    assert np.isnan(found._distance).mean() > 0.6


def test_no_reachable_point_is_outside_of_the_sizes(region):
    sizes = SamplingProbes(region)._sizes
    points = next(
        kin.workspace.sample_workspace(region.robot, 20_000, chunk=20_000, constraints=_as_constraints(region))
    ).points
    farthest = max(probes._outside(p, sizes) for p in points.astype(np.float64))
    assert farthest < 1e-6
    above = np.array([0.0, 0.0, sizes.high[2] + 0.25])
    assert probes._outside(above, sizes) >= 0.25 - 1e-12


def test_threads_that_start_together_share_one_computation(monkeypatch):
    region = Region.of(kin.get_robot("scara"))
    made = []
    cell_map = probes.cell_map

    def counted(region):
        made.append(region)
        return cell_map(region)

    monkeypatch.setattr(probes, "cell_map", counted)
    found = SamplingProbes(region)
    with ThreadPoolExecutor(4) as pool:
        rows = list(pool.map(lambda _: found.reached, range(8)))
    assert len(made) == 1
    assert all(np.array_equal(each, rows[0]) for each in rows)


def _as_constraints(region):
    return JointConstraints(limits=list(region.bounds))
