"""Kinematics of serial arms described by Denavit–Hartenberg tables: pure functions of arrays.

>>> import kin
>>> robot = kin.get_robot("pioneer5")
>>> kin.fk(robot, robot.home)[:3, 3].round(3).tolist()
[-0.03, 0.157, -0.194]
"""

from typing import TYPE_CHECKING

from kin._version import __version__
from kin.collision import (
    Capsule,
    Contact,
    NearestLinks,
    Obstacle,
    capsules,
    clearance,
    nearest_contact,
    nearest_links,
    obstacle_from_dict,
)
from kin.comparison import Comparison, compare
from kin.dh import Screws, convert_dh, exp_screw, robot_from_screws, screws
from kin.differential.task import Task
from kin.errors import InputError, KinematicsError, RobotFileError, UnknownRobotError
from kin.doctor import UrdfExamination, UrdfFinding, examine_urdf
from kin.files import (
    UrdfReport,
    UrdfRobot,
    builtin_robots,
    classic_robots,
    get_robot,
    load_robot,
    load_robots,
    read_urdf,
    robot_from_dict,
    robot_to_dict,
    robot_to_mjcf,
    robot_to_toml,
    robot_to_urdf,
    save_robot,
    urdf_tips,
)
from kin.fk import fk, fk_positions, jacobian, link_frames, manipulability
from kin.frames import frame_pose, pose_from_xyz_rpy
from kin.ik import IKOptions, JointConstraints, branch_meanings, branch_names, branch_of, solve_ik
from kin.ik.batch import IKResults, ik_branches, solve_ik_many
from kin.ik.details import LimitViolation, Redundancy
from kin.ik.results import BlockedBranch, IKResult, IKSolution, Status
from kin.joint import Shown
from kin.motion import (
    Circ,
    Dwell,
    JointTarget,
    Lin,
    Motion,
    MotionLimits,
    MotionSample,
    Peak,
    PoseTarget,
    Program,
    Ptp,
    Refusal,
    SegmentTimes,
    Spline,
    motion_limits,
    parse_program,
    plan_motion,
    program_from_dict,
    program_to_dict,
)
from kin.motor import Motor
from kin.notebook import connect, save_page, show
from kin.path import PathGap, PathJump, PathPostures, PathResult, path_postures, solve_path
from kin.poses import (
    pose_from_position_wxyz,
    pose_from_text,
    pose_to_text,
    rotation_from_wxyz,
)
from kin.motors import (
    MotorFinding,
    MotorMatch,
    from_pendant,
    match_motors,
    motor_poses,
    motors_from_lerobot,
    motors_to_lerobot,
    q_from_readings,
    readings_from_q,
    readings_from_ticks,
    ticks_from_readings,
    to_pendant,
)
from kin.robot import Joint, Robot
from kin.singularity import Singularity, singularities
from kin.transforms import wxyz_from_rotation
from kin.warmup import warm_up
from kin.workspace import (
    CapabilityMap,
    Estimate,
    Extreme,
    Section,
    SectionArc,
    WorkspaceChunk,
    WorkspaceFacts,
    capability_map,
    sample_workspace,
    workspace_configurations,
    workspace_facts,
    workspace_section,
    workspace_slice,
)

__all__ = [
    "BlockedBranch",
    "CapabilityMap",
    "Capsule",
    "Circ",
    "Comparison",
    "Contact",
    "Dwell",
    "Estimate",
    "Extreme",
    "IKOptions",
    "IKResult",
    "IKResults",
    "IKSolution",
    "InputError",
    "Joint",
    "JointConstraints",
    "JointTarget",
    "KinematicsError",
    "LimitViolation",
    "Lin",
    "Motion",
    "MotionLimits",
    "MotionSample",
    "Motor",
    "MotorFinding",
    "MotorMatch",
    "NearestLinks",
    "Obstacle",
    "PathGap",
    "PathJump",
    "PathPostures",
    "PathResult",
    "Peak",
    "PoseTarget",
    "Program",
    "Ptp",
    "Redundancy",
    "Refusal",
    "Robot",
    "RobotFileError",
    "Screws",
    "Section",
    "SectionArc",
    "SegmentTimes",
    "Shown",
    "Singularity",
    "Spline",
    "Status",
    "Task",
    "UnknownRobotError",
    "UrdfExamination",
    "UrdfFinding",
    "UrdfReport",
    "UrdfRobot",
    "WorkspaceChunk",
    "WorkspaceFacts",
    "__version__",
    "branch_meanings",
    "branch_names",
    "branch_of",
    "builtin_robots",
    "capability_map",
    "capsules",
    "classic_robots",
    "clearance",
    "compare",
    "connect",
    "convert_dh",
    "examine_urdf",
    "exp_screw",
    "fk",
    "fk_positions",
    "frame_pose",
    "from_pendant",
    "generate",
    "get_robot",
    "ik_branches",
    "jacobian",
    "link_frames",
    "load_robot",
    "load_robots",
    "manipulability",
    "match_motors",
    "motion_limits",
    "motor_poses",
    "motors_from_lerobot",
    "motors_to_lerobot",
    "nearest_contact",
    "nearest_links",
    "obstacle_from_dict",
    "parse_program",
    "path_postures",
    "plan_motion",
    "pose_from_position_wxyz",
    "pose_from_text",
    "pose_from_xyz_rpy",
    "pose_to_text",
    "program_from_dict",
    "program_to_dict",
    "q_from_readings",
    "read_urdf",
    "readings_from_q",
    "readings_from_ticks",
    "robot_from_dict",
    "robot_from_screws",
    "robot_to_dict",
    "robot_to_mjcf",
    "robot_to_toml",
    "robot_to_urdf",
    "rotation_from_wxyz",
    "sample_workspace",
    "save_page",
    "save_robot",
    "screws",
    "show",
    "singularities",
    "solve_ik",
    "solve_ik_many",
    "solve_path",
    "ticks_from_readings",
    "to_pendant",
    "urdf_tips",
    "warm_up",
    "workspace_configurations",
    "workspace_facts",
    "workspace_section",
    "workspace_slice",
    "wxyz_from_rotation",
]


if TYPE_CHECKING:
    from kin.codegen.files import generate
else:

    def __getattr__(name: str) -> object:
        if name == "generate":  # few programs translate kernels
            from kin.codegen.files import generate

            return generate
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
