"""Angles: whole turns, the image of an angle inside limits, and how far apart two angles are.

A joint whose limits span more than a turn has several values θ + 2πk for one configuration in space, the *images*
of an angle. Compiled functions take single angles, the others arrays. Loops that are vectorised wrap theirs by
:func:`kin.kernels.simd.wrapped`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.tolerances import TOLERANCES
from kin.transforms import Array

TURN = 2.0 * math.pi
_PER_TURN = 1.0 / TURN
_LIMIT = TOLERANCES.limit


@jit
def wrap(angle: float) -> float:
    """The same angle in (−π, π]."""
    return angle - TURN * math.ceil((angle - math.pi) / TURN)


@jit
def nearest_image(x: float, near: float, low: float, high: float) -> float:
    """The image x + 2πk closest to `near` among those inside [low, high], else the least far outside."""
    y = x + TURN * float(np.round((near - x) * _PER_TURN))
    if y - high > _LIMIT:
        turns = math.floor((high + _LIMIT - x) / TURN)
        below = x + TURN * turns
        if below - high > _LIMIT:  # the quotient was rounded up to a whole number
            below = x + TURN * (turns - 1.0)
        if low - below <= _LIMIT or low - below < below + TURN - high:
            return below
        return below + TURN
    if low - y > _LIMIT:
        turns = math.ceil((low - _LIMIT - x) / TURN)
        above = x + TURN * turns
        if low - above > _LIMIT:
            above = x + TURN * (turns + 1.0)
        if above - high <= _LIMIT or above - high < low - (above - TURN):
            return above
        return above - TURN
    return y


@jit
def excess(x: float, low: float, high: float) -> float:
    """How far the best image of the angle x is outside [low, high]; 0.0 inside (with the limit slack)."""
    y = nearest_image(x, 0.5 * (low + high), low, high)
    if y < low - _LIMIT:
        return low - y
    if y > high + _LIMIT:
        return y - high
    return 0.0


def wrapped(angles: Array) -> Array:
    """The same angles in (−π, π]."""
    return math.pi - (math.pi - angles) % TURN


def images_near(angles: Array, near: Array | float = 0.0) -> Array:
    """The images of angles that are nearest to other ones, whatever their limits."""
    return angles - TURN * np.round((angles - near) / TURN)


def apart(a: Array, b: Array, turns: NDArray[np.bool_] | bool = True) -> Array:
    """The largest difference ``(…)`` of joint values ``(…, n)``, whole turns of joints that make them aside."""
    off = a - b
    return np.asarray(np.abs(np.where(turns, wrapped(off), off)).max(axis=-1, initial=0.0))
