"""Lessons: one idea each, one on show at a time.

Adding a lesson is one module with a :class:`~app.viewer.lessons.guide.lesson.Lesson`, which says what it teaches
and asks, and one row here.
"""

from __future__ import annotations

from app.viewer.lessons.dh import DHLesson
from app.viewer.lessons.equations import EquationsLesson
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.inverse import InverseLesson
from app.viewer.lessons.numeric import NumericLesson
from app.viewer.lessons.postures import Postures
from app.viewer.lessons.redundancy import RedundancyLesson
from app.viewer.lessons.rotations import RotationsLesson
from app.viewer.lessons.screws import ScrewsLesson
from app.viewer.lessons.trajectories import TrajectoriesLesson
from app.viewer.lessons.velocity import VelocityLesson

# In the order of a course.
LESSONS: tuple[type[Lesson], ...] = (
    RotationsLesson,
    DHLesson,
    ScrewsLesson,
    EquationsLesson,
    InverseLesson,
    Postures,
    NumericLesson,
    RedundancyLesson,
    VelocityLesson,
    TrajectoriesLesson,
)
