"""The tool's pose in numbers, with fixed decimals in tabular figures: digits change but never move."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import viser

from app.viewer.frames import TITLES, Frames
from app.viewer.panel import update_html
from app.viewer.views.templates import render
from app.viewer.viser_patches import show_content
from kin.frames import WORLD
from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units, fixed

ANGLES = "R = Rz(yaw)·Ry(pitch)·Rx(roll)"


def roll_pitch_yaw(R: Array) -> tuple[float, float, float]:
    """Angles in radians with ``R = Rz(yaw) Ry(pitch) Rx(roll)``; roll is 0 where pitch is ±90°."""
    level = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], level)
    if level < 1e-9:
        return 0.0, pitch, math.atan2(-R[0, 1], R[1, 1])
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def html(
    T_frame_tool: Array, units: Units, T_frame_target: Array | None = None, frame: str = WORLD,
    withheld: Collection[str] = (),
) -> str:  # fmt: skip
    """Position, roll/pitch/yaw and quaternion of a pose ``(4, 4)`` as a small table.

    Args:
        T_frame_target: a target that the tool has missed, from which the form for a typed target starts.
        frame: name of the frame in which both are.
        withheld: rows that an open question asks for: position, angles, quaternion.
    """
    lengths, angles = units.lengths, units.angles
    titles = (
        ("position", "x y z", f"Tool point in the frame {frame}", lengths.name),
        ("angles", "roll pitch yaw", ANGLES, angles.name),
        ("quaternion", "w x y z", "Quaternion, scalar first", ""),
    )
    tool = _parts(T_frame_tool, units)
    target: Sequence[Sequence[str]] = ((),) * 3 if T_frame_target is None else _parts(T_frame_target, units)
    rows = [(*title, numbers, wanted) for title, numbers, wanted in zip(titles, tool, target, strict=True)]
    return render("panel/readout", rows=rows, frame=frame, withheld=withheld)


def _parts(T: Array, units: Units) -> tuple[list[str], list[str], list[str]]:
    """Position, roll-pitch-yaw and quaternion of a pose as texts."""
    lengths, angles = units.lengths, units.angles
    turned = [angles.scale * _half_turn_positive(a) for a in roll_pitch_yaw(T[:3, :3])]
    return (
        _numbers((lengths.scale * T[:3, 3]).tolist(), lengths.decimals(1)),
        _numbers(turned, angles.decimals(1)),
        _numbers(wxyz_from_rotation(T[:3, :3]).tolist(), 3),
    )


def _half_turn_positive(angle: float) -> float:
    """The angle, but +180° for −180° to the tenth that is shown: the same sign in all units, and no flicker."""
    return abs(angle) if round(math.degrees(angle), 1) == -180.0 else angle


def _numbers(values: Sequence[float], decimals: int) -> list[str]:
    return [fixed(value, decimals) for value in values]


class PoseReadout:
    """Shows the tool's pose in a frame, and the form for a typed target, which ``static/input.js`` opens."""

    def __init__(self, gui: viser.GuiApi, T_world_tool: Array, units: Units) -> None:
        self._choice = gui.add_html("")
        self._html = gui.add_html(html(T_world_tool, units))
        gui.add_html(render("panel/typed_target"))

    def show_frames(self, frames: Frames) -> None:
        """Offer the frames of the page."""
        offered = [(name, TITLES.get(name, name)) for name in frames.names]
        update_html(self._choice, render("panel/frame", frames=offered, shown=frames.shown))

    def show(
        self, T: Array, units: Units, target: Array | None = None, frame: str = WORLD,
        withheld: Collection[str] = (),
    ) -> None:  # fmt: skip
        """Replace the numbers; see `html`."""
        show_content(self._html, html(T, units, target, frame, withheld))
