"""``kinboard robots``: the robots there are, and the DH table of one."""

from __future__ import annotations

from argparse import Namespace

from app.cli.terminal import Notation, clean, print_json, robot_of, store_of, table
from app.shared.answers.robots import RobotAnswer, robot_answer
from app.shared.finding import find_robots


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
        rows.append([row.name, row.kind, *cells, " … ".join(units.joint(index, x) for x in bounds or ())])
    length = units.of_length
    head = ["row", "kind", "theta", f"d {length}", f"a {length}", "alpha", "limits"]
    return f"DH table, {answer.convention} convention\n\n" + table(head, rows)
