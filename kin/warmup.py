"""Load or compile the kernels that a service needs once, so that no user waits for it.

Loading a kernel takes some hundredths of a second, compiling one takes seconds. So a service is ready when nothing
needs compiling that forward and inverse kinematics call: with a warm cache as soon as the first arm answers, on a
machine that never ran these kernels after some tens of seconds. What is left is done beside the first visitors.

The thin call (:mod:`kin.ik.batch`) is for who computes, not for who serves: its kernels are compiled when first
used. Kernels belong to families of arms, not to arms: one arm of each family is asked, however many there are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numba.core.event import install_recorder

from kin.catalog import builtin_robots
from kin.fk import fk, fk_positions, jacobian, link_frames, manipulability
from kin.ik import solve_ik
from kin.path import solve_path
from kin.robot import Robot
from kin.solvers import solver_for
from kin.workspace import (
    MEASURES,
    STRATEGIES,
    capability_map,
    configuration_at,
    section,
    workspace_facts,
    workspace_slice,
)


def warm_up() -> None:
    """What readiness means: load what moves the first arm; if that had to be compiled, compile for all arms.

    A cache that has the first arm's kernels is taken to have the others', which then load when first used.
    """
    first, *others = one_of_each_family()
    with install_recorder("numba:compile") as compiled:
        _move(first)
    if compiled.buffer:
        for robot in others:
            _move(robot)
        for robot in (first, *others):
            _ask_all(robot)


def warm_up_rest(stop: Callable[[], bool] = lambda: False) -> None:
    """Load or compile everything else; `stop` is asked before each step, which may take many seconds."""
    for step in _rest():
        if stop():
            return
        step()


def one_of_each_family() -> tuple[Robot, ...]:
    """The first built-in arm of each closed form, and the first that has none."""
    families: dict[str, Robot] = {}
    for robot in builtin_robots().values():
        match = solver_for(robot)
        families.setdefault("" if match is None else match.solver.NAME, robot)
    return tuple(families.values())


def _move(robot: Robot) -> None:
    """What a drag of a slider or of the target asks for."""
    q = robot.q_home.copy()
    T = fk(robot, q)
    link_frames(robot, q)
    jacobian(robot, q)
    manipulability(robot, q)
    solve_ik(robot, T, task="pose")
    solve_ik(robot, T, task="approach")


def _ask_all(robot: Robot) -> None:
    """Each public function along each path that has a kernel of its own."""
    q = robot.q_home.copy()
    T, pair = fk(robot, q), np.stack([q, q])
    fk(robot, pair)
    fk_positions(robot, q)
    jacobian(robot, pair)
    far = T.copy()
    far[:3, 3] *= 10.0
    solve_ik(robot, T, task="position")
    solve_ik(robot, far, task="pose")
    solve_ik(robot, T, mask=(True, True, False, False, False, False))
    solve_ik(robot, T, task="pose", prefer="manipulability")
    solve_path(robot, fk(robot, pair))


def _rest() -> Iterator[Callable[[], object]]:
    robots = one_of_each_family()
    for act in (_move, _ask_all):
        for robot in robots:
            yield partial(act, robot)
    robot = robots[0]
    # Two joints that move suffice: the kernels are the same, what they do takes no time.
    locked = [None, None, *robot.q_home[2:].tolist()]
    for strategy in STRATEGIES:
        yield partial(workspace_slice, robot, 2, 0, 2, strategy=strategy, measure=MEASURES, locked=locked)
    yield partial(configuration_at, robot, 0, locked=locked)
    yield partial(section, robot, resolution=8, locked=locked)
    yield partial(workspace_facts, robot, effort=2, locked=locked)
    for robot in robots:
        still = [None, None, *robot.q_home[2:].tolist()]
        yield partial(capability_map, robot, resolution=2, directions=12, locked=still)
