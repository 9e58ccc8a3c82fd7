"""A worked example in the visitor's page: its words above the steps, and its arm in place of the visitor's.

The visitor's arm, scene and history stay as they are: the page hides everything but the example, whose arm is
drawn beside them, and shows it again at the end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.exercises.worked import WorkedText
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.scene import Node
from app.viewer.declared.work import Sweep, Work
from app.viewer.feature import Feature, Stage
from app.viewer.lessons.guide.example import PATIENCE, Player, example_of
from app.viewer.lessons.guide.example_drawing import ExampleDrawing, View
from app.viewer.panel.status import Notice
from kin import InputError
from kin.transforms import Array

FRAME = 1 / 30  # s between two frames of a motion
PLAY, NEXT, BACK = 0, 1, -1  # what the buttons send


@dataclass(frozen=True, eq=False)
class Showing:
    """An example on show.

    Attributes:
        text: its words.
        player: how far it has come.
        left: where the visitor's arm was heading when it began.
    """

    text: WorkedText
    player: Player
    drawing: ExampleDrawing
    left: Array


@dataclass(frozen=True)
class ExampleSettings(Settings):
    """What is on show of the example; None: nothing."""

    showing: Showing | None = memory()


class WorkedExample(DeclaredFeature[ExampleSettings, Facts[ExampleSettings]]):
    """The example of one lesson, a part of its guide.

    Args:
        text: what the lesson has now; None: it has none, and there is nothing to see.
        changed: called when `words` have changed by themselves.
    """

    key = "worked"  # what the names of its nodes begin with
    title = "Worked example"
    settings_of, facts_of = ExampleSettings, Facts

    def __init__(
        self, stage: Stage, guide: Feature, text: Callable[[], WorkedText | None], changed: Callable[[], None]
    ) -> None:
        self._text, self._changed = text, changed
        super().__init__(stage, guide)

    @property
    def words(self) -> tuple[Any, ...] | None:
        """What its words and buttons depend on; None: the lesson has no example."""
        text, showing = self._text(), self.settings.showing
        if text is None or showing is None:
            return None if text is None else (text.title,)
        player = showing.player
        return text.title, player.step, player.at, len(player.example.steps), player.arrived, player.playing

    def press(self, button: object) -> None:
        """A button was pressed; raises `kin.InputError` for one that does not exist."""
        text, showing = self._text(), self.settings.showing
        if text is None or type(button) is not int or button not in (PLAY, NEXT, BACK):
            raise InputError("example", button, f"{PLAY}, {NEXT} or {BACK}")
        if showing is None:
            self._open(text)
        else:
            player = showing.player
            self._play(player.toggled() if button == PLAY else player.turned(button))
        self._begin()

    def close(self) -> None:
        """End it: everything is shown again as it is."""
        if self.settings.showing is not None:
            self.change(showing=None)
            self._scene.remove()
            self.stage.picture.show_all()
            self._changed()

    def running(self) -> Sequence[Work | Sweep]:
        showing = self.settings.showing
        if showing is None:
            return ()
        if not showing.player.arrived:
            return [Sweep(self._move, FRAME, PATIENCE)]
        player = showing.player
        return [Work("rest", tuple, (player.at,), rest=player.rest)] if player.goes_on else ()

    def worked(self, key: str) -> None:
        if (showing := self.settings.showing) is not None:
            self._play(showing.player.followed())
            self._changed()

    def scene(self) -> Sequence[Node]:
        if (showing := self.settings.showing) is None:
            return ()
        step, share = showing.player.step, showing.player.share
        walk = step.walk[0] + share * (step.walk[1] - step.walk[0])
        behind = step.way[: max(1, round(share * (len(step.way) - 1)) + 1)]
        return showing.drawing.nodes(step.at(share), step.drawn, behind, walk, self.stage.display.units)

    def on_arm_changed(self, changed: Set[str]) -> None:
        showing = self.settings.showing
        if showing is not None and not np.array_equal(showing.left, self.stage.arm.now.goal):
            self.close()  # who moves the own arm wants to see it
        super().on_arm_changed(changed)

    def on_style(self) -> None:
        text, showing = self._text(), self.settings.showing
        if showing is not None and text is not showing.text:
            self.close()  # another example may have fewer steps
        elif showing is not None:
            self._play(replace(showing.player, example=example_of(showing.text, self.stage.display.units)))
            self._changed()
        super().on_style()

    def remove(self) -> None:
        self.close()
        super().remove()

    def _open(self, text: WorkedText) -> None:
        example = example_of(text, self.stage.display.units)
        eye = self.stage.client.camera
        aspect = eye.image_width / eye.image_height if eye.image_height > 0 else 1.6
        view = View.of(np.array(eye.position), np.array(eye.look_at), aspect)
        drawing, left = ExampleDrawing(example, view), self.stage.arm.now.goal.copy()
        self.change(showing=Showing(text, Player(example), drawing, left))
        notice = Notice("hand", f"Worked example: {example.title}", "Your own arm is hidden, and stays as it is.")
        self.stage.picture.show_alone(f"/{self.key}-", notice)

    def _play(self, player: Player) -> None:
        assert self.settings.showing is not None
        self.change(showing=replace(self.settings.showing, player=player))

    def _move(self, seconds: float) -> None:
        if (showing := self.settings.showing) is not None:
            player = showing.player.after(seconds)
            self._play(player)
            if player.arrived:
                self._changed()
