"""Generated C in this process, targets for it, and what the core answers to them."""

from __future__ import annotations

import ctypes
import math
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from arms import MADE_UP, made_up_arms

import kin
from kin.codegen import families, files, wrappers
from kin.codegen.arm import Arm, arm_of
from kin.differential.metric import weights
from kin.ik.candidates import Requirement, Rows, measure_and_sort
from kin.kernels.checks import straighten
from kin.robot import Robot
from kin.solvers.contract import POSE
from kin.solvers.scaled import in_unit

STATUSES = ("solved", "approximate", "limits", "unmet", "orientation", "unreachable")
STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
# With these C computes what the kernels do, to the last bit: fused operations where they ask for them alone.
# The last makes gcc like clang, which does not define it.
EXACT = ("-mfma", "-ffp-contract=off", "-fno-tree-vectorize", "-U__FP_FAST_FMA")


def _made_up() -> dict[str, Robot]:
    """Arms of families, and of arms solved as other ones, of which no built-in arm is one."""
    right, rng = 0.5 * math.pi, np.random.default_rng(7)
    wrist = [(0.0, 0.1, 0.0, -right), (0.0, 0.0, 0.0, right), (0.0, 0.1, 0.0, 0.0)]
    twists, numbers = rng.choice([right, -right], 6), (rng.uniform(-3.0, 3.0, 6), rng.uniform(-0.5, 0.5, (6, 2)))
    table = np.column_stack([*numbers, twists]).tolist()
    found = dict(zip(MADE_UP, made_up_arms(), strict=True))
    found["four"] = Robot.from_dh([(0.3 * i, 0.1 + 0.1 * i, 0.3 - 0.05 * i, 0.7 + 0.1 * i) for i in range(4)])
    found["small"] = in_unit(kin.get_robot("stanford"), 64.0)
    lift = {"kind": "prismatic"}
    found["order"] = Robot.from_dh([(0.0, 0.3, 0.0, 0.0), lift | {"a": 0.3}, (0.0, 0.0, 0.25, 0.0), *wrist])
    found["tool to base"] = Robot.from_dh(
        [
            dict(zip(("theta", "d", "a", "alpha"), row, strict=True)) | (lift if i in (1, 3) else {})
            for i, row in enumerate(table)
        ]
    )
    return {name: replace(robot, id=f"made-up-{name}") for name, robot in found.items()}


ROBOTS = kin.builtin_robots() | {robot.id: robot for robot in _made_up().values()}


@dataclass
class Built:
    """A library, with the functions of an arm."""

    arm: Arm
    name: str
    library: Any

    def __post_init__(self):
        class Solution(ctypes.Structure):
            _fields_ = (
                ("q", ctypes.c_double * self.arm.robot.n),
                ("branch", ctypes.c_int),
                ("s", ctypes.c_double * 4),
            )

        self.found = (Solution * self.arm.rows)()
        self.scratch = (ctypes.c_double * self.arm.buffer())()

    def call(self, name, *arguments):
        """The status that a function returns, with NumPy arrays and floats as arguments, and its buffer."""
        given = [
            a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) if isinstance(a, np.ndarray)
            else ctypes.c_double(a) if isinstance(a, float) else a
            for a in arguments
        ]  # fmt: skip
        given += [self.scratch] * (self.arm.buffer({"ik": "solve", "ik_at": "solve"}.get(name, name)) > 0)
        return getattr(self.library, f"{self.name}_{name}")(*given)

    def ik(self, T, seed, value=math.nan):
        """(status, joint values ``(k, n)``, errors and distances ``(k, 4)``, branches)."""
        count = ctypes.c_int()
        T, seed = np.ascontiguousarray(T), np.ascontiguousarray(seed)
        if math.isnan(value):
            status = self.call("ik", T, seed, self.found, ctypes.byref(count))
        else:
            status = self.call("ik_at", T, value, seed, self.found, ctypes.byref(count))
        rows = [self.found[k] for k in range(count.value)]
        q, s = np.array([list(r.q) for r in rows]), np.array([list(r.s) for r in rows])
        return STATUSES[status] if status >= 0 else "invalid", q, s, [r.branch for r in rows]


def compiled(arm: Arm, folder: Path, *options: str) -> Built:
    """The C file of an arm as a library; warnings are errors."""
    name = files.name_for(arm.robot, None)
    file, library = folder / f"{name}.c", folder / f"{name}.so"
    file.write_text(files.c_file(arm, name))
    define = f"-D{name.upper()}_IMPLEMENTATION"
    command = ["gcc", "-std=c99", "-shared", "-fPIC", *STRICT, define, *options, file, "-o", library, "-lm"]
    subprocess.run(command, check=True)
    return Built(arm, name, ctypes.CDLL(str(library)))


def exact(robot: kin.Robot, folder: Path, level: str) -> Built:
    """A library that fuses as the kernels do, of functions that take little of the stack."""
    return compiled(arm_of(robot, False), folder, level, "-Wstack-usage=4096", *EXACT)


def targets(robot: kin.Robot, random: int, hard: int):
    """Poses, seeds, and a configuration of each pose that has one: random, then hard ones."""
    rng = np.random.default_rng(7)
    low, high = np.maximum(robot.lower, -math.pi), np.minimum(robot.upper, math.pi)
    q = rng.uniform(low, high, (random + hard, robot.n))
    seeds = rng.uniform(low, high, q.shape)
    for i in range(random, len(q)):
        _harden(q[i], i % 5, rng, robot, (low, high))
        seeds[i] = q[i] + rng.normal(0.0, 0.2, robot.n)
    T = kin.fk(robot, q)
    for i in range(random, len(q)):
        kind = i % 16
        if kind == 5:
            T[i, :3, 3] *= rng.uniform(1.0, 3.0)
        elif kind in (6, 14):
            T[i, :2, 3] *= 0.0 if kind == 6 else 1e-9
        elif kind == 7:
            T[i, :3, 3] = rng.uniform(-1.0, 1.0, 3) * robot.reach
        elif kind == 15:
            seeds[i] = q[i]
    return T, seeds, q


def _harden(q, kind, rng, robot, limits):
    """Quarter turns, zeros, the home pose, beside a quarter turn, and joints at their limits."""
    low, high = limits
    some = rng.random(robot.n) < 0.5
    quarters = np.clip(np.round(q / (math.pi / 2)) * (math.pi / 2), low, high)
    if kind == 0:
        q[some] = quarters[some]
    elif kind == 1:
        q[rng.integers(1, robot.n)] = 0.0
        q[:] = np.clip(q, low, high)
    elif kind == 2:
        q[:] = robot.q_home
    elif kind == 3:
        j = rng.integers(robot.n)
        q[j] = np.clip(quarters[j] + 10.0 ** rng.uniform(-12, -4), low[j], high[j])
    else:
        q[some] = np.where(rng.random(robot.n) < 0.5, low, high)[some]


def answer(arm: Arm, T, seed, value):
    """What the core's kernels find: joint values and statistics of the solutions, the nearest first."""
    robot, form = arm.robot, arm.form
    pose, q, alone = np.empty((4, 4)), np.empty((arm.rows, robot.n)), arm.alone
    assert straighten(np.ascontiguousarray(T), 1e6, pose) >= 0.0
    rows = alone.inner.rows if alone.rows is wrappers.of_counted else alone.rows
    if rows in (families.without_limits, families.of_elimination):
        form.kernels.one(form.kernels.params, pose, value, seed, q)
    else:  # the careful kernel, of regular targets too
        limits, arcs = (robot.lower, robot.upper), np.empty((256, 3))
        alone.rows(alone.inner, alone.params, pose, value, seed, limits, arcs, q)
    k = len(q)
    rows = Rows(q, np.empty((k, 5)), np.empty(k, bool), np.empty(k, bool), np.empty(k, np.int64))
    turns = arm.constants["turns" if math.isnan(value) else "held"]
    limits = robot.lower, robot.upper, turns, weights(robot)
    requirement = Requirement(robot.model, np.zeros(7), *limits, POSE, True)
    count = measure_and_sort(requirement, pose, seed, seed, rows)
    return count, rows
