"""What the lesson "Postures" teaches and asks."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from app.viewer.lessons.guide.outline import (
    Choice,
    Configuration,
    Number,
    Option,
    Outline,
    Pose,
    Step,
    count,
    one_right,
)
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.postures import planar
from app.viewer.scene.chain import rotation
from kin import IKOptions, IKSolution, Robot, Status, branch_names, branch_of, fk, jacobian
from kin.axes import NEARLY
from kin.differential.task import free_motions, rank
from kin.ik import solve
from kin.transforms import Array
from kin.units import Units

GOAL = "You can say how many postures reach a target, what tells them apart, and why a target is missed."
ROLL = math.radians(30.0)
BEYOND = 1.2  # reaches: a target that no arm has
POSTURES = frozenset({"postures"})  # what questions withhold


class Facts(NamedTuple):
    """What inverse kinematics says about the pose that the arm has at home.

    Attributes:
        names: of all branches.
        here: the branch of home.
        found: the solutions within the limits.
        other: the solution that differs most from home; None if there is no other one.
        rolled: how many solutions within the limits there are if the tool is rolled by `ROLL`.
        roll: the status of that target.
        rank: of the Jacobian at home.
    """

    names: tuple[str, ...]
    here: str
    found: int
    other: Configuration | None
    rolled: int
    roll: Status
    rank: int


@lru_cache(maxsize=64)
def facts(robot: Robot) -> Facts:
    """Solve for the pose of home, and for the one that is rolled."""
    names = branch_names(robot)
    T, q = fk(robot, robot.q_home), robot.q_home
    _, solutions = _exact(robot, T)
    turns = robot.revolute
    away = [float(np.abs(np.angle(np.exp(1j * (s.q - q)[turns]))).sum()) for s in solutions]
    other = as_configuration(solutions[int(np.argmax(away))].q) if away and max(away) > 1e-3 else None
    status, rolled = _exact(robot, T @ rotation(2, ROLL))
    here = branch_of(robot, q) if names else ""
    return Facts(names, here, len(solutions), other, len(rolled), status, rank(robot, jacobian(robot, q), NEARLY))


def _exact(robot: Robot, T: Array) -> tuple[Status, tuple[IKSolution, ...]]:
    """The status of a target, and the solutions that meet the whole pose: compromises do not."""
    result = solve(robot, T, IKOptions(), robot.q_home)
    return result.status, result.solutions if result.status is Status.SOLVED else ()


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    known, home = facts(robot), as_configuration(robot.q_home)
    posture = _posture(known)
    steps = (
        Step(
            "Signs",
            "Each square root and arc cosine of the derivation has two values. A posture is one choice of signs.",
            _branches(known),
            practice="The list below has one line for each of them."
            if known.names
            else "The list shows the closest one.",
            withheld=POSTURES,
        ),
        Step(
            "The posture of the arm",
            "Look at the arm at home: at its shoulder, its elbow and its wrist.",
            posture,
            pose=Pose(home),
            practice="The list below marks the posture of the arm on show.",
            withheld=frozenset() if posture is None else POSTURES,
        ),
        Step(
            "Within the limits",
            f"The target is the pose that the tool has at home. {_many(robot)}",
            _solutions(known),
            pose=Pose(home),
            end=None if known.other is None else Pose(known.other),
            practice="The arm has changed its posture, if it has another one there. The tool is where it was.",
            withheld=POSTURES,
        ),
        Step(
            "Out of reach",
            f"The target moves straight away from the base, to {BEYOND:g} times the arm’s reach.",
            _missed(),
            practice="Drag the target away from the arm: above the list it says why it is missed, and what helps.",
            withheld=POSTURES,
        ),
    )
    by_hand = planar.steps(robot, units) if planar.is_planar(robot) else ()
    return Outline(GOAL, steps + by_hand, _check(robot, known, units), pose=Pose(home))


def _many(robot: Robot) -> str:
    if free_motions(robot, "pose"):
        return "A redundant arm has infinitely many solutions; one for each posture is counted."
    return "Solutions are counted that keep the joint limits."


def _branches(known: Facts) -> Number | Choice:
    number = len(known.names)
    if not number:
        return Choice(
            "Does this arm have a closed form, with named postures?",
            (
                Option("No", "Its axes belong to no family with names: solutions are found, but not named.", True),
                Option("Yes", "A closed form would name them."),
            ),
        )
    signs = number.bit_length() - 1
    exact = 2**signs == number
    method = (
        f"{signs} × a choice of two: 2 to the power {signs}."
        if exact
        else "Each choice of signs that leads to a solution is one."
    )
    mistakes = [(1, "One pose, but several ways to hold it: think of the elbow.")]
    if exact and signs > 2:
        mistakes.append((2 * signs, "The choices are independent: multiply, do not add."))
    return count("How many postures does the closed form of this arm have?", number, method, mistakes)


def _posture(known: Facts) -> Choice | None:
    if len(known.names) < 2:
        return None
    here = known.here.split(" · ")
    # Wrong options differ in one part each.
    wrong: list[tuple[str, str]] = []
    for name in known.names:
        parts = name.split(" · ")
        differing = [a for a, b in zip(parts, here, strict=True) if a != b]
        if len(differing) == 1 and len(wrong) < 3:
            wrong.append((name, f"All but “{differing[0]}” is right."))
    if not wrong:
        wrong = [(name, "Not the signs of this configuration.") for name in known.names if name != known.here][:3]
    return one_right(
        "Which posture does the arm have at home?",
        (known.here, "These are the signs of the joint values at home."),
        wrong,
        len(wrong) // 2,
    )


def _solutions(known: Facts) -> Number:
    return count(
        "How many postures reach this target within the joint limits?",
        known.found,
        "Those count that are neither outside limits nor without a real solution.",
        [(len(known.names), "That many postures exist, but joint limits exclude some of them here.")],
    )


def _missed() -> Choice:
    """Nothing is reached there: the reach is an upper bound."""
    return Choice(
        "How many postures reach it?",
        (
            Option(
                "As many as before", "Beyond the reach, the triangle of shoulder, elbow and wrist does not close."
            ),
            Option("One, the stretched arm", "Exactly one at the border of the workspace; beyond it, none."),
            Option("None", "The cosine rule would need a cosine above 1: no real solution.", True),
        ),
    )


def _check(robot: Robot, known: Facts, units: Units) -> tuple[Number | Choice, ...]:
    every = known.rank == 6
    ways = f"At home the Jacobian has rank {known.rank}: so many of the six coordinates can be chosen freely."
    pose = Choice(
        "A pose has six coordinates. Can small motions of the joints from home change each of them at will?",
        (Option("Yes", ways, every), Option("No", ways, not every)),
    )
    return pose, _many_or_few(robot, known), _rolled(known, units)


def _many_or_few(robot: Robot, known: Facts) -> Choice:
    """Whether the configurations that hold a pose can be counted."""
    free = free_motions(robot, "pose")
    why = f"Of {_counted(robot.n, 'joint')}, {robot.n - free} move the tool independently. "
    why += f"That leaves {_counted(free, 'self-motion')}." if free else "None is left for a self-motion."
    options = [
        Option("Infinitely many", why, free > 0),
        Option("Finitely many, one per posture", why, free == 0),
    ]
    if free or known.found > 1 or robot.n >= 6:  # with fewer joints there may be a single one
        options.append(Option("Exactly one", "Signs can be chosen: elbow up or down, for one."))
    return Choice(
        "How many configurations hold one pose that the arm can reach, away from singularities and limits?",
        tuple(options),
    )


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _rolled(known: Facts, units: Units) -> Choice:
    """Whether the pose of home can be rolled."""
    if known.rolled:
        why = f"{known.rolled} posture{'s reach' if known.rolled > 1 else ' reaches'} it within the joint limits."
    elif known.roll is Status.LIMITS:
        why = "The postures that would reach it are outside the joint limits."
    elif known.rank < 6:
        why = f"The rank is {known.rank} of six: this roll is not among the motions of the tool."
    else:
        why = "The point can be reached, but not with this orientation."
    return Choice(
        f"The pose of home is rolled by {units.angles.brief(ROLL)} about the approach. Can the arm take it?",
        (Option("Yes", why, known.rolled > 0), Option("No", why, not known.rolled)),
    )
