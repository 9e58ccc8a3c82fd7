"""What the ticks of an arm mean: LeRobot's calibration of it, found where LeRobot keeps it."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Final

import kin
from app.servos.bus import named
from app.servos.ports import is_simulated
from app.servos.simulated import CALIBRATION

_HOME: Final = Path(".cache", "huggingface")  # in the home folder, unless HF_HOME names another one
HOW: Final = """There is no calibration of LeRobot for this arm. With LeRobot installed:
  lerobot-calibrate --robot.type=so101_follower --robot.port=PORT --robot.id=my_arm
Then start again; --calibration FILE.json names a file that is somewhere else. Without LeRobot, write the motors
with their ranges into a robot file: kinboard export so101 -o my_arm.toml, then kinboard so101 my_arm.toml.
*Match motors* in the tab Robot finds signs and zeros. An arm that is off by millimetres is measured by touching:
kinboard calibrate so101 --sheet A4 proposes the postures."""


def moving(robot: kin.Robot) -> list[kin.motors.Motor]:
    """The motors that move a joint."""
    return [motor for motor in robot.motors if motor.joint]


def gripper_of(robot: kin.Robot) -> kin.motors.Motor | None:
    """The motor of the gripper, if it has a calibrated range."""
    found = [motor for motor in robot.motors if not motor.joint and motor.range is not None]
    return found[0] if found else None


def _folder() -> Path:
    """Where LeRobot keeps the calibrations of followers."""
    cache = Path(os.environ.get("HF_HOME") or Path.home() / _HOME)
    lerobot = Path(os.environ.get("HF_LEROBOT_HOME") or cache / "lerobot")
    return Path(os.environ.get("HF_LEROBOT_CALIBRATION") or lerobot / "calibration") / "robots"


class Calibration:
    """A calibration of LeRobot, or none, where the arm's own motors have ranges.

    Args:
        file: as it was named; None: the only one of LeRobot's folder, or that of the simulated arm.
        port: of the arm.

    Raises:
        KinematicsError: there are several in LeRobot's folder.
        OSError: it cannot be read.
    """

    def __init__(self, file: str | None, port: str) -> None:
        self._table = CALIBRATION if is_simulated(port) and file is None else None
        self._text = ""
        if file is None and not is_simulated(port):
            found = sorted(_folder().glob("so10*_follower/*.json"))
            if len(found) > 1:
                raise kin.KinematicsError("\n  ".join(["--calibration: which of these?", *map(str, found)]))
            file = str(found[0]) if found else None
            if file is not None:
                print(f"Calibration {file}.", flush=True)
        if file is not None:
            self._text = Path(file).read_text(encoding="utf-8")

    def applied(self, robot: kin.Robot) -> kin.Robot:
        """The arm with motors whose ticks are understood; raises `kin.KinematicsError`."""
        if self._text or self._table:
            robot = replace(robot, motors=kin.motors.motors_from_lerobot(robot, self._table or self._text))
        bare = [motor for motor in moving(robot) if motor.range is None and motor.unit != "ticks"]
        if bare or {motor.joint for motor in moving(robot)} != {joint.name for joint in robot.joints}:
            lacking = (
                f"no calibrated range of {', '.join(map(named, bare))}" if bare else "not a motor for each joint"
            )
            raise kin.KinematicsError(f"{robot.name} has {lacking}.\n{HOW}")
        return robot
