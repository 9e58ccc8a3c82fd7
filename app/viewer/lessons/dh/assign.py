"""*Assign it yourself* in the visitor's page: the block of choices and fields, and what it draws in the scene.

``static/lesson.js`` sends what is pressed and typed there.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import ClassVar

import numpy as np
import viser

from app.exercises.rows import Factor, turns
from app.viewer.feature import Stage
from app.viewer.lessons.dh import choices, views
from app.viewer.lessons.dh.assignment import Assignment, read_row
from app.viewer.lessons.dh.attempt import Attempt, error_of, table_robot
from app.viewer.lessons.dh.axes_drawing import AxesDrawing, axis_names
from app.viewer.lessons.dh.drawing import PLACED, moving_frame, pose, triad_colors, triads
from app.viewer.lessons.dh.steps import ORDERS, elementary, low
from app.viewer.lessons.figure_shapes import AMBER, BLUE, VERMILION, clear_of
from app.viewer.lessons.figures import Angle, Dimension, Figure
from app.viewer.panel import update_html
from app.viewer.scene.meshes import body
from app.viewer.views.templates import render
from kin import InputError, Robot, link_frames
from kin.axes import inverse
from kin.transforms import Array
from kin.units import Units

PROMPTS: dict[choices.Part, str] = {
    "axis": "Which line is z{i}?",
    "direction": "Which way does z{i} point?",
    "normal": "Frame {i} lies on a common normal. Of which two axes?",
    "origin": "Where is origin {i}?",
    "x": "Which way does x{i} point?",
}
SETTLED: dict[choices.Part, str] = {
    "axis": "z{i}: {text}",
    "direction": "z{i} points: {text}",
    "normal": "Common normal: {text}",
    "origin": "Origin {i}: {text}",
    "x": "x{i}: {text}",
}
LEADER = 7.0  # from the ghost to its name, in units of the arm's thickness


class Assigning:
    """The block in the panel and the drawing in the scene; the lesson calls it from the visitor's worker."""

    messages: ClassVar[frozenset[str]] = frozenset({"choose", "check", "show", "back", "restart"})

    def __init__(self, stage: Stage, folder: viser.GuiFolderHandle, root: str) -> None:
        self._stage = stage
        with folder:
            self._block = stage.client.gui.add_html("")
            # Apart from the fields: it changes while the arm moves, and what is being typed must stay.
            self._rows = stage.client.gui.add_html("")
        self.attempt = Attempt(Assignment(stage.now.robot))
        self._drawing = AssignDrawing(stage.client.scene, stage.now.robot, root)
        self.write()
        self.draw()

    def handle(self, key: Hashable, value: object) -> None:
        """Process an event of the block; raises `kin.InputError` for one that it does not offer now."""
        attempt = self.attempt
        match key:
            case ("choose", str(part), int()):
                attempt.choose(part, value)
            case ("check", int()):
                attempt.check(value, self._stage.now.q, self._stage.units)
            case ("show", int()):
                attempt.show()
            case ("back", int()):
                attempt.back()
            case ("restart", int()):
                attempt.restart()
            case _:
                raise InputError("lesson", key, "a control of its block")
        self.write()
        self.draw()

    def restore(self, state: object) -> None:
        """Go on with what `Attempt.state` returned."""
        self.attempt = Attempt.restored(self._stage.now.robot, state)
        self.write()
        self.draw()

    def write(self) -> None:
        """Update the block."""
        units = self._stage.units
        update_html(self._block, assign_html(self.attempt, units))
        update_html(self._rows, rows_html(self.attempt.work, self._stage.now.q, units))

    def draw(self) -> None:
        """Update the scene."""
        self._drawing.show(self.attempt, self._stage.now.q, self._stage.units)

    def remove(self) -> None:
        """Remove everything from scene and panel."""
        self._drawing.remove()
        self._block.remove()
        self._rows.remove()


def assign_html(attempt: Attempt, units: Units) -> str:
    """The block: what is settled, and the next choice or the fields of the row."""
    work, part, number = attempt.work, attempt.part, attempt.number
    done = work.complete
    offered = {} if done else attempt.offered()
    settled, options = [], []
    for each in choices.PARTS:
        found = offered.get(each, ())
        if each == part:
            options = [
                {"text": choice.text, "chosen": attempt.made.get(each) == i} for i, choice in enumerate(found)
            ]
        elif each in attempt.made and len(found) > 1:
            text = found[attempt.made[each]].text
            settled.append(
                SETTLED[each].format(i=low(number) if each in ("axis", "direction", "x") else number, text=text)
            )
    fields = [] if done or part is not None else _fields(attempt, units)
    feedback = attempt.feedback
    right = feedback is not None and feedback.right
    title = f"Frame {number} of {work.robot.n}" + (f", row {number}" if fields else "")
    if done:
        title = "Your table is complete"
    return render(
        "dh/assign",
        title=title,
        words=_finished(work, units) if done else choices.relation_words(work, number),
        settled=settled,
        part=part or "",
        prompt="" if part is None else PROMPTS[part].format(
            i=low(number) if part in ("axis", "direction", "x") else number
        ),
        options=options,
        fields=fields,
        row_prompt=f"Fill in row {number}, measured at the pose on show.",
        feedback=feedback,
        symbol="✓" if right else "✗",
        color="green" if right else "vermilion",
        begun=bool(work.rows or len(settled)),
        done=done,
    )  # fmt: skip


def rows_html(work: Assignment, q: Array, units: Units) -> str:
    """The rows so far, at a configuration ``(n,)``."""
    if not work.rows:
        return ""
    robot = table_robot(work)
    senses = [work.sense(joint) for joint in range(robot.n)]
    return views.table_html(robot, q[: robot.n], None, units, "Your rows", senses)


def _fields(attempt: Attempt, units: Units) -> list[dict[str, object]]:
    return [
        {
            "key": factor,
            "name": attempt.symbol(factor),
            "value": attempt.typed.get(factor, ""),
            "wrong": factor in attempt.wrong,
            "unit": units.of(turns(factor)).name,
            "meaning": attempt.meaning(factor),
        }
        for factor in ORDERS[attempt.work.convention]
    ]


def _finished(work: Assignment, units: Units) -> str:
    error = error_of(work)
    backwards = [str(joint + 1) for joint in range(work.robot.n) if work.sense(joint) < 0.0]
    words = (
        "Your table moves the tool exactly as the arm does, at every pose."
        if error < 1e-6
        else f"Your table moves the tool as the arm does, to {units.lengths.value(error)}."
    )
    if backwards:
        several = len(backwards) > 1
        words += f" Joint{'s' * several} {', '.join(backwards)} count{'s' * (not several)} backwards in it."
    if not np.allclose(work.tool(), np.eye(4), atol=1e-6):
        words += " From the last frame, a constant transform leads to the tool."
    return words


class AssignDrawing:
    """Axes with their names so far, the frames assigned, the one being chosen, and the ghost of a wrong row."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str) -> None:
        self._scene, self._robot, self._name = scene, robot, root
        self._size = body(robot).size
        self._figure = Figure(scene, root, self._size)
        self._axes = AxesDrawing(self._figure, robot)
        self._zero = link_frames(robot, np.zeros(robot.n))
        self._chosen = moving_frame(scene, f"{root}/chosen", self._size)
        self._ghost = moving_frame(scene, f"{root}/ghost", 0.8 * self._size)
        self._names = [self._figure.point(color=AMBER, radius=0.3) for _ in range(robot.n + 1)]
        self._ghost_name = self._figure.line("where your row leads", VERMILION)
        self._placed: viser.LineSegmentsHandle | None = None
        self._count = -1
        self._made = 0
        self._parts: dict[Factor, Angle | Dimension] = {
            "theta": self._figure.angle("", BLUE),
            "d": self._figure.dimension("", BLUE),
            "a": self._figure.dimension("", VERMILION),
            "alpha": self._figure.angle("", VERMILION),
        }

    def show(self, attempt: Attempt, q: Array, units: Units) -> None:
        """Show an attempt at a configuration ``(n,)``."""
        work = attempt.work
        frames = work.frames_at(q)
        self._show_axes(attempt, q)
        self._show_frames(frames)
        chosen = None if work.complete or not self._begun(attempt) else self._carried(work, attempt.chosen, q)
        self._chosen.visible = chosen is not None
        if chosen is not None:
            pose(self._chosen, chosen)
        ghost = attempt.ghost
        self._ghost.visible = ghost is not None
        if ghost is None:
            self._ghost_name.hide()
        else:
            T = work.frames_at(q, ghost, attempt.chosen)[-1]
            pose(self._ghost, T)
            out = T[:3, 3] - np.mean([frame[:3, 3] for frame in frames], axis=0)
            flat = np.array([out[0], out[1], 0.5 * float(np.hypot(out[0], out[1])) or 1.0])
            self._ghost_name.show(T[:3, 3], T[:3, 3] + LEADER * self._size * flat / np.linalg.norm(flat))
        self._show_row(attempt, frames, q, units)

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._figure.remove()

    def _begun(self, attempt: Attempt) -> bool:
        """Whether there is something of the next frame to see: its axis has been chosen."""
        found = attempt.offered()
        return any(part in attempt.made and len(found[part]) > 1 for part in choices.PARTS)

    def _carried(self, work: Assignment, T: Array, q: Array) -> Array:
        """A frame of the next row, given with every joint at 0, on the link that carries it at `q`."""
        joints = len(work.frames)
        if joints == 0:
            return T
        row = self._robot.joint_rows[joints - 1]
        return np.asarray(link_frames(self._robot, q)[row] @ inverse(self._zero[row]) @ T)

    def _show_axes(self, attempt: Attempt, q: Array) -> None:
        """Axes are joint 1, 2, … until the student has named them."""
        names = axis_names(self._robot)
        work = attempt.work
        named = {work.carrier(number) for number in range(attempt.number)}
        if not work.complete and "axis" in attempt.made and attempt.part != "axis":
            named.add(work.carrier(attempt.number))
        texts = [name if joint in named else f"joint {joint + 1}" for joint, name in enumerate(names)]
        partner = None if work.complete else work.partner(attempt.number)
        carrier = None if work.complete else work.carrier(attempt.number)
        shown = [] if partner is None or carrier is None else [min(partner, carrier)]
        self._axes.show(q, texts, only=shown)

    def _show_frames(self, frames: list[Array]) -> None:
        if len(frames) != self._count:
            if self._placed is not None:
                self._placed.remove()
            self._placed = None
            self._count = len(frames)
            self._made += 1
            if frames:
                self._placed = self._scene.add_line_segments(
                    f"{self._name}/placed-{self._made}",
                    triads(np.array(frames), PLACED * self._size),
                    triad_colors(len(frames)),
                    thickness=0.26 * self._size,
                )
        elif self._placed is not None:
            self._placed.points = triads(np.array(frames), PLACED * self._size)
        for number, part in enumerate(self._names):
            if number < len(frames):
                T = frames[number]
                part.show(T[:3, 3], -T[:3, 1], text=str(number))
            elif part.shown:
                part.hide()

    def _show_row(self, attempt: Attempt, frames: list[Array], q: Array, units: Units) -> None:
        """Where each parameter of the row is measured, as a question; what was typed, where that is wrong."""
        asked = not attempt.work.complete and attempt.part is None and bool(frames)
        if not asked:
            for part in self._parts.values():
                part.hide()
            return
        work = attempt.work
        chosen = self._carried(work, attempt.chosen, q)
        row = read_row(work.convention, frames[-1], chosen)
        T = frames[-1]
        origins = link_frames(self._robot, q)[:, :3, 3]
        for factor in ORDERS[work.convention]:
            value, axis = getattr(row, factor), 2 if factor in ("theta", "d") else 0
            part, text = self._parts[factor], f"{attempt.symbol(factor)} = ?"
            p, R = T[:3, 3], T[:3, :3]
            if isinstance(part, Angle):
                part.show(p, R[:, 2 - axis], R[:, axis], value, units, text=text)
            else:
                end = p + value * R[:, axis]
                part.show(p, end, units, clear_of(p, end, origins), text=text)
            if abs(value) < 1e-6:
                part.hide()
            T = T @ elementary(factor, value)
