"""Exercises that a teacher wrote and sent: the results of the room have their titles and the words of answers."""

from __future__ import annotations

import csv
import html
import io
import json
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select, update

from app.classroom import COOKIE, Hub, NewAttempt, Ticket, tables
from app.classroom.attendance import Attendance
from app.classroom.courses import Course, Courses, Item, Seal, SentExercises, to_data
from app.classroom.live import MOST_OWN, MOST_VERSIONS, with_own
from app.classroom.lti.contents import contents_of
from app.classroom.results.keys import result_key
from app.cli.parser import main
from app.exercises import Exercises, parse_exercise
from app.service.main import create_app
from app.shared.settings import Settings
from kin import get_robot
from kin.parsing import to_toml

HOSTILE = '=HYPERLINK("http://evil.example") <b>Mine</b>'
WORDS = "It slides <i>along</i> z₃"


def own(title: str = HOSTILE, third: str = WORDS, key: str = "my-own", robot: str = "scara") -> str:
    """The text of an exercise with three options, the last of which is right."""
    options = [{"text": text, "reason": "Joint 3 is prismatic."} for text in ("It turns", "It rests", third)]
    return to_toml(
        {
            "id": key,
            "title": title,
            "topic": "Frames and DH tables",
            "robot": robot,
            "kind": "choice",
            "text": "What does joint 3 do?",
            "answer": {"shuffle": False, "options": [*options[:2], {**options[2], "right": True}]},
        }
    )


class School:
    """A service with a room, its teacher's page, and a student who answers."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.app = create_app(Settings(data=folder))
        self.hub: Hub = self.app.state.classroom
        self.room = self.hub.rooms.open("Class", 3600.0)
        self.ann = self.hub.rooms.join(self.room.code, "Ann")
        self.page = self.hub.attend(Ticket(self.room.id), lambda: None)

    def answer(self, exercise: str = "my-own") -> None:
        self.hub.rooms.submit(self.ann, NewAttempt(exercise, 7, 2, "Right.", 1.0, started=0.0))

    def state(self) -> dict[str, object]:
        with self.hub.database.read() as connection:
            found = connection.scalar(select(tables.Room.state).where(tables.Room.id == self.room.id))
        return found or {}

    def row(self) -> tuple[str, str]:
        """Title and answer in the teacher's table, as another process serves it."""
        other = create_app(Settings(data=self.folder))
        try:
            cookies = {COOKIE: self.hub.rooms.tokens.sign(Ticket(self.room.id))}
            client = TestClient(other, base_url="http://school.example", cookies=cookies)
            page, file = client.get("/room/results"), client.get("/room/results.csv")
        finally:
            other.state.classroom.close()
        assert (page.status_code, file.status_code) == (200, 200)
        [row] = re.findall(r'<tr><th scope="row" dir.*?</tr>', page.text)
        assert "<b>" not in row
        assert "<i>" not in row
        cells = [html.unescape(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", row)]
        [line] = csv.DictReader(io.StringIO(file.content.decode("utf-8-sig")))
        assert not line["title"].startswith("=")
        self.title = line["title"]
        return cells[1], cells[-2]


@pytest.fixture
def school(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[School]:
    monkeypatch.setenv("KINBOARD_DATA", str(tmp_path))
    found = School(tmp_path)
    yield found
    found.page.leave()
    found.hub.close()


def send(school: School, how: str, text: str) -> None:
    """As the teacher's page does; returns when the database has it."""
    exercise = parse_exercise(text)
    if how == "task":
        school.page.send_task(exercise.id, text)
    else:
        course = Course("Mine").bringing(exercise)
        seal = Seal(lambda: result_key(school.hub))
        school.page.send_course(json.dumps(to_data(course, seal)), {exercise.id: text})
    stored(school, lambda state: text in texts(state))


def texts(state: dict[str, object]) -> list[str]:
    kept = state.get("own") or {}
    assert isinstance(kept, dict)
    return [one for versions in kept.values() for one in versions]


def stored(school: School, has: Callable[[dict[str, object]], bool]) -> None:
    """Wait until the database has it, where the hub's thread brings it."""
    end = time.monotonic() + 30.0
    while not has(school.state()):
        assert time.monotonic() < end, school.state()
        time.sleep(0.02)


@pytest.mark.full
@pytest.mark.parametrize("how", ["task", "course"])
def test_results_name_what_the_teacher_wrote(school: School, how: str, capsys: pytest.CaptureFixture[str]) -> None:
    send(school, how, own())
    school.answer()
    assert school.row() == (HOSTILE, "It slides <i>along</i> z₃")
    assert school.title == f"'{HOSTILE}"
    school.page.send_task("two-elbows")  # what was sent before stays in the results
    school.page.send_course("")
    stored(school, lambda state: state.get("course") == "" and "own" not in (state["task"] or {"own": ""}))
    school.page.send_task(None)
    stored(school, lambda state: state["task"] is None)
    assert school.row()[0] == HOSTILE
    assert main(["results", school.room.code]) == 0
    [line] = csv.DictReader(io.StringIO(capsys.readouterr().out))
    assert line["title"] == f"'{HOSTILE}"


def test_students_get_none_of_it(school: School) -> None:
    send(school, "course", own())
    student = school.hub.attend(school.ann, lambda: None)
    assert student.room.own == {}
    assert "It turns" not in repr(student.room)
    assert school.page.room.own == {"my-own": (own(),)}
    student.leave()


@pytest.mark.full
def test_a_mended_exercise_has_words_while_they_are_the_same(school: School) -> None:
    send(school, "task", own("Befor", "It slides"))
    school.answer()
    send(school, "task", own("After", "It slides"))
    assert school.row() == ("After", "It slides")
    send(school, "task", own("After", "It moves along its axis"))
    assert school.row() == ("After", "2"), "it is not known which of them the student has read"


@pytest.mark.full
def test_a_room_of_before_still_opens(school: School) -> None:
    with school.hub.database.write() as connection:
        state = {"task": {"exercise": "my-own", "at": 1.0, "own": own()}, "follow": False}
        connection.execute(update(tables.Room).where(tables.Room.id == school.room.id).values(state=state))
    school.answer()
    assert school.row() == ("my-own", "2")
    assert school.title == ""


def test_an_exercise_whose_arm_is_gone_keeps_its_title() -> None:
    sent = SentExercises(Exercises(), {"my-own": [own(robot="not-there")], "two-elbows": []}, get_robot)
    assert sent.title("my-own") == sent.titles["my-own"] == HOSTILE
    assert sent.said("my-own", 7, "2") == "2"
    assert sent.title("two-elbows") == "Both elbows"
    assert sent.title("nobody-knows") == "nobody-knows"


def test_what_a_room_keeps_of_them_is_bounded() -> None:
    kept: dict[str, list[str]] = {}
    for i in range(MOST_VERSIONS + 1):
        kept = with_own(kept, {"my-own": own(f"Version {i}")})
    versions = kept["my-own"]
    assert len(versions) == MOST_VERSIONS
    assert versions[0] == ""
    assert versions[-1] == own(f"Version {MOST_VERSIONS}")
    sent = SentExercises(Exercises(), kept, get_robot)
    assert sent.title("my-own") == f"Version {MOST_VERSIONS}"
    assert sent.said("my-own", 7, "2") == "2", "one version is forgotten"
    again = with_own(kept, {"my-own": own(f"Version {MOST_VERSIONS}")})
    assert again["my-own"] == versions, "the same text again is no other version"
    for i in range(30):
        kept = with_own(kept, {f"own-{i}": own() + "#" * 3000})
    assert sum(len(one) for texts in kept.values() for one in texts) <= MOST_OWN
    assert "my-own" not in kept
    assert list(kept)[-1] == "own-29"


def test_a_course_of_a_learning_platform_brings_them(tmp_path: Path) -> None:
    course = Course("Mine", items=(Item("lesson", "dh"),)).bringing(parse_exercise(own()))
    (tmp_path / "mine.toml").write_text(to_toml(to_data(course)), encoding="utf-8")
    contents = {one.name: one for one in contents_of(Courses(Exercises(), tmp_path))}
    [(key, [text])] = contents["course:mine"].state(1.0)["own"].items()
    assert (key, parse_exercise(text).title) == ("my-own", HOSTILE)
    assert "own" not in contents["course:first-steps"].state(1.0)


def test_only_the_teacher_sends(school: School) -> None:
    student: Attendance = school.hub.attend(school.ann, lambda: None)
    with pytest.raises(PermissionError):
        student.send_task("my-own", own())
    with pytest.raises(PermissionError):
        student.send_course("{}", {"my-own": own()})
    assert texts(school.state()) == []
    student.leave()
