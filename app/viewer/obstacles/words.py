"""What an arm touches, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from kin.collision import Contact
from kin.units import Units

NAMED = 2  # obstacles, and the arm itself, that the sentence names


def sentence(contacts: Sequence[Contact], units: Units) -> str:
    """``"Link 4 touches the table, 12 mm deep."``; "" for none.

    Several links may touch each other or one obstacle. Only the deepest contact of each is named.
    """
    if not contacts:
        return ""
    deepest: dict[int | None, Contact] = {}
    for each in contacts:
        deepest.setdefault(each.obstacle, each)
    first = list(deepest.values())[:NAMED]
    named = "; ".join(f"{each.text}, {_depth(each, units)} deep" for each in first)
    rest = "" if len(contacts) <= len(first) else f", and {len(contacts) - len(first)} more"
    return f"{named[0].upper()}{named[1:]}{rest}."


def _depth(contact: Contact, units: Units) -> str:
    """How deep; at least that, where the axis of the link is inside and the way out is not known."""
    return f"{'at least ' * contact.axis_inside}{units.distance(-contact.distance)}"
