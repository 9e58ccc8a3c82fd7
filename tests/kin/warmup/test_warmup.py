"""Warm-up: kernels that are loaded or compiled in advance."""

from __future__ import annotations

import subprocess
import sys

import pytest

import kin
from kin import warmup

PROGRAM = """
import sys
sys.path.insert(0, "tests")
import kin
import numpy as np
from arms import random_arms
from kin.ik.table import Table
from kin.motion import Lin, Ptp
from numba.core.dispatcher import Dispatcher

def compilations():
    modules = [m for name, m in sys.modules.items() if name.startswith("kin.")]
    kernels = {id(k): k for m in modules for k in vars(m).values() if isinstance(k, Dispatcher)}
    return {f"{k.__module__}.{k.__name__}": len(k.overloads) for k in kernels.values() if k.overloads}

kin.warm_up(everything=True)
before = compilations()
assert len(before) > 40, before
for robot in kin.files.classic_robots().values():
    T = kin.fk(robot, robot.home)
    kin.jacobian(robot, robot.home)
    for task in ("pose", "approach", "position"):
        kin.solve_ik_many(robot, [T, T], task=task)
        Table.of(robot, np.array([T, T]), kin.IKOptions(task=task))
        for prefer in ("nearest", "limits", "manipulability"):
            kin.solve_ik(robot, T, task=task, prefer=prefer)
            if robot.n > 6:
                kin.solve_ik(robot, T, task=task, prefer=prefer, locked=[None, None, 0.0, *[None] * (robot.n - 3)])
for robot in random_arms(24):
    T = kin.fk(robot, robot.home)
    for task in ("pose", "approach", "position"):
        kin.solve_ik(robot, T, task=task)
    kin.solve_ik(robot, T, q_seed=robot.home)
    kin.solve_path(robot, [T, T])
obstacles = [
    kin.Obstacle("sphere", (0.4, 0.0, 0.2), radius=0.1),
    kin.Obstacle("cylinder", (-0.5, 0.3, 0.2), radius=0.1, height=0.4),
    kin.Obstacle("table", (0.0, 0.0, -0.3), size=(1.0, 1.0, 0.05)),
]
for robot in (*kin.files.classic_robots().values(), *random_arms(8)):
    for q in (robot.q_home, robot.q_home + 0.01, [robot.home] * 3):
        kin.clearance(robot, q)
        kin.clearance(robot, q, obstacles)
    kin.collision.nearest_links(robot, robot.q_home)
    kin.collision.nearest_contact(robot, robot.home, obstacles)
    T = kin.fk(robot, robot.home)
    kin.solve_ik(robot, T, avoid_self_collision=True, obstacles=obstacles[:2])
    kin.solve_path(robot, [T, T], avoid_self_collision=True)
    kin.plan_motion(robot, [kin.motion.Ptp(kin.motion.JointTarget(robot.home))], obstacles=obstacles)
arm = kin.get_robot("pioneer5")
locked = [None, None, None, 0.3, 0.3]
for strategy in ("uniform", "quasi", "boundary", "volume"):
    kin.workspace.workspace_slice(arm, 9, 2, 7, strategy=strategy, measure="limits", with_q=True, locked=locked)
kin.workspace.workspace_section(arm, ((0.0, 0.0, 0.1), (0.0, 1.0, 1.0)), resolution=8, locked=locked)
kin.workspace.workspace_section(arm, resolution=8, locked=locked)
kin.workspace.workspace_facts(arm, effort=2, locked=locked)
for robot in kin.files.classic_robots().values():
    end = kin.motion.JointTarget(robot.q_home + 0.05)
    back = kin.motion.JointTarget(robot.home)
    moves = [Lin(end, blend=0.01), Lin(back, tool_speed=0.1), Ptp(end, blend=0.01), Ptp(back)]
    for jerk_limited in (True, False):
        kin.plan_motion(robot, kin.motion.Program(moves, jerk_limited=jerk_limited))
after = compilations()
assert after == before, {k: n for k, n in after.items() if before.get(k) != n}
"""


@pytest.mark.full
def test_after_warm_up_rest_no_call_compiles_a_kernel():
    """In a separate process, in which nothing else has loaded kernels."""
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_everything_is_warmed_up_on_request(monkeypatch):
    done = []
    monkeypatch.setattr(warmup, "warm_up_rest", lambda: done.append("rest"))
    monkeypatch.setattr(warmup, "one_of_each_family", lambda: (kin.get_robot("planar2r"),))
    kin.warm_up()
    assert done == []
    kin.warm_up(everything=True)
    assert done == ["rest"]


def test_warm_up_rest_can_be_cancelled_between_kernels(monkeypatch):
    steps: list[int] = []
    made = [lambda i=i: steps.append(i) for i in range(9)]
    monkeypatch.setattr(warmup, "parts", lambda: {"one": tuple(made[:4]), "two": tuple(made[4:])})
    warmup.warm_up_rest(lambda: len(steps) == 3)
    assert steps == [0, 1, 2]
    warmup.warm_up_rest()
    assert steps[3:] == list(range(9))
    warmup.warm_up_rest(backwards=True)
    assert steps[12:] == list(range(9))[::-1]


@pytest.mark.full
def test_two_processes_share_the_kernels_of_the_first_arm():
    """One ends with the solver, the other begins with it."""
    program = (
        "import sys; from kin import warmup\n"
        "from kin.ik.candidates import measure_and_sort; from kin.solvers.wrist5.batch import solve_one\n"
        "done = []; step = lambda number, act: (act(), done.append((number, len(solve_one.overloads) > 0)))\n"
        "moves = warmup._moves\n"
        "warmup._moves = lambda robot: [lambda i=i, act=act: step(i, act) for i, act in enumerate(moves(robot))]\n"
        "warmup.warm_up_first(backwards=sys.argv[1] == 'backwards')\n"
        "print(*(number for number, solved in done if not solved), len(measure_and_sort.overloads))"
    )
    for way, before_solver in (("forwards", "0 1 2 3 4 5 1"), ("backwards", "1")):
        done = subprocess.run([sys.executable, "-c", program, way], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == before_solver


def test_kernels_of_all_arms_are_compiled_before_the_service_is_ready(monkeypatch):
    asked: list[tuple[str, str]] = []
    arms = [robot.id for robot in warmup.one_of_each_family()]
    assert len(arms) >= 6

    cached = {warmup.solve_one}
    monkeypatch.setattr(warmup, "is_cached", lambda kernel: kernel in cached)
    monkeypatch.setattr(warmup, "_move", lambda robot: asked.append(("move", robot.id)))
    monkeypatch.setattr(warmup, "_calls", lambda robot: [lambda: asked.append(("all", robot.id))])
    kin.warm_up()
    assert asked == [("move", arms[0])], "a warm cache: what is left loads in milliseconds"
    asked.clear()
    cached.clear()
    kin.warm_up()
    assert asked == [("move", arm) for arm in arms] + [("all", arm) for arm in arms]
