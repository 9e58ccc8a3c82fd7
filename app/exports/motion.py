"""Motions as files: samples as CSV and NDJSON, ROS messages, MCAP, URScript, and Python."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pprint import pformat

import numpy as np

from app.exports.motion_ros import mcap, mcap_writer, trajectory_json, trajectory_yaml
from app.exports.motion_samples import about
from app.exports.snippets import robot_code
from app.shared.answers.answer import as_plain
from app.shared.answers.motion import motion_answer
from kin import InputError, fk
from kin.axes import inverse
from kin.motion import Circ, Dwell, Gripper, Lin, Motion, PoseTarget, Ptp, Spline, program_to_dict
from kin.motion.details import BlendLeftOut, BlendShortened
from kin.motion.program import Move, Segment
from kin.transforms import Array, wxyz_from_rotation

_UR = "Universal Robots"


@dataclass(frozen=True)
class MotionFormat:
    """A way to write a motion.

    Attributes:
        name: short name, the ending of a file.
        suffix: of a file.
        meaning: for people.
        media_type: of a response.
        pieces: the bytes of a motion, sampled at a rate (per second).
        check: raises `InputError` if a package that it needs is not installed.
    """

    name: str
    suffix: str
    meaning: str
    media_type: str
    pieces: Callable[[Motion, float], Generator[bytes]]
    check: Callable[[], object] = lambda: None


def _csv(motion: Motion, rate: float) -> Generator[bytes]:
    for piece in motion.csv_pieces(rate):
        yield piece.encode()


def _commented_csv(motion: Motion, rate: float) -> Generator[bytes]:
    """The table behind lines that say what is in it."""
    yield "".join(f"# {key}: {value}\n" for key, value in about(motion)).encode()
    yield from _csv(motion, rate)


def _ndjson(motion: Motion, rate: float) -> Generator[bytes]:
    """First the answer without samples, then one line per sample."""
    yield _line(as_plain(motion_answer(motion)))
    for sample in motion.steps(rate):
        wxyz = wxyz_from_rotation(sample.T[:, :3, :3])
        lines = zip(
            *(part.tolist() for part in (sample.t, sample.q, sample.qd, sample.qdd, sample.T[:, :3, 3], wxyz)),
            sample.tool_speed.tolist(),
            strict=True,
        )
        names = ("t", "q", "qd", "qdd", "position", "wxyz", "tool_speed")
        yield b"".join(_line(dict(zip(names, line, strict=True))) for line in lines)


def _line(content: object) -> bytes:
    return json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode() + b"\n"


def _json(motion: Motion, rate: float) -> Generator[bytes]:
    yield _line(as_plain(motion_answer(motion, rate)))


def _python(motion: Motion, rate: float) -> Generator[bytes]:
    """A program that plans the motion again."""
    program = pformat(program_to_dict(motion.program), width=100, sort_dicts=False)
    yield f"""import kin
import numpy as np

{robot_code(motion.robot)}
program = {program}
motion = kin.plan_motion(robot, program, {_start(motion)})
print(motion.reason)
sample = motion.sample(np.arange(0.0, motion.duration, {1.0 / rate:.9g}))
print(sample.q.shape, sample.tool_speed.max())
""".encode()


def _start(motion: Motion) -> str:
    """Where the motion begins, and how the joints move there, as keywords."""
    start = {"q_start": motion.q_start}
    if motion.start is not None:
        start |= {"qd_start": motion.start.qd, "qdd_start": motion.start.qdd}
    return ", ".join(f"{key}={json.dumps(values.tolist())}" for key, values in start.items())


def _urscript(motion: Motion, rate: float) -> Generator[bytes]:
    """Commands of Universal Robots' controllers, which time the motion themselves."""
    robot = motion.robot
    if robot.n != 6 or not robot.revolute.all():
        raise InputError("format", "urscript", "an arm with six revolute joints")
    if motion.start is not None:
        raise InputError("format", "urscript", "a motion that starts at rest, as those of URScript do")
    if robot.maker and _UR not in robot.maker:
        raise InputError("format", "urscript", f"an arm of {_UR}; the maker of {robot.name} is {robot.maker}")
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in motion.program.name or "program")[:60]
    lines = [f"def {name if name[0].isalpha() else f'p_{name}'}():"]
    lines += [f"  # {robot.id}: {motion.duration:.3f} s as planned; the controller plans speeds and blends anew."]
    if not robot.maker:
        lines += [
            "  # No maker is stated: zeros and directions may not be those of a controller of Universal Robots."
        ]
    lines += [f"  movej({_list(motion.q_start)})  # the start"]
    for times, segment in zip(motion.segments, motion.program.segments, strict=True):
        q, T = _target(motion, segment, times.end)
        lines += [f"  {line}" for line in _commands(motion, segment, q, T, times.index)]
    yield "\n".join([*lines, "end", ""]).encode()


def _target(motion: Motion, segment: Segment, end: float) -> tuple[Array, Array]:
    """Where a segment leads to: configuration, and the tool's pose in the base frame; blends leave it earlier."""
    sample = motion.sample(np.array([end]))
    q, T = sample.q[0], sample.T[0]
    if isinstance(segment, Ptp | Lin | Circ):
        if isinstance(segment.target, PoseTarget):
            T = segment.target.pose(T)
        else:
            q = np.array(segment.target.q)
            T = fk(motion.robot, q)
    return q, inverse(motion.robot.T_world_base) @ T


def _commands(motion: Motion, segment: Segment, q: Array, T: Array, index: int) -> list[str]:
    """The commands of one segment that ends at `q` ``(6,)`` with the tool at `T` in the base frame."""
    label = f"  # {segment.name}" if segment.name.isprintable() and segment.name else ""
    if isinstance(segment, Dwell):
        return [f"sleep({_number(segment.seconds)})"]
    if isinstance(segment, Gripper):
        words = f"# gripper {100.0 * segment.opening:.6g} % open: the command of your gripper goes here"
        return [words, f"sleep({_number(segment.seconds)}){label}"]
    radius = _radius(motion, segment, index)
    blend = f", r={_number(radius)}" if radius else ""
    limits = motion.limits
    joint = (
        f"a={_number(float(limits.acceleration.min()) * segment.acceleration)}, "
        f"v={_number(float(limits.velocity.min()) * segment.speed)}"
    )
    peaks = {peak.quantity: peak.peak for peak in motion.segment_peaks(index) if peak.joint is None}
    tool = f"a=1.2, v={_number(max(peaks['tool_speed'], 1e-3))}"
    match segment:
        case Ptp():
            return [f"movej({_list(q)}, {joint}{blend}){label}"]
        case Lin():
            return [f"movel({_pose(T)}, {tool}{blend}){label}"]
        case Circ():
            via = T.copy()
            via[:3, 3] = (inverse(motion.robot.T_world_base) @ [*segment.via, 1.0])[:3]
            return [f"movec({_pose(via)}, {_pose(T)}, {tool}{blend}){label}"]
    return [f"{line}{label}" for line in _through(motion, segment, joint, tool, blend)]


def _radius(motion: Motion, segment: Move, index: int) -> float:
    """The zone that is planned at the end of a segment, in metres; 0 where the arm stops."""
    radius = segment.blend
    for fact in motion.notes:
        if isinstance(fact, BlendLeftOut) and fact.segment == index:
            return 0.0
        if isinstance(fact, BlendShortened) and fact.segment == index:
            radius = fact.used
    return radius


def _through(motion: Motion, segment: Spline, joint: str, tool: str, blend: str) -> list[str]:
    """A spline as commands to its points, without stops; `blend`: the argument of the last one."""
    commands = []
    T_base_world, before = inverse(motion.robot.T_world_base), np.eye(4)
    for point in segment.points:
        if isinstance(point, PoseTarget):
            before = point.pose(before)
            commands.append(f"movep({_pose(T_base_world @ before)}, {tool}, r=0.01)")
        else:
            commands.append(f"movej({_list(np.array(point.q))}, {joint}, r=0.01)")
    return [*commands[:-1], commands[-1].replace(", r=0.01", blend)]


def _pose(T: Array) -> str:
    """``p[x, y, z, rx, ry, rz]`` with the rotation vector."""
    w, *v = wxyz_from_rotation(T[:3, :3]).tolist()
    size = float(np.linalg.norm(v))
    angle = 2.0 * float(np.arctan2(size, w))
    turn = [angle * x / size for x in v] if size > 1e-12 else [0.0, 0.0, 0.0]
    return "p" + _list(np.array([*T[:3, 3], *turn]))


def _list(values: Array) -> str:
    return "[" + ", ".join(map(_number, values.tolist())) + "]"


def _number(value: float) -> str:
    return f"{round(value, 9) + 0.0:.9g}"


FORMATS = {
    each.name: each
    for each in (
        MotionFormat(
            "csv-commented",
            ".commented.csv",
            "a table behind lines with # that say arm, units, limits",
            "text/csv",
            _commented_csv,
        ),
        MotionFormat(
            "trajectory-yaml",
            ".trajectory.yaml",
            "a trajectory_msgs/JointTrajectory of ROS",
            "application/yaml",
            trajectory_yaml,
        ),
        MotionFormat(
            "trajectory-json",
            ".trajectory.json",
            "the same as JSON, with arm, units and limits",
            "application/x-joint-trajectory+json",
            trajectory_json,
        ),
        MotionFormat(
            "mcap",
            ".mcap",
            "a recording of joint states and transforms, with the program",
            "application/octet-stream",
            mcap,
            mcap_writer,
        ),
        MotionFormat("json", ".json", "the answer with samples", "application/json", _json),
        MotionFormat("csv", ".csv", "a table of samples", "text/csv", _csv),
        MotionFormat("ndjson", ".ndjson", "the answer, then one line per sample", "application/x-ndjson", _ndjson),
        MotionFormat("urscript", ".script", "commands for Universal Robots", "text/plain", _urscript),
        MotionFormat("python", ".py", "a program for this library", "text/x-python", _python),
    )
}
