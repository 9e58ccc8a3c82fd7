"""What the lesson "Redundancy" teaches and asks."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.guide.outline import PLAIN, Choice, Number, Option, Outline, Pose, Step, count, one_right
from app.viewer.lessons.guide.poses import as_configuration
from kin import Robot, jacobian
from kin.axes import NEARLY
from kin.differential.task import free_motions, rank
from kin.transforms import Array
from kin.units import Units, fixed

GOAL = "You can say how many motions of the joints leave the tool in place, and which joints take part in them."
STILL = 1e-6
NULL_SPACE = frozenset({"null space"})


def null_vector(robot: Robot) -> Array:
    """Joint speeds ``(n,)`` of norm 1 that do not move the tool at home; zeros if there are none."""
    J = jacobian(robot, robot.q_home)
    free: Array = np.linalg.svd(J)[2][rank(robot, J, NEARLY) :]
    if not len(free):
        return np.zeros(robot.n)
    # Of several, the direction in which a single joint moves most.
    joint = int(np.argmax(np.linalg.norm(free, axis=0)))
    direction: Array = free.T @ free[:, joint]
    return direction / float(np.linalg.norm(direction))


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    free, home = free_motions(robot, "pose"), as_configuration(robot.q_home)
    z = null_vector(robot)
    steps = [
        Step(
            "Joints and conditions",
            f"The arm has {robot.n} joints. A tool at rest is six conditions on the joint speeds: J q̇ = 0.",
            _dimension(robot, free),
            withheld=NULL_SPACE,
            practice="One such motion is a slider below."
            if free
            else "Choose an arm of seven joints to see a self-motion.",
        ),
        Step(
            "Only the point",
            "Now the tool may turn, and only its point has to stay.",
            _point(robot),
            "For a task of fewer conditions an arm of six joints is redundant too.",
            practice="Choose Point only (tab Move, Target must match), and a joint leads below.",
        ),
    ]
    if np.any(z):
        steps.append(
            Step(
                "Who moves",
                "At home, the null space of J gives the joint speeds of the self-motion. The tool stays.",
                _mover(robot, z),
                "The speeds of the joints are " + _speeds(z) + ", times any factor.",
                practice="Sweep the redundancy parameter: the joints move in this proportion at first.",
            )
        )
    return Outline(GOAL, tuple(steps), _check(robot, free), (frozenset(), NULL_SPACE), Pose(home))


def _speeds(z: Array) -> str:
    return "(" + ", ".join(fixed(value, 2) for value in z.tolist()) + ")"


def _dimension(robot: Robot, free: int) -> Number:
    return count(
        "How many independent self-motions does the arm have?",
        free,
        "The number of joints less the rank of J, which is six at most.",
        (
            (robot.n, "That is the number of joints. Conditions on the tool take some away."),
            (6, "That is the number of conditions, not of what is left."),
        ),
    )


def _point(robot: Robot) -> Number:
    return count(
        "How many independent motions of the joints leave the tool point where it is?",
        free_motions(robot, "position"),
        "The number of joints less the rank of the upper three rows of J.",
        [(robot.n, "Each condition that is independent of the others takes one away.")],
    )


def _mover(robot: Robot, z: Array) -> Choice:
    size = np.abs(z)
    most = int(np.argmax(size))
    wrong = [
        (f"Joint {k + 1}", "It stands still." if size[k] < STILL else f"Its speed is {fixed(size[k], 2)} only.")
        for k in np.argsort(size).tolist()
        if size[k] < size[most] - 1e-6
    ]
    even = [f"Joint {k + 1}" for k in range(robot.n) if size[k] >= size[most] - 1e-6]
    options = [Option(text, reason) for text, reason in wrong[:2] + wrong[2:][-1:]]
    options[1:1] = [Option(name, f"Its speed is {fixed(size[most], 2)}, the largest.", True) for name in even[:2]]
    if len(options) == len(even[:2]):
        options.append(
            Option("None of them", "The null space of J is not empty: joints move while the tool stays.")
        )
    return Choice("Which joint moves most?", tuple(options))


def _check(robot: Robot, free: int) -> tuple[Number | Choice, ...]:
    z = null_vector(robot)
    speed = float(np.linalg.norm(jacobian(robot, robot.q_home) @ z))
    tool = Number(
        "Joint speeds of the null space, at one unit: how fast does the tool point move?",
        speed,
        PLAIN,
        0.001,
        "That is what the null space is: J q̇ is zero.",
    )
    redundant = Choice(
        "Is this arm redundant for a full pose?",
        (
            Option("Yes", _count(robot, free), free > 0),
            Option("No", _count(robot, free), free == 0),
        ),
    )
    lock = one_right(
        "One joint that takes part in the only self-motion is locked. How many self-motions remain?",
        ("None", "A locked joint is one more condition, and it was the only motion left."),
        [
            ("One, the same", "It would move the locked joint."),
            ("One, of the other joints", "The speeds of the null space are in fixed proportion: all or none."),
        ],
        1,
    )
    return tool, redundant, lock


def _count(robot: Robot, free: int) -> str:
    return f"It has {robot.n} joints, and the rank of its Jacobian is {robot.n - free}."
