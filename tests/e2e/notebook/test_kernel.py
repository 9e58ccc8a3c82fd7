"""`kin.show` in a real Jupyter kernel: the page in the output of a cell, and the end with the kernel."""

from __future__ import annotations

import html
import os
import re
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from jupyter_client.blocking.client import BlockingKernelClient
from jupyter_client.manager import KernelManager
from page import NO_HINTS, PLAIN, WAIT
from playwright.sync_api import Browser, expect

pytestmark = [pytest.mark.browser, pytest.mark.full]

ROOT = Path(__file__).parents[3]
PATIENCE = 60.0  # s for a cell


@pytest.fixture
def kernel(tmp_path: Path) -> Iterator[KernelManager]:
    """A kernel without the settings of this machine's notebooks."""
    manager = KernelManager(kernel_name="python3", transport="ipc", ip=str(tmp_path / "kernel"))
    paths = {"PYTHONPATH": str(ROOT), "IPYTHONDIR": str(tmp_path), "PYDEVD_DISABLE_FILE_VALIDATION": "1"}
    manager.start_kernel(env={**os.environ, **paths}, cwd=str(tmp_path))
    yield manager
    if manager.has_kernel:
        manager.shutdown_kernel(now=True)
    manager.cleanup_resources()


def run(client: BlockingKernelClient, cell: str) -> dict[str, str]:
    """Run a cell; returns its result by media type."""
    found: dict[str, str] = {}

    def output(message: dict[str, Any]) -> None:
        if message["msg_type"] == "execute_result":
            found.update(message["content"]["data"])

    reply = client.execute_interactive(cell, timeout=PATIENCE, output_hook=output)
    assert reply["content"]["status"] == "ok", reply["content"].get("traceback")
    return found


def serves(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(2)
        return probe.connect_ex(("127.0.0.1", port)) == 0


def test_a_cell_shows_the_arm_until_its_kernel_ends(kernel: KernelManager, browser: Browser) -> None:
    client = kernel.blocking_client()
    client.start_channels()
    page = browser.new_page(viewport={"width": 1000, "height": 480})
    try:
        client.wait_for_ready(timeout=PATIENCE)
        shown = run(client, 'import kin\nview = kin.show("scara", [0.3, 0.5, 0.1, 0.0], panel=True)\nview')
        frame = re.search(r'<iframe src="([^"]*)"', shown["text/html"])
        assert frame is not None
        address = html.unescape(frame[1])
        page.add_init_script(PLAIN + NO_HINTS)
        page.goto(address)
        for name in ("1 shoulder", "2 elbow", "3 quill", "4 tool turn"):
            expect(page.get_by_text(name, exact=True)).to_be_visible(timeout=WAIT)
        quill = page.get_by_text("3 quill", exact=True).locator("xpath=ancestor::div[.//input][1]//input")
        expect(quill.last).to_have_value("100", timeout=WAIT)
        run(client, "view.q = [0.3, 0.5, 0.05, 0.0]")
        expect(quill.last).to_have_value("50", timeout=WAIT)
    finally:
        page.close()
        client.stop_channels()
    port = urlsplit(address).port
    assert port is not None
    assert serves(port)
    kernel.shutdown_kernel(now=True)  # killed: it cannot say goodbye
    end = time.monotonic() + 20
    while serves(port):
        assert time.monotonic() < end, "the service outlives its kernel"
        time.sleep(0.1)
