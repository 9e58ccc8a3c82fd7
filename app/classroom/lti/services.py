"""What we sign for a platform: answers to deep linking, and scores (Assignment and Grade Services)."""

from __future__ import annotations

import json
import re
import secrets
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any
from urllib.parse import urlencode, urlsplit, urlunsplit

import jwt

from app.classroom.lti.contents import Content
from app.classroom.lti.exchange import LIMITS, PlatformError, ask
from app.classroom.lti.launches import CLAIM, SCORE_SCOPE
from app.classroom.lti.platforms import Platform, Platforms
from kin.parsing import TextError, read_json

LIFE = 300  # seconds that what we sign is valid
_DL = "https://purl.imsglobal.org/spec/lti-dl/claim/"
_ASSERTION = "urn:ietf:params:oauth:client-assertion-type:jwt-bearer"


def link_answer(
    platforms: Platforms,
    platform: Platform,
    deployment: str,
    data: str | None,
    chosen: Sequence[Content],
    launch_url: str,
) -> str:
    """The signed answer to a deep linking request; `data` is what it repeats, if anything."""
    content = [each.item(launch_url) for each in chosen]
    claims: dict[str, Any] = {
        CLAIM + "message_type": "LtiDeepLinkingResponse",
        CLAIM + "version": "1.3.0",
        CLAIM + "deployment_id": deployment,
        _DL + "content_items": content,
    }
    if data is not None:
        claims[_DL + "data"] = data
    return _sign(platforms, platform.client_id, platform.issuer, claims)


def post_score(
    platforms: Platforms,
    platform: Platform,
    column: str,
    user: str,
    score: float,
    most: int = 1,
    done: bool = True,
) -> None:
    """Write a user's score, 0 to `most`, into a column of the gradebook; raises `PlatformError`.

    Args:
        done: whether the user has come to the end; the score counts in any case.
    """
    assertion = _sign(platforms, platform.client_id, platform.token_url, {"sub": platform.client_id})
    form = {
        "grant_type": "client_credentials",
        "client_assertion_type": _ASSERTION,
        "client_assertion": assertion,
        "scope": SCORE_SCOPE,
    }
    kind = {"Content-Type": "application/x-www-form-urlencoded"}
    try:
        access = _access_token(ask(platform.token_url, platform.places, urlencode(form).encode(), kind))
    except PlatformError as error:
        error.general = True
        raise
    parts = urlsplit(column)
    address = urlunsplit(parts._replace(path=parts.path.rstrip("/") + "/scores", fragment=""))
    body = {
        "userId": user,
        "scoreGiven": score,
        "scoreMaximum": most,
        "timestamp": datetime.now(UTC).isoformat(),
        "activityProgress": "Completed" if done else "InProgress",
        "gradingProgress": "FullyGraded",
    }
    headers = {"Content-Type": "application/vnd.ims.lis.v1.score+json", "Authorization": f"Bearer {access}"}
    ask(address, platform.places, json.dumps(body).encode(), headers)


def _access_token(answer: bytes) -> str:
    """The token of an answer; raises `PlatformError` for one that cannot stand in a header."""
    try:
        found = read_json(answer, LIMITS)["access_token"]
    except (TextError, KeyError, TypeError):
        found = None
    if not isinstance(found, str) or not re.fullmatch(r"[!-~]+", found):
        raise PlatformError("the platform's answer has no access token")
    return found


def _sign(platforms: Platforms, issuer: str, audience: str, claims: dict[str, Any]) -> str:
    begin = int(time.time())
    common = {"iss": issuer, "aud": audience, "iat": begin, "exp": begin + LIFE, "nonce": secrets.token_hex(16)}
    return jwt.encode(
        {**common, "jti": secrets.token_hex(16), **claims}, platforms.key, "RS256", {"kid": platforms.key_id}
    )
