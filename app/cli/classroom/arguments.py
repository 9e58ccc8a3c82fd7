"""Arguments of the classroom's commands. Imports nothing heavy."""

from __future__ import annotations

from argparse import ArgumentParser

# A command finds the same database as the service only with the same settings.
_SAME = "If the service was started with KINBOARD_DATA or KINBOARD_DATABASE_URL, set them to the same values here."


def add_room(parser: ArgumentParser) -> None:
    """Open, list and end classrooms."""
    parser.description = f"Open, list and end classrooms in the database of the service. {_SAME}"
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


def add_result(parser: ArgumentParser) -> None:
    """Check the result code of a student."""
    parser.description = (
        "Check a result code with the key of the service. The exit code is 1 if this service has not "
        f"signed it. {_SAME}"
    )
    parser.add_argument("code", metavar="CODE", nargs="+", help="case, spaces and hyphens do not matter")
    parser.add_argument("--json", action="store_true", help="print JSON")


def add_results(parser: ArgumentParser) -> None:
    """The answers of a classroom as CSV, one row per attempt."""
    parser.description = f"The answers given in a room as CSV, from the database of the service. {_SAME}"
    parser.add_argument("room", metavar="CODE", help="the join code of the room")
    parser.add_argument("-o", "--output", metavar="FILE", help="write to this file (default: standard output)")


def add_lti(parser: ArgumentParser) -> None:
    """What a learning platform's administrator must enter."""
    parser.description = (
        "Print the addresses that the administrator of a learning platform (Moodle, Canvas) must "
        "enter for LTI 1.3; check the file of platforms, and create the service's private key beside it if there "
        "is none."
    )
    parser.add_argument("file", metavar="FILE", nargs="?", default=None, help="the file of KINBOARD_LTI (*.toml)")
    parser.add_argument(
        "--url",
        default="https://kinboard.example/",
        metavar="URL",
        help="address of the service (default: %(default)s)",
    )
