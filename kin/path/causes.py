"""Why a jump is forced: follow the motion that cannot go on, and find out what ends it.

Where the search has found a dead end, the last waypoint that any path with fewer jumps reaches, the motion is
followed from there; else from before the jump, or backwards from behind it. At the waypoint that it does not
reach, the nearest configuration without joint limits distinguishes three cases:

- It is within one step, but outside the limits: ``limits``. A lock is the cause only if the limits alone are not.
- It is about as far away as the tool has to move: ``spacing``, the waypoints are too far apart.
- It is much farther away. Then the motion is followed in small steps along the straight line between the poses
  until it breaks off: on the same branch that is a ``singularity``, otherwise the end of the ``branch``. A motion
  that does not break off, but passes close to a singularity, is fast for that reason.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kin.angles import TURN
from kin.fk import fk
from kin.ik.branches import Flags, is_closed, measure, violations_of
from kin.ik.candidates import POSITION_ERROR, ROTATION_ERROR
from kin.ik.details import LimitViolation
from kin.ik.problem import IKProblem
from kin.path.configurations import LARGE, branches_near, continued, descended, nearest_solution
from kin.path.details import (
    BranchEnds,
    JumpCause,
    JumpDetails,
    LimitInTheWay,
    MotionEnd,
    NearSingularity,
    TooFarApart,
)
from kin.path.results import PathJump
from kin.path.search import DeadEnd
from kin.path.waypoints import LayerSequence, PathSettings, has_closed_form
from kin.robot import Robot
from kin.singularity import Singularity, singularities
from kin.solvers.contract import APPROACH, POSE, POSITION
from kin.tolerances import TOLERANCES
from kin.transforms import Array, rotation_from_wxyz, wxyz_from_rotation

# Small steps between two waypoints; how far limits are moved out of the way; distances that are near to a
# singularity (a length as a share of the arm's reach); joint motion per tool motion that is too much; how much
# longer a motion around a limit must be.
_SUBSTEPS, _AWAY = 48, 8.0 * TURN
_NEAR_SINGULAR = {"rad": 0.3, "m": 0.3, "SI": 0.03}
_AMPLIFIED, _DETOUR = 5.0, 1.5

Reason = tuple[JumpCause, JumpDetails]


@dataclass(frozen=True, slots=True, eq=False)
class _Break:
    """Where a motion does not go on: from q ``(n,)`` at waypoint `before` to the problem of waypoint `after`.

    Attributes:
        settings: what is constant along the path.
        problem, relaxed: what is to be met at `after`, and whether the roll is given up there.
        q: the last configuration of the motion.
        before, after: neighbours; `after` comes first in the path if the motion was followed backwards.
    """

    settings: PathSettings
    problem: IKProblem
    relaxed: bool
    q: Array
    before: int
    after: int

    def place(self, index: int) -> MotionEnd:
        """Where it is, seen from the jump before waypoint `index`."""
        first, second = sorted((self.before, self.after))
        return MotionEnd(first, second, (first, second) == (index - 1, index), self.before > self.after)

    def distance(self, q: Array | None) -> float:
        """The motion to a configuration ``(n,)``, infinite if there is none."""
        return math.inf if q is None else self.settings.largest_move(self.q, q)


def jump_at(sequence: LayerSequence, q: Array, index: int, end: DeadEnd | None) -> PathJump:
    """The jump between waypoints index − 1 and index of the path ``(k, n)``, and why it is forced."""
    settings = sequence.settings
    moves = settings.moves(q[index - 1], q[index])
    joints = tuple(np.flatnonzero(moves > settings.max_step).tolist())
    found = _break(sequence, q, index, end)
    cause, details = _reason(found)
    widest = int(np.argmax(moves))
    move = settings.joint_move(widest, float(moves[widest]))
    return PathJump(index, joints, float(moves.max()), move, cause, found.place(index), details)


def _break(sequence: LayerSequence, q: Array, index: int, end: DeadEnd | None) -> _Break:
    """Where the motion breaks off: after the dead end if there is one, else on either side of the jump."""
    settings = sequence.settings
    starts = [(index - 1, q[index - 1], 1), (index, q[index], -1)]
    if end is not None:
        starts.insert(0, (end.waypoint, end.q, 1))
    for at, here, direction in starts:
        if at not in sequence.at:
            continue
        s = sequence.at.index(at)
        followed = continued(sequence, s, here, direction, settings.max_step)
        if followed:
            s, here = followed[-1]
        if 0 <= s + direction < len(sequence.waypoints):
            waypoint = sequence.waypoints[s + direction]
            before, after = sequence.at[s], sequence.at[s + direction]
            return _Break(settings, waypoint.problem, waypoint.relaxed, here, before, after)
    # Both sides go on to a gap or an end of the path: the jump is between two given configurations.
    problem = replace(settings.problem, T=fk(settings.problem.robot, q[index]))
    return _Break(settings, problem, False, q[index - 1], index - 1, index)


def _reason(at: _Break) -> Reason:
    """What ends the motion."""
    settings, problem = at.settings, at.problem
    reach = settings.max_step * abs(at.after - at.before)
    unlimited = _without_limits(problem, np.array(problem.locked))
    there = nearest_solution(settings, unlimited, at.relaxed, at.q)
    if any(problem.locked) and at.distance(there) > reach:
        unlimited = _without_limits(problem, np.zeros(len(at.q), dtype=np.bool_))
        there = nearest_solution(settings, unlimited, at.relaxed, at.q)
    within = nearest_solution(settings, problem, at.relaxed, at.q)
    violations = () if there is None else violations_of(problem, there)
    least = at.distance(there)
    if violations and (least <= reach or at.distance(within) > _DETOUR * least):
        return "limits", LimitInTheWay(_worst(violations))
    shift, turn = measure(problem, at.q[None], at.q)[1][0, [POSITION_ERROR, ROTATION_ERROR]].tolist()
    if least > _AMPLIFIED * max(shift / (problem.robot.reach or 1.0), turn):
        broken = _broken(at, unlimited)
        if broken is not None:
            return broken
    joint = 0 if there is None else int(np.argmax(settings.moves(at.q, there)))
    rotation = turn if turn > TOLERANCES.closure_rotation else 0.0
    return "spacing", TooFarApart(settings.joint_move(joint, settings.max_step), shift, rotation)


def _worst(violations: Sequence[LimitViolation]) -> LimitViolation:
    """The one that is farthest outside."""
    return max(violations, key=lambda v: abs(v.value - v.limit))


def _broken(at: _Break, problem: IKProblem) -> Reason | None:
    """What happens to the motion on the straight line to the problem's pose, without limits; None if nothing
    does."""
    robot, here = problem.robot, at.q
    if robot.n < 6 and problem.code == POSE:
        # Few joints cannot meet the poses between two of theirs; their point, or point and direction, can be
        # followed.
        problem = replace(problem, code=APPROACH if robot.n == 5 else POSITION)
    T_start, closest = fk(robot, here), _nearest_singularity(robot, here)
    for part in np.linspace(0.0, 1.0, _SUBSTEPS + 1)[1:].tolist():
        step = replace(problem, T=_interpolated(T_start, problem.T, part))
        found = nearest_solution(at.settings, step, at.relaxed, here)
        if found is None or at.settings.largest_move(here, found) > LARGE:
            distance, singularity = _nearest_singularity(robot, here)
            if _exists(step, here):
                return "singularity", NearSingularity(True, singularity)
            branch = problem.branch_of(here)
            name = problem.branch_name(branch) if branch >= 0 else None
            return "branch", BranchEnds(name, singularity if distance <= 1.0 else None)
        here = found
        closest = min(closest, _nearest_singularity(robot, here), key=lambda pair: pair[0])
    if closest[0] > 1.0:
        return None
    return "singularity", NearSingularity(False, closest[1])


def _exists(problem: IKProblem, q: Array) -> bool:
    """Whether the branch of q ``(n,)`` goes on to the problem's pose."""
    if has_closed_form(problem):
        rows = list(problem.rows_named(problem.branch_name(problem.branch_of(q))))
        return bool(is_closed(problem, branches_near(problem, q).stats)[rows].any())
    return len(descended(problem, q[None])) > 0


def _nearest_singularity(robot: Robot, q: Array) -> tuple[float, Singularity | None]:
    """How near q ``(n,)`` is to a singularity, 1.0 being near, and to which one."""
    best: tuple[float, Singularity | None] = (math.inf, None)
    for found in singularities(robot, q):
        if found.kind != "algorithmic":
            scale = _NEAR_SINGULAR[found.unit] * (robot.reach if found.unit == "m" else 1.0)
            if found.distance / scale < best[0]:
                best = found.distance / scale, found
    return best


def _interpolated(a: Array, b: Array, part: float) -> Array:
    """The pose on the straight line from a to b ``(4, 4)``, turning evenly about one axis."""
    w, *v = wxyz_from_rotation(a[:3, :3].T @ b[:3, :3]).tolist()
    sine = math.hypot(*v)
    half = part * math.atan2(sine, w)
    axis = np.array(v) / sine if sine > 0.0 else np.zeros(3)
    T = np.eye(4)
    T[:3, :3] = a[:3, :3] @ rotation_from_wxyz(np.array([math.cos(half), *(math.sin(half) * axis)]))
    T[:3, 3] = a[:3, 3] + part * (b[:3, 3] - a[:3, 3])
    return T


def _without_limits(problem: IKProblem, held: Flags) -> IKProblem:
    """The same problem with the limits out of the way of any motion, except for those of joints `held`
    ``(n,)``."""
    away = np.where(held, 0.0, _AWAY)
    lower, upper = problem.lower - away, problem.upper + away
    return replace(problem, lower=lower, upper=upper, low=lower, high=upper)
