"""``kinboard way``: a way around obstacles. ``kinboard singularity``: a way out of a singularity."""

from __future__ import annotations

import sys
from argparse import Namespace
from dataclasses import replace

from app.cli.pipes.sink import write_output
from app.cli.terminal import (
    Notation,
    configuration,
    mounted_robot_of,
    obstacles_of,
    print_json,
    quantity,
    table,
    units_of,
)
from app.exports.program_toml import toml_of
from app.exports.progress import percent_bar
from app.shared.answers.way import exits_answer, way_answer
from kin import InputError, leave_singularity
from kin.files.numbers import index_of
from kin.motion import JointTarget, Ptp
from kin.motors import to_pendant
from kin.units import Unit
from kin.way import MOST_SEED, find_way, way_program

SECONDS, SIGMA = Unit("s", 1.0, 2), Unit("", 1.0, 4)


def run(arguments: Namespace) -> int:
    """Search a way, print its waypoints, and write its program; 1 if none is found."""
    robot, units = mounted_robot_of(arguments), units_of(arguments)
    start = arguments.start
    q_start = robot.q_home if start is None else configuration(robot, start, "--start", units)
    q_goal = configuration(robot, arguments.goal, "--goal", units)
    avoided = {"avoid_self_collision": arguments.avoid_self_collision, "obstacles": obstacles_of(arguments)}
    seed = index_of(arguments.seed, MOST_SEED + 1)
    if seed is None:
        raise InputError("--seed", arguments.seed, f"a whole number from 0 to {MOST_SEED}")
    seconds = quantity(arguments.time_limit, SECONDS, "--time-limit")
    with percent_bar(sys.stderr.isatty() and not arguments.json) as progress:
        way = find_way(robot, q_start, q_goal, seed=seed, time_limit=seconds, progress=progress, **avoided)
    motion = way_program(way, **avoided) if way.found else None
    is_piped = arguments.output == "-"  # then standard output has the program alone
    if arguments.json and not is_piped:
        print_json(way_answer(way, motion))
    elif not arguments.json:
        print(way.explain(units), file=sys.stderr if is_piped else sys.stdout)
    if motion is None or way.q is None:
        return 1
    if not arguments.json and not is_piped:
        notation = Notation(robot, arguments.rad)
        rows = [
            [str(k + 1), *(notation.joint(i, value) for i, value in enumerate(q))] for k, q in enumerate(way.q)
        ]
        print("\n" + table(["", *(joint.name for joint in robot.joints)], rows))
        print("\nIts program: " + motion.explain(units))
    if arguments.output is not None:
        first = Ptp(JointTarget(tuple(q_start.tolist())))
        program = replace(motion.program, segments=(first, *motion.program.segments))
        write_output(arguments.output, toml_of(program, robot.name))
    return 0 if motion.planned else 1


def run_out(arguments: Namespace) -> int:
    """Print how near the arm is to a singularity, and the joint values to which the ways out lead.

    Returns 1 if the arm is near one and there is no way out.
    """
    robot, units = mounted_robot_of(arguments), units_of(arguments)
    q = configuration(robot, arguments.q, "q", units, arguments.pendant)
    found = leave_singularity(
        robot,
        q,
        margin=None if arguments.margin is None else quantity(arguments.margin, SIGMA, "--margin"),
        obstacles=obstacles_of(arguments),
        avoid_self_collision=arguments.avoid_self_collision,
    )
    if arguments.json:
        print_json(exits_answer(found, arguments.pendant))
    else:
        print(found.explain(units))
    if found.exits and not arguments.json:
        if arguments.pendant and robot.pendant_map is not None:
            print("The sentences count joint values of the table; the rows below are as on the pendant.")
        notation = Notation(robot, arguments.rad)
        ends = [to_pendant(robot, each.q[-1]) if arguments.pendant else each.q[-1] for each in found.exits]
        rows = [
            [str(k + 1), *(notation.joint(i, value) for i, value in enumerate(end))] for k, end in enumerate(ends)
        ]
        print("\n" + table(["to", *(joint.name for joint in robot.joints)], rows))
    clear = found.cause is not None and found.cause.code == "clear"
    return 0 if found.exits or clear else 1
