"""Parts of a class that need no page: cells of the wall, sharing, submissions, acts."""

from __future__ import annotations

import re
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.classroom import (
    ClassroomUnavailable,
    Confirmed,
    NewAttempt,
    RefusedError,
    RoomView,
    SeatView,
    Task,
    tables,
)
from app.classroom.courses import SentExercises
from app.classroom.standing import standing
from app.classroom.work import ANSWER_SHOWN, Attempt, Work, works
from app.exercises import Exercises
from app.viewer.exercises.feature import Practising
from app.viewer.live.feature import Connect
from app.viewer.room import submissions, views
from app.viewer.room.member import act_of
from app.viewer.room.sharing import REST, Sharing
from app.viewer.room.student import Student
from app.viewer.room.submissions import Submissions
from app.viewer.room.wall import LETTER, LINES, MOST, PADS, SYMBOLS, SmallArm, layout_of
from app.viewer.session.state import PageState
from app.viewer.worksheet.feature import Worksheets
from kin.parsing import to_toml

EXERCISES = Exercises()
SENT = SentExercises(EXERCISES, {}, kin.get_robot)
ATTEMPT = NewAttempt("swing", 1, [1], "Yes.", 1.0, 0.0)


SHOWN = 0.88  # share of the picture that the wall takes at most


@given(st.integers(1, MOST), st.floats(0.4, 2.5))
def test_arms_and_names_of_a_wall_keep_to_their_cells(count: int, aspect: float) -> None:
    layout = layout_of(count, aspect, 1.0)
    assert 1 <= layout.columns <= count
    assert layout.columns * layout.width == pytest.approx(aspect)
    assert layout.rows * layout.height == pytest.approx(1.0)
    assert layout.side > 0.0
    middles = layout.middles()
    above, below = middles[:, 1] + 0.5 * layout.side, middles[:, 1] - 0.5 * layout.side - LINES * layout.line
    assert above.max() <= 0.5 + 1e-9
    assert below.min() >= -0.5 - 1e-9
    assert (np.abs(middles[:, 0]) + 0.5 * layout.width).max() <= 0.5 * aspect + 1e-9
    apart = np.abs(middles[:, None] - middles[None]) / [layout.width, layout.height]
    assert (apart.max(axis=2) + np.eye(count)).min() >= 1.0 - 1e-9
    longest = max(len(SYMBOLS[state] + state) for state in PADS)
    assert longest * LETTER * layout.line <= layout.width * (1 + 1e-9)


@pytest.mark.parametrize("count", range(1, MOST + 1))
def test_names_are_legible_at_1920_by_1080_and_the_arms_take_the_space(count: int) -> None:
    height = 1080
    width = 1470  # beside the panel
    layout = layout_of(count, width, height)
    assert SHOWN * layout.line >= 24.0
    assert count * layout.side * (layout.side + LINES * layout.line) >= 0.44 * width * height


def test_a_long_name_is_cut_and_a_state_is_not() -> None:
    robot = kin.get_robot("pioneer5")
    arm = SmallArm("1", "Bartholomew Featherstone", robot, robot.q_home, "not begun", hand=True)
    assert arm.label(12) == "☝ Bartholomew…\n○ not begun"
    assert SmallArm("1", "Ada", robot, robot.q_home, "none").label(12) == "Ada"
    driven = SmallArm("1", "Ada", robot, robot.q_home, "stuck", driven="SO-101 at /dev/ttyACM0")
    assert driven.label(16) == "Ada\n● drives SO-101…"
    assert driven.pad not in PADS.values()


def test_a_state_is_sent_at_most_so_often_and_only_if_it_changed() -> None:
    sent: list[str] = []
    states = [PageState(robot="a")]
    sharing = Sharing(lambda: states[0], sent.append, lambda: 0.2)
    assert sharing.tick(1.0) == 0.2
    states[0] = PageState(robot="b")
    assert sharing.tick(1.1) == pytest.approx(0.1), "too soon"
    assert len(sent) == 1
    assert sharing.tick(1.2) == 0.2
    assert len(sent) == 2
    assert sharing.tick(1.5) == REST, "once more, for what is reported late"
    assert sharing.tick(1.9) is None
    assert len(sent) == 2


@pytest.mark.parametrize(
    ("error", "stored"), [(ClassroomUnavailable("locked."), 1), (RefusedError("removed."), 0)]
)
def test_an_answer_is_stored_or_it_is_said_why_not(
    monkeypatch: pytest.MonkeyPatch, error: Exception, stored: int
) -> None:
    monkeypatch.setattr(submissions, "AGAIN", 0.01)
    errors, changed, problems = [error], threading.Event(), []

    def submit(attempt: NewAttempt) -> Confirmed:
        if errors:
            raise errors.pop()
        return Confirmed(attempt.id, 1.0)

    def note() -> None:
        problems.append(sent.state.problem)
        if not sent.state.waiting:
            changed.set()

    sent = Submissions(submit, note)
    sent.add(ATTEMPT)
    assert changed.wait(10.0)
    assert problems[0] == str(error)
    assert (sent.state.stored, sent.state.waiting) == (stored, 0)
    changed.clear()
    sent.add(ATTEMPT)
    assert changed.wait(10.0)
    assert (sent.state.stored, sent.state.problem) == (stored + 1, "")


def test_no_half_of_an_outcome_of_an_answer_is_seen() -> None:
    """A page that looks between two steps must not read that a refused answer is tried again."""
    outcomes = [None, RefusedError("removed."), ZeroDivisionError(), None]
    seen: list[object] = []
    stored = threading.Event()

    class Seen(Submissions):
        """Notes what others see from each step on."""

        def __setattr__(self, name: str, value: object) -> None:
            super().__setattr__(name, value)
            if name == "state":
                seen.append(value)

    def submit(attempt: NewAttempt) -> Confirmed:
        if (error := outcomes.pop(0)) is not None:
            raise error
        return Confirmed(attempt.id, 1.0)

    sent = Seen(submit, stored.set)
    failed = "The answer could not be stored; the server log has the details."
    for problem in ("", "removed.", failed, ""):
        stored.clear()
        sent.add(ATTEMPT)
        assert stored.wait(10.0)
        assert sent.state.problem == problem
    before, *after = seen
    assert before == (0, 0, "")
    assert after == [
        (1, 0, ""), (0, 1, ""),
        (1, 1, ""), (0, 1, "removed."),
        (1, 1, ""), (0, 1, failed),
        (1, 1, ""), (0, 2, ""),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("key", "value", "act"),
    [
        ("home", None, "home"),
        (("joint", "pioneer5", 0), 3.0, "joint"),
        (("message", "nudge", 7), None, "nudge"),
        (("message", "feature", 7), ["exercises", ["answer", 1], 0], "feature"),
        (("message", "feature", 7), ["class", ["hand", 1], None], ""),
        (("message", "feature", 7), ["sheet", ["page", 1], None], ""),
        (("message", "feature", 7), ["connect", ["stop", 0], None], ""),
        (("message", "feature", 7), ["connect", ["halt", "stop", 0], 3], ""),
        (("message", "feature", 7), ["connect", ["press", "weigh", 0], 3], "press"),
        (("message", "feature", 7), ["connect", ["confirm", "enable", 0], 3], "press"),
        (("feature", "connect", ("do", ("on_play",), 3, 1)), None, "feature"),
        (("feature", "connect", ("at", "at", 3, 1)), 0.5, "feature"),
        (("feature", "connect", ("do", ("on_close",), 3, 1)), None, ""),
        (("message", "feature", 7), ["connect", ["upload"], None], "feature"),
        (("message", "feature", 7), [], ""),
        (("message", "unknown", 7), None, ""),
        (("feature", "workspace", "chunk"), None, ""),
        (("view", "labels"), True, ""),
        ("looked", None, ""),
    ],
)
def test_acts_are_what_a_visitor_does_to_the_arm(key: object, value: object, act: str) -> None:
    assert act_of(key, value, (Practising, Student, Worksheets, Connect)) == act


def work(*scores: float | None, exercise: str = "swing", answer: str = "[1]") -> dict[str, Work]:
    """What these answers give; None: the right one was shown."""
    attempts = [
        Attempt("1", "A", exercise, 7, answer, "No." if score is not None else ANSWER_SHOWN, score or 0.0, 0.0, at)
        for at, score in enumerate(scores)
    ]
    return works(attempts).get("1", {})


ALONE = "by themselves"


@pytest.mark.parametrize(
    ("seat", "presence", "progress", "words"),
    [
        ({"task": "swing"}, ALONE, "not begun", "not begun"),
        ({"task": "swing", "work": work(0.0)}, ALONE, "at it", "at it · 1 try"),
        ({"task": "swing", "work": work(0, 0.5, 0)}, ALONE, "stuck", "stuck · 3 tries"),
        ({"work": work(0, None)}, ALONE, "gave up", "gave up · 1 try · at the arm"),
        ({"task": "x", "work": work(0, 1, 0)}, ALONE, "solved", "solved · 3 tries · at the arm"),
        (
            {"task": "swing", "driven": "SO-101", "work": work(0.0)},
            ALONE,
            "at it",
            "drives SO-101 · at it · 1 try",
        ),
        ({"away": True, "driven": "SO-101", "work": work(1.0)}, "away", "solved", "away · solved · 1 try"),
        ({"task": "swing", "hand": 3.0, "work": work(1.0)}, ALONE, "solved", "hand up · solved · 1 try"),
        ({"away": True, "work": work(1.0)}, "away", "solved", "away · solved · 1 try"),
        ({"away": True, "came": False}, "not here yet", "not begun", "not here yet"),
        ({"task": "x", "work": work(0, 0, exercise="x")}, ALONE, "not begun", "not begun · at the arm"),
    ],
)
def test_how_a_student_is_doing(seat: dict[str, Any], presence: str, progress: str, words: str) -> None:
    one = SeatView("1", "A", **seat)
    room = RoomView("r", task=Task("swing", 1.0), seats=(one,))
    found = standing(one, room)
    assert (found.presence, found.progress, found.hand) == (presence, progress, "hand" in seat)
    listed, rest = views.list_html(room, "", EXERCISES, SENT)
    assert re.findall(r'class="kb-class-where">([^<]*)<', listed) == [words]
    assert rest == ""


def test_an_answer_to_an_exercise_that_was_sent_again_has_words_while_they_are_the_same() -> None:
    """Nobody knows which version the student has read."""

    def listed(*versions: str) -> list[str]:
        own = {"own-one": tuple(written(third) for third in versions)}
        seat = SeatView("1", "A", task="own-one", work=work(0.0, exercise="own-one", answer="2"))
        room = RoomView("r", task=Task("own-one", 1.0), seats=(seat,), own=own)
        html, _ = views.list_html(room, "", EXERCISES, SentExercises(EXERCISES, own, kin.get_robot))
        return re.findall(r"<bdi>([^<]*)</bdi>", html)

    def written(third: str) -> str:
        options = [{"text": text, "reason": "It rests."} for text in ("It rests", "It turns", third)]
        options[0]["right"] = True  # type: ignore[assignment]
        return to_toml(
            {
                "id": "own-one",
                "title": "Own",
                "topic": "Frames and DH tables",
                "robot": "scara",
                "kind": "choice",
                "text": "What does joint 3 do?",
                "answer": {"shuffle": False, "options": options},
            }
        )

    assert listed("It slides") == listed("It slides", "It slides") == ["It slides"]
    assert listed("It slides", "It moves along its axis") == ["2"]


def test_list_chips_bar_and_task_say_the_same_of_thirty() -> None:
    """Three have stopped following, one is away, two never came; ten have solved the task."""
    seats = [
        SeatView(f"{i}", f"S{i}", hand=float(i == 9), gone=i < 3, work=work(1.0) if i < 10 else {})
        for i in range(28)
    ]
    seats[20] = replace(seats[20], away=True, work=work(0, 0, 0))
    seats[21] = replace(seats[21], work=work(0, 0, 0))
    seats += [SeatView("28", "S28", away=True, came=False), SeatView("29", "S29", away=True, came=False)]
    room = RoomView("r", follow=True, task=Task("swing", 1.0), seats=tuple(seats), students=30)
    bar = plain(views.teacher_bar(room, None, False, 0))
    assert "You lead 24 of 28 students · 3 by themselves · 1 away · 2 stuck" in bar
    assert "10 of 28 solved it" in plain(views.task_html(room, EXERCISES.all[0], EXERCISES))
    chips = plain(views.tools_html(room, False, False))
    for fact in ("1 hand up", "2 stuck", "16 not begun", "10 solved", "24 following", "3 by themselves", "1 away"):
        assert fact in chips, fact
    assert "2 not here yet" in chips
    above, rest = views.list_html(room, "21", EXERCISES, SENT)
    order = re.findall(r'data-question-key="(\d+)"', above + rest)
    assert [order[0], order[1], *order[-3:]] == ["9", "21", "20", "28", "29"]
    assert re.findall(r'data-question-key="(\d+)"', above) == ["9", "21"], "the card stands below who was picked"


@pytest.mark.parametrize(("arms", "words"), [(MOST, "All arms."), (MOST + 1, "The first 40 of 41 arms.")])
def test_a_wall_says_how_many_arms_it_shows(arms: int, words: str) -> None:
    seats = [SeatView(f"{i}", f"S{i}", page="…") for i in range(arms)] + [SeatView("x", "X")]
    room = RoomView("r", seats=tuple(seats), students=len(seats))
    assert f"{words} Click one to look at it." in plain(views.teacher_bar(room, None, True, 0))


def plain(html: str) -> str:
    return " ".join(re.sub("<[^>]+>", " ", html).split())


SAID = {  # what is stored of a student and of an answer, by column, and how the page says so
    "alias": "Your alias",
    "joined": "when you joined",
    "page": "your arm and its position",
    "task": "the exercise you have open",
    "gone": "whether you follow the teacher",
    "driven": "a machine that a program moves",
    "hand": "your raised hand",
    "vote": "your votes",
    "recalled": "how many answers in <i>Review</i> were right",
    "answer": "your answers to exercises",
    "verdict": "verdicts",
    "cause": "recognised errors",
    "at": "times",
}
KEPT = {"id", "room_id", "seat_id", "removed", "beat", "version"}  # by the service, of no interest to students
FOLLOW = {"tries", "solved", "voted", "exercise", "seed", "score", "started"}  # from what is said


def test_students_read_what_is_stored_of_them() -> None:
    columns = {column.name for table in (tables.Seat, tables.Attempt) for column in table.__table__.columns}
    assert columns == SAID.keys() | KEPT | FOLLOW, "a new column needs its words"
    html = views.stored_html(RoomView("r", ends=60.0), 0.0)
    assert [words for words in SAID.values() if words not in html] == []
    assert "votes, and how much was right in <i>Review</i>, only as numbers of the class" in html
