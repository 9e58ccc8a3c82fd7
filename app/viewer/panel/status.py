"""The status line: one sentence about the last request, told by words, a symbol and a colour together."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import Literal

import viser

from kin import IKResult
from kin.units import Units

Kind = Literal["reached", "compromise", "limits", "orientation", "unreachable", "hand", "error"]

# Symbol and colour of each kind; the colours are Okabe and Ito's, and the symbol alone tells them apart too.
LOOKS: dict[Kind, tuple[str, str]] = {
    "reached": ("✓", "#009e73"),
    "compromise": ("≈", "#b87a00"),
    "limits": ("!", "#d55e00"),
    "orientation": ("∠", "#a8518a"),
    "unreachable": ("✕", "#c2185b"),
    "hand": ("↻", "#0072b2"),
    "error": ("?", "#6b4c9a"),
}


def ink(color: str) -> str:
    """A colour for text: nearer to the page's own, so that it can be read on a light page and on a dark one."""
    return f"color-mix(in srgb, {color} 60%, currentColor)"


@dataclass(frozen=True)
class Notice:
    """What the visitor is told: a headline and a sentence."""

    kind: Kind
    title: str
    detail: str = ""


def notice(result: IKResult, units: Units) -> Notice:
    """The answer to a target, in words for people."""
    kind, title = _headline(result, units)
    return Notice(kind, title, _without_repeating(title, units.retold(result.reason)))


def _headline(result: IKResult, units: Units) -> tuple[Kind, str]:
    if result.status == "solved":
        return "reached", "Reached"
    if result.status == "approximate":
        best = result.best
        error = best.rotation_error if best is not None else 0.0
        name = "roll" if best is not None and best.compromise == "roll" else "rotation"
        return "compromise", f"Reached with {name} error {units.angle(error)}"
    if result.status == "limits":
        numbers = [str(v.joint + 1) for v in result.violations]
        which = "joint " + numbers[0] if len(numbers) == 1 else "joints " + ", ".join(numbers)
        return "limits", f"Out of limits: {which}" if numbers else "Out of limits"
    if result.status == "orientation":
        return "orientation", "Orientation not attainable here"
    if result.cause == "branch":
        return "unreachable", "No solution on the chosen branch"
    return "unreachable", f"Out of reach by {units.distance(result.distance)}"


def _without_repeating(title: str, reason: str) -> str:
    """The reason without its opening words when the headline has just said them."""
    opening, colon, rest = reason.partition(": ")
    if colon and opening.split()[0] == title.split()[0]:
        return rest[:1].upper() + rest[1:]
    return reason


def html(shown: Notice) -> str:
    """The notice as a block whose height does not depend on its text, so that nothing below it jumps."""
    symbol, color = LOOKS[shown.kind]
    return (
        f'<div role="status" aria-live="polite" data-status="{shown.kind}" style="display:flex;gap:.6em;'
        f"margin:.15em 1em .35em;padding:.5em .65em;min-height:6.1em;box-sizing:border-box;"
        f"border-radius:.4em;font-size:.85em;line-height:1.3;background:{color}1f;"
        f'border-left:.28em solid {color}">'
        f'<span aria-hidden="true" style="flex:none;width:1.5em;height:1.5em;line-height:1.5em;border-radius:50%;'
        f'text-align:center;font-weight:700;color:#fff;background:{color}">{symbol}</span>'
        f'<span style="min-width:0"><b style="display:block;line-height:1.5">{escape(shown.title)}</b>'
        f'<span title="{escape(shown.detail, quote=True)}" style="display:-webkit-box;-webkit-line-clamp:3;'
        f'-webkit-box-orient:vertical;overflow:hidden;font-size:.92em;opacity:.85">{escape(shown.detail)}</span>'
        "</span></div>"
    )


class StatusLine:
    """Shows one notice at a time."""

    def __init__(self, gui: viser.GuiApi, first: Notice) -> None:
        self._answer: IKResult | None = None
        self._shown = first
        self._html = gui.add_html(html(first))

    def show(self, shown: Notice) -> None:
        """Replace the notice."""
        self._answer = None
        if shown != self._shown:
            self._shown = shown
            self._html.content = html(shown)

    def answer(self, result: IKResult, units: Units) -> None:
        """Tell the answer to a target."""
        self.show(notice(result, units))
        self._answer = result

    def use(self, units: Units) -> None:
        """Tell an answer that is still on show in these units. Anything else stays as it was told."""
        if self._answer is not None:
            self.answer(self._answer, units)
