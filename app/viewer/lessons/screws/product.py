"""The screws of an arm in both forms, and what a part of the product of exponentials gives, without a scene."""

from __future__ import annotations

from typing import Literal

import numpy as np

from kin.dh import Screws, exp_screw
from kin.transforms import Array

Form = Literal["space", "body"]


def seen(found: Screws, form: Form) -> Array:
    """The screws ``(6, n)`` in the frame of the form: the world's, or the tool's."""
    return found.S if form == "space" else found.B


def origin_of(found: Screws, form: Form) -> Array:
    """The frame ``(4, 4)`` in which the screws of a form are given."""
    return np.eye(4) if form == "space" else found.M


def foot(S: Array) -> Array:
    """The point ``(3,)`` of a revolute joint's axis nearest to the origin; the origin for a prismatic joint."""
    return np.cross(S[:3], S[3:])


def partial(q: Array, factors: int, form: Form) -> Array:
    """The configuration ``(n,)`` that the factors next to M give: of the last joints, or the first (body form)."""
    out = np.zeros_like(q)
    chosen = slice(len(q) - factors, None) if form == "space" else slice(None, factors)
    out[chosen] = q[chosen]
    return out


def product(zero: Screws, q: Array, form: Form) -> Array:
    """The product of exponentials ``(4, 4)``, multiplied in the order of the form."""
    if form == "space":
        return zero.pose(q)
    T = zero.M
    for B, value in zip(zero.B.T, q, strict=True):
        T = T @ exp_screw(B, value)
    return np.asarray(T)
