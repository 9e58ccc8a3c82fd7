"""The parts of the tab *Program* in the panel and in the scene; each is sent again only when it has changed."""

from __future__ import annotations

from collections.abc import Sequence

from app.exports.motion_snippets import SNIPPETS
from app.viewer.feature import Stage
from app.viewer.live.tape import BYTES
from app.viewer.panel import update_html
from app.viewer.panel.share import box_html
from app.viewer.scene.camera import Sphere, round_points
from app.viewer.tabs.program import views, ways
from app.viewer.tabs.program.compare import Choice
from app.viewer.tabs.program.drawing import Drawing, Shown
from app.viewer.tabs.program.faults import Fault
from app.viewer.tabs.program.files import LARGEST, MOTIONS
from app.viewer.tabs.program.items import Items
from app.viewer.tabs.program.planning import Plan
from app.viewer.tabs.program.playback import Playback
from app.viewer.tabs.program.plot import plot_html
from app.viewer.tabs.program.postures import Chart, html
from app.viewer.tabs.program.typed import Fields
from app.viewer.tabs.program.ways import Search, Settings
from app.viewer.views.templates import render
from kin.motion import Motion

PARTS = ("player", "clock", "list", "postures", "way", "plot", "summary", "compare", "files")


class Screen:
    """What a visitor sees of a program.

    Attributes:
        shown: what is drawn in the scene.
        joint: the one in the plots; None: all.
        chosen: index of the item that is open.
        by_pose: whether the open item shows the pose of the tool, not joint values.
        language: the one in which the program can be copied.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self.shown = Shown()
        self.joint: int | None = None
        self.chosen: int | None = None
        self.by_pose = False
        self.language = next(iter(SNIPPETS))
        self._revision = 0
        self._drawing: Drawing | None = None
        self._drawn: tuple[object, ...] = ()
        gui = stage.client.gui
        self._html = {name: gui.add_html("") for name in PARTS}

    def _show(self, name: str, html: str) -> None:
        update_html(self._html[name], html)

    @property
    def fields(self) -> Fields:
        """How values are written and read."""
        arm = self._stage.now
        stage = self._stage
        return Fields(arm.robot, stage.units, stage.frames.pose(arm.robot, arm.goal), arm.task)

    def player(self, playback: Playback, any_items: bool, playable: bool) -> None:
        """Buttons, slider of time, and the legend of the path."""
        top = 0.0 if self._drawing is None else self._drawing.top_speed
        shown = views.player(playback.player, playback.motion, playable, self.shown, top, self._stage.units)
        self._show("player", shown if any_items else "")

    def clock(self, playback: Playback) -> None:
        """The present moment."""
        self._show("clock", views.clock(playback.player, playback.duration, playback.here))

    def list(self, items: Items, plan: Plan | None, fault: Fault | None, loop: bool, anew: bool = False) -> None:
        """The waypoints; `anew`: what was typed into the fields is replaced."""
        self._revision += anew
        self._show(
            "list",
            views.items_html(items, self.chosen, plan, fault, loop, self.fields, self.by_pose, self._revision),
        )

    def postures(self, chart: Chart | None) -> None:
        """The chart of postures on the way to a waypoint."""
        self._show("postures", "" if chart is None else html(chart, self._stage.units))

    def way(self, search: Search | None, settings: Settings) -> None:
        """The form in which a way is searched, and how far the search is."""
        self._show("way", "" if search is None else ways.html(search, settings, self._stage.units))

    def plot(self, motion: Motion | None, other: Motion | None) -> None:
        """The curves over time."""
        lasts = motion is not None and motion.duration > 0.0
        other = other if other is not None and other.planned and other.duration > 0.0 else None
        self._show(
            "plot",
            plot_html(motion, self.joint, self._stage.units, other) if motion is not None and lasts else "",
        )

    def summary(self, plan: Plan | None, own: bool) -> None:
        """Duration, peaks and limits."""
        stage = self._stage
        driven = plan is not None and (
            plan.motion.planned or (plan.driven is not None and plan.driven.duration > 0)
        )
        self._show("summary", views.summary(plan, stage.now.robot, own, stage.units) if plan and driven else "")

    def compare(self, motion: Motion | None, other: Motion | None, choice: Choice | None, zone: float) -> None:
        """The motion that the program is compared with."""
        if motion is None or motion.duration == 0.0:
            self._show("compare", "")
            return
        words = "" if other is None or other.planned else other.explain(self._stage.units)
        self._show("compare", views.comparison(motion, other, choice, zone, self.fields, words))

    def files(self, motion: Motion | None, any_items: bool, own: bool) -> None:
        """Saving, opening, and the program as code."""
        code = ""
        if motion is not None:
            code = box_html(SNIPPETS[self.language](motion, own, self._stage.service), "Copy code")
        self._show(
            "files",
            render(
                "program/files",
                any=any_items,
                most=f"{LARGEST // 1000} kB",
                most_recording=f"{BYTES // 1_000_000} MB",
                code=code,
                languages=list(SNIPPETS),
                language=self.language,
                motions=MOTIONS if motion is not None else {},
            ),
        )

    def draw(self, items: Items, plan: Plan | None, fault: Fault | None, loop: bool, other: Motion | None) -> None:
        """Draw the program in the scene, if it is another one than before."""
        stage, shown = self._stage, self.shown
        drawn = (stage.now.robot, items, loop, fault, shown, None if other is None else other.pieces)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        self.remove()
        if not any(item.q for item in items) or not shown.path:
            return
        self._drawing = Drawing(stage.client.scene, stage.now.robot, items, views.shown_names(items), fault)
        motion = None if plan is None else plan.driven
        if shown.ghosts:
            self._drawing.show_ghosts()
        if motion is not None and motion.duration > 0.0:
            self._drawing.show_path(motion)
            if shown.frames:
                self._drawing.show_frames(motion)
        if other is not None and other.planned and other.duration > 0.0:
            self._drawing.show_other(other)

    @property
    def extents(self) -> Sequence[Sphere]:
        """A sphere around the drawing, if there is one."""
        return [] if self._drawing is None else [round_points(self._drawing.points)]

    def remove(self) -> None:
        """Remove the drawing from the scene."""
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None
