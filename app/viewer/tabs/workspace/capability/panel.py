"""The folder "Capability": its controls, the shared computation of the map, and its voxels.

The map is computed by :mod:`app.shared.maps`, once for all visitors who request the same one. While it grows, this
folder polls it a few times a second and redraws it if it has changed. The visitor's worker calls everything here.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import numpy as np
import viser
from numpy.typing import NDArray

from app.shared.computations import Subscription
from app.shared.maps import MapRequest, MapTimeError
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Buttons, Control, Folder, Html, Node, Progress
from app.viewer.feature import Stage
from app.viewer.panel import Post
from app.viewer.scene.camera import Sphere
from app.viewer.tabs.workspace.capability import views
from app.viewer.tabs.workspace.capability.settings import MapSettings
from app.viewer.tabs.workspace.capability.voxels import Look, Voxels, mark
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


class Capability(DeclaredFeature[MapSettings, Facts[MapSettings]]):
    """The folder and its map. Builds its controls in whatever container is open.

    Args:
        window: flow control, shared with the clouds.
        post: returns the events of controls and clicks to `handle`.
        new_root: returns a prefix of node names that was never used before.
        colours: name of the colour map.
        appears: called with the first voxels of a map that the visitor has started, before they are drawn.
    """

    key = "capability"
    title = "Workspace"
    settings_of, facts_of = MapSettings, Facts

    def __init__(
        self,
        stage: Stage,
        window: SendWindow,
        post: Post,
        new_root: Callable[[], str],
        colours: str,
        appears: Callable[[CapabilityMap], None],
    ) -> None:
        self._window, self._to, self._new_root = window, post, new_root
        self._appears, self._unseen = appears, False
        self._drawn_as = Look("share", colours)
        self._reader: Subscription[CapabilityMap] | None = None
        self._state: views.State = "ready"
        self._blocks = (0, 0)
        self._request: MapRequest | None = None  # the map that was started last
        self._locked = stage.now.options.constraints.locks(stage.now.robot)  # joints locked in the map
        self._found: CapabilityMap | None = None
        self._voxels: Voxels | None = None
        self._drawn = 0.0
        self._drawn_root = ""
        self._old = False  # the voxels must be redrawn
        self._mark: viser.FrameHandle | None = None
        self._marked: tuple[CapabilityMap, int] | None = None  # the map and row of the clicked voxel
        super().__init__(stage)

    def post(self, key: Hashable, value: object = None) -> None:
        self._to(key, value)

    def panel(self) -> Sequence[Node]:
        (done, total), found, settings, units = self._blocks, self._found, self.settings, self.stage.units
        legend, facts, pick = (Html(str, key=key) for key in ("legend", "facts", "pick"))
        if found is not None:
            legend = Html(views.legend, (found, settings.by, self._drawn_as.map, settings.least), key="legend")
            facts = Html(views.facts, (found, self._locked, self._state == "done", units), key="facts")
        if self._marked is not None:
            pick = Html(views.picked, (*self._marked, units), key="pick")
        events = {
            "Start": self.event(self.on_start),
            "Stop": self.event(self._stop, "stopped"),
            "Clear": self.event(self.clear),
        }
        names = views.buttons(self._state, self._request != self._requested)
        return [
            Folder(
                "Capability",
                [
                    Html(_note, (ABOUT,)),
                    Control("resolution"),
                    Control("directions"),
                    Buttons("Map", events, MAP_HINT, names),
                    Progress(round(PERCENT * done / total, 1) if total else 0.0),
                    Html(views.progress, (self._state, done, total)),
                    Control("by"),
                    legend,
                    Control("least"),
                    facts,
                    pick,
                ],
                open=False,
            )
        ]

    @property
    def extent(self) -> Sphere | None:
        """A sphere around the map, complete or not, without the corners of its grid, which are empty."""
        if self._found is None or not len(self._found.index):
            return None
        grid = self._found.grid
        sides = np.array(grid.shape) * grid.voxel
        return np.array(grid.origin) + sides / 2.0, float(sides.max()) / 2.0

    @property
    def empty(self) -> bool:
        """Whether there is no map, and none is being computed."""
        return self._found is None and self._reader is None

    @property
    def wait(self) -> float | None:
        """Seconds until the next poll, as `Feature.due`."""
        return POLL if self._reader is not None or self._old else None

    def poll(self, now: float, moving: bool) -> None:
        """Poll the map, and redraw it if it has changed; `moving`: frames of the arm have priority."""
        reader = self._reader
        if reader is not None:
            self._blocks = (reader.done, reader.total)
            self._state = "computing" if reader.total else "waiting"
            if reader.latest is not self._found:
                self._found, self._old = reader.latest, True
            if reader.finished:
                self._finish(reader)
            self._stale = True
        if self._unseen and self._found is not None and len(self._found.index):
            self._unseen = False
            self._appears(self._found)
        if self._old and self._found is not None and now - self._drawn >= REDRAW and self._window.is_open(moving):
            self._drawn = now
            self._draw_map(self._found)
        if self._stale:
            self.refresh()

    def on_start(self) -> None:
        """Compute a map for a visitor, who sees it for the first time."""
        self.compute()
        self._unseen = True

    def compute(self) -> None:
        """Compute the map of the selected robot, and draw it while it grows."""
        self.clear()
        stage, self._request = self.stage, self._requested
        self._reader = stage.maps.subscribe(self._request)
        self._locked = stage.now.options.constraints.locks(stage.now.robot)
        self._state = "waiting"
        self._stale = True

    @property
    def _requested(self) -> MapRequest:
        """The map that settings and locks describe."""
        settings, stage = self.settings, self.stage
        return MapRequest(stage.now.robot, settings.resolution, settings.directions, stage.now.options.constraints)

    def clear(self) -> None:
        """Stop, and remove everything."""
        self._stop("ready")
        if self._voxels is not None:
            self._voxels.remove()
        self._voxels = self._found = None
        self._old = self._unseen = False
        self._state, self._blocks = "ready", (0, 0)
        self._forget_pick()
        self._stale = True

    def leave(self) -> None:
        """Leave the shared computation."""
        if self._reader is not None:
            self._reader.leave()
            self._reader = None

    def use_look(self, colours: str, cut: Cut | None, shown: NDArray[np.bool_] | None) -> None:
        """Draw in these colours, and only these slabs of this cut."""
        self._drawn_as = replace(self._drawn_as, map=colours, cut=cut, shown=shown)
        self._old = self._found is not None
        self._stale = True

    def state(self) -> dict[str, object]:
        return {**super().state(), "drawn": self._state in ("waiting", "computing", "done")}

    def restore(self, state: dict[str, object]) -> None:
        super().restore(state)
        self.changed("by")
        self.changed("least")
        if state.get("drawn") is True:
            self.compute()

    def changed(self, path: str) -> None:
        if path == "by" and self._drawn_as.by != self.settings.by:
            self._drawn_as = replace(self._drawn_as, by=self.settings.by)
            self._old = self._found is not None
        elif path == "least" and self._voxels is not None:
            self._voxels.show(self.settings.least)

    def started(self) -> None:
        self.clear()

    def on_voxel(self, root: str, level: int, instance: int) -> None:
        """Mark the clicked voxel and show its numbers."""
        row = (
            self._voxels.voxel(level, instance) if self._voxels is not None and root == self._drawn_root else None
        )
        if self._voxels is None or row is None:
            return  # redrawn since
        self._forget_pick()
        found = self._voxels.found
        self._mark = mark(self.stage.client.scene, self._new_root(), found, row)
        self._marked = (found, row)

    def _stop(self, state: views.State) -> None:
        """Stop computing; the part computed so far stays."""
        if self._reader is not None:
            self.leave()
            self._state = state
            self._stale = True

    def _finish(self, reader: Subscription[CapabilityMap]) -> None:
        """Take the complete map, or the error."""
        self.leave()
        error = reader.future.exception()
        if isinstance(error, MapTimeError):
            self._found, self._old = reader.latest, True
            self._state = "out of time"
            return
        if error is not None:
            self._state = "failed"
            self.refresh()
            raise error
        self._found, self._old = reader.future.result(), True
        self._state = "done"

    def _draw_map(self, found: CapabilityMap) -> None:
        old = self._voxels
        scene = self.stage.client.scene
        # The root identifies the clicked map: a click may come from nodes that are being replaced.
        root = self._new_root()
        self._voxels = Voxels(
            scene,
            root,
            found,
            self._drawn_as,
            self.settings.least,
            lambda level, instance: self.post(("do", self.event(self.on_voxel, root, level, instance), 0, 0)),
        )
        self._drawn_root = root
        if old is not None:
            old.remove()
        self._old = False
        self._window.sent(COST * self._voxels.sent)
        self._stale = True

    def _forget_pick(self) -> None:
        if self._mark is not None:
            self._mark.remove()
            self._mark = None
        self._marked = None


def _note(text: str) -> str:
    return render("panel/note", text=text)
