"""An exercise that the teacher wrote: students solve it in the room, and no message gives it away."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from students import ALL, UNITS, Room, press

from app.classroom import NewAttempt, Ticket
from app.classroom.courses import Course, Seal, to_data
from app.classroom.results.keys import result_key
from app.exercises import Exercises, parse_exercise
from app.exercises.said import answer_in_words
from app.viewer.exercises.author import Author
from app.viewer.room.following import shared
from app.viewer.session.state import PageState, decode, encode
from kin.files import classic_robots
from kin.parsing import to_toml

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

SOURCE = next(one for one in ALL.all if one.id == "planar-tool-point")
DATA = {**tomllib.loads(Path(SOURCE.file).read_text()), "id": "my-own", "title": "My own question"}
DATA["answer"] = {
    **DATA["answer"],
    "method": "SECRETMETHOD",
    "mistakes": [{"value": ["1", "2"], "reason": "SECRETREASON"}],
}
OWN = parse_exercise(to_toml(DATA))


def gives_away(tab) -> list[str]:  # type: ignore[no-untyped-def]
    """What the page has been sent of the answer: in messages, and in what it stores."""
    kept = [json.dumps(decode(text, list(classic_robots().values())).features) for text in tab.kept]
    sent = [str(tab.log), tab.html, *kept]
    return [word for word in ("SECRETMETHOD", "SECRETREASON", "mistakes") if any(word in text for text in sent)]


@pytest.mark.parametrize("how", ["course", "task"])
def test_students_solve_an_exercise_that_the_teacher_wrote(students: Room, how: str) -> None:
    teacher, ticket = students.hub.attend(Ticket(students.room.id), lambda: None), students.join("Ann")
    tab = students.student(ticket)
    if how == "task":
        teacher.send_task(OWN.id, OWN.source)
    else:
        seal = Seal(lambda: result_key(students.hub))
        teacher.send_course(json.dumps(to_data(Course("Mine").bringing(OWN), seal)))
        tab.wait(lambda: "My own question" in tab.html)
        tab.say("feature", ["course", ["next", 1], None])
    tab.wait(lambda: f'data-exercise="{OWN.id}"' in tab.html)
    tab.wait(lambda: any(OWN.id in json.dumps(decode(text, [OWN.robot]).features) for text in tab.kept))
    assert "Go on writing" not in tab.html
    assert gives_away(tab) == []
    variant = students.variant(ticket, OWN)
    press(tab, "fields", value=[OWN.kind.answer(variant)])
    tab.wait(lambda: "✓ Right" in tab.html)
    tab.wait(lambda: students.attempts(ticket) != [])
    assert students.attempts(ticket)[-1][1] == 1.0
    assert OWN.solution(variant, UNITS).split()[0] in tab.html
    tab.wait(lambda: decode(tab.kept[-1], [OWN.robot]).features.get("exercises", {}).get("done", {}) != {})
    again = students.student(ticket, **decode(tab.kept[-1], [OWN.robot]).features)
    again.wait(lambda: "data-exercises-solution" in again.html and OWN.title in again.html)
    teacher.leave()


def test_a_draft_is_not_shown_to_followers() -> None:
    assert Exercises().get(OWN.id) is None
    state = PageState(lesson="author", features={"author": {"draft": OWN.source}, "screws": {}})
    assert shared(state, [Author]).features == {}  # type: ignore[list-item]


def test_a_teacher_who_writes_an_exercise_leads_into_no_lesson(students: Room) -> None:
    """What students would see there is that only the teacher writes."""
    teacher, tab = (
        students.hub.attend(Ticket(students.room.id), lambda: None),
        students.student(students.join("Ann")),
    )
    shown = encode(PageState(OWN.robot.id, OWN.robot.q_home, lesson="author"))
    teacher.tell_page(shown)
    teacher.set_follow(True)
    tab.wait(lambda: "data-class-bar" in tab.html and "You follow the teacher" in tab.html)
    tab.settle()
    assert "the teacher writes the exercises" not in tab.html
    teacher.leave()


def test_a_students_page_takes_no_draft(students: Room) -> None:
    tab = students.student(students.join("Ann"), author={"draft": OWN.source})
    tab.set("Lesson", "Write an exercise")
    tab.wait(lambda: "the teacher writes the exercises" in tab.html)
    tab.say("feature", ["author", ["set", "new", 1], "two-elbows"])
    tab.wait(lambda: "a page of a teacher" in tab.html)
    tab.settle()
    assert gives_away(tab) == []


@pytest.mark.parametrize("how", ["course", "task"])
def test_a_teachers_other_page_knows_what_was_sent(students: Room, how: str) -> None:
    """On another machine, say: it has not written the exercise."""
    packed = to_data(Course("Mine").bringing(OWN), Seal(lambda: result_key(students.hub)))
    teacher, ticket = Ticket(students.room.id), students.join("Ann")
    writes = students.student(teacher, course={"course": packed, "at": -1})
    writes.wait(lambda: ">Mine</option>" in writes.html and f'<option value="{OWN.id}"' in writes.html)
    other = students.student(teacher)
    other.wait(lambda: 'data-class-bar="teacher"' in other.html)
    assert OWN.title not in other.html
    writes.say("feature", ["class", ["fields", how, 1], [[OWN.id if how == "task" else "0"]]])
    other.wait(lambda: f'<option value="{OWN.id}"' in other.html)
    if how == "task":
        other.wait(lambda: f"Now: <b>{OWN.title}</b>" in other.html and "End the task" in other.html)
    students.hub.rooms.submit(ticket, NewAttempt(OWN.id, 7, ["12", "34"], "Wrong.", 0.0, started=0.0))
    student = students.hub.attend(ticket, lambda: None)
    student.tell_task(OWN.id)
    words = answer_in_words(OWN, 7, '["12", "34"]')
    assert words not in ("", '["12", "34"]')
    other.wait(lambda: words in other.html)
    student.leave()
