"""Iterative inverse kinematics for teaching: four methods that differ in one function of the singular values.

The error of a configuration is ``e``, and the Jacobian ``J = U diag(σ) Vᵀ``. Each method steps by
``Δq = V diag(f(σ)) Uᵀ e``:

- Newton: f = 1/σ, so that J Δq = e (J⁺ if J is not square); none if J loses rank;
- Jacobian transpose: f = gain · α σ, so that Δq is along Jᵀe, with the α that is best for the linear model;
- damped least squares: f = σ/(σ² + λ²), never more than 1/(2λ);
- Gauss–Newton: f = 1/σ where σ is not zero, and the step is halved until the error falls.

Lengths are divided by the size of the arm, so that metres and radians compare. Everything takes batches of
configurations. The solver that answers targets is :mod:`kin.solvers.numeric`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from kin.axes import size
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.transforms import Array, rotation_vector

Method = Literal["newton", "transpose", "damped", "gauss-newton"]
METHODS: tuple[Method, ...] = get_args(Method)
Match = Literal["point", "pose"]
Outcome = Literal["reached", "singular", "limits", "stuck", "unfinished"]
MOST = 80  # iterations
DONE = 1e-10  # error at which an iteration ends
STILL = 1e-6  # a step shorter than this share of the error is none
RANK = 1e-6  # singular values below this share of the largest count as zero
HALVINGS = 24
SLICE = 16  # iterations between two pauses
_SAMPLES = 8


class Settings(NamedTuple):
    """How to iterate.

    Attributes:
        damping: λ of the damped least squares.
        gain: of the Jacobian transpose, as a multiple of the best one for the linear model.
        longest: the largest change of a joint in one iteration, in radians, or in arm sizes if it slides.
        limits: whether joints stop at their limits.
    """

    method: Method = "newton"
    damping: float = 0.1
    gain: float = 1.0
    longest: float = math.inf
    limits: bool = False


@dataclass(frozen=True, eq=False)
class Problem:
    """A target for an arm: the tool's pose `T` ``(4, 4)``, or its point only."""

    robot: Robot
    T: Array
    match: Match

    @cached_property
    def size(self) -> float:
        """The length (m) that counts as 1."""
        return size(self.robot)

    @cached_property
    def travel(self) -> Array:
        """What a change of 1 means for each joint ``(n,)``: 1 rad, or the arm's size in metres."""
        return np.where(self.robot.revolute, 1.0, self.size)

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Which of the six rows of twist and error count: those that the joints change, or that are off."""
        q = np.vstack([self.robot.q_home, self.robot.random_q(np.random.default_rng(2), _SAMPLES)])
        off = np.abs(self._missing(q)).min(axis=0) > RANK
        moved = np.abs(self._all_rows(q)).max(axis=(0, 2))[: len(off)] > RANK
        return np.flatnonzero(moved | off)

    @cached_property
    def is_finite(self) -> bool:
        """Whether the joints change as many components independently as there are joints: no self-motion."""
        q = self.robot.random_q(np.random.default_rng(3), _SAMPLES)
        return int(np.linalg.matrix_rank(self.jacobian(q), rtol=RANK).max()) == self.robot.n

    def error(self, q: Array) -> Array:
        """What is missing to the target ``(..., m)``: lengths in arm sizes, and a rotation vector in radians."""
        return self._missing(q)[..., self.rows]

    def jacobian(self, q: Array) -> Array:
        """J ``(..., m, n)``: minus the derivative of `error` by the joints, each in its unit of `travel`."""
        return self._all_rows(q)[..., self.rows, :]

    def distances(self, q: Array) -> tuple[Array, Array]:
        """Metres and radians between tool and target ``(...)``; 0 rad if only the point matters."""
        e = self._missing(q)
        return self.size * np.linalg.norm(e[..., :3], axis=-1), np.linalg.norm(e[..., 3:], axis=-1)

    def _all_rows(self, q: Array) -> Array:
        J = jacobian(self.robot, q) * self.travel
        J[..., :3, :] /= self.size
        return J

    def _missing(self, q: Array) -> Array:
        """Three components of the error, or six for a pose."""
        here = fk(self.robot, q)
        missing = (self.T[:3, 3] - here[..., :3, 3]) / self.size
        if self.match == "point":
            return np.asarray(missing)
        turn = rotation_vector(self.T[:3, :3] @ np.swapaxes(here[..., :3, :3], -1, -2))
        return np.concatenate([missing, turn], axis=-1)


class Moved(NamedTuple):
    """One iteration from configurations ``(k, n)``.

    Attributes:
        q, error: where it ends ``(k, n)``, and the error there ``(k, m)``.
        step: length of the step ``(k,)``, in units of `Problem.travel`.
        smallest: the smallest singular value where it began ``(k,)``.
        shortened: whether the step limit, or the search for a smaller error, shortened the step ``(k,)``.
        held: the joints that their limits stopped ``(k, n)``.
        singular: whether the method has no step ``(k,)``.
    """

    q: Array
    error: Array
    step: Array
    smallest: Array
    shortened: NDArray[np.bool_]
    held: NDArray[np.bool_]
    singular: NDArray[np.bool_]


def factors(settings: Settings, s: Array, w: Array) -> Array:
    """f(σ) of the method for singular values `s` and components ``w = Uᵀe``, both ``(..., r)``."""
    if settings.method == "damped":
        return np.asarray(s / (s * s + settings.damping**2))
    if settings.method == "transpose":
        slope = (s * s * w * w).sum(axis=-1, keepdims=True)
        bend = (s**4 * w * w).sum(axis=-1, keepdims=True)
        return np.asarray(settings.gain * s * np.divide(slope, bend, out=np.zeros_like(bend), where=bend > 1e-300))
    regular = s > RANK * s[..., :1]
    return np.divide(1.0, s, out=np.zeros_like(s), where=regular)


def advance(problem: Problem, settings: Settings, q: Array, error: Array) -> Moved:
    """One iteration from each of the configurations `q` ``(k, n)`` with these errors ``(k, m)``."""
    U, s, Vt = np.linalg.svd(problem.jacobian(q), full_matrices=False)
    w = (error[:, None] @ U)[:, 0]
    step = ((factors(settings, s, w) * w)[:, None] @ Vt)[:, 0]
    singular = np.zeros(len(q), dtype=np.bool_)
    if settings.method == "newton":
        singular = s[:, -1] <= RANK * s[:, 0]
        step[singular] = 0.0
    largest = np.abs(step).max(axis=1, initial=1e-300)
    share = np.minimum(1.0, settings.longest / largest)
    q_new, held = _moved(problem, settings, q, step * share[:, None])
    error_new = problem.error(q_new)
    if settings.method == "gauss-newton":
        before = np.linalg.norm(error, axis=1)
        for _ in range(HALVINGS):
            worse = np.linalg.norm(error_new, axis=1) >= before
            if not worse.any():
                break
            share[worse] *= 0.5
            q_new[worse], held[worse] = _moved(problem, settings, q[worse], (step * share[:, None])[worse])
            error_new[worse] = problem.error(q_new[worse])
        worse = np.linalg.norm(error_new, axis=1) >= before
        q_new[worse], error_new[worse] = q[worse], error[worse]
    length = np.linalg.norm((q_new - q) / problem.travel, axis=1)
    return Moved(q_new, error_new, length, s[:, -1], share < 1.0, held, singular)


def _moved(problem: Problem, settings: Settings, q: Array, step: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Configurations after a step, and the joints that stopped at a limit."""
    free = q + step * problem.travel
    if not settings.limits:
        return free, np.zeros(free.shape, dtype=np.bool_)
    clipped = np.clip(free, problem.robot.lower, problem.robot.upper)
    return clipped, clipped != free


@dataclass(frozen=True, eq=False)
class Run:
    """The iterates from one start: k iterations have k + 1 of them.

    Attributes:
        q: ``(k + 1, n)``.
        errors: norm of the error ``(k + 1,)``.
        far, turned: the same as a distance (m) and as an angle (rad).
        steps: lengths ``(k,)``.
        smallest: smallest singular value at each iterate ``(k + 1,)``.
        shortened: steps that were shortened ``(k,)``.
        held: joints that their limits stopped ``(k, n)``.
        outcome: how it ended.
    """

    q: Array
    errors: Array
    far: Array
    turned: Array
    steps: Array
    smallest: Array
    shortened: NDArray[np.bool_]
    held: NDArray[np.bool_]
    outcome: Outcome

    @property
    def count(self) -> int:
        """Number of iterations."""
        return len(self.steps)


def iterate(problem: Problem, settings: Settings, start: Array, most: int = MOST) -> Iterator[Run | None]:
    """Iterate from a configuration ``(n,)`` until it ends in an `Outcome`.

    Yields:
        None now and then, when some milliseconds have passed, and the iterates at the end.
    """
    q = start[None].copy()
    error = problem.error(q)
    iterates, smallest = [q], []
    moves: list[Moved] = []
    outcome: Outcome | None = None
    while outcome is None:
        size_of_error = float(np.linalg.norm(error))
        if size_of_error < DONE or len(moves) == most:
            outcome = "reached" if size_of_error < DONE else "unfinished"
            smallest.append(np.linalg.svd(problem.jacobian(q), compute_uv=False)[:, -1])
            break
        made = advance(problem, settings, q, error)
        smallest.append(made.smallest)
        if made.singular[0]:
            outcome = "singular"
        elif made.step[0] < STILL * size_of_error:
            outcome = "limits" if made.held.any() else "stuck"
        else:
            q, error = made.q, made.error
            iterates.append(q)
            moves.append(made)
            if len(moves) % SLICE == 0:
                yield None
    every = np.concatenate(iterates)
    far, turned = problem.distances(every)
    yield Run(
        every,
        np.linalg.norm(problem.error(every), axis=1),
        far,
        turned,
        np.array([float(m.step[0]) for m in moves]),
        np.concatenate(smallest),
        np.array([bool(m.shortened[0]) for m in moves], dtype=np.bool_),
        np.array([m.held[0] for m in moves], dtype=np.bool_).reshape(-1, problem.robot.n),
        outcome,
    )


def run(problem: Problem, settings: Settings, start: Array, most: int = MOST) -> Run:
    """The same at once."""
    return next(found for found in iterate(problem, settings, start, most) if found is not None)
