"""The slow part of the start, in a thread next to the running server: the viewer, and the processes that compute.

The landing page and REST are served at once. ``/readyz`` reports ready when the viewer serves visitors and each of
the processes has loaded the core.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from app.service.compute.pool import Pool
from app.service.compute.process import LostError
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.threads import lower_priority

if TYPE_CHECKING:
    from app.viewer.server import ViewerServer

AGAIN = 5.0  # s until processes that could not be started are tried again

logger = logging.getLogger("kinboard.startup")

Status = Literal["starting", "ready", "failed"]


class Startup:
    """Starts the viewer and the processes that compute; ``/readyz`` reports `status`.

    Args:
        make_viewer: makes the viewer.
        bridge: has the viewer serve visitors once it has started.
        pool: processes that compute, if there are any.
        on_ready: called by the thread when everything is ready, just before `status` says so.
    """

    def __init__(
        self,
        make_viewer: Callable[[], ViewerServer],
        bridge: ViewerBridge,
        pool: Pool | None = None,
        on_ready: Callable[[], None] | None = None,
    ) -> None:
        self.status: Status = "starting"
        self._make_viewer = make_viewer
        self._bridge = bridge
        self._pool = pool
        self._on_ready = on_ready
        self._viewer: ViewerServer | None = None
        self._loop: asyncio.AbstractEventLoop
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="kinboard-startup", daemon=True)

    def start(self) -> None:
        """Start; returns at once. The viewer serves its visitors in the running event loop."""
        self._loop = asyncio.get_running_loop()
        if self._pool is not None:
            self._pool.start()
        self._thread.start()

    def stop(self) -> None:
        """Stop the viewer and the processes."""
        self._stopping.set()
        if self._pool is not None:
            self._pool.stop()
        self._thread.join(timeout=5.0)
        self._bridge.viewer = None
        if self._viewer is not None:
            self._viewer.stop()

    def _run(self) -> None:
        try:
            viewer = self._make_viewer()
            viewer.start(self._loop)
            self._viewer = self._bridge.viewer = viewer
        except Exception:
            if not self._stopping.is_set():
                # REST goes on working; /readyz reports the failure.
                logger.exception("the viewer could not be started")
                self.status = "failed"
            return
        if self._pool is not None:
            self._wait(self._pool)
        if self._stopping.is_set():
            return
        if self._on_ready is not None:
            self._on_ready()
        self.status = "ready"
        lower_priority()
        importlib.import_module("trimesh.creation")  # before a visitor opens a lesson that draws a sphere

    def _wait(self, pool: Pool) -> None:
        """Wait until all processes compute, or the service stops."""
        while not self._stopping.is_set():
            try:
                pool.wait()
            except (LostError, OSError) as error:
                if not self._stopping.is_set():
                    logger.error("a process that computes could not be started, and is tried again: %r", error)
                    self.status = "failed"
            else:
                break
            self._stopping.wait(AGAIN)
