"""The key that signs result codes and what pages keep: made from the key of the classroom's database."""

from __future__ import annotations

import hmac

from app.classroom.hub import Hub
from app.classroom.views import ClassroomUnavailable
from kin import KinematicsError


def result_key(hub: Hub) -> bytes:
    """The same for all processes of a database; raises `KinematicsError` with the reason if that is not there."""
    try:
        key = hub.database.key()
    except ClassroomUnavailable as error:
        raise KinematicsError(str(error)) from error
    return hmac.digest(key.encode(), b"kinboard.result", "sha256")
