"""Measures of each configuration of a cloud, to colour its points by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from kin.errors import InputError
from kin.fk import manipulability
from kin.transforms import Array
from kin.workspace.region import Region

Measure = Literal["manipulability", "limit_margin", "limits"]
MEASURES: tuple[Measure, ...] = ("manipulability", "limit_margin")
_ACCEPTED: tuple[Measure, ...] = get_args(Measure)  # "limits" is the older name of "limit_margin"


def measure_names(measure: Measure | Sequence[Measure] | None) -> tuple[Measure, ...]:
    """The requested measures by the requested names, each once; raises `InputError` for an unknown one."""
    names = (measure,) if isinstance(measure, str) else () if measure is None else measure
    if not isinstance(names, Sequence) or any(name not in _ACCEPTED for name in names):
        raise InputError("measure", measure, "any of " + ", ".join(f'"{name}"' for name in MEASURES))
    return tuple(dict.fromkeys(names))


def measured(region: Region, name: Measure, q: Array) -> NDArray[np.float32]:
    """A measure ``(k,)`` of configurations ``(k, n)``; `WorkspaceChunk.measures` defines them."""
    if name == "manipulability":
        return manipulability(region.robot, q).astype(np.float32)
    movable = region.movable
    half = 0.5 * (region.upper - region.lower)[movable]
    margin = np.minimum(q - region.lower, region.upper - q)[:, movable] / half
    return np.asarray(margin.min(axis=1, initial=1.0), dtype=np.float32)
