"""Arguments of ``kinboard postures`` and ``kinboard cuspidal``."""

from __future__ import annotations

import argparse
from typing import Any

from app.cli.arguments import ROBOT_HELP, XYZ
from app.cli.arguments.options import UNITS_NOTE
from app.cli.arguments.shared import Parents
from app.cli.arguments.values import count, whole_number


def add_postures(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard postures``."""
    about = "how many postures there are in a section of the task space, or in a plane of two joints"
    parser = _command(commands, "postures", about, parents)
    parser.add_argument(
        "--pose",
        nargs="+",
        metavar="TEXT",
        help="the section contains this point, and the tool keeps this orientation (default: home)",
    )
    parser.add_argument(
        "--normal",
        nargs=3,
        type=float,
        metavar=XYZ,
        help="of the section (default: it contains the base's z axis)",
    )
    parser.add_argument("--joints", nargs=2, metavar="JOINT", help="two joints, whose plane is mapped instead")
    parser.add_argument(
        "--q", nargs="+", metavar="Q", help=f"where the other joints are, then (default: home); {UNITS_NOTE}"
    )
    parser.add_argument(
        "--resolution", type=whole_number, default=60, metavar="N", help="nodes along a side (default 60)"
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write the map to a file: .svg, .png or .csv")
    parser.add_argument("--ignore-limits", action="store_true", help="count postures outside the joint limits too")
    return parser


def add_cuspidal(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard cuspidal``."""
    about = "whether the arm can change its posture without meeting a singularity"
    parser = _command(commands, "cuspidal", about, parents)
    about = "random poses to solve at most, inside the limits and as many again without (default 256)"
    parser.add_argument("--poses", type=count, default=256, metavar="N", help=about)
    parser.add_argument("--seed", type=whole_number, default=0, help="of the search (default 0)")
    return parser


def _command(commands: Any, name: str, about: str, parents: Parents) -> argparse.ArgumentParser:
    shared = [parents.robots, parents.output, parents.joints]
    parser: argparse.ArgumentParser = commands.add_parser(name, parents=shared, help=about)
    parser.add_argument("robot", metavar="ROBOT", help=ROBOT_HELP)
    return parser
