"""Another motion of the same waypoints, to be compared with the program: other segments, zones or profiles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

import kin
from app.viewer.profiles import Profile, fastest
from app.viewer.tabs.program.plan import Plan, looped, start
from app.viewer.tabs.program.program import as_kind
from kin.motion import Motion, Program, Ptp
from kin.motion.pieces import Piece, look_between
from kin.motion.program import Pause
from kin.transforms import Array

Choice = Literal["ptp", "lin", "zone", "cubic", "quintic", "trapezoidal", "s_curve", "fastest"]
CHOICES: dict[Choice, str] = {
    "ptp": "every move as PTP",
    "lin": "every move as LIN",
    "zone": "other zones (blend radius)",
    "cubic": "cubic profile",
    "quintic": "quintic profile",
    "trapezoidal": "trapezoidal profile (LSPB)",
    "s_curve": "S-curve profile",
    "fastest": "time-optimal without limits of jerk",
}
ZONE = 0.05  # m, of the other zones at first
_SAME = 1e-9  # s
_BESIDE = 1e-9  # of the duration: where the acceleration is compared on both sides of an instant
_JUMP = 1e-6  # of the largest acceleration: a difference beyond rounding


@dataclass(frozen=True, slots=True, eq=False)
class Straight:
    """All joints on a straight line from `start` to `end` ``(n,)``, in proportion to one profile from 0 to 1."""

    start: Array
    end: Array
    profile: Profile

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.profile.duration

    def at(self, times: Array) -> Array:
        """Joint values and their first three derivatives ``(4, k, n)``."""
        out: Array = self.profile.sample(times)[..., None] * (self.end - self.start)
        out[0] += self.start
        return out

    def grid(self) -> Array:
        """Times at which to look for peaks."""
        return look_between(np.unique(self.profile.breaks))

    def jumps(self) -> bool:
        """Whether the acceleration jumps: between two polynomials, or from and to the rest at the ends."""
        breaks = self.profile.breaks
        before, after = (self.profile.sample(breaks + sign * _BESIDE * self.duration)[2] for sign in (-1.0, 1.0))
        before[0] = after[-1] = 0.0
        largest = np.abs(self.profile.sample(self.grid())[2]).max()
        return bool(np.abs(after - before).max() > _JUMP * largest)


def other_motion(program: Program, plan: Plan, loop: bool, choice: Choice, zone: float) -> Motion:
    """The other motion of a program and its plan; it may be refused."""
    robot, segments = plan.motion.robot, program.segments
    if choice in ("ptp", "lin"):
        for index in reversed(range(1, len(segments))):
            before = plan.before(index)
            if before is not None and plan.q[index]:
                kind: Literal["ptp", "lin"] = "ptp" if choice == "ptp" else "lin"
                segments, _ = as_kind(segments, index, kind, plan.q[index], plan.q[before][-1], robot)
    elif choice == "zone":
        segments = tuple(each if isinstance(each, Pause) else replace(each, blend=zone) for each in segments)
    program = replace(program, segments=segments, jerk_limited=program.jerk_limited and choice != "fastest")
    motion = kin.plan_motion(robot, looped(program) if loop else program, start(program))
    return motion if choice not in _PROFILES or not motion.planned else with_profile(motion, _PROFILES[choice])


def with_profile(motion: Motion, kind: str) -> Motion:
    """The motion with another profile of each PTP from rest to rest, of a kind of `fastest`."""
    pieces: list[Piece] = list(motion.pieces)
    for times, segment in zip(motion.segments, motion.program.segments, strict=True):
        k = int(np.argmin(np.abs(motion.starts[:-1] - times.start))) if pieces else 0
        whole = (
            isinstance(segment, Ptp)
            and times.end > times.start
            and abs(motion.starts[k] - times.start) < _SAME
            and abs(motion.starts[k + 1] - times.end) < _SAME
        )
        if whole and not isinstance(segment, Pause):
            start, end = motion.derivatives(np.array([times.start, times.end]))[0]
            scales = np.array([segment.speed, segment.acceleration, segment.acceleration])
            way = np.abs(end - start)
            limits = np.array([motion.limits.velocity, motion.limits.acceleration, motion.limits.jerk])
            moving = way > 1e-12
            shared = (limits[:, moving] / way[moving]).min(axis=1) * scales
            pieces[k] = Straight(start, end, fastest(1.0, shared)[kind])
    starts = np.concatenate([[0.0], np.cumsum([piece.duration for piece in pieces])])

    def new(time: float) -> float:
        return float(np.interp(time, motion.starts, starts))

    segments = tuple(replace(each, start=new(each.start), end=new(each.end)) for each in motion.segments)
    return replace(motion, pieces=tuple(pieces), segments=segments)


_PROFILES: dict[Choice, str] = {
    "cubic": "cubic",
    "quintic": "quintic",
    "trapezoidal": "trapezoidal",
    "s_curve": "S-curve",
}
_ABOUT: dict[Choice, str] = {
    "cubic": "Velocity is continuous, acceleration jumps at both ends: its jerk there is infinite.",
    "quintic": "Velocity and acceleration start and end at zero.",
    "trapezoidal": "Velocity is continuous, acceleration jumps four times: its jerk there is infinite.",
    "s_curve": "Acceleration is continuous, jerk keeps its limit.",
    "fastest": "Acceleration may jump where the path is LIN, CIRC or a spline: jerk is not limited there.",
}


def jerk_is_infinite(motion: Motion) -> bool:
    """Whether a profile of `with_profile` makes the acceleration jump; peaks only have the jerk between jumps."""
    return any(isinstance(piece, Straight) and piece.jumps() for piece in motion.pieces)


def about(choice: Choice, motion: Motion) -> str:
    """What the choice means for a program."""
    words = _ABOUT.get(choice, "")
    others = [each for each in motion.program.segments if not isinstance(each, Ptp | Pause)]
    if choice in _PROFILES and (others or any(getattr(each, "blend", 0.0) for each in motion.program.segments)):
        words += " The profile replaces that of each PTP without a zone; other moves stay as planned."
    return words


assert set(CHOICES) == set(get_args(Choice))
