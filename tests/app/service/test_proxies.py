"""The snippets of deploy/ in the real nginx and Caddy: TLS and a path prefix in front of the real service."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx2
import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve, wait_for
from playwright.sync_api import Browser, expect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.sync.server import serve as serve_websocket

import kin
from app.classroom import COOKIE, Hub
from app.classroom.hub import LOOK
from app.service.main import create_app
from app.shared.settings import Settings

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[3]
DEPLOY = ROOT / "deploy"
PIONEER = kin.get_robot("pioneer5")
LARGE = 12 * 1024 * 1024
TOKEN = "a token for proxies"
BEARER = {"Authorization": f"Bearer {TOKEN}"}

Start = Callable[[Path, int, Sequence[int]], list[str | Path]]


def program(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.fail(f"no {name}: scripts/test.sh unpacks it on Debian; elsewhere install it")
    return found


def replaced(text: str, changes: dict[str, str]) -> str:
    """Each placeholder must be there: a test of a changed snippet shall not pass by accident."""
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text


def nginx(folder: Path, port: int, upstreams: Sequence[int]) -> list[str | Path]:
    changes = {
        "listen 443 ssl": f"listen 127.0.0.1:{port} ssl",
        "/etc/ssl/certs/robots.example.pem": str(folder / "certificate.pem"),
        "/etc/ssl/private/robots.example.key": str(folder / "key.pem"),
        "server 127.0.0.1:8000;": " ".join(f"server 127.0.0.1:{upstream};" for upstream in upstreams),
    }
    (folder / "kinboard.conf").write_text(replaced((DEPLOY / "nginx.conf").read_text(), changes))
    user = "user root;" if os.geteuid() == 0 else ""  # or its workers could not enter pytest's folder
    places = "".join(
        f"{name}_temp_path {folder}/{name};" for name in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    (folder / "nginx.conf").write_text(
        f"{user} daemon off; pid {folder}/pid; error_log stderr warn; events {{}} "
        f"http {{ access_log off; {places} include {folder}/kinboard.conf; }}"
    )
    return [program("nginx"), "-e", "stderr", "-p", folder, "-c", folder / "nginx.conf"]


def caddy(folder: Path, port: int, upstreams: Sequence[int]) -> list[str | Path]:
    return caddy_with("Caddyfile", "robots.example", "127.0.0.1:8000", folder, port, upstreams)


def of_compose(folder: Path, port: int, upstreams: Sequence[int]) -> list[str | Path]:
    return caddy_with("compose.Caddyfile", "{$KINBOARD_DOMAIN}", "kinboard:8000", folder, port, upstreams)


def caddy_with(
    name: str, site: str, behind: str, folder: Path, port: int, upstreams: Sequence[int]
) -> list[str | Path]:
    """Caddy with a file of deploy/, which names a site and the service behind it."""
    changes = {
        f"{site} {{": f"localhost:{port} {{\n    tls {folder}/certificate.pem {folder}/key.pem",
        behind: " ".join(f"127.0.0.1:{upstream}" for upstream in upstreams),
    }
    snippet = replaced((DEPLOY / name).read_text(), changes)
    options = (
        "admin off",
        "auto_https disable_redirects",
        "default_bind 127.0.0.1",
        f"storage file_system {folder}",
    )
    (folder / "Caddyfile").write_text("\n".join(["{", *options, "}", snippet]))
    return [program("caddy"), "run", "--adapter", "caddyfile", "--config", folder / "Caddyfile"]


PROXIES = {"nginx": nginx, "caddy": caddy}


@contextmanager
def running(start: Start, folder: Path, certificate: Path, *upstreams: int) -> Iterator[str]:
    """The address of a proxy in front of ports of this machine."""
    folder.mkdir()
    for file in certificate.iterdir():
        shutil.copy(file, folder)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    messages = folder / "messages"
    environment = {**os.environ, "XDG_DATA_HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    with (
        messages.open("wb") as output,
        subprocess.Popen(start(folder, port, upstreams), env=environment, stdout=output, stderr=output) as process,
    ):

        def listens() -> bool:
            assert process.poll() is None, messages.read_text()
            with socket.socket() as probe:
                return probe.connect_ex(("127.0.0.1", port)) == 0

        try:
            wait_for(listens)
            yield f"localhost:{port}"
        finally:
            process.terminate()
            process.wait(10)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory) -> Path:
    """A folder with a self-signed certificate for localhost and its key."""
    folder = tmp_path_factory.mktemp("certificate")
    command = (
        "openssl req -x509 -nodes -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -days 2 -subj /CN=localhost"
    )
    names = ["-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"]
    files = ["-keyout", folder / "key.pem", "-out", folder / "certificate.pem"]
    subprocess.run([*command.split(), *names, *files], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def tls(certificate: Path) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=certificate / "certificate.pem")


@pytest.fixture(scope="module")
def service() -> Iterator[int]:
    settings = Settings(root_path="/kinboard", token=TOKEN, trusted_proxies=("127.0.0.1",))
    app = create_app(settings)
    with serve(app, settings) as port:
        wait_for(lambda: app.state.startup.status != "starting", seconds=600)
        assert app.state.startup.status == "ready"
        yield port


@pytest.fixture(scope="module", params=PROXIES)
def address(request, service: int, certificate: Path, tmp_path_factory) -> Iterator[str]:
    """Host and port of the service's proxy."""
    folder = tmp_path_factory.mktemp("proxy") / request.param
    with running(PROXIES[request.param], folder, certificate, service) as host:
        yield host


@pytest.fixture
def visitor(address: str, tls: ssl.SSLContext) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=f"https://{address}", verify=tls, headers=BEARER, trust_env=False) as client:
        yield client


def test_pages_and_whatever_they_load_stay_under_the_prefix(visitor: httpx2.Client) -> None:
    moved = visitor.get("/kinboard")
    assert moved.status_code == 308
    landing = visitor.get(str(moved.url.join(moved.headers["location"])))
    assert landing.status_code == 200
    docs = visitor.get("/kinboard/docs")
    for page in (landing, docs):
        loaded = re.findall(r'(?:src|href)="([^"#:]+)"', page.text)
        assert len(loaded) > 2
        for link in loaded:
            answer = visitor.get(str(page.url.join(link)), follow_redirects=True)
            assert answer.status_code == 200, link
            assert answer.url.path.startswith("/kinboard/")
    assert visitor.get("/kinboard/openapi.json").json()["servers"] == [{"url": "/kinboard"}]
    assert "Kinboard viewer" in visitor.get("/kinboard/viewer", follow_redirects=True).text
    assert visitor.get("/").status_code != 308, "the rest of the site is not ours"


def test_rest(visitor: httpx2.Client) -> None:
    q = [0.1, 0.2, 0.3, 0.4, 0.5]
    answer = visitor.post("/kinboard/api/v1/robots/pioneer5/fk", json={"q": q})
    assert np.allclose(answer.json()["pose"]["matrix"], kin.fk(PIONEER, q))


def test_the_largest_body_we_take_passes(visitor: httpx2.Client) -> None:
    body = b'{"q": [0, 0, 0, 0, 0]}'.rjust(Settings().max_body)
    answer = visitor.post(
        "/kinboard/api/v1/robots/pioneer5/fk", content=body, headers={"content-type": "application/json"}
    )
    assert answer.status_code == 200


def test_a_slider_moves_the_arm_through_the_websocket(address: str, tls: ssl.SSLContext) -> None:
    """The whole scene arrives, a control's message goes back, and the arm moves."""
    with FakeBrowser(
        f"wss://{address}/kinboard/viewer",
        ssl=tls,
        origin=f"https://{address}",
        additional_headers=BEARER,
        proxy=None,
    ) as tab:
        q = PIONEER.q_home.copy()
        q[0] = 0.6
        tab.set("1 rotating base", float(np.degrees(q[0])))
        target = kin.fk(PIONEER, q)
        tab.wait(lambda: np.allclose(tab.tool_pose(), target, atol=1e-4))


def test_pages_of_other_origins_are_refused(address: str, tls: ssl.SSLContext) -> None:
    with pytest.raises(InvalidStatus) as refused:
        connect(
            f"wss://{address}/kinboard/viewer",
            ssl=tls,
            origin="https://elsewhere.example",
            additional_headers=BEARER,
            proxy=None,
            open_timeout=60,
        )
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize("name", PROXIES)
def test_large_messages_pass_both_ways(name: str, certificate: Path, tls: ssl.SSLContext, tmp_path: Path) -> None:
    """As large as a cloud of points; through the proxy alone, to a server that sends back what it gets."""

    def echo(connection) -> None:
        for message in connection:
            connection.send(message)

    with serve_websocket(echo, "127.0.0.1", 0, max_size=None, compression=None) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            with (
                running(PROXIES[name], tmp_path / name, certificate, server.socket.getsockname()[1]) as address,
                connect(
                    f"wss://{address}/kinboard/viewer",
                    ssl=tls,
                    max_size=None,
                    compression=None,
                    proxy=None,
                    open_timeout=60,
                ) as tab,
            ):
                message = os.urandom(LARGE)
                tab.send(message)
                assert tab.recv(timeout=30) == message
        finally:
            server.shutdown()
            thread.join(10)


@pytest.mark.browser
@pytest.mark.parametrize("address", ["nginx"], indirect=True)
def test_a_real_browser_is_asked_for_the_token_and_shown_the_viewer(address: str, browser: Browser) -> None:
    """The pages find their way back: wss, the prefix, and a cookie for them alone."""
    with browser.new_context(ignore_https_errors=True) as visitor:
        page = visitor.new_page()
        dialled: list[str] = []
        page.on("websocket", lambda opened: dialled.append(opened.url))
        page.goto(f"https://{address}/kinboard/viewer/")
        page.locator("#token").fill(TOKEN)
        page.locator("#token").press("Enter")
        expect(page.locator("[data-status]")).to_have_attribute("data-status", "hand", timeout=30_000)
        assert page.url.partition("?")[0] == f"https://{address}/kinboard/viewer/"
        assert f"wss://{address}/kinboard/viewer" in [url.rstrip("/") for url in dialled]
        (cookie,) = visitor.cookies()
        assert (cookie["path"], cookie["secure"]) == ("/kinboard/", True)


def test_compose_puts_https_in_front(certificate: Path, tmp_path: Path) -> None:
    settings = Settings(token=TOKEN, trusted_proxies=("127.0.0.1",))
    app = create_app(settings)
    with serve(app, settings) as port, running(of_compose, tmp_path / "caddy", certificate, port) as address:
        trusted = ssl.create_default_context(cafile=certificate / "certificate.pem")
        with httpx2.Client(base_url=f"https://{address}", verify=trusted, trust_env=False) as visitor:
            assert visitor.get("/livez").status_code == 200
            answer = visitor.post("/api/v1/robots/pioneer5/fk", json={"q": [0.0] * 5}, headers=BEARER)
            assert np.allclose(answer.json()["pose"]["matrix"], kin.fk(PIONEER, [0.0] * 5))
            login = visitor.post("/login", data={"token": TOKEN})
            assert "Secure" in login.headers["set-cookie"]


@contextmanager
def process(data: Path) -> Iterator[tuple[subprocess.Popen[str], int, int]]:
    """A service of its own, as in a container: the process that starts it, its port, and which process answers."""
    names = {"KINBOARD_ROOT_PATH": "/kinboard", "KINBOARD_TRUSTED_PROXIES": '["127.0.0.1"]'}
    env = {**os.environ, **names, "KINBOARD_DATA": str(data), "KINBOARD_COMPUTE": "0"}
    command = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
    with subprocess.Popen(
        command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as started:
        try:
            assert started.stdout is not None
            found = re.search(r"http://[^/]+:(\d+)/", started.stdout.readline())
            assert found
            port = int(found[1])
            with httpx2.Client(trust_env=False, base_url=f"http://127.0.0.1:{port}/kinboard", timeout=20.0) as ask:
                wait_for(lambda: ask.get("/readyz").status_code == 200, seconds=600)
                yield started, port, home(ask)
        finally:
            end(started)


def home(client: httpx2.Client, query: str = "") -> int:
    """Which process answers."""
    return int(client.get(f"/livez{query}").json()["pid"])


def end(started: subprocess.Popen[str]) -> None:
    """Kill a service, also the process that would start it again."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(started.pid, signal.SIGKILL)


@pytest.mark.parametrize("name", PROXIES)
def test_all_pages_of_a_room_reach_the_same_of_two_services(
    name: str, certificate: Path, tls: ssl.SSLContext, tmp_path: Path
) -> None:
    """They see each other at once, in memory; if the service is killed, the room goes on in the other one."""
    with (
        process(tmp_path / "data") as one,
        process(tmp_path / "data") as two,
        running(PROXIES[name], tmp_path / name, certificate, one[1], two[1]) as address,
        contextlib.closing(Hub(tmp_path / "data")) as hub,
        contextlib.ExitStack() as stack,
    ):

        def browser() -> httpx2.Client:
            made = httpx2.Client(base_url=f"https://{address}/kinboard", verify=tls, trust_env=False, timeout=20.0)
            return stack.enter_context(made)

        def opened() -> tuple[httpx2.Client, str]:
            room, teacher = hub.rooms.open("Class", 3600.0), browser()
            assert teacher.get(f"/room/teach/{room.token}").status_code == 303
            return teacher, room.code

        rooms = [opened()]
        while len({home(teacher) for teacher, _ in rooms}) < 2:
            assert len(rooms) < 40, "all rooms are in one service"
            rooms.append(opened())
        for teacher, code in rooms[-2:]:
            student = browser()
            assert f"room/join?code={code}" in student.get(f"/room?code={code}").text
            assert student.post(f"/room/join?code={code}", data={"code": code, "alias": "Ada"}).status_code == 303
            assert home(student) == home(browser(), f"?code={code}") == home(teacher)
        tabs = [stack.enter_context(tab(address, tls, client)) for client in (student, teacher)]
        for each in tabs:
            each.wait(lambda each=each: "data-class-bar" in each.html)
        tabs[1].say("feature", ["class", ["freeze", 1], None])  # as the button does
        tabs[0].wait(lambda: "data-class-frozen" in tabs[0].html, timeout=LOOK - 0.5)
        first, other = (one, two) if home(student) == one[2] else (two, one)
        end(first[0])
        wait_for(lambda: student.get("/room").status_code == 200 and home(student) == other[2])
        assert "You are in this room as a student" in student.get("/room").text
        with tab(address, tls, student) as again:
            again.wait(lambda: "data-class-bar" in again.html)


def tab(address: str, tls: ssl.SSLContext, client: httpx2.Client) -> FakeBrowser:
    """The page of a browser in a room."""
    cookie = f"{COOKIE}={client.cookies[COOKIE]}"
    return FakeBrowser(
        f"wss://{address}/kinboard/viewer",
        ssl=tls,
        origin=f"https://{address}",
        additional_headers={"Cookie": cookie},
        proxy=None,
    )
