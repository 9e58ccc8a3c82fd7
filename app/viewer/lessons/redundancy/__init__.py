"""The lesson "Redundancy": what the arm can do while the tool stays where it is.

A slider, or a swing back and forth, takes the free value through its range; each picture shows a configuration
that was solved for, never one between two, so the tool is held exactly and the residual says so. For a spherical
shoulder and wrist the feasible arm angles are a ring round the line from one to the other. Where two joints merely
turn about one line, that is drawn for what it is.
"""

from __future__ import annotations

import math
import time
from collections.abc import Hashable
from itertools import count
from typing import Any

import numpy as np
import viser

import kin
from app.viewer.feature import Feature, Stage
from app.viewer.lessons.redundancy import told
from app.viewer.lessons.redundancy.ring import FLAT, arc_segments, coaxial, elbow_circle, trade_segments
from app.viewer.panel import assign, listen
from app.viewer.panel.status import Notice
from app.viewer.scene.meshes import JOINT_COLORS, body
from app.viewer.selfmotion import INSET, SMOOTH, End, ends, free_values, reach_of, self_motion
from kin import IKResult, InputError, Redundancy
from kin.transforms import Array
from kin.units import Units

FRAME = 1 / 30
READ_INTERVAL = 0.05
QUIET = 0.2  # seconds at rest, after which the stops are looked up
SPEED = 0.9  # rad/s of the free value
NEAR = 1e-9  # rad
RING = 1.32  # times the elbow's circle
TRADE_RADIUS = 4.6
THIN = 0.25  # of the arm's size unit; a smaller circle has no room for a ring
FEASIBLE, BLOCKED, STOP, NOW, ELBOW, LINE = (
    (0, 158, 115), (165, 165, 165), (213, 94, 0), (0, 114, 178), (86, 180, 233), (120, 120, 120),
)  # fmt: skip
SLIDER_HINT = "Moves the arm while the tool stays where it is"
SWING_HINT = "Back and forth between the ends of the range"
CHOICE_HINT = "Which of the values that the task leaves free"
MOVING = Notice("reached", "Self-motion", "The arm moves, the tool does not.")
_NUMBERS = count(1)


class RedundancyLesson(Feature):
    """See the module."""

    key = "redundancy"
    title = "Redundancy"
    about = "How seven joints move while the tool stays where it is."

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._name = ""  # of the free value that is moved
        self._wish: float | None = None
        self._swings = False
        self._up = True
        self._arrival = MOVING
        self._sent: Array | None = None  # the configuration this lesson has asked for last
        self._free: tuple[Redundancy, ...] = ()
        self._ends: tuple[End, ...] = ()
        self._ends_key: tuple[object, ...] = ()
        self._control_key: tuple[object, ...] = ()
        self._read_key: tuple[object, ...] = ()
        self._stepped = self._read_at = self._changed = 0.0
        self._slider: viser.GuiSliderHandle[float] | None = None
        self._held: Array
        self._shape: Array
        gui = stage.client.gui
        with gui.add_folder(None) as self._place:
            self._idea = gui.add_html("")
            with gui.add_folder(None) as self._controls_place:
                pass
            self._bar = gui.add_html("")
            self._stops = gui.add_html("")
            self._residual = gui.add_html("")
        self._controls: list[Any] = []
        self._hold()
        self._draw_new()
        self._wake()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("value", str(name), Units() as units):
                if name == self._name and units == self.stage.units:
                    if not isinstance(value, int | float) or not math.isfinite(value):
                        raise InputError(name, value, "a finite number")
                    self._swings = False
                    self._show_swing()
                    self._wish = self._bounded(units.angles.read(float(value)))
                    self._wake()
            case "swing":
                self._swings, self._wish = bool(value), None
                self._wake()
            case "choice":
                chosen = next((item for item in self._free if item.label == value), None)
                if chosen is None:
                    raise InputError("free value", value, "one of " + ", ".join(i.label for i in self._free))
                self._name, self._wish = chosen.name, None
                self._forget()
            case _:
                raise InputError("redundancy", key, "a control of this lesson")

    def on_robot(self) -> None:
        self._name, self._wish, self._swings, self._sent = "", None, False, None
        self._top.remove()
        self._draw_new()
        self._forget()

    def on_picture(self, T_base_tool: Array) -> None:
        self._wake()

    def on_answer(self, result: IKResult) -> None:
        # A target was given: the hand of the visitor goes first.
        self._wish, self._swings = None, False
        self._show_swing()
        self._wake()

    def on_question(self) -> None:
        self._wish = None
        self._forget()

    def on_style(self) -> None:
        self._forget()

    def tick(self, now: float) -> None:
        self.due = None
        if self._sent is None or not np.array_equal(self._sent, self.stage.goal):
            if self._sent is not None:
                self._wish, self._swings = None, False
                self._show_swing()
            self._hold()
        if self._wish is not None or self._swings:
            wait = FRAME - (now - self._stepped)
            if wait <= 0.0:
                self._step(min(now - self._stepped, 2.0 * FRAME))
                self._stepped = now
                wait = FRAME
            self._wake(wait)
        if now - self._read_at >= READ_INTERVAL:
            self._read(now)
        else:
            self._wake(READ_INTERVAL - (now - self._read_at))

    def state(self) -> dict[str, object]:
        return {"free": self._name, "swing": self._swings}

    def restore(self, state: dict[str, object]) -> None:
        name, swings = state.get("free"), state.get("swing")
        self._read(time.perf_counter())
        if isinstance(name, str) and any(item.name == name for item in self._free):
            self._name = name
        if isinstance(swings, bool):
            self._swings = swings and bool(self._free)
        self._forget()

    def remove(self) -> None:
        self._top.remove()
        self._place.remove()

    def _wake(self, seconds: float = 0.0) -> None:
        self.due = seconds if self.due is None else min(self.due, seconds)

    def _forget(self) -> None:
        """Have everything read and shown anew."""
        self._read_key, self._ends_key, self._control_key = (), (), ()
        self._wake()

    # The motion

    @property
    def _item(self) -> Redundancy | None:
        return next((item for item in self._free if item.name == self._name), None)

    def _hold(self) -> None:
        """From now on the tool is to stay where the arm is heading."""
        self._sent = self.stage.goal.copy()
        self._held = kin.fk(self.stage.robot, self._sent)
        self._shape = told.elbow_of(self.stage.robot, self._sent)

    def _range(self) -> tuple[float, float] | None:
        item = self._item
        found = None if item is None else reach_of(item)
        if found is None or found[1] - found[0] < 4.0 * INSET:
            return None
        return found[0] + INSET, found[1] - INSET

    def _bounded(self, wanted: float) -> float | None:
        """The value in the present range nearest to the one wanted; on arrival it is told if they differ."""
        self._arrival = MOVING
        found = self._range()
        if found is None:
            return None
        low, high = found
        turn = 2.0 * math.pi
        images = [wanted + k * turn for k in (-1, 0, 1)] if high > math.pi or low < -math.pi else [wanted]
        nearest = min((min(max(x, low), high) for x in images), key=lambda v: min(abs(v - x) for x in images))
        if min(abs(nearest - x) for x in images) > 1e-3:
            end = next((e for e in self._ends if abs(e.value - nearest) < 1e-3), None)
            why = (
                "The branch ends here" if end is None or end.joint < 0 else f"Joint {end.joint + 1} meets its stop"
            )
            self._arrival = Notice("limits", "The end of the range", f"{why}: no swing leads beyond.")
        return nearest

    def _step(self, seconds: float) -> None:
        """Towards what is wished for, by as much as the speed allows."""
        item, found = self._item, self._range()
        if item is None or found is None:
            self._wish, self._swings = None, False
            self._show_swing()
            return
        low, high = found
        value = item.value
        if self._swings:
            whole = high - low >= 2.0 * math.pi - 4.0 * INSET
            value = min(max(value, low), high)
            if not whole and value >= high - NEAR:
                self._up = False
            elif not whole and value <= low + NEAR:
                self._up = True
            goal = math.inf if self._up else -math.inf
        else:
            assert self._wish is not None
            goal, whole = self._wish, False
        step = SPEED * seconds
        after = value + min(max(goal - value, -step), step)
        if not whole:
            after = min(max(after, low), high)
        stage = self.stage
        assert self._sent is not None
        result = self_motion(stage.robot, self._held, stage.task, self._sent, stage.locked, item.name, after)
        best = result.solutions[0] if result.solutions else None
        if best is None or float(np.abs(best.q - self._sent).max()) > SMOOTH:
            self._up, self._wish = not self._up, None
            return
        self._sent = np.array(best.q)
        self._free = tuple(i._replace(value=after) if i is item else i for i in self._free)
        why = MOVING
        if self._wish is not None and abs(self._wish - after) < NEAR:
            self._wish, why = None, self._arrival
        stage.go(self._sent, why, at_once=True)

    # What is shown

    def _read(self, now: float) -> None:
        """What is free where the arm is heading, and how exactly the tool is held in the picture."""
        stage, robot = self.stage, self.stage.robot
        self._read_at = now
        goal = stage.goal
        key: tuple[object, ...] = (goal.tobytes(), stage.q.tobytes(), stage.task, stage.locked, stage.units)
        if key != self._read_key:
            self._read_key, self._changed = key, now
            self._free = free_values(robot, self._held, stage.task, goal, stage.locked)
            if not any(item.name == self._name for item in self._free):
                self._name = self._free[0].name if self._free else ""
            self._show_controls()
            self._show_numbers()
        item = self._item
        # The ranges of an arm angle belong to the target and the branch; swinging through them changes nothing.
        ends_key: tuple[object, ...] = (
            self._held.tobytes(), stage.task, stage.locked, stage.units,
            None if item is None else (item.name, np.round(item.intervals, 6).tobytes()),
        )  # fmt: skip
        if ends_key == self._ends_key:
            return
        if now - self._changed < QUIET and self._wish is None and not self._swings:
            self._wake(QUIET - (now - self._changed))
            return
        self._ends_key = ends_key
        self._ends = () if item is None else ends(robot, self._held, stage.task, goal, stage.locked, item)
        _tell(self._stops, told.stops_html(robot, self._ends, stage.units) if item is not None else "")
        self._draw_ring()

    def _show_numbers(self) -> None:
        stage, robot, item = self.stage, self.stage.robot, self._item
        if item is None:
            _tell(self._bar, "")
            _tell(self._residual, "")
            self._draw_now()
            return
        low, high = told.bounds(robot, item)
        _tell(self._bar, told.range_html(item, low, high, stage.units))
        if self._slider is not None and self._wish is None:
            value = stage.units.angles.shown(item.value)
            assign(self._slider, min(max(value, self._slider.min), self._slider.max))
        off, turned = told.residual(kin.fk(robot, stage.q), self._held, stage.task)
        elbow = None
        if self._trades:
            elbow = float(np.linalg.norm(told.elbow_of(robot, stage.q) - self._shape, axis=1).max())
        _tell(self._residual, told.residual_html(off, turned, elbow, stage.units))
        self._draw_now()

    @property
    def _trades(self) -> bool:
        return self._name == "theta1" and coaxial(self.stage.robot)

    def _show_controls(self) -> None:
        """Slider, swing and choice, made anew when other values are free."""
        stage = self.stage
        circle = elbow_circle(stage.robot, stage.goal)
        text = told.idea(stage.robot, stage.task, self._free, coaxial(stage.robot), circle is not None)
        _tell(self._idea, _paragraph(text))
        key = (stage.robot.id, stage.units, self._name, *(item.name for item in self._free))
        if key == self._control_key:
            return
        self._control_key = key
        for control in self._controls:
            control.remove()
        self._controls, self._slider = [], None
        item = self._item
        if item is None:
            return
        gui, unit = stage.client.gui, stage.units.angles
        low, high = (unit.shown(x) for x in told.bounds(stage.robot, item))
        with self._controls_place:
            if len(self._free) > 1:
                labels = tuple(i.label for i in self._free)
                choice = gui.add_dropdown("Free value", labels, initial_value=item.label, hint=CHOICE_HINT)
                listen(choice, self.post, "choice")
                self._controls.append(choice)
            self._swing = gui.add_checkbox("Swing", self._swings, hint=SWING_HINT)
            listen(self._swing, self.post, "swing")
            self._slider = gui.add_slider(
f"Swing {item.label.split()[-1]} to",
                min=low, max=high, step=unit.step(1),
                initial_value=min(max(unit.shown(item.value), low), high), hint=SLIDER_HINT,
            )  # fmt: skip
            listen(self._slider, self.post, ("value", item.name, stage.units))
        self._controls += [self._swing, self._slider]

    def _show_swing(self) -> None:
        if self._slider is not None and self._swing.value != self._swings:
            assign(self._swing, self._swings)

    # The drawing

    def _draw_new(self) -> None:
        """Nodes for the arm on show; hidden until there is something to see."""
        scene, size = self.stage.client.scene, body(self.stage.robot).size
        root = f"/{self.key}-{next(_NUMBERS)}"
        self._top = scene.add_frame(root, show_axes=False)
        none = np.zeros((1, 2, 3), np.float32)
        self._line = scene.add_line_segments(
            f"{root}/line", none, LINE, thickness=1.5, thickness_units="screen", visible=False
        )
        self._circle = scene.add_line_segments(
            f"{root}/elbow", none, ELBOW, thickness=2.0, thickness_units="screen", visible=False
        )
        self._pointer = scene.add_line_segments(f"{root}/now", none, NOW, thickness=0.28 * size, visible=False)
        # One node for each colour: the browser shows colours given per point brighter.
        self._trade = [
            scene.add_line_segments(f"{root}/trade-{i}", none, color, thickness=width * size, visible=False)
            for i, (color, width) in enumerate(((JOINT_COLORS[0], 0.35), (JOINT_COLORS[1], 0.35), (LINE, 0.15)))
        ]
        self._ring: list[viser.SceneNodeHandle] = []
        self._root = root

    def _draw_ring(self) -> None:
        """Feasible and blocked arcs, and the stops; they change with the target, not with the swing."""
        for node in self._ring:
            node.remove()
        self._ring = []
        stage, item = self.stage, self._item
        circle = elbow_circle(stage.robot, stage.goal)
        size = body(stage.robot).size
        if item is None or item.name != "psi" or circle is None or circle.radius < max(FLAT, THIN * size):
            return
        scene, number = stage.client.scene, next(_NUMBERS)
        chords, inside = arc_segments(circle, item.intervals, RING)
        for kind, rows, color, width in (
            ("feasible", inside, FEASIBLE, 0.5),
            ("blocked", np.logical_not(inside), BLOCKED, 0.25),
        ):
            if rows.any():
                arcs = chords[rows].astype(np.float32)
                name = f"{self._root}/{kind}-{number}"
                self._ring.append(scene.add_line_segments(name, arcs, color, thickness=width * size))
        for i, end in enumerate(self._ends):
            ray = np.array([[circle.at(end.value, RING - 0.12), circle.at(end.value, RING + 0.18)]], np.float32)
            text = f"stop of joint {end.joint + 1}" if end.joint >= 0 else "branch ends"
            self._ring.append(
                scene.add_line_segments(f"{self._root}/stop-{number}-{i}", ray, STOP, thickness=0.4 * size)
            )
            self._ring.append(
                scene.add_label(
                    f"{self._root}/stop-name-{number}-{i}", text, position=circle.at(end.value, RING + 0.3)
                )
            )

    def _draw_now(self) -> None:
        """Where the arm is: the line from shoulder to wrist, the elbow on its circle, or the trade."""
        stage, robot = self.stage, self.stage.robot
        size = body(robot).size
        circle = elbow_circle(robot, stage.q) if self._name == "psi" else None
        there = circle is not None and circle.radius > max(FLAT, THIN * size)
        for node in (self._line, self._circle, self._pointer):
            if node.visible != there:
                node.visible = there
        if there and circle is not None:
            item = self._item
            _points(self._line, np.array([[circle.shoulder, circle.wrist]]))
            _points(self._circle, arc_segments(circle, (), 1.0)[0])
            value = item.value if item is not None else 0.0
            _points(self._pointer, np.array([[circle.center, circle.at(value, RING + 0.1)]]))
        for node in self._trade:
            if node.visible != self._trades:
                node.visible = self._trades
        if self._trades:
            chords, joints = trade_segments(robot, stage.q, TRADE_RADIUS * size)
            for i, node in enumerate(self._trade):
                _points(node, chords[joints == i])


def _paragraph(text: str) -> str:
    return f'<p data-idea style="margin:0 1em .6em;font-size:.82em;line-height:1.4">{text}</p>'


def _tell(handle: viser.GuiHtmlHandle, content: str) -> None:
    if handle.content != content:
        handle.content = content


def _points(node: viser.LineSegmentsHandle, points: Array) -> None:
    found = points.astype(np.float32)
    if found.shape != node.points.shape or not np.array_equal(found, node.points):
        node.points = found
