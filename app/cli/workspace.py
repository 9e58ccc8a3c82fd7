"""``kinboard workspace``: sizes of the workspace, or its cloud as a file, a picture or a solid.

``kinboard postures``: how many there are where. ``kinboard cuspidal``: whether one turns into another.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path

from app.cli.pipes.sink import write_output
from app.cli.terminal import (
    Notation,
    configuration,
    joint_constraints,
    print_json,
    robot_of,
    table,
    typed_target,
    units_of,
)
from app.exports import postures
from app.exports.formats import FORMATS
from app.exports.picture import draw
from app.exports.progress import percent_bar
from app.exports.save import opened, reading, save
from app.shared.answers.postures import CuspidalAnswer, PostureMapAnswer
from app.shared.answers.workspace import workspace_answer
from app.shared.clouds import Cloud
from kin import InputError, JointConstraints, Robot, cuspidal, posture_map
from kin.files.numbers import index_of
from kin.workspace import WorkspaceFacts, sample_workspace, workspace_facts, workspace_section

_INTERRUPTED = 130  # exit code that shells expect after Ctrl-C


def run(arguments: Namespace) -> int:
    """Print the sizes, or write the files that are named."""
    robot = robot_of(arguments)
    constraints = joint_constraints(robot, arguments)
    files = (
        (arguments.output, _cloud_writer),
        (arguments.picture, _picture_writer),
        (arguments.hull, _hull_writer),
    )
    if any(target is not None for target, _ in files):
        cloud = _cloud(robot, arguments, constraints)
        # Every name is checked before the first file is written.
        ready = [write(cloud, target, arguments) for target, write in files if target is not None]
        return max(write() for write in ready)
    answer = workspace_answer(_facts(robot, constraints, arguments))
    if arguments.json:
        return print_json(answer)
    units = Notation(robot, arguments.rad)
    spans = [
        *(("x", answer.x), ("y", answer.y), ("z", answer.z)),
        *(("from the axis of joint 1", answer.radius), ("from the shoulder", answer.reach)),
    ]
    rows = [[name, units.length(span.least.value), units.length(span.largest.value)] for name, span in spans]
    print(f"{robot.name} ({robot.id})\n")
    print(table([f"tool point, {units.of_length}", "least", "largest"], rows) + "\n")
    for name, unit, estimate in (("volume", "m³", answer.volume), ("surface", "m²", answer.surface)):
        if estimate is not None:
            print(f"{name:<8} {estimate.value:.4g} ± {estimate.error:.1g} {unit}: {estimate.method}")
    return 0


def _facts(robot: Robot, constraints: JointConstraints, arguments: Namespace) -> WorkspaceFacts:
    return workspace_facts(robot, constraints=constraints, effort=arguments.effort)


def _cloud(robot: Robot, arguments: Namespace, constraints: JointConstraints) -> Cloud:
    """The cloud as described by the arguments; raises `InputError` for an invalid one before any work begins."""
    cloud = Cloud(
        robot,
        arguments.n,
        arguments.seed,
        arguments.strategy,
        tuple(dict.fromkeys(arguments.measure)),
        constraints,
    )
    # Checks its arguments when called, and samples nothing until it is read.
    sample_workspace(
        robot,
        cloud.n,
        seed=cloud.seed,
        strategy=cloud.strategy,
        constraints=constraints,
        measure=cloud.measures,
    )
    return cloud


def _cloud_writer(cloud: Cloud, target: str, arguments: Namespace) -> Callable[[], int]:
    kind = arguments.format or Path(target).suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        expected = "a name that ends in " + ", ".join(f".{name}" for name in FORMATS) + ", or --format"
        raise InputError("--output", target, expected)

    def act() -> str:
        size = save(cloud, target, kind, arguments.q, _shows_progress(arguments))
        return f"{cloud.n} points, {size / 1e6:.1f} MB"

    return partial(_writing, target, act)


def _picture_writer(cloud: Cloud, target: str, arguments: Namespace) -> Callable[[], int]:
    if Path(target).suffix.lower() != ".svg":
        raise InputError("--picture", target, "a name that ends in .svg")

    def act() -> str:
        robot, constraints = cloud.robot, cloud.constraints
        facts = _facts(robot, constraints, arguments)
        turns = robot.joints[0].kind == "revolute"
        cut = workspace_section(robot, constraints=constraints) if turns else None
        with reading(cloud, _shows_progress(arguments)) as chunks, opened(target) as file:
            file.write(draw(robot, chunks, facts, cut).encode())
        return f"{cloud.n} points"

    return partial(_writing, target, act)


def _hull_writer(cloud: Cloud, target: str, arguments: Namespace) -> Callable[[], int]:
    from app.exports.hull import hull, kind_of  # trimesh takes a quarter of a second

    kind = kind_of(target)

    def act() -> str:
        with reading(cloud, _shows_progress(arguments)) as chunks:
            body = hull(chunks)
        with opened(target) as file:
            body.export(file, file_type=kind)
        return f"{len(body.vertices)} corners, {body.volume:.4g} m³, {body.area:.4g} m²"

    return partial(_writing, target, act)


def _shows_progress(arguments: Namespace) -> bool:
    return sys.stderr.isatty() if arguments.progress is None else bool(arguments.progress)


def _writing(target: str, act: Callable[[], str]) -> int:
    """Write a file and print what is in it; returns 0, 2 if it cannot be written, 130 after Ctrl-C."""
    try:
        summary = act()
    except BrokenPipeError:
        raise
    except OSError as error:
        print(f"kinboard: cannot write {target}: {error.strerror or error}", file=sys.stderr)
        return 2
    except ModuleNotFoundError as error:  # what kernels raise is none
        print(f"kinboard: this needs {error.name}: pip install 'kinboard[hull]'", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("kinboard: interrupted" + ("; nothing was written" if target != "-" else ""), file=sys.stderr)
        return _INTERRUPTED
    if target != "-":
        print(f"{target}: {summary}")
    return 0


def run_cuspidal(arguments: Namespace) -> int:
    """Print the verdict, and the corners of the loop if there is one."""
    robot = robot_of(arguments)
    constraints = joint_constraints(robot, arguments)
    with percent_bar(sys.stderr.isatty() and not arguments.json) as progress:
        found = cuspidal(
            robot, constraints=constraints, poses=arguments.poses, seed=arguments.seed, progress=progress
        )
    if arguments.json:
        return print_json(CuspidalAnswer.of(found))
    print(f"{robot.name} ({robot.id})\n\n{found.reason}")
    if found.loop is not None:
        units = Notation(robot, arguments.rad)
        rows = [[units.joint(i, value) for i, value in enumerate(q)] for q in found.loop.tolist()]
        print("\n" + table([joint.name for joint in robot.joints], rows))
    return 0


def run_postures(arguments: Namespace) -> int:
    """Print the regions of a posture map, and write it to a file if one is named."""
    robot, units = robot_of(arguments), units_of(arguments)
    kind = None
    if arguments.output is not None:
        kind = postures.FORMATS.get(Path(arguments.output).suffix.removeprefix(".").lower())
        if kind is None:
            raise InputError("--output", arguments.output, "a name that ends in .svg, .png or .csv")
    pose = None
    if arguments.pose is not None:
        pose, _ = typed_target(arguments.pose, None, units, robot.maker, "--pose")
    joints = None
    if arguments.joints is not None:
        joints = [(index_of(text, robot.n + 1) or 0) - 1 for text in arguments.joints]
        if min(joints) < 0:
            raise InputError("--joints", arguments.joints, f"two joints from 1 to {robot.n}")
    with percent_bar(sys.stderr.isatty() and not arguments.json) as progress:
        found = posture_map(
            robot,
            pose,
            normal=arguments.normal,
            joints=joints,
            q=None if arguments.q is None else configuration(robot, arguments.q, "--q", units),
            constraints=joint_constraints(robot, arguments),
            respect_limits=not arguments.ignore_limits,
            resolution=arguments.resolution,
            progress=progress,
        )
    if kind is not None:
        write_output(arguments.output, kind.write(found))
    if arguments.json:
        return print_json(PostureMapAnswer.of(found))
    print(f"{robot.name} ({robot.id})\n\n{found.explain(units)}")
    return 0
