"""The HTML of the tab *Class* and of the bar over the scene."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Literal

from app.classroom.courses import Course
from app.classroom.tokens import show_code
from app.classroom.views import Poll, RoomView, SeatView
from app.exercises import Exercise, Exercises
from app.viewer.room.submissions import Submissions
from app.viewer.room.wall import State
from app.viewer.views.templates import render

Mode = Literal["free", "led", "gone", "shown", "frozen", "paused", "closed"]
STUCK = 3  # attempts that were not right
MANY = 3  # students who have never come, from which on they can be removed together
# Symbol, headline, sentence and colour of who leads a student's page.
MODES: dict[Mode, tuple[str, str, str, str]] = {
    "free": ("✎", "You work by yourself", "Move the arm, open a lesson, try an exercise.", "blue"),
    "led": ("▶", "You follow the teacher", "The teacher moves your arm. Move it to stop following.", "green"),
    "gone": ("✎", "You stopped following", "The teacher still leads the class. You can follow again.", "amber"),
    "shown": ("★", "Your arm is shown to all", "Everybody in the room sees what you do now.", "mauve"),
    "frozen": ("❄", "Frozen", "The teacher has stopped all arms for a moment.", "violet"),
    "paused": ("‖", "Paused", "The teacher’s connection is lost. You can go on by yourself.", "amber"),
    "closed": ("■", "You are no longer in the room", "", "crimson"),
}  # fmt: skip
STAYS = "What you have done stays on this page and in its link."
GO_ON = "You can go on by yourself, or join a room."  # where no access token is needed
# Symbol, words and colour of how a student is doing.
DOING: dict[State, tuple[str, str, str]] = {
    "working": ("", "here", ""),
    "hand": ("☝", "hand up", "amber"),
    "stuck": ("!", "stuck", "vermilion"),
    "solved": ("✓", "solved", "green"),
    "away": ("…", "away", ""),
}


def doing(seat: SeatView, room: RoomView) -> State:
    """How a student is doing, in a word: the most urgent one."""
    on_task = room.task is not None and seat.task == room.task.exercise
    if seat.away:
        return "away"
    if seat.hand:
        return "hand"
    if on_task and seat.solved:
        return "solved"
    return "stuck" if on_task and seat.tries >= STUCK else "working"


def students(count: int) -> str:
    """``1 student``, ``12 students``."""
    return f"{count} student{'s' if count != 1 else ''}"


def _mode(room: RoomView, mode: Mode, guest: bool) -> dict[str, str]:
    symbol, title, detail, color = MODES[mode]
    if mode == "led" and room.shown is not None:
        title = f"You see the arm of {room.shown.alias}" if room.shown.alias else "You see a classmate’s arm"
        detail = "The teacher shows it to all. Move your arm to stop following."
    if mode == "led" and room.frozen:
        title, detail = f"Frozen. {title}", "Your arm moves with it until the teacher ends the freeze."
        symbol, color = MODES["frozen"][0], MODES["frozen"][3]
    if mode == "closed":
        detail = f"{room.closed} {STAYS}" + ("" if guest else f" {GO_ON}")
    return {"symbol": symbol, "title": title, "detail": detail, "color": color}


def student_html(room: RoomView, mode: Mode, task: Exercise | None, sent: Submissions, guest: bool) -> str:
    """Who leads, the task, and the raised hand.

    Args:
        guest: whether the page may be used no longer than the seat is there.
    """
    seat = room.seat or SeatView("", "")
    mine = room.task is not None and seat.task == room.task.exercise
    mark = ("solved", "green") if mine and seat.solved else ("", "")
    if mine and seat.tries and not seat.solved:
        mark = (f"{seat.tries} attempt{'s' if seat.tries > 1 else ''}, not right yet", "amber")
    return render(
        "room/student", room=room, seat=seat, mode=mode, lead=_mode(room, mode, guest), task=task, mark=mark,
        sent=sent,
    )  # fmt: skip


def student_bar(room: RoomView, mode: Mode, open_tab: int, away: bool) -> str:
    """What a student must see whatever tab is open.

    Args:
        open_tab: grows when the tab Learn is to be opened.
        away: whether the page shows something else than the task that was set.
    """
    poll = room.poll if room.poll is not None and room.poll.open and room.poll.chosen is None else None
    quiet = mode == "free" and poll is None and not room.problem
    return render(
        "room/student_bar", room=room, mode=mode, lead=_mode(room, mode, guest=True), poll=poll, quiet=quiet,
        stays=STAYS,
        open_tab=open_tab, away=away and mode == "free", hand=bool(room.seat and room.seat.hand),
    )  # fmt: skip


def poll_html(poll: Poll | None, teacher: bool) -> str:
    """The question with its choices; the tally for the teacher and, when it is closed, for all."""
    if poll is None:
        return ""
    total = sum(poll.votes)
    rows = [
        {
            "text": text,
            "votes": votes,
            "share": round(100 * votes / total) if total else 0,
            "chosen": poll.chosen == i,
        }
        for i, (text, votes) in enumerate(zip(poll.choices, poll.votes, strict=True))
    ]
    return render("room/poll", poll=poll, rows=rows, total=total, teacher=teacher)


def stored_html(room: RoomView, now: float) -> str:
    """What is stored of a student, in plain words."""
    return render("room/stored", room=room, left=_left(room, now))


def lead_html(room: RoomView) -> str:
    """Follow me and Freeze."""
    return render("room/lead", room=room, count=students(room.students))


def join_html(room: RoomView, now: float) -> str:
    """Code, QR code, and when the room ends."""
    return render("room/join", room=room, code=show_code(room.code) if room.code else "", left=_left(room, now))


def tools_html(room: RoomView, wall: bool, armed: bool) -> str:
    """The wall's button, how the students are doing, and a way to clear the list of those who have never come.

    Args:
        armed: whether that button was pressed once.
    """
    counts = [doing(seat, room) for seat in room.seats]
    unseen = sum(seat.away and not seat.seen for seat in room.seats)
    facts = [(DOING[s], counts.count(s)) for s in ("hand", "stuck", "solved", "away") if s in counts]
    return render(
        "room/tools", room=room, wall=wall, count=students(len(counts)), facts=facts, armed=armed,
        unseen=unseen if unseen >= MANY else 0,
    )  # fmt: skip


def seat_html(room: RoomView, seat: SeatView | None, looked: str, armed: bool) -> str:
    """One student, and what can be done."""
    if seat is None or room.closed:
        return ""
    shown = room.shown is not None and room.shown.seat == seat.id
    return render(
        "room/seat", room=room, seat=seat, looked=looked == seat.id, shown=shown, armed=armed,
        named=bool(shown and room.shown and room.shown.alias),
    )  # fmt: skip


def list_html(room: RoomView, picked: str, exercises: Exercises) -> str:
    """All students."""
    rows = []
    for seat in room.seats:
        state = doing(seat, room)
        symbol, words, color = DOING[state]
        rows.append(
            {"seat": seat, "symbol": symbol, "color": color, "words": _where(seat, room, state, words, exercises)}
        )
    return render("room/students", rows=rows, picked=picked)


def _where(seat: SeatView, room: RoomView, state: State, words: str, exercises: Exercises) -> str:
    if state == "away":
        return words if seat.seen else "has not come"
    exercise = exercises.get(seat.task) if seat.task else None
    on_task = room.task is not None and seat.task == room.task.exercise
    place = ["at the task" if on_task else exercise.title if exercise is not None else "at the arm"]
    if seat.tries and not seat.solved:
        place.append(f"{seat.tries} attempt{'s' if seat.tries > 1 else ''}")
    if seat.solved and state != "solved":
        place.append("solved")
    if on_task and (len(place) > 1 or state == "solved"):
        place = place[1:]  # who has answered is at the task
    return " · ".join(place if state == "working" else [words, *place])


def task_html(room: RoomView, task: Exercise | None, solved: int, exercises: Exercises) -> str:
    """The form to send an exercise, and how many have solved the present one."""
    return render(
        "room/task", room=room, task=task, topics=exercises.topics(), solved=solved, count=len(room.seats)
    )  # fmt: skip


def course_title(room: RoomView) -> str:
    """The title of the course that was sent; empty: there is none."""
    return str(json.loads(room.course)["title"]) if room.course else ""


def course_html(room: RoomView, courses: Sequence[Course], task: Exercise | None) -> str:
    """The form to send a course, which one was sent, and which task the next one ends."""
    return render("room/course", room=room, title=course_title(room), courses=courses, task=task)


def ask_html(room: RoomView, question: str, choices: tuple[str, ...]) -> str:
    """The form to ask a question."""
    if room.poll is not None:
        return ""
    return render("room/ask", question=question, choices=[*choices, "", ""][:4])


def end_html(room: RoomView, armed: bool) -> str:
    """The button that ends the room."""
    return render("room/end", room=room, armed=armed)


def teacher_bar(room: RoomView, looked: SeatView | None, wall: bool) -> str:
    """What the teacher must see whatever tab is open."""
    hands = sorted((seat for seat in room.seats if seat.hand), key=lambda seat: seat.hand)
    return render(
        "room/teacher_bar", room=room, looked=looked, wall=wall, hands=hands, count=students(room.students),
    )  # fmt: skip


def _left(room: RoomView, now: float) -> str:
    """How long the room still lasts."""
    minutes = max(0.0, room.ends - now) / 60.0
    if minutes < 90:
        return f"{max(1, round(minutes))} minutes"
    return f"{round(minutes / 60)} hours" if minutes < 48 * 60 else f"{round(minutes / 1440)} days"
