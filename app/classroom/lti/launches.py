"""Logins and launches: what a platform sends through its user's browser, verified (OpenID Connect, LTI 1.3).

1. The platform sends the browser to our login address. `Logins.begin` answers with the platform's address, a
   signed state and a nonce; the browser keeps the state in a cookie.
2. The platform posts a signed token and the state. `Logins.finish` verifies both and uses up the nonce.
"""

from __future__ import annotations

import hmac
import secrets
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http.client import HTTPException
from typing import Any
from urllib.parse import urlencode

import jwt
from itsdangerous import BadSignature, SignatureExpired, URLSafeTimedSerializer
from jwt import PyJWKClient

from app.classroom.lti.platforms import Platform, Platforms

CLAIM = "https://purl.imsglobal.org/spec/lti/claim/"
GRADES = "https://purl.imsglobal.org/spec/lti-ags/claim/endpoint"
LINKING = "https://purl.imsglobal.org/spec/lti-dl/claim/deep_linking_settings"
SCORE_SCOPE = "https://purl.imsglobal.org/spec/lti-ags/scope/score"
LEARN, LINK = "LtiResourceLinkRequest", "LtiDeepLinkingRequest"
_TEACHING = ("#Instructor", "#TeachingAssistant", "#ContentDeveloper", "#Administrator")
LOGIN_TIME = 600  # seconds from the login to the launch
CLOCKS = 30  # seconds by which clocks may differ
MAX_TOKEN = 64 * 1024  # characters
PATIENCE = 10.0  # s for the platform's public keys


class LaunchRefused(Exception):  # noqa: N818 - a finding, with a sentence for the page
    """A login or a launch is not valid; the message says why."""


@dataclass(frozen=True)
class Launch:
    """A verified launch.

    Attributes:
        kind: `LEARN` or `LINK`.
        user: the platform's opaque id of its user.
        alias: a first name if the platform tells it, else "Student" or "Teacher".
        teacher: whether the user teaches here.
        resource: id of the link within the deployment, and its title.
        exercise, course: what the link names, not checked; empty: nothing.
        grades: the address of the column for scores, if we may write there; empty: none.
        linking: settings of a deep linking request.
    """

    platform: Platform
    kind: str
    deployment: str
    user: str
    alias: str
    teacher: bool
    resource: str
    title: str
    exercise: str
    course: str
    grades: str
    linking: Mapping[str, Any]


class Logins:
    """Begins and finishes launches.

    Args:
        key: signs states; the same in all processes.
        use_nonce: called once with each valid nonce and the time when it expires; False: it was used before.
    """

    def __init__(self, platforms: Platforms, key: str, use_nonce: Callable[[str, float], bool]) -> None:
        self._platforms = platforms
        self._states = URLSafeTimedSerializer(key, salt="kinboard.lti.state")
        self._use_nonce = use_nonce
        self._keys: dict[str, PyJWKClient] = {}

    def begin(self, asked: Mapping[str, str], launch_url: str) -> tuple[str, str]:
        """Where to send the browser, and the state for its cookie; raises `LaunchRefused`."""
        issuer, client_id = asked.get("iss", ""), asked.get("client_id", "")
        platform = self._platforms.find(issuer, client_id)
        if platform is None:
            raise LaunchRefused(
                f"The platform {issuer[:200]!r} with client id {client_id[:100]!r} is not registered here."
            )
        if not asked.get("login_hint"):
            raise LaunchRefused("The platform's request lacks login_hint.")
        nonce = secrets.token_urlsafe(24)
        state = self._states.dumps([platform.issuer, platform.client_id, nonce])
        query = {
            "scope": "openid",
            "response_type": "id_token",
            "response_mode": "form_post",
            "prompt": "none",
            "client_id": platform.client_id,
            "redirect_uri": launch_url,
            "state": state,
            "nonce": nonce,
            "login_hint": asked["login_hint"],
        }
        if asked.get("lti_message_hint"):
            query["lti_message_hint"] = asked["lti_message_hint"]
        separator = "&" if "?" in platform.login_url else "?"
        return f"{platform.login_url}{separator}{urlencode(query)}", state

    def finish(self, token: str, state: str, cookie: str) -> Launch:
        """The launch of a signed token; raises `LaunchRefused`. Waits for the platform's keys."""
        if not state or not hmac.compare_digest(state.encode(), cookie.encode()):
            raise LaunchRefused(
                "The launch does not belong to this browser: its cookie is missing. Allow cookies for this site, "
                "or let the platform open Kinboard in a new window."
            )
        try:
            issuer, client_id, nonce = self._states.loads(state, max_age=LOGIN_TIME)
        except SignatureExpired:
            raise LaunchRefused("The launch took too long. Start it again on the platform.") from None
        except (BadSignature, ValueError, TypeError):
            raise LaunchRefused("The state of the launch is not one of ours.") from None
        platform = self._platforms.find(issuer, client_id)
        if platform is None:
            raise LaunchRefused("The platform is no longer registered here.")
        claims = self._verified(token, platform)
        given = claims.get("nonce")
        if not isinstance(given, str) or not hmac.compare_digest(given.encode(), nonce.encode()):
            raise LaunchRefused("The nonce of the launch is not the one of its login.")
        launch = _launch(claims, platform)
        if not self._use_nonce(nonce, time.time() + LOGIN_TIME + CLOCKS):
            raise LaunchRefused("This launch was used before. Start it again on the platform.")
        return launch

    def _verified(self, token: str, platform: Platform) -> dict[str, Any]:
        if not token or len(token) > MAX_TOKEN:
            raise LaunchRefused("The launch has no token.")
        client = self._keys.get(platform.keys_url)
        if client is None:
            client = self._keys[platform.keys_url] = PyJWKClient(platform.keys_url, timeout=PATIENCE)
        try:
            key = client.get_signing_key_from_jwt(token)
            required = ["iss", "aud", "exp", "iat", "nonce", "sub"]
            claims: dict[str, Any] = jwt.decode(
                token, key, algorithms=["RS256"], audience=platform.client_id, issuer=platform.issuer,
                leeway=CLOCKS, options={"require": required},
            )  # fmt: skip
        except jwt.ExpiredSignatureError:
            raise LaunchRefused("The launch has expired. Start it again on the platform.") from None
        except jwt.InvalidAudienceError:
            raise LaunchRefused("The launch is for another tool: its client id is not ours.") from None
        except jwt.InvalidIssuerError:
            raise LaunchRefused("The launch is of another platform than its login.") from None
        except jwt.InvalidSignatureError:
            raise LaunchRefused("The signature of the launch is not the platform's.") from None
        except jwt.PyJWKClientConnectionError:
            raise LaunchRefused(f"The platform's keys at {platform.keys_url} cannot be fetched.") from None
        except (jwt.PyJWKSetError, jwt.InvalidKeyError, ValueError, TypeError, AttributeError, HTTPException):
            # PyJWT takes the answer as it is: text, a list, or keys without the fields of a key.
            raise LaunchRefused(
                f"What the platform has at {platform.keys_url} is not a set of public keys (JSON Web Key Set)."
            ) from None
        except jwt.PyJWKClientError:
            raise LaunchRefused("The launch is signed with a key that the platform does not publish.") from None
        except jwt.PyJWTError as error:
            raise LaunchRefused(f"The token of the launch is not valid: {error}.") from None
        if isinstance(claims["aud"], list) and len(claims["aud"]) > 1 and claims.get("azp") != platform.client_id:
            raise LaunchRefused("The launch is for another tool: its authorized party is not us.")
        return claims


def _launch(claims: Mapping[str, Any], platform: Platform) -> Launch:
    """What the claims say; raises `LaunchRefused`."""
    if claims.get(CLAIM + "version") != "1.3.0":
        raise LaunchRefused("The launch is not of LTI version 1.3.0.")
    deployment = claims.get(CLAIM + "deployment_id")
    if deployment not in platform.deployments:
        raise LaunchRefused(f"The deployment {str(deployment)[:100]!r} of the platform is not registered here.")
    kind = claims.get(CLAIM + "message_type")
    if kind not in (LEARN, LINK):
        raise LaunchRefused(f"Messages of type {str(kind)[:100]!r} are not understood; {LEARN} and {LINK} are.")
    resource = _table(claims, CLAIM + "resource_link")
    if kind == LEARN and not isinstance(resource.get("id"), str):
        raise LaunchRefused("The launch names no resource link.")
    roles = claims.get(CLAIM + "roles")
    names = [role for role in roles if isinstance(role, str)] if isinstance(roles, list) else []
    teacher = any(role.endswith(_TEACHING) for role in names)
    grades = _table(claims, GRADES)
    column = grades.get("lineitem") if SCORE_SCOPE in (grades.get("scope") or ()) else ""
    alias = claims.get("given_name")
    alias = alias if isinstance(alias, str) and alias.strip() else "Teacher" if teacher else "Student"
    custom = _table(claims, CLAIM + "custom")
    exercise, course = (
        text if isinstance(text := custom.get(name), str) else "" for name in ("exercise", "course")
    )
    return Launch(
        platform=platform,
        kind=kind,
        deployment=str(deployment),
        user=str(claims["sub"])[:255],
        alias=alias[:30],
        teacher=teacher,
        resource=str(resource.get("id", ""))[:255],
        title=str(resource.get("title") or "Class")[:80],
        exercise=exercise,
        course=course,
        grades=column if isinstance(column, str) else "",
        linking=_table(claims, LINKING),
    )


def _table(claims: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = claims.get(name)
    return value if isinstance(value, Mapping) else {}
