"""The HTML of the tab: the table, what is wrong, what the arm is, tool and base, files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import kin
from app.shared.answers.inspection import InspectionAnswer, inspect
from app.viewer.frames import MOST as MOST_FRAMES
from app.viewer.frames import Frames
from app.viewer.meshes.archive import MB, MOST_BYTES
from app.viewer.scene.meshes import body
from app.viewer.tabs.robot.edits import (
    ANGLES,
    AXES,
    FRAMES,
    KINDS,
    MOTION,
    NUMBERS,
    Cell,
    frame_values,
    name_of,
    part_of,
)
from app.viewer.tabs.robot.files import MOST, Busy, Source
from app.viewer.tabs.robot.presets import TITLES
from app.viewer.tabs.robot.texts import Texts
from app.viewer.views.templates import render
from kin import Joint, Robot
from kin.dh.tables import SAMPLES, largest_difference
from kin.files.read import PER
from kin.robot import MOUNTINGS
from kin.units import Unit, Units, general, power

FILE, LINK = "your own file", "a link"  # what an arm was made from, besides examples and robots
MOST_TIPS = 50  # links of a URDF to choose from
DECIMALS = 6  # of a degree or a millimetre, in a cell
MOUNTING_TITLES: dict[str, str] = {
    "pedestal": "on a pedestal",
    "floor": "on the floor",
    "table": "on a table",
    "wall": "at a wall",
    "ceiling": "under a ceiling",
}
KIND_TITLES = {"revolute": "turns", "prismatic": "slides", "fixed": "fixed"}
_HEADS = {
    "kind": ("joint", "Whether the joint of this row turns (revolute), slides (prismatic) or does not move"),
    "theta": ("θ", "Angle about z; the value of a turning joint is added"),
    "d": ("d", "Length along z; the value of a sliding joint is added"),
    "a": ("a", "Length along x"),
    "alpha": ("α", "Angle about x: the twist of the link"),
    "low": ("from", "Lower limit of the joint, in degrees or as a length"),
    "high": ("to", "Upper limit of the joint"),
    "name": ("name", "Name of the joint"),
}
# A field, as most are.
_PLAIN = {"id": "", "hint": "", "longest": 60, "text": False, "variable": False, "options": (), "none": False}
_MOTIONS = {
    0: "none: no joint moves the tool",
    1: "one: the tool moves along one curve",
    2: "2: the tool moves on a surface",
    6: "6: any position and any orientation, within reach",
}


def text_of(value: float, unit: Unit) -> str:
    """A value (rad or m) as short as possible."""
    return unit.short(value, DECIMALS)


def start(robot: Robot, chosen: str, mine: bool, robots: Sequence[Robot], texts: Texts) -> str:
    """What the arm was made from, its name and its convention. No arm is offered twice."""
    names = {each.name for each in robots}
    return render(
        "robot/start",
        chosen=chosen,
        other=chosen if chosen in (FILE, LINK) else "",
        mine=mine,
        presets=[(key, title) for key, title in TITLES.items() if key == chosen or title not in names],
        robots=[(r.id, r.name) for r in robots],
        name=_field(("arm", "name"), robot.name, texts, id="kb-arm-name", label="", text=True),
        convention=robot.convention,
    )


def table(robot: Robot, units: Units, revision: int, written: int, texts: Texts) -> str:
    """The DH table with a field for each number: of which rows and units, and how often it was written."""
    heads = []
    for column, (name, title) in _HEADS.items():
        unit = units.of(column in ANGLES).name if column in NUMBERS[:4] else ""
        heads.append({"name": name, "unit": unit, "title": title, "left": column in ("kind", "name")})
    rows = [[_cell(i, row, column, units, texts) for column in _HEADS] for i, row in enumerate(robot.rows)]
    about = {"revision": revision, "written": written, "convention": robot.convention}
    return render("robot/table", heads=heads, rows=rows, **about)


def motion(robot: Robot, units: Units, texts: Texts) -> str:
    """Fields for the home configuration and for the limits of motion; those that are assumed are empty."""
    limits, rows = kin.motion.motion_limits(robot), []
    moving = [(index, row) for index, row in enumerate(robot.rows) if row.driven]
    for joint, (index, row) in enumerate(moving):
        angle, cells = row.kind == "revolute", []
        for column in MOTION:
            value = float(robot.q_home[joint]) if column == "home" else getattr(row, column)
            cell = (index, column)
            hint = general(float(getattr(limits, column)[joint]) * units.of(angle).scale) if value is None else ""
            shown = "" if value is None else _text(cell, value, units, angle, texts)
            cells.append(_field(cell, shown, texts, hint=hint))
        rows.append({"number": index + 1, "title": row.name, "cells": cells})
    names = {units.of(turning).name for turning in robot.revolute.tolist()}
    per = " or ".join(sorted(names))
    heads = [
        ("home", per),
        *((key, f"{per}{time.replace('2', '²').replace('3', '³')}") for key, time in PER.items()),
    ]
    return render("robot/motion", heads=heads, rows=rows)


def withheld() -> str:
    """Why there is no table."""
    return render("robot/withheld")


def _field(cell: Cell, value: str, texts: Texts, **more: Any) -> dict[str, Any]:
    """A field with a value, or with what was typed there and is not valid; for the macro *field*."""
    where, column = cell
    text, wrong = texts.wrong.get(cell, (value, ""))
    return {**_PLAIN, "key": f"{where} {column}", "label": name_of(cell), "value": text, "wrong": wrong, **more}


def _cell(index: int, row: Joint, column: str, units: Units, texts: Texts) -> dict[str, Any]:
    cell = (index, column)
    if column == "kind":
        return _field(cell, row.kind, texts, options=[(kind, KIND_TITLES[kind]) for kind in KINDS])
    if column == "name":
        return _field(cell, row.name, texts, text=True)
    if column in ("low", "high"):
        if row.limits is None:
            ratio = f"{general(row.ratio)} × {row.follows}" if column == "low" else ""
            return _field(cell, "", texts, none=row.kind == "fixed", hint=ratio if row.follows else "none")
        limit, angle = row.limits[column == "high"], row.kind == "revolute"
        return _field(cell, _text(cell, limit, units, angle, texts), texts)
    variable = column == {"revolute": "theta", "prismatic": "d"}.get(row.kind)
    value = _text(cell, getattr(row, column), units, column in ANGLES, texts)
    return _field(cell, value, texts, variable=variable)


def _text(cell: Cell, value: float, units: Units, is_angle: bool, texts: Texts) -> str:
    """What was typed into a cell, or its value (rad or m) as a number."""
    unit = units.of(is_angle)
    typed = texts.shown(cell, value, unit)
    return text_of(value, unit) if typed is None else typed


def wrong(part: str, texts: Texts) -> str:
    """What is wrong in a part of the tab; in the table and above it for the part `wrong`."""
    parts = ("table", "start") if part == "wrong" else (part.removeprefix("wrong-"),)
    said = [_sentence(cell, why) for cell, (_, why) in texts.wrong.items() if part_of(cell) in parts]
    return render("robot/wrong", part=part, messages=said)


def _sentence(cell: Cell, message: str) -> str:
    words = f"{name_of(cell)}: {message}"
    return f"{words[0].upper()}{words[1:]}."


def about(robot: Robot, units: Units) -> str:
    """What the arm is, in plain words."""
    found = inspect(robot)
    facts = [
        _fact("Joints", _joints(robot)),
        _fact("Axes", _axes(found)),
        _fact("Tool motions", _MOTIONS.get(found.motions, f"{found.motions} independent")),
        _redundancy(found, robot),
        _solver(found),
        _fact("Reach", f"at most {units.distance(robot.reach)}"),
        _home(found),
        _bodies(found),
    ]
    near = "The home configuration is near a singularity"  # said by the row above
    warnings = [text for text in found.warnings if not text.startswith(near)]
    return render("robot/about", facts=[fact for fact in facts if fact is not None], warnings=warnings)


def _fact(name: str, words: str, state: str = "", color: str = "kb-green") -> dict[str, str]:
    return {"name": name, "words": words, "state": state, "color": color}


def _joints(robot: Robot) -> str:
    turning = int(robot.revolute.sum())
    sliding = robot.n - turning
    parts = [f"{count} {verb}" for count, verb in ((turning, "turning"), (sliding, "sliding")) if count]
    return f"{robot.n}: {', '.join(parts)}" if sliding and turning else parts[0]


def _axes(found: InspectionAnswer) -> str:
    parts = [f"{_run(joints)} parallel" for joints in found.parallel if len(joints) > 1]
    parts += [f"{_run(joints)} meet in one point" for joints in found.spherical]
    turned = [pair.relation for pair in found.axes]
    if not parts and turned:
        same = f"each {turned[0]} to the next" if len(set(turned)) == 1 else "in no special position"
        parts = [same if len(turned) > 1 else f"1 and 2 {turned[0]}"]
    return "; ".join(parts) or "one axis"


def _run(joints: Sequence[int]) -> str:
    numbers = [str(joint + 1) for joint in joints]
    return " and ".join([", ".join(numbers[:-1]), numbers[-1]])


def _redundancy(found: InspectionAnswer, robot: Robot) -> dict[str, str]:
    spare = found.redundancy
    if spare:
        words = f"{robot.n} joints − {found.motions} motions = {spare}: the arm can move while the tool stays"
        return _fact("Redundancy", words)
    return _fact("Redundancy", "none: no joint to spare")


def _solver(found: InspectionAnswer) -> dict[str, str]:
    if found.solver == "numeric":
        words = f"a search from several starts: {found.reason}. It may miss solutions."
        return _fact("Inverse kinematics", words, "numeric:", "kb-amber")
    count = len(found.robot.branches)
    postures = {0: "", 1: ", one posture"}.get(count, f", up to {count} postures")
    return _fact("Inverse kinematics", f"solver {found.solver}{postures}: {found.reason}.", "exact:")


def _home(found: InspectionAnswer) -> dict[str, str]:
    if found.singular_at_home:
        return _fact("Home", "the tool cannot move in some direction from there", "singular:", "kb-vermilion")
    if found.home_margin < 0.1:
        return _fact("Home", "some tool motions there need fast joints", "near a singularity:", "kb-amber")
    return _fact("Home", "every possible motion of the tool starts freely", "not singular:")


def _bodies(found: InspectionAnswer) -> dict[str, str]:
    """What collisions are judged by."""
    bodies = found.bodies
    if bodies.assumed:
        words = "tubes along the lengths of the table; the real bodies are not known, and may be thicker"
        return _fact("Collisions", words, "assumed:", "kb-amber")
    known = {each.link for each in bodies.capsules if not each.assumed}
    assumed = sorted({each.link for each in bodies.capsules if each.assumed})
    if not assumed:
        return _fact("Collisions", "capsules around the bodies of the links", "known:")
    parts = [f"{'what else belongs to ' * (k in known)}link {k}" for k in assumed]
    words = f"capsules around the bodies of the links; assumed are tubes for {', '.join(parts)}"
    return _fact("Collisions", words, "partly known:", "kb-amber")


def frames(robot: Robot, units: Units, page: Frames, texts: Texts) -> str:
    """Fields for the tool, the base, and the workpieces of the page."""
    rows = []
    poses = [(frame, frame, frame_values(robot, frame)) for frame in FRAMES]
    poses += [(f"frame-{i}", each.name, each.values) for i, each in enumerate(page.workpieces)]
    for frame, title, values in poses:
        cells = [
            _field((frame, axis), _text((frame, axis), value, units, i >= 3, texts), texts)
            for i, (axis, value) in enumerate(zip(AXES, values, strict=True))
        ]
        name = _field((frame, "name"), title, texts, text=True, longest=24)
        rows.append({"title": title, "cells": cells, "name": name})
    length, angle = units.lengths.name, units.angles.name
    own, fixed = rows[len(FRAMES) :], rows[: len(FRAMES)]
    full = len(own) >= MOST_FRAMES
    mount = body(robot).mount
    hint = text_of(mount.floor, units.lengths)
    floor = "" if robot.floor is None else _text(("arm", "floor"), robot.floor, units, False, texts)
    place = {
        "mountings": [(key, MOUNTING_TITLES[key]) for key in MOUNTINGS],
        "mounting": mount.kind,
        "floor": _field(("arm", "floor"), floor, texts, id="kb-arm-floor", label="", hint=hint),
    }
    shown = {"place": place, "workpieces": own, "full": full, "length": length, "angle": angle}
    return render("robot/frames", heads=AXES, rows=fixed, **shown)


def files(waiting: Source | None, busy: Busy | None, meshes: str, heavy: bool) -> str:
    """Buttons for files, and what is to be chosen, arriving or known about them.

    Args:
        waiting: a file with several ends or several URDFs to choose from.
        busy: what goes on with a file.
        meshes: the file whose meshes the arm on show has.
        heavy: whether it may have meshes, of that file or of a package.
    """
    choice: dict[str, Any] | None = None
    if waiting is not None:
        if waiting.text:
            names = [f"{tip.link} ({tip.joints} joint{'s' * (tip.joints != 1)})" for tip in waiting.tips]
            options = list(zip([tip.link for tip in waiting.tips], names, strict=True))
            choice = {
                "key": "tip",
                "label": "Tool is link",
                "words": "ends: choose the link that carries the tool",
            }
        else:
            options = [(urdf, urdf) for urdf in waiting.urdfs]
            choice = {"key": "urdf", "label": "Robot", "words": "robots: choose its URDF"}
        choice |= {"file": waiting.name, "options": options[:MOST_TIPS], "more": max(0, len(options) - MOST_TIPS)}
    most = f"{MOST // 1000} kB", f"{MOST_BYTES // MB} MB"
    return render(
        "robot/files",
        most=most,
        choice=choice,
        busy=busy,
        shown="" if busy is None else _amount(busy),
        meshes=meshes,
        heavy=heavy,
    )


def _amount(busy: Busy) -> str:
    """How much is done, such as ``1.2 of 7.5 MB``."""
    done, total = (f"{n / MB:.1f}" if busy.unit == "MB" else f"{n}" for n in (busy.done, busy.total))
    return f"{done} of {total} {busy.unit}".strip() if busy.total else f"{done} {busy.unit}".strip()


def conversion(robot: Robot, shown: bool, units: Units) -> str:
    """An offer to convert; if it is `shown`, the arm in the other convention beside the present numbers."""
    convention = {"standard": "modified (Craig)", "modified": "standard"}[robot.convention]
    if not shown:
        return render("robot/convert", convention=convention, rows=())
    other = kin.dh.convert_dh(robot, "modified" if robot.convention == "standard" else "standard")
    heads = [(_HEADS[column][0], units.of(column in ANGLES).name) for column in NUMBERS[:4]]
    rows = []
    for row, before in zip(other.rows, robot.rows, strict=True):
        pairs = [
            tuple(text_of(getattr(one, c), units.of(c in ANGLES)) for one in (row, before)) for c in NUMBERS[:4]
        ]
        rows.append([{"value": new, "before": old, "changed": new != old} for new, old in pairs])
    frames = [(frame.capitalize(), _frame_words(other, robot, frame, units)) for frame in FRAMES]
    difference, samples = largest_difference(robot, other), SAMPLES
    differ = f"differ by at most {power(difference, 1)} m" if difference else "are equal, digit by digit,"
    check = f"the tool poses of both tables {differ} in {samples} random configurations."
    return render("robot/convert", convention=convention, heads=heads, rows=rows, frames=frames, check=check)


def _frame_words(other: Robot, robot: Robot, frame: str, units: Units) -> str:
    """The tool or the base that the other table needs."""
    same = (other.tool == robot.tool) if frame == "tool" else (other.base == robot.base)
    if same:
        return "stays as it is."
    values = [text_of(v, units.of(i >= 3)) for i, v in enumerate(frame_values(other, frame))]
    length, angle = units.lengths.name, units.angles.suffix
    return f"becomes x y z = {', '.join(values[:3])} {length}; roll pitch yaw = {', '.join(values[3:])}{angle}."
