"""The settings of the lesson "Inverse kinematics". The names are those of links."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from app.viewer.declared.fields import Settings, flag, kept, memory, numbers, numbers_by_name, slider
from app.viewer.lessons.guide.outline import Configuration
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.inverse.arm import arm_of
from app.viewer.lessons.inverse.derive import Signs, signs_of
from app.viewer.lessons.inverse.exercise import example
from kin import Robot

ALL_HINT = "Shows the numbers of all steps, answered or not"
PSI_HINT = "Where the elbow is on its circle in the derivation"
TURN = (-math.pi, math.pi)


def _q(robot: Robot) -> Configuration:
    arm = arm_of(robot)
    return () if arm is None else as_configuration(example(arm))


def _signs(robot: Robot) -> Signs:
    arm = arm_of(robot)
    return () if arm is None else signs_of(arm, example(arm))


def _read_q(entry: object, robot: Robot) -> Configuration:
    return numbers("q", entry, len(_q(robot)))


def _read_signs(entry: object, robot: Robot) -> Signs:
    return tuple(1 if sign > 0 else -1 for sign in numbers("signs", entry, len(_signs(robot))))


def _read_taken(entry: object, robot: Robot) -> Mapping[str, float]:
    return numbers_by_name("taken", entry)


@dataclass(frozen=True)
class InverseSettings(Settings):
    """See the module; for arms without a derivation, `q` and `signs` are empty.

    Attributes:
        q: the configuration that the questions are about.
        signs: of the branch that is followed.
        all: whether the numbers of all steps are on show.
        taken: answers whose way was followed, by question: the student may have left it since.
        psi: the arm angle of the derivation, if it is `turned`; it follows the arm otherwise.
        step: the index of the step on show; beyond the last one during the check.
        answered: for each step, whether its numbers may be on show.
        restart: whether the questions are asked again.
        drawn: whether a figure was drawn last.
    """

    q: Configuration = kept(_q, to_json=list, from_json=_read_q)
    signs: Signs = kept(_signs, to_json=list, from_json=_read_signs)
    all: bool = flag("All numbers", hint=ALL_HINT)
    taken: Mapping[str, float] = kept(lambda robot: {}, to_json=dict, from_json=_read_taken)
    psi: float = slider(
        "ψ of the derivation",
        0.0,
        TURN,
        "angle",
        hint=PSI_HINT,
        names="arm angle",
        undo="Arm angle",
        named=False,
        marks=True,
        clip=True,
        link=False,
    )
    turned: bool = memory(False)
    step: int = memory(0)
    answered: tuple[bool, ...] = memory(())
    restart: bool = memory(False, renew=False)
    drawn: bool = memory(False, renew=False)
