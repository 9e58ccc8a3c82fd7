"""``python tests/bench/comparing.py``: what `kin.compare` costs, in calls of `kin.solve_ik` of the same arm.

Every classic arm is compared with itself in other frames (base, tool, senses and zeros are random), and with its
table after one random mistake. Each pair is compared once, so that nothing is known of the second arm. Times are
CPU time of this process. The calls of `kin.solve_ik` are timed between the comparisons; their median counts.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "kin" / "comparison")]

from arms import CLASSICS  # noqa: E402
from test_comparison import in_other_frames  # noqa: E402
from test_mutations import mutated  # noqa: E402

import kin  # noqa: E402
from kin.comparison import Comparison  # noqa: E402
from kin.errors import InputError  # noqa: E402

CALLS = 20  # of `kin.solve_ik` in a row


class Row(NamedTuple):
    """What is measured.

    Attributes:
        other: the arm that is compared with the first one, which it may replace.
        options: keywords of `kin.compare`.
        answered: whether a comparison says what it should.
    """

    other: Callable[[kin.Robot, np.random.Generator], tuple[kin.Robot, kin.Robot]]
    options: dict[str, Any]
    answered: Callable[[Comparison], bool]


def equal(arm: kin.Robot, rng: np.random.Generator) -> tuple[kin.Robot, kin.Robot]:
    """An arm, and the same one in other frames."""
    return arm, in_other_frames(arm, rng)


def mistaken(arm: kin.Robot, rng: np.random.Generator) -> tuple[kin.Robot, kin.Robot]:
    """An arm, and its table with one mistake."""
    while (case := mutated(arm, 1, rng)) is None:
        pass
    return case.reference, case.table


ROWS = {
    "equal, fixed": Row(equal, {"frames": "fixed"}, lambda found: found.is_same),
    "equal, free": Row(equal, {"frames": "free"}, lambda found: found.is_same),
    "equal, verdict": Row(equal, {"explain": False}, lambda found: found.is_same),
    "one mistake": Row(mistaken, {"seconds": 20.0}, lambda found: found.is_same or bool(found.explanations)),
}


def one_ik(arm: kin.Robot) -> Callable[[], object]:
    """A call of `kin.solve_ik` at the arm's home configuration, for as much of the pose as the arm can hold."""
    q = arm.q_home
    T = kin.fk(arm, q)
    for task in ("pose", "approach", "position"):
        try:
            kin.solve_ik(arm, T, q_seed=q, task=task)
        except InputError:
            continue
        return lambda: kin.solve_ik(arm, T, q_seed=q, task=task)
    raise ValueError(f"{arm.id}: no task")


def many(solve: Callable[[], object]) -> None:
    """Some calls in a row."""
    for _ in range(CALLS):
        solve()


def timed(call: Callable[..., Any], *arguments: object, **options: object) -> tuple[float, Any]:
    """CPU time of a call, and what it returns."""
    began = time.process_time()
    answer = call(*arguments, **options)
    return time.process_time() - began, answer


def measured(row: Row, each: int, seed: int = 1) -> np.ndarray:
    """Times of comparisons ``(arms · each,)``, in calls of `kin.solve_ik`.

    Raises:
        AssertionError: a comparison does not say what it should.
    """
    rng = np.random.default_rng(seed)
    ratios: list[float] = []
    for arm in CLASSICS:
        solve = one_ik(arm)
        kin.compare(*row.other(arm, rng), **row.options)  # what is kept of the first arm
        calls, times = [], []
        for _ in range(each):
            a, b = row.other(arm, rng)
            took, _ = timed(many, solve)
            calls.append(took / CALLS)
            took, found = timed(kin.compare, a, b, **row.options)
            times.append(took)
            assert row.answered(found), (arm.id, found.verdict)
        ratios += [took / float(np.median(calls)) for took in times]
    return np.array(ratios)


def main() -> None:
    """Print one line per row."""
    parser = argparse.ArgumentParser(prog="python tests/bench/comparing.py", description=__doc__)
    parser.add_argument("--each", type=int, default=20, help="comparisons of each arm (20)")
    arguments = parser.parse_args()
    print(f"{'comparison':16}{'p50':>8}{'p95':>8}  × one solve_ik")
    for name, row in ROWS.items():
        p50, p95 = np.percentile(measured(row, arguments.each), [50, 95])
        print(f"{name:16}{p50:8.0f}{p95:8.0f}")


if __name__ == "__main__":
    main()
