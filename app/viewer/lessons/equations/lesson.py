"""The lesson "Equations": each entry of the tool's pose as a formula, its value, and the effect of a misprint.

The chapter's arms have its equations, as printed and corrected; a misprinted one is also drawn in the scene, as
its point or axis next to the tool's own. For any other arm, the closed form is derived from its DH table.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from app.equations import DerivationError, NotDerivedError, book_later
from app.exports.worksheet import Formula, Left
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Button, Control, Folder, Html, Node
from app.viewer.declared.scene import Lazy, label, lines
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Work
from app.viewer.lessons.equations import views
from app.viewer.lessons.equations.facts import EquationsFacts
from app.viewer.lessons.equations.questions import facts
from app.viewer.lessons.equations.settings import EquationsSettings
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel.status import Notice

AFTER_EDIT = 0.5  # s without another change of the visitor's own arm, before its equations are derived
# Vermilion and bluish green, darkened because the scene applies gamma to lines.
PRINTED, TRUE = (170, 29, 0), (0, 87, 43)
WORST_HINT = "Moves the arm to the pose, within its limits, where this misprint has the largest effect"


class EquationsLesson(DeclaredFeature[EquationsSettings, EquationsFacts], Lesson):
    """One equation at a time, chosen from a list."""

    key = "equations"
    title = "Equations"
    computes = False
    about = "The arm’s equations. For the book’s arms, also its misprints."
    asked_of = staticmethod(facts)
    settings_of, facts_of = EquationsSettings, EquationsFacts
    left: ClassVar[Left] = "pose"

    def running(self) -> Sequence[Work]:
        robot, own = self.stage.arm.now.robot, self.stage.robots.own
        edited = own is not None and own.robot == robot  # which the visitor may still be editing
        return [Work("book", book_later, (robot,), rest=AFTER_EDIT if edited else 0.0)]

    def worked(self, key: str) -> None:
        error = self.facts.work(key).error
        if not isinstance(error, DerivationError):
            super().worked(key)
        elif not isinstance(error, NotDerivedError):
            self.stage.status.show(Notice("error", "No equations for this arm", str(error)))

    def state(self) -> dict[str, object]:
        self.invalidate()
        equation = self.facts.equation
        shown = self.settings.equation if equation is None else equation.id
        return {"equation": shown} if shown else {}

    def formulas(self) -> tuple[Formula, ...]:
        return () if self.facts.book is None else views.formulas(self.facts.book)

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, units = self.read, self.stage.display.units
        nodes: list[Node] = [Html(views.message, (f.about,), key="about")]
        book, equation = f.book, f.equation
        test, symbols = list[Node](), list[Node]()
        if self.hides("equations"):
            nodes += self.unless_asked("equations")
        elif book is not None and equation is not None:
            nodes += self._equation(f)
            if book.source == "chapter":
                test = [Html(views.test_html, (book, f.q))]
            if equation.correct is not None:
                symbols = [Html(views.symbols_html, (book.symbols_of(equation), units))]
        return [
            *nodes,
            Folder("Find misprints: RᵀR − I", test, visible=bool(test), key="test"),
            Folder("Symbols", symbols, open=False, visible=bool(symbols), key="symbols"),
        ]

    def _equation(self, f: EquationsFacts) -> list[Node]:
        """The equation on show, and its values."""
        book, equation, units = f.book, f.equation, self.stage.display.units
        assert book is not None
        assert equation is not None
        options = {views.label(e): e.id for e in book.equations}
        values = Html(views.unreadable_html, (equation,), key="unreadable")
        if equation.correct is not None:
            values = Html(views.values_html, (equation, f.values, units, f.largest), key="values")
        return [
            Control("equation", spec=self.spec("equation").narrowed(options), value=equation.id, of=f.robot.id),
            # The values come first, to be visible while joints or the gizmo are dragged.
            values,
            Button("Show the worst pose", self.event(self.on_worst), WORST_HINT, visible=f.misprinted),
            Html(views.equation_html, (book, equation), key="text"),
        ]

    def scene(self) -> Sequence[Lazy]:
        shown = self.read.misprinted and not self.hides("equations")
        return [Lazy("misprint", _misprint, (self.read,))] if shown else []

    # Events

    def on_worst(self) -> None:
        """Move the arm to where the misprint shows most."""
        f, units = self.facts, self.stage.display.units
        equation = f.equation
        if equation is None or not equation.worst:
            return
        error = units.distance(f.largest) if equation.is_length else units.angle(f.largest)
        detail = f"As printed, {equation.entry} is off by {error} here."
        notice = Notice("hand", f"Equation ({equation.number}) at its worst", detail)
        self.stage.arm.move_to(np.array(equation.worst), notice)


def _misprint(f: EquationsFacts) -> list[SceneNode]:
    """The misprint as lines, with a label at the far end."""
    points = f.segments
    colors = np.array([[PRINTED, PRINTED], [TRUE, TRUE]], np.uint8)[: len(points)]
    # As many lines as the equation has: each has a node of its own, so that points and colours fit.
    return [
        lines(f"lines-{len(points)}", points, colors, 4.0),
        label("label", "as printed", points[0, 1], anchor=None),
    ]
