"""Checks a result code against the key of this service."""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from typing import Literal

from app.classroom.hub import Hub
from app.classroom.results.codes import CodeError, ForgedCodeError, Outcome, read_code
from app.classroom.results.keys import result_key

Status = Literal["signed", "mistyped", "forged"]


@dataclass(frozen=True)
class Checked:
    """Whether a code is right.

    Attributes:
        message: what is wrong with it, and what would be valid; empty if nothing is.
        outcome: what it says; None unless it is signed.
    """

    status: Status
    message: str = ""
    outcome: Outcome | None = None


def check_code(text: str, hub: Hub) -> Checked:
    """Whether this service has signed a code; raises `KinematicsError` if its key cannot be read.

    A service without a database has signed nothing; none is made for a check, and a key that nobody knows is used.
    """
    key = result_key(hub) if hub.in_use else secrets.token_bytes(32)
    try:
        return Checked("signed", outcome=read_code(text, key))
    except CodeError as error:
        return Checked(
            "forged" if isinstance(error, ForgedCodeError) else "mistyped", f"{str(error).capitalize()}."
        )


def facts(checked: Checked) -> dict[str, object]:
    """As JSON."""
    outcome = checked.outcome
    found = None
    if outcome is not None:
        found = {
            **vars(outcome),
            "fingerprint": outcome.fingerprint.hex(),
            "day": outcome.day.isoformat(),
        }
    return {"status": checked.status, "message": checked.message, "outcome": found}
