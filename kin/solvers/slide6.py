"""Arms that slide in and out and have a spherical wrist: the Stanford arm (Scheinman 1969) and its kin.

As in :mod:`kin.solvers.wrist6` the pose fixes the wrist centre W = (X, L, −h) in the frame that turns with axis 1,
in front or at the back. The third joint is a slide square to axis 2 instead of a forearm that turns. It runs past
axis 2 at the distance E, so

- S = ±√((X − a1)² + h² − E²) is how far W is along it, out or through to the other side;
- θ2 = atan2(h, X − a1) + atan2(E, S); the wrist is the same.

Eight branches, of which S < 0 is seldom inside the limits. Singular: S = 0; X = 0, where θ1 is free if L = 0;
s5 = 0. The fast path is that of :mod:`kin.solvers.wrist6`: the same kernels, on this arm's `params`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from kin.robot import Robot
from kin.solvers import wrist6
from kin.solvers.common import Candidates, Freedom, Problem, is_zero, screw_x, screw_z
from kin.solvers.links import is_square, links_of
from kin.solvers.singular import Singularity, at, off_line, those_within
from kin.solvers.wrist6 import Geometry, branches_many, branches_one, params
from kin.transforms import Array

__all__ = ["branches_many", "branches_one", "params"]

NAME = "slide6"
TITLE = "closed form, sliding arm with a spherical wrist"
BRANCHES = tuple(
    f"shoulder {s} · slide {e} · wrist {w}"
    for s in ("front", "back")
    for e in ("out", "through")
    for w in ("no-flip", "flip")
)


def match(robot: Robot) -> Geometry | None:
    """The geometry if axis 2 is square to 1 and to the slide, and 4, 5, 6 meet in a point, neighbours square."""
    if robot.n != 6 or robot.revolute.tolist() != [True, True, False, True, True, True]:
        return None
    links = links_of(robot, (-1, -1, -1, -1, 1))
    a, d, alpha = links.a, links.d, links.alpha
    if not all(is_square(alpha[i]) for i in (0, 1, 3, 4)) or not is_zero(a[3], a[4], d[4]):
        return None
    # W as seen from the slide; the slide's own frame is a quarter turn about x from that of axis 2.
    to_wrist = screw_z(links.theta[2], 0.0) @ screw_x(a[2], alpha[2]) @ screw_z(0.0, d[3])
    aside = float(a[1] + to_wrist[0, 3])
    beside = float(d[1] - to_wrist[1, 3])
    offset = links.theta.copy()
    offset[1] += 0.5 * math.pi
    offset[2] = d[2] + to_wrist[2, 3]
    # Axis 4's frame, seen from the slide's direction: Rz(−phase) Rx(twist) Rz(rest).
    R = (screw_z(-0.5 * math.pi, 0.0) @ screw_x(0.0, -0.5 * math.pi) @ to_wrist)[:3, :3]
    sine = math.hypot(R[0, 2], R[1, 2])
    phase = -math.atan2(R[0, 2], -R[1, 2]) if not is_zero(sine) else 0.0
    twist = math.atan2(sine, R[2, 2])
    rest = screw_x(0.0, -twist)[:3, :3] @ screw_z(phase, 0.0)[:3, :3] @ R
    offset[3] += math.atan2(rest[1, 0], rest[0, 0])
    lengths = (float(a[0]), 0.0, 0.0 if is_zero(aside) else aside, 0.0 if is_zero(beside) else beside)
    return wrist6.pack(links, offset, lengths, phase, twist, slides=True)


def why(geometry: Geometry) -> str:
    """What about the axes made the match, in one sentence."""
    return "axes 4, 5 and 6 meet in one point, and joint 3 slides square to axis 2, which is square to axis 1"


def solve(geometry: Geometry, problem: Problem) -> Candidates:
    """All branches; with an approach direction only, joint 6 stays or goes where it is asked to be."""
    found = wrist6.solve(geometry, problem)
    obstacle = found.obstacle and "with this orientation the wrist centre is too near to axis 1 or 2"
    return Candidates(found.q, found.values, found.arcs, found.gap, obstacle)


def handles(geometry: Geometry, task: int) -> bool:
    """Poses, and an approach direction when it is the last joint's own axis (then that joint is free)."""
    return wrist6.handles(geometry, task)


def freedoms(geometry: Geometry, task: int) -> tuple[Freedom, ...]:
    """θ1 where the wrist centre can be on axis 1; for an approach direction joint 6 as well."""
    return wrist6.freedoms(geometry, task)


def _reach(geometry: Geometry, t: Sequence[float] | Array) -> float:
    """X of the wrist centre: how far it is before axis 1 in the arm's own plane, metres."""
    return float(geometry.a1 + t[2] * math.cos(t[1]) + geometry.f * math.sin(t[1]))


def branch_of(geometry: Geometry, q: Array) -> int:
    """The branch a configuration is on: sides of axis 1 and of axis 2 that W is on, and the sign of θ5."""
    t = geometry.sign * q + geometry.offset
    return 4 * int(_reach(geometry, t) < 0.0) + 2 * int(t[2] < 0.0) + int(math.sin(t[4]) < 0.0)


def singularities(geometry: Geometry, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
    """How far a configuration ``(6,)`` is from each of the arm's singularities: the determinant is ±S X s5."""
    g = geometry
    t = (g.sign * q + g.offset).tolist()
    reach, wrist = _reach(g, t), off_line(t[4])
    if min(abs(t[2]), abs(reach), abs(wrist)) > within:
        return ()  # as almost everywhere
    return those_within(
        within,
        (
            "elbow",
            abs(t[2]),
            "m",
            lambda: "wrist centre level with axis 2: only the slide can move it in the arm's plane",
        ),
        (
            "shoulder",
            abs(reach),
            "m",
            lambda: "wrist centre as near to axis 1 as it can get: it cannot move sideways",
        ),
        (
            "wrist",
            abs(wrist),
            "rad",
            lambda: (
                f"axes 4 and 6 in line ({at(5, q[4], g.sign[4] * wrist)}): "
                "the tool cannot tilt about the third axis"
            ),
        ),
    )
