"""Why a jump is forced: follow the motion that cannot go on, and look at what stops it.

Where the search knows a dead end, the last waypoint that any path with fewer jumps gets to, the motion is followed
from there; else from before the jump, or backwards from behind it. At the waypoint that it does not reach, the
nearest configuration with the limits ignored tells three cases apart:

- it is within reach, but beyond a stop: ``limits``. A lock is only blamed if the stops alone do not explain it;
- it is about as far away as the tool has to go: ``spacing``, the waypoints are too far apart;
- it is much farther. Then the motion is followed in small steps along the straight way between the poses, until it
  breaks: on the same branch it is a ``singularity``, without one the end of the ``branch``. A motion that does not
  break, but passes close to a singularity, is fast for that reason.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kin.fk import fk
from kin.ik import messages
from kin.ik.branches import Flags, is_closed, measure, violations_of
from kin.ik.candidates import POSITION_ERROR, ROTATION_ERROR
from kin.ik.messages.singularity import short
from kin.ik.problem import Question
from kin.ik.results import LimitViolation
from kin.path.course import Course, Way, has_closed_form
from kin.path.results import JumpCause, PathJump
from kin.path.route import DeadEnd
from kin.path.waypoint import LEAP, branches_near, continued, descended, nearest
from kin.robot import Robot
from kin.singularity import singularities
from kin.solvers.common import TURN
from kin.solvers.contract import APPROACH, POSE, POSITION
from kin.tolerances import TOLERANCES
from kin.transforms import Array, rotation_from_wxyz, wxyz_from_rotation

# Small steps between two waypoints, how far stops are moved out of the way, what is near to a singularity (a
# length as a share of the arm's reach), joint motion per tool motion that is too much, how much farther a way
# round a stop must be.
_SUBSTEPS, _AWAY = 48, 8.0 * TURN
_NEAR_SINGULAR = {"rad": 0.3, "m": 0.3, "SI": 0.03}
_AMPLIFIED, _DETOUR = 5.0, 1.5


@dataclass(frozen=True, slots=True, eq=False)
class _Halt:
    """Where a motion does not go on: from q ``(n,)`` at waypoint `before` to the question of waypoint `after`.

    Attributes:
        way: what is the same all along.
        question, relaxed: what is asked for at `after`, and whether the roll is given up there.
        q: the last configuration of the motion.
        before, after: neighbours; `after` comes first if the motion was followed backwards.
        index: the jump to be explained ends at this waypoint.
    """

    way: Way
    question: Question
    relaxed: bool
    q: Array
    before: int
    after: int
    index: int

    @property
    def is_here(self) -> bool:
        """Whether it is at the jump itself."""
        return sorted((self.before, self.after)) == [self.index - 1, self.index]

    @property
    def place(self) -> str:
        """The same as the beginning of a clause."""
        if self.is_here:
            return "there"
        a, b = sorted((self.before, self.after))
        motion = "followed backwards, it" if self.before > self.after else "without it the motion"
        return f"{motion} ends between waypoints {a} and {b}, where"

    def farthest(self, q: Array | None) -> float:
        """The motion to a configuration ``(n,)``, infinite if there is none."""
        return math.inf if q is None else self.way.farthest(self.q, q)


def jump_at(course: Course, q: Array, index: int, end: DeadEnd | None) -> PathJump:
    """The jump between waypoints index − 1 and index of the path ``(k, n)``, and why there must be one."""
    way = course.way
    moves = way.moves(q[index - 1], q[index])
    joints = tuple(np.flatnonzero(moves > way.max_step).tolist())
    cause, why = _judged(_halt(course, q, index, end))
    widest = int(np.argmax(moves))
    others = f" (and {len(joints) - 1} more)" if len(joints) > 1 else ""
    name, size = messages.joint(way.question.robot, widest), way.told(widest, float(moves[widest]))
    reason = f"Between waypoints {index - 1} and {index} {name}{others} leaps by {size}: {why}."
    return PathJump(index, joints, float(moves.max()), cause, reason)


def _halt(course: Course, q: Array, index: int, end: DeadEnd | None) -> _Halt:
    """Where the motion does not go on: from the dead end if one is known, else from either side of the jump."""
    way = course.way
    starts = [(index - 1, q[index - 1], 1), (index, q[index], -1)]
    if end is not None:
        starts.insert(0, (end.waypoint, end.q, 1))
    for at, here, direction in starts:
        if at not in course.at:
            continue
        s = course.at.index(at)
        followed = continued(course, s, here, direction, way.max_step)
        if followed:
            s, here = followed[-1]
        if 0 <= s + direction < len(course.stops):
            stop = course.stops[s + direction]
            return _Halt(way, stop.question, stop.relaxed, here, course.at[s], course.at[s + direction], index)
    # Each side goes on to its gap or end: the leap is between two configurations that are given.
    question = replace(way.question, T=fk(way.question.robot, q[index]))
    return _Halt(way, question, False, q[index - 1], index - 1, index, index)


def _judged(halt: _Halt) -> tuple[JumpCause, str]:
    """What stops the motion, and that as a clause."""
    way, question = halt.way, halt.question
    reach = way.max_step * abs(halt.after - halt.before)
    free = _unlimited(question, np.array(question.locked))
    there = nearest(way, free, halt.relaxed, halt.q)
    if any(question.locked) and halt.farthest(there) > reach:
        free = _unlimited(question, np.zeros(len(halt.q), dtype=np.bool_))
        there = nearest(way, free, halt.relaxed, halt.q)
    within = nearest(way, question, halt.relaxed, halt.q)
    violations = () if there is None else violations_of(question, there)
    least = halt.farthest(there)
    if violations and (least <= reach or halt.farthest(within) > _DETOUR * least):
        return "limits", _stopped(halt, violations)
    shift, turn = measure(question, halt.q[None], halt.q)[1][0, [POSITION_ERROR, ROTATION_ERROR]].tolist()
    if least > _AMPLIFIED * max(shift / question.robot.reach, turn):
        broken = _broken(halt, free)
        if broken is not None:
            return broken
    who = "the waypoints" if not halt.is_here else "they"
    joint = 0 if there is None else int(np.argmax(way.moves(halt.q, there)))
    turns = f" and turns by {messages.degrees(turn)}" if turn > TOLERANCES.closure_rotation else ""
    return "spacing", (
        f"{halt.place} {who} are too far apart for steps of {way.told(joint, way.max_step)}: "
        f"the tool moves by {messages.millimetres(shift)}{turns}"
    )


def _stopped(halt: _Halt, violations: Sequence[LimitViolation]) -> str:
    """The motion goes on, but a joint does not."""
    first = max(violations, key=lambda v: abs(v.value - v.limit))
    robot = halt.question.robot
    does = "is locked at" if halt.question.locked[first.joint] else "reaches its stop at"
    stop = messages.joint_value(robot, first.joint, first.limit)
    return f"{halt.place} {messages.joint(robot, first.joint)} {does} {stop}"


def _broken(halt: _Halt, question: Question) -> tuple[JumpCause, str] | None:
    """What becomes of the motion on the straight way to the question's pose, the limits ignored; None: nothing."""
    robot, here = question.robot, halt.q
    if robot.n < 6 and question.code == POSE:
        # Few joints cannot take the poses between two of theirs: their point, and direction, can be followed.
        question = replace(question, code=APPROACH if robot.n == 5 else POSITION)
    T_start, worst = fk(robot, here), _singular(robot, here)
    for part in np.linspace(0.0, 1.0, _SUBSTEPS + 1)[1:].tolist():
        step = replace(question, T=_interpolated(T_start, question.T, part))
        found = nearest(halt.way, step, halt.relaxed, here)
        if found is None or halt.way.farthest(here, found) > LEAP:
            near, meaning = _singular(robot, here)
            if _exists(step, here):
                return "singularity", f"{halt.place} the motion meets a singularity, {meaning}"
            branch = question.branch_of(here)
            which = f" ({question.branch_name(branch)})" if branch >= 0 else ""
            where = f", {meaning}" if near <= 1.0 else ""
            return "branch", f"{halt.place} the branch being followed{which} ends{where}"
        here = found
        worst = min(worst, _singular(robot, here))
    if worst[0] > 1.0:
        return None
    return "singularity", f"{halt.place} the motion passes close to a singularity, {worst[1]}"


def _exists(question: Question, q: Array) -> bool:
    """Whether the branch that q ``(n,)`` is on goes on to the question's pose."""
    if has_closed_form(question):
        return bool(is_closed(branches_near(question, q).stats)[question.branch_of(q)])
    return len(descended(question, q[None])) > 0


def _singular(robot: Robot, q: Array) -> tuple[float, str]:
    """How near q ``(n,)`` is to a singularity, 1.0 being near, and to which one."""
    out = [(math.inf, "")]
    for found in singularities(robot, q):
        if found.kind != "algorithmic":
            scale = _NEAR_SINGULAR[found.unit] * (robot.reach if found.unit == "m" else 1.0)
            out.append((found.distance / scale, short(found)))
    return min(out)


def _interpolated(a: Array, b: Array, part: float) -> Array:
    """The pose on the straight way from a to b ``(4, 4)``, turning evenly about one axis."""
    w, *v = wxyz_from_rotation(a[:3, :3].T @ b[:3, :3]).tolist()
    sine = math.hypot(*v)
    half = part * math.atan2(sine, w)
    axis = np.array(v) / sine if sine > 0.0 else np.zeros(3)
    T = np.eye(4)
    T[:3, :3] = a[:3, :3] @ rotation_from_wxyz(np.array([math.cos(half), *(math.sin(half) * axis)]))
    T[:3, 3] = a[:3, 3] + part * (b[:3, 3] - a[:3, 3])
    return T


def _unlimited(question: Question, held: Flags) -> Question:
    """The same with the stops out of the way of any motion, but for those of joints `held` ``(n,)``."""
    away = np.where(held, 0.0, _AWAY)
    lower, upper = question.lower - away, question.upper + away
    return replace(question, lower=lower, upper=upper, low=lower, high=upper)
