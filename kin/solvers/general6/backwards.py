"""An arm from its tool to its base, and its solutions as those of the arm itself."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from kin.axes import frame_of, inverse, lines_of, perpendicular_to
from kin.dh import table_of_chain
from kin.robot import Robot
from kin.solvers.contract import BatchKernels
from kin.solvers.reversed import WrappedKernels
from kin.transforms import Array

_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])  # Rx(π)


def backwards(robot: Robot) -> Robot:
    """The arm from tool to base: its pose is the inverse of the arm's, its joints come in the opposite order.

    ``T = C0 Rz(q1) C1 … Rz(q6) C6``, and ``Rz(−q) = Rx(π) Rz(q) Rx(π)``.
    """
    lines = lines_of(robot, as_counted=True)
    frames = [frame_of(perpendicular_to(z), z, point) for z, point in zip(lines.z, lines.points, strict=True)]
    frames = [np.eye(4), *frames, lines.T_base_tool]
    steps = [_HALF_TURN @ inverse(b) @ a @ _HALF_TURN for a, b in pairwise(frames)][::-1]
    steps[0], steps[-1] = _HALF_TURN @ steps[0], steps[-1] @ _HALF_TURN
    table = table_of_chain(robot.joints[::-1], steps)
    home = robot.home[::-1]
    return replace(robot, convention="standard", rows=table.rows, home=home, base=table.base, tool=table.tool)


def turned_round(form: BatchKernels) -> BatchKernels:
    """The batch kernels of an arm from those of the arm from tool to base."""

    def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
        back = np.zeros_like(T)
        back[:, :3, :3] = np.swapaxes(T[:, :3, :3], 1, 2)
        back[:, :3, 3] = -(back[:, :3, :3] @ T[:, :3, 3:])[..., 0]
        back[:, 3, 3] = 1.0
        rows = np.empty_like(out)
        form.many(params, back, values, near[::-1].copy(), rows)
        out[:] = rows[..., ::-1]

    def one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
        many(params, T[None], np.array([value]), near, out[None])
        return bool(np.isfinite(T).all())

    return WrappedKernels(form.params, one, many, turned_round, form)
