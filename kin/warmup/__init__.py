"""Load or compile the kernels of a service before its first request.

Loading a kernel takes hundredths of a second, compiling one takes seconds, and all of them minutes. A service is
ready once the arm that a page shows first can be moved (`warm_up_first`). The remaining kernels are loaded or
compiled while the first visitors are served, those of that arm first (`warm_up_rest`). They come in named `parts`,
which can be taken in any order, each in small steps.

The array-level call `kin.ik_branches` is not part of a service: its kernels are compiled on first use. Kernels
belong to solver families, not to arms, so one arm of each family is enough.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from types import MappingProxyType

import numpy as np

from kin.collision import Obstacle, clearance, nearest_links
from kin.collision.contacts import surroundings
from kin.collision.sweep import touches_along
from kin.differential.task import Task
from kin.files import classic_robots
from kin.fk import fk, fk_positions, jacobian, link_frames, manipulability
from kin.ik import IKOptions, solve_ik
from kin.ik.batch import solve_ik_many
from kin.ik.candidates import unchecked
from kin.ik.table import Table
from kin.motion import JointTarget, Lin, PoseTarget, Ptp, plan_motion
from kin.path import path_postures, solve_path
from kin.robot import Robot
from kin.solvers import closed_form_of, family_of, general6, general7
from kin.solvers.contract import POSE, ClosedForm, SolverInput
from kin.solvers.rounded import Rounded7
from kin.transforms import Array
from kin.workspace import (
    MEASURES,
    STRATEGIES,
    capability_map,
    workspace_configurations,
    workspace_facts,
    workspace_section,
    workspace_slice,
)

TASKS: tuple[Task, ...] = ("pose", "approach")
# Families of `made_up_arms`, in their order: to match a general arm compiles kernels for many seconds.
MADE_UP = ("parallel5", "planar4", "general5", "pair2", "turned3", "slides3", "slides2")
# Parts that do not belong to a family of arms.
COLLISIONS, MOTIONS, CLOUDS, CAPABILITY = "collisions", "motions", "clouds", "capability"
ALL = "all"

Step = Callable[[], object]


def warm_up_first(*, backwards: bool = False) -> None:
    """Load or compile what moves the first arm.

    A second process that goes backwards compiles the solver meanwhile, which takes as long as all else.
    """
    steps = _moves(_first())
    for step in reversed(steps) if backwards else steps:
        step()


def warm_up(everything: bool = False) -> None:
    """Load what moves the first arm; if that had to be compiled, compile the kernels of all families.

    A cache that contains the kernels of the first arm is assumed to contain the others; they load on first use.

    Args:
        everything: the other kernels as well, such as those of clouds, motions and collisions. On a new machine
            that takes minutes.
    """
    first, *others = one_of_each_family()
    there = compiled()
    _move(first)
    if not there:
        for robot in others:
            _move(robot)
        for robot in (first, *others):
            for step in _calls(robot):
                step()
    if everything:
        warm_up_rest()


def warm_up_rest(cancelled: Callable[[], bool] = lambda: False, *, backwards: bool = False) -> None:
    """Load or compile all remaining kernels; `cancelled` is asked before each step, which may take many seconds.

    Two processes that begin at opposite ends compile different kernels and load the others from the cache.

    Args:
        cancelled: returns True to end the compilation.
        backwards: begin with the last kernels.
    """
    steps = [step for part in parts().values() for step in part]
    for step in reversed(steps) if backwards else steps:
        if cancelled():
            return
        step()


def compiled() -> bool:
    """Whether the kernels of `warm_up_first` are in the cache, judged by its solver's; True without a cache.

    Others are there too where only `kin.fk` has been called.
    """
    return True


def rest_compiled() -> bool:
    """Whether those of `warm_up_rest` are, judged by one of the last."""
    return True


@cache
def parts() -> Mapping[str, tuple[Step, ...]]:
    """The kernels of `warm_up_rest` by name, in its order: the steps that load or compile them.

    The part with the name of a family moves its arms, which the first arm's has no need of; `all_of` the family is
    needed for everything else they do.
    """
    found: dict[str, list[Step]] = {}
    for name, step in _rest():
        found.setdefault(name, []).append(step)
    return MappingProxyType({name: tuple(steps) for name, steps in found.items()})


def first_family() -> str:
    """The family of the first arm, which `warm_up_first` moves."""
    return family_of(_first())


def all_of(family: str) -> str:
    """The name of the part for what arms of a family do besides being moved: other tasks, preferences, paths."""
    return f"{family}-{ALL}"


def one_of_each_family() -> tuple[Robot, ...]:
    """The first built-in arm of each closed form, and the first without one."""
    families: dict[str, Robot] = {}
    for robot in classic_robots().values():
        families.setdefault(family_of(robot), robot)
    return tuple(families.values())


def made_up_arms() -> tuple[Robot, ...]:
    """Arms of the families that no built-in arm belongs to, which visitors may bring."""
    quarter = 0.5 * math.pi
    parallel = ((0, 0.1, 0, quarter), (0, 0, 0.3, 0), (0, 0, 0.2, 0), (0, 0.05, 0, quarter), (0, 0.1, 0, 0))
    oblique = tuple((0.3 * i, 0.1 + 0.1 * i, 0.3 - 0.05 * i, 0.7 + 0.1 * i) for i in range(5))
    planar = ((0, 0.1, 0.3, 0),) * 4
    turned = (*oblique[:2], (0, 0.2, 0, 0.4))
    tables = (parallel, planar, oblique, oblique[:2], turned)
    home = [0.3, 0.5, 0.7, 0.4, 0.6, 0.2]
    arms = tuple(Robot.from_dh(rows, home=home[: len(rows)]) for rows in tables)
    kinds = ("prismatic",) * 3 + ("revolute",) * 3
    gantry = [
        {"kind": kind, "theta": 0.7, "d": 0.1, "a": 0.1, "alpha": 0.9 + 0.1 * i} for i, kind in enumerate(kinds)
    ]
    return *arms, Robot.from_dh(gantry, home=home), Robot.from_dh(gantry[1:4], home=home[:3])


def _first() -> Robot:
    return next(iter(classic_robots().values()))


def _move(robot: Robot) -> None:
    """The calls behind dragging a slider or the target."""
    for step in _moves(robot):
        step()


def _moves(robot: Robot) -> list[Step]:
    q = robot.q_home.copy()

    def solve(task: Task) -> None:
        _ = solve_ik(robot, fk(robot, q), task=task).redundancy  # made when it is read

    steps: list[Step] = [partial(each, robot, q) for each in (fk, link_frames, jacobian)]
    steps += [partial(manipulability, robot, q), unchecked]
    steps += [partial(jacobian, robot, np.stack([q, q]))]  # the gizmo's arrows come from many poses
    return [*steps, *(partial(solve, task) for task in TASKS)]


def _calls(robot: Robot) -> list[Step]:
    """The public functions, once along each path that has its own kernel."""
    q = robot.q_home.copy()
    pair = np.stack([q, q])

    def target(scale: float = 1.0) -> Array:
        T = fk(robot, q)
        T[:3, 3] *= scale
        return T

    def positions() -> None:
        fk_positions(robot, q)
        _ = solve_ik(robot, target(), task="position").redundancy

    def lists() -> None:
        for task in TASKS:
            solve_ik_many(robot, fk(robot, pair), task=task)
            Table.of(robot, fk(robot, pair), IKOptions(task=task))

    return [
        lists,
        lambda: solve_ik(robot, target(10.0), task="pose"),  # the first visitor may well drag it out of reach
        positions,
        lambda: solve_ik(robot, target(), task="position", prefer="limits"),
        lambda: solve_ik(robot, target(), mask=(True, True, False, False, False, False)),
        lambda: solve_ik(robot, target(), task="pose", prefer="manipulability"),
        lambda: solve_path(robot, fk(robot, pair)),
    ]


def _collisions(robot: Robot) -> list[Step]:
    """Distances to other links and to obstacles, which the viewer asks for at each pose of some arms."""
    q, box = robot.q_home, Obstacle("box", size=(1.0, 1.0, 1.0))
    return [
        partial(nearest_links, robot, q),
        partial(clearance, robot, q),
        partial(clearance, robot, q, [box]),
        lambda: surroundings(robot, (box,)).touches(q),
        lambda: touches_along(surroundings(robot, (box,)), q[None], (), lambda: None),
    ]


def _plan(robot: Robot) -> None:
    """A motion with lines and a corner of joint moves, from the home pose and back."""
    T = fk(robot, robot.q_home)
    T[2, 3] -= 0.01
    target = PoseTarget.of(T)
    there, back = JointTarget(tuple((robot.q_home + 0.05).tolist())), PoseTarget.of(fk(robot, robot.q_home))
    motion = plan_motion(robot, [Ptp(target), Ptp(there, blend=0.01), Lin(target), Lin(back)])
    motion.sample([0.0, motion.duration])
    path_postures(robot, [fk(robot, robot.q_home)] * 2)


def _solve_generally(robot: Robot) -> None:
    """The general solvers of six and seven joints, which can also solve an arm of a family."""
    form: ClosedForm | None = general6.match(robot) or general7.match(robot, general6.match, lambda other: None)
    if form is not None:
        values = (math.nan,) * len(form.redundancies(POSE))
        T = fk(robot, robot.q_home)
        form.solve(SolverInput(T, POSE, values, True, robot.q_home.copy(), robot.lower.copy(), robot.upper.copy()))


def _solve_typed(robot: Robot) -> None:
    """The same arm with twists that are rounded: what is true of the table only, not of its family."""
    rows = tuple(replace(row, alpha=round(row.alpha, 4)) for row in robot.rows)
    form = closed_form_of(replace(robot, id=f"{robot.id}-typed", rows=rows))
    if isinstance(form, Rounded7):
        form.prepare(robot.q_home.copy())


def _solve_singular(robot: Robot) -> None:
    """A target that a curve of configurations meets: an arm with a spherical wrist, which is stretched."""
    q = robot.q_home.copy()
    q[4] = 0.0
    _ = solve_ik(robot, fk(robot, q)).solutions  # made when they are read


def _rest() -> Iterator[tuple[str, Step]]:
    """Names of parts, and their steps."""
    robots = one_of_each_family()
    first = robots[0]
    arms = [(family_of(robot), robot) for robot in robots] + list(zip(MADE_UP, made_up_arms(), strict=True))
    for step in _calls(first):
        yield all_of(family_of(first)), step
    for step in _collisions(first):
        yield COLLISIONS, step
    for family, robot in arms[1:]:
        yield from ((family, step) for step in _moves(robot))
    for family, robot in arms[1:]:
        yield from ((all_of(family), step) for step in _calls(robot))
    # No built-in arm needs the general solvers, but for locked joints.
    for joints in (6, 7):
        robot = next(robot for robot in robots if robot.n == joints and robot.revolute.all())
        yield f"general{joints}", partial(_solve_generally, robot)
        yield MOTIONS, partial(_plan, robot)
    for robot in robots:
        if robot.n == 7:
            yield all_of(family_of(robot)), partial(_solve_typed, robot)
        if family_of(robot) == "wrist6":
            yield all_of("wrist6"), partial(_solve_singular, robot)
    # Two moving joints call the same kernels and take the least time.
    locked = [None, None, *first.q_home[2:].tolist()]
    for strategy in STRATEGIES:
        yield CLOUDS, partial(workspace_slice, first, 2, 0, 2, strategy=strategy, measure=MEASURES, locked=locked)
    yield CLOUDS, partial(workspace_configurations, first, 0, locked=locked)
    yield CLOUDS, partial(workspace_section, first, resolution=8, locked=locked)
    yield CLOUDS, partial(workspace_facts, first, effort=2, locked=locked)
    for robot in robots:
        locked = [None, None, *robot.q_home[2:].tolist()]
        yield CAPABILITY, partial(capability_map, robot, resolution=2, directions=12, locked=locked)
