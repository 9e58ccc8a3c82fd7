"""The tab *Class* of the teacher: join code, who leads, tasks, a question, the students, the wall."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace

from app.classroom.clock import now
from app.classroom.courses import Course, SentExercises, parsed
from app.classroom.standing import standing
from app.classroom.views import RoomView, SeatView, in_one_line
from app.exercises import Exercise, ExerciseFileError
from app.viewer.declared.panel import Folder, Html, Node
from app.viewer.own_arm import OwnArm
from app.viewer.panel.status import Notice
from app.viewer.room import views
from app.viewer.room.following import decoded, shared
from app.viewer.room.member import Member, wanted
from app.viewer.room.sharing import LEADER_EVERY
from app.viewer.room.wall import MOST, SmallArm, Wall
from app.viewer.room.wall import NAME as WALL
from app.viewer.session.history import RESULT
from app.viewer.session.state import PageState
from app.viewer.viser_patches import SceneFilter
from kin import InputError, Robot
from kin.files.numbers import index_of

logger = logging.getLogger("kinboard.classroom")

QUESTION = "Elbow up or down?"
CHOICES = ("Elbow up", "Elbow down")


class Teacher(Member):
    """The teacher's page."""

    led_why, returned_why = "this page shows a student’s arm", "this page goes back to where its own arm was"
    messages = frozenset(
        {
            *("follow", "freeze", "fields", "untask", "uncourse", "close", "unask", "look", "return", "show"),
            *("hide", "pick", "set", "find", "remove", "sweep", "lower", "wall", "end"),
        }
    )

    def built(self) -> None:
        self._picked = ""  # the student whose details are open
        self._open_tab = 0
        self._chosen: Exercise | None = None  # the exercise in the form of the task
        self._own: Mapping[str, tuple[str, ...]] = {}  # the texts of own exercises that were sent, by id
        self._wall: Wall | None = None
        self._reopens = False  # the wall, which was on show before a reload
        self._filter: SceneFilter | None = None  # before all but the wall
        self._before: PageState | None = None  # the own page while a student's is on show, or the wall

    def apply_updates(self) -> None:
        room = self.room
        if room.own != self._own:
            self._keep(room.own)
        shown = "" if room.shown is None else room.shown.seat
        if self.leader and (room.closed or self._seat(self.leader) is None):
            self._return()
        if shown and shown != self.leader:
            self._look(shown)
        elif self.leader:
            seat = self._seat(self.leader)
            if seat is not None and seat.page:
                self.follow(seat.id, seat.page)
        if room.closed and self._wall is not None:
            self._show_wall(False)

    def _keep(self, own: Mapping[str, tuple[str, ...]]) -> None:
        """Know the own exercises that were sent to the room as they are now, perhaps from another page."""
        self._own, activity = own, self.page.activity
        found = []
        for *_, text in own.values():
            try:
                found.append(parsed(text, self.stage.services.store.get))
            except ExerciseFileError as error:  # its arm is gone
                logger.info("a teacher's page does without an exercise of its room: %s", error)
        activity.kept = tuple(found)
        activity.stock()
        activity.changed()

    # Controls

    def press(self, kind: str, name: str, value: object) -> None:
        room, attendance = self.room, self.attendance
        match kind:
            case "follow":
                attendance.set_follow(wanted(value, room.follow))
            case "freeze":
                attendance.set_frozen(wanted(value, room.frozen))
            case "task":
                self._send_task(_texts(value))
            case "set" if name == "task":
                self._chosen = self.page.activity.exercises.get(value)
            case "untask":
                attendance.send_task(None)
            case "course":
                self._send_course(_texts(value)[0])
            case "uncourse":
                attendance.send_course("")
            case "ask":
                question, *choices = _texts(value)
                self.try_to(lambda: attendance.open_poll(question, [each for each in choices if each.strip()]))
            case "close":
                attendance.close_poll()
            case "unask":
                attendance.remove_poll()
            case "wall":
                self._show_wall(wanted(value, self._wall is not None))
            case "return":
                if room.shown is not None:
                    attendance.show_seat(None)
                self._return()
            case "sweep" if self.twice("sweep"):
                self.try_to(self._sweep)
            case "end" if self.twice("end"):
                self.try_to(attendance.end_room)
            case "rename":
                self._press_seat(kind, self._picked, value)
            case _ if self._seat(name) is not None:
                self._press_seat(kind, name, value)
        self.room = attendance.room

    def _press_seat(self, kind: str, seat: str, value: object) -> None:
        """A control that concerns one student."""
        attendance = self.attendance
        match kind:
            case "pick":
                self._picked = "" if self._picked == seat else seat
            case "find":
                self._picked = seat
                self._open_tab += 1
            case "look":
                self._picked = seat
                self._look(seat)
            case "show":
                attendance.show_seat(seat, named=bool(value))
                self._look(seat)
            case "hide":
                attendance.show_seat(None)
                self._return()
            case "lower":
                attendance.lower_hand(seat)
            case "rename":
                self.try_to(lambda: self._rename(seat, in_one_line(_texts(value)[0])))
            case "remove" if self.twice(("remove", seat)):
                if self.try_to(lambda: attendance.remove_seat(seat)):
                    self._picked = ""

    def _sweep(self) -> None:
        """Remove who has never come, and say who stays and why."""
        swept = self.attendance.remove_unseen()
        removed = f"{views.students(swept.count)} removed" if swept.count else "Nobody is removed"
        stay = f"Stay: {swept.words}" if swept.words else "Everybody else has come."
        self.page.status.show(Notice("hand" if swept.count else "advice", removed, stay))

    def _rename(self, seat: str, alias: str) -> None:
        """Give another alias, and say so if it got a number."""
        given = self.attendance.rename_seat(seat, alias)
        if given != alias:
            self.page.status.show(Notice("hand", f"Renamed to {given}", f"Another student is {alias}."))

    def _send_task(self, texts: list[str]) -> None:
        """Let all work on an exercise by themselves."""
        exercise = self.page.activity.exercises.get(texts[0])
        if exercise is None:
            raise InputError("task", texts[0], "the id of an exercise")
        self._chosen = exercise
        own = self.page.activity.exercises.is_own(exercise.id)
        self.attendance.send_task(exercise.id, exercise.source if own else "")
        self.page.status.show(Notice("hand", f"Sent: {exercise.title}", "All work on it by themselves now."))

    def _send_course(self, index: str) -> None:
        """Let all follow a course, each at an own pace."""
        offered = self._offered
        place = index_of(index, len(offered))
        if place is None:
            raise InputError("course", index, f"0 to {len(offered) - 1}")
        course = offered[place]
        own = {one.exercise.id: one.text for one in course.own}
        self.attendance.send_course(json.dumps(self.page.activity.progress.packed(course)), own)
        self.page.status.show(Notice("hand", f"Sent: {course.title}", "All follow it by themselves now."))

    @property
    def _offered(self) -> tuple[Course, ...]:
        return self.page.activity.offered

    # A student's arm instead of the own one

    def _seat(self, seat: str) -> SeatView | None:
        return next((each for each in self.room.seats if each.id == seat), None)

    def _look(self, seat_id: str) -> None:
        """Show a student's arm."""
        seat = self._seat(seat_id)
        if seat is None or not seat.page:
            self.page.status.show(
                Notice("advice", "Nothing to see yet", "This student’s page has not sent its arm.")
            )
            return
        if self._wall is not None:
            self._show_wall(False)
        if self._before is None:
            self._before = self.page.snapshot()
        self.follow(seat.id, seat.page)

    def _return(self) -> None:
        """Show the own arm again."""
        self.free()
        before, self._before = self._before, None
        if before is None:
            return
        stopped = self.stop_driven(self.returned_why)
        self.page.adopt(before)
        if before.camera is not None:
            self.page.camera.restore(before.camera)
        elif self.page.camera.chosen is not None:
            self.page.camera.aim(self.page.arm.scene.body, glide=True)
        if stopped is not None:
            self.page.status.show(stopped)  # what is shown has had words of its own

    # The wall

    def _show_wall(self, on: bool) -> None:
        page, camera = self.page, self.page.camera
        if on == (self._wall is not None):
            return
        if on:
            if self.leader:
                self._return()
            camera.look()
            page.numbers.hide_target()
            self._before = page.snapshot()
            self._filter = SceneFilter(page.client.scene, WALL)
            image = page.client.camera
            aspect = image.image_width / max(image.image_height, 1) or 1.6
            self._wall = Wall(
                page.client.scene, page.arm.scene.body, aspect, lambda seat: self.post(("look", seat))
            )
        elif self._wall is not None:
            self._wall.remove()
            self._wall = None
            camera.fit(())
        if not on:
            if self._filter is not None:
                self._filter.open()
                self._filter = None
            self._return()

    def on_activity(self) -> None:
        self.schedule()  # an open course may be sent

    def on_robot(self) -> None:
        super().on_robot()
        if self._wall is not None:  # another arm is on show than the one to return to
            self._before = None
            self._show_wall(False)

    def _draw_wall(self) -> None:
        if self._wall is not None and self._wall.show(self._arms()):
            camera = self.page.camera
            camera.fit((), self._wall.corners if len(self._wall.corners) else None)
            camera.aim(self.page.arm.scene.body, glide=True)

    def _arms(self) -> list[SmallArm]:
        arms = []
        for seat in self.room.seats:
            state = decoded(seat.page, self.page.services.store.robots) if seat.page else PageState()
            robot = self._robot(state)
            if robot is not None and state.q is not None:
                found = standing(seat, self.room)
                state_of = "away" if not found.here else found.progress or "none"
                arms.append(SmallArm(seat.id, seat.alias, robot, state.q, state_of, found.hand, found.driven))
        return arms[:MOST]

    def _robot(self, state: PageState) -> Robot | None:
        if state.own is not None and state.own.robot.id == state.robot:
            return state.own.robot
        return next((robot for robot in self.page.services.store.robots if robot.id == state.robot), None)

    # Member

    @property
    def share_every(self) -> float:
        return LEADER_EVERY

    def words(self, room: RoomView) -> RoomView:
        return super().words(room) if self._wall is None else room

    def shared_state(self) -> PageState | None:
        if self.room.closed or self.leader or self._before is not None:
            return None
        self.page.camera.look()
        return shared(replace(self.page.snapshot(), own=self._shown_own()), self.page.features)

    def _shown_own(self) -> OwnArm | None:
        own = self.page.robots.own
        return own if own is not None and own.robot.id == self.page.arm.robot.id else None

    def refusal(self, act: str) -> str:
        if self._wall is not None:
            return "Close the wall first."
        if self.leader:
            return "This is a student’s arm. Press Back to my arm first."
        return ""

    def state(self) -> dict[str, object]:
        return {} if self._wall is None and not self._reopens else {RESULT: True}

    def restore(self, state: dict[str, object]) -> None:
        if self.settings.bar is None:  # as the page was stored: undo neither opens nor closes the wall
            self._reopens = state.get(RESULT) is True

    def panel(self) -> Sequence[Node]:
        room, activity = self.room, self.page.activity
        exercises, courses = activity.exercises, activity.courses
        task = None if room.task is None else exercises.get(room.task.exercise)
        sent = SentExercises(courses.exercises, room.own, courses.find)
        above, below = views.list_html(room, self._picked, exercises, sent)
        armed = self.is_armed(("remove", self._picked))
        one = views.seat_html(room, self._seat(self._picked), self.leader, armed, exercises, sent)
        tools = views.tools_html(room, self._wall is not None, self.is_armed("sweep"))
        form = views.task_html(room, task, exercises, self._chosen, self.page.display.units)
        question = views.ask_html(room, QUESTION, CHOICES), views.poll_html(room.poll, teacher=True)
        folders = {
            "Join": [views.join_html(room, now())],
            "Students": [tools, above, one, below],  # one: below the student that it is about
            "Task": [form, views.course_html(room, self._offered, task)],
            "Question": question,
        }
        return [
            Html(str, (views.lead_html(room),)),
            *(Folder(title, _htmls(*texts), visible=not room.closed) for title, texts in folders.items()),
            Html(str, (views.end_html(room, self.is_armed("end")),)),
        ]

    def refreshed(self) -> None:
        if self._reopens:
            self._reopens = False
            self._show_wall(not self.room.closed)
            self.schedule()
        self._draw_wall()

    def bar(self) -> str:
        return views.teacher_bar(self.room, self._seat(self.leader), self._wall is not None, self._open_tab)


def _htmls(*texts: str) -> list[Node]:
    return [Html(str, (text,)) for text in texts]


def _texts(value: object) -> list[str]:
    """The typed texts of a form, at least one."""
    rows = value if isinstance(value, list) else []
    texts = [text for row in rows[:12] if isinstance(row, list) for text in row[:2] if isinstance(text, str)]
    if not texts:
        raise InputError("form", value, "rows of texts")
    return [text[:200] for text in texts]
