"""The six cuts of an arm's loop as arrays that the kernels read."""

from __future__ import annotations

import numpy as np

from kin.axes import Links, screw_x, screw_z
from kin.transforms import Array

# Layout of the parameter array of one cut: the first joint of the loop, the place of the target in it, the size of
# the arm in metres; signs and offsets of the joints in the robot's order; the six transforms of the loop; what
# stands before and after the target's inverse.
SHIFT, PLACE, SIZE_OF_ARM = range(3)
SIGN, OFFSET, LOOP = 3, 9, 15
BEFORE, AFTER, SIZE = LOOP + 72, LOOP + 84, LOOP + 96
# Offsets of d and e: without them, the zeros and right angles of tables would meet infinite half tangents.
TURN_D, TURN_E = 0.7391, 1.1713


def cut_at(links: Links, shift: int) -> Array:
    """The parameter array ``(111,)`` of the loop that begins with joint `shift`."""
    size = float(np.abs(links.a).sum() + np.abs(links.d).sum()) or 1.0
    out = np.zeros(SIZE)
    out[SHIFT], out[PLACE], out[SIZE_OF_ARM] = shift, (5 - shift) % 6, size
    out[SIGN:OFFSET], out[OFFSET:LOOP] = links.sign, links.theta
    for place in range(6):
        joint = (shift + place) % 6
        after = screw_z(TURN_D, 0.0) if place == 2 else screw_z(TURN_E, 0.0) if place == 3 else np.eye(4)
        if joint == 5:
            out[BEFORE:AFTER] = _rows(links.tool, size)
            out[AFTER:SIZE] = _rows(links.base @ after, size)
        else:
            link = screw_z(0.0, links.d[joint]) @ screw_x(links.a[joint], links.alpha[joint])
            out[LOOP + 12 * place : LOOP + 12 * place + 12] = _rows(link @ after, size)
    return out


def _rows(T: Array, size: float) -> Array:
    """The first three rows of a transform ``(12,)``, its lengths in arm sizes."""
    rows = T[:3].copy()
    rows[:, 3] /= size
    return rows.ravel()
