"""Arguments of the commands that serve, and of those about this program."""

from __future__ import annotations

import os
from argparse import ArgumentParser

from app.cli.arguments.shared import ROBOT_HELP
from app.cli.arguments.values import positive, whole_number


def add_serve(parser: ArgumentParser) -> None:
    """Serve the dashboard and the REST interface (default)."""
    parser.add_argument("--host", help="address to listen on (default 127.0.0.1)")
    parser.add_argument(
        "--port", type=whole_number, help="port to listen on (default 8000; 0 takes any free port)"
    )
    parser.add_argument(
        "--workers", type=whole_number, metavar="N", help="does nothing any more: see KINBOARD_COMPUTE"
    )
    parser.add_argument("--pin", action="store_true", help="does nothing any more")
    parser.add_argument("--root-path", metavar="PREFIX", help="path prefix that a reverse proxy adds")
    parser.add_argument(
        "--read-only",
        action="store_true",
        default=None,
        help="visitors without the access token (KINBOARD_TOKEN) may look but not move anything",
    )
    parser.add_argument("--open", action="store_true", help="open the dashboard in the browser")


def add_open(parser: ArgumentParser) -> None:
    """Open a page in the browser, and print the code with which a program connects to it."""
    parser.add_argument("robot", metavar="ROBOT", nargs="?", help=f"{ROBOT_HELP}; default: that of a new page")


def add_so101(parser: ArgumentParser) -> None:
    """An SO-100 or SO-101 beside its model in a page; it follows the page once you say so."""
    parser.add_argument(
        "robot", metavar="ROBOT", nargs="?", default="so101", help="id of the arm, or a robot file (default so101)"
    )
    parser.add_argument(
        "--port",
        help="serial port, such as /dev/ttyACM0 or COM3; sim: a simulated arm; sim:missing=3: one with a fault "
        "(default: the one on USB)",
    )
    parser.add_argument(
        "--calibration", metavar="FILE.json", help="of this arm, by LeRobot (default: the one in LeRobot's folder)"
    )
    parser.add_argument("--speed", type=positive, help="of a joint, deg/s, at most (default 20)")
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


def add_mcp(parser: ArgumentParser) -> None:
    """Offer the tools to an agent over standard input and output (Model Context Protocol)."""
    about = "the service whose pages the agent may drive (default %(default)s)"
    parser.add_argument("--url", default="http://localhost:8000", help=about)


def add_bench(parser: ArgumentParser) -> None:
    """Compare the speed with other libraries; `pip install 'kinboard[bench]'` installs them."""
    parser.add_argument("--quick", action="store_true", help="fewer targets and rounds: some two minutes")
    parser.add_argument("--rows", nargs="+", metavar="ROW", help="only these rows, such as fk ik-pioneer5")
    parser.add_argument("--peers", nargs="+", metavar="PEER", help="only these libraries, or none")
    parser.add_argument(
        "--cpu-time", action="store_true", help="measure processor time instead of wall time, for a busy machine"
    )
    parser.add_argument("--json", metavar="FILE", help="write all measurements to this file")
    parser.add_argument("--picture", metavar="FILE", help="write a picture of the ratios to this file (SVG)")
    parser.add_argument("--html", metavar="FILE", help="write a page to this file, and its JSON beside it")


def add_completion(parser: ArgumentParser) -> None:
    """Print a script with which a shell completes commands, options and robots."""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), metavar="SHELL", help="bash, zsh or fish")
