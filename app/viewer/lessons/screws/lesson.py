"""The lesson "Screws": the joint axes as six numbers each, and the tool pose as a product of their exponentials.

The axes are drawn either with all joints at zero, as in the formula, or at the current configuration. There they
are the columns of the Jacobian. A ghost shows the arm after the first factors of the product.

The words and questions are in ``lesson.toml``, which names the attributes of `ScrewsAsked`; the markup of the
panel is in ``panel.html``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from markupsafe import Markup

import kin
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, choice, slider
from app.viewer.declared.panel import Control, Folder, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import GREY
from app.viewer.lessons.guide.content import AskedFacts
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import LEAST, Configuration, Ghost, Lead, Pose
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.screws.drawing import GHOST, VELOCITY, foot, scene, tips
from app.viewer.panel.joints import label
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.camera import round_points
from app.viewer.scene.meshes import body
from app.viewer.views import mathml as m
from app.viewer.views.templates import part, render
from kin import Robot, fk
from kin.dh import Screws, exp_screw
from kin.transforms import Array
from kin.units import Units, fixed, power

Form = Literal["space", "body"]
FORMS: dict[str, Form] = {"Space (world frame)": "space", "Body (tool frame)": "body"}
PLACES = {"All joints at zero": "zero", "Where they are now": "now"}
FORM_HINT = "The frame in which the six numbers of each screw are given"
PLACE_HINT = "The formula takes the screws at zero; where they are now, they are the columns of the Jacobian"
JOINT_HINT = "Shows how the six numbers of this joint's screw follow from its axis"
FACTORS_HINT = "How many factors of the product act, those next to M first; the ghost shows the arm they give"
LABELS = 1.15  # room for the labels beyond the ends of the axes
MATRIX = 0.74  # em, as in the lesson on DH tables
DIGITS = 5  # of the two products
LETTER: dict[Form, str] = {"space": "S", "body": "B"}
FRAME: dict[Form, str] = {"space": "world", "body": "tool"}
TURNED = math.radians(40.0)
UPRIGHT = 0.999  # of the vertical part of a direction
MOST_SORTED, APART = 4, 0.04  # joints that are sorted, and how different they are, in the largest |v|
BESIDE = 0.02  # of the reach: how far from its axis the tool point is clearly beside it
_INDICES = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")

zero_screws = lru_cache(maxsize=64)(kin.dh.screws)


# Screws without a scene


def partial(q: Array, factors: int, form: Form) -> Array:
    """The configuration ``(n,)`` that the factors next to M give: of the last joints, or the first (body form)."""
    out = np.zeros_like(q)
    chosen = slice(len(q) - factors, None) if form == "space" else slice(None, factors)
    out[chosen] = q[chosen]
    return out


def product(zero: Screws, q: Array, form: Form) -> Array:
    """The product of exponentials ``(4, 4)``, multiplied in the order of the form."""
    if form == "space":
        return zero.pose(q)
    T = zero.M
    for B, value in zip(zero.B.T, q, strict=True):
        T = T @ exp_screw(B, value)
    return np.asarray(T)


def far_joint(S: Array) -> int:
    """The joint with the largest v among those that turn; −1 if all axes pass through the origin."""
    size = np.where(np.linalg.norm(S[:3], axis=0) > 0.5, np.linalg.norm(S[3:], axis=0), 0.0)
    joint = int(np.argmax(size))
    return joint if size[joint] > 10.0 * LEAST else -1


# Settings and facts


@lru_cache(maxsize=128)
def joints(robot: Robot) -> Mapping[str, int]:
    """The numbers of the joints, from 1, by their names."""
    return {label(robot, i): i + 1 for i in range(robot.n)}


def far(robot: Robot) -> int:
    """The number of the first joint whose axis does not meet the origin."""
    return max(far_joint(zero_screws(robot).S), 0) + 1


@dataclass(frozen=True)
class ScrewsSettings(Settings):
    """Joints count from 1; the names are those of links."""

    form: Form = choice("Form", FORMS, "space", hint=FORM_HINT)
    axes: str = choice("Axes", PLACES, "zero", hint=PLACE_HINT)
    joint: int = choice("Joint", joints, far, hint=JOINT_HINT)
    factors: int = slider(
        "Factors", lambda robot: robot.n, (0, 0), hint=FACTORS_HINT, whole=True, within=lambda robot: (0, robot.n)
    )


@dataclass(frozen=True, eq=False)
class ScrewsFacts(Facts[ScrewsSettings]):
    """The screws of the arm, where its axes are, and what the factors give."""

    @property
    def now(self) -> bool:
        """Whether the axes are those at the configuration in the scene."""
        return self.settings.axes == "now"

    @property
    def chosen(self) -> int:
        """The index of the joint whose screw is explained."""
        return self.settings.joint - 1

    @property
    def zero(self) -> Screws:
        """The screws with all joints at zero, which the formula takes."""
        return zero_screws(self.robot)

    @cached_property
    def screws(self) -> Screws:
        """The screws where the axes are drawn."""
        return kin.dh.screws(self.robot, self.q) if self.now else self.zero

    @cached_property
    def axes(self) -> tuple[Array, Array]:
        """A point of each axis and its direction ``(n, 3)``."""
        return axes_at(self.robot, self.q if self.now else np.zeros(self.robot.n))

    @property
    def columns(self) -> Array:
        """The screws ``(6, n)`` in the frame of the form: the world's, or the tool's."""
        return self.screws.S if self.settings.form == "space" else self.screws.B

    @property
    def origin(self) -> Array:
        """The frame ``(4, 4)`` in which they are given."""
        return np.eye(4) if self.settings.form == "space" else self.screws.M

    @cached_property
    def acting(self) -> Array:
        """The configuration ``(n,)`` that the factors give."""
        return partial(self.q, self.settings.factors, self.settings.form)

    @cached_property
    def ghost(self) -> Array | None:
        """The arm after the factors that act; with all of them the arm at zero, if the axes are drawn there."""
        ghost = self.acting
        if self.settings.factors == self.robot.n:
            ghost = self.q if self.now else np.zeros(self.robot.n)
        return None if np.abs(ghost - self.q).max() < 1e-9 else ghost


# What is asked


@dataclass(frozen=True, eq=False)
class ScrewsAsked(AskedFacts):
    """The arm with all joints at zero, of which the questions are. Joints count from 1."""

    @cached_property
    def seen(self) -> int:
        """The last joint that turns."""
        return next((i + 1 for i in range(self.robot.n - 1, -1, -1) if self.robot.revolute[i]), 1)

    @property
    def axis(self) -> str:
        """The axis of the world, x, y or z, along which this joint's axis runs most."""
        return "xyz"[int(np.argmax(np.abs(self._direction)))]

    @property
    def component(self) -> float:
        """The component of its direction along that axis of the world."""
        return float(self._direction["xyz".index(self.axis)])

    @property
    def far(self) -> int:
        """The joint that turns with the axis farthest from the origin of the world."""
        return far_joint(self._S) + 1

    @property
    def far_omega(self) -> str:
        """The direction of this axis."""
        return _listed(self._screw(self.far)[:3])

    @property
    def far_point(self) -> str:
        """The origin of the frame on this axis."""
        unit = self.units.lengths
        return f"({', '.join(unit.number(value) for value in self._point.tolist())}){unit.suffix}"

    @property
    def far_distance(self) -> float:
        """Its distance from the origin of the world, m."""
        return float(np.linalg.norm(self._screw(self.far)[3:]))

    @property
    def far_origin(self) -> float:
        """Distance of the frame on it from the origin of the world, m."""
        return float(np.linalg.norm(self._point))

    @property
    def far_component(self) -> float:
        """The largest component of its v, m/s."""
        return float(np.abs(self._screw(self.far)[3:]).max())

    def foot(self, coordinate: float) -> float:
        """Coordinate 1, 2 or 3 of the point of the far axis nearest to the origin, m."""
        return float(foot(self._screw(self.far))[int(coordinate) - 1])

    @property
    def slides(self) -> int:
        """The first joint that slides; 0: none does."""
        return next((i + 1 for i in range(self.robot.n) if not self.robot.revolute[i]), 0)

    @property
    def last(self) -> int:
        """The number of the last joint."""
        return self.robot.n

    @property
    def last_low(self) -> str:
        """The same as an index."""
        return str(self.robot.n).translate(_INDICES)

    @property
    def upright(self) -> int:
        """How many joints have an axis along z of the world."""
        return int((np.abs(np.where(self.robot.revolute, self._S[2], self._S[5])) > UPRIGHT).sum())

    @cached_property
    def body_joint(self) -> int:
        """The last joint with an axis beside the tool point; the last one if all pass through it."""
        beside = np.linalg.norm(zero_screws(self.robot).B[3:], axis=0) > BESIDE * self.robot.reach
        found = np.flatnonzero(self.robot.revolute & beside)
        return int(found[-1]) + 1 if len(found) else self.robot.n

    @property
    def body(self) -> float:
        """Length of its v in the body form, m/s."""
        return float(np.linalg.norm(zero_screws(self.robot).B[3:, self.body_joint - 1]))

    @property
    def space(self) -> float:
        """The same in the space form, m/s."""
        return float(np.linalg.norm(self._screw(self.body_joint)[3:]))

    @cached_property
    def near_joint(self) -> int:
        """Another joint that turns about an axis away from the origin; the same if there is none.

        The point of its axis nearest to the origin has no number of `far_point`.
        """
        for joint in np.argsort(-np.linalg.norm(self._S[3:], axis=0), kind="stable").tolist():
            nearest = float(np.abs(foot(self._S[:, joint])).max())
            given = abs(nearest - np.abs(self._point)) <= 0.03 * nearest
            if joint + 1 != self.far and nearest > 10.0 * LEAST and not given.any():
                return int(joint) + 1
        return self.far

    @property
    def near_axis(self) -> str:
        """In which coordinate, x, y or z, the point of its axis nearest to the origin is largest."""
        return "xyz"[int(np.argmax(np.abs(foot(self._screw(self.near_joint)))))]

    @property
    def near(self) -> float:
        """This coordinate, m."""
        return float(foot(self._screw(self.near_joint))["xyz".index(self.near_axis)])

    @property
    def near_omega(self) -> str:
        """The direction of its axis."""
        return _listed(self._screw(self.near_joint)[:3])

    @property
    def near_v(self) -> str:
        """v of this axis, m/s."""
        return _listed(self._screw(self.near_joint)[3:])

    @property
    def sorted(self) -> int:
        """How many joints are to be sorted by |v|, 2 to 4; 0: no two that turn differ in it."""
        return len(self._different)

    def passes(self, place: float) -> float:
        """|v| of the first to fourth of these, m/s."""
        return float(np.linalg.norm(self._S[3:, self._different[int(place) - 1]]))

    @property
    def near1(self) -> str:
        """The first of these joints, as a name."""
        return self._name(1)

    @property
    def near2(self) -> str:
        """The second."""
        return self._name(2)

    @property
    def near3(self) -> str:
        """The third."""
        return self._name(3)

    @property
    def near4(self) -> str:
        """The fourth."""
        return self._name(4)

    @property
    def poses(self) -> Mapping[str, Pose]:
        home, zeros = as_configuration(self.robot.q_home), np.zeros(self.robot.n)
        zero = as_configuration(zeros) if self.robot.in_limits(zeros) else home
        return {"home": Pose(home), "zero": Pose(zero, drawing={"form": "space", "axes": "zero"})}

    @property
    def leads(self) -> Mapping[str, Lead | None]:
        return {"last first": Ghost(self._alone(self.robot.n - 1)), "joint 1 first": Ghost(self._alone(0))}

    @property
    def _S(self) -> Array:
        return zero_screws(self.robot).S

    def _screw(self, joint: int) -> Array:
        """The screw ``(6,)`` of a joint; of joint 0, which is none, no numbers."""
        return np.asarray(self._S[:, joint - 1]) if joint else np.full(6, math.nan)

    @property
    def _direction(self) -> Array:
        return self._screw(self.seen)[:3]

    @cached_property
    def _point(self) -> Array:
        """The origin ``(3,)`` of the frame on the far axis."""
        points = axes_at(self.robot, np.zeros(self.robot.n))[0]
        return np.asarray(points[self.far - 1]) if self.far else np.full(3, math.nan)

    @cached_property
    def _different(self) -> list[int]:
        """Up to `MOST_SORTED` joints that turn, all differently far from the origin; none if there is only one."""
        size = np.linalg.norm(self._S[3:], axis=0)
        chosen: list[int] = []
        for k in np.flatnonzero(np.linalg.norm(self._S[:3], axis=0) > 0.5).tolist():
            if all(abs(size[k] - size[other]) > APART * size.max() for other in chosen):
                chosen.append(k)
        return chosen[:MOST_SORTED] if len(chosen) > 1 else []

    def _name(self, place: int) -> str:
        return f"Joint {self._different[place - 1] + 1}" if place <= self.sorted else ""

    def _alone(self, joint: int) -> Configuration:
        """All joints at zero but one, which is where it is at home, or moved if it is at zero there too."""
        q = np.zeros(self.robot.n)
        q[joint] = self.robot.q_home[joint] or (TURNED if self.robot.revolute[joint] else 0.1 * self.robot.reach)
        return as_configuration(q)


def _listed(values: Array) -> str:
    return "(" + ", ".join(fixed(value) for value in values.tolist()) + ")"


# The panel


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
    return part("screws/panel", "table", rows=rows, heads=heads, chosen=chosen, form=form, note=note)


def one_html(robot: Robot, joint: int, S: Array, value: float, form: Form, units: Units) -> str:
    """How the six numbers of a screw ``(6,)`` follow from its axis, and its exponential at this joint value."""
    omega, v = S[:3], S[3:]
    if robot.revolute[joint]:
        far = units.lengths.text(float(np.linalg.norm(v)))
        cross = (m.ident("v"), m.op("="), m.neg(m.ident("ω")), m.op("×"), m.ident("p"))
        lines = [
            ("axis, unit vector", m.math(m.ident("ω"), m.op("="), _vector(omega))),
            ("its point nearest to the origin", m.math(m.ident("p"), m.op("="), _vector(foot(S)))),
            ("velocity at the origin", m.math(*cross, m.op("="), _vector(v))),
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
    shown = Markup("{} = {}").format(m.math(symbol), unit.text(value))
    return part("screws/panel", "one", lines=lines, words=words, value=shown, matrix=matrix)


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
    blocks = (
        ("Product of exponentials, lengths in m", "screws", m.math(_matrix(by_screws, DIGITS), size=MATRIX)),
        ("Product of the DH matrices", "table", m.math(_matrix(by_table, DIGITS), size=MATRIX)),
    )
    difference = power(float(np.abs(by_screws - by_table).max()), 1)
    formula = _formula(robot, factors, form)
    return part("screws/panel", "product", words=words, formula=formula, blocks=blocks, difference=difference)


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
    return m.math(m.ident("T"), m.op("="), *(each for piece in ordered for each in (m.gap(), piece)), size=0.9)


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


class ScrewsLesson(DeclaredFeature[ScrewsSettings, ScrewsFacts], Lesson):
    """See the module."""

    key = "screws"
    by_rows = True
    through = True
    title = "Screws"
    about = "Each joint axis as six numbers, and the pose of the tool as a product of exponentials."
    settings_of, facts_of, asked_of = ScrewsSettings, ScrewsFacts, ScrewsAsked

    def started(self) -> None:
        self._figure = FigureNodes(body(self.stage.arm.now.robot).size)
        self.stage.arm.scene.see_through(True)
        center, radius = round_points(tips(self.facts))
        self.stage.camera.fit([(center, LABELS * radius)])

    def remove(self) -> None:
        super().remove()
        self.stage.arm.scene.see_through(False)
        self.stage.camera.fit([])

    def panel(self) -> Sequence[Node]:
        f, s, robot = self.read, self.settings, self.read.robot
        value = float(f.q[f.chosen])
        one = robot, f.chosen, f.columns[:, f.chosen], value, s.form, self.stage.display.units
        table = Html(table_html, (robot, f.columns, s.form, f.now, f.chosen))
        acting = Html(product_html, (robot, f.zero, f.acting, s.factors, s.form))
        return [
            Control("form"),
            Control("axes"),
            *self.unless_asked("screws", table),
            Folder(
                "One screw", [Control("joint", of=robot.id), *self.unless_asked("screws", Html(one_html, one))]
            ),
            Folder("Product of exponentials", [Control("factors", of=robot.id), acting]),
        ]

    def scene(self) -> Sequence[Lazy]:
        # Axes at zero do not move with the arm.
        facts, units = self.facts if self.facts.now else self.read, self.stage.display.units
        return [Lazy("screws", scene, (facts, self._figure, units, self.hides("screws")))]

    def legend(self) -> str:
        f, s = self.read, self.settings
        ghost = None if f.ghost is None else s.factors
        return legend_html(f.robot, s.form, f.now, ghost, f.chosen, self.hides("screws"))
