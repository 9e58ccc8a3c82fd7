"""What a link of a learning platform opens: an exercise or a course. A link names it in a custom parameter."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, Literal

from app.classroom.courses import Course, Courses, to_data
from app.classroom.lti.launches import Launch, LaunchRefused

Kind = Literal["exercise", "course"]


@dataclass(frozen=True)
class Content:
    """One exercise or course.

    Attributes:
        key: the exercise's id, or the course's name (`Courses.named`).
        exercises: of the course; a score is how many of them are solved.
        packed: the course as rooms keep it.
        own: the texts of the exercises that it brings along, as rooms keep these.
    """

    kind: Kind
    key: str
    title: str
    exercises: tuple[str, ...] = ()
    packed: str = ""
    own: dict[str, list[str]] = field(default_factory=dict)

    @property
    def most(self) -> int:
        """The highest score; 0: there is none, because a course has lessons only."""
        return 1 if self.kind == "exercise" else len(self.exercises)

    @property
    def name(self) -> str:
        """Tells it from all others, such as ``course:first-steps``."""
        return f"{self.kind}:{self.key}"

    def item(self, launch_url: str) -> dict[str, Any]:
        """As an item of an answer to deep linking: a link, and one column of the gradebook."""
        item: dict[str, Any] = {
            "type": "ltiResourceLink",
            "title": self.title,
            "url": launch_url,
            "custom": {self.kind: self.key},
        }
        if self.most:
            resource = self.key if self.kind == "exercise" else self.name
            item["lineItem"] = {"label": self.title, "scoreMaximum": self.most, "resourceId": resource}
        return item

    def state(self, at: float) -> dict[str, Any]:
        """What a new room begins with, as if the teacher had sent it at this time."""
        if self.kind == "exercise":
            return {"task": {"exercise": self.key, "at": at}}
        return {"course": self.packed, "course_at": at, **({"own": self.own} if self.own else {})}


def contents_of(courses: Courses) -> list[Content]:
    """The courses of a service and its exercises."""
    found = [
        Content("course", key, course.title, course.exercises, json.dumps(to_data(course)), _own(course))
        for key, course in courses.named.items()
    ]
    return found + [Content("exercise", one.id, one.title) for one in courses.exercises.all]


def _own(course: Course) -> dict[str, list[str]]:
    return {one.exercise.id: [one.text] for one in course.own}


def content_of(launch: Launch, contents: Sequence[Content]) -> Content | None:
    """What the link of a launch opens; None: it names nothing. Raises `LaunchRefused`."""
    named: dict[Kind, str] = {"course": launch.course, "exercise": launch.exercise}
    given = {kind: key for kind, key in named.items() if key}
    if len(given) > 1:
        raise LaunchRefused("The link has the custom parameters course and exercise; it may have one of them.")
    for kind, key in given.items():
        known = {content.key: content for content in contents if content.kind == kind}
        if key in known:
            return known[key]
        near = get_close_matches(key, known, 2) or list(known)[:3]
        raise LaunchRefused(
            f"The link names the {kind} {key[:100]!r}, which this service does not have. "
            f"Its custom parameter {kind} may be, for example, {' or '.join(near)}."
        )
    return None
