"""Result codes: whether this service has signed one, and what it says."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import Path, Request, Response
from starlette.concurrency import run_in_threadpool

from app.api.body import versioned
from app.api.problems import ProblemError
from app.api.schemas import refusals, reply
from app.classroom import Hub
from app.classroom.results.check import check_code, facts
from app.classroom.results.codes import MOST_LETTERS
from app.shared.answers.answer import Answer
from kin import KinematicsError

router = versioned("results")


class OutcomeAnswer(Answer):
    """What a student has reached."""

    kind: Literal["exercise", "course"]
    """Of what."""
    title: str
    """The title of the course or exercise, cut to 16 characters."""
    fingerprint: str
    """Eight hexadecimal digits that tell it from others."""
    alias: str
    """The name that the student has given."""
    score: int
    """0 to 100: the mean over the exercises."""
    solved: int
    """How many exercises were solved."""
    count: int
    """Of how many."""
    tries: int
    """Answers in all; 255 means this many or more."""
    day: str
    """When the code was made, as 2026-11-23 (UTC)."""


class CodeAnswer(Answer):
    """Whether a code is right."""

    status: Literal["signed", "mistyped", "forged"]
    """`signed`: this service has made the code. `mistyped`: its checksum is wrong. `forged`: the checksum is
    right, the signature is not; the code was changed, or another service made it."""
    message: str
    """The reason in a sentence; empty if the code is signed."""
    outcome: OutcomeAnswer | None
    """What it says; null unless it is signed."""


Code = Annotated[
    str, Path(max_length=MOST_LETTERS, description="A result code. Case, spaces and hyphens do not matter.")
]


@router.get(
    "/results/{code}", summary="Check a result code", response_model=CodeAnswer, responses=refusals(422, 500, 503)
)
async def check_result(request: Request, code: Code) -> Response:
    """Distinguishes a typing error from a code that was changed. Only its own service can check it."""
    hub = request.app.state.classroom
    assert isinstance(hub, Hub)
    try:
        checked = await run_in_threadpool(check_code, code, hub)
    except KinematicsError as error:
        raise ProblemError(503, "busy", str(error)) from None
    return reply(facts(checked))
