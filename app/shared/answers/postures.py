"""Answers about postures: how many there are where, and whether one turns into another without a singularity."""

from __future__ import annotations

from typing import Annotated

from app.shared.answers.answer import Answer, From
from app.shared.answers.fk import Matrix
from kin.postures.maps import Kind
from kin.postures.verdicts import Evidence, Verdict


class CuspidalAnswer(Answer):
    """Whether an arm can change its posture without meeting a singularity."""

    verdict: Verdict
    """"none found" is not a no: neither was a loop found, nor is it proved that there is none."""
    evidence: Evidence
    """"loop": one was found and verified. "factors": each posture is a combination of signs of the factors of the
    Jacobian's determinant. "stages": two neighbouring axes of the three joints that place a point are parallel or
    meet. "no cusps": these three joints have none. "search": nothing was found or proved."""
    loop: Matrix | None
    """Corners of a motion of the joints, straight in between, in radians (metres): the tool ends where it started,
    the arm in another posture. Null unless the verdict is "yes"."""
    in_limits: bool
    """Whether the loop keeps the joint limits."""
    least: float
    """No singular value of the task's Jacobian is smaller on the loop; lengths count as shares of the sum of the
    arm's offsets. 0 without a loop."""
    poses: int
    """How many random poses the search has solved."""
    pairs: int
    """How many pairs of their postures it has tried."""
    seed: int
    """Of the search: the same seed finds the same loop."""
    reason: str
    """All of it in a sentence for people."""


class PostureCurveAnswer(Answer):
    """Part of a border between regions of a posture map."""

    kind: Kind
    """"singular": two postures merge there; "limit": a posture leaves the joint limits."""
    points: Matrix
    """Points [x, y] along it."""


class PostureRegionAnswer(Answer):
    """A connected part of a posture map."""

    name: str
    """"A", "B", …, the largest first."""
    count: int
    """Number of postures at `place`; in a section, everywhere in the region."""
    share: float
    """Share of the nodes of the map, 0 to 1."""
    place: list[float]
    """x and y of the node farthest from the border."""
    q: Matrix
    """The postures there, in radians (metres)."""
    branches: list[str]
    """Their names; numbers for an arm whose postures have no names."""
    branch: str
    """In a plane of joints, the posture of the configuration at `place`; "" if it has no name."""


class PostureMapAnswer(Answer):
    """How many exact postures there are in a section of the task space, or in a plane of two joints."""

    joints: Annotated[list[int] | None, From("plane.joints")]
    """Indices of the two joints of the plane; null for a section."""
    q: Annotated[list[float] | None, From("plane.q")]
    """Where the other joints are, in radians (metres); null for a section."""
    origin: Annotated[list[float] | None, From("plane.origin")]
    """The tool of a section is at origin + x·u + y·v, in metres; null for a plane of joints."""
    u: Annotated[list[float] | None, From("plane.u")]
    """Direction of x."""
    v: Annotated[list[float] | None, From("plane.v")]
    """Direction of y."""
    rotation: Annotated[Matrix | None, From("plane.rotation")]
    """Orientation of the tool in a section, a 3×3 rotation matrix; null for a plane of joints."""
    x: list[float]
    """Coordinates of the columns of nodes: metres along u, or values of the first joint."""
    y: list[float]
    """Coordinates of the rows of nodes: metres along v, or values of the second joint."""
    counts: list[list[int]]
    """Number of postures: one list for each x, with one number for each y."""
    curves: list[PostureCurveAnswer]
    """The borders."""
    regions: list[PostureRegionAnswer]
    """The connected parts, the largest first, without those of a few nodes."""
    respect_limits: bool
    """Whether only postures inside the joint limits count."""
    doubtful: int
    """Number of nodes with an odd number of postures without limits: one may be missing, or two have merged."""
    reason: str
    """The regions in words, for people."""
