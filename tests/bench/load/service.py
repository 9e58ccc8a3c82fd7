"""The service as a user starts it, and what the system says about its processes."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

ROOT = Path(__file__).parents[3]
_START = 120.0  # seconds; a checkout may have to compile the kernels
# Seconds of rest before a service counts as idle: on a busy machine one that works may get no turn for a second.
_IDLE = 4.0


@dataclass(frozen=True, slots=True)
class Usage:
    """What all processes of a service hold, and have spent.

    Attributes:
        seconds: processor time spent so far.
        memory: bytes, of what processes share each its share (Pss).
        threads, files: running threads, open file handles.
    """

    seconds: float
    memory: int
    threads: int
    files: int


@dataclass(frozen=True, slots=True)
class Service:
    """A running service."""

    pid: int
    port: int

    def usage(self) -> Usage:
        """Everything at this moment."""
        found = [_usage(process) for process in family(self.pid)]
        return Usage(
            sum(u.seconds for u in found),
            sum(u.memory for u in found),
            sum(u.threads for u in found),
            sum(u.files for u in found),
        )

    def resident(self) -> int:
        """Resident bytes of all processes: cheaper to find out than `usage`."""
        return sum(process.memory_info().rss for process in family(self.pid))

    def loop_seconds(self) -> float:
        """Processor time that the event loop has spent."""
        process = psutil.Process(self.pid)
        process = next(iter(process.children()), process)  # the service has been started by another process
        return sum(each.user_time + each.system_time for each in process.threads() if each.id == process.pid)

    def seconds(self) -> float:
        """Processor time spent so far: cheaper to find out than `usage`."""
        return sum(seconds_of(process) for process in family(self.pid))


@contextmanager
def serve(**settings: str) -> Iterator[Service]:
    """A service that is ready, on a port of its own, with no other settings than these and KINBOARD_COMPUTE."""
    command = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
    kept = ("KINBOARD_COMPUTE", "KINBOARD_CACHE")
    env = {name: value for name, value in os.environ.items() if name in kept or not name.startswith("KINBOARD_")}
    env |= {f"KINBOARD_{name.upper()}": value for name, value in settings.items()}
    with subprocess.Popen(
        command, cwd=ROOT, env=env | {"PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            if found is None:
                raise RuntimeError("the service did not start")
            service = Service(process.pid, int(found[1]))
            _wait_until_ready(service.port)
            _wait_until_idle(service)
            yield service
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def _wait_until_ready(port: int) -> None:
    end = time.monotonic() + _START
    while time.monotonic() < end:
        try:
            with _direct.open(f"http://127.0.0.1:{port}/readyz", timeout=20):
                return
        except OSError:  # refused, or 503
            time.sleep(0.05)
    raise RuntimeError(f"the service was not ready within {_START:g} s")


def _wait_until_idle(service: Service) -> None:
    """What is imported once the service is ready is not our subject."""
    end = time.monotonic() + _START
    since, before = time.monotonic(), service.seconds()
    while time.monotonic() < end:
        time.sleep(0.5)
        now = service.seconds()
        if now - before >= 0.03 * _IDLE:
            since, before = time.monotonic(), now
        elif time.monotonic() - since >= _IDLE:
            return
    raise RuntimeError(f"the service was not idle within {_START:g} s")


_direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))


def family(pid: int) -> list[psutil.Process]:
    """A process and all below it."""
    parent = psutil.Process(pid)
    return [parent, *parent.children(recursive=True)]


def seconds_of(process: psutil.Process) -> float:
    """Processor time that a process has spent."""
    times = process.cpu_times()
    return float(times.user + times.system)


def _usage(process: psutil.Process) -> Usage:
    return Usage(seconds_of(process), process.memory_full_info().pss, process.num_threads(), process.num_fds())
