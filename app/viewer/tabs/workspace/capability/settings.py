"""The settings of a capability map, validated for control events and for shared URLs alike."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Literal

from kin import InputError, Robot

By = Literal["share", "manipulability"]
SIZES = {"15 voxels long": 15, "25 voxels long": 25, "40 voxels long": 40}
DIRECTIONS = {"12": 12, "24": 24, "48": 48, "96": 96}
BY: dict[str, By] = {"Directions": "share", "Manipulability": "manipulability"}
CHOICES: dict[str, Mapping[str, object]] = {"resolution": SIZES, "directions": DIRECTIONS, "by": BY}


def default_directions(robot: Robot) -> int:
    """Enough that a map says something.

    An arm with fewer than six joints reaches most places from a few per cent of all directions only. The Pioneer
    arm has at least one of 24 directions in 23 % of its voxels, and of 96 in 60 %.
    """
    return 24 if robot.n >= 6 else 96


@dataclass(frozen=True)
class MapSettings:
    """The settings of a map.

    Attributes:
        resolution, directions: of the map.
        by: the coloured quantity.
        least: the smallest visible value, relative to the map's largest, 0 to 1.
    """

    resolution: int = 25
    directions: int = 24
    by: By = "share"
    least: float = 0.0

    def with_value(self, name: str, value: object) -> MapSettings:
        """These settings with one changed; raises `InputError` for an invalid value."""
        return replace(self, **{name: _read(name, value)})  # type: ignore[arg-type]

    def state(self) -> dict[str, object]:
        """The settings as JSON."""
        return asdict(self)

    def restored(self, state: object) -> MapSettings:
        """These settings with the values of a saved state; invalid and missing ones stay as they are."""
        settings = self
        for one in fields(self):
            if isinstance(state, dict) and one.name in state:
                try:
                    settings = settings.with_value(one.name, state[one.name])
                except InputError:
                    continue  # the URL was edited
        return settings


def _read(name: str, value: object) -> object:
    if name == "least":
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(name, value, "a finite number")
        return min(max(float(value), 0.0), 1.0)
    allowed = tuple(CHOICES[name].values())
    if isinstance(value, bool) or not isinstance(value, int | str) or value not in allowed:
        raise InputError(name, value, "one of " + ", ".join(str(one) for one in allowed))
    return value
