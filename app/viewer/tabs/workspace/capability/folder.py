"""The folder "Capability": what happens between its controls, the shared computation and the voxels.

The map is computed by :mod:`app.shared.maps`, once for all visitors who want the same. Here it is looked at a few
times a second while it grows, and drawn anew when there is more of it. Everything is called by the visitor's
worker.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from app.shared.computations import Subscription
from app.shared.maps import MapRequest
from app.viewer.feature import Stage
from app.viewer.panel import Post, assign, listen, listen_click
from app.viewer.scene.camera import Sphere
from app.viewer.tabs.workspace.capability import told
from app.viewer.tabs.workspace.capability.voxels import LEVELS, Look, Voxels, mark
from app.viewer.tabs.workspace.capability.wishes import BY, CHOICES, DIRECTIONS, SIZES, MapWishes
from app.viewer.tabs.workspace.cut import Cut
from app.viewer.tabs.workspace.flow import Flow
from kin import CapabilityMap, InputError

LOOKED = 0.2  # s between two looks at a map that grows
REDRAWN = 0.25  # s between two drawings
COST = 4  # a voxel on its way to the browser weighs as much as so many points
PERCENT = 100.0


class Capability:
    """The folder and its map. Builds its controls in whatever container is open.

    Args:
        flow: what is on its way to the browser, shared with the clouds.
        post: brings back to `handle` what controls and clicks post.
        root: gives a prefix of node names that was never used before.
        colours: name of the colour map.
    """

    def __init__(self, stage: Stage, flow: Flow, post: Post, root: Callable[[], str], colours: str) -> None:
        self._stage = stage
        self._flow = flow
        self._post = post
        self._root = root
        self._wishes = MapWishes()
        self._look = Look(self._wishes.by, colours)
        self._reader: Subscription[CapabilityMap] | None = None
        self._state: told.State = "ready"
        self._blocks = (0, 0)
        self._locked = stage.locked  # in the map
        self._found: CapabilityMap | None = None
        self._voxels: Voxels | None = None
        self._drawn = 0.0
        self._drawn_root = ""
        self._stale = False  # what is drawn is no longer what is meant
        self._mark: viser.FrameHandle | None = None
        self._marked: tuple[CapabilityMap, int] | None = None  # the map and its row that were clicked on
        self._handles: dict[str, Any] = {}
        self._build()
        self._report()

    def handle(self, key: Hashable, value: object) -> None:
        """Act on what was posted; raises `InputError` for a value that no control of ours sends."""
        match key:
            case "compute":
                self.compute()
            case "stop":
                self._stop("stopped")
            case "clear":
                self.clear()
            case "voxel":
                self._picked(value)
            case str(name):
                self._apply(name, self._read(name, value))
            case _:
                raise KeyError(key)

    @property
    def extent(self) -> Sphere | None:
        """A sphere round the map, whole or not, that leaves out the corners of its grid: there is nothing."""
        if self._found is None or not len(self._found.index):
            return None
        grid = self._found.grid
        sides = np.array(grid.shape) * grid.voxel
        return np.array(grid.origin) + sides / 2.0, float(sides.max()) / 2.0

    @property
    def due(self) -> float | None:
        """Seconds until the next tick, as of a feature."""
        return LOOKED if self._reader is not None or self._stale else None

    def tick(self, now: float, moving: bool) -> None:
        """Look at the map, and draw what has changed; `moving`: pictures of the arm go first."""
        reader = self._reader
        if reader is not None:
            self._blocks = (reader.done, reader.total)
            self._state = "computing" if reader.total else "waiting"
            if reader.latest is not self._found:
                self._found, self._stale = reader.latest, True
            if reader.finished:
                self._finish(reader)
            self._report()
        if self._stale and self._found is not None and now - self._drawn >= REDRAWN and self._flow.open(moving):
            self._drawn = now
            self._draw(self._found)

    def compute(self) -> None:
        """Have the map of the arm on show that is wished for, and draw it while it grows."""
        self.clear()
        wishes, stage = self._wishes, self._stage
        self._reader = stage.maps.subscribe(
            MapRequest(stage.robot, wishes.resolution, wishes.directions, locked=stage.locked)
        )
        self._locked = stage.locked
        self._state = "waiting"
        self._report()

    def clear(self) -> None:
        """Stop, and take everything away."""
        self._stop("ready")
        if self._voxels is not None:
            self._voxels.remove()
        self._voxels = self._found = None
        self._stale = False
        self._state, self._blocks = "ready", (0, 0)
        self._forget_pick()
        self._tell()
        self._report()

    def leave(self) -> None:
        """Let go of the computation."""
        if self._reader is not None:
            self._reader.leave()
            self._reader = None

    def look(self, colours: str, cut: Cut | None, shown: NDArray[np.bool_] | None) -> None:
        """Draw in these colours, and these slabs of this cut only."""
        self._relook(replace(self._look, map=colours, cut=cut, shown=shown))

    def restyle(self) -> None:
        """Tell everything in the units of now."""
        self._tell()

    def state(self) -> dict[str, object]:
        """What a shared address restores."""
        return {**self._wishes.state(), "drawn": self._state in ("waiting", "computing", "done")}

    def restore(self, state: object) -> None:
        """Set what `state` told; what is missing or wrong is left as it is."""
        wishes = self._wishes.restored(state)
        for name, value in wishes.state().items():
            self._apply(name, value)
        for name in ("resolution", "directions", "by", "least"):
            assign(self._handles[name], self._written(name))
        if isinstance(state, dict) and state.get("drawn") is True:
            self.compute()

    def _stop(self, state: told.State) -> None:
        """Compute no longer; what there is stays."""
        if self._reader is not None:
            self.leave()
            self._state = state
            self._report()

    def _finish(self, reader: Subscription[CapabilityMap]) -> None:
        """The map is there, or could not be computed."""
        self.leave()
        error = reader.future.exception()
        if error is not None:
            self._state = "failed"
            self._report()
            raise error
        self._found, self._stale = reader.future.result(), True
        self._state = "done"

    def _draw(self, found: CapabilityMap) -> None:
        old = self._voxels
        scene = self._stage.client.scene
        # Clicks on nodes that are about to go are told apart by their number.
        root = self._root()
        self._voxels = Voxels(
            scene, root, found, self._look, self._wishes.least,
            lambda level, instance: self._post("voxel", (root, level, instance)),
        )  # fmt: skip
        self._drawn_root = root
        if old is not None:
            old.remove()
        self._stale = False
        self._flow.sent(COST * self._voxels.sent)
        self._tell()

    def _relook(self, look: Look) -> None:
        self._look = look
        self._stale = self._found is not None
        self._tell()

    def _picked(self, value: object) -> None:
        """Tell about the voxel that was clicked on."""
        if not isinstance(value, tuple) or len(value) != 3 or self._voxels is None:
            return
        root, level, instance = value
        row = self._voxels.voxel(level, instance) if root == self._drawn_root else None
        if row is None:
            return  # drawn anew since
        self._forget_pick()
        found = self._voxels.found
        self._mark = mark(self._stage.client.scene, self._root(), found, row)
        self._marked = (found, row)
        self._tell()

    def _forget_pick(self) -> None:
        if self._mark is not None:
            self._mark.remove()
            self._mark = None
        self._marked = None

    def _apply(self, name: str, value: object) -> None:
        """Take a setting, and let the picture follow."""
        before = self._wishes
        self._wishes = before.having(name, value)
        if self._wishes == before:
            return
        if name == "by":
            self._relook(replace(self._look, by=self._wishes.by))
        elif name == "least":
            if self._voxels is not None:
                self._voxels.show(self._wishes.least)
            self._tell()

    def _tell(self) -> None:
        """Legend and numbers of what there is, and of what was clicked on."""
        found, units = self._found, self._stage.units
        legend = facts = ""
        pick = "" if self._marked is None else told.picked(*self._marked, units)
        if found is not None:
            legend = told.legend(found, self._wishes.by, self._look.map, self._wishes.least)
            facts = told.facts(found, self._locked, self._state == "done", units)
        for element, content in ((self._legend, legend), (self._facts, facts), (self._pick, pick)):
            if element.content != content:
                element.content = content

    def _report(self) -> None:
        done, total = self._blocks
        line = told.progress(self._state, done, total)
        if self._line.content != line:
            self._line.content = line
        percent = round(PERCENT * done / total, 1) if total else 0.0
        if self._bar.value != percent:
            assign(self._bar, percent)

    # Controls

    def _build(self) -> None:
        gui = self._stage.client.gui
        with gui.add_folder("Capability", expand_by_default=False):
            self._add(
                "resolution",
                gui.add_dropdown(
                    "Grid",
                    tuple(SIZES),
                    initial_value=self._written("resolution"),
                    hint="Voxels along the longest side of the workspace; twice as many take eight times as long",
                ),
            )
            self._add(
                "directions",
                gui.add_dropdown(
                    "Directions",
                    tuple(DIRECTIONS),
                    initial_value=self._written("directions"),
                    hint="How many directions, spread evenly, the tool is to come from to each voxel's centre",
                ),
            )
            buttons = gui.add_button_group(
                "Map",
                ("Compute", "Stop", "Clear"),
                hint="Stop: compute no longer and keep what is there. Clear: take it away.",
            )
            listen_click(buttons, self._post, {"Compute": "compute", "Stop": "stop", "Clear": "clear"})
            self._bar = gui.add_progress_bar(0.0)
            self._line = gui.add_html("")
            self._add(
                "by",
                gui.add_dropdown(
                    "Voxels show",
                    tuple(BY),
                    initial_value=self._written("by"),
                    hint="Directions: from how many of them the tool can come. Manipulability: the best found. "
                    "In the colours chosen above.",
                ),
            )
            self._legend = gui.add_html("")
            self._add(
                "least",
                gui.add_slider(
                    "Least (% best)",
                    min=0.0,
                    max=PERCENT * (LEVELS - 1) / LEVELS,
                    step=PERCENT / LEVELS,
                    initial_value=0.0,
                    hint="Hides voxels below this share of the map's best",
                ),
            )
            self._facts = gui.add_html("")
            self._pick = gui.add_html("")

    def _add(self, name: str, handle: Any) -> None:
        self._handles[name] = handle
        listen(handle, self._post, name)

    def _read(self, name: str, value: object) -> object:
        """A control's value as a wish takes it; raises `InputError` for what is not on a list."""
        if name == "least":
            return value / PERCENT if isinstance(value, int | float) else value
        choices = CHOICES[name]
        if not isinstance(value, str) or value not in choices:
            raise InputError(name, value, "one of " + ", ".join(choices))
        return choices[value]

    def _written(self, name: str) -> Any:
        value = getattr(self._wishes, name)
        if name == "least":
            return round(PERCENT * value, 6)
        return next(label for label, one in CHOICES[name].items() if one == value)
