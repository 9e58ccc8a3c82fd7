"""What a program announces in its page: its state, a sentence about it, and buttons that the visitor may press."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

State = Literal["ready", "enabled", "stopped", "fault"]


@dataclass(frozen=True)
class Button:
    """What the visitor can ask of a program.

    Attributes:
        name: which the program hears when it is pressed.
        label: as the page shows it.
        confirm: what happens then; the page asks with this sentence before it passes the press on. "": at once.
        stops: whether it stops something: nothing in the page may keep the visitor from pressing it.
    """

    name: str
    label: str
    confirm: str = ""
    stops: bool = False

    @property
    def event(self) -> str:
        """The event of the page that presses it; one that comes in another way is not passed on."""
        return "halt" if self.stops else "confirm" if self.confirm else "press"


@dataclass(frozen=True, eq=False)
class Announcement:
    """See the module; each one is another."""

    words: str
    state: State = "ready"
    buttons: tuple[Button, ...] = ()

    def button(self, name: str) -> Button | None:
        """The button with this name."""
        return next((each for each in self.buttons if each.name == name), None)

    @property
    def stop(self) -> Button | None:
        """The first button that stops something."""
        return next((each for each in self.buttons if each.stops), None)
