"""What the lesson "Postures" knows, without a page, against poses and differences by NumPy alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import STORE, bare_page, state_of

import kin
from app.viewer.arm import Arm
from app.viewer.lessons.postures.directions import Cone, sphere
from app.viewer.lessons.postures.facts import PosturesFacts
from app.viewer.lessons.postures.lesson import Postures
from app.viewer.lessons.postures.settings import PosturesSettings, names_of

ARMS = pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])
TASKS: dict[str, kin.ik.Task] = {"planar2r": "position", "pioneer5": "approach"}


def facts(robot: kin.Robot, seed: int, **settings: object) -> PosturesFacts:
    """Of a random configuration whose tool is the target."""
    q = robot.random_q(np.random.default_rng(seed))
    arm = Arm(robot, q, q, task=TASKS.get(robot.id, "pose"))
    return PosturesFacts(PosturesSettings(**settings), arm)


def misses(robot: kin.Robot, q: np.ndarray, known: PosturesFacts, task: kin.ik.Task) -> float:
    """How far a configuration is from the target, in what the task asks for."""
    T, here = numpy_arm.pose(robot, known.q), numpy_arm.pose(robot, q)
    rows = {"position": T[:3, 3:], "approach": T[:3, 2:], "pose": T[:3]}
    there = {"position": here[:3, 3:], "approach": here[:3, 2:], "pose": here[:3]}
    return float(np.abs(rows[task] - there[task]).max())


@ARMS
def test_postures_reach_the_target_as_their_words_say(robot: kin.Robot) -> None:
    for seed in range(3):
        known = facts(robot, seed)
        assert tuple(p.name for p in known.postures) == known.names == names_of(robot)
        states = {p.state for p in known.postures}
        assert "reachable" in states, "the arm is there"
        for posture in known.postures:
            if posture.q is None:
                assert posture.state in ("absent", "unknown")
                continue
            # Of arms with fewer than six joints, a posture outside the limits may have another roll.
            blocked = posture.state == "blocked" and robot.n < 6 and known.arm.task == "pose"
            assert misses(robot, posture.q, known, "approach" if blocked else known.arm.task) < 1e-7
            room = np.minimum(posture.q - robot.lower, robot.upper - posture.q)
            if posture.state == "blocked":
                assert room.min() < 0.0
                continue
            assert room.min() > -1e-9
            weighed = room * np.where(robot.revolute, 1.0, 1.0 / robot.reach)
            nearest = int(np.argmin(weighed))
            if math.isfinite(room[nearest]):
                assert posture.margin == pytest.approx(max(room[nearest], 0.0))
                assert weighed[posture.joint] == pytest.approx(weighed[nearest])
            else:
                assert (posture.margin, posture.joint) == (math.inf, -1)
            J = numpy_arm.jacobian(robot, posture.q)
            J = J[np.abs(J).max(axis=1) > 0.0] if robot.n < 6 else J
            expected = math.sqrt(abs(np.linalg.det(J @ J.T))) if robot.n >= 6 else posture.manipulability
            assert posture.manipulability == pytest.approx(expected, abs=1e-6)


@ARMS
def test_the_present_posture_is_one_whose_configuration_is_that_of_the_arm(robot: kin.Robot) -> None:
    known = facts(robot, 4)
    (present,) = (p for p in known.postures if p.name == known.present)
    assert present.q is not None
    # Arms with seven joints have a circle of configurations in each posture.
    if robot.n <= 6:
        off = np.where(robot.revolute, np.angle(np.exp(1j * (present.q - known.q))), present.q - known.q)
        assert np.abs(off).max() < 1e-6
    assert present.available


@ARMS
def test_hidden_ghosts_are_left_out_and_all_of_them_if_there_are_to_be_none(robot: kin.Robot) -> None:
    names = names_of(robot)
    assert facts(robot, 1).seen == set(names)
    assert facts(robot, 1, hidden=frozenset(names[:1])).seen == set(names[1:])
    assert facts(robot, 1, ghosts=False).seen == set()


@pytest.mark.full
def test_the_cone_has_the_directions_of_which_some_configuration_within_the_limits_is_found() -> None:
    robot = STORE.get("pioneer5")
    rng = np.random.default_rng(6)
    T = numpy_arm.pose(robot, robot.q_home)
    cone = Cone.of(robot, T)
    mask = cone.patch.mask
    assert mask[np.argmax(sphere().directions @ T[:3, 2])], "the arm is there"
    # Configurations whose tool is at this point, found by NumPy.
    found = 0
    for _ in range(200):
        q = robot.q_home + rng.uniform(-0.7, 0.7, robot.n)
        for _ in range(30):
            J = numpy_arm.jacobian(robot, q)[:3]
            q = q + 0.7 * np.linalg.lstsq(J, T[:3, 3] - numpy_arm.pose(robot, q)[:3, 3], rcond=1e-6)[0]
            if np.abs(T[:3, 3] - numpy_arm.pose(robot, q)[:3, 3]).max() < 1e-10:
                break
        inside = (robot.lower + 0.1 < q) & (q < robot.upper - 0.1)
        if not inside.all() or np.abs(T[:3, 3] - numpy_arm.pose(robot, q)[:3, 3]).max() > 1e-9 or found == 12:
            continue
        found += 1
        assert mask[np.argmax(sphere().directions @ numpy_arm.pose(robot, q)[:3, 2])]
    assert found == 12
    turned = T.copy()
    turned[:3, :3] = T[:3, :3] @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert cone.at(turned).patch is cone.patch
    assert replace(cone, T=turned).is_near(T), "the tool has turned about its own direction"
    moved = T.copy()
    moved[0, 3] += 0.05
    assert cone.at(moved).number == 2


# The page


def test_a_target_that_is_missed_is_explained_and_its_remedies_go_with_it() -> None:
    robot = STORE.get("puma560")
    with bare_page(robot) as page:
        lesson = page.open(Postures)
        T = kin.fk(robot, robot.q_home)
        T[0, 3] = 3.0
        page.use(robot, robot.q_home, target=T)
        lesson.on_result(kin.solve_ik(robot, T, q_seed=robot.q_home))
        page.rest()
        assert "Why not?" in str(page.panel())
        assert "(θ₃ = " in str(page.panel()), "with an index, as in the status line"
        labels = [fix.label for fix in lesson.facts.offers]
        assert labels == ["Nearest reachable pose"]
        stale = page.control("Nearest reachable pose")
        page.press("Nearest reachable pose")
        page.rest()
        assert len(page.notices) == 1
        assert np.linalg.norm(page.now.T_tool[:3, 3] - T[:3, 3]) > 1.0
        assert lesson.facts.result is None
        assert "Nearest reachable pose" not in str(page.panel())
        assert state_of(stale).removed


# Messages from one list to the next, as many as before this lesson was declared.
FRAMES = {"ur5": 20.0, "pioneer5": 13.3, "planar2r": 1.0, "scara": 3.2}


@pytest.mark.full
@pytest.mark.parametrize("name", FRAMES)
def test_a_new_list_takes_no_more_messages_than_before(name: str) -> None:
    robot = STORE.get(name)
    with bare_page(robot) as page:
        assert 0.9 <= page.messages_each(page.open(Postures), robot) <= FRAMES[name]
