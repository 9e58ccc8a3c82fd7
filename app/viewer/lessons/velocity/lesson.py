"""The lesson "Velocity": the Jacobian at the present configuration, and the directions lost at singularities.

Ellipsoid and arrows are updated with each frame. Numbers, sentences and the search for singularities follow at
`INTERVAL`: nobody reads faster, and their HTML is long.
"""

from __future__ import annotations

import math
import time
from collections.abc import Hashable
from itertools import count
from typing import TypeVar

import numpy as np
import viser

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.velocity import views
from app.viewer.lessons.velocity.drawing import Drawing
from app.viewer.lessons.velocity.jog import BUTTONS, Frame, Press, Step, button, step
from app.viewer.lessons.velocity.line import Line
from app.viewer.lessons.velocity.null_motion import FRAME, NullMotion
from app.viewer.lessons.velocity.questions import outline
from app.viewer.lessons.velocity.statics import Statics
from app.viewer.panel import assign, listen, listen_click, update_html
from kin import InputError
from kin.differential.ellipsoids import Axes, Ellipsoid, axes_of, lost, part_of, semi_axes, task_rates
from kin.transforms import Array
from kin.units import Unit, Units

INTERVAL = 0.05  # s between two updates of the numbers
HOLD = 10.0  # steps a second while a button is held
FRAMES: dict[str, Frame] = {"Base": "base", "Tool": "tool"}
ELLIPSOIDS: dict[str, Ellipsoid | None] = {
    "Linear velocity": "velocity",
    "Angular velocity": "turning",
    "Force": "force",
    "Moment": "moment",
    "None": None,
}
STEPS = (1e-4, 0.1)  # m
TURNS = (math.radians(0.1), math.radians(30.0))  # rad
FRAME_HINT = "Whose axes the Jacobian's rows and the jog buttons refer to; the reference point is the tool point"
COLUMN_HINT = "Draws this joint's column at the tool: straight arrow v, round arrow ω; a second click removes it"
ELLIPSOID_HINT = "Velocities the joints can give the tool, or forces they can resist, largest where it is slowest"
STEP_HINT = "Length of one step along an axis"
TURN_HINT = "Angle of one step about an axis"
_NUMBERS = count(1)
V = TypeVar("V")
Field = viser.GuiNumberHandle[float]


class VelocityLesson(Lesson):
    """See the module."""

    key = "velocity"
    title = "Velocity"
    computes = False
    about = "The velocities and forces of the tool: Jacobian, ellipsoids, singularities."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._frame: Frame = "base"
        self._kind: Ellipsoid | None = "velocity"
        self._chosen: int | None = None
        self._step, self._turn = 0.005, math.radians(2.0)
        self._shown_at = 0.0
        self._refused: tuple[object, ...] = ()
        self._cut = False
        self._J: Array
        self._axes: Axes | None = None
        self._drawing: Drawing
        self._scales: dict[Ellipsoid, float]
        gui = stage.client.gui
        self._warning = gui.add_html("")
        self._frames = gui.add_dropdown("Frame", tuple(FRAMES), initial_value="Base", hint=FRAME_HINT)
        listen(self._frames, self.post, "frame")
        with gui.add_folder("Jacobian") as self._column_folder:
            self._matrix = gui.add_html("")
            self._units = gui.add_html("")
            self._columns: viser.GuiButtonGroupHandle | None = None
            self._column = gui.add_html("", order=1e9)
        with gui.add_folder("Ellipsoid"):
            self._kinds = gui.add_dropdown(
                "Show", tuple(ELLIPSOIDS), initial_value="Linear velocity", hint=ELLIPSOID_HINT
            )
            listen(self._kinds, self.post, "ellipsoid")
            self._ellipsoid = gui.add_html("")
        self._jog_folder = gui.add_folder("Jog")
        with self._jog_folder:
            self._build_jog(gui)
        with gui.add_folder("Singular values", expand_by_default=False):
            self._values = gui.add_html("")
        with gui.add_folder("Singularities", expand_by_default=False):
            self._others = gui.add_html("")
        with gui.add_folder("Forces", expand_by_default=False):
            self._statics = Statics(stage, self.post)
        with gui.add_folder("Null space", expand_by_default=False):
            self._null = NullMotion(stage, self.post)
        with gui.add_folder("Along a line", expand_by_default=False):
            self._line = Line(stage, self.post)
        self._use_robot()

    def _build_jog(self, gui: viser.GuiApi) -> None:
        self._make_fields()
        gui.add_html(views.jog_html(), order=3)
        for number, (axis, sign) in enumerate(BUTTONS):
            verb = "Turns the tool about" if axis > 2 else "Moves the tool along"
            handle = gui.add_button(
                button(axis, sign),
                hint=f"{verb} {'xyz'[axis % 3]} by one step",
                order=4 + number,
            )
            self._listen_jog(handle, number)

    def _listen_jog(self, handle: viser.GuiButtonHandle, number: int) -> None:
        press = Press()

        # Each press has a key of its own, so that no tap is lost; a slow worker skips repeats of one press.
        async def held(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client is not None and press.held(time.monotonic()):
                self.post(("jog", number, press.number))

        async def clicked(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client is not None and press.clicked(time.monotonic()):
                self.post(("jog", number, press.number))

        handle.on_hold(held, callback_hz=HOLD)
        handle.on_click(clicked)

    def _make_fields(self) -> None:
        """The fields for the size of a step, in the present units."""
        gui, units = self.stage.client.gui, self.stage.units
        self._field_units = units

        def field(name: str, unit: Unit, value: float, ends: tuple[float, float], hint: str, order: int) -> Field:
            low, high = (unit.shown(end) for end in ends)
            made = gui.add_number(
                f"{name}, {unit.name}", unit.shown(value), min=low, max=high, step=unit.step(1), hint=hint,
                order=order,
            )  # fmt: skip
            listen(made, self.post, (name.lower(), units))
            return made

        self._step_field = field("Step", units.lengths, self._step, STEPS, STEP_HINT, 1)
        self._turn_field = field("Turn", units.angles, self._turn, TURNS, TURN_HINT, 2)

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case "frame":
                self._frame = _one_of("frame", value, FRAMES)
                self._show_numbers()
            case "ellipsoid":
                self._kind = _one_of("ellipsoid", value, ELLIPSOIDS)
                self._show_all()
            case ("column", str(robot_id), int(index)):
                if robot_id == self.stage.now.robot.id:
                    self._chosen = None if index == self._chosen else index
                    self._show_all()
            case ("step", Units() as units):
                if units == self.stage.units:
                    self._step = _number("step", value, STEPS, units.lengths)
            case ("turn", Units() as units):
                if units == self.stage.units:
                    self._turn = _number("turn", value, TURNS, units.angles)
            case ("jog", int(number), int()):
                self._jog(*BUTTONS[number])
            case ("statics", *_) as named:
                self._statics.handle(tuple(named), value)
                self._show_numbers()
            case ("null", *_) as named:
                self._null.handle(tuple(named), value)
                self.due = 0.0
            case ("line", *_) as named:
                self._line.handle(tuple(named))
            case _:
                raise InputError("velocity", key, "a control of this lesson")

    def step_name(self, key: Hashable) -> str:
        return "Jog" if isinstance(key, tuple) and key[0] == "jog" else self.title

    def on_robot(self) -> None:
        self._drawing.remove()
        self._null.stop()
        self._line.forget()
        if self._columns is not None:
            self._columns.remove()
        self._use_robot()

    def on_pose(self, T_base_tool: Array) -> None:
        self._draw(self.stage.now.q, T_base_tool)
        self.due = max(0.0, INTERVAL - (time.perf_counter() - self._shown_at))

    def on_style(self) -> None:
        if self.stage.units != self._field_units:
            self._step_field.remove()
            self._turn_field.remove()
            with self._jog_folder:
                self._make_fields()
        self._refused = ()
        self._show_numbers()

    def tick(self, now: float) -> None:
        self._null.step(now)
        wait = INTERVAL - (now - self._shown_at)
        if wait <= 0.0:
            self._show_numbers()
            wait = INTERVAL
        elif not self._null.runs:
            self.due = wait
        if self._null.runs:
            self.due = min(wait, FRAME)

    def state(self) -> dict[str, object]:
        return {
            "frame": self._frame,
            "ellipsoid": self._kind or "none",
            "joint": 0 if self._chosen is None else self._chosen + 1,
            "step": self._step,
            "turn": self._turn,
            "statics": self._statics.state(),
        }

    def restore(self, state: dict[str, object]) -> None:
        for name, frame in FRAMES.items():
            if state.get("frame") == frame:
                self._frame = frame
                assign(self._frames, name)
        for name, kind in ELLIPSOIDS.items():
            if state.get("ellipsoid") == (kind or "none"):
                self._kind = kind
                assign(self._kinds, name)
        joint = state.get("joint")
        if type(joint) is int and 0 <= joint <= self.stage.now.robot.n:
            self._chosen = joint - 1 if joint else None
        size, turn = state.get("step"), state.get("turn")
        if isinstance(size, float) and STEPS[0] <= size <= STEPS[1]:
            self._step = size
        if isinstance(turn, float) and TURNS[0] <= turn <= TURNS[1]:
            self._turn = turn
        self._statics.restore(state.get("statics"))
        units = self.stage.units
        assign(self._step_field, units.lengths.shown(self._step))
        assign(self._turn_field, units.angles.shown(self._turn))
        self._show_all()

    def remove(self) -> None:
        self._drawing.remove()
        self.stage.show_legend("")

    # Jogging

    def _jog(self, axis: int, sign: int) -> None:
        stage = self.stage
        amount = sign * (self._step if axis < 3 else self._turn)
        options = stage.now.options
        request = (stage.now.robot, stage.now.goal.tobytes(), options, axis, amount, self._frame)
        if request == self._refused:
            return  # a button held at a limit: the same request would be solved ten times a second
        made: Step = step(stage.now.robot, stage.now.goal, options, axis, amount, self._frame, stage.units)
        if made.q is None:
            self._refused = request
            stage.notify(made.notice)
        else:
            stage.move_to(made.q, made.notice)

    # What is shown

    def _use_robot(self) -> None:
        """Create drawings, scales and column buttons of the selected robot."""
        stage, robot = self.stage, self.stage.now.robot
        self._chosen, self._refused = None, ()
        root = f"/velocity-{next(_NUMBERS)}"
        self._drawing = Drawing(stage.client.scene, robot, root)
        self._statics.use_robot(root)
        self._scales = {kind: self._scale(kind) for kind in ELLIPSOIDS.values() if kind is not None}
        options = tuple(str(i + 1) for i in range(robot.n))
        with self._column_folder:
            self._columns = stage.client.gui.add_button_group("Column", options, hint=COLUMN_HINT)
        listen_click(self._columns, self.post, {name: ("column", robot.id, k) for k, name in enumerate(options)})
        self._show_all()

    def _show_all(self) -> None:
        self._draw(self.stage.now.q, self.stage.now.T_tool)
        self._show_numbers()

    def _scale(self, kind: Ellipsoid) -> float:
        """The value that `views.SAMPLE` represents in the scene: the ellipsoid at home then has a fitting size."""
        robot = self.stage.now.robot
        semi = semi_axes(axes_of(part_of(kin.jacobian(robot, robot.q_home), kind)).values, kind)
        usual = semi[np.isfinite(semi) & (semi > 1e-6) & (semi < 1e6)]
        longest = float(usual.max()) if len(usual) else 1.0
        return views.nice(views.SAMPLE * longest / (0.42 * self._drawing.radius))

    def _draw(self, q: Array, T_base_tool: Array) -> None:
        """Update what moves with each frame."""
        self._J = J = kin.jacobian(self.stage.now.robot, q)
        self._T = T_base_tool
        self._drawing.place(T_base_tool[:3, 3])
        self._statics.draw(J, T_base_tool)
        self._axes = None
        if self._kind is not None:
            self._axes = axes_of(part_of(J, self._kind))
            lengths = semi_axes(self._axes.values, self._kind) * (views.SAMPLE / self._scales[self._kind])
            self._cut = self._drawing.show_ellipsoid(self._kind, self._axes.R, lengths)
        else:
            self._drawing.hide_ellipsoid()
        if self._chosen is None:
            self._drawing.show_column(None, None)
        else:
            column = J[:, self._chosen]
            self._drawing.show_column(column[:3] * (views.SAMPLE / self._scales["velocity"]), column[3:])

    def _show_numbers(self) -> None:
        """Update numbers, sentences and singularities."""
        self._shown_at, self.due = time.perf_counter(), None
        stage, robot, J, T = self.stage, self.stage.now.robot, self._J, self._T
        R = T[:3, :3]
        rows = J if self._frame == "base" else np.vstack([R.T @ J[:3], R.T @ J[3:]])
        update_html(self._matrix, views.matrix_html(robot, rows, self._frame, self._chosen))
        update_html(self._units, views.units_html(robot, self._frame))
        update_html(self._column, views.column_html(robot, J, self._chosen))
        self._show_singularities(R)
        rates = task_rates(robot, stage.now.q)
        update_html(self._values, views.values_html(robot, rates, J))
        self._statics.show_numbers()
        self._null.show_numbers()
        if self._kind is None or self._axes is None:
            update_html(self._ellipsoid, "")
            return
        semi = semi_axes(self._axes.values, self._kind)
        scale = self._scales[self._kind]
        update_html(self._ellipsoid, views.ellipsoid_html(robot, self._kind, semi, scale, self._cut, stage.units))
        self._drawing.write_values(views.label_texts(semi), np.asarray(stage.client.camera.position))

    def _show_singularities(self, R_base_tool: Array) -> None:
        arm = self.stage.now
        stage, robot = self.stage, arm.robot
        found = kin.singularities(robot, arm.q)
        nearest = views.real(found)
        state = views.state_of(nearest[0], robot.reach) if nearest else "far"
        twists = np.empty((0, 6))
        if state != "far":
            rates = task_rates(robot, arm.q)
            twists = lost(rates) if state == "at" else rates.twists[-1:]
        self._drawing.show_lost(twists, state == "at")
        words = [views.lost_words(twist, R_base_tool, slowest=state == "near") for twist in twists]
        update_html(self._warning, views.warning_html(robot, found, stage.units, words))
        stage.show_legend(views.legend_html(self._kind, self._chosen, state, twists, self._statics.shown))
        update_html(self._others, views.others_html(robot, found, stage.units))


def _one_of(field: str, value: object, options: dict[str, V]) -> V:
    if not isinstance(value, str) or value not in options:
        raise InputError(field, value, "one of " + ", ".join(options))
    return options[value]


def _number(field: str, value: object, limits: tuple[float, float], unit: Unit) -> float:
    """A number typed in this unit, in radians or metres."""
    low, high = (unit.shown(limit) for limit in limits)
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InputError(field, value, f"a number from {low:g} to {high:g}")
    return min(max(unit.read(float(value)), limits[0]), limits[1])
