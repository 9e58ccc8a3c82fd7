"""Everything slow about starting, done beside the running server: the viewer, and the compiled kernels.

The page answers at once and says "warming up" until ``/readyz`` does not. Kernels come from numba's cache in
milliseconds, or are compiled on first use, which takes seconds; no visitor should be the one who waits. What few
ask for in the first minute, such as a cloud of the workspace, is compiled when the service is ready already.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from app.service.web.viewer_proxy import ViewerBridge
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.shared.threads import lower_priority
from kin import warm_up, warm_up_rest

if TYPE_CHECKING:
    from app.viewer.server import ViewerServer

logger = logging.getLogger("kinboard.startup")

Status = Literal["warming", "ready", "failed"]


class Startup:
    """Starts the viewer and warms the kernels in a thread of its own; `status` is what ``/readyz`` reports.

    Args:
        on_ready: called by that thread when all is warm, just before ``/readyz`` says so.
    """

    def __init__(
        self,
        settings: Settings,
        store: Store,
        clouds: Clouds,
        maps: Maps,
        summaries: Summaries,
        bridge: ViewerBridge,
        on_ready: Callable[[], None] | None = None,
    ) -> None:
        self.status: Status = "warming"
        self._settings = settings
        self._store = store
        self._clouds = clouds
        self._maps = maps
        self._summaries = summaries
        self._bridge = bridge
        self._on_ready = on_ready
        self._viewer: ViewerServer | None = None
        self._stopping = threading.Event()
        self._viewer_settled = threading.Event()
        # A daemon: Ctrl-C in the middle of a long compilation must not wait for its end.
        self._thread = threading.Thread(target=self._run, name="kinboard-startup", daemon=True)
        self._rest = threading.Thread(target=self._warm_up_rest, name="kinboard-warm-up", daemon=True)

    def start(self) -> None:
        """Begin; returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """End the viewer and what warms up. A compilation under way is left to end with the process."""
        self._stopping.set()
        self._viewer_settled.wait(timeout=5.0)
        self._bridge.port = None
        if self._viewer is not None:
            self._viewer.stop()
        if self._rest.ident is not None:
            self._rest.join(timeout=1.0)

    def _run(self) -> None:
        try:
            self._start_viewer()
            if not self._stopping.is_set():
                warm_up()
                if self._on_ready is not None:
                    self._on_ready()
                self.status = "ready"
                self._rest.start()
        except Exception:
            # REST goes on; /readyz tells whoever watches the service.
            logger.exception("the viewer could not be started, or a kernel could not be compiled")
            self.status = "failed"

    def _warm_up_rest(self) -> None:
        lower_priority()
        try:
            warm_up_rest(self._stopping.is_set)
        except Exception:
            # What this kernel is for fails when it is asked for; everything else works.
            logger.exception("a kernel could not be compiled ahead of its use")

    def _start_viewer(self) -> None:
        try:
            # viser takes half a second to import: the landing page and REST need not wait for it.
            from app.viewer.server import ViewerServer

            viewer = ViewerServer(self._store, self._settings, self._clouds, self._maps, self._summaries)
            self._bridge.port = viewer.start()
            self._viewer = viewer
        finally:
            self._viewer_settled.set()
