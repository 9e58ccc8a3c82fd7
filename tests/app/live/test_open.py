"""`kinboard open`: a page with an arm, and the code with which a program connects to this page and no other."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import LISTENING, ready, wait_for

import kin
from app.cli import parser
from app.live.client import RefusedError
from app.service import main as service
from app.service import server
from app.service.server import Greeting
from app.viewer.session.state import PageState, encode

ROOT = Path(__file__).parents[3]
LINE = re.compile(r'page = kin\.connect\("([^"]+)", "([A-Z0-9-]+)"\)')


def memory_of(url: str) -> str:
    """What the page at an address stores for the service."""
    parts = urlsplit(url)
    stored = {"shown": parse_qs(parts.query)["shown"][0], "address": f"http://{parts.netloc}/"}
    if parts.fragment:
        stored["state"] = parse_qs(parts.fragment)["s"][0]
    return json.dumps(stored)


def offers(page: FakeBrowser, label: str) -> bool:
    return any(message["props"].get("label") == label for message in page.gui.values())


@pytest.fixture
def opened(monkeypatch, viewer) -> Callable[..., tuple[str, str, Any]]:
    """Runs the command, with the viewer of the tests as its service; returns the page, the code, the settings."""

    def run(*words: str) -> tuple[str, str, Any]:
        asked: list[Any] = []

        def serve(settings: Any, open_browser: bool, page: str, words: str) -> int:
            assert open_browser
            asked.extend((page, words, settings))
            return 0

        monkeypatch.setattr(service, "run", serve)
        assert parser.main(["open", *words]) == 0
        page, text, settings = asked
        found = LINE.search(text)
        assert found is not None
        assert found[1] == "{url}"
        return f"http://127.0.0.1:{viewer}/{page}", found[2], settings

    return run


def test_the_printed_code_is_that_of_the_page_and_of_no_other(opened, viewer):
    url, code, _ = opened("ur5")
    assert code not in url
    assert code.replace("-", "") not in url, "other users of the machine see the address in the list of processes"
    address = f"http://127.0.0.1:{viewer}/"
    with pytest.raises(RefusedError, match="No page has the code"):
        kin.connect(address, code)
    with FakeBrowser(viewer, memory=memory_of(url)) as page:
        page.wait(lambda: f"data-live-code>{code}<" in page.html)
        with kin.connect(address, code) as arm:
            assert arm.robot.id == "ur5"
            q = arm.q + 0.1
            arm.q = q
            page.wait(lambda: bool(np.allclose(page.tool_pose(), kin.fk(arm.robot, q), atol=1e-5)))
            with FakeBrowser(viewer, memory=memory_of(url)) as again:  # who has read the address
                again.wait(lambda: offers(again, "Connect a program"))
                assert "data-live-code" not in again.html
                assert arm.connected
        page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
        page.wait(lambda: offers(page, "Connect a program"))
        with pytest.raises(RefusedError, match="No page has the code"):
            kin.connect(address, code)


def test_an_arm_of_a_file_and_no_arm(opened, viewer, tmp_path):
    mine = kin.robot_from_dict({**kin.robot_to_dict(kin.get_robot("scara")), "id": "mine", "name": "My arm"})
    file = tmp_path / "mine.toml"
    kin.save_robot(mine, file)
    url, code, _ = opened(str(file))
    with (
        FakeBrowser(viewer, memory=memory_of(url)) as page,
        kin.connect(f"http://127.0.0.1:{viewer}", code) as arm,
    ):
        assert arm.robot.name == "My arm"
        assert len(page.sliders) >= arm.robot.n
    url, other, _ = opened()
    assert not urlsplit(url).fragment
    assert other != code


def test_it_is_a_service_for_this_machine_alone(opened, monkeypatch, tmp_path):
    for name, value in {"HOST": "0.0.0.0", "COMPUTE": "2", "TOKEN": "t" * 20, "ROOT_PATH": "/arms"}.items():
        monkeypatch.setenv(f"KINBOARD_{name}", value)
    kin.save_robot(
        kin.robot_from_dict({**kin.robot_to_dict(kin.get_robot("scara")), "id": "mine"}), tmp_path / "mine.toml"
    )
    url, _, settings = opened("mine", "--robots", str(tmp_path))
    assert url.endswith(f"#s={encode(PageState(robot='mine'))}")
    assert (settings.host, settings.port, settings.compute, settings.token) == ("127.0.0.1", 0, 0, None)
    assert (settings.root_path, settings.robots) == ("", tmp_path)


def test_an_unknown_arm_or_a_wrong_setting_is_exit_code_2(capsys, monkeypatch):
    assert parser.main(["open", "nosuch"]) == 2
    assert "robot: got 'nosuch', expected one of pioneer5" in capsys.readouterr().err
    monkeypatch.setenv("KINBOARD_PORT", "many")
    assert parser.main(["open"]) == 2
    assert "KINBOARD_PORT: got 'many'" in capsys.readouterr().err


def test_without_a_browser_the_address_of_the_page_is_printed(capsys, monkeypatch):
    tried: list[str] = []
    monkeypatch.setattr(server.webbrowser, "open", lambda url: tried.append(url) or False)
    Greeting("http://127.0.0.1:1/", True, None, "viewer/?shown=T#s=S", "connect to {url}").show()
    said = ""

    def printed() -> bool:
        nonlocal said
        said += capsys.readouterr().out
        return "No browser" in said

    wait_for(printed)
    assert tried == ["http://127.0.0.1:1/viewer/?shown=T#s=S"]
    assert "connect to http://127.0.0.1:1/\n" in said
    assert f"open {tried[0]} yourself" in said


@pytest.mark.full
def test_the_program_opens_the_browser_and_ends_with_ctrl_c(tmp_path):
    browser, seen, said = tmp_path / "browser", tmp_path / "seen", tmp_path / "said"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {seen}.part && mv {seen}.part {seen}\n')
    browser.chmod(0o755)
    environment = {**os.environ, "BROWSER": f"{browser} %s", "PYTHONPATH": str(ROOT)}
    opening = "import sys; from app.cli.parser import main; sys.exit(main(['open', 'ur5']))"
    words = [sys.executable, "-c", f"{LISTENING}; {opening}"]
    with said.open("w") as out:
        process = subprocess.Popen(words, env=environment, stdout=out, stderr=out)
    try:
        wait_for(seen.exists, 60.0)
        url = seen.read_text()
        found = LINE.search(said.read_text())
        assert found is not None
        address, code = found.groups()
        assert url.startswith(f"{address}viewer/?shown=")
        wait_for(lambda: ready(address), 120.0)
        where = f"ws://{urlsplit(address).netloc}/viewer"
        with FakeBrowser(where, memory=memory_of(url)) as page, kin.connect(address, code) as arm:
            page.wait(lambda: f"data-live-code>{code}<" in page.html)
            assert arm.robot.id == "ur5"
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0
        assert "Traceback" not in said.read_text()
    finally:
        process.kill()
        process.wait()
