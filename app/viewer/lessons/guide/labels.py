"""The labels of a lesson's controls, as its code has them: for which files may have other words."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from app.exercises import ExerciseFileError
from app.exercises.lesson_text import LessonText, has_words
from app.viewer.declared.fields import Choice, Part, Settings, Vector
from app.viewer.lessons.guide.lesson import Lesson

NODES = frozenset(("Folder", "Button", "Buttons"))  # of `app.viewer.declared.panel`, whose labels are in the code


@dataclass(frozen=True)
class Labels:
    """See the module.

    Attributes:
        shown: the labels in words.
        known: these, and every other text of the code, such as hints.
        made: patterns of texts that the code makes.
    """

    shown: tuple[str, ...]
    known: frozenset[str]
    made: tuple[re.Pattern[str], ...]

    @classmethod
    def of(cls, lesson: type[Lesson]) -> Labels:
        """Those of a lesson."""
        modules = sorted(Path(inspect.getfile(lesson)).parent.glob("*.py"))
        nodes = [node for path in modules for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
        written = [text for node in nodes if isinstance(node, ast.Call) for text in _labels(node)]
        settings = getattr(lesson, "settings_of", None)
        declared = [] if settings is None else [*_declared(settings)]
        shown = tuple(dict.fromkeys(text for text in (*declared, *written) if has_words(text)))
        texts = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        made = (_pattern(node) for node in nodes if isinstance(node, ast.JoinedStr))
        return cls(shown, frozenset(texts) | {*shown}, tuple(each for each in made if has_words(each.pattern)))

    def check(self, text: LessonText) -> None:
        """Raise `ExerciseFileError` for words for what is no label."""
        for label in text.controls:
            if label not in self.known and not any(pattern.fullmatch(label) for pattern in self.made):
                near = get_close_matches(label, self.shown, 1)
                hint = f", such as {near[0]}" if near else ""
                raise ExerciseFileError(text.file, "controls", label, f"a label of the lesson's controls{hint}")


def _labels(call: ast.Call) -> Iterator[str]:
    """The labels in a call that makes a node of the panel."""
    if getattr(call.func, "id", "") in NODES:
        events = [key for each in call.args[1:2] if isinstance(each, ast.Dict) for key in each.keys]
        for each in (*call.args[:1], *events):
            if isinstance(each, ast.Constant) and isinstance(each.value, str):
                yield each.value


def _declared(settings: type[Settings]) -> Iterator[str]:
    """The labels of settings, and of the options of their lists."""
    for _, spec in settings.specs():
        if isinstance(spec, Part):
            yield from _declared(spec.of)
        yield from spec.labels if isinstance(spec, Vector) else (spec.label,)
        if isinstance(spec, Choice) and not callable(spec.options):
            yield from spec.options


def _pattern(text: ast.JoinedStr) -> re.Pattern[str]:
    parts = (re.escape(str(part.value)) if isinstance(part, ast.Constant) else ".+" for part in text.values)
    return re.compile("".join(parts))
