"""Cookies of rooms and launches behind a proxy that ends TLS, in frames and without."""

from __future__ import annotations

from collections.abc import Iterator
from urllib.parse import parse_qs, urlsplit

import pytest
from fastapi.testclient import TestClient
from lti_platform import CLIENT, Platform, registered
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from app.service.main import create_app
from app.shared.store import Store

STORE = Store()
PROXY = "10.0.0.1"


@pytest.fixture(scope="module")
def platform() -> Iterator[Platform]:
    with Platform() as double:
        yield double


def cookies_of(tmp_path, platform: Platform, peer: str, framed: bool) -> tuple[list[str], str]:
    """The cookies of a room and of a login by LTI, and the address to which the platform sends the browser."""
    settings = registered(tmp_path, platform)
    application = create_app(settings if framed else settings.model_copy(update={"frame_ancestors": []}), STORE)
    proxied = ProxyHeadersMiddleware(application, trusted_hosts=[PROXY])
    browser = TestClient(
        proxied,
        base_url="http://kinboard.example",
        follow_redirects=False,
        client=(peer, 5),
        headers={"x-forwarded-proto": "https", "x-forwarded-for": "192.0.2.7"},
    )
    opened = browser.post("/room", data={"hours": "2"})
    begun = browser.get("/lti/login", params={"iss": platform.issuer, "client_id": CLIENT, "login_hint": "7"})
    application.state.classroom.close()
    asked = parse_qs(urlsplit(begun.headers["location"]).query)
    return [opened.headers["set-cookie"], begun.headers["set-cookie"]], asked["redirect_uri"][0]


@pytest.mark.parametrize("framed", [False, True])
def test_behind_a_trusted_proxy_cookies_are_secure(tmp_path, platform, framed) -> None:
    (room, launch), back = cookies_of(tmp_path, platform, PROXY, framed)
    assert back == "https://kinboard.example/lti/launch"
    for cookie, in_frames in ((room, framed), (launch, True)):
        assert "Secure" in cookie
        assert "HttpOnly" in cookie
        assert ("SameSite=none" in cookie) == ("Partitioned" in cookie) == in_frames
        assert ("SameSite=lax" in cookie) != in_frames


def test_the_header_of_anybody_else_does_not_count(tmp_path, platform) -> None:
    cookies, back = cookies_of(tmp_path, platform, "192.0.2.99", framed=True)
    assert back == "http://kinboard.example/lti/launch"
    for cookie in cookies:
        assert "Secure" not in cookie
        assert "SameSite=lax" in cookie, "browsers refuse SameSite=none without Secure"
