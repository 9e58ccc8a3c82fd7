"""Which processors threads run on: read back from the system."""

from __future__ import annotations

import os
import threading

import pytest

from app.shared import threads

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="Linux only")


@pytest.fixture(autouse=True)
def as_before(monkeypatch):
    monkeypatch.setattr(threads, "_processors", set())
    before = os.sched_getaffinity(0)
    yield before
    os.sched_setaffinity(0, before)


def in_thread(act):
    found = []
    thread = threading.Thread(target=lambda: (act(), found.append(os.sched_getaffinity(0))))
    thread.start()
    thread.join()
    return found[0]


def test_a_pinned_process_stays_pinned_and_background_threads_use_every_processor(as_before):
    threads.pin()
    (chosen,) = os.sched_getaffinity(0)
    assert chosen in as_before
    assert in_thread(lambda: None) == {chosen}
    assert in_thread(threads.lower_priority) == as_before
    assert os.sched_getaffinity(0) == {chosen}, "others stay where they are"


def test_workers_are_pinned_in_turn(as_before):
    chosen = []
    for number in range(len(as_before) + 1):
        os.sched_setaffinity(0, as_before)
        threads.pin(number)
        chosen += os.sched_getaffinity(0)
    assert set(chosen) == as_before
    assert chosen[0] == chosen[-1]


def test_without_it_nothing_changes(as_before):
    threads.unpin()
    assert os.sched_getaffinity(0) == as_before
