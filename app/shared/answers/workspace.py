"""Answers about the workspace: its sizes and its sections."""

from __future__ import annotations

from typing_extensions import TypedDict

from app.shared.answers.document import documented
from app.shared.answers.fk import Matrix
from kin import Estimate, Section, WorkspaceFacts
from kin.workspace import Span


@documented
class ExtremeAnswer(TypedDict):
    """The least or largest value of a coordinate or distance."""

    value: float
    """Its value in metres, exact to rounding."""
    q: list[float]
    """A configuration that has it, in radians (metres)."""
    point: list[float]
    """The tool point there, x, y, z in metres."""


@documented
class SpanAnswer(TypedDict):
    """From the least to the largest."""

    least: ExtremeAnswer
    """The least value."""
    largest: ExtremeAnswer
    """The largest value."""


@documented
class EstimateAnswer(TypedDict):
    """A number with its standard error."""

    value: float
    """The number, in m³ (volume) or m² (surface)."""
    error: float
    """Its standard error, in the same unit; more `effort` makes it smaller."""
    method: str
    """How it was made."""


@documented
class ArcAnswer(TypedDict):
    """A stretch of a section's boundary that one joint draws alone."""

    joint: int
    """Index of the joint that moves."""
    start: float
    """Its value at the beginning of the stretch, in radians (metres)."""
    stop: float
    """Its value at the end, in radians (metres)."""
    q: list[float]
    """The configuration at the beginning, in radians (metres)."""
    points: Matrix
    """Points [r, z] along the stretch, in metres, by forward kinematics."""
    centre: list[float] | None
    """Centre [r, z] in metres of the circle it is part of; null if it is part of none."""
    radius: float | None
    """Radius of that circle in metres; null if it is part of none."""


@documented
class SectionAnswer(TypedDict):
    """The cut of the workspace with a half-plane through the line of joint 1, whatever joint 1 does.

    The point [r, z] of the section is origin + r·u + z·v. Or the cut with the plane that was asked for: then u and
    v are any two axes of it, v upright if the plane is, and there are no arcs."""

    origin: list[float]
    """Where r and z are 0: x, y, z in metres."""
    u: list[float]
    """Direction of r."""
    v: list[float]
    """Direction of z, along the line of joint 1."""
    curves: list[Matrix]
    """Closed polylines of points [r, z] in metres, the workspace on their left; holes run the other way round."""
    arcs: list[ArcAnswer]
    """Stretches of the boundary that one joint draws alone: exact curves."""
    area: float
    """Area in m²."""
    step: float
    """Side in metres of the squares that were looked at; what is smaller can be missed."""


@documented
class WorkspaceAnswer(TypedDict):
    """Sizes of the set of points the tool reaches inside the limits, in the base frame."""

    x: SpanAnswer
    """The bounding box along x."""
    y: SpanAnswer
    """The bounding box along y."""
    z: SpanAnswer
    """The bounding box along z."""
    axis_point: list[float]
    """A point of the line of joint 1 (of the base's z axis if joint 1 slides), in metres."""
    axis: list[float]
    """Direction of that line."""
    shoulder: list[float]
    """The point of that line nearest to the first joint axis that is not parallel to it, in metres."""
    radius: SpanAnswer
    """Distance from that line; the least is the radius of the hole around it."""
    reach: SpanAnswer
    """Distance from the shoulder; the least is the radius of the hole around it."""
    volume: EstimateAnswer | None
    """Volume in m³; null where it was not asked for."""
    surface: EstimateAnswer | None
    """Area of the whole boundary in m², holes included; null where volume was not asked for."""
    section: SectionAnswer | None
    """The section in r and z, or in a plane; null unless asked for."""


def workspace_answer(facts: WorkspaceFacts, cut: Section | None = None) -> WorkspaceAnswer:
    """Sizes by `kin.workspace_facts`, and a section by `kin.section`."""
    return {
        "x": _span(facts.x),
        "y": _span(facts.y),
        "z": _span(facts.z),
        "axis_point": facts.axis_point.tolist(),
        "axis": facts.axis.tolist(),
        "shoulder": facts.shoulder.tolist(),
        "radius": _span(facts.radius),
        "reach": _span(facts.reach),
        "volume": None if facts.volume is None else _estimate(facts.volume),
        "surface": None if facts.surface is None else _estimate(facts.surface),
        "section": None if cut is None else _section(cut),
    }


def _span(span: Span) -> SpanAnswer:
    least, largest = (ExtremeAnswer(value=end.value, q=end.q.tolist(), point=end.point.tolist()) for end in span)
    return {"least": least, "largest": largest}


def _estimate(estimate: Estimate) -> EstimateAnswer:
    return {"value": estimate.value, "error": estimate.error, "method": estimate.method}


def _section(cut: Section) -> SectionAnswer:
    return {
        "origin": cut.origin.tolist(),
        "u": cut.u.tolist(),
        "v": cut.v.tolist(),
        "curves": [curve.tolist() for curve in cut.curves],
        "arcs": [
            {
                "joint": arc.joint,
                "start": arc.start,
                "stop": arc.stop,
                "q": arc.q.tolist(),
                "points": arc.points.tolist(),
                "centre": None if arc.centre is None else list(arc.centre),
                "radius": arc.radius,
            }
            for arc in cut.arcs
        ],
        "area": cut.area,
        "step": cut.step,
    }
