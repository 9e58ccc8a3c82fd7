"""What the lesson "Rotations and frames" knows: the rotation that is set, and the frames of the chain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from app.viewer.declared.facts import Facts
from app.viewer.lessons.rotations.conventions import CONVENTIONS, Convention
from app.viewer.lessons.rotations.frames import places
from app.viewer.lessons.rotations.settings import RotationsSettings
from kin.transforms import Array

BY_KEY = {convention.key: convention for convention in CONVENTIONS}


@dataclass(frozen=True, eq=False)
class RotationsFacts(Facts[RotationsSettings]):
    """See the module."""

    @property
    def convention(self) -> Convention:
        """The convention of the three angles."""
        return BY_KEY[self.settings.convention]

    @cached_property
    def R(self) -> Array:
        """The rotation ``(3, 3)``."""
        return self.convention.rotation(self.settings.angles)

    @cached_property
    def places(self) -> Array:
        """Where the frame is before the first motion of the chain and after each ``(k + 1, 4, 4)``."""
        return places(self.settings.chain)
