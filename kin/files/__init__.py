"""Robot files: the only part of the core that reads and writes files.

A file states its units, so a table can be copied as its source prints it::

    id = "my-arm"
    name = "My arm"
    source = "where the numbers come from"
    convention = "standard"            # or "modified" (Craig)
    units = { length = "mm", angle = "deg" }

    [[rows]]
    name = "shoulder"
    kind = "revolute"                  # or "prismatic", "fixed"
    theta = 0
    d = 130
    a = 70
    alpha = -90
    limits = [0, 180]

    [home]
    q = [90]

Only ``id``, ``name``, ``source``, ``convention``, ``units`` and ``rows`` are required; in a row, a missing number
is zero. Without ``limits`` a revolute joint turns ±180° and a prismatic one slides 0 to 1 m; ``limits = "none"``
leaves a revolute joint unlimited. ``velocity``, ``acceleration``, ``jerk`` and ``effort`` are optional. Without
``home`` the arm starts in the middle of its limits, or bent if that configuration is singular
(:mod:`kin.files.home`). ``base`` and ``tool`` are tables ``{ xyz = [x, y, z], rpy = [roll, pitch, yaw] }`` or
``{ matrix = [[…], […], […], […]] }``. ``mounting`` is what the arm is mounted on, and ``floor`` the height of the
floor in the world frame: drawings use them, kinematics does not. A number may be a text with a unit of its own,
``"0.13 m"``.

The same fields as a dict (:func:`robot_from_dict`, :func:`robot_to_dict`) are what REST and the page exchange.

An error raises `RobotFileError` with the file, the field, the value and what would be valid.
"""

from kin.files.builtin import builtin_robots, classic_robots, get_robot
from kin.files.load import load_robot
from kin.files.mjcf.write import robot_to_mjcf
from kin.files.read import load_robots, parse_robot, robot_from_dict
from kin.files.urdf.read import UrdfReport, UrdfRobot, read_urdf, urdf_tips
from kin.files.urdf.write import robot_to_urdf
from kin.files.write import robot_to_dict, robot_to_toml, save_robot

__all__ = [
    "UrdfReport",
    "UrdfRobot",
    "builtin_robots",
    "classic_robots",
    "get_robot",
    "load_robot",
    "load_robots",
    "parse_robot",
    "read_urdf",
    "robot_from_dict",
    "robot_to_dict",
    "robot_to_mjcf",
    "robot_to_toml",
    "robot_to_urdf",
    "save_robot",
    "urdf_tips",
]
