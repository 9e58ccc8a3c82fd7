"""What was typed into cells: an expression such as ``pi/2`` is shown as long as it is the value of its cell."""

from __future__ import annotations

import math
import re

from app.viewer.tabs.robot.edits import Cell
from kin.typed import LONGEST, ReadError, read
from kin.units import Unit

MOST = 64  # texts that are kept
IN_LINK = 800  # characters of all texts and their cells in a link; longer ones stay in the page
_PLAIN = re.compile(r"\s*[-+−]?[0-9]*[.,]?[0-9]*\s*")  # shown as any number is
_CELL = re.compile(r"([0-9]{1,2}|arm|tool|base|frame-[0-9]) ([a-z]{1,12})")


class Texts:
    """The texts of one page, by cell. The newest `MOST` are kept."""

    def __init__(self) -> None:
        self._texts: dict[Cell, str] = {}

    def remember(self, cell: Cell, text: str) -> None:
        """A valid text was typed."""
        self._texts.pop(cell, None)
        if cell[1] not in ("kind", "name", "mounting") and not _PLAIN.fullmatch(text):
            self._texts[cell] = text.strip()
        while len(self._texts) > MOST:
            del self._texts[next(iter(self._texts))]

    def shown(self, cell: Cell, value: float, unit: Unit) -> str | None:
        """What was typed, if that is the value (rad or m) of the cell; None: it is not, or nothing was typed."""
        text = self._texts.get(cell)
        if text is None:
            return None
        try:
            same = math.isclose(read(text, unit), value, rel_tol=1e-12, abs_tol=1e-12)
        except ReadError:
            return None
        return text if same else None

    def move_rows(self, action: str, index: int) -> None:
        """Rows were changed: ``"add"`` below row `index`, ``"remove"`` it, or move it ``"up"`` or ``"down"``."""
        other = index + {"up": -1, "down": 1}.get(action, 0)

        def place(row: int) -> int | None:
            if action == "add":
                return row + (row > index)
            if action == "remove":
                return None if row == index else row - (row > index)
            return {index: other, other: index}.get(row, row)

        moved: dict[Cell, str] = {}
        for (where, column), text in self._texts.items():
            to = place(where) if isinstance(where, int) else where
            if to is not None:
                moved[to, column] = text
        self._texts = moved

    def state(self) -> dict[str, str]:
        """The texts as JSON, for a link; those that make it too long are left out."""
        found: dict[str, str] = {}
        left = IN_LINK
        for (where, column), text in reversed(self._texts.items()):
            key = f"{where} {column}"
            left -= len(key) + len(text)
            if left < 0:
                break
            found[key] = text
        return dict(reversed(found.items()))

    def restore(self, state: object) -> None:
        """The texts of a link, as far as they can be texts of cells."""
        self._texts = {}
        for key, text in list(state.items())[:MOST] if isinstance(state, dict) else []:
            match = _CELL.fullmatch(key)
            if match is not None and isinstance(text, str) and len(text) <= LONGEST:
                self.remember((int(match[1]) if match[1].isdecimal() else match[1], match[2]), text)
