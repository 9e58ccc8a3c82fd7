"""Forward kinematics, Jacobian and manipulability: golden data, batch shapes, a reference implementation."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from arms import CHAPTER_ARMS
from hypothesis import given
from hypothesis import strategies as st

import kin
from kin import InputError
from kin.robot import Joint, Robot

ROBOTS = tuple(kin.files.classic_robots())
BOTTOMLESS: list[object] = []
for _ in range(5000):
    BOTTOMLESS = [BOTTOMLESS]


def rot(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    T = np.eye(4)
    i, j = {"x": (1, 2), "z": (0, 1)}[axis]
    T[i, i] = T[j, j] = c
    T[i, j], T[j, i] = -s, s
    return T


def move(x=0.0, z=0.0):
    T = np.eye(4)
    T[0, 3], T[2, 3] = x, z
    return T


def product(robot, q):
    """The DH product in its simplest form: every frame, then the tool."""
    values = iter(q)
    T = np.array(robot.base)
    frames = []
    for row in robot.rows:
        theta, d = row.theta, row.d
        if row.kind == "revolute":
            theta += next(values)
        if row.kind == "prismatic":
            d += next(values)
        z, x = rot("z", theta) @ move(z=d), move(x=row.a) @ rot("x", row.alpha)
        T = T @ (z @ x if robot.convention == "standard" else x @ z)
        frames.append(T)
    return np.array(frames), T @ np.array(robot.tool)


lengths = st.floats(-1, 1)
angles = st.floats(-math.pi, math.pi)


@st.composite
def robots(draw):
    """Any arm: both conventions, all kinds of rows, with a base and a tool transform."""
    rows = draw(
        st.lists(
            st.tuples(angles, lengths, lengths, angles, st.sampled_from(["revolute", "prismatic", "fixed"])),
            min_size=1,
            max_size=9,
        )
    )
    rows.append((0.0, 0.1, 0.0, 0.0, "revolute"))
    joints = tuple(
        Joint(f"{i}", *row[:4], kind=row[4], limits=None if row[4] == "fixed" else (-3.0, 3.0))
        for i, row in enumerate(rows)
    )
    n = sum(row[4] != "fixed" for row in rows)
    as_rows = lambda T: tuple(map(tuple, T.tolist()))  # noqa: E731
    return Robot(
        id="any",
        name="any",
        source="drawn",
        convention=draw(st.sampled_from(["standard", "modified"])),
        rows=joints,
        home=(0.0,) * n,
        base=as_rows(rot("x", draw(angles)) @ move(x=draw(lengths))),
        tool=as_rows(rot("z", draw(angles)) @ move(z=draw(lengths)) @ rot("x", draw(angles))),
    )


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_golden_poses_and_frames(robot_id, golden):
    robot = kin.get_robot(robot_id)
    cases = golden(robot_id)["random"] + golden(robot_id)["edge"]
    q = np.array([c["q"] for c in cases])
    assert np.abs(kin.fk(robot, q) - np.array([c["T"] for c in cases])).max() <= 1e-14
    assert np.abs(kin.link_frames(robot, q) - np.array([c["frames"] for c in cases])).max() <= 1e-14
    for case in cases:
        assert np.abs(kin.fk(robot, case["q"]) - np.array(case["T"])).max() <= 1e-14


@given(robot=robots(), data=st.data())
def test_any_arm_equals_the_product_of_its_matrices(robot, data):
    q = np.array(data.draw(st.lists(st.floats(-3, 3), min_size=robot.n, max_size=robot.n)))
    frames, T = product(robot, q)
    assert kin.fk(robot, q) == pytest.approx(T, abs=1e-12)
    assert kin.link_frames(robot, q) == pytest.approx(frames, abs=1e-12)


@given(robot=robots(), data=st.data())
def test_jacobian_equals_central_differences(robot, data):
    """Columns of J in the base frame and in the tool frame."""
    q = np.array(data.draw(st.lists(st.floats(-3, 3), min_size=robot.n, max_size=robot.n)))
    h = 1e-5
    J = kin.jacobian(robot, q)
    R = kin.fk(robot, q)[:3, :3]
    for j in range(robot.n):
        step = h * np.eye(robot.n)[j]
        ahead, behind = kin.fk(robot, q + step), kin.fk(robot, q - step)
        v = (ahead[:3, 3] - behind[:3, 3]) / (2 * h)
        W = (ahead[:3, :3] - behind[:3, :3]) / (2 * h) @ R.T
        w = np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2
        assert J[:, j] == pytest.approx(np.concatenate([v, w]), abs=1e-8)
    own = kin.jacobian(robot, q, frame="tool")
    assert own[:3] == pytest.approx(R.T @ J[:3], abs=1e-12)
    assert own[3:] == pytest.approx(R.T @ J[3:], abs=1e-12)


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 3), (0,)])
def test_batch_axes_come_first(robot_id, shape):
    robot = kin.get_robot(robot_id)
    q = robot.random_q(np.random.default_rng(4), shape)
    n, rows = robot.n, len(robot.rows)
    assert kin.fk(robot, q).shape == (*shape, 4, 4)
    assert kin.link_frames(robot, q).shape == (*shape, rows, 4, 4)
    assert kin.jacobian(robot, q).shape == (*shape, 6, n)
    assert kin.manipulability(robot, q).shape == shape
    assert kin.fk_positions(robot, q).shape == (*shape, 3)
    for function in (kin.fk, kin.fk_positions, kin.link_frames, kin.jacobian, kin.manipulability):
        batch = function(robot, q)
        for index in np.ndindex(shape):
            assert np.array_equal(batch[index], function(robot, q[index]))
    turned = kin.jacobian(robot, q, frame="tool")
    for index in np.ndindex(shape):
        assert turned[index] == pytest.approx(kin.jacobian(robot, q[index], frame="tool"), abs=1e-15)


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_poses_are_rigid(robot_id):
    robot = kin.get_robot(robot_id)
    R = kin.fk(robot, robot.random_q(np.random.default_rng(5), 2000))[:, :3, :3]
    assert np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() < 1e-14
    assert np.linalg.det(R) == pytest.approx(np.ones(2000))


@given(robot=robots(), data=st.data())
def test_a_batch_is_bit_identical_to_single_calls(robot, data):
    """Sizes on both sides of a block boundary; angles beyond the range of the polynomials."""
    q = robot.random_q(np.random.default_rng(data.draw(st.integers(0, 99))), data.draw(st.integers(1, 140)))
    q[:: data.draw(st.integers(1, 70))] *= data.draw(st.sampled_from([1.0, 1e5, 1e9]))
    batch, points = kin.fk(robot, q), kin.fk_positions(robot, q)
    for row, T in zip(q, batch, strict=True):
        assert np.array_equal(kin.fk(robot, row), T)
    scale = 10.0 + np.abs(q).max()  # metres of a prismatic joint
    assert np.abs(points - batch[:, :3, 3]).max() <= 1e-14 * scale
    assert np.array_equal(points[-1], kin.fk_positions(robot, q[-1]))


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize("angle", [99_999.0, 1e6, 1e15])
def test_angles_of_many_turns_are_as_accurate(robot_id, angle):
    robot = kin.get_robot(robot_id)
    q = np.where(robot.revolute, angle, 0.1)
    assert kin.fk(robot, q) == pytest.approx(product(robot, q)[1], abs=1e-9 if angle > 1e6 else 1e-14)
    assert np.array_equal(kin.fk(robot, np.stack([q] * 3))[1], kin.fk(robot, q))


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("index", [(0, 0), (70, 4), (129, 2)])
@pytest.mark.parametrize("function", [kin.fk, kin.fk_positions, kin.jacobian])
def test_one_value_that_is_not_finite_in_a_batch_is_found(function, index, value):
    q = np.zeros((130, 5))
    q[index] = value
    with pytest.raises(InputError) as caught:
        function(kin.get_robot("pioneer5"), q)
    assert caught.value.field == f"q[{index[0]}][{index[1]}]"


def test_arrays_of_any_type_and_layout_are_accepted():
    robot = kin.get_robot("pioneer5")
    q = np.array([1, 2, 1, 0, 1])
    wanted = kin.fk(robot, q.astype(float))
    read_only = q.astype(float)
    read_only.flags.writeable = False
    every_second = np.repeat(q.astype(float), 2)[::2]
    for form in (q, q.tolist(), tuple(q), q.astype(np.float32), read_only, every_second):
        assert np.array_equal(kin.fk(robot, form), wanted)


@pytest.mark.parametrize("function", [kin.fk, kin.fk_positions, kin.link_frames, kin.jacobian, kin.manipulability])
@pytest.mark.parametrize(
    ("q", "field"),
    [
        ([0, 0, math.nan, 0, 0], "q[2]"),
        (np.array([0, 0, 0, 0, math.inf]), "q[4]"),
        ([[0] * 5, [0, -math.inf, 0, 0, 0]], "q[1][1]"),
        ([0, 0, 0], "q"),
        (1.0, "q"),
        ("home", "q"),
        (None, "q"),
        ([0, None, 0, 0, 0], "q[1]"),
        ([0, "1", 0, 0, 0], "q[1]"),
        (np.array(["1"] * 5), "q[0]"),
        ([0, 0, 1j, 0, 0], "q[2]"),
        (np.ones(5) + 0j, "q[0]"),
        (np.array(["2020-01-01"] * 5, dtype="datetime64[D]"), "q[0]"),
        ([0, 0, 0, 10**400, 0], "q[3]"),
        ([0, 0, 0, 10**5000, 0], "q[3]"),
        ([0, [0], 0, 0, 0], "q"),
        (BOTTOMLESS, "q"),
        ({}, "q"),
        ([[0] * 5, [0] * 4], "q"),
    ],
)
def test_invalid_input_names_the_field(function, q, field):
    with pytest.raises(InputError) as caught:
        function(kin.get_robot("pioneer5"), q)
    assert caught.value.field == field
    assert caught.value.expected
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("value", ["base", None, [], 0])
def test_an_invalid_choice_names_the_valid_ones(value):
    robot = kin.get_robot("pioneer5")
    with pytest.raises(InputError, match=r"frame: .*tool"):
        kin.jacobian(robot, robot.q_home, frame=value)
    with pytest.raises(InputError, match=r"part: .*linear"):
        kin.manipulability(robot, robot.q_home, part=value)


def test_integers_beyond_64_bits_are_accepted():
    robot = kin.get_robot("pioneer5")
    assert np.array_equal(kin.fk(robot, [2**70, 0, 0, 0, 0]), kin.fk(robot, [2.0**70, 0, 0, 0, 0]))


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize(
    ("part", "rows"), [("all", slice(0, 6)), ("linear", slice(0, 3)), ("angular", slice(3, 6))]
)
def test_manipulability_is_the_product_of_singular_values(robot_id, part, rows):
    robot = kin.get_robot(robot_id)
    q = robot.random_q(np.random.default_rng(6), 300)
    wanted = np.linalg.svd(kin.jacobian(robot, q)[:, rows], compute_uv=False).prod(axis=-1)
    assert kin.manipulability(robot, q, part) == pytest.approx(wanted, rel=1e-9, abs=1e-15)


def test_manipulability_vanishes_where_the_arm_is_singular():
    arm = kin.get_robot("redundant7-craig")
    assert kin.manipulability(arm, np.zeros(7)) < 1e-15
    assert kin.manipulability(arm, arm.q_home) > 1e-3


def test_determinant_of_the_pioneer_arm_equals_its_closed_form():
    """det of the 5 × 5 Jacobian of point and approach direction: −a2 d4 s3 (a1 + a2c2 + d4c23) s5, signed."""
    robot = kin.get_robot("pioneer5")
    for q in robot.random_q(np.random.default_rng(8), 200):
        J = kin.jacobian(robot, q, frame="tool")[:5]  # in the tool frame the roll is the last row
        _, t2, t3, _, t5 = q
        wanted = -(
            0.16 * 0.14 * math.sin(t3) * (0.07 + 0.16 * math.cos(t2) + 0.14 * math.cos(t2 + t3)) * math.sin(t5)
        )
        assert np.linalg.det(J) == pytest.approx(wanted, rel=1e-9, abs=1e-15)


@pytest.mark.full
def test_threads_get_the_same_results_as_serial_calls():
    robot = kin.get_robot("redundant7")
    batches = [robot.random_q(np.random.default_rng(i), 500) for i in range(40)]

    def work(q):
        return kin.fk(robot, q), kin.fk_positions(robot, q), kin.jacobian(robot, q), kin.manipulability(robot, q)

    serial = [work(q) for q in batches]
    with ThreadPoolExecutor(8) as pool:
        for one, other in zip(serial, pool.map(work, batches), strict=True):
            assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))
