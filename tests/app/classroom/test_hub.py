"""Rooms with several processes' hubs on one database file."""

from __future__ import annotations

import pkgutil
import sqlite3
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import event, func, select, update
from stored_bytes import stored_bytes

from app.classroom import (
    Attendance,
    ClassroomUnavailable,
    Hub,
    NewAttempt,
    RefusedError,
    Ticket,
    UnknownRoomError,
    clock,
    rooms,
)
from app.classroom.hub import RETRY_ROOM, UNSTORED
from app.classroom.live import Pending
from app.classroom.standing import standing
from app.classroom.tables import REVISION, Attempt, Base, Room, Seat
from app.classroom.ticks import store
from app.classroom.tokens import Tokens
from app.cli.parser import main

ROOT = Path(__file__).parents[3]

SOON = 10.0  # seconds: far more than anything takes


def until(condition, seconds=SOON):
    """Wait until a condition holds."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "the condition was not met in time"
        time.sleep(0.005)


@pytest.fixture
def hubs(tmp_path):
    """Two hubs on one file, as two processes have them."""
    pair = Hub(tmp_path / "data"), Hub(tmp_path / "data")
    yield pair
    for hub in pair:
        hub.close()


def attempt(**values):
    return NewAttempt(
        **{
            "exercise": "swing",
            "seed": 1,
            "answer": [1],
            "verdict": "right",
            "score": 1.0,
            "started": 0.0,
            **values,
        }
    )


def nothing():
    """A page that does not react."""


def test_what_a_teacher_does_reaches_students_of_another_process(hubs):
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    seat = there.rooms.join(room.code, "Ada")
    teacher = here.attend(here.ticket(room.token), nothing)
    student = there.attend(seat, nothing)
    teacher.tell_page("before")
    teacher.set_follow(True)
    until(lambda: student.room.page == "before")
    teacher.tell_page("after")
    until(lambda: student.room.page == "after")
    teacher.set_frozen(True)
    until(lambda: student.room.frozen)
    teacher.send_task("swing")
    until(lambda: student.room.task is not None)
    assert not student.room.frozen
    assert not student.room.follow
    teacher.send_course('{"title": "Week 1"}')
    until(lambda: student.room.course)
    assert student.room.task is None
    teacher.send_task("swing")
    until(lambda: student.room.task is not None)
    assert student.room.course, "a task leaves the course"
    teacher.set_follow(True)
    student.raise_hand(True)
    student.tell_page("mine")
    teacher.show_seat(seat.seat, named=False)
    until(lambda: student.room.shown is not None and student.room.shown.page == "mine")
    until(lambda: teacher.room.seats and teacher.room.seats[0].hand > 0)
    assert student.room.shown.alias == ""
    assert student.room.seats == ()
    student.leave()
    assert not student.room.closed


def test_a_page_is_notified_only_of_what_it_can_see(hubs, monkeypatch):
    """Thirty students who move must not wake each other's pages."""
    monkeypatch.setattr("app.classroom.hub.BEAT", 0.1)
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    heard = dict.fromkeys(("teacher", "mover", "near", "far"), 0)

    def page(hub, ticket, name):
        def changed():
            heard[name] += 1

        return hub.attend(ticket, changed)

    seats = [here.rooms.join(room.code, name) for name in ("Ada", "Emmy", "Alan")]
    teacher = page(here, here.ticket(room.token), "teacher")
    mover, near = page(here, seats[0], "mover"), page(here, seats[1], "near")
    far = page(there, seats[2], "far")
    until(lambda: all(each.room.students == 3 for each in (teacher, mover, near, far)))
    time.sleep(0.3)  # beats of all of them
    before = dict(heard)
    for move in ("one", "two"):
        mover.tell_page(move)
        until(lambda move=move: teacher.room.seats[0].page == move)
        until(lambda move=move: there._lives[room.id].seats[seats[0].seat].row["page"] == move)
    assert heard["teacher"] >= before["teacher"] + 2
    assert (heard["near"], heard["far"]) == (before["near"], before["far"])
    teacher.show_seat(seats[0].seat)
    mover.tell_page("three")
    until(lambda: all(each.room.shown and each.room.shown.page == "three" for each in (near, far)))
    assert heard["near"] > before["near"] < heard["far"] > before["far"]


def test_late_joiners_get_the_present_state(hubs):
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    teacher = here.attend(here.ticket(room.token), nothing)
    teacher.tell_page("now")
    teacher.set_follow(True)
    teacher.open_poll("Elbow?", ["up", "down"])
    until(lambda: there.rooms.find(Ticket(room.id)) is not None)
    until(lambda: there.attend(there.rooms.join(room.code, "Late"), nothing).room.page == "now")
    late = there.attend(there.rooms.join(room.code, "Later"), nothing)
    assert late.room.follow
    assert late.room.poll.choices == ("up", "down")


def test_two_tabs_are_one_seat(hubs):
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    seat = here.rooms.join(room.code, "Ada")
    tabs = [hub.attend(seat, nothing) for hub in (here, here, there)]
    tabs[0].raise_hand(True)
    until(lambda: all(tab.room.seat.hand > 0 for tab in tabs))
    tabs[2].raise_hand(False)
    until(lambda: all(tab.room.seat.hand == 0 for tab in tabs))
    tabs[0].leave()
    tabs[1].tell_page("second")
    until(lambda: tabs[2].room.seat.page == "second")
    assert tabs[2].room.students == 1


def test_votes_are_counted_once_and_nobody_sees_whose(hubs):
    here, _ = hubs
    room = here.rooms.open("Kinematics", 3600)
    teacher = here.attend(here.ticket(room.token), nothing)
    students = [hub.attend(hub.rooms.join(room.code, name), nothing) for hub, name in zip(hubs, "AB", strict=True)]
    with pytest.raises(RefusedError, match="closed"):
        students[0].vote(0)
    teacher.open_poll("Elbow?", ["up", "down"])
    until(lambda: all(student.room.poll for student in students))
    for choice in (0, 1, 1):
        students[0].vote(choice)
        students[1].vote(choice)
    until(lambda: teacher.room.poll.votes == (0, 2))
    assert students[0].room.poll.chosen == 1
    assert not any("vot" in name for seat in teacher.room.seats for name in vars(seat))
    with pytest.raises(RefusedError, match="no such choice"):
        students[0].vote(2)
    teacher.close_poll()
    until(lambda: not students[1].room.poll.open)
    with pytest.raises(RefusedError, match="closed"):
        students[1].vote(0)
    assert students[1].room.poll.votes == (0, 2)


TEACHERS = {
    "set_follow": (True,),
    "set_frozen": (True,),
    "send_task": ("swing",),
    "send_course": ("c",),
    "show_seat": ("x",),
    "lower_hand": ("x",),
    "open_poll": ("q", ["a", "b"]),
    "close_poll": (),
    "remove_poll": (),
    "remove_seat": ("x",),
    "remove_unseen": (),
    "rename_seat": ("x", "y"),
    "end_room": (),
    "teacher_token": (),
}
STUDENTS = {
    "secret": (),
    "raise_hand": (True,),
    "vote": (0,),
    "tell_task": ("swing",),
    "tell_gone": (True,),
    "tell_driven": ("SO-101",),
    "submit": (attempt(),),
}
BOTH = {"room", "leave", "tell_page", "ticket", "changed"}


def test_a_seat_has_no_power_of_the_teacher_and_the_reverse(hubs):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
    before = teacher.room
    for page, methods in ((student, TEACHERS), (teacher, STUDENTS)):
        for name, arguments in methods.items():
            with pytest.raises(PermissionError):
                getattr(page, name)(*arguments)
    assert teacher.room == before
    public = {name for name in dir(Attendance) if not name.startswith("_")}
    assert public - BOTH == {*TEACHERS, *STUDENTS} - BOTH  # a new method needs its row
    student.tell_page("not the teacher's")
    until(lambda: teacher.room.seats and teacher.room.seats[0].page == "not the teacher's")
    assert teacher.room.page == ""


def test_a_teacher_has_no_power_over_another_room(hubs):
    hub, _ = hubs
    mine, other = hub.rooms.open("Mine", 3600), hub.rooms.open("Other", 3600)
    theirs = hub.rooms.join(other.code, "Ada")
    student = hub.attend(theirs, nothing)
    assert student.submit(attempt()).at > 0
    teacher = hub.attend(hub.ticket(mine.token), nothing)
    teacher.remove_seat(theirs.seat)
    teacher.rename_seat(theirs.seat, "Bob")
    teacher.show_seat(theirs.seat)
    teacher.lower_hand(theirs.seat)
    assert teacher.room.shown is None
    hub.refresh(other.id)
    assert student.room.seat.alias == "Ada"
    foreign = Ticket(mine.id, theirs.seat)  # no token says so
    assert hub.attend(foreign, nothing).room.closed
    with pytest.raises(RefusedError):
        hub.rooms.submit(foreign, attempt())
    with hub.database.read() as connection:
        assert connection.scalar(select(func.count()).select_from(Attempt)) == 1


def test_forged_tokens_open_nothing(hubs):
    hub, other = hubs
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ada")
    token = hub.rooms.tokens.sign(seat)
    assert other.ticket(token) == seat
    teacher = Tokens("another key").sign(Ticket(room.id))
    course = hub.rooms.tokens.serializer("course").dumps([room.id, ""])
    for forged in (teacher, course, token[:-2], token.replace(".", "x."), "x" * 1000, "é.è", ".", ""):
        assert hub.ticket(forged) is None


def test_a_removed_seat_is_erased_and_closed(hubs):
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    teacher = here.attend(here.ticket(room.token), nothing)
    seat = there.rooms.join(room.code, "Unsuitable")
    student = there.attend(seat, nothing)
    student.submit(attempt())
    student.tell_page("mine")
    until(lambda: teacher.room.seats and teacher.room.seats[0].page == "mine")
    teacher.rename_seat(seat.seat, "Fine")
    until(lambda: student.room.seat.alias == "Fine")
    teacher.remove_seat(seat.seat)
    until(lambda: student.room.closed)
    student.tell_page("again")
    student.raise_hand(True)
    with pytest.raises(RefusedError):
        student.submit(attempt())
    time.sleep(0.3)  # longer than what students report may wait
    assert teacher.room.seats == ()
    with here.database.read() as connection:
        row = connection.execute(select(Seat.alias, Seat.page, Seat.hand)).one()
        assert tuple(row) == ("", "", 0.0)
        assert connection.scalar(select(func.count()).select_from(Attempt)) == 0


def test_ending_erases_everything_for_all(hubs, tmp_path):
    here, there = hubs
    room = here.rooms.open("Secret title", 3600)
    teacher = here.attend(here.ticket(room.token), nothing)
    student = there.attend(there.rooms.join(room.code, "Secret alias"), nothing)
    student.tell_page("Secret page")
    student.submit(attempt(verdict="Secret verdict"))
    until(lambda: teacher.room.seats and teacher.room.seats[0].page == "Secret page")
    teacher.end_room()
    assert "ended" in teacher.room.closed
    until(lambda: student.room.closed)
    with pytest.raises(RefusedError):
        student.submit(attempt())
    until(lambda: b"Secret" not in stored_bytes(tmp_path / "data"))


def test_time_ends_a_room_and_a_new_clock_does_not(hubs, monkeypatch):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    monkeypatch.setattr(time, "time", lambda: 9e9)
    hub.refresh(room.id)
    assert hub.rooms.sweep() == 0
    assert not teacher.room.closed
    with hub.database.write() as connection:
        connection.execute(update(Room).values(ends=clock.now() - 1))
    until(lambda: teacher.room.closed)
    assert hub.rooms.find(Ticket(room.id)) is None
    with pytest.raises(UnknownRoomError):
        hub.rooms.join(room.code, "Ada")
    assert hub.rooms.sweep() == 1
    assert hub.rooms.all() == []


def test_who_is_away_is_seen_in_other_processes(hubs, monkeypatch):
    monkeypatch.setattr("app.classroom.live.AWAY", 0.5)
    monkeypatch.setattr("app.classroom.hub.BEAT", 0.1)
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    teacher = here.attend(here.ticket(room.token), nothing)
    seat = there.rooms.join(room.code, "Ada")
    student = there.attend(seat, nothing)
    until(lambda: not student.room.teacher_away and teacher.room.seats and not teacher.room.seats[0].away)
    teacher.leave()
    until(lambda: student.room.teacher_away)
    assert not student.room.closed
    teacher = here.attend(here.ticket(room.token), nothing)
    until(lambda: not student.room.teacher_away)
    student.leave()
    until(lambda: teacher.room.seats and teacher.room.seats[0].away)
    there.attend(seat, nothing)
    until(lambda: not teacher.room.seats[0].away)


def test_a_locked_database_delays_and_loses_nothing(hubs, tmp_path, monkeypatch):
    monkeypatch.setattr("app.classroom.database.WAIT", 0.2)
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    teacher = here.attend(here.ticket(room.token), nothing)
    student = here.attend(here.rooms.join(room.code, "Ada"), nothing)
    far = there.attend(there.rooms.join(room.code, "Bob"), nothing)
    teacher.set_follow(True)
    until(lambda: far.room.follow)
    first = student.submit(attempt())
    lock = sqlite3.connect(tmp_path / "data" / "classroom.db", isolation_level=None)
    lock.execute("BEGIN EXCLUSIVE")
    new = attempt(exercise="other")
    with pytest.raises(ClassroomUnavailable, match="has locked"):
        student.submit(new)
    teacher.tell_page("while locked")
    assert student.room.page == "while locked"  # in this process at once
    until(lambda: "has locked" in student.room.problem)
    assert far.room.page == ""
    lock.execute("ROLLBACK")
    lock.close()
    until(lambda: not student.room.problem)
    until(lambda: far.room.page == "while locked")
    second = student.submit(new)
    assert student.submit(new) == second  # again after an unclear end: stored once
    with here.database.read() as connection:
        assert sorted(connection.scalars(select(Attempt.id))) == sorted([first.id, second.id])


@pytest.fixture
def broken(monkeypatch):
    """The rooms that cannot be stored, and the rooms whose storing was tried."""
    rooms, tried = set(), []

    def store_or_fail(connection, room, *news):
        tried.append(room)
        if room in rooms:
            raise ZeroDivisionError("no error of the database")
        return store(connection, room, *news)

    monkeypatch.setattr("app.classroom.ticks.store", store_or_fail)
    return rooms, tried


def stored(hub, page):
    with hub.database.read() as connection:
        return connection.scalar(select(Room.state).where(Room.id == page.ticket.room)) or {}


def test_any_error_while_a_room_is_stored_loses_nothing_and_holds_up_no_other_room(
    hubs, broken, monkeypatch, caplog
):
    hub, _ = hubs
    rooms, tried = broken
    now = [clock.steady()]
    monkeypatch.setattr("app.classroom.hub.steady", lambda: now[0])
    bad, well = (hub.attend(hub.ticket(hub.rooms.open(title, 3600).token), nothing) for title in ("Bad", "Well"))
    rooms.add(bad.ticket.room)
    bad.set_frozen(True)
    well.set_frozen(True)
    until(lambda: stored(hub, well).get("frozen"))
    until(lambda: bad.room.problem == UNSTORED)
    assert not stored(hub, bad)
    assert bad.room.frozen, "in this process at once"
    assert "could not be stored" in caplog.text
    count = tried.count(bad.ticket.room)
    bad.set_frozen(False)  # newer than what could not be stored
    bad.show_seat("Ann")
    well.set_frozen(False)
    until(lambda: not stored(hub, well)["frozen"])
    well.set_frozen(True)
    until(lambda: stored(hub, well)["frozen"])
    assert tried.count(bad.ticket.room) == count, "not in each tick"
    assert (bad.room.problem, well.room.problem) == (UNSTORED, "")
    rooms.clear()
    now[0] += RETRY_ROOM
    until(lambda: stored(hub, bad))
    assert stored(hub, bad) == {"frozen": False, "shown": {"seat": "Ann", "named": True}}
    until(lambda: not bad.room.problem)


def test_what_could_not_be_stored_is_tried_again_when_the_service_stops(hubs, broken, monkeypatch):
    hub, other = hubs
    rooms, _ = broken
    monkeypatch.setattr("app.classroom.hub.RETRY_ROOM", 1e9)
    page = hub.attend(hub.ticket(hub.rooms.open("Kinematics", 3600).token), nothing)
    rooms.add(page.ticket.room)
    page.set_frozen(True)
    until(lambda: page.room.problem)
    rooms.clear()
    hub.close()
    assert stored(other, page)["frozen"]


@pytest.mark.full
def test_a_class_that_joins_at_once_waits_for_its_turn(hubs, monkeypatch):
    """Sixty transactions take longer together than anybody waits for a lock, and no student is turned away."""
    monkeypatch.setattr("app.classroom.database.WAIT", 0.3)
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    count = rooms.next_version

    def slow(connection, room):
        time.sleep(0.02)  # as on a busy machine
        return count(connection, room)

    monkeypatch.setattr(rooms, "next_version", slow)
    with ThreadPoolExecutor(60) as pool:
        joined = list(pool.map(lambda k: (here, there)[k % 2].rooms.join(room.code, f"Student {k}"), range(60)))
    assert len({ticket.seat for ticket in joined}) == 60
    assert here.rooms.find(joined[0]).students == 60


def test_who_does_not_get_a_turn_reads_so(hubs, monkeypatch):
    monkeypatch.setattr("app.classroom.database.WAIT", 0.1)
    here, _ = hubs
    seat = here.rooms.join(here.rooms.open("Kinematics", 3600).code, "Ada")
    with ThreadPoolExecutor(1) as pool, here.database.write():
        other = pool.submit(here.rooms.submit, seat, attempt())
        with pytest.raises(ClassroomUnavailable, match="too much to do"):
            other.result(10)
    here.rooms.submit(seat, attempt())


def test_a_full_database_is_said_and_keeps_what_was_confirmed(hubs):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
    first = student.submit(attempt())

    def limit(connection, pages):
        connection.execute(f"PRAGMA max_page_count={pages}")

    def fill(connection, _record, _proxy):
        limit(connection, 1)  # SQLite takes the present size: not one page more

    event.listen(hub.database._ready(), "checkout", fill)
    with pytest.raises(ClassroomUnavailable, match="full"):
        student.submit(attempt(answer="x" * 19_000))
    event.remove(hub.database._ready(), "checkout", fill)
    with hub.database.read() as connection:
        assert connection.scalars(select(Attempt.id)).all() == [first.id]
    event.listen(hub.database._ready(), "checkout", lambda connection, *_: limit(connection, 1_000_000))
    assert student.submit(attempt(answer="x" * 19_000)).at > 0


def test_a_database_that_is_gone_comes_back(hubs, tmp_path):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
    first = student.submit(attempt())
    (tmp_path / "data").rename(tmp_path / "away")
    with pytest.raises(ClassroomUnavailable):
        student.submit(attempt())
    until(lambda: student.room.problem)
    assert not student.room.closed
    student.raise_hand(True)
    assert not (tmp_path / "data").exists()  # no empty database in its place
    (tmp_path / "away").rename(tmp_path / "data")
    until(lambda: not student.room.problem)
    second = student.submit(attempt())
    with hub.database.read() as connection:
        assert set(connection.scalars(select(Attempt.id))) == {first.id, second.id}
    until(lambda: hub.rooms.find(student.ticket) is not None and student.room.seat.hand > 0)


def test_a_page_can_come_while_the_database_is_away(hubs, tmp_path, monkeypatch):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ada")
    (tmp_path / "data").rename(tmp_path / "away")
    calls = []
    student = hub.attend(seat, lambda: calls.append(student.room.seat is not None))
    assert student.room.problem
    student.raise_hand(True)
    (tmp_path / "away").rename(tmp_path / "data")
    until(lambda: student.room.seat is not None)
    until(lambda: True in calls)


def test_the_thread_ends_when_all_have_left(hubs, monkeypatch):
    monkeypatch.setattr("app.classroom.hub.LINGER", 0.1)
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    assert threads() == 0
    pages = [hub.attend(hub.ticket(room.token), nothing) for _ in range(3)]
    assert threads() == 1
    pages[0].set_frozen(True)
    for page in pages:
        page.leave()
        page.leave()
    until(lambda: threads() == 0)
    again = hub.attend(hub.ticket(room.token), nothing)
    assert again.room.frozen
    assert threads() == 1


def threads():
    return sum(thread.name == "kinboard-classroom" for thread in threading.enumerate())


def test_a_page_that_fails_stops_no_other(hubs, caplog):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)

    def fail():
        raise RuntimeError("this page is broken")

    teacher = hub.attend(hub.ticket(room.token), fail)
    seen = []
    hub.attend(hub.rooms.join(room.code, "Ada"), lambda: seen.append(1))
    teacher.set_frozen(True)
    until(lambda: seen)
    assert "could not be notified" in caplog.text


@pytest.mark.full
def test_the_start_imports_no_database():
    late = {"sqlalchemy", "alembic", "segno", "jinja2"}  # a service without classrooms does not wait for them
    code = f"import sys, app.service.main; print({late} & set(sys.modules) or 'none')"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert out.stdout.strip() == "none"


def test_migrations_make_the_tables_of_the_models(hubs):
    hub, _ = hubs
    hub.rooms.open("Kinematics", 3600)
    with hub.database.read() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []
        assert context.get_current_revision() == REVISION


def test_processes_that_start_at_the_same_time_migrate_once(tmp_path):
    hubs = [Hub(tmp_path / "data") for _ in range(6)]
    with ThreadPoolExecutor(6) as pool:
        codes = {room.code for room in pool.map(lambda hub: hub.rooms.open("Kinematics", 3600), hubs)}
    assert len(codes) == 6
    assert len({hub.rooms.tokens.sign(Ticket("x")) for hub in hubs}) == 1
    for hub in hubs:
        hub.close()


def test_a_missing_driver_is_said(tmp_path, monkeypatch, caplog):
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(ClassroomUnavailable, match="cannot be reached"):
        Hub(tmp_path, "postgresql://nobody@127.0.0.1:9/none").rooms.open("Kinematics", 3600)
    assert "kinboard[postgres]" in caplog.text


def test_a_server_that_is_not_there_is_said_and_its_password_is_not_logged(tmp_path, caplog):
    with pytest.raises(ClassroomUnavailable, match="cannot be reached"):
        Hub(tmp_path, "postgresql://nobody:top-secret@127.0.0.1:9/none").rooms.open("Kinematics", 3600)
    assert "database failed" in caplog.text
    assert "top-secret" not in caplog.text


@pytest.mark.parametrize("url", ["mysql://x/y", "sqlite:///x", "db.example"])
def test_other_databases_are_refused_and_not_shown(url, monkeypatch, capsys):
    monkeypatch.setenv("KINBOARD_DATABASE_URL", url)
    assert main(["serve"]) == 2
    printed = capsys.readouterr().err
    assert "KINBOARD_DATABASE_URL" in printed
    assert "postgresql://" in printed
    assert url not in printed


@pytest.mark.parametrize("of_another", [False, True])
def test_what_was_answered_stays_when_the_student_goes_on_or_raises_a_hand(hubs, of_another):
    hub, other = hubs
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ada")
    student, teacher = hub.attend(seat, nothing), hub.attend(hub.ticket(room.token), nothing)
    first = attempt()
    student.tell_task(first.exercise)
    teacher.send_task(first.exercise)
    if of_another:
        other.rooms.submit(seat, first)
    else:
        student.submit(first)

    def found():
        return standing(teacher.room.seats[0], teacher.room)

    until(lambda: found().progress == "solved")
    student.raise_hand(True)
    student.tell_task("another")
    until(lambda: found().hand and found().elsewhere and not hub._lives[seat.room].pending)
    assert (found().progress, found().work.tries) == ("solved", 1)
    hub.rooms.submit(seat, replace(first, id="f" * 16, exercise="another", score=0.0))
    until(lambda: "another" in teacher.room.seats[0].work)
    assert found().progress == "solved"
    late = other.attend(hub.ticket(room.token), nothing)
    assert late.room.seats[0].work == teacher.room.seats[0].work
    teacher.remove_seat(seat.seat)
    again = other.attend(hub.ticket(room.token), nothing)
    until(lambda: again.room.seats == ())
    assert other._lives[seat.room].seats[seat.seat].row["work"] == {}


def test_what_is_on_its_way_is_not_undone_by_what_is_read_meanwhile(hubs, monkeypatch):
    """An answer is stored, and read, between the moment a task is taken to be written and the writing."""
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ada")
    student, teacher = hub.attend(seat, nothing), hub.attend(hub.ticket(room.token), nothing)
    write, answered = hub.database.write, []

    def late(**options):
        if not options.get("durable", True) and hub._lives[room.id].flying.state and not answered:
            answered.append(student.submit(attempt()))
        return write(**options)

    monkeypatch.setattr(hub.database, "write", late)
    teacher.send_task("swing")
    until(lambda: answered and not hub._lives[room.id].flying and not hub._lives[room.id].pending)
    time.sleep(0.2)
    assert teacher.room.task is not None
    assert teacher.room.seats[0].work
    with hub.database.read() as connection:
        assert connection.scalar(select(Room.state))["task"]["exercise"] == "swing"


def test_no_two_students_have_the_same_alias(hubs):
    hub, other = hubs
    room = hub.rooms.open("Kinematics", 3600)

    def alias(ticket):
        return other.rooms.find(ticket).alias

    bob, second, third = (each.rooms.join(room.code, "Bob") for each in (hub, other, hub))
    assert [alias(each) for each in (bob, second, third)] == ["Bob", "Bob 2", "Bob 3"]
    assert alias(hub.rooms.join(room.code, "  bOB ")) == "bOB 4"
    assert alias(hub.rooms.join(room.code, "Ｂob 2")) == "Ｂob 2 2", "letters of another width look the same"
    long = "x" * 32
    assert [alias(hub.rooms.join(room.code, long)) for _ in range(2)] == [long, "x" * 30 + " 2"]
    ann = hub.rooms.join(room.code, "Ann")
    assert hub.rooms.rename_seat(room.id, ann.seat, "Bob") == "Bob 5" == alias(ann)
    assert hub.rooms.rename_seat(room.id, ann.seat, "bob 5") == "bob 5", "it is the student's own"
    assert hub.rooms.join(room.code, "Bob", known=bob) == bob
    assert alias(bob) == "Bob"
    hub.rooms.remove_seat(room.id, second.seat)
    assert alias(hub.rooms.join(room.code, "Bob 2")) == "Bob 2"


@pytest.mark.parametrize("alias", ["\u0301", " \u0301\u20dd ", "\u200d\u0301"])
def test_an_alias_of_marks_alone_is_refused(hubs, alias):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    with pytest.raises(RefusedError, match="marks alone") as refused:
        hub.rooms.join(room.code, alias)
    assert refused.value.field == "alias"
    assert hub.rooms.find(hub.rooms.join(room.code, "e\u0301")).alias == "é"


@pytest.mark.full
@pytest.mark.parametrize("second", [False, True])
def test_a_page_that_is_connected_and_silent_is_away_within_ten_seconds(hubs, monkeypatch, second):
    """A phone in a dead spot: its connection stays, and nothing comes. Times are a quarter of the real ones."""
    for name in ("hub.BEAT", "hub.LOOK", "hub.SILENT", "live.AWAY", "live.SILENT_AWAY"):
        path = f"app.classroom.{name}"
        monkeypatch.setattr(path, pkgutil.resolve_name(path) / 4)
    hub, other = hubs
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ann")
    lost: list[float] = []
    hub.attend(seat, nothing, lambda: time.monotonic() - lost[0] if lost else 0.0)
    if second:
        other.attend(seat, nothing)
    teachers = [each.attend(hub.ticket(room.token), nothing) for each in hubs]
    time.sleep(2.5)
    assert [teacher.room.seats[0].away for teacher in teachers] == [False, False]
    lost.append(time.monotonic())
    if second:
        time.sleep(2.5)
        assert [teacher.room.seats[0].away for teacher in teachers] == [False, False], "the other tab is there"
        return
    until(lambda: all(teacher.room.seats[0].away for teacher in teachers))
    assert time.monotonic() - lost[0] < 10 / 4 + 1, "with a second for a busy machine"
    lost.clear()
    until(lambda: not any(teacher.room.seats[0].away for teacher in teachers))


def test_who_follows_is_known_to_the_teacher(hubs):
    hub, other = hubs
    room = hub.rooms.open("Kinematics", 3600)
    teacher = other.attend(hub.ticket(room.token), nothing)
    ann, bob = (hub.attend(hub.rooms.join(room.code, alias), nothing) for alias in ("Ann", "Bob"))
    teacher.set_follow(True)
    bob.tell_gone(True)

    def presences():
        return [standing(seat, teacher.room).presence for seat in teacher.room.seats]

    until(lambda: presences() == ["following", "by themselves"])
    bob.tell_gone(False)
    until(lambda: presences() == ["following", "following"])
    teacher.set_follow(False)
    assert presences() == ["by themselves", "by themselves"]
    assert ann.room.seats == ()


def test_storing_leaves_what_is_pending_as_it_is(hubs):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ada")
    opened = {"task": "swing", "hand": 0.0, "gone": False}
    pending = Pending(seats={seat.seat: dict(opened)})
    with hub.database.write() as connection:
        assert store(connection, seat.room, pending, set()) is not None
    assert {name: type(value) for name, value in pending.seats[seat.seat].items()} == {
        name: type(value) for name, value in opened.items()
    }


@pytest.mark.full
def test_attempts_are_bounded(hubs, monkeypatch):
    monkeypatch.setattr("app.classroom.rooms.MAX_ATTEMPTS", 2)
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
    with pytest.raises(RefusedError, match="longer than"):
        student.submit(attempt(answer="x" * 20_000))
    with pytest.raises(ValueError, match="score is 2"):
        student.submit(attempt(score=2))
    last = attempt()
    student.submit(attempt())
    confirmed = student.submit(last)
    with pytest.raises(RefusedError, match="no more"):
        student.submit(attempt())
    assert student.submit(last) == confirmed


def test_seats_and_pages_are_bounded(hubs, monkeypatch):
    monkeypatch.setattr("app.classroom.rooms.MAX_SEATS", 1)
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
    with pytest.raises(RefusedError, match="room is full"):
        hub.rooms.join(room.code, "Bob")
    with pytest.raises(ValueError, match="16001"):
        student.tell_page("x" * 16_001)


def test_seats_that_nobody_takes_keep_no_student_out(hubs, monkeypatch):
    """Somebody joins again and again without ever opening a page."""
    monkeypatch.setattr("app.classroom.rooms.MAX_SEATS", 4)
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    ada = hub.rooms.join(room.code, "Ada")
    page = hub.attend(ada, nothing)
    until(lambda: beats(hub, ada) > 0)
    page.leave()
    eve = hub.rooms.join(room.code, "Eve")  # has answered: her page was there
    hub.rooms.submit(eve, attempt())
    ghosts = [hub.rooms.join(room.code, f"Ghost {i}") for i in range(2)]
    with pytest.raises(RefusedError, match="room is full"):
        hub.rooms.join(room.code, "Bob")
    monkeypatch.setattr("app.classroom.rooms.UNSEEN", 0.0)
    bob = hub.rooms.join(room.code, "Bob")
    assert [hub.rooms.is_open(seat) for seat in (ada, eve, *ghosts, bob)] == [True, True, False, False, True]
    monkeypatch.setattr("app.classroom.rooms.UNSEEN", 60.0)
    swept = hub.rooms.remove_unseen(room.id)
    assert swept.words == "Bob: joined less than a minute ago; press again later. Eve: answers are stored."
    monkeypatch.setattr("app.classroom.rooms.UNSEEN", 0.0)
    swept = hub.rooms.remove_unseen(room.id)
    assert (swept.count, swept.words) == (1, "Eve: answers are stored.")
    assert [hub.rooms.is_open(seat) for seat in (ada, eve, bob)] == [True, True, False]


def beats(hub, ticket):
    with hub.database.read() as connection:
        return connection.scalar(select(Seat.beat).where(Seat.id == ticket.seat))


@pytest.mark.parametrize("name", ["a b", "50%", "a?b#c", "ä", "a'b"])
def test_a_folder_may_have_any_name(tmp_path, name):
    hub = Hub(tmp_path / name)
    hub.rooms.open("Kinematics", 3600)
    hub.close()
    assert (tmp_path / name / "classroom.db").exists()
