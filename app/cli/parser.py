"""The command line: ``kinboard`` serves the dashboard; the others answer without a server.

``bench`` measures against other libraries. People read and type degrees and millimetres, ``--rad`` makes both
radians and metres; ``--json`` always prints radians and metres, in the shapes REST answers with. Exit codes: 0
answered, 1 no exact answer (``ik``) or the service could not start, 2 bad input.

Nothing heavy is imported before the arguments are known, and each command imports only what it needs.
"""

from __future__ import annotations

import argparse
import gc
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

UNITS_NOTE = "degrees and millimetres, or radians and metres with --rad"
DESCRIPTION = "Kinematics of robot arms: a dashboard in the browser, a REST interface, this command line."
EPILOG = """examples:
  kinboard                                    serve the dashboard on http://localhost:8000/
  kinboard fk pioneer5 90 30 60 30 30
  kinboard ik pioneer5 --position 45 191 -211 --approach -0.31 -0.164 -0.936
  kinboard robots pioneer5 --json
  kinboard workspace pioneer5 -n 1e6 -o cloud.ply
  kinboard check my-arm.toml"""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code; `argv` without the program's name."""
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or (words[0].startswith("-") and words[0] not in ("-h", "--help", "--version")):
        words.insert(0, "serve")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal without θ or · still gets its answer
    try:
        arguments = _parser().parse_args([_not_an_option(word) for word in words])
    except SystemExit as stop:  # argparse has printed its message, or the help
        return stop.code if isinstance(stop.code, int) else 2
    command: Callable[[argparse.Namespace], int] = arguments.command
    try:
        code = command(arguments)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has seen enough, as in `kinboard robots | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _serve(arguments: argparse.Namespace) -> int:
    from pydantic import ValidationError

    from app.shared.settings import Settings

    given = {
        name: getattr(arguments, name)
        for name in ("host", "port", "root_path", "robots", "read_only", "workers", "pin")
    }
    try:
        settings = Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        for item in error.errors():
            name = str(item["loc"][0]) if item["loc"] else "settings"
            where = (
                f"--{name.replace('_', '-')} or KINBOARD_{name.upper()}"
                if name in given
                else f"KINBOARD_{name.upper()}"
            )
            print(f"kinboard: {where}: got {item['input']!r}: {item['msg']}", file=sys.stderr)
        return 2
    with _loading():
        from app.service.main import run

        gc.freeze()  # the collections to come pass over what has been imported, too
    return run(settings, open_browser=arguments.open)


def _fk(arguments: argparse.Namespace) -> int:
    _do_without_compiler()
    with _loading():
        from app.cli import commands

    return _refusing_misuse(commands.fk, arguments)


def _ik(arguments: argparse.Namespace) -> int:
    with _loading():
        from app.cli import commands

    return _refusing_misuse(commands.ik, arguments)


def _robots(arguments: argparse.Namespace) -> int:
    _do_without_compiler()
    with _loading():
        from app.cli import commands

    return _refusing_misuse(commands.robots, arguments)


def _bench(arguments: argparse.Namespace) -> int:
    for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR"):  # read at import: everybody works on one thread
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    from app.bench import command

    return _refusing_misuse(command.bench, arguments)


def _workspace(arguments: argparse.Namespace) -> int:
    from app.cli import commands

    return _refusing_misuse(commands.workspace, arguments)


def _check(arguments: argparse.Namespace) -> int:
    _do_without_compiler()
    with _loading():
        from app.cli import commands

    return _refusing_misuse(commands.check, arguments)


def _capability(arguments: argparse.Namespace) -> int:
    from app.cli import capability as mapping

    return _refusing_misuse(mapping.capability, arguments)


def _refusing_misuse(command: Callable[[argparse.Namespace], int], arguments: argparse.Namespace) -> int:
    from kin import KinematicsError

    try:
        return command(arguments)
    except KinematicsError as error:
        print(f"kinboard: {error}", file=sys.stderr)
        return 2


@contextmanager
def _loading() -> Iterator[None]:
    """For imports: what they make stays, and looking for garbage in it again and again is a tenth of the start."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def _do_without_compiler() -> None:
    """Lets the kernels of this process run as plain Python.

    One pose takes that a tenth of a millisecond; numba's machinery for loading compiled code takes half a second.
    """
    if "numba" not in sys.modules:
        os.environ.setdefault("NUMBA_DISABLE_JIT", "1")


class _Version(argparse.Action):
    """Prints the version, which is only looked up when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        _do_without_compiler()
        from kin import __version__

        print(f"kinboard {__version__}")
        parser.exit()


def _number(text: str) -> float:
    value = float(text.replace("−", "-"))
    if not abs(value) <= 1e6:
        raise argparse.ArgumentTypeError(f"{text.strip()!r} is not a number between -1e6 and 1e6")
    return value


_number.__name__ = "number"  # argparse says "invalid number value"


def _whole(text: str) -> int:
    return int(text.replace("−", "-"))


def _count(text: str) -> int:
    """A whole number, also written as 1e6."""
    value = float(text)
    if not value.is_integer():
        raise ValueError
    return int(value)


def _named_number(text: str) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    return name.strip(), _number(value)


def _named_numbers(text: str) -> tuple[str, list[float]]:
    name, _, values = text.rpartition("=")
    return name.strip(), [_number(value) for value in values.split(":")]


_whole.__name__ = _count.__name__ = "whole number"
_named_number.__name__ = "value"
_named_numbers.__name__ = "value"


def _not_an_option(word: str) -> str:
    """Negative numbers such as -1e-3 look like options to argparse; a leading space tells it otherwise."""
    try:
        float(word)
    except ValueError:
        return word
    return f" {word}" if word.startswith("-") else word


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="kinboard",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--robots", metavar="FOLDER", help="folder with further robot files (*.toml)")
    answers = argparse.ArgumentParser(add_help=False)
    answers.add_argument("--json", action="store_true", help="print the answer as JSON, in radians and metres")
    unit = answers.add_mutually_exclusive_group()
    unit.add_argument(
        "--deg", dest="rad", action="store_false", default=False, help="degrees and millimetres (default)"
    )
    unit.add_argument(
        "--rad", dest="rad", action="store_true", default=False, help="radians and metres, typed and printed"
    )
    region = argparse.ArgumentParser(add_help=False)
    region.add_argument(
        "--lock", type=_named_numbers, action="append", metavar="JOINT=VALUE",
        help=f"keep a joint (counted from 1) at a value; {UNITS_NOTE}",
    )  # fmt: skip
    region.add_argument(
        "--limit", type=_named_numbers, action="append", metavar="JOINT=LOWER:UPPER",
        help=f"narrow the limits of a joint (counted from 1); {UNITS_NOTE}",
    )  # fmt: skip
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    serve = commands.add_parser("serve", parents=[common], help="serve the dashboard and REST (default)")
    serve.add_argument("--host", help="address to listen on (default 127.0.0.1)")
    serve.add_argument("--port", type=int, help="port to listen on (default 8000; 0 takes any free one)")
    serve.add_argument("--workers", type=int, metavar="N", help="processes that serve side by side (default 1)")
    serve.add_argument(
        "--pin", action="store_true", default=None, help="keep each process's interpreter on one processor"
    )
    serve.add_argument("--root-path", metavar="PREFIX", help="path prefix a reverse proxy serves us under")
    serve.add_argument(
        "--read-only", action="store_true", default=None,
        help="whoever has no token (KINBOARD_TOKEN) may look, not touch",
    )  # fmt: skip
    serve.add_argument("--open", action="store_true", help="open the dashboard in the browser")
    serve.set_defaults(command=_serve)

    fk = commands.add_parser("fk", parents=[common, answers], help="pose of the tool for joint values")
    fk.add_argument("robot", metavar="ROBOT", help="id of the robot; `kinboard robots` lists them")
    fk.add_argument("q", type=_number, nargs="+", metavar="Q", help=f"joint values, {UNITS_NOTE}")
    fk.add_argument("--frames", action="store_true", help="also the frame after every DH row")
    fk.set_defaults(command=_fk)

    ik = commands.add_parser(
        "ik",
        parents=[common, answers, region],
        help="joint values for a pose of the tool",
        usage="kinboard ik ROBOT --position X Y Z [--wxyz W X Y Z | --approach X Y Z] [options]",
    )
    ik.add_argument("robot", metavar="ROBOT", help="id of the robot; `kinboard robots` lists them")
    xyz = ("X", "Y", "Z")
    ik.add_argument(
        "--position", type=_number, nargs=3, required=True, metavar=xyz, help="millimetres (--rad: metres)"
    )
    turn = ik.add_mutually_exclusive_group()
    turn.add_argument("--wxyz", type=_number, nargs=4, metavar=("W", *xyz), help="orientation as a quaternion")
    turn.add_argument("--approach", type=_number, nargs=3, metavar=xyz, help="direction of the tool's z axis")
    tasks = ("pose", "approach", "position")
    ik.add_argument("--task", choices=tasks, help="what must be met (default: all that is given)")
    ik.add_argument(
        "--seed", type=_number, nargs="+", metavar="Q", help=f"stay near this configuration; {UNITS_NOTE}"
    )
    ik.add_argument(
        "--redundancy", type=_named_number, action="append", metavar="[NAME=]VALUE",
        help="value of a free parameter of the arm, an angle; may be repeated",
    )  # fmt: skip
    ik.add_argument(
        "--branch", action="append", metavar="NAME",
        help="only this branch: 'elbow up', 'shoulder front · wrist flip', 'seed'; may be repeated",
    )  # fmt: skip
    ik.add_argument(
        "--prefer", choices=("nearest", "limits", "manipulability"), default="nearest",
        help="how to choose and sort: nearest to the seed (default), farthest from the limits, most manipulable",
    )  # fmt: skip
    ik.add_argument(
        "--solver", choices=("auto", "numeric"), default="auto",
        help="numeric: descend from many starts, even where the arm has a closed form",
    )  # fmt: skip
    ik.add_argument(
        "--mask", nargs="+", choices=("x", "y", "z", "rx", "ry", "rz"), metavar="COORDINATE",
        help="instead of a task: which of x y z rx ry rz must be met",
    )  # fmt: skip
    ik.add_argument(
        "--mask-frame", choices=("tool", "base"), default="tool",
        help="frame of the mask's coordinates: the target's own (default) or the base",
    )  # fmt: skip
    ik.add_argument("--all", action="store_true", help="all solutions, not only the nearest")
    ik.add_argument(
        "--images", choices=("nearest", "all"), default="nearest",
        help="with --all: also every whole-turn image inside the limits",
    )  # fmt: skip
    ik.add_argument("--ignore-limits", action="store_true", help="also solutions beyond the joint limits")
    ik.set_defaults(command=_ik)

    robots = commands.add_parser("robots", parents=[common, answers], help="list the robots, or describe one")
    robots.add_argument("robot", nargs="?", metavar="ROBOT", help="describe this one")
    robots.set_defaults(command=_robots)

    workspace = commands.add_parser(
        "workspace",
        parents=[common, answers, region],
        help="sizes of the set of points the tool reaches; with -o a cloud of them as a file",
    )
    workspace.add_argument("robot", metavar="ROBOT", help="id of the robot; `kinboard robots` lists them")
    workspace.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="write a cloud of points in metres to this file; - is standard output",
    )
    workspace.add_argument(
        "--picture", metavar="FILE", help="draw the cloud along the three axes, and the section (SVG)"
    )
    workspace.add_argument(
        "--hull", metavar="FILE", help="write the convex hull of the cloud as a body: stl, ply, obj, off, glb"
    )
    workspace.add_argument(
        "--format", choices=("csv", "npz", "ply", "ndjson", "bin"), help="of that file (default: by its name)"
    )
    workspace.add_argument(
        "-n", type=_count, default=100_000, help="how many points, such as 1e6 (default 100000)"
    )
    workspace.add_argument("--seed", type=_whole, default=0, help="another seed is another cloud (default 0)")
    workspace.add_argument(
        "--strategy", choices=("uniform", "quasi", "volume", "boundary"), default="uniform",
        help="joints drawn evenly (default), more evenly, points even in space, points on the envelope",
    )  # fmt: skip
    workspace.add_argument(
        "--measure", choices=("manipulability", "limits"), action="append", default=[],
        help="a further column: manipulability, or how far the nearest stop is (0 to 1); may be repeated",
    )  # fmt: skip
    workspace.add_argument("--q", action="store_true", help="also the joint values, in radians (metres)")
    workspace.add_argument(
        "--progress", action=argparse.BooleanOptionalAction,
        help="tell on standard error how far it is (default: if that is a terminal)",
    )  # fmt: skip
    workspace.add_argument(
        "--effort", type=_whole, default=4, help="2 to 64: work put into volume and surface (default 4)"
    )
    workspace.set_defaults(command=_workspace)

    bench = commands.add_parser(
        "bench", help="measure against other libraries; `pip install 'kinboard[bench]'` brings them"
    )
    bench.add_argument("--quick", action="store_true", help="fewer targets and rounds: under two minutes")
    bench.add_argument("--rows", nargs="+", metavar="ROW", help="only these rows, such as fk ik-pioneer5")
    bench.add_argument("--peers", nargs="+", metavar="PEER", help="only these libraries, or none")
    bench.add_argument(
        "--cpu-time", action="store_true", help="processor time instead of the wall clock's, on a busy machine"
    )
    bench.add_argument("--json", metavar="FILE", help="write everything measured to this file")
    bench.add_argument("--picture", metavar="FILE", help="write the bars to this file (SVG)")
    bench.set_defaults(command=_bench)

    check = commands.add_parser("check", parents=[answers], help="validate a robot file and tell what the arm is")
    check.add_argument("file", metavar="FILE", help="robot file (*.toml)")
    check.set_defaults(command=_check)
    _add_capability(commands, [common, answers])
    return parser


def _add_capability(commands: Any, parents: list[argparse.ArgumentParser]) -> None:
    capability = commands.add_parser(
        "capability", parents=parents, help="map of the directions from which each place can be approached"
    )
    capability.add_argument("robot", metavar="ROBOT", help="id of the robot; `kinboard robots` lists them")
    size = capability.add_mutually_exclusive_group()
    size.add_argument("--voxel", type=_number, metavar="SIDE", help="side of a voxel, millimetres (--rad: metres)")
    size.add_argument(
        "--resolution", type=int, default=25, metavar="N", help="voxels along the longest side (default 25)"
    )
    capability.add_argument(
        "--directions", type=int, default=48, metavar="N", help="directions per voxel: 12, 24, 48 (default) or 96"
    )
    capability.add_argument(
        "--lock", type=_named_numbers, action="append", metavar="JOINT=VALUE",
        help=f"keep a joint (counted from 1) at a value; {UNITS_NOTE}",
    )  # fmt: skip
    capability.add_argument(
        "--limit", type=_named_numbers, action="append", metavar="JOINT=LOWER:UPPER",
        help=f"narrow the limits of a joint (counted from 1); {UNITS_NOTE}",
    )  # fmt: skip
    capability.add_argument(
        "--dask", metavar="ADDRESS",
        help="let the workers of this Dask scheduler compute, such as tcp://host:8786; "
        "`pip install 'kinboard[cluster]'` brings what that needs",
    )  # fmt: skip
    capability.add_argument("-o", "--output", metavar="FILE", help="write the map to a file: .npz, .ply or .csv")
    capability.set_defaults(command=_capability)
