"""The lesson's numbers and sentences, as HTML for the panel."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from app.viewer.lessons.figure_shapes import GREY
from app.viewer.lessons.screws.drawing import GHOST, VELOCITY
from app.viewer.lessons.screws.product import Form, foot, product
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.views import mathml as m
from app.viewer.views.templates import render
from kin import Robot, fk
from kin.dh import Screws, exp_screw
from kin.transforms import Array
from kin.units import Units, fixed, power

MATRIX = 0.74  # em, as in the lesson on DH tables
DIGITS = 5  # of the two products
LETTER: dict[Form, str] = {"space": "S", "body": "B"}
FRAME: dict[Form, str] = {"space": "world", "body": "tool"}


def table_html(robot: Robot, columns: Array, form: Form, now: bool, chosen: int) -> str:
    """The six numbers of every screw ``(6, n)``, and its pitch."""
    rows = [
        {
            "name": m.math(_name(form, i)),
            "color": "rgb({},{},{})".format(*joint_color(i)),
            "values": [fixed(value, 3) for value in columns[:, i].tolist()],
            "pitch": "0" if robot.revolute[i] else "∞",
        }
        for i in range(robot.n)
    ]
    heads = [(f"{name} {axis}", m.math(m.sub(m.ident(name), m.text(axis)))) for name in "ωv" for axis in "xyz"]
    where = "where the axes are now: the columns of the Jacobian" if now else "with all joints at zero"
    note = f"Screws in the {FRAME[form]} frame, {where}. ω without unit, v in m; h is the pitch."
    return render("screws/table", rows=rows, heads=heads, chosen=chosen, form=form, note=note)


def one_html(robot: Robot, joint: int, S: Array, value: float, form: Form, units: Units) -> str:
    """How the six numbers of a screw ``(6,)`` follow from its axis, and its exponential at this joint value."""
    omega, v = S[:3], S[3:]
    name = m.math(_name(form, joint))
    if robot.revolute[joint]:
        far = units.lengths.text(float(np.linalg.norm(v)))
        cross = (m.ident("v"), m.op("="), m.neg(m.ident("ω")), m.op("×"), m.ident("p"))
        lines = [
            ("axis, unit vector", m.math(m.ident("ω"), m.op("="), _vector(omega))),
            ("its point nearest to the origin", m.math(m.ident("p"), m.op("="), _vector(foot(S)))),
            (
                "velocity at the origin",
                m.math(*cross, m.op("="), _vector(v)),
            ),
        ]
        words = f"|v| = {far}: the distance of the axis from the origin of the {FRAME[form]} frame. Pitch 0."
    else:
        lines = [
            ("nothing turns", m.math(m.ident("ω"), m.op("="), _vector(omega))),
            ("direction, unit vector", m.math(m.ident("v"), m.op("="), _vector(v))),
        ]
        words = "A prismatic joint: the whole space moves alike, wherever its axis is. Pitch ∞."
    unit = units.of(bool(robot.revolute[joint]))
    symbol = m.sub(m.ident(_variable(robot, joint)), m.short(joint + 1))
    matrix = m.math(_exponential(robot, form, joint), m.op("="), _matrix(exp_screw(S, value), 3), size=MATRIX)
    return render(
        "screws/one",
        name=name,
        lines=lines,
        words=words,
        value=Markup("{} = {}").format(m.math(symbol), unit.text(value)),
        matrix=matrix,
    )


def product_html(robot: Robot, zero: Screws, q: Array, factors: int, form: Form) -> str:
    """The product of exponentials for q ``(n,)`` beside the product of the DH table, and their difference."""
    by_screws, by_table = product(zero, q, form), fk(robot, q)
    if factors == robot.n:
        words = "All factors act: both products are the pose of the tool."
    elif factors:
        which = "last" if form == "space" else "first"
        joints = "joint" if factors == 1 else f"{factors} joints"
        words = f"The factors of the {which} {joints} act on M; the other joints are at zero (ghost)."
    else:
        words = "No factor acts: M is the pose of the tool with all joints at zero (ghost)."
    return render(
        "screws/product",
        words=words,
        formula=_formula(robot, factors, form),
        blocks=(
            ("Product of exponentials, lengths in m", "screws", m.math(_matrix(by_screws, DIGITS), size=MATRIX)),
            ("Product of the DH matrices", "table", m.math(_matrix(by_table, DIGITS), size=MATRIX)),
        ),
        difference=power(float(np.abs(by_screws - by_table).max()), 1),
    )


def legend_html(robot: Robot, form: Form, now: bool, ghost: int | None, chosen: int, asked: bool = False) -> str:
    """What is drawn in the scene; `ghost`: the factors that act on it, None without a ghost."""
    where = "where they are now" if now else "at zero"
    items = [("ring", joint_color(chosen), f"joint axes {where}, in their positive sense")]
    if robot.revolute[chosen] and not asked:
        items.append(("line", GREY, f"distance of axis {chosen + 1} from the {FRAME[form]} frame"))
    if not asked:
        items.append(("arrow", VELOCITY, f"v of joint {chosen + 1}, direction only"))
    if ghost is not None:
        words = (
            "the arm with all joints at zero" if ghost in (0, robot.n) else "the arm after the factors that act"
        )
        items.append(("ellipsoid", GHOST, words))
    return render("panel/legend", label="drawn in the scene", items=items)


def _name(form: Form, joint: int) -> m.MathML:
    return m.sub(m.ident(LETTER[form]), m.short(joint + 1))


def _variable(robot: Robot, joint: int) -> str:
    return "θ" if robot.revolute[joint] else "d"


def _exponential(robot: Robot, form: Form, joint: int) -> m.MathML:
    """e to the power of [S] θ."""
    number = m.short(joint + 1)
    power = m.row(m.op("["), _name(form, joint), m.op("]"), m.sub(m.ident(_variable(robot, joint)), number))
    return m.MathML(f"<msup>{m.ident('e')}{power}</msup>")


def _formula(robot: Robot, factors: int, form: Form) -> Markup:
    """The product, with the factors that act on a coloured ground."""
    pieces = []
    for i in range(robot.n):
        acts = i >= robot.n - factors if form == "space" else i < factors
        piece = _exponential(robot, form, i)
        pieces.append(m.mark(piece, "rgba(0,114,178,.28)") if acts else piece)
    M = m.ident("M")
    ordered = [*pieces, M] if form == "space" else [M, *pieces]
    return m.math(m.ident("T"), m.op("="), *(part for piece in ordered for part in (m.gap(), piece)), size=0.9)


def _vector(values: Array) -> m.MathML:
    parts: list[m.MathML] = []
    for value in values.tolist():
        parts += [m.op(","), m.gap()] if parts else []
        parts.append(m.number(value))
    return m.brackets(*parts)


def _matrix(T: Array, digits: int) -> m.MathML:
    """A pose ``(4, 4)``, lengths in metres."""
    rows = [[m.number(v, digits) for v in line] for line in T[:3].tolist()]
    return m.matrix([*rows, [m.short(v) for v in T[3].tolist()]], width=2.4 + 0.55 * digits)
