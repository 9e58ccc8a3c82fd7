"""Recordings as files: MCAP with everything in it; for CSV see `table`.

MCAP (https://mcap.dev) has one channel for each topic, as JSON with a JSON Schema, which Foxglove, PlotJuggler and
Rerun read. The arm is in it as the attachment ``robot.json``, so that the file can be played again.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.live.recording.recording import ENTRY, Bounds, Entry, Recording, too_large
from app.live.recording.table import from_csv, to_csv
from kin import InputError, KinematicsError, Robot, robot_from_dict, robot_to_dict
from kin._version import __version__

if TYPE_CHECKING:
    from mcap.records import Attachment, Chunk

EXTRA: Final = "pip install 'kinboard[mcap]'"
FILE: Final = Bounds(seconds=math.inf, size=512 << 20)  # of a file that a program reads
MAGIC: Final = b"\x89MCAP0\r\n"
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


def read_mcap(data: bytes, bounds: Bounds = FILE) -> Recording:
    """A recording from a file that `to_mcap` wrote; raises `InputError` for any other, or a larger one."""
    try:
        from mcap.records import Attachment, Channel, Message, Metadata
    except ImportError:
        raise InputError("format", "mcap", f"the package mcap: {EXTRA}") from None
    wrong = InputError("recording", f"{len(data)} bytes", "a recording of a connection (MCAP)")
    if len(data) > bounds.size:
        raise InputError("recording", f"{len(data)} bytes", f"at most {bounds.size} bytes")
    topics: dict[int, str] = {}
    meta: dict[str, str] | None = None
    robot: Attachment | None = None
    messages: list[tuple[int, int, bytes]] = []
    size = 0
    try:
        for record in _records(data, bounds.size):
            match record:
                case Channel():
                    topics[record.id] = record.topic
                case Message():
                    size += len(record.data) + ENTRY
                    if size > bounds.size:
                        raise too_large(bounds.size)
                    messages.append((record.log_time, record.channel_id, record.data))
                case Metadata(name=name) if name == META:
                    meta = record.metadata
                case Attachment(name=name) if name == ROBOT:
                    robot = record
        if meta is None or robot is None:
            raise wrong
        arm, start = robot_from_dict(json.loads(robot.data)), robot.log_time
        messages.sort(key=itemgetter(0))
        entries = [Entry((at - start) / _NANO, topics[channel], content) for at, channel, content in messages]
        found = Recording(arm, meta.get("program", ""), bounds, start)
        return found.restored(entries, float(meta.get("seconds", "nan")))
    except KinematicsError:
        raise
    except Exception as error:  # the library and its decompressors raise what the bytes provoke
        raise wrong from error


def _records(data: bytes, most: int) -> Iterator[Any]:
    """The records of a file, those in its chunks too: a few bytes may be made to become gigabytes there."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    left = most
    for record in StreamReader(io.BytesIO(data), emit_chunks=True, record_size_limit=len(data)).records:
        if isinstance(record, Chunk):
            content = _unpacked(record, left)
            left -= len(content)
            yield from breakup_chunk(replace(record, compression="", data=content))
        else:
            yield record


def _unpacked(chunk: Chunk, most: int) -> bytes:
    """The bytes of a chunk; raises `InputError` if there are more than `most`."""
    from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
    from zstandard import ZstdDecompressor

    match chunk.compression:
        case "lz4":
            content: bytes = LZ4FrameDecompressor().decompress(chunk.data, most + 1)
        case "zstd":
            with ZstdDecompressor().stream_reader(chunk.data) as stream:
                content = stream.read(most + 1)
        case _:
            content = chunk.data
    if len(content) > most:
        raise InputError("recording", f"more than {most} bytes when unpacked", f"at most {most} bytes")
    return content


def read(data: bytes, robot: Robot, bounds: Bounds = FILE) -> Recording:
    """A recording from the bytes of a file, MCAP or CSV as they begin; raises `InputError` for any other.

    Args:
        robot: the arm of a CSV file, which does not say it.
    """
    return read_mcap(data, bounds) if data.startswith(MAGIC) else from_csv(data, robot, bounds)


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
