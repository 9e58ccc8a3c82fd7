"""Writing an exercise in the page: its fields, what three students get, and the way to try and to save it.

The draft is the text of a file (`app.exercises.form` changes it, `app.exercises.trial` tries it), so that page,
file and ``kinboard check`` have one reader and the same messages.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import kin
from app.exercises import Exercise, ExerciseFileError, Exercises, Trial, Variant, builtin_exercises, tried
from app.exercises import form as forms
from app.exercises.files import MOST_BYTES, Find, parse_exercise
from app.exercises.kinds import KINDS
from app.exercises.shelf import digest, written_in_a_page
from app.viewer.activity.activity import AUTHOR, EXERCISES
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import OpenableFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.fields import text as text_field
from app.viewer.declared.panel import Html
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Node, axes, frame, label
from app.viewer.exercises import author_views as views
from app.viewer.exercises.drawing import SIZE
from app.viewer.feature import save_file, sent_text
from app.viewer.panel.status import Notice
from kin import InputError, KinematicsError
from kin.parsing import to_toml

FILE = "exercise"
_TAKEN = re.compile(r"-(\d+)$")


@dataclass(frozen=True)
class AuthorSettings(Settings):
    """The draft as the text of a file; empty: none is open.

    Attributes:
        served: what the folder of the service has of this page, by id: `digest`. Undo does not change it.
        error: why the last act was refused.
    """

    draft: str = text_field("Exercise", longest=MOST_BYTES, undo="Exercise text")
    served: tuple[tuple[str, str], ...] = memory((), renew=False)
    error: views.Refusal = memory(views.Refusal(), renew=False)


@dataclass(frozen=True, eq=False, kw_only=True)
class Drafted(Facts[AuthorSettings]):
    """What is known of the draft.

    Attributes:
        exercises: those of the service.
        find: gives the arm of an id.
    """

    exercises: Exercises
    find: Find

    @cached_property
    def known(self) -> Exercise | None:
        """The exercise of the service with the draft's id."""
        return self.exercises.get(_id_of(self.settings.draft))

    @property
    def is_mine(self) -> bool:
        """Whether the draft is another version of that one."""
        known = self.known
        return known is not None and dict(self.settings.served).get(known.id) == digest(known.source)

    @cached_property
    def data(self) -> forms.Draft:
        """The data of the file; empty without one."""
        return forms.read(self.settings.draft)

    @cached_property
    def trial(self) -> Trial:
        """The draft, tried."""
        found = _trial(self.settings.draft, self.find)
        return found if self.known is None or self.is_mine or found.exercise is None else found.with_taken_id()

    @property
    def is_saved(self) -> bool:
        """Whether the service has the draft as it is."""
        return self.known is not None and self.is_mine and forms.read(self.known.source) == self.data

    @property
    def exercise(self) -> Exercise | None:
        """The exercise, if the draft is one that can be solved."""
        return None if self.trial.error else self.trial.exercise

    @property
    def first(self) -> Variant | None:
        """What the first student gets."""
        return self.trial.variants[0] if self.trial.variants else None


@lru_cache(maxsize=16)  # facts are made anew with each event
def _trial(draft: str, find: Find) -> Trial:
    return tried(draft, FILE, find)


class Author(OpenableFeature[AuthorSettings, Drafted]):
    """The draft is kept while it is tried."""

    key = AUTHOR
    title = "Write an exercise"
    about = "For teachers: your own question, from a kind or from any exercise."
    settings_of, facts_of = AuthorSettings, Drafted
    messages = frozenset(
        {"set", "add", "drop", "look", "pose", "try", "save", "serve", "bring", "close", "upload"}
    )

    # Declared

    def sources(self) -> Mapping[str, Any]:
        return {"exercises": self._exercises, "find": self.stage.services.store.get}

    @property
    def _exercises(self) -> Exercises:
        """Those of the service."""
        return self.stage.activity.courses.exercises

    def panel(self) -> Sequence[PanelNode]:
        if not self.shown:
            return ()
        activity, units, f = self.stage.activity, self.stage.display.units, self.read
        if activity.practice.seated:
            return [Html(views.student_html, ())]
        if not f.data:
            return [Html(views.start_html, (activity.exercises.all, self.settings.error))]
        trial, robots = f.trial, tuple(robot.id for robot in self.stage.services.store.robots)
        values, refusal = trial.values(units), self.settings.error or views.Refusal(trial.field, trial.error)
        nodes: list[PanelNode] = [Html(views.head_html, (trial, refusal, self._place))]
        for i, group in enumerate(forms.groups(f.data, robots)):
            nodes.append(Html(views.group_html, (group, i, values, refusal)))
        nodes.append(Html(views.students_html, (trial.students(units), trial.error)))
        return nodes

    @property
    def _place(self) -> views.ServerFolder:
        """What can be done with the draft in the folder of the service."""
        if not self.stage.rights.save:
            return views.ServerFolder(saved=self.read.is_saved)
        obstacle = self._exercises.obstacle
        return views.ServerFolder(not obstacle, obstacle, self.read.is_saved, self.read.known is not None)

    def scene(self) -> Sequence[Node]:
        variant = self.read.first if self.shown else None
        if variant is None or variant.target is None:
            return ()
        size = SIZE * variant.robot.reach
        point = variant.target[:3, 3]
        return [
            axes("target", variant.target, size, 0.05 * size),
            frame("name", label("text", "target", (0.0, 0.0, 0.5 * size)), position=point),
        ]

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case (str(name), *rest) if name in self.messages:
                if self.stage.activity.practice.seated:
                    raise InputError("exercise", name, "a page of a teacher: this one is a student’s in a room")
                self.change(error=views.Refusal())  # with new facts: another page may have saved the exercise
                self.invalidate()
                try:
                    self._act(name, rest, value)
                except (ExerciseFileError, InputError) as error:
                    why = f"got {error.value}, expected {error.expected}"
                    self.change(error=views.Refusal(error.field, why))
                self.invalidate()
            case _:
                super().heard(key, value)

    def _act(self, name: str, rest: list[Hashable], value: object) -> None:
        data = self.facts.data
        match name, rest, value:
            case "set", ["new", int()], str(origin) if not data:
                self._start(origin)
            case "upload", _, _:
                self._upload(*sent_text(value, MOST_BYTES))
            case "close", _, _:
                self.change(draft="")
            case "set", [str(path), int()], str(text) if data:
                self._put(forms.with_cell(data, path, text))
            case "add", [str(path), int()], _ if data:
                self._put(forms.with_row(data, path))
            case "drop", [str(path), int()], int(index) if data:
                self._put(forms.without_row(data, path, index))
            case "pose", [int()], _ if data:
                self._take_pose(data)
            case "look", [int()], int(seed) if 0 <= seed < len(self.facts.trial.variants):
                self._look(self.facts.trial.variants[seed])
            case "try", [int()], _ if (one := self.facts.exercise) is not None:
                self._try(one)
            case "save", [int()], _ if (one := self.facts.exercise) is not None:
                self._save(one)
            case "bring", [int()], _ if (one := self.facts.exercise) is not None:
                self._bring(one)
            case "serve", [int()], _ if self.stage.rights.save and (one := self.facts.exercise) is not None:
                self._serve(one)
            case (("try" | "save" | "bring" | "serve"), [int()], _):
                pass  # the form says what is wrong
            case _:
                raise InputError("exercise", name, "a control of the form")

    def _start(self, origin: str) -> None:
        """A draft from an exercise, or from the plainest one of a kind, with an id of its own."""
        known = self.stage.activity.exercises
        one = known.get(origin)
        if (kind := origin.removeprefix("kind:")) != origin:
            one = min(
                (each for each in builtin_exercises() if each.kind.name == kind),
                key=lambda each: (each.level, len(each.source)),
                default=None,
            )
        if one is None:
            raise InputError("exercise", origin, "the id of an exercise, or one of the kinds " + ", ".join(KINDS))
        data = forms.read(one.source)
        if self.stage.rights.save and not one.builtin and not known.is_own(one.id) and written_in_a_page(one):
            self._serves(one)  # it is changed where it is; with another id, a new one
        elif not known.is_own(one.id):
            data["id"] = _free(one.id, known)
            data["title"] = f"{one.title} (mine)"[:80]
            data.pop("place", None)
            if kind != origin:
                data.pop("lesson", None)  # with it, the checks of other lessons would ask it
        self._open(data)

    def _upload(self, file: str, text: str) -> None:
        parse_exercise(text, file, self.stage.services.store.get)
        self._open(forms.read(text))

    def _open(self, data: forms.Draft) -> None:
        self._put(data, move=False)
        self._look(self.facts.first)

    def _put(self, data: forms.Draft, move: bool = True) -> None:
        """The draft has changed: the arm follows if another posture is asked about."""
        text = to_toml(data)
        if len(text.encode()) > MOST_BYTES:
            raise InputError("exercise", f"{len(text.encode())} bytes", f"at most {MOST_BYTES} bytes in all")
        before = self.facts.first
        self.change(draft=text)
        self.invalidate()
        now = self.facts.first
        moved = before is None or now is None or now.robot != before.robot or (now.q != before.q).any()
        if move and moved:
            self._look(now)
        self._offer()

    def _look(self, variant: Variant | None) -> None:
        """Bring the arm to the posture of a student's numbers."""
        if variant is None:
            return
        if self.stage.arm.now.robot != variant.robot:
            self.stage.robots.show(variant.robot)
        title = self.facts.trial.exercise.title if self.facts.trial.exercise else self.title
        self.stage.arm.move_to(variant.q, Notice("hand", title, "The arm shows the posture of these numbers."))

    def _take_pose(self, data: forms.Draft) -> None:
        """The arm on show, and its posture, become those of the exercise."""
        robot, q = self.stage.arm.now.robot, self.stage.arm.now.q
        try:
            known = self.stage.services.store.get(robot.id) == robot
        except KinematicsError:
            known = False
        if not known:
            raise InputError("robot", robot.name, "an arm of this service: students do not have yours")
        rounded = [_rounded(float(value), bool(turns)) for value, turns in zip(q, robot.revolute, strict=True)]
        self._put({**data, "robot": robot.id, "q": rounded}, move=False)

    def _try(self, exercise: Exercise) -> None:
        """Open it as a student sees it, with new marks."""
        self._offer()
        self.stage.activity.practice.records.pop(exercise.id, None)
        self.stage.post(("feature", EXERCISES, ("open", exercise.id, 0)), None)

    def _bring(self, exercise: Exercise) -> None:
        """Into the open course, or a new one."""
        activity = self.stage.activity
        course = activity.progress.bring(exercise)
        activity.enter_course()
        detail = "Its link and its file bring the exercise along; the link hides the answer."
        self.stage.status.show(Notice("hand", f"In the course {course.title}", detail))

    def _save(self, exercise: Exercise) -> None:
        save_file(self.stage, f"{exercise.id}.toml", self.settings.draft)

    def _serve(self, exercise: Exercise) -> None:
        """Into the folder of the service, for all pages."""
        self.invalidate()
        again = self.facts.known is not None
        saved = self._exercises.save(to_toml(self.facts.data), dict(self.settings.served).get(exercise.id, ""))
        self._serves(saved)
        self._offer()
        title = f"{saved.title} is {'replaced' if again else 'saved'} on the server"
        self.stage.status.show(
            Notice("hand", title, "Other pages have it when they next open the list of exercises.")
        )

    def _serves(self, exercise: Exercise) -> None:
        """The folder of the service has this one of the page."""
        served = dict(self.settings.served) | {exercise.id: digest(exercise.source)}
        self.change(served=tuple(served.items()))

    def _offer(self) -> None:
        """The page's exercises have the draft, as long as it is one."""
        self.stage.activity.draft = self.facts.exercise
        self.stage.activity.stock()

    # Feature

    def step_name(self, key: Hashable) -> str:
        names = {"try": "Try the exercise", "close": "Exercise closed", "pose": "Posture of the exercise"}
        return names.get(str(key[0]), "Exercise text") if isinstance(key, tuple) else self.title

    def on_robot(self) -> None:
        if self.shown:
            super().on_robot()

    def state(self) -> dict[str, object]:
        if not self.settings.draft:
            return {}
        served = dict(self.settings.served).get(str(_id_of(self.settings.draft)), "")
        return {**super().state(), **({"served": served} if served else {})}

    def restore(self, state: dict[str, object]) -> None:
        if self.stage.activity.practice.seated:
            return  # the draft of a teacher who leads the class has the answer
        served, draft = state.get("served"), state.get("draft")
        if isinstance(served, str) and isinstance(draft, str):
            known = {str(_id_of(draft)): served, **dict(self.settings.served)}
            self.change(served=tuple(known.items()))
        super().restore({"draft": "", **state})
        self.invalidate()
        self._offer()


@lru_cache(maxsize=16)
def _id_of(draft: str) -> object:
    """The id in a draft, whatever it is; None without one."""
    return forms.read(draft).get("id")


def _rounded(value: float, turns: bool) -> str | int:
    """A joint value as an expression, to a degree or a millimetre."""
    number = round(kin.units.DEGREES.shown(value, 0) if turns else 1000.0 * value)
    return f"{number}*{'deg' if turns else 'mm'}" if number else 0


def _free(name: str, known: Exercises) -> str:
    """An id like this one that is not taken."""
    stem = _TAKEN.sub("", name)[:34]
    return next(new for i in range(2, 1000) if known.get(new := f"{stem}-{i}") is None)
