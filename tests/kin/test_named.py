"""The id of a built-in robot in place of a robot, and results that print as one line."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import kin
from kin import InputError, UnknownRobotError
from scripts.surface import public

UR5 = kin.get_robot("ur5")
T = kin.fk(UR5, UR5.q_home)
SO101 = kin.get_robot("so101")
POSES = np.array([SO101.q_home, SO101.q_home + 0.5])
PIN = kin.calibration.TouchFixture([kin.calibration.TouchBoard.pin()])
TOUCHES = kin.ik_branches(UR5, T)  # all postures with the tip at one point
PAN = {"id": 1, "drive_mode": 0, "homing_offset": -12, "range_min": 740, "range_max": 3331}
# The arguments after the robot of every public function that takes one.
CALLS = {
    "branch_meanings": (),
    "branch_names": (),
    "branch_of": (UR5.q_home,),
    "calibrate": (TOUCHES, [0] * len(TOUCHES), PIN),
    "capability_grid": (),
    "capability_map": (),
    "capsules": (),
    "clearance": (UR5.q_home,),
    "workspace_configurations": (3,),
    "convert_dh": ("modified",),
    "cuspidal": (),
    "frame_pose": ("base",),
    "from_pendant": (UR5.q_home,),
    "fk": (UR5.q_home,),
    "fk_positions": (UR5.q_home,),
    "ik_branches": (T,),
    "jacobian": (UR5.q_home,),
    "leave_singularity": (UR5.q_home,),
    "link_frames": (UR5.q_home,),
    "manipulability": (UR5.q_home,),
    "nearest_contact": (UR5.q_home,),
    "nearest_links": (UR5.q_home,),
    "path_postures": (T[None],),
    "plan_motion": ({"segments": [{"kind": "ptp", "q": [0.1, -1.0, 1.0, 0.0, 0.0, 0.0]}]},),
    "posture_map": (),
    "robot_to_dict": (),
    "robot_to_toml": (),
    "sample_workspace": (8,),
    "save_robot": (),
    "screws": (),
    "workspace_section": (),
    "singularities": (UR5.q_home,),
    "solve_ik": (T,),
    "solve_ik_many": (T[None],),
    "solve_path": (T[None],),
    "to_pendant": (UR5.q_home,),
    "touch_postures": (PIN, 2),
    "robot_to_mjcf": (),
    "robot_to_urdf": (),
    "workspace_facts": (),
    "workspace_slice": (8, 0, 8),
}
# The same of those that take an arm with motors.
OF_MOTORS = {
    "match_motors": (POSES, kin.motors.readings_from_q(SO101, POSES)),
    "motor_poses": (2,),
    "motors_from_lerobot": ({"shoulder_pan": PAN},),
    "q_from_readings": (kin.motors.readings_from_q(SO101, POSES),),
    "readings_from_q": (POSES,),
}
FUNCTIONS = {name.rpartition(".")[2]: value for name, value in public().items() if inspect.isfunction(value)}
MORE = {
    "capability_grid": {"resolution": 2, "directions": 12},
    "capability_map": {"resolution": 2, "directions": 12},
    "posture_map": {"resolution": 8},
    "workspace_section": {"resolution": 8},
    "workspace_facts": {"volume": False},
}


def test_the_table_names_every_function_that_takes_a_robot():
    first = {name: next(iter(inspect.signature(value).parameters), "") for name, value in FUNCTIONS.items()}
    taking = {name for name, parameter in first.items() if parameter == "robot"}
    # `show` and `save_page` ask the service, which finds the robot; no built-in arm has a calibration to write.
    assert taking == {*CALLS, *OF_MOTORS, "generate", "show", "save_page", "motors_to_lerobot"}


def found(name, robot, tmp_path):
    arguments = CALLS.get(name) or OF_MOTORS.get(name, ())
    if name == "save_robot":
        arguments = (tmp_path / "robot.toml",)
    result = FUNCTIONS[name](robot, *arguments, **MORE.get(name, {}))
    if name == "save_robot":
        return arguments[0].read_text()
    return repr(list(result) if name == "sample_workspace" else result)


def test_show_refuses_what_is_no_robot_before_it_starts_a_service():
    with pytest.raises(UnknownRobotError, match="ur6"):
        kin.show("ur6")
    with pytest.raises(InputError, match=r"^robot: got 5, expected a Robot"):
        kin.show(5)


def test_a_saved_page_is_of_a_robot(tmp_path):
    page, same = (kin.save_page(robot, tmp_path / "page.html").read_text("utf-8") for robot in ("ur5", UR5))
    assert page == same
    with pytest.raises(UnknownRobotError, match="ur6"):
        kin.save_page("ur6", tmp_path / "page.html")


@pytest.mark.parametrize("name", [*CALLS, *OF_MOTORS])
def test_the_id_of_a_robot_is_as_good_as_the_robot(name, tmp_path):
    robot = SO101 if name in OF_MOTORS else UR5
    assert found(name, robot.id, tmp_path) == found(name, robot, tmp_path)
    with pytest.raises(UnknownRobotError, match="ur6"):
        found(name, "ur6", tmp_path)
    with pytest.raises(InputError, match=r"^robot: got 5, expected a Robot"):
        found(name, 5, tmp_path)


def test_a_program_is_read_for_a_robot_by_its_id():
    data = {"units": {"length": "mm", "angle": "deg"}, "segments": [{"kind": "ptp", "q": [10, 20, 30, 40]}]}
    assert kin.motion.program_from_dict(data, "scara") == kin.motion.program_from_dict(
        data, kin.get_robot("scara")
    )
    assert kin.motion.program_from_dict(data, "scara") != kin.motion.program_from_dict(data)


def test_results_print_as_one_line():
    line = kin.fk(UR5, UR5.q_home + 0.01 * np.arange(5)[:, None])
    far = line.copy()
    far[2, :3, 3] = 5.0
    path = kin.solve_path(UR5, far, max_step=0.05)
    narrowed = kin.solve_ik("ur5", T, limits=[(0.0, 0.1)] + [None] * 5)
    (chunk,) = kin.workspace.sample_workspace("ur5", 8, with_q=True, measure="limit_margin")
    facts = kin.workspace.workspace_facts("ur5", volume=False)
    section = kin.workspace.workspace_section("ur5", resolution=8)
    grid = kin.workspace.capability_grid("ur5", resolution=2, directions=12)
    block = kin.workspace.capability_block(grid, 0)
    results = [
        *(path, *path.gaps, *path.jumps, narrowed, *narrowed.blocked, chunk, facts, facts.x.least),
        *(section, *section.arcs, grid, block, kin.workspace.capability_join(grid, [block])),
        *(kin.solve_ik_many("ur5", far), kin.solve_ik("ur5", T).solutions[0]),
    ]
    assert path.gaps
    assert path.jumps
    assert narrowed.blocked
    for result in results:
        text = repr(result)
        assert text.startswith(type(result).__name__)
        assert "\n" not in text
        assert len(text) < 330, text
