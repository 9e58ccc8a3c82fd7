"""The command line. ``kinboard`` alone serves the dashboard; the other commands need no server.

Input and output are in degrees and millimetres, with ``--rad`` in radians and metres; ``--json`` prints what REST
answers, problem documents included, and files of rows are in radians and metres. Exit codes: 0 success, 1 no exact
solution (``ik``) or the service could not start, 2 invalid input, 130 interrupted.

A command is a row of `COMMANDS`: its arguments (:mod:`app.cli.arguments`) and the module that runs it. That is
imported after parsing.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, NoReturn

from app.cli import arguments as declare
from app.cli.arguments.agents import add_mcp
from app.cli.arguments.calibrate import add_calibrate
from app.cli.arguments.postures import add_cuspidal, add_postures
from app.cli.arguments.shared import Parents
from app.cli.arguments.singularity import add_singularity
from app.cli.arguments.so101 import add_so101
from app.cli.classroom.arguments import add_lti, add_result, add_results, add_room
from app.cli.startup import no_collections

DESCRIPTION = "Kinematics of robot arms: a dashboard in the browser, a REST interface, this command line."
EPILOG = """examples:
  kinboard                                    serve the dashboard on http://localhost:8000/
  kinboard fk pioneer5 90 30 60 30 30
  kinboard ik pioneer5 --position 45 191 -211 --approach -0.31 -0.164 -0.936
  kinboard robots pioneer5 --json
  kinboard workspace pioneer5 -n 1e6 -o cloud.ply
  kinboard check my-arm.toml
  kinboard import arm.urdf --tip tool0 -o my-arm.toml"""

Run = Callable[[argparse.Namespace], int]
_NEGATIVE = re.compile(r"-(?:[\d.(]|π|(?:pi|inf|nan)\b)", re.IGNORECASE)


class Command(NamedTuple):
    """One command.

    Attributes:
        name: the first word of the command line.
        declare: adds its arguments.
        load: imports the function that runs it and returns the exit code.
    """

    name: str
    declare: Callable[[Any, Parents], argparse.ArgumentParser]
    load: Callable[[], Run]


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; `argv` is without the program's name."""
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or (words[0].startswith("-") and words[0] not in ("-h", "--help", "--version")):
        words.insert(0, "serve")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # for terminals that cannot print θ or ·
    try:
        with no_collections():
            parser = _parser(words[0])
        arguments, unknown = parser.parse_known_args([_not_an_option(word) for word in words])
        if unknown:
            arguments.parser.error("unrecognized arguments: " + " ".join(unknown))
    except SystemExit as stop:  # argparse has printed the help
        return stop.code if isinstance(stop.code, int) else 2
    except _UsageError as error:
        if "--json" in words and words[0] != "bench":  # of which it is the name of a file
            from app.cli.refusals import print_usage_error

            return print_usage_error(str(error), error.parser.prog)
        error.parser.print_usage(sys.stderr)
        print(f"{error.parser.prog}: error: {error}", file=sys.stderr)
        return 2
    try:
        code = _run(arguments.command, arguments)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has closed the pipe, as in `kinboard robots | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _run(command: Command, arguments: argparse.Namespace) -> int:
    try:
        with no_collections():
            run = command.load()
        return run(arguments)
    except ModuleNotFoundError as error:
        if not error.name or error.name.partition(".")[0] in ("app", "kin"):
            raise
        print(
            f"kinboard: `{arguments.parser.prog}` needs {error.name}, which is not installed. Install Kinboard "
            "with its dependencies, `pip install .` in its folder: without them (`--no-deps`), only the Python "
            "package kin works.",
            file=sys.stderr,
        )
        return 2
    except ImportError as error:
        if error.name is not None:
            raise
        print(f"kinboard: {error}", file=sys.stderr)  # there are no kernels, and why
        return 2
    except Exception as error:
        from kin import KinematicsError  # loaded already if it was raised

        if not isinstance(error, KinematicsError):
            raise
        if getattr(arguments, "json", False) is True:
            from app.cli.refusals import print_error

            return print_error(error, arguments.parser.prog)
        print(f"kinboard: {error}", file=sys.stderr)
        return 2


def subcommands(
    parser: argparse.ArgumentParser | None = None, name: str = ""
) -> dict[str, argparse.ArgumentParser]:
    """The parsers of all commands by name, those of actions (``room open``) included."""
    found: dict[str, argparse.ArgumentParser] = {}
    for each in (parser or _parser())._actions:
        if isinstance(each, argparse._SubParsersAction):
            for word, below in each.choices.items():
                found |= {f"{name}{word}": below} | subcommands(below, f"{name}{word} ")
    return found


class _UsageError(Exception):
    """Arguments that cannot be read."""

    def __init__(self, parser: argparse.ArgumentParser, message: str) -> None:
        super().__init__(message)
        self.parser = parser


class _Parser(argparse.ArgumentParser):
    """A parser that raises instead of printing."""

    def error(self, message: str) -> NoReturn:
        raise _UsageError(self, message)


def _parser(name: str = "") -> argparse.ArgumentParser:
    """The parser of one command; without its name, or for a name that there is not, that of all."""
    parser = _Parser(
        prog="kinboard",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    parents = Parents()
    for command in [each for each in COMMANDS if each.name == name] or COMMANDS:
        declared = command.declare(subparsers, parents)
        declared.set_defaults(command=command, parser=declared)
    return parser


class _Version(argparse.Action):
    """Prints the version, which is imported only then."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from kin import __version__

        print(f"kinboard {__version__}")
        parser.exit()


def _not_an_option(word: str) -> str:
    """Negative numbers such as -1e-3 or -pi/2 look like options to argparse; with a leading space they do not."""
    return f" {word}" if _NEGATIVE.match(word) else word


def _load_serve() -> Run:
    from app.cli.serve import run

    return run


def _load_open() -> Run:
    from app.cli.open import run

    return run


def _load_so101() -> Run:
    from app.cli.terminal import robot_of, store_of
    from app.servos.command import run

    def run_so101(arguments: argparse.Namespace) -> int:
        return run(arguments, robot_of(arguments), store_of(arguments).robots)

    return run_so101


def _load_mcp() -> Run:
    from app.cli.serve import run_mcp

    return run_mcp


def _load_fk() -> Run:
    from app.cli.fk import run

    return run


def _load_ik() -> Run:
    from app.cli.ik import run

    return run


def _load_robots() -> Run:
    from app.cli.robots import run

    return run


def _load_workspace() -> Run:
    from app.cli.workspace import run

    return run


def _load_bench() -> Run:
    for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR"):  # read at import: every library uses one thread
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    from app.bench.command import bench

    return bench


def _load_check() -> Run:
    from app.cli.files import run_check

    return run_check


def _load_compare() -> Run:
    from app.cli.robots import run_compare

    return run_compare


def _load_motors() -> Run:
    from app.cli.robots import run_motors

    return run_motors


def _load_calibrate() -> Run:
    from app.cli.calibrate import run

    return run


def _load_doctor() -> Run:
    from app.cli.files import run_doctor

    return run_doctor


def _load_move() -> Run:
    from app.cli.move import run

    return run


def _load_way() -> Run:
    from app.cli.way import run

    return run


def _load_singularity() -> Run:
    from app.cli.way import run_out

    return run_out


def _load_code() -> Run:
    from app.cli.files import run_code

    return run_code


def _load_page() -> Run:
    from app.cli.page import run

    return run


def _load_completion() -> Run:
    from app.cli.arguments.completion import script

    def run(arguments: argparse.Namespace) -> int:
        parser = _parser()
        print(script(arguments.shell, parser, subcommands(parser).values()))
        return 0

    return run


def _load_import() -> Run:
    from app.cli.files import run_import

    return run_import


def _load_export() -> Run:
    from app.cli.files import run_export

    return run_export


def _load_capability() -> Run:
    from app.cli.capability import run

    return run


def _load_cuspidal() -> Run:
    from app.cli.workspace import run_cuspidal

    return run_cuspidal


def _load_postures() -> Run:
    from app.cli.workspace import run_postures

    return run_postures


def _load_room() -> Run:
    from app.cli.classroom.room import run

    return run


def _load_result() -> Run:
    from app.cli.classroom.result import run_result

    return run_result


def _load_results() -> Run:
    from app.cli.classroom.result import run_results

    return run_results


def _load_lti() -> Run:
    from app.cli.classroom.lti import run

    return run


COMMANDS = (
    Command("serve", declare.add_serve, _load_serve),
    Command("open", declare.add_open, _load_open),
    Command("so101", add_so101, _load_so101),
    Command("mcp", add_mcp, _load_mcp),
    Command("fk", declare.add_fk, _load_fk),
    Command("ik", declare.add_ik, _load_ik),
    Command("move", declare.add_move, _load_move),
    Command("way", declare.add_way, _load_way),
    Command("singularity", add_singularity, _load_singularity),
    Command("page", declare.add_page, _load_page),
    Command("code", declare.add_code, _load_code),
    Command("robots", declare.add_robots, _load_robots),
    Command("workspace", declare.add_workspace, _load_workspace),
    Command("postures", add_postures, _load_postures),
    Command("cuspidal", add_cuspidal, _load_cuspidal),
    Command("room", add_room, _load_room),
    Command("result", add_result, _load_result),
    Command("results", add_results, _load_results),
    Command("lti", add_lti, _load_lti),
    Command("bench", declare.add_bench, _load_bench),
    Command("check", declare.add_check, _load_check),
    Command("compare", declare.add_compare, _load_compare),
    Command("motors", declare.add_motors, _load_motors),
    Command("calibrate", add_calibrate, _load_calibrate),
    Command("doctor", declare.add_doctor, _load_doctor),
    Command("capability", declare.add_capability, _load_capability),
    Command("import", declare.add_import, _load_import),
    Command("export", declare.add_export, _load_export),
    Command("completion", declare.add_completion, _load_completion),
)
