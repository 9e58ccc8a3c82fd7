"""The postures along a path, against forward kinematics, limits, distances and the planner of motions."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin.path.postures import NEAR_LIMIT, STATES

UR5, PANDA, PLANAR = (kin.get_robot(name) for name in ("ur5", "panda", "planar2r"))
PLACES = 60


def line(robot: kin.Robot, by: tuple[float, float, float], places: int = PLACES) -> np.ndarray:
    """Poses on a line from the home pose, all with its orientation."""
    T = np.repeat(kin.fk(robot, robot.q_home)[None], places, axis=0)
    T[:, :3, 3] += np.linspace(0.0, 1.0, places)[:, None] * by
    return T


def state(found: kin.path.PathPostures, place: int, row: int) -> str:
    return STATES[found.states[place, row]]


CASES = [(UR5, (-0.3, 0.5, -0.1)), (UR5, (0.55, 0.0, 0.0)), (PANDA, (0.2, 0.3, -0.2))]


@pytest.mark.parametrize(("robot", "by"), CASES)
def test_each_cell_is_what_forward_kinematics_and_limits_say(robot, by):
    poses = line(robot, by)
    found = kin.path.path_postures(robot, poses)
    seen = set()
    for place, row in np.ndindex(found.states.shape):
        q, what = found.q[place, row], state(found, place, row)
        seen.add(what)
        if what == "none":
            assert np.isnan(q).all()
            continue
        assert np.abs(kin.fk(robot, q) - poses[place]).max() < 1e-6
        assert kin.branch_of(robot, q) == found.postures[row]
        inside = ((q >= robot.lower - 1e-9) & (q <= robot.upper + 1e-9)).all()
        assert inside == (what != "outside")
        room = np.minimum(q - robot.lower, robot.upper - q).min()
        if what == "free":
            assert room >= NEAR_LIMIT
            assert (place, row) not in found.reasons
        else:
            assert found.reasons[place, row].explain()
        if what == "near limit":
            assert room < NEAR_LIMIT
    assert "free" in seen


@pytest.mark.full
@pytest.mark.parametrize(("robot", "by"), CASES[:2])
def test_the_postures_that_lead_through_are_those_from_which_the_line_can_be_driven(robot, by):
    found = kin.path.path_postures(robot, line(robot, by, 200))
    end = kin.motion.PoseTarget.of(line(robot, by)[-1])
    driven = []
    for row in range(len(found.postures)):
        if state(found, 0, row) in STATES[:3]:
            motion = kin.plan_motion(robot, [kin.motion.Lin(end)], found.q[0, row])
            driven += [row] * motion.planned
            if not motion.planned and motion.refusal.fraction is not None:
                assert found.reach[0, row] / 199 == pytest.approx(motion.refusal.fraction, abs=0.06)
    assert driven == list(found.through)
    names = [found.postures[row] for row in driven]
    assert all(name in found.reason for name in names)


def test_reach_is_what_following_place_by_place_finds():
    """An arm of two joints: its two postures meet only where it is stretched, and it cannot go beyond."""
    lengths = PLANAR.rows[0].a + PLANAR.rows[1].a
    points = np.stack([np.linspace(0.3, 1.2, 91) * lengths, np.full(91, 0.05), np.zeros(91)], axis=1)
    found = kin.path.path_postures(PLANAR, points, options=kin.IKOptions(task="position"))
    last = int(np.flatnonzero(np.linalg.norm(points, axis=1) <= lengths)[-1])
    assert (found.reach[0] == last).all()
    assert (found.reach[last] == last).all()
    assert (found.reach[last + 1 :] == -1).all()
    assert found.through == ()
    assert f"to {100 * last / 90:.0f} % of it" in found.reason


def test_what_touches_is_named_and_ends_the_way():
    poses = line(UR5, (-0.3, 0.5, -0.1))
    free = kin.path.path_postures(UR5, poses)
    row = free.rows[0]
    middle = kin.fk(UR5, free.best.q[PLACES // 2])[:3, 3]
    ball = kin.Obstacle("sphere", middle.tolist(), radius=0.06, name="ball")
    found = kin.path.path_postures(UR5, poses, options=kin.IKOptions(obstacles=(ball,)))
    assert state(found, PLACES // 2, row) == "touches"
    assert "touches ball" in found.reasons[PLACES // 2, row].explain()
    assert found.through == ()
    for place in range(PLACES):
        q = found.q[place, row]
        assert (kin.clearance(UR5, q, [ball]) < 0.0) == (state(found, place, row) == "touches")
    before = next(each for each in found.stretches if (each.posture, each.state) == (row, "touches"))
    assert found.reach[0, row] == before.first - 1


def test_stretches_are_the_table_and_best_is_the_path():
    poses = line(PANDA, (0.2, 0.3, -0.2))
    found = kin.path.path_postures(PANDA, poses, q_start=PANDA.q_home)
    table = np.full(found.states.shape, -1)
    for stretch in found.stretches:
        table[stretch.first : stretch.last + 1, stretch.posture] = STATES.index(stretch.state)
    assert np.array_equal(table, found.states)
    assert np.array_equal(found.best.q, kin.solve_path(PANDA, poses, q_start=PANDA.q_home).q)
    names = [kin.branch_of(PANDA, q) for q in found.best.q]
    assert [found.postures[row] for row in found.rows] == names


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_steps_are_named(value):
    with pytest.raises(kin.InputError, match="max_step"):
        kin.path.path_postures(UR5, line(UR5, (0.1, 0.0, 0.0), 2), max_step=value)


def test_a_path_outside_the_workspace_is_an_answer():
    found = kin.path.path_postures(UR5, line(UR5, (9.0, 0.0, 0.0), 5)[1:])
    assert set(np.unique(found.states)) == {STATES.index("none")}
    assert found.reason == "The arm cannot be at the first place of the path in any posture."
