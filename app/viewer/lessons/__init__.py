"""Lessons: one idea each, one on show at a time.

Adding a lesson is one module with a :class:`~app.viewer.feature.Feature` and one row here.
"""

from __future__ import annotations

from app.viewer.feature import Feature
from app.viewer.lessons.dh import DHLesson
from app.viewer.lessons.equations import EquationsLesson
from app.viewer.lessons.postures import Postures
from app.viewer.lessons.redundancy import RedundancyLesson
from app.viewer.lessons.velocity import VelocityLesson

# In the order of a course.
LESSONS: tuple[type[Feature], ...] = (DHLesson, EquationsLesson, Postures, RedundancyLesson, VelocityLesson)
