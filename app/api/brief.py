"""Answers with a few fields: what the parameter `fields` of ``ik`` and ``reachable`` names, and nothing else.

Most of the time of a whole answer goes into objects, sentences and digits. The best joint values and the status of
many targets come from one compiled pass (`kin.ik.batch`), so a list that asks for no more takes a few microseconds
per target.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import Query
from msgspec import UNSET, UnsetType

from app.api.problems import invalid
from app.shared.answers.answer import Answer
from app.shared.answers.ik import Brief, IkAnswer, ReachableAnswer
from app.shared.problems import FieldError, Problem, show
from kin import IKOptions, Robot
from kin.ik.batch import solve_many
from kin.transforms import Array

NAMES = Brief.__struct_fields__
_SIZES = {"reason": 150, "q": 40}  # bytes of a field, about, besides the joint values
_JOINT, _SHORT = 22, 30

Fields = Annotated[
    str | None,
    Query(
        max_length=200,
        description=f"Only these fields of each answer, separated by commas: {', '.join(NAMES)}. Such answers are "
        "small, and those without `reason` take far less time. By default the whole answer.",
        examples=["q,status"],
    ),
]


class BriefAnswers(Answer):
    """Answers with a few fields to a list of targets."""

    results: list[Brief]
    """One per target, in the same order."""
    problem: Problem | UnsetType = UNSET
    """Why results are missing (`reachable` only): the time limit of the request was reached."""


def names_of(fields: str | None) -> tuple[str, ...]:
    """The fields that a request names, each once; none for whole answers. Raises 422 for an unknown one."""
    if fields is None:
        return ()
    names = tuple(dict.fromkeys(name.strip() for name in fields.split(",")))
    for name in names:
        if name not in NAMES:
            expected = "names separated by commas, of " + ", ".join(NAMES)
            raise invalid(FieldError(field="fields", value=show(name), expected=expected))
    return names


def size_of(robot: Robot, names: tuple[str, ...]) -> int:
    """Bytes of a brief answer, about."""
    return sum(_SIZES.get(name, _SHORT) for name in names) + _JOINT * robot.n * ("q" in names)


def brief(answer: IkAnswer | ReachableAnswer, names: tuple[str, ...]) -> dict[str, Any]:
    """These fields of a whole answer."""
    found = {name: getattr(answer, name, None) for name in names}
    if isinstance(answer, IkAnswer):
        if "q" in names:
            found["q"] = answer.solutions[0].q if answer.solutions else None
        if "reachable" in names:
            found["reachable"] = answer.status == "solved"
    return found


def quick(names: tuple[str, ...]) -> bool:
    """Whether the compiled pass knows these fields."""
    return bool(names) and "reason" not in names


def briefly(
    robot: Robot,
    T: Array,
    options: IKOptions,
    seeds: Array | None,
    whole: Callable[[Any], IkAnswer | ReachableAnswer],
    names: tuple[str, ...],
    cancel: Callable[[], None],
) -> list[dict[str, Any]]:
    """Brief answers to poses of the world frame ``(k, 4, 4)``, of fields that are `quick`.

    Args:
        robot, options: as in `kin.ik.solve`.
        T: the poses.
        seeds: ``(k, n)``, or None for the home configuration.
        whole: the whole answer of a result, for targets that the compiled pass does not solve.
        names: of the fields.
        cancel: called now and then; raises to cancel.
    """
    results = solve_many(robot, T, options, seeds, cancel=cancel)
    values = {"status": "solved", "reachable": True, "cause": "", "distance": 0.0}
    columns = [results.q.tolist() if name == "q" else [values[name]] * len(T) for name in names]
    found = [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]
    for i in (~results.solved).nonzero()[0].tolist():
        found[i] = brief(whole(results[i]), names)
    return found
