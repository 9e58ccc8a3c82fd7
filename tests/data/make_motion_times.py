"""Writes motion-times.json: times of motions computed by other libraries, for tests/kin/motion.

Needs what the tests do not: ``pip install ruckig toppra`` (both MIT), in an environment of its own.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint
from ruckig import InputParameter, Result, Ruckig, Trajectory
from scipy.interpolate import CubicSpline


def joint_motions(count: int = 120) -> list[dict[str, object]]:
    """Rest to rest for some joints, with limits over several magnitudes, so that every phase is empty in some."""
    rng = np.random.default_rng(20)
    found = []
    for _ in range(count):
        n = int(rng.integers(1, 8))
        start, end = rng.uniform(-3.0, 3.0, (2, n))
        if rng.random() < 0.3:
            end = start + (end - start) * 10.0 ** rng.uniform(-4.0, 0.0)
        velocity, acceleration, jerk = 10.0 ** rng.uniform([[-1.0], [-0.5], [0.0]], [[1.0], [1.5], [3.0]], (3, n))
        task = InputParameter(n)
        task.current_position, task.target_position = start.tolist(), end.tolist()
        task.max_velocity, task.max_acceleration = velocity.tolist(), acceleration.tolist()
        task.max_jerk = jerk.tolist()
        trajectory = Trajectory(n)
        assert Ruckig(n).calculate(task, trajectory) in (Result.Working, Result.Finished)
        rows = {"start": start, "end": end, "velocity": velocity, "acceleration": acceleration, "jerk": jerk}
        found.append({key: value.tolist() for key, value in rows.items()} | {"seconds": trajectory.duration})
    return found


def paths(count: int = 24) -> list[dict[str, object]]:
    """Cubic splines with limits of velocity and acceleration, timed by toppra on 4000 intervals."""
    rng = np.random.default_rng(21)
    found = []
    for _ in range(count):
        n, k = int(rng.integers(1, 8)), int(rng.integers(4, 9))
        knots, rows = np.linspace(0.0, 1.0, k), rng.uniform(-1.5, 1.5, (k, n))
        spline = CubicSpline(knots, rows, bc_type="natural")
        velocity, acceleration = rng.uniform(0.5, 4.0, n), rng.uniform(1.0, 15.0, n)
        path = toppra.SplineInterpolator(knots, rows, bc_type="natural")
        limits = [
            toppra.constraint.JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
            toppra.constraint.JointAccelerationConstraint(
                np.stack([-acceleration, acceleration], axis=1), toppra.constraint.DiscretizationType.Interpolation
            ),
        ]
        grid = np.linspace(0.0, 1.0, 4001)
        solver = toppra.algorithm.TOPPRA(limits, path, gridpoints=grid, solver_wrapper="seidel")
        _, speeds, _ = solver.compute_parameterization(0.0, 0.0)
        seconds = float((2.0 * np.diff(grid) / (speeds[:-1] + speeds[1:])).sum())
        pieces = np.moveaxis(spline.c[::-1], 0, -1)
        data = {"knots": knots, "pieces": pieces, "velocity": velocity, "acceleration": acceleration}
        found.append({key: value.tolist() for key, value in data.items()} | {"seconds": seconds})
    return found


if __name__ == "__main__":
    path = Path(__file__).with_name("motion-times.json")
    path.write_text(json.dumps({"joint_motions": joint_motions(), "paths": paths()}) + "\n", encoding="utf-8")
