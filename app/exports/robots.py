"""Arms as files: robot files in either convention, URDF, MJCF, and source of their kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import kin
from kin import Robot, robot_to_mjcf, robot_to_toml, robot_to_urdf
from kin.dh import convert_dh


@dataclass(frozen=True)
class RobotFormat:
    """A format of files that hold an arm.

    Attributes:
        meaning: what it is, for people.
        suffix: end of the name of such a file.
        media_type: of the file over HTTP.
    """

    meaning: str
    suffix: str
    media_type: str


# In these, identifiers begin with a name; files of one arm include each other.
SOURCES = {
    "c": RobotFormat("source of forward and inverse kinematics in C99", ".c", "text/x-c"),
    "js": RobotFormat("the same in JavaScript, a script", ".js", "text/javascript"),
    "mjs": RobotFormat("the same as an ES module", ".mjs", "text/javascript"),
    "d.ts": RobotFormat("the types of that module", ".d.ts", "text/plain"),
    "c-test": RobotFormat("a C file that checks the one in C99", "_test.c", "text/x-c"),
}
FORMATS = {
    "toml": RobotFormat("a robot file", ".toml", "application/toml"),
    "urdf": RobotFormat("URDF without bodies", ".urdf", "application/xml"),
    "mjcf": RobotFormat("MJCF for MuJoCo, with capsules and assumed masses", ".xml", "application/xml"),
    "dh": RobotFormat("a robot file in the standard convention", "-standard.toml", "application/toml"),
    "mdh": RobotFormat("a robot file in the modified convention", "-modified.toml", "application/toml"),
    **SOURCES,
}


def file_name(robot: Robot, name: str, begins: str | None = None) -> str:
    """The name of a file in one of `FORMATS`.

    Args:
        name: the format.
        begins: what identifiers in source begin with, by default made of the arm's id.
    """
    if name in SOURCES:
        from kin.codegen.files import name_for

        return name_for(robot, begins) + FORMATS[name].suffix
    return robot.id + FORMATS[name].suffix


def robot_file(robot: Robot, name: str) -> str:
    """The text of a file in one of `FORMATS`; raises `InputError` for an arm that the format cannot describe."""
    if name == "urdf":
        return robot_to_urdf(robot)
    if name == "mjcf":
        return robot_to_mjcf(robot)
    if name == "toml":
        return robot_to_toml(robot)
    if name in SOURCES:
        return kin.generate(robot, name)  # type: ignore[arg-type]  # one of these
    return robot_to_toml(convert_dh(robot, "standard" if name == "dh" else "modified"))
