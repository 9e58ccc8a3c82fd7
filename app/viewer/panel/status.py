"""The status line: one sentence about the last request, told by words, a symbol and a colour together."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import Literal

import viser

from kin import IKResult
from kin.ik.details import OrientationNotMet, OutOfReach, OutsideLimits, RollError, RotationError, Solved
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
    explanation = result.explain(units)
    kind, title = _headline(result, explanation.headline, units)
    return Notice(kind, title, explanation.detail)


def _headline(result: IKResult, headline: str, units: Units) -> tuple[Kind, str]:
    """The kind of notice and its title: `headline`, or a shorter one with rounded numbers."""
    match result.details:
        case Solved():
            return "reached", headline
        case RollError(_, error):
            return "compromise", f"Reached with roll error {units.angle(error)}"
        case RotationError(_, error):
            return "compromise", f"Point reached, orientation off by {units.angle(error)}"
        case OutsideLimits(_, violations):
            numbers = ", ".join(str(v.joint + 1) for v in violations)
            return "limits", f"{headline}: joint{'s' if len(violations) > 1 else ''} {numbers}"
        case OrientationNotMet():
            return "orientation", "Orientation not possible here"
        case OutOfReach(distance) if distance > 0.0:
            return "unreachable", f"Out of reach by {units.distance(distance)}"
    return "unreachable", headline


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
