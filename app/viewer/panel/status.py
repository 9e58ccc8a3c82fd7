"""The status line: a headline and a sentence about the last request, marked by a symbol and a colour."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Literal

import viser

from app.viewer.views.templates import render
from kin import IKResult, Robot
from kin.ik.details import OrientationNotMet, OutOfReach, OutsideLimits, RollError, RotationError, Solved
from kin.units import Units

Kind = Literal["reached", "compromise", "limits", "orientation", "unreachable", "hand", "error"]

# Symbol and CSS class of each kind. The symbol alone tells the kinds apart, too.
LOOKS: dict[Kind, tuple[str, str]] = {
    "reached": ("✓", "kb-green"),
    "compromise": ("≈", "kb-amber"),
    "limits": ("!", "kb-vermilion"),
    "orientation": ("∠", "kb-mauve"),
    "unreachable": ("✕", "kb-crimson"),
    "hand": ("↻", "kb-blue"),
    "error": ("?", "kb-violet"),
}


@dataclass(frozen=True)
class Notice:
    """A message to the visitor: a headline and a sentence."""

    kind: Kind
    title: str
    detail: str = ""


def notice(result: IKResult, units: Units) -> Notice:
    """The result for a target as a message."""
    explanation = result.explain(units)
    return Notice(_kind(result), explanation.title, explanation.detail)


_OUT_OF_REACH = {"too far": "too far", "too near": "too close"}


def key_number(result: IKResult, units: Units) -> str:
    """What is missing to the target, in a few words; empty if it is reached."""
    match result.details:
        case OutOfReach(distance) if distance > 0.0:
            return f"{units.distance(distance)} {_OUT_OF_REACH.get(result.cause, 'out of reach')}"
        case RollError(_, error):
            return f"roll {units.angle(error)} off"
        case RotationError(_, error):
            return f"orientation {units.angle(error)} off"
        case OutsideLimits(_, (first, *_)):
            limit = units.of(first.kind == "revolute").text(first.limit)
            return f"joint {first.joint + 1}: {'locked at' if first.locked else 'limit'} {limit}"
        case OrientationNotMet(nearest_rotation=angle) if angle is not None:
            return f"orientation {units.angle(angle)} off"
    return ""


def introduction(robot: Robot) -> Notice:
    """A robot's name and the first sentence of its description."""
    return Notice("hand", robot.name, re.split(r"(?<=[.!?]) ", robot.description, maxsplit=1)[0])


def _kind(result: IKResult) -> Kind:
    match result.details:
        case Solved():
            return "reached"
        case RollError() | RotationError():
            return "compromise"
        case OutsideLimits():
            return "limits"
        case OrientationNotMet():
            return "orientation"
    return "unreachable"


def html(shown: Notice) -> str:
    """The notice as a card, which ``static/layout.css`` places over the scene."""
    symbol, color = LOOKS[shown.kind]
    return render("panel/status", notice=shown, symbol=symbol, color=color)


class StatusLine:
    """Shows one notice at a time, and with it a warning about the configuration of the arm."""

    def __init__(self, gui: viser.GuiApi, first: Notice) -> None:
        self._result: IKResult | None = None
        self._shown = first
        self._warning = ""
        self._html = gui.add_html(html(first))

    def show(self, shown: Notice) -> None:
        """Replace the notice."""
        self._result = None
        if shown != self._shown:
            self._shown = shown
            self._write()

    def warn(self, warning: str) -> None:
        """Show a sentence after every notice until the next call; an empty one ends it."""
        if warning != self._warning:
            self._warning = warning
            self._write()

    def _write(self) -> None:
        shown = self._shown
        if self._warning:
            shown = replace(shown, detail=f"{shown.detail} \N{WARNING SIGN} {self._warning}".lstrip())
        self._html.content = html(shown)

    def show_result(self, result: IKResult, units: Units) -> None:
        """Show the result for a target."""
        self.show(notice(result, units))
        self._result = result

    def use(self, units: Units) -> None:
        """Show a result in these units if it is still there. Other notices stay as they are."""
        if self._result is not None:
            self.show_result(self._result, units)
