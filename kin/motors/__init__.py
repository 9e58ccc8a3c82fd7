"""What the motors of an arm read: joint values and back, LeRobot's calibration, sign and zero from poses.

>>> import kin, numpy as np
>>> arm = kin.get_robot("planar2r")
>>> motors = [kin.motors.Motor("shoulder", 1), kin.motors.Motor("elbow", 2, unit="ticks")]
>>> poses = np.radians([[0.0, 0.0], [40.0, 60.0], [90.0, 20.0]])
>>> found = kin.motors.match_motors(arm, poses, [[91, 1040], [50, 360], [2, 810]], motors)
>>> [finding.motor.sign for finding in found.findings]
[-1, -1]
"""

from kin.joint import Shown
from kin.motor import Motor
from kin.motors.findings import MotorFinding, MotorMatch
from kin.motors.joints import q_from_readings, readings_from_q, readings_from_ticks, ticks_from_readings
from kin.motors.lerobot import motors_from_lerobot, motors_to_lerobot
from kin.motors.match import match_motors
from kin.motors.pendant import from_pendant, to_pendant
from kin.motors.poses import motor_poses

__all__ = [
    "Motor",
    "MotorFinding",
    "MotorMatch",
    "Shown",
    "from_pendant",
    "match_motors",
    "motor_poses",
    "motors_from_lerobot",
    "motors_to_lerobot",
    "q_from_readings",
    "readings_from_q",
    "readings_from_ticks",
    "ticks_from_readings",
    "to_pendant",
]
