"""Postures along a path: at each place and in each posture what is in the way, and how far the arm can go on.

`solve_path` finds one joint path. This is the whole picture it is chosen from: a table of places and postures. A
cell is *free*, *near a limit*, *near a singularity*, *outside* the limits, *touching* something, or there is
*none*: the arm cannot meet the pose in this posture. It answers why a path flips or stops, and from which posture
it would not.

The configurations are those of the layers (:mod:`kin.path.layers`), with all whole turns and samples of redundancy
parameters. Two at neighbouring places are joined if no joint moves more than `max_step` between them. Followed
backwards from the end of the path, these joints tell from each configuration how far the arm can go on without a
jump. Where layers are samples, that is the farthest *found*.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from kin.angles import TURN
from kin.collision.contacts import Contact
from kin.ik.avoidance import around
from kin.ik.branches import violations_of
from kin.ik.details import LimitViolation
from kin.ik.messages.singularity import short
from kin.ik.messages.values import listed, need
from kin.kernels.compile import jit
from kin.path.configurations import branches_near
from kin.path.results import PathResult
from kin.path.viterbi import first_from
from kin.path.waypoints import PathSettings, Waypoint, has_closed_form
from kin.robot import Robot
from kin.singularity import singularities_at
from kin.solvers.singular import Singularity
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

State = Literal["free", "near limit", "near singularity", "outside", "touches", "none"]
STATES: tuple[State, ...] = get_args(State)
NEAR_LIMIT = math.radians(5.0)  # or so many metres: a joint that is closer to its limit is near it
NEAR_SINGULARITY = 0.1  # radians or metres
_DRIVEN = 3  # so many states can be driven; the others are in the way
_DIGITS = 7  # of joint values that are the same but for whole turns
_UNNAMED = 12  # rows of an arm whose postures have no names
_Whole = NDArray[np.int64]


class Reason(NamedTuple):
    """Why a cell is not free; one of these is given.

    Attributes:
        violations: the joint values outside the limits; near a limit, the joint that is closest to its own.
        singularity: the one that is nearest.
        contact: what touches.
    """

    violations: tuple[LimitViolation, ...] = ()
    singularity: Singularity | None = None
    contact: Contact | None = None

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The reason in a clause."""
        if self.contact is not None:
            return self.contact.text
        if self.singularity is not None:
            return short(self.singularity, units)
        return listed([need(each, units) for each in self.violations]) if self.violations else ""


class Stretch(NamedTuple):
    """Neighbouring places of one posture with the same state.

    Attributes:
        posture, first, last: which row, and from which place to which.
        state: of all of them.
        joined: whether the arm can go on in this posture from the last place to the next one.
        reason: the clause of the place in the middle; "" if free.
    """

    posture: int
    first: int
    last: int
    state: State
    joined: bool
    reason: str


@dataclass(frozen=True, eq=False, repr=False)
class PathPostures:
    """What `path_postures` finds; k places, p postures.

    Attributes:
        robot: the arm.
        postures: their names; numbers where the arm's branches have none.
        states: ``(k, p)``, as indices into `STATES`.
        q: ``(k, p, n)`` a configuration of each cell: where one can be driven, that from which the arm can go on
            farthest, and of those the one farthest from the limits. NaN where there is none.
        reach: ``(k, p)`` the last place to which the arm can go on from there without a jump; −1 where it cannot
            be.
        joined: ``(k - 1, p, p)`` whether a configuration of one posture leads to one of another, or of the same,
            at the next place.
        reasons: by place and posture, for all cells that are not free.
        best: the path of `solve_path`.
        rows: ``(k,)`` the posture of `best` at each place; −1 in a gap.
    """

    robot: Robot
    postures: tuple[str, ...]
    states: _Whole
    q: Array
    reach: _Whole
    joined: NDArray[np.bool_]
    reasons: dict[tuple[int, int], Reason]
    best: PathResult
    rows: _Whole

    def __repr__(self) -> str:
        """The sentence about it."""
        return f"PathPostures({self.reason!r})"

    @property
    def through(self) -> tuple[int, ...]:
        """The postures at the first place from which the arm gets through the whole path without a jump."""
        return tuple(np.flatnonzero(self.reach[0] == len(self.reach) - 1).tolist())

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """All cells, posture by posture."""
        found = []
        for row in range(len(self.postures)):
            for state, group in groupby(enumerate(self.states[:, row].tolist()), key=itemgetter(1)):
                places = [place for place, _ in group]
                middle, last = places[len(places) // 2], places[-1]
                joined = last < len(self.joined) and bool(self.joined[last, row, row])
                reason = self.reasons.get((middle, row), Reason()).explain()
                found.append(Stretch(row, places[0], last, STATES[state], joined, reason))
        return tuple(found)

    @property
    def reason(self) -> str:
        """From which postures the arm gets through, in a sentence."""
        names = [self.postures[row] for row in self.through]
        if names:
            which = f"posture{'s' * (len(names) != 1)}"
            return f"The whole path can be driven from {len(names)} {which} at its start: {listed(names)}."
        farthest = int(self.reach[0].max(initial=-1))
        if farthest < 0:
            return "The arm cannot be at the first place of the path in any posture."
        row = int(np.argmax(self.reach[0]))
        share = 100.0 * farthest / max(len(self.reach) - 1, 1)
        best = self.postures[row]
        return f"No posture leads through the whole path: {best} leads farthest, to {share:.0f} % of it."


def postures_along(settings: PathSettings, waypoints: list[Waypoint], best: PathResult) -> PathPostures:
    """The postures at the waypoints of a path; `best`: the path that was chosen from them."""
    problem = settings.problem
    layers = [waypoint.layer for waypoint in waypoints]
    names, labels = _labelled(settings, layers)
    reach, joined = _followed_back(settings, layers, labels, len(names))
    table = _Table.of(problem.robot, len(layers), len(names))
    for i, waypoint in enumerate(waypoints):
        problem.cancel()
        table.fill(i, waypoint, labels[i], reach[i])
        if problem.closed_form is not None and problem.closed_form.named and has_closed_form(problem):
            table.fill_blocked(i, waypoint, names)
    rows = np.full(len(layers), -1)
    for i, layer in enumerate(layers):
        if len(layer):
            rows[i] = labels[i][int(np.argmin(settings.moves(layer, best.q[i]).max(axis=1)))]
    found = table.states, table.q, table.reach, joined, table.reasons
    return PathPostures(problem.robot, names, *found, best, rows)


def _labelled(settings: PathSettings, layers: list[Array]) -> tuple[tuple[str, ...], list[_Whole]]:
    """The names of the postures, and by place the posture of each configuration of its layer."""
    problem, closed_form = settings.problem, settings.problem.closed_form
    if closed_form is None or not closed_form.named:
        return _by_motion(settings, layers)
    allowed = [name for i, name in enumerate(closed_form.branches) if problem.allows(i)]
    names = tuple(dict.fromkeys(allowed))
    row_of = {name: row for row, name in enumerate(names)}
    found = []
    for layer in layers:
        turned = layer - problem.turns * np.floor(layer / TURN + 0.5) if len(layer) else layer
        _, first, back = np.unique(np.round(turned, _DIGITS), axis=0, return_index=True, return_inverse=True)
        branches = [closed_form.branches[closed_form.branch_of(layer[k])] for k in first.tolist()]
        kinds = np.array([row_of.setdefault(name, len(row_of)) for name in branches], dtype=np.int64)
        found.append(kinds[back.ravel()] if len(layer) else np.zeros(0, dtype=np.int64))
    return tuple(row_of), found


def _by_motion(settings: PathSettings, layers: list[Array]) -> tuple[tuple[str, ...], list[_Whole]]:
    """Numbers for postures without names: a configuration has that of the nearest one at the place before."""
    found: list[_Whole] = []
    before, count = (np.empty((0, settings.problem.robot.n)), np.zeros(0, dtype=np.int64)), 0
    for layer in layers:
        labels = np.full(len(layer), -1)
        for j, q in enumerate(layer):
            moves = settings.moves(before[0], q).max(axis=1, initial=0.0)
            if len(moves) and moves.min() <= settings.max_step:
                labels[j] = before[1][int(np.argmin(moves))]
            else:
                labels[j] = min(count, _UNNAMED - 1)
                count += 1
        found.append(labels)
        before = (layer, labels) if len(layer) else before
    return tuple(str(i + 1) for i in range(min(count, _UNNAMED))), found


def _followed_back(
    settings: PathSettings, layers: list[Array], labels: list[_Whole], count: int
) -> tuple[list[_Whole], NDArray[np.bool_]]:
    """How far each configuration of each layer leads, and which postures are joined at neighbouring places."""
    reach: list[_Whole] = [np.full(len(layer), i) for i, layer in enumerate(layers)]
    joined = np.zeros((max(len(layers) - 1, 0), count, count), dtype=bool)
    allowed = settings.max_step * (1.0 + 1e-9)
    for i in range(len(layers) - 2, -1, -1):
        settings.problem.cancel()
        after = layers[i + 1]
        if not len(after) or not len(layers[i]):
            continue
        key = int(np.argmax(np.where(settings.circle > 0.0, -1.0, np.ptp(after, axis=0) * settings.weight)))
        order = np.argsort(after[:, key], kind="stable")
        usable = -1 if settings.circle[key] > 0.0 else key
        goals = _Goals(
            after[order], labels[i + 1][order], reach[i + 1][order], np.ascontiguousarray(after[order, key])
        )
        _link(layers[i], labels[i], goals, usable, settings.weight, settings.circle, allowed, reach[i], joined[i])
    return reach, joined


class _Goals(NamedTuple):
    """The next layer, sorted by the values of one joint: configurations, postures, how far they lead, values."""

    q: Array
    labels: _Whole
    reach: _Whole
    sorted_key: Array


@jit
def _link(
    q: Array, labels: _Whole, goals: _Goals, key: int, weight: Array, circle: Array, allowed: float,
    reach: _Whole, joined: NDArray[np.bool_],
) -> None:  # fmt: skip
    """For each configuration of q ``(m, n)`` those of the next layer to which it leads: `reach` and `joined`."""
    for j in range(q.shape[0]):
        first, last = 0, goals.q.shape[0]
        if key >= 0:
            way = allowed / weight[key]
            first = first_from(goals.sorted_key, q[j, key] - way)
            last = first_from(goals.sorted_key, q[j, key] + way * (1.0 + 1e-12) + 1e-300)
        for o in range(first, last):
            near = True
            for k in range(q.shape[1]):
                d = goals.q[o, k] - q[j, k]
                if circle[k] > 0.0:
                    d -= circle[k] * math.floor(d / circle[k] + 0.5)
                if abs(d) * weight[k] > allowed:
                    near = False
                    break
            if near:
                joined[labels[j], goals.labels[o]] = True
                reach[j] = max(reach[j], goals.reach[o])


@dataclass(frozen=True, slots=True, eq=False)
class _Table:
    """The cells while they are filled; as in `PathPostures`."""

    robot: Robot
    states: _Whole
    q: Array
    reach: _Whole
    reasons: dict[tuple[int, int], Reason]

    @classmethod
    def of(cls, robot: Robot, places: int, postures: int) -> _Table:
        """Without a configuration anywhere."""
        states = np.full((places, postures), STATES.index("none"))
        q = np.full((places, postures, robot.n), math.nan)
        return cls(robot, states, q, np.full((places, postures), -1), {})

    def fill(self, place: int, waypoint: Waypoint, labels: _Whole, reach: _Whole) -> None:
        """The cells of one place in which the arm can be."""
        layer = waypoint.layer
        if not len(layer):
            return
        room = np.minimum(layer - self.robot.lower, self.robot.upper - layer)
        least = room.min(axis=1)
        for row in np.unique(labels).tolist():
            own = np.flatnonzero(labels == row)
            k = int(own[np.lexsort((-least[own], -reach[own]))[0]])
            self.q[place, row], self.reach[place, row] = layer[k], reach[k]
            state, reason = self._state(layer[k], room[k])
            self.states[place, row] = STATES.index(state)
            if reason is not None:
                self.reasons[place, row] = reason

    def _state(self, q: Array, room: Array) -> tuple[State, Reason | None]:
        near = [each for each in singularities_at(self.robot, q, NEAR_SINGULARITY) if each.kind != "algorithmic"]
        if near:
            return "near singularity", Reason(singularity=near[0])
        joint = int(np.argmin(room))
        if room[joint] >= NEAR_LIMIT:
            return "free", None
        row, robot = self.robot.joints[joint], self.robot
        limit = robot.lower[joint] if q[joint] - robot.lower[joint] <= room[joint] else robot.upper[joint]
        kind: Literal["prismatic", "revolute"] = "prismatic" if row.kind == "prismatic" else "revolute"
        return "near limit", Reason((LimitViolation(joint, row.name, float(q[joint]), float(limit), kind),))

    def fill_blocked(self, place: int, waypoint: Waypoint, names: Sequence[str]) -> None:
        """The cells of one place whose configurations are outside the limits or touch something."""
        problem = waypoint.problem
        found = branches_near(problem, problem.seed)
        assert problem.closed_form is not None
        for branch, q in enumerate(found.q):
            name = problem.closed_form.branches[branch]
            if name not in names or not found.closed[branch]:
                continue
            row = names.index(name)
            if self.states[place, row] < _DRIVEN:
                continue
            violations = violations_of(problem, q)
            contact = None
            if not violations and problem.options.avoids:
                contact = around(problem).touching(q)
            if violations or contact is not None:
                self.states[place, row] = STATES.index("outside" if violations else "touches")
                self.q[place, row] = q
                self.reasons[place, row] = Reason(violations, None, contact)
