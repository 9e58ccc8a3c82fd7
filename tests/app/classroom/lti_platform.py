"""A learning platform for tests: signs launches, publishes its keys over real HTTP, gives tokens, keeps scores."""

from __future__ import annotations

import json
import threading
import time
from collections import Counter
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import jwt
from cryptography.hazmat.primitives.asymmetric import rsa
from fastapi.testclient import TestClient
from jwt.algorithms import RSAAlgorithm

from app.classroom.lti.launches import CLAIM, GRADES, LEARN, SCORE_SCOPE
from app.classroom.lti.platforms import key_file, load_platforms, make_key
from app.shared.settings import Settings

CLIENT = "kinboard-at-school"
MEMBER = "http://purl.imsglobal.org/vocab/lis/v2/membership"
TOOL = "https://testserver"


def new_key() -> rsa.RSAPrivateKey:
    return rsa.generate_private_key(65537, 2048)


def key_set(key: rsa.RSAPrivateKey) -> dict:
    return {
        "keys": [{**json.loads(RSAAlgorithm.to_jwk(key.public_key())), "kid": "p1", "alg": "RS256", "use": "sig"}]
    }


class Platform:
    """A learning platform: publishes its key, gives access tokens to who signs for them, keeps scores.

    Attributes:
        silent: beginnings of paths that get no answer until they are taken out again, or the platform is closed.
        asked: how often each path was asked for, and `at_once` how many requests were under way at most.
    """

    def __init__(self) -> None:
        self.key = new_key()
        self.tool_keys: dict = {}
        self.scores: list[tuple[str, dict]] = []
        self.refusals = 0  # answers 500 to so many scores
        self.redirects = 307  # of what is sent to /moved
        self.followed: list[str] = []  # what came after such a redirect
        self.published: str | None = None  # instead of the keys
        self.silent: set[str] = set()
        self.asked: Counter[str] = Counter()
        self.at_once = self._under_way = 0
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self.server = ThreadingHTTPServer(("127.0.0.1", 0), handler_of(self))
        self.issuer = f"http://127.0.0.1:{self.server.server_address[1]}"
        self.thread = threading.Thread(target=self.server.serve_forever)
        self.thread.start()

    def __enter__(self) -> Platform:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def row(self) -> str:
        """Its row in the file of platforms."""
        urls = {"login_url": "auth", "token_url": "token", "keys_url": "keys"}
        return (
            f'[[platform]]\nissuer = "{self.issuer}"\nclient_id = "{CLIENT}"\ndeployments = ["1", "2"]\n'
            + "".join(f'{name} = "{self.issuer}/{path}"\n' for name, path in urls.items())
        )

    def may_answer(self, path: str) -> bool:
        """Count a request, and wait while it gets no answer; False if it never does."""
        with self._lock:
            self.asked[path] += 1
            self._under_way += 1
            self.at_once = max(self.at_once, self._under_way)
        while any(path.startswith(each) for each in self.silent) and not self._closed.wait(0.01):
            pass
        with self._lock:
            self._under_way -= 1
        return not self._closed.is_set()

    def grant(self, form: dict[str, list[str]]) -> tuple[int, dict]:
        key = jwt.PyJWKSet.from_dict(self.tool_keys).keys[0].key
        claims = jwt.decode(form["client_assertion"][0], key, ["RS256"], audience=f"{self.issuer}/token")
        good = claims["iss"] == claims["sub"] == CLIENT and form["scope"] == [SCORE_SCOPE] and "jti" in claims
        return (200, {"access_token": "open-sesame"}) if good else (400, {})

    def token(
        self, nonce: object, key: rsa.RSAPrivateKey | None = None, key_id: str = "p1", **changes: object
    ) -> str:
        now = int(time.time())
        claims = {
            "iss": self.issuer,
            "aud": CLIENT,
            "sub": "user-7",
            "iat": now,
            "exp": now + 60,
            "nonce": nonce,
            "given_name": "Ada",
            "email": "ada@school.example",
            "name": "Ada Lovelace",
            CLAIM + "version": "1.3.0",
            CLAIM + "message_type": LEARN,
            CLAIM + "deployment_id": "1",
            CLAIM + "resource_link": {"id": "link-1", "title": "Week 3"},
            CLAIM + "roles": [f"{MEMBER}#Learner"],
            CLAIM + "custom": {"exercise": "two-elbows"},
            GRADES: {"scope": [SCORE_SCOPE], "lineitem": f"{self.issuer}/columns/5?type=x"},
        } | changes
        given = {k: v for k, v in claims.items() if v is not None}
        payload = json.dumps(given).encode()  # `jwt.encode` refuses what is odd
        return jwt.PyJWS().encode(payload, key or self.key, "RS256", {"kid": key_id})

    def close(self) -> None:
        self._closed.set()
        self.server.shutdown()
        self.thread.join()
        self.server.server_close()


def handler_of(platform: Platform) -> type[BaseHTTPRequestHandler]:
    """Answers what the platform is asked."""

    class Handler(BaseHTTPRequestHandler):
        def parse_request(self) -> bool:
            return super().parse_request() and platform.may_answer(self.path)

        def do_GET(self) -> None:
            if self.path.startswith("/elsewhere"):
                platform.followed.append(self.headers.get("authorization", ""))
            if self.path == "/keys" and platform.published is not None:
                self.send_response(200)
                self.end_headers()
                self.wfile.write(platform.published.encode())
                return
            self.answer(200, key_set(platform.key) if self.path == "/keys" else {})

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["content-length"]))
            if self.path == "/token":
                self.answer(*platform.grant(parse_qs(body.decode())))
            elif self.path.startswith("/moved"):
                self.send_response(platform.redirects)
                self.send_header("Location", f"{platform.issuer}/elsewhere")
                self.end_headers()
            elif self.path.startswith("/elsewhere"):
                platform.followed.append(self.headers.get("authorization", ""))
                self.answer(200, {})
            elif self.headers["authorization"] != "Bearer open-sesame":
                self.answer(401, {})
            elif platform.refusals:
                platform.refusals -= 1
                self.answer(500, {})
            else:
                platform.scores.append((self.path, json.loads(body)))
                self.answer(200, {})

        def answer(self, status: int, body: dict) -> None:
            self.send_response(status)
            self.end_headers()
            self.wfile.write(json.dumps(body).encode())

        def log_message(self, *_: object) -> None:
            pass

    return Handler


def registered(folder: Path, *platforms: Platform, **settings: object) -> Settings:
    """Settings of a service in which these platforms are registered, with its data in this folder."""
    file = folder / "platforms.toml"
    file.write_text("".join(each.row for each in platforms))
    assert make_key(key_file(file, {}))
    for each in platforms:
        each.tool_keys = load_platforms(file).key_set()
    frames = ",".join(each.issuer for each in platforms)
    return Settings(lti=file, data=folder / "data", frame_ancestors=frames, **settings)  # type: ignore[arg-type]


def login(browser: TestClient, platform: Platform) -> dict[str, str]:
    """The query with which the browser arrives at the platform."""
    answer = browser.get("/lti/login", params={"iss": platform.issuer, "client_id": CLIENT, "login_hint": "7"})
    assert answer.status_code == 303
    place = urlsplit(answer.headers["location"])
    assert f"{place.scheme}://{place.netloc}{place.path}" == f"{platform.issuer}/auth"
    return {name: values[0] for name, values in parse_qs(place.query).items()}


def launch(browser: TestClient, platform: Platform, **changes: object):
    asked = login(browser, platform)
    token = platform.token(**{"nonce": asked["nonce"], **changes})  # type: ignore[arg-type]
    return browser.post("/lti/launch", data={"id_token": token, "state": asked["state"]})
