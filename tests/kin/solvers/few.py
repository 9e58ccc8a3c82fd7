"""Arms with three to five revolute joints, from the makers' data or, where "like" is said, with round numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kin import Joint, Robot

PI = math.pi
Row = tuple[float, float, float, float]


def arm(name: str, *rows: Row, turned: float = 0.0) -> Robot:
    """Revolute joints from rows (θ, d, a, α) of a standard table; the tool is `turned` about its x axis."""
    joints = tuple(Joint(f"joint {i + 1}", *row, limits=(-PI, PI)) for i, row in enumerate(rows))
    home = (0.1, 0.2, -0.3, 0.4, 0.5)[: len(rows)]
    c, s = round(math.cos(turned), 12), round(math.sin(turned), 12)
    tool = ((1.0, 0.0, 0.0, 0.0), (0.0, c, -s, 0.0), (0.0, s, c, 0.0), (0.0, 0.0, 0.0, 1.0))
    return Robot(name, name, "test", "standard", joints, home, tool=tool)


SCORBOT = arm(
    "scorbot-er7",
    (0, 0.3585, 0.05, -PI / 2),
    (0, -0.037, 0.3, 0),
    (0, 0, 0.35, 0),
    (0, 0, 0, -PI / 2),
    (0, 0.251, 0, 0),
)
RM501 = arm(
    "rm-501",
    (0, 0.25, 0, PI / 2),
    (0, 0, 0.22, 0),
    (0, 0, 0.16, 0),
    (PI / 2, 0, 0, PI / 2),
    (0, 0.1, 0, 0),
)
YOUBOT = arm(
    "youbot",
    (0, 0.147, 0.033, PI / 2),
    (PI / 2, 0, 0.155, 0),
    (0, 0, 0.135, 0),
    (-PI / 2, 0, 0, -PI / 2),
    (0, 0.2175, 0, 0),
)
# Offsets in every place, and a gripper beside the roll axis.
OFFSETS = arm(
    "offsets5",
    (0.3, 0.3, 0.07, -PI / 2),
    (0.2, 0.06, 0.3, PI),
    (-0.4, 0.02, 0.28, PI),
    (0.1, 0.03, 0.04, PI / 2),
    (0, 0.12, 0.02, 0.4),
)
DESKTOP = arm(
    "desktop4-like",
    (0, 0.14, 0.01, PI / 2),
    (0, 0, 0.13, 0),
    (0, 0, 0.124, 0),
    (0, 0, 0.126, 0),
    turned=PI / 2,
)
PITCH = (SCORBOT, RM501, YOUBOT, OFFSETS, DESKTOP)
# Five joints without three parallel axes in the middle.
ELBOW5 = arm(
    "offset-elbow5-like",
    (0, 0.3, 0.05, -PI / 2),
    (0, 0.1, 0.4, 0),
    (0, 0, 0.02, -PI / 2),
    (0, 0.4, 0, PI / 2),
    (0, 0, 0, -PI / 2),
)
ELBOW3 = arm("elbow3-like", (0, 0.3, 0.05, PI / 2), (0, 0.1, 0.4, 0), (0, 0, 0.35, 0))
SPATIAL3 = arm("orthogonal3", (0, 0, 0.2, PI / 2), (0, 0.3, 0.3, -PI / 2), (0, 0.1, 0.25, 0))


# Links that turn about parallel axes, and two joints in general position.
PLANAR2, PLANAR4 = (arm(f"planar{n}", *((0.1 * i, 0.05, 0.4 - 0.05 * i, 0) for i in range(n))) for n in (2, 4))


def random_arm(joints: int, seed: int) -> Robot:
    """A table of random numbers."""
    rng = np.random.default_rng(seed)
    rows = [(rng.uniform(-3, 3), *rng.uniform(-0.5, 0.5, 2), rng.uniform(-3, 3)) for _ in range(joints)]
    return arm(f"random{joints}-{seed}", *((float(t), float(d), float(a), float(x)) for t, d, a, x in rows))


OBLIQUE2 = random_arm(2, 1)
TURNED3 = arm("turned3", (0.3, 0.2, 0.3, 1.1), (-0.4, 0.1, 0.25, 0.7), (0.2, 0.15, 0, 0.4))
GENERAL = (ELBOW5, ELBOW3, SPATIAL3, random_arm(5, 1), random_arm(4, 1), random_arm(3, 1))


def typed_arm(joints: int, seed: int) -> Robot:
    """A random table as people type them: right angles with four to six decimals, many zeros, often planar."""
    rng = np.random.default_rng(seed)
    digits, planar = int(rng.integers(4, 7)), rng.random() < 0.3
    rows = []
    for i in range(joints):
        twists = (0.0, PI) if planar and i < joints - 1 else (0.0, PI / 2, -PI / 2, PI)
        alpha = rng.choice(twists) if planar or rng.random() < 0.9 else rng.uniform(-3, 3)
        theta = rng.choice((0.0, 0.0, PI / 2, -PI / 2, rng.uniform(-3, 3)))
        d, a = rng.choice((0.0, rng.uniform(-0.5, 0.5))), rng.choice((0.0, *rng.uniform(-0.5, 0.5, 2)))
        rows.append((round(theta, digits), round(d, 4), round(a, 4), round(alpha, digits)))
    robot = arm(f"typed{joints}-{seed}", *((float(t), float(d), float(a), float(x)) for t, d, a, x in rows))
    if rng.random() < 0.5:
        return robot
    spans = [(-round(low, 2), round(high, 2)) for low, high in rng.uniform(0.5, 3.0, (joints, 2)).tolist()]
    narrow = tuple(replace(row, limits=span) for row, span in zip(robot.rows, spans, strict=True))
    return replace(robot, rows=narrow)
