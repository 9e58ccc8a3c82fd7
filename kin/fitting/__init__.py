"""Capsules around bodies: no point of a body is outside of the capsules that stand for it.

`capsules_around` takes triangles and balls, `capsule_around` is quicker and looser; `tubes` are what is assumed of
a link whose body is not known.
"""

from kin.fitting.capsule import Segment
from kin.fitting.pieces import MOST, capsule_around, capsules_around
from kin.fitting.tubes import Tube, radius_of, tubes

__all__ = ["MOST", "Segment", "Tube", "capsule_around", "capsules_around", "radius_of", "tubes"]
