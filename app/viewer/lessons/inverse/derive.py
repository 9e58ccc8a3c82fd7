"""The derivations: planar arms, the five-joint arm of the chapter, wrist decoupling, and S-R-S arms."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from app.viewer.lessons.inverse.arm import Arm
from app.viewer.lessons.inverse.sheet import CLOSED, SINGULAR, Derivation, Sheet, minus
from kin.axes import inverse
from kin.transforms import Array

FLAT = 1e-6  # m, or of a sine: a target further off the plane of a planar arm is off it
Signs = tuple[int, ...]


def all_signs(arm: Arm) -> list[Signs]:
    """The signs of all branches."""
    return list(product((1, -1), repeat=arm.splits))


def row_of(arm: Arm, signs: Signs) -> int:
    """The row of a branch in `kin.ik_branches`, but for planar arms, whose branches are named otherwise."""
    bits = list(signs)
    if arm.family == "wrist6":  # its elbows are counted up and down
        bits[1] *= signs[0]
    return int("".join("1" if bit < 0 else "0" for bit in bits), 2)


def signs_of(arm: Arm, q: Array) -> Signs:
    """The signs of the branch that a configuration ``(n,)`` is on."""
    t = arm.angles(q)
    sine = np.sin(t)
    if arm.family == "planar":
        return (_sign(sine[1]),)
    if arm.family == "srs7":
        return _sign(sine[1]), _sign(sine[3]), _sign(sine[5])
    lengths, fore = arm.lengths, "d4" if arm.family == "wrist5" else "f"
    x = lengths["a1"] + lengths["a2"] * math.cos(t[1]) + lengths[fore] * math.cos(t[1] + t[2])
    return _sign(x), _sign(sine[2]), _sign(sine[4])


def _sign(x: float) -> int:
    return -1 if x < 0.0 else 1


def arm_angle(arm: Arm, q: Array) -> float:
    """ψ of a configuration ``(7,)`` of an S-R-S arm."""
    t = arm.angles(q)
    shoulder = t.copy()
    shoulder[3:] = 0.0
    R, sign = arm.rotation(shoulder), _sign(math.sin(t[3]))
    d3, d5 = arm.lengths["d3"], arm.lengths["d5"]
    along, beside = d3 + d5 * math.cos(t[3]), d5 * abs(math.sin(t[3]))
    L = math.hypot(along, beside)
    if L < SINGULAR:
        return 0.0
    # The forearm leaves the upper arm towards sign x: u and the direction to the elbow in the upper arm's frame.
    u = (along * R[:, 2] + sign * beside * R[:, 0]) / L
    radial = (beside * R[:, 2] - sign * along * R[:, 0]) / L
    e2 = _beside(arm, u)
    return math.atan2(float(radial @ e2), float(radial @ np.cross(e2, u)))


def _beside(arm: Arm, u: Array) -> Array:
    """The horizontal direction from which ψ is counted by a quarter turn."""
    z = np.array([0.0, 0.0, 1.0])
    across = np.cross(u, z)
    size = float(np.linalg.norm(across))
    if size > SINGULAR:
        return np.asarray(across / size)
    return np.asarray(np.cross(arm.reference, u) if u[2] > 0.0 else np.cross(u, -arm.reference))


def derive(arm: Arm, T: Array, signs: Signs, near: Array, psi: float = 0.0) -> Derivation:
    """The derivation of one branch.

    Args:
        T: target T_base_tool ``(4, 4)``.
        near: configuration ``(n,)`` whose angles are kept where the target leaves them free.
        psi: arm angle of an S-R-S arm.
    """
    sheet, M = Sheet(), inverse(arm.T_base_lesson) @ T
    sheet.given(p=M[:3, 3].copy(), a=M[:3, 2].copy(), R=M[:3, :3].copy(), **arm.lengths)
    theta = arm.angles(near)
    if arm.family == "planar":
        reached = _planar(sheet, arm, M, signs)
    elif arm.family == "srs7":
        reached = _centre(sheet, arm) and _srs7(sheet, arm, signs, theta, psi)
    else:
        reached = _centre(sheet, arm) and _elbow_arm(sheet, arm, signs, theta)
    q = None
    if reached:
        q = arm.joints(np.array([sheet[f"θ{i + 1}"] for i in range(arm.robot.n)]))
        for i, joint in enumerate(q):
            sheet.state(f"q{i + 1}", float(joint), "angle")
        sheet.close("joints")
    return Derivation(signs, tuple(sheet.steps), sheet.values, q)


def branches(arm: Arm, T: Array, near: Array, psi: float = 0.0) -> list[Derivation]:
    """The derivations of all branches, in the order of `all_signs`."""
    return [derive(arm, T, signs, near, psi) for signs in all_signs(arm)]


# Steps


def _centre(sheet: Sheet, arm: Arm) -> bool:
    """The wrist centre."""
    last = f"d{arm.robot.n if arm.robot.n > 5 else 6}"
    if arm.straight_tool or arm.family == "wrist5":
        sheet.given(**{last: -float(arm.wrist[2])})
        sheet.put("w", f"p - {last}*a", "point")
    else:
        sheet.given(t=arm.wrist, K=arm.R_tool_wrist)
        sheet.put("w", "p + R@t", "point")
    sheet.close("centre")
    return True


def _elbow_arm(sheet: Sheet, arm: Arm, signs: Signs, theta: Array) -> bool:
    """θ1 from above, the triangle in the plane, and the wrist of five or six joints."""
    return (
        _theta1(sheet, arm, signs[0], theta)
        and _triangle(sheet, arm, signs[1])
        and _theta2(sheet, arm, theta)
        and (_two_axes if arm.family == "wrist5" else _three_axes)(sheet, arm, signs[2], theta)
    )


def _theta1(sheet: Sheet, arm: Arm, sign: int, theta: Array) -> bool:
    beside, s = arm.lengths.get("b", 0.0), minus(sign)
    sheet.put("r", "sqrt(w_x**2 + w_y**2)", "length")
    if beside == 0.0:
        sheet.put("X", f"{s}r", "length")
        if sheet["r"] < SINGULAR:
            sheet.state("θ1", float(theta[0]), "angle")
            sheet.close("theta1", 0, special="on axis 1", free=1)
        else:
            sheet.put("θ1", f"atan2({s}w_y, {s}w_x)", "angle")
            sheet.close("theta1", 0)
        return True
    if sheet["r"] < abs(beside) - CLOSED:
        sheet.close("theta1", 0, "inside the cylinder", abs(beside) - sheet["r"])
        return False
    sheet.put("X", f"{s}sqrt(r**2 - b**2)", "length")
    sheet.put("θ1", "atan2(w_y, w_x) - atan2(b, X)", "angle")
    sheet.close("theta1", 0, special="tangent" if abs(sheet["X"]) < SINGULAR else None)
    return True


def _triangle(sheet: Sheet, arm: Arm, sign: int) -> bool:
    """θ3 by the cosine rule in the plane of the arm."""
    fore = "d4" if arm.family == "wrist5" else "f"
    sheet.put("ρ", "X - a1" if arm.lengths["a1"] else "X", "length")
    sheet.put("h", "d1 - w_z" if arm.lengths["d1"] else "-w_z", "length")
    sheet.put("D", "sqrt(ρ**2 + h**2)", "length")
    return _cosine_rule(sheet, ("a2", fore), "θ3", sign, 1)


def _cosine_rule(sheet: Sheet, sides: tuple[str, str], angle: str, sign: int, split: int) -> bool:
    """The angle between two links from the distance D of their ends; False if the triangle does not close."""
    one, two = sides
    sheet.put("C", f"(D**2 - {one}**2 - {two}**2)/(2*{one}*{two})", "number", f"cos({angle})")
    C = sheet["C"]
    if abs(C) > 1.0 + CLOSED:
        far = C > 1.0
        bound = sheet[one] + sheet[two] if far else abs(sheet[one] - sheet[two])
        sheet.close("elbow", split, "too far" if far else "too near", abs(sheet["D"] - bound))
        return False
    sheet.put(angle, f"{minus(sign)}arccos(C)", "angle")
    flat = abs(math.sin(sheet[angle])) < SINGULAR
    sheet.close("elbow", split, special=("straight" if C > 0.0 else "folded") if flat else None)
    return True


def _theta2(sheet: Sheet, arm: Arm, theta: Array) -> bool:
    fore = "d4" if arm.family == "wrist5" else "f"
    sheet.put("β", f"atan2({fore}*sin(θ3), a2 + {fore}*cos(θ3))", "angle")
    if sheet["D"] < SINGULAR:
        sheet.state("θ2", float(theta[1]), "angle")
        sheet.close("theta2", special="on axis 2", free=2)
    else:
        sheet.put("θ2", "atan2(h, ρ) - β", "angle")
        sheet.close("theta2")
    return True


def _two_axes(sheet: Sheet, arm: Arm, sign: int, theta: Array) -> bool:
    """θ4 and θ5 from the approach direction as the forearm sees it."""
    sheet.given(R03=_lower(arm, sheet, theta, 3, (0.0, 0.0)))
    sheet.put("u", "inv(R03)@a", "direction")
    if math.hypot(sheet["u_x"], sheet["u_y"]) < SINGULAR:
        sheet.state("θ4", float(theta[3]), "angle")
        sheet.put("θ5", "atan2(-(cos(θ4)*u_x + sin(θ4)*u_y), u_z)", "angle")
        sheet.close("wrist", 2, special="aligned", free=4)
        return True
    s = minus(-sign)
    sheet.put("θ4", f"atan2({s}u_y, {s}u_x)", "angle")
    sheet.put("θ5", "atan2(-(cos(θ4)*u_x + sin(θ4)*u_y), u_z)", "angle")
    sheet.close("wrist", 2)
    return True


def _three_axes(sheet: Sheet, arm: Arm, sign: int, theta: Array) -> bool:
    sheet.given(R03=_lower(arm, sheet, theta, 3, (0.0, 0.0, 0.0)))
    _put_rotation(sheet, arm, "R03")
    _zyz(sheet, sign, (4, 5, 6), theta)
    return True


def _lower(arm: Arm, sheet: Sheet, theta: Array, joints: int, rest: tuple[float, ...]) -> Array:
    """The rotation up to a joint, by forward kinematics with the angles beyond it at 0."""
    given = np.array([*(sheet[f"θ{i + 1}"] for i in range(joints)), *rest])
    return arm.rotation(given)


def _put_rotation(sheet: Sheet, arm: Arm, lower: str) -> None:
    known = arm.straight_tool or np.allclose(arm.R_tool_wrist, np.eye(3))
    if not known and "K" not in sheet.values:
        sheet.given(K=arm.R_tool_wrist)
    sheet.put("N", f"inv({lower})@R" + ("" if known else "@K"), "rotation")


def _zyz(sheet: Sheet, sign: int, numbers: tuple[int, int, int], theta: Array) -> None:
    """The three angles of the wrist in N = Rz Ry Rz."""
    one, two, three = (f"θ{i}" for i in numbers)
    s = minus(sign)
    aligned = math.hypot(sheet["N_13"], sheet["N_23"]) < SINGULAR
    if aligned:
        sheet.state(one, float(theta[numbers[0] - 1]), "angle")
    else:
        sheet.put(one, f"atan2({s}N_23, {s}N_13)", "angle")
    sheet.put(two, f"atan2(cos({one})*N_13 + sin({one})*N_23, N_33)", "angle")
    sheet.put(three, f"atan2(cos({one})*N_21 - sin({one})*N_11, cos({one})*N_22 - sin({one})*N_12)", "angle")
    sheet.close("wrist", 2, special="aligned" if aligned else None, free=numbers[0] if aligned else 0)


def _srs7(sheet: Sheet, arm: Arm, signs: Signs, theta: Array, psi: float) -> bool:
    sheet.given(ψ=psi, S=np.array([0.0, 0.0, arm.lengths.get("d1", 0.0)]))
    sheet.put("v", "w - S", "point")
    sheet.put("D", "sqrt(v_x**2 + v_y**2 + v_z**2)", "length")
    if not _cosine_rule(sheet, ("d3", "d5"), "θ4", signs[1], 1):
        return False
    if sheet["D"] < SINGULAR:  # links of equal length, folded: no line from shoulder to wrist
        sheet.close("circle", failure="too near", excess=sheet["D"])
        return False
    sheet.put("u", "unit(v)", "direction")
    u = sheet.array("u")
    on_axis = math.hypot(u[0], u[1]) < SINGULAR
    if on_axis:
        sheet.state("g", _beside(arm, u), "direction")
    else:
        sheet.given(z=np.array([0.0, 0.0, 1.0]))
        sheet.put("g", "unit(cross(u, z))", "direction")
    sheet.put("e", "cross(g, u)", "direction")
    sheet.put("A", "(D**2 + d3**2 - d5**2)/(2*D)", "length")
    sheet.put("ρ", "sqrt(d3**2 - A**2)", "length")
    sheet.put("m", "cos(ψ)*e + sin(ψ)*g", "direction")
    sheet.put("E", "S + A*u + ρ*m", "point")
    sheet.close("circle", special="on axis 1" if on_axis else None)
    return _shoulder(sheet, signs, theta) and _hand(sheet, arm, signs[2], theta)


def _shoulder(sheet: Sheet, signs: Signs, theta: Array) -> bool:
    """θ1, θ2, θ3 turn z along the upper arm and y along the axis of the elbow."""
    sheet.put("k", "(E - S)/d3", "direction")
    sheet.put("j", f"{minus(-signs[1])}cross(u, m)", "direction")
    k, j = sheet.array("k"), sheet.array("j")
    sheet.given(R03=np.column_stack([np.cross(j, k), j, k]))
    s = minus(signs[0])
    vertical = math.hypot(k[0], k[1]) < SINGULAR
    if vertical:
        sheet.state("θ1", float(theta[0]), "angle")
    else:
        sheet.put("θ1", f"atan2({s}k_y, {s}k_x)", "angle")
    sheet.put("θ2", "atan2(cos(θ1)*k_x + sin(θ1)*k_y, k_z)", "angle")
    sheet.put("θ3", "atan2(cos(θ1)*R03_21 - sin(θ1)*R03_11, cos(θ1)*R03_22 - sin(θ1)*R03_12)", "angle")
    sheet.close("shoulder", 0, special="aligned" if vertical else None, free=1 if vertical else 0)
    return True


def _hand(sheet: Sheet, arm: Arm, sign: int, theta: Array) -> bool:
    c, s = math.cos(sheet["θ4"]), math.sin(sheet["θ4"])
    bend = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    sheet.given(R04=sheet.array("R03") @ bend)
    _put_rotation(sheet, arm, "R04")
    _zyz(sheet, sign, (5, 6, 7), theta)
    return True


def _planar(sheet: Sheet, arm: Arm, M: Array, signs: Signs) -> bool:
    off = abs(float(M[2, 3])) if arm.robot.n == 2 else max(abs(float(M[2, 3])), abs(float(M[2, 0])))
    sheet.given(x=M[:3, 0].copy())
    if arm.robot.n == 3:
        sheet.put("w", "p - l3*x", "point")
    else:
        sheet.given(w=M[:3, 3].copy())
    if off > FLAT:
        sheet.close("centre", failure="off the plane", excess=off)
        return False
    sheet.put("D", "sqrt(w_x**2 + w_y**2)", "length")
    sheet.close("centre")
    if not _cosine_rule(sheet, ("l1", "l2"), "θ2", signs[0], 0):
        return False
    sheet.put("β", "atan2(l2*sin(θ2), l1 + l2*cos(θ2))", "angle")
    sheet.put("θ1", "atan2(w_y, w_x) - β", "angle")
    sheet.close("theta1", special="on axis 1" if sheet["D"] < SINGULAR else None)
    if arm.robot.n == 3:
        sheet.put("φ", "atan2(x_y, x_x)", "angle")
        sheet.put("θ3", "φ - θ1 - θ2", "angle")
        sheet.close("last")
    return True
