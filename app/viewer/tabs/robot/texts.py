"""What was typed into cells: an expression such as ``pi/2`` is shown as long as it is the value of its cell."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from app.viewer.tabs.robot.edits import Cell
from kin.typed import LONGEST, ReadError, read
from kin.units import Unit

MOST = 64  # texts that are kept
IN_LINK = 800  # characters of all texts and their cells in a link; longer ones stay in the page
_PLAIN = re.compile(r"\s*[-+−]?[0-9]*[.,]?[0-9]*\s*")  # shown as any number is
_CELL = re.compile(r"([0-9]{1,2}|arm|tool|base|frame-[0-9]) ([a-z]{1,12})")


@dataclass(frozen=True)
class Texts:
    """The texts of one page.

    Attributes:
        typed: the newest `MOST` expressions, by cell.
        wrong: what was typed into cells and is not valid, and what is wrong with it.
    """

    typed: Mapping[Cell, str] = field(default_factory=dict)
    wrong: Mapping[Cell, tuple[str, str]] = field(default_factory=dict)

    @classmethod
    def of(cls, state: object) -> Texts:
        """The texts of a link, as far as they can be texts of cells."""
        found = cls()
        for key, text in list(state.items())[:MOST] if isinstance(state, dict) else []:
            match = _CELL.fullmatch(key)
            if match is not None and isinstance(text, str) and len(text) <= LONGEST:
                found = found.taken({(int(match[1]) if match[1].isdecimal() else match[1], match[2]): text})
        return found

    def taken(self, texts: Mapping[Cell, str]) -> Texts:
        """With these, which are valid."""
        typed = {cell: text for cell, text in self.typed.items() if cell not in texts}
        for cell, text in texts.items():
            if cell[1] not in ("kind", "name", "mounting") and not _PLAIN.fullmatch(text):
                typed[cell] = text.strip()
        wrong = {cell: why for cell, why in self.wrong.items() if cell not in texts}
        return Texts(dict([*typed.items()][-MOST:]), wrong)

    def refused(self, cell: Cell, text: str, why: str) -> Texts:
        """With one that is not valid."""
        others = {other: said for other, said in self.wrong.items() if other != cell}
        return replace(self, wrong={**others, cell: (text, why)})

    def valid(self, among: Callable[[Cell], bool] = lambda _: True) -> Texts:
        """Without those, among these cells, that are not valid."""
        return replace(self, wrong={cell: said for cell, said in self.wrong.items() if not among(cell)})

    def moved(self, action: str, index: int) -> Texts:
        """The valid ones when rows change.

        Args:
            action: ``"add"`` a row below row `index`, ``"remove"`` it, or move it ``"up"`` or ``"down"``.
        """
        other = index + {"up": -1, "down": 1}.get(action, 0)

        def place(row: int) -> int | None:
            if action == "add":
                return row + (row > index)
            if action == "remove":
                return None if row == index else row - (row > index)
            return {index: other, other: index}.get(row, row)

        moved: dict[Cell, str] = {}
        for (where, column), text in self.typed.items():
            to = place(where) if isinstance(where, int) else where
            if to is not None:
                moved[to, column] = text
        return Texts(moved)

    def shown(self, cell: Cell, value: float, unit: Unit) -> str | None:
        """What was typed, if that is the value (rad or m) of the cell; None: it is not, or nothing was typed."""
        text = self.typed.get(cell)
        if text is None:
            return None
        try:
            same = math.isclose(read(text, unit), value, rel_tol=1e-12, abs_tol=1e-12)
        except ReadError:
            return None
        return text if same else None

    def state(self) -> dict[str, str]:
        """The texts as JSON, for a link; those that make it too long are left out."""
        found: dict[str, str] = {}
        left = IN_LINK
        for (where, column), text in reversed([*self.typed.items()]):
            key = f"{where} {column}"
            left -= len(key) + len(text)
            if left < 0:
                break
            found[key] = text
        return dict(reversed(found.items()))
