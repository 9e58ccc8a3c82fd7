"""The settings of the workspace tab, validated for control events and for shared URLs alike."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields, replace

from app.viewer.tabs.workspace.colours import BY, MAPS, By
from app.viewer.tabs.workspace.cut import AXES, KEEP, Axis, Keep
from kin import InputError, Robot
from kin.workspace import STRATEGIES, Strategy

MAX_POINTS = 4_000_000  # points of a cloud in a browser
MIN_SIZE, MAX_SIZE = 0.0005, 0.02  # m, of a point
FAR = 1e3  # m


@dataclass(frozen=True)
class WorkspaceSettings:
    """The settings of the tab.

    Attributes:
        n, strategy, seed: of the cloud.
        by, map: coloured quantity, and colour map.
        size: diameter of a point (m).
        axis, at, keep: direction of the cut, None for none; its position (m along the normal); the visible side.
        compare: id of the other robot, None for none.
        sizes, section, axes: whether the sizes, the section plot and axes with numbers are shown.
        clicks: whether a click moves the arm to a point.
    """

    n: int = 100_000
    strategy: Strategy = "uniform"
    seed: int = 0
    by: By = "radius"
    map: str = "cividis"
    size: float = 0.003
    axis: Axis | None = None
    at: float = 0.0
    keep: Keep = "below"
    compare: str | None = None
    sizes: bool = False
    section: bool = False
    axes: bool = False
    clicks: bool = True

    def with_value(self, name: str, value: object, others: Iterable[str]) -> WorkspaceSettings:
        """These settings with one changed; raises `InputError` for an invalid value.

        Args:
            others: ids of the robots to compare with.
        """
        return replace(self, **{name: _read(name, value, tuple(others))})  # type: ignore[arg-type]

    def state(self) -> dict[str, object]:
        """The settings as JSON."""
        return asdict(self)

    def restored(self, state: dict[str, object], others: Iterable[str]) -> WorkspaceSettings:
        """These settings with the values of a saved state; invalid and missing ones stay as they are."""
        allowed = tuple(others)
        settings = self
        for one in fields(self):
            if one.name in state:
                try:
                    settings = settings.with_value(one.name, state[one.name], allowed)
                except InputError:
                    continue  # the URL was edited, or the robot is gone
        return settings


def default_size(robot: Robot) -> float:
    """A point size (m), in half millimetres, of about two pixels when the whole arm is visible."""
    return min(max(round(robot.reach * 0.005 / 0.0005) * 0.0005, MIN_SIZE), MAX_SIZE)


def _read(name: str, value: object, others: tuple[str, ...]) -> object:
    if name in ("n", "seed"):
        low, high = (1, MAX_POINTS) if name == "n" else (0, (1 << 53) - 1)
        return _whole({"n": "points"}.get(name, name), value, low, high)
    if name in ("size", "at"):
        return _number(name, value, *((MIN_SIZE, MAX_SIZE) if name == "size" else (-FAR, FAR)))
    if name in ("sizes", "section", "axes", "clicks"):
        if not isinstance(value, bool):
            raise InputError(name, value, "true or false")
        return value
    if name == "by" and value == "limits":  # the name in older links
        value = "limit_margin"
    allowed: tuple[object, ...] = {
        "strategy": STRATEGIES,
        "by": tuple(BY.values()),
        "map": tuple(MAPS),
        "axis": (None, *AXES.values()),
        "keep": tuple(KEEP.values()),
        "compare": (None, *others),
    }[name]
    if not isinstance(value, str | None) or value not in allowed:
        raise InputError(name, value, "one of " + ", ".join(str(one) for one in allowed))
    return value


def _number(name: str, value: object, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(name, value, "a finite number")
    return min(max(float(value), low), high)


def _whole(name: str, value: object, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value // 1:
        raise InputError(name, value, f"a whole number from {low} to {high}")
    if not low <= value <= high:
        raise InputError(name, value, f"a whole number from {low} to {high}")
    return int(value)
