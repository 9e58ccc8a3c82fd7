"""Answers about the workspace: its sizes and its sections."""

from __future__ import annotations

from app.shared.answers.answer import Answer
from app.shared.answers.fk import Matrix
from kin.workspace import Section, WorkspaceFacts


class ExtremeAnswer(Answer):
    """The smallest or largest value of a coordinate or distance."""

    value: float
    """Its value in metres, exact to rounding."""
    q: list[float]
    """A configuration that attains it, in radians (metres)."""
    point: list[float]
    """The tool point of that configuration, x, y, z in metres."""


class SpanAnswer(Answer):
    """Smallest and largest value."""

    least: ExtremeAnswer
    """The smallest value."""
    largest: ExtremeAnswer
    """The largest value."""


class EstimateAnswer(Answer):
    """An estimate with its standard error."""

    value: float
    """The estimate, in m³ (volume) or m² (surface)."""
    error: float
    """Its standard error, in the same unit; a larger `effort` reduces it."""
    method: str
    """Method of the estimate."""


class ArcAnswer(Answer):
    """Part of a section's boundary that is traced by one joint."""

    joint: int
    """Index of the joint that moves."""
    start: float
    """Its value at the start of the arc, in radians (metres)."""
    stop: float
    """Its value at the end, in radians (metres)."""
    q: list[float]
    """The configuration at the start, in radians (metres)."""
    points: Matrix
    """Points [r, z] along the arc, in metres, by forward kinematics."""
    centre: list[float] | None
    """Centre [r, z] in metres of its circle; null if it is not circular."""
    radius: float | None
    """Radius of that circle in metres; null if it is not circular."""


class SectionAnswer(Answer):
    """Section of the workspace with a half-plane through the axis of joint 1, for all values of joint 1.

    The point [r, z] of the section is origin + r·u + z·v. For a section with the requested plane, u and v are two
    axes of the plane (v vertical if the plane is), and there are no arcs."""

    origin: list[float]
    """The point with r = z = 0: x, y, z in metres."""
    u: list[float]
    """Direction of r."""
    v: list[float]
    """Direction of z, along the axis of joint 1."""
    curves: list[Matrix]
    """Closed polylines of points [r, z] in metres with the workspace on their left; holes run the opposite way."""
    arcs: list[ArcAnswer]
    """Parts of the boundary that are traced by one joint: exact curves."""
    area: float
    """Area in m²."""
    step: float
    """Side in metres of the grid squares; smaller details may be missed."""


class WorkspaceAnswer(Answer):
    """Size of the set of points that the tool reaches inside the limits, in the world frame."""

    x: SpanAnswer
    """The bounding box along x."""
    y: SpanAnswer
    """The bounding box along y."""
    z: SpanAnswer
    """The bounding box along z."""
    axis_point: list[float]
    """A point of the axis of joint 1 (of the z axis of the base if joint 1 slides), in metres."""
    axis: list[float]
    """Direction of that axis."""
    shoulder: list[float]
    """The point of that axis nearest to the first joint axis that is not parallel to it, in metres."""
    radius: SpanAnswer
    """Distance from that axis; the smallest is the radius of the hole around it."""
    reach: SpanAnswer
    """Distance from the shoulder; the smallest is the radius of the hole around it."""
    volume: EstimateAnswer | None
    """Volume in m³; null if not requested."""
    surface: EstimateAnswer | None
    """Area of the whole boundary in m², holes included; null if volume was not requested."""
    section: SectionAnswer | None
    """The section in r and z, or in a plane; null unless requested."""


def workspace_answer(facts: WorkspaceFacts, cut: Section | None = None) -> WorkspaceAnswer:
    """Sizes by `kin.workspace.workspace_facts`, and a section by `kin.workspace.workspace_section`."""
    return WorkspaceAnswer.of(facts, section=None if cut is None else SectionAnswer.of(cut))
