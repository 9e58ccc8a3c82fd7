"""``kinboard fk``: the pose of the tool for joint values."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterator
from itertools import chain

import numpy as np

from app.cli.pipes.poses import INVALID, PoseTable, invalid_rows
from app.cli.pipes.sink import Sink, form_of, opened_sink
from app.cli.pipes.source import Source, opened_source
from app.cli.terminal import (
    Notation,
    clean,
    configuration,
    frame_of,
    mounted_robot_of,
    print_json,
    table,
    units_of,
)
from app.shared.answers.fk import fk_answers
from kin import InputError, Robot, fk
from kin.axes import inverse
from kin.frames import TOOL, WORLD
from kin.motors import to_pendant
from kin.motors.pendant import shown_limits
from kin.poses import form_named
from kin.transforms import Array


def run(arguments: Namespace) -> int:
    """Print the pose of the tool."""
    robot = mounted_robot_of(arguments)
    if arguments.frame == TOOL:
        raise InputError("--frame", TOOL, "world, base or a workpiece")
    T = None if arguments.frame == WORLD else frame_of(robot, arguments)
    if arguments.configurations is not None:
        return _run_many(robot, arguments, T)
    for option in ("output", "format"):
        if getattr(arguments, option) is not None:
            raise InputError(f"--{option}", getattr(arguments, option), "--configurations FILE as well")
    if not arguments.q:
        raise InputError("q", "nothing", f"{robot.n} joint values, or --configurations FILE")
    q = configuration(robot, arguments.q, "q", units_of(arguments), arguments.pendant)
    answer = fk_answers(robot, q[None], arguments.frames, arguments.frame, T, arguments.form)[0]
    if arguments.json:
        return print_json(answer)
    units = Notation(robot, arguments.rad)
    values = to_pendant(robot, q) if arguments.pendant else q
    limits = shown_limits(robot, q) if arguments.pendant else [joint.limits for joint in robot.joints]
    rows = [
        [
            joint.name,
            units.joint(i, values[i]),
            " … ".join(units.joint(i, limit) for limit in limits[i] or ()),
            "" if robot.lower[i] <= q[i] <= robot.upper[i] else "outside limits",
        ]
        for i, joint in enumerate(robot.joints)
    ]
    print(f"{robot.name} ({robot.id})\n")
    print(table(["joint", "value", "limits", ""], rows))
    frames = [("tool", answer.pose)] + [(frame.name, frame.pose) for frame in answer.frames or ()]
    if arguments.frame != WORLD:
        print(f"\nin the frame {arguments.frame}:", end="")
    if arguments.form is not None:
        form = form_named(arguments.form, "--form")
        texts = [(name, form.text(np.array(pose.matrix), units_of(arguments))) for name, pose in frames]
        print()
        for name, text in texts:
            print(name, text, sep="\n" if "\n" in text else "  ")
        return 0
    rows = [
        [name, *(units.length(x) for x in pose.position), *(f"{clean(w, 5)}" for w in pose.wxyz)]
        for name, pose in frames
    ]
    print("\n" + table(["frame", *(f"{axis} {units.of_length}" for axis in "xyz"), *"wxyz"], rows))
    return 0


def _run_many(robot: Robot, arguments: Namespace, T_world_frame: Array | None) -> int:
    """Write the poses for the rows of a file, or of standard input."""
    if arguments.q:
        raise InputError("q", arguments.q, "no joint values besides --configurations")
    output, table = arguments.output or "-", PoseTable.named(arguments.form)
    count = invalid = 0
    with opened_source(arguments.configurations, "--configurations") as source:
        form = form_of(output, arguments.format, source.form)
        pieces = _pieces(source, robot, arguments)
        first = next(pieces)  # what is wrong at once leaves no file
        with opened_sink(output, form, [*table.names, "in_limits", "reason"]) as sink:
            for q, reasons in chain([first], pieces):
                _put(sink, robot, q, reasons, arguments, T_world_frame, table)
                count, invalid = count + len(q), invalid + len(reasons)
    if invalid:
        said = invalid_rows(invalid, "configuration").removeprefix(";")
        print(f"kinboard: of {count} configurations{said}", file=sys.stderr)
    return 1 if invalid else 0


def _pieces(source: Source, robot: Robot, arguments: Namespace) -> Iterator[tuple[Array, dict[int, str]]]:
    """Configurations ``(m, n)``, NaN where a row has none, and what is wrong with rows of them."""
    for q, wrong in source.configurations(robot, robot.pendant_map if arguments.pendant else None):
        if wrong and arguments.strict:
            raise next(iter(wrong.values())).error()
        q[list(wrong)] = np.nan
        yield q, {i: str(each.error()) for i, each in wrong.items()}


def _put(
    sink: Sink, robot: Robot, q: Array, reasons: dict[int, str], arguments: Namespace,
    T_world_frame: Array | None, table: PoseTable,
) -> None:  # fmt: skip
    """Write the poses for configurations ``(m, n)``; rows of NaN get none."""
    present = [not any(row) for row in np.isnan(q).tolist()]
    if sink.form == "ndjson":
        found = fk_answers(robot, q[present], arguments.frames, arguments.frame, T_world_frame, arguments.form)
        answers = iter(found)
        invalid = {i: {"status": INVALID, "reason": reason} for i, reason in reasons.items()}
        sink.answers(next(answers) if there else invalid.get(i) for i, there in enumerate(present))
        return
    T = np.full((len(q), 4, 4), np.nan)
    T[present] = fk(robot, q[present]) if T_world_frame is None else inverse(T_world_frame) @ fk(robot, q[present])
    if sink.form == "npy":
        sink.array(T)
        return
    numbers = np.full((len(q), len(table.names)), np.nan)
    numbers[present] = np.array(table.rows(T[present])).reshape(-1, len(table.names))
    inside = iter(robot.in_limits(q[present]).tolist())
    within = [next(inside) if there else "" for there in present]
    said = [reasons.get(i, "") for i in range(len(q))]
    sink.rows([*row, *rest] for row, *rest in zip(numbers.tolist(), within, said, strict=True))
