"""Firefox and WebKitGTK under remote control: the commands of W3C WebDriver, which both understand.

WebKitWebDriver takes them over HTTP. Firefox takes them over its own socket, in the protocol Marionette: a message
is ``length:json``, a command ``[0, number, name, parameters]``, its answer ``[1, number, error, result]``.
https://www.w3.org/TR/webdriver2/, https://firefox-source-docs.mozilla.org/testing/marionette/Protocol.html
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

import pytest

WAIT = 150.0  # s; both draw in software, WebKit much more slowly
# Firefox asks nothing of its makers, and says nothing about being new.
PREFERENCES = {
    "app.update.disabledForTesting": True,
    "app.normandy.enabled": False,
    "browser.aboutwelcome.enabled": False,
    "browser.safebrowsing.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.page": 0,
    "datareporting.policy.dataSubmissionEnabled": False,
    "extensions.update.enabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "services.settings.server": "data:,#remote-settings-dummy/v1",
    "toolkit.telemetry.server": "data:,",
}


class DriverError(Exception):
    """The browser refused a command."""


class Connection(Protocol):
    """How commands reach a browser."""

    def send(self, name: str, parameters: Mapping[str, Any]) -> Any:
        """The result of a command; raises `DriverError`."""
        ...


class Http:
    """Commands as requests to WebKitWebDriver."""

    def __init__(self, port: int, capabilities: Mapping[str, Any]) -> None:
        self._session = f"http://127.0.0.1:{port}/session"
        asked = {"capabilities": {"alwaysMatch": capabilities}}
        self._session += "/" + self._request("POST", "", asked)["sessionId"]

    def send(self, name: str, parameters: Mapping[str, Any]) -> Any:
        method, path = {
            "Navigate": ("POST", "/url"),
            "Refresh": ("POST", "/refresh"),
            "ExecuteScript": ("POST", "/execute/sync"),
            "PerformActions": ("POST", "/actions"),
            "SetWindowRect": ("POST", "/window/rect"),
            "TakeScreenshot": ("GET", "/screenshot"),
            "DeleteSession": ("DELETE", ""),
        }[name]
        return self._request(method, path, parameters if method == "POST" else None)

    def _request(self, method: str, path: str, parameters: Mapping[str, Any] | None) -> Any:
        data = None if parameters is None else json.dumps(parameters).encode()
        headers = {"Content-Type": "application/json"}
        asked = urllib.request.Request(self._session + path, data, headers, method=method)
        try:
            with urllib.request.urlopen(asked, timeout=2 * WAIT) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            with error:
                raise DriverError(json.load(error)["value"]["message"]) from None


class Marionette:
    """Commands over Firefox's socket."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), 2 * WAIT)
        self._read = self._socket.makefile("rb")
        self._number = 0
        self._message()  # the greeting
        self.send("NewSession", {})

    def send(self, name: str, parameters: Mapping[str, Any]) -> Any:
        self._number += 1
        data = json.dumps([0, self._number, f"WebDriver:{name}", parameters]).encode()
        self._socket.sendall(b"%d:%s" % (len(data), data))
        _, number, error, result = self._message()
        assert number == self._number
        if error:
            raise DriverError(error["message"])
        if name == "DeleteSession":
            self._read.close()
            self._socket.close()
        return result["value"] if isinstance(result, dict) and set(result) == {"value"} else result

    def _message(self) -> Any:
        length = b""
        while (character := self._read.read(1)) != b":":
            assert character, "Firefox ended the connection"
            length += character
        return json.loads(self._read.read(int(length)))


class RemotePage:
    """The one page of a browser. Elements are named by expressions of JavaScript that find them."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def run(self, script: str, *arguments: Any) -> Any:
        """What a script returns in the page; `arguments` are its own."""
        # As the page's own code: Firefox runs scripts in a scope that does not have the page's constants.
        whole = f"return window.eval({json.dumps(f'(function () {{ {script} }})')}).apply(null, arguments)"
        return self._connection.send("ExecuteScript", {"script": whole, "args": list(arguments)})

    def wait(self, expression: str, *arguments: Any) -> Any:
        """The value of an expression as soon as it is true; of an element, true."""
        end = time.monotonic() + WAIT
        script = f"const found = {expression}; return found instanceof Node || found"
        while not (found := self.run(script, *arguments)):
            assert time.monotonic() < end, f"{expression} {arguments} is {found!r}; the page: {self.text()}"
            time.sleep(0.1)
        return found

    def text(self) -> str:
        """What the page shows."""
        return str(self.run("return document.body.innerText"))

    def open(self, address: str) -> None:
        self._connection.send("Navigate", {"url": address})

    def reload(self) -> None:
        self._connection.send("Refresh", {})

    def resize(self, width: int, height: int) -> None:
        """Give the page's window this size, without its frame as far as the browser allows."""
        rect = {"width": width, "height": height}
        self._connection.send("SetWindowRect", rect)
        inside = self.run("return [innerWidth, innerHeight]")
        rect = {"width": 2 * width - inside[0], "height": 2 * height - inside[1]}
        self._connection.send("SetWindowRect", rect)

    def screenshot(self) -> bytes:
        """The window as a PNG file."""
        return base64.b64decode(self._connection.send("TakeScreenshot", {"full": False}))

    def middle(self, element: str) -> list[float]:
        """The middle of an element in the window, as soon as there is one."""
        self.wait(f"({element}) != null")
        script = (
            f"const e = {element}; e.scrollIntoView({{ block: 'nearest' }}); const r = e.getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]"
        )
        found: list[float] = self.run(script)
        return found

    def click(self, element: str) -> None:
        self.drag(self.middle(element))

    def drag(self, *way: list[float]) -> None:
        """Press at the first point, move through the others, and release."""
        moves = [{"type": "pointerMove", "duration": 60, "x": round(x), "y": round(y)} for x, y in way]
        acts = [moves[0], {"type": "pause", "duration": 200}, {"type": "pointerDown", "button": 0}]
        acts += [*moves[1:], {"type": "pointerUp", "button": 0}]
        self._act({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": acts})

    def press(self, *keys: str) -> None:
        """Press keys one after the other; several characters are typed."""
        acts = [{"type": kind, "value": key} for text in keys for key in text for kind in ("keyDown", "keyUp")]
        self._act({"type": "key", "id": "keyboard", "actions": acts})

    def fill(self, field: str, text: str) -> None:
        """Replace the text of a field, and press Enter."""
        self.click(field)
        self.run(f"({field}).select()")
        self.press(text, ENTER)

    def _act(self, source: Mapping[str, Any]) -> None:
        self._connection.send("PerformActions", {"actions": [source]})


ENTER, RIGHT = "\ue007", "\ue014"  # as WebDriver writes these keys


@contextlib.contextmanager
def started(
    browser: str, folder: Path, preferences: Mapping[str, bool | int | str] | None = None
) -> Iterator[RemotePage]:
    """A browser on a screen of its own: ``firefox`` or ``webkit``.

    Args:
        folder: for its profile and logs.
        preferences: further ones of Firefox.
    """
    with contextlib.ExitStack() as stack:
        env = {**os.environ, "HOME": str(folder), "LC_ALL": "C.UTF-8", "DISPLAY": stack.enter_context(screen())}
        port = free_port()
        if browser == "firefox":
            wanted = {**PREFERENCES, **(preferences or {}), "marionette.port": port}
            lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in wanted.items()]
            (folder / "user.js").write_text("\n".join(lines))
            command = ["firefox-esr", "--marionette", "--no-remote", "--profile", str(folder)]
        else:
            command = ["WebKitWebDriver", f"--port={port}"]
        stack.enter_context(running(command, env, folder / "log"))
        wait_for_port(port)
        connection: Http | Marionette
        if browser == "firefox":
            connection = Marionette(port)
        else:
            (program,) = Path("/usr/lib").glob("*/webkit2gtk-4.1/MiniBrowser")
            options = {"binary": str(program), "args": ["--automation"]}
            connection = Http(port, {"browserName": "MiniBrowser", "webkitgtk:browserOptions": options})
        stack.callback(connection.send, "DeleteSession", {})
        yield RemotePage(connection)


@contextlib.contextmanager
def running(command: list[str], env: Mapping[str, str], log: Path) -> Iterator[None]:
    """A process that is ended afterwards."""
    with log.open("wb") as output, contextlib.ExitStack() as stack:
        try:
            process = stack.enter_context(subprocess.Popen(command, env=env, stdout=output, stderr=output))
        except FileNotFoundError:
            pytest.fail(f"no {command[0]}: apt-get install firefox-esr webkit2gtk-driver xvfb")
        try:
            yield
        finally:
            process.terminate()


@contextlib.contextmanager
def screen() -> Iterator[str]:
    """An X server without a screen of glass; yields its name."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1200x24", "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL) as server:
        os.close(write)
        try:
            with os.fdopen(read) as number:
                yield f":{int(number.readline())}"
        finally:
            server.terminate()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
        return port


def wait_for_port(port: int) -> None:
    end = time.monotonic() + WAIT
    while True:
        try:
            socket.create_connection(("127.0.0.1", port)).close()
        except ConnectionRefusedError:
            assert time.monotonic() < end, f"nothing listens on port {port}"
            time.sleep(0.1)
        else:
            return
