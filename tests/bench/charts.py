"""Time of the chart of postures along a line in times of `solve_path`: ``python tests/bench/charts.py``.

Both plan the same 200 places, in turns, so that other load on the machine affects both. Lines begin at random
configurations and keep the orientation of the tool; some leave the workspace or the limits.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import kin
from kin import Robot
from kin.transforms import Array

PLACES = 200
ARMS = ("ur5", "puma560", "pioneer5", "stanford", "panda", "iiwa14")
MOST = 10.0  # times as long as `solve_path`
_LENGTH = 0.3  # of a line, in reaches


class Multiples(NamedTuple):
    """How many times as long the chart takes, over the lines."""

    p50: float
    p95: float


def line(robot: Robot, rng: np.random.Generator) -> Array:
    """Poses ``(PLACES, 4, 4)`` along a random line."""
    T = np.repeat(kin.fk(robot, robot.random_q(rng))[None], PLACES, axis=0)
    way = rng.normal(size=3)
    T[:, :3, 3] += np.linspace(0.0, _LENGTH * robot.reach, PLACES)[:, None] * way / np.linalg.norm(way)
    return T


def multiples(robot: Robot, lines: int, rounds: int = 3) -> Multiples:
    """Median and 95th percentile over random lines, each with the quickest of some rounds of both."""
    rng = np.random.default_rng(7)
    found = []
    for T in [line(robot, rng) for _ in range(lines)]:
        times = [(spent(kin.path.path_postures, robot, T), spent(kin.solve_path, robot, T)) for _ in range(rounds)]
        chart, path = np.min(times, axis=0)
        found.append(chart / path)
    return Multiples(*np.percentile(found, [50.0, 95.0]).tolist())


def spent(plan: Callable[[Robot, Array], object], robot: Robot, T: Array) -> float:
    """Seconds of this thread's processor time."""
    began = time.thread_time()
    plan(robot, T)
    return time.thread_time() - began


def main() -> int:
    """Print a table; 1 if an arm is slower than it may be."""
    print(f"chart of {PLACES} places ÷ solve_path of the same ones, at most {MOST:g}")
    slow = False
    for name in ARMS:
        multiples(kin.get_robot(name), 1, 1)  # compiles
        found = multiples(kin.get_robot(name), 20)
        slow |= found.p95 > MOST
        print(f"{name:10} p50 {found.p50:5.2f}   p95 {found.p95:5.2f}", flush=True)
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())
