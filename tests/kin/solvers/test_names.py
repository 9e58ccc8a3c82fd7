"""The name of a branch says what one sees: every part is compared with positions computed by forward kinematics.

The joint axes are read off the Jacobian at random configurations, whose columns are their directions and moments.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from arms import GEN3, eight_joints, nested, reversed_at

import kin
from kin import Joint, Robot
from kin.solvers import closed_form_of

PI = math.pi
# The names of pair2 are tested in test_pair2.py.
BUILT_IN = tuple(
    robot
    for robot in kin.files.classic_robots().values()
    if (form := closed_form_of(robot)) is not None and form.name != "pair2"
)
CEILING = np.diag([1.0, -1.0, -1.0, 1.0])
WALL = np.array([[0.0, 0, 1, 0.2], [0, 1, 0, 0.3], [-1, 0, 0, 0.9], [0, 0, 0, 1]])
SLANTED = np.array([[0.8, 0, 0.6, 0.2], [0, 1, 0, 0.3], [-0.6, 0, 0.8, 0.9], [0, 0, 0, 1]])
TURNED = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def mounted(robot, word, T):
    return replace(robot, id=f"{robot.id}-{word}", base=nested(T @ robot.T_world_base))


def factory(a1):
    """An arm like most in factories; axis 2 is a1 metres from axis 1."""
    rows = (
        (0.4, a1, -PI / 2),
        (0.0, 0.45, 0.0),
        (0.0, 0.035, -PI / 2),
        (0.42, 0, PI / 2),
        (0, 0, -PI / 2),
        (0.08, 0, 0),
    )
    joints = tuple(Joint(f"A{i + 1}", 0.3 if i == 4 else 0.0, *row) for i, row in enumerate(rows))
    return Robot(f"factory{a1:+}", "factory arm", "test", "standard", joints, (0.0,) * 6)


def backwards(robot):
    """The Stanford arm with a boom that counts the other way."""
    rows = list(robot.rows)
    rows[2] = replace(rows[2], limits=(-rows[2].limits[1], -rows[2].limits[0]))
    home = list(robot.home)
    home[2] = -home[2]
    return replace(robot, id="boom-backwards", rows=tuple(rows), home=tuple(home))


GET = kin.get_robot
OTHERS = (
    *(mounted(robot, "ceiling", CEILING) for robot in BUILT_IN),
    *(
        mounted(GET(name), "wall", WALL)
        for name in ("puma560", "ur5", "scara", "redundant7", "pioneer5", "stanford")
    ),
    mounted(GET("irb120"), "slanted", SLANTED),
    mounted(GET("puma560"), "turned", TURNED),
    reversed_at(GET("pioneer5"), (1, 3)),
    reversed_at(GET("pioneer5"), (0, 2, 4)),
    reversed_at(GET("redundant7"), (0, 2)),
    reversed_at(GET("iiwa14"), (2, 3, 4)),
    reversed_at(GET("puma560"), (0, 1, 4)),
    reversed_at(GET("ur5"), (0, 2, 4)),
    mounted(reversed_at(GET("puma560"), (0,)), "ceiling", CEILING),
    factory(0.0),
    factory(0.15),
    factory(-0.15),
    backwards(GET("stanford")),
    mounted(GET("panda"), "wall", WALL),
    reversed_at(GET("panda"), (1, 3, 4)),
    GEN3,
    reversed_at(GEN3, (1, 2, 5)),
)

# Indices of two axes that meet in the wrist centre (a SCARA has none).
WRISTS = {"wrist5": (3, 4), "wrist6": (3, 4), "slide6": (3, 4), "parallel6": (4, 5), "scara4": (0, 1)}
# Arms whose elbow is joint 4.
FOURTH = ("srs7", "collinear7", "offset7")


class Seen:
    """What a configuration of an arm looks like, from its joint axes as lines."""

    def __init__(self, robot, q):
        self.robot, self.q, self.family = robot, q, closed_form_of(robot).name
        J, self.T = kin.jacobian(robot, q), kin.fk(robot, q)
        turning = robot.revolute
        self.z = np.where(turning, J[3:], J[:3]).T
        self.points = self.T[:3, 3] + np.cross(self.z, J[:3].T)
        # Of two kinds of this family, one has a spherical shoulder, the other a spherical wrist.
        self.shoulder_is_round = self.family == "offset7" and closed_form_of(robot).given == 6
        self.wrist = self.meeting(*((4, 5) if self.shoulder_is_round else WRISTS.get(self.family, (5, 6))))
        own = robot.T_world_base[:3, :3]
        z1 = self.z[0]
        up = next(x for x in (z1[2], z1 @ own[:, 2]) if abs(x) > 1e-6)
        self.up = z1 * np.sign(up)
        self.vertical = abs(z1[2]) > 1.0 - 1e-9
        if self.family != "scara4":
            ahead = np.cross(z1, self.z[1])
            faced = [turn(z1, q[0], own[:, k]) @ ahead for k in (0, 1)]
            self.ahead = ahead * np.sign(faced[0] if abs(faced[0]) > 1e-6 else faced[1])

    def meeting(self, i, j):
        """The point of axis j nearest to axis i."""
        a, b, between = self.z[i], self.z[j], self.points[j] - self.points[i]
        cosine = a @ b
        along = (cosine * (between @ a) - between @ b) / (1.0 - cosine**2) if abs(cosine) < 1.0 - 1e-9 else 0.0
        return self.points[j] + along * b

    def bent(self, joint, value):
        """The same arm with one joint at another value."""
        q = self.q.copy()
        q[joint] = value
        return Seen(self.robot, q)

    def part(self, noun):
        """The part of a true name that begins with this noun."""
        return f"{noun} {getattr(self, f'{noun}_word')()}"

    def shoulder_word(self):
        if self.family == "collinear7":
            side = self.up @ np.cross(self.wrist - self.points[0], self.meeting(2, 3) - self.meeting(0, 2))
            return "left" if side > 0.0 else "right"
        if self.shoulder_is_round:
            upper_arm = self.z[2] * np.sign(robot_length(self.robot, 2))
            return "front" if upper_arm @ self.ahead > 0.0 else "back"
        if self.family == "offset7":
            return "positive" if self.beside(self.wrist - self.meeting(1, 2), 1, 2) else "negative"
        arm = (self.meeting(2, 3) if self.family == "srs7" else self.wrist) - self.points[0]
        if self.family == "parallel6":
            side = self.up @ np.cross(self.ahead * np.sign(arm @ self.ahead), arm)
            return "left" if side > 0.0 else "right"
        return "front" if arm @ self.ahead > 0.0 else "back"

    def stretch(self):
        """Distance of the wrist centre (or of axis 4) from the shoulder, across axis 2."""
        joint = 3 if self.family in FOURTH else 2
        start = self.meeting(2, 3) if joint == 3 else self.points[1]
        if self.family == "offset7" and not self.shoulder_is_round:
            return np.linalg.norm(self.wrist - self.meeting(1, 2))
        if joint == 3:
            return np.linalg.norm(self.wrist - self.meeting(0, 2))
        end = self.points[3] if self.family == "parallel6" else self.wrist
        return np.linalg.norm(np.cross(end - start, self.z[1]))

    def elbow_word(self):
        if self.family == "scara4":
            last = self.points[np.flatnonzero(self.robot.revolute)[2]]
            side = self.up @ np.cross(last - self.points[0], self.points[1] - self.points[0])
            return "left" if side > 0.0 else "right"
        if self.height_is_known():
            places = np.stack([self.points[1], self.points[2], self.wrist])
            x, z = places @ self.ahead, places[:, 2]
            line = z[0] + (z[2] - z[0]) * (x[1] - x[0]) / (x[2] - x[0])
            return "up" if z[1] > line else "down"
        joint = 3 if self.family in FOURTH else 2
        # On the positive side of the straight arm a little more of the joint brings the wrist nearer.
        closer = self.bent(joint, self.q[joint] + 1e-5).stretch() < self.stretch()
        return "positive" if closer else "negative"

    def height_is_known(self):
        between = self.points[1] - self.points[0]
        meet = abs(between @ np.cross(self.z[0], self.z[1])) < 1e-9 and abs(between @ self.ahead) < 1e-9
        return self.family in ("wrist5", "wrist6") and meet and self.vertical

    def beside(self, place, i, j):
        """Whether a place is on the side of the plane of two axes that their product points to."""
        return place @ np.cross(self.z[i], self.z[j]) > 0.0

    def slide_word(self):
        along = (self.wrist - self.points[1]) @ self.z[2]
        return "out" if along * sum(self.robot.joints[2].limits) > 0.0 else "through"

    def straightness(self):
        """Cosine of the angle at the wrist."""
        if self.family == "wrist5":
            return self.z[3] @ self.T[:3, 2]
        first, last = {"parallel6": (3, 5), "wrist6": (3, 5), "slide6": (3, 5)}.get(self.family, (4, 6))
        return self.z[first] @ self.z[last]

    def wrist_word(self):
        if self.shoulder_is_round:
            return "positive" if self.beside(self.meeting(0, 2) - self.wrist, 4, 5) else "negative"
        joint = 5 if self.family in FOURTH else 4
        sign = np.sign(self.bent(joint, 0.0).straightness())
        away = sign * (self.bent(joint, self.q[joint] + 1e-5).straightness() - self.straightness()) < 0.0
        return "no-flip" if away else "flip"


def robot_length(robot, joint):
    """The offset along a joint's axis."""
    return robot.rows[robot.joint_rows[joint]].d


def turn(axis, angle, v):
    return v * math.cos(angle) + np.cross(axis, v) * math.sin(angle) + axis * (axis @ v) * (1.0 - math.cos(angle))


def configurations(robot, count, seed=3):
    rng = np.random.default_rng(seed)
    q = rng.uniform(-PI, PI, (count, robot.n))
    for i, joint in enumerate(robot.joints):
        if joint.kind == "prismatic":
            low, high = joint.limits
            q[:, i] = rng.uniform(low, high, count) * rng.choice([-1.0, 1.0], count)
    return q


@pytest.mark.parametrize(
    ("robot", "count"),
    [(r, 1000) for r in BUILT_IN] + [(r, 100) for r in OTHERS],
    ids=lambda x: getattr(x, "id", ""),
)
def test_each_part_of_a_name_agrees_with_positions_in_space(robot, count):
    form = closed_form_of(robot)
    names, wrong = set(), []
    for q in configurations(robot, count):
        if any(s.distance < 1e-3 for s in form.singularities(q)):
            continue
        name = kin.branch_of(robot, q)
        seen = Seen(robot, q)
        wrong += [(part, true) for part in name.split(" · ") if (true := seen.part(part.split(" ")[0])) != part]
        names.add(name)
    assert not wrong, (len(wrong), set(wrong))
    assert names == set(kin.branch_names(robot))


def test_the_home_poses_are_named_as_they_look():
    def home(name):
        return kin.branch_of(GET(name), GET(name).q_home)

    assert home("puma560") == "shoulder front · elbow up · wrist no-flip"
    assert home("irb120") == "shoulder front · elbow up · wrist no-flip"
    # The same pose of two S-R-S arms whose elbows count in opposite senses, with the elbow at its highest.
    assert home("iiwa14") == "shoulder front · elbow negative · wrist no-flip"
    assert home("redundant7-craig") == "shoulder front · elbow positive · wrist no-flip"


def test_up_and_down_change_places_under_a_ceiling():
    puma = GET("puma560")
    under = mounted(puma, "ceiling", CEILING)
    pairs = zip(kin.branch_names(puma), kin.branch_names(under), strict=True)
    assert all(("elbow up" in a) == ("elbow down" in b) for a, b in pairs)


def test_no_name_speaks_of_height_where_a_branch_has_no_one_height():
    for robot in (
        mounted(GET("puma560"), "wall", WALL),
        factory(0.15),
        GET("ur5"),
        GET("iiwa14"),
        GET("pioneer5"),
    ):
        assert any("elbow positive" in name for name in kin.branch_names(robot)), robot.id


@pytest.mark.parametrize("robot", [*BUILT_IN, *OTHERS], ids=lambda robot: robot.id)
def test_every_part_of_a_name_has_a_meaning(robot):
    meanings = kin.ik.branch_meanings(robot)
    parts = {part for name in kin.branch_names(robot) for part in name.split(" · ")}
    assert set(meanings) == parts
    assert len(set(meanings.values())) == len(parts)


def test_an_arm_without_a_closed_form_has_no_names_and_no_meanings():
    assert kin.branch_names(eight_joints(GET("panda"))) == ()
    assert kin.ik.branch_meanings(eight_joints(GET("panda"))) == {}
