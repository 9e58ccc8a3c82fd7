"""The texts of lessons in files: what is refused, and that each is made for the lesson's arms in all units."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lesson_arms import ASKED, IDS

import kin
from app.cli.parser import main
from app.exercises import ExerciseFileError
from app.exercises.lesson_text import lesson_files, load_lesson, parse_lesson
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.velocity.questions import facts
from kin.units import Units

FILES = lesson_files()
UNITS = (Units(), Units(degrees=False, length="m"), Units(length="cm"))
SMALL = """
goal = "You can count."
arms = ["ur5", "puma560"]
[facts]
x = "a number"
"f(i)" = "a function"
[words]
kind = [{ when = "x > 1", text = "many" }, "few"]
[[steps]]
title = "One"
text = "There are {kind}."
[steps.question]
kind = "number"
prompt = "How many?"
value = "f(x)"
unit = "count"
method = "Count."
[[check]]
kind = "choice"
prompt = "Many?"
options = [{ text = "Yes", when = "x > 1", reason = "A." }, { text = "No", when = "x <= 1", reason = "B." }]
[example]
title = "one link"
rows = [{ a = 0.4 }]
steps = [{ q = [0], text = "It rests." }, { q = [1], text = "It turns." }, { text = "It rests." }]
"""


def test_lessons_have_files() -> None:
    assert FILES.keys() == {lesson.key for lesson in LESSONS}


@pytest.mark.parametrize(("lesson", "robot"), ASKED, ids=IDS)
def test_every_text_is_made_for_the_lessons_arms_in_all_units(lesson: type[Lesson], robot: kin.Robot) -> None:
    for units in UNITS:
        outline = lesson.outline(robot, units)
        texts = [outline.goal, *(q.prompt + q.solution() for _, q in outline.questions())]
        texts += [s.title + s.text + s.shown + s.practice for s in outline.steps]
        for text in texts:
            assert not re.search(r"[{}]|\bnan\b", text), (robot.id, text)


def test_few_arms_need_few_conditions() -> None:
    for file in FILES.values():
        assert 2 <= len(load_lesson(file).arms) <= 4, file
    conditions = [len(re.findall(r"\bwhen = ", file.read_text(encoding="utf-8"))) for file in FILES.values()]
    assert sum(conditions) <= 20, dict(zip(FILES, conditions, strict=True))


@pytest.mark.parametrize("key", FILES)
def test_every_declared_fact_is_used(key: str) -> None:
    text = re.split(r"\n\[(?!facts\])", Path(FILES[key]).read_text(encoding="utf-8"), maxsplit=1)[1]
    unused = [name for name in load_lesson(FILES[key]).facts if not re.search(rf"\b{name}\b", text)]
    assert unused == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('arms = ["ur5", "puma560"]', "", "arms: got None, expected a list"),
        ('"puma560"]', '"puma"]', "arms: got 'puma', expected ids of arms: pioneer5"),
        ('title = "One"', 'title = "One"\narms = ["ur"]', "steps[0].arms: got 'ur', expected ids of arms"),
        ('[example]\ntitle = "one link"', "[example]", "example.title: got None, expected a text"),
        ('text = "There are {kind}."', 'text = "There are {kid}."', "steps[0].text: got '{kid}', expected"),
        ('value = "f(x)"', 'value = "g(x)"', "steps[0].question.value: got 'g', expected a name from [facts]"),
        ('unit = "count"', 'unit = "stone"', "steps[0].question.unit: got 'stone', expected one of"),
        (
            'method = "Count."',
            'method = "Count."\nhint = "x"',
            "steps[0].question.hint: got 'x', expected no",
        ),
        ('kind = "choice"', 'kind = "choose"', "check[0].kind: got 'choose', expected one of"),
        ('x = "a number"', 'X = "a number"', "facts.X: got 'a number', expected a name such as"),
        ('"few"]', '{ text = "few" }]', "words.kind: got"),
        ('goal = "You can count."', "", "goal: got None, expected a text"),
        (
            'title = "One"',
            'title = "One"\ndrawn = { pose = "a", joint = 0 }',
            "steps[0].drawn.joint: got 0, expected",
        ),
        (
            'title = "One"',
            'title = "One"\ndrawn = { joint = 1 }',
            "steps[0].drawn.pose: got None, expected a text",
        ),
    ],
)
def test_a_mistake_is_named_with_its_field(old: str, new: str, message: str) -> None:
    assert parse_lesson(SMALL).steps[0].title
    with pytest.raises(ExerciseFileError, match=re.escape(message)):
        parse_lesson(SMALL.replace(old, new))


def test_what_the_lesson_does_not_compute_is_named() -> None:
    robot = kin.get_robot("ur5")
    known = facts(robot, UNITS[0])
    assert outline_of("velocity", robot, UNITS[0], known).steps
    fewer = {name: value for name, value in known.numbers.items() if name != "speed"}
    with pytest.raises(ExerciseFileError, match="facts: got 'speed'"):
        outline_of("velocity", robot, UNITS[0], LessonFacts(fewer, known.functions, known.words, known.poses))
    with pytest.raises(ExerciseFileError, match="pose: got 'home'"):
        outline_of("velocity", robot, UNITS[0], LessonFacts(known.numbers, known.functions, known.words))


def test_facts_are_the_attributes_of_the_lessons_class(tmp_path: Path) -> None:
    known = load_lesson(FILES["screws"]).facts
    assert known["slides"] == "The first joint that slides; 0: none does."
    assert all(known.values()), "each has a docstring"
    assert not {name for name in known if name.startswith("_")} | {"poses", "leads"} & known.keys()
    for name in ("lesson.py", "lesson.toml"):
        text = FILES["screws"].with_name(name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace("row {slides}", "row {slide}"), encoding="utf-8")
    with pytest.raises(ExerciseFileError, match=r"steps\[2\]\.shown.*got '\{slide\}'.*slides") as caught:
        load_lesson(tmp_path / "lesson.toml")
    assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("key", FILES)
def test_kinboard_check_reads_the_file(key: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(FILES[key])]) == 0
    shown = capsys.readouterr().out
    assert "questions in the check." in shown
    assert all(name in shown for name in load_lesson(FILES[key]).facts)


def test_kinboard_check_refuses_a_wrong_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = tmp_path / "lesson.toml"
    wrong.write_text(SMALL.replace("{kind}", "{kid}"), encoding="utf-8")
    assert main(["check", str(wrong)]) != 0
    assert "steps[0].text" in capsys.readouterr().err
