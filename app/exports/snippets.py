"""The current arm and configuration as code for other tools.

Each snippet asks where the tool is at this configuration and how it gets to this target. The first three ask this
service or this library and get our answers; the Robotics Toolbox and MATLAB get the arm itself, written out as its
DH table, so that our numbers can be checked against theirs.

How the two conventions read there: `RevoluteDH` of P. Corke's toolbox and ``'dh'`` of MATLAB's `rigidBodyTree` are
our "standard", `RevoluteMDH` and ``'mdh'`` our "modified". MATLAB replaces a moving row's theta (d of a slide) by
the joint's value instead of adding it, so there the constant part is added to the values.
"""

from __future__ import annotations

import json
import math
import shlex
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, replace
from pprint import pformat
from typing import Any

import numpy as np

from kin import Joint, Obstacle, Robot, builtin_robots, robot_to_dict
from kin.axes import screw_x, screw_z
from kin.ik import Task
from kin.transforms import Array, wxyz_from_rotation

DIGITS = 9
LOCAL = "http://127.0.0.1:8000/"


@dataclass(frozen=True)
class Service:
    """A service that code asks: its address, as that of a `Moment`, and whether it asks for a token."""

    address: str = LOCAL
    token: bool = False


@dataclass(frozen=True, eq=False)
class Moment:
    """The subject of a snippet.

    Attributes:
        robot: the arm.
        q: configuration ``(n,)``.
        target: pose of the tool ``(4, 4)`` in the world frame.
        task: how much of it is to be met.
        address: where this service is, with a slash at the end; no character that a shell or a string would mind.
        token: whether the service asks for one.
        own: whether the arm is the visitor's own, which the service does not know.
        obstacles: what stands around the arm.
        avoid: whether the arm must touch neither itself nor them; if not, they are in the Python code, unused.
    """

    robot: Robot
    q: Array
    target: Array
    task: Task = "pose"
    address: str = LOCAL
    token: bool = False
    own: bool = False
    obstacles: tuple[Obstacle, ...] = ()
    avoid: bool = False


def posted(address: str, token: bool, body: dict[str, object]) -> str:
    """A command for a shell that posts JSON; `token`: with the service's token."""
    header = ' -H "Authorization: Bearer $KINBOARD_TOKEN"' if token else ""
    return (
        f"curl -s {shlex.quote(address)}{header} \\\n"
        f"  -H 'Content-Type: application/json' \\\n"
        f"  -d {shlex.quote(json.dumps(body))}\n"
    )


def curl(moment: Moment) -> str:
    """Two commands for a shell: forward, then inverse kinematics."""

    def command(operation: str, body: dict[str, object]) -> str:
        sent = {**body, "robot": robot_to_dict(named(moment.robot))} if moment.own else body
        return posted(f"{_address(moment)}/{operation}", moment.token, sent)

    return command("fk", {"q": _list(moment.q)}) + command("ik", _question(moment))


def python_requests(moment: Moment) -> str:
    """Python, asking this service over REST with the requests library."""
    top, header = "import requests\n", ""
    if moment.token:
        top = f"import os\n\n{top}\n" + 'headers = {"Authorization": "Bearer " + os.environ["KINBOARD_TOKEN"]}\n'
        header = ", headers=headers"
    asked = {name: json.dumps(value) for name, value in _question(moment).items() if name != "obstacles"}
    asked |= {"avoid_self_collision": "True"} if moment.avoid else {}
    asked |= {"obstacles": "obstacles"} if moment.avoid and moment.obstacles else {}
    body = ",\n    ".join(f'"{name}": {value}' for name, value in asked.items())
    around = _listed(moment, lambda each: repr(_fields_of(each)), '"obstacles": obstacles in the question')
    arm, field, sent = "", "", ""
    if moment.own:
        arm, field, sent = f"arm = {_fields(moment.robot, 6)}\n", '"robot": arm, ', '\n    "robot": arm,'
    return f"""{top}
robot = {json.dumps(_address(moment))}
{arm}q = {_list(moment.q)}
{around}question = {{{sent}
    {body},
}}

forward = requests.post(robot + "/fk", json={{{field}"q": q}}{header}).json()
print(forward["pose"]["position"], forward["pose"]["wxyz"])

answer = requests.post(robot + "/ik", json=question{header}).json()
print(answer["status"], answer["reason"])
for solution in answer["solutions"]:
    print(solution["branch"], solution["q"])
"""


def python_kin(moment: Moment) -> str:
    """Python, with this package and without any service."""
    robot = moment.robot
    load = robot_code(robot, known=not moment.own)
    around = _listed(moment, _obstacle, "obstacles=obstacles in solve_ik")
    if moment.obstacles:
        around += "print(kin.clearance(robot, q, obstacles))  # metres; negative where something touches\n"
    options = ", obstacles=obstacles" if moment.avoid and moment.obstacles else ""
    options += ", avoid_self_collision=True" if moment.avoid else ""
    return f"""import kin

{load}
q = {_list(moment.q)}
print(kin.fk(robot, q))  # pose of the tool in the world frame
{around}
target = [
{_rows(moment.target)}]
result = kin.solve_ik(robot, target, task="{moment.task}", q_seed=q{options})
print(result.status, result.reason)
for solution in result.solutions:
    print(solution.branch, solution.q)
"""


_EXPANSION = "values of all moving rows: those of joints, and of what follows them"


def robotics_toolbox(moment: Moment) -> str:
    """Python, with Corke's Robotics Toolbox.

    It knows no fixed rows: those before the first joint go into its base, those after the last into its tool.
    For an arm with one between two joints a comment says so instead. It knows no rows that follow joints either:
    its values are those of all moving rows, which a matrix gives.
    """
    coupled, robot = moment.robot.coupled, moment.robot.free
    first, last = robot.joint_rows[0], robot.joint_rows[-1]
    if last - first + 1 != robot.n:
        return f"# {_comment(robot.name)} has a fixed row between two joints, which DHRobot cannot express.\n"
    suffix = "MDH" if robot.convention == "modified" else "DH"
    base = _product(robot.T_world_base, robot.rows[:first], robot.convention)
    tool = _product(np.eye(4), robot.rows[last + 1 :], robot.convention) @ robot.T_last_tool
    links = "".join(f"        {_link(row, suffix)},\n" for row in robot.joints)
    ends = "".join(
        f"    {name}={_se3(T, 4)},\n"
        for name, T in (("base", base), ("tool", tool))
        if not np.array_equal(T, np.eye(4))
    )
    values, expansion = "q", ""
    solve = f"""
target = {_se3(moment.target)}
print(robot.ikine_LM(target, q0=q))  # numerical, the whole pose, one solution
"""
    if coupled:
        values, solve = "A @ q", "# Its inverse kinematics would move each row alone.\n"
        expansion = f"A = np.array([\n{_rows(moment.robot.expansion)}])  # {_EXPANSION}\n"
    return f"""import numpy as np
from roboticstoolbox import DHRobot, Prismatic{suffix}, Revolute{suffix}
from spatialmath import SE3

robot = DHRobot(
    [
{links}    ],
    name={json.dumps(robot.name)},
{ends})
q = {_list(moment.q)}
{expansion}print(robot.fkine({values}))  # pose of the tool in the world frame
{solve}"""


def matlab(moment: Moment) -> str:
    """MATLAB, with the Robotics System Toolbox; with rows that follow joints, as for `robotics_toolbox`."""
    coupled, robot = moment.robot.coupled, moment.robot.free
    kind = "mdh" if robot.convention == "modified" else "dh"
    lines = [f"% {_comment(robot.name)}", "robot = rigidBodyTree('DataFormat', 'row');"]
    parent = "base"

    def add(name: str, joint: str, *setup: str) -> None:
        nonlocal parent
        lines.append(f"body = rigidBody('{name}');")
        lines.append(f"joint = rigidBodyJoint('{name}_joint', '{joint}');")
        lines.extend(setup)
        lines.extend(["body.Joint = joint;", f"addBody(robot, body, '{parent}');"])
        parent = name

    if not np.array_equal(robot.T_world_base, np.eye(4)):
        add("mount", "fixed", f"setFixedTransform(joint, {_matlab(robot.T_world_base)});")
    offsets: list[float] = []
    for number, row in enumerate(robot.rows, 1):
        name = f"row{number}"
        if row.kind == "fixed":
            T = row_transform(row, 0.0, robot.convention)
            add(name, "fixed", f"setFixedTransform(joint, {_matlab(T)});")
            continue
        offset = row.theta if row.kind == "revolute" else row.d
        offsets.append(offset)
        table = " ".join(_text(value) for value in (row.a, row.alpha, row.d, row.theta))
        lower, upper = row.limits or (-math.inf, math.inf)
        limits = f"{_text(lower + offset)} {_text(upper + offset)}"
        setup = [f"setFixedTransform(joint, [{table}], '{kind}');  % a alpha d theta"]
        setup.append(f"joint.PositionLimits = [{limits}];")
        add(name, row.kind, *setup)
    if not np.array_equal(robot.T_last_tool, np.eye(4)):
        add("tool", "fixed", f"setFixedTransform(joint, {_matlab(robot.T_last_tool)});")
    weights = "0 0 0 1 1 1" if moment.task == "position" else "1 1 1 1 1 1"
    lines += [
        "",
        f"offset = [{_row(np.array(offsets))}];  % MATLAB's joint values contain the table's constant part",
    ]
    lines.append(f"q = [{_row(moment.q)}];")
    if coupled:
        A = "; ".join(map(_row, moment.robot.expansion))
        lines += [f"A = [{A}];  % {_EXPANSION}", "q = q * A';"]
    lines.append(f"T = getTransform(robot, q + offset, '{parent}')  % pose of the tool in the world frame")
    if coupled:
        return "\n".join([*lines, "% Its inverse kinematics would move each row alone."]) + "\n"
    lines += [
        "",
        f"target = {_matlab(moment.target)};",
        "solver = inverseKinematics('RigidBodyTree', robot);",
        f"[solution, info] = solver('{parent}', target, [{weights}], q + offset);  % orientation, then position",
        "q_solution = solution - offset",
        "info.Status",
    ]
    return "\n".join(lines) + "\n"


SNIPPETS: dict[str, Callable[[Moment], str]] = {
    "curl": curl,
    "Python, requests": python_requests,
    "Python, kin": python_kin,
    "Robotics Toolbox": robotics_toolbox,
    "MATLAB": matlab,
}


def row_transform(row: Joint, value: float, convention: str) -> Array:
    """The transform ``(4, 4)`` of one DH row at a joint value (0 for a fixed row)."""
    turned, slid = (value, 0.0) if row.kind == "revolute" else (0.0, value)
    turn, twist = screw_z(row.theta + turned, row.d + slid), screw_x(row.a, row.alpha)
    return np.asarray(twist @ turn if convention == "modified" else turn @ twist)


def named(robot: Robot) -> Robot:
    """An arm of a visitor's own with an id that people can read, for a file."""
    words = "".join(c if c.isascii() and c.isalnum() else " " for c in robot.name.lower()).split()
    return replace(robot, id="-".join(words)[:40].strip("-") or "my-arm")


def robot_code(robot: Robot, known: bool = False) -> str:
    """Python that assigns the arm to `robot`; `known`: an arm that is not built in has a file in the service."""
    if robot == builtin_robots().get(robot.id):
        return f'robot = kin.get_robot("{robot.id}")'
    if known:
        return f"# The arm's file in the service's folder of robots:\nrobot = kin.load_robot(\"{robot.id}.toml\")"
    return f"robot = kin.robot_from_dict({_fields(robot, 28)})"


def _fields(robot: Robot, indent: int) -> str:
    """The fields of the arm's robot file as a dict in Python, of which all lines but the first are indented."""
    fields = pformat(robot_to_dict(named(robot)), width=100, sort_dicts=False)
    return textwrap.indent(fields, " " * indent).lstrip()


def _address(moment: Moment) -> str:
    """The address below which the operations on the arm are; the visitor's own is sent along."""
    return f"{moment.address}api/v1" if moment.own else f"{moment.address}api/v1/robots/{moment.robot.id}"


def _question(moment: Moment) -> dict[str, object]:
    target: dict[str, object] = {"position": _list(moment.target[:3, 3])}
    if moment.task != "position":
        target["wxyz"] = _list(wxyz_from_rotation(moment.target[:3, :3]))
    question: dict[str, object] = {"target": target, "task": moment.task, "q_seed": _list(moment.q)}
    if moment.avoid:
        question["avoid_self_collision"] = True
    if moment.avoid and moment.obstacles:
        question["obstacles"] = [_fields_of(each) for each in moment.obstacles]
    return question


def _fields_of(obstacle: Obstacle) -> dict[str, Any]:
    """The fields of an obstacle, rounded as poses are; without a rotation if it has none."""
    found = {
        key: _list(np.array(value)) if isinstance(value, list) else value
        for key, value in obstacle.as_dict().items()
    }
    return found if any(found["rpy"]) else {key: value for key, value in found.items() if key != "rpy"}


def _obstacle(obstacle: Obstacle) -> str:
    """Python that makes an obstacle."""
    return f"kin.Obstacle({', '.join(f'{key}={value!r}' for key, value in _fields_of(obstacle).items())})"


def _listed(moment: Moment, code: Callable[[Obstacle], str], use: str) -> str:
    """Python that assigns the obstacles, if there are any; `use`: how they are avoided, where they are not."""
    if not moment.obstacles:
        return ""
    hint = "" if moment.avoid else f"  # {use} avoids them"
    return "obstacles = [" + hint + "\n" + "".join(f"    {code(each)},\n" for each in moment.obstacles) + "]\n"


def _product(T: Array, rows: tuple[Joint, ...], convention: str) -> Array:
    for row in rows:
        T = T @ row_transform(row, 0.0, convention)
    return T


def _link(row: Joint, suffix: str) -> str:
    slides = row.kind == "prismatic"
    own = {"theta": row.theta} if slides else {"d": row.d}
    values = {**own, "a": row.a, "alpha": row.alpha, "offset": row.d if slides else row.theta}
    # A slide is drawn from 0 to its end there: without limits the toolbox refuses it.
    limits = f", qlim={_list(np.array(row.limits))}" if row.limits is not None else ""
    fields = ", ".join(f"{name}={_text(value)}" for name, value in values.items() if value != 0.0)
    return f"{'Prismatic' if slides else 'Revolute'}{suffix}({(fields + limits).removeprefix(', ')})"


def _text(value: float) -> str:
    # Table entries in full: a rounded alpha would make right angles nearly right ones.
    return repr(value + 0.0)


def _list(values: Array) -> list[float]:
    return [round(value, DIGITS) + 0.0 for value in values.tolist()]


def _row(values: Array) -> str:
    return " ".join(map(repr, _list(values)))


def _rows(T: Array, indent: int = 4) -> str:
    return "".join(f"{' ' * indent}{_list(row)},\n" for row in T)


def _se3(T: Array, indent: int = 0) -> str:
    rows = _rows(T, indent + 4)
    return f"SE3(np.array([\n{rows}{' ' * indent}]), check=False)"


def _matlab(T: Array) -> str:
    return "[" + "; ".join(_row(row) for row in T) + "]"


def _comment(name: str) -> str:
    return " ".join(name.split())
