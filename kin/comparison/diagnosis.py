"""Which one or two mistakes in a table explain why it is another arm.

Every change of :mod:`kin.comparison.mistakes` is tried, and numbers are solved for: poses depend linearly on each
length, and a wrong angle turns everything after it about one line, so that a single wrong number follows from the
difference of poses. Where base, tool and zeros are free, lengths follow from the invariants instead.

Without a likely single change, pairs are tried, the likely ones first, until the time is over. Every explanation
is checked with forward kinematics before it is returned.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kin.angles import wrapped
from kin.axes import generic_q
from kin.comparison.bound import Zeros
from kin.comparison.frames import FRAME, LEAST, Mapping, Reference, Side, no_mapping
from kin.comparison.matching import Tolerance
from kin.comparison.mistakes import Edit, applied, fewer_rows, known_edits, more_rows, value_edit
from kin.comparison.results import Change, Explanation
from kin.comparison.tables import (
    ALPHA,
    THETA,
    A,
    Chain,
    D,
    Ends,
    Invariants,
    Tables,
    chain,
    invariants,
    invariants_of,
)
from kin.fk import fk
from kin.robot import KIND_CODES, Robot
from kin.transforms import Array

PER_CHANGE = 3.0  # cost of any change: fewer changes come first
LIKELY = 7.0  # a single change that costs less needs no pairs beside it
FREE_FRAMES = 0.1  # what frames and zeros cost where they are expected to differ, as a share
_BETTER = 1.5  # a change that leaves frames or zeros open must be this much plainer than none
# Of tables of one level whose invariants agree: how many are looked at, and how many of these may be the arm.
# Beside slides, invariants tell little, and most tables are given up at the first axis that does not fit.
_MOST_TRIED, _MOST_MATCHES = 240, 60
_VALUE = 2.6  # cost of a number that has no better name
_NEAR = 3  # invariants that one wrong number can change, about
_PROBES = 4
_ROUNDING = 1e-9  # of sums of costs


@dataclass(frozen=True, eq=False)
class _Level:
    """Changed tables, with the changes that led to each and their cost."""

    tables: Tables
    history: list[tuple[Edit, ...]]
    cost: Array


class Search:
    """The search for mistakes in b that make it another arm than a.

    Args:
        reference: arm a, and up to which differences axes count as one.
        fixed: whether the poses should agree as they are, so that base, tool and zeros are mistakes too.
        deadline: on `time.monotonic`; pairs are given up then.
        cancel: called between two steps.
    """

    def __init__(
        self, reference: Reference, b: Robot, fixed: bool, deadline: float, cancel: Callable[[], None]
    ) -> None:
        self._reference, self._b, self._fixed = reference, b, fixed
        a, tolerance = reference.robot, reference.tolerance
        self._a = a
        self._share = 1.0 if fixed else FREE_FRAMES  # of the cost of frames and zeros
        self._tolerance, self._deadline, self._cancel = tolerance, deadline, cancel
        self._probes, self._poses, self._kinds, self._ends, self._zeros = _facts(a)
        self._invariants = invariants_of(a)
        self._found: dict[bytes, Explanation] = {}
        self._limit = math.inf  # cost up to which an explanation that leaves frames or zeros open is worth having
        self.complete = True

    def run(self, most: int, unchanged: float) -> list[Explanation]:
        """At most so many explanations, the likeliest first.

        Args:
            unchanged: cost of the mapping without any change, infinite if there is none.
        """
        self._limit = unchanged - _BETTER
        start = _Level(Tables.of(self._b), [()], np.zeros(1))
        levels = list(self._changed_once(start))
        # Whether a change that leaves frames or zeros open can be worth having at all.
        frames = PER_CHANGE + self._share * LEAST < self._limit
        if self._fixed or frames:
            self._solve(start)
        for level in levels:
            self._judge(level, frames)
        if self._least() >= LIKELY and unchanged == math.inf:
            self._pairs([*levels, *self._uneven(start)])
        return sorted(self._found.values(), key=lambda e: (e.cost, len(e.changes)))[:most]

    def _least(self) -> float:
        return min((e.cost for e in self._found.values()), default=math.inf)

    # -- changed tables ----------------------------------------------------------------------------------------

    def _changed_once(self, start: _Level) -> Iterator[_Level]:
        """All tables with one change, by number of rows."""
        single = start.tables
        n = len(single.joint_rows)
        if n == self._a.n:
            several = known_edits(single.rows, self._a, self._fixed)
            yield _distinct(several, applied(several, single), start)
            # A fixed row that was typed twice or left out.
            if single.rows > n:
                yield from _levels([e for e in _typed_twice(single) if len(e[1].joint_rows) == n], start)
            if len(self._a.rows) > n:
                yield from _levels([e for e in more_rows(single, self._a) if len(e[1].joint_rows) == n], start)
        else:
            yield from _levels(fewer_rows(single) if n > self._a.n else more_rows(single, self._a), start)

    def _uneven(self, start: _Level) -> Iterator[_Level]:
        """Half of two changes: tables with another number of joints than a, where b has as many."""
        single = start.tables
        n = len(single.joint_rows)
        if n == self._a.n:
            for changed in (_typed_twice(single), more_rows(single, self._a)):
                yield from _levels([each for each in changed if len(each[1].joint_rows) != n], start)

    def _pairs(self, levels: list[_Level]) -> None:
        """Tables with two changes: every change of every changed table, likely ones first."""
        for level in levels:
            if len(level.tables.joint_rows) != self._a.n:
                self._second_rows(level)
                continue
            self._solve(level)
            for edit in known_edits(level.tables.rows, self._a, self._fixed):
                self._cancel()
                if time.monotonic() > self._deadline:
                    self.complete = False
                    return
                total = level.cost + edit.cost + PER_CHANGE
                index = np.flatnonzero(total < self._least())
                if not index.size:
                    break
                changed = edit.apply(level.tables.take(index))
                self._judge(
                    _Level(changed, [(*level.history[i], edit) for i in index], total[index]), not self._fixed
                )

    def _second_rows(self, level: _Level) -> None:
        """One more row left out or put in, of tables that still have another number of joints."""
        for i, history in enumerate(level.history):
            self._cancel()
            if time.monotonic() > self._deadline:
                self.complete = False
                return
            single = level.tables.take(np.array([i]))
            start = _Level(single, [history], level.cost[i : i + 1])
            if len(single.joint_rows) > self._a.n:
                changed = list(fewer_rows(single))
                if self._b.n == self._a.n:  # one row is missing, and another was typed twice
                    changed = _typed_twice(single)
            else:
                changed = list(more_rows(single, self._a))
            for changed_twice in _levels(changed, start):
                self._judge(changed_twice, frames=True)

    # -- judging -----------------------------------------------------------------------------------------------

    def _with_joints_of_a(self, tables: Tables) -> NDArray[np.intp]:
        """Which tables have as many joints as a, of the same kinds."""
        rows = tables.joint_rows
        if len(rows) != self._a.n:
            return np.empty(0, dtype=np.intp)
        return np.flatnonzero((tables.kinds[:, rows] == self._kinds).all(axis=1))

    def _judge(self, level: _Level, frames: bool) -> None:
        """Keep the tables that are a: as they are, or with other frames and zeros."""
        tables, index = level.tables, self._with_joints_of_a(level.tables)
        if not index.size:
            return
        first = chain(tables.take(index), self._probes[:1]).T[:, 0]
        equal = np.abs(first - self._poses[0]).max(axis=(1, 2)) <= 10.0 * self._tolerance.length
        for i in index[equal]:
            self._keep(level, int(i), no_mapping(self._a.n))
        rest = index[~equal]
        if not frames or not rest.size:
            return
        others = tables.take(rest)
        known = invariants(others)
        wrong = known.agree(self._invariants, 10.0 * self._tolerance.length, 10.0 * self._tolerance.angle)
        alike = np.flatnonzero(wrong == 0)
        if not alike.size:
            return
        fits, alike_tables = rest[alike], others.take(alike)
        needed = FRAME * self._frames_needed(alike_tables)
        least = level.cost[fits] + self._share * np.maximum(LEAST, needed)
        order = np.argsort(least, kind="stable")[:_MOST_TRIED]
        order = order[least[order] < min(self._least(), self._limit)]
        if order.size and self._limit < math.inf:
            order = order[:_MOST_MATCHES]
            zeros = Zeros.of(alike_tables.take(order), Invariants(*(part[alike[order]] for part in known)))
            at_least = needed[order] + self._zeros.cost(zeros, self._tolerance)
            order = order[level.cost[fits[order]] + self._share * (at_least - _ROUNDING) < self._limit]
        if not order.size:
            return
        matched = 0
        for k, side in zip(order, Side.several(alike_tables.take(order)), strict=True):
            i = int(fits[k])
            if matched >= _MOST_MATCHES or least[k] >= self._least() or time.monotonic() > self._deadline:
                break
            self._cancel()
            most = (self._limit - float(level.cost[i])) / self._share
            found = self._reference.plainest(side, most, float(needed[k]))
            matched += not isinstance(found, int)
            if isinstance(found, tuple):
                self._keep(level, i, found[0])

    def _frames_needed(self, tables: Tables) -> Array:
        """How many of base and tool every mapping of each table onto a has at least ``(N,)``.

        Without a base the first axes are one line; without a tool the last ones are, seen from the tool.
        """
        return np.asarray(sum(~same for same in self._ends.agree(Ends.of(tables), self._tolerance)))

    def _keep(self, level: _Level, i: int, mapping: Mapping) -> None:
        """Keep an explanation that forward kinematics confirms."""
        cost = float(level.cost[i])
        if not mapping.is_trivial:
            cost += mapping.cost(self._tolerance) * self._share
            if cost >= self._limit:
                return
        robot = level.tables.robot(i, self._b)
        key = np.concatenate(
            [np.round(level.tables.cells[i], 9).ravel() + 0.0, level.tables.kinds[i], [level.tables.modified[i]],
             np.round(level.tables.base[i], 9).ravel() + 0.0, np.round(level.tables.tool[i], 9).ravel() + 0.0]
        ).tobytes()  # fmt: skip
        if key in self._found and self._found[key].cost <= cost:
            return
        position, rotation = differences(self._poses, mapping.poses(robot, self._probes))
        if position.max() > 20.0 * self._tolerance.length or rotation.max() > 20.0 * self._tolerance.angle:
            return
        changes = _changes(Tables.of(self._b), level.history[i])
        self._found[key] = Explanation(changes, robot, mapping, cost, float(position.max()), float(rotation.max()))

    # -- numbers that follow from the difference ----------------------------------------------------------------

    def _solve(self, level: _Level) -> None:
        """Single numbers with which a table is a."""
        tables, index = level.tables, self._with_joints_of_a(level.tables)
        if not index.size:
            return
        if self._fixed:
            solved = list(_from_poses(chain(tables.take(index), self._probes), self._poses, self._tolerance))
        else:
            solved = list(self._from_invariants(tables.take(index)))
        if not solved:
            return
        several, history, cost = [], [], []
        for k, row, column, change in solved:
            i = int(index[k])
            value = float(tables.cells[i, row, column]) + change
            if column in (THETA, ALPHA):
                value = math.remainder(value, 2.0 * math.pi)
            edit = value_edit(row, column, value, _VALUE)
            several.append(edit.apply(tables.take(np.array([i]))))
            history.append((*level.history[i], edit))
            cost.append(float(level.cost[i]) + edit.cost + PER_CHANGE)
        self._judge(_Level(Tables.joined(several), history, np.array(cost)), frames=not self._fixed)

    def _from_invariants(self, tables: Tables) -> Iterator[tuple[int, int, int, float]]:
        """Changes of single cells after which all invariants agree: (table, row, column, change)."""
        length, angle = 10.0 * self._tolerance.length, 10.0 * self._tolerance.angle
        wanted = self._invariants
        near = np.flatnonzero(invariants(tables).agree(wanted, length, angle) <= _NEAR)
        m = tables.rows
        tried: list[tuple[int, int, int, float]] = []
        if not near.size:
            return
        # Every length of every near table, a metre longer.
        lengths = [(row, column) for row in range(m) for column in (A, D)]
        longer = tables.take(near).repeated(len(lengths))
        cells = longer.cells.copy()
        rows, columns = (np.tile(part, len(near)) for part in zip(*lengths, strict=True))
        cells[np.arange(len(cells)), rows, columns] += 1.0
        now, moved = invariants(tables.take(near)), invariants(longer.with_cells(cells))
        twists = wanted.twist[0].tolist()
        values = sorted({round(x, 12) for t in twists for x in (t, -t, math.pi - t, t - math.pi)})
        for i, k in enumerate(near.tolist()):
            for j, (row, column) in enumerate(lengths):
                tried += [
                    (k, row, column, change) for change in _linear(now, i, moved, i * len(lengths) + j, wanted)
                ]
            for row in range(m):
                tried += [(k, row, ALPHA, x - float(tables.cells[k, row, ALPHA])) for x in values]
        if not tried:
            return
        changed = tables.take(np.array([k for k, *_ in tried]))
        cells = changed.cells.copy()
        where = np.arange(len(tried))
        cells[where, [t[1] for t in tried], [t[2] for t in tried]] += [t[3] for t in tried]
        fits = invariants(changed.with_cells(cells)).agree(wanted, length, angle) == 0
        yield from (
            each for each, fit in zip(tried, fits, strict=True) if fit and abs(each[3]) > self._tolerance.length
        )


def _linear(now: Invariants, i: int, moved: Invariants, j: int, wanted: Invariants) -> Iterator[float]:
    """Changes of a length of table i that make a wrong distance or offset right.

    Args:
        moved: row j is that table after a change of one metre.
    """
    for here, there, goal in zip(now[1:], moved[1:], wanted[1:], strict=True):
        for value, after, size in zip(here[i].tolist(), there[j].tolist(), goal[0].tolist(), strict=True):
            slope = after - value
            if abs(slope) > 1e-3 and abs(abs(value) - abs(size)) > 1e-9:
                yield from ((sign * abs(size) - value) / slope for sign in (1.0, -1.0))


def _from_poses(lines: Chain, goal: Array, tolerance: Tolerance) -> Iterator[tuple[int, int, int, float]]:
    """Changes of single cells after which all poses agree: (table, row, column, change).

    A length moves the tool along the line of its row, and an angle turns it about that line.
    """
    R_t, p_t = lines.T[..., :3, :3], lines.T[..., :3, 3]
    R_a, p_a = goal[..., :3, :3], goal[..., :3, 3]
    R = R_a @ np.swapaxes(R_t, -1, -2)  # (N, Q, 3, 3): what is left to turn
    unturned = (np.abs(R - np.eye(3)).max(axis=(1, 2, 3)) <= 10.0 * tolerance.angle)[:, None]
    left = (p_a - p_t)[:, :, None]  # (N, Q, 1, 3)
    axis = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1
    )
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    for direction, point, length, angle in (
        (lines.z, lines.z_point, D, THETA),
        (lines.x, lines.x_point, A, ALPHA),
    ):
        along = (direction * left).sum(axis=-1)  # (N, Q, m)
        change = along.mean(axis=1)
        missed = np.abs(left - change[:, None, :, None] * direction).max(axis=(1, 3))
        for k, row in np.argwhere(
            (missed <= 10.0 * tolerance.length) & unturned & (np.abs(change) > tolerance.length)
        ):
            yield int(k), int(row), length, float(change[k, row])
        turn = np.arctan2((direction * axis[:, :, None]).sum(axis=-1), cosine[:, :, None])  # (N, Q, m)
        turned = turn[:, 0]
        # The line stays where it is, and the turn is the same at all configurations.
        same = np.abs(wrapped(turn - turned[:, None])).max(axis=1)
        moved = np.einsum("nqij,nqmj->nqmi", R, direction) - direction
        shifted = np.einsum("nqij,nqmj->nqmi", R, point - p_t[:, :, None]) + p_a[:, None] - point
        off = np.maximum(np.abs(moved).max(axis=(1, 3)), np.abs(shifted).max(axis=(1, 3)))
        fits = (
            (same <= 10.0 * tolerance.angle)
            & (off <= 10.0 * tolerance.length)
            & (np.abs(turned) > tolerance.angle)
        )
        for k, row in np.argwhere(fits):
            yield int(k), int(row), angle, float(turned[k, row])


def _typed_twice(tables: Tables) -> list[tuple[Edit, Tables]]:
    """A single table without one of two equal rows."""
    return [each for each in fewer_rows(tables) if each[0].mistake == "typed twice"]


def _levels(changed: Iterable[tuple[Edit, Tables]], start: _Level) -> Iterator[_Level]:
    """Changed tables, each once, under the cheapest name; those with fixed rows elsewhere apart."""
    alike: dict[bytes, list[tuple[Edit, Tables]]] = {}
    for each in changed:
        alike.setdefault((each[1].kinds[0] == KIND_CODES["fixed"]).tobytes(), []).append(each)
    for several in alike.values():
        several.sort(key=lambda each: each[0].cost)
        yield _distinct([edit for edit, _ in several], Tables.joined([table for _, table in several]), start)


def _distinct(changes: Sequence[Edit], tables: Tables, start: _Level) -> _Level:
    """The tables with each of some changes, the cheapest first, each table once."""
    (before,), base_cost = start.history, float(start.cost[0])
    seen = set(_keys(start.tables))
    index = []
    for i, key in enumerate(_keys(tables)):
        if key not in seen:
            seen.add(key)
            index.append(i)
    edits = [changes[i] for i in index]
    cost = np.array([base_cost + edit.cost + PER_CHANGE for edit in edits])
    return _Level(tables.take(np.array(index, dtype=np.intp)), [(*before, edit) for edit in edits], cost)


def _keys(tables: Tables) -> list[bytes]:
    """What tells each table from others."""
    N = len(tables)
    parts = [np.round(tables.cells, 10) + 0.0, tables.kinds, tables.modified, tables.base, tables.tool]
    together = np.concatenate([np.reshape(part, (N, -1)) for part in parts], axis=1)
    return [row.tobytes() for row in together]


def _changes(table: Tables, history: tuple[Edit, ...]) -> tuple[Change, ...]:
    """The changes with the numbers of single cells before and after."""
    found = []
    for edit in history:
        after = edit.apply(table)
        was = now = None
        if len(edit.rows) == 1 and len(edit.columns) == 1 and after.rows == table.rows:
            column = ("theta", "d", "a", "alpha").index(edit.columns[0])
            was, now = (float(t.cells[0, edit.rows[0], column]) for t in (table, after))
        found.append(Change(edit.mistake, edit.rows, edit.columns, was, now))
        table = after
    return tuple(found)


def _probes(a: Robot) -> Array:
    """A few configurations in general position ``(Q, n)``, not too far from zero where a joint has no limits."""
    q = generic_q(a)
    spread = np.where(a.revolute, 0.7, 0.07)
    shifts = np.random.default_rng(5).uniform(-1.0, 1.0, (_PROBES - 1, a.n)) * spread
    return np.concatenate([q[None], q + shifts])


@lru_cache(maxsize=32)
def _facts(a: Robot) -> tuple[Array, Array, Array, Ends, Zeros]:
    """What every search with an arm as reference asks: probes, poses there, kinds of joints, outer axes, zeros."""
    table, probes = Tables.of(a), _probes(a)
    return (
        probes,
        fk(a, probes),
        table.kinds[0, table.joint_rows],
        Ends.of(table),
        Zeros.of(table, invariants_of(a)),
    )


def differences(one: Array, other: Array) -> tuple[Array, Array]:
    """Distances (m) and angles (rad) ``(Q,)`` between poses ``(Q, 4, 4)``."""
    position = np.linalg.norm(one[:, :3, 3] - other[:, :3, 3], axis=-1)
    # ‖R − S‖ = √8 sin(θ/2): exact near zero, where acos of the trace loses half of the digits.
    chord = np.linalg.norm(one[:, :3, :3] - other[:, :3, :3], axis=(1, 2))
    return position, 2.0 * np.arctan2(chord, np.sqrt(np.maximum(8.0 - chord**2, 0.0)))
