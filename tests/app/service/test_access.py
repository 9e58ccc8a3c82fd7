"""Authentication, read-only access and rate limits. Half of these tests are attempted intrusions."""

from __future__ import annotations

import importlib
import json
import math
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx2
import pytest
import viser
from fake_browser import FakeBrowser
from fastapi.testclient import TestClient
from itsdangerous.encoding import base64_encode, int_to_bytes
from live_server import serve, wait_for
from starlette.websockets import WebSocketDisconnect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

import app.service.web.access as access
import kin
from app.service.main import create_app
from app.service.web.access import COOKIE
from app.service.web.inspection import ALLOWED
from app.service.web.rate_limit import TokenBucket
from app.shared.clients import client_of
from app.shared.security import Rights
from app.shared.settings import Settings
from app.viewer.own_arm import own_arm
from app.viewer.session.choices import ViewState
from app.viewer.session.events import MESSAGES
from app.viewer.session.state import KEY_REPLACE, PageState, encode

TOKEN = "correct horse battery"
HEADER = {"authorization": f"Bearer {TOKEN}"}
PAGE = {"accept": "text/html"}
VISER = Subprotocol(f"viser-v{viser.__version__}")
PIONEER = kin.get_robot("pioneer5")
ARM = "/api/v1/robots/pioneer5"
FK = f"{ARM}/fk"
Q = {"q": [0, 0, 0, 0, 0]}


def client_with(**settings: object) -> TestClient:
    return TestClient(
        create_app(Settings(**settings)),  # type: ignore[arg-type]
        raise_server_exceptions=False,
        follow_redirects=False,
    )


@pytest.fixture(scope="module")
def application():
    return create_app(Settings(token=TOKEN))  # type: ignore[arg-type]


@pytest.fixture
def guarded(application):
    # Each test is a new client: wrong tokens in one test do not count in the next.
    global _next
    _next += 1
    return TestClient(
        application, raise_server_exceptions=False, follow_redirects=False, client=(f"10.1.0.{_next}", 5000)
    )


_next = 0


def test_without_a_configured_token_everything_is_allowed():
    client = client_with()
    assert client.post(FK, json=Q).status_code == 200
    assert client.get("/", headers=PAGE).status_code == 200
    assert client.get("/login?next=docs").headers["location"] == "./docs"


@pytest.mark.parametrize(
    "path", ["/api/v1/robots", FK, "/docs", "/openapi.json", "/viewer/", "/", "/no-such-thing"]
)
def test_with_a_configured_token_requests_without_it_are_refused(guarded, path):
    answer = guarded.get(path)
    assert answer.status_code == 401
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["www-authenticate"].startswith("Bearer")
    assert answer.headers["cache-control"] == "no-store"
    assert answer.json()["type"] == "urn:kinboard:problem:unauthorized"


@pytest.mark.parametrize("path", ["/livez", "/static/landing.css", "/login", "/favicon.ico"])
def test_health_and_the_login_page_stay_open(guarded, path):
    assert guarded.get(path).status_code in (200, 307)


@pytest.mark.parametrize(
    "path",
    [
        "/static/../api/v1/robots",
        "/static/%2e%2e/api/v1/robots",
        "/static/..%2fapi/v1/robots",
        "/login/../api/v1/robots",
        "//api/v1/robots",
        "/livez/../api/v1/robots",
        "/API/v1/robots",
        "/login;/api/v1/robots",
        "/livez%00/../../api/v1/robots",
    ],
)
def test_no_spelling_of_an_address_bypasses_the_token(guarded, path):
    assert "pioneer5" not in guarded.get(path).text


def test_the_token_is_accepted_in_the_header(guarded):
    assert guarded.post(FK, json=Q, headers=HEADER).status_code == 200
    assert guarded.post(FK, json=Q, headers={"authorization": f"bearer  {TOKEN} "}).status_code == 200


@pytest.mark.parametrize(
    "value",
    [
        "Bearer",
        "Bearer ",
        f"Basic {TOKEN}",
        TOKEN,
        "Bearer correct horse",
        f"Bearer {TOKEN}x",
        "Bearer \xe9",
        "Bearer null",
    ],
)
def test_any_other_header_is_refused(guarded, value):
    answer = guarded.post(FK, json=Q, headers={"authorization": value.encode("latin-1")})
    assert answer.status_code == 401


@pytest.fixture
def hurried(monkeypatch):
    """Checks that are slow take no second."""
    monkeypatch.setattr(access, "CHECK_TIME", 0.01)


def test_guessing_tokens_is_rate_limited_and_locks_no_one_out(guarded, application, hurried):
    wrong = {"authorization": "Bearer guess"}
    codes = [guarded.get("/api/v1/robots", headers=wrong).status_code for _ in range(8)]
    assert codes == [401] * access.TRIES + [429] * 3
    late = guarded.get("/api/v1/robots", headers=wrong)
    assert late.status_code == 429
    assert 1 <= int(late.headers["retry-after"]) <= access.TRY_EVERY
    assert guarded.get("/api/v1/robots", headers=HEADER).status_code == 200
    other = TestClient(application, client=("10.9.9.9", 1))
    assert other.get("/api/v1/robots", headers=HEADER).status_code == 200


def test_guesses_are_slow_and_only_few_are_checked_at_a_time(guarded, monkeypatch):
    monkeypatch.setattr(access, "CHECK_TIME", 0.5)
    wrong = {"authorization": "Bearer guess"}
    for _ in range(access.TRIES):
        guarded.get("/api/v1/robots", headers=wrong)

    def ask(headers: dict[str, str]) -> tuple[int, float]:
        began = time.monotonic()
        return guarded.get("/api/v1/robots", headers=headers).status_code, time.monotonic() - began

    with ThreadPoolExecutor(20) as pool:
        answers = list(pool.map(ask, [wrong] * 20))
    assert {status for status, _ in answers} == {429}
    slow = [seconds for _, seconds in answers if seconds >= 0.5]
    assert len(slow) <= access.CHECKS + 1
    status, seconds = ask(HEADER)
    assert status == 200
    assert seconds >= 0.5


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_a_token_may_have_letters_beyond_ascii(encoding):
    client = client_with(token="größe genügt")
    given = "Bearer größe genügt".encode(encoding)
    assert client.get("/api/v1/robots", headers={"authorization": given}).status_code == 200
    assert client.post("/login", data={"token": "größe genügt"}).status_code == 303


def test_a_browser_logs_in_once_and_is_redirected_to_the_requested_page(guarded):
    sent = guarded.get("/docs", headers=PAGE)
    assert (sent.status_code, sent.headers["location"]) == (303, "login?next=docs")
    page = guarded.get("/login?next=docs")
    assert 'action="login?next=docs"' in page.text
    assert "content-security-policy" in page.headers
    answer = guarded.post("/login?next=docs", data={"token": TOKEN})
    assert (answer.status_code, answer.headers["location"]) == (303, "./docs")
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    assert TOKEN not in cookie
    assert guarded.get("/docs", headers=PAGE).status_code == 200
    assert guarded.post(FK, json=Q).status_code == 200


def test_the_redirect_to_the_login_page_is_relative(guarded):
    assert guarded.get("/viewer/", headers=PAGE).headers["location"] == "../login?next=viewer/"


def test_a_wrong_token_is_refused(guarded, hurried):
    answer = guarded.post("/login", data={"token": "<script>"})
    assert answer.status_code == 401
    assert "The access token is wrong." in answer.text
    assert "set-cookie" not in answer.headers
    assert [guarded.post("/login", data={"token": "no"}).status_code for _ in range(6)][-1] == 429
    assert guarded.post("/login", data={"token": TOKEN}).status_code == 303


@pytest.mark.parametrize(
    "place",
    [
        "//evil.example",
        "https://evil.example",
        "/\\evil.example",
        "\\\\evil",
        "javascript:alert(1)",
        "a//b",
        "x\nSet-Cookie: a=b",
        "/etc",
    ],
)
def test_the_login_page_redirects_to_no_other_site(guarded, place):
    answer = guarded.post("/login", params={"next": place}, data={"token": TOKEN})
    assert answer.headers["location"] == "./"


def test_a_form_that_is_too_large_is_not_read(guarded):
    assert guarded.post("/login", data={"token": "x" * 10_000}).status_code == 413


@pytest.mark.parametrize("forge", ["later", "unsigned", "empty", "dots", "huge", "nonsense"])
def test_a_cookie_with_a_wrong_signature_is_refused(guarded, forge):
    guarded.post("/login", data={"token": TOKEN})
    text, _, signature = guarded.cookies[COOKIE].rpartition(".")
    later = base64_encode(int_to_bytes(int(time.time()) + 60)).decode()
    guarded.cookies.clear()
    value = {
        "later": f"visitor.{later}.{signature}",
        "unsigned": f"{text}.",
        "empty": "",
        "dots": "." * 50,
        "huge": f"visitor.{'z' * 400}.{signature}",
        "nonsense": "\x7f[]",
    }[forge]
    answer = guarded.get("/api/v1/robots", headers={"cookie": f"{COOKIE}={value}"})
    assert answer.status_code == 401


def test_a_cookie_expires(guarded, monkeypatch):
    guarded.post("/login", data={"token": TOKEN})
    assert guarded.get("/api/v1/robots").status_code == 200
    after = time.time() + access.COOKIE_AGE + 10
    monkeypatch.setattr(time, "time", lambda: after)
    cookie = {"cookie": f"{COOKIE}={guarded.cookies[COOKIE]}"}
    assert guarded.get("/api/v1/robots", headers=cookie).status_code == 401


def test_a_cookie_of_another_token_is_refused(guarded):
    other = client_with(token="another token")
    other.post("/login", data={"token": "another token"})
    cookie = {"cookie": f"{COOKIE}={other.cookies[COOKIE]}"}
    assert other.get("/api/v1/robots", headers=cookie).status_code == 200
    assert guarded.get("/api/v1/robots", headers=cookie).status_code == 401


def test_the_cookie_is_secure_over_https(application):
    client = TestClient(
        application, base_url="https://kin.example", client=("10.8.8.8", 1), follow_redirects=False
    )
    assert "secure" in client.post("/login", data={"token": TOKEN}).headers["set-cookie"].lower()


def test_login_works_below_a_path_prefix(application):
    client = client_with(token=TOKEN, root_path="/arm")
    sent = client.get("/arm/viewer/", headers=PAGE)
    assert sent.headers["location"] == "../login?next=viewer/"
    answer = client.post("/arm/login", data={"token": TOKEN})
    assert "path=/arm/" in answer.headers["set-cookie"].lower()
    assert client.get("/arm/api/v1/robots", headers=HEADER).status_code == 200


@pytest.mark.parametrize("path", ["/viewer", "/viewer/", "/viewer/channel"])
def test_a_websocket_needs_the_token_too(guarded, path):
    with pytest.raises(WebSocketDisconnect) as refused, guarded.websocket_connect(path):
        pass
    assert refused.value.code == 1008


@pytest.mark.full
def test_a_logged_in_browser_gets_a_viewer():
    application = create_app(Settings(token=TOKEN))  # type: ignore[arg-type]
    with serve(application) as port:
        address = f"ws://127.0.0.1:{port}/viewer"
        with pytest.raises(InvalidStatus, match="403"):
            connect(address)
        wait_for(lambda: application.state.startup.status == "ready", 300)
        with connect(address, additional_headers=HEADER, subprotocols=[VISER]) as socket:
            assert socket.subprotocol == VISER


# Read-only


def test_read_only_serves_reads_and_refuses_computations():
    client = client_with(read_only=True)
    assert client.get("/metrics").status_code == 403
    assert client.get("/", headers=PAGE).status_code == 200
    assert client.get("/api/v1/robots").status_code == 200
    for answer in (client.post(FK, json=Q), client.get(f"{ARM}/workspace"), client.get(f"{ARM}/capability")):
        assert answer.status_code == 403
        assert answer.json()["type"] == "urn:kinboard:problem:read-only"
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/api/v1/robots/pioneer5/workspace/stream"):
        pass


def test_read_only_does_not_restrict_clients_with_the_token():
    client = client_with(read_only=True, token=TOKEN)
    assert client.get("/api/v1/robots").status_code == 200
    assert client.post(FK, json=Q).status_code == 403
    assert client.post(FK, json=Q, headers=HEADER).status_code == 200
    assert client.get("/api/v1/robots", headers={"authorization": "Bearer wrong"}).status_code == 401


@pytest.mark.full
def test_a_read_only_visitor_sees_the_arm_of_a_link_and_cannot_move_it():
    application = create_app(Settings(read_only=True))
    own = own_arm({**kin.robot_to_dict(PIONEER), "name": "Bob's arm"})
    state = encode(PageState(own.robot.id, own=own, view=ViewState(frames=True)))
    memory = json.dumps({"state": state, "text": "Projector"})
    with serve(application) as port:
        wait_for(lambda: application.state.startup.status == "ready", 300)
        with FakeBrowser(port, path="/viewer", memory=memory) as tab:
            tab.settle()
            assert tab.value("Link frames") is True
            assert tab.value("Robot") == "My arm (Bob's arm)"
            assert "You may look" in tab.html
            assert "data-hints" not in tab.html, "no hint asks to drag what cannot be dragged"
            assert tab.nodes["/key-number"]["props"]["font_screen_scale"] == pytest.approx(1.7)
            tab.say("text-size", "Large")
            tab.wait(lambda: tab.nodes["/key-number"]["props"]["font_screen_scale"] == pytest.approx(1.3))
            before, gizmo = tab.tool_pose(), tab.nodes[tab.gizmo]["props"]
            assert (any(gizmo["active_axes"]), gizmo["disable_rotations"]) == (False, True), "nor drag it"
            assert not [name for name in tab.nodes if name.startswith(f"{tab.gizmo}/ring")]
            assert not tab.gui[tab.element("Arrows along")]["props"]["visible"]
            assert not tab.commands, "nor does the palette offer anything"
            tab.send("CommandTriggerMessage", uuid="guessed")
            tab.say("feature", ["robot", ["start"], "planar-2r"])
            tab.set("1 rotating base", 10.0)
            tab.drag(position=(0.1, 0.1, 0.1))
            tab.set("Robot", "UR5e")
            tab.set("Radians", True)
            tab.wait(lambda: tab.value("1 rotating base") == pytest.approx(math.pi / 2, abs=1e-3))
            tab.settle()
            assert (tab.tool_pose() == before).all()
            tab.wait(lambda: bool(tab.kept_as))
            assert set(tab.kept_as) == {KEY_REPLACE}, "the page cannot go back to another entry"


@pytest.mark.full
@pytest.mark.parametrize("everything", [False, True])
def test_a_link_makes_the_service_compute_for_those_who_may(everything, monkeypatch):
    """The same link: a visitor with all rights gets a cloud, sizes, a map and a target; a read-only one none."""
    work = []
    for name, place in (
        ("cloud", "app.shared.clouds.workspace_slice"),
        ("map", "app.shared.maps.capability_grid"),
        ("sizes", "app.shared.summaries.workspace_facts"),
        ("target", "app.viewer.page.controller.solve"),
    ):
        monkeypatch.setattr(place, counted(name, place, work))
    target = kin.fk(PIONEER, PIONEER.q_home)
    target[2, 3] += 0.02
    workspace = {"n": 1000, "sizes": True, "drawn": True, "capability": {"resolution": 15, "drawn": True}}
    state = PageState("pioneer5", q=PIONEER.q_home, target=target, features={"workspace": workspace})
    memory = json.dumps({"state": encode(state)})
    application = create_app(Settings(read_only=not everything))
    with serve(application) as port:
        wait_for(lambda: application.state.startup.status == "ready", 300)
        with FakeBrowser(port, path="/viewer", memory=memory) as tab:
            tab.settle()
            if everything:
                wait_for(lambda: set(work) == {"cloud", "map", "sizes", "target"}, 60)
            else:
                time.sleep(1.0)
                assert not work
                assert tab.tool_pose()[:3, 3] == pytest.approx(kin.fk(PIONEER, PIONEER.q_home)[:3, 3], abs=1e-4)


def counted(name, place, work):
    """The function at a place, which also notes that it was called."""
    module, _, attribute = place.rpartition(".")
    function = getattr(importlib.import_module(module), attribute)

    def call(*arguments, **options):
        work.append(name)
        return function(*arguments, **options)

    return call


def test_the_rights_of_a_visitor_who_may_only_look():
    look, full = Rights.LOOK, Rights.FULL
    for method, path in (
        ("POST", "/api/v1/robots/pioneer5/fk"),
        ("GET", "/api/v1/robots/pioneer5/workspace/summary"),
        ("HEAD", "/api/v1/robots/pioneer5/capability"),
        ("GET", "/metrics"),
    ):
        assert full.allow_request(method, path)
        assert not look.allow_request(method, path)
    assert look.allow_request("GET", "/viewer/")
    assert look.allow_websocket("/viewer")
    assert look.allow_websocket("/viewer/")
    assert look.allow_websocket("/viewer/channel")
    assert not look.allow_websocket("/viewer-elsewhere")
    for path in ("/viewer/channels", "/viewer/channel/", "/viewer/channel/x"):
        assert not look.allow_websocket(path)
    assert not look.allow_websocket("/api/v1/robots/pioneer5/workspace/stream")
    known = {kind for kind in ALLOWED if look.allow_message(kind)}
    assert known == {"ViewerCameraMessage", "LocalStorageGetItemResponseMessage", "GuiUpdateMessage"}
    assert [name for name in MESSAGES if look.allow_message(name)] == [
        "frame",
        "text-size",
        "system-dark",
        "fit-arm",
        "look-from",
    ]
    assert all(map(full.allow_message, MESSAGES))


# Rate limits


def test_too_many_requests_get_a_429_with_retry_after():
    client = client_with(rate_limit=0.2)  # one request in 5 s, after the first two
    answers = [client.get("/api/v1/robots") for _ in range(12)]
    codes = [answer.status_code for answer in answers]
    assert codes[:2] == [200, 200]
    assert codes[-1] == 429
    answer = answers[-1]
    assert 1 <= int(answer.headers["retry-after"]) <= 5
    assert answer.json()["type"] == "urn:kinboard:problem:too-many-requests"
    assert client.get("/livez").status_code == 200


def test_the_requests_of_ten_seconds_may_come_at_once_as_documented():
    row = next(
        line
        for line in (Path(__file__).parents[3] / "docs/limits.md").read_text().splitlines()
        if "KINBOARD_RATE_LIMIT" in line
    )
    assert "those of ten seconds may come at once, so a limit of 2 lets 20 through" in row
    client = client_with(rate_limit=2.0)
    statuses = [client.get("/api/v1/robots/ur5").status_code for _ in range(60)]
    assert statuses[:20] == [200] * 20
    assert statuses[20:].count(429) > 20


def test_a_bucket_fills_up_again_and_forgets_the_oldest(monkeypatch):
    now = [0.0]
    bucket = TokenBucket(2.0, 3.0, lambda: now[0])
    for _ in range(3):
        assert bucket.wait("a") == 0.0
        bucket.take("a")
    assert bucket.wait("a") == pytest.approx(0.5)
    assert bucket.wait("b") == 0.0
    now[0] = 0.5
    assert bucket.wait("a") == 0.0
    now[0] = 100.0
    bucket.take("a")
    assert bucket.wait("a") == 0.0  # two of three remain, however long the pause
    monkeypatch.setattr(TokenBucket, "MAX_CLIENTS", 5)
    for name in "bcdefgh":
        bucket.take(name)
    assert len(bucket._tokens) == 5


@pytest.mark.parametrize(
    ("host", "client"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("testclient", "testclient"),
    ],
)
def test_a_budget_belongs_to_an_address_or_network(host, client):
    assert client_of({"client": (host, 1)}) == client


def test_other_origins_read_answers_only_if_configured():
    asking = {"origin": "https://school.example"}
    assert "access-control-allow-origin" not in client_with().get("/api/v1/robots", headers=asking).headers
    client = client_with(cors_origins=("https://school.example",), token=TOKEN)
    preflight = client.options(FK, headers=asking | {"access-control-request-method": "POST"})
    assert preflight.status_code == 200
    assert preflight.headers["access-control-allow-origin"] == "https://school.example"
    refused = client.options(
        FK, headers={"origin": "https://evil.example", "access-control-request-method": "POST"}
    )
    assert "access-control-allow-origin" not in refused.headers
    assert refused.status_code == 403
    answer = client.post(FK, json=Q, headers=asking | HEADER)
    assert answer.headers["access-control-allow-origin"] == "https://school.example"


@pytest.mark.parametrize("allowed", [(), ("https://school.example",)])
def test_a_page_of_another_origin_gets_the_name_of_the_setting_that_would_let_it_in(allowed):
    client = client_with(cors_origins=allowed, token=TOKEN)
    asking = {"origin": "https://other.example", "access-control-request-method": "POST"}
    refused = client.options(FK, headers=asking)
    assert refused.status_code == 403
    assert refused.headers["content-type"] == "application/problem+json"
    assert "https://other.example may not read" in refused.json()["detail"]
    assert "KINBOARD_CORS_ORIGINS" in refused.json()["hint"]
    assert "access-control-allow-origin" not in refused.headers
    long = client.options(FK, headers=asking | {"origin": "https://" + 3000 * "x"})
    assert len(long.content) < 1000
    # What is no preflight is answered as before.
    assert client.options(FK, headers={"origin": "https://other.example"} | HEADER).status_code == 405
    assert client_with(cors_origins=("*",)).options(FK, headers=asking).status_code == 200


def test_a_short_token_is_refused_at_start():
    with pytest.raises(ValueError, match="8"):
        Settings(token="short")  # type: ignore[arg-type]


# Hosts


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("localhost", 200),
        ("LOCALHOST:8000", 200),
        ("localhost.", 200),
        ("robots.localhost:80", 200),
        ("127.0.0.1:8000", 200),
        ("192.0.2.7", 200),
        ("[::1]:8000", 200),
        ("arm.example", 200),
        ("evil.example", 421),
        ("evil.example:8000", 421),
        ("localhost.evil.example", 421),
        ("127.0.0.1.evil.example", 421),
        ("", 421),
        ("[", 421),
        ("\xff", 421),
    ],
)
def test_a_request_for_another_host_is_refused(host, status):
    client = client_with(allowed_hosts=("localhost", "arm.example"))
    answer = client.get("/livez", headers={"host": host.encode("latin-1")})
    assert answer.status_code == status
    if status == 421:
        assert answer.json()["type"] == "urn:kinboard:problem:wrong-host"
        assert "KINBOARD_ALLOWED_HOSTS" in answer.json()["hint"]


@pytest.mark.parametrize("allowed", [(), ("*",), ("*", "arm.example")])
def test_without_names_or_with_an_asterisk_any_host_is_accepted(allowed):
    assert client_with(allowed_hosts=allowed).get("/livez", headers={"host": "a.example"}).status_code == 200


def test_a_websocket_for_another_host_is_refused():
    client = client_with(allowed_hosts=("localhost",))
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/viewer", headers={"host": "evil.example"}):
        pass


# Proxies


@pytest.mark.full
def test_a_client_cannot_choose_its_address():
    """Wrong tokens count for the address of the connection, whatever the header says."""
    application = create_app(Settings(token=TOKEN))  # type: ignore[arg-type]
    with serve(application) as port:
        codes = [asked_as(port, f"10.0.0.{k}") for k in range(access.TRIES + 1)]
    assert codes == [401] * access.TRIES + [429]


@pytest.mark.full
def test_a_trusted_proxy_names_the_client(monkeypatch):
    monkeypatch.setattr(access, "TRY_EVERY", 3600.0)  # on a busy machine the tries may take ten seconds
    settings = Settings(token=TOKEN, trusted_proxies=("127.0.0.0/8",))  # type: ignore[arg-type]
    with serve(create_app(settings), settings) as port:
        codes = [asked_as(port, f"10.0.0.{k}") for k in range(access.TRIES + 1)]
        assert codes == [401] * (access.TRIES + 1)
        again = [asked_as(port, "192.0.2.1, 10.0.0.77, 127.0.0.9") for _ in range(access.TRIES + 1)]
        assert again[-1] == 429
        assert asked_as(port, "192.0.2.1") == 401


def asked_as(port: int, forwarded: str) -> int:
    headers = {"authorization": "Bearer wrong", "x-forwarded-for": forwarded}
    answer = httpx2.get(f"http://127.0.0.1:{port}/api/v1/robots", headers=headers, trust_env=False)
    return answer.status_code


def test_an_unknown_proxy_is_logged_once(caplog):
    client = client_with()
    for _ in range(3):
        client.get("/livez", headers={"x-forwarded-for": "192.0.2.1"})
    hints = [record.message for record in caplog.records if "KINBOARD_TRUSTED_PROXIES" in record.message]
    assert len(hints) == 1
    client_with(trusted_proxies=("10.0.0.1",)).get("/livez", headers={"x-forwarded-for": "192.0.2.1"})
    assert caplog.text.count("KINBOARD_TRUSTED_PROXIES") == 1


@pytest.mark.parametrize("proxies", [("proxy.example",), ("10.0.0.0/33",), ("*",)])
def test_a_trusted_proxy_is_an_address_or_a_network(proxies):
    with pytest.raises(ValueError, match="trusted_proxies"):
        Settings(trusted_proxies=proxies)
