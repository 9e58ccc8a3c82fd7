"""What the lesson "Postures" knows: all postures for the target, and why it is missed if it is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import kin
from app.viewer.declared.facts import Facts
from app.viewer.lessons.postures.directions import Cone
from app.viewer.lessons.postures.loop import loop_of
from app.viewer.lessons.postures.remedies import Remedy
from app.viewer.lessons.postures.settings import PosturesSettings, names_of
from app.viewer.postures.survey import CLOSEST, Posture, survey
from kin import IKResult


@dataclass(frozen=True, eq=False)
class PosturesFacts(Facts[PosturesSettings]):
    """See the module."""

    @property
    def result(self) -> IKResult | None:
        """The answer to the target; None: the tool is there."""
        return None if self.arm.target is None else self.settings.result

    @property
    def offers(self) -> tuple[Remedy, ...]:
        """What would help, as far as it was tried."""
        return self.work("remedies").value or ()

    @property
    def cone(self) -> Cone | None:
        """The directions at the target, if they are wanted."""
        found: Cone | None = self.work("cone").value
        return found

    @property
    def round(self) -> bool:
        """Whether the arm is to be driven round."""
        return self.settings.round and loop_of(self.robot) is not None

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the arm's postures."""
        return names_of(self.robot)

    @cached_property
    def postures(self) -> tuple[Posture, ...]:
        """All postures for the target, in the order of their names."""
        arm = self.arm
        return survey(arm.robot, arm.aim, arm.options, arm.goal, self.units, arm.contacts_at)

    @cached_property
    def present(self) -> str:
        """The posture that the arm has, or is moving to."""
        return kin.branch_of(self.robot, self.arm.goal) if kin.branch_names(self.robot) else CLOSEST

    @property
    def seen(self) -> frozenset[str]:
        """The postures whose ghosts are wanted; the arm itself is where its own would be."""
        return frozenset(self.names) - self.settings.hidden if self.settings.ghosts else frozenset()
