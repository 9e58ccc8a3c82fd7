"""The HTML of the tab *Class* and of the bar over the scene."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from app.classroom.courses import Course, SentExercises
from app.classroom.standing import Presence, Standing, standing
from app.classroom.tokens import show_code
from app.classroom.views import Poll, RoomView, SeatView
from app.classroom.work import URGENCY, Progress
from app.exercises import Exercise, Exercises, VariantError
from app.viewer.room.submissions import SubmissionState
from app.viewer.room.wall import MOST
from app.viewer.views.templates import render
from kin.units import Units

UNITS = Units()
Mode = Literal["free", "led", "gone", "shown", "frozen", "paused", "closed"]
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
}
STAYS = "What you have done stays on this page and in its link."
GO_ON = "You can go on by yourself, or join a room."  # where no access token is needed
# Symbol and colour of what has become of the task, or of the exercise on show.
PROGRESS: dict[Progress, tuple[str, str]] = {
    "not begun": ("○", ""),
    "at it": ("✎", "blue"),
    "stuck": ("!", "vermilion"),
    "gave up": ("⚑", "mauve"),
    "solved": ("✓", "green"),
}
HAND, AWAY = "☝", "…"


def students(count: int) -> str:
    """``1 student``, ``12 students``."""
    return f"{count} student{'s' if count != 1 else ''}"


def tries(count: int) -> str:
    """``1 try``, ``3 tries``."""
    return f"{count} {'try' if count == 1 else 'tries'}"


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


def student_html(room: RoomView, mode: Mode, task: Exercise | None, sent: SubmissionState, guest: bool) -> str:
    """Who leads, the task, and the raised hand.

    Args:
        guest: whether the page may be used no longer than the seat is there.
    """
    seat = room.seat or SeatView("", "")
    mark = _own_mark(room)
    return render(
        "room/student",
        room=room,
        seat=seat,
        mode=mode,
        lead=_mode(room, mode, guest),
        task=task,
        mark=mark,
        sent=sent,
    )


def _own_mark(room: RoomView) -> tuple[str, str]:
    """How far the student on show is with the task, in words, and the colour of that."""
    if room.seat is None or room.task is None:
        return "", ""
    found = standing(room.seat, room)
    words: dict[Progress, str] = {
        "not begun": "not begun",
        "solved": "solved",
        "gave up": f"{tries(found.work.tries)}, answer shown",
    }
    progress = found.progress or "not begun"
    return words.get(progress, tries(found.work.tries)), PROGRESS[progress][1]


def student_bar(
    room: RoomView,
    mode: Mode,
    open_tab: int,
    task: Exercise | None,
    away: bool,
    read: str = "",
    paused: bool = False,
) -> str:
    """What a student must see whatever tab is open.

    Args:
        open_tab: grows when the tab Learn is to be opened.
        away: whether the page shows something else than the task that was set.
        read: the question whose result was read.
        paused: whether an exercise was open when somebody began to lead.
    """
    poll = room.poll if room.poll is not None and room.poll.id != read else None
    quiet = mode == "free" and poll is None and not room.problem
    return render(
        "room/student_bar",
        room=room,
        mode=mode,
        lead=_mode(room, mode, guest=True),
        poll=poll,
        quiet=quiet,
        stays=STAYS,
        task=task,
        mark=_own_mark(room)[0],
        open_tab=open_tab,
        away=away and mode == "free",
        hand=bool(room.seat and room.seat.hand),
        paused="Task paused" if task is not None else "Exercise paused" if paused else "",
    )


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
    return render("room/lead", room=room, count=students(Class.of(room).came))


def join_html(room: RoomView, now: float) -> str:
    """Code, QR code, and when the room ends."""
    return render("room/join", room=room, code=show_code(room.code) if room.code else "", left=_left(room, now))


def tools_html(room: RoomView, wall: bool, armed: bool) -> str:
    """The wall's button, how the students are doing, and a way to clear the list of those who have never come.

    Args:
        armed: whether that button was pressed once.
    """
    members = Class.of(room)
    unseen = sum(not one.came for one in members.all)
    return render(
        "room/tools",
        room=room,
        wall=wall,
        count=students(members.came),
        facts=members.facts(room),
        armed=armed,
        unseen=unseen if unseen >= MANY else 0,
    )


def seat_html(
    room: RoomView, seat: SeatView | None, looked: str, armed: bool, exercises: Exercises, sent: SentExercises
) -> str:
    """One student, and what can be done."""
    if seat is None or room.closed:
        return ""
    shown = room.shown is not None and room.shown.seat == seat.id
    return render(
        "room/seat",
        room=room,
        seat=seat,
        looked=looked == seat.id,
        shown=shown,
        armed=armed,
        named=bool(shown and room.shown and room.shown.alias),
        row=_row(seat, room, exercises, sent),
    )


def list_html(room: RoomView, picked: str, exercises: Exercises, sent: SentExercises) -> tuple[str, str]:
    """All students, who needs the teacher first: down to the picked one, whose card follows, and the rest."""
    members = sorted(room.seats, key=lambda seat: (standing(seat, room).rank, seat.hand))
    place = next((i + 1 for i, seat in enumerate(members) if seat.id == picked), len(members))
    rows = [_row(seat, room, exercises, sent) for seat in members]
    above = render("room/students", rows=rows[:place], picked=picked, empty=not members)
    return above, render("room/students", rows=rows[place:], picked="", empty=False) if rows[place:] else ""


def _row(seat: SeatView, room: RoomView, exercises: Exercises, sent: SentExercises) -> dict[str, object]:
    """One student in the list."""
    found = standing(seat, room)
    symbol, color = PROGRESS[found.progress] if found.progress else ("", "")
    if not found.here:
        symbol, color = (symbol, color) if found.progress in ("solved", "gave up") else (AWAY, "")
    wrong = found.progress in ("stuck", "at it", "gave up") and found.work.tries
    return {
        "seat": seat,
        "hand": found.hand,
        "driven": found.driven,
        "symbol": symbol,
        "color": color,
        "away": not found.here,
        "words": " · ".join(_words(seat, room, found, exercises)),
        "answer": sent.said(found.exercise, found.work.seed, str(found.work.answer or "")) if wrong else "",
        "verdict": found.work.verdict if wrong else "",
    }


def _words(seat: SeatView, room: RoomView, found: Standing, exercises: Exercises) -> list[str]:
    if not found.came:
        return [found.presence]
    words: list[str] = [] if found.here else [found.presence]
    if found.driven:
        words.append(f"drives {found.driven}")
    if found.hand:
        words.append("hand up")
    if found.progress:
        words.append(found.progress)
        if found.work.tries:
            words.append(tries(found.work.tries))
    if found.here:
        words += _place(seat, room, found, exercises)
    return words


def _place(seat: SeatView, room: RoomView, found: Standing, exercises: Exercises) -> list[str]:
    """What a student who is here has open beside the task."""
    if found.presence == "following":
        return ["follows"]
    place = ["stopped following"] if room.follow or room.shown is not None else []
    exercise = exercises.get(seat.task) if seat.task else None
    if room.task is None or found.elsewhere:
        place.append("at the arm" if exercise is None else exercise.title)
    return place


@dataclass(frozen=True)
class Class:
    """How all students are doing, and how many there are of each kind."""

    all: tuple[Standing, ...]

    @classmethod
    def of(cls, room: RoomView) -> Class:
        """Those of a room, in the order of joining."""
        return cls(tuple(standing(seat, room) for seat in room.seats))

    @property
    def came(self) -> int:
        """How many have ever come: the others do not count."""
        return sum(one.came for one in self.all)

    @property
    def hands(self) -> int:
        """How many hands are up."""
        return sum(one.hand for one in self.all)

    def at(self, progress: Progress) -> int:
        """How many have come that far."""
        return sum(one.came and one.progress == progress for one in self.all)

    def being(self, presence: Presence) -> int:
        """How many follow, are away, …"""
        return sum(one.presence == presence for one in self.all)

    def facts(self, room: RoomView) -> list[tuple[tuple[str, str, str], int]]:
        """Symbol, words and colour with a number, for all that there is."""
        facts = [((HAND, "hand up", "amber"), self.hands)]
        facts += [((PROGRESS[each][0], each, PROGRESS[each][1]), self.at(each)) for each in URGENCY]
        if room.follow or room.shown is not None:
            facts += [(("▶", "following", "green"), self.being("following"))]
            facts += [(("", "by themselves", ""), self.being("by themselves"))]
        facts += [((AWAY, "away", ""), self.being("away")), (("", "not here yet", ""), self.being("not here yet"))]
        return [fact for fact in facts if fact[1]]


def task_html(
    room: RoomView,
    task: Exercise | None,
    exercises: Exercises,
    chosen: Exercise | None = None,
    units: Units = UNITS,
) -> str:
    """The form to send an exercise, and how many have solved the present one.

    Args:
        chosen: the exercise in the form; None: the first one.
        units: of the numbers in its text, which are those of a student who does not exist.
    """
    chosen = chosen or next((one for _, members in exercises.topics() for one in members), None)
    members = Class.of(room)
    return render(
        "room/task",
        room=room,
        task=task,
        topics=exercises.topics(),
        solved=members.at("solved"),
        count=members.came,
        chosen=chosen,
        preview="" if chosen is None else _preview(chosen, units),
    )


@lru_cache(maxsize=256)
def _preview(exercise: Exercise, units: Units) -> str:
    """The text of an exercise with some numbers; empty if it has none that are valid."""
    try:
        return exercise.variant(0).text(exercise.text, units)
    except VariantError:
        return ""


def course_title(room: RoomView) -> str:
    """The title of the course that was sent; empty: there is none."""
    return str(json.loads(room.course)["title"]) if room.course else ""


def course_html(room: RoomView, courses: Sequence[Course], task: Exercise | None) -> str:
    """The form to send a course, the course that was sent, and the task that sending would end."""
    return render("room/course", room=room, title=course_title(room), courses=courses, task=task)


def ask_html(room: RoomView, question: str, choices: tuple[str, ...]) -> str:
    """The form to ask a question."""
    if room.poll is not None:
        return ""
    return render("room/ask", question=question, choices=[*choices, "", ""][:4])


def end_html(room: RoomView, armed: bool) -> str:
    """The button that ends the room."""
    return render("room/end", room=room, armed=armed)


def teacher_bar(room: RoomView, looked: SeatView | None, wall: bool, open_tab: int) -> str:
    """What the teacher must see whatever tab is open.

    Args:
        open_tab: grows when the tab Class is to be opened.
    """
    hands = sorted((seat for seat in room.seats if seat.hand), key=lambda seat: seat.hand)
    members = Class.of(room)
    led = room.follow or room.shown is not None
    following = members.being("following")
    apart = [(members.being("by themselves"), "by themselves"), (members.being("away"), "away")]
    words = [f"{count} {what}" for count, what in apart if count] if led else []
    arms = sum(bool(seat.page) for seat in room.seats)
    return render(
        "room/teacher_bar",
        room=room,
        looked=looked,
        wall=wall,
        arms=arms,
        most=MOST,
        hands=hands,
        count=students(members.came),
        following=following,
        apart=words,
        stuck=members.at("stuck"),
        open_tab=open_tab,
    )


def _left(room: RoomView, now: float) -> str:
    """How long the room still lasts."""
    minutes = max(0.0, room.ends - now) / 60.0
    if minutes < 90:
        return f"{max(1, round(minutes))} minutes"
    return f"{round(minutes / 60)} hours" if minutes < 48 * 60 else f"{round(minutes / 1440)} days"
