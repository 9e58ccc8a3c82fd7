"""Postures of a table as entered: rows of the nominal arm, moved onto the target on the table as it is."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.solvers.selfmotion.points import (
    FRAME,
    JOINT,
    MOST,
    SETTING,
    WANTED,
    Point,
    Task,
    correct,
    is_inside,
    linearize,
    new_point,
    redundancy_value,
    set_frame,
    task_of,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_INSET = TOLERANCES.interval_inset
LOW_END, HIGH_END, INSIDE = range(3)  # postures of an interval
_STRIDES, _SHORTEST = 40, 1e-3  # steps along the curve, and the least share of the way that one is tried with


@jit
def _away(a: Array, b: Array) -> float:
    """The largest difference of two postures ``(7,)``."""
    most = 0.0
    for i in range(7):
        most = max(most, abs(a[i] - b[i]))
    return most


@jit
def move_row(task: Task, value: float, most: float, y: Array, p: Point) -> bool:
    """Move y ``(7,)``, in place, onto the target at a value of the redundancy parameter; whether it is there.

    most: rad; a row that has to move farther does not belong to the posture.
    """
    start = y.copy()
    return correct(task, value, 0.0, y, p) and _away(y, start) < most


@jit
def _reach(task: Task, value: float, sense: float, y: Array, p: Point) -> bool:
    """As `correct`, in shorter steps along the curve where one is too long for Newton's method.

    Beside a fold postures move by the root of what the parameter does, beside a singular wrist joints turn fast.
    """
    last, share = y.copy(), 1.0
    for _ in range(_STRIDES):
        goal = value
        if share < 1.0:
            at = redundancy_value(task, y)
            goal = at + share * wrap(value - at)
        if correct(task, goal, sense, y, p):
            if share == 1.0:
                return True
            last[:], share = y, 1.0
        elif share < _SHORTEST:
            return False
        else:
            y[:], share = last, 0.5 * share
    return False


@jit
def _chosen(arcs: Array, k: int, wanted: float, circular: bool, tried: Array) -> tuple[int, float]:
    """(interval, value) of branch k nearest to the wanted value: that, or slightly inside an end; −1 if none.

    tried: ``(m,)`` 1.0 for intervals that do not count.
    """
    best, value, least = -1, math.nan, math.inf
    for i in range(arcs.shape[0]):
        if arcs[i, 0] != k or tried[i] > 0.0:
            continue
        low, high = arcs[i, 1], arcs[i, 2]
        inset = min(_INSET, 0.5 * (high - low))
        middle = 0.5 * (low + high)
        near = middle + wrap(wanted - middle) if circular else wanted
        inside = near if low <= near <= high and not circular else min(max(near, low + inset), high - inset)
        if abs(inside - near) < least:
            best, value, least = i, inside, abs(inside - near)
    return best, value


@jit
def _row_in(
    task: Task, limits: tuple[Array, Array], value: float, row: Array, places: Array, y: Array, p: Point
) -> bool:
    """y ``(7,)`` ← the posture at a value inside an interval with the postures `places` ``(3, 7)``."""
    lower, upper = limits
    if not linearize(task, places[INSIDE], p) < 1.0:
        return False
    sense = p.n[task.joint] if task.joint >= 0 else 0.0
    off = np.empty(4)
    for i in range(4):
        start = row if i == 3 else places[i]
        off[i] = abs(wrap(redundancy_value(task, start) - value)) if not math.isnan(start[0]) else math.inf
    off[3] *= 0.5  # of two that are as close, the row
    for _ in range(4):
        i = 0
        for k in range(1, 4):
            if off[k] < off[i]:
                i = k
        if not off[i] < math.inf:
            return False
        off[i] = math.inf
        start = row if i == 3 else places[i]
        for c in range(7):
            y[c] = start[c]
        if task.joint >= 0:  # an interval is known at one whole turn, its postures may be at another
            y[task.joint] = value - wrap(value - y[task.joint])
        if _reach(task, value, sense, y, p) and is_inside(lower, upper, y, task.joint):
            return True
    return False


@jit
def choose_rows(
    model: Array, T: Array, setting: Array, limits: Array, arcs: Array, places: Array, rows: Array
) -> int:
    """rows ``(8, 8)`` ← each branch of the table as entered and its value, from those of the nominal arm.

    Where a branch has intervals, its row is at their value nearest to the wanted one, or to its own if none is
    wanted; else it keeps its value. Returns bits: which branches are not where they should be.

    Args:
        model, T, setting: as for `task_of`.
        limits: ``(≥ 2, 7)`` lower, upper.
        arcs, places: intervals ``(m, 3)`` and their postures ``(m, 3, 7)``.
    """
    task, wanted, most, box = task_of(model, T, setting), setting[WANTED], setting[MOST], (limits[0], limits[1])
    p, y, missed, tried = new_point(), np.empty(7), 0, np.empty(arcs.shape[0])
    for k in range(rows.shape[0]):
        row, value = rows[k, :7], rows[k, 7]
        there = not math.isnan(row[0])
        aim = wanted if math.isnan(value) else value
        aim = 0.0 if math.isnan(aim) else aim
        tried[:] = 0.0
        i, chosen = _chosen(arcs, k, aim, task.joint < 0, tried)
        if i >= 0:
            met = False
            # The middle of one interval may have crossed to another branch: then the next one counts.
            while i >= 0 and not met:
                met, value = _row_in(task, box, chosen, row, places[i], y, p), chosen
                tried[i] = 1.0
                if not met:
                    i, chosen = _chosen(arcs, k, aim, task.joint < 0, tried)
        elif there:
            for c in range(7):
                y[c] = row[c]
            met = move_row(task, value, most, y, p)
        else:
            continue
        missed += 0 if met else 1 << k
        for c in range(7):
            rows[k, c] = y[c] if met else math.nan
        rows[k, 7] = (wrap(value) if task.joint < 0 else value) if met else math.nan
    return missed


@jit
def rows_at(task: Task, value: float, most: float, rows: Array) -> None:
    """rows ``(k, 7)`` ← moved onto the target at a value of the redundancy parameter, NaN for that of each row.

    Those that do not get there are NaN.
    """
    p = new_point()
    for k in range(rows.shape[0]):
        if math.isnan(rows[k, 0]):
            continue
        at = redundancy_value(task, rows[k]) if math.isnan(value) else value
        if not move_row(task, at, most, rows[k], p):
            for c in range(7):
                rows[k, c] = math.nan


@jit
def move_rows(model: Array, params: Array, T: Array, setting: Array, values: Array, out: Array) -> None:
    """out ``(N, k, 7)`` ← rows of the nominal arm at each of the targets T ``(N, 4, 4)``, moved onto these.

    Args:
        model, setting: as for `task_of`.
        params: those of an S-R-S family, for its arm angle; not read if the parameter is the value of a joint.
        values: of the redundancy parameter ``(N,)`` or ``(1,)``, NaN for that of each row.
    """
    own, joint = setting.copy(), int(setting[JOINT])
    for i in range(T.shape[0]):
        if joint < 0:
            set_frame(params, T[i], own[FRAME:SETTING])
        rows_at(task_of(model, T[i], own), values[min(i, values.shape[0] - 1)], setting[MOST], out[i])
        for k in range(out.shape[1]):
            for c in range(7):
                out[i, k, c] = out[i, k, c] if c == joint else wrap(out[i, k, c])
