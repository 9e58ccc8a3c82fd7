"""The cache of expensive results: shared, cancelled with its last reader, bounded; errors are not cached."""

from __future__ import annotations

import threading
import weakref
from concurrent.futures import CancelledError, ThreadPoolExecutor

import pytest
from live_server import wait_for

from app.shared.computations import ComputationCache, TooManyPendingError


@pytest.fixture
def executor():
    made = ThreadPoolExecutor(2)
    yield made
    made.shutdown()


@pytest.fixture
def cache(executor):
    return ComputationCache(executor, capacity=2)


class Held:
    """A computation that waits until it is released."""

    def __init__(self, result="result"):
        self.calls = 0
        self.released = threading.Event()
        self.result = result

    def __call__(self, computation):
        self.calls += 1
        assert self.released.wait(20)
        computation.check()
        return self.result


def test_concurrent_callers_share_one_computation_and_one_result(cache):
    held = Held([1])
    with ThreadPoolExecutor(16) as callers:
        futures = list(callers.map(lambda _: cache.get("key", held), range(64)))
    held.released.set()
    assert all(future.result(20) is held.result for future in futures)
    assert held.calls == 1
    assert cache.get("key", lambda _: pytest.fail("computed again")).result(0) is held.result
    assert "key" in cache


def test_subscribers_see_progress_and_partial_results_of_one_computation(cache):
    step, go_on = threading.Event(), threading.Event()

    def grow(computation):
        computation.total = 2
        computation.done, computation.latest = 1, "half"
        step.set()
        assert go_on.wait(20)
        return "whole"

    with cache.subscribe("key", grow) as first, cache.subscribe("key", grow) as second:
        assert step.wait(20)
        for subscription in (first, second):
            assert (subscription.done, subscription.total, subscription.latest) == (1, 2, "half")
            assert not subscription.finished
        go_on.set()
        assert first.future is second.future
        assert first.future.result(20) == second.latest == "whole"
        assert first.finished


def test_the_computation_is_cancelled_when_the_last_subscriber_leaves(cache):
    held = Held()
    first, second = cache.subscribe("key", held), cache.subscribe("key", held)
    wait_for(lambda: held.calls == 1)
    first.leave()
    first.leave()  # counts once
    assert "key" in cache
    second.leave()
    assert "key" not in cache
    anew = Held("anew")
    anew.released.set()
    assert cache.get("key", anew).result(20) == "anew", "a later caller does not get the cancelled one"
    held.released.set()
    with pytest.raises(CancelledError):
        second.future.result(20)
    assert cache.get("key", anew).result(0) == "anew", "its end does not touch the new result"
    assert cache.size == 1


def test_a_cancelled_computation_holds_nothing_of_what_it_was_doing(cache):
    held, large = Held(), []

    def compute(computation):
        local = Held()
        large.append(weakref.ref(local))
        held(computation)

    subscription = cache.subscribe("key", compute)
    wait_for(lambda: held.calls == 1)
    subscription.leave()
    held.released.set()
    assert isinstance(subscription.future.exception(20), CancelledError)
    assert large[0]() is None


def test_a_computation_that_has_not_begun_is_never_run_after_its_last_subscriber_has_left():
    executor = ThreadPoolExecutor(1)
    cache = ComputationCache(executor, 4)
    held, never = Held(), Held()
    cache.get("busy", held)
    waiting = cache.subscribe("waiting", never)
    waiting.leave()
    assert waiting.future.cancelled()
    held.released.set()
    executor.shutdown()
    assert never.calls == 0


def test_a_subscriber_who_leaves_does_not_cancel_what_get_has_started(cache):
    held = Held()
    future = cache.get("key", held)
    cache.subscribe("key", held).leave()
    held.released.set()
    assert future.result(20) == "result"


def test_errors_reach_every_caller_and_are_not_cached(cache):
    release = threading.Event()

    def fail(_):
        release.wait(20)
        raise ZeroDivisionError("no result")

    futures = [cache.get("key", fail) for _ in range(4)]
    subscription = cache.subscribe("key", fail)
    release.set()
    for future in (*futures, subscription.future):
        with pytest.raises(ZeroDivisionError, match="no result"):
            future.result(20)
    assert len(cache) == cache.size == 0
    assert cache.get("key", lambda _: "good").result(20) == "good"


def test_the_result_used_longest_ago_is_dropped_first(cache):
    for key in "ab":
        cache.get(key, lambda _, key=key: key).result(20)
    cache.get("a", lambda _: pytest.fail("computed again"))
    cache.get("c", lambda _: "c").result(20)
    assert [key in cache for key in "abc"] == [True, False, True]
    assert cache.get("b", lambda _: "anew").result(20) == "anew"
    assert cache.size == 2


def test_capacity_bounds_the_sum_of_sizes_and_a_larger_result_is_returned_but_not_kept(executor):
    cache = ComputationCache(executor, capacity=10, size_of=len)
    for key, length in (("a", 6), ("b", 4), ("c", 3)):
        cache.get(key, lambda _, length=length: "x" * length).result(20)
    assert cache.size == 7
    assert "a" not in cache
    assert len(cache.get("large", lambda _: "x" * 11).result(20)) == 11
    assert len(cache) == cache.size == 0


def test_a_computation_under_way_is_never_dropped(executor):
    cache = ComputationCache(executor, capacity=1)
    held = Held()
    future = cache.get("held", held)
    for key in "abc":
        cache.get(key, lambda _: None).result(20)
    assert cache.get("held", held) is future
    held.released.set()
    future.result(20)
    assert "held" in cache


def test_too_many_pending_computations_are_refused_but_results_and_shared_ones_are_not(cache):
    cache.get("kept", lambda _: "kept").result(20)
    held = Held()
    futures = [cache.get(key, held, max_pending=2) for key in "ab"]
    with pytest.raises(TooManyPendingError, match="2 computations are pending") as refused:
        cache.get("c", held, max_pending=2)
    assert refused.value.pending == 2
    assert cache.get("b", held, max_pending=2) is futures[1]
    assert cache.get("kept", held, max_pending=2).result(0) == "kept"
    held.released.set()
    for future in futures:
        future.result(20)
    assert cache.get("c", lambda _: "c", max_pending=2).result(20) == "c"


def test_closing_cancels_what_is_computed_and_what_waits():
    executor = ThreadPoolExecutor(1)
    cache = ComputationCache(executor, 4)
    held = Held()
    running, waiting = cache.get("running", held), cache.get("waiting", held)
    wait_for(lambda: held.calls == 1)
    cache.close()
    assert waiting.cancelled()
    held.released.set()
    with pytest.raises(CancelledError):
        running.result(20)
    executor.shutdown()
