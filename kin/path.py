"""Path inverse kinematics: a sequence of poses solved to one continuous joint path.

Each pose has many configurations: branches, values of what is free, whole turns. Choosing the nearest one pose by
pose walks into dead ends: a joint winds up to its stop although it could have started a turn lower. Here the whole
path is chosen at once, as the shortest way through layers.

- **Layers.** The layer of a waypoint holds its branches at samples of the free parameters over the exact feasible
  arcs: their ends, their middles and a grid that is the same for every waypoint, so that a value can be kept; each
  at all whole-turn images inside the limits. At most 4000 configurations a layer, so 0.2 MB a waypoint for seven
  joints.
- **Way.** A step is a *jump* if some joint moves more than `max_step`. Dynamic programming (Viterbi, IEEE Trans.
  Information Theory 13(2), 1967) finds the way with the fewest jumps and, of these, the least sum of squared joint
  motion. Its time grows linearly with the number of waypoints.
- **Repair.** Samples may miss a narrow passage. Where the way jumps, motions are continued from both sides, each
  step to the nearest solution, and join the layers. If jumps remain, the grid is made finer.
- **Smoothing.** Samples make a staircase. Newton steps along the tangents of the task draw the path straight, as
  if neighbours were joined by springs; the search then chooses between the present path and the steps proposed.
  This also settles the angles that singular poses leave open. A slow drift is dear on a grid, so a second path,
  searched on a finer grid over every few waypoints, is smoothed too, and the better one is kept: not provably the
  least of all, but one that cannot be drawn straighter.

Tasks and arms without a closed form get their layers from numeric continuation: descents from many places at one
end of the path are followed to the other end, and back. There the fewest jumps *found* are told. Where a closed
form leaves two values free, continuation comes first too, and samples of both only if jumps remain.

Joints without stops or with more than two turns of travel are followed as a circle; their turns are counted
afterwards, and rewound only where a stop asks for it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kin import explain, search
from kin.branches import Branches, Flags, is_closed, measure, solution, solve_branches, violations_of
from kin.errors import InputError
from kin.finish import OVERRUN, POSITION_ERROR, ROLL, ROTATION_ERROR, select
from kin.fk import fk
from kin.ik import answer
from kin.kernels import fk_into, jit
from kin.question import Frame, Limits, Locks, Question, ask
from kin.results import IKResult, LimitViolation, Status, Task
from kin.robot import Robot
from kin.singularity import singularities
from kin.solvers.common import APPROACH, MASK, POSE, POSITION, TURN, Problem, relative_pose, wrap
from kin.tolerances import TOLERANCES
from kin.transforms import (
    Array,
    as_transform,
    finite_array,
    rotation_angle,
    rotation_from_wxyz,
    vector_angle,
    wxyz_from_rotation,
)

JumpCause = Literal["limits", "singularity", "branch", "spacing"]

PRISMATIC_WEIGHT = 4.0  # radians that a metre of a sliding joint counts as

# Layers: radians between samples (for 60 waypoints and more; down to half of it for fewer), most configurations,
# starts of descents, misses that are polished, travel above which a joint is a circle.
_GRID = math.radians(15.0)
_MOST_NODES = 4000
_POOL = 24
_HAIR = 1e-6
_WIDE = 2.0 * TURN + 1e-9
# Search: weight of the start's distance from home, rounds of repair, motions continued and pools made in each,
# radians of motion between the waypoints that a drift is searched over.
_PULL = 1e-6
_REPAIRS, _MOST_CONTINUED, _MOST_POOLS = 3, 24, 4
_DRIFT = 0.6
# Smoothing: rounds, share of the cost that is not worth another one, hardest pull on a jump; stiffness across the
# tangent and of a joint held at its stop, radians a joint may go in one step, half width of a difference.
_ROUNDS, _SETTLED, _HARDEST = 24, 1e-5, 256.0
_STIFF, _RIGID, _TRUST, _DELTA = 1e6, 1e9, 0.6, 1e-6
# Causes: small steps between two waypoints, radians in one of them that are a leap, how far stops are moved out
# of the way, what is near to a singularity (a length as a share of the arm's reach), joint motion per tool motion
# that is too much, how much farther a way round a stop must be.
_SUBSTEPS, _LEAP, _AWAY = 48, 0.125, 8.0 * TURN
_NEAR_SINGULAR = {"rad": 0.3, "m": 0.3, "SI": 0.03}
_AMPLIFIED, _DETOUR = 5.0, 1.5


@dataclass(frozen=True, slots=True)
class PathJump:
    """A step that cannot be followed without a leap.

    Attributes:
        index: the leap is between waypoint `index` − 1 and waypoint `index`.
        joints: indices of the joints that move more than the largest step allowed.
        step: the largest of these motions: radians, or 4 per metre for a sliding joint.
        cause: ``"limits"``: the motion goes on continuously, but beyond a stop; ``"singularity"``: so near to a
            singularity that joints must turn fast; ``"branch"``: the branch being followed ends;
            ``"spacing"``: the motion is continuous, the waypoints are just too far apart for the largest step.
        reason: the same as a sentence, with the joint, the stop and the waypoints where it happens.
    """

    index: int
    joints: tuple[int, ...]
    step: float
    cause: JumpCause
    reason: str


@dataclass(frozen=True, slots=True)
class PathGap:
    """A waypoint without an exact answer: its index, and `kin.solve_ik`'s status, sentence and missing metres."""

    index: int
    status: Status
    reason: str
    distance: float


@dataclass(frozen=True, slots=True, eq=False)
class PathResult:
    """A joint path, one configuration per waypoint.

    Attributes:
        q: ``(k, n)``, inside the limits, read-only. In a gap: the closest configuration; of about equally close
            ones one that its neighbours can reach without a leap.
        continuous: whether there is no jump.
        jumps, gaps: by rising index. A waypoint at which an arm of five joints keeps point and approach direction
            and gives up the roll is a gap of status ``approximate``.
        position_error, rotation_error: ``(k,)``, measured by forward kinematics, as in `kin.IKSolution`.
        solver: name of the closed form, ``"numeric"`` if the arm has none for this task.
        reason: the whole in a sentence.
    """

    q: Array
    continuous: bool
    jumps: tuple[PathJump, ...]
    gaps: tuple[PathGap, ...]
    position_error: Array
    rotation_error: Array
    solver: str
    reason: str


def solve_path(
    robot: Robot,
    targets: Sequence[ArrayLike] | Array,
    *,
    task: Task = "pose",
    mask: Sequence[bool] | None = None,
    mask_frame: Frame = "tool",
    q_start: ArrayLike | None = None,
    limits: Limits | None = None,
    locked: Locks | None = None,
    branch: str | Sequence[str] | None = None,
    max_step: float = 0.5,
) -> PathResult:
    """One joint path through all `targets`: as few jumps as possible, then as little joint motion as possible.

    Args:
        robot: the arm.
        targets: T_base_tool ``(k, 4, 4)``, k ≥ 1; for ``task="position"`` also points ``(k, 3)`` in metres.
        task, mask, mask_frame, limits, locked, branch: as in `kin.solve_ik`, for every waypoint; the branch
            ``"seed"`` is the one `q_start` is on.
        q_start: ``(n,)`` where the arm is. The way from there to the first waypoint counts as motion, but never as
            a jump: the path begins at its first waypoint. Without it the path may start anywhere, and of equally
            good paths the one that starts nearest to the home pose is taken.
        max_step: the most a joint may move between neighbouring waypoints: radians, or 4 per metre.

    Raises:
        InputError: a malformed target (named ``targets[i]``) or option. An unreachable target is not an error.
    """
    step = _checked_step(max_step)
    if q_start is not None and robot.check_q(q_start, "q_start").ndim != 1:
        raise InputError("q_start", q_start, f"one configuration of {robot.n} values")
    question = ask(
        robot,
        np.eye(4),
        task=task,
        mask=mask,
        mask_frame=mask_frame,
        q_seed=q_start,
        limits=limits,
        locked=locked,
        branch=branch,
    )
    poses = _checked_targets(targets, question.code)
    way = _Way(
        question=question,
        weight=np.where(robot.revolute, 1.0, PRISMATIC_WEIGHT),
        ring=np.where(robot.revolute & ~(question.upper - question.lower <= _WIDE), TURN, 0.0),
        max_step=step,
        pull=_PULL if q_start is None else 1.0,
        grid=_GRID * min(max(len(poses) / 60.0, 0.5), 1.0),
    )
    questions = [replace(question, T=T) for T in poses]
    sampled = _is_sampled(question)
    stops = [_stop(asked, way.grid) for asked in questions] if sampled else _numeric_stops(questions)
    course = _Course.through(way, stops)
    q = np.full((len(stops), robot.n), math.nan)
    ends: list[_DeadEnd] = []
    if course.stops:
        q[course.at], ends = _route(course)
    _fill_gaps(way, stops, q)
    return _report(course, stops, q, ends)


# -- input --------------------------------------------------------------------------------------------------------


def _checked_step(value: object) -> float:
    number = math.nan
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    if not 0.0 < number < math.inf:
        raise InputError("max_step", value, "a finite number above 0: radians, or 4 per metre")
    return number


def _checked_targets(targets: object, code: int) -> list[Array]:
    """Every target as a pose ``(4, 4)``."""
    if isinstance(targets, np.ndarray):
        targets = list(targets) if targets.ndim else None
    if not isinstance(targets, Sequence) or isinstance(targets, str | bytes):
        raise InputError("targets", targets, "a sequence of poses (k, 4, 4)")
    if not targets:
        raise InputError("targets", targets, "at least one pose")
    return [_checked_target(f"targets[{i}]", target, code) for i, target in enumerate(targets)]


def _checked_target(field: str, target: ArrayLike, code: int) -> Array:
    if code == POSITION and np.shape(target) == (3,):
        T = np.eye(4)
        T[:3, 3] = finite_array(field, target, (3,))
    else:
        T = as_transform(target, field)
    if float(np.abs(T[:3, 3]).max()) > 1e6:
        raise InputError(f"{field} position", T[:3, 3].tolist(), "coordinates below 1e6 m")
    return T


# -- what a path is made of ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Way:
    """What is the same all along.

    Attributes:
        question: limits, task, where the arm is (its seed).
        weight, ring: ``(n,)`` weights of the joints, 2π for a joint that is followed as a circle, else 0.
        max_step: a weighted motion larger than this is a jump.
        pull: weight of the motion from the seed to the first waypoint.
        grid: radians between samples of what is free.
    """

    question: Question
    weight: Array
    ring: Array
    max_step: float
    pull: float
    grid: float

    def moves(self, a: Array, b: Array) -> Array:
        """Weighted motion of each joint from a to b ``(..., n)``."""
        return np.asarray(np.abs(b - a) * self.weight)


@dataclass(frozen=True, slots=True, eq=False)
class _Stop:
    """A waypoint.

    Attributes:
        asked: the question as it was put.
        question: what the configurations meet: only point and approach direction where the roll is given up.
        layer: configurations to choose from ``(m, n)``, none in a gap.
        gap: why there is none.
    """

    asked: Question
    question: Question
    layer: Array
    gap: IKResult | None = None

    @property
    def relaxed(self) -> bool:
        """Whether the roll was given up."""
        return self.question.code != self.asked.code


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """The waypoints that have a layer: their indices, and how many steps lie between each and the one before."""

    way: _Way
    stops: list[_Stop]
    at: list[int]
    spans: list[int]

    @classmethod
    def through(cls, way: _Way, stops: list[_Stop]) -> _Course:
        at = [i for i, stop in enumerate(stops) if len(stop.layer)]
        return cls(way, [stops[i] for i in at], at, [1, *np.diff(at).tolist()])

    @property
    def free(self) -> bool:
        """Whether a finer grid of free values would be another one."""
        question = self.way.question
        return _has_closed_form(question) and not all(freedom.rare for freedom in question.freedoms)

    @property
    def sampled(self) -> bool:
        """Whether the layers are samples over all there is."""
        return _is_sampled(self.way.question)

    def rank(self, q: Array) -> tuple[int, float]:
        """Jumps and sum of squares of a path ``(s, n)``, the motion to its start included: what is minimised."""
        moves = self.way.moves(q[:-1], q[1:])
        start = self.way.moves(self.way.question.seed, q[0])
        cost = self.way.pull * (start**2).sum() + ((moves**2).sum(axis=1) / self.spans[1:]).sum()
        return len(_leaps(self.way, q, self.spans)), float(cost)


def _leaps(way: _Way, q: Array, spans: Sequence[int]) -> list[int]:
    """The steps of a path ``(s, n)`` that are jumps, by the index of their end."""
    allowed = way.max_step * (1.0 + 1e-9) * np.array(spans[1:])
    leaps: list[int] = (1 + np.flatnonzero(way.moves(q[:-1], q[1:]).max(axis=1) > allowed)).tolist()
    return leaps


# -- layers -------------------------------------------------------------------------------------------------------


def _has_closed_form(question: Question) -> bool:
    """Whether a closed form answers the task; a lone point leaves too much free and is left to descents."""
    match = question.match
    return match is not None and question.code != POSITION and match.solver.handles(match.geometry, question.code)


def _is_sampled(question: Question) -> bool:
    """Whether layers are samples from the start; two free values are sampled only when there is need."""
    return _has_closed_form(question) and len(question.freedoms) < 2


def _stop(asked: Question, grid: float) -> _Stop:
    """A waypoint whose task has a closed form."""
    stop = _Stop(asked, asked, _sampled(asked, False, grid))
    if not len(stop.layer) and asked.robot.n < 6 and asked.code == POSE:
        question = replace(asked, code=APPROACH, task="approach")
        stop = _Stop(asked, question, _sampled(question, True, grid))
    return stop if len(stop.layer) else _stop_by_answer(asked)


def _stop_by_answer(asked: Question) -> _Stop:
    """What the whole pipeline makes of a waypoint where the layer stays empty."""
    result = answer(asked)
    q = np.array([s.q for s in result.solutions]).reshape(-1, asked.robot.n)
    if result.status is not Status.SOLVED:
        return _Stop(asked, asked, q[:0], result)
    return _Stop(asked, asked, _with_images(asked, q))


def _near(question: Question, seed: Array, values: tuple[float, ...] | None = None) -> Branches:
    """The branches nearest to a seed ``(n,)``, of a question that a closed form answers."""
    found = solve_branches(question, question.T, question.code, seed, values)
    assert found is not None
    return found


def _at(question: Question, values: tuple[float, ...]) -> Array:
    """The branches ``(b, n)`` at given values of all that is free: raw, whatever the limits say."""
    match = question.match
    assert match is not None
    problem = Problem(question.T, question.code, values, False, question.seed, question.lower, question.upper)
    return match.solver.solve(match.geometry, problem).q


def _sampled(question: Question, relaxed: bool, grid: float) -> Array:
    """The layer of a waypoint from its closed form."""
    found = _near(question, question.seed)
    samples = _samples(question, found, grid)
    while True:
        q = np.concatenate([found.q, *(_at(question, values) for values in samples)])
        layer = _with_images(question, _kept(question, relaxed, q, question.seed))
        if len(layer) <= _MOST_NODES or len(samples) == 1:
            return layer[:_MOST_NODES]
        samples = samples[:: math.ceil(len(layer) / _MOST_NODES)]


def _samples(question: Question, found: Branches, grid: float) -> list[tuple[float, ...]]:
    """Values of the freedoms to ask for, those the arcs allow; of two freedoms in every combination."""
    samples: list[tuple[float, ...]] = []
    if len(question.freedoms) == 1:
        samples = [(v,) for v in _marks(question, found.arcs[0], grid)]
    elif len(question.freedoms) == 2:
        for v in _marks(question, found.arcs[0], 4.0 * grid):
            there = _near(question, question.seed, (v, math.nan))
            samples += [(v, w) for w in _marks(question, there.arcs[1], 4.0 * grid)]
    return samples or [(math.nan,) * len(question.freedoms)]


def _marks(question: Question, arcs: Array, step: float) -> list[float]:
    """Ends, middles and grid points of the arcs of one freedom; of values a whole turn apart only one."""
    marks: list[float] = []
    for branch, low, high in arcs.tolist():
        if question.allows(int(branch)):
            inset = min(1e-7, 0.5 * (high - low))
            marks += [low + inset, 0.5 * (low + high), high - inset]
            marks += [i * step for i in range(math.ceil(low / step), math.floor(high / step) + 1)]
    marks = sorted(wrap(v) for v in marks)
    return [v for i, v in enumerate(marks) if i == 0 or v - marks[i - 1] > 1e-9]


def _kept(question: Question, relaxed: bool, q: Array, near: Array) -> Array:
    """Of whole sets of branches ``(sets · b, n)`` what meets the task inside the limits.

    The rows come at the whole turns nearest to `near`; of rows that give up the roll those that give up least.
    """
    if question.branches is not None:
        assert question.match is not None
        count = len(question.match.solver.BRANCHES)
        q = q[[question.allows(i % count) for i in range(len(q))]]
    q, stats = measure(question, q[~np.isnan(q[:, 0])], near)
    good = _meets(stats)
    miss = stats[:, POSITION_ERROR] + stats[:, ROTATION_ERROR] + stats[:, OVERRUN]
    hair = np.flatnonzero(~good & (miss < _HAIR))[:8]
    if len(hair):
        missed = Branches(q[hair], stats[hair], (), np.empty((len(hair), 0)), [], 0.0, "")
        good[hair] = search.polish(question, missed)
        q[hair], stats[hair] = missed.q, missed.stats
    if relaxed and good.any():
        roll = np.abs(stats[:, ROLL])
        good &= _alike(roll, float(roll[good].min()))
    return np.asarray(q[good])


def _meets(stats: Array) -> Flags:
    return np.asarray(is_closed(stats) & (stats[:, OVERRUN] == 0.0))


def _alike(miss: Array, least: float) -> Flags:
    """Which misses are nearly as good as the least one: a path had better not leap for the difference."""
    return np.asarray(miss <= 1.05 * least + 1e-3)


def _with_images(question: Question, q: Array) -> Array:
    """Every row ``(m, n)`` at all its whole-turn images inside the limits; circles as they are."""
    for i in np.flatnonzero(question.turns > 0.0).tolist():
        low, high = question.lower[i], question.upper[i]
        if not TURN - 1e-8 <= high - low <= _WIDE:
            continue
        first = np.ceil((low - TOLERANCES.limit - q[:, i]) / TURN)
        count = (np.floor((high + TOLERANCES.limit - q[:, i]) / TURN) - first + 1.0).astype(np.int64)
        rows = np.repeat(np.arange(len(q)), count)
        turn = first[rows] + np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
        q = q[rows]
        q[:, i] = np.clip(q[:, i] + TURN * turn, low, high)
    return np.ascontiguousarray(q)


def _nearest(way: _Way, question: Question, relaxed: bool, q: Array) -> Array | None:
    """The configuration nearest to q ``(n,)`` that meets the question."""
    found = np.empty((0, len(q)))
    if _has_closed_form(question):
        found = _kept(question, relaxed, _near(question, q).q, q)
    if not len(found) or way.moves(found, q).max(axis=1).min() > _LEAP:
        found = np.concatenate([found, _descended(question, q[None])])
    return np.asarray(found[np.argmin(way.moves(found, q).max(axis=1))]) if len(found) else None


# -- layers without a closed form ---------------------------------------------------------------------------------


def _numeric_stops(questions: list[Question]) -> list[_Stop]:
    """Layers of continuations, from the first waypoint to the last and back."""
    forth: list[Array] = []
    alive = np.empty((0, questions[0].robot.n))
    for question in questions:
        here = _descended(question, alive)
        if not len(here):
            here = _descended(question, np.concatenate([alive, search.starting_points(question, count=_POOL)]))
        alive = here if len(here) else alive
        forth.append(here)
    alive = _descended(questions[-1], search.starting_points(questions[-1], count=_POOL))
    out = []
    for asked, here in zip(reversed(questions), reversed(forth), strict=True):
        back = _descended(asked, alive)
        alive = back if len(back) else here
        layer = _with_images(asked, _distinct(np.concatenate([here, back]), asked.seed))
        out.append(_Stop(asked, asked, layer[:_MOST_NODES]) if len(layer) else _stop_by_answer(asked))
    return out[::-1]


def _descended(question: Question, starts: Array) -> Array:
    """Configurations ``(m, n)`` that meet the question, where descents from the starts end: each once."""
    if not len(starts):
        return starts
    q, _ = search.descend_each(question, question.code, starts, 1.0)
    q, stats = measure(replace(question, turns=np.zeros(question.robot.n)), q)
    q = q[_meets(stats)]
    if question.branches is not None:
        q = q[[question.allows(question.branch_of(row)) for row in q]]
    return _distinct(q, question.seed)[:_POOL]


def _distinct(q: Array, near: Array) -> Array:
    """The rows ``(m, n)``, each once, the nearest to `near` first."""
    kept, count = select(np.ascontiguousarray(q), np.linalg.norm(q - near, axis=1))
    return np.asarray(q[kept[:count]])


# -- the shortest way through layers ------------------------------------------------------------------------------


@jit
def _first_from(values: Array, least: float) -> int:
    """The index of the first of the rising values ``(m,)`` that is not below `least`, m if there is none."""
    a, b = 0, values.shape[0]
    while a < b:
        middle = (a + b) // 2
        if values[middle] < least:
            a = middle + 1
        else:
            b = middle
    return a


@jit
def _advance(
    before: Array, jumps: Array, cost: Array, order: Array, key: int, sorted_key: Array, by_key: Array,
    here: Array, weight: Array, ring: Array, allowed: float, scale: float, jumps_out: Array, cost_out: Array,
    parent: Array,
) -> None:  # fmt: skip
    """One layer on: the best predecessor of each row of `here` ``(p, n)`` among the rows of `before` ``(m, n)``.

    Steps without a jump first: their predecessors lie in a window of joint `key`, whose values are `sorted_key` in
    the order `by_key`. Then jumps, from predecessors in the order of their own jumps and cost: the search ends at
    the first that would not be better for a jump of no length, so mostly at once. Of equals the jump is taken: it
    comes as late as it can. Row numbers are floats.
    """
    m, n = before.shape
    for j in range(here.shape[0]):
        best, best_jumps, best_cost = 0, math.inf, math.inf
        first, last = 0, m
        if key >= 0:
            reach = allowed / weight[key] * (1.0 + 1e-9)
            first = _first_from(sorted_key, here[j, key] - reach)
            last = _first_from(sorted_key, here[j, key] + reach)
        tie = 0.0
        for leap in range(2):
            if leap == 1:
                first, last = 0, m
                tie = 1e-11 * (1.0 + best_cost)
            for o in range(first, last):
                i = int(order[o]) if leap == 1 else int(by_key[o])
                count = jumps[i] + leap
                enough = best_cost + tie
                if count > best_jumps or (count == best_jumps and cost[i] >= enough):
                    if leap == 1:
                        break
                    continue
                total = cost[i]
                worse = False
                for k in range(n):
                    d = here[j, k] - before[i, k]
                    if ring[k] > 0.0:
                        d -= ring[k] * math.floor(d / ring[k] + 0.5)
                    d *= weight[k]
                    total += scale * d * d
                    if (leap == 0 and abs(d) > allowed) or (count == best_jumps and total >= enough):
                        worse = True
                        break
                if not worse:
                    best, best_jumps, best_cost = i, count, total
                    tie = 0.0
        parent[j], jumps_out[j], cost_out[j] = best, best_jumps, best_cost


class _Trellis(NamedTuple):
    """The shortest way: its row in each layer and its jumps; the fewest jumps and the cost of every row."""

    rows: list[int]
    jumps: int
    fewest: list[Array]
    costs: list[Array]

    def path(self, layers: Sequence[Array]) -> Array:
        """The configurations on the way ``(s, n)``."""
        return np.array([layer[row] for layer, row in zip(layers, self.rows, strict=True)])


def _shortest(way: _Way, layers: Sequence[Array], spans: Sequence[int], ring: Array, allowed: float) -> _Trellis:
    """Viterbi's algorithm over layers ``(m_i, n)``; from layer i − 1 to layer i there are spans[i] steps."""
    start = layers[0] - way.question.seed
    start -= ring * np.floor(start / TURN + 0.5)
    jumps, costs = [np.zeros(len(start))], [way.pull * ((start * way.weight) ** 2).sum(axis=1)]
    parents: list[Array] = []
    for i in range(1, len(layers)):
        more, cost, parent = (np.empty(len(layers[i])) for _ in range(3))
        before = layers[i - 1]
        order = np.lexsort((costs[-1], jumps[-1])).astype(np.float64)
        key = int(np.argmax(np.where(ring > 0.0, -1.0, np.ptp(before, axis=0) * way.weight)))
        by_key = np.argsort(before[:, key], kind="stable")
        _advance(
            before, jumps[-1], costs[-1], order, -1 if ring[key] > 0.0 else key, before[by_key, key],
            by_key.astype(np.float64), layers[i], way.weight, ring, allowed * spans[i], 1.0 / spans[i], more, cost,
            parent,
        )  # fmt: skip
        jumps.append(more)
        costs.append(cost)
        parents.append(parent)
    row = int(np.lexsort((costs[-1], jumps[-1]))[0])
    fewest = int(jumps[-1][row])
    rows = [row]
    for parent in reversed(parents):
        row = int(parent[row])
        rows.append(row)
    return _Trellis(rows[::-1], fewest, jumps, costs)


# -- the route: search, repair, smoothing -------------------------------------------------------------------------


class _DeadEnd(NamedTuple):
    """The last waypoint that a way with a certain number of jumps reaches, and where the best one is there."""

    waypoint: int
    q: Array


def _route(course: _Course) -> tuple[Array, list[_DeadEnd]]:
    """The path ``(s, n)``, and where the ways with 0, 1, … jumps end.

    While samples are coarse, a step as long as the grid's own is no jump. If jumps remain, a finer grid is
    searched, then with other measures of what a jump is; the best path is kept.
    """
    way = course.way
    layers = [stop.layer for stop in course.stops]
    loose = max(way.max_step, 2.0 * way.grid - 0.05)
    found: list[tuple[tuple[int, float], Array]] = []
    ends: list[_DeadEnd] = []
    for turn, allowed in enumerate((loose, loose, 2.0 * loose, way.max_step)):
        if turn == 1 and course.free:
            finer = (_sampled(stop.question, stop.relaxed, 0.5 * way.grid) for stop in course.stops)
            layers = [new if len(new) else stop.layer for new, stop in zip(finer, course.stops, strict=True)]
        elif turn and allowed == loose:
            continue
        trellis = _searched(course, layers, allowed)
        if allowed == way.max_step:
            ends = [_DeadEnd(course.at[s], layers[s][row]) for s, row in _dead_ends(trellis)]
        starts = [_unwound(way, trellis.path(layers))]
        if not found:
            starts += _strided(course, starts[0])
        for start in starts:
            q = _smoothed(course, start)
            found.append((course.rank(q), q))
        least = min(rank for rank, _ in found)[0]
        if least <= _rewound(way, starts[0]):
            break
    return min(found, key=lambda pair: pair[0])[1], ends


def _searched(course: _Course, layers: list[Array], allowed: float) -> _Trellis:
    """The shortest way; while it jumps, with continuations of the motions on both sides added to the layers."""
    way = course.way
    trellis = _shortest(way, layers, course.spans, way.ring, allowed)
    for _ in range(_REPAIRS):
        if trellis.jumps == 0:
            break
        starts = [(s, row, 1) for s, row in _dead_ends(trellis)]
        for s in range(1, len(layers)):
            a, b = trellis.rows[s - 1], trellis.rows[s]
            if trellis.fewest[s][b] > trellis.fewest[s - 1][a]:
                starts += [(s - 1, a, 1), (s, b, -1)]
        motions = [(s, layers[s][row], direction) for s, row, direction in starts[:_MOST_CONTINUED]]
        if not course.sampled:
            for s in sorted({s for s, _, _ in motions})[:_MOST_POOLS]:
                question = course.stops[s].question
                pool = _descended(question, search.starting_points(question, count=_POOL))
                layers[s] = np.concatenate([layers[s], _with_images(question, pool)])
                motions += [(s, q, direction) for q in pool for direction in (1, -1)]
        for s, start, direction in motions:
            for i, q in _continued(course, s, start, direction, allowed):
                layers[i] = np.concatenate([layers[i], _with_images(course.stops[i].question, q[None])])
        before = trellis.jumps
        trellis = _shortest(way, layers, course.spans, way.ring, allowed)
        if trellis.jumps == before:
            break
    return trellis


def _dead_ends(trellis: _Trellis) -> list[tuple[int, int]]:
    """For 0, 1, … jumps: the last layer that can be reached with so many, and its cheapest row."""
    least = np.array([jumps.min() for jumps in trellis.fewest])
    out = []
    for count in range(trellis.jumps):
        s = int(np.flatnonzero(least > count)[0]) - 1
        out.append((s, int(np.argmin(np.where(trellis.fewest[s] == count, trellis.costs[s], math.inf)))))
    return out


def _continued(course: _Course, s: int, q: Array, direction: int, allowed: float) -> list[tuple[int, Array]]:
    """The motion that goes on from q at waypoint s of the course, to the nearest solution, until it leaps."""
    out = []
    while 0 <= s + direction < len(course.stops):
        span = course.spans[max(s, s + direction)]
        s += direction
        stop = course.stops[s]
        found = _nearest(course.way, stop.question, stop.relaxed, q)
        if found is None or float(course.way.moves(found, q).max()) > allowed * span:
            break
        q = found
        out.append((s, found))
    return out


def _strided(course: _Course, q: Array) -> list[Array]:
    """Another path to smooth, if anything is free: searched over every few waypoints, on a finer grid.

    On a grid a slow drift is made of steps, each paid within one waypoint; over several waypoints it is a drift.
    """
    way = course.way
    speed = math.sqrt(course.rank(q)[1] / len(q))
    stride = min(max(round(_DRIFT / max(speed, 1e-9)), 2), 16, len(q) // 5)
    if not course.free or len(way.question.freedoms) > 1 or stride < 2 or max(course.spans) > 1:
        return []
    anchors = sorted({*range(0, len(q), stride), len(q) - 1})
    chosen = [course.stops[i] for i in anchors]
    layers = [_sampled(stop.question, stop.relaxed, 0.5 * _GRID) for stop in chosen]
    if not all(len(layer) for layer in layers):
        return []
    trellis = _shortest(way, layers, [1, *np.diff(anchors).tolist()], way.ring, way.max_step)
    knots = _unwound(way, trellis.path(layers))
    out = []
    for i, stop in enumerate(course.stops):
        between = np.array([np.interp(i, anchors, x) for x in knots.T])
        found = _nearest(way, stop.question, stop.relaxed, between)
        if found is None:
            return []
        out.append(found)
    return [np.array(out)]


def _unwound(way: _Way, q: Array) -> Array:
    """Joints that were followed as circles, with their turns counted ``(s, n)``.

    Each stretch that fits between the stops stays whole, at the turn nearest to where the one before ended; where
    it does not fit any longer the joint is rewound.
    """
    q = q.copy()
    for i in np.flatnonzero(way.ring > 0.0).tolist():
        low, high = way.question.lower[i] - TOLERANCES.limit, way.question.upper[i] + TOLERANCES.limit
        x = np.unwrap(q[:, i])
        last, first = float(way.question.seed[i]), 0
        while first < len(x):
            least = np.ceil((low - np.minimum.accumulate(x[first:])) / TURN)
            most = np.floor((high - np.maximum.accumulate(x[first:])) / TURN)
            fits = least <= most
            count = len(fits) if fits.all() else int(np.argmin(fits))
            turn = min(max(round((last - x[first]) / TURN), least[count - 1]), most[count - 1])
            q[first : first + count, i] = x[first : first + count] + turn * TURN
            first += count
            last = float(q[first - 1, i])
    return np.clip(q, way.question.lower, way.question.upper)


def _rewound(way: _Way, q: Array) -> int:
    """In how many steps a joint that was followed as a circle is turned back: no other way would save them."""
    return int((np.abs(np.diff(q, axis=0))[:, way.ring > 0.0] > math.pi).any(axis=1).sum())


def _smoothed(course: _Course, q: Array) -> Array:
    """The path ``(s, n)`` drawn as straight as it gets without turning anything over; it never gets worse.

    Once it is, the steps that are still too large are drawn together harder and harder: the others may take over.
    """
    rank, pull = course.rank(q), 1.0
    for _ in range(_ROUNDS):
        step = _newton_step(course, q, pull)
        layers = [_proposed(stop, row, dq) for stop, row, dq in zip(course.stops, q, step, strict=True)]
        trellis = _shortest(course.way, layers, course.spans, np.zeros(q.shape[1]), course.way.max_step)
        q = trellis.path(layers)
        before, rank = rank, course.rank(q)
        if rank[0] < before[0] or rank[1] < before[1] * (1.0 - _SETTLED):
            pull = 1.0
        elif rank[0] == 0 or pull >= _HARDEST:
            break
        else:
            pull *= 4.0
    return q


def _proposed(stop: _Stop, q: Array, step: Array) -> Array:
    """q ``(n,)`` and the solutions near it, towards a step and parts of it ``(m, n)``."""
    wishes = [q + part * step for part in (1.0, 0.3)]
    if _has_closed_form(stop.question):
        rows = np.concatenate([_near(stop.question, wish).q for wish in wishes])
        more = _kept(stop.question, stop.relaxed, rows, q)
    else:
        more = _descended(stop.question, np.array(wishes))
    return np.concatenate([q[None], more])


def _newton_step(course: _Course, q: Array, pull: float) -> Array:
    """The step ``(s, n)`` to the least sum of squares along the tangents of the task, inside the limits.

    Steps that are jumps count `pull` times.

    Springs join the neighbours, so the normal equations are block tridiagonal. Leaving the tangent is made stiff,
    and joints that would pass a stop are held at it in a second and third pass.
    """
    question, weight = course.way.question, course.way.weight
    k, n = q.shape
    tangents = np.empty((k, 6, n))
    for stop, row, out in zip(course.stops, q, tangents, strict=True):
        target, mask = stop.question.T, question.mask
        if stop.question.code != MASK:
            kept = {POSE: 6, APPROACH: 5, POSITION: 3}[stop.question.code]
            target, mask = fk(question.robot, row), np.array([float(r < kept) for r in range(6)] + [0.0])
        _tangent(question.robot.model, target, mask, row.copy(), out)
    springs = np.array([course.way.pull, *(1.0 / span for span in course.spans[1:]), 0.0])[:, None] * weight**2
    springs[_leaps(course.way, q, course.spans)] *= pull
    stretch = springs * np.diff(np.concatenate([question.seed[None], q, q[-1:]]), axis=0)
    force = stretch[1:] - stretch[:-1]
    blocks = _STIFF * np.swapaxes(tangents, 1, 2) @ tangents
    blocks += (springs[:-1] + springs[1:] + 1e-9)[:, None, :] * np.eye(n)
    low, high = question.lower - q, question.upper - q
    step = _sweep(blocks, springs[1:-1], force)
    held = np.zeros((k, n), dtype=np.bool_)
    for _ in range(2):
        passed = (step < low - 1e-9) | (step > high + 1e-9)
        if not passed.any():
            break
        held |= passed
        stops = _RIGID * held * np.clip(step, low, high)
        step = _sweep(blocks + (_RIGID * held)[:, None, :] * np.eye(n), springs[1:-1], force + stops)
    return np.clip(step, np.maximum(low, -_TRUST), np.minimum(high, _TRUST))


def _sweep(blocks: Array, links: Array, right: Array) -> Array:
    """Solve a block tridiagonal system: blocks ``(k, n, n)``, off the diagonal −diag(links) ``(k − 1, n)``."""
    k, n = right.shape
    ahead, known = np.empty((k, n, n)), np.empty((k, n))
    block, rest = blocks[0], right[0]
    for i in range(k):
        if i:
            block = blocks[i] - links[i - 1][:, None] * ahead[i - 1]
            rest = right[i] + links[i - 1] * known[i - 1]
        link = np.diag(links[i]) if i < k - 1 else np.zeros((n, n))
        both = np.linalg.solve(block, np.column_stack([link, rest]))
        ahead[i], known[i] = both[:, :n], both[:, n]
    for i in range(k - 2, -1, -1):
        known[i] += ahead[i] @ known[i + 1]
    return known


@jit
def _tangent(model: Array, target: Array, mask: Array, q: Array, out: Array) -> None:
    """out ← derivative ``(6, n)`` of the masked coordinates of `relative_pose`, by central differences."""
    T, e = np.empty((4, 4)), np.empty(6)
    for j in range(q.shape[0]):
        x = q[j]
        for side in range(2):
            q[j] = x + _DELTA if side == 0 else x - _DELTA
            fk_into(model, q, T)
            relative_pose(T, target, mask[6] == 0.0, e)
            for r in range(6):
                out[r, j] = e[r] if side == 0 else mask[r] * (out[r, j] - e[r]) / (2.0 * _DELTA)
        q[j] = x


# -- gaps ---------------------------------------------------------------------------------------------------------


def _fill_gaps(way: _Way, stops: list[_Stop], q: Array) -> None:
    """The rows of q ``(k, n)`` that are NaN, in place: close configurations, chosen as one way with their ends.

    Candidates come from descents that start where the arm is before, where it is behind and in between, so that it
    follows a target out of reach and back without turning over; and from `kin.solve_ik`'s search over all limits.
    """
    gaps = np.flatnonzero(np.isnan(q[:, 0])).tolist()
    home = np.clip(way.question.seed, way.question.lower, way.question.upper)
    forth, back = q.copy(), q.copy()
    for i in gaps:
        if i and not np.isnan(forth[i - 1, 0]):
            forth[i] = _closest(stops[i], forth[i - 1])
        elif len(gaps) == len(q):
            forth[i] = _closest(stops[i], home)
    for i in reversed(gaps):
        if i + 1 < len(q) and not np.isnan(back[i + 1, 0]):
            back[i] = _closest(stops[i], back[i + 1])
    solved = np.flatnonzero(~np.isnan(q[:, 0]))
    layers = [row[None] for row in q]
    for i in gaps:
        sides = [rows[i] for rows in (forth, back) if not np.isnan(rows[i, 0])]
        if len(sides) == 2:
            behind, before = solved[solved > i].min(), solved[solved < i].max()
            share = (i - before) / (behind - before)
            sides.append(_closest(stops[i], sides[0] + share * (sides[1] - sides[0])))
        layers[i] = _as_close(stops[i], np.array(sides))
    if gaps:
        trellis = _shortest(way, layers, [1] * len(layers), np.zeros(q.shape[1]), way.max_step)
        q[gaps] = trellis.path(layers)[gaps]


def _closest(stop: _Stop, start: Array) -> Array:
    """A configuration ``(n,)`` as close to the target as a descent from `start` gets.

    Where the point can be met, but not the orientation, the point comes first. Where the descent leaves the
    branches asked for, the arm stays.
    """
    question, q = stop.asked, start
    if stop.gap is not None and stop.gap.status is Status.APPROXIMATE:
        for weight in (search.ORIENTATION_WEIGHT, 1e-2, 1e-4):
            q, _ = search.descend(question, question.code, q[None], weight)
        q, _ = search.descend(question, POSITION, q[None], 1.0)
    else:
        q, _ = search.descend(question, question.code, q[None], search.ORIENTATION_WEIGHT)
    if question.branches is not None and not question.allows(question.branch_of(q)):
        return np.clip(start, question.lower, question.upper)
    return q


def _as_close(stop: _Stop, q: Array) -> Array:
    """Of the configurations ``(m, n)`` and the best one known those about as close to the target as the best."""
    question = stop.asked
    best = stop.gap.best if stop.gap is not None else None
    if best is not None:
        q = np.concatenate([q, measure(question, best.q[None], q[0])[0]])
    q, stats = measure(replace(question, turns=np.zeros(q.shape[1])), q)
    miss = np.hypot(stats[:, POSITION_ERROR], search.ORIENTATION_WEIGHT * stats[:, ROTATION_ERROR])
    return np.ascontiguousarray(q[_alike(miss, float(miss.min()))])


# -- the report ---------------------------------------------------------------------------------------------------


def _report(course: _Course, stops: list[_Stop], q: Array, ends: list[_DeadEnd]) -> PathResult:
    """The path measured by forward kinematics, its jumps with their causes, its gaps with their reasons."""
    way = course.way
    still = np.zeros(q.shape[1])
    stats = np.concatenate(
        [measure(replace(stop.asked, turns=still), row[None])[1] for stop, row in zip(stops, q, strict=True)]
    )
    leaps = _leaps(way, q, [1] * len(q))
    # The jump number t is what the ways with fewer than t jumps end in; one beside a gap is looked at by itself.
    free = [i for i in leaps if stops[i].gap is None and stops[i - 1].gap is None]
    forced = dict(zip(free, ends, strict=True)) if len(free) == len(ends) else {}
    jumps = tuple(_jump(course, q, i, forced.get(i)) for i in leaps)
    gaps = tuple(_gap(stop, i, q[i], stats[i]) for i, stop in enumerate(stops) if stop.gap or stop.relaxed)
    match = way.question.match
    position, rotation = stats[:, POSITION_ERROR].copy(), stats[:, ROTATION_ERROR].copy()
    for array in (q, position, rotation):
        array.flags.writeable = False
    return PathResult(
        q=q,
        continuous=not jumps,
        jumps=jumps,
        gaps=gaps,
        position_error=position,
        rotation_error=rotation,
        solver=match.solver.NAME if match is not None and _has_closed_form(way.question) else "numeric",
        reason=_summary(way, q, jumps, gaps),
    )


def _gap(stop: _Stop, index: int, q: Array, stats: Array) -> PathGap:
    if stop.gap is not None:
        return PathGap(index, stop.gap.status, stop.gap.reason, stop.gap.distance)
    reason = explain.approximate(stop.asked, solution(stop.asked, q, stats, compromise="roll"), ())
    return PathGap(index, Status.APPROXIMATE, reason, 0.0)


def _summary(way: _Way, q: Array, jumps: tuple[PathJump, ...], gaps: tuple[PathGap, ...]) -> str:
    count = "one waypoint" if len(q) == 1 else f"{len(q)} waypoints"
    if jumps:
        where = ", ".join(f"before waypoint {jump.index} ({jump.cause})" for jump in jumps[:4])
        more = f" and {len(jumps) - 4} more" if len(jumps) > 4 else ""
        number = "one jump" if len(jumps) == 1 else f"{len(jumps)} jumps"
        text = f"{count.capitalize()} with {number}: {where}{more}."
    elif len(q) == 1:
        text = "One waypoint."
    else:
        moves = way.moves(q[:-1], q[1:]).max(axis=0)
        widest = int(np.argmax(moves))
        text = f"Continuous through {count}: the largest step is {_weighted(way, widest, moves[widest])}."
    if gaps:
        which = ", ".join(str(gap.index) for gap in gaps[:8]) + (", …" if len(gaps) > 8 else "")
        text += f" No exact answer at {len(gaps)} of {count}: {which}."
    return text


def _weighted(way: _Way, joint: int, move: float) -> str:
    """A weighted motion as the joint's own."""
    return _amount(way, joint, move / float(way.weight[joint]))


def _amount(way: _Way, joint: int, value: float) -> str:
    return explain.degrees(value) if way.question.robot.revolute[joint] else explain.millimetres(value)


def _name(way: _Way, joint: int) -> str:
    name, number = way.question.robot.joints[joint].name, f"joint {joint + 1}"
    return number if name in (number, str(joint + 1)) else f"{number} ({name})"


# -- why a jump is forced -----------------------------------------------------------------------------------------


def _jump(course: _Course, q: Array, index: int, end: _DeadEnd | None) -> PathJump:
    """The jump between waypoints index − 1 and index of the path ``(k, n)``, and why there must be one."""
    way = course.way
    moves = way.moves(q[index - 1], q[index])
    joints = tuple(np.flatnonzero(moves > way.max_step).tolist())
    cause, why = _cause(course, q, index, end)
    widest = int(np.argmax(moves))
    others = f" (and {len(joints) - 1} more)" if len(joints) > 1 else ""
    size = _weighted(way, widest, float(moves[widest]))
    reason = f"Between waypoints {index - 1} and {index} {_name(way, widest)}{others} leaps by {size}: {why}."
    return PathJump(index, joints, float(moves.max()), cause, reason)


def _cause(course: _Course, q: Array, index: int, end: _DeadEnd | None) -> tuple[JumpCause, str]:
    """Follow the motion that cannot go on, from before the jump or backwards from behind it: what stops it?

    Where a dead end is known, it is the place that no path with fewer jumps gets past, however it starts.
    """
    starts = [(index - 1, q[index - 1], 1), (index, q[index], -1)]
    if end is not None:
        starts.insert(0, (end.waypoint, end.q, 1))
    for at, here, direction in starts:
        if at not in course.at:
            continue
        s = course.at.index(at)
        followed = _continued(course, s, here, direction, course.way.max_step)
        if followed:
            s, here = followed[-1]
        if 0 <= s + direction < len(course.stops):
            stop = course.stops[s + direction]
            between = (course.at[s], course.at[s + direction])
            return _judged(course.way, stop.question, stop.relaxed, here, between, index)
    # Each side goes on to its gap or end: the leap is between two configurations that are given.
    question = replace(course.way.question, T=fk(course.way.question.robot, q[index]))
    return _judged(course.way, question, False, q[index - 1], (index - 1, index), index)


def _judged(
    way: _Way, question: Question, relaxed: bool, q: Array, between: tuple[int, int], index: int
) -> tuple[JumpCause, str]:
    """What stops the motion from q ``(n,)`` at one waypoint to the question of another.

    The nearest configuration there, with the limits ignored, tells three cases. It can be had and is beyond a
    stop; or it is about as far as the tool has to go, so the waypoints are too far apart; or it is much farther.
    Then the motion is followed along the straight way between the poses, to see what becomes of it.
    """
    free = _unlimited(question)
    there, within = (_nearest(way, asked, relaxed, q) for asked in (free, question))
    violations = violations_of(question, there) if there is not None else ()
    least = _farthest(way, q, there)
    if violations and (
        least <= way.max_step * abs(between[1] - between[0]) or _farthest(way, q, within) > _DETOUR * least
    ):
        return _stopped(way, violations, between, index)
    shift, turn = _tool_motion(question, q)
    if least > _AMPLIFIED * max(shift / question.robot.reach, turn):
        broken = _broken(way, free, relaxed, q, between, index)
        if broken is not None:
            return broken
    place = _place(between, index)
    turns = f" and turns by {explain.degrees(turn)}" if question.code != POSITION else ""
    return "spacing", (
        f"{place} {'they' if place == 'there' else 'the waypoints'} are too far apart for steps of "
        f"{explain.degrees(way.max_step)}: the tool moves by {explain.millimetres(shift)}{turns}"
    )


def _farthest(way: _Way, a: Array, b: Array | None) -> float:
    return math.inf if b is None else float(way.moves(a, b).max())


def _tool_motion(question: Question, q: Array) -> tuple[float, float]:
    """How far the tool has to go from q ``(n,)``, in what the task asks for: metres and radians."""
    T_a, T_b = fk(question.robot, q), question.T
    turn = {POSITION: 0.0, APPROACH: vector_angle(T_a[:3, 2], T_b[:3, 2])}
    shift = float(np.linalg.norm(T_b[:3, 3] - T_a[:3, 3]))
    return shift, turn.get(question.code, rotation_angle(T_a[:3, :3], T_b[:3, :3]))


def _stopped(
    way: _Way, violations: Sequence[LimitViolation], between: tuple[int, int], index: int
) -> tuple[JumpCause, str]:
    """The motion goes on, but a joint does not."""
    first = max(violations, key=lambda v: abs(v.value - v.limit))
    does = "is locked at" if way.question.locked[first.joint] else "reaches its stop at"
    stop = _amount(way, first.joint, first.limit)
    return "limits", f"{_place(between, index)} {_name(way, first.joint)} {does} {stop}"


def _broken(
    way: _Way, question: Question, relaxed: bool, q: Array, between: tuple[int, int], index: int
) -> tuple[JumpCause, str] | None:
    """What becomes of the motion on the straight way to the question's pose, the limits ignored; None: nothing."""
    robot, place = question.robot, _place(between, index)
    if robot.n < 6 and question.code == POSE:
        # Few joints cannot take the poses between two of theirs: their point, and direction, can be followed.
        question = replace(question, code=APPROACH if robot.n == 5 else POSITION)
    T_start, here, worst = fk(robot, q), q, _singular(robot, q)
    for part in np.linspace(0.0, 1.0, _SUBSTEPS + 1)[1:].tolist():
        step = replace(question, T=_interpolated(T_start, question.T, part))
        found = _nearest(way, step, relaxed, here)
        if found is None or _farthest(way, here, found) > _LEAP:
            near, meaning = _singular(robot, here)
            if _exists(step, here):
                return "singularity", f"{place} the motion meets a singularity, {meaning}"
            branch = question.branch_of(here)
            which = f" ({question.branch_name(branch)})" if branch >= 0 else ""
            return (
                "branch",
                f"{place} the branch being followed{which} ends{f', {meaning}' if near <= 1.0 else ''}",
            )
        here = found
        worst = min(worst, _singular(robot, here))
    if worst[0] > 1.0:
        return None
    return "singularity", f"{place} the motion passes close to a singularity, {worst[1]}"


def _exists(question: Question, q: Array) -> bool:
    """Whether the branch that q ``(n,)`` is on goes on to the question's pose."""
    if _has_closed_form(question):
        return bool(is_closed(_near(question, q).stats)[question.branch_of(q)])
    return len(_descended(question, q[None])) > 0


def _place(between: tuple[int, int], index: int) -> str:
    a, b = sorted(between)
    if (a, b) == (index - 1, index):
        return "there"
    backwards = "followed backwards, it" if between[0] > between[1] else "without it the motion"
    return f"{backwards} ends between waypoints {a} and {b}, where"


def _singular(robot: Robot, q: Array) -> tuple[float, str]:
    """How near q ``(n,)`` is to a singularity, 1.0 being near, and to which one."""
    out = [(math.inf, "")]
    for found in singularities(robot, q):
        if found.kind != "algorithmic":
            scale = _NEAR_SINGULAR[found.unit] * (robot.reach if found.unit == "m" else 1.0)
            out.append((found.distance / scale, found.meaning.partition(": ")[0]))
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


def _unlimited(question: Question) -> Question:
    """The same with the stops out of the way of any motion between two waypoints."""
    lower, upper = question.lower - _AWAY, question.upper + _AWAY
    return replace(question, lower=lower, upper=upper, low=lower, high=upper)
