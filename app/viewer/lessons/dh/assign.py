"""The block of *Assign it yourself*: choices, fields and feedback.

``static/lesson.js`` sends what is done there.
"""

from __future__ import annotations

import numpy as np

from app.exercises.rows import turns
from app.viewer.lessons.dh import choices, views
from app.viewer.lessons.dh.assignment import Assignment
from app.viewer.lessons.dh.attempt import Attempt, error_of, table_robot
from app.viewer.lessons.dh.steps import ORDERS, low
from app.viewer.views.templates import render
from kin.transforms import Array
from kin.units import Units, fixed

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
        arm=work.robot.id,
        title=title,
        words=_finished(work, units) if done else choices.relation_words(work, number),
        settled=settled,
        part=part or "",
        prompt=""
        if part is None
        else PROMPTS[part].format(i=low(number) if part in ("axis", "direction", "x") else number),
        options=options,
        fields=fields,
        row_prompt=f"Fill in row {number}, measured at the pose on show.",
        feedback=feedback,
        symbol="✓" if right else "✗",
        color="green" if right else "vermilion",
        begun=bool(work.rows or len(settled)),
        done=done,
    )


def rows_html(work: Assignment, q: Array, units: Units, asked: bool = False) -> str:
    """The rows so far, at a configuration ``(n,)``."""
    if not work.rows:
        return ""
    robot = table_robot(work)
    senses = [work.sense(joint) for joint in range(robot.n)]
    return views.table_html(robot, q[: robot.n], None, units, "Your rows", senses, asked)


def measured_html(attempt: Attempt, q: Array, units: Units) -> str:
    """What the row that is asked for is computed from: both of its frames at a configuration ``(n,)``."""
    work, number = attempt.work, attempt.number
    if work.complete or attempt.part is not None or not work.frames:
        return ""
    rows = []
    frames = work.frames_at(q)[-1], work.carried(attempt.chosen, q)
    for i, T in zip((number - 1, number), frames, strict=True):
        rows.append({"name": f"origin {i}", "cells": [units.lengths.number(x) for x in T[:3, 3].tolist()]})
        for axis in (0, 2):
            name, cells = f"{'xyz'[axis]}{low(i)}", [fixed(x, 4) for x in T[:3, axis].tolist()]
            rows.append({"name": name, "cells": cells})
    return render("dh/measured", unit=units.lengths.name, rows=rows)


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
