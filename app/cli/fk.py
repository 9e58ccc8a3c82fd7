"""``kinboard fk``: the pose of the tool for joint values."""

from __future__ import annotations

from argparse import Namespace

from app.cli.terminal import Notation, clean, configuration, frame_of, print_json, robot_of, table, units_of
from app.shared.answers.fk import fk_answers
from kin import InputError
from kin.frames import TOOL, WORLD


def run(arguments: Namespace) -> int:
    """Print the pose of the tool."""
    robot = robot_of(arguments)
    q = configuration(robot, arguments.q, "q", units_of(arguments))
    if arguments.frame == TOOL:
        raise InputError("--frame", TOOL, "world, base or a workpiece")
    T = None if arguments.frame == WORLD else frame_of(robot, arguments)
    answer = fk_answers(robot, q[None], arguments.frames, arguments.frame, T)[0]
    if arguments.json:
        return print_json(answer)
    units = Notation(robot, arguments.rad)
    rows = [
        [
            joint.name,
            units.joint(i, q[i]),
            " … ".join(units.joint(i, limit) for limit in joint.limits or ()),
            "" if robot.lower[i] <= q[i] <= robot.upper[i] else "outside limits",
        ]
        for i, joint in enumerate(robot.joints)
    ]
    print(f"{robot.name} ({robot.id})\n")
    print(table(["joint", "value", "limits", ""], rows))
    frames = [("tool", answer.pose)] + [(frame.name, frame.pose) for frame in answer.frames or ()]
    rows = [
        [name, *(units.length(x) for x in pose.position), *(f"{clean(w, 5)}" for w in pose.wxyz)]
        for name, pose in frames
    ]
    if arguments.frame != WORLD:
        print(f"\nin the frame {arguments.frame}:", end="")
    print("\n" + table(["frame", *(f"{axis} {units.of_length}" for axis in "xyz"), *"wxyz"], rows))
    return 0
