"""Arguments of the commands about an arm itself: its file, its code, its motors, its errors."""

from __future__ import annotations

from argparse import ArgumentParser

from app.cli.arguments.options import UNITS_NOTE, add_options
from app.cli.arguments.shared import XYZ
from app.cli.arguments.values import frame, whole_number


def add_robots(parser: ArgumentParser) -> None:
    """List the robots, or describe one."""
    parser.add_argument("robot", nargs="?", metavar="ROBOT", help="id of the robot to describe")
    parser.add_argument(
        "--find",
        metavar="WORDS",
        default="",
        help="list only robots that all words fit: a part of id, name, maker or solver, joints:6, reach:0.5..1.2, "
        "maker:kuka, solver:wrist6",
    )


def add_page(parser: ArgumentParser) -> None:
    """An arm as one web page that needs no server: sliders, postures, a program."""
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="file to write (default: ROBOT.html); - is standard output"
    )
    parser.add_argument(
        "--q", nargs="+", metavar="Q", help=f"joint values to open with (default: home); {UNITS_NOTE}"
    )
    parser.add_argument(
        "--target",
        nargs=6,
        metavar=(*XYZ, "ROLL", "PITCH", "YAW"),
        help=f"pose of the tool whose postures can be stepped through; {UNITS_NOTE}",
    )
    parser.add_argument("--program", metavar="FILE", help="program to play (TOML), with its own units")
    parser.add_argument("--link", metavar="URL", default="", help="address of the full page, which the file names")
    add_options(parser, ["obstacles"])


def add_code(parser: ArgumentParser) -> None:
    """The forward and inverse kinematics of an arm as one file of C or JavaScript."""
    parser.add_argument(
        "--language",
        choices=("c", "js", "mjs", "d.ts", "c-test"),
        default="c",
        help="c: C99, and C++ (default); js: a script; mjs: an ES module; d.ts: its types; "
        "c-test: a C file that checks the one in C",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="file to write (default: NAME.c, NAME_test.c or the like); - is standard output",
    )
    parser.add_argument(
        "--name",
        metavar="NAME",
        help="what the names in it begin with (default: the arm's id, with _ for each hyphen)",
    )
    parser.add_argument(
        "--no-closest", action="store_true", help="leave out what comes closest to a pose that cannot be reached"
    )


def add_check(parser: ArgumentParser) -> None:
    """Validate an arm, an exercise, a course or the texts of a lesson."""
    parser.add_argument("file", metavar="FILE", help="robot, exercise, course or lesson (*.toml), *.urdf, *.xacro")
    _add_links(parser)


def add_compare(parser: ArgumentParser) -> None:
    """Compare two arms: are they the same, and what was mistyped if not?"""
    for name, about in (("reference", "the arm that is right"), ("other", "the table in question")):
        parser.add_argument(name, metavar=name.upper(), help=f"{about}: an id, or a file (*.toml or *.urdf)")
    parser.add_argument(
        "--free", action="store_true", help="base, tool and zeros of joints may differ: they are no mistakes"
    )
    parser.add_argument(
        "--tolerance",
        nargs=2,
        metavar=("LENGTH", "ANGLE"),
        help=f"largest difference of the poses of arms that count as close; {UNITS_NOTE}",
    )


def add_motors(parser: ArgumentParser) -> None:
    """Signs and zeros of an arm's motors, from what they read in two or three poses."""
    parser.add_argument(
        "--read",
        nargs="+",
        action="append",
        default=[],
        metavar="NUMBER",
        help="what the motors read in a pose, in their order and units; once for each pose. Without it, poses are "
        "proposed",
    )
    parser.add_argument(
        "--pose",
        nargs="+",
        action="append",
        default=[],
        metavar="VALUE",
        help=f"the joint values of a pose, once for each --read (default: the proposed poses); {UNITS_NOTE}",
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write the arm with these motors as a robot file")


def add_calibrate(parser: ArgumentParser) -> None:
    """The table of your own arm, from touches of a pin, a bar or a printed sheet."""
    touches = parser.add_argument(
        "touches",
        metavar="TOUCHES",
        help="what the joints read: a table (CSV or Parquet) with the columns socket (from 1; 0: the plane), q1, "
        "q2, … in radians (metres), or these numbers alone; -: standard input. Without it, postures are proposed",
    )
    touches.required = False  # with nargs="?", argparse would take no file where options stand before it
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


def add_doctor(parser: ArgumentParser) -> None:
    """Find what is wrong in a URDF, and mend it."""
    parser.add_argument("file", metavar="FILE", help="URDF, or xacro (*.xacro, with kinboard[xacro])")
    _add_links(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help="write the mended URDF")
    parser.add_argument(
        "--mend",
        type=whole_number,
        nargs="+",
        metavar="N",
        help="mend only the findings with these numbers (default: all)",
    )
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")


def add_import(parser: ArgumentParser) -> None:
    """Read an arm from a URDF or MJCF as a robot file."""
    parser.add_argument("file", metavar="FILE", help="URDF, MJCF, or xacro (*.xacro, with kinboard[xacro])")
    _add_links(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help="write the robot file and print a report")
    parser.add_argument("--json", action="store_true", help="print the arm and the report as JSON")


def _add_links(parser: ArgumentParser) -> None:
    parser.add_argument("--base", metavar="LINK", help="link of the URDF that is the base (default: the root)")
    parser.add_argument("--tip", metavar="LINK", help="link of the URDF that is the tool, if several are possible")
    parser.add_argument("--arg", action="append", default=[], metavar="NAME:=VALUE", help="argument of the xacro")
    parser.add_argument(
        "--folder", metavar="DIR", help="where the packages of the xacro are; none is read outside"
    )


def add_export(parser: ArgumentParser) -> None:
    """An arm as a robot file, URDF or MJCF."""
    parser.add_argument(
        "--format",
        choices=("toml", "urdf", "mjcf", "dh", "mdh"),
        default="toml",
        help="toml: robot file (default); dh, mdh: the same in the standard or the modified convention; "
        "urdf: URDF without bodies; mjcf: for MuJoCo, with capsules and assumed masses",
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write to this file (default: standard output)")
