"""The floor below an arm: a grid with a scale, and a soft shadow where the arm stands."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from app.viewer.labels import add_label
from app.viewer.scene.meshes import Body
from app.viewer.viser_patches import assign
from kin.transforms import Array
from kin.units import Units

LIGHT: dict[str, Any] = {
    "cell_color": (200, 208, 219),
    "section_color": (158, 169, 184),
    "plane_color": (250, 251, 253),
}
DARK: dict[str, Any] = {"cell_color": (62, 70, 82), "section_color": (94, 105, 121), "plane_color": (44, 50, 60)}
INK_LIGHT, INK_DARK = (70, 80, 94), (176, 186, 200)
WIDTH = 10.0  # of the grid, in radii of the sphere around the arm; it fades out before
SCALES = (0.1, 0.2, 0.5, 1.0)  # lengths of the scale bar, m
SHADOW_PIXELS = 96
BESIDE = 0.06  # distance of the length from the end of the bar, in lengths of the bar
CLEAR = 1.5  # least distance of that end from the tool in the picture, in lengths of the tool's arrows


class Floor:
    """The nodes of one arm's floor.

    Args:
        root: prefix of the nodes' names.
        base: position ``(3,)`` of the arm's base.

    Attributes:
        scale: length of the scale bar (m).
        ends: its ends ``(3,)``.
    """

    def __init__(self, scene: viser.SceneApi, root: str, body: Body, base: Array, dark: bool) -> None:
        unit = 0.1 if body.radius < 0.6 else 0.25
        section = unit * (5 if unit == 0.1 else 4)
        width = max(2, round(WIDTH * body.radius / section / 2)) * 2 * section
        x, y = base[:2].tolist()
        self.scale = min(SCALES, key=lambda length: abs(length - 0.55 * body.radius))
        self._grid = scene.add_grid(
            f"{root}-floor",
            width=width,
            height=width,
            cell_size=unit,
            section_size=section,
            position=(0.0, 0.0, body.mount.floor),
            fade_distance=0.5 * width,
            fade_strength=1.6,
            fade_from="origin",
            shadow_opacity=0.3,
            plane_opacity=0.55,
            **(DARK if dark else LIGHT),
        )
        wide = 15.0 * body.size
        above = body.mount.floor + 0.02 * body.size
        self.nodes: list[viser.SceneNodeHandle] = [self._grid]
        if body.mount.stands and body.mount.kind != "table":
            shadow, at = _spot(), (x, y, above)
            self.nodes.append(
                scene.add_image(
                    f"{root}-shadow", shadow, wide, wide, position=at, cast_shadow=False, receive_shadow=False
                )
            )
        begin, along, across = _bar(body, base, self.scale)
        begin[2] = above
        end, tick = begin + self.scale * along, 0.03 * body.radius * across
        bar = np.array([[begin, end], [begin - tick, begin + tick], [end - tick, end + tick]], np.float32)
        self.ends: tuple[Array, Array] = (begin, end)
        self._bar = scene.add_line_segments(
            f"{root}-scale", bar, INK_DARK if dark else INK_LIGHT, thickness=2.0, thickness_units="screen"
        )
        self._label = add_label(
            scene,
            f"{root}-scale/length",
            "",
            position=end,
            scale=0.9,
            anchor="bottom-left",  # the floor would hide a part below
            depth_test=True,
        )
        self.nodes.append(self._bar)

    def show(self, visible: bool) -> None:
        """Show or hide the floor."""
        for node in self.nodes:
            node.visible = visible

    def use_dark(self, dark: bool) -> None:
        """Use the colours of a dark or a light page."""
        colors = DARK if dark else LIGHT
        for name, color in colors.items():
            setattr(self._grid, name, color)
        self._bar.colors = np.array(INK_DARK if dark else INK_LIGHT, np.uint8)

    def use_units(self, units: Units) -> None:
        """Name the length of the scale bar in these units."""
        self._label.text = units.lengths.brief(self.scale)

    def turn_label(self, seen: Array, arrows: float) -> None:
        """Put the length beside the bar: at its right end in the picture, unless the tool's arrows are.

        It never covers the bar. Over a bar that rises to the right it begins as far to the right as it can: on a
        phone, the buttons of the camera are to the left.

        Args:
            seen: where both `ends` and the tool are in the picture, `VisitorCamera.places`.
            arrows: length of the arrows at the tool, m.
        """
        left, right = (0, 1) if seen[1, 0] >= seen[0, 0] else (1, 0)
        away = np.linalg.norm(seen[:2, :2] - seen[2, :2], axis=1)
        aside = away[right] < CLEAR * arrows * seen[2, 2] and away[left] > away[right]
        at, other = (left, right) if aside else (right, left)
        self._label.anchor = "bottom-right" if aside else "bottom-left"  # the text leads away from the bar
        over = aside and seen[right, 1] > seen[left, 1]
        beyond = -0.5 if over else BESIDE
        assign(self._label, self.ends[at] + beyond * (self.ends[at] - self.ends[other]))


def _bar(body: Body, base: Array, length: float) -> tuple[Array, Array, Array]:
    """One end ``(3,)`` of the scale bar, for whatever height, and the directions ``(3,)`` along and across it.

    It lies along x, in front of the arm in the default view. Below an arm that hangs, it is near the edge of the
    picture, so it is moved to the middle. Before a wall it lies along the wall, which then hides nothing of it.
    """
    along, across, radius = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), body.radius
    if body.mount.kind == "wall":
        along, across = body.mount.frame[:3, 1], body.mount.frame[:3, 2]
        return base + 0.45 * radius * across - 0.5 * length * along, along, across
    aside = -0.5 * length if body.mount.kind == "ceiling" else 0.1 * radius
    return base + aside * along + 0.42 * radius * across, along, across


@cache
def _spot() -> NDArray[np.uint8]:
    """A black spot that fades out towards its edge, RGBA."""
    axis = np.linspace(-1.0, 1.0, SHADOW_PIXELS)
    radius = np.hypot(*np.meshgrid(axis, axis))
    image = np.zeros((SHADOW_PIXELS, SHADOW_PIXELS, 4), np.uint8)
    image[..., 3] = 150.0 * np.clip(1.0 - radius, 0.0, 1.0) ** 1.8
    return image
