"""The viewer in frames of other pages: headers, cookies, oEmbed."""

from __future__ import annotations

import html
import re
from urllib.parse import quote

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError

from app.service.main import create_app
from app.service.web.access import COOKIE
from app.shared.settings import Settings

TOKEN = "correct horse battery"
SCHOOL = "https://school.example"


class Page:
    """Stands for the viewer."""

    def page(self) -> bytes:
        return b'<!doctype html><html><head><title>Viser</title><meta content="initial-scale=1"></head></html>'


def client_of(address: str = "http://testserver", **settings: object) -> TestClient:
    return TestClient(create_app(Settings(**settings)), base_url=address, follow_redirects=False)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def client() -> TestClient:
    return client_of(frame_ancestors=[SCHOOL, "http://*.lab.example:*"])


def test_without_the_setting_only_own_pages_may_frame() -> None:
    for path in ("/", "/api/v1/robots", "/viewer/"):
        headers = client_of().get(path).headers
        assert headers["content-security-policy"].endswith("; frame-ancestors 'self'")
        assert headers["x-frame-options"] == "SAMEORIGIN"


def test_listed_origins_may_frame(client: TestClient) -> None:
    for path in ("/", "/viewer/", "/login"):
        headers = client.get(path).headers
        directive = headers["content-security-policy"].rpartition("; ")[2]
        assert directive == "frame-ancestors 'self' https://school.example http://*.lab.example:*"
        assert "x-frame-options" not in headers, "it cannot name other origins"


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("https://School.example/", "https://school.example"),
        ("*", "*"),
        ("https://*.example:8443", "https://*.example:8443"),
        ("http://localhost:*", "http://localhost:*"),
    ],
)
def test_an_origin_of_the_setting_is_cleaned(given: str, kept: str) -> None:
    assert Settings(frame_ancestors=given).frame_ancestors == (kept,)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "wrong",
    ["school.example", "https://school.example/moodle", "'unsafe'", "https://a; script-src *", "ftp://a"],
)
def test_what_is_no_origin_is_refused(wrong: str) -> None:
    with pytest.raises(ValidationError, match=re.escape(repr(wrong)) + " is not an origin such as"):
        Settings(frame_ancestors=[wrong])  # type: ignore[arg-type]


def test_a_login_in_a_frame_lasts_only_below_the_same_site() -> None:
    client = client_of("https://testserver", token=TOKEN, frame_ancestors=SCHOOL)
    cookie = client.post("/login", data={"token": TOKEN}).headers["set-cookie"]
    for part in ("HttpOnly", "Secure", "SameSite=none", "Partitioned"):
        assert part in cookie
    plain = client_of("http://testserver", token=TOKEN, frame_ancestors=SCHOOL)
    assert "SameSite=lax" in plain.post("/login", data={"token": TOKEN}).headers["set-cookie"]


def test_a_cookie_alone_changes_nothing_for_pages_of_other_sites() -> None:
    client = client_of("https://testserver", token=TOKEN, frame_ancestors=SCHOOL)
    client.post("/login", data={"token": TOKEN})
    assert COOKIE in client.cookies
    path, body = "/api/v1/robots/pioneer5/fk", {"q": [0, 0, 0, 0, 0]}
    assert client.get("/api/v1/robots", headers={"origin": SCHOOL}).status_code == 200
    assert client.post(path, json=body, headers={"origin": SCHOOL}).status_code == 401
    assert client.post(path, json=body, headers={"origin": "https://testserver"}).status_code in (200, 422)
    sent = {"origin": SCHOOL, "authorization": f"Bearer {TOKEN}"}
    assert client.post(path, json=body, headers=sent).status_code in (200, 422)


def oembed(client: TestClient, link: str, more: str = ""):
    return client.get(f"/oembed?url={quote(link, safe='')}{more}")


def test_oembed_answers_the_frame_of_a_link(client: TestClient) -> None:
    answer = oembed(client, "http://testserver/viewer/#s=abc-_9&tab=Move").json()
    assert (answer["version"], answer["type"], answer["width"], answer["height"]) == ("1.0", "rich", 800, 500)
    source = html.unescape(re.search('src="([^"]*)"', answer["html"]).group(1))
    assert source == "http://testserver/viewer/?embed=panel#s=abc-_9&tab=Move"
    alone = oembed(client, "http://testserver/viewer?embed=1#s=abc").json()["html"]
    assert 'src="http://testserver/viewer/?embed=1#s=abc"' in alone


def test_oembed_keeps_to_the_size_asked_for(client: TestClient) -> None:
    answer = oembed(client, "http://testserver/viewer/", "&maxwidth=400&maxheight=4000").json()
    assert (answer["width"], answer["height"]) == (400, 500)
    assert 'width="400" height="500"' in answer["html"]
    for size in ("0", "199", "4097", "-5", "1e3", "99999999"):
        refused = oembed(client, "http://testserver/viewer/", f"&maxwidth={size}")
        assert refused.status_code == 422
        assert "maxwidth" in refused.json()["detail"]


@pytest.mark.parametrize(
    "link",
    [
        "",
        "http://elsewhere.example/viewer/",
        "http://testserver/",
        "http://testserver/viewer/more",
        "http://testserver@elsewhere.example/viewer/",
        "javascript:alert(1)//testserver/viewer/",
        'http://testserver/viewer/#s="onload=alert(1)',
        "http://testserver/viewer/?embed=all",
        "http://[testserver/viewer/",
        "http://testserver/viewer/#s=" + 20_000 * "a",
    ],
)
def test_oembed_answers_no_other_link(client: TestClient, link: str) -> None:
    answer = oembed(client, link)
    assert answer.status_code == 404
    assert "not a link to this viewer" in answer.json()["detail"]


def test_oembed_has_no_other_form(client: TestClient) -> None:
    assert oembed(client, "http://testserver/viewer/", "&format=xml").status_code == 501


def test_oembed_below_a_prefix() -> None:
    client = client_of(root_path="/arm")
    assert (
        "http://testserver/arm/viewer/?embed=panel"
        in oembed(client, "http://testserver/arm/viewer/").json()["html"]
    )
    assert oembed(client, "http://testserver/viewer/").status_code == 404


def test_the_page_names_its_oembed_answer() -> None:
    application = create_app(Settings())
    client = TestClient(application)
    bridge = next(r.endpoint.__self__ for r in application.routes if getattr(r, "path", "") == "/viewer/")
    bridge.viewer = Page()
    for name in ("testserver", "other.example", 'bad"name'):
        page = client.get("/viewer/", headers={"host": name}).text
        found = re.search('application/json\\+oembed" href="([^"]*)"', page)
        if '"' in name:
            assert found is None
        else:
            link = quote(f"http://{name}/viewer/", safe="")
            assert html.unescape(found.group(1)) == f"http://{name}/oembed?url={link}"
    for k in range(20):  # names may be forged: few pages are kept
        client.get("/viewer/", headers={"host": f"h{k}.example"})
    assert len(bridge._pages) <= 9
    assert "oembed" not in client.get("/viewer/", headers={"host": "h19.example"}).text
