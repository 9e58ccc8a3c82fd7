"""Why a target is not reached, and what would help: each remedy is tried before it is offered.

Trying costs a solve, some milliseconds where nothing is exact. So the remedies come one by one, as a generator
whose every step solves at most once: the worker takes a step whenever it has nothing better to do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from typing import Literal

import numpy as np

import kin
from app.viewer.panel.status import LOOKS, notice
from kin import IKResult, Robot, Task
from kin.transforms import Array, rotation_angle
from kin.units import DEFAULT_UNITS, Units

Kind = Literal["branch", "unlock", "relax", "turn", "move"]
LESS: dict[Task, tuple[Task, ...]] = {
    "pose": ("approach", "position"),
    "approach": ("position",),
    "position": (),
}
RELAXED: dict[Task, str] = {
    "pose": "Match the full pose",
    "approach": "Match point + approach only",
    "position": "Match the point only",
}


@dataclass(frozen=True, eq=False)
class Fix:
    """A remedy: what the button and its hint say, and what it does.

    `q`: go there; `joint`: unlock it, None for all; `task`: ask for no more than that.
    """

    kind: Kind
    label: str
    hint: str = ""
    q: Array | None = None
    joint: int | None = None
    task: Task | None = None


def remedies(
    robot: Robot,
    T: Array,
    task: Task,
    q: Array,
    locked: tuple[float | None, ...] | None,
    branch: str | None,
    result: IKResult,
    units: Units = DEFAULT_UNITS,
) -> Iterator[Fix | None]:
    """What would let the arm reach the target `T` ``(4, 4)``, from the least change to the greatest.

    Args:
        robot: the arm.
        task, locked, branch: what was asked for.
        q: the configuration ``(n,)`` it was asked from.
        result: the answer; there is nothing to offer if it is solved.
        units: of what is told.

    Yields:
        A remedy that works, or None for one that was tried in vain.
    """
    if result.status == "solved":
        return

    def works(task: Task, locked: tuple[float | None, ...] | None, branch: str | None) -> bool:
        target = T[:3, 3] if task == "position" else T
        found = kin.solve_ik(robot, target, task=task, q_seed=q, locked=locked, branch=branch, max_solutions=1)
        return found.status == "solved"

    if branch is not None:
        yield Fix("branch", "Let any posture do it") if works(task, locked, None) else None
    helped = False
    shut = [i for i, value in enumerate(locked or ()) if value is not None]
    for joint in shut:
        rest = tuple(None if i == joint else value for i, value in enumerate(locked or ()))
        if works(task, rest, branch):
            helped = True
            yield Fix("unlock", f"Unlock joint {joint + 1}", joint=joint)
        else:
            yield None
    if len(shut) > 1 and not helped:
        yield Fix("unlock", "Unlock all joints") if works(task, None, branch) else None
    for less in LESS[task] if result.distance == 0.0 else ():  # a point out of reach is so for every task
        if works(less, locked, branch):
            yield Fix("relax", RELAXED[less], task=less)
            break
        yield None
    turned = result.nearest_orientation or next((s for s in result.solutions if s.compromise), None)
    if turned is not None:
        what = "roll" if turned.compromise == "roll" else "orientation"
        label = f"Nearest {what}, {units.angle(turned.rotation_error)} away"
        yield Fix(
            "turn", label, f"Turn the target to the nearest {what} that the arm can have", np.array(turned.q)
        )
    best = result.closest
    if best is not None and (turned is None or not np.allclose(best.q, turned.q, atol=1e-6)):
        hint = f"Move the target to where the tool can be: {_off(robot, T, task, best.q, units)} away"
        yield Fix(
            "move", "Nearest reachable " + ("point" if task == "position" else "pose"), hint, np.array(best.q)
        )


def _off(robot: Robot, T: Array, task: Task, q: Array, units: Units) -> str:
    there = kin.fk(robot, q)
    far = units.distance(float(np.linalg.norm(there[:3, 3] - T[:3, 3])))
    if task == "position":
        return far
    return f"{far}, {units.angle(rotation_angle(there[:3, :3], T[:3, :3]))}"


def html(result: IKResult | None, branch: str | None, units: Units) -> str:
    """The answer in words; None: there is no target, the tool is where it is."""
    if result is None:
        title, detail, color, symbol = "Nothing is missed", "The target is where the tool is.", "#0072b2", "✓"
    elif result.status == "solved":
        title, detail, color, symbol = "Reached", result.explain(units).text, LOOKS["reached"][1], "✓"
    else:
        said = notice(result, units)
        symbol, color = LOOKS[said.kind]
        title, detail = f"Why not? {said.title}", said.detail
    kept = f"Asked for: branch {branch}." if branch not in (None, "seed") and result is not None else ""
    return (
        f'<div data-why="{"" if result is None else result.status}" style="margin:0 1em .5em;padding:.4em .6em;'
        f"border-radius:.4em;font-size:.82em;line-height:1.35;border-left:.25em solid {color};"
        f'background:{color}1a">'
        f'<b><span aria-hidden="true">{symbol}</span> {escape(title)}</b>'
        f'<div style="opacity:.85;font-size:.95em">{escape(f"{detail} {kept}".strip())}</div></div>'
    )
