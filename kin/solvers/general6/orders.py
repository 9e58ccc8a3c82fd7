"""The same arm read in another order, and its solutions as those of the arm itself.

- From tool to base: its pose is the inverse of the arm's, and its joints come in the opposite order. With ``T = C0
  Rz(q1) C1 … Rz(q6) C6`` and ``Rz(−q) = Rx(π) Rz(q) Rx(π)`` that is an arm again.
- A joint that slides along the axis of its neighbour, or next to another slide, may change places with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kin.axes import Lines, frame_of, inverse, is_zero, lines_of, perpendicular_to
from kin.dh.tables import table_of_chain
from kin.robot import Robot
from kin.solvers.contract import BatchKernels
from kin.transforms import Array

_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])  # Rx(π)
_MOST = 6  # orders of one arm


class Reading(NamedTuple):
    """An arm in another order.

    Attributes:
        robot: that arm.
        order: for each of its joints the index of the joint in the arm itself.
        inverted: whether its poses are the inverse ones.
    """

    robot: Robot
    order: tuple[int, ...]
    inverted: bool

    @property
    def is_itself(self) -> bool:
        """Whether nothing differs."""
        return not self.inverted and self.order == tuple(sorted(self.order))

    def target(self, T: Array) -> Array:
        """The poses ``(…, 4, 4)`` for the other arm."""
        if not self.inverted:
            return np.ascontiguousarray(T)
        back = np.zeros_like(T)
        R = np.swapaxes(T[..., :3, :3], -1, -2)
        back[..., :3, :3], back[..., 3, 3] = R, 1.0
        back[..., :3, 3] = -(R @ T[..., :3, 3:])[..., 0]
        return back

    def kernels(self, form: BatchKernels) -> BatchKernels:
        """The batch kernels of the arm from those of the other."""
        if self.is_itself:
            return form
        order = list(self.order)

        def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
            rows = np.empty_like(out)
            form.many(params, self.target(T), values, near[order].copy(), rows)
            out[..., order] = rows

        return BatchKernels.of_many(form.params, many)


def readings(robot: Robot) -> Iterator[Reading]:
    """The arm itself, the arm from tool to base, and orders in which slides have changed places."""
    same = tuple(range(robot.n))
    yield Reading(robot, same, False)
    yield Reading(_backwards(robot), same[::-1], True)
    lines = lines_of(robot, as_counted=True)
    for order in _orders(robot, lines)[1:]:
        yield Reading(_in_order(robot, lines, order), order, False)


def _orders(robot: Robot, lines: Lines) -> list[tuple[int, ...]]:
    """Orders of the joints that do not change a pose, the given one first."""
    turns, found = robot.revolute, [tuple(range(robot.n))]
    for order in found:
        for place, (i, k) in enumerate(pairwise(order)):
            both_slide, both_turn = not (turns[i] or turns[k]), turns[i] and turns[k]
            parallel = is_zero(*np.cross(lines.z[i], lines.z[k]))
            other = (*order[:place], k, i, *order[place + 2 :])
            if not both_turn and (both_slide or parallel) and other not in found and len(found) < _MOST:
                found.append(other)
    return found


def _in_order(robot: Robot, lines: Lines, order: tuple[int, ...]) -> Robot:
    """The arm with its joints in this order."""
    frames = [frame_of(perpendicular_to(lines.z[i]), lines.z[i], lines.points[i]) for i in order]
    steps = [inverse(a) @ b for a, b in pairwise([np.eye(4), *frames, lines.T_base_tool])]
    return _of_steps(robot, order, steps)


def _backwards(robot: Robot) -> Robot:
    """The arm from tool to base."""
    lines = lines_of(robot, as_counted=True)
    frames = [frame_of(perpendicular_to(z), z, point) for z, point in zip(lines.z, lines.points, strict=True)]
    frames = [np.eye(4), *frames, lines.T_base_tool]
    steps = [_HALF_TURN @ inverse(b) @ a @ _HALF_TURN for a, b in pairwise(frames)][::-1]
    steps[0], steps[-1] = _HALF_TURN @ steps[0], steps[-1] @ _HALF_TURN
    return _of_steps(robot, tuple(range(robot.n))[::-1], steps)


def _of_steps(robot: Robot, order: tuple[int, ...], steps: list[Array]) -> Robot:
    """An arm of the robot's joints in this order, with these transforms before, between and after them."""
    table = table_of_chain(tuple(robot.joints[i] for i in order), steps)
    home = tuple(robot.home[i] for i in order)
    return replace(robot, convention="standard", rows=table.rows, home=home, base=table.base, tool=table.tool)
