"""What a search for ways out of a singularity answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from kin.collision.contacts import Contact
from kin.explained import Explained
from kin.ik.details import LimitViolation
from kin.ik.messages.singularity import short
from kin.ik.messages.values import joint, listed, need
from kin.robot import Robot
from kin.solvers.singular import Singularity
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

Code = Literal["clear", "start outside", "start touches", "margin", "blocked"]
_POINT_ALONE = 4  # joints: the natural task of so many has no rotation
_ZERO = 1e-9
_SEEN = 0.02  # of the largest motion of a joint: a smaller one is not worth a word


class ExitCause(NamedTuple):
    """Why there is no way out.

    Attributes:
        code: ``"clear"``: the arm is beyond the margin already. ``"start outside"``, ``"start touches"``: it is
            outside its limits, or touches something. ``"margin"``: no configuration inside the limits that was
            found is beyond the margin. ``"blocked"``: none of the ways to them is proven free
            of contacts.
        violations: of ``"start outside"``.
        contact: of ``"start touches"`` and ``"blocked"``.
        largest: of ``"margin"``: the largest σ that was found; else NaN.
    """

    code: Code
    violations: tuple[LimitViolation, ...] = ()
    contact: Contact | None = None
    largest: float = float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class Exit:
    """A motion of the joints out of a singularity.

    Attributes:
        q: ``(k, n)`` waypoints from where the arm is, read-only; all joints move on straight lines between them.
        sigma: σ at the end, see `kin.escape`.
        keeps_tool: whether the tool stays where it is: the arm moves in itself.
        translation, rotation: the largest deviation of the tool on the way, metres and radians, in what the task
            is about: the rotation of five joints is that of the approach direction, that of fewer 0.
        deviation: both in one: the largest √(translation² + rotation²), the translation as a share of the arm's
            size.
        posture: the branch at the end; None if the arm's branches have no names.
        length: of the motion in joint space: radians, a slide counting as a share of the arm's reach.
    """

    q: Array
    sigma: float
    keeps_tool: bool
    translation: float
    rotation: float
    deviation: float
    posture: str | None
    length: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Exits(Explained):
    """The ways out of a singularity, or why there are none.

    Attributes:
        robot, q_start: the arm, and where it is ``(n,)``.
        sigma, margin: σ there, and what it should be at least.
        singularities: those that the arm is at, or nearest to.
        exits: one for each posture, the best first; empty if there is none.
        cause: why; None if there is one.
    """

    robot: Robot
    q_start: Array
    sigma: float
    margin: float
    singularities: tuple[Singularity, ...]
    exits: tuple[Exit, ...]
    cause: ExitCause | None

    @property
    def found(self) -> bool:
        """Whether there is a way out."""
        return bool(self.exits)

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The answer in sentences, in any units.

        Args:
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            The sentences; `reason` is the same in the default units.

        Examples:
            >>> import kin
            >>> kin.leave_singularity("planar2r", [0.3, 1.5]).explain()
            'The arm is not near a singularity: σ_min is 0.3, the margin 0.03.'
        """
        if self.cause is not None:
            return _refusal(self, self.cause, units)
        said = [f"The arm is {self._where(units)}: σ_min is {_value(self.sigma)}."]
        for i, each in enumerate(self.exits):
            said.append(f"{'Another way' if i else 'The way'} out: {self.describe(each, units)}.")
        return " ".join(said)

    def describe(self, exit_: Exit, units: Units = DEFAULT_UNITS) -> str:
        """Which joints a way out moves, what the tool does meanwhile, and where it leads.

        Args:
            exit_: one of `exits`.
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            A clause.

        Examples:
            >>> import kin
            >>> found = kin.leave_singularity("planar2r", [0.3, 0.0])
            >>> found.describe(found.exits[0]).partition("; ")[2]
            'the tool moves by 3.5 mm at most; posture elbow positive; σ_min 0.03'
        """
        posture = f"; posture {exit_.posture}" if exit_.posture else ""
        tool = tool_motion(self.robot, exit_, units)
        return f"{self.moves(exit_, units)}; {tool}{posture}; σ_min {_value(exit_.sigma)}"

    def moves(self, exit_: Exit, units: Units = DEFAULT_UNITS) -> str:
        """Which joints a way out moves, by how much, those that move most first.

        Args:
            exit_: one of `exits`.
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            A list in words.

        Examples:
            >>> import kin
            >>> found = kin.leave_singularity("planar2r", [0.3, 0.0])
            >>> found.moves(found.exits[0])
            'joint 2 (elbow) by 7.8° and joint 1 (shoulder) by -2.9°'
        """
        moves = exit_.q[-1] - exit_.q[0]
        sizes = np.abs(moves)
        moved = [
            f"{joint(i, self.robot.joints[i].name)} by {units.of(bool(self.robot.revolute[i])).value(moves[i])}"
            for i in np.argsort(-sizes, kind="stable").tolist()
            if sizes[i] > _SEEN * sizes.max()
        ]
        return listed(moved)

    def _where(self, units: Units) -> str:
        """At what, or near what, the arm is."""
        if not self.singularities:
            return "near a singularity"
        nearest = self.singularities[0]
        at = "at" if nearest.distance <= TOLERANCES.at_singularity else "near"
        named = "" if nearest.kind == "jacobian" else f" ({short(nearest, units)})"
        return f"{at} a singularity{named}"


def tool_motion(robot: Robot, exit_: Exit, units: Units) -> str:
    """What the tool does on a way out."""
    if exit_.keeps_tool:
        return "the tool stays where it is"
    turning = f" and turns by {units.angles.value(exit_.rotation)}" if robot.n > _POINT_ALONE else ""
    return f"the tool moves by {units.lengths.value(exit_.translation)}{turning} at most"


def _value(sigma: float) -> str:
    """σ in two digits; what is left of rounding is 0."""
    return "0" if sigma < _ZERO else f"{sigma:.2g}"


def _refusal(found: Exits, cause: ExitCause, units: Units) -> str:
    contact = f": {cause.contact.text}" if cause.contact else ""
    match cause.code:
        case "clear":
            here = f"σ_min is {_value(found.sigma)}, the margin {_value(found.margin)}"
            return f"The arm is not near a singularity: {here}."
        case "start outside":
            return f"The arm is outside its limits: {listed([need(each, units) for each in cause.violations])}."
        case "start touches":
            return f"Something touches where the arm is{contact}."
        case "blocked":
            return f"None of the ways out that were found is proven free of contacts{contact}."
        case "margin":
            largest = f"the largest σ_min found is {_value(cause.largest)}, the margin {_value(found.margin)}"
            return f"No way out was found inside the limits: {largest}."
