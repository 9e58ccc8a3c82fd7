"""The counts behind ``python tests/bench/evidence``: configurations drawn, poses asked about, answers judged."""

from __future__ import annotations

import multiprocessing
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace

import numpy as np
from arms import made_up_arms, random_table, with_slides
from numpy_arm import pose

import kin
from kin import Robot, Status
from kin.solvers import family_of

SAME = 1e-6  # radians or metres: two configurations that are one
REGULAR = 1e-3  # smallest singular value of a configuration that counts
TABLES = 100  # random tables for each number of joints


@dataclass
class Tally:
    """The counts of one kind of arm; errors in metres and radians."""

    arms: int = 0
    targets: int = 0
    left_out: int = 0
    found: int = 0
    false: int = 0
    curves: int = 0
    completeness: dict[str, int] = field(default_factory=dict)
    position_error: float = 0.0
    rotation_error: float = 0.0

    def add(self, other: Tally) -> None:
        """Add the counts of another one."""
        for name in ("arms", "targets", "left_out", "found", "false", "curves"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.completeness = dict(Counter(self.completeness) + Counter(other.completeness))
        self.position_error = max(self.position_error, other.position_error)
        self.rotation_error = max(self.rotation_error, other.rotation_error)


@dataclass(frozen=True)
class Question:
    """An arm, the kind it is counted under, and how many configurations are drawn."""

    kind: str
    robot: Robot
    targets: int
    seed: int


def questions(targets: int, seed: int) -> Iterator[Question]:
    """Every built-in arm and those of the other families, exact and with rounded angles; random tables."""
    exact = (*kin.builtin_robots().values(), *made_up_arms())
    for robot in exact:
        yield Question(family_of(robot), robot, targets, seed)
    for robot in exact:
        if (typed := with_angles(robot, 4)) != robot:
            yield Question(f"{family_of(robot)}, angles of four decimals", typed, targets, seed)
    few = max(1, targets // TABLES)
    for joints in range(1, 8):
        for number in range(TABLES):
            turning = random_table(joints, number)
            sliding = with_slides(turning, number)
            if rank(turning) == min(joints, 6):
                yield Question(f"random tables, {joints} turning", turning, few, seed)
            if joints < 7 and rank(sliding) == joints:
                yield Question(f"random tables, {joints}, some sliding", sliding, few, seed)


def with_angles(robot: Robot, decimals: int) -> Robot:
    """The table as somebody types it."""
    rows = tuple(
        replace(row, theta=round(row.theta, decimals), alpha=round(row.alpha, decimals)) for row in robot.rows
    )
    return replace(robot, rows=rows)


def ask(question: Question) -> tuple[str, Tally]:
    """Count what is answered to one question."""
    robot, tally = question.robot, Tally(arms=1)
    drawn = robot.random_q(np.random.default_rng(question.seed), question.targets)
    freedoms = rank(robot)
    for q in drawn:
        if singular_values(robot, q)[freedoms - 1] < REGULAR:
            continue
        T = pose(robot, q)
        try:
            value = redundancy_at(robot, T, q)
        except LookupError:
            tally.left_out += 1
            continue
        result = kin.solve_ik(robot, T, redundancy=value)
        tally.targets += 1
        tally.curves += result.details.infinite
        tally.completeness[result.completeness] = tally.completeness.get(result.completeness, 0) + 1
        found = any(apart(robot, each.q, q) < SAME for each in result.solutions)
        tally.found += found
        tally.false += result.complete and not found and not result.details.infinite
        if result.status is Status.SOLVED:
            for each in result.solutions:
                position, rotation = errors(pose(robot, each.q), T)
                tally.position_error = max(tally.position_error, position)
                tally.rotation_error = max(tally.rotation_error, rotation)
    return question.kind, tally


def singular_values(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Those of the Jacobian, the largest first."""
    return np.linalg.svd(kin.jacobian(robot, q), compute_uv=False)


def rank(robot: Robot) -> int:
    """In how many directions the arm moves its tool, where it is not singular."""
    drawn = robot.random_q(np.random.default_rng(0), 8)
    return max(int(np.sum(singular_values(robot, q) > REGULAR)) for q in drawn)


def redundancy_at(robot: Robot, T: np.ndarray, q: np.ndarray) -> float | None:
    """The redundancy parameter of a configuration; None for an arm without one.

    Raises:
        LookupError: it is an angle of the arm, such as ψ, and the answer nearest to the configuration has another
            one: within 1e-7 of the end of a range that is the case.
    """
    result = kin.solve_ik(robot, T, q_seed=q)
    nearest = min(result.solutions, key=lambda each: apart(robot, each.q, q), default=None)
    if nearest is None or not nearest.redundancy:
        return None
    parameter = nearest.redundancy[0]
    joints = [i for i in range(robot.n) if parameter.name == f"theta{i + 1}"]
    if joints:
        return float(q[joints[0]])
    if apart(robot, nearest.q, q) > SAME:
        raise LookupError(parameter.name)
    return parameter.value


def apart(robot: Robot, a: np.ndarray, b: np.ndarray) -> float:
    """The largest difference of two configurations, whole turns aside."""
    turned = np.abs((a - b + np.pi) % (2 * np.pi) - np.pi)
    return float(np.where(robot.revolute, turned, np.abs(a - b)).max())


def errors(T: np.ndarray, target: np.ndarray) -> tuple[float, float]:
    """Distance of the tool points, and the angle between the orientations."""
    skew = T[:3, :3].T @ target[:3, :3]
    sine = 0.5 * np.linalg.norm([skew[2, 1] - skew[1, 2], skew[0, 2] - skew[2, 0], skew[1, 0] - skew[0, 1]])
    return float(np.linalg.norm(T[:3, 3] - target[:3, 3])), float(np.arctan2(sine, 0.5 * (np.trace(skew) - 1.0)))


def tallies(asked: Sequence[Question], processes: int) -> dict[str, Tally]:
    """The counts of all questions by kind, in their order."""
    found: dict[str, Tally] = {}
    with ExitStack() as stack:
        answers: Iterable[tuple[str, Tally]] = map(ask, asked)
        if processes > 1:
            pool = stack.enter_context(multiprocessing.get_context("forkserver").Pool(processes))
            answers = pool.imap(ask, asked, chunksize=4)
        for number, (kind, tally) in enumerate(answers, 1):
            found.setdefault(kind, Tally()).add(tally)
            if sys.stderr.isatty():
                print(f"\r{number} of {len(asked)}", end="", file=sys.stderr, flush=True)
    return found
