"""Exercise files: what is refused, and how it is said; expressions; `kinboard check`."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.cli.parser import main
from app.exercises import Exercises, VariantError, load_folder, parse_exercise
from app.exercises.expressions import Expression, ExpressionError
from app.exercises.fields import ExerciseFileError
from app.exercises.files import BUILTIN

GOOD = """
id = "sum"
title = "Sum"
topic = "Velocity"
robot = "planar2r"
kind = "number"
text = "What is {t} and {u}?"
hints = ["Add {t}."]
q = ["t", "0.5*u"]

[vary]
t = { from = 10, to = 40, step = 10, unit = "deg" }
u = { choose = [5, 15], unit = "deg" }

[answer]
value = "t + u"
unit = "deg"
tolerance = 1
method = "Add both."
"""


def changed(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new)


@pytest.mark.parametrize(
    ("text", "field", "said"),
    [
        ("id = ", "file", "valid TOML"),
        (changed('kind = "number"', 'kind = "numbers"'), "kind", 'one of "number", "choice"'),
        (changed('topic = "Velocity"', 'topic = "Music"'), "topic", '"Forward kinematics"'),
        (changed('robot = "planar2r"', 'robot = "r2d2"'), "robot", "the id of a robot"),
        (changed('id = "sum"', 'id = "A sum"'), "id", "lower-case letters"),
        (changed('title = "Sum"', 'titel = "Sum"'), "title", "a text of 1 to"),
        (changed('title = "Sum"', 'title = "Sum"\nlevle = 2'), "levle", "no such field; valid are"),
        (changed('title = "Sum"', 'title = "Sum"\nlevel = 4'), "level", "a whole number from 1 to 3"),
        (changed("{t} and", "{s} and"), "text", "a name from [vary] or [let]: t, u"),
        (changed('"Add {t}."', '"Add {z}."'), "hints[0]", "a name from [vary]"),
        (changed('q = ["t", "0.5*u"]', 'q = ["t"]'), "q", "2 values, one per joint"),
        (changed('q = ["t",', 'q = ["t +",'), "q[0]", "an expression of numbers, names"),
        (changed('q = ["t",', 'q = ["__import__(t)",'), "q[0]", "a name from [vary] or [let], or of the arm: J, "),
        (changed('value = "t + u"', 'value = "9**9**9"'), "answer.value", "a power beyond 8"),
        (changed('value = "t + u"', 'value = "t + v"'), "answer.value", "of the arm: J, a, alpha"),
        (changed("[answer]", '[let]\nv = "w1 + t"\n\n[answer]'), "let.v", "a name from [vary]"),
        (
            GOOD + '[[answer.mistakes]]\nvalue = "1/0"\nreason = "x"',
            "answer.mistakes[0].value",
            "division by zero",
        ),
        (changed("to = 40, ", "to = 1, "), "vary.t.to", "a number above 10"),
        (changed("step = 10, ", ""), "vary.t.step", "a number above 0"),
        (changed('unit = "deg" }\nu', 'unit = "grad" }\nu'), "vary.t.unit", 'one of "deg"'),
        (changed('value = "t + u"', 'value = "[t]"'), "answer.value", "is not arithmetic"),
        (changed("tolerance = 1", "tolerance = 0"), "answer.tolerance", "a number above 0"),
        (changed("tolerance = 1", "tolerance = 1\ntoll = 2"), "answer.toll", "no such field"),
        (changed('method = "Add both."', ""), "answer.method", "a text"),
        (GOOD + "[[answer.mistakes]]\nvalue = 3", "answer.mistakes[0].reason", "a text"),
        (
            GOOD + "[target]\nq = [1, 2]\nposition = [1, 2, 3]",
            "target.q",
            "either q, a configuration, or position",
        ),
    ],
)
def test_a_wrong_file_is_refused_by_file_field_value_and_what_is_valid(text: str, field: str, said: str) -> None:
    with pytest.raises(ExerciseFileError) as caught:
        parse_exercise(text, "sum.toml")
    assert caught.value.field == field
    assert str(caught.value).startswith(f"sum.toml: {field}: got ")
    assert said in caught.value.expected


def test_an_exercise_that_makes_no_sense_is_found_by_trying() -> None:
    for text, said in (
        (changed('"t + u"', '"1/(u - 5*deg)"'), r"seed \d: answer\.value: .*division by zero"),
        (changed('q = ["t",', 'q = ["acos(t + 2)",'), r"seed 0: q\[0\]: .*math domain error"),
        (changed("[answer]", '[let]\nv = "J(9, 9)"\n\n[answer]'), r"seed 0: let\.v: .*no entry 9, 9"),
        (changed('q = ["t",', 'q = ["t + 400*deg",'), "q is outside the limits"),
        (
            changed('value = "t + u"\nunit = "deg"\ntolerance = 1', 'value = "2.5"\nunit = "count"'),
            r"the value is 2\.5: a count is a whole number",
        ),
        (changed('text = "What', 'require = ["t < 0"]\ntext = "What'), "no numbers that meet the conditions"),
    ):
        with pytest.raises(VariantError, match=said):
            parse_exercise(text).verify()
    parse_exercise(GOOD).verify()


def test_a_folder_is_read_beside_the_built_in_ones(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(GOOD, encoding="utf-8")
    both = Exercises(tmp_path)
    assert both.get("sum") is not None
    assert len(both.all) == len(Exercises().all) + 1
    (tmp_path / "b.toml").write_text(GOOD, encoding="utf-8")
    with pytest.raises(ExerciseFileError, match=r"b\.toml: id: got 'sum', expected an id that no other file"):
        load_folder(tmp_path)
    (tmp_path / "b.toml").write_text(changed('"sum"', '"two-elbows"'), encoding="utf-8")
    with pytest.raises(ExerciseFileError, match="an id that no built-in exercise has"):
        Exercises(tmp_path)
    with pytest.raises(ExerciseFileError, match="a folder that can be read"):
        Exercises(tmp_path / "none")


@given(st.floats(-10, 10), st.floats(0.1, 10))
def test_expressions_compute(a: float, b: float) -> None:
    scope = {"a": a, "b": b, "f": lambda i: 10.0 * i}
    assert Expression("a + 2*b - a/b").value(scope) == a + 2 * b - a / b
    assert Expression("-sqrt(b)**2").value(scope) == -(math.sqrt(b) ** 2)
    assert Expression("f(3) + (a > 0) + 90*deg").value(scope) == 30.0 + (a > 0) + 90 * (math.pi / 180)
    assert Expression("a < b and not a > b").value(scope) == (a < b)
    assert Expression("a + f(b)").names == {"a", "f", "b"}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a b",
        "a.real",
        "[1]",
        "'a'",
        "lambda: 1",
        "(a := 1)",
        "a if a else 1",
        "a[0]",
        "f(x=1)",
        "a @ a",
        "1" * 401,
    ],
)
def test_what_is_not_arithmetic_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError):
        Expression(text).value({"a": 1.0, "f": math.sin})


@pytest.mark.parametrize("text", ["1/0", "sqrt(-1)", "(-8)**0.5", "9**9**9", "1e308*10", "sin", "a(1)", "nothing"])
def test_expressions_without_a_value_say_why(text: str) -> None:
    with pytest.raises(ExpressionError):
        Expression(text).value({"a": 1.0, "sin": math.sin})


def test_the_check_command_describes_an_exercise(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(BUILTIN / "two-elbows.toml")]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Both elbows (two-elbows)\nInverse kinematics, level 2, planar2r\n")
    assert "Solved for 8 variants" in out
    file = tmp_path / "sum.toml"
    file.write_text(changed("tolerance = 1", "tolerance = -1"), encoding="utf-8")
    assert main(["check", str(file)]) == 2
    assert "answer.tolerance: got -1, expected a number above 0" in capsys.readouterr().err
    file.write_text(changed('"t + u"', '"1/(u - 5*deg)"'), encoding="utf-8")
    assert main(["check", str(file)]) == 2
    said = capsys.readouterr().err
    assert "answer.value: got 'seed " in said
    assert "expected an exercise that can be solved" in said
