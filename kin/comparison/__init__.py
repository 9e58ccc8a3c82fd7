"""Are two tables the same arm, and if not, what was mistyped?

Two DH tables of one arm may share no number: the conventions differ, a row may be split, joints may count from
another zero or in the other sense, base and tool may be drawn elsewhere.

- :mod:`kin.comparison.matching` decides from the joint axes whether constant frames, signs and offsets turn one
  into the other.
- :mod:`kin.comparison.frames` chooses the plainest of them.
- :mod:`kin.comparison.bound` rules out many at once that cannot be plain enough.
- :mod:`kin.comparison.diagnosis` looks for the mistakes that explain a difference.

A comparison says "the same" only after forward kinematics has confirmed it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from kin.axes import size
from kin.comparison.diagnosis import FREE_FRAMES, Search, differences
from kin.comparison.frames import Mapping, Reference, free_offsets
from kin.comparison.matching import PRINTED, Tolerance
from kin.comparison.results import Change, Comparison, Difference, Explanation, LimitDifference, Verdict
from kin.comparison.tables import invariants_of
from kin.dh.exponentials import exp_screw
from kin.errors import InputError
from kin.fk import fk
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array

Frames = Literal["fixed", "free"]

# Of axes that count as one, for an arm of up to a metre.
_AXES = Tolerance(1e-6, 1e-6)
# Of axes that may be the same but for rounding; a mapping is then fitted to the poses.
_ROUNDED = Tolerance(2e-3, 3e-3)
_SAMPLES, _CLIMBS = 200, 5
_MOST = 5  # explanations
_SHARE = 0.1  # of an allowed difference of poses, as the tolerance of a search, which forgives ten times as much
# The senses of n joints are 2ⁿ cases, and exchanged rows are pairs.
_MAX_JOINTS, _MAX_ROWS = 12, 40

__all__ = ["Change", "Comparison", "Difference", "Explanation", "LimitDifference", "compare"]


def compare(
    a: Robot | str,
    b: Robot | str,
    *,
    frames: Frames = "fixed",
    tolerance: tuple[float, float] | None = None,
    explain: bool = True,
    seconds: float = 2.0,
    cancel: Callable[[], None] | None = None,
) -> Comparison:
    """Compare arm b with the reference a.

    Args:
        a, b: the arms, or ids of built-in ones.
        frames: ``"fixed"`` if equal joint values should give equal poses, so that another base, tool or zero is a
            mistake too; ``"free"`` if these are expected to differ, as between a URDF and a book.
        tolerance: largest difference of the poses, (metres, radians), up to which the arms count as ``"close"``.
            By default none: then only digits beyond those that are printed are forgiven, 0.01 mm and 0.001°. With
            a tolerance, mistakes are also found in a table that is rounded elsewhere.
        explain: whether to look for mistakes in b.
        seconds: after which no further pairs of mistakes are tried; single ones are always tried.
        cancel: called every few milliseconds while mistakes are sought; what it raises ends the comparison.

    Returns:
        the verdict, the mapping, the differences and likely mistakes.

    Raises:
        InputError: an invalid argument, or an arm with more than 12 joints or 40 rows.
        UnknownRobotError: an id that does not exist.

    Examples:
        >>> import kin
        >>> kin.compare("puma560", kin.dh.convert_dh("puma560", "modified")).verdict
        'identical'
    """
    a, b = robot_of(a), robot_of(b)
    if a.coupled or b.coupled:
        if a.expansion.shape != b.expansion.shape or not np.allclose(
            a.expansion, b.expansion, rtol=0.0, atol=1e-9
        ):
            expected = "an arm whose rows follow its joints as those of a do: `Robot.free` has none that follow"
            raise InputError("b", b.id, expected)
        a, b = a.free, b.free
    for name, arm in (("a", a), ("b", b)):
        if arm.n > _MAX_JOINTS or len(arm.rows) > _MAX_ROWS:
            size_of = f"{arm.n} joints in {len(arm.rows)} rows"
            raise InputError(name, size_of, f"an arm with at most {_MAX_JOINTS} joints and {_MAX_ROWS} rows")
    if frames not in ("fixed", "free"):
        raise InputError("frames", frames, '"fixed" or "free"')
    allowed = _allowed(tolerance)
    if not (isinstance(seconds, int | float) and 0.0 <= seconds < math.inf):
        raise InputError("seconds", seconds, "a number of seconds, 0 or more")
    deadline = time.monotonic() + seconds
    axes = _AXES.of(a)
    reference = Reference(a, axes)
    result = _verdict(reference, b, allowed)
    if explain and result.verdict != "identical":
        result = _explained(result, reference, b, frames == "fixed", allowed, deadline, cancel or (lambda: None))
    return result


def _explained(
    result: Comparison,
    reference: Reference,
    b: Robot,
    fixed: bool,
    allowed: Tolerance | None,
    deadline: float,
    cancel: Callable[[], None],
) -> Comparison:
    """The comparison with likely mistakes in b."""
    unchanged = math.inf
    if result.mapping is not None and result.is_same:
        unchanged = result.mapping.cost(reference.tolerance) * (1.0 if fixed else FREE_FRAMES)
    search = Search(reference, b, fixed, deadline, cancel)
    found = search.run(_MOST, unchanged)
    if not found and allowed is not None and not result.is_same:
        near = Reference(reference.robot, Tolerance(_SHARE * allowed.length, _SHARE * allowed.angle))
        search = Search(near, b, fixed, deadline, cancel)
        found = _within(reference.robot, search.run(_MOST, unchanged), allowed)
    return replace(result, explanations=tuple(found), complete=search.complete)


def _within(a: Robot, several: list[Explanation], allowed: Tolerance) -> list[Explanation]:
    """Those after which the poses differ by no more than is allowed, measured as for a verdict."""
    found = []
    for each in several:
        _, position, rotation = _largest(a, each.robot, each.mapping)
        if allowed.holds(position, rotation):
            found.append(replace(each, position=position, rotation=rotation))
    return found


def _allowed(tolerance: tuple[float, float] | None) -> Tolerance | None:
    if tolerance is None:
        return None
    try:
        length, angle = (float(x) for x in tolerance)
    except (TypeError, ValueError):
        raise InputError("tolerance", tolerance, "two numbers: metres and radians") from None
    if not (0.0 <= length < math.inf and 0.0 <= angle < math.inf):
        raise InputError("tolerance", tolerance, "two finite numbers, 0 or more: metres and radians")
    return Tolerance(length, angle)


def _verdict(reference: Reference, b: Robot, allowed: Tolerance | None) -> Comparison:
    """The comparison without explanations."""
    a, axes = reference.robot, reference.tolerance
    differing = tuple(_differences(a, b, axes))
    if any(d.quantity in ("count", "kind") for d in differing):
        return Comparison("different", None, first=differing[0], differences=differing)
    rounded = _is_rounded(a, b)
    printed = PRINTED.of(a)
    place = None
    for tolerance in (axes, printed, _ROUNDED.of(a)):
        found = (reference if tolerance is axes else Reference(a, tolerance)).plainest_of(b)
        if isinstance(found, int):
            place = found if place is None else place
            continue
        mapping, choices = found
        if tolerance is not axes:
            mapping = _fitted(a, b, mapping)
        worst, position, rotation = _largest(a, b, mapping)
        verdict: Verdict = "different"
        if printed.holds(position, rotation):
            verdict = "identical" if mapping.is_trivial else "same"
        elif tolerance is axes:
            continue
        elif allowed is not None and allowed.holds(position, rotation):
            verdict = "close"
        elif tolerance is printed:
            continue
        same = verdict != "different"
        return Comparison(
            verdict,
            mapping,
            sign_choices=choices,
            free_offsets=free_offsets(a),
            position=position,
            rotation=rotation,
            worst_q=worst,
            first=None if same or not differing else differing[0],
            differences=() if same else differing,
            limits=_limits(a, b, mapping) if same else (),
            rounded=rounded,
        )
    if not differing and place is not None:
        differing = (Difference((place,), "direction", None, None),)
    return Comparison("different", None, first=differing[0], differences=differing, rounded=rounded)


def _differences(a: Robot, b: Robot, tolerance: Tolerance) -> list[Difference]:
    """The invariants of the axes that differ, from the base on."""
    if a.n != b.n:
        return [Difference((), "count", float(a.n), float(b.n))]
    kinds = [
        (i, x.kind, y.kind) for i, (x, y) in enumerate(zip(a.joints, b.joints, strict=True)) if x.kind != y.kind
    ]
    if kinds:
        return [Difference((i,), "kind", x, y) for i, x, y in kinds]
    one, other = invariants_of(a), invariants_of(b)
    found: list[Difference] = []

    def note(
        joints: tuple[int, ...], quantity: Literal["twist", "distance", "offset"], x: float, y: float
    ) -> None:
        near = tolerance.angle if quantity == "twist" else 10.0 * tolerance.length
        x, y = abs(x), abs(y)
        if abs(x - y) > near:  # never where one of them does not exist: a twist differs then
            found.append(Difference(joints, quantity, x, y))

    for i in range(a.n - 1):
        note((i, i + 1), "twist", float(one.twist[0, i]), float(other.twist[0, i]))
        note((i, i + 1), "distance", float(one.distance[0, i]), float(other.distance[0, i]))
        note((i,), "offset", float(one.offset[0, i]), float(other.offset[0, i]))
    return found


def _fitted(a: Robot, b: Robot, mapping: Mapping) -> Mapping:
    """A mapping whose frames and offsets, where it has any, are fitted to the poses by Gauss–Newton steps."""
    q = a.random_q(np.random.default_rng(2), 40)
    goal = fk(a, q)
    has = [not np.array_equal(mapping.base, np.eye(4)), not np.array_equal(mapping.tool, np.eye(4))]
    free = [*np.repeat(has, 6).tolist(), *(mapping.offsets != 0.0).tolist()]
    columns = np.flatnonzero(free)
    if not columns.size:
        return mapping
    for _ in range(4):
        now = mapping.poses(b, q)
        jacobian = np.empty((now[:, :3].size, columns.size))
        step = 1e-6
        for k, column in enumerate(columns):
            moved = _moved(mapping, np.eye(12 + a.n)[column] * step)
            jacobian[:, k] = (moved.poses(b, q)[:, :3] - now[:, :3]).ravel() / step
        change = np.zeros(12 + a.n)
        change[columns] = np.linalg.lstsq(jacobian, (goal[:, :3] - now[:, :3]).ravel(), rcond=1e-9)[0]
        mapping = _moved(mapping, change)
    return mapping


def _moved(mapping: Mapping, change: Array) -> Mapping:
    """The mapping with small motions (rotation, translation) of base and tool, and changed offsets."""
    base, tool = (_small(change[k : k + 6]) for k in (0, 6))
    return Mapping(mapping.base @ base, tool @ mapping.tool, mapping.signs, mapping.offsets + change[12:])


def _small(twist: Array) -> Array:
    return exp_screw(twist, 1.0) if twist.any() else np.eye(4)


def _largest(a: Robot, b: Robot, mapping: Mapping) -> tuple[Array, float, float]:
    """Where the poses differ most, and by how much: metres, radians.

    From the worst random configurations, climbed by random steps that become smaller.
    """
    rng = np.random.default_rng(1)
    scale = size(a)

    def measured(q: Array) -> tuple[Array, Array, Array]:
        position, rotation = differences(fk(a, q), mapping.poses(b, q))
        return position, rotation, position / scale + rotation

    q = a.random_q(rng, _SAMPLES)
    position, rotation, both = measured(q)
    most = [float(position.max()), float(rotation.max())]
    best = q[np.argsort(both, kind="stable")[-_CLIMBS:]]
    width = np.where(np.isfinite(a.upper - a.lower), a.upper - a.lower, 2.0 * math.pi)
    for share in (0.2, 0.1, 0.05, 0.02):
        around = best[:, None] + share * width * rng.uniform(-1.0, 1.0, (len(best), 24, a.n))
        q = np.concatenate([best, a.clip(around.reshape(-1, a.n))])
        position, rotation, both = measured(q)
        most = [max(most[0], float(position.max())), max(most[1], float(rotation.max()))]
        best = q[np.argsort(both, kind="stable")[-_CLIMBS:]]
    return best[-1], most[0], most[1]


def _limits(a: Robot, b: Robot, mapping: Mapping) -> tuple[LimitDifference, ...]:
    """Joints whose limits differ by more than a tenth of a degree or of a millimetre."""
    found = []
    for i, (x, y) in enumerate(zip(a.joints, b.joints, strict=True)):
        sign, offset = float(mapping.signs[i]), float(mapping.offsets[i])
        mapped = None
        if y.limits is not None:
            low, high = sorted(sign * (value - offset) for value in y.limits)
            turns = 2.0 * math.pi * round((low - (x.limits or (low, high))[0]) / (2.0 * math.pi))
            mapped = (low - turns, high - turns) if x.kind == "revolute" else (low, high)
        near = 2e-3 if x.kind == "revolute" else 1e-4
        if (x.limits is None) != (mapped is None) or (
            x.limits and mapped and max(abs(x.limits[k] - mapped[k]) for k in (0, 1)) > near
        ):
            found.append(LimitDifference(i, x.limits, mapped))
    return tuple(found)


def _is_rounded(a: Robot, b: Robot) -> bool:
    """Whether every number of b is that of a with fewer digits, and one is."""
    if a.convention != b.convention or len(a.rows) != len(b.rows):
        return False
    rounds = False
    for x, y in zip(a.rows, b.rows, strict=True):
        for key in ("theta", "d", "a", "alpha"):
            exact, typed = getattr(x, key), getattr(y, key)
            if exact == typed:
                continue
            scale = a.units == "mm" and key in ("d", "a")
            units = (1e3 if scale else 1.0, 180.0 / math.pi if key in ("theta", "alpha") else 1.0)
            if (
                not any(abs(round(exact * unit, k) - typed * unit) < 1e-9 for unit in units for k in range(7))
                or abs(exact - typed) > 0.02
            ):
                return False
            rounds = True
    return rounds
