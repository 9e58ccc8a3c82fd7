"""The slow part of the start, in threads next to the running server: the viewer and the compiled kernels.

The landing page is served at once and shows "warming up" until ``/readyz`` reports ready. Kernels are loaded from
numba's cache in milliseconds, or are compiled, which takes seconds. The service is ready when those of the first
arm are; all others are compiled after that, part by part (:mod:`app.shared.preparation`). Other processes compile
(:mod:`app.service.compiler`): two of them, on one processor one, the kernels of the first arm, one the others, and
one what a request needs before its turn. The processes that compute for REST load what is compiled.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Literal

from app.service.compiler import Compilers, CompilerStoppedError, ahead
from app.service.compute.child import load_first, load_rest
from app.service.compute.pool import Pool
from app.service.web.viewer_proxy import ViewerBridge
from app.shared.preparation import Preparation
from app.shared.threads import lower_priority, processors
from kin.kernels.elsewhere import compile_elsewhere
from kin.warmup import compiled, rest_compiled, warm_up_first, warm_up_rest

if TYPE_CHECKING:
    from app.viewer.server import ViewerServer

logger = logging.getLogger("kinboard.startup")

Status = Literal["warming", "ready", "failed"]


class Startup:
    """Starts the viewer and compiles the kernels in a thread; ``/readyz`` reports `status`.

    Args:
        make_viewer: makes the viewer from the state of the kernels.
        bridge: has the viewer serve visitors once it has started.
        pool: processes that compute, if there are any.
        on_ready: called by that thread when everything is ready, just before `status` says so.

    Attributes:
        complete: whether all kernels are compiled.
        preparation: which kernels are compiled.
    """

    def __init__(
        self,
        make_viewer: Callable[[Preparation], ViewerServer],
        bridge: ViewerBridge,
        pool: Pool | None = None,
        on_ready: Callable[[], None] | None = None,
    ) -> None:
        self.status: Status = "warming"
        self.complete = False
        self._make_viewer = make_viewer
        self._bridge = bridge
        self._pool = pool
        self._on_ready = on_ready
        self._viewer: ViewerServer | None = None
        self._loop: asyncio.AbstractEventLoop
        self.preparation = Preparation()
        self.compilers = Compilers()
        self._stopping = threading.Event()
        self._viewer_settled = threading.Event()
        # A daemon, so that Ctrl-C need not wait for the end of a compilation.
        self._thread = threading.Thread(target=self._run, name="kinboard-startup", daemon=True)
        self._rest = threading.Thread(target=self._warm_up_rest, name="kinboard-warm-up", daemon=True)

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
            if not rest_compiled():  # before there are pages: they wait for what is missing
                self.preparation.begin()
            self._start_viewer()
            if not (compiled() or self._stopping.is_set()):
                with ThreadPoolExecutor(2, "kinboard-warm-up") as threads:
                    list(threads.map(self._warm_up_first, (False, True)[: processors()]))
            if not self._stopping.is_set():
                warm_up_first()
                if self._pool is not None:
                    self._pool.prepare(load_first)
                if self._on_ready is not None:
                    self._on_ready()
                self.status = "ready"
                self._rest.start()
        except CompilerStoppedError:  # by `stop`
            return
        except Exception:
            # REST goes on working; /readyz reports the failure.
            logger.exception("the viewer could not be started, or a kernel could not be compiled")
            self.status = "failed"
        finally:
            if self.status != "ready":  # nobody compiles the others: pages do not wait for them
                self.preparation.finish()

    @staticmethod
    def _warm_up_first(backwards: bool) -> None:
        ahead.set(backwards)  # each has a compiling process
        warm_up_first(backwards=backwards)

    def _warm_up_rest(self) -> None:
        lower_priority()
        ahead.set(True)
        try:
            self._prepare_parts()
            warm_up_rest(self._stopping.is_set)
            if self._viewer is not None and not self._stopping.is_set():
                importlib.import_module("trimesh.creation")  # before a visitor opens a lesson that draws a sphere
            if self._pool is not None and not self._stopping.is_set():
                self._pool.prepare(load_rest)
            self.complete = not self._stopping.is_set()
        except CompilerStoppedError:  # by `stop`
            return
        except Exception:
            # Requests that need this kernel fail; everything else works.
            logger.exception("a kernel could not be compiled ahead of its use")

    def _prepare_parts(self) -> None:
        """Load or compile the parts one after the other, those that visitors wait for first."""
        try:
            while not self._stopping.is_set() and (task := self.preparation.next()) is not None:
                name, step = task
                step()
                self.preparation.done(name)
        finally:
            self.preparation.finish()

    def _start_viewer(self) -> None:
        try:
            viewer = self._make_viewer(self.preparation)
            viewer.start(self._loop)
            self._viewer = self._bridge.viewer = viewer
        finally:
            self._viewer_settled.set()
