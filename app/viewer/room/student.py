"""The tab *Class* of a student: who leads, the task, the question, the raised hand, and what is stored."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import NamedTuple

from app.classroom.clock import now
from app.classroom.views import NewAttempt, Recalled
from app.exercises import Exercise, ExerciseFileError, parse_exercise
from app.viewer.activity.activity import EXERCISES, REVIEW, GivenUp, Judged
from app.viewer.activity.context import ExerciseContext
from app.viewer.declared.panel import Html, Node
from app.viewer.panel.status import Notice
from app.viewer.room import views
from app.viewer.room.member import PRESS, Member, wanted
from app.viewer.room.sharing import LED_EVERY, STUDENT_EVERY
from app.viewer.room.submissions import Submissions
from app.viewer.session.state import PageState

TEACHER = "teacher"
STORED: Hashable = "stored"  # an answer is stored, or is not: the room may be as it was
JOIN_AGAIN = " Join a room to go on; the link of this page keeps what you have done."
FROZEN = "The teacher has frozen the class: look at the teacher’s screen."
FOLLOWING = "Your page follows the teacher, and so would what you switch on. Press Stop following first."


class SharedPage(NamedTuple):
    """Who leads, and the packed state of that page."""

    leader: str
    page: str


class Student(Member):
    """A student's page."""

    messages = frozenset({"go", "back", "hand", "vote", "read", "task"})

    def built(self) -> None:
        self.activity = self.stage.activity
        self._gone = False  # whether the student has stopped following
        self._leader_before = ""
        self._task_at: float | None = None
        self._over = False  # it was said that this page is no longer in the room
        self._first = True
        self._paused = ""  # where an exercise was open when somebody began to lead
        self._course: tuple[str, float] | None = None  # the room's, and when it was sent; None: not known yet
        self._open_tab = 0
        self._read = ""  # the question whose result was read
        # The exercise on show, `_gone` and what is driven, as the room was last sent them.
        self._sent_last: tuple[str, bool, str] | None = None
        self._answered: tuple[str, int] | None = None  # exercise and seed of the last answer
        self._submissions = Submissions(
            self.attendance.submit, lambda: self.stage.post(("news", self.key, STORED))
        )
        ticket = self.attendance.ticket
        place = ExerciseContext(f"seat {ticket.room} {ticket.seat}", self.attendance.secret(), seat=True)
        self.activity.take_seat(place, self)  # before what is stored of exercises in the browser is restored

    def handle(self, key: Hashable, value: object) -> None:
        if key == STORED:  # an answer that was sent twice is no news of the room, but this page has counted it
            self._take_room()
        super().handle(key, value)

    def apply_updates(self) -> None:
        if self.room.closed:
            self._end()
            return
        task, activity = self.activity.task, self.activity
        self._borrow()
        if self.room.seat is not None:
            activity.know(self.room.seat.work, bool(self._submissions.state.waiting))
        activity.task = None if self.room.task is None else activity.exercises.get(self.room.task.exercise)
        self._set_course(task if self.room.task is None else None)
        self._set_task()
        lead = self._lead
        if lead is None:
            if self.leader:
                frozen = Notice("advice", "Frozen", FROZEN)
                alone = Notice("hand", "You work by yourself", "Nobody leads the class now.")
                self.page.status.show(frozen if self.frozen else alone)
            self.free()
            self._resume(self._gone)
            self._leader_before, self._gone = "", False
            return
        if lead.leader != self._leader_before or self.frozen:
            self._gone = False
        self._leader_before = lead.leader
        if not self._gone:
            before = None if self.leader else self.page.snapshot()
            self._pause()
            self.follow(lead.leader, lead.page, "What the class shows", before)

    def _borrow(self) -> None:
        """Have the exercise that the teacher wrote, if it is the task."""
        text = "" if self.room.task is None else self.room.task.own
        if not text or (self.activity.lent is not None and self.activity.lent.source == text):
            return
        try:
            self.activity.lent = parse_exercise(text, "task", self.stage.services.store.get)
        except ExerciseFileError as error:  # of a service with other arms
            self.page.status.show(Notice("error", "The task cannot be used", str(error)))
            return
        self.activity.stock()
        self.activity.changed()

    def _end(self) -> None:
        """The seat was removed, or the room has ended: nobody leads this page, and its work stays."""
        self.free()
        if not self._over:
            self._over = True
            self.page.status.show(Notice("advice", views.MODES["closed"][1], self.room.closed))

    @property
    def _lead(self) -> SharedPage | None:
        room = self.room
        if room.seat is None:
            return None
        if room.shown is not None:
            mine = room.shown.seat == room.seat.id
            return None if mine or not room.shown.page else SharedPage(room.shown.seat, room.shown.page)
        return SharedPage(TEACHER, room.page) if room.follow and room.page else None

    @property
    def frozen(self) -> bool:
        """Whether the student may not act: while the teacher is away, nobody is kept."""
        return self.room.frozen and not self.room.teacher_away and not self.room.closed

    def _set_task(self) -> None:
        """Open a task that is new."""
        task, exercise, activity = self.room.task, self.activity.task, self.activity
        at = None if task is None else task.at
        first, self._first = self._first, False
        if at == self._task_at:
            return
        self._task_at = at
        if exercise is None:
            return
        if first and (activity.practice.record(exercise).closed or activity.exercise == exercise):
            return
        self.free()
        self._gone = True
        self.stop_driven("your teacher has sent a task")
        self._open_task()
        self.page.status.show(Notice("hand", "A task from your teacher", exercise.title))

    def _pause(self) -> None:
        """While somebody leads, no exercise stands beside another arm."""
        if self.activity.opens_exercise:
            self._paused = self.activity.lesson or ""
            self.page.lessons.open(None)

    def _resume(self, gone: bool) -> None:
        """Nobody leads any more: open the exercise again.

        Args:
            gone: whether the student had stopped following, and may have opened something else.
        """
        paused, self._paused = self._paused, ""
        if not paused or (gone and self.activity.lesson is not None):
            return
        before = self._arm
        self.stop_driven("nobody leads the class now, and your exercise is open again")
        self.page.lessons.open(paused)
        if self._arm != before:
            self.follower.drop_obstacles()
        self._open_tab += 1

    @property
    def _arm(self) -> tuple[str, bytes]:
        """The arm and where it is heading."""
        return self.page.arm.robot.id, self.page.arm.goal.tobytes()

    def _set_course(self, replaced: Exercise | None) -> None:
        """Open a course that is new.

        Args:
            replaced: the exercise of the task that it has ended.
        """
        packed, lessons, first = self.room.course, self.page.lessons, self._course is None
        course = packed, self.room.course_at
        if course == self._course:
            return
        self._course = course
        fresh = lessons.courses.receive(packed, self.room.exchanged)
        if not packed or (first and not fresh):
            return
        self.free()
        self._gone = True
        self.stop_driven("your teacher has sent a course")
        lessons.open(lessons.courses.key)
        self._open_tab += 1
        over = "" if replaced is None else f". The task “{replaced.title}” is over; your answers stay stored."
        self.page.status.show(Notice("hand", "A course from your teacher", views.course_title(self.room) + over))

    def _open_task(self, again: bool = False) -> None:
        """Open the task; `again`: where it is open already, only show it."""
        task, lessons = self.room.task, self.page.lessons
        if task is not None and again and self.activity.exercise == self.activity.task:
            self._open_tab += 1
        elif task is not None:
            if self.activity.lesson != EXERCISES:
                lessons.open(EXERCISES)
            self.activity.leave_item()
            before = self._arm
            lessons.exercises.open(task.exercise)
            if self._arm != before:
                self.follower.drop_obstacles()
            self._open_tab += 1

    def submit(self, judged: Judged) -> None:
        verdict = judged.verdict
        self._answered = judged.exercise.id, judged.seed
        attempt = NewAttempt(
            exercise=judged.exercise.id,
            seed=judged.seed,
            answer=judged.answer,
            verdict=verdict.reason,
            score=1.0 if verdict.right else min(max(verdict.credit, 0.0), 1.0),
            started=now() - judged.seconds,
            cause=verdict.cause,
        )
        if judged.sending:  # sent again after a lost connection, it is the same attempt
            name = f"{self.attendance.ticket.seat} {judged.exercise.id} {judged.seed} {judged.sending}"
            attempt = replace(attempt, id=hashlib.sha256(name.encode()).hexdigest()[:16])
        self._submissions.add(attempt)
        self.activity.say("Storing the answer …")

    def tell_recalled(self, more: Recalled) -> None:
        self.attendance.tell_recalled(more)

    def give_up(self, one: GivenUp) -> bool:
        if self.room.closed:
            return True
        attempt = NewAttempt.given_up(one.exercise.id, one.seed, now() - one.seconds)
        return self.try_to(lambda: self.attendance.submit(attempt))

    def _note(self) -> None:
        """Say below the verdict whether the answers are stored; of another exercise only what is not."""
        activity, sent = self.activity, self._submissions.state
        if not (sent.stored or sent.waiting or sent.problem):
            return
        if sent.problem:
            text = (
                f"Not stored yet: {sent.problem} Kinboard tries again."
                if sent.waiting
                else f"Not stored: {sent.problem}"
            )
        elif sent.waiting:
            text = "Storing the answer …"
        else:
            at = activity.exercise
            here = at is not None and (at.id, activity.practice.seed_of(at)) == self._answered
            text = "✓ Stored for your teacher." if here else ""
        activity.say(text)

    # Member

    @property
    def share_every(self) -> float:
        return LED_EVERY if self.leader else STUDENT_EVERY

    def shared_state(self) -> PageState | None:
        if self.room.closed:
            return None
        self._tell()
        state = self.page.snapshot()
        return PageState(
            robot=state.robot,
            own=state.own if state.own is not None and state.own.robot.id == state.robot else None,
            q=state.q,
            target=state.target,
            task=state.task,
            locks=state.locks,
        )

    def _tell(self) -> None:
        """Say what this page shows, if it is something else: of two tabs, the one that has changed last counts."""
        at = self.activity.exercise
        shows = "" if at is None else at.id, self._gone and self.leader == "", self.driven
        if shows != self._sent_last and self.attendance.room.seat is not None:
            self._sent_last = shows
            self.attendance.tell_task(shows[0])
            self.attendance.tell_gone(shows[1])
            self.attendance.tell_driven(shows[2])

    def refusal(self, act: str) -> str:
        if self.room.closed and self.page.guest:
            return self.room.closed + JOIN_AGAIN
        if self.frozen:
            return FROZEN
        if self.leader and act == PRESS:
            return FOLLOWING
        if self.leader:
            self.free()
            self._gone = True
            self.page.status.show(
                Notice("hand", "You stopped following", "Press Follow again to return to the teacher.")
            )
        return ""

    def press(self, kind: str, name: str, value: object) -> None:
        room = self.room
        match kind:
            case "go" if not self.frozen:
                self.free()
                self._gone = True
            case "back":
                self._gone = False
                self.follower.begin()
                self.apply_updates()
            case "hand" if room.seat is not None:
                self.try_to(lambda: self.attendance.raise_hand(wanted(value, bool(room.seat and room.seat.hand))))
            case "vote" if type(value) is int:
                self.try_to(lambda: self.attendance.vote(value))
            case "read" if room.poll is not None and not room.poll.open:
                self._read = room.poll.id
            case "task" if not self.frozen:
                self.free()
                self._gone = True
                self._open_task(again=True)

    def panel(self) -> Sequence[Node]:
        task, sent = self.activity.task, self._submissions.state
        head = views.student_html(self.room, self.mode, task, sent, self.page.guest)
        question = views.poll_html(self.room.poll, teacher=False)
        texts = head, question, views.stored_html(self.room, now())
        return [Html(str, (text,)) for text in texts]

    def refreshed(self) -> None:
        self._tell()
        self._note()

    def bar(self) -> str:
        away = self.activity.task is not None and self.activity.exercise != self.activity.task
        return views.student_bar(
            self.room, self.mode, self._open_tab, self.activity.task, away, self._read, self._paused != ""
        )

    def state(self) -> dict[str, object]:
        return {"paused": True if self._paused == EXERCISES else self._paused} if self._paused else {}

    def restore(self, state: dict[str, object]) -> None:
        if self._first:  # as the page was stored; undo changes nothing about who leads
            paused = state.get("paused")
            self._paused = EXERCISES if paused is True else REVIEW if paused == REVIEW else ""

    @property
    def mode(self) -> views.Mode:
        """Who leads this page, for the words in tab and bar."""
        room, lead = self.room, self._lead
        if room.closed:
            return "closed"
        if room.teacher_away and (room.follow or room.shown is not None or room.frozen):
            return "paused"
        if room.shown is not None and room.seat is not None and room.shown.seat == room.seat.id:
            return "shown"
        if self.frozen and lead is None:
            return "frozen"
        if lead is None:
            return "free"
        return "gone" if self._gone else "led"

    def on_leave(self) -> None:
        self._submissions.close()
        super().on_leave()
