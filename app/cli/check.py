"""``kinboard check``: describes the arm of a robot file, names its solver, and warns of likely mistakes.

A file that is not a valid robot is rejected earlier, by :mod:`kin.files`.
"""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from app.cli.files import report_lines
from app.cli.terminal import Notation, print_json, table
from app.shared.answers.inspection import InspectionAnswer, inspect
from kin import InputError, builtin_robots, load_robot, read_urdf
from kin.files.builtin import BUILTIN


def run(arguments: Namespace) -> int:
    """Describe the arm of a robot file."""
    path = Path(arguments.file)
    lines: list[str] = []
    if path.suffix == ".urdf":
        robot, report = read_urdf(path, arguments.base, arguments.tip)
        lines = ["", *report_lines(report)]
    else:
        robot = load_robot(path)
        for option, link in (("--base", arguments.base), ("--tip", arguments.tip)):
            if link is not None:
                raise InputError(option, link, "no link: only a URDF has links")
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
