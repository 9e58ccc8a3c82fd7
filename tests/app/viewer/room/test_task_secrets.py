"""The numbers of a task in a room, and its answer, which no page can get elsewhere or before it is due."""

from __future__ import annotations

import json

import pytest
from students import Room, begin, exercise, press, text_of

from app.classroom import ClassroomUnavailable, NewAttempt, RefusedError, Ticket
from app.classroom.rooms import Rooms

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

VARIED = "two-elbows"


def test_the_numbers_of_a_seat_are_on_all_its_pages_and_on_no_other(students: Room) -> None:
    one, ann = exercise("tool-speed"), students.join("Ann")
    mine = students.variant(ann, one)
    joined = ((ticket, students.variant(ticket, one)) for ticket in (students.join(f"Bob {k}") for k in range(20)))
    bob, his = next(each for each in joined if text_of(one, each[1]) != text_of(one, mine))  # seeds are random
    tab = students.student(ann)
    begin(tab, one)
    tab.wait(lambda: text_of(one, mine) in tab.html)
    tab.wait(lambda: any(text for text in tab.kept))
    state = {"seed": 5, "at": one.id, "done": {}}
    for ticket, variant in ((ann, mine), (bob, his), (None, one.variant(5))):
        other = students.student(ticket, exercises=state)
        other.wait(lambda other=other, variant=variant: text_of(one, variant) in other.html)
    alone = {text_of(one, one.variant(seed)) for seed in range(50)}
    assert str(mine.name.split(":")[1]) not in str(tab.log), "the seed stays in the service"
    assert len(alone) > 20


def test_an_answer_that_was_shown_is_stored_and_no_page_of_the_seat_can_give_it(students: Room) -> None:
    one, ann = exercise(VARIED), students.join("Ann")
    first, second = students.student(ann), students.student(ann)
    for tab in (first, second):
        begin(tab, one)
    press(first, "reveal")
    first.wait(lambda: "data-exercises-solution" in first.html)
    assert students.attempts(ann) == [("The answer was shown.", 0.0)]
    second.wait(lambda: "data-exercises-solution" in second.html)
    third = students.student(ann)
    begin(third, one)
    third.wait(lambda: "data-exercises-solution" in third.html)
    right = one.kind.answer(students.variant(ann, one))
    for tab in (second, third):
        press(tab, "fields", value=right)
        tab.settle()
    seed = int(students.variant(ann, one).name.split(":")[1])
    page = students.hub.attend(ann, lambda: None)  # a page that does not know
    with pytest.raises(RefusedError, match="You have seen the answer to this task"):
        page.submit(NewAttempt(one.id, seed, right, "Yes.", 1.0, 0.0))
    page.leave()
    assert students.attempts(ann) == [("The answer was shown.", 0.0)]
    press(second, "again")
    second.wait(lambda: "data-exercises-attempts" not in second.html)


def test_an_answer_is_not_shown_while_that_cannot_be_stored(
    students: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    def away(*_: object) -> None:
        raise ClassroomUnavailable("The disk is full.")

    tab = students.student(students.join("Ann"))
    begin(tab, exercise(VARIED))
    monkeypatch.setattr(Rooms, "submit", away)
    press(tab, "reveal")
    tab.wait(lambda: "The disk is full." in tab.html)
    assert "data-exercises-solution" not in tab.html


def test_a_course_without_answers_shows_none_when_it_is_closed(students: Room) -> None:
    course = {"title": "Test", "answers": False, "item": [{"exercise": VARIED}]}
    teacher = students.hub.attend(Ticket(students.room.id), lambda: None)
    teacher.send_course(json.dumps(course))
    tab = students.student(students.join("Ann"))
    tab.wait(lambda: "Test" in tab.html)
    tab.wait(lambda: 'data-course="follow"' in tab.html)
    tab.say("feature", ["course", ["close", 1], None])
    tab.wait(lambda: 'data-course="choose"' in tab.html)
    tab.set("Lesson", "Exercises")
    tab.wait(lambda: 'data-exercises="list"' in tab.html)
    begin(tab, exercise(VARIED))
    assert "Show the answer" not in tab.html
    press(tab, "reveal")
    press(tab, "hint")
    tab.wait(lambda: "Hint 1." in tab.html)
    assert "data-exercises-solution" not in tab.html
    teacher.send_course("")
    tab.settle()
    press(tab, "hint")
    tab.wait(lambda: "Show the answer" in tab.html)
    teacher.leave()
