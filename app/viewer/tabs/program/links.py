"""The list of a program as JSON in the page's link, which anybody may have written."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

from app.viewer.own_arm import clean
from app.viewer.tabs.program.items import LARGEST, LEAST, MOST, NAME, SLOWEST, Item, Items, Kind
from kin import Robot
from kin.motion.program import LONGEST_DWELL

LETTERS: dict[Kind, str] = {"ptp": "p", "lin": "l", "circ": "c", "spline": "s", "pause": "w"}
_KINDS: dict[str, Kind] = {letter: kind for kind, letter in LETTERS.items()}
# What is not usual in a waypoint: key in a link, field, smallest and largest value.
_MORE = (
    ("a", "acceleration", SLOWEST, 1.0),
    ("b", "blend", 0.0, LARGEST),
    ("v", "tool_speed", LEAST, LARGEST),
    ("t", "tool_turn", LEAST, LARGEST),
)


def pack(items: Items) -> list[list[object]]:
    """The list as JSON for a link: kind, values, then what is not usual."""
    return [_row(item) for item in items]


def _row(item: Item) -> list[object]:
    if item.kind == "pause":
        return [LETTERS[item.kind], item.seconds, item.name] if item.name else [LETTERS[item.kind], item.seconds]
    usual = Item("ptp")
    more = {key: getattr(item, field) for key, field, *_ in _MORE if getattr(item, field) != getattr(usual, field)}
    if item.via is not None:
        more["o"] = list(item.via)
    row: list[object] = [LETTERS[item.kind], list(item.q), item.name, item.speed, more]
    usual_values: tuple[object, ...] = ({}, 1.0, "")
    for usual_value in usual_values:
        if row[-1] != usual_value:
            break
        row.pop()
    return row


def unpack(value: object, robot: Robot) -> Items | None:
    """The list of a link; None: it is none for this arm."""
    if not isinstance(value, list) or not 1 <= len(value) <= MOST:
        return None
    items = tuple(_item(row, robot) for row in value)
    return None if None in items else items  # type: ignore[return-value]


def _item(row: object, robot: Robot) -> Item | None:
    match row:
        case ["w", seconds]:
            return _pause(seconds, "")
        case ["w", seconds, str(name)]:
            return _pause(seconds, name)
        case [("p" | "l" | "c" | "s") as letter, list(q), *rest] if len(rest) <= 3:
            usual: tuple[object, ...] = ("", 1.0, {})
            given, share, more = (*rest, *usual[len(rest) :])
            if isinstance(given, str) and isinstance(more, dict):
                found = _waypoint(q, given, share, robot)
                return None if found is None else _with(replace(found, kind=_KINDS[letter]), more)
    return None


def _pause(seconds: object, name: str) -> Item | None:
    value = _number(seconds, 0.0, LONGEST_DWELL)
    return None if value is None else Item("pause", seconds=value, name=clean(name, NAME))


def _waypoint(q: list[object], name: str, speed: object, robot: Robot) -> Item | None:
    values = [_number(value, -LARGEST, LARGEST) for value in q]
    share = _number(speed, SLOWEST, 1.0)
    if len(q) != robot.n or None in values or share is None:
        return None
    return Item("ptp", tuple(value for value in values if value is not None), share, name=clean(name, NAME))


def _with(item: Item, more: dict[str, object]) -> Item | None:
    """The waypoint with what is not usual in it."""
    known = {key: (field, low, high) for key, field, low, high in _MORE}
    for key, given in more.items():
        if key == "o":
            via = [_number(value, -LARGEST, LARGEST) for value in given] if isinstance(given, list) else []
            match via:
                case [float(x), float(y), float(z)]:
                    item = replace(item, via=(x, y, z))
                case _:
                    return None
        elif key in known:
            field, low, high = known[key]
            number = _number(given, low, high)
            if number is None:
                return None
            item = replace(item, **{field: number})  # type: ignore[arg-type]
        else:
            return None
    return None if item.kind == "circ" and item.via is None else item


def _number(value: object, low: float, high: float) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool) or not low <= value <= high:
        return None
    return float(value)


assert set(LETTERS) == set(get_args(Kind))
