"""A motion as a table: equal steps of time, and the lines of a CSV file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kin.errors import InputError, finite_number
from kin.transforms import Array, wxyz_from_rotation

AT_ONCE = 500  # samples of a piece, so that a long motion is never in memory as text


def step_times(duration: float, rate: float) -> Array:
    """Times ``(k,)`` at `rate` per second, from 0 to the end, which is one of them."""
    expected = "a number above 0: samples per second"
    if not finite_number("rate", rate, expected) > 0.0:
        raise InputError("rate", rate, expected)
    steps = np.arange(int(duration * rate * (1.0 + 1e-12)) + 1) / rate
    return steps if duration - steps[-1] < 1e-9 else np.append(steps, duration)


def columns(n: int, grips: bool = False) -> list[str]:
    """The names of the columns for an arm with n joints; `grips`: whether its gripper moves."""
    names = [f"{kind}{i}" for kind in ("q", "qd", "qdd") for i in range(1, n + 1)]
    return ["t", *names, "x", "y", "z", "qw", "qx", "qy", "qz", "tool_speed", *["gripper"] * grips]


def lines(t: Array, joints: tuple[Array, Array, Array], T: Array, last: Sequence[Array]) -> str:
    """The lines of samples; the cell of what is not known (NaN) is empty.

    Args:
        t: times ``(k,)``.
        joints: values, speeds and accelerations ``(k, n)``.
        T: poses of the tool ``(k, 4, 4)``.
        last: the last columns ``(k,)``: speed of the tool and, where the gripper moves, how far it is open.
    """
    parts = [t[:, None], *joints, T[:, :3, 3], wxyz_from_rotation(T[:, :3, :3]), np.stack(last, axis=1)]
    rows = np.hstack(parts).tolist()
    return "".join(",".join("" if value != value else repr(value) for value in row) + "\n" for row in rows)
