"""Processes that compute for REST, so that visitors who drag do not wait for the answers of programs.

Of a process's threads only one at a time runs Python. So the process of the service keeps connections, access,
limits and metrics, and has each longer computation done by another process (:mod:`app.service.compute.child`). It
sends a function with parsed values and gets the bytes of an answer. A process computes one answer at a time. A
computation ends when its client leaves or its time is over: the process is asked to end it, and is killed after
`GRACE`. If a process ends, the request that it computed is lost, and another process takes its place.

Why not a library's pool: `anyio.to_process` ends a computation by killing its process, reads answers on the event
loop, and ends processes that are idle for five minutes; a new one needs one to two seconds until it has imported
the core. `concurrent.futures` loses all processes with one of them, and needs semaphores, which are files in
``/dev/shm``. Here each process has two pipes.
"""

from __future__ import annotations

import asyncio
import copyreg
import io
import pickle
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, TypeVar

from starlette.concurrency import run_in_threadpool

from app.api.work import Deadline, busy
from app.service.compute.child import Begin, robot_called, settings_given
from app.service.compute.process import ComputeProcess, Job, LostError
from app.shared.memory.process import resident_bytes
from app.shared.settings import Settings
from app.shared.store import Store
from kin import Robot

T = TypeVar("T")
Answer = Callable[[Deadline], T]

GRACE = 0.4  # s for a computation to end after its client has left
LATE = 5.0  # s for one whose time is over: a list of targets is answered in part, after the target that it is at


class Pool:
    """So many processes. Methods without a word on threads belong to the event loop.

    Args:
        count: how many.
        settings: as the service has them, for all processes.
        store: the robots, read once, by the service.

    Attributes:
        count: how many there are.
        processes: all of them.
    """

    def __init__(self, count: int, settings: Settings, store: Store) -> None:
        self.count = count
        self._settings, self._store = settings, store
        begin = pickle.dumps(Begin(settings, store.robots))
        self.processes = [ComputeProcess(begin) for _ in range(count)]
        self._free = deque(self.processes)
        self._jobs: dict[Job, ComputeProcess] = {}  # under way

    def start(self) -> None:
        """Start the processes; returns at once. Any thread may call."""
        for process in self.processes:
            threading.Thread(target=process.start, name="kinboard-pool-start", daemon=True).start()

    def wait(self) -> None:
        """Wait until each process takes jobs; raises `LostError` if one does not. Any thread may call."""
        for process in self.processes:
            process.wait()

    async def run(self, answer: Answer[T], deadline: Deadline, took: Callable[[float], object] | None = None) -> T:
        """What `answer` returns in another process, or raises there. The caller has a slot for one of them.

        Args:
            answer: can be pickled, and so can what it returns, unless that is a response.
            deadline: of the request; `answer` gets one that ends with it.
            took: called with the seconds that the process took.
        """
        deadline.check()
        process = self._free.popleft()
        loop, job = asyncio.get_running_loop(), Job(b"", over=time.monotonic() + deadline.left)
        self._jobs[job] = process
        timers = [loop.call_later(deadline.left + LATE, process.kill, job)]

        def left() -> None:
            process.cancel(job)
            timers.append(loop.call_later(GRACE, process.kill, job))

        def ask() -> Any:
            job.message = self.message(answer, deadline.left)
            return process.ask(job, deadline.memory)

        deadline.on_left = left
        try:
            found: T = await run_in_threadpool(ask)
        except LostError:
            deadline.check()  # it was killed because of that
            raise busy("The process that computed this answer has ended.") from None
        except Exception:
            if job.cancelled:
                deadline.check()
            raise
        finally:
            deadline.on_left = None
            for timer in timers:
                timer.cancel()
            self._free.append(process)
            del self._jobs[job]
            if took is not None and job.seconds:
                took(job.seconds)
        return found

    def cancel(self) -> None:
        """End what is being computed."""
        for job, process in self._jobs.items():
            process.cancel(job)
            asyncio.get_running_loop().call_later(GRACE, process.kill, job)

    def stop(self) -> None:
        """End all processes. Any thread may call."""
        for process in self.processes:
            process.stop()

    @property
    def resident(self) -> int:
        """Bytes of memory that the processes take. Any thread may ask."""
        return sum(resident_bytes(pid) for process in self.processes if (pid := process.pid) is not None)

    def message(self, answer: Answer[object], seconds: float) -> bytes:
        """What the process reads. Robots and settings that it has are named, not sent."""
        buffer = io.BytesIO()
        pickler = pickle.Pickler(buffer, pickle.HIGHEST_PROTOCOL)
        pickler.dispatch_table = copyreg.dispatch_table | {Robot: self._robot, Settings: self._given}
        pickler.dump((answer, seconds))
        return buffer.getvalue()

    def _robot(self, robot: Robot) -> Any:
        if robot in self._store:
            return robot_called, (robot.id,)
        return robot.__reduce_ex__(pickle.HIGHEST_PROTOCOL)

    def _given(self, settings: Settings) -> Any:
        if settings is self._settings:
            return settings_given, ()
        return settings.__reduce_ex__(pickle.HIGHEST_PROTOCOL)
