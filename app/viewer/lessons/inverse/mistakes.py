"""Values that usual mistakes give in each step of a derivation, and the reasons why they are wrong."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from app.viewer.lessons.guide.outline import Mistake
from app.viewer.lessons.inverse.arm import Family
from app.viewer.lessons.inverse.exercise import Exercise
from app.viewer.lessons.inverse.sheet import Derivation, StepKey, wrapped
from kin.units import Unit

TOOL_POINT = "That is found with the tool point p. Go back to the wrist centre w first."
INSIDE = "That is the angle inside the triangle, from the cosine rule of school. θ is 0 for the stretched arm."
SWAPPED = "The arguments are swapped: atan2 takes y first."

# The names of the two links of the triangle.
SIDES: dict[Family, tuple[str, str]] = {
    "planar": ("l1", "l2"),
    "wrist5": ("a2", "d4"),
    "wrist6": ("a2", "f"),
    "srs7": ("d3", "d5"),
}


def split_name(key: StepKey, derivation: Derivation) -> str:
    """The angle that a step asks for."""
    srs, planar = "S" in derivation.values, "l1" in derivation.values
    elbow = "θ4" if srs else "θ2" if planar else "θ3"
    wrist = "θ5" if srs else "θ4"
    names: dict[StepKey, str] = {"theta1": "θ1", "elbow": elbow, "theta2": "θ2", "wrist": wrist}
    return {**names, "shoulder": "θ1", "last": "θ3"}[key]


def coordinate(derivation: Derivation) -> str:
    """The coordinate of the wrist centre that tells most: the one in which it is farthest from the tool point."""
    v = derivation.values
    away = np.abs(np.asarray(v["w"]) - np.asarray(v["p"]))
    if "l1" in v:
        away = away[:2]
    return "xyz"[int(away.argmax())]


def of_centre(derivation: Derivation) -> Iterator[Mistake]:
    """Of a coordinate of the wrist centre."""
    axis = coordinate(derivation)
    w, p = derivation.number(f"w_{axis}"), derivation.number(f"p_{axis}")
    yield Mistake(p, "That is the tool point itself. The wrist centre is behind it, against the tool’s direction.")
    yield Mistake(2.0 * p - w, "The sign is wrong: the tool leads from the wrist centre to the tool point.")


def of_angle(exercise: Exercise, key: StepKey, unit: Unit) -> tuple[Mistake, ...]:
    """Of the angle that a step asks for."""
    found = exercise.followed.derivation
    name = split_name(key, found)
    answer = found.number(name)
    mistakes = [*_of_step(exercise, found, key)]
    if unit.scale != 1.0:
        mistakes.append(
            Mistake(answer / unit.scale, "That is the value in radians: type rad behind it, or degrees.")
        )
    else:
        mistakes.append(
            Mistake(math.degrees(answer), "That is the value in degrees: type ° behind it, or radians.")
        )
    others = [b.derivation for b in exercise.branches if b.derivation.signs != exercise.signs]
    others.sort(key=lambda other: sum(a != b for a, b in zip(other.signs, exercise.signs, strict=True)))
    mistakes += [
        Mistake(other.number(name), _of_branch(exercise, other))
        for other in others
        if name in other.values and abs(wrapped(other.number(name) - answer)) > 1e-6
    ]
    return tuple(mistakes)


def _of_branch(exercise: Exercise, other: Derivation) -> str:
    """Why the value of another branch is wrong here."""
    pairs = zip(exercise.branch(other.signs).name.split(" · "), exercise.followed.name.split(" · "), strict=True)
    theirs, ours = zip(*(pair for pair in pairs if pair[0] != pair[1]), strict=True)
    return f"That belongs to another branch, “{' · '.join(theirs)}”. You follow “{' · '.join(ours)}”."


def _of_step(exercise: Exercise, found: Derivation, key: StepKey) -> Iterator[Mistake]:
    v = found.number
    match key:
        case "theta1" if "l1" in found.values:
            line = v("θ1") + v("β")
            yield Mistake(line, "That is the direction of the line to the wrist. Subtract β, the angle beside it.")
            yield Mistake(
                line + v("β"), "The sign of β is wrong: with a positive θ₂ the first link lies behind the line."
            )
        case "theta1":
            yield from _of_theta1(exercise, found)
        case "elbow":
            yield from _of_elbow(exercise, found)
        case "theta2":
            line = v("θ2") + v("β")
            yield Mistake(
                line, "That is the direction of the line to the wrist centre. Subtract β, the angle beside it."
            )
            yield Mistake(line + v("β"), "The sign of β is wrong: subtract it.")
            yield Mistake(-line - v("β"), "The sign of h is wrong: it counts downwards, as θ₂ does.")
        case "wrist" if "u" in found.values:
            s = -exercise.signs[2]
            yield Mistake(math.atan2(s * v("u_x"), s * v("u_y")), SWAPPED)
            yield Mistake(_not_transposed(found, s), "That uses R₀₃. To see a from the forearm, use R₀₃ᵀ.")
        case "wrist":
            s = exercise.signs[2]
            yield Mistake(math.atan2(s * v("N_13"), s * v("N_23")), SWAPPED)
        case "shoulder":
            s = exercise.signs[0]
            yield Mistake(math.atan2(s * v("k_x"), s * v("k_y")), SWAPPED)
            yield Mistake(
                math.atan2(v("w_y"), v("w_x")), "That is the direction of the wrist centre. Use the elbow."
            )
        case "last":
            yield Mistake(v("φ"), "That is the direction of the tool. θ₁ and θ₂ have turned it already.")


def _of_theta1(exercise: Exercise, found: Derivation) -> Iterator[Mistake]:
    v, b = found.number, exercise.arm.lengths.get("b", 0.0)
    s = 1.0 if v("X") >= 0.0 else -1.0
    yield Mistake(math.atan2(v("w_x"), v("w_y")), SWAPPED)
    if b:
        straight = math.atan2(v("w_y"), v("w_x"))
        yield Mistake(straight, "The offset b is missing: the arm’s plane passes axis 1 at this distance.")
        yield Mistake(straight + math.atan2(b, v("X")), "The sign of the offset b is wrong: subtract its angle.")
    yield Mistake(math.atan2(s * v("p_y"), s * v("p_x")) - (math.atan2(b, v("X")) if b else 0.0), TOOL_POINT)


def _not_transposed(found: Derivation, s: int) -> float:
    u = np.asarray(found.values["R03"]) @ np.asarray(found.values["a"])
    return math.atan2(s * u[1], s * u[0])


def _of_elbow(exercise: Exercise, found: Derivation) -> Iterator[Mistake]:
    name = split_name("elbow", found)
    size = abs(found.number(name))
    for sign in (1, -1):
        yield Mistake(sign * (math.pi - size), INSIDE)
    for distance, reason in _wrong_distances(exercise, found):
        bend = _bend(exercise, distance)
        if bend is not None:
            yield from (Mistake(sign * bend, reason) for sign in (1, -1))


def _wrong_distances(exercise: Exercise, found: Derivation) -> Iterator[tuple[float, str]]:
    """Distances that usual mistakes take for D."""
    v, lengths = found.number, exercise.arm.lengths
    if exercise.arm.family == "planar":
        yield math.hypot(v("p_x"), v("p_y")), TOOL_POINT
        return
    d1 = lengths["d1"]
    if exercise.arm.family == "srs7":
        x, y, z = v("v_x"), v("v_y"), v("v_z")
        yield math.sqrt(x * x + y * y + (z + d1) ** 2), "d₁ is missing: D is measured from the shoulder S."
        p = np.asarray(found.values["p"])
        yield float(np.linalg.norm(p - [0.0, 0.0, d1])), TOOL_POINT
        return
    h, X, a1 = v("h"), v("X"), lengths["a1"]
    if a1:
        yield math.hypot(X, h), "The offset a₁ is missing: axis 2 is a₁ away from axis 1."
        yield math.hypot(X + a1, h), "The sign of the offset a₁ is wrong: ρ = X − a₁."
    if d1:
        yield math.hypot(v("ρ"), h - d1), "d₁ is missing: h is measured from the height of the shoulder."
        yield math.hypot(v("ρ"), h + 2.0 * (d1 - h)), "The sign of d₁ is wrong: h = d₁ − w_z."
    yield math.hypot(math.hypot(v("p_x"), v("p_y")) - a1, d1 - v("p_z")), TOOL_POINT


def _bend(exercise: Exercise, distance: float) -> float | None:
    a, b = (exercise.arm.lengths[name] for name in SIDES[exercise.arm.family])
    cosine = (distance**2 - a**2 - b**2) / (2.0 * a * b)
    return math.acos(cosine) if abs(cosine) <= 1.0 else None
