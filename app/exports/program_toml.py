"""A program as a file (TOML), which the page, the command line and Python read."""

from __future__ import annotations

import json

from kin.motion import Program, program_to_dict


def toml_of(program: Program, robot_name: str) -> str:
    """The program in metres and radians, digit by digit; `kin.parse_program` reads it."""
    data = program_to_dict(program)
    segments = data.pop("segments")
    lines = [f"# A program for {' '.join(robot_name.split())}", *_fields(data)]
    lines.append('units = { length = "m", angle = "rad" }')
    for segment in segments:
        lines += ["", "[[segments]]", *_fields(segment)]
    return "\n".join(lines) + "\n"


def _fields(data: dict[str, object]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in data.items()]


def _value(value: object) -> str:
    """Strings and numbers are written in TOML as in JSON; points of a spline are tables."""
    if isinstance(value, dict):
        return "{ " + ", ".join(_fields(value)) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
