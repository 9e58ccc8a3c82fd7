"""A program as a file (TOML), which the page, the command line and Python read."""

from __future__ import annotations

from kin.motion import Program, program_to_dict
from kin.parsing import to_toml


def toml_of(program: Program, robot_name: str) -> str:
    """The program in metres and radians, digit by digit; `kin.motion.parse_program` reads it."""
    data = to_toml({"units": {"length": "m", "angle": "rad"}, **program_to_dict(program)})
    return f"# A program for {' '.join(robot_name.split())}\n{data}"
