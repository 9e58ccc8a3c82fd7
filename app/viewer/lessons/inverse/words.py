"""The words of the lesson: what each step does, and what its failures and special cases mean."""

from __future__ import annotations

import math

from app.viewer.lessons.inverse.arm import Arm, Family
from app.viewer.lessons.inverse.sheet import DerivedStep, StepKey
from kin.axes import is_zero
from kin.units import Units, fixed

SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
TITLES: dict[StepKey, str] = {
    "centre": "The wrist centre",
    "theta1": "θ₁ from above",
    "elbow": "The triangle and the cosine rule",
    "theta2": "θ₂ in the plane of the arm",
    "circle": "The elbow on its circle",
    "shoulder": "The shoulder",
    "wrist": "The wrist",
    "last": "The last joint",
    "joints": "All branches",
}
_CENTRE = (
    "The joints of the wrist do not move the wrist centre w. So go back from the tool point p against the "
    "approach direction a: position and direction are then solved one after the other."
)
_TEXTS: dict[tuple[Family | None, StepKey], str] = {
    (None, "centre"): _CENTRE,
    (
        "planar",
        "theta1",
    ): "The line from joint 1 to the end of link 2 has a known direction. β is the angle between "
    "this line and link 1.",
    (
        "wrist5",
        "theta1",
    ): "Look along axis 1 from above. The arm is a line through the axis, so θ₁ is the direction of "
    "w, or the opposite one if the arm leans over backwards.",
    (
        "wrist6",
        "theta1",
    ): "Look along axis 1 from above. θ₁ turns the plane of the arm until it contains w: in front "
    "of the axis or behind it.",
    (
        None,
        "elbow",
    ): "Two links and the line D between their ends form a triangle. All three sides are known, so the "
    "cosine rule gives the angle at the elbow. A cosine belongs to two angles: two elbows.",
    (
        None,
        "theta2",
    ): "The line from joint 2 to w points down by atan2(h, ρ). β is the angle between this line and the "
    "upper arm.",
    (
        "srs7",
        "circle",
    ): "With D fixed, the elbow can still move on a circle about the line from shoulder to wrist. The "
    "arm angle ψ says where on it; at ψ = 0 the elbow is highest.",
    (
        "srs7",
        "shoulder",
    ): "Joints 1 to 3 point the upper arm along k, and turn it until the axis of the elbow is j. A "
    "direction can be reached in two ways: θ₁ and θ₂, or θ₁ + 180° and −θ₂.",
    ("wrist5", "wrist"): "R₀₃ is known now. u = R₀₃ᵀ a is the approach direction as the forearm sees it, and two "
    "joints point the tool along it: in two ways.",
    (
        None,
        "wrist",
    ): "What the first joints have not turned is left to the wrist: N, the rotation as the forearm sees "
    "it. It is Rz Ry Rz of the three wrist angles, in two ways.",
    ("planar", "last"): "The tool points along φ, which is the sum of the three angles.",
    (
        None,
        "joints",
    ): "Each choice of a sign is a fork, and each way through the forks is a branch. Not all of them are "
    "within the joint limits.",
}


def sub(name: str) -> str:
    """A name with its index below: θ₁."""
    return name.translate(SUBSCRIPTS)


def title(arm: Arm, key: StepKey) -> str:
    """The title of a step."""
    if arm.family == "planar" and key in ("centre", "theta1"):
        centre = "Back along the last link" if arm.robot.n == 3 else "The distance"
        return centre if key == "centre" else "θ₁"
    return TITLES[key]


def follow(number: int) -> str:
    """The label of the button that leads back to a branch."""
    return f"Follow branch {number}"


def step_text(arm: Arm, key: StepKey, units: Units) -> str:
    """What a step does."""
    text = _TEXTS.get((arm.family, key)) or _TEXTS[None, key]
    if arm.family == "planar" and key == "centre":
        text = (
            "The last link ends at the tool. Go back along it: what is left is an arm with two links."
            if arm.robot.n == 3
            else "The tool point is the end of link 2. Its distance from joint 1 is all that the elbow can change."
        )
    if arm.lengths.get("b") and key == "theta1":
        text += f" The plane passes the axis at b = {units.lengths.text(arm.lengths['b'])}."
    numbers: dict[StepKey, tuple[int, ...]] = {"theta1": (1,)}
    numbers["elbow"] = (2 if arm.family == "planar" else 3 + (arm.family == "srs7"),)
    numbers |= {
        "theta2": (2,),
        "shoulder": (1, 2, 3),
        "wrist": tuple(range(4 + (arm.family == "srs7"), arm.robot.n + 1)),
    }
    shifts = [shift for number in numbers.get(key, ()) if (shift := conversion(arm, number, units))]
    return text + (f" The slider counts otherwise: {', '.join(shifts)}." if shifts else "")


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
