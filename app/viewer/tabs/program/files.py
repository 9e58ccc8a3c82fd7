"""Files of the tab: programs that are opened, and motions over time that are saved."""

from __future__ import annotations

from app.exports.motion import FORMATS
from app.viewer.own_arm import clean
from kin import InputError, Robot
from kin.motion import Motion, Program, parse_program
from kin.units import general

MOTIONS: dict[str, str] = {
    "csv-commented": "CSV",
    "trajectory-yaml": "ROS YAML",
    "trajectory-json": "ROS JSON",
    "mcap": "MCAP",
    "urscript": "URScript",
}
RATE, MOST_SAMPLES = 100.0, 30_000  # samples per second, and in all: a longer motion has fewer per second
LARGEST = 30_000  # bytes of a file: it comes in one message of the page


def motion_file(motion: Motion, name: object) -> tuple[str, bytes, str]:
    """Name and bytes of a motion over time in one of `MOTIONS`, and how it is sampled, in a sentence.

    Raises:
        InputError: another format, one that the arm does not fit, or one whose package is not installed.
    """
    if not isinstance(name, str) or name not in MOTIONS:
        raise InputError("format", name, "one of " + ", ".join(MOTIONS))
    kind = FORMATS[name]
    rate = min(RATE, MOST_SAMPLES / max(motion.duration, 1e-9))
    data = b"".join(kind.pieces(motion, rate))
    sampled = "" if name == "urscript" else f"{general(rate, 4)} samples per second. "
    return f"{motion.robot.id}-motion{kind.suffix}", data, sampled


def read(value: object, robot: Robot) -> tuple[str, Program]:
    """Name and program of a file that the page sends; raises `kin.InputError`."""
    match value:
        case [str(name), str(text)] if len(text) <= LARGEST:
            return clean(name, 60) or "program", parse_program(text, robot)
        case [str(name), None]:
            raise InputError("file", clean(name, 60), f"a file of at most {LARGEST // 1000} kB")
    raise InputError("upload", value, "the name and the text of a file")
