"""Whether a planned motion touches the arm itself or obstacles."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kin.collision.contacts import Surroundings
from kin.motion.details import Collides, Help
from kin.motion.results import Motion, Refusal

STEP = 0.01  # rad or m that the fastest joint may move between two checks
CHUNK = 4096  # checks between two calls of `stop`


def checked(motion: Motion, near: Surroundings, stop: Callable[[], None]) -> Motion:
    """The motion, or its refusal at the first place where something touches."""
    if not motion.planned:
        return motion
    fastest = float(motion.limits.velocity.max())
    times = np.linspace(0.0, motion.duration, 2 + math.ceil(motion.duration * fastest / STEP))
    for first in range(0, len(times), CHUNK):
        stop()
        some = times[first : first + CHUNK]
        distance, which = near.distances(motion.derivatives(some)[0])
        touching = np.flatnonzero(distance < 0.0)
        if not len(touching):
            continue
        k = int(touching[0])
        contact = near.contact(float(distance[k]), int(which[k]))
        assert contact is not None
        time = float(some[k])
        segment = next((each for each in motion.segments if time <= each.end), motion.segments[-1])
        helps = (Help("via"),) if time > 0.0 else ()
        refusal = Refusal(
            segment.index, segment.kind, segment.name, None, None, "collision", Collides(time, contact), helps
        )
        return replace(motion, refusal=refusal, segments=(), notes=(), pieces=())
    return motion
