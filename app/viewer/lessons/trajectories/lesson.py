"""The lesson "Trajectories": profiles and their boundary conditions, joints against tool, singularities, jerk.

Its plots are part of the steps: a plot is shown when its prediction was made. Below the steps, both ways between
the two poses of the step *Joints or tool* can be drawn in the scene.
"""

from __future__ import annotations

from collections.abc import Hashable
from itertools import count

import numpy as np
import viser

from app.viewer.feature import Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.trajectories.motions import SAMPLES, ways
from app.viewer.lessons.trajectories.questions import outline
from app.viewer.panel import assign, listen
from app.viewer.scene.meshes import body
from kin import InputError
from kin.warmup import MOTIONS

PATHS_HINT = "PTP in blue, LIN in orange: the two ways between the poses of the step Joints or tool"
COLOURS = {"ptp": (0, 114, 178), "lin": (213, 94, 0)}
_NUMBERS = count(1)


class TrajectoriesLesson(Lesson):
    """See the module."""

    key = "trajectories"
    title = "Trajectories"
    kernels = (MOTIONS,)
    about = "How a motion becomes a function of time: profiles, PTP and LIN, singularities, jerk."
    outline = staticmethod(outline)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._on = False
        self._top: viser.FrameHandle | None = None
        self._box = stage.client.gui.add_checkbox("Both ways in the scene", False, hint=PATHS_HINT)
        listen(self._box, self.post, "paths")

    def handle(self, key: Hashable, value: object) -> None:
        if key != "paths":
            raise InputError("trajectories", key, "a control of this lesson")
        self._on = bool(value)
        self._draw()

    def on_robot(self) -> None:
        self._draw()

    def state(self) -> dict[str, object]:
        return {"paths": self._on}

    def restore(self, state: dict[str, object]) -> None:
        self._on = state.get("paths") is True
        assign(self._box, self._on)
        self._draw()

    def remove(self) -> None:
        if self._top is not None:
            self._top.remove()
            self._top = None

    def _draw(self) -> None:
        """Draw both ways of the tool, or remove them."""
        self.remove()
        found = ways(self.stage.now.robot) if self._on else None
        if found is None:
            return
        scene, root = self.stage.client.scene, f"/trajectories-{next(_NUMBERS)}"
        self._top = scene.add_frame(root, show_axes=False)
        for name, motion in (("ptp", found.ptp), ("lin", found.lin)):
            points = motion.sample(np.linspace(0.0, motion.duration, SAMPLES)).T[:, :3, 3].astype(np.float32)
            chords = np.stack([points[:-1], points[1:]], axis=1)
            size = body(self.stage.now.robot).size
            scene.add_line_segments(f"{root}/{name}", chords, COLOURS[name], thickness=0.3 * size)
