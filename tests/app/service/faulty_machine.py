"""A service on a machine that misbehaves: folders fill up, the clock jumps, peers are silent, slow or lying.

The folders of the service are filesystems of its own (`unshare`, as root), so that they can be filled and made
read-only while it runs. Where that is not allowed, `Machine.mounted` is False: a folder that should be full or
read-only is replaced by a file instead, in which nothing can be written either. What a folder holds at first is
copied from a folder of the same name, `seeds`.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import json
import os
import re
import shutil
import signal
import socketserver
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx2
import jwt
import psutil
from attacks import ROOT, Victim, victim
from cryptography.hazmat.primitives.asymmetric import rsa
from fake_browser import FakeBrowser
from live_server import wait_for
from websockets.exceptions import WebSocketException

from app.classroom import COOKIE
from app.classroom.lti.platforms import key_file, make_key
from app.classroom.tables import Attempt
from app.exports.robots import robot_file
from app.viewer.session.state import PageState, encode
from kin import get_robot

MOST = 8 << 20  # bytes of each folder
SILENCE = 10.0  # s: KINBOARD_WORKER_TIMEOUT and KINBOARD_TIME_BUDGET
HANG = signal.SIGUSR1  # lets the event loop of the service hang
PATIENCE = 120.0  # s for what is not measured
EXERCISE = "which-joint-goes-down"
ASKED = (
    ("POST", "/api/v1/robots/pioneer5/ik", {"target": {"position": [0.045, 0.191, -0.211]}}),
    ("POST", "/api/v1/robots/pioneer5/ik", {"target": [{"position": [0.045, 0.191, -0.211]}] * 2}),
    *(("GET", path, None) for path in ("/livez", "/readyz", "/room")),
)
# Of every Python of the machine. The end of a terminal ends the service, also where these tests run without one.
STARTUP = """
import os, signal, sys, time
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGUSR1, lambda *_: time.sleep(600))
_true = time.time

def _time():
    with open(os.environ["FAULTY_CLOCK"]) as file:
        return _true() + float(file.read())

time.time = _time
if "app.service.compute" in " ".join(sys.orig_argv) and os.path.exists(os.environ["FAULTY_LOADING"]):
    time.sleep(600)
"""
MOUNT = """
for folder in "$FAULTY_FOLDERS"/*/ /dev/shm; do
    mount -t tmpfs -o size="$FAULTY_SIZE" tmpfs "$folder" || exit 1
done
cp -r "$FAULTY_SEEDS"/. "$FAULTY_FOLDERS" || exit 1
exec "$@"
"""
APART = ("unshare", "--mount", "--propagation", "private")


@functools.cache
def can_mount() -> bool:
    """Whether this user may have filesystems of their own."""
    if sys.platform != "linux" or shutil.which("unshare") is None:
        return False
    tried = subprocess.run([*APART, "mount", "-t", "tmpfs", "tmpfs", "/mnt"], capture_output=True, check=False)
    return tried.returncode == 0


@dataclass
class Machine:
    """A running service, and what can go wrong around it.

    Attributes:
        folders: where its folders are, as the service sees them: temp, data and those of `SEEDS`.
        platforms: addresses of learning platforms, by the manner in which they misbehave.
        loading: a file; while it is there, processes that compute hang before they have loaded the core.
        cookie: of a student in a room.
        confirmed: how many of the student's answers were confirmed.
    """

    service: Victim
    folders: Path
    clock: Path
    loading: Path
    mounted: bool
    platforms: dict[str, str]
    cookie: str = ""
    confirmed: int = 0
    _undo: list[Callable[[], object]] = field(default_factory=list)

    # Processes

    def processes(self) -> dict[str, psutil.Process]:
        """The process of the service and the one that computes for it, by their roles."""
        found: list[psutil.Process] = []

        def all_there() -> bool:
            with contextlib.suppress(psutil.NoSuchProcess):  # it has ended meanwhile
                found[:] = psutil.Process(self.service.process.pid).children()
                for service in found[:1]:
                    found[1:] = [each for each in service.children() if "compute" in " ".join(each.cmdline())]
                return len(found) == 2
            return False

        wait_for(all_there, 60)
        return dict(zip(("service", "compute"), found, strict=True))

    # Folders

    def _seen(self, name: str) -> Path:
        """A folder, as this process can reach it."""
        place = Path("/dev/shm") if name == "shm" else self.folders / name
        return Path(f"/proc/{self.service.process.pid}/root{place}") if self.mounted else place

    def _enter(self, *command: str) -> None:
        """Run a command where the service's folders are."""
        pid = str(self.service.process.pid)
        subprocess.run(["nsenter", "--target", pid, "--mount", *command], check=True)

    def fill(self, name: str) -> None:
        """Leave no byte free in a folder."""
        if not self.mounted:
            self.replace(name)
            return
        junk = self._seen(name) / "junk"
        with junk.open("wb", buffering=0) as file:
            for size in (1 << 16, 1 << 8, 1):
                with contextlib.suppress(OSError):
                    while file.write(bytes(size)) == size:
                        pass
        self._undo.append(junk.unlink)

    def protect(self, name: str) -> None:
        """Make a folder read-only for all files that are opened in it from now on."""
        if not self.mounted:
            self.replace(name)
            return
        place = "/dev/shm" if name == "shm" else str(self.folders / name)
        # What has files open for writing cannot be made read-only, a second mount on top of it can.
        self._enter("mount", "--bind", place, place)
        self._undo.append(lambda: self._enter("umount", "--lazy", place))
        self._enter("mount", "-o", "remount,bind,ro", place)

    def remove(self, name: str) -> None:
        """Delete everything in a folder, as programs do that clean up."""
        for entry in self._seen(name).iterdir():
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()

    def replace(self, name: str) -> None:
        """Put a file where a folder was."""
        place = self._seen(name)
        aside = place.with_name(f"{name}-aside")
        place.rename(aside)
        place.write_text("")
        self._undo += [lambda: aside.rename(place), place.unlink]

    # The clock

    def set_clock(self, seconds: float) -> None:
        """Let the service's clock be wrong by so much."""
        self.clock.write_text(str(seconds))
        self._undo.append(lambda: self.clock.write_text("0"))

    # The core

    def hang_loading(self) -> None:
        """Let processes that compute hang before they have loaded the core."""
        self.loading.touch()
        self._undo.append(self.loading.unlink)

    def computes(self) -> bool:
        """Whether a request is answered that a process computes."""
        method, path, body = ASKED[1]
        url = f"{self.service.url}{path}"
        return httpx2.request(method, url, json=body, trust_env=False, timeout=PATIENCE).status_code == 200

    def mend(self) -> None:
        """Undo what was done."""
        while self._undo:
            self._undo.pop()()

    # What must hold

    def enter_room(self) -> None:
        """Let a teacher open a room and a student join."""
        options: dict[str, Any] = {"trust_env": False, "verify": False, "timeout": 20}
        with httpx2.Client(base_url=self.service.url, **options) as teacher:
            assert teacher.post("/room", data={"title": "Kinematics", "hours": "2"}).status_code == 303
            found = re.search(r'class="code">([^<]+)<', teacher.get("/room").text)
            assert found
        with httpx2.Client(base_url=self.service.url, **options) as student:
            joined = student.post("/room/join", data={"code": found[1], "alias": "Ada"})
            assert joined.status_code == 303, joined.text
            self.cookie = f"{COOKIE}={student.cookies[COOKIE]}"

    def student(self) -> FakeBrowser:
        """A page of the student, at an exercise; tried again while the viewer starts."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                return self._student()
            except (AssertionError, WebSocketException):
                if time.monotonic() > end:
                    raise

    def _student(self) -> FakeBrowser:
        memory = json.dumps({"address": "http://127.0.0.1/", "state": encode(PageState(lesson="exercises"))})
        tab = FakeBrowser(
            self.service.port, memory=memory, additional_headers={"Cookie": self.cookie}, close_timeout=0.1
        )
        try:
            tab.__enter__()
            tab.wait(lambda: "data-exercises" in tab.html)
            tab.say("feature", ["exercises", ["open", EXERCISE, 1], None])
            tab.wait(lambda: f'data-exercise="{EXERCISE}"' in tab.html)
        except BaseException:
            tab.close()
            raise
        return tab

    def answer(self, tab: FakeBrowser) -> None:
        """Let the student give an answer, and wait until the page says that it is stored."""
        before = stored(tab)
        tab.say("feature", ["exercises", ["answer", 100 + self.confirmed], 0])
        tab.wait(lambda: stored(tab) > before, timeout=PATIENCE)
        self.confirmed += 1

    def kept(self) -> int:
        """How many answers are in the database."""
        with tempfile.TemporaryDirectory() as folder:  # SQLite opens nothing below /proc
            copy = shutil.copytree(self._seen("data") / "in", folder, dirs_exist_ok=True)
            (file,) = Path(copy).glob("*.db")
            with contextlib.closing(sqlite3.connect(file)) as connection:
                count: int = connection.execute(f"SELECT count(*) FROM {Attempt.__tablename__}").fetchone()[0]
        return count

    def visit(self, within: float) -> float:
        """Seconds until a visitor can open a page and move a joint; fails after `within`."""
        began = time.monotonic()
        while True:
            try:
                with FakeBrowser(self.service.port, close_timeout=0.1, open_timeout=2) as tab:
                    tab.set("1 rotating base", 12.0)
                    tab.wait(lambda: 'data-status="hand"' in tab.html, timeout=within)
                return time.monotonic() - began
            except (OSError, AssertionError, WebSocketException):
                if time.monotonic() - began > within:
                    raise
                time.sleep(0.1)


def stored(tab: FakeBrowser) -> int:
    """How many answers the page says are stored."""
    found = re.search(r'data-class-stored="(\d+)"', tab.html)
    return int(found[1]) if found else 0


# Folders of the operator, and the file that the service reads in each at its start.
EXERCISE_FILE = """
id = "of-this-machine"
title = "Of this machine"
topic = "Forward kinematics"
level = 1
robot = "of-this-machine"
kind = "number"
text = "What is θ1?"

[answer]
value = "q1"
unit = "deg"
tolerance = 0.5
method = "It is read from the slider."
"""
SEEDS = {
    "robots": robot_file(replace(get_robot("planar3r"), id="of-this-machine"), "toml"),
    "exercises": EXERCISE_FILE,
    "courses": 'title = "Of this machine"\n[[item]]\nexercise = "of-this-machine"\n',
}


def seed(folder: Path) -> None:
    """Write what the folders of a machine hold at first."""
    for name in ("temp", *SEEDS):
        (folder / name / "in").mkdir(parents=True)
    for name, text in SEEDS.items():
        (folder / name / "in" / "of-this-machine.toml").write_text(text)


@contextmanager
def running_machine(base: Path) -> Iterator[Machine]:
    """A service with folders and a clock of its own, and a student in a room."""
    folders, clock, loading, seeds = (base / name for name in ("folders", "clock", "loading", "seeds"))
    seed(seeds)
    clock.write_text("0")
    (base / "code").mkdir()
    (base / "code" / "sitecustomize.py").write_text(STARTUP)
    mounted = can_mount()
    for name in ("data", *(each.name for each in seeds.iterdir())):
        (folders / name).mkdir(parents=True)
    if not mounted:
        shutil.copytree(seeds, folders, dirs_exist_ok=True)
    environment = {
        "PYTHONPATH": os.pathsep.join((str(base / "code"), str(ROOT))),
        "FAULTY_CLOCK": str(clock),
        "FAULTY_LOADING": str(loading),
        "FAULTY_FOLDERS": str(folders),
        "FAULTY_SEEDS": str(seeds),
        "FAULTY_SIZE": str(MOST),
        "TMPDIR": str(folders / "temp" / "in"),
        "KINBOARD_DATA": str(folders / "data" / "in"),
        "KINBOARD_COMPUTE": "1",
        "KINBOARD_TIME_BUDGET": str(SILENCE),
        "KINBOARD_WORKER_TIMEOUT": str(SILENCE),
    } | {f"KINBOARD_{name.upper()}": str(folders / name / "in") for name in SEEDS}
    before = (*APART, "sh", "-c", MOUNT, "sh") if mounted else ()
    with (
        platforms(base) as (file, addresses),
        victim(True, before=before, KINBOARD_LTI=str(file), **environment) as service,
    ):
        yield Machine(service, folders, clock, loading, mounted, addresses)


def strain() -> float:
    """How much longer work takes than on a machine with a free processor: at least 1."""
    began, before = time.monotonic(), os.times()
    subprocess.run([sys.executable, "-c", "import numpy, asyncio, email"], check=True)
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return max(1.0, (time.monotonic() - began) / max(used, 0.1))


class Asking(threading.Thread):
    """Asks over new connections, one request after the other, until the end of the context: REST, health, rooms.

    Attributes:
        answers: seconds and status of each request; None: the connection broke.
    """

    def __init__(self, service: Victim) -> None:
        super().__init__()
        self._url = service.url
        self._ended = threading.Event()
        self.answers: list[tuple[float, int | None]] = []

    def __enter__(self) -> Asking:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self.join(PATIENCE)

    def run(self) -> None:
        options: dict[str, Any] = {"trust_env": False, "timeout": PATIENCE, "verify": False}
        for method, path, body in itertools.cycle(ASKED):
            if self._ended.wait(0.02):
                return
            began = time.monotonic()
            status: int | None = None
            with contextlib.suppress(httpx2.TransportError):
                status = httpx2.request(method, f"{self._url}{path}", json=body, **options).status_code
            self.answers.append((time.monotonic() - began, status))


class Peer(socketserver.ThreadingTCPServer):
    """A server that misbehaves: silent, slow (a byte a second) or lying (no HTTP)."""

    allow_reuse_address = daemon_threads = True

    def __init__(self, manner: str) -> None:
        closing = threading.Event()

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                if manner == "lying":
                    self.request.sendall(b"\x00\xff" * 5000)
                for byte in b"HTTP/1.1 200 OK\r\n" * 100 if manner == "slow" else b"":
                    with contextlib.suppress(OSError):
                        self.request.sendall(bytes([byte]))
                    if closing.wait(1.0):
                        return
                if manner == "silent":
                    closing.wait(120)

        super().__init__(("127.0.0.1", 0), Handler)
        self.closing = closing
        self._thread = threading.Thread(target=self.serve_forever)
        self._thread.start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    def close(self) -> None:
        self.closing.set()
        self.shutdown()
        self._thread.join()
        self.server_close()


MANNERS = ("silent", "slow", "lying")


@contextmanager
def platforms(folder: Path) -> Iterator[tuple[Path, dict[str, str]]]:
    """Learning platforms, one for each manner: the file that registers them, and their addresses."""
    with contextlib.ExitStack() as stack:
        addresses = {}
        for manner in MANNERS:
            peer = Peer(manner)
            stack.callback(peer.close)
            addresses[manner] = peer.url
        file = folder / "platforms.toml"
        urls = ("login_url", "token_url", "keys_url")
        file.write_text(
            "\n".join(
                f'[[platform]]\nissuer = "{url}"\nclient_id = "us"\ndeployments = ["1"]\n'
                + "".join(f'{name} = "{url}/{name}"\n' for name in urls)
                for url in addresses.values()
            )
        )
        make_key(key_file(file, {}))
        yield file, addresses


def launch(service: Victim, issuer: str) -> int:
    """Launch as a student of a platform whose key the service does not know yet: the status of the answer."""
    options: dict[str, Any] = {"trust_env": False, "verify": False, "timeout": 60}
    asked = {"iss": issuer, "client_id": "us", "login_hint": "7"}
    login = httpx2.get(f"{service.url}/lti/login", params=asked, **options)
    assert login.status_code == 303, login.text
    query = parse_qs(urlsplit(login.headers["location"]).query)
    claims = {"iss": issuer, "aud": "us", "sub": "7", "exp": time.time() + 60, "nonce": query["nonce"][0]}
    token = jwt.encode(claims, rsa.generate_private_key(65537, 2048), "RS256", {"kid": "unknown"})
    sent = {"id_token": token, "state": query["state"][0]}
    cookie = login.headers["set-cookie"].partition(";")[0]
    return httpx2.post(f"{service.url}/lti/launch", data=sent, headers={"Cookie": cookie}, **options).status_code


def launches(service: Victim, issuer: str, count: int = 20) -> contextlib.ExitStack:
    """Many students of one platform at once; at the end, each must have been refused in words."""
    statuses: list[int] = []
    threads = [threading.Thread(target=lambda: statuses.append(launch(service, issuer))) for _ in range(count)]
    for thread in threads:
        thread.start()

    def end() -> None:
        for thread in threads:
            thread.join(60)
        assert len(statuses) == count
        assert set(statuses) <= {403, 429, 503}, statuses

    stack = contextlib.ExitStack()
    stack.callback(end)
    return stack


def misbehave(service: Victim, manner: str, first: bytes, lie: bytes, count: int = 20) -> contextlib.ExitStack:
    """Clients with connections of their own: silent after `first`, slow with each byte of it, or sending `lie`."""
    stack = contextlib.ExitStack()
    ended = threading.Event()

    def act() -> None:
        with contextlib.suppress(OSError), service.connection(receive=4096) as connection:
            if manner == "slow":
                for byte in first:
                    connection.sendall(bytes([byte]))
                    if ended.wait(0.5):
                        return
            else:
                connection.sendall(first if manner == "silent" else lie)
            ended.wait(120)

    threads = [threading.Thread(target=act) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        stack.callback(thread.join, 30)
    stack.callback(ended.set)
    return stack
