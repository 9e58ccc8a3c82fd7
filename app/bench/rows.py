"""The rows of the benchmark: one task each, with the same targets for all contestants."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

import kin
from app.bench.arms import Arm, arm_of
from app.bench.capsules import distances
from app.bench.robots import robots
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.transforms import Array

Kind = Literal["fk", "branches", "answer", "cloud", "collision", "touch", "edge", "ptp", "points", "pace", "line"]
COLLISIONS: tuple[Kind, ...] = ("touch", "edge")
MOTIONS: tuple[Kind, ...] = ("ptp", "points", "pace", "line")


@dataclass(frozen=True, slots=True)
class Row:
    """One task.

    Attributes:
        id, title: name on the command line, and for people.
        robot: id of the arm, see :mod:`app.bench.robots`.
        kind: ``"fk"``; ``"branches"``, all configurations, ignoring limits; ``"answer"``, at least one inside the
            limits, verified; ``"cloud"``, tool points of configurations that the contestant samples itself;
            ``"collision"``, the least distance between links; ``"touch"``, whether anything touches; ``"edge"``,
            whether it does on a straight motion of the joints that begins free; ``"ptp"``, a motion from home to a
            configuration; ``"points"``, points of one; ``"pace"``, the fastest motion along a given path of the
            joints; ``"line"``, points of a line of the tool from home.
        batch: all targets in one call.
        approach: point and approach direction only; the roll about the tool axis does not matter.
        lock: for a redundant arm, the joint that solvers for six joints lock at `value`.
        caged: whether there are obstacles around the arm, see `CAGE`; links are compared with each other too.
        unverified: whether branches of our array-level call may miss a part of the pose, so that wrong answers
            are expected of it.
        value: value of the locked joint and of our redundancy parameter in radians; NaN if there is none.
    """

    id: str
    title: str
    robot: str
    kind: Kind
    batch: bool = False
    approach: bool = False
    lock: int | None = None
    value: float = math.nan
    caged: bool = False
    unverified: bool = False


_AROUND = 0.5  # m, from the axis of the base
_EDGE = 1.0  # rad, the length of a motion
_DRAWN = 16  # configurations for each one that has to be free
_SHORT = 0.05  # of the way from home to a random configuration: the end of a line that can be driven
# Spheres that VAMP, coal and plain numpy have too; about half of all configurations of the arms touch one.
CAGE = tuple(
    kin.Obstacle("sphere", (_AROUND * math.cos(angle), _AROUND * math.sin(angle), height), radius=0.15)
    for height in (0.25, 0.8)
    for angle in np.arange(0.0, 2.0 * math.pi, math.pi / 3.0).tolist()
)
CLOUD = 16  # batches in a cloud, so that call overhead is negligible and caches are as full as in real use


def _collisions(robot: str) -> tuple[Row, ...]:
    alone, caged = "whether links touch", "whether links or obstacles touch"
    return (
        Row(f"touch-{robot}", alone, robot, "touch"),
        Row(f"touch-{robot}-batch", f"{alone}, batch, per configuration", robot, "touch", batch=True),
        Row(f"cage-{robot}", caged, robot, "touch", caged=True),
        Row(f"cage-{robot}-batch", f"{caged}, batch, per configuration", robot, "touch", batch=True, caged=True),
        Row(f"edge-{robot}", f"{caged} on a motion of 1 rad", robot, "edge", caged=True),
    )


ROWS: tuple[Row, ...] = (
    Row("fk", "forward kinematics, one pose", "pioneer5", "fk"),
    Row("fk-batch", "forward kinematics, tool positions of a batch, per pose", "pioneer5", "fk", batch=True),
    Row("workspace", "a cloud of tool points, per point", "pioneer5", "cloud", batch=True),
    Row("workspace-redundant7", "a cloud of tool points, per point", "redundant7", "cloud", batch=True),
    Row("ik-pioneer5", "all branches, point and approach direction", "pioneer5", "branches", approach=True),
    Row(
        "ik-pioneer5-batch",
        "all branches, point and approach direction, batch, per target",
        "pioneer5",
        "branches",
        batch=True,
        approach=True,
    ),
    Row(
        "ik-srs",
        "all branches of an S-R-S arm at one value of its freedom",
        "redundant7-craig",
        "branches",
        lock=2,
        value=0.3,
    ),
    Row(
        "ik-srs-batch",
        "all branches of an S-R-S arm, batch, per target",
        "redundant7-craig",
        "branches",
        batch=True,
        lock=2,
        value=0.3,
    ),
    Row("ik-puma560", "all branches, six joints, spherical wrist", "puma560", "branches"),
    Row(
        "ik-puma560-batch",
        "all branches, six joints, spherical wrist, batch, per target",
        "puma560",
        "branches",
        batch=True,
    ),
    Row("ik-ur5", "all branches, six joints, three parallel axes", "ur5", "branches"),
    Row(
        "ik-ur5-batch",
        "all branches, six joints, three parallel axes, batch, per target",
        "ur5",
        "branches",
        batch=True,
    ),
    Row("ik-stanford", "all branches, six joints of which one slides", "stanford", "branches"),
    Row(
        "ik-iiwa14",
        "all branches of an S-R-S arm at one value of its freedom",
        "iiwa14",
        "branches",
        lock=2,
        value=0.3,
    ),
    Row("ik-panda", "all branches at one value of joint 7", "panda", "branches", lock=6, value=0.3),
    Row("ik-jaco", "all solutions, six joints in general position", "jaco", "branches"),
    Row("ik-crx", "all solutions, six joints in general position", "crx", "branches"),
    Row("ik-sawyer", "all solutions at one value of joint 7", "sawyer", "branches", lock=6, value=0.3),
    Row("ik-scorbot", "all branches, five joints, three parallel axes", "scorbot", "branches", unverified=True),
    Row("ik-elbow5", "all solutions, five joints in general position", "elbow5", "branches", approach=True),
    Row("solve-pioneer5", "an answer inside the limits, verified", "pioneer5", "answer", approach=True),
    Row("solve-redundant7", "an answer inside the limits, verified", "redundant7", "answer"),
    Row("solve-redundant7-craig", "an answer inside the limits, verified", "redundant7-craig", "answer"),
    Row("solve-panda", "an answer inside the limits, verified", "panda", "answer"),
    Row(
        "solve-pioneer5-batch",
        "an answer inside the limits, verified, batch, per target",
        "pioneer5",
        "answer",
        batch=True,
        approach=True,
    ),
    Row(
        "solve-ur5-batch", "an answer inside the limits, verified, batch, per target", "ur5", "answer", batch=True
    ),
    Row(
        "solve-scorbot-batch",
        "an answer inside the limits, verified, batch, per target",
        "scorbot",
        "answer",
        batch=True,
    ),
    Row(
        "solve-redundant7-craig-batch",
        "an answer inside the limits, verified, batch, per target",
        "redundant7-craig",
        "answer",
        batch=True,
    ),
    Row("collision", "distance of the nearest links, batch, per configuration", "panda", "collision", batch=True),
    *_collisions("panda"),
    *_collisions("ur5e"),
    Row("motion-ptp", "a motion of the joints with limits of jerk", "panda", "ptp"),
    Row("motion-points", "100 points of a motion of the joints", "panda", "points"),
    Row("motion-pace", "the fastest pace on a path, limits of velocity and acceleration", "panda", "pace"),
    Row("motion-line", "100 points of a line of the tool", "ur5", "line"),
)


@dataclass(frozen=True, eq=False)
class Task:
    """A row with its arm and its targets.

    Attributes:
        q: ``(N, n)`` the configurations the targets were made from, inside the limits.
        T: ``(N, 4, 4)`` their poses, by plain matrix products, independent of our kernels.
        obstacles: spheres around the arm.
        ends: ``(N, n)`` where motions of the joints from `q` end, inside the limits; of an edge only.
        arm: the whole arm.
        six: the arm with six joints that turn, for solvers that need six; None if there is none.
    """

    row: Row
    robot: Robot
    q: Array
    T: Array
    arm: Arm
    six: Arm | None
    obstacles: tuple[kin.Obstacle, ...] = ()
    ends: Array | None = None


def prepare(row: Row, size: int, seed: int) -> Task | None:
    """The row's task with `size` targets; None if there is no such arm or it has no closed form the row needs."""
    robot = robots().get(row.robot)
    if robot is None or (row.kind == "branches" and closed_form_of(robot) is None):
        return None
    if row.kind == "cloud":
        q = kin.workspace.workspace_configurations(robot, np.arange(CLOUD * size))
    else:
        q = robot.random_q(np.random.default_rng(seed), size)
    obstacles, ends = CAGE if row.caged else (), None
    if row.kind == "edge":
        rng = np.random.default_rng(seed)
        q = robot.random_q(rng, _DRAWN * size)
        q = q[distances(robot, q, obstacles) > 0.0][:size]
        ways = rng.normal(size=q.shape)
        ends = robot.clip(q + _EDGE * ways / np.linalg.norm(ways, axis=1, keepdims=True))
    if row.lock is not None:
        q[:, row.lock] = row.value
    if row.kind == "line":
        q = robot.clip(robot.q_home + _SHORT * (q - robot.q_home))
    arm = arm_of(robot)
    six = arm
    if row.approach:
        six = arm.with_roll()
    elif arm.n == 5:
        six = arm.with_turn()
    elif row.lock is not None:
        six = arm.locked(row.lock, row.value)
    whole = six.n == 6 and not arm.slides
    T = np.ascontiguousarray(arm.fk(q))
    return Task(row, robot, q, T, arm, six if whole else None, obstacles, ends)
