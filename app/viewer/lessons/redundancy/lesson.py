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

from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Control, Html, Node
from app.viewer.declared.scene import Lazy
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Sweep, Work
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.redundancy import views
from app.viewer.lessons.redundancy.drawing import scene
from app.viewer.lessons.redundancy.facts import RedundancyFacts
from app.viewer.lessons.redundancy.questions import facts
from app.viewer.lessons.redundancy.ring import Ring
from app.viewer.lessons.redundancy.settings import MOVING, RedundancySettings
from app.viewer.null_space import lead, within
from app.viewer.panel.posture import on_side_of
from app.viewer.panel.status import Notice
from app.viewer.self_motion import INSET, SMOOTH, circular, ends, range_of, self_motion
from kin import IKResult
from kin.ik import Redundancy
from kin.transforms import Array

FRAME = 1 / 30
QUIET = 0.2  # seconds at rest before the joint limits at the ends of the range are determined
SPEED = 0.9  # rad/s of the redundancy parameter
NEAR = 1e-9  # rad
TURN = 2.0 * math.pi
BLOCKED = Notice(
    "limits", "The self-motion ends here", "A joint is at its limit, or the joint cannot lead further."
)


class RedundancyLesson(DeclaredFeature[RedundancySettings, RedundancyFacts], Lesson):
    """See the module."""

    key = "redundancy"
    title = "Redundancy"
    about = "How seven joints move while the tool stays where it is."
    asked_of = staticmethod(facts)
    settings_of, facts_of = RedundancySettings, RedundancyFacts

    # What is shown

    def panel(self) -> Sequence[Node]:
        f, item, units = self.read, self.read.item, self.stage.display.units
        nodes = [*self.unless_asked("null space", Html(views.idea_html, (f.idea,)))]
        if item is not None:
            nodes += self._controls(item)
            item = self._on_side(item)
        bar = () if item is None or f.numeric else (Html(views.range_html, (f.robot, item, units)),)
        nodes += bar
        if f.ring is not None and item is not None and not f.numeric:
            nodes.append(Html(views.limits_html, (f.robot, f.ring.ends, units), key="limits"))
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
        value = self._on_side(item).value if self.settings.target is None else self.settings.target
        spec = replace(self.spec("value"), limits=range_, slider=range_)
        label = f"Set {item.label.split()[-1]} (tool held)"
        of = (f.robot.id, item.name, names)
        return [*nodes, Control("value", label=label, spec=spec, value=value, of=of)]

    def scene(self) -> Sequence[SceneNode | Lazy]:
        return scene(self.read)

    def restore(self, state: dict[str, object]) -> None:
        self.change(held=None, target=None)  # a sweep that is asked for begins where the arm is then
        super().restore(state)

    def state(self) -> dict[str, object]:
        return {**super().state(), "free": "" if self.read.item is None else self.read.item.name}

    # Events

    def changed(self, path: str) -> None:
        self.change(held=self.facts.held, target=None)
        if path == "value":
            self.change(swing=False)
            self._approach(self.settings.value)

    def on_result(self, result: IKResult) -> None:
        # The visitor has set a target, which has priority over the self-motion.
        self.change(swing=False, target=None)
        if self.read.item is not None:
            self.change(side=self._on_side(self.read.item).value)
        self.catch_up()

    def on_request(self) -> None:
        self.change(target=None)
        self.catch_up()

    # The ends of the ranges

    def running(self) -> Sequence[Work | Sweep]:
        f, s, item = self.read, self.settings, self.read.item
        values = None if item is None else (item.name, np.round(item.intervals, 6))
        # The ranges of an arm angle depend on the target and the branch; they are constant during a self-motion.
        depends = f.held.T, f.arm.task, f.arm.options.constraints, values
        found: list[Work | Sweep] = [Work("ring", lambda *_: self._ring(f), depends, rest=QUIET, keep=True)]
        if s.swing or s.target is not None:
            found.append(Sweep(self._step, FRAME))
        return found

    @staticmethod
    def _ring(f: RedundancyFacts) -> Ring:
        exact = None if f.numeric else f.item
        found = () if exact is None else ends(f.robot, f.held.T, f.arm.options, f.arm.goal, exact)
        shown = exact if f.arm.task == "pose" or (exact is not None and exact.name == "psi") else None
        return Ring(f.robot, f.arm.goal, f.held.T, shown, found)

    # The motion

    def _on_side(self, item: Redundancy) -> Redundancy:
        return on_side_of(self.settings.side, item, self.stage.display.units.angles)

    def _range(self) -> tuple[float, float] | None:
        found = None if self.facts.item is None else range_of(self.facts.item)
        if found is None or found[1] - found[0] < 4.0 * INSET:
            return None
        return found[0] + INSET, found[1] - INSET

    def _approach(self, requested: float) -> None:
        """Go to the feasible value nearest to the requested one; if they differ, the notice on arrival says so."""
        if (found := self._range()) is None:
            return
        low, high = found
        images = [requested + k * TURN for k in (-1, 0, 1)] if high > math.pi or low < -math.pi else [requested]
        nearest = min((min(max(x, low), high) for x in images), key=lambda v: min(abs(v - x) for x in images))
        arrival = MOVING
        if min(abs(nearest - x) for x in images) > 1e-3:
            known = self._ring(self.facts).ends  # the drawn ones may be of another target
            end = next((e for e in known if abs(e.value - nearest) < 1e-3), None)
            reason = (
                "The posture ends here"
                if end is None or end.joint < 0
                else f"Joint {end.joint + 1} is at its limit"
            )
            arrival = Notice("limits", "End of the range", f"{reason}: no self-motion leads further.")
        self.change(target=nearest, arrival=arrival)

    def _step(self, seconds: float) -> None:
        """Move towards the target value, as far as the speed allows."""
        f, s, item, found = self.facts, self.settings, self.facts.item, self._range()
        if item is None or found is None or (s.held is not None and not f.is_held):
            self.change(swing=False, target=None)
            return
        low, high = found
        value, whole = item.value, False
        if s.target is None:
            whole = high - low >= TURN - 4.0 * INSET
            value = min(max(value, low), high)
            if not whole and value >= high - NEAR:
                self.change(up=False)
            elif not whole and value <= low + NEAR:
                self.change(up=True)
            goal = math.inf if self.settings.up else -math.inf
        else:  # the range may be given a turn further on since the target was set
            images = [s.target + k * TURN for k in (0, -1, 1)] if circular(item) else [s.target]
            goal = min(images, key=lambda x: max(low - x, x - high, 0.0))
        step = SPEED * seconds
        after = value + min(max(goal - value, -step), step)
        self._move(item, after if whole else min(max(after, low), high), goal)

    def _move(self, item: Redundancy, value: float, goal: float) -> None:
        """Move the arm to a value of the parameter, unless a joint would jump."""
        f, s = self.facts, self.settings
        q = self._led(item, value) if f.numeric else self._solved(item, value)
        if q is None or float(np.abs(q - f.held.q).max()) > SMOOTH:
            if f.numeric and s.target is not None:
                self.stage.status.show(BLOCKED)
            self.change(up=not s.up, target=None)
            return
        if f.numeric:
            value = float(q[int(item.name.removeprefix("theta")) - 1])
        arrived = abs(goal - value) < NEAR
        notice = s.arrival if arrived else MOVING
        self.change(held=replace(f.held, q=q), target=None if arrived else s.target, side=value)
        self.stage.arm.move_to(q, notice, at_once=True)

    def _solved(self, item: Redundancy, value: float) -> Array | None:
        """The configuration for a value of an exact parameter."""
        arm, held = self.stage.arm.now, self.facts.held
        result = self_motion(arm.robot, held.T, arm.options, held.q, item.name, value)
        return np.array(result.solutions[0].q) if result.solutions else None

    def _led(self, item: Redundancy, value: float) -> Array | None:
        """The configuration near the present one in which a joint of the null space has a value."""
        arm, held, locked = self.stage.arm.now, self.facts.held, self.facts.locked
        joint = int(item.name.removeprefix("theta")) - 1
        near = within(arm.robot, held.q, arm.task, joint, value, locked)
        return lead(arm.robot, held.q, held.T, arm.task, joint, near, locked)
