"""The viewer: a viser server without a port, with one page per connected browser tab."""

from __future__ import annotations

import asyncio
import hmac
import logging
import threading
import time
from collections.abc import AsyncIterator

import viser

from app.classroom import ClassroomUnavailable, Hub, Ticket
from app.classroom.courses import Courses
from app.exercises import Exercises, Lessons
from app.live import Lines
from app.shared.clouds import Clouds
from app.shared.connection import (
    Connection,
    ConnectionEnded,
    FileRefused,
    PageConnection,
    SentFile,
)
from app.shared.maps import Maps
from app.shared.security import Rights
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.meshes.library.library import Library
from app.viewer.meshes.reader import MeshReader
from app.viewer.page.services import Services
from app.viewer.panel.status import LOOKING, READY, Notice
from app.viewer.panel.theme import configure_theme
from app.viewer.room.page import ClassroomPage
from app.viewer.scene.lights import light_scene
from app.viewer.scene.motion import Pace
from app.viewer.session.page import VisitorPage
from app.viewer.viser_patches import cache_type_hints, log_what_viser_prints
from app.viewer.viser_server import PortlessServer, client_page, start_viser

log = logging.getLogger(__name__)

GONE = "There is no such page any more. Reload it."
STOP_TIMEOUT = 2.0  # s for all workers to end
RESTARTS = 3  # of one visitor's worker; after that, it is assumed to fail again
RESTARTED = Notice(
    "error",
    "Page restarted",
    "An internal error occurred and the page was reset. The server log has the details.",
)


class ViewerServer:
    """Serves the 3-D page to connections. The service has accepted them and checked their access.

    Args:
        maps, summaries, classroom: shared with REST; None: the viewer creates and closes its own.
        courses: shared with REST, as are the exercises in them; None: the viewer reads both.
        lines: shared with REST, which connects programs to them; None: none is.

    Attributes:
        services: what all pages share.
        pages: those of visitors who are there, by viser's number of the visitor.
    """

    def __init__(
        self,
        store: Store,
        settings: Settings,
        clouds: Clouds,
        maps: Maps | None = None,
        summaries: Summaries | None = None,
        classroom: Hub | None = None,
        courses: Courses | None = None,
        lines: Lines | None = None,
    ) -> None:
        known = courses or Courses(
            Exercises(settings.exercises, store.get),
            settings.courses,
            store.get,
            Lessons(settings.lessons, settings.language),
        )
        meshes = MeshReader(settings.mesh_memory, settings.client_share, settings.receive_timeout)
        hub = classroom or Hub.of(settings)
        caches = clouds, maps or Maps(), summaries or Summaries()
        readers = meshes, Library(meshes)
        self.services = Services(store, *caches, *readers, Pace(), known, hub, lines or Lines())
        self._owns_maps = maps is None
        self._owns_summaries = summaries is None
        self._owns_classroom = classroom is None
        self._settings = settings
        self._server: viser.ViserServer | None = None
        self._connections: PortlessServer
        self.pages: dict[int, VisitorPage] = {}
        self._lock = threading.Lock()

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Prepare for `serve` in the running event loop `loop`; call it from another thread than the loop's."""
        if self._server is not None:
            raise RuntimeError("the viewer is already running")
        cache_type_hints()
        log_what_viser_prints()
        server, self._connections = start_viser(loop, label="Kinboard")
        self._server = server
        self._connections.lets_change = self._lets_change
        configure_theme(server.gui, dark=False)
        light_scene(server.scene)
        server.on_client_connect(self._connect)
        server.on_client_disconnect(self._disconnect)

    def page(self) -> bytes:
        """The HTML of the page that connects."""
        return client_page()

    async def serve(self, connection: Connection) -> ConnectionEnded:
        """Serve one visitor until the connection ends; returns why."""
        return await self._connections.serve(connection)

    async def serve_channel(self, connection: PageConnection, name: str) -> ConnectionEnded:
        """Serve the channel of this name until the connection ends; returns why."""
        page = self._page_named(name)
        if page is None:
            return ConnectionEnded(1008, GONE)
        return await page.channel.serve(connection, self._connections.waker.call)

    async def receive_file(self, name: str, sent: SentFile, parts: AsyncIterator[bytes]) -> None:
        """Receive a file for the page whose channel has this name; raises `FileRefused`."""
        page = self._page_named(name)
        if page is None:
            raise FileRefused(404, GONE)
        await page.files.receive(sent, parts)

    def _lets_change(self, number: int, uuid: str) -> bool:
        """Whether the page of this visitor, who may only look, lets a control be changed."""
        page = self.pages.get(number)
        return page is not None and page.lets_change(uuid)

    def _page_named(self, name: str) -> VisitorPage | None:
        """The page whose channel has this name."""
        given = name.encode()
        pages = list(self.pages.values())
        return next((each for each in pages if hmac.compare_digest(each.channel.name.encode(), given)), None)

    def stop(self) -> None:
        """End every page and the server; returns when their threads have ended."""
        server, self._server = self._server, None
        if server is None:
            return
        with self._lock:
            pages, self.pages = list(self.pages.values()), {}
        for page in pages:
            page.end()
        server.stop()
        deadline = time.monotonic() + STOP_TIMEOUT
        for page in pages:
            if not page.join(max(0.0, deadline - time.monotonic())):
                log.error("a visitor's worker did not end within %s s", STOP_TIMEOUT)
        self.services.meshes.close()
        if self._owns_maps:
            self.services.maps.close()
        if self._owns_summaries:
            self.services.summaries.close()
        if self._owns_classroom:
            self.services.classroom.close()

    @property
    def visitors(self) -> int:
        """The number of connected tabs."""
        return len(self.pages)

    async def _connect(self, client: viser.ClientHandle) -> None:
        visitor, ticket, welcome = self._connections.visitors.get(client.client_id), None, READY
        if visitor is not None and visitor.room_token:
            try:
                ticket = await asyncio.to_thread(self._ticket, visitor.room_token)
            except ClassroomUnavailable as error:
                welcome = Notice("error", "Your class is not available", str(error))
        self._start_page(client, welcome, RESTARTS, ticket)

    def _ticket(self, token: str) -> Ticket | None:
        """The ticket of a browser that is in a room which has not ended; raises `ClassroomUnavailable`."""
        hub = self.services.classroom
        ticket = hub.ticket(token)
        return None if ticket is None or hub.rooms.find(ticket) is None else ticket

    def _start_page(
        self, client: viser.ClientHandle, welcome: Notice, restarts: int, ticket: Ticket | None
    ) -> None:
        visitor = self._connections.visitors.get(client.client_id)  # None: the visitor has left
        rights = Rights.LOOK if visitor is None else visitor.rights
        arguments = (
            client,
            self.services,
            self._settings.token is not None,
            LOOKING if welcome is READY and rights is Rights.LOOK else welcome,
            lambda: self._restart(client, restarts, ticket),
            rights,
            "" if visitor is None else visitor.client,
        )
        page = VisitorPage(*arguments) if ticket is None else ClassroomPage(*arguments, ticket=ticket)
        with self._lock:
            if client.client_id not in self._connections.visitors:
                return  # the visitor has left: nobody would end the page
            self.pages[client.client_id] = page
        page.start()

    def _restart(self, client: viser.ClientHandle, restarts: int, ticket: Ticket | None) -> None:
        """Restart the page of a visitor whose worker failed; called last by that worker."""
        with self._lock:
            left = self.pages.pop(client.client_id, None) is None
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
        self._start_page(client, RESTARTED, restarts - 1, ticket)

    async def _disconnect(self, client: viser.ClientHandle) -> None:
        with self._lock:
            page = self.pages.pop(client.client_id, None)
        if page is not None:
            page.end()
