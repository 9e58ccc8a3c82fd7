"""A room in memory: what its pages report and see. No database, no thread, and a clock that the test sets."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from app.classroom import Attendance, RefusedError, Ticket, live
from app.classroom.live import AWAY, REMOVED, LiveRoom, Place
from app.classroom.standing import standing
from app.classroom.views import Recalled

ROOM = {
    "id": "r",
    "code": "KVNWZTRB",
    "title": "Kinematics",
    "created": 0.0,
    "ends": 9e9,
    "page": "",
    "version": 1,
}
SEAT = {
    "joined": 0.0,
    "hand": 0.0,
    "task": "",
    "gone": False,
    "driven": "",
    "recalled": [],
    "voted": "",
    "vote": 0,
    "page": "",
    "beat": 1,
    "tries": 0,
    "removed": False,
}


@pytest.fixture
def clock(monkeypatch):
    """The time, which the test sets."""
    found = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(live, "steady", lambda: found.now)
    return found


class Class:
    """A room with three students and a page of each; counts how often each page was notified."""

    def __init__(self):
        self.live = LiveRoom("r")
        self.live.load({**ROOM, "state": {}}, self.seats())
        self.heard = dict.fromkeys(("", "ada", "bob", "cid"), 0)
        self.silent = dict.fromkeys(self.heard, 0.0)
        self.teacher, self.ada, self.bob, self.cid = map(self.page, self.heard)
        self.heard.update(dict.fromkeys(self.heard, 0))

    @staticmethod
    def seats(**columns):
        return [
            {**SEAT, "id": name, "alias": name.title(), "work": {}, **columns} for name in ("ada", "bob", "cid")
        ]

    def page(self, seat):
        def changed():
            self.heard[seat] += 1

        place = Place(Ticket("r", seat), changed, lambda: self.silent[seat])
        self.live.enter(place)
        self.live.notify()
        return Attendance(None, self.live, place)

    def away(self):
        self.live.look_who_is_there()
        return self.live.away


@pytest.fixture
def room(clock):
    return Class()


def test_what_the_teacher_does_is_seen_at_once(room):
    room.teacher.tell_page("before")
    assert room.ada.room.page == "", "nobody follows"
    room.teacher.set_follow(True)
    assert (room.ada.room.page, room.ada.room.follow) == ("before", True)
    room.teacher.tell_page("after")
    assert room.ada.room.page == "after"
    room.teacher.set_frozen(True)
    assert room.ada.room.frozen
    room.teacher.send_task("swing")
    assert room.ada.room.task.exercise == "swing"
    assert not room.ada.room.frozen
    assert not room.ada.room.follow
    room.teacher.send_course('{"title": "Week 1"}')
    assert room.ada.room.course
    assert room.ada.room.task is None
    room.teacher.send_task("swing")
    assert room.ada.room.course, "a task leaves the course"
    room.ada.raise_hand(True)
    assert room.teacher.room.seats[0].hand > 0
    room.teacher.lower_hand("ada")
    assert room.ada.room.seat.hand == 0
    assert room.ada.room.seats == ()


def test_who_follows_is_known_to_the_teacher(room):
    def presences():
        return [standing(seat, room.teacher.room).presence for seat in room.teacher.room.seats]

    room.teacher.set_follow(True)
    room.bob.tell_gone(True)
    assert presences() == ["following", "by themselves", "following"]
    room.bob.tell_gone(False)
    assert presences() == ["following"] * 3
    room.teacher.set_follow(False)
    assert presences() == ["by themselves"] * 3


def test_a_page_is_notified_only_of_what_it_can_see(room):
    """Thirty students who move must not wake each other's pages."""
    room.ada.tell_page("one")
    room.live.notify()
    assert room.teacher.room.seats[0].page == "", "arms are shown together"
    room.live.take_arms()
    room.live.notify()
    assert room.teacher.room.seats[0].page == "one"
    assert room.heard == {"": 1, "ada": 0, "bob": 0, "cid": 0}
    room.teacher.show_seat("ada", named=False)
    room.ada.tell_page("two")
    assert (room.bob.room.shown.page, room.bob.room.shown.alias) == ("two", "")
    assert room.heard == {"": 3, "ada": 2, "bob": 2, "cid": 2}
    room.ada.tell_gone(False)
    room.ada.tell_task("")
    assert room.heard["bob"] == 2, "nothing has changed"


def test_a_page_that_fails_stops_no_other(room, caplog):
    def fail():
        raise RuntimeError("this page is broken")

    room.live.places[0].changed = fail
    room.ada.raise_hand(True)
    assert room.heard == {"": 0, "ada": 1, "bob": 1, "cid": 1}
    assert "could not be notified" in caplog.text


def test_two_tabs_are_one_seat(room):
    second = room.page("ada")
    room.ada.raise_hand(True)
    assert second.room.seat.hand > 0
    second.raise_hand(False)
    assert room.ada.room.seat.hand == 0
    second.leave()
    room.ada.raise_hand(True)
    assert second.room.seat.hand == 0, "what was seen last"
    assert room.ada.room.students == 3


def test_votes_are_counted_once_and_nobody_sees_whose(room):
    with pytest.raises(RefusedError, match="closed"):
        room.ada.vote(0)
    room.teacher.open_poll("Elbow?", ["up", "down"])
    for choice in (0, 1, 1):
        room.ada.vote(choice)
        room.bob.vote(choice)
    assert room.teacher.room.poll.votes == (0, 2)
    assert (room.ada.room.poll.chosen, room.cid.room.poll.chosen) == (1, None)
    assert not any("vot" in name for seat in room.teacher.room.seats for name in vars(seat))
    with pytest.raises(RefusedError, match="no such choice"):
        room.ada.vote(2)
    room.teacher.close_poll()
    with pytest.raises(RefusedError, match="closed"):
        room.bob.vote(0)
    assert room.bob.room.poll.votes == (0, 2)
    assert room.bob.room.poll.choices == ("up", "down")
    room.teacher.open_poll("Wrist?", ["up", "down"])
    assert room.teacher.room.poll.votes == (0, 0), "votes belong to a question"
    room.teacher.remove_poll()
    assert room.ada.room.poll is None


def test_every_second_student_gets_what_a_course_compares_in_the_other_order(room):
    assert [page.room.exchanged for page in (room.ada, room.bob, room.cid)] == [False, True, False]
    room.live.seats["ada"]["removed"] = True
    assert [page.room.exchanged for page in (room.bob, room.cid)] == [True, False], "nobody changes sides"
    assert not room.teacher.room.exchanged


def test_counts_of_what_is_remembered_add_up_and_no_page_sees_them(room):
    room.live.reports()
    room.ada.tell_recalled(Recalled(1, 1, 0, 0))
    room.ada.tell_recalled(Recalled(1, 0, 1, 1))
    _, _, (row,) = room.live.reports()
    assert (row["id"], row["recalled"]) == ("ada", [2, 1, 1, 1])
    assert not any("recall" in name for seat in room.teacher.room.seats for name in vars(seat))


def test_who_has_left_or_says_nothing_is_away_within_ten_seconds(room, clock):
    assert AWAY <= 8.0, "and a tick, and the way to the page"
    room.teacher.leave()
    clock.now += AWAY - 1.0
    room.silent.update(dict.fromkeys(room.silent, 1.9))  # asked every two seconds
    room.silent["bob"] = AWAY - 1.0  # a phone in a dead spot: connected, and silent
    assert room.away() == set()
    clock.now += 2.0
    room.silent["bob"] += 2.0
    assert room.away() == {"", "bob"}
    assert room.ada.room.teacher_away
    room.silent["bob"] = 0.0
    room.page("")
    assert room.away() == set()
    tab = room.page("ada")
    room.ada.leave()
    clock.now += AWAY + 1.0
    assert room.away() == set(), "the other tab is there"
    tab.leave()
    clock.now += AWAY + 3.0
    assert room.away() == {"ada"}


def test_after_a_start_pages_have_time_to_connect_again(clock):
    room = LiveRoom("r")
    room.load({**ROOM, "state": {}}, Class.seats())
    clock.now += AWAY - 1.0
    room.look_who_is_there()
    assert not room.view(Ticket("r")).teacher_away
    clock.now += 2.0
    room.look_who_is_there()
    assert room.view(Ticket("r")).teacher_away
    assert all(seat.away for seat in room.view(Ticket("r")).seats)


def test_a_seat_is_seen_once_a_page_has_come(room):
    room.live.load({**ROOM, "state": {}}, Class.seats(beat=0))
    assert not any(seat.came for seat in room.teacher.room.seats)
    room.cid.leave()
    room.live.look_who_is_there()
    assert [seat.came for seat in room.teacher.room.seats] == [True, True, False]
    assert [row["beat"] for row in room.live.reports()[2]] == [1, 1]


def test_what_is_read_does_not_undo_what_is_not_stored(room):
    """Another program has changed the room: its columns are taken over, and what pages have reported stays."""
    room.ada.raise_hand(True)
    room.teacher.set_frozen(True)
    elsewhere = Class.seats(alias="New", hand=5.0, task="swing")
    room.live.load({**ROOM, "version": 7, "title": "Other", "state": {"frozen": False, "follow": True}}, elsewhere)
    view = room.teacher.room
    assert (view.title, view.frozen, view.follow) == ("Other", True, True)
    assert [(seat.alias, seat.task) for seat in view.seats] == [("New", "swing")] * 3
    hands = [seat.hand for seat in view.seats]
    assert hands[0] > 5.0
    assert hands[1:] == [5.0, 5.0]
    assert room.live.version == 7


def test_what_could_not_be_stored_is_stored_later_with_what_came_meanwhile(room):
    room.ada.raise_hand(True)
    room.teacher.set_frozen(True)
    taken, columns, rows = room.live.reports()
    assert columns["state"] == {"frozen": True}
    assert [(row["id"], row["hand"] > 0) for row in rows] == [("ada", True)]
    assert room.live.reports() == ({}, {}, []), "once"
    room.ada.raise_hand(False)
    room.bob.tell_task("swing")
    room.live.put_back(taken)
    _, columns, rows = room.live.reports()
    assert columns["state"] == {"frozen": True}
    assert [(row["id"], row["hand"], row["task"]) for row in rows] == [("ada", 0.0, ""), ("bob", 0.0, "swing")]


def test_a_removed_seat_reports_nothing_more(room):
    room.live.take(2, {"ada": {"removed": True, "alias": "", "page": ""}})
    assert room.ada.room.closed == REMOVED
    room.ada.tell_page("again")
    room.ada.raise_hand(True)
    room.live.take_arms()
    assert room.live.reports() == ({}, {}, [])
    assert [seat.alias for seat in room.teacher.room.seats] == ["Bob", "Cid"]


def test_a_page_is_bounded(room):
    with pytest.raises(ValueError, match="16001"):
        room.ada.tell_page("x" * 16_001)
