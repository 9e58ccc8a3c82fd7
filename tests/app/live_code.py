"""The code of a page, as its visitor gets it, and a network that fails."""

from __future__ import annotations

import re
import socket

from fake_browser import FakeBrowser

from app.live.client.page import Page


def code_of(page: FakeBrowser) -> str:
    """Press *Connect a program* and read the code."""
    page.send("GuiUpdateMessage", uuid=page.element("Connect a program"), updates={"value": True})
    page.wait(lambda: "data-live-code" in page.html)
    found = re.search(r"data-live-code>([A-Z0-9-]+)<", page.html)
    assert found is not None
    return found[1]


def fail_network(program: Page) -> None:
    """End the connection of a program without a word, as a network does that fails."""
    program._connection._socket.socket.shutdown(socket.SHUT_RDWR)
