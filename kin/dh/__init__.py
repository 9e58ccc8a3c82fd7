"""DH tables of arms that are described otherwise: by the other convention, by frames, by screws."""

from kin.dh.exponentials import Screws, exp_screw, robot_from_screws, screws
from kin.dh.tables import SAMPLES, convert_dh, largest_difference, table_of_chain

__all__ = [
    "SAMPLES",
    "Screws",
    "convert_dh",
    "exp_screw",
    "largest_difference",
    "robot_from_screws",
    "screws",
    "table_of_chain",
]
