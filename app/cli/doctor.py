"""``kinboard doctor``: what is wrong or suspicious in a URDF, line by line, and the file with it mended."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from app.cli.bodies import MeshFilesBeside
from app.cli.files import source_of, write_file
from app.cli.terminal import print_json
from app.shared.answers.examination import TITLES, examination_answer, outcome
from kin import InputError
from kin.doctor import UrdfExamination, examine_urdf
from kin.doctor.findings import RANKS


def run(arguments: Namespace) -> int:
    """Examine a URDF; the exit code is 1 if something is wrong or suspicious."""
    path = Path(arguments.file)
    source, files = source_of(arguments), MeshFilesBeside(path)

    def examined(mends: list[int] | None) -> UrdfExamination:
        return examine_urdf(source, arguments.base, arguments.tip, file=str(path), files=files, mends=mends)

    found = examined(None)
    if arguments.mend is not None:
        found = examined(_chosen(found, arguments.mend))
    if arguments.output is not None and found.mended is not None:
        write_file(arguments.output, found.mended)
    if arguments.json:
        print_json(examination_answer(found))
    else:
        print("\n".join(_lines(found, arguments.output)))
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


def _lines(found: UrdfExamination, output: str | None) -> list[str]:
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
