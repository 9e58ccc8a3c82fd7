"""Arguments of the commands that compute something about one configuration, pose or motion."""

from __future__ import annotations

from argparse import ArgumentParser
from typing import Any

from app.cli.arguments.options import UNITS_NOTE, add_options
from app.cli.arguments.shared import XYZ, add_dask
from app.shared.options import declared

POSE_FORMS = (
    *("wxyz", "xyzw", "rpy", "rotvec", "zyz", "axis", "matrix", "kuka", "fanuc", "abb", "ur", "polyscope"),
    *("staubli", "yaskawa", "doosan", "kawasaki", "denso", "mitsubishi"),
)


def add_fk(parser: ArgumentParser) -> None:
    """Forward kinematics: tool pose for joint values."""
    q = parser.add_argument("q", nargs="+", metavar="Q", help=f"joint values, {UNITS_NOTE}")
    q.required = False  # with nargs="*", argparse would take no values where options stand before them
    _add_form(parser, "print poses in this form; with --configurations, the columns of a table")
    _add_rows(
        parser,
        "--configurations",
        "many configurations, in radians (metres; --pendant: as shown): a table (CSV or Parquet) with the columns "
        "q1, q2, …, a .npy array (k, n), or JSON lines",
        "the poses: x, y, z, qw, qx, qy, qz in metres, an array (k, 4, 4), or answers of REST",
    )
    parser.add_argument("--frames", action="store_true", help="also print the frame after every DH row")
    parser.add_argument(
        "--frame",
        default="world",
        metavar="NAME",
        help="print poses in this frame: world (default), base (of the first DH row), or a workpiece",
    )


def add_ik(parser: ArgumentParser) -> None:
    """Inverse kinematics: joint values for a tool pose."""
    parser.usage = (
        "kinboard ik ROBOT (--position X Y Z [--wxyz W X Y Z | --rpy ROLL PITCH YAW | --approach X Y Z] | "
        "--pose TEXT [--form FORM] | --targets FILE [-o FILE]) [options]"
    )
    _add_target(parser)
    parser.add_argument(
        "--seed", nargs="+", metavar="Q", help=f"prefer solutions near this configuration; {UNITS_NOTE}"
    )
    # Those above, and one with another meaning.
    shown = {"task", "mask", "mask_frame", "limits", "locked", "wider_limits", "respect_limits"}
    add_options(parser, [name for name in declared() if name not in shown])
    parser.add_argument("--all", action="store_true", help="print all solutions, not only the best")
    parser.add_argument("--ignore-limits", action="store_true", help="also solutions outside the joint limits")


def _add_form(parser: ArgumentParser, about: str) -> None:
    """The argument that names the form of poses."""
    parser.add_argument("--form", choices=POSE_FORMS, help=f"{about}: a notation, or a maker's in its own units")


def _add_target(parser: ArgumentParser) -> None:
    """The arguments of ``ik`` that say what the tool has to match."""
    place = parser.add_mutually_exclusive_group(required=True)
    place.add_argument("--position", nargs=3, metavar=XYZ, help="millimetres (--rad: metres)")
    place.add_argument(
        "--pose",
        nargs="+",
        metavar="TEXT",
        help="the target as it is typed in the page, or as it stands on a maker's pendant or in its programs: "
        "x y z roll pitch yaw, p[x, y, z, rx, ry, rz], kuka X 600 Y 100 Z 300 A 0 B 90 C 0",
    )
    _add_form(parser, "how the numbers of --pose, or the columns of the table of --targets, are meant")
    _add_rows(
        parser,
        "--targets",
        "many targets, in metres: a table (CSV or Parquet) with the columns x, y, z, qw, qx, qy, qz, a .npy array "
        "of poses (k, 4, 4), or JSON lines with targets of REST",
        "the best solutions in radians (metres): a table with the status, an array (k, n) with NaN where there is "
        "none, or answers of REST. A run from a .csv, .npy or .parquet file to another that was interrupted is "
        "continued by the same command",
        place,
    )
    add_dask(parser)
    turn = parser.add_mutually_exclusive_group()
    turn.add_argument("--wxyz", nargs=4, metavar=("W", *XYZ), help="orientation as a quaternion")
    turn.add_argument("--xyzw", nargs=4, metavar=(*XYZ, "W"), help="the same, scalar last")
    turn.add_argument("--rpy", nargs=3, metavar=("ROLL", "PITCH", "YAW"), help="Rz(yaw) Ry(pitch) Rx(roll)")
    turn.add_argument("--rotvec", nargs=3, metavar=("RX", "RY", "RZ"), help="rotation vector: axis times angle")
    turn.add_argument("--approach", nargs=3, metavar=XYZ, help="direction of the tool's z axis")
    parser.add_argument(
        "--frame",
        default="world",
        metavar="NAME",
        help="frame in which the target is: world (default), base (of the first DH row), tool (where the tool is "
        "at --seed), or a workpiece",
    )
    add_options(parser, ["task", "mask", "mask_frame"], task=None)


def _add_rows(parser: ArgumentParser, flag: str, read: str, written: str, group: Any = None) -> None:
    """The arguments for many rows at once: where they are read from, and where the answers go."""
    (group or parser).add_argument(flag, metavar="FILE", help=f"{read}; - is standard input")
    parser.add_argument(
        "-o", "--output", metavar="FILE", help=f"with {flag}: write {written}; - is standard output (default)"
    )
    parser.add_argument(
        "--format",
        choices=("csv", "npy", "ndjson"),
        help=f"with {flag}: what is written (default: by the name of the file; for -, what is read)",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help=f"with {flag}: end at the first row that cannot be read. By default all others are answered, and it "
        "gets the reason",
    )


def add_move(parser: ArgumentParser) -> None:
    """Motion of a program: timed joint values along PTP, LIN and CIRC segments."""
    program = parser.add_argument(
        "program", metavar="PROGRAM", help="program (TOML or JSON), with its own units; - is standard input"
    )
    program.required = False  # there may be --programs
    parser.add_argument(
        "--programs",
        metavar="FILE",
        help="many programs: JSON lines; the answers of REST are written as JSON lines; - is standard input",
    )
    parser.add_argument(
        "--start",
        nargs="+",
        metavar="Q",
        help=f"where the arm is (default: its home configuration); {UNITS_NOTE}",
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="write the motion in radians and metres; - is standard output"
    )
    parser.add_argument(
        "--format",
        choices=(
            *("csv", "csv-commented", "json", "ndjson", "trajectory-yaml", "trajectory-json", "mcap"),
            *("urscript", "python"),
        ),
        help="format of the file (default: by the ending of its name)",
    )
    parser.add_argument(
        "--joint-names",
        nargs="+",
        metavar="NAME",
        help="with -o: what the file calls the joints, such as the names of a ROS driver (default: those of "
        "the arm)",
    )
    parser.add_argument(
        "--partial",
        action="store_true",
        help="if the program cannot be driven, write its beginning that can; the exit code stays 1",
    )
    parser.add_argument("--rate", default="100", help="samples per second (default 100)")
    parser.add_argument("--no-samples", action="store_true", help="with --json, --programs: leave out the samples")
    parser.add_argument("--picture", metavar="FILE", help="draw joint values and speeds over time (SVG)")
    add_options(parser, ["avoid_self_collision", "obstacles"])


def add_way(parser: ArgumentParser) -> None:
    """A way around obstacles: waypoints between which nothing touches."""
    parser.add_argument("--goal", nargs="+", metavar="Q", required=True, help=f"joint values; {UNITS_NOTE}")
    parser.add_argument(
        "--start",
        nargs="+",
        metavar="Q",
        help=f"where the arm is (default: its home configuration); {UNITS_NOTE}",
    )
    parser.add_argument("--seed", default="0", help="of the random search (default 0)")
    parser.add_argument("--time-limit", default="5", metavar="S", help="seconds for the search (default 5)")
    parser.add_argument("-o", "--output", metavar="FILE", help="write the program (TOML); - is standard output")
    add_options(parser, ["avoid_self_collision", "obstacles"])


def add_singularity(parser: ArgumentParser) -> None:
    """The way out of a singularity: the motion of the joints with which the tool deviates least."""
    parser.add_argument("q", nargs="+", metavar="Q", help=f"where the arm is: joint values, {UNITS_NOTE}")
    parser.add_argument(
        "--margin",
        metavar="SIGMA",
        help="smallest singular value at the end, at least (default 0.03, or half of the arm's usual one)",
    )
    add_options(parser, ["avoid_self_collision", "obstacles"])
