"""Workspace result types (immutable)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.transforms import Array


@dataclass(frozen=True, slots=True, eq=False)
class WorkspaceChunk:
    """A slice of a cloud of tool points.

    Attributes:
        points: ``(k, 3)`` float32, metres in the base frame. Single precision is the format of screens and point
            cloud files; a point is off by less than 1e-7 of the arm's size, its configuration is exact.
        q: ``(k, n)`` float64 configurations if requested, else None: `kin.configuration_at` recomputes any.
        measures: by name, ``(k,)`` float32: ``"manipulability"`` (`kin.manipulability`), ``"limit_margin"``: the
            margin of the joint closest to a limit, 0 at the limit, 1 if every joint is in the middle of its range.
        start: index of the first point in the whole cloud.
        done, total: points up to the end of this slice, and of the whole cloud.
    """

    points: NDArray[np.float32]
    q: Array | None
    measures: Mapping[str, NDArray[np.float32]]
    start: int
    done: int
    total: int


@dataclass(frozen=True, slots=True, eq=False)
class Extreme:
    """The least or largest value of a coordinate or distance (m), with its configuration ``(n,)`` and point."""

    value: float
    q: Array
    point: Array


class Span(NamedTuple):
    """Least and largest."""

    least: Extreme
    largest: Extreme


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number, its standard error, and its method. The error falls with the number of samples."""

    value: float
    error: float
    method: str


@dataclass(frozen=True, slots=True, eq=False)
class WorkspaceFacts:
    """Sizes of the set of points the tool reaches inside the limits; metres, base frame.

    Attributes:
        x, y, z: the bounding box, exact to rounding, as least and largest value with their configurations.
        axis_point, axis: the axis of joint 1 (the base's z axis if joint 1 is prismatic), ``(3,)`` each.
        shoulder: ``(3,)`` the point of that axis nearest to the first joint axis not parallel to it.
        radius: distance from the axis; its least value is the radius of the hole around it.
        reach: distance from the shoulder; its least value is the radius of the hole around it.
        volume: m³, None if it was not requested.
        surface: m² of the whole boundary, holes included, None if it was not requested.
    """

    x: Span
    y: Span
    z: Span
    axis_point: Array
    axis: Array
    shoulder: Array
    radius: Span
    reach: Span
    volume: Estimate | None
    surface: Estimate | None


@dataclass(frozen=True, slots=True, eq=False)
class SectionArc:
    """Part of a section's boundary that one joint traces while the others stand still, mostly at limits.

    Attributes:
        joint: index of the joint that moves; joint 1 of an (r, z) section may move too without changing it.
        start, stop: its values at the ends of the arc.
        q: ``(n,)`` the configuration at the start.
        points: ``(k, 2)`` along the arc, in the section's plane, by forward kinematics.
        centre, radius: of the circle that it is part of, None if it is not part of one.
    """

    joint: int
    start: float
    stop: float
    q: Array
    points: Array
    centre: tuple[float, float] | None
    radius: float | None


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """A cut through the workspace.

    Attributes:
        origin, u, v: ``(3,)`` each: the point (s, t) of the section is ``origin + s·u + t·v``. In
            an (r, z) section s is the distance from joint 1's axis and t the height along it.
        curves: closed polylines ``(k, 2)`` with the workspace on the left, the last point not repeated; holes run
            the other way round. Vertices lie on the boundary itself, `step` apart at most.
        arcs: parts traced by one joint alone, exact curves.
        area: m², of the polygons.
        step: side of the grid's squares; features smaller than it can be missed.
        signed: whether s is negative behind joint 1's axis; u is then the direction that joint 1 faces at 0.
    """

    origin: Array
    u: Array
    v: Array
    curves: tuple[Array, ...]
    arcs: tuple[SectionArc, ...]
    area: float
    step: float
    signed: bool = False
