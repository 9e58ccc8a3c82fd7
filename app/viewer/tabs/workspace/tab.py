"""The workspace tab: its settings, and the events between its parts.

Each part has a module: `cloud` (points in the scene), `cut`, `pick` (clicks on points), `sizes`, `section`, and
the folder `capability`. Points come from the service's cache of clouds; what else takes long is declared as work.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence, Set
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from app.exports.svg import Plot
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Buttons, Control, Html, Node
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Work, in_background
from app.viewer.feature import Stage
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere, round_points
from app.viewer.tabs.workspace import sizes, views
from app.viewer.tabs.workspace.axes import Axes
from app.viewer.tabs.workspace.capability.panel import Capability
from app.viewer.tabs.workspace.cloud import CloudView
from app.viewer.tabs.workspace.cut import Axis, cut_of
from app.viewer.tabs.workspace.form import FIGURES, PRESETS, cloud, figures_hint, form, is_in_the_book
from app.viewer.tabs.workspace.pick import Click, Clicks, search
from app.viewer.tabs.workspace.postures.panel import Postures
from app.viewer.tabs.workspace.said import Said
from app.viewer.tabs.workspace.section import panel as section
from app.viewer.tabs.workspace.section.plot import Density, frame_of
from app.viewer.tabs.workspace.send_window import SendWindow
from app.viewer.tabs.workspace.settings import WorkspaceSettings
from kin.units import grouped
from kin.workspace import CapabilityMap

REDRAW = 1.0  # s between two updates of the section plot with more points
FIGURE: dict[str, object] = {"n": 20_000, "strategy": "uniform", "by": "one", "axis": None, "axes": True}


class WorkspaceFacts(Facts[WorkspaceSettings]):
    """What the tab knows of the section."""

    @property
    def frame(self) -> Plot | None:
        """The axes of its plot; None: there is none yet, or nothing to plot."""
        found: Plot | None = self.work("frame").value
        return found

    @property
    def image(self) -> str:
        """The cloud in the plot."""
        density, image = self.work("image").value or (None, "")
        return image if density is self.work("density").value else ""


class Workspace(DeclaredFeature[WorkspaceSettings, WorkspaceFacts]):
    """Clouds of tool points, their sizes, their section, and the capability map."""

    key: ClassVar[str] = "workspace"
    title: ClassVar[str] = "Workspace"
    shared: ClassVar[bool] = True
    messages = frozenset({"map"})
    settings_of, facts_of = WorkspaceSettings, WorkspaceFacts

    def __init__(self, stage: Stage) -> None:
        self._said = Said()
        super().__init__(stage)

    def built(self) -> None:
        stage = self.stage
        self._window = SendWindow(stage.client, lambda: self.post("more"))
        self._clouds = CloudView(stage, self._said, self.settings, self._window, lambda: self.post("more"))
        self._clicks = Clicks(stage.client.scene, self.post)
        self._axes = Axes(stage.client.scene)
        self._postures = self.adopt(Postures(stage, self))
        self._capability = self.adopt(Capability(stage, self, self._window, self._open_map))
        self._capability.use_look(self.settings.map, None, None)
        # Events by the first part of their key. A handler takes the other parts, and the value.
        self._handlers: dict[str, Callable[..., None]] = {
            "more": lambda _: None,
            "click": self._click,
            "map": lambda press, value: self._postures.handle(("map", press), value),
        }
        self._clouds.report()

    def panel(self) -> Sequence[Node]:
        s, robot, unit = self.settings, self.stage.arm.now.robot, self.stage.display.units.lengths
        presets = {label: self.event(self.on_preset, number) for label, number in PRESETS.items()}
        nodes: list[Node] = [Control("n"), Buttons(" ", presets, "Common numbers of points", key="presets")]
        if is_in_the_book(robot, self.stage.services.store.robots):
            figures = {label: self.event(self.on_figure, key) for label, key in FIGURES.items()}
            nodes.append(Buttons("As in the book", figures, figures_hint(robot), key="figures"))
        actions = {
            "Start": self.event(self.on_start),
            "Restart": self.event(self.on_start),
            "Pause": self.event(self.on_pause),
            "Continue": self.event(self.on_continue),
            "Stop": self.event(self.on_stop),
            "Clear": self.event(self.on_clear),
        }
        others = tuple(other for other in self.stage.services.store.robots if other != robot)
        nodes += cloud(s, self._said, actions)
        nodes += form(s, self._said, robot, others, unit, self._picked(), self._sizes())
        if s.section:
            f, units = self.read, self.stage.display.units
            nodes.append(section.panel(f.work("section"), f.frame, f.image, f.T[:3, 3], robot, units))
        return nodes

    def _picked(self) -> Html:
        """The numbers of the clicked point, if there was a click."""
        found = self.read.work("pick")
        if self.settings.click is None or not found.finished:
            return Html(str, key="picked")
        return Html(views.picked, (found.value, self.stage.display.units), key="picked")

    def scene(self) -> Sequence[SceneNode]:
        facts = self.facts
        found, click, signed = facts.work("pick").value, self.settings.click, facts.work("outline").value
        nodes = [] if found is None or click is None else [found.mark(click.size)]
        return nodes if signed is None else [*nodes, section.outline(signed, facts.T[:3, 3], facts.q)]

    def _sizes(self) -> Html:
        if not self.settings.sizes:
            return Html(str, key="sizes")
        whole = self.read.work("sizes").value
        args = whole or self.read.work("extent").value, whole is None, self.stage.display.units
        return Html(sizes.html, args, key="sizes")

    # Long work

    def running(self) -> Sequence[Work]:
        robot, stage, works = self.facts.robot, self.stage, list[Work]()
        if self.settings.sizes:  # volume and surface take longer than the rest
            works += [
                Work("extent", lambda arm: stage.services.summaries.facts(arm, effort=None), (robot,)),
                Work("sizes", stage.services.summaries.facts, (robot,)),
            ]
        if self.settings.click is not None:
            works.append(Work("pick", in_background(search), (stage.services.clouds, self.settings.click)))
        return [*works, *self._sections()] if self.settings.section else works

    def _sections(self) -> Iterator[Work]:
        """The section and its outline, and the cloud in its plot."""
        facts, stage, subscribe = self.facts, self.stage, section.subscribe_section
        yield Work("section", subscribe, (stage.services.summaries, facts.robot))
        yield Work("outline", subscribe, (stage.services.summaries, facts.robot, True))
        found = facts.work("section").value
        if found is None or not found.curves:
            return
        yield Work("frame", frame_of, (found,))
        for nodes in self._clouds.nodes[:1] if facts.frame is not None else ():
            yield Work("density", lambda frame, _: Density(frame), (facts.frame, nodes.cloud))
            if (density := facts.work("density").value) is not None:
                counted = stage.services.clouds, nodes.cloud, nodes.parts, density
                redraw = REDRAW if self._clouds.busy else 0.0
                yield Work("image", in_background(section.count), counted, pace=redraw, keep=True)

    def worked(self, key: str) -> None:
        super().worked(key)
        if key == "pick" and self.facts.work(key).value is not None:
            self.post(("do", self.event(self.on_picked), 0, 0))  # a step that can be undone

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        name, *arguments = key if isinstance(key, tuple) else (key,)
        if name in self._handlers:
            self._handlers[name](*arguments, value)
        else:
            super().handle(key, value)
        self.due = 0.0  # the next tick shows everything, and determines when to wake up

    def on_robot(self) -> None:
        self._runner.end()
        self._clear()
        self.for_parts(lambda part: part.on_robot())
        robot = self.stage.arm.now.robot
        self._use(self.settings.for_robot(robot))
        self._set_cut()
        self._show_axes()
        self.refresh()
        self.due = 0.0

    def on_request(self) -> None:
        self._clouds.report()  # shows the locked joints
        self.due = 0.0

    def on_style(self) -> None:
        self._show_axes()
        self._clouds.show_legend()
        super().on_style()

    def on_arm_changed(self, changed: Set[str]) -> None:
        self._window.arm_moved()
        super().on_arm_changed(changed)

    def tick(self, now: float) -> None:
        self._clouds.advance(now)
        self.schedule()
        try:
            super().tick(now)
        finally:
            if self.settings.opened and self._capability.empty:
                self._cut_as(None)
                self.schedule()
            self._fit_view()
            times = self.due, self._clouds.next_tick(now)
            self.due = min((due for due in times if due is not None), default=None)

    def state(self) -> dict[str, object]:
        drawn = bool(self._clouds.nodes)
        return {**super().state(), "drawn": drawn}

    def restore(self, state: dict[str, object]) -> None:
        before, robot = self.settings, self.stage.arm.now.robot
        self._use(replace(before.restored(state, robot), opened=False))
        if self.settings.compare not in (None, *(r.id for r in self.stage.services.store.robots if r != robot)):
            self._use(replace(self.settings, compare=before.compare))  # the robot is gone
        at = self.settings.at
        self._clouds.report()
        self._clouds.resize()
        self._clouds.compare()
        self._set_cut()
        if self.settings.cut is not None:
            self._use(replace(self.settings, at=at))
            self._show_slabs()
        self._clouds.recolour()
        self._show_axes()
        self._listen_clicks()
        if state.get("drawn") is True:
            self._start()
        self.restore_parts(state)
        self.rewrite()
        self.refresh()
        self.due = 0.0

    def remove(self) -> None:
        super().remove()
        self._clear()
        self._axes.remove()

    # Settings

    def _use(self, settings: WorkspaceSettings) -> None:
        self.settings = self._clouds.settings = settings

    def changed(self, path: str) -> None:
        self._use(self.settings)
        match path:
            case "n" | "strategy" | "seed":
                self._clouds.report()  # a cloud of other settings says so
            case "by" | "map":
                self._clouds.recolour()
                self._show_slabs()
            case "size":
                self._clouds.resize()
            case "axis":
                self._use(replace(self.settings, opens=False, opened=False))
                self._set_cut()
            case "at" | "keep":
                self._show_slabs()
            case "compare":
                self._clouds.compare()
                if self.settings.axis is not None:
                    self._set_cut()
                self._clouds.recolour()
            case "clicks":
                self._listen_clicks()
            case "axes":
                self._show_axes()

    def on_preset(self, number: int) -> None:
        """Take a common number of points."""
        self._set(n=number)

    def on_figure(self, robot_id: str) -> None:
        """A workspace as the source chapter shows it."""
        robot = self.stage.services.store.get(robot_id)
        if robot != self.stage.arm.now.robot:
            self.stage.robots.show(robot)  # which calls `on_robot`
        self._set(**FIGURE)
        self._start()

    def _set(self, **values: Any) -> None:
        """Set fields as a visitor does."""
        for name, value in values.items():
            self.change(**{name: value})
            self.changed(name)

    def _show_axes(self) -> None:
        self._axes.show(
            self.stage.arm.now.robot if self.settings.axes else None,
            self.stage.display.units,
            self.stage.display.dark,
        )

    # Cloud and clicks

    def on_start(self) -> None:
        """Sample a cloud."""
        self._start()

    def on_pause(self) -> None:
        """Stop sampling for now."""
        self._clouds.pause()

    def on_continue(self) -> None:
        """Continue after a pause."""
        self._clouds.resume()

    def on_stop(self) -> None:
        """End sampling; the points stay."""
        self._clouds.stop()

    def on_clear(self) -> None:
        """Remove the cloud."""
        self._clear()

    def _start(self) -> None:
        if self._clouds.start():
            self._use(replace(self.settings, click=None))
        self._listen_clicks()

    def _clear(self) -> None:
        """Stop, and remove everything that belongs to the cloud."""
        self._clouds.clear()
        self._use(replace(self.settings, click=None))
        self._listen_clicks()

    def _listen_clicks(self) -> None:
        self._clicks.listen(bool(self._clouds.nodes) and self.settings.clicks)

    def _click(self, ray: object) -> None:
        if self._clouds.nodes:
            self._use(replace(self.settings, click=Click.of(ray, self._clouds.nodes[0], self.settings.size)))

    def on_picked(self) -> None:
        """Move the arm to the configuration of the clicked point."""
        found = self.facts.work("pick").value
        if found is not None:
            title = f"Moved to point {grouped(found.index)}"
            self.stage.arm.move_to(found.q, Notice("hand", title, "The configuration that produced this point."))

    def _fit_view(self) -> None:
        """Fit the default view to clouds, map and axes when they appear, and to the arm when they are gone."""
        clouds, mapped = self._clouds.extents, self._capability.extent
        corners = self._axes.corners
        in_view = (len(clouds), mapped is not None, None if corners is None else self.stage.arm.now.robot)
        if in_view != self.settings.in_view:
            self._use(replace(self.settings, in_view=in_view))
            self.stage.camera.fit(clouds if mapped is None else [*clouds, mapped], corners)

    def extents(self) -> Sequence[Sphere]:
        mapped, corners = self._capability.extent, self._axes.corners
        found = [*self._clouds.extents, *([] if mapped is None else [mapped]), *self._postures.extents()]
        return found if corners is None else [*found, round_points(corners)]

    # Cut

    def _open_map(self, found: CapabilityMap) -> None:
        """Cut a new map, a solid, open along the arm, so that its inside is seen; a flat one has none."""
        if self.settings.opens and self.settings.axis is None and min(found.grid.shape) > 1:
            self._cut_as("arm")

    def _cut_as(self, axis: Axis | None) -> None:
        """Cut without being asked, and keep the side that is farther from the camera; None: no longer."""
        self._use(replace(self.settings, axis=axis, opened=axis is not None))
        self._set_cut()
        if (cut := self.settings.cut) is not None:
            seen = float(np.array(cut.normal) @ self.stage.camera.toward)
            self._use(replace(self.settings, keep="below" if seen >= 0.0 else "above"))
            self._show_slabs()

    def _set_cut(self) -> None:
        """Cut along the axis in the settings, near the middle, or not at all."""
        cut = None
        if self.settings.axis is not None:
            robots = [self.stage.arm.now.robot, *([self._clouds.other] if self._clouds.other is not None else [])]
            cut = cut_of(robots, self.settings.axis, self.stage.arm.now.q)
            self._use(replace(self.settings, at=cut.middle))
        self._use(replace(self.settings, cut=cut))
        self._clouds.set_cut(cut, None)
        self._show_slabs()

    def _show_slabs(self) -> None:
        """Show the slabs on the visible side of the cut."""
        s = self.settings
        slabs = None if s.cut is None else s.cut.shown(s.at, s.keep)
        self._clouds.show(slabs)
        self._capability.use_look(s.map, s.cut, slabs)
