"""``kinboard ik``: joint values for a target of the tool."""

from __future__ import annotations

import sys
from argparse import Namespace
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from app.cli.arguments.options import flag_of
from app.cli.pipes.ik import RowsQuestion, solve_rows
from app.cli.pipes.poses import PoseTable, invalid_rows
from app.cli.targets import Question, solve_file
from app.cli.terminal import (
    Notation,
    configuration,
    frame_of,
    joint_constraints,
    mounted_robot_of,
    obstacles_of,
    print_json,
    quantity,
    table,
    typed_target,
    units_of,
)
from app.shared.answers.ik import Blocked, IkAnswer, Solution, add_pendant, ik_answer
from app.shared.options import Option, declared
from kin import IKOptions, InputError, Robot
from kin.frames import TOOL
from kin.ik import Task, solve
from kin.ik.options import MASK_NAMES
from kin.poses.fields import ORIENTATIONS, orientation
from kin.transforms import Array, frame_from_approach
from kin.units import PLAIN, Unit, Units


def run(arguments: Namespace) -> int:
    """Print the solutions; 1 if there is no exact one."""
    robot = mounted_robot_of(arguments)
    units = units_of(arguments)
    if arguments.targets is not None:
        return _run_file(robot, arguments, units)
    for option in ("output", "format", "dask"):
        if getattr(arguments, option) is not None:
            raise InputError(f"--{option}", getattr(arguments, option), "--targets FILE as well")
    T, implied = _target(robot, arguments, units)
    task = _task(arguments, implied)
    q_seed = (
        None
        if arguments.seed is None
        else configuration(robot, arguments.seed, "--seed", units, arguments.pendant)
    )
    if arguments.frame == TOOL and q_seed is None:
        raise InputError("--frame", TOOL, "--seed as well, which says where the tool is")
    T = frame_of(robot, arguments, q_seed) @ T
    options = _options(robot, arguments, units, task, shown=None if arguments.json else 1)
    result = solve(robot, T, options, q_seed)
    answer = ik_answer(result)
    if arguments.pendant:
        add_pendant(robot, answer)
    if arguments.json:
        print_json(answer)
    else:
        print(result.explain(units).text + "\n")
        _print(answer, Notation(robot, arguments.rad))
        if arguments.position and not arguments.rad and np.abs(T[:3, 3]).max() < 5e-3:
            print("note: --position is in millimetres; --rad makes it metres", file=sys.stderr)
    return 0 if answer.status == "solved" else 1


def _turned(arguments: Namespace) -> str | None:
    """The name of the orientation that was typed beside the position."""
    return next((name for name in ORIENTATIONS if getattr(arguments, name) is not None), None)


def _target(robot: Robot, arguments: Namespace, units: Units) -> tuple[Array, Task]:
    """The typed target ``(4, 4)`` in its frame, and the task that it implies."""
    turned = _turned(arguments)
    if arguments.pose is not None:
        if turned or arguments.approach is not None:
            raise InputError("--pose", " ".join(arguments.pose), "no other orientation besides it")
        return typed_target(arguments.pose, arguments.form, units, robot.maker, "--pose")
    if arguments.form is not None:
        raise InputError("--form", arguments.form, "--pose or --targets as well")
    T = np.eye(4)
    T[:3, 3] = _vector(arguments.position, units.lengths, "--position")
    if arguments.approach is not None:
        T[:3, :3] = frame_from_approach(_vector(arguments.approach, PLAIN, "--approach"))
        return T, "approach"
    if turned is None:
        return T, "position"
    unit = units.angles if turned in ("rpy", "rotvec") else PLAIN
    values = _vector(getattr(arguments, turned), unit, f"--{turned}")
    try:
        T[:3, :3] = orientation(turned, values)
    except InputError as error:
        raise error.renamed(f"--{turned}") from None
    return T, "pose"


def _run_file(robot: Robot, arguments: Namespace, units: Units) -> int:
    """Solve a file of targets, and say how many have an exact solution; 1 if one has none."""
    turned = "approach" if arguments.approach is not None else _turned(arguments)
    if turned is not None:
        raise InputError("--targets", arguments.targets, f"no --{turned}: the file has the orientations")
    if arguments.frame == TOOL:
        raise InputError("--frame", TOOL, "a frame that does not move, together with --targets")
    q_seed = (
        None
        if arguments.seed is None
        else configuration(robot, arguments.seed, "--seed", units, arguments.pendant)
    )
    if _is_piped(arguments):
        if arguments.dask is not None:
            raise InputError("--dask", arguments.dask, "--targets and --output as .npy, .csv or .parquet files")
        return _run_rows(robot, arguments, units, q_seed)
    options = _options(robot, arguments, units, "pose" if arguments.mask else arguments.task or "pose")
    table = PoseTable.named(arguments.form)
    frame, strict, pendant = frame_of(robot, arguments, q_seed), arguments.strict, arguments.pendant
    question = Question(robot, options, frame, q_seed, table, strict, pendant)
    try:
        count, solved, invalid = solve_file(
            question, Path(arguments.targets), Path(arguments.output), arguments.dask
        )
    except KeyboardInterrupt:
        print("kinboard: interrupted; the same command goes on from here", file=sys.stderr)
        return 130
    said = invalid_rows(invalid, "target")
    if arguments.json:
        print_json({"targets": count, "solved": solved, "invalid": invalid})
    else:
        print(f"{arguments.output}: {solved} of {count} targets have an exact solution{said}")
    return 0 if solved == count else 1


def _is_piped(arguments: Namespace) -> bool:
    """Whether targets or solutions come or go as lines, rather than from one large file to another."""
    ends = (arguments.targets, arguments.output or "-")
    return arguments.format is not None or any(end == "-" or end.endswith((".ndjson", ".jsonl")) for end in ends)


def _run_rows(robot: Robot, arguments: Namespace, units: Units, q_seed: Array | None) -> int:
    """Solve targets as they arrive; 1 if one has no exact solution."""
    given: Task | None = "pose" if arguments.mask else arguments.task

    def options(implied: Task, shown: int | None) -> IKOptions:
        return _options(robot, arguments, units, given or implied, shown)

    def frame(name: str | None) -> Array:
        if name == TOOL:
            raise InputError("--targets", TOOL, "frames that do not move")
        return frame_of(robot, arguments, q_seed, name)

    table = PoseTable.named(arguments.form)
    strict, pendant = arguments.strict, arguments.pendant
    question = RowsQuestion(robot, q_seed, cache(options), cache(frame), table, strict, pendant)
    count, solved, invalid = solve_rows(question, arguments.targets, arguments.output or "-", arguments.format)
    said = invalid_rows(invalid, "target")
    if arguments.output not in (None, "-"):
        print(f"{arguments.output}: {solved} of {count} targets have an exact solution{said}")
    elif invalid:
        print(f"kinboard: of {count} targets{said.removeprefix(';')}", file=sys.stderr)
    return 0 if solved == count else 1


def _options(robot: Robot, arguments: Namespace, units: Units, task: Task, shown: int | None = 1) -> IKOptions:
    """What was typed, but for target, seed and frame; `shown`: how many solutions by default, None for all."""
    names = [each.name for each in fields(IKOptions) if each.name != "constraints"]
    given = {name: _option(arguments, declared()[name], units) for name in names}
    given |= {
        "task": task,
        "mask": None if arguments.mask is None else [name in arguments.mask for name in MASK_NAMES],
        "constraints": joint_constraints(robot, arguments),
        "respect_limits": not arguments.ignore_limits,
        "redundancy": _redundancy(arguments, units),
        "max_solutions": None if arguments.all else arguments.max_solutions or shown,
        "obstacles": obstacles_of(arguments),
    }
    return IKOptions(**given)


def _vector(texts: list[str], unit: Unit, field: str) -> list[float]:
    return [quantity(text, unit, field) for text in texts]


def _option(arguments: Namespace, option: Option, units: Units) -> Any:
    """What was typed for an option; a number in radians or metres."""
    value = getattr(arguments, option.name, None)
    if not option.unit or not isinstance(value, str):
        return value
    return quantity(value, units.of(option.unit == "rad"), flag_of(option.name))


def _print(answer: IkAnswer, units: Notation) -> None:
    """Print the solutions, the redundancy parameters, and the postures outside the limits."""
    listed = [(str(k + 1), solution) for k, solution in enumerate(answer.solutions)]
    if not listed and answer.closest:
        listed.append(("closest", answer.closest))
    if answer.nearest_orientation:
        listed.append(("nearest orientation", answer.nearest_orientation))
    if listed:
        print(_solutions(units, listed))
    for parameter in answer.redundancy:
        ranges = ", ".join(" … ".join(units.angle(x) for x in interval) for interval in parameter.intervals)
        print(f"\n{parameter.label} = {units.angle(parameter.value)}, possible: {ranges or 'nothing'}")
    if answer.blocked:
        needs = _needs(units, answer.blocked, len(answer.solutions) + 1)
        print("\n" + table(["posture", "outside the limits"], needs))


def _posture(branch: str) -> str:
    """The name of a posture; "" where it has only a number, which says nothing about another target."""
    return "" if branch.startswith("solution ") else branch


def _solutions(units: Notation, listed: list[tuple[str, Solution]]) -> str:
    """The table of solutions."""
    values = [each.pendant or each.q for _, each in listed]
    count = len(values[0])
    posture = [_posture(each.branch) + ("" if each.in_limits else " (outside limits)") for _, each in listed]
    head = ["", *(f"q{i + 1}" for i in range(count)), "point error", "rotation error", *["posture"] * any(posture)]
    rows = [
        [
            name,
            *(units.joint(i, value) for i, value in enumerate(shown)),
            f"{units.length(solution.position_error)} {units.of_length}",
            units.angle(solution.rotation_error),
            *[of_posture.strip()] * any(posture),
        ]
        for (name, solution), shown, of_posture in zip(listed, values, posture, strict=True)
    ]
    return table(head, rows)


def _task(arguments: Namespace, implied: Task) -> Task:
    """The task named by ``--task``, or `implied` by the target; "pose" with a mask."""
    if arguments.mask:
        if arguments.task:
            raise InputError("--task", arguments.task, "no --task together with --mask")
        if implied != "pose" and any(name.startswith("r") for name in arguments.mask):
            expected = "an orientation such as --wxyz as well as --position for rx, ry or rz"
            raise InputError("--mask", " ".join(arguments.mask), expected)
        return "pose"
    task: Task = arguments.task or implied
    if task == "pose" and implied != "pose":
        raise InputError("--task", task, "an orientation such as --wxyz as well as --position for a pose")
    if task == "approach" and implied == "position":
        raise InputError("--task", task, "--approach or --wxyz as well as --position for an approach")
    return task


def _needs(units: Notation, blocked: list[Blocked], first: int) -> list[list[str]]:
    """The joint values of each posture that are outside the limits; numbers of those without a name go on."""
    return [
        [
            _posture(branch.branch) or str(number),
            ", ".join(
                f"q{v.joint + 1} = {units.joint(v.joint, v.value)} (limit {units.joint(v.joint, v.limit)})"
                for v in branch.violations
            ),
        ]
        for number, branch in enumerate(blocked, first)
    ]


def _redundancy(arguments: Namespace, units: Units) -> float | dict[str, float] | None:
    """``--redundancy psi=20 --redundancy …`` as values by name in radians, or a single value without a name."""
    field = "--redundancy"
    given: list[tuple[str, list[str]]] = arguments.redundancy or []
    values = {name: quantity(":".join(texts), units.angles, field) for name, texts in given}
    if len(given) == 1 and "" in values:
        return values[""]
    if "" in values:
        raise InputError(field, given, "NAME=VALUE when more than one is given")
    return values or None
