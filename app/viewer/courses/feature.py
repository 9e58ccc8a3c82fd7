"""Courses in a visitor's page. ``static/lesson.js`` sends what is pressed and typed there."""

from __future__ import annotations

import json
import re
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from app.classroom.courses import Course, Item, parse_course, parse_item, to_data
from app.classroom.courses.course import MOST_ITEMS
from app.classroom.courses.files import MOST_IN_FILE
from app.classroom.results import read_code
from app.classroom.results.codes import clean_alias
from app.viewer.activity.activity import EXERCISES, REVIEW
from app.viewer.courses import views
from app.viewer.courses.views import CourseView
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import OpenableFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.panel import Html, Node
from app.viewer.feature import Stage, save_file, sent_text
from app.viewer.lessons import LESSONS
from app.viewer.panel import update_html
from app.viewer.panel.part import Block
from app.viewer.panel.status import Notice
from kin import InputError, KinematicsError
from kin.files.numbers import index_of
from kin.parsing import to_toml


@dataclass(frozen=True)
class CourseSettings(Settings):
    """What is shown of courses besides the open one."""

    view: CourseView = memory(CourseView(), renew=False)


class CourseFeature(OpenableFeature[CourseSettings, Facts[CourseSettings]]):
    """The courses of the service, or the open one: followed or edited.

    Args:
        bar: stands above whatever the tab *Learn* shows, also while the rest is hidden.
    """

    key = "course"
    title = "Courses"
    about = "New here? Begin with the course First steps. Make your own courses, and check results."
    settings_of, facts_of = CourseSettings, Facts
    messages = frozenset(
        {
            *("pick", "new", "close", "upload", "edit", "finish", "set", "up", "down", "delete", "answers"),
            *("go", "next", "back", "list", "download", "link", "fields", "recall"),
        }
    )

    def __init__(self, stage: Stage, bar: Block) -> None:
        self._bar = bar
        self._courses, self._progress = stage.activity.courses, stage.activity.progress
        super().__init__(stage)

    def show(self) -> None:
        """Show the list of the courses, or of the steps of the open one."""
        self._progress.at = None
        super().show()

    # Declared

    def panel(self) -> Sequence[Node]:
        view, progress, known = self.settings.view, self._progress, self.stage.activity.exercises
        update_html(self._bar, views.bar_html(progress, known))
        if not self.shown:
            return ()
        if progress.course is None:
            return [Html(str, (views.chooser_html(self._courses, view, progress.seated),))]
        self._ask_back()
        return [Html(str, (views.course_html(progress, known, self._courses.all, view),))]

    # In a room

    def receive(self, packed: str, exchanged: bool) -> bool:
        """Open a course that was sent, as JSON; returns whether it was not open already.

        Args:
            packed: empty: the course of the room is over, and stays open.
            exchanged: whether what it compares comes in the other order.
        """
        if not packed:
            self.stage.activity.sent = None
            return False
        course = self._progress.read(json.loads(packed))
        if exchanged:
            course = course.exchanged()
        self.stage.activity.sent = course
        self.stage.activity.stock()
        if course == self._progress.course:
            return False
        self._open(course)
        self.schedule()
        return True

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        if not isinstance(key, tuple):
            raise InputError("course", key, "a control of the course")
        name, *rest = key
        if name in ("next", "back", "list"):
            self._walk(name)
        elif self.shown:
            self._look(error="", errs="")
            try:
                self._act(name, rest, value)
            except KinematicsError as error:
                text = str(error)
                self._look(error=f"{text[:1].upper()}{text[1:]}.", errs=self.settings.view.errs or "file")

    def _look(self, **values: Any) -> None:
        """Show something else of the course."""
        self.change(view=replace(self.settings.view, **values))

    def _act(self, name: object, rest: list[object], value: object) -> None:
        view, progress = self.settings.view, self._progress
        match name, value:
            case "pick", int() if 0 <= value < len(self._courses.all):
                self._open(self._courses.all[value])
            case "new", _:
                self._open(Course("My course"))
                self._look(editing=True)
            case "close", _:
                self.change(view=CourseView())
                progress.course = progress.at = None
                self.stage.activity.enter_course()
            case "upload", _:
                file, text = sent_text(value, MOST_IN_FILE)
                self._open(parse_course(text, self._courses.exercises, file, self._courses.find))
            case "edit" | "finish", _:
                self._look(editing=name == "edit", link="", code="")
            case "go", int():
                self._go(progress.go(value))
            case "recall", _ if rest and rest[0] in progress.back:
                self.stage.post(("feature", REVIEW, ("open", str(rest[0]), 0)), None)
            case "fields", [[str(text)]]:
                self._take(rest[0], text)
            case (("set" | "up" | "down" | "delete" | "answers"), _) if view.editing:
                self._change(str(name), rest, value)
            case "download", _:
                self._download()
            case "link", _:
                self._look(link="" if view.link else self._link())
            case _:
                raise InputError("course", name, "a control of the course")

    def _open(self, course: Course) -> None:
        self.change(view=CourseView())
        self._progress.open(course)
        self.stage.activity.enter_course()

    def _walk(self, name: object) -> None:
        progress = self._progress
        if progress.course is None:
            return
        item = None
        if name == "next":
            item = progress.next()
        elif name == "back" and progress.at:
            item = progress.go(progress.at - 1)
        if item is None:
            self.stage.post("lesson", self.title)
        else:
            self._go(item)

    def _go(self, item: Item) -> None:
        """Show an item: its lesson or exercise opens after this event."""
        stage = self.stage
        if item.kind == "exercise":
            stage.post(("feature", EXERCISES, ("open", item.key, 0)), None)
            return
        if item.robot and stage.arm.now.robot.id != item.robot:
            stage.robots.show(self._courses.find(item.robot))
        stage.post("lesson", next(lesson.title for lesson in LESSONS if lesson.key == item.key))

    def _take(self, field: object, text: str) -> None:
        """A typed code is to be checked, or an alias gets a code."""
        if field == "alias":
            self._look(errs="alias", code="")
            self._progress.alias = clean_alias(text)
            self._look(code=self._progress.code(self.stage.activity.secret))
        else:
            self._look(errs="check", checked=None, typed=text[:500])
            self._look(checked=read_code(text, self.stage.activity.secret()))

    def _change(self, name: str, rest: list[object], value: object) -> None:
        course = self._progress.course
        if course is None:
            return
        match name, value:
            case "set", str(text):
                changed = self._set(course, str(rest[0]), " ".join(text.split()))
            case "answers", _:
                changed = replace(course, answers=not course.answers)
            case "up" | "down" | "delete", int() if 0 <= value < len(course.items):
                if name == "delete":
                    changed = course.removed(value)
                else:
                    changed = course.moved(value, value - 1 if name == "up" else value + 1)
            case _:
                raise InputError("course", name, "a control of the editor")
        self._progress.edit(changed)
        self.stage.activity.enter_course()
        self._look(link="")

    def _set(self, course: Course, what: str, text: str) -> Course:
        """A typed text, or one more item."""
        known = self.stage.activity.exercises
        if what == "title":
            return replace(course, title=text or "My course")
        if what == "about":
            return replace(course, about=text)
        if what == "add":
            item = parse_item(text)
            if item is None or len(course.items) >= MOST_ITEMS:
                raise InputError("item", text, f"a lesson or an exercise; at most {MOST_ITEMS} in a course")
            exercise = known.get(item.key) if item.kind == "exercise" and known.is_own(item.key) else None
            return course.added(item) if exercise is None else course.bringing(exercise)
        name, _, index = what.partition("-")
        place = index_of(index, len(course.items))
        if place is None:
            raise InputError("item", what, "the index of an item")
        if name == "before":
            after = course.items[place]
            if after.kind != "exercise":
                raise InputError("before", text, "a step with an exercise")
            return course.comparing(text, after.key)
        if name == "note":
            return course.changed(place, note=text)
        return course.changed(place, title=text)

    def _download(self) -> None:
        course = self._progress.course
        if course is None:
            return
        stem = re.sub(r"[^a-z0-9]+", "-", course.title.lower()).strip("-") or "course"
        save_file(self.stage, f"{stem}.toml", to_toml(to_data(course)))

    def _link(self) -> str:
        course = self._progress.course
        if course is None:
            return ""
        return self.stage.links.to({self.key: {"course": self._progress.packed(course)}}, self.key)

    # The page

    def step_name(self, key: Hashable) -> str:
        return "Course"

    def state(self) -> dict[str, object]:
        return self._progress.state()

    def restore(self, state: dict[str, object]) -> None:
        try:
            self._progress.restore(state)
        except KinematicsError as error:
            self.stage.status.show(Notice("error", "The course cannot be used", str(error)))
        self.stage.activity.enter_course()
        if self.shown:
            self._progress.at = None
        self._begin()

    def on_activity(self) -> None:
        self.schedule()

    def _ask_back(self) -> None:
        activity = self.stage.activity
        missed = activity.review.missed.values()
        asked = {one.key for one in missed if not one.lesson}, {one.lesson for one in missed}
        self._progress.ask_back(*asked, lambda one: activity.reveals(one) and one != activity.task)
