"""Capability maps shared by many readers: computed once, visible while growing, cancelled by the last reader."""

from __future__ import annotations

import threading
from concurrent.futures import CancelledError

import numpy as np
import pytest
from live_server import wait_for

import kin
from app.shared import mapreduce
from app.shared.maps import MapRequest, Maps, MapTimeError

ARM = kin.get_robot("pioneer5")
SMALL = MapRequest(ARM, 8, 12)
SEVERAL = MapRequest(ARM, 30, 12)  # blocks


@pytest.fixture
def maps():
    made = Maps(threads=2)
    yield made
    made.close()


class Slowly:
    """Holds blocks back until `let` releases them, and counts those that were started."""

    def __init__(self, monkeypatch):
        self.begun = 0
        self.free = 0
        self.change = threading.Condition()
        self.compute = mapreduce.capability_block
        monkeypatch.setattr(mapreduce, "capability_block", self)

    def __call__(self, grid, block):
        with self.change:
            self.begun += 1
            self.change.wait_for(lambda: self.free > 0, 20.0)
            self.free -= 1
        return self.compute(grid, block)

    def let(self, count):
        with self.change:
            self.free += count
            self.change.notify_all()


@pytest.fixture
def slowly(monkeypatch):
    made = Slowly(monkeypatch)
    yield made
    made.let(10**6)


def same(found, robot, **wanted):
    expected = kin.workspace.capability_map(robot, **wanted)
    for name in ("index", "centres", "approachable", "share", "manipulability"):
        assert np.array_equal(getattr(found, name), getattr(expected, name)), name


def test_a_map_is_that_of_the_core_with_limits_and_locks(maps):
    limits = (None, (0.0, 1.0), None, None, None)
    locked = (0.3, None, None, None, None)
    reader = maps.subscribe(MapRequest(ARM, 8, 12, kin.JointConstraints(limits, locked)))
    same(reader.future.result(60), ARM, resolution=8, directions=12, limits=limits, locked=locked)
    assert reader.finished
    assert reader.done == reader.total > 0
    assert reader.latest is reader.future.result()


def test_a_map_can_be_seen_while_it_grows(maps, slowly, monkeypatch):
    monkeypatch.setattr("app.shared.maps.PUBLISHED_EVERY", 0.0)
    reader = maps.subscribe(SEVERAL)
    slowly.let(2)
    wait_for(lambda: reader.done == 2)
    wait_for(lambda: reader.latest is not None)
    part = reader.latest
    assert not reader.finished
    slowly.let(10**6)
    whole = reader.future.result(60)
    assert len(part.index) < len(whole.index)
    assert {tuple(i) for i in part.index.tolist()} <= {tuple(i) for i in whole.index.tolist()}


def test_a_map_that_takes_too_long_ends_and_shows_what_was_computed(slowly):
    hurried = Maps(threads=1, seconds=0.0)
    reader = hurried.subscribe(SEVERAL)
    slowly.let(10**6)
    with pytest.raises(MapTimeError, match="not finished after 0 s"):
        reader.future.result(60)
    assert len(reader.latest.index) > 0
    reader.leave()
    hurried.close()


def test_closing_cancels_computations(maps, slowly):
    reader = maps.subscribe(SEVERAL)
    slowly.let(1)
    wait_for(lambda: reader.done == 1)
    maps.close()
    slowly.let(10**6)
    with pytest.raises(CancelledError):
        reader.future.result(20)
    wait_for(lambda: not any(thread.is_alive() for thread in maps._executor._threads))
