"""``kinboard import``, ``export``, ``code``, ``check`` and ``doctor``: files of arms, exercises, courses, lessons.

A file that is not a valid robot is rejected earlier, by :mod:`kin.files`.
"""

from __future__ import annotations

import os
import tomllib
from argparse import Namespace
from pathlib import Path

import kin
from app.cli.bodies import MeshesBeside, MeshFilesBeside
from app.cli.classroom.courses import check_course
from app.cli.pipes.sink import write_output
from app.cli.terminal import Notation, print_json, report_beside, robot_of, table
from app.cli.xacro import expanded, is_xacro
from app.exercises import Exercise, ExerciseFileError, VariantError, load_exercise
from app.exercises.exercise import CHECKED_SEEDS
from app.exercises.lessons import LESSONS
from app.exports.robots import file_name, robot_file
from app.shared.answers.examination import TITLES, examination_answer, outcome
from app.shared.answers.exchange import import_answer
from app.shared.answers.inspection import InspectionAnswer, inspect
from app.shared.store import Store
from kin import InputError, builtin_robots, load_robot, robot_to_toml
from kin.doctor import UrdfExamination, examine_urdf
from kin.doctor.findings import RANKS
from kin.files import UrdfReport, UrdfRobot, read_urdf
from kin.files.builtin import BUILTIN
from kin.files.load import XML
from kin.units import DEFAULT_UNITS


def run_import(arguments: Namespace) -> int:
    """Read a URDF; print the robot file, or write it and print the report."""
    found = _read(arguments)
    text = robot_to_toml(found.robot)
    if arguments.output is not None:
        write_output(arguments.output, text)
    with report_beside(arguments.output):
        return _print_import(found, text, arguments)


def _print_import(found: UrdfRobot, text: str, arguments: Namespace) -> int:
    """Print the robot file, or about the one that was written."""
    if arguments.json:
        return print_json(import_answer(found))
    if arguments.output is None:
        print(text, end="")
        return 0
    units = tomllib.loads(text)["units"]
    said = f"{units['length']} and {units['angle']} in the file; commands read mm and deg, with --rad m and rad"
    lines = [f"{arguments.output}: {found.robot.name}", f"units       {said}", *report_lines(found.report)]
    print("\n".join(lines))
    return 0


def _read(arguments: Namespace) -> UrdfRobot:
    """The arm of a URDF, or of a xacro file."""
    path = Path(arguments.file)
    return read_urdf(source_of(arguments), arguments.base, arguments.tip, file=str(path), fit=MeshesBeside(path))


def source_of(arguments: Namespace) -> Path | str:
    """The path of a URDF, or the text that a xacro file becomes."""
    path = Path(arguments.file)
    if is_xacro(path):
        return expanded(path, arguments.arg, arguments.folder)
    for option, given in (("--arg", arguments.arg), ("--folder", arguments.folder)):
        if given:
            raise InputError(option, given, "nothing: only xacro (*.xacro) is expanded")
    return path


def run_export(arguments: Namespace) -> int:
    """Print or write an arm in a format."""
    text = robot_file(robot_of(arguments), arguments.format)
    file = arguments.output or "-"
    write_output(file, text)
    if file != "-":
        print(f"{file}: {len(text.encode())} bytes")
    return 0


def run_code(arguments: Namespace) -> int:
    """Print or write the solver of an arm in a language."""
    robot, language, name = robot_of(arguments), arguments.language, arguments.name
    text = kin.generate(robot, language, name=name, closest=not arguments.no_closest)
    file = arguments.output or file_name(robot, language, name)
    write_output(file, text)
    if file != "-":
        print(f"{file}: {len(text.encode()) / 1000:.0f} kB; its first lines say how to use it")
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
    return [*lines, f"bodies      {report.about_bodies}", *(f"note: {note}" for note in report.notes)]


def run_check(arguments: Namespace) -> int:
    """Describe the arm of a robot file, or check an exercise, a course or the texts of a lesson."""
    path = Path(arguments.file)
    if path.suffix == ".toml" and (meant := _meant(path)):
        if meant == "lesson":
            from app.cli.classroom.lessons import check_lesson  # with the viewer, which takes a second

            return check_lesson(path, arguments.json)
        if meant == "course":
            return check_course(path, arguments.robots, os.environ.get("KINBOARD_EXERCISES"), arguments.json)
        return _check_exercise(path, arguments.robots, arguments.json)
    lines: list[str] = []
    if path.suffix.lower() in XML:
        robot, report = _read(arguments)
        lines = ["", *report_lines(report)]
    else:
        for option in ("base", "tip", "arg", "folder"):
            if given := getattr(arguments, option):
                raise InputError(
                    f"--{option}", given, "nothing: only URDF, MJCF and xacro have links and arguments"
                )
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
    robot = answer.robot
    lines = []
    for pair in answer.axes:
        a, b = (j + 1 for j in pair.joints)
        apart = "" if pair.distance is None else f", {units.length(pair.distance)} {units.of_length} apart"
        angle = f" ({units.angle(pair.angle)})" if pair.relation == "oblique" else ""
        where = "" if pair.relation == "same line" else ", intersecting" if pair.intersect else apart
        lines.append(f"axes {a} and {b}: {pair.relation}{angle}{where}")
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: parallel axes" for run in answer.parallel]
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: axes through one point" for run in answer.spherical]
    count = len(robot.branches)
    lines += [
        "",
        f"convention  {robot.convention}",
        f"joints      {robot.n}, giving the tool {answer.motions} independent motions",
        f"reach       {units.length(robot.reach)} {units.of_length} at most",
        f"solver      {answer.solver}: {answer.reason}",
        f"branches    {count if count else 'not known in advance: a search finds them one by one'}",
        "",
        *(f"warning: {text}" for text in answer.warnings),
    ]
    return lines if answer.warnings else [*lines, "No warnings."]


def _meant(path: Path) -> str:
    """What a file is meant as; empty: a robot.

    A robot file has rows, an exercise an answer, a course items, the texts of a lesson steps, or the name of one.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return ""  # reading it as a robot file says why
    if "rows" in data:
        return ""
    if "steps" in data:
        return "lesson"
    if "kind" in data or "answer" in data:
        return "exercise"
    if data.keys() & {"item", "items"}:
        return "course"
    return "lesson" if path.name.partition(".")[0] in LESSONS else ""


def _check_exercise(path: Path, robots: str | None, as_json: bool) -> int:
    """Validate an exercise file, try it for some seeds, and show one variant with its answer."""
    exercise = load_exercise(path, Store(Path(robots) if robots else None).get)
    try:
        exercise.verify()
    except VariantError as error:
        expected = "an exercise that can be solved"
        raise ExerciseFileError(str(path), error.field or "answer", str(error), expected) from None
    if as_json:
        return print_json(_exercise_facts(exercise))
    facts = _exercise_facts(exercise)
    print(f"{facts['title']} ({facts['id']})\n{facts['topic']}, level {facts['level']}, {facts['robot']}\n")
    print(f"{facts['text']}\n")
    for i, hint in enumerate(exercise.hints, 1):
        print(f"hint {i}      {hint}")
    print(f"kind        {facts['kind']}: {exercise.kind.about}")
    print(f"answer      {facts['answer']}")
    seeds = len(CHECKED_SEEDS) if exercise.vary else 1
    print(f"\nSolved for {seeds} variant{'s' * (seeds > 1)}; the one above has seed 0.")
    return 0


def _exercise_facts(exercise: Exercise) -> dict[str, object]:
    variant = exercise.variant(0)
    return {
        "id": exercise.id,
        "title": exercise.title,
        "topic": exercise.topic,
        "level": exercise.level,
        "robot": exercise.robot.id,
        "kind": exercise.kind.name,
        "text": variant.text(exercise.text, DEFAULT_UNITS),
        "answer": exercise.solution(variant, DEFAULT_UNITS),
    }


def run_doctor(arguments: Namespace) -> int:
    """Examine a URDF; the exit code is 1 if something is wrong or suspicious."""
    path = Path(arguments.file)
    source, files = source_of(arguments), MeshFilesBeside(path)

    def examined(mends: list[int] | None) -> UrdfExamination:
        return examine_urdf(source, arguments.base, arguments.tip, file=str(path), files=files, mends=mends)

    found = examined(None)
    if arguments.mend is not None:
        found = examined(_chosen(found, arguments.mend))
    if arguments.output is not None and found.mended is not None:
        write_output(arguments.output, found.mended)
    with report_beside(arguments.output):
        if arguments.json:
            print_json(examination_answer(found))
        else:
            print("\n".join(_examination_lines(found, arguments.output)))
    return 1 if found.count("wrong") or found.count("suspicious") else 0


def _chosen(found: UrdfExamination, numbers: list[int]) -> list[int]:
    """The indices of findings by their numbers; raises `InputError` for one that cannot be mended."""
    valid = [number for number, each in enumerate(found.findings, 1) if each.automatic]
    for number in numbers:
        if number not in valid:
            raise InputError(
                "--mend", number, f"numbers of the report: {', '.join(map(str, valid)) or 'it has none'}"
            )
    return [number - 1 for number in numbers]


def _examination_lines(found: UrdfExamination, output: str | None) -> list[str]:
    lines = [found.file, *found.read]
    if found.refusal:
        lines.append(f"No arm is read: {found.refusal}.")
    for rank in RANKS:
        several = [(number, each) for number, each in enumerate(found.findings, 1) if each.rank == rank]
        lines += ["", TITLES[rank]] if several else []
        for number, each in several:
            where = f"line {each.line}" if each.line else "file"
            lines.append(f"  {where}, {each.place}: {each.text}")
            if each.automatic:
                lines.append(f"    {'mended' if each.done else 'left'} ({number}): {each.mend}")
            elif each.mend:
                lines.append(f"    advice: {each.mend}")
    lines += ["", outcome(found)]
    if found.mended is not None:
        how = f"{output} has it mended." if output else "-o FILE writes it mended."
        lines[-1] += f" {how}"
    elif output is not None:
        lines[-1] += f" There is nothing to mend: {output} is not written."
    return lines
