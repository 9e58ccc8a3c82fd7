"""What the doctor finds in a URDF, with the lines, the mends and the mended text."""

from __future__ import annotations

from app.shared.answers.answer import Answer
from kin.doctor import UrdfExamination
from kin.doctor.findings import Rank, Symptom
from kin.units import general

TITLES: dict[Rank, str] = {
    "wrong": "Wrong: the arm or other readers refuse it",
    "suspicious": "Suspicious: it can be read, but is probably not meant",
    "left out": "Left out",
}


class UrdfFindingAnswer(Answer):
    """Something to know about a URDF."""

    line: int | None
    """Line of the element, from 1; null if it concerns the whole file."""
    place: str
    """The element."""
    symptom: Symptom
    """What kind of thing it is."""
    rank: Rank
    """`wrong`: the arm, or other readers, refuse it. `suspicious`: it can be read, but is probably not meant.
    `left out`: nothing is made of it."""
    text: str
    """What it is, and for what is left out, why."""
    mend: str
    """What helps; empty if nothing has to be done."""
    automatic: bool
    """Whether it can be mended without a decision."""
    done: bool
    """Whether `mended` has it done."""


class ExaminationAnswer(Answer):
    """A URDF as the doctor sees it."""

    read: list[str]
    """What the file holds and what was read of it, a sentence each."""
    findings: list[UrdfFindingAnswer]
    """By rank, and then by line."""
    refusal: str
    """Why no arm is read between the links that were asked for; empty if one is, or if a tip has to be chosen."""
    text: str
    """The outcome in words."""
    mended: str | None
    """The URDF with all automatic mends, or those asked for, and otherwise as it was; null if there are none."""
    moved: float | None
    """Largest distance in metres between the tool of the arm and that of the mended one, at random configurations;
    null if one of them is missing or they have other joints."""


def examination_answer(found: UrdfExamination) -> ExaminationAnswer:
    """The examination as REST and the command line publish it."""
    return ExaminationAnswer.of(found, text=outcome(found))


def outcome(found: UrdfExamination) -> str:
    """How many findings there are, and what mending them does."""
    wrong, suspicious = found.count("wrong"), found.count("suspicious")
    if not wrong and not suspicious:
        return "Nothing is wrong or suspicious."
    text = f"{wrong} wrong, {suspicious} suspicious; {found.mendable} of them can be mended at once."
    if 0 < found.mends < found.mendable:
        text += f" {found.mends} of these {'is' if found.mends == 1 else 'are'} chosen."
    if found.mended is None:
        return text
    if found.arm is None and found.mended_arm is not None:
        return f"{text} The mended file is read, with {found.mended_arm.robot.n} joints."
    if found.moved is not None:
        moved = f"moves the tool by up to {general(1000.0 * found.moved, 2)} mm"
        return f"{text} Mending {moved if found.moved > 1e-12 else 'does not move the tool'}."
    return text
