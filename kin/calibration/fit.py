"""The likeliest errors of a table, given touches and tolerances.

Each touch is one equation of three coordinates (of one for a plane), weighed by what a reading and a contact may
be off by. The tolerances are a Gaussian prior. The method of Levenberg and Marquardt finds the likeliest errors,
and the inverse of the normal matrix is their covariance.

Two safeguards make the covariance honest, and both act upwards only. Where the misses are larger than the stated
noise explains, the noise is taken to be larger, and the fit is repeated: otherwise it would bend the table to
explain what is noise. Where the errors that are seen are larger than the tolerances, so may be those that are not:
then all tolerances are taken to be larger (MacKay's evidence, Bayesian interpolation, Neural Computation 1992).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from kin.calibration.chain import Mask
from kin.calibration.fixtures import PLANE, Places, Whole
from kin.calibration.model import Model
from kin.transforms import Array

PRIOR_NOISE = 10.0  # degrees of freedom that the stated noise is worth against that of the misses
MOST_WIDER = 3.0  # times the tolerances: errors beyond are mistakes, which `kin.calibration.faults` looks for
STEPS = 40
_SEEN = 0.5  # a parameter is seen if touches leave less than this share of its tolerance
_DIRECTIONS = 4.0  # as if so many more had been seen, of the stated size: few say little about tolerances
_ENOUGH = 1.15  # times the noise or the tolerances: less is not worth another fit
_GAIN = 1e-7  # of the cost, by a step: the last one
_HARDEST = 1e9
_MARGIN = 1.12  # of the bound: without it, 90 to 98 % of simulated SO-101 kept it (five fixtures, 200 runs each)
_WEIGHED_AGAIN = (4, 8)  # steps at which touches are weighed anew


@dataclass(frozen=True, eq=False)
class Touches:
    """Readings ``(k, n)``, and what was touched ``(k,)``: the number of a socket, or `PLANE`."""

    q: Array
    at: Whole

    def __len__(self) -> int:
        return len(self.q)

    def take(self, which: Whole | Mask | list[int]) -> Touches:
        """Some of the touches."""
        return Touches(self.q[which], self.at[which])

    @property
    def equations(self) -> Whole:
        """How many equations each touch gives ``(k,)``."""
        return np.where(self.at == PLANE, 1, 3)


@dataclass(frozen=True, eq=False)
class Fit:
    """The likeliest errors and what is known of them.

    Attributes:
        model: with the noise and the tolerances that were taken.
        delta: ``(p,)`` errors of the table and the tool point.
        places: of the boards and the plane.
        covariance: ``(p, p)`` of delta, with the noise as the misses show it.
        noise: how large the noise was, as a multiple of the stated one, 1 or more.
        wider: by what factor the tolerances were taken to be wider than stated.
        excess: how large the errors of the table are that were seen, as a multiple of the tolerances of `model`.
        misses: ``(k, 3)`` of the touches, metres.
        held_out: ``(k,)`` distance by which each touch would miss if the fit had not used it, metres.
        outlying: ``(k,)`` squared, studentised distance of each touch from what the others say.
        cost: twice the negative logarithm of the likelihood, but for a constant.
    """

    model: Model
    touches: Touches
    delta: Array
    places: Places
    covariance: Array
    noise: float
    excess: float
    misses: Array
    held_out: Array
    outlying: Array
    cost: float
    steps: int
    wider: float = 1.0

    @property
    def sd(self) -> Array:
        """Standard deviations of the parameters ``(p,)``."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def seen(self) -> Mask:
        """Which parameters the touches have seen ``(p,)``: their uncertainty is clearly below the tolerance."""
        return np.asarray((self.model.sigma > 0.0) & (self.sd < _SEEN * self.model.sigma))

    @property
    def freedom(self) -> float:
        """Degrees of freedom with which the noise is known."""
        return freedom_of(self.model, len(self.touches))


def freedom_of(model: Model, count: int) -> float:
    """Degrees of freedom with which so many touches let the noise be known."""
    return max(PRIOR_NOISE + 3.0 * count - model.count, 5.0)


def fit(model: Model, touches: Touches, start: Array | None = None) -> Fit:
    """The likeliest errors, with noise and tolerances as the touches show them.

    Args:
        start: ``(p,)`` errors to start from; 0 by default.
    """
    found = solve(model, touches, start)
    noise = wider = 1.0
    for _ in range(6):
        more = max(1.0, found.excess)
        widest = wider >= MOST_WIDER and found.noise < _ENOUGH
        if widest or (found.noise < _ENOUGH and more < _ENOUGH):
            break
        noise, wider = noise * found.noise, min(wider * more, MOST_WIDER)
        found = solve(model.wider(noise, wider), touches, found.delta)
    return replace(found, noise=found.noise * noise, wider=wider)


def solve(model: Model, touches: Touches, start: Array | None = None, most: int = STEPS) -> Fit:
    """The likeliest errors with the noise and the tolerances of the model."""
    count, sigma, at = model.count, model.prior, touches.at
    free = sigma > 0.0
    x = np.zeros(len(sigma))
    if start is not None:
        x[:count] = np.where(free[:count], start, 0.0)
    now = model.chain.derivatives(touches.q, x[:count])
    places = Places.near(model.fixture, now.points, at)
    weight, cost, damping, step = np.zeros((0, 3, 3)), math.inf, 1e-3, 0
    for step in range(1, most + 1):
        model.cancel()
        A, D = places.derivatives(now.points, at)
        miss = places.misses(now.points, at)
        if step == 1 or step in _WEIGHED_AGAIN:
            weight = model.whitening(now.by_joint, A, at)
            cost = _cost(weight, miss, x, sigma, free)
        G = weight @ np.concatenate([A @ now.by_parameter, D], axis=2)
        J = G.reshape(-1, len(sigma))[:, free] * sigma[free]
        H = J.T @ J + np.eye(J.shape[1])
        g = J.T @ (weight @ miss[:, :, None]).reshape(-1) + x[free] / sigma[free]
        while damping < _HARDEST:
            change = np.zeros(len(sigma))
            change[free] = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g) * sigma[free]
            tried = places.moved(change[count:])
            p = model.chain.points(touches.q, x[:count] + change[:count])
            new = _cost(weight, tried.misses(p, at), x + change, sigma, free)
            if new <= cost:
                break
            damping *= 10.0
        else:
            break
        gain, x, cost, places, damping = cost - new, x + change, new, tried, max(0.1 * damping, 1e-9)
        now = model.chain.derivatives(touches.q, x[:count])
        if gain < _GAIN * (1.0 + cost) and step > min(_WEIGHED_AGAIN):
            break
    return _finished(model, touches, places, x, step)


def _cost(weight: Array, miss: Array, x: Array, sigma: Array, free: Mask) -> float:
    e = (weight @ miss[:, :, None]).reshape(-1)
    z = x[free] / sigma[free]
    return float(e @ e + z @ z)


def _finished(model: Model, touches: Touches, places: Places, x: Array, steps: int) -> Fit:
    """The fit at its end, with the covariance and what each touch says against the others."""
    count, sigma = model.count, model.prior
    free = sigma > 0.0
    now = model.chain.derivatives(touches.q, x[:count])
    A, D = places.derivatives(now.points, touches.at)
    miss = places.misses(now.points, touches.at)
    weight = model.whitening(now.by_joint, A, touches.at)
    G = (weight @ np.concatenate([A @ now.by_parameter, D], axis=2))[:, :, free] * sigma[free]
    J = G.reshape(-1, G.shape[2])
    P = np.linalg.inv(J.T @ J + np.eye(J.shape[1]))
    e = (weight @ miss[:, :, None])[:, :, 0]
    equations = touches.equations
    GP = G @ P
    taken = float((GP * G).sum())  # what the parameters took of the equations
    freedom = max(float(equations.sum()) - taken, 0.0)
    square = float((e**2).sum())
    scale = (PRIOR_NOISE + square) / (PRIOR_NOISE + freedom)
    left = np.eye(3) - GP @ G.transpose(0, 2, 1)  # covariance of each whitened miss
    flat = equations == 1
    left[flat, 1:, :] = left[flat, :, 1:] = 0.0
    left[flat, 1, 1] = left[flat, 2, 2] = 1.0
    without = np.linalg.solve(left + 1e-9 * np.eye(3), e[:, :, None])  # the miss if the touch had not been used
    own = (e * without[:, :, 0]).sum(axis=1)
    rest = (PRIOR_NOISE + square - own) / np.maximum(PRIOR_NOISE + freedom - equations, 1.0)
    z = x[free] / sigma[free]
    arm = np.flatnonzero(free[:count])
    table = np.flatnonzero(model.of_table[arm])
    known = float(len(table) - np.trace(P[np.ix_(table, table)]))
    covariance = np.zeros((count, count))
    covariance[np.ix_(arm, arm)] = _scaled(P[: len(arm), : len(arm)], scale) * np.outer(sigma[arm], sigma[arm])
    return Fit(
        model,
        touches,
        x[:count],
        places,
        covariance,
        math.sqrt(max(scale, 1.0)),
        math.sqrt((_DIRECTIONS + float((z[table] ** 2).sum())) / (_DIRECTIONS + known)),
        miss,
        np.linalg.norm(np.linalg.solve(weight, without)[:, :, 0], axis=1),
        own / np.maximum(rest, 0.25),
        square + float(z @ z),
        steps,
    )


def _scaled(P: Array, scale: float) -> Array:
    """The covariance, in units of the tolerances, if the variance of the noise was larger by this factor.

    What the touches say, P⁻¹ − 1, is divided by it; what the tolerances say is not.
    """
    if scale <= 1.0:
        return P
    one = np.eye(len(P))
    return np.asarray(np.linalg.inv((np.linalg.inv(P) - one) / scale + one))


def spread(root: Array, freedom: float, poses: int, draws: int = 400) -> tuple[float, float]:
    """Expected error of the tip and what 95 % stay below, metres.

    The sums of squares are drawn by their eigenvalues, which do not depend on the root or on rounding.

    Args:
        root: ``(3t, r)`` of which root rootᵀ is the covariance of the tip at the poses.
        freedom: degrees of freedom with which the noise is known.
    """
    rng = np.random.default_rng(0)
    t = np.sqrt(freedom / rng.chisquare(freedom, draws))
    strengths = np.maximum(np.linalg.eigvalsh(root.T @ root), 0.0)
    errors = np.sqrt(strengths @ rng.normal(size=(len(strengths), draws)) ** 2 / poses) * t
    return float(np.sqrt((root**2).sum() / poses)), _MARGIN * float(np.quantile(errors, 0.95))
