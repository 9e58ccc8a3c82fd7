"""The folder "Capability": its controls, the shared computation of the map, and its voxels.

The map is computed by :mod:`app.shared.maps`, once for all visitors who request the same one. While it grows, this
folder polls it a few times a second and redraws it if it has changed. The visitor's worker calls everything here.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from app.shared.computations import Subscription
from app.shared.maps import MapRequest, MapTimeError
from app.viewer.feature import Stage
from app.viewer.panel import Post, assign, listen, listen_click, update_html
from app.viewer.scene.camera import Sphere
from app.viewer.tabs.workspace.capability import views
from app.viewer.tabs.workspace.capability.settings import (
    BY,
    CHOICES,
    DIRECTIONS,
    SIZES,
    MapSettings,
    default_directions,
)
from app.viewer.tabs.workspace.capability.voxels import LEVELS, Look, Voxels, mark
from app.viewer.tabs.workspace.cut import Cut
from app.viewer.tabs.workspace.send_window import SendWindow
from app.viewer.views.templates import render
from kin import CapabilityMap, InputError

POLL = 0.2  # s between two polls of a growing map
REDRAW = 0.25  # s between two updates of the voxels
COST = 4  # flow control counts a voxel as this many points
PERCENT = 100.0
ABOUT = (
    "Capability: from how many directions the tool can approach each place. The map divides the workspace into "
    "small cubes (voxels) and colours each by this share."
)


class Capability:
    """The folder and its map. Builds its controls in whatever container is open.

    Args:
        window: flow control, shared with the clouds.
        post: returns the events of controls and clicks to `handle`.
        new_root: returns a prefix of node names that was never used before.
        colours: name of the colour map.
    """

    def __init__(
        self, stage: Stage, window: SendWindow, post: Post, new_root: Callable[[], str], colours: str
    ) -> None:
        self._stage = stage
        self._window = window
        self._post = post
        self._new_root = new_root
        self._settings = MapSettings(directions=default_directions(stage.now.robot))
        self._look = Look(self._settings.by, colours)
        self._reader: Subscription[CapabilityMap] | None = None
        self._state: views.State = "ready"
        self._blocks = (0, 0)
        self._request: MapRequest | None = None  # the map that was started last
        self._locked = stage.now.options.constraints.locked  # joints locked in the map
        self._found: CapabilityMap | None = None
        self._voxels: Voxels | None = None
        self._drawn = 0.0
        self._drawn_root = ""
        self._stale = False  # the voxels must be redrawn
        self._mark: viser.FrameHandle | None = None
        self._marked: tuple[CapabilityMap, int] | None = None  # the map and row of the clicked voxel
        self._handles: dict[str, Any] = {}
        self._build()
        self.report()

    def handle(self, key: Hashable, value: object) -> None:
        """Process an event; raises `InputError` for a value that none of our controls sends."""
        match key:
            case "start":
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
        """A sphere around the map, complete or not, without the corners of its grid, which are empty."""
        if self._found is None or not len(self._found.index):
            return None
        grid = self._found.grid
        sides = np.array(grid.shape) * grid.voxel
        return np.array(grid.origin) + sides / 2.0, float(sides.max()) / 2.0

    @property
    def due(self) -> float | None:
        """Seconds until the next tick, as `Feature.due`."""
        return POLL if self._reader is not None or self._stale else None

    def tick(self, now: float, moving: bool) -> None:
        """Poll the map, and redraw it if it has changed; `moving`: frames of the arm have priority."""
        reader = self._reader
        if reader is not None:
            self._blocks = (reader.done, reader.total)
            self._state = "computing" if reader.total else "waiting"
            if reader.latest is not self._found:
                self._found, self._stale = reader.latest, True
            if reader.finished:
                self._finish(reader)
            self.report()
        if (
            self._stale
            and self._found is not None
            and now - self._drawn >= REDRAW
            and self._window.is_open(moving)
        ):
            self._drawn = now
            self._draw(self._found)

    def compute(self) -> None:
        """Compute the map of the selected robot, and draw it while it grows."""
        self.clear()
        stage, self._request = self._stage, self._requested
        self._reader = stage.maps.subscribe(self._request)
        self._locked = stage.now.options.constraints.locked
        self._state = "waiting"
        self.report()

    @property
    def _requested(self) -> MapRequest:
        """The map that settings and locks describe."""
        settings, stage = self._settings, self._stage
        return MapRequest(stage.now.robot, settings.resolution, settings.directions, stage.now.options.constraints)

    def clear(self) -> None:
        """Stop, and remove everything."""
        self._stop("ready")
        if self._voxels is not None:
            self._voxels.remove()
        self._voxels = self._found = None
        self._stale = False
        self._state, self._blocks = "ready", (0, 0)
        self._forget_pick()
        self._update()
        self.report()

    def use_robot(self) -> None:
        """Another robot was selected: remove the map, and choose directions that suit the robot."""
        self.clear()
        self._apply("directions", default_directions(self._stage.now.robot))
        assign(self._handles["directions"], self._written("directions"))

    def leave(self) -> None:
        """Leave the shared computation."""
        if self._reader is not None:
            self._reader.leave()
            self._reader = None

    def look(self, colours: str, cut: Cut | None, shown: NDArray[np.bool_] | None) -> None:
        """Draw in these colours, and only these slabs of this cut."""
        self._relook(replace(self._look, map=colours, cut=cut, shown=shown))

    def refresh(self) -> None:
        """Show everything in the present units."""
        self._update()

    def state(self) -> dict[str, object]:
        """The state that a shared URL restores."""
        return {**self._settings.state(), "drawn": self._state in ("waiting", "computing", "done")}

    def restore(self, state: object) -> None:
        """Apply a saved state; missing or invalid parts stay as they are."""
        settings = self._settings.restored(state)
        for name, value in settings.state().items():
            self._apply(name, value)
        for name in ("resolution", "directions", "by", "least"):
            assign(self._handles[name], self._written(name))
        if isinstance(state, dict) and state.get("drawn") is True:
            self.compute()

    def _stop(self, state: views.State) -> None:
        """Stop computing; the part computed so far stays."""
        if self._reader is not None:
            self.leave()
            self._state = state
            self.report()

    def _finish(self, reader: Subscription[CapabilityMap]) -> None:
        """Take the complete map, or the error."""
        self.leave()
        error = reader.future.exception()
        if isinstance(error, MapTimeError):
            self._found, self._stale = reader.latest, True
            self._state = "out of time"
            return
        if error is not None:
            self._state = "failed"
            self.report()
            raise error
        self._found, self._stale = reader.future.result(), True
        self._state = "done"

    def _draw(self, found: CapabilityMap) -> None:
        old = self._voxels
        scene = self._stage.client.scene
        # The root identifies the clicked map: a click may come from nodes that are being replaced.
        root = self._new_root()
        self._voxels = Voxels(
            scene, root, found, self._look, self._settings.least,
            lambda level, instance: self._post("voxel", (root, level, instance)),
        )  # fmt: skip
        self._drawn_root = root
        if old is not None:
            old.remove()
        self._stale = False
        self._window.sent(COST * self._voxels.sent)
        self._update()

    def _relook(self, look: Look) -> None:
        self._look = look
        self._stale = self._found is not None
        self._update()

    def _picked(self, value: object) -> None:
        """Mark the clicked voxel and show its numbers."""
        if not isinstance(value, tuple) or len(value) != 3 or self._voxels is None:
            return
        root, level, instance = value
        row = self._voxels.voxel(level, instance) if root == self._drawn_root else None
        if row is None:
            return  # redrawn since
        self._forget_pick()
        found = self._voxels.found
        self._mark = mark(self._stage.client.scene, self._new_root(), found, row)
        self._marked = (found, row)
        self._update()

    def _forget_pick(self) -> None:
        if self._mark is not None:
            self._mark.remove()
            self._mark = None
        self._marked = None

    def _apply(self, name: str, value: object) -> None:
        """Change a setting and update the scene."""
        before = self._settings
        self._settings = before.with_value(name, value)
        if self._settings == before:
            return
        if name == "by":
            self._relook(replace(self._look, by=self._settings.by))
        elif name == "least":
            if self._voxels is not None:
                self._voxels.show(self._settings.least)
            self._update()
        else:
            self.report()

    def _update(self) -> None:
        """Update the legend, the numbers, and those of the clicked voxel."""
        found, units = self._found, self._stage.units
        legend = facts = ""
        pick = "" if self._marked is None else views.picked(*self._marked, units)
        if found is not None:
            legend = views.legend(found, self._settings.by, self._look.map, self._settings.least)
            facts = views.facts(found, self._locked, self._state == "done", units)
        for element, content in ((self._legend, legend), (self._facts, facts), (self._pick, pick)):
            update_html(element, content)

    def report(self) -> None:
        """Update buttons, progress bar and line."""
        done, total = self._blocks
        update_html(self._line, views.progress(self._state, done, total))
        names = views.buttons(self._state, self._request != self._requested)
        if self._buttons.options != names:
            self._buttons.options = names
        percent = round(PERCENT * done / total, 1) if total else 0.0
        if self._bar.value != percent:
            assign(self._bar, percent)

    # Controls

    def _build(self) -> None:
        gui = self._stage.client.gui
        with gui.add_folder("Capability", expand_by_default=False):
            gui.add_html(render("panel/note", text=ABOUT))
            self._add(
                "resolution",
                gui.add_dropdown(
                    "Grid",
                    tuple(SIZES),
                    initial_value=self._written("resolution"),
                    hint="Voxels along the longest side of the workspace; doubling them takes eight times as long",
                ),
            )
            self._add(
                "directions",
                gui.add_dropdown(
                    "Directions",
                    tuple(DIRECTIONS),
                    initial_value=self._written("directions"),
                    hint="Number of evenly spread approach directions, tested at each voxel's centre. Arms with "
                    "fewer than six joints need many: they reach a place from a few directions only",
                ),
            )
            self._buttons = gui.add_button_group(
                "Map",
                ("Start",),
                hint="Start: compute the map. Stop: keep the part computed so far. Clear: remove the map.",
            )
            listen_click(self._buttons, self._post, {"Start": "start", "Stop": "stop", "Clear": "clear"})
            self._bar = gui.add_progress_bar(0.0)
            self._line = gui.add_html("")
            self._add(
                "by",
                gui.add_dropdown(
                    "Voxels show",
                    tuple(BY),
                    initial_value=self._written("by"),
                    hint="Directions: share of possible approach directions. Manipulability: the best w of "
                    "the pose. "
                    "The colours are those chosen above.",
                ),
            )
            self._legend = gui.add_html("")
            self._add(
                "least",
                gui.add_slider(
                    "Hide voxels below (% of the best)",
                    min=0.0,
                    max=PERCENT * (LEVELS - 1) / LEVELS,
                    step=PERCENT / LEVELS,
                    initial_value=0.0,
                    hint="Hides voxels below this share of the map's best value",
                ),
            )
            self._facts = gui.add_html("")
            self._pick = gui.add_html("")

    def _add(self, name: str, handle: Any) -> None:
        self._handles[name] = handle
        listen(handle, self._post, name)

    def _read(self, name: str, value: object) -> object:
        """A control's value as a setting takes it; raises `InputError` for an unknown choice."""
        if name == "least":
            return value / PERCENT if isinstance(value, int | float) else value
        choices = CHOICES[name]
        if not isinstance(value, str) or value not in choices:
            raise InputError(name, value, "one of " + ", ".join(choices))
        return choices[value]

    def _written(self, name: str) -> Any:
        value = getattr(self._settings, name)
        if name == "least":
            return round(PERCENT * value, 6)
        return next(label for label, one in CHOICES[name].items() if one == value)
