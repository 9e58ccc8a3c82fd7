"""The words of the lesson that its derivations choose: what their failures and special cases mean.

Those that depend on the arm alone are in ``lesson.toml``.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from app.exercises.lesson_text import LessonText
from app.exercises.variant import Quantity
from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.outline import Outline, Pose
from app.viewer.lessons.guide.poses import as_configuration, first_clear
from app.viewer.lessons.inverse.arm import Arm, arm_of
from app.viewer.lessons.inverse.sheet import DerivedStep, StepKey
from kin import Robot, fk, solve_ik
from kin.axes import is_zero
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units, fixed

TRIED = 30  # configurations
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def sub(name: str) -> str:
    """A name with its index below: θ₁."""
    return name.translate(SUBSCRIPTS)


@lru_cache(maxsize=64)
def texts(robot: Robot, units: Units, text: LessonText | None = None) -> Outline:
    """Goal, steps and check of the file, without what the derivation of a target adds."""
    return outline_of("inverse", robot, units, _facts(robot), text)


def _facts(robot: Robot) -> LessonFacts:
    """What the file declares."""
    arm = arm_of(robot)
    family, beside = (None, 0.0) if arm is None else (arm.family, arm.lengths.get("b", 0.0))
    most, strays = fewer(robot)
    numbers: dict[str, float | Quantity] = {
        "planar": float(family == "planar"),
        "five": float(family == "wrist5"),
        "ball": float(family == "srs7"),
        "joints": float(robot.n),
        "beside": Quantity(beside, "length"),
        "most": float(most),
    }
    elbow = sub(f"θ{2 if family == 'planar' else 4 if family == 'srs7' else 3}")
    home = Pose(as_configuration(robot.q_home))
    functions = {"strays": lambda joint: float(strays[int(joint) - 1])}
    return LessonFacts(numbers, functions, {"elbow": elbow}, {"home": home})


@lru_cache(maxsize=64)
def fewer(robot: Robot) -> tuple[int, Array]:
    """How many postures reach the pose of home, and a configuration ``(n,)`` whose pose fewer reach."""

    def count(q: Array) -> int:
        return len(solve_ik(robot, fk(robot, q), q_seed=q).solutions)

    most = count(robot.q_home)
    stretched = robot.q_home.copy()
    stretched[1:] = np.clip(0.0, robot.lower[1:], robot.upper[1:])
    tried = (stretched, *robot.random_q(np.random.default_rng(8), TRIED))
    found = first_clear(robot, (np.asarray(q) for q in tried if 0 < count(q) < most))
    return most, robot.q_home if found is None else found


def title(arm: Arm, key: StepKey) -> str:
    """The title of a step."""
    return texts(arm.robot, DEFAULT_UNITS).steps[arm.keys.index(key)].title


def follow(number: int) -> str:
    """The label of the button that leads back to a branch."""
    return f"Go on with branch {number}"


def counts(arm: Arm, key: StepKey, units: Units) -> str:
    """How the sliders of the joints that a step finds count, as a sentence; "" if as the formulas do."""
    numbers: dict[StepKey, tuple[int, ...]] = {"theta1": (1,)}
    numbers["elbow"] = (2 if arm.family == "planar" else 3 + (arm.family == "srs7"),)
    numbers |= {
        "theta2": (2,),
        "shoulder": (1, 2, 3),
        "wrist": tuple(range(4 + (arm.family == "srs7"), arm.robot.n + 1)),
    }
    shifts = [shift for number in numbers.get(key, ()) if (shift := conversion(arm, number, units))]
    return f" The slider counts otherwise, up to a whole turn: {', '.join(shifts)}." if shifts else ""


def conversion(arm: Arm, number: int, units: Units) -> str:
    """How the slider of a joint counts; "" if as the formulas do."""
    sense, offset = float(arm.sense[number - 1]), float(arm.offset[number - 1])
    if sense > 0.0 and is_zero(offset):
        return ""
    name = sub(str(number))
    if is_zero(offset):
        return f"q{name} = −θ{name}"
    sign, angle = ("−" if offset > 0.0 else "+"), units.angles.text(abs(offset))
    return (
        f"q{name} = θ{name} {sign} {angle}"
        if sense > 0.0
        else f"q{name} = {angle if offset > 0 else '−' + angle} − θ{name}"
    )


def failure_text(step: DerivedStep, units: Units) -> str:
    """Why a derivation ends at a step, with the number that decides."""
    values = {line.name: line.value for line in step.lines}
    gap = units.distance(step.excess)
    if step.failure == "inside the cylinder":
        return (
            f"No solution: w is {gap} too near to axis 1. The plane of the arm passes the axis at the "
            "distance b, so r² − b² is negative."
        )
    if step.failure == "off the plane":
        return f"No solution: the arm moves in one plane, and the target is {gap} off it."
    if "C" not in values:
        return "No solution: the wrist centre is on the shoulder, so the line between them has no direction."
    cosine = float(values["C"]) if not hasattr(values["C"], "shape") else math.nan
    word = (
        "above 1: the links are too short"
        if step.failure == "too far"
        else "below −1: the links cannot fold so far"
    )
    gap_text = f"The wrist centre is {gap} {step.failure}."
    return f"No solution: the cosine would be {fixed(cosine)}, {word}. {gap_text}"


def special_text(arm: Arm, step: DerivedStep) -> str:
    """What is special at this target; "" if nothing is."""
    name = f"θ{sub(str(step.free))}"
    match step.special:
        case "on axis 1" if step.key == "circle":
            return "w is on axis 1: no elbow is the highest one. ψ is counted from the x axis of the base instead."
        case "on axis 1" if arm.family == "planar":
            return "The end of link 2 is on axis 1: θ₁ can have any value."
        case "on axis 1":
            return "Singular: w is on axis 1, so it looks the same from all sides. θ₁ is free and keeps its value."
        case "tangent":
            return "Singular: r = b, so both ways are one."
        case "straight":
            return "Singular: the elbow is stretched. Both elbows are one."
        case "folded":
            return "Singular: the elbow is folded back. Both elbows are one."
        case "on axis 2":
            return "Singular: w is on axis 2. θ₂ is free and keeps its value."
        case "aligned" if arm.family == "wrist5":
            return (
                "Singular: the tool is in line with the forearm. θ₄ turns nothing else; it is free and keeps its "
                "value."
            )
        case "aligned" if step.key == "shoulder":
            return "The upper arm is on axis 1: only the sum of θ₁ and θ₃ matters. θ₁ keeps its value."
        case "aligned":
            last = sub(str(step.free + 2))
            start = "Singular: the outer wrist axes are in line."
            return f"{start} {name} and θ{last} only matter together; {name} keeps its value."
    return ""
