"""The lesson "Redundancy": motions of the arm while the tool stays in place.

A slider, or a continuous sweep, takes the redundancy parameter through its range. Each frame shows a configuration
that was solved for, never an interpolated one, so the tool is held exactly; the residual shows it. For an arm with
spherical shoulder and wrist, the feasible arm angles form a ring about the line from shoulder to wrist. For an arm
whose joints 1 and 2 are coaxial, the drawing shows that only these two joints turn against each other. Where the
core has no redundancy parameter, a joint of the null space leads and the others follow numerically.
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
from app.viewer.feature import Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.redundancy import views
from app.viewer.lessons.redundancy.drawing import Drawing
from app.viewer.lessons.redundancy.questions import outline
from app.viewer.lessons.redundancy.ring import coaxial, elbow_circle
from app.viewer.panel import assign, listen, update_html
from app.viewer.panel.fields import limit_marks
from app.viewer.panel.posture import on_side_of
from app.viewer.panel.status import Notice
from app.viewer.self_motion import INSET, SMOOTH, End, ends, leaders, range_of, redundancy_at, self_motion
from kin import IKResult, InputError, Redundancy
from kin.differential.null_space import lead, within
from kin.transforms import Array
from kin.units import Units
from kin.warmup import ALL

FRAME = 1 / 30
READ_INTERVAL = 0.05
QUIET = 0.2  # seconds at rest before the joint limits at the ends of the range are determined
SPEED = 0.9  # rad/s of the redundancy parameter
NEAR = 1e-9  # rad
SLIDER_HINT = "Moves the arm while the tool stays where it is"
SWEEP_HINT = "Moves back and forth between the ends of the range"
CHOICE_HINT = "The redundancy parameter to change"
MOVING = Notice("reached", "Self-motion", "The arm moves, the tool does not.")
BLOCKED = Notice(
    "limits", "The self-motion ends here", "A joint is at its limit, or the joint cannot lead further."
)
_NUMBERS = count(1)


class RedundancyLesson(Lesson):
    """See the module."""

    key = "redundancy"
    title = "Redundancy"
    kernels = (ALL,)
    about = "How seven joints move while the tool stays where it is."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._name = ""  # of the parameter that is changed
        self._target: float | None = None  # value the slider was set to
        self._sweeps = False
        self._up = True
        self._arrival = MOVING  # the notice on arrival at the target value
        self._sent: Array | None = None  # the configuration this lesson requested last
        self._parameters: tuple[Redundancy, ...] = ()
        self._numeric = False  # whether they are joints of the numeric null space
        self._ends: tuple[End, ...] = ()
        self._ends_key: tuple[object, ...] = ()
        self._control_key: tuple[object, ...] = ()
        self._read_key: tuple[object, ...] = ()
        self._stepped = self._read_at = self._changed = 0.0
        self._slider: viser.GuiSliderHandle[float] | None = None
        self._T_held: Array
        self._shape: Array  # origins of the links' frames when the tool was last released
        gui = stage.client.gui
        with gui.add_folder(None) as self._container:
            self._idea = gui.add_html("")
            with gui.add_folder(None) as self._controls_container:
                pass
            self._bar = gui.add_html("")
            self._limits = gui.add_html("")
            self._residual = gui.add_html("")
        self._controls: list[Any] = []
        self._hold()
        self._drawing = self._new_drawing()
        self._wake()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("value", str(name), Units() as units):
                if name == self._name and units == self.stage.units:
                    if not isinstance(value, int | float) or not math.isfinite(value):
                        raise InputError(name, value, "a finite number")
                    self._sweeps = False
                    self._show_sweep()
                    self._target = self._bounded(units.angles.read(float(value)))
                    self._wake()
            case "sweep":
                self._sweeps, self._target = bool(value), None
                self._wake()
            case "choice":
                chosen = next((item for item in self._parameters if item.label == value), None)
                if chosen is None:
                    labels = ", ".join(item.label for item in self._parameters)
                    raise InputError("redundancy parameter", value, f"one of {labels}")
                self._name, self._target = chosen.name, None
                self._refresh()
            case _:
                raise InputError("redundancy", key, "a control of this lesson")

    def on_robot(self) -> None:
        self._name, self._target, self._sweeps, self._sent = "", None, False, None
        self._drawing.remove()
        self._drawing = self._new_drawing()
        self._refresh()

    def on_pose(self, T_base_tool: Array) -> None:
        self._wake()

    def on_result(self, result: IKResult) -> None:
        # The visitor has set a target, which has priority over the self-motion.
        self._stop()
        self._wake()

    def on_request(self) -> None:
        self._target = None
        self._refresh()

    def on_style(self) -> None:
        self._refresh()

    def tick(self, now: float) -> None:
        self.due = None
        if self._sent is None or not np.array_equal(self._sent, self.stage.now.goal):
            if self._sent is not None:
                self._stop()
            self._hold()
        if self._target is not None or self._sweeps:
            wait = FRAME - (now - self._stepped)
            if wait <= 0.0:
                self._step(min(now - self._stepped, 2.0 * FRAME))
                self._stepped = now
                wait = FRAME
            self._wake(wait)
        if now - self._read_at >= READ_INTERVAL:
            self._update(now)
        else:
            self._wake(READ_INTERVAL - (now - self._read_at))

    def state(self) -> dict[str, object]:
        # The keys are part of shared URLs.
        return {"free": self._name, "swing": self._sweeps}

    def restore(self, state: dict[str, object]) -> None:
        name, sweeps = state.get("free"), state.get("swing")
        self._update(time.perf_counter())
        if isinstance(name, str) and any(item.name == name for item in self._parameters):
            self._name = name
        if isinstance(sweeps, bool):
            self._sweeps = sweeps and bool(self._parameters)
        self._refresh()

    def remove(self) -> None:
        self._drawing.remove()
        self._container.remove()

    def _wake(self, seconds: float = 0.0) -> None:
        self.due = seconds if self.due is None else min(self.due, seconds)

    def _refresh(self) -> None:
        """Recompute and show everything at the next tick."""
        self._read_key, self._ends_key, self._control_key = (), (), ()
        self._wake()

    # The motion

    @property
    def _item(self) -> Redundancy | None:
        return next((item for item in self._parameters if item.name == self._name), None)

    def _hold(self) -> None:
        """Hold the tool where the arm is heading, from now on."""
        arm = self.stage.now
        self._sent = arm.goal.copy()
        self._T_held = kin.fk(arm.robot, self._sent)
        self._shape = views.frame_origins(arm.robot, self._sent)

    def _stop(self) -> None:
        self._target, self._sweeps = None, False
        self._show_sweep()

    def _range(self) -> tuple[float, float] | None:
        item = self._item
        found = None if item is None else range_of(item)
        if found is None or found[1] - found[0] < 4.0 * INSET:
            return None
        return found[0] + INSET, found[1] - INSET

    def _bounded(self, requested: float) -> float | None:
        """The feasible value nearest to the requested one; if they differ, the notice on arrival says so."""
        self._arrival = MOVING
        found = self._range()
        if found is None:
            return None
        low, high = found
        turn = 2.0 * math.pi
        periodic = high > math.pi or low < -math.pi
        images = [requested + k * turn for k in (-1, 0, 1)] if periodic else [requested]
        nearest = min((min(max(x, low), high) for x in images), key=lambda v: min(abs(v - x) for x in images))
        if min(abs(nearest - x) for x in images) > 1e-3:
            end = next((e for e in self._ends if abs(e.value - nearest) < 1e-3), None)
            reason = (
                "The posture ends here"
                if end is None or end.joint < 0
                else f"Joint {end.joint + 1} is at its limit"
            )
            self._arrival = Notice("limits", "End of the range", f"{reason}: no self-motion leads further.")
        return nearest

    def _step(self, seconds: float) -> None:
        """Move towards the target value, as far as the speed allows."""
        item, found = self._item, self._range()
        if item is None or found is None:
            self._stop()
            return
        low, high = found
        value, whole = item.value, False
        if self._sweeps:
            whole = high - low >= 2.0 * math.pi - 4.0 * INSET
            value = min(max(value, low), high)
            if not whole and value >= high - NEAR:
                self._up = False
            elif not whole and value <= low + NEAR:
                self._up = True
            goal = math.inf if self._up else -math.inf
        else:
            assert self._target is not None
            goal = self._target
        step = SPEED * seconds
        after = value + min(max(goal - value, -step), step)
        if not whole:
            after = min(max(after, low), high)
        self._move(item, after)

    def _move(self, item: Redundancy, value: float) -> None:
        """Move the arm to a value of the parameter, unless a joint would jump."""
        stage = self.stage
        assert self._sent is not None
        q = self._led(item, value) if self._numeric else self._solved(item, value)
        if q is None or float(np.abs(q - self._sent).max()) > SMOOTH:
            if self._numeric and self._target is not None:
                stage.notify(BLOCKED)
            self._up, self._target = not self._up, None
            return
        self._sent = q
        if self._numeric:
            value = float(q[int(item.name.removeprefix("theta")) - 1])
        self._parameters = tuple(i._replace(value=value) if i is item else i for i in self._parameters)
        notice = MOVING
        if self._target is not None and abs(self._target - value) < NEAR:
            self._target, notice = None, self._arrival
        stage.move_to(self._sent, notice, at_once=True)

    def _solved(self, item: Redundancy, value: float) -> Array | None:
        """The configuration for a value of an exact parameter."""
        stage = self.stage
        assert self._sent is not None
        result = self_motion(stage.now.robot, self._T_held, stage.now.options, self._sent, item.name, value)
        return np.array(result.solutions[0].q) if result.solutions else None

    def _led(self, item: Redundancy, value: float) -> Array | None:
        """The configuration near the present one in which a joint of the null space has a value."""
        arm = self.stage.now
        joint = int(item.name.removeprefix("theta")) - 1
        assert self._sent is not None
        near = within(arm.robot, self._sent, arm.task, joint, value, self._locked())
        return lead(arm.robot, self._sent, self._T_held, arm.task, joint, near, self._locked())

    def _locked(self) -> tuple[int, ...]:
        locked = self.stage.now.options.constraints.locked or ()
        return tuple(i for i, value in enumerate(locked) if value is not None)

    # What is shown

    def _update(self, now: float) -> None:
        """Update the parameters at the goal, and the residual of the tool in the scene."""
        stage, robot = self.stage, self.stage.now.robot
        self._read_at = now
        goal = stage.now.goal
        constraints = stage.now.options.constraints
        key: tuple[object, ...] = (goal.tobytes(), stage.now.q.tobytes(), stage.now.task, constraints, stage.units)
        if key != self._read_key:
            self._read_key, self._changed = key, now
            self._parameters = redundancy_at(robot, self._T_held, stage.now.options, goal)
            self._numeric = not self._parameters
            if self._numeric:
                self._parameters = leaders(robot, goal, stage.now.task, self._locked())
            if not any(item.name == self._name for item in self._parameters):
                self._name = self._parameters[0].name if self._parameters else ""
            self._show_controls()
            self._show_numbers()
        item = self._item
        # The ranges of an arm angle depend on the target and the branch; they are constant during a self-motion.
        ends_key: tuple[object, ...] = (
            self._T_held.tobytes(), stage.now.task, constraints, stage.units,
            None if item is None else (item.name, np.round(item.intervals, 6).tobytes()),
        )  # fmt: skip
        if ends_key == self._ends_key:
            return
        if now - self._changed < QUIET and self._target is None and not self._sweeps:
            self._wake(QUIET - (now - self._changed))
            return
        self._ends_key = ends_key
        exact = None if self._numeric else item
        self._ends = () if exact is None else ends(robot, self._T_held, stage.now.options, goal, exact)
        update_html(self._limits, "" if exact is None else views.limits_html(robot, self._ends, stage.units))
        shown = exact if stage.now.task == "pose" or (exact is not None and exact.name == "psi") else None
        self._drawing.show_ring(goal, self._T_held, shown, self._ends)

    def _show_numbers(self) -> None:
        arm = self.stage.now
        stage, robot, item = self.stage, arm.robot, self._item
        self._drawing.show_present(arm.q, item, self._trades)
        if item is None:
            update_html(self._bar, "")
            update_html(self._residual, "")
            return
        if self._slider is not None:
            item = on_side_of(self._slider.value, item, stage.units.angles)
        update_html(self._bar, "" if self._numeric else views.range_html(robot, item, stage.units))
        if self._slider is not None and self._target is None:
            value = stage.units.angles.shown(item.value)
            assign(self._slider, min(max(value, self._slider.min), self._slider.max))
        position, rotation = views.residual(kin.fk(robot, arm.q), self._T_held, arm.task)
        elbow = None
        if self._trades:
            moved = views.frame_origins(robot, arm.q) - self._shape
            elbow = float(np.linalg.norm(moved, axis=1).max())
        update_html(self._residual, views.residual_html(position, rotation, elbow, stage.units))

    @property
    def _trades(self) -> bool:
        """Whether the parameter only turns two coaxial joints against each other."""
        return self._name == "theta1" and not self._numeric and coaxial(self.stage.now.robot)

    def _show_controls(self) -> None:
        """Slider, sweep and choice; rebuilt when the parameters change."""
        arm = self.stage.now
        stage = self.stage
        circle = elbow_circle(arm.robot, arm.goal)
        exact = () if self._numeric else self._parameters
        idea = views.idea(arm.robot, arm.task, exact, coaxial(arm.robot), circle is not None)
        if self._numeric and self._parameters:
            idea = views.numeric_idea(arm.robot, arm.task, self._locked())
        update_html(self._idea, views.idea_html(idea))
        key = (arm.robot.id, stage.units, self._name, *(item.name for item in self._parameters))
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
        low, high = (unit.shown(x) for x in views.bounds(arm.robot, item))
        with self._controls_container:
            if len(self._parameters) > 1:
                labels = tuple(i.label for i in self._parameters)
                choice = gui.add_dropdown("Parameter", labels, initial_value=item.label, hint=CHOICE_HINT)
                listen(choice, self.post, "choice")
                self._controls.append(choice)
            self._sweep = gui.add_checkbox("Sweep", self._sweeps, hint=SWEEP_HINT)
            listen(self._sweep, self.post, "sweep")
            self._slider = gui.add_slider(
                f"Set {item.label.split()[-1]} (tool held)", min=low, max=high, step=unit.step(1),
                marks=limit_marks(low, high),
                initial_value=min(max(unit.shown(item.value), low), high), hint=SLIDER_HINT,
            )  # fmt: skip
            listen(self._slider, self.post, ("value", item.name, stage.units))
        self._controls += [self._sweep, self._slider]

    def _show_sweep(self) -> None:
        if self._slider is not None and self._sweep.value != self._sweeps:
            assign(self._sweep, self._sweeps)

    def _new_drawing(self) -> Drawing:
        return Drawing(self.stage.client.scene, self.stage.now.robot, f"/{self.key}-{next(_NUMBERS)}")
