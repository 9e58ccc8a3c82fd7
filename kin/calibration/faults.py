"""Touches and readings that contradict the others, and what may have happened.

One touch: it misses its socket, with the table that the other touches give, by more than noise explains. What
brings it back names the cause: two readings exchanged, a sign, another socket. Otherwise the tip was beside the
socket.

All touches: if no table within the tolerances explains them, single mistakes are tried on all of them: the sign of
a joint, two joints exchanged, a zero that is far off.

Two rules of order. A reading that is off by a radian is set aside *before* the first fit, which it would bend so
much that it hides itself. And touches are checked before the tolerances are widened, which would make room for
mistakes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Literal

import numpy as np

from kin.calibration.chain import Mask
from kin.calibration.fit import Fit, Touches, fit, solve
from kin.calibration.fixtures import PLANE, Whole
from kin.calibration.model import Model
from kin.transforms import Array

Cause = Literal["place", "swap", "sign", "socket", "zero"]
_ALARM = 0.01  # chance of a false alarm in a set of touches
_LOUD = 2.0  # times the stated noise: more is a contradiction
_CLEARLY = 0.5  # of the cost without a mistake: what its explanation must be below
_BEYOND = 3.5  # standard deviations of a tolerance: an error of the table that large is a mistake
_FAR = math.radians(60.0)  # a zero that is not within the tolerance
_GROSS = 3.0  # times what the tolerances let a touch be away from the others of its socket
_BACK = 0.7  # of the bound: below, a touch that was set aside comes back
_QUIET = 1.2  # times the noise without it: above, it has bent the fit
_ALIKE = math.radians(1.0)  # readings that are exchanged without a difference
_BETTER = 4.0  # times the miss with the explanation is that without it
_SCREENED, _FINALISTS = 5, 3  # steps of a first fit of each mistake; how many are fitted to the end


@dataclass(frozen=True)
class Fault:
    """One mistake.

    Attributes:
        touch: index of the touch, None if all touches are meant.
        cause: the tip was beside the "place"; two readings are exchanged ("swap"); a "sign" is wrong; another
            "socket" was touched; the "zero" of a joint is far off.
        joints: indices of the joints that it is about.
        value: metres beside the socket, or radians that a zero is off; 0 for the others.
        socket: the one that was probably touched, None for other causes.
    """

    touch: int | None
    cause: Cause
    joints: tuple[int, ...] = ()
    value: float = 0.0
    socket: int | None = None


@dataclass(frozen=True, eq=False)
class Checked:
    """A fit without the touches that contradict it, these faults, and the touches that were kept.

    `touches` are all of them, a mistake of all undone.
    """

    fit: Fit
    touches: Touches
    faults: tuple[Fault, ...]
    kept: Whole


def checked(model: Model, touches: Touches) -> Checked:
    """The fit without bad touches; with the mistake of all touches undone, if there is one."""
    found, kept, bad = _without_bad(model, touches)
    plausible = found.noise < _LOUD and _strangest(found) <= _BEYOND
    if plausible and len(bad) <= max(1, len(touches) // 5):
        return _final(model, touches, found, kept, bad)
    plain = solve(model, touches)
    tries = [
        (solve(other, changed, most=_SCREENED), fault, other, changed)
        for fault, other, changed in _mistakes(model, touches)
    ]
    tries.sort(key=lambda each: each[0].cost)
    ends = [
        (solve(other, changed, first.delta), fault, other, changed)
        for first, fault, other, changed in tries[:_FINALISTS]
    ]
    best, fault, other, changed = min(ends, key=lambda each: each[0].cost)
    if not (best.cost < _CLEARLY * plain.cost and best.noise < _LOUD):
        return _final(model, touches, found, kept, bad)
    found, kept, bad = _without_bad(other, changed)
    if fault.cause == "zero":
        fault = replace(fault, value=float(found.delta[_zero(model, fault.joints[0])]))
    return _final(other, changed, found, kept, bad, (fault,))


def _final(
    model: Model, touches: Touches, found: Fit, kept: Whole, bad: list[int], before: tuple[Fault, ...] = ()
) -> Checked:
    """The fit with tolerances as wide as they have to be, and the causes of bad touches."""
    faults = tuple(_cause(found, touches, k) for k in bad)
    return Checked(fit(model, touches.take(kept), found.delta), touches, (*before, *faults), kept)


def _strangest(found: Fit) -> float:
    """The largest error in units of its tolerance's standard deviation."""
    free = found.model.sigma > 0.0
    return float(np.abs(found.delta[free] / found.model.sigma[free]).max())


def bound(count: int, equations: Whole) -> Array:
    """What the largest of `count` squared misses stays below, but for a chance of 1 % (Wilson and Hilferty)."""
    z = NormalDist().inv_cdf(1.0 - _ALARM / count)
    k = equations.astype(np.float64)
    return np.asarray(k * (1.0 - 2.0 / (9.0 * k) + z * np.sqrt(2.0 / (9.0 * k))) ** 3)


def _without_bad(model: Model, touches: Touches) -> tuple[Fit, Whole, list[int]]:
    """The fit without touches that contradict the others, at most a quarter of them."""
    far = _far(model, touches)
    bad: list[int] = np.flatnonzero(far).tolist()
    kept = np.flatnonzero(~far)
    found = solve(model, touches.take(kept))
    while len(bad) < max(1, len(touches) // 4):
        excess = found.outlying / bound(len(kept), found.touches.equations)
        worst = int(excess.argmax())
        rest = np.delete(kept, worst)
        if excess[worst] < 1.0 or not (touches.at[rest] == touches.at[kept[worst]]).any():
            break
        bad.append(int(kept[worst]))
        kept = rest
        found = solve(model, touches.take(kept), found.delta)
    for k in sorted(bad):  # one that was blamed for another one's fault comes back
        trial = np.sort(np.append(kept, k))
        again = solve(model, touches.take(trial), found.delta)
        i = int(np.searchsorted(trial, k))
        fits = again.outlying[i] < _BACK * bound(len(trial), again.touches.equations)[i]
        if fits and again.noise < _QUIET * found.noise:
            kept, found = trial, again
            bad.remove(k)
    return found, kept, bad


def _far(model: Model, touches: Touches) -> Mask:
    """Touches so far from the others of their socket, with the nominal table, that no tolerance explains it.

    Where many are far, the mistake is not one of single touches, and none is set aside.
    """
    now = model.chain.derivatives(touches.q, np.zeros(model.count))
    far = np.zeros(len(touches), bool)
    for j in range(len(model.fixture.local)):
        mine = np.flatnonzero(touches.at == j)
        if len(mine) < 3:
            continue
        usual = np.sqrt(np.median(((now.by_parameter[mine] * model.sigma) ** 2).sum(axis=(1, 2))))
        away = np.linalg.norm(now.points[mine] - np.median(now.points[mine], axis=0), axis=1)
        far[mine] = away > _GROSS * usual
    return far if far.sum() <= len(touches) // 5 else np.zeros(len(touches), bool)


def _cause(found: Fit, touches: Touches, k: int) -> Fault:
    """What may have happened with one touch, given the table of the others."""
    model, q, at = found.model, touches.q[k], int(touches.at[k])
    tries: list[tuple[Array, int, Fault]] = [(q, at, Fault(k, "place"))]
    tries += [
        (q, j, Fault(k, "socket", socket=j)) for j in np.unique(found.touches.at).tolist() if j not in (at, PLANE)
    ]
    for i, j in itertools.combinations(range(len(q)), 2):
        if abs(q[i] - q[j]) > _ALIKE:
            tries.append((undone(q, "swap", (i, j)), at, Fault(k, "swap", (i, j))))
    for i in range(len(q)):
        if abs(q[i]) > _ALIKE:
            tries.append((undone(q, "sign", (i,)), at, Fault(k, "sign", (i,))))
    points = model.chain.points(np.array([each[0] for each in tries]), found.delta)
    misses = np.linalg.norm(found.places.misses(points, np.array([each[1] for each in tries])), axis=1)
    finalists: list[int] = (1 + np.argsort(misses[1:])[:_FINALISTS]).tolist()
    for best in finalists:
        reading, socket, fault = tries[best]
        others = found.touches
        whole = Touches(np.vstack([others.q, reading]), np.append(others.at, socket))
        again = solve(model, whole, found.delta)
        one_of_them = again.outlying[-1] < bound(len(whole), whole.equations)[-1]
        if misses[0] > _BETTER * misses[best] and one_of_them and again.noise < _QUIET * found.noise:
            return fault
    return replace(tries[0][2], value=float(misses[0]))


def undone(q: Array, cause: Cause, joints: tuple[int, ...]) -> Array:
    """Readings ``(..., n)`` without a wrong sign or an exchange; other causes are not in the readings."""
    q = q.copy()
    if cause == "sign":
        q[..., list(joints)] *= -1.0
    elif cause == "swap":
        q[..., list(joints)] = q[..., list(joints[::-1])]
    return q


def _zero(model: Model, joint: int) -> int:
    """The parameter that is the zero of a joint."""
    return model.chain.first[model.robot.joint_rows[joint]]


def _mistakes(model: Model, touches: Touches) -> Iterator[tuple[Fault, Model, Touches]]:
    """Single mistakes of all readings, each undone."""
    n = touches.q.shape[1]
    for i in range(n):
        yield Fault(None, "sign", (i,)), model, Touches(undone(touches.q, "sign", (i,)), touches.at)
    for i, j in itertools.combinations(range(n), 2):
        yield Fault(None, "swap", (i, j)), model, Touches(undone(touches.q, "swap", (i, j)), touches.at)
    for i in range(1, n):  # that of joint 1 is not seen
        if model.robot.revolute[i]:
            sigma = model.sigma.copy()
            sigma[_zero(model, i)] = _FAR
            yield Fault(None, "zero", (i,)), replace(model, sigma=sigma), touches
