"""Rows that follow a joint: linear maps from the joints of an arm to everything in it that moves.

A parallelogram, a belt over the elbow, two fingers on one motor: some axes have no motor of their own and turn
(or slide) by a fixed *ratio* of a joint. URDF calls it mimic, MJCF an equality of two joints. With q the values
of the joints and t those of all moving rows, ``t = A q``: one row of A per moving row, 1 in the column of its
joint or the ratio in that of the joint it follows. What is constant in such a relation is in θ or d of the row.

A row follows one joint. An axis that follows two of them is written as two rows one behind the other, each with
its own ratio, as mechanisms are built: the parallelogram of a palletiser turns the elbow back by joint 2, and
joint 3 turns it forth.

**Where the map acts.** The kernels of kinematics read a row's ratio from `Robot.model`, so searches, clouds and
motions see the joints alone. Everything else about following rows is here: what they leave of a joint's limits,
and the *free arm* in which they move by themselves. Its poses are those of the arm at ``A q``, which is how
bodies are drawn and how closed forms solve an arm of this kind (:mod:`kin.solvers.coupled`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kin.errors import InputError
from kin.transforms import Array

if TYPE_CHECKING:
    from kin.robot import Joint

_PEAKS = ("velocity", "acceleration", "jerk")


def check_followers(rows: Sequence[Joint]) -> None:
    """Whether each row that follows a joint names one that moves by itself.

    Raises:
        InputError: naming the row, and what it could follow.
    """
    drivers = [row.name for row in rows if row.kind != "fixed" and not row.follows]
    for row in rows:
        if not row.follows or drivers.count(row.follows) == 1:
            continue
        expected = "the name of a row that moves by itself: " + (
            ", ".join(dict.fromkeys(drivers)) or "there is none"
        )
        if row.follows in drivers:
            expected = "the name of one row, and several have this one"
        raise InputError(f"follows of {row.name}", row.follows, expected)


def effective(joint: Joint, followers: Iterable[Joint]) -> Joint:
    """A joint with the limits that it and the rows that follow it allow, in its own values.

    Raises:
        InputError: they leave it no value.
    """
    lower, upper = joint.limits or (-math.inf, math.inf)
    peaks = {key: getattr(joint, key) for key in _PEAKS}
    tightest = joint
    for row in followers:
        if row.limits is not None:
            low, high = sorted(limit / row.ratio for limit in row.limits)
            if low > lower or high < upper:
                tightest = row
            lower, upper = max(lower, low), min(upper, high)
        for key in _PEAKS:
            if (peak := getattr(row, key)) is not None:
                most = peak / abs(row.ratio)
                peaks[key] = most if peaks[key] is None else min(peaks[key], most)
    if lower > upper:
        expected = f"limits that leave {joint.name} a value, which it turns {tightest.ratio:g} times as far"
        raise InputError(f"limits of {tightest.name}", tightest.limits, expected)
    return replace(joint, limits=None if math.isinf(lower) else (lower, upper), **peaks)


def expansion(rows: Sequence[Joint]) -> Array:
    """A ``(m, n)`` of ``t = A q``: the values of all m moving rows from those of the n joints."""
    drivers = [row.name for row in rows if row.kind != "fixed" and not row.follows]
    moving = [row for row in rows if row.kind != "fixed"]
    A = np.zeros((len(moving), len(drivers)))
    joint = 0
    for i, row in enumerate(moving):
        if row.follows:
            A[i, drivers.index(row.follows)] = row.ratio
        else:
            A[i, joint] = 1.0
            joint += 1
    return A
