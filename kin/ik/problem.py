"""An IK problem: a target, a seed, and options that have been checked against an arm.

An `IKProblem` is valid, so its readers check nothing. What depends on arm and options alone is computed once and
cached (`prepare`); each target takes a copy of that (`IKProblem.of`). Locked joints are
limits of zero width; narrowed limits replace the robot's own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from kin.angles import TURN
from kin.differential.metric import weights
from kin.errors import InputError
from kin.ik.candidates import Requirement, Whole
from kin.ik.digits import EXACT, SINGLE, missing_digits
from kin.ik.options import IKOptions, shape_of
from kin.kernels.checks import straighten, straighten_many
from kin.kernels.compile import direct
from kin.robot import Robot
from kin.solvers.contract import POSITION, ClosedForm, RedundancyParameter
from kin.solvers.locked import form_with_locked
from kin.solvers.scaled import unit_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array, as_transform, finite_array

FAR = 1e6  # metres, radians; the coordinates of targets and the values of seeds are smaller
SEED = "seed"  # stands for the branch of the seed
_FLOAT = np.dtype(np.float64)
_POSE = (4, 4)
_empty, _ndarray = np.empty, np.ndarray
_LEVER = 0.1  # metres
_ROUNDED = 1e-2  # the largest deviation of RᵀR from I of a rotation that is typed with few digits
_NEARLY = 0.1  # the same of what may have been meant as a rotation: its size is named


def never_cancel() -> None:
    """Default cancellation hook: never cancels."""


@dataclass(frozen=True, eq=False)
class IKProblem:
    """A checked problem.

    Attributes:
        robot, options: the arm, and what was requested.
        T: target pose T_base_tool ``(4, 4)``.
        task, code, mask: what a solution has to meet, as in `kin.ik.options.Coordinates`.
        seed, lower, upper: ``(n,)``; the limits are those of the problem.
        locked: ``(n,)`` which joints are locked.
        turns: ``(n,)`` 2π for a joint with whole-turn images, else 0.0.
        low, high: ``(n,)`` where a numeric descent may go.
        respect: whether configurations outside the limits are left out.
        closed_form: that of the arm, None if it has none or is not to use it.
        redundancies: the redundancy parameters of the closed form in this task.
        values: one per redundancy parameter, NaN to let it be chosen.
        branches: the requested rows, None for all.
        target_error: how rounded the target is, if that matters.
        cancel: called now and then by long computations; raises to cancel them.
        unit: metres that stand for one where lengths are judged to be none; not 1.0 for an arm that is much
            smaller or larger, see :mod:`kin.solvers.scaled`.
    """

    robot: Robot
    options: IKOptions
    T: Array
    task: str
    code: int
    mask: Array
    seed: Array
    lower: Array
    upper: Array
    locked: tuple[bool, ...]
    turns: Array
    low: Array
    high: Array
    respect: bool
    closed_form: ClosedForm | None
    redundancies: tuple[RedundancyParameter, ...]
    values: tuple[float, ...]
    branches: frozenset[int] | None
    target_error: float = 0.0
    cancel: Callable[[], None] = never_cancel
    unit: float = 1.0

    @classmethod
    def of(
        cls,
        robot: Robot,
        target: ArrayLike,
        options: IKOptions,
        q_seed: ArrayLike | None = None,
        rounding: float = 0.0,
    ) -> IKProblem:
        """The problem of a target ``(4, 4)`` (task ``"position"``: or a point ``(3,)``) and a seed ``(n,)``.

        `rounding` counts in addition to that of the target's own entries.

        Raises:
            InputError: a malformed target or seed, or an option that does not fit the arm.
        """
        prepared = prepare(robot, options)
        seed = prepared.seed if q_seed is None else read_seed(robot, q_seed)
        T, error = read_pose(target, prepared.code, always=robot.n < 6)
        return prepared.at(T, error + rounding, seed)

    def at(self, T: Array, error: float, seed: Array) -> IKProblem:
        """This problem, as `prepare` gives it, with a target and its rounding, as from `read_pose`, and a seed."""
        # The same as `replace`, in a tenth of the time: this runs for every target.
        problem = object.__new__(IKProblem)
        values = problem.__dict__
        values.update(self.__dict__)
        values["T"], values["seed"] = T, seed
        if error > 0.0:
            values["target_error"] = error
            del values["requirement"]  # computed again from this error
        if self.branches is not None and SEED in (self.options.branch or ()):
            name = self.branch_name(self.branch_of(seed))
            problem.__dict__["branches"] = self.branches | self.rows_named(name)
        return problem

    @cached_property
    def requirement(self) -> Requirement:
        """What the compiled measurement needs of this problem, but for target and seed.

        The point of a rounded target is as rounded as its entries are. Where it is `_LEVER` from axis 1, joint 1
        turns the tool by a larger angle to meet it.
        """
        options = self.options
        position = options.position_tolerance or max(self.closure, 2.0 * self.target_error)
        rotation = options.rotation_tolerance or max(TOLERANCES.closure_rotation, self.target_error / _LEVER)
        return Requirement(
            self.robot.model,
            self.mask,
            self.lower,
            self.upper,
            self.turns,
            weights(self.robot),
            self.code,
            self.respect,
            position,
            rotation,
        )

    @property
    def closure(self) -> float:
        """The largest position error in metres of what meets a point exactly."""
        return TOLERANCES.closure_position * self.unit

    @cached_property
    def free(self) -> Whole:
        """Indices ``(k,)`` of the joints that may move."""
        narrow = self.respect & (self.lower >= self.upper)
        return np.flatnonzero(~(np.array(self.locked, dtype=bool) | narrow))

    @cached_property
    def searched(self) -> tuple[int, ...]:
        """The redundancy parameters whose values are searched for the best one by the preference.

        For the nearest configuration not those of a joint that moves alone, nor what depends on them, nor of seven
        joints: their solvers compare configurations.
        """
        free = [k for k, value in enumerate(self.values) if math.isnan(value)]
        if self.options.prefer == "nearest":
            few, parameters = self.robot.n < 7, self.redundancies
            free = [k for k in free if parameters[k].rare or (few and k == 0 and parameters[k].joint < 0)]
        return tuple(free)

    @property
    def requested(self) -> tuple[RedundancyParameter, ...]:
        """The redundancy parameters whose values were requested."""
        return tuple(p for p, v in zip(self.redundancies, self.values, strict=True) if not math.isnan(v))

    @property
    def chosen_branches(self) -> int | None:
        """How many postures, branches of one name, a solution may be on, None for all."""
        return None if self.branches is None else len({self.branch_name(i) for i in self.branches})

    def allows(self, branch: int) -> bool:
        """Whether a solution may be on this branch."""
        return self.branches is None or branch in self.branches

    def branch_of(self, q: Array) -> int:
        """Branch of a configuration, −1 if the arm's branches have no names."""
        return -1 if self.closed_form is None else self.closed_form.branch_of(q)

    def branch_name(self, branch: int) -> str:
        """Name of a branch."""
        return "numeric" if self.closed_form is None or branch < 0 else self.closed_form.branches[branch]

    def rows_named(self, name: str) -> frozenset[int]:
        """The rows of the branches with this name."""
        names = () if self.closed_form is None else self.closed_form.branches
        return frozenset(i for i, each in enumerate(names) if each == name)

    def without_turns(self) -> IKProblem:
        """The same problem without whole-turn images: each joint value is taken as it is."""
        return replace(self, turns=np.zeros(self.robot.n))

    def near(self, seed: Array) -> IKProblem:
        """The same problem with another seed."""
        return replace(self, seed=seed)

    def as_rounded(self) -> IKProblem | None:
        """The same problem with as much tolerance as the few digits of a quaternion ask for; None if it had many.

        An arm with few joints does not meet a rounded pose exactly. `read_pose` tells the same of a matrix.
        """
        if self.robot.n >= 6 or self.code == POSITION or self.target_error > 0.0:
            return None
        error = _rounding(self.T)
        return replace(self, target_error=error) if error > 0.0 else None


@lru_cache(maxsize=1024)
def prepare(robot: Robot, options: IKOptions) -> IKProblem:
    """Check the options against an arm: a problem with the identity as target and the home pose as seed."""
    lower, upper, locked = options.constraints.bounds(robot)
    task, code, mask = options.coordinates
    closed_form = (
        form_with_locked(robot, options.constraints.locks(robot), code) if options.solver == "auto" else None
    )
    handled = closed_form is not None and closed_form.handles(code)
    redundancies = closed_form.redundancies(code) if closed_form is not None and handled else ()
    values = _requested_values(robot, options, redundancies)
    turns = np.where(robot.whole_turns, TURN, 0.0)
    for parameter, value in zip(redundancies, values, strict=True):
        if parameter.joint >= 0 and not math.isnan(value):
            turns[parameter.joint] = 0.0
    low, high = lower, upper
    if not options.respect_limits:
        low, high = np.where(robot.revolute, -TURN, lower), np.where(robot.revolute, TURN, upper)
    problem = IKProblem(
        robot=robot,
        options=options,
        T=np.eye(4),
        task=task,
        code=code,
        mask=mask,
        seed=robot.q_home.copy(),
        lower=lower,
        upper=upper,
        locked=locked,
        turns=turns,
        low=low,
        high=high,
        respect=options.respect_limits,
        closed_form=closed_form,
        redundancies=redundancies,
        values=values,
        branches=_requested_branches(robot, options, closed_form),
        unit=unit_of(robot),
    )
    _ = problem.requirement, problem.free, problem.searched  # computed here, so that all copies share them
    return problem


def read_pose(target: ArrayLike, code: int, field: str = "target", always: bool = False) -> tuple[Array, float]:
    """A target as a pose ``(4, 4)``, and how rounded it is: 0.0 if it has a rotation, within
    `TOLERANCES.rotation_matrix`.

    For the task POSITION it may also be a point ``(3,)``. An `InputError` names `field`.
    With `always`, a rotation counts as rounded that looks as if digits were left out (`kin.ik.digits`), however
    small the deviation: an arm with few joints meets few poses exactly, and the digits of a target decide which of
    them are meant. A quaternion leaves no deviation: see `IKProblem.as_rounded`.
    """
    if type(target) is _ndarray and target.shape == _POSE and target.dtype is _FLOAT and target.flags.carray:
        T = _empty(_POSE)
        error = _straighten()(target, FAR, T)
        if error >= 0.0:
            return T, _rounding(target) if always and error > EXACT else 0.0
    if code == POSITION and shape_of(target) == (3,):
        T = np.eye(4)
        T[:3, 3] = finite_array(field, target, (3,))
        error = 0.0
    else:
        T, error = _nearest_pose(target, field, always)
    if max(abs(T.item(3)), abs(T.item(7)), abs(T.item(11))) > FAR:
        raise InputError(f"{field} position", T[:3, 3].tolist(), "coordinates below 1e6 m")
    return T, error


@cache
def _straighten() -> Callable[[Array, float, Array], float]:
    """`straighten`, without the call around it."""
    return direct(straighten)


def listed(targets: object) -> list[ArrayLike] | Array:
    """Several targets as a list or an array; raises `InputError` for anything else."""
    several = targets.ndim > 0 if isinstance(targets, np.ndarray) else isinstance(targets, Sequence)
    if not several or isinstance(targets, str | bytes):
        raise InputError("targets", targets, "a sequence of poses (k, 4, 4)")
    return targets if isinstance(targets, np.ndarray) else list(targets)  # type: ignore[call-overload]  # a sequence


def read_poses(targets: Sequence[ArrayLike] | Array, code: int, always: bool = False) -> tuple[Array, Array]:
    """`read_pose` of each target: poses ``(k, 4, 4)`` and how rounded they are ``(k,)``.

    An `InputError` names ``targets[i]``. Plain arrays are read in one compiled call, but for targets that are not
    exact.
    """
    count = len(targets)
    poses, errors = np.empty((count, *_POSE)), np.full(count, -1.0)
    if isinstance(targets, np.ndarray) and targets.shape[1:] == _POSE:
        with suppress(TypeError):  # of other numbers, or not aligned
            straighten_many(np.ascontiguousarray(targets), FAR, poses, errors)
    exact = errors >= 0.0
    if always:
        exact &= errors <= EXACT
    errors[exact] = 0.0
    for i in np.flatnonzero(~exact).tolist():
        poses[i], errors[i] = read_pose(targets[i], code, f"targets[{i}]", always)
    return poses, errors


def _nearest_pose(target: ArrayLike, field: str, always: bool) -> tuple[Array, float]:
    """A matrix that is nearly a pose ``(4, 4)`` as the nearest one, and how rounded it is."""
    T = finite_array(field, target, (4, 4))
    if T.ndim > 2 and field == "target":
        raise InputError(field, f"shape {T.shape}", "one 4×4 matrix; kin.solve_ik_many takes several")
    last = np.abs(T[3] - (0.0, 0.0, 0.0, 1.0)).max() if T.ndim == 2 else math.inf
    if last > TOLERANCES.rotation_matrix or np.abs(T).max() > FAR:
        return as_transform(T, field), 0.0
    R = T[:3, :3]
    error = float(np.abs(R.T @ R - np.eye(3)).max())
    if TOLERANCES.rotation_matrix < error <= _NEARLY and np.linalg.det(R) > 0.0:
        rounding = _rounding(T) if error <= _ROUNDED else 0.0
        if rounding == 0.0:
            raise _no_rotation(R, error, field)
        U, _, V = np.linalg.svd(R)
        found = T.copy()
        found[:3, :3], found[3] = U @ V, (0.0, 0.0, 0.0, 1.0)
        return found, rounding
    return as_transform(T, field), _rounding(T) if always and error > EXACT else 0.0


def _no_rotation(R: Array, error: float, field: str) -> InputError:
    """Says by how much a matrix ``(3, 3)`` misses a rotation, and in which way."""
    gram = R.T @ R
    factor = math.sqrt(float(np.trace(gram)) / 3.0)
    scaled = np.abs(gram - factor * factor * np.eye(3)).max() < 0.1 * error
    what = f"this one is a rotation times {factor:.6g}" if scaled else f"RᵀR of this one is off by {error:.2g}"
    expected = f"an orthonormal rotation matrix (RᵀR = I), or one that is rounded to some decimals; {what}"
    return InputError(f"{field} rotation", R.tolist(), expected)


def _rounding(T: Array) -> float:
    """How rounded the entries of a pose ``(4, 4)`` are, 0.0 if nothing says that they are.

    The point of a rounded rotation has the same decimals, or as many digits as an entry of the rotation.
    """
    found = missing_digits(T[:3, :3])
    largest = float(np.abs(T[:3, 3]).max())
    if found == 0.0 or largest <= 1.0:
        return found
    if found == SINGLE:
        return found * largest
    coarser = found * 10.0 ** math.ceil(math.log10(largest))
    return coarser if abs(largest / coarser - round(largest / coarser)) < 1e-9 / coarser * largest else found


def read_seed(robot: Robot, q_seed: ArrayLike, field: str = "q_seed") -> Array:
    """One configuration ``(n,)``, copied; an `InputError` names `field`."""
    if type(q_seed) is np.ndarray and q_seed.shape == robot.q_shape and q_seed.dtype is _FLOAT:
        seed = q_seed.copy()
        if sum(map(abs, seed.tolist())) <= FAR:  # then each of them is; the sum of NaN is not
            return seed
    seed = np.array(robot.check_q(q_seed, field))
    if seed.ndim != 1:
        raise InputError(field, f"shape {seed.shape}", f"one configuration of {robot.n} values")
    for i in np.flatnonzero(np.abs(seed) > FAR).tolist():
        # So many turns away, the whole-turn images of an angle have lost their digits.
        raise InputError(f"{field}[{i}]", float(seed[i]), "a value below 1e6")
    return seed


def _requested_values(
    robot: Robot, options: IKOptions, redundancies: tuple[RedundancyParameter, ...]
) -> tuple[float, ...]:
    """The requested value of each redundancy parameter, NaN where none was requested."""
    requested = options.redundancy
    if requested is None:
        return (math.nan,) * len(redundancies)
    if isinstance(requested, tuple | Mapping):
        requested = dict(requested)
    names = [parameter.name for parameter in redundancies if not parameter.rare]
    if not names:
        locked = " with these joints locked" if options.constraints.locked else ""
        expected = f"none: {robot.id} has no redundancy parameter to set in this task{locked}"
        raise InputError("redundancy", requested, expected)
    if not isinstance(requested, dict):
        requested = {names[0]: requested}
    for name in requested:
        if name not in names:
            raise InputError("redundancy", name, "one of " + ", ".join(names))
    return tuple(requested.get(parameter.name, math.nan) for parameter in redundancies)


def _requested_branches(robot: Robot, options: IKOptions, closed_form: ClosedForm | None) -> frozenset[int] | None:
    """The rows of the branches that are requested by names or parts of names; `IKProblem.of` adds the seed's."""
    requested = options.branch
    if requested is None:
        return None
    if closed_form is None or not closed_form.named:
        shown = requested[0] if len(requested) == 1 else list(requested)
        raise InputError("branch", shown, f"none: the branches of {robot.id} have no names")
    names = closed_form.branches
    parts = list(dict.fromkeys(part for name in names for part in name.split(" · ")))
    rows: set[int] = set()
    for each in requested:
        if each == SEED:
            continue
        words = [word.strip() for word in each.replace(",", "·").split("·")]
        if any(word not in parts for word in words):
            raise InputError("branch", each, '"seed", or of these, joined by " · ": ' + ", ".join(parts))
        found = {i for i, name in enumerate(names) if all(word in name.split(" · ") for word in words)}
        if not found:
            raise InputError("branch", each, "parts that go together, as in " + repr(names[0]))
        rows |= found
    return frozenset(rows)
