"""``kinboard robots``, ``kinboard compare`` and ``kinboard motors``.

The robots and the DH table of one; whether two are the same; the signs and zeros of one's motors.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace

import numpy as np

from app.cli.pipes.sink import write_output
from app.cli.terminal import (
    Notation,
    clean,
    configuration,
    named_robot,
    print_json,
    quantity,
    report_beside,
    robot_of,
    store_of,
    table,
    units_of,
)
from app.shared.answers.comparison import comparison_answer
from app.shared.answers.motors import MotorMatchAnswer
from app.shared.answers.robots import RobotAnswer, robot_answer
from app.shared.finding import find_robots
from kin import InputError, Robot, compare, robot_to_toml
from kin.comparison import Comparison, messages
from kin.files.numbers import LARGEST, number_of
from kin.motors import match_motors, motor_poses
from kin.motors.joints import moving_motors
from kin.transforms import Array
from kin.units import Units


def run(arguments: Namespace) -> int:
    """List all robots, or describe one."""
    if arguments.robot is not None:
        robot = robot_of(arguments)
        answer = robot_answer(robot)
        if arguments.json:
            return print_json(answer)
        print(f"{robot.name} ({robot.id})\n{robot.description}\n{robot.source}")
        facts = {"maker": robot.maker, "payload": _kilograms(robot.payload), "mass": _kilograms(robot.mass)}
        print("".join(f"{name}: {fact}\n" for name, fact in facts.items() if fact))
        print(_dh_table(answer, Notation(robot, arguments.rad)))
        return 0
    answers = [robot_answer(robot) for robot in find_robots(store_of(arguments).robots, arguments.find)]
    if arguments.json:
        return print_json({"robots": answers})
    rows = [
        [s.id, str(s.n), s.convention, f"{clean(s.reach * 1e3, 0)} mm", s.solver, s.name, s.maker] for s in answers
    ]
    print(table(["robot", "joints", "convention", "reach at most", "solver", "name", "maker"], rows))
    return 0


def _kilograms(weight: float | None) -> str:
    return "" if weight is None else f"{weight:g} kg"


def _dh_table(answer: RobotAnswer, units: Notation) -> str:
    limits = {joint.name: (joint.index, joint.limits) for joint in answer.joints}
    rows = []
    for row in answer.rows:
        index, bounds = limits.get(row.name, (0, None))
        cells = [
            units.angle(row.theta),
            units.length(row.d),
            units.length(row.a),
            units.angle(row.alpha),
        ]
        kind = row.kind if not row.follows else f"{row.kind}, {row.ratio:g} × {row.follows}"
        rows.append([row.name, kind, *cells, " … ".join(units.joint(index, x) for x in bounds or ())])
    length = units.of_length
    head = ["row", "kind", "theta", f"d {length}", f"a {length}", "alpha", "limits"]
    return f"DH table, {answer.convention} convention\n\n" + table(head, rows)


def run_compare(arguments: Namespace) -> int:
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
        print("\n".join(_comparison(found, a, b, units)))
    return 0 if found.is_same else 1


def run_motors(arguments: Namespace) -> int:
    """Find the signs and zeros of motors, or propose poses for it; the exit code is 1 if one does not match."""
    robot, units = robot_of(arguments), units_of(arguments)
    given = [configuration(robot, texts, "--pose", units) for texts in arguments.pose]
    if not arguments.read:
        poses = np.array(given) if given else motor_poses(robot)
        if arguments.json:
            print_json({"q": poses.tolist()})
        else:
            print("\n".join(_poses(robot, poses, arguments.rad)))
        return 0
    readings = [[_reading(text) for text in texts] for texts in arguments.read]
    if given and len(given) != len(readings):
        raise InputError("--read", f"{len(readings)} poses", f"as many as --pose: {len(given)}")
    if not given and not 2 <= len(readings) <= len(motor_poses(robot)):
        raise InputError(
            "--read", f"{len(readings)} poses", "2 or 3, those that are proposed; --pose gives others"
        )
    found = match_motors(robot, given or motor_poses(robot)[: len(readings)], readings)
    if arguments.output is not None:
        write_output(arguments.output, robot_to_toml(replace(robot, motors=found.motors)))
    with report_beside(arguments.output):
        if arguments.json:
            print_json(MotorMatchAnswer.of(found))
        else:
            print("\n".join(finding.text for finding in found.findings))
    return 0 if found.complete else 1


def _reading(text: str) -> float:
    value = number_of(text.replace("−", "-"))
    if not abs(value) < LARGEST:
        raise InputError("--read", text, f"a number below {LARGEST:g}")
    return value


def _poses(robot: Robot, poses: Array, rad: bool) -> list[str]:
    notation = Notation(robot, rad)
    rows = [[str(k + 1), *(notation.joint(i, value) for i, value in enumerate(q))] for k, q in enumerate(poses)]
    shown = table(["pose", *(joint.name for joint in robot.joints)], rows)
    motors = ", ".join(f"{motor.id} {motor.joint}" for motor in moving_motors(robot))
    return [shown, "", f"In each pose: --read and what the motors {motors} read, in this order."]


def _tolerance(found: Comparison, units: Units) -> str:
    """What the option says of arms that are different without it, or with a smaller one."""
    allowed = messages.allowing(found, units)
    if allowed is None:
        return "--tolerance LENGTH ANGLE takes arms for one whose poses differ by no more; these differ by more."
    length, angle = allowed
    return f"{messages.nearly(found, units)} --tolerance {length} {angle} takes them for one arm."


def _comparison(found: Comparison, a: Robot, b: Robot, units: Units) -> list[str]:
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
    if not found.is_same:
        lines += ["", _tolerance(found, units)]
    return [line for k, line in enumerate(lines) if line or (k + 1 < len(lines) and lines[k + 1])]
