"""Every posture for one target: which can be had, how well, and what keeps the others away.

The answers come from `kin.solve_ik`. What it leaves out is looked up in the closed form: a branch that exists but
breaks a stop is told with the stop and by how much, one that does not exist is "not here".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from html import escape
from typing import Literal

import numpy as np

import kin
from app.viewer.panel.posture import parts, short
from app.viewer.scene.meshes import JOINT_COLORS, Color
from kin import IKOptions, IKSolution, JointConstraints, LimitViolation, Robot, Task
from kin.ik.branches import is_closed, solve_branches, violations_of
from kin.ik.candidates import OVERRUN
from kin.ik.problem import IKProblem
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

State = Literal["reachable", "compromise", "blocked", "absent", "unknown"]

# The joints' colours, but a yellow that stands out from the page; two greys for the eighth and for what the stops
# forbid.
COLORS: tuple[Color, ...] = (*JOINT_COLORS[:6], (200, 180, 30), (110, 110, 110))
BLOCKED_COLOR: Color = (150, 150, 150)
_PROBES = 2000
_SLIDE = 4.0  # radians that a metre counts as, where stops of both kinds are compared


@dataclass(frozen=True, eq=False)
class Posture:
    """One branch at one target.

    Attributes:
        name: the branch's name, as `kin.solve_ik` takes it.
        state: what kind of answer it is.
        words: the same for people.
        q: its configuration ``(n,)``, beyond a stop if blocked; None if there is none.
        margin: radians (metres) to the nearest stop, inf if no joint has stops; 0 unless it can be had.
        joint: index of the joint that is nearest to its stop, −1 if none has stops.
        manipulability: Yoshikawa's measure, and `share`, the same as a share of the arm's best.
    """

    name: str
    state: State
    words: str
    q: Array | None = None
    margin: float = 0.0
    joint: int = -1
    manipulability: float = 0.0
    share: float = 0.0

    @property
    def can_be_had(self) -> bool:
        """Whether the arm may go there."""
        return self.state in ("reachable", "compromise")


def survey(
    robot: Robot,
    T: Array,
    task: Task,
    q: Array,
    locked: tuple[float | None, ...] | None = None,
    units: Units = DEFAULT_UNITS,
) -> tuple[Posture, ...]:
    """All branches for the target `T` ``(4, 4)``, seen from `q` ``(n,)``, in the order of `kin.branch_names`.

    An arm whose branches have no names has one posture: the nearest that was found, if any.
    """
    target = T[:3, 3] if task == "position" else T
    result = kin.solve_ik(robot, target, task=task, q_seed=q, locked=locked)
    solutions: dict[str, IKSolution] = {}
    for found in result.solutions:
        solutions.setdefault(found.branch, found)
    names = kin.branch_names(robot)
    if not names:
        one = next(iter(solutions.values()), None)
        return (Posture("nearest", "absent", "not here") if one is None else _had(robot, "nearest", one, units),)
    rest = {} if len(solutions) == len(names) else _left_out(robot, T, task, q, locked, units)
    return tuple(
        _had(robot, name, solutions[name], units)
        if name in solutions
        else rest.get(name, Posture(name, "unknown", "not looked for"))
        for name in names
    )


def _had(robot: Robot, name: str, solution: IKSolution, units: Units) -> Posture:
    q = solution.q
    margin, joint = limit_margin(robot, q)
    value = float(kin.manipulability(robot, q))
    state: State = "compromise" if solution.compromise else "reachable"
    words = "reachable"
    if solution.compromise:
        words = f"{solution.compromise} off by {units.angle(solution.rotation_error)}"
    share = min(1.0, value / best_manipulability(robot))
    return Posture(name, state, words, q, margin, joint, value, share)


def _left_out(
    robot: Robot, T: Array, task: Task, q: Array, locked: tuple[float | None, ...] | None, units: Units
) -> dict[str, Posture]:
    """What the closed form knows of each branch; nothing if it does not cover the task."""
    # Of a pose, an arm of five joints keeps point and approach: that is where its branches are.
    kept: Task = "approach" if task == "pose" and robot.n < 6 else task
    problem = IKProblem.of(robot, T, IKOptions(task=kept, constraints=JointConstraints(locked=locked)), q)
    branches = solve_branches(problem, problem.T, problem.code)
    if branches is None:
        return {}
    closed = is_closed(branches.stats)
    found = {}
    for i, name in enumerate(kin.branch_names(robot)):
        if not closed[i]:
            found[name] = Posture(name, "absent", "not here")
        elif branches.stats[i, OVERRUN] > 0.0:
            words = beyond(robot, violations_of(problem, branches.q[i]), problem.locked, units)
            found[name] = Posture(name, "blocked", words, branches.q[i].copy())
        else:
            found[name] = Posture(name, "absent", "the same as another")  # two branches have merged
    return found


def limit_margin(robot: Robot, q: Array) -> tuple[float, int]:
    """The least distance of a joint to its stop, radians (metres), and that joint; (inf, −1) without stops."""
    weights = np.where(robot.revolute, 1.0, _SLIDE)
    room = np.minimum(q - robot.lower, robot.upper - q)
    joint = int(np.argmin(room * weights))
    return (float(max(room[joint], 0.0)), joint) if math.isfinite(room[joint]) else (math.inf, -1)


@lru_cache(maxsize=256)
def best_manipulability(robot: Robot) -> float:
    """The most found among a fixed sample of the arm's configurations; 1.0 for an arm that is always singular."""
    q = robot.random_q(np.random.default_rng(11), _PROBES)
    return float(kin.manipulability(robot, q).max()) or 1.0


def beyond(robot: Robot, violations: tuple[LimitViolation, ...], locked: tuple[bool, ...], units: Units) -> str:
    """``beyond stop of joint 3 by 12.0°``, the widest first, and how many more."""
    if not violations:
        return "beyond a stop"
    worst = max(violations, key=lambda v: abs(v.value - v.limit))
    by = units.motion(robot.revolute[worst.joint], worst.value - worst.limit)
    more = f", and {len(violations) - 1} more" if len(violations) > 1 else ""
    number = worst.joint + 1
    if locked[worst.joint]:
        return f"joint {number} is locked {by} away{more}"
    return f"beyond stop of joint {number} by {by}{more}"


def html(robot: Robot, postures: tuple[Posture, ...], here: str, shown: frozenset[str], units: Units) -> str:
    """The list: a numbered row for each branch, the one the arm is on marked; `shown`: those with a ghost."""
    rows = "".join(_row(robot, i, p, p.name == here, p.name in shown, units) for i, p in enumerate(postures))
    what = parts(robot)
    head = f'<div style="opacity:.75;margin-bottom:.2em">{escape(what)}</div>' if what else ""
    return (
        '<div style="margin:0 1em .5em;font-size:.78em;line-height:1.4;font-variant-numeric:tabular-nums">'
        f'{head}<div role="list" aria-label="postures">{rows}</div></div>'
    )


def _row(robot: Robot, index: int, posture: Posture, here: bool, shown: bool, units: Units) -> str:
    r, g, b = COLORS[index % len(COLORS)] if posture.can_be_had else BLOCKED_COLOR
    ink = "#000" if 0.3 * r + 0.59 * g + 0.11 * b > 105.0 else "#fff"
    fill = f"background:rgb({r},{g},{b});color:{ink}" if shown or here else "background:none"
    badge = (
        f'<span style="flex:none;width:1.7em;height:1.7em;line-height:1.5em;box-sizing:border-box;'
        f'border:.12em solid rgb({r},{g},{b});border-radius:50%;text-align:center;font-weight:700;{fill}">'
        f"{index + 1}</span>"
    )
    mark = ' <b style="white-space:nowrap">◀ the arm</b>' if here else ""
    if posture.can_be_had:
        room = "no stops"
        if posture.joint >= 0:
            left = units.motion(robot.revolute[posture.joint], posture.margin)
            room = f"{left} to stop of joint {posture.joint + 1}"
        detail = (
            f'<span style="flex:1">{room}</span>'
            f'<span title="manipulability" style="flex:none">{posture.manipulability:.4f}</span>'
            f"{_bar(posture.share)}"
        )
        words = "" if posture.state == "reachable" else f"{posture.words} · "
    else:
        said = escape(posture.words) if posture.state == "blocked" else ""
        detail, words = f'<span style="flex:1">{said}</span>', ""
    state = "stopped" if posture.state == "blocked" else posture.words
    return (
        f'<div role="listitem" data-posture="{escape(posture.name, quote=True)}" data-state="{posture.state}"'
        f'{" data-here" if here else ""} style="display:flex;gap:.6em;align-items:center;padding:.2em .3em;'
        f"border-radius:.4em;min-height:2em;opacity:{1 if posture.can_be_had else 0.78};"
        f'background:{"rgba(128,128,128,.16)" if here else "none"}">{badge}'
        '<span style="flex:1;min-width:0"><span style="display:flex;gap:.5em">'
        f'<span style="flex:1"><b style="font-weight:600">{escape(short(posture.name))}</b>{mark}</span>'
        f'<span style="flex:none">{escape(state) if not words else ""}</span></span>'
        f'<span style="display:flex;gap:.5em;align-items:center;font-size:.93em;opacity:.9">'
        f"{escape(words)}{detail}</span></span></div>"
    )


def _bar(share: float) -> str:
    return (
        '<span aria-hidden="true" style="flex:none;width:3.4em;height:.45em;border-radius:.2em;overflow:hidden;'
        'background:rgba(128,128,128,.28)"><span style="display:block;height:100%;background:#0072b2;'
        f'width:{100.0 * share:.0f}%"></span></span>'
    )
