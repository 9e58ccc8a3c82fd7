"""Calls for many targets.

`solve_ik_many` answers each target of a stack as :func:`kin.solve_ik` does: limits, ranges, order, a sentence. The
best solutions are chosen by one compiled pass, which computes the branches too where the arm's family has a kernel
for many; results and sentences are made when they are asked for.
`ik_branches` returns joint values at the rate of a control loop, or for a million targets: all branches of a
closed form as a plain array, without limits, order or verification. It calls the batch kernels of the arm's closed
form (`kin.solvers.contract.BatchKernels`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin.errors import InputError
from kin.ik.answers import answer
from kin.ik.branches import candidates_of
from kin.ik.candidates import nearest_rows, take_seeds
from kin.ik.options import IKKeywords, IKOptions
from kin.ik.problem import FAR, IKProblem, listed, never_cancel, prepare, read_poses, read_seed
from kin.ik.results import IKResult, Status
from kin.kernels import fk as fk_kernels
from kin.kernels.compile import direct
from kin.named import robot_of
from kin.robot import Robot
from kin.solvers.contract import Candidates, ClosedForm, Many, One
from kin.solvers.locked import named_form_of
from kin.transforms import Array, finite_array, is_plain

_POSE = (4, 4)
_AT_ONCE = 1024  # targets of one compiled call
_CACHE = "_batch"
_empty, _isinf, _ndarray = np.empty, math.isinf, np.ndarray


class IKResults(Sequence[IKResult]):
    """The answers to a stack of targets: a sequence of `IKResult`, with the best solutions as one array.

    A result is made when it is first asked for, and kept.

    Attributes:
        q: ``(k, n)`` the best solution for each target, NaN where there is no exact one; read-only.
        solved: ``(k,)`` whether there is an exact one.
        status: of each answer.
    """

    def __init__(self, answer_at: Callable[[int], IKResult], q: Array) -> None:
        """The answers of `answer_at`, with the best solutions q ``(k, n)``; rows that are NaN are solved here."""
        self._answer_at, self.q = answer_at, q
        self._made: dict[int, IKResult] = {}
        for i in np.flatnonzero(np.isnan(q[:, 0])).tolist():
            if self[i].status is Status.SOLVED:
                q[i] = self[i].solutions[0].q
        self.solved: NDArray[np.bool_] = ~np.isnan(q[:, 0])
        self.q.flags.writeable = self.solved.flags.writeable = False

    @cached_property
    def status(self) -> tuple[Status, ...]:
        """Of each answer."""
        return tuple(Status.SOLVED if done else self[i].status for i, done in enumerate(self.solved.tolist()))

    @overload
    def __getitem__(self, index: int) -> IKResult: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[IKResult, ...]: ...

    def __getitem__(self, index: int | slice) -> IKResult | tuple[IKResult, ...]:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(len(self))[index])
        index = range(len(self))[index]
        found = self._made.get(index)
        if found is None:
            found = self._made[index] = self._answer_at(index)
        return found

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        """How many targets have each status."""
        counts = Counter(status.value for status in self.status)
        return f"IKResults({len(self)} targets: {', '.join(f'{n} {status}' for status, n in counts.items())})"

    def __reduce__(self) -> tuple[object, ...]:
        """Copies and pickles have all results."""
        return _with_results, (self.q, tuple(self))


def _with_results(q: Array, results: tuple[IKResult, ...]) -> IKResults:
    """Answers that are made already."""
    copy = IKResults.__new__(IKResults)
    copy.q, copy.solved = q, ~np.isnan(q[:, 0])
    copy._made = dict(enumerate(results))
    return copy


def solve_ik_many(
    robot: Robot | str,
    targets: Sequence[ArrayLike] | Array,
    *,
    options: IKOptions | None = None,
    q_seed: ArrayLike | None = None,
    **keywords: Unpack[IKKeywords],
) -> IKResults:
    """`kin.solve_ik` for each target of a stack, each on its own; `kin.solve_path` finds one path through all.

    Args:
        robot: the arm, or the id of a built-in one.
        targets: poses ``(k, 4, 4)`` of the tool in the world frame, metres; for ``task="position"`` also points
            ``(k, 3)``.
        options: all further arguments but the seed as one value.
        q_seed: ``(n,)`` one seed for all targets, or ``(k, n)`` one for each, radians (metres); the home pose by
            default.
        keywords: as in `kin.solve_ik`, for every target.

    Returns:
        The answers, one for each target, with the best solutions as one array.

    Raises:
        InputError: a malformed target (named ``targets[i]``), seed or option.

    Examples:
        >>> import kin, numpy as np
        >>> arm = kin.get_robot("ur5")
        >>> answers = kin.solve_ik_many(arm, kin.fk(arm, [arm.q_home, arm.q_home + 0.1]))
        >>> answers.q.shape, bool(answers.solved.all())
        ((2, 6), True)
    """
    return solve_many(robot_of(robot), listed(targets), IKOptions.of(options, **keywords), q_seed)


def solve_many(
    robot: Robot,
    targets: Sequence[ArrayLike] | Array,
    options: IKOptions,
    q_seed: ArrayLike | None = None,
    rounding: Array | None = None,
    cancel: Callable[[], None] = never_cancel,
) -> IKResults:
    """`solve_ik_many` for callers that have an `IKOptions`, rounded frames, or too little time.

    Args:
        rounding: ``(k,)`` for each target, as in `kin.ik.solve`.
        cancel: called before each target that takes more than a compiled pass; raises to cancel.

    Raises:
        InputError: a malformed target (named ``targets[i]``) or seed, or an option that does not fit the arm.
    """
    prepared = prepare(robot, options)
    poses, errors = read_poses(targets, prepared.code, always=robot.n < 6)
    if rounding is not None:
        errors += rounding
    seeds = prepared.seed[None] if q_seed is None else _seeds(robot, q_seed, len(targets))
    stack = _Stack(prepared, poses, errors, seeds, cancel)
    return IKResults(stack.answer, stack.nearest())


@dataclass(frozen=True, eq=False)
class _Stack:
    """Targets ``(k, 4, 4)`` of one prepared problem, their rounding ``(k,)`` and their seeds ``(k or 1, n)``.

    Attributes:
        found: of targets, what their closed form found, until their answers are made.
    """

    prepared: IKProblem
    poses: Array
    errors: Array
    seeds: Array
    cancel: Callable[[], None]
    found: dict[int, Candidates] = field(default_factory=dict)

    def problem(self, i: int) -> IKProblem:
        """The problem of target i."""
        self.cancel()
        return self.prepared.at(self.poses[i], float(self.errors[i]), self.seeds[min(i, len(self.seeds) - 1)])

    def answer(self, i: int) -> IKResult:
        """The answer to target i."""
        return answer(self.problem(i), self.found.pop(i, None))

    def nearest(self) -> Array:
        """The best solution of each target ``(k, n)``, NaN where it takes more than its branches to find it.

        That is so without a closed form for the task, and where options choose among solutions otherwise than by
        their distance to the seed.
        """
        prepared, options, form = self.prepared, self.prepared.options, self.prepared.closed_form
        q = np.full((len(self.poses), prepared.robot.n), math.nan)
        plain = options.prefer == options.images == "nearest" and not options.avoids and prepared.branches is None
        plain = plain and all(prepared.redundancies[k].rare for k in prepared.searched)
        if form is None or not form.handles(prepared.code) or not plain:
            return q
        quick = prepared.code in form.quick and options.respect_limits and not prepared.requested
        exact = np.flatnonzero(self.errors == 0.0)
        for start in range(0, len(exact), _AT_ONCE):
            rows = exact[start : start + _AT_ONCE]
            # Neighbours need not be copied, which takes as long as a tenth of the rest.
            some = slice(rows[0], rows[-1] + 1) if rows[-1] - rows[0] < len(rows) else rows
            seeds = self.seeds if len(self.seeds) == 1 else self.seeds[some]
            T = self.poses[some]
            found = (
                _chosen(prepared, form, T, seeds) if quick else self._chosen_one_by_one(rows.tolist(), T, seeds)
            )
            if not prepared.requested:
                take_seeds(prepared.requirement, T, seeds, found)
            q[some] = found
        return q

    def _chosen_one_by_one(self, rows: list[int], T: Array, seeds: Array) -> Array:
        """The best solutions ``(k, n)`` of some targets, whose branches are computed one target at a time."""
        for i in rows:
            problem = self.problem(i)
            found = candidates_of(problem, problem.T, problem.code)
            assert found is not None  # since the closed form handles the task
            self.found[i] = found
        q = np.empty((len(rows), self.prepared.robot.n))
        every = np.stack([self.found[i].q for i in rows])
        nearest_rows(self.prepared.requirement, T, seeds, every, q)
        # What such a target leaves free has a better value than that of the branches: it is searched for.
        searched = list(self.prepared.searched)
        q[[not np.isnan(self.found[i].values[:, searched]).all() for i in rows]] = math.nan
        return q


def _chosen(prepared: IKProblem, form: ClosedForm, T: Array, seeds: Array) -> Array:
    """The best solution of each target ``(k, n)``, of all its branches."""
    q, rows = np.empty((len(T), prepared.robot.n)), np.empty((len(T), len(form.branches), prepared.robot.n))
    form.solve_many(T, seeds, prepared.lower, prepared.upper, rows)
    nearest_rows(prepared.requirement, T, seeds, rows, q)
    return q


def _seeds(robot: Robot, q_seed: ArrayLike, count: int) -> Array:
    """The seeds ``(k, n)``, or one for all targets ``(1, n)``."""
    rows = robot.check_q(q_seed, "q_seed")
    if rows.shape not in (robot.q_shape, (count, robot.n)):
        expected = f"one configuration of {robot.n} values, or one for each of the {count} targets"
        raise InputError("q_seed", f"shape {rows.shape}", expected)
    if rows.ndim == 1:
        return read_seed(robot, rows)[None]
    far = np.abs(rows) > FAR
    for i in np.flatnonzero(far.any(axis=1)).tolist():
        read_seed(robot, rows[i], f"q_seed[{i}]")
    return np.array(rows)


class _Prepared(NamedTuple):
    """What a call needs of an arm: its kernels without the call around them, and their constant arguments."""

    one: One
    many: Many
    params: Array
    near: Array
    shape: tuple[int, int]

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Machine code cannot be pickled: the copy of an arm prepares its own."""
        return type(None), ()


def ik_branches(robot: Robot | str, target: ArrayLike, redundancy: ArrayLike = math.nan) -> Array:
    """All closed-form branches ``(..., branches, n)`` for poses ``(..., 4, 4)``, radians (metres).

    Row i is branch i of :func:`kin.branch_names`, NaN where it does not exist; where two have merged, both rows
    hold the same joint values. Angles are in (−π, π], except for a joint whose value is requested. Limits are not
    applied and nothing is verified; the rotation is assumed to be orthonormal. An arm with five joints does not
    meet the rotation about the tool's z axis. The general solvers of six and seven joints may miss a solution that
    shares a joint value with another one; `kin.solve_ik` looks for it.

    Args:
        robot: an arm with a closed form, or the id of a built-in one.
        target: a pose ``(4, 4)`` in the world frame, metres, or any batch ``(..., 4, 4)``.
        redundancy: value of the arm's first redundancy parameter (a joint value such as θ1 or θ7, or the arm angle
            ψ; radians), one for all targets or one for each; NaN keeps it near the home configuration.
            Joint values that a singular target leaves undetermined are also near that configuration.

    Returns:
        Configurations, NaN where a branch does not exist.

    Raises:
        InputError: an arm without a closed form; a target or redundancy that is not an array of finite numbers of
            that shape (a redundancy may be NaN).

    Examples:
        >>> import kin
        >>> kin.ik_branches("ur5", kin.fk("ur5", [0.1, -1.0, 1.2, 0.3, 0.8, 0.0])).shape
        (8, 6)
    """
    if not isinstance(robot, Robot):
        robot = robot_of(robot)
    prepared = robot.__dict__.get(_CACHE) or _prepare(robot)
    if type(target) is _ndarray and target.shape == _POSE and type(redundancy) is float and not _isinf(redundancy):
        try:
            out = _empty(prepared.shape)
            if prepared.one(prepared.params, target, redundancy, prepared.near, out):
                return out
        except TypeError:  # not float64, or not contiguous
            pass
    T = target if is_plain(target) else finite_array("target", target, _POSE)
    if T.shape[-2:] != _POSE or not _finite(T.reshape(-1)):
        finite_array("target", target, _POSE)
    value = _redundancy(redundancy, T.shape[:-2])
    out = np.empty((*T.shape[:-2], *prepared.shape))
    targets, rows = T.reshape(-1, 4, 4), out.reshape(-1, *prepared.shape)
    prepared.many(prepared.params, targets, value, prepared.near, rows)
    return out


def _prepare(robot: Robot) -> _Prepared:
    match = named_form_of(robot)
    if match is None:
        raise InputError("robot", robot.id, "an arm with a closed form")
    kernels, shape = match.kernels, (len(match.branches), robot.n)
    prepared = _Prepared(direct(kernels.one), direct(kernels.many), kernels.params, robot.q_home.copy(), shape)
    robot.__dict__[_CACHE] = prepared
    return prepared


def _redundancy(value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """One value ``(1,)``, or one for each target, flat; NaN is allowed."""
    try:
        values = np.asarray(value)
        if values.dtype.kind not in "biuf":
            raise TypeError
        values = (values if values.ndim == 0 else np.broadcast_to(values, shape)).astype(np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise InputError("redundancy", value, f"one number, or numbers of shape {shape}") from None
    if np.isinf(values).any():
        raise InputError("redundancy", value, "finite numbers, or NaN")
    return values


def _finite(values: Array) -> bool:
    return bool(fk_kernels.all_finite(values))
