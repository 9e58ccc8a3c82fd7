"""Motions for ROS and its tools: ``trajectory_msgs/JointTrajectory`` as YAML and JSON, and MCAP.

YAML is the message itself, with arm, units and limits in comments. JSON has no comments: there the message is
the field ``joint_trajectory`` of an object that says them. MCAP holds joint states and transforms as JSON in the
schemas of Foxglove, which its viewer and PlotJuggler read, and the program as an attachment.
"""

from __future__ import annotations

import json
from collections.abc import Generator
from types import ModuleType
from typing import Any

from app.exports.motion_samples import about
from kin import InputError, link_frames
from kin._version import __version__
from kin.motion import Motion, MotionSample, program_to_dict
from kin.transforms import Array, wxyz_from_rotation

EXTRA = "pip install 'kinboard[mcap]'"
_NANO = 1_000_000_000


def trajectory_yaml(motion: Motion, rate: float) -> Generator[bytes]:
    """The message as YAML, with comments."""
    yield "".join(f"# {key}: {value}\n" for key, value in about(motion)).encode()
    names = json.dumps(motion.robot.ros_names)
    yield f"header:\n  stamp: {{sec: 0, nanosec: 0}}\n  frame_id: world\njoint_names: {names}\npoints:\n".encode()
    for sample in motion.steps(rate):
        yield "".join(_yaml_point(*row) for row in _points(sample)).encode()


def _yaml_point(t: float, q: list[float], qd: list[float], qdd: list[float]) -> str:
    sec, nanosec = divmod(round(t * _NANO), _NANO)
    lists = zip(("positions", "velocities", "accelerations"), (q, qd, qdd), strict=True)
    rows = [f"{name}: [{', '.join(map(_yaml_number, values))}]" for name, values in lists]
    return "- " + "\n  ".join([*rows, f"time_from_start: {{sec: {sec}, nanosec: {nanosec}}}"]) + "\n"


def _yaml_number(value: float) -> str:
    """A number that every reader of YAML takes for one: 1e-05 without a point is a string in YAML 1.1."""
    text = repr(value)
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}.0e{exponent}" if e and "." not in mantissa else text


def trajectory_json(motion: Motion, rate: float) -> Generator[bytes]:
    """An object with the message."""
    head: dict[str, Any] = dict(about(motion))
    head["joint_trajectory"] = {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "world"},
        "joint_names": motion.robot.ros_names,
        "points": [],
    }
    text = json.dumps(head, ensure_ascii=False)
    assert text.endswith("[]}}")
    yield text.removesuffix("]}}").encode()
    between = ""
    for sample in motion.steps(rate):
        for row in _points(sample):
            yield (between + json.dumps(_json_point(*row), allow_nan=False)).encode()
            between = ",\n"
    yield b"]}}\n"


def _json_point(t: float, q: list[float], qd: list[float], qdd: list[float]) -> dict[str, Any]:
    sec, nanosec = divmod(round(t * _NANO), _NANO)
    return {
        "positions": q,
        "velocities": qd,
        "accelerations": qdd,
        "time_from_start": {"sec": sec, "nanosec": nanosec},
    }


def _points(sample: MotionSample) -> list[tuple[float, list[float], list[float], list[float]]]:
    rows = (sample.t.tolist(), sample.q.tolist(), sample.qd.tolist(), sample.qdd.tolist())
    return list(zip(*rows, strict=True))


# MCAP

_TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_NUMBERS = {name: {"type": "number"} for name in ("x", "y", "z", "w")}
_TRANSFORM = {
    "type": "object",
    "properties": {
        "timestamp": _TIME,
        "parent_frame_id": {"type": "string"},
        "child_frame_id": {"type": "string"},
        "translation": {"type": "object", "properties": {name: _NUMBERS[name] for name in "xyz"}},
        "rotation": {"type": "object", "properties": _NUMBERS},
    },
}
_JOINT = {
    "type": "object",
    "properties": {
        "name": {"type": "string"},
        **{name: {"type": "number"} for name in ("position", "velocity", "acceleration")},
    },
}
_SCHEMAS = {
    "/joint_states": (
        "foxglove.JointStates",
        {"timestamp": _TIME, "joints": {"type": "array", "items": _JOINT}},
    ),
    "/tf": ("foxglove.FrameTransforms", {"transforms": {"type": "array", "items": _TRANSFORM}}),
}


class _Sink:
    """Takes what the writer writes, until it is sent. No `io.RawIOBase`: that the writer would buffer."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def write(self, data: bytes) -> int:
        """Take a part."""
        self._parts.append(bytes(data))
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Bytes so far."""
        return self._size

    def flush(self) -> None:
        """Nothing is held back."""

    def taken(self) -> bytes:
        """What was written since the last call."""
        parts, self._parts = self._parts, []
        return b"".join(parts)


def mcap(motion: Motion, rate: float) -> Generator[bytes]:
    """A recording of the motion that begins at time 0."""
    sink = _Sink()
    writer = mcap_writer().Writer(sink)
    writer.start(profile="", library=f"kinboard {__version__}")
    channels = {}
    for topic, (name, properties) in _SCHEMAS.items():
        schema = json.dumps({"title": name, "type": "object", "properties": properties}).encode()
        number = writer.register_schema(name=name, encoding="jsonschema", data=schema)
        channels[topic] = writer.register_channel(topic=topic, message_encoding="json", schema_id=number)
    writer.add_metadata("motion", dict(about(motion)))
    program = json.dumps(program_to_dict(motion.program), ensure_ascii=False, indent=1).encode()
    writer.add_attachment(0, 0, "program.json", "application/json", program)
    names = motion.robot.ros_names
    rows = [f"{i + 1} {row.name}".strip() for i, row in enumerate(motion.robot.rows)]
    for sample in motion.steps(rate):
        frames = motion.robot.T_world_base @ link_frames(motion.robot, sample.q)
        for k, (t, q, qd, qdd) in enumerate(_points(sample)):
            at = round(t * _NANO)
            stamp = dict(zip(("sec", "nsec"), divmod(at, _NANO), strict=True))
            joints = [
                {"name": name, "position": a, "velocity": b, "acceleration": c}
                for name, a, b, c in zip(names, q, qd, qdd, strict=True)
            ]
            _add(writer, channels["/joint_states"], at, {"timestamp": stamp, "joints": joints})
            named = [*zip(rows, frames[k], strict=True), ("tool", sample.T[k])]
            _add(writer, channels["/tf"], at, {"transforms": [_transform(stamp, *each) for each in named]})
        yield sink.taken()
    writer.finish()
    yield sink.taken()


def _add(writer: Any, channel: int, at: int, message: object) -> None:
    data = json.dumps(message, allow_nan=False, separators=(",", ":")).encode()
    writer.add_message(channel_id=channel, log_time=at, publish_time=at, data=data)


def _transform(stamp: dict[str, int], name: str, T: Array) -> dict[str, Any]:
    """The pose of a frame in the world frame."""
    w, i, j, k = wxyz_from_rotation(T[:3, :3]).tolist()
    return {
        "timestamp": stamp,
        "parent_frame_id": "world",
        "child_frame_id": name,
        "translation": dict(zip("xyz", T[:3, 3].tolist(), strict=True)),
        "rotation": {"x": i, "y": j, "z": k, "w": w},
    }


def mcap_writer() -> ModuleType:
    """The module that writes MCAP; raises `InputError` where it is not installed."""
    try:
        from mcap import writer
    except ImportError:
        raise InputError("format", "mcap", f"the package mcap: {EXTRA}") from None
    return writer
