"""``kinboard move``: the motion of a program."""

from __future__ import annotations

import sys
from argparse import Namespace
from contextlib import closing
from pathlib import Path

from app.cli.pipes.sink import opened_output, opened_sink, write_output
from app.cli.pipes.source import opened_source
from app.cli.terminal import (
    Notation,
    clean,
    configuration,
    mounted_robot_of,
    obstacles_of,
    print_json,
    quantity,
    table,
    text_of,
    units_of,
    workpieces_of,
)
from app.exports.motion import FORMATS, MotionFormat
from app.exports.motion_plot import motion_plot
from app.exports.motion_samples import with_joint_names
from app.shared.answers.motion import motion_answer
from kin import InputError, Robot, plan_motion
from kin.motion import Motion, Program, SegmentTimes, parse_program, program_from_dict
from kin.transforms import Array
from kin.units import Unit, general

PER_SECOND = Unit("Hz", 1.0, 2)
LEAST_RATE, MOST_RATE = 0.1, 10_000.0
_UNITS = {"velocity": "/s", "acceleration": "/s²", "jerk": "/s³", "tool_speed": "/s", "tool_turn": "/s"}


def run(arguments: Namespace) -> int:
    """Plan the motion, print what it is, and write files; 1 if the program cannot be driven."""
    robot = mounted_robot_of(arguments)
    if (arguments.program is None) is (arguments.programs is None):
        raise InputError("PROGRAM", arguments.program, "either a program or --programs")
    rate = quantity(arguments.rate, PER_SECOND, "--rate")
    if not LEAST_RATE <= rate <= MOST_RATE:
        raise InputError("--rate", rate, f"{LEAST_RATE:g} to {MOST_RATE:g} samples per second")
    sampled = None if arguments.no_samples else rate
    if arguments.programs is not None:
        return _run_many(robot, arguments, sampled)
    kind = _format(arguments)
    if arguments.picture is not None and Path(arguments.picture).suffix.lower() != ".svg":
        raise InputError("--picture", arguments.picture, "a name that ends in .svg")
    motion = _planned(
        robot,
        parse_program(text_of(arguments.program, "PROGRAM"), robot, workpieces_of(arguments)),
        _start(robot, arguments),
        arguments,
    )
    if arguments.json and arguments.output != "-":
        print_json(motion_answer(motion, sampled))
    elif arguments.output != "-" and not arguments.json:
        print(motion.explain(units_of(arguments)))
        if motion.part is not None:
            print(f"\nUp to there: {motion.part.explain(units_of(arguments))}")
        if motion.driven is not None:
            print("\n" + _report(motion.driven, Notation(robot, arguments.rad)))
    elif not motion.planned:
        print(motion.reason, file=sys.stderr)
    driven = motion.driven if motion.planned or arguments.partial else None
    if driven is not None and arguments.joint_names is not None:
        driven = with_joint_names(driven, arguments.joint_names, "--joint-names")
    if driven is not None:
        _write_files(arguments, driven, kind, rate)
    return 0 if motion.planned else 1


def _start(robot: Robot, arguments: Namespace) -> Array | None:
    texts = arguments.start
    return None if texts is None else configuration(robot, texts, "--start", units_of(arguments))


def _planned(robot: Robot, program: Program, q_start: Array | None, arguments: Namespace) -> Motion:
    return plan_motion(
        robot,
        program,
        q_start,
        avoid_self_collision=arguments.avoid_self_collision,
        obstacles=obstacles_of(arguments),
    )


def _run_many(robot: Robot, arguments: Namespace, rate: float | None) -> int:
    """Answer each line that holds a program as it arrives; 1 if one cannot be driven."""
    for option in ("format", "picture"):
        if getattr(arguments, option) is not None:
            raise InputError(f"--{option}", getattr(arguments, option), f"no --{option} besides --programs")
    q_start, workpieces, refused = _start(robot, arguments), workpieces_of(arguments), False
    with (
        opened_source(arguments.programs, "--programs") as source,
        opened_sink(arguments.output or "-", "ndjson", ()) as sink,
    ):
        for place, data in source.objects():
            try:
                motion = _planned(robot, program_from_dict(data, robot, workpieces), q_start, arguments)
            except InputError as error:
                raise error.within(place) from None
            sink.answers([motion_answer(motion, rate)])
            refused = refused or not motion.planned
    return 1 if refused else 0


def _write_files(arguments: Namespace, motion: Motion, kind: MotionFormat | None, rate: float) -> None:
    if arguments.output is not None and kind is not None:
        _write(arguments.output, motion, kind, rate, arguments.json)
    if arguments.picture is not None:
        write_output(arguments.picture, motion_plot(motion), "--picture")


def _format(arguments: Namespace) -> MotionFormat | None:
    """The format of the file; None: none is written."""
    if arguments.output is None:
        return None
    if arguments.format is not None:
        return FORMATS[arguments.format]
    fitting = [each for each in FORMATS.values() if arguments.output.endswith(each.suffix)]
    found = max(fitting, key=lambda each: len(each.suffix), default=None)
    if found is None:
        endings = ", ".join(each.suffix for each in FORMATS.values())
        raise InputError("--output", arguments.output, f"a name that ends in {endings}, or --format")
    return found


def _write(path: str, motion: Motion, kind: MotionFormat, rate: float, quiet: bool) -> None:
    size = 0
    with opened_output(path) as file, closing(kind.pieces(motion, rate)) as pieces:
        for piece in pieces:
            file.write(piece)
            size += len(piece)
        file.flush()
    if path != "-" and not quiet:
        print(f"\n{path}: {motion.duration:.3f} s, {size} bytes")


def _name(times: SegmentTimes) -> str:
    """The name of a segment, and how far it opens the gripper."""
    opening = "" if times.opening is None else f"to {general(100.0 * times.opening, 3)} %"
    return " ".join(filter(None, (opening, times.name)))


def _report(motion: Motion, units: Notation) -> str:
    """When each segment is driven, and the peaks."""
    segments = [
        [str(each.index + 1), each.kind, _name(each), f"{each.start:.3f}", f"{each.end:.3f}"]
        for each in motion.segments
    ]
    peaks = []
    for peak in motion.peaks:
        turns = peak.quantity == "tool_turn" or (peak.joint is not None and motion.robot.revolute[peak.joint])

        def shown(value: float, turns: bool = bool(turns), unit: str = _UNITS[peak.quantity]) -> str:
            return (units.angle(value) if turns else f"{units.length(value)} {units.of_length}") + unit

        limit = "" if peak.limit is None else shown(peak.limit) + (" (assumed)" if peak.assumed else "")
        share = "" if peak.ratio is None else f"{clean(100.0 * peak.ratio, 1)} %"
        peaks.append([peak.name, peak.quantity.replace("_", " "), shown(peak.peak), limit, share])
    return (
        table(["", "kind", "name", "from s", "to s"], segments)
        + "\n\n"
        + table(["joint", "largest", "value", "limit", "share"], peaks)
    )
