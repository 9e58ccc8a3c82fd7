"""The HTML of *Motors*."""

from __future__ import annotations

from app.viewer.tabs.robot.motors.run import COUNT, Run
from app.viewer.views.templates import render
from kin import Robot
from kin.motors import Motor
from kin.motors.joints import moving_motors
from kin.units import Units, general

UNITS = {
    "deg": "degrees",
    "rad": "radians",
    "ticks": "ticks of a turn",
    "range_m100_100": "LeRobot, −100 to 100",
    "range_0_100": "LeRobot, 0 to 100",
}
SHORT = {"deg": "°", "rad": "rad", "ticks": "ticks", "range_m100_100": "±100", "range_0_100": "0–100"}


def table(motors: tuple[Motor, ...], chosen: int) -> str:
    """All motors; the one whose fields are below is marked."""
    rows = [
        {
            "id": motor.id,
            "joint": motor.joint or motor.name,
            "sign": "−" if motor.sign < 0 else "+",
            "zero": general(motor.offset, 6),
            "unit": SHORT[motor.unit],
            "here": motor.id == chosen,
        }
        for motor in motors
    ]
    return render("motors/table", rows=rows)


def pose(run: Run, units: Units) -> str:
    """The pose on show: its number, its joint values, and earlier readings in it."""
    names = [joint.name for joint in run.robot.joints]
    rows = []
    for k, motor in enumerate(moving_motors(run.robot)):
        j = names.index(motor.joint)
        unit = units.of(bool(run.robot.revolute[j]))
        read = [None if values is None else general(values[k], 6) for values in run.readings]
        rows.append(
            {"id": motor.id, "joint": motor.joint, "at": unit.text(float(run.poses[run.at, j])), "read": read}
        )
    return render("motors/pose", rows=rows, at=run.at + 1, count=COUNT)


def result(run: Run) -> str:
    """What has been found of each motor, in sentences."""
    assert run.match is not None
    rows = [(finding.status, finding.text) for finding in run.match.findings]
    return render("motors/result", rows=rows, complete=run.match.complete)


def nothing(robot: Robot) -> str:
    """What motors are for, while there are none."""
    return render("motors/none", name=robot.name)
