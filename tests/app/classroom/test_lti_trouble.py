"""Learning platforms that are silent, slow or odd: nobody else waits for them, and they are answered in words."""

from __future__ import annotations

import asyncio
import json
import math
import re
import socket
import socketserver
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from urllib.parse import parse_qs, urlsplit

import httpx2
import jwt
import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from live_server import wait_for
from lti_platform import CLIENT, MEMBER, TOOL, Platform, launch, login, new_key, registered

from app.classroom import COOKIE, ClassroomUnavailable
from app.classroom.lti import exchange, keys
from app.classroom.lti.exchange import PlatformError, ask, is_public
from app.classroom.lti.launches import CLAIM, GRADES, LEARN, LINK, LINKING, SCORE_SCOPE
from app.classroom.lti.passback import Passback
from app.classroom.lti.platforms import is_safe, load_platforms, origin_of, place_of
from app.classroom.lti.seats import Column
from app.classroom.lti.services import post_score
from app.service.main import create_app
from app.service.web import lti as web
from app.shared.store import Store

STORE = Store()
SOON = 20.0  # s for what does not wait for a platform; one that is waited for does not answer at all


@pytest.fixture(scope="module")
def platform() -> Iterator[Platform]:
    with Platform() as double:
        yield double


@pytest.fixture(scope="module")
def application(platform: Platform, tmp_path_factory):
    application = create_app(registered(tmp_path_factory.mktemp("lti"), platform), STORE)
    yield application
    application.state.classroom.close()


@pytest.fixture
def browser(application) -> TestClient:
    return TestClient(application, base_url=TOOL, follow_redirects=False)


@contextmanager
def service(tmp_path, *platforms: Platform) -> Iterator[object]:
    """A service that has not heard of its platforms yet."""
    application = create_app(registered(tmp_path, *platforms), STORE)
    try:
        yield application
    finally:
        application.state.classroom.close()


# -- one platform that does not answer -------------------------------------------------------------------------


def visitor(application) -> httpx2.AsyncClient:
    return httpx2.AsyncClient(transport=httpx2.ASGITransport(application), base_url=TOOL, timeout=60)


async def launched(application, platform: Platform, **token: object) -> httpx2.Response:
    """A launch of a new browser, in the loop of the service."""
    async with visitor(application) as client:
        query = {"iss": platform.issuer, "client_id": CLIENT, "login_hint": "7"}
        answer = await client.get("/lti/login", params=query)
        asked = parse_qs(urlsplit(answer.headers["location"]).query)
        signed = platform.token(asked["nonce"][0], **token)  # type: ignore[arg-type]
        return await client.post("/lti/launch", data={"id_token": signed, "state": asked["state"][0]})


@pytest.mark.full
def test_launches_of_a_silent_platform_stall_neither_rooms_nor_other_platforms(tmp_path) -> None:
    """As many launches as the service has threads and more, of anybody, without a valid signature."""

    async def attack(application, silent: Platform, other: Platform) -> list[httpx2.Response]:
        forged = new_key()
        launches = [
            asyncio.create_task(launched(application, silent, key=forged, key_id=f"unknown {k}"))
            for k in range(60)
        ]
        await asyncio.to_thread(wait_for, lambda: silent.asked["/keys"] > 0)
        code = application.state.classroom.rooms.open("Class", 3600.0).code
        async with asyncio.timeout(SOON), visitor(application) as student:
            joined = await student.post("/room/join", data={"code": code, "alias": "Ada"})
            assert joined.status_code == 303
            assert (await student.get("/room")).status_code == 200
            assert (await launched(application, other)).status_code == 303
        assert silent.asked["/keys"] == 1, "the answer of this request has not come yet"
        return await asyncio.gather(*launches)

    with Platform() as silent, Platform() as other, service(tmp_path, silent, other) as application:
        silent.silent.add("/keys")
        for answer in asyncio.run(attack(application, silent, other)):
            assert answer.status_code == 503
            assert int(answer.headers["retry-after"]) > 0
            assert "does not answer" in answer.text or "Too many launches" in answer.text
        assert silent.asked["/keys"] == 1
        assert silent.at_once == 1


def test_launches_that_wait_for_the_database_are_bounded(application, platform, monkeypatch) -> None:
    """They have their own threads; more than may wait, or longer than they should, is refused in words."""
    monkeypatch.setattr(web, "PATIENCE", 0.3)
    (pages,) = {
        route.endpoint.__self__ for route in application.routes if getattr(route, "path", "") == "/lti/launch"
    }
    locked = threading.Event()

    async def attack() -> list[httpx2.Response]:
        held = [asyncio.create_task(pages._threads.run(locked.wait)) for _ in range(web.THREADS)]
        await asyncio.sleep(0)
        async with asyncio.timeout(SOON), visitor(application) as client:
            answers = [await client.get("/lti/login", params={"iss": platform.issuer, "login_hint": "7"})]
            assert (await client.get("/room")).status_code == 200
            with monkeypatch.context() as patch:
                patch.setattr(web, "MOST_WAITING", 0)
                patch.setattr(web, "PATIENCE", 10 * SOON)
                answers.append(await client.get("/lti/login", params={"iss": platform.issuer, "login_hint": "7"}))
        locked.set()
        await asyncio.gather(*held)
        return answers

    for answer in asyncio.run(attack()):
        assert answer.status_code == 503
        assert "Too many users of learning platforms" in answer.text
    assert asyncio.run(launched(application, platform)).status_code == 303


@pytest.mark.full
def test_a_failure_is_remembered_for_a_while(tmp_path, platform, monkeypatch) -> None:
    with service(tmp_path, platform) as application:
        browser = TestClient(application, base_url=TOOL, follow_redirects=False)
        platform.published = "busy"
        platform.asked.clear()
        try:
            for _ in range(3):
                assert "is not a set of public keys" in launch(browser, platform).text
            assert platform.asked["/keys"] == 1
        finally:
            platform.published = None
        monkeypatch.setattr(keys, "AGAIN_FAILED", 0.0)
        assert launch(browser, platform).status_code == 303
        assert platform.asked["/keys"] == 2


def test_unknown_keys_ask_the_platform_once_in_a_while_and_new_ones_are_found(tmp_path, monkeypatch) -> None:
    with Platform() as platform, service(tmp_path, platform) as application:
        browser = TestClient(application, base_url=TOOL, follow_redirects=False)
        for k in range(5):
            assert "does not publish" in launch(browser, platform, key_id=f"unknown {k}").text
        assert launch(browser, platform).status_code == 303
        assert platform.asked["/keys"] == 1
        platform.published = json.dumps(
            {"keys": [{**json.loads(jwt.algorithms.RSAAlgorithm.to_jwk(platform.key.public_key())), "kid": "p2"}]}
        )
        monkeypatch.setattr(keys, "AGAIN", 0.0)
        assert launch(browser, platform, key_id="p2").status_code == 303
        assert "does not publish" in launch(browser, platform).text, "the platform has taken this key back"


def test_known_keys_count_while_the_platform_is_silent_but_not_for_ever(tmp_path, monkeypatch) -> None:
    time = 1000.0
    monkeypatch.setattr(keys, "steady", lambda: time)
    monkeypatch.setattr(keys, "PATIENCE", 0.05)
    with Platform() as platform, service(tmp_path, platform) as application:
        browser = TestClient(application, base_url=TOOL, follow_redirects=False)
        assert launch(browser, platform).status_code == 303
        platform.silent.add("/keys")
        for later, status in ((keys.FRESH - 1, 303), (keys.FRESH + 1, 303), (keys.KEEP + 1, 503)):
            time = 1000.0 + later
            assert launch(browser, platform).status_code == status
        assert platform.asked["/keys"] == 2


class _Odd(socketserver.ThreadingTCPServer):
    """A server that says something, slowly, and never comes to an end."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, begin: bytes, drop: bytes) -> None:
        odd = self
        self.stop = threading.Event()

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                try:
                    self.request.recv(65536)
                    self.request.sendall(begin)
                    while not odd.stop.wait(0.02):
                        self.request.sendall(drop)
                except OSError:
                    return  # the client has gone, as it should

        super().__init__(("127.0.0.1", 0), Handler)
        threading.Thread(target=self.serve_forever, args=(0.01,)).start()
        self.place = ("127.0.0.1", self.server_address[1])

    def __exit__(self, *_: object) -> None:
        self.stop.set()
        self.shutdown()
        self.server_close()


@pytest.mark.parametrize("scheme", ["http", "https"])
@pytest.mark.parametrize(
    ("begin", "drop"),
    [
        (b"", b""),
        (b"", b"H"),
        (b"HTTP/1.1 200 OK\r\nx: ", b"y"),
        (b"HTTP/1.1 200 OK\r\n\r\n", b"."),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n", b"."),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", b"0"),
    ],
)
def test_an_exchange_ends_in_time_however_slowly_the_other_side_speaks(scheme, begin, drop) -> None:
    with _Odd(begin, drop) as server:
        done = threading.Event()
        errors: list[PlatformError] = []

        def asks() -> None:
            with pytest.raises(PlatformError) as raised:
                ask(f"{scheme}://127.0.0.1:{server.place[1]}/keys", {server.place}, seconds=0.3)
            errors.append(raised.value)
            done.set()

        threading.Thread(target=asks, daemon=True).start()
        assert done.wait(SOON)
    assert "cannot be reached" in str(errors[0])
    assert not errors[0].final


def test_an_answer_without_end_is_not_read_to_the_end(platform) -> None:
    with _Odd(b"HTTP/1.1 200 OK\r\n\r\n", b"." * exchange.MOST) as server, pytest.raises(PlatformError) as raised:
        ask(f"http://127.0.0.1:{server.place[1]}/keys", {server.place})
    assert "larger than" in str(raised.value)


# -- scores ----------------------------------------------------------------------------------------------------


def seats_of(tmp_path, *platforms: Platform):
    """The platforms as registered, and where the scores of the seats ``0 Ada``, ``1 Emmy`` go: by the number."""
    file = registered(tmp_path, *platforms).lti
    assert file is not None
    known = load_platforms(file)

    def column(seat: str) -> Column:
        where = platforms[int(seat.partition(" ")[0])]
        return Column(where.issuer, CLIENT, f"{where.issuer}/columns/5", seat, 1.0, 1, True)

    return known, column


def test_a_silent_platform_delays_the_scores_of_no_other_one(tmp_path) -> None:
    with Platform() as silent, Platform() as other:
        known, column = seats_of(tmp_path, silent, other)
        silent.silent.add("/token")
        passback = Passback(known, column, pauses=(0.0,))
        for k in range(5):
            passback.attempted(f"0 silent {k}")
        wait_for(lambda: silent.asked["/token"] == 1)
        passback.attempted("1 other")
        wait_for(lambda: bool(other.scores))
        assert silent.asked["/token"] == 1, "one request at a time"
        silent.silent.clear()
        wait_for(lambda: len(silent.scores) == 5)
        wait_for(lambda: not passback.busy)
        passback.close()


def test_one_refusal_of_a_token_stands_for_all_scores_and_they_are_tried_again(tmp_path, monkeypatch) -> None:
    with Platform() as platform:
        known, column = seats_of(tmp_path, platform)
        platform.silent.add("/token")
        passback = Passback(known, column, pauses=(0.0, 0.1, 0.1))
        for k in range(8):
            passback.attempted(f"0 {k}")
        wait_for(lambda: platform.asked["/token"] == 1 and not passback._due)
        grant = platform.grant
        monkeypatch.setattr(platform, "grant", lambda _: (503, {}))
        platform.silent.clear()
        wait_for(lambda: platform.asked["/token"] >= 2)
        monkeypatch.setattr(platform, "grant", grant)
        wait_for(lambda: len(platform.scores) == 8)
        wait_for(lambda: not passback.busy)
        assert platform.asked["/token"] < 8 + 8, "not each of them was refused"
        passback.close()


def test_a_column_that_is_refused_takes_no_try_of_others(tmp_path) -> None:
    with Platform() as platform:
        known, column = seats_of(tmp_path, platform)

        def bad(seat: str) -> Column:
            made = column(seat)
            return made if "good" in seat else Column(**{**vars(made), "address": f"{platform.issuer}/moved"})

        passback = Passback(known, bad, pauses=(0.0, 0.0))
        for seat in ("0 bad", "0 good"):
            passback.attempted(seat)
        wait_for(lambda: [sent["userId"] for _, sent in platform.scores] == ["0 good"])
        wait_for(lambda: not passback.busy)
        passback.close()


def test_a_score_waits_for_the_database(tmp_path, monkeypatch) -> None:
    with Platform() as platform:
        known, column = seats_of(tmp_path, platform)
        asked = []

        def away_at_first(seat: str) -> Column:
            asked.append(seat)
            if len(asked) == 1:
                raise ClassroomUnavailable("locked")
            return column(seat)

        passback = Passback(known, away_at_first, pauses=(0.0, 0.0))
        passback.attempted("0 Ada")
        wait_for(lambda: len(platform.scores) == 1)
        wait_for(lambda: not passback.busy)
        passback.close()


# -- addresses that a platform names ---------------------------------------------------------------------------

PRIVATE = [
    "127.0.0.1",
    "127.9.9.9",
    "10.0.0.5",
    "172.16.3.4",
    "192.168.1.1",
    "169.254.169.254",
    "0.0.0.0",
    "100.64.0.1",
    "224.0.0.1",
    "255.255.255.255",
    "::1",
    "::",
    "fe80::1",
    "fe80::1%eth0",
    "fd00::7",
    "ff02::1",
    "::ffff:10.0.0.5",
    "::ffff:127.0.0.1",
    "64:ff9b::7f00:1",
    "64:ff9b::a9fe:1",
    "2002:7f00:1::",
    "2002:a00:5::1",
]


@pytest.mark.parametrize("address", PRIVATE)
def test_addresses_of_private_networks_are_known(address) -> None:
    assert not is_public(address)


@pytest.mark.parametrize("address", ["8.8.8.8", "2606:4700::1111", "::ffff:8.8.8.8", "64:ff9b::808:808"])
def test_addresses_of_the_internet_are_known(address) -> None:
    assert is_public(address)


@pytest.fixture
def inside() -> Iterator[SimpleNamespace]:
    """A server in the operator's network, which counts its connections."""
    found = SimpleNamespace(connections=0)

    class Handler(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            found.connections += 1

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        found.port = server.server_address[1]
        yield found
        server.shutdown()
        thread.join()


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "localhost", "2130706433", "0x7f.1", "127.1", "[::ffff:127.0.0.1]", "grades.evil.example"],
)
@pytest.mark.parametrize("scheme", ["https", "http"])
def test_no_score_is_sent_into_a_private_network(platform, tmp_path, inside, monkeypatch, host, scheme) -> None:
    known, _ = seats_of(tmp_path, platform)
    look_up = socket.getaddrinfo

    def resolves(name: str, *args: object, **options: object) -> list:
        return look_up("127.0.0.1" if "evil" in name else name, *args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(socket, "getaddrinfo", resolves)
    column = f"{scheme}://{host}:{inside.port}/latest/meta-data"
    with pytest.raises(PlatformError) as raised:
        post_score(known, known.all[0], column, "user-9", 1.0)
    assert raised.value.final
    assert re.search("in a private network, and not in the file of platforms|is not HTTPS", str(raised.value))
    assert inside.connections == 0


def test_a_name_is_looked_up_once_so_it_cannot_change_in_between(platform, inside, monkeypatch) -> None:
    look_up, answers = socket.getaddrinfo, iter(["93.184.216.34", "127.0.0.1", "127.0.0.1"])
    tried: list[object] = []
    connect = socket.create_connection

    def resolves(name: str, *args: object, **options: object) -> list:
        return look_up(next(answers) if name == "rebinding.example" else name, *args, **options)  # type: ignore

    def connects(where: tuple[str, int], *args: object) -> socket.socket:
        tried.append(where)
        if where[0] == "93.184.216.34":
            raise OSError("no route")
        return connect(where, *args)  # type: ignore[arg-type]

    monkeypatch.setattr(socket, "getaddrinfo", resolves)
    monkeypatch.setattr(socket, "create_connection", connects)
    with pytest.raises(PlatformError, match="no route"):
        ask(f"https://rebinding.example:{inside.port}/x", platform_places(platform))
    assert tried == [("93.184.216.34", inside.port)]
    assert inside.connections == 0


def platform_places(platform: Platform):
    place = place_of(platform.issuer)
    assert place is not None
    return {place}


def test_the_operators_proxy_may_be_in_the_private_network(inside, monkeypatch) -> None:
    monkeypatch.setenv("https_proxy", f"http://127.0.0.1:{inside.port}")
    monkeypatch.delenv("no_proxy", raising=False)
    with pytest.raises(PlatformError, match="cannot be reached"):
        ask("https://school.example/x", frozenset())
    assert inside.connections == 1


def test_letters_of_a_host_may_be_large(platform) -> None:
    """As in the operator's file: names of hosts are the same in any case."""
    address = f"{platform.issuer.replace('127.0.0.1', 'LocalHost')}/keys"
    place = place_of(address)
    assert place is not None
    assert "keys" in json.loads(ask(address, {place}))


def test_tls_checks_the_name_although_the_connection_goes_to_an_address() -> None:
    context = exchange._tls()
    assert context.check_hostname
    assert context.verify_mode == ssl.CERT_REQUIRED


@pytest.mark.parametrize(
    "address",
    [
        "https://lms.example; script-src *",
        "https://lms.example;script-src=*/",
        "https://lms.example,https://evil",
        "https://lms.example\r\nset-cookie: a=b",
        "https://lms.example\t/",
        "https://user@lms.example/",
        "https://lms.example\\@evil.example/",
        "https://schüler.example/",
        "https://lms.example:99999/",
        "https://lms.example:x/",
        "https:///x",
        "https://*/",
        "https://*.example/",
        "https://'self'/",
        "https://a b/",
        "https://\ud800/",
        "javascript:alert(1)",
        "http://lms.example/",
        "//lms.example/",
        "",
        "https://[::1/x",
        "https://lms.example/'\"><script>",
        "data:text/html,x",
        "ftp://lms.example/",
        "https://lms.example/\x7f",
    ],
)
def test_no_odd_address_is_safe_or_reaches_a_policy(browser, platform, address) -> None:
    assert not is_safe(address)
    claims = {CLAIM + "message_type": LINK, LINKING: {"deep_link_return_url": address}}
    answer = launch(browser, platform, **claims)
    assert answer.status_code == 403
    assert "deep_linking_settings.deep_link_return_url of the launch" in answer.text
    column = launch(browser, platform, **{GRADES: {"scope": [SCORE_SCOPE], "lineitem": address}})
    assert column.status_code == (403 if address else 303)


@pytest.mark.parametrize(
    ("address", "origin"),
    [
        ("https://LMS.example/back?a=1;b=2,3#x", "https://lms.example"),
        ("https://lms.example:443/", "https://lms.example"),
        ("https://lms.example:8443", "https://lms.example:8443"),
        ("http://127.0.0.1:81/x", "http://127.0.0.1:81"),
        ("https://[2001:db8::1]:444/x", "https://[2001:db8::1]:444"),
    ],
)
def test_the_origin_of_an_address(address, origin) -> None:
    assert is_safe(address)
    assert origin_of(address) == origin


# -- signed, but odd -------------------------------------------------------------------------------------------

TABLES = {
    CLAIM + "resource_link": ("id", "title"),
    CLAIM + "custom": ("exercise", "course"),
    GRADES: ("scope", "lineitem"),
    LINKING: ("deep_link_return_url", "accept_multiple", "data"),
}
PATHS = [
    *(
        (name,)
        for name in ("iss", "aud", "sub", "iat", "exp", "nbf", "azp", "nonce", "given_name", "jti", *TABLES)
    ),
    *((CLAIM + name,) for name in ("version", "message_type", "deployment_id", "roles")),
    *((table, name) for table, names in TABLES.items() for name in names),
]
WORDS = [
    *(
        "\ud800",
        "\0",
        "",
        " ",
        "\u202e",
        "x" * 5000,
        "https://lms.example; script-src *",
        SCORE_SCOPE,
        LINK,
        LEARN,
    ),
    *("https://lms.example/back", "two-elbows", "first-steps", "1", "1.3.0", f"{MEMBER}#Instructor"),
]
TEXTS = st.sampled_from(WORDS) | st.text(max_size=20)
NUMBERS = st.sampled_from([0, -1, 10**400, -(10**400), math.inf, math.nan]) | st.integers() | st.floats()
ODD = st.recursive(
    TEXTS | NUMBERS | st.none() | st.booleans(),
    lambda odd: st.lists(odd, max_size=3) | st.dictionaries(TEXTS, odd, max_size=3),
    max_leaves=4,
)


@pytest.mark.full
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(changes=st.dictionaries(st.sampled_from(PATHS), ODD, min_size=1, max_size=2), link=st.booleans())
def test_no_signed_message_is_an_error_of_ours(browser, platform, changes, link) -> None:
    """Whatever a platform signs, it is taken or refused in words, and nothing of it gets into a header."""
    claims = {CLAIM + "message_type": LINK, LINKING: {"deep_link_return_url": "https://lms.example/back"}}
    claims = claims if link else {LINKING: {}}
    claims |= {
        CLAIM + "resource_link": {"id": "link-1"},
        CLAIM + "custom": {},
        GRADES: {"scope": [SCORE_SCOPE], "lineitem": "https://lms.example/columns/5"},
    }
    for path, value in changes.items():
        table = claims if len(path) == 1 else claims[path[0]]
        if isinstance(table, dict):
            table[path[-1]] = value
    browser.cookies.clear()
    answer = launch(browser, platform, **claims)
    assert answer.status_code in (200, 303, 403), (changes, answer.text)
    assert "script-src *" not in str(answer.headers)
    assert (COOKIE in browser.cookies) == (answer.status_code == 303)
    if answer.status_code == 200:
        about = re.search('name="about" value="([^"]*)"', answer.text)
        assert about is not None
        chosen = browser.post("/lti/choose", data={"about": about[1], "content": "exercise:swing"})
        assert chosen.status_code == 200
        (action,) = re.findall(r"form-action ([^;]*);", chosen.headers["content-security-policy"])
        assert re.fullmatch(r"https?://[a-z0-9.:\[\]-]+", action)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sub": "\ud800"}, "The claim sub of the launch is"),
        ({"sub": "x" * 256}, "at most 255 characters long"),
        ({"sub": "a\0b"}, "without NUL"),
        ({GRADES: {"scope": 5}}, "endpoint.scope of the launch is 5; it must be a list of texts"),
        ({GRADES: []}, "endpoint of the launch is []; it must be an object"),
        ({CLAIM + "resource_link": {"id": 5}}, "resource_link.id of the launch is 5; it must be a text"),
        ({CLAIM + "roles": "Instructor"}, "it must be a list of texts"),
        ({"exp": math.inf}, "is not valid"),
        ({CLAIM + "custom": {"course": ["x"]}}, "custom.course of the launch"),
        ({CLAIM + "message_type": LINK, LINKING: {}}, "deep_link_return_url of the launch is missing"),
    ],
)
def test_odd_claims_are_named(browser, platform, changes, words) -> None:
    answer = launch(browser, platform, **changes)
    assert answer.status_code == 403
    assert words in answer.text.replace("&#x27;", "'")


@pytest.mark.full
@pytest.mark.parametrize("given_name", [" ", "\u202e\u200b", "x" * 300, "\ufb2c" * 40])
def test_a_name_that_shows_nothing_or_is_too_long_keeps_nobody_out(browser, platform, given_name) -> None:
    link = {"id": f"odd {len(given_name)}", "title": given_name}
    assert launch(browser, platform, given_name=given_name, **{CLAIM + "resource_link": link}).status_code == 303


HEADERS = [
    b"[" * 30_000,
    b'{"alg":"RS256","kid":' + b"[" * 20_000,
    b'{"alg":"RS256","kid":5}',
    b'{"alg":"RS256"}',
    b'{"alg":"RS256","kid":"\\ud800"}',
    b'{"alg":"RS256","kid":' + b"9" * 10_000 + b"}",
    b"[]",
    b"5",
    b'"x"',
    b"",
    b'{"alg":null,"kid":"p1"}',
    b'{"alg":["RS256"],"kid":"p1"}',
    b'{"alg":"RS256","kid":"p1","crit":["x"]}',
    b'{"alg":"RS256","kid":"p1","crit":5}',
    b'{"alg":"RS256","kid":"p1","b64":false}',
    b"\xff\xfe",
]


@pytest.mark.parametrize("header", HEADERS, ids=range(len(HEADERS)))
def test_an_odd_header_is_refused_in_words(browser, platform, header) -> None:
    """What anybody can send without a signature."""
    asked = login(browser, platform)
    for payload in (b"{}", b"[" * 20_000, b"\xff"):
        token = ".".join(jwt.utils.base64url_encode(part).decode() for part in (header, payload, b"signature"))
        answer = browser.post("/lti/launch", data={"id_token": token, "state": asked["state"]})
        assert answer.status_code == 403, answer.text
        assert "of the launch" in answer.text or "The launch" in answer.text
