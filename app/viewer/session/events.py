"""The rules of all events of a page: one row for each, whatever posts it.

The key of an event begins with its name; the rest says which control it comes from. A message of the page's own
script has the key ``("message", name, number)``. What a feature does with its own events is its own affair: here
they are all ``"feature"`` or, if nobody has pressed anything, ``"news"``.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Final

# s: further changes by the same control within this time belong to the same step. The page reports when a slider
# is released or a cell is left; the longer time is for a report that was lost.
SHORT_PAUSE: Final = 1.0
LONG_PAUSE: Final = 20.0
FENCE: Final = "fence"  # event of an answer of the page


@dataclass(frozen=True)
class Rule:
    """What is true of all events of one name.

    Attributes:
        label: what undo calls the change. Empty: the event says it, as a joint or a feature does.
        step: whether undo returns to the state before the event. False: it changes nothing that undo restores.
        gradual: how long (s) a control that sends many values may pause within one step.
        message: whether the page's own script may send it.
        answered: whether its handler replies to that message.
        act: whether it moves the arm or opens something, which ends a lead and is refused in a class that is
            frozen. Of a feature's events only messages count: features also post what they have computed.
    """

    label: str = ""
    step: bool = True
    gradual: float = 0.0
    message: bool = False
    answered: bool = False
    act: bool = False


RULES: Final[dict[str, Rule]] = {
    # The arm
    "gizmo": Rule("Drag of the target", gradual=math.inf, act=True),
    "grab": Rule(step=False, act=True),
    "joint": Rule(gradual=LONG_PAUSE, act=True),
    "redundancy": Rule("Redundancy", gradual=LONG_PAUSE, act=True),
    "lock": Rule("Lock", act=True),
    "branch": Rule("Posture", act=True),
    "robot": Rule("Robot", act=True),
    "find": Rule(step=False),
    "task": Rule("Target must match", act=True),
    "home": Rule("Home", act=True),
    "random": Rule("Random", act=True),
    "recall": Rule("Move target to tool", act=True),
    "shown": Rule(step=False),
    "live": Rule("Connected program", gradual=LONG_PAUSE, act=True),
    "drawn": Rule(step=False),
    # Typed, and keys
    "field": Rule("Typed value", message=True, answered=True, act=True),
    "target": Rule("Typed target", message=True, answered=True, act=True),
    "nudge": Rule("Target moved by keys", gradual=SHORT_PAUSE, message=True, act=True),
    "jog": Rule("Jog", gradual=LONG_PAUSE, message=True, act=True),
    "snap": Rule(step=False, message=True),
    "released": Rule(step=False, message=True),
    # The looks of the page, and the camera
    "view": Rule("View"),  # some of its controls say more
    "axes": Rule("Arrows along", message=True),
    "frame": Rule("Frame of the read-out", message=True),
    "gripper": Rule(step=False, act=True),
    "text-size": Rule(step=False, message=True),
    "system-dark": Rule(step=False, message=True),
    "body": Rule(step=False),
    "copy-as": Rule(step=False),
    "camera": Rule(step=False),
    "fit-arm": Rule(step=False, message=True),
    "look-from": Rule(step=False, message=True),
    "looked": Rule(step=False),
    "resized": Rule(step=False),
    # What is open, and the history
    "lesson": Rule("Lesson", message=True, act=True),
    "feature": Rule(message=True, act=True),
    "news": Rule(step=False),
    "undo": Rule(step=False, message=True, act=True),
    "redo": Rule(step=False, message=True, act=True),
    "travel": Rule(step=False, message=True, act=True),
    FENCE: Rule(step=False),
}
MESSAGES: Final = tuple(name for name, rule in RULES.items() if rule.message)


def name_of(key: Hashable) -> str:
    """The name of the event with this key, which may be that of a message."""
    parts = key if isinstance(key, tuple) else (key,)
    return str(parts[1] if parts[0] == "message" and len(parts) > 1 else parts[0])


def pause_within(gesture: tuple[object, ...], value: object) -> float:
    """Seconds that may pass between two events of a control that belong to one step.

    Drags and typing in a feature are one step each; a choice or a button is always one of its own. Typing into a
    cell ends when the visitor leaves the cell, which the page reports. A drag of a gizmo goes on, however long it
    rests; the next one is another control.
    """
    if gesture[0] != "feature":
        return RULES[str(gesture[0])].gradual
    key = gesture[2]
    if isinstance(key, tuple) and key[:1] == ("drag",):
        return math.inf
    if isinstance(key, tuple) and key and key[0] == "cell":
        return LONG_PAUSE if key[-1] != "kind" else 0.0
    return SHORT_PAUSE if isinstance(value, int | float | tuple) and not isinstance(value, bool) else 0.0


def belongs_before(gesture: tuple[object, ...]) -> bool:
    """Whether an event of a feature only completes an earlier one, as meshes do that have been read, or equations
    that have been derived."""
    key = gesture[2] if gesture[0] == "feature" else None
    return isinstance(key, tuple) and key[:1] in (("meshes",), ("done",))
