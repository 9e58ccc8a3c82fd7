"""Courses: an ordered list of lessons and exercises with short texts, as a TOML file or in a link.

Pure: no page, no storage. A course names exercises and lessons. It may bring exercises along that a teacher has
written; in links and pages these are sealed, so that nothing there contains an answer.
"""

from app.classroom.courses.course import Course, Item, Own, parse_item
from app.classroom.courses.files import Courses, course_of, load_course, parse_course, parsed, to_data
from app.classroom.courses.sealing import Seal
from app.classroom.courses.sent import SentExercises

__all__ = [
    "Course",
    "Courses",
    "Item",
    "Own",
    "Seal",
    "SentExercises",
    "course_of",
    "load_course",
    "parse_course",
    "parse_item",
    "parsed",
    "to_data",
]
