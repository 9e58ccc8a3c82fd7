"""Files that replace or translate the words of lessons: what they say, what is refused, and their folder."""

from __future__ import annotations

import logging
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import pytest
from test_lesson_text import SMALL

from app.cli.parser import main
from app.exercises import ExerciseFileError, Lessons
from app.exercises import shelf as shelves
from app.exercises.fields import LIMITS
from app.exercises.lesson_text import (
    LessonText,
    Translation,
    lesson_files,
    load_words,
    named,
    parse_lesson,
    texts_of,
)
from kin import InputError
from kin.parsing import to_toml

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples" / "lessons" / "velocity.de.toml"
PAGE = (ROOT / "docs" / "lessons.md").read_text(encoding="utf-8")
BASE = parse_lesson(SMALL)
WORDS = """
title = "Zählen"
[lesson]
"You can count." = "Du kannst zählen."
"many" = "viele"
[steps.One]
"There are {kind}." = "Es gibt {kind}."
"Count." = ""
[check]
"Yes" = "Ja"
[controls]
"Step" = "Schritt"
"""


def words(folder: Path, text: str = WORDS, name: str = "velocity.de.toml", base: LessonText = BASE) -> LessonText:
    (path := folder / name).write_text(text, encoding="utf-8")
    return load_words(path, base, named(path)[1])


def translation(text: LessonText) -> Translation:
    assert text.translation is not None
    return text.translation


def test_what_a_file_says_takes_the_place_of_texts_alone(tmp_path: Path) -> None:
    found = words(tmp_path)
    assert (found.title, found.about, found.controls) == ("Zählen", "", {"Step": "Schritt"})
    assert found.goal.alternatives[0][1] == "Du kannst zählen."
    assert [text for _, text in found.words["kind"].alternatives] == ["viele", "few"]
    assert found.steps[0].text.alternatives[0][1] == "Es gibt {kind}."
    assert found.steps[0].title.alternatives[0][1] == "One"
    question = found.steps[0].questions[0].kind
    assert [each.text for each in vars(question)["value"]] == ["f(x)"], "no expression is a text"
    assert translation(found).missing == {
        ("lesson",): ["few"],
        ("steps", "One"): ["One", "How many?", "Count."],
        ("check",): ["Many?", "No"],  # single letters are no words
        ("example",): ["one link", "It rests.", "It turns."],
    }
    assert translation(found).stray is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "Es gibt {kind}.",
            "Es gibt {king}.",
            "steps.One.'There are {kind}.': got '{king}', expected a name from [f",
        ),
        ('"Es gibt {kind}."', "7", "steps.One.'There are {kind}.': got 7, expected a text"),
        ('title = "Zählen"', "titel = 1", "'titel': got 1, expected no such field; valid are "),
        ("[check]", "[[check]]", "check: got [{"),
        ('"Yes" = "Ja"', '"Yes" = "No"', "check[0].options: got ['No', 'No'], expected a different text"),
    ],
)
def test_a_mistake_is_named_with_its_field(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "velocity.de.toml"
    with pytest.raises(ExerciseFileError) as caught:
        words(tmp_path, WORDS.replace(old, new))
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[steps.Two]\n"Two" = "Zwei"', "steps.'Two': got 'Two', expected the title of a step: One"),
        (
            '[lesson]\n"You can\\u001b[2J" = 7',
            "lesson.'You can\\x1b[2J': got 7, expected a text that the lesson has here",
        ),
        (
            '"There are {kinds}." = "Es gibt"',
            "steps.One.'There are {kinds}.': got 'Es gibt', expected a text that the lesson has here, such as "
            "'There are {kind}.'",
        ),
    ],
)
def test_words_for_what_the_lesson_does_not_have_stray(tmp_path: Path, more: str, message: str) -> None:
    found = words(tmp_path, f'[steps.One]\n"One" = "Eins"\n{more}')
    assert found.steps[0].title.alternatives[0][1] == "Eins"
    assert str(translation(found).stray).partition(": ")[2] == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("#" * (LIMITS.size + 1), f"expected at most {LIMITS.size} bytes"),
        ("[lesson]\n" + "".join(f"a{i} = 1\n" for i in range(LIMITS.values)), f"at most {LIMITS.values} values"),
        ("a = " + "[" * 40 + "]" * 40, f"at most {LIMITS.depth} deep"),
        ("a = ", "expected valid TOML"),
    ],
)
def test_a_file_is_bounded(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ExerciseFileError, match=re.escape(message)):
        words(tmp_path, text)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("velocity.toml", ("velocity", "en")),
        ("dh.de.toml", ("dh", "de")),
        ("speed.toml", "got 'speed', expected a lesson, as in velocity.toml or velocity.de.toml: rotations, dh"),
        ("dh.xx.toml", "got 'xx', expected the code of a language, bg, cs"),
        ("dh.en.toml", "got 'en', expected the code of a language"),
        ("dh.de.old.toml", "got 'de.old', expected"),
    ],
)
def test_a_name_says_the_lesson_and_the_language(name: str, expected: str | tuple[str, str]) -> None:
    if isinstance(expected, tuple):
        assert named(Path(name)) == expected
        return
    with pytest.raises(ExerciseFileError, match=re.escape(expected)):
        named(Path(name))


def test_a_whole_lesson_uses_the_facts_of_the_lesson_alone(tmp_path: Path) -> None:
    own = SMALL.replace("You can count.", "You can count well.")
    assert words(tmp_path, own, "velocity.toml").goal.alternatives[0][1] == "You can count well."
    for old, new, message in (
        ('x = "a number"', 'y = "a number"', "facts.y: got 'y', expected a fact of the lesson: f, x"),
        ('value = "f(x)"', 'value = "g(x)"', "steps[0].question.value: got 'g', expected a name from [facts]"),
        ("There are {kind}", "There are {kin}", "steps[0].text: got '{kin}', expected a name from [facts]"),
        ('title = "One"', 'title = "One"\n"a\\u001b[2J" = 1', "steps[0].a\\x1b[2J: got 1, expected no such field"),
    ):
        with pytest.raises(ExerciseFileError, match=re.escape(message)):
            words(tmp_path, own.replace(old, new), "velocity.toml")


# The folder


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(shelves, "EVERY", 0.0)
    (made := tmp_path / "lessons").mkdir()
    return made


def title(known: Lessons, language: str = "", lesson: str = "velocity") -> str:
    text = known.text(lesson, language)
    assert text is not None
    return text.title


def test_a_folder_is_read_again_while_the_service_runs(folder: Path) -> None:
    known = Lessons(folder)
    assert list(known.languages) == ["en"]
    assert known.text("velocity") is texts_of("velocity")
    assert known.text("sums") is None
    (folder / "velocity.de.toml").write_text('title = "Tempo"')
    assert title(known, "de") == "Tempo"
    assert list(known.languages.items()) == [("en", "English"), ("de", "Deutsch")]
    assert known.text("velocity") is texts_of("velocity"), "English pages stay"
    other = known.text("dh", "de")
    assert other is not None
    assert not any(any(said.values()) for said in translation(other).said.values())
    assert other is known.text("dh", "de")
    (folder / "velocity.toml").write_text('title = "Speed"\nabout = "Ours."')
    assert title(known) == "Speed"
    (folder / "velocity.de.toml").write_text('title = "Geschwindigkeit"')
    translated = known.text("velocity", "de")
    assert translated is not None
    assert (translated.title, translated.about) == ("Geschwindigkeit", "Ours."), "it translates what replaces ours"
    assert title(Lessons(folder, "de")) == title(Lessons(folder, "de"), "fr") == "Geschwindigkeit"


def test_an_invalid_file_is_left_out_and_the_others_count(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    (folder / "velocity.de.toml").write_text('titel = "x"')
    (folder / "speed.toml").write_text("")
    (folder / "dh.de.toml").write_text('title = "DH-Tabelle"\n[lesson]\n"gone" = "weg"')
    with caplog.at_level(logging.WARNING):
        known = Lessons(folder, "de")
    assert title(known, lesson="dh") == "DH-Tabelle"
    assert title(known) == ""
    assert [record.message.partition(str(folder))[0] for record in caplog.records] == [
        "a file is no lesson: ",
        "the words of a lesson are left out: ",
        "words are left out: ",
    ]
    (folder / "dh.de.toml").write_text("title = ")
    assert title(known, lesson="dh") == "DH-Tabelle", "what was read stays"
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()
    assert title(known, lesson="dh") == "DH-Tabelle"


def test_a_folder_or_a_language_that_does_not_exist_is_refused(folder: Path) -> None:
    with pytest.raises(ExerciseFileError, match="a folder that can be read"):
        Lessons(folder / "none")
    with pytest.raises(InputError, match=r"KINBOARD_LANGUAGE.*'fr'.*one of en"):
        Lessons(folder, "fr")


def test_a_folder_that_cannot_be_listed_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(self: Path) -> NoReturn:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", denied)
    with pytest.raises(ExerciseFileError, match=r"folder: got 'Permission denied', expected a folder that can be"):
        Lessons(folder)


def test_languages_are_listed_while_another_thread_reads_the_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Key(tuple[str, str]):
        def __iter__(self) -> Iterator[str]:
            if listing:  # what another thread does at this moment
                listing.clear()
                (folder / "velocity.fr.toml").write_text("")
                assert known.own("velocity", "fr") is not None
            return super().__iter__()

    listing: list[bool] = []
    monkeypatch.setattr(shelves, "named", lambda path: Key(named(path)))
    (folder / "velocity.de.toml").write_text("")
    (folder / "dh.de.toml").write_text("")
    known = Lessons(folder)
    listing.append(True)
    assert list(known.languages) == ["en", "de"]
    assert list(known.languages) == ["en", "de", "fr"]


# The command


def check(path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    code = main(["check", str(path)])
    return code, *capsys.readouterr()


def test_the_example_is_a_whole_translation(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = check(EXAMPLE, capsys)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "# The lesson “Velocity”, Deutsch:"
    texts, labels = re.findall(r"(\d+) of (\d+)", lines[1])
    assert texts[0] == texts[1] != "0"
    assert labels[0] == labels[1] != "0"
    assert len(lines) == 2


def test_the_page_shows_a_valid_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"```toml\n# (velocity\.de\.toml\n.*?)```", PAGE, re.DOTALL)
    name, _, text = block.partition("\n")
    (tmp_path / name).write_text(text, encoding="utf-8")
    code, out, err = check(tmp_path / name, capsys)
    assert (code, err) == (0, "")
    # What is printed fills the rest of the file.
    rest = tomllib.loads(out)
    assert rest["steps"]["A column"]["A column"] == rest["controls"]["Frame"] == ""
    assert "Ellipsoid" not in rest["controls"]
    assert "title" not in rest
    filled = tomllib.loads(text)
    for place in (
        ("lesson",),
        ("check",),
        ("example",),
        ("controls",),
        *(("steps", name) for name in rest["steps"]),
    ):
        found, into = rest, filled
        for key in place:
            found, into = found[key], into.setdefault(key, {})
        into |= {original: original for original in found}
    (tmp_path / name).write_text(to_toml(filled), encoding="utf-8")
    code, out, err = check(tmp_path / name, capsys)
    assert (code, err, len(out.splitlines())) == (0, "", 2)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('value = "speed"', 'value = "speed/0"', "steps[0].question.value: got"),
        ('value = "speed"', 'value = "sqrt(-speed)"', "“Pioneer"),
        ('pose = "home"', 'pose = "away"', "steps[0].pose: got 'away', expected one of bent, home"),
        ('value = "from_axis"', 'value = "axis"', "mistakes[0].value: got 'axis', expected a name from [facts]"),
        ('kind = "number"', 'kind = "numbers"', "steps[0].question.kind: got 'numbers', expected one of"),
        (
            'value = "speed"',
            'value = "speed"\nwithout = ["sine"]',
            "question.without[0]: got 'sine', expected one of",
        ),
        ('arms = ["pioneer5"', 'arms = ["nobody"', "arms: got 'nobody', expected ids of arms: "),
        ('arms = ["pioneer5"', 'arms = ["so101"', "arms: got 'so101', expected arms of the lesson: pioneer5"),
    ],
)
def test_own_questions_are_asked_about_every_arm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str
) -> None:
    own = lesson_files()["velocity"].read_text(encoding="utf-8")
    assert old in own
    (tmp_path / "velocity.toml").write_text(own.replace(old, new, 1), encoding="utf-8")
    code, _, err = check(tmp_path / "velocity.toml", capsys)
    assert code != 0
    assert message in err


@pytest.mark.parametrize(
    ("before", "more", "message"),
    [
        ("[[example.steps]]", 'nothing = "1/(q1 - q1)"\n', "about the arm “Pioneer"),
        (
            '[[steps]]\nwhen = "planar"\n',
            '[steps.question]\nkind = "choice"\nprompt = "?"\n'
            'options = [{text = "A", right = true, reason = "Yes."}, {text = "B", reason = "No."}]\n',
            "steps[2].question: got 'The triangle and the cosine rule', expected no question of its own",
        ),
        ('title = "Fewer solutions"\n', 'when = "five"\n', "steps[10].when leaves out"),
    ],
)
def test_what_the_page_cannot_show_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], before: str, more: str, message: str
) -> None:
    own = lesson_files()["inverse"].read_text(encoding="utf-8")
    assert before in own
    (tmp_path / "inverse.toml").write_text(own.replace(before, more + before, 1), encoding="utf-8")
    code, _, err = check(tmp_path / "inverse.toml", capsys)
    assert code != 0
    assert message in err


def test_words_for_what_is_no_label_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "velocity.de.toml").write_text('[controls]\n"Elipsoid" = "x"\n"Along x of the base" = "y"')
    code, _, err = check(tmp_path / "velocity.de.toml", capsys)
    assert code != 0
    assert "controls: got 'Elipsoid', expected a label of the lesson's controls, such as Ellipsoid" in err
