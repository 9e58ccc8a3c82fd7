"""Of a page that was left, nothing stays in memory."""

from __future__ import annotations

import gc
import time
import weakref

from fake_browser import FakeBrowser
from live_server import serve_viewer

from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.server import ViewerServer

WITHIN = 10.0  # s


def test_pages_that_were_left_are_forgotten() -> None:
    viewer = ViewerServer(Store(), Settings(), Clouds())
    pages: weakref.WeakSet[object] = weakref.WeakSet()
    with serve_viewer(viewer) as port:
        for _ in range(3):
            with FakeBrowser(port) as tab:
                tab.settle()
                pages.update(viewer.pages.values())
        end = time.monotonic() + WITHIN
        # What is in the hands of a thread that waits for its next page may stay: one.
        while len(pages) > 1 and time.monotonic() < end:
            time.sleep(0.05)
            gc.collect()
        assert len(pages) <= 1
