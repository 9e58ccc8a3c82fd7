"""The folder "Capability": its controls, the shared computation of the map, and its voxels.

The map is computed by :mod:`app.shared.maps`, once for all visitors who request the same one. While it grows, this
folder polls it a few times a second and redraws it if it has changed. The visitor's worker calls everything here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from app.shared.maps import MapRequest, MapTimeError
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Buttons, Control, Folder, Html, Node, Progress
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Result, Work
from app.viewer.feature import Feature, Stage
from app.viewer.scene.camera import Sphere
from app.viewer.tabs.workspace.capability import views
from app.viewer.tabs.workspace.capability.settings import MapSettings
from app.viewer.tabs.workspace.capability.voxels import Voxels, mark
from app.viewer.tabs.workspace.cut import Cut
from app.viewer.tabs.workspace.send_window import SendWindow
from app.viewer.views.templates import render
from kin.workspace import CapabilityMap

POLL = 0.2  # s between two polls of a growing map
REDRAW = 0.25  # s between two updates of the voxels
COST = 4  # flow control counts a voxel as this many points
PERCENT = 100.0
ABOUT = (
    "Capability: from how many directions the tool can approach each place. The map divides the workspace into "
    "small cubes (voxels) and colours each by this share. A new map is cut open along the arm."
)
MAP_HINT = "Start: compute the map. Stop: keep the part computed so far. Clear: remove the map."


class MapFacts(Facts[MapSettings]):
    """The map, as far as it is computed."""

    @property
    def map(self) -> Result:
        """What computing it has come to."""
        return self.settings.stopped or self.work("map")

    @property
    def found(self) -> CapabilityMap | None:
        """The map, or its part."""
        found: CapabilityMap | None = self.map.value
        return found

    @property
    def state(self) -> views.State:
        """How far it is."""
        if self.settings.request is None:
            return "ready"
        if self.settings.stopped is not None:
            return "stopped"
        if self.map.error is not None:
            return "out of time" if isinstance(self.map.error, MapTimeError) else "failed"
        if self.map.finished:
            return "done"
        return "computing" if self.map.total else "waiting"

    @property
    def requested(self) -> MapRequest:
        """The map that settings and locks describe."""
        s = self.settings
        return MapRequest(self.robot, s.resolution, s.directions, self.arm.options.constraints)


class Capability(DeclaredFeature[MapSettings, MapFacts]):
    """The folder and its map. Builds its controls in whatever container is open.

    Args:
        window: flow control, shared with the clouds.
        appears: called with the first voxels of a map that the visitor has started, before they are drawn.
    """

    key = "capability"
    title = "Workspace"
    settings_of, facts_of = MapSettings, MapFacts

    def __init__(
        self,
        stage: Stage,
        tab: Feature,
        window: SendWindow,
        appears: Callable[[CapabilityMap], None],
    ) -> None:
        self._window, self._appears = window, appears
        super().__init__(stage, tab)

    def panel(self) -> Sequence[Node]:
        f, found, s, units = self.read, self.read.found, self.settings, self.stage.display.units
        legend, facts, pick = (Html(str, key=key) for key in ("legend", "facts", "pick"))
        if found is not None and s.request is not None:
            locked = s.request.constraints.locks(s.request.robot)
            legend = Html(views.legend, (found, s.by, s.colours, s.least), key="legend")
            facts = Html(views.facts, (found, locked, f.state == "done", units), key="facts")
        if s.picked is not None:
            pick = Html(views.picked, (*s.picked, units), key="pick")
        events = {
            "Start": self.event(self.on_start),
            "Stop": self.event(self.on_stop),
            "Clear": self.event(self.clear),
        }
        names = views.buttons(f.state, s.request != f.requested)
        return [
            Folder(
                "Capability",
                [
                    Html(_note, (ABOUT,)),
                    Control("resolution"),
                    Control("directions"),
                    Buttons("Map", events, MAP_HINT, names),
                    Progress(round(PERCENT * f.map.done / f.map.total, 1) if f.map.total else 0.0),
                    Html(views.progress, (f.state, f.map.done, f.map.total)),
                    Control("by"),
                    legend,
                    Control("least"),
                    facts,
                    pick,
                ],
                open=False,
            )
        ]

    def scene(self) -> Sequence[SceneNode]:
        s = self.settings
        voxels = [] if s.drawn is None else [s.drawn.node(s.least, self.on_voxel.__name__)]
        return voxels if s.picked is None else [*voxels, mark(*s.picked)]

    @property
    def extent(self) -> Sphere | None:
        """A sphere around the map, complete or not, without the corners of its grid, which are empty."""
        found = self.facts.found
        if found is None or not len(found.index):
            return None
        sides = np.array(found.grid.shape) * found.grid.voxel
        return np.array(found.grid.origin) + sides / 2.0, float(sides.max()) / 2.0

    @property
    def empty(self) -> bool:
        """Whether there is no map, and none is being computed."""
        return self.facts.found is None and self.facts.state not in ("waiting", "computing")

    def running(self) -> Sequence[Work]:
        s = self.settings
        if s.request is None or s.stopped is not None:
            return ()
        return [Work("map", self.stage.services.maps.subscribe, (s.request,), poll=POLL)]

    def worked(self, key: str) -> None:
        found = self.facts.found
        if self.settings.unseen and found is not None and len(found.index):
            self.change(unseen=False)
            self._appears(found)
        if self.facts.state != "out of time":
            super().worked(key)

    def tick(self, now: float) -> None:
        try:
            super().tick(now)
        finally:
            found, look, drawn = self.facts.found, self.settings.look, self.settings.drawn
            if found is not None and (drawn is None or not drawn.shows(found, look)):
                if self._window.is_open and (drawn is None or now - drawn.since >= REDRAW):
                    voxels = Voxels(found, look)
                    self.change(drawn=voxels)
                    self._window.sent(COST * voxels.sent)
                    self.schedule()
                else:
                    self.due = min(POLL, POLL if self.due is None else self.due)

    def on_start(self) -> None:
        """Compute a map for a visitor, who sees it for the first time."""
        self.compute()
        self.change(unseen=True)

    def on_stop(self) -> None:
        """Stop computing; the part computed so far stays."""
        if self.facts.state in ("waiting", "computing"):
            self.change(stopped=self.facts.map)

    def compute(self) -> None:
        """Compute the map of the selected robot, and draw it while it grows."""
        self.clear()
        self.invalidate()
        self.change(request=self.facts.requested)

    def clear(self) -> None:
        """Stop, and remove everything."""
        self._runner.end()
        self.change(request=None, stopped=None, unseen=False, drawn=None, picked=None)
        self.schedule()

    def use_look(self, colours: str, cut: Cut | None, shown: NDArray[np.bool_] | None) -> None:
        """Draw in these colours, and only these slabs of this cut."""
        self.change(colours=colours, cut=cut, shown=shown)
        self.schedule()

    def state(self) -> dict[str, object]:
        self.invalidate()
        return {**super().state(), "drawn": self.facts.state in ("waiting", "computing", "done")}

    def restore(self, state: dict[str, object]) -> None:
        super().restore(state)
        if state.get("drawn") is True:
            self.compute()

    def on_voxel(self, key: str, level: int, instance: int) -> None:
        """Mark the clicked voxel and show its numbers."""
        drawn = self.settings.drawn
        row = drawn.voxel(level, instance) if drawn is not None and key == drawn.key else None
        if drawn is not None and row is not None:  # not redrawn since
            self.change(picked=(drawn.found, row))


def _note(text: str) -> str:
    return render("panel/note", text=text)
