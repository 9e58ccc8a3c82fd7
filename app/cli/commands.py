"""What ``kinboard fk``, ``ik``, ``workspace`` and so on do: ask the core, print for people or as JSON.

Each command takes the parsed arguments of :mod:`app.cli.parser`, prints its answer and returns the exit code: 0,
or 1 when ``ik`` has no exact answer. Misuse raises `kin.KinematicsError`.
"""

from __future__ import annotations

import math
import sys
from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from app.cli.check import CheckAnswer
from app.cli.check import check as check_robot
from app.cli.terminal import Units, clean, per_joint, print_json, store_of, table
from app.exports.formats import FORMATS
from app.exports.picture import draw
from app.exports.save import opened, reading, save
from app.shared.answers.fk import fk_answers
from app.shared.answers.ik import Blocked, Solution, ik_answer
from app.shared.answers.robots import RobotAnswer, robot_answer
from app.shared.answers.workspace import workspace_answer
from app.shared.clouds import Cloud
from kin import (
    InputError,
    Robot,
    Task,
    builtin_robots,
    load_robot,
    sample_workspace,
    section,
    solve_ik,
    workspace_facts,
)
from kin.catalog import BUILTIN
from kin.ik.problem import MASK_NAMES
from kin.transforms import Array, frame_from_approach, from_position_wxyz

_INTERRUPTED = 130  # what shells expect after Ctrl-C


def fk(arguments: Namespace) -> int:
    robot = store_of(arguments).get(arguments.robot)
    q = _configuration(robot, arguments.q, "q", arguments.rad)
    answer = fk_answers(robot, q[None], arguments.frames)[0]
    if arguments.json:
        return print_json(answer)
    units = Units(robot, arguments.rad)
    rows = [
        [
            joint.name,
            units.joint(i, q[i]),
            " … ".join(units.joint(i, stop) for stop in joint.limits or ()),
            "" if robot.lower[i] <= q[i] <= robot.upper[i] else "beyond its stop",
        ]
        for i, joint in enumerate(robot.joints)
    ]
    print(f"{robot.name} ({robot.id})\n")
    print(table(["joint", "value", "limits", ""], rows))
    frames = [("tool", answer["pose"])] + [(frame["name"], frame["pose"]) for frame in answer["frames"] or ()]
    rows = [
        [name, *(units.length(x) for x in pose["position"]), *(f"{clean(w, 5)}" for w in pose["wxyz"])]
        for name, pose in frames
    ]
    print("\n" + table(["frame", *(f"{axis} {units.of_length}" for axis in "xyz"), *"wxyz"], rows))
    return 0


def ik(arguments: Namespace) -> int:
    robot = store_of(arguments).get(arguments.robot)
    angle, length = (1.0, 1.0) if arguments.rad else (math.pi / 180, 1e-3)
    T = from_position_wxyz([x * length for x in arguments.position], arguments.wxyz)
    if arguments.approach is not None:
        T[:3, :3] = frame_from_approach(arguments.approach)
    task = _task(arguments)
    result = solve_ik(
        robot,
        T,
        task=task,
        q_seed=None if arguments.seed is None else _configuration(robot, arguments.seed, "--seed", arguments.rad),
        respect_limits=not arguments.ignore_limits,
        max_solutions=None if arguments.all else 1,
        redundancy=_redundancy(arguments, angle),
        limits=per_joint(robot, arguments.limit, "--limit", 2, arguments.rad),
        locked=per_joint(robot, arguments.lock, "--lock", 1, arguments.rad),
        branch=arguments.branch,
        images=arguments.images,
        prefer=arguments.prefer,
        solver=arguments.solver,
        mask=None if arguments.mask is None else [name in arguments.mask for name in MASK_NAMES],
        mask_frame=arguments.mask_frame,
    )
    answer = ik_answer(result)
    code = 0 if answer["status"] == "solved" else 1
    if arguments.json:
        print_json(answer)
        return code
    units = Units(robot, arguments.rad)
    print(answer["reason"] + "\n")
    closest = answer["closest"] if not answer["solutions"] else None
    listed = [(str(k + 1), s) for k, s in enumerate(answer["solutions"])] + (
        [("closest", closest)] if closest else []
    )
    if answer["nearest_orientation"]:
        listed.append(("nearest orientation", answer["nearest_orientation"]))
    if listed:
        print(table(*_solutions(units, listed)))
    for free in answer["redundancy"]:
        ranges = ", ".join(" … ".join(units.angle(x) for x in interval) for interval in free["intervals"])
        print(f"\n{free['label']} = {units.angle(free['value'])}, possible: {ranges or 'nothing'}")
    if answer["blocked"]:
        print("\n" + table(["branch", "would need"], _needs(units, answer["blocked"])))
    if not arguments.rad and np.abs(T[:3, 3]).max() < 5e-3:
        print("note: --position is read in millimetres; --rad makes it metres", file=sys.stderr)
    return code


def robots(arguments: Namespace) -> int:
    store = store_of(arguments)
    if arguments.robot is not None:
        robot = store.get(arguments.robot)
        answer = robot_answer(robot)
        if arguments.json:
            return print_json(answer)
        print(f"{robot.name} ({robot.id})\n{robot.description}\n{robot.source}\n")
        print(_dh_table(answer, Units(robot, arguments.rad)))
        return 0
    answers = [robot_answer(robot) for robot in store.robots]
    if arguments.json:
        return print_json({"robots": answers})
    rows = [
        [s["id"], str(s["n"]), s["convention"], f"{clean(s['reach'] * 1e3, 0)} mm", s["name"]] for s in answers
    ]
    print(table(["robot", "joints", "convention", "reach at most", "name"], rows))
    return 0


def check(arguments: Namespace) -> int:
    path = Path(arguments.file)
    robot = load_robot(path)
    answer = check_robot(robot, robot.id in builtin_robots() and path.resolve().parent != BUILTIN.resolve())
    if arguments.json:
        return print_json(answer)
    units = Units(robot, arguments.rad)
    print(f"{robot.name} ({robot.id})\n{robot.description or 'No description.'}\nsource: {robot.source}\n")
    rows = [
        [str(i + 1), joint.name, joint.kind, units.joint(i, low), units.joint(i, high), units.joint(i, home)]
        for i, (joint, low, high, home) in enumerate(
            zip(robot.joints, robot.lower, robot.upper, robot.home, strict=True)
        )
    ]
    print(table(["", "joint", "kind", "lower", "upper", "home"], rows) + "\n")
    for line in _about(answer, units):
        print(line)
    return 0


def workspace(arguments: Namespace) -> int:
    robot = store_of(arguments).get(arguments.robot)
    limits = per_joint(robot, arguments.limit, "--limit", 2, arguments.rad)
    locked = per_joint(robot, arguments.lock, "--lock", 1, arguments.rad)
    files = ((arguments.output, _saved), (arguments.picture, _drawn), (arguments.hull, _enclosed))
    if any(target is not None for target, _ in files):
        cloud = _cloud(robot, arguments, limits, locked)
        # All names are read before the first file is begun.
        ready = [write(cloud, target, arguments) for target, write in files if target is not None]
        return max(write() for write in ready)
    answer = workspace_answer(workspace_facts(robot, limits=limits, locked=locked, effort=arguments.effort))
    if arguments.json:
        return print_json(answer)
    units = Units(robot, arguments.rad)
    spans = [
        *(("x", answer["x"]), ("y", answer["y"]), ("z", answer["z"])),
        *(("from the axis of joint 1", answer["radius"]), ("from the shoulder", answer["reach"])),
    ]
    rows = [
        [name, units.length(span["least"]["value"]), units.length(span["largest"]["value"])]
        for name, span in spans
    ]
    print(f"{robot.name} ({robot.id})\n")
    print(table([f"tool point, {units.of_length}", "least", "largest"], rows) + "\n")
    for name, unit, estimate in (("volume", "m³", answer["volume"]), ("surface", "m²", answer["surface"])):
        if estimate is not None:
            print(f"{name:<8} {estimate['value']:.4g} ± {estimate['error']:.1g} {unit}: {estimate['method']}")
    return 0


def _cloud(robot: Robot, arguments: Namespace, limits: Any, locked: Any) -> Cloud:
    """The cloud asked for; raises `InputError` for what is wrong with it, before anything is begun."""
    cloud = Cloud(
        robot,
        arguments.n,
        arguments.seed,
        arguments.strategy,
        tuple(dict.fromkeys(arguments.measure)),
        None if limits is None else tuple(pair and tuple(pair) for pair in limits),
        None if locked is None else tuple(locked),
    )
    # Checks its arguments when it is called, and draws nothing until it is read.
    sample_workspace(
        robot,
        cloud.n,
        seed=cloud.seed,
        strategy=cloud.strategy,
        limits=cloud.limits,
        locked=cloud.locked,
        measure=cloud.measures,
    )
    return cloud


def _saved(cloud: Cloud, target: str, arguments: Namespace) -> Callable[[], int]:
    kind = arguments.format or Path(target).suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        expected = "a name that ends in " + ", ".join(f".{name}" for name in FORMATS) + ", or --format"
        raise InputError("--output", target, expected)

    def act() -> str:
        size = save(cloud, target, kind, arguments.q, _told(arguments))
        return f"{cloud.n} points, {size / 1e6:.1f} MB"

    return partial(_writing, target, act)


def _drawn(cloud: Cloud, target: str, arguments: Namespace) -> Callable[[], int]:
    if Path(target).suffix.lower() != ".svg":
        raise InputError("--picture", target, "a name that ends in .svg")

    def act() -> str:
        robot, limits, locked = cloud.robot, cloud.limits, cloud.locked
        facts = workspace_facts(robot, limits=limits, locked=locked, effort=arguments.effort)
        turns = robot.joints[0].kind == "revolute"
        cut = section(robot, limits=limits, locked=locked) if turns else None
        with reading(cloud, _told(arguments)) as chunks, opened(target) as file:
            file.write(draw(robot, chunks, facts, cut).encode())
        return f"{cloud.n} points"

    return partial(_writing, target, act)


def _enclosed(cloud: Cloud, target: str, arguments: Namespace) -> Callable[[], int]:
    from app.exports.hull import hull, kind_of  # trimesh takes a quarter of a second

    kind = kind_of(target)

    def act() -> str:
        with reading(cloud, _told(arguments)) as chunks:
            body = hull(chunks)
        with opened(target) as file:
            body.export(file, file_type=kind)
        return f"{len(body.vertices)} corners, {body.volume:.4g} m³, {body.area:.4g} m²"

    return partial(_writing, target, act)


def _told(arguments: Namespace) -> bool:
    return sys.stderr.isatty() if arguments.progress is None else bool(arguments.progress)


def _writing(target: str, act: Callable[[], str]) -> int:
    """Write a file and tell what is in it: 0, 2 if it cannot be written, 130 after Ctrl-C."""
    try:
        told = act()
    except BrokenPipeError:
        raise
    except OSError as error:
        print(f"kinboard: cannot write {target}: {error.strerror or error}", file=sys.stderr)
        return 2
    except ImportError as error:
        print(f"kinboard: this needs {error.name}: pip install 'kinboard[hull]'", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("kinboard: interrupted" + ("; nothing was written" if target != "-" else ""), file=sys.stderr)
        return _INTERRUPTED
    if target != "-":
        print(f"{target}: {told}")
    return 0


def _about(answer: CheckAnswer, units: Units) -> list[str]:
    """The lines that say how the axes lie, who solves, and what looks odd."""
    robot = answer["robot"]
    lines = []
    for pair in answer["axes"]:
        a, b = (j + 1 for j in pair["joints"])
        apart = "" if pair["distance"] is None else f", {units.length(pair['distance'])} {units.of_length} apart"
        angle = f" ({units.angle(pair['angle'])})" if pair["relation"] == "oblique" else ""
        where = "" if pair["relation"] == "same line" else ", intersecting" if pair["intersect"] else apart
        lines.append(f"axes {a} and {b}: {pair['relation']}{angle}{where}")
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: parallel axes" for run in answer["parallel"]]
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: axes through one point" for run in answer["spherical"]]
    count = len(robot["branches"])
    lines += [
        "",
        f"convention  {robot['convention']}",
        f"joints      {robot['n']}, giving the tool {answer['motions']} independent motions",
        f"reach       {units.length(robot['reach'])} {units.of_length} at most",
        f"solver      {answer['solver']}: {answer['reason']}",
        f"branches    {count if count else 'not known beforehand: a search finds them one by one'}",
        "",
        *(f"warning: {text}" for text in answer["warnings"]),
    ]
    return lines if answer["warnings"] else [*lines, "No warnings."]


def _solutions(units: Units, listed: list[tuple[str, Solution]]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table of solutions."""
    count = len(listed[0][1]["q"]) if listed else 0
    head = ["", *(f"q{i + 1}" for i in range(count)), "point error", "rotation error", "posture"]
    rows = [
        [
            name,
            *(units.joint(i, value) for i, value in enumerate(solution["q"])),
            f"{units.length(solution['position_error'])} {units.of_length}",
            units.angle(solution["rotation_error"]),
            solution["branch"] + ("" if solution["in_limits"] else " (beyond the limits)"),
        ]
        for name, solution in listed
    ]
    return head, rows


def _task(arguments: Namespace) -> Task:
    """The task asked for, or what the target's form implies; a mask goes with "pose"."""
    if arguments.mask:
        if arguments.task:
            raise InputError("--task", arguments.task, "no task besides --mask")
        if not arguments.wxyz and any(name.startswith("r") for name in arguments.mask):
            raise InputError("--mask", " ".join(arguments.mask), "--wxyz besides --position for rx, ry or rz")
        return "pose"
    implied: Task = "pose" if arguments.wxyz else "approach" if arguments.approach else "position"
    task: Task = arguments.task or implied
    if task == "pose" and not arguments.wxyz:
        raise InputError("--task", task, "--wxyz besides --position for a pose")
    if task == "approach" and not (arguments.approach or arguments.wxyz):
        raise InputError("--task", task, "--approach or --wxyz besides --position for an approach")
    return task


def _needs(units: Units, blocked: list[Blocked]) -> list[list[str]]:
    """What each branch would need beyond the limits."""
    return [
        [
            branch["branch"],
            ", ".join(
                f"q{v['joint'] + 1} = {units.joint(v['joint'], v['value'])} "
                f"(limit {units.joint(v['joint'], v['limit'])})"
                for v in branch["violations"]
            ),
        ]
        for branch in blocked
    ]


def _redundancy(arguments: Namespace, angle: float) -> float | dict[str, float] | None:
    """``--redundancy psi=20 --redundancy …`` as values by name in radians; a bare number stays one."""
    given: list[tuple[str, float]] = arguments.redundancy or []
    if len(given) == 1 and not given[0][0]:
        return given[0][1] * angle
    if any(not name for name, _ in given):
        raise InputError("--redundancy", given, "NAME=VALUE when more than one is given")
    return {name: value * angle for name, value in given} or None


def _dh_table(answer: RobotAnswer, units: Units) -> str:
    limits = {joint["name"]: (joint["index"], joint["limits"]) for joint in answer["joints"]}
    rows = []
    for row in answer["rows"]:
        index, stops = limits.get(row["name"], (0, None))
        cells = [
            units.angle(row["theta"]),
            units.length(row["d"]),
            units.length(row["a"]),
            units.angle(row["alpha"]),
        ]
        rows.append([row["name"], row["kind"], *cells, " … ".join(units.joint(index, x) for x in stops or ())])
    length = units.of_length
    head = ["row", "kind", "theta", f"d {length}", f"a {length}", "alpha", "limits"]
    return f"DH table, {answer['convention']} convention\n\n" + table(head, rows)


def _configuration(robot: Robot, values: list[float], field: str, rad: bool) -> Array:
    """Typed joint values as ``(n,)`` in radians (metres); raises `InputError` for a wrong number of them."""
    if len(values) != robot.n:
        joints = ", ".join(joint.name for joint in robot.joints)
        raise InputError(field, f"{len(values)} values", f"{robot.n}, one for each of: {joints}")
    scale = np.where(robot.revolute, math.pi / 180, 1e-3)
    return robot.check_q(np.array(values) * (1.0 if rad else scale), field)
