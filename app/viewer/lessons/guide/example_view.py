"""A worked example in the visitor's page: its words above the steps, and its arm in place of the visitor's.

The visitor's arm, scene and history stay as they are: the page hides everything but the example, whose arm is
drawn beside them, and shows it again at the end.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from app.exercises.worked import WorkedText
from app.viewer.declared.scene import SceneView
from app.viewer.feature import Stage
from app.viewer.lessons.guide.example import Example, Player, example_of
from app.viewer.lessons.guide.example_drawing import ExampleDrawing, View
from app.viewer.panel.status import Notice
from kin import InputError
from kin.transforms import Array

KEY = "worked"  # what the names of its nodes begin with
FRAME = 1 / 30  # s between two frames of a motion
PLAY, NEXT, BACK = 0, 1, -1  # what the buttons send


class ExampleView:
    """The example of one lesson.

    Args:
        text: None: the lesson has none, and there is nothing to see.
    """

    def __init__(self, stage: Stage, text: WorkedText | None) -> None:
        self._stage, self._text = stage, text
        self._scene = SceneView(stage.client.scene, KEY, stage.post)
        self._player: Player | None = None
        self._drawing: ExampleDrawing | None = None
        self._left: Array | None = None  # where the visitor's arm was heading when it began

    @property
    def is_open(self) -> bool:
        """Whether the example is on show."""
        return self._player is not None

    @property
    def words(self) -> tuple[Any, ...] | None:
        """What its words and buttons depend on; None: the lesson has no example."""
        player = self._player
        if self._text is None:
            return None
        if player is None:
            return (self._text.title,)
        count = len(player.example.steps)
        return self._text.title, player.step, player.at, count, player.arrived, player.playing

    def press(self, button: object) -> None:
        """A button was pressed; raises `kin.InputError` for one that does not exist."""
        if self._text is None or type(button) is not int or button not in (PLAY, NEXT, BACK):
            raise InputError("example", button, f"{PLAY}, {NEXT} or {BACK}")
        now = time.perf_counter()
        if self._player is None:
            self._begin(now)
        elif button == PLAY:
            self._player.toggle(now)
        else:
            self._player.turn(button, now)
        self._show()

    def close(self) -> None:
        """End it: everything is shown again as it is."""
        if self._player is None:
            return
        self._player = self._drawing = self._left = None
        self._scene.remove()
        self._stage.picture.show_all()

    def on_arm_changed(self) -> bool:
        """The visitor's arm moves: who moves it wants to see it; returns whether the example has ended."""
        if self._left is None or (self._left == self._stage.arm.now.goal).all():
            return False
        self.close()
        return True

    def on_style(self, text: WorkedText | None) -> None:
        """The units have changed, or the words."""
        if text is not self._text:
            self.close()  # another example may have fewer steps
            self._text = text
        elif self._player is not None:
            self._player.use(self._example())
            self._show()

    def advance(self, now: float) -> float | None:
        """Go on; returns in how many seconds to do so again, None: nothing moves."""
        if self._player is None:
            return None
        wait = self._player.advance(now)
        self._show()
        return None if wait is None else max(wait, FRAME)

    def _example(self) -> Example:
        assert self._text is not None
        return example_of(self._text, self._stage.display.units)

    def _begin(self, now: float) -> None:
        example = self._example()
        self._player = Player(example, now)
        eye = self._stage.client.camera
        aspect = eye.image_width / eye.image_height if eye.image_height > 0 else 1.6
        view = View.of(np.array(eye.position), np.array(eye.look_at), aspect)
        self._drawing = ExampleDrawing(example, view)
        notice = Notice("hand", f"Worked example: {example.title}", "Your own arm is hidden, and stays as it is.")
        self._left = self._stage.arm.now.goal.copy()
        self._stage.picture.show_alone(f"/{KEY}-", notice)

    def _show(self) -> None:
        player, drawing = self._player, self._drawing
        assert player is not None
        assert drawing is not None
        step, share = player.step, player.share
        q = step.at(share)
        walk = step.walk[0] + share * (step.walk[1] - step.walk[0])
        behind = step.way[: max(1, round(share * (len(step.way) - 1)) + 1)]
        self._scene.show(drawing.nodes(q, step.drawn, behind, walk, self._stage.display.units))
