"""Exercises: text files with a question; an exercise, a seed and an answer give a verdict.

Pure: no page, no clock, no storage. A file is read by `files`, drawn by `exercise` for a seed, asked and judged by
one of the `kinds`. What is asked holds nothing from which the answer could be read; the answer is computed where
the verdict is, and leaves only in `Exercise.solution`.
"""

from app.exercises.contract import Kind
from app.exercises.exercise import TOPICS, Exercise, VariantError
from app.exercises.fields import ExerciseFileError
from app.exercises.files import builtin_exercises, load_exercise, load_folder, parse_exercise
from app.exercises.questions import Asked, Verdict
from app.exercises.shelf import Exercises, Lessons, Shelf
from app.exercises.trial import Student, Trial, tried
from app.exercises.variant import Variant

__all__ = [
    "TOPICS",
    "Asked",
    "Exercise",
    "ExerciseFileError",
    "Exercises",
    "Kind",
    "Lessons",
    "Shelf",
    "Student",
    "Trial",
    "Variant",
    "VariantError",
    "Verdict",
    "builtin_exercises",
    "load_exercise",
    "load_folder",
    "parse_exercise",
    "tried",
]
