"""``kinboard import``, ``kinboard export`` and ``kinboard check``: files of arms.

A file that is not a valid robot is rejected earlier, by :mod:`kin.files`.
"""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from app.cli.terminal import Notation, print_json, robot_of, table
from app.cli.xacro import expanded, is_xacro
from app.exports.robots import robot_file
from app.shared.answers.exchange import import_answer
from app.shared.answers.inspection import InspectionAnswer, inspect
from kin import InputError, UrdfReport, UrdfRobot, builtin_robots, load_robot, read_urdf, robot_to_toml
from kin.files.builtin import BUILTIN


def run_import(arguments: Namespace) -> int:
    """Read a URDF; print the robot file, or write it and print the report."""
    found = _read(arguments)
    text = robot_to_toml(found.robot)
    if arguments.output is not None:
        _write(arguments.output, text)
    if arguments.json:
        return print_json(import_answer(found))
    if arguments.output is None:
        print(text, end="")
        return 0
    print("\n".join([f"{arguments.output}: {found.robot.name}", *report_lines(found.report)]))
    return 0


def _read(arguments: Namespace) -> UrdfRobot:
    """The arm of a URDF, or of a xacro file."""
    path, base, tip = Path(arguments.file), arguments.base, arguments.tip
    if is_xacro(path):
        return read_urdf(expanded(path, arguments.arg, arguments.folder), base, tip, file=str(path))
    for option, given in (("--arg", arguments.arg), ("--folder", arguments.folder)):
        if given:
            raise InputError(option, given, "nothing: only xacro (*.xacro) is expanded")
    return read_urdf(path, base, tip)


def run_export(arguments: Namespace) -> int:
    """Print or write an arm in a format."""
    text = robot_file(robot_of(arguments), arguments.format)
    if arguments.output is None:
        print(text, end="")
    else:
        _write(arguments.output, text)
        print(f"{arguments.output}: {len(text.encode())} bytes")
    return 0


def report_lines(report: UrdfReport) -> list[str]:
    """What became of a URDF."""
    lines = [
        f"links       {report.base} to {report.tip}",
        f"joints      {', '.join(report.joints)}",
        f"error       {report.difference:.1e} at most, compared with the URDF at {report.samples} configurations",
    ]
    if report.merged:
        lines.append(f"merged      {', '.join(report.merged)}: fixed joints")
    if report.ignored:
        lines.append(f"left out    {', '.join(report.ignored)}")
    if report.tilts:
        lines.append(f"fixed rows  {', '.join(report.tilts)}: between almost parallel axes")
    return [*lines, *(f"note: {note}" for note in report.notes)]


def _write(path: str, text: str) -> None:
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError("--output", path, f"a file that can be written ({error.strerror})") from None


def run_check(arguments: Namespace) -> int:
    """Describe the arm of a robot file."""
    path = Path(arguments.file)
    lines: list[str] = []
    if path.suffix in (".urdf", ".xacro"):
        robot, report = _read(arguments)
        lines = ["", *report_lines(report)]
    else:
        for option in ("base", "tip", "arg", "folder"):
            if given := getattr(arguments, option):
                raise InputError(f"--{option}", given, "nothing: only URDF and xacro have links and arguments")
        robot = load_robot(path)
    answer = inspect(robot, robot.id in builtin_robots() and path.resolve().parent != BUILTIN.resolve())
    if arguments.json:
        return print_json(answer)
    units = Notation(robot, arguments.rad)
    print(f"{robot.name} ({robot.id})\n{robot.description or 'No description.'}\nsource: {robot.source}\n")
    rows = [
        [str(i + 1), joint.name, joint.kind, units.joint(i, low), units.joint(i, high), units.joint(i, home)]
        for i, (joint, low, high, home) in enumerate(
            zip(robot.joints, robot.lower, robot.upper, robot.home, strict=True)
        )
    ]
    print(table(["", "joint", "kind", "lower", "upper", "home"], rows) + "\n")
    for line in [*_about(answer, units), *lines]:
        print(line)
    return 0


def _about(answer: InspectionAnswer, units: Notation) -> list[str]:
    """Lines about joint axes, solver and warnings."""
    robot = answer["robot"]
    lines = []
    for pair in answer["axes"]:
        a, b = (j + 1 for j in pair["joints"])
        apart = "" if pair["distance"] is None else f", {units.length(pair['distance'])} {units.of_length} apart"
        angle = f" ({units.angle(pair['angle'])})" if pair["relation"] == "oblique" else ""
        where = "" if pair["relation"] == "same line" else ", intersecting" if pair["intersect"] else apart
        lines.append(f"axes {a} and {b}: {pair['relation']}{angle}{where}")
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: parallel axes" for run in answer["parallel"]]
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: axes through one point" for run in answer["spherical"]]
    count = len(robot["branches"])
    lines += [
        "",
        f"convention  {robot['convention']}",
        f"joints      {robot['n']}, giving the tool {answer['motions']} independent motions",
        f"reach       {units.length(robot['reach'])} {units.of_length} at most",
        f"solver      {answer['solver']}: {answer['reason']}",
        f"branches    {count if count else 'not known in advance: a search finds them one by one'}",
        "",
        *(f"warning: {text}" for text in answer["warnings"]),
    ]
    return lines if answer["warnings"] else [*lines, "No warnings."]
