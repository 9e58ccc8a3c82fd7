"""HTML of the lesson's sections on statics, null space and lines."""

from __future__ import annotations

import numpy as np

from app.exports.curves import Curve, Row, with_legend
from app.viewer.arm import Arm
from app.viewer.lessons.velocity.along import SAME, SHARE, Along, along, ends
from app.viewer.lessons.velocity.views import axis_name
from app.viewer.null_space import NullSpace
from app.viewer.panel.joints import label
from app.viewer.views.templates import render
from kin import Robot, fk
from kin.ik import Task
from kin.transforms import Array
from kin.units import Units, fixed, general, power

FREE = 1e-6  # m; a direction whose force needs less torque per newton needs none
TASKS: dict[Task, str] = {"pose": "pose", "approach": "point + approach", "position": "point"}
CONDITION = "Condition number κ"
START_HINT = "The line starts at the present configuration; without this, at home"
PLOT_HINT = "Follows the straight line to the present pose, or to a target that is missed"
HERE = "The line starts here. Move the arm, or type a target."
NO_LINE = "Start and end are the same. Press Start here, then move the arm or type a target, and plot."


def statics_html(robot: Robot, force: Array, tau: Array, least: Array, cost: float, R: Array) -> str:
    """τ = JᵀF for each joint, and the direction ``(3,)`` whose force takes the least torque, `cost` per newton."""
    rows = [
        {
            "name": label(robot, i),
            "value": fixed(value, 2),
            "unit": "N·m" if robot.revolute[i] else "N",
            "most": abs(value) > 0.999 * float(np.abs(tau).max()) and abs(value) > 5e-3,
        }
        for i, value in enumerate(tau.tolist())
    ]
    where = axis_name(least, R)
    if cost < FREE:
        cheap = f"A force along {where} costs nothing: the structure carries it; no joint moves the tool there."
    else:
        cheap = f"A force along {where} is the cheapest: |τ| = {fixed(cost, 3)} N·m per newton, σ_min of v."
    return render(
        "velocity/statics",
        rows=rows,
        size=fixed(float(np.linalg.norm(force)), 1),
        norm=fixed(float(np.linalg.norm(tau)), 2),
        cheap=cheap,
    )


def null_html(robot: Robot, task: Task, space: NullSpace, speeds: tuple[Array, Array, Array], w: float) -> str:
    """Rank and null space of the task, and the joint speeds z, J⁺v and (I − J⁺J) z ``(n,)`` with their sum."""
    z, by_v, own = speeds
    free = robot.n - space.rank
    dimension = (
        f"dimension {free}: {'one self-motion' if free == 1 else f'{free} self-motions'}" if free else "only 0"
    )
    rows = [
        {"name": label(robot, i), "values": [fixed(x, 3) for x in line]}
        for i, line in enumerate(np.stack([z, by_v, own, by_v + own], axis=1).tolist())
    ]
    moved = float(np.abs(space.J @ own).max())
    return render(
        "velocity/null",
        task=TASKS[task],
        size=f"{len(space.J)} × {robot.n}",
        rank=space.rank,
        dimension=dimension,
        rows=rows,
        residual=power(moved, 1),
        w=fixed(w, 4),
    )


def margin_html(share: float) -> str:
    """How near the nearest joint limit is."""
    return render("velocity/margin", share=f"{100.0 * share:.0f}")


def null_and_margin_html(
    robot: Robot, task: Task, space: NullSpace, speeds: tuple[Array, Array, Array], w: float, share: float
) -> str:
    """`null_html` and `margin_html`."""
    return null_html(robot, task, space, speeds, w) + margin_html(share)


def line_html(robot: Robot, found: Along, units: Units) -> str:
    """σ_min, condition number and rank along the line."""
    unit = units.lengths
    by_length = found.length > 1e-6
    x = found.share * (found.length * unit.scale if by_length else 100.0)
    if len(x) < 2:
        return render("velocity/line", chart="", words=f"No way to plot. {found.end}")
    most = float(found.rank.max())
    rows = (
        Row("σ_min", shows=(0.0,)),
        Row(CONDITION, log=True, shows=(0.0, 1.0)),
        Row(f"Rank (σ above {SHARE:g} of the largest)", shows=(0.0, most)),
    )
    curve = Curve(TASKS[found.task], x, (found.least, found.kappa, found.rank))
    at = int(found.least.argmin())
    words = f"Smallest σ_min {fixed(float(found.least[at]), 4)} at {100.0 * found.share[at]:.0f} % of the line, "
    words += f"κ there {general(float(found.kappa[at]), 3)}. {found.end}"
    axis = unit.name if by_length else "%"
    return render("velocity/line", chart=with_legend(rows, (curve,), "along the line", axis), words=words)


def plot_html(arm: Arm, start: Array | None, units: Units) -> str:
    """The plot of the line from a configuration ``(n,)``, or from home."""
    q, end = ends(arm, start)
    if np.abs(fk(arm.robot, q) - end).max() < SAME:
        return note_html(NO_LINE)
    return line_html(arm.robot, along(arm.robot, q, end, arm.task), units)


def note_html(text: str) -> str:
    """A sentence instead of a plot."""
    return render("velocity/line", chart="", words=text)
