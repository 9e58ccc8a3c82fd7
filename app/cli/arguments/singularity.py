"""Arguments of ``kinboard singularity``."""

from __future__ import annotations

import argparse
from typing import Any

from app.cli.arguments import ROBOT_HELP
from app.cli.arguments.options import UNITS_NOTE, add_options
from app.cli.arguments.shared import Parents


def add_singularity(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard singularity``."""
    about = "the way out of a singularity: the motion of the joints with which the tool deviates least"
    shared = [parents.robots, parents.output, parents.pendant, parents.mounts]
    parser: argparse.ArgumentParser = commands.add_parser("singularity", parents=shared, help=about)
    parser.add_argument("robot", metavar="ROBOT", help=ROBOT_HELP)
    parser.add_argument("q", nargs="+", metavar="Q", help=f"where the arm is: joint values, {UNITS_NOTE}")
    parser.add_argument(
        "--margin",
        metavar="SIGMA",
        help="smallest singular value at the end, at least (default 0.03, or half of the arm's usual one)",
    )
    add_options(parser, ["avoid_self_collision", "obstacles"])
    return parser
