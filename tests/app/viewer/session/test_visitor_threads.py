"""The threads that answer visitors: in turn, one at a time, and nobody waits for a step that takes long."""

from __future__ import annotations

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable, Hashable

import pytest

from app.viewer.panel.status import Notice
from app.viewer.session.worker.threads import BUILDS, Turn, VisitorThreads
from app.viewer.session.worker.worker import Worker

WAIT = 10.0  # s for what takes milliseconds
LONG = 2.0  # s of a step that blocks


def wait_for(condition: Callable[[], object], timeout: float = WAIT) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.002)


def count() -> int:
    """How many threads for visitors there are."""
    return sum(thread.name.startswith("visitors-") for thread in threading.enumerate())


@pytest.fixture(scope="module")
def threads() -> VisitorThreads:
    return VisitorThreads()


class Visitor:
    """Counts its steps, and whether two of them ran at a time."""

    def __init__(self, threads: VisitorThreads, seconds: float = 0.0, again: float | None = None) -> None:
        self.steps, self.seconds, self.again = 0, seconds, again
        self.within = threading.Lock()
        self.times: list[float] = []
        self.turn = Turn(threads, self.act)

    def act(self) -> float | None:
        assert self.within.acquire(blocking=False), "two steps of one visitor at a time"
        self.steps += 1
        self.times.append(time.monotonic())
        if self.seconds:
            time.sleep(self.seconds)
        self.within.release()
        return self.again


@pytest.mark.full
def test_a_call_is_one_step_and_calls_before_it_are_one(threads):
    visitor, blocks = Visitor(threads), Visitor(threads, 0.01)
    blocks.turn.call()
    wait_for(lambda: blocks.steps)
    for _ in range(5):
        visitor.turn.call()
    wait_for(lambda: visitor.steps)
    time.sleep(0.05)
    assert visitor.steps == 1


@pytest.mark.full
def test_a_call_during_a_step_is_another_step(threads):
    visitor = Visitor(threads, 0.05)
    visitor.turn.call()
    wait_for(lambda: visitor.steps == 1)
    visitor.turn.call()
    visitor.turn.call()
    wait_for(lambda: visitor.steps == 2)
    time.sleep(0.1)
    assert visitor.steps == 2


def test_visitors_take_turns(threads):
    order: list[int] = []

    def acts(k: int) -> Callable[[], float | None]:
        return lambda: order.append(k)

    turns = [Turn(threads, acts(k)) for k in range(3)]
    gate = threading.Event()

    def first() -> float | None:
        gate.wait(0.01)
        for _ in range(3):  # an eager visitor calls more often than others, and has no more turns
            turns[0].call()
        turns[1].call()
        turns[2].call()
        return None

    Turn(threads, first).call()
    wait_for(lambda: len(order) == 3)
    assert order == [0, 1, 2]


def test_a_visitor_is_called_again_when_it_asked_for_it_and_earlier_if_something_happens(threads):
    visitor = Visitor(threads, again=0.1)
    visitor.turn.call()
    wait_for(lambda: visitor.steps == 3)
    first, second, third = visitor.times[:3]
    assert min(second - first, third - second) >= 0.1
    visitor.again = 1000.0
    wait_for(lambda: visitor.steps == 4)
    visitor.again = None
    visitor.turn.call()
    wait_for(lambda: visitor.steps == 5)


@pytest.mark.full
def test_a_step_that_blocks_holds_up_nobody_else(threads):
    blocks, others = Visitor(threads, LONG), [Visitor(threads) for _ in range(5)]
    blocks.turn.call()
    wait_for(lambda: blocks.steps)
    begin = time.monotonic()
    for other in others:
        other.turn.call()
    wait_for(lambda: all(other.steps == 1 for other in others))
    assert time.monotonic() - begin < LONG / 2
    began = time.monotonic()
    for k in range(2, 22):
        for other in others:
            other.turn.call()
        wait_for(lambda k=k: all(other.steps == k for other in others))
    assert time.monotonic() - began < LONG / 2
    assert blocks.within.locked(), "it still blocks"
    wait_for(lambda: not blocks.within.locked())


def test_several_blocked_steps_hold_up_nobody_and_their_threads_end(threads):
    blocked, other = [Visitor(threads, 1.0) for _ in range(6)], Visitor(threads)
    other.turn.call()
    wait_for(lambda: other.steps)
    before = count()
    for visitor in blocked:
        visitor.turn.call()
    wait_for(lambda: all(visitor.steps for visitor in blocked))
    other.turn.call()
    wait_for(lambda: other.steps == 2)
    assert sum(visitor.within.locked() for visitor in blocked) == 6, "all of them block at a time"
    assert count() == before + 6
    wait_for(lambda: not any(visitor.within.locked() for visitor in blocked))
    wait_for(lambda: count() == before)
    other.turn.call()
    wait_for(lambda: other.steps == 3)


def test_a_call_during_a_blocked_step_is_answered_after_it(threads):
    blocks, other = Visitor(threads, 0.3), Visitor(threads)
    blocks.turn.call()
    wait_for(lambda: blocks.steps)
    blocks.turn.call()
    other.turn.call()
    wait_for(lambda: other.steps)
    assert blocks.steps == 1
    wait_for(lambda: blocks.steps == 2)


def test_steps_go_before_pages_that_are_built():
    threads = VisitorThreads()
    order: list[str] = []

    def acts(name: str) -> Callable[[], float | None]:
        return lambda: order.append(name)

    builds, steps = (
        [Turn(threads, acts("build")) for _ in range(3)],
        [Turn(threads, acts("step")) for _ in range(25)],
    )

    def first() -> float | None:
        for turn in builds:
            turn.call(build=True)
        for turn in steps:
            turn.call()
        return None

    Turn(threads, first).call()
    wait_for(lambda: len(order) == 28)
    assert order[-1] == "build"
    assert "build" in order[:12], "pages are built beside many steps too"
    assert order[:9] == 9 * ["step"]


def test_pages_whose_building_blocks_take_no_more_threads_than_allowed(threads):
    builds, other = [Visitor(threads, 0.3) for _ in range(BUILDS + 3)], Visitor(threads)
    for visitor in builds:
        visitor.turn.call(build=True)
    wait_for(lambda: sum(visitor.within.locked() for visitor in builds) == BUILDS)
    other.turn.call()
    wait_for(lambda: other.steps)
    assert sum(visitor.within.locked() for visitor in builds) <= BUILDS
    wait_for(lambda: all(visitor.steps for visitor in builds))


def test_threads_that_cannot_be_started_are_tried_again(monkeypatch, caplog):
    start = threading.Thread.start
    refused = [True, False, True, True]  # the one that leads, once; the one that watches, twice

    def starts(thread: threading.Thread) -> None:
        if thread.name.startswith("visitors-") and refused and refused.pop(0):
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", starts)
    threads, before = VisitorThreads(), count()
    visitor, other = Visitor(threads), Visitor(threads)
    visitor.turn.call()
    assert count() == before
    visitor.turn.call()
    wait_for(lambda: visitor.steps == 1)
    for k in range(1, 5):
        wait_for(lambda k=k: other.turn.call() or other.steps >= k)
    assert not refused
    assert "could not be started: can't start new thread" in caplog.text


def test_a_step_that_raises_ends_no_thread(threads, caplog):
    def fails() -> float | None:
        raise SystemExit

    other = Visitor(threads)
    with caplog.at_level(logging.ERROR):
        Turn(threads, fails).call()
        other.turn.call()
        wait_for(lambda: other.steps)
    assert "a visitor's step failed" in caplog.text


def test_short_steps_of_many_visitors_stay_in_one_thread(threads):
    seen: Counter[str] = Counter()

    def act() -> float | None:
        seen[threading.current_thread().name] += 1
        return None

    turns = [Turn(threads, act) for _ in range(20)]
    for _ in range(50):
        for turn in turns:
            turn.call()
        time.sleep(0.002)
    wait_for(lambda: not threads._ready)
    assert seen.most_common(1)[0][1] > 0.8 * seen.total()


def test_calls_from_many_threads_are_all_answered(threads):
    visitors = [Visitor(threads) for _ in range(10)]
    wanted = [0] * 10

    def call(k: int) -> None:
        for _ in range(100):
            wanted[k] += 1
            visitors[k].turn.call()
            time.sleep(0.0005)

    callers = [threading.Thread(target=call, args=(k,)) for k in range(10)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(WAIT)
    before = [visitor.steps for visitor in visitors]
    for visitor in visitors:
        visitor.turn.call()
    wait_for(lambda: all(v.steps > b for v, b in zip(visitors, before, strict=True)))


class Page(Worker):
    """A worker without a browser."""

    def __init__(self, failed: Callable[[], None] | None = None) -> None:
        super().__init__(1, failed)
        self.did: list[object] = []
        self.notices: list[Notice] = []
        self.gate = threading.Event()

    def _prepare(self) -> None:
        self.did.append("prepare")

    def _build(self) -> None:
        self.did.append("build")

    def _step(self, batch: list[tuple[Hashable, object]]) -> None:
        for key, value in batch:
            if key == "wait":
                self.gate.wait(WAIT)
            elif key == "fail":
                raise ValueError(value)
            elif key == "end":
                raise SystemExit
        self.did += [key for key, _ in batch]

    @property
    def _timeout(self) -> float | None:
        return None

    def _report(self, notice: Notice) -> None:
        self.notices.append(notice)

    def _leave(self) -> None:
        self.did.append("leave")


def test_a_page_is_built_before_the_first_event_and_left_after_the_last():
    page = Page()
    page.post("early")
    page.start()
    wait_for(lambda: "early" in page.did)
    page.post("late")
    wait_for(lambda: "late" in page.did)
    assert not page.join(0.0)
    page.end()
    assert page.join(WAIT)
    page.post("never")
    assert page.did == ["prepare", "build", "early", "late", "leave"]


def test_a_step_that_raises_is_reported_and_the_page_goes_on(caplog):
    page = Page()
    page.start()
    page.post("fail", "of this")
    wait_for(lambda: page.notices)
    assert page.notices[0].title == "Something went wrong"
    page.post("next")
    wait_for(lambda: "next" in page.did)
    page.end()
    assert page.join(WAIT)
    assert "of this" in caplog.text


def test_a_worker_that_cannot_go_on_says_so_once(caplog):
    failures: list[int] = []
    page = Page(lambda: failures.append(1))
    page.start()
    page.post("end")
    assert page.join(WAIT)
    assert (failures, page.did[-1]) == ([1], "leave")
    assert "a visitor's worker failed" in caplog.text


def test_a_page_for_which_there_is_no_thread_ends_and_says_so(monkeypatch, caplog):
    def starts(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    failures: list[int] = []
    page = Page(lambda: failures.append(1))
    monkeypatch.setattr(threading.Thread, "start", starts)
    page.start()
    assert page.join(0.0)
    assert (failures, page.did) == ([1], ["leave"])
    assert "can't start new thread" in caplog.text


def test_a_visitor_who_leaves_in_the_middle_of_a_step_is_left_after_it():
    page, other = Page(), Page()
    page.start(), other.start()
    page.post("wait")
    wait_for(lambda: page._turn.acts)
    page.end()
    other.post("news")
    wait_for(lambda: "news" in other.did)
    assert not page.join(0.05), "its step still runs"
    page.gate.set()
    assert page.join(WAIT)
    assert page.did[-2:] == ["wait", "leave"]
    other.end()
    assert other.join(WAIT)


def test_a_visitor_who_leaves_before_the_page_is_built_gets_none():
    page = Page()
    page.end()
    page.start()
    assert page.join(WAIT)
    assert page.did == ["prepare", "leave"]


def test_what_is_waited_for_before_a_page_is_built_fails_that_page_alone(caplog):
    failures: list[int] = []

    class Broken(Page):
        def _prepare(self) -> None:
            raise OSError("no answer")

    page = Broken(lambda: failures.append(1))
    page.start()
    assert page.join(WAIT)
    assert (failures, page.did) == ([1], ["leave"])
    assert "no answer" in caplog.text
