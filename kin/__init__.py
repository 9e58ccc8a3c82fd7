"""Kinematics of serial arms described by Denavit–Hartenberg tables: pure functions of arrays.

>>> import kin
>>> robot = kin.get_robot("pioneer5")
>>> kin.fk(robot, robot.home)[:3, 3].round(3).tolist()
[-0.03, 0.157, -0.194]
"""

from kin._version import __version__
from kin.dh import Screws, convert, robot_from_screws, screws
from kin.errors import InputError, KinematicsError, RobotFileError, UnknownRobotError
from kin.files import (
    UrdfReport,
    UrdfRobot,
    builtin_robots,
    get_robot,
    load_folder,
    load_robot,
    load_urdf,
    parse_robot,
    read_urdf,
    robot_from_dict,
    robot_to_dict,
    robot_to_toml,
    save_robot,
    to_urdf,
    urdf_tips,
)
from kin.fk import fk, fk_positions, jacobian, link_frames, manipulability
from kin.frames import frame_pose, from_xyz_rpy
from kin.ik import IKOptions, JointConstraints, branch_meanings, branch_names, branch_of, solve_ik
from kin.ik.batch import IKResults, ik_branches, solve_ik_many
from kin.ik.details import LimitViolation, Redundancy
from kin.ik.options import Task
from kin.ik.results import BlockedBranch, IKResult, IKSolution, Status
from kin.path import PathGap, PathJump, PathResult, solve_path
from kin.robot import Joint, Robot
from kin.singularity import Singularity, singularities
from kin.transforms import from_position_wxyz, rotation_from_wxyz, wxyz_from_rotation
from kin.warmup import warm_up, warm_up_rest
from kin.workspace import (
    CapabilityBlock,
    CapabilityGrid,
    CapabilityMap,
    Estimate,
    Extreme,
    Section,
    SectionArc,
    WorkspaceChunk,
    WorkspaceFacts,
    capability_block,
    capability_grid,
    capability_join,
    capability_map,
    configuration_at,
    sample_workspace,
    section,
    workspace_facts,
    workspace_slice,
)

__all__ = [
    "BlockedBranch",
    "CapabilityBlock",
    "CapabilityGrid",
    "CapabilityMap",
    "Estimate",
    "Extreme",
    "IKOptions",
    "IKResult",
    "IKResults",
    "IKSolution",
    "InputError",
    "Joint",
    "JointConstraints",
    "KinematicsError",
    "LimitViolation",
    "PathGap",
    "PathJump",
    "PathResult",
    "Redundancy",
    "Robot",
    "RobotFileError",
    "Screws",
    "Section",
    "SectionArc",
    "Singularity",
    "Status",
    "Task",
    "UnknownRobotError",
    "UrdfReport",
    "UrdfRobot",
    "WorkspaceChunk",
    "WorkspaceFacts",
    "__version__",
    "branch_meanings",
    "branch_names",
    "branch_of",
    "builtin_robots",
    "capability_block",
    "capability_grid",
    "capability_join",
    "capability_map",
    "configuration_at",
    "convert",
    "fk",
    "fk_positions",
    "frame_pose",
    "from_position_wxyz",
    "from_xyz_rpy",
    "get_robot",
    "ik_branches",
    "jacobian",
    "link_frames",
    "load_folder",
    "load_robot",
    "load_urdf",
    "manipulability",
    "parse_robot",
    "read_urdf",
    "robot_from_dict",
    "robot_from_screws",
    "robot_to_dict",
    "robot_to_toml",
    "rotation_from_wxyz",
    "sample_workspace",
    "save_robot",
    "screws",
    "section",
    "singularities",
    "solve_ik",
    "solve_ik_many",
    "solve_path",
    "to_urdf",
    "urdf_tips",
    "warm_up",
    "warm_up_rest",
    "workspace_facts",
    "workspace_slice",
    "wxyz_from_rotation",
]
