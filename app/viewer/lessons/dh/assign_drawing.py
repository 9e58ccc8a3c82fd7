"""*Assign it yourself* in the scene: axes with their names so far, the frames assigned, the one being chosen, and
the ghost of a wrong row."""

from __future__ import annotations

import numpy as np

from app.exercises.rows import turns
from app.viewer.declared.scene import Node
from app.viewer.lessons.dh import choices
from app.viewer.lessons.dh.assignment import read_row
from app.viewer.lessons.dh.attempt import Attempt
from app.viewer.lessons.dh.axes_drawing import axis_names, joint_axes
from app.viewer.lessons.dh.drawing import moving_frame, placed_frames
from app.viewer.lessons.dh.steps import ORDERS, axis, elementary
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import BLUE, VERMILION, clear_of
from kin import link_frames
from kin.transforms import Array
from kin.units import Units

LEADER = 7.0  # from the ghost to its name, in units of the arm's thickness


def scene(attempt: Attempt, q: Array, figure: FigureNodes, units: Units) -> list[Node]:
    """All that is drawn of an attempt at a configuration ``(n,)``."""
    work, size = attempt.work, figure.size
    frames = work.frames_at(q)
    with figure:
        nodes = _axes(attempt, q, figure)
        if frames:
            nodes.append(placed_frames("assigned", np.array(frames), size))
        for number, T in enumerate(frames):
            nodes += figure.point(f"frame-{number}", T[:3, 3], str(number), beside=-T[:3, 1], radius=0.3)
        if not work.complete and _begun(attempt):
            nodes.append(moving_frame("chosen", work.carried(attempt.chosen, q), size))
        if attempt.ghost is not None:
            nodes += _ghost(attempt, frames, q, figure)
        if frames and not work.complete and attempt.part is None:
            nodes += _row(attempt, frames[-1], q, figure, units)
    return nodes


def _begun(attempt: Attempt) -> bool:
    """Whether there is something of the next frame to see: its axis has been chosen."""
    found = attempt.offered()
    return any(part in attempt.made and len(found[part]) > 1 for part in choices.PARTS)


def _axes(attempt: Attempt, q: Array, figure: FigureNodes) -> list[Node]:
    """Axes are joint 1, 2, … until the student has named them; the normal is that of the next frame."""
    work, robot = attempt.work, attempt.work.robot
    named, shown = {work.carrier(number) for number in range(attempt.number)}, []
    if not work.complete:
        carrier, partner = work.carrier(attempt.number), work.partner(attempt.number)
        if "axis" in attempt.made and attempt.part != "axis":
            named.add(carrier)
        shown = [] if carrier is None or partner is None else [min(carrier, partner)]
    texts = [name if k in named else f"joint {k + 1}" for k, name in enumerate(axis_names(robot))]
    return joint_axes(figure, robot, q, texts, shown)


def _ghost(attempt: Attempt, frames: list[Array], q: Array, figure: FigureNodes) -> list[Node]:
    """Where a wrong row leads, with a name away from the other frames."""
    T = attempt.work.frames_at(q, attempt.ghost, attempt.chosen)[-1]
    out = T[:3, 3] - np.mean([frame[:3, 3] for frame in frames], axis=0)
    flat = np.array([out[0], out[1], 0.5 * float(np.hypot(out[0], out[1])) or 1.0])
    end = T[:3, 3] + LEADER * figure.size * flat / np.linalg.norm(flat)
    name = figure.line("ghost-name", T[:3, 3], end, "where your row leads", VERMILION)
    return [moving_frame("ghost", T, 0.8 * figure.size), *name]


def _row(attempt: Attempt, T: Array, q: Array, figure: FigureNodes, units: Units) -> list[Node]:
    """Where each parameter of the row from a frame ``(4, 4)`` is measured, as a question."""
    work, nodes = attempt.work, list[Node]()
    row = read_row(work.convention, T, work.carried(attempt.chosen, q))
    origins = link_frames(work.robot, q)[:, :3, 3]
    for factor in ORDERS[work.convention]:
        value, text, about = getattr(row, factor), f"{attempt.symbol(factor)} = ?", axis(factor)
        p, R = T[:3, 3], T[:3, :3]
        color = BLUE if about == 2 else VERMILION
        if abs(value) < 1e-6:
            pass
        elif turns(factor):
            nodes += figure.angle(factor, p, R[:, 2 - about], R[:, about], value, "", units, color, words=text)
        else:
            end = p + value * R[:, about]
            nodes += figure.dimension(factor, p, end, "", units, clear_of(p, end, origins), color, words=text)
        T = T @ elementary(factor, value)
    return nodes
