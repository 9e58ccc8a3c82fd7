"""Three angles for a rotation: the twelve sequences of axes, each about moving or about fixed axes.

``Convention("zyx", False)`` with angles (α, β, γ) turns by α about z, by β about the new y, and by γ about the
newest x: ``R = Rz(α) Ry(β) Rx(γ)``. About fixed axes each turn multiplies from the left:
``R = Rx(γ) Ry(β) Rz(α)``. So fixed axes in the reverse order, with the angles in the reverse order, give the same
rotation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from app.viewer.scene.chain import rotation
from kin.transforms import Array, wxyz_from_rotation

LOCKED = 1e-9  # sine or cosine of the second angle at gimbal lock
NEAR = math.radians(10.0)

Angles = tuple[float, float, float]


@dataclass(frozen=True)
class Convention:
    """One of the 24 conventions.

    Attributes:
        axes: of the first, second and third turn, such as ``"zyx"``.
        fixed: whether they are those of the fixed frame, else those of the frame that turns.
    """

    axes: str
    fixed: bool

    @property
    def is_proper(self) -> bool:
        """Whether the first axis comes again: Euler angles in the narrow sense, else Tait–Bryan angles."""
        return self.axes[0] == self.axes[2]

    @property
    def key(self) -> str:
        """Short name, in links."""
        return f"{self.axes}-{'fixed' if self.fixed else 'moving'}"

    @property
    def title(self) -> str:
        """Name in the list."""
        return f"{'-'.join(self.axes.upper())} {'fixed' if self.fixed else 'moving'}"

    @property
    def twin(self) -> Convention:
        """The convention of the other kind that gives the same rotation with the angles reversed."""
        return Convention(self.axes[::-1], not self.fixed)

    @property
    def name(self) -> str:
        """What textbooks call it, and who uses it."""
        return NAMES.get(self.key) or ("Proper Euler angles" if self.is_proper else "Tait–Bryan angles")

    @property
    def formula(self) -> str:
        """R as a product."""
        turns = [f"R{axis}({symbol})" for axis, symbol in zip(self.axes, "αβγ", strict=True)]
        return "R = " + " ".join(reversed(turns) if self.fixed else turns)

    def rotation(self, angles: Angles) -> Array:
        """R ``(3, 3)`` of three angles in radians, in the order of the turns."""
        first, second, third = (rotation(index(a), v)[:3, :3] for a, v in zip(self.axes, angles, strict=True))
        return third @ second @ first if self.fixed else first @ second @ third

    def angles(self, R: Array) -> Angles:
        """Angles of a rotation ``(3, 3)``: the second one from −90° to 90°, or from 0 to 180° for proper Euler.

        At gimbal lock, the third turn of moving axes, or the first of fixed ones, is zero.
        """
        if self.fixed:
            c, b, a = self.twin.angles(R)
            return a, b, c
        i, j = index(self.axes[0]), index(self.axes[1])
        k = 3 - i - j
        sign = 1.0 if (j - i) % 3 == 1 else -1.0
        if self.is_proper:
            off = math.hypot(R[i, j], R[i, k])
            b = math.atan2(off, R[i, i])
            a, c = math.atan2(R[j, i], -sign * R[k, i]), math.atan2(R[i, j], sign * R[i, k])
        else:
            off = math.hypot(R[i, i], R[i, j])
            b = math.atan2(sign * R[i, k], off)
            a, c = math.atan2(-sign * R[j, k], R[k, k]), math.atan2(-sign * R[i, j], R[i, i])
        if off < LOCKED:
            # R Rj(−b) is a turn about axis i by a ± c.
            turned = R @ rotation(j, -b)[:3, :3]
            x, y = (i + 1) % 3, (i + 2) % 3
            a, c = math.atan2(turned[y, x], turned[x, x]), 0.0
        return a, b, c

    def other(self, angles: Angles) -> Angles:
        """The second set of angles of the same rotation."""
        a, b, c = angles
        half = math.pi
        found = (a + half, -b if self.is_proper else half - b, c + half)
        return (wrapped(found[0]), wrapped(found[1]), wrapped(found[2]))

    def axes_now(self, angles: Angles) -> Array:
        """The axes ``(3, 3)``, as rows, about which R turns while one of the angles changes."""
        a, b, c = ((index(axis), value) for axis, value in zip(self.axes, angles, strict=True))
        first, second, third = (c, b, a) if self.fixed else (a, b, c)
        R1 = rotation(*first)[:3, :3]
        R12 = R1 @ rotation(*second)[:3, :3]
        rows = [np.eye(3)[first[0]], R1[:, second[0]], R12[:, third[0]]]
        return np.array(rows[::-1] if self.fixed else rows)

    def room(self, angles: Angles) -> float:
        """How far the second angle is from gimbal lock, in radians."""
        b = angles[1] if self.is_proper else angles[1] + math.pi / 2
        return abs(math.remainder(b, math.pi))


NAMES = {
    "xyz-fixed": "Roll pitch yaw about fixed axes: this page, its REST interface, URDF and ROS",
    "zyx-moving": "Yaw pitch roll about moving axes: aerospace; the same as roll pitch yaw about fixed axes",
    "xyz-moving": "Cardan angles",
    "zxz-moving": "Euler’s own angles, as in textbooks of mechanics",
    "zyz-moving": "Euler angles of many textbooks of robotics",
}
SEQUENCES = tuple("".join(axes) for axes in product("xyz", repeat=3) if axes[0] != axes[1] and axes[1] != axes[2])
CONVENTIONS = tuple(Convention(axes, fixed) for fixed in (True, False) for axes in SEQUENCES)
PAGE = Convention("xyz", True)


def index(axis: str) -> int:
    """0, 1 or 2 for x, y or z."""
    return "xyz".index(axis)


def wrapped(angle: float) -> float:
    """The angle from −π to π."""
    return math.remainder(angle, 2.0 * math.pi)


def axis_angle(R: Array) -> tuple[Array, float]:
    """Axis ``(3,)`` and angle from 0 to π of a rotation ``(3, 3)``; z for none."""
    w, *v = wxyz_from_rotation(R).tolist()
    sine = math.hypot(*v)
    if sine < 1e-12:
        return np.array([0.0, 0.0, 1.0]), 0.0
    return np.array(v) / sine, 2.0 * math.atan2(sine, w)
