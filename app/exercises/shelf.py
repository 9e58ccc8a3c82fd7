"""The exercises that a service offers, and those that one page has besides; the texts of its lessons.

The operator's folders may grow while the service runs: pages save exercises in one, and the operator copies files
into them. Each process looks at a folder again when it is asked for what is in it, and when it does not know an
id, and reads the files that have changed. It keeps what it has read: a folder that goes away takes nothing from a
class.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
import threading
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from app.exercises import form
from app.exercises.exercise import TOPICS, Exercise
from app.exercises.fields import ExerciseFileError
from app.exercises.files import Find, builtin_exercises, load_exercise, load_folder, parse_exercise
from app.exercises.lesson_text import LessonText, in_language, lesson_files, load_words, named, texts_of
from app.exercises.lessons import ENGLISH, LANGUAGES
from kin import InputError, get_robot
from kin.parsing import has_comments

EVERY = 1.0  # s between two looks at a folder
STALE = 60.0  # s after which a file that was being written was left behind by a process that has ended
MOST_FILES = 500  # in the folder: with more, pages save no further ones
_DEVICE = re.compile(r"con|prn|aux|nul|(com|lpt)[0-9]")  # Windows takes a file of this name for a device

log = logging.getLogger("kinboard.exercises")
_reading = threading.RLock()  # of the folders


class _Stamp(NamedTuple):
    """Another one: the file has changed."""

    time: int
    size: int
    file: int


class _Folder:
    """The TOML files of a folder, of which it is known when each was changed.

    Raises:
        ExerciseFileError: the folder cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.stamps = _stamps(path)
        except OSError as error:
            raise ExerciseFileError(str(path), "folder", error.strerror, "a folder that can be read") from None
        self._looked = time.monotonic()

    @property
    def is_due(self) -> bool:
        """Whether the last look was some time ago."""
        return time.monotonic() - self._looked >= EVERY

    def changed(self) -> list[str]:
        """The names of files that are new, or have changed since the last look."""
        self._looked = time.monotonic()
        before, self.stamps = self.stamps, dict[str, _Stamp]()
        try:
            self.stamps = _stamps(self.path)
        except OSError as error:
            if before:
                log.warning("%s: what was read of it stays: %s", self.path, error.strerror)
        return sorted(name for name, stamp in self.stamps.items() if before.get(name) != stamp)


class Exercises:
    """The built-in exercises, and those of the operator's folder. Thread-safe.

    Attributes:
        folder: None: there is none.

    Raises:
        ExerciseFileError: a file of the folder is invalid, or its id is taken.
    """

    def __init__(self, folder: Path | None = None, find: Find = get_robot) -> None:
        self.folder, self._find = folder, find
        self._files = None if folder is None else _Folder(folder)
        own = () if folder is None else load_folder(folder, find)
        self._builtin = {exercise.id: exercise for exercise in builtin_exercises()}
        for exercise in own:
            if exercise.id in self._builtin:
                raise ExerciseFileError(exercise.file, "id", exercise.id, "an id that no built-in exercise has")
        self._set({exercise.id: exercise for exercise in own})

    @property
    def all(self) -> tuple[Exercise, ...]:
        """In the order of the list."""
        if self._files is not None and self._files.is_due:
            self._look()
        return self._all

    def get(self, exercise_id: object) -> Exercise | None:
        """One exercise; None if there is none with this id."""
        if not isinstance(exercise_id, str):
            return None
        if exercise_id not in self._by_id:
            self._look()
        return self._by_id.get(exercise_id)

    def topics(self) -> tuple[tuple[str, tuple[Exercise, ...]], ...]:
        """The topics that have exercises, with these."""
        known = self.all
        found = ((topic, tuple(one for one in known if one.topic == topic)) for topic in TOPICS)
        return tuple((topic, exercises) for topic, exercises in found if exercises)

    @property
    def obstacle(self) -> str:
        """Why nothing can be saved in the folder, as a sentence; empty: it can."""
        if self.folder is None:
            return "This service has no folder for exercises: set KINBOARD_EXERCISES."
        if not self.folder.is_dir():
            return "The folder of this service for exercises is gone."
        if not os.access(self.folder, os.W_OK | os.X_OK):
            return "The folder of this service for exercises cannot be written."
        return ""

    def save(self, text: str, before: str = "") -> Exercise:
        """Write an exercise into the folder, for all pages of all processes.

        Args:
            text: of the file, whose exercise can be solved.
            before: `digest` of the file with this id, which it replaces; empty: there is none.

        Raises:
            ExerciseFileError: the text is no exercise.
            InputError: the folder cannot be written or is full, or the id is another exercise's by now.
        """
        exercise = parse_exercise(text, "exercise", self._find)
        name = exercise.id
        if self.folder is None or self.obstacle:
            raise InputError("folder", "KINBOARD_EXERCISES", f"a folder that can be written. {self.obstacle}")
        if _DEVICE.fullmatch(name):
            raise InputError("id", name, "a name that every system accepts for a file")
        part = self.folder / f".{name}.saving"
        try:
            self._reserve(part, name)
            try:
                path = self._place(name, before)
                with part.open("wb") as file:
                    file.write(text.encode())
                    file.flush()
                    os.fsync(file.fileno())
                part.replace(path)
            finally:
                part.unlink(missing_ok=True)
        except OSError as error:
            raise InputError("folder", error.strerror, "a folder that can be written and has room") from None
        self._look()
        return self._by_id[name]

    def _reserve(self, part: Path, name: str) -> None:
        """Create the file that is written first: of all who save this id, one at a time has it."""
        for last in (False, True):
            try:
                part.open("xb").close()
                return
            except FileExistsError:
                if last or time.time() - part.stat().st_mtime < STALE:
                    raise InputError("id", name, "an id under which nobody else saves now: try again") from None
                part.unlink(missing_ok=True)

    def _place(self, name: str, before: str) -> Path:
        """The file that an exercise with this id goes into; raises `InputError` if it is another one's."""
        self._look()
        assert self.folder is not None
        known = self._by_id.get(name)
        if known is not None and (known.builtin or digest(known.source) != before):
            raise InputError("id", name, f"an id that no other exercise has: “{known.title}” has it")
        if known is not None:
            return Path(known.file)
        path = self.folder / f"{name}.toml"
        if os.path.lexists(path):
            raise InputError("id", name, "an id that no other exercise has: a file of the folder has this name")
        if self._files is not None and (count := len(self._files.stamps)) >= MOST_FILES:
            raise InputError("folder", f"{count} exercises", f"at most {MOST_FILES}")
        return path

    def _look(self) -> None:
        """Read what has changed in the folder. Files that are invalid are left out, with a line in the log."""
        if self._files is None:
            return
        with _reading:
            if not (changed := self._files.changed()):
                return
            own = dict(self._own)
            for name in changed:
                try:
                    one = load_exercise(self._files.path / name, self._find)
                    other = self._by_id.get(one.id) or own.get(one.id)
                    if other is not None and Path(other.file).name != name and Path(other.file).exists():
                        raise ExerciseFileError(one.file, "id", one.id, "an id that no other exercise has")
                except ExerciseFileError as error:
                    log.warning("an exercise is left out: %s", error, extra={"kind": name})  # each file is logged
                else:
                    own[one.id] = one
            self._set(own)

    def _set(self, own: dict[str, Exercise]) -> None:
        self._own = own
        self._by_id = {**self._builtin, **own}
        self._all = tuple(sorted(self._by_id.values(), key=lambda one: one.rank))


class Shelf(Exercises):
    """Those of a service, and those that one page has besides. Not thread-safe: the page's worker changes it."""

    def __init__(self, known: Exercises) -> None:
        self._known = known
        self.put(())

    def put(self, own: Iterable[Exercise], weak: Iterable[Exercise] = ()) -> None:
        """Have these besides, instead of those before.

        Args:
            own: they take the place of those of the operator's folder with the same id, but not of built-in ones.
            weak: they take nobody's place.
        """
        self._strong = {one.id: one for one in own if not self._is_builtin(one.id)}
        self._weak = {one.id: one for one in weak}
        self._seen: tuple[Exercise, ...] = ()

    @property
    def all(self) -> tuple[Exercise, ...]:
        known = self._known.all
        if known is not self._seen:
            both = {**self._weak, **{one.id: one for one in known}, **self._strong}
            self._seen, self._both = known, tuple(sorted(both.values(), key=lambda one: one.rank))
        return self._both

    def get(self, exercise_id: object) -> Exercise | None:
        if not isinstance(exercise_id, str):
            return None
        mine = self._strong.get(exercise_id)
        return mine or self._known.get(exercise_id) or self._weak.get(exercise_id)

    def is_own(self, exercise_id: str) -> bool:
        """Whether it is one that the page has besides."""
        one = self.get(exercise_id)
        return one is not None and one is not self._known.get(exercise_id)

    def _is_builtin(self, exercise_id: str) -> bool:
        one = self._known.get(exercise_id)
        return one is not None and one.builtin


class Lessons:
    """The texts of the lessons: ours, and those of the operator's folder. Thread-safe.

    A file that is invalid is left out, with a line in the log, and so are words for what its lesson does not have.

    Attributes:
        language: of pages that have chosen none.

    Raises:
        ExerciseFileError: the folder cannot be read.
        InputError: there is nothing in this language.
    """

    def __init__(self, folder: Path | None = None, language: str = ENGLISH) -> None:
        self.language = language
        self._paths: dict[tuple[str, str], Path] = {}  # by lesson and language
        self._own: dict[tuple[str, str], LessonText] = {}
        self._bare: dict[tuple[str, str], LessonText] = {}  # without a file, in a language that others have
        self._files = None if folder is None else _Folder(folder)
        if self._files is not None:
            self._take([*self._files.stamps])
        if language not in self.languages:
            raise InputError("KINBOARD_LANGUAGE", language, f"one of {', '.join(self.languages)}")

    @property
    def languages(self) -> Mapping[str, str]:
        """The names of the languages that there are, by their codes."""
        known = {ENGLISH, *(language for _, language in self._paths)}
        return {code: name for code, name in LANGUAGES.items() if code in known}

    def spoken(self, language: str) -> str:
        """The language that a page shows which has chosen this one, or none: ""."""
        return language if language in self.languages else self.language

    def own(self, lesson: str, language: str = "") -> LessonText | None:
        """The texts of a lesson in a file of the operator's; None: it has none in this language."""
        if self._files is not None and self._files.is_due:
            with _reading:
                self._take(self._files.changed())
        return self._own.get((lesson, self.spoken(language)))

    def text(self, lesson: str, language: str = "") -> LessonText | None:
        """The texts of a lesson, as far as they are translated; None of a lesson without a file."""
        if (own := self.own(lesson, language)) is not None or lesson not in lesson_files():
            return own
        key = lesson, self.spoken(language)
        if key[1] == ENGLISH:
            return texts_of(lesson)
        with _reading:  # another thread may read the original anew
            made = self._bare.get(key) or in_language(self._original(lesson), key[1])
            self._bare[key] = made
        return made

    def _original(self, lesson: str) -> LessonText:
        return self._own.get((lesson, ENGLISH)) or texts_of(lesson)

    def _take(self, names: Iterable[str]) -> None:
        """Read files, and with them all others of their lessons: translations are those of the original."""
        changed = set[str]()
        for name in names:
            assert self._files is not None
            path = self._files.path / name
            try:
                key = named(path)
            except ExerciseFileError as error:
                log.warning("a file is no lesson: %s", error)
            else:
                self._paths = {**self._paths, key: path}  # another thread may go through those before
                changed.add(key[0])
        for key, path in sorted(self._paths.items(), key=lambda one: one[0][1] != ENGLISH):
            if key[0] in changed:
                self._read(key, path)

    def _read(self, key: tuple[str, str], path: Path) -> None:
        lesson, language = key
        self._bare = {other: text for other, text in self._bare.items() if other[0] != lesson}
        try:
            text = load_words(path, texts_of(lesson) if language == ENGLISH else self._original(lesson), language)
        except ExerciseFileError as error:
            log.warning("the words of a lesson are left out: %s", error, extra={"kind": path.name})
            return
        self._own[key] = text
        if text.translation is not None and (stray := text.translation.stray) is not None:
            log.warning("words are left out: %s", stray, extra={"kind": path.name})


def digest(text: str) -> str:
    """What stands for the text of a file, to see whether it is still the same."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def written_in_a_page(exercise: Exercise) -> bool:
    """Whether nothing of the exercise's file is lost when a page changes it, as comments would be."""
    return bool(form.read(exercise.source)) and not has_comments(exercise.source)


def _stamps(folder: Path) -> dict[str, _Stamp]:
    """The exercise files of a folder; raises `OSError`."""
    found = {}
    for path in folder.iterdir():
        if path.suffix == ".toml":
            try:
                facts = path.stat()
            except FileNotFoundError:
                continue  # removed in between, or a link to nothing
            found[path.name] = _Stamp(facts.st_mtime_ns, facts.st_size, facts.st_ino)
    return found
