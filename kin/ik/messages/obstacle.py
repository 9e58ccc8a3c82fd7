"""Why the geometry of an arm does not close at a target, as a clause."""

from __future__ import annotations

from kin.solvers.contract import Obstacle, ObstacleCode
from kin.units import DEFAULT_UNITS, Units

CLAUSES: dict[ObstacleCode, str] = {
    "wrist centre too far from the shoulder": (
        "with this orientation the wrist centre is farther than {bound} from the shoulder"
    ),
    "wrist centre too near to the shoulder": (
        "with this orientation the wrist centre is nearer than {bound} to the shoulder"
    ),
    "wrist centre beyond the elbow's reach": (
        "with this orientation the wrist centre is out of the elbow's reach"
    ),
    "wrist centre too near to axis 1 or 2": ("with this orientation the wrist centre is too near to axis 1 or 2"),
    "wrist centre off the upper arm and forearm": (
        "with this orientation the horizontal upper arm and the forearm do not meet the wrist centre"
    ),
    "last axis beyond the links' reach": "the last axis is out of the two links' reach",
    "approach direction": "the wrist centre is out of the elbow's reach for this approach direction",
    "point": "the point is out of the arm's reach",
    "given joint values": "the point is out of reach with the given joint values",
}


def clause_of(obstacle: Obstacle, units: Units = DEFAULT_UNITS) -> str:
    """What does not fit, e.g. ``"with this orientation the wrist centre is farther than 660 mm from …"``."""
    return CLAUSES[obstacle.code].format(bound=units.lengths.text(obstacle.bound, 0))
