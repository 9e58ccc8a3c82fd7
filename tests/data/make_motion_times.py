"""Writes motion-times.json: times of motions computed by other libraries, for tests/kin/motion.

Needs what the tests do not: ``pip install ruckig toppra`` (both MIT), in an environment of its own.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory


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


if __name__ == "__main__":
    path = Path(__file__).with_name("motion-times.json")
    path.write_text(json.dumps({"joint_motions": joint_motions()}) + "\n", encoding="utf-8")
