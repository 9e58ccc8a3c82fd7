"""Whether an arm is cuspidal: whether it can change its posture without meeting a singularity.

The posture of a cuspidal arm is not the sign of anything: a path can bring the tool back to where it was with
other joint values, although the arm never was singular (P. Wenger, D. Chablat, A review of cuspidal serial and
parallel manipulators, J. Mechanisms and Robotics 15(4), 2023, arXiv 2210.05204).

*Yes* comes with a loop of the tool (:mod:`kin.postures.loops`), verified between its samples. *No* is said only
where it is proved: each joint value follows from an equation whose two solutions have derivatives of opposite
sign, and the determinant of the Jacobian is the product of these derivatives; or three joints place a point and
have no cusps (:mod:`kin.postures.cusps`). For any other arm in which the search finds no loop the answer is *none
found*, with the extent of the search.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from kin.differential.task import natural_task, usual_rank
from kin.errors import InputError
from kin.ik.messages.values import count
from kin.ik.options import JointConstraints, Limits, Locks
from kin.ik.problem import never_cancel
from kin.named import robot_of
from kin.postures.cusps import around, chain_of, is_staged, possible_cusps
from kin.postures.loops import Search, search_loop
from kin.postures.movable import Movable
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.solvers.contract import TASK_CODES
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.workspace.region import checked_integer

Verdict = Literal["yes", "no", "none found"]
Evidence = Literal["loop", "factors", "stages", "no cusps", "search"]

POSES = 256
MOST_POSES, MOST_SEED = 100_000, 2**32 - 1
MOST_CUSPS = 16  # around which loops are looked for first
# Families whose branches are the signs of the factors of det J, as their pages in the documentation derive.
_BY_SIGNS = ("wrist5", "wrist6", "parallel5", "parallel6", "slide6", "scara4")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Cuspidality:
    """Whether an arm is cuspidal, and how that is known.

    Attributes:
        robot: the arm.
        verdict: ``"yes"``, ``"no"`` or ``"none found"``, which is not a no.
        evidence: ``"loop"``: one was found and verified. ``"factors"``: the postures of its family are the signs
            of the factors of det J. ``"stages"``: so it is for the three joints that place a point, two axes of
            which are parallel or meet. ``"no cusps"``: these three have none. ``"search"``: nothing was found or
            proved.
        loop: ``(k, n)`` corners of a motion whose joints go straight in between, read-only, radians (metres): the
            tool ends where it started, the arm in another posture. None unless the verdict is ``"yes"``.
        in_limits: whether the loop keeps the joint limits.
        least: no singular value of the task's Jacobian is smaller on the loop; lengths count as shares of the sum
            of the arm's offsets. 0.0 without a loop.
        poses, pairs: how many random poses were solved in the search, and how many pairs of their postures tried.
        seed: of the search.
    """

    robot: Robot
    verdict: Verdict
    evidence: Evidence
    loop: Array | None = None
    in_limits: bool = False
    least: float = 0.0
    poses: int = 0
    pairs: int = 0
    seed: int = 0

    def __repr__(self) -> str:
        """The sentence about it."""
        return f"Cuspidality({self.reason!r})"

    @property
    def reason(self) -> str:
        """The answer in a sentence."""
        match self.evidence:
            case "loop":
                limits = "inside its limits" if self.in_limits else "with the joint limits left aside"
                return (
                    f"Cuspidal: {limits}, a loop of the tool ends in another posture without a singularity on the "
                    f"way. The smallest singular value stays above {self.least:.2g}."
                )
            case "factors":
                why = "each posture is a combination of signs of the factors of the Jacobian's determinant"
            case "stages":
                why = "two neighbouring axes of the three joints that place a point are parallel or meet"
            case "no cusps":
                why = "the three joints that place a point have no cusps, and their singular curves do not cross"
            case _:
                tried = count(self.pairs, "pair of postures", "pairs of postures")
                return (
                    f"No loop was found between {tried} of {self.poses} random poses, which does not prove a no."
                )
        return f"Not cuspidal: {why}."


def cuspidal(
    robot: Robot | str,
    *,
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    poses: int = POSES,
    seed: int = 0,
    progress: Callable[[float], object] = lambda _: None,
    cancel: Callable[[], None] = never_cancel,
) -> Cuspidality:
    """Whether an arm can change its posture without meeting a singularity.

    It must have as many joints that move as its task has dimensions: six for a pose, five for a point and an
    approach direction, three for a point. Joints of an arm with more are locked. A proof is about the table as it
    is, without joint limits; a loop is looked for inside the limits first.

    Args:
        robot: the arm, or the id of a built-in one.
        limits, locked: as in `kin.JointConstraints`, radians (metres). Narrower limits hold for the loop that is
            looked for first.
        constraints: both as one value, instead of `limits` and `locked`.
        poses: how many random poses the search solves, at most, 1 to 100 000: inside the limits, and as many again
            without limits.
        seed: of the search, 0 to 2³² − 1.
        progress: called now and then with the part of the search that is done, 0 to 1.
        cancel: called now and then; cancels the search by raising.

    Returns:
        The verdict, how it is known, and the loop if there is one.

    Raises:
        InputError: naming the wrong argument; an arm that its task leaves a freedom.

    Examples:
        >>> import kin
        >>> kin.cuspidal("ur5").verdict, kin.cuspidal("puma560").evidence
        ('no', 'factors')
    """
    robot = robot_of(robot)
    poses = checked_integer("poses", poses, 1, MOST_POSES, f"a whole number from 1 to {MOST_POSES}")
    seed = checked_integer("seed", seed, 0, MOST_SEED, f"a whole number from 0 to {MOST_SEED}")
    movable = Movable.of(robot, JointConstraints.of(limits, locked, constraints))
    arm = movable.arm
    proof, near = _proved(robot, arm)
    if proof is not None:
        return Cuspidality(robot, "no", proof)
    found = _searched(arm, near, poses, seed, progress, cancel)
    if found.q is None:
        return Cuspidality(robot, "none found", "search", None, False, 0.0, found.poses, found.pairs, seed)
    q = movable.expanded(found.q)
    q.flags.writeable = False
    kept = bool(arm.in_limits(found.q, TOLERANCES.limit).all())
    return Cuspidality(robot, "yes", "loop", q, kept, found.least, found.poses, found.pairs, seed)


def _proved(robot: Robot, arm: Robot) -> tuple[Evidence | None, Array]:
    """What proves that the arm is not cuspidal, if anything does; else configurations ``(k, n)`` around its cusps.

    Raises:
        InputError: its task leaves it a freedom, or needs more joints.
    """
    near = np.empty((0, arm.n))
    if _is_known_by_signs(arm):
        return "factors", near
    if arm.coupled or arm.n not in (3, 5, 6) or usual_rank(arm, natural_task(arm)) < arm.n:
        expected = "as many joints that move as its task has dimensions, 3, 5 or 6; lock the others"
        raise InputError("robot", f"{robot.id} with {arm.n} joints that move", expected)
    chain = chain_of(arm)
    if chain is None:
        return None, near
    if is_staged(chain):
        return "stages", near
    cusps = possible_cusps(chain)[:MOST_CUSPS]
    return None if len(cusps) else "no cusps", np.concatenate([near, *(around(arm, chain, at) for at in cusps)])


def _searched(
    arm: Robot, near: Array, poses: int, seed: int, progress: Callable[[float], object], cancel: Callable[[], None]
) -> Search:
    """A loop inside the limits, else one without."""
    inside = search_loop(arm, poses, seed, True, near, lambda part: progress(0.5 * part), cancel)
    if inside.q is not None:
        return inside
    found = search_loop(arm, poses, seed, False, near, lambda part: progress(0.5 + 0.5 * part), cancel)
    return replace(found, poses=inside.poses + found.poses, pairs=inside.pairs + found.pairs)


def _is_known_by_signs(arm: Robot) -> bool:
    """Whether the closed form of the table as it is has the signs of the determinant's factors as postures.

    One that solves another task than the arm's proves nothing: a tool beside axis 5 moves when joint 5 turns.
    """
    form = None if arm.coupled else closed_form_of(arm)
    if form is None or form.off != 0.0 or form.name not in _BY_SIGNS:
        return False
    return form.handles(TASK_CODES[natural_task(arm)])
