"""The status line: a headline and a sentence about the last request, marked by a symbol and a colour."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, replace
from typing import Literal

import viser
from markupsafe import Markup

from app.exports.worksheet.sheet import indexed
from app.shared.answers.inspection import singular_at
from app.viewer.panel import update_html
from app.viewer.panel.part import add_html
from app.viewer.panel.posture import short
from app.viewer.views.templates import render
from kin import IKResult, Robot
from kin.ik import IKSolution
from kin.ik.details import OrientationNotMet, OutOfReach, OutsideLimits, RollError, RotationError, Solved, Touching
from kin.units import Units, typeset

Kind = Literal[
    "reached", "compromise", "limits", "orientation", "unreachable", "hand", "advice", "error", "collision"
]
# s: news such as "Undone: Home" are shown this long, then again what is true now.
NEWS = 10.0
UNSEEN = 1.0  # s: news are shown at least this long, whatever else happens

# Symbol and CSS class of each kind. The symbol alone tells the kinds apart, too.
LOOKS: dict[Kind, tuple[str, str]] = {
    "reached": ("✓", "kb-green"),
    "compromise": ("≈", "kb-amber"),
    "limits": ("!", "kb-vermilion"),
    "orientation": ("∠", "kb-mauve"),
    "unreachable": ("✕", "kb-crimson"),
    "hand": ("↻", "kb-blue"),
    "advice": ("i", "kb-amber"),
    "error": ("?", "kb-violet"),
    "collision": ("⊗", "kb-crimson"),
}


@dataclass(frozen=True)
class Notice:
    """A message to the visitor: a headline and a sentence."""

    kind: Kind
    title: str
    detail: str = ""


READY = Notice("hand", "Ready", "Drag the coloured arrows at the tool, or move a joint slider.")

TOUCHES = "something touches"  # after "Ready, but"

BY_HAND = Notice("hand", "Joints moved by hand", "The target follows the tool.")

LOOKING = Notice("hand", "Ready", "You may look: drag the picture to turn the view, and scroll to come closer.")

WELL = (READY.title, "Reached")  # titles that promise that nothing is wrong


def notice(result: IKResult, units: Units) -> Notice:
    """The result for a target as a message."""
    explanation = result.explain(units)
    detail = explanation.detail
    if isinstance(result.details, OutsideLimits | Touching):
        detail = detail.replace(result.details.branch, short(result.details.branch))
    off = _farther_off(result, units)
    if off:
        detail += f" The posture shown is {off} off: a compromise between point and orientation."
    return Notice(_kind(result), explanation.title, detail)


_VISIBLE = 5e-4  # metres
_OUT_OF_REACH = {"too far": "too far", "too near": "too close"}


def key_number(result: IKResult, units: Units) -> str:
    """What is missing to the target, in a few words; empty if it is reached."""
    match result.details:
        case OutOfReach(distance) if distance > 0.0:
            off = _farther_off(result, units)
            return (
                f"{off} off"
                if off
                else f"{units.distance(distance)} {_OUT_OF_REACH.get(result.cause, 'out of reach')}"
            )
        case Touching(_, contact):
            return contact.text
        case RollError(_, error):
            return f"roll {units.angle(error)} off"
        case RotationError(_, error):
            return f"orientation {units.angle(error)} off"
        case OutsideLimits(_, (first, *_)):
            limit = units.of(first.kind == "revolute").text(first.limit)
            return f"joint {first.joint + 1}: {'locked at' if first.locked else 'limit'} {limit}"
        case OrientationNotMet() if result.closest is not None:
            return f"{_errors(result.closest, units)} off"
    return ""


def _farther_off(result: IKResult, units: Units) -> str:
    """The errors of the posture shown for a point out of reach, if the tool is farther from it than it need be."""
    shown = result.closest
    if not isinstance(result.details, OutOfReach) or shown is None:
        return ""
    return _errors(shown, units) if shown.position_error > result.details.distance + _VISIBLE else ""


def _errors(shown: IKSolution, units: Units) -> str:
    angle = units.angle(shown.rotation_error)
    return (
        f"{units.distance(shown.position_error)} and {angle}"
        if shown.position_error > _VISIBLE
        else f"orientation {angle}"
    )


def introduction(robot: Robot) -> Notice:
    """A robot's name, the first sentence of its description, and where it is singular of home and zero."""
    first = re.split(r"(?<=[.!?]) ", robot.description, maxsplit=1)[0]
    return Notice("hand", robot.name, f"{first} {singular_at(robot)}".strip())


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
        case Touching():
            return "collision"
    return "unreachable"


def html(shown: Notice, warning: str = "", failure: str = "", offer: str = "") -> str:
    """The notice as a card, with what is added to it. ``static/layout.css`` places it over the scene.

    A notice that all is well is no longer blue or green beside a warning or a failure, and the card says both.
    """
    symbol, color = LOOKS[shown.kind]
    if (warning or failure) and shown.kind in ("hand", "reached"):
        symbol, color = ("!", "kb-amber") if shown.kind == "hand" else (symbol, "kb-amber")
        if shown.title in WELL:
            shown = replace(shown, title=f"{shown.title}, but {TOUCHES if warning else failure}")
    if shown.kind != "error":  # which says what was typed
        shown = replace(shown, title=indexed(typeset(shown.title)), detail=indexed(typeset(shown.detail)))
    return render(
        "panel/status",
        notice=shown,
        warning=typeset(warning),
        symbol=symbol,
        color=color,
        offer=Markup(offer),
    )


class StatusLine:
    """Shows one notice at a time, and with it a warning about the configuration of the arm.

    A notice is news until the visitor does something else; one without advice ends by itself, too.

    Args:
        first: the notice with which it begins.

    Attributes:
        ready: what is shown where nothing else is to be said.
        count: how many notices were shown.
    """

    def __init__(self, gui: viser.GuiApi, first: Notice, ready: Notice = READY) -> None:
        self.ready = ready
        self.count = 0
        self._result: IKResult | None = None
        self._said: tuple[object, ...] | None = None  # what `_words` say; None: something that is not said again
        self._words: Notice
        self._news_since: float | None = None
        self._over = False  # the visitor did something else, before the notice could be seen
        self._shown = first
        self._warning = self._failure = self._offer = ""
        self._cover: Notice | None = None
        self._html = add_html(gui, html(first))

    @property
    def shows_result(self) -> bool:
        """Whether the notice is the result for a target."""
        return self._result is not None

    def show(self, shown: Notice) -> None:
        """Replace the notice."""
        self.count += 1
        self._result = None
        self._over = False
        self._news_since = time.perf_counter()
        if shown is not self._shown and shown != self._shown:
            self._shown = shown
            self._write()

    def warn(self, warning: str) -> None:
        """Show a sentence after every notice until the next call; an empty one ends it."""
        if warning != self._warning:
            self._warning = warning
            self._write()

    def fail(self, failure: str) -> None:
        """Say what has failed and stands, beside a notice that all is well, until the next call; "" ends it."""
        if failure != self._failure:
            self._failure = failure
            self._write()

    def offer(self, offer: str) -> None:
        """Show HTML of what can be done below every notice, until the next call; "" ends it."""
        if offer != self._offer:
            self._offer = offer
            self._write()

    def cover(self, shown: Notice | None) -> None:
        """Show this instead of everything else, which goes on below it, until the next call; None ends it."""
        self._cover = shown
        self._write()

    def _write(self) -> None:
        if self._cover is not None:
            update_html(self._html, html(self._cover))
            return
        update_html(self._html, html(self._shown, self._warning, self._failure, self._offer))

    def show_result(self, result: IKResult, units: Units) -> None:
        """Show the result for a target."""
        # While a target is dragged, one result is usually said in the words of the one before.
        plain = isinstance(result.details, Solved) and not (result.singularities or result.target_error)
        said = (result.details, result.cause, result.task, units) if plain else None
        if said is None or said != self._said:
            self._said, self._words = said, notice(result, units)
        self.show(self._words)
        self._result, self._news_since = result, None

    def due(self, now: float) -> float | None:
        """Seconds until the notice is no longer news; None: it does not end by itself."""
        if self._news_since is None or not (self._over or self._shown.kind in ("hand", "reached")):
            return None
        return max(0.0, self._news_since + (UNSEEN if self._over else NEWS) - now)

    def settle(self, result: IKResult | None, units: Units) -> None:
        """End the news: show the result for the open target, or that the arm is ready if there is none.

        News that could not be seen yet end as soon as they could: see `due`.
        """
        if self._news_since is None:
            return
        if time.perf_counter() - self._news_since < UNSEEN:
            self._over = True
            return
        self._news_since = None
        if result is None:
            self.show(self.ready)
        else:
            self.show_result(result, units)
        self._news_since = None

    def use(self, units: Units) -> None:
        """Show a result in these units if it is still there. Other notices stay as they are."""
        if self._result is not None:
            self.show_result(self._result, units)
