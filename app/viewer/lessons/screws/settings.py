"""The settings of the lesson "Screws". The names are those of links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import kin
from app.viewer.declared.fields import Settings, choice, slider
from app.viewer.lessons.screws.product import Form
from app.viewer.lessons.screws.questions import far_joint
from app.viewer.panel.joints import label
from kin import Robot

FORMS: dict[str, Form] = {"Space (world frame)": "space", "Body (tool frame)": "body"}
PLACES = {"All joints at zero": "zero", "Where they are now": "now"}
FORM_HINT = "The frame in which the six numbers of each screw are given"
PLACE_HINT = "The formula takes the screws at zero; where they are now, they are the columns of the Jacobian"
JOINT_HINT = "Shows how the six numbers of this joint's screw follow from its axis"
FACTORS_HINT = "How many factors of the product act, those next to M first; the ghost shows the arm they give"


@lru_cache(maxsize=128)
def joints(robot: Robot) -> Mapping[str, int]:
    """The numbers of the joints, from 1, by their names."""
    return {label(robot, i): i + 1 for i in range(robot.n)}


def far(robot: Robot) -> int:
    """The number of the first joint whose axis does not meet the origin."""
    return max(far_joint(kin.dh.screws(robot).S), 0) + 1


@dataclass(frozen=True)
class ScrewsSettings(Settings):
    """Joints count from 1."""

    form: Form = choice("Form", FORMS, "space", hint=FORM_HINT)
    axes: str = choice("Axes", PLACES, "zero", hint=PLACE_HINT)
    joint: int = choice("Joint", joints, far, hint=JOINT_HINT)
    factors: int = slider(
        "Factors", lambda robot: robot.n, (0, 0), hint=FACTORS_HINT, whole=True, within=lambda robot: (0, robot.n)
    )
