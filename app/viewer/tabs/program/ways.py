"""*Find a way*: waypoints around obstacles are searched in the background and put into a program.

The search is random and has a time limit: that it finds nothing is not said to mean that there is nothing.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, field, replace

import numpy as np

from app.viewer.arm import Arm
from app.viewer.feature import Stage
from app.viewer.panel import Post
from app.viewer.panel.status import Notice
from app.viewer.tabs.program.plan import Plan
from app.viewer.tabs.program.program import MOST, Segments, options, places, recorded
from app.viewer.tabs.program.typed import SECONDS, read_number
from app.viewer.tabs.workspace.background import run_in_background
from app.viewer.views.templates import render
from kin.motion import Dwell, JointTarget, Ptp
from kin.motion.program import Segment
from kin.typed import EntryError
from kin.units import Unit, Units
from kin.way import MOST_SEED, find_way, is_installed, way_program

SHORTEST, USUAL, LONGEST = 0.1, 5.0, 60.0  # seconds of a search
REPORT = 0.1  # s between two reports of the progress
_WHOLE = Unit("", 1.0, 0)


@dataclass(frozen=True)
class Settings:
    """Time limit and seed of the next search."""

    seconds: float = USUAL
    seed: int = 0

    def typed(self, name: str, text: object) -> Settings:
        """With another value of a field; raises `EntryError`, which says what would be valid."""
        if name == "seconds":
            return replace(self, seconds=read_number(text, SECONDS, SHORTEST, LONGEST))
        value = read_number(text, _WHOLE, 0.0, float(MOST_SEED))
        if value != int(value):
            raise EntryError("The field stays as it was", f"The seed is a whole number from 0 to {MOST_SEED}.")
        return replace(self, seed=int(value))


@dataclass
class Search:
    """The way to one waypoint: to be searched, being searched, found, or not found.

    Attributes:
        index: of the waypoint.
        plan, arm: of the program and the arm for which it is searched.
        share: part of the time that has passed while it is searched; None: it is not.
        title, explain: why the program stays as it is, the second in the units of the page; None: not known yet.
        found: the rows with the waypoints of the way; None: not found.
        count: how many waypoints were put in.
        cancelled: set when it is not wanted any more.
    """

    index: int
    plan: Plan
    arm: Arm
    share: float | None = None
    title: str = "No way was found"
    explain: Callable[[Units], str] | None = None
    found: Segments | None = None
    count: int = 0
    cancelled: threading.Event = field(default_factory=threading.Event)

    @property
    def start(self) -> int | None:
        """Index of the waypoint before; None: it is the first one, to which there is no way."""
        return self.plan.before(self.index)

    def fits(self, segments: Segments, arm: Arm) -> bool:
        """Whether the program and what the arm can touch are unchanged since this search began."""
        mine = self.arm
        return segments == self.plan.segments and arm.robot == mine.robot and arm.obstacles == mine.obstacles

    def leads_by(self, index: int) -> bool:
        """Whether a row of the program with the way is on it."""
        return self.index <= index <= self.index + self.count

    def said(self) -> tuple[str, str]:
        """Title and words about a way that was found."""
        put = f"{self.count} waypoint{'s are' if self.count != 1 else ' is'} put in before {self.index + 1}."
        return f"A way to {self.index + 1} was found", put if self.count else "A PTP leads there straight."


def compute(search: Search, settings: Settings, report: Callable[[], None]) -> None:
    """Search a way, and fill `search`; in a background thread. `report` is called while it goes on.

    Raises:
        CancelledError: it is not wanted any more.
    """
    plan, arm, before = search.plan, search.arm, search.start
    assert before is not None
    start, goal = plan.met(before, len(plan.q[before]) - 1)[1], plan.q[search.index][-1]
    last = [time.monotonic()]

    def cancel() -> None:
        if search.cancelled.is_set():
            raise CancelledError

    def progress(share: float) -> None:
        search.share = share
        if time.monotonic() - last[0] >= REPORT:
            last[0] = time.monotonic()
            report()

    itself = bool(arm.robot.capsules)
    way = find_way(
        arm.robot,
        start,
        goal,
        obstacles=arm.obstacles,
        avoid_self_collision=itself,
        seed=settings.seed,
        time_limit=settings.seconds,
        progress=progress,
        cancel=cancel,
    )
    if way.q is None:
        search.explain = way.explain
        return
    like = Ptp(JointTarget(tuple(goal.tolist())), **options(plan.segments[search.index]) | {"blend": 0.0})
    motion = way_program(way, arm.obstacles, itself, cancel, like)
    if not motion.planned:
        search.title, search.explain = "The way that was found cannot be driven", motion.explain
        return
    between = [
        replace(each, target=recorded(np.array(each.target.q)), name="")
        for each in motion.program.segments[:-1]
        if isinstance(each, Ptp) and isinstance(each.target, JointTarget)
    ]
    search.found, search.count = with_way(plan.segments, before, search.index, between, like), len(between)


def with_way(segments: Segments, before: int, index: int, between: Sequence[Segment], end: Ptp) -> Segments:
    """The rows with waypoints put in before one, which is met by PTP; the arm stops at both ends of the way."""
    start = segments[before]
    assert not isinstance(start, Dwell)
    stop = replace(start, blend=0.0)
    return (*segments[:before], stop, *segments[before + 1 : index], *between, end, *segments[index + 1 :])


def html(search: Search, settings: Settings, units: Units) -> str:
    """The form, or how far the search is."""
    arm = search.arm
    start = search.start
    return render(
        "program/way",
        index=search.index,
        start=0 if start is None else start + 1,
        installed=is_installed(),
        avoided=_avoided(len(arm.obstacles), bool(arm.robot.capsules)),
        share=search.share,
        title=search.title,
        words="" if search.explain is None else search.explain(units),
        settings=settings,
    )


def _avoided(obstacles: int, itself: bool) -> str:
    """What the arm must not touch, in a few words; "" if there is nothing."""
    bodies = ["itself"] if itself else []
    if obstacles:
        bodies.append("the obstacle" if obstacles == 1 else f"the {obstacles} obstacles")
    return " or ".join(bodies)


class Ways:
    """The searches of one page, one at a time; the visitor's worker calls it.

    Args:
        show: shows the form of a search as HTML; "": nothing.
        post: posts ``("searching",)`` and ``("searched",)`` with the search, or ``("failed",)`` with an exception.
    """

    def __init__(self, stage: Stage, show: Callable[[str], None], post: Post) -> None:
        self._stage, self._show, self._post = stage, show, post
        self._search: Search | None = None
        self._settings = Settings()

    def open(self, plan: Plan | None, index: int) -> None:
        """Show the form for the way to a row."""
        self.cancel()
        self._search = None
        if plan is not None and plan.can_have_way(index):
            self._search = Search(index, plan, self._stage.now)
        self._redraw()

    def start(self) -> None:
        """Search in the background."""
        if self._search is None or self._search.share is not None or not is_installed():
            return
        search = Search(self._search.index, self._search.plan, self._stage.now, share=0.0)
        self._search, settings = search, self._settings
        self._redraw()

        def work() -> None:
            compute(search, settings, lambda: self._post(("searching",), search))
            self._post(("searched",), search)

        run_in_background(work, "way", lambda key, value: self._post((key,), value))

    def report(self, search: object) -> None:
        """Show how far a search is, if it is still wanted."""
        if search is self._search:
            self._redraw()

    def ended(self, search: object) -> Search | None:
        """A search has ended: it is returned if it has found a way, else shown with its words."""
        mine = self._search
        if mine is None or search is not mine:
            return None
        mine.share = None
        if mine.found is not None and places(mine.found) > MOST:
            mine.found, mine.title = None, "The way has too many waypoints"
            too_many = f"It has {mine.count}; the program may have {MOST} waypoints and pauses in all."
            mine.explain = lambda _: too_many
        if mine.found is not None:
            self._search = None
        self._redraw()
        return None if mine.found is None else mine

    def type(self, name: str, text: object) -> None:
        """Take a field of the form."""
        try:
            self._settings = self._settings.typed(name, text)
        except EntryError as error:
            self._stage.notify(Notice("error", error.title, error.detail))
        self._redraw()

    def close(self) -> None:
        """Cancel a search, back to its form; without one, close the form."""
        self.cancel()
        mine = self._search
        running = mine is not None and mine.share is not None
        self._search = Search(mine.index, mine.plan, mine.arm) if mine is not None and running else None
        self._redraw()

    def keep(self, segments: Segments) -> None:
        """Close the form, unless nothing has changed that its way depends on."""
        if self._search is not None and not self._search.fits(segments, self._stage.now):
            self.cancel()
            self._search = None
        self._redraw()

    def cancel(self) -> None:
        """Nobody wants any more what is computed in the background."""
        if self._search is not None:
            self._search.cancelled.set()

    def _redraw(self) -> None:
        self._show("" if self._search is None else html(self._search, self._settings, self._stage.units))
