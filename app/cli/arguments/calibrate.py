"""Arguments of ``kinboard calibrate``."""

from __future__ import annotations

import argparse
from typing import Any

from app.cli.arguments import ROBOT_HELP
from app.cli.arguments.options import UNITS_NOTE
from app.cli.arguments.shared import Parents
from app.cli.arguments.values import frame, whole_number


def add_calibrate(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard calibrate``."""
    about = "the table of your own arm, from touches of a pin, a bar or a printed sheet"
    shared = [parents.robots, parents.output, parents.mounts]
    parser: argparse.ArgumentParser = commands.add_parser("calibrate", parents=shared, help=about)
    parser.add_argument("robot", metavar="ROBOT", help=ROBOT_HELP)
    parser.add_argument(
        "touches",
        nargs="?",
        metavar="TOUCHES",
        help="what the joints read: a table (CSV or Parquet) with the columns socket (from 1; 0: the plane), q1, "
        "q2, … in radians (metres), or these numbers alone; -: standard input. Without it, postures are proposed",
    )
    board = parser.add_mutually_exclusive_group(required=True)
    board.add_argument("--pin", action="store_true", help="one socket, or the point of a pin")
    board.add_argument("--bar", metavar="LENGTH", help="two sockets at this distance, millimetres (--rad: metres)")
    board.add_argument("--sheet", choices=("A5", "A4", "A3"), help="six crosses on a sheet of paper")
    parser.add_argument(
        "--places", type=whole_number, default=1, metavar="N", help="at how many places the board is touched"
    )
    parser.add_argument(
        "--place",
        type=frame,
        action="append",
        metavar="X:Y:Z[:ROLL:PITCH:YAW]",
        default=[],
        help=f"roughly where the board lies, once for each place (default: proposed places); {UNITS_NOTE}",
    )
    parser.add_argument(
        "--marked", action="store_true", help="boards lie at --place to 1 mm and 0.5°: the base is seen as well"
    )
    parser.add_argument("--plane", action="store_true", help="the table is touched as well")
    parser.add_argument("--table", metavar="Z", help="height of the table, millimetres (--rad: metres)")
    parser.add_argument(
        "--plan",
        type=whole_number,
        metavar="N",
        help="propose so many touches (default 20 without TOUCHES; with it, further ones)",
    )
    parser.add_argument("--printed", action="store_true", help="all lengths may be off by one share, up to 0.5 %%")
    parser.add_argument(
        "--waves", action="store_true", help="encoders may have an error of 0.5° that repeats every turn"
    )
    parser.add_argument(
        "--keep-family", action="store_true", help="what is 0 in the table stays 0, and all twists"
    )
    parser.add_argument(
        "--noise", metavar="ANGLE", help="standard deviation of a reading, degrees (--rad: radians)"
    )
    parser.add_argument("--print", metavar="FILE", help="write the sheet of --sheet true to scale (SVG)")
    parser.add_argument("--html", metavar="FILE", help="write the result as one page (HTML)")
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="write the postures (CSV), or the arm found as a robot file (TOML)"
    )
    return parser
