"""Another process that compiles kernels: a compiler keeps a gigabyte of memory as long as its process lives."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading

from kin.warmup.preparation import Preparation

STEP = 0.02  # s between two looks at the processes

_PARTS = (
    "import sys\nfrom kin import warmup\n"
    "for line in sys.stdin:\n"
    "    name, step = line.split()\n"
    "    warmup.parts()[name][int(step)]()\n"
    "    print(name, step, flush=True)\n"
)


def compile_first(*calls: str, stopping: threading.Event) -> None:
    """Let other processes, one per call of `kin.warmup`, fill the cache; this one compiles what they leave out."""
    children = [_start(f"from kin import warmup; warmup.{call}", subprocess.DEVNULL) for call in calls]
    try:
        while any(child.poll() is None for child in children) and not stopping.wait(STEP):
            pass
    finally:
        for child in children:
            _end(child)


class PartsCompiler:
    """Compiles the parts of the core in one other process, those that visitors wait for first."""

    def __init__(self, preparation: Preparation) -> None:
        self._preparation = preparation
        self._lock = threading.Lock()
        self._child: subprocess.Popen[str] | None = None
        self._stopped = False

    def run(self) -> bool:
        """Compile until everything is done or `stop` is called. False: the process ended before that."""
        with self._lock:
            if self._stopped:
                return False
            child = self._child = _start(_PARTS, subprocess.PIPE)
        try:
            while (task := self._preparation.next()) is not None:
                name, step = task
                if not _ask(child, f"{name} {step}"):
                    return False
                self._preparation.done(name)
            return True
        finally:
            _end(child)

    def stop(self) -> None:
        """End the other process, whatever it compiles. Any thread may call."""
        with self._lock:
            self._stopped = True
            if self._child is not None:
                self._child.kill()


def _ask(child: subprocess.Popen[str], task: str) -> bool:
    """Have a task done, and wait for that; False: the process has ended."""
    if child.stdin is None or child.stdout is None:
        raise ValueError("the process has no pipes")
    try:
        child.stdin.write(task + "\n")
        child.stdin.flush()
    except OSError:
        return False
    return child.stdout.readline().strip() == task


def _start(program: str, pipe: int) -> subprocess.Popen[str]:
    """A Python process in a session of its own, so that it gets no Ctrl-C."""
    return subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=pipe,
        stdout=pipe,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        text=True,
    )


def _end(child: subprocess.Popen[str]) -> None:
    child.kill()
    child.wait()
    for pipe in (child.stdin, child.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):  # what was not read by the process is lost
                pipe.close()
