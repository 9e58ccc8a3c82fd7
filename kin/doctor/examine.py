"""The whole examination of a URDF, and its text with all mends that need no decision."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kin.doctor.bodies import MeshFiles, check_link
from kin.doctor.findings import RANKS, Symptom, UrdfExamination, UrdfFinding
from kin.doctor.joints import check_joint
from kin.doctor.notes import FindingLog, cut
from kin.doctor.source import Edit, SourceText
from kin.doctor.tree import LISTED, check_elements, check_root, check_tree
from kin.errors import InputError, RobotFileError
from kin.files.urdf.causes import Cause, decoded
from kin.files.urdf.read import UrdfReport, UrdfRobot, read_urdf
from kin.files.urdf.tree import UrdfTree, tree_of
from kin.fk import fk

MOST_FINDINGS = 500
_ROUNDS = 3  # a mend may show what was hidden: limits in degrees that were exchanged
_LINE = re.compile(r"line ([0-9]+)")
_PLACE = re.compile(r"(joint|link) (.+?):")
SAMPLES = 256


def examine_urdf(
    source: Path | str,
    base: str | None = None,
    tip: str | None = None,
    file: str = "",
    files: MeshFiles | None = None,
    mends: Collection[int] | None = None,
) -> UrdfExamination:
    """Look for what is wrong, suspicious or left out in a URDF, with the line of each finding and its mend.

    A file that cannot be read is no error: that is a finding.

    Args:
        source: a `Path` of a file, or a `str`, which is the text itself and never a path.
        base, tip: the links of the arm, as for `read_urdf`.
        file: the name used in messages.
        files: the meshes that came with it; without it, no mesh is looked at.
        mends: indices of the findings that are to be mended, as they are listed without this; by default all that
            can be. What a mend of an element uncovers there is mended too.

    Returns:
        What was read and found, and the text with all mends that need no decision, or with those asked for.

    Raises:
        InputError: `source` is neither, or `mends` names a finding that cannot be mended.
        RobotFileError: there is no such file, or it is no text.

    Examples:
        >>> from kin import robot_to_urdf
        >>> found = examine_urdf(robot_to_urdf("planar2r").replace('xyz="0 0 1"', 'xyz="0 0 2"', 1))
        >>> found.findings[0].text
        'Its axis has the length 2, not 1; only the direction counts here.'
        >>> found.mended_arm.robot.n
        2
    """
    if not isinstance(source, str | Path):
        raise InputError("source", source, "the text of a URDF as str, or the Path of a file")
    file = file or (str(source) if isinstance(source, Path) else "URDF")
    text, causes = (source, ()) if isinstance(source, str) else decoded(_content(source), file)
    look = partial(_examined, base=base, tip=tip, file=file, files=files)
    first = look(text, causes=causes)
    chosen = _chosen(first.found.findings, mends)
    if chosen:  # no other mend is possible without these
        chosen |= {i for i, each in enumerate(first.found.findings) if each.automatic and each.symptom == "file"}
    findings = tuple(replace(each, done=i in chosen) for i, each in enumerate(first.found.findings))
    found = replace(first.found, findings=findings)
    mended = _mended(first, look, None if mends is None else chosen)
    if mended is None:
        return found
    try:
        arm: UrdfRobot | None = read_urdf(mended, base, tip, file)
    except RobotFileError:
        arm = None
    return replace(found, mended=mended, mended_arm=arm, moved=_moved(found.arm, arm))


def _mended(first: _Round, look: Callable[[str], _Round], chosen: set[int] | None) -> str | None:
    """The text with these findings mended (None: all), and with what that uncovers; None if nothing changes."""
    findings = first.found.findings
    places = {findings[i].place for i in chosen or ()}
    left = {_key(each) for i, each in enumerate(findings) if each.automatic and i not in (chosen or ())}

    def uncovered(_: int, each: UrdfFinding | None) -> bool:
        return chosen is None or (each is not None and each.place in places and _key(each) not in left)

    mended = after = first.changed(lambda i, _: chosen is None or i in chosen)
    for _ in range(_ROUNDS - 1):
        if after is None:
            break
        mended = after
        after = look(mended).changed(uncovered)
    return after or mended


def _key(each: UrdfFinding) -> tuple[str, Symptom]:
    return each.place, each.symptom


def _chosen(findings: Sequence[UrdfFinding], mends: Collection[int] | None) -> set[int]:
    """The indices of the findings to mend."""
    possible = {i for i, each in enumerate(findings) if each.automatic}
    if mends is None:
        return possible
    wrong = [i for i in mends if type(i) is not int or i not in possible]
    if wrong:
        valid = ", ".join(map(str, sorted(possible))) or "none, for nothing can be mended"
        raise InputError("mends", wrong[0], f"indices of findings that can be mended: {valid}")
    return set(mends)


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise RobotFileError(str(path), "file", str(error), "a readable URDF file") from error


class _Round(NamedTuple):
    """What one look at a text has found, and the changes that mend each finding."""

    found: UrdfExamination
    source: SourceText | None = None
    edits: tuple[tuple[Edit, ...], ...] = ()

    def changed(self, wanted: Callable[[int, UrdfFinding | None], bool]) -> str | None:
        """The text with the wanted findings mended; None if that changes nothing."""
        listed = [*self.found.findings[:MOST_FINDINGS], *[None] * len(self.edits)]
        edits = [edit for i, several in enumerate(self.edits) if wanted(i, listed[i]) for edit in several]
        return self.source.changed(edits) if self.source is not None and edits else None


def _examined(
    text: str,
    base: str | None,
    tip: str | None,
    file: str,
    files: MeshFiles | None,
    causes: Sequence[Cause] = (),
) -> _Round:
    """One look at a text; `causes` are why it was read in another encoding than it should be."""
    try:
        source = SourceText(text, file)
        if source.root.tag == "mujoco":
            expected = "<robot>: the doctor examines URDFs; a MuJoCo file is imported, or checked by MuJoCo itself"
            raise RobotFileError(file, "root element", "mujoco", expected)
        tree = tree_of(source.root, file)
    except RobotFileError as error:
        return _Round(UrdfExamination(file, (), (_unreadable(error),), None, str(error)))
    notes, refusal = FindingLog(source), ""
    for cause in (*causes, *source.causes):
        words, mend = f"The file has {cause.what}.", f"Right is {cause.expected}."
        notes.add(None, "file", "file", "wrong", words, mend, source.unchanged(), line=cause.line)
    arms: dict[str, UrdfRobot | str] = {}
    several = tip is None and len(tree.tips) > 1 and not tree.unread
    for each in [each.link for each in tree.tips[:LISTED]] if several else [tip]:
        try:
            arms[each or ""] = read_urdf(text, base, each, file)
        except RobotFileError as error:
            arms[each or ""] = f"{error.field}: got {error.value}, expected {error.expected}"
    known = [arm for arm in arms.values() if isinstance(arm, UrdfRobot)]
    arm = known[0] if known and not several else None
    if not known:
        refusal = str(next(iter(arms.values())))
    check_tree(notes, tree)
    check_root(notes, tree.root)
    joints = {joint.name: joint.element for joint in tree.joints}
    for element in tree.root.findall("joint"):
        check_joint(notes, element, f"joint {element.get('name', '').strip()}", joints)
    reach = max((each.robot.reach for each in known), default=1.0)
    for element in tree.root.findall("link"):
        check_link(notes, element, f"link {element.get('name', '').strip()}", reach, files)
    check_elements(notes, tree.root)
    if arm is not None:
        _note_arm(notes, tree, arm)
    if refusal and not tree.unread:  # else a finding has said why
        _note_refusal(notes, tree, refusal)
    _note_meshes(notes, tree, files)
    both = zip(notes.findings, notes.edits, strict=True)
    in_order = sorted(both, key=lambda each: (RANKS.index(each[0].rank), each[0].line or 0))
    ranked, edits = [each for each, _ in in_order], tuple(several for _, several in in_order)
    more = len(ranked) - MOST_FINDINGS
    if more > 0:
        words = f"{more} more findings are not listed."
        ranked = [*ranked[:MOST_FINDINGS], UrdfFinding(None, "robot", "file", "left out", words)]
    return _Round(UrdfExamination(file, _read(tree, arm, arms), tuple(ranked), arm, refusal), source, edits)


def _unreadable(error: RobotFileError) -> UrdfFinding:
    line = _LINE.search(error.value)
    words = f"{error.field}: {error.value}, expected {error.expected}."
    return UrdfFinding(
        int(line[1]) if line else None, "robot", "file", "wrong", words, "Nothing else was looked at."
    )


def _read(tree: UrdfTree, arm: UrdfRobot | None, arms: Mapping[str, UrdfRobot | str]) -> tuple[str, ...]:
    """What the file holds, and what was read of it."""
    kinds = Counter(joint.type for joint in tree.joints)
    counted = ", ".join(f"{count} {cut(kind) or 'without a type'}" for kind, count in kinds.most_common())
    bodies = [
        sum(1 for link in tree.root.findall("link") for _ in link.findall(tag)) for tag in ("visual", "collision")
    ]
    lines = [
        f"{len(tree.links)} links; {len(tree.joints)} joints{f' ({counted})' if counted else ''}; "
        f"{bodies[0]} visible bodies, {bodies[1]} for collisions."
    ]
    if arm is not None:
        report = arm.report
        lines.append(
            f"Read: {report.base} to {report.tip}, {len(report.joints)} moving joints ({', '.join(report.joints)})"
            f"{f', and {len(report.merged)} fixed ones' if report.merged else ''}."
        )
        lines += _following(report)
        lines += report.notes
        lines.append(f"Collisions: {report.about_bodies}")
    elif len(arms) > 1:
        more = f" and {len(tree.tips) - LISTED} more" if len(tree.tips) > LISTED else ""
        ends = [f"{cut(tip)} ({_result(each)})" for tip, each in arms.items()]
        lines.append(f"It has several ends, and one has to be chosen as the tip: {', '.join(ends)}{more}.")
    return tuple(lines)


def _following(report: UrdfReport) -> list[str]:
    """What follows the joints of the arm."""
    if not report.following:
        return []
    names = ", ".join(cut(name) for name in report.following)
    return [f"Following one of them: {names}."]


def _result(arm: UrdfRobot | str) -> str:
    return f"refused: {arm}" if isinstance(arm, str) else f"{arm.robot.n} joint{'s' * (arm.robot.n > 1)}"


def _note_arm(notes: FindingLog, tree: UrdfTree, arm: UrdfRobot) -> None:
    """What is beside the arm."""
    report = arm.report
    beside = [joint for joint in tree.joints if joint.name in set(report.ignored)]
    if beside:
        more = f" and {len(beside) - LISTED} more" if len(beside) > LISTED else ""
        names = ", ".join(cut(joint.name) for joint in beside[:LISTED]) + more
        what = "Joint" if len(beside) == 1 else f"{len(beside)} joints"
        words = f"{what} beside the way from {report.base} to {report.tip}: {names}."
        notes.add(beside[0].element, "robot", "beside the arm", "left out", words)


def _note_refusal(notes: FindingLog, tree: UrdfTree, refusal: str) -> None:
    """Why there is no arm, unless a finding has said so."""
    place = _PLACE.match(refusal)
    named = [e for e in tree.root if place and e.tag == place[1] and e.get("name", "").strip() == place[2]]
    known = {each.place for each in notes.findings if each.rank == "wrong"}
    if place and any(each.startswith(f"{place[1]} {cut(place[2])}") for each in known):
        return
    words, mend = f"No arm is read. {refusal}.", "Mend what is wrong, or choose another base or tip."
    notes.add(named[0] if named else tree.root, "robot", "tree", "wrong", words, mend)


def _note_meshes(notes: FindingLog, tree: UrdfTree, files: MeshFiles | None) -> None:
    meshes = [mesh for link in tree.root.findall("link") for mesh in link.iter("mesh")]
    if meshes and files is None:
        many = "1 mesh file is" if len(meshes) == 1 else f"{len(meshes)} mesh files are"
        words = f"{many} named, but none came along: they were not looked at."
        notes.add(meshes[0], "robot", "mesh", "left out", words)


def _moved(before: UrdfRobot | None, after: UrdfRobot | None) -> float | None:
    """Largest distance between the tools of two arms with the same joints."""
    if before is None or after is None or before.report.joints != after.report.joints:
        return None
    q = after.robot.random_q(np.random.default_rng(0), SAMPLES)
    apart = fk(after.robot, q)[:, :3, 3] - fk(before.robot, q)[:, :3, 3]
    return float(np.linalg.norm(apart, axis=1).max())
