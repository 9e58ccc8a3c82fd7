"""What we sign for a platform: answers to deep linking, and scores (Assignment and Grade Services)."""

from __future__ import annotations

import json
import secrets
import time
import urllib.request
from collections.abc import Sequence
from datetime import UTC, datetime
from http.client import HTTPException
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode, urlsplit, urlunsplit

import jwt

from app.classroom.lti.contents import Content
from app.classroom.lti.launches import CLAIM, SCORE_SCOPE, Launch
from app.classroom.lti.platforms import Platform, Platforms, is_safe

PATIENCE = 10.0  # s
LIFE = 300  # seconds that what we sign is valid
MAX_ANSWER = 64 * 1024  # bytes
_DL = "https://purl.imsglobal.org/spec/lti-dl/claim/"
_ASSERTION = "urn:ietf:params:oauth:client-assertion-type:jwt-bearer"


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """What is sent is secret: it goes to the address that the operator or the platform gave, and nowhere else."""

    def redirect_request(self, *_: object) -> None:
        return None


_OPENER = urllib.request.build_opener(_NoRedirects)


class GradeRefused(Exception):  # noqa: N818 - a finding, with a sentence for the log
    """The platform did not take a score; `final` says whether trying again is useless."""

    def __init__(self, message: str, final: bool) -> None:
        super().__init__(message)
        self.final = final


def link_answer(platforms: Platforms, launch: Launch, chosen: Sequence[Content], launch_url: str) -> str:
    """The signed answer to a deep linking request."""
    content = [each.item(launch_url) for each in chosen]
    claims: dict[str, Any] = {
        CLAIM + "message_type": "LtiDeepLinkingResponse",
        CLAIM + "version": "1.3.0",
        CLAIM + "deployment_id": launch.deployment,
        _DL + "content_items": content,
    }
    if "data" in launch.linking:
        claims[_DL + "data"] = launch.linking["data"]
    return _sign(platforms, launch.platform.client_id, launch.platform.issuer, claims)


def post_score(
    platforms: Platforms,
    platform: Platform,
    column: str,
    user: str,
    score: float,
    most: int = 1,
    done: bool = True,
) -> None:
    """Write a user's score, 0 to `most`, into a column of the gradebook; raises `GradeRefused`.

    Args:
        done: whether the user has come to the end; the score counts in any case.
    """
    if not is_safe(column):
        raise GradeRefused("the address of the column is not HTTPS", final=True)
    assertion = _sign(platforms, platform.client_id, platform.token_url, {"sub": platform.client_id})
    form = {
        "grant_type": "client_credentials",
        "client_assertion_type": _ASSERTION,
        "client_assertion": assertion,
        "scope": SCORE_SCOPE,
    }
    answer = _send(platform.token_url, urlencode(form).encode(), "application/x-www-form-urlencoded")
    try:
        access = json.loads(answer)["access_token"]
    except (ValueError, KeyError, TypeError):
        raise GradeRefused("the platform's answer has no access token", final=False) from None
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
    _send(address, json.dumps(body).encode(), "application/vnd.ims.lis.v1.score+json", str(access))


def _sign(platforms: Platforms, issuer: str, audience: str, claims: dict[str, Any]) -> str:
    begin = int(time.time())
    common = {"iss": issuer, "aud": audience, "iat": begin, "exp": begin + LIFE, "nonce": secrets.token_hex(16)}
    return jwt.encode(
        {**common, "jti": secrets.token_hex(16), **claims}, platforms.key, "RS256", {"kid": platforms.key_id}
    )


def _send(address: str, body: bytes, kind: str, access: str = "") -> bytes:
    headers = {"Content-Type": kind, "Accept": "application/json"}
    if access:
        headers["Authorization"] = f"Bearer {access}"
    request = urllib.request.Request(address, body, headers, method="POST")
    try:
        with _OPENER.open(request, timeout=PATIENCE) as answer:
            found: bytes = answer.read(MAX_ANSWER)
            return found
    except HTTPError as error:
        with error:
            status = error.code
        if 300 <= status < 400:
            raise GradeRefused(f"the platform answered {status}: redirects are not followed", final=True) from None
        raise GradeRefused(
            f"the platform answered {status}", final=400 <= status < 500 and status != 429
        ) from None
    except (URLError, HTTPException, OSError) as error:
        raise GradeRefused(f"the platform cannot be reached: {error}", final=False) from None
