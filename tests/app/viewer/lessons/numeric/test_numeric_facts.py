"""What the lesson "Numeric IK" knows, without a page, against steps by NumPy alone."""

from __future__ import annotations

import math

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import STORE, bare_page

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.numeric.facts import Iterated, NumericFacts
from app.viewer.lessons.numeric.lesson import NumericLesson
from app.viewer.lessons.numeric.settings import NumericSettings

ARMS = pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])


def facts(robot: kin.Robot, seed: int, **settings: object) -> NumericFacts:
    """Of a random start, and the pose of another random configuration as the target."""
    q, aim = robot.random_q(np.random.default_rng(seed), 2)
    given = {"target": tuple(numpy_arm.pose(robot, aim).ravel().tolist()), "match": "pose", **settings}
    return NumericFacts(NumericSettings(**given), Arm(robot, q, q))


def ended(known: NumericFacts) -> Iterated:
    """The answer of all slices of the work."""
    *pauses, found = known.iterate()
    assert all(pause is None for pause in pauses)
    assert found is not None
    return found


def missing(robot: kin.Robot, T: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The way of the tool to a pose, and the rotation vector that is left to turn."""
    here = numpy_arm.pose(robot, q)
    R = T[:3, :3] @ here[:3, :3].T
    angle = math.acos(min(1.0, max(-1.0, (np.trace(R) - 1.0) / 2.0)))
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return T[:3, 3] - here[:3, 3], angle * axis / max(float(np.linalg.norm(axis)), 1e-12)


def scaled(robot: kin.Robot, size: float, T: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Error and Jacobian with lengths in arm sizes."""
    far, turn = missing(robot, T, q)
    J = numpy_arm.jacobian(robot, q) * np.where(robot.revolute, 1.0, size)
    J[:3] /= size
    return np.concatenate([far / size, turn]), J


@ARMS
@pytest.mark.parametrize("match", ["point", "pose"])
def test_errors_of_the_iterates_are_those_of_the_tool(robot: kin.Robot, match: str) -> None:
    for seed in range(2):
        known = facts(robot, seed, match=match, method="damped")
        found, T = ended(known), np.array(known.settings.target).reshape(4, 4)
        assert found.run.q[0] == pytest.approx(known.q, abs=0.0)
        for q, far, turned in zip(found.run.q, found.run.far, found.run.turned, strict=True):
            away, turn = missing(robot, T, q)
            assert far == pytest.approx(np.linalg.norm(away), abs=1e-9)
            wanted = 0.0 if match == "point" else np.linalg.norm(turn)
            assert turned == pytest.approx(wanted, abs=1e-6)
        if found.run.outcome == "reached":
            assert found.run.far[-1] < 1e-8


@ARMS
@pytest.mark.parametrize("method", ["newton", "transpose", "damped"])
def test_each_step_is_that_of_its_formula(robot: kin.Robot, method: str) -> None:
    known = facts(robot, 3, method=method, damping=0.2, gain=0.7)
    run, T, size = ended(known).run, np.array(known.settings.target).reshape(4, 4), known.problem.size
    compared = 0
    for before, after in list(zip(run.q[:-1], run.q[1:], strict=True))[:6]:
        e, J = scaled(robot, size, T, before)
        singular = method == "newton" and robot.n >= 6 and np.linalg.cond(J) > 1e4
        if np.linalg.norm(e[3:]) > 3.0 or singular:
            continue  # differences of poses are not exact enough there
        compared += 1
        if method == "newton":
            step = np.linalg.lstsq(J, e, rcond=1e-5)[0]
        elif method == "damped":
            step = np.linalg.solve(J.T @ J + 0.2**2 * np.eye(robot.n), J.T @ e)
        else:
            slope = J.T @ e
            step = 0.7 * slope * float(slope @ slope) / float((J @ slope) @ (J @ slope))
        taken = (after - before) / np.where(robot.revolute, 1.0, size)
        assert taken == pytest.approx(step, rel=1e-3, abs=1e-5)
    assert compared or run.count == 0


@ARMS
def test_steps_keep_to_their_limit_and_joints_to_theirs(robot: kin.Robot) -> None:
    run = ended(facts(robot, 5, method="newton", longest=0.1, limits=True)).run
    assert ((robot.lower - 1e-12 <= run.q) & (run.q <= robot.upper + 1e-12)).all()
    travel = np.abs(np.diff(run.q, axis=0)) / np.where(robot.revolute, 1.0, facts(robot, 5).problem.size)
    assert travel.max(initial=0.0) <= 0.1 + 1e-12
    assert facts(robot, 5, longest=math.pi).options.longest == math.inf


@ARMS
def test_exact_solutions_have_the_target_and_there_are_none_if_joints_can_move_on(robot: kin.Robot) -> None:
    for match in ("point", "pose"):
        known = facts(robot, 8, match=match)
        found = ended(known)
        J = numpy_arm.jacobian(robot, robot.random_q(np.random.default_rng(2)))[: 3 if match == "point" else 6]
        mobile = np.linalg.matrix_rank(J, tol=1e-6) < robot.n
        assert (found.solutions is None) == mobile
        T = np.array(known.settings.target).reshape(4, 4)
        for q in [] if found.solutions is None else found.solutions:
            away, turn = missing(robot, T, q)
            assert np.linalg.norm(away) < 1e-7
            assert match == "point" or np.linalg.norm(turn) < 1e-6
        assert found.solutions is None or len(found.solutions) > 0, "the target is a pose of the arm"


def test_the_start_follows_the_arm_or_is_held() -> None:
    robot = STORE.get("ur5")
    assert facts(robot, 1).start is facts(robot, 1).q or (facts(robot, 1).start == facts(robot, 1).q).all()
    held = facts(robot, 1, start=(0.1,) * 6)
    assert held.start.tolist() == [0.1] * 6
    assert ended(held).run.q[0].tolist() == [0.1] * 6


def test_comparing_runs_all_methods_with_the_chosen_one_first() -> None:
    known = facts(STORE.get("planar2r"), 2, match="point", method="damped", compare=True)
    found = ended(known)
    assert [method for method, _ in found.runs] == ["damped", "newton", "transpose", "gauss-newton"]
    for method, run in found.runs:
        alone = ended(facts(STORE.get("planar2r"), 2, match="point", method=method)).run
        assert run.q.tolist() == alone.q.tolist()


# The page


def test_a_held_start_and_the_iterate_on_show_are_kept_by_links() -> None:
    robot = STORE.get("planar2r")
    with bare_page(robot) as page:
        lesson = page.open(NumericLesson)
        page.set("Start follows the arm", False)
        page.rest()
        start = lesson.state()["start"]
        assert start == robot.q_home.tolist()
        page.press("Iterate", "First")
        page.press("Iterate", "Next")
        page.rest()
        assert lesson.state()["at"] == 1
        page.press("Arm", "To this iterate")
        page.rest()
        assert lesson.state()["start"] == start
        assert page.now.q == pytest.approx(lesson.facts.iterated.run.q[1])
        state = lesson.state()
    with bare_page(robot) as page:
        again = page.open(NumericLesson)
        page.restore(state)
        assert again.state() == state
        assert again.facts.iterated.run.q[0].tolist() == start
        assert page.control("Start follows the arm").value is False
        page.change(STORE.get("ur5"))
        assert again.state()["start"] is None, "a start of another arm"
        assert again.state()["at"] is None


# Messages from one start to the next, as many as before this lesson was declared.
FRAMES = {"ur5": 8.2, "planar2r": 10.0}


@pytest.mark.parametrize("name", FRAMES)
def test_a_new_start_takes_no_more_messages_than_before(name: str) -> None:
    robot = STORE.get(name)
    with bare_page(robot) as page:
        assert 4.0 < page.messages_each(page.open(NumericLesson), robot) <= FRAMES[name]
