"""The tool's pose in numbers, with fixed decimals in tabular figures: digits change but never move."""

from __future__ import annotations

import math
from collections.abc import Sequence

import viser

from app.viewer.views.templates import render
from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units

ANGLES = "R = Rz(yaw)·Ry(pitch)·Rx(roll)"


def roll_pitch_yaw(R: Array) -> tuple[float, float, float]:
    """Angles in radians with ``R = Rz(yaw) Ry(pitch) Rx(roll)``; roll is 0 where pitch is ±90°."""
    level = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], level)
    if level < 1e-9:
        return 0.0, pitch, math.atan2(-R[0, 1], R[1, 1])
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def html(T_base_tool: Array, units: Units) -> str:
    """Position, roll/pitch/yaw and quaternion of a pose ``(4, 4)`` as a small table."""
    lengths, angles = units.lengths, units.angles
    position = (lengths.scale * T_base_tool[:3, 3]).tolist()
    turned = [angles.scale * _half_turn_positive(a) for a in roll_pitch_yaw(T_base_tool[:3, :3])]
    quaternion = wxyz_from_rotation(T_base_tool[:3, :3]).tolist()
    rows = (
        (
            "position",
            "x y z",
            "Tool point in the base frame",
            _numbers(position, lengths.decimals(1)),
            lengths.name,
        ),
        ("angles", "roll pitch yaw", ANGLES, _numbers(turned, angles.decimals(1)), angles.name),
        ("quaternion", "w x y z", "Quaternion, scalar first", _numbers(quaternion, 3), ""),
    )
    return render("panel/readout", rows=rows)


def _half_turn_positive(angle: float) -> float:
    """The angle, but +180° for −180° to the tenth that is shown: the same sign in all units, and no flicker."""
    return abs(angle) if round(math.degrees(angle), 1) == -180.0 else angle


def _numbers(values: Sequence[float], decimals: int) -> list[str]:
    texts = (f"{value:.{decimals}f}" for value in values)
    # A zero may have either sign and must not flicker.
    return [(t.lstrip("-") if float(t) == 0.0 else t).replace("-", "−") for t in texts]


class PoseReadout:
    """Shows the tool's pose, and below it the form for a typed target, which ``static/input.js`` opens."""

    def __init__(self, gui: viser.GuiApi, T_base_tool: Array, units: Units) -> None:
        self._html = gui.add_html(html(T_base_tool, units))
        gui.add_html(render("panel/typed_target"))

    def show(self, T_base_tool: Array, units: Units) -> None:
        """Replace the numbers."""
        self._html.content = html(T_base_tool, units)
