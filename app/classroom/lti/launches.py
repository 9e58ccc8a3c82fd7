"""Logins and launches: what a platform sends through its user's browser, verified (OpenID Connect, LTI 1.3).

1. The platform sends the browser to our login address. `Logins.begin` answers with the platform's address, a
   signed state and a nonce; the browser keeps the state in a cookie.
2. The platform posts a signed token and the state. `Logins.finish` verifies both, and `Logins.use` uses up the
   nonce.

That a token is signed says who wrote it, not that it makes sense: each claim is checked before it is used.
"""

from __future__ import annotations

import hmac
import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

import jwt
from itsdangerous import BadSignature, SignatureExpired, TimestampSigner, URLSafeTimedSerializer

from app.classroom.clock import now
from app.classroom.lti.keys import PlatformKeys
from app.classroom.lti.platforms import Platform, Platforms, is_safe

CLAIM = "https://purl.imsglobal.org/spec/lti/claim/"
GRADES = "https://purl.imsglobal.org/spec/lti-ags/claim/endpoint"
LINKING = "https://purl.imsglobal.org/spec/lti-dl/claim/deep_linking_settings"
SCORE_SCOPE = "https://purl.imsglobal.org/spec/lti-ags/scope/score"
LEARN, LINK = "LtiResourceLinkRequest", "LtiDeepLinkingRequest"
_TEACHING = ("#Instructor", "#TeachingAssistant", "#ContentDeveloper", "#Administrator")
LOGIN_TIME = 600  # seconds from the login to the launch
CLOCKS = 30  # seconds by which clocks may differ
MAX_TOKEN = 64 * 1024  # characters
LONGEST_ID, LONGEST_TEXT, LONGEST_ADDRESS = 255, 500, 2000  # characters of claims
LONGEST_DATA = 16_000  # characters of what a platform wants back


class LaunchRefused(Exception):  # noqa: N818 - a finding, with a sentence for the page
    """A login or a launch is not valid; the message says why."""


@dataclass(frozen=True)
class Launch:
    """A verified launch.

    Attributes:
        kind: `LEARN` or `LINK`.
        user: the platform's opaque id of its user.
        alias: a first name as the platform tells it, or empty.
        teacher: whether the user teaches here.
        resource, title: id of the link within the deployment, and its title as the platform tells it, or empty.
        exercise, course: what the link names, not checked; empty: nothing.
        grades: the address of the column for scores, if we may write there; empty: none.
        back, data, many: of a deep linking request: where the answer goes, what it repeats, and whether several
            contents may be chosen.
        nonce: which counts once.
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
    back: str
    data: str | None
    many: bool
    nonce: str


class _Signer(TimestampSigner):
    """Dates states by the time of rooms: a clock that is set back does not make an old state valid again."""

    def get_timestamp(self) -> int:
        return int(now())


class Logins:
    """Begins and finishes launches.

    Args:
        key: signs states; the same in all processes.
        use_nonce: called once with each valid nonce and when it expires, in the time of rooms; False: used before.
    """

    def __init__(self, platforms: Platforms, key: str, use_nonce: Callable[[str, float], bool]) -> None:
        self._platforms = platforms
        self._states = URLSafeTimedSerializer(key, salt="kinboard.lti.state", signer=_Signer)
        self._use_nonce = use_nonce
        self._keys = {each.keys_url: PlatformKeys(each) for each in platforms.all}

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

    async def finish(self, token: str, state: str, cookie: str) -> Launch:
        """The launch of a signed token, whose nonce is still to be used up; waits for the platform's keys.

        Raises:
            LaunchRefused: the launch is not valid.
            PlatformAway: the platform does not give its keys.
        """
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
        if not token or len(token) > MAX_TOKEN:
            raise LaunchRefused("The launch has no token.")
        key = await self._keys[platform.keys_url].find(_key_id(token))
        if key is None:
            raise LaunchRefused("The launch is signed with a key that the platform does not publish.")
        claims = Claims(_verified(token, key, platform))
        if claims.text("nonce", LONGEST_ID) != nonce:
            raise LaunchRefused("The nonce of the launch is not the one of its login.")
        return _launch(claims, platform, nonce)

    def use(self, launch: Launch) -> None:
        """Use up the nonce of a launch; raises `LaunchRefused`, or `ClassroomUnavailable`."""
        if not self._use_nonce(launch.nonce, now() + LOGIN_TIME + CLOCKS):
            raise LaunchRefused("This launch was used before. Start it again on the platform.")


_UNSTORABLE = re.compile("[\0\ud800-\udfff]")
# What Python raises for JSON that is no token: nested without end, numbers without end, half letters.
_NO_TOKEN = (ValueError, TypeError, AttributeError, OverflowError, RecursionError)


def _key_id(token: str) -> str:
    """The id of the key that a token claims to be signed with; raises `LaunchRefused`."""
    try:
        found = jwt.get_unverified_header(token).get("kid")
    except (jwt.PyJWTError, *_NO_TOKEN):
        raise LaunchRefused("The token of the launch is not valid: its header cannot be read.") from None
    if not isinstance(found, str) or not 0 < len(found) <= LONGEST_ID:
        raise LaunchRefused("The token of the launch does not name its key (kid).")
    return found


def _verified(token: str, key: jwt.PyJWK, platform: Platform) -> dict[str, Any]:
    """The claims of a token whose signature, time, audience and issuer are right; raises `LaunchRefused`."""
    try:
        required = ["iss", "aud", "exp", "iat", "nonce", "sub"]
        claims: dict[str, Any] = jwt.decode(
            token,
            key,
            algorithms=["RS256"],
            audience=platform.client_id,
            issuer=platform.issuer,
            leeway=CLOCKS,
            options={"require": required},
        )
    except jwt.ExpiredSignatureError:
        raise LaunchRefused("The launch has expired. Start it again on the platform.") from None
    except jwt.InvalidAudienceError:
        raise LaunchRefused("The launch is for another tool: its client id is not ours.") from None
    except jwt.InvalidIssuerError:
        raise LaunchRefused("The launch is of another platform than its login.") from None
    except jwt.InvalidSignatureError:
        raise LaunchRefused("The signature of the launch is not the platform's.") from None
    except jwt.PyJWTError as error:
        raise LaunchRefused(f"The token of the launch is not valid: {error}.") from None
    except _NO_TOKEN:
        raise LaunchRefused("The token of the launch is not valid: its claims cannot be read.") from None
    if isinstance(claims["aud"], list) and len(claims["aud"]) > 1 and claims.get("azp") != platform.client_id:
        raise LaunchRefused("The launch is for another tool: its authorized party is not us.")
    return claims


class Claims:
    """The claims of a token, or a table within them; each is checked when it is read.

    Args:
        where: the name of the table.
    """

    def __init__(self, values: Mapping[str, Any], where: str = "") -> None:
        self._values = values
        self._where = where

    def __contains__(self, name: str) -> bool:
        return self._values.get(name) is not None

    def text(self, name: str, longest: int, default: str | None = None) -> str:
        """A text that can be stored; without a default, it must be there and not be empty."""
        value = self._values.get(name)
        if value is None and default is not None:
            return default
        if not isinstance(value, str):
            raise self._refused(name, value, "a text")
        if len(value) > longest:
            raise self._refused(name, value, f"at most {longest} characters long")
        if _UNSTORABLE.search(value):
            raise self._refused(name, value, "a text without NUL and without halves of surrogate pairs")
        if not value.strip() and default is None:
            raise self._refused(name, value, "a text that is not empty")
        return value

    def address(self, name: str, default: str | None = None) -> str:
        """An address to which something secret may be sent."""
        value = self.text(name, LONGEST_ADDRESS, default)
        if value != default and not is_safe(value):
            raise self._refused(name, value, "an address with https://, in ASCII")
        return value

    def texts(self, name: str) -> list[str]:
        """A list of texts; one that is missing is empty."""
        value = self._values.get(name)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            raise self._refused(name, value, "a list of texts")
        return value

    def truth(self, name: str, default: bool) -> bool:
        """True or false."""
        value = self._values.get(name)
        if not isinstance(value, bool | None):
            raise self._refused(name, value, "true or false")
        return default if value is None else value

    def table(self, name: str) -> Claims:
        """A table; one that is missing is empty."""
        value = self._values.get(name)
        if not isinstance(value, dict | None):
            raise self._refused(name, value, "an object")
        return Claims(value or {}, self._named(name))

    def _named(self, name: str) -> str:
        return f"{self._where}.{name}" if self._where else name

    def _refused(self, name: str, value: object, valid: str) -> LaunchRefused:
        given = "is missing" if value is None else f"is {shown(value)}"
        return LaunchRefused(f"The claim {self._named(name)} of the launch {given}; it must be {valid}.")


def shown(value: object) -> str:
    """A value of a stranger's, in ASCII and short."""
    text = ascii(value)
    return text if len(text) <= 100 else f"{text[:100]}…"


def _launch(claims: Claims, platform: Platform, nonce: str) -> Launch:
    """What the claims say; raises `LaunchRefused`."""
    if claims.text(CLAIM + "version", LONGEST_ID, "") != "1.3.0":
        raise LaunchRefused("The launch is not of LTI version 1.3.0.")
    deployment = claims.text(CLAIM + "deployment_id", LONGEST_ID)
    if deployment not in platform.deployments:
        raise LaunchRefused(f"The deployment {shown(deployment)} of the platform is not registered here.")
    kind = claims.text(CLAIM + "message_type", LONGEST_ID)
    if kind not in (LEARN, LINK):
        raise LaunchRefused(f"Messages of type {shown(kind)} are not understood; {LEARN} and {LINK} are.")
    resource = claims.table(CLAIM + "resource_link")
    teacher = any(role.endswith(_TEACHING) for role in claims.texts(CLAIM + "roles"))
    grades, custom, linking = claims.table(GRADES), claims.table(CLAIM + "custom"), claims.table(LINKING)
    column = grades.address("lineitem", "") if SCORE_SCOPE in grades.texts("scope") else ""
    return Launch(
        platform=platform,
        kind=kind,
        deployment=deployment,
        user=claims.text("sub", LONGEST_ID),
        alias=claims.text("given_name", MAX_TOKEN, ""),
        teacher=teacher,
        resource=resource.text("id", LONGEST_ID) if kind == LEARN else "",
        title=resource.text("title", MAX_TOKEN, ""),
        exercise=custom.text("exercise", LONGEST_TEXT, ""),
        course=custom.text("course", LONGEST_TEXT, ""),
        grades=column,
        back=linking.address("deep_link_return_url") if kind == LINK else "",
        data=linking.text("data", LONGEST_DATA) if kind == LINK and "data" in linking else None,
        many=linking.truth("accept_multiple", True),
        nonce=nonce,
    )
