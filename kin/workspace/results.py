"""Workspace result types (immutable)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.transforms import Array


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WorkspaceChunk:
    """A slice of a cloud of tool points.

    Attributes:
        points: ``(k, 3)`` float32, metres in the world frame. Single precision is the format of screens and point
            cloud files; a point is off by less than 1e-7 of the arm's size, its configuration is exact.
        q: ``(k, n)`` float64 configurations if requested, else None; `workspace_configurations` recomputes any.
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

    def __repr__(self) -> str:
        """Which points of the cloud, and what is known of them."""
        known = ", ".join(["points", *(["q"] if self.q is not None else []), *self.measures])
        return f"WorkspaceChunk({self.start} to {self.done} of {self.total}: {known})"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Extreme:
    """The least or largest value of a coordinate or distance (m), with its configuration ``(n,)`` and point."""

    value: float
    q: Array
    point: Array

    def __repr__(self) -> str:
        """The value, and the configuration with six digits."""
        q = ", ".join(f"{value:.6g}" for value in self.q.tolist())
        return f"Extreme({self.value:.6g} m at [{q}])"


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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WorkspaceFacts:
    """Sizes of the set of points the tool reaches inside the limits; metres, world frame.

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

    def __repr__(self) -> str:
        """The sizes without their configurations."""
        spans = [("x", self.x), ("y", self.y), ("z", self.z), ("radius", self.radius), ("reach", self.reach)]
        parts = [f"{name} {span.least.value:.6g} to {span.largest.value:.6g} m" for name, span in spans]
        sizes = [("volume", self.volume, "m³"), ("surface", self.surface, "m²")]
        parts += [f"{name} {size.value:.4g} {unit}" for name, size, unit in sizes if size is not None]
        return f"WorkspaceFacts({', '.join(parts)})"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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

    def __repr__(self) -> str:
        """The joint that moves, and from where to where."""
        return f"SectionArc(joint {self.joint}, {self.start:.6g} to {self.stop:.6g}, {len(self.points)} points)"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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

    def __repr__(self) -> str:
        """Numbers of curves and arcs, and the area."""
        curves, arcs = len(self.curves), len(self.arcs)
        return f"Section({curves} curve{'s' * (curves != 1)}, {arcs} arc{'s' * (arcs != 1)}, {self.area:.4g} m²)"
