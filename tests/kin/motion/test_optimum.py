"""Times of paths against the best possible ones, and paths that are hard to time."""

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import linprog

import kin
from kin.motion.geometry.curves import natural
from kin.motion.geometry.splines import parted
from kin.motion.timing.timed import JointPath, TimedPath, finer_ends, timed

ARMS = tuple(kin.files.classic_robots())

# Paths on which other programs failed (problem_suite_1.yaml of toppra, MIT): waypoints, velocity, acceleration.
HARD = [
    (np.linspace(-0.00038593, 0.00425594, 10)[:, None] * np.ones(3), [100.0] * 3, [100.0] * 3),
    (np.array([[0, 0, 0], [0, 1e-5, 0], [0, 0, 0]]), [100.0] * 3, [100.0] * 3),
    (
        np.linspace(-3.85929168e-04, 1.16383433e-03, 10)[:, None] * np.ones(3),
        [1000.0] * 3,
        [1000.0, 2000.0, 1000.0],
    ),
    # One joint that rests, one that hardly moves, and a path that returns.
    (np.array([[0, 0, 1], [1e-9, 1, 1], [0, 2, 1], [0, 1, 1]]), [1.0] * 3, [2.0] * 3),
    (np.array([[0, 0, 0], [1, 1e-12, 0], [2, 0, 1e-12]]), [1.0] * 3, [2.0] * 3),
    (np.array([[0, 0, 0], [1e-7, 0, 0], [1, 1, 1]]), [1.0, 1e-3, 1e3], [1.0, 1e3, 1e-3]),
]


def never():
    pass


def best(path, finer):
    """Seconds by a linear program: the sum of ṡ² on a finer grid is as large as the limits allow."""
    path = finer_ends(path)
    knots, joints = parted(path.knots, path.joints, np.full(len(path.joints), finer))
    limits, most = np.repeat(path.limits, finer, axis=0), np.repeat(path.most, finer)
    k, h = len(joints), np.diff(knots)
    cap = np.full(k + 1, np.inf)
    blocks = []
    for end in (0, 1):
        d = h[:, None] * end
        slope = joints[..., 1] + d * (2 * joints[..., 2] + 3 * d * joints[..., 3])
        bend = 2 * joints[..., 2] + 6 * d * joints[..., 3]
        own = np.minimum(((limits[..., 0] / np.maximum(np.abs(slope), 1e-12)) ** 2).min(axis=1), most)
        cap[end : k + end] = np.minimum(cap[end : k + end], own)
        first, second = -slope / (2 * h[:, None]) + bend * (1 - end), slope / (2 * h[:, None]) + bend * end
        for j in range(joints.shape[1]):
            scale = limits[:, j, 1]
            blocks.append(
                sparse.diags_array([first[:, j] / scale, second[:, j] / scale], offsets=[0, 1], shape=(k, k + 1))
            )
    rows = sparse.vstack(blocks)
    cap[[0, -1]] = 0.0
    A, b = sparse.vstack([rows, -rows]).tocsr(), np.ones(2 * rows.shape[0])
    found = linprog(
        -np.ones(k + 1), A_ub=A, b_ub=b, bounds=np.stack([np.zeros(k + 1), cap], axis=1), method="highs-ds"
    )
    assert found.status == 0
    root = np.sqrt(np.maximum(found.x, 0.0))
    return float((2 * h / (root[:-1] + root[1:])).sum())


@pytest.mark.parametrize("jerk_limited", [False, True])
@pytest.mark.parametrize("case", HARD)
def test_hard_paths_are_timed_within_their_limits(case, jerk_limited):
    rows, velocity, acceleration = case
    knots = np.linspace(0.0, 1.0, len(rows))
    row = np.stack([velocity, acceleration, 10.0 * np.array(acceleration)], axis=1)
    pieces = natural(knots, np.array(rows, dtype=float))
    knots, pieces = parted(knots, pieces, np.full(len(pieces), 60))
    path = JointPath(
        knots, pieces, np.broadcast_to(row, (len(pieces), *row.shape)).copy(), np.full(len(pieces), 1e9)
    )
    found = timed(path, jerk_limited, never)
    assert 0.0 < found.duration < 1e4
    times = (found.breaks[:-1, None] + np.diff(found.breaks)[:, None] * np.linspace(1e-9, 1 - 1e-9, 9)).ravel()
    peaks = np.abs(found.at(times)).max(axis=1)[1:].T / row
    assert peaks[:, : 3 if jerk_limited else 2].max() <= 1 + 1e-9
    assert found.at(np.array([found.duration]))[0, 0] == pytest.approx(rows[-1], abs=1e-9)
    if not jerk_limited:
        assert found.duration <= 1.01 * best(path, 4)


def lines(robot, seed):
    """Two lines that are blended, and a start, near home."""
    rng = np.random.default_rng(seed)
    q = [
        robot.clip(robot.q_home + rng.normal(0, 0.15, robot.n) * np.where(robot.revolute, 1, 0.1))
        for _ in range(3)
    ]
    targets = [kin.motion.PoseTarget.of(kin.fk(robot, each)) for each in q[1:]]
    return [kin.motion.Lin(targets[0], blend=0.02), kin.motion.Lin(targets[1], speed=0.6)], q[0]


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS)
def test_times_are_within_one_percent_of_a_linear_program_on_a_finer_grid(arm):
    robot, compared = kin.get_robot(arm), 0
    for seed in range(12):
        segments, q = lines(robot, seed)
        motion = kin.plan_motion(robot, kin.motion.Program(segments, jerk_limited=False), q)
        for piece in motion.pieces:
            assert isinstance(piece, TimedPath)
            compared += 1
            ratio = piece.duration / best(piece.path, 4)
            assert 1 - 1e-3 < ratio <= 1.01, (seed, ratio)
        if compared >= 3:
            break
    assert compared
