"""What a visitor can set for a capability map, checked: by the controls' events and by shared addresses alike."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Literal

from kin import InputError

By = Literal["share", "manipulability"]
SIZES = {"15 voxels long": 15, "25 voxels long": 25, "40 voxels long": 40}
DIRECTIONS = {"12": 12, "24": 24, "48": 48, "96": 96}
BY: dict[str, By] = {"Directions": "share", "Manipulability": "manipulability"}
CHOICES: dict[str, Mapping[str, object]] = {"resolution": SIZES, "directions": DIRECTIONS, "by": BY}


@dataclass(frozen=True)
class MapWishes:
    """The settings of the folder.

    Attributes:
        resolution, directions: which map.
        by: what its colours tell, and what `least` is of.
        least: the smallest value that is shown, as a share of the map's largest, 0 to 1.
    """

    resolution: int = 25
    directions: int = 24
    by: By = "share"
    least: float = 0.0

    def having(self, name: str, value: object) -> MapWishes:
        """The same wishes but one; raises `InputError` for a value that cannot be wished."""
        return replace(self, **{name: _read(name, value)})  # type: ignore[arg-type]

    def state(self) -> dict[str, object]:
        """All of it as JSON."""
        return asdict(self)

    def restored(self, state: object) -> MapWishes:
        """These wishes with what `state` tells; what is wrong or missing is left as it is."""
        wishes = self
        for one in fields(self):
            if isinstance(state, dict) and one.name in state:
                try:
                    wishes = wishes.having(one.name, state[one.name])
                except InputError:
                    continue  # somebody has edited the address
        return wishes


def _read(name: str, value: object) -> object:
    if name == "least":
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(name, value, "a finite number")
        return min(max(float(value), 0.0), 1.0)
    allowed = tuple(CHOICES[name].values())
    if isinstance(value, bool) or not isinstance(value, int | str) or value not in allowed:
        raise InputError(name, value, "one of " + ", ".join(str(one) for one in allowed))
    return value
