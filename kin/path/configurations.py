"""Configurations that meet one waypoint: near a given configuration, from descents, at every whole turn.

Every configuration of a path comes from here and has been measured by forward kinematics: a row of the closed form
where there is one, the end of a descent where there is none.
"""

from __future__ import annotations

import numpy as np

from kin.angles import TURN
from kin.fk import jacobian
from kin.ik import nearest
from kin.ik.avoidance import is_free
from kin.ik.branches import Branches, Flags, is_closed, measure, solve_branches
from kin.ik.candidates import OVERRUN, POSITION_ERROR, ROLL, ROTATION_ERROR, select
from kin.ik.problem import IKProblem
from kin.path.waypoints import WIDE, LayerSequence, PathSettings, has_closed_form
from kin.tolerances import TOLERANCES
from kin.transforms import Array

POOL = 24  # starts of descents, and the most of their ends that are kept
_ASIDE = (0.1, -0.1, 0.25, -0.25, 0.5, -0.5)  # rad or m, along the slowest motion
_FOLLOWED = 4  # descents that end beside a target are continued along the weakly controllable directions
_WAYS = 4  # motions that are followed from one configuration
LARGE = 0.125  # a larger motion between neighbouring waypoints makes a search for a nearer solution worthwhile


def branches_near(problem: IKProblem, seed: Array, values: tuple[float, ...] | None = None) -> Branches:
    """The branches nearest to a seed ``(n,)``, of a problem that a closed form covers."""
    problem.cancel()
    found = solve_branches(problem, problem.T, problem.code, seed, values)
    assert found is not None
    return found


def meeting(problem: IKProblem, relaxed: bool, q: Array, near: Array) -> Array:
    """The rows of whole sets of branches ``(sets · b, n)`` that meet the task inside the limits.

    They come at the whole turns nearest to `near`; of rows that give up the roll (`relaxed`) only those with about
    the smallest roll error.
    """
    if problem.branches is not None:
        assert problem.closed_form is not None
        count = len(problem.closed_form.branches)
        q = q[[problem.allows(i % count) for i in range(len(q))]]
    q, stats = measure(problem, q[~np.isnan(q[:, 0])], near)
    good = _meets(problem, stats)
    miss = stats[:, POSITION_ERROR] / problem.unit + stats[:, ROTATION_ERROR] + stats[:, OVERRUN]
    close = np.flatnonzero(~good & (miss < TOLERANCES.near_miss))[:8]
    if len(close):
        missed, figures = q[close], stats[close]
        good[close] = nearest.polish(problem.near(near), missed, figures)
        q[close], stats[close] = missed, figures
    if relaxed and good.any():
        roll = np.abs(stats[:, ROLL])
        good &= alike(roll, float(roll[good].min()))
    return _free(problem, np.asarray(q[good]))


def _free(problem: IKProblem, q: Array) -> Array:
    """The configurations ``(m, n)`` that touch nothing that is to be avoided."""
    return q[is_free(problem, q)] if problem.options.avoids and len(q) else q


def _meets(problem: IKProblem, stats: Array) -> Flags:
    return np.asarray(is_closed(problem, stats) & (stats[:, OVERRUN] == 0.0))


def alike(miss: Array, least: float) -> Flags:
    """Which errors are nearly as small as the smallest one: the difference is not worth a jump."""
    return np.asarray(miss <= 1.05 * least + 1e-3)


def descended(problem: IKProblem, starts: Array) -> Array:
    """Where descents from the starts ``(k, n)`` end, if they meet the problem ``(m, n)``: each once."""
    problem.cancel()
    if not len(starts):
        return starts
    q, errors = nearest.descend_each(problem, problem.code, starts, 1.0)
    for i in np.flatnonzero((errors > TOLERANCES.better_minimum) & (errors < TOLERANCES.near_miss))[:_FOLLOWED]:
        q[i] = nearest.at_floor(problem, q[i], 1.0)[0]
    q, stats = measure(problem.without_turns(), q)
    q = q[_meets(problem, stats)]
    if problem.branches is not None:
        q = q[[problem.allows(problem.branch_of(row)) for row in q]]
    q = _free(problem, q)
    return distinct(problem, q, problem.seed)[:POOL]


def pool(problem: IKProblem) -> Array:
    """Configurations ``(m, n)`` that meet the problem, from descents that start all over the limits."""
    return descended(problem, nearest.starting_points(problem, count=POOL))


def distinct(problem: IKProblem, q: Array, near: Array) -> Array:
    """The rows ``(m, n)``, each once, nearest to `near` first."""
    key = np.linalg.norm(problem.requirement.weights * (q - near), axis=1)
    kept, count = select(np.ascontiguousarray(q), key)
    return np.asarray(q[kept[:count]])


def with_images(problem: IKProblem, q: Array) -> Array:
    """Every row ``(m, n)`` at all its whole-turn images inside the limits; joints on a circle as they are."""
    for i in np.flatnonzero(problem.turns > 0.0).tolist():
        low, high = problem.lower[i], problem.upper[i]
        if not TURN - 1e-8 <= high - low <= WIDE:
            continue
        first = np.ceil((low - TOLERANCES.limit - q[:, i]) / TURN)
        count = (np.floor((high + TOLERANCES.limit - q[:, i]) / TURN) - first + 1.0).astype(np.int64)
        rows = np.repeat(np.arange(len(q)), count)
        turn = first[rows] + np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
        q = q[rows]
        q[:, i] = np.clip(q[:, i] + TURN * turn, low, high)
    return np.ascontiguousarray(q)


def nearest_solution(settings: PathSettings, problem: IKProblem, relaxed: bool, q: Array) -> Array | None:
    """The configuration nearest to q ``(n,)`` that meets the problem."""
    found = near_solutions(settings, problem, relaxed, q)
    return np.asarray(found[0]) if len(found) else None


def near_solutions(
    settings: PathSettings, problem: IKProblem, relaxed: bool, q: Array, ahead: Array | None = None
) -> Array:
    """Configurations ``(k, n)`` around q ``(n,)`` that meet the problem, the nearest first.

    `ahead`: where the motion that has come to q would go on to.
    """
    found = np.empty((0, len(q)))
    if has_closed_form(problem):
        found = meeting(problem, relaxed, branches_near(problem, q).q, q)
    if _is_far(settings, found, q):
        found = np.concatenate([found, descended(problem, q[None])])
    if _is_far(settings, found, q) and not has_closed_form(problem):
        found = np.concatenate([found, descended(problem, _around(problem, q, ahead))])
    return np.asarray(found[np.argsort(settings.moves(found, q).max(axis=1), kind="stable")])


def _is_far(settings: PathSettings, found: Array, q: Array) -> bool:
    """Whether a search for configurations nearer to q ``(n,)`` is worthwhile."""
    return not len(found) or bool(settings.moves(found, q).max(axis=1).min() > LARGE)


def _around(problem: IKProblem, q: Array, ahead: Array | None) -> Array:
    """Starts of descents ``(k, n)`` close to q ``(n,)``, inside the limits.

    Near a singularity, branches are close to each other along the motion that hardly moves the tool, and a descent
    from q alone may end on another branch than the one that a motion would follow.
    """
    slow = np.linalg.svd(jacobian(problem.robot, q))[2][-1 if len(q) <= 6 else 5 - len(q) :]
    starts = [q + share * direction for direction in slow for share in _ASIDE]
    if ahead is not None:
        starts.append(ahead)
    return np.asarray(np.clip(starts, problem.low, problem.high))


def continued(
    sequence: LayerSequence, s: int, q: Array, direction: int, allowed: float
) -> list[tuple[int, Array]]:
    """The motion from q at waypoint s of the sequence on to the nearest solution, again and again, until it jumps.

    Where other solutions are as good as near, they are followed too. Pairs of a waypoint of the sequence and a
    configuration there; `direction` is 1 or −1.
    """
    settings = sequence.settings
    out: list[tuple[int, Array]] = []
    ways: list[tuple[int, Array, Array | None]] = [(s, q, None)]
    for _ in range(_WAYS):
        if not ways:
            break
        s, q, ahead = ways.pop()
        while 0 <= s + direction < len(sequence.waypoints):
            most = allowed * sequence.spans[max(s, s + direction)]
            s += direction
            waypoint = sequence.waypoints[s]
            found = near_solutions(settings, waypoint.problem, waypoint.relaxed, q, ahead)
            moves = settings.moves(found, q).max(axis=1)
            found = distinct(waypoint.problem, found[moves <= most], q)
            if not len(found):
                break
            out += [(s, other) for other in found]
            ways += [(s, other, 2.0 * other - q) for other in found[1:]]
            ahead, q = 2.0 * found[0] - q, found[0]
    return out
