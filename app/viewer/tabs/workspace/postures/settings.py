"""The settings of the folder "Postures". The names are those of links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.shared.summaries import PostureRequest
from app.viewer.declared.fields import Settings, choice, flag, memory
from app.viewer.drive import Drive
from app.viewer.postures.survey import Posture
from kin import JointConstraints

Plane = Literal["vertical", "horizontal", "joints"]
PLANES: dict[str, Plane] = {
    "Vertical, through the tool": "vertical",
    "Horizontal, through the tool": "horizontal",
    "Two joints": "joints",
}
PLANE_HINT = "Where the map is. A section keeps the tool's orientation; of two joints, the others stand still"
LIMITS_HINT = "Count only postures inside the joint limits"
DRAWN_HINT = "A section where it lies, the postures of a place as pale arms, and the loop of a cuspidal arm"


@dataclass(frozen=True)
class PostureSettings(Settings):
    """See the module.

    Attributes:
        plane: which plane.
        limits: whether joint limits count.
        drawn: whether the scene shows a section, the postures of a place, and the loop.
        request: the map that was started last.
        place: coordinates of the place in the map that was chosen last.
        postures: those of that place.
        judged: limits and locks with which it is asked whether the arm is cuspidal; None: it is not asked.
        loop: the loop while the arm is driven round it.
    """

    plane: Plane = choice("Plane", PLANES, "vertical", hint=PLANE_HINT)
    limits: bool = flag("Inside limits", True, hint=LIMITS_HINT)
    drawn: bool = flag("Draw in the scene", True, hint=DRAWN_HINT)
    request: PostureRequest | None = memory()
    place: tuple[float, float] | None = memory()
    postures: tuple[Posture, ...] = memory(())
    judged: JointConstraints | None = memory()
    loop: Drive | None = memory()
