"""The colours of points: the coloured quantity, its scale, the colour map, and the legend.

A scale must not change while a cloud grows, and must be the same for all visitors. So its ends are determined by
the robot alone, from a few thousand evenly spread configurations. Values beyond an end have the colour of that
end.

The maps are perceptually uniform and legible with all common kinds of colour vision: cividis (Nuñez, Anderson and
Renslow, PLOS ONE 13(7), 2018), viridis and inferno (van der Walt and Smith, 2015, CC0), sixteen samples of each.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.viewer.views.templates import render
from kin import Robot
from kin.transforms import Array
from kin.units import Units, general
from kin.workspace import Measure, WorkspaceChunk, workspace_slice
from kin.workspace.region import Region
from kin.workspace.search.extremes import base_axis

By = Literal["radius", "height", "manipulability", "limit_margin", "one"]
Colour = tuple[int, int, int]
Bytes = NDArray[np.uint8]

MAPS = {
    "cividis": "00224e 002e6c 1e3a6f 35456c 47516c 575d6d 666970 757575 "
    "848279 948e77 a59c74 b7a96e c8b866 dbc75a eed649 fee838",
    "viridis": "440154 481a6c 472f7d 414487 39568c 31688e 2a788e 23888e "
    "1f988b 22a884 35b779 54c568 7ad151 a5db36 d2e21b fde725",
    "inferno": "000004 0c0826 240c4f 420a68 5d126e 781c6d 932667 ae305c "
    "c73e4c dd513a ed6925 f8850f fca50a fac62d f2e661 fcffa4",
}
BY: dict[str, By] = {
    "Radius": "radius",
    "Height": "height",
    "Manipulability": "manipulability",
    "Limit margin": "limit_margin",
    "One colour": "one",
}
MEANING: dict[By, str] = {
    "radius": "distance from joint 1's axis",
    "height": "height above the base",
    "manipulability": "manipulability w (pose)",
    "limit_margin": "distance to the nearest joint limit, relative to half its range",
}
# Okabe and Ito's blue and orange, for the robot's own cloud and that of another one.
OWN: Colour = (0, 114, 178)
OTHER: Colour = (230, 159, 0)
OLD: Colour = (138, 145, 153)  # of a cloud of other settings
SAMPLES = 4096  # configurations that determine the ends of a scale


@dataclass(frozen=True)
class Scale:
    """A linear scale from a quantity to a colour, from `low` to `high`."""

    by: By
    low: float
    high: float


def measures(by: By) -> tuple[Measure, ...]:
    """The measures of a cloud that this colouring needs."""
    return (by,) if by == "manipulability" or by == "limit_margin" else ()


@lru_cache(maxsize=256)
def axis_of_joint_1(robot: Robot) -> tuple[Array, Array]:
    """A point of joint 1's axis and its unit direction, ``(3,)`` each."""
    point, axis, _ = base_axis(Region.of(robot))
    return point, axis


def radius_and_height(robot: Robot, points: Array | NDArray[np.float32]) -> tuple[Array, Array]:
    """Distance from joint 1's axis and height along it ``(k,)`` of points ``(k, 3)``, as in an (r, z) section."""
    point, axis = axis_of_joint_1(robot)
    height = points @ axis
    across = points - point - (height - float(point @ axis))[:, None] * axis
    return np.sqrt(np.einsum("ki,ki->k", across, across)), height


def quantity(robot: Robot, by: By, chunk: WorkspaceChunk) -> Array:
    """The coloured quantity of each point ``(k,)`` of a chunk."""
    if by == "radius":
        return radius_and_height(robot, chunk.points)[0]
    if by == "height":
        return np.asarray(chunk.points[:, 2], dtype=np.float64)
    return np.asarray(chunk.measures[by], dtype=np.float64)


@lru_cache(maxsize=256)
def scale_of(robot: Robot, by: By) -> Scale:
    """The scale of a robot, up to the largest sampled value; from 0 for margins and manipulability."""
    if by == "one":
        return Scale(by, 0.0, 1.0)
    chunk = workspace_slice(robot, SAMPLES, 0, SAMPLES, strategy="quasi", measure=measures(by) or None)
    values = quantity(robot, by, chunk)
    low = float(values.min()) if by in ("radius", "height") else 0.0
    return Scale(by, low, max(float(values.max()), low + 1e-9))


@lru_cache(maxsize=len(MAPS))
def table(name: str) -> Bytes:
    """A map in 256 steps ``(256, 3)``."""
    samples = np.array([list(bytes.fromhex(c)) for c in MAPS[name].split()], dtype=float)
    at = np.linspace(0.0, len(samples) - 1.0, 256)
    steps = np.stack([np.interp(at, np.arange(len(samples)), samples[:, k]) for k in range(3)], axis=1)
    made: Bytes = np.rint(steps).astype(np.uint8)
    made.flags.writeable = False
    return made


def paint(values: Array, scale: Scale, name: str) -> Bytes:
    """The colours ``(k, 3)`` of values ``(k,)``."""
    at = (values - scale.low) * (255.0 / (scale.high - scale.low))
    colours: Bytes = table(name)[np.clip(at, 0.0, 255.0).astype(np.uint8)]
    return colours


def legend(scale: Scale, name: str, units: Units) -> str:
    """The scale as a colour bar with its end values, and in words."""
    low, high = (value_text(scale.by, value, units) for value in (scale.low, scale.high))
    return bar(scale.by, low, high, MEANING[scale.by], name)


def bar(key: str, low: str, high: str, meaning: str, name: str) -> str:
    """All colours of a map from `low` to `high`, and their meaning; `key` identifies the element."""
    stops = ", ".join("#" + c for c in MAPS[name].split())
    return render("workspace/colour_bar", key=key, low=low, high=high, stops=stops, meaning=meaning)


def names_legend(names: list[tuple[Colour, str]]) -> str:
    """The colour of each robot."""
    rows = [(colour, word, name) for (colour, name), word in zip(names, ("blue", "orange"), strict=False)]
    return render("workspace/names", names=rows)


def value_text(by: By, value: float, units: Units) -> str:
    """A quantity as text, with its unit."""
    if by in ("radius", "height"):
        return units.lengths.text(value, 0)
    return f"{100.0 * value:.0f} %" if by == "limit_margin" else general(value, 3)
