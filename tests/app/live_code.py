"""The code of a page, as its visitor gets it."""

from __future__ import annotations

import re

from fake_browser import FakeBrowser


def code_of(page: FakeBrowser) -> str:
    """Press *Connect a program* and read the code."""
    page.send("GuiUpdateMessage", uuid=page.element("Connect a program"), updates={"value": True})
    page.wait(lambda: "data-live-code" in page.html)
    found = re.search(r"data-live-code>([A-Z0-9-]+)<", page.html)
    assert found is not None
    return found[1]
