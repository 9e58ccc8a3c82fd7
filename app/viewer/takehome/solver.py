"""What a saved page solves with: the arm's kernels as a script, and the sentences about what they find.

The kernels are those of `kin.generate`. The sentences are made by :mod:`kin.ik.messages` as those of the full page
are, with places for the numbers that the page puts in.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple, get_args

import kin
from app.viewer.panel.posture import short
from kin import InputError, Robot
from kin.axes import size
from kin.ik.details import (
    Details,
    JointKind,
    LimitViolation,
    OrientationNotMet,
    OutOfReach,
    OutsideLimits,
    RollError,
    RotationError,
    Solved,
)
from kin.ik.failures import shoulder_of
from kin.ik.messages import explain
from kin.ik.messages.values import listed, need
from kin.ik.results import Cause
from kin.robot import Joint
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE, ClosedForm, RedundancyParameter
from kin.units import Unit, Units, typeset

_NAME = "kernels"  # of the constant that the script defines


class Solver(NamedTuple):
    """The solver of a page.

    Attributes:
        script: defines `kernels`; "" if the arm's cannot be generated.
        about: what ``static/takehome/solver.js`` needs to know of the arm; None without a script.
        refusal: what the arm would have to be, if it cannot be generated.
    """

    script: str
    about: dict[str, Any] | None
    refusal: str = ""


class _Place(Unit):
    """Writes a number as the place where a page writes one: 2 as ``{a2}`` or ``{l2}``, an angle or a length."""

    def value(self, value: float) -> str:
        return f"{{{self.name}{value:.0f}}}"


class _Places(Units):
    @property
    def angles(self) -> Unit:
        return _Place("a", 1.0, 0)

    @property
    def lengths(self) -> Unit:
        return _Place("l", 1.0, 0)


_PLACES = _Places()


@lru_cache(maxsize=64)
def solver_of(robot: Robot) -> Solver:
    """The solver of an arm, which takes about a second to generate."""
    try:
        text = kin.generate(robot, "js", name=_NAME)
    except InputError as error:
        return Solver("", None, error.expected)
    form = closed_form_of(robot)
    assert form is not None
    # Without its head, a comment with names of the arm and its joints, which may be anything but a line break: the
    # end of a script, or the words that the code begins with.
    return Solver(text[text.index(f"\nconst {_NAME} = ") + 1 :], _about(robot, form))


def _about(robot: Robot, form: ClosedForm) -> dict[str, Any]:
    parameter = next((p for p in form.redundancies(POSE) if not p.rare), None)
    axis, shoulder = shoulder_of(robot, robot.q_home)
    return {
        "branches": [[name, short(name)] for name in form.branches],
        "parameter": None if parameter is None else _parameter(robot, parameter),
        "lower": [x if math.isfinite(x) else None for x in robot.lower.tolist()],
        "upper": [x if math.isfinite(x) else None for x in robot.upper.tolist()],
        "revolute": [joint.kind == "revolute" for joint in robot.joints],
        "few": robot.n < 6,
        "complete": form.name != "general6",  # which takes more than the kernels to prove
        "size": size(robot),
        "shoulder": {"axis": axis.tolist(), "at": shoulder.tolist()},
        "slides": robot.joints[0].kind == "prismatic",
        "turns": robot.turns_as_one,
        "home": list(robot.home),
        "words": _words(robot, form, parameter),
    }


def _parameter(robot: Robot, parameter: RedundancyParameter) -> dict[str, Any]:
    joint = None if parameter.joint < 0 else robot.joints[parameter.joint]
    low, high = (joint.limits if joint else None) or (-math.pi, math.pi)
    return {"label": parameter.label, "joint": parameter.joint, "low": low, "high": high}


def _words(robot: Robot, form: ClosedForm, parameter: RedundancyParameter | None) -> dict[str, Any]:
    counts = range(1, len(form.branches) + 1)
    branch = form.branches[0] if form.branches[0].startswith("solution ") else "{branch}"
    first = LimitViolation(0, "", 1.0, 2.0)
    needs = need(first, _PLACES)
    blocked = [_said(OutsideLimits(branch, (first,), k, (), 0)).replace(needs, "{needs}") for k in counts]
    found = {
        "solved": [_said(Solved(k, False, postures=k)) for k in counts],
        "found": [_said(Solved(k, False, complete=False, postures=k)) for k in counts],
        "limits": blocked,
        "needs": [_needs(i, joint) for i, joint in enumerate(robot.joints)],
        "listed": [listed([f"{{{i}}}" for i in range(k)]) for k in range(1, robot.n + 1)],
        "roll": _said(RollError(robot.n, 1.0)),
        "rotation": _said(RotationError(robot.n, 1.0, None)),
        "orientation": _said(OrientationNotMet(None, None, 3.0, 1.0, 2.0)),
        "unreachable": {
            cause: _said(OutOfReach(1.0), cause)
            for cause in get_args(Cause)
            if cause in ("too far", "too near", "around the axis", "outside")
        },
    }
    if parameter is not None:
        label = (parameter.label,)
        found["free"] = [_said(Solved(k, True, infinite=True, postures=k, free=label)) for k in counts]
        found["held"] = [_said(Solved(k, True, postures=k, fixed=label)) for k in counts]
    return found


def _said(details: Details, cause: str = "") -> str:
    return typeset(explain(details, cause, "pose", (), _PLACES).text)


def _needs(index: int, joint: Joint) -> list[str]:
    """Where a joint would be, and how near to its limit if both are written alike."""
    kind: JointKind = "prismatic" if joint.kind == "prismatic" else "revolute"
    return [typeset(need(LimitViolation(index, joint.name, value, 2.0, kind), _PLACES)) for value in (1.0, 2.0)]
