"""``kinboard check`` for the texts of lessons: ours, and files that replace or translate them."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from app.cli.terminal import print_json, table
from app.exercises.lesson_text import LessonText, Translation, load_lesson, load_words, named, texts_of
from app.exercises.lessons import ENGLISH, LANGUAGES, LESSONS
from app.viewer.lessons import LESSONS as CODE
from app.viewer.lessons.guide.labels import Labels
from app.viewer.lessons.guide.lesson import Lesson
from kin import get_robot
from kin.parsing import to_toml

OURS = "lesson.toml"


def check_lesson(path: Path, as_json: bool) -> int:
    """Validate the texts of a lesson, ask everything about each of its arms, and say what is in them."""
    ours = path.name == OURS
    key = path.resolve().parent.name if ours else named(path)[0]
    text = load_lesson(path) if ours else _words(path)
    if key not in LESSONS:
        return _describe(text, as_json)
    lesson = next(one for one in CODE if one.key == key)
    lesson.verify(text)
    labels = Labels.of(lesson)
    labels.check(text)
    if text.translation is None or not text.translation.said:
        return _describe(text, as_json)
    if text.translation.stray is not None:
        raise text.translation.stray
    return _report(lesson, text, text.translation, labels, as_json)


def _words(path: Path) -> LessonText:
    """The texts of a file of the operator's; it translates the one beside it that replaces ours, if any."""
    key, language = named(path)
    original, replaced = texts_of(key), path.with_name(f"{key}.toml")
    if language != ENGLISH and replaced.exists():
        original = load_words(replaced, original)
    return load_words(path, original, language)


def _describe(text: LessonText, as_json: bool) -> int:
    """Say which steps, questions and facts there are."""
    questions = [*(step.questions for step in text.steps if step.questions), *text.check]
    kinds = Counter(alternatives[0].kind.name for alternatives in questions)
    if as_json:
        found = {"steps": len(text.steps), "check": len(text.check), "kinds": kinds, "facts": text.facts}
        return print_json({**found, "poses": sorted(text.poses)})
    print(f"{len(text.steps)} steps, and {len(text.check)} questions in the check.")
    print(f"Questions: {', '.join(f'{count} × {name}' for name, count in sorted(kinds.items()))}.")
    print(f"Asked about: {', '.join(get_robot(arm).name for arm in text.every_arm)}.\n")
    print(table(["fact", "what it is"], [[name, about] for name, about in sorted(text.facts.items())]))
    return 0


def _report(
    lesson: type[Lesson], text: LessonText, translation: Translation, labels: Labels, as_json: bool
) -> int:
    """Say what is translated, and print a file with room for the rest: what is not TOML is a comment."""
    rest = _rest(text, translation, labels)
    missing = sum(map(len, translation.missing.values()))
    texts = sum(map(len, translation.said.values()))
    named_controls = len(labels.shown) - len(rest.get("controls", ()))
    if as_json:
        return print_json({"lesson": lesson.key, "language": translation.language, "texts": texts, "rest": rest})
    print(f"# The lesson “{lesson.title}”, {LANGUAGES[translation.language]}:")
    print(f"# {texts - missing} of {texts} texts, {named_controls} of {len(labels.shown)} labels of controls.")
    if rest:
        print(f"# The rest, to be filled in and put into the file:\n\n{to_toml(rest)}", end="")
    return 0


def _rest(text: LessonText, translation: Translation, labels: Labels) -> dict[str, Any]:
    """The fields of a file that are still empty."""
    rest: dict[str, Any] = {name: "" for name in ("title", "about") if not getattr(text, name)}
    for place, texts in translation.missing.items():
        inner = rest
        for name in place:
            inner = inner.setdefault(name, {})
        inner.update(dict.fromkeys(texts, ""))
    if open_ := [label for label in labels.shown if label not in text.controls]:
        rest["controls"] = dict.fromkeys(open_, "")
    return rest
