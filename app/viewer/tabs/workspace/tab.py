"""The workspace tab: its settings, and the events between its parts.

Each part has a module: `cloud` (points in the scene), `cut`, `pick` (clicks on points), `sizes`, `section`, and
the folder `capability`. Slow work runs in background threads that post their results here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from typing import Any, ClassVar, cast

import kin
from app.viewer.feature import Feature, Stage
from app.viewer.tabs.workspace.axes import Axes
from app.viewer.tabs.workspace.capability.panel import Capability
from app.viewer.tabs.workspace.cloud import CloudView
from app.viewer.tabs.workspace.controls import Controls
from app.viewer.tabs.workspace.cut import Cut, cut_of
from app.viewer.tabs.workspace.pick import PointPicker
from app.viewer.tabs.workspace.section.panel import SectionPanel
from app.viewer.tabs.workspace.send_window import SendWindow
from app.viewer.tabs.workspace.settings import WorkspaceSettings, default_size
from app.viewer.tabs.workspace.sizes import Sizes
from kin import Robot, Section
from kin.transforms import Array
from kin.units import Units
from kin.warmup import CAPABILITY, CLOUDS

REDRAW = 1.0  # s between two updates of the section plot with more points
DOT = 0.05  # s between two updates of the tool in the section plot
FIGURE: dict[str, object] = {"n": 20_000, "strategy": "uniform", "by": "one", "axis": None, "axes": True}
MOVED = 0.3  # s after its last frame, the arm still counts as moving


class Workspace(Feature):
    """Clouds of tool points, their sizes, their section, and the capability map."""

    key: ClassVar[str] = "workspace"
    title: ClassVar[str] = "Workspace"
    shared: ClassVar[bool] = True
    kernels = (CLOUDS,)

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._settings = WorkspaceSettings(size=default_size(stage.now.robot))
        self._controls = Controls(
            stage.client.gui, self._settings, stage.now.robot, stage.store.robots, stage.units, self.post
        )
        window = SendWindow(stage.client, lambda: self.post("more"))
        self._roots = 0
        self._clouds = CloudView(
            stage, self._controls, self._settings, window, self._new_root, lambda: self.post("more")
        )
        self._picker = PointPicker(stage, self._controls, self._new_root, self.post)
        self._sizes = Sizes(stage, self._controls, self.post)
        self._section: SectionPanel | None = None
        self._axes = Axes(stage.client.scene, self._new_root)
        self._cut: Cut | None = None
        self._plotted = self._dotted = self._moved = 0.0
        self._tool = stage.now.T_tool[:3, 3]
        self._dot_due = False
        # Number of clouds, whether there is a map, and the arm whose axes are shown.
        self._in_view: tuple[int, bool, Robot | None] = (0, False, None)
        self._capability = Capability(
            stage,
            window,
            self._post_capability,
            self._new_root,
            self._settings.map,
        )
        # Events by the first part of their key. A handler takes the other parts, and the value.
        self._handlers: dict[str, Callable[..., None]] = {
            "more": lambda _: None,
            "failed": _raise,
            "start": lambda _: self._start(),
            "pause": lambda _: self._clouds.pause(),
            "continue": lambda _: self._clouds.resume(),
            "stop": lambda _: self._clouds.stop(),
            "clear": lambda _: self._clear(),
            "click": self._search,
            "picked": lambda found: self._picker.take(*cast(tuple[Any, ...], found)),
            "facts": lambda found: self._sizes.take(*cast(tuple[Any, ...], found)),
            "section-found": self._take_section,
            "outline-found": self._take_outline,
            "plotted": lambda made: self._section.show_cloud(made) if self._section is not None else None,
            "capability": self._capability.handle,
            "preset": self._use_preset,
            "figure": self._show_figure,
            "length": self._set_length,
        }
        self._clouds.report()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        name, *arguments = key if isinstance(key, tuple) else (key,)
        if name in self._handlers:
            self._handlers[name](*arguments, value)
        elif isinstance(key, str):
            self._apply(key, self._controls.read(key, value))
        else:
            raise KeyError(key)
        self.due = 0.0  # the next tick determines when to wake up

    @classmethod
    def kernels_of(cls, key: Hashable) -> tuple[str, ...]:
        return (CAPABILITY,) if isinstance(key, tuple) and key[0] == "capability" else cls.kernels

    def on_robot(self) -> None:
        self._clear()
        self._capability.on_robot()
        robot = self.stage.now.robot
        self._tool = kin.fk(robot, robot.q_home)[:3, 3]
        self._controls.use_robot(robot)
        self._use(self._settings.restored({"size": default_size(robot), "axis": None, "compare": None}, ()))
        self._controls.show(self._settings)
        self._set_cut()
        if self._section is not None:
            self._show_section(False)
            self._show_section(True)
        self._sizes.show(self._settings.sizes)
        self._show_axes()
        self.due = 0.0

    def on_request(self) -> None:
        self._clouds.report()  # shows the locked joints
        self._capability.refresh()

    def on_style(self) -> None:
        units = self.stage.units
        self._controls.use_units(units, self._settings, self._cut)
        self._show_axes()
        self._clouds.show_legend()
        self._picker.refresh()
        self._sizes.refresh()
        if self._section is not None:
            self._section.use(units)
        self._capability.refresh()

    def on_pose(self, T_base_tool: Array) -> None:
        self._moved = time.perf_counter()
        if self._section is None:
            return
        self._tool = T_base_tool[:3, 3]
        self._section.turn(self._tool)
        self._dot_due = True
        self.due = min(self.due, DOT) if self.due is not None else DOT

    def tick(self, now: float) -> None:
        moving = now - self._moved < MOVED
        self._clouds.advance(now, moving)
        self._update_section(now)
        try:
            self._capability.poll(now, moving)
            self._fit_view()
        finally:
            cloud_due = DOT if self._dot_due else self._clouds.next_tick(now, moving)
            times = [due for due in (cloud_due, self._capability.wait) if due is not None]
            self.due = min(times, default=None)

    def state(self) -> dict[str, object]:
        drawn = bool(self._clouds.nodes)
        return {**self._settings.state(), "drawn": drawn, "capability": self._capability.state()}

    def restore(self, state: dict[str, object]) -> None:
        settings = self._settings.restored(state, self._others)
        for name, value in settings.state().items():
            if name not in ("axis", "at"):
                self._apply(name, value)
        self._apply("axis", settings.axis)
        if settings.axis is not None:
            self._apply("at", settings.at)
            self._controls.show_cut(self._cut, self._settings.at)
        self._controls.show(self._settings)
        if state.get("drawn") is True:
            self._start()
        if isinstance(saved := state.get("capability"), dict):
            self._capability.restore(saved)
        self.due = 0.0

    def on_leave(self) -> None:
        self._capability.leave()
        self._sizes.leave()
        if self._section is not None:
            self._section.leave()

    def remove(self) -> None:
        self._clear()
        self._capability.clear()
        self._sizes.leave()
        self._axes.remove()
        self._show_section(False)

    def _post_capability(self, key: Hashable, value: object = None) -> None:
        self.post(("capability", key), value)

    # Settings

    def _use(self, settings: WorkspaceSettings) -> None:
        self._settings = self._clouds.settings = settings

    def _apply(self, name: str, value: object) -> None:
        """Change a setting and update the scene; raises `InputError` for an invalid value."""
        before = self._settings
        self._use(before.with_value(name, value, self._others))
        match name:
            case "n" | "strategy" | "seed":
                self._clouds.report()  # a cloud of other settings says so
                self._controls.show_load(self._settings.n)
            case "by" | "map":
                self._clouds.recolour()
                self._show_slabs()
            case "size":
                self._clouds.resize()
            case "axis":
                self._set_cut()
            case "at" | "keep":
                self._show_slabs()
            case "compare":
                self._clouds.compare()
                if self._settings.axis is not None:
                    self._set_cut()
                self._clouds.recolour()
            case "clicks":
                self._listen_clicks()
            case "axes":
                self._show_axes()
            case "section" if before.section != self._settings.section:
                self._show_section(self._settings.section)
            case "sizes" if before.sizes != self._settings.sizes:
                self._sizes.show(self._settings.sizes)

    def _use_preset(self, number: int, _: object) -> None:
        self._apply("n", number)
        self._controls.show(self._settings)

    def _show_figure(self, robot_id: str, _: object) -> None:
        """A workspace as the source chapter shows it."""
        robot = self.stage.store.get(robot_id)
        if robot != self.stage.now.robot:
            self.stage.change_robot(robot)  # which calls `on_robot`
        for name, value in FIGURE.items():
            self._apply(name, value)
        self._controls.show(self._settings)
        self._start()

    def _show_axes(self) -> None:
        self._axes.show(self.stage.now.robot if self._settings.axes else None, self.stage.units, self.stage.dark)

    def _set_length(self, name: str, units: Units, value: object) -> None:
        """Set a length; an event of a slider in other units is ignored, because it was replaced since."""
        length = self._controls.read_length(value, units)
        if length is not None:
            self._apply(name, length)

    @property
    def _others(self) -> tuple[str, ...]:
        return tuple(robot.id for robot in self.stage.store.robots if robot != self.stage.now.robot)

    # Cloud and clicks

    def _start(self) -> None:
        if self._clouds.start():
            self._picker.clear()
            if self._section is not None:
                self._section.drop_cloud()
        self._listen_clicks()

    def _clear(self) -> None:
        """Stop, and remove everything that belongs to the cloud."""
        self._clouds.clear()
        self._picker.clear()
        self._listen_clicks()
        if self._section is not None:
            self._section.drop_cloud()

    def _listen_clicks(self) -> None:
        self._picker.listen(bool(self._clouds.nodes) and self._settings.clicks)

    def _search(self, ray: object) -> None:
        if self._clouds.nodes:
            self._picker.search(ray, self._clouds.nodes[0], self._settings.size)

    def _new_root(self) -> str:
        """A prefix of node names that was never used before."""
        self._roots += 1
        return f"/workspace-{self._roots}"

    def _fit_view(self) -> None:
        """Fit the default view to clouds, map and axes when they appear, and to the arm when they are gone."""
        clouds, mapped = self._clouds.extents, self._capability.extent
        corners = self._axes.corners
        in_view = (len(clouds), mapped is not None, None if corners is None else self.stage.now.robot)
        if in_view != self._in_view:
            self._in_view = in_view
            self.stage.fit_view(clouds if mapped is None else [*clouds, mapped], corners)

    # Cut

    def _set_cut(self) -> None:
        """Cut along the axis in the settings, near the middle, or not at all."""
        self._cut = None
        if self._settings.axis is not None:
            robots = [self.stage.now.robot, *([self._clouds.other] if self._clouds.other is not None else [])]
            self._cut = cut_of(robots, self._settings.axis, self.stage.now.q)
            self._use(self._settings.with_value("at", self._cut.middle, ()))
        self._controls.show_cut(self._cut, self._settings.at)
        self._clouds.set_cut(self._cut, None)
        self._show_slabs()

    def _show_slabs(self) -> None:
        """Show the slabs on the visible side of the cut."""
        slabs = None if self._cut is None else self._cut.shown(self._settings.at, self._settings.keep)
        self._clouds.show(slabs)
        self._capability.use_look(self._settings.map, self._cut, slabs)

    # Section

    def _show_section(self, visible: bool) -> None:
        if self._section is not None:
            self._section.remove()
            self._section = None
        if visible:
            self._tool = self.stage.now.T_tool[:3, 3]
            self._section = SectionPanel(self.stage, self._new_root(), self.post)

    def _take_section(self, found: object) -> None:
        if self._section is not None:
            robot, section = cast(tuple[Robot, Section | None], found)
            self._section.take(robot, section, self._tool)

    def _take_outline(self, found: object) -> None:
        if self._section is not None:
            robot, outline = cast(tuple[Robot, Section | None], found)
            self._section.take_outline(robot, outline, self._tool)

    def _update_section(self, now: float) -> None:
        """Move the tool's dot, and count new points into the plot."""
        section, nodes = self._section, self._clouds.nodes
        if section is None:
            return
        if self._dot_due and now - self._dotted >= DOT:
            self._dotted, self._dot_due = now, False
            section.tool_at(self._tool)
        due = not self._clouds.busy or now - self._plotted >= REDRAW
        if nodes and due and section.count(nodes[0].cloud, nodes[0].parts):
            self._plotted = now


def _raise(error: object) -> None:
    raise cast(Exception, error)
