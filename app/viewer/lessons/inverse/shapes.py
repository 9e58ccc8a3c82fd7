"""The figure of each step as facts: points, lengths and angles in the lesson's frame, metres and radians."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from app.viewer.lessons.inverse.arm import Arm
from app.viewer.lessons.inverse.sheet import Derivation, StepKey
from kin.transforms import Array

Z = np.array([0.0, 0.0, 1.0])


class Point(NamedTuple):
    """A labelled point."""

    name: str
    at: Array


class Line(NamedTuple):
    """A line, labelled at its end; `bone` if it is a link of the posture."""

    name: str
    start: Array
    end: Array
    bone: bool = False


class Length(NamedTuple):
    """A dimension line: its ends, and the name of its value."""

    name: str
    start: Array
    end: Array
    aside: Array


class Angle(NamedTuple):
    """A rotation from the direction `start` about an axis, and the name of its value; None: a given size."""

    name: str
    corner: Array
    start: Array
    about: Array
    size: float
    radius: float | None = None


class Face(NamedTuple):
    """A triangle."""

    name: str
    corners: tuple[Array, Array, Array]


Shape = Point | Line | Length | Angle | Face


def shapes(arm: Arm, found: Derivation, key: StepKey) -> list[Shape]:
    """The figure of a step, as far as this derivation leads."""
    v = found.values
    if "w" not in v:
        return []
    draw = {"planar": _planar, "srs7": _srs}.get(arm.family, _elbow_arm)
    return list(draw(arm, found, key))


def joints_of(arm: Arm, found: Derivation) -> list[Array]:
    """Base, shoulder, elbow, wrist centre and tool point ``(3,)`` of a posture, as far as they are known."""
    v = found.values
    point = {name: np.asarray(v[name]) for name in ("p", "w", "E") if name in v}
    if arm.family == "planar":
        chain = [np.zeros(3)]
        if "θ1" in v:
            chain.append(arm.lengths["l1"] * _direction(found.number("θ1")))
        return [*chain, point["w"], *([point["p"]] if arm.robot.n == 3 else [])]
    shoulder = np.array([0.0, 0.0, arm.lengths["d1"]])
    if arm.family == "srs7":
        return [np.zeros(3), shoulder, *([point["E"]] if "E" in point else []), point["w"], point["p"]]
    chain = [np.zeros(3), shoulder]
    if "θ1" in v:
        forward, side = _plane(found)
        chain.append(shoulder + arm.lengths["a1"] * forward + arm.lengths.get("b", 0.0) * side)
        if "θ2" in v:
            t2 = found.number("θ2")
            chain.append(chain[-1] + arm.lengths["a2"] * (math.cos(t2) * forward - math.sin(t2) * Z))
    return [*chain, point["w"], point["p"]]


def _direction(angle: float) -> Array:
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def _plane(found: Derivation) -> tuple[Array, Array]:
    """The direction in which the plane of the arm leaves axis 1, and its normal."""
    t = found.number("θ1")
    return _direction(t), _direction(t + math.pi / 2)


def _bones(arm: Arm, found: Derivation) -> Iterator[Shape]:
    """The posture of the branch as lines."""
    chain = joints_of(arm, found)
    for i, (start, end) in enumerate(pairwise(chain)):
        yield Line(f"bone{i}", start, end, bone=True)


def _elbow_arm(arm: Arm, found: Derivation, key: StepKey) -> Iterator[Shape]:
    v, lengths = found.values, arm.lengths
    w, p = np.asarray(v["w"]), np.asarray(v["p"])
    yield Point("w", w)
    if key == "joints":
        yield from _bones(arm, found)
        return
    if key == "centre":
        yield from _tool(arm, w, p)
        return
    yield Line("z0", np.zeros(3), np.array([0.0, 0.0, max(lengths["d1"], float(w[2])) * 1.25]))
    if key == "theta1":
        yield from _from_above(arm, found, w)
        return
    if "θ1" not in v:
        return
    forward, side = _plane(found)
    chain = joints_of(arm, found)
    hip, fore = chain[2], "d4" if arm.family == "wrist5" else "f"
    yield Point("2", hip)
    if key == "elbow" and "θ2" not in v:
        yield Length("D", hip, w, -Z)
        return
    if "θ2" not in v:
        return
    elbow, t2 = chain[3], found.number("θ2")
    along = math.cos(t2) * forward - math.sin(t2) * Z
    yield Face("triangle", (hip, elbow, w))
    yield from _bones(arm, found)
    if key == "elbow":
        inside = (hip + elbow + w) / 3.0
        yield Length("a2", hip, elbow, _away(hip, elbow, inside, forward))
        yield Length(fore, elbow, w, _away(elbow, w, inside, forward))
        yield Length("D", hip, w, _away(hip, w, elbow, -Z))
        yield Angle("θ3", elbow, along, side, found.number("θ3"), 0.45 * lengths[fore])
    elif key == "theta2":
        yield Angle("θ2", hip, forward, side, t2, 0.8 * lengths["a2"])
        yield Angle("β", hip, along, side, found.number("β"), 0.45 * lengths["a2"])
    elif key == "wrist" and "R03" in v:
        yield from _wrist(w, p, np.asarray(v["R03"]), np.asarray(v["a"]), 0.5 * lengths["a2"])


def _from_above(arm: Arm, found: Derivation, w: Array) -> Iterator[Shape]:
    v, b = found.values, arm.lengths.get("b", 0.0)
    foot = np.array([w[0], w[1], 0.0])
    yield Line("down", w, foot)
    yield Line(
        "x0", np.zeros(3), 0.7 * max(found.number("r"), 0.3 * arm.lengths["a2"]) * np.array([1.0, 0.0, 0.0])
    )
    yield Length("r", np.zeros(3), foot, _across(foot) * math.copysign(1.0, float(w[1])))  # away from x₀
    if "θ1" not in v:
        return
    forward, side = _plane(found)
    if b:
        corner = found.number("X") * forward
        yield Length("b", corner, corner + b * side, forward * math.copysign(1.0, found.number("X")))
        yield Line("X", np.zeros(3), corner)
    yield Angle("θ1", np.zeros(3), np.array([1.0, 0.0, 0.0]), Z, found.number("θ1"))


def _across(direction: Array) -> Array:
    across = np.array([-direction[1], direction[0], 0.0])
    size = float(np.linalg.norm(across))
    return across / size if size > 1e-9 else np.array([1.0, 0.0, 0.0])


def _tool(arm: Arm, w: Array, p: Array) -> Iterator[Shape]:
    yield Point("p", p)
    if float(np.linalg.norm(p - w)) > 1e-9:
        name = "l3" if arm.family == "planar" else f"d{max(arm.robot.n, 6)}" if arm.straight_tool else "t"
        aside = _across(p - w) if arm.family == "planar" else _away(w, p, np.zeros(3), Z)
        yield Length(name, w, p, aside)


def _away(start: Array, end: Array, from_point: Array, otherwise: Array) -> Array:
    """The direction across a line, away from a point."""
    e = end - start
    e = e / max(float(np.linalg.norm(e)), 1e-12)
    away = (start + end) / 2.0 - from_point
    across = away - (away @ e) * e
    if float(np.linalg.norm(across)) < 1e-6:
        across = otherwise - (otherwise @ e) * e
    size = float(np.linalg.norm(across))
    return np.asarray(across / size if size > 1e-9 else Z)


def _wrist(w: Array, p: Array, R: Array, a: Array, length: float) -> Iterator[Shape]:
    """The frame of the forearm at the wrist centre, and the direction of the tool in it."""
    for i, name in enumerate(("x3", "y3", "z3")):
        yield Line(name, w, w + length * R[:, i])
    yield Line("a", w, w + 1.15 * max(length, float(np.linalg.norm(p - w))) * a)
    about = np.cross(R[:, 2], a)
    if float(np.linalg.norm(about)) > 1e-6:
        yield Angle(
            "tilt", w, R[:, 2], about, math.atan2(float(np.linalg.norm(about)), float(R[:, 2] @ a)), 0.7 * length
        )


def _srs(arm: Arm, found: Derivation, key: StepKey) -> Iterator[Shape]:
    v = found.values
    w, p, shoulder = np.asarray(v["w"]), np.asarray(v["p"]), np.array([0.0, 0.0, arm.lengths["d1"]])
    yield Point("w", w)
    if key == "centre":
        yield from _tool(arm, w, p)
        return
    yield Point("S", shoulder)
    if "E" not in v:
        yield Length("D", shoulder, w, _away(shoulder, w, np.zeros(3), Z))
        return
    elbow, u = np.asarray(v["E"]), np.asarray(v["u"])
    upper = (elbow - shoulder) / arm.lengths["d3"]
    yield Point("E", elbow)
    yield from _bones(arm, found)
    if key == "elbow":
        inside = (shoulder + elbow + w) / 3.0
        yield Face("triangle", (shoulder, elbow, w))
        yield Length("d3", shoulder, elbow, _away(shoulder, elbow, inside, Z))
        yield Length("d5", elbow, w, _away(elbow, w, inside, Z))
        yield Length("D", shoulder, w, _away(shoulder, w, elbow, -Z))
        t4 = found.number("θ4")
        about = math.copysign(1.0, t4) * np.cross(upper, w - elbow)
        if float(np.linalg.norm(about)) > 1e-9:
            yield Angle("θ4", elbow, upper, about, t4, 0.45 * arm.lengths["d5"])
    elif key == "circle":
        center, radius = shoulder + found.number("A") * u, found.number("ρ")
        yield Line("SW", shoulder, w)
        if radius > 1e-3:
            yield Angle("circle", center, np.asarray(v["e"]), u, 2.0 * math.pi, radius)
            yield Angle("ψ", center, np.asarray(v["e"]), u, found.number("ψ"), 0.6 * radius)
            yield Length("ρ", center, elbow, -u)
    elif key == "shoulder":
        level = np.array([upper[0], upper[1], 0.0])
        yield Line("z0", shoulder, shoulder + arm.lengths["d3"] * Z)
        yield Line("x0", shoulder, shoulder + 0.7 * arm.lengths["d3"] * np.array([1.0, 0.0, 0.0]))
        if float(np.linalg.norm(level)) > 1e-6:
            yield Line("k", shoulder, shoulder + arm.lengths["d3"] * level)
            yield Angle("θ1", shoulder, np.array([1.0, 0.0, 0.0]), Z, found.number("θ1"))
            yield Angle("tilt2", shoulder, Z, np.cross(Z, upper), math.acos(max(-1.0, min(1.0, float(upper[2])))))
    elif key == "wrist":
        yield from _wrist(w, p, np.asarray(v["R04"]), np.asarray(v["a"]), 0.5 * arm.lengths["d5"])


def _planar(arm: Arm, found: Derivation, key: StepKey) -> Iterator[Shape]:
    v = found.values
    w, p, base = np.asarray(v["w"]), np.asarray(v["p"]), np.zeros(3)
    yield Point("w", w)
    if key == "centre" and arm.robot.n == 3:
        yield from _tool(arm, w, p)
        return
    if key == "centre" or "θ1" not in v:
        yield Length("D", base, w, -_across(w))
        return
    t1, t2 = found.number("θ1"), found.number("θ2")
    elbow = arm.lengths["l1"] * _direction(t1)
    yield from _bones(arm, found)
    yield Face("triangle", (base, elbow, w))
    if key == "elbow":
        yield Length("l1", base, elbow, _away(base, elbow, w, _across(elbow)))
        yield Length("l2", elbow, w, _away(elbow, w, base, _across(w - elbow)))
        yield Length("D", base, w, _away(base, w, elbow, -_across(w)))
        yield Angle("θ2", elbow, _direction(t1), Z, t2, 0.45 * arm.lengths["l2"])
    elif key == "theta1":
        yield Line("x0", base, 0.8 * arm.lengths["l1"] * _direction(0.0))
        yield Angle("θ1", base, _direction(0.0), Z, t1, 0.4 * arm.lengths["l1"])
        yield Angle("β", base, _direction(t1), Z, found.number("β"), 0.6 * arm.lengths["l1"])
    elif key == "last" and "θ3" in v:
        yield Line("x0", w, w + 0.8 * arm.lengths["l3"] * _direction(0.0))
        yield Angle("φ", w, _direction(0.0), Z, found.number("φ"), 0.7 * arm.lengths["l3"])
        yield Angle("θ3", w, _direction(t1 + t2), Z, found.number("θ3"))
