"""Postures of a pose: how many there are where, and whether one turns into another without a singularity."""

from kin.postures.maps import MapPlane, PostureCurve, PostureMap, PostureRegion, posture_map
from kin.postures.verdicts import Cuspidality, cuspidal

__all__ = ["Cuspidality", "MapPlane", "PostureCurve", "PostureMap", "PostureRegion", "cuspidal", "posture_map"]
