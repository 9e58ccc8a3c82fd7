"""A class in visitors' pages: one teacher and students, each with a websocket of their own, and one database."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer
from pydantic import SecretStr

import kin
from app.classroom import COOKIE, Attendance, Hub, Ticket
from app.classroom.courses import Course, Item, to_data
from app.exercises import Exercises
from app.live import Line, Lines, Program
from app.live.announced import Announcement, Button
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.room.following import decoded
from app.viewer.room.member import SURE, Member
from app.viewer.room.page import ClassroomPage
from app.viewer.room.student import Student
from app.viewer.room.teacher import Teacher
from app.viewer.room.wall import DRIVEN, PADS
from app.viewer.server import ViewerServer
from app.viewer.session.choices import ViewState
from app.viewer.session.state import PageState, decode, encode
from app.viewer.session.worker.threads import BUILDS

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ROBOT = kin.files.classic_robots()["pioneer5"]
EXERCISE = "which-joint-goes-down"


class Class:
    """A service with rooms, and browsers of their members."""

    def __init__(self, port: int, hub: Hub) -> None:
        self.port, self.hub = port, hub
        self.room = hub.rooms.open("Robotics <i>2</i>", 3600.0)
        self._open: list[FakeBrowser] = []

    def browser(self, token: str, embedded: str = "", state: str = "") -> FakeBrowser:
        headers = {"Cookie": f"{COOKIE}={token}"} if token else {}
        memory = json.dumps({"address": "http://127.0.0.1/", "embedded": embedded, "state": state})
        browser = FakeBrowser(self.port, memory=memory, additional_headers=headers, close_timeout=0.1)
        self._open.append(browser)
        browser.__enter__()
        return browser

    def teacher(self) -> FakeBrowser:
        browser = self.browser(self.room.token)
        browser.wait(lambda: 'data-class-bar="teacher"' in browser.html)
        return browser

    def join(self, alias: str) -> tuple[FakeBrowser, Ticket]:
        ticket = self.hub.rooms.join(self.room.code, alias)
        return self.student(ticket), ticket

    def student(self, ticket: Ticket) -> FakeBrowser:
        browser = self.browser(self.hub.rooms.tokens.sign(ticket))
        browser.wait(lambda: "data-class-bar" in browser.html)
        return browser

    def close(self) -> None:
        for browser in self._open:
            browser.close()


@pytest.fixture
def room(rooms_served: tuple[int, Hub]) -> Iterator[Class]:
    found = Class(*rooms_served)
    yield found
    found.close()
    found.hub.rooms.end(found.room.id)


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> list[Line]:
    """The lines of the pages of the test, in the order in which they were opened."""
    lines: list[Line] = []
    open_line = Lines.open

    def opened(self: Lines, *arguments: Any) -> Line:
        lines.append(open_line(self, *arguments))
        return lines[-1]

    monkeypatch.setattr(Lines, "open", opened)
    return lines


def press(browser: FakeBrowser, *key: str, value: object = None) -> None:
    """Press a control of the tab Class, as static/lesson.js does."""
    browser.say("feature", ["class", [*key, len(browser.log)], value])


def opened(browser: FakeBrowser) -> dict[str, Any]:
    """The lesson, and the states of the features, that the page has stored last."""
    state = decode(browser.kept[-1], [*kin.files.classic_robots().values()])
    return {"lesson": state.lesson, **state.features}


def bar(browser: FakeBrowser) -> str:
    """The kind of the bar over the scene."""
    return browser.html.split('data-class-bar="')[1].split('"')[0]


def mode(browser: FakeBrowser, wanted: str) -> None:
    browser.wait(lambda: bar(browser) == wanted)


def at(browser: FakeBrowser, q: np.ndarray) -> None:
    """Wait until the arm is at a configuration."""
    wanted = kin.fk(ROBOT, q)
    browser.wait(lambda: np.allclose(browser.tool_pose(), wanted, atol=1e-6))


def lead(room: Class) -> tuple[FakeBrowser, FakeBrowser, Ticket, np.ndarray]:
    """A teacher who leads a student, at a configuration other than home."""
    teacher = room.teacher()
    student, ticket = room.join("Ann")
    q = ROBOT.q_home.copy()
    q[0] = np.radians(30.0)
    teacher.set("1 rotating base", 30.0)
    press(teacher, "follow")
    mode(student, "led")
    at(student, q)
    return teacher, student, ticket, q


@pytest.mark.full
def test_a_page_without_a_room_has_nothing_of_it(room: Class) -> None:
    plain = room.browser("")
    plain.settle()
    assert "data-class" not in plain.html
    forged = room.browser("W10.forged")
    forged.settle()
    assert "data-class" not in forged.html
    assert not any(thread.name == "kinboard-classroom" for thread in threading.enumerate())


def test_a_page_leaves_its_room_once(room: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    left: list[str] = []
    pages: list[ClassroomPage] = []
    ending = threading.Event()
    leave, end = Attendance.leave, ClassroomPage.end

    def note(page: Attendance) -> None:
        left.append(page.ticket.seat)
        leave(page)

    def keep(page: ClassroomPage) -> None:
        pages.append(page)
        end(page)
        ending.set()

    student, ticket = room.join("Ann")
    monkeypatch.setattr(Attendance, "leave", note)
    monkeypatch.setattr(ClassroomPage, "end", keep)
    student.close()
    assert ending.wait(10.0)
    assert pages[0].join(10.0)
    assert left == [ticket.seat]


@pytest.mark.full
def test_students_see_what_the_teacher_does_until_they_let_go(room: Class) -> None:
    teacher, student, _, q = lead(room)
    q[1] = np.radians(60.0)
    teacher.set("2 rotating elbow", 60.0)
    at(student, q)
    press(student, "go")
    mode(student, "gone")
    q_own = q.copy()
    q_own[0] = np.radians(80.0)
    student.set("1 rotating base", 80.0)
    at(student, q_own)
    teacher.set("2 rotating elbow", 40.0)
    q[1] = np.radians(40.0)
    at(teacher, q)
    assert bar(student) == "gone"
    press(student, "back")
    mode(student, "led")
    at(student, q)
    late, _ = room.join("Late")
    at(late, q)
    press(teacher, "follow")
    mode(student, "free")
    assert student.script["undo"], "undo leads back to what the student had"


def test_who_follows_reads_what_is_true_of_the_arm_on_show(room: Class) -> None:
    teacher, student, _, _ = lead(room)
    far = kin.fk(ROBOT, ROBOT.q_home)
    for step in (0.4, 0.5, 0.6):
        far[0, 3] = step
        teacher.drag(far)
    student.wait(lambda: 'data-status="unreachable"' in student.html)
    teacher.set("2 rotating elbow", 40.0)
    student.wait(lambda: 'data-status="hand"' in student.html)


@pytest.mark.full
def test_a_student_who_moves_the_arm_lets_go(room: Class) -> None:
    _, student, _, q = lead(room)
    student.settle(1.0)  # not within the grace of a new lead
    student.set("1 rotating base", 120.0)
    mode(student, "gone")
    q[0] = np.radians(120.0)
    at(student, q)


@pytest.mark.full
def test_an_arm_that_moves_does_not_render_the_tab_again(room: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    teacher, student, _, q = lead(room)
    student.settle(1.0)
    rendered: list[str] = []
    for kind in (Teacher, Student):
        refresh = kind.refresh

        def counted(self: Member, refresh: Callable[[Any], None] = refresh) -> None:
            rendered.append(type(self).__name__)
            refresh(self)

        monkeypatch.setattr(kind, "refresh", counted)
    for angle in range(20, 60, 4):
        teacher.set("2 rotating elbow", float(angle))
        time.sleep(0.1)
    q[1] = np.radians(56.0)
    at(student, q)
    assert len(rendered) <= 2, rendered
    press(student, "hand")
    teacher.wait(lambda: "hand up" in teacher.html)
    assert {"Teacher", "Student"} <= set(rendered)


def test_the_lesson_the_view_and_the_viewpoint_are_shown_too(room: Class) -> None:
    teacher, student, _, _ = lead(room)
    teacher.set("Lesson", "Screws")
    student.wait(lambda: student.value("Lesson") == "Screws")
    teacher.settle()
    teacher.look()  # where the service has moved the camera
    teacher.look(position=(1.0, 0.5, 0.6), look_at=(0.0, 0.0, 0.2))
    student.wait(lambda: np.allclose(student.camera["position"], (1.0, 0.5, 0.6), atol=1e-3))


def test_who_follows_keeps_the_language(room: Class) -> None:
    _, _, ticket, q = lead(room)
    state = encode(PageState(view=ViewState(language="de")))
    student = room.browser(room.hub.rooms.tokens.sign(ticket), state=state)
    student.wait(lambda: "data-class-bar" in student.html)
    mode(student, "led")
    at(student, q)
    student.settle(0.8)
    assert decode(student.kept[-1], [ROBOT]).view.language == "de"


def test_who_is_frozen_cannot_move(room: Class) -> None:
    teacher, student, _, q = lead(room)
    press(teacher, "freeze")
    student.wait(lambda: "data-class-frozen" in student.html)
    student.set("1 rotating base", 120.0)
    student.wait(lambda: "has frozen the class" in student.html)
    student.wait(lambda: student.value("1 rotating base") == 30.0)
    number = student.say("field", ["nothing", "1"])
    student.wait(lambda: student.script["reply"][0] >= number)
    assert "frozen" in student.script["reply"][1]
    for label in ("Random configuration", "Arm: UR5"):
        student.trigger(label)
    student.settle()
    assert (student.value("1 rotating base"), student.value("Robot")) == (30.0, "Pioneer arm")
    number = student.say("feature", ["sheet", ["page", 1], None])  # printing a worksheet moves nothing
    student.wait(lambda: student.script["reply"] == [number, "", []])
    place = student.local(student.gizmo)
    away = place.copy()
    away[2, 3] += 0.1
    student.drag(away)
    student.release()
    student.wait(lambda: np.allclose(student.local(student.gizmo), place, atol=1e-6))
    press(student, "go")
    press(teacher, "freeze")
    student.wait(lambda: "data-class-frozen" not in student.html)
    assert bar(student) == "led"
    at(student, q)


def test_what_a_frozen_student_drags_goes_back_though_nobody_leads(room: Class) -> None:
    teacher, (student, _) = room.teacher(), room.join("Ann")
    press(teacher, "freeze")
    student.wait(lambda: "data-class-frozen" in student.html)
    student.settle()
    place = student.local(student.gizmo)
    away = place.copy()
    away[2, 3] += 0.1
    student.grab()
    student.drag(away)
    student.release()
    student.wait(lambda: "has frozen the class" in student.html)
    student.settle()
    assert np.allclose(student.local(student.gizmo), place, atol=1e-6)


def test_a_task_opens_and_its_answers_are_stored(room: Class) -> None:
    teacher, student, ticket, _ = lead(room)
    press(teacher, "fields", "task", value=[[EXERCISE]])
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    student.wait(lambda: 'data-class-open="Learn"' in student.html)
    assert bar(student) == "free", "a task ends Follow me"
    for option in (0, 2):
        student.say("feature", ["exercises", ["answer", option + 1], option])
        student.wait(lambda option=option: f'data-class-stored="{1 + option // 2}"' in student.html)
    student.wait(lambda: "Stored for your teacher" in student.html)
    teacher.wait(lambda: "1 of 1 solved" in teacher.html)
    attendance = room.hub.attend(Ticket(ticket.room), lambda: None)
    (seat,) = attendance.room.seats
    attendance.leave()
    assert (seat.task, seat.work[EXERCISE].tries, seat.work[EXERCISE].progress) == (EXERCISE, 2, "solved")

    # The words below an answer do not stay below the next exercise, from which the bar leads back.
    leads_back = "Open task</button>"

    def beside_the_task() -> bool:
        """Whether the way back stands in every tab: beside the task itself it is hidden in the tab Learn."""
        end = student.html.partition("data-class-bar")[2]
        return leads_back in end and 'data-class-hidden-in="Learn"' not in end

    assert not beside_the_task()
    student.say("feature", ["exercises", ["open", "which-joint-moved", 1], None])
    student.wait(lambda: 'data-exercise="which-joint-moved"' in student.html)
    student.wait(lambda: "Stored for your teacher" not in student.html)
    student.wait(beside_the_task)
    press(student, "task")
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    student.wait(lambda: not beside_the_task())

    # Who goes on to something else has still solved it.
    student.set("Lesson", "Screws")
    teacher.wait(lambda: ">solved · 2 tries · at the arm</span>" in teacher.html)
    assert "1 of 1 solved" in teacher.html


@pytest.mark.full
def test_two_tabs_and_a_repeated_answer_are_one_student(room: Class) -> None:
    teacher, student, ticket, _ = lead(room)
    press(teacher, "fields", "task", value=[[EXERCISE]])
    second = room.student(ticket)
    for tab in (student, second):
        tab.wait(lambda tab=tab: f'data-exercise="{EXERCISE}"' in tab.html)
        tab.wait(lambda tab=tab: "</b>, not begun" in tab.html)
    for tab in (student, second):  # the tab has sent it again, over a new connection
        tab.say("feature", ["exercises", ["answer", "0123456789abcdef", 1], 0])
        tab.wait(lambda tab=tab: "</b>, 1 try" in tab.html)
        tab.wait(lambda tab=tab: "1 attempt," in tab.html)
    teacher.wait(lambda: "at it · 1 try" in teacher.html)
    second.say("feature", ["exercises", ["answer", "fedcba9876543210", 2], 2])
    for tab in (student, second):
        tab.wait(lambda tab=tab: "</b>, solved" in tab.html)
        tab.wait(lambda tab=tab: "data-exercises-solution" in tab.html and "2 attempts," in tab.html)
    teacher.wait(lambda: "solved · 2 tries" in teacher.html)
    again = room.student(ticket)  # after a reload that has lost what the browser stored
    again.wait(lambda: "</b>, solved" in again.html)


def test_a_lead_pauses_the_task_and_returns_to_it(room: Class) -> None:
    teacher, student, _, q = lead(room)
    press(teacher, "fields", "task", value=[[EXERCISE]])
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    assert "If you press <i>Show the answer</i>, this is stored: your teacher sees it" in student.html
    mode(student, "free")
    press(teacher, "follow")
    student.wait(lambda: "data-class-paused" in student.html)
    assert bar(student) == "led"
    student.wait(lambda: f'data-exercise="{EXERCISE}"' not in student.html)
    at(student, q)
    teacher.wait(lambda: 'You lead</b> <span data-class-led="1">1 of 1 student' in teacher.html)
    press(teacher, "follow")
    mode(student, "free")
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    student.wait(lambda: "data-class-paused" not in student.html)


@pytest.mark.full
def test_a_lead_pauses_the_exercise_of_a_course_and_returns_to_it(room: Class) -> None:
    teacher, student, ticket, q = lead(room)
    press(teacher, "fields", "course", value=[["0"]])
    student.wait(lambda: 'data-course="follow"' in student.html)
    student.say("feature", ["course", ["next", 1], None])
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    press(teacher, "follow")
    student.wait(lambda: "data-class-paused>Exercise paused" in student.html)
    student.wait(lambda: f'data-exercise="{EXERCISE}"' not in student.html)
    at(student, q)
    student.wait(lambda: opened(student).get("class") == {"paused": True})  # for a reload
    again = room.browser(room.hub.rooms.tokens.sign(ticket), state=student.kept[-1])
    for tab in (student, again):
        tab.wait(lambda tab=tab: "data-class-paused>Exercise paused" in tab.html)
    press(teacher, "follow")
    for tab in (student, again):
        tab.wait(lambda tab=tab: f'data-exercise="{EXERCISE}"' in tab.html)
        assert 'data-course="bar"' in tab.html
        assert "data-left-off" not in tab.html
        assert tab.left_off == [], "nothing of a seat is left for the next student of the browser"

    # Who has stopped following and opened something else keeps that.
    mode(student, "free")
    press(teacher, "follow")
    mode(student, "led")
    press(student, "go")
    mode(student, "gone")
    student.set("Lesson", "Screws")
    student.wait(lambda: student.value("Lesson") == "Screws")
    press(teacher, "follow")
    mode(student, "free")
    student.settle()
    assert student.value("Lesson") == "Screws"


@pytest.mark.full
def test_what_is_opened_is_stored_in_the_same_step(room: Class) -> None:
    """A reload brings it back, however soon it comes: also while the arm is still on its way to the pose."""
    student, _ = room.join("Ann")
    student.set("Lesson", "Courses")
    student.wait(lambda: 'data-course="choose"' in student.html)
    student.wait(lambda: bool(student.kept) and opened(student)["lesson"] == "course")
    student.say("feature", ["course", ["pick", 1], 0])
    student.wait(lambda: 'data-course="follow"' in student.html)
    student.log.clear()
    stored = len(student.kept)
    student.say("feature", ["course", ["next", 1], None])
    student.wait(lambda: len(student.kept) > stored and EXERCISE in student.html)
    shown = next(i for i, m in enumerate(student.log) if f'data-exercise="{EXERCISE}"' in str(m))
    assert not any(m["type"] == "SetOrientationMessage" for m in student.log[shown:]), "in the same step"
    assert opened(student)["exercises"]["at"] == EXERCISE
    assert opened(student)["course"]["at"] == 0
    count = len(student.kept)
    student.settle(1.5)
    assert len(student.kept) - count <= 1, "nothing but the viewpoint is stored again"
    student.say("feature", ["exercises", ["hint", 1], None])
    student.wait(lambda: "Hint 1." in student.html)
    student.wait(lambda: EXERCISE in opened(student)["exercises"]["done"])
    assert opened(student)["exercises"]["done"][EXERCISE][2] == 1


def test_the_picker_keeps_its_place_and_shows_the_exercise(room: Class) -> None:
    teacher = room.teacher()
    teacher.say("feature", ["class", ["set", "task", 1], "which-joint-moved"])
    teacher.wait(lambda: 'data-class-preview="which-joint-moved"' in teacher.html)
    assert '<option value="which-joint-moved" selected>' in teacher.html
    press(teacher, "fields", "task", value=[[EXERCISE]])
    teacher.wait(lambda: f'<option value="{EXERCISE}" selected>' in teacher.html)
    assert f'data-class-preview="{EXERCISE}"' in teacher.html


def test_a_task_ends_the_obstacles_of_who_was_followed(room: Class) -> None:
    def shown(tab: FakeBrowser, shape: str) -> bool:
        return f'dir="auto">{shape}' in tab.html

    teacher = room.teacher()
    ann, bob = room.join("Ann")[0], room.join("Bob")[0]
    bob.say("feature", ["obstacles", ["add", "sphere", 1], None])
    bob.wait(lambda: shown(bob, "sphere"))
    teacher.say("feature", ["obstacles", ["add", "table", 1], None])
    teacher.set("1 rotating base", 30.0)
    press(teacher, "follow")
    for tab in (ann, bob):
        tab.wait(lambda tab=tab: shown(tab, "table") and not shown(tab, "sphere"))
    press(teacher, "fields", "task", value=[[EXERCISE]])
    for tab in (ann, bob):
        tab.wait(lambda tab=tab: f'data-exercise="{EXERCISE}"' in tab.html)
        tab.wait(lambda tab=tab: not shown(tab, "table"))
    bob.wait(lambda: shown(bob, "sphere"))


def test_a_new_course_of_the_teacher_can_be_sent_at_once(room: Class) -> None:
    teacher, student = room.teacher(), room.join("Ann")[0]
    teacher.wait(lambda: 'aria-label="Course"' in teacher.html)
    assert ">My course</option>" not in teacher.html
    teacher.set("Lesson", "Courses")
    teacher.wait(lambda: 'data-course="choose"' in teacher.html)
    teacher.say("feature", ["course", ["new", 1], 0])
    teacher.wait(lambda: 'data-guide-change="add"' in teacher.html)
    teacher.say("feature", ["course", ["set", "add", 1], "lesson:postures"])
    teacher.wait(lambda: ">My course</option>" in teacher.html)
    press(teacher, "fields", "course", value=[["0"]])
    student.wait(lambda: 'data-course="follow"' in student.html and "My course" in student.html)


def test_a_course_opens_on_every_page(room: Class) -> None:
    teacher, student, _, _ = lead(room)
    press(teacher, "fields", "course", value=[["0"]])
    student.wait(lambda: 'data-class-open="Learn"' in student.html)
    student.wait(lambda: student.value("Lesson") == "Courses")
    teacher.wait(lambda: "data-class-course" in teacher.html)
    mode(student, "free")
    title = teacher.html.split("data-class-course>Course: <b>")[1].split("<")[0]
    student.wait(lambda: title in student.html)
    student.wait(lambda: 'data-course="follow"' in student.html)
    for words in ("Make a result code", "For teachers", 'data-guide-do="edit"'):
        assert words not in student.html, words
    student.say("feature", ["course", ["close", 1], None])
    student.wait(lambda: 'data-course="choose"' in student.html)
    assert "Check a result code" not in student.html
    assert "New course" not in student.html
    press(teacher, "uncourse")
    teacher.wait(lambda: "data-class-course" not in teacher.html)


def test_every_second_student_gets_what_a_course_compares_in_the_other_order(room: Class) -> None:
    keys = "two-elbows", "swing", "other-wrist"
    course = Course("Week 1", "", tuple(Item("exercise", key) for key in keys), before=keys[:1], after=keys[2:])
    (ann, _), (bob, ticket) = room.join("Ann"), room.join("Bob")
    teacher = room.hub.attend(Ticket(room.room.id), lambda: None)
    teacher.send_course(json.dumps(to_data(course)))
    teacher.leave()
    titles = [Exercises().get(key).title for key in keys]  # type: ignore[union-attr]
    for student, order in ((ann, titles), (bob, titles[::-1]), (room.student(ticket), titles[::-1])):
        student.wait(lambda student=student: 'data-course="follow"' in student.html)
        places = [student.html.index(f'kb-exercise-name">{title}<') for title in order]
        assert places == sorted(places)


def test_a_course_replaces_the_task_and_says_so(room: Class) -> None:
    teacher, student, _, _ = lead(room)
    press(teacher, "fields", "task", value=[[EXERCISE]])
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    teacher.wait(lambda: "data-class-replaces>It ends the task “<b>Which joint" in teacher.html)
    student.say("feature", ["exercises", ["answer", 1], 0])
    student.wait(lambda: "data-class-stored" in student.html)
    press(teacher, "follow")
    press(teacher, "fields", "course", value=[["0"]])
    student.wait(lambda: "is over; your answers stay stored" in student.html)
    student.wait(lambda: student.value("Lesson") == "Courses")
    student.wait(lambda: "data-class-task" not in student.html)
    teacher.wait(lambda: "data-class-course" in teacher.html and "data-class-task" not in teacher.html)
    assert "data-class-replaces" not in teacher.html
    assert bar(student) == "free"
    late, _ = room.join("Late")
    late.wait(lambda: late.value("Lesson") == "Courses")
    assert "data-class-task" not in late.html

    # The same course again opens again; another task may be sent while one runs, and the course stays open.
    press(teacher, "fields", "task", value=[[EXERCISE]])
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    press(teacher, "fields", "task", value=[["which-joint-moved"]])
    student.wait(lambda: 'data-exercise="which-joint-moved"' in student.html)
    assert "data-class-course" in teacher.html
    press(teacher, "fields", "course", value=[["0"]])
    press(teacher, "uncourse")
    press(teacher, "fields", "course", value=[["0"]])
    student.wait(lambda: student.value("Lesson") == "Courses")


@pytest.mark.full
def test_a_question_is_asked_and_counted(room: Class) -> None:
    teacher = room.teacher()
    ann, _ = room.join("Ann")
    bob, _ = room.join("Bob")
    press(teacher, "fields", "ask", value=[["Elbow <b>up</b>?"], ["Up"], ["Down"], [""]])
    for student, choice in ((ann, 0), (bob, 1), (ann, 1)):
        student.wait(lambda student=student: "Elbow &lt;b&gt;up" in student.html)
        press(student, "vote", value=choice)
        teacher.settle()
    teacher.wait(lambda: "2 votes" in teacher.html)
    assert "width: 100%" in teacher.html
    assert "2 votes" not in ann.html
    ann.wait(lambda: "Vote counted: Down" in ann.html)
    assert "data-class-result" not in ann.html
    press(teacher, "close")
    for student in (ann, bob):
        student.wait(lambda student=student: 'data-class-poll="closed"' in student.html)
        student.wait(
            lambda student=student: "Down (yours): <b>2</b>" in student.html.partition("data-class-result")[2]
        )
    assert "width: 100%" in bob.html
    press(ann, "read")
    ann.wait(lambda: "data-class-result" not in ann.html)
    assert "data-class-result" in bob.html


def test_a_students_arm_is_shown_to_all(room: Class) -> None:
    teacher = room.teacher()
    ann, ticket = room.join("Ann <u>")
    bob, _ = room.join("Bob")
    ann.set("1 rotating base", 55.0)
    q = ROBOT.q_home.copy()
    q[0] = np.radians(55.0)
    at(ann, q)
    teacher.wait(lambda: "Ann &lt;u&gt;" in teacher.html)
    assert "<u>" not in teacher.html
    press(teacher, "pick", ticket.seat)
    ready = f'data-guide-do="show" data-question-key="{ticket.seat}" data-argument="1" class'
    teacher.wait(lambda: ready in teacher.html)
    press(teacher, "show", ticket.seat, value=0)
    mode(ann, "shown")
    at(bob, q)
    at(teacher, q)
    bob.wait(lambda: "a classmate’s arm" in bob.html)
    assert "Ann" not in bob.html
    press(teacher, "show", ticket.seat, value=1)
    bob.wait(lambda: "the arm of Ann" in bob.html)
    press(teacher, "return")
    mode(bob, "free")
    at(teacher, ROBOT.q_home)


@pytest.mark.full
def test_the_wall_sends_one_list_of_poses_for_all(room: Class) -> None:
    teacher = room.teacher()
    students = [room.join(f"Student {i}") for i in range(3)]
    teacher.wait(lambda: teacher.html.count('data-guide-do="pick"') == 3)
    teacher.say("feature", ["obstacles", ["add", "table", 1], None])
    teacher.wait(lambda: "Added: table" in teacher.html)
    tops = [name for name in teacher.nodes if name.startswith("/obstacles-") and name.count("/") == 1]
    assert len(tops) == 1, "of the table and its arrows"
    press(teacher, "wall")
    teacher.wait(lambda: sum("/wall-" in name and name.endswith("/name/2") for name in teacher.nodes) == 1)
    hidden = (teacher.gizmo, *tops)
    assert [teacher.visible[name] for name in hidden] == [False] * 2
    press(teacher, "wall")
    teacher.wait(lambda: [teacher.visible[name] for name in hidden] == [True] * 2)
    press(teacher, "wall")
    teacher.wait(lambda: [teacher.visible[name] for name in hidden] == [False] * 2)
    teacher.wait(lambda: any(name.endswith("/arms") for name in teacher.nodes))
    arm = next(name for name in teacher.nodes if name.endswith("/arms"))
    teacher.settle(0.6)
    teacher.log.clear()
    students[0][0].set("1 rotating base", 70.0)
    students[1][0].set("2 rotating elbow", 70.0)
    teacher.wait(lambda: any(m.get("name") == arm for m in teacher.log))
    teacher.settle(0.5)
    updates = [m["updates"].keys() for m in teacher.log if m.get("name") == arm]
    assert 1 <= sum("batched_positions" in keys for keys in updates) <= 2
    count = len(teacher.nodes[arm]["props"]["batched_positions"])
    teacher.send(
        "SceneNodeClickMessage",
        name=arm,
        instance_index=count // 3 - 1,
        ray_origin=(0, 0, 0),
        ray_direction=(0, 0, 1),
        screen_pos=(0.5, 0.5),
        modifier=None,
        owner=teacher.nodes[arm]["owner"],
    )
    teacher.wait(lambda: 'The arm of <span dir="auto">Student 2</span>' in teacher.html)
    teacher.wait(lambda: not any("/wall-" in name for name in teacher.nodes))
    assert teacher.visible[teacher.gizmo] is True


@pytest.mark.full
def test_the_wall_comes_back_after_a_reload(room: Class) -> None:
    teacher, _ = room.teacher(), room.join("Ann")

    def is_on(browser: FakeBrowser) -> bool:
        arm = browser.visible.get(browser.gizmo) is False
        return arm and any("/wall-" in name and name.endswith("/name/0") for name in browser.nodes)

    press(teacher, "wall")
    teacher.wait(lambda: is_on(teacher))
    teacher.wait(lambda: teacher.kept and opened(teacher)["class"] == {"drawn": True})
    again = room.browser(room.room.token, state=teacher.kept[-1])
    again.wait(lambda: is_on(again))
    again.wait(lambda: "data-class-wall" in again.html)
    press(again, "wall")
    again.wait(lambda: again.visible[again.gizmo] is True)
    again.wait(lambda: again.kept and "class" not in opened(again))
    student = room.browser(room.hub.rooms.tokens.sign(room.join("Bob")[1]), state=teacher.kept[-1])
    student.wait(lambda: "data-class-bar" in student.html)
    student.settle()
    assert not any("/wall-" in name for name in student.nodes), "the link of a teacher opens it for no student"


def test_the_wall_says_what_the_list_says(room: Class) -> None:
    def names() -> list[str]:
        found = {name: node["props"]["text"] for name, node in teacher.nodes.items() if "/name/" in name}
        return [found[name] for name in sorted(found)]

    teacher = room.teacher()
    tabs, tickets = zip(*(room.join(alias) for alias in ("Ann", "Bob", "Eve")), strict=True)
    press(teacher, "fields", "task", value=[[EXERCISE]])
    for tab in tabs:
        tab.wait(lambda tab=tab: f'data-exercise="{EXERCISE}"' in tab.html)
    press(teacher, "wall")
    teacher.wait(lambda: names() == ["Ann\n○ not begun", "Bob\n○ not begun", "Eve\n○ not begun"])
    tabs[0].say("feature", ["exercises", ["answer", 1], 2])
    for option in range(3):
        tabs[1].say("feature", ["exercises", ["answer", f"{option}", option], 0])
    press(tabs[0], "hand")
    press(tabs[1], "hand")
    teacher.wait(lambda: names() == ["☝ Ann\n✓ solved", "☝ Bob\n! stuck", "Eve\n○ not begun"])
    colours = [
        tuple(np.ravel(teacher.nodes[name]["props"]["batched_colors"])[:3])
        for name in teacher.nodes
        if name.endswith("/pads")
    ]
    assert colours == [PADS["solved"]]
    room.hub.rooms.remove_seat(room.room.id, tickets[2].seat)
    teacher.wait(lambda: names() == ["☝ Ann\n✓ solved", "☝ Bob\n! stuck"])
    room.hub.rooms.end(room.room.id)
    teacher.wait(lambda: names() == [])
    teacher.wait(lambda: "Close the wall" not in teacher.html)


@pytest.mark.full
def test_a_driven_arm_is_marked_on_the_wall_and_in_the_list(room: Class, lines: list[Line]) -> None:
    def names() -> list[str]:
        return [node["props"]["text"] for name, node in sorted(teacher.nodes.items()) if "/name/" in name]

    teacher, (student, _), (other, _) = room.teacher(), room.join("Ann"), room.join("Bob")
    student.set("Connect a program", True)
    student.wait(lambda: "data-live-code" in student.html)
    press(teacher, "wall")
    teacher.wait(lambda: names() == ["Ann", "Bob"])
    lines[0].send({"drives": "welder 7"})
    teacher.wait(lambda: names() == ["Ann\n● drives welder 7", "Bob"])
    assert "drives welder 7" in teacher.html, "in the list"
    pads = next(node for name, node in teacher.nodes.items() if name.endswith("/pads"))
    assert [tuple(row) for row in np.reshape(pads["props"]["batched_colors"], (-1, 3))][:2] == [
        DRIVEN,
        PADS["none"],
    ]
    assert "welder 7" not in other.html, "the class does not see it"
    lines[0].send({"drives": None})
    teacher.wait(lambda: names() == ["Ann", "Bob"])


@pytest.mark.full
def test_a_member_who_may_not_act_presses_nothing_of_a_program_but_what_stops_it(
    room: Class, lines: list[Line]
) -> None:
    buttons = Button("weigh", "Weigh"), Button("enable", "Enable", "It moves."), Button("stop", "Stop", stops=True)

    def heard(*presses: str) -> list[str]:
        """What the program hears when the student presses these."""
        number = int(student.html.split('data-argument="')[1].split('"')[0])
        kinds = {each.name: each.event for each in buttons}
        for k, name in enumerate(presses):
            student.say("feature", ["connect", [kinds[name], name, len(student.log) + k], number])
        student.settle()
        return [reply.pressed for reply in lines[0].replies() if reply.pressed]

    teacher, (student, _) = room.teacher(), room.join("Ann")
    student.set("Connect a program", True)
    student.wait(lambda: "data-live-code" in student.html)
    lines[0].connect(Program("arm.py", "1", lambda: None))
    lines[0].send({"announce": Announcement("It waits.", "ready", buttons)})
    student.wait(lambda: 'data-announced="ready"' in student.html)
    everything = ["weigh", "enable", "stop"]
    assert heard(*everything) == everything
    press(teacher, "freeze")
    student.wait(lambda: "data-class-frozen" in student.html)
    assert heard(*everything) == ["stop"]
    assert "has frozen the class" in student.html
    press(teacher, "freeze")
    student.wait(lambda: "data-class-frozen" not in student.html)
    press(teacher, "follow")
    mode(student, "led")
    assert heard(*everything) == ["stop"]
    assert "Press Stop following first." in student.html
    assert bar(student) == "led", "the lead goes on"
    assert 'data-announced="' not in teacher.html, "the buttons are those of the page that is connected"


STOP = Button("stop", "Stop", stops=True)


def drive(browser: FakeBrowser, lines: list[Line], *buttons: Button) -> Line:
    """A program drives an arm with this page, and has announced so if it has buttons."""
    browser.set("Connect a program", True)
    browser.wait(lambda: "data-live-code" in browser.html)
    line = lines[-1]
    line.connect(Program("arm.py", "1", lambda: None))
    line.send({"drives": "SO-101"})
    if buttons:
        line.send({"announce": Announcement("It follows.", "enabled", buttons)})
    browser.wait(lambda: browser.shown.get("driven") == "SO-101")
    browser.settle()
    return line


def pressed(line: Line) -> list[str]:
    """The buttons that the program has heard of since."""
    return [reply.pressed for reply in line.replies() if reply.pressed]


def presses_before(line: Line, moved: Callable[[Any], bool]) -> list[bool]:
    """Whether the program is to hear of a button, each time that it hears of joints that `moved` names."""
    found, publish = list[bool](), line.publish

    def published(name: str, value: Any, anew: bool = True) -> None:
        if name == "q" and moved(value):
            found.append(bool(line._replies))
        publish(name, value, anew)

    line.publish = published  # type: ignore[method-assign]
    return found


@pytest.mark.full
def test_a_real_arm_is_stopped_before_the_page_follows_the_teacher(room: Class, lines: list[Line]) -> None:
    teacher, (student, _) = room.teacher(), room.join("Ann")
    line = drive(student, lines, STOP)
    pressed_first = presses_before(line, lambda q: q[0] != ROBOT.q_home[0])
    teacher.set("1 rotating base", 30.0)
    press(teacher, "follow")
    mode(student, "led")
    student.wait(lambda: "Stopped: the class follows its teacher." in student.html)
    student.wait(lambda: bool(pressed_first))
    assert pressed_first[0], "the press is sent before the first joint of the teacher"
    assert pressed(line) == ["stop"]
    line.send({"drives": None, "announce": Announcement("It holds its place.", "stopped", (STOP,))})
    student.wait(lambda: "Stopped: the class follows its teacher. <bdi>It holds its place." in student.html)
    teacher.set("1 rotating base", 40.0)
    student.settle()
    assert pressed(line) == [], "once"
    press(teacher, "follow")
    mode(student, "free")
    line.send({"drives": "SO-101", "announce": Announcement("It follows.", "enabled", (STOP,))})
    student.wait(lambda: 'data-announced="enabled"' in student.html)
    assert "Stopped: the class follows" not in student.html
    assert pressed(line) == []


@pytest.mark.full
def test_a_program_that_offers_no_stop_is_disconnected_when_the_page_is_led(
    room: Class, lines: list[Line]
) -> None:
    teacher, (student, _) = room.teacher(), room.join("Ann")
    line = drive(student, lines)
    press(teacher, "follow")
    student.wait(lambda: line.ended != "")
    student.wait(lambda: student.shown.get("driven") == "")
    student.wait(lambda: "Stopped: the class follows its teacher" in student.html)


@pytest.mark.full
def test_a_task_of_the_teacher_stops_a_real_arm(room: Class, lines: list[Line]) -> None:
    teacher, (student, _) = room.teacher(), room.join("Ann")
    line = drive(student, lines, STOP)
    press(teacher, "fields", "task", value=[[EXERCISE]])
    student.wait(lambda: f'data-exercise="{EXERCISE}"' in student.html)
    student.wait(lambda: "Stopped: your teacher has sent a task." in student.html)
    assert pressed(line) == ["stop"]


@pytest.mark.full
def test_the_teachers_own_arm_is_stopped_before_a_students_is_shown(room: Class, lines: list[Line]) -> None:
    teacher, (student, ticket) = room.teacher(), room.join("Ann")
    line = drive(teacher, lines, STOP)
    student.set("1 rotating base", 30.0)
    student.settle()
    press(teacher, "look", ticket.seat)
    teacher.wait(lambda: "Stopped: this page shows a student’s arm." in teacher.html)
    assert pressed(line) == ["stop"]


@pytest.mark.full
def test_the_teachers_own_arm_is_stopped_before_the_page_goes_back_to_where_it_was(
    room: Class, lines: list[Line]
) -> None:
    teacher, (_, ticket) = room.teacher(), room.join("Ann")
    line = drive(teacher, lines, STOP)
    there = ROBOT.q_home.copy()
    there[0] += 0.6
    first, last = (kin.motion.Ptp(kin.motion.JointTarget(q)) for q in (ROBOT.q_home, there))
    line.send({"program": kin.motion.Program((first, last)), "play": True})
    begun = teacher.value("1 rotating base")
    teacher.wait(lambda: teacher.value("1 rotating base") > begun + 0.6)
    press(teacher, "wall")
    teacher.wait(lambda: "data-class-wall" in teacher.html)
    teacher.wait(lambda: teacher.value("1 rotating base") == pytest.approx(np.degrees(there[0]), abs=0.01))
    assert pressed(line) == [], "the wall is beside the arm"
    pressed_first = presses_before(line, lambda q: not np.allclose(q, there, atol=1e-4))
    press(teacher, "wall")
    teacher.wait(lambda: "Stopped: this page goes back to where its own arm was." in teacher.html)
    teacher.wait(lambda: bool(pressed_first))
    assert pressed_first[0], "the press is sent before the first joint"
    assert pressed(line) == ["stop"]
    line.send({"drives": None, "announce": Announcement("It holds its place.", "stopped", (STOP,))})
    teacher.wait(lambda: teacher.shown["driven"] == "")
    press(teacher, "look", ticket.seat)
    teacher.wait(lambda: "data-class-looked" in teacher.html)
    press(teacher, "return")
    teacher.wait(lambda: "data-class-looked" not in teacher.html)
    assert pressed(line) == [], "what has stopped is not stopped again"


@pytest.mark.full
def test_what_begins_to_be_driven_ends_a_lead_or_is_stopped_in_a_frozen_class(
    room: Class, lines: list[Line]
) -> None:
    teacher, student, _, _ = lead(room)
    line = drive(student, lines, STOP)
    mode(student, "gone")
    assert pressed(line) == []
    line.send({"drives": None, "announce": Announcement("It holds its place.", "stopped", (STOP,))})
    student.wait(lambda: student.shown["driven"] == "")
    press(teacher, "freeze")
    student.wait(lambda: "data-class-frozen" in student.html)
    mode(student, "led")
    line.send({"drives": "SO-101"})
    student.wait(lambda: "Stopped: the class follows its teacher." in student.html)
    assert pressed(line) == ["stop"]


@pytest.mark.full
def test_the_wall_shows_arms_only(room: Class) -> None:
    def seen() -> set[str]:
        """What is visible at the top of the scene, but lights."""
        lights = {name for name, node in teacher.nodes.items() if "Light" in node["type"]}
        return {name for name in teacher.nodes if name.count("/") == 1 and teacher.visible[name]} - lights

    teacher = room.teacher()
    plain = seen()
    room.join("Ann")
    teacher.wait(lambda: "1 student" in teacher.html)
    teacher.set("Lesson", "Velocity")
    teacher.wait(lambda: seen() > plain)
    lesson = seen()
    press(teacher, "wall")
    teacher.wait(lambda: any(name.startswith("/wall-") for name in teacher.nodes))
    teacher.settle(0.5)
    assert {name.partition("-")[0] for name in seen()} == {"/wall"}
    press(teacher, "wall")
    teacher.wait(lambda: seen() == lesson)


def test_hands_are_seen_and_lowered(room: Class) -> None:
    teacher = room.teacher()
    ann, ticket = room.join("Ann")
    press(ann, "hand")
    teacher.wait(lambda: "hand up" in teacher.html)
    press(teacher, "lower", ticket.seat)
    ann.wait(lambda: "Raise hand" in ann.html)


@pytest.mark.full
def test_students_are_renamed_and_removed_and_the_room_ended_at_the_second_press(room: Class) -> None:
    teacher = room.teacher()
    ann, ticket = room.join("Rude")
    bob, _ = room.join("Bob")
    teacher.wait(lambda: "Rude" in teacher.html)
    press(teacher, "pick", ticket.seat)
    teacher.wait(lambda: "data-class-seat" in teacher.html)
    press(teacher, "fields", "rename", value=[["Ann"]])
    ann.wait(lambda: "you are Ann" in ann.html)
    press(teacher, "remove", ticket.seat)
    press(teacher, "remove", ticket.seat)  # of a double click
    teacher.wait(lambda: "Press again: remove" in teacher.html)
    teacher.settle(SURE)
    assert bar(ann) == "free"
    press(teacher, "remove", ticket.seat)
    mode(ann, "closed")
    press(teacher, "end")
    press(teacher, "end")
    teacher.wait(lambda: "Press again: end" in teacher.html)
    teacher.settle(SURE)
    assert bar(bob) == "free"
    press(teacher, "end")
    mode(bob, "closed")


def test_a_removed_student_reads_so_at_once_and_keeps_the_work(room: Class) -> None:
    teacher, student, ticket, q = lead(room)
    room.hub.rooms.remove_seat(ticket.room, ticket.seat)  # as another process does
    mode(student, "closed")
    bar_html = student.html[student.html.index('data-class-bar="closed"') :]
    assert "<b>The teacher has removed you.</b> What you have done stays on this page" in bar_html
    student.wait(lambda: "You can go on by yourself" in student.html)
    assert 'href="../room" data-class-join' in bar_html
    assert "data-class-here>Copy link" in bar_html
    student.wait(lambda: 'data-status="advice"' in student.html)
    teacher.set("2 rotating elbow", 70.0)
    teacher.settle()
    at(student, q)
    student.set("1 rotating base", 80.0)
    q[0] = np.radians(80.0)
    at(student, q)


@pytest.mark.full
def test_where_a_token_is_needed_who_was_removed_can_only_look(tmp_path: Path) -> None:
    hub = Hub(tmp_path)
    settings = Settings(data=tmp_path, token=SecretStr("a-long-enough-token"))
    viewer = ViewerServer(Store(), settings, Clouds(), classroom=hub)
    with serve_viewer(viewer) as port:
        guarded = Class(port, hub)
        student, ticket = guarded.join("Ann")
        student.set("1 rotating base", 55.0)
        q = ROBOT.q_home.copy()
        q[0] = np.radians(55.0)
        at(student, q)
        hub.rooms.end(ticket.room)
        mode(student, "closed")
        student.wait(lambda: "The room has ended." in student.html)
        assert "go on by yourself" not in student.html
        student.set("1 rotating base", 80.0)
        student.wait(lambda: "Join a room to go on" in student.html)
        student.wait(lambda: student.value("1 rotating base") == 55.0)
        at(student, q)
        guarded.close()
    hub.close()


@pytest.mark.parametrize("embedded", ["scene", "panel"])
def test_a_figure_in_another_page_takes_no_part(room: Class, embedded: str) -> None:
    teacher, _, ticket, q = lead(room)
    press(teacher, "freeze")
    figure = room.browser(room.hub.rooms.tokens.sign(ticket), embedded=embedded)
    figure.wait(lambda: "data-status" in figure.html)
    figure.set("1 rotating base", 80.0)
    own = ROBOT.q_home.copy()
    own[0] = np.radians(80.0)
    at(figure, own)
    assert "data-class" not in figure.html
    attendance = room.hub.attend(Ticket(ticket.room), lambda: None)
    figure.settle(0.5)
    (seat,) = attendance.room.seats
    attendance.leave()
    shown = decoded(seat.page, [ROBOT])
    assert np.allclose(shown.q, q), "the figure's arm is not the student's on the wall"


def test_who_watches_an_arm_that_moves_for_long_is_there(room: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fake_browser.ANSWER_WITHIN", 0.1)
    ann, ticket = room.join("Ann")
    (place,) = [each for each in room.hub.lives[ticket.room].places if each.ticket.seat == ticket.seat]
    turned = [1.0, *ROBOT.q_home[1:]]
    segments = "".join(f"[[segments]]\nkind = 'ptp'\nq = {list(map(float, q))}\n" for q in (ROBOT.q_home, turned))
    for serial, (name, value) in enumerate([("upload", ["turn.toml", segments]), ("loop", True), ("play", None)]):
        ann.say("feature", ["program", [name, serial], value])
    ann.wait(lambda: 'data-playing="1"' in ann.html)
    end, longest = time.monotonic() + 1.5, 0.0
    while time.monotonic() < end:
        ann.read(0.1)
        longest = max(longest, place.silence())
    assert 'data-playing="1"' in ann.html
    assert longest < 1.0, "no beat has come, and the pictures were answered"


def test_who_has_never_come_is_removed_together(room: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.classroom.live.AWAY", 0.2)
    monkeypatch.setattr("app.classroom.rooms.UNSEEN", 0.2)
    for i in range(3):
        room.hub.rooms.join(room.room.code, f"Ghost {i}")
    teacher = room.teacher()
    ann, _ = room.join("Ann")
    teacher.wait(lambda: "Remove 3 who are not here yet" in teacher.html)
    assert teacher.html.count("not here yet") == 3 + 2, "in the list, the chip and the button"
    press(teacher, "sweep")
    teacher.wait(lambda: "Press again: remove 3" in teacher.html)
    teacher.settle(SURE)
    press(teacher, "sweep")
    teacher.wait(lambda: "Ghost" not in teacher.html)
    assert "3 students removed" in teacher.html
    assert "Everybody else has come." in teacher.html
    assert bar(ann) == "free"


def test_who_stays_when_nobody_is_removed_is_said(room: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.classroom.live.AWAY", 0.2)
    for i in range(3):
        room.hub.rooms.join(room.room.code, f"Ghost {i}")
    teacher = room.teacher()
    teacher.wait(lambda: "Remove 3 who are not here yet" in teacher.html)
    press(teacher, "sweep")
    teacher.wait(lambda: "Press again: remove 3" in teacher.html)
    teacher.settle(SURE)
    press(teacher, "sweep")
    teacher.wait(lambda: "Nobody is removed" in teacher.html)
    assert "Stay: Ghost 0, Ghost 1, Ghost 2: joined less than a minute ago; press again later." in teacher.html


@pytest.mark.full
def test_a_double_click_is_one(room: Class) -> None:
    teacher = room.teacher()
    ann, _ = room.join("Ann")
    teacher.wait(lambda: 'data-guide-do="pick"' in teacher.html)

    def twice(browser: FakeBrowser, kind: str) -> None:
        """Two clicks on a button before it has changed."""
        button = browser.html.partition(f'data-guide-do="{kind}"')[2].partition(">")[0]
        value = int(button.partition('data-argument="')[2].partition('"')[0])
        for _ in range(2):
            press(browser, kind, value=value)

    for browser, kind, sign in (
        *((teacher, "follow", "You lead"), (teacher, "freeze", "Frozen"), (ann, "hand", "Lower hand")),
        (teacher, "wall", "data-class-wall"),
    ):
        twice(browser, kind)
        browser.settle(0.5)
        browser.wait(lambda browser=browser, sign=sign: sign in browser.html)
        twice(browser, kind)
        browser.settle(0.5)
        browser.wait(lambda browser=browser, sign=sign: sign not in browser.html)


def test_a_student_cannot_press_what_is_the_teachers(room: Class) -> None:
    teacher, student, ticket, _ = lead(room)
    for key in (("follow",), ("freeze",), ("end",), ("remove", ticket.seat)):
        press(student, *key)
        press(student, *key)
    student.wait(lambda: "Invalid input" in student.html)
    teacher.wait(lambda: 'data-class-lead="on"' in teacher.html)
    mode(student, "led")


def test_a_student_comes_back_to_the_seat(room: Class) -> None:
    teacher, student, ticket, q = lead(room)
    student.close()
    again = room.student(ticket)
    at(again, q)
    assert "you are Ann" in again.html
    teacher.settle()
    assert teacher.html.count('data-guide-do="pick"') == 1


def test_a_database_that_does_not_answer_holds_up_no_page_outside_of_the_room(room, monkeypatch):
    attend, waits, answers = room.hub.attend, threading.Semaphore(0), threading.Event()

    def slow(*arguments: Any) -> Any:
        waits.release()
        answers.wait(40)
        return attend(*arguments)

    monkeypatch.setattr(room.hub, "attend", slow)
    seats = [room.hub.rooms.join(room.room.code, f"S{k}") for k in range(BUILDS)]
    students = [
        threading.Thread(target=lambda seat=seat: room.browser(room.hub.rooms.tokens.sign(seat))) for seat in seats
    ]
    for student in students:
        student.start()
    try:
        for _ in students:
            assert waits.acquire(timeout=10), "all of them wait for the database"
        room.browser("")  # returns when there is a page
        assert not answers.is_set()
    finally:
        answers.set()
        for student in students:
            student.join(20)
    for browser in room._open[:BUILDS]:
        browser.wait(lambda browser=browser: "data-class-bar" in browser.html)
