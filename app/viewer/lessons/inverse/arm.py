"""Which arms the lesson can derive, and the numbers that their formulas need.

The lesson's frame has its z axis along axis 1 and its origin at the arm's base. Where axis 1 is vertical there, it
is the base frame of the arm. The angles θ of the formulas are counted from where links are in line:
θ = sense q + offset.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

import kin
from app.viewer.lessons.inverse.sheet import StepKey
from app.viewer.lessons.postures.planar import is_planar
from kin import Robot
from kin.angles import wrapped
from kin.axes import inverse, is_zero
from kin.solvers import closed_form_of
from kin.solvers.contract import ClosedForm
from kin.solvers.reversed import ReversedJoints
from kin.solvers.slide6 import Slide6
from kin.solvers.srs7 import Srs7
from kin.solvers.wrist5 import Wrist5
from kin.solvers.wrist6 import Wrist6
from kin.solvers.wrist6.geometry import BASE, TOOL
from kin.transforms import Array

Family = Literal["planar", "wrist5", "wrist6", "srs7"]


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm that the lesson can derive.

    Attributes:
        T_base_lesson: the lesson's frame ``(4, 4)``.
        wrist: the wrist centre ``(3,)`` in the frame of the tool, and R_wrist_tool⁻¹ ``(3, 3)``.
        sense, offset: ``(n,)``; θ = sense q + offset.
        lengths: of the links, by their names in the formulas.
        reference: direction ``(3,)`` from which ψ is counted where the wrist centre is on axis 1.
        names: of the branches, one per row of signs; () if they are named otherwise.
    """

    robot: Robot
    family: Family
    T_base_lesson: Array
    wrist: Array
    R_tool_wrist: Array
    sense: Array
    offset: Array
    lengths: dict[str, float]
    reference: Array
    names: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[StepKey, ...]:
        """The steps of its derivation."""
        if self.family == "planar":
            return ("centre", "elbow", "theta1", *(("last",) if self.robot.n == 3 else ()), "joints")
        if self.family == "srs7":
            return "centre", "elbow", "circle", "shoulder", "wrist", "joints"
        return "centre", "theta1", "elbow", "theta2", "wrist", "joints"

    @property
    def splits(self) -> int:
        """How many signs are chosen."""
        return 1 if self.family == "planar" else 3

    @property
    def straight_tool(self) -> bool:
        """Whether the wrist centre is on the tool's z axis, with the axes of both frames parallel."""
        return is_zero(self.wrist[0], self.wrist[1]) and is_zero(*(self.R_tool_wrist - np.eye(3)).ravel())

    def angles(self, q: Array) -> Array:
        """The angles of the formulas ``(n,)`` at joint values."""
        return np.asarray(self.sense * q + self.offset)

    def joints(self, theta: Array) -> Array:
        """Joint values ``(n,)`` in (−π, π] of the angles of the formulas."""
        q = self.sense * (theta - self.offset)
        return np.asarray(wrapped(q))

    def rotation(self, theta: Array) -> Array:
        """R ``(3, 3)`` from the lesson's frame to the tool, by forward kinematics."""
        T = kin.fk(self.robot, self.joints(theta))
        return np.asarray(self.T_base_lesson[:3, :3].T @ T[:3, :3] @ self.R_tool_wrist)


@lru_cache(maxsize=64)
def arm_of(robot: Robot) -> Arm | None:
    """What the lesson needs to know of an arm; None if it has no derivation for it."""
    if is_planar(robot):
        lengths = {f"l{i + 1}": float(row.a) for i, row in enumerate(robot.rows)}
        wrist = np.array([-lengths.get("l3", 0.0), 0.0, 0.0])
        zero, one = np.zeros(robot.n), np.ones(robot.n)
        return Arm(robot, "planar", np.eye(4), wrist, np.eye(3), one, zero, lengths, np.eye(3)[0])
    found = closed_form_of(robot)
    sense = np.ones(robot.n)
    form: ClosedForm | None = found
    if isinstance(found, ReversedJoints):
        form = found.form
        sense[list(found.joints)] = -1.0
    names = () if found is None else found.branches
    if isinstance(form, Slide6):
        return None
    match form:
        case Wrist5(geometry=g):
            lengths = {"a1": g.a1, "a2": g.a2, "d4": g.d4, "d6": g.d6}
            tool = np.eye(4)
            tool[2, 3] = -g.d6
            return _placed(robot, "wrist5", (inverse(g.inverse_base), tool), (sense, g.offset), lengths, names)
        case Wrist6(geometry=w):
            lengths = {"a1": w.a1, "a2": w.a2, "f": w.f, "b": w.beside}
            base, tool = (np.vstack([w.params[k : k + 12].reshape(3, 4), np.eye(4)[3]]) for k in (BASE, TOOL))
            return _placed(robot, "wrist6", (inverse(base), tool), (sense * w.sign, w.offset), lengths, names)
        case Srs7(geometry=s):
            lengths = {"d3": s.d3, "d5": s.d5}
            poses = inverse(s.inverse_base), s.inverse_tool
            return _placed(robot, "srs7", poses, (sense, s.offset), lengths, names)
    return None


def _placed(
    robot: Robot,
    family: Family,
    poses: tuple[Array, Array],
    joints: tuple[Array, Array],
    lengths: dict[str, float],
    names: tuple[str, ...],
) -> Arm:
    """The arm in the lesson's frame.

    Args:
        poses: the base of the closed form, which is at the height of the shoulder, and the inverse of its tool.
        joints: senses and offsets.
    """
    (base, tool), (sense, offset) = poses, joints
    own, offset = robot.T_world_base, offset.copy()
    frame = base.copy()
    if (base[2, 2] > 1.0 - 1e-12 and own[2, 2] > 1.0 - 1e-12) or np.allclose(base[:3, 2], own[:3, 2], atol=1e-12):
        frame[:3, :3] = own[:3, :3]
    x = frame[:3, :3].T @ base[:3, 0]
    offset[0] += math.atan2(x[1], x[0])
    d1 = float(base[:3, 2] @ (base[:3, 3] - own[:3, 3]))
    frame[:3, 3] = base[:3, 3] - d1 * base[:3, 2]
    wrist, R = tool[:3, 3], tool[:3, :3]
    if robot.n > 5 and np.allclose(R[2], np.eye(3)[2], atol=1e-12):
        # A turn about the last axis is as well counted with the last joint.
        offset[-1] -= math.atan2(R[1, 0], R[0, 0])
        R = np.eye(3)
    offset = np.where(np.abs(wrapped(offset)) < 1e-12, 0.0, wrapped(offset))
    lengths = {name: 0.0 if is_zero(length) else length for name, length in {**lengths, "d1": d1}.items()}
    return Arm(robot, family, frame, wrist, R, sense, offset, lengths, x, names)
