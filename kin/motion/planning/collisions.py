"""Whether a planned motion touches the arm itself or obstacles."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from kin.collision.contacts import Surroundings
from kin.motion.details import Collides, Help
from kin.motion.pieces import Hold
from kin.motion.results import Motion, Refusal
from kin.transforms import Array

STEP = 0.01  # rad or m that the fastest joint moves between two checks at most
CHUNK = 4096  # checks between two calls of `stop`


def checked(motion: Motion, near: Surroundings, stop: Callable[[], None]) -> Motion:
    """The motion, or its refusal at the first place where something touches."""
    if not motion.planned:
        return motion
    for times, q in _configurations(motion):
        stop()
        distance, which = near.distances(q)
        touching = np.flatnonzero(distance < 0.0)
        if not len(touching):
            continue
        k = int(touching[0])
        contact = near.contact(float(distance[k]), int(which[k]))
        assert contact is not None
        time = float(times[k])
        segment = next((each for each in motion.segments if time <= each.end), motion.segments[-1])
        helps = (Help("via"),) if time > 0.0 else ()
        refusal = Refusal(
            segment.index, segment.kind, segment.name, None, None, "collision", Collides(time, contact), helps
        )
        return replace(motion, refusal=refusal, segments=(), notes=(), pieces=())
    return motion


def _configurations(motion: Motion) -> Iterator[tuple[Array, Array]]:
    """Times ``(k,)`` and configurations ``(k, n)`` along a motion, as dense as each piece is fast: few at rest."""
    pieces = motion.pieces or (Hold(motion.q_start, 0.0),)
    for piece, start in zip(pieces, motion.starts.tolist(), strict=False):
        fastest = float(np.abs(piece.at(piece.grid())[1]).max())
        count = 1 + math.ceil(piece.duration * fastest / STEP)
        for first in range(0, count + 1, CHUNK):
            times = piece.duration * (np.arange(first, min(first + CHUNK, count + 1)) / count)
            yield start + times, piece.at(times)[0]
