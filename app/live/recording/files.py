"""Recordings as files: MCAP with everything in it, and CSV with what was commanded and measured.

MCAP (https://mcap.dev) has one channel for each topic, as JSON with a JSON Schema, which Foxglove, PlotJuggler and
Rerun read. The arm is in it as the attachment ``robot.json``, so that the file can be played again.
"""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any, Final

from app.live.recording.recording import Entry, Recording
from kin import InputError, KinematicsError, robot_from_dict, robot_to_dict
from kin._version import __version__

EXTRA: Final = "pip install 'kinboard[mcap]'"
LARGEST: Final = 512 << 20  # bytes of a file that is read
ROBOT, META = "robot.json", "kinboard"
_NANO = 1_000_000_000
_NUMBERS = {"type": "array", "items": {"type": "number"}}
_TYPES: dict[str, dict[str, Any]] = {
    "q": _NUMBERS,
    "measured": {"anyOf": [_NUMBERS, {"type": "null"}]},
    "readings": {"anyOf": [_NUMBERS, {"type": "null"}]},
    "drives": {"type": ["string", "null"]},
    "play": {"type": "boolean"},
    "clear": {"type": "boolean"},
    "contacts": {"type": "array"},
    "problem": {"type": "object"},
    "program": {"type": "object"},
}


def to_mcap(recording: Recording) -> bytes:
    """The recording as MCAP; raises `InputError` where the package for it is not installed."""
    try:
        from mcap.writer import Writer
    except ImportError:
        raise InputError("format", "mcap", f"the package mcap: {EXTRA}") from None
    out = io.BytesIO()
    writer = Writer(out)
    writer.start(profile="", library=f"kinboard {__version__}")
    writer.add_metadata(
        META,
        {
            "program": recording.name,
            "robot": recording.robot.name,
            "joints": json.dumps([joint.name for joint in recording.robot.joints]),
            "units": "radians, metres, seconds",
            "seconds": repr(recording.seconds),
            "ended": recording.ended or "",
        },
    )
    robot = json.dumps(robot_to_dict(recording.robot), ensure_ascii=False).encode()
    writer.add_attachment(recording.started, recording.started, ROBOT, "application/json", robot)
    channels: dict[str, int] = {}
    for number, entry in enumerate(list(recording.entries)):
        if entry.topic not in channels:
            name = f"kinboard{entry.topic.replace('/', '.')}"
            schema = json.dumps(_schema(entry.topic, name)).encode()
            sid = writer.register_schema(name=name, encoding="jsonschema", data=schema)
            channels[entry.topic] = writer.register_channel(
                topic=entry.topic, message_encoding="json", schema_id=sid
            )
        at = recording.started + round(entry.time * _NANO)
        writer.add_message(channels[entry.topic], at, entry.data, at, number % 2**32)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def _schema(topic: str, title: str) -> dict[str, Any]:
    field = topic.rpartition("/")[2]
    properties = {field: _TYPES.get(field, {}), "id": {"type": "integer"}}
    return {"title": title, "type": "object", "properties": properties}


def read_mcap(data: bytes) -> Recording:
    """A recording from the bytes of a file that `to_mcap` wrote; raises `InputError` for any other."""
    try:
        from mcap.reader import make_reader
    except ImportError:
        raise InputError("format", "mcap", f"the package mcap: {EXTRA}") from None
    wrong = InputError("recording", f"{len(data)} bytes", "a recording of a connection (MCAP)")
    if len(data) > LARGEST:
        raise InputError("recording", f"{len(data)} bytes", f"at most {LARGEST} bytes")
    try:
        reader = make_reader(io.BytesIO(data))
        meta = next((each.metadata for each in reader.iter_metadata() if each.name == META), None)
        robot = next((each for each in reader.iter_attachments() if each.name == ROBOT), None)
        if meta is None or robot is None:
            raise wrong
        arm, start = robot_from_dict(json.loads(robot.data)), robot.log_time
        entries = [
            Entry((message.log_time - start) / _NANO, channel.topic, message.data)
            for _, channel, message in reader.iter_messages()
        ]
        found = Recording(arm, meta.get("program", ""), started=start)
        found.restored(entries, float(meta.get("seconds", "nan")))
        found.track()
    except KinematicsError:
        raise
    except Exception as error:  # the library and its decompressors raise what the bytes provoke
        raise wrong from error
    return found


def to_csv(recording: Recording) -> str:
    """What was commanded and measured at each change, joint by joint; an empty cell: nothing yet."""
    track, robot = recording.track(), recording.robot
    units = ["rad" if turns else "m" for turns in robot.revolute]
    heads = [
        f"{what} {joint.name.replace(',', ' ')} ({unit})"
        for what in ("commanded", "measured")
        for joint, unit in zip(robot.joints, units, strict=True)
    ]
    lines = [",".join(["t (s)", *heads])]
    for t, q, measured in zip(track.t.tolist(), track.commanded.tolist(), track.measured.tolist(), strict=True):
        cells = ["" if value != value else repr(value) for value in (*q, *measured)]
        lines.append(",".join([f"{t:.6f}", *cells]))
    return "\n".join(lines) + "\n"


def save(recording: Recording, path: str | Path) -> None:
    """Write a file, MCAP or CSV as its name ends; raises `InputError` for another ending."""
    path = Path(path)
    match path.suffix.lower():
        case ".mcap":
            path.write_bytes(to_mcap(recording))
        case ".csv":
            path.write_text(to_csv(recording), encoding="utf-8")
        case _:
            raise InputError("path", str(path), "a name that ends with .mcap or .csv")
