"""``kinboard compare``: whether two arms are the same, and what was mistyped if not."""

from __future__ import annotations

from argparse import Namespace

from app.cli.terminal import Notation, named_robot, print_json, quantity, table, units_of
from app.shared.answers.comparison import comparison_answer
from kin import Comparison, Robot, compare
from kin.comparison import messages
from kin.units import Units


def run(arguments: Namespace) -> int:
    """Compare two arms; the exit code is 1 if they are different."""
    a, b = named_robot(arguments, arguments.reference), named_robot(arguments, arguments.other)
    units, tolerance = units_of(arguments), None
    if arguments.tolerance is not None:
        length, angle = arguments.tolerance
        field = "--tolerance"
        tolerance = quantity(length, units.lengths, field), quantity(angle, units.angles, field)
    found = compare(a, b, frames="free" if arguments.free else "fixed", tolerance=tolerance)
    if arguments.json:
        print_json(comparison_answer(found, a, b))
    else:
        print("\n".join(_lines(found, a, b, units)))
    return 0 if found.is_same else 1


def _lines(found: Comparison, a: Robot, b: Robot, units: Units) -> list[str]:
    lines = [messages.verdict(found, a, b, units)]
    if found.is_same and found.mapping is not None and found.verdict != "identical":
        notation = Notation(a, not units.degrees)
        rows = [
            [str(i + 1), joint.name, "+" if sign > 0.0 else "-", notation.joint(i, offset)]
            for i, (joint, sign, offset) in enumerate(
                zip(a.joints, found.mapping.signs.tolist(), found.mapping.offsets.tolist(), strict=True)
            )
        ]
        lines += ["", table(["", "joint", "sign", "zero of a in b"], rows)]
    lines += ["", *(f"- {messages.difference(each, a, b, units)}" for each in found.differences)][: 1 + 8]
    if found.explanations:
        lines += ["", *(messages.explanation(each, a, b, units) for each in found.explanations)]
    elif found.verdict == "different":
        tried = "no pair of mistakes explains" if found.complete else "no pair that was tried in time explains"
        lines += ["", f"No single mistake and {tried} the difference."]
    return [line for k, line in enumerate(lines) if line or (k + 1 < len(lines) and lines[k + 1])]
