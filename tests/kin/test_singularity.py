"""Singularities: all of them are found, and a drag through one neither stops nor flips the arm.

A drag is a sequence of targets, each solved with the previous solution as seed, as in the viewer. Two rules apply:

- A target that a reference descent from the seed reaches is solved (no freeze).
- A step (2-norm of the joint steps) is at most twice that of the reference descent, plus 0.1 rad (no flip). The
  descent is written here from `fk` and `jacobian` alone and may use any branch and any redundancy. Where a joint
  must turn fast, the reference does so too. The factor is two because the shortest step is not the only criterion:
  keeping the elbow in place has some weight.

Where the targets come from a joint path that crosses the singularity, a small step exists at every target, and an
arm without redundancy must stay within a small multiple of the path's own step.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from arms import CHAPTER_ARMS
from hypothesis import given
from hypothesis import strategies as st

import kin
from kin import InputError, Robot, Status, singularities, solve_ik
from kin.ik.messages.singularity import long
from kin.solvers import closed_form_of
from kin.transforms import vector_angle

TASK = {"pioneer5": "approach"}
SQUARE = math.pi / 2
OFFSETS = (0.0, 1e-9, 1e-6, 1e-3)
LINES = 2


# The singular sets as joint values of the built-in arms, whose zeros are the canonical ones or π off them.


def at_values(*pairs):
    """A curve on which joints have given values, up to sign and half turns."""

    def curve(rng, q, inside):
        for joint, value in pairs:
            q[joint] = value * rng.choice((-1, 1)) + (0.0 if inside else math.pi * rng.integers(-1, 2))
        return q

    return curve


def pioneer_elbow_inside(rng, q, inside):
    q[2] = 0.0 if inside else math.pi * rng.integers(-1, 2)
    return q


def pioneer_shoulder(rng, q, inside):
    """a1 + a2 c2 + d4 c23 = 0, solved for θ2."""
    g = closed_form_of(kin.get_robot("pioneer5")).geometry
    while True:
        x, y = g.a2 + g.d4 * math.cos(q[2]), g.d4 * math.sin(q[2])
        if math.hypot(x, y) > g.a1:
            q[1] = math.acos(-g.a1 / math.hypot(x, y)) - math.atan2(y, x)
            return q
        q[2] = rng.uniform(0.0, 2.0)


def wrist_on_axis_1(rng, q, inside):
    """Wrist centre on axis 1: s3 = 0 and c2 d5 s4 + s2 (d3 + d5 c4) = 0."""
    q[2] = 0.0
    q[1] = -math.atan2(0.31 * math.sin(q[3]), 0.35 + 0.31 * math.cos(q[3]))
    return q


SINGULAR = {
    ("pioneer5", "elbow", ""): pioneer_elbow_inside,
    ("pioneer5", "shoulder", ""): pioneer_shoulder,
    ("pioneer5", "wrist", ""): at_values((4, 0.0)),
    ("redundant7", "elbow", ""): at_values((3, 0.0)),
    ("redundant7", "shoulder", ""): at_values((2, SQUARE)),
    ("redundant7", "wrist", ""): at_values((5, 0.0)),
    ("redundant7-craig", "elbow", ""): at_values((3, 0.0)),
    ("redundant7-craig", "shoulder", ""): at_values((1, 0.0), (2, SQUARE)),
    ("redundant7-craig", "wrist", "axes 4 and 6"): at_values((5, 0.0), (4, SQUARE)),
    ("redundant7-craig", "wrist", "joints 1 and 3"): at_values((1, 0.0), (5, 0.0)),
}
# Where the arm is regular, but the closed form needs care.
REGULAR = {
    ("redundant7-craig", "algorithmic", ""): wrist_on_axis_1,
    ("redundant7-craig", "θ2 = 0 alone", ""): at_values((1, 0.0)),
    ("redundant7-craig", "θ6 = 0 alone", ""): at_values((5, 0.0)),
}
# The Pioneer arm's wrist cannot be straight inside its limits.
DRAGGED = {key: curve for key, curve in (SINGULAR | REGULAR).items() if key[:2] != ("pioneer5", "wrist")}


def ids(curves):
    return [" ".join(key).strip() for key in curves]


def least_sigma(robot, q):
    """Smallest singular value of the task's Jacobian: six rows, or without the spin about the approach axis."""
    J = kin.jacobian(robot, q)
    if robot.n == 5:
        a = kin.fk(robot, q)[:3, 2]
        J = np.vstack([J[:3], J[3:] - np.outer(a, a @ J[3:])])
    return np.linalg.svd(J, compute_uv=False)[min(robot.n, 6) - 1]


def random_configuration(robot, rng):
    return rng.uniform(-math.pi, math.pi, robot.n)


# Singular sets


@pytest.mark.parametrize(("robot_id", "kind", "words"), SINGULAR, ids=ids(SINGULAR))
def test_on_a_singular_set_the_jacobian_loses_rank_and_that_set_is_listed_first(robot_id, kind, words):
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(1)
    for _ in range(200):
        q = SINGULAR[robot_id, kind, words](rng, random_configuration(robot, rng), False)
        first = singularities(robot, q)[0]
        assert least_sigma(robot, q) <= 1e-12
        assert first.kind == kind
        assert words in long(first)
        assert first.distance <= 1e-12
        assert first.unit == ("m" if (robot_id, kind) == ("pioneer5", "shoulder") else "rad")


@pytest.mark.parametrize(("robot_id", "kind", "words"), SINGULAR, ids=ids(SINGULAR))
@pytest.mark.parametrize("off", [1e-6, 1e-3, 0.1])
def test_the_distance_to_a_singular_set_is_an_angle_or_a_length(robot_id, kind, words, off):
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(2)
    for _ in range(50):
        before = random_configuration(robot, rng)
        q = SINGULAR[robot_id, kind, words](rng, before.copy(), False)
        metres = (robot_id, kind) == ("pioneer5", "shoulder")
        # Perpendicular to the set: along the joints that were set, or (Pioneer, shoulder) joint 2.
        push = (np.arange(robot.n) == 1) if metres else (q != before) * rng.normal(size=robot.n)
        away = q + off * push / np.linalg.norm(push)
        found = next(s for s in singularities(robot, away) if s.kind == kind and words in long(s))
        wanted = np.linalg.norm(wrist_centre(robot, away)[:2]) if metres else off
        assert found.distance == pytest.approx(wanted, rel=1e-6, abs=1e-12)
        if all(s.distance > 1e-3 for s in singularities(robot, away) if s is not found):
            assert least_sigma(robot, away) > 0.0


def wrist_centre(robot, q):
    T = kin.fk(robot, q)
    return T[:3, 3] - T[:3, 2] * {"pioneer5": 0.12}.get(robot.id, 0.42)


# σ ≥ c · Π distance: c is a third of the smallest ratio among 10⁵ configurations close to the singular sets.
# Near a straight elbow of a 7-joint arm σ falls with the square of the distance, as s4² in the determinant.
FLOOR = {"pioneer5": (0.03, 1), "redundant7": (0.009, 2), "redundant7-craig": (0.002, 2)}


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
@given(data=st.data())
def test_there_are_no_other_singularities(robot_id, data):
    """The smallest singular value has a lower bound that vanishes only with the reported distances."""
    robot = kin.get_robot(robot_id)
    near = st.tuples(st.integers(-2, 2), st.floats(-1.0, 1.0), st.integers(0, 6))
    joint = st.one_of(
        st.floats(-math.pi, math.pi), near.map(lambda t: t[0] * SQUARE + math.copysign(10.0 ** -t[2], t[1]))
    )
    q = np.array(data.draw(st.lists(joint, min_size=robot.n, max_size=robot.n)))
    c, elbow_order = FLOOR[robot_id]
    floor = c
    for s in singularities(robot, q):
        if s.kind != "algorithmic":
            floor *= s.distance ** (elbow_order if s.kind == "elbow" else 1)
    assert least_sigma(robot, q) >= floor - 1e-14


@pytest.mark.parametrize("robot_id", CHAPTER_ARMS)
def test_random_configurations_away_from_all_sets_are_regular(robot_id):
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(3)
    tried = 0
    for q in rng.uniform(-math.pi, math.pi, (2000, robot.n)):
        if min(s.distance for s in singularities(robot, q) if s.kind != "algorithmic") > 0.05:
            tried += 1
            assert least_sigma(robot, q) > 1e-6
    assert tried > 200


def test_with_the_wrist_centre_on_axis_1_only_the_arm_angle_is_undefined():
    robot = kin.get_robot("redundant7-craig")
    rng = np.random.default_rng(4)
    for _ in range(100):
        q = random_configuration(robot, rng)
        on_axis = wrist_on_axis_1(rng, q.copy(), True)
        for at in (q, on_axis, on_axis + 1e-3 * np.eye(7)[1]):
            found = next(s for s in singularities(robot, at) if s.kind == "algorithmic")
            radius = np.hypot(*wrist_centre(robot, at)[:2])
            assert found.unit == "m"
            assert found.distance == pytest.approx(radius, abs=1e-12)
            assert "the arm loses no motion" in long(found)
        assert singularities(robot, on_axis)[0].kind == "algorithmic"
        if min(s.distance for s in singularities(robot, on_axis) if s.kind != "algorithmic") > 0.05:
            assert least_sigma(robot, on_axis) > 1e-6


def test_the_wrist_centre_reaches_axis_1_only_with_a_long_forearm():
    """Never with d3 > d5, as in the chapter; with a longer forearm at θ3 = ±90°."""
    robot = kin.get_robot("redundant7")
    assert {s.kind for s in singularities(robot, robot.q_home)} == {"elbow", "shoulder", "wrist"}
    long = replace(robot, rows=tuple(replace(r, d=0.4) if r.d == 0.31 else r for r in robot.rows))
    q = long.q_home.copy()
    q[2], q[3] = SQUARE, math.acos(-0.35 / 0.4)
    found = {s.kind: s for s in singularities(long, q)}
    assert np.hypot(*wrist_centre(long, q)[:2]) <= 1e-12
    assert found["algorithmic"].distance <= 1e-12
    assert found["shoulder"].distance <= 1e-12
    assert least_sigma(long, q) <= 1e-12
    # Listed after the singularity where the arm loses a motion.
    assert [s.kind for s in singularities(long, q)][:2] == ["shoulder", "algorithmic"]


# Determinants


def test_determinant_of_the_five_joint_arm():
    """det J5 = −a2 d4 s3 (a1 + a2 c2 + d4 c23) s5, in the tool's frame."""
    robot = kin.get_robot("pioneer5")
    a1, a2, d4 = 0.07, 0.16, 0.14
    for q in np.random.default_rng(5).uniform(-math.pi, math.pi, (200, 5)):
        J = kin.jacobian(robot, q, frame="tool")[:5]
        _, c2, c3, _, _ = np.cos(q)
        _, s2, s3, _, s5 = np.sin(q)
        wanted = -a2 * d4 * s3 * (a1 + a2 * c2 + d4 * (c2 * c3 - s2 * s3)) * s5
        assert np.linalg.det(J) == pytest.approx(wanted, abs=1e-15)


def test_determinant_of_the_arm_with_two_joints_on_one_axis():
    """det J without joint 2 = d3 d5² s4² c3 s6."""
    robot = kin.get_robot("redundant7")
    d3, d5 = 0.35, 0.31
    for q in np.random.default_rng(6).uniform(-math.pi, math.pi, (200, 7)):
        J = kin.jacobian(robot, q)
        assert np.abs(J[:, 0] - J[:, 1]).max() <= 1e-15
        wanted = d3 * d5**2 * math.sin(q[3]) ** 2 * math.cos(q[2]) * math.sin(q[5])
        assert np.linalg.det(np.delete(J, 1, axis=1)) == pytest.approx(wanted, abs=1e-14)


def test_manipulability_of_the_srs_arm():
    """√det(J Jᵀ) = d3 d5 |s4| |m| where m is, up to a factor, the self-motion of the arm."""
    robot = kin.get_robot("redundant7-craig")
    d3, d5 = 0.35, 0.31
    for q in np.random.default_rng(7).uniform(-math.pi, math.pi, (200, 7)):
        _, c2, c3, c4, c5, c6, _ = np.cos(q)
        _, s2, s3, s4, s5, s6, _ = np.sin(q)
        m = np.array(
            [
                d5 * s4 * c3 * s6,
                -d5 * s4 * s3 * s2 * s6,
                -s6 * (d5 * s4 * c3 * c2 + s2 * (d3 + d5 * c4)),
                0.0,
                s2 * (d3 * s4 * c5 * c6 + s6 * (d5 + d3 * c4)),
                d3 * s4 * s5 * s2 * s6,
                -d3 * s4 * c5 * s2,
            ]
        )
        assert np.abs(kin.jacobian(robot, q) @ m).max() <= 1e-15
        wanted = d3 * d5 * abs(s4) * np.linalg.norm(m)
        assert kin.manipulability(robot, q) == pytest.approx(wanted, rel=1e-9, abs=1e-14)


# Reports


@pytest.mark.parametrize("robot_id", kin.files.classic_robots())
def test_singularities_are_sorted_by_distance_with_lengths_relative_to_the_reach(robot_id):
    robot = kin.get_robot(robot_id)
    for q in robot.random_q(np.random.default_rng(8), 200):
        order = [s.distance / (robot.reach if s.unit == "m" else 1.0) for s in singularities(robot, q)]
        assert order == sorted(order)


def test_the_sentence_gives_the_joint_values_of_the_singular_posture():
    robot = kin.get_robot("redundant7")
    q = robot.q_home.copy()
    for angle, word in (
        (0.02, "straight (θ4 = 0°)"),
        (-3.1, "folded (θ4 = -180°)"),
        (6.3, "straight (θ4 = 360°)"),
    ):
        q[3] = angle
        elbow = next(s for s in singularities(robot, q) if s.kind == "elbow")
        assert long(elbow).startswith(f"elbow {word}")
        assert elbow.distance == pytest.approx(min(abs(angle - k * math.pi) for k in range(-2, 3)))
    # With another zero in the table, the sentence gives the joint's own value.
    rows = tuple(replace(r, theta=-0.5) if r.name == "joint 4" else r for r in robot.rows)
    q[3] = 0.5
    elbow = singularities(replace(robot, rows=rows), q)[0]
    assert long(elbow).startswith("elbow straight (θ4 = 28.648°)")
    assert elbow.distance <= 1e-15


@pytest.mark.parametrize("robot_id", kin.files.classic_robots())
@pytest.mark.parametrize("q", [[0.0], [0.0] * 8, [[0.0] * 7] * 2, [[0.0] * 5], [math.nan] * 7, "home"])
def test_invalid_configurations_are_rejected(robot_id, q):
    with pytest.raises(InputError, match="q"):
        singularities(kin.get_robot(robot_id), q)


# Arms without a closed form

ARM = """
id = "arm"
name = "arm"
source = "this test"
convention = "standard"
units = {{ length = "m", angle = "deg" }}
{rows}
[home]
q = {home}
"""


def arm(*rows, home):
    """A robot of rows (d, a, alpha in degrees), prismatic where d is "slide"."""
    text = ""
    for i, (d, a, alpha) in enumerate(rows):
        text += f'[[rows]]\nname = "{i}"\na = {a}\nalpha = {alpha}\n'
        text += 'kind = "prismatic"\nlimits = [0, 1]\n' if d == "slide" else f"d = {d}\nlimits = [-180, 180]\n"
    return kin.load_robot(ARM.format(rows=text, home=list(home)))


def only_singularity(robot, q):
    found = singularities(robot, q)
    assert len(found) == 1
    assert (found[0].kind, found[0].unit) == ("jacobian", "SI")
    return found[0]


def test_a_plane_typed_with_a_few_digits_is_no_singularity():
    """With half turns of 3.1416 the tool leaves its plane by micrometres: no motion that it has, or can lose."""
    q = [0.1, 0.3, 0.4, 0.5]
    exact, typed = (Robot.from_dh([(0, 0, 0.3, turn)] * 4, home=q) for turn in (math.pi, 3.1416))
    assert only_singularity(typed, q).distance == pytest.approx(only_singularity(exact, q).distance, rel=1e-3)


def test_six_joints_without_a_closed_form_are_judged_by_the_whole_jacobian():
    # Axis 2 is oblique to axis 1: no closed form matches the arm.
    robot = arm(
        (0.3, 0, 60), (0, 0.4, 0), (0, 0, 90), (0.3, 0, -90), (0, 0, 90), (0.1, 0, 0), home=[0, 0, 0, 0, 0, 0]
    )
    for q in np.random.default_rng(9).uniform(-3, 3, (20, 6)):
        found = only_singularity(robot, q)
        assert found.distance == pytest.approx(np.linalg.svd(kin.jacobian(robot, q), compute_uv=False)[-1])
        assert found.shape == (6, 6)
        q[4] = 0.0
        assert only_singularity(robot, q).distance <= 1e-12


def test_five_joints_without_a_closed_form_are_judged_by_point_and_approach():
    # Base and four parallel axes, the tool along them: a plane that joint 1 turns, so the rank is 3.
    robot = arm((0.1, 0, 90), (0, 0.3, 0), (0, 0.3, 0), (0, 0.2, 0), (0, 0.1, 0), home=[0, 0, 0, 0, 0])
    assert closed_form_of(robot) is None
    q = np.array([0.3, 0.4, 0.5, 0.6, 0.7])
    found = only_singularity(robot, q)
    assert found.shape == (5, 5)
    assert found.distance > 0.01
    q[2:] = 0.0
    assert only_singularity(robot, q).distance <= 1e-12


def test_few_joints_are_judged_by_the_point():
    robot = arm((0.3, 0, 90), (0, 0.4, 0), (0, 0.3, 0), home=[0, 0, 0])
    q = np.array([0.1, 0.2, 0.9])
    J = kin.jacobian(robot, q)[:3]
    assert only_singularity(robot, q).distance == pytest.approx(np.linalg.svd(J, compute_uv=False)[-1])
    q[2] = 0.0
    assert only_singularity(robot, q).distance <= 1e-12
    assert "3 × 3" in long(only_singularity(robot, q))


def test_a_planar_arm_is_regular_although_it_stays_in_its_plane():
    robot = arm((0, 0.4, 0), (0, 0.3, 0), (0, 0.2, 0), (0, 0.1, 0), home=[0, 0, 0, 0])
    assert only_singularity(robot, [0.1, 0.7, -0.4, 0.3]).distance > 0.05
    assert only_singularity(robot, [0.1, 0.0, 0.0, 0.0]).distance <= 1e-12


def test_prismatic_joints_count_in_metres():
    robot = arm(("slide", 0, 90), ("slide", 0, 90), ("slide", 0, 0), home=[0, 0, 0])
    found = only_singularity(robot, [0.1, 0.2, 0.3])
    J = kin.jacobian(robot, [0.1, 0.2, 0.3])[:3]
    assert found.distance == pytest.approx(np.linalg.svd(J, compute_uv=False)[np.linalg.matrix_rank(J) - 1])


def test_an_arm_that_moves_no_point_is_always_singular():
    assert only_singularity(arm((0.3, 0, 0), home=[0]), [0.4]).distance == 0.0


# Drags


def residual(robot, T, q, task):
    """The remaining twist to the target, and the Jacobian of the task."""
    now, J = kin.fk(robot, q), kin.jacobian(robot, q)
    if task == "approach":
        a = now[:3, 2]
        turn = np.cross(a, T[:3, 2])
        J[3:] -= np.outer(a, a @ J[3:])
    else:
        turn = 0.5 * np.cross(now[:3, :3], T[:3, :3], axis=0).sum(axis=1)
    return np.concatenate([T[:3, 3] - now[:3, 3], turn]), J


def reference_step(robot, T, seed):
    """The reference descent: step (2-norm) to a solution inside the limits near the seed, ∞ if none is found."""
    task = TASK.get(robot.id, "pose")
    best = math.inf
    for damping in (1e-2, 1e-4, 1e-7):
        q = seed.copy()
        for _ in range(60):
            error, J = residual(robot, T, q, task)
            if np.abs(error).max() < 1e-12:
                best = min(best, float(np.linalg.norm(q - seed)))
                break
            step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), error)
            q = robot.clip(q + np.clip(step, -0.3, 0.3))
            damping = max(0.3 * damping, 1e-14)
    return best


def reached(robot, T, q):
    now = kin.fk(robot, q)
    gap = vector_angle if robot.id in TASK else (lambda a, b: np.abs(a - b).max())
    turn = gap(now[:3, 2], T[:3, 2]) if robot.id in TASK else gap(now[:3, :3], T[:3, :3])
    return np.abs(now[:3, 3] - T[:3, 3]).max() <= 1e-9 and turn <= 1e-9 and robot.in_limits(q).all()


def drag(robot, targets, q):
    """The configurations of a drag from q through the targets, as far as they can be reached.

    Every step is compared with the reference descent.
    """
    task = TASK.get(robot.id, "pose")
    taken = []
    for T in targets:
        result = solve_ik(robot, T, task=task, q_seed=q)
        facts = {"seed": q.tolist(), "T": T.tolist(), "answer": result.best.q.tolist(), "status": result.status}
        if result.status is not Status.SOLVED:
            assert reference_step(robot, T, q) == math.inf, f"frozen: {facts}"
            break
        assert reached(robot, T, result.best.q)
        step = float(np.linalg.norm(result.best.q - q))
        if step > 0.1:
            assert step <= 2.0 * reference_step(robot, T, q) + 0.1, f"flipped by {step:.3f} rad: {facts}"
        q = result.best.q
        taken.append(q)
    return taken


def paths(robot, key, count, off, seed):
    """Joint paths ``(21, n)`` inside the limits, in steps of 0.01 rad, that cross a curve in the middle.

    They keep away from other singularities and, for the 7-joint arms, from the limits, to test one effect alone.
    """
    rng = np.random.default_rng(seed)
    curve = DRAGGED[key]
    margin = 0.0 if robot.n == 5 else 0.4
    made = 0
    while made < count:
        q = robot.random_q(rng)
        middle = curve(rng, q.copy(), True)
        moved = middle != q
        others = [s for s in singularities(robot, middle) if s.distance > 1e-9 and s.kind != "algorithmic"]
        if robot.n == 7 and min(s.distance for s in others) < 0.3:
            continue
        v = rng.uniform(-1, 1, robot.n)
        path = middle + off * moved * rng.normal(size=robot.n)
        path = path + 0.01 * np.arange(-10, 11)[:, None] * v / np.abs(v).max()
        if key == ("pioneer5", "elbow", ""):
            path[:, 2] = np.abs(path[:, 2])  # the straight elbow is at its limit: the path turns back there
        if ((path >= robot.lower + margin) & (path <= robot.upper - margin)).all():
            made += 1
            yield path


@pytest.mark.parametrize("off", OFFSETS)
@pytest.mark.parametrize("key", DRAGGED, ids=ids(DRAGGED))
def test_a_drag_follows_a_joint_path_through_a_singularity(key, off):
    """Every target is reached, without redundancy in steps of at most five times the path's own.

    At the singular pose an undetermined joint stays, and has two steps to make afterwards; others compensate.
    """
    robot = kin.get_robot(key[0])
    for path in paths(robot, key, LINES, off, seed=10):
        targets = kin.fk(robot, path)
        for T, known in zip(targets[1:], path[1:], strict=True):
            assert reached(robot, T, known)
        taken = drag(robot, targets[1:], path[0])
        assert len(taken) == len(path) - 1
        if key[0] != "redundant7-craig":
            assert np.abs(np.diff([path[0], *taken], axis=0)).max() <= 0.05


@pytest.mark.parametrize("key", DRAGGED, ids=ids(DRAGGED))
def test_every_target_of_a_joint_path_is_solved(key):
    robot = kin.get_robot(key[0])
    task = TASK.get(robot.id, "pose")
    for path in paths(robot, key, LINES, 0.0, seed=11):
        for before, q in itertools.pairwise(path):
            result = solve_ik(robot, kin.fk(robot, q), task=task, q_seed=before)
            assert result.status is Status.SOLVED
            # The seed is on the path, so a step of 0.01 rad exists. At the singular pose a joint may stay behind.
            assert np.abs(result.best.q - before).max() <= 0.05


def line(T, velocity, spin, length):
    """T moved along a straight line by `length` metres, turning by as many radians per unit of spin."""
    moved = T.copy()
    moved[:3, 3] += velocity * length
    angle = float(np.linalg.norm(spin)) * length
    if angle:
        x, y, z = spin / np.linalg.norm(spin)
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        moved[:3, :3] = (np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K) @ T[:3, :3]
    return moved


@pytest.mark.parametrize("off", OFFSETS)
@pytest.mark.parametrize("key", DRAGGED, ids=ids(DRAGGED))
def test_a_straight_drag_through_or_near_a_singular_pose_neither_freezes_nor_flips(key, off):
    """Straight lines in steps of 3 mm through the singular pose, or past it at `off` metres.

    The tool turns steadily. Every second line starts in a direction that the joints allow, the others in a random
    one. Each is followed as far as it is within reach.
    """
    robot = kin.get_robot(key[0])
    rng = np.random.default_rng(12)
    steps = 0
    for number, path in enumerate(paths(robot, key, LINES, 0.0, seed=13)):
        T = kin.fk(robot, path[10])
        twist = kin.jacobian(robot, path[10]) @ (path[10] - path[9]) if number % 2 else rng.normal(size=6)
        velocity, spin = np.split(twist / np.linalg.norm(twist[:3]), 2)
        aside = np.cross(velocity, rng.normal(size=3))
        T[:3, 3] += off * aside / np.linalg.norm(aside)
        targets = [line(T, velocity, spin, 0.003 * k) for k in range(-10, 11)]
        # From the middle backwards to the edge of reach, then forwards through the middle.
        back = drag(robot, targets[9::-1], path[10])
        if not back:  # the middle is at the edge of reach: take the other direction
            targets.reverse()
            back = drag(robot, targets[9::-1], path[10])
        on = drag(robot, targets[10 - len(back) :], back[-1] if back else path[10])
        steps += len(back) + len(on)
    assert steps >= 10
