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
from kin.poses.values import interpolate_poses, pose_exp, pose_log, position_wxyz_from_pose, xyz_rpy_from_pose

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
    "interpolate_poses",
    "pose_exp",
    "pose_from_position_wxyz",
    "pose_from_text",
    "pose_log",
    "pose_to_text",
    "position_wxyz_from_pose",
    "read_pose",
    "read_target",
    "roll_pitch_yaw",
    "rotation_from_wxyz",
    "turned_to",
    "xyz_rpy_from_pose",
]
