"""Load or compile the kernels of a service before its first request.

Loading a kernel takes hundredths of a second, compiling one takes seconds, and all of them minutes. A service is
ready once the arm that a page shows first can be moved (`warm_up_first`). The remaining kernels are loaded or
compiled while the first visitors are served, those of that arm first (`warm_up_rest`).

The array-level call (:mod:`kin.ik.batch`) is not part of a service: its kernels are compiled on first use. Kernels
belong to solver families, not to arms, so one arm of each family is enough.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numba.core.event import install_recorder

from kin.collision import Obstacle, clearance, nearest_links, self_distance
from kin.collision.contacts import surroundings
from kin.collision.sweep import touches_along
from kin.files import builtin_robots
from kin.fk import fk, fk_positions, jacobian, link_frames, manipulability
from kin.ik import solve_ik
from kin.ik.candidates import unchecked
from kin.ik.options import Task
from kin.kernels.cache import is_cached
from kin.kernels.fk import fk_one
from kin.motion import JointTarget, Lin, PoseTarget, Ptp, plan_motion
from kin.path import solve_path
from kin.robot import Robot
from kin.solvers import closed_form_of, general6, general7
from kin.solvers.contract import POSE, ClosedForm, SolverInput
from kin.workspace import (
    MEASURES,
    STRATEGIES,
    capability_map,
    configuration_at,
    section,
    workspace_facts,
    workspace_slice,
)
from kin.workspace.capability.kernels import raise_best

TASKS: tuple[Task, ...] = ("pose", "approach")


def warm_up_first(*, backwards: bool = False) -> None:
    """Load or compile what moves the first arm.

    A second process that goes backwards compiles the solver meanwhile, which takes as long as all else.
    """
    steps = _moves(_first())
    for step in reversed(steps) if backwards else steps:
        step()


def warm_up() -> None:
    """Load what moves the first arm; if that had to be compiled, compile the kernels of all families.

    A cache that contains the kernels of the first arm is assumed to contain the others; they load on first use.
    """
    first, *others = one_of_each_family()
    with install_recorder("numba:compile") as compiled:
        _move(first)
    if compiled.buffer:
        for robot in others:
            _move(robot)
        for robot in (first, *others):
            _call_all(robot)


def warm_up_rest(stop: Callable[[], bool] = lambda: False, *, backwards: bool = False) -> None:
    """Load or compile all remaining kernels; `stop` is checked before each step, which may take many seconds.

    Two processes that begin at opposite ends compile different kernels and load the others from the cache.
    """
    steps = list(_rest())
    for step in reversed(steps) if backwards else steps:
        if stop():
            return
        step()


def compiled() -> bool:
    """Whether the kernels of `warm_up_first` are in the cache, judged by one of them; True without a cache."""
    return is_cached(fk_one)


def rest_compiled() -> bool:
    """Whether those of `warm_up_rest` are, judged by one of the last."""
    return is_cached(raise_best)


def one_of_each_family() -> tuple[Robot, ...]:
    """The first built-in arm of each closed form, and the first without one."""
    families: dict[str, Robot] = {}
    for robot in builtin_robots().values():
        match = closed_form_of(robot)
        families.setdefault("" if match is None else match.name, robot)
    return tuple(families.values())


def made_up_arms() -> tuple[Robot, ...]:
    """Arms of the families that no built-in arm belongs to, which visitors may bring."""
    quarter = 0.5 * math.pi
    parallel = ((0, 0.1, 0, quarter), (0, 0, 0.3, 0), (0, 0, 0.2, 0), (0, 0.05, 0, quarter), (0, 0.1, 0, 0))
    oblique = tuple((0.3 * i, 0.1 + 0.1 * i, 0.3 - 0.05 * i, 0.7 + 0.1 * i) for i in range(5))
    planar = ((0, 0.1, 0.3, 0),) * 4
    turned = (*oblique[:2], (0, 0.2, 0, 0.4))
    tables = (parallel, planar, oblique, oblique[:2], turned)
    return tuple(Robot.from_dh(rows, home=[0.3, 0.5, 0.7, 0.4, 0.6][: len(rows)]) for rows in tables)


def _first() -> Robot:
    return next(iter(builtin_robots().values()))


def _move(robot: Robot) -> None:
    """The calls behind dragging a slider or the target."""
    for step in _moves(robot):
        step()


def _moves(robot: Robot) -> list[Callable[[], object]]:
    q = robot.q_home.copy()

    def solve(task: Task) -> None:
        _ = solve_ik(robot, fk(robot, q), task=task).redundancy  # made when it is read

    steps: list[Callable[[], object]] = [partial(each, robot, q) for each in (fk, link_frames, jacobian)]
    steps += [partial(manipulability, robot, q), unchecked]
    return [*steps, *(partial(solve, task) for task in TASKS)]


def _call_all(robot: Robot) -> None:
    """The public functions, once along each path that has its own kernel."""
    q = robot.q_home.copy()
    T, pair = fk(robot, q), np.stack([q, q])
    fk(robot, pair)
    fk_positions(robot, q)
    jacobian(robot, pair)
    far = T.copy()
    far[:3, 3] *= 10.0
    _ = solve_ik(robot, T, task="position").redundancy
    solve_ik(robot, T, task="position", prefer="limits")
    solve_ik(robot, far, task="pose")
    solve_ik(robot, T, mask=(True, True, False, False, False, False))
    solve_ik(robot, T, task="pose", prefer="manipulability")
    solve_path(robot, fk(robot, pair))


def _collide(robot: Robot) -> None:
    """Distances to other links and to obstacles, which the viewer asks for at each pose of some arms."""
    q = robot.q_home
    nearest_links(robot, q)
    self_distance(robot, q)
    box = Obstacle("box", size=(1.0, 1.0, 1.0))
    clearance(robot, q, [box])
    near = surroundings(robot, (box,))
    near.touches(q)
    touches_along(near, q[None], (), lambda: None)


def _plan(robot: Robot) -> None:
    """A motion with lines and a corner of joint moves, from the home pose and back."""
    T = fk(robot, robot.q_home)
    T[2, 3] -= 0.01
    target = PoseTarget.of(T)
    there, back = JointTarget(tuple((robot.q_home + 0.05).tolist())), PoseTarget.of(fk(robot, robot.q_home))
    motion = plan_motion(robot, [Ptp(target), Ptp(there, blend=0.01), Lin(target), Lin(back)])
    motion.sample([0.0, motion.duration])


def _solve_generally(robot: Robot) -> None:
    """The general solvers of six and seven joints, which can also solve an arm of a family."""
    form: ClosedForm | None = general6.match(robot) or general7.match(robot, general6.match, lambda other: None)
    if form is not None:
        values = (math.nan,) * len(form.redundancies(POSE))
        T = fk(robot, robot.q_home)
        form.solve(SolverInput(T, POSE, values, True, robot.q_home.copy(), robot.lower.copy(), robot.upper.copy()))


def _rest() -> Iterator[Callable[[], object]]:
    yield partial(_collide, _first())
    yield partial(_call_all, _first())
    robots = one_of_each_family()
    for act in (_move, _call_all):
        for robot in (*robots, *made_up_arms()):
            yield partial(act, robot)
    # No built-in arm needs the general solvers, but for locked joints.
    for joints in (6, 7):
        robot = next(robot for robot in robots if robot.n == joints and robot.revolute.all())
        yield partial(_solve_generally, robot)
        yield partial(_plan, robot)
    robot = robots[0]
    # Two moving joints call the same kernels and take the least time.
    locked = [None, None, *robot.q_home[2:].tolist()]
    for strategy in STRATEGIES:
        yield partial(workspace_slice, robot, 2, 0, 2, strategy=strategy, measure=MEASURES, locked=locked)
    yield partial(configuration_at, robot, 0, locked=locked)
    yield partial(section, robot, resolution=8, locked=locked)
    yield partial(workspace_facts, robot, effort=2, locked=locked)
    for robot in robots:
        locked = [None, None, *robot.q_home[2:].tolist()]
        yield partial(capability_map, robot, resolution=2, directions=12, locked=locked)
