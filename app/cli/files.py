"""``kinboard import`` and ``kinboard export``: arms from URDF, and as files."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from app.cli.terminal import print_json, robot_of
from app.exports.robots import robot_file
from app.shared.answers.exchange import import_answer
from kin import InputError, UrdfReport, read_urdf, robot_to_toml


def run_import(arguments: Namespace) -> int:
    """Read a URDF; print the robot file, or write it and print the report."""
    found = read_urdf(Path(arguments.file), arguments.base, arguments.tip)
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
