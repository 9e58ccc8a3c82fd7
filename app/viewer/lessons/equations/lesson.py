"""The lesson "Equations": each entry of the tool's pose as a formula, its value, and the effect of a misprint.

The chapter's arms have its equations, as printed and corrected; a misprinted one is also drawn in the scene, as
its point or axis next to the tool's own. For any other arm, the closed form is derived from its DH table.
"""

from __future__ import annotations

import time
from collections.abc import Hashable
from itertools import count
from typing import Any

import numpy as np
import viser

from app.equations import Book, DerivationError, Equation, TooManyRowsError, book_later
from app.exports.worksheet import Formula
from app.shared.computations import Subscription
from app.viewer.feature import Stage
from app.viewer.labels import add_label
from app.viewer.lessons.equations import views
from app.viewer.lessons.equations.questions import outline
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel import assign, listen, update_html
from app.viewer.panel.status import Notice
from kin import InputError, fk
from kin.transforms import Array

INTERVAL = 0.05  # s between two updates of the numbers
AFTER_EDIT = 0.5  # s without another change of the visitor's own arm, before its equations are derived
# Vermilion and bluish green, darkened because the scene applies gamma to lines.
PRINTED, TRUE = (170, 29, 0), (0, 87, 43)
_fresh = count()


class EquationsLesson(Lesson):
    """One equation at a time, chosen from a list."""

    key = "equations"
    title = "Equations"
    computes = False
    about = "The arm’s equations. For the book’s arms, also its misprints."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        gui = stage.client.gui
        self._book: Book | None = None
        self._derivation: Subscription[Book] | None = None
        self._derive_at: float | None = None  # of `time.perf_counter`
        self._requested: object = None  # id of the equation to show as soon as there is a book
        self._largest = 0.0  # largest error of the shown equation, m or rad
        self._equation: Equation | None = None
        self._T: Array = stage.now.T_tool
        self._shown_at = 0.0
        self._about = gui.add_html("")
        self._choice = gui.add_dropdown("Equation", ("…",), hint="The entry of the tool's pose [n o a p] to show")
        listen(self._choice, self.post, "equation")
        # The values come first, to be visible while joints or the gizmo are dragged.
        self._values = gui.add_html("")
        self._button = gui.add_button(
            "Show the worst pose",
            hint="Moves the arm to the pose, within its limits, where this misprint has the largest effect",
            visible=False,
        )

        @self._button.on_click
        async def _(event: Any) -> None:
            if event.client is not None:
                self.post("worst")

        self._text = gui.add_html("")
        self._test_folder = gui.add_folder("Find misprints: RᵀR − I", visible=False)
        with self._test_folder:
            self._test = gui.add_html("")
        self._folder = gui.add_folder("Symbols", expand_by_default=False)
        with self._folder:
            self._symbols = gui.add_html("")
        self._nodes: list[viser.SceneNodeHandle] = []
        self.on_robot()

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case "equation":
                self._choose(value)
            case "ready":
                self._take()
            case "worst":
                self._move_to_worst()
            case _:
                super().handle(key, value)

    def on_robot(self) -> None:
        robot, own = self.stage.now.robot, self.stage.own
        self._T = fk(robot, self.stage.now.q)
        self._book = self._equation = None
        self._stop_deriving()
        self._empty("Deriving the equations of this arm …")
        if own is not None and own.robot == robot:  # which the visitor may still be editing
            self._derive_at = time.perf_counter() + AFTER_EDIT
            self.due = AFTER_EDIT
        else:
            self._derive()

    def _derive(self) -> None:
        """Ask for the equations of the arm on show."""
        self._derive_at = None
        try:
            self._derivation = derivation = book_later(self.stage.now.robot)
        except TooManyRowsError as error:
            self._empty(f"No equations for so many rows: {error}.")
            return
        if derivation.finished:
            self._take()
        else:
            derivation.future.add_done_callback(lambda _: self.post("ready"))

    def _stop_deriving(self) -> None:
        """Wait no more; unless somebody else waits for the same equations, they are not derived."""
        self._derive_at = None
        if self._derivation is not None:
            self._derivation.leave()
            self._derivation = None

    def on_pose(self, T_base_tool: Array) -> None:
        self._T = T_base_tool
        if time.perf_counter() - self._shown_at >= INTERVAL:
            self._show_values()
        else:
            self.due = INTERVAL

    def tick(self, now: float) -> None:
        if self._derive_at is not None and now >= self._derive_at:
            self._derive()
        if now - self._shown_at >= INTERVAL:
            self._show_values()

    def on_style(self) -> None:
        self._show_symbols()
        self._show_values()

    def state(self) -> dict[str, object]:
        return {"equation": self._equation.id} if self._equation is not None else {}

    def restore(self, state: dict[str, object]) -> None:
        requested = state.get("equation")
        if self._book is None:
            self._requested = requested
            return
        for equation in self._book.equations:
            if equation.id == requested:
                self._show(equation)

    def on_leave(self) -> None:
        self._stop_deriving()

    def remove(self) -> None:
        self._stop_deriving()
        self._clear_scene()
        for handle in (self._about, self._choice, self._text, self._values, self._button):
            handle.remove()
        self._test_folder.remove()
        self._folder.remove()

    def formulas(self) -> tuple[Formula, ...]:
        return () if self._book is None else views.formulas(self._book)

    def _take(self) -> None:
        """Take the derived book, or the reason why there is none."""
        if self._derivation is None or not self._derivation.finished or self._book is not None:
            return  # of a robot that is no longer selected
        try:
            self._book = self._derivation.future.result()
        except DerivationError as error:
            self._empty(f"No equations: {error}.")
            self.stage.notify(Notice("error", "No equations for this arm", str(error)))
            return
        except Exception:
            self._empty("The equations of this arm could not be derived.")
            raise
        self._about.content = views.message(views.summary(self._book))
        self._test_folder.visible = self._book.source == "chapter"
        self._choice.options = tuple(views.label(e) for e in self._book.equations)
        self._choice.visible = True
        self._show(self._first(self._book))
        self._requested = None

    def _first(self, book: Book) -> Equation:
        """The equation to start with: the requested one, else the first misprint, else the first readable one."""
        readable = [e for e in book.equations if e.correct is not None]
        requested = [e for e in book.equations if e.id == self._requested]
        return next(iter([*requested, *(e for e in readable if e.verdict == "misprinted"), *readable]))

    def _choose(self, value: object) -> None:
        if self._book is None:
            return
        equations = {views.label(e): e for e in self._book.equations}
        if value not in equations:
            if self._equation is not None:
                assign(self._choice, views.label(self._equation))
            raise InputError("equation", value, "one of " + ", ".join(equations))
        self._show(equations[str(value)])

    def _show(self, equation: Equation) -> None:
        assert self._book is not None
        self._equation = equation
        assign(self._choice, views.label(equation))
        self._text.content = views.equation_html(self._book, equation)
        self._button.visible = equation.verdict == "misprinted"
        self._folder.visible = equation.correct is not None
        self._show_symbols()
        self._largest = self._most(equation)
        self._clear_scene()
        self._show_values()

    def _most(self, equation: Equation) -> float:
        """The largest error of a misprinted equation, m or rad."""
        assert self._book is not None
        if not equation.worst:
            return 0.0
        values = self._book.values(equation, np.array(equation.worst))
        return abs(float(values.difference)) if equation.is_length else float(values.turn)

    def _move_to_worst(self) -> None:
        if self._equation is None or not self._equation.worst:
            return
        equation = self._equation
        units = self.stage.units
        error = units.distance(self._largest) if equation.is_length else units.angle(self._largest)
        detail = f"As printed, {equation.entry} is off by {error} here."
        notice = Notice("hand", f"Equation ({equation.number}) at its worst", detail)
        self.stage.move_to(np.array(equation.worst), notice)

    def _show_symbols(self) -> None:
        if self._book is None or self._equation is None:
            return
        content = views.symbols_html(self._book.symbols_of(self._equation), self.stage.units)
        update_html(self._symbols, content)

    def _show_values(self) -> None:
        arm = self.stage.now
        self._shown_at = now = time.perf_counter()
        self.due = None if self._derive_at is None else max(0.0, self._derive_at - now)
        equation = self._equation
        if self._book is None or equation is None:
            return
        if self._book.source == "chapter":
            update_html(self._test, views.test_html(self._book, arm.q))
        if equation.correct is None:
            update_html(self._values, views.unreadable_html(equation))
            return
        values = self._book.values(equation, arm.q, self._T)
        content = views.values_html(equation, values, self.stage.units, self._largest)
        update_html(self._values, content)
        if equation.verdict == "misprinted":
            self._draw(views.segments(equation, values, self._T, 0.2 * arm.robot.reach))

    def _draw(self, lines: Array) -> None:
        """Draw the misprint as lines, with a label at the far end."""
        scene = self.stage.client.scene
        if not self._nodes:
            root = f"/equations-{next(_fresh)}"
            colors = np.array([[PRINTED, PRINTED], [TRUE, TRUE]], np.uint8)[: len(lines)]
            self._segments = scene.add_line_segments(
                f"{root}-lines", lines.astype(np.float32), colors, thickness=4.0, thickness_units="screen"
            )
            self._label = add_label(scene, f"{root}-label", "as printed", position=tuple(lines[0, 1].tolist()))
            self._nodes = [self._segments, self._label]
            return
        self._segments.points = lines.astype(np.float32)
        self._label.position = tuple(lines[0, 1].tolist())

    def _clear_scene(self) -> None:
        for node in self._nodes:
            node.remove()
        self._nodes = []

    def _empty(self, message: str) -> None:
        """Show a sentence instead of equations."""
        self._clear_scene()
        self._about.content = views.message(message)
        self._text.content = self._values.content = self._symbols.content = ""
        self._choice.visible = self._button.visible = self._folder.visible = self._test_folder.visible = False
