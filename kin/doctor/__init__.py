"""A doctor for URDFs: what is read, what is left out and why, what is suspicious, and how it is mended."""

from kin.doctor.examine import examine_urdf
from kin.doctor.findings import UrdfExamination, UrdfFinding

__all__ = ["UrdfExamination", "UrdfFinding", "examine_urdf"]
