"""The command line. ``kinboard`` alone serves the dashboard; the other commands need no server.

Input and output are in degrees and millimetres, with ``--rad`` in radians and metres; ``--json`` prints what REST
answers, problem documents included, and files of rows are in radians and metres. Exit codes: 0 success, 1 no exact
solution (``ik``) or the service could not start, 2 invalid input, 130 interrupted.

A command is a row of `COMMANDS`: its arguments (:mod:`app.cli.arguments`) and the function that runs it, which is
imported after parsing.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import NamedTuple, NoReturn

from app.cli.arguments import arms, kinematics, service, space
from app.cli.arguments.shared import Parents
from app.cli.classroom import arguments as classroom
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

_NEGATIVE = re.compile(r"-(?:[\d.(]|π|(?:pi|inf|nan)\b)", re.IGNORECASE)


class Command(NamedTuple):
    """One command.

    Attributes:
        name: the first word of the command line.
        declare: adds its own arguments; its docstring is what the help says about the command.
        run: where the function is that runs it and returns the exit code: a module, seen from here, and its name.
        shared: the arguments that it has in common with others, as attributes of `Parents`.
    """

    name: str
    declare: Callable[[argparse.ArgumentParser], None]
    run: str
    shared: str = ""

    def load(self) -> Callable[[argparse.Namespace], int]:
        """The function, imported."""
        module, _, name = self.run.partition(":")
        found: Callable[[argparse.Namespace], int] = getattr(import_module(module, __package__), name)
        return found


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; `argv` is without the program's name."""
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or (words[0].startswith("-") and words[0] not in ("-h", "--help", "--version")):
        words.insert(0, "serve")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # for terminals that cannot print θ or ·
    try:
        with no_collections():
            parser = parser_of(words[0])
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
    for each in (parser or parser_of())._actions:
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


def parser_of(name: str = "") -> argparse.ArgumentParser:
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
        about = (command.declare.__doc__ or "").removesuffix(".")
        shared = [getattr(parents, each) for each in command.shared.split()]
        declared = subparsers.add_parser(command.name, help=about[:1].lower() + about[1:], parents=shared)
        command.declare(declared)
        declared.set_defaults(command=command, parser=declared)
    return parser


class _Version(argparse.Action):
    """Prints the version, which is imported only then."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from kin import __version__

        print(f"kinboard {__version__}")
        parser.exit()


def run_completion(arguments: argparse.Namespace) -> int:
    """Print what the shell completes."""
    from app.cli.arguments.completion import script

    parser = parser_of()
    print(script(arguments.shell, parser, subcommands(parser).values()))
    return 0


def _not_an_option(word: str) -> str:
    """Negative numbers such as -1e-3 or -pi/2 look like options to argparse; with a leading space they do not."""
    return f" {word}" if _NEGATIVE.match(word) else word


COMMANDS = (
    Command("serve", service.add_serve, ".serve:run", "robots"),
    Command("open", service.add_open, ".open:run", "robots"),
    Command("so101", service.add_so101, ".open:run_so101", "robots"),
    Command("mcp", service.add_mcp, ".serve:run_mcp", "robots"),
    Command("fk", kinematics.add_fk, ".fk:run", "arm robots output pendant frames"),
    Command("ik", kinematics.add_ik, ".ik:run", "arm robots output pendant joints frames"),
    Command("move", kinematics.add_move, ".move:run", "arm robots output frames"),
    Command("way", kinematics.add_way, ".way:run", "arm robots output mounts"),
    Command("singularity", kinematics.add_singularity, ".way:run_out", "arm robots output pendant mounts"),
    Command("page", arms.add_page, ".page:run", "arm robots output mounts"),
    Command("code", arms.add_code, ".files:run_code", "arm robots"),
    Command("robots", arms.add_robots, ".robots:run", "robots output"),
    Command("workspace", space.add_workspace, ".workspace:run", "arm robots output joints"),
    Command("postures", space.add_postures, ".workspace:run_postures", "arm robots output joints"),
    Command("cuspidal", space.add_cuspidal, ".workspace:run_cuspidal", "arm robots output joints"),
    Command("room", classroom.add_room, ".classroom.room:run"),
    Command("result", classroom.add_result, ".classroom.result:run_result"),
    Command("results", classroom.add_results, ".classroom.result:run_results"),
    Command("lti", classroom.add_lti, ".classroom.lti:run"),
    Command("bench", service.add_bench, "..bench:run_bench"),
    Command("check", arms.add_check, ".files:run_check", "robots output"),
    Command("compare", arms.add_compare, ".robots:run_compare", "robots output"),
    Command("motors", arms.add_motors, ".robots:run_motors", "arm robots output"),
    Command("calibrate", arms.add_calibrate, ".calibrate:run", "arm robots output mounts"),
    Command("doctor", arms.add_doctor, ".files:run_doctor"),
    Command("capability", space.add_capability, ".capability:run", "arm robots output joints"),
    Command("import", arms.add_import, ".files:run_import"),
    Command("export", arms.add_export, ".files:run_export", "arm robots"),
    Command("completion", service.add_completion, ".parser:run_completion"),
)
