"""Poses as texts: notations of rotations, the forms of makers, and the reader of what people type.

One reader serves Python, REST, the command line and the page.
"""

from kin.poses.forms import FORMS, SI, PoseForm, form_named, pose_to_text
from kin.poses.quaternions import (
    check_length,
    checked_wxyz,
    far_from_unit,
    pose_from_position_wxyz,
    rotation_from_wxyz,
)
from kin.poses.reading import FARTHEST, PoseKind, pose_from_text, read_pose, read_target, turned_to
from kin.poses.rotations import ANGLES, DEFAULT, QUATERNIONS, RPY, VECTOR, Notation, Rotations, roll_pitch_yaw

__all__ = [
    "ANGLES",
    "DEFAULT",
    "FARTHEST",
    "FORMS",
    "QUATERNIONS",
    "RPY",
    "SI",
    "VECTOR",
    "Notation",
    "PoseForm",
    "PoseKind",
    "Rotations",
    "check_length",
    "checked_wxyz",
    "far_from_unit",
    "form_named",
    "pose_from_position_wxyz",
    "pose_from_text",
    "pose_to_text",
    "read_pose",
    "read_target",
    "roll_pitch_yaw",
    "rotation_from_wxyz",
    "turned_to",
]
