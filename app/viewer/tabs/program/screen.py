"""What the tab *Program* shows: the parts of its panel and its drawings in the scene.

A part is sent again only when it has changed.
"""

from __future__ import annotations

from collections.abc import Sequence

from app.exports.motion_snippets import SNIPPETS
from app.viewer.feature import Feature, Stage
from app.viewer.live.tape import BYTES
from app.viewer.own_arm import KEY
from app.viewer.panel import update_html
from app.viewer.panel.part import add_html
from app.viewer.panel.share import box_html
from app.viewer.scene.camera import Sphere, round_points
from app.viewer.tabs.program import program as rows
from app.viewer.tabs.program import views
from app.viewer.tabs.program.compare import ZONE, Choice, other_motion
from app.viewer.tabs.program.drawing import Drawing, Shown
from app.viewer.tabs.program.files import LARGEST, MOTIONS
from app.viewer.tabs.program.plan import Fault, Plan, find_fault, plan
from app.viewer.tabs.program.playback import Playback
from app.viewer.tabs.program.plot import plot_html
from app.viewer.tabs.program.postures import Chart, html
from app.viewer.tabs.program.program import Segments
from app.viewer.tabs.program.typed import Fields
from app.viewer.tabs.program.ways import Ways
from app.viewer.views.templates import render
from kin.motion import Motion, Program

PARTS = ("player", "clock", "list", "postures", "way", "plot", "summary", "compare", "files")


class Screen(Feature):
    """The programs of a visitor, one for each robot, as they are shown."""

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self._html = {name: add_html(stage.client.gui) for name in PARTS}
        self._programs: dict[str, Program] = {}  # by robot; `KEY` stands for the visitor's own arm
        self._playback = Playback(stage, self._show_clock)
        self._player = self._playback.player
        self._plan: Plan | None = None
        self._fault: Fault | None = None
        self._stale: float | None = None  # when the motion is planned again, after the obstacles have changed
        # What is shown
        self._chosen: int | None = None  # the row that is open
        self._point = 0  # of an open spline
        self._by_pose = False  # whether the open row shows the pose of the tool, not joint values
        self._joint: int | None = None  # in the plots; None: all
        self._shown = Shown()
        self._language = next(iter(SNIPPETS))
        self._revision = 0
        self._drawing: Drawing | None = None
        self._drawn: tuple[object, ...] = ()
        # What is compared and searched
        self._compared: Choice | None = None
        self._zone = ZONE
        self._other: Motion | None = None
        self._chart: Chart | None = None
        self._ways = Ways(stage, lambda html: self._show("way", html), self.post)
        self._progress: dict[str, object] = {}
        self._refresh()

    # The program

    @property
    def _own(self) -> bool:
        """Whether the visitor's own arm is on show."""
        own = self.stage.own
        return own is not None and own.robot == self.stage.now.robot

    @property
    def _key(self) -> str:
        return KEY if self._own else self.stage.now.robot.id

    @property
    def _program(self) -> Program | None:
        """That of the robot on show; a visitor's own arm may have another number of joints by now."""
        found = self._programs.get(self._key)
        return found if found is not None and rows.fits(found.segments, self.stage.now.robot) else None

    @property
    def _segments(self) -> Segments:
        return () if self._program is None else self._program.segments

    @property
    def _motion(self) -> Motion | None:
        """The motion of the program, or the part of it that can be driven; None: there is none."""
        return self._playback.motion

    @property
    def _whole(self) -> Motion | None:
        """The motion of the whole program; None: it cannot be driven."""
        return self._motion if self._plan is not None and self._plan.motion.planned else None

    @property
    def _blocked(self) -> bool:
        """Whether nothing may be played, as a locked joint would move."""
        return self._fault is not None and self._fault.whole

    def _refresh(self) -> None:
        """Plan the motion, and show everything."""
        arm, loop = self.stage.now, self._player.loop
        self._keep_postures()
        self._ways.keep(self._segments)
        self._plan, self._stale = plan(self._program, arm.robot, loop, arm.avoid, arm.obstacles), None
        self._fault = find_fault(self._plan, self.stage)
        self._playback.use(self._plan if self._plan is not None and self._plan.driven is not None else None)
        self._other = None
        if self._compared is not None and self._whole is not None and self._plan and self._program:
            self._other = other_motion(self._program, self._plan, loop, self._compared, self._zone)
        self._draw()
        self._show_player()
        self._show_list()
        self._show_plot()
        self._show_summary()
        self._show_comparison()
        self._show_files()
        self._show_clock()

    # What is shown; each part is sent again only when it has changed

    def _show(self, name: str, html: str) -> None:
        update_html(self._html[name], html)

    @property
    def _fields(self) -> Fields:
        """How values are written and read."""
        arm, stage = self.stage.now, self.stage
        return Fields(arm.robot, stage.units, stage.frames.pose(arm.robot, arm.goal), arm.task)

    def _show_player(self) -> None:
        playable = self._motion is not None and self._motion.duration > 0.0 and not self._blocked
        top = 0.0 if self._drawing is None else self._drawing.top_speed
        shown = views.player(self._player, self._motion, playable, self._shown, top, self.stage.units)
        self._show("player", shown if self._segments else "")

    def _show_clock(self) -> None:
        self._show("clock", views.clock(self._player, self._playback.duration, self._playback.here))

    def _show_list(self, anew: bool = False) -> None:
        """The rows; `anew`: what was typed into the fields is replaced."""
        self._revision += anew
        if self._chosen is not None:
            self._point = max(0, min(self._point, len(rows.targets(self._segments[self._chosen])) - 1))
        opened, by_pose = (self._chosen, self._point), self._by_pose
        loop = self._player.loop
        self._show(
            "list", views.list_html(self._plan, opened, self._fault, loop, self._fields, by_pose, self._revision)
        )

    def _show_plot(self) -> None:
        motion, other = self._motion, self._other
        lasts = motion is not None and motion.duration > 0.0
        other = other if other is not None and other.planned and other.duration > 0.0 else None
        self._show("plot", plot_html(motion, self._joint, self.stage.units, other) if motion and lasts else "")

    def _show_summary(self) -> None:
        """Duration, peaks and limits."""
        found = self._plan
        driven = found is not None and (found.motion.planned or (found.driven and found.driven.duration > 0.0))
        self._show("summary", views.summary(found, self._own, self.stage.units) if found and driven else "")

    def _show_comparison(self) -> None:
        motion, other = self._whole, self._other
        if motion is None or motion.duration == 0.0:
            self._show("compare", "")
            return
        words = "" if other is None or other.planned else other.explain(self.stage.units)
        self._show("compare", views.comparison(motion, other, self._compared, self._zone, self._fields, words))

    def _show_files(self) -> None:
        """Saving, opening, and the program as code."""
        code = ""
        if self._motion is not None:
            code = box_html(SNIPPETS[self._language](self._motion, self._own, self.stage.service), "Copy code")
        shown = render(
            "program/files",
            any=bool(self._segments),
            most=f"{LARGEST // 1000} kB",
            most_recording=f"{BYTES // 1_000_000} MB",
            code=code,
            languages=list(SNIPPETS),
            language=self._language,
            motions=MOTIONS if self._motion is not None else {},
        )
        self._show("files", shown)

    def _draw(self) -> None:
        """Draw the program in the scene, if it is another one than before."""
        other, motion, shown = self._other, self._motion, self._shown
        pieces = None if other is None else other.pieces
        drawn = (self.stage.now.robot, self._segments, self._player.loop, self._fault, shown, pieces)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        self._erase()
        if self._plan is None or not shown.path:
            return
        self._drawing = Drawing(self.stage.client.scene, self._plan, self._fault)
        if shown.ghosts:
            self._drawing.show_ghosts()
        if motion is not None and motion.duration > 0.0:
            self._drawing.show_path(motion)
            if shown.frames:
                self._drawing.show_frames(motion)
        if other is not None and other.planned and other.duration > 0.0:
            self._drawing.show_other(other)

    def _erase(self) -> None:
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None

    def _keep_postures(self) -> None:
        """Show the chart, unless something has changed that it depends on; its words may have other units."""
        if self._chart is not None and not self._chart.fits(self._segments, self.stage.now):
            self._close_postures()
        self._show("postures", "" if self._chart is None else html(self._chart, self.stage.units))

    def _close_postures(self) -> None:
        if self._chart is not None:
            self._chart.cancelled.set()
            self._chart = None
            self._show("postures", "")

    def extents(self) -> Sequence[Sphere]:
        return [] if self._drawing is None else [round_points(self._drawing.points)]
