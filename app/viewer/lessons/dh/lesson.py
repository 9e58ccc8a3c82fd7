"""The lesson "DH table step by step".

A large frame moves from the base to the tool, one elementary motion of the table after another, on the arm in its
present configuration. `steps` computes the walk, `views` the HTML of the panel, and `drawing` draws it in the
scene, `player` advances it. This module has the controls.
"""

from __future__ import annotations

import math
import time
from itertools import count

import numpy as np
import viser

from app.viewer.feature import Stage
from app.viewer.lessons.dh import views
from app.viewer.lessons.dh.assign import Assigning
from app.viewer.lessons.dh.axes_drawing import AxesDrawing, axis_names, room
from app.viewer.lessons.dh.drawing import OtherDrawing, WalkDrawing, aside
from app.viewer.lessons.dh.player import SPEEDS, Player
from app.viewer.lessons.dh.questions import outline
from app.viewer.lessons.dh.steps import length, place
from app.viewer.lessons.figures import Figure
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.panel import assign, listen, update_html
from app.viewer.scene import camera
from app.viewer.scene.meshes import body
from kin import InputError, link_frames
from kin.transforms import Array

FRAME = 1 / 30  # s between frames while playing
READ = 0.1  # s between updates of the texts
ASSIGN_HINT = "Choose the frames of this arm, fill in its table, and see what a wrong entry would mean"
LINES_HINT = "Joint axes z, and the common normals of neighbours with their feet"
BUTTONS, WHILE_PLAYING = ("Back", "Play", "Next"), ("Back", "Pause", "Next")


_fresh = count(1)  # for node names: browsers give the pose of a removed node to the next one of that name


class DHLesson(Lesson):
    """The walk through the table of the selected robot."""

    key = "dh"
    title = "DH table step by step"
    computes = False
    left = "table"
    about = "How four motions per row lead from the base to the tool, one after another."
    messages = Assigning.messages
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._player = Player(stage.now.robot)
        self._read_at = 0.0
        self._stale = False
        self._symbols = False
        self._compare = False
        self._drawing: WalkDrawing | None = None
        self._other: OtherDrawing | None = None
        self._view: tuple[Array, Array, Array] | None = None  # camera before the comparison, and where that put it
        self._lines = True
        self._assigning: Assigning | None = None
        self._axes: AxesDrawing | None = None
        self._figure: Figure | None = None
        gui = stage.client.gui
        self._assign_box = gui.add_checkbox("Assign it yourself", False, hint=ASSIGN_HINT)
        listen(self._assign_box, self.post, "assign")
        with gui.add_folder(None) as self._assign_block:
            pass
        self._caption = gui.add_html("")
        self._slider = gui.add_slider(
            "Row",
            0.0,
            float(len(stage.now.robot.rows)),
            0.01,
            0.0,
            hint="0: frame 0 at the base; 2: row 2 complete; a quarter is one motion. Arrow keys move it finely.",
        )
        listen(self._slider, self.post, "at")
        self._buttons = gui.add_button_group(
            "Motion", BUTTONS, hint="Back and Next: to the end of the previous or next motion"
        )
        self._listen_buttons()
        self._table = gui.add_html("")
        self._matrices = gui.add_html("")
        self._symbols_box = gui.add_checkbox("Symbols", False, hint="Aᵢ with its joint variable as a symbol")
        listen(self._symbols_box, self.post, "symbols")
        self._compare_box = gui.add_checkbox(
            "Compare conventions", False, hint="The same numbers in the other convention, next to the arm"
        )
        listen(self._compare_box, self.post, "compare")
        self._comparison = gui.add_html("", visible=False)
        self._speed_choice = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value=self._player.speed)
        listen(self._speed_choice, self.post, "speed")
        self._lines_box = gui.add_checkbox("Axes and normals", True, hint=LINES_HINT)
        listen(self._lines_box, self.post, "lines")
        self._nine = gui.add_html("")
        self._start()

    def handle(self, key: object, value: object) -> None:
        match key:
            case "at":
                self._player.go_to_rows(value)
                self._pause()
                self._draw()
                self._write()
            case ("press", int()):
                self._press(value)
            case "speed":
                if value not in SPEEDS:
                    assign(self._speed_choice, self._player.speed)
                    raise InputError("speed", value, "one of " + ", ".join(SPEEDS))
                self._player.speed = str(value)
            case "symbols":
                self._symbols = bool(value)
                self._write()
            case "compare":
                self._compare = bool(value)
                self._show_other(aim=True)
                self._write()
            case "lines":
                self._lines = bool(value)
                self._draw()
            case "assign":
                self._assign(bool(value))
            case _ if self._assigning is not None:
                self._assigning.handle(key, value)
            case _:
                raise InputError("lesson", key, "a control of this lesson that is on show")

    def on_robot(self) -> None:
        self._pause()
        self._player.robot, self._player.at = self.stage.now.robot, 0.0
        self._remove_drawings()
        self._view = None  # the page has moved the camera already
        self._start()
        if self._assigning is not None:
            self._assign(False)
            self._assign(True)

    def on_pose(self, T_base_tool: Array) -> None:
        read = time.perf_counter() - self._read_at >= READ
        self._draw(names=read)
        if read:
            self._write()
        else:
            # This may be the last frame of a motion: `tick` then updates the texts.
            self._stale = True
            self.due = self.due or READ

    def on_style(self) -> None:
        self._draw()
        self._write()

    def tick(self, now: float) -> None:
        read = (self._stale or self._player.playing) and now - self._read_at >= READ
        if self._player.playing and self._player.advance(now, self.stage.now.q):
            self._pause()
        if self._player.playing or read:
            self._draw(names=read)
        if read:
            self._write()
            if self._player.playing:
                assign(self._slider, self._player.rows)
        if not self._player.playing and not self._stale:
            self.due = None

    def state(self) -> dict[str, object]:
        own = None if self._assigning is None else self._assigning.attempt.state()
        return {
            "at": self._player.at, "symbols": self._symbols, "compare": self._compare, "speed": self._player.speed,
            "lines": self._lines, "assign": own,
        }  # fmt: skip

    def restore(self, state: dict[str, object]) -> None:
        at, symbols, compare, speed = (state.get(name) for name in ("at", "symbols", "compare", "speed"))
        if isinstance(symbols, bool):
            self._symbols = symbols
            assign(self._symbols_box, symbols)
        if isinstance(compare, bool):
            self._compare = compare
            assign(self._compare_box, compare)
            self._show_other()
        if isinstance(speed, str) and speed in SPEEDS:
            self._player.speed = speed
            assign(self._speed_choice, speed)
        if isinstance(at, int | float) and not isinstance(at, bool) and 0.0 <= at <= length(self.stage.now.robot):
            self._player.at = float(at)
        if isinstance(lines := state.get("lines"), bool):
            self._lines = lines
            assign(self._lines_box, lines)
        self._pause()
        self._go(self._player.at)
        if "assign" in state:
            own = state["assign"]
            self._assign(isinstance(own, dict))
            if self._assigning is not None:
                self._assigning.restore(own)

    def remove(self) -> None:
        self._remove_drawings()
        if self._assigning is not None:
            self._assigning.remove()
        self._restore_camera()
        self.stage.see_through(False)
        self.stage.fit_view(())

    # The player

    def _listen_buttons(self) -> None:
        presses = count()

        @self._buttons.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client is not None:
                # Each press has a key of its own: a second press under the same key would replace the first.
                self.post(("press", next(presses)), event.target.value)

    def _press(self, button: object) -> None:
        self._pause()
        match button:
            case "Back":
                self._go(math.ceil(self._player.at) - 1)
            case "Next":
                self._go(math.floor(self._player.at) + 1)
            case "Play":
                self._play()

    def _go(self, at: float) -> None:
        self._player.go(at)
        assign(self._slider, self._player.rows)
        self._draw()
        self._write()

    def _play(self) -> None:
        self._player.play(time.perf_counter())
        self.due = FRAME
        self._buttons.options = WHILE_PLAYING

    def _pause(self) -> None:
        if self._player.playing:
            self._player.playing = False
            self._stale = True
            self._buttons.options = BUTTONS
            assign(self._slider, self._player.rows)

    # Scene and panel

    def _start(self) -> None:
        """Show the walk on the selected robot."""
        robot = self.stage.now.robot
        self._slider.max = float(len(robot.rows))
        assign(self._slider, self._player.rows)
        self._nine.content = views.nine_steps_html(robot.convention)
        self.stage.see_through(True)
        self.stage.fit_view(room(robot))
        if self._assigning is not None:
            return
        scene, frames = self.stage.client.scene, link_frames(robot, robot.q_home)
        self._drawing = WalkDrawing(scene, robot, frames, f"/dh-{next(_fresh)}")
        self._figure = Figure(scene, f"/dh-{next(_fresh)}", body(robot).size)
        self._axes = AxesDrawing(self._figure, robot)
        self._show_other(aim=True)
        self._draw()
        self._write()

    def _remove_drawings(self) -> None:
        for drawing in (self._drawing, self._other, self._figure):
            if drawing is not None:
                drawing.remove()
        self._drawing = self._other = self._axes = self._figure = None

    def _assign(self, on: bool) -> None:
        """Begin *Assign it yourself*, instead of the walk, or go back to the walk."""
        assign(self._assign_box, on)
        if on == (self._assigning is not None):
            return
        self._pause()
        for control in (
            self._caption, self._slider, self._buttons, self._table, self._matrices, self._symbols_box,
            self._compare_box, self._speed_choice, self._lines_box,
        ):  # fmt: skip
            control.visible = not on
        self._comparison.visible = self._compare and not on
        self._remove_drawings()
        self._restore_camera()
        if on:
            self._assigning = Assigning(self.stage, self._assign_block, f"/dh-{next(_fresh)}")
        elif self._assigning is not None:
            self._assigning.remove()
            self._assigning = None
            self._start()

    def _show_other(self, aim: bool = False) -> None:
        """Show or hide the table in the other convention; `aim`: with the camera on both arms."""
        if self._compare and self._other is None:
            self._other = OtherDrawing(self.stage.client.scene, self.stage.now.robot, f"/dh-{next(_fresh)}")
            if aim:
                self._show_both()
            self._draw()
        elif not self._compare and self._other is not None:
            self._other.remove()
            self._other = None
            self._restore_camera()
        self._comparison.visible = self._compare

    def _draw(self, names: bool = True) -> None:
        """Update the scene; without `names`, the labels of frames are left out: they cost as much as the rest."""
        robot, q = self.stage.now.robot, self.stage.now.q
        if self._assigning is not None:
            self._assigning.draw()
        if self._drawing is None:
            return
        if self._axes is not None and self._lines and not self._compare:  # the comparison has axes of its own
            self._axes.show(q, axis_names(robot))
        elif self._axes is not None:
            self._axes.hide()
        frames = link_frames(robot, q)
        self._drawing.show(place(robot, q, self._player.at, frames), frames, self.stage.units, names)
        if self._other is not None:
            others = link_frames(self._other.robot, q)
            self._other.show(place(self._other.robot, q, self._player.at, others), frames, others, names)

    def _write(self) -> None:
        """Update the texts."""
        self._read_at = time.perf_counter()
        self._stale = False
        robot, q, units = self.stage.now.robot, self.stage.now.q, self.stage.units
        if self._assigning is not None:
            self._assigning.write()
            return
        at = place(robot, q, self._player.at)
        update_html(self._caption, views.caption_html(robot, at, units))
        update_html(self._table, views.table_html(robot, q, at, units))
        update_html(self._matrices, views.matrices_html(robot, at, self._symbols, units))
        if self._other is not None:
            other = self._other.robot
            tools = [link_frames(reading, q)[-1, :3, 3] for reading in (robot, other)]
            distance = float(np.linalg.norm(tools[0] - tools[1]))
            there = place(other, q, self._player.at)
            update_html(self._comparison, views.compare_html(robot, other, q, there, distance, units))

    def _show_both(self) -> None:
        """Move the camera back until arm and skeleton are in view, without changing its direction."""
        eye = self.stage.client.camera
        robot = self.stage.now.robot
        aspect = eye.image_width / eye.image_height if eye.image_height > 0 else 1.6
        position, look_at = camera.view(body(robot), aspect)
        before = (np.array(eye.position), np.array(eye.look_at))
        out = before[0] - before[1]
        far = max(float(np.linalg.norm(out)), 1.5 * float(np.linalg.norm(position - look_at)))
        look_at = look_at + aside(robot) / 2
        eye.position = look_at + far * out / np.linalg.norm(out)
        eye.look_at = look_at
        self._view = (*before, np.array(eye.position))

    def _restore_camera(self) -> None:
        """Undo `_show_both`, unless the visitor has moved the camera since."""
        if self._view is None:
            return
        position, look_at, left_at = self._view
        self._view = None
        eye = self.stage.client.camera
        if np.allclose(eye.position, left_at, atol=1e-3):
            eye.position, eye.look_at = position, look_at
