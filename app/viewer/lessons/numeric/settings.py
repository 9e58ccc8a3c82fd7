"""The settings of the lesson "Numeric IK". The names are those of links."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import kin
from app.viewer.declared.fields import Settings, choice, flag, kept, memory, numbers, ordinal, slider
from app.viewer.lessons.numeric.example import example, usual_match
from app.viewer.lessons.numeric.iteration import Match, Method
from app.viewer.lessons.numeric.views import NAMES
from kin import Robot

MATCHES: dict[str, Match] = {"Point": "point", "Pose": "pose"}
DAMPINGS, GAINS = (0.005, 0.5), (0.1, 2.0)
EXACT = 1e-12
LIMITS = (math.radians(2.0), math.pi)  # of the longest change of a joint in one iteration; the last one: none
METHOD_HINT = "How a step is made from the error and the Jacobian"
MATCH_HINT = "What has to agree with the target: the tool point, or point and orientation"
DAMPING_HINT = "λ of the damped least squares, compared with the singular values of J"
GAIN_HINT = "Multiple of the α that is best if the arm were linear"
LIMIT_HINT = "The largest change of a joint in one iteration; at its right end there is no limit"
JOINTS_HINT = "Keeps each joint within its limits after each step"
COMPARE_HINT = "The chart shows all four methods from the same start"
FOLLOW_HINT = "Drag the arm, and the start moves with it. Switched off, the start stays where it is."
PICTURE_HINT = "Which solution each start (θ₁, θ₂) leads to, for the method and the settings above"

Numbers = tuple[float, ...]


def _target(robot: Robot) -> Numbers:
    return tuple(example(robot).problem.T.ravel().tolist())


def _read_target(entry: object, robot: Robot) -> Numbers:
    given = np.array(numbers("target", entry, 16)).reshape(4, 4)
    T = kin.transforms.as_transform(given)
    # What a link has is taken as it is, so that it is given out again as it was.
    return tuple((given if np.abs(given - T).max() < EXACT else T).ravel().tolist())


def _read_start(entry: object, robot: Robot) -> Numbers | None:
    return None if entry is None else numbers("start", entry, robot.n)


def _read_at(entry: object, robot: Robot) -> int | None:
    return ordinal("at", entry)


@dataclass(frozen=True)
class NumericSettings(Settings):
    """See the module.

    Attributes:
        longest: the largest change of a joint in one iteration (rad, or arm sizes); none at its upper limit.
        limits: whether joints stop at their limits.
        target: the pose, row by row.
        start: where the iterations begin; None: where the arm is.
        follow: what the visitor has last asked for; `start` is what counts.
        at: the iterate on show; None: the last one.
        plays: whether iterates are shown one after another.
        fits: whether the view was fitted to the iterates, once for each arm.
    """

    method: Method = choice("Method", {name: key for key, name in NAMES.items()}, "newton", hint=METHOD_HINT)
    damping: float = slider("λ", 0.1, DAMPINGS, digits=3, step=0.005, hint=DAMPING_HINT)
    gain: float = slider("Gain", 1.0, GAINS, step=0.1, hint=GAIN_HINT)
    longest: float = slider("Step limit", LIMITS[1], LIMITS, "angle", coarse=0, hint=LIMIT_HINT)
    limits: bool = flag("Joint limits", hint=JOINTS_HINT)
    match: Match = choice("Match", MATCHES, usual_match, hint=MATCH_HINT)
    target: Numbers = kept(_target, to_json=list, from_json=_read_target)
    start: Numbers | None = kept(None, to_json=lambda q: q and list(q), from_json=_read_start, renew=True)
    follow: bool = flag("Start follows the arm", True, hint=FOLLOW_HINT, link=False)
    at: int | None = kept(None, from_json=_read_at, renew=True)
    compare: bool = flag("Compare all methods", hint=COMPARE_HINT)
    picture: bool = flag("Basins of attraction", hint=PICTURE_HINT)
    plays: bool = memory(False)
    fits: bool = memory(False)
