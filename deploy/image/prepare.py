"""Last step of building the image: start the service once, as its users will, and visit it.

That leaves behind what every start of every container would otherwise make anew, for seconds: bytecode of exactly
those modules that a service imports. Python's own modules are among them; the base image comes without their
bytecode.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
import urllib.error
import urllib.request

import viser
from websockets.sync.client import connect

PORT = 8000
PATIENCE = 300  # s; a small or emulated machine
FK = "/api/v1/robots/pioneer5/fk"
PAGES = ("/", "/docs", "/openapi.json", "/static/landing.css", "/viewer/", "/api/v1/robots")


def main() -> int:
    with subprocess.Popen(["kinboard", "serve", "--host", "127.0.0.1", "--port", str(PORT)]) as service:
        try:
            wait_until_ready(service)
            visit()
        finally:
            service.terminate()
    return service.returncode


def wait_until_ready(service: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + PATIENCE
    while True:
        try:
            ask("/readyz")
            return
        except urllib.error.HTTPError as error:
            if json.load(error)["status"] == "failed":
                raise SystemExit("the service could not prepare itself; its message is above") from error
        except OSError:  # does not listen yet
            if service.poll() is not None:
                raise SystemExit("the service ended; its message is above") from None
        if time.monotonic() > end:
            raise SystemExit(f"the service was not ready after {PATIENCE} s")
        time.sleep(1.0)


def visit() -> None:
    for page in PAGES:
        ask(page)
    ask(FK, json.dumps({"q": [0.0] * 5}).encode())
    viewer = f"ws://127.0.0.1:{PORT}/viewer"
    with connect(viewer, subprotocols=[f"viser-v{viser.__version__}"], max_size=None, proxy=None) as socket:
        socket.recv(timeout=30)


def ask(path: str, body: bytes | None = None) -> None:
    request = urllib.request.Request(f"http://127.0.0.1:{PORT}{path}", body, {"Content-Type": "application/json"})
    straight = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with straight.open(request, timeout=30) as answer:
        answer.read()


if __name__ == "__main__":
    sys.exit(main())
