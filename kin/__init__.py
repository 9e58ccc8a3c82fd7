"""Kinematics of serial arms described by Denavit–Hartenberg tables: pure functions of arrays.

>>> import kin
>>> robot = kin.get_robot("pioneer5")
>>> kin.fk(robot, robot.home)[:3, 3].round(3).tolist()
[-0.03, 0.157, -0.194]

What most programs need is here, everything else in the package that it is about: `kin.motion`, `kin.workspace`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from kin import dh, files, ik
from kin._version import __version__
from kin.errors import InputError, KinematicsError, RobotFileError, UnknownRobotError
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
from kin.robot import Joint, Robot
from kin.singularity import singularities
from kin.transforms import wxyz_from_rotation

if TYPE_CHECKING:
    from kin import calibration, collision, comparison, doctor, escape, motion, motors, path, workspace
    from kin.codegen.files import generate
    from kin.collision import Obstacle, clearance
    from kin.comparison import compare
    from kin.escape import leave_singularity
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
    "workspace",
    "wxyz_from_rotation",
    "xyz_rpy_from_pose",
]

# What few programs need is loaded when they ask for it: these names, and the packages that are named above.
_LATER = {
    "Obstacle": "collision",
    "clearance": "collision",
    "compare": "comparison",
    "connect": "notebook",
    "cuspidal": "postures",
    "generate": "codegen.files",
    "interpolate_poses": "poses",
    "leave_singularity": "escape",
    "plan_motion": "motion",
    "pose_exp": "poses",
    "pose_from_position_wxyz": "poses",
    "pose_from_text": "poses",
    "pose_log": "poses",
    "pose_to_text": "poses",
    "position_wxyz_from_pose": "poses",
    "posture_map": "postures",
    "rotation_from_wxyz": "poses",
    "save_page": "notebook",
    "show": "notebook",
    "solve_path": "path",
    "xyz_rpy_from_pose": "poses",
}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        if name not in _LATER:
            return import_module(f"kin.{name}")
        found = globals()[name] = getattr(import_module(f"kin.{_LATER[name]}"), name)
        return found

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
