"""The HTML of *Calibrate by touching*."""

from __future__ import annotations

import math

import numpy as np

from app.exports.curves import Curve, Row, with_legend
from app.viewer.tabs.robot.calibrate.run import Found, Run, doubt
from app.viewer.views.templates import render
from kin import Robot, fk
from kin.calibration.words import millimetres, remarks
from kin.comparison import messages
from kin.units import Units

_NAMES = ("the nominal table", "the table found")


def about(robot: Robot) -> str:
    """What it is for, before postures are asked for."""
    return render("calibrate/about", name=robot.name)


def posture(robot: Robot, run: Run, measured: tuple[float, ...] | None, units: Units) -> str:
    """The posture on show, and how far from it the connected arm is.

    Args:
        measured: joint values of the connected arm; None: no program sends them.
    """
    asked, read = run.q[run.at], run.read[run.at]
    of = [units.of(bool(turns)) for turns in robot.revolute]
    rows = [
        {
            "joint": joint.name,
            "asked": unit.text(float(asked[i])),
            "read": "" if read is None else unit.text(read[i], 2),
            "here": "" if measured is None else unit.text(measured[i]),
            "apart": "" if measured is None else unit.text(measured[i] - float(asked[i])),
        }
        for i, (joint, unit) in enumerate(zip(robot.joints, of, strict=True))
    ]
    tips = None if measured is None else fk(robot, np.array([asked, measured]))[:, :3, 3]
    return render(
        "calibrate/posture",
        at=run.at + 1,
        count=len(run.q),
        what=run.what.name(run.sockets[run.at]),
        rows=rows,
        connected=measured is not None,
        away="" if tips is None else units.distance(float(np.linalg.norm(tips[1] - tips[0]))),
        doubt="" if read is None else doubt(robot, asked, read),
    )


def places(run: Run, units: Units) -> str:
    """Where the boards are to lie, and what is to be expected."""
    lengths = units.lengths
    rows = []
    for T in run.places:
        xyz = [lengths.number(float(value), 0) for value in T[:3, 3]]
        rows.append((xyz, units.angles.text(math.atan2(T[1, 0], T[0, 0]), 0)))
    before, after, bound, readings = map(millimetres, run.expected)
    expected = {"before": before, "after": after, "bound": bound, "readings": readings}
    facts = {"kind": run.what.kind, "unit": lengths.suffix, "count": len(run.q)}
    return render("calibrate/places", rows=rows, **facts, **expected)


def touches(run: Run, found: Found | None, least: int) -> str:
    """The touches that were made, how far each is off, and the expected error from touch to touch.

    Args:
        least: how many are needed for a fit.
    """
    of: dict[int, tuple[str, bool]] = {}
    if found is not None:
        kept = set(found.calibration.kept.tolist())
        for k, (touch, miss) in enumerate(zip(found.touches, found.calibration.misses.tolist(), strict=True)):
            of[touch.at] = millimetres(miss), k in kept
    rows = [
        (at + 1, run.what.name(socket), *of.get(at, ("", True)), at == run.at) for at, socket, _ in run.touches
    ]
    chart = ""
    if run.course:
        counts = np.array([0.0, *(each[0] for each in run.course)])
        after = 1000.0 * np.array([run.expected[0], *(each[1] for each in run.course)])
        bound = 1000.0 * np.array([each[2] for each in run.course])
        chart = with_legend(
            (Row("tip off by, mm", shows=(0.0,)),),
            (Curve("expected", counts, [after]), Curve("95 % stay below", counts[1:], [bound])),
            "Expected error of the tip after each touch",
            "touches",
            whole=len(run.q),
        )
    return render("calibrate/touches", rows=rows, chart=chart, left=max(0, least - len(rows)))


def result(found: Found, units: Units) -> str:
    """What the touches have shown, which do not fit, and how the arm found compares with its nominal table."""
    calibration = found.calibration
    faults = [fault.text for fault in calibration.faults]
    errors = [error.text for error in calibration.errors if error.seen]
    return render(
        "calibrate/result",
        remarks=remarks(calibration, len(found.touches)),
        faults=faults,
        errors=errors,
        hidden=len(calibration.errors) - len(errors),
        compared=messages.verdict(found.comparison, calibration.nominal, calibration.robot, units, _NAMES),
    )


def failed(why: str) -> str:
    """Why there is no result."""
    return render("calibrate/failed", why=why)
