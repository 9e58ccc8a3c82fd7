"""Posture maps: how many exact postures an arm has in a section of the task space, or in a plane of two joints.

The nodes of a grid are poses: of a plane, with one orientation of the tool; or those that two joints make while
the others stand still. Each is solved by the batch kernels of the arm's closed form, and every row is checked by
forward kinematics. Where two postures merge, at a singularity, the number changes by two, so singular curves of a
section are borders between regions of different numbers; with joint limits, there are borders of limits too. Each
border is located on the edges of the grid by bisection. In a plane of joints the curves are those on which the
determinant of the Jacobian vanishes, and the regions between them are the *aspects* of this plane.

A curve on which two postures merge and part again at once leaves the number as it is, and is not seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin.axes import generic_q, inverse, links_of
from kin.differential.metric import extent
from kin.differential.task import Task, natural_task, task_rows, usual_rank
from kin.errors import InputError
from kin.explained import Explained
from kin.fk import fk
from kin.ik.batch import solve_many
from kin.ik.messages.values import count
from kin.ik.options import IKOptions, JointConstraints, Limits, Locks
from kin.ik.problem import never_cancel
from kin.named import robot_of
from kin.postures.movable import Movable
from kin.robot import Robot
from kin.solvers.contract import TASK_CODES, ClosedForm
from kin.solvers.locked import named_form_of
from kin.solvers.numeric import descend_freely
from kin.tolerances import TOLERANCES
from kin.transforms import Array, as_transform, finite_array, rotation_about
from kin.units import DEFAULT_UNITS, Units
from kin.workspace.region import Region, checked_integer
from kin.workspace.sections.contour import ends, loops
from kin.workspace.sections.cut import plane_axes

Counts = NDArray[np.int16]
Flags = NDArray[np.bool_]
Kind = Literal["singular", "limit"]

MOST = 1000  # nodes along a side
_AT_ONCE = 512  # poses
_THREADS = 2
_BISECTIONS = 2
_SLACK = 1e-6  # m
_MET = 1e-7  # m and entries of rotations: rows of the kernels that are farther off are no solutions
# Orientations such as straight down are special: a general solver takes ten times as long there, and misses some.
# So it counts in an orientation that is turned by this.
_TURNED = np.eye(4)
_TURNED[:3, :3] = rotation_about(np.array([0.36, 0.48, 0.8]), 1e-4)
_SMALL = 4  # nodes: smaller regions are left out


@dataclass(frozen=True, slots=True, eq=False)
class PostureCurve:
    """Part of a border between regions.

    Attributes:
        points: ``(k, 2)`` along it, in the coordinates of the map.
        kind: ``"singular"``: two postures merge there; ``"limit"``: a posture leaves the joint limits.
    """

    points: Array
    kind: Kind


@dataclass(frozen=True, slots=True, eq=False)
class PostureRegion:
    """A connected part of a map.

    Attributes:
        name: ``"A"``, ``"B"``, …, the largest first.
        count: number of postures; in a plane of joints, of the pose at `place`.
        share: of the nodes of the map.
        place: ``(2,)`` the node farthest from its border.
        q: ``(count, n)`` the postures there, radians (metres).
        branches: their names, or numbers where they have none.
        branch: of the configuration at `place` in a plane of joints, if branches have names; else "".
    """

    name: str
    count: int
    share: float
    place: Array
    q: Array
    branches: tuple[str, ...]
    branch: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class MapPlane:
    """What a map is of: a section of the task space, or a plane of two joints.

    Attributes:
        window: least and largest x, and least and largest y: metres along u and v, or joint values.
        joints: indices of the two joints of a plane; None for a section.
        q: ``(n,)`` where the other joints are; None for a section.
        origin, u, v: ``(3,)`` the tool is at ``origin + x·u + y·v`` in the world; None for a plane of joints.
        rotation: ``(3, 3)`` orientation of the tool; None for a plane of joints.
    """

    window: tuple[tuple[float, float], tuple[float, float]]
    joints: tuple[int, int] | None = None
    q: Array | None = None
    origin: Array | None = None
    u: Array | None = None
    v: Array | None = None
    rotation: Array | None = None

    def configurations(self, xy: Array) -> Array:
        """Those at coordinates ``(k, 2)`` of a plane of joints ``(k, n)``."""
        assert self.q is not None
        q = np.tile(self.q, (len(xy), 1))
        q[:, self.joints] = xy
        return q

    def poses(self, robot: Robot, xy: Array) -> Array:
        """The poses ``(k, 4, 4)`` at coordinates ``(k, 2)``."""
        if self.joints is not None:
            return fk(robot, self.configurations(xy))
        assert self.origin is not None
        assert self.u is not None
        assert self.v is not None
        T = np.tile(np.eye(4), (len(xy), 1, 1))
        T[:, :3, :3] = self.rotation
        T[:, :3, 3] = self.origin + xy[:, :1] * self.u + xy[:, 1:] * self.v
        return T


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PostureMap(Explained):
    """How many postures there are, node by node.

    Attributes:
        robot: the arm.
        plane: what it is a map of.
        x, y: ``(a,)``, ``(b,)`` coordinates of the nodes.
        counts: ``(a, b)`` number of exact postures.
        curves: borders, as far as the grid shows them.
        regions: the connected parts, without those of a few nodes; of a section only those with a posture.
        respect_limits: whether only postures inside the joint limits count.
        doubtful: number of nodes with an odd number of postures without limits: one of them may be missing.
        task: what of a pose a posture meets.
    """

    robot: Robot
    plane: MapPlane
    x: Array
    y: Array
    counts: Counts
    curves: tuple[PostureCurve, ...]
    regions: tuple[PostureRegion, ...]
    respect_limits: bool
    doubtful: int
    task: Task

    def __repr__(self) -> str:
        """Its nodes, regions and numbers."""
        a, b = self.counts.shape
        return (
            f"PostureMap({self.robot.id!r}, {a} × {b}, {len(self.regions)} regions, {self.counts.max()} at most)"
        )

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The regions in words, for those who do not see the map, in any units."""
        turns = (
            [True, True] if self.plane.joints is None else self.robot.revolute[list(self.plane.joints)].tolist()
        )
        x, y = ((units.of(bool(turn)) if self.plane.joints is not None else units.lengths) for turn in turns)
        if not self.regions:
            solved = int((self.counts > 0).sum())
            if solved == 0:
                return "No posture at any node of this plane."
            nodes = count(solved, "node has", "nodes have")
            return f"No region of {_SMALL} nodes or more: {nodes} a posture."
        parts = []
        for each in self.regions:
            number = count(each.count, "posture", "postures")
            named = f", itself {each.branch}" if each.branch else ""
            at = f"{x.value(float(each.place[0]))}, {y.value(float(each.place[1]))}"
            parts.append(f"{each.name}: {number}{named}, {100.0 * each.share:.1f} % of the map, around {at}.")
        return f"{count(len(parts), 'region', 'regions').capitalize()}. " + " ".join(parts)


def posture_map(
    robot: Robot | str,
    target: ArrayLike | None = None,
    *,
    normal: ArrayLike | None = None,
    joints: Sequence[int] | None = None,
    q: ArrayLike | None = None,
    limits: Limits | None = None,
    locked: Locks | None = None,
    constraints: JointConstraints | None = None,
    respect_limits: bool = True,
    resolution: int = 100,
    progress: Callable[[float], object] = lambda _: None,
    cancel: Callable[[], None] = never_cancel,
) -> PostureMap:
    """How many exact postures an arm has, in a section of the task space or in a plane of two joints.

    The arm must have as many joints that move as its task has dimensions: joints of one with seven are locked.

    Args:
        robot: the arm, or the id of a built-in one.
        target: pose ``(4, 4)`` of the tool in the world frame, metres: the section contains its point, and the
            tool keeps its orientation. By default that of the home configuration.
        normal: ``(3,)`` of the section, of any length in metres; by default it contains the z axis of the base.
        joints: indices of two joints: the map is of the plane of their values, in the place of a section.
        q: ``(n,)`` where the other joints are then, radians (metres); the home configuration by default.
        limits, locked: as in `kin.JointConstraints`.
        constraints: both as one value, instead of `limits` and `locked`.
        respect_limits: whether only postures inside the joint limits count.
        resolution: nodes along a side, 8 to 1000.
        progress: called now and then with the part that is done, 0 to 1.
        cancel: called now and then; cancels by raising.

    Returns:
        The numbers, the borders, and the regions with the postures in them.

    Raises:
        InputError: naming the wrong argument; an arm with a freedom left; a section out of reach.

    Examples:
        >>> import kin
        >>> found = kin.posture_map("ur5", resolution=16)
        >>> found.counts.shape, int(found.counts.max()) <= 8
        ((16, 16), True)
    """
    robot = robot_of(robot)
    nodes = checked_integer("resolution", resolution, 8, MOST, f"a whole number from 8 to {MOST}")
    movable = Movable.of(robot, JointConstraints.of(limits, locked, constraints))
    solver = _Solver.of(movable, respect_limits, cancel)
    if joints is None:
        if q is not None:
            raise InputError("q", q, "none without `joints`")
        return _map(solver, _section(robot, target, normal), nodes, progress)
    if target is not None or normal is not None:
        raise InputError("joints", joints, "a plane of joints or a section, not both")
    return _map(solver, _joint_plane(movable, joints, q), nodes, progress)


@dataclass(frozen=True, eq=False)
class _Solver:
    """All postures of many poses.

    Attributes:
        movable: the arm, with and without its locked joints.
        form: the closed form of the joints that move, None where poses are solved one by one.
        task: what a posture must meet.
        respect_limits: whether limits count.
        cancel: called now and then.
    """

    movable: Movable
    form: ClosedForm | None
    task: Task
    respect_limits: bool
    cancel: Callable[[], None]

    @classmethod
    def of(cls, movable: Movable, respect_limits: bool, cancel: Callable[[], None]) -> _Solver:
        """The solver of an arm; raises `InputError` for one with a freedom left."""
        arm, robot = movable.arm, movable.whole
        task: Task = natural_task(arm) if arm.n != 4 else "pose"
        if task == "position" and usual_rank(arm, task) < arm.n:
            task = "pose"
        if arm.n > 6 or usual_rank(arm, task) < arm.n:
            expected = "an arm with as many joints that move as its task has dimensions; lock the others"
            raise InputError("robot", f"{robot.id} with {arm.n} joints that move", expected)
        form = None if task == "position" else named_form_of(arm)
        if task != "position" and (form is None or not form.handles(TASK_CODES[task])):
            raise InputError("robot", robot.id, f"an arm with a closed form for its task, {task}")
        return cls(movable, form, task, respect_limits, cancel)

    @property
    def arm(self) -> Robot:
        """The arm without its locked joints."""
        return self.movable.arm

    def all(self, T: Array, careful: bool = False) -> Array:
        """All configurations of poses ``(k, 4, 4)`` without limits ``(k, m, n)``, each once; else NaN.

        `careful`: look for what the batch kernels may miss, which takes milliseconds for each pose.
        """
        self.cancel()
        rows = self._position(T) if self.form is None else self._rows(self.form, T, careful)
        return self._once(rows)

    def counts(
        self, T: Array, progress: Callable[[float], object] = lambda _: None, careful: bool = False
    ) -> tuple[Counts, Counts]:
        """The numbers of postures ``(k,)`` at poses: without limits, and inside them; `careful` as in `all`."""
        found: list[tuple[Counts, Counts]] = [(np.zeros(0, np.int16), np.zeros(0, np.int16))]
        parts = np.split(T, range(_AT_ONCE, len(T), _AT_ONCE)) if len(T) else []
        with ThreadPoolExecutor(_THREADS) as threads:  # the kernels let other threads run
            for each in threads.map(partial(self._count, careful=careful), parts):
                found.append(each)
                progress((len(found) - 1) / len(parts))
        every, inside = zip(*found, strict=True)
        return np.concatenate(every), np.concatenate(inside)

    def lonely(self, every: Counts) -> NDArray[np.intp]:
        """The nodes of a map ``(a, b)`` whose number is that of none beside them, where some may be missed."""
        if self.form is None or self.form.named:
            return np.empty(0, dtype=np.intp)
        padded = np.pad(every, 1, constant_values=-1)
        beside = (padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:])
        return np.flatnonzero(np.all([other != every for other in beside], axis=0))

    def _count(self, T: Array, careful: bool = False) -> tuple[Counts, Counts]:
        rows = self.all(T, careful)
        there = ~np.isnan(rows[..., 0])
        inside = there & self._inside(rows)
        return there.sum(axis=1, dtype=np.int16), inside.sum(axis=1, dtype=np.int16)

    def postures(self, T: Array) -> tuple[Array, tuple[str, ...]]:
        """The postures of a pose ``(4, 4)`` that count ``(k, n)``, and their names."""
        rows = self.all(T[None])[0]
        rows = rows[~np.isnan(rows[:, 0])]
        if self.form is not None and not self.form.named and len(rows):
            exact, error = descend_freely(self.arm.model, T, TASK_CODES[self.task], rows)
            rows = np.where((error < _MET)[:, None], exact, rows)
        if self.respect_limits:
            rows = rows[self._inside(rows)]
        q = self.movable.expanded(rows)
        names = named_form_of(self.movable.whole)
        if names is None or not names.named:
            return q, tuple(str(i + 1) for i in range(len(q)))
        return q, tuple(names.branches[names.branch_of(each)] for each in q)

    def branch(self, q: Array) -> str:
        """The name of the posture of a configuration ``(n,)``; "" if it has none."""
        names = named_form_of(self.movable.whole)
        return names.branches[names.branch_of(q)] if names is not None and names.named else ""

    def signs(self, q: Array) -> Counts:
        """1 or 2 by the sign of the determinant ``(k,)`` at configurations of the whole arm ``(k, n)``."""
        J = task_rows(self.arm, np.ascontiguousarray(q[:, self.movable.joints]), self.task)
        if J.shape[-2] > J.shape[-1]:  # the motions that the joints control are the same everywhere
            J = np.linalg.svd(task_rows(self.arm, generic_q(self.arm), self.task))[0][:, : J.shape[-1]].T @ J
        return np.where(np.linalg.det(J) > 0.0, 2, 1).astype(np.int16)

    def _rows(self, form: ClosedForm, T: Array, careful: bool) -> Array:
        if not form.named:
            T = T @ _TURNED
        out = np.full((len(T), len(form.branches), self.arm.n), math.nan)
        near = np.flatnonzero(self._within_reach(T))
        T = T[near]
        rows = np.empty((len(T), *out.shape[1:]))
        form.kernels.many(form.kernels.params, T, np.array([math.nan]), self.arm.q_home.copy(), rows)
        for each, q in zip(T, rows, strict=True) if careful else ():
            form.add_missing(each, self.arm.q_home.copy(), q)
        rows[~self._met(rows, T)] = math.nan
        out[near] = rows
        return out

    def _within_reach(self, T: Array) -> Flags:
        """Which poses ``(k, 4, 4)`` leave the links between the first and the last axis long enough.

        The common normal of two axes, and the way along the second one to the next normal, belong to one link and
        are perpendicular. So the last axis passes the first one no farther away than the sum of these diagonals.
        """
        if self.task != "pose" or self.arm.coupled or not self.arm.revolute.all():
            return np.ones(len(T), dtype=np.bool_)
        links = links_of(self.arm, (1,) * (self.arm.n - 1))
        last = T[:, :3, :3] @ inverse(links.tool)[:3, 3] + T[:, :3, 3]
        reach = float(np.hypot(links.a[:-1], links.d[1:]).sum())
        return np.asarray(np.linalg.norm(last - links.base[:3, 3], axis=1) < reach + _SLACK)

    def _met(self, rows: Array, T: Array) -> Flags:
        """Which configurations ``(…, m, n)`` meet their poses ``(…, 4, 4)``."""
        reached = fk(self.arm, np.nan_to_num(rows))
        off = np.abs(reached - T[..., None, :, :])[..., :3, 2 if self.task == "approach" else 0 :]
        return np.asarray((off.max(axis=(-1, -2)) < _MET) & ~np.isnan(rows[..., 0]))

    def _position(self, T: Array) -> Array:
        options = IKOptions(task="position", respect_limits=False)
        solved = [np.array([s.q for s in each.solutions]) for each in solve_many(self.arm, T[:, :3, 3], options)]
        rows = np.full((len(T), max(map(len, solved), default=0) or 1, self.arm.n), math.nan)
        for i, each in enumerate(solved):
            rows[i, : len(each)] = each if len(each) else math.nan
        return rows

    def _once(self, rows: Array) -> Array:
        """The same with copies of merged postures left out."""
        turns = self.arm.revolute
        weights = np.random.default_rng(6).uniform(1.0, 2.0, (2, self.arm.n))
        key = np.where(turns, np.cos(rows), rows) @ weights[0] + np.where(turns, np.sin(rows), 0.0) @ weights[1]
        order = np.argsort(key, axis=1)
        ranked = np.take_along_axis(rows, order[..., None], axis=1)
        copies = np.diff(np.take_along_axis(key, order, axis=1), axis=1) < TOLERANCES.merge
        ranked[:, 1:][copies] = math.nan
        return ranked

    def _inside(self, rows: Array) -> Flags:
        """Which configurations ``(…, n)`` are inside the limits, whole turns aside."""
        lower, upper, slack = self.arm.lower, self.arm.upper, TOLERANCES.limit
        above = rows - np.where(np.isfinite(lower), lower, 0.0) + slack
        above = np.where(self.arm.revolute, np.mod(above, 2.0 * math.pi), above)
        ok = (above >= 0.0) & (above <= upper - lower + 2.0 * slack) | ~np.isfinite(upper - lower)
        return np.asarray(ok.all(axis=-1))


def _section(robot: Robot, target: ArrayLike | None, normal: ArrayLike | None) -> MapPlane:
    """The section through a pose, as far as the tool may reach; raises `InputError`."""
    T, base = fk(robot, robot.q_home) if target is None else as_transform(target), robot.T_world_base
    if normal is None:
        across = np.cross(base[:3, 2], T[:3, 3] - base[:3, 3])
        across = across if np.linalg.norm(across) > TOLERANCES.geometry else base[:3, 1]
    else:
        across = finite_array("normal", normal, (3,))
        if across.ndim != 1 or not np.linalg.norm(across) > 0.0:
            raise InputError("normal", normal, "three numbers, not all zero")
    across = across / np.linalg.norm(across)
    u, v = plane_axes(across)
    height, reach = float((T[:3, 3] - base[:3, 3]) @ across), extent(robot)
    if not abs(height) < reach:
        raise InputError("target", T[:3, 3].tolist(), f"a section less than {reach:.4g} m from the base")
    half = math.sqrt(reach**2 - height**2)
    window = ((-half, half), (-half, half))
    return MapPlane(window, None, None, base[:3, 3] + height * across, u, v, T[:3, :3])


def _joint_plane(movable: Movable, joints: Sequence[int], q: ArrayLike | None) -> MapPlane:
    """A plane of two joints inside their limits; raises `InputError`."""
    robot, free = movable.whole, movable.joints
    try:
        i, j = joints
    except (TypeError, ValueError):
        i = j = -1
    if i not in free or j not in free or i == j:
        raise InputError("joints", joints, f"two different ones of {', '.join(map(str, free))}")
    at = robot.q_home if q is None else robot.check_q(q)
    if at.ndim != 1:
        raise InputError("q", f"shape {at.shape}", f"one configuration of {robot.n} values")
    region = Region.finite(movable.arm)
    bounds = dict(zip(free, region.bounds, strict=True))
    return MapPlane((bounds[i], bounds[j]), (int(i), int(j)), movable.expanded(at[free]))


def _map(solver: _Solver, plane: MapPlane, nodes: int, progress: Callable[[float], object]) -> PostureMap:
    """The map of a plane with this many nodes along a side."""
    robot = solver.movable.whole

    def levels(xy: Array) -> Counts:
        """What borders lie between ``(k, 2)``: numbers of postures that count, and of all; or the sign of det."""
        if plane.joints is not None:
            return np.stack([solver.signs(plane.configurations(xy))] * 2, axis=-1)
        every, inside = solver.counts(plane.poses(robot, xy))
        return np.stack([inside if solver.respect_limits else every, every], axis=-1)

    x, y = (np.linspace(*window, nodes) for window in plane.window)
    xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    every, inside = solver.counts(plane.poses(robot, xy), lambda part: progress(0.8 * part))
    again = solver.lonely(every.reshape(nodes, nodes))
    every[again], inside[again] = solver.counts(plane.poses(robot, xy[again]), careful=True)
    counts: Counts = (inside if solver.respect_limits else every).reshape(nodes, nodes)
    marks = np.stack([counts, every.reshape(nodes, nodes)], axis=-1)
    if plane.joints is not None:
        marks = levels(xy).reshape(nodes, nodes, 2)
    progress(0.8)
    curves = _borders(marks, x, y, levels)
    regions = _regions(solver, plane, marks[..., 0], x, y)
    for array in (x, y, counts):
        array.flags.writeable = False
    doubtful = int((every % 2).sum()) if solver.arm.revolute.all() else 0
    progress(1.0)
    return PostureMap(robot, plane, x, y, counts, curves, regions, solver.respect_limits, doubtful, solver.task)


def _borders(marks: Counts, x: Array, y: Array, levels: Callable[[Array], Counts]) -> tuple[PostureCurve, ...]:
    """The curves between parts of a map with different numbers, without the rim of the map.

    `marks` ``(a, b, 2)`` has what `levels` says of the nodes.
    """
    marks = np.pad(marks, ((1, 1), (1, 1), (0, 0)))
    padded = marks[..., 0]
    # The rim is outside of everything; a vertex there is NaN, which ends a curve.
    axes = [np.concatenate([[math.nan], values, [math.nan]]) for values in (x, y)]
    found = [
        [(*ends(edge, inside), (level, level)) for edge in loop]
        for level in np.unique(padded)[1:].tolist()
        for inside in (padded >= level,)
        for loop in loops(inside)
    ]
    if not found:
        return ()
    nodes = np.concatenate(found)  # of each edge the node inside, the one outside, and the level between
    reached, missed = (np.stack([axes[k][nodes[:, end, k]] for k in (0, 1)], axis=-1) for end in (0, 1))
    inner, outer = (marks[nodes[:, end, 0], nodes[:, end, 1]] for end in (0, 1))
    level = nodes[:, 2, 0]
    open_ = np.flatnonzero(~np.isnan(missed).any(axis=1))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (reached + missed)[open_]
        between = levels(middle)
        hit = between[:, 0] >= level[open_]
        reached[open_[hit]], missed[open_[~hit]] = middle[hit], middle[~hit]
        inner[open_[hit]], outer[open_[~hit]] = between[hit], between[~hit]
    singular = inner[:, 1] != outer[:, 1]
    cuts = np.cumsum([len(loop) for loop in found])[:-1]
    loops_ = zip(np.split(0.5 * (reached + missed), cuts), np.split(singular, cuts), strict=True)
    return tuple(piece for points, kinds in loops_ for piece in _pieces(points, kinds))


def _pieces(points: Array, singular: Flags) -> list[PostureCurve]:
    """A closed curve ``(k, 2)`` without its vertices that are NaN, in pieces of one kind that share ends."""
    code = np.where(np.isnan(points).any(axis=1), -1, singular)
    changes = np.flatnonzero(code != np.roll(code, 1))
    if not len(changes):
        closed = np.concatenate([points, points[:1]])
        return [PostureCurve(closed, "singular" if singular[0] else "limit")] if code[0] >= 0 else []
    points, code = np.roll(points, -changes[0], axis=0), np.roll(code, -changes[0])
    found = []
    for rows in np.split(np.arange(len(points)), changes[1:] - changes[0]):
        following = (rows[-1] + 1) % len(points)
        if code[following] >= 0:
            rows = np.append(rows, following)
        if code[rows[0]] >= 0 and len(rows) > 1:
            found.append(PostureCurve(points[rows], "singular" if code[rows[0]] else "limit"))
    return found


def _regions(solver: _Solver, plane: MapPlane, parts: Counts, x: Array, y: Array) -> tuple[PostureRegion, ...]:
    """The connected parts ``(a, b)`` of one number, the largest first."""
    label = _labels(parts)
    sizes = np.bincount(label.reshape(-1))
    found: list[PostureRegion] = []
    for each in np.argsort(-sizes, kind="stable").tolist():
        nodes = label == each
        if sizes[each] < _SMALL or not parts[nodes][0]:
            continue
        i, j = _deepest(nodes)
        place = np.array([x[i], y[j]])
        q, names = solver.postures(plane.poses(solver.movable.whole, place[None])[0])
        own = "" if plane.joints is None else solver.branch(plane.configurations(place[None])[0])
        share = float(sizes[each] / parts.size)
        found.append(PostureRegion(_letters(len(found)), len(q), share, place, q, names, own))
    return tuple(found)


def _labels(parts: Counts) -> NDArray[np.int64]:
    """The number of the connected part that each node ``(a, b)`` belongs to."""
    a, b = parts.shape
    values, label = parts.reshape(-1).tolist(), [-1] * (a * b)
    found = 0
    for first in range(a * b):
        if label[first] >= 0:
            continue
        label[first], waiting = found, [first]
        while waiting:
            node = waiting.pop()
            i, j = divmod(node, b)
            beside = ((node - b, i > 0), (node + b, i < a - 1), (node - 1, j > 0), (node + 1, j < b - 1))
            for other, exists in beside:
                if exists and label[other] < 0 and values[other] == values[node]:
                    label[other] = found
                    waiting.append(other)
        found += 1
    return np.array(label).reshape(a, b)


def _deepest(nodes: Flags) -> tuple[int, int]:
    """A node that is as far from the others as any of these ``(a, b)``."""
    while True:
        inner = np.pad(nodes, 1)
        inner = inner[1:-1, 1:-1] & inner[:-2, 1:-1] & inner[2:, 1:-1] & inner[1:-1, :-2] & inner[1:-1, 2:]
        if not inner.any():
            i, j = np.argwhere(nodes)[int(nodes.sum()) // 2].tolist()
            return i, j
        nodes = inner


def _letters(number: int) -> str:
    """0 → A, 25 → Z, 26 → AA."""
    return (_letters(number // 26 - 1) if number >= 26 else "") + chr(ord("A") + number % 26)
