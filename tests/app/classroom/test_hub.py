"""The rooms of a process on one database file: what is stored, when, and what other programs and faults change."""

from __future__ import annotations

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
from sqlalchemy import event, func, insert, select, update
from sqlalchemy.exc import DataError, OperationalError
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
from app.classroom.hub import UNSTORED
from app.classroom.standing import standing
from app.classroom.tables import REVISION, Attempt, Base, Room, Seat
from app.classroom.tokens import Tokens
from app.classroom.views import Recalled
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
def quick(monkeypatch):
    """Rooms whose threads look a hundred times a second."""
    for name in ("TICK", "LOOK", "RETRY"):
        monkeypatch.setattr(f"app.classroom.hub.{name}", 0.01)


@pytest.fixture
def hub(tmp_path, quick):
    made = Hub(tmp_path / "data")
    yield made
    made.close()


@pytest.fixture
def other(tmp_path, quick):
    """Another program on the same file, such as a command, or a process that starts later."""
    made = Hub(tmp_path / "data")
    yield made
    made.close()


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


def stored(hub, page):
    with hub.database.read() as connection:
        return connection.scalar(select(Room.state).where(Room.id == page.ticket.room)) or {}


def test_a_room_is_after_a_restart_as_it_was(hub, other):
    """Also for who comes late, and at once for pages that are there."""
    room = hub.rooms.open("Kinematics", 3600)
    heard: list[int] = []
    teacher = hub.attend(hub.ticket(room.token), lambda: heard.append(len(teacher.room.seats)))
    seat = hub.rooms.join(room.code, "Ada")
    assert heard[-1:] == [1], "notified at once"
    student = hub.attend(seat, nothing)
    teacher.tell_page("now")
    teacher.set_follow(True)
    teacher.open_poll("Elbow?", ["up", "down"])
    student.raise_hand(True)
    student.vote(1)
    student.tell_page("mine")
    answer = student.submit(attempt())
    assert teacher.room.seats[0].work["swing"].progress == "solved"
    assert student.submit(attempt(exercise="two", score=0.0)).at >= answer.at
    before = replace(teacher.room, problem="")
    hub.close()
    again = other.attend(other.ticket(room.token), nothing)
    assert again.room == replace(before, seats=(replace(before.seats[0], page="mine"),))
    assert again.room.poll.votes == (0, 1)
    late = other.attend(other.rooms.join(room.code, "Late"), nothing)
    assert (late.room.page, late.room.follow, late.room.poll.choices) == ("now", True, ("up", "down"))


def test_what_another_program_does_is_seen_soon_and_nothing_is_lost(hub, other):
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    ann = hub.attend(hub.rooms.join(room.code, "Ann"), nothing)
    bob = other.rooms.join(room.code, "Bob")
    other.rooms.rename_seat(room.id, ann.ticket.seat, "Anna")
    until(lambda: [seat.alias for seat in teacher.room.seats] == ["Anna", "Bob"])
    other.rooms.submit(bob, attempt())
    ann.raise_hand(True)
    until(lambda: teacher.room.seats[1].work)
    watching = other.attend(teacher.ticket, nothing)
    until(lambda: [seat.hand > 0 for seat in watching.room.seats] == [True, False])
    other.rooms.remove_seat(room.id, bob.seat)
    until(lambda: len(teacher.room.seats) == 1)
    other.rooms.end(room.id)
    until(lambda: ann.room.closed and teacher.room.closed)
    ann.raise_hand(False)
    with pytest.raises(RefusedError, match="has ended"):
        ann.submit(attempt())


def test_a_change_of_another_program_is_noticed_within_the_next_change(hub, other, monkeypatch):
    """Not only when the thread looks: two students with one alias, or two answers too many, would be stored."""
    monkeypatch.setattr("app.classroom.hub.LOOK", 1e9)
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    other.rooms.join(room.code, "Bob")
    assert [seat.alias for seat in teacher.room.seats] == []
    second = hub.rooms.join(room.code, "Bob")
    assert sorted(seat.alias for seat in teacher.room.seats) == ["Bob", "Bob 2"]
    assert other.rooms.find(second).alias == "Bob 2"


def test_a_change_that_is_not_stored_is_not_in_memory(hub, monkeypatch):
    """Also if the room was read anew for it: what others store then is still noticed."""
    monkeypatch.setattr("app.classroom.hub.LOOK", 1e9)
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    until(lambda: not hub.lives[room.id].unsaved)

    def fail_after(act):
        with hub.rooms.changing(room.id) as change:
            act(change)
            raise ZeroDivisionError

    def rename(title):
        with hub.database.write() as connection:
            connection.execute(update(Room).values(version=Room.version + 1, title=title))

    with pytest.raises(ZeroDivisionError):
        fail_after(lambda change: change.add("a" * 16, alias="Nobody"))
    assert teacher.room.seats == ()
    rename("Other")
    with pytest.raises(ZeroDivisionError):
        fail_after(lambda _: None)
    rename("Third")
    hub.rooms.join(room.code, "Ada")
    assert (teacher.room.title, teacher.room.students) == ("Third", 1)


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
}
STUDENTS = {
    "secret": (),
    "raise_hand": (True,),
    "vote": (0,),
    "tell_task": ("swing",),
    "tell_gone": (True,),
    "tell_driven": ("SO-101",),
    "tell_recalled": (Recalled(1, 1, 0, 0),),
    "submit": (attempt(),),
}
BOTH = {"room", "leave", "tell_page", "ticket", "changed"}


def test_a_seat_has_no_power_of_the_teacher_and_the_reverse(hub):
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


def test_a_teacher_has_no_power_over_another_room(hub):
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
    assert student.room.seat.alias == "Ada"
    foreign = Ticket(mine.id, theirs.seat)  # no token says so
    assert hub.attend(foreign, nothing).room.closed
    with pytest.raises(RefusedError):
        hub.rooms.submit(foreign, attempt())
    with hub.database.read() as connection:
        assert connection.scalar(select(func.count()).select_from(Attempt)) == 1


def test_forged_tokens_open_nothing(hub, other):
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ada")
    token = hub.rooms.tokens.sign(seat)
    assert other.ticket(token) == seat
    cookie = hub.rooms.tokens.cookie(seat, room.code)
    assert cookie.startswith(f"{room.code}.")
    assert other.ticket(cookie) == other.ticket(f"ACDEFGHJ.{token}") == seat, "the code is for proxies alone"
    teacher = Tokens("another key").sign(Ticket(room.id))
    course = hub.rooms.tokens.serializer("course").dumps([room.id, ""])
    for forged in (teacher, course, token[:-2], token.replace(".", "x."), "x" * 1000, "é.è", ".", ""):
        assert hub.ticket(forged) is None


def test_a_removed_seat_is_erased_and_closed(hub):
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    seat = hub.rooms.join(room.code, "Unsuitable")
    student = hub.attend(seat, nothing)
    student.submit(attempt())
    student.tell_page("mine")
    until(lambda: teacher.room.seats[0].page == "mine")
    teacher.rename_seat(seat.seat, "Fine")
    assert student.room.seat.alias == "Fine"
    teacher.remove_seat(seat.seat)
    assert student.room.closed
    student.tell_page("again")
    student.raise_hand(True)
    with pytest.raises(RefusedError):
        student.submit(attempt())
    hub.lives[room.id].take_arms()
    assert teacher.room.seats == ()
    with hub.database.read() as connection:
        row = connection.execute(select(Seat.alias, Seat.page, Seat.hand)).one()
        assert tuple(row) == ("", "", 0.0)
        assert connection.scalar(select(func.count()).select_from(Attempt)) == 0


def test_ending_erases_everything_for_all(hub, tmp_path):
    room = hub.rooms.open("Secret title", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    student = hub.attend(hub.rooms.join(room.code, "Secret alias"), nothing)
    student.tell_page("Secret page")
    student.submit(attempt(verdict="Secret verdict"))
    until(lambda: teacher.room.seats[0].page == "Secret page")
    teacher.end_room()
    assert "ended" in teacher.room.closed
    assert "ended" in student.room.closed
    with pytest.raises(RefusedError):
        student.submit(attempt())
    until(lambda: b"Secret" not in stored_bytes(tmp_path / "data"))


def test_time_ends_a_room_and_a_new_clock_does_not(hub, monkeypatch):
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    monkeypatch.setattr(time, "time", lambda: 9e9)
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


def test_a_locked_database_delays_and_loses_nothing(hub, other, tmp_path, monkeypatch):
    monkeypatch.setattr("app.classroom.database.WAIT", 0.2)
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
    far = other.attend(other.rooms.join(room.code, "Bob"), nothing)
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
    with hub.database.read() as connection:
        assert sorted(connection.scalars(select(Attempt.id))) == sorted([first.id, second.id])


ERRORS = [
    ZeroDivisionError("no error of the database"),
    DataError("", {}, Exception("a value of this room")),
    OperationalError("", {}, Exception("a page of the file that has this room")),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_any_error_while_a_room_is_stored_loses_nothing_and_holds_up_no_other_room(
    hub, monkeypatch, caplog, error
):
    monkeypatch.setattr("app.classroom.hub.RETRY", 1e9)
    store, failing = rooms.store_reports, set()

    def store_or_fail(connection, room, *reports):
        if room in failing:
            raise error
        store(connection, room, *reports)

    monkeypatch.setattr(rooms, "store_reports", store_or_fail)
    bad, well = (hub.attend(hub.ticket(hub.rooms.open(title, 3600).token), nothing) for title in ("Bad", "Well"))
    failing.add(bad.ticket.room)
    bad.set_frozen(True)
    well.set_frozen(True)
    until(lambda: stored(hub, well).get("frozen"))
    until(lambda: bad.room.problem)
    assert not stored(hub, bad)
    assert bad.room.frozen, "in memory at once"
    assert "could not be stored" in caplog.text or "database failed" in caplog.text
    assert (bad.room.problem == UNSTORED) != isinstance(error, OperationalError)
    failing.clear()
    well.set_frozen(False)
    until(lambda: not stored(hub, well)["frozen"])
    assert not stored(hub, bad), "not in each tick"
    assert bad.room.problem
    assert not well.room.problem
    hub.lives[bad.ticket.room].retry_at = 0.0  # as after RETRY or RETRY_ROOM
    until(lambda: stored(hub, bad) == {"frozen": True})
    until(lambda: not bad.room.problem)


def test_what_could_not_be_stored_is_tried_again_when_the_service_stops(hub, other, monkeypatch):
    page = hub.attend(hub.ticket(hub.rooms.open("Kinematics", 3600).token), nothing)
    live = hub.lives[page.ticket.room]
    monkeypatch.setattr(live, "retry", lambda *_: None)  # as a look at the database that has begun ends with
    live.retry_at = 1e18
    page.set_frozen(True)
    assert not stored(other, page)
    hub.close()
    assert stored(other, page)["frozen"]


def test_a_value_that_the_database_refuses_is_said_and_not_logged(hub, caplog):
    refused = DataError("", {}, Exception("value too long\nDETAIL:  Failing row contains (Ada Lovelace)"))
    with pytest.raises(RefusedError, match="cannot be stored") as found, hub.database.write():
        raise refused
    assert found.value.__suppress_context__
    assert "value too long" in caplog.text
    assert "Lovelace" not in caplog.text


def test_who_is_second_with_the_same_row_is_asked_to_try_again(hub):
    room = hub.rooms.open("Kinematics", 3600)
    with pytest.raises(ClassroomUnavailable, match="Try again"), hub.database.write() as connection:
        connection.execute(insert(Room).values(id=room.id, code="ACDEFGHJ", title="", created=0.0, ends=9e9))


@pytest.mark.full
def test_a_class_that_joins_at_once_waits_for_its_turn(hub, other, monkeypatch):
    """Sixty transactions take longer together than anybody waits for a lock, and no student is turned away."""
    monkeypatch.setattr("app.classroom.database.WAIT", 0.3)
    room = hub.rooms.open("Kinematics", 3600)
    read = rooms.read

    def slow(*arguments, **options):
        time.sleep(0.02)  # as on a busy machine
        return read(*arguments, **options)

    monkeypatch.setattr(rooms, "read", slow)
    with ThreadPoolExecutor(60) as pool:
        joined = list(pool.map(lambda k: (hub, other)[k % 2].rooms.join(room.code, f"Student {k}"), range(60)))
    assert len({ticket.seat for ticket in joined}) == 60
    assert hub.rooms.find(joined[0]).awaited == 60


def test_who_does_not_get_a_turn_reads_so(hub, monkeypatch):
    monkeypatch.setattr("app.classroom.database.WAIT", 0.1)
    seat = hub.rooms.join(hub.rooms.open("Kinematics", 3600).code, "Ada")
    with ThreadPoolExecutor(1) as pool, hub.database.write():
        other = pool.submit(hub.rooms.submit, seat, attempt())
        with pytest.raises(ClassroomUnavailable, match="too much to do"):
            other.result(10)
    hub.rooms.submit(seat, attempt())


def test_a_full_database_is_said_and_keeps_what_was_confirmed(hub):
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


def test_a_database_that_is_gone_comes_back(hub, tmp_path):
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


def test_a_page_can_come_while_the_database_is_away(hub, tmp_path, monkeypatch):
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


def test_the_thread_ends_when_all_have_left(hub, monkeypatch):
    monkeypatch.setattr("app.classroom.hub.LINGER", 0.1)
    room = hub.rooms.open("Kinematics", 3600)
    assert threads() == 0
    pages = [hub.attend(hub.ticket(room.token), nothing) for _ in range(3)]
    assert threads() == 1
    pages[0].set_frozen(True)
    other = hub.attend(hub.ticket(hub.rooms.open("Other", 3600).token), nothing)
    assert threads() == 2, "one for each room"
    other.leave()
    for page in pages:
        page.leave()
        page.leave()
    until(lambda: threads() == 0)
    again = hub.attend(hub.ticket(room.token), nothing)
    assert again.room.frozen
    assert threads() == 1


def threads():
    return sum(thread.name == "kinboard-classroom" for thread in threading.enumerate())


@pytest.mark.full
def test_the_start_imports_no_database():
    late = {"sqlalchemy", "alembic", "segno", "jinja2"}  # a service without classrooms does not wait for them
    code = f"import sys, app.service.main; print({late} & set(sys.modules) or 'none')"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert out.stdout.strip() == "none"


def test_migrations_make_the_tables_of_the_models(hub):
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


def test_a_process_waits_while_another_makes_the_same_new_database(tmp_path):
    """SQLite refuses this lock at once, whatever the time that it may wait for others."""
    (tmp_path / "data").mkdir()
    maker = sqlite3.connect(tmp_path / "data" / "classroom.db", isolation_level=None, check_same_thread=False)
    maker.execute("BEGIN IMMEDIATE")
    end = threading.Timer(0.3, maker.rollback)
    end.start()
    hub = Hub(tmp_path / "data")
    try:
        assert hub.rooms.open("Kinematics", 3600).title == "Kinematics"
    finally:
        end.join()
        hub.close()
        maker.close()


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


def test_what_was_answered_stays_when_the_student_goes_on_or_raises_a_hand(hub, other):
    room = hub.rooms.open("Kinematics", 3600)
    seat = hub.rooms.join(room.code, "Ada")
    student, teacher = hub.attend(seat, nothing), hub.attend(hub.ticket(room.token), nothing)
    first = attempt()
    student.tell_task(first.exercise)
    teacher.send_task(first.exercise)
    student.submit(first)

    def found():
        return standing(teacher.room.seats[0], teacher.room)

    assert found().progress == "solved"
    student.raise_hand(True)
    student.tell_task("another")
    assert found().hand
    assert found().elsewhere
    assert (found().progress, found().work.tries) == ("solved", 1)
    student.submit(replace(first, id="f" * 16, exercise="another", score=0.0, answer="é" * 1000))
    assert "another" in teacher.room.seats[0].work
    assert found().progress == "solved"
    late = other.attend(hub.ticket(room.token), nothing)
    assert late.room.seats[0].work == teacher.room.seats[0].work, "read as it was taken over"
    teacher.remove_seat(seat.seat)
    assert hub.lives[seat.room].seats[seat.seat]["work"] == {}


def test_no_two_students_have_the_same_alias(hub, other):
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
def test_an_alias_of_marks_alone_is_refused(hub, alias):
    room = hub.rooms.open("Kinematics", 3600)
    with pytest.raises(RefusedError, match="marks alone") as refused:
        hub.rooms.join(room.code, alias)
    assert refused.value.field == "alias"
    assert hub.rooms.find(hub.rooms.join(room.code, "e\u0301")).alias == "é"


@pytest.mark.full
def test_attempts_are_bounded(hub, monkeypatch):
    monkeypatch.setattr("app.classroom.rooms.MAX_ATTEMPTS", 2)
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


def test_students_of_a_room_are_bounded(hub, monkeypatch):
    monkeypatch.setattr("app.classroom.rooms.MAX_SEATS", 1)
    room = hub.rooms.open("Kinematics", 3600)
    hub.rooms.join(room.code, "Ada")
    with pytest.raises(RefusedError, match="room is full"):
        hub.rooms.join(room.code, "Bob")


def test_seats_that_nobody_takes_keep_no_student_out(hub, monkeypatch):
    """Somebody joins again and again without ever opening a page."""
    monkeypatch.setattr("app.classroom.rooms.MAX_SEATS", 4)
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
    assert swept.words == "Bob: joined less than a minute ago; press again later."
    monkeypatch.setattr("app.classroom.rooms.UNSEEN", 0.0)
    swept = hub.rooms.remove_unseen(room.id)
    assert (swept.count, swept.words) == (1, "")
    assert [hub.rooms.is_open(seat) for seat in (ada, eve, bob)] == [True, True, False]


def test_who_leaves_before_anybody_has_looked_has_come(hub, other):
    room = hub.rooms.open("Kinematics", 3600)
    ada = other.rooms.join(room.code, "Ada")
    hub.attend(ada, nothing).leave()
    teacher = hub.attend(Ticket(room.id), nothing)
    assert [seat.came for seat in teacher.room.seats] == [True]
    until(lambda: beats(hub, ada) > 0)
    assert (hub.rooms.find(ada).students, hub.rooms.find(ada).awaited) == (1, 0)
    teacher.leave()


def beats(hub, ticket):
    with hub.database.read() as connection:
        return connection.scalar(select(Seat.beat).where(Seat.id == ticket.seat))


@pytest.mark.parametrize("name", ["a b", "50%", "a?b#c", "ä", "a'b"])
def test_a_folder_may_have_any_name(tmp_path, name):
    hub = Hub(tmp_path / name)
    hub.rooms.open("Kinematics", 3600)
    hub.close()
    assert (tmp_path / name / "classroom.db").exists()
