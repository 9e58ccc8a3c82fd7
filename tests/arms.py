"""Names of built-in arms, arms with reversed joints, and random parts for made-up arms.

Laws that hold for any arm are tested on the classics; closed forms, equations, singular curves and golden inverse
kinematics on the arms of the chapter. ``tests/kin/test_arm_library.py`` tests every arm of the library; a test of
all of them has to be cheap.
"""

import math
from dataclasses import replace

import numpy as np

import kin
from kin import Joint, Robot
from kin.ik import IKOptions, JointConstraints
from kin.ik.problem import IKProblem
from kin.solvers import family_of

HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])  # Rx(π)
# Expensive tests run over these, cheap ones over the whole library. Older trees, which the differential test asks
# about these arms, have no others.
CLASSICS = tuple(getattr(kin.files, "classic_robots", kin.builtin_robots)().values())
ONE_OF_EACH_SOLVER = (  # and count of joints
    "pioneer5", "redundant7", "redundant7-craig", "irb120", "panda", "planar2r", "planar3r", "scara", "stanford",
    "ur5", "gofa", "gen3", "so100", "gantry", "palletiser", "prr", "rpp", "rrp",
)  # fmt: skip
CHAPTER_ARMS = ("pioneer5", "redundant7", "redundant7-craig")


def nested(T):
    """A matrix as nested tuples, the form of `Robot.base` and `Robot.tool`."""
    return tuple(tuple(row) for row in np.asarray(T).tolist())


def reversed_at(robot, joints):
    """The same arm in space, described by a table in which the joints with these indices are reversed."""
    rows, base, tool, home = list(robot.rows), np.array(robot.base), np.array(robot.tool), list(robot.home)
    for i in joints:
        k, home[i] = robot.joint_rows[i], -home[i]
        row = rows[k]
        limits = None if row.limits is None else (-row.limits[1], -row.limits[0])
        rows[k] = replace(row, theta=-row.theta, d=-row.d, alpha=row.alpha + math.pi, limits=limits)
        neighbour = k - 1 if robot.convention == "standard" else k + 1
        if neighbour < 0:
            base = base @ HALF_TURN
        elif neighbour == len(rows):
            tool = HALF_TURN @ tool
        else:
            rows[neighbour] = replace(rows[neighbour], alpha=rows[neighbour].alpha + math.pi)
    rows = [replace(row, alpha=math.remainder(row.alpha, 2 * math.pi)) for row in rows]
    name = f"{robot.id}-{''.join(str(i + 1) for i in joints)}"
    return replace(robot, id=name, rows=tuple(rows), home=tuple(home), base=nested(base), tool=nested(tool))


class Draw:
    """Random parts of arms: lengths and twists of either sign, angles, poses."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def length(self):
        return float(self.rng.uniform(0.1, 0.6) * self.rng.choice([-1, 1]))

    def angle(self):
        return float(self.rng.choice([0, math.pi / 2, -math.pi / 2, math.pi, *self.rng.uniform(-3, 3, 4)]))

    def square(self):
        return float(self.rng.choice([-math.pi / 2, math.pi / 2]))

    def parallel(self):
        return float(self.rng.choice([0.0, math.pi]))

    def pose(self):
        R = np.linalg.qr(self.rng.normal(size=(3, 3)))[0]
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R * np.linalg.det(R), self.rng.uniform(-0.3, 0.3, 3)
        return nested(T)


def problem_of(robot, target, q_seed=None, limits=None, locked=None, **options):
    """The checked problem of `kin.solve_ik` with these keywords."""
    return IKProblem.of(robot, target, IKOptions(constraints=JointConstraints(limits, locked), **options), q_seed)


def seven(name, limits, *rows):
    """Seven revolute joints from rows (θ, d, a, α) of a standard table; None stands for one turn of each."""
    spans = [(-math.pi, math.pi)] * 7 if limits is None else limits
    joints = tuple(
        Joint(f"joint {i + 1}", *row, limits=span) for i, (row, span) in enumerate(zip(rows, spans, strict=True))
    )
    return Robot(name, name, "test", "standard", joints, (0.1, 0.2, -0.3, 0.4, 0.5, 0.6, 0.1))


# Arms with seven joints that are not built in, with the lengths and limits that the makers publish. Continuous
# joints have one turn.
_TURN, _WIDE = (-math.pi, math.pi), (-2.0 * math.pi, 2.0 * math.pi)
GEN3 = seven(
    "gen3",
    (_TURN, (-2.41, 2.41), _TURN, (-2.66, 2.66), _TURN, (-2.23, 2.23), _TURN),
    (0, -0.2848, 0, math.pi / 2),
    (math.pi, -0.0118, 0, math.pi / 2),
    (math.pi, -0.4208, 0, math.pi / 2),
    (math.pi, -0.0128, 0, math.pi / 2),
    (math.pi, -0.3143, 0, math.pi / 2),
    (math.pi, 0, 0, math.pi / 2),
    (math.pi, -0.1674, 0, math.pi),
)
XARM7 = seven(
    "xarm7",
    (_WIDE, (-2.059, 2.0944), _WIDE, (-0.19198, 3.927), _WIDE, (-1.69297, math.pi), _WIDE),
    (0, 0.267, 0, -math.pi / 2),
    (0, 0, 0, math.pi / 2),
    (0, 0.293, 0.0525, math.pi / 2),
    (0, 0, 0.0775, math.pi / 2),
    (0, 0.3425, 0, math.pi / 2),
    (0, 0, 0.076, -math.pi / 2),
    (0, 0.097, 0, 0),
)
SAWYER = seven(
    "sawyer",
    (
        (-3.0503, 3.0503),
        (-3.8095, 2.2736),
        (-3.0426, 3.0426),
        (-3.0439, 3.0439),
        (-2.9761, 2.9761),
        (-2.9761, 2.9761),
        (-4.7124, 4.7124),
    ),
    (0, 0.317, 0.081, -math.pi / 2),
    (math.pi / 2, 0.1925, 0, math.pi / 2),
    (0, 0.4, 0, -math.pi / 2),
    (0, -0.1685, 0, math.pi / 2),
    (0, 0.4, 0, -math.pi / 2),
    (0, 0.1363, 0, math.pi / 2),
    (0, 0.13375, 0, 0),
)


def eight_joints(robot):
    """An arm with one revolute joint more than a robot with seven: no closed form covers it."""
    more = Joint("joint 8", 0.0, 0.1, 0.05, math.pi / 2, limits=(-2.0, 2.0))
    home = (*robot.home, 0.3)
    return replace(robot, id=f"{robot.id} and one more", rows=(*robot.rows, more), home=home)


def random_arms(count):
    """Different arms of 2 to 7 joints, with prismatic and fixed rows, in both conventions."""
    draw = Draw(3)
    for k in range(count):
        kinds = ["revolute"] * (2 + k % 6) + ["fixed"] * (k % 4 == 2)
        kinds[k % (2 + k % 6)] = "prismatic" if k % 3 == 1 else "revolute"
        numbers = [(draw.angle(), draw.length(), draw.length(), draw.angle()) for _ in kinds]
        rows = [
            {"kind": kind, "theta": theta, "d": d, "a": a, "alpha": alpha}
            for kind, (theta, d, a, alpha) in zip(kinds, numbers, strict=True)
        ]
        yield Robot.from_dh(rows, "modified" if k % 2 else "standard")


def random_robot(seed):
    """Any arm: 1 to 7 rows of any kind, either convention, with a base and a tool."""
    draw = Draw(seed)
    rng = draw.rng
    rows = []
    for i in range(int(rng.integers(1, 8))):
        kind = str(rng.choice(["revolute", "prismatic", "fixed"], p=[0.7, 0.15, 0.15])) if i else "revolute"
        limits = None if kind == "fixed" else (-1.5, 2.0)
        rows.append(Joint(f"part {i}", draw.angle(), draw.length(), draw.length(), draw.angle(), kind, limits))
    return Robot.from_dh(rows, str(rng.choice(["standard", "modified"])), base=draw.pose(), tool=draw.pose())


def random_table(joints, seed):
    """Numbers without any pattern (even seeds), or as tables are typed: right angles and zeros (odd seeds)."""
    rng = np.random.default_rng([joints, seed])
    rows = []
    for i in range(joints):
        theta, alpha = rng.uniform(-3.0, 3.0, 2).tolist()
        d, a = rng.uniform(-0.5, 0.5, 2).tolist()
        if seed % 2:
            alpha = float(rng.choice((0.0, math.pi / 2, -math.pi / 2, math.pi)))
            theta, d, a = (value if rng.random() < 0.4 else 0.0 for value in (theta, d, a))
        rows.append(Joint(f"joint {i + 1}", theta, d, a, alpha, limits=(-math.pi, math.pi)))
    home = rng.uniform(-0.5, 0.5, joints)
    return Robot.from_dh(rows, ("standard", "modified")[seed // 2 % 2], robot_id=f"{joints}-{seed}", home=home)


def with_slides(robot, seed):
    """The same table with about a third of the joints sliding, at least one."""
    rng = np.random.default_rng([robot.n, seed, 7])
    slides = rng.random(robot.n) < 0.35
    slides[rng.integers(robot.n)] = True
    rows = [
        replace(row, kind="prismatic", limits=(-0.6, 0.6)) if sliding else row
        for row, sliding in zip(robot.rows, slides, strict=True)
    ]
    return replace(robot, id=f"{robot.id}-slides", rows=tuple(rows))


def one_of_each_family():
    """The first built-in arm of each closed form, and the first without one."""
    families = {}
    for robot in CLASSICS:
        families.setdefault(family_of(robot), robot)
    return tuple(families.values())


# Families of `made_up_arms`, in their order.
MADE_UP = ("parallel5", "planar4", "general5", "pair2", "turned3", "slides3", "slides2")


def made_up_arms():
    """Arms of the families that no built-in arm belongs to."""
    quarter = 0.5 * math.pi
    parallel = ((0, 0.1, 0, quarter), (0, 0, 0.3, 0), (0, 0, 0.2, 0), (0, 0.05, 0, quarter), (0, 0.1, 0, 0))
    oblique = tuple((0.3 * i, 0.1 + 0.1 * i, 0.3 - 0.05 * i, 0.7 + 0.1 * i) for i in range(5))
    planar = ((0, 0.1, 0.3, 0),) * 4
    turned = (*oblique[:2], (0, 0.2, 0, 0.4))
    home = [0.3, 0.5, 0.7, 0.4, 0.6, 0.2]
    arms = tuple(Robot.from_dh(t, home=home[: len(t)]) for t in (parallel, planar, oblique, oblique[:2], turned))
    kinds = ("prismatic",) * 3 + ("revolute",) * 3
    gantry = [
        {"kind": kind, "theta": 0.7, "d": 0.1, "a": 0.1, "alpha": 0.9 + 0.1 * i} for i, kind in enumerate(kinds)
    ]
    return *arms, Robot.from_dh(gantry, home=home), Robot.from_dh(gantry[1:4], home=home[:3])
