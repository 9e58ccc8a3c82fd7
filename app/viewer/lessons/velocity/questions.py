"""What the lesson "Velocity" teaches and asks."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.guide.outline import (
    PLAIN,
    Choice,
    Mistake,
    Number,
    Option,
    Outline,
    Pose,
    Step,
    apart,
    count,
    one_right,
    two_percent,
)
from app.viewer.lessons.guide.poses import as_configuration
from kin import Robot, Singularity, fk, jacobian, singularities
from kin.axes import NEARLY, joint_axes, size
from kin.differential.task import lifts, natural_task, rank, task_jacobian, usual_rank
from kin.ik.messages.singularity import short
from kin.transforms import Array
from kin.units import Unit, Units

GOAL = "You can read the columns of the Jacobian, predict speeds and joint torques, and explain a singularity."
SPEED, TORQUE, FORCE = Unit("m/s", 1.0, 3), Unit("N·m", 1.0, 2), Unit("N", 1.0, 2)
LOAD = 10.0  # N
JACOBIAN = frozenset({"jacobian", "torques"})
LEAST = 5e-4  # m/s: speeds are shown with three decimals


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    home, J = as_configuration(robot.q_home), jacobian(robot, robot.q_home)
    k = _heavy(robot, J)
    found = singular(robot)
    steps = [
        Step(
            "A column",
            "Column i of the Jacobian is the velocity of the tool if only joint i moves, at 1 rad/s or 1 m/s.",
            _column(robot, J),
            pose=Pose(home),
            withheld=JACOBIAN,
            practice="Press 1 under Column: the straight arrow is v, the round one ω.",
        ),
        Step(
            "Turning",
            "The lower three rows are ω, the angular velocity of the tool.",
            _omega(robot, robot.n - 1),
            "ω of a revolute joint is its axis as a unit vector, wherever the tool is.",
            pose=Pose(home),
            withheld=JACOBIAN,
        ),
        Step(
            "Torques from a force",
            f"A weight of {LOAD:g} N hangs on the tool. The joints hold it: τ = −Jᵀ f with f = (0, 0, −{LOAD:g}).",
            _torque(robot, J, k),
            "A column of J says what its joint does to the tool, and what a force does to its joint.",
            pose=Pose(home),
            withheld=JACOBIAN,
        ),
    ]
    if found is not None:
        q, near = found
        steps.append(
            Step(
                "A singular configuration",
                f"From home, the arm moves to a singularity: {short(near, units)}.",
                _rank(robot, q),
                pose=Pose(home),
                end=Pose(as_configuration(q)),
                withheld=frozenset({"ellipsoid", "singularities"}),
                practice="The ellipsoid is flat now, and the warning above names the motion that is lost.",
            )
        )
    return Outline(GOAL, tuple(steps), _check(robot, J), (JACOBIAN,), Pose(home))


def singular(robot: Robot) -> tuple[Array, Singularity] | None:
    """A singular configuration within the limits that is one joint away from home, and what aligns there."""
    for near in singularities(robot, robot.q_home):
        if len(near.met_at) != 1 or near.kind in ("algorithmic", "jacobian"):
            continue
        (joint, value), q = near.met_at[0], robot.q_home.copy()
        q[joint] = value
        within = robot.lower[joint] <= value <= robot.upper[joint]
        if within and rank_of(robot, q) < usual_rank(robot, natural_task(robot)):
            return q, near
    return None


def rank_of(robot: Robot, q: Array) -> int:
    """The rank of the Jacobian of the arm's task."""
    return rank(robot, task_jacobian(robot, q))


def torque(J: Array, joint: int) -> float:
    """What a joint applies (N·m, or N) to hold a weight of `LOAD` at the tool."""
    return float(-J[:3, joint] @ np.array([0.0, 0.0, -LOAD]))


def _heavy(robot: Robot, J: Array) -> int:
    """The joint that carries most."""
    return int(np.argmax([abs(torque(J, k)) for k in range(robot.n)]))


def _column(robot: Robot, J: Array) -> Number:
    speed = float(np.linalg.norm(J[:3, 0]))
    if robot.joints[0].kind == "prismatic":
        method = "A prismatic joint carries the tool along with its own speed."
    else:
        method = (
            "On a circle, speed is angular velocity times radius; the radius is the tool’s distance from axis 1."
        )
    point = joint_axes(robot)[0].point
    question = Number(
        "Joint 1 moves at 1 rad/s (1 m/s if it slides). How fast is the tool point, with the arm at home?",
        speed,
        SPEED,
        two_percent(speed),
        method,
        (
            Mistake(
                float(np.linalg.norm(fk(robot, robot.q_home)[:3, 3] - point)),
                "Only the distance perpendicular to the axis counts.",
            ),
        ),
    )
    return apart(question, LEAST)


def _omega(robot: Robot, k: int) -> Number:
    turns = robot.joints[k].kind == "revolute"
    method = (
        "A prismatic joint turns nothing." if not turns else "The tool turns with the joint, at the joint’s speed."
    )
    return Number(
        f"How long is ω in column {k + 1}?",
        float(np.linalg.norm(jacobian(robot, robot.q_home)[3:, k])),
        PLAIN,
        0.01,
        f"{method} Its length is {'1' if turns else '0'} rad/s per unit speed.",
        (Mistake(0.0, "A revolute joint turns the tool, even if the tool point is on its axis."),)
        if turns
        else (Mistake(1.0, "A prismatic joint slides; nothing turns."),),
    )


def _torque(robot: Robot, J: Array, k: int) -> Number:
    turns = robot.joints[k].kind == "revolute"
    prompt = f"Which {'torque' if turns else 'force'} does joint {k + 1} apply at home? (The arm has no weight.)"
    unit = TORQUE if turns else FORCE
    least = 0.25 * LOAD * NEARLY * (size(robot) if turns else 1.0)
    if not lifts(robot, J, k):
        method = "At home no joint raises or lowers the tool, so no joint carries the weight: the structure does."
        return Number(prompt, 0.0, unit, least, method)
    value = torque(J, k)
    question = Number(
        prompt,
        value,
        unit,
        two_percent(value),
        f"Only vz counts: {LOAD:g} N times the third entry of column {k + 1}.",
        (
            Mistake(-value, "That is the torque of the weight. The joint holds against it."),
            Mistake(value / LOAD, f"That is the lever, in metres. Multiply by {LOAD:g} N."),
        ),
    )
    return apart(question, least)


def _rank(robot: Robot, q: Array) -> Number:
    usual = usual_rank(robot, natural_task(robot))
    return count(
        f"Elsewhere the Jacobian of the arm’s task has rank {usual}. Which rank does it have there?",
        rank_of(robot, q),
        "Each motion of the tool that is lost takes one away.",
        [(usual, "Then no motion would be lost, and the configuration would not be singular.")],
    )


def _check(robot: Robot, J: Array) -> tuple[Number | Choice, ...]:
    vertical = lifts(robot, J, 0)
    why = (
        "Its column has a vertical part: the weight works on it."
        if vertical
        else "Its column has no vertical part, so a vertical force does no work on it: the structure carries it."
    )
    first = Choice(
        "Does joint 1 have to hold against a weight at the tool, with the arm at home?",
        (Option("Yes", why, vertical), Option("No", why, not vertical)),
    )
    values = np.linalg.svd(J[:3], compute_uv=False)
    fastest = apart(
        Number(
            "The largest singular value of the upper three rows is the longest semi-axis of the velocity "
            "ellipsoid. How long is it at home?",
            float(values[0]),
            SPEED,
            two_percent(float(values[0])),
            "Read the semi-axes under Ellipsoid, with Linear velocity on show and the arm at home.",
            (Mistake(float(values[-1]), "That is the shortest one: the slowest direction."),),
        ),
        LEAST,
    )
    near = one_right(
        "The tool moves at a constant speed and comes close to a singularity. What happens to the joints?",
        ("Some of them become very fast", "q̇ grows as 1/σ in the direction that is about to be lost."),
        [
            ("They slow down", "That would make the tool even slower: σ is small, so q̇ has to be large."),
            ("They keep their speed", "Then the tool would slow down in the direction that is about to be lost."),
        ],
        0,
    )
    return first, fastest, near
