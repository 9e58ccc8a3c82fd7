"""``kinboard check`` for course files."""

from __future__ import annotations

from pathlib import Path

from app.classroom.courses import Course, load_course, to_data
from app.cli.terminal import print_json
from app.exercises import Exercises
from app.shared.store import Store


def check_course(path: Path, robots: str | None, exercises: str | None, as_json: bool) -> int:
    """Validate a course file, and list its items."""
    find = Store(Path(robots) if robots else None).get
    known = Exercises(Path(exercises) if exercises else None, find)
    course = load_course(path, known, find)
    if as_json:
        return print_json(to_data(course))
    print("\n".join(_lines(course, known)))
    return 0


def _lines(course: Course, known: Exercises) -> list[str]:
    lines = [course.title, course.about or "No description.", ""]
    for number, item in enumerate(course.items, 1):
        exercise = known.get(item.key) if item.kind == "exercise" else None
        title = item.title or (item.key if exercise is None else exercise.title)
        lines.append(f"{number:2}  {item.kind:8}  {title}{f' ({item.robot})' if item.robot else ''}")
        lines += [f"{'':14}{line}" for line in item.note.splitlines()]
    exercises, lessons = len(course.exercises), sum(item.kind == "lesson" for item in course.items)
    hidden = "" if course.answers else "; answers are hidden until an exercise is solved"
    return [*lines, "", f"{counted(lessons, 'lesson')} and {counted(exercises, 'exercise')}{hidden}."]


def counted(count: int, what: str) -> str:
    """``1 lesson``, ``2 lessons``."""
    return f"{count} {what}{'s' * (count != 1)}"
