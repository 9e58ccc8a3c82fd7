"""``kinboard calibrate``: postures to touch in, and the table of an arm from what its joints read in touches."""

from __future__ import annotations

import csv
import io
import math
import re
from argparse import Namespace
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from app.cli.pipes.sink import write_output
from app.cli.pipes.source import opened_source
from app.cli.terminal import (
    Notation,
    mounted_robot_of,
    pose_of,
    print_json,
    quantity,
    report_beside,
    table,
    units_of,
)
from app.exports.touch import as_own, report, sheet_svg
from app.shared.answers.calibration import CalibrationAnswer, TouchPlanAnswer
from kin import InputError, Robot, robot_to_toml
from kin.calibration import (
    Calibration,
    TableTolerances,
    TouchBoard,
    TouchFixture,
    TouchNoise,
    TouchPlan,
    calibrate,
    touch_postures,
)
from kin.calibration.words import millimetres
from kin.transforms import Array

PRINTED, WAVE = 0.005, math.radians(0.5)
TOUCHES = 20


class Read(NamedTuple):
    """Touches of a file: the place of each in it, joint values ``(k, n)``, and sockets ``(k,)`` from 0."""

    places: list[str]
    q: Array
    sockets: Array


def run(arguments: Namespace) -> int:
    """Propose touches, or fit the table; the exit code is 1 if touches contradict each other."""
    robot, fixture = mounted_robot_of(arguments), fixture_of(arguments)
    if arguments.print is not None:
        if arguments.sheet is None:
            raise InputError("--print", arguments.print, "with --sheet: other boards are not printed on paper")
        write_output(arguments.print, sheet_svg(arguments.sheet), "--print")
    given = _touches(robot, arguments.touches) if arguments.touches is not None else None
    noise = TouchNoise.of(robot)
    if arguments.noise is not None:
        noise = replace(noise, joint=quantity(arguments.noise, units_of(arguments).angles, "--noise"))
    assumed = TableTolerances.of(robot)
    tolerances = replace(
        assumed,
        scale=PRINTED if arguments.printed else assumed.scale,
        wave=WAVE if arguments.waves else 0.0,
        keep_family=arguments.keep_family,
    )
    try:
        if given is None or arguments.plan is not None:
            done = None if given is None else (given.q, given.sockets)
            plan = _proposed(robot, fixture, done, tolerances, noise, arguments)
            if arguments.output is not None:
                write_output(arguments.output, _postures(robot, plan))
            with report_beside(arguments.output, arguments.print):
                return _print_plan(robot, plan, arguments)
        found = calibrate(robot, given.q, given.sockets, fixture, tolerances=tolerances, noise=noise)
    except InputError as error:
        raise _as_typed(error, given, fixture) from None
    found = replace(found, robot=as_own(found.robot))
    if arguments.output is not None:
        write_output(arguments.output, robot_to_toml(found.robot))
    if arguments.html is not None:
        write_output(arguments.html, report(found, given.sockets.astype(int).tolist()), "--html")
    with report_beside(arguments.output, arguments.print, arguments.html):
        return _print_fit(found, arguments)


def _proposed(
    robot: Robot,
    fixture: TouchFixture,
    done: tuple[Array, Array] | None,
    tolerances: TableTolerances,
    noise: TouchNoise,
    arguments: Namespace,
) -> TouchPlan:
    """The plan of ``--plan``."""
    height = None
    if arguments.table is not None:
        height = quantity(arguments.table, units_of(arguments).lengths, "--table")
    return touch_postures(
        robot,
        fixture,
        TOUCHES if arguments.plan is None else arguments.plan,
        places=_places(arguments),
        table=height,
        done=done,
        tolerances=tolerances,
        noise=noise,
    )


def fixture_of(arguments: Namespace) -> TouchFixture:
    """The fixture of ``--pin``, ``--bar`` or ``--sheet`` at its places."""
    units = units_of(arguments)
    if arguments.bar is not None:
        board = TouchBoard.bar(quantity(arguments.bar, units.lengths, "--bar"))
    else:
        board = TouchBoard.pin() if arguments.sheet is None else TouchBoard.sheet(arguments.sheet)
    places = _places(arguments)
    if arguments.marked and places is None:
        raise InputError("--marked", "no --place", "--place with the pose of each board")
    count = len(places) if places is not None else arguments.places
    return TouchFixture([board] * count, arguments.plane, places if arguments.marked else None)


def _places(arguments: Namespace) -> list[Array] | None:
    """The poses of ``--place``."""
    units = units_of(arguments)
    return [pose_of(texts, "--place", units) for texts in arguments.place] or None


def _columns(robot: Robot) -> list[str]:
    return ["socket", *(f"q{i + 1}" for i in range(robot.n))]


def _touches(robot: Robot, file: str) -> Read:
    """The touches of a file."""
    with opened_source(file, "TOUCHES") as opened:
        rows = opened.numbers(_columns(robot))
    values = np.array([row for _, row in rows]).reshape(-1, robot.n + 1)
    read = ~np.isnan(values).all(axis=1)
    return Read(
        [place for (place, _), kept in zip(rows, read, strict=True) if kept],
        values[read, 1:],
        values[read, 0] - 1.0,
    )


def _as_typed(error: InputError, given: Read | None, fixture: TouchFixture) -> InputError:
    """The error with the line of the file in which a touch is, or the option; sockets are counted from 1 here."""
    where = re.fullmatch(r"'(the plane|socket (\d+)( at .*))'", error.value)
    if where is not None:
        what = where[1] if where[2] is None else f"socket {int(where[2]) + 1}{where[3]}"
        return InputError("--place, --table", what, error.expected)
    if option := {"wave": "--waves", "count": "--plan", "q": "TOUCHES"}.get(error.field):
        return error.renamed(option)
    match = re.fullmatch(r"(q|done\[0\]|sockets|done\[1\])\[(\d+)\](?:\[(\d+)\])?", error.field)
    if match is None or given is None:
        return error
    k = int(match[2])
    if match[3] is not None:
        return error.renamed(f"{given.places[k]}, q{int(match[3]) + 1}")
    valid = f"a socket of the fixture, 1 to {len(fixture.local)}" + (
        ", or 0 for its plane" if fixture.plane else ""
    )
    return InputError(f"{given.places[k]}, socket", float(given.sockets[k]) + 1.0, valid)


def _postures(robot: Robot, plan: TouchPlan) -> str:
    """The postures of a plan as a table (CSV)."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(_columns(robot))
    rows.writerows([socket + 1, *q] for socket, q in zip(plan.sockets.tolist(), plan.q.tolist(), strict=True))
    return text.getvalue()


def _print_plan(robot: Robot, plan: TouchPlan, arguments: Namespace) -> int:
    """Print a plan."""
    if arguments.json:
        return print_json(TouchPlanAnswer.of(plan))
    notation = Notation(robot, arguments.rad)
    print(plan.text)
    for b, T in enumerate(plan.places):
        x, y, z = (f"{notation.length(value)} {notation.of_length}" for value in T[:3, 3].tolist())
        yaw = math.atan2(T[1, 0], T[0, 0])
        print(f"board {b + 1}  at about x {x}, y {y}, z {z}, turned by {notation.angle(yaw)} about z")
    shown = [
        [
            str(k + 1),
            str(socket + 1) if socket >= 0 else "plane",
            *(notation.joint(i, value) for i, value in enumerate(q)),
        ]
        for k, (socket, q) in enumerate(zip(plan.sockets.tolist(), plan.q.tolist(), strict=True))
    ]
    print("\n" + table(["touch", "socket", *(joint.name for joint in robot.joints)], shown))
    return 0


def _print_fit(found: Calibration, arguments: Namespace) -> int:
    """Print what was found."""
    if arguments.json:
        print_json(CalibrationAnswer.of(found))
    else:
        print(found.text)
        seen = [error for error in found.errors if error.seen]
        print("\n" + "\n".join(f"  {error.text}" for error in seen))
        left = len(found.errors) - len(seen)
        if left:
            print(f"  {left} more are not seen; --json has them, with the reason")
        print("\ntouch  off by")
        for k, miss in enumerate(found.misses.tolist()):
            note = "" if k in found.kept else "  left out"
            print(f"{k + 1:5d}  {millimetres(miss)}{note}")
    return 1 if found.faults or found.noise >= 2.0 else 0
