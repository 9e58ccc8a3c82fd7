"""The HTML of the lesson: the derivation with its numbers, and the tree of branches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from app.viewer.lessons.inverse import formulas, words
from app.viewer.lessons.inverse.arm import Arm
from app.viewer.lessons.inverse.exercise import Branch
from app.viewer.lessons.inverse.sheet import DerivedStep, Line, StepKey
from app.viewer.lessons.inverse.tree import Node
from app.viewer.lessons.redundancy.views import small
from app.viewer.views.templates import render
from kin import Robot
from kin.transforms import Array
from kin.units import Units, fixed

LOCKED = "Shown when you have answered the question of the last step."


def derivation_html(
    arm: Arm, branch: Branch, keys: Sequence[StepKey], opened: Sequence[bool], at: int, units: Units
) -> str:
    """The derivation of a branch.

    Args:
        keys: its steps; `opened`: whether the numbers of each are on show.
        at: index of the step that the student is at: its formulas are shown without numbers if it is not open.
    """
    found = branch.derivation
    steps = []
    for index, key in enumerate(keys):
        step = found.step(key)
        if step is None or not (opened[index] or index == at):
            continue
        steps.append(_step(arm, branch, step, index, (opened[index], index == at), units))
    last = opened[-1] if opened else False
    return render(
        "inverse/derivation",
        name=branch.name,
        target=_target(arm, branch, units),
        steps=steps,
        result=_result(arm, branch, units) if last else None,
    )


def _target(arm: Arm, branch: Branch, units: Units) -> str:
    v = branch.derivation.number
    axes, unit = ("xy" if arm.family == "planar" else "xyz"), units.lengths
    point = ", ".join(unit.number(v(f"p_{axis}")) for axis in axes)
    if arm.family == "planar":
        return f"Target now: p = ({point}){unit.suffix}"
    direction = ", ".join(fixed(v(f"a_{axis}"), 3) for axis in axes)
    return f"Target now: p = ({point}){unit.suffix}, a = ({direction})"


def _step(
    arm: Arm, branch: Branch, step: DerivedStep, index: int, how: tuple[bool, bool], units: Units
) -> dict[str, object]:
    is_open, here = how
    way = branch.name.split(" · ")[step.split] if step.split >= 0 and is_open and step.failure is None else ""
    note, symbol, color = "", "", "blue"
    if step.failure is not None:
        note, symbol, color = words.failure_text(step, units), "✕", "vermilion"
    elif special := words.special_text(arm, step):
        note, symbol, color = special, "!", "amber"
    lines = [
        _line(line, is_open or step.failure is not None, units) for line in step.lines if line.text or is_open
    ]
    return {
        "key": step.key,
        "number": index + 1,
        "title": words.title(arm, step.key),
        "way": way,
        "open": is_open,
        "here": here,
        "lines": lines,
        "note": note,
        "symbol": symbol,
        "color": color,
        "code": step.failure or step.special or "",
    }


def _line(line: Line, is_open: bool, units: Units) -> dict[str, object]:
    sides = [line.name, *([line.means] if line.means else []), *([line.text] if line.text else [])]
    return {
        "name": line.name,
        "formula": Markup(formulas.mathml(*sides)),
        "value": value_text(line, units) if is_open else "",
    }


def value_text(line: Line, units: Units) -> str | Markup:
    """The value of a line, in the reader's units."""
    match line.kind:
        case "length":
            return units.lengths.text(float(line.value))
        case "angle":
            return units.angles.text(float(line.value), 2)
        case "number":
            return fixed(float(line.value), 4)
        case "point":
            numbers = ", ".join(units.lengths.number(x) for x in np.asarray(line.value).tolist())
            return f"({numbers}){units.lengths.suffix}"
        case "direction":
            return f"({', '.join(fixed(x, 4) for x in np.asarray(line.value).tolist())})"
        case "rotation":
            return _matrix(np.asarray(line.value))


def _matrix(R: Array) -> Markup:
    rows = "".join(
        "<mtr>" + "".join(f"<mtd><mn>{fixed(x, 3)}</mn></mtd>" for x in row) + "</mtr>" for row in R.tolist()
    )
    return Markup(
        f'<math xmlns="http://www.w3.org/1998/Math/MathML"><mtable class="kb-matrix-cells">{rows}</mtable></math>'
    )


def _result(arm: Arm, branch: Branch, units: Units) -> dict[str, str]:
    """Where the branch leads, checked by forward kinematics."""
    if branch.q is None:
        failed = branch.derivation.failed
        title = "" if failed is None else words.title(arm, failed.key)
        return {
            "code": "failed",
            "symbol": "✕",
            "color": "vermilion",
            "text": f"{branch.name}: ends at “{title}”.",
        }
    position, turn = small(branch.error[0], units.lengths), small(branch.error[1], units.angles)
    check = Markup("Check by forward kinematics: {} and {} from the target.").format(position, turn)
    if branch.outside:
        text = (
            Markup("{} ").format(check)
            + f"{outside_text(branch, units).capitalize()}: the arm itself cannot take this branch."
        )
        return {"code": "limits", "symbol": "!", "color": "amber", "text": text}
    return {
        "code": "reached",
        "symbol": "✓",
        "color": "green",
        "text": check + " All joints are within their limits.",
    }


def outside_text(branch: Branch, units: Units) -> str:
    """Which joints are outside their limits, and by how much."""
    joints = [f"joint {i + 1} by {units.angle(excess)}" for i, excess in branch.outside]
    return f"outside limits: {', '.join(joints)}"


def tree_html(arm: Arm, nodes: Sequence[Node], inside: int, opened: dict[StepKey, bool], units: Units) -> str:
    """The tree of branches; what the student is still asked for is left out."""
    rows = []
    for node in nodes:
        row: dict[str, object] = {"depth": node.depth, "word": node.word, "followed": node.followed, "value": ""}
        row["leaf"] = node.leaf.number if node.leaf is not None else None
        if opened.get(node.key, False) and node.value is not None:
            row["value"] = f"{words.sub(node.angle)} = {units.angles.text(node.value)}"
        row |= _status(arm, node, opened, units)
        rows.append(row)
    return render("inverse/tree", nodes=rows, inside=inside if opened.get("joints") else "")


def _status(arm: Arm, node: Node, opened: dict[StepKey, bool], units: Units) -> dict[str, object]:
    if node.failed is not None:
        if not opened.get(node.failed.key, False):
            return {"state": "", "status": "", "symbol": "", "color": ""}
        title = words.title(arm, node.failed.key)
        return {
            "state": "failed",
            "status": f"no solution, ends at “{title}”",
            "symbol": "✕",
            "color": "vermilion",
        }
    if node.leaf is None or not opened.get("joints", False):
        return {"state": "", "status": "", "symbol": "", "color": ""}
    if node.leaf.outside:
        return {"state": "limits", "status": outside_text(node.leaf, units), "symbol": "!", "color": "amber"}
    return {"state": "inside", "status": "within limits", "symbol": "✓", "color": "green"}


def others_html(robot: Robot) -> str:
    """That there is no derivation for an arm."""
    reason = "its angles do not follow one after the other from such triangles."
    return render("inverse/others", robot=robot.name, reason=reason)
