"""The command palette of viser (Ctrl+K): tabs, lessons, exercises, arms, views, actions and exports by typing.

The list is made of the registries that the panel shows, and follows them: own arms and exercises come and go. A
command posts the events that the controls post, so that undo, rooms, what is withheld and the limits of a class
treat it as these; it opens the tab where its effect is.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass

import viser

from app.exercises import Exercise
from app.viewer.exercises.feature import Practising
from app.viewer.feature import Feature
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel import Post
from app.viewer.panel.layout import LEARN, MOVE, VIEW
from app.viewer.scene.viewpoints import SIDES
from app.viewer.session.channel.channel import Channel
from app.viewer.session.lessons import choices

# Of the page as a whole: event, words, and its key as `static/viewer.html` has it.
ACTIONS = (
    ("home", "Home configuration", ""),
    ("random", "Random configuration", ""),
    ("recall", "Move target to tool", ""),
    ("undo", "Undo", "Ctrl+Z"),
    ("redo", "Redo", "Ctrl+Shift+Z"),
    ("axes", "Arrows along: tool or base", "G"),
    ("fit-arm", "Fit the view", ""),
)


@dataclass(frozen=True)
class Command:
    """A row of the palette.

    Attributes:
        label: its words.
        about: more of them, which are found by typing too, and a key.
        events: what is posted, keys and values.
        tab: which is opened; "": none.
    """

    label: str
    about: str = ""
    events: tuple[tuple[Hashable, object], ...] = ()
    tab: str = ""


def commands(
    tabs: Sequence[type[Feature]], features: Sequence[Feature], arms: Sequence[str], exercises: Sequence[Exercise]
) -> Iterator[Command]:
    """All commands of a page.

    Args:
        tabs: its tabs between the arm's controls and the view's.
        features: on show.
        arms: names in the menu of robots.
        exercises: of the page.
    """
    titles = {tab.key: tab.title for tab in tabs}
    yield from (Command(title, "Tab", tab=title) for title in (MOVE, LEARN, *titles.values(), VIEW))
    for choice in choices():
        label = f"Lesson: {choice.title}" if issubclass(choice, Lesson) else choice.title
        yield Command(label, choice.about, (("lesson", choice.title),), LEARN)
    for each in exercises:
        begin = _pressed(Practising.key, ("open", each.id, 0), None)
        yield Command(f"Exercise: {each.title}", each.topic, (begin,), LEARN)
    yield from (Command(f"Arm: {name}", "", (("robot", name),)) for name in arms)
    yield from (Command(f"Look from: {side}", "View", ((("look-from", side), None),)) for side in SIDES)
    yield from (Command(label, key, ((event, None),)) for event, label, key in ACTIONS)
    for feature in features:
        for label, key, value in feature.commands():
            yield Command(label, feature.title, (_pressed(feature.key, key, value),), titles.get(feature.key, ""))


def _pressed(feature: str, key: tuple[str | int, ...], value: object) -> tuple[Hashable, object]:
    """The message of the page's script when a button of a feature is pressed, as an event."""
    return ("message", "feature", 0), (feature, key, value)


class Palette:
    """The commands that one page has registered.

    Args:
        tabs: of the page, as in `commands`.
    """

    def __init__(self, gui: viser.GuiApi, tabs: Sequence[type[Feature]], post: Post, channel: Channel) -> None:
        self._gui, self._tabs, self._post, self._channel = gui, tabs, post, channel
        self._handles: dict[Command, viser.CommandHandle] = {}
        self._arms: Sequence[str] = ()
        self._exercises: Sequence[Exercise] = ()

    def renew(self, features: Sequence[Feature], arms: Sequence[str], exercises: Sequence[Exercise]) -> None:
        """Register what there is by now, and remove what is gone; arguments as in `commands`."""
        if arms == self._arms and exercises is self._exercises:
            return
        self._arms, self._exercises = arms, exercises
        found = dict.fromkeys(commands(self._tabs, features, arms, exercises))
        for command in [each for each in self._handles if each not in found]:
            self._handles.pop(command).remove()
        for command in found:
            if command not in self._handles:
                self._handles[command] = self._register(command)

    def _register(self, command: Command) -> viser.CommandHandle:
        handle = self._gui.add_command(command.label, description=command.about or None)

        @handle.on_trigger
        async def _(_: viser.CommandEvent) -> None:
            if command.tab:
                self._channel.notify("tab", command.tab)
            for key, value in command.events:
                self._post(key, value)

        return handle
