"""Motions over time as files of the tab."""

from __future__ import annotations

from app.exports.motion import FORMATS
from kin import InputError
from kin.motion import Motion
from kin.units import general

MOTIONS: dict[str, str] = {
    "csv-commented": "CSV",
    "trajectory-yaml": "ROS YAML",
    "trajectory-json": "ROS JSON",
    "mcap": "MCAP",
    "urscript": "URScript",
}
RATE, MOST_SAMPLES = 100.0, 30_000  # samples per second, and in all: a longer motion has fewer per second


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
