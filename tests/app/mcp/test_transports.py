"""An agent's conversation with a real process: over standard input and output, and over HTTP with a page."""

from __future__ import annotations

import asyncio
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from fake_browser import FakeBrowser
from live_code import code_of
from live_server import serve, wait_for
from mcp import Client

from app.service.main import create_app
from app.shared.settings import Settings

ROOT = Path(__file__).parents[3]
GUIDE = (ROOT / "docs/agents.md").read_text(encoding="utf-8")

pytestmark = pytest.mark.full


def test_the_conversation_of_the_guide_over_standard_input_and_output(tmp_path):
    (example,) = re.findall(r"^```py\n(.*?)^```$", GUIDE, re.DOTALL | re.MULTILINE)
    command = tmp_path / "kinboard"
    command.write_text(
        f'#!/bin/sh\ncd {shlex.quote(str(ROOT))} && exec {shlex.quote(sys.executable)} -m app.cli "$@"\n'
    )
    command.chmod(0o755)
    path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        [sys.executable, "-c", example],
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    tools, out_of_reach, refused, picture = done.stdout.splitlines()
    assert tools.startswith("['list_robots', ")
    assert out_of_reach.startswith("unreachable Out of reach")
    assert refused.startswith("False ")
    assert "joint" in refused
    assert picture == "image/png"


def test_an_agent_drives_a_page_of_the_service_until_stop_is_pressed():
    settings = Settings(mcp=True, compute=0)
    app = create_app(settings)
    with serve(app, settings) as port:
        wait_for(lambda: app.state.startup.status == "ready", 120.0)
        with FakeBrowser(port, path="/viewer") as page:
            page.choose("UR5")
            asyncio.run(_drive(port, page, code_of(page)))


async def _drive(port: int, page: FakeBrowser, code: str) -> None:
    async with Client(f"http://127.0.0.1:{port}/mcp") as client:
        q = [0.3, -1.2, 1.4, -0.4, 0.5, 0.2]
        moved = await client.call_tool("drive_page", {"code": code, "q": q})
        assert moved.structured_content["robot"]["id"] == "ur5"
        assert moved.structured_content["q"] == pytest.approx(q)
        target = {"position": [0.4, 0.2, 0.4]}
        solved = await client.call_tool("drive_page", {"code": code, "target": target})
        assert solved.structured_content["result"]["status"] == "solved"

        def stop() -> None:
            page.wait(lambda: "mcp is connected." in page.html)
            assert 'data-guide-do="stop"' in page.html
            page.say("feature", ["connect", ["stop", 0], None])
            page.wait(lambda: 'data-guide-do="stop"' not in page.html)

        await asyncio.to_thread(stop)
        ended = await client.call_tool("drive_page", {"code": code, "q": q})
        assert ended.is_error
        assert "withdrawn" in ended.content[0].text or "No page has the code" in ended.content[0].text
