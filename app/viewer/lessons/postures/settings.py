"""The settings of the lesson "Postures". The names are those of links."""

from __future__ import annotations

from dataclasses import dataclass

import kin
from app.viewer.declared.fields import Settings, flag, kept, memory, subset
from app.viewer.lessons.postures.loop import DrivenPath
from app.viewer.postures.survey import CLOSEST
from kin import IKResult, Robot

ALL_GHOSTS_HINT = "Shows all postures as translucent copies of the arm; grey ones are outside the limits"
CONE_HINT = (
    "The possible directions of the tool's arrow with its tip at the target, within the limits; locks ignored"
)


def names_of(robot: Robot) -> tuple[str, ...]:
    """The names of the arm's postures; one for all if they have none."""
    return kin.branch_names(robot) or (CLOSEST,)


def _read_hidden(entry: object, robot: Robot) -> frozenset[str]:
    return subset("hidden", entry, names_of(robot))


@dataclass(frozen=True)
class PosturesSettings(Settings):
    """See the module; `hidden` are the names of the postures without a ghost, `result` is the last answer.

    Attributes:
        round: whether the step on show asks for the arm to be driven round.
        drive: what was driven since.
    """

    ghosts: bool = flag("Ghosts", True, hint=ALL_GHOSTS_HINT)
    cone: bool = flag("Approach cone", True, hint=CONE_HINT)
    hidden: frozenset[str] = kept(frozenset(), to_json=sorted, from_json=_read_hidden, renew=True)
    result: IKResult | None = memory()
    round: bool = memory(False, renew=False)
    drive: DrivenPath | None = memory()
