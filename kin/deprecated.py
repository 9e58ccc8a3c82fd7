"""Old names of `kin`: they work, with a `DeprecationWarning`, until the version in which they go.

A name that gets a better one moves into this table, and goes with the version there (docs/stability.md).
"""

from __future__ import annotations

import operator
import sys
import warnings
from typing import NamedTuple


class Moved(NamedTuple):
    """Where a name has gone.

    Attributes:
        place: the new name below `kin`.
        gone: the version without the old name.
        instead: what to write, where that is more than the new name.
    """

    place: str
    gone: str = "1.1"
    instead: str = ""


MOVED = {
    "CapabilityBlock": Moved("workspace.CapabilityBlock"),
    "CapabilityGrid": Moved("workspace.CapabilityGrid"),
    "capability_block": Moved("workspace.capability_block"),
    "capability_grid": Moved("workspace.capability_grid"),
    "capability_join": Moved("workspace.capability_join"),
    "configuration_at": Moved("workspace_configurations"),
    "convert": Moved("convert_dh"),
    "from_position_wxyz": Moved("pose_from_position_wxyz"),
    "from_xyz_rpy": Moved("pose_from_xyz_rpy"),
    "limits_of": Moved("motion_limits"),
    "load_folder": Moved("load_robots"),
    "match_poses": Moved("motor_poses"),
    "q_of_readings": Moved("q_from_readings"),
    "readings_of_q": Moved("readings_from_q"),
    "readings_of_ticks": Moved("readings_from_ticks"),
    "section": Moved("workspace_section"),
    "self_distance": Moved("clearance"),
    "ticks_of_readings": Moved("ticks_from_readings"),
    "to_mjcf": Moved("robot_to_mjcf"),
    "to_urdf": Moved("robot_to_urdf"),
    "warm_up_rest": Moved("warmup.warm_up_rest", instead="warm_up(everything=True)"),
}


def moved(name: str) -> object:
    """What an old name stands for; warns the line that uses it."""
    to = MOVED[name]
    text = f"kin.{name} is now kin.{to.instead or to.place}; the old name goes with version {to.gone}"
    warnings.warn(text, DeprecationWarning, stacklevel=3)
    found: object = operator.attrgetter(to.place)(sys.modules["kin"])
    return found
