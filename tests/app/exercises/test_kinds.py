"""Every kind of exercise: other right answers, reasons for wrong ones, partial credit, and what is no answer."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.exercises import Exercise, Variant, Verdict, parse_exercise
from app.exercises.contract import numbers
from app.exercises.exercise import VariantError
from app.exercises.fields import ExerciseFileError
from app.exercises.kinds import KINDS
from app.exercises.questions import Number, count
from app.viewer.exercises.views import Sheet, question_html
from kin import InputError
from kin.dh import convert_dh
from kin.typed import EntryError
from kin.units import PLAIN, Unit, Units

UNITS, RADIANS = Units(), Units(degrees=False, length="m")
HEAD = 'id = "x"\ntitle = "X"\ntopic = "Velocity"\ntext = "?"\n'


def made(robot: str, kind: str, body: str) -> tuple[Exercise, Variant]:
    exercise = parse_exercise(f'{HEAD}robot = "{robot}"\nkind = "{kind}"\n{body}')
    return exercise, exercise.variant(0)


def judged(one: tuple[Exercise, Variant], given: Any, units: Units = UNITS) -> Verdict:
    return one[0].judge(one[1], given, units)


# Numbers

ANGLE = made("planar2r", "number", '[answer]\nvalue = "30*deg"\nunit = "deg"\ntolerance = 1\nmethod = "Add."')
POINT = made(
    "planar2r",
    "number",
    '[answer]\nvalue = [0.2, -0.1, 0.3]\nlabels = ["x", "y", "z"]\nunit = "mm"\ntolerance = 1\nmethod = "Add."',
)


def test_numbers_are_read_in_the_readers_units() -> None:
    for text, units in (
        ("30", UNITS),
        ("30.9", UNITS),
        ("0.5236", RADIANS),
        ("30°", RADIANS),
        ("0.5236 rad", UNITS),
    ):
        assert judged(ANGLE, [text], units).right
    assert not judged(ANGLE, ["31.2"]).right


def test_a_number_in_another_unit_is_named() -> None:
    assert judged(ANGLE, ["0.5236"]).reason.startswith("This is the value in radians. The unit is degrees")
    assert judged(ANGLE, ["30"], RADIANS).reason.startswith("This is the value in degrees. The unit is radians")
    assert "in metres" in judged(POINT, ["0.2", "-0.1", "0.3"]).parts[0][1]


def test_vectors_get_credit_for_each_component() -> None:
    assert judged(POINT, ["200", "-100", "300"]).right
    verdict = judged(POINT, ["200", "-100", "200"])
    assert (verdict.right, round(verdict.credit, 3)) == (False, 0.667)
    assert "x and y are exchanged" in judged(POINT, ["-100", "200", "300"]).reason
    assert "All signs are the other way round" in judged(POINT, ["-200", "100", "-300"]).reason
    assert judged(POINT, ["200", "100", "300"]).reason == "y: The size is right, the sign is not. Add."


@pytest.mark.parametrize(
    ("asked", "typed", "what"),
    [
        (ANGLE, ["31.2"], "Too large."),
        (POINT, ["200", "100", "300"], "y: The size is right, the sign is not."),
    ],
)
def test_a_lesson_has_the_way_apart_from_what_is_wrong(
    asked: tuple[Exercise, Variant], typed: list[str], what: str
) -> None:
    exercise, variant = asked
    staged, at_once = exercise.kind.in_stages(variant, typed, UNITS), judged(asked, typed)
    assert (staged.reason, staged.way) == (what, "Add.")
    assert at_once == replace(staged, reason=f"{what} Add.", way="")


def test_the_value_is_called_exact_only_if_it_is() -> None:
    def number(answer: float, tolerance: float, unit: Unit = UNITS.lengths) -> Number:
        return Number("", answer, unit, tolerance, "Add.")

    assert number(0.135, 0.002).judge(0.1351).reason == "The exact value is 135 mm."
    assert number(0.134536, 0.002).judge(0.1351).reason == "Rounded, it is 135 mm."
    assert (
        number(math.radians(-50.0), 0.02, UNITS.angles).judge(math.radians(-50.1)).reason
        == "The exact value is −50°."
    )
    assert count("", 2, "Add.").judge(2.0).reason == "The value is 2."


@pytest.mark.parametrize("typed", [-2.0, 2.5, 0.35])
def test_a_count_is_whole_and_not_negative(typed: float) -> None:
    for question in (count("", 2, "Look."), Number("", 2.0, PLAIN, 0.1, "Look.", ordered=False, whole=True)):
        assert question.judge(typed).full == "The answer is a whole number, and not negative. Look."
    assert count("", 2, "Look.").judge(3.0).full == "Too large. Look."


@pytest.mark.parametrize("answer", [None, 3, ["1", "2"], [3.0], "30"])
def test_what_is_no_number_is_refused(answer: object) -> None:
    with pytest.raises(InputError, match="answer"):
        judged(ANGLE, answer)


def test_texts_that_are_no_numbers_say_what_is_valid() -> None:
    for text in ("", "x", "3 mm", "1e999"):
        with pytest.raises(EntryError):
            judged(ANGLE, [text])


# DH rows


def test_a_table_counts_its_rows_as_the_arm_does() -> None:
    one = made("irb120", "dh", "[answer]\nrows = [4, 5]")
    asked = one[0].asked(one[1], UNITS)
    assert (asked.first, asked.rows) == (4, 2)
    assert 'aria-label="θ, row 4"' in question_html(asked, Sheet(), False)


ROWS = made("irb120", "dh", 'q = ["0.3", "0.2", "-0.4", "0.1", "0.6", "0.2"]\n[answer]\nrows = [1, 2, 3, 4, 5, 6]')


def rows_of(one: tuple[Exercise, Variant], robot: kin.Robot) -> list[list[str]]:
    """The table of a robot at the exercise's configuration, as a student types it."""
    values = dict(zip(robot.joint_rows, one[1].q.tolist(), strict=True))
    return [
        [
            repr(math.degrees(row.theta + (values.get(i, 0.0) if row.kind == "revolute" else 0.0))),
            repr(1000 * (row.d + (values.get(i, 0.0) if row.kind == "prismatic" else 0.0))),
            repr(1000 * row.a),
            repr(math.degrees(row.alpha)),
        ]
        for i, row in enumerate(robot.rows)
    ]


@given(st.lists(st.booleans(), min_size=5, max_size=5), st.integers(-2, 2))
def test_every_choice_of_the_directions_of_axes_is_right(flips: list[bool], turns: int) -> None:
    """z of each frame may point either way: then θ, a and α change, and the arm is the same."""
    rows = [[float(x) for x in row] for row in rows_of(ROWS, ROWS[1].robot)]
    for k, flip in enumerate(flips):
        if flip:  # a half turn of frame k+1 about its x axis
            rows[k][3] += 180.0
            theta, d, a, alpha = rows[k + 1]
            rows[k + 1] = [-theta, -d, a, alpha + 180.0]
            # Rx(π) Rz(θ) Tz(d) = Rz(−θ) Tz(−d) Rx(π); Rx(π) commutes with Tx(a) Rx(α).
    rows[0][0] += 360.0 * turns
    verdict = judged(ROWS, [[repr(x) for x in row] for row in rows])
    assert verdict.right, verdict
    assert any(flips) == ("Other frames" in verdict.reason)


def test_a_frame_may_turn_half_about_its_own_z() -> None:
    rows = [[float(x) for x in row] for row in rows_of(ROWS, ROWS[1].robot)]
    rows[1][0] += 180.0  # x of frame 2 the other way: a and α change their signs, and the next θ
    rows[1][2] *= -1
    rows[1][3] *= -1
    rows[2][0] += 180.0
    assert judged(ROWS, [[repr(x) for x in row] for row in rows]).right


def test_the_other_convention_is_recognised() -> None:
    """The same arm in Craig's convention: its numbers are right there, and are said to be."""
    arm = ROWS[1].robot
    verdict = judged(ROWS, rows_of(ROWS, convert_dh(arm, "modified")))
    assert not verdict.right
    assert verdict.reason.startswith("This is correct for the other convention, Craig’s convention.")
    assert verdict.credit == 0.5


def test_a_wrong_sign_and_a_wrong_row_are_named() -> None:
    rows = rows_of(ROWS, ROWS[1].robot)
    turned = [list(row) for row in rows]
    turned[5][1] = repr(-float(turned[5][1]))
    verdict = judged(ROWS, turned)
    assert verdict.reason == "Row 6 is right but for the sign of d."
    assert verdict.credit == pytest.approx(5 / 6, abs=1e-3)
    moved = [list(row) for row in rows]
    moved[1][2] = "300"
    assert (
        "the axis of joint 3 has the right direction, but it is 30 mm from its place" in judged(ROWS, moved).reason
    )
    moved = [list(row) for row in rows]
    moved[0][3] = "-40"
    assert "the axis of joint 2 points elsewhere, off by 50°" in judged(ROWS, moved).reason


def test_units_of_a_table_are_recognised() -> None:
    rows = rows_of(ROWS, ROWS[1].robot)
    radians = [[repr(math.radians(float(r[0]))), r[1], r[2], repr(math.radians(float(r[3])))] for r in rows]
    assert judged(ROWS, radians).reason.startswith("The angles are in radians; the unit is degrees.")
    metres = [[r[0], repr(float(r[1]) / 1000), repr(float(r[2]) / 1000), r[3]] for r in rows]
    assert judged(ROWS, metres).reason == "The lengths are in metres; the unit is mm."
    with pytest.raises(EntryError, match="α of row 2"):
        judged(ROWS, [rows[0], [*rows[1][:3], "x"], *rows[2:]])


# Reach

REACH = made(
    "puma560",
    "reach",
    '[target]\nq = ["0.3", "0.9", "-2.0", "0", "0.8", "0"]\n'
    '[answer]\ntask = "pose"\nbranch = "elbow up, wrist no-flip"\nmargin = 2',
)


def test_a_posture_is_judged_by_all_conditions() -> None:
    robot = REACH[1].robot
    results = {}
    for solution in kin.solve_ik(robot, REACH[1].pose).solutions:
        verdict = judged(REACH, solution.q.tolist())
        results[solution.branch] = verdict.right
        if not verdict.right:
            assert 0.0 < verdict.credit < 1.0
            assert "posture is" in verdict.reason or "limit" in verdict.reason
    assert any(results.values())
    assert all("elbow up" in name and "no-flip" in name for name, fine in results.items() if fine)


def test_a_negated_joint_is_recognised() -> None:
    q = np.array(REACH[0].kind.answer(REACH[1]))
    wrong = q.copy()
    wrong[0] = -wrong[0]
    assert judged(REACH, wrong.tolist()).reason.endswith("With the other sign of joint 1 it would be there.")
    for given_ in ([0.0] * 5, [math.nan] * 6, "home", [True] * 6):
        with pytest.raises(InputError):
            judged(REACH, given_)


ACROSS = made(
    "planar2r", "reach", '[target]\nposition = ["-1.2", "0.7", "0"]\n[answer]\nline = ["-1.2", "-0.3", "0"]'
)


def test_a_line_begins_in_a_posture_from_which_it_goes_through() -> None:
    """Joint 1 would have to pass 180° with one elbow, as angles of the two links say."""
    right = {}
    for solution in kin.solve_ik(ACROSS[1].robot, ACROSS[1].pose, task="position").solutions:
        verdict = judged(ACROSS, solution.q.tolist())
        right[bool(solution.q[1] > 0.0)] = verdict.right
        if not verdict.right:
            assert "From this posture the line does not go through." in verdict.reason
            assert "joint 1" in verdict.reason
            assert verdict.credit == 0.5
    assert right == {True: True, False: False}
    away = judged(ACROSS, [0.0, 1.0])
    assert (away.right, away.credit) == (False, 0.0)
    with pytest.raises(ExerciseFileError, match="three values x, y, z"):
        made("planar2r", "reach", '[target]\nposition = ["1", "0", "0"]\n[answer]\nline = ["1", "0"]')
    with pytest.raises(VariantError, match="no posture leads along the line"):
        made("planar2r", "reach", '[target]\nposition = ["1", "0", "0"]\n[answer]\nline = ["9", "0", "0"]')[
            0
        ].verify()


# Solutions

ALL = made("puma560", "solutions", '[target]\nq = ["0.3", "0.9", "-2.0", "0.4", "0.8", "0.5"]\n[answer]\nrows = 8')


def test_all_solutions_are_found_only_by_all_of_them() -> None:
    right = ALL[0].kind.answer(ALL[1])
    assert isinstance(right, list)
    assert len(right) >= 2
    assert judged(ALL, right[::-1]).right
    assert judged(ALL, [*right, [""] * 6]).right, "empty rows do not count"
    part = judged(ALL, right[1:])
    assert (part.right, part.reason) == (False, "There is another solution.")
    assert part.credit == pytest.approx(1 - 1 / len(right), abs=1e-3)
    twice = judged(ALL, [*right, right[0]])
    assert "once more" in twice.reason
    assert judged(ALL, []).reason == "There is a solution."


def test_a_target_that_a_curve_of_configurations_meets_is_no_question() -> None:
    """With joint 5 at zero, axes 4 and 6 are one line: only the sum of their angles counts."""
    singular = '[target]\nq = ["0.3", "0.9", "-2.0", "0.4", "0", "0.5"]\n[answer]\nrows = 8'
    with pytest.raises(VariantError, match="infinitely many configurations"):
        made("puma560", "solutions", singular)[0].verify()


def test_a_row_that_is_no_solution_gets_its_reason() -> None:
    right = ALL[0].kind.answer(ALL[1])
    assert isinstance(right, list)
    row = list(right[0])
    row[4] = repr(-float(row[4]))
    assert "this is a solution with joint 5 negated" in judged(ALL, [row, *right[1:]]).reason
    radians = [repr(math.radians(float(x))) for x in right[0]]
    assert "these are radians" in judged(ALL, [radians]).reason
    turned = [repr(float(right[0][0]) + 360.0), *right[0][1:]]
    assert "outside its limits" in judged(ALL, [turned]).reason
    assert "from the target" in judged(ALL, [["10", "20", "-90", "5", "40", "7"]]).reason


# Singularities


def test_a_direction_may_have_any_length_and_sign() -> None:
    lost = made("scara", "singularity", 'q = ["0.4", "0", "0.1", "0"]\n[answer]\nasks = "direction"')
    x, y = math.cos(0.4), math.sin(0.4)
    for factor in (1.0, -3.0, 0.01):
        assert judged(lost, [repr(factor * x), repr(factor * y), "0"]).right
    verdict = judged(lost, ["0", "0", "1"])
    assert (
        verdict.reason
        == "The tool point can move in this direction: joint 3, sliding at 1 m/s, moves it by 1 m/s."
    )
    with pytest.raises(EntryError, match="not zero"):
        judged(lost, ["0", "0", "0"])


def test_the_number_of_a_joint_is_neither_too_large_nor_too_small() -> None:
    text = 'q = ["0", "0", "0"]\n[answer]\nvalue = "2"\nunit = "%s"\nmethod = "Compare the distances."'
    joint, count = (made("planar3r", "number", text % unit) for unit in ("joint", "count"))
    assert judged(joint, ["2"]).right
    assert judged(joint, ["3"]).reason == "Compare the distances."
    assert judged(count, ["3"]).reason == "Too large. Compare the distances."


def test_a_wrong_singularity_is_given_its_distance() -> None:
    named = made("puma560", "singularity", 'q = ["0", "0.9", "-2.6", "0.4", "0", "0.5"]\n[answer]\nasks = "name"')
    labels = named[0].asked(named[1], UNITS).labels
    for i, label in enumerate(labels):
        verdict = judged(named, i)
        assert verdict.right == ("xes 4 and 6" in label)
        if not verdict.right:
            assert "away from that singularity" in verdict.reason


# Frames and orders

FRAME = made(
    "planar2r",
    "frame",
    '[answer]\nmotions = [{ slide = "x", by = "0.5" }, { turn = "z", by = "60*deg" }, '
    '{ turn = "x", by = "90*deg" }]',
)


def pose_numbers(T: np.ndarray) -> list[float]:
    return [*T[:3, 3].tolist(), *kin.wxyz_from_rotation(T[:3, :3]).tolist()]


def test_a_ghost_is_judged_by_place_and_direction() -> None:
    right = FRAME[0].kind.answer(FRAME[1])
    assert isinstance(right, list)
    assert judged(FRAME, right).right
    assert judged(FRAME, [*right[:3], *(-x for x in right[3:])]).right, "−q is the same rotation"
    assert judged(FRAME, [right[0] + 0.05, *right[1:]]).reason.startswith("The axes point the right way.")
    assert judged(FRAME, [right[0] + 0.05, *right[1:]]).credit == 0.5
    base = pose_numbers(_turn(0, math.pi / 2) @ _turn(2, math.pi / 3) @ _slide(0.5))
    assert "about the axes of the base" in judged(FRAME, base).reason
    other = pose_numbers(_slide(0.5) @ _turn(2, -math.pi / 3) @ _turn(0, math.pi / 2))
    assert "Turn 2 goes the other way." in judged(FRAME, other).reason
    for given_ in ([0.0] * 7, [0.0] * 6, None):
        with pytest.raises(InputError):
            judged(FRAME, given_)


def _turn(axis: int, angle: float) -> np.ndarray:
    T, (i, j) = np.eye(4), ((axis + 1) % 3, (axis + 2) % 3)
    T[i, i] = T[j, j] = math.cos(angle)
    T[i, j], T[j, i] = -math.sin(angle), math.sin(angle)
    return T


def _slide(x: float) -> np.ndarray:
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_the_frame_of_a_row_knows_negated_joints() -> None:
    row = made("scara", "frame", 'q = ["0.5", "0.8", "0.1", "0"]\n[answer]\nrow = 2')
    frames = kin.link_frames("scara", [0.5, -0.8, 0.1, 0.0])
    assert judged(row, pose_numbers(frames[1])).reason == "This is the frame with joint 2 negated."
    assert judged(row, pose_numbers(frames[0])).reason == "This is frame 1. Frame 2 is asked."


ORDER = made(
    "planar2r",
    "order",
    '[answer]\nmotions = [{ turn = "z", by = "0.4" }, { slide = "z", by = "0.2" }, '
    '{ slide = "x", by = "0.3" }, { turn = "x", by = "1.0" }]',
)


def test_orders_with_the_same_product_are_right() -> None:
    right = ORDER[0].kind.answer(ORDER[1])
    assert isinstance(right, list)
    a, b, c, d = right
    for order in ([a, b, c, d], [b, a, c, d], [b, a, d, c], [a, b, d, c]):
        assert judged(ORDER, order).right
    other = judged(ORDER, [c, d, a, b])
    assert other.reason.startswith("This order is correct for the other convention")
    fixed = made(
        "planar2r", "order", '[answer]\nmotions = [{ turn = "x", by = "0.4" }, { turn = "y", by = "0.2" }]'
    )
    swapped = fixed[0].kind.answer(fixed[1])[::-1]  # type: ignore[index]
    assert "right for motions about the axes of the base" in judged(fixed, swapped).reason
    assert judged(ORDER, [a, d, b, c]).credit == 0.25
    for given_ in ([a, b, c], [a, a, b, c], "abcd", [a, b, c, 9]):
        with pytest.raises(InputError):
            judged(ORDER, given_)


# Mistakes in a table


def mistaken(robot: str, *mistakes: str) -> Exercise:
    return made(robot, "mistake", f"[answer]\nmistakes = {list(mistakes)}")[0]


def shown_rows(exercise: Exercise, variant: Variant, units: Units = UNITS) -> list[list[str]]:
    return [list(row) for row in exercise.asked(variant, units).cells]


@pytest.mark.parametrize("units", [UNITS, RADIANS])
def test_a_mistake_is_drawn_that_changes_the_poses(units: Units) -> None:
    exercise = mistaken("puma560", "sign", "exchanged", "twist")
    drawn = set()
    for seed in range(20):
        variant = exercise.variant(seed)
        rows = shown_rows(exercise, variant, units)
        drawn.add(str(rows))
        values = np.array(rows, float) * np.where(
            [True, False, False, True], 1.0 / units.angles.scale, 1.0 / units.lengths.scale
        )
        poses = [
            kin.fk(_with_values(variant.robot, table), variant.q) for table in (values, _values(variant.robot))
        ]
        assert np.abs(poses[0] - poses[1]).max() > 1e-3, rows
        verdict = exercise.judge(variant, rows, units)
        assert not verdict.right
        assert verdict.reason.startswith("This is still the table with its mistake.")
    assert len(drawn) > 8
    exercise.verify()


def _values(robot: kin.Robot) -> np.ndarray:
    return np.array([[row.theta, row.d, row.a, row.alpha] for row in robot.rows])


def _with_values(robot: kin.Robot, values: np.ndarray) -> kin.Robot:
    rows = [
        replace(row, theta=theta, d=d, a=a, alpha=alpha)
        for row, (theta, d, a, alpha) in zip(robot.rows, values.tolist(), strict=True)
    ]
    return replace(robot, rows=tuple(rows), capsules=(), capsules_source="")


def test_what_changes_nothing_is_never_drawn() -> None:
    exercise = mistaken("planar2r", "sign")  # α, d and θ are 0: only a can have another sign
    for seed in range(20):
        variant = exercise.variant(seed)
        rows = shown_rows(exercise, variant)
        assert any(row[2].startswith("-") for row in rows), rows
    with pytest.raises(VariantError, match="none of the mistakes offset changes the poses of the arm"):
        mistaken("planar2r", "offset").verify()


def test_the_comparison_says_what_is_wrong_with_the_table_as_it_is_now() -> None:
    exercise = mistaken("scara", "decimal point")
    variant = exercise.variant(0)
    right: Any = exercise.kind.answer(variant)
    rows = [list(row) for row in right]
    rows[0][1], rows[1][1] = "0", rows[0][1]  # the height a row later
    verdict = exercise.judge(variant, rows, UNITS)
    assert verdict.right
    assert "though some rows are not the arm’s own" in verdict.reason
    assert "has its decimal point in the wrong place" in verdict.reason

    rows = [list(row) for row in right]
    rows[1][2] = "200"
    verdict = exercise.judge(variant, rows, UNITS)
    assert not verdict.right
    assert verdict.reason.endswith("One change would make it the arm.")
    rows[0][3] = "90"
    verdict = exercise.judge(variant, rows, UNITS)
    assert "at an angle of 0.0° in the arm and 90.0° in your table" in verdict.reason
    assert verdict.reason.endswith("Two changes would make it the arm.")
    rows = [list(row) for row in right]
    rows[0][0] = "90"
    verdict = exercise.judge(variant, rows, UNITS)
    assert (
        "The same arm: joint 1 counts from −90.0°. Equal joint values have to give equal poses." in verdict.reason
    )
    rows[0][0] = "0.01"  # as a student may round
    assert exercise.judge(variant, rows, UNITS).right


def test_the_table_to_correct_is_on_the_page_and_its_exact_numbers_are_kept() -> None:
    exercise = mistaken("panda", "sign")  # 1.5707963…, shown as 90 or 1.5708
    variant = exercise.variant(1)
    assert "added to θ of its row; row 8 is fixed." in exercise.asked(variant, UNITS).note
    for units in (UNITS, RADIANS):
        rows, right = shown_rows(exercise, variant, units), shown_rows_of(variant.robot, units)
        assert f'value="{rows[2][1]}"' in question_html(exercise.asked(variant, units), Sheet(), False)
        changed = [(i, j) for i, row in enumerate(rows) for j, text in enumerate(row) if text != right[i][j]]
        assert changed
        for i, j in changed:
            rows[i][j] = right[i][j]
        verdict = exercise.judge(variant, rows, units)
        assert verdict.right, verdict
    for given_ in ([], [["1"] * 4], rows[:-1], [*rows, rows[0]], "table", [[1.0] * 4] * len(rows)):
        with pytest.raises(InputError):
            exercise.judge(variant, given_, UNITS)
    rows[3][2] = "a"
    with pytest.raises(EntryError, match="a of row 4 was not read"):
        exercise.judge(variant, rows, UNITS)


def shown_rows_of(robot: kin.Robot, units: Units) -> list[list[str]]:
    scales = [units.angles.scale, units.lengths.scale, units.lengths.scale, units.angles.scale]
    return [
        [f"{x * scale + 0.0:.6g}" for x, scale in zip(row, scales, strict=True)] for row in _values(robot).tolist()
    ]


def test_mistakes_of_a_file_are_checked() -> None:
    with pytest.raises(ExerciseFileError, match=r"answer\.mistakes\[1\]: got .kind., expected one of .sign."):
        mistaken("puma560", "sign", "kind")
    with pytest.raises(ExerciseFileError, match="a list of 1 to 40 items"):
        mistaken("puma560")


# Terms and programs


def test_the_wrong_term_is_drawn_by_the_seed() -> None:
    exercise = parse_exercise(
        f'{HEAD}robot = "planar2r"\nkind = "term"\n[answer]\nname = "x"\nentry = "x"\n'
        'terms = [{ value = "cos(q1)", shown = "A" }, { value = "0.6*cos(q1 + q2)", shown = "B" }]\n'
        'misprints = [{ term = 1, value = "sin(q1)", shown = "C", reason = "First one wrong." },\n'
        '{ term = 2, value = "0.6*cos(q2)", shown = "D", reason = "Second one wrong." }]'
    )
    drawn = set()
    for seed in range(12):
        variant = exercise.variant(seed)
        labels = exercise.asked(variant, UNITS).labels
        drawn.add(labels)
        wrong = 0 if labels == ("C", "B") else 1
        assert exercise.judge(variant, wrong, UNITS).right
        assert "This term is right" in exercise.judge(variant, 1 - wrong, UNITS).reason
    assert drawn == {("C", "B"), ("A", "D")}
    exercise.verify()


LINE = made(
    "irb120", "program", '[target]\nposition = ["x", "y + 0.2", "z"]\n[answer]\nstraight = 2\ntool_speed = 0.2'
)


def test_programs_are_refused_with_the_planners_own_reasons() -> None:
    x, y, z = (1000 * LINE[1].pose[:3, 3]).tolist()
    head = 'units = { length = "mm", angle = "deg" }\n[[segments]]\n'
    ptp = judged(LINE, f'{head}kind = "ptp"\nposition = [{x}, {y}, {z}]\ntool_speed = 200')
    assert "off the line. A PTP is straight in the joints" in ptp.reason
    fast = judged(LINE, f'{head}kind = "lin"\nposition = [{x}, {y}, {z}]')
    assert "0.2 m/s are allowed" in fast.reason
    assert fast.credit == pytest.approx(2 / 3)
    short = judged(LINE, f'{head}kind = "lin"\nposition = [{x}, {y - 50}, {z}]\ntool_speed = 200')
    assert short.reason == "The program ends 50 mm from the end of the line."
    far = judged(LINE, f'{head}kind = "lin"\nposition = [3000, 0, {z}]')
    assert far.reason.startswith("Segment 1 (LIN) cannot be driven")
    for text in ("", "x", 5, "[[segments]]\nkind = 'fly'", "#" * 5000):
        with pytest.raises(InputError):
            judged(LINE, text)


def test_the_shown_program_is_right_as_it_stands() -> None:
    said = LINE[0].solution(LINE[1], UNITS)
    assert judged(LINE, said.removeprefix("One program:")).right
    assert LINE[0].asked(LINE[1], UNITS).start.splitlines()[0] in said, "in the units of the text to begin with"


def test_every_kind_says_what_it_asks() -> None:
    assert all(kind.about.endswith(".") for kind in KINDS.values())


@pytest.mark.parametrize("given", [10**400, -(10**400), math.inf, math.nan, True, "1"])
def test_what_no_float_holds_is_no_answer(given):
    assert not Number("How many?", 1.0, PLAIN, 0.1, "Count.").is_answer(given)
    with pytest.raises(InputError):
        numbers([0.0, given], 2, "two numbers")
