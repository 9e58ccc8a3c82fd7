"""The chart of postures is planned in at most ten times the time of the best path along the same places."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import pytest

import kin
from kin.path import postures

sys.path.insert(0, str(Path(__file__).parent))
import charts

pytestmark = pytest.mark.bench


@pytest.mark.parametrize("name", ["ur5", "pioneer5"])
def test_a_chart_takes_at_most_ten_times_as_long_as_the_path(name: str) -> None:
    robot = kin.get_robot(name)
    charts.multiples(robot, 1, 1)
    found = charts.multiples(robot, 2, 2)
    assert 0.0 < found.p50 <= found.p95 <= charts.MOST


def test_a_slow_chart_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = kin.get_robot("ur5")
    T = charts.line(robot, np.random.default_rng(7))
    quick = charts.spent(kin.solve_path, robot, T)

    def slowly(*arguments: object) -> object:
        end = time.thread_time() + 20.0 * quick
        while time.thread_time() < end:
            pass
        return along(*arguments)  # type: ignore[arg-type]

    along = postures.postures_along
    monkeypatch.setattr(kin.path, "postures_along", slowly)
    assert charts.multiples(robot, 1, 1).p50 > charts.MOST
