"""The lesson "Trajectories": profiles and their boundary conditions, joints against tool, singularities, jerk.

Its plots are part of the steps: a plot is shown when its prediction was made. Below the steps, both ways between
the two poses of the step *Joints or tool* can be drawn in the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, flag
from app.viewer.declared.panel import Control, Node
from app.viewer.declared.scene import Lazy, bars
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.trajectories.motions import SAMPLES, ways
from app.viewer.lessons.trajectories.questions import facts
from app.viewer.scene.meshes import body
from kin import Robot
from kin.transforms import Array

PATHS_HINT = "PTP in blue, LIN in orange: the two ways between the poses of the step Joints or tool"
COLOURS = {"ptp": (0, 114, 178), "lin": (213, 94, 0)}


@dataclass(frozen=True)
class TrajectoriesSettings(Settings):
    """Whether both ways are drawn."""

    paths: bool = flag("Both ways in the scene", hint=PATHS_HINT)


class TrajectoriesFacts(Facts[TrajectoriesSettings]):
    """The ways of the tool."""

    @cached_property
    def ways(self) -> dict[str, Array]:
        """The tool points ``(k, 3)`` of each motion, at equal times; none if the arm has no such two poses."""
        found = ways(self.robot)
        if found is None:
            return {}
        motions = {"ptp": found.ptp, "lin": found.lin}
        return {
            name: motion.sample(np.linspace(0.0, motion.duration, SAMPLES)).T[:, :3, 3]
            for name, motion in motions.items()
        }


class TrajectoriesLesson(DeclaredFeature[TrajectoriesSettings, TrajectoriesFacts], Lesson):
    """See the module."""

    key = "trajectories"
    title = "Trajectories"
    about = "How a motion becomes a function of time: profiles, PTP and LIN, singularities, jerk."
    asked_of = staticmethod(facts)
    settings_of, facts_of = TrajectoriesSettings, TrajectoriesFacts

    def panel(self) -> Sequence[Node]:
        return [Control("paths")]

    def scene(self) -> Sequence[Lazy]:
        return [Lazy("ways", self._ways, (self.stage.arm.now.robot,))] if self.settings.paths else []

    def _ways(self, robot: Robot) -> list[SceneNode]:
        """Both ways of the tool, which do not depend on the configuration."""
        return [
            bars(name, np.stack([points[:-1], points[1:]], axis=1), COLOURS[name], 0.3 * body(robot).size)
            for name, points in self.facts.ways.items()
        ]
