"""The workspace tab: what happens between its controls, the clouds in the picture, and what is told of them.

The worker paints and sends one part of a cloud at a time, so a dragged arm never waits for more than one. All that
takes longer happens in threads that post: parts are computed by :mod:`app.shared.clouds`, sizes and sections once
per arm, a clicked point is looked for in all parts again. A cloud has no configurations: its description and a
point's
index give them exactly, whenever they are wanted.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import ClassVar, cast

import numpy as np
import viser

import kin
from app.shared.clouds import Cloud
from app.viewer.feature import Feature, Stage
from app.viewer.panel import assign
from app.viewer.panel.status import Notice
from app.viewer.scene.motion import FRAME
from app.viewer.tabs.workspace import colours, known, sizes, words
from app.viewer.tabs.workspace.beside import Plotted, SectionPanel, beside
from app.viewer.tabs.workspace.capability.folder import Capability
from app.viewer.tabs.workspace.controls import Controls
from app.viewer.tabs.workspace.cut import Cut, cut_of
from app.viewer.tabs.workspace.drawing import Drawing, Look
from app.viewer.tabs.workspace.flow import Flow
from app.viewer.tabs.workspace.pick import Candidate, nearest
from app.viewer.tabs.workspace.wishes import Wishes, default_size
from kin import InputError, Robot, WorkspaceFacts
from kin.transforms import Array, finite_array
from kin.units import Units

REPORT = 0.2  # s between two reports of progress
REDRAW = 1.0  # s between two drawings of the section with more points
DOT = 0.05  # s between two places of the tool in the section
REST = 0.25  # s: while something is on its way that wakes the worker by itself
MOVED = 0.3  # s after its last picture the arm counts as moving
SPARING = 0.12  # s between two parts while it does


class Workspace(Feature):
    """Clouds of tool points, their sizes, their section, and the capability map."""

    key: ClassVar[str] = "workspace"
    title: ClassVar[str] = "Workspace"

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._wishes = Wishes(size=default_size(stage.robot))
        self._controls = Controls(
            stage.client.gui, self._wishes, stage.robot, stage.store.robots, stage.units, self.post
        )
        self._flow = Flow(stage.client, lambda: self.post("more"))
        self._drawings: list[Drawing] = []
        self._running = False
        self._cut: Cut | None = None
        self._roots = 0
        self._begun = self._drawn_for = 0.0  # when it last began or went on, and how long before that
        self._reported = self._plotted = self._dotted = self._moved = self._drawn = 0.0
        self._picks = 0
        self._mark: viser.IcosphereHandle | None = None
        self._clicks: Callable[[viser.SceneClickEvent], None] | None = None
        self._panel: SectionPanel | None = None
        self._found: tuple[WorkspaceFacts, bool] | None = None  # sizes, and whether that is all of them
        self._pick: tuple[int, Array, Array] | None = None  # the point clicked on: index, configuration, place
        self._tool = kin.fk(stage.robot, stage.q)[:3, 3]
        self._dot_due = False
        self._seen: tuple[int, bool] = (0, False)  # clouds and a map the view has room for
        self._capability = Capability(
            stage,
            self._flow,
            self._post_capability,
            self._new_root,
            self._wishes.map,
        )
        self._report()

    # What is posted

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case "more":
                pass
            case "failed":
                raise cast(Exception, value)
            case "start":
                self._start()
            case "pause":
                self._pause()
            case "cancel":
                self._clear()
            case "click":
                self._click(value)
            case "picked":
                self._picked(*cast(tuple[int, Candidate | None, Array | None], value))
            case "facts":
                self._facts(*cast(tuple[Robot, WorkspaceFacts, bool], value))
            case "crossed":
                if self._panel is not None:
                    self._panel.crossed(*cast(tuple[Robot, known.Cross], value), self._tool)
            case "plotted":
                if self._panel is not None:
                    self._panel.plotted(cast(Plotted, value))
            case ("capability", wish):
                self._capability.handle(wish, value)
            case ("preset", int(number)):
                self._apply("n", number)
                self._controls.show(self._wishes)
            case (("size" | "at") as name, Units() as units):
                length = self._controls.read_length(value, units)
                if length is not None:
                    self._apply(name, length)
            case str(name):
                self._apply(name, self._controls.read(name, value))
            case _:
                raise KeyError(key)
        self.due = 0.0  # see to it at once, and then tell when next

    def on_robot(self) -> None:
        self._clear()
        self._capability.clear()
        robot = self.stage.robot
        self._tool = kin.fk(robot, robot.q_home)[:3, 3]
        self._controls.of_robot(robot)
        self._wishes = self._wishes.restored({"size": default_size(robot), "axis": None, "compare": None}, ())
        self._controls.show(self._wishes)
        self._set_cut(None)
        if self._panel is not None:
            self._section(False)
            self._section(True)
        self._sizes(self._wishes.sizes)
        self.due = 0.0

    def on_question(self) -> None:
        self._report()  # what is locked shows there

    def on_style(self) -> None:
        units = self.stage.units
        self._controls.use(units, self._wishes, self._cut)
        self._show_legend()
        self._tell_pick()
        self._tell_sizes()
        if self._panel is not None:
            self._panel.use(units)
        self._capability.restyle()

    def on_picture(self, T_base_tool: Array) -> None:
        self._moved = time.perf_counter()
        if self._panel is None:
            return
        self._tool = T_base_tool[:3, 3]
        self._panel.turn(self._tool)
        self._dot_due = True
        self.due = min(self.due, DOT) if self.due is not None else DOT

    def tick(self, now: float) -> None:
        if self._drawings:
            self._advance(now)
        if self._panel is not None:
            if self._dot_due and now - self._dotted >= DOT:
                self._dotted, self._dot_due = now, False
                self._panel.tool_at(self._tool)
            done = self._drawings and not self._busy
            if self._drawings and (done or now - self._plotted >= REDRAW):
                own = self._drawings[0]
                if self._panel.count(own.cloud, own.parts):
                    self._plotted = now
        try:
            self._capability.tick(now, now - self._moved < MOVED)
            self._make_room()
        finally:
            wishes = (self._next(now), self._capability.due)
            self.due = min((wish for wish in wishes if wish is not None), default=None)

    def state(self) -> dict[str, object]:
        drawn = bool(self._drawings)
        return {**self._wishes.state(), "drawn": drawn, "capability": self._capability.state()}

    def restore(self, state: dict[str, object]) -> None:
        wishes = self._wishes.restored(state, self._others)
        for name, value in wishes.state().items():
            if name not in ("axis", "at"):
                self._apply(name, value)
        self._apply("axis", wishes.axis)
        if wishes.axis is not None:
            self._apply("at", wishes.at)
            self._controls.show_cut(self._cut, self._wishes.at)
        self._controls.show(self._wishes)
        if state.get("drawn") is True:
            self._start()
        self._capability.restore(state.get("capability"))
        self.due = 0.0

    def on_leave(self) -> None:
        self._capability.leave()

    def remove(self) -> None:
        self._clear()
        self._capability.clear()
        self._section(False)

    def _post_capability(self, key: Hashable, value: object = None) -> None:
        self.post(("capability", key), value)

    # The cloud

    def _start(self) -> None:
        cloud = self._cloud()
        if self._drawings and not self._running and self._busy_or_more and self._same(cloud):
            self._go_on(True)
            return
        self._clear()
        self._time(True)
        self._drawings = [self._drawing(cloud, 0)]
        if self._other is not None:
            self._drawings.append(self._drawing(replace(cloud, robot=self._other, locked=None), 1))
        self._show_cut()
        self._listen_clicks()
        self._report()

    def _pause(self) -> None:
        if self._drawings and self._busy_or_more:
            self._go_on(not self._running)

    def _go_on(self, running: bool) -> None:
        self._time(running)
        for drawing in self._drawings:
            drawing.resume(running)
        self._report()

    def _time(self, running: bool) -> None:
        """Start or stop the clock that the speed is told by."""
        now = time.perf_counter()
        if self._running:
            self._drawn_for += now - self._begun
        self._begun, self._running = now, running

    def _clear(self) -> None:
        """Stop, and take away all that belongs to the cloud."""
        for drawing in self._drawings:
            drawing.remove()
        self._drawings = []
        self._running = False
        self._drawn_for = 0.0
        self._show_legend()
        self._forget_pick()
        self._listen_clicks()
        if self._panel is not None:
            self._panel.forget()
        self._report()

    def _advance(self, now: float) -> None:
        """Draw one part of the cloud that is behind."""
        ready = [drawing for drawing in self._drawings if drawing.ready]
        if ready and self._room(now):
            self._drawn = now
            try:
                self._flow.sent(min(ready, key=lambda drawing: drawing.points).step())
            except Exception:
                self._time(False)
                for drawing in self._drawings:
                    drawing.running = False
                self._report()
                raise
            if not self._controls.legend.content:
                self._show_legend()
        if not self._busy:
            if self._running:
                self._time(False)
            self._report()
        elif now - self._reported >= REPORT:
            self._report()

    def _next(self, now: float) -> float | None:
        """Seconds until the next tick."""
        if self._dot_due:
            return DOT
        if not self._drawings or not (self._running or self._busy):
            return None
        if not any(drawing.ready for drawing in self._drawings):
            return REST
        return FRAME if self._room(now) else min(REST, SPARING)

    def _room(self, now: float) -> bool:
        """Whether a part may be sent now: while the arm moves its pictures go first."""
        moving = now - self._moved < MOVED
        return self._flow.open(moving) and (not moving or now - self._drawn >= SPARING)

    @property
    def _busy(self) -> bool:
        return any(drawing.busy for drawing in self._drawings)

    @property
    def _busy_or_more(self) -> bool:
        return self._busy or any(drawing.parts < drawing.cloud.parts for drawing in self._drawings)

    def _cloud(self) -> Cloud:
        """The cloud of the arm on show that is wished for, with the joints locked that are now."""
        wishes = self._wishes
        return Cloud(self.stage.robot, wishes.n, wishes.seed, wishes.strategy, locked=self.stage.locked)

    def _same(self, cloud: Cloud) -> bool:
        """Whether it is the one in the picture, whatever that measures."""
        return replace(self._drawings[0].cloud, measures=cloud.measures) == cloud

    def _drawing(self, cloud: Cloud, which: int) -> Drawing:
        drawing = Drawing(
            self.stage.client.scene,
            self.stage.clouds,
            cloud,
            self._look(which),
            self._wishes.size,
            self._new_root(),
            lambda: self.post("more"),
        )
        drawing.resume(self._running)
        return drawing

    def _new_root(self) -> str:
        self._roots += 1
        return f"/workspace-{self._roots}"

    def _make_room(self) -> None:
        """Have what is drawn in view as soon as there is something of it, and the arm alone when all is gone."""
        clouds = [drawing.extent for drawing in self._drawings if drawing.extent is not None]
        mapped = self._capability.extent
        seen = (len(clouds), mapped is not None)
        if seen != self._seen:
            self._seen = seen
            self.stage.make_room(clouds if mapped is None else [*clouds, mapped])

    # What it looks like

    def _apply(self, name: str, value: object) -> None:
        """Take a setting, and let the picture follow; raises `InputError` for one that cannot be."""
        before = self._wishes
        self._wishes = before.having(name, value, self._others)
        match name:
            case "by" | "map":
                self._relook()
            case "size":
                for drawing in self._drawings:
                    drawing.resize(self._wishes.size)
            case "axis":
                self._set_cut(self._new_cut())
            case "at" | "keep":
                self._show_cut()
            case "compare":
                self._compare()
            case "clicks":
                self._listen_clicks()
            case "section" if before.section != self._wishes.section:
                self._section(self._wishes.section)
            case "sizes" if before.sizes != self._wishes.sizes:
                self._sizes(self._wishes.sizes)

    @property
    def _others(self) -> tuple[str, ...]:
        return tuple(robot.id for robot in self.stage.store.robots if robot != self.stage.robot)

    @property
    def _other(self) -> Robot | None:
        return None if self._wishes.compare is None else self.stage.store.get(self._wishes.compare)

    def _look(self, which: int) -> Look:
        by: colours.By = "one" if self._other is not None else self._wishes.by
        return Look(by, self._wishes.map, (colours.OWN, colours.OTHER)[which], self._cut)

    def _relook(self) -> None:
        for which, drawing in enumerate(self._drawings):
            drawing.relook(self._look(which))
        self._show_cut()
        self._show_legend()

    def _show_legend(self) -> None:
        """What the colours tell, once there are any: before, nothing has to be known of the arm."""
        if not any(drawing.parts for drawing in self._drawings):
            _put(self._controls.legend, "")
            return
        robot, other = self.stage.robot, self._other
        if other is not None:
            content = colours.names_legend([(colours.OWN, robot.name), (colours.OTHER, other.name)])
        elif self._wishes.by == "one":
            content = colours.names_legend([(colours.OWN, robot.name)])
        else:
            content = colours.legend(colours.scale_of(robot, self._wishes.by), self._wishes.map, self.stage.units)
        _put(self._controls.legend, content)

    def _compare(self) -> None:
        for drawing in self._drawings[1:]:
            drawing.remove()
        del self._drawings[1:]
        other = self._other
        if self._drawings and other is not None:
            own = self._drawings[0].cloud
            own_done = self._drawings[0].parts == own.parts
            cloud = replace(own, robot=other, measures=(), locked=None)
            if own_done and not self._running:
                self._time(True)
            self._drawings.append(self._drawing(cloud, 1))
        if self._wishes.axis is not None:
            self._set_cut(self._new_cut())
        self._relook()

    def _new_cut(self) -> Cut | None:
        if self._wishes.axis is None:
            return None
        robots = [self.stage.robot, *([self._other] if self._other is not None else [])]
        return cut_of(robots, self._wishes.axis, self.stage.q)

    def _set_cut(self, cut: Cut | None) -> None:
        """Cut in another direction, near the middle."""
        self._cut = cut
        if cut is not None:
            self._wishes = self._wishes.having("at", cut.middle, ())
        self._controls.show_cut(cut, self._wishes.at)
        self._relook()

    def _show_cut(self) -> None:
        shown = None if self._cut is None else self._cut.shown(self._wishes.at, self._wishes.keep)
        for drawing in self._drawings:
            drawing.show(shown)
        self._capability.look(self._wishes.map, self._cut, shown)

    # Clicks

    def _listen_clicks(self) -> None:
        wanted = bool(self._drawings) and self._wishes.clicks
        scene = self.stage.client.scene
        if self._clicks is not None and not wanted:
            scene.remove_click_callback(self._clicks)
            self._clicks = None
        elif self._clicks is None and wanted:

            async def clicked(event: viser.SceneClickEvent) -> None:
                self.post("click", (event.ray_origin, event.ray_direction))

            self._clicks = scene.on_click()(clicked)  # type: ignore[arg-type]

    def _click(self, ray: object) -> None:
        """Look for the point that this ray means, beside the worker: in four million points that takes a while."""
        if not self._drawings or not isinstance(ray, tuple) or len(ray) != 2:
            return
        origin, direction = finite_array("ray", ray[0], (3,)), finite_array("ray", ray[1], (3,))
        length = float(np.linalg.norm(direction))
        if not length > 0.0:
            raise InputError("ray", ray, "a direction that is not zero")
        self._picks += 1
        number = self._picks
        drawing, size = self._drawings[0], self._wishes.size
        cloud, parts, visible = drawing.cloud, drawing.parts, drawing.seen()

        def search() -> None:
            best: Candidate | None = None
            for i in range(parts):
                if number != self._picks:
                    return  # clicked again, or gone
                chunk = self.stage.clouds.part(cloud, i).result()
                found = nearest(chunk.points, chunk.start, visible(chunk.points), origin, direction / length, size)
                if found is not None and found.before(best):
                    best = found
            q = None
            if best is not None:
                q = kin.configuration_at(
                    cloud.robot, best.index, seed=cloud.seed, strategy=cloud.strategy, locked=cloud.locked
                )
            self.post("picked", (number, best, q))

        beside(search, "pick", self.post)

    def _picked(self, number: int, found: Candidate | None, q: Array | None) -> None:
        if number != self._picks or not self._drawings:
            return
        if found is None or q is None:
            self._pick = None
            self._controls.picked.content = words.nothing_picked()
            return
        robot = self.stage.robot
        point = kin.fk(robot, q)[:3, 3]
        if self._mark is not None:
            self._mark.remove()
        self._mark = self.stage.client.scene.add_icosphere(
            self._new_root(), radius=max(1.2 * self._wishes.size, 0.008 * robot.reach), color=(213, 94, 0),
            position=point,
        )  # fmt: skip
        self._pick = (found.index, q, point)
        self._tell_pick()
        self.stage.go(
            q, Notice("hand", f"Moved to point {words.grouped(found.index)}", "The configuration that drew it.")
        )

    def _forget_pick(self) -> None:
        self._picks += 1
        if self._mark is not None:
            self._mark.remove()
            self._mark = None
        self._pick = None
        self._controls.picked.content = ""

    # What is told

    def _tell_pick(self) -> None:
        if self._pick is not None:
            cloud = self._drawings[0].cloud
            _put(self._controls.picked, words.picked(cloud.robot, cloud.locked, *self._pick, self.stage.units))

    def _tell_sizes(self) -> None:
        if self._found is not None:
            found, whole = self._found
            _put(self._controls.sizes, sizes.html(found, not whole, self.stage.units))

    def _report(self) -> None:
        now = time.perf_counter()
        self._reported = now
        drawn = sum(drawing.points for drawing in self._drawings)
        total = sum(drawing.cloud.n for drawing in self._drawings)
        spent = self._drawn_for + (now - self._begun if self._running else 0.0)
        state: words.State = "ready"
        if self._drawings:
            more = drawn < total
            state = "running" if self._running and more else "paused" if more else "done"
            if state == "running" and not drawn and spent > REST:
                state = "preparing"
            if self._busy and not self._running:
                state = "recolouring"
        speed = drawn / spent if spent > 0.0 else 0.0
        locked = self._drawings[0].cloud.locked if self._drawings else self.stage.locked
        line = words.progress(state, drawn, total or self._wishes.n, speed, locked)
        percent = round(100.0 * drawn / total, 1) if total else 0.0
        if self._controls.line.content != line:
            self._controls.line.content = line
        if self._controls.bar.value != percent:
            assign(self._controls.bar, percent)

    def _section(self, wanted: bool) -> None:
        if self._panel is not None:
            self._panel.remove()
            self._panel = None
        if wanted:
            stage = self.stage
            self._tool = kin.fk(stage.robot, stage.q)[:3, 3]
            self._panel = SectionPanel(
                stage.client, stage.robot, stage.clouds, stage.summaries, self._new_root(), stage.units, self.post
            )

    def _sizes(self, wanted: bool) -> None:
        self._found = None
        self._controls.sizes.content = sizes.WAIT if wanted else ""
        if not wanted:
            return
        robot, summaries = self.stage.robot, self.stage.summaries

        def work() -> None:
            for volume in (False, True):
                self.post("facts", (robot, known.facts(summaries, robot, volume), volume))

        beside(work, "sizes", self.post)

    def _facts(self, robot: Robot, found: WorkspaceFacts, whole: bool) -> None:
        if self._wishes.sizes and robot == self.stage.robot:
            self._found = (found, whole)
            self._tell_sizes()


def _put(element: viser.GuiHtmlHandle, content: str) -> None:
    if element.content != content:
        element.content = content
