"""Arguments of the classroom's commands. Imports nothing heavy."""

from __future__ import annotations

import argparse
from typing import Any

# A command finds the same database as the service only with the same settings.
_SAME = "If the service was started with KINBOARD_DATA or KINBOARD_DATABASE_URL, set them to the same values here."


def add_room(commands: Any, _: object) -> argparse.ArgumentParser:
    """``kinboard room``."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "room",
        help="open, list and end classrooms",
        description=f"Open, list and end classrooms in the database of the service. {_SAME}",
    )
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True, dest="action")
    opening = actions.add_parser("open", help="open a room and print its code and links")
    opening.add_argument(
        "title", metavar="TITLE", nargs="?", default="", help="shown to students (default: Class)"
    )
    opening.add_argument(
        "--hours",
        default="12",
        metavar="H",
        help="hours until all of it is erased (default: 12)",
    )
    listing = actions.add_parser("list", help="list the rooms")
    for action in (opening, listing):
        action.add_argument(
            "--url",
            default="http://localhost:8000/",
            metavar="URL",
            help="address of the service (default: %(default)s)",
        )
        action.add_argument("--json", action="store_true", help="print JSON")
    ending = actions.add_parser("end", help="end a room and erase everything in it")
    ending.add_argument("code", metavar="CODE", help="the join code")
    return parser


def add_result(commands: Any, _: object) -> argparse.ArgumentParser:
    """``kinboard result``."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "result",
        help="check the result code of a student",
        description="Check a result code with the key of the service. The exit code is 1 if this service has not "
        f"signed it. {_SAME}",
    )
    parser.add_argument("code", metavar="CODE", nargs="+", help="case, spaces and hyphens do not matter")
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser


def add_results(commands: Any, _: object) -> argparse.ArgumentParser:
    """``kinboard results``."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "results",
        help="the answers of a classroom as CSV, one row per attempt",
        description=f"The answers given in a room as CSV, from the database of the service. {_SAME}",
    )
    parser.add_argument("room", metavar="CODE", help="the join code of the room")
    parser.add_argument("-o", "--output", metavar="FILE", help="write to this file (default: standard output)")
    return parser


def add_lti(commands: Any, _: object) -> argparse.ArgumentParser:
    """``kinboard lti``."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "lti",
        help="what a learning platform's administrator must enter",
        description="Print the addresses that the administrator of a learning platform (Moodle, Canvas) must "
        "enter for LTI 1.3; check the file of platforms, and create the service's private key beside it if there "
        "is none.",
    )
    parser.add_argument("file", metavar="FILE", nargs="?", default=None, help="the file of KINBOARD_LTI (*.toml)")
    parser.add_argument(
        "--url",
        default="https://kinboard.example/",
        metavar="URL",
        help="address of the service (default: %(default)s)",
    )
    return parser
