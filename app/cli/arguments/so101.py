"""Arguments of ``kinboard so101``."""

from __future__ import annotations

import argparse
import os
from typing import Any

from app.cli.arguments.shared import Parents

SPEED = 20.0  # deg/s


def positive(text: str) -> float:
    """A number above 0."""
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise ValueError
    return value


positive.__name__ = "number above 0"  # argparse reports "invalid <name> value"


def add_so101(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard so101``."""
    about = "an SO-100 or SO-101 beside its model in a page; it follows the page once you say so"
    parser: argparse.ArgumentParser = commands.add_parser("so101", parents=[parents.robots], help=about)
    parser.add_argument(
        "robot", metavar="ROBOT", nargs="?", default="so101", help="id of the arm, or a robot file (default so101)"
    )
    parser.add_argument(
        "--port", help="serial port, such as /dev/ttyACM0 or COM3; sim: a simulated arm (default: the one on USB)"
    )
    parser.add_argument(
        "--calibration", metavar="FILE.json", help="of this arm, by LeRobot (default: the one in LeRobot's folder)"
    )
    parser.add_argument(
        "--speed", type=positive, default=SPEED, help=f"of a joint, deg/s, at most (default {SPEED:g})"
    )
    parser.add_argument("--release", action="store_true", help="switch the motors off at the end")
    parser.add_argument("--seconds", type=positive, help="end after this time")
    parser.add_argument(
        "--code", help="of a page that is open: tab Program, Connect a program (default: a new page)"
    )
    parser.add_argument(
        "--address", default="http://localhost:8000", help="with --code: of its service (default %(default)s)"
    )
    parser.add_argument(
        "--token",
        default=os.environ.get("KINBOARD_TOKEN"),
        help="with --code: access token of its service, if it needs one (default: KINBOARD_TOKEN)",
    )
    return parser
