"""The chart of postures along the way to a waypoint: which are free, what is in the way of others, and where.

The way along the line or arc is the horizontal axis, each posture of the arm a row. A click on a row starts there:
the waypoint before takes the joint values from which this posture leads farthest.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup

import kin
from app.exports.svg import Axes, AxisStyle, Plot, Series, chart
from app.shared.computations import SharedComputation
from app.viewer.panel.posture import short
from app.viewer.tabs.program.plan import Asked
from app.viewer.views.templates import render
from kin import IKOptions
from kin.motion.planning.plan import task_of
from kin.motion.planning.starts import segment_poses
from kin.path import PathPostures
from kin.path.postures import STATES, Reason, State
from kin.units import Units, typeset

PLACES = 80  # along the way
WIDTH, LEFT, RIGHT, ROW, GAP, TOP, BOTTOM = 320.0, 18.0, 16.0, 15.0, 4.0, 4.0, 18.0
_BARE = AxisStyle('stroke="none"', 'class="kb-axis"', "", length=1.0)
LEGEND: dict[State, str] = {
    "free": "free",
    "near limit": "near a limit",
    "near singularity": "near a singularity",
    "outside": "outside the limits",
    "touches": "touches something",
    "none": "no such posture",
}


def compute(computation: SharedComputation[Any], asked: Asked) -> PathPostures | str:
    """The postures along the way to a row; or why there is no chart."""
    plan, arm = asked.plan, asked.arm
    poses = segment_poses(plan.motion, asked.index, PLACES)
    before = plan.motion.q_before(asked.index)
    if poses is None or before is None:
        return "There is no way to show: the program ends before this waypoint, or it has no length."
    options = IKOptions(
        task=task_of(plan.motion.program, plan.motion.robot),
        avoid_self_collision=arm.avoid,
        obstacles=arm.obstacles if arm.avoid else (),
    )
    cancel = computation.check
    return kin.path.path_postures(plan.motion.robot, poses, options=options, q_start=before, cancel=cancel)


def html(asked: Asked | None, result: PathPostures | str | None, units: Units) -> str:
    """The chart, or that it is being computed."""
    if asked is None:
        return ""
    found = result if isinstance(result, PathPostures) else None
    rows = [] if found is None else [_row(found, row, units) for row in range(len(found.postures))]
    used = set() if found is None else {STATES[state] for state in np.unique(found.states).tolist()}
    return render(
        "program/postures",
        index=asked.index,
        words=result if found is None else _words(found),
        computing=result is None,
        svg="" if found is None else _svg(found, asked.index, units),
        rows=rows,
        legend=[(state.replace(" ", "-"), words) for state, words in LEGEND.items() if state in used],
    )


def _words(found: PathPostures) -> str:
    count, through = len(found.postures), len(found.through)
    if through:
        return f"The arm gets through in {through} of {count} postures. A click on one starts there."
    return typeset(found.reason)


def _row(found: PathPostures, row: int, units: Units) -> dict[str, object]:
    """A posture in words: how far it leads, and what ends it."""
    reach, last = int(found.reach[0, row]), len(found.reach) - 1
    if reach < 0:
        reason = typeset(found.reasons.get((0, row), Reason()).explain(units))
        text = f"not at the start: {reason}" if reason else "not at the start: the pose cannot be met so"
    elif reach == last:
        text = "the whole way"
    else:
        reason = typeset(found.reasons.get((reach + 1, row), Reason()).explain(units))
        text = f"to {100.0 * reach / max(last, 1):.0f} %" + (f": {reason}" if reason else "")
    return {
        "name": short(found.postures[row]),
        "text": text,
        "can": reach >= 0,
        "row": row,
        "best": int(found.rows[0]) == row,
    }


def _svg(found: PathPostures, index: int, units: Units) -> Markup:
    count, steps = len(found.postures), len(found.states)
    plot = Plot(LEFT, TOP, WIDTH - LEFT - RIGHT, count * (ROW + GAP), (0.0, steps), (count, 0.0))
    wide = ROW / (ROW + GAP)
    marks = []
    for stretch in found.stretches:
        row = stretch.posture
        able = found.reach[0, row] >= 0
        does = f' data-program-do="begin" data-argument="{row}" data-index="{index}"' if able else ""
        middle = (stretch.first + stretch.last + 1) // 2
        reason = typeset(found.reasons.get((middle, row), Reason()).explain(units))
        name = LEGEND[stretch.state] + (f": {reason}" if reason else "")
        end = stretch.last + 1 - (0.0 if stretch.joined else 1.0 / plot.scale)
        look = f'class="kb-posture kb-posture-{stretch.state.replace(" ", "-")}"{does}'
        marks.append(plot.box((stretch.first, end), (row, row + wide), look, name))
    best = np.array([[i + 0.5, row + 0.5 * wide] for i, row in enumerate(found.rows.tolist()) if row >= 0])
    line = [Series(plot, best, 'class="kb-posture-best"', "the best path")] if len(best) else []
    shares = [(share * steps, f"{100 * share:.0f} %") for share in (0.0, 0.5, 1.0)]
    axes = Axes(plot, shares, [(row + 0.5 * wide, str(row + 1)) for row in range(count)], style=_BARE)
    label = f"Postures along the way: one row each, in the order of the list below. {_words(found)}"
    return chart(line, marks, (axes,), label, (WIDTH, plot.bottom + BOTTOM))
