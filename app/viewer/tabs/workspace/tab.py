"""The workspace tab: its settings, and the events between its parts.

Each part has a module: `cloud` (the stream of points), `cut`, `pick` (clicks on points), `axes`, `sizes`,
`section`, and the folders `capability` and `postures`. All that takes long is declared as work; what is known of
the clouds stands in `facts`.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.panel import Buttons, Control, Html, Node
from app.viewer.declared.scene import Lazy, SceneView
from app.viewer.declared.scene import Node as SceneNode
from app.viewer.declared.work import Work, in_background
from app.viewer.panel.status import Notice
from app.viewer.scene.camera import Sphere, round_points
from app.viewer.scene.motion import FRAME
from app.viewer.tabs.workspace import axes, sizes, views
from app.viewer.tabs.workspace.capability.panel import Capability
from app.viewer.tabs.workspace.cloud import nodes as points_of
from app.viewer.tabs.workspace.cloud import stream
from app.viewer.tabs.workspace.cut import Axis, cut_of
from app.viewer.tabs.workspace.facts import WorkspaceFacts
from app.viewer.tabs.workspace.form import FIGURES, PRESETS, cloud, figures_hint, form, is_in_the_book
from app.viewer.tabs.workspace.pick import Click, Clicks, search
from app.viewer.tabs.workspace.postures.panel import Postures
from app.viewer.tabs.workspace.section import panel as section
from app.viewer.tabs.workspace.section.plot import Density, frame_of
from app.viewer.tabs.workspace.send_window import SendWindow
from app.viewer.tabs.workspace.settings import WorkspaceSettings
from kin.units import grouped
from kin.workspace import CapabilityMap

REDRAW = 1.0  # s between two updates of the section plot with more points
FIGURE: dict[str, object] = {"n": 20_000, "strategy": "uniform", "by": "one", "axis": None, "axes": True}


class Workspace(DeclaredFeature[WorkspaceSettings, WorkspaceFacts]):
    """Clouds of tool points, their sizes, their section, and the capability map."""

    key: ClassVar[str] = "workspace"
    title: ClassVar[str] = "Workspace"
    shared: ClassVar[bool] = True
    messages = frozenset({"map"})
    settings_of, facts_of = WorkspaceSettings, WorkspaceFacts

    def built(self) -> None:
        stage = self.stage
        self._window = SendWindow(stage.client, self._wake)
        # Apart from the other drawings: a question removes those, and it would take long to send points again.
        self._points = SceneView(stage.client.scene, self.key, self.post)
        self._clicks = Clicks(stage.client.scene, self.post)
        self._postures = self.adopt(Postures(stage, self))
        self._capability = self.adopt(Capability(stage, self, self._window, self._open_map))
        self._capability.use_look(self.settings.map, None, None)

    def sources(self) -> Mapping[str, Any]:
        return {"find": self.stage.services.store.get}

    def panel(self) -> Sequence[Node]:
        f, robot = self.read, self.stage.arm.now.robot
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
        nodes += [*cloud(f, actions), *form(f, others, self._picked(), self._sizes())]
        if f.settings.section:
            nodes.append(section.panel(f.work("section"), f.frame, f.image, f.T[:3, 3], robot, f.units))
        return nodes

    def _picked(self) -> Html:
        """The numbers of the clicked point, if there was a click."""
        found = self.read.work("pick")
        if self.settings.click is None or not found.finished:
            return Html(str, key="picked")
        return Html(views.picked, (found.value, self.stage.display.units), key="picked")

    def scene(self) -> Sequence[SceneNode | Lazy]:
        facts, s, nodes = self.facts, self.settings, list[SceneNode | Lazy]()
        found, signed = facts.work("pick").value, facts.work("outline").value
        if found is not None and s.click is not None:
            nodes.append(found.mark(s.click.size))
        if signed is not None:
            nodes.append(section.outline(signed, facts.T[:3, 3], facts.q))
        if s.axes:
            nodes.append(Lazy("axes", axes.nodes, (facts.robot, facts.units, self.stage.display.dark)))
        return nodes

    def _sizes(self) -> Html:
        if not self.settings.sizes:
            return Html(str, key="sizes")
        whole = self.read.work("sizes").value
        args = whole or self.read.work("extent").value, whole is None, self.stage.display.units
        return Html(sizes.html, args, key="sizes")

    # Long work

    def running(self) -> Sequence[Work]:
        f, robot, stage, works = self.facts, self.facts.robot, self.stage, list[Work]()
        if self.settings.sizes:  # volume and surface take longer than the rest
            works += [
                Work("extent", lambda arm: stage.services.summaries.facts(arm, effort=None), (robot,)),
                Work("sizes", stage.services.summaries.facts, (robot,)),
            ]
        if self.settings.click is not None:
            works.append(Work("pick", in_background(search), (stage.services.clouds, self.settings.click)))
        if self.settings.section:
            works += self._sections()
        if f.wanted:  # last: points come all the time
            args = stage.services.clouds, self._window, self._wake, f.wanted, self.settings.flow == "running"
            works.append(Work("cloud", stream, args, every=FRAME, goes_on=True))
        return works

    def _sections(self) -> Iterator[Work]:
        """The section and its outline, and the cloud in its plot."""
        facts, stage, subscribe = self.facts, self.stage, section.subscribe_section
        yield Work("section", subscribe, (stage.services.summaries, facts.robot))
        yield Work("outline", subscribe, (stage.services.summaries, facts.robot, True))
        found = facts.work("section").value
        if found is None or not found.curves:
            return
        yield Work("frame", frame_of, (found,))
        for drawn in facts.clouds[:1] if facts.frame is not None else ():
            yield Work("density", lambda frame, _: Density(frame), (facts.frame, drawn.cloud))
            if (density := facts.work("density").value) is not None:
                counted = stage.services.clouds, drawn.measured, drawn.parts, density
                redraw = REDRAW if facts.busy else 0.0
                yield Work("image", in_background(section.count), counted, pace=redraw, keep=True)

    def worked(self, key: str) -> None:
        if key == "cloud" and self.facts.work(key).error is not None and self.facts.unfinished:
            self.change(flow="paused")
        super().worked(key)
        if key == "pick" and self.facts.work(key).value is not None:
            self.post(("do", self.event(self.on_picked), 0, 0))  # a step that can be undone

    # Events

    def _wake(self) -> None:
        """Go on: a part is computed, or points have arrived. Any thread may call it."""
        self.post("more")

    def handle(self, key: Hashable, value: object) -> None:
        if key == "more":
            self.due = 0.0  # nothing is to be shown yet
        else:
            super().handle(key, value)

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case "click":
                for drawn in self.facts.clouds[:1]:
                    self.change(click=Click.of(value, drawn, self.facts.shown, self.settings.size))
            case ("map", press):
                self._postures.handle(("map", press), value)
            case _:
                super().heard(key, value)

    def on_arm_changed(self, changed: Set[str]) -> None:
        self._window.arm_moved()
        super().on_arm_changed(changed)

    def refresh(self) -> None:
        super().refresh()
        f, s = self.facts, self.settings
        self._points.show([Lazy("clouds", points_of, (f.sheets, f.visible, s.size))])
        self._clicks.listen(s.cloud is not None and s.clicks)

    def tick(self, now: float) -> None:
        try:
            super().tick(now)
        finally:
            if self.settings.opened and self._capability.empty:
                self._cut_as(None)
            self._fit_view()

    def state(self) -> dict[str, object]:
        return {**super().state(), "drawn": self.settings.cloud is not None}

    def restore(self, state: dict[str, object]) -> None:
        before, robot = self.settings, self.stage.arm.now.robot
        self.settings = replace(before.restored(state, robot), opened=False)
        if self.settings.compare not in (None, *(r.id for r in self.stage.services.store.robots if r != robot)):
            self.change(compare=before.compare)  # the robot is gone
        at = self.settings.at
        self._set_cut()
        if self.settings.cut is not None:
            self.change(at=at)
        self._show_slabs()
        if state.get("drawn") is True:
            self.on_start()
        self.restore_parts(state)
        self.rewrite()
        self._begin()

    def remove(self) -> None:
        super().remove()
        self._points.remove()
        self._clicks.listen(False)

    # Settings

    def changed(self, path: str) -> None:
        match path:
            case "map" | "at" | "keep":
                self._show_slabs()
            case "axis":
                self.change(opens=False, opened=False)
                self._set_cut()
            case "compare" if self.settings.axis is not None:
                self._set_cut()

    def on_preset(self, number: int) -> None:
        """Take a common number of points."""
        self._set(n=number)

    def on_figure(self, robot_id: str) -> None:
        """A workspace as the source chapter shows it."""
        robot = self.stage.services.store.get(robot_id)
        if robot != self.stage.arm.now.robot:
            self.stage.robots.show(robot)  # which calls `on_robot`
        self._set(**FIGURE)
        self.on_start()

    def _set(self, **values: Any) -> None:
        """Set fields as a visitor does."""
        for name, value in values.items():
            self.change(**{name: value})
            self.changed(name)

    # Cloud and clicks

    def on_start(self) -> None:
        """Sample a new cloud, or go on with the one that is asked for."""
        self.invalidate()
        if self.settings.cloud != self.facts.requested:
            self.change(cloud=self.facts.requested, click=None)
        self.change(flow="running")

    def on_pause(self) -> None:
        """Stop sampling for now."""
        if self.facts.unfinished:
            self.change(flow="paused")

    def on_continue(self) -> None:
        """Continue after a pause."""
        self.change(flow="running")

    def on_stop(self) -> None:
        """End sampling; the points stay."""
        if self.facts.unfinished:
            self.change(flow="stopped")

    def on_clear(self) -> None:
        """Remove everything that belongs to the cloud."""
        self.change(cloud=None, click=None)

    def on_picked(self) -> None:
        """Move the arm to the configuration of the clicked point."""
        found = self.facts.work("pick").value
        if found is not None:
            title = f"Moved to point {grouped(found.index)}"
            self.stage.arm.move_to(found.q, Notice("hand", title, "The configuration that produced this point."))

    def _fit_view(self) -> None:
        """Fit the default view to clouds, map and axes when they appear, and to the arm when they are gone."""
        clouds, mapped = self._spheres, self._capability.extent
        corners = self.facts.corners
        in_view = (len(clouds), mapped is not None, None if corners is None else self.stage.arm.now.robot)
        if in_view != self.settings.in_view:
            self.change(in_view=in_view)
            self.stage.camera.fit(clouds if mapped is None else [*clouds, mapped], corners)

    @property
    def _spheres(self) -> list[Sphere]:
        """Around the clouds."""
        return [one.extent for one in self.facts.clouds if one.extent is not None]

    def extents(self) -> Sequence[Sphere]:
        mapped, corners = self._capability.extent, self.facts.corners
        found = [*self._spheres, *([] if mapped is None else [mapped]), *self._postures.extents()]
        return found if corners is None else [*found, round_points(corners)]

    # Cut

    def _open_map(self, found: CapabilityMap) -> None:
        """Cut a new map, a solid, open along the arm, so that its inside is seen; a flat one has none."""
        if self.settings.opens and self.settings.axis is None and min(found.grid.shape) > 1:
            self._cut_as("arm")

    def _cut_as(self, axis: Axis | None) -> None:
        """Cut without being asked, and keep the side that is farther from the camera; None: no longer."""
        self.change(axis=axis, opened=axis is not None)
        self._set_cut()
        if (cut := self.settings.cut) is not None:
            seen = float(np.array(cut.normal) @ self.stage.camera.toward)
            self.change(keep="below" if seen >= 0.0 else "above")
            self._show_slabs()
        self.schedule()

    def _set_cut(self) -> None:
        """Cut along the axis in the settings, near the middle, or not at all."""
        s, cuts = self.settings, {sheet.cut for sheet in self.facts.sheets}
        before = {**dict(s.seen), s.cut: self.facts.shown(s.cut)}
        cut, at = None, s.at
        self.invalidate()
        if s.axis is not None:
            others = [] if self.facts.other is None else [self.facts.other]
            cut = cut_of([self.facts.robot, *others], s.axis, self.facts.q)
            at = cut.middle
        self.change(cut=cut, at=at, seen=tuple(one for one in before.items() if one[0] in cuts))
        self._show_slabs()

    def _show_slabs(self) -> None:
        """Show the slabs on the visible side of the cut."""
        self.invalidate()
        self._capability.use_look(self.settings.map, self.settings.cut, self.facts.slabs)
