"""How long a thread keeps the interpreter: shortly while something is computed beside visitors."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.shared.computations import ComputationCache
from app.shared.threads import SHORT_TURN, in_short_turns


def fail_in_short_turns() -> None:
    with in_short_turns():
        assert sys.getswitchinterval() == pytest.approx(SHORT_TURN)
        raise LookupError


def test_turns_are_short_until_the_last_computation_has_ended() -> None:
    usual = sys.getswitchinterval()
    assert usual > SHORT_TURN
    with in_short_turns():
        with pytest.raises(LookupError):
            fail_in_short_turns()
        assert sys.getswitchinterval() == pytest.approx(SHORT_TURN), "the other one goes on"
    assert sys.getswitchinterval() == pytest.approx(usual)


def test_what_is_shared_is_computed_in_short_turns() -> None:
    usual = sys.getswitchinterval()
    with ThreadPoolExecutor(1) as executor:
        cache = ComputationCache[float](executor, 1)
        with cache.subscribe("turn", lambda _: sys.getswitchinterval()) as asked:
            assert asked.future.result(10) == pytest.approx(SHORT_TURN)
    assert sys.getswitchinterval() == pytest.approx(usual)
