"""The controls of the workspace tab. They post their values under the names of the settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import viser

from app.viewer.panel import Post, assign, listen, listen_click, update_html
from app.viewer.tabs.workspace.colours import BY, MAPS
from app.viewer.tabs.workspace.cut import AXES, KEEP, Cut
from app.viewer.tabs.workspace.settings import MAX_POINTS, MAX_SIZE, MIN_SIZE, WorkspaceSettings
from app.viewer.views.templates import render
from kin import InputError, Robot
from kin.units import Units, grouped
from kin.workspace import Strategy

STRATEGIES: dict[str, Strategy] = {
    "joints at random": "uniform",
    "joints spread evenly": "quasi",
    "even in space": "volume",
    "envelope only": "boundary",
}
SMOOTH = 200_000  # points: a picture of them takes some tenths of a second without a graphics card
PRESETS = {"10 k": 10_000, "100 k": 100_000, "1 M": 1_000_000, "4 M": MAX_POINTS}
# The workspaces that the source chapter shows, and their arms.
FIGURES = {"Figure 8": "pioneer5", "Figure 10": "redundant7"}
FIGURES_HINT = (
    "The two workspaces that the source chapter shows as still pictures: figure 8 of the Pioneer arm, figure 10 "
    "of the redundant arm. Shows that arm, and its cloud with axes."
)
NONE = "none"
FINE = 3  # decimals of a millimetre
STRATEGY_HINT = (
    "Joints at random: each joint anywhere between its limits. Joints spread evenly: the same with fewer "
    "clusters. Even in space: the same density everywhere. Envelope only: the boundary. The last two take longer."
)
CLOUD_HINT = (
    "Start: sample points; locked joints keep their values. Pause: stop for now. Stop: end sampling, the points "
    "stay. Clear: remove the points. Restart: sample again with the present settings."
)
CUT_HINT = "Along the arm: the vertical plane of the arm's present pose. The cut moves in steps."


def heavy(points: int) -> str:
    """A warning of many points. ``static/page.js`` shows it where the browser draws without a graphics card."""
    if points <= SMOOTH:
        return ""
    text = (
        f"This browser draws without a graphics card: with {grouped(points)} points the page may freeze for "
        f"seconds. Up to {grouped(SMOOTH)} points draw smoothly."
    )
    return render("workspace/heavy", text=text)


class Controls:
    """All controls of the tab. `read` converts a posted value into the value of a setting."""

    def __init__(
        self,
        gui: viser.GuiApi,
        settings: WorkspaceSettings,
        robot: Robot,
        robots: tuple[Robot, ...],
        units: Units,
        post: Post,
    ) -> None:
        self._gui = gui
        self._units = units
        self._post = post
        self._robots = robots
        self._choices: dict[str, Mapping[str, object]] = {
            "strategy": STRATEGIES,
            "by": BY,
            "map": {name: name for name in MAPS},
            "axis": {NONE: None, **AXES},
            "keep": KEEP,
            "compare": self._others(robot),
        }
        self._handles: dict[str, Any] = {}
        self._at: viser.GuiSliderHandle[float] | None = None
        self._build(settings)

    def read(self, name: str, value: object) -> object:
        """A control's value as a setting takes it; raises `InputError` for an unknown choice."""
        if name in self._choices:
            if value not in self._choices[name]:
                raise InputError(name, value, "one of " + ", ".join(self._choices[name]))
            return self._choices[name][str(value)]
        return value

    def read_length(self, value: object, units: Units) -> object:
        """The same for sliders of lengths; None for an event of a slider that has been replaced."""
        if units != self._units:
            return None
        return units.lengths.read(value) if isinstance(value, int | float) else value

    def use_units(self, units: Units, settings: WorkspaceSettings, cut: Cut | None) -> None:
        """Show lengths in these units."""
        if units == self._units:
            return
        self._units = units
        self._handles["size"].remove()
        self._add_size(settings.size)
        self.show_cut(cut, settings.at)

    def show_load(self, points: int) -> None:
        """Warn of so many points, where the page draws in software."""
        update_html(self._heavy, heavy(points))

    def show(self, settings: WorkspaceSettings) -> None:
        """Set every control."""
        for name, handle in self._handles.items():
            assign(handle, self._written(name, getattr(settings, name)))

    def show_buttons(self, names: tuple[str, ...]) -> None:
        """Offer these actions on the cloud."""
        if self._buttons.options != names:
            self._buttons.options = names

    def use_robot(self, robot: Robot) -> None:
        """Offer the other robots for comparison."""
        self._choices["compare"] = self._others(robot)
        self._handles["compare"].options = tuple(self._choices["compare"])

    def show_cut(self, cut: Cut | None, at: float) -> None:
        """Show a slider for this cut, or none."""
        if self._at is not None:
            self._at.remove()
            self._at = None
        self._handles["keep"].visible = cut is not None
        if cut is None:
            return
        unit = self._units.lengths
        with self._folder:
            self._at = self._gui.add_slider(
                f"Cut at ({unit.name})",
                min=unit.shown(cut.low, FINE),
                max=unit.shown(cut.high, FINE),
                step=unit.shown(cut.step, FINE),
                initial_value=unit.shown(at, FINE),
                hint="Position of the cut: distance from the base along the cut's direction",
            )
        listen(self._at, self._post, ("length", "at", self._units))

    def _build(self, settings: WorkspaceSettings) -> None:
        self._build_cloud(settings)
        self._build_colours(settings)
        with self._gui.add_folder(None) as self._size_container:
            pass
        self._add_size(settings.size)
        self._folder = self._gui.add_folder("Cut open")
        with self._folder:
            self._add_dropdown("axis", "Cut", None, CUT_HINT)
            self._add_dropdown("keep", "Keep", settings.keep, "Which side of the cut is visible")
            self._handles["keep"].visible = False
        with self._gui.add_folder("Look closer"):
            self._build_tools(settings)

    def _build_cloud(self, settings: WorkspaceSettings) -> None:
        gui = self._gui
        hint = f"1 to {grouped(MAX_POINTS)} points"
        self._add("n", gui.add_number("Points", settings.n, min=1, max=MAX_POINTS, step=1, hint=hint))
        presets = gui.add_button_group(" ", tuple(PRESETS), hint="Common numbers of points")
        for label, number in PRESETS.items():
            listen_click(presets, self._post, {label: ("preset", number)})
        if set(FIGURES.values()) <= {robot.id for robot in self._robots}:
            figures = gui.add_button_group("As in the book", tuple(FIGURES), hint=FIGURES_HINT)
            for label, robot_id in FIGURES.items():
                listen_click(figures, self._post, {label: ("figure", robot_id)})
        self._heavy = gui.add_html(heavy(settings.n))
        self._add_dropdown("strategy", "Sampling", settings.strategy, STRATEGY_HINT)
        hint = "Another seed gives other random configurations"
        self._add("seed", gui.add_number("Seed", settings.seed, min=0, step=1, hint=hint))
        self._buttons = gui.add_button_group("Cloud", ("Start",), hint=CLOUD_HINT)
        actions = ("start", "pause", "continue", "stop", "clear")
        keys = {action.capitalize(): action for action in actions}
        listen_click(self._buttons, self._post, {**keys, "Restart": "start"})
        self.bar = gui.add_progress_bar(0.0)
        self.line = gui.add_html("")

    def _build_colours(self, settings: WorkspaceSettings) -> None:
        self._add_dropdown("by", "Colour by", settings.by, "The quantity that the colours show")
        hint = "All three maps are legible with every common kind of colour vision"
        self._add_dropdown("map", "Colours", settings.map, hint)
        self.legend = self._gui.add_html("")

    def _build_tools(self, settings: WorkspaceSettings) -> None:
        hint = "A click on a point moves the arm to the configuration that produced it"
        self._add_checkbox("clicks", "Click on a point", settings.clicks, hint)
        self.picked = self._gui.add_html("")
        hint = "Another robot's cloud in the same scene, each in one colour"
        self._add_dropdown("compare", "Compare with", None, hint)
        hint = (
            "The section in (r, z), its boundary, and the tool in it; locked joints are ignored. "
            "The outline in the scene faces as joint 1 does."
        )
        self._add_checkbox("section", "Section plot", settings.section, hint)
        hint = "Axes with numbers, along the edges of a box around the workspace"
        self._add_checkbox("axes", "Axes with numbers", settings.axes, hint)
        hint = "Bounding box, reach, holes, volume and surface; locked joints are ignored"
        self._add_checkbox("sizes", "Sizes", settings.sizes, hint)
        self.sizes = self._gui.add_html("")

    def _add_dropdown(self, name: str, label: str, value: object, hint: str) -> None:
        initial = self._written(name, value)
        handle = self._gui.add_dropdown(label, tuple(self._choices[name]), initial_value=initial, hint=hint)
        self._add(name, handle)

    def _add_checkbox(self, name: str, label: str, value: bool, hint: str) -> None:
        self._add(name, self._gui.add_checkbox(label, value, hint=hint))

    def _add_size(self, size: float) -> None:
        unit = self._units.lengths
        with self._size_container:
            self._handles["size"] = self._gui.add_slider(
                f"Point size ({unit.name})",
                min=unit.shown(MIN_SIZE, FINE),
                max=unit.shown(MAX_SIZE, FINE),
                step=unit.shown(MIN_SIZE, FINE),
                initial_value=unit.shown(size, FINE),
                hint="Diameter of a point",
            )
        listen(self._handles["size"], self._post, ("length", "size", self._units))

    def _add(self, name: str, handle: Any) -> None:
        self._handles[name] = handle
        listen(handle, self._post, name)

    def _written(self, name: str, value: object) -> Any:
        if name in self._choices:
            return next(label for label, v in self._choices[name].items() if v == value)
        return self._units.lengths.shown(value, FINE) if name == "size" and isinstance(value, float) else value

    def _others(self, robot: Robot) -> dict[str, str | None]:
        return {NONE: None, **{other.name: other.id for other in self._robots if other != robot}}
