"""Rooms with several processes' hubs on one database file."""

from __future__ import annotations

import time

import pytest

from app.classroom import Hub, NewAttempt

SOON = 10.0  # seconds: far more than anything takes


def until(condition, what="the condition"):
    """Wait until a condition holds."""
    deadline = time.monotonic() + SOON
    while not condition():
        assert time.monotonic() < deadline, f"{what} did not come"
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
    teacher.set_frozen(True)
    teacher.send_task("swing")
    until(lambda: student.room.page == "after" and student.room.task is not None)
    assert student.room.frozen
    student.raise_hand(True)
    student.tell_page("mine")
    teacher.show_seat(seat.seat, named=False)
    until(lambda: student.room.shown is not None and student.room.shown.page == "mine")
    until(lambda: teacher.room.seats[0].hand > 0)
    assert student.room.shown.alias == ""
    assert student.room.seats == ()
    student.leave()
    assert not student.room.closed
