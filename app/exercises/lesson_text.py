"""The texts of a lesson: goal, steps and check in a TOML file beside its code.

The texts and expressions use facts that the lesson computes for an arm: the attributes of a class in ``lesson.py``
beside the file (`facts_of`), or names that the file declares, each with a sentence on what it is. `kinboard check`
reads the file without running the lesson. Questions are those of exercises, with the same fields::

    goal = "You can …"
    arms = ["pioneer5", "puma560"]

    [facts]
    speed = "of the tool point while joint 1 moves by itself, m/s"
    "turns(joint)" = "whether a joint turns"

    [[steps]]
    title = "A column"
    text = "Column i of the Jacobian …"
    pose = "home"
    end = "moved"
    figure = "speeds"
    drawn = { pose = "moved", joint = 1 }
    arms = ["ur5"]

    [steps.estimate]
    kind = "choice"
    …

    [steps.question]
    kind = "number"
    prompt = "How fast is the tool point?"
    value = "speed"
    withheld = ["jacobian"]

Poses and figures are the lesson's own. The scene shows `end` with the right answer; `drawn` is a pose that shows
a wrong one, with the answer as the value of a joint. Of lengths, it is two points: a bar as long as the answer
leads from one towards the other, as in ``{ from = "tool", to = "target" }``; with `scale`, so many times as
long. Or it is a ``shape`` of the lesson's own, such as an ellipsoid, which is drawn with the answer in its place.
The options of a choice are drawn as what its `leads` name: directions, poses of the arm, ways and frames of the
lesson's own. `answered` is a figure of the last answer. What is `withheld` is nowhere to be seen before. An
`estimate` is asked before the question: it is a choice that looking answers.

The questions are about one of the `arms` of the library that the file names; a step about an idea that these do
not show names its own.

An `example` is worked on an arm of its own: :mod:`app.exercises.worked`.

Texts may be lists of alternatives with `when`, and so may questions. Steps and questions of the check with `when`
are left out where it does not hold.

A file of the operator's is such a file, in place of the lesson's own, or it has other words for some of its texts:
the texts by the titles of the steps (`translated`). Labels of the lesson's controls are by those of the code::

    title = "Geschwindigkeit"

    [steps."A column"]
    "A column" = "Eine Spalte"

    [check]
    "They slow down" = "Sie werden langsamer"

    [controls]
    "Ellipsoid" = "Ellipsoid"
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import kin
from app.exercises.contract import Kind
from app.exercises.expressions import Expression
from app.exercises.fields import ExerciseFileError, Fields, Words, text_of, toml_of
from app.exercises.kinds import KINDS
from app.exercises.kinds.choice import ChoiceKind
from app.exercises.lessons import ENGLISH, LANGUAGES, LESSONS
from app.exercises.variant import Facts
from app.exercises.worked import WorkedText, read_worked
from kin.errors import shorten

_FACT = re.compile(r"([a-z][a-z0-9_]*)(?:\([a-z0-9_, ]+\))?")
MOST_JOINTS = 12
POINTS = ("tool", "end", "target")  # of the tool at the pose of a step, or at its end, and the step's target
NO_PREVIEW = "nowhere"
FACTS, DRAWN = "AskedFacts", ("poses", "leads")  # the class that lessons derive from, and what is no fact of it
NO_FACTS: Mapping[str, str] = MappingProxyType({})
_NONE = ""  # the name of no pose and of no figure

# Fields of a lesson whose texts students read. Other texts are names, numbers and expressions.
SAID = frozenset(
    (
        "labels",
        "larger",
        "method",
        "name",
        "practice",
        "prompt",
        "reason",
        "shown",
        "text",
        "then",
        "title",
        "wrong",
    )
)
_WORD = re.compile(r"[^\W\d_₀-₉]{2}")
_BRACES = re.compile(r"\{[^{}]*\}")

Place = tuple[str, ...]  # of a text: ("lesson",), ("steps", title), ("check",) or ("example",)


@dataclass(frozen=True)
class QuestionText:
    """A question: when it is asked, its prompt, its kind with its fields, and the facts that it withholds.

    Attributes:
        at: where in the file, for messages.
        leads: of a choice, names of where its options lead, in the order of the file; `NO_PREVIEW` for those that
            do not. Empty: it is not drawn.
    """

    when: Expression
    prompt: Words
    kind: Kind
    withheld: frozenset[str]
    leads: tuple[str, ...] = ()
    at: str = ""


@dataclass(frozen=True)
class BarText:
    """How lengths are drawn: from a point in the direction of another, each one of `POINTS` or its coordinates.

    Attributes:
        scale: how long 1 m, or 1 m/s, is in the scene, m.
    """

    start: str | tuple[Expression, ...]
    end: str | tuple[Expression, ...]
    scale: Expression


@dataclass(frozen=True)
class StepText:
    """A step, as in `app.viewer.lessons.guide.outline.Step`; `pose`, `end` and `figure` are names of the lesson's.

    Attributes:
        questions: alternatives, of which the first whose condition holds is asked; there may be none.
        estimate: what is asked before, as `questions`.
        drawn: how an answer is drawn: a joint value as the pose that has it, with the number of the joint; a
            length as a bar; or the shape of this name.
        arms: ids of the arms that it is asked about; empty: those of the lesson.
        answered: the name of a figure of the answer.
        at: where in the file, for messages.
    """

    when: Expression
    title: Words
    text: Words
    estimate: tuple[QuestionText, ...]
    questions: tuple[QuestionText, ...]
    shown: Words
    practice: Words
    pose: str
    end: str
    figure: str
    drawn: tuple[str, int] | BarText | str | None
    arms: tuple[str, ...]
    answered: str = _NONE
    at: str = ""


@dataclass(frozen=True)
class Translation:
    """What has become of other words for a lesson.

    Attributes:
        language: one of `LANGUAGES`.
        said: what is said in place of each text, by place; "": nothing yet.
        stray: the refusal of the first words for what the lesson does not have: it may have had it in an earlier
            version. None: there are none.
    """

    language: str
    said: Mapping[Place, Mapping[str, str]]
    stray: ExerciseFileError | None = None

    @property
    def missing(self) -> dict[Place, list[str]]:
        """The texts of which nothing is said yet, by place."""
        found = {place: [text for text, said in texts.items() if not said] for place, texts in self.said.items()}
        return {place: texts for place, texts in found.items() if texts}


@dataclass(frozen=True, eq=False)
class LessonText:
    """A lesson's file.

    Attributes:
        file: where it was read, for messages.
        arms: ids of the arms of the library that it asks about, the usual one first.
        facts: what each fact is, by its name.
        words: names for texts that depend on facts.
        check: each question as alternatives.
        example: what is shown before anything is asked.
        data: what the file holds.
        controls: words for the labels of its controls.
        title, about: in place of those of the lesson's code, if they are given.
        translation: of a text in other words.
    """

    file: str
    goal: Words
    arms: tuple[str, ...]
    facts: Mapping[str, str]
    words: Mapping[str, Words]
    steps: tuple[StepText, ...]
    check: tuple[tuple[QuestionText, ...], ...]
    example: WorkedText
    data: Mapping[str, Any]
    controls: Mapping[str, str]
    title: str = ""
    about: str = ""
    translation: Translation | None = None

    @property
    def every_arm(self) -> tuple[str, ...]:
        """The ids of all arms that it asks about."""
        return tuple(dict.fromkeys([*self.arms, *(arm for step in self.steps for arm in step.arms)]))

    @property
    def poses(self) -> frozenset[str]:
        """The names of all poses."""
        drawn = [step.drawn[0] for step in self.steps if isinstance(step.drawn, tuple)]
        return frozenset(name for step in self.steps for name in (step.pose, step.end) if name) | {*drawn}


class _Fields(Fields):
    declared = "[facts] or [words]"


def parse_lesson(text: str, file: str = "lesson", facts: Mapping[str, str] = NO_FACTS) -> LessonText:
    """The texts of a lesson in TOML.

    Args:
        facts: those that its code has, as `facts_of` finds them; the file may declare more.

    Raises:
        ExerciseFileError: naming the file, the field, the value and what would be valid.
    """
    data = toml_of(text, file)
    return _lesson(data, file, {**facts, **_facts(Fields(file, data.get("facts", {}), "facts."))})


def _lesson(data: Mapping[str, Any], file: str, facts: Mapping[str, str]) -> LessonText:
    found: list[Expression] = []
    aliases = _Fields(file, data.get("words", {}), "words.", frozenset(facts), found)
    words = {name: aliases.words(name) for name in aliases.table}
    fields = _Fields(file, data, names=frozenset((*facts, *words)), found=found)
    fields.get("facts"), fields.get("words")
    steps = tuple(_step(item) for item in fields.tables("steps", 1))
    check = tuple(_alternatives(item) for item in fields.tables("check", 1))
    example = read_worked(fields.sub("example"))
    title, about, arms = fields.text("title", ""), fields.text("about", ""), _arms(fields, 1)
    lesson = LessonText(
        *(file, fields.words("goal"), arms, facts, words, steps, check, example),
        *(data, _controls(fields), title, about),
    )
    fields.done()
    known = frozenset(facts) | frozenset(Facts(one := kin.get_robot("ur5"), one.q_home))
    for expression in found:
        if unknown := sorted(expression.names - known):
            valid = f"a name from [facts], or of the arm: {', '.join(sorted(known))}"
            raise ExerciseFileError(file, expression.field, unknown[0], valid)
    return lesson


def load_lesson(path: Path | str) -> LessonText:
    """The texts of a file; raises `ExerciseFileError`."""
    return parse_lesson(text_of(path), str(path), facts_of(Path(path).with_name("lesson.py")))


def facts_of(module: Path) -> dict[str, str]:
    """The facts that a lesson's code has, with their docstrings: public attributes of its `AskedFacts`."""
    if not module.exists():
        return {}
    return {
        one.name: ast.get_docstring(one) or ""
        for each in ast.parse(module.read_text(encoding="utf-8")).body
        if isinstance(each, ast.ClassDef) and any(getattr(base, "id", "") == FACTS for base in each.bases)
        for one in each.body
        if isinstance(one, ast.FunctionDef) and not one.name.startswith("_") and one.name not in DRAWN
    }


@cache
def lesson_files() -> dict[str, Path]:
    """The files of the lessons that have one, by key."""
    folder = Path(__file__).parents[1] / "viewer" / "lessons"
    return {key: path for key in LESSONS if (path := folder / key / "lesson.toml").exists()}


@cache
def texts_of(lesson: str) -> LessonText:
    """The texts of a lesson of ours."""
    return load_lesson(lesson_files()[lesson])


def named(path: Path) -> tuple[str, str]:
    """The lesson and the language of a file of the operator's, by its name: velocity.toml, velocity.de.toml.

    Raises:
        ExerciseFileError: it is not named like that.
    """
    lesson, *more = path.name.removesuffix(".toml").split(".")
    if lesson not in LESSONS:
        valid = f"a lesson, as in velocity.toml or velocity.de.toml: {', '.join(LESSONS)}"
        raise ExerciseFileError(str(path), "name of the file", lesson, valid)
    if len(more) > 1 or more == [ENGLISH] or not LANGUAGES.keys() >= {*more}:
        others = ", ".join(code for code in LANGUAGES if code != ENGLISH)
        valid = f"the code of a language, {others}; or none, for English words"
        raise ExerciseFileError(str(path), "name of the file", ".".join(more), valid)
    return lesson, (*more, ENGLISH)[0]


def load_words(path: Path, base: LessonText, language: str = ENGLISH) -> LessonText:
    """The texts of a lesson in a file of the operator's: questions of its own, or `base` in other words.

    Raises:
        ExerciseFileError: naming the file, the field, the value and what would be valid.
    """
    file = str(path)
    data = toml_of(text_of(path), file)
    if not isinstance(data.get("steps"), list):
        return _translated(data, file, base, language)
    declared = Fields(file, data.get("facts", {}), "facts.")
    if unknown := sorted(_facts(declared).keys() - base.facts.keys()):
        raise declared.refuse(unknown[0], unknown[0], f"a fact of the lesson: {', '.join(sorted(base.facts))}")
    lesson, known = _lesson(data, file, base.facts), base.every_arm
    if others := [arm for arm in lesson.every_arm if arm not in known]:
        raise ExerciseFileError(file, "arms", others[0], f"arms of the lesson: {', '.join(known)}")
    return replace(lesson, translation=Translation(language, {}))


class _Said(_Fields):
    """A table of texts of a lesson, and what is said in their place; nothing yet where that is empty."""

    def refuse(self, field: str, value: object, expected: str) -> ExerciseFileError:
        return super().refuse(shorten(field, 60), value, expected)

    def said(self, original: str) -> str:
        """What is said in place of a text; "": nothing."""
        return self.text(original) if self.get(original) not in (None, "") else ""

    def stray(self) -> ExerciseFileError | None:
        """The refusal of the first text that the lesson does not have here."""
        known = self._read
        original = next((one for one in self.table if one not in known), None)
        if original is None:
            return None
        near = get_close_matches(original, known, 1)
        hint = f", such as {shorten(near[0], 200)}" if near else ""
        return self.refuse(original, self.table[original], f"a text that the lesson has here{hint}")


def _translated(data: dict[str, Any], file: str, base: LessonText, language: str) -> LessonText:
    """`base` with the words of a file in place of its own."""
    fields = _Said(file, data)
    names, computed = frozenset((*base.facts, *base.words)), frozenset(base.example.quantities)

    def table(*place: str, parent: Fields = fields) -> _Said:
        given = parent.get(place[-1])
        own = computed if place == ("example",) else names
        return _Said(file, {} if given is None else given, f"{parent.prefix}{place[-1]}.", own)

    steps, titles = fields.sub("steps"), [_title(step) for step in base.data["steps"]]
    tables: dict[Place, _Said] = {(name,): table(name) for name in ("lesson", "check", "example")}
    tables |= {("steps", title): table("steps", title, parent=steps) for title in titles}
    texts: dict[Place, dict[str, str]] = {}

    def say(place: Place, original: str) -> str:
        said = tables[place].said(original)
        if has_words(original):
            texts.setdefault(place, {})[original] = said
        return said or original

    title, about, controls = fields.said("title"), fields.said("about"), _controls(fields)
    fields.done()
    lesson = _lesson(_in_words(base.data, say), file, base.facts)
    valid = "the title of a step: " + ", ".join(titles)
    unknown = next((steps.refuse(one, one, valid) for one in steps.table if one not in titles), None)
    strays = (stray for each in tables.values() if (stray := each.stray()) is not None)
    return replace(
        lesson,
        title=title or base.title,
        about=about or base.about,
        controls={**base.controls, **controls},
        translation=Translation(language, texts, unknown or next(strays, None)),
    )


def in_language(base: LessonText, language: str) -> LessonText:
    """A lesson in a language in which it has no words yet."""
    return _translated({}, base.file, base, language)


def has_words(text: str) -> bool:
    """Whether there is something to translate in a text: not only symbols and names in braces."""
    return _WORD.search(_BRACES.sub("", text)) is not None


def _in_words(data: Mapping[str, Any], say: Callable[[Place, str], str]) -> dict[str, Any]:
    """The data of a lesson with what `say` makes of each text, by its place."""
    general = partial(say, ("lesson",))
    return {
        **data,
        "goal": _spoken(data["goal"], general, "text"),
        "words": {name: _spoken(each, general, "text") for name, each in data.get("words", {}).items()},
        "steps": [_spoken(step, partial(say, ("steps", _title(step)))) for step in data["steps"]],
        **{name: _spoken(data[name], partial(say, (name,))) for name in ("check", "example")},
    }


def _spoken(node: Any, say: Callable[[str], str], field: str = "") -> Any:
    """A value of a field with what `say` makes of the texts in it."""
    if isinstance(node, dict):
        return {name: _spoken(each, say, name) for name, each in node.items()}
    if isinstance(node, list):
        return [_spoken(each, say, field) for each in node]
    return say(node) if isinstance(node, str) and field in SAID else node


def _title(step: Mapping[str, Any]) -> str:
    """The title of a step; of alternatives, the last one."""
    title = step["title"]
    return str(title if isinstance(title, str) else title[-1])


def _controls(fields: Fields) -> dict[str, str]:
    """Words for labels of controls."""
    given = fields.get("controls")
    table = _Said(fields.file, {} if given is None else given, "controls.")
    return {label: said for label in table.table if (said := table.said(label))}


def _facts(fields: Fields) -> dict[str, str]:
    found = {}
    for name, about in fields.table.items():
        match = _FACT.fullmatch(name)
        if match is None or not isinstance(about, str) or not about.strip():
            raise fields.refuse(name, about, 'a name such as speed or "turns(joint)", and what it is')
        found[match[1]] = about
    return found


def _step(fields: Fields) -> StepText:
    step = StepText(
        fields.expression("when", "1"),
        fields.words("title"),
        fields.words("text"),
        _asked(fields, "estimate"),
        _asked(fields, "question"),
        fields.words("shown", ""),
        fields.words("practice", ""),
        fields.text("pose", _NONE),
        fields.text("end", _NONE),
        fields.text("figure", _NONE),
        _drawn(fields.sub("drawn")) if fields.has("drawn") else None,
        _arms(fields),
        fields.text("answered", _NONE),
        fields.prefix,
    )
    fields.done()
    return step


def _asked(fields: Fields, name: str) -> tuple[QuestionText, ...]:
    """A question, or alternatives of it; none if there is none."""
    question = fields.get(name)
    if isinstance(question, list):
        return tuple(_question(item) for item in fields.tables(name, 1))
    return () if question is None else (_question(fields.sub(name)),)


def _drawn(fields: Fields) -> tuple[str, int] | BarText | str:
    if fields.has("from"):
        bar = BarText(_point(fields, "from"), _point(fields, "to"), fields.expression("scale", "1"))
        fields.done()
        return bar
    if fields.has("shape"):
        name = fields.text("shape")
        fields.done()
        return name
    found = fields.text("pose"), fields.whole("joint", 1, MOST_JOINTS)
    fields.done()
    return found


def _point(fields: Fields, name: str) -> str | tuple[Expression, ...]:
    if isinstance(fields.get(name), str):
        return fields.choice(name, POINTS)
    at = fields.expressions(name, 3)
    if len(at) != 3:
        raise fields.refuse(name, fields.get(name), f"x, y and z, or one of {', '.join(POINTS)}")
    return at


def _arms(fields: Fields, least: int = 0) -> tuple[str, ...]:
    """Ids of arms of the library."""
    found, known = fields.texts("arms", least), kin.builtin_robots()
    if unknown := [arm for arm in found if arm not in known]:
        raise fields.refuse("arms", unknown[0], "ids of arms: " + ", ".join(known))
    return found


def _alternatives(fields: Fields) -> tuple[QuestionText, ...]:
    """One question of the check, or ``either``: alternatives of which one is asked."""
    if fields.has("either"):
        found = tuple(_question(item) for item in fields.tables("either", 1))
        fields.done()
        return found
    return (_question(fields),)


def _question(fields: Fields) -> QuestionText:
    kind = KINDS[fields.choice("kind", KINDS)]
    prompt, when = fields.words("prompt"), fields.expression("when", "1")
    withheld = frozenset(fields.texts("withheld"))
    read = kind.read(fields)
    question = QuestionText(when, prompt, read, withheld, _leads(fields, read), fields.prefix)
    fields.done()
    return question


def _leads(fields: Fields, kind: Kind) -> tuple[str, ...]:
    """Where the options of a choice lead."""
    if not fields.has("leads"):
        return ()
    leads = fields.texts("leads")
    if not isinstance(kind, ChoiceKind) or kind.shuffle or len(leads) != len(kind.options):
        raise fields.refuse("leads", list(leads), "a name for each option of a choice that is not shuffled")
    return leads
