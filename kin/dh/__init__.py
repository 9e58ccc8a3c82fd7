"""DH tables of arms that are described otherwise: by the other convention, by frames, by screws."""

from kin.dh.exponentials import Screws, exp_screw, robot_from_screws, screws
from kin.dh.tables import convert_dh

__all__ = ["Screws", "convert_dh", "exp_screw", "robot_from_screws", "screws"]
