"""Robots by what one knows of them: ``kuka joints:7 reach:0.8..`` finds seven joints of one maker, 0.8 m and more.

A query is a list of words, and a robot is found if all of them fit. A plain word stands anywhere in its id, name,
maker or solver, in small or capital letters. A word with a colon asks for one thing: see `FIELDS`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from app.shared.solver_names import solver_names
from kin import InputError, Robot
from kin.files.numbers import NUMBER

FIELDS = {
    "joints": "joints:6, the number of moving joints, or a range of it such as joints:4..6",
    "reach": "reach:0.5..1.2, metres that the tool reaches at most; one end may be left out",
    "maker": "maker:fanuc, a part of the maker's name",
    "solver": "solver:wrist6, the family of closed forms, or numeric",
}
FORMS = "words such as kuka, joints:6, reach:0.5..1.2, maker:fanuc or solver:wrist6"
LONGEST = 200  # characters of a query
_END = re.compile(NUMBER)


def find_robots(robots: Iterable[Robot], query: str) -> list[Robot]:
    """Those of the robots that fit all words of a query, in their order.

    Raises:
        InputError: naming the word that cannot be read.
    """
    if len(query) > LONGEST:
        raise InputError("find", query, f"at most {LONGEST} characters")
    found = list(robots)
    for word in query.lower().split():
        name, colon, value = word.partition(":")
        if not colon:
            found = [robot for robot in found if word in _text(robot)]
        elif name in ("joints", "reach"):
            low, high = _range(word, value)
            found = [robot for robot in found if low <= (robot.n if name == "joints" else robot.reach) <= high]
        elif name == "maker" and value:
            found = [robot for robot in found if value in robot.maker.lower()]
        elif name == "solver" and value:
            found = [robot for robot in found if value in solver_names(robot).solver]
        else:
            raise InputError("find", word, FORMS)
    return found


def _text(robot: Robot) -> str:
    return f"{robot.id} {robot.name} {robot.maker} {solver_names(robot).solver}".lower()


def _range(word: str, text: str) -> tuple[float, float]:
    """The ends of ``2``, ``2..``, ``..3`` or ``2..3``."""
    low, dots, high = text.partition("..")
    if not (low or high) or any(end and not _END.fullmatch(end) for end in (low, high)):
        raise InputError("find", word, FORMS)
    first = float(low) if low else -math.inf
    if not dots:
        return first, first
    return first, float(high) if high else math.inf
