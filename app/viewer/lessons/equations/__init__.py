"""Equations: each entry of the tool's pose as a formula, its value here, and where a misprint leads.

The chapter's arms have its equations, as printed and corrected; a misprinted one puts its point or axis into the
picture as well, beside the tool's own. Any other arm has the closed form derived from its DH table.
"""

from __future__ import annotations

import time
from collections.abc import Hashable
from concurrent.futures import Future
from itertools import count
from typing import Any

import numpy as np
import viser

from app.equations import Book, DerivationError, Equation, book_later
from app.viewer.feature import Feature, Stage
from app.viewer.lessons.equations import page
from app.viewer.panel import assign, listen
from app.viewer.panel.status import Notice
from kin import InputError, fk
from kin.transforms import Array

INTERVAL = 0.05  # s between two updates of the numbers
# Vermillion and bluish green, darker by the gamma that the picture adds to lines.
PRINTED, TRUE = (170, 29, 0), (0, 87, 43)
_fresh = count()


class EquationsLesson(Feature):
    """One equation at a time, chosen from a list."""

    key = "equations"
    title = "Equations"
    about = "What the chapter prints, what is right, and by how much the tool is off otherwise."

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        gui = stage.client.gui
        self._book: Book | None = None
        self._future: Future[Book] | None = None
        self._wanted: object = None  # id of an equation to show as soon as there is a book
        self._largest = 0.0  # how far off the equation on show can be, in metres or radians
        self._equation: Equation | None = None
        self._T: Array = fk(stage.robot, stage.q)
        self._shown_at = 0.0
        self._about = gui.add_html("")
        self._choice = gui.add_dropdown(
            "Equation", ("…",), hint="Which entry of the tool's pose [n o a p] to look at"
        )
        listen(self._choice, self.post, "equation")
        # What moves comes first: it is to be seen while joints or the gizmo are dragged.
        self._values = gui.add_html("")
        self._button = gui.add_button(
            "Show where it is worst",
            hint="Moves the arm to the pose, inside its limits, where this misprint shows most",
            visible=False,
        )

        @self._button.on_click
        async def _(event: Any) -> None:
            if event.client is not None:
                self.post("worst")

        self._text = gui.add_html("")
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
                self._go_to_the_worst()
            case _:
                super().handle(key, value)

    def on_robot(self) -> None:
        robot = self.stage.robot
        self._T = fk(robot, self.stage.q)
        self._book = self._equation = None
        self._empty("Deriving the equations of this arm …")
        self._future = future = book_later(robot)
        if future.done():
            self._take()
        else:
            future.add_done_callback(lambda _: self.post("ready"))

    def on_picture(self, T_base_tool: Array) -> None:
        self._T = T_base_tool
        if time.perf_counter() - self._shown_at >= INTERVAL:
            self._show_values()
        else:
            self.due = INTERVAL

    def tick(self, now: float) -> None:
        if now - self._shown_at >= INTERVAL:
            self._show_values()

    def on_style(self) -> None:
        self._show_symbols()
        self._show_values()

    def state(self) -> dict[str, object]:
        return {"equation": self._equation.id} if self._equation is not None else {}

    def restore(self, state: dict[str, object]) -> None:
        wanted = state.get("equation")
        if self._book is None:
            self._wanted = wanted
            return
        for equation in self._book.equations:
            if equation.id == wanted:
                self._show(equation)

    def remove(self) -> None:
        self._clear_picture()
        for handle in (self._about, self._choice, self._text, self._values, self._button, self._folder):
            handle.remove()

    def _take(self) -> None:
        """The book has arrived, or the reason why there is none."""
        if self._future is None or not self._future.done() or self._book is not None:
            return  # of an arm no longer on show
        try:
            self._book = self._future.result()
        except DerivationError as error:
            self._empty(f"No equations: {error}.")
            self.stage.tell(Notice("error", "No equations for this arm", str(error)))
            return
        except Exception:
            self._empty("The equations of this arm could not be derived.")
            raise
        self._about.content = page.message(page.summary(self._book))
        self._choice.options = tuple(page.label(e) for e in self._book.equations)
        self._choice.visible = True
        self._show(self._first(self._book))
        self._wanted = None

    def _first(self, book: Book) -> Equation:
        """The one to begin with: the one asked for, else the first misprint, else the first that can be read."""
        readable = [e for e in book.equations if e.correct is not None]
        wanted = [e for e in book.equations if e.id == self._wanted]
        return next(iter([*wanted, *(e for e in readable if e.verdict == "misprinted"), *readable]))

    def _choose(self, value: object) -> None:
        if self._book is None:
            return
        known = {page.label(e): e for e in self._book.equations}
        if value not in known:
            if self._equation is not None:
                assign(self._choice, page.label(self._equation))
            raise InputError("equation", value, "one of " + ", ".join(known))
        self._show(known[str(value)])

    def _show(self, equation: Equation) -> None:
        assert self._book is not None
        self._equation = equation
        assign(self._choice, page.label(equation))
        self._text.content = page.equation_html(self._book, equation)
        self._button.visible = equation.verdict == "misprinted"
        self._folder.visible = equation.correct is not None
        self._show_symbols()
        self._largest = self._most(equation)
        self._clear_picture()
        self._show_values()

    def _most(self, equation: Equation) -> float:
        """How far off a misprinted equation is at its worst, in metres or radians."""
        assert self._book is not None
        if not equation.worst:
            return 0.0
        values = self._book.values(equation, np.array(equation.worst))
        return abs(float(values.difference)) if equation.is_length else float(values.turn)

    def _go_to_the_worst(self) -> None:
        if self._equation is None or not self._equation.worst:
            return
        equation = self._equation
        units = self.stage.units
        off = units.distance(self._largest) if equation.is_length else units.angle(self._largest)
        detail = f"As printed, {equation.entry} is off by {off} here."
        why = Notice("hand", f"Equation ({equation.number}) at its worst", detail)
        self.stage.go(np.array(equation.worst), why)

    def _show_symbols(self) -> None:
        if self._book is None or self._equation is None:
            return
        content = page.symbols_html(self._book.symbols_of(self._equation), self.stage.units)
        if self._symbols.content != content:
            self._symbols.content = content

    def _show_values(self) -> None:
        self.due = None
        self._shown_at = time.perf_counter()
        equation = self._equation
        if self._book is None or equation is None:
            return
        if equation.correct is None:
            self._values.content = (
                f'<div style="margin:.1em 1em .4em;font-size:.8em">{page.verdict_html(equation)}</div>'
            )
            return
        values = self._book.values(equation, self.stage.q, self._T)
        content = page.values_html(equation, values, self.stage.units, self._largest)
        if self._values.content != content:
            self._values.content = content
        if equation.verdict == "misprinted":
            self._draw(page.segments(equation, values, self._T, 0.2 * self.stage.robot.reach))

    def _draw(self, lines: Array) -> None:
        """The misprint as lines, its far end labelled."""
        scene = self.stage.client.scene
        if not self._nodes:
            root = f"/equations-{next(_fresh)}"
            colors = np.array([[PRINTED, PRINTED], [TRUE, TRUE]], np.uint8)[: len(lines)]
            self._segments = scene.add_line_segments(
                f"{root}-lines", lines.astype(np.float32), colors, thickness=4.0, thickness_units="screen"
            )
            self._label = scene.add_label(f"{root}-label", "as printed", position=tuple(lines[0, 1].tolist()))
            self._nodes = [self._segments, self._label]
            return
        self._segments.points = lines.astype(np.float32)
        self._label.position = tuple(lines[0, 1].tolist())

    def _clear_picture(self) -> None:
        for node in self._nodes:
            node.remove()
        self._nodes = []

    def _empty(self, message: str) -> None:
        """Nothing to choose from, but a sentence."""
        self._clear_picture()
        self._about.content = page.message(message)
        self._text.content = self._values.content = self._symbols.content = ""
        self._choice.visible = self._button.visible = self._folder.visible = False
