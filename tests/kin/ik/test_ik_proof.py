"""Completeness compared with a numeric search, and a million round trips.

``sh scripts/test.sh -m slow -s`` runs the slow tests, which print their figures; `KINBOARD_TEST_POSES` is the
number of poses of each (a million by default).
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from arms import CHAPTER_ARMS

import kin
from kin import Status, solve_ik
from kin.solvers.numeric import spread

POSES = int(os.environ.get("KINBOARD_TEST_POSES", "1000000"))
TASKS = ("pose", "approach", "position")


def newton(robot, target, q, task):
    """Damped Gauss–Newton on the pose error, independent of the code under test: ``(n,)`` or None."""
    for _ in range(60):
        T = kin.fk(robot, q)
        e = np.zeros(6)
        e[:3] = target[:3, 3] - T[:3, 3]
        for i in range(3):
            e[3:] += 0.5 * np.cross(T[:3, i], target[:3, i])
        J = kin.jacobian(robot, q)
        if task == "approach":
            e[3:] = np.cross(T[:3, 2], target[:3, 2])
            J = np.vstack([J[:3], J[3:] - np.outer(T[:3, 2], T[:3, 2] @ J[3:])])
        step = J.T @ np.linalg.solve(J @ J.T + 1e-7 * np.eye(6), e)
        q = q + step * min(1.0, 1.0 / np.abs(step).max())
        if not np.abs(q).max() < 50:
            return None
        if np.linalg.norm(e) < 1e-12:
            away = T[:3, 2] @ target[:3, 2] if task == "approach" else np.trace(T[:3, :3].T @ target[:3, :3]) / 3
            return q if away > 0.9 else None
    return None


@pytest.mark.full
@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_a_numeric_search_from_many_starts_finds_no_further_branch(robot_id):
    """Each result of Newton's method is one of the branches at its value of the redundancy parameter."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(31)
    task = "approach" if robot.n == 5 else "pose"
    found = 0
    for q0 in robot.random_q(rng, 5):
        target = kin.fk(robot, q0)
        for start in spread(np.full(robot.n, -math.pi), np.full(robot.n, math.pi), 60):
            q = newton(robot, target, start, task)
            if q is None or any(s.distance < 0.02 for s in kin.singularities(robot, q) if s.kind != "algorithmic"):
                continue
            found += 1
            # Redundancy parameters stay at the seed's values, which are those of Newton's result.
            result = solve_ik(robot, target, task=task, q_seed=q, respect_limits=False)
            gaps = [np.abs((s.q - q + np.pi) % (2 * np.pi) - np.pi).max() for s in result.solutions]
            assert min(gaps) < 1e-6, (q.tolist(), gaps)
    assert found >= 60


def _round_trips(
    robot_id: str, task: str, seed: int, count: int, narrowed: bool
) -> tuple[int, float, float, list]:
    """(unsolved, median and worst FK error, the first few unsolved) of `count` random in-limit configurations."""
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(seed)
    width = robot.upper - robot.lower
    errors, unsolved = np.zeros(count), []
    limits = None
    for i in range(count):
        low, high = robot.lower, robot.upper
        if narrowed:
            share = rng.uniform(0.1, 0.4, robot.n)
            low = robot.lower + rng.random(robot.n) * (1 - share) * width
            high = low + share * width
            limits = np.c_[low, high].tolist()
        q = rng.uniform(low, high)
        target = kin.fk(robot, q)
        result = solve_ik(robot, target, task=task, q_seed=robot.random_q(rng), limits=limits)
        if result.status is not Status.SOLVED:
            unsolved.append((low.tolist(), high.tolist(), q.tolist(), result.reason))
            continue
        found = result.q
        assert not (found < low).any()
        assert not (found > high).any()
        T = kin.fk(robot, found)
        error = np.abs(T[:, :3, 3] - target[:3, 3]).max()
        if task != "position":
            columns = slice(0, 3) if task == "pose" else slice(2, 3)
            error = max(error, np.abs(T[:, :3, columns] - target[:3, columns]).max())
        errors[i] = error
    return len(unsolved), float(np.median(errors)), float(errors.max()), unsolved[:3]


@pytest.mark.slow
@pytest.mark.parametrize("narrowed", [False, True], ids=["printed limits", "limits cut to 10-40 %"])
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_a_million_round_trips(robot_id, task, narrowed):
    """All are solved, with FK errors ≤ 1e-9, typically 1e-14."""
    workers = os.cpu_count() or 1
    share = [POSES // workers + (k < POSES % workers) for k in range(workers)]
    # A new interpreter for each: forking a process that has threads is not safe.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        jobs = [pool.submit(_round_trips, robot_id, task, 1000 + k, n, narrowed) for k, n in enumerate(share)]
        parts = [job.result() for job in jobs]
    unsolved = sum(part[0] for part in parts)
    typical, worst = float(np.median([part[1] for part in parts])), max(part[2] for part in parts)
    kind = f"{robot_id} {task}, {'narrowed' if narrowed else 'printed'} limits"
    print(f"\n{kind}: {POSES} poses, {unsolved} unsolved, typical {typical:.1e}, worst {worst:.1e}")
    assert unsolved == 0, [case for part in parts for case in part[3]]
    assert worst <= 1e-9
    assert typical <= 1e-13
