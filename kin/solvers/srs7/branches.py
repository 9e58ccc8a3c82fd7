"""The kernel that finds all branches of one target: joint limits, feasible intervals of ψ, singular poses."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import excess, nearest_image, wrap
from kin.kernels.compile import jit
from kin.solvers.blocks import each_solved
from kin.solvers.canonical import OFFSET, UPPER_ARM, canonical_box, canonical_pose
from kin.solvers.common import HIGH, LOW, NEAR, UNBOUNDED, clear, copy_row
from kin.solvers.srs7.geometry import FITS, SHAPE, STAY, affine, angles_at, seed_arm_angle, sign_of, triangle_of
from kin.solvers.srs7.minima import LANE_ROWS, LANES, best_of
from kin.solvers.srs7.nearest import FARTHER, Work, add_best, add_others, refine
from kin.solvers.srs7.redundancy import COLUMNS, GRID, ROWS, intervals, lay_out, weigh
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_LIMIT = TOLERANCES.limit
# (the requested ψ, NaN for the feasible one at which the joints move least from the seed; whether ψ is chosen so
# that the joint limits hold where that is possible; whether joint 7 is a redundancy parameter as well, which keeps
# its seed value; whether branches are left out that cannot be the nearest to the seed inside the limits).
Options = tuple[float, bool, bool, bool]


@jit
def _box(arm: Array, seed: Array, lower: Array, upper: Array, free_roll: bool) -> Array:
    """Seed and joint limits ``(7,)`` as a box ``(4, 7)`` of canonical angles."""
    box = np.empty((4, 7))
    canonical_box(arm[OFFSET:UPPER_ARM], seed, lower, upper, box)
    for i in range(7):
        box[STAY, i] = box[NEAR, i]
    if free_roll:
        box[LOW, 6], box[HIGH, 6] = -UNBOUNDED, UNBOUNDED
        box[STAY, 6] += 2.0 * math.pi  # limits that span a turn add no arm angle
    return box


@jit
def _elbow_step(theta4: float, box: Array) -> float:
    """The squared step of joint 4 from the seed to a canonical angle."""
    return float((nearest_image(theta4, box[NEAR, 3], box[LOW, 3], box[HIGH, 3]) - box[NEAR, 3]) ** 2)


@jit
def _least_inside(box: Array, elbow: int, out: Array) -> float:
    """The least squared step from the seed to a branch with this elbow inside the limits, canonical; or infinity.

    A little more: a branch that moves as far is not to be left out for rounding.
    """
    least = math.inf
    for other in range(4):
        row = out[4 * (other >> 1) + 2 * elbow + (other & 1)]
        total = 0.0
        for i in range(7):
            y = nearest_image(row[i], box[NEAR, i], box[LOW, i], box[HIGH, i])
            # Half of the slack: limits are judged of joint values, which rounding has changed.
            inside = box[LOW, i] - 0.5 * _LIMIT <= y <= box[HIGH, i] + 0.5 * _LIMIT
            total += (y - box[NEAR, i]) ** 2 if inside else math.inf
        least = min(least, total)
    return least + 1e-9 * (1.0 + least)


@jit
def _elbow(
    parts: Array, theta4: float, box: Array, request: tuple[float, float, bool, int], work: Work, arcs: Array,
    found: int, best: float, out: Array,
) -> tuple[int, float]:  # fmt: skip
    """out ``(8, 8)`` ← the four branches with one θ4, canonical: (number of intervals, least squared step).

    parts: as from `affine`. request: the arm angle that is preferred, the one that is requested or NaN, whether
    the limits count, and how many joints are to move little. best: the least squared step of other branches.
    """
    preferred, value, respect_limits, joints = request
    W, L, _ = work
    free, lanes, spans, least = math.isnan(value), 0, np.empty((4, 2), dtype=np.int64), np.empty(4)
    tested = np.empty(4)
    elbow = 1 if theta4 < 0.0 else 0
    limits, filled = lay_out(parts, box, respect_limits, preferred if free else math.nan, W)
    # Shoulder and wrist are independent: each is weighed once per arm angle and sign.
    singular = weigh(parts, 0, 3, filled, box, W) + weigh(parts, 1, joints - 4, filled, box, W)
    misfit = excess(theta4, box[LOW, 3], box[HIGH, 3])
    step, grid = _elbow_step(theta4, box), filled - GRID
    for k in range(4):
        branch = 4 * (k >> 1) + 2 * elbow + (k & 1)
        spans[k, 0], row = found, out[branch]
        psi, found = intervals(branch, misfit, limits, preferred, W, arcs, found)
        spans[k, 1], row[7], least[k] = found, psi if free else value, math.inf
        if free and (found > spans[k, 0] or not respect_limits):
            least[k], tested[k], lanes = add_best(branch, grid, (spans[k, 0], found), psi, W, arcs, lanes, L)
            best = min(best, least[k] + step)
    for k in range(4):
        # The nearest of all branches is looked for everywhere, others from where they are nearest already.
        if least[k] + step - FARTHER < best:
            branch, span = 4 * (k >> 1) + 2 * elbow + (k & 1), (spans[k, 0], spans[k, 1])
            lanes = add_others(
                (parts, box, joints - 4), branch, (limits, grid), span, best - step, work, arcs, lanes
            )
    if lanes > 0:
        lanes = refine(parts, box, joints - 4, lanes, L)
    refined, nearest = math.inf, 0
    for k in range(4):
        branch = 4 * (k >> 1) + 2 * elbow + (k & 1)
        out[branch, 7], reached = best_of(branch, out[branch, 7], lanes, L)
        refined, nearest = min(refined, reached), k if least[k] < least[nearest] else nearest
    # At one arm angle alone two joints may turn about one line, which is no minimum of a smooth function. Two
    # branches are one there, so only the nearest one goes to it.
    if singular > 0 and least[nearest] < refined - _LIMIT:
        out[4 * (nearest >> 1) + 2 * elbow + (nearest & 1), 7] = tested[nearest]
    for k in range(4):
        branch = 4 * (k >> 1) + 2 * elbow + (k & 1)
        angles_at(parts, theta4, branch, out[branch, 7], box, out[branch])
    return found, min(best, refined + step)


@jit
def solve(
    arm: Array, T: Array, options: Options, seed: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[int, float, int]:
    """All branches of a target T ``(4, 4)``: (code of `triangle_of`, gap in metres, number of intervals).

    out ``(8, 8)`` ← seven joint values and ψ of each branch, NaN where there is none; two that have merged are
    both there. arcs ``(n, 3)`` ← the feasible intervals of ψ, rows (branch, low, high). seed, lower, upper
    ``(7,)``: joint values.
    """
    value, respect_limits, free_roll, nearest_only = options
    clear(out)
    M, triangle = np.empty((4, 4)), np.empty((4, 3))
    work = np.empty((ROWS, COLUMNS)), np.empty((LANE_ROWS, LANES)), np.empty((LANE_ROWS, GRID))
    box = _box(arm, seed, lower, upper, free_roll)
    canonical_pose(arm, T, M)
    code, gap = triangle_of(arm, M, triangle)
    if code != FITS:
        return code, gap, 0
    preferred = seed_arm_angle(arm, box[NEAR], triangle) if math.isnan(value) else value
    request = preferred, value, respect_limits, 6 if free_roll else 7
    bend = triangle[SHAPE, 2]
    first = 1 if nearest_only and bend > 0.0 and _elbow_step(-bend, box) < _elbow_step(bend, box) else 0
    parts, sign = np.empty((2, 3, 3, 3)), sign_of(first, 0)
    affine(arm, M, triangle, sign, parts)
    found, best = _elbow(parts, sign * bend, box, request, work, arcs, 0, math.inf, out)
    if bend > 0.0 and not (nearest_only and _elbow_step(-sign * bend, box) > _least_inside(box, first, out)):
        affine(arm, M, triangle, -sign, parts)
        found, _ = _elbow(parts, -sign * bend, box, request, work, arcs, found, best, out)
    for branch in range(8):
        for i in range(7):
            out[branch, i] = wrap(out[branch, i] - arm[OFFSET + i])
        if free_roll and not math.isnan(out[branch, 7]):
            out[branch, 6] = min(max(seed[6], lower[6]), upper[6])
        out[branch, 7] = wrap(out[branch, 7])
    if bend == 0.0:
        for branch in (0, 1, 4, 5):
            copy_row(out, branch, branch + 2)
    return FITS, 0.0, found


solve_many = each_solved(solve, (math.nan, True, False, True), 256, more=1)
