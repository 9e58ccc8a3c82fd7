"""What kernels are called with from Python, and what they do: one call of each entry, from calls of the core.

``recorded.py FILE`` writes them to a file, as the extension answers them. ``recorded.py FILE ANSWERS``, with
KINBOARD_KERNELS=python, calls the same kernels with the same arguments and writes what they do in plain Python.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from arms import made_up_arms, one_of_each_family
from emitted import ROBOTS

from kin import (
    IKOptions,
    Obstacle,
    Robot,
    clearance,
    fk,
    fk_positions,
    ik_branches,
    jacobian,
    link_frames,
    manipulability,
    plan_motion,
    solve_ik,
    solve_ik_many,
    solve_path,
)
from kin.codegen.source import plain
from kin.collision import nearest_links
from kin.collision.contacts import surroundings
from kin.collision.sweep import touches_along
from kin.ik.table import Table
from kin.kernels import ahead
from kin.kernels.compile import PLAIN
from kin.kernels.plain import written
from kin.motion import JointTarget, Lin, PoseTarget, Ptp
from kin.path import path_postures
from kin.solvers import closed_form_of, family_of, general6, general7
from kin.solvers.contract import POSE, SolverInput
from kin.solvers.rounded import Rounded7
from kin.workspace import (
    MEASURES,
    STRATEGIES,
    capability_map,
    workspace_configurations,
    workspace_facts,
    workspace_section,
    workspace_slice,
)

Call = tuple[Any, Any, Any]  # arguments before, arguments after, result
PROBES = "kin.workspace.search.probes._probe_each"  # takes Python a minute: the first cubes are enough


def copied(value: Any) -> Any:
    """A value with its own arrays."""
    if isinstance(value, tuple):
        items = map(copied, value)
        return type(value)(*items) if hasattr(value, "_fields") else tuple(items)
    return value.copy() if isinstance(value, np.ndarray) else value


def same(a: Any, b: Any) -> bool:
    """Whether two results, or two lists of arguments, have the same bits; all NaN are one."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if a is None or b is None:
        return a is b
    a, b = np.asarray(a), np.asarray(b)
    return (a.shape, a.dtype, _bits(a)) == (b.shape, b.dtype, _bits(b))


def _bits(array: np.ndarray[Any, Any]) -> bytes:
    return (np.where(np.isnan(array), np.nan, array) if array.dtype.kind == "f" else array).tobytes()


def recorded() -> dict[str, Call]:
    """The first call of each entry from now on, by its name."""
    calls: dict[str, Call] = {}

    def recording(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def called(*arguments: Any) -> Any:
            if name in calls:
                return call(*arguments)
            before = copied(arguments)
            result = call(*arguments)
            calls[name] = before, copied(arguments), copied(result)
            return result

        return called

    entries = ahead.entries()
    entries |= {name: recording(name, call) for name, call in entries.items()}
    return calls


def moves(robot: Robot) -> None:
    """The calls behind dragging a slider or the target."""
    q = robot.q_home.copy()
    for each in (fk, link_frames, jacobian, manipulability):
        each(robot, q)
    jacobian(robot, np.stack([q, q]))
    for task in ("pose", "approach"):
        _ = solve_ik(robot, fk(robot, q), task=task).redundancy  # made when it is read


def answers(robot: Robot) -> None:
    """The public functions, once along each path that has its own kernel."""
    q = robot.q_home.copy()
    T, pair, far = fk(robot, q), fk(robot, np.stack([q, q])), fk(robot, q)
    far[:3, 3] *= 10.0
    for task in ("pose", "approach"):
        solve_ik_many(robot, pair, task=task)
        Table.of(robot, pair, IKOptions(task=task))
    solve_ik(robot, far, task="pose")
    fk_positions(robot, q)
    _ = solve_ik(robot, T, task="position").redundancy
    solve_ik(robot, T, task="position", prefer="limits")
    solve_ik(robot, T, mask=(True, True, False, False, False, False))
    solve_ik(robot, T, task="pose", prefer="manipulability")
    solve_path(robot, pair)


def collisions(robot: Robot) -> None:
    """Distances to other links and to obstacles."""
    q, box = robot.q_home, Obstacle("box", size=(1.0, 1.0, 1.0))
    nearest_links(robot, q)
    clearance(robot, q)
    clearance(robot, q, [box])
    surroundings(robot, (box,)).touches(q)
    touches_along(surroundings(robot, (box,)), q[None], (), lambda: None)


def motions(robot: Robot) -> None:
    """A motion with lines and a corner of joint moves, from the home pose and back."""
    T = fk(robot, robot.q_home)
    T[2, 3] -= 0.01
    target = PoseTarget.of(T)
    there, back = JointTarget(tuple((robot.q_home + 0.05).tolist())), PoseTarget.of(fk(robot, robot.q_home))
    motion = plan_motion(robot, [Ptp(target), Ptp(there, blend=0.01), Lin(target), Lin(back)])
    motion.sample([0.0, motion.duration])
    path_postures(robot, [fk(robot, robot.q_home)] * 2)


def generally(robot: Robot) -> None:
    """The general solvers of six and seven joints, which can also solve an arm of a family."""
    form = general6.match(robot) or general7.match(robot, general6.match, lambda other: None)
    if form is not None:
        values = (np.nan,) * len(form.redundancies(POSE))
        T = fk(robot, robot.q_home)
        form.solve(SolverInput(T, POSE, values, True, robot.q_home.copy(), robot.lower.copy(), robot.upper.copy()))


def typed(robot: Robot) -> None:
    """The same arm with twists that are rounded: what is true of the table only, not of its family."""
    rows = tuple(replace(row, alpha=round(row.alpha, 4)) for row in robot.rows)
    form = closed_form_of(replace(robot, id=f"{robot.id}-typed", rows=rows))
    if isinstance(form, Rounded7):
        q, limits = robot.q_home, (robot.lower, robot.upper)
        for value in (np.nan, 0.1):
            form.solve(SolverInput(fk(robot, q), POSE, (value,), True, q, *limits))


def singular(robot: Robot) -> None:
    """A target that a curve of configurations meets: an arm with a spherical wrist, which is stretched."""
    q = robot.q_home.copy()
    q[4] = 0.0
    _ = solve_ik(robot, fk(robot, q)).solutions  # made when they are read


def clouds(robots: Iterable[Robot]) -> None:
    """Clouds, sections and maps, of two moving joints: those call the same kernels and take the least time."""
    first, *_ = robots
    locked = [None, None, *first.q_home[2:].tolist()]
    for strategy in STRATEGIES:
        workspace_slice(first, 2, 0, 2, strategy=strategy, measure=MEASURES, locked=locked)
    workspace_configurations(first, 0, locked=locked)
    workspace_section(first, resolution=8, locked=locked)
    workspace_facts(first, effort=2, locked=locked)
    for robot in robots:
        capability_map(robot, resolution=2, directions=12, locked=[None, None, *robot.q_home[2:].tolist()])


def record(file: Path) -> None:
    """Record calls of the core, on one arm of each family."""
    calls = recorded()
    robots = one_of_each_family()
    for robot in (*robots, *made_up_arms()):
        moves(robot)
        answers(robot)
    collisions(robots[0])
    for joints in (6, 7):  # no built-in arm needs the general solvers, but for locked joints
        robot = next(robot for robot in robots if robot.n == joints and robot.revolute.all())
        generally(robot)
        motions(robot)
    for robot in robots:
        if robot.n == 7:
            typed(robot)
        if family_of(robot) == "wrist6":
            singular(robot)
    clouds(robots)
    oblique = ((0.3 * i, 0.1 + 0.1 * i, 0.3 - 0.05 * i, 0.7 + 0.1 * i) for i in range(3))
    made_up = (robot for name, robot in ROBOTS.items() if name.startswith("made-up"))
    for robot in (*robots, *made_up, Robot.from_dh(oblique, home=[0.3, 0.5, 0.7])):
        T = fk(robot, robot.q_home)
        if closed_form_of(robot) is not None:
            ik_branches(robot, T)
            ik_branches(robot, np.stack([T, T]))
    *given, distance = calls[PROBES][0]
    some = copied((*given, distance[:20]))
    calls[PROBES] = copied(some), some, ahead.entries()[PROBES](*some)
    file.write_bytes(pickle.dumps(calls))


def kernel_of(name: str) -> Any:
    """The function of a kernel."""
    module, _, attribute = name.rpartition(".")
    return plain(getattr(import_module(module), attribute))


def answer(file: Path, to: Path) -> None:
    """What the kernels do as they are written: (arguments after, result) by their names."""
    assert PLAIN
    found = {}
    for name, (arguments, _, _) in pickle.loads(file.read_bytes()).items():
        result = written(kernel_of(name))(*arguments)
        found[name] = arguments, result
    to.write_bytes(pickle.dumps(found))


if __name__ == "__main__":
    files = list(map(Path, sys.argv[1:]))
    (record if len(files) == 1 else answer)(*files)
