"""Kinematics of serial arms described by Denavit–Hartenberg tables: pure functions of arrays.

>>> import kin
>>> robot = kin.get_robot("pioneer5")
>>> kin.fk(robot, robot.home)[:3, 3].round(3).tolist()
[-0.03, 0.157, -0.194]

What most programs need is here, everything else in the package that it is about: `kin.motion`, `kin.workspace`.
"""

from typing import TYPE_CHECKING

from kin import calibration, collision, comparison, dh, doctor, escape, files, ik, motion, motors, path, workspace
from kin._version import __version__
from kin.collision import Obstacle, clearance
from kin.comparison import compare
from kin.errors import InputError, KinematicsError, RobotFileError, UnknownRobotError
from kin.escape import leave_singularity
from kin.files import (
    builtin_robots,
    get_robot,
    load_robot,
    robot_from_dict,
    robot_to_dict,
    robot_to_mjcf,
    robot_to_toml,
    robot_to_urdf,
    save_robot,
)
from kin.fk import fk, fk_positions, jacobian, link_frames, manipulability
from kin.frames import frame_pose, pose_from_xyz_rpy
from kin.ik import (
    IKOptions,
    IKResult,
    JointConstraints,
    Status,
    branch_names,
    branch_of,
    ik_branches,
    solve_ik,
    solve_ik_many,
)
from kin.motion import plan_motion
from kin.notebook import connect, save_page, show
from kin.path import solve_path
from kin.poses import (
    interpolate_poses,
    pose_exp,
    pose_from_position_wxyz,
    pose_from_text,
    pose_log,
    pose_to_text,
    position_wxyz_from_pose,
    rotation_from_wxyz,
    xyz_rpy_from_pose,
)
from kin.postures import cuspidal, posture_map
from kin.robot import Joint, Robot
from kin.singularity import singularities
from kin.transforms import wxyz_from_rotation
from kin.warmup import warm_up

__all__ = [
    "IKOptions",
    "IKResult",
    "InputError",
    "Joint",
    "JointConstraints",
    "KinematicsError",
    "Obstacle",
    "Robot",
    "RobotFileError",
    "Status",
    "UnknownRobotError",
    "__version__",
    "branch_names",
    "branch_of",
    "builtin_robots",
    "calibration",
    "clearance",
    "collision",
    "compare",
    "comparison",
    "connect",
    "cuspidal",
    "dh",
    "doctor",
    "escape",
    "files",
    "fk",
    "fk_positions",
    "frame_pose",
    "generate",
    "get_robot",
    "ik",
    "ik_branches",
    "interpolate_poses",
    "jacobian",
    "leave_singularity",
    "link_frames",
    "load_robot",
    "manipulability",
    "motion",
    "motors",
    "path",
    "plan_motion",
    "pose_exp",
    "pose_from_position_wxyz",
    "pose_from_text",
    "pose_from_xyz_rpy",
    "pose_log",
    "pose_to_text",
    "position_wxyz_from_pose",
    "posture_map",
    "robot_from_dict",
    "robot_to_dict",
    "robot_to_mjcf",
    "robot_to_toml",
    "robot_to_urdf",
    "rotation_from_wxyz",
    "save_page",
    "save_robot",
    "show",
    "singularities",
    "solve_ik",
    "solve_ik_many",
    "solve_path",
    "warm_up",
    "workspace",
    "wxyz_from_rotation",
    "xyz_rpy_from_pose",
]


if TYPE_CHECKING:
    from kin.codegen.files import generate
else:

    def __getattr__(name: str) -> object:
        if name == "generate":  # few programs translate kernels
            from kin.codegen.files import generate

            return generate
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
