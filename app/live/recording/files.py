"""Recordings as files: MCAP with everything in it; for CSV see `table`.

MCAP (https://mcap.dev) has one channel for each topic, as JSON with a JSON Schema, which Foxglove, PlotJuggler and
Rerun read. The arm is in it as the attachment ``robot.json``, so that the file can be played again.
"""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.live.recording.recording import ENTRY, Bounds, Entry, Recording, too_large
from app.live.recording.table import from_csv, to_csv
from kin import InputError, KinematicsError, Robot, robot_from_dict, robot_to_dict
from kin._version import __version__
from kin.files.read import LIMITS
from kin.parsing import TextError, read_json

if TYPE_CHECKING:
    from mcap.records import Attachment, Chunk

EXTRA: Final = "pip install 'kinboard[mcap]'"
FILE: Final = Bounds(seconds=math.inf, size=512 << 20)  # of a file that a program reads
MAGIC: Final = b"\x89MCAP0\r\n"
ROBOT, META = "robot.json", "kinboard"
LONGEST_RECORD: Final = 64 * 1024  # bytes of a channel and of metadata; longer ones are not ours
LONGEST_NAME: Final = 200  # characters of the name of a program
WINDOW: Final = 8 << 20  # bytes that zstandard looks back, as RFC 8878 recommends
PART: Final = 1 << 18  # bytes that are unpacked at once
_HEAD = struct.Struct("<BQ")  # of a record: its operation code, and bytes of its content
_MESSAGE = struct.Struct("<HIQQ")  # channel, number, time of the log and of publishing; its data follow
_NANO = 1_000_000_000
_NUMBERS = {"type": "array", "items": {"type": "number"}}
_TYPES: dict[str, dict[str, Any]] = {
    "q": _NUMBERS,
    "measured": {"anyOf": [_NUMBERS, {"type": "null"}]},
    "readings": {"anyOf": [_NUMBERS, {"type": "null"}]},
    "gripper": {"type": ["number", "null"]},
    "measured_gripper": {"type": ["number", "null"]},
    "drives": {"type": ["string", "null"]},
    "announce": {"type": ["object", "null"]},
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
        arm, start = _robot(robot.data), robot.log_time
        messages.sort(key=itemgetter(0))
        entries = [Entry((at - start) / _NANO, topics[channel], content) for at, channel, content in messages]
        found = Recording(arm, meta.get("program", "")[:LONGEST_NAME], bounds, start)
        return found.restored(entries, float(meta.get("seconds", "nan")))
    except KinematicsError:
        raise
    except Exception as error:  # the library and its decompressors raise what the bytes provoke
        raise wrong from error


def _robot(data: bytes) -> Robot:
    try:
        return robot_from_dict(read_json(data, LIMITS))
    except TextError as error:
        if error.syntax:
            raise
        raise InputError(f"recording, {ROBOT}", error.value, error.expected) from None


def _records(data: bytes, most: int) -> Iterator[Any]:
    """The records of a file that are needed, those in its chunks too, read one at a time.

    A few bytes may be made to become gigabytes in a chunk, so `most` bounds what all chunks have when unpacked,
    and the number of records. The library would read all records of a chunk at once, and indexes without a bound.
    """
    from mcap.data_stream import ReadDataStream
    from mcap.opcode import Opcode
    from mcap.records import Attachment, Channel, Chunk, Message, Metadata

    left, count = most, 0

    def read(code: int, content: bytes) -> Iterator[Any]:
        nonlocal left, count
        count += 1
        if count > most // ENTRY:
            raise too_large(most)
        stream = ReadDataStream(io.BytesIO(content))
        match code:
            case Opcode.MESSAGE:
                channel, number, logged, published = _MESSAGE.unpack_from(content)
                yield Message(channel, logged, content[_MESSAGE.size :], published, number)
            case Opcode.CHANNEL if len(content) <= LONGEST_RECORD:
                yield Channel.read(stream)
            case Opcode.METADATA if len(content) <= LONGEST_RECORD:
                yield Metadata.read(stream)
            case Opcode.ATTACHMENT:
                yield Attachment.read(stream)
            case Opcode.CHUNK:
                unpacked = _unpacked(Chunk.read(stream), left)
                left -= len(unpacked)
                for each in _pieces(unpacked):
                    if each[0] != Opcode.CHUNK:  # in a chunk there is none
                        yield from read(*each)

    for code, content in _pieces(data, len(MAGIC)):
        yield from read(code, content)
        if code == Opcode.FOOTER:
            return
    raise ValueError("the file has no end")


def _pieces(data: bytes, at: int = 0) -> Iterator[tuple[int, bytes]]:
    """Operation code and content of the records from there on; raises `ValueError` where one is cut."""
    while at < len(data):
        code, size = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if size > len(data) - at:
            raise ValueError("a record is longer than the file")
        yield code, data[at : at + size]
        at += size


def _unpacked(chunk: Chunk, most: int) -> bytes:
    """The bytes of a chunk; raises `InputError` as soon as there are more than `most`."""
    content = bytearray()
    for part in _parts(chunk):
        content += part
        if len(content) > most:
            raise InputError("recording", f"more than {most} bytes when unpacked", f"at most {most} bytes")
    return bytes(content)


def _parts(chunk: Chunk) -> Iterator[bytes]:
    """The bytes of a chunk in parts: both libraries reserve memory for all that they may return at once."""
    from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
    from zstandard import ZstdDecompressor

    match chunk.compression:
        case "lz4":
            unpacker = LZ4FrameDecompressor()
            yield unpacker.decompress(chunk.data, PART)
            while not (unpacker.eof or unpacker.needs_input):
                yield unpacker.decompress(b"", PART)
        case "zstd":
            with ZstdDecompressor(max_window_size=WINDOW).stream_reader(chunk.data) as stream:
                while part := stream.read(PART):
                    yield part
        case _:
            yield chunk.data


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
