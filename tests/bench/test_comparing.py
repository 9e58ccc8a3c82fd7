"""What a comparison may cost, relative to one `kin.solve_ik` of the same arm in the same run."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import kin

sys.path.insert(0, str(Path(__file__).parent))
import comparing

pytestmark = pytest.mark.bench

# The 95th percentile, two to three times what is measured; for mistakes more, of which few need pairs of changes.
GATES = {"equal, fixed": 1000.0, "equal, free": 700.0, "equal, verdict": 400.0, "one mistake": 2000.0}


def p95(name: str, each: int, attempts: int) -> float:
    """The least 95th percentile over some runs; no more runs than are needed to pass."""
    least = np.inf
    for seed in range(attempts):
        least = min(least, float(np.percentile(comparing.measured(comparing.ROWS[name], each, seed), 95)))
        if least <= GATES[name]:
            break
    return least


@pytest.mark.parametrize("name", comparing.ROWS)
def test_comparisons_have_not_become_slow(name: str) -> None:
    assert p95(name, 3, 4) <= GATES[name]


def test_the_gate_notices_slow_comparisons(monkeypatch: pytest.MonkeyPatch) -> None:
    compare = kin.compare
    monkeypatch.setattr(kin, "compare", lambda *a, **k: [compare(*a, **k) for _ in range(10)][-1])
    assert p95("equal, fixed", 1, 1) > GATES["equal, fixed"]
