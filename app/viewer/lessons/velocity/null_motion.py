"""The null space in the lesson "Velocity": q̇ = J⁺v + (I − J⁺J) z, in numbers and as a motion of the arm."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.velocity import section_views as views
from app.viewer.lessons.velocity.along import controllable
from app.viewer.panel import assign, listen, update_html
from app.viewer.panel.status import Notice
from kin import InputError
from kin.differential.null_space import Goal, hold, margin, measure, null_space, secondary
from kin.transforms import Array

GOALS: dict[str, Goal] = {"Away from limits": "limits", "Higher manipulability": "manipulability"}
SPEED = 0.05  # m/s of the tool
SPEEDS: dict[str, Array] = {
    "At rest": np.zeros(3),
    **{
        f"{sign}{axis} of the base": way * SPEED * np.eye(3)[i]
        for i, axis in enumerate("xyz")
        for sign, way in (("+", 1.0), ("−", -1.0))
    },
}
FRAME = 1 / 30  # s
FASTEST = 0.5  # rad/s or m/s of the quickest joint of the self-motion
STILL = 1e-3  # of z in the null space: the goal is as good as it gets
GOAL_HINT = "z: the joint speeds of the secondary goal, before what would move the tool is taken away"
SPEED_HINT = "v: the velocity of the tool, 50 mm/s"
RUN_HINT = "Moves the arm with these joint speeds, until a limit or the best place is reached"
MOVING = Notice("reached", "Null space", "The joints move; the tool does only what v says.")


class NullMotion:
    """The section: its controls, its numbers, and the motion. Events come back to `handle`, by their name."""

    def __init__(self, stage: Stage, post: Callable[[Hashable, object], None]) -> None:
        self._stage = stage
        self._goal, self._speed = next(iter(GOALS)), next(iter(SPEEDS))
        self._runs = False
        self._sent: Array | None = None
        self._T = np.eye(4)
        self._stepped = 0.0
        gui = stage.client.gui
        self._goals = gui.add_dropdown("Secondary goal", tuple(GOALS), initial_value=self._goal, hint=GOAL_HINT)
        listen(self._goals, post, ("null", "goal"))
        self._speeds = gui.add_dropdown("Tool velocity", tuple(SPEEDS), initial_value=self._speed, hint=SPEED_HINT)
        listen(self._speeds, post, ("null", "speed"))
        self._box = gui.add_checkbox("Run", False, hint=RUN_HINT)
        listen(self._box, post, ("null", "run"))
        self._html = gui.add_html("")

    def handle(self, key: tuple[Hashable, ...], value: object) -> None:
        """Process an event of these controls."""
        match key:
            case ("null", "goal") if value in GOALS:
                self._goal = str(value)
            case ("null", "speed") if value in SPEEDS:
                self._speed = str(value)
            case ("null", "run"):
                self._runs = bool(value)
                self._sent = None
            case _:
                raise InputError("null space", value, "one of " + ", ".join((*GOALS, *SPEEDS)))
        self.show_numbers()

    @property
    def runs(self) -> bool:
        """Whether the arm moves."""
        return self._runs

    def stop(self, why: Notice | None = None) -> None:
        """End the motion."""
        self._runs, self._sent = False, None
        assign(self._box, False)
        if why is not None:
            self._stage.notify(why)

    def step(self, now: float) -> None:
        """One frame of the motion; another motion of the arm ends it."""
        stage, robot = self._stage, self._stage.now.robot
        if not self._runs or now - self._stepped < FRAME:
            return
        if self._sent is None:
            self._sent = stage.now.goal.copy()
            self._T, self._stepped = kin.fk(robot, self._sent), now
            return
        if not np.array_equal(self._sent, stage.now.goal):
            self.stop()
            return
        seconds = min(now - self._stepped, 2.0 * FRAME)
        self._stepped = now
        q, v = self._sent, SPEEDS[self._speed]
        J_v, own, _ = self.speeds(q)
        fast = float(np.abs(own).max())
        if fast < STILL and not v.any():
            self.stop(Notice("reached", "The best place is reached", "z has no part in the null space any more."))
            return
        T = self._T.copy()
        T[:3, 3] += seconds * v
        task = controllable(robot, stage.now.task)
        found = hold(robot, q + seconds * (J_v + own * min(1.0, FASTEST / max(fast, 1e-12))), T, task)
        if found is None or (found < robot.lower).any() or (found > robot.upper).any():
            self.stop(Notice("limits", "The motion ends", "A joint is at its limit, or a singularity is reached."))
            return
        self._sent, self._T = found, T
        stage.move_to(found, MOVING, at_once=True)

    def speeds(self, q: Array) -> tuple[Array, Array, Array]:
        """J⁺v, (I − J⁺J) z and z ``(n,)`` at a configuration; v is zero in the rows of the rotation."""
        arm = self._stage.now
        robot, task = arm.robot, controllable(arm.robot, arm.task)
        space = null_space(robot, q, task)
        v = np.zeros(len(space.J))
        v[:3] = SPEEDS[self._speed]
        z = secondary(robot, q, task, GOALS[self._goal])
        return space.pinv @ v, space.project(z), z

    def show_numbers(self) -> None:
        """Write rank, null space and joint speeds at the configuration in the scene."""
        arm = self._stage.now
        robot, q = arm.robot, arm.q
        task = controllable(robot, arm.task)
        space = null_space(robot, q, task)
        J_v, own, z = self.speeds(q)
        html = views.null_html(robot, task, space, (z, J_v, own), float(measure(robot, q, task, space.rank)))
        update_html(self._html, html + views.margin_html(margin(robot, q)))
