"""What the tests of a service under attack share: the service as a process, and raw connections to it."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx2
import psutil
from live_server import wait_for

ROOT = Path(__file__).parents[3]
ARM = "/api/v1/robots/pioneer5"
GET = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"


@dataclass
class Victim:
    """A service as a process of its own.

    Attributes:
        errors: what it has written to standard error so far.
    """

    process: subprocess.Popen[str]
    port: int
    errors: list[str]

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def log(self) -> str:
        return "".join(self.errors)

    def memory(self) -> int:
        """Resident bytes of all processes."""
        service = psutil.Process(self.process.pid)
        return sum(each.memory_info().rss for each in (service, *service.children(recursive=True)))

    def answers_after(self) -> float:
        """Seconds until a new connection's request is answered."""
        began = time.monotonic()
        assert httpx2.get(f"{self.url}/livez", trust_env=False, timeout=60).status_code == 200
        return time.monotonic() - began

    def metric(self, line: str) -> float:
        """Value of a metric, 0 if it is absent."""
        text = httpx2.get(f"{self.url}/metrics", trust_env=False).text
        found = re.search(rf"^{re.escape(line)} (\S+)$", text, re.MULTILINE)
        return float(found[1]) if found else 0.0

    def connection(self, source: str = "127.0.0.1", **options: int) -> socket.socket:
        """A connection from an address of this machine. Options: `receive`, the size of its buffer."""
        connection = socket.socket()
        connection.settimeout(60)
        if "receive" in options:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, options["receive"])
        connection.bind((source, 0))
        connection.connect(("127.0.0.1", self.port))
        return connection


@contextmanager
def victim(
    ready: bool = False, files: int | None = None, before: Sequence[str] = (), **environment: str
) -> Iterator[Victim]:
    """Start a service.

    Args:
        ready: wait until kernels and viewer are ready, not only until it answers.
        files: how many files it may open.
        before: a command that becomes the one in its arguments.
        environment: its settings.
    """
    env = os.environ | {"PYTHONPATH": str(ROOT), "KINBOARD_PORT": "0"} | environment
    limit = f"import resource as r; r.setrlimit(r.RLIMIT_NOFILE, ({files},) * 2)\n" if files else ""
    code = f"{limit}import sys; from app.cli.parser import main; sys.exit(main(['serve']))"
    with subprocess.Popen(
        [*before, sys.executable, "-c", code],
        cwd=ROOT,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        errors: list[str] = []
        reading = threading.Thread(target=lambda: errors.extend(process.stderr or ()), daemon=True)
        reading.start()
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            if found is None:  # it has ended, and said why
                reading.join(10)
            assert found, "".join(errors)
            service = Victim(process, int(found[1]), errors)
            path = "readyz" if ready else "livez"
            url = f"{service.url}/{path}"
            wait_for(lambda: httpx2.get(url, trust_env=False, timeout=30).status_code == 200, 300)
            yield service
        finally:
            process.kill()
            reading.join(10)


def answer_to(connection: socket.socket, until_closed: bool = True) -> bytes:
    """What arrives until the connection is closed or, if not `until_closed`, until the end of the first head."""
    received = b""
    while until_closed or b"\r\n\r\n" not in received:
        try:
            chunk = connection.recv(65536)
        except ConnectionResetError:
            break
        if not chunk:
            break
        received += chunk
    return received


def problem_in(answer: bytes) -> dict[str, object]:
    """The problem document of a raw answer."""
    head, _, body = answer.partition(b"\r\n\r\n")
    assert b"application/problem+json" in head, answer
    document: dict[str, object] = json.loads(body)
    return document


def closed(connection: socket.socket, seconds: float = 0.0) -> bool:
    """Whether the service has closed this connection; unread data is dropped."""
    connection.settimeout(seconds or 0.001)
    try:
        while connection.recv(1 << 20):
            pass
    except TimeoutError:
        return False
    except OSError:
        return True
    return True
