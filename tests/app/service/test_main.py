"""The whole service: health, pages without internet, path prefix, start and stop of the real process."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urljoin, urlsplit

import httpx2
import psutil
import pytest
import viser
from fastapi.testclient import TestClient
from live_server import serve, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from app.service import startup
from app.service.compute.pool import Pool
from app.service.compute.process import LostError
from app.service.main import create_app, run
from app.shared.settings import Settings, static_folder
from app.shared.store import Store
from app.viewer.server import ViewerServer
from kin import builtin_robots

ROOT = Path(__file__).parents[3]
PROTOCOL = f"viser-v{viser.__version__}"
LINK = re.compile(r"""\b(?:href|src)="([^"]*)\"""")


def read_to_the_end(visitor: ClientConnection) -> None:
    while True:
        visitor.recv(timeout=5)


@pytest.fixture(scope="module")
def client() -> Iterator[TestClient]:
    with TestClient(create_app(Settings())) as client:
        wait_for(lambda: client.get("/readyz").status_code == 200, 120)
        yield client


def readiness(status: str) -> dict:
    """What /readyz answers where rooms can be opened."""
    return {"status": status, "classrooms": "ready"}


@pytest.mark.full
def test_livez_and_readyz(client):
    alive = client.get("/livez")
    assert (alive.status_code, alive.json()) == (200, {"status": "alive", "pid": os.getpid()})
    ready = client.get("/readyz")
    assert (ready.status_code, ready.json()) == (200, readiness("ready"))
    assert ready.headers["cache-control"] == "no-store"


@pytest.mark.full
def test_until_the_viewer_has_started_pages_are_served_and_readyz_reports_starting(monkeypatch):
    may_start, start = threading.Event(), ViewerServer.start
    monkeypatch.setattr(ViewerServer, "start", lambda self, loop: may_start.wait(30) and start(self, loop))
    events = []
    with TestClient(create_app(Settings(), on_ready=lambda: events.append("ready"))) as client:
        for _ in range(3):
            answer = client.get("/readyz")
            assert (answer.status_code, answer.json()) == (503, readiness("starting"))
            assert client.get("/livez").status_code == 200
            assert client.get("/").status_code == 200
            assert client.get("/api/v1/robots").status_code == 200
        assert events == []
        may_start.set()
        wait_for(lambda: client.get("/readyz").json()["status"] == "ready")
        assert events == ["ready"]
        assert client.get("/readyz").status_code == 200


def test_rest_is_served_when_the_viewer_fails(monkeypatch, caplog):
    def fail(self, loop):
        raise RuntimeError("this version of viser cannot be used")

    monkeypatch.setattr(ViewerServer, "start", fail)
    with TestClient(create_app(Settings())) as client:
        wait_for(lambda: client.get("/readyz").json() == readiness("failed"))
        assert client.get("/readyz").status_code == 503
        assert client.get("/viewer/").status_code == 503
        assert client.get("/api/v1/robots").status_code == 200
    assert "this version of viser cannot be used" in caplog.text


@pytest.mark.parametrize("error", [LostError(), OSError("no memory for a process")], ids=["lost", "no memory"])
def test_the_service_is_ready_when_its_processes_compute_which_are_tried_again(monkeypatch, error):
    first, second = threading.Event(), threading.Event()
    tries = iter([first, second])

    def wait(self: Pool) -> None:
        turn = next(tries)
        assert turn.wait(60)
        if turn is first:
            raise error

    monkeypatch.setattr(startup, "AGAIN", 0.0)
    monkeypatch.setattr(Pool, "start", lambda self: None)
    monkeypatch.setattr(Pool, "wait", wait)
    settings, store = Settings(), Store()
    with TestClient(create_app(settings, store, pool=Pool(1, settings, store))) as client:
        wait_for(lambda: client.get("/viewer/").status_code == 200, 60)
        assert client.get("/readyz").json() == readiness("starting")
        first.set()
        wait_for(lambda: client.get("/readyz").json() == readiness("failed"))
        assert client.get("/viewer/").status_code == 200
        second.set()
        wait_for(lambda: client.get("/readyz").json() == readiness("ready"))


@pytest.mark.full
def test_stopping_ends_the_viewer_and_the_thread_that_started_it(monkeypatch):
    stop = ViewerServer.stop
    stopped: list[ViewerServer] = []
    monkeypatch.setattr(ViewerServer, "stop", lambda self: stopped.append(self) or stop(self))
    with TestClient(create_app(Settings())) as client:
        wait_for(lambda: client.get("/readyz").status_code == 200, 120)
        assert client.get("/viewer/").status_code == 200
        assert stopped == []
    assert len(stopped) == 1
    assert client.get("/viewer/").status_code == 503
    wait_for(lambda: not [thread for thread in threading.enumerate() if thread.name == "kinboard-startup"])


@pytest.mark.parametrize("page", ["/", "/docs"])
def test_pages_refer_only_to_own_files_that_exist(client, page):
    html = client.get(page).text
    links = [link for link in LINK.findall(html) if not link.startswith("#")]
    assert len(links) >= 4
    for link in links:
        assert not urlsplit(link).netloc, f"{page} refers to another host: {link}"
        assert not link.startswith("/"), f"{page} would break behind a path prefix: {link}"
        assert client.get(urljoin(page, link)).status_code == 200, link


@pytest.mark.parametrize("page", ["/", "/docs"])
def test_pages_have_no_inline_code_and_a_policy_that_forbids_it(client, page):
    answer = client.get(page)
    assert not re.search(r"<script(?![^>]*\bsrc=)|\bon\w+=|<style|\bstyle=", answer.text)
    policy = answer.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "default-src 'self';" in policy
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_static_files_name_no_other_host():
    files = [f for f in static_folder().glob("*") if f.suffix in (".html", ".css", ".js", ".svg")]
    assert len(files) >= 6
    for file in files:
        hosts = set(re.findall(r"https?://[\w.-]+", file.read_text())) - {"http://www.w3.org"}
        assert not hosts, f"{file.name} names {hosts}"
    assert "validatorUrl: null" in (static_folder() / "docs.js").read_text()


def test_the_examples_of_the_landing_page_work(client):
    pattern = r'data-method="(\w+)" data-path="([^"]+)">[^<]+<code hidden>([^<]*)</code>'
    answers = {}
    for method, path, body in re.findall(pattern, client.get("/").text):
        headers = {"Content-Type": "application/json"} if body else {}
        answer = client.request(method, f"/{path}", content=body, headers=headers)
        assert answer.status_code == 200, answer.text
        answers[urlsplit(path).path.rsplit("/", 1)[1]] = answer.json()
    assert set(answers) == {"fk", "ik", "summary"}
    assert answers["ik"]["status"] == "solved"


def test_every_built_in_arm_has_a_thumbnail():
    pictures = {file.stem: file for file in (static_folder() / "robots").iterdir()}
    assert set(pictures) == set(builtin_robots())
    for file in pictures.values():
        assert file.read_bytes()[8:12] == b"WEBP"
        assert file.stat().st_size < 15_000


def test_our_scripts_run_before_that_of_viser(client):
    """viser's waits until the page is read: what is part of it, without `defer`, runs before."""
    html = client.get("/viewer/").text
    scripts = re.findall(r'<script src="\.\./(static/[a-z_/.]+\.js)"></script>', html)
    assert scripts[0] == "static/start.js", "it says so if another one fails"
    assert html.index(scripts[0]) < html.index("<script data-p")
    assert {"static/viewer.js", "static/layout.js", "static/page.js", "static/hints.js"} <= set(scripts)
    others = len(re.findall(r"<script\b", html)) - len(scripts)
    assert others == 1, "there is viser's, and none that is put off"
    announced = re.findall(r'<link rel="preload" as="script" href="\.\./(static/[a-z_/.]+\.js)">', html)
    assert announced == scripts[1:]
    styles = re.findall(r'<link rel="stylesheet" href="\.\./(static/[a-z_]+\.css)">', html)
    assert {"static/start.css", "static/viewer.css"} <= set(styles)
    for file in styles:
        before = html.index(file) < html.index("<script data-p")
        assert before == (file == "static/start.css"), "our styles win where both set one"
    for file in scripts + styles:
        assert client.get(f"/{file}").status_code == 200


def test_the_landing_page_names_the_version(client):
    assert f"Kinboard {client.get('/openapi.json').json()['info']['version']} " in client.get("/").text


def test_the_old_addresses_of_the_documentation_do_not_exist(client):
    assert client.get("/redoc").status_code == 404
    assert client.get("/docs/", follow_redirects=False).headers["location"] == "../docs"


@pytest.mark.full
@pytest.mark.parametrize("sent", ["", "/kinboard"], ids=["proxy strips the prefix", "proxy passes it on"])
@pytest.mark.parametrize("setting", ["/kinboard", "kinboard/"])
def test_the_service_works_behind_a_path_prefix(sent, setting):
    with (
        serve(create_app(Settings(root_path=setting))) as port,
        httpx2.Client(base_url=f"http://127.0.0.1:{port}{sent}", trust_env=False, timeout=30) as browser,
    ):
        wait_for(lambda: browser.get("/readyz").status_code == 200, 120)
        for path in ("/", "/docs", "/static/landing.css", "/static/vendor/swagger-ui/swagger-ui.css", "/viewer/"):
            assert browser.get(path).status_code == 200, path
        assert browser.get("/api/v1/robots").status_code == 200
        assert browser.get("/openapi.json").json()["servers"] == [{"url": "/kinboard"}]
        assert browser.get("/static/nothing-here").status_code == 404
        root = httpx2.get(f"http://127.0.0.1:{port}/kinboard", trust_env=False)
        assert (root.status_code, root.headers["location"]) == (307, "/kinboard/")
        with connect(f"ws://127.0.0.1:{port}{sent}/viewer", subprotocols=[PROTOCOL], proxy=None) as visitor:
            assert len(visitor.recv(timeout=20)) > 16


def test_a_port_in_use_is_reported(capfd):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert run(Settings(port=port)) == 1
    captured = capfd.readouterr()
    assert f"cannot listen on 127.0.0.1:{port}" in captured.err
    assert "--port" in captured.err
    assert "Traceback" not in captured.err
    assert captured.out == ""


def test_a_wrong_folder_of_robots_is_reported(capfd, tmp_path):
    assert run(Settings(port=0, robots=tmp_path / "nowhere")) == 1
    captured = capfd.readouterr()
    assert "nowhere" in captured.err
    assert "Traceback" not in captured.err


def listening(pid: int) -> list[int]:
    """Ports on which a service listens, whichever of its processes does."""
    service = psutil.Process(pid)
    found = [each for process in (service, *service.children()) for each in process.net_connections("inet")]
    return sorted({each.laddr.port for each in found if each.status == psutil.CONN_LISTEN})


SOON = 30  # s; a loaded machine may need most of it


@pytest.mark.parametrize(
    ("ready", "stop"),
    [
        pytest.param(False, signal.SIGINT, id="while starting, SIGINT"),
        pytest.param(True, signal.SIGTERM, id="when ready, SIGTERM"),
        pytest.param(False, signal.SIGTERM, id="while starting, SIGTERM", marks=pytest.mark.slow),
        pytest.param(True, signal.SIGINT, id="when ready, SIGINT", marks=pytest.mark.slow),
    ],
)
def test_the_process_starts_and_a_signal_stops_it_without_errors(ready, stop):
    code = (
        "import sys; from app.service.main import run; from app.shared.settings import Settings; "
        "sys.exit(run(Settings()))"
    )
    process = subprocess.Popen(
        [sys.executable, "-W", "error", "-c", code],
        cwd=ROOT,
        env=os.environ | {"KINBOARD_PORT": "0", "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.fullmatch(r"Kinboard \S+ is at http://127\.0\.0\.1:(\d+)/  \(Ctrl-C to stop\)\n", line)
        assert found, line + process.communicate(timeout=10)[1]
        base = f"127.0.0.1:{found[1]}"
        if not ready:
            process.send_signal(stop)
            out, err = process.communicate(timeout=SOON)
        else:
            wait_for(lambda: httpx2.get(f"http://{base}/readyz", trust_env=False).status_code == 200, 120)
            with connect(f"ws://{base}/viewer", subprotocols=[PROTOCOL], proxy=None) as visitor:
                assert visitor.recv(timeout=20)
                assert listening(process.pid) == [int(found[1])], "the viewer has no port of its own"
                process.send_signal(stop)
                with pytest.raises(ConnectionClosed):
                    read_to_the_end(visitor)
            out, err = process.communicate(timeout=SOON)
        assert (process.returncode, out, err) == (0, "", "")
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize(
    ("settings", "warned"),
    [
        ({"host": "0.0.0.0"}, True),
        ({"host": "::"}, True),
        ({"host": "127.0.0.1"}, False),
        ({"host": "::1"}, False),
        ({"host": "0.0.0.0", "token": "long enough"}, False),
        ({"host": "0.0.0.0", "read_only": True}, False),
    ],
)
def test_a_public_service_without_a_token_logs_a_warning(capfd, monkeypatch, settings, warned):
    monkeypatch.setattr("app.service.main._serve", lambda *_, **__: 0)
    monkeypatch.setattr("app.service.main.can_restart", lambda: False)
    assert run(Settings(port=0, compute=0, **settings)) == 0
    assert ("open to everybody" in capfd.readouterr().err) is warned


@pytest.mark.parametrize(
    ("wanted", "status"), [("bytes=0-9", 206), ("bytes=9-5", 400), ("lines=1", 400), ("bytes=99999999-", 416)]
)
def test_a_range_of_a_file_that_does_not_exist_is_a_problem(client, wanted, status):
    answer = client.get("/static/landing.css", headers={"range": wanted})
    assert answer.status_code == status
    if status == 206:
        assert len(answer.content) == 10
    else:
        assert answer.json()["type"] == "urn:kinboard:problem:bad-range"
    assert answer.headers.get("content-range", "").startswith("bytes */") is (status == 416)
