"""The settings of the workspace tab. The names are those of links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.shared.clouds import Cloud
from app.viewer.declared.fields import Settings, choice, flag, memory, number, slider
from app.viewer.tabs.workspace.colours import BY, MAPS, By
from app.viewer.tabs.workspace.cut import AXES, KEEP, Axis, Cut, Keep
from app.viewer.tabs.workspace.pick import Click
from kin import Robot
from kin.units import grouped
from kin.workspace import Strategy

Flow = Literal["running", "paused", "stopped"]

MAX_POINTS = 4_000_000  # points of a cloud in a browser
MAX_SEED = (1 << 53) - 1
MIN_SIZE, MAX_SIZE = 0.0005, 0.02  # m, of a point
FAR = 1e3  # m
FINE = 3  # decimals of a millimetre
NONE = "none"
SAMPLING: dict[str, Strategy] = {
    "joints at random": "uniform",
    "joints spread evenly": "quasi",
    "even in space": "volume",
    "envelope only": "boundary",
}
POINTS_HINT = f"1 to {grouped(MAX_POINTS)} points"
STRATEGY_HINT = (
    "Joints at random: each joint anywhere between its limits. Joints spread evenly: the same with fewer "
    "clusters. Even in space: the same density everywhere. Envelope only: the boundary. The last two take longer."
)
SEED_HINT = "Another seed gives other random configurations"
MAP_HINT = "All three maps are legible with every common kind of colour vision"
CUT_HINT = "Along the arm: the vertical plane of the arm's present pose. The cut moves in steps."
AT_HINT = "Position of the cut: distance from the base along the cut's direction"
CLICKS_HINT = "A click on a point moves the arm to the configuration that produced it"
COMPARE_HINT = "Another robot's cloud in the same scene, each in one colour"
SECTION_HINT = (
    "The section in (r, z), its boundary, and the tool in it; locked joints are ignored. "
    "The outline in the scene faces as joint 1 does."
)
AXES_HINT = "Axes with numbers, along the edges of a box around the workspace"
SIZES_HINT = "Bounding box, reach, holes, volume and surface; locked joints are ignored"


def default_size(robot: Robot) -> float:
    """A point size (m), in half millimetres, of about two pixels when the whole arm is visible."""
    return min(max(round(robot.reach * 0.005 / 0.0005) * 0.0005, MIN_SIZE), MAX_SIZE)


@dataclass(frozen=True)
class WorkspaceSettings(Settings):
    """The settings of the tab.

    Attributes:
        n, strategy, seed: of the cloud.
        by, map: coloured quantity, and colour map.
        size: diameter of a point (m).
        axis, at, keep: direction of the cut, None for none; its position (m along the normal); the visible side.
        compare: id of the other robot, None for none. Which there are follows from the service.
        sizes, section, axes: whether the sizes, the section plot and axes with numbers are shown.
        clicks: whether a click moves the arm to a point.
        cut: along `axis`.
        seen: the slabs that were visible of cuts before, of which there are still points in the scene.
        cloud: the one that was started last, without what its colours need.
        flow: whether its points are to come.
        opens, opened: whether a new map is cut open (until the visitor chooses a cut), and whether the present
            cut was made so.
        click: the last one into the cloud.
        in_view: what the default view was fitted to: the number of clouds, whether there is a map, and the arm
            whose axes are shown.
    """

    n: int = number("Points", 100_000, (1, MAX_POINTS), whole=True, names="points", hint=POINTS_HINT)
    strategy: Strategy = choice("Sampling", SAMPLING, "uniform", hint=STRATEGY_HINT)
    seed: int = number("Seed", 0, (0, MAX_SEED), whole=True, hint=SEED_HINT)
    by: By = choice(
        "Colour by", BY, "radius", old={"limits": "limit_margin"}, hint="The quantity that the colours show"
    )
    map: str = choice("Colours", {name: name for name in MAPS}, "cividis", hint=MAP_HINT)
    size: float = slider(
        "Point size",
        default_size,
        (MIN_SIZE, MAX_SIZE),
        "length",
        digits=FINE,
        clip=True,
        named=False,
        hint="Diameter of a point",
    )
    axis: Axis | None = choice("Cut", {NONE: None, **AXES}, None, hint=CUT_HINT, renew=True)
    at: float = slider(
        "Cut at", 0.0, (-FAR, FAR), "length", digits=FINE, clip=True, marks=True, named=False, hint=AT_HINT
    )
    keep: Keep = choice("Keep", KEEP, "below", hint="Which side of the cut is visible")
    compare: str | None = choice("Compare with", {NONE: None}, None, anything=True, hint=COMPARE_HINT, renew=True)
    sizes: bool = flag("Sizes", hint=SIZES_HINT)
    section: bool = flag("Section plot", hint=SECTION_HINT)
    axes: bool = flag("Axes with numbers", hint=AXES_HINT)
    clicks: bool = flag("Click on a point", True, hint=CLICKS_HINT)
    cut: Cut | None = memory()
    seen: tuple[tuple[Cut | None, NDArray[np.bool_] | None], ...] = memory(())
    cloud: Cloud | None = memory()
    flow: Flow = memory("running")
    opens: bool = memory(True, renew=False)
    opened: bool = memory(False)
    click: Click | None = memory()
    in_view: tuple[int, bool, Robot | None] = memory((0, False, None), renew=False)
