"""Turns of threads that compute, and who goes first."""

from __future__ import annotations

import threading
import time

import pytest
from fastapi import FastAPI
from live_server import wait_for

from app.service import config
from app.service.config import GuardedConfig
from app.service.server import server_config
from app.shared.settings import Settings
from app.shared.threads import turns
from app.shared.threads.turns import Turn, Turns, Urgent, offer


@pytest.fixture(autouse=True)
def urgent(monkeypatch) -> Urgent:
    """Of this test alone: servers of other tests may still run."""
    own = Urgent()
    monkeypatch.setattr(turns, "urgent", own)
    monkeypatch.setattr(config, "urgent", own)
    return own


class Computing(threading.Thread):
    """A request that computes step by step until it is stopped."""

    def __init__(self, turn: Turn, log: list[str], name: str) -> None:
        super().__init__(name=name, daemon=True)
        self._turn, self._log, self._ends = turn, log, threading.Event()
        self.steps = 0
        self.start()

    def run(self) -> None:
        with self._turn:
            self._log.append(self.name)
            while not self._ends.wait(0.001):
                self.steps += 1
                offer()

    def end(self) -> None:
        self._ends.set()
        self.join(30)
        assert not self.is_alive()


@pytest.mark.full
def test_one_runs_at_a_time_and_all_get_on(monkeypatch):
    monkeypatch.setattr(turns, "STUCK", 60.0)
    all_turns, at_once, most = Turns(1), [0], [0]

    def compute() -> None:
        with Turn(all_turns):
            for _ in range(30):
                at_once[0] += 1
                most[0] = max(most[0], at_once[0])
                time.sleep(0.001)
                at_once[0] -= 1
                offer()

    threads = [threading.Thread(target=compute) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert most == [1]
    assert all_turns._free == 1


def queued(all_turns: Turns, order: list[str], name: str, used: float) -> threading.Thread:
    """A thread that waits for a turn, which it has for no time."""

    def run() -> None:
        all_turns.take(used)
        order.append(name)
        all_turns.give()

    thread = threading.Thread(target=run, daemon=True)
    before = len(all_turns._waiting)
    thread.start()
    wait_for(lambda: len(all_turns._waiting) == before + 1)
    return thread


def test_a_turn_is_offered_to_those_who_have_run_less(monkeypatch):
    monkeypatch.setattr(turns, "STUCK", 60.0)
    all_turns, order = Turns(1), []
    all_turns.take(0.0)
    threads = [queued(all_turns, order, "long", 300.0), queued(all_turns, order, "short", 0.0)]
    all_turns.swap(200.0)  # back before the long one
    assert order == ["short"]
    all_turns.give()
    for thread in threads:
        thread.join(30)
    assert order == ["short", "long"]


def test_newcomers_do_not_overtake_for_ever(monkeypatch):
    now = 1000.0
    monkeypatch.setattr(turns, "_rank", lambda used: used + turns.AGING * now)
    all_turns, order = Turns(1), []
    all_turns.take(0.0)
    threads = [queued(all_turns, order, "has waited", 1.0)]
    now += 1.1 / turns.AGING
    threads.append(queued(all_turns, order, "newcomer", 0.0))
    all_turns.give()
    for thread in threads:
        thread.join(30)
    assert order == ["has waited", "newcomer"]


def test_computations_beside_a_long_urgent_step_go_on_with_whole_slices(monkeypatch, urgent):
    monkeypatch.setattr(turns, "PATIENCE", 0.001)
    turn = Turn(Turns(1))
    with turn, urgent:
        turn._waited = time.monotonic() - 1.0
        used_until = turn._since
        offer()
        assert turn._pause == turns.SLICE
        assert turn._since > used_until, "the wait does not count"
        waited = turn._waited
        offer()
        assert turn._waited == waited
    with turn:
        assert turn._pause == turns.LEAST


def test_the_thread_that_has_run_least_is_next():
    all_turns, order = Turns(1), []
    all_turns.take(0.0)

    def wait(used: float) -> None:
        all_turns.take(used)
        order.append(used)
        all_turns.give()

    threads = [threading.Thread(target=wait, args=(used,)) for used in (3.0, 1.0, 2.0)]
    for thread in threads:
        thread.start()
    wait_for(lambda: len(all_turns._waiting) == 3)
    all_turns.give()
    for thread in threads:
        thread.join(30)
    assert order == [1.0, 2.0, 3.0]


def test_a_thread_that_offers_nothing_does_not_stop_the_others(monkeypatch):
    """It may be in a kernel, which runs without the interpreter. There are twice as many turns at most."""
    monkeypatch.setattr(turns, "STUCK", 0.02)
    all_turns, log = Turns(1), []
    all_turns.take(0.0)
    others = [Computing(Turn(all_turns), log, str(k)) for k in range(3)]
    wait_for(lambda: all(each.steps > 20 for each in others), 30)
    wait_for(lambda: all_turns._extra == 1, 30)  # none for a moment while it goes from one thread to another
    back = threading.Thread(target=all_turns.swap, args=(0.0, 1.0), daemon=True)
    back.start()
    back.join(30)  # it has ended the extra turn and got another one
    all_turns.give()
    for each in others:
        each.end()
    assert (all_turns._free, all_turns._extra) == (1, 0)


def test_computations_wait_for_what_is_urgent_but_not_for_ever(monkeypatch, urgent):
    monkeypatch.setattr(turns, "PATIENCE", 60.0)
    computing = Computing(Turn(Turns(1)), [], "computing")
    wait_for(lambda: computing.steps > 5)
    with urgent:
        wait_for(lambda: stays(lambda: computing.steps))
    before = computing.steps
    wait_for(lambda: computing.steps > before)
    monkeypatch.setattr(turns, "PATIENCE", 0.001)
    with urgent:
        before = computing.steps
        wait_for(lambda: computing.steps > before + 5)
    computing.end()


def stays(value) -> bool:
    before = value()
    time.sleep(0.2)
    return bool(value() == before)


def test_computations_wait_for_a_busy_event_loop(urgent):
    factory = GuardedConfig(lambda: None, loop="asyncio").get_loop_factory()
    assert factory is not None
    loop = factory()
    seen = []
    loop.call_soon(lambda: seen.append(urgent.active))
    timer = threading.Timer(0.2, lambda: (seen.append(urgent.active), loop.call_soon_threadsafe(loop.stop)))
    timer.start()
    loop.run_forever()
    timer.join()
    loop.close()
    assert seen == [1, 0]


def test_computations_do_not_come_between_two_rounds_of_a_busy_event_loop(urgent, monkeypatch):
    pauses = []
    loop = config._courteous_loop()
    monkeypatch.setattr(urgent, "leave", lambda: pauses.append(rounds))
    rounds = 0

    def one_more() -> None:
        nonlocal rounds
        rounds += 1
        loop.call_soon(one_more) if rounds < 50 else loop.stop()

    loop.call_soon(one_more)
    loop.run_forever()
    assert rounds == 50
    assert not pauses
    loop.close()


def test_the_service_runs_on_the_loop_for_which_computations_wait():
    made = server_config(FastAPI(), Settings())
    assert made.get_loop_factory() is config._courteous_loop


def test_outside_of_a_turn_an_offer_is_nothing(urgent):
    with urgent:
        began = time.monotonic()
        for _ in range(1000):
            offer()
        assert time.monotonic() - began < 5
