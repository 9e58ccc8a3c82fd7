"""What the lesson teaches and asks: a step of the derivation each, for one target and the branch followed."""

from __future__ import annotations

import math
from functools import lru_cache

from app.viewer.lessons.guide.outline import (
    Choice,
    Drawn,
    Mistake,
    Number,
    Option,
    Outline,
    Pose,
    Question,
    Step,
    Way,
    apart,
    count,
    one_right,
)
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.inverse import mistakes, words
from app.viewer.lessons.inverse.arm import Arm, arm_of
from app.viewer.lessons.inverse.exercise import Exercise, example, exercise, part_of
from app.viewer.lessons.inverse.sheet import DerivedStep, StepKey
from kin import Robot
from kin.units import Units, fixed

GOAL = (
    "You can solve the inverse kinematics of an arm by hand, step by step, and say where each solution comes from "
    "and where the derivation ends."
)
POSTURES = frozenset({"postures"})  # withheld while it is asked how many of them there are
TURNS = frozenset({"angles"})  # and while joint angles are asked, of which roll, pitch and yaw may be sums
LENGTH, ANGLE = 0.001, math.radians(0.5)
_METHODS: dict[StepKey, str] = {
    "theta2": "θ₂ = atan2(h, ρ) − β, with β = atan2(forearm · sin θ₃, upper arm + forearm · cos θ₃).",
    "shoulder": "θ₁ = atan2(k_y, k_x), or the opposite direction.",
    "last": "θ₃ = φ − θ₁ − θ₂.",
}


@lru_cache(maxsize=64)
def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm, with a target near its home."""
    arm = arm_of(robot)
    return _others(robot) if arm is None else outline_of(exercise(arm, example(arm)), units)


def keys_of(arm: Arm) -> tuple[StepKey, ...]:
    """The steps of an arm's derivation."""
    if arm.family == "planar":
        return ("centre", "elbow", "theta1", *(("last",) if arm.robot.n == 3 else ()), "joints")
    if arm.family == "srs7":
        return "centre", "elbow", "circle", "shoulder", "wrist", "joints"
    return "centre", "theta1", "elbow", "theta2", "wrist", "joints"


def outline_of(given: Exercise, units: Units) -> Outline:
    """The outline for a target and the branch that is followed."""
    steps = tuple(_step(given, key, units) for key in keys_of(given.arm))
    return Outline(GOAL, steps, _check(given, units), pose=Pose(as_configuration(given.q)))


def _step(given: Exercise, key: StepKey, units: Units) -> Step:
    arm, found = given.arm, given.followed.derivation.step(key)
    text = words.step_text(arm, key, units)
    if key == "centre":
        text = f"{_target(given, units)} {text}"
    start = as_configuration(given.q)
    if key == "joints":
        end = (
            Pose(as_configuration(given.followed.q))
            if given.followed.available and given.followed.q is not None
            else None
        )
        shown = f"The numbers below lead to the branch {given.followed.name}. Choose another one with Follow."
        limits = _limits(given)
        return Step(words.title(arm, key), text, limits, "", Pose(start), end, shown, withheld=POSTURES)
    if found is None:
        ended = given.followed.derivation.failed
        where = "" if ended is None else f" It ends at the step “{words.title(given.arm, ended.key)}”."
        text = f"The branch that you follow does not get here.{where}{_way_back(given)}"
        return Step(words.title(arm, key), text, pose=Pose(start))
    if found.failure is not None:
        text = f"{text} {words.failure_text(found, units)}{_way_back(given)}"
        return Step(words.title(arm, key), text, pose=Pose(start))
    asked, special = _question(given, found, units), words.special_text(arm, found)
    turn = asked is not None and asked.unit == units.angles
    return Step(
        words.title(arm, key),
        f"{text} {special}".rstrip(),
        asked,
        pose=Pose(start),
        practice=_shown(given, found),
        withheld=TURNS if turn else frozenset(),
        drawn=_drawn(given, key) if turn else None,
    )


def _way_back(given: Exercise) -> str:
    back = given.way_back
    return "" if back is None else f" To go on, press “{words.follow(back.number)}” below."


def _drawn(given: Exercise, key: StepKey) -> Drawn:
    """A wrong angle is drawn as the posture of the branch with it; if the branch ends, as that of the arm."""
    arm, branch = given.arm, given.followed
    joint = int(mistakes.split_name(key, branch.derivation)[1:]) - 1
    q = as_configuration(given.q if branch.q is None else branch.q)
    return Drawn(q, joint, float(arm.sense[joint]), float(arm.offset[joint]))


def _target(given: Exercise, units: Units) -> str:
    v = given.followed.derivation.number
    axes = "xy" if given.arm.family == "planar" else "xyz"
    unit = units.lengths
    point = ", ".join(unit.number(v(f"p_{axis}")) for axis in axes)
    text = f"The target: p = ({point}){unit.suffix}"
    if given.arm.robot.n == 3:
        return f"{text}, and the tool points along φ = {units.angles.text(math.atan2(v('x_y'), v('x_x')))}."
    if given.arm.family == "planar":
        return f"{text}."
    direction = ", ".join(fixed(v(f"a_{axis}")) for axis in axes)
    return f"{text}, a = ({direction})."


def _shown(given: Exercise, found: DerivedStep) -> str:
    if found.split < 0 or found.special is not None:
        return "The numbers of this step are below now, and follow the target."
    here = part_of(given.arm, given.followed.derivation, found.split)
    other = part_of(given.arm, given.beside(found.split).derivation, found.split)
    return f"You follow “{here}”. The other way is “{other}”."


def _question(given: Exercise, found: DerivedStep, units: Units) -> Number | None:
    """What a step asks for; None where an angle is free."""
    if found.free:
        return None
    arm, derivation = given.arm, given.followed.derivation
    if found.key == "circle":
        return _circle(given, units)
    if found.key == "centre":
        return _centre(given, units)
    name = mistakes.split_name(found.key, derivation)
    answer = derivation.number(name)
    ways: tuple[Way, ...] = ()
    named = ""
    if found.split >= 0:
        named = f"This is “{part_of(arm, derivation, found.split)}”, which you follow."
        other = given.beside(found.split).derivation
        if name in other.values and found.special is None:
            value, part = units.angles.text(other.number(name)), part_of(arm, other, found.split)
            ways = (Way(other.number(name), f"Right, {value}: this is the way “{part}”."),)
    prompt = f"How large is {words.sub(name)}?" + (" Either way is right." if ways else "")
    known = mistakes.of_angle(given, found.key, units.angles)
    method = _method(given, found.key)
    return apart(Number(prompt, answer, units.angles, ANGLE, method, known, True, ways, named), ANGLE)


def _method(given: Exercise, key: StepKey) -> str:
    derivation = given.followed.derivation
    if key == "theta1":
        if "l1" in derivation.values:
            return "θ₁ = atan2(w_y, w_x) − β, with β = atan2(l₂ sin θ₂, l₁ + l₂ cos θ₂)."
        if given.arm.lengths.get("b"):
            return "θ₁ = atan2(w_y, w_x) − atan2(b, X), with X = ±√(r² − b²)."
        return "θ₁ = atan2(w_y, w_x) in front of axis 1, atan2(−w_y, −w_x) behind it."
    if key == "wrist":
        if "u" in derivation.values:
            return "θ₄ = atan2(−u_y, −u_x), or atan2(u_y, u_x) with the other sign of θ₅; u = R₀₃ᵀ a."
        first = words.sub(mistakes.split_name("wrist", derivation))
        return f"{first} = atan2(N₂₃, N₁₃), or with both signs changed."
    if key == "elbow":
        one, other = (words.sub(side) for side in mistakes.SIDES[given.arm.family])
        angle = words.sub(mistakes.split_name("elbow", derivation))
        return f"cos {angle} = (D² − {one}² − {other}²) / (2 {one} {other}). Either sign of {angle} is right."
    return _METHODS[key]


def _centre(given: Exercise, units: Units) -> Number:
    derivation, arm = given.followed.derivation, given.arm
    if "D" in derivation.values and arm.robot.n == 2:
        p = derivation.number
        wrong = tuple(
            Mistake(value, reason)
            for value, reason in (
                (
                    abs(p("w_x")) + abs(p("w_y")),
                    "Coordinates do not add up to a distance: add their squares and take the root.",
                ),
                (abs(p("w_x")), "That is x alone."),
            )
        )
        return apart(
            Number(
                "How large is D, the distance of the point from joint 1?",
                p("D"),
                units.lengths,
                LENGTH,
                "D = √(x² + y²).",
                wrong,
            )
        )
    axis = mistakes.coordinate(derivation)
    last = arm.lengths.get("l3", abs(float(arm.wrist[2])))
    size = units.lengths.text(last)
    along = "direction of the last link" if arm.family == "planar" else "approach direction a"
    method = f"w = p − {size} times the {along}."
    if arm.family != "planar" and not arm.straight_tool:
        method = "w is a fixed point of the tool: rotate it into the base frame and add p."
    else:
        method += f" The wrist centre is {size} behind the tool point."
    return apart(
        Number(
            f"How large is w_{axis}?",
            derivation.number(f"w_{axis}"),
            units.lengths,
            LENGTH,
            method,
            tuple(mistakes.of_centre(derivation)),
        )
    )


def _circle(given: Exercise, units: Units) -> Number:
    v = given.followed.derivation.number
    wrong = (
        Mistake(v("A"), "That is A, the distance of the circle’s centre from the shoulder."),
        Mistake(given.arm.lengths["d3"], "That is the upper arm: the elbow is so far from S, not from the line."),
    )
    method = "A = (D² + d₃² − d₅²) / 2D along the line; the radius is √(d₃² − A²)."
    return apart(
        Number(
            "How large is the radius ρ of the circle of the elbow?", v("ρ"), units.lengths, LENGTH, method, wrong
        )
    )


def _limits(given: Exercise) -> Number:
    real = sum(branch.q is not None for branch in given.branches)
    inside = sum(branch.available for branch in given.branches)
    return count(
        "How many branches of this target are within the joint limits?",
        inside,
        f"Compare the joint values of each branch with the limits: {inside} of {len(given.branches)}.",
        [
            (real, "That many have real solutions, but joint limits exclude some of them."),
            (len(given.branches), "That is the number of all choices of signs."),
        ],
    )


# The check


def _check(given: Exercise, units: Units) -> tuple[Question, ...]:
    return _beyond(given), _singular(given), _dependence(given)


def _beyond(given: Exercise) -> Choice:
    elbow = (
        words.sub(mistakes.split_name("elbow", given.followed.derivation))
        if given.followed.q is not None
        else "of the elbow"
    )
    return one_right(
        f"The target moves away until the formula gives cos {elbow} = 1.2. What does that mean?",
        (
            "The derivation ends at this step.",
            "No real angle has this cosine: the triangle does not close, the target is too far away.",
        ),
        [
            (f"{elbow} is a little above 0.", "cos 0 = 1 is the largest cosine: arccos 1.2 does not exist."),
            ("The other elbow reaches it.", "Both elbows come from the same cosine."),
            ("The wrist makes up for it.", "The wrist does not move the wrist centre."),
        ],
        1,
    )


def _singular(given: Exercise) -> Choice:
    family, b = given.arm.family, given.arm.lengths.get("b", 0.0)
    if family == "planar":
        right = ("They become one.", "arccos 1 = 0, and +0 is −0: the stretched arm.")
        wrong = [
            ("They move apart.", "θ₂ and −θ₂ both go to 0."),
            ("Both disappear before.", "They exist up to cos θ₂ = 1."),
        ]
        return one_right("The arm is stretched out, cos θ₂ = 1. What becomes of the two elbows?", right, wrong, 1)
    if family == "srs7":
        right = ("The reference of ψ.", "No elbow is the highest one then. The arm itself is not singular there.")
        wrong = [
            ("The length D.", "D is the distance from the shoulder, which is not zero."),
            ("θ₄.", "θ₄ depends on D alone."),
        ]
        return one_right("The wrist centre is on axis 1. What is undetermined?", right, wrong, 1)
    if b:
        right = (
            "No solution, from the second step on.",
            "r² − b² is negative: no plane at the distance b contains w.",
        )
        wrong = [
            ("Both shoulders reach it.", "They become one at r = b and disappear below it."),
            ("θ₁ is free.", "That would be so for b = 0 and r = 0."),
        ]
        return one_right(
            "The wrist centre is nearer to axis 1 than b. What does the derivation give?", right, wrong, 1
        )
    right = ("θ₁.", "atan2(0, 0) has no value: seen from above, w is a point on the axis.")
    wrong = [("θ₃.", "θ₃ depends on D alone."), ("None of them.", "Look at the step with atan2(w_y, w_x).")]
    return one_right("The wrist centre is on axis 1. Which angle is free?", right, wrong, 1)


def _dependence(given: Exercise) -> Choice:
    if given.arm.family == "planar":
        return Choice(
            "Which joints change the distance D?",
            (
                Option(
                    "Joint 2 only", "D is a side of the triangle of two links; only its angle changes it.", True
                ),
                Option("Joint 1 only", "Joint 1 turns the whole triangle."),
                Option("Joints 1 and 2", "Joint 1 turns the whole triangle and leaves its sides."),
            ),
        )
    return Choice(
        "Only the direction of the tool changes, and the wrist centre stays. Which steps have to be done again?",
        (
            Option("Only the wrist", "The steps before depend on the wrist centre alone.", True),
            Option("All steps", "The wrist centre has not moved, so the arm keeps its angles."),
            Option("All but the first", "The triangle depends on the wrist centre alone."),
        ),
    )


def _others(robot: Robot) -> Outline:
    """For arms without a derivation in this lesson."""
    meet = one_right(
        "Which arms can be solved step by step, position first?",
        (
            "Those whose last axes meet in one point",
            "Turning about them leaves this point, the wrist centre, in place: the other joints place it alone.",
        ),
        [
            ("Those with at most three joints", "PUMA has six and is solved step by step."),
            ("Those without joint limits", "Limits sort out branches at the end; they do not make the formulas."),
        ],
        0,
    )
    text = (
        f"{robot.name} is none of the arms of this lesson. It derives planar arms with two or three joints, elbow "
        "arms with a wrist of two axes (Pioneer arm) or of three axes that meet (PUMA, IRB 120), and arms with a "
        "spherical shoulder and wrist (S-R-S, iiwa)."
    )
    check = one_right(
        "A cosine of an angle is known. How many angles are there between −180° and 180°?",
        ("Two, of either sign", "cos θ = cos(−θ): this is where elbow up and elbow down come from."),
        [("One", "cos θ = cos(−θ)."), ("None if it is negative", "Then the angles are larger than 90°.")],
        0,
    )
    again = one_right(
        "The formula gives a cosine of 1.2. What does that mean?",
        (
            "The target is out of reach.",
            "No real angle has this cosine: the triangle of the links does not close.",
        ),
        [
            ("The angle is 1.2 rad.", "The cosine is 1.2, not the angle."),
            ("The arm is singular.", "It would be at exactly 1."),
        ],
        1,
    )
    first = Step("Which arms", text, meet, practice="Choose one below to derive its angles.")
    rest = (
        "Arms without such a point are solved by elimination or by numeric steps. Postures shows their solutions."
    )
    home = Pose(as_configuration(robot.q_home))
    return Outline(GOAL, (first, Step("All other arms", rest)), (check, again), pose=home)
