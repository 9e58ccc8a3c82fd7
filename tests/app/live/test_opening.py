"""Recordings that are opened in a page: files of a connection, and those that somebody has made to do harm."""

from __future__ import annotations

import gc
import io
import json
import math
import re
import struct
import tracemalloc
from collections.abc import Iterator
from typing import Any

import lz4.frame
import numpy as np
import pytest
import zstandard
from fake_browser import FakeBrowser
from mcap.writer import CompressionType, Writer
from test_connect import ARM, Q, code_of, shown
from test_live_page import press
from test_recording import labels, words

import kin
from app.live.recording import Bounds, Recording, read, to_csv, to_mcap
from app.live.recording.table import heads
from app.viewer.live import feature

A, B = Q, Q + 0.2


def recording(robot: kin.Robot = ARM, count: int = 20) -> Recording:
    """From A to B within two seconds; the measured arm lags behind."""
    made = Recording(robot)
    q0, q1 = (A, B) if robot == ARM else (robot.q_home, robot.q_home + 0.1)
    entries = []
    for k in range(count):
        q = q0 + (q1 - q0) * k / (count - 1)
        made.add("/page/q", {"q": q.tolist()})
        made.add("/sent/measured", {"measured": (q - 0.05).tolist()})
    for k, each in enumerate(made.entries):
        entries.append(type(each)(2.0 * (k // 2) / (count - 1), each.topic, each.data))
    return Recording(robot, "test.py").restored(entries, 2.0)


def send(page: FakeBrowser, name: str, data: bytes) -> None:
    page.open_file("connect", name, data)


def opened(page: FakeBrowser, name: str, data: bytes) -> None:
    send(page, name, data)
    page.wait(lambda: words(page) == "opened")


@pytest.mark.full
@pytest.mark.parametrize("write", [to_mcap, lambda made: to_csv(made).encode()], ids=["mcap", "csv"])
def test_a_recording_is_opened_and_played_with_both_arms(page, write):
    made = recording()
    assert "Connect a program" in labels(page), "nobody is connected, and there is no code"
    opened(page, "run", write(made))
    page.wait(lambda: "run is open" in page.html and "2.0 s of the UR5" in page.html)
    slider = page.element("Time (s)")
    page.send("GuiUpdateMessage", uuid=slider, updates={"value": 0.5})
    row = made.track().at(0.5)
    assert row[0] is not None
    shown(page, kin.fk(ARM, row[0]))
    page.wait(lambda: "data-live-measured" in page.html)
    table = page.html.partition("data-live-measured")[2].partition("</table>")[0]
    gaps = re.findall(r'class="kb-value">[^<]*</td><td class="kb-value">(.*?)</td>', table)
    assert [float(gap.replace("−", "-")) for gap in gaps] == [pytest.approx(-math.degrees(0.05), abs=0.06)] * ARM.n
    press(page, "Play recording")
    shown(page, kin.fk(ARM, B))
    page.wait(lambda: "Play recording" in labels(page))
    press(page, "Discard recording")
    page.wait(lambda: words(page) == "")


@pytest.mark.full
def test_the_arm_of_a_recording_is_shown_with_it(page):
    scara = kin.get_robot("scara")
    opened(page, "scara.mcap", to_mcap(recording(scara)))
    page.wait(lambda: page.value("Robot") == "SCARA" or "2.0 s of the" in page.html)
    shown(page, kin.fk(scara, scara.q_home))
    press(page, "Play recording")
    shown(page, kin.fk(scara, scara.clip(scara.q_home + 0.1)))
    page.choose("UR5")
    page.wait(lambda: "has to be on show" in page.html)
    assert "Play recording" not in labels(page)
    press(page, "Show that arm")
    page.wait(lambda: "Play recording" in labels(page))


@pytest.mark.full
def test_an_arm_that_the_service_does_not_have_becomes_the_visitors_own(page):
    own = kin.files.parse_robot(kin.robot_to_toml(ARM).replace("0.425", "0.525"), "longer.toml")
    assert own != ARM
    opened(page, "longer.mcap", to_mcap(recording(own)))
    press(page, "Play recording")
    shown(page, kin.fk(own, own.q_home + 0.1))


def test_while_something_is_driven_the_arm_stays(page, viewer):
    with kin.connect(f"http://127.0.0.1:{viewer}", code_of(page), drives="SO-101") as arm:
        arm.q = A
        shown(page, kin.fk(ARM, A))
        opened(page, "scara.mcap", to_mcap(recording(kin.get_robot("scara"))))
        assert "has to be on show" in page.html
        press(page, "Show that arm")
        page.wait(lambda: "SO-101 is driven" in page.html)
        page.settle()
        assert page.tool_pose() == pytest.approx(kin.fk(ARM, A), abs=1e-5)


def test_what_arrives_can_be_cancelled_and_the_rest_of_it_is_dropped(page):
    request = page.begin_file("connect", "slow.mcap", 45_000)
    request.send(bytes(30_000))
    page.wait(lambda: "Receiving “slow.mcap”" in page.html)
    press(page, "Cancel")
    page.wait(lambda: "Receiving" not in page.html)
    request.send(bytes(15_000))
    assert request.getresponse().status == 409
    opened(page, "run.mcap", to_mcap(recording()))
    assert "was not used" not in page.html


# Files that are none


def mcap(
    entries: list[tuple[int, str, bytes]], seconds: str = "2.0", robot: object = None, start: int = 10**18
) -> bytes:
    """A file like that of `to_mcap`, with other contents."""
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.NONE)
    writer.start()
    writer.add_metadata("kinboard", {"program": "x", "seconds": seconds})
    arm = kin.robot_to_dict(ARM) if robot is None else robot
    writer.add_attachment(start, start, "robot.json", "application/json", json.dumps(arm).encode())
    topics = {topic for _, topic, _ in entries}
    channels = {topic: writer.register_channel(topic, "json", schema_id=0) for topic in topics}
    for at, topic, data in entries:
        writer.add_message(channels[topic], start + at, data, start + at)
    writer.finish()
    return out.getvalue()


def bomb(compression: str, packed: bytes, claimed: int) -> bytes:
    """A file whose only chunk becomes far larger than itself."""
    name = compression.encode()
    content = struct.pack("<QQQII", 0, 0, claimed, 0, len(name)) + name + struct.pack("<Q", len(packed)) + packed
    whole = to_mcap(recording())
    return whole[:8] + b"\x06" + struct.pack("<Q", len(content)) + content + whole[8:]


HUGE = bytes(64 << 20)
Q_AT = json.dumps({"q": A.tolist()}).encode()
TABLE = ",".join(heads(ARM))
SIX = ",".join(["0.1"] * 6)
HOSTILE: dict[str, tuple[bytes, str]] = {
    "nothing": (b"", "a recording of a connection (MCAP or CSV)"),
    "another table": (b"a,b\n1,2\n", "a recording of a connection (MCAP or CSV)"),
    "another file": (b"\x89MCAP0\r\n" + bytes(300), "a recording of a connection (MCAP)"),
    "half a file": (to_mcap(recording())[:-500], "a recording of a connection (MCAP)"),
    "no arm": (mcap([], robot={"rows": []}), "expected"),
    "an arm of another kind": (mcap([], robot=["x"]), "expected"),
    "a time before its beginning": (mcap([(-5 * 10**9, "/page/q", Q_AT)]), "times from its beginning on"),
    "a year": (mcap([(10**17, "/page/q", Q_AT)]), "at most 3600 s"),
    "seconds that never end": (mcap([(0, "/page/q", Q_AT)], seconds="1e300"), "at most 3600 s"),
    "text for numbers": (
        mcap([(0, "/page/q", b'{"q": ["x", 1, 2, 3, 4, 5]}')]),
        "a recording of a connection (MCAP)",
    ),
    "nested numbers": (
        mcap([(0, "/page/q", b'{"q": [[1], [1], [1], [1], [1], [1]]}')]),
        "configurations of 6 numbers",
    ),
    "deep": (mcap([(0, "/page/q", b"[" * 100_000)]), "at most 16384 bytes"),
    "lz4 bomb": (bomb("lz4", lz4.frame.compress(HUGE), 10), "bytes when unpacked"),
    "zstd bomb": (bomb("zstd", zstandard.compress(HUGE), 10), "bytes when unpacked"),
    "table: other joints": (
        (",".join(heads(kin.get_robot("scara"))) + "\n").encode(),
        "those of the arm on show, UR5",
    ),
    "table: not text": (TABLE.encode() + b"\n\xff\xfe", "a recording of a connection (CSV)"),
    "table: short row": (f"{TABLE}\n0.0,1\n".encode(), "line 2: got '2 cells', expected 13 cells"),
    "table: NaN": (
        f"{TABLE}\n0.0,{SIX.replace('0.1', 'nan', 1)},{SIX}\n".encode(),
        "line 2: got 'nan', expected a number",
    ),
    "table: part of a configuration": (
        f"{TABLE}\n0.0,,{SIX[4:]},{SIX}\n".encode(),
        "line 2: got '', expected a number",
    ),
    "table: back in time": (f"{TABLE}\n1,{SIX},{SIX}\n0.5,{SIX},{SIX}\n".encode(), "a time from 1 s on"),
    "table: too long": (f"{TABLE}\n1e9,{SIX},{SIX}\n".encode(), "at most 3600 s"),
}


@pytest.fixture(scope="module")
def opened_page(viewer) -> Iterator[FakeBrowser]:
    with FakeBrowser(viewer) as page:
        page.choose("UR5")
        opened(page, "good.mcap", to_mcap(recording()))
        yield page


@pytest.mark.parametrize("case", sorted(HOSTILE))
def test_a_file_that_is_none_is_refused_and_loses_nothing(opened_page, case):
    page = opened_page
    data, message = HOSTILE[case]
    page.log.clear()
    before = page.tool_pose().copy()
    send(page, f"{case}.mcap", data)
    page.wait(lambda: any("The file was not used" in str(m) for m in page.log))
    page.wait(lambda: message in page.html.replace("&#39;", "'"))
    assert words(page) == "opened", "the recording that was there"
    assert "Play recording" in labels(page)
    assert page.tool_pose() == pytest.approx(before)


EMPTY = b'{"name": [' + b"{}," * 30_000 + b"{}]}"
LONG_ROW = f"{TABLE}\n0.0".encode() + b"," * 20_000
UNPACKED: dict[str, tuple[bytes, str]] = {
    "a message with many values": (
        mcap([(0, "/page/q", b'{"q": [' + b"0," * 600 + b"0]}")]),
        "recording, /page/q: got 'more than 512 values', expected at most 512 values",
    ),
    "a long message": (
        mcap([(0, "/sent/measured", b'{"measured": "' + b"x" * 20_000 + b'"}')]),
        "recording, /sent/measured: got '20016 bytes', expected at most 16384 bytes",
    ),
    "a message that is nested deeply": (
        mcap([(0, "/page/q", b'{"q": ' + b"[" * 100 + b"]" * 100 + b"}")]),
        "recording, /page/q: got 'nested more than 4 deep', expected at most 4 deep",
    ),
    "an arm of many values": (
        mcap([], robot=json.loads(EMPTY)),
        "recording, robot.json: got 'more than 20000 values', expected at most 20000 values",
    ),
    "an arm that is nested deeply": (
        mcap([], robot=json.loads("[" * 100 + "]" * 100)),
        "recording, robot.json: got 'nested more than 16 deep', expected at most 16 deep",
    ),
    "table: a row without end": (
        LONG_ROW,
        "recording: got 'a row of more than 16384 characters', expected at most 16384 characters",
    ),
    "table: quotation marks without end": (
        f"{TABLE}\n".encode() + b'"\n",' * 5000,
        "recording: got 'a row of more than 16384 characters', expected at most 16384 characters",
    ),
}


@pytest.mark.parametrize("case", UNPACKED)
def test_what_is_in_a_file_is_bounded_before_it_is_parsed(case):
    data, message = UNPACKED[case]
    with pytest.raises(kin.InputError, match=re.escape(message)):
        read(data, ARM)


@pytest.mark.parametrize(
    "packed", [("lz4", lz4.frame.compress(HUGE)), ("zstd", zstandard.compress(HUGE))], ids=["lz4", "zstd"]
)
def test_a_chunk_is_bounded_while_it_is_unpacked(packed):
    data = bomb(*packed, 10)
    tracemalloc.start()
    try:
        with pytest.raises(kin.InputError, match="more than 1000000 bytes when unpacked"):
            read(data, ARM, Bounds(size=1_000_000))
        assert tracemalloc.get_traced_memory()[1] < 6_000_000
    finally:
        tracemalloc.stop()


def test_a_chunk_that_looks_far_back_is_refused():
    """zstandard would take as much memory as the chunk asks for, up to 128 MB."""
    wide = zstandard.ZstdCompressionParameters(window_log=26)
    packed = zstandard.ZstdCompressor(compression_params=wide).compressobj()
    with pytest.raises(kin.InputError, match=r"a recording of a connection \(MCAP\)"):
        read(bomb("zstd", packed.compress(bytes(900)) + packed.flush(), 900), ARM)  # a hundred empty records


def test_records_are_bounded_in_number_and_those_of_others_are_not_read():
    """An index of 16 MB took 60 MB and three seconds, records without content as much."""
    plain = to_mcap(recording())

    def with_record(code: int, content: bytes, count: int = 1) -> bytes:
        return plain[:8] + (bytes([code]) + struct.pack("<Q", len(content)) + content) * count + plain[8:]

    index = struct.pack("<HI", 1, 1_600_000) + bytes(1_600_000)
    names = b"".join(struct.pack("<II", 0, 0) for _ in range(10_000))
    metadata = struct.pack("<I", 0) + struct.pack("<I", len(names)) + names
    tracemalloc.start()
    try:
        for code, content in ((7, index), (12, metadata)):
            assert len(read(with_record(code, content), ARM).entries) == len(read(plain, ARM).entries)
        assert tracemalloc.get_traced_memory()[1] < 8_000_000
    finally:
        tracemalloc.stop()
    with pytest.raises(kin.InputError, match=r"more than 0\.1 MB in memory"):
        read(with_record(0x90, b"", 2000), ARM, Bounds(size=100_000))


@pytest.mark.parametrize("value", ["x", ["a", True, True], [1, 413]])
def test_messages_that_say_nothing_of_a_file_are_refused(page, value):
    page.say("feature", ["connect", ["upload"], value])
    page.wait(lambda: "Invalid input" in page.html)


def test_more_bytes_than_a_recording_may_have_are_refused_before_all_have_come(viewer, monkeypatch):
    monkeypatch.setattr(feature.Connect, "files", {"upload": 1_000_000})
    with FakeBrowser(viewer) as page:
        page.settle()
        request = page.begin_file("connect", "big.mcap", 1_030_000)
        assert request.getresponse().status == 413
        page.wait(lambda: "big.mcap: size: it is too large, expected at most 1 MB." in page.html)


def test_many_small_messages_take_no_more_memory_than_large_ones():
    data = mcap([(0, "/x", b"{}")] * 1000)
    with pytest.raises(
        kin.InputError, match=r"recording: got 'more than 0\.1 MB in memory', expected at most 0\.1 MB"
    ):
        read(data, ARM, Bounds(size=100_000))


def test_recordings_of_all_pages_share_their_memory():
    data = to_mcap(recording(count=1000))  # so large that what other pages have does not matter
    bounds = Bounds(size=1 << 20, shared=(1 << 20) + 2_000_000)
    kept: list[Any] = []

    def keep_all() -> None:
        kept.extend(read(data, ARM, bounds) for _ in range(20))

    with pytest.raises(kin.InputError, match="no room in the service"):
        keep_all()
    assert 2 <= len(kept) < 20
    assert sum(each.size for each in kept) <= 2_000_000
    kept.clear()
    assert read(data, ARM, bounds).size


def test_a_refused_recording_leaves_its_room_at_once():
    """Its error holds it in a circle of references, which Python may find much later."""
    bounds = Bounds(size=1 << 20, shared=(1 << 20) + 250_000)
    gc.disable()
    try:
        for _ in range(5):
            with pytest.raises(kin.InputError, match="at most 16384 bytes"):
                read(mcap([(0, "/page/q", b"[" * 100_000)]), ARM, bounds)
    finally:
        gc.enable()


def test_a_table_gives_the_same_track_again_and_a_spreadsheets_mark_is_no_harm():
    made = recording()
    text = to_csv(made)
    again = read(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode(), ARM)
    for time in (0.0, 0.3, 1.0, 2.0):
        for one, other in zip(made.track().at(time), again.track().at(time), strict=True):
            assert one is not None
            assert np.array_equal(one, other)
    partly = Recording(ARM)
    partly.add("/sent/measured", {"measured": A.tolist()})
    partly.add("/sent/q", {"q": A.tolist()})
    partly.add("/sent/measured", {"measured": None})
    partly.end()
    found = read(to_csv(partly).encode(), ARM).track()
    assert np.isnan(found.commanded[0]).all()
    assert found.measured[0].tolist() == A.tolist()
    assert found.commanded[-1].tolist() == A.tolist()
    assert np.isnan(found.measured[-1]).all()
