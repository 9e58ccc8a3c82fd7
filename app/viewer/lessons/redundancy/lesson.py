"""The lesson "Redundancy": motions of the arm while the tool stays in place.

A slider, or a continuous sweep, takes the redundancy parameter through its range. Each frame shows a configuration
that was solved for, never an interpolated one, so the tool is held exactly; the residual shows it. For an arm with
spherical shoulder and wrist, the feasible arm angles form a ring about the line from shoulder to wrist. If joints
1 and 2 of the arm are coaxial, the drawing shows that only these two turn, against each other. Where the core has
no redundancy parameter, a joint of the null space leads and the others follow numerically.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import kin
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Control, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.redundancy import views
from app.viewer.lessons.redundancy.drawing import Ring, scene
from app.viewer.lessons.redundancy.facts import RedundancyFacts
from app.viewer.lessons.redundancy.questions import outline
from app.viewer.lessons.redundancy.settings import RedundancySettings
from app.viewer.panel.posture import on_side_of
from app.viewer.panel.status import Notice
from app.viewer.self_motion import INSET, SMOOTH, End, ends, range_of, self_motion
from kin import IKResult
from kin.differential.null_space import lead, within
from kin.ik import Redundancy
from kin.transforms import Array
from kin.warmup import ALL

FRAME = 1 / 30
QUIET = 0.2  # seconds at rest before the joint limits at the ends of the range are determined
SPEED = 0.9  # rad/s of the redundancy parameter
NEAR = 1e-9  # rad
MOVING = Notice("reached", "Self-motion", "The arm moves, the tool does not.")
BLOCKED = Notice(
    "limits", "The self-motion ends here", "A joint is at its limit, or the joint cannot lead further."
)


class RedundancyLesson(DeclaredFeature[RedundancySettings, RedundancyFacts], Lesson):
    """See the module."""

    key = "redundancy"
    title = "Redundancy"
    kernels = (ALL,)
    about = "How seven joints move while the tool stays where it is."
    outline = staticmethod(outline)
    settings_of, facts_of = RedundancySettings, RedundancyFacts

    def started(self) -> None:
        self._target: float | None = None  # value the slider was set to
        self._up = True
        self._arrival = MOVING  # the notice on arrival at the target value
        self._item: Redundancy | None = None  # the parameter that is changed, at the configuration sent last
        self._side = 0.0  # on which side of zero the slider shows half a turn
        self._ring: Ring | None = None
        self._ends_key: tuple[object, ...] = ()
        self._stepped = self._changed = 0.0
        self._hold()

    def compute_facts(self) -> RedundancyFacts:
        arm = self.stage.now
        if not np.array_equal(self._sent, arm.goal):  # something else has moved the arm
            self._stop()
            self._hold()
        return RedundancyFacts(self.settings, arm, self._T_held, self._shape)

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, item, units = self.read, self.read.item, self.stage.units
        nodes = [*self.unless_asked("null space", Html(views.idea_html, (f.idea,)))]
        if item is not None:
            nodes += self._controls(item)
            item = on_side_of(self._side, item, units.angles)
        bar = () if item is None or f.numeric else (Html(views.range_html, (f.robot, item, units)),)
        nodes += bar
        if self._ring is not None and self._exact(f) is not None:
            nodes.append(Html(views.limits_html, (f.robot, self._ring.ends, units), key="limits"))
        if item is not None:
            nodes.append(Html(views.residual_html, (*f.residual, f.moved, units), key="residual"))
        return nodes

    def _controls(self, item: Redundancy) -> list[Node]:
        f, nodes = self.read, []
        names = tuple(one.name for one in f.parameters)
        if len(f.parameters) > 1:
            options = {one.label: one.name for one in f.parameters}
            spec = replace(self.spec("free"), options=options)
            nodes.append(Control("free", spec=spec, value=item.name, of=(f.robot.id, names)))
        nodes.append(Control("swing"))
        range_ = views.bounds(f.robot, item)
        value = (
            on_side_of(self._side, item, self.stage.units.angles).value if self._target is None else self._target
        )
        self._side = self.stage.units.angles.shown(min(max(value, range_[0]), range_[1]))
        spec = replace(self.spec("value"), limits=range_, slider=range_)
        label = f"Set {item.label.split()[-1]} (tool held)"
        of = (f.robot.id, item.name, names)
        return [*nodes, Control("value", label=label, spec=spec, value=value, of=of)]

    def scene(self) -> Sequence[SceneNode | Lazy]:
        return scene(self.read, self._ring)

    def refresh(self) -> None:
        before = getattr(self, "read", None)
        super().refresh()
        self._item = self.read.item
        if self.read is not before:
            self._changed = self.shown_at
            self.schedule(QUIET)

    def restore(self, state: dict[str, object]) -> None:
        if not np.array_equal(self._sent, self.stage.now.goal):
            self._stop()
            self._hold()  # first, or a sweep that is asked for would end at once
        super().restore(state)

    def state(self) -> dict[str, object]:
        return {**super().state(), "free": "" if self.read.item is None else self.read.item.name}

    @staticmethod
    def _exact(facts: RedundancyFacts) -> Redundancy | None:
        return None if facts.numeric else facts.item

    def _show_ends(self, now: float, moving: bool) -> float | None:
        """Determine the ends of the ranges; returns in how many seconds, if not yet.

        The ranges of an arm angle depend on the target and the branch; they are constant during a self-motion.
        """
        f, item = self.read, self.read.item
        key: tuple[object, ...] = (
            f.T_held.tobytes(),
            f.arm.task,
            f.arm.options.constraints,
            None if item is None else (item.name, np.round(item.intervals, 6).tobytes()),
        )
        if key == self._ends_key:
            return None
        if not moving and (wait := QUIET - (now - self._changed)) > 0.0:
            return wait
        self._ends_key = key
        exact = self._exact(f)
        found = () if exact is None else ends(f.robot, f.T_held, f.arm.options, f.arm.goal, exact)
        shown = exact if f.arm.task == "pose" or (exact is not None and exact.name == "psi") else None
        self._ring = Ring(f.robot, f.arm.goal, f.T_held, shown, found)
        self.schedule()
        return None

    # Events

    def changed(self, path: str) -> None:
        self._target = None
        if path == "value":
            self.change(swing=False)
            self._target = self._bounded(self.settings.value)

    def on_result(self, result: IKResult) -> None:
        # The visitor has set a target, which has priority over the self-motion.
        self._stop()
        self.schedule()

    def on_request(self) -> None:
        self._target = None
        self.schedule()

    # The motion

    def advance(self, now: float) -> float | None:
        self.invalidate()
        again = None
        if moving := self._target is not None or self.settings.swing:
            again = FRAME - (now - self._stepped)
            if again <= 0.0:
                self._step(min(now - self._stepped, 2.0 * FRAME))
                self._stepped, again = now, FRAME
        wait = self._show_ends(now, moving)
        return min((x for x in (again, wait) if x is not None), default=None)

    def _hold(self) -> None:
        """Hold the tool where the arm is heading, from now on."""
        arm = self.stage.now
        self._sent = arm.goal.copy()
        self._T_held = kin.fk(arm.robot, self._sent)
        self._shape = views.frame_origins(arm.robot, self._sent)

    def _stop(self) -> None:
        self._target = None
        self.change(swing=False)

    def _range(self) -> tuple[float, float] | None:
        found = None if self._item is None else range_of(self._item)
        if found is None or found[1] - found[0] < 4.0 * INSET:
            return None
        return found[0] + INSET, found[1] - INSET

    @property
    def _ends(self) -> tuple[End, ...]:
        return () if self._ring is None else self._ring.ends

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
            self.schedule()
            return
        low, high = found
        value, whole = item.value, False
        if self.settings.swing:
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
        stage, numeric = self.stage, self.read.numeric
        q = self._led(item, value) if numeric else self._solved(item, value)
        if q is None or float(np.abs(q - self._sent).max()) > SMOOTH:
            if numeric and self._target is not None:
                stage.notify(BLOCKED)
            self._up, self._target = not self._up, None
            self.schedule()
            return
        self._sent = q
        if numeric:
            value = float(q[int(item.name.removeprefix("theta")) - 1])
        self._item = item._replace(value=value)
        notice = MOVING
        if self._target is not None and abs(self._target - value) < NEAR:
            self._target, notice = None, self._arrival
        stage.move_to(self._sent, notice, at_once=True)

    def _solved(self, item: Redundancy, value: float) -> Array | None:
        """The configuration for a value of an exact parameter."""
        arm = self.stage.now
        result = self_motion(arm.robot, self._T_held, arm.options, self._sent, item.name, value)
        return np.array(result.solutions[0].q) if result.solutions else None

    def _led(self, item: Redundancy, value: float) -> Array | None:
        """The configuration near the present one in which a joint of the null space has a value."""
        arm, locked = self.stage.now, self.read.locked
        joint = int(item.name.removeprefix("theta")) - 1
        near = within(arm.robot, self._sent, arm.task, joint, value, locked)
        return lead(arm.robot, self._sent, self._T_held, arm.task, joint, near, locked)
