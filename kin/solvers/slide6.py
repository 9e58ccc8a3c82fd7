"""Arms that slide in and out and have a spherical wrist: the Stanford arm (Scheinman 1969) and its kin.

As in :mod:`kin.solvers.wrist6` the pose fixes the wrist centre W = (X, L, −h) in the frame that turns with axis 1,
in front or at the back. The third joint is a slide perpendicular to axis 2 instead of a forearm that turns. It
runs past axis 2 at the distance E, so

- S = ±√((X − a1)² + h² − E²) is how far W is along it, out or through to the other side;
- θ2 = atan2(h, X − a1) + atan2(E, S); the wrist is the same.

Eight branches, of which S < 0 is seldom inside the limits. Singular: S = 0; X = 0, where θ1 is free if L = 0;
s5 = 0. The batch kernels are those of :mod:`kin.solvers.wrist6`, on this arm's params.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from kin.axes import is_perpendicular, is_zero, links_of, screw_x, screw_z
from kin.kernels.compile import inlined
from kin.robot import Robot
from kin.solvers.blocks import Arc, Entries, kernels_in_lanes
from kin.solvers.contract import Obstacle
from kin.solvers.names import Names, Part, eight, front_or_back, names_of
from kin.solvers.singular import Singularity, by_angle, off_line, those_within
from kin.solvers.wrist6.batch import (
    BEND,
    FRONT,
    PAIRS,
    ROWS,
    Lengths,
    Twist,
    all_but_third,
    arm_pairs,
    both_sides,
    store,
    turned,
)
from kin.solvers.wrist6.branches import solve
from kin.solvers.wrist6.closed_form import Wrist6
from kin.solvers.wrist6.geometry import OFFSET, SIGN, Geometry, has_spherical_wrist, pack
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "slide6"
TITLE = "closed form, sliding arm with a spherical wrist"
_REACH = TOLERANCES.reach
_SINGULAR = TOLERANCES.singular
_MERGE = TOLERANCES.merge


def match(robot: Robot) -> Slide6 | None:
    """The closed form if axis 2 is perpendicular to axis 1 and to the slide, and 4, 5, 6 are a spherical wrist."""
    if robot.n != 6 or robot.revolute.tolist() != [True, True, False, True, True, True]:
        return None
    links = links_of(robot, (-1, -1, -1, -1, 1))
    a, d, alpha = links.a, links.d, links.alpha
    if not (is_perpendicular(alpha[0]) and is_perpendicular(alpha[1]) and has_spherical_wrist(links)):
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
    return Slide6(pack(links, offset, lengths, phase, twist, slides=True), robot)


# The batch kernels are those of :mod:`kin.solvers.wrist6.batch`. How far W is along the slide (front, back) has
# rows of its own; those of θ3 have no pairs, and are written over.
_ALONG, _ROWS = ROWS - 1, ROWS + 2


@inlined
def _side(
    M: Entries, X: float, scale: float, lengths: Lengths, twist: Twist, S: Array, back: int, b: int
) -> bool:  # fmt: skip
    """All pairs of the shoulder with W at X, scale = 1/r²; whether one needs the careful kernel."""
    a1, _, f, beside = lengths
    s1, c1, R = turned(M, X, beside, scale)
    x, h, apart = X - a1, -M[11], abs(f)
    square = x * x + h * h
    inverse, distance = 1.0 / square, math.sqrt(square)
    square = (distance - apart) * (distance + apart)
    along = math.sqrt(square if square > 0.0 else 0.0)
    along = math.nan if distance + _REACH < apart else along
    S[FRONT + back, b], S[PAIRS + FRONT + back, b] = s1, c1 + 0.0 * along
    S[_ALONG + back, b] = along
    close0 = arm_pairs(x, h, (along, -f, 1.0, 0.0, inverse), R, twist, S, 2 * back, b)
    close1 = arm_pairs(x, h, (-along, -f, 1.0, 0.0, inverse), R, twist, S, 2 * back + 1, b)
    return close0 | close1 | (along < _MERGE * apart + _SINGULAR)


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets, as `both_sides` writes them."""
    return both_sides(_side, params, count, S)


@inlined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    all_but_third(arc, params, count, S)
    sign, offset = params[SIGN + 2], params[OFFSET + 2]
    for k in range(2):
        for b in range(count):
            along = S[_ALONG + k, b]
            S[BEND + k, b] = sign * (along - offset)
            S[PAIRS + BEND + k, b] = sign * (-along - offset)


branches_one, branches_many, solve_one, solve_many = kernels_in_lanes(
    __name__, _pairs, _angles, store, solve, _ROWS, PAIRS
)


class Slide6(Wrist6):
    """The closed form of a sliding arm: that of `Wrist6`, with another elbow."""

    name, title = NAME, TITLE
    reason = (
        "axes 4, 5 and 6 meet in one point, and joint 3 slides perpendicular to axis 2, "
        "which is perpendicular to axis 1"
    )
    _solve = staticmethod(solve_one)

    def __init__(self, geometry: Geometry, robot: Robot) -> None:
        super().__init__(geometry, robot)
        self.kernels = replace(self.kernels, one=branches_one, many=branches_many, seeded=solve_many)

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of X, of S and of s5; the boom is out where the middle of its range is."""
        sense = sense * self.geometry.sign
        lower, upper = float(robot.lower[2]), float(robot.upper[2])  # −∞ + ∞ is NaN without a warning
        middle = sense[2] * 0.5 * (lower + upper) + self.geometry.offset[2]
        extends = sense[2] if not math.isfinite(middle) or is_zero(middle) else math.copysign(1.0, middle)
        slide = Part(
            ("slide out", "the wrist centre is on the side of axis 2 that the slide extends to"),
            ("slide through", "the wrist centre is on the side of axis 2 opposite to where the slide extends to"),
        )
        shoulder = front_or_back(self._stance(robot, sense))
        return names_of((shoulder, slide.times(extends), self._wrist(sense)), eight())

    def _obstacle(self) -> Obstacle:
        return Obstacle("wrist centre too near to axis 1 or 2")

    def _x_of_wrist(self, t: Sequence[float] | Array) -> float:
        """X of the wrist centre: how far it is before axis 1 in the arm's own plane, metres."""
        g = self.geometry
        return float(g.a1 + t[2] * math.cos(t[1]) + g.f * math.sin(t[1]))

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: sides of axis 1 and of axis 2 that W is on, and the sign of θ5."""
        t = self.geometry.sign * q + self.geometry.offset
        return 4 * int(self._x_of_wrist(t) < 0.0) + 2 * int(t[2] < 0.0) + int(math.sin(t[4]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The three factors of the determinant, ±S X s5: there are no others."""
        g = self.geometry
        t = (g.sign * q + g.offset).tolist()
        x, wrist = self._x_of_wrist(t), off_line(t[4])
        if min(abs(t[2]), abs(x), abs(wrist)) > within:
            return ()  # as almost everywhere
        return those_within(
            within,
            Singularity("elbow", "wrist centre level with axis 2", "wrist centre off the slide", abs(t[2]), "m"),
            Singularity("shoulder", "wrist centre nearest to axis 1", "wrist centre sideways", abs(x), "m"),
            by_angle("wrist", "axes 4 and 6 in line", "tilt about the third axis", wrist, q, 4, g.sign[4]),
        )
