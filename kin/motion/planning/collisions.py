"""Whether a planned motion touches the arm itself or obstacles, at any time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kin.collision.contacts import Surroundings
from kin.collision.sweep import Rows, first_contacts
from kin.motion.details import Collides, Help
from kin.motion.pieces import Hold, Piece
from kin.motion.planning.parts import part_of
from kin.motion.results import Motion, Refusal
from kin.transforms import Array

PARTS = 8  # of each piece, with speeds of their own
SLACK = 1.1  # how much faster a joint may be between the times at which its speed is looked at
LEAST = 0.05  # of its highest speed in a piece: that of a joint which seems to rest in a part of it


def checked(motion: Motion, near: Surroundings, cancel: Callable[[], None]) -> Motion:
    """The motion, or its refusal at the first place where something touches.

    A motion that is not refused is proven free (:mod:`kin.collision.sweep`), provided that no joint is a tenth
    faster anywhere than at the times of `Piece.grid` around.
    """
    if not motion.planned:
        part = None if motion.part is None else checked(motion.part, near, cancel)
        if part is not None and not part.planned:  # something touches before the place that was refused
            return replace(part, program=motion.program)
        return motion
    pieces: tuple[Piece, ...] = tuple(motion.pieces) or (Hold(motion.q_start, 0.0),)
    begins = np.concatenate([np.linspace(0.0, piece.duration, PARTS, endpoint=False) for piece in pieces])
    spans = np.repeat([piece.duration / PARTS for piece in pieces], PARTS)
    speeds, farthest = _bounds(pieces)

    def at(rows: Rows, shares: Array) -> Array:
        times = begins[rows] + shares * spans[rows]
        q = np.empty((len(rows), motion.robot.n))
        for k in np.unique(rows // PARTS).tolist():
            these = rows // PARTS == k
            q[these] = pieces[k].at(times[these])[0]
        return q

    found = first_contacts(near, at, speeds * spans[:, None], farthest, cancel)
    touching = np.flatnonzero(np.isfinite(found))
    if not len(touching):
        return motion
    first = touching[:1]
    share = found[first]
    starts = motion.starts.tolist() if motion.pieces else [0.0]
    time = float(starts[int(first[0]) // PARTS] + begins[first[0]] + share[0] * spans[first[0]])
    contact = near.nearest(at(first, share)[0])
    assert contact is not None
    segment = next((each for each in motion.segments if time <= each.end), motion.segments[-1])
    helps = (Help("via"),) if time > 0.0 else ()
    refusal = Refusal(
        segment.index, segment.kind, segment.name, None, None, "collision", Collides(time, contact), helps
    )
    part = part_of(motion, segment.index, cancel)
    free = None if part is None else checked(part, near, cancel).driven
    return replace(motion, refusal=refusal, segments=(), notes=(), pieces=(), part=free)


def _bounds(pieces: tuple[Piece, ...]) -> tuple[Array, Array]:
    """Bounds of the speed of each joint in each part ``(k, n)``, and of its absolute values ``(n,)``."""
    speeds, farthest = [], []
    for piece in pieces:
        edges = np.linspace(0.0, piece.duration, PARTS + 1)
        times = np.unique(np.concatenate([piece.grid(), edges]))
        q, qd = piece.at(times)[:2]
        which = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, PARTS - 1)
        fastest = np.zeros((PARTS, q.shape[1]))
        np.maximum.at(fastest, which, np.abs(qd))
        # A time between two parts bounds both, and a part may have none of its own.
        inner = np.abs(piece.at(edges)[1])
        fastest = np.maximum(fastest, np.maximum(inner[:-1], inner[1:]))
        speeds.append(SLACK * fastest + LEAST * fastest.max(axis=0))
        farthest.append(np.abs(q).max(axis=0) + SLACK * np.abs(qd).max(axis=0) * piece.duration / PARTS)
    return np.concatenate(speeds), np.max(farthest, axis=0)
