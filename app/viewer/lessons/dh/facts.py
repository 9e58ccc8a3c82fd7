"""What the lesson "DH table step by step" knows: where the walk is, in both readings of the table."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from app.viewer.declared.facts import Facts
from app.viewer.lessons.dh.settings import DHSettings
from app.viewer.lessons.dh.steps import WalkState, place, reread
from kin import Robot, link_frames
from kin.transforms import Array


@dataclass(frozen=True, eq=False)
class DHFacts(Facts[DHSettings]):
    """See the module."""

    @cached_property
    def frames(self) -> Array:
        """The frames ``(rows, 4, 4)`` after each row."""
        return link_frames(self.robot, self.q)

    @cached_property
    def place(self) -> WalkState:
        """Where the walk is."""
        return place(self.robot, self.q, self.settings.at, self.frames)

    @property
    def other(self) -> Robot:
        """The arm of the same numbers in the other convention."""
        return reread(self.robot)

    @cached_property
    def other_frames(self) -> Array:
        """Its `frames`."""
        return link_frames(self.other, self.q)

    @cached_property
    def other_place(self) -> WalkState:
        """Where the walk is on that arm."""
        return place(self.other, self.q, self.settings.at, self.other_frames)

    @property
    def apart(self) -> float:
        """The distance (m) of the last frames of both arms."""
        return float(np.linalg.norm(self.frames[-1, :3, 3] - self.other_frames[-1, :3, 3]))
