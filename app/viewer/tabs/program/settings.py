"""The settings of the tab *Program*, and the facts that follow from them and the arm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

from app.exports.motion_snippets import SNIPPETS
from app.viewer.declared.facts import Facts
from app.viewer.declared.fields import Settings, choice, flag, memory, number
from app.viewer.own_arm import KEY
from app.viewer.tabs.program.compare import CHOICES, ZONE, Choice, other_motion
from app.viewer.tabs.program.plan import Asked, Fault, Plan, find_fault, plan
from app.viewer.tabs.program.program import Segments, fits, places, targets
from app.viewer.tabs.program.typed import FARTHEST
from app.viewer.tabs.program.ways import LONGEST, SEED_HINT, SHORTEST, USUAL
from kin.motion import Motion, Program
from kin.transforms import Array
from kin.way import MOST_SEED

RATES = {f"{rate:g}×": rate for rate in (0.1, 0.25, 0.5, 1.0, 2.0)}  # of the real speed
LANGUAGES = {name: name for name in SNIPPETS}


@dataclass(frozen=True)
class ProgramSettings(Settings):
    """The programs of a visitor, how they are played and shown, and what is open.

    Attributes:
        programs: by robot; `KEY` stands for the visitor's own arm.
        own: whether that is on show.
        chosen, point: the row that is open, and the point of a spline.
        by_pose: whether the open row shows the pose of the tool, not joint values.
        joint: in the plots; None: all.
        zone: of the motion that is compared, m.
        revision: another one replaces what was typed into the fields.
        chart, way: the row to which postures or a way around obstacles are asked for.
        search: number of the search for the way; 0: none has begun.
        seconds, seed: of the next search; `limits` are those of the last one.
        time: seconds since the beginning of the motion.
        sent: the configuration ``(n,)`` to which the arm was moved last while the program plays.
        leads: whether the arm is on its way to where playing begins.
        opened: how far the gripper was open before the program moved it, 0 to 1; NaN: not known.
    """

    loop: bool = flag("Loop")
    rate: float = choice("Speed of playing", RATES, 1.0)
    path: bool = flag("Path", True)
    ghosts: bool = flag("Ghosts")
    frames: bool = flag("Frames")
    compare: Choice | None = choice(
        "With", {"nothing": None, **{words: each for each, words in CHOICES.items()}}, None, none=""
    )
    language: str = choice("Copy as", LANGUAGES, next(iter(LANGUAGES)), link=False)
    programs: Mapping[str, Program] | None = memory(None, renew=False)
    own: bool = memory(False)
    chosen: int | None = memory()
    point: int = memory(0)
    by_pose: bool = memory(False, renew=False)
    joint: int | None = memory()
    zone: float = number("Radius", ZONE, (0.0, FARTHEST), "length", empty="the arm stops", nothing=0.0, link=False)
    revision: int = memory(0, renew=False)
    chart: Asked | None = memory()
    way: Asked | None = memory()
    search: int = memory(0)
    seconds: float = number("Time limit", USUAL, (SHORTEST, LONGEST), "s", link=False)
    seed: int = number("Seed", 0, (0, MOST_SEED), hint=SEED_HINT, whole=True, link=False)
    limits: tuple[float, int] = memory((USUAL, 0), renew=False)
    time: float = memory(0.0)
    playing: bool = memory(False)
    sent: Array | None = memory()
    leads: bool = memory(False)
    opened: float = memory(math.nan)


class Planned:
    """The last plan of one page, its fault, and the motion that it is compared with: each frame asks for them.

    A cache of all pages would need room for as many as may be open. With less room, each frame would plan anew.
    """

    def __init__(self) -> None:
        self.plan = lru_cache(1)(plan)
        self.find_fault = lru_cache(1)(find_fault)
        self.other_motion = lru_cache(1)(other_motion)


@dataclass(frozen=True, eq=False)
class ProgramFacts(Facts[ProgramSettings]):
    """The program of the robot on show, and its motion.

    Attributes:
        planned: what the facts before these have planned.
    """

    planned: Planned = field(default_factory=Planned)

    @property
    def key(self) -> str:
        """Under which the program is kept."""
        return KEY if self.settings.own else self.robot.id

    @cached_property
    def program(self) -> Program | None:
        """That of the robot on show; a visitor's own arm may have another number of joints by now."""
        found = (self.settings.programs or {}).get(self.key)
        return found if found is not None and fits(found.segments, self.robot) else None

    @property
    def segments(self) -> Segments:
        """Its rows."""
        return () if self.program is None else self.program.segments

    @cached_property
    def plan(self) -> Plan | None:
        """The program and its motion. While obstacles are moved, those of before count."""
        if self.program is None:
            return None
        rested = self.work("obstacles")
        obstacles = rested.value if rested.finished else self.arm.obstacles
        return self.planned.plan(self.program, self.robot, self.settings.loop, self.arm.avoid, obstacles)

    @property
    def motion(self) -> Motion | None:
        """The motion of the program, or the part of it that can be driven; None: there is none."""
        return None if self.plan is None else self.plan.driven

    @property
    def whole(self) -> Motion | None:
        """The motion of the whole program; None: it cannot be driven."""
        return None if self.plan is None or not self.plan.motion.planned else self.motion

    @property
    def duration(self) -> float:
        """Seconds of the motion."""
        return 0.0 if self.plan is None else self.plan.duration

    @cached_property
    def fault(self) -> Fault | None:
        """Why the program cannot be driven."""
        if self.plan is None:
            return None
        return self.planned.find_fault(self.plan, self.arm.options.constraints.locks(self.robot) or (), self.units)

    @property
    def playable(self) -> bool:
        """Whether there is a motion to be played."""
        return self.duration > 0.0 and not (self.fault is not None and self.fault.whole)

    @property
    def time(self) -> float:
        """Where in the motion the arm is, in seconds."""
        return min(self.settings.time, self.duration)

    def after(self, seconds: float) -> float | None:
        """Where in the motion the arm is so many seconds later; None: the motion has ended."""
        time = self.time + seconds * self.settings.rate
        if time < self.duration:
            return time
        return time % self.duration if self.settings.loop and self.duration > 0.0 else None

    @property
    def other(self) -> Motion | None:
        """The motion that the program is compared with; it may be refused."""
        s = self.settings
        if s.compare is None or self.program is None or self.plan is None or self.whole is None:
            return None
        return self.planned.other_motion(self.program, self.plan, s.loop, s.compare, s.zone)

    @property
    def chosen(self) -> int | None:
        """Index of the row that is open."""
        found = self.settings.chosen
        return found if found is not None and found < len(self.segments) else None

    @property
    def point(self) -> int:
        """Index of the open point of a spline; 0 in any other row."""
        last = 0 if self.chosen is None else len(targets(self.segments[self.chosen])) - 1
        return max(0, min(self.settings.point, last))

    @property
    def chart(self) -> Asked | None:
        """For what the postures along the way are shown."""
        asked = self._same(self.settings.chart)
        return asked if asked is not None and asked.arm.avoid == self.arm.avoid else None

    @property
    def way(self) -> Asked | None:
        """For what a way around obstacles is searched, or can be."""
        return self._same(self.settings.way)

    def _same(self, asked: Asked | None) -> Asked | None:
        """What is asked for, unless the program or the obstacles have changed since."""
        if asked is None or asked.plan.segments != self.segments or asked.arm.obstacles != self.arm.obstacles:
            return None
        return asked

    @property
    def searches(self) -> bool:
        """Whether a way is being searched."""
        return self.way is not None and self.settings.search > 0 and not self.work("way").finished

    @property
    def progress(self) -> dict[str, object]:
        """Whether the program plays, and where it is; the same object while that is the same."""
        complete = self.fault is None and self.whole is not None
        return _progress(places(self.segments), self.settings.playing, self.time, self.duration, complete)


@lru_cache(maxsize=64)
def _progress(items: int, playing: bool, time: float, duration: float, complete: bool) -> dict[str, object]:
    return {"items": items, "playing": playing, "time": time, "duration": duration, "complete": complete}
