"""The lessons, by the keys that links, exercise files and course files use. This is the only list of them.

Adding one is a row here and a folder of this name in `app/viewer/lessons/`.
"""

from __future__ import annotations

from typing import Final

# In the order of a course.
LESSONS: Final = (
    "rotations",
    "dh",
    "screws",
    "equations",
    "inverse",
    "postures",
    "numeric",
    "redundancy",
    "velocity",
    "trajectories",
)
