"""Arguments of every command. Imports nothing heavy, so that help and usage errors appear at once."""

from __future__ import annotations

import argparse
from typing import Any

from app.cli.arguments.options import UNITS_NOTE, add_options
from app.cli.arguments.shared import Parents
from app.cli.arguments.values import count, whole_number
from app.shared.options import declared

ROBOT_HELP = "id of the robot (`kinboard robots` lists them), or a robot file (*.toml, *.urdf)"
XYZ = ("X", "Y", "Z")
SHELLS = ("bash", "zsh", "fish")
POSE_FORMS = (
    *("wxyz", "xyzw", "rpy", "rotvec", "zyz", "axis", "matrix", "kuka", "fanuc", "abb", "ur", "polyscope"),
    *("staubli", "yaskawa", "doosan", "kawasaki", "denso", "mitsubishi"),
)


def _command(
    commands: Any,
    name: str,
    about: str,
    *parents: argparse.ArgumentParser,
    takes_robot: bool = True,
    usage: str | None = None,
) -> argparse.ArgumentParser:
    """A new command; its first argument is a robot unless `takes_robot` is false."""
    parser: argparse.ArgumentParser = commands.add_parser(name, parents=parents, help=about, usage=usage)
    if takes_robot:
        parser.add_argument("robot", metavar="ROBOT", help=ROBOT_HELP)
    return parser


def add_serve(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard serve``."""
    parser = _command(
        commands,
        "serve",
        "serve the dashboard and the REST interface (default)",
        parents.robots,
        takes_robot=False,
    )
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
    return parser


def add_open(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard open``."""
    about = "open a page in the browser, and print the code with which a program connects to it"
    parser = _command(commands, "open", about, parents.robots, takes_robot=False)
    parser.add_argument("robot", metavar="ROBOT", nargs="?", help=f"{ROBOT_HELP}; default: that of a new page")
    return parser


def add_fk(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard fk``."""
    parser = _command(
        commands,
        "fk",
        "forward kinematics: tool pose for joint values",
        parents.robots,
        parents.output,
        parents.pendant,
        parents.frames,
    )
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
    return parser


def add_ik(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard ik``."""
    parser = _command(
        commands,
        "ik",
        "inverse kinematics: joint values for a tool pose",
        parents.robots,
        parents.output,
        parents.pendant,
        parents.joints,
        parents.frames,
        usage="kinboard ik ROBOT (--position X Y Z [--wxyz W X Y Z | --rpy ROLL PITCH YAW | --approach X Y Z] | "
        "--pose TEXT [--form FORM] | --targets FILE [-o FILE]) [options]",
    )
    _add_target(parser)
    parser.add_argument(
        "--seed",
        nargs="+",
        metavar="Q",
        help=f"prefer solutions near this configuration; {UNITS_NOTE}",
    )
    shown = {
        "task",
        "mask",
        "mask_frame",
        "limits",
        "locked",
        "wider_limits",
        "respect_limits",
    }  # above, or with another meaning
    add_options(parser, [name for name in declared() if name not in shown])
    parser.add_argument("--all", action="store_true", help="print all solutions, not only the best")
    parser.add_argument("--ignore-limits", action="store_true", help="also solutions outside the joint limits")
    return parser


def _add_form(parser: argparse.ArgumentParser, about: str) -> None:
    """The argument that names the form of poses."""
    parser.add_argument("--form", choices=POSE_FORMS, help=f"{about}: a notation, or a maker's in its own units")


def _add_dask(parser: argparse.ArgumentParser) -> None:
    """The argument of the commands whose work a cluster can do."""
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="compute on the workers of this Dask scheduler, such as tcp://host:8786; "
        "`pip install 'kinboard[cluster]'` installs what that needs",
    )


def _add_target(parser: argparse.ArgumentParser) -> None:
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
    _add_dask(parser)
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


def _add_rows(parser: argparse.ArgumentParser, flag: str, read: str, written: str, group: Any = None) -> None:
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


def add_move(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard move``."""
    parser = _command(
        commands,
        "move",
        "motion of a program: timed joint values along PTP, LIN and CIRC segments",
        parents.robots,
        parents.output,
        parents.frames,
    )
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
    return parser


def add_way(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard way``."""
    parser = _command(
        commands,
        "way",
        "a way around obstacles: waypoints between which nothing touches",
        parents.robots,
        parents.output,
        parents.mounts,
    )
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
    return parser


def add_page(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard page``."""
    parser = _command(
        commands,
        "page",
        "an arm as one web page that needs no server: sliders, postures, a program",
        parents.robots,
        parents.output,
        parents.mounts,
    )
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
    return parser


def add_code(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard code``."""
    parser = _command(
        commands,
        "code",
        "the forward and inverse kinematics of an arm as one file of C or JavaScript",
        parents.robots,
    )
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
    return parser


def add_robots(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard robots``."""
    parser = _command(
        commands, "robots", "list the robots, or describe one", parents.robots, parents.output, takes_robot=False
    )
    parser.add_argument("robot", nargs="?", metavar="ROBOT", help="id of the robot to describe")
    parser.add_argument(
        "--find",
        metavar="WORDS",
        default="",
        help="list only robots that all words fit: a part of id, name, maker or solver, joints:6, reach:0.5..1.2, "
        "maker:kuka, solver:wrist6",
    )
    return parser


def add_compare(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard compare``."""
    parser = _command(
        commands,
        "compare",
        "compare two arms: are they the same, and what was mistyped if not?",
        parents.robots,
        parents.output,
        takes_robot=False,
    )
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
    return parser


def add_workspace(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard workspace``."""
    parser = _command(
        commands,
        "workspace",
        "size of the set of points the tool reaches; with -o a point cloud as a file",
        parents.robots,
        parents.output,
        parents.joints,
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="write a point cloud in metres to this file; - is standard output"
    )
    parser.add_argument(
        "--picture", metavar="FILE", help="draw the cloud along the three axes, and the section (SVG)"
    )
    parser.add_argument(
        "--hull", metavar="FILE", help="write the convex hull of the cloud as a solid: stl, ply, obj, off, glb"
    )
    parser.add_argument(
        "--format",
        choices=("csv", "npz", "ply", "ndjson", "bin"),
        help="format of the point cloud (default: by the ending of its name)",
    )
    parser.add_argument("-n", type=count, default=100_000, help="number of points, such as 1e6 (default 100000)")
    parser.add_argument("--seed", type=whole_number, default=0, help="equal seeds give equal clouds (default 0)")
    parser.add_argument(
        "--strategy",
        choices=("uniform", "quasi", "volume", "boundary"),
        default="uniform",
        help="uniform: joints sampled uniformly (default); quasi: more evenly; volume: points even in space; "
        "boundary: points on the envelope",
    )
    parser.add_argument(
        "--measure",
        choices=("manipulability", "limit_margin", "limits"),
        action="append",
        default=[],
        help="add a column: manipulability, or limit_margin (older name: limits), the relative distance to the "
        "nearest joint limit (0 to 1); may be repeated",
    )
    parser.add_argument("--q", action="store_true", help="add the joint values, in radians (metres)")
    parser.add_argument(
        "--progress",
        action=argparse.BooleanOptionalAction,
        help="show progress on standard error (default: if that is a terminal)",
    )
    parser.add_argument(
        "--effort", type=whole_number, default=4, help="2 to 64: precision of volume and surface (default 4)"
    )
    return parser


def add_bench(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard bench``."""
    parser = _command(
        commands,
        "bench",
        "compare the speed with other libraries; `pip install 'kinboard[bench]'` installs them",
        takes_robot=False,
    )
    parser.add_argument("--quick", action="store_true", help="fewer targets and rounds: some two minutes")
    parser.add_argument("--rows", nargs="+", metavar="ROW", help="only these rows, such as fk ik-pioneer5")
    parser.add_argument("--peers", nargs="+", metavar="PEER", help="only these libraries, or none")
    parser.add_argument(
        "--cpu-time", action="store_true", help="measure processor time instead of wall time, for a busy machine"
    )
    parser.add_argument("--json", metavar="FILE", help="write all measurements to this file")
    parser.add_argument("--picture", metavar="FILE", help="write a picture of the ratios to this file (SVG)")
    parser.add_argument("--html", metavar="FILE", help="write a page to this file, and its JSON beside it")
    return parser


def add_check(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard check``."""
    about = "validate an arm, an exercise, a course or the texts of a lesson"
    parser = _command(commands, "check", about, parents.robots, parents.output, takes_robot=False)
    parser.add_argument("file", metavar="FILE", help="robot, exercise, course or lesson (*.toml), *.urdf, *.xacro")
    _add_links(parser)
    return parser


def add_import(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard import``."""
    parser = _command(commands, "import", "read an arm from a URDF or MJCF as a robot file", takes_robot=False)
    parser.add_argument("file", metavar="FILE", help="URDF, MJCF, or xacro (*.xacro, with kinboard[xacro])")
    _add_links(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help="write the robot file and print a report")
    parser.add_argument("--json", action="store_true", help="print the arm and the report as JSON")
    return parser


def add_motors(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard motors``."""
    parser = _command(
        commands,
        "motors",
        "signs and zeros of an arm's motors, from what they read in two or three poses",
        parents.robots,
        parents.output,
    )
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
    return parser


def add_doctor(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard doctor``."""
    parser = _command(commands, "doctor", "find what is wrong in a URDF, and mend it", takes_robot=False)
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
    return parser


def _add_links(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--base", metavar="LINK", help="link of the URDF that is the base (default: the root)")
    parser.add_argument("--tip", metavar="LINK", help="link of the URDF that is the tool, if several are possible")
    parser.add_argument("--arg", action="append", default=[], metavar="NAME:=VALUE", help="argument of the xacro")
    parser.add_argument(
        "--folder", metavar="DIR", help="where the packages of the xacro are; none is read outside"
    )


def add_export(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard export``."""
    parser = _command(commands, "export", "an arm as a robot file, URDF or MJCF", parents.robots)
    parser.add_argument(
        "--format",
        choices=("toml", "urdf", "mjcf", "dh", "mdh"),
        default="toml",
        help="toml: robot file (default); dh, mdh: the same in the standard or the modified convention; "
        "urdf: URDF without bodies; mjcf: for MuJoCo, with capsules and assumed masses",
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write to this file (default: standard output)")
    return parser


def add_capability(commands: Any, parents: Parents) -> argparse.ArgumentParser:
    """``kinboard capability``."""
    parser = _command(
        commands,
        "capability",
        "capability map: from which directions the tool reaches each place",
        parents.robots,
        parents.output,
        parents.joints,
    )
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--voxel", metavar="SIDE", help="side of a voxel, millimetres (--rad: metres)")
    size.add_argument(
        "--resolution",
        type=whole_number,
        default=25,
        metavar="N",
        help="voxels along the longest side (default 25)",
    )
    parser.add_argument(
        "--directions",
        type=whole_number,
        default=48,
        metavar="N",
        help="directions per voxel: 12, 24, 48 (default) or 96",
    )
    _add_dask(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help="write the map to a file: .npz, .ply or .csv")
    return parser


def add_completion(commands: Any, _: Parents) -> argparse.ArgumentParser:
    """``kinboard completion``."""
    about = "print a script with which a shell completes commands, options and robots"
    parser = _command(commands, "completion", about, takes_robot=False)
    parser.add_argument("shell", choices=SHELLS, metavar="SHELL", help="bash, zsh or fish")
    return parser
