"""Courses: an ordered list of lessons and exercises with short texts, as a TOML file or in a link.

Pure: no page, no storage. A course names exercises and lessons; it contains no answers.
"""

from app.classroom.courses.course import Course, Item, parse_item
from app.classroom.courses.files import Courses, course_of, load_course, parse_course, to_data, to_toml

__all__ = [
    "Course",
    "Courses",
    "Item",
    "course_of",
    "load_course",
    "parse_course",
    "parse_item",
    "to_data",
    "to_toml",
]
