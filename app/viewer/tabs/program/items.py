"""The list of a program: waypoints and pauses, in order. Pure.

A waypoint is the configuration in which it was recorded; its kind says how the arm comes to it. The first waypoint
is where the program starts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from kin.transforms import Array

Kind = Literal["ptp", "lin", "circ", "spline", "pause"]
Point = tuple[float, float, float]
MOST = 40  # items of a program; a link holds some 8000 bytes of all programs
NAME = 40  # characters
DIGITS = 7  # of a recorded joint value
PAUSE = 1.0  # s, of a new pause
SLOWEST = 0.01  # part of the limits
LEAST = 1e-9  # m/s or rad/s: limits of the tool
LARGEST = 1e6  # rad or m


@dataclass(frozen=True, slots=True)
class Item:
    """A waypoint or a pause.

    Attributes:
        kind: how the arm comes to the waypoint; ``"pause"``: it waits. Neighbours of the kind ``"spline"`` are
            points of one curve, which has the speed and the zone of the last of them.
        q: the configuration of a waypoint; empty for a pause.
        speed, acceleration: parts of the joints' limits that may be used, 0.01 to 1.
        seconds: of a pause.
        name: given by the visitor.
        blend: radius of the zone (m) in which the path may leave for the next waypoint; 0: the arm stops.
        tool_speed, tool_turn: largest speed of the tool point (m/s) and of its rotation (rad/s); None: no limit.
        via: a point (m) of the arc, for the kind ``"circ"``.
    """

    kind: Kind
    q: tuple[float, ...] = ()
    speed: float = 1.0
    seconds: float = 0.0
    name: str = ""
    acceleration: float = 1.0
    blend: float = 0.0
    tool_speed: float | None = None
    tool_turn: float | None = None
    via: Point | None = None


Items = tuple[Item, ...]


def waypoint(q: Array, digits: int = DIGITS) -> Item:
    """A waypoint at a configuration ``(n,)``, rounded as in a link."""
    return Item("ptp", configuration(q, digits))


def configuration(q: Array, digits: int = DIGITS) -> tuple[float, ...]:
    """Joint values ``(n,)`` rounded as in a link."""
    return tuple(round(value, digits) + 0.0 for value in q.tolist())


def point(values: Array) -> Point:
    """A point ``(3,)`` (m) rounded as in a link."""
    x, y, z = (round(value, DIGITS) + 0.0 for value in values.tolist())
    return x, y, z


def counted(items: Items) -> str:
    """How many waypoints and pauses there are, as a sentence."""
    pauses = sum(item.kind == "pause" for item in items)
    count = len(items) - pauses
    words = f"{count} waypoint{'s' * (count != 1)}"
    return f"{words} and {pauses} pause{'s' * (pauses != 1)}." if pauses else f"{words}."


def start_of(items: Items) -> Item | None:
    """The first waypoint; None: there is none."""
    return next((item for item in items if item.q), None)


def passed_through(items: Items, index: int) -> bool:
    """Whether an item is an inner point of a spline: the next item belongs to the same curve."""
    after = items[index + 1 : index + 2]
    return items[index].kind == "spline" and items[index] is not start_of(items) and _is_spline(after)


def _is_spline(items: Items) -> bool:
    return bool(items) and items[0].kind == "spline"


def changed(items: Items, index: int, **values: Any) -> Items:
    """The list with another value of one item."""
    return (*items[:index], replace(items[index], **values), *items[index + 1 :])


def inserted(items: Items, index: int, item: Item) -> Items:
    """The list with one more item at `index`."""
    return (*items[:index], item, *items[index:])


def removed(items: Items, index: int) -> Items:
    """The list without one item."""
    return items[:index] + items[index + 1 :]


def moved(items: Items, index: int, to: int) -> Items:
    """The list with one item elsewhere."""
    return inserted(removed(items, index), to, items[index])
