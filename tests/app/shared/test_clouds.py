"""Clouds shared by many readers: the same bits in any order, once for all, bounded in memory."""

import os
import sys
import threading
import time

import numpy as np
import pytest

from app.shared.clouds import FIRST, SAMPLED, Cloud, Clouds
from app.shared.threads import NICENESS
from kin.files import classic_robots
from kin.workspace import sample_workspace

ARM = classic_robots()["pioneer5"]


@pytest.fixture
def clouds():
    made = Clouds(threads=2)
    yield made
    made.close()


def whole(cloud):
    return next(
        iter(
            sample_workspace(
                cloud.robot,
                cloud.n,
                seed=cloud.seed,
                strategy=cloud.strategy,
                chunk=cloud.n,
                measure=cloud.measures or None,
            )
        )
    )


@pytest.mark.parametrize("n", [1, SAMPLED, SAMPLED + 1, 3 * SAMPLED - 7])
def test_parts_joined_are_the_cloud(clouds, n):
    cloud = Cloud(ARM, n, seed=3, measures=("limits",))
    parts = [clouds.part(cloud, i).result() for i in range(cloud.parts)]
    assert [p.start for p in parts] == list(cloud.edges[:-1])
    assert parts[-1].done == n
    assert np.array_equal(np.concatenate([p.points for p in parts]), whole(cloud).points)
    assert np.array_equal(np.concatenate([p.measures["limits"] for p in parts]), whole(cloud).measures["limits"])


def test_a_cloud_that_takes_long_begins_with_a_small_part():
    edges = np.array(Cloud(ARM, 100_000, strategy="boundary").edges)
    assert edges[1] == FIRST
    assert np.diff(edges).max() <= 1 << 13
    assert edges[-1] == 100_000
    assert (np.diff(edges)[:-1] >= FIRST).all()


@pytest.mark.parametrize("size", [1000, 4096, 1 << 20])
def test_a_stream_is_the_cloud_in_order_whatever_the_slices(clouds, size):
    cloud = Cloud(ARM, 20_011, strategy="quasi")
    slices = list(clouds.stream(cloud, size, with_q=True))
    assert [s.start for s in slices] == list(range(0, cloud.n, size))
    assert np.array_equal(np.concatenate([s.points for s in slices]), whole(cloud).points)
    assert sum(len(s.q) for s in slices) == cloud.n


def test_memory_is_bounded_and_what_was_dropped_comes_back():
    size = SAMPLED * 12
    clouds = Clouds(max_bytes=3 * size, threads=1)
    cloud = Cloud(ARM, 8 * SAMPLED)
    first = clouds.part(cloud, 0).result()
    for i in range(cloud.parts):
        clouds.part(cloud, i).result()
    assert clouds.bytes == 3 * size
    again = clouds.part(cloud, 0).result()
    assert again is not first
    assert np.array_equal(again.points, first.points)
    assert clouds.part(cloud, cloud.parts - 1).result() is clouds.part(cloud, cloud.parts - 1).result()
    clouds.close()


def test_a_reader_that_leaves_cancels_the_computation(clouds, monkeypatch):
    began = []
    slice_of = Cloud.slice

    def counting(self, *args):
        began.append(args)
        return slice_of(self, *args)

    monkeypatch.setattr(Cloud, "slice", counting)
    stream = clouds.stream(Cloud(ARM, 10**9), 1000)
    for _ in range(5):
        next(stream)
    stream.close()
    time.sleep(0.1)
    count = len(began)
    assert count < 12
    time.sleep(0.1)
    assert len(began) == count


def test_threads_that_compute_step_back_behind_those_of_visitors(clouds):
    clouds.part(Cloud(ARM, 10), 0).result()
    workers = [t for t in threading.enumerate() if t.name.startswith("cloud")]
    assert workers
    if sys.platform == "linux":
        mine = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
        assert all(os.getpriority(os.PRIO_PROCESS, t.native_id) == max(mine, NICENESS) for t in workers)
