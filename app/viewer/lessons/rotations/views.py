"""Rotations and chains of frames as HTML for the panel."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from app.viewer.lessons.rotations.conventions import LOCKED, NEAR, PAGE, Angles, Convention, axis_angle
from app.viewer.lessons.rotations.frames import Motion, factors, places, swapped
from app.viewer.views.mathml import ident, number, op, row, sub, text
from app.viewer.views.mathml import math as formula
from app.viewer.views.mathml import matrix as matrix_of
from app.viewer.views.templates import render
from kin.axes import inverse
from kin.poses import RPY
from kin.transforms import Array, rotation_angle, wxyz_from_rotation
from kin.units import Units, fixed

DECIMALS = 3
PRIMES = ("", "′", "″")


def turn_name(convention: Convention, k: int) -> str:
    """What one of the three angles does, such as ``β about y′``; primes count the turns before it."""
    prime = "" if convention.fixed else PRIMES[k]
    return f"{'αβγ'[k]} about {convention.axes[k]}{prime}"


def triple(angles: Angles, units: Units) -> str:
    """Three angles with their unit."""
    unit = units.angles
    # 180° for −180°: the sign of half a turn is rounding.
    shown = (abs(a) if math.degrees(abs(a)) > 179.95 else a for a in angles)
    return "(" + ", ".join(unit.number(angle) for angle in shown) + ")" + unit.suffix


def convention_html(convention: Convention) -> str:
    """Name and formula of the convention."""
    return render("rotations/convention", name=convention.name, formula=convention.formula)


def turning_html(convention: Convention, at: int | None) -> str:
    """Which turn the frame beside the arm is making; "" if it stands."""
    if at is None or at > 2:
        return ""
    return render("rotations/turning", number=at + 1, turn=turn_name(convention, at))


def lock_html(convention: Convention, angles: Angles, units: Units) -> str:
    """How far the convention is from its gimbal lock."""
    room = convention.room(angles)
    about = f"β = {'0 or 180°' if convention.is_proper else '±90°'}"
    if not units.degrees:
        about = f"β = {'0 or π' if convention.is_proper else '±π/2'}"
    axes = "The 1st and the 3rd axis"
    if convention.fixed:
        axes = "The axis of the 1st turn, carried along by the later ones, and that of the 3rd"
    if room < 1e-6:
        state, look = "at", ("kb-vermilion", "✕", "Gimbal lock")
        detail = f"{axes} are parallel: both angles turn about the same axis, and one turn is lost."
    elif room < NEAR:
        state, look = "near", ("kb-amber", "!", f"Near gimbal lock, {units.angle(room)} away")
        detail = f"{axes} are nearly parallel: small turns change α and γ much."
    else:
        state, look = "far", ("kb-green", "✓", f"{units.angle(room)} from gimbal lock")
        detail = f"This convention locks at {about}."
    color, symbol, title = look
    return render("rotations/lock", state=state, color=color, symbol=symbol, title=title, detail=detail)


def rotation_html(convention: Convention, angles: Angles, units: Units) -> str:
    """One rotation in all its forms."""
    R = convention.rotation(angles)
    axis, turned = axis_angle(R)
    twin = convention.twin
    wxyz = wxyz_from_rotation(R)
    page = PAGE.angles(R)
    rows = [
        ("Same rotation", f"{twin.title} with {triple(angles[::-1], units)}"),
        ("Other angles", f"{triple(convention.other(angles), units)}, the same convention"),
        ("Axis and angle", f"({', '.join(fixed(v) for v in axis.tolist())}), {units.angles.text(turned)}"),
        ("Quaternion w x y z", ", ".join(fixed(v) for v in wxyz.tolist())),
        ("Roll pitch yaw", f"{triple(page, units)}, as everywhere on this page: {RPY.definition}"),
    ]
    if convention.room(angles) < LOCKED:
        rows[1] = ("Other angles", "infinitely many: only the sum or difference of α and γ counts")
    return render("rotations/rotation", matrix=matrix_html("R", R), rows=rows)


def matrix_html(name: str, M: Array) -> Markup:
    """A named matrix."""
    head = ident(name) if len(name) == 1 else sub(ident(name[0]), text(name[1:]))
    lines = [[number(value + 0.0, DECIMALS) for value in line] for line in M.tolist()]
    return formula(row(head, op("="), matrix_of(lines, width=3.3)))


def pose_html(name: Markup, T: Array, units: Units) -> Markup:
    """A named transform, its lengths in the chosen unit."""
    unit = units.lengths
    lines = [
        [
            *(number(value + 0.0, DECIMALS) for value in line[:3]),
            number(line[3] * (unit.scale if k < 3 else 1.0) + 0.0, unit.decimals(1) if k < 3 else 0),
        ]
        for k, line in enumerate(T.tolist())
    ]
    return Markup("{}{}").format(name, formula(op("="), matrix_of(lines, width=3.3)))


def motion_name(motion: Motion, units: Units) -> str:
    """A motion in words."""
    axis = "xyz"[motion.axis]
    whose = "own" if motion.own else "fixed"
    if motion.turns:
        return f"turn by {units.angles.text(motion.amount)} about the {whose} {axis}"
    return f"shift by {units.lengths.text(motion.amount)} along the {whose} {axis}"


def factor_name(motion: Motion, units: Units) -> str:
    """A motion as a factor of the product."""
    letter, unit = ("R", units.angles) if motion.turns else ("T", units.lengths)
    return f"{letter}{'xyz'[motion.axis]}({unit.text(motion.amount)})"


def chain_html(motions: tuple[Motion, ...], units: Units) -> str:
    """The motions of a chain, their product, and its inverse."""
    T = places(motions)[-1]
    back = inverse(T)
    order = factors(motions)
    product = " · ".join(factor_name(motions[k], units) for k in order) or "I"
    return render(
        "rotations/chain",
        motions=[motion_name(motion, units) for motion in motions],
        product=product,
        count=len(motions),
        T=pose_html(_named("T", ""), T, units),
        back=pose_html(_named("T", "−1"), back, units),
        unit=units.lengths.name,
        swap=_swap(motions, units),
    )


def _named(letter: str, power: str) -> Markup:
    return Markup("<i>{}</i><sup>{}</sup> ").format(letter, power)


def _swap(motions: Sequence[Motion], units: Units) -> str:
    """What the order of the last two motions matters."""
    chain = tuple(motions)
    if len(chain) < 2:
        return "Add two motions to compare their orders."
    here, there = places(chain)[-1], places(swapped(chain))[-1]
    far = float(np.linalg.norm(here[:3, 3] - there[:3, 3]))
    turned = rotation_angle(here[:3, :3], there[:3, :3])
    if far < 1e-9 and turned < 1e-9:
        return "The order of the last two motions does not matter here: they commute."
    return (
        f"With the last two motions swapped, the frame would be {units.distance(far)} and "
        f"{units.angle(turned)} away."
    )


def error_html(error: str) -> str:
    """Why a typed rotation was not taken."""
    return render("rotations/error", text=error)
