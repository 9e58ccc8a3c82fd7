"""The exercises that results of a room name: the service's, and those that its teacher wrote and sent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from app.classroom.courses.files import Find, parsed
from app.exercises import Exercise, ExerciseFileError, Exercises, form
from app.exercises.said import answer_in_words


class SentExercises:
    """Titles of exercises, and answers in words.

    Args:
        exercises: those of the service.
        own: the texts of those that the teacher wrote, by id: each that was sent, the newest at the end.
        find: gives the arm of an id.
    """

    def __init__(self, exercises: Exercises, own: Mapping[str, Sequence[str]], find: Find) -> None:
        self._exercises, self._own, self._find = exercises, own, find

    def title(self, exercise_id: str) -> str:
        """The title, or the id of an exercise that is not known."""
        if texts := self._own.get(exercise_id):
            return str(form.read(texts[-1]).get("title", exercise_id))
        known = self._exercises.get(exercise_id)
        return exercise_id if known is None else known.title

    @property
    def titles(self) -> dict[str, str]:
        """Of all that are known, by id."""
        known = {one.id: one.title for one in self._exercises.all}
        return known | {key: self.title(key) for key in self._own}

    def said(self, exercise_id: str, seed: int, answer: str) -> str:
        """An answer in words; as it was given, where it is not certain which words the student saw.

        Args:
            answer: as JSON, or its beginning.
        """
        versions = self._versions(exercise_id)
        words = {answer if one is None else answer_in_words(one, seed, answer) for one in versions}
        return words.pop() if len(words) == 1 else answer

    def _versions(self, exercise_id: str) -> list[Exercise | None]:
        """All that had this id in the room; None for one that cannot be read any more."""
        found: list[Exercise | None] = []
        if (known := self._exercises.get(exercise_id)) is not None:
            found.append(known)
        for text in self._own.get(exercise_id, ()):
            try:
                found.append(parsed(text, self._find))
            except ExerciseFileError:  # its arm is gone, or the text is not kept
                found.append(None)
        return found
