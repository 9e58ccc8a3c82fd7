"""An answer in a few words, for who looks at the answers of others."""

from __future__ import annotations

from functools import lru_cache

from app.exercises.contract import PLAIN_UNITS
from app.exercises.exercise import Exercise, VariantError
from kin.parsing import Limits, TextError, read_json
from kin.units import general

LONGEST = 90  # characters
LIMITS = Limits(20_000, 10_000, 16)  # of an answer


@lru_cache(maxsize=2048)
def answer_in_words(exercise: Exercise, seed: int, answer: str) -> str:
    """What a student answered: the words of the options, the typed cells, or the numbers.

    Args:
        answer: as JSON, or its beginning.
    """
    try:
        given = read_json(answer, LIMITS)
    except TextError:
        return _short(answer)  # it goes on
    try:
        asked = exercise.asked(exercise.variant(seed), PLAIN_UNITS)
    except VariantError:
        return _short(answer)
    labels = asked.labels
    match asked.form, given:
        case "options", int() if type(given) is int and 0 <= given < len(labels):
            return _short(labels[given])
        case "order", [*places] if all(type(i) is int and 0 <= i < len(labels) for i in places):
            return _short(" → ".join(labels[i] for i in places))
        case "fields", [*cells] if len(cells) == len(labels):
            return _short(
                ", ".join(
                    f"{label} = {cell}" if label else str(cell) for label, cell in zip(labels, cells, strict=True)
                )
            )
        case _, [[*_], *_]:
            return _short("; ".join(", ".join(map(_word, row)) for row in given if isinstance(row, list)))
        case _, [*cells]:
            return _short(", ".join(map(_word, cells)))
    return _short(str(given))


def _word(value: object) -> str:
    return general(value, 4) if isinstance(value, float) else str(value)


def _short(text: str) -> str:
    line = " ".join(text.encode("utf-8", "replace").decode().split())  # half a letter is none
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 1]}…"
