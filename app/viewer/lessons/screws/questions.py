"""What the lesson "Screws" teaches and asks."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.guide.outline import (
    LEAST,
    PLAIN,
    Choice,
    Mistake,
    Number,
    Outline,
    Pose,
    Step,
    apart,
    count,
    one_right,
    two_percent,
)
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.screws.product import foot
from kin import Robot, screws
from kin.transforms import Array
from kin.units import Units, fixed

GOAL = "You can write down the screw of every joint, and multiply their exponentials to the pose of the tool."
NONE, SCREWS = frozenset[str](), frozenset({"screws"})
SPACE = {"form": "space", "axes": "zero"}
ALONG = 0.99  # cosine; an axis within 8° of a coordinate axis is called by its name


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    found = screws(robot)
    home, zeros = as_configuration(robot.q_home), np.zeros(robot.n)
    zero = as_configuration(zeros) if robot.in_limits(zeros) else home
    steps = [
        Step(
            "Six numbers for an axis",
            "All joints are at zero. A screw is (ω, v): ω is the direction of the axis, and v = −ω × p, with any "
            "point p of the axis, is the velocity at the origin while the joint turns at 1 rad/s.",
            _direction(robot, found.S),
            pose=Pose(zero, drawing=SPACE),
            withheld=SCREWS,
            practice="The table shows the screws of all joints; each line in the scene is one of them.",
        ),
        Step(
            "How far the axis is",
            "p may be any point of the axis: along the axis, ω × p does not change. So v depends on the line."
            + _line(robot, units, found.S),
            _distance(robot, units, found.S),
            pose=Pose(zero, drawing=SPACE),
            withheld=SCREWS,
            practice="The dimension |v| in the scene is this distance, the red arrow the direction of v.",
        ),
        Step(
            "A joint that slides",
            "A prismatic joint turns nothing, and every point moves alike.",
            _prismatic(robot),
            _slider(robot),
        ),
        Step(
            "The product",
            "T = exp([S₁] θ₁) … exp([Sₙ] θₙ) M, with the screws and the pose M of the tool at zero. The screws "
            "stay as they are while the arm moves.",
            _order(robot),
            pose=Pose(home),
            practice="Move the slider Factors: the ghost shows what the factors give. At the end it is the arm.",
        ),
        Step(
            "Body form",
            "T = M exp([B₁] θ₁) … exp([Bₙ] θₙ): the same axes, seen from the tool at zero.",
            _body(robot, units, found.B),
            "The product is the same.",
            withheld=SCREWS,
            practice="Choose the form Body to see it, to the last digit shown.",
        ),
    ]
    return Outline(GOAL, tuple(steps), _check(robot, units, found.S), (NONE, NONE, NONE, SCREWS), Pose(home))


def far_joint(S: Array) -> int:
    """The joint with the largest v among those that turn; −1 if all axes pass through the origin."""
    size = np.where(np.linalg.norm(S[:3], axis=0) > 0.5, np.linalg.norm(S[3:], axis=0), 0.0)
    joint = int(np.argmax(size))
    return joint if size[joint] > 10.0 * LEAST else -1


def _direction(robot: Robot, S: Array) -> Number:
    """The largest component of the direction of a joint that turns, or slides if none turns."""
    joint = next((i for i in range(robot.n - 1, -1, -1) if robot.revolute[i]), 0)
    rows, letter = (S[:3], "ω") if robot.revolute[joint] else (S[3:], "v")
    axis = int(np.argmax(np.abs(rows[:, joint])))
    value = float(rows[axis, joint])
    size = "of length 1" if robot.revolute[joint] else "the direction, of length 1"
    return Number(
        f"Predict the {'xyz'[axis]} component of {letter} of joint {joint + 1}, with all joints at zero.",
        value,
        PLAIN,
        0.02,
        f"{letter} is {size}: look along which axis of the world the coloured line of joint {joint + 1} runs. The "
        "arrow shows the positive sense.",
        (Mistake(0.0, "The line is not perpendicular to this axis of the world."),),
    )


def _line(robot: Robot, units: Units, S: Array) -> str:
    """The line of the axis whose distance is asked."""
    if (joint := far_joint(S)) < 0:
        return ""
    point = axes_at(robot, np.zeros(robot.n))[0][joint]
    omega = ", ".join(fixed(value) for value in S[:3, joint].tolist())
    place = ", ".join(units.lengths.number(value) for value in point.tolist())
    return (
        f" With all joints at zero, axis {joint + 1} has ω = ({omega}) and passes through "
        f"p = ({place}){units.lengths.suffix}."
    )


def _distance(robot: Robot, units: Units, S: Array) -> Number:
    joint = far_joint(S)
    if joint < 0:
        return count(
            "All axes that turn pass through the origin of the world. How long is v of each?",
            0,
            "v = −ω × p, and p = 0 is a point of the axis.",
            [(1, "That is the length of ω.")],
        )
    answer = float(np.linalg.norm(S[3:, joint]))
    origin = float(np.linalg.norm(axes_at(robot, np.zeros(robot.n))[0][joint]))
    return apart(
        Number(
            f"How far is the axis of joint {joint + 1} from the origin of the world? It is the length of v.",
            answer,
            units.lengths,
            two_percent(answer),
            "v = −ω × p, and |v| = |ω| · distance with |ω| = 1. Multiply ω × p, and take the root of the squares.",
            (
                Mistake(origin, "That is the distance of a frame on the axis; the perpendicular is shorter."),
                Mistake(float(np.abs(S[3:, joint]).max()), "That is one component of v only."),
            ),
        )
    )


def _prismatic(robot: Robot) -> Choice:
    return one_right(
        "What is the screw of a prismatic joint?",
        ("ω = 0, v = its direction", "Nothing turns, and each point moves along the direction at 1 m/s."),
        [
            ("ω = its direction, v = 0", "That turns: an axis through the origin."),
            ("ω = 0, v = −ω × p", "With ω = 0 nothing at all would move."),
        ],
        1,
    )


def _slider(robot: Robot) -> str:
    slides = [i + 1 for i in range(robot.n) if not robot.revolute[i]]
    if not slides:
        return "This arm has none. The SCARA and the Stanford arm have one."
    return f"See row {slides[0]} of the table: its ω is zero, and its place does not matter."


def _order(robot: Robot) -> Choice:
    if robot.n == 1:
        return one_right(
            "The arm has one joint. What does its factor act on?",
            ("On the pose M of the tool at zero", "T = exp([S₁] θ₁) M."),
            [("On the world frame", "M is multiplied from the left: the tool is moved.")],
            0,
        )
    return one_right(
        "Read from the right: which joint moves the tool first, starting at M?",
        (
            f"Joint {robot.n}",
            f"Its factor is next to M. When it acts, the joints before it are still at zero, so S{_low(robot.n)} "
            "is where it was at zero.",
        ),
        [("Joint 1", f"Its factor acts last, and takes the joints 2 to {robot.n} along.")],
        0,
    )


def _low(number: int) -> str:
    return str(number).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))


def _body(robot: Robot, units: Units, B: Array) -> Number:
    """|v| of the last joint in the body form."""
    last = robot.n - 1
    answer = float(np.linalg.norm(B[3:, last]))
    if not robot.revolute[last]:
        return Number(
            f"How long is v of joint {robot.n} in the body form?",
            1.0,
            PLAIN,
            0.02,
            "A prismatic joint has ω = 0 and a direction of length 1, in any frame.",
            (Mistake(0.0, "Then the joint would do nothing."),),
        )
    method = "The origin is now the tool point: |v| is its distance from the axis of the last joint."
    wrong = Mistake(1.0, "That is the length of ω.")
    if answer <= 2.0 * LEAST:
        tolerance = 10.0 * LEAST
        return Number(_last(robot), 0.0, units.lengths, tolerance, f"{method} The tool is on it.", (wrong,))
    question = Number(_last(robot), answer, units.lengths, two_percent(answer), method, (wrong,))
    return apart(question)


def _last(robot: Robot) -> str:
    return f"How long is v of joint {robot.n} in the body form?"


def _check(robot: Robot, units: Units, S: Array) -> tuple[Number | Choice, ...]:
    free = count(
        "A revolute joint: |ω| = 1, and v is perpendicular to ω. How many of the six numbers are free?",
        4,
        "Six numbers less two conditions. A line in space has four parameters, as many as a row of a DH table.",
        [(6, "Two conditions hold between them."), (5, "There are two conditions: |ω| = 1 and ω · v = 0.")],
    )
    zero = one_right(
        "All joints are at zero. What is the product?",
        ("M", "Each factor is the identity: exp(0) = I."),
        [
            ("The identity", "The tool is at M, not at the origin of the world."),
            ("Zero", "A pose is never zero: the exponential of zero is the identity."),
        ],
        2,
    )
    moved = one_right(
        "The origin of the world is moved onto the axis of a revolute joint. What changes in its screw?",
        ("v becomes zero", "p = 0 is then a point of the axis. The direction ω stays."),
        [
            ("ω becomes zero", "ω is the direction of the axis, wherever the origin is."),
            ("Nothing", "v = −ω × p depends on the origin; only ω does not."),
        ],
        0,
    )
    joint = far_joint(S)
    if joint < 0:
        return free, zero, moved
    point = foot(S[:, joint])
    axis = int(np.argmax(np.abs(point)))
    value = float(point[axis])
    nearest = apart(
        Number(
            f"p = ω × v is the point of an axis nearest to the origin. What is its {'xyz'[axis]} for joint "
            f"{joint + 1}, with ω = ({', '.join(fixed(x) for x in S[:3, joint].tolist())}) and "
            f"v = ({', '.join(fixed(x) for x in S[3:, joint].tolist())}) m/s?",
            value,
            units.lengths,
            two_percent(value),
            "Multiply ω × v; the result is in metres.",
            (Mistake(-value, "That is v × ω: the order matters."),),
        )
    )
    return free, zero, moved, nearest
