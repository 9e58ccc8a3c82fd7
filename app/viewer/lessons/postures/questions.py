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
    Step,
    count,
    one_right,
)
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.postures import planar
from app.viewer.scene.chain import rotation
from kin import IKOptions, Robot, branch_names, branch_of, fk
from kin.ik import solve
from kin.units import Units

GOAL = "You can say how many postures reach a target, what tells them apart, and why a target is missed."
ROLL = math.radians(30.0)
BEYOND = 1.2  # reaches: a target that no arm has


class Facts(NamedTuple):
    """What inverse kinematics says about the pose that the arm has at home.

    Attributes:
        names: of all branches.
        here: the branch of home.
        found: the solutions within the limits.
        other: the solution that differs most from home; None if there is no other one.
        far: the status for the same orientation at a point that is too far away.
        rolled: how many solutions within the limits there are if the tool is rolled by `ROLL`.
    """

    names: tuple[str, ...]
    here: str
    found: int
    other: Configuration | None
    far: str
    rolled: int


@lru_cache(maxsize=64)
def facts(robot: Robot) -> Facts:
    """Solve for the pose of home."""
    names = branch_names(robot)
    T, q = fk(robot, robot.q_home), robot.q_home
    solutions = solve(robot, T, IKOptions(), q).solutions
    turns = robot.revolute
    away = [float(np.abs(np.angle(np.exp(1j * (s.q - q)[turns]))).sum()) for s in solutions]
    other = as_configuration(solutions[int(np.argmax(away))].q) if away and max(away) > 1e-3 else None
    far = T.copy()
    out = far[:3, 3] - robot.T_world_base[:3, 3]
    size = float(np.linalg.norm(out))
    far[:3, 3] = robot.T_world_base[:3, 3] + BEYOND * robot.reach * (out / size if size else np.eye(3)[0])
    status = solve(robot, far, IKOptions(), q).status
    rolled = len(solve(robot, T @ rotation(2, ROLL), IKOptions(), q).solutions)
    return Facts(names, branch_of(robot, q) if names else "", len(solutions), other, status, rolled)


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    known, home = facts(robot), as_configuration(robot.q_home)
    steps = (
        Step(
            "Signs",
            "Each square root and arc cosine of the derivation has two values. A posture is one choice of signs.",
            _branches(known),
            "The list below has one line for each of them." if known.names else "The list shows the closest one.",
        ),
        Step(
            "The posture of the arm",
            "Look at the arm at home: at its shoulder, its elbow and its wrist.",
            _posture(known),
            "The list below marks the posture of the arm on show.",
            start=home,
        ),
        Step(
            "Within the limits",
            f"The target is the pose that the tool has at home. {_many(robot)}",
            _solutions(known),
            "The arm has changed its posture, if it has another one there. The tool is where it was.",
            start=home,
            end=known.other,
        ),
        Step(
            "Out of reach",
            f"The target moves straight away from the base, to {BEYOND:g} times the arm’s reach.",
            _missed(known),
            "Drag the target away from the arm: above the list it says why it is missed, and what helps.",
        ),
    )
    by_hand = planar.steps(robot, units) if planar.is_planar(robot) else ()
    return Outline(GOAL, steps + by_hand, _check(robot, known, units))


def _many(robot: Robot) -> str:
    if robot.n > 6:
        return "A redundant arm has infinitely many solutions; one for each posture is counted."
    return "Solutions are counted that keep the joint limits."


def _branches(known: Facts) -> Number | Choice:
    number = len(known.names)
    if not number:
        return Choice(
            "Does this arm have a closed form, with named postures?",
            (
                Option("No", "Its axes belong to no family with names: solutions are found, but not named.", True),
                Option("Yes", "The list below would name them then."),
            ),
        )
    signs = number.bit_length() - 1
    exact = 2**signs == number
    method = f"{signs} × a choice of two: 2 to the power {signs}." if exact else "Count the list below."
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
        "Count the lines of the list that are neither outside limits nor without a real solution.",
        [(len(known.names), "That many postures exist, but joint limits exclude some of them here.")],
    )


def _missed(known: Facts) -> Choice:
    reached = known.far == "solved"
    return Choice(
        "How many postures reach it?",
        (
            Option(
                "As many as before", "Beyond the reach, the triangle of shoulder, elbow and wrist does not close."
            ),
            Option("One, the stretched arm", "Exactly one at the border of the workspace; beyond it, none."),
            Option("None", "The cosine rule would need a cosine above 1: no real solution.", not reached),
            *(
                (Option("Some", "This arm has a prismatic joint, which is longer than its reach.", True),)
                if reached
                else ()
            ),
        ),
    )


def _check(robot: Robot, known: Facts, units: Units) -> tuple[Number | Choice, ...]:
    any_pose = robot.n >= 6
    pose = Choice(
        "A pose has six coordinates. Can this arm take every pose near the one at home?",
        (
            Option("Yes", _joints(robot.n), any_pose),
            Option("No", _joints(robot.n), not any_pose),
        ),
    )
    infinite = robot.n > 6
    many = Choice(
        "How many configurations hold one pose that the arm can reach, away from singularities and limits?",
        (
            Option(
                "Infinitely many", f"That needs more joints than conditions; this arm has {robot.n}.", infinite
            ),
            Option("A few, one per posture", f"The arm has {robot.n} joints for six conditions.", not infinite),
            Option("Exactly one", "Signs can be chosen: elbow up or down, for one.", False),
        ),
    )
    return pose, many, _rolled(robot, known, units)


def _rolled(robot: Robot, known: Facts, units: Units) -> Choice:
    """Whether the pose of home can be rolled."""
    if known.rolled:
        why = f"{known.rolled} posture{'s reach' if known.rolled > 1 else ' reaches'} it within the joint limits."
    elif robot.n < 6:
        why = f"{robot.n} joints leave no choice of the roll at a point with an approach direction."
    else:
        why = "The postures that would reach it are outside the joint limits."
    return Choice(
        f"The pose of home is rolled by {units.angles.brief(ROLL)} about the approach. Can the arm take it?",
        (Option("Yes", why, known.rolled > 0), Option("No", why, not known.rolled)),
    )


def _joints(n: int) -> str:
    if n < 6:
        return f"{n} joints can meet {n} conditions. The rest of the pose follows."
    return f"{n} joints are enough for six conditions."
