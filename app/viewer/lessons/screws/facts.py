"""What the lesson "Screws" knows: the screws of the arm, where its axes are, and what the factors give."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

import kin
from app.viewer.declared.facts import Facts
from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.screws.product import origin_of, partial, seen
from app.viewer.lessons.screws.settings import ScrewsSettings
from kin.dh import Screws
from kin.transforms import Array

zero_screws = lru_cache(maxsize=64)(kin.dh.screws)


@dataclass(frozen=True, eq=False)
class ScrewsFacts(Facts[ScrewsSettings]):
    """See the module."""

    @property
    def now(self) -> bool:
        """Whether the axes are those at the configuration in the scene."""
        return self.settings.axes == "now"

    @property
    def chosen(self) -> int:
        """The index of the joint whose screw is explained."""
        return self.settings.joint - 1

    @property
    def zero(self) -> Screws:
        """The screws with all joints at zero, which the formula takes."""
        return zero_screws(self.robot)

    @cached_property
    def screws(self) -> Screws:
        """The screws where the axes are drawn."""
        return kin.dh.screws(self.robot, self.q) if self.now else self.zero

    @cached_property
    def axes(self) -> tuple[Array, Array]:
        """A point of each axis and its direction ``(n, 3)``."""
        return axes_at(self.robot, self.q if self.now else np.zeros(self.robot.n))

    @cached_property
    def columns(self) -> Array:
        """The screws ``(6, n)`` in the frame of the form."""
        return seen(self.screws, self.settings.form)

    @cached_property
    def origin(self) -> Array:
        """The frame ``(4, 4)`` in which they are given."""
        return origin_of(self.screws, self.settings.form)

    @cached_property
    def acting(self) -> Array:
        """The configuration ``(n,)`` that the factors give."""
        return partial(self.q, self.settings.factors, self.settings.form)

    @cached_property
    def ghost(self) -> Array | None:
        """The arm after the factors that act; with all of them the arm at zero, if the axes are drawn there."""
        ghost = self.acting
        if self.settings.factors == self.robot.n:
            ghost = self.q if self.now else np.zeros(self.robot.n)
        return None if np.abs(ghost - self.q).max() < 1e-9 else ghost
