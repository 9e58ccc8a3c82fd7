"""The regression gate: our code relative to a floor of the same run; and the gate fails for slowed code."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

import kin
from app.bench import contestants, gate
from app.bench.arms import arm_of
from app.bench.contestants import KINBOARD
from app.bench.rows import ROWS
from app.bench.run import Settings, run

pytestmark = pytest.mark.bench


def quick_settings():
    """The rows that have a gate, without peers, by the clock of this thread, which excludes other processes."""
    rows = tuple(row for row in ROWS if row.id in {each.row for each in gate.GATES})
    return replace(Settings(rows=rows, peers=()).quick(), targets=8, rounds=10, clock=time.thread_time_ns)


def slowed(contestant, times):
    """The contestant with every call repeated, to test that the gate detects it."""

    def slow(*arguments):
        return [contestant.call(*arguments) for _ in range(times)][-1]

    return replace(contestant, call=slow)


def best_of(attempts):
    """Lowest multiple of each gate over some runs; no more runs than are needed to pass."""
    best = {}
    for _ in range(attempts):
        for verdict in gate.judge(run(quick_settings())):
            known = best.get(verdict.gate)
            best[verdict.gate] = verdict if known is None or verdict.multiple < known.multiple else known
        if all(verdict.passed for verdict in best.values()):
            break
    return list(best.values())


def test_nothing_has_become_slow():
    verdicts = best_of(4)
    assert [verdict.gate for verdict in verdicts] == list(gate.GATES)
    assert all(verdict.passed for verdict in verdicts), "\n".join(map(str, verdicts))


def test_the_gate_notices_slow_code(monkeypatch):
    """Ten times the work has to fail every gate: a gate that passes is set too high, as its code became faster."""
    slow = replace(KINBOARD, enter=lambda task: [slowed(c, 10) for c in KINBOARD.enter(task)])
    monkeypatch.setattr("app.bench.run.KINBOARD", slow)
    verdicts = gate.judge(run(replace(quick_settings(), rounds=4)))
    assert [verdict.gate for verdict in verdicts] == list(gate.GATES)
    assert not any(verdict.passed for verdict in verdicts), "\n".join(map(str, verdicts))


def test_the_gate_notices_code_that_is_no_longer_compiled(monkeypatch):
    rows = tuple(row for row in quick_settings().rows if row.id == "fk")
    arm = arm_of(kin.get_robot("pioneer5"))
    monkeypatch.setattr(kin, "fk", lambda robot, q: arm.fk(q))
    (verdict,) = gate.judge(run(replace(quick_settings(), rows=rows)))
    assert not verdict.passed, str(verdict)
    assert "TOO SLOW" in str(verdict)


def test_slowing_changes_the_time_and_not_the_answer():
    calls = []
    slow = slowed(contestants.Contestant("x", lambda k: calls.append(k) or k, [(1,)], list), 3)
    assert slow.call(7) == 7
    assert calls == [7, 7, 7]
