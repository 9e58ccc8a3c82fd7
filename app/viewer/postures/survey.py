"""All postures for one target: which are available, how good they are, and what rules out the others.

`kin.solve_ik` gives the available ones. The closed form tells why the others are not: a branch may violate a joint
limit, which is reported with the joint and the excess, or have no real solution.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

import kin
from app.viewer.panel.posture import parts, short
from app.viewer.scene.bodies.nodes import TOUCHING
from app.viewer.scene.bodies.parts import JOINT_COLORS, Color
from app.viewer.views.templates import render
from kin import IKOptions, Robot
from kin.collision import Contact
from kin.differential.metric import weights
from kin.ik import IKSolution, LimitViolation, solve
from kin.ik.branches import is_closed, solve_branches, violations_of
from kin.ik.candidates import OVERRUN
from kin.ik.problem import IKProblem
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

State = Literal["reachable", "compromise", "blocked", "absent", "unknown"]

# The joints' colours, with a darker yellow; grey for the eighth posture, and another grey for postures outside the
# limits.
COLORS: tuple[Color, ...] = (*JOINT_COLORS[:6], (200, 180, 30), (110, 110, 110))
BLOCKED_COLOR: Color = (150, 150, 150)
_PROBES = 2000
CLOSEST = "closest"  # the one posture of an arm whose branches have no names


@dataclass(frozen=True, eq=False)
class Posture:
    """One branch at one target.

    Attributes:
        name: the branch's name, as `kin.solve_ik` takes it.
        state: reachable; a compromise; blocked by joint limits; absent, without a real solution; or unknown.
        words: the same in words.
        q: its configuration ``(n,)``, outside the limits if blocked; None if there is none.
        margin: distance (rad or m) to the nearest joint limit; inf without limits; 0 unless available.
        joint: index of the joint nearest to its limit, −1 without limits.
        manipulability: Yoshikawa's measure.
        share: the same, relative to the arm's best.
        touches: what the arm touches there, in a few words; empty if nothing.
        locked: whether it is blocked by a locked joint.
    """

    name: str
    state: State
    words: str
    q: Array | None = None
    margin: float = 0.0
    joint: int = -1
    manipulability: float = 0.0
    share: float = 0.0
    touches: str = ""
    locked: bool = False

    @property
    def available(self) -> bool:
        """Whether the arm can move there."""
        return self.state in ("reachable", "compromise")


def survey(
    robot: Robot,
    T: Array,
    options: IKOptions,
    q: Array,
    units: Units = DEFAULT_UNITS,
    contacts_at: Callable[[Array], Sequence[Contact]] = lambda q: (),
) -> tuple[Posture, ...]:
    """All branches for the target `T` ``(4, 4)``, with the seed `q` ``(n,)``, in the order of `kin.branch_names`.

    Of the options, task and constraints hold, not the branch; postures that touch something are in the list, with
    what `contacts_at` says of them. An arm whose branches have no names has one posture:
    the closest one found, if any.
    """
    options = replace(options, branch=None, avoid_self_collision=False, obstacles=())
    found = _survey(robot, T, options, q, units)
    return tuple(
        each if each.q is None or not each.available else replace(each, touches=_touches(contacts_at(each.q)))
        for each in found
    )


def _touches(contacts: Sequence[Contact]) -> str:
    """``touches the table``; between links, which ones."""
    if not contacts:
        return ""
    first = contacts[0]
    return first.text if first.obstacle is None else first.text.partition(" ")[2].partition(" ")[2]


def _survey(robot: Robot, T: Array, options: IKOptions, q: Array, units: Units) -> tuple[Posture, ...]:
    result = solve(robot, T[:3, 3] if options.task == "position" else T, options, q)
    solutions: dict[str, IKSolution] = {}
    for found in result.solutions:
        solutions.setdefault(found.branch, found)
    names = kin.branch_names(robot)
    if not names:
        one = next(iter(solutions.values()), None)
        return (
            Posture(CLOSEST, "absent", "none found") if one is None else _available(robot, CLOSEST, one, units),
        )
    rest = {} if len(solutions) == len(names) else _unavailable(robot, T, options, q, units)
    return tuple(
        _available(robot, name, solutions[name], units)
        if name in solutions
        else rest.get(name, Posture(name, "unknown", "not searched"))
        for name in names
    )


def _available(robot: Robot, name: str, solution: IKSolution, units: Units) -> Posture:
    q = solution.q
    margin, joint = limit_margin(robot, q)
    value = float(kin.manipulability(robot, q))
    state: State = "compromise" if solution.compromise else "reachable"
    words = "reachable"
    if solution.compromise:
        words = f"{solution.compromise} off by {units.angle(solution.rotation_error)}"
    share = min(1.0, value / best_manipulability(robot))
    return Posture(name, state, words, q, margin, joint, value, share)


def _unavailable(robot: Robot, T: Array, options: IKOptions, q: Array, units: Units) -> dict[str, Posture]:
    """The branches that the closed form rules out, and why; empty if it does not cover the task."""
    # An arm of five joints matches point and approach of a pose; its branches are those of that task.
    if options.task == "pose" and robot.n < 6:
        options = replace(options, task="approach")
    problem = IKProblem.of(robot, T, options, q)
    branches = solve_branches(problem, problem.T, problem.code)
    if branches is None:
        return {}
    closed = is_closed(problem, branches.stats)
    found = {}
    for i, name in enumerate(kin.branch_names(robot)):
        if not closed[i]:
            found[name] = Posture(name, "absent", "no real solution")
        elif branches.stats[i, OVERRUN] > 0.0:
            violations = violations_of(problem, branches.q[i])
            words = limit_violation(robot, violations, problem.locked, units)
            locked = any(violation.locked for violation in violations)
            found[name] = Posture(name, "blocked", words, branches.q[i].copy(), locked=locked)
        else:
            found[name] = Posture(name, "absent", "same as another")  # two branches coincide
    return found


def limit_margin(robot: Robot, q: Array) -> tuple[float, int]:
    """The smallest distance (rad or m) of a joint to its limit, and that joint; (inf, −1) without limits."""
    room = np.minimum(q - robot.lower, robot.upper - q)
    joint = int(np.argmin(room * weights(robot)))
    return (float(max(room[joint], 0.0)), joint) if math.isfinite(room[joint]) else (math.inf, -1)


@lru_cache(maxsize=256)
def best_manipulability(robot: Robot) -> float:
    """The largest value in a fixed sample of configurations; 1.0 for an arm that is always singular."""
    q = robot.random_q(np.random.default_rng(11), _PROBES)
    return float(kin.manipulability(robot, q).max()) or 1.0


def limit_violation(
    robot: Robot, violations: tuple[LimitViolation, ...], locked: tuple[bool, ...], units: Units
) -> str:
    """``outside limit of joint 3 by 12.0°``: the largest violation, and the number of others."""
    if not violations:
        return "outside limits"
    worst = max(violations, key=lambda v: abs(v.value - v.limit))
    by = units.motion(robot.revolute[worst.joint], worst.value - worst.limit)
    more = f", and {len(violations) - 1} more" if len(violations) > 1 else ""
    number = worst.joint + 1
    if locked[worst.joint]:
        return f"joint {number} is locked {by} away{more}"
    return f"outside limit of joint {number} by {by}{more}"


def html(robot: Robot, postures: tuple[Posture, ...], present: str, shown: frozenset[str], units: Units) -> str:
    """The list: a numbered row for each branch, the arm's `present` one marked; `shown`: those with a ghost."""
    rows = [
        _row(robot, i, posture, posture.name == present, posture.name in shown, units)
        for i, posture in enumerate(postures)
    ]
    return render("postures/list", parts=parts(robot), rows=rows)


def color_of(index: int, posture: Posture) -> Color:
    """The colour of a posture in the list and of its ghost: red if it touches something."""
    if not posture.available:
        return BLOCKED_COLOR
    return TOUCHING if posture.touches else COLORS[index % len(COLORS)]


def _row(robot: Robot, index: int, posture: Posture, here: bool, shown: bool, units: Units) -> dict[str, object]:
    """The values of one row of the template."""
    r, g, b = color_of(index, posture)
    blocked = "joint locked" if posture.locked else "outside limits"
    status = blocked if posture.state == "blocked" else posture.words
    detail = posture.words if posture.state == "blocked" else ""
    if posture.available:
        detail = "no limits"
        if posture.joint >= 0:
            margin = units.motion(robot.revolute[posture.joint], posture.margin)
            detail = f"{margin} to limit of joint {posture.joint + 1}"
        if posture.state == "compromise":
            status, detail = "", f"{posture.words} · {detail}"
        if posture.touches:
            status = f"⊗ {posture.touches}"
    return {
        "name": posture.name,
        "title": short(posture.name),
        "state": posture.state,
        "available": posture.available,
        "here": here,
        "filled": shown or here,
        "color": f"rgb({r},{g},{b})",
        "ink": "#000" if 0.3 * r + 0.59 * g + 0.11 * b > 105.0 else "#fff",
        "status": status,
        "detail": detail,
        "manipulability": f"{posture.manipulability:.4f}",
        "percent": f"{100.0 * posture.share:.0f}",
    }
