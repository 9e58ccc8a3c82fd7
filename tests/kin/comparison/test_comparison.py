"""Comparisons of arms against forward kinematics: one arm in other frames, and mistakes in tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import kin
from kin.axes import inverse, size
from kin.comparison import Comparison, messages
from kin.comparison.bound import Zeros
from kin.comparison.diagnosis import differences
from kin.comparison.frames import FRAME, Reference, Side
from kin.comparison.matching import Tolerance
from kin.comparison.mistakes import Edit, applied, edits, fewer_rows, known_edits
from kin.comparison.tables import Tables, invariants
from kin.robot import Joint, Robot
from kin.transforms import pose_from_position_wxyz
from kin.units import Units

ARMS = list(kin.files.classic_robots().values())
HALF = 0.5 * math.pi


def ids(arm: Robot) -> str:
    return arm.id


def random_frame(rng: np.random.Generator) -> np.ndarray:
    return pose_from_position_wxyz(0.3 * rng.normal(size=3), rng.normal(size=4))


def in_other_frames(a: Robot, rng: np.random.Generator) -> Robot:
    """The same arm with a random base and tool, random senses, and zeros of some joints elsewhere."""
    signs = rng.choice([-1.0, 1.0], a.n)
    offsets = rng.integers(0, 2, a.n) * np.where(a.revolute, rng.uniform(-3, 3, a.n), rng.uniform(-0.1, 0.1, a.n))
    B, E = random_frame(rng), random_frame(rng)
    there = kin.dh.screws(a, -signs * offsets)
    R, p = inverse(B)[:3, :3], inverse(B)[:3, 3]
    omega, v = R @ there.S[:3], R @ there.S[3:]
    v += np.cross(p, omega, axisb=0, axisc=0)
    b = kin.dh.robot_from_screws(signs * np.concatenate([omega, v]), inverse(B) @ there.M @ inverse(E))
    return kin.dh.convert_dh(b, rng.choice(["standard", "modified"]))


def random_arm(rng: np.random.Generator) -> Robot:
    """A table with parallel, coincident and prismatic axes among others."""
    rows = []
    for i in range(rng.integers(1, 8)):
        alpha = rng.choice([0.0, HALF, -HALF, math.pi, rng.uniform(-3, 3)])
        a, d, theta = (rng.choice([0.0, rng.uniform(-0.5, 0.5)]) for _ in range(3))
        kind = "prismatic" if rng.random() < 0.3 else "revolute"
        limits = (-3.0, 3.0) if kind == "revolute" else (-0.3, 0.3)
        rows.append(Joint(f"joint {i + 1}", theta, d, a, alpha, kind, limits))
    return Robot.from_dh(rows, rng.choice(["standard", "modified"]))


def assert_confirmed(found: Comparison, a: Robot, b: Robot, rng: np.random.Generator) -> None:
    """Forward kinematics agrees with the mapping at configurations that the comparison has not seen."""
    assert found.mapping is not None
    assert found.position is not None
    q = a.random_q(rng, 300)
    T = found.mapping.base @ kin.fk(b, found.to_b(q)) @ found.mapping.tool
    apart = np.linalg.norm(T[:, :3, 3] - kin.fk(a, q)[:, :3, 3], axis=-1).max()
    assert apart <= 1.2 * found.position + 1e-9


def changed(arm: Robot, row: int, **cells: float) -> Robot:
    rows = list(arm.rows)
    rows[row] = replace(rows[row], **cells)
    return replace(arm, rows=tuple(rows))


def test_differences_of_poses_are_distances_and_angles():
    rng = np.random.default_rng(4)
    one, turns = random_frame(rng), [0.0, 1e-9, 1e-5, 0.3, 2.0, 3.1]
    other = np.array(
        [one @ pose_from_position_wxyz([0, 0, 0.2], [math.cos(t / 2), 0, math.sin(t / 2), 0]) for t in turns]
    )
    position, rotation = differences(np.tile(one, (6, 1, 1)), other)
    assert position == pytest.approx([0.2] * 6)
    assert rotation == pytest.approx(turns, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize("arm", ARMS, ids=ids)
def test_an_arm_is_identical_to_itself_in_both_conventions(arm):
    for convention in ("standard", "modified"):
        found = kin.compare(arm, kin.dh.convert_dh(arm, convention))
        assert found.verdict == "identical"
        assert found.first is None
        assert found.explanations == ()


@pytest.mark.full
@pytest.mark.parametrize("arm", ARMS, ids=ids)
def test_an_arm_is_found_again_in_other_frames(arm):
    rng = np.random.default_rng(arm.n)
    for _ in range(6):
        b = in_other_frames(arm, rng)
        found = kin.compare(arm, b, explain=False)
        assert found.verdict == "same"
        assert found.position < 1e-9
        assert_confirmed(found, arm, b, rng)


@pytest.mark.full
def test_random_tables_are_found_again_in_other_frames():
    rng = np.random.default_rng(3)
    for _ in range(150):
        a = random_arm(rng)
        b = in_other_frames(a, rng)
        found = kin.compare(a, b, explain=False)
        assert found.verdict in ("identical", "same"), (a.rows, found.first)
        assert_confirmed(found, a, b, rng)


def test_different_arms_are_never_called_the_same():
    for a in ARMS:
        for b in ARMS:
            alike = {a.id, b.id} == {"redundant7", "redundant7-craig"}
            if a is not b and not alike:
                found = kin.compare(a, b, explain=False)
                assert found.verdict == "different", (a.id, b.id)
                assert found.first is not None


def test_a_small_change_is_the_same_arm_only_if_poses_cannot_tell():
    rng = np.random.default_rng(7)
    said = set()
    for k in range(120):
        a = ARMS[k % len(ARMS)]
        cell = rng.choice(["theta", "d", "a", "alpha"])
        row = int(rng.integers(len(a.rows)))
        b = changed(a, row, **{cell: getattr(a.rows[row], cell) + 10.0 ** rng.uniform(-8, -1)})
        found = kin.compare(a, b, explain=False)
        said.add(found.verdict)
        if found.is_same:
            assert found.position <= 1e-5 * max(1.0, size(a))
            assert_confirmed(found, a, b, rng)
    assert said == {"identical", "same", "different"}


@pytest.mark.full
def test_senses_and_zeros_cost_no_less_than_is_reckoned():
    """Changed tables are given up by this bound: no plainest mapping is below it, and most are at it."""
    rng = np.random.default_rng(8)
    tolerance, above = Tolerance(1e-6, 1e-6), []
    for a in [*ARMS, *(random_arm(rng) for _ in range(30))]:
        b = in_other_frames(a, rng)
        reference = Reference(a, tolerance)
        table = Tables.of(b)
        several = applied(known_edits(table.rows, a, False), table)
        several = several.take(np.flatnonzero((several.kinds == table.kinds).all(axis=1))[::3])
        zeros = Zeros.of(Tables.of(a), invariants(Tables.of(a)))
        least = zeros.cost(Zeros.of(several, invariants(several)), tolerance)
        for k, side in enumerate(Side.several(several)):
            found = reference.plainest(side)
            if isinstance(found, tuple):
                mapping, _ = found
                frames = sum(not np.array_equal(T, np.eye(4)) for T in (mapping.base, mapping.tool))
                above.append(mapping.cost(tolerance) - FRAME * frames - least[k])
                assert above[-1] >= -1e-9, (a.id, k)
    assert len(above) > 500
    assert np.mean(np.array(above) < 1e-9) > 0.5


def single_mistakes(arm: Robot) -> list[tuple[Edit, Tables]]:
    """All tables with one mistake that poses can see and that loses nothing of the table."""
    table = Tables.of(arm)
    lossy = {"twist", "offset", "shifted", "base", "tool"}
    several = [(e, e.apply(table)) for e in edits(table.rows, arm, False) if e.mistake not in lossy]
    return [*several, *fewer_rows(table)]


@pytest.mark.parametrize("frames", ["fixed", "free"])
@pytest.mark.parametrize("arm", ARMS, ids=ids)
def test_a_single_mistake_is_explained_by_a_single_change(arm, frames):
    rng = np.random.default_rng(11)
    several = single_mistakes(arm)
    probes = arm.random_q(rng, 40)
    for k in rng.permutation(len(several))[:5]:
        edit, table = several[k]
        b = table.robot(0, arm)
        if b.n == arm.n and np.abs(kin.fk(b, probes) - kin.fk(arm, probes)).max() < 1e-6:
            continue  # it changes nothing
        if b.n == 0:
            continue
        found = kin.compare(arm, b, frames=frames)
        assert found.is_same or len(found.explanations[0].changes) == 1, (edit.mistake, edit.rows, edit.columns)
        for explanation in found.explanations:
            T = explanation.mapping.base @ kin.fk(explanation.robot, explanation.mapping.to_b(probes))
            assert np.abs(T @ explanation.mapping.tool - kin.fk(arm, probes)).max() < 1e-4


@pytest.mark.parametrize(
    ("change", "mistake", "words"),
    [
        (lambda arm: replace(arm, convention="modified"), "convention", "in the standard convention"),
        (
            lambda arm: changed(arm, 3, alpha=-arm.rows[3].alpha),
            "sign",
            "α of row 4 has the wrong sign (90°, not −90°)",
        ),
        (lambda arm: changed(arm, 1, a=-0.4), "value", "a of row 2 is wrong (−425 mm, not −400 mm)"),
        (lambda arm: changed(arm, 2, alpha=0.7), "twist", "α of row 3 is wrong (0°, not 40.11°)"),
        (lambda arm: changed(arm, 2, a=-39.225), "decimal point", ""),
        (lambda arm: replace(arm, rows=arm.rows[:2] + arm.rows[3:], home=arm.home[1:]), "missing row", "missing"),
    ],
)
def test_a_mistake_in_the_table_of_the_ur5_is_named(change: Callable[[Robot], Robot], mistake, words):
    a = kin.get_robot("ur5")
    b = change(a)
    found = kin.compare(a, b)
    first = found.explanations[0]
    if mistake != "decimal point":  # two digits off: another name is as good
        assert [each.mistake for each in first.changes] == [mistake]
    assert words in messages.explanation(first, a, b)
    assert found.verdict in ("different", "same")


def test_two_mistakes_are_both_named():
    a = kin.get_robot("ur5")
    b = changed(changed(a, 3, alpha=-a.rows[3].alpha), 1, a=-0.4)
    found = kin.compare(a, b, seconds=60.0)
    assert {each.mistake for each in found.explanations[0].changes} == {"sign", "value"}
    assert found.complete


def test_the_time_limit_is_admitted():
    a = kin.get_robot("panda")
    b = changed(changed(changed(a, 1, alpha=0.3), 3, a=0.2), 4, d=0.5)
    found = kin.compare(a, b, seconds=0.0)
    assert found.verdict == "different"
    assert not found.complete


def test_the_time_limit_is_admitted_for_rows_left_out():
    """With no time, a second row is not even looked for; with some, both are found."""
    a = kin.get_robot("panda")
    b = replace(a, rows=a.rows[:2] + a.rows[4:], home=a.home[:2] + a.home[4:])
    found = kin.compare(a, b, seconds=60.0)
    assert [each.mistake for each in found.explanations[0].changes] == ["missing row", "missing row"]
    assert found.complete
    assert not kin.compare(a, b, seconds=0.0).complete


def test_a_table_of_the_ur5_in_a_toolbox_has_another_first_length():
    """d of row 1 is 0.089459 there and 0.089159 in the maker's table: poses see only a lower base."""
    a = kin.get_robot("ur5")
    b = changed(a, 0, d=0.089459)
    found = kin.compare(a, b)
    assert found.verdict == "same"
    assert messages.verdict(found, a, b) == "The same arm: the base is shifted by 0.3 mm."
    assert found.mapping.base[2, 3] == pytest.approx(-0.0003)


def test_a_joint_that_counts_from_elsewhere_is_the_same_arm():
    a = kin.get_robot("ur5")
    b = changed(a, 2, theta=a.rows[2].theta + HALF)
    found = kin.compare(a, b)
    assert found.verdict == "same"
    assert found.mapping.offsets == pytest.approx([0, 0, -HALF, 0, 0, 0])
    assert "joint 3 counts from −90.0°" in messages.verdict(found, a, b)


def test_a_rounded_table_is_close_within_a_stated_tolerance():
    a = kin.get_robot("panda")
    rows = [replace(row, alpha=round(row.alpha, 3), a=round(row.a, 3), d=round(row.d, 3)) for row in a.rows]
    b = replace(a, rows=tuple(rows))
    strict = kin.compare(a, b, explain=False)
    assert strict.verdict == "different"
    assert strict.rounded
    found = kin.compare(a, b, tolerance=(3e-3, 5e-3), explain=False)
    assert found.verdict == "close"
    assert 1e-5 < found.position < 3e-3
    assert_confirmed(found, a, b, np.random.default_rng(1))
    assert "apart" in messages.verdict(found, a, b)


def test_limits_are_compared_as_joint_values_of_the_reference():
    a = kin.get_robot("panda")
    b = changed(a, 3, theta=HALF)
    b = replace(b, rows=tuple(replace(row, limits=(-1.0, 1.0)) if i == 1 else row for i, row in enumerate(b.rows)))
    found = kin.compare(a, b, explain=False)
    by_joint = {each.joint: each for each in found.limits}
    assert by_joint[1].in_b == pytest.approx((-1.0, 1.0))
    lower, upper = a.joints[3].limits
    assert by_joint[3].in_b == pytest.approx((lower + HALF, upper + HALF))


@pytest.mark.parametrize(
    ("arm", "free"),
    [("ur5", (0, 5)), ("puma560", (0, 5)), ("scara", (0, 2, 3)), ("redundant7", (0, 1, 6)), ("panda", (0, 6))],
)
def test_offsets_that_poses_cannot_tell_are_named(arm, free):
    found = kin.compare(arm, arm, explain=False)
    assert tuple(joint for group in found.free_offsets for joint in group) == free


def test_sentences_use_the_units_of_the_reader():
    a = kin.get_robot("ur5")
    b = changed(a, 1, a=-0.4)
    found = kin.compare(a, b)
    words = messages.explanation(found.explanations[0], a, b, Units(degrees=False, length="m"))
    assert "(−0.425 m, not −0.4 m)" in words


@pytest.mark.parametrize(
    ("keywords", "field"),
    [
        ({"frames": "loose"}, "frames"),
        ({"tolerance": (1e-3,)}, "tolerance"),
        ({"tolerance": (math.nan, 1.0)}, "tolerance"),
        ({"tolerance": "wide"}, "tolerance"),
        ({"seconds": -1.0}, "seconds"),
        ({"seconds": math.nan}, "seconds"),
    ],
)
def test_bad_arguments_are_named(keywords, field):
    with pytest.raises(kin.InputError, match=f"^{field}: got"):
        kin.compare("ur5", "ur5", **keywords)


def test_arms_of_other_kinds_differ_in_that():
    found = kin.compare("stanford", "irb120", explain=False)
    assert (found.first.quantity, found.first.joints) == ("kind", (2,))
    found = kin.compare("panda", "ur5", explain=False)
    assert (
        messages.verdict(found, kin.get_robot("panda"), kin.get_robot("ur5"))
        == "Different arms: a has 7 joints and b has 6."
    )
    with pytest.raises(ValueError, match="no mapping"):
        found.to_b(np.zeros(7))


def test_arms_too_long_to_compare_are_refused():
    long = Robot.from_dh([{"alpha": HALF}] * 13)
    with pytest.raises(kin.InputError, match=r"^b: got '13 joints in 13 rows', expected an arm with at most 12"):
        kin.compare("ur5", long)


def test_the_senses_of_many_joints_are_counted_in_time():
    """Axes through one point, each perpendicular to the next: every vector of signs is an answer."""
    arm = Robot.from_dh([{"alpha": HALF}] * 8)
    assert kin.compare(arm, arm).sign_choices == 2**8


@pytest.mark.parametrize("place", [0, 2, 4, 7, 8])
@pytest.mark.parametrize("name", ["spacer", "flange"])
def test_a_fixed_row_of_several_that_was_left_out_is_named(place: int, name: str):
    panda = kin.get_robot("panda")
    spacer = Joint("spacer", kind="fixed", d=0.05, a=0.02, alpha=0.3)
    a = replace(panda, rows=(*panda.rows[:place], spacer, *panda.rows[place:]), capsules=(), capsules_source="")
    b = replace(a, rows=tuple(row for row in a.rows if row.name != name))
    first = kin.compare(a, b).explanations[0]
    missing = next(i for i, row in enumerate(a.rows) if row.name == name)
    assert [(change.mistake, change.rows) for change in first.changes] == [("missing row", (missing,))]
    q = a.random_q(np.random.default_rng(1), 30)
    assert np.allclose(kin.fk(first.robot, q), kin.fk(a, q), atol=1e-9)


def test_numbers_that_differ_are_written_differently():
    a, b = kin.get_robot("ur5"), kin.get_robot("ur5")
    b = replace(b, rows=(b.rows[0], replace(b.rows[1], a=b.rows[1].a + 4e-5), *b.rows[2:]))
    first = kin.compare(a, b, explain=False).first
    assert first is not None
    said = messages.difference(first, a, b, names=("the book", "the table"))
    assert (
        said == "the axes of joints 2 and 3 are at a distance of 425.00 mm in the book and 424.96 mm in the table"
    )


@pytest.mark.parametrize("digits", [2, 3])
def test_right_angles_with_few_digits_are_the_same_within_what_is_said(digits: int):
    """The tolerance in the sentence is rounded up, so it is enough."""
    a = kin.get_robot("ur5")
    one = replace(a, rows=(replace(a.rows[0], alpha=round(a.rows[0].alpha, digits)), *a.rows[1:]))
    every = replace(a, rows=tuple(replace(row, alpha=round(row.alpha, digits)) for row in a.rows))
    for b in (one, every):
        found = kin.compare(a, b, explain=False)
        assert found.verdict == "different"
        for units in (Units(), Units(degrees=False, length="m")):
            length, angle = messages.allowing(found, units) or ("", "")
            assert f"They are the same within {length}" in messages.nearly(found, units)
            allowed = float(length) / units.lengths.scale, float(angle) / units.angles.scale
            assert kin.compare(a, b, tolerance=allowed, explain=False).verdict == "close"


def test_arms_that_differ_by_more_than_roundings_are_the_same_within_nothing():
    a = kin.get_robot("ur5")
    b = replace(a, rows=(a.rows[0], replace(a.rows[1], a=-0.5), *a.rows[2:]))
    for other in (b, kin.get_robot("panda"), a):
        assert messages.nearly(kin.compare(a, other, explain=False)) == ""
