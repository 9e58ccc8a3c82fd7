"""How often mistakes in touches are found and named, on simulated arms: the table of docs/calibrate.md.

``python -m tests.kin.calibration.rates`` prints its rows; it takes about a quarter of an hour of processor time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable

import numpy as np

from kin.calibration.chain import Chain
from kin.calibration.faults import Fault, checked
from kin.calibration.fit import Touches
from kin.calibration.fixtures import PLANE
from tests.kin.calibration.cells import Cell
from tests.kin.calibration.simulated import DEG

ARMS = 20  # of each cell
FEWER = 10  # of mistakes of all touches, each of which takes seconds
CELLS = [
    Cell("so101", "sheet"),
    Cell("so101", "bar 50 mm, 3 places"),
    Cell("ur5e", "bar"),
    Cell("puma560", "bar"),
    Cell("panda", "bar"),
]
FAR = 30.0 * DEG  # of two readings, or of one from zero: a mistake with less changes little

Made = tuple[Touches, list[Fault]]
Mistake = Callable[[Chain, Touches, np.random.Generator], Made]


def beside(count: int) -> Mistake:
    """So many touches with the tip 5 mm beside the socket."""

    def make(chain: Chain, touches: Touches, rng: np.random.Generator) -> Made:
        q, wrong = touches.q.copy(), rng.permutation(len(touches))[:count].tolist()
        J = chain.derivatives(q, np.zeros(len(chain.parameters))).by_joint
        for k in wrong:
            by = rng.normal(size=3)
            q[k] += np.linalg.pinv(J[k]) @ (5e-3 * by / np.linalg.norm(by))
        return Touches(q, touches.at), [Fault(k, "place") for k in wrong]

    return make


def another_socket(_: Chain, touches: Touches, rng: np.random.Generator) -> Made:
    """One touch of a socket that is not the one that was noted."""
    at, k = touches.at.copy(), int(rng.integers(len(touches)))
    others = [j for j in np.unique(at).tolist() if j not in (at[k], PLANE)]
    right, at[k] = int(at[k]), rng.choice(others)
    return Touches(touches.q, at), [Fault(k, "socket", socket=right)]


def exchanged(all_of_them: bool) -> Mistake:
    """Two joints exchanged, in one touch or in all."""

    def make(_: Chain, touches: Touches, rng: np.random.Generator) -> Made:
        q, n = touches.q.copy(), touches.q.shape[1]
        while True:
            k = slice(None) if all_of_them else int(rng.integers(len(q)))
            i, j = sorted(rng.permutation(n)[:2].tolist())
            if np.abs(q[k, i] - q[k, j]).max() > FAR:
                break
        q[k, i], q[k, j] = q[k, j].copy(), q[k, i].copy()
        return Touches(q, touches.at), [Fault(None if all_of_them else k, "swap", (i, j))]

    return make


def backwards(_: Chain, touches: Touches, rng: np.random.Generator) -> Made:
    """A joint that counts backwards."""
    i = int(rng.integers(touches.q.shape[1]))
    return Touches(touches.q * np.where(np.arange(touches.q.shape[1]) == i, -1.0, 1.0), touches.at), [
        Fault(None, "sign", (i,))
    ]


def far_zero(_: Chain, touches: Touches, rng: np.random.Generator) -> Made:
    """A zero that is 15° off; that of joint 1 is that of the base."""
    i = int(rng.integers(1, touches.q.shape[1]))
    q = touches.q.copy()
    q[:, i] += 15.0 * DEG
    return Touches(q, touches.at), [Fault(None, "zero", (i,))]


MISTAKES: dict[str, tuple[Mistake, int]] = {
    "one touch 5 mm beside": (beside(1), ARMS),
    "two touches 5 mm beside": (beside(2), ARMS),
    "another socket, one touch": (another_socket, ARMS),
    "two readings exchanged, one touch": (exchanged(False), ARMS),
    "a joint counts backwards": (backwards, FEWER),
    "two joints exchanged": (exchanged(True), FEWER),
    "a zero 15° off": (far_zero, FEWER),
    "nothing wrong: a false alarm": (lambda _, touches, rng: (touches, []), ARMS),
}


def outcome(found: Iterable[Fault], made: list[Fault]) -> tuple[bool, bool]:
    """Whether mistakes were found (of no mistake: whether one was made up), and whether all were named."""
    found = list(found)
    if not made:
        return bool(found), False
    places = {fault.touch for fault in found}
    known = {(fault.touch, fault.cause, fault.joints) for fault in found}
    whole = all(fault.touch in places for fault in made)
    return whole, whole and all((fault.touch, fault.cause, fault.joints) in known for fault in made)


def main() -> None:
    """Print a row for each cell and mistake: found and named, per cent."""
    for cell in CELLS:
        for name, (make, arms) in MISTAKES.items():
            results = []
            for seed in range(arms):
                model, _, touches = cell.touches(500 + seed)
                wrong, made = make(model.chain, touches, np.random.default_rng([seed, 3]))
                results.append(outcome(checked(model, wrong).faults, made))
            found, named = (100.0 * np.mean([each[i] for each in results]) for i in (0, 1))
            print(f"{cell.name} | {cell.what} | {name} | {found:.0f} | {named:.0f}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
