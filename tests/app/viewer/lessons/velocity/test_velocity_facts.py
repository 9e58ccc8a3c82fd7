"""What the lesson "Velocity" knows, without a page, against computations by NumPy alone."""

from __future__ import annotations

import math

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import STORE, bare_page

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.velocity.facts import VelocityFacts, scale_of
from app.viewer.lessons.velocity.lesson import VelocityLesson
from app.viewer.lessons.velocity.settings import SPEEDS, Statics, VelocitySettings

NEAR = 2e-8  # of differences of poses
ARMS = pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])


def facts(robot: kin.Robot, seed: int, **settings: object) -> VelocityFacts:
    q = robot.random_q(np.random.default_rng(seed))
    return VelocityFacts(VelocitySettings(**settings), Arm(robot, q, q))


@ARMS
@pytest.mark.parametrize("seed", range(4))
def test_jacobian_ellipsoid_and_torques(robot: kin.Robot, seed: int) -> None:
    force = (3.0, -7.5, 2.0)
    known = facts(robot, seed, frame="tool", ellipsoid="force", statics=Statics(True, force))
    J, R = numpy_arm.jacobian(robot, known.q), numpy_arm.pose(robot, known.q)[:3, :3]
    assert pytest.approx(numpy_arm.pose(robot, known.q), abs=1e-12) == known.T
    assert pytest.approx(J, abs=NEAR) == known.J
    assert known.rows == pytest.approx(np.kron(np.eye(2), R.T) @ J, abs=NEAR)
    # Principal axes: eigenvectors of J Jᵀ, of which the eigenvalues are the squares of the singular values.
    squares, vectors = np.linalg.eigh(J[:3] @ J[:3].T)
    assert np.sort(known.axes.values**2) == pytest.approx(np.sort(np.abs(squares)), abs=1e-6)
    finite = known.axes.values > 1e-3
    assert known.semi[finite] * np.sqrt(squares[::-1][finite]) == pytest.approx(1.0, abs=1e-4)
    for seen in ("velocity", "turning", "force", "moment"):
        other = facts(robot, seed, ellipsoid=seen)
        part = J[:3] if seen in ("velocity", "force") else J[3:]
        turned = other.axes.R.T @ (part @ part.T) @ other.axes.R
        assert turned == pytest.approx(np.diag(other.axes.values**2), abs=1e-6)
        assert scale_of(robot, seen) > 0.0
    # Virtual work: a joint's torque is the work of the force for a unit of its motion.
    for i, e in enumerate(np.eye(robot.n)):
        moved = numpy_arm.pose(robot, known.q + 1e-6 * e) - numpy_arm.pose(robot, known.q - 1e-6 * e)
        assert known.torques[i] == pytest.approx(moved[:3, 3] @ force / 2e-6, abs=1e-6)
    direction, cost = known.least
    assert np.linalg.norm(J[:3].T @ direction) == pytest.approx(cost, abs=NEAR)
    assert cost == pytest.approx(math.sqrt(max(squares[0], 0.0)), abs=1e-4)
    assert abs(direction @ vectors[:, 0]) == pytest.approx(1.0, abs=1e-4) or squares[1] - squares[0] < 1e-4


@ARMS
@pytest.mark.parametrize("goal", ["limits", "manipulability"])
def test_null_space_and_its_joint_speeds(robot: kin.Robot, goal: str) -> None:
    for seed, speed in enumerate(SPEEDS):
        known = facts(robot, 10 + seed, goal=goal, speed=speed)
        J, R = numpy_arm.jacobian(robot, known.q), known.T[:3, :3]
        rows = {"pose": J, "approach": np.vstack([J[:3], R[:, :2].T @ J[3:]]), "position": J[:3]}[known.task]
        values = np.linalg.svd(rows, compute_uv=False)
        assert known.space.rank == (values > 1e-5).sum()
        z, by_v, own = known.speeds
        assert rows @ own == pytest.approx(0.0, abs=1e-6)
        if known.space.rank == len(rows):
            assert (rows @ by_v)[:3] == pytest.approx(SPEEDS[speed], abs=1e-6)
            assert known.measure == pytest.approx(math.sqrt(np.linalg.det(rows @ rows.T)), abs=1e-6)
            # The rest of z is in the row space.
            assert np.linalg.lstsq(rows.T, z - own, rcond=None)[0] @ rows == pytest.approx(z - own, abs=1e-5)
        assert known.margin == pytest.approx(_room(robot, known.q), abs=1e-12)
        if goal == "limits":
            assert z == pytest.approx(_towards_the_middle(robot, known.q), rel=1e-4, abs=1e-6)


def _room(robot: kin.Robot, q: np.ndarray) -> float:
    found = [
        min(x - low, high - x) / ((high - low) / 2)
        for x, low, high in zip(q, robot.lower, robot.upper, strict=True)
        if math.isfinite(high - low)
    ]
    return float(min(found, default=1.0))


def _towards_the_middle(robot: kin.Robot, q: np.ndarray) -> np.ndarray:
    """The gradient of −½Σ((q − middle)/half)², by differences."""

    def cost(x: np.ndarray) -> float:
        half, middle = (robot.upper - robot.lower) / 2, (robot.upper + robot.lower) / 2
        return -0.5 * sum(((a - m) / h) ** 2 for a, m, h in zip(x, middle, half, strict=True) if math.isfinite(h))

    return np.array([(cost(q + e) - cost(q - e)) / 2e-6 for e in 1e-6 * np.eye(robot.n)])


@ARMS
def test_lost_directions_are_those_that_no_joint_moves(robot: kin.Robot) -> None:
    met = 0
    for near in kin.singularities(robot, robot.q_home):
        if len(near.met_at) != 1 or near.kind == "algorithmic":
            continue
        (joint, value), q = near.met_at[0], robot.q_home.copy()
        q[joint] = value
        known = VelocityFacts(VelocitySettings(), Arm(robot, q, q))
        if known.state != "at":
            continue
        met += 1
        J = numpy_arm.jacobian(robot, q)
        assert len(known.twists) == len(known.lost_words) > 0
        for twist in known.twists:
            assert np.linalg.norm(twist) == pytest.approx(1.0)
            assert twist @ J == pytest.approx(0.0, abs=1e-5)
    assert met or robot.id in ("panda", "planar2r"), "no singularity is one joint away from home"
    far = facts(robot, 3)
    assert (len(far.twists) == 0) == (far.state == "far")


# Messages of a frame without numbers, as many as before this lesson was declared.
FRAMES = {"default": 4.0, "everything": 6.5, "nothing": 1.0}
SETTINGS: dict[str, dict[str, object]] = {
    "default": {},
    "everything": {"joint": 2, "statics": {"on": True, "force": [1.0, 2.0, 3.0]}},
    "nothing": {"ellipsoid": "none"},
}


@pytest.mark.parametrize("case", FRAMES)
def test_a_frame_takes_no_more_messages_than_before(case: str) -> None:
    robot, count = STORE.get("ur5"), 60
    with bare_page(robot) as page:
        lesson = page.open(VelocityLesson)
        page.restore(SETTINGS[case])
        page.watch()
        for share in np.linspace(0.0, 1.0, count + 1)[1:]:
            page.use(robot, robot.q_home + share * np.array([0.3, -0.2, 0.25, 0.1, 0.2, 0.3]))
            lesson.on_arm_changed(page.now.changes(None))
        assert len(page.sent) / count <= FRAMES[case]
        assert len(page.sent) > 0.9 * count
