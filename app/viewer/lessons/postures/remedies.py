"""Why a target is not reached, and what would help: each remedy is tried before it is offered.

A trial costs a solve, some milliseconds where there is no exact solution. So the remedies come one by one, from a
generator whose every step solves at most once. The worker takes a step whenever it is idle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

import kin
from app.exports.worksheet.sheet import indexed
from app.viewer.panel.posture import short
from app.viewer.panel.status import LOOKS, notice
from app.viewer.views.templates import render
from kin import IKOptions, IKResult, Robot
from kin.ik import Task, solve
from kin.ik.options import Locks
from kin.transforms import Array, rotation_angle
from kin.units import DEFAULT_UNITS, Units

Kind = Literal["branch", "unlock", "relax", "turn", "move"]
WEAKER_TASKS: dict[Task, tuple[Task, ...]] = {
    "pose": ("approach", "position"),
    "approach": ("position",),
    "position": (),
}
RELAX_LABELS: dict[Task, str] = {
    "pose": "Match the full pose",
    "approach": "Match point + approach only",
    "position": "Match the point only",
}


@dataclass(frozen=True, eq=False)
class Remedy:
    """A change that lets the arm reach its target.

    Attributes:
        label, hint: text of the button, and of its tooltip.
        q: configuration ``(n,)`` to move to, for kinds "turn" and "move".
        joint: the joint to unlock, None for all.
        task: the task to change to.
    """

    kind: Kind
    label: str
    hint: str = ""
    q: Array | None = None
    joint: int | None = None
    task: Task | None = None


@dataclass(frozen=True, eq=False)
class Request:
    """A target that was not reached.

    Attributes:
        T: target pose ``(4, 4)``.
        options, q: what it was solved with: options, and the configuration ``(n,)`` that was the seed.
        result: what `kin.ik.solve` returned.
    """

    robot: Robot
    T: Array
    options: IKOptions
    q: Array
    result: IKResult

    def is_solved_with(self, options: IKOptions) -> bool:
        """Whether the target can be reached with these options instead."""
        target = self.T[:3, 3] if options.task == "position" else self.T
        return solve(self.robot, target, replace(options, max_solutions=1), self.q).status == "solved"


def remedies(request: Request, units: Units = DEFAULT_UNITS) -> Iterator[Remedy | None]:
    """Everything that would let the arm reach the target, from the smallest change to the largest.

    Yields:
        A remedy that works, or None after a trial that failed. Nothing if the target is reached.
    """
    if request.result.status == "solved":
        return
    options = request.options
    if options.branch is not None:
        works = request.is_solved_with(replace(options, branch=None))
        yield Remedy("branch", "Allow any posture") if works else None
    yield from _unlocking(request)
    # A point out of reach is out of reach in every task.
    for weaker in WEAKER_TASKS[options.task] if request.result.distance == 0.0 else ():
        if request.is_solved_with(replace(options, task=weaker)):
            yield Remedy("relax", RELAX_LABELS[weaker], task=weaker)
            break
        yield None
    yield from _other_targets(request, units)


def _unlocking(request: Request) -> Iterator[Remedy | None]:
    """Unlocking one joint; if no single one helps, all of them."""
    locked = request.options.constraints.locks(request.robot) or ()
    joints = [i for i, value in enumerate(locked) if value is not None]
    helped = False
    for joint in joints:
        rest = tuple(None if i == joint else value for i, value in enumerate(locked))
        if request.is_solved_with(_constrained(request.options, rest)):
            helped = True
            yield Remedy("unlock", f"Unlock joint {joint + 1}", joint=joint)
        else:
            yield None
    if len(joints) > 1 and not helped:
        works = request.is_solved_with(_constrained(request.options, None))
        yield Remedy("unlock", "Unlock all joints") if works else None


def _constrained(options: IKOptions, locked: Locks | None) -> IKOptions:
    return replace(options, constraints=replace(options.constraints, locked=locked))


def _other_targets(request: Request, units: Units) -> Iterator[Remedy]:
    """Turning or moving the target to the nearest one that can be reached."""
    result = request.result
    turned = result.nearest_orientation or next((s for s in result.solutions if s.compromise), None)
    if turned is not None:
        what = "roll" if turned.compromise == "roll" else "orientation"
        label = f"Nearest {what}, {units.angle(turned.rotation_error)} away"
        yield Remedy("turn", label, f"Turns the target to the nearest possible {what}", np.array(turned.q))
    closest = result.closest
    if closest is not None and (turned is None or not np.allclose(closest.q, turned.q, atol=1e-6)):
        what = "point" if request.options.task == "position" else "pose"
        hint = f"Moves the target to the nearest reachable {what}: {_distance(request, closest.q, units)} away"
        yield Remedy("move", f"Nearest reachable {what}", hint, np.array(closest.q))


def _distance(request: Request, q: Array, units: Units) -> str:
    there = kin.fk(request.robot, q)
    distance = units.distance(float(np.linalg.norm(there[:3, 3] - request.T[:3, 3])))
    if request.options.task == "position":
        return distance
    return f"{distance}, {units.angle(rotation_angle(there[:3, :3], request.T[:3, :3]))}"


def html(result: IKResult | None, branch: str | None, units: Units) -> str:
    """The result in words; None: there is no target apart from the tool."""
    symbol, color = LOOKS["reached"]
    if result is None:
        title, detail, color = "Target reached", "The target is at the tool.", "kb-blue"
    elif result.status == "solved":
        title, detail = "Reached", notice(result, units).detail
    else:
        found = notice(result, units)
        symbol, color = LOOKS[found.kind]
        title, detail = f"Why not? {found.title}", found.detail
    if branch not in (None, "seed") and result is not None:
        detail = f"{detail} Requested posture: {short(branch)}."
    status = "" if result is None else result.status
    return render(
        "postures/why", status=status, symbol=symbol, color=color, title=title, detail=indexed(detail.strip())
    )
