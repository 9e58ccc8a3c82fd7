"""What is known of a feature's settings and the arm: a value that computes what is asked of it, once.

Facts know neither the page nor viser, so that tests make them of settings and an arm. Subclasses add cached
properties; what depends on the robot alone is a cached function of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, Self, TypeVar

from app.viewer.arm import Arm
from app.viewer.declared.fields import Settings
from kin import Robot
from kin.transforms import Array

S_co = TypeVar("S_co", bound=Settings, covariant=True)


@dataclass(frozen=True, eq=False)
class Facts(Generic[S_co]):
    """See the module."""

    settings: S_co
    arm: Arm

    @property
    def robot(self) -> Robot:
        """The robot on show."""
        return self.arm.robot

    @property
    def q(self) -> Array:
        """The configuration ``(n,)`` in the scene."""
        return self.arm.q

    @property
    def T(self) -> Array:
        """The pose ``(4, 4)`` of the tool in the scene."""
        return self.arm.T_tool

    def at(self, q: Array) -> Self:
        """The facts of another configuration ``(n,)``."""
        return replace(self, arm=replace(self.arm, q=q))
