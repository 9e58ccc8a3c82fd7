"""The slow part of the start, in threads next to the running server: the viewer and the compiled kernels.

The landing page is served at once and shows "warming up" until ``/readyz`` reports ready. Kernels are loaded from
numba's cache in milliseconds, or are compiled, which takes seconds. The service is ready when those of the first
arm are; all others are compiled after that, part by part (:mod:`kin.warmup.preparation`), by another process
(:mod:`app.service.compiler`). Of several processes of a service the first one has the kernels compiled, and
the others wait and load them. Those of the first arm are compiled by two such processes at once. A request that
needs a kernel before its turn has it compiled at once, by a process of its own.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from app.classroom import Hub
from app.classroom.courses import Courses
from app.live import Lines
from app.service.compiler import STEP, Compilers, CompilerStoppedError, ahead, compile_first
from app.service.compute.child import load_first, load_rest
from app.service.compute.pool import Pool
from app.service.handover import Member, Phase, Role
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.shared.threads import lower_priority, processors, unpin
from kin.kernels.elsewhere import compile_elsewhere
from kin.warmup import compiled, parts, rest_compiled, warm_up_first, warm_up_rest
from kin.warmup.preparation import Preparation

if TYPE_CHECKING:
    from app.viewer.server import ViewerServer

logger = logging.getLogger("kinboard.startup")

Status = Literal["warming", "ready", "failed"]


class Startup:
    """Starts the viewer and compiles the kernels in a thread; ``/readyz`` reports `status`.

    Args:
        courses: those that pages offer, and their exercises.
        lines: of the pages, to the programs that are connected to them.
        pool: processes that compute, if there are any.
        member: what this process is among those of the service.
        on_ready: called by that thread when everything is ready, just before `status` says so.

    Attributes:
        preparation: which kernels are compiled, for all processes of the service.
        named: whether this process knows the parts of the preparation, for which it looks at all families of arms.
    """

    def __init__(
        self,
        settings: Settings,
        store: Store,
        clouds: Clouds,
        maps: Maps,
        summaries: Summaries,
        classroom: Hub,
        courses: Callable[[], Courses],
        bridge: ViewerBridge,
        lines: Lines,
        pool: Pool | None = None,
        member: Member | None = None,
        on_ready: Callable[[], None] | None = None,
    ) -> None:
        self.status: Status = "warming"
        self._complete = False
        self._member = member
        self._settings = settings
        self._store = store
        self._clouds = clouds
        self._maps = maps
        self._summaries = summaries
        self._classroom = classroom
        self._courses = courses
        self._bridge = bridge
        self._lines = lines
        self._pool = pool
        self._on_ready = on_ready
        self._viewer: ViewerServer | None = None
        self._loop: asyncio.AbstractEventLoop
        self.preparation = Preparation(None if member is None else member.kernels)
        self.named = False
        self.compilers = Compilers()
        self._stopping = threading.Event()
        self._viewer_settled = threading.Event()
        # A daemon, so that Ctrl-C need not wait for the end of a compilation.
        self._thread = threading.Thread(target=self._run, name="kinboard-startup", daemon=True)
        self._rest = threading.Thread(target=self._warm_up_rest, name="kinboard-warm-up", daemon=True)

    @property
    def readiness(self) -> Status:
        """The status of this process and its partners together."""
        if self._member is None:
            return self.status
        phases = [self._member.phases[number] for number in self._member.group]
        if Phase.FAILED in phases:
            return "failed"
        return self.status if min(phases) >= Phase.READY else "warming"

    @property
    def complete(self) -> bool:
        """Whether all kernels are compiled, for this process and its partners."""
        if self._member is None:
            return self._complete
        return all(self._member.phases[number] == Phase.COMPLETE for number in self._member.group)

    def start(self) -> None:
        """Start; returns at once. The viewer serves its visitors in the running event loop."""
        self._loop = asyncio.get_running_loop()
        compile_elsewhere(self.compilers.compile)
        if self._pool is not None:
            self._pool.start()
        self._thread.start()

    def stop(self) -> None:
        """Stop the viewer and the compilation of kernels."""
        self._stopping.set()
        self.compilers.stop()
        if self._pool is not None:
            self._pool.stop()
        compile_elsewhere(None)
        self._viewer_settled.wait(timeout=5.0)
        self._bridge.viewer = None
        if self._viewer is not None:
            self._viewer.stop()

    def _run(self) -> None:
        try:
            self._start_viewer()
            self._wait_for_first(Phase.READY)
            if not compiled():
                unpin()  # also what this thread starts
                second = ["warm_up_first(backwards=True)"] if processors() > 1 else []
                compile_first("warm_up_first()", *second, stopping=self._stopping)
            if not self._stopping.is_set():
                warm_up_first()
                if self._pool is not None:
                    self._pool.prepare(load_first)
                if self._on_ready is not None:
                    self._on_ready()
                self.status = "ready"
                self._report(Phase.READY)
                self._rest.start()
        except CompilerStoppedError:  # by `stop`
            return
        except Exception:
            # REST goes on working; /readyz reports the failure.
            logger.exception("the viewer could not be started, or a kernel could not be compiled")
            self.status = "failed"
            self._report(Phase.FAILED)

    def _report(self, phase: Phase) -> None:
        if self._member is not None and not self._stopping.is_set():
            self._member.report(phase)

    @property
    def _compiles(self) -> bool:
        """Whether this process has the kernels compiled."""
        return self._member is None or self._member.number == 0

    def _wait_for_first(self, phase: Phase, or_begun: bool = False) -> None:
        """Wait until the first process of the service, which has the kernels compiled, is so far.

        Args:
            or_begun: do not wait any longer once it compiles the parts.
        """
        member = self._member
        while member is not None and not self._compiles and member.phases[0] < phase:
            if (or_begun and not self.preparation.complete) or self._stopping.wait(STEP):
                return

    def _warm_up_rest(self) -> None:
        lower_priority()
        ahead.set(True)
        try:
            # Those of the first process, which names the parts before it begins with them, are loaded here.
            self._wait_for_first(Phase.COMPLETE, or_begun=True)
            parts()  # here and not where they are first asked for
            self.named = True
            self._wait_for_first(Phase.COMPLETE)
            if self._compiles:
                self._prepare_parts()
            warm_up_rest(self._stopping.is_set)
            if self._viewer is not None and not self._stopping.is_set():
                importlib.import_module("trimesh.creation")  # before a visitor opens a lesson that draws a sphere
            if self._pool is not None and self._compiles and not self._stopping.is_set():
                self._pool.prepare(load_rest)
            self._complete = not self._stopping.is_set()
            self._report(Phase.COMPLETE)
        except CompilerStoppedError:  # by `stop`
            return
        except Exception:
            # Requests that need this kernel fail; everything else works.
            logger.exception("a kernel could not be compiled ahead of its use")

    def _prepare_parts(self) -> None:
        """Load or compile the parts one after the other, those that visitors wait for first."""
        try:
            if not rest_compiled():
                self.preparation.begin()
            while not (self._stopping.is_set() or self.preparation.complete):
                if (task := self.preparation.next()) is None:
                    break
                name, step = task
                parts()[name][step]()
                self.preparation.done(name)
        finally:
            self.preparation.finish()

    def _start_viewer(self) -> None:
        if self._member is not None and self._member.role is Role.REST:
            self._viewer_settled.set()
            return
        try:
            # Importing viser takes half a second, for which the landing page and REST need not wait.
            from app.viewer.server import ViewerServer

            caches = self._clouds, self._maps, self._summaries
            shared = self._classroom, self.preparation, self._courses()
            viewer = ViewerServer(self._store, self._settings, *caches, *shared, lines=self._lines)
            viewer.start(self._loop)
            self._viewer = self._bridge.viewer = viewer
        finally:
            self._viewer_settled.set()
