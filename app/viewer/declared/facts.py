"""What is known of a feature's settings and the arm: a value that computes what is asked of it, once.

Facts know neither the page nor viser, so that tests make them of settings and an arm. Subclasses add cached
properties; what depends on the robot alone is a cached function of it. In a page the arm is an `ArmReads`, so that
facts last as long as what they have read: those that never ask for `q` are not computed again while the arm moves.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, field, replace
from typing import Any, Generic, Self, TypeVar

from app.viewer.arm import Arm
from app.viewer.declared.fields import Settings
from app.viewer.declared.panel import same
from app.viewer.declared.work import NOTHING, Result, Results
from kin import Robot
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

S_co = TypeVar("S_co", bound=Settings, covariant=True)


class ArmReads:
    """Stands for an `Arm`, and records which of its values are read."""

    def __init__(self, arm: Arm) -> None:
        self._arm, self._read = arm, dict[str, Any]()

    def __getattr__(self, name: str) -> Any:
        value = self._read[name] = getattr(self._arm, name)
        return value

    def untouched(self, changed: Set[str]) -> bool:
        """Whether nothing of these names was read; see `Arm.changes`."""
        return self._read.keys().isdisjoint(changed)

    def follow(self, arm: Arm) -> bool:
        """Stand for another arm if all values read so far are the same there; returns whether they are."""
        if arm is not self._arm:
            for name, value in self._read.items():
                other = getattr(arm, name)
                if other is not value and not same((other,), (value,)):
                    return False
            self._arm = arm
        return True


@dataclass(frozen=True, eq=False)
class Facts(Generic[S_co]):
    """See the module.

    Attributes:
        works: what the feature's long work has come to, by keys.
        units: those of the page, for sentences.
    """

    settings: S_co
    arm: Arm
    works: Results = field(default_factory=dict)
    units: Units = DEFAULT_UNITS

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

    def work(self, key: str) -> Result:
        """What the work of this key has come to."""
        return self.works.get(key, NOTHING)

    def at(self, q: Array) -> Self:
        """The facts of another configuration ``(n,)``."""
        return replace(self, arm=self.arm.at(q))
