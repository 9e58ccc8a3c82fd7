"""*Find a way*: waypoints around obstacles are searched in the background and put into a program.

The search is random and has a time limit: that it finds nothing is not said to mean that there is nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import kin.way
from app.shared.computations import SharedComputation
from app.viewer.declared.work import Result
from app.viewer.tabs.program.plan import Asked
from app.viewer.tabs.program.program import MOST, Segments, options, places, recorded
from app.viewer.views.templates import render
from kin.motion import JointTarget, Ptp
from kin.motion.program import Pause, Segment
from kin.units import Units
from kin.way import find_way, way_program

SHORTEST, USUAL, LONGEST = 0.1, 5.0, 60.0  # seconds of a search
STEPS = 100  # of its progress
SEED_HINT = "The search is random: another seed may find another way, the same seed finds the same one again"


@dataclass(frozen=True)
class Found:
    """The rows with the waypoints of a way, and how many were put in before the one to which it leads."""

    segments: Segments
    count: int
    index: int

    def leads_by(self, index: int) -> bool:
        """Whether a row of the program with the way is on it."""
        return self.index <= index <= self.index + self.count

    def said(self) -> tuple[str, str]:
        """Title and words."""
        put = f"{self.count} waypoint{'s are' if self.count != 1 else ' is'} put in before {self.index + 1}."
        return f"A way to {self.index + 1} was found", put if self.count else "A PTP leads there straight."


@dataclass(frozen=True)
class NotFound:
    """Why the program stays as it is: a title, and words in the units of the page."""

    title: str
    explain: Callable[[Units], str]


def search(
    computation: SharedComputation[Any], asked: Asked, seconds: float, seed: int, number: int
) -> Found | NotFound:
    """Search a way; `number`: of the search, another one searches again."""
    plan, arm, index = asked.plan, asked.arm, asked.index
    before = plan.before(index)
    assert before is not None
    computation.total = STEPS

    def progress(share: float) -> None:
        computation.done = int(share * STEPS)

    itself = bool(arm.robot.capsules)
    way = find_way(
        arm.robot,
        plan.met(before, len(plan.q[before]) - 1)[1],
        plan.q[index][-1],
        obstacles=arm.obstacles,
        avoid_self_collision=itself,
        seed=seed,
        time_limit=seconds,
        progress=progress,
        cancel=computation.check,
    )
    if way.q is None:
        return NotFound("No way was found", way.explain)
    like = Ptp(JointTarget(tuple(plan.q[index][-1].tolist())), **options(plan.segments[index]) | {"blend": 0.0})
    motion = way_program(way, arm.obstacles, itself, computation.check, like)
    if not motion.planned:
        return NotFound("The way that was found cannot be driven", motion.explain)
    between = [
        replace(each, target=recorded(np.array(each.target.q)), name="")
        for each in motion.program.segments[:-1]
        if isinstance(each, Ptp) and isinstance(each.target, JointTarget)
    ]
    found = Found(with_way(plan.segments, before, index, between, like), len(between), index)
    if places(found.segments) > MOST:
        too_many = f"It has {found.count}; the program may have {MOST} waypoints and pauses in all."
        return NotFound("The way has too many waypoints", lambda _: too_many)
    return found


def with_way(segments: Segments, before: int, index: int, between: Sequence[Segment], end: Ptp) -> Segments:
    """The rows with waypoints put in before one, which is met by PTP; the arm stops at both ends of the way."""
    start = segments[before]
    assert not isinstance(start, Pause)
    stop = replace(start, blend=0.0)
    return (*segments[:before], stop, *segments[before + 1 : index], *between, end, *segments[index + 1 :])


def html(
    asked: Asked | None, result: Result | None, seconds: float, fields: Sequence[object], units: Units
) -> str:
    """The form with its `fields`, or how far the search is; `result`: of the search, None without one."""
    if asked is None:
        return ""
    arm = asked.arm
    start = asked.plan.before(asked.index)
    none = result.value if result is not None and isinstance(result.value, NotFound) else None
    return render(
        "program/way",
        index=asked.index,
        start=0 if start is None else start + 1,
        installed=kin.way.is_installed(),
        avoided=_avoided(len(arm.obstacles), bool(arm.robot.capsules)),
        share=None if result is None or result.finished else result.done / STEPS,
        title="" if none is None else none.title,
        words="" if none is None else none.explain(units),
        seconds=seconds,
        fields=fields,
    )


def _avoided(obstacles: int, itself: bool) -> str:
    """What the arm must not touch, in a few words; "" if there is nothing."""
    bodies = ["itself"] if itself else []
    if obstacles:
        bodies.append("the obstacle" if obstacles == 1 else f"the {obstacles} obstacles")
    return " or ".join(bodies)
