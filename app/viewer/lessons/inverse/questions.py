"""What the lesson teaches and asks: a step of the derivation each, for one target and the branch followed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from app.exercises.fields import ExerciseFileError
from app.exercises.lesson_text import LessonText
from app.viewer.lessons.guide.leads import bar, up_or_down
from app.viewer.lessons.guide.outline import (
    Choice,
    Drawn,
    Leads,
    Mistake,
    Number,
    Option,
    Outline,
    Pose,
    Step,
    Way,
    apart,
    count,
)
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.inverse import mistakes, words
from app.viewer.lessons.inverse.arm import arm_of
from app.viewer.lessons.inverse.exercise import Exercise, example, exercise, part_of
from app.viewer.lessons.inverse.sheet import DerivedStep, StepKey
from kin import Robot
from kin.units import Units, fixed

POSTURES = frozenset({"postures"})  # withheld while it is asked how many of them there are
TURNS = frozenset({"angles"})  # and while joint angles are asked, of which roll, pitch and yaw may be sums
HALF, LEVEL = 0.5, 0.3  # of the reach, and of the vertical part of a direction: what an estimate tells apart
LENGTH, ANGLE = 0.001, math.radians(0.5)
_METHODS: dict[StepKey, str] = {
    "theta2": "θ₂ = atan2(h, ρ) − β, with β = atan2(forearm · sin θ₃, upper arm + forearm · cos θ₃).",
    "shoulder": "θ₁ = atan2(k_y, k_x), or the opposite direction.",
    "last": "θ₃ = φ − θ₁ − θ₂.",
}


@lru_cache(maxsize=64)
def outline(robot: Robot, units: Units, text: LessonText | None = None) -> Outline:
    """The outline for this arm, with a target near its home."""
    arm = arm_of(robot)
    if arm is None:
        raise ValueError(f"the lesson has no derivation for {robot.name}")
    return outline_of(exercise(arm, example(arm)), units, text)


def outline_of(given: Exercise, units: Units, text: LessonText | None = None) -> Outline:
    """The outline for a target and the branch that is followed.

    Raises:
        ExerciseFileError: the file has a question for a step of the derivation.
    """
    texts, keys = words.texts(given.arm.robot, units, text), given.arm.keys
    asked, more = texts.steps[: len(keys)], texts.steps[len(keys) :]  # those after the derivation are as they are
    for key, step in zip(keys, asked, strict=True):
        if step.question is not None or (step.estimate is not None and key == "centre"):
            file = "" if texts.text is None else texts.text.file
            valid = "no question of its own: the lesson asks about each step of the derivation"
            raise ExerciseFileError(file, f"{step.at}question", step.title, valid)
    titles = dict(zip(keys, (step.title for step in asked), strict=True))
    steps = (*(_step(given, key, step, units, titles) for key, step in zip(keys, asked, strict=True)), *more)
    return replace(texts, steps=steps, pose=Pose(as_configuration(given.q)))


def _step(given: Exercise, key: StepKey, step: Step, units: Units, titles: Mapping[StepKey, str]) -> Step:
    """A step of the file with what the derivation adds to it; `titles` are those of all of its steps."""
    branch, text = given.followed, step.text + words.counts(given.arm, key, units)
    found, ended = branch.derivation.step(key), branch.derivation.failed
    if key == "centre":
        text, step = (
            f"{_target(given, units)} {text}",
            replace(step, estimate=_estimate(given), guessed=_guessed(given)),
        )
    if key == "joints":
        end = Pose(as_configuration(branch.q)) if branch.available and branch.q is not None else None
        practice = f"The numbers below are those of the branch {branch.name}."
        if ended is not None:
            where = titles[ended.key]
            practice = f"The branch that you follow, {branch.name}, ends at the step “{where}”."
        practice += " Choose another one with Follow."
        asked = _limits(given)
        return replace(step, text=text, question=asked, end=end, practice=practice, withheld=POSTURES)
    if found is None:
        where = "" if ended is None else f" It ends at the step “{titles[ended.key]}”."
        text = f"The branch that you follow does not get here.{where}"
        return replace(step, text=text, offer=_way_back(given))
    if found.failure is not None:
        return replace(step, text=f"{text} {words.failure_text(found, units)}", offer=_way_back(given))
    question, text = _question(given, found, units), f"{text} {words.special_text(given.arm, found)}".rstrip()
    step = replace(step, text=text, question=question, practice=_shown(given, found))
    if question is None or question.unit != units.angles:
        return step
    return replace(step, withheld=TURNS, drawn=_drawn(given, key))


def _way_back(given: Exercise) -> str:
    """The label of the button that goes on where a branch has ended."""
    back = given.way_back
    return "" if back is None else words.follow(back.number)


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
    if given.arm.family == "planar":
        return f"{text}, and the tool points along φ = {units.angles.text(math.atan2(v('x_y'), v('x_x')))}."
    direction = ", ".join(fixed(v(f"a_{axis}")) for axis in axes)
    return f"{text}, a = ({direction})."


def _estimate(given: Exercise) -> Choice:
    """What is seen of the target: how far a planar arm is stretched, or where another one points its tool."""
    if given.arm.family == "planar":
        far = float(np.linalg.norm(given.T[:3, 3] - given.arm.robot.T_world_base[:3, 3])) / given.arm.robot.reach
        why = "The elbow is what changes this distance: joint 1 turns the arm as a whole."
        found = (
            ("Less than half as far from joint 1 as it could be", far < HALF),
            ("Half as far or more", far >= HALF),
        )
        return Choice(
            "Look at the arm, whose tool is at the target: how far is the tool from joint 1?",
            tuple(Option(text, why, right) for text, right in found),
        )
    up = float(given.T[2, 2])
    why = "The wrist centre is back along the line in which the tool points."
    directions = (("Up", up > LEVEL), ("Level, or nearly so", abs(up) <= LEVEL), ("Down", up < -LEVEL))
    return Choice(
        "Look at the arm, whose tool is at the target: which way does the tool point?",
        tuple(Option(text, why, right) for text, right in directions),
    )


def _guessed(given: Exercise) -> Leads:
    """Where the options of the estimate lead."""
    robot, tool = given.arm.robot, given.T[:3, 3]
    if given.arm.family != "planar":
        found = up_or_down(robot, tool, given.T[:3, 2], LEVEL)
        return Leads((found["up"], found["level"], found["down"]))
    base = robot.T_world_base[:3, 3]
    far = float(np.linalg.norm(tool - base)) / robot.reach
    shares = (far, 0.5 * (HALF + 1.0)) if far < HALF else (0.5 * HALF, far)
    return Leads(tuple(bar(base, base + share / max(far, 1e-9) * (tool - base)) for share in shares))


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
        "Those branches count whose joint values are all real and within the joint limits.",
        [
            (real, "That many have real solutions, but joint limits exclude some of them."),
            (len(given.branches), "That is the number of all choices of signs."),
        ],
    )
