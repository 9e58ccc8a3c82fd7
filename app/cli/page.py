"""``kinboard page``: an arm as one web page that needs no server."""

from __future__ import annotations

from argparse import Namespace

from app.cli.pipes.sink import write_output
from app.cli.terminal import configuration, mounted_robot_of, obstacles_of, pose_of, print_json, text_of, units_of
from app.viewer.scene.bodies.drawing import drawing
from app.viewer.takehome.page import SavedArm, web_page
from kin import IKOptions, Obstacle, Robot, plan_motion
from kin.motion import Motion, parse_program
from kin.transforms import Array


def run(arguments: Namespace) -> int:
    """Write the page, and say where; 1 if its program cannot be driven."""
    robot, units = mounted_robot_of(arguments), units_of(arguments)
    q = robot.q_home if arguments.q is None else configuration(robot, arguments.q, "--q", units)
    target = None if arguments.target is None else pose_of(arguments.target, "--target", units)
    obstacles = obstacles_of(arguments)
    motion = None if arguments.program is None else _motion(robot, arguments.program, q, obstacles)
    options = IKOptions(obstacles=obstacles)
    saved = SavedArm(robot, q, drawing(robot), target, options, motion, units, arguments.link, obstacles)
    page = web_page(saved)
    file = arguments.output or f"{robot.id}.html"
    data = page.encode()
    write_output(file, data)
    if file != "-":
        if arguments.json:
            print_json({"file": file, "bytes": len(data)})
        else:
            print(f"{file}: {len(data) / 1000:.0f} kB, opens in any browser, without a server or internet")
    return 0


def _motion(robot: Robot, path: str, q_start: Array, obstacles: tuple[Obstacle, ...]) -> Motion:
    program = parse_program(text_of(path, "--program"), robot)
    return plan_motion(robot, program, q_start, obstacles=obstacles)
