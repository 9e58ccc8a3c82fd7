"""What a comparison of two arms finds (immutable)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from kin.comparison.frames import Mapping
from kin.comparison.matching import PRINTED
from kin.comparison.mistakes import Mistake
from kin.robot import Robot
from kin.transforms import Array

Verdict = Literal["identical", "same", "close", "different"]
Quantity = Literal["count", "kind", "twist", "distance", "offset", "direction"]


@dataclass(frozen=True)
class Difference:
    """A quantity of the axes that no choice of frames, signs and zeros can make equal.

    Attributes:
        joints: the joints that it relates, from 0; none for the number of joints.
        quantity: the number of joints; the kind of one; the angle or the distance of two neighbouring axes; the
            offset along an axis between the common normals of its neighbours; "direction" where an axis cannot be
            brought in line with its counterpart although all of these agree, as beside prismatic joints.
        in_a, in_b: its value in each arm: radians, metres, a kind or a number; None for a direction.
    """

    joints: tuple[int, ...]
    quantity: Quantity
    in_a: float | str | None
    in_b: float | str | None


@dataclass(frozen=True)
class LimitDifference:
    """Limits of a joint that differ although the arms are the same.

    Attributes:
        joint: index from 0.
        in_a: limits in a, None if there are none.
        in_b: those of b, as joint values of a.
    """

    joint: int
    in_a: tuple[float, float] | None
    in_b: tuple[float, float] | None


@dataclass(frozen=True)
class Change:
    """One change of table b.

    Attributes:
        mistake: what it undoes.
        rows: the rows, from 0, as b counts them; none if it concerns the whole table.
        columns: the columns; none if it concerns whole rows.
        was, now: the number of a single cell before and after, None otherwise.
    """

    mistake: Mistake
    rows: tuple[int, ...]
    columns: tuple[str, ...]
    was: float | None = None
    now: float | None = None


@dataclass(frozen=True, eq=False)
class Explanation:
    """Changes of table b that make it arm a.

    Attributes:
        changes: one or two.
        robot: b with these changes.
        mapping: the frames, signs and zeros that are then left.
        cost: how unlikely this is; the smallest comes first.
        position, rotation: largest difference of the poses then, as found, in metres and radians.
    """

    changes: tuple[Change, ...]
    robot: Robot = field(repr=False)
    mapping: Mapping = field(repr=False)
    cost: float
    position: float
    rotation: float

    @property
    def is_exact(self) -> bool:
        """Whether the poses then agree but for digits that nobody prints; with a tolerance they need not."""
        return PRINTED.of(self.robot).holds(self.position, self.rotation)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Whether two tables describe one arm, and what makes the difference if not.

    Attributes:
        verdict: ``"identical"``: equal poses for all q. ``"same"``: one arm, but base, tool, or a joint's sense
            or zero differ. ``"close"``: one arm within the tolerance that was asked for. ``"different"``.
        mapping: ``T_a(q) = base · T_b(signs∘q + offsets) · tool``; None for different arms, unless they are nearly
            the same: then the best one.
        sign_choices: with how many vectors of signs there is a mapping; the plainest is `mapping`.
        free_offsets: joints whose offset poses cannot tell from that of base, tool or another joint.
        position, rotation: largest difference of the poses under `mapping`, climbed to from random configurations
            inside the limits of a: metres and radians; None without a mapping.
        worst_q: ``(n,)`` configuration of a where the poses differ most.
        first: the first difference from the base.
        differences: all of them.
        limits: joints with other limits, of arms that are the same.
        explanations: mistakes in b that explain the difference, the likeliest first.
        rounded: whether each number of b is that of a with fewer digits.
        complete: False if the time ran out before all pairs of changes were tried.
    """

    verdict: Verdict
    mapping: Mapping | None
    sign_choices: int = 0
    free_offsets: tuple[tuple[int, ...], ...] = ()
    position: float | None = None
    rotation: float | None = None
    worst_q: Array | None = None
    first: Difference | None = None
    differences: tuple[Difference, ...] = ()
    limits: tuple[LimitDifference, ...] = ()
    explanations: tuple[Explanation, ...] = ()
    rounded: bool = False
    complete: bool = True

    @property
    def is_same(self) -> bool:
        """Whether both are one arm, frames and zeros aside."""
        return self.verdict in ("identical", "same", "close")

    def to_b(self, q: Array) -> Array:
        """Configurations of b that put it where a is.

        Args:
            q: ``(..., n)`` joint values of a, radians (metres).

        Returns:
            ``(..., n)`` joint values of b.

        Raises:
            ValueError: the arms have no mapping.

        Examples:
            >>> import kin
            >>> found = kin.compare("ur5", kin.dh.convert_dh("ur5", "modified"))
            >>> found.to_b([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
            array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
        """
        if self.mapping is None:
            raise ValueError("the arms are different: there is no mapping of their joints")
        return self.mapping.to_b(np.asarray(q, dtype=np.float64))
