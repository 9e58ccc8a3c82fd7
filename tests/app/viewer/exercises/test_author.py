"""An exercise is written in a page: from another one, with refusals, tried as a student, kept, and saved."""

from __future__ import annotations

import html
import json
import re
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.exercises import Exercises, parse_exercise
from app.exercises.files import MOST_BYTES
from app.shared.clouds import Clouds
from app.shared.settings import Settings, static_folder
from app.shared.store import Store
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, decode, encode
from kin.parsing import to_toml

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ALL = Exercises()
SOURCE = next(one for one in ALL.all if one.id == "elbow-angle")
HOME = kin.get_robot("puma560").q_home
DRAFT = {**tomllib.loads(Path(SOURCE.file).read_text()), "id": "my-own", "title": "My own"}


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(Store(), Settings(), Clouds())) as port:
        yield port


def stored(draft: str = "") -> str:
    features: dict[str, dict[str, object]] = {"author": {"draft": draft}} if draft else {}
    text = encode(PageState(lesson="author", features=features))
    return json.dumps({"address": "http://127.0.0.1/", "state": text})


def press(tab: FakeBrowser, key: list[object], value: object = None) -> None:
    tab.say("feature", ["author", key, value])


def shown(tab: FakeBrowser) -> str:
    return html.unescape(tab.html)


def test_an_exercise_is_written_tried_and_comes_back(server: int) -> None:
    with FakeBrowser(server, memory=stored()) as tab:
        tab.wait(lambda: "Begin with a kind or with any exercise" in shown(tab))
        press(tab, ["set", "new", 1], SOURCE.id)
        tab.wait(lambda: "✓ Checked." in shown(tab) and f'value="{SOURCE.id}-2"' in tab.html)
        first = parse_exercise(to_toml({**DRAFT, "id": f"{SOURCE.id}-2"})).variant(0)
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(first.robot, first.q), atol=1e-6))

        press(tab, ["set", "title", 2], "Where <b>is</b> it?")
        tab.wait(lambda: "Where &lt;b&gt;is&lt;/b&gt; it?" in tab.html)
        assert "<b>is</b>" not in tab.html
        press(tab, ["set", "answer.value", 3], "hypot(")
        tab.wait(lambda: "answer.value[0]:" in shown(tab) and "expected an expression" in shown(tab))
        assert ">hypot(</textarea>" in tab.html, "what was typed stays"
        press(tab, ["try", 4])
        press(tab, ["set", "answer.value", 5], "\n".join(map(str, np.atleast_1d(DRAFT["answer"]["value"]))))
        tab.wait(lambda: "✓ Checked." in shown(tab))
        assert tab.value("Lesson") == "Write an exercise", "what is no exercise is not opened"

        press(tab, ["try", 6])
        tab.wait(lambda: tab.value("Lesson") == "Exercises" and f'data-exercise="{SOURCE.id}-2"' in tab.html)
        assert "Go on writing" in tab.html
        tab.set("Lesson", "Write an exercise")
        tab.wait(lambda: "✓ Checked." in shown(tab) and "Where <b>is</b> it?" in shown(tab))
        tab.set("Lesson", "Exercises")
        tab.wait(lambda: f'data-exercise="{SOURCE.id}-2"' in tab.html)
        tab.wait(lambda: any(decode(text, [SOURCE.robot]).lesson == "exercises" for text in tab.kept[-1:]))
        kept = tab.kept[-1]
    with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": kept})) as tab:
        tab.wait(lambda: f'data-exercise="{SOURCE.id}-2"' in tab.html)
        tab.say("undo")
        tab.set("Lesson", "Write an exercise")
        tab.wait(lambda: "✓ Checked." in shown(tab))


def test_undo_takes_back_what_was_typed(server: int) -> None:
    with FakeBrowser(server, memory=stored(to_toml(DRAFT))) as tab:
        tab.wait(lambda: 'value="My own"' in tab.html)
        press(tab, ["set", "title", 1], "Other")
        tab.wait(lambda: 'value="Other"' in tab.html)
        tab.say("undo")
        tab.wait(lambda: 'value="My own"' in tab.html)
        press(tab, ["add", "answer.mistakes", 2])
        tab.wait(lambda: "Why this is wrong." in shown(tab))
        tab.say("undo")
        tab.wait(lambda: "Why this is wrong." not in shown(tab))


def test_the_arm_and_pose_on_show_become_those_of_the_exercise(server: int) -> None:
    with FakeBrowser(server, memory=stored(to_toml(DRAFT))) as tab:
        tab.wait(lambda: 'value="My own"' in tab.html)
        tab.choose(kin.get_robot("puma560").name)
        press(tab, ["pose", 1])
        tab.wait(lambda: "<option selected>puma560</option>" in tab.html)
        q = "\n".join("0" if not round(np.degrees(value)) else f"{round(np.degrees(value))}*deg" for value in HOME)
        tab.wait(lambda: f">{q}</textarea>" in tab.html)


@pytest.mark.full
def test_hostile_messages_and_files_change_nothing(server: int) -> None:
    with FakeBrowser(server, memory=stored(to_toml(DRAFT))) as tab:
        tab.wait(lambda: 'value="My own"' in tab.html)
        for key, value in (
            (["set", "nobody", 1], "x"),
            (["set", "title", 2], {"a": 1}),
            (["set", "title", 3], "x" * 50_000),
            (["drop", "vary", 4], 99),
            (["drop", "vary", 5], "0"),
            (["add", "title", 6], None),
            (["look", 7], 99),
            (["at", "draft", 0], "x"),
            (["upload", 8], ["a.toml", "x" * (MOST_BYTES + 1)]),
            (["upload", 9], ["a.toml", "id = 1"]),
            (["upload", 10], ["a.toml", "[" * 5000]),
        ):
            press(tab, key, value)
        press(tab, ["upload", 11], ["a.toml", None])
        tab.wait(lambda: f"a file of at most {MOST_BYTES // 1000} kB" in shown(tab))
        press(tab, ["set", "title", 12], "Still here")
        tab.wait(lambda: 'value="Still here"' in tab.html)
    for junk in (
        "x" * (MOST_BYTES + 100),
        "[",
        "vary = 3",
        "answer = 1\nkind = 'number'",
        "[vary]\nt = [1]",
        "kind = []",
    ):
        with FakeBrowser(server, memory=stored(junk)) as tab:
            tab.wait(lambda: tab.value("Lesson") == "Write an exercise")
            tab.settle()


def test_an_exercise_goes_into_a_course_whose_link_hides_the_answer(tmp_path: Path) -> None:
    with serve_viewer(ViewerServer(Store(), Settings(data=tmp_path), Clouds())) as server:
        with FakeBrowser(server, memory=stored(to_toml(DRAFT))) as tab:
            tab.wait(lambda: 'value="My own"' in tab.html)
            press(tab, ["bring", 1])
            tab.wait(lambda: "In the course My course" in shown(tab))
            press(tab, ["close", 2])
            tab.set("Lesson", "Courses")
            tab.wait(lambda: 'data-course="follow"' in tab.html and "My own" in shown(tab))
            tab.say("feature", ["course", ["link", 3], None])
            tab.wait(lambda: "#s=" in tab.html)
            tab.wait(lambda: any("course" in decode(text, [SOURCE.robot]).features for text in tab.kept[-1:]))
            features = decode(tab.kept[-1], [SOURCE.robot]).features
        assert DRAFT["answer"]["method"] not in json.dumps(features)
        memory = encode(PageState(lesson="course", features={"course": {"course": features["course"]["course"]}}))
        with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": memory})) as tab:
            tab.wait(lambda: 'data-course="follow"' in tab.html and "My own" in shown(tab))
            tab.say("feature", ["course", ["next", 1], None])
            tab.wait(lambda: 'data-exercise="my-own"' in tab.html)
            assert DRAFT["answer"]["method"] not in str(tab.log)
        foreign = {"course": {"course": {"title": "T", "own": ["AAAA"], "item": []}}}
        text = encode(PageState(lesson="course", features=foreign))
        with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": text})) as tab:
            tab.wait(lambda: "The course cannot be used" in shown(tab) and "has sealed" in shown(tab))


# In the folder of the service

TOKEN = "open-sesame-42"
BUTTON = 'data-guide-do="serve"'


def access(token: str | None = None, read_only: bool = False) -> dict[str, object]:
    return {"token": token, "read_only": read_only, "rate": 0.0, "login_page": static_folder() / "login.html"}


def visitor(port: int, memory: str, **headers: str) -> FakeBrowser:
    return FakeBrowser(port, memory=memory, additional_headers=headers)


def test_a_teacher_saves_an_exercise_on_the_server_and_other_processes_have_it(tmp_path: Path) -> None:
    settings = Settings(exercises=tmp_path)
    with ExitStack() as stack:  # two processes of a service share no more than the folder
        here, there = (
            stack.enter_context(serve_viewer(ViewerServer(Store(), settings, Clouds()), access=access()))
            for _ in range(2)
        )
        with visitor(here, stored(to_toml(DRAFT))) as tab:
            tab.wait(lambda: "Save on the server" in shown(tab))
            press(tab, ["set", "answer.value", 1], "hypot(")
            tab.wait(lambda: "answer.value[0]:" in shown(tab))
            press(tab, ["serve", 2])
            press(tab, ["set", "answer.value", 3], "\n".join(map(str, np.atleast_1d(DRAFT["answer"]["value"]))))
            tab.wait(lambda: "✓ Checked." in shown(tab))
            assert list(tmp_path.iterdir()) == [], "what is no exercise is not saved"

            press(tab, ["serve", 4])
            tab.wait(lambda: "My own is saved on the server" in shown(tab))
            tab.wait(lambda: "It is saved on the server, in everybody’s list." in shown(tab))
            written = tomllib.loads((tmp_path / "my-own.toml").read_text())
            assert {**written, "answer": DRAFT["answer"]} == DRAFT
            press(tab, ["set", "title", 5], "Where <b>is</b> it?")
            tab.wait(lambda: "Replace on the server" in shown(tab) and "It is saved" not in shown(tab))
            tab.say("undo")
            tab.wait(lambda: "It is saved on the server" in shown(tab))
            tab.say("redo")
            tab.wait(lambda: "It is saved on the server" not in shown(tab))
            press(tab, ["serve", 6])
            tab.wait(lambda: "Where <b>is</b> it? is replaced on the server" in shown(tab))
            assert "<b>is</b>" not in tab.html
            assert [path.name for path in tmp_path.iterdir()] == ["my-own.toml"]

        text = encode(PageState(lesson="exercises", features={"exercises": {"seed": 1, "at": "", "done": {}}}))
        with visitor(there, json.dumps({"address": "http://127.0.0.1/", "state": text})) as student:
            student.wait(lambda: "Where &lt;b&gt;is&lt;/b&gt; it?" in student.html)
            assert "<b>is</b>" not in student.html
            student.say("feature", ["exercises", ["open", "my-own", 1], None])
            student.wait(lambda: 'data-exercise="my-own"' in student.html)

        # It is changed where it is by who begins with it; another page's copy is another exercise.
        with visitor(there, stored()) as tab:
            tab.wait(lambda: "Begin with a kind" in shown(tab))
            press(tab, ["set", "new", 1], "my-own")
            tab.wait(lambda: "It is saved on the server" in shown(tab) and 'value="my-own"' in tab.html)
            press(tab, ["set", "level", 2], "3")
            press(tab, ["serve", 3])
            tab.wait(lambda: "is replaced on the server" in shown(tab))
            assert tomllib.loads((tmp_path / "my-own.toml").read_text())["level"] == 3
        with visitor(here, stored(to_toml({**DRAFT, "title": "By somebody else"}))) as tab:
            tab.wait(lambda: "expected an id that no other exercise has" in shown(tab))
            press(tab, ["serve", 1])
            press(tab, ["set", "id", 2], "my-own-2")
            tab.wait(lambda: "✓ Checked." in shown(tab))
            press(tab, ["serve", 3])
            tab.wait(lambda: "It is saved on the server" in shown(tab))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my-own-2.toml", "my-own.toml"]
    assert tomllib.loads((tmp_path / "my-own.toml").read_text())["title"] == "Where <b>is</b> it?"


def test_a_link_to_a_draft_knows_what_is_on_the_server(tmp_path: Path) -> None:
    settings = Settings(exercises=tmp_path)
    with serve_viewer(ViewerServer(Store(), settings, Clouds()), access=access()) as port:
        with visitor(port, stored(to_toml(DRAFT))) as tab:
            tab.wait(lambda: "Save on the server" in shown(tab))
            press(tab, ["serve", 1])
            tab.wait(lambda: "It is saved on the server" in shown(tab))
            tab.wait(lambda: any("served" in decode(s, [SOURCE.robot]).features["author"] for s in tab.kept[-1:]))
            kept = tab.kept[-1]
        with visitor(port, json.dumps({"address": "http://127.0.0.1/", "state": kept})) as tab:
            tab.wait(lambda: "It is saved on the server" in shown(tab))
        state = decode(kept, [SOURCE.robot])
        forged = {**state.features["author"], "served": "0" * 16}
        text = encode(PageState(lesson="author", features={"author": forged}))
        with visitor(port, json.dumps({"address": "http://127.0.0.1/", "state": text})) as tab:
            tab.wait(lambda: "expected an id that no other exercise has" in shown(tab))


@pytest.mark.parametrize(
    ("options", "headers", "may"),
    [
        (access(), {}, True),
        (access(), {"X-Forwarded-For": "10.0.0.7"}, False),  # another machine, through a proxy of this one
        (access(TOKEN), {"Authorization": f"Bearer {TOKEN}"}, True),
        (access(TOKEN), {"Authorization": f"Bearer {TOKEN}", "X-Forwarded-For": "10.0.0.7"}, True),
        (None, {}, False),  # a student of a room, who has no token
    ],
)
def test_who_may_save_on_the_server(
    options: dict[str, object] | None, headers: dict[str, str], may: bool, tmp_path: Path
) -> None:
    viewer = ViewerServer(Store(), Settings(exercises=tmp_path), Clouds())
    with (
        serve_viewer(viewer, access=options) as port,
        visitor(port, stored(to_toml(DRAFT)), **headers) as tab,
    ):
        tab.wait(lambda: "✓ Checked." in shown(tab))
        assert (BUTTON in tab.html) == may
        press(tab, ["serve", 1])
        press(tab, ["set", "title", 2], "Afterwards")
        tab.wait(lambda: 'value="Afterwards"' in tab.html)
        assert [path.name for path in tmp_path.iterdir()] == ["my-own.toml"] * may


def test_a_service_without_a_folder_says_so_to_whom_it_concerns(tmp_path: Path) -> None:
    for options in (access(), None):
        viewer = ViewerServer(Store(), Settings(), Clouds())
        with serve_viewer(viewer, access=options) as port, visitor(port, stored(to_toml(DRAFT))) as tab:
            tab.wait(lambda: "✓ Checked." in shown(tab))
            assert BUTTON not in tab.html
            assert ("set KINBOARD_EXERCISES" in shown(tab)) == (options is not None)


def test_a_folder_that_fails_while_it_is_saved_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(number: int) -> None:
        raise OSError(28, "No space left on device")

    viewer = ViewerServer(Store(), Settings(exercises=tmp_path), Clouds())
    with serve_viewer(viewer, access=access()) as port, visitor(port, stored(to_toml(DRAFT))) as tab:
        tab.wait(lambda: "Save on the server" in shown(tab))
        with monkeypatch.context() as patched:
            patched.setattr("os.fsync", full)
            press(tab, ["serve", 1])
            tab.wait(lambda: "No space left on device" in shown(tab))
        assert 'value="My own"' in tab.html
        press(tab, ["serve", 2])
        tab.wait(lambda: "It is saved on the server" in shown(tab))


@pytest.mark.full
def test_a_kind_begins_with_its_plainest_exercise(server: int) -> None:
    with FakeBrowser(server, memory=stored()) as tab:
        tab.wait(lambda: "Begin with a kind" in shown(tab))
        for serial, kind in enumerate(sorted({one.kind.name for one in ALL.all})):
            press(tab, ["set", "new", 2 * serial], f"kind:{kind}")
            tab.wait(lambda kind=kind: f"Kind {kind}:" in shown(tab))
            tab.wait(lambda: "✓ Checked." in shown(tab))
            title = re.search(r'class="kb-exercise-top"><b>([^<]*)</b>', tab.html)
            assert title is not None
            origin = next(one for one in ALL.all if html.unescape(title[1]) == f"{one.title} (mine)")
            others = [one for one in ALL.all if one.kind.name == kind]
            assert origin.level == min(one.level for one in others)
            assert not re.search(r"<option selected>(dh|velocity|inverse)</option>", tab.html), "no check asks it"
            press(tab, ["close", 2 * serial + 1])
            tab.wait(lambda: "Begin with a kind" in shown(tab))
