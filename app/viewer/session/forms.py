"""The controls of the visitor's choices for the whole page, in three places of the panel."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Any

import viser

from app.viewer.declared.panel import Buttons, Control, Html, Node, PanelView
from app.viewer.feature import Stage
from app.viewer.labels import TEXT_SIZES
from app.viewer.panel import Post
from app.viewer.panel.layout import Panel
from app.viewer.scene.viewpoints import SIDES
from app.viewer.session.choices import PageChoices, ViewState
from app.viewer.views.templates import render
from kin import InputError, Robot


class Forms:
    """The controls of `PageChoices`: in the tabs *View* and *Move*, and in the folder of the obstacles.

    Posts ``("view", place, path, serial)`` and ``("task", place, path, serial)`` with what a control has sent, and
    ``("recall",)``, ``("camera",)``, ``("fit-arm",)`` and ``("look-from", side)``.

    Args:
        view: gives the choices of the tab *View*.
        detailed: the robots that have a detailed body; a choice of it only if there are some.

    Attributes:
        view_ids: the ids of the controls of the tab *View*. Any thread may read it.
    """

    view_ids: frozenset[str]

    def __init__(
        self,
        gui: viser.GuiApi,
        panel: Panel,
        page: Stage,
        view: Callable[[], ViewState],
        detailed: Sequence[Robot],
        post: Post,
    ) -> None:
        self._page, self._view, self._post = page, view, post
        self._nodes: dict[str, Sequence[Node]] = {
            "view": _view(detailed, page.rights.compute),
            "target": _target(),
            "obstacles": [Control("view.avoid")],
        }
        self._views: dict[str, PanelView] = {}
        containers = {"view": panel.view, "target": panel.target, "obstacles": panel.avoid}
        for place, container in containers.items():
            self._views[place] = PanelView(gui, partial(self._forward, place), page.fence, container)
        self.show()

    def show(self) -> None:
        """Show what the page has chosen."""
        choices, robot, units = self._choices, self._page.arm.robot, self._page.display.units
        for place, view in self._views.items():
            nodes = [*self._nodes[place], *(self._language() if place == "view" else ())]
            view.show(nodes, choices, robot, units)
        self.view_ids = self._views["view"].ids  # that of the languages comes with a second one

    def read(self, place: str, path: str, serial: int, posted: object) -> PageChoices:
        """The choices with what a control has sent; for what it does not offer, it shows the present one again.

        Raises:
            InputError: for a value that the control does not offer.
        """
        try:
            found = self._views[place].received(self._choices, path, serial, posted)
        except InputError:
            self.show()
            raise
        assert found is not None  # these controls are never replaced
        return found

    def _language(self) -> Sequence[Node]:
        """The choice of a language, if there are several."""
        lessons = self._page.activity.courses.lessons
        if len(lessons.languages) < 2:
            return ()
        spec: Any = PageChoices.spec("view.language")
        offered = {name: code for code, name in lessons.languages.items()}
        chosen = lessons.spoken(self._view().language)
        return [Control("view.language", spec=spec.narrowed(offered), value=chosen)]

    @property
    def _choices(self) -> PageChoices:
        units, task = self._page.display.units, self._page.arm.task
        return PageChoices(not units.degrees, units.length, task, self._view())

    def _forward(self, place: str, key: Hashable, value: object) -> None:
        match key:
            case ("at", "task", int(serial), int()):
                self._post(("task", place, "task", serial), value)
            case ("at", str(path), int(serial), int()):
                self._post(("view", place, path, serial), value)
            case ("do", tuple(event), *_):
                self._post(event, None)


def _view(detailed: Sequence[Robot], draggable: bool) -> list[Node]:
    names = ", ".join(robot.name for robot in detailed)
    shape = f"The body in every detail, from its maker's drawings, instead of our simplified one: {names}."
    return [
        *map(Control, ("radians", "lengths", "view.angles", "view.quaternions", "view.dark", "view.look")),
        *([Control("view.detailed", hint=shape)] if detailed else []),
        *map(Control, ("view.frames", "view.labels", "view.axes")),
        Control("view.base_axes", visible=draggable),
        Html(_text_size),
        Buttons("Camera", {"Fit all": ("fit-arm",), "Reset view": ("camera",)}),
        Buttons("View from", {side: ("look-from", side) for side in SIDES}),
    ]


def _text_size() -> str:
    """The size of the text, which the page's own script keeps."""
    return render("panel/text_size", names=tuple(TEXT_SIZES))


def _target() -> list[Node]:
    hint = "Moves the target to where the tool is"
    return [Control("task"), Buttons("Target", {"Move target to tool": ("recall",)}, hint)]
