"""Recordings: what a connection sends and hears, as a file that other tools read, and played again."""

from __future__ import annotations

import csv
import io
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_browser import FakeBrowser
from mcap.reader import make_reader
from test_connect import ARM, Q, code_of, shown
from test_live_page import press

import kin
from app.live.recording import Bounds, Recording, read_mcap, save, to_mcap
from app.live.recording import recording as module
from app.viewer.live.pursuit import NEAR, Pursuit

A, B = Q, Q + 0.2


@pytest.fixture
def arm(viewer, page) -> Iterator[Any]:
    with kin.connect(f"http://127.0.0.1:{viewer}", code_of(page), rate=60) as arm:
        yield arm


def messages(data: bytes) -> list[tuple[str, str, dict[str, Any]]]:
    """Topic, schema and content of the messages of a file, as any reader of MCAP finds them."""
    found = []
    for schema, channel, message in make_reader(io.BytesIO(data)).iter_messages():
        assert schema is not None
        assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
        assert json.loads(schema.data)["title"] == schema.name
        found.append((channel.topic, schema.name, json.loads(message.data)))
    return found


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_a_program_records_what_it_sends_and_hears(page, arm, tmp_path):
    arm.q = A
    shown(page, kin.fk(ARM, A))
    with arm.record(tmp_path / "run.mcap") as recording:
        arm.measured = A + 0.01
        arm.q = B
        arm.target = kin.fk(ARM, B)  # its answer comes after what was sent
        arm.draw.line("wall", [[0, 0, 0], [1, 0, 0]])
    assert recording.ended == "stopped"
    arm.q = A  # not any more
    found = messages((tmp_path / "run.mcap").read_bytes())
    assert ("/sent/measured", "kinboard.sent.measured") in {each[:2] for each in found}
    sent = [each[2] for each in found if each[0] == "/sent/q"]
    assert sent[-1]["q"] == B.tolist()
    drawn = next(each[2] for each in found if each[0] == "/sent/draw")
    assert drawn["draw"]["wall"]["points"] == [[0, 0, 0], [1, 0, 0]]
    done = [each[2]["id"] for each in found if each[0] == "/heard/done"]
    assert drawn["id"] in done
    assert any(each[2]["result"]["status"] == "solved" for each in found if each[0] == "/heard/result")
    again = read_mcap((tmp_path / "run.mcap").read_bytes())
    assert again.robot == ARM
    assert again.seconds == pytest.approx(recording.seconds)
    assert [each.topic for each in again.entries] == [each.topic for each in recording.entries]
    track = again.track()
    assert np.allclose(kin.fk(ARM, track.commanded[-1]), kin.fk(ARM, B), atol=1e-6)
    assert track.measured[-1].tolist() == (A + 0.01).tolist()
    assert (np.diff(track.t) >= 0).all()
    save(again, tmp_path / "run.csv")
    table = rows((tmp_path / "run.csv").read_text())
    assert float(table[-1]["measured shoulder (rad)"]) == A[1] + 0.01
    assert table[0]["measured shoulder (rad)"] == "", "nothing was measured yet"


def test_a_file_is_played_again_in_the_page(page, arm, tmp_path):
    with arm.record(tmp_path / "run.mcap"):
        for k in range(5):
            arm.q = A + 0.02 * k
            arm.measured = A + 0.02 * k - 0.005
            time.sleep(0.05)
    arm.q = B
    began = time.monotonic()
    arm.replay(tmp_path / "run.mcap", rate=2.0)
    assert 0.05 < time.monotonic() - began < 5.0
    shown(page, kin.fk(ARM, A + 0.08))
    assert arm.measured.tolist() == (A + 0.08 - 0.005).tolist()
    arm.robot = "pioneer5"
    with pytest.raises(kin.InputError, match=r"recording: got 'one of the UR5', expected one of the Pioneer arm"):
        arm.replay(tmp_path / "run.mcap")


def test_a_recording_ends_with_its_arm_and_needs_a_known_ending(arm, tmp_path):
    with arm.record() as recording:
        arm.robot = "scara"
        assert recording.ended == "another arm was shown"
    with pytest.raises(kin.InputError, match=r"ends with \.mcap or \.csv"), arm.record(tmp_path / "run.bag"):
        pass


def test_its_bounds_end_it_and_it_says_why(monkeypatch):
    short = Recording(ARM, bounds=Bounds(seconds=0.05))
    short.add("/sent/q", {"q": A.tolist()})
    time.sleep(0.06)
    short.add("/sent/q", {"q": B.tolist()})
    assert short.ended == "it has reached 0.05 s, the most there may be"
    assert short.seconds == 0.05
    assert len(short.entries) == 1
    small = Recording(ARM, bounds=Bounds(size=2000))
    for _ in range(100):
        small.add("/sent/q", {"q": A.tolist()})
    assert "it has reached 0 MB" in str(small.ended)
    assert 0 < small.size <= 2000
    assert len(small.track().t) == len(small.entries)
    monkeypatch.setattr(module, "STEP", 1000)
    first, second = (Recording(ARM, bounds=Bounds(shared=4000)) for _ in range(2))
    for _ in range(100):
        first.add("/sent/q", {"q": A.tolist()})
        second.add("/sent/q", {"q": A.tolist()})
    assert "all pages" in str(first.ended or second.ended)
    assert first.size + second.size <= 4000 + 2 * 1000


@pytest.mark.parametrize("data", [b"", b"no MCAP", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + bytes(200)])
def test_another_file_is_refused(data):
    with pytest.raises(kin.InputError, match=r"recording: got '?\d+ bytes'?, expected a recording"):
        read_mcap(data)


def test_a_file_that_was_cut_or_changed_is_refused_or_read_in_part():
    recording = Recording(ARM)
    for k in range(50):
        recording.add("/sent/q", {"q": (A + k).tolist()})
    recording.end()
    whole = to_mcap(recording)
    assert len(read_mcap(whole).track().t) == 50
    refused = 0
    for size in range(0, len(whole), 97):
        changed = bytearray(whole)
        changed[size] ^= 0x55
        for data in (whole[:size], bytes(changed)):
            try:
                found = len(read_mcap(data).entries)
            except kin.KinematicsError:
                refused += 1
            else:
                assert found <= 50
    assert refused > 10


def test_the_example_of_the_documents_runs(viewer, page, tmp_path, monkeypatch, capsys):
    document = (Path(__file__).parents[3] / "docs/connect.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```py\n(with kin.connect.*?)```", document, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    example = example.replace("localhost:8000", f"127.0.0.1:{viewer}").replace("K7QF-2M4A", code_of(page))
    exec(compile(example, "example", "exec"), {"kin": kin})
    assert read_mcap((tmp_path / "run.mcap").read_bytes()).track().commanded[-1] == pytest.approx(ARM.q_home)
    assert "nan" in capsys.readouterr().out, "nothing was measured"


# In the page


def labels(page: FakeBrowser) -> set[Any]:
    return {each["props"].get("label") for each in page.gui.values()}


def words(page: FakeBrowser) -> str:
    found = re.search(r'data-live-recording="(\w+)"', page.html)
    return "" if found is None else found[1]


def test_a_page_records_plays_and_saves(page, arm):
    press(page, "Record the connection")
    page.wait(lambda: words(page) == "running")
    for k in range(4):
        arm.q = A + 0.1 * k
        arm.measured = A + 0.1 * k - 0.05
        shown(page, kin.fk(ARM, A + 0.1 * k))
    press(page, "Stop recording")
    page.wait(lambda: words(page) == "ended")
    assert "has ended" not in page.html, "the visitor has ended it"
    arm.close()
    page.wait(lambda: 'data-live=""' in page.html)
    slider = page.element("Time (s)")
    page.send("GuiUpdateMessage", uuid=slider, updates={"value": 0.0})
    page.wait(lambda: "The recording at 0.00 s" in page.html)
    assert not np.allclose(page.tool_pose(), kin.fk(ARM, A + 0.3), atol=1e-3)
    press(page, "Play recording")
    shown(page, kin.fk(ARM, A + 0.3))
    page.wait(lambda: "data-live-measured" in page.html)
    page.wait(lambda: "Pause" not in labels(page) and "Play recording" in labels(page))
    assert page.value("Time (s)") > 0.0
    page.set("Save as", "MCAP")
    page.wait(lambda: "ur5-recording.mcap is saved" in page.html)
    page.wait(lambda: any(m["type"] == "FileTransferPart" for m in page.log))
    found = read_mcap(b"".join(bytes(m["content"]) for m in page.log if m["type"] == "FileTransferPart"))
    assert found.track().commanded[-1] == pytest.approx(A + 0.3)
    press(page, "Discard recording")
    page.wait(lambda: words(page) == "")


def recorded(page: FakeBrowser, arm: Any, *rows: np.ndarray) -> None:
    """Record these configurations, and end where the last one is."""
    press(page, "Record the connection")
    page.wait(lambda: words(page) == "running")
    for q in rows:
        arm.q = q
        shown(page, kin.fk(ARM, q))
        time.sleep(0.05)
    press(page, "Stop recording")
    page.wait(lambda: words(page) == "ended")


def test_what_does_not_say_where_it_is_is_not_moved_by_a_recording(page, arm):
    recorded(page, arm, A, B)
    arm.drives = "SO-101"
    press(page, "Play recording")
    page.wait(lambda: "It does not say where it is" in page.html)
    page.settle()
    assert page.tool_pose() == pytest.approx(kin.fk(ARM, B), abs=1e-5)


def test_a_recording_waits_for_the_arm_that_it_drives(page, arm):
    """It goes where the recording begins first, and stays there until it is led on."""
    arm.q = A
    shown(page, kin.fk(ARM, A))
    recorded(page, arm, A, *(A + 0.2 * k for k in range(1, 4)))
    end = A + 0.6
    arm.measured = end
    arm.drives = "SO-101"
    page.set("Time (s)", 0.0)
    page.wait(lambda: "Play recording has SO-101 go on from there." in page.html)
    assert page.tool_pose() == pytest.approx(kin.fk(ARM, end), abs=1e-5), "the slider moves nothing"
    press(page, "Play recording")
    shown(page, kin.fk(ARM, A))
    page.wait(lambda: "The arm goes there first" in page.html)
    time.sleep(0.5)
    assert arm.q.tolist() == pytest.approx(A.tolist()), "it waits"
    measured, behind = end, []
    while np.abs(arm.q - end).max() > 1e-6 or np.abs(measured - end).max() > 1e-3:
        way = arm.q - measured
        behind.append(np.abs(way).max())
        measured = measured + np.clip(way, -0.02, 0.02)
        arm.measured = measured
        arm.drives = "SO-101"  # its sign of life
    begun = next(k for k, gap in enumerate(behind) if gap < NEAR)
    assert begun > 20
    assert max(behind[begun:]) < NEAR + 0.2 + 0.02, "one step of the recording at most"
    page.wait(lambda: "Play recording" in labels(page))
    arm.drives = None
    press(page, "Play recording")
    shown(page, kin.fk(ARM, end))
    arm.drives = "SO-101"
    page.wait(lambda: "Pause" not in labels(page))


def test_another_arm_ends_the_recording_of_a_page(page, arm):
    press(page, "Record the connection")
    page.wait(lambda: words(page) == "running")
    arm.robot = "scara"
    page.wait(lambda: words(page) == "ended")
    assert "another arm was shown" in page.html
    assert "It is of the UR5" in page.html
    assert "Time (s)" not in labels(page)


def test_an_arm_that_comes_no_closer_is_not_waited_for_for_ever():
    pursuit, far = Pursuit(ARM), Q + np.radians(12.0)
    assert not any(pursuit.goes_on(Q, far, 0.1) for _ in range(100)), "it has not been where it begins"
    assert pursuit.goes_on(Q, Q, 0.1)
    waits = [pursuit.goes_on(Q, far, 0.1) for _ in range(30)]
    assert waits == [False] * 20 + [True] * 10
    assert not pursuit.goes_on(Q, Q + np.radians(14.0), 0.1), "it is farther behind than that"
    coming = [pursuit.goes_on(Q, Q + np.radians(14.0 - 0.06 * k), 0.1) for k in range(170)]
    assert coming == [False] * coming.count(False) + [True] * coming.count(True), "one that is on its way is"
    assert 14.0 - 0.06 * coming.count(False) == pytest.approx(5.0, abs=0.1)
    assert not pursuit.goes_on(Q, far, 0.1)
