"""The tool's pose in numbers: fixed decimals in tabular figures, so that digits change but never move."""

from __future__ import annotations

import math

import viser

from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units


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
    turned = [angles.scale * a for a in roll_pitch_yaw(T_base_tool[:3, :3])]
    quaternion = wxyz_from_rotation(T_base_tool[:3, :3]).tolist()
    rows = (
        ("x y z", position, lengths.decimals(1), lengths.name),
        ("roll pitch yaw", turned, angles.decimals(1), angles.name),
        ("wxyz", quaternion, 3, ""),
    )
    body = "".join(
        f'<tr><th style="text-align:left;font-weight:500;opacity:.75;padding:0">{name}</th>'
        f'<td style="text-align:right;padding:0;white-space:nowrap"{"" if unit else " colspan=2"}>'
        + "".join(_cell(v, decimals, 4.6 if unit else 3.7) for v in values)
        + (
            f'</td><td style="padding:0 0 0 .3em;width:1.9em;opacity:.75">{unit}</td></tr>'
            if unit
            else "</td></tr>"
        )
        for name, values, decimals, unit in rows
    )
    return (
        '<table aria-label="tool pose" style="width:calc(100% - 2em);margin:.1em 1em .8em;'
        f'border-collapse:collapse;font-size:.78em;line-height:1.55;font-variant-numeric:tabular-nums">{body}</table>'
    )


def _cell(value: float, decimals: int, width: float) -> str:
    text = f"{value:.{decimals}f}"
    if float(text) in (0.0, -180.0):
        text = text.lstrip("-")
    return f'<span style="display:inline-block;width:{width}em">{text.replace("-", "−")}</span>'


class PoseReadout:
    """Shows the tool's pose."""

    def __init__(self, gui: viser.GuiApi, T_base_tool: Array, units: Units) -> None:
        self._html = gui.add_html(html(T_base_tool, units))

    def show(self, T_base_tool: Array, units: Units) -> None:
        """Replace the numbers."""
        self._html.content = html(T_base_tool, units)
