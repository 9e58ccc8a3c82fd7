"""The viewer door: a viser server on the loopback interface, one session per connected browser tab."""

from __future__ import annotations

import contextlib
import io
import logging
import threading

import viser

from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.panel.status import Notice
from app.viewer.panel.view import configure_theme
from app.viewer.quick import quick_loops, remember_hints, wake_in_the_loop
from app.viewer.scene.motion import Pace
from app.viewer.session.controller import WELCOME, Session

log = logging.getLogger(__name__)

PATIENCE = 5.0
RESTARTS = 3  # of one visitor's worker: what fails that often will go on failing
RESTARTED = Notice(
    "error",
    "Started again",
    "Something went wrong on our side, so this page begins afresh; the log has the cause.",
)


class ViewerServer:
    """Serves the 3-D page. Bound to 127.0.0.1: the public port bridges to it and decides who may come in.

    Args:
        maps, summaries: shared with REST; None for its own.
    """

    def __init__(
        self,
        store: Store,
        settings: Settings,
        clouds: Clouds,
        maps: Maps | None = None,
        summaries: Summaries | None = None,
    ) -> None:
        self._store = store
        self._clouds = clouds
        self._maps = maps or Maps()
        self._owns_maps = maps is None
        self._summaries = summaries or Summaries()
        self._owns_summaries = summaries is None
        self._settings = settings
        self._server: viser.ViserServer | None = None
        self._sessions: dict[int, Session] = {}
        self._lock = threading.Lock()
        self._pace = Pace()

    def start(self) -> int:
        """Start listening on a free port of 127.0.0.1 and return that port."""
        if self._server is not None:
            raise RuntimeError("the viewer is already running")
        remember_hints()
        wake_in_the_loop()
        # viser prints an address that no visitor should use
        with contextlib.redirect_stdout(io.StringIO()), quick_loops():
            server = viser.ViserServer(host="127.0.0.1", port=0, label="Kinboard", verbose=False)
        self._server = server
        configure_theme(server.gui, dark=False)
        _light(server.scene)
        server.on_client_connect(self._welcome)
        server.on_client_disconnect(self._farewell)
        return server.get_port()

    def stop(self) -> None:
        """End every session and the server; returns when their threads are gone."""
        server, self._server = self._server, None
        if server is None:
            return
        with self._lock:
            sessions, self._sessions = list(self._sessions.values()), {}
        for session in sessions:
            session.end()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()
        for session in sessions:
            if not session.join(PATIENCE):
                log.error("a visitor's worker did not end within %s s", PATIENCE)
        if self._owns_maps:
            self._maps.close()
        if self._owns_summaries:
            self._summaries.close()

    @property
    def visitors(self) -> int:
        """How many tabs are connected."""
        return len(self._sessions)

    async def _welcome(self, client: viser.ClientHandle) -> None:
        self._begin(client, WELCOME, RESTARTS)

    def _begin(self, client: viser.ClientHandle, welcome: Notice, restarts: int) -> None:
        session = Session(
            client,
            self._store,
            self._clouds,
            self._maps,
            self._summaries,
            self._pace,
            self._settings.token is not None,
            welcome,
            lambda: self._again(client, restarts),
        )
        with self._lock:
            self._sessions[client.client_id] = session
        session.start()

    def _again(self, client: viser.ClientHandle, restarts: int) -> None:
        """Begin afresh with a visitor whose worker failed; called by that worker as the last thing it does."""
        with self._lock:
            left = self._sessions.pop(client.client_id, None) is None
        if left:
            return
        if restarts == 0:
            log.error(
                "visitor %s: the worker failed %s times and is not started again", client.client_id, RESTARTS
            )
            return
        client.gui.reset()
        client.scene.reset()
        configure_theme(client.gui, dark=False)
        self._begin(client, RESTARTED, restarts - 1)

    async def _farewell(self, client: viser.ClientHandle) -> None:
        with self._lock:
            session = self._sessions.pop(client.client_id, None)
        if session is not None:
            session.end()


def _light(scene: viser.SceneApi) -> None:
    """Daylight from above and a little from below.

    Instead of viser's environment map: preparing that takes a machine without a graphics card ten seconds and
    more, in which the page stands still.
    """
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=True, cast_shadow=True)
    scene.add_light_hemisphere("/sky", sky_color=(255, 255, 255), ground_color=(176, 184, 200), intensity=1.6)
